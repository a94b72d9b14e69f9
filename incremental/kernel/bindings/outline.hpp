// The ring as Python's results hold it.
#pragma once

#include <memory>

#include "../outline.hpp"

namespace flintknap {

struct HeldOutline {
    std::shared_ptr<const Outline> held;
};

}  // namespace flintknap
