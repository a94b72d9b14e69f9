"""The pictures of the documentation: figures of the 1993 paper once more, and some of our own.

`python docs/gallery.py` draws them all and writes each beside itself. They fit light and dark
surroundings, and the same code makes the same files.

    benelux    what the first command of the README draws
    figure2    77 points on the silhouette of a chalice, and their Delaunay triangulation
    figure5    constriction of it: the boundary in the triangulation, and by itself
    figure7    approximations of the Benelux, with their Flintstones
    figure9    from a polygon to its smooth curve, by way of the control polygon
    spectrum   the gamma-spectrum, from the void to the complete graph
    widening   a set whose constriction locks, and the same widened
    pinwheel   a set that widening locks, before and after
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

import flintknap as fk
from flintknap import picture, svg
from flintknap.picture import Dots, Group, Mark, Picture, Segments
from flintknap.replay import replay

HERE = Path(__file__).parent
LOG = HERE.parent / "replay_logs" / "benelux.jsonl.gz"

GAP, LINE, FOOT = 24, 20, 4  # units: between panels, of a line of text, below the last one
TEXT = """\
.flintknap text { font: 15px system-ui, sans-serif; text-anchor: middle; fill: #1f2328 }
.flintknap text + text { font-size: 13px; fill: #59636e }
@media (prefers-color-scheme: dark) {
.flintknap text { fill: #e6edf3 }
.flintknap text + text { fill: #9198a1 }
}"""
CUTS = ["2", "4", "6", "tolerance=8"]
GRAPHS = [
    ("void", (1, 1), (1, 1)),
    ("Gabriel", (0, 1), (0, 1)),
    ("Delaunay", (-1, 1), (0, 1)),
    ("d = −0.3", (-1, 1), (-0.3, 1)),
    ("d = −0.7", (-1, 1), (-0.7, 1)),
    ("complete", (-1, 1), (-1, 1)),
]

# A chalice seen a little from above, in millimetres from the front of its foot: drawn by eye.
# fmt: off
CHALICE = [
    (0, -12), (24, -11), (45, -7), (64, -1), (74, 10), (73, 18), (59, 24), (46, 28), (33, 34),
    (24, 44), (18, 58), (15, 71), (22, 79), (23, 87), (15, 92), (12, 103), (12, 116), (20, 122),
    (33, 128), (40, 138), (42, 150), (35, 160), (22, 166), (13, 173), (11, 185), (19, 194),
    (36, 199), (52, 206), (65, 215), (75, 228), (82, 243), (86, 259), (86, 271), (89, 283),
    (93, 294), (83, 303), (62, 309), (38, 313), (14, 314), (-13, 313), (-38, 313), (-62, 309),
    (-83, 304), (-93, 294), (-90, 283), (-87, 272), (-85, 259), (-81, 243), (-74, 227), (-65, 214),
    (-51, 206), (-37, 198), (-20, 193), (-12, 183), (-12, 173), (-22, 165), (-36, 160), (-42, 151),
    (-40, 138), (-33, 128), (-19, 122), (-11, 116), (-11, 104), (-14, 93), (-23, 85), (-23, 77),
    (-14, 72), (-19, 58), (-24, 46), (-33, 34), (-45, 27), (-59, 24), (-73, 18), (-75, 10),
    (-64, 1), (-46, -7), (-24, -11),
]
# A knapped flint.
FLINT = [
    (0, 40), (5, 18), (26, 5), (52, 11), (74, 0), (100, 14), (128, 19), (153, 38), (124, 47),
    (104, 63), (76, 60), (52, 76), (24, 71), (6, 60),
]
# The first is left inside when the second has been reached.
SPIRAL = [
    (69, 87), (77, 188), (114, 80), (72, 124), (23, 93), (54, 63), (95, 51), (120, 173), (0, 96),
    (16, 0), (106, 36), (127, 78), (69, 197), (403, 383), (41, 217),
]
# fmt: on


class Panel(NamedTuple):
    """A picture, and the lines of the caption below it."""

    picture: Picture
    caption: list[str]


def main() -> None:
    """Write all pictures."""
    for name, text in pictures().items():
        (HERE / f"{name}.svg").write_text(text, encoding="utf-8")


def pictures() -> dict[str, str]:
    """Return the text of each picture by its name."""
    benelux = replay(LOG).engines
    return {
        "benelux": svg.draw(benelux),
        "figure2": figure2(),
        "figure5": figure5(),
        "figure7": figure7(benelux["benelux"]),
        "figure9": figure9(),
        "spectrum": spectrum(),
        "widening": widening(),
        "pinwheel": pinwheel(),
    }


def figure2() -> str:
    """Return the points of the chalice beside their triangulation."""
    chalice = engine(CHALICE)
    edges = len(chalice.edges("delaunay"))
    return figure(
        "A chalice: its points and their Delaunay triangulation",
        [
            Panel(shown(chalice, "points"), [f"{len(chalice)} vertices"]),
            Panel(shown(chalice, "graph,points"), [f"γ([−1, 1], [0, 1]): {edges} edges"]),
        ],
        width=380,
    )


def figure5() -> str:
    """Return the boundary of the chalice in the triangulation, and by itself."""
    chalice = engine(CHALICE)
    ring = chalice.boundary()
    return figure(
        "A chalice: constriction of the Delaunay triangulation",
        [
            Panel(shown(chalice, "graph,points,boundary"), ["γ([−1, 1], [0, 1]) and the boundary"]),
            Panel(shown(chalice, "boundary"), [f"the boundary: {ring.status}, {len(ring)} edges"]),
        ],
        width=380,
    )


def figure7(benelux: fk.Engine) -> str:
    """Return approximations, all on the same scale."""
    shows = [f"flintstones:{cut},boundary" for cut in CUTS]
    lists = [each if "=" in each else f"{each},approximation:{each[12]}" for each in shows]
    box = picture.extent(
        mark for each in lists for mark in picture.compose({"": benelux}, each).groups[0].marks
    )
    panels = []
    for cut, each in zip(CUTS, lists, strict=True):
        tolerance = cut.partition("=")[2]
        stones = (
            benelux.localize(tolerance=float(tolerance))
            if tolerance
            else benelux.localize(level=int(cut))
        )
        caption = [
            f"adaptive, within {tolerance} km" if tolerance else f"level {cut}",
            f"{len(stones)} of {len(benelux.boundary())} vertices",
        ]
        panels.append(Panel(shown(benelux, each, box), caption))
    title = "Approximations of the Benelux, and their Flintstones"
    thinner = {"area": 1, "cut": 1.25, "corners": 3.5}
    return figure(title, panels, width=440, thinner=thinner)


def figure9() -> str:
    """Return a polygon above its control polygon and curve."""
    flint = engine(FLINT)
    curve = flint.smooth()
    smooth = shown(flint, "control,smooth,points")
    caption = f"{len(curve)} cubic Bézier segments, G¹ at each vertex, and their control polygon"
    return figure(
        "A flint: its polygon, and the smooth curve through its vertices",
        [
            Panel(shown(flint, "points,boundary", smooth.box), [f"{len(flint)} vertices, joined"]),
            Panel(smooth, [caption]),
        ],
        width=620,
        columns=1,
    )


def spectrum() -> str:
    """Return graphs of the gamma-family; what is new since the graph before stands out."""
    rng = np.random.default_rng(7)
    t = (np.arange(18) + 0.7 * rng.random(18)) * (2 * np.pi / 18)
    radius = 1 + 0.3 * np.cos(3 * t)
    rim = np.column_stack((radius * np.cos(t), radius * np.sin(t)))
    clover = engine(np.concatenate((rim, rng.normal(0, 0.3, (5, 2)))))
    xy = clover.points()
    panels, before = [], np.zeros((0, 2), np.int64)
    for name, gamma0, gamma1 in GRAPHS:
        edges = clover.edges(gamma0=gamma0, gamma1=gamma1)
        is_old = (edges[:, np.newaxis] == before).all(axis=2).any(axis=1)
        marks = [
            Mark("edges", Segments(xy[edges[is_old]])),
            Mark("cut", Segments(xy[edges[~is_old]])),
            Mark("dots", Dots(xy)),
        ]
        drawn = Picture("", picture.extent(marks), [Group("", marks)])
        intervals = ", ".join(f"[{low:g}, {high:g}]" for low, high in (gamma0, gamma1))
        count = f"{len(edges)} edge{'' if len(edges) == 1 else 's'}"
        caption = [f"{name}", f"γ({intervals.replace('-', '−')}) · {count}"]
        panels.append(Panel(drawn, caption))
        before = edges
    title = "The γ-spectrum on one set of points"
    return figure(title, panels, width=260, columns=3, thinner={"cut": 1})


def widening() -> str:
    """Return what constriction leaves inside, and what becomes of it."""
    points = np.random.default_rng(71).random((250, 2))
    panels = []
    for d_min in (0.0, -1.0):
        made = engine(points, d_min)
        ring = made.boundary()
        caption = f"d = {ring.d:.2f}: {len(ring.inside)} of {len(made)} points inside"
        panels.append(Panel(shown(made, "points,boundary"), [caption.replace("-", "−")]))
    return figure("Constriction that locks, and the same widened", panels, width=440)


def pinwheel() -> str:
    """Return a spiral that one edge of widening closes."""
    panels = []
    for d_min, caption in ((0.0, "locked, two points inside"), (-1.0, "one of them reached")):
        made = engine(SPIRAL, d_min)
        panels.append(Panel(shown(made, "graph,points,boundary"), [caption]))
    return figure("A pinwheel that widening makes", panels, width=440)


def engine(points: object, d_min: float = -1.0) -> fk.Engine:
    """Return an engine that holds these points."""
    made = fk.Engine(d_min)
    made.insert(np.array(points, np.float64))
    return made


def shown(of: fk.Engine, layers: str, box: picture.Box | None = None) -> Picture:
    """Return a picture of an object without a name."""
    (group,) = picture.compose({"": of}, layers, box=box).groups
    return Picture("", box or picture.extent(group.marks), [Group("", group.marks)])


def figure(
    title: str,
    panels: list[Panel],
    *,
    width: float,
    columns: int = 2,
    thinner: dict[str, float] | None = None,
) -> str:
    """Return panels of some width in rows, each with its caption, as one picture.

    ``thinner`` has the widths of marks, by their role, that would be too thick on small panels.
    """
    widths = [f".flintknap .{r} {{ stroke-width: {w:g} }}" for r, w in (thinner or {}).items()]
    canvases = [svg.Canvas(panel.picture.box) for panel in panels]
    sizes = [tuple(map(float, canvas.box.split()[2:])) for canvas in canvases]
    scale = min(width / w for w, _ in sizes)
    high = max(h for _, h in sizes) * scale
    row = high + LINE * max(len(panel.caption) for panel in panels) + GAP
    whole = columns * (width + GAP) - GAP, -(-len(panels) // columns) * row - GAP + FOOT
    groups = [group for panel in panels for group in panel.picture.groups]
    lines = [
        svg.head(f"0 0 {whole[0]:g} {whole[1]:g}"),
        f"<title>{title}</title>",
        svg.stylesheet(groups, 1),
        "\n".join(["<style>", TEXT, *widths, "</style>"]),
    ]
    for index, (panel, canvas, (w, h)) in enumerate(zip(panels, canvases, sizes, strict=True)):
        left, top = index % columns * (width + GAP), index // columns * row
        place = f'x="{left + (width - w * scale) / 2:g}" y="{top + (high - h * scale) / 2:g}"'
        size = f'width="{w * scale:g}" height="{h * scale:g}"'
        lines.append(f'<svg {place} {size} viewBox="{canvas.box}">')
        lines += svg.elements(panel.picture.groups[0], canvas, 0)
        lines.append("</svg>")
        lines.append(f'<g transform="translate({left + width / 2:g} {top + high:g})">')
        for number, line in enumerate(panel.caption, 1):
            lines.append(f'<text y="{number * LINE - 4}">{line}</text>')
        lines.append("</g>")
    return "\n".join([*lines, "</svg>\n"])


if __name__ == "__main__":
    main()
