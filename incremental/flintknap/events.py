"""What a log says: a header, then events; and what a replay says back: answers and contacts.

Every type here is one line of JSON, its fields in the order given (`docs/log-format.md`). Decoding
checks that nothing is missing, nothing unknown and every number finite; whether a coordinate has
an admissible magnitude is asked where it enters an engine (inputs.py), and whether there is such a
point where it is looked for (replay.py).

Times, and the unit of coordinates, are the business of whoever wrote the log. Objects are told
apart by name; each has an engine of its own.

No event can be part of a reference cycle, so the garbage collector is told to pass them over
(`gc=False`): otherwise every block of a long log would set it off.
"""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import UNSET, UnsetType

Id = Annotated[int, msgspec.Meta(ge=0, le=2**63 - 1)]
Level = Annotated[int, msgspec.Meta(ge=0, le=2**31 - 1)]
Kind = Literal["side", "contains"]


class Header(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The first line: the ``format`` and its ``version``."""

    format: Literal["flintknap"]
    version: Literal[1]


class _Record(msgspec.Struct, frozen=True, forbid_unknown_fields=True, gc=False):
    """What events and answers have in common."""


class Insert(_Record, tag_field="op", tag="insert", frozen=True, kw_only=True):
    """At time ``t`` a point (``x``, ``y``) on the boundary of the ``object`` was seen."""

    t: float
    object: str = "object"
    x: float
    y: float


class Remove(_Record, tag_field="op", tag="remove", frozen=True, kw_only=True):
    """At time ``t`` a point of the ``object`` was taken back.

    That with the ``id``, or else that at (``x``, ``y``).
    """

    t: float
    object: str = "object"
    id: Id | UnsetType = UNSET
    x: float | UnsetType = UNSET
    y: float | UnsetType = UNSET

    def __post_init__(self) -> None:
        given = [self.id is not UNSET, self.x is not UNSET, self.y is not UNSET]
        if given not in ([True, False, False], [False, True, True]):
            raise ValueError("Object needs either field `id` or fields `x` and `y`")

    @property
    def place(self) -> tuple[float, float] | None:
        """Where the point is, if that is how it was named."""
        if isinstance(self.x, UnsetType) or isinstance(self.y, UnsetType):
            return None
        return self.x, self.y


class Move(_Record, tag_field="op", tag="move", frozen=True, kw_only=True):
    """At time ``t`` the point of the ``object`` with the ``id`` was seen at (``x``, ``y``)."""

    t: float
    object: str = "object"
    id: Id
    x: float
    y: float


class Query(_Record, tag_field="op", tag="query", frozen=True, kw_only=True):
    """At time ``t`` the ``object``, as of this line, is asked about the place (``x``, ``y``).

    ``kind`` is "side" or "contains", as of Engine; with a ``level``, which only "side" has, it is
    the side as far as that level tells.
    """

    t: float
    object: str = "object"
    kind: Kind
    x: float
    y: float
    level: Level | UnsetType = UNSET

    def __post_init__(self) -> None:
        if self.level is not UNSET and self.kind != "side":
            raise ValueError(f"Object has field `level`, which kind `{self.kind}` has not")


class Answer(_Record, frozen=True, kw_only=True):
    """What the engine said to a query, of which all fields are repeated.

    ``t``, ``object``, ``kind``, (``x``, ``y``) and ``level`` are those of the query; ``answer`` is
    -1, 0 or 1 for "side", true or false for "contains".
    """

    t: float
    object: str
    kind: Kind
    x: float
    y: float
    level: Level | UnsetType = UNSET
    answer: int | bool


class Contact(_Record, frozen=True, kw_only=True):
    """By time ``t`` two objects began to collide, or ceased to.

    ``contact`` is "begin" or "end", ``objects`` are their two names, sorted.
    """

    t: float
    contact: Literal["begin", "end"]
    objects: tuple[str, str]


Event = Insert | Remove | Move | Query
HEADER = Header("flintknap", 1)
