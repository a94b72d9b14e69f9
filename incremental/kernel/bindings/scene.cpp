// Many objects in one plane, in rows: which changed, and what a place or one of them has to do with
// the others.
//
// Boxes lie side by side and all are looked at: half a nanosecond each, where to compare the
// revision of an object, which every question has to do, takes thirty times as long.
#include <algorithm>
#include <limits>

#include "../collision.hpp"
#include "kernel.hpp"

namespace flintknap {
namespace {

class Roster {
   public:
    // Puts an object into a row, or none. It counts as changed, and has no box yet.
    void put(std::size_t row, nb::object kernel) {
        if (row >= rows_.size()) {
            rows_.resize(row + 1);
            boxes_.resize(row + 1, kNowhere);
        }
        Kernel* it = kernel.is_none() ? nullptr : nb::cast<Kernel*>(kernel);
        boxes_[row] = kNowhere;
        rows_[row] = {std::move(kernel), it, -1};
    }

    // Adds the rows whose objects have a revision that was not seen to a set; then it is. O(rows).
    void add_changed(nb::set changed) {
        for (std::size_t i = 0; i < rows_.size(); ++i) {
            Row& row = rows_[i];
            if (row.kernel == nullptr) continue;
            auto turn = row.kernel->take_turn();
            std::int64_t revision = row.kernel->object().points().revision();
            if (revision == row.seen) continue;
            changed.add(i);
            row.seen = revision;
        }
    }

    // Brings an object and its box up to date.
    void refresh(std::size_t row) {
        auto turn = rows_[row].kernel->with_ring();
        const Ring& ring = rows_[row].kernel->object().ring();
        boxes_[row] = ring.empty() ? kNowhere : ring.node(ring.root()).box;
    }

    // The other rows whose objects collide with this one.
    nb::set touching(std::size_t row) {
        nb::set found;
        for (std::size_t i = 0; i < rows_.size(); ++i) {
            if (i == row || !overlap(boxes_[i], boxes_[row])) continue;
            if (with_both_rings(*rows_[i].kernel, *rows_[row].kernel, collide)) found.add(i);
        }
        return found;
    }

    // The rows whose objects contain a place.
    nb::list containing(double x, double y) {
        nb::list found;
        for (std::size_t i = 0; i < rows_.size(); ++i) {
            if (!boxes_[i].holds({x, y})) continue;
            auto turn = rows_[i].kernel->with_ring();
            if (side(rows_[i].kernel->object().ring(), {x, y}) >= 0) found.append(i);
        }
        return found;
    }

    // The rows whose boundaries are nearest to a place, all being equally far.
    nb::list nearest(double x, double y) {
        Point q = {x, y};
        std::vector<std::pair<double, std::size_t>> near;  // the nearest box on top of the heap
        for (std::size_t i = 0; i < rows_.size(); ++i) {
            if (boxes_[i].x_low <= boxes_[i].x_high) near.push_back({squared_gap(boxes_[i], q), i});
        }
        std::make_heap(near.begin(), near.end(), std::greater<>());
        double best = std::numeric_limits<double>::infinity();
        nb::list found;
        while (!near.empty() && near.front().first <= gap_within(best)) {
            std::size_t row = near.front().second;
            std::pop_heap(near.begin(), near.end(), std::greater<>());
            near.pop_back();
            auto turn = rows_[row].kernel->with_ring();
            double far = NearestSearch(rows_[row].kernel->object().ring()).ask(q, best).distance;
            if (far > best) continue;
            if (far < best) found.clear();
            best = far;
            found.append(row);
        }
        return found;
    }

   private:
    // Not a number: no comparison with it is true.
    static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    static constexpr Box kNowhere = {kNone, kNone, kNone, kNone};

    struct Row {
        nb::object held;
        Kernel* kernel = nullptr;
        std::int64_t seen = -1;
    };
    std::vector<Row> rows_;
    std::vector<Box> boxes_;
};

}  // namespace

void bind_scene(nb::module_& module) {
    using namespace nb::literals;
    nb::class_<Roster>(module, "Roster")
        .def(nb::init<>())
        .def("put", &Roster::put, "row"_a, "kernel"_a.none())
        .def("add_changed", &Roster::add_changed, "changed"_a)
        .def("refresh", &Roster::refresh, "row"_a)
        .def("touching", &Roster::touching, "row"_a)
        .def("containing", &Roster::containing, "x"_a, "y"_a)
        .def("nearest", &Roster::nearest, "x"_a, "y"_a);
}

}  // namespace flintknap
