"""What collision queries return: the nearest point, the first hit, all crossings, bounds.

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
    """The point of the boundary that is nearest to a place.

    ``x`` and ``y`` are its coordinates, ``distance`` that to the place. Of an object without a
    boundary: nan, nan, inf, and -1 for both ids.
    """

    x: float | NDArray[np.float64]
    y: float | NDArray[np.float64]
    distance: float | NDArray[np.float64]
    start: int | NDArray[np.int64]
    stop: int | NDArray[np.int64]


class Hit(NamedTuple):
    """Where a segment first meets the boundary: at (1 - t) of its start and t of its end.

    ``t`` is nan, and both ids are -1, where it does not.
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

    ``segment`` is the index of the segment, among those of the call if they are laid out in a
    row; ``t`` where it first meets the edge. An edge that touches it, or overlaps with it, has a
    row as well, and so have both edges at a vertex that it passes through.
    """

    segment: NDArray[np.int64]
    t: NDArray[np.float64]
    start: NDArray[np.int64]
    stop: NDArray[np.int64]


def shaped(columns: tuple[NDArray[Any], ...], shape: tuple[int, ...]) -> list[Any]:
    """Return columns in a shape; of no dimensions, the Python scalars."""
    return [column.reshape(shape) if shape else column[0].item() for column in columns]
