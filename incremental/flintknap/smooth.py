"""A smooth curve through the vertices of a closed polygon: one Bezier segment a side (section 5).

Theory of operation. Each vertex gets a tangent, a weighted sum of the two sides that meet there.
The cubic along a side has its inner control points a third of the way to where its far ends project
on the tangents. It is G1, without corner or cusp, iff at each vertex both sides lead forward along
the tangent; where the weights do not see to that, the tangent is turned towards the one that
bisects the turn, which always does (`docs/theory.md`, section 6; kernel/smooth.hpp). The signs are
exact. Control points are rounded to doubles, so handles shorter than their last bit vanish.

A tangent depends on three vertices, a segment on four: where the polygon did not change, the curve
did not either, bit for bit, and is copied from the one before.

Cost. O(n) for n vertices: about 0.07 us each; 0.015 us where they are copied.

Refuses names it does not know (InputError), and of degree 2 polygons that have no such curve.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import comb
from typing import TYPE_CHECKING, Literal, TypeVar

import numpy as np

from flintknap import _kernel
from flintknap.crossing import crosses, halves
from flintknap.errors import InputError
from flintknap.geometry import Polygonal

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.typing import ColorType
    from numpy.typing import NDArray
    from scipy.interpolate import BPoly

Weights = Literal["length", "uniform", "inverse"]
T = TypeVar("T", bound=np.generic)

WEIGHTS: dict[str, _kernel.Weights] = {
    "length": _kernel.Weights.length,
    "uniform": _kernel.Weights.uniform,
    "inverse": _kernel.Weights.inverse,
}
ADJUSTED, CUSP = 1, 2  # kinds of tangents
NAMED = 10  # sides that an error names
MOST = 1 << 31  # points of a flattening
ROUNDING = 2.0**-47  # of evaluating a segment, a generous bound, in units of the largest coordinate
SLACK = 1 + 2.0**-40  # of evaluating a bound
NODES = 16  # of Gauss and Legendre's quadrature, for arc length
LENGTH_ROUNDS = 60


@dataclass(frozen=True, eq=False)
class BezierCurve:
    """A closed curve through the vertices of a polygon, smooth at each (section 5.1).

    Arrays are read-only. Segment i leads from vertex i to the next one, the last to the first;
    vertices run as in the polygon.

    Attributes:
        ids: int64 (n,), the vertices.
        control: float64 (n, degree + 1, 2), the control points of each segment.
        tangents: float64 (n, 2), directions in which the curve passes the vertices, of unit length.
            (Of a length between 1 and 2 where a needle needs a direction that no vector of
            unit length has in doubles.)
        kinds: uint8 (n,), of each tangent: 0 as weighted, 1 adjusted, 2 a cusp.

    """

    ids: NDArray[np.int64]
    control: NDArray[np.float64]
    tangents: NDArray[np.float64]
    kinds: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.ids)

    @property
    def degree(self) -> int:
        """3, or 2."""
        points: int = self.control.shape[1]
        return points - 1

    @cached_property
    def adjusted(self) -> NDArray[np.int64]:
        """The vertices where the weights would give a cusp, so that the tangent was turned.

        Towards the uniform one: to the middle between that and the first direction that does not
        give a cusp. O(n) once.
        """
        return _read_only(self.ids[self.kinds == ADJUSTED])

    @cached_property
    def cusps(self) -> NDArray[np.int64]:
        """The vertices that are cusps nevertheless; nearly always none. O(n) once.

        Their sides fold back so closely that no two doubles are a direction in which both lead
        forward. It takes less than 1e-15 radians.
        """
        return _read_only(self.ids[self.kinds == CUSP])

    @cached_property
    def area(self) -> float:
        """Area enclosed, in square units, by a closed form. O(n) once."""
        if len(self) == 0:
            return 0.0
        d = self.control[:, 1:] - self.control[:, :1]

        def cross(i: int, j: int) -> NDArray[np.float64]:
            product: NDArray[np.float64] = d[:, i, 0] * d[:, j, 1] - d[:, i, 1] * d[:, j, 0]
            return product

        if self.degree == 2:
            beyond = cross(0, 1) / 3
        else:
            beyond = (3 * cross(0, 1) + 3 * cross(0, 2) + 6 * cross(1, 2)) / 20
        return _Vertices(self.control[:, 0]).area + float(np.sum(beyond))

    @cached_property
    def length(self) -> float:
        """Length of the curve, in units, to about 12 digits. O(n) once.

        By quadrature; segments on which two estimates differ are cut in halves.
        """
        total, (step, width) = 0.0, (self.degree * np.diff(self.control, axis=1), 1.0)
        for _ in range(LENGTH_ROUNDS):
            if len(step) == 0:
                break
            first, second = halves(step)
            whole = _arc_lengths(step) * width
            parts = (_arc_lengths(first) + _arc_lengths(second)) * (width / 2)
            done = np.abs(whole - parts) <= 1e-13 * np.maximum(parts, total / len(self))
            total += float(np.sum(parts[done]))
            step = np.concatenate([first[~done], second[~done]])
            width /= 2
        return total

    @cached_property
    def crosses_itself(self) -> bool:
        """Whether parts of the curve cross or touch, or come too close to tell in doubles.

        The polygon does not, but its curve may, where narrow parts have few vertices; more
        vertices help. O(n log n) expected, once.
        """
        return crosses(self.control)

    def sample(self, per_segment: int) -> NDArray[np.float64]:
        """Return points of the curve, float64 (n * per_segment, 2), the vertices among them.

        Those of each segment are evenly spread in its parameter, beginning at its vertex.
        O(n * per_segment). Raises InputError for a ``per_segment`` below 1.
        """
        return self._spread(self.control, per_segment)

    def derivative(self, per_segment: int) -> NDArray[np.float64]:
        """Return derivatives by the parameter at the points of sample(), in the same shape.

        The parameter goes from 0 to 1 on each segment. Cost and errors as of sample.
        """
        return self._spread(self.degree * np.diff(self.control, axis=1), per_segment)

    def flatten(self, tolerance: float) -> Flattening:
        """Return a polygon through points of the curve from which it is no farther than this.

        ``tolerance`` is a distance, in the unit of the coordinates. O(n + points).

        Raises InputError if it is less than rounding allows, or would take too many points.
        """
        c, d = self.control, self.degree
        rounding = ROUNDING * float(np.abs(c).max(initial=0))
        if not tolerance > 2 * rounding:
            raise InputError(
                f"tolerance: got {tolerance!r}, expected more than {2 * rounding:.3g}, which is "
                "what coordinates of this size allow"
            )
        # A chord over 1/m of a segment is off by at most max |P''| / 8 m^2.
        bends = np.diff(c, 2, axis=1)
        bend = np.hypot(bends[..., 0], bends[..., 1]).max(axis=1, initial=0) * SLACK + rounding / 8
        off = d * (d - 1) / 8 * bend
        pieces = np.maximum(1, np.ceil(np.sqrt(off / (tolerance - rounding)) * SLACK))
        if pieces.sum() > MOST:
            raise InputError(
                f"tolerance: got {tolerance!r}, which takes {pieces.sum():.3g} points, expected "
                f"one that takes at most {MOST}"
            )
        count = pieces.astype(np.int64)
        segment = np.repeat(np.arange(len(self)), count)
        place = np.arange(len(segment)) - np.repeat(np.cumsum(count) - count, count)
        xy = _at(c[segment], place / pieces[segment])
        error = float((off / pieces**2).max(initial=0)) * SLACK + rounding
        return Flattening(_read_only(xy), error)

    def to_bpoly(self) -> BPoly:
        """Return the curve as a scipy.interpolate.BPoly: periodic, segment i on [i, i + 1].

        Raises ImportError where scipy is not installed, InputError for an empty curve.
        """
        from scipy.interpolate import BPoly

        if len(self) == 0:
            raise InputError("got an empty curve, expected one with segments")
        return BPoly(
            self.control.swapaxes(0, 1), np.arange(len(self) + 1.0), extrapolate="periodic"
        )

    def to_svg(self) -> str:
        """Return a picture, its curve made of the very segments (C or Q commands). O(n)."""
        from flintknap import svg

        return svg.curve(self.control)

    def plot(
        self, ax: Axes | None = None, *, color: ColorType | None = None, label: str | None = None
    ) -> Axes:
        """Draw the curve on axes, as Boundary.plot does. O(n).

        Its very segments: the curve is as smooth at any size.
        """
        from flintknap import picture, plot

        return plot.plot(ax, [picture.Mark("curve", picture.Curve(self.control))], color, label)

    def _spread(self, control: NDArray[np.float64], per_segment: int) -> NDArray[np.float64]:
        if per_segment < 1:
            raise InputError(f"per_segment: got {per_segment}, expected at least 1")
        t = np.arange(per_segment) / per_segment
        return _at(control[:, np.newaxis], t).reshape(-1, 2)


@dataclass(frozen=True, eq=False)
class Flattening(Polygonal):
    """A closed polygon with vertices on a curve. Area, length and formats: Polygonal.

    Attributes:
        xy: float64 (m, 2), read-only; the vertices that the curve interpolates are among them.
        error: no point of the curve is farther from its chord, and no point of a chord farther
            from the curve, rounding included.

    """

    xy: NDArray[np.float64]
    error: float


class _Vertices(Polygonal):
    def __init__(self, xy: NDArray[np.float64]) -> None:
        self.xy = xy


def curve(
    ids: NDArray[np.int64],
    xy: NDArray[np.float64],
    weights: Weights = "length",
    degree: Literal[2, 3] = 3,
    previous: BezierCurve | None = None,
) -> BezierCurve:
    """Return the curve through the vertices ``xy``, (n, 2), of a closed polygon. O(n).

    No vertex is repeated in a row; whether sides cross does not matter. See Engine.smooth.
    ``previous`` is a curve by the same weights: where the polygon is the same, a cubic is copied
    from it.
    """
    if weights not in WEIGHTS:
        raise InputError(f"weights: got {weights!r}, expected one of {', '.join(WEIGHTS)}")
    if degree not in (2, 3):
        raise InputError(f"degree: got {degree!r}, expected 2 or 3")
    n = len(ids)
    tangents, kinds = np.empty((n, 2)), np.empty((n, 1), np.uint8)
    control = np.empty((n, 2 * (degree + 1)))
    rows = np.ascontiguousarray(xy)
    if degree == 3:
        old = (tangents[:0], control[:0], kinds[:0])
        if previous is not None and previous.degree == degree:
            m = len(previous)
            rows_before = previous.control.reshape(m, 2 * (degree + 1))
            old = (previous.tangents, rows_before, previous.kinds.reshape(m, 1))
        _kernel.cubic(rows, WEIGHTS[weights], tangents, control, kinds, *old)
    else:
        refused = _kernel.quadratic(rows, WEIGHTS[weights], tangents, control, kinds)
        if len(refused):
            sides = [(int(ids[i]), int(ids[(i + 1) % n])) for i in refused[:NAMED].tolist()]
            more = f" and {len(refused) - NAMED} more" if len(refused) > NAMED else ""
            raise InputError(
                "degree: got 2, which needs the tangent lines at the ends of each side to meet "
                "ahead of the first and behind the second; they do not at the vertices "
                f"{', '.join(map(str, sides))}{more}; expected 3 for this polygon"
            )
    return BezierCurve(
        ids,
        _read_only(control.reshape(n, degree + 1, 2)),
        _read_only(tangents),
        _read_only(kinds[:, 0]),
    )


def _read_only(array: NDArray[T]) -> NDArray[T]:
    array.flags.writeable = False
    return array


def _at(control: NDArray[np.float64], t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Evaluate Bezier segments (..., degree + 1, 2) at parameters t of (...) that broadcast."""
    degree = control.shape[-2] - 1
    terms = (
        (comb(degree, j) * t**j * (1 - t) ** (degree - j))[..., np.newaxis] * control[..., j, :]
        for j in range(degree + 1)
    )
    total: NDArray[np.float64] = sum(terms, start=np.zeros(2))
    return total


def _arc_lengths(hodograph: NDArray[np.float64]) -> NDArray[np.float64]:
    """Integrate the length of the derivative, given by its control points (m, degree, 2)."""
    nodes, shares = np.polynomial.legendre.leggauss(NODES)  # on [-1, 1]
    d = _at(hodograph[:, np.newaxis], (1 + nodes) / 2)
    lengths: NDArray[np.float64] = (np.hypot(d[..., 0], d[..., 1]) * shares / 2).sum(axis=1)
    return lengths
