"""Methods that answer floats without Python: the same answers, and methods in every other way."""

from __future__ import annotations

import contextlib
import copy
import functools
import gc
import inspect
import itertools
import os
import pickle
import pydoc
import resource
import signal
import subprocess
import sys
import types
import weakref
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import flintknap as fk
from flintknap._kernel import Kernel, quick

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

OF_PLACES = ("side", "contains", "distance")
OF_SEGMENTS = ("intersects", "contains_segment")
COUNTS = {"insert": 2, **dict.fromkeys(OF_PLACES, 2), **dict.fromkeys(OF_SEGMENTS, 4)}
NAMES = tuple(COUNTS)
NOTCHED = [(0.0, 0.0), (2.0, 1.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)]
COORDINATES = (-1.0, -0.0, 0.5, 1.0, 2.0, 4.0, 7.25)


@pytest.fixture
def engine() -> fk.Engine:
    engine = fk.Engine()
    engine.insert(NOTCHED)
    return engine


def slow(name: str) -> Callable[..., Any]:
    """The function of Python behind a method."""
    function = getattr(fk.Engine, name).__wrapped__
    assert isinstance(function, types.FunctionType)
    return function


@contextlib.contextmanager
def frames() -> Iterator[list[str]]:
    """Names of the functions of Python that are called meanwhile."""
    called: list[str] = []

    def note(frame: types.FrameType, event: str, _: object) -> None:
        if event == "call":
            called.append(frame.f_code.co_name)

    sys.setprofile(note)
    try:
        yield called
    finally:
        sys.setprofile(None)


# ---------------------------------------------------------------- answers
@pytest.mark.parametrize("name", OF_PLACES + OF_SEGMENTS)
def test_answers_are_those_of_the_function(engine: fk.Engine, name: str) -> None:
    method, seen = getattr(engine, name), set()
    for given in itertools.product(COORDINATES, repeat=COUNTS[name]):
        told = method(*given)
        expected = slow(name)(engine, *given)
        assert (told, type(told)) == (expected, type(expected))
        assert told == slow(name)(engine, *([v] for v in given))[0]
        seen.add(told)
    assert len(seen) >= 2


def test_inserted_points_are_those_of_the_function(engine: fk.Engine) -> None:
    other = fk.Engine()
    other.insert(NOTCHED)
    for x, y in itertools.product(COORDINATES, repeat=2):
        told, expected = engine.insert(x, y), slow("insert")(other, x, y)
        assert (told, type(told)) == (expected, int)
    assert engine.digest() == other.digest()
    assert engine.insert(-0.0, 0.0) == 0
    assert engine.multiplicity(0) == 3  # with the one among all pairs
    assert str(engine.points([0])[0, 0]) == "0.0"
    engine.check()


@pytest.mark.parametrize("name", NAMES)
def test_only_plain_floats_need_no_function(engine: fk.Engine, name: str) -> None:
    given = [0.5, 1.5, 2.5, 1.25][: COUNTS[name]]
    engine.side(0.0, 0.0)
    with frames() as called:
        getattr(engine, name)(*given)
        getattr(fk.Engine, name)(engine, *given)
        getattr(engine, name)(*map(np.float64, given))  # which are floats of Python, too
    assert name not in called
    parameters = list(inspect.signature(getattr(engine, name)).parameters)
    asked: list[Callable[[], object]] = [
        lambda: getattr(engine, name)(*given[:-1], 1),
        lambda: getattr(engine, name)(*given[:-1], **{parameters[len(given) - 1]: given[-1]}),
        lambda: getattr(engine, name)(*given[:-1], np.array(given[-1])),
        lambda: getattr(engine, name)([given[0]], *given[1:]),
    ]
    for ask in asked:
        with frames() as called:
            ask()
        assert called.count(name) == 1


def test_a_place_that_has_changed_sides(engine: fk.Engine) -> None:
    assert engine.contains(2.0, 0.75) is False
    engine.remove(1)
    assert engine.contains(2.0, 0.75) is True
    assert engine.insert(2.0, 1.0) == 5
    assert engine.contains(2.0, 0.75) is False
    assert engine.distance(2.0, 1.0) == 0.0


# ---------------------------------------------------------------- methods in every other way
@pytest.mark.parametrize("name", NAMES)
def test_they_look_like_the_function(engine: fk.Engine, name: str) -> None:
    method, function = getattr(fk.Engine, name), slow(name)
    for attribute in ("__doc__", "__name__", "__qualname__", "__module__", "__annotations__"):
        assert getattr(method, attribute) == getattr(function, attribute)
    assert inspect.signature(method) == inspect.signature(function)
    assert "self" not in inspect.signature(getattr(engine, name)).parameters
    assert inspect.getsource(method).lstrip().startswith("@quick\n")
    assert inspect.isroutine(method)
    assert inspect.ismethod(getattr(engine, name))
    assert f" {name}(self, " in pydoc.render_doc(fk.Engine, renderer=pydoc.plaintext)
    assert function.__doc__.splitlines()[0] in pydoc.render_doc(method, renderer=pydoc.plaintext)
    assert f"bound method {function.__qualname__} of" in repr(getattr(engine, name))


def test_they_are_bound_as_functions_are(engine: fk.Engine) -> None:
    assert fk.Engine.contains is fk.Engine.__mro__[1].__dict__["contains"]
    assert engine.contains.__self__ is engine
    assert engine.contains == engine.contains
    assert functools.partial(fk.Engine.contains, engine, 0.5)(1.5) is True
    assert list(map(engine.contains, [0.5, 9.0], [1.5, 9.0])) == [True, False]
    assert fk.Engine.contains.__get__(engine)(0.5, 1.5) is True
    assert fk.Engine.contains.__get__(None, fk.Engine) is fk.Engine.contains


def test_subclasses_may_have_their_own() -> None:
    class Moved(fk.Engine):
        def contains(self, x: Any, y: Any = None) -> Any:
            return super().contains(x - 10.0, y)

    class Named(fk.Engine):
        __slots__ = ()
        hidden = fk.Engine.contains

    for kind, place in ((Moved, (10.5, 1.5)), (Named, (0.5, 1.5))):
        engine = kind()
        engine.insert(NOTCHED)
        assert engine.contains(*place) is True
        assert engine.side(0.5, 1.5) == 1
    assert engine.hidden(0.5, 1.5) is True  # type: ignore[attr-defined]


def test_copies_are_told_by_name() -> None:
    for name in NAMES:
        method = getattr(fk.Engine, name)
        for protocol in range(4, pickle.HIGHEST_PROTOCOL + 1):
            assert pickle.loads(pickle.dumps(method, protocol)) is method
        assert copy.copy(method) is copy.deepcopy(method) is method


def test_they_take_attributes_and_are_watched(engine: fk.Engine) -> None:
    method: Any = quick(slow("side"))
    method.note = "seen"
    assert vars(method)["note"] == "seen"
    assert weakref.WeakMethod(engine.contains)()(0.5, 1.5) is True  # type: ignore[misc]


# ---------------------------------------------------------------- refusals
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("bad", [float("nan"), float("inf"), 1e300, 1e-300, "1", None, 1j])
def test_refusals_are_those_of_the_function(engine: fk.Engine, name: str, bad: object) -> None:
    for at in range(COUNTS[name]):
        given: list[object] = [1.5] * COUNTS[name]
        given[at] = bad
        with pytest.raises(fk.InputError) as told:
            getattr(engine, name)(*given)
        with pytest.raises(fk.InputError) as expected:
            slow(name)(engine, *given)
        assert str(told.value) == str(expected.value)
    assert len(engine) == len(NOTCHED)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("given", [(), (0.5,) * 3, (0.5,) * 5, (0.5,) * 6])
def test_other_counts_of_arguments(engine: fk.Engine, name: str, given: tuple[float, ...]) -> None:
    with pytest.raises(TypeError) as told:
        getattr(engine, name)(*given)
    with pytest.raises(TypeError) as expected:
        slow(name)(engine, *given)
    assert str(told.value) == str(expected.value)
    with pytest.raises(TypeError, match="argument"):
        getattr(fk.Engine, name)()


@pytest.mark.parametrize("name", NAMES)
def test_what_is_no_engine_is_left_to_the_function(name: str) -> None:
    given = (0.5,) * COUNTS[name]
    half = fk.Engine.__new__(fk.Engine)
    for other in (object(), None, 1.5, half, types.SimpleNamespace(_kernel=None)):
        with pytest.raises(AttributeError) as told:
            getattr(fk.Engine, name)(other, *given)
        with pytest.raises(AttributeError) as expected:
            slow(name)(other, *given)
        assert str(told.value) == str(expected.value)
    half._kernel = Kernel.__new__(Kernel)
    with pytest.warns(RuntimeWarning, match="uninitialized"), pytest.raises(TypeError):
        getattr(fk.Engine, name)(half, *given)


def test_a_function_without_an_answer() -> None:
    with pytest.raises(ValueError, match="got nearest"):
        quick(fk.Engine.nearest)
    with pytest.raises(AttributeError, match="__name__"):
        quick(1)  # type: ignore[type-var]
    with pytest.raises(TypeError):
        type(fk.Engine.side)()


def test_a_class_without_a_slot() -> None:
    with pytest.raises((TypeError, RuntimeError)) as told:  # wrapped before Python 3.12

        class Loose:
            _kernel = None
            side = quick(slow("side"))

    assert "has no slot _kernel" in str(told.value.__cause__ or told.value)
    with pytest.raises(TypeError):
        fk.Engine.side.__set_name__("Loose", "side")  # type: ignore[attr-defined]
    loose: Any = quick(slow("side"))
    engine = fk.Engine()
    with frames() as called:
        assert loose(engine, 0.5, 1.5) == -1  # which no class has
    assert "side" in called


# ---------------------------------------------------------------- what may go wrong
def crowd(n: int) -> fk.Engine:
    engine = fk.Engine()
    engine.insert(np.random.default_rng(3).random((n, 2)))
    return engine


@contextlib.contextmanager
def alarm(handle: Callable[[int, object], None]) -> Iterator[None]:
    before = signal.signal(signal.SIGALRM, handle)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.01)
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize("name", OF_PLACES + OF_SEGMENTS)
def test_an_interrupt_reaches_the_caller(name: str) -> None:
    def interrupt(_: int, __: object) -> None:
        raise KeyboardInterrupt

    engine, given = crowd(200_000), (0.5, 0.25, 0.75, 0.5)[: COUNTS[name]]
    with alarm(interrupt), pytest.raises(KeyboardInterrupt):
        getattr(engine, name)(*given)
    assert getattr(engine, name)(*given) == slow(name)(engine, *given)


def test_a_kernel_stays_until_its_answer_is_there() -> None:
    gone = []

    def replace(_: int, __: object) -> None:
        engine._kernel = fk.Engine()._kernel
        gc.collect()
        gone.append(True)

    engine = crowd(200_000)
    vertex = engine.points([0])[0].tolist()
    with alarm(replace):
        assert engine.contains(*vertex) is True  # of the old one
    assert gone
    assert engine.contains(*vertex) is False


@pytest.mark.skipif("asan" in os.environ.get("LD_PRELOAD", ""), reason="it has memory of its own")
def test_the_end_of_memory_reaches_the_caller() -> None:
    program = f"""if True:
        import resource
        import numpy as np
        import flintknap as fk
        engine = fk.Engine()
        points = np.random.default_rng(3).random((100_000, 2))
        engine.insert(points)
        used = int(open("/proc/self/statm").read().split()[0]) * {resource.getpagesize()}
        bounds = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(resource.RLIMIT_AS, (used, bounds[1]))
        try:
            engine.contains(*points[0].tolist())
        except MemoryError:
            resource.setrlimit(resource.RLIMIT_AS, bounds)
            print(engine.contains(*points[0].tolist()), engine.side(2.0, 0.5))
    """
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    assert done.stdout == b"True -1\n"


def test_nothing_is_kept(engine: fk.Engine) -> None:
    given, told = (0.5, 1.5, 2.5, 1.25), []
    watched = [engine, engine._kernel, *given, True, False, *map(slow, NAMES)]

    def ask_all() -> None:
        for name, count in COUNTS.items():
            method = getattr(engine, name)
            told.append(method(*given[:count]))
            told.append(method(*given[: count - 1], 2))
            for bad in (float("nan"), "1"):
                with contextlib.suppress(fk.InputError):
                    method(*given[: count - 1], bad)
            with contextlib.suppress(AttributeError):
                getattr(fk.Engine, name)(None, *given[:count])
            with contextlib.suppress(TypeError):
                method(*given, *given)
        told.clear()
        gc.collect()

    ask_all()
    before = [sys.getrefcount(each) for each in watched]
    for _ in range(10):
        ask_all()
    assert [sys.getrefcount(each) for each in watched] == before


def test_circles_are_found() -> None:
    def made() -> list[weakref.ref[Any]]:
        class Owner:
            __slots__ = ("__weakref__", "_kernel")

            @quick
            def side(self, x: float, y: float) -> object:
                return Owner, x, y

        Owner.side.owner = Owner  # type: ignore[attr-defined]
        assert Owner().__class__.side.__wrapped__ is not None  # type: ignore[attr-defined]
        return [weakref.ref(Owner), weakref.ref(Owner.side), weakref.ref(slow_of(Owner.side))]

    def slow_of(method: Any) -> Any:
        return method.__wrapped__

    gc.collect()
    watched = made()
    gc.collect()
    assert [each() for each in watched] == [None] * 3
