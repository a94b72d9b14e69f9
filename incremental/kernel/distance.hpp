// How far a place is from the ring, and one ring from another.
//
// Theory. The nearest point of an edge is one of its ends or the foot of the perpendicular: which,
// two exact signs tell. Its distance is |cross| / length or the length of a difference, evaluated
// with pairs of doubles (the cross product, where it all but vanishes, with expansions) to 2^-75 of
// its value and rounded, where that leaves no doubt; else with expansions. So it is *correctly
// rounded*. No square over- or underflows: differences of coordinates are 0 or between 2^-252 and
// 2^201, cross products 0 or between 2^-504 and 2^403; expansions are scaled meanwhile.
//
// The nearest edge is that with the smallest distance, so rounded; of several, the one whose start
// has the smaller coordinates, and no two edges have the same start. So the answer is a function of
// the ring and the place, whatever the shape of the tree. Of two rings that do not meet, the
// distance is that of a vertex of one to an edge of the other: the smallest of them.
//
// The search looks into the leaves of the cell (cells.hpp) first, and is done if nothing beyond the
// cell is as near. Otherwise it descends the tree, into the nearer box first, passing over boxes
// beyond the best so far. In a leaf, plain doubles with an error bound (`kSlack` times the terms)
// pass over nearly all edges; what is left in the end, one or two, is looked at closely. Bounds err
// to the side of looking.
//
// Cost: one place, the leaves of a cell, or O(log n) boxes on curves unless many edges are equally
// far (the centre of a circle); two rings, what lies between their nearest parts.
#pragma once

#include <limits>
#include <optional>

#include "cells.hpp"

namespace flintknap {

// ------------------------------------------------------------------ pairs of doubles
// (a - c) x (b - c), to 2^-80 of its magnitude; 0 iff they lie on a line.
inline Pair accurate_cross(Point a, Point b, Point c) {
    Pair ux = two_diff(a.x, c.x), uy = two_diff(a.y, c.y);
    Pair vx = two_diff(b.x, c.x), vy = two_diff(b.y, c.y);
    Pair left = pair_product(ux, vy), right = pair_product(uy, vx);
    Pair cross = pair_sum(left, {-right.high, -right.low});
    constexpr double cancelled = 1.0 / (1 << 20);
    double terms = std::fabs(left.high) + std::fabs(right.high);
    if (std::fabs(cross.high) > cancelled * terms) return cross;
    auto exact = exact_cross(a, b, c);
    double high = exact.estimate();
    return {high, (exact + expansion({-high, 0})).estimate()};
}

inline Pair squared_length(Pair x, Pair y) {
    return pair_sum(pair_product(x, x), pair_product(y, y));
}

inline Pair pair_quotient(Pair a, Pair b) {
    double q = a.high / b.high;
    Pair back = two_product(q, b.high);
    double rest = ((a.high - back.high) - back.low) + (a.low - q * b.low);
    return two_sum(q, rest / b.high);
}

inline Pair pair_root(Pair a) {
    if (a.high == 0) return {0, 0};
    double root = std::sqrt(a.high);
    Pair back = two_product(root, root);
    double rest = ((a.high - back.high) - back.low) + a.low;
    return two_sum(root, rest / (2 * root));
}

// Whether it is clear how a pair rounds that is off by less than 2^-74 of itself.
inline bool rounds_surely(Pair a) {
    double slack = a.high / (1ULL << 60) / (1 << 14);
    return a.high + (a.low - slack) == a.high + (a.low + slack);
}

template <int N>
Expansion<N> scaled(Expansion<N> e, int exponent) {
    for (int n = 0; n < e.size; ++n) e.part[at(n)] = std::ldexp(e[n], exponent);
    return e;
}

template <int N>
auto squared_length(const Expansion<N>& x, const Expansion<N>& y) {
    return x * x + y * y;
}

// ------------------------------------------------------------------ a place and an edge
// Whether the point of the closed edge from a to b that is nearest to q is a, b or between them.
enum class Part { start, between, end };

inline Part nearest_part(Point a, Point b, Point q) {
    if (dot_sign(q, b, a) <= 0) return Part::start;
    return dot_sign(q, a, b) <= 0 ? Part::end : Part::between;
}

// Correctly rounded, `start` being a few ulps off at most. Scaled to about 1 meanwhile, the length
// of an edge to 2^400: then no bit of a product is out of range.
inline double exact_distance(Point a, Point b, double start) {
    int exponent = std::ilogb(start);
    auto x = scaled(difference(a.x, b.x), -exponent), y = scaled(difference(a.y, b.y), -exponent);
    Expansion<2> one = expansion({1, 0});
    double far = rounded_root(squared_length(x, y), one, std::ldexp(start, -exponent));
    return std::ldexp(far, exponent);
}
inline double exact_distance_to_line(Point a, Point b, Point q, double start, double length) {
    int exponent = std::ilogb(start), wide = 400 - std::ilogb(length);
    auto x = scaled(difference(a.x, b.x), wide), y = scaled(difference(a.y, b.y), wide);
    auto cross = scaled(exact_cross(a, b, q), wide - exponent);
    double far = rounded_root(cross * cross, squared_length(x, y), std::ldexp(start, -exponent));
    return std::ldexp(far, exponent);
}

inline double distance(Point a, Point b) {
    if (a.x == b.x || a.y == b.y) return std::fabs((a.x - b.x) + (a.y - b.y));  // rounded once
    Pair far = pair_root(squared_length(two_diff(a.x, b.x), two_diff(a.y, b.y)));
    return rounds_surely(far) ? far.high : exact_distance(a, b, far.high);
}

inline double distance_to_edge(Point a, Point b, Point q, Part part) {
    if (part != Part::between) return distance(part == Part::start ? a : b, q);
    if (a.x == b.x) return std::fabs(a.x - q.x);
    if (a.y == b.y) return std::fabs(a.y - q.y);
    Pair cross = accurate_cross(a, b, q);
    if (cross.high == 0) return 0;
    Pair length = pair_root(squared_length(two_diff(a.x, b.x), two_diff(a.y, b.y)));
    Pair far = pair_quotient(cross, length);
    return rounds_surely(far) ? std::fabs(far.high)
                              : exact_distance_to_line(a, b, q, std::fabs(far.high), length.high);
}

// The nearest point, each coordinate rounded once from 2^-95 of the coordinates of a and b.
inline Point nearest_on_edge(Point a, Point b, Point q, Part part, double far) {
    if (part != Part::between) return part == Part::start ? a : b;
    if (far == 0) return q;
    Pair ux = two_diff(q.x, a.x), uy = two_diff(q.y, a.y);
    Pair vx = two_diff(b.x, a.x), vy = two_diff(b.y, a.y);
    Pair dot = pair_sum(pair_product(ux, vx), pair_product(uy, vy));
    Pair t = pair_quotient(dot, squared_length(vx, vy));
    auto along = [&](double from, Pair step) {
        return pair_sum({from, 0}, pair_product(t, step)).high + 0.0;
    };
    return {along(a.x, vx), along(a.y, vy)};
}

// ------------------------------------------------------------------ boxes
// Squared, 0 if they share a point; a few ulps off.
inline double squared_gap(const Box& b, Point q) {
    double x = std::max(std::max(b.x_low - q.x, q.x - b.x_high), 0.0);
    double y = std::max(std::max(b.y_low - q.y, q.y - b.y_high), 0.0);
    return x * x + y * y;
}
inline double squared_gap(const Box& a, const Box& b) {
    double x = std::max(std::max(a.x_low - b.x_high, b.x_low - a.x_high), 0.0);
    double y = std::max(std::max(a.y_low - b.y_high, b.y_low - a.y_high), 0.0);
    return x * x + y * y;
}

// No gap of a box with something within `far` is larger, however both were rounded. (A gap that is
// not 0 is no less than 2^-252: where the square of `far` underflows, 0 is right.)
inline double gap_within(double far) { return far * far * (1 + 32 * kUlp); }

// ------------------------------------------------------------------ a place and the ring
// An edge by its leaf and its place there, and the point on it that is nearest.
struct Nearest {
    double distance = std::numeric_limits<double>::infinity();
    Point at = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
    Index leaf = kNone, place = kNone;
};

// Looks for the nearest edge within a distance known beforehand, or for any.
class NearestSearch {
   public:
    explicit NearestSearch(const Ring& ring, Cells* cells = nullptr) : ring_(ring), cells_(cells) {}

    // Nothing within the limit: a Nearest without a leaf, or one beyond the limit.
    Nearest ask(Point q, double limit = std::numeric_limits<double>::infinity()) {
        begin(q, limit);
        search();
        look();
        return nearest();
    }

    // The distance alone; the same of the edges of one leaf.
    double ask_distance(Point q, double limit = std::numeric_limits<double>::infinity()) {
        begin(q, limit);
        search();
        return look();
    }
    double ask_leaf(Index leaf, Point q, double limit) {
        begin(q, limit);
        scan(leaf);
        return look();
    }

    // A vertex of an edge that was nearest last.
    std::optional<Point> vertex() const {
        if (candidates_.empty()) return {};
        return edge_of(ring_.leaf(candidates_[0].leaf), candidates_[0].place).a;
    }

   private:
    static constexpr double kSlack = 32 * kUlp;

    // An edge that may be the nearest: it is no nearer than `far`, and as far if looked at.
    struct Candidate {
        double far;
        Index leaf, place;
        Part part;
    };

    void begin(Point q, double limit) {
        q_ = q;
        limit_ = limit;
        candidates_.clear();
    }

    void search() {
        if (ring_.empty() || search_cell()) return;
        candidates_.clear();
        enter(ring_.root());
    }

    // Whether what is nearest lies in the cell of q. If not, something of it is within the limit.
    bool search_cell() {
        if (cells_ == nullptr || !ring_.node(ring_.root()).box.holds(q_)) return false;
        const Cells::Cell* cell = cells_->find(q_);
        if (cell == nullptr) return false;
        double gaps[Cells::kRoom];
        for (std::size_t i = 0; i < cell->count; ++i) {
            gaps[i] = squared_gap(ring_.node(cell->leaves[i]).box, q_);
        }
        for (std::size_t left = cell->count; left > 0; --left) {
            double* least = std::min_element(gaps, gaps + cell->count);
            if (*least > gap_within(limit_)) break;
            scan(cell->leaves[least - gaps]);
            *least = std::numeric_limits<double>::infinity();
        }
        return cells_->reaches(q_, gap_within(limit_));
    }

    void enter(Index n) {
        const Ring::Node& node = ring_.node(n);
        if (node.right == kNone) {
            scan(n);
            return;
        }
        Index near = node.left, far = node.right;
        double near_gap = squared_gap(ring_.node(near).box, q_);
        double far_gap = squared_gap(ring_.node(far).box, q_);
        if (far_gap < near_gap) {
            std::swap(near, far);
            std::swap(near_gap, far_gap);
        }
        if (near_gap <= gap_within(limit_)) enter(near);
        if (far_gap <= gap_within(limit_)) enter(far);
    }

    // Squared distances of q to two edges.
    Lanes squares(Lanes ax, Lanes ay, Lanes bx, Lanes by) const {
        Lanes x = bx - ax, y = by - ay;
        ax -= both(q_.x);
        ay -= both(q_.y);
        Lanes t = -(ax * x + ay * y) / (x * x + y * y);
        t = chosen(t < both(0), both(0), t);
        t = chosen(t > both(1), both(1), t);
        Lanes fx = ax + t * x, fy = ay + t * y;
        return fx * fx + fy * fy;
    }

    void scan(Index n) {
        const Ring::Leaf& leaf = ring_.leaf(n);
        int count = ring_.node(n).count;
        constexpr double inf = std::numeric_limits<double>::infinity();
        double square[Ring::kRoom];
        Lanes least = both(inf);
        auto keep = [&](int i, Lanes of) {
            std::memcpy(square + i, &of, sizeof of);
            least = chosen(of < least, of, least);
        };
        int i = 0;
        for (; i + 1 < count; i += 2) {
            keep(i, squares(load(leaf.x + i), load(leaf.y + i), load(leaf.x + i + 1),
                            load(leaf.y + i + 1)));
        }
        if (i < count) {
            keep(i, squares(both(leaf.x[i]), both(leaf.y[i]), both(leaf.x[i + 1]),
                            both(leaf.y[i + 1])));
        }
        // How far rounding may have taken the roots of the squares, for any edge in the box.
        const Box& b = ring_.node(n).box;
        double wide = b.x_high - b.x_low, high = b.y_high - b.y_low;
        double slack =
            kSlack * (std::fabs(b.x_low - q_.x) + std::fabs(b.y_low - q_.y) + 2 * wide + 2 * high);
        limit_ = std::min(limit_, std::sqrt(std::min(least[0], least[1])) + slack);
        double within = gap_within(limit_ + slack);
        Gathered gathered;
        for (i = 0; i < count; i += 2) gathered.add(i / 2, load(square + i) <= both(within));
        std::int64_t near = gathered.bits() & ((std::int64_t{1} << count) - 1);
        for (; near != 0; near &= near - 1) {
            Index place = lowest(near);
            candidates_.push_back({std::sqrt(square[place]) - slack, n, place, Part::start});
        }
    }

    // Looks closely at those that are left. Returns the least distance, and keeps who has it.
    double look() {
        double best = std::numeric_limits<double>::infinity();
        std::size_t kept = 0;
        for (Candidate c : candidates_) {
            if (c.far > limit_) continue;
            auto [a, b] = edge_of(ring_.leaf(c.leaf), c.place);
            c.part = nearest_part(a, b, q_);
            c.far = distance_to_edge(a, b, q_, c.part);
            limit_ = std::min(limit_, c.far);
            if (c.far > best) continue;
            if (c.far < best) kept = 0;
            best = c.far;
            candidates_[kept++] = c;
        }
        candidates_.resize(kept, Candidate{});
        return best;
    }

    // Of those kept, which are equally far, that whose start is first.
    Nearest nearest() const {
        if (candidates_.empty()) return {};
        auto edge = [&](const Candidate& c) { return edge_of(ring_.leaf(c.leaf), c.place); };
        const Candidate& first = *std::min_element(
            candidates_.begin(), candidates_.end(),
            [&](const Candidate& c, const Candidate& d) { return edge(c).a < edge(d).a; });
        auto [a, b] = edge(first);
        return {first.far, nearest_on_edge(a, b, q_, first.part, first.far), first.leaf,
                first.place};
    }

    const Ring& ring_;
    Cells* cells_;
    Point q_ = {};
    double limit_ = 0;  // nothing farther is looked for
    std::vector<Candidate> candidates_;
};

// ------------------------------------------------------------------ two rings
// The smallest distance of a vertex of one to an edge of the other, of rings that do not meet.
class Clearance {
   public:
    Clearance(const Ring& a, const Ring& b)
        : rings_{&a, &b}, searches_{NearestSearch(a), NearestSearch(b)} {}

    double ask() {
        best_ = std::numeric_limits<double>::infinity();
        if (!rings_[0]->empty() && !rings_[1]->empty()) {
            approach();
            descend(rings_[0]->root(), rings_[1]->root(), -1);
        }
        return best_;
    }

    // Whether it is `least` or more: looks no further than that, and no longer than needed.
    bool is_at_least(double least) {
        best_ = least;
        if (rings_[0]->empty() || rings_[1]->empty()) return true;
        approach();
        if (best_ == least) descend(rings_[0]->root(), rings_[1]->root(), least);
        return best_ == least;
    }

   private:
    // From a vertex to and fro between the rings: the first guess is seldom far off.
    void approach() {
        const Ring& a = *rings_[0];
        const Ring::Leaf& first = a.leaf(a.first_leaf(a.root()));
        Point q = {first.x[0], first.y[0]};
        for (int step = 0; step < 6; ++step) {
            int other = 1 - step % 2;
            Nearest found = searches_[other].ask(q);
            // From a vertex on, so that each distance is one of those compared.
            Edge e = edge_of(rings_[other]->leaf(found.leaf), found.place);
            best_ = std::min(best_, found.distance);
            Point next = distance(e.a, q) < distance(e.b, q) ? e.a : e.b;
            if (next == q) break;
            q = next;
        }
    }

    // Stops below `enough`.
    void descend(Index m, Index n, double enough) {
        const Ring::Node &a = rings_[0]->node(m), &b = rings_[1]->node(n);
        if (best_ < enough || squared_gap(a.box, b.box) > gap_within(best_)) return;
        bool a_is_leaf = a.right == kNone, b_is_leaf = b.right == kNone;
        if (a_is_leaf && b_is_leaf) {
            from_vertices(0, m, n);
            from_vertices(1, n, m);
        } else if (b_is_leaf || (!a_is_leaf && a.count >= b.count)) {
            bool left = squared_gap(rings_[0]->node(a.left).box, b.box) <=
                        squared_gap(rings_[0]->node(a.right).box, b.box);
            descend(left ? a.left : a.right, n, enough);
            descend(left ? a.right : a.left, n, enough);
        } else {
            bool left = squared_gap(rings_[1]->node(b.left).box, a.box) <=
                        squared_gap(rings_[1]->node(b.right).box, a.box);
            descend(m, left ? b.left : b.right, enough);
            descend(m, left ? b.right : b.left, enough);
        }
    }

    // From the vertices of leaf m of one ring to the edges of leaf n of the other.
    void from_vertices(int one, Index m, Index n) {
        const Ring::Leaf& leaf = rings_[one]->leaf(m);
        const Box& box = rings_[1 - one]->node(n).box;
        for (Index i = 0; i < rings_[one]->node(m).count; ++i) {
            Point q = {leaf.x[i], leaf.y[i]};
            if (squared_gap(box, q) > gap_within(best_)) continue;
            best_ = std::min(best_, searches_[1 - one].ask_leaf(n, q, best_));
        }
    }

    const Ring* rings_[2];
    NearestSearch searches_[2];
    double best_ = 0;
};

}  // namespace flintknap
