// The set of points as its users know it: ids, multiplicities, and which are not yet placed.
//
// Theory. A point gets an id on its first arrival, counting up from 0, and a slot in the
// triangulation when a query needs it; until then it waits. Equal points are found by a hash table
// of ids with linear probing, whose entries carry 32 bits of the hash, so that a look-up touches
// coordinates only where it will most likely find them equal.
//
// Invariants (check): each id is found under its coordinates; an id either has a slot, which knows
// the id, or waits.
// Cost: O(1) expected a point; 28 bytes a point, 24 more while it waits.
#pragma once

#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "order.hpp"
#include "triangulation.hpp"

namespace flintknap {

class Points {
   public:
    // Six half-edges a point are numbered with 31 bits.
    static constexpr std::size_t kMost = (1ULL << 31) / 6 - 8;

    struct Waiting {
        Point point;
        Index id;
    };

    explicit Points(const Triangulation& triangulation) : t_(triangulation) {}

    std::size_t size() const { return slot_of_.size(); }
    const std::vector<Waiting>& waiting() const { return waiting_; }
    Index id(Index slot) const { return id_of_[at(slot)]; }
    // The slot of a point that is placed, negative while it waits.
    Index slot(Index id) const { return slot_of_[at(id)]; }
    Index multiplicity(Index id) const { return multiplicity_[at(id)]; }
    Point point(Index id) const {
        Index s = slot(id);
        return s >= 0 ? t_.site(s) : waiting_[at(~s)].point;
    }

    // Room for n more, found before anything is changed.
    void make_room(std::size_t n) {
        std::size_t need = size() + n;
        if (need > kMost) throw std::length_error("more points than the kernel can number");
        grow(slot_of_, need);
        grow(multiplicity_, need);
        grow(id_of_, need);
        grow(waiting_, waiting_.size() + n);
        if (4 * need > 3 * table_.size()) rehash(need);
    }

    // The id of a point, new or old. make_room first.
    Index add(Point p) { return add(p, hash(p)); }

    // The same for n points at once; the table is fetched ahead of its use.
    template <class PointOf>
    void add(std::size_t n, PointOf point, std::int64_t* ids) {
        constexpr std::size_t ahead = 16;
        std::uint32_t hashes[ahead];
        for (std::size_t i = 0; i < n + ahead; ++i) {
            if (i >= ahead) ids[i - ahead] = add(point(i - ahead), hashes[i % ahead]);
            if (i < n) {
                hashes[i % ahead] = hash(point(i));
                __builtin_prefetch(&table_[place(hashes[i % ahead])]);
            }
        }
    }

    // Notes that waiting()[item] now has the next slot.
    void place_next(Index item) {
        Index id = waiting_[at(item)].id;
        slot_of_[at(id)] = static_cast<Index>(id_of_.size());
        id_of_.push_back(id);
    }

    // Drops from those that wait the ones that have been placed.
    void drop_placed() {
        std::size_t left = 0;
        for (const Waiting& w : waiting_) {
            if (slot(w.id) >= 0) continue;
            slot_of_[at(w.id)] = ~static_cast<Index>(left);
            waiting_[left++] = w;
        }
        waiting_.resize(left);
        if (left == 0 && waiting_.capacity() > 4096) std::vector<Waiting>().swap(waiting_);
    }

    std::size_t bytes() const {
        return table_.capacity() * sizeof(Entry) + waiting_.capacity() * sizeof(Waiting) +
               (slot_of_.capacity() + id_of_.capacity() + multiplicity_.capacity()) * sizeof(Index);
    }

    // The first broken invariant, or nothing. O(n).
    std::string check() const {
        for (Index i = 0; at(i) < size(); ++i) {
            Point p = point(i);
            const Entry& e = table_[find(p, hash(p))];
            if (e.id != i) return "point " + std::to_string(i) + " is not found by its coordinates";
            Index s = slot(i);
            if (s >= 0 ? id(s) != i : waiting_[at(~s)].id != i) {
                return "point " + std::to_string(i) + " is not where its slot says";
            }
        }
        if (id_of_.size() + waiting_.size() != size()) return "slots and ids differ in number";
        return id_of_.size() == at(t_.size()) ? "" : "the triangulation has other slots";
    }

   private:
    struct Entry {
        std::uint32_t hash;
        Index id;
    };

    template <class T>
    static void grow(std::vector<T>& v, std::size_t need) {
        if (v.capacity() < need) v.reserve(std::max(need, 2 * v.size()));
    }

    static std::uint32_t hash(Point p) {
        std::uint64_t x, y;
        std::memcpy(&x, &p.x, sizeof x);
        std::memcpy(&y, &p.y, sizeof y);
        return static_cast<std::uint32_t>(mix(x ^ mix(y)) >> 32);
    }

    // The table's size is a power of two; the upper bits of the hash choose the place.
    std::size_t place(std::uint32_t hash) const {
        return static_cast<std::size_t>((std::uint64_t{hash} * table_.size()) >> 32);
    }

    // The entry of p, or the empty one where it belongs.
    std::size_t find(Point p, std::uint32_t hash) const {
        std::size_t n = place(hash);
        while (table_[n].id != kNone && !(table_[n].hash == hash && point(table_[n].id) == p)) {
            n = (n + 1) % table_.size();
        }
        return n;
    }

    Index add(Point p, std::uint32_t hash) {
        Entry& e = table_[find(p, hash)];
        if (e.id == kNone) {
            e = {hash, static_cast<Index>(size())};
            slot_of_.push_back(~static_cast<Index>(waiting_.size()));
            multiplicity_.push_back(0);
            waiting_.push_back({p, e.id});
        }
        ++multiplicity_[at(e.id)];
        return e.id;
    }

    void rehash(std::size_t need) {
        std::size_t room = 16;
        while (4 * need > 3 * room) room *= 2;
        std::vector<Entry> old(room, Entry{0, kNone});
        table_.swap(old);
        for (const Entry& e : old) {
            if (e.id == kNone) continue;
            std::size_t n = place(e.hash);
            while (table_[n].id != kNone) n = (n + 1) % room;
            table_[n] = e;
        }
    }

    const Triangulation& t_;
    std::vector<Entry> table_;
    std::vector<Index> slot_of_;       // by id; ~(place among those that wait) while it waits
    std::vector<Index> multiplicity_;  // by id
    std::vector<Index> id_of_;         // by slot
    std::vector<Waiting> waiting_;
};

}  // namespace flintknap
