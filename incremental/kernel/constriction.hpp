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
#include <limits>
#include <string>
#include <unordered_map>
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
        } while (settle_orphan() || take_earliest());
        for (Index x : created_) mend_ring(x);
        for (Index x : changed_) mend_ring(x);
        for (Index v : loosened_) {
            if (!on_ring(v)) following_[at(v)] = kNone;  // so that it is told when it comes back
        }
        forest_.release(retired_);
        retired_.clear();
        orphans_.clear();
        forget_hanging();
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
        orphans_.clear();
        forget_hanging();
        waiting_.clear();
        heap_.clear();
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

    struct Candidate {
        Index event, parent;
    };
    struct Sooner {
        const Constriction& c;
        bool operator()(Index a, Index b) const { return c.forest_.earlier(a, b); }
        bool operator()(Candidate a, Candidate b) const {
            return c.forest_.earlier(a.event, b.event);
        }
    };

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
        hanging_.emplace(forest_.parent(e), e);
        forest_.die(e);
        retired_.push_back(e);
        ++touched_;
    }

    void orphan(Index e) {
        hanging_.emplace(forest_.parent(e), e);
        orphans_.push(e);
    }

    // Clearing many buckets would be the dearest part of all small repairs to come.
    void forget_hanging() {
        if (hanging_.bucket_count() > 4096) hanging_ = {};
        hanging_.clear();
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
        if (parent == kNone || t_.mesh().is_ghost(x)) return;
        if (event_of_[at(x)] != kNone) {
            Index e = entered_through(edge);
            if (e != kNone && forest_.parent(e) != parent) graft(e, parent);
            return;
        }
        Index holder = holder_[at(t_.mesh().apex(edge))];
        if (holder == Forest::kRoot) return;
        Index e = forest_.add(make_gate(t_, edge), parent);
        if (holder != kNone && forest_.earlier(holder, e)) {
            forest_.withdraw(e);
        } else {
            hanging_.emplace(parent, e);
            heap_.push({e, parent});
        }
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

    // The earliest gate in the heap captures its target, if it still can. False if there is none.
    bool take_earliest() {
        if (heap_.empty()) return false;
        const Mesh& m = t_.mesh();
        Candidate c = heap_.pop();
        Index edge = forest_.edge(c.event), x = Mesh::triangle(edge);
        Index target = m.apex(edge), holder = holder_[at(target)];
        bool is_open = event_of_[at(x)] == kNone && opener(edge) == c.parent;
        if (!is_open || holder == Forest::kRoot ||
            (holder != kNone && forest_.earlier(holder, c.event))) {
            forest_.withdraw(c.event);
            return true;
        }
        if (holder != kNone) put_back(holder);
        event_of_[at(x)] = c.event;
        hold(target, c.event);
        ++touched_;
        changed_.push_back(x);
        wait_for_freed();
        waiting_.push_back(m.twin(Mesh::next(edge)));
        waiting_.push_back(m.twin(Mesh::prev(edge)));
        return true;
    }

    bool is_orphan(Index e) const {
        if (forest_.is_dead(e)) return false;
        return opener(forest_.edge(e)) != forest_.parent(e);
    }

    // An orphan that no gate leads to any more ends. False if there is none.
    bool settle_orphan() {
        drop_settled();
        if (orphans_.empty()) return false;
        if (!heap_.empty() && forest_.earlier(heap_.top().event, orphans_.top())) return false;
        Index e = orphans_.pop(), parent = opener(forest_.edge(e));
        if (parent == kNone || !graft(e, parent)) {
            put_back(e);
            wait_for_freed();
        }
        return true;
    }

    void drop_settled() {
        while (!orphans_.empty() && !is_orphan(orphans_.top())) orphans_.pop();
    }

    // Hangs event e from the event that opens its gate now. False if that one hangs from e.
    bool graft(Index e, Index parent) {
        double bound = forest_.largest_apart(forest_.parent(e), parent);
        if (forest_.key(e) > bound) {
            forest_.rename_parent(e, parent);
            return true;
        }
        // What hangs from e with no larger key than the bound between; nothing else gets another
        // place in the order.
        inside_.start(forest_);
        inside_.push(e);
        while (visit(inside_, e, bound)) {
            if (inside_.seen.back() == parent) return false;
        }
        forest_.rename_parent(e, parent);
        for (Index x : inside_.seen) forest_.place(x, forest_.parent(x));
        work_ += inside_.seen.size();
        if (inside_.meets_gates) restore(heap_);
        if (inside_.meets_orphans) restore(orphans_);
        recheck(e, bound);
        return true;
    }

    // The order of those inside and all else may have changed where no key above `bound` lies
    // between. Either they or the others are offered anew, gate by gate, whichever are fewer.
    void recheck(Index e, double bound) {
        if (inside_.seen.size() == 1) return wait_for(inside_);  // spares a look along the hull
        Index top = forest_.parent(e);
        outside_.start(forest_);
        outside_.seen.push_back(top);
        push_children(outside_, top, e, bound);
        while (outside_.seen.size() < inside_.seen.size()) {
            if (visit(outside_, e, bound)) continue;
            if (top == Forest::kRoot || forest_.key(top) > bound) return wait_for(outside_);
            Index below = std::exchange(top, forest_.parent(top));
            outside_.seen.push_back(top);
            push_children(outside_, top, below, bound);
        }
        wait_for(inside_);
    }

    // A walk down the forest: events still to be visited, and those seen; whether gates that wait
    // in the heap are among them, or orphans.
    struct Walk {
        std::vector<Index> stack, seen;
        bool meets_gates = false, meets_orphans = false;

        void start(Forest& forest) {
            stack.clear();
            seen.clear();
            meets_gates = meets_orphans = false;
            forest.new_mark();
        }
        void push(Index e) { stack.push_back(e); }
    };

    bool visit(Walk& walk, Index e, double bound) {
        while (!walk.stack.empty() && forest_.is_marked(walk.stack.back())) walk.stack.pop_back();
        if (walk.stack.empty()) return false;
        Index x = walk.stack.back();
        walk.stack.pop_back();
        walk.seen.push_back(x);
        forest_.mark(x);
        push_children(walk, x, e, bound);
        return true;
    }

    // All that hang from x, but one, by keys no larger than the bound.
    void push_children(Walk& walk, Index x, Index but, double bound) {
        const Mesh& m = t_.mesh();
        auto push = [&](Index child) {
            if (child == kNone || child == but || forest_.parent(child) != x) return;
            if (forest_.key(child) <= bound) walk.push(child);
        };
        if (x == Forest::kRoot) {
            for (Index h : t_.hull()) push(entered_through(h));
        } else if (!forest_.is_dead(x)) {
            Index edge = forest_.edge(x);
            push(entered_through(m.twin(Mesh::next(edge))));
            push(entered_through(m.twin(Mesh::prev(edge))));
        }
        auto [first, last] = hanging_.equal_range(x);
        for (; first != last; ++first) {
            Index child = first->second;
            push(child);
            if (forest_.is_dead(child)) continue;
            (is_taken(child) ? walk.meets_orphans : walk.meets_gates) = true;
        }
    }

    // Whether an event has removed its triangle; others wait in the heap, or are dead.
    bool is_taken(Index e) const { return entered_through(forest_.edge(e)) == e; }

    void wait_for(const Walk& walk) {
        const Mesh& m = t_.mesh();
        work_ += walk.seen.size();
        for (Index x : walk.seen) {
            if (x == Forest::kRoot) {
                for (Index h : t_.hull()) waiting_.push_back(h);
            } else if (!forest_.is_dead(x) && is_taken(x)) {
                Index edge = forest_.edge(x);
                waiting_.push_back(m.twin(Mesh::next(edge)));
                waiting_.push_back(m.twin(Mesh::prev(edge)));
                wait_for_gates_at(m.apex(edge));
            }
        }
    }

    template <class T>
    void restore(Heap<T, Sooner>& heap) {
        work_ += heap.items().size();
        heap.restore();
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
    // By parent, what hangs from it and the triangles do not tell: the dead, their orphans, gates
    // in the heap. An entry holds while its parent is still the one it says.
    std::unordered_multimap<Index, Index> hanging_;
    std::size_t work_ = 0;  // places in the order that were written or looked at
    Walk inside_, outside_;
    Heap<Candidate, Sooner> heap_{Sooner{*this}};
    Heap<Index, Sooner> orphans_{Sooner{*this}};
};

}  // namespace flintknap
