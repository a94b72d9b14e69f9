"""Collision queries by brute force: every edge is looked at, and nothing is rounded but answers.

Coordinates become integers (exact.py); parameters and squared distances are fractions, and square
roots are taken of integers. A ring is given by the coordinates of its vertices, counter-clockwise.

Cost: O(n) an edge or a place, O(n m) two rings.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import pairwise
from math import inf, isqrt, nan

import numpy as np
from numpy.typing import ArrayLike

from flintknap.reference.exact import Site, dot, integers, orient, pairs
from flintknap.reference.queries import side

Edge = tuple[Site, Site]


def root(square: Fraction) -> float:
    """Return the square root, correctly rounded."""
    if square == 0:
        return 0.0
    # An integer root of 2 * 64 bits or more whose last bit says if anything is left out.
    bits = square.denominator.bit_length() - square.numerator.bit_length()
    shift = 128 + bits // 2
    scaled = square * Fraction(4) ** shift
    whole = isqrt(scaled.numerator // scaled.denominator)
    exact = whole * whole == scaled
    return float(Fraction(2 * whole + (not exact)) / 2 / Fraction(2) ** shift)


def squared_distance(a: Site, b: Site, p: Site) -> Fraction:
    """Return that of p to the closed segment ab, squared."""
    if dot(p, b, a) <= 0:
        return Fraction(dot(p, p, a))
    if dot(p, a, b) <= 0:
        return Fraction(dot(p, p, b))
    return Fraction(orient(a, b, p) ** 2, dot(b, b, a))


def squared(ring: ArrayLike, x: float, y: float) -> Fraction:
    """Return the distance of (x, y) to the ring, of which there is one, squared."""
    *corners, p, unit = _integers(ring, [(x, y)])
    return min(squared_distance(a, b, p) for a, b in pairs_of(corners)) / unit[0] ** 2


def distance(ring: ArrayLike, x: float, y: float) -> float:
    """Return the distance of (x, y) to the ring, correctly rounded; inf without a ring."""
    return root(squared(ring, x, y)) if len(np.asarray(ring)) else inf


def nearest(ring: ArrayLike, x: float, y: float) -> tuple[float, float, float, int]:
    """Return the nearest point, its distance and the row of the edge's start, correctly rounded.

    Of edges whose distances round to the same number that whose start has the smaller coordinates
    is taken. (nan, nan, inf, -1) without a ring.
    """
    *corners, p, unit = _integers(ring, [(x, y)])
    found = []
    for row, (a, b) in enumerate(pairs_of(corners)):
        far = root(squared_distance(a, b, p) / unit[0] ** 2)
        found.append((far, a, b, row))
    if not found:
        return nan, nan, inf, -1
    far, a, b, row = min(found)
    t = min(max(Fraction(dot(p, b, a), dot(b, b, a)), Fraction(0)), Fraction(1))
    at_x, at_y = (float((u + t * (v - u)) / unit[0]) for u, v in zip(a, b, strict=True))
    return at_x, at_y, far, row


def meet(first: Edge, second: Edge) -> bool:
    """Whether two closed segments, of any length, have a point in common."""
    for one, other in ((first, second), (second, first)):
        if any(orient(*one, p) == 0 and _in_box(one, p) for p in other):
            return True
    (a, b), (c, d) = first, second
    return (orient(a, b, c) > 0) != (orient(a, b, d) > 0) and (
        (orient(c, d, a) > 0) != (orient(c, d, b) > 0)
    )


def intersects(ring: ArrayLike, x0: float, y0: float, x1: float, y1: float) -> bool:
    """Whether the closed segment has a point in common with the ring."""
    return bool(crossings(ring, x0, y0, x1, y1))


def crossings(
    ring: ArrayLike, x0: float, y0: float, x1: float, y1: float
) -> list[tuple[float, int]]:
    """Return, of each edge met, the correctly rounded parameter of the first point and its row.

    Sorted by parameter, then by the coordinates of the edge's start.
    """
    *corners, p, q, _ = _integers(ring, [(x0, y0), (x1, y1)])
    found = [
        (float(min(contacts(p, q, (a, b)))), a, row)
        for row, (a, b) in enumerate(pairs_of(corners))
        if meet((p, q), (a, b))
    ]
    return [(t, row) for t, _, row in sorted(found)]


def first_hit(ring: ArrayLike, x0: float, y0: float, x1: float, y1: float) -> tuple[float, int]:
    """Return the first of the crossings; (nan, -1) if there are none."""
    return next(iter(crossings(ring, x0, y0, x1, y1)), (nan, -1))


def contains_segment(ring: ArrayLike, x0: float, y0: float, x1: float, y1: float) -> bool:
    """Whether the closed segment lies in the closed object.

    Its contacts cut it into pieces, each of which is wholly in or out: their middles tell.
    """
    *corners, p, q, _ = _integers(ring, [(x0, y0), (x1, y1)])
    cuts = {Fraction(0), Fraction(1)}
    for edge in pairs_of(corners):
        if meet((p, q), edge):
            cuts.update(contacts(p, q, edge))
    ordered = sorted(cuts)
    middles = [(a + b) / 2 for a, b in pairwise(ordered)]
    return all(_is_in(corners, p, q, t) for t in [*ordered, *middles])


def collides(ring: ArrayLike, other: ArrayLike) -> bool:
    """Whether the closed objects have a point in common."""
    first, second = np.asarray(ring, np.float64), np.asarray(other, np.float64)
    if not len(first) or not len(second):
        return False
    sites = integers(np.concatenate([first, second]))
    a, b = pairs_of(sites[: len(first)]), pairs_of(sites[len(first) :])
    if any(meet(one, two) for one in a for two in b):
        return True
    first_rows, second_rows = np.arange(len(first)), np.arange(len(second))
    return (
        side(first, first_rows, *second[0].tolist()) > 0
        or side(second, second_rows, *first[0].tolist()) > 0
    )


def clearance(ring: ArrayLike, other: ArrayLike) -> float:
    """Return the distance of the closed objects, correctly rounded; inf if one has no ring."""
    first, second = np.asarray(ring, np.float64), np.asarray(other, np.float64)
    if not len(first) or not len(second):
        return inf
    if collides(first, second):
        return 0.0
    return min(
        distance(one, x, y)
        for one, two in ((first, second), (second, first))
        for x, y in two.tolist()
    )


def contacts(p: Site, q: Site, edge: Edge) -> Iterator[Fraction]:
    """Yield the parameters along pq of the ends of what it has in common with an edge it meets."""
    a, b = edge
    at_p, at_q = orient(a, b, p), orient(a, b, q)
    if at_p != at_q:
        yield Fraction(at_p, at_p - at_q)
        return
    if p == q:
        yield Fraction(0)
        return
    for v, segment in ((p, edge), (q, edge), (a, (p, q)), (b, (p, q))):
        if _in_box(segment, v):  # all four lie on one line
            yield Fraction(dot(v, q, p), dot(q, q, p))


def pairs_of(corners: list[Site]) -> list[Edge]:
    """Return the edges of a ring, that from the first vertex first."""
    return [(corners[i], corners[j]) for i, j in pairs(range(len(corners)))]


def _integers(ring: ArrayLike, places: list[tuple[float, float]]) -> list[Site]:
    """Return ring and places as integers, and (1, 0) on their scale."""
    corners = np.asarray(ring, np.float64).reshape(-1, 2)
    return integers(np.concatenate([corners, places, [(1.0, 0.0)]]))


def _in_box(edge: Edge, p: Site) -> bool:
    (ax, ay), (bx, by) = edge
    return min(ax, bx) <= p[0] <= max(ax, bx) and min(ay, by) <= p[1] <= max(ay, by)


def _is_in(corners: list[Site], p: Site, q: Site, t: Fraction) -> bool:
    """Whether the point at t between p and q lies in the closed polygon: all times t's denominator.

    A ray to the right is crossed an odd number of times, or the point is on an edge.
    """
    n, d = t.numerator, t.denominator
    at = ((d - n) * p[0] + n * q[0], (d - n) * p[1] + n * q[1])
    inside = False
    for a, b in pairs_of([(d * x, d * y) for x, y in corners]):
        turn = orient(a, b, at)
        if turn == 0 and _in_box((a, b), at):
            return True
        if (a[1] > at[1]) != (b[1] > at[1]) and (turn > 0) == (b[1] > at[1]):
            inside = not inside
    return inside
