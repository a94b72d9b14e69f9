// A priority queue of four children a node: half as deep as a binary one, and the children of a
// node mostly share a cache line. Those of all four are fetched while one of the four is chosen.
//
// What comes before all there is when it is pushed is often popped next: it stays outside the tree
// until another one comes before it.
//
// Before(a, b) says whether a comes before b; the first to come is on top.
// Cost: push O(log4 n), pop O(4 log4 n) comparisons, two for what is first and popped next.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace flintknap {

template <class T, class Before>
class Heap {
   public:
    explicit Heap(Before before) : before_(before) {}

    bool empty() const { return !has_first_ && items_.empty(); }
    std::size_t size() const { return items_.size() + (has_first_ ? 1 : 0); }
    void clear() {
        items_.clear();
        has_first_ = false;
    }
    const T& top() const { return has_first_ ? first_ : items_.front(); }

    void push(const T& item) {
        if (has_first_) {
            if (!before_(item, first_)) return put(item);
            put(first_);
        } else if (!items_.empty() && !before_(item, items_.front())) {
            return put(item);
        }
        first_ = item;
        has_first_ = true;
    }

    T pop() {
        if (has_first_) {
            has_first_ = false;
            return first_;
        }
        T first = items_.front(), last = items_.back();
        items_.pop_back();
        if (!items_.empty()) sink(0, items_.size(), last);
        return first;
    }

   private:
    void put(const T& item) {
        items_.push_back(item);
        std::size_t n = items_.size() - 1;
        for (; n > 0 && before_(item, items_[(n - 1) / 4]); n = (n - 1) / 4) {
            items_[n] = items_[(n - 1) / 4];
        }
        items_[n] = item;
    }

    // Puts an item at n or below.
    void sink(std::size_t n, std::size_t size, const T& item) {
        for (std::size_t child = 4 * n + 1; child < size; child = 4 * n + 1) {
            fetch(4 * child + 1);
            std::size_t best = child + 4 <= size ? first_of_four(child) : first_of(child, size);
            if (!before_(items_[best], item)) break;
            items_[n] = items_[best];
            n = best;
        }
        items_[n] = item;
    }

    // Which of four is the first nobody can foresee, so there is no branch.
    std::size_t first_of_four(std::size_t i) const {
        std::size_t a = i + (before_(items_[i + 1], items_[i]) ? 1U : 0U);
        std::size_t b = i + 2 + (before_(items_[i + 3], items_[i + 2]) ? 1U : 0U);
        return a + (b - a) * (before_(items_[b], items_[a]) ? 1U : 0U);
    }
    std::size_t first_of(std::size_t i, std::size_t end) const {
        std::size_t best = i;
        while (++i < end) {
            if (before_(items_[i], items_[best])) best = i;
        }
        return best;
    }

    // Fetches the children of four nodes, from their first one on.
    [[gnu::always_inline]] void fetch(std::size_t first) const {
        constexpr std::size_t children = 16, line = sizeof(T) < 64 ? 64 / sizeof(T) : 1;
        if (first + children > items_.size()) return;
        for (std::size_t i = 0; i < children; i += line) __builtin_prefetch(&items_[first + i]);
        __builtin_prefetch(&items_[first + children - 1]);
    }

    Before before_;
    T first_{};  // comes before all items, if there is one
    bool has_first_ = false;
    std::vector<T> items_;
};

}  // namespace flintknap
