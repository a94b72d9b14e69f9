// A smooth boundary: one Bezier segment a side, passing each vertex in the direction of a tangent.
//
// Theory (section 5.1). With a and b the sides before and behind a vertex v, the tangent T at v is
// a weighted sum of the two. The cubic along a side has its inner control points a third of the
// way to the projections of the far ends on the tangent lines, so at v they lie at
//     v - T (a.T / 3 T.T)   and   v + T (b.T / 3 T.T),
// and the curve is G1 there iff a.T > 0 and b.T > 0. Uniform weights always have that: T bisects
// the turn from a to b, which is less than 180 degrees, so it is less than 90 from either. Weights
// by length have it iff the triangle of v and its neighbours is acute at both neighbours, for then
// T is its third side d and a.d, b.d are the dot products there. Weights by inverse length have it
// iff those by length have: |b|^2 a.T = b.d and |a|^2 b.T = a.d.
//
// Where it fails the tangent is turned towards the uniform one: to the middle between that one and
// the direction from which on the condition holds, which is at right angles to the side it failed
// for. The signs are exact: first those of the weights themselves, from the points; then those of
// the rounded T that is returned. At a needle, whose sides fold back within a few 1e-16, even the
// rounded bisector may fail; then T is the direction of smallest whole coordinates that does not,
// found exactly, or it is proven that no two doubles make one: a cusp, with no handles.
//
// Result. A function of three vertices, the same bits everywhere: dot products are correctly
// rounded, square roots by the standard. Cost: O(1) a vertex, a needle O(log^2) of its angle.
#pragma once

#include <optional>

#include "predicates.hpp"

namespace flintknap {

enum class Weights { length, uniform, inverse };
enum class Kind : std::uint8_t { weighted, adjusted, cusp };

struct Tangent {
    Point direction;             // of unit length, but at needles
    double back = 0, ahead = 0;  // how many times the direction lies before the vertex, and behind
    Kind kind = Kind::weighted;
};

// A vertex v between its neighbours p and q.
struct Corner {
    Point p, v, q;
};

inline Point operator+(Point a, Point b) { return {a.x + b.x, a.y + b.y}; }
inline Point operator*(double s, Point a) { return {s * a.x, s * a.y}; }

inline Point unit(Point a) {
    double length = std::sqrt(a.x * a.x + a.y * a.y);
    return {a.x / length, a.y / length};
}

// A quarter turn, to the left or to the right.
inline Point turned(Point a, int turn) { return turn < 0 ? Point{a.y, -a.x} : Point{-a.y, a.x}; }

// (tip - tail) . t, correctly rounded; so its sign is exact.
inline double rounded_dot(Point tip, Point tail, Point t) {
    Pair dx = two_diff(tip.x, tail.x), dy = two_diff(tip.y, tail.y);
    Pair x = two_product(dx.high, t.x), y = two_product(dy.high, t.y);
    x.low += dx.low * t.x;
    y.low += dy.low * t.y;
    Pair sum = pair_sum(x, y);
    // Every rounding above is at most 2^-103 of one of these magnitudes; 2^-98 leaves room.
    constexpr double unit_error = 1.0 / (1ULL << 49) / (1ULL << 49);
    double error = unit_error * (std::fabs(x.high) + std::fabs(y.high));
    double low = sum.high + (sum.low - error), high = sum.high + (sum.low + error);
    if (low == high) return low;
    Expansion<8> exact = difference(tip.x, tail.x) * t.x + difference(tip.y, tail.y) * t.y;
    if (exact.sign() == 0) return 0;
    Expansion<16> one;
    one.append(1);
    return rounded_quotient(exact + Expansion<8>{}, one, exact.estimate());
}

// Tries a direction; says whether the curve may pass in it.
inline bool accept(const Corner& c, Point direction, Tangent& out) {
    double back = rounded_dot(c.v, c.p, direction), ahead = rounded_dot(c.q, c.v, direction);
    if (!(back > 0 && ahead > 0)) return false;
    double thrice = 3 * (direction.x * direction.x + direction.y * direction.y);
    out.direction = direction;
    out.back = back / thrice;
    out.ahead = ahead / thrice;
    return true;
}

// The direction x : y of smallest whole numbers, in units of a power of two each, among those that
// the curve may pass in: a narrow wedge about one in the same quadrant. Walks down the Stern-Brocot
// tree: `low` and `high` are neighbouring fractions on either side of the wedge.
//
//     (1, 0) ------ low ------ wedge ------ high ------ (0, 1)
//
// Their sum lies between them. The one on whose side it is moves by as many of the other as leave
// it there; the first sum within the wedge is what is looked for.
inline bool simplest(const Corner& c, Point around, Tangent& out) {
    constexpr double limit =
        1ULL << 53;  // whole numbers below it are exact, and no others fall below
    if (around.x == 0 || around.y == 0) return false;
    int ex = std::ilogb(around.x), ey = std::ilogb(around.y);
    if (std::fabs(std::scalbn(around.y, -ey)) < std::fabs(std::scalbn(around.x, -ex))) --ey;
    for (int shift : {0, 1}) {  // all ratios of two doubles that lie there are of one of these
        double sx = std::copysign(std::scalbn(1.0, ex), around.x);
        double sy = std::copysign(std::scalbn(1.0, ey + shift), around.y);
        auto is_behind = [&](Point w) { return rounded_dot(c.v, c.p, {sx * w.x, sy * w.y}) > 0; };
        auto is_before = [&](Point w) { return rounded_dot(c.q, c.v, {sx * w.x, sy * w.y}) > 0; };
        Point ends[2] = {{1, 0}, {0, 1}};
        bool low_is_behind = is_behind(ends[0]);
        enum { low, high, inside };
        auto where = [&](Point w) {
            bool behind = is_behind(w);
            if (behind && is_before(w)) return inside;
            return behind == low_is_behind ? low : high;
        };
        auto fits = [&](Point w) { return w.x < limit && w.y < limit; };
        for (Point w = ends[low] + ends[high]; fits(w); w = ends[low] + ends[high]) {
            int found = where(w);
            if (found == inside) {
                Point t{sx * w.x, sy * w.y};
                double most = std::max(std::fabs(t.x), std::fabs(t.y));
                return accept(c, std::scalbn(1.0, -std::ilogb(most)) * t, out);
            }
            Point &mover = ends[found], other = ends[1 - found];
            double count = 1, step = 1;
            for (bool is_growing = true; step >= 1; step = is_growing ? 2 * step : step / 2) {
                w = mover + (count + step) * other;
                if (fits(w) && where(w) == found) {
                    count += step;
                } else {
                    is_growing = false;
                }
            }
            mover = mover + count * other;
        }
    }
    return false;
}

// The tangent where the weights fail for the side before v, for that behind it, or for both.
inline Tangent adjusted(const Corner& c, bool fails_back, bool fails_ahead) {
    Point a = unit(c.v - c.p), b = unit(c.q - c.v), across = unit(a - b);
    int turn = orient(c.p, c.v, c.q);
    Tangent out;
    out.kind = Kind::adjusted;
    out.direction = turned(across, turn);  // bisects the turn, and nothing cancels
    if (turn != 0) {
        if (fails_back != fails_ahead) {
            Point middle = unit(fails_back ? across + a : across - b);
            if (accept(c, turned(middle, turn), out)) return out;
        }
        if (accept(c, out.direction, out) || simplest(c, out.direction, out)) return out;
    }
    out.kind = Kind::cusp;
    return out;
}

inline Tangent tangent(const Corner& c, Weights weights) {
    Point a = c.v - c.p, b = c.q - c.v;
    Point t;
    if (weights == Weights::uniform) {
        Point ua = unit(a), ub = unit(b);
        bool is_sharp = a.x * b.x + a.y * b.y < 0;
        if (is_sharp && orient(c.p, c.v, c.q) == 0) return adjusted(c, true, true);
        t = is_sharp ? turned(unit(ua - ub), orient(c.p, c.v, c.q)) : unit(ua + ub);
    } else {
        bool is_length = weights == Weights::length;
        bool acute_p = dot_sign(c.v, c.q, c.p) > 0, acute_q = dot_sign(c.v, c.p, c.q) > 0;
        if (!acute_p || !acute_q) {
            return adjusted(c, !(is_length ? acute_p : acute_q), !(is_length ? acute_q : acute_p));
        }
        double a2 = a.x * a.x + a.y * a.y, b2 = b.x * b.x + b.y * b.y;
        t = is_length ? c.q - c.p : (b2 / (a2 + b2)) * a + (a2 / (a2 + b2)) * b;
        if (t.x == 0 && t.y == 0) return adjusted(c, true, true);
        t = unit(t);
    }
    Tangent out;
    if (accept(c, t, out)) return out;
    if (weights == Weights::uniform) return adjusted(c, true, true);
    return adjusted(c, rounded_dot(c.v, c.p, t) <= 0, rounded_dot(c.q, c.v, t) <= 0);
}

// Where the tangent lines at the ends of a side meet, ahead of its first end and behind its last:
// the middle control point of a quadratic segment (section 5.1), if they do. On a side whose line
// is the tangent line at both ends they meet everywhere: in its middle, then.
inline std::optional<Point> meeting(Point v, const Tangent& at_v, bool straight_v, Point w,
                                    const Tangent& at_w, bool straight_w) {
    if (at_v.kind == Kind::cusp || at_w.kind == Kind::cusp) return std::nullopt;
    if (straight_v && straight_w) return 0.5 * v + 0.5 * w;
    Point s = at_v.direction, t = at_w.direction;
    double turn = rounded_dot(s, {0, 0}, {t.y, -t.x});
    double ahead = rounded_dot(w, v, {t.y, -t.x}), back = rounded_dot(w, v, {-s.y, s.x});
    bool is_met = turn != 0 && sign_of(ahead) == sign_of(turn) && sign_of(back) == sign_of(turn);
    if (straight_v || straight_w || !is_met) return std::nullopt;
    return v + (ahead / turn) * s;
}

}  // namespace flintknap
