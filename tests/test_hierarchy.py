"""The tree of Flintstones as it is kept: after every history that of the set, lazy, unhurt.

Whatever was asked before and whatever has changed since, each level and each tolerance is what the
reference makes of the ring from scratch; and what a change did not reach has not been made again.
"""

from __future__ import annotations

import signal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flintknap as fk
import strategies
from trees import built, coast, judge, judge_everywhere, levels, tolerances, wavy

relentless = settings(deadline=None, max_examples=120)


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
