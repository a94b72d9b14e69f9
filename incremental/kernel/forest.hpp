// The events of a constriction and the order in which they happen.
//
// Theory. An event removes the triangle behind a gate and captures its apex; its parent is the
// event that opened the gate, or the root, which stands for the hull. A priority-first search
// takes event A before event B iff, below their last common ancestor, the largest key on A's path
// is smaller than the largest on B's. So the time of an event is the list of suffix maxima of the
// keys on its path, compared lexicographically, a prefix first. `up`, the nearest ancestor with a
// larger key, strings that list; times are compared by climbing to a common height and then in
// step. Chains may be long (on a smooth channel keys fall steadily inward), so each event has a
// `jump` further up, placed as in a skew-binary counter (Myers 1983).
//
//     key   9   4   6   2   3          up(2) = 6, up(6) = 9, up(4) = 9, up(3) = 6
//          [a]-[b]-[c]-[d]-[e]         times: d = 9 6 2, e = 9 6 3, c = 9 6, b = 9 4, a = 9
//                                      order: a < b < c < d < e
//
// Invariants: key(up) > key; depth = depth(up) + 1; the root has depth 0 and key +inf.
// Cost: O(log n) to add, to compare, for any shape of forest; 24 bytes an event.
#pragma once

#include <limits>
#include <vector>

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

// A strict total order: by key, then by the coordinates of apex, origin and target.
inline bool smaller(const Triangulation& t, Gate a, Gate b) {
    if (a.key != b.key) return a.key < b.key;
    if (a.edge == b.edge) return false;
    const Mesh& m = t.mesh();
    Index k = m.apex(a.edge), l = m.apex(b.edge);
    if (k != l) return t.site(k) < t.site(l);
    k = m.origin(a.edge), l = m.origin(b.edge);
    if (k != l) return t.site(k) < t.site(l);
    return t.site(m.target(a.edge)) < t.site(m.target(b.edge));
}

class Forest {
   public:
    static constexpr Index kRoot = 0;

    void clear(std::size_t expected) {
        free_.clear();
        events_.clear();
        events_.reserve(expected + 1);
        events_.push_back({std::numeric_limits<double>::infinity(), kNone, kRoot, kRoot, 0});
    }

    Gate gate(Index e) const { return {events_[at(e)].key, events_[at(e)].edge}; }
    Index edge(Index e) const { return events_[at(e)].edge; }

    Index add(const Triangulation& t, Gate g, Index parent) {
        Index up = parent;
        while (smaller_event(t, up, g))
            up = smaller_event(t, jump(up), g) ? jump(up) : this->up(up);
        Index over = jump(up);
        bool even = depth(up) - depth(over) == depth(over) - depth(jump(over));
        Event made = {g.key, g.edge, up, even ? jump(over) : up, depth(up) + 1};
        if (free_.empty()) {
            events_.push_back(made);
            return static_cast<Index>(events_.size()) - 1;
        }
        Index e = free_.back();
        free_.pop_back();
        events_[at(e)] = made;
        return e;
    }

    // Gives the place of an event back; none that is left may hang from it.
    void release(Index e) { free_.push_back(e); }

    // Whether a happens before b. Two events with the same gate (one may be dead) and the same time
    // are told apart by their place, so that a heap of them stays consistent.
    bool earlier(const Triangulation& t, Index a, Index b) const {
        Index p = climb(a, depth(b)), q = climb(b, depth(a));
        if (p == q) return depth(a) < depth(b);
        while (up(p) != up(q)) {
            bool far = jump(p) != jump(q);
            p = far ? jump(p) : up(p);
            q = far ? jump(q) : up(q);
        }
        if (edge(p) == edge(q)) return p < q;
        return smaller(t, gate(p), gate(q));
    }

    template <class Archive>
    void transfer(Archive& archive) {
        archive(events_);
        archive(free_);
    }

    std::size_t bytes() const {
        return events_.capacity() * sizeof(Event) + free_.capacity() * sizeof(Index);
    }

   private:
    struct Event {
        double key;
        Index edge, up, jump, depth;
    };

    Index up(Index e) const { return events_[at(e)].up; }
    Index jump(Index e) const { return events_[at(e)].jump; }
    Index depth(Index e) const { return events_[at(e)].depth; }

    bool smaller_event(const Triangulation& t, Index e, Gate g) const {
        return e != kRoot && smaller(t, gate(e), g);
    }

    Index climb(Index e, Index height) const {
        while (depth(e) > height) e = depth(jump(e)) >= height ? jump(e) : up(e);
        return e;
    }

    std::vector<Event> events_;
    std::vector<Index> free_;
};

}  // namespace flintknap
