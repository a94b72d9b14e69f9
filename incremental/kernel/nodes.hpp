// The nodes of a tree over the ring: a pool of them, and how many vertices each level has.
//
// A node is *refined* if it has children: both of them, each a node or a single edge of the ring.
// Who a node is the child of, and on which level, its owner knows.
//
// Cost: O(1) a node made, refined or given back; no memory for giving back. 64 bytes a node.
#pragma once

#include <algorithm>
#include <vector>

#include "flintstone.hpp"

namespace flintknap {

struct alignas(64) Node {
    // If it is not known, its split is still that at which the children part.
    Flintstone found;
    Index first = kNone, second = kNone;  // nodes, kEdge, or kNone both; of one not in use, the
                                          // next such

    bool is_refined() const { return first != kNone; }
};

class Nodes {
   public:
    static constexpr Index kEdge = -2;  // in place of a node: a single edge of the ring

    Node& operator[](Index n) { return nodes_[at(n)]; }
    const Node& operator[](Index n) const { return nodes_[at(n)]; }
    [[gnu::always_inline]] void prefetch(Index n) const {
        __builtin_prefetch(&nodes_[at(std::max(n, 0))]);
    }

    // Refined ones, and the base; vertices of each level, of which the last may have none.
    bool empty() const { return refined_ == 0; }
    Index refined() const { return refined_; }
    const std::vector<Index>& at_level() const { return at_level_; }
    Index deepest() const {
        std::size_t levels = at_level_.size();
        while (levels > 1 && at_level_[levels - 1] == 0) --levels;
        return static_cast<Index>(std::max<std::size_t>(levels, 1)) - 1;
    }

    void clear() {
        nodes_.clear();
        at_level_.clear();
        free_ = kNone;
        refined_ = 0;
    }
    // Room for the two polylines of the base, and then the base itself.
    void make_room_for_base() {
        nodes_.reserve(2);
        at_level_.assign(1, 2);
    }
    void set_base() { refined_ = 1; }

    Index make() {
        if (free_ == kNone) {
            nodes_.emplace_back();
            return static_cast<Index>(nodes_.size()) - 1;
        }
        Index n = free_;
        free_ = nodes_[at(n)].first;
        nodes_[at(n)] = Node{};
        return n;
    }
    void give_back(Index node) {
        nodes_[at(node)].first = free_;
        free_ = node;
    }

    // Gives a node of a level its children, which `first()` and `second()` make.
    template <class First, class Second>
    void refine(Index node, Index level, First first, Second second) {
        if (at_level_.size() <= at(level + 1)) at_level_.resize(at(level) + 2);
        Index one = first(), other = kNone;
        try {
            other = second();
        } catch (...) {
            if (one != kEdge) give_back(one);
            throw;
        }
        nodes_[at(node)].first = one;
        nodes_[at(node)].second = other;
        ++refined_;
        ++at_level_[at(level + 1)];
    }

    // Takes a node's children away, with all below. Needs no memory: those still to go are strung
    // along what they no longer need.
    void drop_children(Index node, Index level) {
        Index next = kNone;
        auto string_children = [&](Node& n, Index at_level) {
            if (!n.is_refined()) return;
            --refined_;
            --at_level_[at(at_level + 1)];
            for (Index child : {n.first, n.second}) {
                if (child == kEdge) continue;
                nodes_[at(child)].found.farthest = next;
                nodes_[at(child)].found.split = at_level + 1;
                next = child;
            }
            n.first = n.second = kNone;
        };
        string_children(nodes_[at(node)], level);
        while (next != kNone) {
            Index gone = next;
            Node& n = nodes_[at(gone)];
            next = n.found.farthest;
            string_children(n, n.found.split);
            give_back(gone);
        }
    }

    std::size_t bytes() const {
        return nodes_.capacity() * sizeof(Node) + at_level_.capacity() * sizeof(Index);
    }

   private:
    std::vector<Node> nodes_;
    Index free_ = kNone;  // the first node not in use
    Index refined_ = 0;
    std::vector<Index> at_level_;
};

}  // namespace flintknap
