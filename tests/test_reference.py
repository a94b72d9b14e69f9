"""The reference against judges that share nothing with it, and against sets worked by hand."""

from __future__ import annotations

import hashlib
import math
import struct
from decimal import Decimal, localcontext
from itertools import combinations, permutations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from scipy.spatial import Delaunay

import oracles
import strategies
from flintknap import reference

exhaustive = settings(deadline=None, max_examples=150)

SQUARE = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float64)
CENTRED = np.array([(0, 0), (2, 0), (2, 2), (0, 2), (1, 1)], np.float64)
GRID = np.array([(x, y) for x in range(3) for y in range(3)], np.float64)
LINE = np.array([(2, 2), (0, 0), (3, 3), (1, 1)], np.float64)
LOCKED = np.array([(0, 0), (1, 1), (2, 1), (2, 5), (3, 0), (3, 2), (5, 0)], np.float64)


@exhaustive
@given(strategies.point_sets(8).map(strategies.distinct))
def test_triangulation_is_that_of_brute_force(xy):
    assert reference.triangulate(xy).tolist() == oracles.delaunay(xy)


@exhaustive
@given(strategies.point_sets(50).map(strategies.distinct))
def test_triangulation_is_canonical(xy):
    triangles = reference.triangulate(xy)
    if len(triangles):
        oracles.judge_triangulation(xy, triangles)


@pytest.mark.parametrize("seed", range(4))
def test_triangulation_is_that_of_scipy_where_it_is_unique(seed):
    xy = np.random.default_rng(seed).random((300, 2))
    found = {frozenset(row) for row in reference.triangulate(xy).tolist()}
    assert found == {frozenset(row) for row in Delaunay(xy).simplices.tolist()}


@exhaustive
@given(strategies.point_sets(40).map(strategies.distinct))
def test_boundary_is_simple_and_complete(xy):
    found = reference.constrict(xy)
    oracles.judge_boundary(xy, found.ring, found.inside, found.status)


@exhaustive
@given(strategies.point_sets(40).map(strategies.distinct))
def test_constriction_is_that_of_a_full_scan_before_every_step(xy):
    triangles = reference.triangulate(xy)
    if len(triangles):
        found = reference.constrict(xy, triangles)
        assert (found.ring.tolist(), found.captures) == oracles.constriction(xy, triangles)


@pytest.mark.parametrize("seed", range(10))
def test_boundary_in_the_opinion_of_shapely(seed):
    xy = np.random.default_rng(seed).normal(size=(300, 2))
    found = reference.constrict(xy)
    oracles.judge_boundary_by_shapely(xy, found.ring, found.inside)


@exhaustive
@given(strategies.point_sets(25).map(strategies.distinct))
def test_the_order_of_the_rows_does_not_matter(xy):
    order = np.lexsort((xy[:, 1], xy[:, 0]))
    found, again = reference.constrict(xy), reference.constrict(xy[order])
    assert found.ring.tolist() == order[again.ring].tolist()
    assert found.inside.tolist() == order[again.inside].tolist()
    assert found.status == again.status
    assert reference.digest(xy) == reference.digest(xy[order])


@exhaustive
@given(strategies.point_sets(25).map(strategies.distinct))
def test_side_is_that_of_the_removed_triangles(xy):
    """A point is inside exactly if a triangle that was not removed holds it."""
    triangles = reference.triangulate(xy)
    found = reference.constrict(xy, triangles)
    gone = {frozenset(gate) for gate in found.captures}
    for row in triangles.tolist():
        middle = xy[row].mean(axis=0)
        a, b, c = xy[row].tolist()
        if all(oracles.orient(p, q, middle) > 0 for p, q in ((a, b), (b, c), (c, a))):
            expected = -1 if frozenset(row) in gone else 1
            assert reference.side(xy, found.ring, *middle) == expected


@exhaustive
@given(strategies.point_sets(15).map(strategies.distinct))
def test_graphs_meet_their_definitions(xy):
    """Gabriel: no point inside the disc on ab. Hull: no point on one side, none between a and b.
    Delaunay: nobody on the other side is in the disc of those who see ab under the largest angle.
    """
    points = xy.tolist()
    graph = {
        name: {(a, b) for a, b in reference.edges(xy, *reference.GRAPHS[name]).tolist()}
        for name in ("delaunay", "gabriel", "hull", "complete", "void")
    }
    for a, b in combinations(range(len(xy)), 2):
        others = [p for c, p in enumerate(points) if c not in (a, b)]
        facing = [oracles.sign(oracles.dot_and_cross(points[a], points[b], p)[0]) for p in others]
        turns = [oracles.orient(points[a], points[b], p) for p in others]
        free = all(f > 0 for f, t in zip(facing, turns, strict=True) if t == 0)
        left = [p for p, t in zip(others, turns, strict=True) if t > 0]
        right = [p for p, t in zip(others, turns, strict=True) if t < 0]
        met = any(
            all(oracles.in_circle(points[a], points[b], p, q) <= 0 for q in left + right)
            for p in left
        )
        assert ((a, b) in graph["complete"]) == free
        assert ((a, b) in graph["gabriel"]) == all(f >= 0 for f in facing)
        assert ((a, b) in graph["hull"]) == (free and not {1, -1} <= set(turns))
        assert ((a, b) in graph["void"]) == (free and not {1, -1} & set(turns))
        assert ((a, b) in graph["delaunay"]) == (free and (met or not left or not right))


@exhaustive
@given(strategies.scattered(10).map(strategies.distinct))
def test_gamma_meets_its_definition(xy):
    """From the largest angle under which a site on either side sees the pair."""
    points = xy.tolist()
    for a, b in combinations(range(len(xy)), 2):
        gamma0, gamma1 = reference.gamma(xy, a, b)
        if math.isnan(gamma0):
            continue
        values = []
        for side in (1, -1):
            seen = [p for p in points if oracles.orient(points[a], points[b], p) == side]
            angles = [math.acos(cosine(points[a], points[b], p)) for p in seen]
            phi = max(angles, default=None)
            blunt = phi is not None and phi > math.pi / 2
            values.append(1.0 if phi is None else math.sin(phi) - 1 if blunt else 1 - math.sin(phi))
        assert abs(gamma0) <= abs(gamma1)
        assert sorted(values) == pytest.approx(sorted([gamma0, gamma1]), abs=1e-6)


def cosine(i, j, k):
    (x, y), (u, v) = (i[0] - k[0], i[1] - k[1]), (j[0] - k[0], j[1] - k[1])
    return max(-1.0, min(1.0, (x * u + y * v) / (math.hypot(x, y) * math.hypot(u, v))))


@exhaustive
@given(strategies.point_sets(6).map(strategies.distinct))
def test_values_are_right_to_the_last_bits(xy):
    """Against a thousand digits, for angles close to none, to right ones and to straight ones."""
    a, b, c = np.concatenate((xy, [(0.0, 0.0), (1.0, 0.0), (0.5, 2.0)]))[:3].tolist()
    dot, cross = oracles.dot_and_cross(a, b, c)
    assume(cross != 0)
    with localcontext() as context:
        context.prec = 1000
        across, along = (Decimal(v.numerator) / Decimal(v.denominator) for v in (cross, dot))
        value = 1 - abs(across) / (across**2 + along**2).sqrt()
        gamma0, gamma1 = reference.gamma([a, b, c], 0, 1)
        assert gamma1 == 1
        assert (gamma0 < 0) == (dot < 0)
        assert abs(Decimal(abs(gamma0)) - value) <= value * Decimal(2) ** -49 + Decimal("1e-307")


def test_square():
    """The smallest corner is cut off by the diagonal."""
    assert reference.triangulate(SQUARE).tolist() == [[0, 1, 3], [3, 1, 2]]
    found = reference.constrict(SQUARE)
    assert (found.ring.tolist(), found.status, found.captures) == ([0, 1, 2, 3], "closed", [])
    sides, diagonals = [[0, 1], [0, 3], [1, 2], [2, 3]], [[0, 2], [1, 3]]
    assert graph(SQUARE, "gabriel") == graph(SQUARE, "delaunay") == sorted(sides + diagonals)
    assert graph(SQUARE, "hull") == sides
    assert reference.gamma(SQUARE, 1, 3) == reference.gamma(SQUARE, 0, 2) == (0.0, 0.0)
    assert reference.gamma(SQUARE, 0, 1) == pytest.approx((1 - math.sqrt(0.5), 1.0), rel=1e-15)


def graph(xy, name):
    return reference.edges(xy, *reference.GRAPHS[name]).tolist()


def test_square_with_centre():
    """Four gates with one key and one apex: the one from the smallest corner is first."""
    assert reference.triangulate(CENTRED).tolist() == [[0, 1, 4], [0, 4, 3], [3, 4, 2], [4, 1, 2]]
    found = reference.constrict(CENTRED)
    assert found.captures == [(0, 1, 4)]
    assert found.ring.tolist() == [0, 4, 1, 2, 3]
    assert reference.gamma(CENTRED, 0, 1) == (0.0, 1.0)


def test_grid():
    """All diagonals fall; of four gates with 45 degrees at the centre that of (0, 2) is first."""
    diagonals = {(1, 3), (2, 4), (4, 6), (5, 7)}
    sides = {
        (a, b) for row in reference.triangulate(GRID).tolist() for a, b in permutations(row, 2)
    }
    assert {(a, b) for a, b in sides if b > a and b - a not in (1, 3)} == diagonals
    found = reference.constrict(GRID)
    assert found.captures == [(2, 1, 4)]
    assert found.ring.tolist() == [0, 3, 6, 7, 8, 5, 2, 4, 1]
    assert reference.hull(GRID).tolist() == [0, 3, 6, 7, 8, 5, 2, 1]
    queries = {(0, 0): 0, (0.5, 0.5): 1, (0.25, 1.5): -1, (0.5, 1.5): 0, (0, 1.5): -1, (3, 1): -1}
    for (x, y), expected in queries.items():
        assert reference.side(GRID, found.ring, x, y) == expected


@pytest.mark.parametrize("xy", [LINE, LINE[:2], LINE[:1], LINE[:0]])
def test_points_on_a_line(xy):
    assert reference.triangulate(xy).shape == (0, 3)
    assert reference.hull(xy).shape == (0,)
    found = reference.constrict(xy)
    assert (found.status, len(found.ring), len(found.inside)) == ("degenerate", 0, 0)
    assert reference.side(xy, found.ring, 2, 2) == -1
    expected = {4: [[0, 2], [0, 3], [1, 3]], 2: [[0, 1]], 1: [], 0: []}[len(xy)]
    for name in reference.GRAPHS:
        assert graph(xy, name) == expected
    for a, b in expected:
        assert reference.gamma(xy, a, b) == (1.0, 1.0)


def test_locked():
    """Point 2 has neighbours 1, 4, 5, and all are captured before a gate opens that leads to it."""
    assert [row for row in reference.triangulate(LOCKED).tolist() if 2 in row] == [
        [1, 2, 5],
        [1, 4, 2],
        [2, 4, 5],
    ]
    found = reference.constrict(LOCKED)
    assert found.captures == [(6, 3, 5), (3, 0, 1)]
    assert found.ring.tolist() == [0, 4, 6, 5, 3, 1]
    assert found.inside.tolist() == [2]
    assert found.status == "locked"
    assert reference.side(LOCKED, found.ring, 2, 1) == 1


def test_ties_of_keys_go_by_the_apex_first():
    """Of equal angles below and on the left (1, 2) is captured first, though its gate is later."""
    xy = np.array([(0, 0), (4, 0), (4, 4), (0, 4), (2, 1), (1, 2)])
    assert reference.constrict(xy).captures == [(3, 0, 5), (0, 1, 4)]


def test_an_obtuse_and_an_acute_angle_on_one_circle():
    """Their magnitudes tie; the negative one is gamma0."""
    xy = np.array([(0, -1), (0, 1), (-0.5, 0), (2, 0)])
    assert reference.gamma(xy, 0, 1) == pytest.approx((-0.2, 0.2), rel=1e-15)


def test_digest_is_of_these_bytes():
    xy = np.array([(1, 0), (-0.0, 0), (0, 1)])
    ring = struct.pack("<6d", 0, 0, 1, 0, 0, 1)
    points = struct.pack("<6d", 0, 0, 0, 1, 1, 0)
    expected = hashlib.blake2b(b"flintknap 1\0closed\0" + ring + points, digest_size=16)
    assert reference.digest(xy) == expected.hexdigest()
    nothing = hashlib.blake2b(b"flintknap 1\0degenerate\0", digest_size=16)
    assert reference.digest(np.empty((0, 2))) == nothing.hexdigest()
