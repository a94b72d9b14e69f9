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
// Here, as if no vertex but the members could be captured. What members see is searched by
// windows, the nearest first, only as far as no candidate is known that is as small as what lies
// behind the windows may be. Members see each other, too: one that has been captured has made two
// edges, which are candidates' for those who see it.
//
// Cost: what the searches pass through, within twice the radius of the largest disc taken; all that
// they see for a vertex that has no candidate.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "sight.hpp"
#include "table.hpp"

namespace flintknap {

// How far to widen: d, and the cotangent it stands for; 0 is not at all.
struct Limit {
    double d = -1, cotangent = -std::numeric_limits<double>::infinity();
};

struct Capture {
    Index i, j, k;
};

struct Candidate {
    double size, need, key;
    Capture gate;
};

struct Sighting {
    Index of, from;
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
    std::vector<Sighting> sightings;  // locked vertices, and which member sees them; sorted
    bool is_enrolled = false, is_linked = false;
    // Until all clusters are settled: members who have not begun to search, windows that are yet to
    // be looked through, and candidates over edges that the constriction has left.
    bool is_known = false;  // these are there
    std::vector<Index> fresh;
    std::vector<Sight::Window> ahead;
    std::vector<Candidate> found;

    bool is_left() const { return captures.size() < members.size(); }

    // Calls f for each vertex that a member sees, once.
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

    bool is_locked(Index v) const { return t_.is_site(v) && !c_.on_ring(v); }

    // Widens the cluster until all its members are on the ring or nothing is left that the limit
    // allows. What was found in an earlier run, with fewer members, is not looked for again.
    template <class Poll>
    void run(Cluster& c, Poll poll) {
        candidates_.clear();
        frontier_.clear();
        ring_.clear();
        c.captures.clear();
        c.covered.clear();
        c.rim.clear();
        c.size = c.need = 0;
        for (const Sight::Window& w : c.ahead) frontier_.push(w);
        for (const Candidate& each : c.found) candidates_.push(each);
        c.ahead.clear();
        for (Index k : c.fresh) {
            sight_.open(
                k, [&](Index x) { c.triangles.push_back(x); }, [&](Index v) { notice(c, v, k); },
                [&](const Sight::Window& w) { consider(w); });
        }
        c.fresh.clear();
        for (std::int64_t steps = 1; limit_.cotangent < 0 && step(c); ++steps) {
            if (steps % 4096 == 0) poll();
        }
        append(c.ahead, frontier_.items());
        c.is_known = true;
        make_unique(c.triangles);
        make_unique(c.sightings);
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

    // Does the next thing to do; false if there is none.
    bool step(Cluster& c) {
        if (!c.is_left()) return false;
        if (!frontier_.empty() &&
            (candidates_.empty() || !(candidates_.top().size < frontier_.top().size))) {
            explore(c, frontier_.pop());
        } else if (!candidates_.empty()) {
            Candidate best = candidates_.pop();
            if (stands(c, best.gate)) take(c, best);
        } else {
            return false;
        }
        return true;
    }

    void explore(Cluster& c, const Sight::Window& w) {
        if (is_captured(w.k)) {
            c.ahead.push_back(w);
        } else if (w.edge == kNone) {
            Candidate made = candidate({w.right, w.left, w.k});
            if (is_admissible(made)) c.found.push_back(made);
            consider(made);
        } else {
            sight_.look_through(
                w, [&](Index x) { c.triangles.push_back(x); }, [&](Index v) { notice(c, v, w.k); },
                [&](const Sight::Window& next) { consider(next); });
        }
    }

    void consider(const Sight::Window& w) {
        if (w.need >= limit_.cotangent) frontier_.push(w);
    }
    void consider(const Candidate& made) {
        if (is_admissible(made)) candidates_.push(made);
    }

    // k sees v. If that is a member and has been captured, edges of the ring end there.
    void notice(Cluster& c, Index v, Index k) {
        if (!is_locked(v)) return;
        c.sightings.push_back({v, k});
        if (!is_captured(v)) return;
        for (const Capture& taken : c.captures) {
            for (auto [i, j] : edges(taken)) {
                if ((i == v || j == v) && next_to(i) == j) consider(candidate_if_empty({i, j, k}));
            }
        }
    }

    void take(Cluster& c, const Candidate& best) {
        Capture g = best.gate;
        c.captures.push_back(g);
        c.size = std::max(c.size, best.size);
        c.need = std::min(c.need, best.need);
        ring_.put(g.i, g.k);
        ring_.put(g.k, g.j);
        for (Sighting each : c.sightings) {
            if (each.of != g.k || is_captured(each.from)) continue;
            for (auto [i, j] : edges(g)) consider(candidate_if_empty({i, j, each.from}));
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
    bool stands(const Cluster& c, Capture g) const {
        if (is_captured(g.k) || next_to(g.i) != g.j) return false;
        for (const Capture& taken : c.captures) {
            for (auto [a, b] : edges(taken)) {
                if (sight_.cross(g.i, g.k, a, b) || sight_.cross(g.j, g.k, a, b)) return false;
            }
        }
        return true;
    }

    const Triangulation& t_;
    const Constriction& c_;
    Sight sight_;
    Limit limit_;
    // Of the cluster at hand: what it has changed of the ring, candidates, windows to look through.
    Table ring_;
    Heap<Candidate, Smaller> candidates_{Smaller{t_}};
    Heap<Sight::Window, Smaller> frontier_{Smaller{t_}};
};

}  // namespace flintknap
