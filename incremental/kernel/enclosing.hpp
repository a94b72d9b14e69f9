// The smallest disc that holds some points, by exact signs.
//
// Theory (section 4.1). The disc is unique; two points of its rim, or three, determine it. Points
// are taken in random order; one that lies outside the disc of those before it is on the rim of the
// next, so the disc is sought anew among those before, with that point on its rim, and likewise for
// the second and the third (Welzl 1991).
//
// Invariants: the disc is a function of the set; which points hold it up is not.
// Cost: O(n) expected, and O(m^2) for m vertices on the rim.
#pragma once

#include <algorithm>
#include <array>
#include <random>
#include <utility>
#include <vector>

#include "predicates.hpp"
#include "triangulation.hpp"

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

// Sign of |ab| - |cd|.
inline int compare_lengths(Point a, Point b, Point c, Point d) {
    double abx = a.x - b.x, aby = a.y - b.y, cdx = c.x - d.x, cdy = c.y - d.y;
    double ab = abx * abx + aby * aby, cd = cdx * cdx + cdy * cdy;
    if (std::fabs(ab - cd) > 8 * kUlp * (ab + cd)) return ab > cd ? 1 : -1;
    return (exact_dot(a, a, b) - exact_dot(c, c, d)).sign();
}

// The smallest disc that holds all sites. Those of the hull suffice.
inline Disc find_disc(const Triangulation& t) {
    std::vector<Vertex> hull;
    for (Index h : t.hull()) {
        Index v = t.mesh().origin(h);
        hull.push_back({v, t.site(v)});
    }
    return smallest_disc(hull);
}

// The two vertices on the rim that are farthest apart, ties by coordinates; the smaller first.
inline std::array<Vertex, 2> find_base(const Triangulation& t, const Disc& disc) {
    std::vector<Vertex> rim;
    for (Index h : t.hull()) {
        Index v = t.mesh().origin(h);
        if (disc.side(t.site(v)) == 0) rim.push_back({v, t.site(v)});
    }
    std::sort(rim.begin(), rim.end(), [](const Vertex& a, const Vertex& b) { return a.at < b.at; });
    std::array<Vertex, 2> best{rim[0], rim[1]};
    for (std::size_t i = 0; i < rim.size(); ++i) {
        for (std::size_t j = i + 1; j < rim.size(); ++j) {
            if (compare_lengths(rim[i].at, rim[j].at, best[0].at, best[1].at) > 0) {
                best = {rim[i], rim[j]};
            }
        }
    }
    return best;
}

}  // namespace flintknap
