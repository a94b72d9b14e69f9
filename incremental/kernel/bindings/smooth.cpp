// Smooth boundaries of closed polygons: functions of arrays, of no object.
#include "../smooth.hpp"

#include "kernel.hpp"

namespace flintknap {
namespace {

using Ring = nb::ndarray<const double, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;

// Rows that the caller has made room for: NumPy asks for huge pages, which halves the cost.
template <class T, int Columns>
using Rows = nb::ndarray<T, nb::shape<-1, Columns>, nb::c_contig, nb::device::cpu>;

void put(double* at, Point p) {
    at[0] = p.x;
    at[1] = p.y;
}

class Polygon {
   public:
    explicit Polygon(const Ring& xy) : xy_(xy.data()), size_(xy.shape(0)) {}
    std::size_t size() const { return size_; }
    std::size_t next(std::size_t i) const { return i + 1 == size_ ? 0 : i + 1; }
    Point operator[](std::size_t i) const { return {xy_[2 * i], xy_[2 * i + 1]}; }
    Corner corner(std::size_t i) const {
        return {(*this)[i == 0 ? size_ - 1 : i - 1], (*this)[i], (*this)[next(i)]};
    }

   private:
    const double* xy_;
    std::size_t size_;
};

// Writes of each vertex its tangent and its Kind; of each side, from a vertex to the next, (x, y)
// of four control points.
void cubic(Ring xy, Weights weights, Rows<double, 2> tangents, Rows<double, 8> control,
           Rows<std::uint8_t, 1> kinds) {
    Polygon ring(xy);
    std::size_t n = ring.size();
    nb::gil_scoped_release others_may_run;
    for (std::size_t i = 0, before = n - 1; i < n; before = i++) {
        Tangent t = tangent(ring.corner(i), weights);
        Point v = ring[i];
        put(&tangents(i, 0), t.direction);
        kinds(i, 0) = static_cast<std::uint8_t>(t.kind);
        put(&control(before, 4), v - t.back * t.direction);
        put(&control(before, 6), v);
        put(&control(i, 0), v);
        put(&control(i, 2), v + t.ahead * t.direction);
    }
}

// The same with three control points a side. Returns the sides of which there is no such segment,
// by their first vertex; their middle control point is that vertex.
auto quadratic(Ring xy, Weights weights, Rows<double, 2> tangents, Rows<double, 6> control,
               Rows<std::uint8_t, 1> kinds) {
    Polygon ring(xy);
    std::size_t n = ring.size();
    std::vector<std::int64_t> refused;
    {
        nb::gil_scoped_release others_may_run;
        std::vector<Tangent> all;
        all.reserve(n);
        for (std::size_t i = 0; i < n; ++i) {
            all.push_back(tangent(ring.corner(i), weights));
            put(&tangents(i, 0), all[i].direction);
            kinds(i, 0) = static_cast<std::uint8_t>(all[i].kind);
        }
        auto is_straight = [&](std::size_t i) {
            Corner c = ring.corner(i);
            return orient(c.p, c.v, c.q) == 0;
        };
        for (std::size_t i = 0; i < n; ++i) {
            std::size_t j = ring.next(i);
            auto middle = meeting(ring[i], all[i], is_straight(i), ring[j], all[j], is_straight(j));
            if (!middle) refused.push_back(static_cast<std::int64_t>(i));
            put(&control(i, 0), ring[i]);
            put(&control(i, 2), middle.value_or(ring[i]));
            put(&control(i, 4), ring[j]);
        }
    }
    return to_numpy(std::move(refused));
}

}  // namespace

void bind_smooth(nb::module_& module) {
    using namespace nb::literals;
    nb::enum_<Weights>(module, "Weights")
        .value("length", Weights::length)
        .value("uniform", Weights::uniform)
        .value("inverse", Weights::inverse);
    module.def("cubic", &cubic, "xy"_a, "weights"_a, "tangents"_a, "control"_a, "kinds"_a);
    module.def("quadratic", &quadratic, "xy"_a, "weights"_a, "tangents"_a, "control"_a, "kinds"_a);
}

}  // namespace flintknap
