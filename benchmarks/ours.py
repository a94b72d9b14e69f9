"""Questions to an engine that bring it up to date, and cost little else."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flintknap import Engine


def triangulated(engine: Engine) -> None:
    """Place every point in the triangulation.

    Every public question costs more than that: edges() lists them all, side() also repairs the
    boundary. This one of the kernel looks at a single number once the points are placed.
    """
    engine._kernel.is_flat()


def bounded(engine: Engine) -> None:
    """Bring the boundary up to date as well; (0, 0) is a place like any other."""
    engine.side(0.0, 0.0)
