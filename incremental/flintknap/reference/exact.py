"""Integers instead of doubles, so that nothing is rounded.

A double is an integer times a power of two. All coordinates are multiplied by one power of two
that makes them integers; signs and angles do not notice, and Python's integers do not round. The
quotient of two of them is rounded once.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

Ids = NDArray[np.int64]
Site = tuple[int, int]  # integer coordinates; tuples compare lexicographically, as ties require


def integers(xy: ArrayLike) -> list[Site]:
    """Multiply the points by the smallest power of two that makes all coordinates integers."""
    flat = [value.as_integer_ratio() for value in np.asarray(xy, np.float64).ravel().tolist()]
    scale = max((denominator for _, denominator in flat), default=1)
    values = [numerator * (scale // denominator) for numerator, denominator in flat]
    return list(zip(values[::2], values[1::2], strict=True))


def pairs(ring: Iterable[int]) -> list[tuple[int, int]]:
    """Each entry with the next one, the last with the first."""
    ring = list(ring)
    return list(zip(ring, ring[1:] + ring[:1], strict=True))


def orient(a: Site, b: Site, c: Site) -> int:
    """Twice the area of abc: positive if counter-clockwise, 0 if the three lie on a line."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def dot(i: Site, j: Site, k: Site) -> int:
    """(i - k) . (j - k): negative if the angle at k is obtuse."""
    return (i[0] - k[0]) * (j[0] - k[0]) + (i[1] - k[1]) * (j[1] - k[1])


def cotangent(i: Site, j: Site, k: Site) -> float:
    """Cotangent of the angle at k, correctly rounded: it falls as the angle grows."""
    return dot(i, j, k) / abs(orient(i, j, k))
