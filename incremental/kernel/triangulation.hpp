// The canonical Delaunay triangulation of a growing set of sites.
//
// Theory. A new site p is in conflict with a triangle if it lies inside its circle, ties broken by
// coordinates (in_circle_perturbed), and with the ghost beyond a hull edge if it lies strictly
// outside that edge or on its open segment. The triangles in conflict form the cavity: connected,
// star-shaped about p, with every corner on its rim. Replacing it by a fan about p keeps the
// triangulation that of the perturbed sites, which is unique; so it depends on the set of sites
// alone, never on the order in which they came (law 1). Sites on a hull line are hull vertices.
//
//        o---o                o---o
//       / \ / \      p       / \ / \         the rim in counter-clockwise order,
//      o---p---o    ==>     o---p---o        one new triangle a, b, p for each edge ab of it;
//       \ / \ /              \ / \ /         as many as the cavity had, and two more
//        o---o                o---o
//      (any cavity)       (a fan about p)
//
// As long as all sites lie on one line there are no triangles; the first site off it builds one
// and the others follow. Sites are numbered by slots in the order in which they are placed.
//
// Invariants (check): those of the mesh; every triangle turns left; every edge is Delaunay in the
// perturbed sense; every ghost stands on a hull edge and the hull is convex.
// Cost: O(1) expected changes for a site in random order, and a walk to it, O(log n) expected with
// Hints; O(degree) in the worst case, which a set in order along a curve does reach.
#pragma once

#include <algorithm>
#include <numeric>
#include <string>
#include <vector>

#include "hints.hpp"
#include "mesh.hpp"
#include "predicates.hpp"

namespace flintknap {

// Somebody whom changes do not concern.
struct Nobody {
    void destroying(const std::vector<Index>&) {}
    void created(const std::vector<Index>&) {}
};

class Triangulation {
   public:
    // Where a place lies: in the closed triangle of `edge`, or beyond the hull if that is a ghost;
    // if `on_edge`, on the edge itself; if `on_vertex`, at its origin.
    struct Location {
        Index edge;
        bool on_edge, on_vertex;
    };

    const Mesh& mesh() const { return mesh_; }
    const std::vector<Point>& sites() const { return sites_; }
    Point site(Index v) const { return sites_[at(v)]; }
    Index size() const { return static_cast<Index>(sites_.size()); }
    bool is_flat() const { return mesh_.triangles() == 0; }
    // The lexicographically smallest site; it is always a hull vertex.
    Index smallest() const { return smallest_; }

    void reserve(std::size_t n) {
        sites_.reserve(n);
        mesh_.reserve(n);
    }

    // Places a site that is not among the sites yet and returns its slot. The walk to it starts at
    // `start`, a slot near it, or where the hints say if that is kNone. `observer` learns which
    // triangles go, while they still stand; created() tells which came. If memory ends, nothing has
    // changed.
    template <class Observer>
    Index insert(Point p, Index start, Observer& observer) {
        if (sites_.size() == sites_.capacity()) sites_.reserve(2 * sites_.size() + 4);
        hints_.make_room();
        Index v = size();
        if (is_flat()) {
            bool off_the_line = v >= 2 && orient(site(0), site(1), p) != 0;
            mesh_.make_room(off_the_line ? 2 * at(v) : 0);
            if (off_the_line) line_ = sites_on_line();
            cavity_.clear();
            add_site(p);
            if (off_the_line) raise_fan();
            return v;
        }
        mesh_.make_room(2);
        find_cavity(p, walk(p, start_edge(p, start)));
        observer.destroying(cavity_);
        add_site(p);
        fill_cavity(v);
        return v;
    }

    // The triangles that the last insert made.
    const std::vector<Index>& created() const { return cavity_; }

    Location locate(Point q, Index start) const {
        Index h = walk(q, start_edge(q, start));
        if (mesh_.is_ghost(Mesh::triangle(h))) return {h, false, false};
        for (int side = 0; side < 3; ++side, h = Mesh::next(h)) {
            if (site(mesh_.origin(h)) == q) return {h, true, true};
        }
        for (int side = 0; side < 3; ++side, h = Mesh::next(h)) {
            if (orient(site(mesh_.origin(h)), site(mesh_.target(h)), q) == 0)
                return {h, true, false};
        }
        return {h, false, false};
    }

    // The half-edge from a to b, or kNone. O(degree of a).
    Index edge_between(Index a, Index b) const {
        if (is_flat()) return kNone;
        Index first = mesh_.leaving(a), h = first;
        do {
            if (mesh_.target(h) == b) return h;
            h = mesh_.turn(h);
        } while (h != first);
        return kNone;
    }

    std::size_t bytes() const {
        return mesh_.bytes() + sites_.capacity() * sizeof(Point) + hints_.bytes();
    }

    // The first broken invariant, or nothing. O(n).
    std::string check() const {
        std::string broken = mesh_.check();
        if (!broken.empty()) return broken;
        for (Index v = 0; v < size(); ++v) {
            if (site(v) < site(smallest_)) return "site " + std::to_string(v) + " is the smallest";
            if (is_flat() && v >= 2 && orient(site(0), site(1), site(v)) != 0) {
                return "site " + std::to_string(v) + " is off the line, yet there are no triangles";
            }
        }
        for (Index h = 0; h < 3 * mesh_.triangles(); ++h) {
            broken = check_edge(h);
            if (!broken.empty()) return "half-edge " + std::to_string(h) + ": " + broken;
        }
        return {};
    }

   private:
    struct RimEdge {
        Index a, b, outer;  // runs from a to b; `outer` is its twin outside the cavity
    };

    void add_site(Point p) {
        Index v = size();
        mesh_.add_vertex();
        sites_.push_back(p);
        if (v == 0 || p < site(smallest_)) smallest_ = v;
        // A sample keeps the hints small; which sites it takes does not matter.
        if (v % 4 == 0) hints_.add(p, v, sites_);
    }

    Index start_edge(Point p, Index start) const {
        if (start == kNone) start = hints_.near(p);
        Index h = mesh_.leaving(start);
        // step from a ghost into the triangle under its hull edge
        if (mesh_.target(h) == kGhost) return mesh_.twin(Mesh::prev(h));
        if (mesh_.apex(h) == kGhost) return mesh_.twin(h);
        return h;
    }

    bool right_of(Index h, Point p) const {
        return orient(site(mesh_.origin(h)), site(mesh_.target(h)), p) < 0;
    }

    // A half-edge of the triangle that holds p, from one of a real triangle. Each step crosses an
    // edge that has p strictly beyond it; in a Delaunay triangulation that never cycles.
    Index walk(Point p, Index h) const {
        if (right_of(h, p)) h = mesh_.twin(h);
        while (!mesh_.is_ghost(Mesh::triangle(h))) {
            Index first = Mesh::next(h), second = Mesh::prev(h);
            if (right_of(first, p)) {
                h = mesh_.twin(first);
            } else if (right_of(second, p)) {
                h = mesh_.twin(second);
            } else {
                break;
            }
        }
        return h;
    }

    bool conflicts(Index t, Point p) const {
        Index a = mesh_.origin(3 * t), b = mesh_.origin(3 * t + 1), c = mesh_.origin(3 * t + 2);
        if (a != kGhost && b != kGhost && c != kGhost) {
            return in_circle_perturbed(site(a), site(b), site(c), p) > 0;
        }
        // turn the ghost vertex to c: the hull edge runs from b to a
        if (a == kGhost) {
            a = b;
            b = c;
        } else if (b == kGhost) {
            b = a;
            a = c;
        }
        int s = orient(site(a), site(b), p);
        return s > 0 || (s == 0 && between(site(a), p, site(b)));
    }

    // For three sites on a line: is p strictly between a and b?
    static bool between(Point a, Point p, Point b) {
        return a < b ? a < p && p < b : b < p && p < a;
    }

    // Depth first from the triangle of `seed`, edges in counter-clockwise order. No vertex lies
    // inside the cavity, so its triangles form a tree and none is met twice.
    void find_cavity(Point p, Index seed) {
        cavity_.clear();
        rim_.clear();
        pending_.clear();
        cavity_.push_back(Mesh::triangle(seed));
        pending_.push_back(Mesh::prev(seed));
        pending_.push_back(Mesh::next(seed));
        pending_.push_back(seed);
        while (!pending_.empty()) {
            Index h = pending_.back(), o = mesh_.twin(h);
            pending_.pop_back();
            if (conflicts(Mesh::triangle(o), p)) {
                cavity_.push_back(Mesh::triangle(o));
                pending_.push_back(Mesh::prev(o));
                pending_.push_back(Mesh::next(o));
            } else {
                rim_.push_back({mesh_.origin(h), mesh_.origin(o), o});
            }
        }
        cavity_.reserve(cavity_.size() + 2);
    }

    void fill_cavity(Index v) {
        cavity_.push_back(mesh_.add_triangle());
        cavity_.push_back(mesh_.add_triangle());
        Index last = cavity_.back();
        for (std::size_t n = 0; n < rim_.size(); ++n) {
            Index t = cavity_[n];
            auto [a, b, outer] = rim_[n];
            mesh_.set_triangle(t, a, b, v);
            mesh_.glue(3 * t, outer);
            mesh_.glue(3 * t + 2, 3 * last + 1);
            mesh_.set_leaving(a, 3 * t);
            last = t;
        }
        mesh_.set_leaving(v, 3 * last + 2);
    }

    // The slots of the sites on the line so far, in order along it.
    std::vector<Index> sites_on_line() {
        std::vector<Index> line(sites_.size());
        std::iota(line.begin(), line.end(), 0);
        std::sort(line.begin(), line.end(), [&](Index a, Index b) { return site(a) < site(b); });
        cavity_.reserve(2 * line.size());
        return line;
    }

    // The first site off the line, c: the only triangulation is a fan about it.
    //
    //              c                triangle i is line[i], line[i + 1], c;
    //            / | \              ghost i stands beyond line[i] line[i + 1];
    //          /   |   \            the last two beyond line[m] c and c line[0]
    //     line[0] ... line[m]
    //
    void raise_fan() {
        Index c = size() - 1, m = c - 1;
        if (orient(site(line_[0]), site(line_[1]), site(c)) < 0) {
            std::reverse(line_.begin(), line_.end());
        }
        for (Index n = 0; n < 2 * m + 2; ++n) cavity_.push_back(mesh_.add_triangle());
        for (Index n = 0; n < m; ++n) {
            Index a = line_[at(n)], b = line_[at(n + 1)];
            mesh_.set_triangle(n, a, b, c);
            mesh_.set_triangle(m + n, b, a, kGhost);
            mesh_.glue(3 * n, 3 * (m + n));
            if (n > 0) mesh_.glue(3 * n + 2, 3 * (n - 1) + 1);
            mesh_.set_leaving(a, 3 * n);
            mesh_.set_leaving(b, 3 * n + 1);
        }
        mesh_.set_triangle(2 * m, c, line_[at(m)], kGhost);
        mesh_.set_triangle(2 * m + 1, line_[0], c, kGhost);
        mesh_.glue(3 * (m - 1) + 1, 3 * (2 * m));
        mesh_.glue(2, 3 * (2 * m + 1));
        mesh_.set_leaving(c, 2);
        for (Index n = m, after = m + 1; n < 2 * m + 2; ++n, ++after) {
            if (after == 2 * m + 2) after = m;
            mesh_.glue(3 * n + 2, 3 * after + 1);
        }
        line_ = {};
    }

    std::string check_edge(Index h) const {
        Index o = mesh_.twin(h), a = mesh_.origin(h), b = mesh_.target(h);
        Index c = mesh_.apex(h), d = mesh_.apex(o);
        if (a == kGhost || b == kGhost) return {};
        if (c == kGhost) {
            // seen from outside, the hull turns right or goes straight on
            Index next = mesh_.apex(mesh_.twin(Mesh::next(h)));
            int turn = orient(site(a), site(b), site(next));
            bool convex = turn < 0 || (turn == 0 && between(site(a), site(b), site(next)));
            return convex ? "" : "the hull is not convex at its target";
        }
        if (orient(site(a), site(b), site(c)) <= 0) return "its triangle does not turn left";
        if (d != kGhost && in_circle_perturbed(site(a), site(b), site(c), site(d)) > 0) {
            return "its edge is not Delaunay";
        }
        return {};
    }

    Mesh mesh_;
    std::vector<Point> sites_;
    Hints hints_;
    Index smallest_ = kNone;
    // Scratch, kept to spare allocations: the triangles to replace, the half-edges to look beyond,
    // the rim, the sites on the line.
    std::vector<Index> cavity_, pending_, line_;
    std::vector<RimEdge> rim_;
};

}  // namespace flintknap
