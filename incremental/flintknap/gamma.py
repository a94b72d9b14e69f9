"""The gamma-family (section 2.1): the names of its graphs and the form of their edges.

On a set without triangles, which lies on one line, consecutive points see no other: both sides of
such a pair are empty, so gamma is (1, 1) and it is an edge of all three graphs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from flintknap._kernel import Graph
from flintknap.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

GraphName = Literal["delaunay", "gabriel", "hull"]


def graph(name: str) -> Graph:
    """Return the kernel's graph of that name, or raise InputError."""
    known: dict[str, Graph] = {g.name: g for g in Graph}
    if name not in known:
        raise InputError(f"got graph {name!r}, expected one of {', '.join(known)}")
    return known[name]


def canonical(edges: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the edges with a < b in each row and the rows sorted. O(m log m)."""
    edges = np.sort(edges, axis=1)
    return edges[np.lexsort((edges[:, 1], edges[:, 0]))]


def along_line(ids: NDArray[np.int64], xy: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the edges between points that follow each other on a line."""
    order = ids[np.lexsort((xy[:, 1], xy[:, 0]))]
    return np.column_stack((order[:-1], order[1:]))
