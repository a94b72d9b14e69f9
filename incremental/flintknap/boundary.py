"""What constriction returns: the ring, and what it could not reach."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Literal

from flintknap.geometry import Polygonal

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from flintknap._kernel import Outline

Status = Literal["closed", "locked", "degenerate"]


@dataclass(frozen=True, eq=False)
class Boundary(Polygonal):
    """A simple closed polygon, the boundary of the object (section 3.1).

    Arrays are read-only. The ring runs counter-clockwise from the lexicographically smallest
    vertex, which is not repeated at the end. Area, length and formats: Polygonal.

    It stays what it is when the object changes. Vertices that boundaries of one object have in
    common are in memory once, but for the arrays: those are made when they are asked for.

    Attributes:
        status: "closed" if the ring passes through every point; "locked" if constriction stopped
            before, though the gamma-graph was widened as far as it may be, and then the ring is a
            simple polygon through the others; "degenerate" if there is no polygon (fewer than three
            points, or all on a line), and then the ring is empty.
        inside: int64 (m,), the points that lie inside the ring instead of on it, by coordinates.
        d: how far the gamma-graph was widened: gamma([-1, 1], [d, 1]) has all sides; 0.0 is the
            Delaunay triangulation.
    """

    status: Status
    inside: NDArray[np.int64]
    d: float
    _outline: Outline = field(repr=False)

    def __len__(self) -> int:
        return len(self._outline)

    @cached_property
    def ids(self) -> NDArray[np.int64]:
        """The points along the ring, int64 (n,). O(n) once."""
        ids = self._outline.ids()
        ids.flags.writeable = False
        return ids

    @cached_property
    def xy(self) -> NDArray[np.float64]:  # type: ignore[override]
        """Their coordinates, float64 (n, 2), in the unit of the input. O(n) once."""
        xy = self._outline.xy()
        xy.flags.writeable = False
        return xy
