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

    // +1 inside, -1 outside, 0 where edges are near.
    int side(int column, int r) const {
        const Row& row = rows_[at(r)];
        int is_clear = row.clear >> column & 1, is_inside = row.inside >> column & 1;
        return 2 * is_inside - is_clear;
    }

    // The same as bits, if it is clear.
    static constexpr unsigned kInside = 1, kOutside = 2, kEdges = 4;
    unsigned kind(int column, int r) const {
        const Row& row = rows_[at(r)];
        unsigned is_clear = row.clear >> column & 1, is_inside = row.inside >> column & 1;
        return is_clear << (is_inside ^ 1);
    }

    [[gnu::always_inline]] void fetch(int row) const { __builtin_prefetch(&rows_[at(row)]); }

    // ---------------------------------------------------------------- to draw it
    // First clear, then all edges that may come near, then settle.
    void clear() { rows_.fill({~0U, 0}); }
    // All of it lies on one side.
    static Raster all(bool is_inside) {
        Raster raster;
        raster.rows_.fill({~0U, is_inside ? ~0U : 0U});
        return raster;
    }
    // Nothing is clear.
    static Raster unknown() {
        Raster raster;
        raster.rows_.fill({0, 0});
        return raster;
    }

    void add(Point a, Point b) {
        const Slant s(a, b, kMargin);
        trace(s, [&](int row, double from, double to) { rows_[at(row)].clear &= ~span(from, to); });
        // Crossed an odd number of times: `inside` tells this for now.
        if (b.y < a.y) std::swap(a, b);
        double x = s.start + (above(a.y) + 0.5) * s.slope;
        for (int row = above(a.y), end = above(b.y); row < end; ++row, x += s.slope) {
            rows_[at(row)].inside ^= static_cast<std::uint32_t>(std::uint64_t{1} << bit(x) >> 1);
        }
    }

    // side(column, row) of a clear part; 0 if that cannot be told, and then its row is not clear.
    template <class Side>
    void settle(Side side) {
        Row below = {0, 0};
        for (int r = 0; r < kSide; ++r) {
            Row& row = rows_[at(r)];
            std::uint32_t odd = row.inside << 1;  // crossings left of each part
            for (int step = 1; step < kSide; step *= 2) odd ^= odd << step;
            if (row.clear != 0) {
                std::uint32_t both = row.clear & below.clear;
                int column = lowest(both != 0 ? both : row.clear);
                bool is_inside = below.inside >> column & 1;
                if (both == 0) {
                    int told = side(column, r);
                    if (told == 0) row.clear = 0;
                    is_inside = told > 0;
                }
                if (is_inside != static_cast<bool>(odd >> column & 1)) odd = ~odd;
            }
            row.inside = odd & row.clear;
            below = row;
        }
    }

    // ---------------------------------------------------------------- segments
    // What a segment comes by, as bits.
    static bool are_both(unsigned seen) { return (seen & 3) == 3; }

    // Whether no edge comes near some columns, as bits, in any of some rows.
    bool is_clear(std::uint32_t columns, int low, int high) const {
        std::uint32_t clear = columns;
        for (int r = low; r <= high; ++r) clear &= rows_[at(r)].clear;
        return clear == columns;
    }

    // Rows, as bits, in which it meets parts that are not clear.
    std::uint32_t touched(const Slant& s) const {
        std::uint32_t rows = 0;
        trace(s, [&](int r, double from, double to) {
            bool is_touched = (span(from, to) & ~rows_[at(r)].clear) != 0;
            rows |= std::uint32_t{is_touched} << r;
        });
        return rows;
    }

    // Column and row of some part that is clear, of some rows.
    std::optional<std::pair<int, int>> clear_part(int first, int end) const {
        for (int r = first; r < end; ++r) {
            if (rows_[at(r)].clear != 0) return std::pair(lowest(rows_[at(r)].clear), r);
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
    struct Row {
        std::uint32_t clear, inside;  // by column, as bits; of parts that are not clear, 0
        bool operator==(const Row& o) const { return clear == o.clear && inside == o.inside; }
    };

    // The first row whose middle is above a height.
    static int above(double y) {
        return static_cast<int>(std::max(0.0, std::min(y + 0.5, kSide + 0.0)));
    }

    // One more than the column; 0 and kSide + 1 are beside the square.
    static int bit(double x) {
        return static_cast<int>(std::max(-1.0, std::min(x, kSide + 0.0)) + 1);
    }

    alignas(64) std::array<Row, kSide> rows_;
};

}  // namespace flintknap
