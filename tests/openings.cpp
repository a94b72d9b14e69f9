// Openings of gates against a plain sorted list, through random pushes and pops.
//
// Keys rise, as in a run from scratch, or do what they like; few of them, so that they tie, nearly
// equal ones, so that they share a bin, and such as no bin is large enough for. Some openings lead
// nowhere, at once or after a while. Prints what broke, and fails if anything did.
#include "openings.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <set>
#include <string>
#include <vector>

using namespace flintknap;

namespace {

void expect(bool holds, const char* what) {
    if (holds) return;
    std::printf("%s\n", what);
    std::exit(1);
}

class Model {
   public:
    Model(unsigned seed, const Triangulation& t)
        : dice_(seed), t_(t), list_(Smaller{t}), openings_(t), kind_(random(5)) {
        const Mesh& m = t.mesh();
        for (Index x = 0; x < m.triangles(); ++x) {
            if (m.is_free(x) || m.is_ghost(x)) continue;
            for (Index h = Mesh::first(x); h < Mesh::first(x) + 3; ++h) edges_.push_back(h);
        }
        std::shuffle(edges_.begin(), edges_.end(), dice_);
        leads_nowhere_.assign(at(Mesh::first(m.triangles())), false);
        is_announced_ = is_dropped_ = leads_nowhere_;
    }

    // Some gates stand open first; behind each that is taken, up to two more open.
    void run() {
        for (std::size_t n = 1 + random(edges_.size()); n > 0; --n) push(0);
        double last = 0;
        while (any()) {
            Opening next = openings_.pop();
            drop_until(next);
            expect(list_.erase(next) == 1, "popped what was not there");
            expect(!is_dropped_[at(next.edge)], "not dropped");
            if (random(8) > 0) last = next.key;
            for (std::size_t n = random(3); n > 0 && !edges_.empty(); --n) push(last);
            for (int n = 0; n < 3; ++n) leads_nowhere_[random(leads_nowhere_.size())] = true;
        }
        while (!list_.empty()) drop_first();
    }

   private:
    struct Smaller {
        const Triangulation& t;
        bool operator()(const Opening& a, const Opening& b) const {
            return smaller(t, a.gate(), b.gate());
        }
    };

    std::size_t random(std::size_t n) {
        return std::uniform_int_distribution<std::size_t>(0, n - 1)(dice_);
    }
    double normal() { return std::normal_distribution<double>()(dice_); }

    double key(double last) {
        switch (kind_) {
            case 0: return normal();
            case 1: return last + std::fabs(normal()) / 8 - 0.01;
            case 2: return std::round(2 * normal());
            case 3: return 1 + 1e-12 * normal();
            default: return std::copysign(std::exp(200 * normal()), normal());
        }
    }

    void push(double last) {
        Opening made{key(last), edges_.back(), t_.mesh().apex(edges_.back())};
        edges_.pop_back();
        leads_nowhere_[at(made.edge)] = random(4) == 0;
        openings_.push(made);
        list_.insert(made);
    }

    bool any() {
        return openings_.any([&](const Opening& o) { is_announced_[at(o.edge)] = true; },
                             [&](const Opening& o) {
                                 expect(is_announced_[at(o.edge)], "asked for, never fetched");
                                 is_dropped_[at(o.edge)] = leads_nowhere_[at(o.edge)];
                                 return !is_dropped_[at(o.edge)];
                             });
    }

    // Those that are smaller must have been dropped.
    void drop_until(const Opening& next) {
        while (!list_.empty() && Smaller{t_}(*list_.begin(), next)) drop_first();
    }
    void drop_first() {
        expect(leads_nowhere_[at(list_.begin()->edge)], "not popped, or in another order");
        list_.erase(list_.begin());
    }

    std::mt19937_64 dice_;
    const Triangulation& t_;
    std::set<Opening, Smaller> list_;
    Openings openings_;
    std::size_t kind_;
    std::vector<Index> edges_;  // not pushed yet
    std::vector<bool> leads_nowhere_, is_announced_, is_dropped_;
};

}  // namespace

int main(int, char** arguments) {
    unsigned seed = static_cast<unsigned>(std::atoi(arguments[1]));
    unsigned end = static_cast<unsigned>(std::atoi(arguments[2]));
    for (std::size_t sites : {3, 40, 5000}) {
        Triangulation t;
        t.reserve(sites);
        std::mt19937_64 dice(sites);
        std::uniform_real_distribution<double> unit;
        Nobody nobody;
        for (std::size_t n = 0; n < sites; ++n) t.insert({unit(dice), unit(dice)}, kNone, nobody);
        for (unsigned s = seed; s < end; ++s) Model(s, t).run();
    }
    return 0;
}
