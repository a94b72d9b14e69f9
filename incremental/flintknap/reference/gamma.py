"""The gamma-neighbourhood graph for all its parameters, from the definition (section 2.1).

On either side of the line through a and b let phi be the largest angle under which a site sees
them. The side's value is 1 - sin phi, or sin phi - 1 if phi is obtuse, or 1 if no site is there;
the values of both sides, the smaller magnitude first, are (gamma0, gamma1). Angles are compared
exactly, by their cotangents dot / cross; of two that differ in sign alone the negative one goes
first, since a disc that no site is in makes ab a Delaunay edge, and that is gamma1 >= 0.

A site between a and b leaves the pair without values, (nan, nan): it is an edge of no graph.

Cost: O(n) a pair, O(n^3) a graph.
"""

from __future__ import annotations

import math
from functools import cmp_to_key

import numpy as np
from numpy.typing import ArrayLike

from flintknap.reference.exact import Ids, Site, dot, integers, orient

Interval = tuple[float, float]

GRAPHS: dict[str, tuple[Interval, Interval]] = {
    "hull": ((-1, 1), (1, 1)),
    "gabriel": ((0, 1), (0, 1)),
    "delaunay": ((-1, 1), (0, 1)),
    "void": ((1, 1), (1, 1)),
    "complete": ((-1, 1), (-1, 1)),
}

# A cotangent as dot and cross, of which it is the quotient; (1, 0) where no angle is.
Cotangent = tuple[int, int]


def _difference(p: Cotangent, q: Cotangent) -> int:
    return p[0] * q[1] - q[0] * p[1]


_order = cmp_to_key(_difference)


def edges(xy: ArrayLike, gamma0: Interval, gamma1: Interval) -> Ids:
    """Pairs whose values lie in two closed intervals: int64 (m, 2), a < b, rows sorted. O(n^3).

    `GRAPHS` has the intervals of the graphs that have names. Section 2.1.
    """
    sites = integers(xy)
    found = []
    for b in range(len(sites)):
        for a in range(b):
            first, second = _gamma(sites, a, b)
            if gamma0[0] <= first <= gamma0[1] and gamma1[0] <= second <= gamma1[1]:
                found.append((a, b))
    return np.array(sorted(found), np.int64).reshape(-1, 2)


def gamma(xy: ArrayLike, a: int, b: int) -> tuple[float, float]:
    """(gamma0, gamma1) of two of the points; not numbers if one lies between them. O(n)."""
    return _gamma(integers(xy), a, b)


def _gamma(sites: list[Site], a: int, b: int) -> tuple[float, float]:
    seen = {True: [(1, 0)], False: [(1, 0)]}
    for k in set(range(len(sites))) - {a, b}:
        along, across = dot(sites[a], sites[b], sites[k]), orient(sites[a], sites[b], sites[k])
        if across != 0:
            seen[across > 0].append((along, abs(across)))
        elif along < 0:
            return math.nan, math.nan
    largest = [min(side, key=_order) for side in seen.values()]
    first, second = sorted(largest, key=lambda c: (_order((abs(c[0]), c[1])), c[0]))
    return _value(*first), _value(*second)


def _value(along: int, across: int) -> float:
    """1 - sin phi or sin phi - 1, from the cotangent along / across, correctly rounded.

    With w the tangent of 45 degrees plus half of phi, 1 - sin phi is 2 / (1 + w^2): nothing
    cancels, and every step is monotone. Only where phi itself is, the value is 0, 1 or -1.
    """
    if across == 0 or along == 0:
        return float(across == 0)
    tangent = 1.0 / abs(along / across)
    w = tangent + math.sqrt(1.0 + tangent * tangent)
    value = min(max(2.0 / (1.0 + w * w), math.ulp(0.0)), 1.0 - 2.0**-53)
    return math.copysign(value, along)
