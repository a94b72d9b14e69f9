// Which event removed which triangle, and the ring that follows: the run from scratch.
//
// Theory (section 3.1). From the hull inward, the gate with the smallest key whose apex is not on
// the ring yet is removed; its apex joins the ring and two gates open behind it. That is a
// priority-first search, and the forest it makes is the only one in which every site off the hull
// is captured by the earliest open gate that points at it, with the times of forest.hpp.
//
// Each vertex on the ring knows the one that follows it:
//
//      i -----> j            i       j       the ring runs counter-clockwise, the object on its
//       \ gate /     ==>      \     /        left; the removed triangle i, j, k lies outside
//        \    /                v   ^
//          k                     k
//
// Invariants (check): the events are those of a run from scratch; following() runs along the
// edges between triangles that are left and those that are not.
// Cost: build O(n log n); all else O(1).
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "openings.hpp"

namespace flintknap {

class Captures {
   public:
    explicit Captures(const Triangulation& triangulation)
        : t_(triangulation), forest_(triangulation) {}

    // Whether triangle x belongs to the object: it is no ghost and was not removed.
    bool is_inside(Index x) const { return event_of_[at(x)] < 0; }
    bool on_ring(Index v) const { return holder_[at(v)] != kNone; }
    Index following(Index v) const { return following_[at(v)]; }
    [[gnu::always_inline]] void prefetch_following(Index v) const {
        __builtin_prefetch(&following_[at(v)]);
    }
    Index left_inside() const { return left_inside_; }

    // The gates f(edge) that were taken, in order of time.
    template <class F>
    void visit_gates(F&& f) const {
        forest_.visit([&](Index e) { f(forest_.edge(e)); });
    }

    // From scratch.
    void build() {
        const Mesh& m = t_.mesh();
        forest_.clear(at(m.vertices()));
        event_of_.assign(at(m.triangles()), kNone);
        holder_.assign(at(m.vertices()), kNone);
        following_.assign(at(m.vertices()), kNone);
        left_inside_ = t_.size();
        Openings openings(t_);
        std::vector<Index> hull = t_.hull();
        for (Index h : hull) {
            event_of_[at(Mesh::triangle(m.twin(h)))] = Forest::kRoot;
            hold(m.origin(h), Forest::kRoot);
            following_[at(m.origin(h))] = m.target(h);
        }
        for (Index h : hull) {
            if (!on_ring(m.apex(h))) openings.push(opening(h));
        }
        auto fetch = [&](const Opening& o) { prefetch(o); };
        auto is_good = [&](const Opening& o) {
            if (on_ring(o.apex)) return false;
            prefetch_behind(o.edge);
            return true;
        };
        while (openings.any(fetch, is_good)) {
            Opening next = openings.pop();
            while (!on_ring(next.apex)) next = step(next, openings);
        }
    }

    template <class Archive>
    void transfer(Archive& archive) {
        forest_.transfer(archive);
        archive(event_of_);
        archive(holder_);
        archive(following_);
        archive(left_inside_);
    }

    std::size_t bytes() const {
        return forest_.bytes() +
               (event_of_.capacity() + holder_.capacity() + following_.capacity()) * sizeof(Index);
    }

    // The first broken invariant, or nothing. O(n log n).
    std::string check() const {
        const Mesh& m = t_.mesh();
        std::string broken = forest_.check();
        if (!broken.empty()) return broken;
        Captures other(t_);
        other.build();
        std::vector<Index> gates, others;
        visit_gates([&](Index edge) { gates.push_back(edge); });
        other.visit_gates([&](Index edge) { others.push_back(edge); });
        if (gates != others) return "from scratch, other gates are taken, or in another order";
        for (Index x = 0; x < m.triangles(); ++x) {
            Index here = event_of_[at(x)], there = other.event_of_[at(x)];
            Index edge = here == kNone ? kNone : forest_.edge(here);
            Index wanted = there == kNone ? kNone : other.forest_.edge(there);
            if (edge != wanted) {
                return "triangle " + std::to_string(x) + " was entered through " +
                       std::to_string(edge) + ", from scratch through " + std::to_string(wanted);
            }
            if (m.is_free(x)) continue;
            if (m.is_ghost(x) != (here == Forest::kRoot)) {
                return "triangle " + std::to_string(x) + " is wrong about being a ghost";
            }
            if (edge != kNone && holder_[at(m.apex(edge))] != here) {
                return "event " + std::to_string(here) + " does not hold its apex";
            }
        }
        for (Index v = 0; v < m.vertices(); ++v) {
            if (!t_.is_site(v)) continue;
            if (on_ring(v) != other.on_ring(v)) {
                return "vertex " + std::to_string(v) + (on_ring(v) ? " is" : " is not") +
                       " on the ring, from scratch it is otherwise";
            }
            if (on_ring(v) && following(v) != other.following(v)) {
                return "vertex " + std::to_string(v) + " is followed by " +
                       std::to_string(following(v)) + ", from scratch by " +
                       std::to_string(other.following(v));
            }
        }
        return left_inside_ == other.left_inside_ ? "" : "miscounted the vertices left inside";
    }

   protected:
    // Of a triangle that is in the object again, since its event has ended in a repair.
    static constexpr Index kReturned = kNone - 1;

    // The event that entered its triangle through `edge`, or kNone.
    Index entered_through(Index edge) const {
        Index e = event_of_[at(Mesh::triangle(edge))];
        return e >= 0 && forest_.edge(e) == edge ? e : kNone;
    }

    // The event through which gate `edge` stands open, the root beyond a hull edge; or kNone.
    Index opener(Index edge) const {
        Index o = t_.mesh().twin(edge), e = event_of_[at(Mesh::triangle(o))];
        return e >= 0 && forest_.edge(e) != o ? e : kNone;
    }

    Opening opening(Index edge) const {
        return {make_gate(t_, edge).key, edge, t_.mesh().apex(edge)};
    }

    // Fetches the triangles that gates lead to behind a gate.
    [[gnu::always_inline]] void prefetch_behind(Index edge) const {
        const Mesh& m = t_.mesh();
        m.prefetch(m.twin(Mesh::next(edge)));
        m.prefetch(m.twin(Mesh::prev(edge)));
    }

    void hold(Index v, Index event) {
        if (holder_[at(v)] == kNone) --left_inside_;
        holder_[at(v)] = event;
    }

    const Triangulation& t_;
    Forest forest_;
    // By triangle: the event that removed it, or kNone, or kReturned; the root of a ghost.
    Array<Index> event_of_;
    Array<Index> holder_;     // by vertex: the event that captured it, the root, or kNone
    Array<Index> following_;  // by vertex on the ring: the next one along it
    Index left_inside_ = 0;   // vertices without a holder

   private:
    // Fetches what taking the opening will need first.
    [[gnu::always_inline]] void prefetch(const Opening& opening) const {
        __builtin_prefetch(&holder_[at(opening.apex)]);
        __builtin_prefetch(&event_of_[at(Mesh::triangle(opening.edge))]);
        t_.mesh().prefetch(opening.edge);
    }
    // Takes the opening, which is the smallest of all, and opens the gates behind it. One that is
    // smaller still is the next to take and need not pass through the others.
    Opening step(Opening taken, Openings& openings) {
        const Mesh& m = t_.mesh();
        Index edge = taken.edge, k = taken.apex;
        prefetch_behind(edge);
        Index e = forest_.append(taken.gate(), opener(edge));
        event_of_[at(Mesh::triangle(edge))] = e;
        hold(k, e);
        following_[at(m.origin(edge))] = k;
        following_[at(k)] = m.target(edge);
        Opening next = taken;  // stays so if nothing smaller opens
        for (Index side : {Mesh::next(edge), Mesh::prev(edge)}) {
            Index behind = m.twin(side);
            if (on_ring(m.apex(behind))) continue;
            prefetch_behind(behind);
            Opening opened = opening(behind);
            if (smaller(t_, opened.gate(), next.gate())) std::swap(next, opened);
            if (opened.edge == edge) continue;  // `taken` itself, displaced
            openings.push(opened);
        }
        return next;
    }
};

}  // namespace flintknap
