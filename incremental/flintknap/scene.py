"""Many objects in one plane: which of them touch, hold a place, or are nearest to one.

Theory of operation. Engines are changed where they are; a scene compares their revisions when it
is asked, and looks again only at objects that have changed. Only objects whose boxes meet are
asked, exactly, whether they collide. Answers are functions of the names and their objects.

Cost. 5 ns an object to compare revisions; a changed object, its own repair, half a nanosecond an
object to find the boxes that meet its own, and `collides` for each of these. (An ordered index of
boxes would save less than it costs as long as revisions are compared one by one.)

Invariants (check): the contacts of each object are those found without boxes, and are listed.

A scene serves one thread at a time; its engines may be changed by others meanwhile. After Ctrl-C in
the middle of a question the next one starts from nothing.
"""

from __future__ import annotations

import math
from bisect import bisect_left, insort
from collections.abc import MutableMapping
from typing import TYPE_CHECKING, overload

import numpy as np

from flintknap import inputs
from flintknap._kernel import Roster
from flintknap.collision import Held, Nearest
from flintknap.errors import InvariantError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import ArrayLike, NDArray

    from flintknap.engine import Engine


class Scene(MutableMapping[str, "Engine"]):
    """Objects by name: a mapping to their engines, which may be changed at any time.

    >>> from flintknap import Engine
    >>> scene = Scene({"hull": Engine(), "quay": Engine()})
    >>> ids = scene["hull"].insert([0.0, 4.0, 2.0], [0.0, 0.0, 6.0])
    >>> ids = scene["quay"].insert([5.0, 9.0, 9.0], [0.0, 0.0, 9.0])
    >>> scene.collisions(), scene.contains(2.0, 1.0), scene.nearest(4.4, 0.0)[0]
    ([], ['hull'], 'hull')
    >>> berthed = scene["hull"].move(1, 5.0, 0.0)
    >>> scene.collisions()
    [('hull', 'quay')]
    """

    def __init__(self, engines: Mapping[str, Engine] | None = None) -> None:
        self._engines: dict[str, Engine] = {}
        self._is_torn = False  # set while what follows changes: after Ctrl-C it still is
        self._start()
        self.update(engines or {})

    # ------------------------------------------------------------------ the mapping
    def __getitem__(self, name: str) -> Engine:
        return self._engines[name]

    def __setitem__(self, name: str, engine: Engine) -> None:
        if name in self._engines:
            del self[name]
        was_torn, self._is_torn = self._is_torn, True
        self._engines[name] = engine
        self._enter(name, engine)
        self._is_torn = was_torn

    def __delitem__(self, name: str) -> None:
        row = self._row[name]
        was_torn, self._is_torn = self._is_torn, True
        del self._engines[name], self._row[name]
        self._meet(row, set())
        self._roster.put(row, None)
        self._stale.discard(row)
        self._free.append(row)
        self._is_torn = was_torn

    def __iter__(self) -> Iterator[str]:
        return iter(self._engines)

    def __len__(self) -> int:
        return len(self._engines)

    # ------------------------------------------------------------------ questions
    def collisions(self) -> list[tuple[str, str]]:
        """Return the pairs of objects that collide (Engine.collides), each and all by name.

        What has not changed since the last question costs nothing but a look at its revision.
        """
        self._bring_up()
        return self._pairs.copy()

    @overload
    def contains(self, x: float, y: float) -> list[str]: ...
    @overload
    def contains(self, x: ArrayLike, y: ArrayLike | None = None) -> list[str] | Held: ...
    def contains(self, x: ArrayLike, y: ArrayLike | None = None) -> list[str] | Held:
        """Return the objects that contain a place, the boundary included, sorted by name.

        Numbers or arrays, as in Engine.insert; of arrays, each place with each object that contains
        it (Held). O(log n) a place and an object in whose box it lies, on curves, and for arrays
        what it takes to sort them.

        Raises InputError naming the first row at fault.
        """
        if isinstance(x, float) and isinstance(y, float):
            return self._holding(inputs.scalar(x, "x"), inputs.scalar(y, "y"))
        xs, ys = inputs.pairs(x, y)
        if xs.ndim == 0:
            return self._holding(float(xs), float(ys))
        self._bring_up()
        places, rows = self._roster.containing_many(xs.ravel(), ys.ravel())
        names, rank = np.array(self._names, object), self._rank()
        order = np.lexsort((rank[rows], places))
        return Held(places[order], names[rows[order]])

    @overload
    def nearest(self, x: float, y: float) -> tuple[str | None, Nearest]: ...
    @overload
    def nearest(
        self, x: ArrayLike, y: ArrayLike | None = None
    ) -> tuple[str | NDArray[np.object_] | None, Nearest]: ...
    def nearest(
        self, x: ArrayLike, y: ArrayLike | None = None
    ) -> tuple[str | NDArray[np.object_] | None, Nearest]:
        """Return the object whose boundary is nearest to a place, and Engine.nearest of it.

        Of several as near the first by name; (None, of a degenerate object) if none has a boundary.
        Numbers or arrays, as in Engine.insert; of arrays, arrays of their common shape. A place
        costs a look at each box, and what it takes to ask the few objects that may be nearest.

        Raises InputError naming the first row at fault.
        """
        if isinstance(x, float) and isinstance(y, float):
            return self._nearest_to(inputs.scalar(x, "x"), inputs.scalar(y, "y"))
        xs, ys = inputs.pairs(x, y)
        if xs.ndim == 0:
            return self._nearest_to(float(xs), float(ys))
        self._bring_up()
        flat_x, flat_y = xs.ravel(), ys.ravel()
        rows = self._roster.nearest_many(flat_x, flat_y, self._rank())
        names = np.full(rows.shape, None, object)
        told = [np.full(rows.shape, value) for value in (math.nan, math.nan, math.inf, -1, -1)]
        for row in np.unique(rows[rows >= 0]).tolist():
            here = np.flatnonzero(rows == row)
            names[here] = self._names[row]
            found = self[self._names[row]].nearest(flat_x[here], flat_y[here])
            for column, values in zip(told, found, strict=True):
                column[here] = values
        return names.reshape(xs.shape), Nearest(*(column.reshape(xs.shape) for column in told))

    # ------------------------------------------------------------------ verification
    def check(self) -> None:
        """Verify every invariant; raise InvariantError with what was seen. O(n^2) collides."""
        self._bring_up()
        for name, engine in self._engines.items():
            engine.check()
            others = ((each, other) for each, other in self._engines.items() if each != name)
            true = {each for each, other in others if engine.collides(other)}
            got = {self._names[row] for row in self._contacts[self._row[name]]}
            listed = [pair for pair in self._pairs if name in pair]
            if got != true or listed != sorted(_pair(name, each) for each in true):
                raise InvariantError(f"{name!r} touches {true}, got {got}, listed {listed}")

    # ------------------------------------------------------------------ behind the face
    def _start(self) -> None:
        """Make everything anew from the engines."""
        self._row: dict[str, int] = {}
        self._names: list[str] = []  # by row; of free rows the last
        self._free: list[int] = []
        self._roster = Roster()
        self._stale: set[int] = set()  # rows to be looked at
        self._contacts: list[set[int]] = []  # by row
        self._pairs: list[tuple[str, str]] = []  # sorted
        for name, engine in self._engines.items():
            self._enter(name, engine)
        self._is_torn = False

    def _enter(self, name: str, engine: Engine) -> None:
        """Find a row for an engine."""
        row = self._free.pop() if self._free else len(self._names)
        if row == len(self._names):
            self._names.append(name)
            self._contacts.append(set())
        self._names[row], self._row[name] = name, row
        self._roster.put(row, engine._kernel)

    def _bring_up(self) -> None:
        """Look at all that has changed: boxes first, for contacts are found by them."""
        if self._is_torn:
            self._start()
        self._roster.add_changed(self._stale)
        if not self._stale:
            return
        for row in self._stale:
            self._roster.refresh(row)
        self._is_torn = True
        for row in self._stale:
            self._meet(row, self._roster.touching(row))
        self._stale.clear()
        self._is_torn = False

    def _meet(self, row: int, contacts: set[int]) -> None:
        """Set the contacts of a row, on both sides."""
        before, name = self._contacts[row], self._names[row]
        for other in before - contacts:
            self._contacts[other].discard(row)
            del self._pairs[bisect_left(self._pairs, _pair(name, self._names[other]))]
        for other in contacts - before:
            self._contacts[other].add(row)
            insort(self._pairs, _pair(name, self._names[other]))
        self._contacts[row] = contacts

    def _holding(self, x: float, y: float) -> list[str]:
        self._bring_up()
        return sorted(self._names[row] for row in self._roster.containing(x, y))

    def _nearest_to(self, x: float, y: float) -> tuple[str | None, Nearest]:
        self._bring_up()
        name = min((self._names[row] for row in self._roster.nearest(x, y)), default=None)
        if name is None:
            return None, Nearest(math.nan, math.nan, math.inf, -1, -1)
        return name, self[name].nearest(x, y)

    def _rank(self) -> NDArray[np.int64]:
        """Return the place of each row among the names; rows are free or have one."""
        return np.argsort(np.argsort(np.array(self._names, object), kind="stable"))


def _pair(a: str, b: str) -> tuple[str, str]:
    return (a, b) if a < b else (b, a)
