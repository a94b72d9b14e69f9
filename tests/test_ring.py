"""The ring as a sequence: followed through changes by splices, and asked where places lie.

The splices against a plain list are a program of its own (ring.cpp), and so are traces of
edges in cells (traces.cpp); here whole engines run.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

import flintknap as fk
import programs
import strategies
from flintknap import reference
from strategies import Points


@programs.needs_a_compiler
def test_splices_agree_with_a_plain_list(tmp_path: Path) -> None:
    programs.passes("ring.cpp", tmp_path, "0", "150")


@programs.needs_a_compiler
def test_traces_tell_sides_and_contacts(tmp_path: Path) -> None:
    programs.passes("traces.cpp", tmp_path)


def wavy(n: int, noise: float, seed: int) -> Points:
    """Along a closed curve, shuffled, so that all or nearly all are on the ring."""
    rng = np.random.default_rng(seed)
    t = 2 * np.pi * (np.arange(n) + rng.random(n)) / n
    radius = 1 + 0.3 * np.sin(5 * t) + rng.normal(0, noise, n)
    return rng.permutation(np.column_stack([radius * np.cos(t), radius * np.sin(t)]))


def same_sides(engine: fk.Engine, places: Points) -> list[int]:
    """As told of all together and of each alone."""
    sides = engine.side(places).tolist()
    assert [engine.side(x, y) for x, y in places.tolist()] == sides
    return sides


@pytest.mark.parametrize("noise", [0.0, 0.001, 0.3])
@pytest.mark.parametrize("together", [1, 7])
def test_the_ring_follows_points_that_come_leave_and_move(noise: float, together: int) -> None:
    n, changes = 6000, 210  # repairs follow up to n / 1024 changes at once
    points, rng = wavy(n + changes, noise, 3), np.random.default_rng(together)
    engine = fk.Engine()
    engine.insert(points[:n])
    engine.side(0.0, 0.0)
    engine.check()
    for step in range(n, n + changes):
        if step % 3 == 0:
            engine.insert(*points[step].tolist())
        elif step % 3 == 1:
            engine.remove(int(rng.choice(engine.ids())))
        else:
            engine.move(int(rng.choice(engine.ids())), *points[step].tolist())
        if step % together == 0:
            engine.side(0.0, 0.0)
        if step % 15 == 0:
            engine.check()
    ring = engine.boundary().xy
    places = np.concatenate([rng.uniform(-1.6, 1.6, (300, 2)), ring[:50], engine.points()[:50]])
    polygon = shapely.Polygon(ring)
    expected = np.where(shapely.contains_xy(polygon, places), 1, -1)
    expected[(places[:, np.newaxis] == ring).all(axis=2).any(axis=1)] = 0
    assert same_sides(engine, places) == expected.tolist()


@settings(deadline=None)
@given(strategies.histories(), st.randoms(use_true_random=False))
def test_the_ring_is_right_after_every_history(
    history: list[strategies.Operation], random: object
) -> None:
    engine = fk.Engine()
    ids: list[int] = []
    for kind, xy in history:
        if kind in ("one", "batch"):
            ids += np.atleast_1d(engine.insert(xy)).tolist()
        if ids and random.random() < 0.3:  # type: ignore[attr-defined]
            engine.remove(ids.pop(random.randrange(len(ids))))  # type: ignore[attr-defined]
        if kind == "ask":
            engine.side(0.0, 0.0)
            engine.check()
    points = engine.points()
    ring = engine.boundary().ids
    rows = np.searchsorted(engine.ids(), ring)
    places = np.concatenate([points, midpoints(engine.boundary().xy), [[0.5, 0.5]]])
    places = places[strategies.admissible(places).all(axis=1)]
    expected = [reference.side(points, rows, x, y) for x, y in places.tolist()]
    assert same_sides(engine, places) == expected


def midpoints(ring: Points) -> Points:
    return ring / 2 + np.roll(ring, -1, axis=0) / 2


@pytest.mark.parametrize("count", [1, 2047, 2048, 2049, 5000])
def test_any_number_of_places_at_once(count: int) -> None:
    engine = fk.Engine()
    engine.insert(wavy(500, 0.01, 1))
    places = np.random.default_rng(2).uniform(-1.5, 1.5, (count, 2))
    inside = shapely.contains_xy(shapely.Polygon(engine.boundary().xy), places)
    assert ((engine.side(places) > 0) == inside).all()
    assert ((engine.side(places[::-2]) > 0) == inside[::-2]).all()


def test_a_ring_that_goes_and_comes_back() -> None:
    engine = fk.Engine()
    corners = engine.insert([0, 4, 4, 0], [0, 0, 4, 4])
    assert engine.side(2.0, 2.0) == 1
    engine.remove(corners[2:])
    assert engine.side(2.0, 0.0) == -1
    assert engine.side(2.0, 2.0) == -1
    engine.insert([4, 0], [4, 4])
    assert engine.side(2.0, 2.0) == 1
    assert engine.side(2.0, 0.0) == 0
    engine.clear()
    assert engine.side(2.0, 2.0) == -1
    engine.check()


def test_memory_only_for_those_who_ask() -> None:
    engine = fk.Engine()
    engine.insert(wavy(20_000, 0.0, 5))
    engine.boundary()
    before = engine._kernel.bytes()
    engine.side(0.0, 0.0)
    ring = engine._kernel.bytes() - before
    assert 0 < ring <= 44 * 20_000
