// An event gets another parent, and what hangs from it comes along.
//
// Theory (section 3.2 of docs/theory.md). Where a gate opens behind which an orphan stands, the
// event that opened the gate is its parent now. Mostly it stands where it belongs already, and
// nothing else happens. Else it is
//
//     advanced    with the runs (forest.hpp) behind it that hang from it, up to one that stands
//                 where it belongs; or
//     landed      from adrift, with all that hangs from it.
//
//      q           p          Of what is advanced, small gates to sites of what it passes are
//       \    ==>    \         queued to be offered anew, looked for on the side that has fewer.
//        e           e        What lands comes later than it went adrift, so none of its gates
//       / \         / \       need be.
//
// Cost: O(log n) for each event looked at: those that moved or the fewer of them and those passed.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "captures.hpp"

namespace flintknap {

class Grafts : public Captures {
   public:
    using Captures::Captures;

   protected:
    // A run of events: one and those behind it that are smaller, mostly what hangs from it.
    struct Run {
        Index first, last;
    };

    static constexpr std::size_t kAhead = 3;  // so many gates are fetched ahead

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

    // Fetches what those events will be asked for of which the i-th is next.
    [[gnu::always_inline]] void fetch_events_ahead(const Array<Index>& events,
                                                   std::size_t i) const {
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
        if (Index h = edge(i + kAhead); h >= 0) {
            for (Index gate : {m.twin(Mesh::next(h)), m.twin(Mesh::prev(h))}) {
                Index v = m.apex(gate);
                if (v == kGhost) continue;
                __builtin_prefetch(&holder_[at(v)]);
                __builtin_prefetch(t_.sites().data() + v);
            }
        }
    }

    bool is_orphan(Index e) const { return forest_.parent(e) == kNone; }

    void queue(Index edge) {
        queue_.push_back(edge);
        t_.mesh().prefetch(edge);
        __builtin_prefetch(&event_of_[at(Mesh::triangle(edge))]);
    }
    // Whether the triangle beyond an edge is gone. Else no gate is open there; and what opens one
    // queues it.
    bool is_rim(Index edge) const { return !is_inside(Mesh::triangle(t_.mesh().twin(edge))); }
    void queue_gates_into(Index x) {
        for (Index side = Mesh::first(x); side < Mesh::first(x) + 3; ++side)
            queue_.push_back_if(is_rim(side), side);
    }

    // The half-edges f(h) that leave the vertex which one of them leaves, from that one on to both
    // sides: what is next on the one is looked up while the other is looked at.
    template <class F>
    void visit_around(Index first, F&& f) const {
        const Mesh& m = t_.mesh();
        Index left = first, right = first;
        do {
            f(left);
            left = m.turn(left);
            if (left == right) return;
            right = Mesh::next(m.twin(right));
            f(right);
        } while (left != right);
    }
    // Whether a gate that may be open leads to the vertex which a half-edge leaves, through the
    // side opposite of it. Nobody can foresee that, so there is no branch.
    bool is_opposite_gate(Index h) const {
        bool is_near_inside = is_inside(Mesh::triangle(h)), is_far_outside = is_rim(Mesh::next(h));
        return is_near_inside & is_far_outside;
    }
    // Gates f(edge) that lead to the site of an event, all that are open among them.
    template <class F>
    void visit_gates_to(Index e, F&& f) const {
        visit_around(Mesh::prev(forest_.edge(e)), [&](Index h) {
            if (is_opposite_gate(h)) f(Mesh::next(h));
        });
    }
    // Queues those that lead to the vertex which a half-edge leaves.
    void queue_gates_around(Index first) {
        visit_around(first,
                     [&](Index h) { queue_.push_back_if(is_opposite_gate(h), Mesh::next(h)); });
    }
    void queue_gates_to(Index e) { queue_gates_around(Mesh::prev(forest_.edge(e))); }

    // The first event after another one that is as large as r, or kNone; the one behind the run
    // that starts with r.
    Index first_as_large_after(Index other, Index r) const {
        return forest_.first_as_large(other, forest_.gate(r));
    }
    Index end_of_run(Index r) const { return first_as_large_after(r, r); }

    // Hangs event e from the one before it that opens its gate now.
    void graft(Index e, Index parent) {
        forest_.set_parent(e, parent);
        if (forest_.is_adrift(e)) {
            land(e);
        } else {
            advance(e);
        }
    }

    Array<Index> queue_;    // gates to be offered
    std::size_t work_ = 0;  // events that were looked at again
    Array<Index> inside_;   // those that moved
    Array<Index> outside_;  // and those that they passed, or others that matter

   private:
    Index last_before(Index end) const {
        return end == kNone ? forest_.last() : forest_.previous(end);
    }

    // Adds a run to the list of what has moved.
    void list(Run run) {
        auto x = forest_.cursor(run.first);
        for (; x.event() != run.last; x.advance()) inside_.push_back(x.event());
        inside_.push_back(run.last);
    }

    // Whether an event is in one of the runs to be moved, which are in order.
    bool is_in_runs(Index e) const {
        auto run = std::upper_bound(runs_.begin(), runs_.end(), e, [&](Index x, const Run& r) {
            return forest_.earlier(x, r.first);
        });
        return run != runs_.begin() && !forest_.earlier((--run)->last, e);
    }
    bool hangs_from_runs(Index r) const {
        return forest_.parent(r) >= 0 && is_in_runs(forest_.parent(r));
    }

    // Grafts e where it comes earlier. Of the runs that hang from it, those move along that are not
    // larger than all that e has passed.
    void advance(Index e) {
        runs_.clear();
        double largest = forest_.key(e);
        Index r = e, passed = kNone;  // a large event between the last that has moved and r
        while (true) {
            Index end = end_of_run(r);
            if (r == e || hangs_from_runs(r)) {
                Index place = first_as_large_after(forest_.parent(r), r);
                if (place == r) break;
                runs_.push_back({r, last_before(end)});
                forest_.move(r, runs_.back().last, place);
                largest = forest_.key(r);
                passed = kNone;
            } else if (passed == kNone || forest_.smaller(passed, r)) {
                passed = first_as_large_after(runs_.back().last, r);
                if (passed == r) break;
            }
            r = end;
            ++work_;
        }
        if (!runs_.empty()) recheck(e, r, std::max(largest, forest_.key(r)));
    }

    // Grafts e, which is adrift, with all that hangs from it.
    void land(Index e) {
        inside_.clear();
        std::size_t adrift = 1;  // whose parents are not
        for (Index r = e, end = kNone; adrift > 0; r = end) {
            end = end_of_run(r);
            ++work_;
            if (forest_.parent(r) < 0 || forest_.is_adrift(forest_.parent(r))) continue;
            Run run{r, last_before(end)};
            forest_.move(r, run.last, first_as_large_after(forest_.parent(r), r));
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
    }

    // Runs have moved, to where they come before some of those between `from` and `to`: gates that
    // lead from moved events to sites of passed ones may be the first that do so. Either the ones
    // are looked through for them or the others, whichever are fewer. Gates larger than the largest
    // of all these have their places behind them, as before.
    void recheck(Index from, Index to, double largest) {
        inside_.clear();
        outside_.clear();
        auto run = runs_.begin(), passed = run;
        auto in = forest_.cursor(run->first), out = forest_.cursor(from);
        while (run != runs_.end()) {
            while (passed != runs_.end() && out.event() == passed->first) {
                out = forest_.cursor(passed->last);
                out.advance();
                ++passed;
            }
            if (out.event() == to) break;
            outside_.push_back(out.event());
            out.advance();
            inside_.push_back(in.event());
            if (in.event() != run->last) {
                in.advance();
            } else if (++run != runs_.end()) {
                in = forest_.cursor(run->first);
            }
        }
        auto queue_small = [&](Index gate) {
            if (!is_inside(Mesh::triangle(gate))) return;
            if (key_floor(t_, gate) <= largest) queue(gate);
        };
        bool are_fewer_inside = run == runs_.end();
        const Array<Index>& events = are_fewer_inside ? inside_ : outside_;
        for (std::size_t i = 0; i < events.size(); ++i) {
            fetch_events_ahead(events, i);
            if (forest_.is_dead(events[i])) continue;
            if (are_fewer_inside) {
                for (Index gate : gates_of(events[i])) queue_small(gate);
            } else {
                visit_gates_to(events[i], queue_small);
            }
        }
        work_ += events.size();
    }

    std::vector<Run> runs_;  // those that a graft moves
};

}  // namespace flintknap
