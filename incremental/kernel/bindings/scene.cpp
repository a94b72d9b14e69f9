// Many objects in one plane, in rows: which changed, and what a place or one of them has to do with
// the others.
//
// Boxes lie side by side and all are looked at: half a nanosecond each, where to compare the
// revision of an object, which every question has to do, takes ten times as long. Questions about
// many places take the turns of all objects first, in the order of their addresses (kernel.hpp).
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
            std::int64_t revision = row.kernel->told_revision();
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
            if (rows_[i].kernel->object().cells().side({x, y}) >= 0) found.append(i);
        }
        return found;
    }

    // The same of many: places and rows, in the order of rows. Of the places in the order of x,
    // those in a box are sought in a stretch.
    auto containing_many(DoubleArray x, DoubleArray y) {
        std::vector<std::int64_t> place, row;
        auto turns = all_turns();
        {
            nb::gil_scoped_release others_may_run;
            std::vector<std::pair<double, std::size_t>> places(x.shape(0));
            for (std::size_t i = 0; i < places.size(); ++i) places[i] = {x(i), i};
            std::sort(places.begin(), places.end());
            std::vector<std::size_t> held;
            for (std::size_t r = 0; r < rows_.size(); ++r) {
                const Box& box = boxes_[r];
                if (!has_box(r)) continue;
                held.clear();
                auto next = std::lower_bound(places.begin(), places.end(),
                                             std::pair{box.x_low, std::size_t{0}});
                for (; next != places.end() && next->first <= box.x_high; ++next) {
                    if (box.holds({next->first, y(next->second)})) held.push_back(next->second);
                }
                Sides(rows_[r].kernel->object().ring())
                    .ask(
                        held.size(), [&](std::size_t i) { return Point{x(held[i]), y(held[i])}; },
                        [&](std::size_t i, int side) {
                            if (side < 0) return;
                            place.push_back(static_cast<std::int64_t>(held[i]));
                            row.push_back(static_cast<std::int64_t>(r));
                        });
            }
        }
        return nb::make_tuple(to_numpy(std::move(place)), to_numpy(std::move(row)));
    }

    // The rows whose boundaries are nearest to a place, all being equally far.
    nb::list nearest(double x, double y) {
        find_nearest({x, y}, [&](std::size_t row, Point q, double limit) {
            auto turn = rows_[row].kernel->with_ring();
            return distance(row, q, limit);
        });
        nb::list found;
        for (std::size_t row : nearest_) found.append(row);
        return found;
    }

    // The same of many; of rows equally far that with the lowest rank, -1 if there is none.
    auto nearest_many(DoubleArray x, DoubleArray y, IdArray rank) {
        std::vector<std::int64_t> found(x.shape(0), -1);
        auto turns = all_turns();
        {
            nb::gil_scoped_release others_may_run;
            for (std::size_t i = 0; i < found.size(); ++i) {
                find_nearest({x(i), y(i)}, [&](std::size_t row, Point q, double limit) {
                    return distance(row, q, limit);
                });
                auto first = std::min_element(
                    nearest_.begin(), nearest_.end(),
                    [&](std::size_t a, std::size_t b) { return rank(a) < rank(b); });
                if (first != nearest_.end()) found[i] = static_cast<std::int64_t>(*first);
            }
        }
        return to_numpy(std::move(found));
    }

   private:
    // Not a number: no comparison with it is true.
    static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    static constexpr Box kNowhere = {kNone, kNone, kNone, kNone};

    // Held while many places are asked about; all rings are up to date then.
    std::vector<Kernel::Turn> all_turns() {
        std::vector<Kernel*> kernels;
        for (const Row& row : rows_) {
            if (row.kernel != nullptr) kernels.push_back(row.kernel);
        }
        std::sort(kernels.begin(), kernels.end(), std::less<>());
        kernels.erase(std::unique(kernels.begin(), kernels.end()), kernels.end());
        std::vector<Kernel::Turn> turns;
        turns.reserve(kernels.size());
        for (Kernel* kernel : kernels) turns.push_back(kernel->with_ring());
        return turns;
    }

    double distance(std::size_t row, Point q, double limit) {
        Object& object = rows_[row].kernel->object();
        return NearestSearch(object.ring(), &object.cells()).ask_distance(q, limit);
    }

    // Makes nearest_ the rows that are nearest; far(row, q, limit) tells how far one is. The object
    // with the nearest box leaves few others to be asked.
    template <class Far>
    void find_nearest(Point q, Far far) {
        constexpr double inf = std::numeric_limits<double>::infinity();
        double best = inf;
        nearest_.clear();
        gaps_.resize(rows_.size());
        for (std::size_t i = 0; i < rows_.size(); ++i) gaps_[i] = squared_gap(boxes_[i], q);
        auto is_nearer = [&](std::size_t a, std::size_t b) { return gaps_[a] < gaps_[b]; };
        auto ask = [&](std::size_t row) {
            double distance = far(row, q, best);
            if (distance > best || distance == inf) return;
            if (distance < best) nearest_.clear();
            best = distance;
            nearest_.push_back(row);
        };
        std::size_t first = rows_.size();
        for (std::size_t i = 0; i < rows_.size(); ++i) {
            if (has_box(i) && (first == rows_.size() || is_nearer(i, first))) first = i;
        }
        if (first == rows_.size()) return;
        ask(first);
        near_.clear();
        for (std::size_t i = 0; i < rows_.size(); ++i) {
            if (i != first && has_box(i) && gaps_[i] <= gap_within(best)) near_.push_back(i);
        }
        std::sort(near_.begin(), near_.end(), is_nearer);
        for (std::size_t row : near_) {
            if (gaps_[row] <= gap_within(best)) ask(row);
        }
    }

    bool has_box(std::size_t row) const { return boxes_[row].x_low <= boxes_[row].x_high; }

    struct Row {
        nb::object held;
        Kernel* kernel = nullptr;
        std::int64_t seen = -1;
    };
    std::vector<Row> rows_;
    std::vector<Box> boxes_;
    std::vector<double> gaps_;  // by row
    std::vector<std::size_t> near_, nearest_;
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
        .def("containing_many", &Roster::containing_many, "x"_a, "y"_a)
        .def("nearest", &Roster::nearest, "x"_a, "y"_a)
        .def("nearest_many", &Roster::nearest_many, "x"_a, "y"_a, "rank"_a);
}

}  // namespace flintknap
