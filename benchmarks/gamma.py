"""Graphs of the gamma-family from points that are triangulated already, as sorted rows of ids.

The graphs among the triangulation's edges stand beside NumPy on scipy's triangulation, in doubles:
which edge sees an obtuse angle, then the rows sorted. Its triangulation is off the clock, as ours.

Below zero, "gamma1 >= d" adds the pairs whose lens is empty. The peer looks at all pairs through
gamma(), as far as they are few. The last cell: edges a point.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

import flintknap as fk
from benchmarks import sets, tables, timing
from benchmarks.ours import triangulated

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from benchmarks.sets import Points
    from benchmarks.timing import Clock, Contender
    from flintknap.gamma import Graph

SETS: dict[str, Callable[[int], Points]] = {
    "uniform": sets.uniform,
    "curve, noise of one spacing": sets.noisy_curve,
    "grid": sets.grid,
}
GRAPHS: dict[str, Graph] = {
    "Gabriel": "gabriel",
    "beta = 1.5": ("beta_skeleton", 1.5),
    "beta = 2": ("beta_skeleton", 2.0),
    "Delaunay": "delaunay",
}
# On the curve pairs face each other along it, and the more points, the more of them.
DEPTHS = {
    "uniform": (-0.1, -0.3, -0.5, -0.7),
    "curve, noise of one spacing": (-0.1, -0.3),
    "grid": (-0.1, -0.3, -0.5, -0.7),
}
FEW = 500  # points of which all pairs are looked at


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield a table of graphs within the triangulation and one of those beyond it."""
    within = tables.contest("Once triangulated", "set", "N", "graph", unit="a point")
    n = 10**5 if quick else 10**6
    for name, make in SETS.items():
        case = Case(sets.shuffled(make(n)))
        for graph, asked in GRAPHS.items():
            found = timing.compare(case.named(asked), n, quick=quick)
            has_target = name == "uniform" and n == 10**6 and graph != "Delaunay"
            targets = {"flintknap": tables.at_most(0.1)} if has_target else None
            tables.enter(within, [name, n, graph], found, targets)
    yield within

    beyond = tables.contest("Below zero", "set", "N", "d", unit="an edge found")
    for name, make in SETS.items():
        for n in (FEW, 10**4) if quick or make is sets.noisy_curve else (FEW, 10**5):
            case = Case(sets.shuffled(make(n)))
            for d in DEPTHS[name]:
                found = timing.compare(case.below(d), n, quick=quick)
                has_target = name == "uniform" and n == 10**5 and d == -0.3
                targets = {"flintknap": tables.at_most(3)} if has_target else None
                tables.enter(beyond, [name, n, d], found, targets)
    yield beyond


@dataclass
class Case:
    """Points, triangulated by us and by scipy when first asked for."""

    points: Points

    @cached_property
    def engine(self) -> fk.Engine:
        """With the points in place."""
        engine = fk.Engine()
        engine.insert(self.points)
        triangulated(engine)
        return engine

    @cached_property
    def scipys(self) -> Any:
        """The same from scipy."""
        from scipy.spatial import Delaunay

        return Delaunay(self.points)

    def named(self, graph: Graph) -> dict[str, Contender[float]]:
        """Return contenders for a graph within the triangulation."""
        n = len(self.points)

        def flintknap(clock: Clock) -> float:
            engine = self.engine
            with clock.lap(n):
                edges = engine.edges(graph)
            return len(edges) / n

        def numpy(clock: Clock) -> float:
            triangles = self.scipys.simplices
            with clock.lap(n):
                edges = gabriel(self.points, triangles)
            return len(edges) / n

        found: dict[str, Contender[float]] = {"flintknap": flintknap}
        if graph == "gabriel":
            found["NumPy on scipy's"] = numpy
        return found

    def below(self, d: float) -> dict[str, Contender[float]]:
        """Return contenders for gamma([-1, 1], [d, 1])."""
        n = len(self.points)

        def flintknap(clock: Clock) -> float:
            engine = self.engine
            with clock.lap(0):
                edges = engine.edges(gamma1=(d, 1))
            clock.operations += len(edges)
            return len(edges) / n

        def every_pair(clock: Clock) -> float:
            engine, (a, b) = self.engine, np.triu_indices(n, 1)
            with clock.lap(0):
                gamma1 = engine.gamma(a, b)[1]
                edges = np.column_stack((a, b))[gamma1 >= d]
            clock.operations += len(edges)
            return len(edges) / n

        found: dict[str, Contender[float]] = {"flintknap": flintknap}
        if n <= FEW:
            found["all pairs"] = every_pair
        return found


def gabriel(points: Points, triangles: NDArray[np.int32]) -> NDArray[np.int64]:
    """Return the edges of a triangulation that see no obtuse angle, sorted."""
    ends, blunt = [], []
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        u = points[triangles[:, i]] - points[triangles[:, k]]
        v = points[triangles[:, j]] - points[triangles[:, k]]
        blunt.append((u * v).sum(axis=1) < 0)
        ends.append(np.sort(triangles[:, [i, j]].astype(np.int64), axis=1))
    rows = np.concatenate(ends)
    keys, place = np.unique(rows[:, 0] * len(points) + rows[:, 1], return_inverse=True)
    sees = np.zeros(len(keys), bool)
    sees[place[np.concatenate(blunt)]] = True
    return np.column_stack(np.divmod(keys[~sees], len(points)))
