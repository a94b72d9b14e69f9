// The kernel's face to Python: arrays in, arrays out, and nothing else of substance.
//
// A call that may take long releases the GIL and looks for signals now and then. One object serves
// one call at a time: calls from several threads take turns, those on different objects do not
// wait for each other.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "object.hpp"

namespace nb = nanobind;

namespace flintknap {
namespace {

using Doubles = nb::ndarray<const double, nb::ndim<1>, nb::device::cpu>;
using Bytes = nb::ndarray<const std::uint8_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Ids = nb::ndarray<const std::int64_t, nb::ndim<1>, nb::device::cpu>;

struct Interrupted {};

// Python's handlers run with the GIL; if one raised, its exception waits in the thread's state.
void poll_signals() {
    nb::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) throw Interrupted{};
}

// An array that owns its values, with as many columns as a row has.
template <class T>
auto to_numpy(std::vector<T>&& values, std::size_t columns = 1) {
    auto* owned = new std::vector<T>(std::move(values));
    nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
    std::size_t shape[2] = {owned->size() / columns, columns};
    return nb::ndarray<nb::numpy, T>(owned->data(), columns == 1 ? 1 : 2, shape, owner);
}

// The first row of which a coordinate is neither 0 nor of a magnitude from low to high; or -1.
std::int64_t first_outside(Doubles x, Doubles y, double low, double high) {
    auto is_inside = [&](double v) {
        double magnitude = std::fabs(v);
        return (low <= magnitude && magnitude <= high) || v == 0;
    };
    for (std::size_t i = 0; i < x.shape(0); ++i) {
        if (!is_inside(x(i)) || !is_inside(y(i))) return static_cast<std::int64_t>(i);
    }
    return -1;
}

// -0.0 and 0.0 are one place, with one hash.
Point place(double x, double y) { return {x + 0.0, y + 0.0}; }

class Kernel {
   public:
    std::int64_t insert(double x, double y) {
        auto lock = take_turn();
        return object_->insert(place(x, y));
    }

    auto insert_many(Doubles x, Doubles y) {
        std::vector<std::int64_t> ids(x.shape(0));
        alone([&] {
            object_->insert(
                ids.size(), [&](std::size_t i) { return place(x(i), y(i)); }, ids.data());
        });
        return to_numpy(std::move(ids));
    }

    // Takes one away from the multiplicity of a point; false if there is no point with that id.
    bool remove(std::int64_t id) {
        auto lock = take_turn();
        Index handle = object_->points().find(id);
        if (handle != kNone) object_->remove(handle);
        return handle != kNone;
    }

    // The same for ids that are all known, none more often than its multiplicity.
    void remove_many(Ids ids) {
        alone([&] {
            for (std::size_t i = 0; i < ids.shape(0); ++i) {
                object_->remove(object_->points().find(ids(i)));
            }
        });
    }

    // The id of the point where it came to be; -1 if there is no point with that id.
    std::int64_t move(std::int64_t id, double x, double y) {
        auto lock = take_turn();
        Index handle = object_->points().find(id);
        return handle == kNone ? -1 : object_->move(handle, place(x, y));
    }

    void clear() {
        auto lock = take_turn();
        const Points& points = object_->points();
        if (points.size() == 0) return;
        object_ = std::make_unique<Object>(points.next_id(), points.revision() + 1);
    }

    // The ids of the points at some places, -1 where there is none.
    auto find(Doubles x, Doubles y) {
        auto lock = take_turn();
        std::vector<std::int64_t> ids(x.shape(0), -1);
        for (std::size_t i = 0; i < ids.size(); ++i) {
            Index handle = object_->points().find(place(x(i), y(i)));
            if (handle != kNone) ids[i] = object_->points().id(handle);
        }
        return to_numpy(std::move(ids));
    }

    auto ids() {
        auto lock = take_turn();
        return to_numpy(object_->points().ids());
    }

    std::int64_t revision() {
        auto lock = take_turn();
        return object_->points().revision();
    }

    std::size_t size() {
        auto lock = take_turn();
        return object_->points().size();
    }

    int side(double x, double y) {
        auto lock = settled();
        return flintknap::side(object_->triangulation(), object_->constriction(), {x, y}, kNone);
    }

    auto side_many(Doubles x, Doubles y) {
        std::vector<std::int8_t> answers(x.shape(0));
        auto lock = settled();
        nb::gil_scoped_release others_may_run;
        for (std::size_t i = 0; i < answers.size(); ++i) {
            answers[i] = static_cast<std::int8_t>(flintknap::side(
                object_->triangulation(), object_->constriction(), {x(i), y(i)}, kNone));
        }
        nb::gil_scoped_acquire enough;
        return to_numpy(std::move(answers));
    }

    // Coordinates of the points of some ids.
    auto points(Ids ids) {
        auto lock = take_turn();
        std::vector<double> xy;
        xy.reserve(2 * ids.shape(0));
        for (std::size_t i = 0; i < ids.shape(0); ++i) {
            Point p = object_->points().point(object_->points().find(ids(i)));
            xy.push_back(p.x);
            xy.push_back(p.y);
        }
        return to_numpy(std::move(xy), 2);
    }

    // How often each point is there; 0 if there is no point with that id.
    auto multiplicity(Ids ids) {
        auto lock = take_turn();
        std::vector<std::int64_t> out(ids.shape(0));
        for (std::size_t i = 0; i < out.size(); ++i) {
            Index handle = object_->points().find(ids(i));
            out[i] = handle == kNone ? 0 : object_->points().multiplicity(handle);
        }
        return to_numpy(std::move(out));
    }

    // The ids along the ring from the smallest vertex on, and the coordinates; empty if the points
    // lie on a line.
    auto ring() {
        auto lock = settled();
        const Triangulation& t = object_->triangulation();
        const Constriction& c = object_->constriction();
        std::vector<std::int64_t> ids;
        std::vector<double> xy;
        if (!t.is_flat()) {
            ids.reserve(at(t.size() - c.left_inside()));
            xy.reserve(2 * ids.capacity());
            Index v = t.smallest();
            do {
                ids.push_back(object_->points().id_in_slot(v));
                xy.push_back(t.site(v).x);
                xy.push_back(t.site(v).y);
                v = c.following(v);
            } while (v != t.smallest());
        }
        return nb::make_tuple(to_numpy(std::move(ids)), to_numpy(std::move(xy), 2));
    }

    // The ids of the vertices that are not on the ring, in no order.
    auto left_inside() {
        auto lock = settled();
        const Triangulation& t = object_->triangulation();
        std::vector<std::int64_t> ids;
        for (Index v = 0; !t.is_flat() && v < t.slots(); ++v) {
            if (t.is_site(v) && !object_->constriction().on_ring(v))
                ids.push_back(object_->points().id_in_slot(v));
        }
        return to_numpy(std::move(ids));
    }

    bool is_flat() {
        auto lock = placed();
        return object_->triangulation().is_flat();
    }

    // Three ids a triangle, counter-clockwise, in no order.
    auto triangles() {
        auto lock = placed();
        const Mesh& m = object_->triangulation().mesh();
        std::vector<std::int64_t> ids;
        for (Index x = 0; x < m.triangles(); ++x) {
            if (m.is_free(x) || m.is_ghost(x)) continue;
            for (Index h = 3 * x; h < 3 * x + 3; ++h)
                ids.push_back(object_->points().id_in_slot(m.origin(h)));
        }
        return to_numpy(std::move(ids), 3);
    }

    // Two ids an edge, in no order.
    auto edges(Graph graph) {
        auto lock = placed();
        const Mesh& m = object_->triangulation().mesh();
        std::vector<std::int64_t> ids;
        for (Index h : edges_of(object_->triangulation(), graph)) {
            ids.push_back(object_->points().id_in_slot(m.origin(h)));
            ids.push_back(object_->points().id_in_slot(m.target(h)));
        }
        return to_numpy(std::move(ids), 2);
    }

    // (gamma0, gamma1) a row; not a number where the pair is no edge.
    auto gamma(Ids a, Ids b) {
        auto lock = placed();
        const Triangulation& t = object_->triangulation();
        std::vector<double> out;
        out.reserve(2 * a.shape(0));
        for (std::size_t i = 0; i < a.shape(0); ++i) {
            Index h = t.edge_between(object_->points().slot(object_->points().find(a(i))),
                                     object_->points().slot(object_->points().find(b(i))));
            constexpr double none = std::numeric_limits<double>::quiet_NaN();
            Gamma g = h == kNone ? Gamma{none, none} : gamma_of_edge(t, h);
            out.push_back(g.gamma0);
            out.push_back(g.gamma1);
        }
        return to_numpy(std::move(out), 2);
    }

    // Everything, as bytes.
    auto dump() {
        auto lock = settled();
        Writer writer(object_->bytes());
        {
            nb::gil_scoped_release others_may_run;
            object_->transfer(writer);
        }
        return to_numpy(std::move(writer).bytes());
    }

    // Becomes what was dumped.
    void restore(Bytes bytes) {
        auto lock = take_turn();
        auto object = std::make_unique<Object>();
        Reader reader(bytes.data(), bytes.shape(0));
        {
            nb::gil_scoped_release others_may_run;
            object->transfer(reader);
        }
        if (!reader.at_end()) throw std::invalid_argument("there are more bytes than expected");
        object_ = std::move(object);
    }

    std::string check() {
        auto lock = settled();
        return object_->check();
    }

    std::size_t bytes() {
        auto lock = take_turn();
        return object_->bytes();
    }

    std::int64_t touched() {
        auto lock = settled();
        return object_->constriction().touched();
    }

   private:
    // Never waits for the lock with the GIL: who holds the lock may be waiting for the GIL.
    std::unique_lock<std::mutex> take_turn() {
        std::unique_lock lock(mutex_, std::try_to_lock);
        if (!lock) {
            nb::gil_scoped_release others_may_run;
            lock.lock();
        }
        return lock;
    }

    template <class Work>
    void alone(Work work) {
        auto lock = take_turn();
        nb::gil_scoped_release others_may_run;
        work();
    }

    // This object's turn, with all points in the triangulation.
    std::unique_lock<std::mutex> placed() {
        auto lock = take_turn();
        if (!object_->is_placed()) bring_up([&](auto poll) { object_->place(poll); });
        return lock;
    }

    // This object's turn, with everything up to date.
    std::unique_lock<std::mutex> settled() {
        auto lock = take_turn();
        if (!object_->is_settled()) bring_up([&](auto poll) { object_->settle(poll); });
        return lock;
    }

    template <class Work>
    void bring_up(Work work) {
        if (!object_->is_long_to_settle()) return work([] {});
        try {
            nb::gil_scoped_release others_may_run;
            work(poll_signals);
        } catch (const Interrupted&) {
            throw nb::python_error();
        }
    }

    std::unique_ptr<Object> object_ = std::make_unique<Object>();
    std::mutex mutex_;
};

}  // namespace
}  // namespace flintknap

NB_MODULE(_kernel, m) {
    using namespace flintknap;
    using namespace nb::literals;

    m.def("first_outside", &first_outside, "x"_a, "y"_a, "low"_a, "high"_a);
    m.def("orient", [](double ax, double ay, double bx, double by, double cx, double cy) {
        return orient({ax, ay}, {bx, by}, {cx, cy});
    });
    m.def("dot_sign", [](double ix, double iy, double jx, double jy, double kx, double ky) {
        return dot_sign({ix, iy}, {jx, jy}, {kx, ky});
    });
    m.def("cotangent", [](double ix, double iy, double jx, double jy, double kx, double ky) {
        return cotangent({ix, iy}, {jx, jy}, {kx, ky});
    });
    m.def("in_circle",
          [](double ax, double ay, double bx, double by, double cx, double cy, double dx,
             double dy) { return in_circle({ax, ay}, {bx, by}, {cx, cy}, {dx, dy}); });
    m.def("in_circle_perturbed",
          [](double ax, double ay, double bx, double by, double cx, double cy, double dx,
             double dy) { return in_circle_perturbed({ax, ay}, {bx, by}, {cx, cy}, {dx, dy}); });

    nb::enum_<Graph>(m, "Graph")
        .value("delaunay", Graph::delaunay)
        .value("gabriel", Graph::gabriel)
        .value("hull", Graph::hull);

    nb::class_<Kernel>(m, "Kernel")
        .def(nb::init<>())
        .def("insert", &Kernel::insert, "x"_a, "y"_a)
        .def("insert_many", &Kernel::insert_many, "x"_a, "y"_a)
        .def("remove", &Kernel::remove, "point_id"_a)
        .def("remove_many", &Kernel::remove_many, "ids"_a)
        .def("move", &Kernel::move, "point_id"_a, "x"_a, "y"_a)
        .def("clear", &Kernel::clear)
        .def("find", &Kernel::find, "x"_a, "y"_a)
        .def("ids", &Kernel::ids)
        .def("revision", &Kernel::revision)
        .def("__len__", &Kernel::size)
        .def("side", &Kernel::side, "x"_a, "y"_a)
        .def("side_many", &Kernel::side_many, "x"_a, "y"_a)
        .def("points", &Kernel::points, "ids"_a)
        .def("multiplicity", &Kernel::multiplicity, "ids"_a)
        .def("ring", &Kernel::ring)
        .def("left_inside", &Kernel::left_inside)
        .def("is_flat", &Kernel::is_flat)
        .def("triangles", &Kernel::triangles)
        .def("edges", &Kernel::edges, "graph"_a)
        .def("gamma", &Kernel::gamma, "a"_a, "b"_a)
        .def("dump", &Kernel::dump)
        .def("restore", &Kernel::restore, "dumped"_a)
        .def("check", &Kernel::check)
        .def("bytes", &Kernel::bytes)
        .def("touched", &Kernel::touched);
}
