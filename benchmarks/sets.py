"""Seeded point sets, float64 (n, 2): the same on every machine and in every run.

    uniform      in the unit square
    curve        in order along r = 1 + 0.3 sin 9t + 0.05 sin 53t, one point at random in each of
                 n equal cells of t (equal steps would be symmetric, full of cocircular points)
    noisy_curve  the same, each point moved by normal noise of one spacing: no order is left
    coast        in order along a hexagon whose longest edges are broken again and again, each by
                 up to a fraction of its length to either side
    grid         a square lattice: every two neighbouring triangles are cocircular
    maze         in order along a simple polygon through a jittered grid, the outline of a random
                 spanning tree: as crooked as a polygon through so many points can be

`grid` and `maze` round n to what makes a square.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Points = NDArray[np.float64]

JITTER = 0.2  # of a grid step; edges of the maze stay half a step apart


def shuffled(points: Points, seed: int = 0) -> Points:
    """Return the points in random order."""
    return np.random.default_rng(seed).permutation(points)


def uniform(n: int, seed: int = 1) -> Points:
    """Return n points of the unit square."""
    return np.random.default_rng(seed).random((n, 2))


def curve(n: int, seed: int = 2) -> Points:
    """Return n points in order along a wavy closed curve."""
    t = (np.arange(n) + np.random.default_rng(seed).random(n)) * (2 * np.pi / n)
    radius = 1 + 0.3 * np.sin(9 * t) + 0.05 * np.sin(53 * t)
    return np.column_stack((radius * np.cos(t), radius * np.sin(t)))


def noisy_curve(n: int, seed: int = 3) -> Points:
    """Return the curve with normal noise; its deviation is the mean distance of neighbours."""
    clean = curve(n, seed)
    step = np.roll(clean, -1, axis=0) - clean
    spacing = float(np.hypot(step[:, 0], step[:, 1]).mean())
    return clean + np.random.default_rng(seed).normal(0, spacing, clean.shape)


def coast(n: int, seed: int = 5, rough: float = 1.1) -> Points:
    """Return n points in order along a line as crooked on every scale, its edges about as long."""
    rng = np.random.default_rng(seed)
    t = np.arange(6) * (np.pi / 3)
    line = np.column_stack((np.cos(t), np.sin(t)))
    while len(line) < n:
        step = np.roll(line, -1, axis=0) - line
        longest = np.argsort(-np.hypot(step[:, 0], step[:, 1]), kind="stable")
        breaking = np.sort(longest[: min(len(line) // 3 + 1, n - len(line))])
        aside = rough * rng.uniform(-0.5, 0.5, (len(breaking), 1))
        across = np.column_stack((-step[breaking, 1], step[breaking, 0]))
        line = np.insert(
            line, breaking + 1, line[breaking] + step[breaking] / 2 + aside * across, 0
        )
    return line


def grid(n: int) -> Points:
    """Return about n points with integer coordinates, row by row."""
    side = np.arange(round(n**0.5), dtype=np.float64)
    return np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)


def maze(n: int, seed: int = 4) -> Points:
    """Return about n points in order along a simple polygon, counter-clockwise.

    Each cell of a k by k grid but the first opens to the cell west or south of it: a spanning
    tree. Its outline visits the four corners of every cell, and from one to the next it goes
    round the cell, unless that is where the cell is open; then it crosses into the neighbour.

        3 <- 2 <- 3 <- 2       corners of a cell are numbered counter-clockwise; the step from
        |              ^       corner c leads to c + 1 of the same cell or, if side c is open,
        v              |       to c - 1 of the cell beyond (sides: south, east, north, west);
        0 -> 1 -> 0 -> 1       here side 1 of one cell and so side 3 of the other
    """
    k = max(2, round((n / 4) ** 0.5))
    rng = np.random.default_rng(seed)
    column, row = np.meshgrid(np.arange(k), np.arange(k), indexing="ij")
    west = np.where(row == 0, column > 0, (column > 0) & (rng.random((k, k)) < 0.5))
    south = (row > 0) & ~west
    east, north = np.zeros((2, k, k), bool)
    east[:-1], north[:, :-1] = west[1:], south[:, 1:]
    cell = column * k + row
    beyond = np.stack((cell - 1, cell + k, cell + 1, cell - k), axis=-1)
    corner = np.broadcast_to(np.arange(4), beyond.shape)
    is_open = np.stack((south, east, north, west), axis=-1)
    follows = np.where(
        is_open, 4 * beyond + (corner - 1) % 4, 4 * cell[..., np.newaxis] + (corner + 1) % 4
    )
    following = follows.ravel().tolist()
    tour, at = [], 0
    for _ in following:
        tour.append(at)
        at = following[at]
    place, corner_at = np.divmod(np.array(tour), 4)
    x, y = np.divmod(place, k)
    fine = np.column_stack((2 * x + np.isin(corner_at, (1, 2)), 2 * y + (corner_at >= 2)))
    return fine + rng.uniform(-JITTER, JITTER, fine.shape)
