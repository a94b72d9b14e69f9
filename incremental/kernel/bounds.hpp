// What the trees over a ring tell of it at a level or within a tolerance: bounds, never lies.
//
// Theory (docs/theory.md, section 7.2). Of a polyline a tree knows the ends p and s and the error:
// it is a *strand*, a path from p to s no point of which is farther than the error from the chord.
// A place or a segment is a strand, too, without error. For two strands with chords P and Q
//
//      p ~~~~~~~~~~~ s     gap(P, Q) - both errors        <=  their distance
//         \  gap             an end of one to the chord
//          u ~~~~~ v           of the other + its error   >=  their distance
//                          0, if they certainly cross
//
// since a strand passes every point of its chord within the error. They certainly cross if the
// chords do, properly, and each chord's ends are farther from the other chord than that strand
// strays: for then each strand can be drawn straight without an end of one meeting the other.
//
//            u               Pairs of strands are descended together, the closest first, those that
//        p~~~|~~~s           may be closer than what is known already; a pair that is not final is
//            v               parted into the halves of both. A lower bound is the largest on the
//                            way down, so each level's bounds lie within those of the level above.
//
// Distances are those of flintstone.hpp, rounded up from the exact ones, and contact of chords is
// an exact sign. So where all errors are 0, yes and no are exact.
//
// Cost: the pairs of polylines of the cut that lie about as close as the answer, and those above
// them; only they are refined.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "collision.hpp"
#include "hierarchy.hpp"

namespace flintknap {

constexpr double kFar = std::numeric_limits<double>::infinity();

struct Strand {
    Point p, s;
    double error;

    // From its chord, which may be a point, to v; rounded up.
    double far(Point v) const { return distance_to_chord(p, s, v); }
};

// Not more than a - b, and not less than a + b, of which none is negative.
inline double less(double a, double b) {
    return b == 0 ? a : std::max(std::nextafter(a - b, -kFar), 0.0);
}
inline double more(double a, double b) {
    return b == 0 ? a : a == 0 ? b : std::nextafter(a + b, kFar);
}

// Whether the boxes of the chords alone tell that the two are farther apart than that.
inline bool are_beyond(const Strand& a, const Strand& b, double far) {
    return squared_gap(box_of(a.p, a.s), box_of(b.p, b.s)) > gap_within(far + a.error + b.error);
}

// Of a distance. `crosses`: the two certainly cross.
struct Bounds {
    double lower = kFar, upper = kFar;
    bool crosses = false;
};

inline Bounds bounds(const Strand& a, const Strand& b) {
    std::array<double, 2> from_b = {a.far(b.p), b.p == b.s ? 0 : a.far(b.s)};
    if (b.p == b.s) from_b[1] = from_b[0];
    std::array<double, 2> from_a = {b.far(a.p), b.far(a.s)};
    double b_far = std::min(from_b[0], from_b[1]), a_far = std::min(from_a[0], from_a[1]);
    Bounds out;
    out.upper = std::min(more(b_far, a.error), more(a_far, b.error));
    if (Segment(b.p, b.s).meets({a.p, a.s})) {
        out.lower = 0;
        out.upper = std::min(out.upper, more(a.error, b.error));
        bool is_proper = orient(a.p, a.s, b.p) * orient(a.p, a.s, b.s) < 0 &&
                         orient(b.p, b.s, a.p) * orient(b.p, b.s, a.s) < 0;
        out.crosses = is_proper && b_far > a.error && a_far > b.error;
    } else {
        double gap = std::min(a_far, b_far);  // rounded up
        double least =
            gap > kLeastError ? std::nextafter(gap, 0.0) : std::numeric_limits<double>::min();
        out.lower = less(least, more(a.error, b.error));
    }
    for (Point v : {a.p, a.s}) {
        if (v == b.p || v == b.s) out.upper = 0;
    }
    if (out.crosses) out.upper = 0;
    return out;
}

// ------------------------------------------------------------------ what strands come from
// The strands of a tree down to a cut.
template <class Poll>
class Strands {
   public:
    struct Item {
        Hierarchy::Frame frame;
        Strand strand;
        bool is_final;
    };

    Strands(Hierarchy& tree, Cut cut, Poll poll) : tree_(tree), cut_(cut), poll_(poll) {}

    std::array<Item, 2> top() { return items(tree_.top()); }
    std::array<Item, 2> halves(const Item& of) { return items(tree_.halves(of.frame)); }

   private:
    std::array<Item, 2> items(const std::array<Hierarchy::Frame, 2>& frames) {
        return {item(frames[0]), item(frames[1])};
    }
    Item item(const Hierarchy::Frame& f) {
        double error = tree_.error(f, poll_);
        auto [p, s] = tree_.chord(f);
        return {f, {p, s, error}, tree_.is_final(f, cut_)};
    }

    Hierarchy& tree_;
    Cut cut_;
    Poll poll_;
};

// One strand that has no halves.
class Single {
   public:
    struct Item {
        Strand strand;
        bool is_final = true;
    };

    Single(Point p, Point s) : item_{{p, s, 0}} {}
    std::array<Item, 1> top() { return {item_}; }
    std::array<Item, 1> halves(const Item& of) { return {of}; }

   private:
    Item item_;
};

// ------------------------------------------------------------------ the search
// How far strands of one kind are from strands of another.
template <class One, class Other>
class Approach {
   public:
    Approach(One& one, Other& other) : one_(one), other_(other) {}

    // Bounds of the distance; if it is beyond `within` for certain, the lower one is infinite.
    // Looks no closer once they certainly touch, or if `until_crossing`, cross.
    Bounds ask(double within = kFar, bool until_crossing = false) {
        found_ = {};
        is_exact_ = true;
        pairs_.clear();
        for (const auto& a : one_.top()) {
            for (const auto& b : other_.top()) add({a, b, 0}, within);
        }
        while (!pairs_.empty() && !is_enough(until_crossing)) {
            std::pop_heap(pairs_.begin(), pairs_.end());
            Couple c = pairs_.back();
            pairs_.pop_back();
            if (c.lower > std::min(within, found_.upper)) break;
            if (c.a.is_final && c.b.is_final) {
                found_.lower = std::min(found_.lower, c.lower);
                is_exact_ = is_exact_ && c.a.strand.error == 0 && c.b.strand.error == 0;
            } else {
                part(c, within);
            }
        }
        if (found_.upper == 0) found_.lower = 0;
        return found_;
    }

    // Whether all pairs met at the end were without error.
    bool is_exact() const { return is_exact_; }

   private:
    struct Couple {
        typename One::Item a;
        typename Other::Item b;
        double lower;
        bool operator<(const Couple& c) const { return lower > c.lower; }  // closest on top
    };

    bool is_enough(bool until_crossing) const {
        return until_crossing ? found_.crosses : found_.upper == 0;
    }

    void add(Couple c, double within) {
        if (are_beyond(c.a.strand, c.b.strand, std::min(within, found_.upper))) return;
        Bounds here = bounds(c.a.strand, c.b.strand);
        c.lower = std::max(c.lower, here.lower);
        found_.upper = std::min(found_.upper, here.upper);
        found_.crosses = found_.crosses || here.crosses;
        if (c.lower > std::min(within, found_.upper)) return;
        pairs_.push_back(c);
        std::push_heap(pairs_.begin(), pairs_.end());
    }

    void part(const Couple& c, double within) {
        if (c.a.is_final) {
            for (const auto& b : other_.halves(c.b)) add({c.a, b, c.lower}, within);
        } else if (c.b.is_final) {
            for (const auto& a : one_.halves(c.a)) add({a, c.b, c.lower}, within);
        } else {
            for (const auto& a : one_.halves(c.a)) {
                for (const auto& b : other_.halves(c.b)) add({a, b, c.lower}, within);
            }
        }
    }

    One& one_;
    Other& other_;
    Bounds found_;
    bool is_exact_ = true;
    std::vector<Couple> pairs_;
};

// Bounds of the parameter at which a segment first meets strands; infinite for no hit at all.
template <class One>
class FirstHit {
   public:
    FirstHit(One& one, const Segment& s) : one_(one), s_(s), back_(s.q, s.p) {}

    Bounds ask() {
        for (const auto& item : one_.top()) add(item, 0);
        while (!ways_.empty()) {
            std::pop_heap(ways_.begin(), ways_.end());
            Way way = ways_.back();
            ways_.pop_back();
            if (way.entry > found_.upper) break;
            if (way.item.is_final) {
                found_.lower = std::min(found_.lower, way.entry);
            } else {
                for (const auto& item : one_.halves(way.item)) add(item, way.entry);
            }
        }
        return found_;
    }

   private:
    struct Way {
        typename One::Item item;
        double entry;  // a hit there comes no earlier
        bool operator<(const Way& w) const { return entry > w.entry; }  // earliest on top
    };

    void add(const typename One::Item& item, double entry) {
        const Strand &strand = item.strand, segment = {s_.p, s_.q, 0};
        if (are_beyond(strand, segment, 0)) return;
        Bounds apart = bounds(strand, segment);
        if (apart.lower > 0) return;
        if (strand.error == 0) {
            double t = s_.parameter({strand.p, strand.s});
            found_ = {std::min(found_.lower, t), std::min(found_.upper, t)};
            return;
        }
        Box box = box_of(strand.p, strand.s);
        box = {std::nextafter(box.x_low - strand.error, -kFar),
               std::nextafter(box.y_low - strand.error, -kFar),
               std::nextafter(box.x_high + strand.error, kFar),
               std::nextafter(box.y_high + strand.error, kFar)};
        if (apart.upper == 0) {
            double exit = std::nextafter(1 - back_.entry(box), kFar);
            found_.upper = std::min(found_.upper, std::min(exit, 1.0));
        }
        ways_.push_back({item, std::max(entry, s_.entry(box))});
        std::push_heap(ways_.begin(), ways_.end());
    }

    One& one_;
    const Segment& s_;
    const Segment back_;
    Bounds found_;
    std::vector<Way> ways_;
};

}  // namespace flintknap
