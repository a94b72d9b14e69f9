"""Points, shuffled, at once to the Delaunay triangulation.

Ours looks for duplicates, gives ids and triangulates canonically. The last cell counts the
triangles; Qhull may leave flat ones out or in, and startinpy merges points closer than 1e-13.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import flintknap as fk
from benchmarks import peers, sets, tables, timing
from benchmarks.ours import triangulated

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from benchmarks.sets import Points
    from benchmarks.timing import Clock, Contender

SETS: dict[str, Callable[[int], Points]] = {
    "uniform": sets.uniform,
    "curve": sets.curve,
    "grid": sets.grid,
}
TARGETS = {
    ("uniform", 10**6): {
        "flintknap": tables.at_most(0.55),
        "scipy.spatial.Delaunay": tables.at_most(1 / 12, "1/12"),
        "condeltri": tables.at_most(0.6),
    },
    ("curve", 10**6): {
        "flintknap": tables.at_most(0.7),
        "scipy.spatial.Delaunay": tables.at_most(1 / 40, "1/40"),
    },
}


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield a table for each set."""
    for name, make in SETS.items():
        table = tables.contest(f"{name}, shuffled", "N", unit="a point")
        for n in (10**4, 10**5) if quick else (10**4, 10**5, 10**6):
            points = sets.shuffled(make(n))
            found = timing.compare(contenders(points), n, quick=quick)
            tables.enter(table, [len(points)], found, TARGETS.get((name, n)))
        yield table


def contenders(points: Points) -> dict[str, Contender[int]]:
    """Return them all; each counts its triangles off the clock."""
    n = len(points)

    def flintknap(clock: Clock) -> int:
        engine = fk.Engine()
        with clock.lap(n):
            engine.insert(points)
            triangulated(engine)
        return len(engine.triangles())

    def scipy(clock: Clock) -> int:
        from scipy.spatial import Delaunay

        with clock.lap(n):
            made = Delaunay(points)
        return len(made.simplices)

    def condeltri(clock: Clock) -> int:
        made = peers.condeltri()
        with clock.lap(n):
            made.insert_vertices(points)
        made.erase_super_triangle()
        return made.triangles_count()

    def triangle(clock: Clock) -> int:
        import triangle

        with clock.lap(n):
            made = triangle.triangulate({"vertices": points}, "z")
        return len(made["triangles"])

    def startinpy(clock: Clock) -> int:
        made, places = peers.startinpy(), peers.with_height(points)
        with clock.lap(n):
            made.insert(places)
        return made.number_of_triangles()

    found: dict[str, Contender[int]] = {
        "flintknap": flintknap,
        "scipy.spatial.Delaunay": scipy,
        "condeltri": condeltri,
        "triangle": triangle,
    }
    if n <= 10**5:  # it walks without a start, N times the square root of N in all
        found["startinpy"] = startinpy
    return found
