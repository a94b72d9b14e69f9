"""The gamma-family (section 2.1): names of its graphs, and the intervals they stand for.

A graph of the family holds the pairs of points whose gamma0 and gamma1 lie in two closed intervals,
where a point on the open segment between two others leaves those without values: they are an edge
of no graph. So "complete" joins all who see each other, and "void" is empty unless all points lie
on a line: there neighbours have the values (1, 1), and are edges of every named graph.

For every beta > 0 the circle-based beta-skeleton is that of c = 1 - 1 / beta, or of c = beta - 1
where beta < 1: both values are at least c. Its c is rounded once.
"""

from __future__ import annotations

import math
from typing import Literal, TypeAlias

from flintknap.errors import InputError

GraphName = Literal["hull", "gabriel", "delaunay", "void", "complete"]
Graph: TypeAlias = GraphName | tuple[Literal["beta_skeleton"], float]
Interval = tuple[float, float]

_WHOLE = (-1.0, 1.0)
_INTERVALS: dict[str, tuple[Interval, Interval]] = {
    "hull": (_WHOLE, (1.0, 1.0)),
    "gabriel": ((0.0, 1.0), (0.0, 1.0)),
    "delaunay": (_WHOLE, (0.0, 1.0)),
    "void": ((1.0, 1.0), (1.0, 1.0)),
    "complete": (_WHOLE, _WHOLE),
}
_EXPECTED = f'one of {", ".join(_INTERVALS)} or ("beta_skeleton", beta)'


def intervals(
    graph: Graph | None, gamma0: Interval | None, gamma1: Interval | None
) -> tuple[Interval, Interval]:
    """Return the intervals of gamma0 and gamma1 that were asked for, in the one way or the other.

    Raises InputError for what is no name of a graph and no interval, for both and for neither.
    """
    if graph is None:
        if gamma0 is None and gamma1 is None:
            raise InputError(f"got no graph, expected {_EXPECTED}, or intervals")
        return _interval(gamma0, "gamma0"), _interval(gamma1, "gamma1")
    if gamma0 is not None or gamma1 is not None:
        raise InputError(f"got graph {graph!r} and intervals, expected one or the other")
    if isinstance(graph, str) and graph in _INTERVALS:
        return _INTERVALS[graph]
    if isinstance(graph, tuple) and len(graph) == 2 and graph[0] == "beta_skeleton":
        return _skeleton(graph[1])
    raise InputError(f"got graph {graph!r}, expected {_EXPECTED}")


def _skeleton(beta: float) -> tuple[Interval, Interval]:
    if not isinstance(beta, int | float) or not beta > 0:
        raise InputError(f"got beta {beta!r}, expected a number greater than 0")
    least = 1 - 1 / beta if beta >= 1 else beta - 1
    if math.isfinite(beta):  # 1 is an empty side, and no finite disc is as large as that
        least = min(least, math.nextafter(1, 0))
    return (least, 1.0), (least, 1.0)


def _interval(given: Interval | None, name: str) -> Interval:
    if given is None:
        return _WHOLE
    try:
        low, high = map(float, given)
    except (TypeError, ValueError):
        raise InputError(f"{name}: got {given!r}, expected two numbers") from None
    if not -1 <= low <= high <= 1:
        raise InputError(f"{name}: got {(low, high)}, expected -1 <= low <= high <= 1")
    return low, high
