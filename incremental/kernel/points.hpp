// The set of points as its users know it: ids, multiplicities, and which are not yet placed.
//
// Theory. A point gets an id on its first arrival, counting up from 0 and never used again, and a
// slot in the triangulation when a query needs it; until then it waits. Inside, a point that is
// alive has a handle, which is used again. Equal points are found by a hash table of handles with
// linear probing, whose entries carry 32 bits of the hash, so that a look-up touches coordinates
// only where it will most likely find them equal; entries behind a removed one move up, so there
// are no tombstones.
//
// Invariants (check): each point is found under its coordinates and under its id; it either has a
// slot, which knows its handle, or waits.
// Cost: O(1) expected a point; about 44 bytes a point, 24 more while it waits.
#pragma once

#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "archive.hpp"
#include "ids.hpp"
#include "order.hpp"
#include "triangulation.hpp"

namespace flintknap {

class Points {
   public:
    // Half-edges are numbered with 31 bits, eight numbers to a point.
    static constexpr std::size_t kMost = (1ULL << 31) / 8 - 8;

    struct Waiting {
        Point point;
        Index handle;
    };

    Points(const Triangulation& triangulation, std::int64_t next_id, std::int64_t revision)
        : t_(triangulation), ids_(next_id), revision_(revision) {}

    std::size_t size() const { return points_.size() - free_.size(); }
    // How many times the set has changed.
    std::int64_t revision() const { return revision_; }
    // How many steps were taken on points and their multiplicities.
    std::int64_t steps() const { return steps_; }
    const Array<Waiting>& waiting() const { return waiting_; }
    std::vector<std::int64_t> ids() const { return ids_.all(); }
    std::int64_t next_id() const { return ids_.next(); }

    // The handle of the point with an id, or kNone.
    Index find(std::int64_t id) const { return ids_.find(id); }
    // The handle of the point at p, or kNone.
    Index find(Point p) const { return table_.empty() ? kNone : table_[find(p, hash(p))].handle; }
    std::int64_t id(Index handle) const { return at_handle(handle).id; }
    std::int64_t id_in_slot(Index slot) const { return at_handle(handle_of_[at(slot)]).id; }
    // The same for n slots at once, each fetched ahead of its use.
    template <class SlotOf>
    void ids_in_slots(std::size_t n, SlotOf slot_of, std::int64_t* ids) const {
        constexpr std::size_t ahead = 16;
        Index handles[ahead];
        for (std::size_t i = 0; i < n + 2 * ahead; ++i) {
            if (i >= 2 * ahead) ids[i - 2 * ahead] = at_handle(handles[i % ahead]).id;
            if (i >= ahead && i < n + ahead) {
                handles[i % ahead] = handle_of_[at(slot_of(i - ahead))];
                __builtin_prefetch(&points_[at(handles[i % ahead])]);
            }
            if (i < n) __builtin_prefetch(&handle_of_[at(slot_of(i))]);
        }
    }
    // The slot of a point that is placed, negative while it waits.
    Index slot(Index handle) const { return at_handle(handle).slot; }
    Index multiplicity(Index handle) const { return at_handle(handle).multiplicity; }
    Point point(Index handle) const {
        Index s = slot(handle);
        return s >= 0 ? t_.site(s) : waiting_[at(~s)].point;
    }

    // Room for n more, found before anything is changed.
    void make_room(std::size_t n) {
        std::size_t need = points_.size() + n;
        if (size() + n > kMost) throw std::length_error("more points than the kernel can number");
        points_.reserve(need);
        handle_of_.reserve(need);
        free_.reserve(need);
        waiting_.reserve(waiting_.size() + n);
        ids_.make_room(n);
        if (4 * (size() + n) > 3 * table_.size()) rehash(size() + n);
    }

    // The id of a point, new or old. make_room first.
    std::int64_t add(Point p) { return add(p, hash(p)); }

    // The same for n points at once; the table is fetched ahead of its use.
    template <class PointOf>
    void add(std::size_t n, PointOf point, std::int64_t* ids) {
        constexpr std::size_t ahead = 16;
        std::uint32_t hashes[ahead];
        for (std::size_t i = 0; i < n + ahead; ++i) {
            if (i >= ahead) ids[i - ahead] = add(point(i - ahead), hashes[i % ahead]);
            if (i < n) {
                hashes[i % ahead] = hash(point(i));
                __builtin_prefetch(&table_[home(hashes[i % ahead])]);
            }
        }
    }

    // Takes one away from a point's multiplicity, which is more than one.
    void take_one(Index handle) {
        --points_[at(handle)].multiplicity;
        ++steps_;
    }

    // Removes a point. Its slot, if it has one, is the triangulation's business, and still names
    // its coordinates.
    void remove(Index handle) {
        Point p = point(handle);
        unlink(find(p, hash(p)));
        ids_.remove(at_handle(handle).id);
        Index s = slot(handle);
        if (s < 0) {
            waiting_[at(~s)] = waiting_.back();
            points_[at(waiting_.back().handle)].slot = s;
            waiting_.pop_back();
        }
        points_[at(handle)].multiplicity = 0;
        free_.push_back(handle);
        ++revision_;
        ++steps_;
    }

    // Moves a point to a place where none is. make_room first; its slot as in remove.
    void move(Index handle, Point p) {
        Point from = point(handle);
        unlink(find(from, hash(from)));
        Known& known = points_[at(handle)];
        if (known.slot >= 0) {
            known.slot = ~static_cast<Index>(waiting_.size());
            waiting_.push_back({p, handle});
        } else {
            waiting_[at(~known.slot)].point = p;
        }
        table_[find(p, hash(p))] = {hash(p), handle};
        ++revision_;
        ++steps_;
    }

    // Notes that some of those that wait have slots now.
    void placed(const Waiting* which, const Index* slots, std::size_t count) {
        if (count == 0) return;
        std::size_t end = at(*std::max_element(slots, slots + count)) + 1;
        if (handle_of_.size() < end) handle_of_.resize(end);
        for (std::size_t i = 0; i < count; ++i) {
            points_[at(which[i].handle)].slot = slots[i];
            handle_of_[at(slots[i])] = which[i].handle;
        }
    }

    // Drops from those that wait the ones that have been placed.
    void drop_placed() {
        std::size_t left = 0;
        for (const Waiting& w : waiting_) {
            if (slot(w.handle) >= 0) continue;
            points_[at(w.handle)].slot = ~static_cast<Index>(left);
            waiting_[left++] = w;
        }
        waiting_.resize(left);
        if (left == 0 && waiting_.capacity() > 4096) Array<Waiting>().swap(waiting_);
    }

    // With nobody waiting.
    template <class Archive>
    void transfer(Archive& archive) {
        std::int64_t next = ids_.next();
        archive(next);
        archive(revision_);
        archive(table_);
        archive(points_);
        archive(free_);
        archive(handle_of_);
        if constexpr (std::is_same_v<Archive, Reader>) restore_ids(next);
    }

    std::size_t bytes() const {
        return table_.capacity() * sizeof(Entry) + waiting_.capacity() * sizeof(Waiting) +
               points_.capacity() * sizeof(Known) + ids_.bytes() +
               (handle_of_.capacity() + free_.capacity()) * sizeof(Index);
    }

    // The first broken invariant, or nothing. O(n).
    std::string check() const {
        std::size_t alive = 0, waiting = 0;
        for (std::int64_t id : ids_.all()) {
            Index h = find(id);
            Point p = point(h);
            std::string name = "point " + std::to_string(id);
            if (table_[find(p, hash(p))].handle != h) return name + " is not found where it is";
            if (at_handle(h).id != id) return name + " has another id";
            if (multiplicity(h) < 1) return name + " is not there at all";
            Index s = slot(h);
            if (s >= 0 ? handle_of_[at(s)] != h : waiting_[at(~s)].handle != h) {
                return name + " is not where its slot says";
            }
            ++alive;
            waiting += s < 0;
        }
        if (alive != size() || waiting != waiting_.size()) return "miscounted the points";
        return alive - waiting == at(t_.size()) ? "" : "the triangulation has other points";
    }

   private:
    struct Entry {
        std::uint32_t hash;
        Index handle;
    };
    struct Known {
        std::int64_t id;
        Index slot;  // ~(place among those that wait) while it waits
        Index multiplicity;
    };

    static std::uint32_t hash(Point p) {
        std::uint64_t x, y;
        std::memcpy(&x, &p.x, sizeof x);
        std::memcpy(&y, &p.y, sizeof y);
        return static_cast<std::uint32_t>(mix(x ^ mix(y)) >> 32);
    }

    const Known& at_handle(Index handle) const { return points_[at(handle)]; }

    // Where the search for a hash begins: its upper bits, the table's size being a power of two.
    std::size_t home(std::uint32_t hash) const {
        return static_cast<std::size_t>((std::uint64_t{hash} * table_.size()) >> 32);
    }
    std::size_t after(std::size_t n) const { return (n + 1) & (table_.size() - 1); }

    // The entry of p, or the empty one where it belongs.
    std::size_t find(Point p, std::uint32_t hash) const {
        std::size_t n = home(hash);
        while (table_[n].handle != kNone &&
               !(table_[n].hash == hash && point(table_[n].handle) == p)) {
            n = after(n);
        }
        return n;
    }

    std::int64_t add(Point p, std::uint32_t hash) {
        Entry& e = table_[find(p, hash)];
        if (e.handle == kNone) {
            e = {hash, static_cast<Index>(points_.size())};
            if (free_.empty()) {
                points_.push_back({});
            } else {
                e.handle = free_.back();
                free_.pop_back();
            }
            points_[at(e.handle)] = {ids_.add(e.handle), ~static_cast<Index>(waiting_.size()), 0};
            waiting_.push_back({p, e.handle});
            ++revision_;
        }
        Known& known = points_[at(e.handle)];
        ++known.multiplicity;
        ++steps_;
        return known.id;
    }

    void restore_ids(std::int64_t next) {
        std::int64_t first = next;
        for (const Known& k : points_) {
            if (k.multiplicity > 0) first = std::min(first, k.id);
        }
        ids_ = Ids(first, next);
        for (std::size_t h = 0; h < points_.size(); ++h) {
            if (points_[h].multiplicity > 0) ids_.restore(points_[h].id, static_cast<Index>(h));
        }
    }

    // Empties entry n and moves up those behind it that would not be found past a gap.
    void unlink(std::size_t n) {
        for (std::size_t m = after(n); table_[m].handle != kNone; m = after(m)) {
            std::size_t mask = table_.size() - 1, from = home(table_[m].hash);
            if (((m - from) & mask) < ((m - n) & mask)) continue;  // its search begins behind n
            table_[n] = table_[m];
            n = m;
        }
        table_[n].handle = kNone;
    }

    void rehash(std::size_t need) {
        std::size_t room = 16;
        while (4 * need > 3 * room) room *= 2;
        Array<Entry> old(room, Entry{0, kNone});
        table_.swap(old);
        for (const Entry& e : old) {
            if (e.handle == kNone) continue;
            std::size_t n = home(e.hash);
            while (table_[n].handle != kNone) n = after(n);
            table_[n] = e;
        }
    }

    const Triangulation& t_;
    Ids ids_;
    Array<Entry> table_;
    Array<Known> points_;     // by handle
    Array<Index> free_;       // handles not in use
    Array<Index> handle_of_;  // by slot
    Array<Waiting> waiting_;
    std::int64_t revision_, steps_ = 0;
};

}  // namespace flintknap
