"""Animations: a replay in frames, all with the same view, in which objects grow.

The log is read twice. The first time nothing is replayed, only the box that will hold all points is
found, and how many events there are; so the object grows into a picture that stands still. What a
layer draws beyond all points, parts of large Flintstones, is cut off.

Cost: reading, and for each frame its picture (picture.py) and its drawing, some 50 ms. Frames of a
GIF are kept compressed until the end.

Refuses what log.py refuses; needs matplotlib.
"""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

import numpy as np

from flintknap import log, picture, plot
from flintknap.events import Insert, Move

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from flintknap.engine import Engine
    from flintknap.picture import Box

FRAMES = 100  # of an animation, about, if nobody says how many
SIZE = 800  # pixels of the longer side of frames


class Survey(NamedTuple):
    """What a replay will meet: the ``box`` of all its places, and how many ``events``."""

    box: Box
    events: int


def survey(
    path: str,
    *,
    until: float | None = None,
    object: str | None = None,  # noqa: A002 - its name in the log
    progress: Callable[[int], Any] = lambda _: None,
) -> Survey:
    """Look through the log at ``path`` for what replay() with the same arguments will meet."""
    low, high, count = np.full(2, np.inf), np.full(2, -np.inf), 0
    for block in log.read(path):
        met = [
            event
            for event in block.events
            if (object is None or event.object == object) and (until is None or event.t <= until)
        ]
        xy = np.array([(e.x, e.y) for e in met if isinstance(e, Insert | Move)])
        if len(xy):
            low, high = np.minimum(low, xy.min(axis=0)), np.maximum(high, xy.max(axis=0))
        count += len(met)
        progress(block.position)
    return Survey((low, high) if np.isfinite(low).all() else (np.zeros(2), np.zeros(2)), count)


class Camera:
    """Takes frames of a replay: into a folder, numbered from 000001 on, into a GIF, or both.

    One after ``every`` so many events of what was surveyed, or else about FRAMES of them; their
    ``layers`` as in picture.compose. ``seconds`` is what taking them has cost so far.
    """

    def __init__(
        self,
        ahead: Survey,
        every: int | None,
        layers: str | None,
        gif: BinaryIO | None,
        folder: Path | None,
    ) -> None:
        self.box, self.layers, self.gif, self.folder = ahead.box, layers, gif, folder
        self.every = every or max(1, round(ahead.events / FRAMES))
        self.frames = math.ceil(ahead.events / self.every)
        self.taken, self.seconds = 0, 0.0
        self.kept: list[bytes] = []

    def hooks(self, progress: Callable[[int], Any]) -> dict[str, Any]:
        """Return the arguments for replay() that make it call for frames."""

        def take(engines: Mapping[str, Engine]) -> None:
            self.take(engines)
            progress(self.taken)

        return {"every": self.every, "frame": take}

    def take(self, engines: Mapping[str, Engine]) -> None:
        """Take a frame of all objects as they are."""
        began = time.perf_counter()
        frame = plot.png(picture.compose(engines, self.layers, box=self.box), SIZE)
        self.taken += 1
        if self.folder is not None:
            (self.folder / f"{self.taken:06}.png").write_bytes(frame)
        if self.gif is not None:
            self.kept.append(frame)
        self.seconds += time.perf_counter() - began

    def finish(self, engines: Mapping[str, Engine]) -> None:
        """Write the GIF, if one is asked for; of a log without events, there is one frame."""
        if self.taken == 0:
            self.take(engines)
        if self.gif is not None:
            self.gif.write(plot.gif(self.kept))
            self.gif.flush()
