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

Cost. O(log n) an event, in time and again when it expires. A place with removals among its k events
in the window is read anew, O(k), when an event of it comes late. A run of insertions in one call is
one call of the engine, and one more for all that expire. Memory: what the window holds.

Refuses a window that is not positive and finite, times that are not finite, and what the engine
refuses. The engine may hold other points; those of the window must leave through the window.
"""

from __future__ import annotations

import math
from bisect import bisect_right, insort
from typing import TYPE_CHECKING, overload

import numpy as np
from sortedcontainers import SortedDict

from flintknap import inputs
from flintknap.errors import InputError, InvariantError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import ArrayLike, NDArray

    from flintknap.engine import Engine

Place = tuple[float, float]
Told = tuple[float, bool]  # when, and whether it is a removal: sorts sightings first


class Window:
    """Keeps in an engine the points that were seen within the last ``seconds``.

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
        self._order: SortedDict[float, list[Place]] = SortedDict()  # what is remembered, by time
        self._standing: dict[Place, list[float]] = {}  # sightings not taken back, ascending
        self._told: dict[Place, list[Told]] = {}  # all, ascending, where there are removals
        # What the engine does not know yet: first these arrive, in this order, then those leave.
        self._arriving: list[Place] = []
        self._leaving: list[Place] = []
        self._left: set[Place] = set()  # those of _leaving of which nothing stands
        self._last_id = -1

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
            self._tell([_time(t)], [_place(x, y)], removal=False)
            return self.engine.find(x, y)
        ts, xs, ys = _events(t, x, y)
        places = zip(xs.ravel().tolist(), ys.ravel().tolist(), strict=True)
        self._tell(ts.ravel().tolist(), places, removal=False)
        return self.engine.find(xs, ys) if ts.ndim else self.engine.find(float(xs), float(ys))

    def retract(self, t: ArrayLike, x: ArrayLike, y: ArrayLike) -> None:
        """Take back, as of times ``t``, one sighting each of points at (x, y).

        That is the latest sighting there that is not later than t, even if it arrives after this
        call. If there is none, nothing happens. Numbers or arrays, errors and cost as in insert.
        """
        ts, xs, ys = _events(t, x, y)
        places = zip(xs.ravel().tolist(), ys.ravel().tolist(), strict=True)
        self._tell(ts.ravel().tolist(), places, removal=True)

    def remove(self, t: float, ids: ArrayLike) -> None:
        """Retract, as of time ``t``, the points with these ids: one or an array.

        Ids whose points have left the window already are passed over.

        Raises KeyError naming an id beyond those that this window gave, InputError for a bad time;
        then nothing of the call was applied. O(log n) an id.
        """
        known = inputs.identifiers(ids, "ids", lambda i: (i < 0) | (i > self._last_id))
        t = _time(t)
        self.advance(t)
        places = [place for i in known.ravel().tolist() if (place := self._where(i)) is not None]
        self._tell([t] * len(places), places, removal=True)

    def move(self, t: float, point: int, x: float, y: float) -> int:
        """Say that the point with an id was seen at (x, y) at time ``t``; return the id there.

        Its latest sighting not later than t gives way to this one; the id stays as in Engine.move.
        If the point was seen later than t where it is, it stays. Returns -1 if the point has left
        the window by t.

        Raises KeyError for an id beyond those that this window gave, InputError for a bad time or
        place; then nothing was applied. O(log n).
        """
        t, new = _time(t), _place(x, y)
        if not 0 <= point <= self._last_id:
            raise KeyError(point)
        self.advance(t)
        old = self._where(point)
        if old is None:
            return -1
        before = bisect_right(self._standing[old], t)
        if not before:
            return point
        # As of the time of the sighting itself, so that exactly that one is taken back.
        self._note(self._standing[old][before - 1], old, removal=True)
        arrives = self._note(t, new, removal=False)
        if not arrives:  # a retraction has come before it
            self.engine.remove(point)
            return self.engine.find(*new)
        there = self.engine.move(point, *new)
        self._last_id = max(self._last_id, there)
        return there

    def advance(self, t: float) -> None:
        """Say that it is time ``t``, if it is not later already.

        Raises InputError if t is not finite. O(log n) for each sighting that expires.
        """
        self._pass(_time(t))
        self._flush()

    # ------------------------------------------------------------------ verification
    def check(self) -> None:
        """Verify every invariant; raise InvariantError with what was seen. O(n log n)."""
        entries = [(t, place) for t, places in self._order.items() for place in places]
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
    def _tell(self, times: Iterable[float], places: Iterable[Place], *, removal: bool) -> None:
        for t, place in zip(times, places, strict=True):
            self._pass(t)
            if self.now - t < self.seconds:
                self._queue(place, self._note(t, place, removal=removal))
            elif not removal:
                self.expired += 1
        self._flush()

    def _pass(self, t: float) -> None:
        """Let time pass, and what expires get ready to leave."""
        if t <= self.now:
            return
        self.now = t
        order = self._order
        while order and t - order.peekitem(0)[0] >= self.seconds:
            then, places = order.popitem(0)
            for place in places:
                standing, told = self._standing[place], self._told.get(place)
                if told:
                    del told[0]
                if standing and standing[0] == then:
                    del standing[0]
                    self.expired += 1
                    self._queue(place, -1)
                if not told and not standing:
                    self._told.pop(place, None)
                    del self._standing[place]

    def _note(self, t: float, place: Place, *, removal: bool) -> int:
        """Remember an event that stands in the window; return by how much the place changes."""
        if t in self._order:
            self._order[t].append(place)
        else:
            self._order[t] = [place]
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

    def _queue(self, place: Place, change: int) -> None:
        """Let a place change by one sighting, or none, at the next flush."""
        if change < 0:
            self._leaving.append(place)
            if not self._standing[place]:
                self._left.add(place)
        elif change > 0:
            if place in self._left:  # to come back it has to be gone: it gets a new id
                self._flush()
            self._arriving.append(place)

    def _flush(self) -> None:
        """Tell the engine. One point for one point is the common case, and spared the arrays."""
        if len(self._arriving) == 1:
            self._last_id = max(self._last_id, self.engine.insert(*self._arriving[0]))
        elif self._arriving:
            ids = self.engine.insert(np.array(self._arriving))
            self._last_id = max(self._last_id, int(np.max(ids)))
        self._arriving.clear()
        if len(self._leaving) == 1:
            self.engine.remove(self.engine.find(*self._leaving[0]))
        elif self._leaving:
            self.engine.remove(self.engine.find(np.array(self._leaving)))
        self._leaving.clear()
        self._left.clear()

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
