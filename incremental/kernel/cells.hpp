// What lies where: for each cell of a grid over the ring, the few leaves that have to be asked.
//
// Theory. Let C be a closed cell, and let the leaves of the ring with edges that may meet C be
// listed with it. Every other edge ab is disjoint from C. As a place q moves in C, whether ab
// crosses the ray from q to the right changes only when the ray passes an end of ab that lies
// beyond the right side of C: so, with [..] for 1 if true and 0 if not, and sums taken modulo 2,
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
// A cell that is asked about again and again is drawn (raster.hpp): then most places in it are told
// by one load, and so are most short segments. One that no leaf meets is wholly on one side.
//
// Invariants (check): a cell that is known is what it would be if made now; the ring lies in the
// frame of the grid.
// Cost: a cell for every 16 vertices, 4 bytes each, and 384 for one with leaves, none before
// somebody asks. To make one: O(log n) boxes on curves; to draw it: the edges in it. A place: a
// load, or the leaves of its cell. A splice: a write a cell in its box.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "queries.hpp"
#include "raster.hpp"
#include "splices.hpp"

namespace flintknap {

class Cells {
   public:
    static constexpr std::size_t kRoom = 28;
    static constexpr std::uint8_t kPatience = 4;  // questions before a cell is drawn

    struct alignas(64) Cell {
        Index leaves[kRoom];
        std::uint32_t first_right, last_right;  // by leaf, as bits: ends right of the cell
        std::uint8_t count;                     // of leaves; kRoom + 1 if there are more
        std::uint8_t odd;
        std::uint8_t asked;  // how often, before it is drawn
        Raster raster;       // until then nothing in it is clear
        bool is_crowded() const { return count > kRoom; }
        bool is_drawn() const { return asked == kPatience; }
    };

    explicit Cells(const Ring& ring) : ring_(ring) {}

    const Ring& ring() const { return ring_; }

    // The cell of a place in the box of the ring; nullptr if it is empty or crowded.
    const Cell* find(Point q) {
        if (columns_ == 0) begin();
        Index known = made(column(q.x), row(q.y));
        return known < 0 || cells_[at(known)].is_crowded() ? nullptr : &cells_[at(known)];
    }

    // +1 inside, 0 on the boundary, -1 outside.
    int side(Point q) {
        if (columns_ == 0) {
            if (ring_.empty()) return -1;
            begin();
        }
        if (!frame_.holds(q)) return -1;
        Spot at_q = spot(q);
        Index known = made(at_q.column, at_q.row);
        if (known < 0) return known == kInside ? 1 : -1;
        Cell& cell = cells_[at(known)];
        int told = cell.raster.side(at_q.in_raster());
        if (told != 0) return told;
        if (cell.is_crowded()) return flintknap::side(ring_, q);
        note_question(cell, at_q.column, at_q.row);
        return side_of(crossed(cell, q));
    }

    // What a segment comes by, as bits of Raster: its sides, and kEdges if there may be some, or
    // the way is long, or there is no need to know because it comes by both sides.
    unsigned along(Point p, Point q) {
        if (columns_ == 0) begin();
        if (!frame_.holds(p) || !frame_.holds(q)) return Raster::kEdges;
        Spot first = spot(p), last = spot(q);
        auto [left, right] = std::minmax({first.column, last.column});
        auto [low, high] = std::minmax({first.row, last.row});
        if (right - left > 1 || high - low > 1) return Raster::kEdges;
        Index at_first = ask(first.column, first.row), at_last = at_first;
        bool is_one = left == right && low == high;
        if (is_one && at_first < 0) return kind(at_first);
        if (!is_one) at_last = ask(last.column, last.row);
        unsigned seen = kind_at(at_first, first) | kind_at(at_last, last);
        if (Raster::are_both(seen)) return seen;
        const Raster::Slant way(first.parts, last.parts, Raster::kMargin / 2);
        for (Index y = low; y <= high; ++y) {
            for (Index x = left; x <= right; ++x) {
                Index known = made(x, y);
                const auto here = way.from(corner(x, y));
                if (known >= 0) {
                    seen |= cells_[at(known)].raster.along(here);
                } else if (Raster::is_met(here)) {
                    seen |= kind(known);
                }
                if (Raster::are_both(seen)) return seen;
            }
        }
        return seen;
    }

    // Calls f(leaf) for leaves, until it returns true. Returns whether it did, or these are all
    // that have anything in a box; false if the box is large, or somewhere crowded.
    template <class F>
    bool visit(const Box& box, F f) {
        if (columns_ == 0) begin();
        Range cells = range(box);
        if (!cells.is_small()) return false;
        bool is_all = true;
        for (Index y = cells.low; y <= cells.high; ++y) {
            for (Index x = cells.left; x <= cells.right; ++x) {
                Index known = made(x, y);
                if (known < 0) continue;
                const Cell& cell = cells_[at(known)];
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

    std::size_t bytes() const {
        return cells_.capacity() * sizeof(Cell) + known_.capacity() * sizeof(Index);
    }

    // The first broken invariant, or nothing. O(n log n).
    std::string check() const {
        if (columns_ == 0) return {};
        if (!fits()) return "the grid does not fit the ring";
        for (Index y = 0; y < rows_; ++y) {
            for (Index x = 0; x < columns_; ++x) {
                Index known = known_[place(x, y)];
                if (known == kNone) continue;
                Cell cell;
                make(cell, box(x, y));
                bool is_so = known == (cell.count > 0 ? known : side_all_over(cell));
                if (known >= 0) {
                    const Cell& old = cells_[at(known)];
                    if (old.is_drawn()) draw(cell, x, y);
                    is_so = is_so && are_alike(old, cell) && old.raster == cell.raster;
                }
                if (!is_so) {
                    return "cell " + std::to_string(x) + ", " + std::to_string(y) +
                           " is not what it would be if made now";
                }
            }
        }
        return {};
    }

   private:
    static constexpr Index kShare = 16;  // vertices a cell
    static constexpr double kMargin = 0.125;

    // Of a cell without leaves.
    static constexpr Index kOutside = -2, kInside = -3;
    static_assert(kNone == -1);

    // Of cells.
    struct Range {
        Index left, right, low, high;
        bool is_small() const { return right - left <= 1 && high - low <= 1; }
    };

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
        known_.assign(cells, kNone);
        cells_.clear();
        free_ = kNone;
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
    Range range(const Box& b) const {
        return {column(b.x_low), column(b.x_high), row(b.y_low), row(b.y_high)};
    }
    // Coordinates in parts of rasters; of places in the frame they are off by 2^-21 at most. And
    // those of the corner of a cell.
    Point in_parts(Point q) const {
        return {(q.x - frame_.x_low) * x_scale_ * Raster::kSide,
                (q.y - frame_.y_low) * y_scale_ * Raster::kSide};
    }
    static Point corner(Index column, Index row) {
        return {static_cast<double>(column) * Raster::kSide,
                static_cast<double>(row) * Raster::kSide};
    }
    Point in_raster(Point q, Index column, Index row) const {
        return Spot{in_parts(q), column, row}.in_raster();
    }
    // Where a place in the frame is.
    struct Spot {
        Point parts;
        Index column, row;

        Point in_raster() const {
            Point origin = corner(column, row);
            return {parts.x - origin.x, parts.y - origin.y};
        }
    };
    Spot spot(Point q) const {
        Point parts = in_parts(q);
        auto cell = [](double v, Index n) {
            return std::min(static_cast<Index>(static_cast<std::uint32_t>(v) / Raster::kSide),
                            n - 1);
        };
        return {parts, cell(parts.x, columns_), cell(parts.y, rows_)};
    }

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

    // What is known of a cell, once it is made.
    Index made(Index column, Index row) {
        Index& known = known_[place(column, row)];
        if (known == kNone) known = make_one(box(column, row));
        return known;
    }
    Index make_one(const Box& box) {
        if (free_ == kNone) {
            cells_.push_back({});
            cells_.back().leaves[0] = kNone;
            free_ = static_cast<Index>(cells_.size()) - 1;
        }
        Index n = free_;
        Cell& cell = cells_[at(n)];
        Index next = cell.leaves[0];
        make(cell, box);
        if (cell.count == 0) {
            cell.leaves[0] = next;
            return side_all_over(cell);
        }
        free_ = next;
        return n;
    }

    static Index side_all_over(const Cell& cell) { return cell.odd != 0 ? kInside : kOutside; }

    // One that is asked about again and again is drawn.
    void note_question(Cell& cell, Index column, Index row) {
        if (cell.is_drawn() || cell.is_crowded()) return;
        if (++cell.asked == kPatience) draw(cell, column, row);
    }

    // What is known of a cell that is asked about once more.
    Index ask(Index column, Index row) {
        Index known = made(column, row);
        if (known >= 0) note_question(cells_[at(known)], column, row);
        return known;
    }

    // The same as bits of Raster; of a place, if it is known what is there.
    static unsigned kind(Index known) {
        return known == kInside    ? Raster::kInside
               : known == kOutside ? Raster::kOutside
                                   : Raster::kEdges;
    }
    unsigned kind_at(Index known, const Spot& place) const {
        if (known < 0) return kind(known);
        int told = cells_[at(known)].raster.side(place.in_raster());
        return told > 0 ? Raster::kInside : told < 0 ? Raster::kOutside : 0;
    }

    void draw(Cell& cell, Index column, Index row) const {
        Raster& raster = cell.raster;
        raster.clear();
        const Box near = box(column, row);
        for (std::size_t i = 0; i < cell.count; ++i) {
            const Ring::Node& n = ring_.node(cell.leaves[i]);
            const Ring::Leaf& leaf = ring_.leaf_at(n);
            for (std::int64_t left = not_beside(leaf, n.count, near); left != 0; left &= left - 1) {
                int e = lowest(left);
                raster.add(in_raster({leaf.x[e], leaf.y[e]}, column, row),
                           in_raster({leaf.x[e + 1], leaf.y[e + 1]}, column, row));
            }
        }
        raster.settle([&](int x, int y) {
            Point q = {frame_.x_low + (column + (x + 0.5) / Raster::kSide) / x_scale_,
                       frame_.y_low + (row + (y + 0.5) / Raster::kSide) / y_scale_};
            Point there = in_raster(q, column, row);  // elsewhere if doubles are far between
            bool is_there = Raster::part(there.x) == x && Raster::part(there.y) == y &&
                            this->column(q.x) == column && this->row(q.y) == row;
            return is_there ? side_of(crossed(cell, q)) : 0;
        });
    }

    void make(Cell& cell, const Box& box) const {
        constexpr int room = Ring::kDeepest;
        Point corner = {box.x_low, box.y_low};
        unsigned odd = 0;
        Index todo[room];
        int left = 0;
        cell.raster.forget();
        cell.count = cell.asked = 0;
        cell.first_right = cell.last_right = 0;
        todo[left++] = ring_.root();
        while (left > 0 && !cell.is_crowded()) {
            Index n = todo[--left];
            const Ring::Node& node = ring_.node(n);
            if (!overlap(node.box, box)) {
                odd ^= crossed_at_right(node, corner);
                continue;
            }
            if (node.right != kNone) {
                todo[left++] = node.right;
                todo[left++] = node.left;
                continue;
            }
            const Ring::Leaf& leaf = ring_.leaf_at(node);
            if (not_beside(leaf, node.count, box) == 0) {
                odd ^= crossed_in_leaf(leaf, node.count, corner);
            } else if (cell.count == kRoom) {
                ++cell.count;
            } else {
                bool first_right = leaf.x[0] > box.x_high;
                bool last_right = leaf.x[node.count] > box.x_high;
                odd ^= (first_right & (node.first_y > corner.y)) ^
                       (last_right & (node.last_y > corner.y));
                cell.first_right |= std::uint32_t{first_right} << cell.count;
                cell.last_right |= std::uint32_t{last_right} << cell.count;
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
            for (std::size_t x = left; x <= right; ++x) {
                Index& known = known_[at(y) * at(columns_) + x];
                if (known >= 0) {
                    cells_[at(known)].leaves[0] = free_;
                    free_ = known;
                }
                known = kNone;
            }
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
    Array<Index> known_;  // by row and column: a cell, or on which side all of it lies, or kNone
    Array<Cell> cells_;
    Index free_ = kNone;  // the first cell that is not in use; their leaves[0] are the next ones
    Box frame_ = {};
    Index columns_ = 0, rows_ = 0;      // 0 while there is no grid
    double x_scale_ = 0, y_scale_ = 0;  // cells a unit
    double x_slack_ = 0, y_slack_ = 0;
    Index made_for_ = 0;  // vertices
};

}  // namespace flintknap
