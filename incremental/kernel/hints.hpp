// Where to start a walk: a tree of grids that knows a site near any place.
//
// Theory. The bits of a double, read as an integer with the sign turned about, are in the order of
// the numbers. So the leading bits of x and y name a cell of the plane: two bits of each choose one
// of 4 x 4 cells, the next two one of the cells in that, down to a single number after 32 steps.
// Cells are finest about zero, where doubles are; no extent, no scale, no growth is to be kept.
// Each node is one such grid and one cache line: a cell holds nothing, one site, or a finer node.
// The sites given to it are a sample; a look-up descends to the last non-empty cell that holds the
// query and answers with a site there. Its depth follows the local density, about log4 of the
// sample on uniform sets and log2 on a curve, where a flat grid would crowd a few cells.
//
// It is only ever a hint: a bad answer costs time, never the result.
// Cost: O(depth) to add and to look up, depth at most 32; 64 bytes a node.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <vector>

#include "mesh.hpp"
#include "predicates.hpp"

namespace flintknap {

class Hints {
   public:
    // Room for any one add, so that it cannot fail.
    void make_room() {
        nodes_.reserve(nodes_.size() + kSteps + 1);
        free_.reserve(nodes_.capacity());  // so that remove cannot fail, either
    }

    // Adds a site at p, which none of the sites added before equals.
    template <class Sites>
    void add(Point p, Index site, const Sites& sites) {
        if (nodes_.empty()) nodes_.push_back(kEmpty);
        Cursor cursor(p);
        for (Index node = 0;;) {
            std::size_t cell = cursor.step();
            Index there = nodes_[at(node)][cell];
            if (there == kNone) {
                nodes_[at(node)][cell] = site;
                return;
            }
            if (there >= 0) {  // one site lives here already: cut the cell, move it down
                Cursor other(sites[at(there)]);
                while (other.steps < cursor.steps) other.step();
                Node finer = kEmpty;
                finer[other.step()] = there;
                there = link(make_node(finer));
                nodes_[at(node)][cell] = there;
            }
            node = link(there);
        }
    }

    // Forgets a site at p, if it was added; nodes left empty go with it.
    void remove(Point p, Index site) {
        if (nodes_.empty()) return;
        std::array<Index, kSteps> node;
        std::array<std::size_t, kSteps> cell;
        Cursor cursor(p);
        Index next = 0;
        int depth = -1;
        do {
            ++depth;
            node[at(depth)] = next;
            cell[at(depth)] = cursor.step();
            next = link(nodes_[at(next)][cell[at(depth)]]);
        } while (next >= 0);
        if (link(next) != site) return;
        for (;; --depth) {
            Node& cells = nodes_[at(node[at(depth)])];
            cells[cell[at(depth)]] = kNone;
            if (depth == 0 || cells != kEmpty) return;
            free_.push_back(node[at(depth)]);
        }
    }

    // A site near p, or kNone if there is none at all.
    Index near(Point p) const {
        if (nodes_.empty()) return kNone;
        Cursor cursor(p);
        for (Index node = 0;;) {
            const Node& cells = nodes_[at(node)];
            Index there = cells[cursor.step()];
            // no node is empty, but for the root
            for (std::size_t c = 0; there == kNone && c < cells.size(); ++c) there = cells[c];
            if (there == kNone) return kNone;
            if (there >= 0) return there;
            node = link(there);
        }
    }

    template <class Archive>
    void transfer(Archive& archive) {
        archive(nodes_);
        archive(free_);
    }

    std::size_t bytes() const {
        return nodes_.capacity() * sizeof(Node) + free_.capacity() * sizeof(Index);
    }

   private:
    static constexpr int kSteps = 32;

    // A cell: kNone, a site >= 0, or link(node) <= -2.
    using Node = std::array<Index, 16>;
    static constexpr Node kEmpty = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};
    static Index link(Index node) { return -2 - node; }

    Index make_node(const Node& node) {
        if (free_.empty()) {
            nodes_.push_back(node);
            return static_cast<Index>(nodes_.size()) - 1;
        }
        Index n = free_.back();
        free_.pop_back();
        nodes_[at(n)] = node;
        return n;
    }

    // Walks down the cells that hold one place.
    struct Cursor {
        std::uint64_t x, y;
        int steps = 0;

        explicit Cursor(Point p) : x(ordered(p.x)), y(ordered(p.y)) {}

        static std::uint64_t ordered(double v) {
            std::uint64_t bits;
            std::memcpy(&bits, &v, sizeof bits);
            return bits >> 63 ? ~bits : bits | 1ULL << 63;
        }
        std::size_t step() {
            std::size_t cell = (x >> 62) << 2 | y >> 62;
            x <<= 2;
            y <<= 2;
            ++steps;
            return cell;
        }
    };

    Array<Node> nodes_;
    Array<Index> free_;  // nodes not in use
};

}  // namespace flintknap
