// The object as a whole: as bytes, checked, weighed.
#include <nanobind/stl/string.h>

#include "kernel.hpp"

namespace flintknap {
namespace {

// Everything, as bytes.
auto dump(Kernel& k) {
    auto turn = k.settled();
    Writer writer(k.object().bytes());
    {
        nb::gil_scoped_release others_may_run;
        k.object().transfer(writer);
    }
    return to_numpy(std::move(writer).bytes());
}

// Becomes what was dumped.
void restore(Kernel& k, ByteArray bytes) {
    auto turn = k.take_turn();
    auto object = std::make_unique<Object>();
    Reader reader(bytes.data(), bytes.shape(0));
    {
        nb::gil_scoped_release others_may_run;
        object->transfer(reader);
    }
    if (!reader.at_end()) throw std::invalid_argument("there are more bytes than expected");
    k.replace(std::move(object));
}

std::string check(Kernel& k) {
    auto turn = k.with_ring();
    return k.object().check();
}

std::size_t bytes(Kernel& k) {
    auto turn = k.take_turn();
    return k.object().bytes();
}

std::int64_t touched(Kernel& k) {
    auto turn = k.settled();
    return k.object().constriction().touched();
}

// Ids of origin, target and apex of all gates that constriction took, in order of time.
auto captures(Kernel& k) {
    auto turn = k.settled();
    const Object& object = k.object();
    const Mesh& m = object.triangulation().mesh();
    std::vector<std::int64_t> ids;
    if (!object.triangulation().is_flat()) {
        object.constriction().visit_gates([&](Index edge) {
            for (Index v : {m.origin(edge), m.target(edge), m.apex(edge)}) {
                ids.push_back(object.id(v));
            }
        });
    }
    return to_numpy(std::move(ids), 3);
}

}  // namespace

void bind_whole(KernelClass& kernel) {
    using namespace nb::literals;
    kernel.def("dump", dump)
        .def("restore", restore, "dumped"_a)
        .def("check", check)
        .def("bytes", bytes)
        .def("touched", touched)
        .def("captures", captures);
}

}  // namespace flintknap
