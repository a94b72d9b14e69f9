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
// A cell is made by a walk down the tree that opens the boxes which meet C: when it is asked about,
// but for the first place of all, which the tree tells for less, unless most cells seem to be
// asked. It stays as it is while the leaves in it do: let B be a box of all that a splice took away
// and put in its place. If B does not meet C, no place of C has changed sides, nor has (1) for a
// listed leaf, so neither has the rest. The cells that meet B are forgotten. Cells with more leaves
// than there is room for are left to the tree; so is what is outside.
//
// A cell that is asked about again and again is drawn (raster.hpp), or sooner while nothing
// changes: then most places in it are told by one load, and so are most short segments; the others
// mostly by traces of the edges there (traces.hpp). One that no leaf meets is wholly on one side.
//
// Invariants (check): a cell that is known is what it would be if made now; the ring lies in the
// frame of the grid.
// Cost: a cell for every 16 vertices, 4 bytes each, and for one with leaves 128, drawn 1,024; none
// before somebody asks. To make one: O(log n) boxes on curves; to draw it: the edges in it. A
// place: a load or two, or the leaves of its cell. A splice: a write a cell in its box.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "grid.hpp"
#include "queries.hpp"
#include "raster.hpp"
#include "splices.hpp"
#include "traces.hpp"

namespace flintknap {

class Cells {
   public:
    static constexpr std::size_t kRoom = 28;
    static constexpr std::uint8_t kPatience = 4;  // questions before a cell is drawn
    // First places, without a change: from then on cells are soon drawn; of so many cells one, and
    // they are drawn at once.
    static constexpr std::size_t kQuiet = 64, kShare = 4;

    struct alignas(64) Cell {
        Index leaves[kRoom];
        std::uint32_t first_right, last_right;  // by leaf, as bits: ends right of the cell
        std::uint8_t count;                     // of leaves; kRoom + 1 if there are more
        std::uint8_t odd;
        std::uint8_t asked;  // how often, before it is drawn
        bool is_crowded() const { return count > kRoom; }
    };

    using Spot = Grid::Spot;

    explicit Cells(const Ring& ring) : ring_(ring) {}

    const Ring& ring() const { return ring_; }

    // The cell of a place in the box of the ring; nullptr if it is empty or crowded.
    const Cell* find(Point q) {
        if (!grid_.is_laid()) begin();
        Index known = made(grid_.column(q.x), grid_.row(q.y));
        return is_plain(known) || cell_of(known).is_crowded() ? nullptr : &cell_of(known);
    }

    // +1 inside, 0 on the boundary, -1 outside.
    int side(Point q) {
        if (!grid_.is_laid()) {
            if (ring_.empty()) return -1;
            begin();
        }
        if (!grid_.holds(q)) return -1;
        Spot at_q = grid_.spot(q);
        Index& cell_here = known_[grid_.place(at_q.column, at_q.row)];
        if (cell_here == kNone && places_ < known_.size() / kShare) {
            cell_here = kAsked;
            ++places_;
            return flintknap::side(ring_, q);
        }
        Index known = made(at_q.column, at_q.row);
        if (is_drawn(known)) {
            int told = side_drawn(known, at_q, q);
            if (told != Trace::kUntold) return told;
        } else if (is_plain(known)) {
            return known == kInside ? 1 : -1;
        }
        const Cell& cell = cell_of(known);
        if (cell.is_crowded()) return flintknap::side(ring_, q);
        note_question(at_q.column, at_q.row);
        return side_of(crossed(cell, q));
    }

    // A segment within two by two cells: its ends, and the rasters of these, by slots.
    struct Way {
        Spot first, last;
        const Raster* rasters[4];  // until something is drawn
        Raster::Sides plain;       // how all cells lie, if none has leaves

        static std::size_t slot(Index column, Index row) {
            return at((column & 1) + 2 * (row & 1));
        }
        const Raster& raster_at(const Spot& spot) const {
            return *rasters[slot(spot.column, spot.row)];
        }
        bool is_in_one_cell() const {
            return (first.column == last.column) & (first.row == last.row);
        }
        bool is_in_one_part() const {
            return is_in_one_cell() & (first.x == last.x) & (first.y == last.y);
        }
        // Between the ends.
        Spot spot(double t) const {
            return Grid::spot_at({first.parts.x + t * (last.parts.x - first.parts.x),
                                  first.parts.y + t * (last.parts.y - first.parts.y)});
        }
        // What a glance reads.
        [[gnu::always_inline]] void fetch() const {
            raster_at(first).fetch(first.y);
            raster_at(last).fetch(last.y);
            const Spot middle = spot(0.5);
            raster_at(middle).fetch(middle.y);
        }
    };
    // False if it is longer, or not in the frame. Else it is looked along next.
    bool locate(Point p, Point q, Way& way) {
        if (!grid_.is_laid()) begin();
        if (!grid_.holds(p) || !grid_.holds(q)) return false;
        way.first = grid_.spot(p), way.last = grid_.spot(q);
        int wide = way.last.column - way.first.column, high = way.last.row - way.first.row;
        return wide * wide <= 1 && high * high <= 1;
    }
    void look_along(Way& way) {
        const Spot &first = way.first, &last = way.last;
        Index one = made(first.column, first.row), other = made(last.column, last.row);
        Index third = made(first.column, last.row), fourth = made(last.column, first.row);
        bool is_one = is_plain(one) & (one == other) & (one == third) & (one == fourth);
        way.plain = !is_one ? 0 : one == kInside ? Raster::kInside : Raster::kOutside;
        if (is_one) return;
        way.rasters[Way::slot(first.column, first.row)] = &raster_of(one);
        way.rasters[Way::slot(last.column, last.row)] = &raster_of(other);
        way.rasters[Way::slot(first.column, last.row)] = &raster_of(third);
        way.rasters[Way::slot(last.column, first.row)] = &raster_of(fourth);
    }

    // On which sides some places of a segment lie; and kEdges, if edges may be near others.
    static Raster::Sides glance(const Way& way) {
        auto sides_of = [&](const Spot& s) { return way.raster_at(s).sides_of(s.x, s.y); };
        Raster::Sides seen = sides_of(way.first) | sides_of(way.last);
        for (double t : {0.25, 0.5, 0.75}) seen |= sides_of(way.spot(t));
        seen &= Raster::kSides;
        bool is_all = way.is_in_one_part() & (seen != 0);
        return seen | (is_all ? 0 : Raster::kEdges);
    }

    // What is asked next of a segment that a glance does not tell.
    [[gnu::always_inline]] void fetch_traces(const Way& way) const {
        for (const Spot* spot : {&way.first, &way.last}) {
            Index known = known_[grid_.place(spot->column, spot->row)];
            if (is_drawn(known)) drawings_[at(known)].traces[spot->y / Trace::kRows].fetch();
        }
    }

    // Whether a segment surely crosses an edge, or f(leaf, place) is true of one that it may meet;
    // nothing if traces do not tell.
    template <class F>
    std::optional<bool> any_met(const Way& way, F f) {
        note_question(way.first.column, way.first.row);
        if (!way.is_in_one_cell()) note_question(way.last.column, way.last.row);
        auto [left, right] = std::minmax({way.first.column, way.last.column});
        auto [low, high] = std::minmax({way.first.row, way.last.row});
        for (Index row = low; row <= high; ++row) {
            for (Index column = left; column <= right; ++column) {
                Index known = made(column, row);
                if (is_plain(known)) continue;
                if (!is_drawn(known)) return {};
                const Drawing& drawing = drawings_[at(known)];
                Point corner = grid_.corner(column, row);
                std::optional<bool> met = drawing.any_met(
                    way.first.parts - corner, way.last.parts - corner,
                    [&](std::size_t n, std::size_t i) {
                        const Origin& origin = origins_[at(known)];
                        Code code = origin.codes[n][i];
                        return f(ring_.leaf_in(origin.leaves[code.leaf()]), code.place());
                    });
                if (!met || *met) return met;
            }
        }
        return false;
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
                if (is_plain(known)) continue;
                const Cell& cell = cell_of(known);
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
        questions_ = places_ = 0;
    }

    std::size_t bytes() const {
        return cells_.capacity() * sizeof(Cell) + drawings_.capacity() * sizeof(Drawing) +
               origins_.capacity() * sizeof(Origin) + known_.capacity() * sizeof(Index);
    }

    // The first broken invariant, or nothing. O(n log n).
    std::string check() const {
        if (!grid_.is_laid()) return {};
        if (!grid_.fits(ring_)) return "the grid does not fit the ring";
        for (Index y = 0; y < grid_.rows(); ++y) {
            for (Index x = 0; x < grid_.columns(); ++x) {
                Index known = known_[grid_.place(x, y)];
                if (!is_made(known)) continue;
                Cell cell;
                make(cell, grid_.box(x, y));
                bool is_so = is_plain(known) ? cell.count == 0 && known == side_all_over(cell)
                                             : cell.count > 0 && are_alike(cell_of(known), cell);
                if (is_drawn(known)) {
                    Drawing drawing;
                    Origin origin;
                    draw(cell, drawing, origin, x, y);
                    is_so = is_so &&
                            are_alike(drawings_[at(known)], origins_[at(known)], drawing, origin);
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
    using Range = Grid::Range;
    using Drawing = Strips;
    // Which edges it is of.
    struct alignas(64) Origin {
        Strips::Codes codes;
        Index leaves[kRoom];  // of the cell, by their places among all
        Index cell;
    };

    // What is known of a cell: its drawing, or how it lies if it has no leaves, or kListed less its
    // number; or kNone, and kAsked if the tree has told of a place there.
    static constexpr Index kAsked = -2, kOutside = -3, kInside = -4, kListed = -5;
    static_assert(kNone == -1);  // next to kAsked: so is_made is one comparison

    static bool is_made(Index known) { return known != kNone && known != kAsked; }
    static bool is_drawn(Index known) { return known >= 0; }
    static bool is_plain(Index known) { return known == kOutside || known == kInside; }
    Index number(Index known) const {
        return is_drawn(known) ? origins_[at(known)].cell : kListed - known;
    }
    const Cell& cell_of(Index known) const { return cells_[at(number(known))]; }

    // Of cells that are not drawn: outside, inside, with leaves.
    inline static const Raster kPlain[] = {Raster::all(Raster::kOutside),
                                           Raster::all(Raster::kInside), Raster::all(0)};
    const Raster& raster_of(Index known) const {
        return is_drawn(known) ? drawings_[at(known)].raster
                               : kPlain[kOutside - std::max(known, kListed)];
    }

    void begin() {
        Grid grid;
        grid.lay(ring_);
        known_.assign(grid.size(), kNone);
        cells_.clear();
        drawings_.clear();
        origins_.clear();
        questions_ = places_ = 0;
        free_ = free_drawing_ = kNone;
        grid_ = grid;
    }

    // What is known of a cell, once it is made.
    Index made(Index column, Index row) {
        Index& known = known_[grid_.place(column, row)];
        if (!is_made(known)) known = make_one(grid_.box(column, row));
        return known;
    }
    [[gnu::noinline]] Index make_one(const Box& box) {  // apart: `made` is little but a load
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
        return kListed - n;
    }

    static Index side_all_over(const Cell& cell) { return cell.odd != 0 ? kInside : kOutside; }

    void note_question(Index column, Index row) {
        Index& known = known_[grid_.place(column, row)];
        if (!is_drawn(known) && !is_plain(known)) draw_if_due(known, column, row);
    }
    // One that is asked about again and again is drawn; or at once, if others are or all is quiet.
    [[gnu::noinline]] void draw_if_due(Index& known, Index column, Index row) {
        Cell& cell = cells_[at(number(known))];
        if (cell.is_crowded()) return;
        ++questions_;
        ++cell.asked;
        bool is_due = cell.asked >= kPatience || places_ >= kQuiet ||
                      questions_ >= (kPatience - 1) * cells_.size();
        if (!is_due) return;
        if (free_drawing_ == kNone) {
            drawings_.reserve(drawings_.size() + 1);
            origins_.reserve(drawings_.size() + 1);
            drawings_.push_back({});
            origins_.push_back({});
            origins_.back().cell = kNone;
            free_drawing_ = static_cast<Index>(drawings_.size()) - 1;
        }
        Index n = free_drawing_;
        free_drawing_ = std::exchange(origins_[at(n)].cell, number(known));
        draw(cell, drawings_[at(n)], origins_[at(n)], column, row);
        known = n;
    }

    // As far as raster and traces tell.
    int side_drawn(Index known, const Spot& spot, Point q) const {
        const Drawing& drawing = drawings_[at(known)];
        const Trace& trace = drawing.traces[spot.y / Trace::kRows];
        trace.fetch();
        int told = drawing.raster.side(spot.x, spot.y);
        if (told != 0) return told;
        Point origin = grid_.corner(spot.column, spot.row);
        origin.y += spot.y / Trace::kRows * Trace::kRows;
        return trace.side(spot.parts - origin, [&](std::size_t i) {
            const Origin& of = origins_[at(known)];
            Code code = of.codes[at(spot.y / Trace::kRows)][i];
            auto [a, b] = edge_of(ring_.leaf_in(of.leaves[code.leaf()]), code.place());
            return orient(a, b, q);
        });
    }

    void draw(const Cell& cell, Drawing& drawing, Origin& origin, Index column, Index row) const {
        drawing.clear();
        const Box around = grid_.box(column, row);
        for (std::size_t i = 0; i < cell.count; ++i) {
            const Ring::Node& n = ring_.node(cell.leaves[i]);
            const Ring::Leaf& leaf = ring_.leaf_at(n);
            origin.leaves[i] = n.left;
            for (std::int64_t left = not_beside(leaf, n.count, around); left != 0;
                 left &= left - 1) {
                int e = lowest(left);
                Point a = grid_.in_raster({leaf.x[e], leaf.y[e]}, column, row);
                Point b = grid_.in_raster({leaf.x[e + 1], leaf.y[e + 1]}, column, row);
                drawing.add(a, b, Code(i, e), origin.codes);
            }
        }
        drawing.settle([&](int x, int y) {
            Point q = grid_.middle(column, row, x, y);
            Point there = grid_.in_raster(q, column, row);  // elsewhere if doubles are far between
            bool is_there = Raster::part(there.x) == x && Raster::part(there.y) == y &&
                            grid_.column(q.x) == column && grid_.row(q.y) == row;
            return is_there ? side_of(crossed(cell, q)) : 0;
        });
    }

    void make(Cell& cell, const Box& box) const {
        cell.count = cell.asked = cell.odd = 0;
        cell.first_right = cell.last_right = 0;
        Point corner = {box.x_low, box.y_low};
        const Ring::Node& root = ring_.node(ring_.root());
        if (overlap(root.box, box)) {
            list(cell, box, ring_.root());
        } else {
            cell.odd = static_cast<std::uint8_t>(crossed_at_right(root, corner));
        }
    }

    // Those below a node that meets the box. First come, first served, as in queries.hpp: so what
    // is read next is fetched meanwhile.
    void list(Cell& cell, const Box& box, Index top) const {
        constexpr int room = 64;  // enough nearly always
        Point corner = {box.x_low, box.y_low};
        Index entered[room];
        int count = 0;
        entered[count++] = top;
        unsigned odd = 0;
        for (int i = 0; i < count && !cell.is_crowded(); ++i) {
            const Ring::Node& node = ring_.node(entered[i]);
            if (node.right == kNone) {
                odd ^= list_leaf(cell, box, entered[i]);
                continue;
            }
            for (Index child : {node.left, node.right}) {
                const Ring::Node& c = ring_.node(child);
                if (!overlap(c.box, box)) {
                    odd ^= crossed_at_right(c, corner);
                } else if (count == room) {
                    list(cell, box, child);
                } else {
                    entered[count++] = child;
                    if (c.right == kNone) ring_.leaf_at(c).fetch(c.count);
                }
            }
        }
        cell.odd ^= static_cast<std::uint8_t>(odd);
    }
    // Returns what it is to the rest.
    unsigned list_leaf(Cell& cell, const Box& box, Index n) const {
        const Ring::Node& node = ring_.node(n);
        const Ring::Leaf& leaf = ring_.leaf_at(node);
        Point corner = {box.x_low, box.y_low};
        if (not_beside(leaf, node.count, box) == 0) {
            return crossed_in_leaf(leaf, node.count, corner) & kOdd;
        }
        if (cell.count == kRoom) {
            ++cell.count;
            return 0;
        }
        bool first_right = leaf.x[0] > box.x_high, last_right = leaf.x[node.count] > box.x_high;
        cell.first_right |= std::uint32_t{first_right} << cell.count;
        cell.last_right |= std::uint32_t{last_right} << cell.count;
        cell.leaves[cell.count++] = n;
        return (first_right & (node.first_y > corner.y)) ^ (last_right & (node.last_y > corner.y));
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
                if (!is_made(known) || is_plain(known)) {
                    known = kNone;
                    continue;
                }
                Index cell = number(known);
                if (is_drawn(known)) {
                    origins_[at(known)].cell = free_drawing_;
                    free_drawing_ = known;
                }
                cells_[at(cell)].leaves[0] = free_;
                free_ = cell;
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
    static bool are_alike(const Drawing& a, const Origin& of_a, const Drawing& b,
                          const Origin& of_b) {
        return Strips::are_alike(
            a, of_a.codes, [&](std::size_t leaf) { return of_a.leaves[leaf]; },  //
            b, of_b.codes, [&](std::size_t leaf) { return of_b.leaves[leaf]; });
    }

    const Ring& ring_;
    Array<Index> known_;  // by row and column: a cell, or on which side all of it lies, or kNone
    Array<Cell> cells_;
    Array<Drawing> drawings_;
    Array<Origin> origins_;  // of drawings
    // Since something changed: questions about cells not drawn yet, first places of cells.
    std::size_t questions_ = 0, places_ = 0;
    // The first that are not in use; the next ones are leaves[0] of cells, `cell` of origins.
    Index free_ = kNone, free_drawing_ = kNone;
    Grid grid_;
};

}  // namespace flintknap
