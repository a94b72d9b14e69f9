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

#include "lanes.hpp"
#include "order.hpp"
#include "ring.hpp"

namespace flintknap {

inline Box box_of(Point a, Point b) {
    return {std::min(a.x, b.x), std::min(a.y, b.y), std::max(a.x, b.x), std::max(a.y, b.y)};
}

struct Edge {
    Point a, b;
};

inline Edge edge_of(const Ring::Leaf& leaf, Index place) {
    return {{leaf.x[place], leaf.y[place]}, {leaf.x[place + 1], leaf.y[place + 1]}};
}

// Whether the way from v to e leads out of the object, u being before v on the ring and w after it.
inline bool leads_out(Point u, Point v, Point w, Point e) {
    bool left_of_first = orient(u, v, e) >= 0, left_of_second = orient(v, w, e) >= 0;
    int turn = orient(u, v, w);
    if (turn == 0) return !left_of_first;
    return turn > 0 ? !(left_of_first && left_of_second) : !(left_of_first || left_of_second);
}

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

// The edges of a leaf that do not have both ends beyond the same side of a box, as bits.
inline std::int64_t not_beside(const Ring::Leaf& leaf, Index count, const Box& box) {
    Gathered before, behind, under, over;
    for (int i = 0; i < Ring::kRoom / 2; ++i) {  // those behind the last count for nothing
        Lanes x = load(leaf.x + 2 * i), y = load(leaf.y + 2 * i);
        before.add(i, x < both(box.x_low));
        behind.add(i, x > both(box.x_high));
        under.add(i, y < both(box.y_low));
        over.add(i, y > both(box.y_high));
    }
    std::int64_t beside = before.pairs() | behind.pairs() | under.pairs() | over.pairs();
    return ~beside & ((std::int64_t{1} << count) - 1);
}

// Of the edges of a leaf. Where each vertex lies is gathered as bits, without a branch.
inline unsigned crossed_in_leaf(const Ring::Leaf& leaf, Index count, Point q) {
    Gathered gathered_above, gathered_level, gathered_right, gathered_not_left;
    for (int i = 0; i < Ring::kRoom / 2; ++i) {  // those behind the last count for nothing
        Lanes x = load(leaf.x + 2 * i), y = load(leaf.y + 2 * i);
        gathered_above.add(i, y > both(q.y));
        gathered_level.add(i, y == both(q.y));
        gathered_right.add(i, x > both(q.x));
        gathered_not_left.add(i, x >= both(q.x));
    }
    std::int64_t above = gathered_above.bits(), level = gathered_level.bits();
    std::int64_t right = gathered_right.bits(), not_left = gathered_not_left.bits();
    std::int64_t edges = (std::int64_t{1} << count) - 1;
    std::int64_t crossing = (above ^ (above >> 1)) & edges;
    right &= right >> 1;
    not_left |= not_left >> 1;
    // An edge with no end at the height of q holds q in its box only if it passes that height, and
    // has not both ends to one side.
    std::int64_t near = level != 0 ? edges : crossing & ~right & not_left;
    crossing &= ~near & right;
    unsigned crossed =
        __builtin_parityll(static_cast<unsigned long long>(crossing)) != 0 ? kOdd : 0;
    for (; near != 0; near &= near - 1) {
        int i = lowest(near);
        Point a = {leaf.x[i], leaf.y[i]}, b = {leaf.x[i + 1], leaf.y[i + 1]};
        Box box = {a.x, a.y, a.x, a.y};
        box.extend(b.x, b.y);
        if (box.holds(q)) {
            crossed ^= crossed_by_edge(a, b, q);
            if ((crossed & kOn) != 0) return kOn;
        } else if (box.x_low > q.x) {
            crossed ^= (a.y > q.y) != (b.y > q.y) ? kOdd : 0;
        }
    }
    return crossed;
}

// Of the run of a node. Nodes are taken first come, first served: which comes next does not depend
// on what the one before tells, so the processor fetches several at a time.
inline unsigned crossed_below(const Ring& ring, Index top, Point q) {
    constexpr int room = 128;  // enough nearly always
    if (!ring.node(top).box.holds(q)) return crossed_at_right(ring.node(top), q);
    Index entered[room];
    int count = 0;
    unsigned crossed = 0;
    entered[count++] = top;
    for (int i = 0; i < count; ++i) {
        const Ring::Node& n = ring.node(entered[i]);
        if (n.right == kNone) {
            crossed ^= crossed_in_leaf(ring.leaf_at(n), n.count, q);
        } else if (count + 2 > room) {
            crossed ^= crossed_below(ring, n.left, q);
            if ((crossed & kOn) == 0) crossed ^= crossed_below(ring, n.right, q);
        } else {
            for (Index child : {n.left, n.right}) {
                const Ring::Node& c = ring.node(child);
                crossed ^= crossed_at_right(c, q);
                entered[count] = child;
                count += c.box.holds(q);
            }
        }
        if ((crossed & kOn) != 0) return kOn;
    }
    return crossed;
}

// +1 inside, 0 on the boundary, -1 outside.
inline int side(const Ring& ring, Point q) {
    return ring.empty() ? -1 : side_of(crossed_below(ring, ring.root(), q));
}

// The same of many places at once. They are taken in batches of neighbours: in the order of the
// cells of a grid over the ring, rows running to and fro. The places of a batch that enter a node
// do so together, so nodes are fetched once and branches are foreseeable; near the root all enter
// or none does, as the box of the batch tells at once.
class Sides {
   public:
    explicit Sides(const Ring& ring) : ring_(ring) {}

    // place(i) is the place of i, 0 <= i < n; answer(i, side) takes the answer.
    template <class Place, class Answer>
    void ask(std::size_t n, Place place, Answer answer) {
        if (ring_.empty()) {
            for (std::size_t i = 0; i < n; ++i) answer(i, -1);
            return;
        }
        Order items = grouped(n, place);
        for (std::size_t start = 0; start < n; start += kBatch) {
            std::size_t count = std::min(kBatch, n - start);
            for (std::size_t i = 0; i < count; ++i) {
                Point p = place(items[start + i]);
                if (i == 0) box_ = {p.x, p.y, p.x, p.y};
                box_.extend(p.x, p.y);
                places_[i] = p;
                crossed_[i] = 0;
                order_[i] = static_cast<std::uint16_t>(i);
            }
            enter(ring_.root(), 0, count);
            for (std::size_t i = 0; i < count; ++i) {
                answer(items[start + i], side_of(crossed_[i]));
            }
        }
    }

   private:
    static constexpr std::size_t kBatch = 1024;

    // 0 .. n - 1 by cells, of which there are about as many as batches.
    template <class Place>
    Order grouped(std::size_t n, Place place) const {
        double rows = std::min(std::ceil(std::sqrt(static_cast<double>(n / kBatch + 1))), 45.0);
        const Box& box = ring_.node(ring_.root()).box;
        double scale = rows / std::max(box.x_high - box.x_low, box.y_high - box.y_low);
        auto cell = [&](double offset) {
            return static_cast<std::uint64_t>(std::max(0.0, std::min(offset * scale, rows - 1)));
        };
        std::uint64_t last = static_cast<std::uint64_t>(rows) - 1;
        return Order(n, [&](std::size_t i) {
            Point p = place(i);
            std::uint64_t column = cell(p.x - box.x_low), row = cell(p.y - box.y_low);
            return (row * (last + 1) + (row % 2 == 0 ? column : last - column)) << 53;
        });
    }

    // Whether no place of the batch enters a node or crosses its run an odd number of times.
    bool is_beside(const Ring::Node& n) const {
        if (n.box.x_high < box_.x_low || n.box.y_low > box_.y_high || n.box.y_high < box_.y_low)
            return true;
        return n.box.x_low > box_.x_high && ((n.first_y > box_.y_high && n.last_y > box_.y_high) ||
                                             (n.first_y <= box_.y_low && n.last_y <= box_.y_low));
    }

    // Of places order_[low .. high) those that node n's box holds come first, and enter.
    void enter(Index n, std::size_t low, std::size_t high) {
        const Ring::Node& node = ring_.node(n);
        std::size_t end = low;
        if (is_beside(node)) return;
        if (node.box.holds({box_.x_low, box_.y_low}) &&
            node.box.holds({box_.x_high, box_.y_high})) {
            end = high;
        } else {
            for (std::size_t i = low; i < high; ++i) {
                std::uint16_t p = order_[i];
                crossed_[p] ^= static_cast<std::uint8_t>(crossed_at_right(node, places_[p]));
                order_[i] = order_[end];
                order_[end] = p;
                end += node.box.holds(places_[p]);
            }
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
    Box box_;  // of the batch
    Point places_[kBatch];
    std::uint8_t crossed_[kBatch];
    std::uint16_t order_[kBatch];
};

}  // namespace flintknap
