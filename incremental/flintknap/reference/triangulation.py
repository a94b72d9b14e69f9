"""The canonical Delaunay triangulation by gift wrapping, from the definition (section 2.1).

The triangle to the left of a Delaunay edge a->b has its apex where a and b are seen under the
largest angle. Ties (cocircular points) go as if every point were lifted off the paraboloid
(x, y, x^2 + y^2) by an infinitesimal, the lexicographically smallest point by far the most: lifted
points leave the discs of the others.

Cost, for n points: triangulation O(n^2) steps on big integers (under a second for 1,000 points),
hull O(n log n).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from flintknap.reference.exact import Ids, Site, integers, orient, pairs


def triangulate(xy: ArrayLike) -> Ids:
    """Canonical Delaunay triangulation of (n, 2) distinct points: int64 (m, 3), rows sorted.

    Each row is counter-clockwise and begins at its lexicographically smallest corner. Empty if all
    points lie on a line. O(n^2). Section 2.1.
    """
    sites = integers(xy)
    around = hull_of(sites)
    # Beyond a hull edge, taken backwards, there is no triangle: these directed edges count as done.
    done = {(b, a) for a, b in pairs(around)}
    todo = pairs(around)
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
    return np.array(hull_of(integers(xy)), np.int64)


def hull_of(sites: list[Site]) -> list[int]:
    """Monotone chain that keeps points amid hull edges: rightward below, leftward above."""
    order = sorted(range(len(sites)), key=sites.__getitem__)
    chains: list[list[int]] = []
    for sweep in (order, order[::-1]):
        chain: list[int] = []
        for c in sweep:
            while len(chain) > 1 and orient(sites[chain[-2]], sites[chain[-1]], sites[c]) < 0:
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
    return (smallest == a) == (orient(a, c, d) > 0)
