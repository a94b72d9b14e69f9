// The Flintstone of a stretch of the ring, found through the boxes of the ring.
//
// Theory (docs/theory.md, section 7.1). A box that the Flintstone found so far covers holds nothing
// new; what other boxes hold is looked into. To have something that covers from the start, a few
// vertices are looked at beforehand: those that decided before, some evenly spread, and some next
// to the ends, for there smooth polylines are split.
//
// Cost: at worst the length of the stretch; O(log n) boxes where it is crooked.
#pragma once

#include <array>

#include "flintstone.hpp"
#include "triangulation.hpp"

namespace flintknap {

class RingSearch : public Search {
   public:
    RingSearch(const Triangulation& triangulation, const Ring& ring, Parting parting)
        : Search(parting), t_(triangulation), r_(ring) {}

    // Of the polyline from p to s; `before` is what was found last, if anything.
    Flintstone search(Index p, Index s, const Flintstone& before) {
        Index from = r_.rank(p), count = r_.rank(s) - from;
        if (count < 0) count += r_.size();
        begin(t_.site(p), t_.site(s));
        if (count > kSeeded) {
            for (Index seed : {before.left, before.right, before.farthest}) {
                if (seed == kNone || !r_.holds(seed)) continue;
                Index place = r_.rank(seed) - from;
                if (place < 0) place += r_.size();
                if (place > 0 && place < count) see({seed, t_.site(seed)});
            }
            Index part = count / 8;  // on smooth curves the extremes are mostly near the ends
            for (Index step : {1, 16, part, 2 * part, 3 * part, 4 * part, 5 * part, 6 * part,
                               7 * part, count - 16, count - 1}) {
                Index v = r_.vertex((from + step) % r_.size());
                see({v, t_.site(v)});
            }
        }
        see_range(from + 1, count - 1);
        return result();
    }

    // Sees `count` vertices from a rank on.
    void see_range(Index rank, Index count) {
        if (count <= 0) return;
        r_.visit_range(rank % r_.size(), count,
                       [&](Index n, Index begin, Index end) { see_run(n, begin, end); });
    }

   private:
    static constexpr Index kSeeded = 64;  // vertices from which on a few are looked at beforehand

    void see_run(Index n, Index begin, Index end) {
        std::array<Index, Ring::kDeepest> todo;
        std::size_t left = 0;
        while (true) {
            const Ring::Node& node = r_.node(n);
            if (end - begin < 4 || !covers(node.box)) {
                if (!r_.is_leaf(n)) {
                    todo[left++] = node.right;
                    n = node.left;
                    begin = 0;
                    end = r_.node(n).count;
                    continue;
                }
                const Ring::Leaf& l = r_.leaf(n);
                see(l.x + begin, l.y + begin, l.vertex + begin, end - begin);
            }
            if (left == 0) return;
            n = todo[--left];
            begin = 0;
            end = r_.node(n).count;
        }
    }

    const Triangulation& t_;
    const Ring& r_;
};

}  // namespace flintknap
