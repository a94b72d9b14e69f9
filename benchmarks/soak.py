"""A window that slides over a stream of millions of points keeps its pace and its size.

Events arrive in batches; the oldest points leave as new ones come, so that a fixed number stays;
now and then a place is asked for. Each stream runs in a process of its own. Throughput is million
events a second of CPU time, one that comes and one that leaves being two, in ten slices of the
stream, the window being full all the time. A machine has its own moods over minutes: so a fixed
piece of work, an engine for as many points from scratch, is timed between parts of a slice, in
another process, and "last / first" compares how much the last slice and the first do in the time of
that work (medians over the parts). Memory is what is resident after a slice. `check()` looks at
everything once, at the end.

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
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
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
    """Yield batches of positions: each ship keeps its course for a while; a fifth are moored."""
    rng = np.random.default_rng(6)
    count = 500
    place = rng.uniform((3.0, 51.0), (5.0, 53.0), (count, 2))
    course, speed = rng.uniform(0, 2 * np.pi, count), rng.exponential(2e-3, count)
    speed[: count // 5] = 0
    for _ in range(batches):
        reports = []
        for _ in range(BATCH // count):
            course += rng.normal(0, 0.05, count)
            place += speed[:, np.newaxis] * np.column_stack((np.sin(course), np.cos(course)))
            away = np.abs(place - (4.0, 52.0)).max(axis=1) > 1.5
            course[away] += np.pi / 2
            reports.append(np.round(place + rng.normal(0, 1e-5, place.shape), 6))
        yield np.concatenate(reports)


STREAMS: dict[str, Callable[[int], Iterator[Points]]] = {
    "curve": curve,
    "uniform": uniform,
    "ships": ships,
}


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield a table of pace and memory, one row a stream."""
    events = QUICK_EVENTS if quick else EVENTS
    columns = ["stream", "events", "first M events/s", "last", "last / first", "flat"]
    columns += ["MB, first slice", "MB, last", "flat ", "check"]
    table = tables.Table(f"A window of {WINDOW:,} points", columns)
    for name in STREAMS:
        command = [sys.executable, "-m", "benchmarks.soak", name, str(events)]
        done = subprocess.run(command, capture_output=True, check=True, text=True)
        found = json.loads(done.stdout)
        pace, against, memory = found["pace"], found["against"], found["memory"]
        steady = against[-1] / against[0]
        flat = tables.at_least(0.9).judge(steady)
        size = tables.at_most(1.1).judge(memory[-1] / memory[0])
        cells = [pace[0], pace[-1], steady, flat, memory[0], memory[-1], size, found["check"]]
        table.rows.append([name, events, *cells])
    yield table


def measure(name: str, events: int) -> dict[str, object]:
    """Slide the window; return, slice by slice, what run makes a row of.

    "pace" is million events a second, "against" the time of the fixed piece of work over that of
    a part; "memory" is in MB.
    """
    batches = events // (2 * BATCH)
    stream = STREAMS[name](WINDOW // BATCH + batches)
    beside = ProcessPoolExecutor(1, mp_context=get_context("spawn"))
    engine, pace, against, memory = fk.Engine(), [], [], []
    window = deque(engine.insert(next(stream)) for _ in range(WINDOW // BATCH))
    engine.side(0.0, 0.0)
    asked = 0
    for _ in range(SLICES):
        seconds, ratios = [], []
        for _ in range(PARTS):
            part = [next(stream) for _ in range(batches // (SLICES * PARTS))]
            began = process_time()
            for batch in part:
                window.append(engine.insert(batch))
                engine.remove(window.popleft())
                if asked % ASK_EVERY == 0:
                    engine.side(*batch[0].tolist())
                asked += 1
            seconds.append(process_time() - began)
            ratios.append(beside.submit(from_scratch).result() / seconds[-1])
        pace.append(2e-6 * BATCH * len(part) * PARTS / sum(seconds))
        against.append(median(ratios))
        memory.append(resident())
    engine.check()
    passed = f"passed, {len(engine):,} points"
    return {"pace": pace, "against": against, "memory": memory, "check": passed}


def from_scratch() -> float:
    """Return the seconds of CPU time that an engine for fixed points takes."""
    points = sets.shuffled(sets.uniform(WINDOW))
    began = process_time()
    engine = fk.Engine()
    engine.insert(points)
    engine.side(0.0, 0.0)
    return process_time() - began


def resident() -> float:
    """Return the megabytes that this process holds. Linux only."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1024
    raise OSError("/proc/self/status: got no VmRSS, expected one")


if __name__ == "__main__":
    print(json.dumps(measure(sys.argv[1], int(sys.argv[2]))))
