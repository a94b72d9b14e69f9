"""Resident memory at 1e6 points with the boundary made, in bytes a point.

Each row is a process of its own: what it holds with the points made and the packages loaded is
subtracted from what it holds at the end, garbage collected, the input still there. So memory that
the allocator keeps after its use counts; "at most" is the highest it ever was. Read from /proc:
Linux only. "Counted" is what our kernel says that it allocated; capacity that was never written is
not resident. The peers hold a triangulation and no boundary.
"""

from __future__ import annotations

import gc
import json
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import flintknap as fk
from benchmarks import peers, sets, tables

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from benchmarks.sets import Points

SETS: dict[str, Callable[[int], Points]] = {"uniform": sets.uniform, "curve": sets.curve}
TARGET, LIVE_TARGET = tables.at_most(200), tables.at_most(260)
LIVE = 1000


def at_once(points: Points) -> fk.Engine:
    """Return an engine given all points in one call."""
    engine = fk.Engine()
    engine.insert(points)
    engine.boundary()
    return engine


def one_each(points: Points) -> fk.Engine:
    """Return an engine given one point a call and asked at the end."""
    engine = fk.Engine()
    for x, y in points:
        engine.insert(float(x), float(y))
    engine.boundary()
    return engine


def then_live(points: Points) -> fk.Engine:
    """Return an engine asked after every one of the last points."""
    engine = at_once(points[:-LIVE])
    for x, y in points[-LIVE:].tolist():
        engine.insert(x, y)
        engine.side(x, y)
    engine.boundary()
    return engine


def condeltri(points: Points) -> object:
    """Return a triangulation."""
    made = peers.condeltri()
    made.insert_vertices(points)
    return made


def scipy(points: Points) -> object:
    """Return a triangulation."""
    from scipy.spatial import Delaunay

    return Delaunay(points)


BUILD: dict[str, Callable[[Points], object]] = {
    "flintknap, at once": at_once,
    "flintknap, one call each": one_each,
    f"flintknap, {LIVE:,} of them live": then_live,
    "condeltri": condeltri,
    "scipy.spatial.Delaunay": scipy,
}


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield a table of bytes a point."""
    n = 10**5 if quick else 10**6
    columns = ["set", "", "resident", "target", "at most", "counted"]
    table = tables.Table(f"Bytes a point, N = {n:,}", columns)
    for name in SETS:
        for build in BUILD:
            if (name, build) == ("curve", "scipy.spatial.Delaunay"):
                continue  # takes its time there, and no other memory
            found = in_process_of_its_own(name, build, n)
            if "failure" in found:
                table.rows.append([name, build, "", found["failure"], "", ""])
                continue
            resident, is_ours = found["resident"] / n, build.startswith("flintknap")
            target = LIVE_TARGET if BUILD[build] is then_live else TARGET
            verdict = target.judge(resident) if is_ours and not quick else ""
            counted = found["counted"] / n if is_ours else ""
            table.rows.append([name, build, resident, verdict, found["most"] / n, counted])
    yield table


def in_process_of_its_own(name: str, build: str, n: int) -> dict[str, Any]:
    """Return what `measure` prints there."""
    command = [sys.executable, "-m", "benchmarks.memory", name, build, str(n)]
    done = subprocess.run(command, capture_output=True, check=True, text=True)
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def measure(name: str, build: str, n: int) -> dict[str, Any]:
    """Return bytes: resident in the end, at most, and as counted by our kernel."""
    points = sets.shuffled(SETS[name](n))
    try:
        BUILD[build](points[: 2 * LIVE])  # loads what it needs
    except ModuleNotFoundError as error:
        return {"failure": f"{error.name} is not installed"}
    gc.collect()
    before = status("VmRSS")
    Path("/proc/self/clear_refs").write_text("5")  # the highest mark starts anew
    made = BUILD[build](points)
    gc.collect()
    counted = made._kernel.bytes() if isinstance(made, fk.Engine) else 0
    return {
        "resident": status("VmRSS") - before,
        "most": status("VmHWM") - before,
        "counted": counted,
    }


def status(name: str) -> int:
    """Return bytes from the line of this process's status that starts with `name`."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(name):
            return 1024 * int(line.split()[1])
    raise OSError(f"/proc/self/status: got no {name}, expected one")


if __name__ == "__main__":
    print(json.dumps(measure(sys.argv[1], sys.argv[2], int(sys.argv[3]))))
