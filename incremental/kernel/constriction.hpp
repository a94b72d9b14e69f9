// The object boundary through changes: what a change leaves as it was is kept.
//
// Theory (theorem 3). A set of events is the result of constriction iff no site is captured twice,
// each event is opened by its parent, and every open gate points at a site captured no later. A
// change of the triangulation breaks that here and there, and repair restores it:
//
//   1. An event dies when its triangle goes, or when its site is captured earlier. Those that hang
//      from it, or whose hull edge went, are *orphans*: they keep their places in the order, for
//      the dead stay in the forest until the repair ends.
//   2. Gates that opened anew, and those that point at sites thus freed, enter a heap by time.
//   3. The earliest of the heap and of the orphans is taken. A gate whose target is held by an
//      earlier event is dropped; else it captures its target and opens two more. An orphan dies: if
//      a gate led to it by now, it would be none.
//   4. Where a gate opens behind which an orphan stands, that is *grafted*: the event that opened
//      the gate is its parent now, and all that hangs from it comes along.
//
//      q           p          of what hangs from e, only those have another place in the order to
//       \    ==>    \         which no key leads that exceeds all keys on the two ways, from q
//        e           e        and from p up to where they meet; and only among others near by, in
//       / \         / \       the same sense (theory, 3.2). Those, or these if they are fewer, are
//                             offered anew.
//
// So times leave heap and orphans in ascending order, as in the restoration of shortest paths
// (Ramalingam and Reps 1996).
//
// Links (links.hpp) learns which vertices are followed by others than before.
//
// Invariants (check): those of captures.hpp.
// Cost: a repair O(touched log n), touched being the events that died or came, and O(1) each for
// those whose place in the order is written anew. It ends, for one that does more of either than
// there are sites is given up for a run from scratch.
#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "captures.hpp"
#include "links.hpp"

namespace flintknap {

class Constriction : public Captures {
   public:
    using Captures::Captures;

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
    void destroying(const std::vector<Index>& triangles) {
        const Mesh& m = t_.mesh();
        forest_.open();
        destroyed_.insert(destroyed_.end(), triangles.begin(), triangles.end());
        for (Index x : triangles) {
            if (!m.is_ghost(x)) {
                if (event_of_[at(x)] != kNone) kill(event_of_[at(x)]);
                continue;
            }
            Index h = m.twin(m.hull_edge(x)), e = entered_through(h);
            if (e != kNone) orphan(e);
            for (Index v : {m.origin(h), m.target(h)}) {
                if (holder_[at(v)] == Forest::kRoot) release(v);
            }
        }
    }

    void created(const std::vector<Index>& triangles) {
        const Mesh& m = t_.mesh();
        forest_.open();
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

    // Returns false if so much changes that a run from scratch is better, and needed then.
    bool repair() {
        const Mesh& m = t_.mesh();
        std::int64_t enough = touched_ + t_.size();
        work_ = 0;
        forest_.open();
        for (const std::vector<Index>* triangles : {&created_, &changed_}) {
            for (Index x : *triangles) {
                if (m.is_free(x)) continue;  // gone again since
                if (m.is_ghost(x)) {
                    waiting_.push_back(m.twin(m.hull_edge(x)));
                } else {
                    wait_for_gates_into(x);
                }
            }
        }
        wait_for_freed();
        do {
            if (touched_ + static_cast<std::int64_t>(work_ / kRatio) > enough) return false;
            for (std::size_t i = 0; i < waiting_.size(); ++i) offer(waiting_[i]);
            waiting_.clear();
        } while (proceed());
        for (Index x : created_) mend_ring(x);
        for (Index x : changed_) mend_ring(x);
        for (Index v : loosened_) {
            if (!on_ring(v)) following_[at(v)] = kNone;  // so that it is told when it comes back
        }
        forest_.release(retired_);
        retired_.clear();
        return true;
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
        waiting_.clear();
    }

    // Between repairs only: changes in progress do not travel.
    template <class Archive>
    void transfer(Archive& archive) {
        Captures::transfer(archive);
        archive(touched_);
    }

    std::size_t bytes() const { return Captures::bytes() + links_.bytes(); }

   private:
    // Writing the place of an event anew costs so much less than deriving it.
    static constexpr std::size_t kRatio = 8;

    void release(Index v) {
        holder_[at(v)] = kNone;
        ++left_inside_;
        freed_.push_back(v);
        loosened_.push_back(v);
    }

    // Ends an event. Those that hang from it are orphans.
    void kill(Index e) {
        const Mesh& m = t_.mesh();
        Index edge = forest_.edge(e);
        for (Index side : {Mesh::next(edge), Mesh::prev(edge)}) {
            Index child = entered_through(m.twin(side));
            if (child != kNone) orphan(child);
        }
        event_of_[at(Mesh::triangle(edge))] = kNone;
        changed_.push_back(Mesh::triangle(edge));
        release(m.apex(edge));
        forest_.set_waiting(e, false);
        forest_.die(e);
        retired_.push_back(e);
        ++touched_;
    }

    void orphan(Index e) {
        forest_.set_parent(e, kNone);
        forest_.set_waiting(e, true);
    }

    // Ends one whose triangle stays: its gates may be open again.
    void put_back(Index e) {
        wait_for_gates_into(Mesh::triangle(forest_.edge(e)));
        kill(e);
    }

    // Puts the gate into the heap if it is open and its target is not held by an earlier event;
    // gives an orphan behind it its parent.
    void offer(Index edge) {
        Index parent = opener(edge), x = Mesh::triangle(edge);
        if (parent == kNone || t_.mesh().is_ghost(x) || forest_.is_adrift(parent)) return;
        if (event_of_[at(x)] != kNone) {
            Index e = entered_through(edge);
            if (e != kNone && forest_.parent(e) == kNone) graft(e, parent);
            return;
        }
        Index holder = holder_[at(t_.mesh().apex(edge))];
        if (holder == Forest::kRoot) return;
        if (holder != kNone && forest_.earlier(holder, parent)) return;
        Gate gate = make_gate(t_, edge);
        Index place = forest_.first_as_large(parent, gate);
        if (place != kNone) {
            bool is_there = forest_.edge(place) == edge && forest_.parent(place) == parent;
            if (is_there || (holder != kNone && forest_.earlier(holder, place))) return;
        } else if (holder != kNone) {
            return;
        }
        forest_.add(gate, parent, place);
    }

    void wait_for_gates_into(Index x) {
        for (Index side = 0; side < 3; ++side) waiting_.push_back(3 * x + side);
    }

    void wait_for_gates_at(Index v) {
        const Mesh& m = t_.mesh();
        Index first = m.leaving(v), h = first;
        do {
            waiting_.push_back(Mesh::next(h));
            h = m.turn(h);
        } while (h != first);
    }

    void wait_for_freed() {
        for (Index v : freed_) {
            if (!on_ring(v) && t_.is_site(v)) wait_for_gates_at(v);
        }
        freed_.clear();
    }

    // Does what is to be done next: the earliest gate captures, or the earliest orphan is settled.
    // False if nothing waits.
    bool proceed() {
        Index e = forest_.first_waiting();
        if (e == kNone) return false;
        if (entered_through(forest_.edge(e)) == e) {
            settle(e);
        } else {
            take(e);
        }
        return true;
    }

    // Captures the target of a gate, if it still can.
    void take(Index e) {
        const Mesh& m = t_.mesh();
        Index edge = forest_.edge(e), x = Mesh::triangle(edge);
        Index target = m.apex(edge), holder = holder_[at(target)];
        bool is_open = event_of_[at(x)] == kNone && opener(edge) == forest_.parent(e);
        bool is_placed = is_open && stands(e);
        if (is_open && !is_placed) waiting_.push_back(edge);
        if (!is_placed || holder == Forest::kRoot ||
            (holder != kNone && forest_.earlier(holder, e))) {
            forest_.withdraw(e);
            return;
        }
        if (holder != kNone) put_back(holder);
        forest_.set_waiting(e, false);
        event_of_[at(x)] = e;
        hold(target, e);
        ++touched_;
        changed_.push_back(x);
        wait_for_freed();
        waiting_.push_back(m.twin(Mesh::next(edge)));
        waiting_.push_back(m.twin(Mesh::prev(edge)));
    }

    // Whether a gate still has the place that it got from its parent.
    bool stands(Index e) const {
        Index parent = forest_.parent(e);
        return forest_.earlier(parent, e) && forest_.first_as_large(parent, forest_.gate(e)) == e;
    }

    // No gate led to an orphan by its time: it is set adrift, and ends if it is adrift.
    void settle(Index e) {
        Index parent = opener(forest_.edge(e));
        bool is_opener_adrift = parent != kNone && forest_.is_adrift(parent);
        if (parent != kNone && !is_opener_adrift && graft(e, parent)) return;
        if (forest_.is_adrift(e)) {
            put_back(e);
            wait_for_freed();
        } else {
            set_adrift(e, is_opener_adrift ? parent : kNone);
        }
    }

    // Takes an orphan to the end of time. What hangs from it becomes orphans, its site others may
    // capture meanwhile.
    void set_adrift(Index e, Index parent) {
        const Mesh& m = t_.mesh();
        Index edge = forest_.edge(e), after = parent == kNone ? Forest::kNever : parent;
        for (Index side : {Mesh::next(edge), Mesh::prev(edge)}) {
            Index child = entered_through(m.twin(side));
            if (child != kNone) orphan(child);
        }
        forest_.move(e, e, forest_.first_as_large(after, forest_.gate(e)));
        hang(e, parent);
        wait_for_gates_at(m.apex(edge));
        ++work_;
    }

    // Gives an orphan a parent, or none.
    void hang(Index e, Index parent) {
        forest_.set_parent(e, parent);
        forest_.set_waiting(e, parent == kNone);
    }

    // Hangs event e from the event that opens its gate now. False if that one hangs from e.
    bool graft(Index e, Index parent) {
        if (forest_.first_as_large(parent, forest_.gate(e)) == e) {
            hang(e, parent);
            return true;
        }
        return forest_.earlier(e, parent) ? delay(e, parent) : advance(e, parent);
    }

    // A run of events: one and those behind it that are smaller, mostly what hangs from it.
    struct Run {
        Index first, last;
    };

    // The event behind the run that starts with r, or kNone.
    Index end_of_run(Index r) const { return forest_.first_as_large(r, forest_.gate(r)); }
    Index last_before(Index end) const {
        return end == kNone ? forest_.last() : forest_.previous(end);
    }

    // Whether an event is in one of the runs to be moved, which are in order.
    bool is_in_runs(Index e) const {
        auto run = std::upper_bound(runs_.begin(), runs_.end(), e, [&](Index x, const Run& r) {
            return forest_.earlier(x, r.first);
        });
        return run != runs_.begin() && !forest_.earlier((--run)->last, e);
    }
    bool hangs_from_runs(Index r) const {
        return forest_.parent(r) != kNone && is_in_runs(forest_.parent(r));
    }

    void move(Run run) {
        Index parent = forest_.parent(run.first);
        forest_.move(run.first, run.last, forest_.first_as_large(parent, forest_.gate(run.first)));
    }

    // Grafts e where it comes later. Of the runs that hang from it, those move along that have come
    // before the new parent.
    bool delay(Index e, Index parent) {
        runs_.clear();
        for (Index r = e, end = kNone;; r = end) {
            end = end_of_run(r);
            bool hangs = r == e || hangs_from_runs(r);
            if (end == kNone || forest_.earlier(parent, end)) {
                if (hangs) return false;
                break;
            }
            if (hangs) runs_.push_back({r, last_before(end)});
            ++work_;
        }
        Index before = forest_.previous(e);
        hang(e, parent);
        for (Run run : runs_) move(run);
        recheck(forest_.next(before), runs_.back().first, true);
        return true;
    }

    // Grafts e where it comes earlier. Of the runs that hang from it, those move along that are not
    // larger than all that e has passed.
    bool advance(Index e, Index parent) {
        runs_.clear();
        bool was_adrift = forest_.is_adrift(e);
        hang(e, parent);
        Index r = e;
        while (r != kNone) {
            Index end = end_of_run(r);
            if (r == e || hangs_from_runs(r)) {
                Run run{r, last_before(end)};
                if (forest_.first_as_large(forest_.parent(r), forest_.gate(r)) == r) break;
                move(run);
                runs_.push_back(run);
            } else if (forest_.first_as_large(runs_.back().last, forest_.gate(r)) == r) {
                break;
            }
            r = end;
            ++work_;
        }
        if (was_adrift) {
            list_runs();
            offer_again(inside_, true);
        } else {
            recheck(e, r, false);
        }
        return true;
    }

    void list_runs() {
        inside_.clear();
        for (Run run : runs_) {
            inside_.push_back(run.first);
            while (inside_.back() != run.last) inside_.push_back(forest_.next(inside_.back()));
        }
    }

    // The order of runs that have moved has changed among those between `from` and `to`. One of two
    // comes earlier now, and its gates may lead to sites that the other holds: either the runs are
    // offered anew or the others are, whichever are fewer.
    void recheck(Index from, Index to, bool later) {
        inside_.clear();
        outside_.clear();
        auto run = runs_.begin(), passed = run;
        Index in = run->first, out = from;
        while (true) {
            while (passed != runs_.end() && out == passed->first) {
                out = forest_.next(passed->last);
                ++passed;
            }
            if (out == to || (later && passed == runs_.end())) return offer_again(outside_, later);
            outside_.push_back(out);
            out = forest_.next(out);
            inside_.push_back(in);
            if (in != run->last) {
                in = forest_.next(in);
            } else if (++run != runs_.end()) {
                in = run->first;
            } else {
                return offer_again(inside_, !later);
            }
        }
    }

    // Gates that lead from events that come earlier than before, or to those that come later.
    void offer_again(const std::vector<Index>& events, bool earlier) {
        const Mesh& m = t_.mesh();
        for (Index e : events) {
            Index edge = forest_.edge(e);
            if (edge < 0 || entered_through(edge) != e) continue;
            if (earlier) {
                waiting_.push_back(m.twin(Mesh::next(edge)));
                waiting_.push_back(m.twin(Mesh::prev(edge)));
            } else {
                wait_for_gates_at(m.apex(edge));
            }
        }
        work_ += events.size();
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

    std::int64_t touched_ = 0;
    Links links_;
    // A change in progress: triangles that went, that came, others that changed sides, vertices
    // that lost their holder, those of them whose gates are still to be offered, dead events, gates
    // to be offered, gates and orphans by time.
    std::vector<Index> destroyed_, created_, changed_, loosened_, freed_, retired_, waiting_;
    std::size_t work_ = 0;   // places in the order that were written or looked at
    std::vector<Run> runs_;  // those that a graft moves
    std::vector<Index> inside_, outside_;
};

}  // namespace flintknap
