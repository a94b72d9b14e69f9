// Brings the ring sequence up to date with the links of the boundary, at the cost of what changed.
//
// Theory. A leaf is *loose* if one of its vertices is followed by another one than before, left the
// ring or has another place, or if the edge into its first or out of its last vertex is so. All
// other leaves keep their vertices and are entered and left by the same edges as before: they stay,
// in blocks. From the end of each block the new links are walked, through vertices of loose leaves
// and new ones, until the next block begins:
//
//      before   [ block ] (loose) (loose) [ block ] (loose) [ block ]  ...
//      walks    [ block ] . . . . . . . . [ block ] . . . . [ block ]  ...
//
// Nearly always the blocks follow each other as before. Then the loose leaves between two of them
// take up what was walked between them. If it needs more leaves or fewer, or if blocks come in
// another order, the tree is cut at the ends of the blocks and joined again by the walks. A walk
// that is too short for a leaf goes on through the next one, so leaves do not get ever emptier.
//
// Which links to look at, Links tells. Each vertex that left the ring came after one that is now
// followed by another, or after one that left, too; so loose leaves find each other.
// Cost: O(k log n) for k changed links; O(n), from scratch, if a fair share of the ring is loose.
#pragma once

#include <algorithm>
#include <vector>

#include "links.hpp"
#include "ring.hpp"

namespace flintknap {

class Splices {
   public:
    // Source: ring_size(), slots(), smallest(), on_ring(v), following(v), site(v), prefetch(v) of
    // what these read. If memory ends, the ring is made from scratch next time. Returns whether
    // anything may have changed.
    template <class Source>
    bool update(Ring& ring, const Source& source, Links& links) {
        if (links.none() && source.ring_size() > 0) return false;
        bool all = links.all() || source.ring_size() == 0 || ring.empty();
        is_whole_ = false;
        links.take(touched_);
        changed_.clear();
        changed_all_ = true;
        if (source.ring_size() == 0) {
            ring.clear();
            return true;  // and all is changed when there is a ring again
        }
        if (!all && splice(ring, source)) {
            changed_all_ = false;
        } else {
            is_loose_.clear();
            build(ring, source);
        }
        touched_.clear();
        links.restart(at(ring.size()) / 8 + 1);
        is_whole_ = true;
        return true;
    }

    // Where all counts as changed, finds out what is, by comparison with the sequence as it was:
    // for those to whom much is lost otherwise. All still is, if it is a fair share. O(n).
    template <class Source>
    void compare(const Ring& ring, const Source& source, Links& links) const {
        if (!is_whole_ || ring.empty() || source.ring_size() == 0) return;
        links.restart(at(source.ring_size()) / 8 + 1);
        try {
            Index first = source.smallest(), v = first;
            do {
                Index next = source.following(v);
                if (!is_as_before(ring, source, v, next)) links.touch(v);
                v = next;
            } while (v != first && !links.all());
        } catch (...) {
            links.touch_all();
            throw;
        }
    }

    // Boxes, each of a stretch of the ring that was replaced by the last update and of what
    // replaced it; or whether it was all of the ring.
    const std::vector<Box>& changed() const { return changed_; }
    bool changed_all() const { return changed_all_; }

    std::size_t bytes() const {
        return (touched_.capacity() + loose_.capacity() + walked_.capacity()) * sizeof(Index) +
               is_loose_.capacity() + walks_.capacity() * sizeof(Walk) +
               changed_.capacity() * sizeof(Box);
    }

   private:
    // From the block that ends with leaf `tail`, over vertices walked_[first .. last), to the block
    // that begins with leaf `head`. Before, `old_leaves` loose leaves from `old_first` on stood
    // behind `tail`, and then the block that begins with leaf `old_head`.
    struct Walk {
        Index tail, head, old_first, old_head, old_leaves;
        std::size_t first, last;

        std::size_t length() const { return last - first; }
        bool is_in_place() const {
            return head == old_head && length() >= at(Ring::kLeast) * at(old_leaves) &&
                   length() <= at(Ring::kMost) * at(old_leaves);
        }
    };

    // Whether v, which is on the ring, is where it was, followed by the same vertex.
    template <class Source>
    static bool is_as_before(const Ring& ring, const Source& source, Index v, Index next) {
        Index n = ring.leaf_of(v);
        if (n == kNone) return false;
        const Ring::Leaf& leaf = ring.leaf(n);
        Index i = ring.place_in(n, v);
        return leaf.vertex[i + 1] == next && source.site(v) == Point{leaf.x[i], leaf.y[i]};
    }

    template <class Source>
    void build(Ring& ring, const Source& source) {
        walked_.clear();
        walked_.reserve(at(source.ring_size()));
        Index first = source.smallest(), v = first;
        do {
            walked_.push_back(v);
            v = source.following(v);
        } while (v != first);
        ring.clear();
        ring.make_slots(at(source.slots()));
        ring.done(ring.plant(source, walked_.data(), walked_.size(), first), first);
        std::vector<Index>().swap(walked_);  // as long as the ring
    }

    // False if the ring is better made from scratch.
    template <class Source>
    bool splice(Ring& ring, const Source& source) {
        ring.make_slots(at(source.slots()));
        is_loose_.resize(ring.nodes(), 0);
        loose_.clear();
        for (std::size_t i = 0; i < touched_.size(); ++i) {
            fetch_ahead(ring, source, i);
            loosen_around(ring, source, touched_[i]);
        }
        if (loose_.empty()) return true;
        if (!walk_all(ring, source)) return false;
        for (Index n : loose_) is_loose_[at(n)] = 0;
        auto is_in_place = [](const Walk& w) { return w.is_in_place(); };
        if (std::all_of(walks_.begin(), walks_.end(), is_in_place)) {
            refill(ring, source);
        } else {
            rejoin(ring, source);
        }
        ring.done(ring.root_of(walks_[0].tail), source.smallest());
        return true;
    }

    bool is_loose(Index leaf) const { return is_loose_[at(leaf)] != 0; }
    void loosen(Index leaf) {
        if (is_loose(leaf)) return;
        loose_.push_back(leaf);
        is_loose_[at(leaf)] = 1;
    }

    // Fetches what will be asked for around those touched of which the i-th is next.
    template <class Source>
    [[gnu::always_inline]] void fetch_ahead(const Ring& ring, const Source& source,
                                            std::size_t i) const {
        constexpr std::size_t ahead = 4;
        if (i + 3 * ahead < touched_.size()) {
            ring.prefetch(touched_[i + 3 * ahead]);
            source.prefetch(touched_[i + 3 * ahead]);
        }
        auto leaf_of = [&](std::size_t k) {
            return k < touched_.size() ? ring.leaf_of(touched_[k]) : kNone;
        };
        if (Index n = leaf_of(i + 2 * ahead); n != kNone) __builtin_prefetch(&ring.node(n));
        if (Index n = leaf_of(i + ahead); n != kNone) {
            ring.leaf(n).fetch(ring.node(n).count);
        }
    }

    template <class Source>
    void loosen_around(const Ring& ring, const Source& source, Index v) {
        Index n = ring.leaf_of(v);
        if (n == kNone) return;  // new: a walk will meet it
        const Ring::Leaf& leaf = ring.leaf(n);
        Index i = ring.place_in(n, v);
        bool moved = !source.on_ring(v) || !(source.site(v) == Point{leaf.x[i], leaf.y[i]});
        if (!moved && source.following(v) == leaf.vertex[i + 1]) return;
        loosen(n);
        if (moved && i == 0) loosen(ring.leaf_before(n));
        if (i + 1 == ring.node(n).count) loosen(ring.leaf_after(n));
    }

    // Where to and over which vertices each block is left. False if not much but loose leaves is
    // left of the ring.
    template <class Source>
    bool walk_all(Ring& ring, const Source& source) {
        std::size_t known = 0;
        do {
            for (; known < loose_.size(); ++known) {
                Index n = loose_[known], last = ring.leaf(n).vertex[ring.node(n).count - 1];
                if (!source.on_ring(last)) loosen(ring.leaf_after(n));
                const Index* vertices = ring.leaf(n).vertex;
                for (Index i = 0; i < ring.node(n).count; ++i) source.prefetch(vertices[i]);
                ring.forget_vertices(n);
            }
            if (at(Ring::kFill) * known > at(ring.size()) / 4) return false;
            walks_.clear();
            walked_.clear();
            for (std::size_t i = 0; i < known; ++i) {
                Index tail = ring.leaf_before(loose_[i]);
                if (is_loose(tail)) continue;
                walks_.push_back(walk(ring, source, tail, loose_[i]));
                if (walks_.back().length() < at(Ring::kLeast)) loosen(walks_.back().head);
            }
        } while (known < loose_.size());
        return true;
    }

    // From `tail` on; `first` is the loose leaf behind it.
    template <class Source>
    Walk walk(const Ring& ring, const Source& source, Index tail, Index first) {
        Walk w = {tail, kNone, first, first, 0, walked_.size(), 0};
        for (; is_loose(w.old_head); w.old_head = ring.leaf_after(w.old_head)) ++w.old_leaves;
        Index v = ring.leaf(tail).vertex[ring.node(tail).count];
        for (; !ring.holds(v); v = source.following(v)) walked_.push_back(v);
        w.last = walked_.size();
        w.head = ring.leaf_of(v);
        return w;
    }

    // The blocks stay; what was walked goes into the leaves that are there, in equal shares.
    template <class Source>
    void refill(Ring& ring, const Source& source) {
        for (const Walk& w : walks_) {
            Index n = w.old_first, closing = ring.leaf(w.head).vertex[0];
            std::size_t start = w.first;
            Box changed = ring.node(n).box;
            for (std::size_t i = 1; i <= at(w.old_leaves); ++i, n = ring.leaf_after(n)) {
                std::size_t end = w.first + i * w.length() / at(w.old_leaves);
                changed.extend(ring.node(n).box);
                ring.fill(source, n, &walked_[start], static_cast<Index>(end - start),
                          end == w.last ? closing : walked_[end]);
                changed.extend(ring.node(n).box);
                start = end;
            }
            changed_.push_back(changed);
        }
        for (Index n : loose_) ring.refresh_above(n);
    }

    // The blocks are cut out, the loose leaves go, and new ones join the blocks by the walks.
    template <class Source>
    void rejoin(Ring& ring, const Source& source) {
        ring.turn_to(walks_[0].old_first);  // now no block runs over the end of the tree
        for (const Walk& w : walks_) {
            ring.cut_before(w.old_first);
            ring.cut_before(w.old_head);
        }
        Box changed = ring.node(walks_[0].old_first).box;
        for (const Walk& w : walks_) {
            Index old = ring.root_of(w.old_first);
            changed.extend(ring.node(old).box);
            ring.uproot(old);
        }
        auto by_tail = [](const Walk& a, const Walk& b) { return a.tail < b.tail; };
        std::sort(walks_.begin(), walks_.end(), by_tail);
        Index tree = kNone, block = ring.root_of(walks_[0].head);
        for (std::size_t i = 0; i < walks_.size(); ++i) {
            Walk wanted = {ring.last_leaf(block), 0, 0, 0, 0, 0, 0};
            const Walk& w = *std::lower_bound(walks_.begin(), walks_.end(), wanted, by_tail);
            Index closing = ring.leaf(w.head).vertex[0];
            Index between = ring.plant(source, &walked_[w.first], w.length(), closing);
            changed.extend(ring.node(between).box);
            Index after = ring.root_of(w.head);
            tree = ring.join(ring.join(tree, block), between);
            block = after;
        }
        changed_.push_back(changed);
    }

    bool is_whole_ = false;  // the sequence is what the last update made of it
    std::vector<Index> touched_, loose_;
    std::vector<char> is_loose_;  // by node
    std::vector<Walk> walks_;
    std::vector<Index> walked_;
    std::vector<Box> changed_;
    bool changed_all_ = true;
};

}  // namespace flintknap
