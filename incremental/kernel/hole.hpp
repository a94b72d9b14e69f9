// What a vanished site leaves behind, and how it is filled.
//
// Theory. The triangles about a site leave a hole, star-shaped about it, whose rim is the link of
// the site. A Delaunay triangulation is unique (ties broken by coordinates) and its triangles are
// told by conflicts alone, so the hole is filled by those triangles of the triangulation of the
// link that lie within. A small hole is filled ear by ear: a corner of the rim whose triangle turns
// left and is in conflict with no other vertex of the link is one of them, and there are always
// two. A large one is filled with copies from a triangulation of the link made for it.
//
// The ghost vertex may be on the rim, and then some of the triangles are ghosts.
// Cost: O(k^2) for a rim of k <= kSmallHole, else O(k log k) expected.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "mesh.hpp"
#include "order.hpp"
#include "predicates.hpp"

namespace flintknap {

using Sites = std::vector<Point>;

constexpr std::size_t kSmallHole = 16;

// An edge of a rim, from a to b with the hole on its left; `outer` is its twin, outside.
struct RimEdge {
    Index a, b, outer;
};

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

// Fills a hole ear by ear, with the first of the triangles given.
class SmallHole {
   public:
    SmallHole(Mesh& mesh, const Sites& sites, std::vector<RimEdge>& rim)
        : mesh_(mesh), sites_(sites), rim_(rim) {}

    //        c                  the ear a, b, c is cut off: the edges ab and bc of the rim give way
    //       / \      rim        to ac, whose twin is the ear's third edge
    //      a - b ---
    //
    void fill(const std::vector<Index>& triangles) {
        std::size_t used = 0;
        for (std::size_t n = 0; rim_.size() > 3;) {
            n %= rim_.size();
            if (!is_ear(n)) {
                ++n;
                continue;
            }
            std::size_t after = (n + 1) % rim_.size();
            RimEdge e = rim_[n], f = rim_[after];
            Index t = triangles[used++];
            mesh_.set_triangle(t, e.a, e.b, f.b);
            mesh_.glue(3 * t, e.outer);
            mesh_.glue(3 * t + 1, f.outer);
            mesh_.set_leaving_corners(t);
            rim_[n] = {e.a, f.b, 3 * t + 2};
            rim_.erase(rim_.begin() + static_cast<std::ptrdiff_t>(after));
        }
        Index t = triangles[used];
        mesh_.set_triangle(t, rim_[0].a, rim_[1].a, rim_[2].a);
        for (Index side = 0; side < 3; ++side) mesh_.glue(3 * t + side, rim_[at(side)].outer);
        mesh_.set_leaving_corners(t);
    }

   private:
    // Whether the corner between edges n and n + 1 of the rim is a triangle of the hole.
    bool is_ear(std::size_t n) const {
        Index a = rim_[n].a, b = rim_[n].b, c = rim_[(n + 1) % rim_.size()].b;
        bool real = a != kGhost && b != kGhost && c != kGhost;
        if (real && orient(sites_[at(a)], sites_[at(b)], sites_[at(c)]) <= 0) return false;
        for (const RimEdge& other : rim_) {
            Index d = other.a;
            if (d == a || d == b || d == c || d == kGhost) continue;
            if (conflicts(sites_, a, b, c, sites_[at(d)])) return false;
        }
        return true;
    }

    Mesh& mesh_;
    const Sites& sites_;
    std::vector<RimEdge>& rim_;
};

// Fills a hole from a triangulation of its link, which it makes first: that may fail, filling may
// not.
template <class Triangulation>
class LargeHole {
   public:
    LargeHole(const Sites& sites, const std::vector<RimEdge>& rim) : rim_(rim) {
        std::vector<Ranked> order;
        for (std::size_t n = 0; n < rim.size(); ++n) {
            if (rim[n].a == kGhost) {
                ghost_ = n;
            } else {
                order.push_back({mix(n), static_cast<Index>(n)});
            }
        }
        radix_sort(order);
        place_.reserve(order.size());
        for (const Ranked& r : order) {
            link_.insert(sites[at(rim[at(r.item)].a)]);
            place_.push_back(at(r.item));
        }
        copy_.resize(at(link_.mesh().triangles()), kNone);
        todo_.reserve(copy_.size());
    }

    void fill(Mesh& mesh, const std::vector<Index>& triangles) {
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
                mesh.set_triangle(t, original(link.origin(3 * x)), original(link.origin(3 * x + 1)),
                                  original(link.origin(3 * x + 2)));
                mesh.set_leaving_corners(t);
                todo_.push_back(x);
            }
            return copy_[at(x)];
        };
        copy(Mesh::triangle(edge_on_rim()));
        while (!todo_.empty()) {
            Index x = todo_.back();
            todo_.pop_back();
            for (Index h = 3 * x; h < 3 * x + 3; ++h) {
                Index here = 3 * copy_[at(x)] + h % 3, o = link.twin(h);
                if (is_on_rim(h)) {
                    mesh.glue(here, rim_[place(link.origin(h))].outer);
                } else {
                    mesh.glue(here, 3 * copy(Mesh::triangle(o)) + o % 3);
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
        Index h = 0;
        while (!is_on_rim(h)) ++h;
        return h;
    }

    // The link lies on a line, the other sites do not: each of its edges is a hull edge now.
    //
    //             ghost              rim_[ghost_] runs from the ghost to the first vertex; all
    //           /  / \  \            others on the line are a hull edge each
    //          o--o---o--o
    //
    void fill_with_ghosts(Mesh& mesh, const std::vector<Index>& triangles) {
        std::size_t k = rim_.size();
        Index last = rim_[ghost_].outer;
        for (std::size_t used = 0; used < k - 2; ++used) {
            auto [a, b, outer] = rim_[(ghost_ + 1 + used) % k];
            Index t = triangles[used];
            mesh.set_triangle(t, a, b, kGhost);
            mesh.glue(3 * t, outer);
            mesh.glue(3 * t + 2, last);
            mesh.set_leaving_corners(t);
            last = 3 * t + 1;
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
