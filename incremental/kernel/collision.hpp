// Segments against the ring, and ring against ring: do they meet, where first, who is inside.
//
// Theory. Two closed segments have a point in common iff their boxes do and neither has both ends
// strictly on one side of the other: for segments that cross or touch the signs say so, and for
// those on one line the boxes do. A segment of no length is a point. Nothing is rounded.
//
// Along a segment from p to q, an edge ab that meets it does so first at t = o(p) / (o(p) - o(q)),
// o(v) being the orientation of a, b, v; if all four lie on a line, at p or at that end of the edge
// which comes first. Either is a quotient of exact sums of doubles, and t is *correctly rounded*:
// one number for one segment and one edge. Of edges with the same t that with the smaller start
// comes first. So a vertex that the segment runs through is met twice, at the same t.
//
// A segment lies in the closed object iff p does and nothing leads out at a point of contact:
//
//      a proper crossing                                     leads out
//      p or q within an edge: out iff the other end is strictly right of it (the object is on the
//          left of its edges)
//      a vertex v of the ring on the segment, u before it and w after it:
//
//               w   .           the ways from v to p and to q must lie between vw and vu, on the
//                \ .  object    left: of uv and vw both if the ring turns left at v, of one of
//            u -> v  . . e      them if it turns right; or else they lead out
//
// A glance at the cells tells most short segments: of five places on it two are in clear parts on
// different sides, or all cells about it have no leaves (raster.hpp). Of most others in two cells
// by two, traces tell that it surely crosses an edge, or comes near none (traces.hpp); what these
// leave open is asked exactly. If it is longer, or has not been asked about before, its contacts
// are found in the leaves of cells (cells.hpp), or from the top of the tree: a node is passed over
// if its box has no point in common with that of the segment, or lies on one side of its line
// beyond all rounding. Two rings descend together, the larger node first; if none of their edges
// meet, one object holds the other or they are apart, which any one vertex tells.
//
// Cost: the boxes that meet the segment; of two rings, the pairs of boxes that do.
#pragma once

#include "distance.hpp"
#include "queries.hpp"

namespace flintknap {

class Segment {
   public:
    Segment(Point from, Point to)
        : p(from), q(to), box(box_of(p, q)), x_(q.x - p.x), y_(q.y - p.y) {}

    // False only if nothing in the box is on the segment.
    bool may_meet(const Box& b) const {
        if (!overlap(box, b)) return false;
        // Where the box lies as seen from p; each difference is an ulp off at most.
        double x_low = b.x_low - p.x, x_high = b.x_high - p.x;
        double y_low = b.y_low - p.y, y_high = b.y_high - p.y;
        double middle = x_ * (y_low + y_high) - y_ * (x_low + x_high);
        double reach = std::fabs(x_) * (y_high - y_low) + std::fabs(y_) * (x_high - x_low);
        double terms = std::fabs(x_) * (std::fabs(y_low) + std::fabs(y_high)) +
                       std::fabs(y_) * (std::fabs(x_low) + std::fabs(x_high));
        return std::fabs(middle) <= reach + 16 * kUlp * terms;
    }

    // No point of the box that is on the segment comes before this parameter.
    double entry(const Box& b) const {
        double x = x_ > 0 ? (b.x_low - p.x) / x_ : x_ < 0 ? (b.x_high - p.x) / x_ : 0;
        double y = y_ > 0 ? (b.y_low - p.y) / y_ : y_ < 0 ? (b.y_high - p.y) / y_ : 0;
        return std::max(std::max(x, y), 0.0) * (1 - 16 * kUlp);
    }

    // The edges of a leaf that may meet the segment, as bits: those whose ends are not both beyond
    // the same side of its box; if they are many, nor certainly on the same side of its line.
    std::int64_t candidates(const Ring::Leaf& leaf, Index count) const {
        constexpr int few = 6;
        std::int64_t left = not_beside(leaf, count, box);
        return __builtin_popcountll(static_cast<unsigned long long>(left)) <= few
                   ? left
                   : left & ~on_one_side(leaf);
    }

    bool meets(Edge e) const {
        return overlap(box, box_of(e.a, e.b)) && orient(e.a, e.b, p) * orient(e.a, e.b, q) <= 0 &&
               orient(p, q, e.a) * orient(p, q, e.b) <= 0;
    }

    // Where it first meets an edge that it does meet.
    double parameter(Edge e) const;

    const Point p, q;
    const Box box;

   private:
    std::int64_t on_one_side(const Ring::Leaf& leaf) const {
        Gathered left, right;
        for (int i = 0; i < Ring::kRoom / 2; ++i) {
            Lanes x = load(leaf.x + 2 * i), y = load(leaf.y + 2 * i);
            Lanes first = both(x_) * (y - both(p.y)), second = both(y_) * (x - both(p.x));
            Lanes slack = both(16 * kUlp) * (magnitudes(first) + magnitudes(second));
            left.add(i, first - second > slack);
            right.add(i, second - first > slack);
        }
        return left.pairs() | right.pairs();
    }

    double x_, y_;
};

// ------------------------------------------------------------------ parameters
// part / whole, 0 < part <= whole, correctly rounded; `start` is a few ulps off at most. Scaled
// to about 1 meanwhile, so that no product falls out of range.
template <int M, int N>
double exact_share(const Expansion<M>& part, const Expansion<N>& whole, double start) {
    int exponent = std::ilogb(start);
    double q = rounded_quotient(scaled(part, -exponent), whole, std::ldexp(start, -exponent));
    return std::ldexp(q, exponent);
}

template <int N>
Expansion<N> magnitude(const Expansion<N>& e) {
    return e.sign() < 0 ? -e : e;
}

inline double Segment::parameter(Edge e) const {
    int at_p = orient(e.a, e.b, p), at_q = orient(e.a, e.b, q);
    if (at_p == 0 && at_q == 0) {
        if (box_of(e.a, e.b).holds(p)) return 0;
        Point first = p < q ? std::min(e.a, e.b) : std::max(e.a, e.b);
        bool by_x = p.x != q.x;
        auto part = by_x ? difference(first.x, p.x) : difference(first.y, p.y);
        auto whole = by_x ? difference(q.x, p.x) : difference(q.y, p.y);
        return exact_share(magnitude(part), magnitude(whole), part.estimate() / whole.estimate());
    }
    if (at_p == 0) return 0;
    if (at_q == 0) return 1;
    Pair to_p = accurate_cross(e.a, e.b, p), to_q = accurate_cross(e.a, e.b, q);
    Pair t = pair_quotient(to_p, pair_sum(to_p, {-to_q.high, -to_q.low}));
    double slack = t.high / (1ULL << 60) / (1 << 14);  // 2^-74: each of the above is off by 2^-79
    double low = t.high + (t.low - slack), high = t.high + (t.low + slack);
    if (low == high) return low;
    auto part = magnitude(exact_cross(e.a, e.b, p));
    return exact_share(part, part + magnitude(exact_cross(e.a, e.b, q)), t.high);
}

// ------------------------------------------------------------------ a segment and the ring
// Calls f(leaf, place) for edges that meet the segment below node n until one call returns true;
// returns whether one did.
template <class F>
bool any_contact(const Ring& ring, Index n, const Segment& s, F&& f) {
    const Ring::Node& node = ring.node(n);
    if (!s.may_meet(node.box)) return false;
    if (node.right != kNone) {
        return any_contact(ring, node.left, s, f) || any_contact(ring, node.right, s, f);
    }
    const Ring::Leaf& leaf = ring.leaf_at(node);
    for (std::int64_t left = s.candidates(leaf, node.count); left != 0; left &= left - 1) {
        Index i = lowest(left);
        if (s.meets(edge_of(leaf, i)) && f(n, i)) return true;
    }
    return false;
}

// The same of the whole ring; of a short segment, edges may be told more than once.
template <class F>
bool any_contact(Cells& cells, const Segment& s, F&& f) {
    const Ring& ring = cells.ring();
    if (ring.empty() || !s.may_meet(ring.node(ring.root()).box)) return false;
    bool found = false;
    bool is_all =
        cells.visit(s.box, [&](Index leaf) { return found = any_contact(ring, leaf, s, f); });
    return is_all ? found : any_contact(ring, ring.root(), s, f);
}

// Whether a segment meets the boundary. What has been seen tells, or not, without a branch: it
// could not be foreseen.
struct Intersects {
    static bool is_told(Raster::Sides seen) {
        return Raster::are_both(seen) | ((seen & Raster::kEdges) == 0);
    }
    static bool told(Raster::Sides seen) { return Raster::are_both(seen); }
    static bool counts(const Ring&, Index, Index, const Segment&) { return true; }
    static bool answer(Cells&, Point, bool is_any) { return is_any; }
};

// An edge by its leaf and its place there, and where the segment first meets it.
struct Hit {
    double t = std::numeric_limits<double>::quiet_NaN();
    Index leaf = kNone, place = kNone;
};

class Hits {
   public:
    Hits(const Ring& ring, const Segment& s) : ring_(ring), s_(s) {}

    Hit first(Cells& cells) {
        if (ring_.empty() || !s_.may_meet(ring_.node(ring_.root()).box)) return first_;
        auto scan_near = [&](Index leaf) {
            if (s_.may_meet(ring_.node(leaf).box)) scan(leaf);
            return false;
        };
        if (!cells.visit(s_.box, scan_near)) enter(ring_.root());
        return first_;
    }

    // By parameter, then by start.
    std::vector<Hit> all() const {
        std::vector<Hit> hits;
        if (ring_.empty()) return hits;
        any_contact(ring_, ring_.root(), s_, [&](Index n, Index i) {
            hits.push_back({s_.parameter(edge_of(ring_.leaf(n), i)), n, i});
            return false;
        });
        std::sort(hits.begin(), hits.end(),
                  [&](const Hit& a, const Hit& b) { return comes_before(a, b); });
        return hits;
    }

   private:
    bool comes_before(const Hit& a, const Hit& b) const {
        if (a.t != b.t) return a.t < b.t;
        return edge_of(ring_.leaf(a.leaf), a.place).a < edge_of(ring_.leaf(b.leaf), b.place).a;
    }

    void scan(Index n) {
        const Ring::Leaf& leaf = ring_.leaf(n);
        std::int64_t left = s_.candidates(leaf, ring_.node(n).count);
        for (; left != 0; left &= left - 1) {
            Index i = lowest(left);
            if (!s_.meets(edge_of(leaf, i))) continue;
            Hit hit = {s_.parameter(edge_of(leaf, i)), n, i};
            if (first_.leaf == kNone || comes_before(hit, first_)) first_ = hit;
        }
    }

    // A node that the segment may meet, before the first hit so far.
    void enter(Index n) {
        const Ring::Node& node = ring_.node(n);
        if (node.right == kNone) {
            scan(n);
            return;
        }
        const Box &left = ring_.node(node.left).box, &right = ring_.node(node.right).box;
        bool left_first = s_.entry(left) <= s_.entry(right);
        for (Index child : {left_first ? node.left : node.right,  //
                            left_first ? node.right : node.left}) {
            const Box& box = ring_.node(child).box;
            bool too_late = first_.leaf != kNone && s_.entry(box) > first_.t;
            if (!too_late && s_.may_meet(box)) enter(child);
        }
    }

    const Ring& ring_;
    const Segment& s_;
    Hit first_;
};

// Whether a segment leads out of the object at an edge that it meets, or at the start of that edge.
inline bool leads_out_at(const Ring& ring, Index n, Index place, const Segment& s) {
    const Ring::Leaf& leaf = ring.leaf(n);
    auto [a, b] = edge_of(leaf, place);
    int at_p = orient(a, b, s.p), at_q = orient(a, b, s.q);
    int at_a = orient(s.p, s.q, a), at_b = orient(s.p, s.q, b);
    if (at_p * at_q < 0 && at_a * at_b < 0) return true;
    bool vertices = s.p == a || s.p == b || s.q == a || s.q == b;
    const Box edge = box_of(a, b);
    if (!vertices && at_p == 0 && edge.holds(s.p) && at_q < 0) return true;
    if (!vertices && at_q == 0 && edge.holds(s.q) && at_p < 0) return true;
    if (at_a != 0 || !s.box.holds(a)) return false;
    Point before = place > 0 ? Point{leaf.x[place - 1], leaf.y[place - 1]} : Point{};
    if (place == 0) {
        Index m = ring.leaf_before(n);
        before = edge_of(ring.leaf(m), ring.node(m).count - 1).a;
    }
    return (!(s.p == a) && leads_out(before, a, b, s.p)) ||
           (!(s.q == a) && leads_out(before, a, b, s.q));
}

// Whether a segment lies in the closed object.
struct Holds {
    static bool is_told(Raster::Sides seen) {
        return ((seen & Raster::kOutside) != 0) | told(seen);
    }
    static bool told(Raster::Sides seen) { return seen == Raster::kInside; }
    static bool counts(const Ring& ring, Index n, Index place, const Segment& s) {
        return leads_out_at(ring, n, place, s);
    }
    static bool answer(Cells& cells, Point p, bool is_any) { return !is_any && cells.side(p) >= 0; }
};

// One of these that a glance does not tell; without a way, if it is long.
template <class Question>
bool tell_closely(Cells& cells, const Segment& s, const Cells::Way* way) {
    const Ring& ring = cells.ring();
    if (way != nullptr) {
        auto any = cells.any_met(*way, [&](const Ring::Leaf& leaf, Index place) {
            return s.meets(edge_of(leaf, place)) &&
                   Question::counts(ring, ring.leaf_of(leaf.vertex[0]), place, s);
        });
        if (any) return Question::answer(cells, s.p, *any);
    }
    bool is_any = any_contact(
        cells, s, [&](Index n, Index place) { return Question::counts(ring, n, place, s); });
    return Question::answer(cells, s.p, is_any);
}
template <class Question>
bool tell(Cells& cells, Point p, Point q) {
    if (cells.ring().empty()) return false;
    Cells::Way way;
    if (!cells.locate(p, q, way)) return tell_closely<Question>(cells, {p, q}, nullptr);
    cells.look_along(way);
    Raster::Sides seen = way.plain != 0 ? way.plain : Cells::glance(way);
    return Question::is_told(seen) ? Question::told(seen)
                                   : tell_closely<Question>(cells, {p, q}, &way);
}

// The same of many, ends(i) being those of i, 0 <= i < n; answer(i, told) takes the answer. Some
// take each step together: what a step reads has been fetched or computed in the one before, so
// that what cannot be foreseen is soon known. Those that a glance does not tell wait until there
// are some. Only then anything is drawn.
template <class Question, class Ends, class Answer>
class Several {
   public:
    Several(Cells& cells, Ends ends, Answer answer) : cells_(cells), ends_(ends), answer_(answer) {}

    void ask(std::size_t n) {
        for (std::size_t next = 0; next < n;) {
            next = locate(next, n);
            look_along();
            glance();
            if (untold_ >= kRoom) tell_the_rest();
        }
        tell_the_rest();
    }

   private:
    static constexpr std::size_t kRoom = 32;
    struct Asked {
        Cells::Way way;
        std::size_t i;
    };

    // Some from i on; returns where the next ones begin.
    std::size_t locate(std::size_t i, std::size_t n) {
        for (located_ = 0; i < n && located_ < kRoom; ++i) {
            auto [p, q] = ends_(i);
            some_[located_].i = i;
            if (cells_.locate(p, q, some_[located_].way)) {
                ++located_;
            } else {
                answer_(i, tell_closely<Question>(cells_, {p, q}, nullptr));
            }
        }
        return i;
    }

    void look_along() {
        near_count_ = 0;
        for (std::size_t k = 0; k < located_; ++k) {
            auto& [way, i] = some_[k];
            cells_.look_along(way);
            if (way.plain != 0) {
                answer_(i, Question::told(way.plain));
            } else {
                way.fetch();
                near_[near_count_++] = k;
            }
        }
    }

    void glance() {
        std::size_t first = untold_;
        for (std::size_t k = 0; k < near_count_; ++k) {
            const Asked& asked = some_[near_[k]];
            Raster::Sides seen = Cells::glance(asked.way);
            answer_(asked.i, Question::told(seen));
            rest_[untold_] = asked;
            untold_ += !Question::is_told(seen);
        }
        for (std::size_t k = first; k < untold_; ++k) cells_.fetch_traces(rest_[k].way);
    }

    void tell_the_rest() {
        for (std::size_t k = 0; k < untold_; ++k) {
            const auto& [way, i] = rest_[k];
            auto [p, q] = ends_(i);
            answer_(i, tell_closely<Question>(cells_, {p, q}, &way));
        }
        untold_ = 0;
    }

    Cells& cells_;
    Ends ends_;
    Answer answer_;
    std::size_t located_ = 0, near_count_ = 0, untold_ = 0;
    Asked some_[kRoom];
    std::size_t near_[kRoom];  // of these, those that leaves are near
    Asked rest_[2 * kRoom];    // of all so far, those that are to be told closely
};
template <class Question, class Ends, class Answer>
void tell_each(Cells& cells, std::size_t n, Ends ends, Answer answer) {
    if (!cells.ring().empty()) {
        Several<Question, Ends, Answer>(cells, ends, answer).ask(n);
        return;
    }
    for (std::size_t i = 0; i < n; ++i) answer(i, false);
}

// ------------------------------------------------------------------ two rings
// Whether edges below node m of one ring and node n of the other have a point in common.
inline bool have_contact(const Ring& one, Index m, const Ring& other, Index n) {
    const Ring::Node &a = one.node(m), &b = other.node(n);
    if (!overlap(a.box, b.box)) return false;
    bool a_is_leaf = a.right == kNone, b_is_leaf = b.right == kNone;
    if (a_is_leaf && b_is_leaf) {
        const Ring::Leaf& leaf = one.leaf_at(a);
        for (Index i = 0; i < a.count; ++i) {
            auto [p, q] = edge_of(leaf, i);
            auto met = [](Index, Index) { return true; };
            if (any_contact(other, n, Segment(p, q), met)) return true;
        }
        return false;
    }
    if (b_is_leaf || (!a_is_leaf && a.count >= b.count)) {
        return have_contact(one, a.left, other, n) || have_contact(one, a.right, other, n);
    }
    return have_contact(one, m, other, b.left) || have_contact(one, m, other, b.right);
}

// Whether the closed objects have a point in common.
inline bool collide(const Ring& a, const Ring& b) {
    if (a.empty() || b.empty()) return false;
    const Ring::Leaf &of_a = a.leaf(a.first_leaf(a.root())), &of_b = b.leaf(b.first_leaf(b.root()));
    return side(a, {of_b.x[0], of_b.y[0]}) >= 0 || side(b, {of_a.x[0], of_a.y[0]}) >= 0 ||
           have_contact(a, a.root(), b, b.root());
}

}  // namespace flintknap
