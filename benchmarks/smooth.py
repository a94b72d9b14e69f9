"""Smooth boundaries: all at once, and after a change.

"After a change" puts one more point on top of N, shuffled, asks for a side, so that the boundary is
right, and only then starts the clock: for the ring alone, and for ring and curve.
"""

from __future__ import annotations

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


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield a table for curves from scratch, and one for curves after a change."""
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


def smoothed(xy: Points) -> dict[str, Contender]:
    """Return contenders that make a curve through all vertices."""
    ids = np.arange(len(xy))

    def weighted(weights: Weights) -> Contender:
        def contender(clock: Clock) -> str:
            with clock.lap(len(xy)):
                made = curve(ids, xy, weights)
            return f"{len(made.adjusted)} adjusted"

        return contender

    return {f"flintknap, {weights}": weighted(weights) for weights in WEIGHTS}


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
