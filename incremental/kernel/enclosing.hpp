// The smallest disc that holds some points, by exact signs.
//
// Theory (section 4.1). The disc is unique; two points of its rim, or three, determine it. Points
// are taken in random order; one that lies outside the disc of those before it is on the rim of the
// next, so the disc is sought anew among those before, with that point on its rim, and likewise for
// the second and the third (Welzl 1991).
//
// Invariants: the disc is a function of the set; which points hold it up is not.
// Cost: O(n) expected.
#pragma once

#include <array>
#include <random>
#include <utility>
#include <vector>

#include "mesh.hpp"
#include "predicates.hpp"

namespace flintknap {

// A slot and the site in it.
struct Vertex {
    Index index = kNone;
    Point at{};
};

// Held up by `count` vertices: the one, two ends of a diameter, or three that turn left.
struct Disc {
    std::array<Vertex, 3> rim{};
    int count = 0;

    // +1 inside, 0 on the rim, -1 outside.
    int side(Point v) const {
        if (count == 0) return -1;
        if (count == 1) return v == rim[0].at ? 0 : -1;
        if (count == 2) return -dot_sign(rim[0].at, rim[1].at, v);
        return in_circle(rim[0].at, rim[1].at, rim[2].at, v);
    }
};

inline Disc disc_through(Vertex a, Vertex b, Vertex c) {
    if (orient(a.at, b.at, c.at) < 0) std::swap(b, c);
    return {{a, b, c}, 3};
}

// Shuffles the vertices.
inline Disc smallest_disc(std::vector<Vertex>& of) {
    std::minstd_rand dice;
    for (std::size_t n = of.size(); n > 1; --n) std::swap(of[n - 1], of[dice() % n]);
    Disc disc;
    for (std::size_t i = 0; i < of.size(); ++i) {
        if (disc.side(of[i].at) >= 0) continue;
        disc = {{of[i]}, 1};
        for (std::size_t j = 0; j < i; ++j) {
            if (disc.side(of[j].at) >= 0) continue;
            disc = {{of[i], of[j]}, 2};
            for (std::size_t k = 0; k < j; ++k) {
                if (disc.side(of[k].at) < 0) disc = disc_through(of[i], of[j], of[k]);
            }
        }
    }
    return disc;
}

}  // namespace flintknap
