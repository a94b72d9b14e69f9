"""Draw the gamma-spectrum on one point set: `python docs/spectrum.py` writes docs/spectrum.svg.

From the void to the complete graph. Edges that came since the graph before are in the accent
colour. Colours fit light and dark surroundings: the file asks which it is in.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import flintknap as fk

PANEL, MARGIN, GAP, CAPTION = 240, 12, 24, 40
STYLE = """
    text { font: 13px system-ui, sans-serif; fill: #1f2328; }
    .small { font-size: 11px; fill: #59636e; }
    circle { fill: #1f2328; }
    path { fill: none; stroke-width: 0.9; stroke: #8c959f; }
    .new { stroke: #bc4c00; }
    @media (prefers-color-scheme: dark) {
      text { fill: #e6edf3; }
      .small { fill: #9198a1; }
      circle { fill: #e6edf3; }
      path { stroke: #6e7681; }
      .new { stroke: #f0883e; }
    }
"""
FRONT = "&#947;([{}, 1], [{}, 1])"
GRAPHS = [
    ("void", FRONT.format(1, 1), {"graph": "void"}),
    ("Gabriel", FRONT.format(0, 0), {"graph": "gabriel"}),
    ("Delaunay", FRONT.format("&#8722;1", 0), {"graph": "delaunay"}),
    ("d = &#8722;0.3", FRONT.format("&#8722;1", "&#8722;0.3"), {"gamma1": (-0.3, 1)}),
    ("d = &#8722;0.7", FRONT.format("&#8722;1", "&#8722;0.7"), {"gamma1": (-0.7, 1)}),
    ("complete", FRONT.format("&#8722;1", "&#8722;1"), {"graph": "complete"}),
]


def points() -> np.ndarray:
    """Return points about a clover, and some within."""
    rng = np.random.default_rng(7)
    t = (np.arange(18) + 0.7 * rng.random(18)) * (2 * np.pi / 18)
    radius = 1 + 0.3 * np.cos(3 * t)
    rim = np.column_stack((radius * np.cos(t), radius * np.sin(t)))
    return np.concatenate((rim, rng.normal(0, 0.3, (5, 2))))


def panel(xy: np.ndarray, edges: np.ndarray, before: set[tuple[int, int]]) -> list[str]:
    """Return the lines of one graph: old edges, new edges, points."""
    old, new = [], []
    for a, b in edges.tolist():
        (x, y), (u, v) = xy[a], xy[b]
        (old if (a, b) in before else new).append(f"M{x:.1f} {y:.1f}L{u:.1f} {v:.1f}")
    paths = [f'<path d="{"".join(old)}"/>', f'<path class="new" d="{"".join(new)}"/>']
    return [p for p in paths if 'd=""' not in p] + [
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5"/>' for x, y in xy
    ]


def draw() -> str:
    """Return the picture."""
    xy = points()
    engine = fk.Engine()
    engine.insert(xy)
    low, high = xy.min(axis=0), xy.max(axis=0)
    scale = (PANEL - 2 * MARGIN) / max(high - low)
    at = PANEL / 2 + (xy - (low + high) / 2) * scale * [1, -1]
    width, height = 3 * PANEL + 2 * GAP, 2 * (PANEL + CAPTION) + GAP
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        f'width="{width}" height="{height}">',
        "<title>The &#947;-spectrum on one point set</title>",
        f"<style>{STYLE}</style>",
    ]
    before: set[tuple[int, int]] = set()
    for place, (name, parameters, asked) in enumerate(GRAPHS):
        row, column = divmod(place, 3)
        left, top = column * (PANEL + GAP), row * (PANEL + CAPTION + GAP)
        edges = engine.edges(**asked)
        parts.append(f'<g transform="translate({left} {top})">')
        parts += panel(at, edges, before)
        count = f"{len(edges)} edge{'' if len(edges) == 1 else 's'}"
        parts.append(f'<text x="{MARGIN}" y="{PANEL + 14}">{name}</text>')
        parts.append(
            f'<text class="small" x="{MARGIN}" y="{PANEL + 31}">{parameters} · {count}</text></g>'
        )
        before = {(a, b) for a, b in edges.tolist()}
    return "\n".join([*parts, "</svg>", ""])


if __name__ == "__main__":
    Path(__file__).with_suffix(".svg").write_text(draw(), encoding="utf-8")
