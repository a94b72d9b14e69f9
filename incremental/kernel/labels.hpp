// Labels that rise along a list: which of two items comes first is told without a way there.
//
// Theory (Dietz and Sleator 1987). An item that comes between two others gets the label in the
// middle. Where there is none, as many items around it as it takes get new ones, evenly spread:
// n of them once the labels of the two beside them are more than n * n apart, so each of the gaps
// is halved some log n times before they run out again.
//
//       a    b    c    d          x comes between b and c, where there is no label left; from
//      100  112  113  114         100 to 114 is more than 3 * 3, so b, x and c get new ones:
//
//       a    b   x   c    d
//      100  103 107 110  114
//
// `List` tells before(x) and behind(x), the neighbours of an item, or kNone; and label(x), 0 while
// x has none; and takes set_label(x, label).
//
// Cost: amortised O(log n) labels for each item that comes.
#pragma once

#include <cstdint>

#include "mesh.hpp"

namespace flintknap {

using Label = std::uint32_t;

// The i-th, from 1 on, of n labels between two others.
inline Label spread_label(std::uint64_t low, std::uint64_t high, std::uint64_t i, std::uint64_t n) {
    return static_cast<Label>(low + i * (high - low) / (n + 1));
}

constexpr std::uint64_t kEndOfLabels = std::uint64_t{1} << 32;  // all are below, and above 0

// Labels an item and those beside it that have no label either. Its list has less than 2^31 items.
template <class List>
void give_label(List& list, Index item) {
    if (list.label(item) != 0) return;
    Index first = item, last = item;
    std::uint64_t n = 1;
    while (true) {
        Index before = list.before(first), behind = list.behind(last);
        std::uint64_t low = before == kNone ? 0 : list.label(before);
        std::uint64_t high = behind == kNone ? kEndOfLabels : list.label(behind);
        bool reaches_low = before == kNone || low != 0, reaches_high = behind == kNone || high != 0;
        bool is_all = before == kNone && behind == kNone;
        if (reaches_low && reaches_high && (is_all || high - low > n * n)) {
            for (std::uint64_t i = 1; i <= n; ++i, first = list.behind(first)) {
                list.set_label(first, spread_label(low, high, i, n));
            }
            return;
        }
        bool is_stuck = reaches_low && reaches_high;
        if (before != kNone && (is_stuck || !reaches_low)) {
            first = before;
            ++n;
        }
        if (behind != kNone && (is_stuck || !reaches_high)) {
            last = behind;
            ++n;
        }
    }
}

}  // namespace flintknap
