// How far, what is met on the way, and who touches whom.
#include "../collision.hpp"

#include <initializer_list>

#include "../order.hpp"
#include "kernel.hpp"

namespace flintknap {
namespace {

// Ids of the ends of an edge, -1 of none.
struct Ends {
    std::vector<std::int64_t> start, stop;

    explicit Ends(std::size_t n) : start(n, -1), stop(n, -1) {}

    void set(std::size_t i, const Object& object, Index leaf, Index place) {
        if (leaf == kNone) return;
        const Index* v = object.ring().leaf(leaf).vertex + place;
        start[i] = object.points().id_in_slot(v[0]);
        stop[i] = object.points().id_in_slot(v[1]);
    }
};

// Calls f(i) for the rows of columns, along a curve through the places (x, y) in the first two:
// each row meets what is in the cache. Rows are read at random, so they are fetched ahead.
template <class F>
void along_curve(std::initializer_list<const DoubleArray*> columns, F f) {
    constexpr std::size_t ahead = 8;
    const DoubleArray &x = *columns.begin()[0], &y = *columns.begin()[1];
    Order order = curve_order(x.shape(0), [&](std::size_t i) { return Point{x(i), y(i)}; });
    for (std::size_t i = 0; i < order.size(); ++i) {
        if (i + ahead < order.size()) {
            std::size_t next = order[i + ahead];
            for (const DoubleArray* column : columns) __builtin_prefetch(&(*column)(next));
        }
        f(order[i]);
    }
}

// Calls ask(search, i, place, limit) for many places: each search has a bound from the one before.
template <class Ask>
void search_nearest(Object& object, DoubleArray x, DoubleArray y, Ask ask) {
    NearestSearch search(object.ring(), &object.cells());
    along_curve({&x, &y}, [&](std::size_t i) {
        Point q = {x(i), y(i)};
        std::optional<Point> known = search.vertex();
        double limit = known ? distance(*known, q) : std::numeric_limits<double>::infinity();
        ask(search, i, q, limit);
    });
}

auto distance_many(Kernel& k, DoubleArray x, DoubleArray y) {
    std::vector<double> far(x.shape(0));
    auto turn = k.with_ring();
    {
        nb::gil_scoped_release others_may_run;
        search_nearest(k.object(), x, y,
                       [&](NearestSearch& search, std::size_t i, Point q, double limit) {
                           far[i] = search.ask_distance(q, limit);
                       });
    }
    return to_numpy(std::move(far));
}

// Coordinates, distances, and ids of the ends of the edges.
auto nearest(Kernel& k, DoubleArray x, DoubleArray y) {
    std::size_t n = x.shape(0);
    std::vector<double> at_x(n), at_y(n), far(n);
    Ends ends(n);
    auto turn = k.with_ring();
    {
        nb::gil_scoped_release others_may_run;
        search_nearest(k.object(), x, y,
                       [&](NearestSearch& search, std::size_t i, Point q, double limit) {
                           Nearest found = search.ask(q, limit);
                           at_x[i] = found.at.x;
                           at_y[i] = found.at.y;
                           far[i] = found.distance;
                           ends.set(i, k.object(), found.leaf, found.place);
                       });
    }
    return nb::make_tuple(to_numpy(std::move(at_x)), to_numpy(std::move(at_y)),
                          to_numpy(std::move(far)), to_numpy(std::move(ends.start)),
                          to_numpy(std::move(ends.stop)));
}

// Whether segments meet the boundary, or are held by the object.
template <class Question>
auto segment_many(Kernel& k, DoubleArray x0, DoubleArray y0, DoubleArray x1, DoubleArray y1) {
    std::vector<std::uint8_t> answers(x0.shape(0));
    auto turn = k.with_ring();
    {
        nb::gil_scoped_release others_may_run;
        tell_each<Question>(
            k.object().cells(), answers.size(),
            [&](std::size_t i) { return std::pair(Point{x0(i), y0(i)}, Point{x1(i), y1(i)}); },
            [&](std::size_t i, bool told) { answers[i] = told; });
    }
    return to_numpy(std::move(answers));
}

auto first_hit(Kernel& k, DoubleArray x0, DoubleArray y0, DoubleArray x1, DoubleArray y1) {
    std::size_t n = x0.shape(0);
    std::vector<double> t(n);
    Ends ends(n);
    auto turn = k.with_ring();
    {
        nb::gil_scoped_release others_may_run;
        along_curve({&x0, &y0, &x1, &y1}, [&](std::size_t i) {
            Segment s({x0(i), y0(i)}, {x1(i), y1(i)});
            Hit hit = Hits(k.object().ring(), s).first(k.object().cells());
            t[i] = hit.t;
            ends.set(i, k.object(), hit.leaf, hit.place);
        });
    }
    return nb::make_tuple(to_numpy(std::move(t)), to_numpy(std::move(ends.start)),
                          to_numpy(std::move(ends.stop)));
}

// All hits, segment after segment.
auto crossings(Kernel& k, DoubleArray x0, DoubleArray y0, DoubleArray x1, DoubleArray y1) {
    std::vector<std::int64_t> row;
    std::vector<double> t;
    Ends ends(0);
    auto turn = k.with_ring();
    {
        nb::gil_scoped_release others_may_run;
        for (std::size_t i = 0; i < x0.shape(0); ++i) {
            Segment s({x0(i), y0(i)}, {x1(i), y1(i)});
            for (const Hit& hit : Hits(k.object().ring(), s).all()) {
                row.push_back(static_cast<std::int64_t>(i));
                t.push_back(hit.t);
                ends.start.push_back(-1);
                ends.stop.push_back(-1);
                ends.set(t.size() - 1, k.object(), hit.leaf, hit.place);
            }
        }
    }
    return nb::make_tuple(to_numpy(std::move(row)), to_numpy(std::move(t)),
                          to_numpy(std::move(ends.start)), to_numpy(std::move(ends.stop)));
}

bool collides(Kernel& a, Kernel& b) { return with_both_rings(a, b, collide); }

double clearance(Kernel& a, Kernel& b) {
    return with_both_rings(a, b, [](const Ring& one, const Ring& other) {
        return collide(one, other) ? 0.0 : Clearance(one, other).ask();
    });
}

bool is_clear(Kernel& a, Kernel& b, double at_least) {
    return with_both_rings(a, b, [&](const Ring& one, const Ring& other) {
        return at_least <= 0 ||
               (!collide(one, other) && Clearance(one, other).is_at_least(at_least));
    });
}

}  // namespace

void bind_collision(KernelClass& kernel) {
    using namespace nb::literals;
    kernel.def("distance_many", distance_many, "x"_a, "y"_a)
        .def("nearest", nearest, "x"_a, "y"_a)
        .def("intersects_many", segment_many<Intersects>, "x0"_a, "y0"_a, "x1"_a, "y1"_a)
        .def("holds_many", segment_many<Holds>, "x0"_a, "y0"_a, "x1"_a, "y1"_a)
        .def("first_hit", first_hit, "x0"_a, "y0"_a, "x1"_a, "y1"_a)
        .def("crossings", crossings, "x0"_a, "y0"_a, "x1"_a, "y1"_a)
        .def("collides", collides, "other"_a)
        .def("clearance", clearance, "other"_a)
        .def("is_clear", is_clear, "other"_a, "at_least"_a);
}

}  // namespace flintknap
