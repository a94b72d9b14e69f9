"""Point sets and histories for hypothesis: the generic, the degenerate and what lies a bit between.

Every point set is a float64 (n, 2) array of admissible coordinates; points may repeat, unless
`distinct` has passed over it. Shrinking leads to few points with small integer coordinates.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import isqrt
from typing import Literal, TypeVar

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy
from numpy.typing import NDArray

Points = NDArray[np.float64]
Segments = NDArray[np.float64]  # (n, 4)
# "one" point or a "batch" arrives; "look" asks for the triangles alone, "ask" for everything.
Operation = tuple[Literal["one", "batch", "look", "ask"], Points]

T = TypeVar("T")

MIN_MAGNITUDE, MAX_MAGNITUDE = 1e-60, 1e60


def admissible(values: Points) -> NDArray[np.bool_]:
    """Where the engine takes a coordinate: 0, or of a magnitude within its range."""
    size = np.abs(values)
    return (size == 0) | ((size >= MIN_MAGNITUDE) & (size <= MAX_MAGNITUDE))


def distinct(xy: Points) -> Points:
    """Each point once, in order of first appearance; -0.0 is 0.0."""
    return np.array(list(dict.fromkeys(map(tuple, (xy + 0.0).tolist()))), np.float64).reshape(-1, 2)


def array(points: list[tuple[float, float]]) -> Points:
    return np.array(points, np.float64).reshape(-1, 2)


def nudged(xy: Points, ulps: Points) -> Points:
    """Each coordinate moved by so many steps of one last bit; steps away from 0.0 are left out."""
    for _ in range(int(np.abs(ulps).max(initial=0))):
        toward = np.where(ulps > 0, np.inf, -np.inf)
        xy = np.where((ulps != 0) & (xy != 0), np.nextafter(xy, toward), xy)
        ulps = ulps - np.sign(ulps)
    return xy


def many(elements: SearchStrategy[T], size: int) -> SearchStrategy[list[T]]:
    """Up to `size` elements, long lists as likely as short ones."""
    return st.integers(0, size).flatmap(lambda n: st.lists(elements, min_size=n, max_size=n))


units = st.floats(-1, 1, width=32) | st.floats(-1, 1)
coordinates = units.map(lambda v: v if abs(v) >= MIN_MAGNITUDE else 0.0)
small = st.integers(-3, 3)
generators = st.integers(0, 2**32).map(np.random.default_rng)


@st.composite
def scattered(draw: DrawFn, size: int) -> Points:
    """Anywhere in the unit square, with all bits used or with few."""
    if draw(st.booleans()):
        rng, count = draw(generators), draw(st.integers(0, size))
        return rng.uniform(-1, 1, (count, 2))
    return array(draw(many(st.tuples(coordinates, coordinates), size)))


@st.composite
def clustered(draw: DrawFn, size: int) -> Points:
    """Tight clouds far apart, each with a spread of its own."""
    rng = draw(generators)
    clouds = draw(st.lists(st.tuples(small, small, st.integers(-30, -1)), min_size=1, max_size=4))
    each = draw(st.integers(0, size // len(clouds)))
    return np.concatenate([rng.normal((x, y), 2.0**e, (each, 2)) for x, y, e in clouds])


@st.composite
def collinear(draw: DrawFn, size: int) -> Points:
    """Exactly on a line, at uneven steps, in any order."""
    x, y, dx, dy = (draw(small) for _ in range(4))
    steps = np.array(draw(many(st.integers(-20, 20), size)), np.float64)
    scale = 2.0 ** draw(st.integers(-40, 40))
    return scale * np.column_stack([x + dx * steps, y + dy * steps])


@st.composite
def nearly_collinear(draw: DrawFn, size: int) -> Points:
    """On a line of no simple slope, rounded, and some coordinates moved by a last bit."""
    slope = draw(st.sampled_from([0.1, 1 / 3, 1.0, 1e-8, 12345.678]))
    steps = np.array(draw(many(st.integers(1, 200), size)), np.float64)
    return draw(last_bits(np.column_stack([steps / 7, slope * steps / 7])))


@st.composite
def last_bits(draw: DrawFn, xy: Points) -> Points:
    """The points, some of them moved by a last bit or two."""
    ulps = draw(st.lists(st.sampled_from([0, 0, 1, -1, 2]), min_size=xy.size, max_size=xy.size))
    return nudged(xy, np.array(ulps, np.float64).reshape(xy.shape))


@st.composite
def last_bit_apart(draw: DrawFn, size: int) -> Points:
    """A few points and, a last bit or two beside them, others."""
    few = st.sampled_from(draw(st.lists(st.tuples(small, small), min_size=1, max_size=3)))
    scale = draw(st.sampled_from([1.0, 0.1, 1 / 3, 1e40]))
    return draw(last_bits(scale * array(draw(many(few, size)))))


def on_circle(radius: int) -> list[tuple[float, float]]:
    """All integer points at an integer distance from the origin."""
    legs = [(x, isqrt(radius**2 - x**2)) for x in range(-radius, radius + 1)]
    right = [(x, y) for x, y in legs if x * x + y * y == radius**2]
    return sorted({(float(x), float(s * y)) for x, y in right for s in (1, -1)})


ON_CIRCLE = on_circle(65)  # 36, by 5 and 13 being hypotenuses


@st.composite
def cocircular(draw: DrawFn, size: int) -> Points:
    """Integer points on one circle, shifted and scaled exactly, perhaps with its centre."""
    chosen = draw(many(st.sampled_from([*ON_CIRCLE, (0.0, 0.0)]), size))
    shift = array([(draw(small), draw(small))])
    return (array(chosen) + shift) * 2.0 ** draw(st.sampled_from([-60, 0, 60]))


@st.composite
def gridded(draw: DrawFn, size: int) -> Points:
    """A full grid, shuffled, or some points of one."""
    width = draw(st.integers(1, 8))
    height = draw(st.integers(1, max(1, size // width)))
    cells = [(float(x), float(y)) for x in range(width) for y in range(height)]
    if draw(st.booleans()):
        return draw(generators).permutation(array(cells))
    return array(draw(many(st.sampled_from(cells), size)))


@st.composite
def repeating(draw: DrawFn, size: int) -> Points:
    """Few points, many times, signed zeros among them."""
    few = draw(st.lists(st.tuples(coordinates, coordinates), min_size=1, max_size=6))
    return array(draw(many(st.sampled_from([*few, (0.0, -0.0), (-0.0, 0.0)]), size)))


@st.composite
def extreme(draw: DrawFn, size: int) -> Points:
    """Both ends of the admissible range, and what lies between, in one set."""
    sizes = st.sampled_from([0.0, 1e-60, 2e-60, 3.3e-59, 1e-30, 1.0, 1 + 2**-52, 1e30, 7e59, 1e60])
    values = st.builds(lambda size, positive: size if positive else -size, sizes, st.booleans())
    return array(draw(many(st.tuples(values, values), size)))


FAMILIES: list[Callable[[int], SearchStrategy[Points]]] = [
    scattered,
    clustered,
    collinear,
    nearly_collinear,
    last_bit_apart,
    cocircular,
    gridded,
    repeating,
    extreme,
]


@st.composite
def point_sets(draw: DrawFn, size: int = 40) -> Points:
    """One family, or two in one set, in any order; up to `size` points, repeats included."""
    count = draw(st.integers(1, 2))
    parts = [draw(draw(st.sampled_from(FAMILIES))(size // count)) for _ in range(count)]
    xy = np.concatenate(parts)
    xy = np.where(admissible(xy), xy, 0.0)
    return draw(generators).permutation(xy)


@st.composite
def histories(draw: DrawFn, size: int = 40) -> list[Operation]:
    """A point set arriving one by one and in batches, with questions in between and at the end."""
    xy = draw(point_sets(size))
    cuts = sorted(draw(st.sets(st.integers(0, len(xy)), max_size=8)))
    operations: list[Operation] = []
    for start, stop in pairwise([0, *cuts, len(xy)]):
        manner = draw(st.sampled_from(["batch", "one", "look"]))
        if manner == "batch":
            operations.append(("batch", xy[start:stop]))
        for row in range(start, stop if manner != "batch" else start):
            operations.append(("one", xy[row : row + 1]))
            if manner == "look":
                operations.append(("look", xy[:0]))
        if draw(st.booleans()):
            operations.append(("ask", xy[:0]))
    return [*operations, ("ask", xy[:0])]


@st.composite
def at_offset(draw: DrawFn, size: int) -> Points:
    """Tight clusters far from the origin: neighbours are one to some doubles apart."""
    corner = array(
        [(draw(st.sampled_from([1e6, -1e6, 1e6 + 1e-3])), draw(st.sampled_from([1e6, 7])))]
    )
    steps = draw(many(st.tuples(st.integers(0, 6), st.integers(0, 6)), size))
    return corner + array(steps) * 2.0**-33


FAMILIES.append(at_offset)


@st.composite
def places(draw: DrawFn, points: Points, size: int = 8) -> Points:
    """Where it matters: at points, a bit beside them, between them, on their lines, anywhere."""
    pool = points if len(points) else np.zeros((1, 2))
    row = st.integers(0, len(pool) - 1)
    chosen = []
    for _ in range(draw(st.integers(1, size))):
        a, b = pool[draw(row)], pool[draw(row)]
        kind = draw(st.sampled_from(["at", "beside", "between", "along", "mixed", "any"]))
        if kind == "at":
            p = a
        elif kind == "beside":
            p = nudged(a, np.array([draw(st.integers(-2, 2)), draw(st.integers(-2, 2))], float))
        elif kind == "between":
            p = a / 2 + b / 2
        elif kind == "along":
            p = a + draw(st.sampled_from([-1.0, 0.25, 2.0])) * (b - a)
        elif kind == "mixed":
            p = np.array([a[0], b[1]])
        else:
            p = np.array([draw(coordinates), draw(coordinates)])
        chosen.append(np.where(admissible(p), p, 0.0))
    return np.array(chosen)


@st.composite
def segments(draw: DrawFn, points: Points, size: int = 10) -> Segments:
    """Between such places: on, along and beside edges, through vertices, of no length."""
    ends = draw(places(points, size))
    rows = st.integers(0, len(ends) - 1)
    chosen = draw(st.lists(st.tuples(rows, rows), min_size=1, max_size=size))
    return np.array([[*ends[i], *ends[j]] for i, j in chosen])
