// What lies where: for each cell of a grid over the ring, the few leaves that have to be asked.
//
// Theory. Let C be a closed cell, and let the leaves of the ring whose boxes meet C be listed with
// it. Every other edge ab is disjoint from C. As a place q moves in C, whether ab crosses the ray
// from q to the right changes only when the ray passes an end of ab that lies beyond the right side
// of C: so, with [..] for 1 if true and 0 if not, and sums taken modulo 2,
//
//                |   C   |     a           (1)  [ab crosses the ray]
//        b       |  q----|---/------             + [a right of C and above q]
//         \      |_______| _/                    + [b right of C and above q]
//          \______________/               is a constant of C.
//
// Summed over all edges that are not listed, the terms of inner vertices cancel; what is left are
// the ends of listed leaves. So of all that is not listed a cell keeps one bit, `odd`, and of each
// leaf whether its ends are right of C; they count once more, for what comes before and behind.
//
// A cell is made when it is first asked about, by a walk down the tree that opens the boxes which
// meet C. It stays as it is while the leaves in it do: let B be a box of all that a splice took
// away and put in its place. If B does not meet C, no place of C has changed sides, nor has (1)
// for a listed leaf, so neither has the rest. The cells that meet B are forgotten. Cells with more
// leaves than there is room for are left to the tree; so is what is outside.
//
// Invariants (check): a cell that is known is what it would be if made now; the ring lies in the
// frame of the grid.
// Cost: a cell for every 32 vertices, 64 bytes each, none before somebody asks. To make one:
// O(log n) boxes on curves. A place: the leaves of its cell. A splice: a write a cell in its box.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "queries.hpp"
#include "splices.hpp"

namespace flintknap {

class Cells {
   public:
    static constexpr std::size_t kRoom = 12;

    struct alignas(64) Cell {
        Index leaves[kRoom];
        std::uint16_t first_right, last_right;  // by leaf, as bits: ends right of the cell
        std::uint8_t count;                     // of leaves; kRoom + 1 if there are more
        std::uint8_t odd;
        bool is_crowded() const { return count > kRoom; }
    };

    explicit Cells(const Ring& ring) : ring_(ring) {}

    const Ring& ring() const { return ring_; }

    // The cell of a place in the box of the ring; nullptr if it is crowded.
    const Cell* find(Point q) {
        if (columns_ == 0) begin();
        const Cell& cell = made(column(q.x), row(q.y));
        return cell.is_crowded() ? nullptr : &cell;
    }

    // +1 inside, 0 on the boundary, -1 outside.
    int side(Point q) {
        if (ring_.empty() || !ring_.node(ring_.root()).box.holds(q)) return -1;
        const Cell* cell = find(q);
        return cell == nullptr ? flintknap::side(ring_, q) : side_of(crossed(*cell, q));
    }

    // Calls f(leaf) for leaves, until it returns true. Returns whether it did, or these are all
    // that have anything in a box; false if the box is large, or somewhere crowded.
    template <class F>
    bool visit(const Box& box, F f) {
        if (columns_ == 0) begin();
        Index left = column(box.x_low), right = column(box.x_high);
        Index low = row(box.y_low), high = row(box.y_high);
        if (right - left > 1 || high - low > 1) return false;
        bool is_all = true;
        for (Index y = low; y <= high; ++y) {
            for (Index x = left; x <= right; ++x) {
                const Cell& cell = made(x, y);
                if (cell.is_crowded()) {
                    is_all = false;
                    continue;
                }
                for (std::size_t i = 0; i < cell.count; ++i) {
                    if (f(cell.leaves[i])) return true;
                }
            }
        }
        return is_all;
    }

    // Whether all that is no farther from q than the root of this lies in the cell of q.
    bool reaches(Point q, double square) const {
        Box b = box(column(q.x), row(q.y));
        double x = std::min(q.x - b.x_low, b.x_high - q.x);
        double y = std::min(q.y - b.y_low, b.y_high - q.y);
        double least = std::min(x, y);
        return least > 0 && least * least > square;
    }

    // Forgets what a splice has changed.
    void follow(const Splices& splices) {
        if (columns_ == 0) return;
        if (splices.changed_all() || !fits()) {
            columns_ = rows_ = 0;
            return;
        }
        for (const Box& b : splices.changed()) forget(b);
    }

    std::size_t bytes() const { return cells_.capacity() * sizeof(Cell) + is_made_.capacity(); }

    // The first broken invariant, or nothing. O(n log n).
    std::string check() const {
        if (columns_ == 0) return {};
        if (!fits()) return "the grid does not fit the ring";
        for (Index y = 0; y < rows_; ++y) {
            for (Index x = 0; x < columns_; ++x) {
                if (is_made_[place(x, y)] == 0) continue;
                const Cell& known = cells_[place(x, y)];
                Cell cell = {};
                make(cell, box(x, y));
                if (!are_alike(known, cell)) {
                    return "cell " + std::to_string(x) + ", " + std::to_string(y) +
                           " is not what it would be if made now";
                }
            }
        }
        return {};
    }

   private:
    static constexpr Index kShare = 32;  // vertices a cell
    static constexpr double kMargin = 0.125;

    // A grid of about square cells, wider than the ring by a margin, so that it seldom outgrows it.
    void begin() {
        const Box& b = ring_.node(ring_.root()).box;
        double width = b.x_high - b.x_low, height = b.y_high - b.y_low;
        frame_ = {b.x_low - kMargin * width, b.y_low - kMargin * height, b.x_high + kMargin * width,
                  b.y_high + kMargin * height};
        double wanted = ring_.size() / kShare + 1;
        double across = std::sqrt(wanted) * std::sqrt(width / height);
        Index columns = static_cast<Index>(std::max(1.0, std::min(across, wanted)));
        Index rows = static_cast<Index>(wanted) / columns + 1;
        std::size_t cells = at(columns) * at(rows);
        if (cells_.size() < cells) cells_.resize(cells);
        is_made_.assign(cells, 0);
        x_scale_ = columns / (frame_.x_high - frame_.x_low);
        y_scale_ = rows / (frame_.y_high - frame_.y_low);
        x_slack_ = slack(frame_.x_low, frame_.x_high, columns);
        y_slack_ = slack(frame_.y_low, frame_.y_high, rows);
        made_for_ = ring_.size();
        rows_ = rows;
        columns_ = columns;
    }

    // Whether the grid holds the ring, and is neither too coarse nor too large for it.
    bool fits() const {
        if (ring_.empty() || ring_.size() / 2 > made_for_) return false;
        const Box& b = ring_.node(ring_.root()).box;
        if (!frame_.holds({b.x_low, b.y_low}) || !frame_.holds({b.x_high, b.y_high})) return false;
        return std::max((b.x_high - b.x_low) * x_scale_ / columns_,
                        (b.y_high - b.y_low) * y_scale_ / rows_) >= 0.25;
    }

    static Index cut(double place, Index n) {
        return static_cast<Index>(std::max(0.0, std::min(place, n - 1.0)));
    }
    Index column(double x) const { return cut((x - frame_.x_low) * x_scale_, columns_); }
    Index row(double y) const { return cut((y - frame_.y_low) * y_scale_, rows_); }
    std::size_t place(Index column, Index row) const { return at(row) * at(columns_) + at(column); }

    // A cell, somewhat larger than the places in it: by more than all rounding.
    Box box(Index column, Index row) const {
        double x = (frame_.x_high - frame_.x_low) / columns_;
        double y = (frame_.y_high - frame_.y_low) / rows_;
        return {frame_.x_low + column * x - x_slack_, frame_.y_low + row * y - y_slack_,
                frame_.x_low + (column + 1) * x + x_slack_,
                frame_.y_low + (row + 1) * y + y_slack_};
    }
    static double slack(double low, double high, Index n) {
        return (high - low) / n / (1 << 20) + 8 * kUlp * std::max(std::fabs(low), std::fabs(high));
    }

    const Cell& made(Index column, Index row) {
        std::size_t i = place(column, row);
        if (is_made_[i] == 0) {
            make(cells_[i], box(column, row));
            is_made_[i] = 1;
        }
        return cells_[i];
    }

    void make(Cell& cell, const Box& box) const {
        constexpr int room = Ring::kDeepest;
        Point corner = {box.x_low, box.y_low};
        unsigned odd = 0;
        Index todo[room];
        int left = 0;
        cell.count = 0;
        cell.first_right = cell.last_right = 0;
        todo[left++] = ring_.root();
        while (left > 0 && !cell.is_crowded()) {
            Index n = todo[--left];
            const Ring::Node& node = ring_.node(n);
            if (!overlap(node.box, box)) {
                odd ^= crossed_at_right(node, corner);
            } else if (node.right != kNone) {
                todo[left++] = node.right;
                todo[left++] = node.left;
            } else if (cell.count == kRoom) {
                ++cell.count;
            } else {
                const Ring::Leaf& leaf = ring_.leaf_at(node);
                bool first_right = leaf.x[0] > box.x_high;
                bool last_right = leaf.x[node.count] > box.x_high;
                odd ^= (first_right & (node.first_y > corner.y)) ^
                       (last_right & (node.last_y > corner.y));
                cell.first_right |= static_cast<std::uint16_t>(first_right << cell.count);
                cell.last_right |= static_cast<std::uint16_t>(last_right << cell.count);
                cell.leaves[cell.count++] = n;
            }
        }
        cell.odd = static_cast<std::uint8_t>(odd);
    }

    unsigned crossed(const Cell& cell, Point q) const {
        unsigned crossed = cell.odd, holding = 0;
        for (std::size_t i = 0; i < cell.count; ++i) {  // no branches: they could not be foreseen
            const Ring::Node& n = ring_.node(cell.leaves[i]);
            crossed ^= (cell.first_right >> i & (n.first_y > q.y)) ^
                       (cell.last_right >> i & (n.last_y > q.y)) ^ crossed_at_right(n, q);
            holding |= unsigned{n.box.holds(q)} << i;
        }
        for (; holding != 0; holding &= holding - 1) {
            const Ring::Node& n = ring_.node(cell.leaves[lowest(holding)]);
            crossed ^= crossed_in_leaf(ring_.leaf_at(n), n.count, q);
            if ((crossed & kOn) != 0) return kOn;
        }
        return crossed;
    }

    // The cells that meet a box, with their slack.
    void forget(const Box& b) {
        std::size_t left = at(column(b.x_low - 2 * x_slack_));
        std::size_t right = at(column(b.x_high + 2 * x_slack_));
        Index high = row(b.y_high + 2 * y_slack_);
        for (Index y = row(b.y_low - 2 * y_slack_); y <= high; ++y) {
            std::uint8_t* first = &is_made_[place(0, y)];
            std::fill(first + left, first + right + 1, 0);
        }
    }

    // In which order leaves are listed depends on where the tree begins.
    static bool are_alike(const Cell& a, const Cell& b) {
        if (a.is_crowded() || b.is_crowded()) return a.is_crowded() && b.is_crowded();
        auto listed = [](const Cell& c) {
            std::vector<std::pair<Index, int>> all;
            for (int i = 0; i < c.count; ++i) {
                int ends = (c.first_right >> i & 1) + 2 * (c.last_right >> i & 1);
                all.push_back({c.leaves[i], ends});
            }
            std::sort(all.begin(), all.end());
            return all;
        };
        return a.odd == b.odd && listed(a) == listed(b);
    }

    const Ring& ring_;
    std::vector<Cell> cells_;            // row by row
    std::vector<std::uint8_t> is_made_;  // by cell, 0 or 1
    Box frame_ = {};
    Index columns_ = 0, rows_ = 0;      // 0 while there is no grid
    double x_scale_ = 0, y_scale_ = 0;  // cells a unit
    double x_slack_ = 0, y_slack_ = 0;
    Index made_for_ = 0;  // vertices
};

}  // namespace flintknap
