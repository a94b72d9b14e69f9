"""Tells whether a closed curve of Bezier segments crosses itself.

Theory of operation. Pairs of arcs are cut in halves until each is decided:
    apart     if their control points are on different sides of a line: of one that is upright or
              level, or of one along the chord of either;
    crossing  if each passes the strip about the other's control points, from beyond one side of it
              to beyond the other: then they meet within the parallelogram that the strips share;
    simple    (of an arc and the one after it, or of an arc alone) if all steps between control
              points lead onward in one common direction: then the arcs follow each other.
Pairs of boxes in a tree over the curve lead to the pairs of segments to begin with.

Says, in double precision, whether two parts of the curve cross, touch, or come so close that arcs
of RESOLUTION, in units of the extent of the curve, are not apart. What happens within such an arc,
or where one follows another, is not seen: cusps, and loops of that size.

Cost. Expected O(n log n) for n segments of a curve that is not crowded: about 4 us a segment.
Deepest pairs first, so a crossing ends the search and few pairs are held.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    Arcs = NDArray[np.float64]  # (m, degree + 1, 2)

RESOLUTION = 2.0**-46  # well above the rounding of control points of arcs, well below what matters
CHUNK = 1 << 12  # pairs looked at together


def crosses(control: Arcs) -> bool:
    """Tell whether the closed curve of these segments, (n, degree + 1, 2), meets itself."""
    while 0 < len(control) < 3:  # so that two segments share one end at most
        control = np.concatenate(halves(control))
        control = control.reshape(2, -1, *control.shape[1:]).swapaxes(0, 1).reshape(control.shape)
    n = len(control)
    if n == 0:
        return False
    control = control - control[0, 0]
    finest = RESOLUTION * float(np.abs(control).max())
    if _any_meet(*_within(control, finest), finest, are_adjacent=True):
        return True
    if _any_meet(control, np.roll(control, -1, axis=0), finest, are_adjacent=True):
        return True
    for i, j in _overlapping(control.min(axis=1), control.max(axis=1)):
        distance = np.abs(i - j)
        apart = (distance > 1) & (distance < n - 1)
        if _any_meet(control[i[apart]], control[j[apart]], finest, are_adjacent=False):
            return True
    return False


def halves(arcs: Arcs) -> tuple[Arcs, Arcs]:
    """Cut arcs in their middles, by de Casteljau's construction."""
    first, second, row = [], [], arcs
    while row.shape[1]:
        first.append(row[:, 0])
        second.append(row[:, -1])
        row = (row[:, :-1] + row[:, 1:]) / 2
    return np.stack(first, axis=1), np.stack(second[::-1], axis=1)


def _any_meet(a: Arcs, b: Arcs, finest: float, *, are_adjacent: bool) -> bool:
    """Tell whether any arc a meets its arc b, which begins where a ends if they are adjacent."""
    todo = [(a, b, np.full(len(a), are_adjacent))]
    while todo:
        a, b, adjacent = todo.pop()
        if len(a) > CHUNK:
            todo.append((a[CHUNK:], b[CHUNK:], adjacent[CHUNK:]))
            a, b, adjacent = a[:CHUNK], b[:CHUNK], adjacent[:CHUNK]
        steps = np.concatenate([np.diff(a, axis=1), np.diff(b, axis=1)], axis=1)
        decided = np.where(adjacent, _lead_onward(steps, b[:, -1] - a[:, 0]), _are_apart(a, b))
        a, b, adjacent = a[~decided], b[~decided], adjacent[~decided]
        if _pass_each_other(a[~adjacent], b[~adjacent]).any():
            return True
        small = _are_small(a, finest) & _are_small(b, finest)
        if (small & ~adjacent).any():
            return True
        a, b, adjacent = a[~small], b[~small], adjacent[~small]
        if len(a):
            (a0, a1), (b0, b1) = halves(a), halves(b)
            apart = np.zeros(len(a), bool)
            pairs = [(a0, b0, apart), (a0, b1, apart), (a1, b1, apart), (a1, b0, adjacent)]
            first, second, flags = zip(*pairs, strict=True)
            todo.append((np.concatenate(first), np.concatenate(second), np.concatenate(flags)))
    return False


def _within(arcs: Arcs, finest: float) -> tuple[Arcs, Arcs]:
    """Cut arcs until each is simple; return the pairs of halves at the cuts."""
    firsts, seconds = [arcs[:0]], [arcs[:0]]
    while len(arcs):
        is_simple = _lead_onward(np.diff(arcs, axis=1), arcs[:, -1] - arcs[:, 0])
        first, second = halves(arcs[~is_simple & ~_are_small(arcs, finest)])
        firsts.append(first)
        seconds.append(second)
        arcs = np.concatenate([first, second])
    return np.concatenate(firsts), np.concatenate(seconds)


def _lead_onward(steps: Arcs, direction: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell of each row whether all its steps lead forward in its direction, none back or aside."""
    forward = steps[..., 0] * direction[:, None, 0] + steps[..., 1] * direction[:, None, 1]
    stays = (steps == 0).all(axis=2)
    is_simple: NDArray[np.bool_] = ((forward > 0) | stays).all(axis=1) & ~stays.all(axis=1)
    return is_simple


def _are_small(arcs: Arcs, finest: float) -> NDArray[np.bool_]:
    small: NDArray[np.bool_] = (np.ptp(arcs, axis=1) <= finest).all(axis=1)
    return small


def _are_apart(a: Arcs, b: Arcs) -> NDArray[np.bool_]:
    apart: NDArray[np.bool_] = (
        (a.min(axis=1) > b.max(axis=1)) | (b.min(axis=1) > a.max(axis=1))
    ).any(axis=1)
    for one, other in ((a, b), (b, a)):
        low, high, at = _strip(one, other)
        apart |= (at > high[:, None]).all(axis=1) | (at < low[:, None]).all(axis=1)
    return apart


def _pass_each_other(a: Arcs, b: Arcs) -> NDArray[np.bool_]:
    passes = np.ones(len(a), bool)
    for one, other in ((a, b), (b, a)):
        low, high, at = _strip(one, other)
        start, stop = at[:, 0], at[:, -1]
        passes &= ((start < low) & (stop > high)) | ((start > high) & (stop < low))
    return passes


def _strip(
    one: Arcs, other: Arcs
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the strip about an arc along its chord, and where the other arc lies across it."""
    chord = one[:, -1] - one[:, 0]

    def across(points: Arcs) -> NDArray[np.float64]:
        step = points - one[:, :1]
        sides: NDArray[np.float64] = step[..., 1] * chord[:, :1] - step[..., 0] * chord[:, 1:]
        return sides

    own = across(one)
    return own.min(axis=1), own.max(axis=1), across(other)


def _overlapping(
    low: NDArray[np.float64], high: NDArray[np.float64]
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Yield pairs i < j of boxes that overlap, in chunks."""
    size = 1 << (len(low) - 1).bit_length()
    empty = np.full((size - len(low), 2), np.inf)
    levels = [(np.concatenate([low, empty]), np.concatenate([high, -empty]))]
    while len(levels[-1][0]) > 1:
        low, high = levels[-1]
        levels.append((np.minimum(low[::2], low[1::2]), np.maximum(high[::2], high[1::2])))
    todo = [(len(levels) - 1, np.zeros(1, np.int64), np.zeros(1, np.int64))]
    while todo:
        level, i, j = todo.pop()
        if len(i) > CHUNK:
            todo.append((level, i[CHUNK:], j[CHUNK:]))
            i, j = i[:CHUNK], j[:CHUNK]
        low, high = levels[level]
        overlap = ((low[i] <= high[j]) & (low[j] <= high[i])).all(axis=1)
        i, j = i[overlap], j[overlap]
        if level == 0:
            yield i[i < j], j[i < j]
        elif len(i):
            apart = i < j
            firsts = [2 * i, 2 * i + 1, 2 * i, 2 * i[apart] + 1]
            seconds = [2 * j, 2 * j + 1, 2 * j + 1, 2 * j[apart]]
            todo.append((level - 1, np.concatenate(firsts), np.concatenate(seconds)))
