"""Trees of Flintstones under test: objects that make large ones, and the judge of what they say."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import strategies as st

import flintknap as fk
from flintknap import reference

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
