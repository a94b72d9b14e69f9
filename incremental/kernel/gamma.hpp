// gamma0 and gamma1 of any pair of sites.
//
// Theory (section 2.1). On each side of the line through a and b let phi be the largest angle under
// which a site sees them. The side's value is 1 - sin phi if phi <= 90 degrees, sin phi - 1 if
// larger, 1 if no site is there. Values rise with cot phi, so the work is done on cotangents, which
// are correctly rounded, and only what is told to others becomes a value.
//
// Who sees ab under the largest angle? If ab is an edge of the triangulation, the apexes of the two
// triangles on it. If not, ab crosses triangles, and if it were forced in as a constraint they
// would make room for others, with corners among theirs; those on ab would have empty discs but for
// what lies beyond ab. So the largest angle of each side stands at a corner of a triangle that ab
// crosses; among those it is found by exact in-circle tests.
//
//            o-------o           left corners above, right ones below: one of them each
//           / \     / \          sees ab under the largest angle
//          a - \ - / - b
//           \   \ /   /
//            o---o---o
//
// A site between a and b leaves the pair without values: it is an edge of no graph.
//
// Of two cotangents of one magnitude and different signs, as of cocircular sites, the negative one
// belongs to gamma0 if no site is in the circle, for gamma1 >= 0 iff ab is a Delaunay edge. Since
// rounding makes equal what is not, that is decided by an in-circle test.
//
// Cost: O(degree) for an edge of the triangulation, and for another pair the number of triangles it
// crosses, O(sqrt n) expected on uniform sets.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "triangulation.hpp"

namespace flintknap {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// The cotangents of the largest angles of both sides, infinite where no site is; the smaller
// magnitude, that of gamma0, first. Not numbers if a site lies between a and b.
struct Facing {
    double first, second;
    bool is_pair() const { return !std::isnan(first); }
};

constexpr Facing kBlocked = {std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::quiet_NaN()};

// The value of a side. With w = tan(45 degrees + phi / 2), 1 - sin phi = 2 / (1 + w^2): nothing
// cancels, and the steps are monotone, so the whole is. 0, 1 and -1 are only what is exactly so.
inline double gamma_of_cotangent(double cot) {
    if (std::isinf(cot)) return std::copysign(1.0, cot);
    if (cot == 0) return 0;
    double tangent = 1 / std::fabs(cot);
    double w = tangent + std::sqrt(1 + tangent * tangent);
    double value = 2 / (1 + w * w);
    value = std::max(value, std::numeric_limits<double>::denorm_min());
    return std::copysign(std::min(value, 1 - kUlp), cot);
}

// The smallest cotangent of which the value is at least `value`, by bisection of all doubles.
inline double least_cotangent(double value) {
    auto number = [](double v) {  // doubles as integers in their order
        std::int64_t bits;
        std::memcpy(&bits, &v, sizeof bits);
        return bits < 0 ? std::numeric_limits<std::int64_t>::min() - bits : bits;
    };
    auto named = [](std::int64_t n) {
        double v;
        if (n < 0) n = std::numeric_limits<std::int64_t>::min() - n;
        std::memcpy(&v, &n, sizeof v);
        return v;
    };
    std::int64_t low = number(-kInfinite), high = number(kInfinite);
    while (low < high) {
        std::int64_t middle = (low & high) + ((low ^ high) >> 1);
        if (gamma_of_cotangent(named(middle)) >= value) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    return named(low);
}

// A closed interval of values, as one of correctly rounded cotangents.
struct Interval {
    double low, high;
    static Interval of_values(double low, double high) {
        return {least_cotangent(low), -least_cotangent(-high)};  // the value is an odd function
    }
    bool holds(double cot) const { return low <= cot && cot <= high; }
    bool is_everything() const { return low == -kInfinite && high == kInfinite; }
    bool operator==(const Interval& o) const { return low == o.low && high == o.high; }
};

// Both sides in their order; of a tie the negative one first if the pair is a Delaunay edge.
inline Facing in_order(double cot, double other, bool is_delaunay) {
    double magnitude = std::fabs(cot), others = std::fabs(other);
    bool swap = magnitude == others ? (cot < 0) != is_delaunay : magnitude > others;
    return swap ? Facing{other, cot} : Facing{cot, other};
}

// The side on which the triangle of half-edge h lies.
inline double cotangent_of_side(const Triangulation& t, Index h) {
    const Mesh& m = t.mesh();
    if (m.apex(h) == kGhost) return kInfinite;
    return cotangent(t.site(m.origin(h)), t.site(m.target(h)), t.site(m.apex(h)));
}

inline Facing facing_edge(const Triangulation& t, Index h) {
    return in_order(cotangent_of_side(t, h), cotangent_of_side(t, t.mesh().twin(h)), true);
}

// The half-edge through which the way from a to b leaves the triangles about a, from right to left;
// one from a to b if there is an edge; kNone if a site lies in between. Needs triangles.
inline Index first_crossed(const Triangulation& t, Index a, Index b) {
    const Mesh& m = t.mesh();
    Point from = t.site(a), to = t.site(b);
    Index h = m.leaving(a), right = kNone;
    for (;; h = m.turn(h)) {
        Index x = m.target(h);
        if (x == kGhost) {
            right = kNone;
            continue;
        }
        if (x == b) return h;
        int turn = orient(from, t.site(x), to);
        if (turn == 0 && dot_sign(t.site(x), to, from) > 0) return kNone;
        // the one before, on the right, had b on its left: b is between the two
        if (turn < 0 && right != kNone) return Mesh::next(right);
        right = turn > 0 ? h : kNone;
    }
}

// What sees the pair a, b, which need not be an edge. Needs triangles.
inline Facing facing_pair(const Triangulation& t, Index a, Index b) {
    const Mesh& m = t.mesh();
    Index e = first_crossed(t, a, b);
    if (e == kNone) return kBlocked;
    if (m.origin(e) == a) return facing_edge(t, e);
    Point from = t.site(a), to = t.site(b);
    Point left = t.site(m.target(e)), right = t.site(m.origin(e));
    for (;;) {
        e = m.twin(e);
        Index z = m.apex(e);
        if (z == b) break;
        Point p = t.site(z);
        int turn = orient(from, to, p);
        if (turn == 0) return kBlocked;
        if (turn > 0) {
            if (in_circle(from, to, left, p) > 0) left = p;
            e = Mesh::next(e);
        } else {
            if (in_circle(to, from, right, p) > 0) right = p;
            e = Mesh::prev(e);
        }
    }
    double on_left = cotangent(from, to, left), on_right = cotangent(to, from, right);
    bool is_delaunay = on_left == -on_right && in_circle(from, to, left, right) == 0;
    return in_order(on_left, on_right, is_delaunay);
}

// The same for many pairs of any set, flat ones included: on a line only neighbours are pairs.
class FacingPairs {
   public:
    explicit FacingPairs(const Triangulation& t) : t_(t) {
        if (!t.is_flat()) return;
        place_.resize(at(t.slots()));
        std::vector<Index> line = t.along_line();
        for (std::size_t n = 0; n < line.size(); ++n) place_[at(line[n])] = static_cast<Index>(n);
    }
    Facing operator()(Index a, Index b) const {
        if (!t_.is_flat()) return facing_pair(t_, a, b);
        if (std::abs(place_[at(a)] - place_[at(b)]) > 1) return kBlocked;
        return {kInfinite, kInfinite};
    }

   private:
    const Triangulation& t_;
    std::vector<Index> place_;  // along the line
};

}  // namespace flintknap
