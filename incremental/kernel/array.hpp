// An array that may become large: a vector of plain values that grows without copying itself.
//
// Theory. A large block is mapped from the system, by itself. To grow, its pages are moved to where
// there is room for more: nothing is copied, the old block does not stand beside the new one, and
// pages never written take no memory. So it can afford to grow by an eighth, where a vector
// doubles; and what it gives back goes to the system, where the C library's heap would be left with
// holes. Small blocks, and where pages cannot be moved all, are allocated and copied.
//
// Exceptions: std::bad_alloc from whatever may grow, and then nothing has changed.
// Cost: O(1) amortised an item.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <new>
#include <type_traits>
#include <utility>

#ifdef __linux__
#include <sys/mman.h>
#endif
#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace flintknap {

constexpr std::align_val_t kLine{64};  // of a cache

// Gives what the C library's heap keeps in reserve back to the system, if it can. It takes a
// millisecond or so, and pages that are needed again must be provided anew: nothing for every day.
inline void give_back_reserve() {
#ifdef __GLIBC__
    malloc_trim(0);
#endif
}

// A block of `bytes` that holds what `block` of `old_bytes` held, which is given back: so a block
// grows, or comes to be (from nullptr, 0), or ends (0 bytes: nullptr).
inline void* reallocate(void* block, std::size_t old_bytes, std::size_t bytes) {
#ifdef __linux__
    constexpr std::size_t large = std::size_t{1} << 20;
#else
    constexpr std::size_t large = static_cast<std::size_t>(-1);
#endif
    void* made = nullptr;
#ifdef __linux__
    if (bytes >= large) {
        made = old_bytes >= large ? mremap(block, old_bytes, bytes, MREMAP_MAYMOVE)
                                  : mmap(nullptr, bytes, PROT_READ | PROT_WRITE,
                                         MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (made == MAP_FAILED) throw std::bad_alloc();
        if (old_bytes >= large) return made;
    }
#endif
    if (bytes > 0 && bytes < large) made = ::operator new(bytes, kLine);
    if (made != nullptr && block != nullptr) std::memcpy(made, block, old_bytes);
    if (old_bytes < large) {
        ::operator delete(block, kLine);
    } else {
#ifdef __linux__
        munmap(block, old_bytes);
#endif
    }
    return made;
}

template <class T>
class Array {
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);
    static_assert(alignof(T) <= std::size_t(kLine));

   public:
    using value_type = T;

    Array() = default;
    explicit Array(std::size_t size, const T& value = T()) { resize(size, value); }
    Array(Array&& other) noexcept { swap(other); }
    Array& operator=(Array&& other) noexcept {
        Array(std::move(other)).swap(*this);
        return *this;
    }
    ~Array() { reallocate(items_, capacity_ * sizeof(T), 0); }

    std::size_t size() const { return size_; }
    std::size_t capacity() const { return capacity_; }
    bool empty() const { return size_ == 0; }
    T* data() { return items_; }
    const T* data() const { return items_; }
    T* begin() { return items_; }
    const T* begin() const { return items_; }
    T* end() { return items_ + size_; }
    const T* end() const { return items_ + size_; }
    T& operator[](std::size_t n) { return items_[n]; }
    const T& operator[](std::size_t n) const { return items_[n]; }
    const T& front() const { return items_[0]; }
    T& back() { return items_[size_ - 1]; }
    const T& back() const { return items_[size_ - 1]; }

    // Room for `need` items in all, and some more: many small calls grow it a few times only.
    void reserve(std::size_t need) {
        if (need <= capacity_) return;
        std::size_t room = need + need / 8 + 4;
        items_ = static_cast<T*>(reallocate(items_, capacity_ * sizeof(T), room * sizeof(T)));
        capacity_ = room;
    }
    void push_back(const T& item) {
        if (size_ == capacity_) return grow_by(item);
        items_[size_++] = item;
    }
    // Adds an item, or does not: without a branch, for what nobody can foresee.
    void push_back_if(bool wanted, T item) {
        if (size_ == capacity_) make_room();
        items_[size_] = item;
        size_ += wanted ? 1 : 0;
    }
    void pop_back() { --size_; }
    void resize(std::size_t size, const T& value = T()) {
        reserve(size);
        if (size > size_) std::fill(items_ + size_, items_ + size, value);
        size_ = size;
    }
    void assign(std::size_t size, const T& value) {
        size_ = 0;
        resize(size, value);
    }
    void clear() { size_ = 0; }
    void swap(Array& other) noexcept {
        std::swap(items_, other.items_);
        std::swap(size_, other.size_);
        std::swap(capacity_, other.capacity_);
    }

   private:
    static constexpr std::size_t kSmall = 4096;  // bytes up to which it doubles

    // By themselves, so that what is done mostly is short where it stands.
    [[gnu::noinline]] void make_room() {
        reserve(size_ * sizeof(T) < kSmall ? 2 * size_ + 1 : size_ + 1);
    }
    [[gnu::noinline]] void grow_by(const T& item) {
        T kept = item;  // which may lie in here
        make_room();
        items_[size_++] = kept;
    }

    T* items_ = nullptr;
    std::size_t size_ = 0, capacity_ = 0;
};

}  // namespace flintknap
