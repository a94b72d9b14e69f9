// The ring, what it leaves inside, and where a place lies.
#include "kernel.hpp"

namespace flintknap {
namespace {

// The ids along the ring from the smallest vertex on, and the coordinates; empty if the points
// lie on a line.
auto ring(Kernel& k) {
    auto turn = k.settled();
    const Object& object = k.object();
    std::vector<std::int64_t> ids;
    std::vector<double> xy;
    ids.reserve(at(object.ring_size()));
    xy.reserve(2 * ids.capacity());
    for (Index v = object.smallest(); ids.size() < at(object.ring_size());) {
        ids.push_back(object.points().id_in_slot(v));
        xy.push_back(object.site(v).x);
        xy.push_back(object.site(v).y);
        v = object.following(v);
    }
    return nb::make_tuple(to_numpy(std::move(ids)), to_numpy(std::move(xy), 2));
}

// The ids of the vertices that are not on the ring, in no order.
auto left_inside(Kernel& k) {
    auto turn = k.settled();
    std::vector<std::int64_t> ids;
    for (Index v : k.object().inside()) ids.push_back(k.object().points().id_in_slot(v));
    return to_numpy(std::move(ids));
}

// How far the gamma-graph was widened, as the cotangent of the angle that d stands for.
double widened(Kernel& k) {
    auto turn = k.settled();
    return k.object().widening().reached();
}

double d_min(Kernel& k) {
    auto turn = k.take_turn();
    return k.object().widening().limit().d;
}

// 2 if the place is not admissible.
int side_one(Kernel& k, double x, double y) {
    if (!is_admissible({x, y})) return 2;
    auto turn = k.with_ring();
    return k.object().cells().side({x, y});
}

auto side_many(Kernel& k, DoubleArray x, DoubleArray y) {
    std::vector<std::int8_t> answers(x.shape(0));
    auto turn = k.with_ring();
    {
        nb::gil_scoped_release others_may_run;
        Sides sides(k.object().ring());
        sides.ask(
            answers.size(), [&](std::size_t i) { return Point{x(i), y(i)}; },
            [&](std::size_t i, int answer) { answers[i] = static_cast<std::int8_t>(answer); });
    }
    return to_numpy(std::move(answers));
}

}  // namespace

void bind_boundary(KernelClass& kernel) {
    using namespace nb::literals;
    kernel.def("ring", ring)
        .def("left_inside", left_inside)
        .def("widened", widened)
        .def("d_min", d_min)
        .def("side", side_one, "x"_a, "y"_a)
        .def("side_many", side_many, "x"_a, "y"_a);
}

}  // namespace flintknap
