"""The stopwatch: CPU time of contenders that take turns.

A contender is a function that is given a clock, prepares what it likes, and does its work in
`with clock.lap(operations):`. All of a contest run once in each round, in alternating order, so
that a change in the machine's mood meets all of them; two are compared by the median over the
rounds of the ratio within a round. CPU time of the process, all its threads, is what counts, for
the machine may be shared: wall time would measure the others' work. Reading it costs under 1 us.

A contender that has used up its allowance of seconds, preparation included, drops out; the table
says how many rounds it had. One whose package is not installed is left out, and the table says so;
every other exception is a bug and is raised.
"""

from __future__ import annotations

import gc
import statistics
from dataclasses import dataclass, field
from time import process_time
from typing import TYPE_CHECKING, Generic, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from types import TracebackType

T = TypeVar("T")

ALLOWANCE, QUICK_ALLOWANCE = 10.0, 2.0  # CPU seconds a contender has for one contest


class Clock:
    """Records laps: how many CPU seconds each took and how many operations it made."""

    def __init__(self) -> None:
        self.laps: list[float] = []
        self.operations = 0

    def lap(self, operations: int = 1) -> Clock:
        """Announce a lap: `with clock.lap(n): ...`."""
        self.operations += operations
        return self

    def __enter__(self) -> None:
        self._start = process_time()

    def __exit__(
        self, kind: type[BaseException] | None, error: object, trace: TracebackType | None
    ) -> None:
        self.laps.append(process_time() - self._start)

    @property
    def seconds(self) -> float:
        """Of all laps together."""
        return sum(self.laps)


if TYPE_CHECKING:
    Contender = Callable[[Clock], T]


@dataclass
class Measured(Generic[T]):
    """What came of a contender: microseconds an operation, by round, and its last result."""

    micros: list[float] = field(default_factory=list)
    result: T | None = None
    failure: str = ""

    @property
    def median(self) -> float:
        """Microseconds an operation in a typical round."""
        return statistics.median(self.micros)


def compare(
    contenders: Mapping[str, Contender[T]], size: int, *, quick: bool
) -> dict[str, Measured[T]]:
    """Run all contenders in interleaved rounds: 5, and more for less than 1e5 points."""
    found: dict[str, Measured[T]] = {name: Measured() for name in contenders}
    left = dict.fromkeys(contenders, QUICK_ALLOWANCE if quick else ALLOWANCE)
    for _ in range(max(5, min(31, 5 * 10**5 // size))):
        for name in list(left):
            clock, here = Clock(), found[name]
            gc.collect()
            began = process_time()
            try:
                here.result = contenders[name](clock)
            except ModuleNotFoundError as error:
                here.failure = f"{error.name} is not installed"
                del left[name]
                continue
            here.micros.append(clock.seconds / clock.operations * 1e6)
            left[name] -= process_time() - began
            if left[name] < 0:
                del left[name]
        left = dict(reversed(left.items()))
    return found


def ratio(of: Measured[T], to: Measured[T]) -> float:
    """Return the median of the ratios of cost in the rounds in which both ran."""
    return statistics.median(a / b for a, b in zip(of.micros, to.micros, strict=False))
