"""Independent judges: slow, exact, and written without a look at what they judge.

Predicates are determinants of Fractions, expanded as the textbook has it. Ties are broken by really
adding the infinitesimals: a determinant becomes its value followed by its derivatives by the
lifting of each point, from the smallest point on, and the first that is not zero decides. On these
stand a brute-force Delaunay triangulation, O(n^4); a local check of larger ones; and a constriction
that looks at every gate again before every step, O(n^2). Boundaries are judged by exact arithmetic
here and, where doubles are good enough for it, by shapely.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import combinations, pairwise
from math import lcm

import numpy as np
import shapely
from numpy.typing import NDArray

Points = NDArray[np.float64]
Ids = NDArray[np.int64]
Point = Sequence[float]


def sign(value: Fraction | int) -> int:
    return (value > 0) - (value < 0)


def determinant(rows: list[list[Fraction]]) -> Fraction:
    """Laplace expansion along the first column."""
    if not rows:
        return Fraction(1)
    minors = ([row[1:] for s, row in enumerate(rows) if s != r] for r in range(len(rows)))
    signs = (1 if r % 2 == 0 else -1 for r in range(len(rows)))
    return sum(
        (
            row[0] * s * determinant(minor)
            for row, s, minor in zip(rows, signs, minors, strict=True)
        ),
        Fraction(0),
    )


def orient(a: Point, b: Point, c: Point) -> int:
    """+1 if abc is counter-clockwise, 0 if the three lie on a line, -1 if clockwise."""
    return sign(determinant([[Fraction(p[0]), Fraction(p[1]), Fraction(1)] for p in (a, b, c)]))


def dot_and_cross(i: Point, j: Point, k: Point) -> tuple[Fraction, Fraction]:
    """Scalar and vector product of i - k and j - k."""
    (ix, iy), (jx, jy), (kx, ky) = ((Fraction(p[0]), Fraction(p[1])) for p in (i, j, k))
    return (
        (ix - kx) * (jx - kx) + (iy - ky) * (jy - ky),
        (ix - kx) * (jy - ky) - (iy - ky) * (jx - kx),
    )


def cotangent(i: Point, j: Point, k: Point) -> float:
    """Cotangent of the angle at k of the counter-clockwise triangle ijk, rounded once."""
    dot, cross = dot_and_cross(i, j, k)
    return float(dot / cross)


def in_circle(a: Point, b: Point, c: Point, d: Point) -> int:
    """+1 if d lies inside the circle of the counter-clockwise triangle abc, 0 on it, -1 outside."""
    return sign(determinant(lifted([a, b, c, d])))


def in_circle_perturbed(a: Point, b: Point, c: Point, d: Point) -> int:
    """The same with every point lifted by its infinitesimal, the smallest point by the largest."""
    points = [a, b, c, d]
    if result := in_circle(*points):
        return result
    for smallest in sorted(range(4), key=lambda p: tuple(points[p])):
        rows = lifted(points)
        for p, row in enumerate(rows):
            row[2] = Fraction(int(p == smallest))
        if result := sign(determinant(rows)):
            return result
    return 0


def lifted(points: Sequence[Point]) -> list[list[Fraction]]:
    """Rows x, y, x^2 + y^2, 1."""
    exact = [(Fraction(p[0]), Fraction(p[1])) for p in points]
    return [[x, y, x * x + y * y, Fraction(1)] for x, y in exact]


def delaunay(xy: Points) -> list[list[int]]:
    """Every triple that turns left round an empty perturbed circle, in canonical form. O(n^4)."""
    points = xy.tolist()
    rows = []
    for i, j, k in combinations(sorted(range(len(points)), key=points.__getitem__), 3):
        turn = orient(points[i], points[j], points[k])
        row = [i, j, k] if turn > 0 else [i, k, j]
        others = (p for p in range(len(points)) if p not in row)
        corners = [points[v] for v in row]
        if turn and all(in_circle_perturbed(*corners, points[p]) < 0 for p in others):
            rows.append(row)
    return sorted(rows)


def judge_triangulation(xy: Points, triangles: Ids) -> None:
    """Assert that the rows are the canonical triangulation of the set.

    Each turns left, every edge is used once in each direction or lies on the hull with all points
    on its left, the count is Euler's, and every edge passes the circle test, which is enough:
    locally Delaunay triangulations are Delaunay. O(n h) for h points on the hull.
    """
    points, whole = xy.tolist(), integers(xy)
    rows = triangles.tolist()
    assert rows == sorted(rows)
    apex: dict[tuple[int, int], int] = {}
    for i, j, k in rows:
        assert orient(points[i], points[j], points[k]) > 0
        assert points[i] == min(points[i], points[j], points[k])
        for edge, corner in (((i, j), k), ((j, k), i), ((k, i), j)):
            assert edge not in apex
            apex[edge] = corner
    border = [(i, j) for i, j in apex if (j, i) not in apex]
    assert all(turn(whole[i], whole[j], p) >= 0 for i, j in border for p in whole)
    assert {v for row in rows for v in row} == set(range(len(points)))
    assert len(rows) == 2 * len(points) - 2 - len(border)
    for (i, j), k in apex.items():
        if i < j and (j, i) in apex:
            assert in_circle_perturbed(*(points[v] for v in (i, j, k, apex[j, i]))) < 0


def constriction(xy: Points, triangles: Ids) -> tuple[list[int], list[tuple[int, int, int]]]:
    """Ring and gates removed, every gate of the current boundary looked at before each step."""
    points = xy.tolist()
    apex = {(row[s - 2], row[s - 1]): row[s] for row in triangles.tolist() for s in range(3)}
    step = {i: j for i, j in apex if (j, i) not in apex}
    ring = [min(step, key=points.__getitem__)]
    while step[ring[-1]] != ring[0]:
        ring.append(step[ring[-1]])
    captures = []
    while True:
        free = []
        for i, j in pairwise([*ring, ring[0]]):
            k = apex[i, j]
            if k not in ring:
                key = cotangent(points[i], points[j], points[k])
                free.append((key, points[k], points[i], points[j], (i, j, k)))
        if not free:
            return ring, captures
        i, j, k = min(free)[-1]
        ring.insert(ring.index(i) + 1, k)
        captures.append((i, j, k))


def integers(xy: Points) -> list[tuple[int, int]]:
    """The points times the common denominator of all coordinates."""
    exact = [(Fraction(x), Fraction(y)) for x, y in xy.tolist()]
    scale = lcm(*(v.denominator for p in exact for v in p))
    return [(int(x * scale), int(y * scale)) for x, y in exact]


def turn(a: tuple[int, int], b: tuple[int, int], c: tuple[int, int]) -> int:
    return (a[0] - c[0]) * (b[1] - c[1]) - (a[1] - c[1]) * (b[0] - c[0])


def on_segment(a: tuple[int, int], b: tuple[int, int], p: tuple[int, int]) -> bool:
    return turn(a, b, p) == 0 and min(a, b) <= p <= max(a, b)


def meet(a: tuple[int, int], b: tuple[int, int], c: tuple[int, int], d: tuple[int, int]) -> bool:
    """Whether the closed segments ab and cd have a point in common."""
    if on_segment(a, b, c) or on_segment(a, b, d) or on_segment(c, d, a) or on_segment(c, d, b):
        return True
    return (turn(a, b, c) > 0) != (turn(a, b, d) > 0) and (turn(c, d, a) > 0) != (turn(c, d, b) > 0)


def winding(ring: list[tuple[int, int]], p: tuple[int, int]) -> int:
    """How often a ring that avoids p runs round it, counter-clockwise."""
    total = 0
    for a, b in pairwise([*ring, ring[0]]):
        if a[1] <= p[1] < b[1] and turn(a, b, p) > 0:
            total += 1
        elif b[1] <= p[1] < a[1] and turn(a, b, p) < 0:
            total -= 1
    return total


def judge_boundary(xy: Points, ring: Ids, inside: Ids, status: str) -> None:
    """Assert, exactly: a simple counter-clockwise ring from the smallest point of the set, through
    every point that is not reported inside, and around every point that is. O(n^2).
    """
    whole = integers(xy)
    if status == "degenerate":
        assert len(ring) == len(inside) == 0
        assert all(turn(a, b, c) == 0 for a, b, c in zip(whole, whole[1:], whole[2:], strict=False))
        return
    assert status == ("locked" if len(inside) else "closed")
    assert sorted([*ring.tolist(), *inside.tolist()]) == list(range(len(whole)))
    assert whole[ring[0]] == min(whole)
    assert inside.tolist() == sorted(inside.tolist(), key=whole.__getitem__)
    corners = [whole[v] for v in ring.tolist()]
    sides = list(pairwise([*corners, corners[0]]))
    assert sum(a[0] * b[1] - a[1] * b[0] for a, b in sides) > 0
    for (a, b), (_, c) in pairwise([*sides, sides[0]]):
        assert not on_segment(a, b, c)
        assert not on_segment(b, c, a)
    for first, second in combinations(range(len(sides)), 2):
        if second - first not in (1, len(sides) - 1):
            assert not meet(*sides[first], *sides[second])
    for v in inside.tolist():
        assert not any(on_segment(a, b, whole[v]) for a, b in sides)
        assert winding(corners, whole[v]) == 1


def judge_boundary_by_shapely(xy: Points, ring: Ids, inside: Ids) -> None:
    """Assert the same in the opinion of GEOS, for points with which doubles are at ease."""
    polygon = shapely.Polygon(xy[ring])
    assert polygon.is_valid
    assert polygon.exterior.is_ccw
    assert not shapely.intersects_xy(polygon.exterior, *xy[inside].T).any()
    assert shapely.contains_xy(polygon, *xy[inside].T).all()
    assert len({*ring.tolist(), *inside.tolist()}) == len(ring) + len(inside) == len(xy)
