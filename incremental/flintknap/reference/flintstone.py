"""The tree of Flintstones over a ring, and the tree for tolerances, from scratch.

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
    Tolerance. Approximations within a tolerance come from a tree of their own, from the same base:
              a polyline is split at the vertex farthest from its chord (equal errors by
              coordinates), as Douglas and Peucker did, and has no discs.

A disc through p and s is known by the cotangent of the angle on its rim, left of the chord: its
centre is so many half chords to the left of the chord's middle. Seen from the right the same circle
has the opposite cotangent. Hence t_left = cot at q, t_right = -cot at r, and t_left <= t_right.

Cost: a polyline is scanned from end to end, so the whole tree is O(n^2) in the worst case; the
smallest disc O(h^4) for h points on the hull.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
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
        left: place of the vertex that gives the left disc, None where there is none, and in the
            tree for tolerances.
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


Made = Callable[[list[Site], Fraction, Edge, list[int]], Edge]


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


def approximate(
    ring: ArrayLike, level: float = math.inf, tolerance: float | None = None
) -> list[Edge]:
    """Edges of an approximation of a ring (n, 2), in order, from the smallest vertex on.

    Without a tolerance those of the tree of Flintstones down to a level; with one, those of the
    tree for tolerances. Section 4.1.
    """
    return _cut(tree(ring, tolerance), level, tolerance)


def localize(
    ring: ArrayLike, level: float = math.inf, tolerance: float | None = None
) -> list[Edge]:
    """Edges of the tree of Flintstones, in order, from the smallest vertex on.

    An edge above `level` is split, while its error is beyond the tolerance if there is one.
    Section 4.1.
    """
    return _cut(tree(ring), level, tolerance)


class Tree:
    """One of the two trees over a ring (n, 2): edges of level 0, and the halves of each."""

    def __init__(self, ring: ArrayLike, made: Made) -> None:
        self.xy = np.asarray(ring, np.float64).reshape(-1, 2).tolist()
        self.sites = integers(ring)
        self._made = made

    def top(self) -> list[Edge]:
        """Return the two edges of level 0, none of an empty ring."""
        if not self.xy:
            return []
        first, second = base(self.xy)
        return [self._edge(first, second, 0), self._edge(second, first, 0)]

    def halves(self, edge: Edge) -> list[Edge]:
        """Return the two edges into which one is split."""
        assert edge.split is not None
        level = edge.level + 1
        return [self._edge(edge.start, edge.split, level), self._edge(edge.split, edge.stop, level)]

    def _edge(self, start: int, stop: int, level: int) -> Edge:
        count = len(self.xy)
        between = [(start + n) % count for n in range(1, (stop - start) % count)]
        edge = Edge(start, stop, level, None, None, None, 0.0)
        return self._made(self.sites, _unit(self.xy), edge, between) if between else edge


def tree(ring: ArrayLike, tolerance: float | None = None) -> Tree:
    """Return the tree of Flintstones, or if there is a tolerance, the one for tolerances."""
    return Tree(ring, _flintstone if tolerance is None else _farthest)


def is_final(edge: Edge, level: float, tolerance: float | None) -> bool:
    """Whether a cut goes no further down than this edge."""
    kept = tolerance is not None and edge.error <= tolerance
    return edge.split is None or edge.level >= level or kept


def _cut(of: Tree, level: float, tolerance: float | None) -> list[Edge]:
    todo, edges = of.top()[::-1], []
    while todo:
        edge = todo.pop()
        if is_final(edge, level, tolerance):
            edges.append(edge)
        else:
            todo += of.halves(edge)[::-1]
    begin = min(range(len(edges)), key=lambda e: of.sites[edges[e].start], default=0)
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


def side_at(
    ring: ArrayLike, x: float, y: float, level: float = math.inf, tolerance: float | None = None
) -> int:
    """+1 inside, -1 outside, 0 where an approximation does not tell.

    That is where (x, y) is no farther from one of its edges than the edge's error, in the tree of
    Flintstones in the Flintstone, too, and so for all edges above. Section 4.1.
    """
    of = tree(ring, tolerance)
    todo = of.top()
    while todo:
        edge = todo.pop()
        ends = of.xy[edge.start], of.xy[edge.stop]
        near = distance_up(*ends, (x, y)) <= edge.error
        if tolerance is None:
            near = near and in_flintstone(ring, edge, x, y)
        if near and is_final(edge, level, tolerance):
            return 0
        if near:
            todo += of.halves(edge)
    return side(ring, range(len(of.xy)), x, y) if of.xy else -1


def distance_up(p: Sequence[float], s: Sequence[float], v: Sequence[float]) -> float:
    """Return the distance of v to the segment ps, which may be a point, rounded up."""
    xy = [[*p], [*s], [*v]]
    square = _distance_squared(*integers(xy))
    return _root_up(square * _unit(xy) ** 2)


def _flintstone(sites: list[Site], unit: Fraction, edge: Edge, between: list[int]) -> Edge:
    """Return what is known of the polyline of an edge, in the tree of Flintstones."""
    p, s = sites[edge.start], sites[edge.stop]
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
    error = _farthest(sites, unit, edge, between).error
    return replace(edge, left=left, right=right, split=split, error=error)


def _farthest(sites: list[Site], unit: Fraction, edge: Edge, between: list[int]) -> Edge:
    """Return the same in the tree for tolerances."""
    p, s = sites[edge.start], sites[edge.stop]
    squares = {v: _distance_squared(p, s, sites[v]) * unit * unit for v in between}
    error = _root_up(max(squares.values()))
    # All whose distance is rounded up to the same number are equally far.
    less = Fraction(0 if error <= LEAST_ERROR else math.nextafter(error, 0.0)) ** 2
    farthest = [v for v in between if squares[v] > less or error == 0]
    return replace(edge, split=min(farthest, key=sites.__getitem__), error=error)


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
