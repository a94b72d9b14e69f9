"""Scenes against all pairs, while their objects come, go, move and degenerate."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flintknap as fk
import strategies
from flintknap.events import Contact, Event, Insert, Query, Remove
from flintknap.replay import replay
from strategies import Points

SQUARE = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])


def made(points: Points) -> fk.Engine:
    engine = fk.Engine()
    engine.insert(points)
    return engine


def square(x: float, y: float = 0.0, size: float = 1.0) -> fk.Engine:
    return made(size * SQUARE + (x, y))


def all_pairs(scene: fk.Scene) -> list[tuple[str, str]]:
    names = sorted(scene)
    return [(a, b) for a in names for b in names if a < b and scene[a].collides(scene[b])]


def judge(scene: fk.Scene, x: float, y: float) -> None:
    assert scene.collisions() == all_pairs(scene)
    assert scene.contains(x, y) == sorted(name for name in scene if scene[name].contains(x, y))
    name, told = scene.nearest(x, y)
    far = [(scene[each].distance(x, y), each) for each in scene]
    least = min(far, default=(math.inf, ""))
    assert (told.distance, name) == (least if least[0] < math.inf else (math.inf, None))
    same_of_many(scene, np.array([(x, y), (y, x), (x, y), (0.5, 0.5)]))
    scene.check()


def same_of_many(scene: fk.Scene, places: Points) -> None:
    """Arrays are answered as each place is."""
    held = scene.contains(places)
    singles = [scene.contains(x, y) for x, y in places.tolist()]
    assert isinstance(held, fk.Held)
    pairs = list(zip(held.place.tolist(), held.name.tolist(), strict=True))
    assert pairs == [(i, name) for i, names in enumerate(singles) for name in names]
    names, told = scene.nearest(places[:, 0], places[:, 1])
    for i, (x, y) in enumerate(places.tolist()):
        name, single = scene.nearest(x, y)
        assert names[i] == name
        np.testing.assert_equal([column[i] for column in told], list(single))


def test_a_mapping_of_names() -> None:
    first, second = square(0.0), square(5.0)
    scene = fk.Scene({"b": first, "a": second})
    assert list(scene) == ["b", "a"]
    assert scene["a"] is second
    assert scene.collisions() == []
    scene["c"] = square(1.0)  # touches b along a side
    assert scene.collisions() == [("b", "c")]
    scene["b"] = square(5.5, 0.5)
    assert scene.collisions() == [("a", "b")]
    del scene["a"]
    assert scene.collisions() == []
    with pytest.raises(KeyError):
        del scene["a"]
    assert len(scene) == 2
    judge(scene, 0.0, 0.0)


def test_objects_that_change() -> None:
    scene = fk.Scene({"a": square(0.0), "b": square(2.0), "c": fk.Engine()})
    assert scene.collisions() == []
    scene["a"].insert(3.0, 0.5)
    assert scene.collisions() == [("a", "b")]
    scene["c"].insert([0.5, 0.6], [0.5, 0.5])
    assert scene.collisions() == [("a", "b")]
    scene["c"].insert(0.5, 0.6)
    assert scene.collisions() == [("a", "b"), ("a", "c")]
    assert scene.contains(0.55, 0.52) == ["a", "c"]
    scene["a"].clear()
    assert scene.collisions() == []
    judge(scene, 0.55, 0.52)


def test_one_engine_under_two_names() -> None:
    engine = square(0.0)
    scene = fk.Scene({"a": engine, "b": engine})
    assert scene.collisions() == [("a", "b")]
    assert scene.nearest(5.0, 0.5)[0] == "a"


def test_an_empty_scene() -> None:
    scene = fk.Scene()
    assert scene.collisions() == scene.contains(0.0, 0.0) == []
    name, told = scene.nearest(0.0, 0.0)
    assert name is None
    assert told.distance == math.inf
    with pytest.raises(fk.InputError, match="y: got nan"):
        scene.contains(0.0, math.nan)
    with pytest.raises(fk.InputError, match="row 1: got"):
        scene.nearest([0.0, math.nan], 0.0)
    assert [len(column) for column in scene.contains([0.0, 1.0], 0.0)] == [0, 0]
    names, told = scene.nearest([0.0, 1.0], 0.0)
    assert names.tolist() == [None, None]
    assert told.distance.tolist() == [math.inf, math.inf]
    assert told.start.tolist() == [-1, -1]


def test_many_places_at_once() -> None:
    scene = fk.Scene({"b": square(0.0), "a": square(0.5), "c": square(5.0), "flat": fk.Engine()})
    del scene["b"]
    scene["d"] = square(0.0)
    held = scene.contains([[0.25, 0.75], [1.0, 9.0]], 0.5)
    assert held.place.tolist() == [0, 1, 1, 2, 2]
    assert held.name.tolist() == ["d", "a", "d", "a", "d"]
    names, told = scene.nearest([[0.25, 3.5], [1.0, 9.0]], np.float32(0.5))
    assert names.tolist() == [["a", "c"], ["d", "c"]]  # the first of two by name, first
    assert told.distance.tolist() == [[0.25, 1.5], [0.0, 3.0]]
    assert told.x.dtype == told.distance.dtype == np.float64
    assert told.start.dtype == np.int64
    assert scene.contains(np.float64(0.25), 0) == ["d"]
    assert scene.nearest(9, 0)[0] == "c"
    assert [len(column) for column in scene.contains(np.zeros((0, 2)))] == [0, 0]


def test_many_places_in_many_objects() -> None:
    rng = np.random.default_rng(9)
    scene = fk.Scene()
    for i in range(60):
        x, y = rng.uniform(-3, 3, 2).tolist()
        scene[f"{i}"] = square(x, y, 10.0 ** rng.uniform(-2, 0.5))
    same_of_many(scene, np.concatenate([rng.uniform(-4, 4, (300, 2)), scene["7"].points()]))


def test_objects_of_all_sizes() -> None:
    rng = np.random.default_rng(5)
    scene = fk.Scene()
    for i in range(120):
        x, y = rng.uniform(-3, 3, 2).tolist()
        scene[f"{i}"] = square(x, y, 10.0 ** rng.uniform(-4, 0.5))
    judge(scene, 0.1, 0.2)
    for step in range(60):
        name = f"{rng.integers(120)}"
        engine = scene[name]
        points = engine.points()
        engine.clear()
        engine.insert(points + rng.normal(0, 0.5, 2))
        if step % 3 == 0:
            judge(scene, *rng.uniform(-3, 3, 2).tolist())
    judge(scene, -100.0, 1.0)


@settings(deadline=None, max_examples=60)
@given(st.lists(st.tuples(strategies.point_sets(12), st.booleans()), max_size=8), st.data())
def test_any_objects(cases: list[tuple[Points, bool]], data: st.DataObject) -> None:
    scene = fk.Scene()
    for i, (points, again) in enumerate(cases):
        scene[f"{i}"] = made(points)
        if again:
            scene.collisions()
    x, y = data.draw(strategies.coordinates), data.draw(strategies.coordinates)
    judge(scene, x, y)
    for name in list(scene):
        if data.draw(st.booleans()):
            ids = scene[name].ids()
            scene[name].remove(ids[: len(ids) // 2])
    judge(scene, x, y)


def test_after_an_interrupt_a_scene_starts_again(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = fk.Scene({"a": square(0.0), "b": square(0.5), "c": square(9.0)})
    for late in range(4):
        scene["a"].insert(0.5, -0.1 * late)
        with monkeypatch.context() as patch:
            calls = iter(range(late))

            def interrupted(
                engine: fk.Engine, other: fk.Engine, calls: Iterator[int] = calls
            ) -> bool:
                if next(calls, None) is None:
                    raise KeyboardInterrupt
                return engine._kernel.collides(other._kernel)

            patch.setattr(fk.Engine, "collides", interrupted)
            try:
                scene.collisions()
            except KeyboardInterrupt:
                scene["c"].insert(0.7, 0.7 + late)
        judge(scene, 0.0, 0.0)


# ---------------------------------------------------------------------- in logs
def inserts(t: float, name: str, points: Points, shift: float = 0.0) -> list[Event]:
    return [Insert(t=t, object=name, x=x + shift, y=y + shift) for x, y in points.tolist()]


def test_contacts_begin_and_end_as_time_goes_on() -> None:
    events: list[Event] = [
        *inserts(1.0, "b", SQUARE),
        *inserts(2.0, "a", SQUARE, 3.0),
        *inserts(3.0, "a", SQUARE[:1], 0.5),
        Query(t=3.0, object="a", kind="contains", x=0.5, y=0.5),
        Remove(t=4.0, object="a", x=0.5, y=0.5),
        *inserts(4.0, "c", SQUARE, 0.25),
        Remove(t=5.0, object="c", id=0),
        *inserts(5.0, "c", SQUARE[:1], 0.25),
    ]
    told: list[object] = []
    done = replay(events, answer=told.append, contact=told.append)
    assert [each for each in told if isinstance(each, Contact)] == [
        Contact(t=3.0, contact="begin", objects=("a", "b")),
        Contact(t=4.0, contact="end", objects=("a", "b")),
        Contact(t=4.0, contact="begin", objects=("b", "c")),
    ]
    assert len(told) == 4
    assert done.scene.collisions() == [("b", "c")]
    assert all_pairs(done.scene) == [("b", "c")]
