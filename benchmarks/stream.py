"""Points one call each: asked once at the end, or after every point.

Points in order along a curve are the hardest stream there is: kept Delaunay after every point,
each costs time in proportion to those before it, and the peers pay that whether anybody asks or
not. Ours wait until somebody asks. "To the ring" includes the boundary: at the end as arrays, after
every point as the answer to a `side`. On top of N points, the first one is off the clock for ours
and for scipy: it makes room for many.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import flintknap as fk
from benchmarks import peers, sets, tables, timing
from benchmarks.ours import bounded, triangulated

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from benchmarks.sets import Points
    from benchmarks.timing import Clock, Contender

    Ask = Callable[[fk.Engine], object]

RING = "flintknap, to the ring"
TRIANGULATION = "flintknap, to the triangulation"
TARGETS = {("curve", 10**5): {RING: tables.at_most(1.5), TRIANGULATION: tables.at_most(1.5)}}
SCIPY_POINTS = 2000  # in order
ON_TOP = {10**4: 1000, 10**5: 400, 10**6: 100}  # points on top of N
SCIPY_ON_TOP = {10**4: 20, 10**5: 4}  # each costs time in proportion to N


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield a table for streams asked at the end, one for those asked after every point."""
    table = tables.contest("In order, asked once at the end", "set", "N", unit="a point")
    for name, make in {"curve": sets.curve, "maze": sets.maze}.items():
        for n in (10**4, 10**5) if quick else (10**4, 10**5, 10**6):
            found = timing.compare(in_order(make(n)), n, quick=quick)
            tables.enter(table, [name, n], found, TARGETS.get((name, n)))
    yield table

    title = "More points at random on top of N, asked after every one"
    table = tables.contest(title, "set", "N", unit="a point")
    for name, make in {"uniform": sets.uniform, "curve": sets.curve}.items():
        for n in (10**4,) if quick else ON_TOP:
            points = sets.shuffled(make(n + ON_TOP[n]))
            found = timing.compare(on_top(points[:n], points[n:]), n, quick=quick)
            tables.enter(table, [name, n], found)
    yield table


def in_order(points: Points) -> dict[str, Contender[str]]:
    """Return contenders that insert the points as they come."""
    n = len(points)

    def ours(ask: Ask) -> Contender[str]:
        def run(clock: Clock) -> str:
            engine, places = fk.Engine(), points.tolist()
            with clock.lap(n):
                for x, y in places:
                    engine.insert(x, y)
                ask(engine)
            return ""

        return run

    def condeltri(clock: Clock) -> str:
        made = peers.condeltri("AS_PROVIDED")
        with clock.lap(n):
            made.insert_vertices(points)
        return "one call"

    def startinpy(clock: Clock) -> str:
        made, places = peers.startinpy(), peers.with_height(points).tolist()
        with clock.lap(n):
            for place in places:
                made.insert_one_pt(place)
        return ""

    def scipy(clock: Clock) -> str:
        from scipy.spatial import Delaunay

        first = 4
        made = Delaunay(points[:first], incremental=True)
        with clock.lap(SCIPY_POINTS):
            for i in range(first, first + SCIPY_POINTS):
                made.add_points(points[i : i + 1])
        return f"the first {SCIPY_POINTS:,}"

    found: dict[str, Contender[str]] = {
        TRIANGULATION: ours(triangulated),
        RING: ours(fk.Engine.boundary),
    }
    if n <= 10**5:
        found["condeltri"] = condeltri
    if n <= 10**4:
        found |= {"startinpy": startinpy, "scipy add_points": scipy}
    return found


def on_top(base: Points, more: Points) -> dict[str, Contender[str]]:
    """Return contenders that have the base already and insert the others one by one."""
    n = len(base)

    def ours(ask: Ask) -> Contender[str]:
        def run(clock: Clock) -> str:
            engine, (first, *places) = fk.Engine(), more.tolist()
            engine.insert(base)
            ask(engine)
            engine.insert(*first)
            ask(engine)
            with clock.lap(len(places)):
                for x, y in places:
                    engine.insert(x, y)
                    ask(engine)
            return ""

        return run

    def condeltri(clock: Clock) -> str:
        made = peers.condeltri()
        made.insert_vertices(base)
        calls = [more[i : i + 1] for i in range(len(more))]
        with clock.lap(len(calls)):
            for one in calls:
                made.insert_vertices(one)
        return ""

    def startinpy(clock: Clock) -> str:
        made, places = peers.startinpy(), peers.with_height(more).tolist()
        made.insert(peers.with_height(base))
        with clock.lap(len(places)):
            for place in places:
                made.insert_one_pt(place)
        return ""

    def scipy(clock: Clock) -> str:
        from scipy.spatial import Delaunay

        made = Delaunay(base, incremental=True)
        made.add_points(more[:1])
        calls = SCIPY_ON_TOP[n]
        with clock.lap(calls):
            for i in range(1, 1 + calls):
                made.add_points(more[i : i + 1])
        return f"{calls} calls"

    found: dict[str, Contender[str]] = {
        TRIANGULATION: ours(triangulated),
        RING: ours(bounded),
        "condeltri": condeltri,
    }
    if n in SCIPY_ON_TOP:
        found |= {"startinpy": startinpy, "scipy add_points": scipy}
    return found
