// The object boundary through changes: what a change leaves as it was is kept.
//
// Theory (theorem 3). A set of events is the result of constriction iff no site is captured twice,
// each event is opened by its parent, and every open gate points at a site captured no later. A
// change of the triangulation breaks that here and there, and repair restores it:
//
//   1. An event dies when its triangle goes, or when its site is captured earlier. Those that hang
//      from it, or whose hull edge went, are *orphans*: they keep their places in the order.
//   2. Time runs from the root on. Gates that opened anew, and those that point at sites thus
//      freed, compete in a heap if the events that opened them have happened. Those that have not
//      wait, to offer their gates when they happen; and so do orphans, to be given a parent.
//   3. Next is the smallest gate, at its place after the present, or the first that waits. A gate
//      whose target is held before that is dropped; else it captures its target and opens two
//      more. An orphan to which no gate led by now is set adrift: it goes to the end of time,
//      where it waits again. If it is reached there, no gate has led to it at all, and it dies.
//      What goes adrift with many others may be a raft (rafts.hpp): gates into it come late.
//   4. Where a gate opens behind which an orphan stands, that is grafted (grafts.hpp): the event
//      that opened the gate is its parent now, and what hangs from it comes along.
//
// So gates are taken in ascending order of time, as in the restoration of shortest paths
// (Ramalingam and Reps 1996), and what has happened is final.
//
// Links (links.hpp) learns which vertices are followed by others than before.
//
// Invariants (check): those of captures.hpp.
// Cost: a repair O(log n) for each event that died, came, went adrift, or was offered anew after a
// graft, and each gate of them. It ends, for one that does more than a run from scratch would is
// given up for that.
#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "heap.hpp"
#include "links.hpp"
#include "rafts.hpp"

namespace flintknap {

class Constriction : public Rafts {
   public:
    using Rafts::Rafts;

    Links& links() { return links_; }
    const Links& links() const { return links_; }
    // How many events have died or come in repairs so far.
    std::int64_t touched() const { return touched_; }

    // From scratch.
    void build() {
        Captures::build();
        forget_changes();
        links_.touch_all();
    }

    // What a triangulation tells those who watch it. Call repair before anything is asked, and
    // forget_changes when all who want to know what has changed have seen it.
    void destroying(const Array<Index>& triangles) {
        const Mesh& m = t_.mesh();
        forest_.open();
        for (Index x : triangles) {
            destroyed_.push_back(x);
            if (!m.is_ghost(x)) {
                if (!is_inside(x)) bury(event_of_[at(x)]);
                event_of_[at(x)] = kNone;
                continue;
            }
            event_of_[at(x)] = kNone;
            Index h = m.twin(m.hull_edge(x)), e = entered_through(h);
            if (e != kNone) orphan(e);
            for (Index v : {m.origin(h), m.target(h)}) {
                if (holder_[at(v)] == Forest::kRoot) release(v);
            }
        }
    }

    void created(const Array<Index>& triangles) {
        const Mesh& m = t_.mesh();
        forest_.open();
        event_of_.resize(at(m.triangles()), kNone);
        for (Index x : triangles) {
            created_.push_back(x);
            if (!m.is_ghost(x)) continue;
            event_of_[at(x)] = Forest::kRoot;
            Index h = m.hull_edge(x);
            for (Index v : {m.origin(h), m.target(h)}) {
                if (holder_[at(v)] == Forest::kRoot) continue;
                if (on_ring(v)) bury(holder_[at(v)]);
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

    // Returns false if so much changes that a run from scratch is better, and needed then.
    [[nodiscard]] bool repair() {
        const Mesh& m = t_.mesh();
        std::int64_t enough = touched_ + t_.size();
        work_ = 0;
        forest_.open();
        forest_.set_now(Forest::kRoot);
        forget_place();
        for (const Array<Index>* triangles : {&created_, &returned_}) {
            for (Index x : *triangles) {
                if (m.is_free(x)) continue;  // gone again since
                if (m.is_ghost(x)) {
                    queue(m.twin(m.hull_edge(x)));
                } else {
                    queue_gates_into(x);
                }
            }
        }
        queue_gates_at_freed();
        do {
            if (touched_ + static_cast<std::int64_t>(work_ / kRatio) > enough) return false;
            for (std::size_t i = 0; i < queue_.size(); ++i) {
                fetch_ahead(i);
                offer(queue_[i]);
            }
            queue_.clear();
        } while (proceed());
        list_returned();
        mend_ring(created_);
        mend_ring(changed_);
        for (std::size_t i = 0; i < loosened_.size(); ++i) {
            if (i + 2 * kAhead < loosened_.size())
                __builtin_prefetch(&holder_[at(loosened_[i + 2 * kAhead])]);
            Index v = loosened_[i];
            if (!on_ring(v)) following_[at(v)] = kNone;  // so that it is told when it comes back
        }
        forest_.release(retired_);
        retired_.clear();
        return true;
    }

    // What has changed since forget_changes: triangles that went and that came (some of which may
    // be gone again), others that left the object or joined it, some of which did both, and
    // vertices some of which have no holder any more.
    const Array<Index>& destroyed() const { return destroyed_; }
    const Array<Index>& created() const { return created_; }
    const Array<Index>& changed() const { return changed_; }
    const Array<Index>& loosened() const { return loosened_; }

    void forget_changes() {
        destroyed_.clear();
        created_.clear();
        changed_.clear();
        returned_.clear();
        loosened_.clear();
        freed_.clear();
        retired_.clear();
        queue_.clear();
        open_.clear();
        leave();
    }

    // Between repairs only: changes in progress do not travel.
    template <class Archive>
    void transfer(Archive& archive) {
        Captures::transfer(archive);
        archive(touched_);
    }

    std::size_t bytes() const { return Captures::bytes() + links_.bytes(); }

   private:
    // Looking at an event again costs so much less than deriving it.
    static constexpr std::size_t kRatio = 8;

    void release(Index v) {
        holder_[at(v)] = kNone;
        ++left_inside_;
        freed_.push_back(v);
        loosened_.push_back(v);
    }

    // Ends an event. Those that hang from it are orphans.
    void kill(Index e) {
        Index edge = forest_.edge(e);
        visit_children(e, [&](Index child) { orphan(child); });
        event_of_[at(Mesh::triangle(edge))] = kReturned;
        returned_.push_back(Mesh::triangle(edge));
        release(t_.mesh().apex(edge));
        forest_.set_waiting(e, false);
        forest_.die(e);
        retired_.push_back(e);
        ++touched_;
    }

    // Ends one whose triangle goes, or may go by the next change.
    void bury(Index e) {
        kill(e);
        forest_.bury(e);
    }

    void orphan(Index e) {
        forest_.set_parent(e, kNone);
        forest_.set_waiting(e, true);
    }

    // Ends one whose triangle stays: its gates may be open again.
    void put_back(Index e) {
        if (is_on_raft(e)) offer_raft();
        queue_gates_into(Mesh::triangle(forest_.edge(e)));
        kill(e);
    }

    // Lets a gate compete for its target: now if the event that opened it has happened, else when
    // that happens. Gives an orphan behind it its parent.
    void offer(Index edge) {
        Index parent = opener(edge);
        if (parent == kNone) return;
        if (forest_.has_happened(parent)) return open(edge, parent);
        if (!is_inside(Mesh::triangle(edge))) {
            if (is_orphan_behind(edge) && !forest_.is_adrift(parent)) graft_behind(edge, parent);
            return;
        }
        Index holder = holder_[at(t_.mesh().apex(edge))];
        if (holder != kNone && forest_.earlier(holder, parent)) {
            if (!forest_.is_adrift(parent) || forest_.has_happened(holder)) return;
        }
        forest_.set_waiting(parent, true);
    }
    // The same for one that leads to a site of which the event is adrift.
    void offer_to_adrift(Index edge) {
        Index parent = opener(edge);
        if (parent == kNone) return;
        if (forest_.has_happened(parent)) {
            open_.push(opening(edge));
        } else {
            forest_.set_waiting(parent, true);
        }
    }
    // The same for a gate of an event that has happened.
    void open(Index edge, Index parent) {
        if (!is_inside(Mesh::triangle(edge))) {
            if (is_orphan_behind(edge)) graft_behind(edge, parent);
            return;
        }
        Index holder = holder_[at(t_.mesh().apex(edge))];
        if (holder != kNone && forest_.has_happened(holder)) return;
        prefetch_behind(edge);
        if (holder != kNone) forest_.prefetch(holder);
        open_.push(opening(edge));
    }
    void open_gates_of(Index e) {
        for (Index gate : gates_of(e)) open(gate, e);
    }

    bool is_orphan_behind(Index edge) const {
        Index e = entered_through(edge);
        return e != kNone && is_orphan(e);
    }
    void graft_behind(Index edge, Index parent) {
        forget_place();
        graft(entered_through(edge), parent);
    }

    // Fetches what the gates of which the i-th is next will look at.
    [[gnu::always_inline]] void fetch_ahead(std::size_t i) const {
        if ((i += kAhead) < queue_.size()) {
            Index o = t_.mesh().twin(queue_[i]), e = event_of_[at(Mesh::triangle(o))];
            if (e >= 0) forest_.prefetch(e);
        }
        if ((i += kAhead) < queue_.size()) {
            Index o = t_.mesh().twin(queue_[i]), v = t_.mesh().apex(queue_[i]);
            __builtin_prefetch(&event_of_[at(Mesh::triangle(o))]);
            if (v != kGhost) __builtin_prefetch(&holder_[at(v)]);
        }
    }
    void queue_gates_at_freed() {
        for (Index v : freed_) {
            if (on_ring(v) || !t_.is_site(v)) continue;
            queue_gates_around(t_.mesh().leaving(v));
        }
        freed_.clear();
    }

    // Does what is to be done next: the smallest gate captures, or the first that waits is settled
    // or offers its gates. False if nothing is left to do.
    bool proceed() {
        while (!open_.empty() && !is_wanted(open_.top())) pop();
        Index e = has_raft() ? forest_.next(forest_.now()) : forest_.first_waiting();
        if (has_raft()) {
            if (starts_raft(e) && !is_orphan(e)) {
                leave();
                return true;
            }
            if (unload(open_.empty() ? forest_.key(e) : open_.top().key, e)) return true;
        }
        if (!open_.empty()) {
            Opening next = open_.top();
            Index place = place_of(next.gate());
            if (e == kNone || !forest_.earlier(e, place)) {
                pop();
                Index holder = holder_[at(next.apex)];
                if (holder == kNone || !forest_.earlier(holder, place)) capture(next, place);
                return true;
            }
        }
        if (e == kNone) return false;
        if (is_orphan(e)) {
            forest_.set_now(forest_.previous(forest_.is_adrift(e) ? Forest::kNever : e));
            settle(e);
            return true;
        }
        forest_.set_now(e);
        if (forest_.is_dead(e)) return true;
        if (forest_.waits(e)) {
            forest_.set_waiting(e, false);
            open_gates_of(e);
        } else {
            queue_gates_to_raft(e);
        }
        return true;
    }

    // The place of the gate that is next, which stays as long as that is next and nothing moves.
    Index place_of(Gate gate) {
        if (std::exchange(placed_, gate.edge) != gate.edge) {
            place_ = forest_.first_as_large(forest_.now(), gate);
        }
        return place_;
    }
    void forget_place() { placed_ = kNone; }
    void pop() {
        forget_place();
        open_.pop();
    }

    bool is_wanted(const Opening& next) const {
        Index holder = holder_[at(next.apex)];
        return is_inside(Mesh::triangle(next.edge)) &&
               (holder == kNone || !forest_.has_happened(holder));
    }

    void capture(const Opening& next, Index place) {
        const Mesh& m = t_.mesh();
        Index x = Mesh::triangle(next.edge), target = next.apex;
        for (Index side : {Mesh::next(next.edge), Mesh::prev(next.edge)}) {
            Index gate = m.twin(side), v = m.apex(gate);
            __builtin_prefetch(&event_of_[at(Mesh::triangle(gate))]);
            if (v != kGhost) __builtin_prefetch(&holder_[at(v)]);
        }
        forest_.prefetch_next();
        if (holder_[at(target)] != kNone) put_back(holder_[at(target)]);
        Index e = forest_.add(next.gate(), opener(next.edge), place);
        changed_.push_back_if(event_of_[at(x)] != kReturned, x);
        event_of_[at(x)] = e;
        forest_.set_now(e);
        hold(target, e);
        ++touched_;
        queue_gates_at_freed();
        open_gates_of(e);
    }

    // No gate led to an orphan by its time: it is set adrift, and ends if it is adrift.
    void settle(Index e) {
        forget_place();
        Index parent = opener(forest_.edge(e));
        if (parent != kNone && forest_.has_happened(parent)) return graft(e, parent);
        if (forest_.is_adrift(e)) {
            put_back(e);
            queue_gates_at_freed();
            return;
        }
        bool hangs = parent != kNone && forest_.is_adrift(parent);
        if (parent != kNone && !hangs) forest_.set_waiting(parent, true);
        set_adrift(e, hangs ? parent : kNone);
    }

    // Takes an orphan to the end of time, and with it what hangs from it up to the next orphan.
    // What else hangs from these becomes orphans; others may capture their sites meanwhile.
    void set_adrift(Index e, Index parent) {
        forest_.set_parent(e, parent);
        inside_.clear();
        Index end = end_of_run(e);
        auto run = forest_.cursor(e);
        do {
            inside_.push_back(run.event());
            if (Index next = run.ahead(2 * kAhead); next != kNone) forest_.prefetch(next);
            run.advance();
        } while (run.event() != end && !is_orphan(run.event()));
        Index after = parent == kNone ? Forest::kNever : parent;
        forest_.move(e, inside_.back(), forest_.first_as_large(after, forest_.gate(e)));
        for (std::size_t i = 0; i < inside_.size(); ++i) {
            fetch_events_ahead(inside_, i);
            if (forest_.is_dead(inside_[i])) continue;
            visit_children(inside_[i], [&](Index child) {
                if (!forest_.is_adrift(child)) orphan(child);
            });
        }
        work_ += inside_.size();
        if (board()) return;
        std::size_t queued = queue_.size();
        for (Index x : inside_) {
            if (!forest_.is_dead(x)) queue_gates_to(x);
        }
        for (std::size_t i = queued; i < queue_.size(); ++i) {
            fetch_ahead(i);
            offer_to_adrift(queue_[i]);
        }
        queue_.resize(queued);
        if (!has_raft()) return;
        for (Index x : inside_) {
            if (!forest_.is_dead(x)) queue_gates_to_raft(x);
        }
    }

    // Those of which the event ended have changed if no other one has come.
    void list_returned() {
        for (std::size_t i = 0; i < returned_.size(); ++i) {
            if (i + 2 * kAhead < returned_.size())
                __builtin_prefetch(&event_of_[at(returned_[i + 2 * kAhead])]);
            Index x = returned_[i];
            bool is_back = event_of_[at(x)] == kReturned;
            changed_.push_back_if(is_back, x);
            event_of_[at(x)] = chosen(is_back, kNone, event_of_[at(x)]);
        }
    }

    void mend_ring(const Array<Index>& triangles) {
        for (std::size_t i = 0; i < triangles.size(); ++i) {
            fetch_triangles_ahead(triangles, i);
            mend_ring(triangles[i]);
        }
    }
    // Fetches what will be asked for of those triangles of which the i-th is next.
    [[gnu::always_inline]] void fetch_triangles_ahead(const Array<Index>& triangles,
                                                      std::size_t i) const {
        const Mesh& m = t_.mesh();
        if ((i += kAhead) < triangles.size()) {
            Index h = Mesh::first(triangles[i]);
            for (Index side : {h, h + 1, h + 2}) {
                Index o = m.twin(side), v = m.origin(side);
                if (o >= 0) __builtin_prefetch(&event_of_[at(Mesh::triangle(o))]);
                if (v >= 0) __builtin_prefetch(&following_[at(v)]);
            }
        }
        if ((i += kAhead) < triangles.size()) {
            m.prefetch(Mesh::first(triangles[i]));
            __builtin_prefetch(&event_of_[at(triangles[i])]);
        }
    }
    // Sets the ring edges on the rim of a triangle that came, went or changed sides.
    void mend_ring(Index x) {
        const Mesh& m = t_.mesh();
        if (m.is_free(x)) return;
        bool inside = is_inside(x);
        for (Index h = Mesh::first(x); h < Mesh::first(x) + 3; ++h) {
            Index o = m.twin(h);
            bool is_on_ring = inside != is_inside(Mesh::triangle(o));
            Index edge = chosen(inside, h, o), v = chosen(is_on_ring, m.origin(edge), 0);
            Index next = chosen(is_on_ring, m.target(edge), following(v));
            if (following(v) == next) continue;
            following_[at(v)] = next;
            links_.touch(v);
        }
    }

    std::int64_t touched_ = 0;
    Links links_;
    // A change in progress: triangles that went, that came, others that changed sides, and those of
    // which the event ended; vertices that lost their holder, those of them whose gates are still
    // to be offered, dead events.
    Array<Index> destroyed_, created_, changed_, returned_, loosened_, freed_, retired_;
    Index placed_ = kNone, place_ = kNone;  // the gate whose place is known, and the place
    Heap<Opening, SmallerOpening> open_{SmallerOpening{t_}};  // gates of events that have happened
};

}  // namespace flintknap
