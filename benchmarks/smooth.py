"""Smooth boundaries: all at once, drawn; and how long the package takes to start.

What a curve costs after a change stands in follow.md.

"Start" is the CPU time of whole processes, the median of interleaved rounds.
"""

from __future__ import annotations

import resource
import statistics
import subprocess
import sys
from typing import TYPE_CHECKING

import numpy as np

from benchmarks import sets, tables
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
STARTS = {
    "empty": ["-c", "pass"],
    "numpy": ["-c", "import numpy"],
    "flintknap": ["-c", "import flintknap"],
    "flintknap, an engine": ["-c", "import flintknap; flintknap.Engine()"],
    "flintknap --help": ["-m", "flintknap", "--help"],
}
ROUNDS, QUICK_ROUNDS = 21, 5


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield a table for curves from scratch, and one for starts."""
    scratch = tables.contest("From a ring", "set", "N", unit="a vertex")
    for name, make in SETS.items():
        for n in (10**5,) if quick else (10**5, 10**6):
            xy = make(n)
            found = compare(smoothed(xy), n, quick=quick)
            targets = {"flintknap, length": tables.at_most(0.1, "0.1 s for 1e6")}
            tables.enter(scratch, [name, n], found, targets)
    yield scratch
    yield starts(QUICK_ROUNDS if quick else ROUNDS)


def smoothed(xy: Points) -> dict[str, Contender]:
    """Return contenders that make a curve through all vertices, and that draw it."""
    ids = np.arange(len(xy))

    def weighted(weights: Weights) -> Contender:
        def contender(clock: Clock) -> str:
            with clock.lap(len(xy)):
                made = curve(ids, xy, weights)
                made.control, made.tangents  # noqa: B018 - arrays are made when asked for
            return f"{len(made.adjusted)} adjusted"

        return contender

    def drawn(clock: Clock) -> str:
        made = curve(ids, xy)
        with clock.lap(len(xy)):
            made.to_svg()
        return ""

    found = {f"flintknap, {weights}": weighted(weights) for weights in WEIGHTS}
    return {**found, "flintknap to_svg": drawn}


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
