// Smooth boundaries: of an object's ring, or of any closed polygon.
#include <nanobind/stl/tuple.h>

#include "../curve.hpp"
#include "kernel.hpp"
#include "outline.hpp"

namespace flintknap {
namespace {

// Rows that the caller has made room for: NumPy asks for huge pages, which halves the cost.
template <class T, int Columns>
using Rows = nb::ndarray<T, nb::shape<-1, Columns>, nb::c_contig, nb::device::cpu>;

void put(double* at, Point p) {
    at[0] = p.x;
    at[1] = p.y;
}

// Of the ring of the object that the outline comes from.
Curve of_object(Kernel& k, const HeldOutline& outline, Weights weights) {
    auto turn = k.take_turn();
    nb::gil_scoped_release others_may_run;
    return Curve(outline.held, weights);
}

Curve of_polygon(const Polygon& xy, Weights weights) {
    Stretch all;
    nb::gil_scoped_release others_may_run;
    std::size_t n = xy.shape(0);
    all.ids.resize(n);  // nobody asks for them
    all.xy.reserve(n);
    for (std::size_t i = 0; i < n; ++i) all.xy.push_back({xy(i, 0), xy(i, 1)});
    return Curve(std::make_shared<const Outline>(std::move(all)), weights);
}

// What another process made of it: vertices and weights, from which it is made again.
auto state(const Curve& curve) {
    std::vector<double> xy(2 * curve.size());
    curve.visit([&](std::size_t i, Point v, const Tangent&) { put(&xy[2 * i], v); });
    return nb::make_tuple(to_numpy(std::move(xy), 2), curve.weights());
}

void set_state(Curve& curve, const std::tuple<Polygon, Weights>& state) {
    new (&curve) Curve(of_polygon(std::get<0>(state), std::get<1>(state)));
}

void put_tangents(const Curve& curve, Rows<double, 2> tangents, Rows<std::uint8_t, 1> kinds) {
    nb::gil_scoped_release others_may_run;
    curve.visit([&](std::size_t i, Point, const Tangent& t) {
        put(&tangents(i, 0), t.direction);
        kinds(i, 0) = static_cast<std::uint8_t>(t.kind);
    });
}

// Of each side, from a vertex to the next, (x, y) of four control points.
void put_cubics(const Curve& curve, Rows<double, 8> control) {
    nb::gil_scoped_release others_may_run;
    std::size_t last = curve.size() - 1;
    curve.visit([&](std::size_t i, Point v, const Tangent& t) {
        std::size_t before = i == 0 ? last : i - 1;
        put(&control(before, 4), v - t.back * t.direction);
        put(&control(before, 6), v);
        put(&control(i, 0), v);
        put(&control(i, 2), v + t.ahead * t.direction);
    });
}

// The same with three control points a side. Returns the sides of which there is no such segment,
// by their first vertex; their middle control point is that vertex.
auto put_parabolas(const Curve& curve, Rows<double, 6> control) {
    std::vector<std::int64_t> refused;
    {
        nb::gil_scoped_release others_may_run;
        std::vector<Point> xy;
        std::vector<Tangent> tangents;
        xy.reserve(curve.size());
        tangents.reserve(curve.size());
        curve.visit([&](std::size_t, Point v, const Tangent& t) {
            xy.push_back(v);
            tangents.push_back(t);
        });
        std::size_t n = xy.size();
        auto is_straight = [&](std::size_t i) {
            return orient(xy[(i + n - 1) % n], xy[i], xy[(i + 1) % n]) == 0;
        };
        for (std::size_t i = 0; i < n; ++i) {
            std::size_t j = i + 1 == n ? 0 : i + 1;
            auto middle =
                meeting(xy[i], tangents[i], is_straight(i), xy[j], tangents[j], is_straight(j));
            if (!middle) refused.push_back(static_cast<std::int64_t>(i));
            put(&control(i, 0), xy[i]);
            put(&control(i, 2), middle.value_or(xy[i]));
            put(&control(i, 4), xy[j]);
        }
    }
    return to_numpy(std::move(refused));
}

}  // namespace

void bind_smooth(nb::module_& module, KernelClass& kernel) {
    using namespace nb::literals;
    nb::enum_<Weights>(module, "Weights")
        .value("length", Weights::length)
        .value("uniform", Weights::uniform)
        .value("inverse", Weights::inverse);
    nb::class_<Curve>(module, "Curve")
        .def("__len__", &Curve::size)
        .def("__getstate__", state)
        .def("__setstate__", set_state)
        .def("made", &Curve::made)
        .def("put_tangents", put_tangents, "tangents"_a, "kinds"_a)
        .def("put_cubics", put_cubics, "control"_a)
        .def("put_parabolas", put_parabolas, "control"_a);
    module.def("smooth", of_polygon, "xy"_a, "weights"_a);
    kernel.def("smooth", of_object, "outline"_a, "weights"_a);
}

}  // namespace flintknap
