// Where a place lies.
#include "kernel.hpp"

namespace flintknap {
namespace {

double d_min(Kernel& k) {
    auto turn = k.take_turn();
    return k.object().widening().limit().d;
}

auto side_many(Kernel& k, DoubleArray x, DoubleArray y) {
    std::vector<std::int8_t> answers(x.shape(0));
    auto turn = k.with_ring();
    {
        nb::gil_scoped_release others_may_run;
        Sides sides(k.object().ring());
        sides.ask(
            answers.size(), [&](std::size_t i) { return Point{x(i), y(i)}; },
            [&](std::size_t i, int answer) { answers[i] = static_cast<std::int8_t>(answer); });
    }
    return to_numpy(std::move(answers));
}

}  // namespace

void bind_boundary(KernelClass& kernel) {
    using namespace nb::literals;
    kernel.def("d_min", d_min).def("side_many", side_many, "x"_a, "y"_a);
}

}  // namespace flintknap
