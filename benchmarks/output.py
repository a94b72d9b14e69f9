"""Pictures of large boundaries, and how long the package and its command take to start.

Pictures are drawn of objects whose boundary, tree and curve are there already, so that it is the
drawing that is measured.

"Start" is the CPU time of whole processes, the median of interleaved rounds.
"""

from __future__ import annotations

import resource
import statistics
import subprocess
import sys
from typing import TYPE_CHECKING

import flintknap as fk
from benchmarks import sets, tables
from benchmarks.timing import compare
from flintknap import picture, svg

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from benchmarks.sets import Points
    from benchmarks.timing import Clock

    Contender = Callable[[Clock], str]

SETS: dict[str, Callable[[int], Points]] = {
    "curve": sets.curve,
    "curve, noise of one spacing": sets.noisy_curve,
}
LAYERS = ["boundary", "points,boundary", "boundary,flintstones:10", "graph,boundary", "smooth"]
TARGETS = {"flintknap, boundary": tables.at_most(3, "0.3 s for 1e5")}
PNG_SIZE = 2000
STARTS = {
    "empty": ["-c", "pass"],
    "numpy": ["-c", "import numpy"],
    "flintknap": ["-c", "import flintknap"],
    "flintknap, an engine": ["-c", "import flintknap; flintknap.Engine()"],
    "flintknap --help": ["-m", "flintknap", "--help"],
    "flintknap replay --help": ["-m", "flintknap", "replay", "--help"],
}
ROUNDS, QUICK_ROUNDS = 21, 5


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield a table for pictures, and one for starts."""
    pictures = tables.contest("Pictures", "set", "N", unit="a vertex")
    n = 10**4 if quick else 10**5
    for name, make in SETS.items():
        found = compare(drawn(make(n)), n, quick=quick)
        tables.enter(pictures, [name, n], found, TARGETS)
    yield pictures
    yield starts(QUICK_ROUNDS if quick else ROUNDS)


def drawn(xy: Points) -> dict[str, Contender]:
    """Return contenders that draw layers of an object as SVG, and one that makes a PNG file."""
    engine = fk.Engine()
    engine.insert(xy)
    objects = {"object": engine}

    def layered(layers: str) -> Contender:
        svg.draw(objects, layers)  # once before the clock starts

        def contender(clock: Clock) -> str:
            with clock.lap(len(xy)):
                text = svg.draw(objects, layers)
            return f"{len(text) / 1e6:.1f} MB"

        return contender

    def as_png(clock: Clock) -> str:
        from flintknap import plot

        with clock.lap(len(xy)):
            data = plot.png(picture.compose(objects, "boundary"), PNG_SIZE)
        return f"{len(data) / 1e6:.1f} MB"

    found = {f"flintknap, {layers}": layered(layers) for layers in LAYERS}
    return {**found, "flintknap, boundary, PNG": as_png}


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
        table.rows.append([name, 1e3 * statistics.median(taken[name]), beyond, share, verdict])
    return table
