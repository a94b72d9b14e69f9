// The order in which a batch of points is inserted: biased randomised, then along a Hilbert curve.
//
// Theory. A triangulation is built fast if each point lies near the one before it (short walks)
// while no prefix of the batch is lopsided (few changes). A biased randomised insertion order
// (Amenta, Choi and Rote 2003) gives both: each point draws a round, three quarters of them the
// last one, three quarters of the rest the last but one, and so on; each round runs along the
// curve. Round, place on the curve and number of the point share 64 bits, sorted by radix: for n
// points, 2^59 / n cells of the plane are told apart.
//
// The order decides only the cost, never the result (the triangulation is a function of the set).
// Cost: O(n) for keys and sort; 16 bytes a point while it lasts.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "mesh.hpp"
#include "predicates.hpp"

namespace flintknap {

// A well-mixed hash of 64 bits (the finalizer of Steele, Lea and Flood's SplitMix).
inline std::uint64_t mix(std::uint64_t v) {
    v += 0x9e3779b97f4a7c15ULL;
    v = (v ^ (v >> 30)) * 0xbf58476d1ce4e5b9ULL;
    v = (v ^ (v >> 27)) * 0x94d049bb133111ebULL;
    return v ^ (v >> 31);
}

// A permutation of 0 .. n - 1 by keys, of which the leading bits count: as many as the numbers of
// the items leave room for in 64. Items whose bits are equal keep their order.
class Order {
   public:
    template <class KeyOf>
    Order(std::size_t n, KeyOf key) : item_bits_(bits(n)), ranked_(n) {
        for (std::size_t i = 0; i < n; ++i) ranked_[i] = (key(i) >> item_bits_ << item_bits_) | i;
        sort();
    }

    // How many the numbers of n items take.
    static int bits(std::size_t n) {
        int enough = 0;
        while (n > std::size_t{1} << enough) ++enough;
        return enough;
    }

    std::size_t size() const { return ranked_.size(); }
    std::size_t operator[](std::size_t i) const {
        return ranked_[i] & ((std::uint64_t{1} << item_bits_) - 1);
    }
    // Whether the i-th and the one before it have the same key, as far as it counts.
    bool is_tied(std::size_t i) const { return (ranked_[i] ^ ranked_[i - 1]) >> item_bits_ == 0; }

    static constexpr int kDigit = 11;  // bits that one pass sorts by

   private:
    static constexpr std::size_t kFew = 1024;  // below, clearing the counters costs more

    // By radix, least significant digit first, skipping digits that all keys share.
    void sort() {
        if (ranked_.size() < kFew) return std::sort(ranked_.begin(), ranked_.end());
        Array<std::uint64_t> other(ranked_.size());
        std::uint64_t ones = 0, zeros = 0;
        for (std::uint64_t r : ranked_) {
            ones |= r;
            zeros |= ~r;
        }
        for (int shift = item_bits_; shift < 64; shift += kDigit) {
            constexpr std::uint64_t mask = (1U << kDigit) - 1;
            if (((ones & zeros) >> shift & mask) == 0) continue;
            std::array<std::size_t, mask + 1> start{};
            for (std::uint64_t r : ranked_) ++start[r >> shift & mask];
            std::size_t sum = 0;
            for (std::size_t& s : start) sum += std::exchange(s, sum);
            for (std::uint64_t r : ranked_) other[start[r >> shift & mask]++] = r;
            ranked_.swap(other);
        }
    }

    int item_bits_;
    Array<std::uint64_t> ranked_;  // key and item
};

// The Hilbert curve, two levels at a time. At each level a quadrant is chosen and the frame turned:
// state 0 .. 3, two bits of place, two of quadrant.
struct HilbertSteps {
    std::uint8_t place[4][16] = {}, state[4][16] = {};

    constexpr HilbertSteps() {
        //                                     quadrant (x, y):  00 01 10 11
        constexpr std::uint8_t place_of[4][4] = {
            {0, 1, 3, 2}, {0, 3, 1, 2}, {2, 1, 3, 0}, {2, 3, 1, 0}};
        constexpr std::uint8_t turned[4][4] = {
            {1, 0, 2, 0}, {0, 3, 1, 1}, {2, 2, 0, 3}, {3, 1, 3, 2}};
        for (unsigned s = 0; s < 4; ++s) {
            for (unsigned cell = 0; cell < 16; ++cell) {  // of 4 x 4, as x * 4 + y
                unsigned outer = (cell >> 2 & 2) | (cell >> 1 & 1);
                unsigned inner = (cell >> 1 & 2) | (cell & 1), then = turned[s][outer];
                place[s][cell] =
                    static_cast<std::uint8_t>(place_of[s][outer] << 2 | place_of[then][inner]);
                state[s][cell] = turned[then][inner];
            }
        }
    }
};

// Place of the cell (x, y) of a 2^bits grid along the curve; bits even.
inline std::uint64_t hilbert(std::uint32_t x, std::uint32_t y, int bits) {
    static constexpr HilbertSteps steps;
    std::uint64_t key = 0;
    unsigned state = 0;
    for (int b = bits - 2; b >= 0; b -= 2) {
        unsigned cell = ((x >> b) & 3U) << 2 | ((y >> b) & 3U);
        key = key << 4 | steps.place[state][cell];
        state = steps.state[state][cell];
    }
    return key;
}

// By round(i), 0 .. 31, and each round along the curve, point(i) being the place of item i, told to
// `most` bits of x and of y, an even number.
template <class PointOf, class RoundOf>
Order order_in_rounds(std::size_t n, PointOf point, RoundOf round, int most) {
    if (n == 0) return {0, round};
    Point low = point(0), high = low;
    for (std::size_t i = 1; i < n; ++i) {
        Point p = point(i);
        low = {std::min(low.x, p.x), std::min(low.y, p.y)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
    // of x and of y: even, and as many as count, or one more
    int bits = std::min(most, 2 * ((59 - Order::bits(n) + 3) / 4));
    double extent = std::max(high.x - low.x, high.y - low.y);
    double scale = extent > 0 ? ((1U << bits) - 1) / extent : 0;
    return {n, [=](std::size_t i) {
                Point p = point(i);
                auto x = static_cast<std::uint32_t>((p.x - low.x) * scale);
                auto y = static_cast<std::uint32_t>((p.y - low.y) * scale);
                return round(i) << 59 | hilbert(x, y, bits) << (59 - 2 * bits);
            }};
}

// The order of insertion: biased randomised.
template <class PointOf>
Order insertion_order(std::size_t n, PointOf point) {
    auto drawn = [](std::size_t i) {
        std::uint64_t draw = mix(i), round = 31;  // 32 rounds: a quarter of a quarter of ...
        for (; round > 0 && (draw & 3) == 0; draw >>= 2) --round;
        return round;
    };
    return order_in_rounds(n, point, drawn, 28);
}

// All along the curve, as finely as takes no more passes than telling them apart.
template <class PointOf>
Order curve_order(std::size_t n, PointOf point) {
    int passes = (Order::bits(n) + Order::kDigit - 1) / Order::kDigit;
    return order_in_rounds(
        n, point, [](std::size_t) { return std::uint64_t{0}; }, 2 * (passes * Order::kDigit / 4));
}

}  // namespace flintknap
