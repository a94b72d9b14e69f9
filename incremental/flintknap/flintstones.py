"""What trees over the boundary return: approximations, and areas that hold the boundary.

Both belong to a cut through a tree (section 4.1): all its edges of one level, or those that were
not worth splitting because they keep a tolerance. An edge stands for a polyline, the stretch of the
boundary from its one end to the other. On a level, row k of the one and of the other are about the
same edge. Within a tolerance, approximations have a tree of their own, split where the boundary
strays farthest, which needs fewer vertices, but whose polylines have no Flintstones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from flintknap import inputs

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.typing import ColorType
    from numpy.typing import ArrayLike, DTypeLike, NDArray

    Doubles = NDArray[np.float64]

_UNIT = 2.0**-53  # of rounding
_LARGEST = np.finfo(np.float64).max


@dataclass(frozen=True, eq=False)
class Approximation:
    """A closed polygon through some vertices of the boundary (section 4.1).

    Arrays are read-only. Vertices run counter-clockwise along the boundary from the
    lexicographically smallest of them; edge k goes from vertex k to the next, the last to the
    first. Level 0 has two vertices and two edges. Edges may cross each other. Empty if the object
    is degenerate.

    Attributes:
        ids: int64 (n,), the vertices.
        xy: float64 (n, 2), their coordinates, in the unit of the input.
        error: float64 (n,), for each edge the largest distance of the boundary between its ends
            from it, rounded up: no smaller double bounds it. Distances below 1e-70 but not 0
            count as 1e-70.
        level: the deepest level of which it has a vertex, in its tree.
    """

    ids: NDArray[np.int64]
    xy: Doubles
    error: Doubles
    level: int

    def __len__(self) -> int:
        return len(self.ids)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(self.xy, dtype=dtype, copy=copy)

    def plot(
        self, ax: Axes | None = None, *, color: ColorType | None = None, label: str | None = None
    ) -> Axes:
        """Draw edges and vertices on axes, as Boundary.plot does. O(n)."""
        from flintknap import picture, plot

        return plot.plot(ax, picture.approximation(self.xy), color, label)

    @property
    def largest_error(self) -> float:
        """How far the boundary strays from the approximation at most. O(n)."""
        return float(self.error.max(initial=0.0))


@dataclass(frozen=True, eq=False)
class Flintstones:
    """Areas that hold the boundary, one for each edge of a cut (section 4.1).

    Arrays are read-only. A Flintstone is what two discs through the ends of a chord have in common;
    [k, 0] is about the disc that bounds it on the left of chord k, [k, 1] about that on the right.
    A side without vertices is bounded by the chord's line, so there is a half-plane in place of
    the disc. Every number is rounded outward: each area holds its stretch of the boundary, exactly.

    Attributes:
        start: int64 (m,), the ids at the beginnings of the chords.
        stop: int64 (m,), those at their ends.
        chord: float64 (m, 2, 2), the coordinates of both.
        offset: float64 (m, 2), how far left of the chord's middle the centres lie; on the left
            -inf, on the right +inf stands for the half-plane.
        center: float64 (m, 2, 2), the centres; nan for a half-plane, and beyond all doubles.
        radius: float64 (m, 2), of the discs about these very centres; inf where there is none.
    """

    start: NDArray[np.int64]
    stop: NDArray[np.int64]
    chord: Doubles
    offset: Doubles
    center: Doubles
    radius: Doubles

    def __len__(self) -> int:
        return len(self.start)

    @overload
    def contains(self, x: float, y: float) -> NDArray[np.bool_]: ...
    @overload
    def contains(self, x: ArrayLike, y: ArrayLike | None = None) -> NDArray[np.bool_]: ...
    def contains(self, x: ArrayLike, y: ArrayLike | None = None) -> NDArray[np.bool_]:
        """Tell which Flintstones hold which places: bool, of their common shape and (m,) behind it.

        Numbers or arrays, as in Engine.insert. Rounded outward: a place that is in a Flintstone is
        never said not to be, one that is not may be said to be if it is a few last bits away.
        O(m) a place.

        Raises InputError naming the first row at fault.
        """
        xs, ys = inputs.pairs(x, y)
        w = np.stack([xs, ys], axis=-1)[..., np.newaxis, :]
        p, s = self.chord[:, 0], self.chord[:, 1]
        c, d, e = s - p, w - p, w - s
        cross = c[:, 0] * d[..., 1] - c[:, 1] * d[..., 0]
        dot = (d * e).sum(axis=-1)
        # Seen from a place on the rim, chords have the cotangent dot / |cross|.
        half = np.hypot(c[:, 0], c[:, 1]) / 2
        with np.errstate(over="ignore"):
            seen = self.offset / half[:, np.newaxis] * [1, -1]
        reach, away = np.abs(d).sum(axis=-1), np.abs(e).sum(axis=-1)
        unsure = 16 * _UNIT * np.abs(c).sum(axis=-1) * reach  # of cross
        slack = 16 * _UNIT * reach * away  # of dot
        inside: NDArray[np.bool_] = (np.abs(cross) <= unsure) & (dot <= slack)
        for side, sign in ((0, 1), (1, -1)):
            is_disc = np.isfinite(seen[:, side])
            cot = np.where(is_disc, seen[:, side], 0.0)
            height = np.maximum(sign * cross, 0.0)
            room = slack + np.abs(cot) * (unsure + 16 * _UNIT * height)
            inside |= is_disc & (sign * cross >= -unsure) & (dot <= cot * height + room)
        return inside

    def plot(
        self, ax: Axes | None = None, *, color: ColorType | None = None, label: str | None = None
    ) -> Axes:
        """Draw the areas on axes, as Boundary.plot does. O(m)."""
        from flintknap import picture, plot

        return plot.plot(ax, [picture.Mark("stones", picture.Lenses(self))], color, label)


def flintstones(ids: NDArray[np.int64], chord: Doubles, seen: Doubles) -> Flintstones:
    """Return Flintstones from (m, 2) ids, (m, 2, 2) ends, and the smallest angles.

    `seen` is float64 (m, 2): the cotangents of the smallest angles under which the chord is seen
    from its left and from its right, correctly rounded; -inf if from nowhere.
    """
    p, s = chord[:, 0], chord[:, 1]
    c = s - p
    outward = np.array([1.0, -1.0])  # left and right
    is_disc = np.isfinite(seen)
    with np.errstate(all="ignore"):  # what overflows is caught below
        offset = np.hypot(c[:, 0], c[:, 1])[:, np.newaxis] / 2 * seen * outward
        offset += 16 * _UNIT * np.abs(offset) * outward
        offset = np.where(is_disc, np.clip(offset, -_LARGEST, _LARGEST), -np.inf * outward)
        shift = seen * outward / 2
        normal = np.stack([-c[:, 1], c[:, 0]], axis=-1)
        center = ((p / 2 + s / 2) + shift.T[..., np.newaxis] * normal).transpose(1, 0, 2)
        size = np.abs(shift) * np.abs(c).sum(axis=-1)[:, np.newaxis]
        blur = 32 * _UNIT * (size + np.abs(chord).sum(axis=(1, 2))[:, np.newaxis])
        to_ends = np.hypot(*np.moveaxis(center[:, :, np.newaxis] - chord[:, np.newaxis], -1, 0))
        radius = to_ends.max(axis=-1) * (1 + 32 * _UNIT) + blur
    is_disc &= np.isfinite(radius)
    radius = np.where(is_disc, radius, np.inf)
    center = np.where(is_disc[..., np.newaxis], center, np.nan)
    arrays = (ids[:, 0].copy(), ids[:, 1].copy(), chord, offset, center, radius)
    for array in arrays:
        array.flags.writeable = False
    return Flintstones(*arrays)
