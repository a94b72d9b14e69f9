// The events of a constriction and the order in which they happen.
//
// Theory (section 3.1). An event removes the triangle behind a gate and captures its apex; its
// parent is the event that opened the gate, or the root, which stands for the hull. The search
// takes the smallest gate that is open. So a sequence of events, each behind its parent, is the
// order of the search iff between an event and its parent stand only smaller ones:
//
//     key    inf  9   4   6   2   3   5       the place of an event with key 5 and parent 4:
//            [ ]-[a]-[b]-[c]-[d]-[e]          before c, the first behind b that is as large
//                     `- parent -'
//
// The order is kept as such a sequence (timeline.hpp). After a run from scratch it is that of the
// numbers of the events, until somebody asks to change it.
//
// At its end stands an event that never happens. Those behind it are *adrift*: they keep what hangs
// from them, and wait to be given a parent. An event may be *dead* until it is released: those that
// hung from it keep their places, though its triangle may be gone.
//
// Invariants (check): those of the timeline. That the order is that of the search, captures.hpp
// checks.
// Cost: O(log n) to add, to move a run, O(1) to compare; 16 bytes an event from scratch, 31 in use.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "timeline.hpp"
#include "triangulation.hpp"

namespace flintknap {

// A triangle about to be entered through its edge `edge`, seen from outside, and its key.
struct Gate {
    double key;
    Index edge;
};

inline Gate make_gate(const Triangulation& t, Index edge) {
    const Mesh& m = t.mesh();
    return {cotangent(t.site(m.origin(edge)), t.site(m.target(edge)), t.site(m.apex(edge))), edge};
}

// What its key is no smaller than, cheaply.
inline double key_floor(const Triangulation& t, Index edge) {
    const Mesh& m = t.mesh();
    return cotangent_floor(t.site(m.origin(edge)), t.site(m.target(edge)), t.site(m.apex(edge)));
}

[[gnu::noinline]] inline bool comes_first(const Triangulation& t, Gate a, Gate b) {
    if (a.edge == b.edge) return false;
    const Mesh& m = t.mesh();
    Index k = m.apex(a.edge), l = m.apex(b.edge);
    if (k != l) return t.site(k) < t.site(l);
    k = m.origin(a.edge), l = m.origin(b.edge);
    if (k != l) return t.site(k) < t.site(l);
    return t.site(m.target(a.edge)) < t.site(m.target(b.edge));
}

// A strict total order: by key, then by the coordinates of apex, origin and target.
inline bool smaller(const Triangulation& t, Gate a, Gate b) {
    return a.key != b.key ? a.key < b.key : comes_first(t, a, b);
}

class Forest {
   public:
    static constexpr Index kRoot = 0;
    static constexpr Index kNever = 1;

    explicit Forest(const Triangulation& t) : t_(t) {}

    void clear(std::size_t expected) {
        timeline_.clear();
        free_.clear();
        graves_.clear();
        events_.clear();
        events_.reserve(expected + 2);
        for (Index e : {kRoot, kNever}) {
            events_.push_back({std::numeric_limits<double>::infinity(), kNone - e, kNone});
        }
    }

    // To be called before the order is changed or asked for. O(n) the first time after clear.
    bool is_open() const { return !timeline_.empty(); }
    void open() {
        if (is_open()) return;
        std::size_t n = events_.size();
        timeline_.assign(n, [&](std::size_t i) {
            return i == 0 ? kRoot : i == n - 1 ? kNever : static_cast<Index>(i) + 1;
        });
    }

    double key(Index e) const { return events_[at(e)].key; }
    Index edge(Index e) const { return events_[at(e)].edge; }
    Gate gate(Index e) const { return {key(e), edge(e)}; }
    Index parent(Index e) const { return events_[at(e)].parent; }
    void set_parent(Index e, Index parent) { events_[at(e)].parent = parent; }

    // An event that happens after all there are, between clear and open.
    Index append(Gate g, Index parent) {
        events_.push_back({g.key, g.edge, parent});
        return static_cast<Index>(events_.size()) - 1;
    }
    // One that happens right before another or behind all (kNone).
    Index add(Gate g, Index parent, Index other) {
        Index e = static_cast<Index>(events_.size());
        if (!free_.empty()) {
            e = free_.back();
            free_.pop_back();
            events_[at(e)] = {g.key, g.edge, parent};
        } else {
            events_.push_back({g.key, g.edge, parent});
        }
        timeline_.insert(e, g.key, other);
        return e;
    }

    bool earlier(Index a, Index b) const { return timeline_.before(a, b); }
    // The last event that has happened, while time goes on; and whether another one has.
    Index now() const { return timeline_.present(); }
    void set_now(Index e) { timeline_.set_present(e); }
    bool has_happened(Index e) const { return timeline_.is_past_or_present(e); }
    bool is_adrift(Index e) const { return earlier(kNever, e); }
    // The first event after e that is not smaller than a gate, or kNone: before it the gate has its
    // place if e opens it.
    Index first_as_large(Index e, Gate g) const {
        return timeline_.first_after(e, g.key, [&](Index x) {
            double other = key(x);
            return other != g.key ? other > g.key : !less(gate(x), g);
        });
    }
    // The first event after e whose key is as large, or kNone.
    Index first_as_large(Index e, double key) const {
        return timeline_.first_after(e, key, [&](Index x) { return this->key(x) >= key; });
    }
    // The neighbours of an event in time, or kNone; and the last of all.
    Index next(Index e) const { return timeline_.next(e); }
    Index previous(Index e) const { return timeline_.previous(e); }
    Index last() const { return timeline_.last(); }
    Timeline<Forest>::Cursor cursor(Index e) const { return timeline_.cursor(e); }
    // Moves a run of events before another one, or behind all (kNone).
    void move(Index first, Index last, Index other) { timeline_.move(first, last, other); }

    [[gnu::always_inline]] void prefetch(Index e) const {
        __builtin_prefetch(&events_[at(e)]);
        timeline_.prefetch(e);
    }
    // The same of the one that is added next.
    [[gnu::always_inline]] void prefetch_next() const {
        if (!free_.empty()) prefetch(free_.back());
    }
    // The events f(e) between the root and what never happens, in order.
    template <class F>
    void visit(F&& f) const {
        if (is_open()) {
            auto e = cursor(kRoot);
            for (e.advance(); e.event() != kNever; e.advance()) f(e.event());
        } else {
            for (std::size_t e = 2; e < events_.size(); ++e) f(static_cast<Index>(e));
        }
    }
    // The first event that waits, or kNone.
    Index first_waiting() const { return timeline_.first_waiting(); }
    bool waits(Index e) const { return timeline_.waits(e); }
    void set_waiting(Index e, bool waits) { timeline_.set_waiting(e, waits); }

    // Ends an event. It keeps its place in the order, and its edge, which tells equal keys apart.
    void die(Index e) { set_parent(e, kDead); }
    bool is_dead(Index e) const { return parent(e) == kDead; }
    // To be called for one that is dead before its triangle goes.
    void bury(Index e) {
        graves_.push_back(corners(edge(e)));
        events_[at(e)].edge = kGrave - static_cast<Index>(graves_.size());
    }

    // Takes all the dead out, which are those given, while none waits.
    void release(const Array<Index>& dead) {
        timeline_.erase(dead);
        free_.insert(free_.end(), dead.begin(), dead.end());
        graves_.clear();
    }

    // What a timeline asks.
    bool smaller(Index a, Index b) const { return less(gate(a), gate(b)); }

    template <class Archive>
    void transfer(Archive& archive) {
        archive(events_);
        archive(free_);
        timeline_.transfer(archive);
    }

    std::size_t bytes() const {
        return events_.capacity() * sizeof(Event) + free_.capacity() * sizeof(Index) +
               timeline_.bytes();
    }

    std::string check() const { return timeline_.check(); }

   private:
    static constexpr Index kDead = kNone - 1;   // in the place of a parent
    static constexpr Index kGrave = kNone - 1;  // no edge is beyond; graves are

    struct Event {
        double key;
        Index edge, parent;
    };

    // Apex, origin and target of a gate: what equal keys are told apart by.
    struct Corners {
        Point k, i, j;
    };
    Corners corners(Index edge) const {
        if (edge < kGrave) return graves_[at(kGrave - 1 - edge)];
        const Mesh& m = t_.mesh();
        return {t_.site(m.apex(edge)), t_.site(m.origin(edge)), t_.site(m.target(edge))};
    }

    // As smaller(), and as it was for the dead.
    bool less(Gate a, Gate b) const {
        if (a.key != b.key) return a.key < b.key;
        if (a.edge == b.edge) return false;
        if (has_no_gate(a.edge) || has_no_gate(b.edge)) return !has_no_gate(a.edge);
        Corners c = corners(a.edge), d = corners(b.edge);
        if (!(c.k == d.k)) return c.k < d.k;
        return c.i == d.i ? c.j < d.j : c.i < d.i;
    }
    // Of the root, and of what never happens.
    static bool has_no_gate(Index edge) { return edge == kNone || edge == kGrave; }

    const Triangulation& t_;
    Array<Event> events_;
    std::vector<Index> free_;
    std::vector<Corners> graves_;  // of those that are buried
    Timeline<Forest> timeline_{*this};
};

}  // namespace flintknap
