"""Draws widening.svg: a set whose constriction locks, and the same widened.

python docs/widening.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import flintknap as fk

SIZE, GAP, MARGIN = 420, 40, 14


def panel(engine: fk.Engine, left: float, title: str) -> list[str]:
    """Return the object, its points and what it left inside, as elements of SVG."""
    boundary, xy = engine.boundary(), engine.points()

    def place(points: np.ndarray) -> list[str]:
        at = points * (SIZE - 2 * MARGIN) + MARGIN
        return [f"{left + x:.1f},{SIZE - y:.1f}" for x, y in at.tolist()]

    ring = " ".join(place(boundary.xy))
    dots = "".join(f"M{p}h0" for p in place(xy))
    inside = "".join(f"M{p}h0" for p in place(engine.points(boundary.inside)))
    return [
        f'<path d="M{ring}Z" fill="#dbe7f3" stroke="#1f4e79" stroke-width="1"/>',
        f'<path d="{dots}" stroke="#1f4e79" stroke-width="3" stroke-linecap="round"/>',
        f'<path d="{inside}" stroke="#c0392b" stroke-width="8" stroke-linecap="round"/>',
        f'<text x="{left + MARGIN}" y="{SIZE + 22}">{title}</text>',
    ]


def main() -> None:
    """Write the picture beside this script."""
    points = np.random.default_rng(71).random((250, 2))
    elements = []
    for left, d_min in ((0.0, 0.0), (float(SIZE + GAP), -1.0)):
        engine = fk.Engine(d_min=d_min)
        engine.insert(points)
        found = engine.boundary()
        title = f"d = {found.d:.2f}, {len(found.inside)} of {len(points)} points inside"
        elements += panel(engine, left, title)
    width, height = 2 * SIZE + GAP, SIZE + 34
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}"'
    head += ' font-family="sans-serif" font-size="15" fill="none">'
    body = "\n".join(elements).replace("<text", '<text fill="#222"')
    target = Path(__file__).with_name("widening.svg")
    target.write_text(f"{head}\n{body}\n</svg>\n", encoding="utf-8")


if __name__ == "__main__":
    main()
