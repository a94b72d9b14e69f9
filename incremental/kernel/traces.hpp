// The edges that come near a strip of a raster, at coarse coordinates, in one line of memory.
//
// Theory. A strip is eight rows of a raster. Each edge that meets it, widened by a margin, is cut
// off at its rim, and both ends are put on a lattice of 256 by 256 over the strip:
//
//          o-------------o            runs of vertices, in the order of the ring;
//       ___|_____________|__ 255      a vertex on the lattice lies half a step from its place at
//      |   o        o    |  |         most, along each axis; ends at a rim stay on that rim
//      o---o       / \   o--o
//      |__________o___o_____| 0
//
// So every point of an edge in the strip lies within a square about a point of its *trace*, and an
// edge is known to pass a place if its trace passes a slightly larger square about it. Let traces
// become edges, each point moving straight: then those that pass the place do so all the time, and
//
//      [inside] = constant + [traces that cross the ray from the place to the left]
//                          + [ends at the left rim above the place]          (modulo 2)
//
// holds until one does not: the sum jumps where a trace is crossed, and nowhere else. If edges do
// not surely pass the place, but each has both its ends surely above or below it, then an exact
// orientation tells on which side of the place the edge crosses its height, and so, in the sum,
// what its trace does there in the end. Else nothing is told.
//
// A segment meets an edge in the strip only if its trace comes so near the segment; and surely does
// if both ends of either surely lie on different sides of the other.
//
// Most traces are beside a place or a segment, which whole numbers tell, sixteen at a time: a step
// is a byte. Only the others are looked at one by one. Edges are told by the leaf, by its number in
// the list of the cell, and by the place there. Invariants (check, of cells.hpp): a trace is a
// function of the edges that come near its strip. Cost: 120 bytes a strip; a place, one line of
// memory, and another for one in some forty.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "queries.hpp"
#include "raster.hpp"

namespace flintknap {

// Tells an edge: the number of its leaf in the list of a cell, and its place there.
class Code {
   public:
    Code() = default;
    Code(std::size_t leaf, int place)
        : code_(static_cast<std::uint16_t>(static_cast<int>(leaf) << 5 | place)) {}

    std::size_t leaf() const { return at(code_ >> 5); }
    Index place() const { return code_ & 31; }
    bool is_behind(Code other) const { return place() > 0 && code_ == other.code_ + 1; }
    bool operator==(Code other) const { return code_ == other.code_; }

   private:
    std::uint16_t code_;
};

class alignas(64) Trace {
   public:
    static constexpr int kRows = 8;
    static constexpr int kRoom = 28;        // vertices
    using Codes = std::array<Code, kRoom>;  // of edges by their starts
    // As far beside the strip as edges are traced.
    static constexpr double kMargin = 2 * Raster::kMargin;

    // What is always read.
    [[gnu::always_inline]] void fetch() const { __builtin_prefetch(xy_); }

    // ---------------------------------------------------------------- to draw it
    // First clear, then all edges that may come near, then settle.
    void clear() { *this = {}; }

    // Coordinates are in parts, as seen from the lower left corner.
    void add(Point a, Point b, Code code, Codes& codes) {
        double from = 0, to = 1, x = b.x - a.x, y = b.y - a.y;
        if (is_full() || !clip(a.x, x, Raster::kSide, from, to) || !clip(a.y, y, kRows, from, to))
            return;
        // Ends that are not cut off are the same for the next edge, to the last bit.
        Point start = from > 0 ? Point{a.x + from * x, a.y + from * y} : a;
        Point stop = to < 1 ? Point{a.x + to * x, a.y + to * y} : b;
        int n = count_;
        bool goes_on = n > 0 && code.is_behind(codes[at(n - 2)]) && is_vertex(n - 1, start);
        if (n + (goes_on ? 1 : 2) > kRoom) {
            bits_ |= kFull;
            return;
        }
        if (!goes_on) set(n++, start);
        codes[at(n - 1)] = code;
        bits_ |= std::uint32_t{1} << (n - 1);
        set(n++, stop);
        count_ = static_cast<std::uint8_t>(n);
    }

    // Takes the constant from a place that no edge is near: the middle of a part that is clear.
    void settle(Point place, bool is_inside) {
        auto none = [](std::size_t) { return 0; };
        if ((side(place, none) > 0) != is_inside) bits_ |= kOdd;
    }
    // Nothing is told.
    void give_up() { bits_ |= kFull; }
    bool is_full() const { return (bits_ & kFull) != 0; }

    // ---------------------------------------------------------------- to ask it
    // +1 inside, 0 on the boundary, -1 outside, or kUntold; turn(i) is on which side of an edge the
    // place lies, by the number of its code.
    static constexpr int kUntold = 2;
    template <class Turn>
    int side(Point place, Turn turn) const {
        if (is_full()) return kUntold;
        // Between the heights of the rims: what is cut off there does not come to an end.
        double x = std::max(0.0, std::min(place.x * kColumn, kFine));
        double y = std::max(0.0, std::min(place.y * kRow, kFine - kReach / 64));
        const Lanes from = cut(Lanes{x, y} + both(1 - kReach));
        const Lanes to = cut(Lanes{x, y} + both(kReach));
        const Reach across(from[0], to[0]), up(from[1], to[1]);
        const Bytes height = sixteen(static_cast<std::uint8_t>(y));
        std::uint32_t near = 0, odd = 0, rim = 0;
        for (int i : {0, kRoom - 17}) {
            Bytes x0 = load_bytes(xy_ + i), y0 = load_bytes(xy_ + kRoom + i);
            Bytes x1 = load_bytes(xy_ + i + 1), y1 = load_bytes(xy_ + kRoom + i + 1);
            ByteMasks left = across.is_below(x0, x1);
            near |= byte_bits(~(left | across.is_above(x0, x1) | up.is_beside(y0, y1))) << i;
            odd |= byte_bits(((y0 > height) ^ (y1 > height)) & left) << i;
            rim |= byte_bits((y0 > height) & (x0 == sixteen(0))) << i |
                   byte_bits((y1 > height) & (x1 == sixteen(0))) << (i + 1);
        }
        const std::uint32_t edges = bits_ & kEdges;
        odd &= edges;
        for (near &= edges; near != 0; near &= near - 1) {
            int i = lowest(near);
            const Piece ab = piece(i, {x, y});
            bool rises = ab.b.y > 0, is_left;
            if (std::fabs(ab.area()) > kReach * ab.width()) {
                is_left = (ab.area() < 0) == rises;
            } else {
                if (std::min(std::fabs(ab.a.y), std::fabs(ab.b.y)) <= kReach) return kUntold;
                int turned = turn(at(i));
                if (turned == 0) return 0;
                is_left = (turned < 0) == rises;
            }
            odd ^= std::uint32_t{is_left && (ab.a.y > 0) != rises} << i;
        }
        odd ^= rim & (edges ^ edges << 1);
        return (__builtin_parity(odd) != 0) != ((bits_ & kOdd) != 0) ? 1 : -1;
    }

    // Whether a segment surely crosses an edge in the strip, or f(i) is true of one that it may
    // meet there. Not to be asked if it is full.
    template <class F>
    bool any_met(Point p, Point q, F f) const {
        p = {p.x * kColumn, p.y * kRow}, q = {q.x * kColumn, q.y * kRow};
        const Lanes low = smaller(Lanes{p.x, p.y}, Lanes{q.x, q.y});
        const Lanes high = larger(Lanes{p.x, p.y}, Lanes{q.x, q.y});
        const Lanes from = cut(low + both(1 - kReach)), to = cut(high + both(kReach));
        const Reach across(from[0], to[0]), up(from[1], to[1]);
        std::uint32_t near = 0;
        for (int i : {0, kRoom - 17}) {
            Bytes x0 = load_bytes(xy_ + i), y0 = load_bytes(xy_ + kRoom + i);
            Bytes x1 = load_bytes(xy_ + i + 1), y1 = load_bytes(xy_ + kRoom + i + 1);
            near |= byte_bits(~(across.is_beside(x0, x1) | up.is_beside(y0, y1))) << i;
        }
        const Point way = q - p;
        const double own_slack = kReach * (std::fabs(way.x) + std::fabs(way.y));
        std::uint32_t open = 0;
        bool is_sure = false;
        for (near &= bits_ & kEdges; near != 0; near &= near - 1) {
            int i = lowest(near);
            const Piece ab = piece(i, p);
            double of_a = way.x * ab.a.y - way.y * ab.a.x, of_p = ab.area();
            double of_b = way.x * ab.b.y - way.y * ab.b.x, of_q = of_p + of_a - of_b;
            const Lanes first = {of_a, of_p}, second = {of_b, of_q};
            const Lanes slack = {own_slack, kReach * ab.width()};
            const Lanes least = smaller(first, second), most = larger(first, second);
            is_sure |= (bits(least < -slack) & bits(most > slack)) == 3;
            open |= std::uint32_t{(bits(least > slack) | bits(most < -slack)) == 0} << i;
        }
        if (is_sure) return true;
        for (; open != 0; open &= open - 1) {
            if (f(at(lowest(open)))) return true;
        }
        return false;
    }

    // The same edges, traced alike, in some order.
    template <class Leaf>
    std::vector<std::array<Index, 6>> listed(const Codes& codes, Leaf leaf) const {
        std::vector<std::array<Index, 6>> all;
        for (std::uint32_t left = is_full() ? 0 : bits_ & kEdges; left != 0; left &= left - 1) {
            int i = lowest(left);
            all.push_back({leaf(codes[at(i)].leaf()), codes[at(i)].place(), xy_[i], xy_[i + 1],
                           xy_[kRoom + i], xy_[kRoom + i + 1]});
        }
        std::sort(all.begin(), all.end());
        return all;
    }
    // Of what is told besides.
    bool is_odd() const { return (bits_ & kOdd) != 0; }

   private:
    static constexpr double kFine = 255;
    static constexpr double kColumn = kFine / Raster::kSide, kRow = kFine / kRows;  // steps a part
    // Half a step, and more than all rounding.
    static constexpr double kReach = 0.75;
    static constexpr std::uint32_t kEdges = (std::uint32_t{1} << (kRoom - 1)) - 1;
    // The constant is 1; nothing is told.
    static constexpr std::uint32_t kOdd = std::uint32_t{1} << 30, kFull = std::uint32_t{1} << 31;

    static Lanes cut(Lanes v) { return larger(both(0), smaller(v, both(kFine))); }

    // Which edges have both ends beyond some coordinates.
    class Reach {
       public:
        Reach(double from, double to)
            : low_(sixteen(static_cast<std::uint8_t>(from))),
              high_(sixteen(static_cast<std::uint8_t>(to))) {}
        ByteMasks is_below(Bytes v, Bytes w) const { return larger(v, w) < low_; }
        ByteMasks is_above(Bytes v, Bytes w) const { return smaller(v, w) > high_; }
        ByteMasks is_beside(Bytes v, Bytes w) const { return is_below(v, w) | is_above(v, w); }

       private:
        Bytes low_, high_;
    };

    // The trace of an edge, as seen from a place.
    struct Piece {
        Point a, b;

        // Twice that of the triangle to the place, positive if this lies on the left of it.
        double area() const { return a.x * b.y - a.y * b.x; }
        double width() const { return std::fabs(b.x - a.x) + std::fabs(b.y - a.y); }
    };
    Piece piece(int i, Point from) const {
        auto vertex = [&](int n) { return Point{xy_[n] - from.x, xy_[kRoom + n] - from.y}; };
        return {vertex(i), vertex(i + 1)};
    }

    // Leaves of the part of a + t * way, 0 <= t <= 1, what lies within 0 .. high or a margin beside
    // it; false if nothing does.
    static bool clip(double a, double way, double high, double& from, double& to) {
        if (way == 0) return -kMargin <= a && a <= high + kMargin;
        double first = (-kMargin - a) / way, last = (high + kMargin - a) / way;
        from = std::max(from, std::min(first, last));
        to = std::min(to, std::max(first, last));
        return from <= to;
    }

    static std::uint8_t step(double v) {
        return static_cast<std::uint8_t>(std::max(0.0, std::min(v, kFine)) + 0.5);
    }
    bool is_vertex(int i, Point p) const {
        return xy_[i] == step(p.x * kColumn) && xy_[kRoom + i] == step(p.y * kRow);
    }
    void set(int i, Point p) {
        xy_[i] = step(p.x * kColumn);
        xy_[kRoom + i] = step(p.y * kRow);
    }

    std::uint8_t xy_[2 * kRoom];
    std::uint32_t bits_;  // edges by their starts, and kOdd, and kFull
    std::uint8_t count_;  // of vertices
};

// A raster with the traces of its strips: what is always read, and which edges they are apart from
// it, for that is seldom asked.
struct alignas(64) Strips {
    static constexpr int kCount = Raster::kSide / Trace::kRows;
    using Codes = std::array<Trace::Codes, kCount>;

    Raster raster;
    Trace traces[kCount];

    // First clear, then all edges that may come near, then settle, as a raster.
    void clear() {
        raster.clear();
        for (Trace& trace : traces) trace.clear();
    }
    void add(Point a, Point b, Code code, Codes& codes) {
        raster.add(a, b);
        int last = Raster::part(std::max(a.y, b.y) + Trace::kMargin) / Trace::kRows;
        for (int n = Raster::part(std::min(a.y, b.y) - Trace::kMargin) / Trace::kRows; n <= last;
             ++n) {
            double low = n * Trace::kRows;
            traces[n].add({a.x, a.y - low}, {b.x, b.y - low}, code, codes[at(n)]);
        }
    }
    template <class Side>
    void settle(Side side) {
        raster.settle(side);
        int row = 0;
        for (Trace& trace : traces) {
            auto part = raster.clear_part(row, row + Trace::kRows);
            if (part) {
                auto [x, y] = *part;
                trace.settle({x + 0.5, y - row + 0.5}, raster.side(x, y) > 0);
            } else {
                trace.give_up();
            }
            row += Trace::kRows;
        }
    }

    // Whether a segment, as seen from the lower left corner, surely crosses an edge in the square,
    // or f(n, i) is true of one that it may meet there, of those of trace n the one with code i;
    // nothing if a trace that is full might know.
    template <class F>
    std::optional<bool> any_met(Point p, Point q, F f) const {
        const Lanes low = Raster::cut(smaller(Lanes{p.x, p.y}, Lanes{q.x, q.y}));
        const Lanes high = Raster::cut(larger(Lanes{p.x, p.y}, Lanes{q.x, q.y}));
        const int bottom = static_cast<int>(low[1]), top = static_cast<int>(high[1]);
        const auto columns = Raster::parts(static_cast<int>(low[0]), static_cast<int>(high[0]));
        const auto rows = Raster::parts(bottom, top);
        const int first = bottom / Trace::kRows, last = top / Trace::kRows;
        traces[first].fetch();
        traces[last].fetch();
        for (int n = first; n <= last; ++n) {
            const int first_row = n * Trace::kRows;
            if (raster.is_clear<Trace::kRows>(columns, rows, first_row)) continue;
            const Trace& trace = traces[n];
            if (trace.is_full()) {
                std::uint32_t near = raster.touched({p, q, Raster::kMargin / 2}) >> first_row;
                if ((near & ((1U << Trace::kRows) - 1)) != 0) return {};
                continue;
            }
            Point above = {0, double(first_row)};
            if (trace.any_met(p - above, q - above, [&](std::size_t i) { return f(at(n), i); }))
                return true;
        }
        return false;
    }

    // Whether two are of the same edges; leaves are told by their numbers in the lists.
    template <class LeafOfA, class LeafOfB>
    static bool are_alike(const Strips& a, const Codes& codes_of_a, LeafOfA of_a, const Strips& b,
                          const Codes& codes_of_b, LeafOfB of_b) {
        for (std::size_t i = 0; i < at(kCount); ++i) {
            const Trace &m = a.traces[i], &n = b.traces[i];
            if (m.is_full() != n.is_full()) return false;
            if (m.listed(codes_of_a[i], of_a) != n.listed(codes_of_b[i], of_b)) return false;
            if (!m.is_full() && m.is_odd() != n.is_odd()) return false;
        }
        return a.raster == b.raster;
    }
};

}  // namespace flintknap
