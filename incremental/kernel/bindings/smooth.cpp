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

bool operator!=(Point a, Point b) { return !(a == b); }

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

// A curve that was made before, to be looked up where the polygon has not changed.
struct Curve {
    Rows<const double, 2> tangents;
    Rows<const double, 8> control;
    Rows<const std::uint8_t, 1> kinds;

    std::size_t size() const { return tangents.shape(0); }
    Point operator[](std::size_t j) const { return {control(j, 0), control(j, 1)}; }
};

// Vertices [at, at + count) that were [before, before + count).
struct Run {
    std::size_t at, before, count;
};

// What the polygon shares with the curve, in order. Looks for the end of a change within `kWindow`
// vertices, and gives up on what lies between the last run found and the common end when it does
// not come, or when looking has cost as much as a pass over the polygon.
std::vector<Run> shared(const Polygon& ring, const Curve& old) {
    constexpr std::size_t kWindow = 64;
    std::size_t n = ring.size(), m = old.size(), i = 0, j = 0, looked = 0;
    while (i < n && i < m && ring[n - 1 - i] == old[m - 1 - i]) ++i;
    Run last{n - i, m - i, i};
    n = last.at, m = last.before, i = 0;
    std::vector<Run> runs;
    auto meet = [&](std::size_t a, std::size_t b) {  // two in a row, or one at the end
        if (a >= n || b >= m || ring[a] != old[b]) return false;
        return a + 1 >= n || b + 1 >= m || ring[a + 1] == old[b + 1];
    };
    for (bool is_found = true; is_found;) {
        Run run{i, j, 0};
        for (; i < n && j < m && ring[i] == old[j]; ++i, ++j) ++run.count;
        if (run.count > 2) runs.push_back(run);
        is_found = false;
        for (std::size_t sum = 1; sum <= kWindow && looked <= n && !is_found; ++sum) {
            for (std::size_t a = 0; a <= sum && !is_found; ++a, ++looked) {
                is_found = meet(i + a, j + sum - a);
                if (is_found) i += a, j += sum - a;
            }
        }
    }
    if (last.count > 2) runs.push_back(last);
    return runs;
}

// Writes of each vertex its tangent and its Kind; of each side, from a vertex to the next, (x, y)
// of four control points. What belongs to a vertex is the end of one row and the beginning of the
// next,
//
//     ... p0 p1 [p2 p3 | p0 p1] p2 p3 ...
//
// so it is copied in one piece for vertices whose neighbours are those of the curve before.
void cubic(Ring xy, Weights weights, Rows<double, 2> tangents, Rows<double, 8> control,
           Rows<std::uint8_t, 1> kinds, Rows<const double, 2> old_tangents,
           Rows<const double, 8> old_control, Rows<const std::uint8_t, 1> old_kinds) {
    Polygon ring(xy);
    std::size_t n = ring.size(), i = 0;
    nb::gil_scoped_release others_may_run;
    auto make = [&](std::size_t end) {
        for (; i < end; ++i) {
            Tangent t = tangent(ring.corner(i), weights);
            std::size_t before = i == 0 ? n - 1 : i - 1;
            Point v = ring[i];
            put(&tangents(i, 0), t.direction);
            kinds(i, 0) = static_cast<std::uint8_t>(t.kind);
            put(&control(before, 4), v - t.back * t.direction);
            put(&control(before, 6), v);
            put(&control(i, 0), v);
            put(&control(i, 2), v + t.ahead * t.direction);
        }
    };
    Curve old{old_tangents, old_control, old_kinds};
    for (Run run : shared(ring, old)) {
        make(run.at + 1);  // the ends of a run may have got another neighbour
        std::size_t j = run.before + 1, count = run.count - 2;
        std::copy_n(&old.tangents(j, 0), 2 * count, &tangents(i, 0));
        std::copy_n(&old.kinds(j, 0), count, &kinds(i, 0));
        std::copy_n(&old.control(j - 1, 4), 8 * count, &control(i - 1, 4));
        i += count;
    }
    make(n);
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
    module.def("cubic", &cubic, "xy"_a, "weights"_a, "tangents"_a, "control"_a, "kinds"_a,
               "old_tangents"_a, "old_control"_a, "old_kinds"_a);
    module.def("quadratic", &quadratic, "xy"_a, "weights"_a, "tangents"_a, "control"_a, "kinds"_a);
}

}  // namespace flintknap
