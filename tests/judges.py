"""Collision queries judged by fractions: one by one and all together, to the last bit."""

from __future__ import annotations

import numpy as np

import flintknap as fk
from flintknap import reference
from flintknap.reference import collision as exact
from strategies import Points, Segments


def sides(engine: fk.Engine, asked: Points) -> None:
    """Judge side and contains."""
    rows = np.searchsorted(engine.ids(), engine.boundary().ids)
    points = engine.points()
    expected = [reference.side(points, rows, x, y) for x, y in asked.tolist()]
    assert engine.side(asked).tolist() == expected
    assert [engine.side(x, y) for x, y in asked.tolist()] == expected
    assert engine.contains(asked).tolist() == [side >= 0 for side in expected]
    assert [engine.contains(x, y) for x, y in asked.tolist()] == [side >= 0 for side in expected]


def distances(engine: fk.Engine, asked: Points) -> None:
    """Judge distance and nearest."""
    boundary = engine.boundary()
    ring, ids = boundary.xy, [*boundary.ids.tolist(), *boundary.ids[:1].tolist()]
    told = engine.nearest(asked)
    assert engine.distance(asked).tolist() == told.distance.tolist()
    for i, (x, y) in enumerate(asked.tolist()):
        single = engine.nearest(x, y)
        assert engine.distance(x, y) == single.distance == told.distance[i]
        expected_x, expected_y, far, row = exact.nearest(ring, x, y)
        assert single.distance == far
        assert (single.start, single.stop) == ((-1, -1) if row < 0 else (ids[row], ids[row + 1]))
        np.testing.assert_equal([c[i] for c in told], list(single))
        if row >= 0:
            scale = max(abs(ring[row]).max(), abs(ring[(row + 1) % len(ring)]).max())
            np.testing.assert_allclose(
                [single.x, single.y], [expected_x, expected_y], rtol=2**-52, atol=scale * 2**-90
            )


def segments(engine: fk.Engine, segments: Segments) -> None:
    """Judge intersects, contains_segment, first_hit and crossings."""
    boundary = engine.boundary()
    ring, ids = boundary.xy, [*boundary.ids.tolist(), *boundary.ids[:1].tolist()]
    columns = segments.T
    meets, held = engine.intersects(*columns), engine.contains_segment(*columns)
    hits, found = engine.first_hit(*columns), engine.crossings(*columns)
    for i, segment in enumerate(segments.tolist()):
        expected = exact.crossings(ring, *segment)
        rows = found.segment == i
        edges = zip(found.start[rows].tolist(), found.stop[rows].tolist(), strict=True)
        assert found.t[rows].tolist() == [t for t, _ in expected]
        assert list(edges) == [(ids[row], ids[row + 1]) for _, row in expected]
        assert meets[i] == engine.intersects(*segment) == bool(expected)
        np.testing.assert_equal([c[i] for c in hits], list(engine.first_hit(*segment)))
        np.testing.assert_equal(hits.t[i], exact.first_hit(ring, *segment)[0])
        if expected:
            assert hits.start[i] == ids[expected[0][1]]
        inside = exact.contains_segment(ring, *segment)
        assert held[i] == engine.contains_segment(*segment) == (inside and len(ring) > 0)
