// The triangulation and the graphs on it.
#include "../gamma.hpp"

#include <limits>

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
        for (Index h = 3 * x; h < 3 * x + 3; ++h)
            ids.push_back(k.object().points().id_in_slot(m.origin(h)));
    }
    return to_numpy(std::move(ids), 3);
}

// Two ids an edge, in no order.
auto edges(Kernel& k, Graph graph) {
    auto turn = k.placed();
    const Mesh& m = k.object().triangulation().mesh();
    std::vector<std::int64_t> ids;
    for (Index h : edges_of(k.object().triangulation(), graph)) {
        ids.push_back(k.object().points().id_in_slot(m.origin(h)));
        ids.push_back(k.object().points().id_in_slot(m.target(h)));
    }
    return to_numpy(std::move(ids), 2);
}

// (gamma0, gamma1) a row; not a number where the pair is no edge.
auto gamma(Kernel& k, IdArray a, IdArray b) {
    auto turn = k.placed();
    const Triangulation& t = k.object().triangulation();
    const Points& points = k.object().points();
    std::vector<double> out;
    out.reserve(2 * a.shape(0));
    for (std::size_t i = 0; i < a.shape(0); ++i) {
        Index h = t.edge_between(points.slot(points.find(a(i))), points.slot(points.find(b(i))));
        constexpr double none = std::numeric_limits<double>::quiet_NaN();
        Gamma g = h == kNone ? Gamma{none, none} : gamma_of_edge(t, h);
        out.push_back(g.gamma0);
        out.push_back(g.gamma1);
    }
    return to_numpy(std::move(out), 2);
}

}  // namespace

void bind_gamma(KernelClass& kernel, nb::module_& module) {
    using namespace nb::literals;
    nb::enum_<Graph>(module, "Graph")
        .value("delaunay", Graph::delaunay)
        .value("gabriel", Graph::gabriel)
        .value("hull", Graph::hull);
    kernel.def("is_flat", is_flat)
        .def("triangles", triangles)
        .def("edges", edges, "graph"_a)
        .def("gamma", gamma, "a"_a, "b"_a);
}

}  // namespace flintknap
