"""Flintstones and approximations: those of the reference, nested, certified; what they are asked.

The containment of every vertex is judged by fractions. How the tree is kept is another file
(test_hierarchy.py).
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st

import flintknap as fk
import oracles
import strategies
from flintknap import reference
from trees import built, coast, judge, judge_everywhere, levels, tolerances, wavy

relentless = settings(deadline=None, max_examples=120)


# ---------------------------------------------------------------------------- equality
@relentless
@given(strategies.point_sets(60), levels, tolerances, st.sampled_from([-1.0, 0.0]))
def test_cuts_are_those_of_the_reference(xy, level, tolerance, d_min):
    engine = built(xy, d_min)
    judge(engine, level=level)
    judge(engine, tolerance=tolerance)
    engine.check()


# ---------------------------------------------------------------------------- what they are
@relentless
@given(strategies.point_sets(60))
def test_levels_are_nested_and_the_last_is_the_boundary(xy):
    engine = built(xy)
    boundary = engine.boundary()
    before = set()
    for level in range(len(boundary) + 1):
        found = engine.approximate(level=level)
        assert before <= set(found.ids.tolist())
        assert len(found) <= 2 ** (level + 1)
        before = set(found.ids.tolist())
        if len(found) == len(boundary):
            break
    assert found.ids.tolist() == boundary.ids.tolist()
    assert not found.error.any()
    assert engine.approximate(level=10**9).ids.tolist() == boundary.ids.tolist()


@relentless
@given(strategies.point_sets(40), tolerances)
def test_errors_are_the_distances_of_the_polylines(xy, tolerance):
    engine = built(xy)
    found, ring = engine.approximate(tolerance=tolerance), engine.boundary()
    assert (found.error <= max(tolerance, 0)).all() or len(found) == 0
    assert found.largest_error <= tolerance
    places = [ring.ids.tolist().index(i) for i in found.ids.tolist()]
    for k, (first, error) in enumerate(zip(places, found.error.tolist(), strict=True)):
        length = (places[(k + 1) % len(places)] - first) % len(ring)
        walk = [ring.xy[(first + n) % len(ring)].tolist() for n in range(length + 1)]
        exact = max((squared_distance(v, walk[0], walk[-1]) for v in walk), default=0)
        assert Fraction(error) ** 2 >= exact
        less = math.nextafter(error, 0.0)
        assert error in (0.0, 1e-70) or Fraction(less) ** 2 < exact


def squared_distance(v, p, s):
    v, p, s = (tuple(map(Fraction, w)) for w in (v, p, s))
    c, d = (s[0] - p[0], s[1] - p[1]), (v[0] - p[0], v[1] - p[1])
    along = min(max((c[0] * d[0] + c[1] * d[1]) / (c[0] ** 2 + c[1] ** 2), 0), 1)
    return (d[0] - along * c[0]) ** 2 + (d[1] - along * c[1]) ** 2


@relentless
@given(strategies.point_sets(60), levels)
def test_every_number_of_a_flintstone_holds_its_vertices_exactly(xy, level):
    engine = built(xy)
    areas, ring = engine.localize(level=level), engine.boundary()
    place = {i: n for n, i in enumerate(ring.ids.tolist())}
    for k, (start, stop) in enumerate(zip(areas.start, areas.stop, strict=True)):
        first, length = place[start], (place[stop] - place[start]) % len(ring)
        walk = ring.xy[[(first + n) % len(ring) for n in range(length + 1)]]
        assert areas.contains(walk)[:, k].all()
        ends = areas.chord[k].tolist()
        for side, sign in ((0, 1), (1, -1)):
            offset, radius = areas.offset[k, side], areas.radius[k, side]
            for v in walk.tolist():
                turn = sign * oracles.orient(*ends, v)
                if math.isinf(offset):
                    assert turn <= 0
                elif turn > 0:
                    assert sign * exact_offset_squared(*ends, v) <= sign * signed_square(offset)
                if math.isinf(radius):
                    assert np.isnan(areas.center[k, side]).all()
                else:
                    centre = areas.center[k, side].tolist()
                    assert squared_distance_of(v, centre) <= Fraction(radius) ** 2


def signed_square(value):
    return Fraction(value) * abs(Fraction(value))


def exact_offset_squared(p, s, v):
    """Where the centre of the circle through three points lies, left of the chord ps, squared."""
    dot, cross = oracles.dot_and_cross(p, s, v)
    length = squared_distance_of(p, s)
    cot = dot / cross
    return cot * abs(cot) * length / 4


def squared_distance_of(a, b):
    return sum((Fraction(u) - Fraction(v)) ** 2 for u, v in zip(a, b, strict=True))


def test_flintstones_are_tight():
    areas = built(wavy(2000)).localize(level=5)
    is_disc = np.isfinite(areas.radius)
    assert is_disc.mean() > 0.5
    p, s = areas.chord[:, 0], areas.chord[:, 1]
    to_start = np.hypot(*np.moveaxis(areas.center - p[:, np.newaxis], -1, 0))
    to_stop = np.hypot(*np.moveaxis(areas.center - s[:, np.newaxis], -1, 0))
    assert np.allclose(to_start[is_disc], areas.radius[is_disc], rtol=1e-9)
    assert np.allclose(to_stop[is_disc], areas.radius[is_disc], rtol=1e-9)
    middle, chord = (p + s) / 2, s - p
    left = np.column_stack([-chord[:, 1], chord[:, 0]]) / np.hypot(*chord.T)[:, np.newaxis]
    centre = middle[:, np.newaxis] + areas.offset[..., np.newaxis] * left[:, np.newaxis]
    assert np.allclose(centre[is_disc], areas.center[is_disc], rtol=1e-9, atol=1e-9)


def test_contains_says_which():
    engine = built([(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0), (2.0, 1.0)])
    areas = engine.localize(level=0)
    assert len(areas) == 2
    assert areas.contains(2.0, 1.0).shape == (2,)
    assert areas.contains(2.0, 1.0).any()
    assert areas.contains([[2.0], [9.0]], [[1.0, 1.0, 1.0]]).shape == (2, 3, 2)
    assert not areas.contains(9.0, 1.0).any()
    edges = engine.localize(level=99)
    assert edges.contains(2.0, 3.0).sum() == 1
    assert not edges.contains(2.0, 2.0).any()
    with pytest.raises(fk.InputError, match="x: got nan"):
        areas.contains(math.nan, 0.0)


def test_the_base_is_the_widest_pair_on_the_smallest_disc():
    engine = built([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0), (1.0, 0.5)])
    assert engine.approximate(level=0).xy.tolist() == [[0.0, 0.0], [2.0, 2.0]]
    engine = built([(0.0, 0.0), (10.0, 0.0), (5.0, 0.5), (5.0, -0.75)])
    found = engine.approximate(level=0)
    assert found.xy.tolist() == [[0.0, 0.0], [10.0, 0.0]]
    assert found.error.tolist() == [0.75, 0.5]


def test_equal_discs_are_told_apart_by_coordinates():
    engine = built([(-2.0, 0.0), (2.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
    assert engine.approximate(level=1).ids.tolist() == [0, 3, 1, 2]
    # One polyline winds from (-5, 0) to (5, 0) over (3, 4) and (-3, -4), which are on one circle.
    ring = [(-5.0, 0.0), (-3.0, -4.0), (3.0, 4.0), (5.0, 0.0), (0.0, 4.5)]
    edges = reference.approximate(ring, 0)
    assert [edge.split for edge in edges if edge.start == 0] == [1]


# ---------------------------------------------------------------------------- sides
@relentless
@given(strategies.point_sets(40), strategies.generators, st.integers(0, 5))
def test_side_at_a_level_is_that_of_the_reference(xy, rng, level):
    engine = built(xy)
    ring = engine.boundary().xy
    low, high = (xy.min(axis=0), xy.max(axis=0)) if len(xy) else (-np.ones(2), np.ones(2))
    queries = np.concatenate([xy[:8], low + (high - low) * rng.uniform(-0.1, 1.1, (12, 2))])
    queries = queries[strategies.admissible(queries).all(axis=1)]
    found = engine.side(queries, level=level)
    assert found.dtype == np.int8
    expected = [reference.side_at(ring, *w, level=level) for w in queries.tolist()]
    assert found.tolist() == expected
    exact = engine.side(queries)
    assert ((found == 0) | (found == exact)).all()
    assert (engine.side(queries, level=10**9) == exact).all()
    for (x, y), said in zip(queries[:3].tolist(), expected, strict=False):
        assert engine.side(x, y, level=level) == said


@pytest.mark.parametrize("make", [wavy, coast])
def test_the_undecided_share_shrinks_with_the_level(make):
    engine = built(make(2000))
    xy = np.random.default_rng(5).uniform(-1.5, 1.5, (2000, 2))
    exact = engine.side(xy)
    undecided, before = [], np.ones(len(xy), bool)
    for level in (0, 1, 2, 3, 4, 6, 9, 14, 25, 50):
        found = engine.side(xy, level=level)
        assert ((found == 0) | (found == exact)).all()
        assert not ((found == 0) & ~before).any()
        before = found == 0
        outside = ~engine.localize(level=level).contains(xy).any(axis=-1)
        assert (found[outside] != 0).all()
        undecided.append(int(before.sum()))
    assert undecided[0] > len(xy) / 10
    assert undecided[-1] < undecided[0] / 10


def test_level_for_is_the_first_level_that_keeps_the_tolerance():
    engine = built(coast(600))
    errors = [engine.approximate(level=level).largest_error for level in range(15)]
    for tolerance in (0.5, 0.2, 0.05, 0.01, *errors):
        first = next((n for n, error in enumerate(errors) if error <= tolerance), None)
        if first is None:
            continue
        assert built(coast(600)).level_for(tolerance) == first
    deepest = engine.level_for(0.0)
    assert engine.approximate(level=deepest).largest_error == 0
    assert engine.approximate(level=deepest - 1).largest_error > 0


# ---------------------------------------------------------------------------- the edges of it
@pytest.mark.parametrize(
    "xy",
    [
        np.zeros((0, 2)),
        [(1.0, 2.0)],
        [(1.0, 2.0), (3.0, 4.0)],
        [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (5.0, 5.0)],
    ],
)
def test_degenerate_objects_have_empty_answers(xy):
    engine = built(xy)
    for cut in ({"level": 0}, {"level": 7}, {"tolerance": 0.0}, {"tolerance": 5.0}):
        found, areas = engine.approximate(**cut), engine.localize(**cut)
        assert (len(found), found.level, found.largest_error) == (0, 0, 0.0)
        assert found.xy.shape == (0, 2)
        assert len(areas) == 0
        assert areas.contains(1.0, 2.0).shape == (0,)
        assert areas.center.shape == (0, 2, 2)
    assert engine.side(1.0, 2.0, level=3) == -1
    assert (engine.levels, engine.refined, engine.level_for(0.0)) == (0, 0, 0)
    engine.check()


def test_a_triangle_is_its_own_approximation():
    engine = built([(0.0, 0.0), (4.0, 0.0), (0.0, 3.0)])
    assert engine.approximate(level=1).ids.tolist() == [0, 1, 2]
    assert engine.approximate(level=0).error.tolist() == [0.0, 2.4000000000000004] or (
        engine.approximate(level=0).largest_error >= 2.4
    )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({}, "neither"),
        ({"level": 1, "tolerance": 1.0}, "either level or tolerance"),
        ({"level": -1}, "level: got -1, expected an integer, 0 or more"),
        ({"level": 2.0}, "level: got 2.0"),
        ({"level": True}, "level: got True"),
        ({"level": "3"}, "level: got '3'"),
        ({"tolerance": -0.5}, "tolerance: got -0.5, expected a number, 0 or more"),
        ({"tolerance": math.nan}, "tolerance: got nan"),
        ({"tolerance": "1"}, "tolerance: got '1'"),
        ({"tolerance": True}, "tolerance: got True"),
    ],
)
def test_bad_cuts_are_refused(arguments, words):
    engine = built(wavy(20))
    for ask in (engine.approximate, engine.localize):
        with pytest.raises(fk.InputError, match=words):
            ask(**arguments)
    assert engine.refined == 0


def test_bad_levels_and_tolerances_are_refused_elsewhere():
    engine = built(wavy(20))
    with pytest.raises(fk.InputError, match=r"level: got 1\.5"):
        engine.side(0.0, 0.0, level=1.5)
    with pytest.raises(fk.InputError, match="x: got nan"):
        engine.side(math.nan, 0.0, level=1)
    with pytest.raises(fk.InputError, match="tolerance: got nan"):
        engine.level_for(math.nan)


def test_numpy_numbers_will_do_and_infinity_is_a_tolerance():
    engine = built(wavy(50))
    assert engine.approximate(level=np.int32(2)).level == 2
    assert len(engine.approximate(tolerance=np.float32(0.5))) >= 2
    assert len(engine.approximate(tolerance=10**400)) == 2
    assert len(engine.approximate(tolerance=math.inf)) == 2


def test_results_are_read_only():
    engine = built(wavy(50))
    found, areas = engine.approximate(level=2), engine.localize(level=2)
    arrays = [found.ids, found.xy, found.error, areas.start, areas.stop, areas.chord]
    for array in [*arrays, areas.offset, areas.center, areas.radius]:
        assert not array.flags.writeable
    assert np.asarray(found).tolist() == found.xy.tolist()


def test_approximations_are_smoothed():
    engine = built(wavy(300))
    curve, cut = engine.smooth(level=4), engine.approximate(level=4)
    assert curve.control[:, 0].tolist() == cut.xy.tolist()
    assert len(engine.smooth(tolerance=0.05).control) == len(engine.approximate(tolerance=0.05))
    with pytest.raises(fk.InputError, match="either level or tolerance"):
        engine.smooth(level=4, tolerance=0.05)


@pytest.mark.parametrize("make", [wavy, coast])
def test_a_tolerance_keeps_no_more_than_douglas_and_peucker_do(make):
    engine = built(make(10_000))
    ring = engine.boundary().xy
    line = shapely.LineString(np.concatenate([ring, ring[:1]]))
    for tolerance in (0.0005, 0.002, 0.01, 0.05):
        found = engine.approximate(tolerance=tolerance)
        theirs = line.simplify(tolerance, preserve_topology=False)
        assert len(found) <= 1.1 * (len(theirs.coords) - 1)  # they begin at another vertex
        strays = shapely.hausdorff_distance(line, shapely.LinearRing(found.xy))
        assert strays <= tolerance * (1 + 1e-12)


@relentless
@given(strategies.point_sets(60), tolerances, tolerances)
def test_a_smaller_tolerance_keeps_all_vertices_of_a_larger_one(xy, one, other):
    engine = built(xy)
    more, fewer = (engine.approximate(tolerance=each) for each in sorted((one, other)))
    assert set(fewer.ids.tolist()) <= set(more.ids.tolist())


def test_equally_far_vertices_are_told_apart_by_coordinates():
    steps = [(0.0, 0.0), (2.0, -1.0), (4.0, -1.0), (6.0, -1.0), (8.0, 0.0), (4.0, 9.0)]
    assert built(steps).approximate(tolerance=0.9).ids.tolist() == [0, 1, 4, 5]
    assert built(steps[::-1]).approximate(tolerance=0.9).ids.tolist() == [5, 4, 1, 0]


@given(st.lists(st.sampled_from(strategies.ON_CIRCLE), min_size=3, max_size=36, unique=True))
@example(strategies.ON_CIRCLE)
@settings(deadline=None)
def test_all_on_one_circle(points):
    engine = built(points)
    judge_everywhere(engine)
