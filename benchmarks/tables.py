"""Tables of figures beside their targets, in Markdown, and the machine they were made on."""

from __future__ import annotations

import math
import os
import platform
import sys
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks import timing

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

PACKAGES = ["flintknap", "numpy", "msgspec", "scipy", "shapely"]
PACKAGES += ["concave_hull", "condeltri", "startinpy", "triangle"]


@dataclass(frozen=True)
class Target:
    """A bound that a figure is to keep, as `text` states it."""

    text: str
    bound: float
    at_least: bool = False

    def judge(self, figure: float) -> str:
        """Return the target and whether the figure keeps it."""
        kept = figure >= self.bound if self.at_least else figure <= self.bound
        return f"{self.text}: {'met' if kept else 'MISSED'}"


def at_most(bound: float, text: str = "") -> Target:
    """Return the target "no more than bound"."""
    return Target(f"≤ {text or number(bound)}", bound)


def at_least(bound: float, text: str = "") -> Target:
    """Return the target "no less than bound"."""
    return Target(f"≥ {text or number(bound)}", bound, at_least=True)


@dataclass
class Table:
    """Rows of cells under their headings; numbers are rounded when they are shown."""

    title: str
    columns: Sequence[str]
    about: str = ""
    rows: list[Sequence[Any]] = field(default_factory=list)

    def markdown(self) -> str:
        """Return title, remark and table."""
        numeric = [
            any(isinstance(row[c], int | float) for row in self.rows)
            for c in range(len(self.columns))
        ]
        lines = [self.columns, ["---:" if right else "---" for right in numeric]]
        lines += [[_cell(value) for value in row] for row in self.rows]
        body = "\n".join(f"| {' | '.join(line)} |" for line in lines)
        return "\n\n".join(filter(None, (f"## {self.title}", self.about, body))) + "\n"


def contest(title: str, *case: str, unit: str, about: str = "") -> Table:
    """Return an empty table for `enter`, the columns of `case` first."""
    columns = [*case, "", f"µs {unit}", "flintknap / this", "target", "rounds", ""]
    return Table(title, columns, about)


def enter(
    table: Table,
    case: Sequence[Any],
    found: Mapping[str, timing.Measured[Any]],
    targets: Mapping[str, Target] | None = None,
) -> None:
    """Add a row for each contender, its result in the last cell; the first is ours.

    A target is set to microseconds if the contender is one of ours, else to the ratio.
    """
    first = next(iter(found.values()))
    for name, this in found.items():
        if this.failure:
            table.rows.append([*case, name, "", "", "", "", this.failure])
            continue
        is_ours = name.startswith("flintknap")
        figure = this.median if is_ours else timing.ratio(first, this)
        target = (targets or {}).get(name)
        verdict = target.judge(figure) if target else ""
        shown = ["" if is_ours else figure, verdict, len(this.micros), this.result or ""]
        table.rows.append([*case, name, this.median, *shown])


def number(value: float) -> str:
    """Return a number with three significant digits and no exponent."""
    magnitude = math.floor(math.log10(abs(value))) if value else 0
    return f"{value:,.{max(0, 2 - magnitude)}f}"


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return number(value)
    return f"{value:,}" if isinstance(value, int) else str(value)


def setting() -> str:
    """Return when and on what this runs."""
    processor = platform.processor() or platform.machine()
    information = Path("/proc/cpuinfo")
    if information.exists():
        names = [n for n in information.read_text().splitlines() if n.startswith("model name")]
        processor = names[0].split(":")[1].strip() if names else processor
    when = datetime.now(UTC)
    lines = [
        f"{when:%-d %B %Y}, {when:%H:%M} UTC.",
        f"{processor}, {os.cpu_count()} cores, load averages before the run: {load()}.",
        f"{platform.system()} {platform.release()}, {platform.python_implementation()}"
        f" {platform.python_version()}, {sys.platform} {platform.machine()}.",
        ", ".join(f"{name} {_version(name)}" for name in PACKAGES) + ".",
    ]
    return "\n".join(lines) + "\n"


def load() -> str:
    """Return how many processes wanted to run in the last 1, 5 and 15 minutes."""
    return " ".join(f"{value:.1f}" for value in os.getloadavg())


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
