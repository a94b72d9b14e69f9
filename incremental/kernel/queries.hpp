// Questions to the object as a whole, answered from the ring.
//
// Theory. A place q off the boundary is inside iff a ray from it to the right crosses an odd
// number of edges, an edge being crossed if just one of its ends is above q (greater y; an end on
// the ray counts as below, so a vertex the ray runs through counts once or not at all).
// Of the run of a node of the ring, a path from its first vertex to the one after its last,
//
//      wholly left of q       crosses the ray nowhere
//      wholly above or below  crosses it nowhere
//      wholly right of q      crosses it an odd number of times iff just one of its two ends is
//                             above q, however it winds between them
//      else                   its box holds q: its halves are looked at, or its edges
//
// so only nodes whose boxes hold q are entered. An edge whose box holds q is decided by the exact
// sign of its orientation, and tells if q is on it. Comparisons of coordinates are exact anyway.
//
// Cost: the number of boxes that hold the place, O(log n) on curves; no more than O(n).
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "ring.hpp"

namespace flintknap {

// What is known of a place: whether an odd number of edges was crossed, and whether it is on one.
constexpr unsigned kOdd = 1, kOn = 2;

inline int side_of(unsigned crossed) {
    return (crossed & kOn) != 0 ? 0 : (crossed & kOdd) != 0 ? 1 : -1;
}

// Of an edge whose box holds q.
inline unsigned crossed_by_edge(Point a, Point b, Point q) {
    int turn = orient(a, b, q);
    if (turn == 0) return kOn;
    bool rises = b.y > q.y;
    return (a.y > q.y) != rises && (turn > 0) == rises ? kOdd : 0;
}

// Of the run of a node that lies wholly to the right of q, or does not reach its height.
inline unsigned crossed_at_right(const Ring::Node& n, Point q) {
    return (n.box.x_low > q.x) & ((n.first_y > q.y) != (n.last_y > q.y));
}

// Of the edges of a leaf.
inline unsigned crossed_in_leaf(const Ring::Leaf& leaf, Index count, Point q) {
    std::int64_t odd = 0, near = 0;
    for (Index i = 0; i < count; ++i) {
        double ax = leaf.x[i], ay = leaf.y[i], bx = leaf.x[i + 1], by = leaf.y[i + 1];
        std::int64_t a_left = ax <= q.x, b_left = bx <= q.x, a_right = ax >= q.x,
                     b_right = bx >= q.x;
        std::int64_t a_up = ay > q.y, b_up = by > q.y, a_down = ay < q.y, b_down = by < q.y;
        odd ^= (a_up ^ b_up) & ~(a_left | b_left);
        near |= (a_left | b_left) & (a_right | b_right) & ~(a_up & b_up) & ~(a_down & b_down);
    }
    unsigned crossed = odd & kOdd;
    if ((near & 1) == 0) return crossed;
    for (Index i = 0; i < count; ++i) {
        Point a = {leaf.x[i], leaf.y[i]}, b = {leaf.x[i + 1], leaf.y[i + 1]};
        Box box = {a.x, a.y, a.x, a.y};
        box.extend(b.x, b.y);
        if (!box.holds(q)) continue;
        crossed ^= crossed_by_edge(a, b, q);
        if ((crossed & kOn) != 0) return crossed;
    }
    return crossed;
}

// +1 inside, 0 on the boundary, -1 outside.
inline int side(const Ring& ring, Point q) {
    if (ring.empty() || !ring.node(ring.root()).box.holds(q)) return -1;
    Index entered[Ring::kDeepest];
    int depth = 0;
    unsigned crossed = 0;
    entered[depth++] = ring.root();
    while (depth > 0) {
        const Ring::Node& n = ring.node(entered[--depth]);
        if (n.right == kNone) {
            crossed ^= crossed_in_leaf(ring.leaf_at(n), n.count, q);
            if ((crossed & kOn) != 0) return 0;
            continue;
        }
        for (Index child : {n.left, n.right}) {
            const Ring::Node& c = ring.node(child);
            crossed ^= crossed_at_right(c, q);
            entered[depth] = child;
            depth += c.box.holds(q);
        }
    }
    return side_of(crossed);
}

// The same of many places at once: those that enter a node do so together, so that branches are
// foreseeable and nodes are fetched once.
class Sides {
   public:
    explicit Sides(const Ring& ring) : ring_(ring) {}

    // place(i) is the place of i, 0 <= i < n; answer(i, side) takes the answer.
    template <class Place, class Answer>
    void ask(std::size_t n, Place place, Answer answer) {
        for (std::size_t start = 0; start < n; start += kBatch) {
            std::size_t count = std::min(kBatch, n - start);
            for (std::size_t i = 0; i < count; ++i) {
                places_[i] = place(start + i);
                crossed_[i] = 0;
                order_[i] = static_cast<std::uint16_t>(i);
            }
            if (!ring_.empty()) enter(ring_.root(), 0, count);
            for (std::size_t i = 0; i < count; ++i) answer(start + i, side_of(crossed_[i]));
        }
    }

   private:
    static constexpr std::size_t kBatch = 2048;

    // Of places order_[low .. high) those that node n's box holds come first, and enter.
    void enter(Index n, std::size_t low, std::size_t high) {
        const Ring::Node& node = ring_.node(n);
        std::size_t end = low;
        for (std::size_t i = low; i < high; ++i) {
            std::uint16_t p = order_[i];
            crossed_[p] ^= static_cast<std::uint8_t>(crossed_at_right(node, places_[p]));
            order_[i] = order_[end];
            order_[end] = p;
            end += node.box.holds(places_[p]);
        }
        if (end == low) return;
        if (node.right != kNone) {
            enter(node.left, low, end);
            enter(node.right, low, end);
            return;
        }
        const Ring::Leaf& leaf = ring_.leaf_at(node);
        for (std::size_t i = low; i < end; ++i) {
            std::uint8_t& crossed = crossed_[order_[i]];
            unsigned more = crossed_in_leaf(leaf, node.count, places_[order_[i]]);
            crossed = static_cast<std::uint8_t>((crossed ^ (more & kOdd)) | (more & kOn));
        }
    }

    const Ring& ring_;
    Point places_[kBatch];
    std::uint8_t crossed_[kBatch];
    std::uint16_t order_[kBatch];
};

}  // namespace flintknap
