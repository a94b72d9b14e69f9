"""What approximations tell of distances and contacts: bounds from chords and errors.

Theory of operation
    Strand.   A path from p to s, no point of which is farther from the chord ps than the error: an
              edge of an approximation. A place or a segment is one without error.
    Pair.     Two strands are no closer than their chords less both errors; no farther than an end
              of one is from the other's chord, plus the other's error. They cross for certain if
              the chords cross properly, each with its ends farther from the other than that strays.
    Descent.  Pairs of the strands of level 0; of a pair, the pairs of halves, down to the cut. A
              lower bound is the largest on the way down.

Cost: all pairs of strands of the cut.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from flintknap.reference import collision
from flintknap.reference.exact import integers, orient
from flintknap.reference.flintstone import (
    LEAST_ERROR,
    Edge,
    distance_up,
    is_final,
    side_at,
    tree,
)

Place = tuple[float, float]


@dataclass(frozen=True)
class Strand:
    """A path that stays near its chord.

    Attributes:
        p: where it begins.
        s: where it ends.
        error: how far it strays from the chord at most, rounded up.
        halves: the two paths that it is made of, or none.

    """

    p: Place
    s: Place
    error: float
    halves: tuple[Strand, ...] = ()

    def far(self, v: Place) -> float:
        """Return the distance from the chord to v, rounded up."""
        return distance_up(self.p, self.s, v)


@dataclass(frozen=True)
class Bounds:
    """What is known of a distance.

    Attributes:
        lower: no more than it.
        upper: no less than it.
        crosses: whether the two cross for certain.
        exact: whether all is known of them.

    """

    lower: float
    upper: float
    crosses: bool = False
    exact: bool = True


def strands(
    ring: ArrayLike, level: float = math.inf, tolerance: float | None = None
) -> list[Strand]:
    """Return the two strands of level 0 with their halves, down to a cut; none of no ring."""
    of = tree(ring, tolerance)

    def strand(edge: Edge) -> Strand:
        below = [] if is_final(edge, level, tolerance) else of.halves(edge)
        (px, py), (sx, sy) = of.xy[edge.start], of.xy[edge.stop]
        return Strand((px, py), (sx, sy), edge.error, tuple(map(strand, below)))

    return [strand(edge) for edge in of.top()]


def apart(a: Strand, b: Strand) -> Bounds:
    """Return bounds of the distance of two strands."""
    from_a, from_b = min(a.far(b.p), a.far(b.s)), min(b.far(a.p), b.far(a.s))
    upper = min(_more(from_a, a.error), _more(from_b, b.error))
    p, s, u, v = integers([a.p, a.s, b.p, b.s])
    if {p, s} & {u, v}:
        upper = 0.0
    if not collision.meet((p, s), (u, v)):
        gap = min(from_a, from_b)
        least = math.nextafter(gap, 0.0) if gap > LEAST_ERROR else sys.float_info.min
        return Bounds(_less(least, _more(a.error, b.error)), upper)
    proper = orient(p, s, u) * orient(p, s, v) < 0 and orient(u, v, p) * orient(u, v, s) < 0
    if proper and from_a > a.error and from_b > b.error:
        return Bounds(0.0, 0.0, crosses=True)
    return Bounds(0.0, min(upper, _more(a.error, b.error)))


def approach(ones: list[Strand], others: list[Strand], within: float = math.inf) -> Bounds:
    """Return bounds of the distance of some strands from others; lower is inf if beyond `within`.

    The pairs of the cut that are within are all known if the bounds are exact.
    """
    found = list(_pairs(ones, others, 0.0, within))
    final = [here for here, is_last in found if is_last]
    upper = min((here.upper for here, _ in found), default=math.inf)
    lower = min((here.lower for here in final), default=math.inf) if upper else 0.0
    crosses = any(here.crosses for here, _ in found)
    return Bounds(lower, upper, crosses, all(here.exact for here in final))


def distance(ring: ArrayLike, x: float, y: float, **cut: float) -> tuple[float, float]:
    """Return bounds of the distance of (x, y) to the ring."""
    found = approach(strands(ring, **cut), [Strand((x, y), (x, y), 0.0)])
    return found.lower, found.upper


def intersects(ring: ArrayLike, x0: float, y0: float, x1: float, y1: float, **cut: float) -> int:
    """Whether the closed segment meets the ring: +1 yes, -1 no, 0 not decided."""
    found = approach(strands(ring, **cut), [Strand((x0, y0), (x1, y1), 0.0)], 0.0)
    return 1 if found.upper == 0 else -1 if found.lower == math.inf else 0


def contains_segment(
    ring: ArrayLike, x0: float, y0: float, x1: float, y1: float, **cut: float
) -> int:
    """Whether the closed segment lies in the closed object: +1 yes, -1 no, 0 not decided."""
    found = approach(strands(ring, **cut), [Strand((x0, y0), (x1, y1), 0.0)], 0.0)
    sides = side_at(ring, x0, y0, **cut), side_at(ring, x1, y1, **cut)
    if found.crosses or min(sides) < 0:
        return -1
    if found.lower == math.inf:
        return sides[0]
    if not found.exact:
        return 0
    return 1 if collision.contains_segment(ring, x0, y0, x1, y1) else -1


def collides(ring: ArrayLike, other: ArrayLike, **cut: float) -> int:
    """Whether the closed objects have a point in common: +1 yes, -1 no, 0 not decided."""
    found = approach(strands(ring, **cut), strands(other, **cut), 0.0)
    if found.upper == 0 or _holds(ring, other, cut) or _holds(other, ring, cut):
        return 1
    return -1 if found.lower == math.inf else 0


def clearance(ring: ArrayLike, other: ArrayLike, **cut: float) -> tuple[float, float]:
    """Return bounds of the distance of the closed objects."""
    if collides(ring, other, **cut) > 0:
        return 0.0, 0.0
    found = approach(strands(ring, **cut), strands(other, **cut))
    return found.lower, found.upper


def _holds(ring: ArrayLike, other: ArrayLike, cut: dict[str, float]) -> bool:
    """Whether the first vertex of the base of the other ring lies in the object for certain."""
    first = strands(other, level=0)[:1]
    return bool(len(np.asarray(ring)) and first and side_at(ring, *first[0].p, **cut) > 0)


def _pairs(
    ones: list[Strand] | tuple[Strand, ...],
    others: list[Strand] | tuple[Strand, ...],
    lower: float,
    within: float,
) -> Iterator[tuple[Bounds, bool]]:
    """Yield bounds of all pairs, and whether they are of the cut; no halves of pairs beyond."""
    for a, b in product(ones, others):
        here = apart(a, b)
        least = max(lower, here.lower)
        is_last = not a.halves and not b.halves and least <= within
        exact = a.error == b.error == 0
        yield Bounds(least, here.upper, here.crosses, exact), is_last
        if least <= within and (a.halves or b.halves):
            yield from _pairs(a.halves or (a,), b.halves or (b,), least, within)


def _less(a: float, b: float) -> float:
    return a if b == 0 else max(math.nextafter(a - b, -math.inf), 0.0)


def _more(a: float, b: float) -> float:
    return a + b if a == 0 or b == 0 else math.nextafter(a + b, math.inf)
