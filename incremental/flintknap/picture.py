"""Pictures before they are drawn: from engines and layers to marks, and where all of them lie.

Theory of operation. A layer is a question to an engine (layers.py); its answer becomes marks:
shapes in the unit of the input, with a role each. What a role looks like is said once, in STYLES.
`svg.py` and `plot.py` draw marks, each in its own way, and need not know what they mean.

Equal sets of points give equal pictures, whatever their history: shapes are in the order of
coordinates, never in that of ids.

Cost: what the questions take, and O(n log n) for n points or edges, to sort them.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from flintknap import layers

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import NDArray

    from flintknap.engine import Engine
    from flintknap.flintstones import Flintstones
    from flintknap.layers import Layer

    Doubles = NDArray[np.float64]
    Box = tuple[Doubles, Doubles]  # the corner at the lower left, and the opposite one

SIZE = 1000  # of the longer side of a picture, in units of widths
MARGIN = 20  # on all sides
DEFAULT = "points,boundary"
ROOM = 8  # units that a vertex needs on average, or dots would run into a thicker line
CROWD = 400  # dots that have their full width; those of n do with the square root of its share
FLAT = 1e5  # from so many times the length of its chord on, a radius is that of a straight line

LIGHT = ["#2b6cb0", "#c05621", "#2f855a", "#6b46c1", "#0b7a8f", "#8f6a08"]  # of objects
DARK = ["#63b3ed", "#f6ad55", "#68d391", "#b794f4", "#4fd1e5", "#ecc94b"]


class Style(NamedTuple):
    """How marks of a role look.

    Attributes:
        width: of lines and dots, in units.
        fill: how opaque the inside is, from 0 to 1.
        light: colour on a light page; "" for that of the object.
        dark: colour on a dark page, likewise.

    """

    width: float
    fill: float = 0.0  # opacity of the inside
    light: str = ""
    dark: str = ""


STYLES = {
    "edges": Style(0.75, 0.0, "#8a94a0", "#7b8794"),
    "area": Style(1.5, 0.15),
    "dots": Style(4.0),
    "inside": Style(2.0, 0.0, "#d6246e", "#ff6fa8"),
    "stones": Style(0.75, 0.28, "#b7791f", "#d69e2e"),
    "cut": Style(2.0, 0.0, "#c53030", "#fc8181"),
    "corners": Style(5.0, 0.0, "#c53030", "#fc8181"),
    "curve": Style(2.0, 0.0, "#97266d", "#f687b3"),
    "control": Style(0.75, 0.0, "#718096", "#a0aec0"),
    "handles": Style(3.0, 0.0, "#718096", "#a0aec0"),
}


class Polygon(NamedTuple):
    """A closed polygon with vertices ``xy``, float64 (n, 2)."""

    xy: Doubles


class Segments(NamedTuple):
    """Straight lines between ``ends``, float64 (n, 2, 2), from [:, 0] to [:, 1]."""

    ends: Doubles


class Dots(NamedTuple):
    """Round dots at ``xy``, float64 (n, 2)."""

    xy: Doubles


class Crosses(NamedTuple):
    """Diagonal crosses at ``xy``, float64 (n, 2)."""

    xy: Doubles


class Curve(NamedTuple):
    """A closed curve of Bezier segments by their ``control`` points, float64 (n, 3 or 4, 2)."""

    control: Doubles


class Lenses(NamedTuple):
    """The areas of ``stones``: each between an arc right of its chord and one left of it."""

    stones: Flintstones


Shape: TypeAlias = Polygon | Segments | Dots | Crosses | Curve | Lenses


class Mark(NamedTuple):
    """Something to draw: a ``shape`` in the unit of the input, and its ``role`` in STYLES."""

    role: str
    shape: Shape


class Group(NamedTuple):
    """The ``marks`` of an object in the order of drawing, and in ``title`` what is said of it."""

    title: str
    marks: list[Mark]


class Picture(NamedTuple):
    """The ``groups`` of objects in the order of drawing, the ``box`` to be seen, a ``title``."""

    title: str
    box: Box
    groups: list[Group]


def compose(
    objects: Mapping[str, Engine], chosen: str | None = None, *, box: Box | None = None
) -> Picture:
    """Return the picture of some layers of all objects, later objects over earlier ones.

    ``chosen`` is as in layers.py; if left out, the boundary, and the points where they are
    not crowded. ``box`` is what is to be seen, if not all there is.

    Raises InputError for what is no list of layers.
    """
    wanted = layers.parse(DEFAULT if chosen is None else chosen)
    drawn = {name: [m for each in wanted for m in marks(e, each)] for name, e in objects.items()}
    seen = extent(mark for each in drawn.values() for mark in each) if box is None else box
    groups = []
    for (name, engine), these in zip(objects.items(), drawn.values(), strict=True):
        ring = engine.boundary()
        if chosen is None and ring.length * scale(seen) < ROOM * len(ring):
            these = [mark for mark in these if mark.role != "dots"]
        groups.append(Group(f"{name}: {ring.status}, {len(engine)} points", these))
    return Picture(", ".join(objects), seen, groups)


def marks(engine: Engine, layer: Layer) -> list[Mark]:
    """Return the marks of a layer of an object."""
    match layer.kind:
        case "points":
            return [Mark("dots", Dots(_sorted(engine.points())))]
        case "graph":
            return [Mark("edges", Segments(_edges(engine, layer)))]
        case "boundary":
            ring = engine.boundary()
            inside = [Mark("inside", Crosses(engine.points(ring.inside)))]
            return [Mark("area", Polygon(ring.xy)), *(inside if len(ring.inside) else [])]
        case "approximation":
            return approximation(engine.approximate(**layer.options).xy)
        case "flintstones":
            return [Mark("stones", Lenses(engine.localize(**layer.options)))]
        case "smooth":
            return [Mark("curve", Curve(engine.smooth(**layer.options).control))]
    control = engine.smooth(**layer.options).control
    return [
        Mark("control", Polygon(control[:, :-1].reshape(-1, 2))),
        Mark("handles", Dots(control[:, 1:-1].reshape(-1, 2))),
    ]


def approximation(xy: Doubles) -> list[Mark]:
    """Return the marks of an approximation with these vertices."""
    return [Mark("cut", Polygon(xy)), Mark("corners", Dots(xy))]


def width(mark: Mark) -> float:
    """Return the width of its lines or dots, in units: dots are smaller where there are many."""
    full = STYLES[mark.role].width
    if isinstance(mark.shape, Dots) and len(mark.shape.xy) > CROWD:
        return max(1.0, full * math.sqrt(CROWD / len(mark.shape.xy)))
    return full


def extent(of: Iterable[Mark]) -> Box:
    """Return the box that holds all these marks; a single place if there is none."""
    xy = np.concatenate([np.zeros((0, 2)), *(_outermost(mark.shape) for mark in of)])
    return (xy.min(axis=0), xy.max(axis=0)) if len(xy) else (np.zeros(2), np.zeros(2))


def scale(box: Box) -> float:
    """Return how many units of a picture of a box are a unit of the input."""
    return SIZE / (float((box[1] - box[0]).max()) or 1.0)


def bulges(stones: Flintstones) -> NDArray[np.bool_]:
    """Tell which sides of Flintstones, (n, 2), are arcs that an eye could tell from the chord."""
    step = stones.chord[:, 1] - stones.chord[:, 0]
    narrow: NDArray[np.bool_] = stones.radius < FLAT * np.hypot(step[:, :1], step[:, 1:])
    return narrow


def _outermost(shape: Shape) -> Doubles:
    """Return places, (n, 2), of which some are farthest right, up, left and down in the shape."""
    match shape:
        case Polygon(xy) | Dots(xy) | Crosses(xy):
            return xy
        case Segments(xy) | Curve(xy):
            return xy.reshape(-1, 2)
    stones = shape.stones
    found = [stones.chord.reshape(-1, 2)]
    for side, sign in ((0, 1), (1, -1)):
        wide = bulges(stones)[:, side]  # others reach less than 1 / FLAT of their chord beyond it
        p, s = stones.chord[wide, :1], stones.chord[wide, 1:]
        arms = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
        tips = stones.center[wide, side, np.newaxis]
        tips = tips + stones.radius[wide, side, np.newaxis, np.newaxis] * arms
        c, d = s - p, tips - p
        beyond = sign * (c[..., 0] * d[..., 1] - c[..., 1] * d[..., 0]) > 0
        found.append(tips[beyond])
    return np.concatenate(found)


def _sorted(xy: Doubles) -> Doubles:
    return xy[np.lexsort((xy[:, 1], xy[:, 0]))]


def _edges(engine: Engine, layer: Layer) -> Doubles:
    """Return the edges of a graph, (m, 2, 2), each and all in the order of coordinates."""
    rows, ids, xy = engine.edges(**layer.options), engine.ids(), engine.points()
    order = np.lexsort((xy[:, 1], xy[:, 0]))
    rank = np.empty(len(xy), np.int64)
    rank[order] = np.arange(len(xy))
    ends = np.sort(rank[np.searchsorted(ids, rows)], axis=1)
    return xy[order][ends[np.lexsort((ends[:, 1], ends[:, 0]))]]
