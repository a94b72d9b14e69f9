// Events in order of time: which of two comes first, which is the next with a key as large, which
// is the first that waits.
//
// Theory. A B+-tree whose leaves hold events. A node knows the largest event in it, an inner one
// the keys of the largest in each child, too; and in which of its items events wait. Two events are
// compared by going up from both to where they meet; the next with a large key is found by going up
// to where there is one, and down; the first that waits by going down from the root.
//
//               [ 9 | 7 ]               inner nodes: the largest key in each child
//               /       \.
//        [ 5 | 9 ]     [ 4 | 7 ]
//         /     \       /     \.
//       2 5 1  9 3     4 2   7 6 6      leaves: the keys of events, in order of time
//
// A long run of events is moved whole: the tree is cut before the run, behind it and where it goes,
// and the pieces are glued together. Pieces stay as high as the tree was; glueing goes down the
// seam and joins nodes that have become small.
//
// `Keys` tells key(e) and smaller(a, b): whether the key of a is the smaller one, ties broken.
// Neither may change for events that are here.
//
// Invariants (check): all leaves are on one level; no node is empty; parents, largest and who waits
// are right.
// Exceptions: std::bad_alloc, and then nothing but clear and assign may follow.
// Cost: assign O(n); all else O(log n). 10 bytes an event.
#pragma once

#include <algorithm>
#include <cstdint>
#include <new>
#include <string>
#include <utility>

#include "array.hpp"
#include "mesh.hpp"

namespace flintknap {

template <class Keys>
class Timeline {
   public:
    explicit Timeline(const Keys& keys) : keys_(keys) {}

    bool empty() const { return root_ == kNone; }

    void clear() {
        nodes_.clear();
        seats_.clear();
        root_ = free_ = kNone;
    }

    // Of n events, n > 0: event(i) is the i-th.
    template <class F>
    void assign(std::size_t n, F&& event) {
        clear();
        seats_.resize(n);
        std::size_t leaves = plant_level(n, 0, event);
        for (std::size_t from = 0, wide = leaves; wide > 1;) {
            Index height = node(static_cast<Index>(from)).height + 1;
            std::size_t children = wide;
            wide = plant_level(children, height,
                               [&](std::size_t i) { return static_cast<Index>(from + i); });
            from += children;
        }
        root_ = static_cast<Index>(nodes_.size()) - 1;
    }

    // Whether a comes before b.
    bool before(Index a, Index b) const {
        Index p = leaf_of(a), q = leaf_of(b);
        if (p == q) return place_in(p, a) < place_in(p, b);
        while (node(p).parent != node(q).parent) {
            p = node(p).parent;
            q = node(q).parent;
        }
        return node(p).place < node(q).place;
    }

    void prefetch(Index e) const { __builtin_prefetch(&seats_[at(e)]); }

    // The neighbours of an event, or kNone.
    Index next(Index e) const {
        Index n = leaf_of(e), i = place_in(n, e) + 1;
        while (i == node(n).count) {
            i = node(n).place + 1;
            n = node(n).parent;
            if (n == kNone) return kNone;
        }
        while (node(n).height > 0) n = node(n).inner.children[std::exchange(i, 0)];
        return node(n).events[i];
    }
    Index previous(Index e) const {
        Index n = leaf_of(e), i = place_in(n, e);
        while (i == 0) {
            i = node(n).place;
            n = node(n).parent;
            if (n == kNone) return kNone;
        }
        return node(n).height > 0 ? last_in(node(n).inner.children[i - 1]) : node(n).events[i - 1];
    }
    Index last() const { return last_in(root_); }

    // The first event after e that `reaches`, or kNone. Those do whose keys are larger than `key`,
    // and of those whose key it is, the larger ones by smaller() may.
    template <class F>
    Index first_after(Index e, double key, F&& reaches) const {
        Index n = leaf_of(e);
        if (reaches(node(n).largest)) {
            for (Index i = place_in(n, e) + 1; i < node(n).count; ++i) {
                if (reaches(node(n).events[i])) return node(n).events[i];
            }
        }
        for (Index p = node(n).parent; p != kNone; n = p, p = node(p).parent) {
            Index i = first_child(p, node(n).place + 1, key, reaches);
            if (i == node(p).count) continue;
            n = node(p).inner.children[i];
            while (node(n).height > 0) n = node(n).inner.children[first_child(n, 0, key, reaches)];
            return *std::find_if(node(n).events, node(n).events + node(n).count, reaches);
        }
        return kNone;
    }

    // Whether an event waits; the first that does, or kNone. None does at first.
    bool waits(Index e) const {
        return (node(leaf_of(e)).waiting >> place_in(leaf_of(e), e) & 1) != 0;
    }
    Index first_waiting() const {
        Index n = root_;
        if (node(n).waiting == 0) return kNone;
        while (node(n).height > 0) n = node(n).inner.children[first_bit(node(n).waiting)];
        return node(n).events[first_bit(node(n).waiting)];
    }
    void set_waiting(Index e, bool waits) {
        Index n = leaf_of(e);
        set_waiting(n, place_in(n, e), waits);
    }

    // Puts a new event before another one, or behind the last (kNone).
    void insert(Index e, Index other, bool waits) {
        seats_.resize(std::max(seats_.size(), at(e) + 1));
        Index neighbour = other == kNone ? last() : other;
        if (node(leaf_of(neighbour)).count == kRoom) halve(leaf_of(neighbour));
        Index n = leaf_of(neighbour), i = place_in(n, neighbour) + (other == kNone ? 1 : 0);
        put(n, i, e, false);
        if (waits) set_waiting(n, i, true);
        for (; n != kNone && keys_.smaller(node(n).largest, e); n = node(n).parent) {
            nodes_[at(n)].largest = e;
            tell_parent(n);
        }
    }

    // Of a tree that holds others, too.
    void erase(Index e) {
        Index n = leaf_of(e), place = place_in(n, e);
        if (bit(n, place)) set_waiting(n, place, false);
        take(n, place);
        seats_[at(e)] = {};
        while (node(n).count == 0) {
            Index p = node(n).parent;
            take(p, node(n).place);
            release(std::exchange(n, p));
        }
        for (Index p = n; p != kNone && node(p).largest == e; p = node(p).parent) {
            pull(p);
            tell_parent(p);
        }
        for (; n != kNone; n = node(n).parent) join_with_next(n);
    }

    // Moves the run of events from `first` to `last` before another one that is not in it, or
    // behind all (kNone). Not the whole tree.
    void move(Index first, Index last, Index other) {
        Index few[kFew];
        std::size_t n = 0;
        for (Index e = first; n < kFew; e = next(e)) {
            few[n++] = e;
            if (e == last) break;
        }
        if (few[n - 1] == last) {
            for (std::size_t i = 0; i < n; ++i) {
                bool waited = waits(few[i]);
                erase(few[i]);
                insert(few[i], other, waited);
            }
            return;
        }
        Index behind = next(last);
        auto [head, run] = cut_before(first);
        if (behind != kNone) {
            auto [middle, tail] = cut_before(behind);
            run = middle;
            head = glue(head, tail);
        }
        if (other == kNone) {
            head = glue(head, run);
        } else {
            auto [left, right] = cut_before(other);
            head = glue(glue(left, run), right);
        }
        root_ = head;
        while (node(root_).count == 1 && node(root_).height > 0) {
            Index top = std::exchange(root_, node(root_).inner.children[0]);
            release(top);
        }
        nodes_[at(root_)].parent = kNone;
    }

    template <class Archive>
    void transfer(Archive& archive) {
        archive(nodes_);
        archive(seats_);
        archive(root_);
        archive(free_);
    }

    std::size_t bytes() const {
        return nodes_.capacity() * sizeof(Node) + seats_.capacity() * sizeof(Seat);
    }

    // The first broken invariant, or nothing. O(n).
    std::string check() const {
        if (empty()) return "";
        if (node(root_).parent != kNone) return "the root of the timeline has a parent";
        return check_node(root_);
    }

   private:
    static constexpr Index kRoom = 58, kFill = 45;        // events of a leaf; of one that is new
    static constexpr Index kBranches = 19, kBranch = 15;  // children of an inner node
    static constexpr Index kFew = 12;                     // events that are moved one by one

    struct alignas(64) Node {
        Index parent, largest;             // of one not in use, parent is the next such
        std::uint64_t waiting;             // bits: items that wait, or hold events that do
        std::int8_t count, height, place;  // place: among the children of the parent
        struct Inner {
            double keys[kBranches];  // of the largest of each child
            Index children[kBranches];
        };
        union {
            Index events[kRoom];
            Inner inner;
        };
    };

    // The leaf with an event; and its place there as it was last seen, near which it is still.
    static constexpr unsigned kNowhere = (1U << 26) - 1;
    struct Seat {
        unsigned leaf : 26, place : 6;
        Seat(unsigned l = kNowhere, unsigned p = 0) : leaf(l & kNowhere), place(p & 63U) {}
    };

    static Index first_bit(std::uint64_t bits) { return __builtin_ctzll(bits); }
    static std::uint64_t bits_below(Index i) { return (std::uint64_t{1} << i) - 1; }

    const Node& node(Index n) const { return nodes_[at(n)]; }
    Index leaf_of(Index e) const { return static_cast<Index>(seats_[at(e)].leaf); }

    // What a node holds: events, or children.
    const Index* items(Index n) const {
        return node(n).height > 0 ? node(n).inner.children : node(n).events;
    }
    Index* items(Index n) {
        Node& x = nodes_[at(n)];
        return x.height > 0 ? x.inner.children : x.events;
    }
    Index room(Index n) const { return node(n).height > 0 ? kBranches : kRoom; }
    Index fill(Index n) const { return node(n).height > 0 ? kBranch : kFill; }
    Index place_in(Index leaf, Index e) const {
        const Node& x = node(leaf);
        Index guess = static_cast<Index>(seats_[at(e)].place), below = guess, above = guess;
        if (guess < x.count && x.events[guess] == e) return guess;
        while (true) {
            if (--below >= 0 && below < x.count && x.events[below] == e) break;
            if (++above < x.count && x.events[above] == e) {
                below = above;
                break;
            }
        }
        seats_[at(e)].place = static_cast<unsigned>(below) & 63U;
        return below;
    }
    Index last_in(Index n) const {
        while (node(n).height > 0) n = node(n).inner.children[node(n).count - 1];
        return node(n).events[node(n).count - 1];
    }

    // The first child from the i-th on with an event that reaches.
    template <class F>
    Index first_child(Index n, Index i, double key, F&& reaches) const {
        const Node& x = node(n);
        for (; i < x.count && !(x.inner.keys[i] > key); ++i) {
            if (x.inner.keys[i] == key && reaches(node(x.inner.children[i]).largest)) break;
        }
        return i;
    }

    Index new_node(Index height) {
        Index n = free_;
        if (n != kNone) {
            free_ = node(n).parent;
        } else {
            n = static_cast<Index>(nodes_.size());
            if (at(n) == kNowhere) throw std::bad_alloc();
            nodes_.push_back({});
        }
        Node& x = nodes_[at(n)];
        x.parent = x.largest = kNone;
        x.waiting = 0;
        x.count = 0;
        x.height = static_cast<std::int8_t>(height);
        x.place = 0;
        return n;
    }
    void release(Index n) { nodes_[at(n)].parent = std::exchange(free_, n); }

    // Nodes for so many items, which come evenly; returns how many. They are the last ones.
    template <class F>
    std::size_t plant_level(std::size_t n, Index height, F&& item) {
        std::size_t each = at(height > 0 ? kBranch : kFill), wide = (n + each - 1) / each;
        nodes_.reserve(nodes_.size() + wide);
        for (std::size_t i = 0; i < wide; ++i) {
            Index made = new_node(height);
            Node& x = nodes_[at(made)];
            for (std::size_t k = i * n / wide; k < (i + 1) * n / wide; ++k, ++x.count) {
                Index held = item(k);
                items(made)[x.count] = held;
                if (height > 0) x.inner.keys[x.count] = key_of(held);
                settle(made, x.count);
            }
            number(made, 0);
            pull(made);
        }
        return wide;
    }

    double key_of(Index child) const { return keys_.key(node(child).largest); }

    // Tells the i-th item of a node where it is.
    void settle(Index n, Index i) {
        Index item = items(n)[i];
        if (node(n).height > 0) {
            nodes_[at(item)].parent = n;
        } else {
            seats_[at(item)] = {static_cast<unsigned>(n), static_cast<unsigned>(i)};
        }
    }
    void put(Index n, Index i, Index item, bool waits) {
        Node& x = nodes_[at(n)];
        std::uint64_t low = x.waiting & bits_below(i);
        x.waiting = low | ((x.waiting ^ low) << 1);
        Index* list = items(n);
        std::copy_backward(list + i, list + x.count, list + x.count + 1);
        list[i] = item;
        if (x.height > 0) {
            std::copy_backward(x.inner.keys + i, x.inner.keys + x.count,
                               x.inner.keys + x.count + 1);
            x.inner.keys[i] = key_of(item);
        }
        ++x.count;
        set_bit(n, i, waits);
        settle(n, i);
        number(n, i);
    }
    // Tells children from the i-th on where they are.
    void number(Index n, Index i) {
        for (; node(n).height > 0 && i < node(n).count; ++i) {
            nodes_[at(node(n).inner.children[i])].place = static_cast<std::int8_t>(i);
        }
    }
    // A child goes into an inner node.
    void adopt(Index n, Index i, Index child) { put(n, i, child, node(child).waiting != 0); }
    void set_bit(Index n, Index i, bool on) {
        std::uint64_t bit = std::uint64_t{1} << i, others = node(n).waiting & ~bit;
        nodes_[at(n)].waiting = on ? others | bit : others;
    }
    void set_waiting(Index n, Index i, bool waits) {
        while (true) {
            bool before = node(n).waiting != 0;
            set_bit(n, i, waits);
            if (before == (node(n).waiting != 0) || node(n).parent == kNone) return;
            i = node(n).place;
            n = node(n).parent;
        }
    }
    bool bit(Index n, Index i) const { return (node(n).waiting >> i & 1) != 0; }
    void take(Index n, Index i) {
        Node& x = nodes_[at(n)];
        Index* list = items(n);
        std::copy(list + i + 1, list + x.count, list + i);
        if (x.height > 0) std::copy(x.inner.keys + i + 1, x.inner.keys + x.count, x.inner.keys + i);
        std::uint64_t low = x.waiting & bits_below(i);
        x.waiting = low | ((x.waiting >> 1) & ~bits_below(i));
        --x.count;
        number(n, i);
    }

    // Makes the largest of a node what its items say; tells the parent of a node what is in it.
    void pull(Index n) {
        Node& x = nodes_[at(n)];
        const Index* list = items(n);
        bool is_leaf = x.height == 0;
        x.largest = is_leaf ? list[0] : node(list[0]).largest;
        for (Index i = 1; i < x.count; ++i) {
            Index other = is_leaf ? list[i] : node(list[i]).largest;
            if (keys_.smaller(x.largest, other)) x.largest = other;
        }
    }
    void tell_parent(Index n) {
        Index p = node(n).parent;
        if (p == kNone) return;
        Index i = node(n).place;
        nodes_[at(p)].inner.keys[i] = key_of(n);
        set_bit(p, i, node(n).waiting != 0);
    }

    // Moves the items of n from the i-th on to a new node.
    Index split(Index n, Index i) {
        Index made = new_node(node(n).height);
        copy_items(n, i, made);
        nodes_[at(n)].count = static_cast<std::int8_t>(i);
        nodes_[at(n)].waiting &= bits_below(i);
        return made;
    }

    // Puts what node a holds from the i-th item on behind what b holds, too.
    void copy_items(Index a, Index i, Index b) {
        const Node& x = node(a);
        Node& y = nodes_[at(b)];
        Index first = y.count;
        std::copy(items(a) + i, items(a) + x.count, items(b) + first);
        if (x.height > 0) {
            std::copy(x.inner.keys + i, x.inner.keys + x.count, y.inner.keys + first);
        }
        y.waiting |= x.waiting >> i << first;
        y.count = static_cast<std::int8_t>(first + x.count - i);
        for (Index k = first; k < y.count; ++k) settle(b, k);
        number(b, first);
    }

    // Parts a full node in two, side by side.
    void halve(Index n) {
        Index p = node(n).parent;
        if (p == kNone) {
            p = root_ = new_node(node(n).height + 1);
            adopt(p, 0, n);
        } else if (node(p).count == kBranches) {
            halve(p);
            p = node(n).parent;
        }
        Index made = split(n, node(n).count / 2);
        pull(n);
        pull(made);
        tell_parent(n);
        adopt(p, node(n).place + 1, made);
        pull(p);
    }

    // Joins a node that has become small with the next one, if both are children of one node and
    // have room in one.
    void join_with_next(Index n) {
        Index p = node(n).parent;
        if (p == kNone || node(n).count > fill(n) / 3) return;
        Index i = node(n).place + 1;
        if (i == node(p).count) return;
        Index other = items(p)[i];
        if (node(n).count + node(other).count > fill(n)) return;
        absorb(n, other);
        take(p, i);
        tell_parent(n);
    }

    // All items of b go behind those of a; b is no more.
    void absorb(Index a, Index b) {
        copy_items(b, 0, a);
        release(b);
        pull(a);
    }

    // Parts a tree before an event in it. Returns what comes before it, or kNone, and what comes
    // from it on: two trees of the same height.
    //
    //            [ p     q ]                [ p ]      [ q ]       going up from the leaf of e,
    //            /     /   \                /    \      /  \       every node falls apart
    //         [..]  [. e .] [..]    ==>   [..]  [.]  [e .] [..]
    //
    std::pair<Index, Index> cut_before(Index e) {
        Index left = leaf_of(e), right = split(left, place_in(left, e));
        for (Index p = node(left).parent;; p = node(left).parent) {
            pull(right);
            bool is_empty = node(left).count == 0;
            if (!is_empty) pull(left);
            if (p == kNone) {
                if (is_empty) release(std::exchange(left, kNone));
                return {left, right};
            }
            Index i = node(left).place, above = split(p, i + 1);
            adopt(above, 0, right);
            if (is_empty) {
                take(p, i);
                release(left);
            } else {
                tell_parent(left);
            }
            left = p;
            right = above;
        }
    }

    // Puts tree b behind tree a and returns the root; either may be kNone, not both.
    Index glue(Index a, Index b) {
        if (a == kNone) return b;
        if (b == kNone) return a;
        while (node(a).height < node(b).height) a = over(a);
        while (node(b).height < node(a).height) b = over(b);
        if (join_along_seam(a, b)) return a;
        Index top = over(a);
        adopt(top, 1, b);
        pull(top);
        return top;
    }
    Index over(Index n) {
        Index top = new_node(node(n).height + 1);
        adopt(top, 0, n);
        pull(top);
        return top;
    }

    // Joins what is small where a tree and the one behind it, of the same height, meet. Returns
    // whether all of b is in a now.
    bool join_along_seam(Index a, Index b) {
        if (node(a).height > 0) {
            Index last = items(a)[node(a).count - 1], first = items(b)[0];
            if (join_along_seam(last, first)) {
                take(b, 0);
            } else {
                tell_parent(first);
            }
            tell_parent(last);
        }
        if (node(b).count == 0 || node(a).count + node(b).count <= fill(a)) {
            absorb(a, b);
            return true;
        }
        if (node(a).height > 0) {
            pull(a);
            pull(b);
        }
        return false;
    }

    std::string check_node(Index n) const {
        const Node& x = node(n);
        std::string name = "node " + std::to_string(n) + " of the timeline: ";
        if (x.count < 1 || x.count > room(n)) return name + "too few or too many items";
        if ((x.waiting & ~bits_below(x.count)) != 0) return name + "nobody there, but waiting";
        bool is_held = false;
        for (Index i = 0; i < x.count; ++i) {
            Index item = items(n)[i], largest = item;
            if (x.height == 0) {
                if (leaf_of(item) != n) return name + "an event does not know where it is";
            } else {
                if (node(item).parent != n) return name + "a child has another parent";
                if (node(item).height != x.height - 1) return name + "a child of a wrong height";
                if (node(item).place != i) return name + "a child in another place";
                if (x.inner.keys[i] != key_of(item)) return name + "a wrong key";
                if (bit(n, i) != (node(item).waiting != 0)) return name + "wrong about who waits";
                std::string broken = check_node(item);
                if (!broken.empty()) return broken;
                largest = node(item).largest;
            }
            if (keys_.smaller(x.largest, largest)) return name + "there is a larger event";
            is_held |= x.largest == largest;
        }
        return is_held ? "" : name + "the largest event is not in it";
    }

    const Keys& keys_;
    Array<Node> nodes_;
    mutable Array<Seat> seats_;  // by event
    Index root_ = kNone, free_ = kNone;
};

}  // namespace flintknap
