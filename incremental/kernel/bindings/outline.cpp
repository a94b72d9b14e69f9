// The ring as results hold it, and what has changed on it.
#include "outline.hpp"

#include <nanobind/stl/tuple.h>

#include "kernel.hpp"

namespace flintknap {
namespace {

// An array of values that somebody else keeps in memory.
template <class T, class Owner>
auto view(const T* values, std::size_t rows, std::size_t columns, Owner owner) {
    auto* kept = new Owner(std::move(owner));
    nb::capsule capsule(kept, [](void* p) noexcept { delete static_cast<Owner*>(p); });
    std::size_t shape[2] = {rows, columns};
    return nb::ndarray<nb::numpy, const T>(values, columns == 1 ? 1 : 2, shape, capsule);
}

nb::object ids(const HeldOutline& outline) {
    const Outline& it = *outline.held;
    if (auto whole = it.whole()) return nb::cast(view(whole->ids.data(), it.size(), 1, whole));
    std::vector<Id> all;
    all.reserve(it.size());
    for (const auto& p : it.pieces()) all.insert(all.end(), p->ids(), p->ids() + p->count);
    return nb::cast(to_numpy(std::move(all)));
}

nb::object xy(const HeldOutline& outline) {
    static_assert(sizeof(Point) == 2 * sizeof(double));
    const Outline& it = *outline.held;
    if (auto whole = it.whole()) return nb::cast(view(&whole->xy.data()->x, it.size(), 2, whole));
    std::vector<double> all(2 * it.size());
    double* next = all.data();
    for (const auto& p : it.pieces()) {
        std::memcpy(next, p->xy(), p->count * sizeof(Point));
        next += 2 * p->count;
    }
    return nb::cast(to_numpy(std::move(all), 2));
}

// What another process made into arrays.
void set_state(HeldOutline& outline, const std::tuple<IdArray, Polygon>& state) {
    const auto& [ids, xy] = state;
    Stretch all;
    for (std::size_t i = 0; i < ids.shape(0); ++i) all.add(ids(i), {xy(i, 0), xy(i, 1)});
    new (&outline) HeldOutline{std::make_shared<const Outline>(std::move(all))};
}

// The outline, the ids of the vertices that are not on it, by coordinates, and how far the
// gamma-graph was widened, as the cotangent of the angle that d stands for.
auto outline(Kernel& k) {
    auto turn = k.with_outline();
    const Object& object = k.object();
    std::vector<Index> hidden = object.inside();
    auto is_before = [&](Index a, Index b) { return object.site(a) < object.site(b); };
    std::sort(hidden.begin(), hidden.end(), is_before);
    std::vector<Id> inside;
    for (Index v : hidden) inside.push_back(object.id(v));
    return nb::make_tuple(HeldOutline{object.outline()}, to_numpy(std::move(inside)),
                          object.widening().reached());
}

// See changes.py. All of the ring, between nobody and nobody, if it is not known what it was.
auto changes(Kernel& k, std::int64_t since) {
    auto turn = k.with_ring();
    Object& object = k.object();
    std::vector<Id> after, before, stops{0}, here, joined;
    std::vector<double> places;
    Notes::Difference found;
    bool is_whole = false;
    {
        nb::gil_scoped_release others_may_run;
        object.follow();
        found = object.changes(since);
        is_whole = !found.is_known;
        if (is_whole) {
            found = {};
            for (Index rank = 0; rank < object.ring().size(); ++rank) {
                found.fresh.push_back(object.ring().vertex(rank));
            }
            found.runs.push_back({kNone, kNone, 0, found.fresh.size()});
            found.joined = found.fresh;
        }
        auto id = [&](Index v) { return v == kNone ? kNone : object.id(v); };
        for (const Notes::Run& run : found.runs) {
            after.push_back(id(run.after));
            before.push_back(id(run.before));
            stops.push_back(static_cast<Id>(run.end));
        }
        for (Index v : found.fresh) {
            here.push_back(object.id(v));
            places.push_back(object.site(v).x);
            places.push_back(object.site(v).y);
        }
        for (Index v : found.joined) joined.push_back(object.id(v));
    }
    Id first = object.ring_size() > 0 ? object.id(object.smallest()) : kNone;
    return nb::make_tuple(
        object.points().revision(), is_whole, first, to_numpy(std::move(found.left)),
        to_numpy(std::move(joined)), to_numpy(std::move(after)), to_numpy(std::move(before)),
        to_numpy(std::move(stops)), to_numpy(std::move(here)), to_numpy(std::move(places), 2));
}

}  // namespace

void bind_outline(nb::module_& module, KernelClass& kernel) {
    using namespace nb::literals;
    nb::class_<HeldOutline>(module, "Outline")
        .def("__len__", [](const HeldOutline& outline) { return outline.held->size(); })
        .def("__getstate__", [](const HeldOutline& o) { return nb::make_tuple(ids(o), xy(o)); })
        .def("__setstate__", set_state)
        .def("ids", ids)
        .def("xy", xy);
    kernel.def("outline", outline).def("changes", changes, "since"_a);
}

}  // namespace flintknap
