// Pairs of sites as users get them: rows of two ids, in one order.
//
// Theory. Ids count up for ever, but those that are alive are mostly near each other: less the
// smallest of them they have 31 bits, and are looked up nowhere. If not, their places in a list of
// all take their part. Such numbers are sorted by radix, from the last digit of the second one to
// the first digit of the first one: passes from one array to another, without a comparison.
//
// Cost: O(n + m) for n sites and m pairs.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "large.hpp"
#include "mesh.hpp"

namespace flintknap {

// Two slots, or two numbers. Not initialised, like all of a Large array of them.
struct Couple {
    Index first, second;
};

// The ids of sites, as numbers in the same order.
class Numbers {
   public:
    // Ids ascend; `slot_of` tells the slot of one.
    template <class SlotOf>
    Numbers(std::vector<std::int64_t> ids, Index slots, SlotOf slot_of)
        : ids_(std::move(ids)), numbers_(at(slots)) {
        if (ids_.empty()) return;
        least_ = ids_.front();
        is_near_ = ids_.back() - least_ <= std::numeric_limits<Index>::max();
        for (std::size_t n = 0; n < ids_.size(); ++n) {
            most_ = static_cast<Index>(is_near_ ? ids_[n] - least_ : static_cast<std::int64_t>(n));
            numbers_[at(slot_of(ids_[n]))] = most_;
        }
    }

    Index most() const { return most_; }
    Index of_slot(Index v) const { return numbers_[at(v)]; }
    std::int64_t id(Index number) const { return is_near_ ? least_ + number : ids_[at(number)]; }

   private:
    std::vector<std::int64_t> ids_;
    std::vector<Index> numbers_;  // by slot
    std::int64_t least_ = 0;
    bool is_near_ = true;
    Index most_ = 0;
};

// Couples of slots, in any order, as rows of two ids: the smaller one first, rows ascending.
inline Large<std::int64_t> sorted_rows(Large<Couple> couples, const Numbers& numbers) {
    constexpr int widest = 11;
    int bits = 1, digits = 1;
    while (numbers.most() >> bits > 0) ++bits;
    while (digits * widest < bits) ++digits;
    const int width = (bits + digits - 1) / digits;
    const std::size_t values = std::size_t{1} << width;
    auto digit = [&](Index number, int d) { return at(number) >> (width * d) & (values - 1); };
    // by digit, those of the second first, and by value: how many have it; then where the next goes
    std::vector<std::size_t> places(at(2 * digits) * values);
    auto place = [&](int d) { return places.data() + at(d) * values; };
    for (Couple& c : couples) {
        Index a = numbers.of_slot(c.first), b = numbers.of_slot(c.second);
        c = {std::min(a, b), std::max(a, b)};
        for (int d = 0; d < digits; ++d) {
            ++place(d)[digit(c.second, d)];
            ++place(digits + d)[digit(c.first, d)];
        }
    }
    for (int d = 0; d < 2 * digits; ++d) {
        std::size_t sum = 0;
        for (std::size_t v = 0; v < values; ++v) sum += std::exchange(place(d)[v], sum);
    }
    Large<Couple> other(couples.size());
    for (int d = 0; d < 2 * digits - 1; ++d) {
        std::size_t* next = place(d);
        for (const Couple& c : couples) {
            other[next[digit(d < digits ? c.second : c.first, d % digits)]++] = c;
        }
        couples.swap(other);
    }
    Large<Couple>().swap(other);
    Large<std::int64_t> rows(2 * couples.size());
    std::size_t* next = place(2 * digits - 1);
    for (const Couple& c : couples) {
        std::size_t row = next[digit(c.first, digits - 1)]++;
        rows[2 * row] = numbers.id(c.first);
        rows[2 * row + 1] = numbers.id(c.second);
    }
    return rows;
}

}  // namespace flintknap
