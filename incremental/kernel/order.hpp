// The order in which a batch of points is inserted: biased randomised, then along a Hilbert curve.
//
// Theory. A triangulation is built fast if each point lies near the one before it (short walks)
// while no prefix of the batch is lopsided (few changes). A biased randomised insertion order
// (Amenta, Choi and Rote 2003) gives both: each point draws a round, three quarters of them the
// last one, three quarters of the rest the last but one, and so on; each round runs along the
// curve. Round and place on the curve form one 64-bit key, sorted by radix.
//
// The order decides only the cost, never the result (the triangulation is a function of the set).
// Cost: O(n) for keys and sort; 24 bytes a point while it lasts.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

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

// Place of the cell (x, y) of a 2^bits grid along the Hilbert curve. At each level a quadrant is
// chosen and the frame turned: state 0 .. 3, two bits of place, two of quadrant.
inline std::uint64_t hilbert(std::uint32_t x, std::uint32_t y, int bits) {
    //                                       quadrant (x, y):  00 01 10 11
    static constexpr std::uint8_t place[4][4] = {
        {0, 1, 3, 2}, {0, 3, 1, 2}, {2, 1, 3, 0}, {2, 3, 1, 0}};
    static constexpr std::uint8_t turn[4][4] = {
        {1, 0, 2, 0}, {0, 3, 1, 1}, {2, 2, 0, 3}, {3, 1, 3, 2}};
    std::uint64_t key = 0;
    unsigned state = 0;
    for (int b = bits - 1; b >= 0; --b) {
        unsigned quadrant = ((x >> b) & 1U) << 1 | ((y >> b) & 1U);
        key = key << 2 | place[state][quadrant];
        state = turn[state][quadrant];
    }
    return key;
}

struct Ranked {
    std::uint64_t key;
    Index item;
};

// Sorts by key, least significant digit first, skipping digits that all keys share.
inline void radix_sort(std::vector<Ranked>& items) {
    constexpr int digit = 11;
    constexpr std::uint64_t mask = (1U << digit) - 1;
    std::vector<Ranked> other(items.size());
    std::uint64_t ones = 0, zeros = 0;
    for (const Ranked& r : items) {
        ones |= r.key;
        zeros |= ~r.key;
    }
    for (int shift = 0; shift < 64; shift += digit) {
        if (((ones & zeros) >> shift & mask) == 0) continue;
        std::array<std::size_t, mask + 1> start{};
        for (const Ranked& r : items) ++start[r.key >> shift & mask];
        std::size_t sum = 0;
        for (std::size_t& s : start) sum += std::exchange(s, sum);
        for (const Ranked& r : items) other[start[r.key >> shift & mask]++] = r;
        items.swap(other);
    }
}

// A permutation of 0 .. n - 1, point(i) being the place of item i: by round(i), 0 .. 2^14 - 1, and
// each round along the curve through a grid of 2^bits by 2^bits cells.
template <int bits, class PointOf, class RoundOf>
std::vector<Ranked> order_in_rounds(std::size_t n, PointOf point, RoundOf round) {
    if (n == 0) return {};
    Point low = point(0), high = low;
    for (std::size_t i = 1; i < n; ++i) {
        Point p = point(i);
        low = {std::min(low.x, p.x), std::min(low.y, p.y)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
    double extent = std::max(high.x - low.x, high.y - low.y);
    double scale = extent > 0 ? ((1U << bits) - 1) / extent : 0;
    std::vector<Ranked> order(n);
    for (std::size_t i = 0; i < n; ++i) {
        Point p = point(i);
        auto x = static_cast<std::uint32_t>((p.x - low.x) * scale);
        auto y = static_cast<std::uint32_t>((p.y - low.y) * scale);
        order[i] = {round(i) << 2 * bits | hilbert(x, y, bits), static_cast<Index>(i)};
    }
    radix_sort(order);
    return order;
}

// The order of insertion: biased randomised.
template <class PointOf>
std::vector<Ranked> insertion_order(std::size_t n, PointOf point) {
    if (n == 1) return {{0, 0}};
    return order_in_rounds<25>(n, point, [](std::size_t i) {
        std::uint64_t draw = mix(i), round = 31;  // 32 rounds: a quarter of a quarter of ...
        for (; round > 0 && (draw & 3) == 0; draw >>= 2) --round;
        return round;
    });
}

// All along the curve, as cells of a coarse grid come.
template <class PointOf>
std::vector<Ranked> curve_order(std::size_t n, PointOf point) {
    return order_in_rounds<11>(n, point, [](std::size_t) { return std::uint64_t{0}; });
}

}  // namespace flintknap
