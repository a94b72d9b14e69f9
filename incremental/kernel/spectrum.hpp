// Any graph of the gamma-family: the pairs whose gamma0 and gamma1 lie in two intervals.
//
// Theory. Three kinds of pairs are looked for, each only if the intervals can hold some of it:
//
//   edges    of the triangulation: gamma1 >= 0, and the values are read off. gamma0 is the smaller
//            of the two sides, gamma1 the larger one.
//   chords   of cells: triangles on one circle make up a polygon, of which the triangulation has
//            some diagonals, but every pair of its corners has gamma1 = -gamma0 >= 0.
//   the far  with gamma1 < 0, if gamma1 may be down to d < 0. From each site v triangles are
//            searched outward. A site p hides from v the cone with apex p, axis p - v and
//            half-angle arcsin(1 - |d|): whatever lies in it makes with v a pair that p sees under
//            too large an angle. The cone is convex and holds with x all that lies behind x as seen
//            from v. So an edge that lies in the cone of one site is not crossed:
//
//                      . '  K_p           v looks across xy only if no p has both x and y in
//                  x '                    its cone, or itself at one of them; p is looked for
//               . '|                      among the corners of the triangles on the way to xy
//         v   p    |    not entered
//               ' .|
//                  y ' .
//                        ' .
//
//            Completeness: if no site hides q from v, no point of the segment vq is in a cone, so
//            each edge it crosses is crossed by the search. What is found is judged exactly.
//
// Cost: O(n) for edges and chords, plus what is found. The far: as much of the surroundings as is
// not hidden, which falls with d from 0: for fixed d on uniform sets O(1) expected a site, and the
// triangles crossed for each pair judged. For d -> -1 nothing hides anything: O(n^2) and more.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include "gamma.hpp"
#include "rows.hpp"

namespace flintknap {

class Spectrum {
   public:
    Spectrum(const Triangulation& t, Interval gamma0, Interval gamma1)
        : t_(t), gamma0_(gamma0), gamma1_(gamma1) {}

    // Each pair once, in no order. `poll` is called now and then and may throw to interrupt.
    template <class Poll>
    Large<Couple> pairs(Poll poll) {
        if (t_.is_flat()) {
            collect_neighbours();
        } else {
            if (gamma1_.high >= 0) collect_edges(poll);
            collect_chords(poll);
            if (gamma1_.low < 0) collect_far(poll);
        }
        return std::move(found_);
    }

   private:
    struct Step {
        Index edge;    // of the triangle to be entered
        Index parent;  // the step that led to it; kNone from the triangles about v
    };

    bool admits(Facing f) const { return gamma0_.holds(f.first) && gamma1_.holds(f.second); }

    void find(Index a, Index b) { found_.push_back({a, b}); }

    // ---------------------------------------------------------------- on a line
    // Those that follow each other see nobody on either side.
    void collect_neighbours() {
        if (!admits({kInfinite, kInfinite})) return;
        std::vector<Index> line = t_.along_line();
        for (std::size_t n = 1; n < line.size(); ++n) find(line[n - 1], line[n]);
    }

    // ---------------------------------------------------------------- edges
    // Each is judged when the second of its triangles comes, by both sides rounded to floats if
    // these are clear of every bound. Those of a few triangles at a time: first what the triangles
    // see, then which edges, then what they are, so that no branch depends on either, and what
    // lies elsewhere is there when it is needed.
    template <class Poll>
    void collect_edges(Poll& poll) {
        constexpr Index few = 128;
        const Mesh& m = t_.mesh();
        const Judge judge(gamma0_, gamma1_, may_hold_chords());
        const Index triangles = m.triangles();
        Large<float> sides(at(3 * triangles));  // what triangles see, by half-edge
        Index halves[3 * few];
        Couple ends[3 * few];
        float here[3 * few] = {}, beyond[3 * few] = {};
        std::uint32_t is_in[3 * few];
        found_.reserve(at(3 * t_.size()));
        for (Index first = 0; first < triangles; first += few) {
            if (first % (512 * few) == 0) poll();
            Index stop = std::min(first + few, triangles);
            for (Index x = stop; x < std::min(stop + few, triangles); ++x) {
                for (Index h = Mesh::first(x); h < Mesh::first(x) + 3; ++h) {
                    __builtin_prefetch(t_.sites().data() + m.origin(h));
                }
            }
            std::size_t count = 0;
            auto list = [&](Index h, Index a, Index b) {
                Index o = m.twin(h);
                __builtin_prefetch(sides.data() + Mesh::compact(o));
                halves[count] = h;
                ends[count] = {a, b};
                count += o < h;
            };
            for (Index x = first; x < stop; ++x) {
                if (m.is_free(x)) continue;
                if (m.is_ghost(x)) {
                    Index h = m.hull_edge(x);
                    sides[Mesh::compact(h)] = kInfiniteFloat;
                    list(h, m.origin(h), m.target(h));
                } else {
                    Index h = Mesh::first(x), a = m.origin(h), b = m.origin(h + 1),
                          c = m.origin(h + 2);
                    estimate(t_.site(a), t_.site(b), t_.site(c), &sides[Mesh::compact(h)]);
                    list(h, a, b);
                    list(h + 1, b, c);
                    list(h + 2, c, a);
                }
            }
            for (std::size_t n = 0; n < count; ++n) {
                here[n] = sides[Mesh::compact(halves[n])];
                beyond[n] = sides[Mesh::compact(m.twin(halves[n]))];
            }
            for (std::size_t n = 0; n < count; n += 4) judge(here + n, beyond + n, is_in + n);
            std::size_t size = found_.size();
            found_.resize(size + count);
            for (std::size_t n = 0; n < count; ++n) {
                if (is_in[n] == kUnsure) is_in[n] = judge_exactly(halves[n]);
                found_[size] = ends[n];
                size += is_in[n];
            }
            found_.resize(size);
        }
    }

    // The cotangents of the angles opposite ab, bc and ca, off by 2^-23 of themselves and 2^-30 at
    // most. With P the product of the sides at a corner, dot and cross there are off by 2^-51 P;
    // and P is 2^20 crosses at most, or else these are no numbers.
    static void estimate(Point a, Point b, Point c, float* sides) {
        double abx = b.x - a.x, aby = b.y - a.y, bcx = c.x - b.x, bcy = c.y - b.y;
        double cax = a.x - c.x, cay = a.y - c.y;
        double cross = cax * aby - cay * abx, limit = 0x1p20 * cross, scale = -1 / cross;
        double at_a = cax * abx + cay * aby, at_b = abx * bcx + aby * bcy,
               at_c = bcx * cax + bcy * cay;
        bool fine =
            (std::fabs(at_a) < limit) & (std::fabs(at_b) < limit) & (std::fabs(at_c) < limit);
        if (!fine) scale = std::numeric_limits<double>::quiet_NaN();
        sides[0] = static_cast<float>(at_c * scale);
        sides[1] = static_cast<float>(at_a * scale);
        sides[2] = static_cast<float>(at_b * scale);
    }

    static constexpr float kInfiniteFloat = std::numeric_limits<float>::infinity();
    static constexpr std::uint32_t kUnsure = 2;  // neither 0, out, nor 1, in

    // Judges by such floats, four edges at a time. gamma0 belongs to the smaller one: if it is
    // below 0, the other is no smaller in magnitude, for the edge is Delaunay.
    class Judge {
       public:
        Judge(Interval gamma0, Interval gamma1, bool seeks_circles)
            : first_(gamma0), second_(gamma1), least_(seeks_circles ? 0 : -kInfiniteFloat) {}

        void operator()(const float* here, const float* beyond, std::uint32_t* is_in) const {
            Four c, d;
            std::memcpy(&c, here, sizeof c);
            std::memcpy(&d, beyond, sizeof d);
            Flags is_less = c < d;
            Four low = chosen(is_less, c, d), high = chosen(is_less, d, c);
            // numbers, and clear of a circle through all four corners if those are sought
            Flags clear = low + high > slack(low) + least_;
            Flags yes = clear & first_.within(low) & second_.within(high);
            Flags no = clear & (first_.beyond(low) | second_.beyond(high));
            Flags verdict = (yes & 1) | (~(yes | no) & static_cast<std::int32_t>(kUnsure));
            std::memcpy(is_in, &verdict, sizeof verdict);
        }

       private:
        using Four = float __attribute__((vector_size(16)));
        using Flags = std::int32_t __attribute__((vector_size(16)));  // all bits or none

        static Four chosen(Flags where, Four yes, Four no) {
            return Four((where & Flags(yes)) | (~where & Flags(no)));
        }
        static float slack(float c) { return 0x1p-20f * std::fabs(c) + 0x1p-24f; }
        static Four slack(Four c) { return 0x1p-20f * Four(Flags(c) & INT32_MAX) + 0x1p-24f; }

        // The interval shrunk and grown by more than the floats may be off.
        struct Bounds {
            Four low_in, low_out, high_in, high_out;
            explicit Bounds(Interval i)
                : low_in(moved(i.low, 1)),
                  low_out(moved(i.low, -1)),
                  high_in(moved(i.high, -1)),
                  high_out(moved(i.high, 1)) {}
            static Four moved(double bound, float direction) {
                float v = static_cast<float>(std::max(-1e30, std::min(1e30, bound)));
                v = std::isinf(bound) ? static_cast<float>(bound) : v + direction * slack(v);
                return Four{v, v, v, v};
            }
            Flags within(Four cot) const { return (cot >= low_in) & (cot <= high_in); }
            Flags beyond(Four cot) const { return (cot < low_out) | (cot > high_out); }
        };
        Bounds first_, second_;
        float least_;
    };

    // Whether an edge is in; notes one between triangles of one circle.
    bool judge_exactly(Index h) {
        if (may_hold_chords() && on_circle(h)) seeds_.push_back(h);
        return admits(facing_edge(t_, h));
    }

    // ---------------------------------------------------------------- chords
    // Whether there is a v >= 0, but finite, with -v in gamma0's interval and v in gamma1's.
    bool may_hold_chords() const {
        double low = std::max({0.0, gamma1_.low, -gamma0_.high});
        double high = std::min(gamma1_.high, -gamma0_.low);
        return low <= high && low < kInfinite;
    }

    // Whether the triangles on both sides of an edge have one circle.
    bool on_circle(Index h) const {
        const Mesh& m = t_.mesh();
        Index c = m.apex(h), d = m.apex(m.twin(h));
        if (c == kGhost || d == kGhost) return false;
        return in_circle(t_.site(m.origin(h)), t_.site(m.target(h)), t_.site(c), t_.site(d)) == 0;
    }

    template <class Poll>
    void collect_chords(Poll& poll) {
        if (seeds_.empty()) return;
        const Mesh& m = t_.mesh();
        std::vector<bool> visited(at(m.triangles()));
        std::vector<Index> rim;
        std::size_t judged = 0;
        for (Index seed : seeds_) {
            if (visited[at(Mesh::triangle(seed))]) continue;
            find_cell(Mesh::triangle(seed), visited, rim);
            for (std::size_t i = 0; i < rim.size(); ++i) {
                for (std::size_t j = i + 2; j < rim.size(); ++j) {
                    if (++judged % (1 << 16) == 0) poll();
                    Index a = rim[i], b = rim[j];
                    double cot = cotangent(t_.site(b), t_.site(a), t_.site(rim[i + 1]));
                    if (!admits({-std::fabs(cot), std::fabs(cot)})) continue;
                    if (t_.edge_between(a, b) == kNone) find(a, b);
                }
            }
        }
    }

    // The corners of all triangles on the circle of triangle x, counter-clockwise. They are a tree
    // in the dual, since no site lies inside the circle.
    void find_cell(Index x, std::vector<bool>& visited, std::vector<Index>& rim) {
        const Mesh& m = t_.mesh();
        rim.clear();
        pending_.assign({Mesh::first(x) + 2, Mesh::first(x) + 1, Mesh::first(x)});
        visited[at(x)] = true;
        while (!pending_.empty()) {
            Index h = pending_.back(), o = m.twin(h);
            pending_.pop_back();
            if (!on_circle(h)) {
                rim.push_back(m.origin(h));
                continue;
            }
            visited[at(Mesh::triangle(o))] = true;
            pending_.push_back(Mesh::prev(o));
            pending_.push_back(Mesh::next(o));
        }
    }

    // ---------------------------------------------------------------- the far
    template <class Poll>
    void collect_far(Poll& poll) {
        entered_.assign(at(t_.mesh().triangles()), kNone);
        seen_.assign(at(t_.slots()), kNone);
        for (Index v = 0; v < t_.slots(); ++v) {
            if (v % 64 == 0) poll();
            if (t_.is_site(v)) search_from(v);
        }
    }

    void search_from(Index v) {
        const Mesh& m = t_.mesh();
        Point from = t_.site(v);
        steps_.clear();
        seen_[at(v)] = v;
        Index first = m.leaving(v), h = first;
        do {
            if (m.target(h) != kGhost) seen_[at(m.target(h))] = v;
            if (!m.is_ghost(Mesh::triangle(h))) steps_.push_back({m.twin(Mesh::next(h)), kNone});
            h = m.turn(h);
        } while (h != first);
        for (std::size_t n = 0; n < steps_.size(); ++n) {
            Index edge = steps_[n].edge, x = Mesh::triangle(edge);
            if (m.is_ghost(x) || entered_[at(x)] == v) continue;
            if (is_hidden(from, m.origin(edge), m.target(edge), steps_[n])) continue;
            entered_[at(x)] = v;
            Index z = m.apex(edge);
            if (seen_[at(z)] != v) {
                seen_[at(z)] = v;
                if (v < z && !is_hidden(from, z, z, steps_[n])) judge_far(v, z);
            }
            for (Index side : {Mesh::next(edge), Mesh::prev(edge)}) {
                if (orient(t_.site(m.origin(side)), t_.site(m.target(side)), from) > 0) {
                    steps_.push_back({m.twin(side), static_cast<Index>(n)});
                }
            }
        }
    }

    void judge_far(Index v, Index q) {
        Facing f = facing_pair(t_, v, q);
        if (f.is_pair() && f.second < 0 && admits(f)) find(v, q);
    }

    // Whether both x and y lie in the cone of a site on the way that ends with a step.
    bool is_hidden(Point v, Index x, Index y, Step step) const {
        if (gamma1_.low == -kInfinite) return false;
        const Mesh& m = t_.mesh();
        auto hides = [&](Index p) {
            return (p == x || is_in_cone(v, p, x)) && (p == y || is_in_cone(v, p, y));
        };
        // each step but the first has one end in common with the one before; the other is its apex
        for (; step.parent != kNone; step = steps_[at(step.parent)]) {
            if (hides(m.apex(steps_[at(step.parent)].edge))) return true;
        }
        return hides(m.origin(step.edge)) || hides(m.target(step.edge));
    }

    // Whether x certainly lies in the cone of p; false if that takes more than a glance.
    bool is_in_cone(Point v, Index apex, Index behind) const {
        Point p = t_.site(apex), x = t_.site(behind);
        double ux = v.x - p.x, uy = v.y - p.y, wx = x.x - p.x, wy = x.y - p.y;
        double xx = ux * wx, yy = uy * wy, xy = ux * wy, yx = uy * wx;
        double limit = -gamma1_.low;
        double bound =
            16 * kUlp * (std::fabs(xx) + std::fabs(yy) + limit * (std::fabs(xy) + std::fabs(yx)));
        return xx + yy + limit * std::fabs(xy - yx) < -bound;
    }

    const Triangulation& t_;
    Interval gamma0_, gamma1_;
    Large<Couple> found_;
    std::vector<Index> seeds_;  // half-edges between triangles of one circle
    std::vector<Index> pending_;
    // The search from a site: the ways so far, and by triangle and by site the last search that
    // came there.
    std::vector<Step> steps_;
    std::vector<Index> entered_, seen_;
};

}  // namespace flintknap
