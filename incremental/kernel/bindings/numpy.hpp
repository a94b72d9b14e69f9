// Arrays on their way in and out.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>

#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "../predicates.hpp"

namespace flintknap {

namespace nb = nanobind;

using DoubleArray = nb::ndarray<const double, nb::ndim<1>, nb::device::cpu>;
using ByteArray = nb::ndarray<const std::uint8_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Polygon = nb::ndarray<const double, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;
using IdArray = nb::ndarray<const std::int64_t, nb::ndim<1>, nb::device::cpu>;

// An array that owns its values, with as many columns as a row has.
template <class T, class Allocator>
auto to_numpy(std::vector<T, Allocator>&& values, std::size_t columns = 1) {
    using Values = std::vector<T, Allocator>;
    auto* owned = new Values(std::move(values));
    nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<Values*>(p); });
    std::size_t shape[2] = {owned->size() / columns, columns};
    return nb::ndarray<nb::numpy, T>(owned->data(), columns == 1 ? 1 : 2, shape, owner);
}

// The place with these coordinates, if they are floats of Python and admissible.
inline std::optional<Point> as_place(nb::handle x, nb::handle y) {
    if (!PyFloat_Check(x.ptr()) || !PyFloat_Check(y.ptr())) return {};
    Point p = {PyFloat_AS_DOUBLE(x.ptr()), PyFloat_AS_DOUBLE(y.ptr())};
    return is_admissible(p) ? std::optional<Point>(p) : std::nullopt;
}

// -0.0 and 0.0 are one place, with one hash.
inline Point place(double x, double y) { return {x + 0.0, y + 0.0}; }

}  // namespace flintknap
