"""Replay: the events of a log, in their order, applied to one engine for each object.

Theory of operation. Inserts wait, object by object, until their object is asked or the block of
events ends; then they enter its engine together, or at once if the block is nothing else and has
them as arrays. An engine answers alike however its points were batched, so nobody can tell, and a
million inserts of one object make a few hundred calls.

Windows. With a window, each object has one of its own (window.py), and its time is that of its own
events, queries included. What has expired leaves before a query, a removal or a move, and at the
end of a block; a run of inserts is still one call.

Absent points. Without a window, removing or moving what is not there is an error. With one, it may
have expired, or be still under way: only ids that were never given are errors then.

Filters. Events later than `until`, or of another object, are passed over as if they were not there.
Times need not rise along a log: the order is that of the lines, and `until` looks at each event by
itself. What is passed over must be well-formed, but the magnitudes of its numbers are not asked.

Contacts. If asked for, they are looked at whenever an event has another time than the one before:
then its objects are brought up to date (scene.py), which costs what the engines and scene take.

Cost. Beyond reading and the engine, 0.01 us an insert of a block that has arrays, 0.3 us of others
that are about one object, and about 1 us when they are about hundreds; a removal or a move, a call
each; with a window 5 us an insert. Memory: the engines, their windows and one block.

Refuses what log.py and the engines refuse, with file and line where there is a file. What came
before in other blocks has been applied and answered by then.
"""

from __future__ import annotations

import os
from collections import defaultdict
from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from msgspec import UnsetType

from flintknap import inputs, log
from flintknap.engine import Engine
from flintknap.errors import InputError, LogError
from flintknap.events import Answer, Contact, Event, Insert, Move, Query, Remove
from flintknap.log import Block
from flintknap.scene import Scene
from flintknap.window import Window

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from flintknap.log import Inserts

BATCH = 2048  # events of an iterable that are applied at once
FEW = 8  # inserts below which a call for each costs less than arrays do
NAMED = 10  # objects that an error names

_object_of = attrgetter("object")
_FIELDS = tuple(attrgetter(field) for field in ("t", "x", "y"))


@dataclass(frozen=True, eq=False)
class Replay:
    """Where a replay ended; both mappings in the order in which objects first appeared.

    Attributes:
        engines: the engine of each object.
        events: the number of events of each object, queries included.
        windows: the window of each object; empty if there was none.

    """

    engines: dict[str, Engine]
    events: dict[str, int]
    windows: dict[str, Window]

    @cached_property
    def scene(self) -> Scene:
        """All objects in one plane."""
        return Scene(self.engines)


class _Piece(NamedTuple):
    """Events of a block that are not passed over: where they stand in it.

    And they as arrays, if the block has them so.
    """

    block: Block
    rows: Sequence[int]
    inserts: Inserts | None

    @property
    def events(self) -> list[Event]:
        if len(self.rows) == len(self.block):
            return self.block.events
        return [self.block.events[row] for row in self.rows]


class _AbsentError(InputError):
    """An event about a point that is not there."""


class _Object:
    """An engine, its window if it has one, and the inserts that wait to enter it."""

    def __init__(self, seconds: float | None) -> None:
        self.engine = Engine()
        self.window = None if seconds is None else Window(self.engine, seconds)
        self.waiting: list[Insert] = []
        self.events = 0

    def flush(self) -> None:
        count = len(self.waiting)
        if count < FEW:
            for event in self.waiting:
                if self.window is None:
                    self.engine.insert(event.x, event.y)
                else:
                    self.window.insert(event.t, event.x, event.y)
            self.events += count
        else:
            fields = (np.fromiter(map(of, self.waiting), np.float64, count) for of in _FIELDS)
            self.insert(*fields)
        self.waiting.clear()

    def insert(
        self, t: NDArray[np.float64], x: NDArray[np.float64], y: NDArray[np.float64]
    ) -> None:
        """Insert points while none waits."""
        if self.window is None:
            self.engine.insert(x, y)
        else:
            self.window.insert(t, x, y)
        self.events += len(t)

    def change(self, event: Remove | Move) -> None:
        self.flush()
        self.events += 1
        if isinstance(event, Remove) and event.place is not None:
            self.remove_at(event.t, *event.place)
            return
        try:
            if isinstance(event, Move):
                if self.window is None:
                    self.engine.move(event.id, event.x, event.y)
                else:
                    self.window.move(event.t, event.id, event.x, event.y)
            elif isinstance(event.id, int):
                if self.window is None:
                    self.engine.remove(event.id)
                else:
                    self.window.remove(event.t, event.id)
        except KeyError:
            wanted = "that is there" if self.window is None else "that was given"
            raise _AbsentError(f"id: got {event.id}, expected one {wanted}") from None

    def remove_at(self, t: float, x: float, y: float) -> None:
        if self.window is not None:
            self.window.retract(t, x, y)
            return
        there = self.engine.find(x, y)
        if there < 0:
            raise _AbsentError(f"x, y: got {(x, y)}, expected a point that is there")
        self.engine.remove(there)

    def answer(self, query: Query) -> Answer:
        self.flush()
        self.events += 1
        if self.window is not None:
            self.window.advance(query.t)
        said: int | bool
        if query.kind == "contains":
            said = self.engine.contains(query.x, query.y)
        else:
            level = None if isinstance(query.level, UnsetType) else query.level
            said = self.engine.side(query.x, query.y, level=level)
        return Answer(
            t=query.t,
            object=query.object,
            kind=query.kind,
            x=query.x,
            y=query.y,
            level=query.level,
            answer=said,
        )


class _Watch:
    """Tells which objects begin and cease to collide, whenever time has gone on."""

    def __init__(self, objects: dict[str, _Object], tell: Callable[[Contact], Any]) -> None:
        self.objects = objects
        self.tell = tell
        self.scene = Scene()
        self.before: set[tuple[str, str]] = set()
        self.t: float | None = None

    def advance(self, t: float | None) -> None:
        """Tell of the time so far, unless it goes on."""
        if self.t is None or self.t == t:
            self.t = t
            return
        for name, each in self.objects.items():
            if each.waiting:
                each.flush()
            if name not in self.scene:
                self.scene[name] = each.engine
        now = set(self.scene.collisions())
        for objects in sorted(now ^ self.before):
            kind: Literal["begin", "end"] = "begin" if objects in now else "end"
            self.tell(Contact(t=self.t, contact=kind, objects=objects))
        self.before, self.t = now, t


def replay(
    source: str | os.PathLike[str] | Iterable[Event],
    *,
    until: float | None = None,
    object: str | None = None,  # noqa: A002 - its name in the log
    window: float | None = None,
    answer: Callable[[Answer], Any] = lambda _: None,
    progress: Callable[[int], Any] = lambda _: None,
    contact: Callable[[Contact], Any] | None = None,
    applied: Callable[[Sequence[Event]], Any] | None = None,
    every: int | None = None,
    frame: Callable[[Mapping[str, Engine]], Any] = lambda _: None,
) -> Replay:
    """Apply a log, given by its path ("-" is standard input), or any events.

    ``until`` keeps events with t <= until, ``object`` those of one object; with a ``window`` points
    leave when they are so many seconds old. ``answer`` is called with what each query is answered,
    in order, before later events are applied; ``progress`` now and then with the bytes read so far
    (of an iterable: the events). ``contact`` is called with every pair of objects that begins or
    ceases to collide, as of all events up to the next one with another time;
    ``applied`` with events after they were applied, block by block; ``frame`` with the engines
    after so many events as ``every`` says, again and again, and at the end if events are left.

    Raises LogError (of an iterable: InputError with the index in ``row``) for the first event at
    fault, InputError for an ``object`` without events, a bad ``window`` or ``every``, OSError where
    a file cannot be read.
    """
    if isinstance(source, str | os.PathLike):
        file, blocks = log.name(source), log.read(source)
    else:
        file, blocks = None, _batches(source)
    if every is not None and every < 1:
        raise InputError(f"every: got {every}, expected 1 or more")
    _Object(window)  # refuses a bad window, whatever the events
    objects: defaultdict[str, _Object] = defaultdict(lambda: _Object(window))
    watch = None if contact is None else _Watch(objects, contact)
    mentioned: dict[str, None] = {}

    def chosen() -> Iterator[_Piece]:
        for block in blocks:
            rows: Sequence[int] = range(len(block))
            inserts = block.inserts
            if inserts is not None:
                mentioned[inserts.object] = None
                if object not in (None, inserts.object):
                    inserts, rows = None, []
                elif until is not None:
                    kept = inserts.t <= until
                    inserts, rows = inserts[kept], np.flatnonzero(kept).tolist()
            else:
                if object is not None:
                    mentioned.update(dict.fromkeys(event.object for event in block.events))
                if object is not None or until is not None:
                    rows = [
                        row
                        for row, event in enumerate(block.events)
                        if (object is None or event.object == object)
                        and (until is None or event.t <= until)
                    ]
            yield _Piece(block, rows, inserts)

    waiting = 0  # events since the last frame
    for piece in chosen() if every is None else _cut(chosen(), every):
        block, rows, inserts = piece
        changed = -1
        try:
            if inserts is not None and watch is None:  # most blocks of most logs
                if len(inserts):
                    objects[inserts.object].insert(inserts.t, inserts.x, inserts.y)
            else:
                for row, event in zip(rows, piece.events, strict=True):
                    if watch is not None:
                        watch.advance(event.t)
                    if isinstance(event, Insert):
                        objects[event.object].waiting.append(event)
                    elif isinstance(event, Query):
                        answer(objects[event.object].answer(event))
                    else:
                        changed = row
                        objects[event.object].change(event)
            for each in objects.values():
                each.flush()
        except InputError as error:
            absent = (changed, error) if isinstance(error, _AbsentError) else None
            _blame(rows, block, file, absent)
            raise
        if applied is not None:
            applied(piece.events)
        progress(block.position)
        waiting += len(rows)
        if waiting == every:
            frame({name: each.engine for name, each in objects.items()})
            waiting = 0
    if waiting and every is not None:
        frame({name: each.engine for name, each in objects.items()})
    if watch is not None:
        watch.advance(None)
    if object is not None and object not in mentioned:
        names = ", ".join(map(repr, list(mentioned)[:NAMED])) or "none at all"
        more = f" and {len(mentioned) - NAMED} more" if len(mentioned) > NAMED else ""
        raise InputError(f"got no events of object {object!r}, expected one of: {names}{more}")
    return Replay(
        {name: each.engine for name, each in objects.items()},
        {name: each.events for name, each in objects.items()},
        {name: each.window for name, each in objects.items() if each.window is not None},
    )


def _batches(events: Iterable[Event]) -> Iterator[Block]:
    """Cut events into blocks, after each query at the latest so that no answer waits for more."""
    batch: list[Event] = []
    count = 0
    for count, event in enumerate(events, 1):
        batch.append(event)
        if len(batch) == BATCH or isinstance(event, Query):
            yield _block(batch, count)
            batch = []
    yield _block(batch, count)


def _block(events: list[Event], count: int) -> Block:
    """Make a block of the last of so many events."""
    return Block(count - len(events), count, None, lambda: events)


def _cut(pieces: Iterable[_Piece], every: int) -> Iterator[_Piece]:
    """Cut pieces where so many events have passed since the last place of which that is true."""
    room = every
    for block, rows, inserts in pieces:
        first = 0
        while first < len(rows):
            last = min(first + room, len(rows))
            cut = slice(first, last)
            yield _Piece(block, rows[cut], None if inserts is None else inserts[cut])
            room = room - (last - first) or every
            first = last


def _blame(
    rows: Iterable[int], block: Block, file: str | None, absent: tuple[int, InputError] | None
) -> None:
    """Raise for the first of these rows of a block at fault, as it waited or when it was applied.

    ``absent`` is the row that was about an absent point, and what is to be said of it.
    """
    for row in rows:
        event = block.events[row]
        place = event.place if isinstance(event, Remove) else (event.x, event.y)
        try:
            if place is not None:
                inputs.scalar(place[0], "x")
                inputs.scalar(place[1], "y")
            if absent is not None and row == absent[0]:
                raise absent[1]
        except InputError as error:
            line = block.line + row
            if file is None:
                raise InputError(f"event {line}: {error}", row=line) from None
            raise LogError(file, line, str(error)) from None
