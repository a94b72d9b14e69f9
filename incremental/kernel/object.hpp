// One object: its points and all that is derived from them, brought up to date when asked.
//
// Theory. Points that arrive only wait; points that leave do so at once, from among those that wait
// or from the triangulation. Before a query the rest is settled: those that wait are placed in the
// triangulation in biased randomised order, and the constriction is repaired around all changes
// since the last query if they are few, or made from scratch if they are many, and so is the
// widening. Both give the same result, so which one is taken is a matter of cost alone, and so is
// how long points have waited. The same holds for the ring as a sequence (ring.hpp), which is
// brought up to date when a query needs it, and takes no memory before; for the notes about what it
// was (notes.hpp); and for the ring as results hold it (outline.hpp), which follows by these notes
// once it has been asked for a second time.
//
// Interrupts and ends of memory: settling may stop between two points. Those placed stay placed,
// the others wait on, the constriction is made from scratch next time; nothing is lost.
#pragma once

#include <memory>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "cells.hpp"
#include "constriction.hpp"
#include "gamma.hpp"
#include "hierarchy.hpp"
#include "notes.hpp"
#include "outline.hpp"
#include "points.hpp"
#include "queries.hpp"
#include "splices.hpp"
#include "widening.hpp"

namespace flintknap {

class Object {
   public:
    // An empty object whose ids and revisions go on from those given.
    explicit Object(Limit limit = {}, std::int64_t next_id = 0, std::int64_t revision = 0)
        : points_(triangulation_, next_id, revision),
          widening_(triangulation_, constriction_, constriction_.links(), limit) {}
    Object(const Object&) = delete;
    Object& operator=(const Object&) = delete;

    const Points& points() const { return points_; }
    const Triangulation& triangulation() const { return triangulation_; }
    const Constriction& constriction() const { return constriction_; }
    const Widening& widening() const { return widening_; }

    std::int64_t insert(Point p) {
        points_.make_room(1);
        return points_.add(p);
    }

    // So that n inserts cannot fail.
    void make_room(std::size_t n) { points_.make_room(n); }

    template <class PointOf>
    void insert(std::size_t n, PointOf point, std::int64_t* ids) {
        points_.make_room(n);
        points_.add(n, point, ids);
    }

    // Takes one away from the multiplicity of a point, and the point itself with the last one.
    void remove(Index handle) {
        if (points_.multiplicity(handle) > 1) {
            points_.take_one(handle);
            return;
        }
        if (points_.slot(handle) >= 0) remove_site(handle, false);
        points_.remove(handle);
    }

    // Moves one of a point's multiplicity to p and returns the id there: the same one if the whole
    // point moves and none was at p.
    std::int64_t move(Index handle, Point p) {
        Index there = points_.find(p);
        if (there == handle) return points_.id(handle);
        points_.make_room(1);
        if (there != kNone || points_.multiplicity(handle) > 1) {
            remove(handle);
            return points_.add(p);
        }
        if (points_.slot(handle) >= 0) remove_site(handle, true);
        points_.move(handle, p);
        return points_.id(handle);
    }

    bool is_placed() const { return points_.waiting().empty(); }
    bool is_settled() const { return is_placed() && state_ == State::fresh; }
    // Whether settling takes long enough to let others run meanwhile.
    bool is_long_to_settle() const {
        return state_ == State::stale || points_.waiting().size() > 16;
    }

    // Places the points that wait. `poll` is called now and then and may throw to interrupt.
    template <class Poll>
    void place(Poll poll) {
        State before = expect_changes(points_.waiting().size());
        try {
            if (before == State::stale) {
                Nobody nobody;
                place_waiting(nobody, poll);
            } else {
                place_waiting(constriction_, poll);
                state_ = State::changed;
            }
        } catch (...) {
            points_.drop_placed();
            throw;
        }
        points_.drop_placed();
    }

    // Places the points that wait and brings the constriction up to date.
    template <class Poll>
    void settle(Poll poll) {
        if (!is_placed()) place(poll);
        State before = std::exchange(state_, State::stale);
        if (before == State::changed && constriction_.repair()) {
            widening_.repair(poll);
            constriction_.forget_changes();
        } else if (before != State::fresh) {
            widening_.clear();
            if (!triangulation_.is_flat()) {
                constriction_.build();
                widening_.build(poll);
                if (at(triangulation_.size()) > kLarge) give_back_reserve();
            }
        }
        state_ = State::fresh;
        changes_ = 0;
    }

    // The boundary, of what is settled. Whoever asks for the ring reads it here.
    Index ring_size() const {
        if (triangulation_.is_flat()) return 0;
        return triangulation_.size() - constriction_.left_inside() + widening_.captured();
    }
    bool on_ring(Index v) const { return widening_.on_ring(v); }
    Index following(Index v) const { return widening_.following(v); }
    // Fetches what following(v) and site(v) will read.
    [[gnu::always_inline]] void prefetch(Index v) const {
        constriction_.prefetch_following(v);
        __builtin_prefetch(triangulation_.sites().data() + v);
    }
    // The vertices that are not on it, in no order. O(clusters).
    std::vector<Index> inside() const { return widening_.inside(); }
    Index smallest() const { return triangulation_.smallest(); }
    Index slots() const { return triangulation_.slots(); }
    Point site(Index v) const { return triangulation_.site(v); }
    Id id(Index v) const { return points_.id_in_slot(v); }
    // Of the point with an id; negative if there is none.
    Index slot_of(Id id) const {
        Index handle = points_.find(id);
        return handle == kNone ? kNone : points_.slot(handle);
    }

    // The same as a sequence with ranks and boxes, as it was at the last update_ring.
    const Ring& ring() const { return ring_; }
    void update_ring() {
        Links& links = constriction_.links();
        if (links.all() && (hierarchy_.is_begun() || farthest_.is_begun())) {
            splices_.compare(ring_, *this, links);
        }
        notes_.note(ring_, *this, links, points_.revision());
        hierarchy_.hear(links);
        farthest_.hear(links);
        try {
            if (splices_.update(ring_, *this, links)) cells_.follow(splices_);
        } catch (...) {
            notes_.forget();  // the ring tells no longer what it was
            throw;
        }
        ring_revision_ = points_.revision();
    }
    bool is_ring_fresh() const { return ring_revision_ == points_.revision(); }
    bool is_long_to_update_ring() const { return constriction_.links().all() && ring_size() > 0; }

    // How the ring differs from what it was at a revision. What it was is noted once somebody has
    // begun to follow. Both want the ring up to date.
    void follow() {
        if (!notes_.is_kept()) notes_.begin(points_.revision());
    }
    Notes::Difference changes(std::int64_t since) const {
        return notes_.compare(since, ring_, *this);
    }

    // The ring as results hold it, as it was at the last update_outline.
    const std::shared_ptr<const Outline>& outline() const { return outline_; }
    bool is_outline_fresh() const {
        return outline_ != nullptr && outline_revision_ == points_.revision();
    }
    void update_outline() {
        if (outline_ == nullptr) {
            outline_ = make_outline();
        } else {
            update_ring();
            Notes::Difference found = changes(outline_revision_);
            if (!found.is_known) {
                outline_ = make_outline();
            } else if (!found.runs.empty()) {
                outline_ = OutlineUpdate::make(*outline_, found, ring_, *this);
            }
            follow();
        }
        outline_revision_ = points_.revision();
    }

    // What lies where, on the same ring.
    Cells& cells() { return cells_; }

    // The tree of Flintstones over it, and the one parted at farthest vertices; not to be asked
    // while there is no ring.
    Hierarchy& hierarchy() { return hierarchy_; }
    Hierarchy& farthest() { return farthest_; }
    // The one that a cut goes through: a tolerance takes the fewest vertices in the second.
    Hierarchy& tree(Cut cut) {
        return cut.tolerance == Hierarchy::kAnyError ? hierarchy_ : farthest_;
    }

    // To a Writer, or from a Reader; everything must be settled.
    template <class Archive>
    void transfer(Archive& archive) {
        std::uint64_t stamp = kStamp;
        archive(stamp);
        if (stamp != kStamp) throw std::invalid_argument("another build wrote the bytes");
        points_.transfer(archive);
        triangulation_.transfer(archive);
        constriction_.transfer(archive);
        widening_.transfer(archive);
    }

    std::size_t bytes() const {
        return points_.bytes() + triangulation_.bytes() + constriction_.bytes() +
               widening_.bytes() + ring_.bytes() + splices_.bytes() + cells_.bytes() +
               hierarchy_.bytes() + farthest_.bytes() + notes_.bytes() +
               (outline_ == nullptr ? 0 : outline_->bytes());
    }

    // The first broken invariant, or nothing. Everything must be settled. O(n log n).
    std::string check() const {
        for (std::string broken : {points_.check(), triangulation_.check()}) {
            if (!broken.empty()) return broken;
        }
        std::string broken = notes_.check();
        if (broken.empty() && is_outline_fresh() && !(*outline_ == *make_outline())) {
            broken = "the outline is not the ring";
        }
        if (triangulation_.is_flat()) return broken;  // and the ring sequence is not asked
        if (broken.empty()) broken = constriction_.check();
        if (broken.empty()) broken = widening_.check();
        if (!broken.empty() || !constriction_.links().none()) return broken;
        broken = ring_.check(*this);
        if (broken.empty()) broken = cells_.check();
        if (broken.empty()) broken = hierarchy_.check();
        return broken.empty() ? farthest_.check() : broken;
    }

   private:
    // Tells byte order, and layouts by a number that changes with them.
    static constexpr std::uint64_t kStamp = 0x666c696e74000008ULL;

    // Of the constriction: true of the triangulation, waiting for repair, or to be made anew.
    enum class State { fresh, changed, stale };

    // One change to so many sites is few: repairs cost less than a run from scratch.
    static constexpr std::size_t kFew = 1024;

    // So many sites are worth giving back what making their boundary took besides.
    static constexpr std::size_t kLarge = 50'000;

    // The state to start n changes from: stale if they are better not followed. Until they are
    // done, and for good if they fail midway, the constriction is stale.
    State expect_changes(std::size_t n) {
        changes_ += n;
        bool few = !triangulation_.is_flat() && changes_ <= 1 + at(triangulation_.size()) / kFew;
        return few ? std::exchange(state_, State::stale) : state_ = State::stale;
    }

    std::shared_ptr<const Outline> make_outline() const {
        Array<Index> vertices(at(ring_size()));
        Index next = smallest();
        for (Index& v : vertices) next = following(v = next);
        Stretch all;
        all.ids.resize(vertices.size());
        auto slot_of = [&](std::size_t i) { return vertices[i]; };
        points_.ids_in_slots(vertices.size(), slot_of, all.ids.data());
        all.xy.reserve(vertices.size());
        for (Index v : vertices) all.xy.push_back(site(v));
        return std::make_shared<const Outline>(std::move(all));
    }

    // Takes the site of a point away, for ever or to be moved.
    void remove_site(Index handle, bool is_moved) {
        Index slot = points_.slot(handle);
        if (expect_changes(1) == State::stale) {
            Nobody nobody;
            triangulation_.remove(slot, nobody);
            notes_.vacate(ring_, slot, points_.id(handle), is_moved);
            return;
        }
        triangulation_.remove(slot, constriction_);
        notes_.vacate(ring_, slot, points_.id(handle), is_moved);
        if (triangulation_.is_flat()) return;
        try {
            constriction_.vanished();
            constriction_.created(triangulation_.created());
            state_ = State::changed;
        } catch (const std::bad_alloc&) {
            // The site is gone and cannot come back; but a stale constriction loses nothing.
        }
    }

    template <class Observer, class Poll>
    void place_waiting(Observer& observer, Poll& poll) {
        const Array<Points::Waiting>& waiting = points_.waiting();
        std::size_t n = waiting.size(), placed = at(triangulation_.size());
        if (n == 0) return;
        if (n > placed) triangulation_.reserve(placed + n);
        // The site before is a good start for the walk, unless the batch is sparse among the sites
        // or a cluster finer than the curve's cells hides the order within it: ask the hints then.
        bool dense = 4 * n >= placed;
        Index last = kNone;
        Order order = insertion_order(n, [&](std::size_t i) { return waiting[i].point; });
        for (std::size_t first = 0; first < n; first += Batch::kMost) {
            if (first % 16384 == 16384 - Batch::kMost) poll();
            Batch batch(points_);
            std::size_t count = std::min(Batch::kMost, n - first);
            for (std::size_t i = 0; i < count; ++i) batch.which[i] = waiting[order[first + i]];
            for (std::size_t& i = batch.placed; i < count;) {
                bool near = dense && first + i > 0 && !order.is_tied(first + i);
                last = triangulation_.insert(batch.which[i].point, near ? last : kNone, observer);
                batch.slots[i++] = last;
                observer.appeared(last);
                observer.created(triangulation_.created());
            }
        }
    }

    // Some of those that wait, in the order in which they are placed: what is scattered over memory
    // is fetched, and noted in the end, for many at a time.
    struct Batch {
        static constexpr std::size_t kMost = 256;

        explicit Batch(Points& points) : points_(points) {}
        Batch(const Batch&) = delete;
        Batch& operator=(const Batch&) = delete;
        ~Batch() { points_.placed(which, slots, placed); }

        Points::Waiting which[kMost];
        Index slots[kMost];
        std::size_t placed = 0;

       private:
        Points& points_;
    };

    Triangulation triangulation_;
    Points points_;
    Constriction constriction_{triangulation_};
    Widening widening_;
    Ring ring_;
    Splices splices_;
    Cells cells_{ring_};
    Hierarchy hierarchy_{triangulation_, ring_, Parting::smaller_disc};
    Hierarchy farthest_{triangulation_, ring_, Parting::farthest};
    Notes notes_;
    std::shared_ptr<const Outline> outline_;
    std::int64_t outline_revision_ = 0;
    std::int64_t ring_revision_ = -1;  // of the last update_ring
    State state_ = State::fresh;
    std::size_t changes_ = 0;  // since the constriction was fresh
};

}  // namespace flintknap
