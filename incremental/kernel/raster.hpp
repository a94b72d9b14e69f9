// A square parted into 32 by 32: which parts no edge comes near, and on which side those lie.
//
// Theory. Coordinates are those of the parts: a part is that of column c, row r if c <= x <= c + 1
// and r <= y <= r + 1. An edge comes near a part if it meets it widened by a margin, which is more
// than all rounding of coordinates and of where edges cross rows. Parts that no edge comes near
// are *clear*: all of one lies on one side. So do two clear parts beside each other, and of two in
// a row those between which an even number of edges cross the middle of the row: at parts that
// are not clear, for edges are near where they cross.
//
//      row r + 1    . . . e     -     clear parts, - and + by their sides; e: edges are near.
//                   - - e + e e -     Row r + 1 takes its sides from a part that is clear in
//      row r        - e + + + e -     both rows; to find those of the first, one place is asked.
//
// Invariants (check, of cells.hpp): a raster is a function of the edges that come near its square.
// Cost: 8 bytes a row. To draw: the rows each edge comes near. A place: one load.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <utility>

#include "lanes.hpp"
#include "mesh.hpp"
#include "predicates.hpp"

namespace flintknap {

class Raster {
   public:
    static constexpr int kSide = 32;
    static constexpr double kMargin = 1.0 / (1 << 18);

    // An edge or a segment, widened by a margin to all sides.
    struct Slant {
        double low, high, left, right;
        double slope, start;  // x a row; x at the lower end of row 0
        double aside;         // how far it reaches to both sides of x in a row
        bool is_flat;         // nearly: in one row or two, as far as it reaches

        Slant(Point a, Point b, double margin) {
            if (b.y < a.y) std::swap(a, b);
            low = a.y - margin, high = b.y + margin;
            left = std::min(a.x, b.x) - margin, right = std::max(a.x, b.x) + margin;
            is_flat = b.y - a.y < 4 * margin;
            slope = is_flat ? 0 : (b.x - a.x) / (b.y - a.y);
            start = a.x - a.y * slope;
            aside = is_flat ? right - left : margin * (1 + std::fabs(slope));
        }
    };

    // The column or row of a place in the square.
    static int part(double v) { return static_cast<int>(std::max(0.0, std::min(v, kSide - 1.0))); }
    static Lanes cut(Lanes v) { return larger(both(0), smaller(v, both(kSide - 1))); }

    // +1 inside, -1 outside, 0 where edges are near.
    int side(int column, int r) const {
        Sides sides = sides_of(column, r);
        return static_cast<int>(sides & kInside) - static_cast<int>(sides >> 32 & kInside);
    }

    // What lies where, as bits: nothing inside and outside where edges are near.
    using Sides = std::uint64_t;
    static constexpr Sides kInside = 1, kOutside = kInside << 32, kSides = kInside | kOutside;
    static constexpr Sides kEdges = 2;  // may be near
    // Those of a part; other bits than these two are of others.
    Sides sides_of(int column, int row) const { return rows_[at(row)] >> column; }

    [[gnu::always_inline]] void fetch(int row) const { __builtin_prefetch(&rows_[at(row)]); }

    // ---------------------------------------------------------------- to draw it
    // First clear, then all edges that may come near, then settle.
    void clear() { rows_.fill(kAll * kOutside); }
    // All of it lies on one side, or neither.
    static Raster all(Sides side) {
        Raster raster;
        raster.rows_.fill(kAll * side);
        return raster;
    }

    void add(Point a, Point b) {
        const Slant s(a, b, kMargin);
        trace(s, [&](int row, double from, double to) {
            rows_[at(row)] &= ~(span(from, to) * kOutside);
        });
        // Crossed an odd number of times: what is inside tells this for now, as what is outside
        // tells what is clear.
        if (b.y < a.y) std::swap(a, b);
        double x = s.start + (above(a.y) + 0.5) * s.slope;
        for (int row = above(a.y), end = above(b.y); row < end; ++row, x += s.slope) {
            rows_[at(row)] ^= kInside << bit(x) >> 1 & kAll;
        }
    }

    // side(column, row) of a clear part; 0 if that cannot be told, and then its row is not clear.
    template <class Side>
    void settle(Side side) {
        Sides below = 0;
        for (int r = 0; r < kSide; ++r) {
            Sides& row = rows_[at(r)];
            auto clear = static_cast<std::uint32_t>(row >> 32);
            auto odd = static_cast<std::uint32_t>(row << 1);  // crossings left of each part
            for (int step = 1; step < kSide; step *= 2) odd ^= odd << step;
            if (clear != 0) {
                std::uint32_t both = clear & clear_of(below);
                int column = lowest(both != 0 ? both : clear);
                bool is_inside = (below >> column & kInside) != 0;
                if (both == 0) {
                    int told = side(column, r);
                    if (told == 0) clear = 0;
                    is_inside = told > 0;
                }
                if (is_inside != static_cast<bool>(odd >> column & 1)) odd = ~odd;
            }
            row = below = (odd & clear) * kInside | (~odd & clear) * kOutside;
        }
    }

    // ---------------------------------------------------------------- segments
    // What a segment comes by, as bits.
    static bool are_both(Sides seen) { return (seen & kSides) == kSides; }

    // Columns or rows from one to another, as bits.
    static std::uint32_t parts(int first, int last) {
        return ~0U >> (kSide - 1 - last) & ~0U << first;
    }

    // Whether no edge comes near some columns in any of those rows that are among `count` from a
    // first one on. All of them are looked at: how many matter could not be foreseen.
    template <int count>
    bool is_clear(std::uint32_t columns, std::uint32_t rows, int first) const {
        Sides near = 0;
        for (int r = first; r < first + count; ++r) {
            const Sides row = rows_[at(r)];
            near |= ~(row | row >> 32) & (Sides{0} - (rows >> r & 1));
        }
        return (near & columns) == 0;
    }

    // Rows, as bits, in which it meets parts that are not clear.
    std::uint32_t touched(const Slant& s) const {
        std::uint32_t rows = 0;
        trace(s, [&](int r, double from, double to) {
            bool is_touched = (span(from, to) & ~clear_of(rows_[at(r)])) != 0;
            rows |= std::uint32_t{is_touched} << r;
        });
        return rows;
    }

    // Column and row of some part that is clear, of some rows.
    std::optional<std::pair<int, int>> clear_part(int first, int end) const {
        for (int r = first; r < end; ++r) {
            std::uint32_t clear = clear_of(rows_[at(r)]);
            if (clear != 0) return std::pair(lowest(clear), r);
        }
        return {};
    }

    // Calls f(row, from, to) for the rows in which an edge meets parts, so widened: span(from, to)
    // are these parts.
    template <class F>
    static void trace(const Slant& s, F f) {
        if (s.high < 0 || s.low > kSide || s.right < 0 || s.left > kSide) return;
        // Of x and 1 more, so that what is left of the square is 0 and something.
        double left = std::max(s.left, -1.0) + 1, right = std::min(s.right, kSide + 0.5) + 1;
        double low = std::min(s.slope, 0.0) - s.aside + 1;
        double high = std::max(s.slope, 0.0) + s.aside + 1;
        int last = part(s.high);
        for (int row = part(s.low); row <= last; ++row) {
            double x = s.start + row * s.slope;
            double from = std::min(std::max(x + low, left), right);
            double to = std::max(std::min(x + high, right), left);
            f(row, from, to);
        }
    }
    static std::uint32_t span(double from, double to) {
        int first = static_cast<int>(from), last = static_cast<int>(to);
        std::uint64_t parts = (std::uint64_t{2} << last) - (std::uint64_t{1} << first);
        return static_cast<std::uint32_t>(parts >> 1);
    }

    bool operator==(const Raster& other) const { return rows_ == other.rows_; }

   private:
    static constexpr Sides kAll = ~std::uint32_t{0};  // columns

    static std::uint32_t clear_of(Sides row) { return static_cast<std::uint32_t>(row | row >> 32); }

    // The first row whose middle is above a height.
    static int above(double y) {
        return static_cast<int>(std::max(0.0, std::min(y + 0.5, kSide + 0.0)));
    }

    // One more than the column; 0 and kSide + 1 are beside the square.
    static int bit(double x) {
        return static_cast<int>(std::max(-1.0, std::min(x, kSide + 0.0)) + 1);
    }

    // By column, as bits: what is clear and inside; from bit 32 on, what is clear and outside.
    alignas(64) std::array<Sides, kSide> rows_;
};

}  // namespace flintknap
