// A cluster of locked vertices, widened by itself.
//
// Theory (section 3.4). A *candidate* is an edge ij of the ring and a vertex k inside such that the
// triangle ijk lies in the object and holds no other site. The pairs ik and jk each have a need and
// a size (sight.hpp): how wide a graph must be to have them, and how large the discs are that make
// it so wide. Those of the candidate are the least need and the largest size. Of the candidates
// whose need is within the limit the one of the smallest size is taken, ties by key (forest.hpp),
// then by coordinates: k joins the ring between i and j. Again and again, until none is left.
//
//      i --------> j            i       j       the triangle i, j, k is no longer inside; it need
//       \         /      ==>     \     /        not be one of the triangulation, and the edges of
//        \       /                v   ^         that which cross it are not those of the ring
//            k                      k
//
// Here, as if no vertex but the members could be captured. Edges of the constriction's ring are
// searched by windows, the smallest first, only as far as no candidate is known that is as small as
// what lies behind the windows may be. Edges that captures have made are known: each member looks
// at them by rising bounds of size, as far as that. So windows need not find members, and what they
// are for is no nearer than a member has *room* (room.hpp). In a crowd that locks far from the
// ring, the windows between two members are narrow, their needs are low, and so low a need that far
// away makes them larger than all that is taken: hardly any is looked through.
//
// Cost: what the searches pass through, within twice the radius of the largest disc taken; all that
// they see for a vertex that has no candidate. Besides, some ns for each two members of a crowd.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "room.hpp"

namespace flintknap {

// How far to widen: d, and the cotangent it stands for; 0 is not at all.
struct Limit {
    double d = -1, cotangent = -std::numeric_limits<double>::infinity();
    bool widens() const { return cotangent < 0; }
};

struct Capture {
    Index i, j, k;
};

struct Candidate {
    double size, need, key;
    Capture gate;
};

struct Sighting {
    Index of, from;  // a locked vertex that is no member, and a member
    bool operator<(const Sighting& o) const { return of != o.of ? of < o.of : from < o.from; }
    bool operator==(const Sighting& o) const { return of == o.of && from == o.from; }
};

struct Cluster {
    std::vector<Index> members;  // locked vertices
    std::vector<Capture> captures;
    double size = 0, need = 0;        // the largest and the least that were taken
    std::vector<Index> triangles;     // that the members' searches passed through
    std::vector<Index> rim;           // half-edges of these on the ring, sorted
    std::vector<Index> covered;       // triangles that the captured ones overlap
    std::vector<Sighting> sightings;  // sorted
    bool is_enrolled = false, is_linked = false;

    bool is_left() const { return captures.size() < members.size(); }

    // Calls f for each locked vertex that is no member and that one sees, once.
    template <class F>
    void each_seen(F f) const {
        Index last = kNone;
        for (Sighting each : sightings) {
            if (each.of != last) f(each.of);
            last = each.of;
        }
    }

    std::size_t bytes() const {
        return (members.capacity() + triangles.capacity() + rim.capacity() + covered.capacity()) *
                   sizeof(Index) +
               captures.capacity() * sizeof(Capture) + sightings.capacity() * sizeof(Sighting);
    }

    template <class Archive>
    void transfer(Archive& archive) {
        archive(members);
        archive(triangles);
        archive(rim);
        archive(covered);
        archive(captures);
        archive(sightings);
        archive(size);
        archive(need);
    }
};

template <class T>
void append(std::vector<T>& to, const std::vector<T>& from) {
    to.insert(to.end(), from.begin(), from.end());
}

template <class T>
void make_unique(std::vector<T>& values) {
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
}

class Captor {
   public:
    Captor(const Triangulation& triangulation, const Constriction& constriction, Limit limit)
        : t_(triangulation), c_(constriction), sight_(t_, c_), limit_(limit) {}

    // Widens the cluster until all its members are on the ring or nothing is left that the limit
    // allows.
    template <class Poll>
    void run(Cluster& c, Poll poll) {
        begin(c);
        for (std::int64_t steps = 1; limit_.widens() && step(c); ++steps) {
            if (steps % 4096 == 0) poll();
        }
        keep(passed_, c.triangles);
        keep(noticed_, c.sightings);
        const Mesh& m = t_.mesh();
        for (Index x : c.triangles) {
            for (Index h = Mesh::first(x); h < Mesh::first(x) + 3; ++h) {
                if (!c_.is_inside(Mesh::triangle(m.twin(h)))) c.rim.push_back(h);
            }
        }
        for (const Capture& taken : c.captures) {
            for (auto [a, b] : sides(taken))
                sight_.pass_along(a, b, [&](Index x) { overlapped_.push_back(x); });
        }
        keep(overlapped_, c.covered);
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

    // Whether an edge that o has made is a candidate's for a member of c, no larger than what c
    // took; or of any size, if some of its members were not captured.
    bool could_use(const Cluster& c, const Cluster& o) const {
        double most = c.is_left() ? std::numeric_limits<double>::infinity() : c.size;
        for (Sighting each : c.sightings) {
            for (const Capture& g : o.captures) {
                for (auto [i, j] : edges(g)) {
                    if (i != each.of && j != each.of) continue;
                    if (candidate_if_empty({i, j, each.from}, most).size <= most) return true;
                }
            }
        }
        return false;
    }

   private:
    static constexpr std::size_t kCrowd = 8;  // members of a cluster are one
    static constexpr double kFar = std::numeric_limits<double>::infinity();

    struct Edge {
        Index i, j;
    };
    // A member, which looks at the edges that captures have made until it is captured.
    struct Viewer {
        Index k;
        double room = 0;     // no size of what it looks for is below (room.hpp)
        double seen = -1;    // edges have been looked at whose bounds are not above
        double next = kFar;  // the least bound of the others
    };
    // The next edges for a viewer, unless there have been nearer ones since.
    struct Glance {
        double size;
        std::size_t viewer;
    };
    struct Smaller {
        const Triangulation& t;
        bool operator()(const Candidate& a, const Candidate& b) const {
            if (a.size != b.size) return a.size < b.size;
            if (a.key != b.key) return a.key < b.key;
            if (a.gate.k != b.gate.k) return t.site(a.gate.k) < t.site(b.gate.k);
            if (a.gate.i != b.gate.i) return t.site(a.gate.i) < t.site(b.gate.i);
            return t.site(a.gate.j) < t.site(b.gate.j);
        }
        bool operator()(const Sight::Window& a, const Sight::Window& b) const {
            return a.size < b.size;
        }
        bool operator()(const Glance& a, const Glance& b) const { return a.size < b.size; }
    };

    static std::array<std::pair<Index, Index>, 3> sides(Capture g) {
        return {{{g.i, g.j}, {g.j, g.k}, {g.k, g.i}}};
    }
    // Those it makes.
    static std::array<std::pair<Index, Index>, 2> edges(Capture g) {
        return {{{g.i, g.k}, {g.k, g.j}}};
    }

    // The ring as far as the cluster at hand has changed it.
    bool is_captured(Index v) const { return ring_[v] != kNone; }
    Index next_to(Index v) const {
        Index next = ring_[v];
        return next == kNone ? c_.following(v) : next;
    }

    void begin(Cluster& c) {
        candidates_.clear();
        frontier_.clear();
        glances_.clear();
        ring_.clear();
        place_.clear();
        viewers_.clear();
        made_.clear();
        noticed_.clear();
        passed_.clear();
        overlapped_.clear();
        c.captures.clear();
        c.rim.clear();
        c.size = c.need = 0;
        for (Index k : c.members) {
            place_.put(k, static_cast<Index>(viewers_.size()));
            viewers_.push_back({k});
        }
        if (c.members.size() >= kCrowd && limit_.widens()) {
            rooms_.find(
                c.members, [&](Index v) { return is_member(v); },
                [&](Index x) { passed_.push_back(x); },
                [&](Index k, double room) { viewers_[at(place_[k])].room = room; });
        }
        for (const Viewer& viewer : viewers_) {
            sight_.open(
                viewer.k, [&](Index x) { passed_.push_back(x); },
                [&](Index v) { notice(v, viewer.k); },
                [&](const Sight::Window& w) { consider(w, viewer); });
        }
    }

    // The different ones of many, in no more memory than they need.
    template <class T>
    static void keep(std::vector<T>& many, std::vector<T>& kept) {
        make_unique(many);
        kept.assign(many.begin(), many.end());
    }

    bool is_member(Index v) const { return place_[v] != kNone; }

    // Does the next thing to do; false if there is none.
    bool step(Cluster& c) {
        if (!c.is_left()) return false;
        double least = candidates_.empty() ? kFar : candidates_.top().size;
        if (!frontier_.empty() && !(least < frontier_.top().size)) {
            explore(frontier_.pop());
        } else if (!glances_.empty() && !(least < glances_.top().size)) {
            look(glances_.pop());
        } else if (!candidates_.empty()) {
            Candidate best = candidates_.pop();
            if (stands(best.gate)) take(c, best);
        } else {
            return false;
        }
        return true;
    }

    void explore(const Sight::Window& w) {
        if (is_captured(w.k)) return;
        if (w.edge == kNone) return consider(candidate({w.right, w.left, w.k}));
        const Viewer& viewer = viewers_[at(place_[w.k])];
        sight_.look_through(
            w, [&](Index x) { passed_.push_back(x); }, [&](Index v) { notice(v, w.k); },
            [&](const Sight::Window& next) { consider(next, viewer); });
    }

    // Between two members, both ends of what is looked for are behind the window.
    void consider(Sight::Window w, const Viewer& viewer) {
        if (!(w.need >= limit_.cotangent)) return;
        double times = is_member(w.right) && is_member(w.left) ? 1 + w.need * w.need : 1;
        w.size = std::max(w.size, viewer.room * times * (1 - Sight::kSlack));
        frontier_.push(w);
    }
    void consider(const Candidate& made) {
        if (is_admissible(made)) candidates_.push(made);
    }

    void notice(Index v, Index k) {
        if (!c_.on_ring(v) && !is_member(v)) noticed_.push_back({v, k});
    }

    // What a candidate of k over an edge is not smaller than.
    double least_size(Index k, Edge e) const {
        return std::max(sight_.size(k, e.i, 0), sight_.size(k, e.j, 0));
    }

    // The viewer looks at its next edges, and finds out which come after them.
    void look(const Glance& glance) {
        Viewer& viewer = viewers_[glance.viewer];
        if (is_captured(viewer.k) || glance.size != viewer.next) return;
        viewer.seen = glance.size;
        viewer.next = kFar;
        for (Edge e : made_) {
            double size = least_size(viewer.k, e);
            if (size == viewer.seen) consider(candidate_if_empty({e.i, e.j, viewer.k}));
            if (size > viewer.seen) viewer.next = std::min(viewer.next, size);
        }
        if (viewer.next < kFar) glances_.push({viewer.next, glance.viewer});
    }

    void take(Cluster& c, const Candidate& best) {
        Capture g = best.gate;
        c.captures.push_back(g);
        c.size = std::max(c.size, best.size);
        c.need = std::min(c.need, best.need);
        ring_.put(g.i, g.k);
        ring_.put(g.k, g.j);
        auto is_covered = [&](Edge e) { return e.i == g.i && e.j == g.j; };
        made_.erase(std::remove_if(made_.begin(), made_.end(), is_covered), made_.end());
        for (auto [i, j] : edges(g)) {
            made_.push_back({i, j});
            for (std::size_t n = 0; n < viewers_.size(); ++n) show(made_.back(), n);
        }
    }

    // A viewer learns of an edge.
    void show(Edge e, std::size_t n) {
        Viewer& viewer = viewers_[n];
        if (is_captured(viewer.k)) return;
        double size = least_size(viewer.k, e);
        if (size <= viewer.seen) {
            consider(candidate_if_empty({e.i, e.j, viewer.k}));
        } else if (size < viewer.next) {
            viewer.next = size;
            glances_.push({size, n});
        }
    }

    bool is_admissible(const Candidate& made) const { return made.need >= limit_.cotangent; }

    // With a need that is no number if it is none.
    Candidate candidate(Capture g) const {
        double first = sight_.need(g.k, g.i), second = sight_.need(g.k, g.j);
        if (std::isnan(first) || std::isnan(second)) return none(g);
        double size = std::max(sight_.size(g.k, g.i, first), sight_.size(g.k, g.j, second));
        double key = cotangent(t_.site(g.i), t_.site(g.j), t_.site(g.k));
        return {size, std::min(first, second), key, g};
    }
    static Candidate none(Capture g) {
        return {std::numeric_limits<double>::quiet_NaN(), Sight::kNever, 0, g};
    }

    // The same over an edge that is none of the constriction's, if it may be as small as `most`.
    Candidate candidate_if_empty(Capture g,
                                 double most = std::numeric_limits<double>::infinity()) const {
        bool near = sight_.size(g.k, g.i, 0) <= most && sight_.size(g.k, g.j, 0) <= most;
        if (!near || !sight_.is_empty(g.i, g.j, g.k)) return none(g);
        Candidate made = candidate(g);
        return is_admissible(made) ? made : none(g);
    }

    // Whether a candidate is one still: its triangle lies in what is left of the object. Once it
    // does not, it never will.
    bool stands(Capture g) const {
        if (is_captured(g.k) || next_to(g.i) != g.j) return false;
        auto is_crossed = [&](Edge e) {
            return sight_.cross(g.i, g.k, e.i, e.j) || sight_.cross(g.j, g.k, e.i, e.j);
        };
        return std::none_of(made_.begin(), made_.end(), is_crossed);
    }

    const Triangulation& t_;
    const Constriction& c_;
    Sight sight_;
    Limit limit_;
    // Of the cluster at hand: what it has changed of the ring, its members, the edges that captures
    // have made and that are there; candidates, windows to look through, edges to look at.
    Table ring_, place_;
    std::vector<Viewer> viewers_;
    std::vector<Edge> made_;
    // And triangles passed through or overlapped, some more than once, and what was seen there.
    std::vector<Index> passed_, overlapped_;
    std::vector<Sighting> noticed_;
    Rooms rooms_{t_, c_};
    Heap<Candidate, Smaller> candidates_{Smaller{t_}};
    Heap<Sight::Window, Smaller> frontier_{Smaller{t_}};
    Heap<Glance, Smaller> glances_{Smaller{t_}};
};

}  // namespace flintknap
