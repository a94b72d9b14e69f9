// An object as bytes and back: each structure names its arrays once, for both directions.
//
// The bytes are the arrays as they lie in memory, each after its length: little-endian, of the
// sizes this build has. A stamp in front tells builds that differ. Whether the bytes are those that
// were written, the file around them must tell (a checksum); this is no defence against forgery.
// Cost: O(bytes), a memory copy.
#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include "array.hpp"

namespace flintknap {

class Writer {
   public:
    explicit Writer(std::size_t expected) { bytes_.reserve(expected); }

    template <class T>
    void operator()(T& value) {
        static_assert(std::is_trivially_copyable_v<T>);
        append(&value, sizeof value);
    }
    template <class T>
    void operator()(std::vector<T>& values) {
        take_all(values);
    }
    template <class T>
    void operator()(Array<T>& values) {
        take_all(values);
    }
    std::vector<std::uint8_t> bytes() && { return std::move(bytes_); }

   private:
    template <class Values>
    void take_all(Values& values) {
        std::uint64_t count = values.size();
        (*this)(count);
        append(values.data(), count * sizeof(typename Values::value_type));
    }
    void append(const void* from, std::size_t size) {
        const auto* first = static_cast<const std::uint8_t*>(from);
        bytes_.insert(bytes_.end(), first, first + size);
    }

    std::vector<std::uint8_t> bytes_;
};

class Reader {
   public:
    Reader(const std::uint8_t* first, std::size_t size) : next_(first), left_(size) {}

    template <class T>
    void operator()(T& value) {
        static_assert(std::is_trivially_copyable_v<T>);
        take(&value, sizeof value);
    }
    template <class T>
    void operator()(std::vector<T>& values) {
        take_all(values);
    }
    template <class T>
    void operator()(Array<T>& values) {
        take_all(values);
    }
    bool at_end() const { return left_ == 0; }

   private:
    template <class Values>
    void take_all(Values& values) {
        std::uint64_t count = 0;
        constexpr std::size_t size = sizeof(typename Values::value_type);
        (*this)(count);
        if (count > left_ / size) throw std::invalid_argument("the bytes end too early");
        values.resize(count);
        take(values.data(), count * size);
    }
    void take(void* to, std::size_t size) {
        if (size > left_) throw std::invalid_argument("the bytes end too early");
        if (size > 0) std::memcpy(to, next_, size);
        next_ += size;
        left_ -= size;
    }

    const std::uint8_t* next_;
    std::size_t left_;
};

}  // namespace flintknap
