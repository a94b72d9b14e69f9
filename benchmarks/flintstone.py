"""Flintstones: the complete tree, approximations of a built one, and one more point at a time.

"Complete" asks a fresh engine, whose boundary is known, for the deepest level, or for a tolerance
of 0, which makes the other tree. "Approximate" asks a complete tree for tolerances it has not been
asked for; the peer simplifies the whole ring for each (`shapely.simplify`, Douglas and Peucker's
method without regard to topology). "Live" inserts points one by one on top of N, each followed by
a `side`, which brings the boundary up to date, and an approximation of level 8. "Vertices kept"
compares how many vertices either method needs. "Told at a level" asks for bounds from
approximations that are known already, and the exact question beside them.
"""

from __future__ import annotations

import statistics
from functools import partial
from time import process_time
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

import flintknap as fk
from benchmarks import sets, tables
from benchmarks.ours import bounded
from benchmarks.timing import compare, ratio

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from benchmarks.sets import Points
    from benchmarks.timing import Clock

SETS: dict[str, Callable[[int], Points]] = {
    "maze": sets.maze,
    "coast": sets.coast,
    "curve": sets.curve,
}
MOST = {"maze": 2.0, "coast": 2.0, "curve": 10.0}  # microseconds a vertex of the complete tree
SHARES = (0.01, 0.05)  # of the vertices, that approximations are to keep
CLOSE = 12  # tolerances around the one that keeps such a share
KEPT = 1.35  # times the vertices of the other method
TOLERANCES = (0.02, 0.01, 0.005, 0.002, 0.001, 0.0005)  # of the extent
CHANGES, QUICK_CHANGES = 500, 50
PLACES = 2000
DEEPEST = 10**9


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield a table for each of the five."""
    n = 10**4 if quick else 10**5
    yield complete(n, quick=quick)
    yield approximate(n, quick=quick)
    yield live(n, QUICK_CHANGES if quick else CHANGES, quick=quick)
    yield kept(n, quick=quick)
    yield told(n, quick=quick)


def complete(n: int, *, quick: bool) -> tables.Table:
    """Return what the whole tree costs a vertex."""
    table = tables.contest("Complete tree", "set", "N", unit="a vertex")
    for name, make in SETS.items():
        points = sets.shuffled(make(n))
        makers = {
            "flintknap": partial(grow, points, {"level": DEEPEST}),
            "for tolerances": partial(grow, points, {"tolerance": 0.0}),
        }
        found = compare(makers, n, quick=quick)
        judged = {} if quick else dict.fromkeys(makers, tables.at_most(MOST[name]))
        tables.enter(table, [name, n], found, judged)
    return table


def grow(points: Points, cut: dict[str, Any], clock: Clock) -> str:
    """Make all nodes of a tree."""
    engine = fk.Engine()
    engine.insert(points)
    bounded(engine)
    with clock.lap(len(points)):
        found = engine.approximate(**cut)
    return f"depth {found.level:,}"


def approximate(n: int, *, quick: bool) -> tables.Table:
    """Return what an approximation costs, for each vertex it keeps, and beside shapely's."""
    columns = ["set", "N", "kept", "%", "µs a vertex kept", "target", "times faster than shapely"]
    table = tables.Table("Approximate a built tree", [*columns, "target"])
    for name, make in SETS.items():
        engine, line = built(make(n))
        for share in SHARES:
            tolerances = around(engine, share)
            vertices = sum(len(engine.approximate(tolerance=t)) for t in tolerances)
            found = compare(
                {
                    "ours": partial(ask_tree, engine, tolerances, vertices),
                    "theirs": partial(ask_shapely, line, tolerances, vertices),
                },
                n,
                quick=quick,
            )
            ours, faster = found["ours"].median, ratio(found["theirs"], found["ours"])
            judged = ["", ""]
            if not quick:
                judged = [tables.at_most(0.15).judge(ours), tables.at_least(10).judge(faster)]
            each = vertices / len(tolerances)
            percent = 100 * each / len(engine.boundary())
            row = [name, n, round(each), percent, ours, judged[0], faster, judged[1]]
            table.rows.append(row)
    return table


def built(points: Points) -> tuple[fk.Engine, shapely.LineString]:
    """Return an engine with its complete tree for tolerances, and its ring as a closed line."""
    engine = fk.Engine()
    engine.insert(sets.shuffled(points))
    engine.approximate(tolerance=0.0)
    ring = engine.boundary().xy
    return engine, shapely.LineString(np.concatenate([ring, ring[:1]]))


def around(engine: fk.Engine, share: float) -> list[float]:
    """Return tolerances that keep about that share of the vertices."""
    low, high = 0.0, float(np.ptp(engine.points(), axis=0).max())
    for _ in range(40):
        middle = (low + high) / 2
        keeps = len(engine.approximate(tolerance=middle)) / len(engine.boundary())
        low, high = (middle, high) if keeps > share else (low, middle)
    return (high * np.linspace(1.0, 1.1, CLOSE)).tolist()


def ask_tree(engine: fk.Engine, tolerances: list[float], vertices: int, clock: Clock) -> None:
    """Approximate within each."""
    with clock.lap(vertices):
        for tolerance in tolerances:
            engine.approximate(tolerance=tolerance)


def ask_shapely(
    line: shapely.LineString, tolerances: list[float], vertices: int, clock: Clock
) -> None:
    """Simplify within each."""
    with clock.lap(vertices):
        for tolerance in tolerances:
            shapely.simplify(line, tolerance, preserve_topology=False)


def live(n: int, changes: int, *, quick: bool) -> tables.Table:
    """Return the median of an insertion and an approximation after it."""
    columns = ["set", "N", "tree before", "µs, both", "of it the approximation", "target"]
    table = tables.Table("Live: insert, then approximate level 8", columns, "Medians.")
    for name, make in {**SETS, "curve, noise of one spacing": sets.noisy_curve}.items():
        points = sets.shuffled(make(n + changes))
        for level, tree in ((8, "8 levels"), (DEEPEST, "complete")):
            engine = fk.Engine()
            engine.insert(points[:-changes])
            engine.approximate(level=level)
            whole, last = [], []
            for x, y in points[-changes:].tolist():
                began = process_time()
                engine.insert(x, y)
                engine.side(0.0, 0.0)
                between = process_time()
                engine.approximate(level=8)
                ended = process_time()
                whole.append((ended - began) * 1e6)
                last.append((ended - between) * 1e6)
            both = statistics.median(whole)
            target = "" if quick else tables.at_most(150).judge(both)
            table.rows.append([name, n, tree, both, statistics.median(last), target])
    return table


def kept(n: int, *, quick: bool) -> tables.Table:
    """Return how many vertices an error bound takes."""
    columns = ["set", "N", "tolerance / extent", "kept", "%", "Douglas-Peucker", "times", "target"]
    table = tables.Table("Vertices kept for an error bound", columns)
    for name, make in SETS.items():
        engine, line = built(make(n))
        extent = float(np.ptp(engine.points(), axis=0).max())
        for tolerance in TOLERANCES:
            ours = len(engine.approximate(tolerance=tolerance * extent))
            simple = shapely.simplify(line, tolerance * extent, preserve_topology=False)
            theirs = len(simple.coords) - 1
            times = ours / theirs
            judged = "" if quick or name != "coast" else tables.at_most(KEPT).judge(times)
            percent = 100 * ours / len(engine.boundary())
            table.rows.append([name, n, tolerance, ours, percent, theirs, times, judged])
    return table


def told(n: int, *, quick: bool) -> tables.Table:
    """Return what collision queries cost, exact and from approximations."""
    columns = ["set", "N", "µs each", "exact", "level 4", "level 8", "within 1 % of the extent"]
    table = tables.Table("Told at a level", columns)
    for name, make in SETS.items():
        engine, _ = built(make(n))
        xy = engine.points()
        extent = float(np.ptp(xy, axis=0).max())
        rng = np.random.default_rng(7)
        start = rng.uniform(xy.min(axis=0), xy.max(axis=0), (PLACES, 2))
        stop = start + rng.normal(0, extent / 20, (PLACES, 2))
        cuts: list[dict[str, Any]] = [{}, {"level": 4}, {"level": 8}, {"tolerance": extent / 100}]
        for question, ends in (("distance", start.T), ("intersects", np.hstack([start, stop]).T)):
            asks = {str(cut): partial(ask_places, engine, question, ends, cut) for cut in cuts}
            found = compare(asks, n, quick=quick)
            table.rows.append([name, n, question, *(each.median for each in found.values())])
    return table


def ask_places(
    engine: fk.Engine, question: str, ends: Points, cut: dict[str, Any], clock: Clock
) -> None:
    """Ask about all places, or segments, at once."""
    getattr(engine, question)(*ends, **cut)  # now the tree is refined as far as this takes
    with clock.lap(len(ends[0])):
        getattr(engine, question)(*ends, **cut)
