"""Exports: GeoJSON keeps every bit."""

from __future__ import annotations

import json

import numpy as np
import pytest
import shapely
from hypothesis import given

import flintknap as fk
import strategies
from flintknap import export

SQUARE = [(0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (0.0, 2.0)]


def engine(points):
    made = fk.Engine()
    made.insert(np.array(points, np.float64).reshape(-1, 2))
    return made


def features(**objects):
    collection = json.loads(export.geojson(objects))
    assert collection["type"] == "FeatureCollection"
    return collection["features"]


# ---------------------------------------------------------------------- GeoJSON
@given(strategies.point_sets())
def test_geojson_is_the_boundary_bit_for_bit(xy):
    it = engine(xy)
    boundary = it.boundary()
    (feature,) = features(it=it)
    assert feature["type"] == "Feature"
    assert feature["properties"] == {
        "object": "it",
        "status": boundary.status,
        "points": len(it),
        "inside": len(boundary.inside),
        "digest": it.digest(),
    }
    if boundary.status == "degenerate":
        assert feature["geometry"] is None
        return
    assert feature["geometry"]["type"] == "Polygon"
    (ring,) = feature["geometry"]["coordinates"]
    assert ring[0] == ring[-1]
    assert np.array(ring[:-1]).tobytes() == boundary.xy.tobytes()


def test_geojson_is_counter_clockwise_and_valid():
    xy = np.random.default_rng(5).normal(size=(300, 2))
    (feature,) = features(it=engine(xy))
    shape = shapely.from_geojson(json.dumps(feature["geometry"]))
    assert shape.is_valid
    assert shape.exterior.is_ccw
    assert shape.area == pytest.approx(engine(xy).boundary().area)


def test_geojson_has_the_objects_in_their_order():
    names = [f["properties"]["object"] for f in features(b=engine(SQUARE), a=engine([]))]
    assert names == ["b", "a"]
    assert features() == []


def test_the_set_decides_not_its_history():
    rng = np.random.default_rng(3)
    xy = rng.normal(size=(200, 2))
    text = export.geojson({"it": engine(xy)})
    again = rng.permutation(np.concatenate([xy, xy[:50]]))
    assert export.geojson({"it": engine(again)}) == text
