// Where to start a walk: a tree of grids that knows a site near any place.
//
// Theory. Each node cuts its square into 4 x 4 cells and is one cache line: a cell holds nothing,
// one site, or a finer node. The sites given to it are a sample; a look-up descends to the last
// non-empty cell that holds the query and answers with a site there, so its depth follows the
// local density: about log4 of the sample on uniform sets and log2 on a curve, where one flat grid
// would crowd a few cells with everything. A site outside the root's square makes the root a cell
// of a square four times as wide.
//
// It is only ever a hint: a bad answer costs time, never the result.
// Cost: O(depth) to add and to look up, depth at most kDeepest; 64 bytes a node.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "mesh.hpp"
#include "predicates.hpp"

namespace flintknap {

class Hints {
   public:
    static constexpr int kDeepest = 26;

    template <class Sites>
    void add(Point p, Index site, const Sites& sites) {
        if (nodes_.empty()) {
            nodes_.push_back(kEmpty);
            corner_ = p;
            width_ = 0;
        }
        if (width_ == 0 && !(p == corner_)) frame(p, sites);
        if (width_ != 0) grow(p);
        Cursor at_cell(*this, p);
        Index node = 0;
        for (int depth = 0;; ++depth) {
            std::size_t cell = at_cell.next();
            Index there = nodes_[at(node)][cell];
            if (there == kNone || depth >= kDeepest) {
                nodes_[at(node)][cell] = site;
                return;
            }
            if (there >= 0) {  // one site lives here already: cut the cell, move it down
                nodes_.push_back(kEmpty);
                Cursor other(*this, sites[at(there)]);
                for (int d = 0; d <= depth; ++d) other.next();
                nodes_.back()[other.next()] = there;
                there = link(static_cast<Index>(nodes_.size()) - 1);
                nodes_[at(node)][cell] = there;
            }
            node = link(there);
        }
    }

    // A site near p, or kNone if there is none at all.
    Index near(Point p) const {
        if (nodes_.empty()) return kNone;
        Cursor at_cell(*this, p);
        Index node = 0;
        for (;;) {
            const Node& cells = nodes_[at(node)];
            Index there = cells[at_cell.next()];
            if (there == kNone) {  // any neighbour in this node is about a cell away
                for (Index c : cells) {
                    if (c >= 0) return c;
                    if (c != kNone) there = c;
                }
            }
            if (there >= 0) return there;
            node = link(there);
        }
    }

    // Room for any one add, so that it cannot fail: the admissible range spans 2^400.
    void make_room() {
        constexpr std::size_t most = kDeepest + 200 + 2;
        if (nodes_.capacity() < nodes_.size() + most) nodes_.reserve(2 * nodes_.size() + most);
    }
    std::size_t bytes() const { return nodes_.capacity() * sizeof(Node); }

   private:
    // A cell: kNone, a site >= 0, or link(node) <= -2.
    using Node = std::array<Index, 16>;
    static constexpr Node kEmpty = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};
    static Index link(Index node) { return -2 - node; }

    // Walks down the cells that hold one place.
    struct Cursor {
        double x, y;
        Cursor(const Hints& h, Point p)
            : x(fraction(p.x - h.corner_.x, h.width_)), y(fraction(p.y - h.corner_.y, h.width_)) {}
        static double fraction(double offset, double width) {
            constexpr double below_one = 1 - 1.0 / (1ULL << 53);
            return offset > 0 ? std::min(offset / width, below_one) : 0;
        }
        std::size_t next() {
            x *= 4;
            y *= 4;
            int column = static_cast<int>(x), row = static_cast<int>(y);
            x -= column;
            y -= row;
            return static_cast<std::size_t>(4 * row + column);
        }
    };

    bool holds(Point p) const {
        return p.x >= corner_.x && p.y >= corner_.y && p.x - corner_.x < width_ &&
               p.y - corner_.y < width_;
    }

    // The second place fixes the scale: the root's square, till then of no width, gets one.
    template <class Sites>
    void frame(Point p, const Sites& sites) {
        Index first = nodes_[0][0];
        double spread = std::max(std::fabs(p.x - corner_.x), std::fabs(p.y - corner_.y));
        width_ = 4 * spread;
        corner_ = {corner_.x - 2 * spread, corner_.y - 2 * spread};
        nodes_[0] = kEmpty;
        if (first >= 0) nodes_[0][Cursor(*this, sites[at(first)]).next()] = first;
    }

    //   the old square becomes a cell of a square four times as wide, on the side away from p
    void grow(Point p) {
        while (!holds(p)) {
            std::size_t column = p.x < corner_.x ? 3 : 0, row = p.y < corner_.y ? 3 : 0;
            nodes_.push_back(nodes_[0]);
            corner_.x -= static_cast<double>(column) * width_;
            corner_.y -= static_cast<double>(row) * width_;
            width_ *= 4;
            nodes_[0] = kEmpty;
            nodes_[0][4 * row + column] = link(static_cast<Index>(nodes_.size()) - 1);
        }
    }

    std::vector<Node> nodes_;
    Point corner_ = {0, 0};
    double width_ = 0;
};

}  // namespace flintknap
