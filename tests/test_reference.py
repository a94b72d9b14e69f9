"""The reference against judges that share nothing with it, and against sets worked by hand."""

from __future__ import annotations

import hashlib
import math
import struct

import numpy as np
import pytest
from hypothesis import given, settings
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
    """Gabriel: no point inside the disc on ab. Hull: no point on one side, none between a and b."""
    points = xy.tolist()
    delaunay, gabriel, hull = (
        {(a, b) for a, b in reference.edges(xy, name).tolist()}
        for name in ("delaunay", "gabriel", "hull")
    )
    assert gabriel | hull <= delaunay
    for a in range(len(xy)):
        for b in range(a + 1, len(xy)):
            others = [p for c, p in enumerate(points) if c not in (a, b)]
            facing = [
                oracles.sign(oracles.dot_and_cross(points[a], points[b], p)[0]) for p in others
            ]
            turns = [oracles.orient(points[a], points[b], p) for p in others]
            if all(f > 0 for f in facing):
                assert (a, b) in gabriel
            assert ((a, b) in gabriel) == ((a, b) in delaunay and all(f >= 0 for f in facing))
            free = all(f > 0 for f, t in zip(facing, turns, strict=True) if t == 0)
            assert ((a, b) in hull) == (free and not {1, -1} <= set(turns))


@exhaustive
@given(strategies.scattered(12).map(strategies.distinct))
def test_gamma_meets_its_definition(xy):
    """From the largest angle under which a site on either side sees the edge."""
    points = xy.tolist()
    for a, b in reference.edges(xy, "delaunay").tolist():
        values = []
        for side in (1, -1):
            seen = [p for p in points if oracles.orient(points[a], points[b], p) == side]
            angles = [math.acos(cosine(points[a], points[b], p)) for p in seen]
            phi = max(angles, default=None)
            blunt = phi is not None and phi > math.pi / 2
            values.append(1.0 if phi is None else math.sin(phi) - 1 if blunt else 1 - math.sin(phi))
        gamma0, gamma1 = reference.gamma(xy, a, b)
        assert reference.gamma(xy, b, a) == (gamma0, gamma1)
        assert abs(gamma0) <= gamma1
        assert sorted(values) == pytest.approx([gamma0, gamma1], abs=1e-6)


def cosine(i, j, k):
    (x, y), (u, v) = (i[0] - k[0], i[1] - k[1]), (j[0] - k[0], j[1] - k[1])
    return max(-1.0, min(1.0, (x * u + y * v) / (math.hypot(x, y) * math.hypot(u, v))))


def test_square():
    """The smallest corner is cut off by the diagonal."""
    assert reference.triangulate(SQUARE).tolist() == [[0, 1, 3], [3, 1, 2]]
    found = reference.constrict(SQUARE)
    assert (found.ring.tolist(), found.status, found.captures) == ([0, 1, 2, 3], "closed", [])
    assert reference.edges(SQUARE, "gabriel").tolist() == [[0, 1], [0, 3], [1, 2], [1, 3], [2, 3]]
    assert reference.edges(SQUARE, "hull").tolist() == [[0, 1], [0, 3], [1, 2], [2, 3]]
    assert reference.gamma(SQUARE, 1, 3) == (0.0, 0.0)
    assert reference.gamma(SQUARE, 0, 1) == pytest.approx((1 - math.sqrt(0.5), 1.0), rel=1e-15)
    with pytest.raises(KeyError):
        reference.gamma(SQUARE, 0, 2)


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
    edges = {(a, b) for a, b in reference.edges(GRID, "delaunay").tolist()}
    assert {(a, b) for a, b in edges if b - a not in (1, 3)} == diagonals
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
    for name in ("delaunay", "gabriel", "hull"):
        assert reference.edges(xy, name).tolist() == expected
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


def test_unknown_graph():
    with pytest.raises(KeyError):
        reference.edges(SQUARE, "relative neighbour")


def test_digest_is_of_these_bytes():
    xy = np.array([(1, 0), (-0.0, 0), (0, 1)])
    ring = struct.pack("<6d", 0, 0, 1, 0, 0, 1)
    points = struct.pack("<6d", 0, 0, 0, 1, 1, 0)
    expected = hashlib.blake2b(b"flintknap 1\0closed\0" + ring + points, digest_size=16)
    assert reference.digest(xy) == expected.hexdigest()
    nothing = hashlib.blake2b(b"flintknap 1\0degenerate\0", digest_size=16)
    assert reference.digest(np.empty((0, 2))) == nothing.hexdigest()
