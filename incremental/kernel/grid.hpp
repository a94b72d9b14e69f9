// Cells of a grid over a ring, and the parts of their rasters: which of them a place lies in.
//
// Theory. Cells are about square, one for every 16 vertices, in a frame that is wider than the ring
// by a margin, so that it seldom outgrows it. Coordinates in parts are one affine map of those of
// the plane, evaluated in doubles; of places in the frame they are off by 2^-21 at most. A cell's
// box is larger than the places in it by more than all rounding.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "raster.hpp"
#include "ring.hpp"

namespace flintknap {

class Grid {
   public:
    // Where a place in the frame is: in parts of rasters, its cell, and its part there.
    struct Spot {
        Point parts;
        Index column, row;
        int x, y;
    };
    // Of cells.
    struct Range {
        Index left, right, low, high;
        bool is_small() const { return right - left <= 1 && high - low <= 1; }
    };

    bool is_laid() const { return columns_ > 0; }
    void clear() { columns_ = rows_ = 0; }
    void lay(const Ring& ring) {
        const Box& b = ring.node(ring.root()).box;
        double width = b.x_high - b.x_low, height = b.y_high - b.y_low;
        frame_ = {b.x_low - kMargin * width, b.y_low - kMargin * height, b.x_high + kMargin * width,
                  b.y_high + kMargin * height};
        double wanted = ring.size() / kShare + 1;
        double across = std::sqrt(wanted) * std::sqrt(width / height);
        columns_ = static_cast<Index>(std::max(1.0, std::min(across, wanted)));
        rows_ = static_cast<Index>(wanted) / columns_ + 1;
        x_scale_ = columns_ / (frame_.x_high - frame_.x_low);
        y_scale_ = rows_ / (frame_.y_high - frame_.y_low);
        Point corner = Grid::corner(columns_, rows_);
        rim_ = {std::nextafter(corner.x, 0.0), std::nextafter(corner.y, 0.0)};
        x_slack_ = slack(frame_.x_low, frame_.x_high, columns_);
        y_slack_ = slack(frame_.y_low, frame_.y_high, rows_);
        made_for_ = ring.size();
    }

    // Whether the grid holds the ring, and is neither too coarse nor too large for it.
    bool fits(const Ring& ring) const {
        if (ring.empty() || ring.size() / 2 > made_for_) return false;
        const Box& b = ring.node(ring.root()).box;
        if (!holds({b.x_low, b.y_low}) || !holds({b.x_high, b.y_high})) return false;
        return std::max((b.x_high - b.x_low) * x_scale_ / columns_,
                        (b.y_high - b.y_low) * y_scale_ / rows_) >= 0.25;
    }

    Index columns() const { return columns_; }
    Index rows() const { return rows_; }
    std::size_t size() const { return at(columns_) * at(rows_); }
    std::size_t place(Index column, Index row) const { return at(row) * at(columns_) + at(column); }
    bool holds(Point q) const { return frame_.holds(q); }
    Index column(double x) const { return cut((x - frame_.x_low) * x_scale_, columns_); }
    Index row(double y) const { return cut((y - frame_.y_low) * y_scale_, rows_); }

    // The cells that a box meets; those whose boxes it meets.
    Range range(const Box& b) const {
        return {column(b.x_low), column(b.x_high), row(b.y_low), row(b.y_high)};
    }
    Range around(const Box& b) const {
        return range({b.x_low - 2 * x_slack_, b.y_low - 2 * y_slack_, b.x_high + 2 * x_slack_,
                      b.y_high + 2 * y_slack_});
    }
    Box box(Index column, Index row) const {
        double x = (frame_.x_high - frame_.x_low) / columns_;
        double y = (frame_.y_high - frame_.y_low) / rows_;
        return {frame_.x_low + column * x - x_slack_, frame_.y_low + row * y - y_slack_,
                frame_.x_low + (column + 1) * x + x_slack_,
                frame_.y_low + (row + 1) * y + y_slack_};
    }

    // Of a place in the frame; rounding may have put it on the upper rim, which is in no cell.
    Spot spot(Point q) const {
        Point parts = in_parts(q);
        return spot_at({std::min(parts.x, rim_.x), std::min(parts.y, rim_.y)});
    }
    static Spot spot_at(Point parts) {
        auto x = static_cast<std::uint32_t>(parts.x), y = static_cast<std::uint32_t>(parts.y);
        return {parts, static_cast<Index>(x / Raster::kSide), static_cast<Index>(y / Raster::kSide),
                static_cast<int>(x % Raster::kSide), static_cast<int>(y % Raster::kSide)};
    }
    // The corner of a cell, in parts; any place, as seen from there.
    static Point corner(Index column, Index row) {
        return {static_cast<double>(column) * Raster::kSide,
                static_cast<double>(row) * Raster::kSide};
    }
    Point in_raster(Point q, Index column, Index row) const {
        Point parts = in_parts(q), origin = corner(column, row);
        return {parts.x - origin.x, parts.y - origin.y};
    }
    // About the middle of a part.
    Point middle(Index column, Index row, int x, int y) const {
        return {frame_.x_low + (column + (x + 0.5) / Raster::kSide) / x_scale_,
                frame_.y_low + (row + (y + 0.5) / Raster::kSide) / y_scale_};
    }

   private:
    static constexpr Index kShare = 16;  // vertices a cell
    static constexpr double kMargin = 0.125;

    static Index cut(double place, Index n) {
        return static_cast<Index>(std::max(0.0, std::min(place, n - 1.0)));
    }
    static double slack(double low, double high, Index n) {
        return (high - low) / n / (1 << 20) + 8 * kUlp * std::max(std::fabs(low), std::fabs(high));
    }
    Point in_parts(Point q) const {
        return {(q.x - frame_.x_low) * x_scale_ * Raster::kSide,
                (q.y - frame_.y_low) * y_scale_ * Raster::kSide};
    }

    Box frame_ = {};
    Index columns_ = 0, rows_ = 0;      // 0 while there is no grid
    double x_scale_ = 0, y_scale_ = 0;  // cells a unit
    Point rim_ = {0, 0};                // the last coordinates before it, in parts
    double x_slack_ = 0, y_slack_ = 0;
    Index made_for_ = 0;  // vertices
};

}  // namespace flintknap
