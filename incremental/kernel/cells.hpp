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
// by one load, and so are most short segments; the others mostly by an edge that is marked where
// they lie (marks.hpp). One that no leaf meets is wholly on one side.
//
// Invariants (check): a cell that is known is what it would be if made now; the ring lies in the
// frame of the grid.
// Cost: a cell for every 16 vertices, 4 bytes each, and for one with leaves 384, drawn 1,216; none
// before somebody asks. To make one: O(log n) boxes on curves; to draw it: the edges in it. A
// place: a load, or an edge, or the leaves of its cell. A splice: a write a cell in its box.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "grid.hpp"
#include "marks.hpp"
#include "queries.hpp"
#include "raster.hpp"
#include "splices.hpp"

namespace flintknap {

class Cells {
   public:
    static constexpr std::size_t kRoom = Marks::kLeaves;
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
        if (!grid_.is_laid()) begin();
        Index known = made(grid_.column(q.x), grid_.row(q.y));
        return known < 0 || cells_[at(known)].is_crowded() ? nullptr : &cells_[at(known)];
    }

    // +1 inside, 0 on the boundary, -1 outside.
    int side(Point q) {
        if (!grid_.is_laid()) {
            if (ring_.empty()) return -1;
            begin();
        }
        if (!grid_.holds(q)) return -1;
        Spot at_q = grid_.spot(q);
        Index known = made(at_q.column, at_q.row);
        if (known < 0) return known == kInside ? 1 : -1;
        Cell& cell = cells_[at(known)];
        int told = side_at(known, at_q, q);
        if (told != kUntold) return told;
        if (cell.is_crowded()) return flintknap::side(ring_, q);
        note_question(known, at_q.column, at_q.row);
        return side_of(crossed(cell, q));
    }

    // What a segment comes by, as bits of Raster: its sides, and kEdges if there may be some, or
    // the way is long, or there is no need to know because it comes by both sides.
    unsigned along(Point p, Point q) {
        if (!grid_.is_laid()) begin();
        if (!grid_.holds(p) || !grid_.holds(q)) return Raster::kEdges;
        Spot first = grid_.spot(p), last = grid_.spot(q);
        int wide = last.column - first.column, high = last.row - first.row;
        if (wide * wide > 1 || high * high > 1) return Raster::kEdges;
        Index one = made(first.column, first.row), other = made(last.column, last.row);
        Index third = made(first.column, last.row), fourth = made(last.column, first.row);
        if (one < 0 && one == other && one == third && one == fourth) return kind(one);
        unsigned seen = kind_at(first) | kind_at(last);
        double x = last.parts.x - first.parts.x, y = last.parts.y - first.parts.y;
        for (double t : {0.25, 0.5, 0.75}) {  // no branches: they could not be foreseen
            seen |= kind_at(grid_.spot_at({first.parts.x + t * x, first.parts.y + t * y}));
        }
        if (Raster::are_both(seen)) return seen;
        note_question(one, first.column, first.row);
        note_question(other, last.column, last.row);
        pass_along(first, last, [&](Index known, const Raster::Slant& here) {
            if (known >= 0) {
                seen |= cells_[at(known)].raster.along(here);
            } else if (Raster::is_met(here)) {
                seen |= kind(known);
            }
            return Raster::are_both(seen);
        });
        return seen;
    }

    // Calls f(leaf, n, place) for edges, among them all that meet a short segment, until it returns
    // true. Returns whether it did; nothing if marks do not tell all edges.
    template <class F>
    std::optional<bool> visit_along(Point p, Point q, F f) {
        if (!grid_.is_laid()) begin();
        if (!grid_.holds(p) || !grid_.holds(q)) return {};
        bool is_done = false, is_all = true;
        auto look_at = [&](Index known, const Raster::Slant& here) {
            if (known < 0) return false;
            const Cell& cell = cells_[at(known)];
            Mark last = Mark::none();
            Raster::trace(here, [&](int row, double from, double to) {
                std::uint32_t left = Raster::span(from, to) & cell.raster.unclear(row);
                is_all = is_all && (left & ~cell.raster.marked(row)) == 0;
                for (; is_all && !is_done && left != 0; left &= left - 1) {
                    const Marks& marks = marks_[at(known)];
                    Mark mark = marks.find(cell.raster, lowest(left), row);
                    if (mark == last) continue;
                    last = mark;
                    Index n = cell.leaves[mark.leaf()];
                    const Ring::Leaf& leaf = ring_.leaf_in(marks.leaf(mark));
                    is_done = f(leaf, n, mark.place()) ||
                              (mark.is_corner() && f(leaf, n, mark.place() + 1));
                }
                return is_done || !is_all;
            });
            return is_done || !is_all;
        };
        bool is_short = pass_along(grid_.spot(p), grid_.spot(q), look_at);
        return is_done || (is_short && is_all) ? std::optional<bool>(is_done) : std::nullopt;
    }

    // Calls f(leaf) for leaves, until it returns true. Returns whether it did, or these are all
    // that have anything in a box; false if the box is large, or somewhere crowded.
    template <class F>
    bool visit(const Box& box, F f) {
        if (!grid_.is_laid()) begin();
        Range cells = grid_.range(box);
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
        Box b = grid_.box(grid_.column(q.x), grid_.row(q.y));
        double x = std::min(q.x - b.x_low, b.x_high - q.x);
        double y = std::min(q.y - b.y_low, b.y_high - q.y);
        double least = std::min(x, y);
        return least > 0 && least * least > square;
    }

    // Forgets what a splice has changed.
    void follow(const Splices& splices) {
        if (!grid_.is_laid()) return;
        if (splices.changed_all() || !grid_.fits(ring_)) {
            grid_.clear();
            return;
        }
        for (const Box& b : splices.changed()) forget(b);
        questions_ = 0;
    }

    std::size_t bytes() const {
        return cells_.capacity() * sizeof(Cell) + marks_.capacity() * sizeof(Marks) +
               known_.capacity() * sizeof(Index);
    }

    // The first broken invariant, or nothing. O(n log n).
    std::string check() const {
        if (!grid_.is_laid()) return {};
        if (!grid_.fits(ring_)) return "the grid does not fit the ring";
        for (Index y = 0; y < grid_.rows(); ++y) {
            for (Index x = 0; x < grid_.columns(); ++x) {
                Index known = known_[grid_.place(x, y)];
                if (known == kNone) continue;
                Cell cell;
                make(cell, grid_.box(x, y));
                bool is_so = known == (cell.count > 0 ? known : side_all_over(cell));
                if (known >= 0) {
                    const Cell& old = cells_[at(known)];
                    Marks marks;
                    if (old.is_drawn()) draw(cell, marks, x, y);
                    is_so = is_so && are_alike(old, cell) && old.raster == cell.raster;
                    is_so = is_so &&
                            (!old.is_drawn() || are_alike(marks_[at(known)], marks, cell.raster));
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
    using Spot = Grid::Spot;
    using Range = Grid::Range;

    // Rasters of cells without leaves.
    inline static const Raster kPlain[] = {Raster::all(false), Raster::all(true)};

    // Of a cell without leaves.
    static constexpr Index kOutside = -2, kInside = -3;
    static_assert(kNone == -1);

    void begin() {
        Grid grid;
        grid.lay(ring_);
        known_.assign(grid.size(), kNone);
        cells_.clear();
        marks_.clear();
        questions_ = 0;
        free_ = kNone;
        grid_ = grid;
    }

    // What is known of a cell, once it is made.
    Index made(Index column, Index row) {
        Index& known = known_[grid_.place(column, row)];
        if (known == kNone) known = make_one(grid_.box(column, row));
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

    // One that is asked about again and again is drawn; or at once, if all others nearly are.
    void note_question(Index known, Index column, Index row) {
        if (known < 0) return;
        Cell& cell = cells_[at(known)];
        if (cell.is_drawn() || cell.is_crowded()) return;
        ++questions_;
        bool is_due = cell.asked + 1 == kPatience || questions_ >= (kPatience - 1) * cells_.size();
        if (!is_due) {
            ++cell.asked;
            return;
        }
        if (at(known) >= marks_.size()) marks_.resize(cells_.size());
        draw(cell, marks_[at(known)], column, row);
        cell.asked = kPatience;
    }

    // Of a place in a cell, as far as its raster and its marks tell.
    static constexpr int kUntold = 2;
    int side_at(Index known, const Spot& spot, Point q) const {
        const Raster& raster = cells_[at(known)].raster;
        if (at(known) < marks_.size()) marks_[at(known)].fetch();
        int told = raster.side(spot.x, spot.y);
        if (told != Raster::kMarked) return told != 0 ? told : kUntold;
        const Marks& marks = marks_[at(known)];
        marks.fetch_leaves();
        Mark mark = marks.find(raster, spot.x, spot.y);
        return flintknap::side(ring_.leaf_in(marks.leaf(mark)), mark, q);
    }

    // Calls f(known, slant as seen there) for the cells that a segment may meet until it returns
    // true. False if these are not within two by two.
    template <class F>
    bool pass_along(const Spot& first, const Spot& last, F f) {
        auto [left, right] = std::minmax({first.column, last.column});
        auto [low, high] = std::minmax({first.row, last.row});
        if (right - left > 1 || high - low > 1) return false;
        const Raster::Slant way(first.parts, last.parts, Raster::kMargin / 2);
        for (Index y = low; y <= high; ++y) {
            for (Index x = left; x <= right; ++x) {
                if (f(made(x, y), way.from(grid_.corner(x, y)))) return true;
            }
        }
        return true;
    }

    // The same as bits of Raster; of a place in parts of rasters, nothing where edges are near.
    static unsigned kind(Index known) {
        return known == kInside    ? Raster::kInside
               : known == kOutside ? Raster::kOutside
                                   : Raster::kEdges;
    }
    unsigned kind_at(const Spot& spot) const {
        Index known = known_[grid_.place(spot.column, spot.row)];
        const Raster* raster = known >= 0 ? &cells_[at(known)].raster : &kPlain[known == kInside];
        return raster->kind(spot.x, spot.y);
    }

    void draw(Cell& cell, Marks& marks, Index column, Index row) const {
        Raster& raster = cell.raster;
        Sketch sketch;
        raster.clear();
        const Box around = grid_.box(column, row);
        for (std::size_t i = 0; i < cell.count; ++i) {
            const Ring::Node& n = ring_.node(cell.leaves[i]);
            const Ring::Leaf& leaf = ring_.leaf_at(n);
            for (std::int64_t left = not_beside(leaf, n.count, around); left != 0;
                 left &= left - 1) {
                int e = lowest(left);
                raster.add(grid_.in_raster({leaf.x[e], leaf.y[e]}, column, row),
                           grid_.in_raster({leaf.x[e + 1], leaf.y[e + 1]}, column, row),
                           [&](int r, std::uint32_t near, std::uint32_t met) {
                               sketch.add(Mark(i, e), r, near, met);
                           });
            }
        }
        raster.settle([&](int x, int y) {
            Point q = grid_.middle(column, row, x, y);
            Point there = grid_.in_raster(q, column, row);  // elsewhere if doubles are far between
            bool is_there = Raster::part(there.x) == x && Raster::part(there.y) == y &&
                            grid_.column(q.x) == column && grid_.row(q.y) == row;
            return is_there ? side_of(crossed(cell, q)) : 0;
        });
        sketch.finish(raster, marks, cell.count,
                      [&](std::size_t i) { return ring_.node(cell.leaves[i]).left; });
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
        Range cells = grid_.around(b);
        for (Index y = cells.low; y <= cells.high; ++y) {
            for (Index x = cells.left; x <= cells.right; ++x) {
                Index& known = known_[grid_.place(x, y)];
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
    static bool are_alike(const Marks& a, const Marks& b, const Raster& raster) {
        for (int row = 0; row < Raster::kSide; ++row) {
            for (std::uint32_t left = raster.marked(row); left != 0; left &= left - 1) {
                Mark m = a.find(raster, lowest(left), row), n = b.find(raster, lowest(left), row);
                if (a.leaf(m) != b.leaf(n) || m.place() != n.place() ||
                    m.is_corner() != n.is_corner())
                    return false;
            }
        }
        return true;
    }

    const Ring& ring_;
    Array<Index> known_;  // by row and column: a cell, or on which side all of it lies, or kNone
    Array<Cell> cells_;
    Array<Marks> marks_;         // of cells that are drawn
    std::size_t questions_ = 0;  // about cells not drawn yet, since something changed
    Index free_ = kNone;  // the first cell that is not in use; their leaves[0] are the next ones
    Grid grid_;
};

}  // namespace flintknap
