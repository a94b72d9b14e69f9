"""SVG: small pictures that any XML parser takes, of any layers."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flintknap as fk
import strategies
from flintknap import layers, picture, svg

SQUARE = [(0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (0.0, 2.0)]
LOCKED = [(0, 0), (1, 1), (2, 1), (2, 5), (3, 0), (3, 2), (5, 0)]
SVG = "{http://www.w3.org/2000/svg}"
EVERY_KIND = (
    "points,graph,graph:gabriel,graph:d=-0.2,boundary,approximation:3,flintstones:3,"
    "flintstones:tolerance=0.1,smooth,smooth:2,control"
)


def engine(points, d_min=-1.0):
    made = fk.Engine(d_min)
    made.insert(np.array(points, np.float64).reshape(-1, 2))
    return made


def drawn(layers=None, /, **objects):
    """The picture as (root, viewBox, {class: [d of each path]})."""
    root = ElementTree.fromstring(svg.draw(objects, layers))
    paths = {role: [] for role in picture.STYLES}
    for path in root.iter(f"{SVG}path"):
        paths[path.get("class")].append(path.get("d"))
    return root, [float(v) for v in root.get("viewBox").split()], paths


def numbers(d):
    """The absolute coordinates that a path goes through."""
    pairs = re.findall(r"(?<![\d.])([\d.]+),([\d.]+)", re.sub("[lhm][-\\d., ]*", " ", d))
    return np.array(pairs, np.float64).reshape(-1, 2)


def styles(root):
    """What the style sheet says for light pages, and for dark ones."""
    return root.find(f"{SVG}style").text.split("@media (prefers-color-scheme: dark)")


# ---------------------------------------------------------------------- the whole picture
def test_svg_of_a_square():
    root, box, paths = drawn(it=engine(SQUARE))
    assert root.tag == f"{SVG}svg"
    assert box == [0, 0, 1040, 540]  # two to one, and a margin of 20
    # y is up: the lexicographically smallest corner, (0, 0), lies at the bottom left.
    assert paths["area"] == ["M20,520 1020,520 1020,20 20,20Z"]
    assert paths["dots"] == ["M20,520h0M20,20h0M1020,520h0M1020,20h0"]
    assert paths["inside"] == []
    assert [title.text for title in root.iter(f"{SVG}title")] == ["it", "it: closed, 4 points"]


def test_svg_marks_what_is_left_inside():
    it = engine(LOCKED, d_min=0.0)
    assert it.boundary().status == "locked"
    _, _, paths = drawn(it=it)
    (marks,) = paths["inside"]
    assert marks.count("M") == len(it.boundary().inside) == 1
    # The cross begins at its upper left, half its size from the point.
    scale = 1000 / 5
    (x, y), size = it.points(it.boundary().inside)[0], svg.CROSS
    start = (20 + x * scale - size / 2, 20 + (5 - y) * scale - size / 2)
    assert numbers(marks).tolist() == [pytest.approx(start)]


@given(strategies.point_sets())
def test_svg_holds_every_point_within_its_margin(xy):
    it = engine(xy)
    _, (_, _, width, height), paths = drawn(it=it)
    assert max(width, height) == picture.SIZE + 2 * picture.MARGIN or len(it) < 2
    places = np.concatenate([np.ones((0, 2)), *map(numbers, paths["area"] + paths["dots"])])
    assert (places >= picture.MARGIN).all()
    assert (places <= np.array([width, height]) - picture.MARGIN + 0.01).all()
    boundary = it.boundary()
    if boundary.status == "degenerate":
        assert paths["area"] == []
        assert len(places) == len(it)
    else:
        assert len(numbers(paths["area"][0])) == len(boundary)
    assert sum(d.count("M") for d in paths["inside"]) == len(boundary.inside)


def test_svg_leaves_out_dots_that_would_run_together():
    angle = np.linspace(0, 2 * np.pi, 2000, endpoint=False)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    assert drawn(it=engine(circle))[2]["dots"] == []
    assert drawn(it=engine(circle[::10]))[2]["dots"] != []
    # It is the picture as a whole that leaves room, or does not.
    assert len(drawn(it=engine(circle[::10]), far=engine([(99.0, 0.0)]))[2]["dots"]) == 1


@pytest.mark.parametrize("points", [[], [(3.0, -7.0)], [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)]])
def test_svg_of_next_to_nothing(points):
    _, (_, _, width, height), paths = drawn(it=engine(points))
    assert width >= 40
    assert height == 40
    assert "".join(paths["dots"]).count("M") == len(points)
    assert len(drawn()[0].findall(f"{SVG}g")) == 0


def test_svg_gives_objects_their_own_colours_on_light_and_on_dark():
    objects = {f"o{i}": engine(np.array(SQUARE) + 5 * i) for i in range(8)}
    root, _, paths = drawn(**objects)
    assert len(paths["area"]) == 8
    classes = [group.get("class") for group in root.iter(f"{SVG}g")]
    assert len(set(classes)) == 6
    assert len(set(classes[:6])) == 6
    for style in styles(root):
        colours = dict(re.findall(r"\.(object\d) { color: (#\w+) }", style))
        assert set(colours) == set(classes)
        assert len(set(colours.values())) == 6


def test_svg_takes_any_name():
    names = ["<&>\"'", "\x00\x1b\ufffe", "]]>", "hülle 🪨"]
    root, _, _ = drawn(**{name: engine(SQUARE) for name in names})
    titles = [group.find(f"{SVG}title").text for group in root.iter(f"{SVG}g")]
    shown = ["<&>\"'", "\ufffd\ufffd\ufffd", "]]>", "hülle 🪨"]
    assert titles == [f"{name}: closed, 4 points" for name in shown]


@settings(deadline=None)  # every layer there is, twice
@given(strategies.point_sets(), st.randoms(use_true_random=False))
def test_the_set_decides_not_its_history(xy, random):
    shuffled = np.array(xy)[random.sample(range(len(xy)), len(xy))] if len(xy) else xy
    it, again = engine(xy), engine(shuffled)
    again.insert(np.array(xy, np.float64).reshape(-1, 2)[:3])
    for chosen in (None, EVERY_KIND):
        assert again.to_svg(chosen) == it.to_svg(chosen)


# ---------------------------------------------------------------------- layers
def test_layers_are_drawn_in_their_order_and_no_others():
    it = engine(np.random.default_rng(2).normal(size=(60, 2)))
    for chosen, roles in [
        ("points,boundary", ["dots", "area"]),
        (" boundary , points ", ["area", "dots"]),
        ("graph,smooth", ["edges", "curve"]),
        ("control:2,flintstones:2", ["control", "handles", "stones"]),
        ("approximation:1", ["cut", "corners"]),
    ]:
        root, _, _ = drawn(chosen, it=it)
        assert [path.get("class") for path in root.iter(f"{SVG}path")] == roles
        light, dark = styles(root)
        for role in picture.STYLES:
            assert (f".{role} {{" in light) == (role in roles)
            has_own = bool(picture.STYLES[role].light)
            assert (f".{role} {{" in dark) == (role in roles and has_own)
        assert "vector-effect: non-scaling-stroke" in light


@pytest.mark.parametrize(
    ("chosen", "asked"),
    [
        ("graph", {"graph": "delaunay"}),
        ("graph:gabriel", {"graph": "gabriel"}),
        ("graph:hull", {"graph": "hull"}),
        ("graph:complete", {"graph": "complete"}),
        ("graph:beta=1.5", {"graph": ("beta_skeleton", 1.5)}),
        ("graph:d=-0.4", {"gamma1": (-0.4, 1.0)}),
    ],
)
def test_a_graph_has_its_edges(chosen, asked):
    it = engine(np.random.default_rng(4).random((40, 2)))
    _, _, paths = drawn(f"{chosen},points", it=it)
    (d,) = paths["edges"]
    canvas = svg.Canvas(picture.extent(picture.marks(it, layers.Layer("points", {}))))
    ends = canvas.place(it.points(it.edges(**asked).ravel())).reshape(-1, 2, 2)
    shown = numbers(d).reshape(-1, 2, 2)
    assert len(shown) == len(ends) > 10 or chosen == "graph:hull"

    def sides(segments):
        return {frozenset(map(tuple, segment)) for segment in segments.tolist()}

    assert sides(shown) == sides(ends)


@pytest.mark.parametrize(
    ("chosen", "asked"),
    [("smooth", {}), ("smooth:2", {"level": 2}), ("smooth:tolerance=0.2", {"tolerance": 0.2})],
)
def test_a_smooth_curve_has_its_segments(chosen, asked):
    it = engine(np.random.default_rng(6).normal(size=(50, 2)))
    curve = it.smooth(**asked)
    (d,) = drawn(chosen, it=it)[2]["curve"]
    assert d.count("C") == len(curve)
    canvas = svg.Canvas(picture.extent([picture.Mark("curve", picture.Curve(curve.control))]))
    expected = canvas.place(curve.control)
    assert numbers(d)[1:].reshape(-1, 3, 2).tolist() == expected[:, 1:].tolist()
    _, _, paths = drawn(chosen.replace("smooth", "control"), it=it)
    polygon, handles = numbers(paths["control"][0]), numbers(paths["handles"][0])
    assert polygon.tolist() == expected[:, :-1].reshape(-1, 2).tolist()
    assert handles.tolist() == expected[:, 1:-1].reshape(-1, 2).tolist()


def test_dots_get_smaller_where_there_are_many():
    rng = np.random.default_rng(1)
    for count, width in ((400, None), (1600, 2.0), (50000, 1.0)):
        root, _, _ = drawn("points", it=engine(rng.random((count, 2))))
        (path,) = root.iter(f"{SVG}path")
        assert path.get("style") == (width and f"stroke-width: {width:.2f}")


def test_a_picture_within_a_page_is_no_business_of_the_rest_of_it():
    root, _, _ = drawn(EVERY_KIND, it=engine(SQUARE), other=engine(LOCKED, d_min=0.0))
    assert root.get("class") == "flintknap"
    selectors = re.findall(r"^\s*(\S[^{}]*) {", root.find(f"{SVG}style").text, re.MULTILINE)
    selectors.remove("@media (prefers-color-scheme: dark)")
    assert len(selectors) > 2 * 9
    assert all(selector.startswith(".flintknap ") for selector in selectors)


def test_the_box_is_what_is_seen():
    it, other = engine(SQUARE), engine(np.array(SQUARE) * 3)
    (box,) = {picture.compose({"": other}).box[1].tobytes()}
    assert picture.compose({"": it}).box[1].tobytes() != box
    inside = svg.write(picture.compose({"": it}, box=picture.compose({"": other}).box))
    assert 'viewBox="0 0 1040 540"' in inside
    assert "M20,520 353.33,520 353.33,353.33 20,353.33Z" in inside


@pytest.mark.parametrize(
    ("chosen", "words"),
    [
        ("", "got '', expected one of points, graph, boundary"),
        ("points,,boundary", "got '', expected one of"),
        ("flintstone:4", "got 'flintstone:4', expected one of points"),
        ("points:3", "got 'points:3', expected points"),
        ("boundary:", "got 'boundary:', expected boundary"),
        ("flintstones", "expected flintstones:LEVEL or flintstones:tolerance=T"),
        ("flintstones:-1", "a level is an integer, 0 or more"),
        ("approximation:2.5", "a level is an integer, 0 or more"),
        ("approximation:²", "a level is an integer, 0 or more"),
        ("approximation:tolerance=-1", "a tolerance is a number, 0 or more"),
        ("smooth:tolerance=nan", "a tolerance is a number, 0 or more"),
        ("smooth:", "expected smooth, smooth:LEVEL or smooth:tolerance=T"),
        ("control:within=3", "got 'control:within=3', expected control,"),
        ("graph:", "got 'graph:', expected graph:GRAPH with one of delaunay, gabriel"),
        ("graph:convex", "got 'graph:convex', expected graph:GRAPH"),
        ("graph:beta=0", "got beta 0.0, expected a number greater than 0"),
        ("graph:beta=x", "got 'graph:beta=x', expected graph:GRAPH"),
        ("graph:d=-2", "expected -1 <= low <= high <= 1"),
    ],
)
def test_what_is_no_layer_is_refused(chosen, words):
    with pytest.raises(fk.InputError) as refused:
        engine(SQUARE).to_svg(chosen)
    assert str(refused.value).startswith("layers: got ")
    assert words in str(refused.value)


def test_a_layer_shows_what_engines_are_asked():
    parsed = layers.parse("points,graph:d=-0.5,smooth:4,flintstones:tolerance=2e-1")
    assert parsed == [
        ("points", {}),
        ("graph", {"gamma1": (-0.5, 1.0)}),
        ("smooth", {"level": 4}),
        ("flintstones", {"tolerance": 0.2}),
    ]


# ---------------------------------------------------------------------- approximations
def test_svg_draws_an_approximation_and_its_flintstones():
    # The base is a diameter of the smallest disc; above it a half disc, below a flatter segment.
    it = engine([(-1.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.0, -0.5)])
    _, box, paths = drawn("flintstones:0,approximation:0", it=it)
    assert box == [0, 0, 1040, 790]
    (cut,), (stones,), (corners,) = paths["cut"], paths["stones"], paths["corners"]
    assert cut == "M20,520 1020,520Z"
    assert corners == "M20,520h0M1020,520h0"
    # From left to right along the lower arc, radius (1 + 0.25) / 2 * 2; the way back is straight.
    assert "A625,625 0 0 0 1020,520L20,520Z" in stones
    # From right to left along the upper half circle.
    assert "A500,500 0 " in stones
    assert paths["dots"] == []
    _, _, paths = drawn("flintstones:tolerance=0,approximation:tolerance=0", it=it)
    assert paths["stones"] == []  # single edges: nothing but the chords
    assert len(numbers(paths["cut"][0])) == 4


@given(strategies.point_sets())
def test_svg_holds_every_flintstone_within_its_margin(xy):
    it = engine(xy)
    _, (_, _, width, height), paths = drawn("boundary,flintstones:2,approximation:2", it=it)
    places = np.concatenate([np.ones((0, 2)), *map(numbers, paths["area"] + paths["cut"])])
    assert (places >= picture.MARGIN).all()
    assert (places <= np.array([width, height]) - picture.MARGIN + 0.01).all()
    assert len(paths["stones"]) == np.isfinite(it.localize(level=2).radius).any()


def test_svg_has_room_for_flintstones_that_bulge():
    # A hook: seen from its tip the chord of a level is short, so the disc on it is far wider.
    it = engine([(0, 0), (10, 0), (10.5, 4), (9, 7), (6, 6.5), (6, 5), (8, 4), (8, 2), (0, 1)])
    for level in range(4):
        areas = it.localize(level=level)
        _, (_, _, width, height), _ = drawn(f"flintstones:{level}", it=it)
        assert max(width, height) == picture.SIZE + 2 * picture.MARGIN
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
