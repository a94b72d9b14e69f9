// The canonical Delaunay triangulation of a set of sites that come and go.
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
// When a site leaves, the hole in its place is filled (hole.hpp), with two triangles less.
//
// As long as all sites lie on one line there are no triangles; the first site off it makes a fan
// about itself, and when the last such site leaves, the triangles go. Sites are numbered by slots
// in the order in which they are placed; slots that became free are used again.
//
// Invariants (check): those of the mesh; every triangle turns left; every edge is Delaunay in the
// perturbed sense; every ghost stands on a hull edge and the hull is convex.
// Cost: O(1) expected changes for a site in random order, and a walk to it, O(log n) expected with
// Hints; O(degree) in the worst case, which a set in order along a curve does reach. A removal
// costs what filling its hole does.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "hints.hpp"
#include "hole.hpp"
#include "mesh.hpp"
#include "predicates.hpp"

namespace flintknap {

// For three sites on a line: is p strictly between a and b?
inline bool between(Point a, Point p, Point b) { return a < b ? a < p && p < b : b < p && p < a; }

// Whether p is in conflict with the triangle a, b, c: inside its circle, ties broken by
// coordinates; for a ghost, strictly beyond its hull edge or on the open segment.
inline bool conflicts(const Sites& sites, Index a, Index b, Index c, Point p) {
    if (a != kGhost && b != kGhost && c != kGhost) {
        return in_circle_perturbed(sites[at(a)], sites[at(b)], sites[at(c)], p) > 0;
    }
    // turn the ghost vertex to c: the hull edge runs from b to a
    if (a == kGhost) {
        a = b;
        b = c;
    } else if (b == kGhost) {
        b = a;
        a = c;
    }
    int s = orient(sites[at(a)], sites[at(b)], p);
    return s > 0 || (s == 0 && between(sites[at(a)], p, sites[at(b)]));
}

// Somebody whom changes do not concern.
struct Nobody {
    void destroying(const Array<Index>&) {}
    void created(const Array<Index>&) {}
    void appeared(Index) {}
};

class Triangulation {
   public:
    const Mesh& mesh() const { return mesh_; }
    const Sites& sites() const { return sites_; }
    Point site(Index v) const { return sites_[at(v)]; }
    // How many sites there are; they have slots below slots(), some of which may be free.
    Index size() const { return slots() - static_cast<Index>(free_slots_.size()); }
    Index slots() const { return static_cast<Index>(sites_.size()); }
    bool is_site(Index v) const { return mesh_.is_vertex(v); }
    bool is_flat() const { return mesh_.triangles() == 0; }
    // The lexicographically smallest site, a hull vertex. Needs triangles.
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
        make_room();
        if (is_flat()) return insert_flat(p);
        find_cavity(p, walk(p, start_edge(p, start)));
        observer.destroying(cavity_);
        Index v = add_site(p);
        if (p < site(smallest_)) smallest_ = v;
        fill_cavity(v);
        return v;
    }

    Index insert(Point p) {
        Nobody nobody;
        return insert(p, kNone, nobody);
    }

    // Removes the site in slot v. `observer` learns which triangles go, while they still stand;
    // created() tells which came. If memory ends, nothing has changed here, though the observer may
    // have been told.
    template <class Observer>
    void remove(Index v, Observer& observer) {
        make_room();
        if (is_flat()) {
            cavity_.clear();
            drop_from_line(v);
        } else {
            find_star(v);
            observer.destroying(cavity_);
            if (find_line()) {
                flatten();
            } else if (rim_.size() <= kSmallHole) {
                leave_hole(v);
                SmallHole(mesh_, sites_, rim_).fill(cavity_);
            } else {
                LargeHole<Triangulation> hole(sites_, rim_);
                leave_hole(v);
                hole.fill(mesh_, cavity_);
            }
        }
        remove_site(v);
    }

    // The triangles that the last insert or remove made.
    const Array<Index>& created() const { return cavity_; }

    // The half-edges along the hull, counter-clockwise from the smallest site. O(size).
    std::vector<Index> hull() const {
        std::vector<Index> edges;
        Index h = mesh_.leaving(smallest_);
        while (mesh_.apex(mesh_.twin(h)) != kGhost) h = mesh_.turn(h);
        do {
            edges.push_back(h);
            // from the ghost beyond h to the next one, about the ghost vertex
            h = mesh_.twin(Mesh::prev(mesh_.twin(Mesh::prev(mesh_.twin(h)))));
        } while (h != edges[0]);
        return edges;
    }

    // While all sites lie on one line: they, in the order of their coordinates. O(n log n).
    std::vector<Index> along_line() const {
        std::vector<Index> line(line_.begin(), line_.end());
        std::sort(line.begin(), line.end(), [&](Index a, Index b) { return site(a) < site(b); });
        return line;
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

    template <class Archive>
    void transfer(Archive& archive) {
        mesh_.transfer(archive);
        hints_.transfer(archive);
        archive(sites_);
        archive(smallest_);
        archive(free_slots_);
        archive(line_);
    }

    std::size_t bytes() const {
        return mesh_.bytes() + sites_.capacity() * sizeof(Point) + hints_.bytes();
    }

    // The first broken invariant, or nothing. O(n).
    std::string check() const {
        std::string broken = mesh_.check();
        if (!broken.empty()) return broken;
        Index count = 0;
        for (Index v = 0; v < slots(); ++v) {
            if (!is_site(v)) continue;
            ++count;
            if (is_flat() ? line_[at(mesh_.leaving(v))] != v : site(v) < site(smallest_)) {
                return "site " + std::to_string(v) +
                       (is_flat() ? " is not in its place on the line" : " is the smallest");
            }
        }
        if (count != size()) return "miscounted the sites";
        if (line_.size() != (is_flat() ? at(count) : 0)) return "not all sites are on the line";
        for (Index v : line_) {
            if (is_off_line(site(v))) return "site " + std::to_string(v) + " is off the line";
        }
        for (Index t = 0; t < mesh_.triangles(); ++t) {
            if (mesh_.is_free(t)) continue;
            for (Index h = Mesh::first(t); h < Mesh::first(t) + 3; ++h) {
                broken = check_edge(h);
                if (!broken.empty()) return "half-edge " + std::to_string(h) + ": " + broken;
            }
        }
        return {};
    }

   private:
    // Room for whatever an insert or a remove adds, but for the triangles of a fan.
    void make_room() {
        sites_.reserve(sites_.size() + 1);
        free_slots_.reserve(sites_.capacity());
        line_.reserve(line_.size() + 1);
        hints_.make_room();
        mesh_.make_room(2);
    }

    // A sample keeps the hints small; which sites it takes does not matter.
    static bool is_sample(Index v) { return v % 4 == 0; }

    Index add_site(Point p) {
        Index v = slots();
        if (free_slots_.empty()) {
            mesh_.add_vertex();
            sites_.push_back(p);
        } else {
            v = free_slots_.back();
            free_slots_.pop_back();
            sites_[at(v)] = p;
        }
        if (is_sample(v)) hints_.add(p, v, sites_);
        return v;
    }

    void remove_site(Index v) {
        if (is_sample(v)) hints_.remove(site(v), v);
        mesh_.set_leaving(v, kNone);
        free_slots_.push_back(v);
    }

    Index start_edge(Point p, Index start) const {
        if (start == kNone) start = hints_.near(p);
        if (start == kNone) start = smallest_;  // no site of the sample is left
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

    bool is_in_conflict(Index t, Point p) const {
        return conflicts(sites_, mesh_.origin(Mesh::first(t)), mesh_.origin(Mesh::first(t) + 1),
                         mesh_.origin(Mesh::first(t) + 2), p);
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
            if (is_in_conflict(Mesh::triangle(o), p)) {
                cavity_.push_back(Mesh::triangle(o));
                pending_.back() = Mesh::prev(o);
                pending_.push_back(Mesh::next(o));
            } else {
                pending_.pop_back();
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
            mesh_.glue(Mesh::first(t), outer);
            mesh_.glue(Mesh::first(t) + 2, Mesh::first(last) + 1);
            mesh_.set_leaving(a, Mesh::first(t));
            last = t;
        }
        mesh_.set_leaving(v, Mesh::first(last) + 2);
    }

    // ---------------------------------------------------------------- sites on a line
    bool is_off_line(Point p) const {
        return line_.size() >= 2 && orient(site(line_[0]), site(line_[1]), p) != 0;
    }

    Index insert_flat(Point p) {
        bool off_line = is_off_line(p);
        cavity_.clear();
        if (off_line) {
            mesh_.make_room(2 * line_.size());
            cavity_.reserve(2 * line_.size());
        }
        Index v = add_site(p);
        if (off_line) {
            raise_fan(v);
        } else {
            mesh_.set_leaving(v, static_cast<Index>(line_.size()));
            line_.push_back(v);
        }
        return v;
    }

    void drop_from_line(Index v) {
        Index place = mesh_.leaving(v), last = line_.back();
        line_[at(place)] = last;
        mesh_.set_leaving(last, place);
        line_.pop_back();
    }

    // With a star found: do all sites but its centre lie on one line? Then they are its link.
    bool find_line() {
        line_.reserve(rim_.size());
        line_.clear();
        for (const RimEdge& e : rim_) {
            if (e.a == kGhost) continue;
            if (is_off_line(site(e.a))) break;
            line_.push_back(e.a);
        }
        if (line_.size() != at(size()) - 1) line_.clear();
        return !line_.empty();
    }

    void flatten() {
        for (std::size_t n = 0; n < line_.size(); ++n) {
            mesh_.set_leaving(line_[n], static_cast<Index>(n));
        }
        mesh_.remove_all_triangles();
        cavity_.clear();
        smallest_ = kNone;
    }

    // The first site off the line, c: the only triangulation is a fan about it.
    //
    //              c                triangle i is line[i], line[i + 1], c;
    //            / | \              ghost i stands beyond line[i] line[i + 1];
    //          /   |   \            the last two beyond line[m] c and c line[0]
    //     line[0] ... line[m]
    //
    void raise_fan(Index c) {
        Index m = static_cast<Index>(line_.size()) - 1;
        std::sort(line_.begin(), line_.end(), [&](Index a, Index b) { return site(a) < site(b); });
        smallest_ = site(c) < site(line_[0]) ? c : line_[0];
        if (orient(site(line_[0]), site(line_[1]), site(c)) < 0) {
            std::reverse(line_.begin(), line_.end());
        }
        for (Index n = 0; n < 2 * m + 2; ++n) cavity_.push_back(mesh_.add_triangle());
        for (Index n = 0; n < m; ++n) {
            Index a = line_[at(n)], b = line_[at(n + 1)];
            mesh_.set_triangle(n, a, b, c);
            mesh_.set_triangle(m + n, b, a, kGhost);
            mesh_.glue(Mesh::first(n), Mesh::first(m + n));
            if (n > 0) mesh_.glue(Mesh::first(n) + 2, Mesh::first(n - 1) + 1);
            mesh_.set_leaving(a, Mesh::first(n));
            mesh_.set_leaving(b, Mesh::first(n) + 1);
        }
        mesh_.set_triangle(2 * m, c, line_[at(m)], kGhost);
        mesh_.set_triangle(2 * m + 1, line_[0], c, kGhost);
        mesh_.glue(Mesh::first(m - 1) + 1, Mesh::first(2 * m));
        mesh_.glue(Mesh::first(0) + 2, Mesh::first(2 * m + 1));
        mesh_.set_leaving(c, 2);
        for (Index n = m, after = m + 1; n < 2 * m + 2; ++n, ++after) {
            if (after == 2 * m + 2) after = m;
            mesh_.glue(Mesh::first(n) + 2, Mesh::first(after) + 1);
        }
        line_.clear();
    }

    // ---------------------------------------------------------------- removal
    // The triangles about v into cavity_ and its link into rim_, both counter-clockwise.
    //
    //          b --- a          h runs from v to a; the link's edge from a to b
    //         / \ t / \         is next(h), and `outer` is its twin beyond
    //        o --- v --- o
    //
    void find_star(Index v) {
        cavity_.clear();
        rim_.clear();
        Index first = mesh_.leaving(v), h = first;
        do {
            cavity_.push_back(Mesh::triangle(h));
            rim_.push_back({mesh_.target(h), mesh_.apex(h), mesh_.twin(Mesh::next(h))});
            h = mesh_.turn(h);
        } while (h != first);
    }

    // Two of the triangles about v are not needed any more. If v is the smallest site, so a hull
    // vertex, sites grow along the hull in both directions from it: the next one is in its link.
    void leave_hole(Index v) {
        for (int spare = 0; spare < 2; ++spare) {
            mesh_.remove_triangle(cavity_.back());
            cavity_.pop_back();
        }
        if (v != smallest_) return;
        smallest_ = kNone;
        for (const RimEdge& e : rim_) {
            if (e.a == kGhost) continue;
            if (smallest_ == kNone || site(e.a) < site(smallest_)) smallest_ = e.a;
        }
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
    Sites sites_;
    Hints hints_;
    Index smallest_ = kNone;
    Array<Index> free_slots_;
    Array<Index> line_;  // all sites while they lie on one line; leaving() is the place in it
    // Scratch, kept to spare allocations: the triangles to replace, the half-edges to look beyond,
    // the rim.
    Array<Index> cavity_, pending_;
    std::vector<RimEdge> rim_;
};

}  // namespace flintknap
