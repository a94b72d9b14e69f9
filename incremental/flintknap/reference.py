"""The paper in plain Python: every stage from scratch, on plain arrays, in exact arithmetic.

This module says what the engine computes; the kernel only says how to do it fast. It shares no
code with the rest of the package and the two must agree exactly, so either judges the other.

Theory of operation
    Integers.      A double is an integer times a power of two. All coordinates are multiplied by
                   one power of two that makes them integers; signs and angles do not notice, and
                   Python's integers do not round. The quotient of two of them is rounded once.
    Triangulation. Gift wrapping, straight from the definition: the triangle to the left of a
                   Delaunay edge a->b has its apex where a and b are seen under the largest angle.
                   Ties (cocircular points) go as if every point were lifted off the paraboloid
                   (x, y, x^2 + y^2) by an infinitesimal, the lexicographically smallest point by
                   far the most: lifted points leave the discs of the others.
    Constriction.  A gate (i, j, k) is a triangle seen from outside through its edge i->j. The gate
                   with the smallest cotangent at k, that is the largest angle, is knapped off, so
                   that k comes to lie on the boundary between i and j; again and again.

Invariants
    Every result is a function of the set of points: only index values depend on the row order.
    Triangles are counter-clockwise, begin at their lexicographically smallest corner and come in
    sorted rows; a ring is counter-clockwise and begins at its lexicographically smallest vertex.

Cost, for n points: triangulation O(n^2) steps on big integers (under a second for 1,000 points),
    hull O(n log n), constriction O(n log n), one point in polygon O(n).

Refuses nothing and checks nothing: rows are finite, distinct and within the range of the engine.
"""

from __future__ import annotations

import hashlib
import math
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sortedcontainers import SortedList

Ids = NDArray[np.int64]
Site = tuple[int, int]  # integer coordinates; tuples compare lexicographically, as ties require
Gate = tuple[float, Site, Site, Site, int, int, int]  # key, where k, i, j lie, then i, j, k


@dataclass(frozen=True, eq=False)
class Constriction:
    """What constriction leaves: the boundary, what it missed, and the order of capture.

    ring      int64 (r,), boundary vertices, counter-clockwise from the smallest; maybe empty
    inside    int64 (s,), points the boundary does not pass through, sorted by coordinates
    status    "closed" (no point inside), "locked" (some), "degenerate" (there is no triangle)
    captures  gates (i, j, k) in the order of removal: k came between i and j
    """

    ring: Ids
    inside: Ids
    status: str
    captures: list[tuple[int, int, int]]


def triangulate(xy: ArrayLike) -> Ids:
    """Canonical Delaunay triangulation of (n, 2) distinct points: int64 (m, 3), rows sorted.

    Each row is counter-clockwise and begins at its lexicographically smallest corner. Empty if all
    points lie on a line. O(n^2). Section 2.1.
    """
    sites = _integers(xy)
    around = _hull(sites)
    # Beyond a hull edge, taken backwards, there is no triangle: these directed edges count as done.
    done = {(b, a) for a, b in _pairs(around)}
    todo = _pairs(around)
    rows = []
    while todo:
        a, b = todo.pop()
        if (a, b) in done:
            continue
        c = _apex(sites, a, b)
        done.update([(a, b), (b, c), (c, a)])
        todo += [(c, b), (a, c)]
        first = min(a, b, c, key=sites.__getitem__)
        rows.append({a: (a, b, c), b: (b, c, a), c: (c, a, b)}[first])
    return np.array(sorted(rows), np.int64).reshape(-1, 3)


def hull(xy: ArrayLike) -> Ids:
    """Every point on the convex hull, points amid its edges too: int64 (h,).

    Counter-clockwise from the lexicographically smallest; empty if all points lie on a line.
    O(n log n). Section 2.1.
    """
    return np.array(_hull(_integers(xy)), np.int64)


def constrict(xy: ArrayLike, triangles: ArrayLike | None = None) -> Constriction:
    """Constrict the triangulation of (n, 2) distinct points until no gate is removable.

    `triangles` saves triangulating again; default `triangulate(xy)`. O(n log n) once triangulated.
    Section 3.1.
    """
    sites = _integers(xy)
    rows = (triangulate(xy) if triangles is None else np.asarray(triangles, np.int64)).tolist()
    apex = {edge: c for i, j, k in rows for edge, c in (((i, j), k), ((j, k), i), ((k, i), j))}
    successor = dict(_pairs(_hull(sites)))

    def gate(i: int, j: int) -> Gate:
        at_i, at_j, at_k = sites[i], sites[j], sites[apex[i, j]]
        return _cotangent(at_i, at_j, at_k), at_k, at_i, at_j, i, j, apex[i, j]

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


def side(xy: ArrayLike, ring: ArrayLike, x: float, y: float) -> int:
    """+1 if (x, y) lies inside the polygon xy[ring], 0 if on it, -1 if outside; exact.

    Counts how often a ray to the right crosses the ring. O(n).
    """
    corners = np.asarray(xy, np.float64)[np.asarray(ring, np.int64)]
    *sites, p = _integers(np.append(corners, [[x, y]], axis=0))
    result = -1
    for i, j in _pairs(range(len(sites))):
        a, b = sorted([sites[i], sites[j]], key=lambda s: s[1])
        turn = _orient(a, b, p)
        if turn == 0 and min(a, b) <= p <= max(a, b):
            return 0
        if a[1] <= p[1] < b[1] and turn > 0:
            result = -result
    return result


def edges(xy: ArrayLike, name: str) -> Ids:
    """Edges of a graph of the gamma-family: int64 (m, 2), a < b in each row, rows sorted.

    `name`: "delaunay"; "gabriel", where no angle facing the edge is obtuse; "hull", where one side
    is free of points. Points on a line are joined to their neighbours in all three. O(n^2).
    Section 2.1.

    Raises KeyError for any other name.
    """
    sites = _integers(xy)
    facing = _facing(sites, triangulate(xy))
    graphs = {
        "delaunay": [edge for edge, _ in facing],
        "gabriel": [
            (a, b)
            for (a, b), corners in facing
            if all(_dot(sites[a], sites[b], sites[c]) >= 0 for c in corners)
        ],
        "hull": [edge for edge, corners in facing if len(corners) < 2],
    }
    return np.array(graphs[name], np.int64).reshape(-1, 2)


def gamma(xy: ArrayLike, a: int, b: int) -> tuple[float, float]:
    """(gamma0, gamma1) of the Delaunay edge ab, the smaller magnitude first. O(n^2). Section 2.1.

    Raises KeyError if ab is no edge of the canonical triangulation.
    """
    sites = _integers(xy)
    facing = dict(_facing(sites, triangulate(xy)))
    found = [_indicator(sites[a], sites[b], sites[c]) for c in facing[min(a, b), max(a, b)]]
    # Facing angles add up to 180 degrees at most: only the smaller magnitude can carry a minus
    # sign, so values sort as magnitudes do.
    gamma0, gamma1 = sorted([*found, 1.0, 1.0][:2])
    return gamma0, gamma1


def digest(xy: ArrayLike) -> str:
    """Hexadecimal BLAKE2b-128 of status, ring and set: equal sets, equal digests. O(n^2)."""
    points = np.asarray(xy, np.float64).reshape(-1, 2) + 0.0  # -0.0 + 0.0 is 0.0
    found = constrict(points)
    order = np.lexsort((points[:, 1], points[:, 0]))
    state = hashlib.blake2b(b"flintknap 1\0" + found.status.encode() + b"\0", digest_size=16)
    state.update(points[found.ring].astype("<f8").tobytes())
    state.update(points[order].astype("<f8").tobytes())
    return state.hexdigest()


def _integers(xy: ArrayLike) -> list[Site]:
    """Multiply the points by the smallest power of two that makes all coordinates integers."""
    flat = [value.as_integer_ratio() for value in np.asarray(xy, np.float64).ravel().tolist()]
    scale = max((denominator for _, denominator in flat), default=1)
    values = [numerator * (scale // denominator) for numerator, denominator in flat]
    return list(zip(values[::2], values[1::2], strict=True))


def _pairs(ring: Iterable[int]) -> list[tuple[int, int]]:
    """Each entry with the next one, the last with the first."""
    ring = list(ring)
    return list(zip(ring, ring[1:] + ring[:1], strict=True))


def _orient(a: Site, b: Site, c: Site) -> int:
    """Twice the area of abc: positive if counter-clockwise, 0 if the three lie on a line."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _dot(i: Site, j: Site, k: Site) -> int:
    """(i - k) . (j - k): negative if the angle at k is obtuse."""
    return (i[0] - k[0]) * (j[0] - k[0]) + (i[1] - k[1]) * (j[1] - k[1])


def _cotangent(i: Site, j: Site, k: Site) -> float:
    """Cotangent of the angle at k, correctly rounded: it falls as the angle grows."""
    return _dot(i, j, k) / abs(_orient(i, j, k))


def _indicator(i: Site, j: Site, k: Site) -> float:
    """Definition 1: 1 - sin, or sin - 1 if obtuse, of the angle at k, freed of cancellation."""
    cot = _cotangent(i, j, k)
    cosecant = math.hypot(1.0, cot)
    return (cot / cosecant) * (abs(cot) / (1.0 + cosecant))


def _hull(sites: list[Site]) -> list[int]:
    """Monotone chain that keeps points amid hull edges: rightward below, leftward above."""
    order = sorted(range(len(sites)), key=sites.__getitem__)
    chains: list[list[int]] = []
    for sweep in (order, order[::-1]):
        chain: list[int] = []
        for c in sweep:
            while len(chain) > 1 and _orient(sites[chain[-2]], sites[chain[-1]], sites[c]) < 0:
                chain.pop()
            chain.append(c)
        chains.append(chain)
    below, above = chains
    return [] if below == above[::-1] else below[:-1] + above[:-1]


def _apex(sites: list[Site], a: int, b: int) -> int:
    """Find the point left of a->b that sees ab under the largest angle, ties settled. O(n).

    The angle is the largest where dot / cross is the smallest, and cross > 0: compare crosswise.
    """
    (ax, ay), (bx, by) = sites[a], sites[b]
    ux, uy = bx - ax, by - ay
    best, best_dot, best_cross = -1, 1, 0
    for c, (x, y) in enumerate(sites):
        vx, vy = x - ax, y - ay
        cross = ux * vy - uy * vx
        if cross > 0:
            dot = vx * (x - bx) + vy * (y - by)
            less = dot * best_cross - best_dot * cross
            if less < 0 or (
                less == 0 and _inside_lifted(sites[a], sites[b], sites[best], sites[c])
            ):
                best, best_dot, best_cross = c, dot, cross
    return best


def _inside_lifted(a: Site, b: Site, c: Site, d: Site) -> bool:
    """Whether d, on the circle of abc, lies in its disc after the lifting; c and d left of a->b.

    The smallest of the four is lifted far above the others: the diagonal that avoids it remains.

        d ---- c      smallest is a or c: diagonal bd, the triangle on ab is abd, so d was inside
        |      |      smallest is b or d: diagonal ac, the triangle on ab is abc, so d is outside
        a ---- b      (if it is d that comes first after b: the same with c and d exchanged)
    """
    smallest = min(a, b, c, d)
    if smallest in (c, d):
        return smallest == c
    return (smallest == a) == (_orient(a, c, d) > 0)


def _facing(sites: list[Site], triangles: Ids) -> list[tuple[tuple[int, int], list[int]]]:
    """Delaunay edges (a, b), a < b, sorted, each with the one or two points that face it.

    Neighbours on a line are edges that no point faces.
    """
    if len(triangles) == 0:
        order = sorted(range(len(sites)), key=sites.__getitem__)
        return sorted(((min(p), max(p)), []) for p in pairwise(order))
    facing = defaultdict(list)
    for i, j, k in triangles.tolist():
        for p, q, corner in ((i, j, k), (j, k, i), (k, i, j)):
            facing[min(p, q), max(p, q)].append(corner)
    return sorted(facing.items())
