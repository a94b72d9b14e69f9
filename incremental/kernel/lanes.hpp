// Pairs of doubles that are treated alike by one instruction, and comparisons of many as bits.
//
// Compilers leave loops with floating-point comparisons alone, since those might trap; said in
// vectors, which GCC and Clang know on every machine, they take a quarter of the time. Each lane
// computes what the scalar would, bit for bit.
#pragma once

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace flintknap {

using Lanes = double __attribute__((vector_size(16)));
using Masks = std::int64_t __attribute__((vector_size(16)));  // of a comparison: all bits, or none

inline Lanes both(double v) { return Lanes{v, v}; }

inline Lanes load(const double* two) {
    Lanes v;
    std::memcpy(&v, two, sizeof v);
    return v;
}

inline Lanes chosen(Masks where, Lanes yes, Lanes no) {
    return Lanes((where & Masks(yes)) | (~where & Masks(no)));
}

// Masks as bits 0 and 1.
inline unsigned bits(Masks where) {
#if defined(__SSE2__)
    return static_cast<unsigned>(_mm_movemask_pd(reinterpret_cast<__m128d>(where)));
#else
    return static_cast<unsigned>((where[0] & 1) | (where[1] & 2));
#endif
}

inline Lanes magnitudes(Lanes v) { return Lanes(Masks(v) & Masks{INT64_MAX, INT64_MAX}); }

// Gathers masks of pairs 0, 1, .. 15 into bits 0 .. 31.
class Gathered {
   public:
    void add(int pair, Masks where) {
        Masks bits;
        std::memcpy(&bits, kBits.data() + 2 * pair, sizeof bits);
        sum_ |= where & bits;
    }
    std::int64_t bits() const { return sum_[0] | sum_[1]; }
    // Those set together with the next one.
    std::int64_t pairs() const { return bits() & (bits() >> 1); }

   private:
    static constexpr auto kBits = [] {
        std::array<std::int64_t, 32> bits = {};
        for (std::size_t i = 0; i < bits.size(); ++i) bits[i] = std::int64_t{1} << i;
        return bits;
    }();

    Masks sum_ = {0, 0};
};

// Sixteen bytes, and masks of them as bits 0 .. 15.
using Bytes = std::uint8_t __attribute__((vector_size(16)));
using ByteMasks = std::int8_t __attribute__((vector_size(16)));

inline Bytes sixteen(std::uint8_t v) { return Bytes{} + v; }

inline Bytes load_bytes(const std::uint8_t* first) {
    Bytes v;
    std::memcpy(&v, first, sizeof v);
    return v;
}

// By value: of std::min and std::max, compilers make branches where they are given names.
template <class T>
T smaller(T a, T b) {
    return a < b ? a : b;
}
template <class T>
T larger(T a, T b) {
    return a > b ? a : b;
}

inline std::uint32_t byte_bits(ByteMasks where) {
#if defined(__SSE2__)
    return static_cast<std::uint32_t>(_mm_movemask_epi8(reinterpret_cast<__m128i>(where)));
#else
    using Halves = std::uint64_t __attribute__((vector_size(16)));
    constexpr std::uint64_t ones = ~std::uint64_t{0} / 255;  // a product sums all bytes at the top
    constexpr std::int8_t top = -128;
    Halves h = Halves(where & ByteMasks{1, 2, 4, 8, 16, 32, 64, top, 1, 2, 4, 8, 16, 32, 64, top});
    return static_cast<std::uint32_t>(h[0] * ones >> 56 | h[1] * ones >> 56 << 8);
#endif
}

// The place of the lowest bit that is set.
inline int lowest(std::int64_t bits) {
    return __builtin_ctzll(static_cast<unsigned long long>(bits));
}

// Sixteen numbers of 32 bits, and comparisons of all with one as bits 0 .. 15.
class Sixteen {
   public:
    explicit Sixteen(const std::int32_t* first) {
        for (std::size_t i = 0; i < 4; ++i) std::memcpy(&four_[i], first + 4 * i, sizeof four_[i]);
    }
    std::uint32_t equal(std::int32_t v) const {
        return gathered([&](Fours f) { return f == v; });
    }
    std::uint32_t less(std::int32_t v) const {
        return gathered([&](Fours f) { return f < v; });
    }

   private:
    using Fours = std::int32_t __attribute__((vector_size(16)));

    template <class F>
    std::uint32_t gathered(F&& compare) const {
#if defined(__SSE2__)
        auto two = [&](std::size_t i) {
            return _mm_packs_epi32(reinterpret_cast<__m128i>(compare(four_[i])),
                                   reinterpret_cast<__m128i>(compare(four_[i + 1])));
        };
        return static_cast<std::uint32_t>(_mm_movemask_epi8(_mm_packs_epi16(two(0), two(2))));
#else
        std::uint32_t bits = 0;
        for (unsigned i = 0; i < 16; ++i) bits |= (compare(four_[i / 4])[i % 4] & 1U) << i;
        return bits;
#endif
    }

    std::array<Fours, 4> four_;
};

}  // namespace flintknap
