"""What collision queries return: the nearest point, the first hit, all crossings, bounds, holders.

Of scalars, scalars; of arrays, arrays of their common shape. Edges are told by the ids of their
ends, `start` and `stop`, counter-clockwise along the boundary.

Asked with a level or a tolerance, queries answer from that approximation and its errors (section
4.1), refine the tree only where the answer lies, and never contradict the exact answer: numbers
come as Bounds, and yes or no as +1, certainly yes, -1, certainly no, or 0, not decided there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Nearest(NamedTuple):
    """The point of the boundary that is nearest to a place: numbers, or arrays of places' shape.

    Attributes:
        x: float64, its coordinates, in the unit of the input; nan where there is no boundary.
        y: float64, the same.
        distance: float64, from it to the place; inf where there is no boundary.
        start: int64, the id at the beginning of the edge that it lies on; -1 where there is none.
        stop: int64, the id at its end; -1 where there is none.

    """

    x: float | NDArray[np.float64]
    y: float | NDArray[np.float64]
    distance: float | NDArray[np.float64]
    start: int | NDArray[np.int64]
    stop: int | NDArray[np.int64]


class Hit(NamedTuple):
    """Where a segment first meets the boundary: numbers, or arrays of the segments' shape.

    Attributes:
        t: float64, from 0 at the segment's start to 1 at its end; nan where it meets nothing.
        start: int64, the id at the beginning of the edge that is met; -1 where it meets nothing.
        stop: int64, the id at its end; -1 where it meets nothing.

    """

    t: float | NDArray[np.float64]
    start: int | NDArray[np.int64]
    stop: int | NDArray[np.int64]


class Bounds(NamedTuple):
    """What is known of a number: lower <= number <= upper, both rounded outward.

    Each level's bounds of a distance to the boundary, or of a first hit, lie within those of the
    level above. Within a tolerance the bounds of a distance differ by no more than twice that,
    those of the clearance of two objects by no more than three times, but for rounding.
    """

    lower: float | NDArray[np.float64]
    upper: float | NDArray[np.float64]


class Crossings(NamedTuple):
    """The edges of the boundary that segments meet, one a row, sorted along each segment.

    An edge that touches a segment, or overlaps with it, has a row as well, and so have both edges
    at a vertex that it passes through.

    Attributes:
        segment: int64 (m,), the index of the segment, among those of the call laid out in a row.
        t: float64 (m,), where it first meets the edge: from 0 at its start to 1 at its end.
        start: int64 (m,), the id at the beginning of the edge.
        stop: int64 (m,), the id at its end.

    """

    segment: NDArray[np.int64]
    t: NDArray[np.float64]
    start: NDArray[np.int64]
    stop: NDArray[np.int64]


class Held(NamedTuple):
    """The objects of a scene that contain places, one place and one object a row.

    ``place`` is the index of the place, among those of the call if they are laid out in a row, and
    ``name`` that of the object (str). Sorted by place, then by name; a place that no object
    contains has no row.
    """

    place: NDArray[np.int64]
    name: NDArray[np.object_]


def shaped(columns: tuple[NDArray[Any], ...], shape: tuple[int, ...]) -> list[Any]:
    """Return columns in a shape; of no dimensions, the Python scalars."""
    return [column.reshape(shape) if shape else column[0].item() for column in columns]
