// The ring as a sequence: ranks, ranges and boxes, and local splices.
//
// Theory. Leaves hold up to 31 consecutive vertices each, with their coordinates, so that a scan
// reads memory in order. Above them stands a binary tree balanced by height (AVL), built from two
// operations: `join` puts two trees end to end, `cut_before` parts one; both keep the balance and
// cost O(log n). A node's run is that of its vertices *and the edge to the next one*:
//
//      leaf     x, y    a   b   c | d             Node: box        of a .. d, all its edges in it
//               vertex  a   b   c | d                   first_y    of a
//                       `- run -'  the first            last_y     of d
//                       count = 3  of the next leaf     count      3
//
//              [n]            The runs of all nodes of a height make up the closed ring: the last
//              leaf
//             /   \           is followed by the first. The ring is a cycle, and which leaf is
//             first
//          [l]     [r]        is of no account (splices move it). Ranks count from the
//          / \     / \        lexicographically smallest vertex.
//        [a] [b] [c] [d]
//
// Who reads it. From the top, for whatever a box can rule out:
//
//      visit(n): if nothing of interest can lie in ring.node(n).box, return
//                if ring.is_leaf(n): const Ring::Leaf& l = ring.leaf(n); the edges are
//                    (l.x[i], l.y[i]) -> (l.x[i+1], l.y[i+1]), i = 0 .. node.count - 1
//                else visit(node.left), visit(node.right)           first half, second half
//
// and by range: `visit_range(rank, count, f)` calls f(n, begin, end) for O(log n) pieces, in order
// along the ring, which together are the vertices of these ranks: the run of a whole subtree n
// (begin = 0, end = node(n).count), or vertices begin .. end - 1 of leaf n. `visit_run(n, begin,
// end, f)` does the same below n. The shape of the tree depends on history: answers must not (ties
// by coordinates, not by who comes first in the tree).
//
// Invariants (check): the sequence is the walk along following(); boxes, counts and ends are those
// of the runs; siblings differ by 1 in height at most.
// Cost: build O(n); rank, vertex, cut, join O(log n); about 28 bytes a vertex when just built, 40
// after many splices.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "mesh.hpp"
#include "predicates.hpp"

namespace flintknap {

// Closed.
struct Box {
    double x_low, y_low, x_high, y_high;

    bool holds(Point p) const {
        return (x_low <= p.x) & (p.x <= x_high) & (y_low <= p.y) & (p.y <= y_high);
    }
    void extend(double x, double y) {
        x_low = std::min(x_low, x), x_high = std::max(x_high, x);
        y_low = std::min(y_low, y), y_high = std::max(y_high, y);
    }
    void extend(const Box& b) {
        extend(b.x_low, b.y_low);
        extend(b.x_high, b.y_high);
    }
    bool operator==(const Box& b) const {
        return x_low == b.x_low && y_low == b.y_low && x_high == b.x_high && y_high == b.y_high;
    }
};

inline bool overlap(const Box& a, const Box& b) {
    return (a.x_low <= b.x_high) & (b.x_low <= a.x_high) & (a.y_low <= b.y_high) &
           (b.y_low <= a.y_high);
}

class Ring {
   public:
    static constexpr Index kRoom = 32;  // places in a leaf, that of the closing vertex included
    static constexpr Index kMost = kRoom - 1;  // vertices in a leaf
    static constexpr Index kFill = 26;         // in one that was just made
    static constexpr Index kLeast = 8;         // where splices gather some from the next leaf
    static constexpr int kDeepest = 48;        // no tree that memory can hold is higher

    struct alignas(64) Node {
        Box box;
        double first_y, last_y;
        Index left, right;  // of a leaf: its place among the leaves, kNone
        Index parent, count;
    };
    struct alignas(64) Leaf {
        double x[kRoom], y[kRoom];
        Index vertex[kRoom];

        // Ahead of a look at so many edges.
        [[gnu::always_inline]] void fetch(Index count) const {
            for (Index i = 0; i <= count; i += 8) {
                __builtin_prefetch(x + i);
                __builtin_prefetch(y + i);
            }
        }
    };

    bool empty() const { return root_ == kNone; }
    Index size() const { return empty() ? 0 : node(root_).count; }
    Index root() const { return root_; }
    const Node& node(Index n) const { return nodes_[at(n)]; }
    bool is_leaf(Index n) const { return node(n).right == kNone; }
    const Leaf& leaf(Index n) const { return leaf_at(node(n)); }
    const Leaf& leaf_at(const Node& n) const { return leaves_[at(n.left)]; }
    const Leaf& leaf_in(Index place) const { return leaves_[at(place)]; }

    bool holds(Index v) const { return leaf_of(v) != kNone; }
    // The leaf with a vertex, or kNone; and the place of a vertex in its leaf.
    Index leaf_of(Index v) const { return at(v) < leaf_of_.size() ? leaf_of_[at(v)] : kNone; }
    [[gnu::always_inline]] void prefetch(Index v) const {
        if (at(v) < leaf_of_.size()) __builtin_prefetch(&leaf_of_[at(v)]);
    }
    Index place_in(Index n, Index v) const {
        const Index* first = leaf(n).vertex;
        return static_cast<Index>(std::find(first, first + node(n).count, v) - first);
    }
    Index next(Index v) const {
        Index n = leaf_of(v);
        return leaf(n).vertex[place_in(n, v) + 1];
    }

    // Place along the ring from the smallest vertex on. O(log n).
    Index rank(Index v) const { return modulo(place(v) - start_); }
    Index vertex(Index rank) const {
        Index place = modulo(rank + start_), n = root_;
        while (!is_leaf(n)) {
            Index half = node(node(n).left).count;
            n = place < half ? node(n).left : node(n).right;
            if (place >= half) place -= half;
        }
        return leaf(n).vertex[place];
    }
    // Whether b comes before c, or is c, on the way along the ring from a. O(log n).
    bool between(Index a, Index b, Index c) const {
        Index from = place(a);
        return modulo(place(b) - from) <= modulo(place(c) - from);
    }

    // Pieces f(n, begin, end) of `count` vertices from a rank on; beyond the last comes the first.
    template <class F>
    void visit_range(Index rank, Index count, F&& f) const {
        Index begin = modulo(rank + start_), end = begin + count;
        visit_run(root_, begin, std::min(end, size()), f);
        visit_run(root_, 0, end - size(), f);
    }
    // The same of the run of n, from its vertex `begin` to the one before `end`.
    template <class F>
    void visit_run(Index n, Index begin, Index end, F&& f) const {
        if (begin >= end) return;
        if (is_leaf(n) || (begin == 0 && end == node(n).count)) {
            f(n, begin, end);
            return;
        }
        Index left = node(n).left, half = node(left).count;
        if (begin < half) visit_run(left, begin, std::min(end, half), f);
        if (end > half) visit_run(node(n).right, std::max(begin - half, 0), end - half, f);
    }

    // The leaf after or before one, the ring being closed. O(log n), O(1) on average.
    Index leaf_after(Index n) const {
        Index p = node(n).parent;
        for (; p != kNone && node(p).right == n; p = node(p).parent) n = p;
        return first_leaf(p == kNone ? root_ : node(p).right);
    }
    Index leaf_before(Index n) const {
        Index p = node(n).parent;
        for (; p != kNone && node(p).left == n; p = node(p).parent) n = p;
        return last_leaf(p == kNone ? root_ : node(p).left);
    }
    // Of the tree with this root.
    Index first_leaf(Index n) const {
        while (!is_leaf(n)) n = node(n).left;
        return n;
    }
    Index last_leaf(Index n) const {
        while (!is_leaf(n)) n = node(n).right;
        return n;
    }

    // ---------------------------------------------------------------- changes
    // Makers of changes see to it that each vertex is in one leaf, and call done at the end.

    void clear() {
        nodes_.clear();
        heights_.clear();
        leaves_.clear();
        leaf_of_.clear();
        free_node_ = free_leaf_ = root_ = kNone;
    }

    // Vertices are below `slots`.
    void make_slots(std::size_t slots) { leaf_of_.resize(std::max(slots, leaf_of_.size()), kNone); }

    // Of all nodes there ever were.
    std::size_t nodes() const { return nodes_.size(); }

    // A balanced tree of n vertices, n > 0, that `closing` follows.
    template <class Source>
    Index plant(const Source& source, const Index* vertices, std::size_t n, Index closing) {
        std::size_t leaves = (n + at(kFill) - 1) / at(kFill);
        if (leaves > leaves_.size()) {
            leaves_.reserve(leaves);
            nodes_.reserve(2 * leaves);
            heights_.reserve(2 * leaves);
        }
        Index top = new_node();
        grow(source, top, {vertices, n, leaves, closing}, 0, leaves);
        nodes_[at(top)].parent = kNone;
        return top;
    }

    // Gives back a tree; its vertices are in no leaf any more, or in another one already.
    void uproot(Index n) {
        if (is_leaf(n)) {
            Index l = node(n).left;
            leaves_[at(l)].vertex[0] = free_leaf_;
            free_leaf_ = l;
        } else {
            uproot(node(n).left);
            uproot(node(n).right);
        }
        release(n);
    }

    // Its vertices are in no leaf any more.
    void forget_vertices(Index n) {
        for (Index i = 0; i < node(n).count; ++i) leaf_of_[at(leaf(n).vertex[i])] = kNone;
    }

    // Puts n vertices into a leaf, n > 0; refresh its ancestors later.
    template <class Source>
    void fill(const Source& source, Index leaf, const Index* vertices, Index n, Index closing) {
        Node& node = nodes_[at(leaf)];
        Leaf& l = leaves_[at(node.left)];
        node.count = n;
        for (Index i = 0; i <= n; ++i) {
            Index v = i < n ? vertices[i] : closing;
            if (i < n) leaf_of_[at(v)] = leaf;
            Point p = source.site(v);
            l.x[i] = p.x;
            l.y[i] = p.y;
            l.vertex[i] = v;
            if (i == 0) node.box = {p.x, p.y, p.x, p.y};
            node.box.extend(p.x, p.y);
        }
        node.first_y = l.y[0];
        node.last_y = l.y[n];
    }

    void refresh_above(Index n) {
        for (n = node(n).parent; n != kNone; n = node(n).parent) pull(n);
    }

    // Parts the tree of leaf n before it, so that there are two (or one, if n is its first leaf).
    //
    //            p              Going up from n, every ancestor falls apart: a left
    //          /   \            sibling joins what comes before n, a right one what
    //        ...   [c]          comes after it.
    //       /   \               before: [a]
    //     [a]    n              after:  n [c]
    //
    void cut_before(Index n) {
        Index before = kNone, after = n, came = n, p = node(n).parent;
        set_parent(n, kNone);
        while (p != kNone) {
            auto [left, right, up] =
                std::array<Index, 3>{node(p).left, node(p).right, node(p).parent};
            release(p);
            if (left == came) {
                after = join(after, right);
            } else {
                before = join(left, before);
            }
            came = p;
            p = up;
        }
    }

    // Puts tree r behind tree l and returns the root; either may be kNone.
    //
    //          l                  l              the higher one opens along its
    //        /   \              /   \            inner side down to where the other
    //      [a]   [b]  +  r    [a]   join([b], r) is no more than 1 lower
    //
    Index join(Index l, Index r) {
        Index top = l == kNone ? r : r == kNone ? l : join_trees(l, r);
        if (top != kNone) set_parent(top, kNone);
        return top;
    }

    // Makes leaf n the first of the tree.
    void turn_to(Index n) {
        Index first = first_leaf(root_);
        if (n == first) return;
        cut_before(n);
        root_ = join(root_of(n), root_of(first));
    }

    Index root_of(Index n) const {
        while (node(n).parent != kNone) n = node(n).parent;
        return n;
    }

    // The ring is the tree with this root, and ranks count from `smallest`.
    void done(Index root, Index smallest) {
        root_ = root;
        start_ = place(smallest);
    }

    std::size_t bytes() const {
        return nodes_.capacity() * sizeof(Node) + heights_.capacity() +
               leaves_.capacity() * sizeof(Leaf) + leaf_of_.capacity() * sizeof(Index);
    }

    // The first broken invariant, or nothing. O(n).
    template <class Source>
    std::string check(const Source& source) const {
        if (size() != source.ring_size()) {
            return "the sequence has " + std::to_string(size()) + " vertices, the ring " +
                   std::to_string(source.ring_size());
        }
        Index in_leaves = 0, v = empty() ? kNone : vertex(0);
        for (Index leaf : leaf_of_) in_leaves += leaf != kNone;
        if (in_leaves != size()) return "vertices off the ring are in leaves";
        if (empty()) return {};
        if (v != source.smallest()) return "the sequence does not start at the smallest vertex";
        if (node(root_).parent != kNone) return "the root has a parent";
        for (Index rank = 0; rank < size(); ++rank, v = source.following(v)) {
            if (vertex(rank) != v || this->rank(v) != rank || next(v) != source.following(v)) {
                return "vertex " + std::to_string(v) + " is not found at rank " +
                       std::to_string(rank);
            }
        }
        return check_tree(source, root_);
    }

   private:
    struct Planting {
        const Index* vertices;
        std::size_t count, leaves;
        Index closing;
        std::size_t start(std::size_t leaf) const { return leaf * count / leaves; }
    };

    Index modulo(Index place) const {
        return place < 0 ? place + size() : place >= size() ? place - size() : place;
    }

    // Place along the tree.
    Index place(Index v) const {
        Index n = leaf_of(v), sum = place_in(n, v);
        for (Index p = node(n).parent; p != kNone; n = p, p = node(p).parent) {
            if (node(p).right == n) sum += node(node(p).left).count;
        }
        return sum;
    }

    int height(Index n) const { return heights_[at(n)]; }
    void set_parent(Index n, Index p) { nodes_[at(n)].parent = p; }

    Index new_node() {
        Index n = free_node_;
        if (n != kNone) {
            free_node_ = node(n).left;
            return n;
        }
        heights_.reserve(heights_.size() + 1);
        nodes_.reserve(nodes_.size() + 1);
        heights_.push_back(0);
        nodes_.push_back({});
        return static_cast<Index>(nodes_.size()) - 1;
    }

    void release(Index n) {
        nodes_[at(n)].left = free_node_;
        free_node_ = n;
    }

    // Siblings are made side by side: both are looked at together.
    template <class Source>
    void grow(const Source& source, Index n, const Planting& p, std::size_t low, std::size_t high) {
        if (high - low == 1) {
            Index l = free_leaf_;
            if (l == kNone) {
                l = static_cast<Index>(leaves_.size());
                leaves_.push_back({});
            } else {
                free_leaf_ = leaves_[at(l)].vertex[0];
            }
            nodes_[at(n)].left = l;
            nodes_[at(n)].right = kNone;
            heights_[at(n)] = 0;
            std::size_t start = p.start(low), end = p.start(high);
            Index closing = end == p.count ? p.closing : p.vertices[end];
            fill(source, n, p.vertices + start, static_cast<Index>(end - start), closing);
            return;
        }
        Index left = new_node(), right = new_node();
        std::size_t half = low + (high - low) / 2;
        grow(source, left, p, low, half);
        grow(source, right, p, half, high);
        adopt(n, left, right);
    }

    void adopt(Index n, Index left, Index right) {
        nodes_[at(n)].left = left;
        nodes_[at(n)].right = right;
        set_parent(left, n);
        set_parent(right, n);
        pull(n);
    }

    // An inner node as its children make it.
    Node merged(Index n) const {
        Node x = node(n);
        const Node &l = node(x.left), &r = node(x.right);
        x.box = l.box;
        x.box.extend(r.box);
        x.first_y = l.first_y;
        x.last_y = r.last_y;
        x.count = l.count + r.count;
        return x;
    }
    int height_over(Index n) const {
        return 1 + std::max(height(node(n).left), height(node(n).right));
    }
    void pull(Index n) {
        nodes_[at(n)] = merged(n);
        heights_[at(n)] = static_cast<std::uint8_t>(height_over(n));
    }

    Index join_trees(Index l, Index r) {
        if (height(l) > height(r) + 1) {
            adopt(l, node(l).left, join_trees(node(l).right, r));
            return balanced(l);
        }
        if (height(r) > height(l) + 1) {
            adopt(r, join_trees(l, node(r).left), node(r).right);
            return balanced(r);
        }
        Index n = new_node();
        adopt(n, l, r);
        return n;
    }

    // n, whose children differ by 2 in height at most, or what takes its place.
    Index balanced(Index n) {
        Index l = node(n).left, r = node(n).right;
        if (height(l) > height(r) + 1) {
            if (height(node(l).left) < height(node(l).right)) l = rotated_left(l);
            adopt(n, l, r);
            return rotated_right(n);
        }
        if (height(r) > height(l) + 1) {
            if (height(node(r).right) < height(node(r).left)) r = rotated_right(r);
            adopt(n, l, r);
            return rotated_left(n);
        }
        return n;
    }

    //        n                  l
    //      /   \              /   \            (rotated_left is the mirror image)
    //     l    [c]    ==>   [a]    n
    //   /   \                    /   \.
    //  [a]  [b]                [b]   [c]
    //
    Index rotated_right(Index n) {
        Index l = node(n).left;
        adopt(n, node(l).right, node(n).right);
        adopt(l, node(l).left, n);
        return l;
    }
    Index rotated_left(Index n) {
        Index r = node(n).right;
        adopt(n, node(n).left, node(r).left);
        adopt(r, n, node(r).right);
        return r;
    }

    template <class Source>
    std::string check_tree(const Source& source, Index n) const {
        const Node& x = node(n);
        std::string name = "node " + std::to_string(n) + ": ";
        if (is_leaf(n)) {
            if (x.count < 1 || x.count > kMost) return name + "too few or too many vertices";
            Box box = {leaf(n).x[0], leaf(n).y[0], leaf(n).x[0], leaf(n).y[0]};
            for (Index i = 0; i <= x.count; ++i) {
                Point p = source.site(leaf(n).vertex[i]);
                if (!(p == Point{leaf(n).x[i], leaf(n).y[i]})) return name + "wrong coordinates";
                box.extend(p.x, p.y);
            }
            bool ends = x.first_y == leaf(n).y[0] && x.last_y == leaf(n).y[x.count];
            return ends && x.box == box && height(n) == 0 ? "" : name + "wrong ends or box";
        }
        for (Index child : {x.left, x.right}) {
            if (node(child).parent != n) return name + "a child has another parent";
            std::string broken = check_tree(source, child);
            if (!broken.empty()) return broken;
        }
        if (std::abs(height(x.left) - height(x.right)) > 1) return name + "out of balance";
        Node y = merged(n);
        bool same = x.box == y.box && x.first_y == y.first_y && x.last_y == y.last_y &&
                    x.count == y.count && height(n) == height_over(n);
        return same ? "" : name + "does not follow from its children";
    }

    Array<Node> nodes_;
    Array<std::uint8_t> heights_;  // by node: 0 of a leaf
    Array<Leaf> leaves_;
    Array<Index> leaf_of_;  // by vertex: the leaf (a node) with it, or kNone
    // What may be used again: nodes strung along `left`, leaves along their first vertices.
    Index free_node_ = kNone, free_leaf_ = kNone;
    Index root_ = kNone;
    Index start_ = 0;  // place of the smallest vertex
};

}  // namespace flintknap
