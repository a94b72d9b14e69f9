"""Exports: GeoJSON keeps every bit, SVG is a small picture that any XML parser takes."""

from __future__ import annotations

import json
import re
from xml.etree import ElementTree

import numpy as np
import pytest
import shapely
from hypothesis import given

import flintknap as fk
import strategies
from flintknap import export

SQUARE = [(0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (0.0, 2.0)]
LOCKED = [(0, 0), (1, 1), (2, 1), (2, 5), (3, 0), (3, 2), (5, 0)]
SVG = "{http://www.w3.org/2000/svg}"


def engine(points, d_min=-1.0):
    made = fk.Engine(d_min)
    made.insert(np.array(points, np.float64).reshape(-1, 2))
    return made


def features(**objects):
    collection = json.loads(export.geojson(objects))
    assert collection["type"] == "FeatureCollection"
    return collection["features"]


def picture(level=None, tolerance=None, **objects):
    """The picture as (root, viewBox, {class: [d of each path]})."""
    root = ElementTree.fromstring(export.svg(objects, level=level, tolerance=tolerance))
    paths = {"area": [], "dots": [], "inside": [], "stones": [], "cut": [], "corners": []}
    for path in root.iter(f"{SVG}path"):
        paths[path.get("class")].append(path.get("d"))
    return root, [float(v) for v in root.get("viewBox").split()], paths


def numbers(d):
    """The absolute coordinates that a path goes through."""
    pairs = re.findall(r"(?<![\d.])([\d.]+),([\d.]+)", re.sub("[lhm][-\\d., ]*", " ", d))
    return np.array(pairs, np.float64).reshape(-1, 2)


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


# ---------------------------------------------------------------------- SVG
def test_svg_of_a_square():
    root, box, paths = picture(it=engine(SQUARE))
    assert root.tag == f"{SVG}svg"
    assert box == [0, 0, 1040, 540]  # two to one, and a margin of 20
    # y is up: the lexicographically smallest corner, (0, 0), lies at the bottom left.
    assert paths["area"] == ["M20,520 1020,520 1020,20 20,20Z"]
    assert paths["dots"] == ["M20,520h0M1020,520h0M1020,20h0M20,20h0"]
    assert paths["inside"] == []
    assert [title.text for title in root.iter(f"{SVG}title")] == ["it", "it: closed, 4 points"]


def test_svg_marks_what_is_left_inside():
    it = engine(LOCKED, d_min=0.0)
    assert it.boundary().status == "locked"
    _, _, paths = picture(it=it)
    (marks,) = paths["inside"]
    assert marks.count("M") == len(it.boundary().inside) == 1
    # The cross begins at its upper left, half its size from the point.
    scale = 1000 / 5
    (x, y), size = it.points(it.boundary().inside)[0], export.CROSS
    start = (20 + x * scale - size / 2, 20 + (5 - y) * scale - size / 2)
    assert numbers(marks).tolist() == [pytest.approx(start)]


@given(strategies.point_sets())
def test_svg_holds_every_point_within_its_margin(xy):
    it = engine(xy)
    _, (_, _, width, height), paths = picture(it=it)
    assert max(width, height) == export.SIZE + 2 * export.MARGIN or len(it) < 2
    drawn = np.concatenate([numbers(d) for d in paths["area"] + paths["dots"]] or [np.ones((0, 2))])
    assert (drawn >= export.MARGIN).all()
    assert (drawn <= np.array([width, height]) - export.MARGIN + 0.01).all()
    boundary = it.boundary()
    if boundary.status == "degenerate":
        assert paths["area"] == []
        assert len(drawn) == len(it)
    else:
        assert len(numbers(paths["area"][0])) == len(boundary)
    assert sum(d.count("M") for d in paths["inside"]) == len(boundary.inside)


def test_svg_leaves_out_dots_that_would_run_together():
    angle = np.linspace(0, 2 * np.pi, 2000, endpoint=False)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    assert picture(it=engine(circle))[2]["dots"] == []
    assert picture(it=engine(circle[::10]))[2]["dots"] != []
    # It is the picture as a whole that leaves room, or does not.
    assert len(picture(it=engine(circle[::10]), far=engine([(99.0, 0.0)]))[2]["dots"]) == 1


@pytest.mark.parametrize("points", [[], [(3.0, -7.0)], [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)]])
def test_svg_of_next_to_nothing(points):
    _, (_, _, width, height), paths = picture(it=engine(points))
    assert width >= 40
    assert height == 40
    assert "".join(paths["dots"]).count("M") == len(points)
    assert len(picture()[0].findall(f"{SVG}g")) == 0


def test_svg_gives_objects_their_own_colours_on_light_and_on_dark():
    objects = {f"o{i}": engine(np.array(SQUARE) + 5 * i) for i in range(8)}
    root, _, paths = picture(**objects)
    assert len(paths["area"]) == 8
    classes = [group.get("class") for group in root.iter(f"{SVG}g")]
    assert len(set(classes)) == 6
    assert len(set(classes[:6])) == 6
    light, dark = root.find(f"{SVG}style").text.split("@media (prefers-color-scheme: dark)")
    for style in (light, dark):
        colours = dict(re.findall(r"\.(\w+) { color: (#\w+) }", style))
        assert set(colours) == set(classes)
        assert len(set(colours.values())) == 6


def test_svg_takes_any_name():
    names = ["<&>\"'", "\x00\x1b\ufffe", "]]>", "hülle 🪨"]
    root, _, _ = picture(**{name: engine(SQUARE) for name in names})
    titles = [group.find(f"{SVG}title").text for group in root.iter(f"{SVG}g")]
    shown = ["<&>\"'", "\ufffd\ufffd\ufffd", "]]>", "hülle 🪨"]
    assert titles == [f"{name}: closed, 4 points" for name in shown]


# ---------------------------------------------------------------------- both
@pytest.mark.parametrize("exported", [export.geojson, export.svg])
def test_the_set_decides_not_its_history(exported):
    rng = np.random.default_rng(3)
    xy = rng.normal(size=(200, 2))
    text = exported({"it": engine(xy)})
    assert exported({"it": engine(rng.permutation(np.concatenate([xy, xy[:50]])))}) == text
    line = np.column_stack([rng.permutation(50), np.zeros(50)])
    assert exported({"it": engine(line)}) == exported({"it": engine(rng.permutation(line))})


# ---------------------------------------------------------------------- approximations
def test_svg_draws_an_approximation_and_its_flintstones():
    # The base is a diameter of the smallest disc; above it a half disc, below a flatter segment.
    it = engine([(-1.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.0, -0.5)])
    _, box, paths = picture(level=0, it=it)
    assert box == [0, 0, 1040, 790]
    (cut,), (stones,), (corners,) = paths["cut"], paths["stones"], paths["corners"]
    assert cut == "M20,520 1020,520Z"
    assert corners == "M20,520h0M1020,520h0"
    # From left to right along the lower arc, radius (1 + 0.25) / 2 * 2; the way back is straight.
    assert "A625,625 0 0 0 1020,520L20,520Z" in stones
    # From right to left along the upper half circle.
    assert "A500,500 0 " in stones
    assert paths["dots"] == []
    _, _, paths = picture(tolerance=0.0, it=it)
    assert paths["stones"] == [""]  # single edges: nothing but the chords
    assert len(numbers(paths["cut"][0])) == 4


@given(strategies.point_sets())
def test_svg_holds_every_flintstone_within_its_margin(xy):
    it = engine(xy)
    _, (_, _, width, height), paths = picture(level=2, it=it)
    drawn = np.concatenate([numbers(d) for d in paths["area"] + paths["cut"]] or [np.ones((0, 2))])
    assert (drawn >= export.MARGIN).all()
    assert (drawn <= np.array([width, height]) - export.MARGIN + 0.01).all()
    assert len(paths["stones"]) == (it.boundary().status != "degenerate")


def test_svg_has_room_for_flintstones_that_bulge():
    # A hook: seen from its tip the chord of a level is short, so the disc on it is far wider.
    it = engine([(0, 0), (10, 0), (10.5, 4), (9, 7), (6, 6.5), (6, 5), (8, 4), (8, 2), (0, 1)])
    for level in range(4):
        areas = it.localize(level=level)
        _, (_, _, width, height), _ = picture(level=level, it=it)
        assert max(width, height) == export.SIZE + 2 * export.MARGIN
        low, high = reach(areas)
        size = (high - low).max()
        assert width == pytest.approx((high - low)[0] / size * 1000 + 40, abs=0.5)
        assert height == pytest.approx((high - low)[1] / size * 1000 + 40, abs=0.5)


def reach(areas):
    """Of the union of Flintstones, by looking at many places of each rim, and of the ends."""
    places = [areas.chord.reshape(-1, 2)]
    angle = np.linspace(0, 2 * np.pi, 4000, endpoint=False)
    for k in range(len(areas)):
        for side in (0, 1):
            if np.isfinite(areas.radius[k, side]):
                rim = areas.center[k, side] + areas.radius[k, side] * np.column_stack(
                    [np.cos(angle), np.sin(angle)]
                )
                places.append(
                    rim[areas.contains(rim * (1 - 1e-12) + 1e-12 * areas.chord[k, 0])[:, k]]
                )
    every = np.concatenate(places)
    return every.min(axis=0), every.max(axis=0)
