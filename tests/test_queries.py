"""All queries while the object changes under them, and against GEOS where lines and points meet.

What is kept from one question to the next (cells.hpp) must follow every change: of small sets
fractions judge, of large ones an engine made from scratch, and GEOS.
"""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

import flintknap as fk
import judges
import strategies
from flintknap.reference import collision as exact
from strategies import Points, Segments


def made(points: Points) -> fk.Engine:
    engine = fk.Engine()
    engine.insert(points)
    return engine


def wavy(n: int, seed: int, noise: float) -> Points:
    rng = np.random.default_rng(seed)
    t = 2 * np.pi * (np.arange(n) + rng.random(n)) / n
    radius = 1 + 0.3 * np.sin(5 * t) + rng.normal(0, noise, n)
    return rng.permutation(np.column_stack([radius * np.cos(t), radius * np.sin(t)]))


# ---------------------------------------------------------------------- through changes
@settings(deadline=None, max_examples=60)
@given(strategies.histories(30), st.data())
def test_every_answer_is_exact_after_every_change(
    history: list[strategies.Operation], data: st.DataObject
) -> None:
    engine, other = fk.Engine(), made(np.array([(0.0, 0.0), (1.0, 0.5), (0.25, 1.0)]))
    ids: list[int] = []
    for kind, xy in history:
        if kind in ("one", "batch"):
            ids += np.atleast_1d(engine.insert(xy)).tolist()
        if ids and data.draw(st.booleans()):
            engine.remove(ids.pop(data.draw(st.integers(0, len(ids) - 1))))
        if kind != "ask":
            continue
        points = engine.points()
        asked = data.draw(strategies.places(points, 4))
        judges.sides(engine, asked)
        judges.distances(engine, asked)
        judges.segments(engine, data.draw(strategies.segments(points, 4)))
        rings = engine.boundary().xy, other.boundary().xy
        assert engine.collides(other) == other.collides(engine) == exact.collides(*rings)
        assert engine.clearance(other) == other.clearance(engine) == exact.clearance(*rings)
        engine.check()


def same_answers(engine: fk.Engine, fresh: fk.Engine, asked: Points, ends: Segments) -> None:
    """One by one of one engine, all at once of the other."""
    np.testing.assert_array_equal([engine.side(x, y) for x, y in asked.tolist()], fresh.side(asked))
    np.testing.assert_array_equal(engine.side(asked), fresh.side(asked))
    np.testing.assert_array_equal(
        [engine.distance(x, y) for x, y in asked.tolist()], fresh.distance(asked)
    )
    for mine, theirs in zip(engine.nearest(asked)[:3], fresh.nearest(asked)[:3], strict=True):
        np.testing.assert_array_equal(mine, theirs)
    columns = ends.T
    np.testing.assert_array_equal(
        [engine.intersects(*each) for each in ends.tolist()], fresh.intersects(*columns)
    )
    np.testing.assert_array_equal(
        [engine.contains_segment(*each) for each in ends.tolist()], fresh.contains_segment(*columns)
    )
    np.testing.assert_array_equal(engine.first_hit(*columns).t, fresh.first_hit(*columns).t)
    np.testing.assert_array_equal(engine.crossings(*columns).t, fresh.crossings(*columns).t)


def around(engine: fk.Engine, rng: np.random.Generator, new: Points) -> tuple[Points, Segments]:
    """Places everywhere, at vertices, and where it has changed; segments of all lengths there."""
    ring = engine.boundary().xy
    low, high = engine.points().min(axis=0), engine.points().max(axis=0)
    near = new[rng.integers(len(new), size=10)] + rng.normal(0, 0.02, (10, 2))
    asked = np.concatenate(
        [rng.uniform(low - 0.1, high + 0.1, (25, 2)), ring[rng.integers(len(ring), size=5)], near]
    )
    turn = rng.uniform(0, 2 * np.pi, len(asked))
    length = 10.0 ** rng.uniform(-4, 0.5, len(asked))
    stop = asked + (length * np.array([np.cos(turn), np.sin(turn)])).T
    stop[:3] = asked[:3]  # of no length
    stop[-3:] = ring[:3]
    return asked, np.column_stack([asked, stop])


@pytest.mark.parametrize("noise", [0.0, 0.003, 0.3])
def test_answers_follow_changes_of_large_objects(noise: float) -> None:
    points, rng = wavy(4000, 12, noise), np.random.default_rng(int(1000 * noise))
    engine = made(points[:2500])
    for step in range(50):
        new = points[2500 + 7 * step :][:7]
        kind = step % 10
        if kind < 3:
            new = new[:1]
            engine.insert(*new[0].tolist())
        elif kind < 5:
            engine.remove(rng.choice(engine.ids(), 3, replace=False))
        elif kind < 7:
            engine.move(int(rng.choice(engine.ids())), *new[0].tolist())
        elif kind == 7:
            engine.insert(new)
        elif kind == 8:
            engine.insert(*(3 * new[0]).tolist())  # beyond all others
        else:
            engine.remove(engine.find(3 * points[2500 + 7 * (step - 1) :][:1]))
        fresh, (asked, ends) = made(engine.points()), around(engine, rng, new)
        same_answers(engine, fresh, asked, ends)
        if step % 10 == 0:
            engine.check()
            polygon = shapely.Polygon(engine.boundary().xy)
            covered = shapely.intersects_xy(polygon, asked)
            np.testing.assert_array_equal(engine.contains(asked), covered)
    engine.check()


def test_an_object_that_grows_and_shrinks_by_orders_of_magnitude() -> None:
    rng = np.random.default_rng(3)
    engine, spread = fk.Engine(), [1.0, 1e-6, 1e6, 1e-3, 1e3]
    for size in spread:
        ids = engine.insert(size * wavy(1200, 5, 0.01))
        asked, ends = around(engine, rng, size * np.eye(2))
        same_answers(engine, made(engine.points()), asked, ends)
        asked, ends = around(engine, rng, size * np.eye(2))
        same_answers(engine, made(engine.points()), size * asked, size * ends)
        engine.check()
        engine.remove(ids[: len(ids) // 2])
    engine.clear()
    assert engine.side(0.0, 0.0) == -1
    assert not engine.intersects(0.0, 0.0, 1.0, 1.0)


@pytest.mark.parametrize(
    ("offset", "size", "noise"), [(0, 1, 0.3), (0, 1e-9, 0.01), (1e6, 1, 0.1), (-1e15, 1e3, 0.1)]
)
def test_places_asked_about_again_and_again(offset: float, size: float, noise: float) -> None:
    """Cells that are asked about often are drawn; many places at once, and crossings, ask none."""
    rng = np.random.default_rng(7)
    engine = made(offset + size * wavy(2000, 6, noise))
    for step in range(4):
        ring = engine.boundary().xy
        at = ring[rng.integers(len(ring), size=150)]
        asked = at + size * rng.choice([0, 0.003, 0.03, 0.3]) * rng.normal(size=at.shape)
        to = asked + size * rng.choice([0.001, 0.03, 0.3]) * rng.normal(size=at.shape)
        ends = np.concatenate([asked, to], axis=1)
        sides = engine.side(asked).tolist()
        meets = np.bincount(engine.crossings(*ends.T).segment, minlength=len(ends)) > 0
        held = made(engine.points()).contains_segment(*ends.T)
        for _ in range(6):
            assert [engine.side(x, y) for x, y in asked.tolist()] == sides
            assert [engine.contains(x, y) for x, y in asked.tolist()] == [s >= 0 for s in sides]
            assert engine.intersects(*ends.T).tolist() == meets.tolist()
            assert engine.contains_segment(*ends.T).tolist() == held.tolist()
        engine.check()
        if step % 2 == 0:
            engine.insert(at[:3] + size * 0.01)
        else:
            engine.remove(rng.choice(engine.ids(), 3, replace=False))


@pytest.mark.parametrize("offset", [0.0, 1e6, -1e15])
def test_objects_far_from_the_origin(offset: float) -> None:
    rng = np.random.default_rng(2)
    engine = made(offset + 1000 * wavy(1500, 2, 0.01))
    asked, ends = around(engine, rng, np.full((1, 2), offset))
    fresh = made(engine.points()[::-1])
    same_answers(engine, fresh, asked, ends)
    engine.check()


# ---------------------------------------------------------------------- GEOS, on a grid
# With small integers GEOS errs nowhere: ends on edges and vertices, overlaps, tangents, points.
def on_grid(rng: np.random.Generator) -> Points:
    width = int(rng.integers(3, 12))
    chosen = rng.integers(0, width, (int(rng.integers(1, 60)), 2)).astype(np.float64)
    return np.concatenate([chosen, [[0.0, 0.0], [width, 1.0], [1.0, width]]])


def lines(ends: Segments) -> list[shapely.Geometry]:
    return [
        shapely.Point(a, b) if (a, b) == (c, d) else shapely.LineString([(a, b), (c, d)])
        for a, b, c, d in ends.tolist()
    ]


@pytest.mark.parametrize("seed", range(40))
def test_where_lines_and_points_meet_geos_agrees(seed: int) -> None:
    rng = np.random.default_rng(seed)
    engine = made(on_grid(rng))
    for _ in range(4):
        ring = engine.boundary().xy
        polygon = shapely.Polygon(ring)
        border = polygon.exterior
        anywhere = rng.integers(-2, 14, (300, 2)) / rng.choice([1, 2])
        asked = np.concatenate([ring, anywhere])
        geometry = shapely.points(asked)
        covered, on = shapely.covers(polygon, geometry), shapely.intersects(border, geometry)
        assert engine.side(asked).tolist() == np.where(on, 0, np.where(covered, 1, -1)).tolist()
        assert (engine.distance(asked) == 0).tolist() == on.tolist()
        first, second = rng.integers(len(asked), size=(2, 400))
        second[:20] = first[:20]
        first[20:80], second[20:80] = rng.integers(len(ring), size=(2, 60))
        ends = np.concatenate([asked[first], asked[second]], axis=1)
        drawn = lines(ends)
        meets, inside = shapely.intersects(border, drawn), shapely.covers(polygon, drawn)
        assert engine.intersects(*ends.T).tolist() == meets.tolist()
        assert engine.contains_segment(*ends.T).tolist() == inside.tolist()
        assert (~np.isnan(engine.first_hit(*ends.T).t)).tolist() == meets.tolist()
        assert (
            np.unique(engine.crossings(*ends.T).segment).tolist() == np.flatnonzero(meets).tolist()
        )
        other = made(on_grid(rng) + rng.integers(-12, 12, 2))
        second_polygon = shapely.Polygon(other.boundary().xy)
        assert engine.collides(other) == shapely.intersects(polygon, second_polygon)
        apart = shapely.distance(polygon, second_polygon)
        assert engine.clearance(other) == pytest.approx(apart, rel=1e-14, abs=0)
        engine.insert(rng.integers(0, 12, (3, 2)).astype(np.float64))
