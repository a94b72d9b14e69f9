"""SVG: pictures of boundaries and what is around them, without any other package.

The longer side of a picture is SIZE units, to a hundredth of a unit, with y upward. Lines and dots
have the same width at every scale. Colours suit a light page and, where the viewer says so, a dark
one; the background is left to the page. All that is drawn are paths: an approximation has straight
lines, a smooth curve its very Bezier segments, a Flintstone its two arcs.

Cost: O(n) beyond the picture (picture.py), about 1 us a vertex.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

import numpy as np

from flintknap import picture
from flintknap.picture import Crosses, Curve, Dots, Group, Lenses, Mark, Picture, Polygon, Segments

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import NDArray

    from flintknap.engine import Engine
    from flintknap.flintstones import Flintstones
    from flintknap.picture import Box

    Doubles = NDArray[np.float64]

CROSS = 8  # units from one arm's end to the other, across and down

ROOT = "flintknap"  # class of the root: rules of a picture within a page are not for all of it
BASE = f"""\
.{ROOT} path {{ fill: none; stroke: currentColor; stroke-linecap: round; stroke-linejoin: round;
  vector-effect: non-scaling-stroke }}"""
FORBIDDEN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # by XML


def draw(objects: Mapping[str, Engine], layers: str | None = None) -> str:
    """Return a picture of ``objects``, engines by name, later ones over earlier ones.

    ``layers`` is a list of layers as in layers.py; if left out, the boundaries, and the points
    where they are not crowded. Raises InputError for what is no list of layers.
    """
    return write(picture.compose(objects, layers))


def curve(control: Doubles) -> str:
    """Return a picture of a closed curve of Bezier segments, (n, 3 or 4, 2): cubic or quadratic.

    Each segment is one command of the path, C or Q. The canvas holds the control points.
    """
    mark = Mark("area", Curve(control))
    return write(Picture("", picture.extent([mark]), [Group("", [mark])]))


def write(drawn: Picture) -> str:
    """Return a picture as the text of a file."""
    canvas = Canvas(drawn.box)
    lines = [head(canvas.box), *_title(drawn.title), stylesheet(drawn.groups, len(drawn.groups))]
    for index, group in enumerate(drawn.groups):
        lines += elements(group, canvas, index)
    return "\n".join([*lines, "</svg>\n"])


def head(box: str) -> str:
    """Return how the root element begins, with a view of a box."""
    return f'<svg xmlns="http://www.w3.org/2000/svg" class="{ROOT}" viewBox="{box}">'


def stylesheet(groups: Iterable[Group], objects: int) -> str:
    """Return the style element for the marks of some groups, and for so many objects."""
    used = {mark.role for group in groups for mark in group.marks}
    rules, dark = [BASE], []
    for role, style in picture.STYLES.items():
        if role in used:
            fill = f"; fill: currentColor; fill-opacity: {style.fill:g}" if style.fill else ""
            colour = f"; color: {style.light}" if style.light else ""
            rules.append(f".{ROOT} .{role} {{ stroke-width: {style.width:g}{fill}{colour} }}")
            if style.dark:
                dark.append(f".{ROOT} .{role} {{ color: {style.dark} }}")
    for index in range(min(objects, len(picture.LIGHT))):
        rules.append(f".{ROOT} .object{index} {{ color: {picture.LIGHT[index]} }}")
        dark.append(f".{ROOT} .object{index} {{ color: {picture.DARK[index]} }}")
    rules.append("@media (prefers-color-scheme: dark) {\n" + "\n".join(dark) + "\n}")
    return "<style>\n" + "\n".join(rules) + "\n</style>"


def elements(group: Group, canvas: Canvas, index: int) -> list[str]:
    """Return the element of a group, the index-th object, line by line."""
    lines = [f'<g class="object{index % len(picture.LIGHT)}">', *_title(group.title)]
    for mark in group.marks:
        d = _path(mark, canvas)
        if d:
            full, width = picture.STYLES[mark.role].width, picture.width(mark)
            thin = f' style="stroke-width: {width:.2f}"' if width != full else ""
            lines.append(f'<path class="{mark.role}"{thin} d="{d}"/>')
    return [*lines, "</g>"]


class Canvas:
    """Where places of a box come to lie: on a canvas that it fills, y pointing down."""

    def __init__(self, box: Box) -> None:
        (low, high), margin = box, picture.MARGIN
        self.low, self.scale = low, picture.scale(box)
        width, self.height = (high - low) * self.scale + 2 * margin
        self.box = f"0 0 {width:g} {self.height:g}"

    def place(self, xy: Doubles) -> Doubles:
        """Bring places, (..., 2), onto the canvas, to a hundredth of a unit."""
        placed = (xy - self.low) * self.scale + picture.MARGIN
        placed[..., 1] = self.height - placed[..., 1]
        rounded: Doubles = placed.round(2)
        return rounded


def _path(mark: Mark, canvas: Canvas) -> str:
    """Return what a mark's path goes along; nothing if there is nothing of it."""
    match mark.shape:
        case Polygon(xy):
            return _text("%g,%g ", canvas.place(xy), "M", "Z")
        case Segments(ends):
            return _text("M%g,%g %g,%g", canvas.place(ends))
        case Dots(xy):
            return _text("M%g,%gh0", canvas.place(xy))
        case Crosses(xy):
            arms = f"M%g,%gl{CROSS},{CROSS}m0,-{CROSS}l-{CROSS},{CROSS}"
            return _text(arms, canvas.place(xy) - CROSS / 2)
        case Curve(control):
            placed = canvas.place(control)
            if len(placed) == 0:
                return ""
            count = control.shape[1] - 1
            command = ("Q" if count == 2 else "C") + " ".join(["%g,%g"] * count)
            return _text(command, placed[:, 1:], _text("M%g,%g", placed[:1, 0]), "Z")
        case Lenses(stones):
            return _arcs(stones, canvas)


def _text(form: str, places: Doubles, before: str = "", after: str = "") -> str:
    """Return coordinates in a form for as many of them as it takes, again and again."""
    text = form * (places.size // form.count("%")) % tuple(places.ravel().tolist())
    return f"{before}{text.rstrip()}{after}" if text else ""


def _arcs(stones: Flintstones, canvas: Canvas) -> str:
    """Return the outlines: along the right arc to the end of the chord, back along the left."""
    drawn = np.isfinite(stones.radius).any(axis=1)  # others are nothing but the chord
    places = canvas.place(stones.chord[drawn]).reshape(-1, 4).tolist()
    radii = np.where(picture.bulges(stones), stones.radius * canvas.scale, 0.0)[drawn].tolist()
    parts = []
    for (x, y, u, v), (left, right), offset in zip(
        places, radii, stones.offset[drawn].tolist(), strict=True
    ):
        # An arc is the larger one of its circle if the centre lies on its side of the chord.
        there = f"A{right:.6g},{right:.6g} 0 {int(offset[1] < 0)} 0 " if right else "L"
        back = f"A{left:.6g},{left:.6g} 0 {int(offset[0] > 0)} 0 " if left else "L"
        parts.append(f"M{x:g},{y:g}{there}{u:g},{v:g}{back}{x:g},{y:g}Z")
    return "".join(parts)


def _title(text: str) -> list[str]:
    shown = escape(FORBIDDEN.sub("\ufffd", text))
    return [f"<title>{shown}</title>"] if shown else []
