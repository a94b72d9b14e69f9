"""What collision queries return: the nearest point, the first hit, all crossings, who holds what.

Of scalars, scalars; of arrays, arrays of their common shape. Edges are told by the ids of their
ends, `start` and `stop`, counter-clockwise along the boundary.
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
