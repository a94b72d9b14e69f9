"""The set decides, not its history: whatever came in which way, the engine is the reference.

Histories of single points, batches and questions on awkward sets; after every question the whole
state is compared, exactly, with the reference made from scratch, and at the end with engines that
met the same set in other ways.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

import flintknap as fk
import oracles
import strategies
from flintknap import reference

relentless = settings(deadline=None, max_examples=300)


def judge(engine):
    """Assert that the engine is sound and agrees with the reference in everything."""
    engine.check()
    xy, boundary = engine.points(), engine.boundary()
    triangles = reference.triangulate(xy)
    expected = reference.widen(xy, triangles=triangles)
    assert engine.ids().tolist() == list(range(len(engine))) == list(range(len(xy)))
    assert engine.triangles().tolist() == triangles.tolist()
    captures = reference.constrict(xy, triangles).captures
    assert [tuple(gate) for gate in engine._kernel.captures().tolist()] == captures
    assert boundary.status == expected.status
    assert boundary.ids.tolist() == expected.ring.tolist()
    assert boundary.inside.tolist() == expected.inside.tolist()
    assert boundary.xy.tolist() == xy[expected.ring].tolist()
    assert engine.digest() == reference.digest(xy)


def by_coordinates(engine):
    """Everything that must not depend on ids."""
    xy, boundary = engine.points().tolist(), engine.boundary()
    triangles = sorted([xy[v] for v in row] for row in engine.triangles().tolist())
    inside = [xy[v] for v in boundary.inside.tolist()]
    return triangles, boundary.xy.tolist(), inside, boundary.status, engine.digest()


def built(*batches):
    engine = fk.Engine()
    for batch in batches:
        engine.insert(batch)
    return engine


def places(xy, ring, rng):
    """Queries: the points, middles of all pairs of ring neighbours and of others, and anywhere."""
    corners = xy[ring]
    halves = [(corners + np.roll(corners, -shift, axis=0)) / 2 for shift in (1, 2, 3)]
    low, high = (xy.min(axis=0), xy.max(axis=0)) if len(xy) else (-np.ones(2), np.ones(2))
    anywhere = low + (high - low) * rng.uniform(-0.1, 1.1, (20, 2))
    near = np.nextafter(corners[:10], np.inf)
    mixed = np.column_stack([rng.permutation(xy[:20, 0]), rng.permutation(xy[:20, 1])])
    found = np.concatenate([xy, *halves, anywhere, near, mixed])
    return found[strategies.admissible(found).all(axis=1)]


@relentless
@given(strategies.histories(60))
def test_the_engine_is_the_reference_after_every_question(history):
    engine, ids, counts = fk.Engine(), {}, {}
    for operation, xy in history:
        points = [tuple(p) for p in (xy + 0.0).tolist()]
        for p in points:
            ids.setdefault(p, len(ids))
            counts[p] = counts.get(p, 0) + 1
        if operation == "one":
            assert engine.insert(*xy[0].tolist()) == ids[points[0]]
        elif operation == "batch":
            assert engine.insert(xy).tolist() == [ids[p] for p in points]
        elif operation == "look":
            found = engine.triangles()
            assert found.tolist() == reference.triangulate(engine.points()).tolist()
        else:
            judge(engine)
        assert len(engine) == len(ids)
    assert [tuple(p) for p in engine.points().tolist()] == list(ids)
    assert engine.multiplicity(engine.ids()).tolist() == [counts[p] for p in ids]


@relentless
@given(strategies.point_sets(60), strategies.generators, st.integers(0, 60))
def test_order_and_batches_do_not_matter(xy, rng, cut):
    whole = built(xy)
    backwards = fk.Engine()
    for x, y in xy[::-1].tolist():
        backwards.insert(x, y)
        backwards.side(x, y)
    shuffled = rng.permutation(xy)
    asked = built(shuffled[:cut])
    asked.boundary()
    asked.insert(shuffled[cut:])
    judge(whole)
    for other in (backwards, asked):
        other.check()
        assert by_coordinates(other) == by_coordinates(whole)


@relentless
@given(strategies.point_sets(40), strategies.generators)
def test_side_is_that_of_the_reference(xy, rng):
    engine = built(xy[: len(xy) // 2])
    engine.side(0.0, 0.0)
    engine.insert(xy[len(xy) // 2 :])
    found = reference.widen(engine.points())
    queries = places(engine.points(), found.ring, rng)
    expected = [reference.side(engine.points(), found.ring, x, y) for x, y in queries.tolist()]
    assert engine.side(queries).tolist() == expected
    assert [engine.side(x, y) for x, y in queries.tolist()] == expected
    assert engine.contains(queries).tolist() == [side >= 0 for side in expected]
    assert engine.side(engine.boundary().xy).tolist() == [0] * len(found.ring)


@relentless
@given(strategies.point_sets(30), strategies.generators)
def test_side_is_0_on_exact_midpoints_of_the_ring(xy, rng):
    engine = built(rng.permutation(xy))
    ring = engine.boundary().xy
    for a, b in zip(ring.tolist(), np.roll(ring, -1, axis=0).tolist(), strict=True):
        middle = [(u + v) / 2 for u, v in zip(a, b, strict=True)]
        exact = [(Fraction(u) + Fraction(v)) / 2 for u, v in zip(a, b, strict=True)]
        if middle == exact and strategies.admissible(np.array(middle)).all():
            assert engine.side(*middle) == 0


# ------------------------------------------------------------------ larger sets
def uniform(rng):
    return rng.random((600, 2))


def curve(rng):
    """A flower with a noise of one spacing."""
    angle = rng.uniform(0, 2 * np.pi, 500)
    radius = 1 + 0.4 * np.sin(5 * angle) + rng.normal(0, 0.01, 500)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def sweep(rng):
    """The flower in order of its angle, clean, and starting anywhere."""
    angle = np.linspace(0, 2 * np.pi, 400, endpoint=False) + rng.random()
    radius = 1 + 0.4 * np.sin(5 * angle)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def grid(rng):
    return rng.permutation([(float(x), float(y)) for x in range(22) for y in range(19)])


def rings(rng):
    """Concentric exact circles, with their centre."""
    circle = np.array(strategies.ON_CIRCLE)
    return rng.permutation(np.concatenate([[(0.0, 0.0)], *(circle * s for s in (1, 2, 3, 4, 5))]))


def last_bits(rng):
    return 1 / 3 + rng.integers(-9, 10, (300, 2)) * 2.0**-54


LARGE = [uniform, curve, sweep, grid, rings, last_bits]


@pytest.mark.parametrize("make", LARGE)
@pytest.mark.parametrize("seed", range(2))
def test_large_sets_in_batches_and_at_once(make, seed):
    rng = np.random.default_rng(seed)
    xy = make(rng)
    engine = fk.Engine()
    for batch in np.array_split(xy, [1, 2, 3, 10, len(xy) // 3, len(xy) // 2]):
        engine.insert(batch)
        engine.boundary()
        engine.check()
    judge(engine)
    assert by_coordinates(engine) == by_coordinates(built(rng.permutation(xy)))


@pytest.mark.parametrize("make", LARGE)
def test_large_sets_point_by_point(make):
    """Asked after every point; often enough, in full."""
    xy = make(np.random.default_rng(3))
    engine = fk.Engine()
    for n, (x, y) in enumerate(xy.tolist(), 1):
        engine.insert(x, y)
        engine.side(x, y)
        if n % 60 == 0:
            assert by_coordinates(engine) == by_coordinates(built(xy[:n][::-1]))
    judge(engine)


@pytest.mark.parametrize("make", LARGE)
@pytest.mark.parametrize("seed", range(2))
def test_several_points_in_one_repair(make, seed):
    """Points are placed by a look at the triangles; the boundary follows many of them later."""
    rng = np.random.default_rng(seed)
    xy = rng.permutation(make(rng))
    engine = built(xy[:150])
    engine.boundary()
    for n, (x, y) in enumerate(xy[150:350].tolist(), 151):
        engine.insert(x, y)
        engine.edges("hull")
        if rng.random() < 0.15:
            engine.check()
            assert engine.digest() == built(xy[:n]).digest()
    judge(engine)


def test_small_batches_on_a_large_set():
    """Among thousands, a batch of a few is repaired at once and not made from scratch."""
    rng = np.random.default_rng(11)
    xy = np.concatenate([rng.random((4000, 2)), rng.integers(0, 64, (4000, 2)) / 64])
    engine = built(rng.permutation(xy))
    engine.boundary()
    for _ in range(30):
        engine.insert(rng.random() + rng.normal(0, 0.01, (rng.integers(2, 8), 2)))
        engine.boundary()
        engine.check()
    assert by_coordinates(engine) == by_coordinates(built(rng.permutation(engine.points())))


@pytest.mark.parametrize("make", [uniform, curve, sweep])
def test_shapely_agrees_on_generic_points(make):
    rng = np.random.default_rng(5)
    engine = built(make(rng))
    boundary = engine.boundary()
    oracles.judge_boundary_by_shapely(engine.points(), boundary.ids, boundary.inside)
    polygon = shapely.Polygon(boundary.xy)
    queries = rng.uniform(-1.5, 1.5, (20000, 2))
    assert (engine.contains(queries) == shapely.contains_xy(polygon, *queries.T)).all()
    assert (engine.side(boundary.xy) == 0).all()
    assert boundary.area == pytest.approx(polygon.area)
    assert boundary.length == pytest.approx(polygon.length)
    assert shapely.geometry.shape(boundary).equals(polygon)


@relentless
@given(strategies.point_sets(40))
def test_the_ring_is_simple_and_leaves_nothing_out(xy):
    engine = built(xy)
    boundary = engine.boundary()
    oracles.judge_boundary(engine.points(), boundary.ids, boundary.inside, boundary.status)
