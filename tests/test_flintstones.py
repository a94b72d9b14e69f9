"""The tree of Flintstones: the reference after every history, lazy, nested, certified.

Whatever was asked before and whatever has changed since, each level and each tolerance is what the
reference makes of the ring from scratch. The containment of every vertex is judged by fractions.
"""

from __future__ import annotations

import math
import signal
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

relentless = settings(deadline=None, max_examples=120)
levels = st.integers(0, 6) | st.just(10**9)
tolerances = st.sampled_from([0.0, 1e-70, 1e-3, 0.1, 0.5, 1.0, 2.0, math.inf]) | st.floats(0, 3)


def built(xy, d_min=-1.0):
    engine = fk.Engine(d_min)
    engine.insert(xy)
    return engine


def wavy(n, seed=1):
    t = (np.arange(n) + np.random.default_rng(seed).random(n)) * (2 * np.pi / n)
    radius = 1 + 0.3 * np.sin(9 * t) + 0.05 * np.sin(53 * t)
    return np.column_stack((radius * np.cos(t), radius * np.sin(t)))


def coast(n, seed=1, rough=1.0):
    """A closed line as crooked on every scale: the longest edges are broken again and again."""
    rng = np.random.default_rng(seed)
    xy = np.array([[0.0, 0.0], [1.0, 0.1], [1.1, 1.0], [0.1, 0.9]])
    while len(xy) < n:
        step = np.roll(xy, -1, axis=0) - xy
        longest = np.argsort(-np.hypot(*step.T))[: min(len(xy) // 3 + 1, n - len(xy))]
        at = np.sort(longest)
        aside = rough * rng.uniform(-0.5, 0.5, (len(at), 1))
        middle = xy[at] + step[at] / 2 + aside * np.column_stack([-step[at, 1], step[at, 0]])
        xy = np.insert(xy, at + 1, middle, axis=0)
    return xy


def judge(engine, level=None, tolerance=None):
    """Assert that approximation and Flintstones of a cut are those of the reference."""
    boundary = engine.boundary()
    cut = {"level": level} if tolerance is None else {"tolerance": tolerance}
    expected = reference.approximate(boundary.xy, **cut)
    found = engine.approximate(level=level, tolerance=tolerance)
    starts = [edge.start for edge in expected]
    assert found.ids.tolist() == boundary.ids[starts].tolist()
    assert found.xy.tolist() == boundary.xy[starts].tolist()
    assert found.error.tolist() == [edge.error for edge in expected]
    assert found.level == max((edge.level for edge in expected), default=0)
    expected = reference.localize(boundary.xy, **cut)
    areas = engine.localize(level=level, tolerance=tolerance)
    starts = [edge.start for edge in expected]
    assert areas.start.tolist() == boundary.ids[starts].tolist()
    assert areas.stop.tolist() == boundary.ids[[edge.stop for edge in expected]].tolist()
    assert areas.chord[:, 0].tolist() == boundary.xy[starts].tolist()
    assert np.isneginf(areas.offset[:, 0]).tolist() == [edge.left is None for edge in expected]
    assert np.isposinf(areas.offset[:, 1]).tolist() == [edge.right is None for edge in expected]


def judge_everywhere(engine):
    engine.check()
    for level in (0, 1, 2, 5, 10**9):
        judge(engine, level=level)
    xy = engine.points()
    size = float(np.ptp(xy, axis=0).max()) if len(xy) else 1.0
    for tolerance in (0.0, size / 100, size / 8):
        judge(engine, tolerance=tolerance)


# ---------------------------------------------------------------------------- equality
@relentless
@given(strategies.point_sets(60), levels, tolerances, st.sampled_from([-1.0, 0.0]))
def test_cuts_are_those_of_the_reference(xy, level, tolerance, d_min):
    engine = built(xy, d_min)
    judge(engine, level=level)
    judge(engine, tolerance=tolerance)
    engine.check()


@st.composite
def changes(draw, size):
    """A set to begin with, and steps: points that come, how many leave, what is asked."""
    xy = strategies.distinct(draw(strategies.point_sets(size)))
    start = draw(st.integers(0, len(xy)))
    question = st.tuples(levels, st.none()) | st.tuples(st.none(), tolerances)
    steps = st.tuples(st.integers(0, 3), st.integers(0, 2), st.lists(question, max_size=2))
    return xy, start, draw(st.lists(steps, max_size=12)), draw(strategies.generators)


@relentless
@given(changes(50), st.sampled_from([-1.0, 0.0]))
def test_the_tree_is_that_of_the_set_after_any_changes(history, d_min):
    xy, start, steps, rng = history
    engine = built(xy[:start], d_min)
    waiting = list(xy[start:])
    engine.approximate(level=10**9)
    engine.approximate(tolerance=0.0)
    for coming, leaving, questions in steps:
        for _ in range(min(coming, len(waiting))):
            engine.insert(*waiting.pop().tolist())
        ids = rng.permutation(engine.ids())[:leaving]
        engine.remove(ids)
        for level, tolerance in questions:
            judge(engine, level=level, tolerance=tolerance)
        engine.check()
    judge_everywhere(engine)


@pytest.mark.parametrize("make", [wavy, coast])
def test_a_large_tree_follows_single_changes(make):
    xy = np.random.default_rng(2).permutation(make(3000))
    engine = built(xy[:-60])
    engine.approximate(level=10**9)
    engine.approximate(tolerance=0.0)
    other_ids = list(engine.ids()[:60])
    for p, leaving in zip(xy[-60:], other_ids, strict=True):
        engine.insert(*p.tolist())
        engine.approximate(level=4)
        engine.remove(int(leaving))
        engine.approximate(tolerance=0.01)
        engine.check()
    fresh = built(engine.points())
    for cut in ({"level": 3}, {"level": 10**9}, {"tolerance": 0.01}, {"tolerance": 0.0}):
        ours, theirs = engine.approximate(**cut), fresh.approximate(**cut)
        assert ours.xy.tolist() == theirs.xy.tolist()
        assert ours.error.tolist() == theirs.error.tolist()
        mine, others = engine.localize(**cut), fresh.localize(**cut)
        assert mine.offset.tolist() == others.offset.tolist()
        assert mine.radius.tolist() == others.radius.tolist()


def test_asking_changes_no_answer():
    xy = coast(500)
    asked, fresh = built(xy), built(xy)
    asked.side(xy.mean(axis=0)[np.newaxis], level=3)
    asked.approximate(tolerance=0.02)
    asked.localize(level=9)
    asked.level_for(0.1)
    assert asked.approximate(level=6).ids.tolist() == fresh.approximate(level=6).ids.tolist()


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


# ---------------------------------------------------------------------------- lazy
def test_a_level_builds_no_more_than_its_nodes():
    for ask in (fk.Engine.approximate, fk.Engine.localize):
        engine = built(np.random.default_rng(0).random((100_000, 2)))
        assert (engine.refined, engine.levels) == (0, 0)
        ask(engine, level=3)
        assert engine.refined == 15
        assert engine.levels == 3
        ask(engine, level=3)
        ask(engine, level=1)
        assert engine.refined == 15
        engine.check()


@pytest.mark.parametrize("ask", [fk.Engine.approximate, fk.Engine.localize])
def test_a_tolerance_refines_only_what_exceeds_it(ask):
    engine = built(coast(5000))
    found = ask(engine, tolerance=0.03)
    assert 20 < len(found) < 500
    assert engine.refined == len(found) - 1  # the base has two vertices, each other node one
    ask(engine, tolerance=0.03)
    ask(engine, tolerance=0.06)
    assert engine.refined == len(found) - 1
    engine.check()


def test_a_place_refines_only_along_its_path():
    engine = built(coast(5000))
    assert engine.side(50.0, 50.0, level=20) == -1
    assert engine.refined == 1
    engine.side(*engine.boundary().xy[77].tolist(), level=20)
    assert 10 < engine.refined < 200
    before = engine.refined
    engine.side(*engine.boundary().xy[77].tolist(), level=20)
    assert engine.refined == before


def test_a_vertex_within_the_flintstones_changes_none_of_them():
    xy = coast(20_000)
    engine = built(xy)
    engine.approximate(level=8)
    before = engine.refined
    ring = engine.boundary().xy
    step = np.roll(ring, -1, axis=0) - ring
    kept = 0
    for k in range(0, 20_000, 997):
        off = np.array([-step[k, 1], step[k, 0]]) * 1e-3
        engine.insert(*(ring[k] + step[k] / 2 + off).tolist())
        kept += engine.refined == before
        engine.approximate(level=8)
        engine.check()
        before = engine.refined
    assert kept >= 18  # of 21: now and then one is a new extreme


def test_after_a_change_the_rest_of_the_tree_stays():
    xy = np.random.default_rng(3).permutation(coast(5000))
    engine = built(xy[:-1])
    engine.approximate(level=10**9)
    before = engine.refined
    engine.insert(*xy[-1].tolist())
    assert engine.refined > 0.9 * before


@pytest.mark.parametrize("cut", [{"level": 10**9}, {"tolerance": 0.0}])
def test_after_a_batch_what_it_did_not_touch_stays(cut):
    """A batch makes the constriction from scratch; the sequence before and after is compared."""
    xy = np.random.default_rng(3).permutation(coast(20_000))
    engine = built(xy[:-300])
    engine.approximate(**cut)
    before = engine.refined
    ids = engine.insert(xy[-300:])
    assert engine.refined > before / 5
    engine.check()
    engine.approximate(**cut)
    engine.remove(ids)
    assert engine.refined > before / 5
    engine.check()
    fresh = built(xy[:-300])
    for each in (cut, {"level": 9}, {"tolerance": 0.01}):
        ours, theirs = engine.approximate(**each), fresh.approximate(**each)
        assert ours.xy.tolist() == theirs.xy.tolist()
        assert ours.error.tolist() == theirs.error.tolist()
    engine.insert(np.random.default_rng(4).random((20_000, 2)))
    assert engine.refined == 0  # nearly nothing is as it was
    engine.check()


@relentless
@given(changes(60))
def test_batches_are_followed_as_single_changes_are(history):
    xy, start, steps, rng = history
    engine, waiting = built(xy[:start]), xy[start:]
    for coming, leaving, questions in steps:
        for level, tolerance in [(10**9, None), (None, 0.0), *questions]:
            engine.approximate(level=level, tolerance=tolerance)
        engine.insert(waiting[: 4 * coming])
        waiting = waiting[4 * coming :]
        engine.remove(rng.permutation(engine.ids())[: 2 * leaving])
        engine.check()
        for level, tolerance in questions:
            judge(engine, level=level, tolerance=tolerance)


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


def test_a_deep_tree_needs_no_deep_stack():
    t = np.linspace(0.1, 3.0, 4000)
    spiral = np.concatenate([np.column_stack([t, np.exp(t)]), [[0.1, -1.0]]])
    engine = built(spiral)
    assert len(engine.approximate(level=10**9)) == len(engine.boundary())
    assert engine.levels > 100
    engine.check()
    engine.insert(1.0, -5.0)
    engine.check()


def test_a_long_refinement_can_be_interrupted():
    engine = built(wavy(60_000))
    engine.side(0.0, 0.0)
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.03)
        with pytest.raises(KeyboardInterrupt):
            engine.approximate(level=10**9)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert 1 < engine.refined < len(engine) - 1
    fresh = built(wavy(60_000))
    assert engine.approximate(level=9).ids.tolist() == fresh.approximate(level=9).ids.tolist()
    assert engine.localize(level=9).offset.tolist() == fresh.localize(level=9).offset.tolist()


def test_snapshots_leave_the_tree_behind(tmp_path):
    engine = built(coast(300))
    found = engine.approximate(level=5)
    engine.save(tmp_path / "it")
    loaded = fk.load(tmp_path / "it")
    assert loaded.refined == 0
    assert loaded.approximate(level=5).ids.tolist() == found.ids.tolist()
    loaded.clear()
    assert (len(loaded.approximate(level=5)), loaded.refined) == (0, 0)


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
