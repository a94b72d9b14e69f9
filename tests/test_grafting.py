"""Repairs that keep what a change leaves as it was: equal to a run from scratch, for less."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

import flintknap as fk

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Points = NDArray[np.float64]


def curve(n: int) -> Points:
    """Return points of a smooth curve with five deep bays."""
    t = 2 * np.pi * np.random.default_rng(1).random(n)
    r = 1 + 0.6 * np.cos(5 * t)
    return np.column_stack((r * np.cos(t), r * np.sin(t)))


def two_pockets(n: int) -> Points:
    """Return two deep pockets side by side that share a thin wall, and race for its points."""
    y = np.linspace(0, 1, n)
    walls = [np.column_stack((np.full(n, x), y)) for x in (0.0, 0.1, 0.11, 0.21)]
    floor = np.column_stack((np.linspace(0, 0.21, n), np.full(n, -0.01)))
    return np.concatenate([*walls, floor])


def spiral(n: int) -> Points:
    """Return a band that winds three times around itself: one pocket, as long as the band."""
    t = np.linspace(2, 20, n)
    return np.concatenate([np.column_stack((r * np.cos(t), r * np.sin(t))) for r in (t, t + 2.5)])


def combs(n: int) -> Points:
    """Return two combs whose teeth reach between each other: pockets beside pockets."""
    y = np.linspace(0, 1, n)
    teeth = [np.column_stack((np.full(n, x / 10), y + 0.3 * (x // 2 % 2))) for x in range(12)]
    return np.concatenate(teeth)


def ties(n: int) -> Points:
    """Return a grid with a channel cut into it: all keys are a few values, over and over."""
    side = int(np.sqrt(4 * n))
    grid = np.stack(np.meshgrid(np.arange(side), np.arange(side)), axis=-1).reshape(-1, 2)
    channel = (abs(grid[:, 0] - side // 2) < 3) & (grid[:, 1] > side // 5)
    return grid[~channel].astype(np.float64)


SETS: dict[str, Callable[[int], Points]] = {
    "curve": curve,
    "two pockets": two_pockets,
    "spiral": spiral,
    "combs": combs,
    "ties": ties,
}


@pytest.mark.parametrize("name", SETS)
@pytest.mark.parametrize("d_min", [0.0, -1.0])
def test_changes_one_by_one_equal_a_run_from_scratch(name: str, d_min: float) -> None:
    points = SETS[name](150)
    rng = np.random.default_rng(2)
    engine = fk.Engine(d_min=d_min)
    ids = np.unique(engine.insert(points)).tolist()
    engine.side(0.0, 0.0)
    step = np.ptp(points, axis=0).max() / 100
    for k in range(120):
        if k % 3 == 0:
            engine.remove(ids.pop(int(rng.integers(len(ids)))))
        else:
            near = points[rng.integers(len(points))] + step * rng.integers(-2, 3, 2)
            if engine.find(*near) is None:
                ids.append(engine.insert(*near.tolist()))
        engine.side(0.0, 0.0)
        engine.check()
    fresh = fk.Engine(d_min=d_min)
    fresh.insert(rng.permutation(engine.points()))
    assert engine.digest() == fresh.digest()


def channel(rng: np.random.Generator, n: int) -> Points:
    """Return points of two banks that wind twice around each other, drawn anew each time."""
    along, across = rng.random(n), np.where(rng.random(n) < 0.5, 0.0, 0.05)
    radius, angle = 0.1 + along + 0.9 * across, 12 * along
    return np.column_stack((radius * np.cos(angle), radius * np.sin(angle)))


@pytest.mark.parametrize("seed", [69, 464, 1567, 2634, 2679, 2883, 5185, 5402])
def test_gates_into_a_run_that_is_adrift_come_in_time(seed: int) -> None:
    """In each of these, one that is kept with a raft captures a site before it is back."""
    rng = np.random.default_rng(seed)
    n = int(rng.choice([150, 300, 600]))
    engine = fk.Engine(d_min=0.0)
    ids = engine.insert(channel(rng, n)).tolist()
    engine.side(0.0, 0.0)
    for _ in range(60):
        if rng.random() < 0.5:
            engine.remove(ids.pop(int(rng.integers(len(ids)))))
        else:
            ids.append(engine.insert(*channel(rng, 1)[0].tolist()))
        engine.side(0.0, 0.0)
    engine.check()


@pytest.mark.parametrize("name", SETS)
def test_long_pockets_that_go_adrift_come_back(name: str) -> None:
    points = np.random.default_rng(6).permutation(SETS[name](1200))
    rng = np.random.default_rng(7)
    engine = fk.Engine(d_min=0.0)
    ids = np.unique(engine.insert(points[60:])).tolist()
    engine.side(0.0, 0.0)
    for x, y in points[:60].tolist():
        ids.append(engine.insert(x, y))
        engine.side(0.0, 0.0)
        engine.check()
        engine.remove(ids.pop(int(rng.integers(len(ids)))))
        engine.side(0.0, 0.0)
        engine.check()


@pytest.mark.parametrize("n", [2000, 32000])
def test_a_change_of_a_clean_curve_touches_few_events(n: int) -> None:
    """Without grafting, these derive a bay anew: a hundred events, and sixteen hundred."""
    points = np.random.default_rng(3).permutation(curve(n + 200))
    engine = fk.Engine()
    engine.insert(points[200:])
    engine.side(0.0, 0.0)
    before = engine._kernel.touched()
    for x, y in points[:200].tolist():
        engine.insert(x, y)
        engine.side(x, y)
    assert engine._kernel.touched() - before < 200 * 20


@pytest.mark.parametrize("name", SETS)
def test_a_repair_touches_what_changes_and_hardly_more(name: str) -> None:
    points = np.random.default_rng(4).permutation(SETS[name](150))
    engine = fk.Engine(d_min=0.0)
    engine.insert(points[60:])
    engine.side(0.0, 0.0)
    before, gates = engine._kernel.touched(), captures(engine)
    changed = 0
    for x, y in points[:60].tolist():
        engine.insert(x, y)
        engine.side(x, y)
        gates, gates_before = captures(engine), gates
        changed += len(gates ^ gates_before)
    assert changed <= engine._kernel.touched() - before <= 1.1 * changed


def captures(engine: fk.Engine) -> set[tuple[int, ...]]:
    return {tuple(gate) for gate in engine._kernel.captures().tolist()}


def test_a_repair_may_touch_more_events_than_there_are_sites() -> None:
    """Then it is given up for a run from scratch, on small sets often enough to be seen."""
    for seed in range(200):
        rng = np.random.default_rng(seed)
        engine = fk.Engine(d_min=0.0)
        engine.insert(rng.random((7, 2)))
        engine.side(0.0, 0.0)
        for _ in range(10):
            engine.insert(*rng.random(2).tolist())
            engine.remove(int(rng.choice(engine.ids())))
            engine.side(0.0, 0.0)
            engine.check()
