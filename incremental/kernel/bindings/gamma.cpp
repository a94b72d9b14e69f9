// The triangulation and the graphs on it.
#include "../spectrum.hpp"
#include "kernel.hpp"

namespace flintknap {
namespace {

bool is_flat(Kernel& k) {
    auto turn = k.placed();
    return k.object().triangulation().is_flat();
}

// Three ids a triangle, counter-clockwise, in no order.
auto triangles(Kernel& k) {
    auto turn = k.placed();
    const Mesh& m = k.object().triangulation().mesh();
    std::vector<std::int64_t> ids;
    for (Index x = 0; x < m.triangles(); ++x) {
        if (m.is_free(x) || m.is_ghost(x)) continue;
        for (Index h = Mesh::first(x); h < Mesh::first(x) + 3; ++h)
            ids.push_back(k.object().points().id_in_slot(m.origin(h)));
    }
    return to_numpy(std::move(ids), 3);
}

// The pairs whose values lie in two intervals: two ids a row, the smaller one first, rows
// ascending.
auto edges(Kernel& k, double low0, double high0, double low1, double high1) {
    auto turn = k.placed();
    const Points& points = k.object().points();
    Large<std::int64_t> rows;
    k.at_length([&](auto poll) {
        const Triangulation& t = k.object().triangulation();
        Spectrum spectrum(t, Interval::of_values(low0, high0), Interval::of_values(low1, high1));
        Large<Couple> pairs = spectrum.pairs(poll);
        Numbers numbers(points.ids(), t.slots(),
                        [&](std::int64_t id) { return points.slot(points.find(id)); });
        rows = sorted_rows(std::move(pairs), numbers);
    });
    return to_numpy(std::move(rows), 2);
}

// (gamma0, gamma1) a row, of two different points; not numbers where a point lies between them.
auto gamma(Kernel& k, IdArray a, IdArray b) {
    auto turn = k.placed();
    const Points& points = k.object().points();
    std::vector<double> values;
    values.reserve(2 * a.shape(0));
    k.at_length([&](auto poll) {
        const Triangulation& t = k.object().triangulation();
        FacingPairs facing(t);
        for (std::size_t i = 0; i < a.shape(0); ++i) {
            if (i % 4096 == 4095) poll();
            Facing f = facing(points.slot(points.find(a(i))), points.slot(points.find(b(i))));
            values.push_back(gamma_of_cotangent(f.first));
            values.push_back(gamma_of_cotangent(f.second));
        }
    });
    return to_numpy(std::move(values), 2);
}

}  // namespace

void bind_gamma(KernelClass& kernel) {
    using namespace nb::literals;
    kernel.def("is_flat", is_flat)
        .def("triangles", triangles)
        .def("edges", edges, "low0"_a, "high0"_a, "low1"_a, "high1"_a)
        .def("gamma", gamma, "a"_a, "b"_a);
}

}  // namespace flintknap
