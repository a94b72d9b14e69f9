"""Smooth boundaries: all at once, after a change, drawn; and how long the package takes to start.

"After a change" puts one more point on top of N, shuffled, asks for a side, so that the boundary is
right, and only then starts the clock: for the ring alone, and for ring and curve.

"Start" is the CPU time of whole processes, the median of interleaved rounds.
"""

from __future__ import annotations

import resource
import statistics
import subprocess
import sys
from typing import TYPE_CHECKING

import numpy as np

import flintknap as fk
from benchmarks import sets, tables
from benchmarks.ours import bounded
from benchmarks.timing import compare
from flintknap.smooth import WEIGHTS, curve

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from benchmarks.sets import Points
    from benchmarks.timing import Clock
    from flintknap.smooth import Weights

    Contender = Callable[[Clock], str]

SETS: dict[str, Callable[[int], Points]] = {
    "curve": sets.curve,
    "curve, noise of one spacing": sets.noisy_curve,
}
CHANGES = 50  # of each round
STARTS = {
    "empty": ["-c", "pass"],
    "numpy": ["-c", "import numpy"],
    "flintknap": ["-c", "import flintknap"],
    "flintknap, an engine": ["-c", "import flintknap; flintknap.Engine()"],
    "flintknap --help": ["-m", "flintknap", "--help"],
}
ROUNDS, QUICK_ROUNDS = 21, 5


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield a table for curves from scratch, after a change, and for starts."""
    scratch = tables.contest("From a ring", "set", "N", unit="a vertex")
    changed = tables.contest("After a change", "set", "N", unit="a change")
    for name, make in SETS.items():
        for n in (10**5,) if quick else (10**5, 10**6):
            xy = make(n)
            found = compare(smoothed(xy), n, quick=quick)
            targets = {"flintknap, length": tables.at_most(0.1, "0.1 s for 1e6")}
            tables.enter(scratch, [name, n], found, targets)
        found = compare(after_changes(sets.shuffled(make(10**5))), 10**5, quick=quick)
        targets = {"flintknap ring and curve": tables.at_most(200)}
        tables.enter(changed, [name, 10**5], found, targets)
    yield scratch
    yield changed
    yield starts(QUICK_ROUNDS if quick else ROUNDS)


def smoothed(xy: Points) -> dict[str, Contender]:
    """Return contenders that make a curve through all vertices, and that draw it."""
    ids = np.arange(len(xy))

    def weighted(weights: Weights) -> Contender:
        def contender(clock: Clock) -> str:
            with clock.lap(len(xy)):
                made = curve(ids, xy, weights)
            return f"{len(made.adjusted)} adjusted"

        return contender

    def drawn(clock: Clock) -> str:
        made = curve(ids, xy)
        with clock.lap(len(xy)):
            made.to_svg()
        return ""

    found = {f"flintknap, {weights}": weighted(weights) for weights in WEIGHTS}
    return {**found, "flintknap to_svg": drawn}


def after_changes(xy: Points) -> dict[str, Contender]:
    """Return contenders that are asked after each of some insertions."""

    def asked(question: Callable[[fk.Engine], object]) -> Contender:
        def contender(clock: Clock) -> str:
            engine = fk.Engine()
            engine.insert(xy[:-CHANGES])
            bounded(engine)
            for x, y in xy[-CHANGES:].tolist():
                engine.insert(x, y)
                engine.side(0.0, 0.0)
                with clock.lap():
                    question(engine)
            return ""

        return contender

    return {
        "flintknap ring": asked(fk.Engine.boundary),
        "flintknap ring and curve": asked(fk.Engine.smooth),
    }


def starts(rounds: int) -> tables.Table:
    """Return the CPU time of processes that start and end."""
    taken: dict[str, list[float]] = {name: [] for name in STARTS}
    for _ in range(rounds):
        for name, arguments in STARTS.items():
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run([sys.executable, *arguments], stdout=subprocess.DEVNULL, check=True)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            taken[name].append(seconds)

    def median_of(one: str, other: str, of: Callable[[float, float], float]) -> float:
        return statistics.median(map(of, taken[one], taken[other]))

    table = tables.Table("Start", ["", "ms", "beyond empty, ms", "of numpy", "target"])
    ratio_target = tables.at_most(1.3, "1.3 of numpy")
    targets = {"flintknap": ratio_target, "flintknap, an engine": ratio_target}
    for name in STARTS:
        beyond = 1e3 * median_of(name, "empty", lambda a, b: a - b)
        share = median_of(name, "numpy", lambda a, b: a / b)
        verdict = targets[name].judge(share) if name in targets else ""
        if name.endswith("--help"):
            verdict = tables.at_most(150, "150 ms beyond empty").judge(beyond)
        row = [name, 1e3 * statistics.median(taken[name]), beyond, share, verdict]
        table.rows.append(row)
    return table
