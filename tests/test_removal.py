"""Points leave: each kind of hole, each way down to nothing and up again, and many in one repair.

What is left is what the same points make when they are all that ever came; `settled` asserts it.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flintknap as fk
import programs
import strategies
from flintknap import reference

CIRCLE = np.array(strategies.ON_CIRCLE)


def built(*batches):
    engine = fk.Engine()
    for batch in batches:
        engine.insert(np.asarray(batch, np.float64).reshape(-1, 2))
    return engine


def by_coordinates(engine):
    xy, ids, boundary = engine.points(), engine.ids(), engine.boundary()
    corners = xy[np.searchsorted(ids, engine.triangles())]
    order = np.lexsort(corners.reshape(-1, 6).T[::-1])
    inside = xy[np.searchsorted(ids, boundary.inside)]
    return corners[order].tolist(), boundary.xy.tolist(), inside.tolist(), engine.digest()


def settled(engine):
    """Assert that the engine is sound and that its history does not show."""
    engine.side(0.0, 0.0)
    engine.check()
    assert by_coordinates(engine) == by_coordinates(built(engine.points()))


def placed(engine):
    """Place the points that wait, and repair nothing."""
    engine.edges("hull")


def judge(engine):
    """Assert that the engine agrees with the reference."""
    settled(engine)
    assert engine.digest() == reference.digest(engine.points())


# ------------------------------------------------------------------ holes
def fan(n, *, apex=9.0):
    """A point over n points on a line: its star is a fan, its link a line."""
    return [(n / 2 + 0.25, apex), *((float(i), 0.0) for i in range(n))]


HOLES = {
    # the first point leaves
    "of degree 3": [(1, 1), (0, 0), (4, 0), (0, 4)],
    "of degree 4, cocircular": [(1, 1), (0, 0), (2, 0), (2, 2), (0, 2)],
    "amid a grid": [(2, 2), *((x, y) for x in range(5) for y in range(5) if (x, y) != (2, 2))],
    "a corner of a grid": [(0, 0), *itertools.product(range(4), range(1, 4)), (1, 0), (2, 0)],
    "amid a hull edge": [(2, 0), (0, 0), (1, 0), (3, 0), (4, 0), (1, 3), (2, 5), (2, 2)],
    "a corner over points on a line": [(2, 3), *((x, 0) for x in range(5)), (1, -1), (3, -2)],
    "the smallest": [(-5, 0), (0, 0), (0, 1), (0, -1), (1, 3), (1, -3), (2, 0)],
    "the smallest of a vertical side": [(0, 0), (0, 1), (0, 2), (3, 0), (3, 2), (1, 1)],
    "the largest": [(9, 0), (0, 0), (0, 1), (0, -1), (1, 3), (1, -3), (2, 0)],
    "all but one on a line, and it stays": [(7, 0), (12.25, 9), *fan(24)[1:8], (8, 0)],
    "of degree 16, cocircular": [(0, 0), *strategies.ON_CIRCLE[:32:2]],
}


def holes_of_degree(n, circle):
    """Holes with n on the rim or one or two more; the circle has n points or more."""
    half = n // 2
    bow = [(x * x / 50, x) for x in range(-half, n - half)]
    return {
        "cocircular": [(0, 0), *circle[:n]],
        "off centre": [(1, 2), *circle[:n]],
        "with the ghost on its rim": [(-(10.0**6), 1), *bow],
        "hull on both sides": [*fan(n), (n / 2, -9), (3, -4), (n - 4, -5)],
        "a line with one beyond": [*fan(n), (n / 2, -9)],
        "a line and nothing else": fan(n),
    }


# 128 is kSmallHole
WIDE = {6: strategies.ON_CIRCLE, 30: strategies.ON_CIRCLE}
WIDE |= dict.fromkeys((128, 129), strategies.on_circle(5525))
HOLES |= {
    f"of degree {n}, {name}": points
    for n, circle in WIDE.items()
    for name, points in holes_of_degree(n, circle).items()
}


@pytest.mark.parametrize("points", HOLES.values(), ids=HOLES)
@pytest.mark.parametrize("way", ["fresh", "placed", "settled", "one by one", "last"])
def test_holes_are_filled(points, way):
    points = np.array(points, np.float64)
    engine = fk.Engine()
    if way == "one by one":
        for x, y in points.tolist():
            engine.insert(x, y)
            engine.side(x, y)
    else:
        engine.insert(points[::-1] if way == "last" else points)
    if way == "placed":
        placed(engine)
    if way in ("settled", "last"):
        engine.side(0.0, 0.0)
    there = engine.find(*points[0].tolist())
    engine.remove(there)
    judge(engine)
    assert engine.insert(*points[0].tolist()) == len(points)
    judge(engine)


@pytest.mark.parametrize("name", [name for name in HOLES if len(HOLES[name]) < 40])
def test_everything_leaves_and_comes_again(name):
    """One by one to the last triangle, to a line, to one point, to none; then up again."""
    points = np.array(HOLES[name], np.float64)
    engine = built(points)
    for ordered in (points, points[::-1], np.random.default_rng(1).permutation(points)):
        for x, y in ordered.tolist():
            engine.remove(engine.find(x, y))
            judge(engine)
        assert len(engine) == 0
        for x, y in ordered.tolist():
            engine.insert(x, y)
            judge(engine)


@pytest.mark.parametrize("order", list(itertools.permutations(range(4))))
def test_to_a_line_and_off_it_again(order):
    points = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (1.0, 1.0)]
    engine = built(points)
    assert engine.boundary().status == "closed"
    for k in order:
        engine.remove(engine.find(*points[k]))
        engine.check()
        corners = [p for i, p in enumerate(points) if engine.find(*p) >= 0 and i < 3]
        flat = engine.find(*points[3]) < 0 or len(corners) < 2
        assert (engine.boundary().status == "degenerate") == flat
        if flat:
            assert len(engine.edges("delaunay")) == max(0, len(engine) - 1)
    for k in order:
        engine.insert(*points[k])
        settled(engine)


def test_a_line_turns():
    """All sites on one line, then on another, through a single point and through a triangle."""
    engine = built([(x, 0.0) for x in range(30)])
    engine.insert([(0.0, y) for y in range(30)])
    judge(engine)
    engine.remove([engine.find(x, 0.0) for x in range(1, 30)])
    assert engine.boundary().status == "degenerate"
    judge(engine)
    engine.insert([(x, x) for x in range(1, 30)])
    judge(engine)
    engine.remove([engine.find(0.0, y) for y in range(1, 30)])
    assert engine.boundary().status == "degenerate"
    judge(engine)


# ------------------------------------------------------------------ ids, slots, revisions
def test_ids_are_never_used_again_and_the_kernel_does_not_grow():
    engine = built(CIRCLE)
    engine.boundary()
    given, before = 36, engine._kernel.bytes()
    for n in range(2000):
        engine.remove(n)
        assert engine.insert(*CIRCLE[n % 36].tolist()) == given
        given += 1
        if n % 100 == 0:
            settled(engine)
    assert engine.ids().tolist() == list(range(2000, 2036))
    assert engine._kernel.bytes() < 2 * before


def test_an_id_that_left_is_unknown_whatever_came_since():
    engine = built(np.random.default_rng(2).random((600, 2)))
    for point in range(590):
        engine.remove(point)
    engine.insert(np.random.default_rng(3).random((600, 2)))
    for point in (0, 255, 256, 589):
        with pytest.raises(KeyError, match=str(point)):
            engine.remove(point)
        with pytest.raises(KeyError, match=str(point)):
            engine.move(point, 0.5, 0.5)
    assert len(engine) == 610


@pytest.mark.parametrize("count", [1, 255, 256, 257, 300])
def test_ids_from_before_a_clear_are_unknown(count):
    """Found by the fuzz target: nothing had come since, and their page was looked up."""
    engine = built(np.random.default_rng(4).random((count, 2)))
    engine.clear()
    for point in (0, count - 1, count):
        with pytest.raises(KeyError, match=str(point)):
            engine.remove(point)
    assert engine.insert(1.0, 1.0) == count
    with pytest.raises(KeyError, match=str(count - 1)):
        engine.remove(count - 1)


def test_the_revision_counts_changes_of_the_set():
    engine = built([(0, 0), (4, 0), (0, 4), (4, 0)])
    revision = engine.revision
    boundary = engine.boundary()
    engine.remove(1)
    assert engine.revision == revision
    assert engine.boundary() is boundary
    engine.remove(1)
    assert engine.revision == revision + 1
    assert engine.boundary().status == "degenerate"
    for call in (
        lambda: engine.remove(1),
        lambda: engine.remove([0, 0]),
        lambda: engine.move(1, 1, 1),
    ):
        with pytest.raises(KeyError):
            call()
    assert engine.revision == revision + 1
    engine.move(2, 5.0, 5.0)
    assert engine.revision == revision + 2
    engine.move(2, 5.0, 5.0)
    assert engine.revision == revision + 2
    engine.clear()
    assert engine.revision == revision + 3
    engine.clear()
    assert engine.revision == revision + 3


def test_shapes_of_ids_to_remove():
    engine = built(CIRCLE)
    engine.remove(np.int64(0))
    engine.remove([])
    engine.remove(np.array([[1, 2], [3, 4]], np.uint8))
    engine.remove((5,))
    assert engine.ids().tolist() == list(range(6, 36))
    for bad in (0.5, [1.0], ["a"]):
        with pytest.raises(fk.InputError, match="integer ids"):
            engine.remove(bad)
    settled(engine)


# ------------------------------------------------------------------ history never shows
@settings(deadline=None, max_examples=150)
@given(strategies.point_sets(40), strategies.point_sets(25), strategies.generators, st.booleans())
def test_what_came_and_left_leaves_no_trace(stay, pass_by, rng, is_asked):
    engine = built(stay)
    digest = engine.digest()
    ids = engine.insert(pass_by)
    if is_asked:
        engine.side(0.0, 0.0)
    engine.remove(rng.permutation(ids))
    assert engine.digest() == digest
    settled(engine)


@settings(deadline=None, max_examples=100)
@given(strategies.point_sets(40), strategies.generators)
def test_everything_leaves_in_any_order(xy, rng):
    engine = built(strategies.distinct(xy))
    engine.side(0.0, 0.0)
    for point in rng.permutation(engine.ids()).tolist():
        engine.remove(point)
        if rng.random() < 0.5:
            engine.check()
        if rng.random() < 0.1:
            judge(engine)
    assert len(engine) == 0


# ------------------------------------------------------------------ larger sets
def uniform(rng):
    return rng.random((2500, 2))


def curve(rng):
    angle = rng.uniform(0, 2 * np.pi, 2500)
    radius = 1 + 0.4 * np.sin(5 * angle) + rng.normal(0, 0.003, 2500)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def sweep(rng):
    angle = np.linspace(0, 2 * np.pi, 2500, endpoint=False) + rng.random()
    radius = 1 + 0.4 * np.sin(5 * angle)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def grid(_):
    return np.array(list(itertools.product(range(50), range(50))), np.float64)


def rings(_):
    return np.concatenate([CIRCLE * scale for scale in range(1, 70)])


def last_bits(rng):
    return strategies.distinct(1 / 3 + rng.integers(-40, 41, (4000, 2)) * 2.0**-54)


LARGE = [uniform, curve, sweep, grid, rings, last_bits]


@pytest.mark.parametrize("make", LARGE)
def test_mixed_batches_in_one_repair(make):
    """Few enough changes between two questions are repaired in one pass: one and one in 1024."""
    rng = np.random.default_rng(7)
    xy = rng.permutation(make(rng))
    spare, engine = xy[:200].tolist(), built(xy[200:])
    engine.side(0.0, 0.0)
    few = 1 + len(engine) // 1024
    for step in range(100):
        for _ in range(few):
            change = rng.integers(4)
            point = int(rng.choice(engine.ids()))
            if change == 0 and spare:
                engine.insert(*spare.pop())
                placed(engine)
            elif change == 1 and spare:
                spare.append(engine.points([point])[0].tolist())
                engine.move(point, *spare.pop(0))
                placed(engine)
            else:
                spare.append(engine.points([point])[0].tolist())
                engine.remove(point)
        engine.side(0.0, 0.0)
        if step % 4 == 0:
            engine.check()
    settled(engine)


@pytest.mark.parametrize("make", LARGE)
def test_the_hull_is_peeled(make):
    """Only hull vertices leave, the smallest first: their neighbours come to lie on the hull."""
    rng = np.random.default_rng(8)
    engine = built(rng.permutation(make(rng)))
    engine.side(0.0, 0.0)
    for step in range(120):
        xy, hull = engine.points(), np.unique(engine.edges("hull"))
        corners = xy[np.searchsorted(engine.ids(), hull)]
        first = np.lexsort((corners[:, 1], corners[:, 0]))[0]
        engine.remove(int(hull[first] if step % 2 else rng.choice(hull)))
        engine.side(0.0, 0.0)
        if step % 10 == 0:
            engine.check()
    settled(engine)


@pytest.mark.parametrize("make", LARGE)
def test_a_large_set_leaves_in_random_order(make):
    rng = np.random.default_rng(9)
    engine = built(make(rng))
    engine.side(0.0, 0.0)
    order = rng.permutation(engine.ids())
    for n, point in enumerate(order.tolist()):
        engine.remove(point)
        if n % 5 == 0 or len(engine) < 40:
            engine.side(0.0, 0.0)
        if n % 250 == 0 or len(engine) < 20:
            settled(engine)
    assert len(engine) == 0


@pytest.mark.parametrize("make", LARGE)
def test_a_window_slides(make):
    rng = np.random.default_rng(10)
    xy = make(rng)
    engine, width = fk.Engine(), 800
    for n, (x, y) in enumerate(xy.tolist()):
        engine.insert(x, y)
        if n >= width:
            engine.remove(n - width)
        if n % 3 == 0:
            engine.side(x, y)
        if n % 400 == 0:
            settled(engine)
    assert engine.ids().tolist() == list(range(len(xy) - width, len(xy)))
    settled(engine)


def test_one_of_high_degree_comes_and_goes():
    """The hub of a wheel, with the repair following it."""
    rng = np.random.default_rng(11)
    angle = np.sort(rng.uniform(0, 2 * np.pi, 300))
    rim = np.column_stack([np.cos(angle), np.sin(angle)])
    engine = built(rim, 3 * rim, rng.normal((10, 0), 1e-3, (900, 2)))
    engine.side(0.0, 0.0)
    for _ in range(20):
        hub = engine.insert(*rng.normal(0, 1e-3, 2).tolist())
        settled(engine)
        engine.remove(hub)
        settled(engine)


@programs.needs_a_compiler
def test_the_fuzz_target_is_up_to_date():
    """It runs for as long as one likes, so nobody runs it with the tests; but it compiles."""
    programs.compiles("fuzz/object.cpp")
