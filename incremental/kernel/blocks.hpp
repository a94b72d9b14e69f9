// The B+-tree that keeps the order of events: nodes, and how they part and join.
//
// Theory. Leaves hold events, one after the other; inner nodes hold nodes. A node knows the largest
// event in it, and the keys of its items, coarsely: in 32 bits that do not fall where keys rise, so
// that a look through a node reads nothing else, unless they tie. Sixteen are compared at a time:
// where a search ends nobody can foresee, and every branch that goes otherwise costs more than all
// comparisons. A node knows in which of its items events wait, too. An event knows its leaf.
//
//               [ 9 | 7 ]               inner nodes: the largest key in each child
//               /       \.
//    twig [ 5 | 9 ]     [ 4 | 7 ] twig
//         /     \       /     \.
//       2 5 1  9 3     4 2   7 6 6      leaves: the keys of events, in order of time
//
// The nodes right above leaves, *twigs*, have labels that rise (labels.hpp), so what comes first is
// told without a way to the root. Leaves have none, for a long run that is moved has many of them;
// but the label above a leaf and its place there are its *order*, and that is noted by leaf: of all
// that is asked this is asked most, and those few numbers stay in the nearest cache.
//
// A tree may be cut before an event, and two be glued together. Pieces stay as high as the tree
// was; glueing goes down the seam and joins nodes that have become small. Twigs that were made on
// the way get their labels at the end.
//
// `Keys` tells key(e) and smaller(a, b): whether the key of a is the smaller one, ties broken.
// Neither may change for events that are here.
//
// Invariants (check): all leaves are on one level; no node is empty; parents, largest, keys,
// labels, orders and who waits are right.
// Exceptions: std::bad_alloc, and then nothing but clear and assign may follow.
// Cost: assign O(n); a cut, a glueing O(log n). 15 bytes an event.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <new>
#include <string>
#include <utility>

#include "array.hpp"
#include "labels.hpp"
#include "lanes.hpp"
#include "mesh.hpp"

namespace flintknap {

// A key in 32 bits, which do not fall where keys rise.
using Coarse = std::int32_t;
inline Coarse coarse_key(double key) {
    constexpr double most = std::numeric_limits<float>::max();
    float rounded = static_cast<float>(smaller(larger(key, -most), most)) + 0.0F;  // no -0
    Coarse bits;
    std::memcpy(&bits, &rounded, sizeof bits);
    return bits ^ (bits >> 31 & INT32_MAX);
}

template <class Keys>
class Blocks {
   public:
    explicit Blocks(const Keys& keys) : keys_(keys) {}

    bool empty() const { return root_ == kNone; }

    void clear() {
        nodes_.clear();
        orders_.clear();
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

    [[gnu::always_inline]] void prefetch(Index e) const { __builtin_prefetch(&seats_[at(e)]); }

    template <class Archive>
    void transfer(Archive& archive) {
        archive(nodes_);
        archive(orders_);
        archive(seats_);
        archive(root_);
        archive(free_);
    }

    std::size_t bytes() const {
        return nodes_.capacity() * (sizeof(Node) + sizeof(std::uint64_t)) +
               seats_.capacity() * sizeof(Seat);
    }

    // The first broken invariant, or nothing. O(n).
    std::string check() const {
        if (empty()) return "";
        if (node(root_).parent != kNone) return "the root of the timeline has a parent";
        if (node(root_).height == 0) return check_node(root_);
        Label reached = 0;
        for (Index n = first_in(root_, 1); n != kNone; n = node_behind(n)) {
            if (node(n).label <= reached) return "labels of the timeline do not rise";
            reached = node(n).label;
        }
        return check_node(root_);
    }

   protected:
    static constexpr Index kRoom = 61, kFill = 47;        // events of a leaf; of one that is new
    static constexpr Index kBranches = 24, kBranch = 18;  // children of an inner node

    struct alignas(64) Node {
        Index parent, largest;             // of one not in use, parent is the next such
        std::uint64_t waiting;             // bits: items that wait, or hold events that do
        std::int8_t count, height, place;  // place: among the children of the parent
        Label label;                       // of twigs: rising, or 0 in the midst of a change
        Index items[kRoom];                // events, or children
        Coarse keys[kRoom];                // of these, or of the largest in each child
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

    Index room(Index n) const { return node(n).height > 0 ? kBranches : kRoom; }
    Index fill(Index n) const { return node(n).height > 0 ? kBranch : kFill; }
    Index place_in(Index leaf, Index e) const {
        Index guess = static_cast<Index>(seats_[at(e)].place);
        return guess < node(leaf).count && node(leaf).items[guess] == e ? guess : search(leaf, e);
    }
    __attribute__((noinline)) Index search(Index leaf, Index e) const {
        const Node& x = node(leaf);
        Index guess = static_cast<Index>(seats_[at(e)].place);
        Index first = larger(0, smaller(guess - 8, kRoom - 16));
        std::uint64_t here = std::uint64_t{Sixteen(x.items + first).equal(e)} << first;
        here &= bits_below(x.count);
        if (here == 0) {
            here = as_bits(x.items, [&](Sixteen s) { return s.equal(e); }) & bits_below(x.count);
        }
        Index i = first_bit(here);
        seats_[at(e)].place = static_cast<unsigned>(i) & 63U;
        return i;
    }
    // What `compare` tells of sixteen items, of all items or keys of a node.
    template <class F>
    static std::uint64_t as_bits(const Index* items, F&& compare) {
        std::uint64_t found = 0;
        for (Index i : {0, 16, 32, kRoom - 16}) {
            found |= std::uint64_t{compare(Sixteen(items + i))} << i;
        }
        return found;
    }
    // Fetches what place_in will read.
    [[gnu::always_inline]] void prefetch_place(Index e) const {
        const Node& x = node(leaf_of(e));
        __builtin_prefetch(&x);
        __builtin_prefetch(&x.items[seats_[at(e)].place]);
    }
    // The first and the last node of that height in one.
    Index first_in(Index n, Index height) const {
        while (node(n).height > height) n = node(n).items[0];
        return n;
    }
    Index last_in(Index n, Index height) const {
        while (node(n).height > height) n = node(n).items[node(n).count - 1];
        return n;
    }
    // The node behind another one on its level, or kNone; and the one before it.
    Index node_behind(Index n) const {
        Index height = node(n).height;
        for (Index p = node(n).parent; p != kNone; n = p, p = node(p).parent) {
            Index i = node(n).place + 1;
            if (i < node(p).count) return first_in(node(p).items[i], height);
        }
        return kNone;
    }
    Index node_before(Index n) const {
        Index height = node(n).height;
        for (Index p = node(n).parent; p != kNone; n = p, p = node(p).parent) {
            if (node(n).place > 0) return last_in(node(p).items[node(n).place - 1], height);
        }
        return kNone;
    }

    // The largest event in the i-th item of a node.
    Index largest_in(Index n, Index i) const {
        Index item = node(n).items[i];
        return node(n).height > 0 ? node(item).largest : item;
    }

    Index new_node(Index height) {
        Index n = free_;
        if (n != kNone) {
            free_ = node(n).parent;
        } else {
            n = static_cast<Index>(nodes_.size());
            if (at(n) == kNowhere) throw std::bad_alloc();
            nodes_.push_back({});
            orders_.push_back(0);
        }
        Node& x = nodes_[at(n)];
        x.parent = x.largest = kNone;
        x.waiting = 0;
        x.count = 0;
        x.height = static_cast<std::int8_t>(height);
        x.place = 0;
        x.label = 0;
        return n;
    }
    void release(Index n) {
        nodes_[at(n)].parent = std::exchange(free_, n);
        nodes_[at(n)].count = 0;
    }
    bool is_free(Index n) const { return node(n).count == 0; }

    // Nodes for so many items, which come evenly; returns how many. They are the last ones.
    template <class F>
    std::size_t plant_level(std::size_t n, Index height, F&& item) {
        std::size_t each = at(height > 0 ? kBranch : kFill), wide = (n + each - 1) / each;
        nodes_.reserve(nodes_.size() + wide);
        orders_.reserve(nodes_.size() + wide);
        for (std::size_t i = 0; i < wide; ++i) {
            Index made = new_node(height);
            Node& x = nodes_[at(made)];
            for (std::size_t k = i * n / wide; k < (i + 1) * n / wide; ++k, ++x.count) {
                Index held = item(k);
                x.items[x.count] = held;
                x.keys[x.count] = coarse_key(keys_.key(largest_in(made, x.count)));
                settle(made, x.count);
            }
            if (height == 1) x.label = spread_label(0, kEndOfLabels, i + 1, wide);
            number(made, 0);
            pull(made);
        }
        return wide;
    }

    Coarse key_of(Index child) const { return coarse_key(keys_.key(node(child).largest)); }

    // Tells the i-th item of a node where it is.
    void settle(Index n, Index i) {
        Index item = node(n).items[i];
        if (node(n).height > 0) {
            nodes_[at(item)].parent = n;
        } else {
            seats_[at(item)] = {static_cast<unsigned>(n), static_cast<unsigned>(i)};
        }
    }
    // Makes room for k items from the i-th on, none of which waits; and closes such a gap.
    void open(Index n, Index i, Index k) {
        Node& x = nodes_[at(n)];
        std::copy_backward(x.items + i, x.items + x.count, x.items + x.count + k);
        std::copy_backward(x.keys + i, x.keys + x.count, x.keys + x.count + k);
        std::uint64_t low = x.waiting & bits_below(i);
        x.waiting = low | (x.waiting ^ low) << k;
        x.count = static_cast<std::int8_t>(x.count + k);
    }
    void close(Index n, Index i, Index k) {
        Node& x = nodes_[at(n)];
        std::copy(x.items + i + k, x.items + x.count, x.items + i);
        std::copy(x.keys + i + k, x.keys + x.count, x.keys + i);
        std::uint64_t low = x.waiting & bits_below(i);
        x.waiting = low | (x.waiting >> k & ~bits_below(i));
        x.count = static_cast<std::int8_t>(x.count - k);
        number(n, i);
    }
    // Of a leaf there.
    std::uint64_t order(Index twig, Index place) const {
        return std::uint64_t{node(twig).label} << 8 | static_cast<std::uint64_t>(place);
    }
    // Tells children from the i-th on where they are.
    void number(Index n, Index i) {
        for (; node(n).height > 0 && i < node(n).count; ++i) {
            nodes_[at(node(n).items[i])].place = static_cast<std::int8_t>(i);
            orders_[at(node(n).items[i])] = order(n, i);
        }
    }
    // A child goes into an inner node.
    void adopt(Index n, Index i, Index child) {
        open(n, i, 1);
        nodes_[at(n)].items[i] = child;
        nodes_[at(n)].keys[i] = key_of(child);
        set_bit(n, i, node(child).waiting != 0);
        settle(n, i);
        number(n, i);
    }
    void set_bit(Index n, Index i, bool on) {
        std::uint64_t bit = std::uint64_t{1} << i, others = node(n).waiting & ~bit;
        nodes_[at(n)].waiting = on ? others | bit : others;
    }
    // Tells those above a node whether anything in it waits.
    void tell_who_waits(Index n) {
        for (Index p = node(n).parent; p != kNone; n = p, p = node(p).parent) {
            Index i = node(n).place;
            bool waits = node(n).waiting != 0;
            if (bit(p, i) == waits) return;
            set_bit(p, i, waits);
        }
    }
    bool bit(Index n, Index i) const { return (node(n).waiting >> i & 1) != 0; }

    // For an event that is to come; and of one that goes.
    void admit(Index e) { seats_.resize(std::max(seats_.size(), at(e) + 1)); }
    void unseat(Index e) { seats_[at(e)] = {}; }
    bool has_seat(Index e) const { return seats_[at(e)].leaf != kNowhere; }

    // Makes the largest of a node what its items say; tells the parent of a node what is in it.
    void pull(Index n) {
        Node& x = nodes_[at(n)];
        Coarse most = x.keys[0];
        for (Index i = 1; i < x.count; ++i) most = larger(most, x.keys[i]);
        std::uint64_t all = as_bits(x.keys, [&](Sixteen s) { return s.equal(most); });
        all &= bits_below(x.count);
        x.largest = largest_in(n, first_bit(all));
        while ((all &= all - 1) != 0) {
            Index other = largest_in(n, first_bit(all));
            if (keys_.smaller(x.largest, other)) x.largest = other;
        }
    }
    void tell_parent(Index n) {
        Index p = node(n).parent;
        if (p == kNone) return;
        Index i = node(n).place;
        nodes_[at(p)].keys[i] = key_of(n);
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
        std::copy(x.items + i, x.items + x.count, y.items + first);
        std::copy(x.keys + i, x.keys + x.count, y.keys + first);
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
        Index twig = node(made).height == 0 ? p : made;
        if (node(twig).height == 1) label(twig);
    }

    // Joins a node that has become small with the next one, if both are children of one node and
    // have room in one.
    void join_with_next(Index n) {
        Index p = node(n).parent;
        if (p == kNone || node(n).count > fill(n) / 3) return;
        Index i = node(n).place + 1;
        if (i == node(p).count) return;
        Index other = node(p).items[i];
        if (node(n).count + node(other).count > fill(n)) return;
        absorb(n, other);
        close(p, i, 1);
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
                close(p, i, 1);
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
    // Makes a tree the only one, as low as it goes.
    void set_root(Index n) {
        while (node(n).count == 1 && node(n).height > 0)
            release(std::exchange(n, node(n).items[0]));
        root_ = n;
        nodes_[at(n)].parent = kNone;
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
            Index last = node(a).items[node(a).count - 1], first = node(b).items[0];
            if (join_along_seam(last, first)) {
                close(b, 0, 1);
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

    // Those above leaves as a list of which labels.hpp asks.
    struct Twigs {
        Blocks& blocks;
        Index before(Index n) const { return blocks.node_before(n); }
        Index behind(Index n) const { return blocks.node_behind(n); }
        Label label(Index n) const { return blocks.node(n).label; }
        void set_label(Index n, Label label) {
            blocks.nodes_[at(n)].label = label;
            blocks.number(n, 0);
        }
    };
    void label(Index twig) {
        Twigs twigs{*this};
        give_label(twigs, twig);
    }
    Index twig_of(Index e) const { return node(leaf_of(e)).parent; }

    const Keys& keys_;
    Array<Node> nodes_;
    Array<std::uint64_t> orders_;  // by node: of leaves, rising along them
    Index root_ = kNone;

   private:
    std::string check_node(Index n) const {
        const Node& x = node(n);
        std::string name = "node " + std::to_string(n) + " of the timeline: ";
        if (x.count < 1 || x.count > room(n)) return name + "too few or too many items";
        if ((x.waiting & ~bits_below(x.count)) != 0) return name + "nobody there, but waiting";
        bool is_held = false;
        for (Index i = 0; i < x.count; ++i) {
            Index item = node(n).items[i], largest = item;
            if (x.height == 0) {
                if (leaf_of(item) != n) return name + "an event does not know where it is";
            } else {
                if (node(item).parent != n) return name + "a child has another parent";
                if (node(item).height != x.height - 1) return name + "a child of a wrong height";
                if (node(item).place != i) return name + "a child in another place";
                if (x.height == 1 && orders_[at(item)] != order(n, i))
                    return name + "a wrong order";
                if (bit(n, i) != (node(item).waiting != 0)) return name + "wrong about who waits";
                std::string broken = check_node(item);
                if (!broken.empty()) return broken;
                largest = node(item).largest;
            }
            if (x.keys[i] != coarse_key(keys_.key(largest))) return name + "a wrong key";
            if (keys_.smaller(x.largest, largest)) return name + "there is a larger event";
            is_held |= x.largest == largest;
        }
        return is_held ? "" : name + "the largest event is not in it";
    }

    mutable Array<Seat> seats_;  // by event
    Index free_ = kNone;
};

}  // namespace flintknap
