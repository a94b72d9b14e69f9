"""Constriction: triangles go from outside until the boundary has every point (section 3.1).

A gate (i, j, k) is a triangle seen from outside through its edge i->j. The gate with the smallest
cotangent at k, that is the largest angle, is knapped off, so that k comes to lie on the boundary
between i and j; again and again.

Cost, for n points that are triangulated: O(n log n).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from sortedcontainers import SortedList

from flintknap.reference.exact import Ids, Site, cotangent, integers, pairs
from flintknap.reference.triangulation import hull_of, triangulate

Gate = tuple[float, Site, Site, Site, int, int, int]  # key, where k, i, j lie, then i, j, k


@dataclass(frozen=True, eq=False)
class Constriction:
    """What constriction leaves: the boundary, what it missed, and the order of capture.

    Attributes:
        ring: int64 (r,), boundary vertices, counter-clockwise from the smallest; maybe empty.
        inside: int64 (s,), points the boundary does not pass through, sorted by coordinates.
        status: "closed" (no point inside), "locked" (some), "degenerate" (there is no triangle).
        captures: gates (i, j, k) in the order of removal: k came between i and j.

    """

    ring: Ids
    inside: Ids
    status: str
    captures: list[tuple[int, int, int]]


def constrict(xy: ArrayLike, triangles: ArrayLike | None = None) -> Constriction:
    """Constrict the triangulation of (n, 2) distinct points until no gate is removable.

    `triangles` saves triangulating again; default `triangulate(xy)`. O(n log n) once triangulated.
    Section 3.1.
    """
    sites = integers(xy)
    rows = (triangulate(xy) if triangles is None else np.asarray(triangles, np.int64)).tolist()
    apex = {edge: c for i, j, k in rows for edge, c in (((i, j), k), ((j, k), i), ((k, i), j))}
    successor = dict(pairs(hull_of(sites)))

    def gate(i: int, j: int) -> Gate:
        at_i, at_j, at_k = sites[i], sites[j], sites[apex[i, j]]
        return cotangent(at_i, at_j, at_k), at_k, at_i, at_j, i, j, apex[i, j]

    captures = []
    queue = SortedList(gate(i, j) for i, j in successor.items())
    while queue:
        *_, i, j, k = queue.pop(0)
        if k in successor:  # removing this triangle would pinch the boundary at k
            continue
        successor[i], successor[k] = k, j
        captures.append((i, j, k))
        queue.update([gate(i, k), gate(k, j)])

    ring: list[int] = []
    vertex = min(successor, key=sites.__getitem__, default=-1)
    for _ in successor:
        ring.append(vertex)
        vertex = successor[vertex]
    inside = sorted(set(range(len(sites))) - set(ring), key=sites.__getitem__) if ring else []
    status = "degenerate" if not ring else "locked" if inside else "closed"
    return Constriction(np.array(ring, np.int64), np.array(inside, np.int64), status, captures)
