// No vertex left inside: where the constriction locks, wider gamma-graphs go on.
//
// Theory (section 3.4). A *candidate* is an edge ij of the ring and a vertex k inside such that the
// triangle ijk lies in the object and holds no other site. Its need (sight.hpp) tells how wide a
// graph must be to have ik and jk. The graph is widened only if no candidate needs it no wider, as
// far as one candidate needs it; of the candidates that may then be taken, that with the smallest
// key (forest.hpp) is: k joins the ring between i and j. Again and again, down to a limit.
//
//      i --------> j            i       j       the triangle i, j, k is no longer inside; it need
//       \         /      ==>     \     /        not be one of the triangulation, and the edges of
//        \       /                v   ^         that which cross it are not those of the ring
//            k                      k
//
// *Clusters.* A cluster of locked vertices is widened by itself, as if no other vertex could be
// captured. Two clusters do not meet if none of their captured triangles overlap, and no new edge
// of one makes a candidate with a member of the other that it could have used. Then neither takes
// anything that the other takes, nor offers it anything, and how far one has to widen is nothing to
// the other, which goes on when its own candidates are reached: together they do what a run over
// all locked vertices does, which has widened as far as the cluster that had to widen most. Those
// that meet are united and widened again. After a change only the clusters are made anew that
// passed through a triangle that is gone, or beside one that has come, left the object or joined
// it.
//
// Invariants (check): ring, limit and vertices inside are those of a run from scratch; every vertex
// that the constriction left is in one cluster, and so is no other.
// Cost: what the searches pass through, a few triangles a locked vertex for evenly spread sites;
// all that it sees for a vertex that only the widest graphs free, or none. Nothing if none is
// locked.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "sight.hpp"
#include "table.hpp"

namespace flintknap {

// How far to widen: d, and the cotangent it stands for; 0 is not at all.
struct Limit {
    double d = -1, cotangent = -std::numeric_limits<double>::infinity();
};

class Widening {
   public:
    Widening(const Triangulation& triangulation, const Constriction& constriction, Links& links,
             Limit limit)
        : t_(triangulation),
          c_(constriction),
          links_(links),
          sight_(triangulation, constriction),
          limit_(limit) {}

    Limit limit() const { return limit_; }

    // The ring of the object, widened.
    bool on_ring(Index v) const { return c_.on_ring(v) || follows_[v] != kNone; }
    Index following(Index v) const {
        Index next = follows_[v];
        return next == kNone ? c_.following(v) : next;
    }

    // The vertices that are not on it, in no order. O(clusters).
    std::vector<Index> inside() const {
        std::vector<Index> left;
        for (const Cluster& c : clusters_) {
            for (Index v : c.members) {
                if (!on_ring(v)) left.push_back(v);
            }
        }
        return left;
    }

    // How many vertices are on it that the constriction left inside.
    Index captured() const { return captured_; }

    // How far it was widened, as a cotangent. O(clusters).
    double reached() const {
        double least = 0;
        for (const Cluster& c : clusters_) least = std::min(least, c.reached);
        return least;
    }

    // From scratch. O(n), and the searches.
    template <class Poll>
    void build(Poll poll) {
        clear();
        pending_.clear();
        for (Index v = 0; c_.left_inside() > 0 && v < t_.slots(); ++v) {
            if (is_locked(v)) pending_.push_back(v);
        }
        settle(poll);
    }

    // After a repair of the constriction, which still knows what has changed.
    template <class Poll>
    void repair(Poll poll) {
        pending_.clear();
        for (Index x : c_.destroyed()) dissolve_all(x);
        for (Index x : c_.created()) look_again(x, true);
        for (Index x : c_.changed()) look_again(x, false);
        for (Index v : c_.loosened()) {
            if (is_locked(v)) dissolve_around(v);
            pending_.push_back(v);
        }
        auto is_done = [&](Index v) { return !is_locked(v); };
        pending_.erase(std::remove_if(pending_.begin(), pending_.end(), is_done), pending_.end());
        std::sort(pending_.begin(), pending_.end());
        pending_.erase(std::unique(pending_.begin(), pending_.end()), pending_.end());
        settle(poll);
    }

    void clear() {
        clusters_.clear();
        free_.clear();
        forget_tables();
    }

    template <class Archive>
    void transfer(Archive& archive) {
        archive(limit_);
        std::uint64_t count = clusters_.size();
        archive(count);
        clusters_.resize(count);
        for (Cluster& c : clusters_) {
            archive(c.members);
            archive(c.triangles);
            archive(c.rim);
            archive(c.covered);
            archive(c.captures);
            archive(c.sightings);
            archive(c.reached);
        }
        archive(free_);
        if (!cluster_of_.empty()) return;  // these were written; of those that were read:
        for (Index id = 0; id < static_cast<Index>(clusters_.size()); ++id) {
            enroll(id);
            link(cluster(id));
        }
    }

    std::size_t bytes() const {
        std::size_t sum = clusters_.capacity() * sizeof(Cluster);
        for (const Table* each : {&passed_, &covered_, &sighted_, &cluster_of_, &follows_})
            sum += each->bytes();
        for (const Cluster& c : clusters_) {
            sum += (c.members.capacity() + c.triangles.capacity() + c.rim.capacity() +
                    c.covered.capacity()) *
                       sizeof(Index) +
                   c.captures.capacity() * sizeof(Capture) +
                   c.sightings.capacity() * sizeof(Sighting);
        }
        return sum;
    }

    // The first broken invariant, or nothing.
    std::string check() const {
        Links nobody_looks;
        Widening other(t_, c_, nobody_looks, limit_);
        other.build([] {});
        std::vector<bool> known(at(t_.slots()));
        for (const Cluster& c : clusters_) {
            for (Index v : c.members) {
                if (!is_locked(v) || known[at(v)]) {
                    return "vertex " + std::to_string(v) + " should not be in a cluster";
                }
                known[at(v)] = true;
            }
        }
        for (Index v = 0; v < t_.slots(); ++v) {
            if (!t_.is_site(v)) continue;
            if (is_locked(v) != known[at(v)]) {
                return "vertex " + std::to_string(v) + " is locked and in no cluster";
            }
            if (on_ring(v) != other.on_ring(v)) {
                return "vertex " + std::to_string(v) + (on_ring(v) ? " is" : " is not") +
                       " on the widened ring, from scratch it is otherwise";
            }
            if (on_ring(v) && following(v) != other.following(v)) {
                return "vertex " + std::to_string(v) + " is followed by " +
                       std::to_string(following(v)) + " on the widened ring, from scratch by " +
                       std::to_string(other.following(v));
            }
        }
        return reached() == other.reached() ? "" : "widened to another d than from scratch";
    }

   private:
    struct Capture {
        Index i, j, k;
    };
    struct Candidate {
        double need, key;
        Capture gate;
    };
    struct Sooner {
        const Triangulation& t;
        bool operator()(const Candidate& a, const Candidate& b) const {
            if (a.key != b.key) return a.key < b.key;
            if (a.gate.k != b.gate.k) return t.site(a.gate.k) < t.site(b.gate.k);
            if (a.gate.i != b.gate.i) return t.site(a.gate.i) < t.site(b.gate.i);
            return t.site(a.gate.j) < t.site(b.gate.j);
        }
    };
    struct Nearer {
        bool operator()(const Candidate& a, const Candidate& b) const { return a.need > b.need; }
        bool operator()(const Sight::Window& a, const Sight::Window& b) const {
            return a.bound > b.bound;
        }
    };
    struct Sighting {
        Index of, from;
    };
    struct Cluster {
        std::vector<Index> members;  // locked vertices
        std::vector<Capture> captures;
        double reached = 0;               // the least need that was taken
        std::vector<Index> triangles;     // that the members' searches passed through
        std::vector<Index> rim;           // half-edges of these on the ring, sorted
        std::vector<Index> covered;       // triangles that the captured ones overlap
        std::vector<Sighting> sightings;  // locked vertices, and which member sees them
        bool is_enrolled = false, is_linked = false;
        // Until all clusters are settled: members who have not begun to search, windows that are
        // yet to be looked through, and candidates that others have led to.
        std::vector<Index> fresh;
        std::vector<Sight::Window> ahead;
        std::vector<Candidate> found;
        bool is_known = false;  // these are there
    };

    bool is_locked(Index v) const { return t_.is_site(v) && !c_.on_ring(v); }

    // Puts the vertices that wait into clusters and widens these, until no two of them meet.
    template <class Poll>
    void settle(Poll poll) {
        made_.clear();
        for (Index v : pending_) made_.push_back(add_cluster(v));
        std::vector<Index> open = made_, united;
        for (; !open.empty(); std::swap(open, united)) {
            for (Index id : open) {
                run(cluster(id), poll);
                enroll(id);
            }
            united.clear();
            for (Index id : open) {
                if (cluster(id).is_enrolled && unite_with_those_met(id)) united.push_back(id);
            }
        }
        for (Index id : made_) {
            if (cluster(id).is_enrolled) link(cluster(id));
            cluster(id).ahead = {};
            cluster(id).found = {};
            cluster(id).is_known = false;
        }
    }

    Cluster& cluster(Index id) { return clusters_[at(id)]; }

    Index add_cluster(Index v) {
        Index id = static_cast<Index>(clusters_.size());
        if (free_.empty()) {
            clusters_.emplace_back();
        } else {
            id = free_.back();
            free_.pop_back();
        }
        cluster(id).members.push_back(v);
        cluster(id).fresh.push_back(v);
        return id;
    }

    // ---------------------------------------------------------------- one cluster
    // Widens it until all its members are on the ring or nothing is left that the limit allows.
    template <class Poll>
    void run(Cluster& c, Poll poll) {
        ready_.clear();
        later_.clear();
        frontier_.clear();
        ring_.clear();
        c.captures.clear();
        c.covered.clear();
        c.rim.clear();
        c.reached = 0;
        for (const Sight::Window& w : c.ahead) frontier_.push(w);
        for (const Candidate& each : c.found) later_.push(each);
        c.ahead.clear();
        for (Index k : c.fresh) {
            sight_.open(
                k, [&](Index x) { c.triangles.push_back(x); }, [&](Index v) { notice(c, v, k); },
                [&](const Sight::Window& w) { frontier_.push(w); });
        }
        c.fresh.clear();
        for (std::int64_t steps = 1; limit_.cotangent < 0 && step(c); ++steps) {
            if (steps % 4096 == 0) poll();
        }
        append(c.ahead, frontier_.items());
        c.is_known = true;
        make_unique(c.triangles);
        const Mesh& m = t_.mesh();
        for (Index x : c.triangles) {
            for (Index h = 3 * x; h < 3 * x + 3; ++h) {
                if (!c_.is_inside(Mesh::triangle(m.twin(h)))) c.rim.push_back(h);
            }
        }
        for (const Capture& taken : c.captures) {
            for (auto [a, b] : sides(taken))
                sight_.pass_along(a, b, [&](Index x) { c.covered.push_back(x); });
        }
        make_unique(c.covered);
    }

    static void make_unique(std::vector<Index>& values) {
        std::sort(values.begin(), values.end());
        values.erase(std::unique(values.begin(), values.end()), values.end());
    }

    static std::array<std::pair<Index, Index>, 3> sides(Capture g) {
        return {{{g.i, g.j}, {g.j, g.k}, {g.k, g.i}}};
    }

    // The ring as far as the cluster at hand has changed it.
    bool is_captured(Index v) const { return ring_[v] != kNone; }
    Index next_to(Index v) const {
        Index next = ring_[v];
        return next == kNone ? c_.following(v) : next;
    }

    // Does the next thing to do; false if there is none. Before anything is taken, all that needs
    // no more than `reached` is found; before that is lowered, all that needs no more than the best
    // candidate.
    bool step(Cluster& c) {
        if (c.captures.size() == c.members.size()) return false;
        double near = frontier_.empty() ? Sight::kNever : frontier_.top().bound;
        double best = later_.empty() ? Sight::kNever : later_.top().need;
        if (near >= c.reached) {
            explore(c, frontier_.pop());
        } else if (best >= c.reached) {
            ready_.push(later_.pop());
        } else if (!ready_.empty()) {
            Capture g = ready_.pop().gate;
            if (stands(c, g)) take(c, g);
        } else if (!later_.empty() && !(near > best)) {
            if (stands(c, later_.top().gate)) {
                c.reached = best;
            } else {
                later_.pop();
            }
        } else if (near >= limit_.cotangent) {
            explore(c, frontier_.pop());
        } else {
            return false;
        }
        return true;
    }

    void explore(Cluster& c, const Sight::Window& w) {
        if (is_captured(w.k)) {
            c.ahead.push_back(w);
        } else if (w.edge == kNone) {
            // What comes after the best there is need not be known exactly yet.
            double floor = later_.empty() ? limit_.cotangent : later_.top().need;
            floor = std::min(floor, w.bound);
            Candidate made = candidate({w.right, w.left, w.k}, floor);
            if (made.need < floor) {
                frontier_.push({made.need, w.k, kNone, w.right, w.left, false});
            } else if (made.need >= limit_.cotangent) {
                c.found.push_back(made);
                later_.push(made);
            }
        } else {
            sight_.look_through(
                w, [&](Index x) { c.triangles.push_back(x); }, [&](Index v) { notice(c, v, w.k); },
                [&](const Sight::Window& next) { frontier_.push(next); });
        }
    }

    void consider(const Candidate& made) {
        if (made.need >= limit_.cotangent) later_.push(made);
    }

    // k sees v. If that is a member and has been captured, edges of the ring end there.
    void notice(Cluster& c, Index v, Index k) {
        if (!is_locked(v)) return;
        c.sightings.push_back({v, k});
        if (!is_captured(v)) return;
        for (const Capture& taken : c.captures) {
            for (auto [i, j] : {std::pair{taken.i, taken.k}, std::pair{taken.k, taken.j}}) {
                if ((i == v || j == v) && next_to(i) == j)
                    consider(candidate_if_empty({i, j, k}, limit_.cotangent));
            }
        }
    }

    void take(Cluster& c, Capture g) {
        c.captures.push_back(g);
        ring_.put(g.i, g.k);
        ring_.put(g.k, g.j);
        for (Sighting each : c.sightings) {
            if (each.of != g.k || is_captured(each.from)) continue;
            consider(candidate_if_empty({g.i, g.k, each.from}, limit_.cotangent));
            consider(candidate_if_empty({g.k, g.j, each.from}, limit_.cotangent));
        }
    }

    // With what it needs, which is no number if it is none; if that is below `floor`, no more than
    // a bound that is, too.
    Candidate candidate(Capture g, double floor) const {
        double need = sight_.need(g.k, g.i, floor);
        if (need >= floor) {
            double other = sight_.need(g.k, g.j, floor);
            need = std::isnan(other) ? other : std::min(need, other);
        }
        bool is_one = need >= floor;
        double key = is_one ? cotangent(t_.site(g.i), t_.site(g.j), t_.site(g.k)) : 0;
        return {need, key, g};
    }

    // The same over an edge that is none of the constriction's.
    Candidate candidate_if_empty(Capture g, double floor) const {
        bool is_one = sight_.is_empty(g.i, g.j, g.k);
        return is_one ? candidate(g, floor) : Candidate{Sight::kNever, 0, g};
    }

    // Whether a candidate is one still: its triangle lies in what is left of the object. Once it
    // does not, it never will.
    bool stands(const Cluster& c, Capture g) const {
        if (is_captured(g.k) || next_to(g.i) != g.j) return false;
        for (const Capture& taken : c.captures) {
            for (Index v : {g.i, g.j}) {
                if (sight_.cross(v, g.k, taken.i, taken.k)) return false;
                if (sight_.cross(v, g.k, taken.k, taken.j)) return false;
            }
        }
        return true;
    }

    // ---------------------------------------------------------------- several clusters
    // Unites the cluster with all that meet it, to be run again; false if there are none.
    bool unite_with_those_met(Index id) {
        std::vector<Index> near, met;
        const Cluster& c = cluster(id);
        for (Index x : c.covered) covered_.collect(x, near);
        for (Index v : c.members) sighted_.collect(v, near);
        for (Sighting each : c.sightings) cluster_of_.collect(each.of, near);
        make_unique(near);
        for (Index other : near) {
            const Cluster& o = cluster(other);
            if (other == id) continue;
            if (overlap(c, o) || could_use(c, o) || could_use(o, c)) met.push_back(other);
        }
        if (!met.empty()) retire(id);
        for (Index other : met) {
            retire(other);
            Cluster &to = cluster(id), &from = cluster(other);
            append(to.members, from.members);
            if (from.is_known) {
                append(to.triangles, from.triangles);
                append(to.sightings, from.sightings);
                append(to.ahead, from.ahead);
                append(to.found, from.found);
            } else {
                append(to.fresh, from.members);
            }
            drop(other);
        }
        return !met.empty();
    }

    // Whether triangles that they captured overlap. They hold no sites, so they stand on one edge
    // or have sides that cross.
    bool overlap(const Cluster& c, const Cluster& o) const {
        for (const Capture& g : c.captures) {
            for (const Capture& h : o.captures) {
                if (g.i == h.i && g.j == h.j) return true;
                for (auto [a, b] : sides(g)) {
                    for (auto [d, e] : sides(h)) {
                        if (sight_.cross(a, b, d, e)) return true;
                    }
                }
            }
        }
        return false;
    }

    // Whether an edge that o has made is a candidate's for a member of c, no wider than c went: as
    // far as the limit if some of its members were not captured, else as far as it captured.
    bool could_use(const Cluster& c, const Cluster& o) const {
        bool is_left = c.captures.size() < c.members.size();
        double floor = is_left ? limit_.cotangent : c.reached;
        for (Sighting each : c.sightings) {
            for (const Capture& g : o.captures) {
                for (auto [i, j] : {std::pair{g.i, g.k}, std::pair{g.k, g.j}}) {
                    if (i != each.of && j != each.of) continue;
                    if (candidate_if_empty({i, j, each.from}, floor).need >= floor) return true;
                }
            }
        }
        return false;
    }

    void forget_tables() {
        for (Table* each : {&passed_, &covered_, &sighted_, &cluster_of_, &follows_}) each->clear();
        captured_ = 0;
    }

    template <class T>
    static void append(std::vector<T>& to, const std::vector<T>& from) {
        to.insert(to.end(), from.begin(), from.end());
    }

    void drop(Index id) {
        free_.push_back(id);
        cluster(id) = Cluster{};
    }

    // The cluster is made, and others shall know.
    void enroll(Index id) {
        Cluster& c = cluster(id);
        c.is_enrolled = true;
        for (Index v : c.members) cluster_of_.add(v, id);
        for (Index x : c.triangles) passed_.add(x, id);
        for (Index x : c.covered) covered_.add(x, id);
        for (Sighting each : c.sightings) sighted_.add(each.of, id);
    }

    // Undoes that.
    void retire(Index id) {
        Cluster& c = cluster(id);
        c.is_enrolled = false;
        if (c.is_linked) unlink(c);
        for (Index v : c.members) cluster_of_.remove(v, id);
        for (Index x : c.triangles) passed_.remove(x, id);
        for (Index x : c.covered) covered_.remove(x, id);
        for (Sighting each : c.sightings) sighted_.remove(each.of, id);
    }

    // Its captures are those of the ring. Only of clusters that do not meet: two that do may both
    // have captured through one edge.
    void link(Cluster& c) {
        c.is_linked = true;
        captured_ += static_cast<Index>(c.captures.size());
        for (const Capture& taken : c.captures) {
            follows_.put(taken.i, taken.k);
            follows_.put(taken.k, taken.j);
            links_.touch(taken.i);
            links_.touch(taken.k);
        }
    }

    // Undoes that.
    void unlink(Cluster& c) {
        c.is_linked = false;
        captured_ -= static_cast<Index>(c.captures.size());
        for (const Capture& taken : c.captures) {
            follows_.erase(taken.i);
            follows_.erase(taken.k);
            links_.touch(taken.i);
            links_.touch(taken.k);
        }
    }

    // ---------------------------------------------------------------- changes
    // The cluster is no more, and its vertices wait to be put into others.
    void dissolve(Index id) {
        retire(id);
        append(pending_, cluster(id).members);
        drop(id);
    }

    void dissolve_all(Index triangle) {
        around_.clear();
        passed_.collect(triangle, around_);
        for (Index id : around_) dissolve(id);
    }

    // Of a vertex that is locked from now on: dissolves the clusters that may have seen it.
    void dissolve_around(Index v) {
        Index first = t_.mesh().leaving(v), h = first;
        do {
            dissolve_all(Mesh::triangle(h));
            h = t_.mesh().turn(h);
        } while (h != first);
    }

    // Of a triangle that has come, or has left the object or joined it: dissolves the clusters that
    // passed through it or stood before it and found the opposite of what is there now.
    void look_again(Index x, bool is_new) {
        const Mesh& m = t_.mesh();
        if (m.is_free(x)) return;
        bool is_inside = c_.is_inside(x);
        if (is_new || !is_inside) dissolve_all(x);
        for (Index h = 3 * x; h < 3 * x + 3; ++h) {
            Index o = m.twin(h);
            around_.clear();
            passed_.collect(Mesh::triangle(o), around_);
            for (Index id : around_) {
                const std::vector<Index>& rim = cluster(id).rim;
                if (std::binary_search(rim.begin(), rim.end(), o) == is_inside) dissolve(id);
            }
        }
    }

    const Triangulation& t_;
    const Constriction& c_;
    Links& links_;
    Sight sight_;
    Limit limit_;
    std::vector<Cluster> clusters_;  // those that are gone have no members
    std::vector<Index> free_;
    Index captured_ = 0;
    Table passed_;      // by triangle: clusters whose searches passed through it
    Table covered_;     // by triangle: clusters whose captured triangles overlap it
    Table sighted_;     // by locked vertex: clusters that see it
    Table cluster_of_;  // by locked vertex: its cluster
    Table follows_;     // by vertex: the next one along the ring, if not the constriction's
    // In progress: locked vertices without a cluster, clusters made, clusters around a triangle;
    // and of the cluster at hand, what it has changed of the ring, candidates that may be taken,
    // others by what they need, windows to look through.
    std::vector<Index> pending_, made_, around_;
    Table ring_;
    Heap<Candidate, Sooner> ready_{Sooner{t_}};
    Heap<Candidate, Nearer> later_{Nearer{}};
    Heap<Sight::Window, Nearer> frontier_{Nearer{}};
};

}  // namespace flintknap
