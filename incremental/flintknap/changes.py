"""What has changed on a boundary since somebody looked: all that a follower needs to be told.

Theory of operation. Most of a ring is as it was. The rest are runs: from vertex `after` on to
vertex `before`, which are both as they were but for the sides that lead into the run, there now
stand the vertices of the run, and what stood behind `after` is gone, or in another run:

    then    ... o - after - p - q - before - o ...
    now     ... o - after - x - y - z - before - o ...      Run(after, before, [x, y, z], xy)

So a follower that knows of each vertex the next one links `after`, the vertices and `before`, run
by run, drops what has `left`, and has the ring. `Changes.apply` does the same to arrays. Where
stretches between runs come in another order than before, that is in the runs, too.

A point that moved is told as a run, with its new place. Nothing is told twice, nothing that has
come and gone again in between; what is told is a function of the two boundaries, and of who moved.

Cost: what has changed, kernel/notes.hpp.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from flintknap.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import ArrayLike, NDArray


class Run(NamedTuple):
    """Vertices that now stand on the boundary from ``after`` to ``before``, these not included.

    ``ids``, int64 (m,), and ``xy``, float64 (m, 2), may be empty: then ``before`` comes next.
    """

    after: int
    before: int
    ids: NDArray[np.int64]
    xy: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Changes:
    """How the boundary has changed since an earlier revision. Iterate over it for its runs.

    Of length 0, and false, if nothing has changed. Arrays are read-only.

    Attributes:
        revision: the one to ask next time with: that of the engine when it was asked.
        whole: whether this tells the boundary as a whole, whatever it was: forget that, then. Its
            one run is all of the ring, from -1 to -1, which may be empty.
        first: the vertex with which Engine.boundary begins; -1 if there is none.
        left: int64 (l,), ascending: those that were on the ring and are not; removed, or inside.
            Empty if ``whole``.
        joined: int64 (j,), along the ring: those that are and were not.
        after: int64 (k,), where each run begins; runs are in order along the ring.
        before: int64 (k,), and where it ends.
        stops: int64 (k + 1,): run i has rows stops[i] to stops[i + 1] of the following two.
        ids: int64 (m,), the vertices of all runs.
        xy: float64 (m, 2), their coordinates.

    """

    revision: int
    whole: bool
    first: int
    left: NDArray[np.int64]
    joined: NDArray[np.int64]
    after: NDArray[np.int64]
    before: NDArray[np.int64]
    stops: NDArray[np.int64]
    ids: NDArray[np.int64]
    xy: NDArray[np.float64]

    def __post_init__(self) -> None:
        for array in (self.left, self.joined, self.after, self.before, self.stops):
            array.flags.writeable = False
        self.ids.flags.writeable = self.xy.flags.writeable = False

    def __len__(self) -> int:
        return len(self.after)

    def __iter__(self) -> Iterator[Run]:
        ends = zip(self.after.tolist(), self.before.tolist(), strict=True)
        for i, (after, before) in enumerate(ends):
            rows = slice(self.stops[i], self.stops[i + 1])
            yield Run(after, before, self.ids[rows], self.xy[rows])

    def apply(self, ids: ArrayLike, xy: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return ids, (n,), and coordinates, (n, 2), of the ring, made of those that there were.

        They are those of Engine.boundary, row by row, if ``ids`` and ``xy`` were. O(n log n).

        Raises InputError for a ring on which the runs do not fit.
        """
        if self.whole:
            return self.ids, self.xy
        old_ids, old_xy = np.asarray(ids, np.int64), np.asarray(xy, np.float64)
        if len(self) == 0:
            return old_ids, old_xy
        ends, begins = self._find(old_ids, self.after), self._find(old_ids, self.before)
        # From the end of a run the ring goes on as it was, up to the next vertex that ends it.
        n, run_at, sorted_ends = (
            len(old_ids),
            {int(end): i for i, end in enumerate(ends)},
            np.sort(ends),
        )
        rows: list[NDArray[np.int64]] = []
        run, seen = 0, 0
        while seen == 0 or run != 0:
            begin = int(begins[run])
            end = int(sorted_ends[np.searchsorted(sorted_ends, begin) % len(self)])
            rows.append(np.arange(n + self.stops[run], n + self.stops[run + 1]))
            rows.append(np.arange(begin, begin + (end - begin) % n + 1) % n)
            run, seen = run_at[end], seen + 1
            if seen > len(self):
                raise self._misfit()
        if seen < len(self):
            raise self._misfit()
        kept = np.concatenate(rows)
        new_ids = np.concatenate([old_ids, self.ids])[kept]
        kept = np.roll(kept, -int(np.argmax(new_ids == self.first)))
        return np.concatenate([old_ids, self.ids])[kept], np.concatenate([old_xy, self.xy])[kept]

    def to_json(self) -> bytes:
        """Return a message to send on: an object with these attributes, runs in a list of objects.

        ``{"revision":9,"whole":false,"first":4,"left":[2],"joined":[8],"runs":[{"after":1,
        "before":3,"ids":[8],"xy":[[0.5,2.0]]}]}``. Numbers read back bit for bit.
        """
        import msgspec

        runs = [
            {
                "after": run.after,
                "before": run.before,
                "ids": run.ids.tolist(),
                "xy": run.xy.tolist(),
            }
            for run in self
        ]
        message = {"revision": self.revision, "whole": self.whole, "first": self.first}
        lists = {"left": self.left.tolist(), "joined": self.joined.tolist(), "runs": runs}
        return msgspec.json.encode({**message, **lists})

    def _find(self, ids: NDArray[np.int64], wanted: NDArray[np.int64]) -> NDArray[np.int64]:
        order = np.argsort(ids)
        places = np.searchsorted(ids, wanted, sorter=order)
        if len(ids) == 0 or places.max() == len(ids) or (ids[order[places]] != wanted).any():
            raise self._misfit()
        found: NDArray[np.int64] = order[places]
        return found

    def _misfit(self) -> InputError:
        return InputError(
            "ids: got a ring on which these changes do not fit, expected that of the revision "
            "they were asked for"
        )
