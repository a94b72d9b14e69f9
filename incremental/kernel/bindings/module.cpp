// The kernel's face to Python: arrays in, arrays out, and nothing else of substance.
#include "../lines.hpp"
#include "kernel.hpp"

namespace flintknap {
namespace {

// The first row with a coordinate that is not admissible, or -1.
std::int64_t first_outside(DoubleArray x, DoubleArray y) {
    for (std::size_t i = 0; i < x.shape(0); ++i) {
        if (!is_admissible({x(i), y(i)})) return static_cast<std::int64_t>(i);
    }
    return -1;
}

// t of all lines, then x, then y, if all are like the first one, which inserts a point; or nothing.
auto read_alike(nb::bytes lines, nb::bytes first) {
    return to_numpy(Pattern({first.c_str(), first.size()}).read({lines.c_str(), lines.size()}));
}

void bind_predicates(nb::module_& m) {
    m.def("orient", [](double ax, double ay, double bx, double by, double cx, double cy) {
        return orient({ax, ay}, {bx, by}, {cx, cy});
    });
    m.def("dot_sign", [](double ix, double iy, double jx, double jy, double kx, double ky) {
        return dot_sign({ix, iy}, {jx, jy}, {kx, ky});
    });
    m.def("cotangent", [](double ix, double iy, double jx, double jy, double kx, double ky) {
        return cotangent({ix, iy}, {jx, jy}, {kx, ky});
    });
    m.def("cotangent_floor", [](double ix, double iy, double jx, double jy, double kx, double ky) {
        return cotangent_floor({ix, iy}, {jx, jy}, {kx, ky});
    });
    m.def("in_circle",
          [](double ax, double ay, double bx, double by, double cx, double cy, double dx,
             double dy) { return in_circle({ax, ay}, {bx, by}, {cx, cy}, {dx, dy}); });
    m.def("in_circle_perturbed",
          [](double ax, double ay, double bx, double by, double cx, double cy, double dx,
             double dy) { return in_circle_perturbed({ax, ay}, {bx, by}, {cx, cy}, {dx, dy}); });
}

}  // namespace
}  // namespace flintknap

NB_MODULE(_kernel, m) {
    using namespace flintknap;
    using namespace nb::literals;

    m.attr("MIN_MAGNITUDE") = kMinMagnitude;
    m.attr("MAX_MAGNITUDE") = kMaxMagnitude;
    m.def("first_outside", &first_outside, "x"_a, "y"_a);
    m.def("read_alike", &read_alike, "lines"_a, "first"_a);
    bind_predicates(m);
    KernelClass kernel(m, "Kernel");
    kernel.def(
        "__init__",
        [](Kernel* k, double d_min, double cotangent) { new (k) Kernel({d_min, cotangent}); },
        "d_min"_a, "cotangent"_a);
    bind_points(kernel);
    bind_gamma(kernel);
    bind_boundary(kernel);
    bind_flintstone(kernel);
    bind_collision(kernel);
    bind_bounds(kernel);
    bind_outline(m, kernel);
    bind_smooth(m, kernel);
    bind_whole(kernel);
    bind_scene(m);
    bind_quick(m);
}
