"""Boundaries for other programs: GeoJSON for data, SVG for the eye.

Those of objects take them by name, such as `Replay.engines`, and return the text of a file. Equal
sets of points give equal text, whatever their history.

GeoJSON holds every coordinate exactly: numbers read back bit for bit. They are those that went in,
on whatever plane that was; RFC 7946 would have them be longitude and latitude.

SVG is drawn on a canvas whose longer side has SIZE units, to a hundredth of a unit, with y upward.
Lines have the same width at every scale. Colours suit a light page and, where the viewer says so,
a dark one. Dots are vertices, drawn where they are not crowded; crosses are points left inside.

With a level or a tolerance the SVG shows the Flintstones of that cut over the boundary: areas of
arcs that hold it, their chords, and a dot at each end of one.

A degenerate object has no polygon: null geometry in GeoJSON, and its bare points in SVG.

Cost: O(n log n) for n points, to sort them.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

import msgspec
import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from flintknap.engine import Engine
    from flintknap.flintstones import Flintstones

SIZE = 1000
MARGIN = 20
ROOM = 8  # units that a vertex needs on average, or dots would run into a thicker line
FLAT = 1e6  # units of radius from which on an arc is a straight line to the eye
CROSS = 8  # units from one arm's end to the other, across and down

LIGHT = ["#2b6cb0", "#c05621", "#2f855a", "#6b46c1", "#0b7a8f", "#8f6a08"]
DARK = ["#63b3ed", "#f6ad55", "#68d391", "#b794f4", "#4fd1e5", "#ecc94b"]
STYLE = """\
path { fill: none; stroke: currentColor; stroke-width: 1.5; stroke-linecap: round;
       stroke-linejoin: round; vector-effect: non-scaling-stroke }
.area { fill: currentColor; fill-opacity: 0.15 }
.dots { stroke-width: 4 }
.inside { stroke: #e0307a; stroke-width: 2 }
.stones { fill: #d69e2e; fill-opacity: 0.3; stroke: #b7791f; stroke-width: 0.75 }
.cut { stroke: #c53030; stroke-width: 2 }
.corners { stroke: #c53030; stroke-width: 6 }
"""
FORBIDDEN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # by XML


def geojson(objects: Mapping[str, Engine]) -> str:
    """Return a FeatureCollection: a Feature for each object, a counter-clockwise Polygon each.

    Properties: "object", "status", "points" (distinct), "inside" (how many) and "digest".
    """
    features = []
    for name, engine in objects.items():
        boundary = engine.boundary()
        properties = {
            "object": name,
            "status": boundary.status,
            "points": len(engine),
            "inside": len(boundary.inside),
            "digest": engine.digest(),
        }
        geometry = boundary.__geo_interface__ if len(boundary) else None
        features.append({"type": "Feature", "properties": properties, "geometry": geometry})
    return msgspec.json.encode({"type": "FeatureCollection", "features": features}).decode() + "\n"


def svg(
    objects: Mapping[str, Engine], *, level: int | None = None, tolerance: float | None = None
) -> str:
    """Return a picture of all objects in the order given, later ones over earlier ones.

    ``level`` or ``tolerance``, not both: draw the Flintstones of that cut and their chords, too.
    """
    stones: dict[str, Flintstones] = {}
    if level is not None or tolerance is not None:
        cuts = ((n, e.localize(level=level, tolerance=tolerance)) for n, e in objects.items())
        stones = dict(cuts)
    points = [each.points() for each in objects.values()]
    canvas = _Canvas([*points, *map(_outermost, stones.values())])
    scale = canvas.scale

    def place(xy: NDArray[np.float64]) -> list[tuple[float, float]]:
        x, y = canvas.place(xy).T
        return list(zip(x.tolist(), y.tolist(), strict=True))

    lines = [
        canvas.head,
        f"<title>{_text(', '.join(objects))}</title>",
        f"<style>\n{STYLE}{_colours(LIGHT, len(objects))}",
        f"@media (prefers-color-scheme: dark) {{\n{_colours(DARK, len(objects))}\n}}\n</style>",
    ]
    for index, (name, engine) in enumerate(objects.items()):
        boundary = engine.boundary()
        dots = ring = place(boundary.xy)
        lines.append(f'<g class="object{index % len(LIGHT)}">')
        lines.append(f"<title>{_text(name)}: {boundary.status}, {len(engine)} points</title>")
        if ring:
            corners = " ".join(f"{x:g},{y:g}" for x, y in ring)
            lines.append(f'<path class="area" d="M{corners}Z"/>')
            if boundary.length * scale < ROOM * len(ring):
                dots = []
        else:
            xy = engine.points()
            dots = place(xy[np.lexsort((xy[:, 1], xy[:, 0]))])
        cut = stones.get(name)
        if cut is not None and len(cut):
            corners = " ".join(f"{x:g},{y:g}" for x, y in place(cut.chord[:, 0]))
            lines.append(f'<path class="stones" d="{_arcs(cut, place, scale)}"/>')
            lines.append(f'<path class="cut" d="M{corners}Z"/>')
            marks = "".join(f"M{corner}h0" for corner in corners.split())
            lines.append(f'<path class="corners" d="{marks}"/>')
            dots = []
        if dots:
            marks = "".join(f"M{x:g},{y:g}h0" for x, y in dots)
            lines.append(f'<path class="dots" d="{marks}"/>')
        if len(boundary.inside):
            arm = f"l{CROSS},{CROSS}m0,-{CROSS}l-{CROSS},{CROSS}"
            inside = place(engine.points(boundary.inside))
            marks = "".join(f"M{x - CROSS / 2:g},{y - CROSS / 2:g}{arm}" for x, y in inside)
            lines.append(f'<path class="inside" d="{marks}"/>')
        lines.append("</g>")
    return "\n".join([*lines, "</svg>\n"])


def curve(control: NDArray[np.float64]) -> str:
    """Return a picture of a closed curve of Bezier segments, (n, 3 or 4, 2): cubic or quadratic.

    Each segment is one command of the path, C or Q. The canvas holds the control points.
    """
    canvas = _Canvas([control.reshape(-1, 2)])
    style = f"<style>\n{STYLE}{_colours(LIGHT, 1)}"
    dark = f"@media (prefers-color-scheme: dark) {{\n{_colours(DARK, 1)}\n}}\n</style>"
    path = ""
    if len(control):
        places = canvas.place(control)
        (x, y), count = places[0, 0].tolist(), control.shape[1] - 1
        command = ("Q" if count == 2 else "C") + " ".join(["%g,%g"] * count)
        steps = command * len(control) % tuple(places[:, 1:].ravel().tolist())
        path = f'<path class="area object0" d="M{x:g},{y:g}{steps}Z"/>'
    return "\n".join([canvas.head, style, dark, path, "</svg>\n"])


class _Canvas:
    """Where points come to lie on a canvas that they fill, y pointing down."""

    def __init__(self, points: list[NDArray[np.float64]]) -> None:
        xy = np.concatenate([np.zeros((0, 2)), *points])
        low, high = (xy.min(axis=0), xy.max(axis=0)) if len(xy) else np.zeros((2, 2))
        self.low, self.scale = low, SIZE / (float((high - low).max()) or 1.0)
        width, self.height = (high - low) * self.scale + 2 * MARGIN
        box = f"0 0 {width:g} {self.height:g}"
        self.head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{box}">'

    def place(self, xy: NDArray[np.float64]) -> NDArray[np.float64]:
        """Bring points, (..., 2), onto the canvas, to a hundredth of a unit."""
        placed = (xy - self.low) * self.scale + MARGIN
        placed[..., 1] = self.height - placed[..., 1]
        rounded: NDArray[np.float64] = placed.round(2)
        return rounded


def _outermost(stones: Flintstones) -> NDArray[np.float64]:
    """Return where the rims of Flintstones reach farthest right, up, left and down."""
    found = []
    length = np.hypot(*(stones.chord[:, 1] - stones.chord[:, 0]).T)
    for side, sign in ((0, 1), (1, -1)):
        bulges = stones.radius[:, side] < FLAT * length  # others, by less than 1 / FLAT of it
        p, s = stones.chord[bulges, :1], stones.chord[bulges, 1:]
        arms = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
        tips = stones.center[bulges, side, np.newaxis]
        tips = tips + stones.radius[bulges, side, np.newaxis, np.newaxis] * arms
        c, d = s - p, tips - p
        beyond = sign * (c[..., 0] * d[..., 1] - c[..., 1] * d[..., 0]) > 0
        found.append(tips[beyond])
    return np.concatenate(found)


def _arcs(
    stones: Flintstones,
    place: Callable[[NDArray[np.float64]], list[tuple[float, float]]],
    scale: float,
) -> str:
    """Return the outlines: along the right arc to the end of the chord, back along the left."""
    parts = []
    ends = zip(place(stones.chord[:, 0]), place(stones.chord[:, 1]), strict=True)
    for (p, s), offset, radius in zip(ends, stones.offset, stones.radius, strict=True):
        if np.isinf(radius).all():
            continue  # nothing but the chord
        parts.append(f"M{p[0]:g},{p[1]:g}")
        # An arc is the larger one of its circle if the centre lies on its side of the chord.
        for (x, y), r, large in (
            (s, radius[1], offset[1] < 0),
            (p, radius[0], offset[0] > 0),
        ):
            r = float(r) * scale
            parts.append(
                f"A{r:.6g},{r:.6g} 0 {int(large)} 0 {x:g},{y:g}" if r < FLAT else f"L{x:g},{y:g}"
            )
        parts.append("Z")
    return "".join(parts)


def _colours(palette: list[str], count: int) -> str:
    return "\n".join(f".object{i} {{ color: {c} }}" for i, c in enumerate(palette[:count]))


def _text(name: str) -> str:
    return escape(FORBIDDEN.sub("\ufffd", name))
