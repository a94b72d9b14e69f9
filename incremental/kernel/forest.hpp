// The events of a constriction and the order in which they happen.
//
// Theory. An event removes the triangle behind a gate and captures its apex; its parent is the
// event that opened the gate, or the root, which stands for the hull. A priority-first search
// takes event A before event B iff, below their last common ancestor, the largest key on A's path
// is smaller than the largest on B's.
// The time of an event is the list of suffix maxima of the keys on its path, compared
// lexicographically, a prefix first; `up`, the nearest ancestor with a larger key, strings that
// list. Times are compared by climbing to a common height and then in step. Chains may be long (on
// a smooth channel keys fall steadily inward), so each event has a `jump` further up, placed as in
// a skew-binary counter (Myers 1983).
//
//     key   9   4   6   2   3          up(2) = 6, up(6) = 9, up(4) = 9, up(3) = 6
//          [a]-[b]-[c]-[d]-[e]         times: d = 9 6 2, e = 9 6 3, c = 9 6, b = 9 4, a = 9
//                                      order: a < b < c < d < e
//
// An event may be *dead* until it is released: it holds its place in the order for those that
// still hang from it, though its triangle may be gone.
//
// Invariants: key(up) > key; depth = depth(up) + 1; the root has depth 0 and key +inf.
// Cost: O(log n) to add, to compare, to give one event another place, for any shape of forest;
// 32 bytes an event.
#pragma once

#include <algorithm>
#include <limits>
#include <string>
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

    explicit Forest(const Triangulation& t) : t_(t) {}

    void clear(std::size_t expected) {
        free_.clear();
        graves_.clear();
        events_.clear();
        events_.reserve(expected + 1);
        events_.push_back(
            {std::numeric_limits<double>::infinity(), kNone, kNone, kRoot, kRoot, 0, 0});
    }

    double key(Index e) const { return events_[at(e)].key; }
    Index edge(Index e) const { return events_[at(e)].edge; }
    Gate gate(Index e) const { return {key(e), edge(e)}; }
    Index parent(Index e) const { return events_[at(e)].parent; }

    Index add(Gate g, Index parent) {
        Index e = static_cast<Index>(events_.size());
        if (!free_.empty()) {
            e = free_.back();
            free_.pop_back();
        } else {
            events_.emplace_back();
        }
        events_[at(e)] = {g.key, g.edge, kNone, kNone, kNone, 0, 0};
        place(e, parent);
        return e;
    }

    // Hangs e from a parent. To be said again, from above down, of all that hang from it and have
    // no larger key between.
    void place(Index e, Index parent) {
        Gate g = gate(e);
        Index up = parent;
        while (less_than(up, g)) up = less_than(jump(up), g) ? jump(up) : this->up(up);
        Index over = jump(up);
        bool even = depth(up) - depth(over) == depth(over) - depth(jump(over));
        Event& event = events_[at(e)];
        event.parent = parent;
        event.up = up;
        event.jump = even ? jump(over) : up;
        event.depth = depth(up) + 1;
    }
    // Gives an event a parent in whose stead its place in the order is the same.
    void rename_parent(Index e, Index parent) { events_[at(e)].parent = parent; }

    // A mark that lasts until the next one is made.
    void new_mark() {
        if (++mark_ < std::numeric_limits<Index>::max()) return;
        for (Event& e : events_) e.mark = 0;
        mark_ = 1;
    }
    void mark(Index e) { events_[at(e)].mark = mark_; }
    bool is_marked(Index e) const { return events_[at(e)].mark == mark_; }

    // Ends an event while its triangle is there. What hangs from it keeps its place in the order.
    void die(Index e) {
        graves_.push_back(corners(edge(e)));
        events_[at(e)].edge = kNone - static_cast<Index>(graves_.size());
    }
    bool is_dead(Index e) const { return edge(e) < kNone; }

    // Gives the place of an event back from which nothing hangs.
    void withdraw(Index e) {
        events_[at(e)].parent = kNone;
        free_.push_back(e);
    }

    // Takes all dead events out of the forest, which are those given, and gives their places back.
    // None that stays may hang from one of them.
    void release(const std::vector<Index>& dead) {
        free_.insert(free_.end(), dead.begin(), dead.end());
        graves_.clear();
    }

    // The largest key on the paths to a and b below an event on both; -inf if one is the other.
    double largest_apart(Index a, Index b) const {
        Index p = climb(a, depth(b)), q = climb(b, depth(a));
        if (p == q) {
            if (depth(a) == depth(b)) return -std::numeric_limits<double>::infinity();
            return key(depth(a) > depth(b) ? climb(a, depth(b) + 1) : climb(b, depth(a) + 1));
        }
        climb_in_step(p, q);
        return std::max(key(p), key(q));
    }

    // Whether a happens before b. Two with the same gate are told apart by their place, so that a
    // heap of them stays consistent.
    bool earlier(Index a, Index b) const {
        Index p = climb(a, depth(b)), q = climb(b, depth(a));
        if (p == q) return depth(a) < depth(b);
        climb_in_step(p, q);
        return less(p, q);
    }

    template <class Archive>
    void transfer(Archive& archive) {
        archive(events_);
        archive(free_);
        archive(mark_);
    }

    std::size_t bytes() const {
        return events_.capacity() * sizeof(Event) + free_.capacity() * sizeof(Index);
    }

   private:
    struct Event {
        double key;
        Index edge, parent, up, jump, depth, mark;
    };

    Index up(Index e) const { return events_[at(e)].up; }
    Index jump(Index e) const { return events_[at(e)].jump; }
    Index depth(Index e) const { return events_[at(e)].depth; }

    bool less_than(Index e, Gate g) const { return e != kRoot && less(gate(e), g); }

    Index climb(Index e, Index height) const {
        while (depth(e) > height) e = depth(jump(e)) >= height ? jump(e) : up(e);
        return e;
    }
    // From two events of the same depth to those just below the first common one.
    void climb_in_step(Index& p, Index& q) const {
        while (up(p) != up(q)) {
            bool far = jump(p) != jump(q);
            p = far ? jump(p) : up(p);
            q = far ? jump(q) : up(q);
        }
    }

    // Apex, origin and target of a gate: what equal keys are told apart by.
    struct Corners {
        Point k, i, j;
    };
    Corners corners(Index edge) const {
        if (edge < kNone) return graves_[at(kNone - 1 - edge)];
        const Mesh& m = t_.mesh();
        return {t_.site(m.apex(edge)), t_.site(m.origin(edge)), t_.site(m.target(edge))};
    }

    // As smaller(), and as it was for the dead.
    bool less(Gate a, Gate b) const {
        if (a.key != b.key) return a.key < b.key;
        if (a.edge == b.edge) return false;
        Corners c = corners(a.edge), d = corners(b.edge);
        if (!(c.k == d.k)) return c.k < d.k;
        return c.i == d.i ? c.j < d.j : c.i < d.i;
    }
    // The same gate may have been entered twice, once by an event that is dead.
    bool less(Index a, Index b) const {
        if (key(a) != key(b)) return key(a) < key(b);
        return less(gate(a), gate(b)) || (a < b && !less(gate(b), gate(a)));
    }

    const Triangulation& t_;
    std::vector<Event> events_;
    std::vector<Index> free_;
    std::vector<Corners> graves_;  // of the dead
    Index mark_ = 0;
};

}  // namespace flintknap
