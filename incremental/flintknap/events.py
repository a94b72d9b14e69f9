"""What a log says: a header, then events; and what a replay says back: answers.

Every type here is one line of JSON, its fields in the order given (`docs/log-format.md`). Decoding
checks that nothing is missing, nothing unknown and every number finite; whether a coordinate has
an admissible magnitude is asked where it enters an engine (inputs.py).

Times, and the unit of coordinates, are the business of whoever wrote the log. Objects are told
apart by name; each has an engine of its own.

No event can be part of a reference cycle, so the garbage collector is told to pass them over
(`gc=False`): otherwise every block of a long log would set it off.
"""

from __future__ import annotations

from typing import Literal

import msgspec

Kind = Literal["side", "contains"]


class Header(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The first line."""

    format: Literal["flintknap"]
    version: Literal[1]


class _Record(msgspec.Struct, frozen=True, forbid_unknown_fields=True, gc=False):
    """What events and answers have in common."""


class Insert(_Record, tag_field="op", tag="insert", frozen=True, kw_only=True):
    """At time ``t`` a point (x, y) on the boundary of the object was seen."""

    t: float
    object: str = "object"
    x: float
    y: float


class Query(_Record, tag_field="op", tag="query", frozen=True, kw_only=True):
    """Ask the object, as of this line, for `Engine.side` or `Engine.contains` of (x, y)."""

    t: float
    object: str = "object"
    kind: Kind
    x: float
    y: float


class Answer(_Record, frozen=True, kw_only=True):
    """What the engine said to a query: -1, 0 or 1 for "side", true or false for "contains"."""

    t: float
    object: str
    kind: Kind
    x: float
    y: float
    answer: int | bool


Event = Insert | Query
HEADER = Header("flintknap", 1)
