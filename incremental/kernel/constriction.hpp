// The object boundary: triangles are removed from outside until every site is on the ring.
//
// Theory (section 3.1). From the hull inward, the gate with the smallest key whose apex is not on
// the ring yet is removed; its apex joins the ring and two gates open behind it. That is a
// priority-first search, and the forest it makes is the only one in which every site off the hull
// is captured by the earliest open gate that points at it, with the times of forest.hpp. The same
// condition restores it after a change, as shortest paths are restored (Ramalingam and Reps 1996):
//
//   1. an event dies when its triangle or its hull edge goes, and all that hang from it die, too;
//   2. gates that opened anew, and those that point at sites thus freed, enter a heap by time;
//   3. the earliest gate is taken: if its target is held by an earlier event, nothing happens; if
//      by a later one, that dies with all that hang from it, freeing more sites; then the gate
//      captures its target and opens two more.
//
// Times leave the heap in order, so a capture made during a repair is final. Events that died stay
// in place until the repair ends, for their successors in the heap still compare by them.
//
// Each vertex on the ring knows the one that follows it:
//
//      i -----> j            i       j       the ring runs counter-clockwise, the object on its
//       \ gate /     ==>      \     /        left; the removed triangle i, j, k lies outside
//        \    /                v   ^
//          k                     k
//
// Links (links.hpp) learns which vertices are followed by others than before.
//
// Invariants (check): the events are those of a run from scratch; following() runs along the
// edges between triangles that are left and those that are not.
// Cost: build O(n log n); a repair O(touched log n), touched being the events that died or came.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "forest.hpp"
#include "heap.hpp"
#include "links.hpp"

namespace flintknap {

class Constriction {
   public:
    explicit Constriction(const Triangulation& triangulation) : t_(triangulation) {}

    // Whether triangle x belongs to the object: it is no ghost and was not removed.
    bool is_inside(Index x) const { return event_of_[at(x)] == kNone && !t_.mesh().is_ghost(x); }
    bool on_ring(Index v) const { return holder_[at(v)] != kNone; }
    Index following(Index v) const { return following_[at(v)]; }
    Index left_inside() const { return left_inside_; }
    Links& links() { return links_; }
    const Links& links() const { return links_; }
    // How many events have died or come in repairs so far.
    std::int64_t touched() const { return touched_; }

    // From scratch.
    void build() {
        const Mesh& m = t_.mesh();
        forest_.clear(at(m.vertices()));
        event_of_.assign(at(m.triangles()), kNone);
        holder_.assign(at(m.vertices()), kNone);
        following_.assign(at(m.vertices()), kNone);
        left_inside_ = t_.size();
        forget_changes();
        links_.touch_all();
        Openings heap(Sooner{*this});
        std::vector<Index> hull = t_.hull();
        for (Index h : hull) {
            hold(m.origin(h), Forest::kRoot);
            following_[at(m.origin(h))] = m.target(h);
        }
        for (Index h : hull) {
            if (!on_ring(m.apex(h))) heap.push(opening(h));
        }
        while (!heap.empty()) {
            Opening next = heap.pop();
            if (!heap.empty()) prefetch(heap.top());
            while (!on_ring(next.apex)) next = step(next, heap);
        }
    }

    // What a triangulation tells those who watch it. Call repair before anything is asked, and
    // forget_changes when all who want to know what has changed have seen it.
    void destroying(const std::vector<Index>& triangles) {
        const Mesh& m = t_.mesh();
        destroyed_.insert(destroyed_.end(), triangles.begin(), triangles.end());
        for (Index x : triangles) {
            if (!m.is_ghost(x)) {
                if (event_of_[at(x)] != kNone) kill(event_of_[at(x)]);
                continue;
            }
            Index h = m.twin(m.hull_edge(x)), e = event_of_[at(Mesh::triangle(h))];
            if (e != kNone && forest_.edge(e) == h) kill(e);
            for (Index v : {m.origin(h), m.target(h)}) {
                if (holder_[at(v)] == Forest::kRoot) release(v);
            }
        }
    }

    void created(const std::vector<Index>& triangles) {
        const Mesh& m = t_.mesh();
        event_of_.resize(at(m.triangles()), kNone);
        created_.insert(created_.end(), triangles.begin(), triangles.end());
        for (Index x : triangles) {
            if (!m.is_ghost(x)) continue;
            Index h = m.hull_edge(x);
            for (Index v : {m.origin(h), m.target(h)}) {
                if (holder_[at(v)] == Forest::kRoot) continue;
                if (on_ring(v)) kill(holder_[at(v)]);
                hold(v, Forest::kRoot);
            }
        }
    }

    // A site got slot v; to be said before created. Nobody holds it yet.
    void appeared(Index v) {
        holder_.resize(std::max(holder_.size(), at(v) + 1), kNone);
        following_.resize(holder_.size(), kNone);
        release(v);
        links_.touch(v);
    }

    // A site is gone, which nobody holds any more; to be said after destroying.
    void vanished() { --left_inside_; }

    void repair() {
        const Mesh& m = t_.mesh();
        for (Index x : created_) {
            if (m.is_free(x)) continue;  // gone again since
            if (m.is_ghost(x)) {
                offer(m.twin(m.hull_edge(x)));
            } else {
                for (Index side = 0; side < 3; ++side) offer(3 * x + side);
            }
        }
        offer_gates_of_freed();
        while (!heap_.empty()) {
            Candidate c = heap_.pop();
            Index edge = forest_.edge(c.event);
            if (!is_open(edge, c.parent) || holds_earlier(m.apex(edge), c.event)) {
                retired_.push_back(c.event);
                continue;
            }
            Index target = m.apex(edge), holder = holder_[at(target)];
            if (holder != kNone) kill(holder);
            event_of_[at(Mesh::triangle(edge))] = c.event;
            hold(target, c.event);
            ++touched_;
            changed_.push_back(Mesh::triangle(edge));
            offer_gates_of_freed();
            offer(m.twin(Mesh::next(edge)));
            offer(m.twin(Mesh::prev(edge)));
        }
        for (Index x : created_) mend_ring(x);
        for (Index x : changed_) mend_ring(x);
        for (Index v : loosened_) {
            if (!on_ring(v)) following_[at(v)] = kNone;  // so that it is told when it comes back
        }
        for (Index e : retired_) forest_.release(e);
        retired_.clear();
    }

    // What has changed since forget_changes: triangles that went and that came (some of which may
    // be gone again), some that left the object or joined it or did both, and vertices some of
    // which have no holder any more.
    const std::vector<Index>& destroyed() const { return destroyed_; }
    const std::vector<Index>& created() const { return created_; }
    const std::vector<Index>& changed() const { return changed_; }
    const std::vector<Index>& loosened() const { return loosened_; }

    void forget_changes() {
        destroyed_.clear();
        created_.clear();
        changed_.clear();
        loosened_.clear();
        freed_.clear();
        retired_.clear();
        heap_.clear();
    }

    // Between repairs only: changes in progress do not travel.
    template <class Archive>
    void transfer(Archive& archive) {
        forest_.transfer(archive);
        archive(event_of_);
        archive(holder_);
        archive(following_);
        archive(left_inside_);
        archive(touched_);
    }

    std::size_t bytes() const {
        return forest_.bytes() + links_.bytes() +
               (event_of_.capacity() + holder_.capacity() + following_.capacity()) * sizeof(Index);
    }

    // The first broken invariant, or nothing. O(n log n).
    std::string check() const {
        const Mesh& m = t_.mesh();
        Constriction other(t_);
        other.build();
        for (Index x = 0; x < m.triangles(); ++x) {
            Index here = event_of_[at(x)], there = other.event_of_[at(x)];
            Index edge = here == kNone ? kNone : forest_.edge(here);
            Index wanted = there == kNone ? kNone : other.forest_.edge(there);
            if (edge != wanted) {
                return "triangle " + std::to_string(x) + " was entered through " +
                       std::to_string(edge) + ", from scratch through " + std::to_string(wanted);
            }
            if (here != kNone && holder_[at(m.apex(edge))] != here) {
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

   private:
    struct Opening {
        double key;
        Index edge, apex;
        Gate gate() const { return {key, edge}; }
    };
    struct Candidate {
        Index event, parent;
    };
    struct Sooner {
        const Constriction& c;
        bool operator()(const Opening& a, const Opening& b) const {
            return smaller(c.t_, a.gate(), b.gate());
        }
        bool operator()(Candidate a, Candidate b) const {
            return c.forest_.earlier(c.t_, a.event, b.event);
        }
    };
    using Openings = Heap<Opening, Sooner>;

    Opening opening(Index edge) const {
        return {make_gate(t_, edge).key, edge, t_.mesh().apex(edge)};
    }

    // Fetches what taking the opening will need first.
    void prefetch(const Opening& opening) const {
        __builtin_prefetch(&holder_[at(opening.apex)]);
        __builtin_prefetch(&event_of_[at(Mesh::triangle(opening.edge))]);
        t_.mesh().prefetch(opening.edge);
    }

    // Takes the opening, which is the smallest of all, and opens the gates behind it. One that is
    // smaller still is the next to take and need not pass through the heap.
    Opening step(Opening taken, Openings& heap) {
        const Mesh& m = t_.mesh();
        Index edge = taken.edge, k = taken.apex;
        Index e = forest_.add(t_, taken.gate(), opener(edge));
        event_of_[at(Mesh::triangle(edge))] = e;
        hold(k, e);
        following_[at(m.origin(edge))] = k;
        following_[at(k)] = m.target(edge);
        Opening next = taken;  // stays so if nothing smaller opens
        for (Index side : {Mesh::next(edge), Mesh::prev(edge)}) {
            Index behind = m.twin(side);
            if (on_ring(m.apex(behind))) continue;
            Opening opened = opening(behind);
            if (smaller(t_, opened.gate(), next.gate())) std::swap(next, opened);
            if (opened.edge == edge) continue;  // `taken` itself, displaced
            heap.push(opened);
        }
        return next;
    }

    void hold(Index v, Index event) {
        if (holder_[at(v)] == kNone) --left_inside_;
        holder_[at(v)] = event;
    }
    void release(Index v) {
        holder_[at(v)] = kNone;
        ++left_inside_;
        freed_.push_back(v);
        loosened_.push_back(v);
    }

    // Ends an event and all that hang from it.
    void kill(Index event) {
        const Mesh& m = t_.mesh();
        doomed_.assign(1, event);
        while (!doomed_.empty()) {
            Index e = doomed_.back(), edge = forest_.edge(e);
            doomed_.pop_back();
            event_of_[at(Mesh::triangle(edge))] = kNone;
            changed_.push_back(Mesh::triangle(edge));
            retired_.push_back(e);
            ++touched_;
            release(m.apex(edge));
            for (Index side : {Mesh::next(edge), Mesh::prev(edge)}) {
                Index behind = m.twin(side), child = event_of_[at(Mesh::triangle(behind))];
                if (child != kNone && forest_.edge(child) == behind) doomed_.push_back(child);
            }
        }
    }

    // The event through which gate `edge` stands open, the root beyond a hull edge; or kNone.
    Index opener(Index edge) const {
        Index o = t_.mesh().twin(edge), x = Mesh::triangle(o);
        if (t_.mesh().is_ghost(x)) return Forest::kRoot;
        Index e = event_of_[at(x)];
        return e != kNone && forest_.edge(e) != o ? e : kNone;
    }

    bool is_open(Index edge, Index parent) const {
        return event_of_[at(Mesh::triangle(edge))] == kNone && opener(edge) == parent;
    }

    bool holds_earlier(Index v, Index event) const {
        Index h = holder_[at(v)];
        return h == Forest::kRoot || (h != kNone && forest_.earlier(t_, h, event));
    }

    // Puts the gate into the heap if it is open and its target is not held by an earlier event.
    void offer(Index edge) {
        Index parent = opener(edge), x = Mesh::triangle(edge);
        if (parent == kNone || event_of_[at(x)] != kNone || t_.mesh().is_ghost(x)) return;
        Index target = t_.mesh().apex(edge);
        if (holder_[at(target)] == Forest::kRoot) return;
        Index e = forest_.add(t_, make_gate(t_, edge), parent);
        if (holds_earlier(target, e)) {
            forest_.release(e);
            return;
        }
        heap_.push({e, parent});
    }

    void offer_gates_of_freed() {
        const Mesh& m = t_.mesh();
        for (Index v : freed_) {
            if (on_ring(v) || !t_.is_site(v)) continue;
            Index first = m.leaving(v), h = first;
            do {
                offer(Mesh::next(h));
                h = m.turn(h);
            } while (h != first);
        }
        freed_.clear();
    }

    // Sets the ring edges on the rim of a triangle that came, went or changed sides.
    void mend_ring(Index x) {
        const Mesh& m = t_.mesh();
        if (m.is_free(x)) return;
        bool inside = is_inside(x);
        for (Index h = 3 * x; h < 3 * x + 3; ++h) {
            Index o = m.twin(h);
            if (inside == is_inside(Mesh::triangle(o))) continue;
            Index edge = inside ? h : o, v = m.origin(edge);
            if (following(v) == m.target(edge)) continue;
            following_[at(v)] = m.target(edge);
            links_.touch(v);
        }
    }

    const Triangulation& t_;
    Forest forest_;
    std::vector<Index> event_of_;   // by triangle: the event that removed it, or kNone
    std::vector<Index> holder_;     // by vertex: the event that captured it, the root, or kNone
    std::vector<Index> following_;  // by vertex on the ring: the next one along it
    Index left_inside_ = 0;         // vertices without a holder
    std::int64_t touched_ = 0;
    Links links_;
    // A change in progress: triangles that went, that came, others that changed sides, vertices
    // that lost their holder, those of them whose gates are still to be offered, events to give
    // back at the end, events about to die, gates by time.
    std::vector<Index> destroyed_, created_, changed_, loosened_, freed_, retired_, doomed_;
    Heap<Candidate, Sooner> heap_{Sooner{*this}};
};

}  // namespace flintknap
