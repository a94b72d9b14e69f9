// What a vanished site leaves behind, and how it is filled.
//
// Theory. The triangles about a site leave a hole, star-shaped about it, whose rim is the link of
// the site. A Delaunay triangulation is unique (ties broken by coordinates) and its triangles are
// told by conflicts alone, so the hole is filled by those triangles of the triangulation of the
// link that lie within. A small hole is filled from its rim inward: of the triangle on an edge, the
// apex is the one whose circle is empty. A large one is filled with copies from a triangulation of
// the link made for it.
//
// The ghost vertex may be on the rim, and then some of the triangles are ghosts.
// Cost: for a rim of k <= kSmallHole, O(k log k) if the apexes part it evenly, O(k^2) at worst; for
// more, O(k log k) expected, with a larger constant: beyond 150 it wins.
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "mesh.hpp"
#include "order.hpp"
#include "predicates.hpp"

namespace flintknap {

using Sites = Array<Point>;

constexpr std::size_t kSmallHole = 128;

// An edge of a rim, from a to b with the hole on its left; `outer` is its twin, outside.
struct RimEdge {
    Index a, b, outer;
};

// Fills a hole from its rim inward, with the first of the triangles given.
//
//            m                 A polygon i .. j of the rim and its closing edge. The triangle on
//            that
//          / | \              edge has its apex m where j and i are seen under the largest angle;
//         o  |  o              two smaller polygons are left, i .. m and m .. j, each with a side
//         | / \ |             of the triangle for its closing edge.
//         i --- j
//           outer
//
// The ghost sees the vertices of the rim as a chain, whose hull is what it borders on next: a
// scan along the chain finds it, and what lies between chain and hull are polygons as above.
class SmallHole {
   public:
    SmallHole(Mesh& mesh, const Sites& sites, std::vector<RimEdge>& rim)
        : mesh_(mesh), sites_(sites), rim_(rim) {}

    void fill(const Array<Index>& triangles) {
        next_ = triangles.data();
        auto is_ghost = [](const RimEdge& e) { return e.a == kGhost; };
        auto ghost = std::find_if(rim_.begin(), rim_.end(), is_ghost);
        if (ghost == rim_.end()) {
            fill_polygon({0, rim_.size() - 1, rim_.back().outer});
        } else {
            std::rotate(rim_.begin(), ghost, rim_.end());
            fill_beyond_hull();
        }
    }

   private:
    // Vertices i to j of the rim; its closing edge runs from j to i and `outer` is its twin.
    struct Polygon {
        std::size_t i, j;
        Index outer;
    };

    Point site(std::size_t n) const { return sites_[at(rim_[n].a)]; }

    Index add_triangle(Index a, Index b, Index c) {
        Index t = *next_++;
        mesh_.set_triangle(t, a, b, c);
        mesh_.set_leaving_corners(t);
        return t;
    }

    void fill_polygon(Polygon whole) {
        std::array<Polygon, kSmallHole> todo;
        todo[0] = whole;
        for (std::size_t left = 1; left > 0;) {
            auto [i, j, outer] = todo[--left];
            if (j == i + 1) {
                mesh_.glue(rim_[i].outer, outer);
                continue;
            }
            std::size_t m = apex(i, j);
            Index t = add_triangle(rim_[j].a, rim_[i].a, rim_[m].a);
            mesh_.glue(Mesh::first(t), outer);
            todo[left++] = {i, m, Mesh::first(t) + 1};
            todo[left++] = {m, j, Mesh::first(t) + 2};
        }
    }

    // The vertex whose circle through j and i holds no other vertex of the polygon.
    std::size_t apex(std::size_t i, std::size_t j) const {
        if (j == i + 2) return i + 1;
        Point a = site(j), b = site(i);
        std::size_t best = i;
        for (std::size_t n = i + 1; n < j; ++n) {
            Point p = site(n);
            if (orient(a, b, p) <= 0) continue;
            if (best == i || in_circle_perturbed(a, b, site(best), p) > 0) best = n;
        }
        return best;
    }

    // The ghost is the first on the rim.
    void fill_beyond_hull() {
        std::array<std::size_t, kSmallHole> hull;
        std::size_t size = 0;
        for (std::size_t n = 1; n < rim_.size(); ++n) {
            while (size > 1 && orient(site(hull[size - 2]), site(hull[size - 1]), site(n)) > 0) {
                --size;
            }
            hull[size++] = n;
        }
        Index before = rim_[0].outer;
        for (std::size_t n = 1; n < size; ++n) {
            Index t = add_triangle(rim_[hull[n - 1]].a, rim_[hull[n]].a, kGhost);
            mesh_.glue(before, Mesh::first(t) + 2);
            before = Mesh::first(t) + 1;
            fill_polygon({hull[n - 1], hull[n], Mesh::first(t)});
        }
        mesh_.glue(before, rim_.back().outer);
    }

    Mesh& mesh_;
    const Sites& sites_;
    std::vector<RimEdge>& rim_;
    const Index* next_ = nullptr;
};

// Fills a hole from a triangulation of its link, which it makes first: that may fail, filling may
// not.
template <class Triangulation>
class LargeHole {
   public:
    LargeHole(const Sites& sites, const std::vector<RimEdge>& rim) : rim_(rim) {
        Order order(rim.size(), mix);
        place_.reserve(rim.size());
        for (std::size_t i = 0; i < rim.size(); ++i) {
            std::size_t n = order[i];
            if (rim[n].a == kGhost) {
                ghost_ = n;
                continue;
            }
            link_.insert(sites[at(rim[n].a)]);
            place_.push_back(n);
        }
        copy_.resize(at(link_.mesh().triangles()), kNone);
        todo_.reserve(copy_.size());
    }

    void fill(Mesh& mesh, const Array<Index>& triangles) {
        if (link_.is_flat()) {
            fill_with_ghosts(mesh, triangles);
            return;
        }
        // Flood the link's triangles from one at the rim; do not cross the rim.
        std::size_t used = 0;
        const Mesh& link = link_.mesh();
        auto copy = [&](Index x) {
            if (copy_[at(x)] == kNone) {
                Index t = copy_[at(x)] = triangles[used++];
                mesh.set_triangle(t, original(link.origin(Mesh::first(x))),
                                  original(link.origin(Mesh::first(x) + 1)),
                                  original(link.origin(Mesh::first(x) + 2)));
                mesh.set_leaving_corners(t);
                todo_.push_back(x);
            }
            return copy_[at(x)];
        };
        copy(Mesh::triangle(edge_on_rim()));
        while (!todo_.empty()) {
            Index x = todo_.back();
            todo_.pop_back();
            for (Index h = Mesh::first(x); h < Mesh::first(x) + 3; ++h) {
                Index here = Mesh::first(copy_[at(x)]) + Mesh::side(h), o = link.twin(h);
                if (is_on_rim(h)) {
                    mesh.glue(here, rim_[place(link.origin(h))].outer);
                } else {
                    mesh.glue(here, Mesh::first(copy(Mesh::triangle(o))) + Mesh::side(o));
                }
            }
        }
    }

   private:
    static constexpr std::size_t kNowhere = ~std::size_t{0};

    std::size_t place(Index v) const { return v == kGhost ? ghost_ : place_[at(v)]; }
    Index original(Index v) const { return rim_[place(v)].a; }
    bool is_on_rim(Index h) const {
        std::size_t from = place(link_.mesh().origin(h)), to = place(link_.mesh().target(h));
        return from != kNowhere && to == (from + 1) % rim_.size();
    }

    Index edge_on_rim() const {
        for (Index x = 0;; ++x) {
            for (Index h = Mesh::first(x); h < Mesh::first(x) + 3; ++h) {
                if (is_on_rim(h)) return h;
            }
        }
    }

    // The link lies on a line, the other sites do not: each of its edges is a hull edge now.
    //
    //             ghost              rim_[ghost_] runs from the ghost to the first vertex; all
    //           /  / \  \            others on the line are a hull edge each
    //          o--o---o--o
    //
    void fill_with_ghosts(Mesh& mesh, const Array<Index>& triangles) {
        std::size_t k = rim_.size();
        Index last = rim_[ghost_].outer;
        for (std::size_t used = 0; used < k - 2; ++used) {
            auto [a, b, outer] = rim_[(ghost_ + 1 + used) % k];
            Index t = triangles[used];
            mesh.set_triangle(t, a, b, kGhost);
            mesh.glue(Mesh::first(t), outer);
            mesh.glue(Mesh::first(t) + 2, last);
            mesh.set_leaving_corners(t);
            last = Mesh::first(t) + 1;
        }
        mesh.glue(last, rim_[(ghost_ + k - 1) % k].outer);
    }

    const std::vector<RimEdge>& rim_;
    Triangulation link_;
    std::vector<std::size_t> place_;  // by vertex of the link: where on the rim it is
    std::size_t ghost_ = kNowhere;    // where the ghost is on the rim, if it is
    std::vector<Index> copy_;         // by triangle of the link: its copy, or kNone
    std::vector<Index> todo_;
};

}  // namespace flintknap
