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
// A segment meets an edge in the strip only if its trace comes so near the segment.
//
// Edges are told by the leaf, by its number in the list of the cell, and by the place there.
// Invariants (check, of cells.hpp): a trace is a function of the edges that come near its strip.
// Cost: 128 bytes a strip; a place, one line of memory, and another for one in some forty.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
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

    // What is always read, and what only if edges are near.
    void fetch() const { __builtin_prefetch(xy_); }
    void fetch_codes() const { __builtin_prefetch(codes_); }

    // ---------------------------------------------------------------- to draw it
    // First clear, then all edges that may come near, then settle.
    void clear() { *this = {}; }

    // Coordinates are in parts, as seen from the lower left corner.
    void add(Point a, Point b, Code code) {
        double from = 0, to = 1, x = b.x - a.x, y = b.y - a.y;
        if (is_full() || !clip(a.x, x, Raster::kSide, from, to) || !clip(a.y, y, kRows, from, to))
            return;
        // Ends that are not cut off are the same for the next edge, to the last bit.
        Point start = from > 0 ? Point{a.x + from * x, a.y + from * y} : a;
        Point stop = to < 1 ? Point{a.x + to * x, a.y + to * y} : b;
        int n = count_;
        bool goes_on = n > 0 && code.is_behind(codes_[n - 2]) && is_vertex(n - 1, start);
        if (n + (goes_on ? 1 : 2) > kRoom) {
            bits_ |= kFull;
            return;
        }
        if (!goes_on) set(n++, start);
        codes_[n - 1] = code;
        bits_ |= std::uint32_t{1} << (n - 1);
        set(n++, stop);
        count_ = static_cast<std::uint8_t>(n);
    }

    // Takes the constant from a place that no edge is near: the middle of a part that is clear.
    void settle(Point place, bool is_inside) {
        auto none = [](Code) { return 0; };
        if ((side(place, none) > 0) != is_inside) bits_ |= kOdd;
    }
    // Nothing is told.
    void give_up() { bits_ |= kFull; }
    bool is_full() const { return (bits_ & kFull) != 0; }

    // ---------------------------------------------------------------- to ask it
    // +1 inside, 0 on the boundary, -1 outside, or kUntold; turn(code) is on which side of an edge
    // the place lies.
    static constexpr int kUntold = 2;
    template <class Turn>
    int side(Point place, Turn turn) const {
        // Between the heights of the rims: what is cut off there does not come to an end.
        double x = std::max(0.0, std::min(place.x * kColumn, kFine));
        double y = std::max(0.0, std::min(place.y * kRow, kFine - kReach / 64));
        const View v(*this, static_cast<float>(x), static_cast<float>(y));
        GatheredFours above, right, left, over, under, rim, far, negative;
        for (int i = 0; i < kRoom; i += 4) {
            Fours x0 = load_four(v.x + i), y0 = load_four(v.y + i);
            Fours x1 = load_four(v.x + i + 1), y1 = load_four(v.y + i + 1);
            Fours cross = x0 * y1 - y0 * x1;
            above.add(i, y0 > fours(0));
            right.add(i, x0 > fours(kReach));
            left.add(i, x0 < fours(-kReach));
            over.add(i, y0 > fours(kReach));
            under.add(i, y0 < fours(-kReach));
            rim.add(i, x0 == fours(v.rim));
            far.add(
                i, magnitudes(cross) > fours(kReach) * (magnitudes(x1 - x0) + magnitudes(y1 - y0)));
            negative.add(i, cross < fours(0));
        }
        std::uint32_t edges = bits_ & kEdges, rises = above.bits() >> 1;
        std::uint32_t crossing = (above.bits() ^ rises) & edges;
        std::uint32_t at_left = ~(negative.bits() ^ rises);
        std::uint32_t near =
            edges & ~(far.bits() | right.pairs() | left.pairs() | over.pairs() | under.pairs());
        std::uint32_t level = ~(over.bits() | under.bits());
        if (is_full() || (near & (level | level >> 1)) != 0) return kUntold;
        for (; near != 0; near &= near - 1) {
            int i = lowest(near), turned = turn(codes_[i]);
            if (turned == 0) return 0;
            std::uint32_t edge = std::uint32_t{1} << i;
            at_left = (turned < 0) == ((rises & edge) != 0) ? at_left | edge : at_left & ~edge;
        }
        std::uint32_t ends = edges ^ edges << 1;
        std::uint32_t odd = (crossing & at_left) ^ (above.bits() & rim.bits() & ends);
        return (__builtin_parity(odd) != 0) != ((bits_ & kOdd) != 0) ? 1 : -1;
    }

    // Calls f(code) for edges, among them all that meet a segment in the strip, until it returns
    // true. Returns whether it did. Not to be asked if it is full.
    template <class F>
    bool visit_along(Point p, Point q, F f) const {
        float x = static_cast<float>((q.x - p.x) * kColumn);
        float y = static_cast<float>((q.y - p.y) * kRow);
        float slack = kReach * (std::fabs(x) + std::fabs(y));
        const View v(*this, static_cast<float>(p.x * kColumn), static_cast<float>(p.y * kRow));
        GatheredFours right, left, over, under, before, behind;
        for (int i = 0; i < kRoom; i += 4) {
            Fours x0 = load_four(v.x + i), y0 = load_four(v.y + i);
            Fours cross = fours(x) * y0 - fours(y) * x0;
            right.add(i, x0 > fours(std::max(x, 0.0F) + kReach));
            left.add(i, x0 < fours(std::min(x, 0.0F) - kReach));
            over.add(i, y0 > fours(std::max(y, 0.0F) + kReach));
            under.add(i, y0 < fours(std::min(y, 0.0F) - kReach));
            before.add(i, cross > fours(slack));
            behind.add(i, cross < fours(-slack));
        }
        std::uint32_t left_over = bits_ & kEdges &
                                  ~(right.pairs() | left.pairs() | over.pairs() | under.pairs() |
                                    before.pairs() | behind.pairs());
        for (; left_over != 0; left_over &= left_over - 1) {
            if (f(codes_[lowest(left_over)])) return true;
        }
        return false;
    }

    // The same edges, traced alike, in some order.
    template <class Leaf>
    std::vector<std::array<Index, 6>> listed(Leaf leaf) const {
        std::vector<std::array<Index, 6>> all;
        for (std::uint32_t left = is_full() ? 0 : bits_ & kEdges; left != 0; left &= left - 1) {
            int i = lowest(left);
            all.push_back({leaf(codes_[i].leaf()), codes_[i].place(), xy_[i], xy_[i + 1],
                           xy_[kRoom + i], xy_[kRoom + i + 1]});
        }
        std::sort(all.begin(), all.end());
        return all;
    }
    // Of what is told besides.
    bool is_odd() const { return (bits_ & kOdd) != 0; }

   private:
    static constexpr int kRoom = 28;  // vertices
    static constexpr double kFine = 255;
    static constexpr double kColumn = kFine / Raster::kSide, kRow = kFine / kRows;  // steps a part
    // Half a step, and more than all rounding.
    static constexpr float kReach = 0.75F;
    static constexpr std::uint32_t kEdges = (std::uint32_t{1} << (kRoom - 1)) - 1;
    // The constant is 1; nothing is told.
    static constexpr std::uint32_t kOdd = std::uint32_t{1} << 30, kFull = std::uint32_t{1} << 31;

    // The vertices as seen from a place.
    struct View {
        float x[kRoom + 4], y[kRoom + 4];
        float rim;  // x of the left rim

        View(const Trace& trace, float from_x, float from_y) : rim(-from_x) {
            for (int i = 0; i < kRoom; ++i) {
                x[i] = static_cast<float>(trace.xy_[i]) - from_x;
                y[i] = static_cast<float>(trace.xy_[kRoom + i]) - from_y;
            }
            std::fill(x + kRoom, x + kRoom + 4, 0.0F);
            std::fill(y + kRoom, y + kRoom + 4, 0.0F);
        }
    };

    // Leaves of the part of a + t * way, 0 <= t <= 1, what lies within 0 .. high or a margin beside
    // it; false if nothing does.
    static bool clip(double a, double way, double high, double& from, double& to) {
        constexpr double margin = 2 * Raster::kMargin;
        if (way == 0) return -margin <= a && a <= high + margin;
        double first = (-margin - a) / way, last = (high + margin - a) / way;
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
    std::uint32_t bits_;             // edges by their starts, and kOdd, and kFull
    std::uint8_t count_;             // of vertices
    alignas(64) Code codes_[kRoom];  // of edges by their starts
};

// A raster with the traces of its strips.
struct alignas(64) Strips {
    Raster raster;
    Trace traces[Raster::kSide / Trace::kRows];

    // First clear, then all edges that may come near, then settle, as a raster.
    void clear() {
        raster.clear();
        for (Trace& trace : traces) trace.clear();
    }
    void add(Point a, Point b, Code code) {
        raster.add(a, b);
        for (Trace& trace : traces) {
            trace.add(a, b, code);
            a.y -= Trace::kRows, b.y -= Trace::kRows;
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

    // What tells the edges between two heights.
    void fetch(double low, double high) const {
        int last = Raster::part(high) / Trace::kRows;
        for (int n = Raster::part(low) / Trace::kRows; n <= last; ++n) {
            traces[n].fetch();
            traces[n].fetch_codes();
        }
    }

    // Whether two are of the same edges; leaves are told by their numbers in the lists.
    template <class LeafOfA, class LeafOfB>
    static bool are_alike(const Strips& a, LeafOfA of_a, const Strips& b, LeafOfB of_b) {
        for (std::size_t i = 0; i < std::size(a.traces); ++i) {
            const Trace &m = a.traces[i], &n = b.traces[i];
            if (m.is_full() != n.is_full() || m.listed(of_a) != n.listed(of_b)) return false;
            if (!m.is_full() && m.is_odd() != n.is_odd()) return false;
        }
        return a.raster == b.raster;
    }
};

}  // namespace flintknap
