"""Is a place in the object? Uniform places over the box of the boundary, the same ring for both.

The ring is the one ours found through the points, shuffled: on the curve that is the curve; on the
others it is as crooked as can be. Shapely's polygon is prepared and warm, and is given the first
20,000 of the million places ours is given at once, which makes no difference to it. The last cell:
how many places are told otherwise than ours, which are exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

import flintknap as fk
from benchmarks import sets, tables, timing

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from benchmarks.sets import Points
    from benchmarks.timing import Clock, Contender

SETS: dict[str, Callable[[int], Points]] = {
    "uniform": sets.uniform,
    "curve": sets.curve,
    "maze": sets.maze,
}
BULK, SHARE, SINGLES = 10**6, 20_000, 2_000
AT_ONCE = {
    ("curve", 10**5): 0.12,
    ("maze", 10**5): 0.25,
    ("curve", 10**6): 0.25,
    ("maze", 10**6): 0.5,
}
EACH = {("curve", 10**5): 0.3, ("maze", 10**5): 0.3}


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield a table for many places a call, one for one place a call."""
    bulk = tables.contest("Many places a call", "set", "M", unit="a place")
    single = tables.contest("One place a call", "set", "M", unit="a place")
    for name, make in SETS.items():
        for m in (10**5,) if quick else (10**5, 10**6):
            case = Case(sets.shuffled(make(m)))
            found = timing.compare(at_once(case), SHARE, quick=quick)
            tables.enter(bulk, [name, m], found, targets(AT_ONCE, name, m))
            found = timing.compare(one_each(case), SHARE, quick=quick)
            tables.enter(single, [name, m], found, targets(EACH, name, m))
    yield bulk
    yield single


def targets(of: dict[tuple[str, int], float], name: str, m: int) -> dict[str, tables.Target]:
    """Return what ours is to keep."""
    ours = "flintknap side" if of is AT_ONCE else "flintknap contains"
    return {ours: tables.at_most(of[name, m])} if (name, m) in of else {}


@dataclass
class Case:
    """An object, and places to ask about."""

    points: Points

    @cached_property
    def engine(self) -> fk.Engine:
        """With the boundary made, and the ring over it."""
        engine = fk.Engine()
        engine.insert(self.points)
        engine.side(*self.points[0].tolist())
        return engine

    @cached_property
    def polygon(self) -> Any:
        """The same object for shapely, prepared and warm."""
        import shapely

        polygon = shapely.Polygon(self.engine.boundary().xy)
        shapely.prepare(polygon)
        shapely.contains_xy(polygon, *self.points[0])
        return polygon

    @cached_property
    def places(self) -> Points:
        """Uniform over the box."""
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        return np.random.default_rng(5).uniform(low, high, (BULK, 2))

    def dissent(self, inside: NDArray[np.bool_]) -> str:
        """Say how many of the first places are told otherwise than by the engine."""
        truth = self.engine.side(self.places[: len(inside)]) > 0
        return f"{np.count_nonzero(inside != truth)} otherwise"


def at_once(case: Case) -> dict[str, Contender[str]]:
    """Return contenders that are given all places in one call."""

    def flintknap(clock: Clock) -> str:
        with clock.lap(BULK):
            case.engine.side(case.places)
        return ""

    def shapely(clock: Clock) -> str:
        import shapely

        polygon = case.polygon
        with clock.lap(SHARE):
            inside = shapely.contains_xy(polygon, case.places[:SHARE])
        return case.dissent(inside)

    return {"flintknap side": flintknap, "shapely.contains_xy": shapely}


def one_each(case: Case) -> dict[str, Contender[str]]:
    """Return contenders that are given one place a call, other places in each round."""
    next_of = {"flintknap": 0, "shapely": 0}

    def some_places(name: str) -> list[list[float]]:
        start = next_of[name]
        next_of[name] = (start + SINGLES) % BULK
        return case.places[start : start + SINGLES].tolist()

    def flintknap(clock: Clock) -> str:
        contains, places = case.engine.contains, some_places("flintknap")
        with clock.lap(SINGLES):
            for x, y in places:
                contains(x, y)
        return ""

    def shapely(clock: Clock) -> str:
        from shapely import contains_xy

        polygon, places = case.polygon, some_places("shapely")
        with clock.lap(SINGLES):
            inside = [contains_xy(polygon, x, y) for x, y in places]
        truth = [case.engine.side(x, y) > 0 for x, y in places]
        return f"{np.count_nonzero(np.array(inside) != np.array(truth))} otherwise"

    return {"flintknap contains": flintknap, "shapely.contains_xy": shapely}
