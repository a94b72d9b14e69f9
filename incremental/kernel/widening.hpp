// No vertex left inside: where the constriction locks, wider gamma-graphs go on.
//
// Theory (section 3.4). Of the candidates, triangles of an edge of the ring and a vertex inside,
// the one with the smallest discs is taken, again and again (cluster.hpp).
//
// *Clusters.* A cluster of locked vertices is widened by itself, as if no other vertex could be
// captured. Two clusters do not meet if none of their captured triangles overlap, and no new edge
// of one makes a candidate with a member of the other that it could have used. Then neither takes
// anything that the other takes, nor offers it anything: together they do what a run over all
// locked vertices does. Those that meet are united and widened again. After a change only the
// clusters are made anew that passed through a triangle that is gone, or beside one that has come,
// left the object or joined it.
//
// Invariants (check): ring, limit and vertices inside are those of a run from scratch; every vertex
// that the constriction left is in one cluster, and so is no other; all triangles that a cluster
// has passed through are inside the object.
// Cost: what the searches pass through, a few triangles a locked vertex as a rule; all that it sees
// for one that is left inside. Nothing if none is locked.
#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "cluster.hpp"

namespace flintknap {

class Widening {
   public:
    Widening(const Triangulation& triangulation, const Constriction& constriction, Links& links,
             Limit limit)
        : t_(triangulation), c_(constriction), links_(links), limit_(limit) {}

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
        for (const Cluster& c : clusters_) least = std::min(least, c.need);
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
        pending_.assign(c_.loosened().begin(), c_.loosened().end());
        if (!passed_.empty()) dissolve_changed();
        auto is_done = [&](Index v) { return !is_locked(v); };
        pending_.erase(std::remove_if(pending_.begin(), pending_.end(), is_done), pending_.end());
        make_unique(pending_);
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
        for (Cluster& c : clusters_) c.transfer(archive);
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
        for (const Cluster& c : clusters_) sum += c.bytes();
        return sum;
    }

    // The first broken invariant, or nothing.
    std::string check() const {
        Links nobody_looks;
        Widening other(t_, c_, nobody_looks, limit_);
        other.build([] {});
        std::vector<bool> known(at(t_.slots()));
        for (const Cluster& c : clusters_) {
            for (Index x : c.triangles) {
                if (c_.is_inside(x)) continue;
                return "triangle " + std::to_string(x) + " has left, but not the cluster with it";
            }
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
    static constexpr std::size_t kAhead = 8;  // so many triangles are fetched ahead

    bool is_locked(Index v) const { return !c_.on_ring(v) && t_.is_site(v); }

    // Puts the vertices that wait into clusters and widens these, until no two of them meet.
    template <class Poll>
    void settle(Poll poll) {
        begin_clusters();
        Captor captor(t_, c_, limit_);
        std::vector<Index> open = made_, united;
        for (; !open.empty(); std::swap(open, united)) {
            for (Index id : open) {
                captor.run(cluster(id), poll);
                enroll(id);
            }
            united.clear();
            for (Index id : open) {
                if (cluster(id).is_enrolled && unite_with_those_met(id, captor))
                    united.push_back(id);
            }
        }
        for (Index id : made_) {
            if (cluster(id).is_enrolled) link(cluster(id));
        }
    }

    Cluster& cluster(Index id) { return clusters_[at(id)]; }

    // Of those that wait, which are sorted, makes a cluster of each set that is linked by edges:
    // neighbours would meet.
    void begin_clusters() {
        made_.clear();
        const Mesh& m = t_.mesh();
        std::vector<bool> is_taken(pending_.size());
        auto take = [&](std::size_t n, std::vector<Index>& members) {
            if (!is_taken[n]) members.push_back(pending_[n]);
            is_taken[n] = true;
        };
        for (std::size_t n = 0; n < pending_.size(); ++n) {
            if (is_taken[n]) continue;
            made_.push_back(add_cluster());
            std::vector<Index>& members = cluster(made_.back()).members;
            take(n, members);
            for (std::size_t i = 0; i < members.size(); ++i) {
                Index first = m.leaving(members[i]), h = first;
                do {
                    auto found = std::lower_bound(pending_.begin(), pending_.end(), m.target(h));
                    if (found != pending_.end() && *found == m.target(h)) {
                        take(static_cast<std::size_t>(found - pending_.begin()), members);
                    }
                    h = m.turn(h);
                } while (h != first);
            }
        }
    }

    Index add_cluster() {
        Index id = static_cast<Index>(clusters_.size());
        if (free_.empty()) {
            clusters_.emplace_back();
        } else {
            id = free_.back();
            free_.pop_back();
        }
        return id;
    }

    // ---------------------------------------------------------------- several clusters
    // Unites the cluster with all that meet it, to be run again; false if there are none.
    bool unite_with_those_met(Index id, const Captor& captor) {
        std::vector<Index> near, met;
        const Cluster& c = cluster(id);
        for (Index x : c.covered) covered_.collect(x, near);
        for (Index v : c.members) sighted_.collect(v, near);
        c.each_seen([&](Index v) { cluster_of_.collect(v, near); });
        make_unique(near);
        for (Index other : near) {
            const Cluster& o = cluster(other);
            if (other == id) continue;
            if (captor.overlap(c, o) || captor.could_use(c, o) || captor.could_use(o, c)) {
                met.push_back(other);
            }
        }
        if (!met.empty()) retire(id);
        for (Index other : met) {
            retire(other);
            append(cluster(id).members, cluster(other).members);
            drop(other);
        }
        return !met.empty();
    }

    void forget_tables() {
        for (Table* each : {&passed_, &covered_, &sighted_, &cluster_of_, &follows_}) each->clear();
        captured_ = 0;
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
        c.each_seen([&](Index v) { sighted_.add(v, id); });
    }

    // Undoes that.
    void retire(Index id) {
        Cluster& c = cluster(id);
        c.is_enrolled = false;
        if (c.is_linked) unlink(c);
        for (Index v : c.members) cluster_of_.remove(v, id);
        for (Index x : c.triangles) passed_.remove(x, id);
        for (Index x : c.covered) covered_.remove(x, id);
        c.each_seen([&](Index v) { sighted_.remove(v, id); });
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

    // All clusters that what has changed may concern.
    void dissolve_changed() {
        for (Index x : c_.destroyed()) dissolve_all(x);
        for (Index x : c_.created()) look_again(x, true);
        const Array<Index>& changed = c_.changed();
        for (std::size_t i = 0; i < changed.size(); ++i) {
            if (i + kAhead < changed.size()) fetch(changed[i + kAhead]);
            look_again(changed[i], false);
        }
        for (Index v : c_.loosened()) {
            if (is_locked(v)) dissolve_around(v);
        }
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

    // Fetches where the clusters are that will be asked for when that triangle is looked at again.
    [[gnu::always_inline]] void fetch(Index x) const {
        const Mesh& m = t_.mesh();
        passed_.prefetch(x);
        for (Index h = Mesh::first(x); limit_.widens() && h < Mesh::first(x) + 3; ++h) {
            if (Index o = m.twin(h); o >= 0) passed_.prefetch(Mesh::triangle(o));
        }
    }
    // Of a triangle that has come, or has left the object or joined it: dissolves the clusters that
    // passed through it or stood before it and found the opposite of what is there now.
    void look_again(Index x, bool is_new) {
        const Mesh& m = t_.mesh();
        bool is_inside = c_.is_inside(x);
        if (is_new || !is_inside) dissolve_all(x);
        if (!limit_.widens()) return;  // beyond its triangles a cluster looks for nothing
        if (m.is_free(x)) return;
        for (Index h = Mesh::first(x); h < Mesh::first(x) + 3; ++h) {
            Index o = m.twin(h), beyond = Mesh::triangle(o);
            if (!c_.is_inside(beyond)) continue;  // who passed through that one has seen it leave
            around_.clear();
            passed_.collect(beyond, around_);
            for (Index id : around_) {
                const std::vector<Index>& rim = cluster(id).rim;
                if (std::binary_search(rim.begin(), rim.end(), o) == is_inside) dissolve(id);
            }
        }
    }

    const Triangulation& t_;
    const Constriction& c_;
    Links& links_;
    Limit limit_;
    std::vector<Cluster> clusters_;  // those that are gone have no members
    std::vector<Index> free_;
    Index captured_ = 0;
    Table passed_;      // by triangle: clusters whose searches passed through it
    Table covered_;     // by triangle: clusters whose captured triangles overlap it
    Table sighted_;     // by locked vertex: clusters that see it
    Table cluster_of_;  // by locked vertex: its cluster
    Table follows_;     // by vertex: the next one along the ring, if not the constriction's
    // In progress: locked vertices without a cluster, clusters made, clusters around a triangle.
    std::vector<Index> pending_, made_, around_;
};

}  // namespace flintknap
