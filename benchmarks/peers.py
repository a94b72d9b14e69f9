"""Peers set up alike for every benchmark; each is imported when its turn comes, off the clock."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from benchmarks.sets import Points


def condeltri(order: str = "AUTO") -> Any:
    """Return an empty triangulation of condeltri, which inserts points AUTO or AS_PROVIDED."""
    import condeltri

    return condeltri.Triangulation(
        getattr(condeltri.VertexInsertionOrder, order),
        condeltri.IntersectingConstraintEdges.NOT_ALLOWED,
        0.0,
    )


def startinpy() -> Any:
    """Return an empty triangulation of startinpy, set up for points in random order.

    Its own snap tolerance, 1e-3, would merge points.
    """
    import startinpy

    made = startinpy.DT()
    made.snap_tolerance = 1e-13
    made.jump_and_walk = True
    return made


def with_height(points: Points) -> NDArray[np.float64]:
    """Return the points as startinpy wants them, (n, 3)."""
    return np.column_stack((points, np.zeros(len(points))))
