// The Flintstone of one polyline: the two discs on its chord that bound it, where it is split, and
// how far it strays.
//
// Theory (section 4.1; docs/theory.md). Seen from a vertex v left of the chord from p to s, the
// chord has an angle; the circle through p, s and v holds the places on that side that see the
// chord under a larger one. So the disc that holds every left vertex passes through the one with
// the smallest angle, q, and likewise r on the right. Whether v sees less than q does is the sign
// of an in-circle determinant; equal angles are told apart by coordinates.
//
//               . q .               left of the chord the circle through p, q, s,
//            .    v    .            right of it the one through p, r, s
//          p ----------- s          an empty side: nothing beyond the chord
//            ' . v  . '             split: q or r, whichever has the smaller circle
//                r
//
// Of two circles on one chord, the smaller is that of the vertex with the smaller angle, because
// the angles at q and r sum to at least 180 degrees: every polyline lies in a disc through p and s.
// Both are the same circle if they sum to just that, and equal circles if they are equal: then the
// smaller coordinates win. A polyline on its chord is split next to the chord's middle.
//
// The error is the distance from the chord (a segment) to the vertex farthest from it, rounded up
// to a double: comparing it with a double tells what comparing the exact distance would. Of
// vertices with the same distance, so rounded, that with the smaller coordinates is the farthest.
//
// A polyline may also be parted there, at the farthest vertex (Douglas and Peucker 1973), which
// takes fewer vertices to come within a tolerance; then nobody asks for discs, and none are sought.
//
// Invariants: what has been seen does not depend on the order in which it was.
// Cost: a vertex takes about 5 ns; exact arithmetic only for near ties.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "enclosing.hpp"
#include "predicates.hpp"
#include "ring.hpp"

namespace flintknap {

// Distances between 0 and this count as this: below it, squares could underflow.
constexpr double kLeastError = 1e-70;

// Where polylines are parted.
enum class Parting { smaller_disc, farthest };

// What is known of a polyline. 56 bytes.
struct Flintstone {
    Point left_at{}, right_at{};  // where q and r lie; if there is neither, left_at is the split
    Index left = kNone, right = kNone;  // q and r, or kNone, as when parted at the farthest vertex
    Index split = kNone;                // where the polyline is parted
    Index farthest = kNone;             // whose distance the error is
    double error = kUnknown;

    static constexpr double kUnknown = -1;

    bool is_known() const { return error >= 0; }
    Vertex split_vertex() const { return {split, split == right ? right_at : left_at}; }
};

// ------------------------------------------------------------------ exact comparisons
// Sign of the difference of the cotangents of the angles under which q, left of the chord, and r,
// right of it, see the chord.
inline int compare_cotangents(Point p, Point s, Point q, Point r) {
    double at_q = cotangent(p, s, q), at_r = cotangent(s, p, r);
    if (at_q != at_r) return at_q > at_r ? 1 : -1;  // rounded correctly, hence in order
    return (exact_dot(p, s, q) * exact_cross(s, p, r) - exact_dot(p, s, r) * exact_cross(p, s, q))
        .sign();
}

// ------------------------------------------------------------------ distances, rounded up
// The smallest double, 0 or from kLeastError on, that `reaches` the distance; `start` is near it.
template <class Reaches>
double round_up(double start, Reaches reaches) {
    double e = std::max(start, kLeastError);
    while (!reaches(e)) e = std::nextafter(e, std::numeric_limits<double>::infinity());
    while (e > kLeastError) {
        double less = std::max(std::nextafter(e, 0.0), kLeastError);
        if (!reaches(less)) break;
        e = less;
    }
    return e;
}

// From v to an end p of the chord.
inline double distance_to_point(Point p, Point v) {
    if (v == p) return 0;
    Pair x = two_diff(v.x, p.x), y = two_diff(v.y, p.y);
    Pair squared = pair_sum(pair_product(x, x), pair_product(y, y));
    return round_up(std::sqrt(squared.high), [&](double e) {
        Pair e2 = two_product(e, e), rest = pair_sum(e2, {-squared.high, -squared.low});
        if (std::fabs(rest.high) > 0x1p-96 * e2.high) return rest.high > 0;
        return (expansion(e2) - exact_dot(v, v, p)).sign() >= 0;
    });
}

// From v to the line through p and s: |cross| / |ps|.
inline double distance_to_line(Point p, Point s, Point v) {
    Pair cx = two_diff(s.x, p.x), cy = two_diff(s.y, p.y);
    Pair dx = two_diff(v.x, p.x), dy = two_diff(v.y, p.y);
    Pair left = pair_product(cx, dy), right = pair_product(cy, dx);
    Pair cross = pair_sum(left, {-right.high, -right.low});
    double unsure = 0x1p-98 * (std::fabs(left.high) + std::fabs(right.high));
    double start = cross.high;
    if (std::fabs(start) < 0x1p30 * unsure) start = exact_cross(p, s, v).estimate();
    if (start == 0) return 0;
    Pair crossed = pair_product(cross, cross);
    return round_up(std::fabs(start) / std::hypot(cx.high, cy.high), [&](double e) {
        Pair ex = pair_product({e, 0}, cx), ey = pair_product({e, 0}, cy);
        Pair sum = pair_sum(pair_product(ex, ex), pair_product(ey, ey));
        Pair rest = pair_sum(sum, {-crossed.high, -crossed.low});
        double error = 0x1p-94 * sum.high + 4 * unsure * (std::fabs(cross.high) + unsure);
        if (std::fabs(rest.high) > error) return rest.high > 0;
        auto x = difference(s.x, p.x) * e, y = difference(s.y, p.y) * e;
        auto area = exact_cross(p, s, v);
        return (x * x + y * y - area * area).sign() >= 0;
    });
}

// From v to the chord, rounded up.
inline double distance_to_chord(Point p, Point s, Point v) {
    if (dot_sign(v, s, p) <= 0) return distance_to_point(p, v);
    if (dot_sign(v, p, s) <= 0) return distance_to_point(s, v);
    return distance_to_line(p, s, v);
}

// Whether w lies on the chord.
inline bool is_on_chord(Point p, Point s, Point w) {
    return orient(p, s, w) == 0 && dot_sign(p, s, w) <= 0;
}

// Whether w lies in the Flintstone.
inline bool is_inside(Point p, Point s, const Flintstone& f, Point w) {
    int turn = orient(p, s, w);
    if (turn > 0) return f.left != kNone && in_circle(p, s, f.left_at, w) >= 0;
    if (turn < 0) return f.right != kNone && in_circle(s, p, f.right_at, w) >= 0;
    return dot_sign(p, s, w) <= 0;
}

// ------------------------------------------------------------------ the search
// Sees the vertices strictly between p and s, in any order, and knows their Flintstone.
class Search {
   public:
    explicit Search(Parting parting) : seeks_discs_(parting == Parting::smaller_disc) {}

    void begin(Point p, Point s) {
        p_ = p;
        s_ = s;
        cx_ = s.x - p.x;
        cy_ = s.y - p.y;
        reach_ = std::fabs(cx_) + std::fabs(cy_);
        length2_ = cx_ * cx_ + cy_ * cy_;
        per_length_ = 1 / std::sqrt(length2_);
        left_ = right_ = Best{};
        middle_ = Vertex{};
        far_.clear();
        far_low_ = far_high_ = -1;
    }

    // As if all had been seen that this was found among.
    void resume(Point p, Point s, const Flintstone& found) {
        begin(p, s);
        Vertex q{found.left, found.left_at}, r{found.right, found.right_at};
        if (q.index != kNone) left_ = {q, look(q.at)};
        if (r.index != kNone) right_ = {r, look(r.at)};
        if (q.index == kNone && r.index == kNone) middle_ = found.split_vertex();
        far_low_ = far_high_ = std::nextafter(found.error, 0.0);
    }

    // Whether nothing seen since has changed what it was resumed from.
    bool found_no_more_than(const Flintstone& found) const {
        if (left_.vertex.index != found.left || right_.vertex.index != found.right) return false;
        if (found.left == kNone && found.right == kNone && middle_.index != found.split)
            return false;
        return std::all_of(far_.begin(), far_.end(), [&](const Far& f) {
            if (f.high < far_low_) return true;
            double distance = distance_to_chord(p_, s_, f.vertex.at);
            bool is_farther = distance > found.error;
            if (distance == found.error && !seeks_discs_) is_farther = f.vertex.at < middle_.at;
            return !is_farther;
        });
    }

    void see(Vertex v) {
        Sight sight = look(v.at);
        see_far(v, sight);
        if (!seeks_discs_) return;
        int turn = sight.turn != 0 ? sight.turn : orient(p_, s_, v.at);
        if (turn == 0) {
            see_middle(v);
            return;
        }
        Best& best = turn > 0 ? left_ : right_;
        double lead = 1;
        if (best.vertex.index != kNone) {
            double bound = 0;
            lead = compare(sight, best.sight, bound);
            if (lead < -bound || v.index == best.vertex.index) return;
            if (lead <= bound && !is_before(v.at, best.vertex.at, turn)) return;
        }
        best = {v, sight};
    }

    // The same of n vertices side by side; those that clearly change nothing are passed over.
    void see(const double* x, const double* y, const Index* vertex, Index n) {
        constexpr Index kBlock = 32;
        std::array<std::int64_t, kBlock> hidden;
        for (Index start = 0; start < n; start += kBlock) {
            Index count = std::min(n - start, kBlock);
            const Limits left = limits(left_), right = limits(right_);
            for (Index i = 0; i < count; ++i) {
                hidden[at(i)] = hides({x[start + i], y[start + i]}, left, right);
            }
            for (Index i = start; i < start + count; ++i) {
                if (hidden[at(i - start)] == 0) see({vertex[i], {x[i], y[i]}});
            }
        }
    }

    // Whether no place in the box would change anything. The Flintstone so far and the places so
    // near to the chord are convex: they hold the box if they hold its corners.
    bool covers(const Box& box) const {
        const Limits left = limits(left_), right = limits(right_);
        return hides({box.x_low, box.y_low}, left, right) != 0 &&
               hides({box.x_high, box.y_high}, left, right) != 0 &&
               hides({box.x_high, box.y_low}, left, right) != 0 &&
               hides({box.x_low, box.y_high}, left, right) != 0;
    }

    // Of what was seen, which is something.
    Flintstone result() const {
        Flintstone found{left_.vertex.at, right_.vertex.at, left_.vertex.index, right_.vertex.index,
                         choose().index};
        if (found.left == kNone && found.right == kNone) found.left_at = middle_.at;
        Point farthest{};
        for (const Far& f : far_) {
            if (f.high < far_low_) continue;
            double distance = distance_to_chord(p_, s_, f.vertex.at);
            if (distance < found.error) continue;
            if (distance == found.error && !(f.vertex.at < farthest)) continue;
            found.error = distance;
            found.farthest = f.vertex.index;
            farthest = f.vertex.at;
        }
        if (!seeks_discs_) {
            found.split = found.farthest;
            found.left_at = farthest;
        }
        return found;
    }

   private:
    // What floating point makes of a place. The rounding error of `dot` is at most 5 units in the
    // last place of reach * away, that of `cross` 5 of reach * |chord|, both in the sum norm.
    struct Sight {
        double dot, cross;  // of (p - v, s - v), and twice the area of p, s, v
        double reach, away;
        int turn;                // the sign of the area, 0 if not certain
        double distance, slack;  // to the chord
    };
    struct Best {
        Vertex vertex;
        Sight sight{};
    };
    // What it takes to beat a vertex; not numbers while there is none, which compare with nothing.
    struct Limits {
        static constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
        double dot = kNothing, cross = kNothing;
        double reach = kNothing, away = kNothing;  // of the bound on rounding errors
    };
    struct Far {
        double high;
        Vertex vertex;
    };

    Sight look(Point v) const {
        double dx = v.x - p_.x, dy = v.y - p_.y, ex = v.x - s_.x, ey = v.y - s_.y;
        Sight out;
        out.dot = dx * ex + dy * ey;
        out.cross = cx_ * dy - cy_ * dx;
        out.reach = std::fabs(dx) + std::fabs(dy);
        out.away = std::fabs(ex) + std::fabs(ey);
        double unsure = 6 * kUlp * reach_ * out.reach;
        out.turn = out.cross > unsure ? 1 : out.cross < -unsure ? -1 : 0;
        double along = dx * cx_ + dy * cy_;
        if (along > 0 && along < length2_) {
            out.distance = std::fabs(out.cross) * per_length_;
        } else {
            out.distance = std::sqrt(std::min(dx * dx + dy * dy, ex * ex + ey * ey));
        }
        out.slack = 16 * kUlp * (out.reach + out.away);
        return out;
    }

    // Positive if a's angle is the smaller one, by more than the bound if that is certain.
    double compare(const Sight& a, const Sight& b, double& bound) const {
        bound = 16 * kUlp * reach_ * a.reach * b.reach * (a.away + b.away);
        return a.dot * std::fabs(b.cross) - b.dot * std::fabs(a.cross);
    }

    // Whether a goes before b, both on the side of `turn`: by angle, then by coordinates.
    bool is_before(Point a, Point b, int turn) const {
        int beyond = turn > 0 ? -in_circle(p_, s_, b, a) : -in_circle(s_, p_, b, a);
        return beyond != 0 ? beyond > 0 : a < b;
    }

    void see_middle(Vertex v) {
        if (middle_.index == kNone) {
            middle_ = v;
        } else if (v.index != middle_.index) {
            // (p - v) . (s - v) grows with the distance from the middle of the chord.
            int farther = (exact_dot(p_, s_, v.at) - exact_dot(p_, s_, middle_.at)).sign();
            if (farther < 0 || (farther == 0 && v.at < middle_.at)) middle_ = v;
        }
    }

    // Distances that all count as kLeastError are alike.
    void see_far(Vertex v, const Sight& sight) {
        double low = sight.distance - sight.slack;
        double high = std::max(sight.distance + sight.slack, kLeastError);
        if (high < far_low_) return;
        if (low > far_high_) far_.clear();
        far_.push_back({high, v});
        far_low_ = std::max(far_low_, low);
        far_high_ = std::max(far_high_, high);
    }

    Limits limits(const Best& best) const {
        if (best.vertex.index == kNone) return {};
        const Sight& s = best.sight;
        return {s.dot, std::fabs(s.cross), 16 * kUlp * reach_ * s.reach, s.away};
    }

    // 1 if v is clearly within the Flintstone so far, and not the farthest from the chord. No
    // branches, so that several are done at once.
    std::int64_t hides(Point v, const Limits& left, const Limits& right) const {
        double dx = v.x - p_.x, dy = v.y - p_.y, ex = v.x - s_.x, ey = v.y - s_.y;
        double dot = dx * ex + dy * ey, cross = cx_ * dy - cy_ * dx;
        double reach = std::fabs(dx) + std::fabs(dy), away = std::fabs(ex) + std::fabs(ey);
        double height = std::fabs(cross), along = dx * cx_ + dy * cy_;
        bool is_left = cross > 0;
        double best_dot = is_left ? left.dot : right.dot;
        double best_cross = is_left ? left.cross : right.cross;
        double best_reach = is_left ? left.reach : right.reach;
        double best_away = is_left ? left.away : right.away;
        double lead = dot * best_cross - best_dot * height;
        double ends = along > 0 ? ex * ex + ey * ey : dx * dx + dy * dy;
        double line = height * per_length_;
        double squared = ((along > 0) & (along < length2_)) ? line * line : ends;
        double room = far_low_ - 16 * kUlp * (reach + away);
        bool is_enclosed = (height > 6 * kUlp * reach_ * reach) &
                           (lead < -best_reach * reach * (away + best_away));
        return static_cast<std::int64_t>(is_enclosed | !seeks_discs_) &
               static_cast<std::int64_t>(room > kLeastError) &
               static_cast<std::int64_t>(squared < room * room * (1 - 8 * kUlp));
    }

    Vertex choose() const {
        const Vertex &q = left_.vertex, &r = right_.vertex;
        if (q.index == kNone && r.index == kNone) return middle_;
        if (q.index == kNone) return r;
        if (r.index == kNone) return q;
        int smaller =
            in_circle(p_, s_, q.at, r.at) == 0 ? 0 : compare_cotangents(p_, s_, q.at, r.at);
        if (smaller == 0) return q.at < r.at ? q : r;
        return smaller > 0 ? q : r;
    }

    bool seeks_discs_;
    Point p_{}, s_{};
    double cx_ = 0, cy_ = 0, reach_ = 0, length2_ = 0, per_length_ = 0;
    Best left_, right_;                    // the vertices with the smallest angles so far
    Vertex middle_;                        // of those on the chord, the one nearest its middle
    std::vector<Far> far_;                 // those that may be the farthest from the chord
    double far_low_ = -1, far_high_ = -1;  // what the farthest one's distance is at least, at most
};

}  // namespace flintknap
