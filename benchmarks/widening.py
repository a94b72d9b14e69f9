"""Points left inside: share on the polygon, how far the graph is widened, and what that costs.

"Locked" is the number of points that constriction of the Delaunay triangulation leaves inside,
"inside" what is left of them after widening to `d`, "longer" what that adds to the length of the
polygon. The costs are those of engines with d_min = -1 over engines with d_min = 0: from points to
ring, median over the rounds, and one more point with a `side`, each the median over some laps with
the same points, mean over the inserts; the last cell is the most that one of these cost more. The
two kinds of engine take turns.
"""

from __future__ import annotations

from time import process_time
from typing import TYPE_CHECKING

import numpy as np

import flintknap as fk
from benchmarks import sets, tables

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from benchmarks.sets import Points

ALL_ON = tables.at_least(100, "100 %")
SCRATCH = tables.at_most(1.15)
INSERT = tables.at_most(1.30)
DEAREST = tables.at_most(1)
TARGETED = ("uniform", "curve, noise of one")
ROUNDS, INSERTS, LAPS = 15, 400, 7


def noisy(spacings: float) -> Callable[[int], Points]:
    """Return a maker of curves with so much noise."""

    def make(n: int) -> Points:
        return sets.curve(n) + spacings * (sets.noisy_curve(n, 3) - sets.curve(n, 3))

    return make


def spiral(n: int) -> Points:
    """Return n points along a spiral of about ten turns."""
    t = np.sqrt(np.linspace(1, 60, n))
    return np.column_stack((t * np.cos(8 * t), t * np.sin(8 * t)))


def combs(n: int) -> Points:
    """Return two combs of ten teeth, each between the other's."""
    y = np.linspace(0, 1, n // 20)
    teeth = [np.column_stack((np.full(len(y), x), y)) for x in range(10)]
    return np.concatenate([*teeth, *(tooth + np.array([0.5, 0.3]) for tooth in teeth)])


SETS: dict[str, Callable[[int], Points]] = {
    "uniform": sets.uniform,
    "curve, noise of half a spacing": noisy(0.5),
    "curve, noise of one": noisy(1),
    "curve, noise of three": noisy(3),
    "coast": sets.coast,
    "maze": sets.maze,
    "grid": sets.grid,
    "spiral": spiral,
    "combs": combs,
}


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield a table of shares and one of costs."""
    columns = ["set", "N", "locked", "inside", "d", "longer, %", "on polygon, %", "target"]
    share = tables.Table("Share of points on the polygon", [*columns, "concave_hull misses"])
    columns = ["set", "N", "from scratch", "target", "insert and side", "target"]
    columns += ["dearest, ms", "target"]
    cost = tables.Table("Cost with widening, over cost without", columns)
    for name, make in SETS.items():
        for n in (500, 10**4) if quick else (500, 10**3, 10**4, 10**5):
            points = make(n + INSERTS)
            kept = sets.shuffled(points)[: len(points) - INSERTS]
            locked, widened = built(kept, 0.0).boundary(), built(kept, -1.0).boundary()
            longer = 100 * (widened.length / locked.length - 1)
            on = 100 * len(widened) / len(kept)
            cells = [len(locked.inside), len(widened.inside), widened.d, longer, on]
            missed = missed_by_shapely(kept) if n <= 10**4 else ""
            share.rows.append([name, n, *cells, ALL_ON.judge(on), missed])
            found = ratios(sets.shuffled(points))
            row: list[object] = [name, n]
            for target, figure in zip((SCRATCH, INSERT, DEAREST), found, strict=True):
                has_target = n == 10**5 and name in TARGETED
                row += [figure, target.judge(figure) if has_target else ""]
            cost.rows.append(row)
    yield share
    yield cost


def built(points: Points, d_min: float) -> fk.Engine:
    """Return an engine that has the points."""
    engine = fk.Engine(d_min=d_min)
    engine.insert(points)
    return engine


def ratios(points: Points) -> tuple[float, float, float]:
    """Return cost with over cost without: from scratch (median), of inserts (mean); dearest, ms."""
    first, more = points[:-INSERTS], points[-INSERTS:].tolist()
    scratch, turns = [], [0.0, -1.0]
    for _ in range(ROUNDS):
        took = {}
        for d_min in turns:
            began = process_time()
            engine = built(first, d_min)
            engine.boundary()
            took[d_min] = process_time() - began
        scratch.append(took[-1.0] / took[0.0])
        turns.reverse()
    spent = np.zeros((LAPS, 2, len(more)))
    for lap in spent:
        engines = [built(first, d_min) for d_min in (0.0, -1.0)]
        for engine in engines:
            engine.side(0.0, 0.0)
        for which, (x, y) in enumerate(more):
            for row, engine in zip(lap, engines, strict=True):
                began = process_time()
                engine.insert(x, y)
                engine.side(x, y)
                row[which] = process_time() - began
    without, with_it = np.median(spent, axis=0)
    dearest = 1000 * float((with_it - without).max())
    return float(np.median(scratch)), float(with_it.sum() / without.sum()), dearest


def missed_by_shapely(points: Points) -> int | str:
    """Return how many points are not on shapely's concave hull."""
    try:
        import shapely
    except ModuleNotFoundError:
        return "shapely is not installed"
    hull = shapely.concave_hull(shapely.multipoints(points), ratio=0)
    corners = set(map(tuple, shapely.get_coordinates(hull).tolist()))
    return len(set(map(tuple, points.tolist())) - corners)
