"""What constriction returns: the ring, and what it could not reach."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from flintknap.geometry import Polygonal

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Status = Literal["closed", "locked", "degenerate"]


@dataclass(frozen=True, eq=False)
class Boundary(Polygonal):
    """A simple closed polygon, the boundary of the object (section 3.1).

    Arrays are read-only. The ring runs counter-clockwise from the lexicographically smallest
    vertex, which is not repeated at the end. Area, length and formats: Polygonal.

    Attributes:
        ids: int64 (n,), the points along the ring.
        xy: float64 (n, 2), their coordinates, in the unit of the input.
        status: "closed" if the ring passes through every point; "locked" if constriction stopped
            before, though the gamma-graph was widened as far as it may be, and then the ring is a
            simple polygon through the others; "degenerate" if there is no polygon (fewer than three
            points, or all on a line), and then the ring is empty.
        inside: int64 (m,), the points that lie inside the ring instead of on it, by coordinates.
        d: how far the gamma-graph was widened: gamma([-1, 1], [d, 1]) has all sides; 0.0 is the
            Delaunay triangulation.
    """

    ids: NDArray[np.int64]
    xy: NDArray[np.float64]
    status: Status
    inside: NDArray[np.int64]
    d: float
