// What a vertex inside the object sees: which edges of the ring, how wide a gamma-graph must be to
// join it to their ends, and how large the discs are that make the graph so wide.
//
// Theory (section 3.4). *Windows* spread from k through the triangles of the object. A window is a
// cone of directions between two vertices, right and left, that leaves the triangle it has come to
// through one edge; a vertex beyond the edge that lies in the cone parts it in two. So an edge of
// the ring that is reached with its own ends as bounds is seen whole, and the triangle over it
// holds no other site; one that is reached otherwise is seen in part.
//
//                a --- e --- b          window (e; right, left): the cone of k between them.
//                 \         /           If v, the vertex beyond e, lies in it, two go on:
//            right \   .   / left       (a v; right, v) and (v b; v, left); if it lies to the
//                   \     /             right or the left, one goes on, with the bounds it had.
//                    \ k /
//
// *Need.* Let phi be the largest angle under which a site sees k and p. The pair is in the graph
// gamma([-1, 1], [d, 1]), d < 0, iff it is Delaunay (or crosses none but cocircular sites) or
// sin phi - 1 >= d. Needs are given as cotangents: 0 for the former, else cot phi < 0, which is
// correctly rounded. The site with the largest angle on either side of kp is an end of a Delaunay
// edge that crosses kp, so a walk along kp finds it (section 3.4).
//
// *Size.* The discs of the pair have the diameter |kp| / sin phi. Its square is the size.
//
// *Bound.* What lies behind a window is no nearer than the part m n of its edge in the cone. And
// seen from k, whatever lies beyond a segment from a site q to a place n, between the directions of
// both, is seen, with k, from q under a wider angle than n is. So the cotangents of the angles at
// right and a towards n and at left and b towards m bound the needs behind a window, and with the
// distance of m n the sizes. Only sites on an empty circle with k have a need of 0 all the same.
//
// Cost: O(1) a window. A need: O(1) a triangle crossed.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "constriction.hpp"

namespace flintknap {

class Sight {
   public:
    static constexpr double kNever = std::numeric_limits<double>::quiet_NaN();

    // More than what rounding does to a few products, and to what is made of them.
    static constexpr double kSlack = 1e-14;

    // A cone of k between `right` and `left` that leaves a triangle through `edge`; or, if there is
    // no edge, an edge of the ring from `right` to `left` that is seen whole. A triangle that has k
    // and a corner behind it has no size below `size`, and no need above `need`.
    struct Window {
        double size, need;
        Index k, edge, right, left;
        bool on_circle;  // whether all vertices on the way here lie on an empty circle with k
    };

    Sight(const Triangulation& triangulation, const Constriction& constriction)
        : t_(triangulation), c_(constriction) {}

    // The windows of a vertex strictly inside. `passed` learns of each triangle on the way, `seen`
    // of each vertex, `opened` of each window.
    template <class Passed, class Seen, class Opened>
    void open(Index k, Passed passed, Seen seen, Opened opened) const {
        const Mesh& m = t_.mesh();
        Index first = m.leaving(k), spoke = first;
        do {
            Index edge = Mesh::next(spoke);
            passed(Mesh::triangle(edge));
            seen(m.origin(edge));
            enter({0, 0, k, edge, m.origin(edge), m.target(edge), true}, passed, opened);
            spoke = m.turn(spoke);
        } while (spoke != first);
    }

    // The windows behind a window.
    template <class Passed, class Seen, class Opened>
    void look_through(const Window& w, Passed passed, Seen seen, Opened opened) const {
        const Mesh& m = t_.mesh();
        Index o = m.twin(w.edge), v = m.apex(o);
        passed(Mesh::triangle(o));
        bool on_circle = w.on_circle && are_cocircular(w.k, m.target(o), m.origin(o), v);
        bool right_of_left = turn(w.k, w.left, v) < 0, left_of_right = turn(w.k, w.right, v) > 0;
        Index right = Mesh::next(o), left = Mesh::prev(o);
        if (right_of_left && left_of_right) {
            seen(v);
            enter({w.size, w.need, w.k, right, w.right, v, on_circle}, passed, opened);
            enter({w.size, w.need, w.k, left, v, w.left, on_circle}, passed, opened);
        } else {
            Index edge = left_of_right ? right : left;
            enter({w.size, w.need, w.k, edge, w.right, w.left, on_circle}, passed, opened);
        }
    }

    // The need of a pair whose segment runs inside the object, and kNever if it does not, or if a
    // site lies on it.
    double need(Index k, Index p) const {
        Point from = t_.site(k), to = t_.site(p);
        double least = 0;
        bool on_circle = true;
        Index first = kNone;
        bool is_clear = walk(k, p, [&](Index v, int side) {
            Point q = t_.site(v);
            if (first == kNone) first = v;  // the one on the right
            on_circle = on_circle && (v == first || are_cocircular(k, first, p, v));
            if (at_least(from, q, to) < least) {
                double cot = side > 0 ? cotangent(from, to, q) : cotangent(to, from, q);
                least = std::min(least, cot);
            }
            return true;
        });
        if (!is_clear) return kNever;
        return on_circle ? 0 : least;
    }

    // The size of a pair with a need. The steps are those of the reference.
    double size(Index k, Index p, double need) const {
        Point d = way(k, p);
        return (d.x * d.x + d.y * d.y) * (1 + need * need);
    }

    // No more than the square of the distance of the segment mn from 0.
    static double distance(Point m, Point n) {
        Product mm = dot(m, m), nn = dot(n, n), mn = dot(m, n);
        if (mn.value - mn.error >= mm.value + mm.error) return mm.value - mm.error;
        if (mn.value - mn.error >= nn.value + nn.error) return nn.value - nn.error;
        Product area = cross(m, n), along = dot({n.x - m.x, n.y - m.y}, {n.x - m.x, n.y - m.y});
        double least = std::max(area.value - area.error, 0.0);
        double most = along.value + kSlack * (mm.value + nn.value);
        return (1 - kSlack) * (least * (least / most));
    }

    // Whether the triangle over ij, with all three sides inside the object, turns left and holds no
    // other site. One that does hold sites has one that is a neighbour of a corner, or an end of a
    // Delaunay edge across a side.
    bool is_empty(Index i, Index j, Index k) const {
        const Mesh& m = t_.mesh();
        if (turn(i, j, k) <= 0) return false;
        bool empty = true;
        auto look_at = [&](Index v, int) {
            if (v == i || v == j || v == k || v == kGhost) return true;
            empty = empty && (turn(i, j, v) < 0 || turn(j, k, v) < 0 || turn(k, i, v) < 0);
            return empty;
        };
        for (auto [a, b] : {std::pair{i, j}, std::pair{j, k}, std::pair{k, i}}) {
            Index first = m.leaving(a), h = first;
            do {
                look_at(m.target(h), 0);
                h = m.turn(h);
            } while (h != first);
            walk(a, b, look_at);
        }
        return empty;
    }

    // Calls f for the triangles that the segment ab, which runs inside the object, passes through
    // or along.
    template <class F>
    void pass_along(Index a, Index b, F f) const {
        Index edge = t_.edge_between(a, b);
        if (edge != kNone) {
            f(Mesh::triangle(edge));
            f(Mesh::triangle(t_.mesh().twin(edge)));
            return;
        }
        walk(a, b, [](Index, int) { return true; }, f);
    }

    // Whether the open segments ab and cd cross in one point.
    bool cross(Index a, Index b, Index c, Index d) const {
        if (a == c || a == d || b == c || b == d) return false;
        return turn(a, b, c) * turn(a, b, d) < 0 && turn(c, d, a) * turn(c, d, b) < 0;
    }

   private:
    int turn(Index a, Index b, Index c) const { return orient(t_.site(a), t_.site(b), t_.site(c)); }

    // k, a, b turn left.
    bool are_cocircular(Index k, Index a, Index b, Index v) const {
        return in_circle(t_.site(k), t_.site(a), t_.site(b), t_.site(v)) == 0;
    }

    // Calls f(v, side) for the ends of the Delaunay edges that cross the open segment kp, from k
    // on, -1 to the right and 1 to the left, the right one of the first edge first; and `passed`
    // for the triangles between. Stops and returns false where f does, or where the segment leaves
    // the object or meets a site.
    template <class F>
    bool walk(Index k, Index p, F f) const {
        return walk(k, p, f, [](Index) {});
    }
    template <class F, class Passed>
    bool walk(Index k, Index p, F f, Passed passed) const {
        const Mesh& m = t_.mesh();
        Index spoke = m.leaving(k);
        for (;; spoke = m.turn(spoke)) {
            Index r = m.target(spoke), l = m.apex(spoke);
            if (r == p) return is_in_object(spoke) || is_in_object(m.twin(spoke));
            if (r == kGhost) continue;
            int side = turn(k, r, p);
            if (side == 0 && dot_sign(t_.site(r), t_.site(p), t_.site(k)) > 0) return false;
            if (side > 0 && l != kGhost && l != p && turn(k, l, p) < 0) break;
        }
        if (!is_in_object(spoke)) return false;
        Index edge = Mesh::next(spoke);
        passed(Mesh::triangle(edge));
        if (!f(m.origin(edge), -1) || !f(m.target(edge), 1)) return false;
        for (;;) {
            Index o = m.twin(edge), v = m.apex(o);
            if (!is_in_object(o)) return false;
            passed(Mesh::triangle(o));
            if (v == p) return true;
            int side = turn(k, p, v);
            if (side == 0 || !f(v, side)) return false;
            edge = side > 0 ? Mesh::next(o) : Mesh::prev(o);
        }
    }

    bool is_in_object(Index h) const { return c_.is_inside(Mesh::triangle(h)); }

    // Opens the window if there is something of the object behind it, with a bound that is no more
    // than it had; or shows the edge of the ring if that is seen whole.
    template <class Passed, class Opened>
    void enter(Window w, Passed passed, Opened opened) const {
        const Mesh& m = t_.mesh();
        Index a = m.origin(w.edge), b = m.target(w.edge), o = m.twin(w.edge);
        if (!is_in_object(o)) {
            w.edge = kNone;
            w.size = std::max({w.size, size(w.k, a, 0), size(w.k, b, 0)});
            if (w.right == a && w.left == b) opened(w);
            return;
        }
        Bound behind = bound_behind(w, a, b);
        double need = std::min(w.need, behind.need);
        if (need < 0 && w.on_circle) {
            passed(Mesh::triangle(o));
            if (are_cocircular(w.k, a, b, m.apex(o))) need = 0;
        }
        w.need = need;
        w.size = std::max(w.size, behind.distance * (1 + need * need) * (1 - kSlack));
        opened(w);
    }

    struct Bound {
        double distance, need;  // of what is behind a window: the square of the former
    };

    //       a --m----n-- b          m and n: where the directions of right and left meet the edge
    //         right left            ab, or a little before that
    //             k
    Bound bound_behind(const Window& w, Index a, Index b) const {
        Point right = way(w.k, w.right), left = way(w.k, w.left);
        Point to_a = way(w.k, a), to_b = way(w.k, b), m = right, n = left;
        if (a != w.right) m = as_far_as(right, to_a, to_b);
        if (b != w.left) n = as_far_as(left, to_a, to_b);
        double need = std::min(at_most(right, n), at_most(left, m));
        if (a != w.right) need = std::min(need, at_most(to_a, n));
        if (b != w.left) need = std::min(need, at_most(to_b, m));
        return {distance(m, n), need};
    }

    // ---------------------------------------------------------------- bounds, seen from k
    // What k sees, as a vector from there.
    Point way(Index k, Index v) const {
        Point from = t_.site(k), to = t_.site(v);
        return {to.x - from.x, to.y - from.y};
    }

    // A product of vectors, and more than its rounding error.
    struct Product {
        double value, error;
    };
    static Product dot(Point a, Point b) {
        double x = a.x * b.x, y = a.y * b.y;
        return {x + y, kSlack * (std::fabs(x) + std::fabs(y))};
    }
    static Product cross(Point a, Point b) {
        double xy = a.x * b.y, yx = a.y * b.x;
        return {std::fabs(xy - yx), kSlack * (std::fabs(xy) + std::fabs(yx))};
    }

    // The way in the direction of v, as far as the line ab certainly is, which is not before v.
    static Point as_far_as(Point v, Point a, Point b) {
        Point along{b.x - a.x, b.y - a.y};
        Product of_a = cross(a, along), of_v = cross(v, along);
        double times = (of_a.value - of_a.error) / (of_v.value + of_v.error);
        return times > 1 ? Point{times * v.x, times * v.y} : v;
    }

    // A value that the cotangent of the angle at q from k to p, or 0 if that is less, does not
    // exceed.
    static double at_most(Point q, Point p) {
        Product qq = dot(q, q), qp = dot(q, p), area = cross(q, p);
        double most = qq.value - qp.value + qq.error + qp.error;
        return most < 0 ? (1 - kSlack) * (most / (area.value + area.error)) : 0;
    }

    // A value that the cotangent of the angle k q p, or 0 if that is less, is not below.
    static double at_least(Point k, Point q, Point p) {
        Point to_k{k.x - q.x, k.y - q.y}, to_p{p.x - q.x, p.y - q.y};
        Product along = dot(to_k, to_p), area = cross(to_k, to_p);
        double least = along.value - along.error, across = area.value - area.error;
        if (least >= 0) return 0;
        return across > 0 ? (1 + kSlack) * (least / across)
                          : -std::numeric_limits<double>::infinity();
    }

    const Triangulation& t_;
    const Constriction& c_;
};

}  // namespace flintknap
