// Any graph of the gamma-family: the pairs whose gamma0 and gamma1 lie in two intervals.
//
// Theory. Three kinds of pairs are looked for, each only if the intervals can hold some of it:
//
//   edges    of the triangulation: gamma1 >= 0, and the values are read off.
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
#include <limits>
#include <utility>
#include <vector>

#include "gamma.hpp"
#include "large.hpp"

namespace flintknap {

// Two slots, or other numbers of sites. Not initialised, like all of a Large array of them.
struct Slots {
    Index first, second;
};

class Spectrum {
   public:
    Spectrum(const Triangulation& t, Interval gamma0, Interval gamma1)
        : t_(t), gamma0_(gamma0), gamma1_(gamma1) {}

    // Each pair once, in no order. `poll` is called now and then and may throw to interrupt.
    template <class Poll>
    Large<Slots> pairs(Poll poll) {
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
    // Those of a few triangles at a time: first which, each from the second of its triangles, then
    // what they are, so that no branch depends on either. What is rounded to floats decides if it
    // is clear of every bound.
    template <class Poll>
    void collect_edges(Poll& poll) {
        constexpr Index few = 128;
        const Mesh& m = t_.mesh();
        const bool chords = may_hold_chords();
        const Judge judge(gamma0_, gamma1_);
        std::array<Index, 3 * few> edges;
        found_.reserve(at(3 * t_.size()));
        for (Index first = 0; first < m.triangles(); first += few) {
            if (first % (512 * few) == 0) poll();
            std::size_t count = 0;
            for (Index x = first; x < std::min(first + few, m.triangles()); ++x) {
                if (m.is_free(x)) continue;
                for (Index h = 3 * x; h < 3 * x + 3; ++h) {
                    edges[count] = h;
                    count += m.twin(h) < h;
                }
            }
            std::size_t size = found_.size();
            found_.resize(size + count);
            for (std::size_t n = 0; n < count; ++n) {
                Index h = edges[n], o = m.twin(h), a = m.origin(h), b = m.origin(o);
                if (a == kGhost || b == kGhost) continue;
                float c = estimate(a, b, m.apex(h)), d = estimate(b, a, m.apex(o));
                Verdict verdict = judge(c, d);
                if (verdict == Verdict::unsure) {
                    verdict = admits(facing_edge(t_, h)) ? Verdict::yes : Verdict::no;
                }
                found_[size] = {a, b};
                size += verdict == Verdict::yes;
                if (chords && !Judge::is_above(c, -d) && on_circle(h)) seeds_.push_back(h);
            }
            found_.resize(size);
        }
    }

    // The cotangent of the angle under which c sees ab, off by 2^-24 of itself and 2^-28 at most;
    // not a number if the angle is too flat for that, below 1/1000. Else dot and cross are off by
    // 2^-51 of the sides' product, which is 2^10 crosses at most.
    float estimate(Index a, Index b, Index c) const {
        if (c == kGhost) return std::numeric_limits<float>::infinity();
        Point from = t_.site(a), to = t_.site(b), apex = t_.site(c);
        double ux = from.x - apex.x, uy = from.y - apex.y, vx = to.x - apex.x, vy = to.y - apex.y;
        double dot = ux * vx + uy * vy, cross = ux * vy - uy * vx;
        return std::fabs(dot) < 1000 * cross ? static_cast<float>(dot / cross)
                                             : std::numeric_limits<float>::quiet_NaN();
    }

    enum class Verdict : unsigned char { no, yes, unsure };

    // Judges by such floats.
    class Judge {
       public:
        Judge(Interval gamma0, Interval gamma1)
            : either_order_(gamma0 == gamma1), first_(gamma0), second_(gamma1) {}

        Verdict operator()(float c, float d) const {
            if (!either_order_) {
                float p = std::fabs(c), q = std::fabs(d);
                bool is_ordered = is_above(q, p);
                if (!is_ordered && !is_above(p, q)) {
                    return first_.beyond(c) & first_.beyond(d) ? Verdict::no : Verdict::unsure;
                }
                if (!is_ordered) std::swap(c, d);
            }
            bool yes = first_.within(c) & second_.within(d);
            bool no = first_.beyond(c) | second_.beyond(d);
            return static_cast<Verdict>(yes | !(yes | no) << 1);  // no branch
        }

        static bool is_above(float c, float d) { return c > d + slack(d); }

       private:
        static float slack(float c) { return 0x1p-20f * std::fabs(c) + 0x1p-24f; }

        // The interval shrunk and grown by more than the floats may be off.
        struct Bounds {
            float low_in, low_out, high_in, high_out;
            explicit Bounds(Interval i)
                : low_in(moved(i.low, 1)),
                  low_out(moved(i.low, -1)),
                  high_in(moved(i.high, -1)),
                  high_out(moved(i.high, 1)) {}
            static float moved(double bound, float direction) {
                float nearest = static_cast<float>(std::max(-1e30, std::min(1e30, bound)));
                return std::isinf(bound) ? static_cast<float>(bound)
                                         : nearest + direction * slack(nearest);
            }
            bool within(float cot) const { return (cot >= low_in) & (cot <= high_in); }
            bool beyond(float cot) const { return (cot < low_out) | (cot > high_out); }
        };
        bool either_order_;
        Bounds first_, second_;
    };

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
        pending_.assign({3 * x + 2, 3 * x + 1, 3 * x});
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
    Large<Slots> found_;
    std::vector<Index> seeds_;  // half-edges between triangles of one circle
    std::vector<Index> pending_;
    // The search from a site: the ways so far, and by triangle and by site the last search that
    // came there.
    std::vector<Step> steps_;
    std::vector<Index> entered_, seen_;
};

// Ascending; there are a few as a rule.
inline void sort_few(Index* begin, Index* end) {
    if (end - begin > 24) return std::sort(begin, end);
    for (Index* i = begin; i < end; ++i) {
        Index value = *i, *gap = i;
        for (; gap > begin && gap[-1] > value; --gap) *gap = gap[-1];
        *gap = value;
    }
}

// The pairs as rows of two ids, the smaller one first, in ascending order; `rank` tells the place
// of a slot's id among all `ids`, which ascend. First into blocks by the smaller one, so that all
// that follows stays in the cache; each block by counting; then the few of each id. O(n + m).
inline Large<std::int64_t> canonical(Large<Slots> pairs, const std::vector<Index>& rank,
                                     const std::vector<std::int64_t>& ids) {
    constexpr int bits = 10;
    constexpr std::size_t block = 1 << bits;
    std::vector<std::size_t> end((ids.size() >> bits) + 2, 0);
    for (Slots& p : pairs) {
        auto [low, high] = std::minmax(rank[at(p.first)], rank[at(p.second)]);
        p = {low, high};
        ++end[at(p.first >> bits) + 1];
    }
    for (std::size_t n = 1; n < end.size(); ++n) end[n] += end[n - 1];
    Large<Slots> blocked(pairs.size());
    for (const Slots& p : pairs) blocked[end[at(p.first >> bits)]++] = p;
    Large<Slots>().swap(pairs);

    Large<std::int64_t> rows(2 * blocked.size());
    std::int64_t* row = rows.data();
    std::vector<Index> partner;
    std::size_t begin = 0;
    for (std::size_t first = 0; first < ids.size(); first += block) {
        std::size_t stop = end[first >> bits];
        std::array<std::size_t, block + 1> last{};
        for (std::size_t k = begin; k < stop; ++k) ++last[at(blocked[k].first) - first + 1];
        for (std::size_t a = 1; a <= block; ++a) last[a] += last[a - 1];
        partner.resize(stop - begin);
        for (std::size_t k = begin; k < stop; ++k) {
            partner[last[at(blocked[k].first) - first]++] = blocked[k].second;
        }
        for (std::size_t a = 0, k = 0; k < partner.size(); ++a) {
            sort_few(partner.data() + k, partner.data() + last[a]);
            for (; k < last[a]; ++k) {
                *row++ = ids[first + a];
                *row++ = ids[at(partner[k])];
            }
        }
        begin = stop;
    }
    return rows;
}

}  // namespace flintknap
