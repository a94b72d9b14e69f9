"""Widening: where constriction of the Delaunay triangulation locks, wider gamma-graphs go on (3.1).

A candidate (i, j, k) is an edge i->j of the boundary and a point k inside such that the triangle
ijk lies in the polygon and holds no other point, neither inside nor on its sides. Its *need* is the
largest d <= 0 for which the graph gamma([-1, 1], [d, 1]) has both ik and jk. Its *size* is that of
the discs which make the graph so wide: the square of their diameter, for ik or jk, whichever is
larger. Of the candidates whose need is no less than d_min the one with the smallest size is taken,
ties by gamma-indicator: k comes to lie between i and j. Again and again, until none is left.

Needs are written as cotangents, which are rounded correctly and order pairs as gamma1 does: 0.0
where gamma1 >= 0, else the cotangent of the largest angle under which a point sees the pair. Sizes
are evaluated from them in doubles.

Cost: O(n) for each pair and for each triangle looked at, O(n m) triangles for m locked points.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from flintknap.reference.constriction import Gate, constrict
from flintknap.reference.exact import Ids, Site, cotangent, dot, integers, orient, pairs


@dataclass(frozen=True, eq=False)
class Widening:
    """What widening leaves: the boundary, what it missed, how far it went, and its captures.

    Attributes:
        ring: int64 (r,), boundary vertices, counter-clockwise from the smallest; maybe empty.
        inside: int64 (s,), points the boundary does not pass through, sorted by coordinates.
        status: "closed" (no point inside), "locked" (some), "degenerate" (there is no triangle).
        d: the graph gamma([-1, 1], [d, 1]) has all sides; 0.0 without widening.
        captures: (i, j, k) in order, after those of the constriction: k came between i and j.

    """

    ring: Ids
    inside: Ids
    status: str
    d: float
    captures: list[tuple[int, int, int]]


def widen(xy: ArrayLike, d_min: float = -1.0, triangles: ArrayLike | None = None) -> Widening:
    """Constrict (n, 2) distinct points, then widen to `d_min` at most; 0 does not widen at all.

    `triangles` saves triangulating again; default `triangulate(xy)`. Section 3.1.
    """
    sites, places = integers(xy), np.asarray(xy, np.float64).reshape(-1, 2).tolist()
    locked = constrict(xy, triangles)
    successor = dict(pairs(locked.ring.tolist()))
    inside = set(locked.inside.tolist())
    pair_need = cache(lambda a, b: need(sites, a, b))
    # A triangle that is not empty mostly holds points near k: these are asked first.
    near = {k: sorted(sites, key=lambda p: dot(p, p, sites[k])) for k in inside}
    candidates: dict[tuple[int, int, int], tuple[float, Gate, float]] = {}

    def look(i: int, j: int, k: int) -> None:
        """Note the triangle as a candidate if it is one."""
        if _is_empty(near[k], sites[i], sites[j], sites[k]) and _is_clear(
            sites, i, j, k, list(successor.items())
        ):
            needs = {v: pair_need(*sorted((v, k))) for v in (i, j)}
            least = min(needs.values())
            if may(least, d_min):
                largest = max(size(places[v], places[k], cot) for v, cot in needs.items())
                key = cotangent(sites[i], sites[j], sites[k])
                candidates[i, j, k] = (
                    largest,
                    (key, sites[k], sites[i], sites[j], i, j, k),
                    least,
                )

    captures: list[tuple[int, int, int]] = []
    reached = 0.0
    if d_min < 0:
        for i, j in successor.items():
            for k in inside:
                look(i, j, k)
    while candidates:
        _, (*_, i, j, k), least = min(candidates.values())
        reached = min(reached, least)
        successor[i], successor[k] = k, j
        inside.remove(k)
        captures.append((i, j, k))
        for u, v, w in list(candidates):
            cut = not _is_clear(sites, u, v, w, [(i, k), (k, j)])
            if w == k or (u, v) == (i, j) or cut:
                del candidates[u, v, w]
        for w in inside:
            look(i, k, w)
            look(k, j, w)

    ring: list[int] = []
    vertex = min(successor, key=sites.__getitem__, default=-1)
    for _ in successor:
        ring.append(vertex)
        vertex = successor[vertex]
    left = sorted(inside, key=sites.__getitem__)
    status = "degenerate" if not ring else "locked" if left else "closed"
    d = max(d_min, gamma_of(reached))
    return Widening(np.array(ring, np.int64), np.array(left, np.int64), status, d, captures)


def need(sites: list[Site], a: int, b: int) -> float:
    """0.0 if gamma1 of the pair is at least 0, else the cotangent it comes from, rounded.

    Of the largest angles on either side, gamma1 is negative iff they exceed 180 degrees together;
    then it belongs to the larger. No point may lie between a and b. O(n).
    """
    blunt: list[Fraction | None] = [None, None]
    for c, site in enumerate(sites):
        area = orient(sites[a], sites[b], site)
        if c not in (a, b) and area != 0:
            cot = Fraction(dot(sites[a], sites[b], site), abs(area))
            best = blunt[area > 0]
            blunt[area > 0] = cot if best is None else min(best, cot)
    left, right = blunt
    if left is None or right is None or left + right >= 0:
        return 0.0
    return float(min(left, right))


def size(a: list[float], b: list[float], cot: float) -> float:
    """Square of the diameter of the discs of a pair, length over sin(phi), from cot(phi)."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    return (dx * dx + dy * dy) * (1.0 + cot * cot)


def may(cot: float, d_min: float) -> bool:
    """Whether gamma1 = 1 / sqrt(1 + cot^2) - 1 >= d_min, exactly; cot <= 0."""
    return (1 + Fraction(d_min)) ** 2 * (1 + Fraction(cot) ** 2) <= 1


def gamma_of(cot: float) -> float:
    """Gamma, sin - 1, of the obtuse angle with this cotangent, freed of cancellation."""
    cosecant = math.hypot(1.0, cot)
    return (cot / cosecant) * (abs(cot) / (1.0 + cosecant))


def digest(xy: ArrayLike, d_min: float = -1.0) -> str:
    """Hexadecimal BLAKE2b-128 of status, ring and set: equal sets, equal digests. O(n^2)."""
    points = np.asarray(xy, np.float64).reshape(-1, 2) + 0.0  # -0.0 + 0.0 is 0.0
    found = widen(points, d_min)
    order = np.lexsort((points[:, 1], points[:, 0]))
    state = hashlib.blake2b(b"flintknap 1\0" + found.status.encode() + b"\0", digest_size=16)
    state.update(points[found.ring].astype("<f8").tobytes())
    state.update(points[order].astype("<f8").tobytes())
    return state.hexdigest()


def _is_empty(points: list[Site], a: Site, b: Site, c: Site) -> bool:
    """Whether abc turns left and no other of the points lies inside it or on its sides. O(n)."""
    return orient(a, b, c) > 0 and not any(
        orient(a, b, p) >= 0 and orient(b, c, p) >= 0 and orient(c, a, p) >= 0
        for p in points
        if p not in (a, b, c)
    )


def _is_clear(sites: list[Site], i: int, j: int, k: int, border: list[tuple[int, int]]) -> bool:
    """Whether the empty triangle ijk on the edge ij is cut by none of these edges of the polygon.

    An edge that enters the triangle has no end in it but i or j, and cannot cross ij; so it leaves,
    or enters, through ik or jk. O(edges).
    """
    return not any(
        _cross(sites[v], sites[k], sites[a], sites[b]) for a, b in border for v in (i, j)
    )


def _cross(a: Site, b: Site, c: Site, d: Site) -> bool:
    """Whether the open segments ab and cd cross in one point."""
    return orient(a, b, c) * orient(a, b, d) < 0 and orient(c, d, a) * orient(c, d, b) < 0
