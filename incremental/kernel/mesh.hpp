// The topology of a triangulation: half-edges in triples, and not a single coordinate.
//
// Half-edge h belongs to triangle h / 4 and runs from origin(h) to origin(next(h)) with the
// triangle on its left; twin(h) runs the other way in the triangle beyond. One number in four is
// nobody's: it takes less to count in fours than in threes. In memory there are no gaps.
//
//            c
//           / \            triangle t owns 4t, 4t + 1, 4t + 2
//     prev /   \ next      origin(h) = a, target(h) = b, apex(h) = c
//         /  t  \          origin(next(h)) = b, origin(prev(h)) = c
//        a ----- b
//            h
//
// Beyond each hull edge stands a ghost triangle, whose third corner is the vertex kGhost: so every
// half-edge has a twin, and the triangulation has no boundary to treat apart.
//
// Triangles that were removed wait in a list to be used again, strung along the twins of their
// first half-edges. A vertex that was removed has no half-edge leaving it.
//
// Invariants (check): twin is an involution without fixed points; twins share their end points;
// leaving(v) is a half-edge with origin v.
// Cost: 24 bytes a triangle, 4 a vertex.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "array.hpp"

namespace flintknap {

using Index = std::int32_t;

constexpr Index kNone = -1;
constexpr Index kGhost = -1;
constexpr Index kFree = -2;  // origin of the first half-edge of a triangle that is not in use

inline std::size_t at(Index i) { return static_cast<std::size_t>(i); }

// One of two, without a branch: for what nobody can foresee.
inline Index chosen(bool first, Index a, Index b) {
    return b ^ ((a ^ b) & -static_cast<Index>(first));
}

class Mesh {
   public:
    struct HalfEdge {
        Index origin, twin;
    };

    // Which of three a half-edge is nobody can foresee, so there is no branch. That it is not
    // negative is said, for compilers do not know.
    static Index triangle(Index h) { return static_cast<Index>(count(h) / 4); }
    static Index side(Index h) { return h & 3; }
    static Index first(Index t) { return 4 * t; }
    static Index next(Index h) { return h + 1 - 3 * (h >> 1 & 1); }
    static Index prev(Index h) { return h - 1 + 3 * static_cast<Index>(side(h) == 0); }
    // Numbers without gaps.
    static std::size_t compact(Index h) { return std::size_t{count(h)} - count(h) / 4; }

    Index origin(Index h) const { return edges_[compact(h)].origin; }
    Index twin(Index h) const { return edges_[compact(h)].twin; }
    Index target(Index h) const { return origin(next(h)); }
    Index apex(Index h) const { return origin(prev(h)); }
    Index leaving(Index v) const { return leaving_[at(v)]; }

    // (A function that only fetches has no effect, so GCC leaves its calls out if it looks at them
    // before they are inlined. So all of those are inlined by order.)
    [[gnu::always_inline]] void prefetch(Index h) const { __builtin_prefetch(&edges_[compact(h)]); }

    // Numbers up to these are or were in use.
    Index triangles() const { return static_cast<Index>(edges_.size() / 3); }
    Index vertices() const { return static_cast<Index>(leaving_.size()); }
    bool is_free(Index t) const { return origin(first(t)) == kFree; }
    bool is_vertex(Index v) const { return leaving_[at(v)] != kNone; }
    bool is_ghost(Index t) const {
        return origin(first(t)) == kGhost || origin(first(t) + 1) == kGhost ||
               origin(first(t) + 2) == kGhost;
    }
    // The half-edge opposite the ghost vertex of a ghost: the hull edge, seen from outside.
    Index hull_edge(Index t) const {
        Index h = first(t);
        while (apex(h) != kGhost) ++h;
        return h;
    }

    // Counter-clockwise about origin(h): the half-edge that leaves it next.
    Index turn(Index h) const { return twin(prev(h)); }

    void reserve(std::size_t vertices) {
        edges_.reserve(6 * vertices);
        leaving_.reserve(vertices);
    }
    // Room for one more vertex and some triangles, found before anything is changed.
    void make_room(std::size_t triangles) {
        edges_.reserve(edges_.size() + 3 * triangles);
        leaving_.reserve(leaving_.size() + 1);
    }
    void add_vertex() { leaving_.push_back(kNone); }
    Index add_triangle() {
        if (free_ != kNone) {
            Index t = free_;
            free_ = twin(first(t));
            return t;
        }
        edges_.resize(edges_.size() + 3);
        return triangles() - 1;
    }
    void remove_triangle(Index t) {
        edges_[compact(first(t))] = {kFree, free_};
        free_ = t;
    }
    void remove_all_triangles() {
        edges_.clear();
        free_ = kNone;
    }
    void set_triangle(Index t, Index a, Index b, Index c) {
        edges_[compact(first(t))].origin = a;
        edges_[compact(first(t) + 1)].origin = b;
        edges_[compact(first(t) + 2)].origin = c;
    }
    void glue(Index h, Index o) {
        edges_[compact(h)].twin = o;
        edges_[compact(o)].twin = h;
    }
    void set_leaving(Index v, Index h) {
        if (v != kGhost) leaving_[at(v)] = h;
    }

    void set_leaving_corners(Index t) {
        for (Index h = first(t); h < first(t) + 3; ++h) set_leaving(origin(h), h);
    }

    template <class Archive>
    void transfer(Archive& archive) {
        archive(edges_);
        archive(leaving_);
        archive(free_);
    }

    std::size_t bytes() const {
        return edges_.capacity() * sizeof(HalfEdge) + leaving_.capacity() * sizeof(Index);
    }

    // The first broken invariant, or nothing. O(n).
    std::string check() const {
        auto is_edge = [&](Index h) { return h >= 0 && h < first(triangles()) && side(h) < 3; };
        for (Index h = 0; h < first(triangles()); ++h) {
            if (!is_edge(h) || is_free(triangle(h))) continue;
            Index o = twin(h);
            if (!is_edge(o) || is_free(triangle(o)) || o == h || twin(o) != h) {
                return "half-edge " + std::to_string(h) + ": its twin " + std::to_string(o) +
                       " does not point back";
            }
            if (origin(h) != target(o) || target(h) != origin(o)) {
                return "half-edge " + std::to_string(h) + ": end points differ from those of " +
                       std::to_string(o);
            }
        }
        for (Index v = 0; triangles() > 0 && v < vertices(); ++v) {
            Index h = leaving(v);
            if (!is_vertex(v)) continue;
            if (!is_edge(h) || origin(h) != v) {
                return "vertex " + std::to_string(v) + ": half-edge " + std::to_string(h) +
                       " does not leave it";
            }
        }
        return {};
    }

   private:
    static std::uint32_t count(Index h) { return static_cast<std::uint32_t>(h); }

    Array<HalfEdge> edges_;
    Array<Index> leaving_;
    Index free_ = kNone;
};

}  // namespace flintknap
