// Points come, leave and are looked up.
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "kernel.hpp"

namespace flintknap {
namespace {

auto insert_many(Kernel& k, DoubleArray x, DoubleArray y) {
    std::vector<std::int64_t> ids(x.shape(0));
    auto turn = k.take_turn();
    {
        nb::gil_scoped_release others_may_run;
        k.object().insert(ids.size(), [&](std::size_t i) { return place(x(i), y(i)); }, ids.data());
    }
    return to_numpy(std::move(ids));
}

// Takes one away from the multiplicity of a point; false if there is no point with that id.
bool remove(Kernel& k, std::int64_t id) {
    auto turn = k.take_turn();
    Index handle = k.object().points().find(id);
    if (handle != kNone) k.object().remove(handle);
    return handle != kNone;
}

// The same for ids that are all known, none more often than its multiplicity.
void remove_many(Kernel& k, IdArray ids) {
    auto turn = k.take_turn();
    nb::gil_scoped_release others_may_run;
    for (std::size_t i = 0; i < ids.shape(0); ++i) {
        k.object().remove(k.object().points().find(ids(i)));
    }
}

// The id of the point where it came to be; -1 if there is no point with that id.
std::int64_t move(Kernel& k, std::int64_t id, double x, double y) {
    auto turn = k.take_turn();
    Index handle = k.object().points().find(id);
    return handle == kNone ? -1 : k.object().move(handle, place(x, y));
}

// Points come (true) and leave (false) at places, one after the other; in the end, the point with
// an id, if it is not negative, moves to (x, y). The id of the point there, or -1. Those that leave
// are there, and so is that id. Python sees all of it or nothing, for signals wait.
std::int64_t change(Kernel& k, const std::vector<std::tuple<double, double, bool>>& steps,
                    std::int64_t id, double x, double y) {
    auto turn = k.take_turn();
    nb::gil_scoped_release others_may_run;
    Object& object = k.object();
    object.make_room(steps.size());
    for (auto [at_x, at_y, comes] : steps) {
        Point p = place(at_x, at_y);
        if (comes) {
            object.insert(p);
        } else {
            object.remove(object.points().find(p));
        }
    }
    return id < 0 ? -1 : object.move(object.points().find(id), place(x, y));
}

void clear(Kernel& k) {
    auto turn = k.take_turn();
    const Points& points = k.object().points();
    if (points.size() == 0) return;
    Limit limit = k.object().widening().limit();
    k.replace(std::make_unique<Object>(limit, points.next_id(), points.revision() + 1));
}

// The ids of the points at some places, -1 where there is none.
auto find(Kernel& k, DoubleArray x, DoubleArray y) {
    auto turn = k.take_turn();
    const Points& points = k.object().points();
    std::vector<std::int64_t> ids(x.shape(0), -1);
    for (std::size_t i = 0; i < ids.size(); ++i) {
        Index handle = points.find(place(x(i), y(i)));
        if (handle != kNone) ids[i] = points.id(handle);
    }
    return to_numpy(std::move(ids));
}

auto ids(Kernel& k) {
    auto turn = k.take_turn();
    return to_numpy(k.object().points().ids());
}

std::int64_t revision(Kernel& k) {
    auto turn = k.take_turn();
    return k.object().points().revision();
}

// The next id to be given.
std::int64_t next_id(Kernel& k) {
    auto turn = k.take_turn();
    return k.object().points().next_id();
}

std::int64_t steps(Kernel& k) {
    auto turn = k.take_turn();
    return k.object().points().steps();
}

std::size_t size(Kernel& k) {
    auto turn = k.take_turn();
    return k.object().points().size();
}

// Coordinates of the points of some ids.
auto points(Kernel& k, IdArray ids) {
    auto turn = k.take_turn();
    const Points& known = k.object().points();
    std::vector<double> xy;
    xy.reserve(2 * ids.shape(0));
    for (std::size_t i = 0; i < ids.shape(0); ++i) {
        Point p = known.point(known.find(ids(i)));
        xy.push_back(p.x);
        xy.push_back(p.y);
    }
    return to_numpy(std::move(xy), 2);
}

// How often each point is there; 0 if there is no point with that id.
auto multiplicity(Kernel& k, IdArray ids) {
    auto turn = k.take_turn();
    const Points& known = k.object().points();
    std::vector<std::int64_t> out(ids.shape(0));
    for (std::size_t i = 0; i < out.size(); ++i) {
        Index handle = known.find(ids(i));
        out[i] = handle == kNone ? 0 : known.multiplicity(handle);
    }
    return to_numpy(std::move(out));
}

}  // namespace

void bind_points(KernelClass& kernel) {
    using namespace nb::literals;
    kernel.def("insert_many", insert_many, "x"_a, "y"_a)
        .def("remove", remove, "point_id"_a)
        .def("remove_many", remove_many, "ids"_a)
        .def("move", move, "point_id"_a, "x"_a, "y"_a)
        .def("change", change, "steps"_a, "point_id"_a = -1, "x"_a = 0.0, "y"_a = 0.0)
        .def("clear", clear)
        .def("find", find, "x"_a, "y"_a)
        .def("ids", ids)
        .def("next_id", next_id)
        .def("revision", revision)
        .def("steps", steps)
        .def("__len__", size)
        .def("points", points, "ids"_a)
        .def("multiplicity", multiplicity, "ids"_a);
}

}  // namespace flintknap
