"""Many objects in one plane: which of them touch, hold a place, or are nearest to one.

Theory of operation. Engines are changed where they are; a scene compares their revisions when it
is asked, and looks again only at objects that have changed. The boxes of the objects stand in an
ordered index: levels by width, doubling from one to the next, each sorted by the left sides. What
may meet a box that spans x_low to x_high begins, on a level of width w, between x_low - w and
x_high; so no wide object makes a search among narrow ones longer. Only objects whose boxes meet
are asked, exactly, whether they collide. Answers are functions of the names and their objects.

Cost. 25 ns an object to compare revisions; a changed object, O(log n), the objects of about its
width and smaller whose boxes meet its range of x, and `collides` for those whose boxes meet its.

Invariants (check): the boxes are those of the objects; each is in the index once, on its level;
the contacts are those of all pairs.

A scene serves one thread at a time; its engines may be changed by others meanwhile. After Ctrl-C in
the middle of a question the next one starts from nothing.
"""

from __future__ import annotations

import math
from collections.abc import MutableMapping
from typing import TYPE_CHECKING, Any, cast

from sortedcontainers import SortedKeyList, SortedSet

from flintknap import inputs
from flintknap._kernel import Roster
from flintknap.collision import Nearest
from flintknap.errors import InvariantError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from flintknap.engine import Engine

_BIT_MORE = 1 + 2.0**-49  # what rounding may add to a bound

Box = tuple[float, float, float, float]  # low x, low y, high x, high y


class _Member:
    """An object of a scene: its box, if it has a boundary, and the names of those it touches."""

    __slots__ = ("box", "contacts", "engine", "name", "row")

    def __init__(self, name: str, engine: Engine, row: int) -> None:
        self.name = name
        self.engine = engine
        self.row = row
        self.box: Box | None = None
        self.contacts: set[str] = set()


class Scene(MutableMapping[str, "Engine"]):
    """Objects by name: a mapping to their engines, which may be changed at any time."""

    def __init__(self, engines: Mapping[str, Engine] | None = None) -> None:
        self._members: dict[str, _Member] = {}
        self._rows: list[_Member | None] = []
        self._free: list[int] = []
        self._roster = Roster()
        self._stale: set[int] = set()  # rows to be looked at
        self._levels: dict[int, Any] = {}  # by exponent of the width: members by left side
        self._pairs: Any = SortedSet()
        self._is_torn = False  # a change of the above has begun and not ended
        self.update(engines or {})

    # ------------------------------------------------------------------ the mapping
    def __getitem__(self, name: str) -> Engine:
        return self._members[name].engine

    def __setitem__(self, name: str, engine: Engine) -> None:
        if name in self._members:
            del self[name]
        row = self._free.pop() if self._free else len(self._rows)
        self._members[name] = member = _Member(name, engine, row)
        if row == len(self._rows):
            self._rows.append(member)
        self._rows[row] = member
        self._roster.put(row, engine._kernel)

    def __delitem__(self, name: str) -> None:
        member = self._members[name]
        self._roster.put(member.row, None)
        torn, self._is_torn = self._is_torn, True
        self._meet(member, set())
        self._place(member, None)
        self._stale.discard(member.row)
        self._rows[member.row] = None
        self._free.append(member.row)
        del self._members[name]
        self._is_torn = torn

    def __iter__(self) -> Iterator[str]:
        return iter(self._members)

    def __len__(self) -> int:
        return len(self._members)

    # ------------------------------------------------------------------ questions
    def collisions(self) -> list[tuple[str, str]]:
        """Return the pairs of objects that collide (Engine.collides), each and all by name.

        What has not changed since the last question costs nothing but a look at its revision.
        """
        self._bring_up()
        return list(self._pairs)

    def contains(self, x: float, y: float) -> list[str]:
        """Return the objects that contain a place, the boundary included, sorted by name.

        Raises InputError for an inadmissible place.
        """
        xs, ys = inputs.scalar(x, "x"), inputs.scalar(y, "y")
        self._bring_up()
        near = self._meeting((xs, ys, xs, ys))
        return sorted(each.name for each in near if each.engine.contains(xs, ys))

    def nearest(self, x: float, y: float) -> tuple[str | None, Nearest]:
        """Return the object whose boundary is nearest to a place, and Engine.nearest of it.

        Of several as near the first by name; (None, of a degenerate object) if none has a boundary.

        Raises InputError for an inadmissible place. O(log n) and the objects no farther in x.
        """
        xs, ys = inputs.scalar(x, "x"), inputs.scalar(y, "y")
        self._bring_up()
        best = math.inf, ""

        def look_at(member: _Member) -> None:
            nonlocal best
            x_low, y_low, x_high, y_high = cast("Box", member.box)
            gap = math.hypot(max(x_low - xs, xs - x_high, 0.0), max(y_low - ys, ys - y_high, 0.0))
            if gap <= best[0] * _BIT_MORE:
                best = min(best, (member.engine.distance(xs, ys), member.name))

        for exponent, level in self._levels.items():
            for member in level.irange_key(None, xs, reverse=True):
                if member.box[0] < _before(xs - best[0] * _BIT_MORE, exponent):
                    break
                look_at(member)
            for member in level.irange_key(xs, None, inclusive=(False, True)):
                if member.box[0] - xs > best[0] * _BIT_MORE:
                    break
                look_at(member)
        if best[0] == math.inf:
            return None, Nearest(math.nan, math.nan, math.inf, -1, -1)
        return best[1], self[best[1]].nearest(xs, ys)

    # ------------------------------------------------------------------ verification
    def check(self) -> None:
        """Verify every invariant; raise InvariantError with what was seen. O(n^2) collides."""
        self._bring_up()
        listed = [each for level in self._levels.values() for each in level]
        boxed = [each for each in self._members.values() if each.box is not None]
        if sorted(each.name for each in listed) != sorted(each.name for each in boxed):
            raise InvariantError("the index does not hold each object with a boundary once")
        for member in self._members.values():
            if member.box != _box(member.engine):
                raise InvariantError(f"{member.name!r} has another box than {member.box}")
            if member.box is not None and member not in self._levels[_level(member.box)]:
                raise InvariantError(f"{member.name!r} is not on its level")
            true = {
                other.name
                for other in self._members.values()
                if other is not member and member.engine.collides(other.engine)
            }
            pairs = {pair for pair in self._pairs if member.name in pair}
            if member.contacts != true or pairs != {_pair(member.name, each) for each in true}:
                raise InvariantError(f"{member.name!r} touches {true}, got {member.contacts}")

    # ------------------------------------------------------------------ behind the face
    def _bring_up(self) -> None:
        """Look at all that has changed: boxes first, for contacts are found by them."""
        if self._is_torn:
            self._forget()
        self._roster.add_changed(self._stale)
        if not self._stale:
            return
        self._is_torn = True
        changed = [member for row in self._stale if (member := self._rows[row]) is not None]
        for member in changed:
            self._place(member, _box(member.engine))
        done: set[_Member] = set()
        for member in changed:
            contacts = set()
            for other in self._meeting(member.box) if member.box is not None else ():
                if other in done:
                    if other.name in member.contacts:
                        contacts.add(other.name)
                elif other is not member and member.engine.collides(other.engine):
                    contacts.add(other.name)
            self._meet(member, contacts)
            done.add(member)
        self._stale.clear()
        self._is_torn = False

    def _forget(self) -> None:
        """Start from nothing but the members."""
        self._levels, self._pairs = {}, SortedSet()
        for member in self._members.values():
            member.box, member.contacts = None, set()
        self._stale = {member.row for member in self._members.values()}

    def _place(self, member: _Member, box: Box | None) -> None:
        """Give a member another box, or none."""
        if member.box == box:
            return
        if member.box is not None:
            level = self._levels[_level(member.box)]
            level.remove(member)
            if not level:
                del self._levels[_level(member.box)]
        member.box = box
        if box is not None:
            if _level(box) not in self._levels:
                self._levels[_level(box)] = SortedKeyList(key=_left)
            self._levels[_level(box)].add(member)

    def _meet(self, member: _Member, contacts: set[str]) -> None:
        """Set the contacts of a member, on both sides."""
        name = member.name
        for other in member.contacts - contacts:
            self._members[other].contacts.discard(name)
            self._pairs.discard(_pair(name, other))
        for other in contacts - member.contacts:
            self._members[other].contacts.add(name)
            self._pairs.add(_pair(name, other))
        member.contacts = contacts

    def _meeting(self, box: Box) -> Iterator[_Member]:
        """Yield the members whose boxes meet a box."""
        x_low, y_low, x_high, y_high = box
        for exponent, level in self._levels.items():
            for member in level.irange_key(_before(x_low, exponent), x_high):
                x0, y0, x1, y1 = member.box
                if x1 >= x_low and y0 <= y_high and y1 >= y_low and x0 <= x_high:
                    yield member


def _left(member: _Member) -> float:
    return cast("Box", member.box)[0]


def _box(engine: Engine) -> Box | None:
    box = engine._kernel.box()
    return None if math.isnan(box[0]) else box


def _level(box: Box) -> int:
    """Return the exponent of a power of two that is more than the width of a box."""
    return math.frexp(box[2] - box[0])[1]


def _before(x: float, exponent: int) -> float:
    """Return no more than x - 2 ** exponent."""
    return math.nextafter(x - math.ldexp(1.0, exponent), -math.inf)


def _pair(a: str, b: str) -> tuple[str, str]:
    return (a, b) if a < b else (b, a)
