"""The engine: points go in, at any moment the object they bound comes out.

Theory of operation. An insert only records points; a query first brings the object up to date:
points that wait are placed in the Delaunay triangulation, and the constriction is repaired around
them. Every answer is a function of the current set of points, never of the order or the batches
in which they came, nor of what was asked before.

Cost. A recorded point: O(1). Bringing n points up to date: O(n log n) expected for many at once;
a few on top of many: what the change touches. Then each answer as stated.

Refuses coordinates that are not finite or beyond the admissible magnitudes (InputError, nothing of
the call applied). Knows no clock, thread, socket or file. Calls from several threads take turns;
different engines do not wait for each other, and long calls let other threads run.
"""

from __future__ import annotations

import hashlib
import os
from typing import TYPE_CHECKING, Literal, overload

import numpy as np

from flintknap import gamma, inputs, smooth
from flintknap._kernel import Kernel, quick
from flintknap.boundary import Boundary
from flintknap.changes import Changes
from flintknap.errors import InputError, InvariantError
from flintknap.flintstones import Approximation, Flintstones, flintstones
from flintknap.queries import Queries
from flintknap.widening import gamma_of, least_cotangent

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.typing import ColorType
    from numpy.typing import ArrayLike, NDArray

    from flintknap.boundary import Status
    from flintknap.smooth import BezierCurve, Weights

_LARGEST_ID = 2**63 - 1


class Engine(Queries):
    """A planar object, known by points on its boundary.

    Where constriction of the Delaunay triangulation would leave points inside, sides of the wider
    gamma-graph([-1, 1], [d_min, 1]) are used, those with small discs first (section 3.1). -1 sets
    no bound; 0 leaves the Delaunay triangulation as it is. Raises InputError for other values.

    >>> engine = Engine()
    >>> engine.insert([0.0, 4.0, 4.0, 0.0], [0.0, 0.0, 3.0, 3.0]).tolist()  # a rectangle
    [0, 1, 2, 3]
    >>> engine.insert(2.0, 1.0)  # a notch
    4
    >>> engine.boundary().ids.tolist()
    [0, 4, 1, 2, 3]
    >>> engine.side(2.0, 0.5), engine.distance(2.0, 0.0)
    (-1, 0.8944271909999159)
    """

    def __init__(self, d_min: float = -1.0) -> None:
        least = least_cotangent(d_min)
        self._kernel = Kernel(float(d_min), least)
        self._boundary: tuple[int, Boundary] | None = None
        self._smooth: tuple[tuple[int, str, int], BezierCurve] | None = None

    @property
    def d_min(self) -> float:
        """How far the gamma-graph may be widened (section 3.1)."""
        return self._kernel.d_min()

    # ------------------------------------------------------------------ points
    @overload
    def insert(self, x: float, y: float) -> int: ...
    @overload
    def insert(self, x: ArrayLike, y: ArrayLike | None = None) -> int | NDArray[np.int64]: ...
    @quick
    def insert(self, x: ArrayLike, y: ArrayLike | None = None) -> int | NDArray[np.int64]:
        """Add points and return their ids.

        ``x`` and ``y`` are two numbers, or arrays that broadcast, or ``x`` alone an (n, 2) array.
        Returns an int for two numbers, else int64 ids of the common shape, (n,) for (n, 2).
        Ids count up from 0 in order of arrival; a point that is there already keeps its id and
        gains multiplicity. O(1) expected a point.

        Raises InputError naming the first row at fault; then no point of the call was added.
        """
        xs, ys = inputs.pairs(x, y)
        ids = self._kernel.insert_many(xs.ravel(), ys.ravel())
        return int(ids[0]) if xs.ndim == 0 else ids.reshape(xs.shape)

    def remove(self, ids: ArrayLike) -> None:
        """Take points away: one id, or an array of them.

        Each takes one from the multiplicity of its point; the point leaves with the last one, and
        its id is never used again. O(1) expected a point in random order.

        Raises KeyError naming an id that is not there, or not that often; then nothing of the call
        was applied.
        """
        if isinstance(ids, int):
            if not 0 <= ids <= _LARGEST_ID or not self._kernel.remove(ids):
                raise KeyError(ids)
            return
        known = self._known(ids, "ids").ravel()
        points, times = np.unique(known, return_counts=True)
        too_often = times > self._kernel.multiplicity(points)
        if too_often.any():
            raise KeyError(int(points[np.argmax(too_often)]))
        self._kernel.remove_many(known)

    def move(self, point: int, x: float, y: float) -> int:
        """Move the point with an id to (x, y), as one change, and return the id there.

        It keeps its id if it was there once and nothing is at the new place; else one is taken from
        its multiplicity and one added there, as remove and insert would. O(1) expected.

        Raises KeyError for an unknown id and InputError for an inadmissible place; then nothing
        was applied.
        """
        xs, ys = inputs.scalar(x, "x"), inputs.scalar(y, "y")
        there = self._kernel.move(point, xs, ys) if 0 <= point <= _LARGEST_ID else -1
        if there < 0:
            raise KeyError(point)
        return there

    def clear(self) -> None:
        """Take all points away. Ids go on counting where they were. O(n)."""
        self._kernel.clear()

    @overload
    def find(self, x: float, y: float) -> int: ...
    @overload
    def find(self, x: ArrayLike, y: ArrayLike | None = None) -> int | NDArray[np.int64]: ...
    def find(self, x: ArrayLike, y: ArrayLike | None = None) -> int | NDArray[np.int64]:
        """Return the ids of the points at some places, -1 where there is none.

        Numbers or arrays, as in insert. O(1) expected a place.

        Raises InputError naming the first row at fault.
        """
        xs, ys = inputs.pairs(x, y)
        ids = self._kernel.find(xs.ravel(), ys.ravel())
        return int(ids[0]) if xs.ndim == 0 else ids.reshape(xs.shape)

    def __len__(self) -> int:
        """Return the number of distinct points."""
        return len(self._kernel)

    @property
    def revision(self) -> int:
        """How many changes the set of points has seen; equal revisions, equal answers."""
        return self._kernel.revision()

    def ids(self) -> NDArray[np.int64]:
        """Return the ids of all points, int64 (n,), ascending. O(n)."""
        return self._kernel.ids()

    def points(self, ids: ArrayLike | None = None) -> NDArray[np.float64]:
        """Return coordinates, float64 (n, 2), of all points in the order of ids(), or of ``ids``.

        Raises KeyError naming the first unknown id. O(n).
        """
        return self._kernel.points(self.ids() if ids is None else self._known(ids, "ids").ravel())

    def multiplicity(self, ids: ArrayLike) -> int | NDArray[np.int64]:
        """Return how often each point was inserted, in the shape of ``ids``. O(1) an id.

        Raises KeyError naming the first unknown id.
        """
        known = self._known(ids, "ids")
        counts = self._kernel.multiplicity(known.ravel())
        return int(counts[0]) if known.ndim == 0 else counts.reshape(known.shape)

    # ------------------------------------------------------------------ the object
    def boundary(self) -> Boundary:
        """Return the boundary polygon (section 3.1).

        O(n) for the first two; from then on what changes cost, and O(1) if there was none. Its
        arrays are made when they are asked for, O(n).
        """
        if self._boundary is None or self._boundary[0] != self.revision:
            revision = self.revision
            self._boundary = revision, self._make_boundary()
        return self._boundary[1]

    def changes(self, since: int | None = None) -> Changes:
        """Return how the boundary has changed since an earlier revision.

        For whoever follows it, and sends on or draws what is new: ask first without ``since``, for
        all of it, then with the ``revision`` of the answer before. What is told is all that has
        changed from then to now, however many changes of the set that took.

        All of it is told, too, if it is not known what it was at that revision: if nobody asked for
        the boundary then (through here, or boundary()), before anybody had begun to follow, or so
        long ago that a fair share has changed. Notes of the past take 8 bytes a point at most, and
        64 KB besides. O(k log n) for k vertices that left, joined or got others as
        neighbours; O(n) for all of it.

        Raises InputError for a ``since`` that is not one of the revisions so far.
        """
        asked = -1 if since is None else inputs.revision(since, self.revision)
        return Changes(*self._kernel.changes(asked))

    def smooth(
        self,
        *,
        level: int | None = None,
        tolerance: float | None = None,
        weights: Weights = "length",
        degree: Literal[2, 3] = 3,
    ) -> BezierCurve:
        """Return a smooth curve through the vertices of the boundary (section 5.1).

        With a ``level`` or a ``tolerance``: through those of that approximation.

        ``weights`` says how the sides at a vertex add up to its tangent: by "length", the longer
        counting for more; "uniform"; or by "inverse" length, the closer neighbour counting for
        more. ``degree`` 3 is G1 at every vertex. Degree 2 is the curve of parabolas that touch the
        tangents, which hardly any polygon has that is not convex: InputError names the vertices
        where there is none. Beyond boundary(): O(n) at first and for degree 2, else what changes
        cost; arrays are made when they are asked for.

        Raises InputError for other weights and degrees, and as approximate does.
        """
        if level is not None or tolerance is not None:
            cut = self.approximate(level=level, tolerance=tolerance)
            return smooth.curve(cut.ids, cut.xy, weights, degree)
        asked = self.revision, weights, degree
        if self._smooth is None or self._smooth[0] != asked:
            weighting, polygon = smooth.known(weights, degree), self.boundary()
            made = self._kernel.smooth(polygon._outline, weighting)
            self._smooth = asked, smooth.finished(polygon, made, degree)
        return self._smooth[1]

    # ------------------------------------------------------------------ approximations
    def approximate(
        self, *, level: int | None = None, tolerance: float | None = None
    ) -> Approximation:
        """Return a polygon through some vertices of the boundary (section 4.1).

        With a ``level``: the vertices of all levels of the tree of Flintstones down to it, so that
        each level has those of the level before; two on level 0, at most twice as many on the next.
        With a ``tolerance``: few vertices that keep it. From the vertices of level 0 on, an edge is
        split, where the boundary strays farthest from it, only while that is farther than the
        tolerance, in the unit of the input. So a smaller tolerance has the vertices of a larger.

        A degenerate object has no vertices. Either tree is refined as far as the answer needs,
        once: a search for each edge that is reached for the first time, at worst as long as the
        stretch of the boundary behind it; then O(1) an edge.

        Raises InputError unless one of the two is given, the level an integer, neither negative.
        """
        ids, xy, error, deepest = self._kernel.approximate(*inputs.cut(level, tolerance))
        for array in (ids, xy, error):
            array.flags.writeable = False
        return Approximation(ids, xy, error, deepest)

    def localize(self, *, level: int | None = None, tolerance: float | None = None) -> Flintstones:
        """Return Flintstones: areas that together hold the boundary (section 4.1).

        Arguments, errors and cost are those of approximate. With a ``level``, row k is about edge k
        of that approximation; with a ``tolerance``, the tree of Flintstones is cut where edges keep
        it, which takes more of them. The Flintstone of an edge of the boundary is the edge itself.
        """
        ids, ends, seen = self._kernel.localize(*inputs.cut(level, tolerance))
        return flintstones(ids, ends.reshape(-1, 2, 2), seen)

    def level_for(self, tolerance: float) -> int:
        """Return the first level of which approximate has no larger error than ``tolerance``.

        0 if the object is degenerate. The tree is refined down to that level.

        Raises InputError for a tolerance that is negative or no number.
        """
        return self._kernel.level_for(inputs.tolerance(tolerance))

    @property
    def levels(self) -> int:
        """The deepest level that queries have reached so far; 0 before any.

        Of the tree of Flintstones. Changes may take levels back. See level_for(0.0) for the depth
        of the whole tree.
        """
        return self._kernel.refined()[1]

    @property
    def refined(self) -> int:
        """How many nodes the trees have so far: the base, and one for each vertex below level 0.

        Nodes exist where a query has reached them; changes take away those that are no longer what
        they were. At most 2**(l + 1) - 1 down to level l, at most n - 1 in all, in the tree of
        Flintstones, whose levels these are, and as many in the one that tolerances ask for.
        """
        return self._kernel.refined()[0]

    # ------------------------------------------------------------------ the gamma-graph
    def edges(
        self,
        graph: gamma.Graph | None = None,
        *,
        gamma0: gamma.Interval | None = None,
        gamma1: gamma.Interval | None = None,
    ) -> NDArray[np.int64]:
        """Return the edges of any graph of the gamma-family (section 2.1).

        By name: "hull", "gabriel", "delaunay", ("beta_skeleton", beta) for the circle-based one of
        any beta > 0, "void", "complete". Or by closed intervals (low, high) within [-1, 1], each
        (-1, 1) if left out: an edge is a pair whose two values, as gamma() returns them, lie in
        them. Of points on one circle that has none inside, gamma1 >= 0 joins all to all;
        triangles() has those edges that the triangulation picks. A point between two others
        separates them in every graph.

        Rows of two ids, the smaller first, sorted: int64 (m, 2). O(n log n + m) if gamma1 >= 0 is
        asked for. If gamma1 may be d < 0, each point searches what the others do not hide from it:
        expected O(1) a point for fixed d on uniform points, but ever farther as d -> -1; in the
        worst case, all pairs are looked at, O(n^2) of them, each for as many triangles as lie
        between.

        Raises InputError for other names and intervals, for both and for neither.

        >>> engine = Engine()
        >>> ids = engine.insert([0.0, 4.0, 2.0], [0.0, 0.0, 1.0])  # obtuse at 2
        >>> engine.edges("gabriel").tolist(), len(engine.edges("delaunay"))
        ([[0, 2], [1, 2]], 3)
        """
        (low0, high0), (low1, high1) = gamma.intervals(graph, gamma0, gamma1)
        return self._kernel.edges(low0, high0, low1, high1)

    def gamma(
        self, a: ArrayLike, b: ArrayLike
    ) -> tuple[float, float] | tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return (gamma0, gamma1) of pairs of points (section 2.1).

        ``a`` and ``b`` are ids or arrays of ids that broadcast; floats for two ids, else float64 of
        the common shape. ``|gamma0| <= |gamma1|``, each in [-1, 1]; gamma1 >= 0 just for pairs that
        some disc with no point inside joins, 1 just for empty sides. A pair with a point between
        has no values: (nan, nan). O(degree of a) for an edge of the triangulation, else O(triangles
        between a and b).

        Raises KeyError naming an unknown id, InputError for a point paired with itself.
        """
        firsts, seconds = np.broadcast_arrays(self._known(a, "a"), self._known(b, "b"))
        same = (firsts == seconds).ravel()
        if same.any():
            row = int(np.argmax(same))
            twice = int(firsts.ravel()[row])
            raise InputError(
                f"row {row}: got {(twice, twice)}, expected two different points", row=row
            )
        values = self._kernel.gamma(firsts.ravel(), seconds.ravel())
        if firsts.ndim == 0:
            return float(values[0, 0]), float(values[0, 1])
        return values[:, 0].reshape(firsts.shape), values[:, 1].reshape(firsts.shape)

    def triangles(self) -> NDArray[np.int64]:
        """Return the canonical Delaunay triangulation as ids, int64 (m, 3).

        Each row runs counter-clockwise from its lexicographically smallest vertex; rows are
        sorted. Empty if all points lie on one line. O(n log n).
        """
        rows, ids, xy = self._kernel.triangles(), self.ids(), self.points()
        rank = np.empty(len(xy), np.int64)
        rank[np.lexsort((xy[:, 1], xy[:, 0]))] = np.arange(len(xy))
        corners = rank[np.searchsorted(ids, rows)]
        first = np.argmin(corners, axis=1) if len(rows) else np.zeros(0, np.int64)
        turned = (first[:, np.newaxis] + np.arange(3)) % 3
        rows = np.take_along_axis(rows, turned, axis=1)
        return rows[np.lexsort(rows.T[::-1])]

    # ------------------------------------------------------------------ pictures
    def plot(
        self,
        ax: Axes | None = None,
        *,
        layers: str | None = None,
        color: ColorType | None = None,
        label: str | None = None,
    ) -> Axes:
        """Draw layers of the object on axes of matplotlib, as Boundary.plot does.

        ``layers`` is a list such as "points,graph:gabriel,boundary,flintstones:4,smooth", later
        ones over earlier ones; `flintknap replay --help` has them all. If left out, the boundary,
        and the points where they are not crowded. Costs what these questions cost.

        Raises InputError for what is no list of layers, ImportError where matplotlib is not
        installed: `pip install 'flintknap[plot]'`.
        """
        from flintknap import picture, plot

        (group,) = picture.compose({"": self}, layers).groups
        return plot.plot(ax, group.marks, color, label)

    def to_svg(self, layers: str | None = None) -> str:
        """Return a picture of layers of the object, chosen as in plot, for light and dark pages."""
        from flintknap import svg

        return svg.draw({"object": self}, layers)

    # ------------------------------------------------------------------ verification
    def digest(self) -> str:
        """Return a fingerprint of the set of points and its boundary, 32 hex digits.

        The same for every history that ends in the same set, on every machine. O(n log n).
        """
        boundary, points = self.boundary(), self.points()
        points = points[np.lexsort((points[:, 1], points[:, 0]))]
        h = hashlib.blake2b(b"flintknap 1\0", digest_size=16)
        h.update(boundary.status.encode() + b"\0")
        h.update(boundary.xy.astype("<f8").tobytes())
        h.update(points.astype("<f8").tobytes())
        return h.hexdigest()

    def dump(self) -> NDArray[np.uint8]:
        """Return everything as bytes for restored(); save puts them into a file. O(n)."""
        return self._kernel.dump()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a snapshot, from which ``flintknap.load`` makes this engine again. O(n).

        A file that was there is replaced, once the new one is complete. Raises OSError where that
        fails.
        """
        from flintknap import snapshot  # files are its business, and nothing else here needs it

        snapshot.write(path, self.dump())

    @classmethod
    def restored(cls, dumped: NDArray[np.uint8]) -> Engine:
        """Return an engine that goes on where the dumped one was. ValueError if it cannot. O(n)."""
        engine = cls()
        engine._kernel.restore(dumped)
        return engine

    def check(self) -> None:
        """Verify every law and invariant; raise InvariantError with what was seen. O(n log n)."""
        broken = self._kernel.check()
        if broken:
            raise InvariantError(broken)

    # ------------------------------------------------------------------ behind the face
    def _make_boundary(self) -> Boundary:
        outline, inside, widened = self._kernel.outline()
        inside.flags.writeable = False
        status: Status = "closed"
        if len(outline) == 0:
            status = "degenerate"
        elif len(inside):
            status = "locked"
        return Boundary(status, inside, max(gamma_of(widened), self.d_min), outline)

    def _known(self, ids: ArrayLike, name: str) -> NDArray[np.int64]:
        return inputs.identifiers(ids, name, lambda i: self._kernel.multiplicity(i.ravel()) == 0)
