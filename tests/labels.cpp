// Labels rise along a list, wherever items come, and few are given anew.
//
// Prints what broke, and fails if anything did.
#include "labels.hpp"

#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

using namespace flintknap;

namespace {

[[noreturn]] void fail(const std::string& what) {
    std::printf("%s\n", what.c_str());
    std::exit(1);
}

class List {
   public:
    Index before(Index x) const { return links_[at(x)].before; }
    Index behind(Index x) const { return links_[at(x)].behind; }
    Label label(Index x) {
        ++looked_;
        return links_[at(x)].label;
    }
    void set_label(Index x, Label label) {
        ++looked_;
        links_[at(x)].label = label;
    }

    // A new item behind another one, or first (kNone).
    Index add(Index other) {
        Index x = static_cast<Index>(links_.size()),
              after = other == kNone ? first_ : behind(other);
        links_.push_back({other, after, 0});
        (other == kNone ? first_ : links_[at(other)].behind) = x;
        if (after != kNone) links_[at(after)].before = x;
        return x;
    }

    void check() const {
        std::uint64_t reached = 0;
        for (Index x = first_; x != kNone; x = behind(x)) {
            if (links_[at(x)].label <= reached) fail("labels do not rise");
            reached = links_[at(x)].label;
        }
    }
    double looked() const { return static_cast<double>(looked_); }

   private:
    struct Item {
        Index before, behind;
        Label label;
    };
    std::vector<Item> links_;
    Index first_ = kNone;
    std::size_t looked_ = 0;
};

// n items come; where(i, last) is the one that the i-th comes behind, `last` being the one before.
template <class F>
void grow(int n, const char* name, F&& where) {
    List list;
    Index last = kNone;
    for (int i = 0; i < n; ++i) {
        last = list.add(where(i, last));
        give_label(list, last);
        if (i % 1000 == 0) list.check();
    }
    list.check();
    if (list.looked() > 100.0 * n) fail(std::string(name) + ": too many labels are given anew");
}

}  // namespace

int main() {
    constexpr int n = 60000;
    std::mt19937 dice(7);
    grow(n, "at the end", [](int, Index last) { return last; });
    grow(n, "at the start", [](int, Index) { return kNone; });
    grow(n, "in the middle", [](int i, Index) { return i < 2 ? i - 1 : 0; });
    grow(n, "from both sides",
         [](int i, Index last) { return i < 2 || i % 2 != 0 ? last : last - 1; });
    grow(n, "anywhere", [&](int i, Index) {
        return i == 0 ? kNone : static_cast<Index>(dice() % static_cast<unsigned>(i));
    });

    List several;  // many that have none yet, among some that have
    for (Index x = 0; x < 100; ++x) several.add(x - 1);
    give_label(several, 50);
    several.check();
    for (int i = 0; i < 100; ++i) several.add(20);
    give_label(several, several.behind(20));
    several.check();
}
