// What a level or a tolerance tells: sides, bounds of distances, +1 yes, -1 no and 0 not decided.
#include "../bounds.hpp"

#include "kernel.hpp"

namespace flintknap {
namespace {

// Calls f(i, poll) for all of n questions to an object that has a ring.
template <class F>
void for_all(Kernel& k, std::size_t n, F f) {
    auto turn = k.with_ring();
    if (k.object().ring().empty()) return;
    k.at_length([&](auto poll) {
        for (std::size_t i = 0; i < n; ++i) {
            if (i % 4096 == 4095) poll();
            f(i, poll);
        }
    });
}

auto side_at(Kernel& k, DoubleArray x, DoubleArray y, Index level, double tolerance) {
    std::vector<std::int8_t> answers(x.shape(0), -1);
    Cut cut = {level, tolerance};
    for_all(k, answers.size(), [&](std::size_t i, auto poll) {
        int side = k.object().tree(cut).side({x(i), y(i)}, cut, poll);
        answers[i] = static_cast<std::int8_t>(side);
    });
    return to_numpy(std::move(answers));
}

auto distance_at(Kernel& k, DoubleArray x, DoubleArray y, Index level, double tolerance) {
    std::vector<double> lower(x.shape(0), kFar), upper(x.shape(0), kFar);
    Cut cut = {level, tolerance};
    for_all(k, lower.size(), [&](std::size_t i, auto poll) {
        Strands strands(k.object().tree(cut), cut, poll);
        Single place({x(i), y(i)}, {x(i), y(i)});
        Bounds far = Approach(strands, place).ask();
        lower[i] = far.lower;
        upper[i] = far.upper;
    });
    return nb::make_tuple(to_numpy(std::move(lower)), to_numpy(std::move(upper)));
}

// Whether each segment meets the boundary.
template <class Poll>
int meets(Object& object, Point p, Point q, Cut cut, Poll poll) {
    Strands strands(object.tree(cut), cut, poll);
    Single segment(p, q);
    Bounds apart = Approach(strands, segment).ask(0);
    return apart.upper == 0 ? 1 : apart.lower == kFar ? -1 : 0;
}

// Whether each segment is held by the object. If it meets nothing it is where its start is; if it
// crosses the boundary it is not; if all that it meets is known exactly, so is the answer.
template <class Poll>
int holds(Object& object, Point p, Point q, Cut cut, Poll poll) {
    Hierarchy& tree = object.tree(cut);
    Strands strands(tree, cut, poll);
    Single segment(p, q);
    Approach approach(strands, segment);
    Bounds apart = approach.ask(0, true);
    if (apart.crosses) return -1;
    int at_p = tree.side(p, cut, poll);
    if (apart.lower == kFar || at_p < 0) return at_p;
    if (tree.side(q, cut, poll) < 0) return -1;
    if (!approach.is_exact()) return 0;
    return tell<Holds>(object.cells(), p, q) ? 1 : -1;
}

using Poll = void (*)();

template <int (*Ask)(Object&, Point, Point, Cut, Poll)>
auto segments_at(Kernel& k, DoubleArray x0, DoubleArray y0, DoubleArray x1, DoubleArray y1,
                 Index level, double tolerance) {
    std::vector<std::int8_t> answers(x0.shape(0), -1);
    for_all(k, answers.size(), [&](std::size_t i, auto poll) {
        Point p = {x0(i), y0(i)}, q = {x1(i), y1(i)};
        answers[i] = static_cast<std::int8_t>(Ask(k.object(), p, q, {level, tolerance}, poll));
    });
    return to_numpy(std::move(answers));
}

auto first_hit_at(Kernel& k, DoubleArray x0, DoubleArray y0, DoubleArray x1, DoubleArray y1,
                  Index level, double tolerance) {
    std::vector<double> lower(x0.shape(0), kFar), upper(x0.shape(0), kFar);
    Cut cut = {level, tolerance};
    for_all(k, lower.size(), [&](std::size_t i, auto poll) {
        Strands strands(k.object().tree(cut), cut, poll);
        Segment segment({x0(i), y0(i)}, {x1(i), y1(i)});
        Bounds t = FirstHit(strands, segment).ask();
        lower[i] = t.lower;
        upper[i] = t.upper;
    });
    return nb::make_tuple(to_numpy(std::move(lower)), to_numpy(std::move(upper)));
}

// ------------------------------------------------------------------ two objects
// Of their distance if they are not one in the other, up to `within`; and whether they collide for
// certain.
struct Contact {
    Bounds apart;
    bool is_certain = false;
};

Contact contact(Kernel& a, Kernel& b, double within, Cut cut) {
    Contact found;
    auto turns = both_turns(a, b);
    Object &one = a.object(), &other = b.object();
    if (one.ring().empty() || other.ring().empty()) return found;
    a.at_length([&](auto poll) {
        Hierarchy &tree = one.tree(cut), &second = other.tree(cut);
        Strands strands(tree, cut, poll), others(second, cut, poll);
        found.apart = Approach(strands, others).ask(within);
        Point in_one = tree.chord(tree.top()[0])[0], in_other = second.chord(second.top()[0])[0];
        found.is_certain = found.apart.upper == 0 || tree.side(in_other, cut, poll) > 0 ||
                           second.side(in_one, cut, poll) > 0;
    });
    return found;
}

int collides_at(Kernel& a, Kernel& b, Index level, double tolerance) {
    Contact found = contact(a, b, 0, {level, tolerance});
    return found.is_certain ? 1 : found.apart.lower == kFar ? -1 : 0;
}

auto clearance_at(Kernel& a, Kernel& b, Index level, double tolerance) {
    Contact found = contact(a, b, kFar, {level, tolerance});
    Bounds apart = found.is_certain ? Bounds{0, 0} : found.apart;
    return nb::make_tuple(apart.lower, apart.upper);
}

int is_clear_at(Kernel& a, Kernel& b, double at_least, Index level, double tolerance) {
    if (at_least <= 0) return 1;
    Contact found = contact(a, b, at_least, {level, tolerance});
    if (found.is_certain || found.apart.upper < at_least) return -1;
    return found.apart.lower >= at_least ? 1 : 0;
}

}  // namespace

void bind_bounds(KernelClass& kernel) {
    using namespace nb::literals;
    kernel.def("side_at", side_at, "x"_a, "y"_a, "level"_a, "tolerance"_a)
        .def("distance_at", distance_at, "x"_a, "y"_a, "level"_a, "tolerance"_a)
        .def("intersects_at", segments_at<meets<Poll>>, "x0"_a, "y0"_a, "x1"_a, "y1"_a, "level"_a,
             "tolerance"_a)
        .def("holds_at", segments_at<holds<Poll>>, "x0"_a, "y0"_a, "x1"_a, "y1"_a, "level"_a,
             "tolerance"_a)
        .def("first_hit_at", first_hit_at, "x0"_a, "y0"_a, "x1"_a, "y1"_a, "level"_a, "tolerance"_a)
        .def("collides_at", collides_at, "other"_a, "level"_a, "tolerance"_a)
        .def("clearance_at", clearance_at, "other"_a, "level"_a, "tolerance"_a)
        .def("is_clear_at", is_clear_at, "other"_a, "at_least"_a, "level"_a, "tolerance"_a);
}

}  // namespace flintknap
