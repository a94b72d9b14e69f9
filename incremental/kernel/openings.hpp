// The gates that stand open while a constriction is made from scratch, in the order of their keys.
//
// Theory. The smallest key of all rises, as a rule: what is smaller than gates already taken was
// opened by one of them, and is soon taken itself. So only gates below a level are kept in a heap;
// the others lie in *bins* by key, in no order. When the heap is empty, the level rises to the next
// bin that is not, and that one is tipped into the heap:
//
//      keys   [ heap      |      |   bin   |  bin  | ... |  bin  ]
//             smallest  level -->
//
// A heap of all would hold 300,000 gates for 1e6 uniform sites; this one holds some hundred, which
// the nearest cache does, too. And what is in a bin is looked at all at once: what belongs to
// other gates is fetched meanwhile, and those that lead nowhere by now, nearly half, are dropped.
//
// The order is that of one heap, for bins follow the order of keys, and equal keys share a bin.
// Cost: O(log n) a gate at most, where many keys are nearly equal; about 20 bytes a gate.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include "array.hpp"
#include "forest.hpp"
#include "heap.hpp"

namespace flintknap {

// An open gate, and whom it points at.
struct Opening {
    double key;
    Index edge, apex;
    Gate gate() const { return {key, edge}; }
};
struct SmallerOpening {
    const Triangulation& t;
    bool operator()(const Opening& a, const Opening& b) const {
        return smaller(t, a.gate(), b.gate());
    }
};

class Openings {
   public:
    explicit Openings(const Triangulation& t) : heap_(SmallerOpening{t}) {
        std::size_t bins = 16;
        while (bins * kShare < at(t.size())) bins *= 2;
        bins_.assign(bins, kNone);
    }

    void push(const Opening& opening) {
        std::size_t bin = bin_of(opening.key);
        if (bin <= level_) return heap_.push(opening);
        if (bins_[bin] == kNone || chunk(bins_[bin]).count == kMost) add_chunk(bin);
        Chunk& last = chunk(bins_[bin]);
        last.openings[last.count++] = opening;
    }

    // The smallest opening leaves; it must have been the turn of one.
    Opening pop() { return heap_.pop(); }
    // Whether one is left, and then the smallest is at hand. `fetch` is told of many openings soon
    // to be asked for, `is_good` tells which are not to be dropped.
    template <class Fetch, class IsGood>
    bool any(Fetch fetch, IsGood is_good) {
        while (heap_.empty() && level_ + 1 < bins_.size()) tip(++level_, fetch, is_good);
        return !heap_.empty();
    }

   private:
    static constexpr std::size_t kShare = 128;  // sites a bin
    static constexpr std::size_t kMost = 15;

    // Of the openings in a bin; of those not in use.
    struct Chunk {
        Opening openings[kMost];
        std::size_t count;
        Index next;
    };

    Chunk& chunk(Index n) { return chunks_[at(n)]; }

    // Each step is monotone, so the whole is; angles are spread evenly enough.
    std::size_t bin_of(double key) const {
        double share = 1 - 1 / (1 + std::fabs(key));  // 0 .. 1
        double place = (1 + std::copysign(share, key)) * static_cast<double>(bins_.size() / 2);
        return std::min(static_cast<std::size_t>(place), bins_.size() - 1);
    }

    void add_chunk(std::size_t bin) {
        Index made = free_;
        if (made == kNone) {
            made = static_cast<Index>(chunks_.size());
            chunks_.push_back({});
        } else {
            free_ = chunk(made).next;
        }
        chunk(made).count = 0;
        chunk(made).next = std::exchange(bins_[bin], made);
    }

    template <class Fetch, class IsGood>
    void tip(std::size_t bin, Fetch fetch, IsGood is_good) {
        for (Index c = bins_[bin]; c != kNone; c = chunk(c).next) {
            for (std::size_t i = 0; i < chunk(c).count; ++i) fetch(chunk(c).openings[i]);
        }
        while (bins_[bin] != kNone) {
            Index c = bins_[bin];
            for (std::size_t i = 0; i < chunk(c).count; ++i) {
                if (is_good(chunk(c).openings[i])) heap_.push(chunk(c).openings[i]);
            }
            bins_[bin] = chunk(c).next;
            chunk(c).next = std::exchange(free_, c);
        }
    }

    Heap<Opening, SmallerOpening> heap_;
    std::size_t level_ = 0;
    Array<Index> bins_;  // the chunk filled last, or kNone
    Array<Chunk> chunks_;
    Index free_ = kNone;
};

}  // namespace flintknap
