// A small map from indices to indices, for what concerns few of many.
//
// Theory. Linear probing in a table that is at most half full, for most keys that are asked for are
// not there; entries behind a removed one move up, so there are no tombstones. A key has one value,
// given by `put`, or several, given by `add`; one table is used in one of the two ways.
//
// Cost: O(1) expected a value, none at all while empty; 16 to 32 bytes an entry.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "mesh.hpp"

namespace flintknap {

class Table {
   public:
    bool empty() const { return size_ == 0; }
    // Fetches where the values of a key are, if any. Not of an empty table.
    [[gnu::always_inline]] void prefetch(Index key) const {
        __builtin_prefetch(entries_.data() + home(key));
    }

    // The value of a key, or kNone.
    Index operator[](Index key) const { return empty() ? kNone : entries_[place(key)].value; }

    void put(Index key, Index value) {
        make_room();
        Entry& e = entries_[place(key)];
        if (e.key == kNone) ++size_;
        e = {key, value};
    }

    void erase(Index key) {
        if (!empty() && entries_[place(key)].key == key) close(place(key));
    }

    void add(Index key, Index value) {
        make_room();
        std::size_t n = home(key);
        while (entries_[n].key != kNone) n = next(n);
        entries_[n] = {key, value};
        ++size_;
    }

    // One of the values of a key, which is there.
    void remove(Index key, Index value) {
        std::size_t n = home(key);
        while (entries_[n].key != key || entries_[n].value != value) n = next(n);
        close(n);
    }

    // All values of a key, appended.
    void collect(Index key, std::vector<Index>& values) const {
        if (empty()) return;
        for (std::size_t n = home(key); entries_[n].key != kNone; n = next(n)) {
            if (entries_[n].key == key) values.push_back(entries_[n].value);
        }
    }

    void clear() {
        entries_.clear();
        size_ = 0;
    }

    std::size_t bytes() const { return entries_.capacity() * sizeof(Entry); }

   private:
    struct Entry {
        Index key = kNone, value = kNone;
    };

    std::size_t mask() const { return entries_.size() - 1; }
    std::size_t next(std::size_t n) const { return (n + 1) & mask(); }
    // Multiplied by the golden ratio, neighbours lie far apart; the middle bits are mixed best.
    std::size_t home(Index key) const {
        return static_cast<std::size_t>(at(key) * 0x9e3779b97f4a7c15ULL >> 32) & mask();
    }
    // Where the key is, or where it would go.
    std::size_t place(Index key) const {
        std::size_t n = home(key);
        while (entries_[n].key != key && entries_[n].key != kNone) n = next(n);
        return n;
    }

    // Empties a place; what lies behind it moves up unless it would come to lie before its home.
    void close(std::size_t hole) {
        --size_;
        for (std::size_t n = next(hole); entries_[n].key != kNone; n = next(n)) {
            std::size_t from_home = (n - home(entries_[n].key)) & mask();
            if (from_home < ((n - hole) & mask())) continue;
            entries_[hole] = entries_[n];
            hole = n;
        }
        entries_[hole] = Entry{};
    }

    void make_room() {
        if (2 * (size_ + 1) <= entries_.size()) return;
        Table larger;
        larger.entries_.resize(entries_.empty() ? 16 : 2 * entries_.size());
        for (const Entry& e : entries_) {
            if (e.key != kNone) larger.add(e.key, e.value);
        }
        std::swap(*this, larger);
    }

    std::vector<Entry> entries_;
    std::size_t size_ = 0;
};

}  // namespace flintknap
