"""Figure 7 of the 1993 paper once more: approximations of the Benelux, with their Flintstones.

`python docs/figure7.py` replays the log and writes figure7.svg beside itself: levels 2, 4 and 6,
and an adaptive one, in which only edges that stray too far were split.
"""

from __future__ import annotations

import re
from pathlib import Path

from flintknap import export
from flintknap.replay import replay

HERE = Path(__file__).parent
LOG = HERE.parent / "replay_logs" / "benelux.jsonl.gz"
CUTS = [{"level": 2}, {"level": 4}, {"level": 6}, {"tolerance": 8.0}]
PANEL, CAPTION = 500, 40  # units wide and high, and below it


def main() -> None:
    """Write the figure."""
    objects = replay(LOG).engines
    (engine,) = objects.values()
    width, height = 2 * PANEL, 2 * (PANEL + CAPTION)
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}">',
        "<title>Approximations of the Benelux and their Flintstones</title>",
        "<style>text { font: 20px sans-serif; text-anchor: middle; fill: #555 }",
        "@media (prefers-color-scheme: dark) { text { fill: #bbb } }</style>",
    ]
    for index, cut in enumerate(CUTS):
        found = engine.localize(**cut)
        name = f"level {cut['level']}" if "level" in cut else f"within {cut['tolerance']:g} km"
        caption = f"{name}: {len(found)} of {len(engine.boundary())} vertices"
        x, y = index % 2 * PANEL, index // 2 * (PANEL + CAPTION)
        place = f'<svg x="{x}" y="{y}" width="{PANEL}" height="{PANEL}" '
        lines.append(re.sub("<svg xmlns=[^ ]* ", place, export.svg(objects, **cut).rstrip()))
        lines.append(f'<text x="{x + PANEL / 2:g}" y="{y + PANEL + 24}">{caption}</text>')
    (HERE / "figure7.svg").write_text("\n".join([*lines, "</svg>\n"]), encoding="utf-8")


if __name__ == "__main__":
    main()
