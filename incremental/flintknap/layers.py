"""Layers of a picture: which ones there are, and how a list of them is read.

"points,boundary,flintstones:4" is three layers, drawn in this order, the later over the earlier::

    points              every point
    graph:GRAPH         edges of a gamma-graph: delaunay (if :GRAPH is left out), gabriel, hull,
                        void, complete, beta=B (a beta-skeleton) or d=D (gamma1 from D to 1)
    boundary            the object, and a cross on each point left inside
    approximation:CUT   a polygon through some vertices
    flintstones:CUT     the areas that hold the boundary
    smooth:CUT          the smooth curve through all vertices, or through those of a cut
    control:CUT         the control polygon of that curve

A CUT is a level, such as 4, or a largest error, such as tolerance=0.5; smooth and control do
without, too. Each layer is a question to an engine, and its options are what the question takes.

Imports nothing large: the command reads its arguments with it.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any, NamedTuple

from flintknap import gamma
from flintknap.errors import InputError

NAMED_GRAPHS = ("delaunay", "gabriel", "hull", "void", "complete")
LAYERS = {
    "points": "points",
    "graph": f"graph:GRAPH with one of {', '.join(NAMED_GRAPHS)}, beta=B or d=D",
    "boundary": "boundary",
    "approximation": "approximation:LEVEL or approximation:tolerance=T",
    "flintstones": "flintstones:LEVEL or flintstones:tolerance=T",
    "smooth": "smooth, smooth:LEVEL or smooth:tolerance=T",
    "control": "control, control:LEVEL or control:tolerance=T",
}
PLAIN = ("points", "boundary")  # without options
WHOLE = ("smooth", "control")  # of the boundary, if no cut is named


class Layer(NamedTuple):
    """A ``kind`` of layer, and as ``options`` the arguments of the engine's method it shows."""

    kind: str
    options: dict[str, Any]


def parse(text: str) -> list[Layer]:
    """Return the layers that a list names, in its order.

    Raises InputError for an empty list and for what is no layer, with what was expected.
    """
    return [_layer(part.strip()) for part in text.split(",")]


def _layer(text: str) -> Layer:
    kind, colon, value = text.partition(":")
    if kind not in LAYERS:
        raise InputError(f"layers: got {text!r}, expected one of {', '.join(LAYERS)}")
    try:
        if kind in PLAIN or (kind in WHOLE and not colon):
            if colon:
                raise ValueError
            return Layer(kind, {})
        return Layer(kind, _graph(value, colon) if kind == "graph" else _cut(value))
    except ValueError as error:  # InputError is one, and knows more
        why = f": {error}" if isinstance(error, InputError) else ""
        raise InputError(f"layers: got {text!r}, expected {LAYERS[kind]}{why}") from None


def _cut(text: str) -> dict[str, Any]:
    key, is_named, value = text.partition("=")
    if not is_named:
        if not (text.isascii() and text.isdigit()):
            raise InputError("a level is an integer, 0 or more")
        return {"level": int(text)}
    if key != "tolerance":
        raise ValueError
    with suppress(ValueError):
        if float(value) >= 0:  # false, too, for what is not a number
            return {"tolerance": float(value)}
    raise InputError("a tolerance is a number, 0 or more")


def _graph(text: str, colon: str) -> dict[str, Any]:
    if not colon:
        return {"graph": "delaunay"}
    if text in NAMED_GRAPHS:
        return {"graph": text}
    key, _, value = text.partition("=")
    options: dict[str, Any]
    if key == "beta":
        options = {"graph": ("beta_skeleton", float(value))}
    elif key == "d":
        options = {"gamma1": (float(value), 1.0)}
    else:
        raise ValueError
    gamma.intervals(options.get("graph"), None, options.get("gamma1"))
    return options
