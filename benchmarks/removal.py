"""Points that leave: one that leaves and one that comes, and what leaving the triangulation costs.

"Live" is a window: on top of N shuffled points, each new one is followed by a `side` that makes the
boundary right again; in the one case the oldest point leaves before it comes, in the other none
does. Both see the same points in the same order, in engines of their own.

"Triangulation only" takes points away in random order from a set that is triangulated and of which
nobody has asked for the boundary. CGAL is measured as C++ compiled here, without Python in between,
if its headers and a compiler are there: `Delaunay_triangulation_2` with the predicates that are
exact and the constructions that are not, its vertices removed by handle, in the same order.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import flintknap as fk
from benchmarks import sets, tables
from benchmarks.ours import bounded, triangulated
from benchmarks.timing import compare, ratio

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from benchmarks.sets import Points
    from benchmarks.timing import Clock

    Contender = Callable[[Clock], str]

SETS: dict[str, Callable[[int], Points]] = {
    "uniform": sets.uniform,
    "curve, noise of one spacing": sets.noisy_curve,
}
CHANGES, QUICK_CHANGES = 2000, 200  # of each round
COMES, PASSES = "one comes", "one leaves, one comes"

CGAL = r"""
#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/spatial_sort.h>

#include <cstdio>
#include <ctime>
#include <fstream>
#include <vector>

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Triangulation = CGAL::Delaunay_triangulation_2<Kernel>;

// Reads points; removes the first so many of them again, in that order; prints seconds.
int main(int, char** arguments) {
    std::ifstream in(arguments[1], std::ios::binary);
    std::vector<Kernel::Point_2> points;
    for (double xy[2]; in.read(reinterpret_cast<char*>(xy), sizeof xy);)
        points.emplace_back(xy[0], xy[1]);
    Triangulation t(points.begin(), points.end());
    points.resize(std::stoul(arguments[2]));
    std::vector<Triangulation::Vertex_handle> leaving;
    for (const auto& p : points) leaving.push_back(t.nearest_vertex(p));
    std::clock_t start = std::clock();
    for (auto v : leaving) t.remove(v);
    std::printf("%.9f\n", double(std::clock() - start) / CLOCKS_PER_SEC);
}
"""


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield a table of live changes, one of removals from the triangulation alone."""
    n = 10**4 if quick else 10**5
    yield live(n, QUICK_CHANGES if quick else CHANGES, quick=quick)
    yield triangulation(n, quick=quick)


def live(n: int, changes: int, *, quick: bool) -> tables.Table:
    """Return what a point costs that comes for another."""
    columns = ["set", "N", "", "µs a step", "times the first", "target", "rounds"]
    table = tables.Table("Live: one leaves and one comes", columns)
    for name, make in SETS.items():
        points = sets.shuffled(make(n + changes))
        found = compare({COMES: window(points, n, 0), PASSES: window(points, n, 1)}, n, quick=quick)
        times = ratio(found[PASSES], found[COMES])
        target = "" if quick or name != "uniform" else tables.at_most(3).judge(times)
        rounds = len(found[PASSES].micros)
        table.rows.append([name, n, COMES, found[COMES].median, "", "", rounds])
        table.rows.append([name, n, PASSES, found[PASSES].median, times, target, rounds])
    return table


def window(points: Points, n: int, leaving: int) -> Contender:
    """Insert what lies beyond the first n one by one, with so many leaving before each."""

    def run(clock: Clock) -> str:
        engine, more = fk.Engine(), points[n:].tolist()
        engine.insert(points[:n])
        bounded(engine)
        with clock.lap(len(more)):
            for oldest, (x, y) in enumerate(more):
                if leaving:
                    engine.remove(oldest)
                engine.insert(x, y)
                engine.side(x, y)
        return ""

    return run


def triangulation(n: int, *, quick: bool) -> tables.Table:
    """Return what leaving the triangulation costs."""
    table = tables.contest("Triangulation only", "set", "N", unit="a removal")
    for name, make in SETS.items():
        points = sets.shuffled(make(n))
        found = compare(
            {
                "flintknap, one call each": one_each(points, n // 10),
                "flintknap, one call": one_call(points, n // 10),
                "CGAL, C++": cgal(points, n // 10),
            },
            n,
            quick=quick,
        )
        judged = {} if quick else {"flintknap, one call each": tables.at_most(2)}
        tables.enter(table, [name, n], found, judged)
    return table


def one_each(points: Points, leaving: int) -> Contender:
    """Remove one point a call."""

    def run(clock: Clock) -> str:
        engine = fk.Engine()
        engine.insert(points)
        triangulated(engine)
        with clock.lap(leaving):
            for point in range(leaving):
                engine.remove(point)
        return ""

    return run


def one_call(points: Points, leaving: int) -> Contender:
    """Remove all of them in one call."""

    def run(clock: Clock) -> str:
        engine, ids = fk.Engine(), np.arange(leaving)
        engine.insert(points)
        triangulated(engine)
        with clock.lap(leaving):
            engine.remove(ids)
        return ""

    return run


def cgal(points: Points, leaving: int) -> Contender:
    """Compile CGAL's once, and run it in each round."""
    compiler = shlex.split(os.environ.get("CXX", "c++"))
    folder = Path(tempfile.mkdtemp(prefix="flintknap-cgal-"))
    source, program, data = folder / "removal.cpp", folder / "removal", folder / "points"

    def run(clock: Clock) -> str:
        if not program.exists():
            source.write_text(CGAL, encoding="utf-8")
            points.tofile(data)
            flags = ["-std=c++17", "-O3", "-DNDEBUG", str(source), "-lgmp", "-o", str(program)]
            if shutil.which(compiler[0]) is None:
                raise ModuleNotFoundError(compiler[0], name=compiler[0])
            if subprocess.run([*compiler, *flags], capture_output=True).returncode != 0:
                raise ModuleNotFoundError("CGAL", name="CGAL")
        done = subprocess.run([program, data, str(leaving)], capture_output=True, check=True)
        clock.lap(leaving)
        clock.laps.append(float(done.stdout))
        return ""

    return run
