// Approximations and Flintstones.
#include "kernel.hpp"

namespace flintknap {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The edges down to a cut of a tree, from the smallest of their vertices on.
std::vector<Hierarchy::Edge> edges_of(Hierarchy& tree, Cut cut, void (*poll)()) {
    std::vector<Hierarchy::Edge> edges;
    tree.cut(cut, poll, [&](const Hierarchy::Edge& e) { edges.push_back(e); });
    auto first = std::min_element(edges.begin(), edges.end(),
                                  [](const auto& a, const auto& b) { return a.at < b.at; });
    std::rotate(edges.begin(), first, edges.end());
    return edges;
}

// Of each edge its first vertex: id and coordinates; its error; and the deepest level.
auto approximate(Kernel& k, Index level, double tolerance) {
    auto turn = k.with_ring();
    std::vector<std::int64_t> ids;
    std::vector<double> xy, errors;
    Index deepest = 0;
    Object& object = k.object();
    k.at_length([&](auto poll) {
        if (object.ring().empty()) return;
        Cut cut = {level, tolerance};
        std::vector<Hierarchy::Edge> edges = edges_of(object.tree(cut), cut, poll);
        ids.resize(edges.size());
        object.points().ids_in_slots(
            ids.size(), [&](std::size_t i) { return edges[i].start; }, ids.data());
        xy.reserve(2 * edges.size());
        errors.reserve(edges.size());
        for (const Hierarchy::Edge& e : edges) {
            xy.push_back(e.at.x);
            xy.push_back(e.at.y);
            errors.push_back(e.error);
            deepest = std::max(deepest, e.level);
        }
    });
    return nb::make_tuple(to_numpy(std::move(ids)), to_numpy(std::move(xy), 2),
                          to_numpy(std::move(errors)), deepest);
}

// Of each edge its two ids; their coordinates; and the cotangents of the smallest angles under
// which the chord is seen from its left and its right, minus infinity if from nowhere.
auto localize(Kernel& k, Index level, double tolerance) {
    auto turn = k.with_ring();
    std::vector<std::int64_t> ids;
    std::vector<double> ends, seen;
    Object& object = k.object();
    k.at_length([&](auto poll) {
        if (object.ring().empty()) return;
        for (const Hierarchy::Edge& e : edges_of(object.hierarchy(), {level, tolerance}, poll)) {
            Point p = e.at, s = object.site(e.stop);
            ids.push_back(object.points().id_in_slot(e.start));
            ids.push_back(object.points().id_in_slot(e.stop));
            ends.insert(ends.end(), {p.x, p.y, s.x, s.y});
            Flintstone f = object.hierarchy().flintstone(e);
            seen.push_back(f.left == kNone ? -kInfinity : cotangent(p, s, f.left_at));
            seen.push_back(f.right == kNone ? -kInfinity : cotangent(s, p, f.right_at));
        }
    });
    return nb::make_tuple(to_numpy(std::move(ids), 2), to_numpy(std::move(ends), 4),
                          to_numpy(std::move(seen), 2));
}

Index level_for(Kernel& k, double tolerance) {
    auto turn = k.with_ring();
    Index level = 0;
    Object& object = k.object();
    k.at_length([&](auto poll) {
        if (!object.triangulation().is_flat())
            level = object.hierarchy().level_for(tolerance, poll);
    });
    return level;
}

// How many nodes of both trees are refined, and the deepest level reached.
auto refined(Kernel& k) {
    auto turn = k.with_ring();
    Hierarchy &hierarchy = k.object().hierarchy(), &farthest = k.object().farthest();
    return nb::make_tuple(hierarchy.refined() + farthest.refined(), hierarchy.depth());
}

}  // namespace

void bind_flintstone(KernelClass& kernel) {
    using namespace nb::literals;
    kernel.def("approximate", approximate, "level"_a, "tolerance"_a)
        .def("localize", localize, "level"_a, "tolerance"_a)
        .def("level_for", level_for, "tolerance"_a)
        .def("refined", refined);
}

}  // namespace flintknap
