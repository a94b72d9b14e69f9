"""Polygons leave in every format bit for bit, closed and counter-clockwise: shapely judges."""

from __future__ import annotations

import json
import re
import subprocess
import sys

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

import flintknap as fk
import strategies
from flintknap.geometry import Polygonal

SQUARE = [(0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (0.0, 2.0)]
FORMATS = {
    "geo_interface": lambda p: shapely.geometry.shape(p),
    "geojson": lambda p: shapely.from_geojson(p.to_geojson()),
    "wkt": lambda p: shapely.from_wkt(p.to_wkt()),
    "wkb": lambda p: shapely.from_wkb(p.to_wkb()),
    "shapely": lambda p: p.to_shapely(),
}


def engine(points):
    made = fk.Engine()
    made.insert(np.array(points, np.float64).reshape(-1, 2))
    return made


@pytest.mark.parametrize("form", FORMATS)
@given(xy=strategies.point_sets())
def test_boundaries_read_back_bit_for_bit(form, xy):
    boundary = engine(xy).boundary()
    polygon = FORMATS[form](boundary)
    assert polygon.geom_type == "Polygon"
    if boundary.status == "degenerate":
        assert polygon.is_empty
        return
    ring = shapely.get_coordinates(polygon)
    assert ring[:-1].tobytes() == boundary.xy.tobytes()
    assert (ring[0] == ring[-1]).all()
    assert len(polygon.interiors) == 0


@pytest.mark.parametrize("form", FORMATS)
def test_rings_are_valid_and_counter_clockwise(form):
    xy = np.random.default_rng(5).normal(size=(300, 2))
    polygon = FORMATS[form](engine(xy).boundary())
    assert polygon.is_valid
    assert polygon.exterior.is_ccw
    assert polygon.area == pytest.approx(engine(xy).boundary().area)


@given(strategies.point_sets())
def test_wkb_is_shapelys_byte_for_byte(xy):
    boundary = engine(xy).boundary()
    assert boundary.to_wkb() == shapely.to_wkb(boundary.to_shapely(), byte_order=1)
    assert boundary.to_wkb() == shapely.to_wkb(shapely.Polygon(boundary.xy), byte_order=1)


@given(st.lists(st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 2), min_size=3))
def test_text_holds_every_double(vertices):
    class Any(Polygonal):
        xy = np.array(vertices)

    numbers = re.findall(r"[-+.\de]+", Any().to_wkt().removeprefix("POLYGON"))
    ring = np.array(numbers, np.float64).reshape(-1, 2)
    assert ring[:-1].tobytes() == Any.xy.tobytes()
    (ring,) = json.loads(Any().to_geojson())["coordinates"]
    assert np.array(ring[:-1]).tobytes() == Any.xy.tobytes()


def test_text_of_a_square():
    boundary = engine(SQUARE).boundary()
    assert boundary.to_wkt() == "POLYGON ((0.0 0.0, 4.0 0.0, 4.0 2.0, 0.0 2.0, 0.0 0.0))"
    ring = "[[0.0,0.0],[4.0,0.0],[4.0,2.0],[0.0,2.0],[0.0,0.0]]"
    assert boundary.to_geojson() == f'{{"type":"Polygon","coordinates":[{ring}]}}'
    nothing = engine([]).boundary()
    assert nothing.to_wkt() == "POLYGON EMPTY"
    assert nothing.to_geojson() == '{"type":"Polygon","coordinates":[]}'
    assert nothing.to_wkb() == bytes([1, 3, 0, 0, 0, 0, 0, 0, 0])


def test_two_vertices_are_no_polygon():
    class Two(Polygonal):
        xy = np.array([(0.0, 0.0), (1.0, 1.0)])

    for read in FORMATS.values():
        assert read(Two()).is_empty


def test_arrays():
    boundary = engine(SQUARE).boundary()
    assert np.asarray(boundary).tolist() == [list(v) for v in SQUARE]
    assert np.asarray(boundary, np.float32).dtype == np.float32
    assert np.shares_memory(np.asarray(boundary), boundary.xy)
    assert np.array(boundary).flags.writeable
    assert len(boundary) == 4


@pytest.mark.parametrize("form", FORMATS)
@given(xy=strategies.point_sets(), level=st.integers(0, 4))
def test_approximations_leave_like_a_boundary(form, xy, level):
    cut = engine(xy).approximate(level=level)
    polygon = FORMATS[form](cut)
    assert polygon.geom_type == "Polygon"
    assert polygon.is_empty == (len(cut) < 3)
    if not polygon.is_empty:
        assert shapely.get_coordinates(polygon)[:-1].tobytes() == cut.xy.tobytes()
        assert (np.asarray(cut) == cut.xy).all()


def test_a_flattened_curve_leaves_like_a_boundary():
    flat = engine(SQUARE).smooth().flatten(1e-3)
    for read in FORMATS.values():
        polygon = read(flat)
        assert polygon.is_valid
        assert polygon.exterior.is_ccw
        assert polygon.area == pytest.approx(flat.area)
        assert polygon.length == pytest.approx(flat.length)


def test_nothing_but_numpy_is_imported_before_it_is_asked_for():
    """Without any of the packages that only some methods need, an engine and its curves work."""
    code = """
import sys
for name in ("matplotlib", "pyarrow", "scipy", "shapely"):
    sys.modules[name] = None
import flintknap as fk
assert "numpy" not in sys.modules
engine = fk.Engine()
engine.insert([0.0, 4.0, 4.0, 0.0], [0.0, 0.0, 3.0, 3.0])
curve = engine.smooth()
print(engine.boundary().to_wkb() != b"", curve.to_svg() != "", curve.length > 0)
for method in (engine.boundary().to_shapely, curve.to_bpoly):
    try:
        method()
    except ImportError as error:
        print(error.name)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr == ""
    assert done.stdout.splitlines() == ["True True True", "shapely", "scipy.interpolate"]
