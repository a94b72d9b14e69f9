// What the ring was at earlier revisions, in notes about what has changed since.
//
// Theory. Just before the ring sequence is brought up to date, it still tells the links there were
// and the object tells those there will be. For each vertex that is now followed by another one, or
// has left, a note says who followed it; for each that has joined, that nobody did. So the first
// note about a vertex since some revision tells its link at that revision, no note that it is as it
// was, and the ring tells its link now. Of the two rings the parts that differ are
//
//      then    a -> p -> q -> b ===== c -> d        c is followed by d and d has followed c: not
//      now     a -> x -----> b ===== c -> d         told; `after` a and `before` b stands x
//
// a run from each vertex whose link has changed and whose predecessor's has not, through those with
// changed links, up to the first one whose link has not. All other vertices make up stretches, from
// the end of a run to the beginning of one, which are the same in both rings; their order may not
// be. Vertices are noted by their ids, for slots are used again. A vertex that moved counts as gone
// and come: the links into and out of it are changed ones.
//
// Nothing is noted before somebody asks. What there is of the past is bounded by a share of the
// ring: it is not worth telling what has changed where most has. Marks tell which note was the last
// at a revision; of a revision that has none (nobody looked at the ring then), or whose notes were
// given up, nothing is known.
//
// Cost: O(k log n) for k changed links, to note and to compare; 16 bytes a note. O(n) where the
// ring was made from scratch, as that itself was.
#pragma once

#include <algorithm>
#include <cstdint>
#include <new>
#include <string>
#include <vector>

#include "links.hpp"
#include "ring.hpp"

namespace flintknap {

using Id = std::int64_t;

class Notes {
   public:
    static constexpr Id kNobody = -1;

    // Vertices of the ring, from the first one after vertex `after` to the last before `before`.
    struct Run {
        Index after, before;
        std::size_t begin, end;  // among the fresh ones
    };
    // A vertex, and who followed it then; nobody if it was not on the ring.
    struct Link {
        Id id, was;
        bool is_moved;
    };
    // How the ring differs from what it was.
    struct Difference {
        bool is_known = false;      // else nothing is told but that
        std::vector<Run> runs;      // in order along the ring
        std::vector<Index> fresh;   // the vertices of all runs
        std::vector<Index> joined;  // those of them that were not on the ring
        std::vector<Id> left;       // ascending
        std::vector<Link> links;    // of all vertices with notes, by id
        Id follower(Id id) const { return find(links, id)->was; }
    };

    bool is_kept() const { return !marks_.empty(); }

    // The ring is up to date; from here on notes are made.
    void begin(std::int64_t revision) {
        forget();
        marks_.push_back({revision, 0});
    }
    void forget() noexcept {
        marks_.clear();
        notes_.clear();
        vacancies_.clear();
    }

    // The point with an id has left a slot; for another place if it was moved.
    void vacate(const Ring& ring, Index slot, Id id, bool is_moved) noexcept {
        if (!is_kept() || !(is_moved || ring.holds(slot))) return;
        if (vacancies_.size() >= most(ring)) return forget();
        try {
            vacancies_.push_back({slot, id, is_moved});
        } catch (const std::bad_alloc&) {
            forget();  // the point has left, whether or not anybody can be told
        }
    }

    // The ring is about to follow these links. Source: ring_size(), smallest(), on_ring(v),
    // following(v), id(v).
    template <class Source>
    void note(const Ring& ring, const Source& now, const Links& links, std::int64_t revision) {
        if (!is_kept() || marks_.back().revision == revision) return;
        try {
            if (ring.empty() || now.ring_size() == 0 || !note_changes(ring, now, links)) {
                begin(revision);
            } else {
                vacancies_.clear();
                marks_.push_back({revision, notes_.size()});
                drop_oldest(most(ring));
            }
        } catch (...) {
            forget();
            throw;
        }
    }

    // How the ring, which is up to date, differs from what it was. Source: slot_of(id), which is
    // negative for one that is nowhere, id(v), on_ring(v).
    template <class Source>
    Difference compare(std::int64_t since, const Ring& ring, const Source& now) const {
        Difference found;
        auto is_older = [](const Mark& m, std::int64_t revision) { return m.revision < revision; };
        auto mark = std::lower_bound(marks_.begin(), marks_.end(), since, is_older);
        if (mark == marks_.end() || mark->revision != since) return found;
        found.links = first_notes(mark->notes);
        std::vector<Changed> changed;
        for (const Link& link : found.links) {
            Index v = now.slot_of(link.id);
            bool is_on = v >= 0 && now.on_ring(v);
            if (!is_on && link.was != kNobody) found.left.push_back(link.id);
            if (!is_on) continue;
            Id next = now.id(ring.next(v));
            auto follower = find(found.links, next);
            bool is_same = link.was == next && !link.is_moved &&
                           (follower == found.links.end() || !follower->is_moved);
            if (!is_same) changed.push_back({v, link.was == kNobody});
        }
        found.is_known = find_runs(ring, changed, found);
        return found;
    }

    std::size_t bytes() const {
        return notes_.capacity() * sizeof(Note) + marks_.capacity() * sizeof(Mark) +
               vacancies_.capacity() * sizeof(Vacancy);
    }

    // The first broken invariant, or nothing.
    std::string check() const {
        for (std::size_t i = 0; i < marks_.size(); ++i) {
            if (marks_[i].notes > notes_.size()) return "a mark beyond the notes";
            if (i == 0) continue;
            if (marks_[i - 1].revision >= marks_[i].revision) return "marks are not in order";
            if (marks_[i - 1].notes > marks_[i].notes) return "notes are not in order";
        }
        return {};
    }

   private:
    static constexpr Id kMoved = -2;
    static constexpr std::size_t kLeast = 2048;

    struct Note {
        Id id, was;  // who followed it, kNobody or kMoved
    };
    struct Mark {
        std::int64_t revision;
        std::size_t notes;  // until then
    };
    struct Vacancy {
        Index slot;
        Id id;
        bool is_moved;
    };
    struct Changed {
        Index v;
        bool is_new;
        bool operator<(const Changed& other) const { return v < other.v; }
    };

    // Notes and marks that are kept; when there are more, all but half of them go.
    static std::size_t most(const Ring& ring) { return kLeast + at(ring.size()) / 4; }

    static std::vector<Link>::const_iterator find(const std::vector<Link>& links, Id id) {
        auto is_less = [](const Link& link, Id wanted) { return link.id < wanted; };
        auto place = std::lower_bound(links.begin(), links.end(), id, is_less);
        return place == links.end() || place->id == id ? place : links.end();
    }

    // ---------------------------------------------------------------- noting
    // The first of a slot is the one that the ring knows.
    std::vector<Vacancy>::const_iterator vacancy(Index slot) const {
        auto is_less = [](const Vacancy& each, Index wanted) { return each.slot < wanted; };
        auto found = std::lower_bound(vacancies_.begin(), vacancies_.end(), slot, is_less);
        return found == vacancies_.end() || found->slot == slot ? found : vacancies_.end();
    }
    bool is_vacated(Index v) const { return vacancy(v) != vacancies_.end(); }

    // False if there is too much to note, or no vertex has stayed. A vertex that left came after
    // one that stayed and is followed by another now, or after one that left, too.
    template <class Source>
    bool note_changes(const Ring& ring, const Source& now, const Links& links) {
        auto by_slot = [](const Vacancy& a, const Vacancy& b) { return a.slot < b.slot; };
        std::stable_sort(vacancies_.begin(), vacancies_.end(), by_slot);
        auto stays = [&](Index v) { return now.on_ring(v) && !is_vacated(v); };
        auto id_before = [&](Index v) {
            auto found = vacancy(v);
            return found == vacancies_.end() ? now.id(v) : found->id;
        };
        collect_touched(ring, now, links);
        std::size_t first = notes_.size(), limit = first + most(ring) / 2;
        for (Index v : touched_) {
            if (!ring.holds(v) || !stays(v)) continue;
            Index w = ring.next(v);
            if (now.following(v) == w && !is_vacated(w)) continue;
            notes_.push_back({now.id(v), id_before(w)});
            for (; !stays(w) && notes_.size() < limit; w = ring.next(w)) {
                notes_.push_back({id_before(w), id_before(ring.next(w))});
            }
            if (notes_.size() >= limit) return false;
        }
        std::size_t come = notes_.size();
        for (Index v : touched_) {
            if (!now.on_ring(v) || (ring.holds(v) && !is_vacated(v))) continue;
            notes_.push_back({now.id(v), kNobody});
            if (notes_.size() >= limit) return false;
        }
        bool is_all_new = come == first && notes_.size() > come;
        for (const Vacancy& each : vacancies_) {
            if (each.is_moved) notes_.push_back({each.id, kMoved});
        }
        return !is_all_new;
    }

    // Every vertex whose link may have changed, each once.
    template <class Source>
    void collect_touched(const Ring& ring, const Source& now, const Links& links) {
        touched_ = links.touched();
        if (links.all()) {
            Index v = ring.vertex(0);
            for (Index i = 0; i < ring.size(); ++i, v = ring.next(v)) touched_.push_back(v);
            v = now.smallest();
            for (Index i = 0; i < now.ring_size(); ++i, v = now.following(v)) touched_.push_back(v);
        } else {
            for (const Vacancy& each : vacancies_) {
                if (ring.holds(each.slot)) touched_.push_back(preceding(ring, each.slot));
            }
        }
        std::sort(touched_.begin(), touched_.end());
        touched_.erase(std::unique(touched_.begin(), touched_.end()), touched_.end());
    }

    static Index preceding(const Ring& ring, Index v) {
        Index n = ring.leaf_of(v), i = ring.place_in(n, v);
        if (i > 0) return ring.leaf(n).vertex[i - 1];
        n = ring.leaf_before(n);
        return ring.leaf(n).vertex[ring.node(n).count - 1];
    }

    void drop_oldest(std::size_t limit) {
        if (notes_.size() + marks_.size() <= limit) return;
        std::size_t first = marks_.size() - std::min(marks_.size(), limit / 4);
        while (first + 1 < marks_.size() && notes_.size() - marks_[first].notes > limit / 4)
            ++first;
        std::size_t gone = marks_[first].notes;
        notes_.erase(notes_.begin(), notes_.begin() + static_cast<std::ptrdiff_t>(gone));
        marks_.erase(marks_.begin(), marks_.begin() + static_cast<std::ptrdiff_t>(first));
        for (Mark& m : marks_) m.notes -= gone;
    }

    // ---------------------------------------------------------------- comparing
    // Of each vertex with notes from the given one on, what the first one says.
    std::vector<Link> first_notes(std::size_t from) const {
        std::vector<Note> notes(notes_.begin() + static_cast<std::ptrdiff_t>(from), notes_.end());
        auto by_id = [](const Note& a, const Note& b) { return a.id < b.id; };
        std::stable_sort(notes.begin(), notes.end(), by_id);
        std::vector<Link> links;
        for (std::size_t i = 0, j = 0; i < notes.size(); i = j) {
            Link link{notes[i].id, kMoved, false};
            for (; j < notes.size() && notes[j].id == link.id; ++j) {
                link.is_moved |= notes[j].was == kMoved;
                if (link.was == kMoved) link.was = notes[j].was;
            }
            if (link.was != kMoved) links.push_back(link);  // else it never was on the ring
        }
        return links;
    }

    // False if no vertex is where it was.
    static bool find_runs(const Ring& ring, std::vector<Changed>& changed, Difference& found) {
        std::sort(changed.begin(), changed.end());
        auto place = [&](Index v) {
            return std::lower_bound(changed.begin(), changed.end(), Changed{v, false});
        };
        auto is_changed = [&](Index v) {
            auto p = place(v);
            return p != changed.end() && p->v == v;
        };
        std::vector<Index> followers;
        for (const Changed& each : changed) followers.push_back(ring.next(each.v));
        std::sort(followers.begin(), followers.end());
        std::vector<std::pair<Index, Index>> starts;  // by rank
        for (const Changed& each : changed) {
            if (std::binary_search(followers.begin(), followers.end(), each.v)) continue;
            starts.emplace_back(ring.rank(each.v), each.v);
        }
        if (starts.empty()) return changed.empty();
        std::sort(starts.begin(), starts.end());
        for (auto [rank, v] : starts) {
            Run run{v, ring.next(v), found.fresh.size(), 0};
            for (; is_changed(run.before); run.before = ring.next(run.before)) {
                found.fresh.push_back(run.before);
                if (place(run.before)->is_new) found.joined.push_back(run.before);
            }
            run.end = found.fresh.size();
            found.runs.push_back(run);
        }
        return true;
    }

    std::vector<Note> notes_;
    std::vector<Mark> marks_;
    std::vector<Vacancy> vacancies_;  // since the ring was brought up to date
    std::vector<Index> touched_;
};

}  // namespace flintknap
