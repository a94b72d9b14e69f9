"""Points, shuffled, from scratch to a polygon, and how good it is.

The last cells: points of the set that the polygon misses; whether it is simple; and on the curve,
of all pairs of true neighbours, how many it joins.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import flintknap as fk
from benchmarks import sets, tables, timing

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from benchmarks.sets import Points
    from benchmarks.timing import Clock, Contender

SETS: dict[str, Callable[[int], Points]] = {"uniform": sets.uniform, "curve": sets.curve}
SPEED = {
    "flintknap": tables.at_most(1.1),
    "shapely.concave_hull(ratio=0)": tables.at_most(1 / 20, "1/20"),
}
ALL_JOINED = tables.at_least(100, "100 %")


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield a table of speed and one of quality."""
    speed = tables.contest("Speed", "set", "N", unit="a point")
    columns = ["set", "N", "", "missed", "simple", "true neighbours joined, %", "target"]
    quality = tables.Table("Quality", columns)
    for name, make in SETS.items():
        for n in (10**3, 10**4) if quick else (10**3, 10**4, 10**5):
            points = make(n)
            found = timing.compare(contenders(sets.shuffled(points)), n, quick=quick)
            for contender, this in found.items():
                if this.result is not None:
                    missed, simple, joined = judge(points, this.result)
                    cells: list[Any] = ["", ""]
                    if name == "curve":
                        has_target = contender == "flintknap" and n <= 10**4
                        cells = [joined, ALL_JOINED.judge(joined) if has_target else ""]
                    quality.rows.append([name, n, contender, missed, simple, *cells])
                this.result = None
            tables.enter(speed, [name, n], found, SPEED if n == 10**5 else {})
    yield speed
    yield quality


def contenders(points: Points) -> dict[str, Contender[Points]]:
    """Return them all; each results in its ring, float64 (m, 2), first vertex not repeated."""
    n = len(points)

    def flintknap(clock: Clock) -> Points:
        engine = fk.Engine()
        with clock.lap(n):
            engine.insert(points)
            boundary = engine.boundary()
        return boundary.xy

    def shapely(clock: Clock) -> Points:
        import shapely

        scattered = shapely.multipoints(points)
        with clock.lap(n):
            hull = shapely.concave_hull(scattered, ratio=0)
        return shapely.get_coordinates(hull)[:-1]

    def concaveman(clock: Clock) -> Points:
        import concave_hull

        with clock.lap(n):
            ids = concave_hull.concave_hull_indexes(points, concavity=1, length_threshold=0)
        return points[ids]

    return {
        "flintknap": flintknap,
        "shapely.concave_hull(ratio=0)": shapely,
        "concave_hull (concaveman)": concaveman,
    }


def judge(points: Points, ring: Points) -> tuple[int, str, float]:
    """Return points missed, "yes" if simple, and the percentage of neighbours in order joined."""
    place = {xy: i for i, xy in enumerate(map(tuple, points.tolist()))}
    on_ring = np.array([place[xy] for xy in map(tuple, ring.tolist())])
    missed = len(points) - len(np.unique(on_ring))
    try:
        import shapely

        simple = "yes" if shapely.is_simple(shapely.LinearRing(ring)) else "NO"
    except ModuleNotFoundError:
        simple = "shapely is not installed"
    pairs = np.sort(np.column_stack((on_ring, np.roll(on_ring, -1))), axis=1)
    step = (pairs[:, 1] - pairs[:, 0])[np.unique(pairs, axis=0, return_index=True)[1]]
    joined = np.count_nonzero((step == 1) | (step == len(points) - 1))
    return missed, simple, 100 * joined / len(points)
