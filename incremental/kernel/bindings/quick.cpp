// Questions of plain numbers, without a frame of Python on their way to the kernel.
//
// Theory. A method such as contains(x, y) is a Python function: there are its words, its types, and
// what arrays, levels and errors ask for. Two floats need none of that, and the frame costs more
// than the answer. So `quick`, a decorator, puts an object in the place of the function. Called as
//
//      contains(engine, x, y)      with nothing but floats, two of a place, four of a segment,
//                                  all admissible, of an engine whose _kernel is a Kernel,
//
// it asks the kernel; called in any other way it calls the function, which then has to answer
// such calls as well, and alike. In a class it is what a function is, a method once it is looked
// up; and inspect, help and pickle see the function.
//
// What the kernel throws becomes the exception it would become on the way through nanobind. Costs
// what is asked and little more: a kernel that is in a slot is found without a look-up. Refuses
// functions whose names it does not know, and classes without that slot.
#include <Python.h>
#include <structmember.h>

#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "../collision.hpp"
#include "kernel.hpp"

namespace flintknap {
namespace {

// ------------------------------------------------------------------ answers
// New references, or nullptr and an error of Python.
PyObject* insert_one(Kernel& k, Point p) {
    auto turn = k.take_turn();
    return PyLong_FromLongLong(k.object().insert(place(p.x, p.y)));
}

PyObject* side_one(Kernel& k, Point q) {
    return PyLong_FromLong(k.ask([&](Object& object) { return object.cells().side(q); }));
}

PyObject* contains_one(Kernel& k, Point q) {
    return PyBool_FromLong(k.ask([&](Object& object) { return object.cells().side(q) >= 0; }));
}

PyObject* distance_one(Kernel& k, Point q) {
    return PyFloat_FromDouble(k.ask([&](Object& object) {
        return NearestSearch(object.ring(), &object.cells()).ask_distance(q);
    }));
}

template <class Question>
PyObject* segment_one(Kernel& k, Point p, Point q) {
    return PyBool_FromLong(
        k.ask([&](Object& object) { return tell<Question>(object.cells(), p, q); }));
}

// ------------------------------------------------------------------ what stands in for a function
struct Quick {
    PyObject head;
    vectorcallfunc call;
    PyTypeObject *owner, *kernel;  // the class it was made for; that of kernels
    Py_ssize_t offset;             // of the slot with the kernel in instances of the owner
    PyObject* function;
    PyObject *attributes, *watchers;

    // That of what may be an engine, or nullptr.
    PyObject* kernel_of(PyObject* engine) const {
        if (owner == nullptr || !PyObject_TypeCheck(engine, owner)) return nullptr;
        PyObject* held = *reinterpret_cast<PyObject**>(reinterpret_cast<char*>(engine) + offset);
        return held != nullptr && Py_TYPE(held) == kernel && nb::inst_ready(held) ? held : nullptr;
    }
};

Quick& quick_of(PyObject* self) { return *reinterpret_cast<Quick*>(self); }

using OfPlace = PyObject* (*)(Kernel&, Point);
using OfSegment = PyObject* (*)(Kernel&, Point, Point);

template <auto answer>
PyObject* call(PyObject* self, PyObject* const* given, std::size_t flags, PyObject* names) {
    constexpr bool of_segment = std::is_same_v<decltype(answer), OfSegment>;
    static_assert(of_segment || std::is_same_v<decltype(answer), OfPlace>);
    constexpr Py_ssize_t count = of_segment ? 5 : 3;
    const Quick& quick = quick_of(self);
    if (names == nullptr && PyVectorcall_NARGS(flags) == count) {
        std::optional<Point> p = as_place(given[1], given[2]);
        std::optional<Point> q = as_place(given[count - 2], given[count - 1]);
        PyObject* held = p && q ? quick.kernel_of(given[0]) : nullptr;
        if (held != nullptr) {
            // Until the answer is there, whatever becomes of the engine meanwhile.
            nb::object kept = nb::borrow(held);
            Kernel& kernel = *nb::inst_ptr<Kernel>(kept);
            try {
                if constexpr (of_segment) {
                    return answer(kernel, *p, *q);
                } else {
                    return answer(kernel, *p);
                }
            } catch (nb::python_error& error) {
                error.restore();
            } catch (const std::bad_alloc& error) {
                PyErr_SetString(PyExc_MemoryError, error.what());
            } catch (const std::exception& error) {
                PyErr_SetString(PyExc_RuntimeError, error.what());
            }
            return nullptr;
        }
    }
    return PyObject_Vectorcall(quick.function, given, flags, names);
}

// By the names of functions.
constexpr std::pair<std::string_view, vectorcallfunc> kAnswers[] = {
    {"insert", call<insert_one>},
    {"side", call<side_one>},
    {"contains", call<contains_one>},
    {"distance", call<distance_one>},
    {"intersects", call<segment_one<Intersects>>},
    {"contains_segment", call<segment_one<Holds>>},
};

// ------------------------------------------------------------------ its type
PyObject* bind(PyObject* self, PyObject* owner, PyObject*) {
    return owner == nullptr ? Py_NewRef(self) : PyMethod_New(self, owner);
}

// Called when a class is made that has it: the first one is its owner.
PyObject* set_name(PyObject* self, PyObject* given) {
    Quick& quick = quick_of(self);
    PyObject *owner, *name;
    if (!PyArg_ParseTuple(given, "O!U", &PyType_Type, &owner, &name)) return nullptr;
    if (quick.owner != nullptr) Py_RETURN_NONE;
    PyObject* slot = PyObject_GetAttrString(owner, "_kernel");
    if (slot == nullptr) return nullptr;
    bool is_slot = Py_IS_TYPE(slot, &PyMemberDescr_Type);
    if (is_slot) {
        quick.offset = reinterpret_cast<PyMemberDescrObject*>(slot)->d_member->offset;
        quick.owner = reinterpret_cast<PyTypeObject*>(Py_NewRef(owner));
    } else {
        PyErr_Format(PyExc_TypeError, "got %R, which has no slot _kernel", owner);
    }
    Py_DECREF(slot);
    return is_slot ? Py_NewRef(Py_None) : nullptr;
}

// Functions are told by their names, and copies of them are the same.
PyObject* reduce(PyObject* self, PyObject*) { return PyObject_GetAttrString(self, "__qualname__"); }

int traverse(PyObject* self, visitproc visit, void* arg) {
    Quick& quick = quick_of(self);
    Py_VISIT(Py_TYPE(self));
    Py_VISIT(quick.owner);
    Py_VISIT(quick.kernel);
    Py_VISIT(quick.function);
    Py_VISIT(quick.attributes);
    return 0;
}

// The function stays, to be called to the end: no circle is without something else to be cleared.
int clear(PyObject* self) {
    Py_CLEAR(quick_of(self).owner);
    Py_CLEAR(quick_of(self).attributes);
    return 0;
}

void dealloc(PyObject* self) {
    PyTypeObject* type = Py_TYPE(self);
    PyObject_GC_UnTrack(self);
    if (quick_of(self).watchers != nullptr) PyObject_ClearWeakRefs(self);
    clear(self);
    Py_XDECREF(quick_of(self).function);
    Py_XDECREF(quick_of(self).kernel);
    type->tp_free(self);
    Py_DECREF(type);
}

nb::object make_type() {
    static PyMethodDef methods[] = {{"__reduce__", reduce, METH_NOARGS, nullptr},
                                    {"__set_name__", set_name, METH_VARARGS, nullptr},
                                    {}};
    static PyMemberDef members[] = {
        {"__vectorcalloffset__", T_PYSSIZET, offsetof(Quick, call), READONLY, nullptr},
        {"__dictoffset__", T_PYSSIZET, offsetof(Quick, attributes), READONLY, nullptr},
        {"__weaklistoffset__", T_PYSSIZET, offsetof(Quick, watchers), READONLY, nullptr},
        {}};
    static PyGetSetDef properties[] = {
        {"__dict__", PyObject_GenericGetDict, PyObject_GenericSetDict, nullptr, nullptr}, {}};
    static PyType_Slot slots[] = {{Py_tp_call, reinterpret_cast<void*>(PyVectorcall_Call)},
                                  {Py_tp_descr_get, reinterpret_cast<void*>(bind)},
                                  {Py_tp_traverse, reinterpret_cast<void*>(traverse)},
                                  {Py_tp_clear, reinterpret_cast<void*>(clear)},
                                  {Py_tp_dealloc, reinterpret_cast<void*>(dealloc)},
                                  {Py_tp_methods, methods},
                                  {Py_tp_members, members},
                                  {Py_tp_getset, properties},
                                  {0, nullptr}};
    constexpr unsigned flags = Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_GC |
                               Py_TPFLAGS_HAVE_VECTORCALL | Py_TPFLAGS_METHOD_DESCRIPTOR |
                               Py_TPFLAGS_DISALLOW_INSTANTIATION;
    static PyType_Spec spec = {"flintknap._kernel.Quick", sizeof(Quick), 0, flags, slots};
    PyObject* type = PyType_FromSpec(&spec);
    if (type == nullptr) throw nb::python_error();
    return nb::steal(type);
}

nb::object quick(nb::handle type, nb::handle function) {
    nb::str name(function.attr("__name__"));
    for (const auto& [known, call] : kAnswers) {
        if (known != name.c_str()) continue;
        auto* made = reinterpret_cast<PyTypeObject*>(type.ptr());
        nb::object object = nb::steal(made->tp_alloc(made, 0));
        if (!object.is_valid()) throw nb::python_error();
        Quick& quick = quick_of(object.ptr());
        quick.call = call;
        quick.function = Py_NewRef(function.ptr());
        quick.kernel = reinterpret_cast<PyTypeObject*>(Py_NewRef(nb::type<Kernel>().ptr()));
        nb::module_::import_("functools").attr("update_wrapper")(object, function);
        return object;
    }
    throw nb::value_error(("got " + std::string(name.c_str()) + ", which has no answer").c_str());
}

}  // namespace

void bind_quick(nb::module_& module) {
    using namespace nb::literals;
    module.def(
        "quick", [type = make_type()](nb::handle function) { return quick(type, function); },
        "function"_a);
}

}  // namespace flintknap
