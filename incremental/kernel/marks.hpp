// Which edges come near a part of a raster, where that is one alone, or two that meet.
//
// Theory. Let P be a part, widened by more than all rounding and by less than the margin, so that
// edges that do not come near it (raster.hpp) do not meet P. A mark is made where each edge that
// comes near surely meets P, and these are
//
//      one edge: its ends lie beyond P, for else the next edge came near, too. So it cuts P in two,
//                and on which side of the ring a place of P lies, its orientation tells.
//      uv, vw:   u and w lie beyond P. If v lies in P, the ring cuts P along both edges; if not,
//                each of them cuts P from side to side, and their lines do not cross in P.
//                In either case a place of P is inside iff v is left behind to the left: left of
//                both edges if the ring turns left at v, of one if it turns right.
//
// This takes a ring that is simple and runs counter-clockwise, as boundaries are.
//
// Edges are told by the leaf, by its number in the list of the cell, and by the place there.
// Cost: 832 bytes a cell. A place: three loads one after another, and an orientation.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "queries.hpp"
#include "raster.hpp"

namespace flintknap {

class Mark {
   public:
    Mark() = default;
    Mark(std::size_t leaf, int place)
        : code_(static_cast<std::uint16_t>(static_cast<int>(leaf) << 6 | place << 1)) {}

    std::size_t leaf() const { return at(code_ >> 6); }
    Index place() const { return code_ >> 1 & 31; }
    // Whether it is two edges, the one at `place` and the next one.
    bool is_corner() const { return (code_ & 1) != 0; }
    bool operator==(Mark other) const { return code_ == other.code_; }

    // ---------------------------------------------------------------- to gather them
    static Mark none() { return Mark(0xffff); }
    static Mark many() { return Mark(0xfffe); }
    bool is_edges() const { return code_ < 0xfffe; }
    // Of what was marked so far and one edge more. No branches: they could not be foreseen.
    Mark with(Mark edge) const {
        Mark both = code_ + 2 == edge.code_ ? Mark(code_ | 1) : many();
        return code_ == none().code_ ? edge : both;
    }

   private:
    explicit Mark(int code) : code_(static_cast<std::uint16_t>(code)) {}

    std::uint16_t code_;
};

// Of a place in a part so marked: +1 inside, 0 on the boundary, -1 outside.
inline int side(const Ring::Leaf& leaf, Mark mark, Point q) {
    const double *x = leaf.x + mark.place(), *y = leaf.y + mark.place();
    Point u = {x[0], y[0]}, v = {x[1], y[1]};
    int first = orient(u, v, q);
    if (!mark.is_corner()) return first;
    Point w = {x[2], y[2]};
    int second = orient(v, w, q);
    if ((first == 0 && box_of(u, v).holds(q)) || (second == 0 && box_of(v, w).holds(q))) return 0;
    return leads_out(u, v, w, q) ? -1 : 1;
}

// The marks of a cell, row after row.
class Marks {
   public:
    static constexpr std::size_t kLeaves = 28, kRoom = 327;

    // What `find` and `leaf` read first is fetched: where it is known long before it is needed.
    void fetch() const { __builtin_prefetch(before_); }
    void fetch_leaves() const {
        __builtin_prefetch(leaves_);
        __builtin_prefetch(leaves_ + kLeaves - 1);
    }

    Mark find(const Raster& raster, int column, int row) const {
        return marks_[before_[at(row)] + at(raster.marked_before(row, column))];
    }
    Index leaf(Mark mark) const { return leaves_[mark.leaf()]; }

   private:
    friend class Sketch;

    std::uint16_t before_[Raster::kSide];  // marks of earlier rows
    Index leaves_[kLeaves];                // the places of leaves among all
    Mark marks_[kRoom + 1];                // the last one is written only
};

// Gathers which edges come near the parts of a raster.
class Sketch {
   public:
    Sketch() { near_.fill(Mark::none()); }

    // Parts of a row, as bits: those that an edge comes near, and those of them it surely meets.
    void add(Mark edge, int row, std::uint32_t near, std::uint32_t met) {
        for (; near != 0; near &= near - 1) {
            int column = lowest(near);
            Mark& mark = near_[at(row * Raster::kSide + column)];
            mark = (met >> column & 1) != 0 ? mark.with(edge) : Mark::many();
        }
    }

    // Makes marks as far as there is room. leaf(i) is the place of the cell's leaf i.
    template <class Leaf>
    void finish(Raster& raster, Marks& marks, std::size_t leaves, Leaf leaf) const {
        std::size_t count = 0;
        for (std::size_t i = 0; i < leaves; ++i) marks.leaves_[i] = leaf(i);
        for (int row = 0; row < Raster::kSide; ++row) {
            marks.before_[at(row)] = static_cast<std::uint16_t>(count);
            std::uint32_t marked = 0;
            for (std::uint32_t left = raster.unclear(row); left != 0; left &= left - 1) {
                int column = lowest(left);
                Mark mark = near_[at(row * Raster::kSide + column)];
                bool is_told = mark.is_edges() & (count < Marks::kRoom);
                marks.marks_[count] = mark;
                count += is_told;
                marked |= std::uint32_t{is_told} << column;
            }
            raster.mark(row, marked);
        }
    }

   private:
    std::array<Mark, Raster::kSide * Raster::kSide> near_;
};

}  // namespace flintknap
