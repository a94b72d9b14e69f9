// How much room a crowd of locked vertices has: how far away all is that it may look for.
//
// Theory (section 3.4). By its windows a member of a cluster looks for edges of the constriction's
// ring, and for locked vertices that are no members. It sees them along straight lines through
// triangles of the object. So take a place in the middle of the members, begin with the triangles
// at them and go on, always through the edge that is nearest to the place, until that is not nearer
// than the nearest thing found; an edge of the ring counts as far away as its farther end. Whatever
// a member looks for is no nearer to it than that, less its own distance from the place. If that is
// not far, compared with the width of the crowd, halve the crowd.
//
// Cost: O(m log m) for m members, besides what lies between them and what is found.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "heap.hpp"
#include "sight.hpp"
#include "table.hpp"

namespace flintknap {

class Rooms {
   public:
    Rooms(const Triangulation& triangulation, const Constriction& constriction)
        : t_(triangulation), c_(constriction) {}

    // Calls found(k, room) for each member: no size of a pair of k with what it looks for is below;
    // of a pair of vertices, the larger one. `passed` learns of the triangles on the way.
    template <class IsMember, class Passed, class Found>
    void find(const std::vector<Index>& members, IsMember is_member, Passed passed, Found found) {
        members_ = members;
        visited_.clear();
        walks_ = 0;
        find(0, members_.size(), is_member, passed, found);
    }

   private:
    // More than what rounding does to a distance.
    static constexpr double kSlack = 1e-12;
    // So many times as far as the crowd is wide is far.
    static constexpr double kTimes = 4;

    struct Gate {
        double distance;
        Index h;  // into the triangle beyond
    };
    struct Nearer {
        bool operator()(const Gate& a, const Gate& b) const { return a.distance < b.distance; }
    };

    template <class IsMember, class Passed, class Found>
    void find(std::size_t first, std::size_t last, IsMember is_member, Passed passed, Found found) {
        Point low = t_.site(members_[first]), high = low;
        for (std::size_t n = first; n < last; ++n) {
            Point p = t_.site(members_[n]);
            low = {std::min(low.x, p.x), std::min(low.y, p.y)};
            high = {std::max(high.x, p.x), std::max(high.y, p.y)};
        }
        middle_ = {low.x / 2 + high.x / 2, low.y / 2 + high.y / 2};
        double width = 0;
        for (std::size_t n = first; n < last; ++n) width = std::max(width, far(members_[n]));
        double reach = walk(first, last, kTimes * width, is_member, passed);
        if (reach < kTimes * width && last - first > 1) {
            bool is_wide = high.x - low.x > high.y - low.y;
            auto before = [&](Index a, Index b) {
                Point p = t_.site(a), q = t_.site(b);
                return is_wide ? p.x < q.x : p.y < q.y;
            };
            std::size_t half = first + (last - first) / 2;
            auto place = [&](std::size_t n) {
                return members_.begin() + static_cast<std::ptrdiff_t>(n);
            };
            std::nth_element(place(first), place(half), place(last), before);
            find(first, half, is_member, passed, found);
            find(half, last, is_member, passed, found);
            return;
        }
        for (std::size_t n = first; n < last; ++n) {
            double room = reach * (1 - kSlack) - far(members_[n]) * (1 + kSlack);
            found(members_[n], std::max(room, 0.0) * std::max(room, 0.0));
        }
    }

    // How far it is from the middle to the nearest thing; or something less than `enough`.
    template <class IsMember, class Passed>
    double walk(std::size_t first, std::size_t last, double enough, IsMember is_member,
                Passed passed) {
        const Mesh& m = t_.mesh();
        double reach = std::numeric_limits<double>::infinity();
        gates_.clear();
        ++walks_;
        for (std::size_t n = first; n < last; ++n) {
            Index k = members_[n];
            each_spoke(k, [&](Index spoke) { visited_.put(Mesh::triangle(spoke), walks_); });
        }
        auto meet = [&](Index v) {
            if (is_locked(v) && !is_member(v)) reach = std::min(reach, far(v));
        };
        for (std::size_t n = first; n < last; ++n) {
            each_spoke(members_[n], [&](Index spoke) {
                meet(m.target(spoke));
                enter(Mesh::next(spoke), reach);
            });
        }
        while (reach >= enough && !gates_.empty() && gates_.top().distance < reach) {
            Index h = gates_.pop().h;
            passed(Mesh::triangle(h));
            meet(m.apex(h));
            enter(Mesh::next(h), reach);
            enter(Mesh::prev(h), reach);
        }
        return reach;
    }

    template <class F>
    void each_spoke(Index k, F f) const {
        Index first = t_.mesh().leaving(k), spoke = first;
        do {
            f(spoke);
            spoke = t_.mesh().turn(spoke);
        } while (spoke != first);
    }

    // Sees what is beyond an edge.
    void enter(Index edge, double& reach) {
        const Mesh& m = t_.mesh();
        Index a = m.origin(edge), b = m.target(edge), beyond = m.twin(edge);
        Index x = Mesh::triangle(beyond);
        if (!c_.is_inside(x)) {
            reach = std::min(reach, std::max(far(a), far(b)));
        } else if (visited_[x] != walks_) {
            visited_.put(x, walks_);
            gates_.push({std::sqrt(Sight::distance(way(a), way(b))), beyond});
        }
    }

    bool is_locked(Index v) const { return !c_.on_ring(v); }
    Point way(Index v) const { return {t_.site(v).x - middle_.x, t_.site(v).y - middle_.y}; }
    double far(Index v) const { return std::hypot(way(v).x, way(v).y); }

    const Triangulation& t_;
    const Constriction& c_;
    std::vector<Index> members_;
    Point middle_{};
    Table visited_;  // by triangle: the last walk that came there
    Index walks_ = 0;
    Heap<Gate, Nearer> gates_{Nearer{}};
};

}  // namespace flintknap
