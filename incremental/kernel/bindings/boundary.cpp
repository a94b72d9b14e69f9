// The ring, what it leaves inside, and where a place lies.
#include "kernel.hpp"

namespace flintknap {
namespace {

// The ids along the ring from the smallest vertex on, and the coordinates; empty if the points
// lie on a line.
auto ring(Kernel& k) {
    auto turn = k.settled();
    const Triangulation& t = k.object().triangulation();
    const Constriction& c = k.object().constriction();
    std::vector<std::int64_t> ids;
    std::vector<double> xy;
    if (!t.is_flat()) {
        ids.reserve(at(t.size() - c.left_inside()));
        xy.reserve(2 * ids.capacity());
        Index v = t.smallest();
        do {
            ids.push_back(k.object().points().id_in_slot(v));
            xy.push_back(t.site(v).x);
            xy.push_back(t.site(v).y);
            v = c.following(v);
        } while (v != t.smallest());
    }
    return nb::make_tuple(to_numpy(std::move(ids)), to_numpy(std::move(xy), 2));
}

// The ids of the vertices that are not on the ring, in no order.
auto left_inside(Kernel& k) {
    auto turn = k.settled();
    const Triangulation& t = k.object().triangulation();
    std::vector<std::int64_t> ids;
    for (Index v = 0; !t.is_flat() && v < t.slots(); ++v) {
        if (t.is_site(v) && !k.object().constriction().on_ring(v))
            ids.push_back(k.object().points().id_in_slot(v));
    }
    return to_numpy(std::move(ids));
}

int side_of(const Object& object, double x, double y) {
    return side(object.triangulation(), object.constriction(), {x, y}, kNone);
}

int side_one(Kernel& k, double x, double y) {
    auto turn = k.settled();
    return side_of(k.object(), x, y);
}

auto side_many(Kernel& k, DoubleArray x, DoubleArray y) {
    std::vector<std::int8_t> answers(x.shape(0));
    auto turn = k.settled();
    {
        nb::gil_scoped_release others_may_run;
        for (std::size_t i = 0; i < answers.size(); ++i) {
            answers[i] = static_cast<std::int8_t>(side_of(k.object(), x(i), y(i)));
        }
    }
    return to_numpy(std::move(answers));
}

}  // namespace

void bind_boundary(KernelClass& kernel) {
    using namespace nb::literals;
    kernel.def("ring", ring)
        .def("left_inside", left_inside)
        .def("side", side_one, "x"_a, "y"_a)
        .def("side_many", side_many, "x"_a, "y"_a);
}

}  // namespace flintknap
