"""The border: every cast, shape and finiteness check, once.

Behind it, coordinates are float64, finite and of admissible magnitude; the rest of the package
does not ask again. (That -0.0 is 0.0 the kernel sees to.) The magnitudes are those for which the
kernel's exact predicates neither overflow nor underflow: 0, or MIN_MAGNITUDE to MAX_MAGNITUDE.

A refusal names the first row at fault, what was got and what was expected.
Cost: O(1) a scalar, O(n) an array, without a copy where the input is float64 already.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from flintknap._kernel import MAX_MAGNITUDE, MIN_MAGNITUDE, first_outside
from flintknap.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

DEEPEST = 2**31 - 1  # level of any vertex
NO_TOLERANCE = -1.0  # which no error keeps

_EXPECTED = f"0 or a magnitude from {MIN_MAGNITUDE:g} to {MAX_MAGNITUDE:g}"


def scalar(value: float, name: str) -> float:
    """Return one coordinate, or raise InputError."""
    if MIN_MAGNITUDE <= value <= MAX_MAGNITUDE or MIN_MAGNITUDE <= -value <= MAX_MAGNITUDE:
        return value
    if value == 0:
        return value
    raise InputError(f"{name}: got {value!r}, expected {_EXPECTED}", row=0)


def level(value: object) -> int:
    """Return a level of the tree, cut off at DEEPEST, or raise InputError."""
    if isinstance(value, int | np.integer) and not isinstance(value, bool) and value >= 0:
        return min(int(value), DEEPEST)
    raise InputError(f"level: got {value!r}, expected an integer, 0 or more")


def count(value: object, name: str) -> int:
    """Return how many, one at least, or raise InputError."""
    if isinstance(value, int | np.integer) and not isinstance(value, bool) and value >= 1:
        return int(value)
    raise InputError(f"{name}: got {value!r}, expected an integer, 1 or more")


def tolerance(value: object) -> float:
    """Return a bound on errors, or raise InputError."""
    if isinstance(value, float | int | np.floating | np.integer) and not isinstance(value, bool):
        try:
            bound = float(value)
        except OverflowError:
            bound = math.inf if value > 0 else -math.inf
        if bound >= 0:  # false, too, for what is not a number
            return bound
    raise InputError(f"tolerance: got {value!r}, expected a number, 0 or more")


def cut(at_level: object, within: object) -> tuple[int, float]:
    """Return how far down the tree to go: while above a level, and while beyond a tolerance.

    One of the two is given, the other is None.
    """
    if (at_level is None) == (within is None):
        got = "neither" if at_level is None else f"level={at_level!r} and tolerance={within!r}"
        raise InputError(f"got {got}, expected either level or tolerance")
    if within is None:
        return level(at_level), NO_TOLERANCE
    return DEEPEST, tolerance(within)


def pairs(x: ArrayLike, y: ArrayLike | None) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return coordinates of one shape, broadcast as numpy does.

    ``x`` and ``y``, or one (n, 2) array in place of both.
    """
    if y is None:
        xy = _floats(x, "xy")
        if xy.ndim != 2 or xy.shape[1] != 2:
            raise InputError(f"xy: got an array of shape {xy.shape}, expected (n, 2)")
        xs, ys = xy[:, 0], xy[:, 1]
    else:
        xs, ys = _floats(x, "x"), _floats(y, "y")
        if xs.shape != ys.shape:
            try:
                xs, ys = np.broadcast_arrays(xs, ys)
            except ValueError:
                raise InputError(
                    f"x and y: got shapes {xs.shape} and {ys.shape}, expected shapes that broadcast"
                ) from None
    row = first_outside(xs.reshape(-1), ys.reshape(-1))
    if row >= 0 and xs.ndim == 0:
        scalar(float(xs), "x"), scalar(float(ys), "y")  # one of them raises
    if row >= 0:
        got = (float(xs.ravel()[row]), float(ys.ravel()[row]))
        raise InputError(
            f"row {row}: got {got}, expected coordinates that are {_EXPECTED}", row=row
        )
    return xs, ys


def segments(
    x0: ArrayLike, y0: ArrayLike, x1: ArrayLike, y1: ArrayLike
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Return the coordinates of both ends of segments in one shape, broadcast as numpy does."""
    got = [
        _floats(values, name) for values, name in ((x0, "x0"), (y0, "y0"), (x1, "x1"), (y1, "y1"))
    ]
    try:
        xs, ys, us, vs = np.broadcast_arrays(*got)
    except ValueError:
        shapes = ", ".join(str(each.shape) for each in got)
        raise InputError(
            f"x0, y0, x1, y1: got shapes {shapes}, expected shapes that broadcast"
        ) from None
    flat = [each.reshape(-1) for each in (xs, ys, us, vs)]
    rows = [first_outside(*flat[:2]), first_outside(*flat[2:])]
    row = min((row for row in rows if row >= 0), default=-1)
    if row >= 0:
        ends = tuple(float(each[row]) for each in flat)
        raise InputError(
            f"row {row}: got {ends}, expected coordinates that are {_EXPECTED}", row=row
        )
    return xs, ys, us, vs


def revision(since: int, now: int) -> int:
    """Return an earlier revision, or the current one."""
    if isinstance(since, bool) or not isinstance(since, int | np.integer) or not 0 <= since <= now:
        raise InputError(f"since: got {since!r}, expected a revision so far, from 0 to {now}")
    return int(since)


def identifiers(
    ids: ArrayLike, name: str, unknown: Callable[[NDArray[np.int64]], NDArray[np.bool_]]
) -> NDArray[np.int64]:
    """Return ids as int64; raise KeyError naming the first one that is ``unknown``."""
    got = np.asarray(ids)
    if got.size == 0:
        return np.zeros(got.shape, np.int64)
    if got.dtype.kind not in "iu":
        raise InputError(f"{name}: got values of type {got.dtype}, expected integer ids")
    out = got.astype(np.int64, copy=False)
    bad = unknown(out)
    if bad.any():
        raise KeyError(int(got.ravel()[int(np.argmax(bad.ravel()))]))
    return out


def _floats(values: ArrayLike, name: str) -> NDArray[np.float64]:
    try:
        got = np.asarray(values)
    except ValueError as ragged:
        raise InputError(f"{name}: got {ragged}, expected an array of numbers") from None
    if got.size and got.dtype.kind not in "fiu":
        raise InputError(f"{name}: got values of type {got.dtype}, expected real numbers")
    return got.astype(np.float64, copy=False)
