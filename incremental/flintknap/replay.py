"""Replay: the events of a log, in their order, applied to one engine for each object.

Theory of operation. Inserts wait, object by object, until their object is asked or the block of
events ends; then they enter its engine together. An engine answers alike however its points were
batched, so nobody can tell, and a million inserts of one object make a few hundred calls.

Filters. Events later than `until`, or of another object, are passed over as if they were not there.
Times need not rise along a log: the order is that of the lines, and `until` looks at each event by
itself. What is passed over must be well-formed, but the magnitudes of its numbers are not asked.

Cost. Beyond reading and the engine, 0.12 us an insert when a block is about few objects, and about
1 us when it is about hundreds. Memory: the engines and one block.

Refuses what log.py and the engines refuse, with file and line where there is a file. What came
before in other blocks has been applied and answered by then.
"""

from __future__ import annotations

import os
from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flintknap import inputs, log
from flintknap.engine import Engine
from flintknap.errors import InputError, LogError
from flintknap.events import Answer, Event, Insert, Query
from flintknap.log import Block

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

BATCH = 2048  # events of an iterable that are applied at once
FEW = 8  # inserts below which a call for each costs less than arrays do
NAMED = 10  # objects that an error names


@dataclass(frozen=True, eq=False)
class Replay:
    """Where a replay ended; both mappings in the order in which objects first appeared.

    Attributes:
        engines: the engine of each object.
        events: the number of events of each object, queries included.

    """

    engines: dict[str, Engine]
    events: dict[str, int]


class _Object:
    """An engine, and the inserts that wait to enter it."""

    def __init__(self) -> None:
        self.engine = Engine()
        self.waiting: list[Insert] = []
        self.events = 0

    def flush(self) -> None:
        count = len(self.waiting)
        if count < FEW:
            for event in self.waiting:
                self.engine.insert(event.x, event.y)
        else:
            x = np.fromiter((event.x for event in self.waiting), np.float64, count)
            y = np.fromiter((event.y for event in self.waiting), np.float64, count)
            self.engine.insert(x, y)
        self.events += count
        self.waiting.clear()

    def answer(self, query: Query) -> Answer:
        self.flush()
        self.events += 1
        ask = self.engine.side if query.kind == "side" else self.engine.contains
        said = ask(query.x, query.y)
        return Answer(
            t=query.t, object=query.object, kind=query.kind, x=query.x, y=query.y, answer=said
        )


def replay(
    source: str | os.PathLike[str] | Iterable[Event],
    *,
    until: float | None = None,
    object: str | None = None,  # noqa: A002 - its name in the log
    answer: Callable[[Answer], Any] = lambda _: None,
    progress: Callable[[int], Any] = lambda _: None,
) -> Replay:
    """Apply a log, given by its path ("-" is standard input), or any events.

    ``until`` keeps events with t <= until, ``object`` those of one object. ``answer`` is called
    with what each query is answered, in order, before later events are applied; ``progress`` now
    and then with the bytes read so far (of an iterable: the events).

    Raises LogError (of an iterable: InputError with the index in ``row``) for the first event at
    fault, InputError for an ``object`` without events, OSError where a file cannot be read.
    """
    if isinstance(source, str | os.PathLike):
        file, blocks = log.name(source), log.read(source)
    else:
        file, blocks = None, _batches(source)
    objects: defaultdict[str, _Object] = defaultdict(_Object)
    mentioned: dict[str, None] = {}
    for block in blocks:
        events = block.events
        if object is not None:
            mentioned.update(dict.fromkeys(event.object for event in events))
            events = [event for event in events if event.object == object]
        if until is not None:
            events = [event for event in events if event.t <= until]
        try:
            for event in events:
                if isinstance(event, Insert):
                    objects[event.object].waiting.append(event)
                else:
                    answer(objects[event.object].answer(event))
            for each in objects.values():
                each.flush()
        except InputError:
            _blame(events, block, file)
            raise
        progress(block.position)
    if object is not None and object not in mentioned:
        names = ", ".join(map(repr, list(mentioned)[:NAMED])) or "none at all"
        more = f" and {len(mentioned) - NAMED} more" if len(mentioned) > NAMED else ""
        raise InputError(f"got no events of object {object!r}, expected one of: {names}{more}")
    return Replay(
        {name: each.engine for name, each in objects.items()},
        {name: each.events for name, each in objects.items()},
    )


def _batches(events: Iterable[Event]) -> Iterator[Block]:
    """Cut events into blocks, after each query at the latest so that no answer waits for more."""
    batch: list[Event] = []
    count = 0
    for count, event in enumerate(events, 1):
        batch.append(event)
        if len(batch) == BATCH or isinstance(event, Query):
            yield Block(count - len(batch), batch, count)
            batch = []
    yield Block(count - len(batch), batch, count)


def _blame(events: Iterable[Event], block: Block, file: str | None) -> None:
    """Raise for the first of the events, all from one block, that no engine takes."""
    for event in events:
        try:
            inputs.scalar(event.x, "x")
            inputs.scalar(event.y, "y")
        except InputError as error:
            row = block.line + block.events.index(event)
            if file is None:
                raise InputError(f"event {row}: {error}", row=row) from None
            raise LogError(file, row, str(error)) from None
