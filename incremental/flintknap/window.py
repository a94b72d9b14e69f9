"""A sliding window over an engine: what was seen stays for some seconds, by the times of events.

Theory of operation. Time is that of the newest event so far, and never goes back; there is no other
clock. An event has expired when it is `seconds` old: it stands while now - t < seconds (in doubles,
so what is as new as time itself always stands). What has expired already when it arrives is not
inserted. A place is there, once for each sighting that stands and that nobody took back.

A removal takes back the latest sighting of its place that is not later than itself and that no
other removal takes back: what stands is what reading sightings as opening and removals as
closing brackets, in order of time, leaves open (at equal times sightings come first). Brackets
that have expired cannot change which of the later ones stay open, so only the window is kept::

    p   (1   (2   )3   (5          open, so standing: (1 and (5; a late )4 would take back (1

So the window is a function of the set of events: insertions, retractions and the passing of time
may arrive in any order, a retraction before what it takes back even; once all are there, the same
points are, equally often. An id is given on arrival, so events that name ids (`remove`, `move`)
are resolved when they arrive, and there order counts; but of the moves of one id the latest wins
whenever it comes. Which id a place has depends on the order too; not on what was asked, nor on
whether events come one by one or in arrays.

Interrupts. A call first works on what is remembered, noting how to take that back, and then changes
the engine in one go, which no signal can divide. If it is ended before that (Ctrl-C, the end of
memory), what is remembered is put together again from the events that stood before: O(n log n).
Should that be interrupted, too, the next call does it.

Cost. O(log n) an event, in time and again when it expires. A place with removals among its k events
in the window is read anew, O(k), when an event of it comes late. Each call is one change of the
engine. Memory: what the window holds.

A snapshot of the engine is the engine's alone, without the times. A window comes back from the log:
what it holds is a function of the events of its last seconds, so a new one over a new engine holds
the same once it is told these.

Refuses a window that is not positive and finite, times that are not finite, and what the engine
refuses. The engine may hold other points; those of the window must leave through the window.
"""

from __future__ import annotations

import math
from bisect import bisect_right, insort
from typing import TYPE_CHECKING, NamedTuple, overload

import numpy as np
from sortedcontainers import SortedDict

from flintknap import inputs
from flintknap.errors import InputError, InvariantError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from numpy.typing import ArrayLike, NDArray

    from flintknap.engine import Engine

Place = tuple[float, float]
Told = tuple[float, bool]  # when, and whether it is a removal: sorts sightings first
Event = tuple[Place, bool]  # where, and whether it is a removal


class _Undo(NamedTuple):
    """How to take back what a call has done to what is remembered."""

    now: float
    expired: int
    steps: int  # of the engine, before the call
    noted: list[tuple[float, int]]  # times of events that came, how many there were before
    dropped: list[tuple[float, list[Event]]]  # events that went, by time


class Window:
    """Keeps in an engine the points that were seen within the last ``seconds``.

    A call that is interrupted leaves window and engine as they were before it or, if the interrupt
    comes when all is done, as they are after it.

    Attributes:
        engine: where the points are; ask it.
        seconds: the length of the window, in the unit of the times of events.
        now: the newest time so far; -inf before any.
        expired: how many sightings have expired, those that had when they arrived included.

    >>> from flintknap import Engine
    >>> window = Window(Engine(), seconds=10.0)
    >>> window.insert([0.0, 1.0, 2.0], [0.0, 4.0, 2.0], [0.0, 0.0, 6.0]).tolist()
    [0, 1, 2]
    >>> window.advance(10.0)  # the first is ten seconds old
    >>> len(window.engine), window.expired
    (2, 1)

    """

    def __init__(self, engine: Engine, seconds: float) -> None:
        if not 0 < seconds < math.inf:
            raise InputError(f"seconds: got {seconds!r}, expected a positive finite number")
        self.engine = engine
        self.seconds = float(seconds)
        self.now = -math.inf
        self.expired = 0
        self._order: SortedDict[float, list[Event]] = SortedDict()  # what is remembered, by time
        # The same by place; these two follow from _order.
        self._standing: dict[Place, list[float]] = {}  # sightings not taken back, ascending
        self._told: dict[Place, list[Told]] = {}  # all, ascending, where there are removals
        # Of a call that has not ended: what the engine is to do, x, y and whether a point comes
        # there; which point moves in the end, and where to; how to take back what has been done.
        self._steps: list[tuple[float, float, bool]] = []
        self._moving = (-1, 0.0, 0.0)
        self._undo: _Undo | None = None

    # ------------------------------------------------------------------ events
    @overload
    def insert(self, t: float, x: float, y: float) -> int: ...
    @overload
    def insert(self, t: ArrayLike, x: ArrayLike, y: ArrayLike) -> int | NDArray[np.int64]: ...
    def insert(self, t: ArrayLike, x: ArrayLike, y: ArrayLike) -> int | NDArray[np.int64]:
        """Say that points (x, y) were seen at times ``t``: numbers, or arrays that broadcast.

        Arrays are as one call for each row. Returns the ids at the places after the call, an int
        or int64 of the common shape; -1 where nothing is: expired, or taken back.

        Raises InputError naming the first row at fault; then nothing of the call was applied.
        O(log n) a row.
        """
        if isinstance(t, float) and isinstance(x, float) and isinstance(y, float):
            self._call(self._tell, [_time(t)], [_place(x, y)], False)
            return self.engine.find(x, y)
        ts, xs, ys = _events(t, x, y)
        places = zip(xs.ravel().tolist(), ys.ravel().tolist(), strict=True)
        self._call(self._tell, ts.ravel().tolist(), places, False)
        return self.engine.find(xs, ys) if ts.ndim else self.engine.find(float(xs), float(ys))

    def retract(self, t: ArrayLike, x: ArrayLike, y: ArrayLike) -> None:
        """Take back, as of times ``t``, one sighting each of points at (x, y).

        That is the latest sighting there that is not later than t, even if it arrives after this
        call. If there is none, nothing happens. Numbers or arrays, errors and cost as in insert.
        """
        ts, xs, ys = _events(t, x, y)
        places = zip(xs.ravel().tolist(), ys.ravel().tolist(), strict=True)
        self._call(self._tell, ts.ravel().tolist(), places, True)

    def remove(self, t: float, ids: ArrayLike) -> None:
        """Retract, as of time ``t``, the points with these ids: one or an array.

        Ids whose points have left the window already are passed over.

        Raises KeyError naming an id that the engine has not given yet, InputError for a bad time;
        then nothing of the call was applied. O(log n) an id.
        """
        next_id = self.engine._kernel.next_id()
        known = inputs.identifiers(ids, "ids", lambda i: (i < 0) | (i >= next_id))
        self._call(self._take_back, _time(t), known.ravel().tolist())

    def move(self, t: float, point: int, x: float, y: float) -> int:
        """Say that the point with an id was seen at (x, y) at time ``t``; return the id there.

        Its latest sighting not later than t gives way to this one; the id stays as in Engine.move.
        If the point was seen later than t where it is, it stays. Returns -1 if the point has left
        the window by t.

        Raises KeyError for an id that the engine has not given yet, InputError for a bad time or
        place; then nothing was applied. O(log n).
        """
        t, new = _time(t), _place(x, y)
        if not 0 <= point < self.engine._kernel.next_id():
            raise KeyError(point)
        is_there, there = self._call(self._move, t, point, new)
        if not is_there:
            return -1
        return there if there >= 0 else self.engine.find(*new)

    def advance(self, t: float) -> None:
        """Say that it is time ``t``, if it is not later already.

        Raises InputError if t is not finite. O(log n) for each sighting that expires.
        """
        self._call(self._pass, _time(t))

    # ------------------------------------------------------------------ verification
    def check(self) -> None:
        """Verify every invariant; raise InvariantError with what was seen. O(n log n)."""
        entries = [(t, place) for t, events in self._order.items() for place, _ in events]
        told = {p: self._told.get(p, [(t, False) for t in ts]) for p, ts in self._standing.items()}
        for place, standing in self._standing.items():
            if standing != _open(told[place]):
                raise InvariantError(f"{place}: {standing} stand of {told[place]}")
            at = self.engine.find(*place)
            there = self.engine.multiplicity(at) if at >= 0 else 0
            if there < len(standing):
                raise InvariantError(f"{place}: {there} in the engine, {standing} stand")
        if sorted(entries) != sorted((t, place) for place in told for t, _ in told[place]):
            raise InvariantError(f"in order of time {entries}, by place {told}")
        if any(self.now - t >= self.seconds for t in self._order) or self._told.keys() - told:
            raise InvariantError(f"now {self.now}, remembered {told}, removals {self._told}")

    # ------------------------------------------------------------------ behind the face
    def _call(self, work: Callable[..., bool], *arguments: object) -> tuple[bool, int]:
        """Do the work and then change the engine, or nothing at all.

        Returns what the work does, and the id of the point that it moved, -1 if it moved none.
        """
        if self._undo is not None:
            self._recover()
        kernel = self.engine._kernel
        self._steps, self._moving = [], (-1, 0.0, 0.0)
        self._undo = _Undo(self.now, self.expired, kernel.steps(), [], [])
        try:
            done = work(*arguments)
            there = kernel.change(self._steps, *self._moving)
        except BaseException:
            self._recover()
            raise
        self._undo = None
        return done, there

    def _recover(self) -> None:
        """Take back what a call has done that did not end.

        If the engine has begun to change, no signal came in between, so memory has ended, and there
        is no way back but one onward.
        """
        undo = self._undo
        if undo is None:
            return
        taken = self.engine._kernel.steps() - undo.steps
        if taken == 0:
            order = dict(dict.items(self._order))  # its sorted keys may be out of step
            order.update(undo.dropped)
            for t, length in reversed(undo.noted):
                del order.get(t, [])[length:]
            self._remember(SortedDict({t: events for t, events in order.items() if events}))
            self.now, self.expired = undo.now, undo.expired
        elif taken <= len(self._steps):
            self.engine._kernel.change(self._steps[taken:], *self._moving)
        self._undo = None

    def _remember(self, order: SortedDict[float, list[Event]]) -> None:
        """Let these be the events in the window."""
        told: dict[Place, list[Told]] = {}
        for t, events in order.items():
            for place, removal in events:
                told.setdefault(place, []).append((t, removal))
        for each in told.values():
            each.sort()
        self._order = order
        self._standing = {place: _open(each) for place, each in told.items()}
        self._told = {place: each for place, each in told.items() if any(r for _, r in each)}

    def _tell(self, times: Iterable[float], places: Iterable[Place], removal: bool) -> bool:
        for t, place in zip(times, places, strict=True):
            expired = len(self._steps)
            self._pass(t)
            if self.now - t < self.seconds:
                change = self._note(t, place, removal)
                if change > 0:  # before what expires leaves: so a place that is seen again stays
                    self._steps.insert(expired, (*place, True))
                elif change < 0:
                    self._steps.append((*place, False))
            elif not removal:
                self.expired += 1
        return True

    def _take_back(self, t: float, ids: list[int]) -> bool:
        self._pass(t)
        places = [place for i in ids if (place := self._where(i)) is not None]
        return self._tell([t] * len(places), places, True)

    def _move(self, t: float, point: int, new: Place) -> bool:
        """Return whether the point is in the window at time t."""
        self._pass(t)
        old = self._where(point)
        if old is None:
            return False
        before = bisect_right(self._standing[old], t)
        if not before:
            self._moving = (point, *old)  # stays
            return True
        # As of the time of the sighting itself, so that exactly that one is taken back.
        self._note(self._standing[old][before - 1], old, True)
        if self._note(t, new, False):
            self._moving = (point, *new)
        else:  # a retraction has come before it
            self._steps.append((*old, False))
        return True

    def _pass(self, t: float) -> bool:
        """Let time pass, and what expires leave."""
        if t <= self.now:
            return True
        assert self._undo is not None
        self.now = t
        order = self._order
        while order:
            then, events = order.peekitem(0)
            if t - then < self.seconds:
                break
            self._undo.dropped.append((then, events))
            order.popitem(0)
            for place, _ in events:
                standing, told = self._standing[place], self._told.get(place)
                if told:
                    del told[0]
                if standing and standing[0] == then:
                    del standing[0]
                    self.expired += 1
                    self._steps.append((*place, False))
                if not told and not standing:
                    self._told.pop(place, None)
                    del self._standing[place]
        return True

    def _note(self, t: float, place: Place, removal: bool) -> int:
        """Remember an event that stands in the window; return by how much the place changes."""
        assert self._undo is not None
        events = self._order.get(t)
        self._undo.noted.append((t, 0 if events is None else len(events)))
        if events is None:
            self._order[t] = [(place, removal)]
        else:
            events.append((place, removal))
        standing = self._standing.setdefault(place, [])
        before = len(standing)
        told = self._told.get(place)
        if told is None and removal:
            told = self._told[place] = [(seen, False) for seen in standing]
        if told is None:
            insort(standing, t)
            return 1
        insort(told, (t, removal))
        if told[-1] != (t, removal):
            standing[:] = _open(told)
        elif not removal:
            standing.append(t)
        elif standing:
            standing.pop()
        return len(standing) - before

    def _where(self, point: int) -> Place | None:
        """Return where the point with an id is, if it is, and by this window."""
        try:
            x, y = self.engine.points([point])[0].tolist()
        except KeyError:
            return None
        return (x, y) if self._standing.get((x, y)) else None


def _open(told: list[Told]) -> list[float]:
    """Return the sightings that no removal takes back, ascending."""
    standing: list[float] = []
    for t, removal in told:
        if not removal:
            standing.append(t)
        elif standing:
            standing.pop()
    return standing


def _time(t: float) -> float:
    if not math.isfinite(t):
        raise InputError(f"t: got {t!r}, expected a finite number", row=0)
    return float(t)


def _place(x: float, y: float) -> Place:
    return inputs.scalar(float(x), "x"), inputs.scalar(float(y), "y")


def _times(t: ArrayLike) -> NDArray[np.float64]:
    got = np.asarray(t)
    if got.size and got.dtype.kind not in "fiu":
        raise InputError(f"t: got values of type {got.dtype}, expected real numbers")
    times = got.astype(np.float64, copy=False)
    bad = ~np.isfinite(times.ravel())
    if bad.any():
        row = int(np.argmax(bad))
        got = times.ravel()[row]
        raise InputError(f"row {row}: t: got {got}, expected a finite number", row=row)
    return times


def _events(
    t: ArrayLike, x: ArrayLike, y: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return times and coordinates, checked and of one shape."""
    ts, (xs, ys) = _times(t), inputs.pairs(x, y)
    try:
        ts, xs, ys = np.broadcast_arrays(ts, xs, ys)
    except ValueError:
        why = f"t, x and y: got shapes {ts.shape} and {xs.shape}, expected shapes that broadcast"
        raise InputError(why) from None
    return ts, xs, ys
