// A long run goes adrift without a look at every gate that leads into it.
//
// Theory (section 3.2 of docs/theory.md). While an event is adrift, others may capture its site, so
// all gates that lead there are offered. Where keys fall inward, as in a smooth channel, a run of
// thousands goes adrift and is back as soon as one larger event has happened, before any of these
// gates counts. Such a run is a *raft*:
//
//     - the gates that lead to it are kept by key, and offered when time has come so far;
//     - every event that happens offers its gates that lead to it, whether it waits or not.
//
//     now   next                    never
//     [ ]   [y]  ...  [ ]  ...      [ ]   [e][ ][ ][ ][ ][ ][ ][ ]  ...
//      `-----'                             `------- raft -------'
//      gates up to the key of y are offered before it happens
//
// That ends when the first event of the raft happens, and then no gate that was kept counts. It
// ends, too, when one of its sites is captured, after as many steps as it has events, or when a
// larger run goes adrift: then all gates that lead to it are offered, as to any other run.
//
// Cost: O(1) for each gate that leads to it, by far less than offering it; O(log n) for each event
// that happens meanwhile.
#pragma once

#include <algorithm>
#include <vector>

#include "grafts.hpp"
#include "heap.hpp"

namespace flintknap {

class Rafts : public Grafts {
   public:
    using Grafts::Grafts;

   protected:
    bool has_raft() const { return raft_.first != kNone; }
    bool starts_raft(Index e) const { return e == raft_.first; }
    bool is_on_raft(Index e) const {
        return has_raft() && e != kNone && !forest_.earlier(e, raft_.first) &&
               !forest_.earlier(raft_.last, e);
    }

    // Makes a raft of those that have moved, and went adrift. False if that would not pay.
    bool board() {
        if (inside_.size() < kLong || (has_raft() && inside_.size() <= aboard_)) return false;
        if (has_raft()) offer_raft();
        if (!stow_gates(forest_.key(inside_.front())) || !list_others_adrift()) {
            leave();
            return false;
        }
        raft_ = {inside_.front(), inside_.back()};
        aboard_ = steps_ = inside_.size();
        for (Index x : outside_) {
            if (!forest_.is_dead(x)) queue_gates_to_raft(x);
        }
        return true;
    }

    // Offers of what is kept what may come before a gate with this key and event `next`, or all.
    // False if there is nothing to be offered.
    bool unload(double key, Index next) {
        if (next == Forest::kNever || steps_-- == 0) {
            offer_raft();
            return true;
        }
        key = std::min(key, forest_.key(next));
        if (kept_.empty() || kept_.top().key > key) return false;
        queue(kept_.pop().edge);
        return true;
    }

    void queue_gates_to_raft(Index e) {
        for (Index gate : gates_of(e)) {
            if (!is_inside(Mesh::triangle(gate))) continue;
            if (is_on_raft(holder_[at(t_.mesh().apex(gate))])) queue(gate);
        }
    }

    // Offers all gates that lead to the raft, which is none any more.
    void offer_raft() {
        Index end = forest_.next(raft_.last);
        for (auto x = forest_.cursor(raft_.first); x.event() != end; x.advance()) {
            if (!forest_.is_dead(x.event())) queue_gates_to(x.event());
        }
        work_ += aboard_;
        leave();
    }
    void leave() {
        raft_ = {kNone, kNone};
        kept_.clear();
    }

   private:
    static constexpr std::size_t kLong = 16;  // a run of so many may be a raft

    // Keeps the gates that lead to those that have moved, and queues the small ones, some of which
    // may come at once. False if these are many.
    bool stow_gates(double small) {
        std::size_t queued = 0;
        for (Index x : inside_) {
            if (forest_.is_dead(x)) continue;
            visit_gates_to(x, [&](Index gate) {
                double key = key_floor(t_, gate);
                if (key > small) return kept_.push({key, gate});
                queue(gate);
                ++queued;
            });
            if (2 * queued > kept_.size() + kLong) return false;
        }
        work_ += inside_.size();
        return true;
    }

    // What else is adrift. False if that is more than those that have moved.
    bool list_others_adrift() {
        outside_.clear();
        auto x = forest_.cursor(Forest::kNever);
        for (x.advance(); x.event() != kNone; x.advance()) {
            if (x.event() == inside_.front()) {
                x = forest_.cursor(inside_.back());
            } else {
                outside_.push_back(x.event());
            }
            if (outside_.size() > inside_.size()) return false;
        }
        return true;
    }

    struct SmallerKey {
        bool operator()(Gate a, Gate b) const { return a.key < b.key; }
    };
    Heap<Gate, SmallerKey> kept_{SmallerKey{}};  // by a bound of their keys
    Run raft_{kNone, kNone};
    std::size_t aboard_ = 0;  // how many it has
    std::size_t steps_ = 0;   // after so many it is given up
};

}  // namespace flintknap
