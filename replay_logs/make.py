"""Make the sample logs beside this script, and digests.json with what is expected of each.

windowed.json has the same for replays with a window of WINDOW seconds.

    python replay_logs/make.py [countries-10m.json]

The synthetic logs need nothing. The Benelux log is made only if the path to the file
`countries-10m.json` of the npm package world-atlas (README.md) is given; otherwise it stays as it
is. Everything is reproducible: the only randomness is `random.Random(seed).random()`, whose
sequence Python guarantees, and every coordinate is rounded far above what a libm could change.
"""

from __future__ import annotations

import json
import math
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import accumulate, pairwise
from operator import itemgetter
from pathlib import Path
from random import Random
from typing import Any, TypeVar

from flintknap import log
from flintknap.events import Event, Insert, Kind, Move, Query, Remove
from flintknap.replay import replay

HERE = Path(__file__).parent
EARTH = 6371.0072  # km, radius of the sphere with the area of the Earth
WINDOW = 60.0  # seconds
CENTRE = (5.0, 51.5)  # degrees, near the middle of the Benelux

Point = tuple[float, float]
T = TypeVar("T")


def benelux(atlas: Path) -> list[Event]:
    """Figure 7 of the paper: the outer border of the mainland of three countries, shuffled; km."""
    topology = json.loads(atlas.read_text())
    arcs = [_degrees(arc, **topology["transform"]) for arc in topology["arcs"]]
    used: Counter[int] = Counter()
    for country in topology["objects"]["countries"]["geometries"]:
        if country["properties"]["name"] in ("Belgium", "Luxembourg", "Netherlands"):
            used.update(_numbers(country["arcs"]))
    # What two of them share is used twice; the rest is their outer border, islands included.
    border = max(_rings([arcs[i] for i, count in used.items() if count == 1]), key=_area)
    points = dict.fromkeys(_equal_area(*place) for place in border)
    return [
        Insert(t=float(second), object="benelux", x=x, y=y)
        for second, (x, y) in enumerate(_shuffled(points, Random(7)))
    ]


def sweep() -> list[Event]:
    """Two revolutions of a range finder in a room with niches: in angular order, noisy; metres."""
    rng = Random(1)
    room: list[Point] = [(0, 0), (9, 0), (9, 4), (6.5, 4), (6.5, 5), (9, 5), (9, 8), (5, 8)]
    room += [(5, 6.5), (3.5, 6.5), (3.5, 8), (0, 8), (0, 5), (1.5, 4), (0, 3)]
    beams = 720
    events: list[Event] = []
    for beam in range(2 * beams):
        # The second revolution falls between the beams of the first.
        angle = 2 * math.pi * (beam + (0.5 if beam >= beams else 0.0)) / beams
        distance = _range(room, (4.2, 3.1), angle) + 0.008 * _noise(rng)
        events.append(
            Insert(
                t=round(beam / (10 * beams), 6),
                object="room",
                x=round(4.2 + distance * math.cos(angle), 3),
                y=round(3.1 + distance * math.sin(angle), 3),
            )
        )
    return events


def burst() -> list[Event]:
    """Two blobs seen by a careless source: in bursts, with repetitions, and asked in between."""
    rng = Random(2)
    events: list[Event] = []
    seen: dict[str, list[Point]] = {"amoeba": [], "drop": []}
    t = 0.0
    while len(events) < 3000:
        t = round(t + rng.random(), 3)
        name = "amoeba" if rng.random() < 0.6 else "drop"
        towards = 2 * math.pi * rng.random()
        for _ in range(1 + int(30 * rng.random() ** 3)):
            if seen[name] and rng.random() < 0.15:
                x, y = seen[name][int(len(seen[name]) * rng.random())]
            else:
                x, y = _blob(name, towards + 0.6 * _noise(rng), 0.12 * _noise(rng))
            seen[name].append((x, y))
            events.append(Insert(t=t, object=name, x=x, y=y))
        if rng.random() < 0.5:
            kind: Kind = "side" if rng.random() < 0.5 else "contains"
            x, y = round(14 * rng.random() - 4, 2), round(8 * rng.random() - 4, 2)
            if rng.random() < 0.3:
                x, y = seen[name][int(len(seen[name]) * rng.random())]
            events.append(Query(t=t, object=name, kind=kind, x=x, y=y))
    return events


def grid() -> list[Event]:
    """Whole numbers: points on common lines and circles everywhere, four objects interleaved."""
    cells = {(x, y) for x in range(16) for y in range(12) if (x - 3) % 6 < 4 or 4 <= y < 7}
    corners = {(x + i, y + j) for x, y in cells for i in (0, 1) for j in (0, 1)}
    quad = [(-1, -1), (-1, 0), (0, -1), (0, 0)]
    disc = range(-25, 26)
    sets = {
        # The outline of the cells: every lattice point that is a corner of one to three of them.
        "cells": {(x, y) for x, y in corners if sum((x + i, y + j) in cells for i, j in quad) < 4},
        "lattice": {(x, y) for x in range(20, 29) for y in range(9)},
        # All lattice points of a circle of radius 25 (Pythagorean triples), and its centre.
        "circle": {(22 + x, 40 + y) for x in disc for y in disc if x * x + y * y in (0, 625)},
        "line": {(32 + i, 2 * i) for i in range(7)},
    }
    rng = Random(3)
    points = [(name, x, y) for name, pairs in sets.items() for x, y in sorted(pairs)]
    return [
        Insert(t=float(t), object=name, x=float(x), y=float(y))
        for t, (name, x, y) in enumerate(_shuffled(points, rng))
    ]


def drift() -> list[Event]:
    """Sightings of the edge of a slick adrift, some late, some retracted; and four buoys; km, s.

    Without a window the whole trail stays; with one of WINDOW seconds, the slick as it is.
    """
    rng = Random(4)
    events: list[Event] = []
    for buoy in range(4):  # ids 0 to 3, as nothing has come before them
        x, y = _slick(0.0, buoy * math.pi / 2, 1.3)
        events.append(Insert(t=0.0, object="slick", x=x, y=y))
    for tick in range(1, 1500):
        t = tick / 5
        seen = t if rng.random() < 0.9 else round(t - 90 * rng.random(), 3)  # reported late
        x, y = _slick(max(seen, 0.0), 2 * math.pi * rng.random(), 1 + 0.005 * _noise(rng))
        events.append(Insert(t=seen, object="slick", x=x, y=y))
        if rng.random() < 0.04:  # a mistake: the sighting is taken back at once
            events.append(Remove(t=t, object="slick", x=x, y=y))
        if tick % 50 == 0:
            for buoy in range(4):
                x, y = _slick(t, buoy * math.pi / 2, 1.3)
                events.append(Move(t=t, object="slick", id=buoy, x=x, y=y))
        if tick % 60 == 0:
            x, y = _slick(t - 60, math.pi * rng.random(), 0.9)
            events.append(Query(t=t, object="slick", kind="contains", x=x, y=y))
    events.append(Remove(t=t, object="slick", id=3))  # is recovered
    return events


def main(arguments: list[str]) -> None:
    """Write the logs, then replay each and write down where it ends."""
    made = {"sweep": sweep(), "burst": burst(), "grid": grid(), "drift": drift()}
    if arguments:
        made["benelux"] = benelux(Path(arguments[0]))
    for name, events in made.items():
        log.write(HERE / f"{name}.jsonl.gz", events)
    for file, window in (("digests.json", None), ("windowed.json", WINDOW)):
        expected = {path.name: facts(path, window) for path in sorted(HERE.glob("*.jsonl.gz"))}
        (HERE / file).write_text(json.dumps(expected, indent=2) + "\n")


def facts(path: Path, window: float | None = None) -> dict[str, dict[str, Any]]:
    """Replay a log; for each object: how many events, distinct points and so on, and the digest."""
    done = replay(path, window=window)
    return {
        name: {
            "events": done.events[name],
            **({} if window is None else {"expired": done.windows[name].expired}),
            "points": len(engine),
            "status": engine.boundary().status,
            "vertices": len(engine.boundary()),
            "inside": len(engine.boundary().inside),
            "digest": engine.digest(),
        }
        for name, engine in done.engines.items()
    }


def _shuffled(items: Iterable[T], rng: Random) -> list[T]:
    """Sort by random numbers: unlike Random.shuffle, the same in every version of Python."""
    return [item for _, item in sorted(((rng.random(), item) for item in items), key=itemgetter(0))]


def _noise(rng: Random) -> float:
    """About normally distributed: mean 0, standard deviation 1, never beyond 6."""
    return sum(rng.random() for _ in range(12)) - 6


def _range(room: list[Point], sensor: Point, angle: float) -> float:
    """Distance from the sensor to the first wall in the direction of the angle."""
    u, v = math.cos(angle), math.sin(angle)
    hits = []
    for (ax, ay), (bx, by) in pairwise([*room, room[0]]):
        # sensor + distance * (u, v) == a + along * (b - a)
        dx, dy, ex, ey = bx - ax, by - ay, ax - sensor[0], ay - sensor[1]
        turn = u * dy - v * dx
        if turn and 0 <= (ex * v - ey * u) / turn <= 1:
            hits.append((ex * dy - ey * dx) / turn)
    return min(distance for distance in hits if distance > 0)


def _blob(name: str, angle: float, noise: float) -> Point:
    """Return a point near the outline of a blob, rounded so that some points repeat by chance."""
    if name == "amoeba":
        radius = 2.6 + 0.5 * math.sin(3 * angle) + 0.3 * math.cos(5 * angle) + noise
        return round(radius * math.cos(angle), 2), round(radius * math.sin(angle), 2)
    radius = 1.2 + 0.5 * math.cos(angle) + noise
    return round(7 + 2 * radius * math.cos(angle), 2), round(radius * math.sin(angle), 2)


def _slick(t: float, angle: float, stretch: float) -> Point:
    """Return a place at the edge of a slick that drifts, at time t."""
    radius = stretch * (1 + 0.2 * math.sin(3 * angle))
    x, y = 0.006 * t + 1.6 * radius * math.cos(angle), 0.1 * math.sin(t / 60)
    return round(x, 3), round(y + radius * math.sin(angle), 3)


def _degrees(arc: list[list[int]], scale: Point, translate: Point) -> list[Point]:
    """Decode an arc of a quantised topology: integer steps from point to point."""
    x, y = map(accumulate, zip(*arc, strict=True))
    return [
        (translate[0] + i * scale[0], translate[1] + j * scale[1])
        for i, j in zip(x, y, strict=True)
    ]


def _numbers(arcs: Any) -> Iterator[int]:
    """Arc numbers at any depth of nesting; ~i is arc i backwards."""
    if isinstance(arcs, int):
        yield arcs if arcs >= 0 else ~arcs
    else:
        for inner in arcs:
            yield from _numbers(inner)


def _rings(arcs: list[list[Point]]) -> list[list[Point]]:
    """Join arcs end to end into closed rings, the last point of each being its first."""
    rings = []
    while arcs:
        ring = arcs.pop()
        while ring[0] != ring[-1]:
            following = next(arc for arc in arcs if ring[-1] in (arc[0], arc[-1]))
            arcs.remove(following)
            ring += following[1:] if following[0] == ring[-1] else following[-2::-1]
        rings.append(ring)
    return rings


def _area(ring: list[Point]) -> float:
    return abs(sum(ax * by - ay * bx for (ax, ay), (bx, by) in pairwise(ring)))


def _equal_area(longitude: float, latitude: float) -> Point:
    """Lambert's azimuthal equal-area projection around CENTRE; km, rounded to 10 m."""
    a, b = math.radians(longitude - CENTRE[0]), math.radians(latitude)
    c = math.radians(CENTRE[1])
    across = math.cos(c) * math.cos(b) * math.cos(a) + math.sin(c) * math.sin(b)
    k = EARTH * math.sqrt(2 / (1 + across))
    north = math.cos(c) * math.sin(b) - math.sin(c) * math.cos(b) * math.cos(a)
    return round(k * math.cos(b) * math.sin(a), 2), round(k * north, 2)


if __name__ == "__main__":
    main(sys.argv[1:])
