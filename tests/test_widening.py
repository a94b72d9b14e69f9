"""Widening: the engine is the reference, whatever came and went; its ring leaves nothing out."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

import flintknap as fk
import oracles
import strategies
from flintknap import reference, widening

relentless = settings(deadline=None, max_examples=300)

depths = st.sampled_from([-1.0, -1.0, -0.5, -0.2, -0.05, -1e-9, 0.0])

# A room about 0 with five blades: of each edge between two of them the far end is hidden by the
# next blade, but for 2 -> 7, the nearest. Past 7 there is a gap to another room, in which 1 lies.
SPIRAL = """69,87 77,188 114,80 72,124 23,93 54,63 95,51 120,173 0,96 16,0 106,36 127,78 69,197
403,383 41,217"""

LOCKED = np.array([(0, 0), (1, 1), (2, 1), (2, 5), (3, 0), (3, 2), (5, 0)], np.float64)


def judge(engine, d_min=-1.0):
    """Assert that the engine is sound, agrees with the reference, and that its ring is one."""
    engine.check()
    xy, boundary, ids = engine.points(), engine.boundary(), engine.ids()
    expected = reference.widen(xy, d_min)
    assert boundary.ids.tolist() == ids[expected.ring].tolist()
    assert boundary.inside.tolist() == ids[expected.inside].tolist()
    assert (boundary.status, boundary.d) == (expected.status, expected.d)
    assert engine.digest() == reference.digest(xy, d_min)
    oracles.judge_boundary(xy, expected.ring, expected.inside, expected.status)


def built(xy, d_min=-1.0):
    engine = fk.Engine(d_min=d_min)
    engine.insert(xy)
    return engine


@st.composite
def rooms(draw):
    """Walls like saw blades around some points: nearly half of them lock, most with several."""
    rng, teeth, inside = (
        draw(strategies.generators),
        draw(st.integers(5, 24)),
        draw(st.integers(1, 9)),
    )
    skew, depth = rng.uniform(-1.2, 1.2), 1 + rng.uniform(0.05, 0.8) * rng.uniform(0.7, 1.3, teeth)
    tips = np.exp(2j * np.pi * (np.arange(teeth) + rng.uniform(-0.1, 0.1, teeth)) / teeth)
    gullets = depth * np.exp(2j * np.pi * (np.arange(teeth) + 0.5 + skew) / teeth)
    within = np.sqrt(rng.random(inside)) * np.exp(2j * np.pi * rng.random(inside))
    places = np.concatenate([tips, gullets, rng.uniform(0.2, 0.95) * within])
    xy = np.column_stack((places.real, places.imag))
    steps = draw(st.sampled_from([0, 0, 6, 20]))
    return np.round(xy * steps) if steps else xy


@relentless
@given(strategies.point_sets(60) | rooms(), depths)
def test_the_engine_is_the_reference(xy, d_min):
    judge(built(xy, d_min), d_min)


@st.composite
def crowds(draw):
    """Sets that lock: clouds of points, some of them on a coarse lattice."""
    rng, count = draw(strategies.generators), draw(st.integers(20, 150))
    xy = rng.normal(size=(count, 2)) if draw(st.booleans()) else rng.random((count, 2))
    steps = draw(st.sampled_from([0, 0, 8, 32]))
    return np.round(xy * steps) if steps else xy


@relentless
@given(crowds(), strategies.generators, depths)
def test_inserts_and_removals_one_by_one(xy, rng, d_min):
    """Points come and go, with a question after each: the engine is one made from scratch."""
    engine = built(xy, d_min)
    engine.boundary()
    for _ in range(8):
        if rng.random() < 0.5:
            engine.remove(rng.choice(engine.ids()))
        else:
            engine.insert(*(rng.choice(xy) + rng.choice([0, 1, 0.01]) * rng.normal(size=2)))
        boundary = engine.boundary()
        fresh = built(engine.points(), d_min).boundary()
        engine.check()
        assert boundary.xy.tolist() == fresh.xy.tolist()
        assert (boundary.status, boundary.d) == (fresh.status, fresh.d)
    judge(engine, d_min)


@relentless
@given(crowds(), strategies.generators)
def test_the_order_of_the_rows_does_not_matter(xy, rng):
    xy = strategies.distinct(xy)
    order = rng.permutation(len(xy))
    found, again = reference.widen(xy), reference.widen(xy[order])
    assert found.ring.tolist() == order[again.ring].tolist()
    assert (found.status, found.d) == (again.status, again.d)


@relentless
@given(crowds(), depths)
def test_a_limit_that_is_not_met_changes_nothing(xy, d_min):
    xy = strategies.distinct(xy)
    found, less = reference.widen(xy, d_min), reference.widen(xy, d_min / 2)
    assert d_min <= found.d <= 0
    assert d_min / 2 <= less.d <= 0
    if found.d >= d_min / 2:
        assert found.captures == less.captures
    assert reference.widen(xy, 0).captures == []
    assert reference.widen(xy, 0).ring.tolist() == reference.constrict(xy).ring.tolist()


@relentless
@given(crowds() | rooms() | strategies.point_sets(60))
def test_a_locked_constriction_has_a_candidate(xy):
    """No pinwheel: what is locked is so for the triangulation, not for wider graphs."""
    xy = strategies.distinct(xy)
    locked = reference.constrict(xy)
    assert bool(len(locked.inside)) == bool(reference.widen(xy).captures)


@pytest.mark.parametrize("d_min", [-1.5, 0.1, math.nan, math.inf, "deep", None])
def test_a_limit_that_is_none(d_min):
    with pytest.raises(fk.InputError, match=r"d_min: got .*, expected a number from -1 to 0"):
        fk.Engine(d_min=d_min)


@given(st.floats(-1, 0, exclude_min=True))
def test_the_limit_is_exact(d_min):
    """The cotangent is the last whose gamma is no less than d_min."""
    cot = widening.least_cotangent(d_min)
    assert reference.widening.may(cot, d_min)
    assert not reference.widening.may(math.nextafter(cot, -math.inf), d_min)
    assert (1 + Fraction(d_min)) ** 2 * (1 + Fraction(cot) ** 2) <= 1


@pytest.mark.parametrize("seed", range(2))
def test_clusters_that_claim_one_edge(seed):
    """Clusters meet and unite with others meanwhile; at the end all are linked as from scratch."""
    rng = np.random.default_rng(seed + 11)
    xy = np.concatenate([rng.random((4000, 2)), rng.integers(0, 64, (4000, 2)) / 64])
    engine = fk.Engine()
    engine.insert(rng.permutation(xy))
    engine.side(0.0, 0.0)
    for _ in range(30):
        engine.insert(rng.random() + rng.normal(0, 0.01, (rng.integers(2, 8), 2)))
        engine.side(0.0, 0.0)
    engine.check()


def island(seed):
    """Return a crowd within a jagged shore, some on a lattice: each of these seeds locks it."""
    rng = np.random.default_rng(seed)
    count, shore = int(rng.integers(10, 40)), int(rng.integers(4, 30))
    scale, steps = 10.0 ** -rng.integers(1, 6), int(rng.integers(0, 4))
    angle = np.sort(rng.random(shore)) * 2 * np.pi
    coast = rng.uniform(0.6, 1.4, (shore, 1)) * np.column_stack((np.cos(angle), np.sin(angle)))
    crowd = rng.normal(size=(count, 2)) * scale
    if steps:
        crowd = np.round(crowd / scale * steps) * scale / steps
    return strategies.distinct(np.concatenate([coast, crowd + rng.uniform(-0.3, 0.3, 2)]))


@pytest.mark.parametrize("seed", [1703, 1983, 2321, 2480, 2708, 4973, 5744, 5876])
def test_a_crowd_far_from_the_ring(seed):
    """Windows between its members wait until all that is nearer the ring has been taken."""
    xy = island(seed)
    assert len(built(xy, 0.0).boundary().inside) > 8
    for d_min in (-1.0, -0.4):
        judge(built(xy, d_min), d_min)
    engine, rng = built(xy), np.random.default_rng(seed)
    for _ in range(8):
        if rng.random() < 0.5:
            engine.remove(rng.choice(engine.ids()))
        else:
            near, other = rng.choice(xy[-8:], 2)
            engine.insert(*(near + rng.choice([1, 100]) * (near - other)))
        engine.check()
        assert engine.digest() == built(engine.points()).digest()
    judge(engine)


@pytest.mark.parametrize(("n", "seed"), [(60, 8033), (120, 802), (120, 9494), (120, 10255)])
def test_what_is_left_goes_on_to_the_limit(n, seed):
    """A cluster with sites left inside meets whoever offers them an edge within the limit."""
    xy = np.random.default_rng(seed).normal(size=(n, 2)) ** 3
    for order in range(2):
        engine = fk.Engine(d_min=-0.2)
        engine.insert(np.random.default_rng(order).permutation(xy))
        assert engine.digest() == reference.digest(xy, -0.2)


def test_limits_at_the_ends():
    assert widening.least_cotangent(-1) == -math.inf
    assert widening.least_cotangent(0) == widening.least_cotangent(-0.0) == 0


def test_locked_and_widened():
    """Two diagonals of a cocircular quadrilateral: what needs no widening is taken, too."""
    locked = built(LOCKED, 0.0).boundary()
    assert (locked.ids.tolist(), locked.inside.tolist()) == ([0, 4, 6, 5, 3, 1], [2])
    widened = built(LOCKED).boundary()
    assert (widened.ids.tolist(), widened.status, widened.d) == ([0, 2, 4, 6, 5, 3, 1], "closed", 0)
    between = (1.8, 0.5)  # in the triangle that went
    assert (built(LOCKED, 0.0).side(*between), built(LOCKED).side(*between)) == (1, -1)
    assert (built(LOCKED, 0.0).side(2.0, 1.0), built(LOCKED).side(2.0, 1.0)) == (1, 0)


def test_a_limit_on_the_way_leaves_the_point_inside():
    xy = np.random.default_rng(2).random((300, 2))
    whole = built(xy).boundary()
    assert whole.status == "closed"
    assert whole.d < 0
    just, short = built(xy, whole.d * (1 + 1e-12)), built(xy, whole.d / 10)
    assert just.boundary().xy.tolist() == whole.xy.tolist()
    boundary = short.boundary()
    assert (boundary.status, boundary.d > whole.d) == ("locked", True)
    assert (short.side(short.points(boundary.inside)) == 1).all()


@pytest.mark.parametrize("rays", [3, 4, 5, 6])
def test_a_pinwheel_does_not_lock(rays):
    """Drawn so that the middle sees each edge from one ray to the next past the end of another."""
    rays = [(3, 0), (0, 3), (-3, 0), (0, -3), (2, 2), (-2, -1)][:rays]
    for far, turn in ((2, 0), (3, 0), (2, 0.1), (2, -0.1)):
        bent = [(far * x + turn * y, far * y - turn * x) for x, y in rays]
        xy = np.array([(0, 0), *rays, *bent], np.float64)
        judge(engine := built(xy))
        assert engine.boundary().status == "closed"


def wholly_visible(xy, boundary, k):
    """The edges of the boundary that k sees whole, with no other point in between; by GEOS."""
    room, seen = shapely.Polygon(boundary.xy), []
    for i, j in zip(boundary.ids.tolist(), np.roll(boundary.ids, -1).tolist(), strict=True):
        triangle, others = shapely.Polygon(xy[[i, j, k]]), np.delete(xy, [i, j, k], axis=0)
        if (
            oracles.orient(xy[i], xy[j], xy[k]) > 0
            and room.covers(triangle)
            and not shapely.intersects_xy(triangle, *others.T).any()
        ):
            seen.append((i, j))
    return seen


def test_a_pinwheel_that_widening_makes_is_locked():
    """0 sees one edge whole; 1 is taken through it, and now each hides an end of the next."""
    xy = np.array([point.split(",") for point in SPIRAL.split()], np.float64)
    before = built(xy, 0.0).boundary()
    assert before.inside.tolist() == [0, 1]
    assert (2, 7) in wholly_visible(xy, before, 0)
    judge(engine := built(xy))
    boundary = engine.boundary()
    assert (boundary.status, boundary.inside.tolist()) == ("locked", [0])
    assert reference.widen(xy).captures == [(2, 7, 1)]
    assert wholly_visible(xy, boundary, 0) == []
    assert engine.side(*xy[0]) == 1
    engine.remove(1)  # and without it 0 is free
    judge(engine)
    assert engine.boundary().status == "closed"
    engine.insert(*xy[1])
    engine.check()
    assert engine.boundary().xy.tolist() == boundary.xy.tolist()


def test_snapshots_keep_the_limit_and_go_on(tmp_path):
    rng = np.random.default_rng(4)
    engine = built(rng.random((2000, 2)), -0.15)
    engine.save(tmp_path / "it")
    again = fk.load(tmp_path / "it")
    assert again.d_min == -0.15
    for it in (engine, again):
        it.insert(0.3, 0.7)
        it.remove(5)
        it.check()
    assert again.boundary().xy.tolist() == engine.boundary().xy.tolist()
    assert again.boundary().d == engine.boundary().d
    again.clear()
    assert again.d_min == -0.15


def spiral(n):
    t = np.sqrt(np.linspace(1, 60, n))
    return np.column_stack((t * np.cos(5 * t), t * np.sin(5 * t)))


def combs(n):
    """Two combs whose teeth lie between each other's."""
    y = np.linspace(0, 1, n // 20)
    left = [np.column_stack((np.full(len(y), x), y)) for x in range(10)]
    right = [np.column_stack((np.full(len(y), x + 0.5), y + 0.3)) for x in range(10)]
    return np.concatenate(left + right)


def noisy(n, spacings):
    t = np.sort(np.random.default_rng(n).random(n)) * 2 * np.pi
    xy = np.column_stack((np.cos(t), np.sin(t))) * (1 + 0.3 * np.sin(5 * t))[:, np.newaxis]
    return xy + np.random.default_rng(1).normal(0, spacings * 8 / n, xy.shape)


def coast(n):
    """A hexagon each edge of which is broken aside, again and again."""
    rng, line = np.random.default_rng(n), np.exp(2j * np.pi * np.arange(6) / 6)
    while len(line) < n:
        step = np.roll(line, -1) - line
        broken = line + step / 2 + 0.5j * rng.uniform(-1, 1, len(line)) * step
        line = np.column_stack((line, broken)).ravel()
    return np.column_stack((line.real, line.imag))


HARD = {
    "uniform": lambda n: np.random.default_rng(n).random((n, 2)),
    "noise of half a spacing": lambda n: noisy(n, 0.5),
    "noise of three spacings": lambda n: noisy(n, 3.0),
    "coast": coast,
    "spiral": spiral,
    "combs": combs,
    "grid": lambda n: np.argwhere(np.ones((round(n**0.5),) * 2)).astype(float),
}


@pytest.mark.parametrize("name", HARD)
@pytest.mark.parametrize("n", [500, 5000])
def test_no_point_is_left_inside_of_hard_sets(name, n):
    xy = HARD[name](n)
    engine = built(xy)
    boundary = engine.boundary()
    engine.check()
    assert (boundary.status, len(boundary)) == ("closed", len(engine))
    oracles.judge_boundary_by_shapely(engine.points(), boundary.ids, boundary.inside)
    assert (engine.side(boundary.xy) == 0).all()
