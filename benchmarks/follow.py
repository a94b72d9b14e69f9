"""What those pay who follow a boundary: one more point on top of N, then the question.

Each round builds an engine with N points of a set, shuffled, and asks three times with a change in
between, so that the engine knows that it is followed. Then it inserts further points one by one,
each followed by a `side`, so that the boundary is right, and only then the clock starts: for what
has changed, the boundary or the smooth curve as an object, or these with their arrays, O(N), read.

"Noting" is the other side: what the insert and the `side` themselves cost, followed or not.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import flintknap as fk
from benchmarks import sets, tables
from benchmarks.ours import bounded
from benchmarks.timing import compare

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from benchmarks.sets import Points
    from benchmarks.timing import Clock

    Contender = Callable[[Clock], str]

SETS: dict[str, Callable[[int], Points]] = {
    "curve": sets.curve,
    "curve, noise of one spacing": sets.noisy_curve,
    "uniform": sets.uniform,
}
CHANGES = 200  # of each round
TARGET = tables.at_most(200)


def run(quick: bool) -> Iterator[tables.Table]:
    """Yield a table of questions after a change, and one of changes that are noted or not."""
    asked = tables.contest("Asked after a change", "set", "N", unit="a question")
    noted = tables.contest("Noting", "set", "N", unit="a change")
    for name, make in SETS.items():
        for n in (10**5,) if quick else (10**5, 10**6):
            points = sets.shuffled(make(n + CHANGES + 3))
            found = compare(questions(points), n, quick=quick)
            targets = {"flintknap changes": TARGET, "flintknap curve": TARGET}
            tables.enter(asked, [name, n], found, targets if n == 10**5 else {})
            tables.enter(noted, [name, n], compare(changes(points), n, quick=quick))
    yield asked
    yield noted


def followed(points: Points, ask: Callable[[fk.Engine], object]) -> fk.Engine:
    """Return an engine with all points but the last, that has been asked for three revisions."""
    engine = fk.Engine()
    engine.insert(points[: -CHANGES - 3])
    for x, y in points[-CHANGES - 3 : -CHANGES].tolist():
        engine.insert(x, y)
        ask(engine)
    bounded(engine)
    return engine


def questions(points: Points) -> dict[str, Contender]:
    """Return contenders that are asked after each of some insertions; the answer is dropped."""

    def asked(ask: Callable[[fk.Engine], object]) -> Contender:
        def contender(clock: Clock) -> str:
            engine = followed(points, ask)
            for x, y in points[-CHANGES:].tolist():
                engine.insert(x, y)
                engine.side(x, y)
                with clock.lap():
                    ask(engine)
            return ""

        return contender

    return {
        "flintknap changes": asked(Listener()),
        "flintknap boundary": asked(lambda engine: engine.boundary()),
        "flintknap boundary, read": asked(lambda engine: engine.boundary().xy),
        "flintknap curve": asked(lambda engine: engine.smooth()),
        "flintknap curve, read": asked(lambda engine: engine.smooth().control),
    }


class Listener:
    """Asks an engine what has changed since it asked last."""

    def __init__(self) -> None:
        self.seen: tuple[fk.Engine, int] | None = None

    def __call__(self, engine: fk.Engine) -> None:
        """Ask, of all changes if it is an engine that it has not just asked."""
        since = self.seen[1] if self.seen is not None and self.seen[0] is engine else None
        self.seen = engine, engine.changes(since).revision


def changes(points: Points) -> dict[str, Contender]:
    """Return contenders that insert, followed or not."""

    def inserting(ask: Callable[[fk.Engine], object]) -> Contender:
        def contender(clock: Clock) -> str:
            engine = followed(points, ask)
            for x, y in points[-CHANGES:].tolist():
                with clock.lap():
                    engine.insert(x, y)
                    engine.side(x, y)
            return ""

        return contender

    return {
        "flintknap, not followed": inserting(bounded),
        "flintknap, followed": inserting(Listener()),
    }
