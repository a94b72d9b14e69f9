"""One more point on top of N, and the boundary repaired: what it costs and what it touches.

Each round builds an engine with N points of the set, shuffled (the cost from scratch, from points
to ring; "constriction" is the share of it after the triangulation), asks one question and inserts
one point, and then inserts further points of the same set one by one, each followed by a `side`
that makes the boundary right again, ring included. The "first change" after a run from scratch
makes what all later ones need, an order of events and of the ring that can be changed: O(N), once,
and so it stands by itself. "Times cheaper" is the median of the costs from scratch over the mean of
the later inserts; ± is the standard error of that mean. "Read out" is what `boundary()` takes to
copy the repaired ring into arrays, if anybody wants it: that is O(N), and in no other figure but
the cost from scratch.

The engines do not widen (d_min = 0), so that the constriction and its repair are what is measured;
what widening adds stands in widening.md.

A repair touches an event if it undoes or makes it. The true change of an insert, looked up for a
few, is how many captures (which triangle was entered, through which edge) were there before and are
not after, or the other way round: no repair can touch fewer. Growth exponents compare the largest N
with 10,000: 0 is no growth, 1 is linear. Sets and sizes take turns, a quarter of the inserts of
each in a turn, so that what else the machine does meets all of them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from statistics import fmean, median
from typing import TYPE_CHECKING

import numpy as np

import flintknap as fk
from benchmarks import sets, tables
from benchmarks.ours import triangulated
from benchmarks.timing import Clock

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from numpy.typing import NDArray

    from benchmarks.sets import Points

    Cases = Mapping[tuple[str, int], "Case"]

UNIFORM, NOISY, CLEAN = "uniform", "curve, noise of one spacing", "curve"
SETS: dict[str, Callable[[int, int], Points]] = {
    UNIFORM: sets.uniform,
    NOISY: sets.noisy_curve,
    CLEAN: sets.curve,
}
TARGETS = {
    (UNIFORM, 10**5): tables.at_least(400),
    (NOISY, 10**5): tables.at_least(800),
    (CLEAN, 10**5): tables.at_least(400),
}
GROWTH = {NOISY: tables.at_most(0.25), CLEAN: tables.at_most(0.25)}
TURNS = 4
SHARE = 20  # a round inserts no more than one point on top of so many: N stays N
INSERTS, QUICK_INSERTS = 4000, 400  # in all turns together
SAMPLES = 50  # further inserts of a round, their true change looked up; fewer on large sets
ALLOWANCE = 10.0  # seconds of inserts in all turns together


@dataclass
class Case:
    """What was measured for one set and one N: microseconds, and events."""

    triangulation: list[float] = field(default_factory=list)
    constriction: list[float] = field(default_factory=list)
    first: list[float] = field(default_factory=list)
    inserts: list[float] = field(default_factory=list)
    read_out: list[float] = field(default_factory=list)
    touched: list[int] = field(default_factory=list)
    sampled: list[tuple[int, int]] = field(default_factory=list)  # touched, true change


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield a table of costs, one of touched events, one of growth exponents."""
    sizes = (10**3, 10**4) if quick else (10**3, 10**4, 10**5, 10**6)
    inserts = QUICK_INSERTS if quick else INSERTS
    cases = {(name, n): Case() for name in SETS for n in sizes}
    for turn in range(TURNS):
        for (name, n), case in cases.items():
            chunk = min(inserts // TURNS, n // SHARE)
            rounds = inserts // chunk
            for seed in range(rounds * turn // TURNS, rounds * (turn + 1) // TURNS):
                measure(case, SETS[name], n, chunk, seed)
    yield costs(cases)
    yield touched(cases)
    yield exponents(cases)


def measure(
    case: Case, make: Callable[[int, int], Points], n: int, inserts: int, seed: int
) -> None:
    """Add a round, on a set of its own."""
    samples = max(5, min(SAMPLES, 10**7 // n // 2))
    points = sets.shuffled(make(n + inserts + samples + 2, seed), seed)
    first, *places, last = points[n:].tolist()
    places, further = places[:inserts], places[inserts:]
    engine, build, each, once = fk.Engine(d_min=0.0), Clock(), Clock(), Clock()
    with build.lap():
        engine.insert(points[:n])
        triangulated(engine)
    with build.lap():
        engine.boundary()
    engine.side(*last)
    with once.lap():
        engine.insert(*first)
        engine.side(*first)
    before = engine._kernel.touched()
    for x, y in places:
        with each.lap():
            engine.insert(x, y)
            engine.side(x, y)
        after = engine._kernel.touched()
        case.touched.append(after - before)
        before = after
        if each.seconds > ALLOWANCE / TURNS:
            break
    case.sampled += true_changes(engine, further)
    engine.insert(*last)
    engine.side(*last)
    with once.lap():
        engine.boundary()
    case.triangulation.append(1e6 * build.laps[0])
    case.constriction.append(1e6 * build.laps[1])
    case.inserts += [1e6 * lap for lap in each.laps]
    case.first.append(1e6 * once.laps[0])
    case.read_out.append(1e6 * once.laps[1])


def true_changes(engine: fk.Engine, places: list[list[float]]) -> Iterator[tuple[int, int]]:
    """Yield, for each place inserted, events touched, and captures that went or came."""
    before, captured = engine._kernel.touched(), captures(engine)
    for x, y in places:
        engine.insert(x, y)
        engine.side(x, y)
        after, captured_after = engine._kernel.touched(), captures(engine)
        yield after - before, len(np.setxor1d(captured, captured_after, assume_unique=True))
        before, captured = after, captured_after


def captures(engine: fk.Engine) -> NDArray[np.void]:
    """Return the gates taken, each as one value."""
    gates = engine._kernel.captures()
    return gates.view([("i", np.int64), ("j", np.int64), ("k", np.int64)]).ravel()


def costs(cases: Cases) -> tables.Table:
    """Return what an insert and a side cost, beside the cost from scratch."""
    columns = ["set", "N", "inserts", "mean µs", "±", "median µs", "p99 µs", "from scratch µs"]
    columns += ["constriction µs", "times cheaper", "target", "first change µs", "read out µs"]
    table = tables.Table("Cost of an insert and a side", columns)
    for (name, n), case in cases.items():
        micros = np.array(case.inserts)
        mean, error = fmean(case.inserts), micros.std() / len(micros) ** 0.5
        scratch = median(np.add(case.triangulation, case.constriction).tolist())
        target = TARGETS.get((name, n))
        cells = [mean, float(error), *np.percentile(micros, [50, 99]).tolist(), scratch]
        cells += [median(case.constriction), scratch / mean]
        verdict = target.judge(scratch / mean) if target else ""
        once = [median(case.first), median(case.read_out)]
        table.rows.append([name, n, len(micros), *cells, verdict, *once])
    return table


def touched(cases: Cases) -> tables.Table:
    """Return how many events an insert touches, and what each of them costs."""
    columns = ["set", "N", "mean", "median", "p99", "most", "µs an event"]
    columns += ["of a sample", "their true change"]
    table = tables.Table("Events touched by it", columns)
    for (name, n), case in cases.items():
        mean, cells = fmean(case.touched), np.percentile(case.touched, [50, 99, 100])
        sample = np.mean(case.sampled, axis=0).tolist()
        per_event = fmean(case.inserts) / max(mean, 1)
        table.rows.append([name, n, mean, *cells.tolist(), per_event, *sample])
    return table


def exponents(cases: Cases) -> tables.Table:
    """Return how fast the costs grow with N."""
    last = max(n for _, n in cases)
    low = min(10**4, last // 10)
    columns = ["set", "mean µs", "target", "median µs", "mean touched", "median touched"]
    table = tables.Table(f"Growth exponents, N = {low:,} to {last:,}", columns)
    for name in SETS:
        small, large = cases[name, low], cases[name, last]
        row = []
        for kind in ("inserts", "touched"):
            for typical in (fmean, median):
                growth = typical(getattr(large, kind)) / typical(getattr(small, kind))
                row.append(float(np.log(growth) / np.log(last / low)))
        verdict = GROWTH[name].judge(row[0]) if name in GROWTH else ""
        table.rows.append([name, row[0], verdict, *row[1:]])
    return table
