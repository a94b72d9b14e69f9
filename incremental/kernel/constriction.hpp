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
//   4. Where a gate opens behind which an orphan stands, that is *grafted*: the event that opened
//      the gate is its parent now, and what hangs from it comes along.
//
//      q           p          mostly e stands where it belongs already, and nothing else happens.
//       \    ==>    \         Else its run moves (forest.hpp), and those of its descendants that
//        e           e        must. If they come later, gates to their sites are offered anew. If
//       / \         / \       earlier, small gates from moved to passed ones are, looked for on
//                             the side that has fewer.
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

#include "captures.hpp"
#include "heap.hpp"
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
    void destroying(const Array<Index>& triangles) {
        const Mesh& m = t_.mesh();
        forest_.open();
        destroyed_.insert(destroyed_.end(), triangles.begin(), triangles.end());
        for (Index x : triangles) {
            if (!m.is_ghost(x)) {
                if (event_of_[at(x)] != kNone) kill(event_of_[at(x)]);
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
        created_.insert(created_.end(), triangles.begin(), triangles.end());
        for (Index x : triangles) {
            if (!m.is_ghost(x)) continue;
            event_of_[at(x)] = Forest::kRoot;
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
    [[nodiscard]] bool repair() {
        const Mesh& m = t_.mesh();
        std::int64_t enough = touched_ + t_.size();
        work_ = 0;
        forest_.open();
        now_ = Forest::kRoot;
        for (const std::vector<Index>* triangles : {&created_, &changed_}) {
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
        queue_.clear();
        open_.clear();
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
    static constexpr std::size_t kAhead = 3;  // so many gates are fetched ahead

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
        event_of_[at(Mesh::triangle(edge))] = kNone;
        changed_.push_back(Mesh::triangle(edge));
        release(t_.mesh().apex(edge));
        forest_.set_waiting(e, false);
        forest_.die(e);
        retired_.push_back(e);
        ++touched_;
    }

    // The gates that an event opens; the events f(child) that have been through one.
    std::array<Index, 2> gates_of(Index e) const {
        Index edge = forest_.edge(e);
        return {t_.mesh().twin(Mesh::next(edge)), t_.mesh().twin(Mesh::prev(edge))};
    }
    template <class F>
    void visit_children(Index e, F&& f) const {
        for (Index gate : gates_of(e)) {
            Index child = entered_through(gate);
            if (child != kNone) f(child);
        }
    }

    bool is_orphan(Index e) const { return forest_.parent(e) == kNone && !forest_.is_dead(e); }
    void orphan(Index e) {
        forest_.set_parent(e, kNone);
        forest_.set_waiting(e, true);
    }

    // Ends one whose triangle stays: its gates may be open again.
    void put_back(Index e) {
        queue_gates_into(Mesh::triangle(forest_.edge(e)));
        kill(e);
    }

    // Lets a gate compete for its target: now if the event that opened it has happened, else when
    // that happens. Gives an orphan behind it its parent.
    void offer(Index edge) {
        Index parent = opener(edge);
        if (parent == kNone) return;
        if (!is_inside(Mesh::triangle(edge))) {
            Index e = entered_through(edge);
            if (e != kNone && is_orphan(e) && !forest_.is_adrift(parent)) graft(e, parent);
            return;
        }
        Index holder = holder_[at(t_.mesh().apex(edge))];
        if (holder == Forest::kRoot) return;
        if (has_happened(parent)) {
            if (holder == kNone || !has_happened(holder)) open_.push(make_gate(t_, edge));
        } else if (holder == kNone || !forest_.earlier(holder, parent) ||
                   (forest_.is_adrift(parent) && !has_happened(holder))) {
            forest_.set_waiting(parent, true);
        }
    }

    bool has_happened(Index e) const { return e == now_ || forest_.earlier(e, now_); }

    void queue(Index edge) {
        queue_.push_back(edge);
        t_.mesh().prefetch(edge);
        __builtin_prefetch(&event_of_[at(Mesh::triangle(edge))]);
    }
    // Fetches what the gates of which the i-th is next will look at.
    void fetch_ahead(std::size_t i) const {
        if ((i += kAhead) < queue_.size()) {
            Index o = t_.mesh().twin(queue_[i]), e = event_of_[at(Mesh::triangle(o))];
            if (e != kNone) forest_.prefetch(e);
        }
        if ((i += kAhead) < queue_.size()) {
            Index o = t_.mesh().twin(queue_[i]), v = t_.mesh().apex(queue_[i]);
            __builtin_prefetch(&event_of_[at(Mesh::triangle(o))]);
            if (v != kGhost) __builtin_prefetch(&holder_[at(v)]);
        }
    }
    // Fetches what those events will be asked for of which the i-th is next.
    void fetch_ahead(const std::vector<Index>& events, std::size_t i) const {
        const Mesh& m = t_.mesh();
        auto edge = [&](std::size_t k) { return k < events.size() ? forest_.edge(events[k]) : -1; };
        if (i + 4 * kAhead < events.size()) forest_.prefetch(events[i + 4 * kAhead]);
        if (Index h = edge(i + 3 * kAhead); h >= 0) {
            __builtin_prefetch(&event_of_[at(Mesh::triangle(h))]);
            m.prefetch(h);
        }
        if (Index h = edge(i + 2 * kAhead); h >= 0) {
            for (Index gate : {m.twin(Mesh::next(h)), m.twin(Mesh::prev(h))}) {
                __builtin_prefetch(&event_of_[at(Mesh::triangle(gate))]);
                m.prefetch(gate);
            }
        }
    }
    void queue_gates_into(Index x) {
        for (Index side = 0; side < 3; ++side) queue(3 * x + side);
    }

    // Gates f(edge) that lead to a vertex, or would if they were open.
    template <class F>
    void visit_gates_at(Index v, F&& f) const {
        const Mesh& m = t_.mesh();
        Index first = m.leaving(v), h = first;
        do {
            if (is_inside(Mesh::triangle(h))) f(Mesh::next(h));
            h = m.turn(h);
        } while (h != first);
    }
    void queue_gates_at(Index v) {
        visit_gates_at(v, [&](Index gate) { queue(gate); });
    }

    void queue_gates_at_freed() {
        for (Index v : freed_) {
            if (!on_ring(v) && t_.is_site(v)) queue_gates_at(v);
        }
        freed_.clear();
    }

    // Does what is to be done next: the smallest gate captures, or the first that waits is settled
    // or offers its gates. False if nothing is left to do.
    bool proceed() {
        Index e = forest_.first_waiting();
        for (; !open_.empty(); open_.pop()) {
            Gate gate = open_.top();
            Index holder = holder_[at(t_.mesh().apex(gate.edge))];
            if (!is_inside(Mesh::triangle(gate.edge))) continue;
            if (holder != kNone && has_happened(holder)) continue;
            Index place = forest_.first_as_large(now_, gate);
            if (e != kNone && forest_.earlier(e, place)) break;
            if (holder != kNone && forest_.earlier(holder, place)) continue;
            open_.pop();
            capture(gate, place);
            return true;
        }
        if (e == kNone) return false;
        if (forest_.parent(e) == kNone) {
            now_ = forest_.previous(forest_.is_adrift(e) ? Forest::kNever : e);
            settle(e);
        } else {
            now_ = e;
            forest_.set_waiting(e, false);
            for (Index gate : gates_of(e)) queue(gate);
        }
        return true;
    }

    void capture(Gate gate, Index place) {
        Index x = Mesh::triangle(gate.edge), target = t_.mesh().apex(gate.edge);
        if (holder_[at(target)] != kNone) put_back(holder_[at(target)]);
        Index e = forest_.add(gate, opener(gate.edge), place);
        now_ = event_of_[at(x)] = e;
        hold(target, e);
        ++touched_;
        changed_.push_back(x);
        queue_gates_at_freed();
        for (Index opened : gates_of(e)) queue(opened);
    }

    // No gate led to an orphan by its time: it is set adrift, and ends if it is adrift.
    void settle(Index e) {
        Index parent = opener(forest_.edge(e));
        bool is_opener_adrift = parent != kNone && forest_.is_adrift(parent);
        if (parent != kNone && !is_opener_adrift && graft(e, parent)) return;
        if (forest_.is_adrift(e)) {
            put_back(e);
            queue_gates_at_freed();
        } else {
            set_adrift(e, is_opener_adrift ? parent : kNone);
        }
    }

    // Takes an orphan to the end of time, and with it what hangs from it up to the next orphan.
    // What else hangs from these becomes orphans; others may capture their sites meanwhile.
    void set_adrift(Index e, Index parent) {
        forest_.set_parent(e, parent);
        inside_.clear();
        for (Index x = e, end = end_of_run(e); x != end && (x == e || !is_orphan(x));
             x = forest_.next(x)) {
            inside_.push_back(x);
        }
        Index after = parent == kNone ? Forest::kNever : parent;
        forest_.move(e, inside_.back(), forest_.first_as_large(after, forest_.gate(e)));
        for (Index x : inside_) {
            if (forest_.is_dead(x)) continue;
            visit_children(x, [&](Index child) {
                if (!forest_.is_adrift(child)) orphan(child);
            });
            queue_gates_at(t_.mesh().apex(forest_.edge(x)));
        }
        work_ += inside_.size();
    }

    // Hangs event e from the event that opens its gate now. False if that one hangs from e.
    bool graft(Index e, Index parent) {
        if (forest_.first_as_large(parent, forest_.gate(e)) == e) {
            forest_.set_parent(e, parent);
            return true;
        }
        if (forest_.earlier(e, parent)) return delay(e, parent);
        return forest_.is_adrift(e) ? land(e, parent) : advance(e, parent);
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
        forest_.set_parent(e, parent);
        inside_.clear();
        for (Run run : runs_) {
            move(run);
            list(run);
        }
        for (Index x : inside_) {
            if (is_taken(x)) queue_gates_at(t_.mesh().apex(forest_.edge(x)));
        }
        work_ += inside_.size();
        return true;
    }

    // Grafts e where it comes earlier. Of the runs that hang from it, those move along that are not
    // larger than all that e has passed.
    bool advance(Index e, Index parent) {
        runs_.clear();
        forest_.set_parent(e, parent);
        double largest = forest_.key(e);
        Index r = e;
        while (true) {
            Index end = end_of_run(r);
            if (r == e || hangs_from_runs(r)) {
                if (forest_.first_as_large(forest_.parent(r), forest_.gate(r)) == r) break;
                runs_.push_back({r, last_before(end)});
                move(runs_.back());
                largest = forest_.key(r);
            } else if (forest_.first_as_large(runs_.back().last, forest_.gate(r)) == r) {
                break;
            }
            r = end;
            ++work_;
        }
        recheck(e, r, std::max(largest, forest_.key(r)));
        return true;
    }

    // Grafts e, which is adrift, with all that hangs from it.
    bool land(Index e, Index parent) {
        inside_.clear();
        forest_.set_parent(e, parent);
        std::size_t adrift = 1;  // whose parents are not
        for (Index r = e, end = kNone; adrift > 0; r = end) {
            end = end_of_run(r);
            ++work_;
            if (forest_.parent(r) == kNone || forest_.is_adrift(forest_.parent(r))) continue;
            Run run{r, last_before(end)};
            move(run);
            --adrift;
            std::size_t listed = inside_.size();
            list(run);
            for (; listed < inside_.size(); ++listed) {
                Index x = inside_[listed];
                if (forest_.is_dead(x)) continue;
                visit_children(x, [&](Index child) {
                    if (forest_.parent(child) == x && forest_.is_adrift(child)) ++adrift;
                });
            }
        }
        work_ += inside_.size();
        return true;
    }

    // Adds a run to the list of what has moved.
    void list(Run run) {
        inside_.push_back(run.first);
        while (inside_.back() != run.last) inside_.push_back(forest_.next(inside_.back()));
    }

    // Runs have moved, to where they come before some of those between `from` and `to`: gates that
    // lead from moved events to sites of passed ones may be the first that do so. Either the ones
    // are looked through for them or the others, whichever are fewer. Gates larger than the largest
    // of all these have their places behind them, as before.
    void recheck(Index from, Index to, double largest) {
        inside_.clear();
        outside_.clear();
        auto run = runs_.begin(), passed = run;
        for (Index in = run->first, out = from; run != runs_.end();) {
            while (passed != runs_.end() && out == passed->first) {
                out = forest_.next(passed->last);
                ++passed;
            }
            if (out == to) break;
            outside_.push_back(out);
            out = forest_.next(out);
            inside_.push_back(in);
            if (in != run->last) {
                in = forest_.next(in);
            } else if (++run != runs_.end()) {
                in = run->first;
            }
        }
        auto queue_small = [&](Index gate) {
            if (!is_inside(Mesh::triangle(gate))) return;
            if (make_gate(t_, gate).key <= largest) queue(gate);
        };
        bool are_fewer_inside = run == runs_.end();
        const std::vector<Index>& events = are_fewer_inside ? inside_ : outside_;
        for (std::size_t i = 0; i < events.size(); ++i) {
            fetch_ahead(events, i);
            if (!is_taken(events[i])) continue;
            if (are_fewer_inside) {
                for (Index gate : gates_of(events[i])) queue_small(gate);
            } else {
                visit_gates_at(t_.mesh().apex(forest_.edge(events[i])), queue_small);
            }
        }
        work_ += events.size();
    }

    // Whether an event is neither dead nor without an edge.
    bool is_taken(Index e) const { return forest_.edge(e) >= 0; }

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
    // to be offered.
    std::vector<Index> destroyed_, created_, changed_, loosened_, freed_, retired_, queue_;
    std::size_t work_ = 0;       // events that were looked at again
    Index now_ = Forest::kRoot;  // the last event that has happened, as far as the repair is
    struct Smaller {
        const Triangulation& t;
        bool operator()(Gate a, Gate b) const { return smaller(t, a, b); }
    };
    Heap<Gate, Smaller> open_{Smaller{t_}};  // gates of events that have happened
    std::vector<Run> runs_;                  // those that a graft moves
    std::vector<Index> inside_, outside_;
};

}  // namespace flintknap
