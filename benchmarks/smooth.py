"""Smooth boundaries, all at once.

What a curve costs after a change stands in follow.md.
"""

from __future__ import annotations

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


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield a table for curves from scratch."""
    scratch = tables.contest("From a ring", "set", "N", unit="a vertex")
    for name, make in SETS.items():
        for n in (10**5,) if quick else (10**5, 10**6):
            xy = make(n)
            found = compare(smoothed(xy), n, quick=quick)
            targets = {"flintknap, length": tables.at_most(0.1, "0.1 s for 1e6")}
            tables.enter(scratch, [name, n], found, targets)
    yield scratch


def smoothed(xy: Points) -> dict[str, Contender]:
    """Return contenders that make a curve through all vertices."""
    ids = np.arange(len(xy))

    def weighted(weights: Weights) -> Contender:
        def contender(clock: Clock) -> str:
            with clock.lap(len(xy)):
                made = curve(ids, xy, weights)
                made.control, made.tangents  # noqa: B018 - arrays are made when asked for
            return f"{len(made.adjusted)} adjusted"

        return contender

    return {f"flintknap, {weights}": weighted(weights) for weights in WEIGHTS}
