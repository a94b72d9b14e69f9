"""Answers at a level or within a tolerance: those of the reference, never lies, ever tighter, lazy.

"Certain" is judged by the exact queries, which test_collision.py judges by fractions.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flintknap as fk
from flintknap.reference import bounds as reference
from flintknap.reference import side_at
from test_collision import NOTCH, SQUARE, made, rings_and_places, rings_and_segments, two_rings
from trees import coast, wavy

some = settings(deadline=None, max_examples=60)
DEEPEST = 10**9
levels = st.integers(0, 5) | st.just(DEEPEST)
tolerances = st.sampled_from([0.0, 1e-70, 1e-3, 0.1, 0.5, 2.0, math.inf])
cuts = st.fixed_dictionaries({"level": levels}) | st.fixed_dictionaries({"tolerance": tolerances})
exactly = st.sampled_from([{"level": DEEPEST}, {"tolerance": 0.0}])


def holds(found: fk.Bounds, exact: object) -> np.bool_:
    return np.all((found.lower <= exact) & (exact <= found.upper))


# ---------------------------------------------------------------------- equality
@some
@given(rings_and_places(), cuts)
def test_places_agree_with_the_reference(case, cut):
    points, asked = case
    engine = made(points[:20])
    ring = engine.boundary().xy
    found, sides = engine.distance(asked, **cut), engine.side(asked, **cut)
    assert holds(found, engine.distance(asked))
    exact = engine.side(asked)
    assert ((sides == 0) | (sides == exact)).all()
    for i, (x, y) in enumerate(asked.tolist()):
        told = engine.distance(x, y, **cut)
        assert told == (found.lower[i], found.upper[i])
        assert told == reference.distance(ring, x, y, **cut)
        assert engine.side(x, y, **cut) == sides[i] == side_at(ring, x, y, **cut)
        if "tolerance" in cut and len(ring):
            assert told.upper - told.lower <= 2 * cut["tolerance"] + told.upper * 2**-50 + 1e-69
            assert sides[i] != 0 or told.lower <= cut["tolerance"]
    engine.check()


@some
@given(rings_and_segments(), cuts)
def test_segments_agree_with_the_reference(case, cut):
    points, segments = case
    engine = made(points[:20])
    ring, ends = engine.boundary().xy, segments.T
    meets, held = engine.intersects(*ends, **cut), engine.contains_segment(*ends, **cut)
    exact = engine.intersects(*ends)
    assert ((meets == 0) | ((meets > 0) == exact)).all()
    exact = engine.contains_segment(*ends)
    assert ((held == 0) | ((held > 0) == exact)).all()
    assert meets.dtype == held.dtype == np.int8
    for i, segment in enumerate(segments.tolist()):
        assert engine.intersects(*segment, **cut) == meets[i]
        assert meets[i] == reference.intersects(ring, *segment, **cut)
        assert engine.contains_segment(*segment, **cut) == held[i]
        assert held[i] == reference.contains_segment(ring, *segment, **cut)


@some
@given(rings_and_segments(), exactly)
def test_with_no_error_left_answers_are_exact(case, cut):
    points, segments = case
    engine, ends = made(points), segments.T
    assert ((engine.intersects(*ends, **cut) > 0) == engine.intersects(*ends)).all()
    assert ((engine.contains_segment(*ends, **cut) > 0) == engine.contains_segment(*ends)).all()
    assert (engine.side(segments[:, :2], **cut) == engine.side(segments[:, :2])).all()
    t = engine.first_hit(*ends).t
    found = engine.first_hit(*ends, **cut)
    np.testing.assert_array_equal(found.lower, np.where(np.isnan(t), np.inf, t))
    np.testing.assert_array_equal(found.upper, found.lower)
    lower, upper = engine.distance(segments[:, :2], **cut)
    assert (upper * (1 - 2**-50) - 1e-69 <= lower).all()


@some
@given(rings_and_segments(), cuts)
def test_first_hits_are_in_their_bounds(case, cut):
    points, segments = case
    engine, ends = made(points), segments.T
    t = engine.first_hit(*ends).t
    found = engine.first_hit(*ends, **cut)
    assert holds(found, np.where(np.isnan(t), np.inf, t))
    meets = engine.intersects(*ends, **cut)
    assert ((meets < 0) == np.isinf(found.lower)).all()
    assert ((meets > 0) == np.isfinite(found.upper)).all()
    assert (found.upper[np.isfinite(found.upper)] <= 1).all()
    for i, segment in enumerate(segments.tolist()):
        assert engine.first_hit(*segment, **cut) == (found.lower[i], found.upper[i])


@some
@given(two_rings(), cuts)
def test_two_objects_agree_with_the_reference(case, cut):
    one, two = made(case[0][:12]), made(case[1][:12])
    rings = one.boundary().xy, two.boundary().xy
    meets, found = one.collides(two, **cut), one.clearance(two, **cut)
    assert meets == two.collides(one, **cut) == reference.collides(*rings, **cut)
    assert meets in (0, 1 if one.collides(two) else -1)
    assert found == two.clearance(one, **cut) == reference.clearance(*rings, **cut)
    exact = one.clearance(two)
    assert holds(found, exact)
    if "tolerance" in cut and math.isfinite(exact):
        slack = found.upper * 2**-50 + 1e-69
        assert found.upper - found.lower <= 3 * cut["tolerance"] + slack
    for least in (-1.0, 0.0, found.lower, found.upper, exact, exact / 2, 2 * exact, 1.0):
        if math.isfinite(least):
            told = one.clearance(two, at_least=least, **cut)
            assert told in (0, 1 if exact >= least else -1)
            if least > 0:
                decided = (found.lower >= least) - (found.upper < least)
                assert told == decided
    assert one.collides(one, **cut) == (1 if len(rings[0]) else -1)


# ---------------------------------------------------------------------- tighter
@some
@given(rings_and_segments())
def test_each_level_is_within_the_one_above(case):
    points, segments = case
    engine, ends = made(points), segments.T
    asked = [
        [
            engine.distance(segments[:, :2], level=level),
            engine.first_hit(*ends, level=level),
            (engine.intersects(*ends, level=level), engine.contains_segment(*ends, level=level)),
        ]
        for level in range(6)
    ]
    for (far, hit, told), (nearer, sooner, more) in pairwise(asked):
        for wide, narrow in ((far, nearer), (hit, sooner)):
            assert (wide.lower <= narrow.lower).all()
            assert (narrow.upper <= wide.upper).all()
        for before, now in zip(told, more, strict=True):
            assert ((before == 0) | (before == now)).all()


@some
@given(two_rings())
def test_each_level_of_two_objects_is_within_the_one_above(case):
    one, two = made(case[0]), made(case[1])
    wide, told = fk.Bounds(0.0, math.inf), 0
    for level in range(6):
        narrow, meets = one.clearance(two, level=level), one.collides(two, level=level)
        assert wide.lower <= narrow.lower <= narrow.upper <= wide.upper
        assert told in (0, meets)
        wide, told = narrow, meets


@pytest.mark.parametrize("make", [wavy, coast])
def test_the_undecided_share_shrinks_with_the_level_and_the_tolerance(make):
    engine = made(make(2000))
    rng = np.random.default_rng(5)
    start = rng.uniform(-1.5, 1.5, (400, 2))
    ends = (*start.T, *(start + rng.normal(0, 0.2, (400, 2))).T)
    others = [made(0.3 * make(300) + rng.uniform(-1.6, 1.6, 2)) for _ in range(25)]
    for steps in (
        [{"level": level} for level in (0, 2, 4, 7, 12, 40)],
        [{"tolerance": tolerance} for tolerance in (1.0, 0.3, 0.1, 0.03, 0.01, 0.001)],
    ):
        undecided = [
            (
                np.count_nonzero(engine.side(start, **cut) == 0),
                np.count_nonzero(engine.intersects(*ends, **cut) == 0),
                np.count_nonzero(engine.contains_segment(*ends, **cut) == 0),
                sum(engine.collides(other, **cut) == 0 for other in others),
                float(np.mean(np.subtract(*engine.distance(start, **cut)[::-1]))),
            )
            for cut in steps
        ]
        assert (np.diff(undecided, axis=0) <= 0).all()
        assert (np.array(undecided[0]) > [50, 50, 40, 5, 0.2]).all()
        assert (np.array(undecided[-1]) < [4, 4, 4, 1, 0.002]).all()


# ---------------------------------------------------------------------- lazy
def test_a_level_touches_no_level_below():
    other = made(coast(3000) + np.array([1.2, 0.3]))
    for level in (0, 2, 5):
        engine = made(coast(3000))
        rng = np.random.default_rng(3)
        places = rng.uniform(-0.5, 1.5, (200, 2))
        engine.distance(places, level=level)
        engine.side(places, level=level)
        ends = (*places.T, *places[::-1].T)
        engine.intersects(*ends, level=level)
        engine.contains_segment(*ends, level=level)
        engine.first_hit(*ends, level=level)
        engine.collides(other, level=level)
        engine.clearance(other, level=level)
        assert engine.levels <= level
        assert engine.refined <= 2 ** (level + 1) - 1
        before = engine.refined
        engine.distance(places, level=level)
        engine.clearance(other, level=level)
        assert engine.refined == before
        engine.check()


@pytest.mark.parametrize("cut", [{"level": 30}, {"tolerance": 1e-4}])
def test_only_what_is_near_the_answer_is_refined(cut):
    engine = made(coast(20_000))
    assert engine.intersects(50.0, 50.0, 60.0, 50.0, **cut) == -1
    assert engine.collides(made([(90.0, 90.0), (91.0, 90.0), (90.0, 91.0)]), **cut) == -1
    assert engine.first_hit(50.0, 50.0, 60.0, 50.0, **cut) == (math.inf, math.inf)
    assert engine.refined == 1
    engine.distance(50.0, 50.0, **cut)
    assert 10 < engine.refined < 200
    engine.intersects(-1.0, 0.5, 2.0, 0.5, **cut)
    engine.first_hit(-1.0, 0.5, 2.0, 0.5, **cut)
    assert engine.refined < 600


def test_changes_are_followed():
    xy = coast(2000)
    engine = made(xy[:-200])
    for x, y in xy[-200:].tolist():
        engine.distance(x, y, level=9)
        engine.distance(x, y, tolerance=0.01)
        engine.insert(x, y)
    fresh, asked = made(xy), np.random.default_rng(2).uniform(-0.5, 1.5, (300, 2))
    for cut in ({"level": 9}, {"tolerance": 0.01}):
        for one, two in zip(
            engine.distance(asked, **cut), fresh.distance(asked, **cut), strict=True
        ):
            np.testing.assert_array_equal(one, two)
    engine.check()


# ---------------------------------------------------------------------- the edges of it
def test_touching_is_known_where_no_error_is_left():
    engine = made(np.array(NOTCH))
    for cut in ({"level": 9}, {"tolerance": 0.0}):
        assert engine.contains_segment(0.0, 1.0, 4.0, 1.0, **cut) == 1  # touches the tip
        assert engine.contains_segment(0.0, 0.0, 4.0, 0.0, **cut) == -1  # across the mouth
        assert engine.intersects(2.0, 1.0, 2.0, 1.0, **cut) == 1
        assert engine.distance(2.0, 1.0, **cut) == (0.0, 0.0)
        assert engine.side(2.0, 1.0, **cut) == 0
    square, beside = made(np.array(SQUARE)), made(np.add(SQUARE, (4.0, 1.0)))
    assert square.collides(beside, level=9) == 1
    assert square.clearance(beside, level=9) == (0.0, 0.0)
    assert square.clearance(beside, at_least=1e-9, tolerance=0.0) == -1


def test_one_in_the_other_collides_at_a_coarse_level():
    outer, inner = made(wavy(400)), made(0.2 * wavy(400, seed=2))
    assert outer.collides(inner, level=4) == inner.collides(outer, level=4) == 1
    assert outer.clearance(inner, tolerance=0.05) == (0.0, 0.0)
    assert outer.clearance(inner, at_least=0.1, tolerance=0.05) == -1


def test_degenerate_objects_have_no_boundary():
    flat, square = made(np.array([(0.0, 0.0), (1.0, 1.0)])), made(np.array(SQUARE))
    for cut in ({"level": 2}, {"tolerance": 0.5}):
        assert flat.distance(0.0, 0.0, **cut) == (math.inf, math.inf)
        assert flat.side(0.0, 0.0, **cut) == -1
        assert flat.intersects(0.0, 0.0, 1.0, 1.0, **cut) == -1
        assert flat.contains_segment(0.0, 0.0, 1.0, 1.0, **cut) == -1
        assert flat.first_hit(0.0, 0.0, 1.0, 1.0, **cut) == (math.inf, math.inf)
        for a, b in ((flat, square), (square, flat), (flat, flat)):
            assert a.collides(b, **cut) == -1
            assert a.clearance(b, **cut) == (math.inf, math.inf)
            assert a.clearance(b, at_least=1e60, **cut) == 1


def test_arrays_broadcast():
    engine = made(np.array(SQUARE))
    x1 = np.array([[1.0], [9.0]])
    assert engine.intersects(1.0, 2.0, x1, [2.0, 3.0, 9.0], level=9).tolist() == [
        [-1, -1, 1],
        [1, 1, 1],
    ]
    assert engine.first_hit(1, 2, x1, [2, 3, 9], level=0).lower.shape == (2, 3)
    assert engine.distance([[1.0, 2.0]], 1.0, tolerance=0.1).upper.shape == (1, 2)
    assert engine.distance(1, 2, tolerance=0).lower == pytest.approx(1.0)
    assert engine.side(np.zeros((0, 2)), level=0).shape == (0,)


@pytest.mark.parametrize(
    ("cut", "words"),
    [
        ({"level": 1, "tolerance": 1.0}, "either level or tolerance"),
        ({"level": -1}, "level: got -1"),
        ({"level": 0.5}, "level: got 0.5"),
        ({"tolerance": -0.5}, "tolerance: got -0.5"),
        ({"tolerance": math.nan}, "tolerance: got nan"),
    ],
)
def test_bad_cuts_are_refused(cut, words):
    engine = made(np.array(SQUARE))
    for ask in (
        lambda: engine.distance(0.0, 0.0, **cut),
        lambda: engine.side(0.0, 0.0, **cut),
        lambda: engine.intersects(0.0, 0.0, 1.0, 1.0, **cut),
        lambda: engine.contains_segment(0.0, 0.0, 1.0, 1.0, **cut),
        lambda: engine.first_hit(0.0, 0.0, 1.0, 1.0, **cut),
        lambda: engine.collides(engine, **cut),
        lambda: engine.clearance(engine, **cut),
        lambda: engine.clearance(engine, at_least=1.0, **cut),
    ):
        with pytest.raises(fk.InputError, match=words):
            ask()
    with pytest.raises(fk.InputError, match="row 1"):
        engine.distance([0.0, math.nan], 0.0, level=1)
    with pytest.raises(fk.InputError, match="at_least: got nan"):
        engine.clearance(engine, at_least=math.nan, level=1)
