"""A log of insert events, JSON Lines on disk, to the boundary; one object, no queries.

What reading the JSON alone takes stands beside it, for scale: with the standard library, and with
the decoder that ours use, without its checks of lines.
"""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import msgspec

from benchmarks import sets, tables, timing
from flintknap import log
from flintknap.events import Event, Insert
from flintknap.replay import replay

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from benchmarks.sets import Points
    from benchmarks.timing import Clock, Contender

SETS: dict[str, Callable[[int], Points]] = {"uniform": sets.uniform, "curve": sets.curve}
TARGETS = {"flintknap": tables.at_most(1 / 0.7, "1.43 (0.7 M events/s)")}


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield a table of costs an event."""
    n = 10**5 if quick else 10**6
    table = tables.contest(f"{n:,} events to the boundary", "set", unit="an event")
    for name, make in SETS.items():
        with TemporaryDirectory() as folder:
            file = Path(folder) / "log.jsonl"
            write(file, sets.shuffled(make(n)))
            write(file.with_suffix(".jsonl.gz"), sets.shuffled(make(n)))
            found = timing.compare(contenders(file, n), n, quick=quick)
        tables.enter(table, [name], found, {} if quick else TARGETS)
    yield table


def write(file: Path, points: Points) -> None:
    """Write an event for each point, one every 10 ms."""
    rows = enumerate(points.tolist())
    log.write(file, (Insert(t=round(0.01 * i, 2), x=x, y=y) for i, (x, y) in rows))


def contenders(file: Path, n: int) -> dict[str, Contender[str]]:
    """Return them all; `file` lies there plain and compressed."""

    def flintknap(path: Path) -> Contender[str]:
        def run(clock: Clock) -> str:
            with clock.lap(n):
                (engine,) = replay(path).engines.values()
                engine.boundary()
            return f"{n / clock.seconds / 1e6:.2f} M events/s, {path.stat().st_size / n:.0f} bytes"

        return run

    def standard_library(clock: Clock) -> str:
        with clock.lap(n), file.open("rb") as lines:
            for line in lines:
                json.loads(line)
        return ""

    def decoder(clock: Clock) -> str:
        events = msgspec.json.Decoder(Event)
        with clock.lap(n), file.open("rb") as lines:
            next(lines)
            for line in lines:
                events.decode(line)
        return ""

    return {
        "flintknap": flintknap(file),
        "flintknap, gzip": flintknap(file.with_suffix(".jsonl.gz")),
        "json.loads, line by line": standard_library,
        "msgspec, line by line": decoder,
    }
