"""A window that slides over a stream of millions of points keeps its pace and its size.

Events arrive in batches; the oldest points leave as new ones come, so that a fixed number stays;
now and then a place is asked for. Each stream runs in a process of its own. Throughput is million
events a second of CPU time, one that comes and one that leaves being two, in ten slices of the
stream, the window being full all the time. A machine has its own moods over minutes, and one part
of a stream may be harder than another: so in one slice more a young engine, which was given at once
what the window holds and has slid by its length once, does the same work part by part, and "old /
young" is the median of how much of it the old one does in the time of the young one. Memory is what
is resident and what the engine counts, medians over the parts of a slice, for some parts of a
stream need more of it than others. `check()` looks at everything once, at the end.

    curve     along a closed wavy curve, over and over, with a noise of one spacing
    uniform   anywhere in the unit square
    ships     AIS-like: a few hundred ships that steer and tire, each position with receiver jitter
              and rounded to 1e-6 degrees, so that moored ones repeat themselves
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections import deque
from pathlib import Path
from statistics import median
from time import process_time
from typing import TYPE_CHECKING

import numpy as np

import flintknap as fk
from benchmarks import sets, tables

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from benchmarks.sets import Points

WINDOW, BATCH = 10**5, 1000
EVENTS, QUICK_EVENTS = 10**7, 10**6
ASK_EVERY = 10  # batches
SLICES, PARTS = 10, 10  # of the stream; of a slice
SETTLING = 10**4  # steps that ships take before they are watched


def curve(batches: int) -> Iterator[Points]:
    """Yield batches of one lap after another of a noisy curve, each lap shuffled."""
    done = 0
    for lap in range(batches):
        points = sets.shuffled(sets.noisy_curve(WINDOW, seed=lap), seed=lap)
        for batch in points.reshape(-1, BATCH, 2):
            if done == batches:
                return
            yield batch
            done += 1


def uniform(batches: int) -> Iterator[Points]:
    """Yield batches of random points."""
    rng = np.random.default_rng(5)
    for _ in range(batches):
        yield rng.random((BATCH, 2))


def ships(batches: int) -> Iterator[Points]:
    """Yield batches of positions: each ship keeps its course for a while; a fifth are moored.

    Those that are far out head for the middle. It is as it always was when the first batch comes.
    """
    rng = np.random.default_rng(6)
    count = 500
    place = rng.uniform((3.0, 51.0), (5.0, 53.0), (count, 2))
    course, speed = rng.uniform(0, 2 * np.pi, count), rng.exponential(2e-3, count)
    speed[: count // 5] = 0
    reports: list[Points] = []
    for step in range(SETTLING + batches * BATCH // count):
        course += rng.normal(0, 0.05, count)
        place += speed[:, np.newaxis] * np.column_stack((np.sin(course), np.cos(course)))
        back = np.array((4.0, 52.0)) - place
        away = np.abs(back).max(axis=1) > 1.5
        course[away] = np.arctan2(back[away, 0], back[away, 1])
        if step >= SETTLING:
            reports.append(np.round(place + rng.normal(0, 1e-5, place.shape), 6))
        if len(reports) * count == BATCH:
            yield np.concatenate(reports)
            reports = []


STREAMS: dict[str, Callable[[int], Iterator[Points]]] = {
    "curve": curve,
    "uniform": uniform,
    "ships": ships,
}


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield a table of pace and memory, one row a stream."""
    events = QUICK_EVENTS if quick else EVENTS
    columns = ["stream", "events", "first M events/s", "last", "old / young", "flat"]
    columns += ["MB, first slice", "MB, last", "flat ", "counted, first", "last ", "check"]
    table = tables.Table(f"A window of {WINDOW:,} points", columns)
    for name in STREAMS:
        command = [sys.executable, "-m", "benchmarks.soak", name, str(events)]
        done = subprocess.run(command, capture_output=True, check=True, text=True)
        found = json.loads(done.stdout)
        pace, steady, held, counted = (found[k] for k in ("pace", "steady", "resident", "counted"))
        flat = tables.at_least(0.9).judge(steady)
        size = tables.at_most(1.1).judge(held[-1] / held[0])
        cells = [pace[0], pace[-1], steady, flat, held[0], held[-1], size, counted[0], counted[-1]]
        table.rows.append([name, events, *cells, found["check"]])
    yield table


class Sliding:
    """A window over a stream, and an engine for it that was given all its points at once."""

    def __init__(self, batches: list[Points]) -> None:
        self.engine = fk.Engine()
        self.batches = deque(batches)
        ids = self.engine.insert(np.concatenate(batches))
        self.ids = deque(np.split(np.asarray(ids), len(batches)))
        self.engine.side(0.0, 0.0)
        self.asked = 0

    def seconds(self, part: list[Points]) -> float:
        """Slide over a part of the stream; return the CPU time that it took."""
        began = process_time()
        for batch in part:
            self.ids.append(np.asarray(self.engine.insert(batch)))
            self.engine.remove(self.ids.popleft())
            if self.asked % ASK_EVERY == 0:
                self.engine.side(*batch[0].tolist())
            self.asked += 1
        taken = process_time() - began
        self.batches.extend(part)
        for _ in part:
            self.batches.popleft()
        return taken


def measure(name: str, events: int) -> dict[str, object]:
    """Slide the window; return, slice by slice, what run makes a row of.

    "pace" is million events a second, "resident" and "counted" are in MB, "steady" is the pace of
    the old engine over that of the young one.
    """
    size = events // (2 * BATCH * SLICES * PARTS)  # of a part
    stream = STREAMS[name](2 * WINDOW // BATCH + size * PARTS * (SLICES + 1))
    old = Sliding([next(stream) for _ in range(WINDOW // BATCH)])
    pace, held, counted, ratios = [], [], [], []
    for _ in range(SLICES):
        seconds, parts = 0.0, []
        for _ in range(PARTS):
            seconds += old.seconds([next(stream) for _ in range(size)])
            parts.append((resident(), old.engine._kernel.bytes() / 2**20))
        pace.append(2e-6 * BATCH * size * PARTS / seconds)
        held.append(median(part[0] for part in parts))
        counted.append(median(part[1] for part in parts))
    young = Sliding(list(old.batches))
    part = [next(stream) for _ in range(WINDOW // BATCH)]
    young.seconds(part), old.seconds(part)
    for _ in range(PARTS):
        part = [next(stream) for _ in range(size)]
        ratios.append(young.seconds(part) / old.seconds(part))
    old.engine.check()
    passed = f"passed, {len(old.engine):,} points"
    found = {"pace": pace, "steady": median(ratios), "resident": held, "counted": counted}
    return {**found, "check": passed}


def resident() -> float:
    """Return the megabytes that this process holds. Linux only."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1024
    raise OSError("/proc/self/status: got no VmRSS, expected one")


if __name__ == "__main__":
    print(json.dumps(measure(sys.argv[1], int(sys.argv[2]))))
