"""What constriction returns: the ring, and what it could not reach."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import DTypeLike, NDArray

Status = Literal["closed", "locked", "degenerate"]


@dataclass(frozen=True, eq=False)
class Boundary:
    """A simple closed polygon, the boundary of the object (section 3.1).

    Arrays are read-only. The ring runs counter-clockwise from the lexicographically smallest
    vertex, which is not repeated at the end.

    Attributes:
        ids: int64 (n,), the points along the ring.
        xy: float64 (n, 2), their coordinates, in the unit of the input.
        status: "closed" if the ring passes through every point; "locked" if constriction of the
            Delaunay triangulation stopped before, and then the ring is a simple polygon through
            the others; "degenerate" if there is no polygon (fewer than three points, or all on a
            line), and then the ring is empty.
        inside: int64 (m,), the points that lie inside the ring instead of on it, by coordinates.
        d: how far the gamma-graph was widened; 0.0 is the Delaunay triangulation.
    """

    ids: NDArray[np.int64]
    xy: NDArray[np.float64]
    status: Status
    inside: NDArray[np.int64]
    d: float

    def __len__(self) -> int:
        return len(self.ids)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(self.xy, dtype=dtype, copy=copy)

    @cached_property
    def area(self) -> float:
        """Area of the object, in square units. O(n) once."""
        if len(self.xy) == 0:
            return 0.0
        x, y = (self.xy - self.xy[0]).T  # near the ring, fewer digits cancel
        return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2

    @cached_property
    def length(self) -> float:
        """Length of the boundary, in units. O(n) once."""
        step = np.roll(self.xy, -1, axis=0) - self.xy
        return float(np.sum(np.hypot(step[:, 0], step[:, 1])))

    @property
    def __geo_interface__(self) -> dict[str, Any]:
        ring = [tuple(p) for p in self.xy.tolist()]
        return {"type": "Polygon", "coordinates": [[*ring, ring[0]]] if ring else []}
