"""The tree of Flintstones over a ring, from scratch.

Theory of operation
    Base.     The smallest disc that holds the ring; the two vertices on its rim that are farthest
              apart part the ring into two polylines.
    Polyline. From p to s, with chord ps. A vertex off the chord sees it under some angle; on each
              side the vertex with the smallest angle (ties by coordinates) gives the disc through
              p and s that holds all of that side. The Flintstone is the intersection of the two;
              a side without vertices is cut off at the chord.
    Split.    At the vertex of the smaller disc, equal ones by coordinates; a polyline that lies on
              its chord is split at the vertex nearest the chord's middle.
    Error.    The distance from the chord to the vertex farthest from it, rounded up to a double;
              if not 0, then LEAST_ERROR at least.

A disc through p and s is known by the cotangent of the angle on its rim, left of the chord: its
centre is so many half chords to the left of the chord's middle. Seen from the right the same circle
has the opposite cotangent. Hence t_left = cot at q, t_right = -cot at r, and t_left <= t_right.

Cost: a polyline is scanned from end to end, so the whole tree is O(n^2) in the worst case; the
smallest disc O(h^4) for h points on the hull.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from flintknap.reference.exact import Site, dot, integers, orient
from flintknap.reference.queries import side
from flintknap.reference.triangulation import hull

LEAST_ERROR = 1e-70


@dataclass(frozen=True)
class Edge:
    """An edge of an approximation and the Flintstone of the polyline that it stands for.

    Attributes:
        start: place in the ring where the polyline begins.
        stop: and where it ends.
        level: how deep in the tree.
        left: place of the vertex that gives the left disc, None where there is none.
        right: the same of the right disc.
        split: place of the vertex at which the polyline is split, None if it is a single edge.
        error: largest distance from the chord, rounded up.

    """

    start: int
    stop: int
    level: int
    left: int | None
    right: int | None
    split: int | None
    error: float


def base(ring: ArrayLike) -> tuple[int, int]:
    """Places of the two vertices of level 0 in a ring (n, 2), the smaller coordinates first.

    Section 4.1.
    """
    sites = integers(ring)
    outer = hull(ring).tolist()
    disc = next(
        corners
        for size in (2, 3)
        for corners in combinations(outer, size)
        if all(_side([sites[c] for c in corners], sites[v]) >= 0 for v in outer)
    )
    rim = [v for v in outer if _side([sites[c] for c in disc], sites[v]) == 0]
    rim.sort(key=sites.__getitem__)
    # max takes the first of equals, and pairs come in the order of their coordinates.
    return max(combinations(rim, 2), key=lambda pair: _squared(sites[pair[0]], sites[pair[1]]))


def approximate(ring: ArrayLike, level: float = math.inf, tolerance: float = -1.0) -> list[Edge]:
    """Edges of an approximation of a ring (n, 2), in order, from the smallest vertex on.

    An edge above `level` is split while its error is beyond `tolerance`. Section 4.1.
    """
    xy = np.asarray(ring, np.float64).tolist()
    if not xy:
        return []
    sites, count = integers(ring), len(xy)
    unit = _unit(xy)
    first, second = base(ring)
    todo = [(second, first, 0), (first, second, 0)]
    edges = []
    while todo:
        start, stop, depth = todo.pop()
        between = [(start + n) % count for n in range(1, (stop - start) % count)]
        edge = _edge(sites, unit, start, stop, depth, between)
        if edge.split is None or depth >= level or edge.error <= tolerance:
            edges.append(edge)
        else:
            todo += [(edge.split, stop, depth + 1), (start, edge.split, depth + 1)]
    begin = min(range(len(edges)), key=lambda e: sites[edges[e].start])
    return edges[begin:] + edges[:begin]


def in_flintstone(ring: ArrayLike, edge: Edge, x: float, y: float) -> bool:
    """Whether (x, y) lies in the Flintstone of an edge; that of a single edge is the edge."""
    *sites, w = integers([*np.asarray(ring, np.float64).tolist(), [x, y]])
    p, s = sites[edge.start], sites[edge.stop]
    turn = orient(p, s, w)
    if turn == 0:
        return dot(p, s, w) <= 0
    rim = edge.left if turn > 0 else edge.right
    return rim is not None and _cotangent(p, s, w) <= _cotangent(p, s, sites[rim])


def side_at_level(ring: ArrayLike, level: int, x: float, y: float) -> int:
    """+1 inside, -1 outside, 0 if (x, y) is in a Flintstone of the level and in all above it.

    Section 4.1.
    """
    count = len(np.asarray(ring))
    near = [(0, count)] if count else []  # stretches of the ring: first place, length
    for depth in range(level + 1):
        near = [
            (edge.start, (edge.stop - edge.start) % count)
            for edge in approximate(ring, depth)
            if any((edge.start - first) % count < length for first, length in near)
            and in_flintstone(ring, edge, x, y)
        ]
    return 0 if near else side(ring, range(count), x, y)


def _edge(
    sites: list[Site], unit: Fraction, start: int, stop: int, level: int, between: list[int]
) -> Edge:
    p, s = sites[start], sites[stop]
    if not between:
        return Edge(start, stop, level, None, None, None, 0.0)
    rims: dict[bool, int | None] = {}
    for is_left in (True, False):
        there = [v for v in between if orient(p, s, sites[v]) * (1 if is_left else -1) > 0]
        rims[is_left] = min(
            there, key=lambda v: (-_cotangent(p, s, sites[v]), sites[v]), default=None
        )
    left, right = rims[True], rims[False]
    if left is None and right is None:
        split = min(between, key=lambda v: (dot(p, s, sites[v]), sites[v]))
    elif left is None or right is None:
        split = right if left is None else left  # type: ignore[assignment]
    else:
        offsets = _cotangent(p, s, sites[left]), -_cotangent(p, s, sites[right])
        assert offsets[0] <= offsets[1], "a polyline that no disc on its chord holds"
        radii = {left: abs(offsets[0]), right: abs(offsets[1])}  # in an increasing order, at least
        split = min(radii, key=lambda v: (radii[v], sites[v]))
    farthest = max(_distance_squared(p, s, sites[v]) for v in between)
    return Edge(start, stop, level, left, right, split, _root_up(farthest * unit * unit))


def _side(rim: list[Site], v: Site) -> int:
    """Where v lies in the disc that the rim holds up, negative outside, 0 on the rim.

    For three sites that form no acute triangle there is no such disc: everything is outside.
    """
    if len(rim) == 2:
        return -dot(rim[0], rim[1], v)
    a, b, c = rim if orient(*rim) > 0 else (rim[0], rim[2], rim[1])
    if min(orient(a, b, c), dot(b, c, a), dot(c, a, b), dot(a, b, c)) <= 0:
        return -1
    (ax, ay), (bx, by), (cx, cy) = ((x - v[0], y - v[1]) for x, y in (a, b, c))
    return (
        (ax * ax + ay * ay) * (bx * cy - by * cx)
        + (bx * bx + by * by) * (cx * ay - cy * ax)
        + (cx * cx + cy * cy) * (ax * by - ay * bx)
    )


def _squared(a: Site, b: Site) -> int:
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2


def _cotangent(p: Site, s: Site, v: Site) -> Fraction:
    """Of the angle under which v, off the line, sees p and s. Exact."""
    return Fraction(dot(p, s, v), abs(orient(p, s, v)))


def _distance_squared(p: Site, s: Site, v: Site) -> Fraction:
    """From v to the segment ps."""
    if dot(v, s, p) <= 0:
        return Fraction(_squared(v, p))
    if dot(v, p, s) <= 0:
        return Fraction(_squared(v, s))
    return Fraction(orient(p, s, v) ** 2, _squared(p, s))


def _unit(xy: list[list[float]]) -> Fraction:
    """Return what 1 means among the integers."""
    return Fraction(1, max(value.as_integer_ratio()[1] for row in xy for value in row))


def _root_up(square: Fraction) -> float:
    """Return the square root, rounded up to a double; 0, or LEAST_ERROR at least."""
    if square == 0:
        return 0.0
    if square <= Fraction(LEAST_ERROR) ** 2:
        return LEAST_ERROR
    root = math.sqrt(square)
    while Fraction(root) ** 2 < square:
        root = math.nextafter(root, math.inf)
    while Fraction(math.nextafter(root, 0.0)) ** 2 >= square:
        root = math.nextafter(root, 0.0)
    return max(root, LEAST_ERROR)
