"""How far, does this path hit it, do these two touch? The same rings for both, found by ours.

Two objects that just miss each other are the set, turned by half a radian, and its mirror image,
moved to where GEOS finds 1e-4 of its size between them, their boxes overlapping. Shapely's
geometries are prepared, its tree of edges built, and all is warm, but where a change rebuilds it.
The last cell: how many answers differ from ours (of distances: by more than 1e-12 of them).
"""

from __future__ import annotations

import statistics
from dataclasses import dataclass
from functools import cached_property
from time import process_time
from typing import TYPE_CHECKING, Any

import numpy as np

import flintknap as fk
from benchmarks import sets, tables, timing

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from benchmarks.sets import Points
    from benchmarks.timing import Clock, Contender

SETS: dict[str, Callable[[int], Points]] = {"curve": sets.curve, "maze": sets.maze}
M = 10**5
BULK, SLOW, CHANGES = 20_000, 500, 100
MEMBERS, MEMBER = 1000, 100  # objects in a scene, and their points


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield tables for places, for segments, for two objects and for scenes."""
    cases = {name: Case(make(M)) for name, make in SETS.items()}
    far = tables.contest("Distance of many places", "set", "M", unit="a place")
    for name, case in cases.items():
        bound = tables.at_most({"curve": 2.0, "maze": 1.0}[name])
        targets = {"flintknap distance": bound, "shapely STRtree": tables.at_most(0.1)}
        found = timing.compare(distances(case), BULK, quick=quick)
        tables.enter(far, [name, M], found, targets)
    yield far
    paths = tables.contest("Does a segment meet the boundary", "set", "length", unit="a segment")
    for name, case in cases.items():
        for length, bound in ((0.01, 0.1), (1.0, 0.5)):
            found = timing.compare(segments(case, length), BULK, quick=quick)
            targets = {"flintknap intersects": tables.at_most(bound)}
            tables.enter(paths, [name, length], found, targets)
    yield paths
    touch = tables.contest("Two objects that just miss each other", "set", "M", unit="a question")
    for name, case in cases.items():
        found = timing.compare(two_objects(case), BULK, quick=quick)
        tables.enter(touch, [name, M], found, {"flintknap collides": tables.at_most(20)})
    yield touch
    yield changing(cases)
    yield scenes()


@dataclass
class Case:
    """An object of about unit size, and questions about it."""

    raw: Points

    @cached_property
    def points(self) -> Points:
        """Turned, and shuffled."""
        low, high = self.raw.min(axis=0), self.raw.max(axis=0)
        c, s = np.cos(0.5), np.sin(0.5)
        return sets.shuffled((self.raw - low) / (high - low).max() @ np.array([[c, s], [-s, c]]))

    @cached_property
    def engine(self) -> fk.Engine:
        """Up to date."""
        return made(self.points)

    @cached_property
    def other(self) -> fk.Engine:
        """The mirror image, just beside."""
        import shapely

        ring = self.engine.boundary().xy
        polygon, mirrored = shapely.Polygon(ring), ring * [-1, 1]
        shapely.prepare(polygon)
        near, far = 0.0, 3.0
        while far - near > 1e-4:
            middle = (near + far) / 2
            moved = shapely.Polygon(mirrored + np.array([middle, 0.0]))
            near, far = (middle, far) if polygon.intersects(moved) else (near, middle)
        return made(self.points * [-1, 1] + np.array([far + 1e-4, 0.0]))

    def places(self) -> Points:
        """Uniform over the box."""
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        return np.random.default_rng(5).uniform(low, high, (BULK, 2))


def made(points: Points) -> fk.Engine:
    """Return an engine that is up to date."""
    engine = fk.Engine()
    engine.insert(points)
    engine.distance(0.0, 0.0)
    return engine


def edges(engine: fk.Engine) -> Any:
    """Return the edges of the ring, as lines for shapely."""
    import shapely

    ring = engine.boundary().xy
    return shapely.linestrings(np.stack([ring, np.roll(ring, -1, axis=0)], axis=1))


def dissent(differ: NDArray[np.bool_]) -> str:
    """Say how many differ."""
    return f"{np.count_nonzero(differ)} of {differ.size} otherwise"


def distances(case: Case) -> dict[str, Contender[str]]:
    """Return contenders that tell how far many places are from the boundary."""
    import shapely

    places = case.places()
    tree = shapely.STRtree(edges(case.engine))
    ring = shapely.LinearRing(case.engine.boundary().xy)
    shapely.prepare(ring)

    def flintknap(clock: Clock) -> str:
        with clock.lap(BULK):
            case.engine.distance(places)
        return ""

    def strtree(clock: Clock) -> str:
        points = shapely.points(places)
        with clock.lap(BULK):
            _, far = tree.query_nearest(points, all_matches=False, return_distance=True)
        return dissent(~np.isclose(far, case.engine.distance(places), rtol=1e-12))

    def prepared(clock: Clock) -> str:
        points = shapely.points(places[:SLOW])
        with clock.lap(SLOW):
            far = shapely.distance(ring, points)
        return dissent(~np.isclose(far, case.engine.distance(places[:SLOW]), rtol=1e-12))

    return {
        "flintknap distance": flintknap,
        "shapely STRtree": strtree,
        "shapely.distance": prepared,
    }


def segments(case: Case, length: float) -> dict[str, Contender[str]]:
    """Return contenders that tell which segments meet the boundary."""
    import shapely

    start, rng = case.places(), np.random.default_rng(6)
    turn = rng.uniform(0, 2 * np.pi, BULK)
    stop = start + length * np.column_stack((np.cos(turn), np.sin(turn)))
    ends = (*start.T, *stop.T)
    ring = shapely.LinearRing(case.engine.boundary().xy)
    shapely.prepare(ring)

    def intersects(clock: Clock) -> str:
        with clock.lap(BULK):
            case.engine.intersects(*ends)
        return ""

    def first_hit(clock: Clock) -> str:
        with clock.lap(BULK):
            case.engine.first_hit(*ends)
        return ""

    def peer(clock: Clock) -> str:
        lines = shapely.linestrings(np.stack([start, stop], axis=1)[:SLOW])
        with clock.lap(SLOW):
            meets = shapely.intersects(ring, lines)
        return dissent(meets != case.engine.intersects(*ends)[:SLOW])

    return {
        "flintknap intersects": intersects,
        "flintknap first_hit": first_hit,
        "shapely.intersects": peer,
    }


def two_objects(case: Case) -> dict[str, Contender[str]]:
    """Return contenders that tell whether two objects touch, and how far apart they are."""
    import shapely

    one, other = case.engine, case.other
    first, second = (shapely.Polygon(each.boundary().xy) for each in (one, other))
    shapely.prepare(first)
    gap = one.clearance(other)

    def collides(clock: Clock) -> str:
        with clock.lap(100):
            for _ in range(100):
                one.collides(other)
        return str(one.collides(other))

    def clearance(clock: Clock) -> str:
        with clock.lap(100):
            for _ in range(100):
                one.clearance(other)
        return f"{gap:.3g}"

    def at_least(clock: Clock) -> str:
        with clock.lap(100):
            for _ in range(100):
                one.clearance(other, at_least=gap / 2)
        return str(one.clearance(other, at_least=gap / 2))

    def peer(clock: Clock) -> str:
        with clock.lap():
            met = first.intersects(second)
        return str(met)

    return {
        "flintknap collides": collides,
        "flintknap clearance": clearance,
        "flintknap clearance at_least": at_least,
        "shapely.intersects": peer,
    }


def changing(cases: dict[str, Case]) -> tables.Table:
    """Insert a point on the boundary of one of two objects, and ask whether they collide."""
    import shapely

    table = tables.Table(
        "One point more in one of them, then: do they collide?",
        ("set", "M", "", "µs, median", "µs, mean", "target"),
        "New points lie in the middle of edges, moved off them by a hundredth of their length.",
    )
    for name, case in cases.items():
        engine, other = case.engine, case.other
        start = engine.boundary().xy
        stop = np.roll(start, -1, axis=0)
        side = (stop - start) @ np.array([[0, 1], [-1, 0]]) / 100
        new = np.random.default_rng(7).permutation((start + stop) / 2 + side)[:CHANGES]
        laps = []
        for x, y in new.tolist():
            began = process_time()
            engine.insert(x, y)
            engine.collides(other)
            laps.append((process_time() - began) * 1e6)
        median = statistics.median(laps)
        verdict = tables.at_most(300).judge(median)
        table.rows.append([name, M, "flintknap", median, statistics.mean(laps), verdict])
        engine.remove(engine.find(new))
        ring = engine.boundary().xy
        second, laps = shapely.Polygon(other.boundary().xy), []
        for _ in range(5):
            began = process_time()
            first = shapely.Polygon(ring)
            shapely.prepare(first)
            first.intersects(second)
            laps.append((process_time() - began) * 1e6)
        cells = [statistics.median(laps), statistics.mean(laps), ""]
        table.rows.append([name, M, "shapely, built anew", *cells])
    return table


def scenes() -> tables.Table:
    """Move one of many objects, and ask which collide."""
    table = tables.Table(
        "A scene in which one object moves: collisions()",
        ("objects", "points each", "", "µs, median", "µs, mean", "target"),
        "Beyond the engine's own change: it is asked something first.",
    )
    rng = np.random.default_rng(8)
    shape = sets.curve(MEMBER) * 0.25 / MEMBERS**0.5
    scene = fk.Scene({f"{i}": made(shape + rng.random(2)) for i in range(MEMBERS)})
    scene.collisions()
    idle, moved = [], []
    for _ in range(500):
        engine = scene[f"{rng.integers(MEMBERS)}"]
        engine.clear()
        engine.insert(shape + rng.random(2))
        engine.distance(0.0, 0.0)
        for laps in (moved, idle):
            began = process_time()
            found = scene.collisions()
            laps.append((process_time() - began) * 1e6)
    for name, laps in (("one moved", moved), ("none moved", idle)):
        median = statistics.median(laps)
        verdict = tables.at_most(50).judge(median) if laps is moved else ""
        table.rows.append([MEMBERS, MEMBER, name, median, statistics.mean(laps), verdict])
    table.about += f" {len(found)} pairs collide at the end."
    return table
