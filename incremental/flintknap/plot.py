"""Plots: the marks of pictures on the axes of matplotlib, and pictures as PNG and GIF.

Widths and colours are those of picture.py, a unit being a 96th of an inch; colours go with the
background of the axes, light or dark. Curves stay curves: Bezier segments are drawn as such, the
arcs of Flintstones as four cubic segments each, which stray by less than 1e-5 of their radius.

PNG and GIF are drawn on white, without pyplot, so no window or global state comes into it. Frames
of a GIF share one palette, lest colours flicker.

Needs matplotlib, and for GIF Pillow, which comes with it; nothing imports this module before it is
asked to draw.
"""

from __future__ import annotations

import io
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from flintknap import picture
from flintknap.picture import Crosses, Curve, Dots, Lenses, Mark, Polygon, Segments
from flintknap.svg import CROSS

try:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import LineCollection
    from matplotlib.colors import to_rgb, to_rgba
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path
except ImportError as missing:
    raise ImportError(
        "got no matplotlib, expected it for plots, PNG and GIF: pip install 'flintknap[plot]'",
        name=missing.name,
    ) from missing

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.typing import ColorType
    from numpy.typing import NDArray

    from flintknap.flintstones import Flintstones
    from flintknap.picture import Picture, Shape

    Doubles = NDArray[np.float64]

INCH = 96  # units
POINT = INCH / 72  # units
ARC = 4  # cubic segments that stand for an arc
ZORDER = 2.0  # of all marks, so that they are drawn in their order
COLOURS = 128  # of a GIF
WHITE = 248  # and more, of red, green and blue each, is white
SAMPLES = 8  # frames that its palette is made for
FRAME, LAST = 50, 2000  # milliseconds that frames are shown, and the last one


def plot(
    ax: Axes | None, marks: Sequence[Mark], color: ColorType | None, label: str | None
) -> Axes:
    """Draw marks on axes, or else on pyplot's current ones, and return these.

    ``color`` takes the place of all others; ``label`` is for the legend.
    """
    if ax is None:
        from matplotlib import pyplot

        ax = pyplot.gca()
    back = ax.get_facecolor()
    if to_rgba(back)[3] < 0.5:
        back = ax.figure.get_facecolor()
    _draw(ax, marks, 0, _is_dark(back), color, label)
    ax.set_aspect("equal")
    ax.autoscale_view()
    return ax


def png(drawn: Picture, size: int) -> bytes:
    """Return a picture as a PNG file, its longer side ``size`` pixels and the margins."""
    (low, high), scale = drawn.box, picture.scale(drawn.box)
    width, height = (high - low) * scale
    margin = picture.MARGIN
    resolution = INCH * size / picture.SIZE
    inches = (width + 2 * margin) / INCH, (height + 2 * margin) / INCH
    figure = Figure(inches, resolution, facecolor="white")
    FigureCanvasAgg(figure)
    ax = figure.add_axes((0, 0, 1, 1))
    ax.set_axis_off()
    ax.set(xlim=(-margin, width + margin), ylim=(-margin, height + margin))
    for index, group in enumerate(drawn.groups):
        placed = [Mark(role, _placed(shape, low, scale)) for role, shape in group.marks]
        _draw(ax, placed, index, False, None, None)
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=resolution)
    return file.getvalue()


def gif(frames: Sequence[bytes]) -> bytes:
    """Return an animation of frames, one PNG file or more of the same size, as a GIF file."""
    from PIL import Image

    def page(frame: bytes) -> Image.Image:
        return Image.open(io.BytesIO(frame)).convert("RGB")

    samples = [page(frames[i]) for i in np.linspace(0, len(frames) - 1, SAMPLES).astype(int)]
    width, height = samples[0].size
    strip = Image.new("RGB", (width, height * SAMPLES))
    for index, sample in enumerate(samples):
        strip.paste(sample, (0, height * index))
    palette = strip.quantize(COLOURS)
    colours = np.array(palette.getpalette() or []).reshape(-1, 3)
    colours[(colours >= WHITE).all(axis=1)] = 255  # paper stays paper; averages are a bit darker
    palette.putpalette(colours.ravel().tolist())
    pages = (page(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    shown = [FRAME] * (len(frames) - 1) + [LAST]
    file = io.BytesIO()
    next(pages).save(file, "GIF", save_all=True, append_images=pages, duration=shown, loop=0)
    return file.getvalue()


def _placed(shape: Shape, low: Doubles, scale: float) -> Shape:
    """Return a shape in units of a picture from its lower left, which may be far from any zero."""

    def place(xy: Doubles) -> Doubles:
        return (xy - low) * scale

    if isinstance(shape, Lenses):
        old = shape.stones
        new = replace(
            old, chord=place(old.chord), center=place(old.center), radius=old.radius * scale
        )
        return Lenses(new)
    return type(shape)(place(shape[0]))


def _draw(
    ax: Axes,
    marks: Sequence[Mark],
    index: int,
    is_dark: bool,
    color: ColorType | None,
    label: str | None,
) -> None:
    """Draw marks of the index-th object."""
    objects = picture.DARK if is_dark else picture.LIGHT
    for mark in marks:
        style = picture.STYLES[mark.role]
        usual = (style.dark if is_dark else style.light) or objects[index % len(objects)]
        drawn = usual if color is None else color
        artist = _added(ax, mark, drawn, picture.width(mark) / POINT)
        artist.set_zorder(ZORDER)
        if label is not None:
            artist.set_label(label)
            label = None  # one entry in the legend is enough


def _added(ax: Axes, mark: Mark, colour: ColorType, width: float) -> Artist:
    """Add what draws a mark to axes; ``width`` is in points."""
    match mark.shape:
        case Segments(ends):
            lines = LineCollection(
                list(ends), colors=[colour], linewidths=[width], capstyle="round"
            )
            return ax.add_collection(lines)
        case Dots(xy):
            dots = Line2D(*xy.T, linestyle="", marker="o", markersize=width, markeredgewidth=0)
            dots.set_color(colour)
            return ax.add_line(dots)
        case Crosses(xy):
            size = CROSS / POINT
            arms = Line2D(*xy.T, linestyle="", marker="x", markersize=size, markeredgewidth=width)
            arms.set_color(colour)
            return ax.add_line(arms)
        case Polygon(xy):
            path = Path(np.concatenate([xy, xy[:1]]), closed=True)
        case Curve(control):
            path = _curve(control)
        case Lenses(stones):
            path = _lenses(stones)
    fill = picture.STYLES[mark.role].fill
    patch = PathPatch(path, edgecolor=colour, linewidth=width, joinstyle="round")
    patch.set_facecolor(to_rgba(colour, fill) if fill else "none")
    return ax.add_patch(patch)


def _curve(control: Doubles) -> Path:
    """Return a closed curve of Bezier segments, (n, 3 or 4, 2)."""
    code = Path.CURVE3 if control.shape[1] == 3 else Path.CURVE4
    steps = control[:, 1:].reshape(-1, 2)
    start = control[:1, 0]
    codes = np.full(len(steps) + 2 * len(start), code)
    codes[:1], codes[len(steps) + 1 :] = Path.MOVETO, Path.CLOSEPOLY
    return Path(np.concatenate([start, steps, start]), codes)


def _lenses(stones: Flintstones) -> Path:
    """Return the outlines: along the right arc to the end of the chord, back along the left."""
    bulges = picture.bulges(stones)
    drawn = np.isfinite(stones.radius).any(axis=1)  # others are nothing but the chord
    p, s = stones.chord[drawn, 0], stones.chord[drawn, 1]
    there = _arc(p, s, stones.center[drawn, 1], bulges[drawn, 1])
    back = _arc(s, p, stones.center[drawn, 0], bulges[drawn, 0])
    start = p[:, np.newaxis]
    outlines = np.concatenate([start, there, back, start], axis=1)
    codes = np.full(outlines.shape[:2], Path.CURVE4)
    codes[:, 0], codes[:, -1] = Path.MOVETO, Path.CLOSEPOLY
    return Path(outlines.reshape(-1, 2), codes.ravel())


def _arc(p: Doubles, s: Doubles, center: Doubles, bulges: NDArray[np.bool_]) -> Doubles:
    """Return cubic segments counter-clockwise from each p to s: (m, 3 ARC, 2), without p.

    Straight where the arc does not bulge.
    """
    center = np.where(bulges[:, np.newaxis], center, 0.0)
    arm, other = p - center, s - center
    first = np.arctan2(arm[:, 1], arm[:, 0])
    sweep = (np.arctan2(other[:, 1], other[:, 0]) - first) % (2 * np.pi)
    # A cubic that leaves its ends along tangents of this length hugs its part of the circle.
    handle = 4 / 3 * np.tan(sweep / ARC / 4)
    radius = np.hypot(arm[:, 0], arm[:, 1])
    angle = first[:, np.newaxis] + np.linspace(0, 1, ARC + 1) * sweep[:, np.newaxis]
    rim = np.stack([np.cos(angle), np.sin(angle)], axis=-1) * radius[:, np.newaxis, np.newaxis]
    turned = np.stack([-rim[..., 1], rim[..., 0]], axis=-1) * handle[:, np.newaxis, np.newaxis]
    knots = rim[:, :-1] + turned[:, :-1], rim[:, 1:] - turned[:, 1:], rim[:, 1:]
    curved = center[:, np.newaxis, np.newaxis] + np.stack(knots, axis=2)
    share = np.linspace(0, 1, 3 * ARC + 1)[1:, np.newaxis]
    straight = p[:, np.newaxis] + share * (s - p)[:, np.newaxis]
    steps = np.where(bulges[:, np.newaxis, np.newaxis], curved.reshape(straight.shape), straight)
    steps[:, -1] = s
    return steps


def _is_dark(colour: ColorType) -> bool:
    red, green, blue = to_rgb(colour)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue < 0.5
