"""Widening: the engine is the reference, whatever came and went; its ring leaves nothing out."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flintknap as fk
import oracles
import strategies
from flintknap import reference, widening

relentless = settings(deadline=None, max_examples=300)

depths = st.sampled_from([-1.0, -1.0, -0.5, -0.2, -0.05, -1e-9, 0.0])

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


@relentless
@given(strategies.point_sets(60), depths)
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
def test_captures_meet_the_definition(xy, d_min):
    """Every capture is a candidate; widening is monotone, and as little as will do."""
    xy = strategies.distinct(xy)
    found, less = reference.widen(xy, d_min), reference.widen(xy, d_min / 2)
    assert d_min <= found.d <= 0
    n = len(less.captures)
    if found.d >= d_min / 2:
        assert found.captures == less.captures
    assert d_min == 0 or found.captures[:n] == less.captures
    assert reference.widen(xy, 0).captures == []
    assert reference.widen(xy, 0).ring.tolist() == reference.constrict(xy).ring.tolist()
