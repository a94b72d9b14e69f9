"""What an engine tells of places, segments and other objects: inside, how far, what meets what.

Theory (theory.md, sections 4 to 6). Yes and no are exact: signs of orientation decide, and touching
counts. Distances are correctly rounded. Answers come from the ring in boxes, which follows local
changes; with a level or a tolerance, from the approximation of that cut, as far as it tells: bounds
of numbers, and +1, -1 or 0, not decided, for yes or no. Those never contradict the exact answers,
and refine only what they need.

Cost. As stated; the first answer after a change brings the object up to date.

Refuses coordinates as the engine does (InputError).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, TypeVar, overload

import numpy as np

from flintknap import inputs
from flintknap._kernel import quick
from flintknap.collision import Bounds, Crossings, Hit, Nearest, shaped
from flintknap.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    from flintknap._kernel import Kernel


_Scalar = TypeVar("_Scalar", int, float, bool)


class Queries:
    """The part of an engine that answers them."""

    __slots__ = ("_kernel",)  # where `quick` finds it

    _kernel: Kernel

    @overload
    def side(
        self, x: float, y: float, *, level: int | None = None, tolerance: float | None = None
    ) -> int: ...
    @overload
    def side(
        self,
        x: ArrayLike,
        y: ArrayLike | None = None,
        *,
        level: int | None = None,
        tolerance: float | None = None,
    ) -> int | NDArray[np.int8]: ...
    @quick
    def side(
        self,
        x: ArrayLike,
        y: ArrayLike | None = None,
        *,
        level: int | None = None,
        tolerance: float | None = None,
    ) -> int | NDArray[np.int8]:
        """Tell where places lie: +1 inside the object, 0 on its boundary, -1 outside. Exact.

        Numbers or arrays, as in insert; an int for two numbers, else int8 of the common shape. A
        degenerate object has no boundary and no inside: -1 everywhere. O(log n) a place on curves;
        on rings as crooked as can be, a few times that (theory.md, section 4).

        With a ``level`` or a ``tolerance``, as far as that approximation tells (section 4.1): +1
        and -1 where they are certain, 0 where the place is no farther from one of its edges than
        the boundary behind it, and so on all levels above; with a level, in their Flintstones, too.
        Within a tolerance that means a place no farther from the boundary than twice that. The tree
        is refined along the way of each place only.

        Raises InputError naming the first row at fault, or for a bad level or tolerance.
        """
        if level is not None or tolerance is not None:
            cut = inputs.cut(level, tolerance)
            return _of_places(self._kernel.side_at, x, y, int, *cut)
        return _of_places(self._kernel.side_many, x, y, int)

    @overload
    def contains(self, x: float, y: float) -> bool: ...
    @overload
    def contains(self, x: ArrayLike, y: ArrayLike | None = None) -> bool | NDArray[np.bool_]: ...
    @quick
    def contains(self, x: ArrayLike, y: ArrayLike | None = None) -> bool | NDArray[np.bool_]:
        """Tell which places belong to the closed object: side(x, y) >= 0.

        A bool for two numbers, else bool of the common shape. Cost and errors as of side.
        """
        return self.side(x, y) >= 0

    @overload
    def distance(self, x: float, y: float) -> float: ...
    @overload
    def distance(self, x: ArrayLike, y: ArrayLike | None = None) -> float | NDArray[np.float64]: ...
    @overload
    def distance(self, x: ArrayLike, y: ArrayLike | None = None, *, level: int) -> Bounds: ...
    @overload
    def distance(self, x: ArrayLike, y: ArrayLike | None = None, *, tolerance: float) -> Bounds: ...
    @quick
    def distance(
        self,
        x: ArrayLike,
        y: ArrayLike | None = None,
        *,
        level: int | None = None,
        tolerance: float | None = None,
    ) -> float | NDArray[np.float64] | Bounds:
        """Return how far places are from the boundary, inside or outside: 0.0 on it.

        Numbers or arrays, as in insert; correctly rounded, in the unit of the input. inf for a
        degenerate object. O(log n) a place, unless many edges are equally far.

        With a ``level`` or a ``tolerance``: Bounds, as far as that approximation tells.

        Raises InputError naming the first row at fault, or for a bad level or tolerance.
        """
        if level is not None or tolerance is not None:
            xs, ys = inputs.pairs(x, y)
            cut = inputs.cut(level, tolerance)
            found = self._kernel.distance_at(xs.reshape(-1), ys.reshape(-1), *cut)
            return Bounds(*shaped(found, xs.shape))
        return _of_places(self._kernel.distance_many, x, y, float)

    def nearest(self, x: ArrayLike, y: ArrayLike | None = None) -> Nearest:
        """Return the nearest points of the boundary, their distances and edges.

        Numbers or arrays, as in insert. Of edges at the same distance, so rounded, that is taken
        whose start has the smaller coordinates: of two at a vertex, too. Coordinates of the point
        are rounded from 2^-95 of those of the edge. Cost as of distance.

        Raises InputError naming the first row at fault.
        """
        xs, ys = inputs.pairs(x, y)
        return Nearest(*shaped(self._kernel.nearest(xs.reshape(-1), ys.reshape(-1)), xs.shape))

    @overload
    def intersects(self, x0: float, y0: float, x1: float, y1: float) -> bool: ...
    @overload
    def intersects(
        self, x0: ArrayLike, y0: ArrayLike, x1: ArrayLike, y1: ArrayLike
    ) -> bool | NDArray[np.bool_]: ...
    @overload
    def intersects(
        self, x0: ArrayLike, y0: ArrayLike, x1: ArrayLike, y1: ArrayLike, *, level: int
    ) -> int | NDArray[np.int8]: ...
    @overload
    def intersects(
        self, x0: ArrayLike, y0: ArrayLike, x1: ArrayLike, y1: ArrayLike, *, tolerance: float
    ) -> int | NDArray[np.int8]: ...
    @quick
    def intersects(
        self,
        x0: ArrayLike,
        y0: ArrayLike,
        x1: ArrayLike,
        y1: ArrayLike,
        *,
        level: int | None = None,
        tolerance: float | None = None,
    ) -> bool | NDArray[np.bool_] | int | NDArray[np.int8]:
        """Tell which closed segments from (x0, y0) to (x1, y1) meet the boundary. Exact.

        Numbers, or arrays that broadcast. Touching counts; a segment may be a single point. False
        for a degenerate object. O(log n) and the boxes of the boundary that the segment meets.

        With a ``level`` or a ``tolerance``, as far as that approximation tells: +1 yes, -1 no, 0
        not decided; an int for numbers, else int8.

        Raises InputError naming the first row at fault, or for a bad level or tolerance.
        """
        kernel = self._kernel
        ends = (x0, y0, x1, y1)
        return _of_segments(kernel.intersects_many, kernel.intersects_at, ends, level, tolerance)

    @overload
    def contains_segment(self, x0: float, y0: float, x1: float, y1: float) -> bool: ...
    @overload
    def contains_segment(
        self, x0: ArrayLike, y0: ArrayLike, x1: ArrayLike, y1: ArrayLike
    ) -> bool | NDArray[np.bool_]: ...
    @overload
    def contains_segment(
        self, x0: ArrayLike, y0: ArrayLike, x1: ArrayLike, y1: ArrayLike, *, level: int
    ) -> int | NDArray[np.int8]: ...
    @overload
    def contains_segment(
        self, x0: ArrayLike, y0: ArrayLike, x1: ArrayLike, y1: ArrayLike, *, tolerance: float
    ) -> int | NDArray[np.int8]: ...
    @quick
    def contains_segment(
        self,
        x0: ArrayLike,
        y0: ArrayLike,
        x1: ArrayLike,
        y1: ArrayLike,
        *,
        level: int | None = None,
        tolerance: float | None = None,
    ) -> bool | NDArray[np.bool_] | int | NDArray[np.int8]:
        """Tell which segments lie wholly in the closed object: they may run along its boundary.

        Exact. Arguments, cost and errors as of intersects, with a level or a tolerance as well.
        """
        kernel = self._kernel
        ends = (x0, y0, x1, y1)
        return _of_segments(kernel.holds_many, kernel.holds_at, ends, level, tolerance)

    @overload
    def first_hit(self, x0: ArrayLike, y0: ArrayLike, x1: ArrayLike, y1: ArrayLike) -> Hit: ...
    @overload
    def first_hit(
        self, x0: ArrayLike, y0: ArrayLike, x1: ArrayLike, y1: ArrayLike, *, level: int
    ) -> Bounds: ...
    @overload
    def first_hit(
        self, x0: ArrayLike, y0: ArrayLike, x1: ArrayLike, y1: ArrayLike, *, tolerance: float
    ) -> Bounds: ...
    def first_hit(
        self,
        x0: ArrayLike,
        y0: ArrayLike,
        x1: ArrayLike,
        y1: ArrayLike,
        *,
        level: int | None = None,
        tolerance: float | None = None,
    ) -> Hit | Bounds:
        """Return where segments first meet the boundary on their way from (x0, y0).

        The parameter t in [0, 1] is correctly rounded; of edges with the same one, that whose
        start has the smaller coordinates. Arguments, cost and errors as of intersects.

        With a ``level`` or a ``tolerance``: Bounds of t, as far as that approximation tells, inf
        standing for no hit. So the way is free up to the lower one, and if that is inf, to the end;
        if only the upper one is, it is not decided whether there is a hit.
        """
        ends = inputs.segments(x0, y0, x1, y1)
        if level is not None or tolerance is not None:
            x0s, y0s, x1s, y1s = (each.reshape(-1) for each in ends)
            cut = inputs.cut(level, tolerance)
            found = self._kernel.first_hit_at(x0s, y0s, x1s, y1s, *cut)
            return Bounds(*shaped(found, ends[0].shape))
        hits = self._kernel.first_hit(*(each.reshape(-1) for each in ends))
        return Hit(*shaped(hits, ends[0].shape))

    def crossings(self, x0: ArrayLike, y0: ArrayLike, x1: ArrayLike, y1: ArrayLike) -> Crossings:
        """Return all edges of the boundary that segments meet, and where, as first_hit has it.

        Sorted by segment, then t, then start. Arguments and errors as of intersects; O(log n) and
        the boxes of the boundary that the segment meets.
        """
        ends = inputs.segments(x0, y0, x1, y1)
        return Crossings(*self._kernel.crossings(*(each.reshape(-1) for each in ends)))

    @overload
    def collides(self, other: Queries) -> bool: ...
    @overload
    def collides(self, other: Queries, *, level: int) -> int: ...
    @overload
    def collides(self, other: Queries, *, tolerance: float) -> int: ...
    def collides(
        self, other: Queries, *, level: int | None = None, tolerance: float | None = None
    ) -> bool | int:
        """Tell whether the two closed objects have a point in common: touching counts. Exact.

        False if one is degenerate. O(log n) and the pairs of boxes of their boundaries that meet.

        With a ``level`` or a ``tolerance``, as far as these approximations of both tell: +1 yes,
        -1 no, 0 not decided.

        Raises InputError for a bad level or tolerance.
        """
        if level is not None or tolerance is not None:
            return self._kernel.collides_at(other._kernel, *inputs.cut(level, tolerance))
        return self._kernel.collides(other._kernel)

    @overload
    def clearance(self, other: Queries) -> float: ...
    @overload
    def clearance(self, other: Queries, *, at_least: float) -> bool: ...
    @overload
    def clearance(self, other: Queries, *, level: int) -> Bounds: ...
    @overload
    def clearance(self, other: Queries, *, tolerance: float) -> Bounds: ...
    @overload
    def clearance(self, other: Queries, *, at_least: float, level: int) -> int: ...
    @overload
    def clearance(self, other: Queries, *, at_least: float, tolerance: float) -> int: ...
    def clearance(
        self,
        other: Queries,
        *,
        at_least: float | None = None,
        level: int | None = None,
        tolerance: float | None = None,
    ) -> float | bool | Bounds | int:
        """Return how far apart the two closed objects are: 0.0 if they collide.

        Correctly rounded; inf if one is degenerate. With ``at_least``, tell whether it is that or
        more, which may need far less work: O(log n) and the pairs of boxes no farther apart.

        With a ``level`` or a ``tolerance``, as far as these approximations of both tell: Bounds, or
        with ``at_least`` +1 yes, -1 no, 0 not decided.

        Raises InputError unless ``at_least`` is a finite number, or for a bad level or tolerance.
        """
        if at_least is not None and not math.isfinite(at_least):
            raise InputError(f"at_least: got {at_least!r}, expected a finite number")
        if level is not None or tolerance is not None:
            cut = inputs.cut(level, tolerance)
            if at_least is None:
                return Bounds(*self._kernel.clearance_at(other._kernel, *cut))
            return self._kernel.is_clear_at(other._kernel, at_least, *cut)
        if at_least is None:
            return self._kernel.clearance(other._kernel)
        return self._kernel.is_clear(other._kernel, at_least)


def _of_places(
    many: Callable[..., NDArray[Any]],
    x: ArrayLike,
    y: ArrayLike | None,
    scalar: Callable[[Any], _Scalar],
    *cut: float,
) -> _Scalar | NDArray[Any]:
    xs, ys = inputs.pairs(x, y)
    return _shaped(many(xs.reshape(-1), ys.reshape(-1), *cut), xs.shape, scalar)


def _of_segments(
    many: Callable[..., NDArray[np.uint8]],
    many_at: Callable[..., NDArray[np.int8]],
    ends: tuple[ArrayLike, ArrayLike, ArrayLike, ArrayLike],
    level: int | None,
    tolerance: float | None,
) -> bool | NDArray[np.bool_] | int | NDArray[np.int8]:
    arrays = inputs.segments(*ends)
    columns, shape = [each.reshape(-1) for each in arrays], arrays[0].shape
    if level is None and tolerance is None:
        return _shaped(many(*columns).view(np.bool_), shape, bool)
    return _shaped(many_at(*columns, *inputs.cut(level, tolerance)), shape, int)


def _shaped(
    column: NDArray[Any], shape: tuple[int, ...], scalar: Callable[[Any], _Scalar]
) -> _Scalar | NDArray[Any]:
    return column.reshape(shape) if shape else scalar(column[0])
