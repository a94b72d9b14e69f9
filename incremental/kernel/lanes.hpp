// Pairs of doubles that are treated alike by one instruction, and comparisons of many as bits.
//
// Compilers leave loops with floating-point comparisons alone, since those might trap; said in
// vectors, which GCC and Clang know on every machine, they take a quarter of the time. Each lane
// computes what the scalar would, bit for bit.
#pragma once

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

// Four floats, and masks of fours 0, 4, .. 28 gathered into bits 0 .. 31.
using Fours = float __attribute__((vector_size(16)));
using FourMasks = std::int32_t __attribute__((vector_size(16)));

inline Fours fours(float v) { return Fours{v, v, v, v}; }

inline Fours load_four(const float* four) {
    Fours v;
    std::memcpy(&v, four, sizeof v);
    return v;
}

inline Fours magnitudes(Fours v) {
    return Fours(FourMasks(v) & FourMasks{INT32_MAX, INT32_MAX, INT32_MAX, INT32_MAX});
}

class GatheredFours {
   public:
    void add(int first, FourMasks where) { sum_ |= where & (FourMasks{1, 2, 4, 8} << first); }
    std::uint32_t bits() const {
        return static_cast<std::uint32_t>(sum_[0] | sum_[1] | sum_[2] | sum_[3]);
    }
    // Those set together with the next one.
    std::uint32_t pairs() const { return bits() & (bits() >> 1); }

   private:
    FourMasks sum_ = {0, 0, 0, 0};
};

// The place of the lowest bit that is set.
inline int lowest(std::int64_t bits) {
    return __builtin_ctzll(static_cast<unsigned long long>(bits));
}

}  // namespace flintknap
