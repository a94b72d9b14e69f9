"""Plots: the same marks on the axes of matplotlib; PNG and GIF files."""

from __future__ import annotations

import io
import subprocess
import sys

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.path import Path
from PIL import Image

import flintknap as fk
from flintknap import picture, plot, svg

HOOK = [(0, 0), (10, 0), (10.5, 4), (9, 7), (6, 6.5), (6, 5), (8, 4), (8, 2), (0, 1)]
LOCKED = [(0, 0), (1, 1), (2, 1), (2, 5), (3, 0), (3, 2), (5, 0)]


def engine(points, d_min=-1.0):
    made = fk.Engine(d_min)
    made.insert(np.array(points, np.float64).reshape(-1, 2))
    return made


@pytest.fixture
def ax():
    figure = Figure()
    FigureCanvasAgg(figure)
    return figure.add_subplot()


def pixels(data):
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int)


# ---------------------------------------------------------------------- results
def test_every_result_is_drawn_where_it_lies(ax):
    it = engine(HOOK)
    curve = it.smooth()
    for number, (result, reach) in enumerate(
        [
            (it.boundary(), it.boundary().xy),
            (it.approximate(level=2), it.approximate(level=2).xy),
            (curve, curve.flatten(1e-4).xy),
            (curve.flatten(0.1), curve.flatten(0.1).xy),
            (it, it.boundary().xy),
        ]
    ):
        ax.clear()
        assert result.plot(ax) is ax
        assert ax.get_aspect() == 1.0, number
        low, high = ax.dataLim.min, ax.dataLim.max
        assert low == pytest.approx(reach.min(axis=0), abs=1e-3)
        assert high == pytest.approx(reach.max(axis=0), abs=1e-3)
        ax.figure.canvas.draw()


@pytest.mark.parametrize("degree", [2, 3])
def test_a_curve_is_drawn_as_its_segments(ax, degree):
    it = engine([(0, 0), (3, 0), (3, 2), (0, 2)])
    curve = it.smooth(degree=degree)
    (patch,) = curve.plot(ax).patches
    path = patch.get_path()
    assert set(path.codes[1:-1]) == {Path.CURVE3 if degree == 2 else Path.CURVE4}
    steps = path.vertices[1:-1].reshape(-1, degree, 2)
    assert steps.tolist() == curve.control[:, 1:].tolist()


def test_flintstones_are_drawn_by_their_arcs(ax):
    it = engine(np.random.default_rng(3).normal(size=(80, 2)))
    for level in range(5):
        areas = it.localize(level=level)
        ax.clear()
        (patch,) = areas.plot(ax).patches
        outlines = patch.get_path()
        subpaths = outlines.vertices.reshape(-1, 6 * plot.ARC + 2, 2)
        drawn = np.isfinite(areas.radius).any(axis=1)
        assert len(subpaths) == drawn.sum() > 0
        for rim, k in zip(subpaths, np.flatnonzero(drawn), strict=True):
            assert rim[0].tolist() == areas.chord[k, 0].tolist()
            assert rim[3 * plot.ARC].tolist() == areas.chord[k, 1].tolist()
            for side, knots in ((1, rim[: 3 * plot.ARC : 3]), (0, rim[3 * plot.ARC : -1 : 3])):
                if np.isfinite(areas.radius[k, side]):
                    away = np.hypot(*(knots - areas.center[k, side]).T)
                    assert away == pytest.approx(areas.radius[k, side])
        # What the areas hold and what the outline encloses are the same, but for its very rim.
        places = np.random.default_rng(0).uniform(-3, 3, (2000, 2))
        held = areas.contains(places)[:, drawn]
        for rim, holds in zip(subpaths, held.T, strict=True):
            fine = 1e4  # curves are cut into pieces of about a unit to decide this
            enclosed = Path(rim * fine, outlines.codes[: len(rim)]).contains_points(places * fine)
            assert (enclosed != holds).sum() <= 1


def test_layers_of_an_engine(ax):
    it = engine(LOCKED, d_min=0.0)
    it.plot(ax, layers="graph,points,boundary,approximation:1,control")
    assert len(ax.collections[0].get_segments()) == len(it.edges("delaunay"))
    points, crosses, corners, handles = ax.lines
    assert sorted(points.get_xydata().tolist()) == sorted(it.points().tolist())
    assert crosses.get_xydata().tolist() == it.points(it.boundary().inside).tolist()
    assert corners.get_xydata().tolist() == it.approximate(level=1).xy.tolist()
    assert len(handles.get_xydata()) == 2 * len(it.boundary())
    with pytest.raises(fk.InputError, match="expected one of points, graph"):
        it.plot(ax, layers="everything")


def test_colours_suit_the_background_unless_told(ax):
    it = engine(HOOK)
    for dark, palette in ((False, picture.LIGHT), (True, picture.DARK)):
        ax.clear()
        ax.set_facecolor("#111" if dark else "#eee")
        it.boundary().plot(ax)
        assert to_hex(ax.patches[0].get_edgecolor()) == palette[0]
        style = picture.STYLES["stones"]
        it.localize(level=1).plot(ax)
        assert to_hex(ax.patches[1].get_edgecolor()) == (style.dark if dark else style.light)
        it.smooth().plot(ax, color=np.array([0.0, 1.0, 0.0]))
        assert to_hex(ax.patches[2].get_edgecolor()) == "#00ff00"
        assert ax.patches[2].get_facecolor()[3] == 0  # a line without an inside
    ax.clear()
    ax.set_facecolor("none")
    ax.figure.set_facecolor("black")
    it.boundary().plot(ax)
    assert to_hex(ax.patches[0].get_edgecolor()) == picture.DARK[0]


def test_one_entry_in_the_legend_each(ax):
    it = engine(HOOK)
    it.boundary().plot(ax, label="exact")
    it.approximate(level=1).plot(ax, label="coarse")
    it.plot(ax, layers="points,smooth", label="more")
    texts = [text.get_text() for text in ax.legend().get_texts()]
    assert sorted(texts) == ["coarse", "exact", "more"]


def test_pyplots_axes_if_none_are_given():
    mpl.use("agg")
    from matplotlib import pyplot

    try:
        ax = engine(HOOK).boundary().plot()
        assert ax is pyplot.gca()
        assert engine(HOOK).smooth().plot() is ax
        assert len(ax.patches) == 2
    finally:
        pyplot.close("all")


@pytest.mark.parametrize("points", [[], [(1.0, 2.0)], [(0.0, 0.0), (1e-9, 0.0)]])
def test_degenerate_objects(ax, points):
    it = engine(points)
    for result in (it.boundary(), it.approximate(level=3), it.localize(level=3), it.smooth(), it):
        result.plot(ax)
    it.plot(ax, layers="graph,points,boundary,flintstones:1,approximation:1,smooth,control")
    ax.figure.canvas.draw()
    assert sum(len(line.get_xydata()) for line in ax.lines) == 2 * len(points)


# ---------------------------------------------------------------------- files
def test_png_shows_what_svg_does():
    corners = engine([(0, 0), (2, 0), (2, 1), (0, 1)])
    drawn = picture.compose({"it": corners}, "boundary")
    image = pixels(plot.png(drawn, 500))
    assert image.shape == (270, 520, 3)  # half a pixel a unit
    assert "0 0 1040 540" in svg.write(drawn)
    assert (image[5, 5] == 255).all()
    tint = np.array([int(picture.LIGHT[0][i : i + 2], 16) for i in (1, 3, 5)])
    assert image[135, 260] == pytest.approx(255 + 0.15 * (tint - 255), abs=1)
    assert (image[135, 9:12] < 200).any()  # its left side


def test_png_of_next_to_nothing():
    assert (pixels(plot.png(picture.compose({}), 800)) == 255).all()
    single = pixels(plot.png(picture.compose({"it": engine([(1e50, -1e50)])}), 800))
    assert single.shape == (32, 32, 3)
    assert (single[16, 16] < 128).any()


def test_frames_of_a_gif():
    box = picture.compose({"it": engine(HOOK)}).box
    frames = [
        plot.png(picture.compose({"it": engine(HOOK[:n])}, box=box), 300)
        for n in range(1, len(HOOK) + 1)
    ]
    shown = Image.open(io.BytesIO(plot.gif(frames)))
    assert (shown.format, shown.n_frames, shown.info["loop"]) == ("GIF", len(HOOK), 0)
    for index, frame in enumerate(frames):
        shown.seek(index)
        is_last = index == len(HOOK) - 1
        assert shown.info["duration"] == (plot.LAST if is_last else plot.FRAME)
        got, expected = np.asarray(shown.convert("RGB")).astype(int), pixels(frame)
        assert np.abs(got - expected).max() <= 40
        assert np.abs(got - expected).mean() <= 2.0
        assert (got[:4] == 255).all()  # white is white
    alone = Image.open(io.BytesIO(plot.gif(frames[:1])))
    assert alone.size == shown.size


def test_what_is_missing_is_said():
    """Without matplotlib, everything but plots works, and these say what to install."""
    code = """
import sys
sys.modules["matplotlib"] = None
import flintknap as fk
engine = fk.Engine()
engine.insert([0.0, 4.0, 4.0, 0.0], [0.0, 0.0, 3.0, 3.0])
assert engine.to_svg("points,boundary,smooth,flintstones:2").startswith("<svg ")
for result in (engine, engine.boundary(), engine.approximate(level=1), engine.localize(level=1),
               engine.smooth()):
    try:
        result.plot()
    except ImportError as error:
        print(error.name, error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr == ""
    (said,) = set(done.stdout.splitlines())
    assert done.stdout.count("\n") == 5
    assert said.startswith("matplotlib")
    assert " got no matplotlib, expected it for plots" in said
    assert "pip install 'flintknap[plot]'" in said
