// Exact geometric predicates on double coordinates.
//
// Theory. Each predicate is the sign (or the correctly rounded value) of a polynomial in the
// coordinates. A floating-point evaluation with a proven error bound answers nearly always; when
// it cannot, the polynomial is evaluated exactly as an expansion, a sum of doubles that do not
// overlap (Dekker 1971; Priest 1991; Shewchuk 1997). Zero parts are dropped, so exact input such
// as a grid stays short and fast.
//
// Range. A coordinate is 0 or 1e-60 <= |v| <= 1e60. Then a product of four differences and all its
// rounding errors lie between 2^-1074 and 2^1023: nothing overflows, nothing underflows, and each
// answer is right for every admissible input. The border checks the range, not this header.
//
// Floating point is a contract: contraction off, no fast-math, round to nearest.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace flintknap {

struct Point {
    double x, y;
};

constexpr double kMinMagnitude = 1e-60, kMaxMagnitude = 1e60;

inline bool is_admissible(double v) {
    double magnitude = std::fabs(v);
    return (kMinMagnitude <= magnitude && magnitude <= kMaxMagnitude) || v == 0;
}
inline bool is_admissible(Point p) { return is_admissible(p.x) && is_admissible(p.y); }

inline bool operator==(Point a, Point b) { return a.x == b.x && a.y == b.y; }
inline Point operator-(Point a, Point b) { return {a.x - b.x, a.y - b.y}; }
inline bool operator<(Point a, Point b) { return a.x < b.x || (a.x == b.x && a.y < b.y); }

// ------------------------------------------------------------------ error-free transformations
// high + low is the exact result and high the rounded one.
struct Pair {
    double high, low;
};

inline Pair two_sum(double a, double b) {
    double s = a + b, bb = s - a;
    return {s, (a - (s - bb)) + (b - bb)};
}

inline Pair two_diff(double a, double b) {
    double d = a - b, bb = a - d;
    return {d, (a - (d + bb)) + (bb - b)};
}

inline Pair split(double a) {
    double c = 134217729.0 * a;  // 2^27 + 1 cuts a double into two halves of 26 bits
    double high = c - (c - a);
    return {high, a - high};
}

inline Pair two_product(double a, double b) {
    double p = a * b;
    Pair u = split(a), v = split(b);
    return {p, u.low * v.low - (((p - u.high * v.high) - u.low * v.high) - u.high * v.low)};
}

// ------------------------------------------------------------------ expansions
// The sum of `part[0 .. size)`: nonoverlapping, nonzero, in increasing magnitude.
template <int Capacity>
struct Expansion {
    std::array<double, Capacity> part;
    int size = 0;

    void append(double p) {
        if (p != 0) part[static_cast<std::size_t>(size++)] = p;
    }
    double operator[](int n) const { return part[static_cast<std::size_t>(n)]; }
    int sign() const { return size == 0 ? 0 : ((*this)[size - 1] > 0 ? 1 : -1); }
    double estimate() const {
        double sum = 0;
        for (int n = 0; n < size; ++n) sum += (*this)[n];
        return sum;
    }
    Expansion operator-() const {
        Expansion out = *this;
        for (int n = 0; n < size; ++n) out.part[static_cast<std::size_t>(n)] = -out[n];
        return out;
    }
};

inline Expansion<2> expansion(Pair p) {
    Expansion<2> out;
    out.append(p.low);
    out.append(p.high);
    return out;
}

inline Expansion<2> difference(double a, double b) { return expansion(two_diff(a, b)); }

// Merge by magnitude, then sweep the carries upward: O(size).
template <int M, int N>
Expansion<M + N> operator+(const Expansion<M>& a, const Expansion<N>& b) {
    Expansion<M + N> out;
    int i = 0, j = 0;
    auto smaller = [&] {
        return j == b.size || (i < a.size && std::fabs(a[i]) < std::fabs(b[j])) ? a[i++] : b[j++];
    };
    if (a.size + b.size == 0) return out;
    double carry = smaller();
    while (i < a.size || j < b.size) {
        Pair s = two_sum(carry, smaller());
        out.append(s.low);
        carry = s.high;
    }
    out.append(carry);
    return out;
}

template <int M, int N>
Expansion<M + N> operator-(const Expansion<M>& a, const Expansion<N>& b) {
    return a + (-b);
}

template <int N>
Expansion<2 * N> operator*(const Expansion<N>& a, double b) {
    Expansion<2 * N> out;
    if (a.size == 0 || b == 0) return out;
    Pair p = two_product(a[0], b);
    out.append(p.low);
    double carry = p.high;
    for (int n = 1; n < a.size; ++n) {
        p = two_product(a[n], b);
        Pair s = two_sum(carry, p.low);
        out.append(s.low);
        Pair t = two_sum(p.high, s.high);
        out.append(t.low);
        carry = t.high;
    }
    out.append(carry);
    return out;
}

// Sum of a * b[n], smallest first; each partial sum fits the capacity of the whole.
template <int M, int N>
Expansion<2 * M * N> operator*(const Expansion<M>& a, const Expansion<N>& b) {
    Expansion<2 * M * N> sum;
    for (int n = 0; n < b.size; ++n) {
        auto next = sum + a * b[n];
        sum.size = next.size;
        std::copy(next.part.begin(), next.part.begin() + next.size, sum.part.begin());
    }
    return sum;
}

inline int sign_of(double v) { return (v > 0) - (v < 0); }

constexpr double kUlp = std::numeric_limits<double>::epsilon() / 2;  // 2^-53

// ------------------------------------------------------------------ orientation
inline Expansion<16> exact_cross(Point a, Point b, Point c) {
    return difference(a.x, c.x) * difference(b.y, c.y) -
           difference(a.y, c.y) * difference(b.x, c.x);
}

inline Expansion<16> exact_dot(Point i, Point j, Point k) {
    return difference(i.x, k.x) * difference(j.x, k.x) +
           difference(i.y, k.y) * difference(j.y, k.y);
}

// +1 if a, b, c turn left, -1 if right, 0 if they lie on a line.
inline int orient(Point a, Point b, Point c) {
    double left = (a.x - c.x) * (b.y - c.y), right = (a.y - c.y) * (b.x - c.x);
    double det = left - right,
           bound = (3 + 16 * kUlp) * kUlp * (std::fabs(left) + std::fabs(right));
    if (std::fabs(det) > bound) return det > 0 ? 1 : -1;
    return exact_cross(a, b, c).sign();
}

// Sign of (i - k) . (j - k): +1 if the angle at k is acute, 0 if right, -1 if obtuse.
inline int dot_sign(Point i, Point j, Point k) {
    double first = (i.x - k.x) * (j.x - k.x), second = (i.y - k.y) * (j.y - k.y);
    double dot = first + second;
    double bound = (3 + 16 * kUlp) * kUlp * (std::fabs(first) + std::fabs(second));
    if (dot > bound || dot < -bound) return dot > 0 ? 1 : -1;
    return exact_dot(i, j, k).sign();
}

// ------------------------------------------------------------------ circles
inline int exact_in_circle(Point a, Point b, Point c, Point d) {
    auto ax = difference(a.x, d.x), ay = difference(a.y, d.y);
    auto bx = difference(b.x, d.x), by = difference(b.y, d.y);
    auto cx = difference(c.x, d.x), cy = difference(c.y, d.y);
    auto term = [](const Expansion<2>& x, const Expansion<2>& y, const Expansion<16>& minor) {
        return (x * x + y * y) * minor;
    };
    return (term(ax, ay, bx * cy - by * cx) +
            (term(bx, by, cx * ay - cy * ax) + term(cx, cy, ax * by - ay * bx)))
        .sign();
}

// For a, b, c turning left: +1 if d lies inside their circle, -1 if outside, 0 if on it.
inline int in_circle(Point a, Point b, Point c, Point d) {
    double ax = a.x - d.x, ay = a.y - d.y, bx = b.x - d.x, by = b.y - d.y;
    double cx = c.x - d.x, cy = c.y - d.y;
    double a2 = ax * ax + ay * ay, b2 = bx * bx + by * by, c2 = cx * cx + cy * cy;
    double bc = bx * cy, cb = cx * by, ca = cx * ay, ac = ax * cy, ab = ax * by, ba = bx * ay;
    double det = a2 * (bc - cb) + b2 * (ca - ac) + c2 * (ab - ba);
    double permanent = (std::fabs(bc) + std::fabs(cb)) * a2 + (std::fabs(ca) + std::fabs(ac)) * b2 +
                       (std::fabs(ab) + std::fabs(ba)) * c2;
    double bound = (10 + 96 * kUlp) * kUlp * permanent;
    if (det > bound || det < -bound) return det > 0 ? 1 : -1;
    return exact_in_circle(a, b, c, d);
}

// The same with ties broken by coordinates: each site is lifted above the paraboloid by an
// infinitesimal that shrinks with its lexicographic rank. Of four cocircular sites only the
// smallest matters, and the diagonal that avoids it is Delaunay. Never 0 for distinct sites.
inline int in_circle_perturbed(Point a, Point b, Point c, Point d) {
    int s = in_circle(a, b, c, d);
    if (s != 0) return s;
    Point smallest = std::min(std::min(a, b), std::min(c, d));
    if (smallest == d) return -1;
    if (smallest == a) return orient(b, c, d);
    if (smallest == b) return orient(c, a, d);
    return orient(a, b, d);
}

// ------------------------------------------------------------------ cotangent
inline bool odd_mantissa(double v) {
    std::uint64_t bits;
    std::memcpy(&bits, &v, sizeof bits);
    return (bits & 1) != 0;
}

// The correctly rounded value of a number, `start` being a few ulps off at most: moves to the
// double whose rounding interval, ties to even, holds the number. above(p) is the sign of it less
// p.
template <class Above>
double rounded(double start, Above above) {
    constexpr double inf = std::numeric_limits<double>::infinity();
    // Of the midpoint of q and its neighbour towards `end`.
    auto beyond = [&](double q, double end) {
        return above(expansion(two_sum(q, (std::nextafter(q, end) - q) / 2)));
    };
    double q = start;
    for (;;) {
        int up = beyond(q, inf), down = beyond(q, -inf);
        if (up > 0 || (up == 0 && odd_mantissa(q))) {
            q = std::nextafter(q, inf);
        } else if (down < 0 || (down == 0 && odd_mantissa(q))) {
            q = std::nextafter(q, -inf);
        } else {
            return q;
        }
    }
}

template <int M, int N>
double rounded_quotient(const Expansion<M>& dot, const Expansion<N>& cross, double start) {
    return rounded(start, [&](const Expansion<2>& p) { return (dot - cross * p).sign(); });
}

// The root of a quotient.
template <int M, int N>
double rounded_root(const Expansion<M>& square, const Expansion<N>& over, double start) {
    return rounded(start, [&](const Expansion<2>& p) { return (square - over * (p * p)).sign(); });
}

inline double exact_cotangent(Point i, Point j, Point k) {
    auto dot = exact_dot(i, j, k), cross = exact_cross(i, j, k);
    if (dot.sign() == 0) return 0;
    return rounded_quotient(dot, cross, dot.estimate() / cross.estimate());
}

// (a.high + a.low) * (b.high + b.low) to about 2^-103 of its magnitude.
inline Pair pair_product(Pair a, Pair b) {
    Pair p = two_product(a.high, b.high);
    p.low += a.high * b.low + a.low * b.high;
    return p;
}

inline Pair pair_sum(Pair a, Pair b) {
    Pair s = two_sum(a.high, b.high);
    return two_sum(s.high, s.low + (a.low + b.low));
}

// cot of the angle at k of the triangle i, j, k (which turns left), correctly rounded: a
// decreasing function of the angle, 0 at a right angle. Evaluated with pairs of doubles; when the
// error bound straddles a rounding boundary, with expansions.
inline double cotangent(Point i, Point j, Point k) {
    Pair ux = two_diff(i.x, k.x), uy = two_diff(i.y, k.y);
    Pair vx = two_diff(j.x, k.x), vy = two_diff(j.y, k.y);
    Pair xx = pair_product(ux, vx), yy = pair_product(uy, vy);
    Pair xy = pair_product(ux, vy), yx = pair_product(uy, vx);
    Pair dot = pair_sum(xx, yy), cross = pair_sum(xy, {-yx.high, -yx.low});
    double q = dot.high / cross.high;
    Pair back = two_product(q, cross.high);
    double rest = ((dot.high - back.high) - back.low) + (dot.low - q * cross.low);
    // Every rounding above is at most 2^-103 of one of these magnitudes; 2^-98 leaves room.
    constexpr double unit = 1.0 / (1ULL << 49) / (1ULL << 49);
    double error = unit * (std::fabs(xx.high) + std::fabs(yy.high) +
                           std::fabs(q) * (std::fabs(xy.high) + std::fabs(yx.high)));
    double correction = rest / cross.high;
    double slack = 2 * error / cross.high + 4 * kUlp * std::fabs(correction);
    double low = q + (correction - slack), high = q + (correction + slack);
    if (low == high) return low;  // false, too, for anything not a number
    return exact_cotangent(i, j, k);
}

// A number that is no larger, by a few ulps unless much cancels, at a tenth of the cost.
inline double cotangent_floor(Point i, Point j, Point k) {
    constexpr double unit = 8 * kUlp;  // four would do but for roundings of the bounds themselves
    double ux = i.x - k.x, uy = i.y - k.y, vx = j.x - k.x, vy = j.y - k.y;
    double xx = ux * vx, yy = uy * vy, xy = ux * vy, yx = uy * vx;
    double dot = (xx + yy) - unit * (std::fabs(xx) + std::fabs(yy));
    double error = unit * (std::fabs(xy) + std::fabs(yx));
    double cross = (xy - yx) + (dot < 0 ? -error : error);
    if (!(cross > 0)) return -std::numeric_limits<double>::infinity();
    double q = dot / cross;
    return q - unit * std::fabs(q);
}

}  // namespace flintknap
