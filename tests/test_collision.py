"""Collision queries against brute force in fractions, and against GEOS."""

from __future__ import annotations

import math
import threading

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

import flintknap as fk
import judges
import strategies
from flintknap.reference import collision as exact
from strategies import Points, Segments


def wavy(n: int, seed: int, noise: float = 0.0, at: tuple[float, float] = (0.0, 0.0)) -> Points:
    rng = np.random.default_rng(seed)
    t = 2 * np.pi * (np.arange(n) + rng.random(n)) / n
    radius = 1 + 0.3 * np.sin(5 * t) + rng.normal(0, noise, n)
    return rng.permutation(np.column_stack([radius * np.cos(t), radius * np.sin(t)]) + at)


def made(points: Points) -> fk.Engine:
    engine = fk.Engine()
    engine.insert(points)
    return engine


SQUARE = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)]
NOTCH = [*SQUARE, (2.0, 1.0)]  # from the bottom side, or from another: the boundary tells


@st.composite
def rings_and_places(draw: DrawFn) -> tuple[Points, Points]:
    points = draw(strategies.point_sets(30))
    return points, draw(strategies.places(points))


@st.composite
def rings_and_segments(draw: DrawFn) -> tuple[Points, Segments]:
    points = draw(strategies.point_sets(30))
    return points, draw(strategies.segments(points))


# ---------------------------------------------------------------------- distances
NEARLY_ALIKE = [(0.0, 0.0), (1.0, 1.0), (1e30, 0.0), (7e59, 0.0), (0.0, 1e30)]


@settings(deadline=None)
@given(rings_and_places())
@example((np.array(NEARLY_ALIKE), np.array([(1e30, 1.0)])))
def test_distances_agree_with_fractions(case: tuple[Points, Points]) -> None:
    points, asked = case
    judges.distances(made(points), asked)


def test_distances_at_both_ends_of_the_range() -> None:
    for unit in (1e-60, 1e-30, 1.0, 2.5e59):
        engine = made(unit * np.array(SQUARE))
        ring = engine.boundary().xy
        for x, y in [(2.0, 1.0), (-3.0, -4.0), (4.0, 4.0), (1 + 2**-50, 2.0), (1.1, 1.3)]:
            told = engine.distance(unit * x, unit * y)
            assert told == exact.distance(ring, unit * x, unit * y)
            assert told > 0 or (x, y) == (4.0, 4.0)


@given(st.integers(1, 10**40), st.integers(1, 10**40), st.integers(-200, 200))
def test_roots_are_correctly_rounded(numerator: int, denominator: int, power: int) -> None:
    square = exact.Fraction(numerator, denominator) * exact.Fraction(4) ** power
    root = exact.root(square)
    below, above = (
        (exact.Fraction(root) + exact.Fraction(math.nextafter(root, to))) / 2
        for to in (-math.inf, math.inf)
    )
    assert below**2 <= square <= above**2
    assert exact.root(exact.Fraction(numerator) ** 2) == float(numerator)


def test_the_nearest_of_many_is_that_with_the_smaller_start() -> None:
    engine = made(np.array(strategies.ON_CIRCLE))
    told = engine.nearest(0.0, 0.0)  # the middles of the longest chords are nearest
    boundary = engine.boundary()
    ring = boundary.xy
    middles = ring / 2 + np.roll(ring, -1, axis=0) / 2
    far = np.hypot(*middles.T)
    assert (far == far.min()).sum() > 1
    least = min(np.flatnonzero(far == far.min()), key=lambda row: ring[row].tolist())
    assert [told.x, told.y] == middles[least].tolist()
    assert told.start == boundary.ids[least]
    square = made(np.array(SQUARE))
    assert square.nearest(-1.0, -1.0) == (0.0, 0.0, math.sqrt(2), 0, 1)
    assert square.nearest(5.0, 5.0) == (4.0, 4.0, math.sqrt(2), 1, 2)  # of 1 to 2 and 2 to 3
    assert square.nearest(2.0, 2.0) == (2.0, 0.0, 2.0, 0, 1)  # of all four: 0 and 3 are at x = 0


@pytest.mark.parametrize("k", [2 * 10**15 + 1, 2 * 10**15 + 3])
@pytest.mark.parametrize(
    ("unit", "y"),
    [(2.0**-245, 0.0), *((u, y) for u in (1.0, 2.0**140) for y in (0, 1e-60, -1e-60))],
)
def test_distances_halfway_between_two_doubles(k: int, unit: float, y: float) -> None:
    assert 5 * k > 2**53  # 54 bits, the last of them 1
    even = float(5 * k)
    expected = even if y == 0 else 5 * k - 1 if y > 0 else 5 * k + 1
    corner = [(3 * k, 4 * k), (3 * k + 9, 4 * k), (3 * k, 4 * k + 9)]
    side = [(3 * k - 4, 4 * k + 3), (3 * k + 4, 4 * k - 3), (3 * k + 9, 4 * k + 9)]
    for points in (corner, side):
        engine = made(unit * np.array(points, float))
        assert engine.distance(0.0, y) == unit * expected
        judges.distances(engine, np.array([(0.0, y)]))


def test_answers_forget_history() -> None:
    points, rng = wavy(3000, 4, 0.01), np.random.default_rng(8)
    straight, crooked = made(points), made(points[::-1][:2900])
    crooked.distance(0.0, 0.0)
    extra = rng.uniform(-1, 1, (60, 2))
    for p in extra.tolist():
        crooked.insert(*p)
        crooked.distance(0.0, 0.0)
    crooked.remove(crooked.find(extra))
    for p in points[:100].tolist():
        crooked.insert(*p)
        crooked.distance(0.0, 0.0)
    asked = np.concatenate([rng.uniform(-2, 2, (300, 2)), points[:50], [[0.0, 0.0]]])
    for one, two in zip(straight.nearest(asked)[:3], crooked.nearest(asked)[:3], strict=True):
        np.testing.assert_array_equal(one, two)
    ends = rng.uniform(-1.5, 1.5, (4, 200))
    np.testing.assert_array_equal(straight.first_hit(*ends).t, crooked.first_hit(*ends).t)
    assert len(straight.crossings(*ends).t) == len(crooked.crossings(*ends).t)


# ---------------------------------------------------------------------- segments
@settings(deadline=None)
@given(rings_and_segments())
def test_segments_agree_with_fractions(case: tuple[Points, Segments]) -> None:
    points, segments = case
    engine = made(points)
    judges.segments(engine, segments)
    starts, stops = segments[:, :2].tolist(), segments[:, 2:].tolist()
    for _ in range(4):  # the cells they begin in are drawn
        for x, y in starts:
            engine.side(x, y)
    engine.check()
    judges.segments(engine, segments)
    judges.sides(engine, np.array([*starts, *stops]).reshape(-1, 2))


def test_segments_agree_with_geos() -> None:
    rng = np.random.default_rng(11)
    for noise in (0.0, 0.02):
        engine = made(wavy(2000, 7, noise))
        polygon = shapely.Polygon(engine.boundary().xy)
        for length in (0.01, 0.3, 2.0):
            start = rng.uniform(-1.4, 1.4, (400, 2))
            turn = rng.uniform(0, 2 * np.pi, 400)
            stop = start + length * np.column_stack([np.cos(turn), np.sin(turn)])
            lines = shapely.linestrings(np.stack([start, stop], axis=1))
            ends = (*start.T, *stop.T)
            meets = shapely.intersects(polygon.exterior, lines)
            np.testing.assert_array_equal(engine.intersects(*ends), meets)
            np.testing.assert_array_equal(
                engine.contains_segment(*ends), shapely.covers(polygon, lines)
            )
            np.testing.assert_array_equal(~np.isnan(engine.first_hit(*ends).t), meets)
            count = np.bincount(engine.crossings(*ends).segment, minlength=400)
            cut = shapely.get_num_geometries(shapely.intersection(polygon.exterior, lines))
            np.testing.assert_array_equal(count[meets], cut[meets])
        places = rng.uniform(-2, 2, (500, 2))
        far = shapely.distance(polygon.exterior, shapely.points(places))
        np.testing.assert_allclose(engine.distance(places), far, rtol=1e-12)


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_segments_together_are_segments_one_by_one(noise: float) -> None:
    rng, points = np.random.default_rng(12), wavy(2000, 7, noise)
    together, alone = made(points), made(points)
    for count in (0, 1, 31, 32, 33, 64, 65, 1000, 1000, 1000):  # cells are drawn meanwhile
        start, turn = rng.uniform(-1.4, 1.4, (count, 2)), rng.uniform(0, 2 * np.pi, count)
        length = 10 ** rng.uniform(-4, 0.5, (count, 1))
        stop = start + length * np.column_stack([np.cos(turn), np.sin(turn)])
        ends = (*start.T, *stop.T)
        each = np.column_stack(ends).tolist()
        meets, held = together.intersects(*ends), together.contains_segment(*ends)
        assert meets.tolist() == [alone.intersects(*segment) for segment in each]
        assert held.tolist() == [alone.contains_segment(*segment) for segment in each]
        np.testing.assert_array_equal(meets, ~np.isnan(together.first_hit(*ends).t))
    assert 0 < np.count_nonzero(meets) < np.count_nonzero(~held)
    together.check()


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_places_one_by_one_are_places_together(noise: float) -> None:
    """Told by the tree, by lists and by drawings, which a change takes away here and there."""
    rng, engine = np.random.default_rng(13), made(wavy(2000, 7, noise))
    for count in (1, 20, 500, 3000):
        places = rng.uniform(-1.4, 1.4, (count, 2))
        expected = engine.side(places).tolist()
        assert [engine.side(x, y) for x, y in places.tolist()] == expected
        engine.check()
        engine.insert(rng.normal(0, 0.8, (3, 2)))


def test_the_first_hit_is_the_first_crossing() -> None:
    engine = made(wavy(1000, 3, 0.01))
    ring = engine.boundary().xy
    rng = np.random.default_rng(4)
    starts = np.concatenate([ring, ring, rng.uniform(-1.5, 1.5, (500, 2))])
    stops = np.concatenate(
        [ring[::-1], ring + np.array([0.01, 0.02]), rng.uniform(-1.5, 1.5, (500, 2))]
    )
    ends = (*starts.T, *stops.T)
    hits, found = engine.first_hit(*ends), engine.crossings(*ends)
    rows, first = np.unique(found.segment, return_index=True)
    assert rows.tolist() == np.flatnonzero(~np.isnan(hits.t)).tolist()
    for told, expected in zip(hits, (found.t, found.start, found.stop), strict=True):
        np.testing.assert_array_equal(told[rows], expected[first])
    assert (np.diff(found.segment) >= 0).all()
    assert (np.diff(found.t)[np.diff(found.segment) == 0] >= 0).all()


def test_ways_from_vertex_to_vertex() -> None:
    engine = made(wavy(90, 6, 0.05))
    ring = engine.boundary().xy
    for step in (1, 2, 40):
        ends = (*ring.T, *np.roll(ring, step, axis=0).T)
        expected = [exact.contains_segment(ring, *each) for each in np.transpose(ends).tolist()]
        assert engine.contains_segment(*ends).tolist() == expected
        assert 0 < sum(expected) <= len(ring)


def test_ways_along_the_boundary() -> None:
    engine = made(np.array(NOTCH))  # the notch is cut from below: (0,0) (2,1) (4,0)
    assert engine.boundary().ids.tolist() == [0, 4, 1, 2, 3]
    assert engine.contains_segment(0.0, 4.0, 4.0, 4.0)
    assert engine.contains_segment(0.0, 1.0, 4.0, 1.0)  # touches the tip
    assert engine.contains_segment(0.0, 0.0, 2.0, 1.0)
    assert engine.contains_segment(0.0, 0.0, 4.0, 2.0)  # along the notch and on
    assert not engine.contains_segment(0.0, 0.0, 4.0, 0.0)  # across its mouth
    assert not engine.contains_segment(-1.0, 4.0, 4.0, 4.0)
    assert engine.contains_segment(2.0, 1.0, 2.0, 1.0)
    assert not engine.contains_segment(2.0, 0.5, 2.0, 0.5)
    assert engine.intersects(2.0, 1.0, 2.0, 1.0)
    assert not engine.intersects(2.0, 2.0, 2.0, 2.0)
    assert engine.first_hit(-1.0, 4.0, 7.0, 4.0) == (0.125, 3, 0)  # of two at (0, 4): start, ...
    assert engine.first_hit(7.0, 4.0, -1.0, 4.0) == (0.375, 1, 2)
    found = engine.crossings(-1.0, 4.0, 7.0, 4.0)
    assert found.t.tolist() == [0.125, 0.125, 0.625]
    assert math.isnan(engine.first_hit(1.0, 2.0, 3.0, 2.0).t)


def test_arrays_broadcast_and_rows_are_named() -> None:
    engine = made(np.array(SQUARE))
    x1 = np.array([[1.0], [9.0]])
    meets = engine.intersects(1.0, 2.0, x1, [2.0, 3.0, 9.0])
    assert meets.tolist() == [[False, False, True], [True, True, True]]
    assert engine.first_hit(1, 2, x1, [2, 3, 9]).t.shape == (2, 3)
    for number in (int, float, np.float64, np.int64, np.float32):
        x, y, far = number(1), number(2), number(9)
        assert (engine.side(x, y), engine.side(far, y)) == (1, -1)
        assert engine.contains(x, y) is True
        assert engine.intersects(x, y, far, y) is True
        assert engine.contains_segment(x, y, far, y) is False
        assert isinstance(engine.distance(x, y), float)
    assert engine.nearest([[1.0, 2.0]], 1.0).start.shape == (1, 2)
    assert len(engine.crossings([], 0.0, 1.0, 1.0).t) == 0
    with pytest.raises(fk.InputError, match=r"row 1: got .*nan") as caught:
        engine.intersects(1.0, 2.0, [3.0, math.nan], 4.0)
    assert caught.value.row == 1
    for bad in (None, "1", math.inf, 1e70, True):
        for ask in (engine.side, engine.contains, engine.distance):
            for args in ((bad, 1.0), (1.0, bad)):
                with pytest.raises(fk.InputError):
                    ask(*args)
        for ask in (engine.intersects, engine.contains_segment):
            with pytest.raises(fk.InputError):
                ask(1.0, 1.0, 2.0, bad)
    with pytest.raises(fk.InputError, match="expected shapes that broadcast"):
        engine.first_hit([1.0, 2.0], 2.0, [1.0, 2.0, 3.0], 4.0)
    with pytest.raises(fk.InputError, match="row 0"):
        engine.distance([1e70], 0.0)
    with pytest.raises(fk.InputError, match="at_least: got nan"):
        engine.clearance(engine, at_least=math.nan)


def test_degenerate_objects_have_no_boundary() -> None:
    flat, square = made(np.array([(0.0, 0.0), (1.0, 1.0)])), made(np.array(SQUARE))
    assert flat.distance(0.0, 0.0) == math.inf
    assert flat.distance([0.0, 1.0], 0.0).tolist() == [math.inf, math.inf]
    told = flat.nearest(0.0, 0.0)
    assert math.isnan(told.x)
    assert math.isnan(told.y)
    assert told[2:] == (math.inf, -1, -1)
    assert not flat.intersects(0.0, 0.0, 1.0, 1.0)
    assert not flat.contains_segment(0.0, 0.0, 1.0, 1.0)
    assert flat.first_hit(0.0, 0.0, 1.0, 1.0)[1:] == (-1, -1)
    for a, b in ((flat, square), (square, flat), (flat, flat)):
        assert not a.collides(b)
        assert a.clearance(b) == math.inf
        assert a.clearance(b, at_least=1e60)


# ---------------------------------------------------------------------- two objects
@st.composite
def two_rings(draw: DrawFn) -> tuple[Points, Points]:
    """Related ones: apart by a shift, sharing points, one a bit beside the other."""
    first = draw(strategies.point_sets(20))
    second = draw(st.one_of(strategies.point_sets(20), st.just(first)))
    scale = draw(st.sampled_from([1.0, 1.0, 0.25, 3.0]))
    shift = np.array([draw(strategies.small), draw(strategies.small)], float)
    extent = np.ptp(first, axis=0) if len(first) else np.zeros(2)
    second = scale * second + shift * draw(st.sampled_from([1.0, 0.5, 1e-3])) * extent
    if draw(st.booleans()):
        second = draw(strategies.last_bits(second))
    return first, np.where(strategies.admissible(second), second, 0.0)


@settings(deadline=None)
@given(two_rings())
def test_two_objects_agree_with_fractions(case: tuple[Points, Points]) -> None:
    one, two = made(case[0]), made(case[1])
    rings = one.boundary().xy, two.boundary().xy
    assert one.collides(two) == two.collides(one) == exact.collides(*rings)
    apart = exact.clearance(*rings)
    assert one.clearance(two) == two.clearance(one) == apart
    for least in (0.0, apart / 2, apart, math.nextafter(apart, math.inf), 2 * apart, 1.0):
        if math.isfinite(least):
            assert one.clearance(two, at_least=least) == (apart >= least)


def test_two_large_objects_agree_with_geos() -> None:
    rng = np.random.default_rng(21)
    for noise in (0.0, 0.05):
        one = made(wavy(1500, 1, noise))
        first = shapely.Polygon(one.boundary().xy)
        for scale in (0.05, 1.0, 3.0):
            for x, y in rng.uniform(-2.5, 2.5, (15, 2)).tolist():
                two = made(scale * wavy(1000, 2, noise) + (x, y))
                second = shapely.Polygon(two.boundary().xy)
                assert one.collides(two) == first.intersects(second)
                np.testing.assert_allclose(one.clearance(two), first.distance(second), rtol=1e-12)


def test_an_object_and_itself() -> None:
    square = made(np.array(SQUARE))
    assert square.collides(square)
    assert square.clearance(square) == 0
    assert not square.clearance(square, at_least=1.0)
    assert square.clearance(square, at_least=0.0)


def test_rings_within_rings() -> None:
    outer, inner = made(10 * wavy(500, 1)), made(wavy(500, 2))
    assert outer.collides(inner)
    assert inner.collides(outer)
    assert inner.clearance(outer) == 0


def test_threads_that_ask_both_ways_round_do_not_wait_for_ever() -> None:
    one, two = made(wavy(400, 1)), made(wavy(400, 2, at=(2.5, 0.0)))
    answers: list[bool] = []

    def ask(a: fk.Engine, b: fk.Engine) -> None:
        for step in range(60):
            a.insert(step / 7.0, 50.0 + step)
            answers.append(a.collides(b))

    threads = [
        threading.Thread(target=ask, args=pair, daemon=True)
        for pair in [(one, two), (two, one), (one, one)]
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=60)
    assert not any(thread.is_alive() for thread in threads)
    assert len(answers) == 180
