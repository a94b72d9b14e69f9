"""An engine written to a file and read back, beside inserting its points once more.

"Inserted" is from points, shuffled, to the boundary; "inserted, triangulated" stops before the
boundary is made. What is loaded has all of that, ids, multiplicities and revision besides, and is
asked for its boundary. The file lies in a temporary folder; CPU time does not wait for disks.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import flintknap as fk
from benchmarks import sets, tables, timing
from benchmarks.ours import bounded, triangulated

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from benchmarks.sets import Points
    from benchmarks.timing import Clock, Contender

SETS: dict[str, Callable[[int], Points]] = {
    "uniform": sets.uniform,
    "curve, noise of one spacing": sets.noisy_curve,
}
FASTER = {"inserted": tables.at_most(1 / 3, "1/3")}


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield one table; of the file, the bytes a point are the last cell."""
    columns = ["set", "N"]
    table = tables.contest("To an engine with a boundary", *columns, unit="a point")
    for name, make in SETS.items():
        for n in (10**4,) if quick else (10**5, 10**6):
            points = sets.shuffled(make(n))
            with tempfile.TemporaryDirectory() as folder:
                found = timing.compare(contenders(points, Path(folder)), n, quick=quick)
            tables.enter(table, [name, n], found, FASTER if n == 10**6 else {})
    yield table


def contenders(points: Points, folder: Path) -> dict[str, Contender[str]]:
    """Return them all; those that write a file result in its size."""
    n, path = len(points), folder / "engine.snapshot"
    whole = fk.Engine()
    whole.insert(points)
    bounded(whole)
    whole.save(path)

    def loaded(clock: Clock) -> str:
        with clock.lap(n):
            bounded(fk.load(path))
        return ""

    def inserted(up_to: Callable[[fk.Engine], None]) -> Contender[str]:
        def contender(clock: Clock) -> str:
            engine = fk.Engine()
            with clock.lap(n):
                engine.insert(points)
                up_to(engine)
            return ""

        return contender

    def saved(clock: Clock) -> str:
        with clock.lap(n):
            whole.save(path)
        return f"{path.stat().st_size / n:.0f} bytes a point"

    return {
        "flintknap, loaded": loaded,
        "inserted": inserted(bounded),
        "inserted, triangulated": inserted(triangulated),
        "saved": saved,
    }
