"""Points left inside: share on the polygon, how far the graph is widened, and what that costs.

"Locked" is the number of points that constriction of the Delaunay triangulation leaves inside,
"inside" what is left of them after widening to `d`. The costs are those of engines with d_min = -1
over engines with d_min = 0: from points to ring, and one more point with a `side`, mean over the
inserts. The two kinds of engine take turns.
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
ROUNDS, INSERTS = 5, 400


def wide_curve(n: int) -> Points:
    """Return a curve with noise of three spacings."""
    clean = sets.curve(n)
    return clean + 3 * (sets.noisy_curve(n, 3) - sets.curve(n, 3))


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
    "curve, noise of one spacing": sets.noisy_curve,
    "curve, noise of three": wide_curve,
    "maze": sets.maze,
    "grid": sets.grid,
    "spiral": spiral,
    "combs": combs,
}


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield a table of shares and one of costs."""
    columns = ["set", "N", "locked", "inside", "d", "on polygon, %", "target"]
    share = tables.Table("Share of points on the polygon", [*columns, "concave_hull misses"])
    columns = ["set", "N", "from scratch", "target", "insert and side", "target"]
    cost = tables.Table("Cost with widening, over cost without", columns)
    for name, make in SETS.items():
        for n in (10**3, 10**4) if quick else (10**3, 10**4, 10**5):
            points = make(n + INSERTS)
            kept = sets.shuffled(points)[: len(points) - INSERTS]
            locked, widened = built(kept, 0.0).boundary(), built(kept, -1.0).boundary()
            on = 100 * len(widened) / len(kept)
            cells = [len(locked.inside), len(widened.inside), widened.d, on, ALL_ON.judge(on)]
            share.rows.append([name, n, *cells, missed_by_shapely(kept) if n <= 10**4 else ""])
            scratch, insert = ratios(sets.shuffled(points))
            is_target = name == "uniform" and n == 10**5
            judged = [
                t.judge(r) if is_target else "" for t, r in ((SCRATCH, scratch), (INSERT, insert))
            ]
            cost.rows.append([name, n, scratch, judged[0], insert, judged[1]])
    yield share
    yield cost


def built(points: Points, d_min: float) -> fk.Engine:
    """Return an engine that has the points."""
    engine = fk.Engine(d_min=d_min)
    engine.insert(points)
    return engine


def ratios(points: Points) -> tuple[float, float]:
    """Return cost with over cost without widening: from scratch (median), and of inserts (mean)."""
    first, more = points[:-INSERTS], points[-INSERTS:].tolist()
    scratch = []
    for _ in range(ROUNDS):
        took = []
        for d_min in (0.0, -1.0):
            began = process_time()
            engine = built(first, d_min)
            engine.boundary()
            took.append(process_time() - began)
        scratch.append(took[1] / took[0])
    engines, spent = [built(first, d_min) for d_min in (0.0, -1.0)], [0.0, 0.0]
    for engine in engines:
        engine.side(0.0, 0.0)
    for x, y in more:
        for which, engine in enumerate(engines):
            began = process_time()
            engine.insert(x, y)
            engine.side(x, y)
            spent[which] += process_time() - began
    return float(np.median(scratch)), spent[1] / spent[0]


def missed_by_shapely(points: Points) -> int | str:
    """Return how many points are not on shapely's concave hull."""
    try:
        import shapely
    except ModuleNotFoundError:
        return "shapely is not installed"
    hull = shapely.concave_hull(shapely.multipoints(points), ratio=0)
    corners = set(map(tuple, shapely.get_coordinates(hull).tolist()))
    return len(set(map(tuple, points.tolist())) - corners)
