"""The gamma-graph on Delaunay edges (section 2.1).

Cost: that of the triangulation, O(n^2).
"""

from __future__ import annotations

import math
from collections import defaultdict
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from flintknap.reference.exact import Ids, Site, cotangent, dot, integers
from flintknap.reference.triangulation import triangulate


def edges(xy: ArrayLike, name: str) -> Ids:
    """Edges of a graph of the gamma-family: int64 (m, 2), a < b in each row, rows sorted.

    `name`: "delaunay"; "gabriel", where no angle facing the edge is obtuse; "hull", where one side
    is free of points. Points on a line are joined to their neighbours in all three. O(n^2).
    Section 2.1.

    Raises KeyError for any other name.
    """
    sites = integers(xy)
    facing = _facing(sites, triangulate(xy))
    graphs = {
        "delaunay": [edge for edge, _ in facing],
        "gabriel": [
            (a, b)
            for (a, b), corners in facing
            if all(dot(sites[a], sites[b], sites[c]) >= 0 for c in corners)
        ],
        "hull": [edge for edge, corners in facing if len(corners) < 2],
    }
    return np.array(graphs[name], np.int64).reshape(-1, 2)


def gamma(xy: ArrayLike, a: int, b: int) -> tuple[float, float]:
    """(gamma0, gamma1) of the Delaunay edge ab, the smaller magnitude first. O(n^2). Section 2.1.

    Raises KeyError if ab is no edge of the canonical triangulation.
    """
    sites = integers(xy)
    facing = dict(_facing(sites, triangulate(xy)))
    found = [_indicator(sites[a], sites[b], sites[c]) for c in facing[min(a, b), max(a, b)]]
    # Facing angles add up to 180 degrees at most: only the smaller magnitude can carry a minus
    # sign, so values sort as magnitudes do.
    gamma0, gamma1 = sorted([*found, 1.0, 1.0][:2])
    return gamma0, gamma1


def _indicator(i: Site, j: Site, k: Site) -> float:
    """Definition 1: 1 - sin, or sin - 1 if obtuse, of the angle at k, freed of cancellation."""
    cot = cotangent(i, j, k)
    cosecant = math.hypot(1.0, cot)
    return (cot / cosecant) * (abs(cot) / (1.0 + cosecant))


def _facing(sites: list[Site], triangles: Ids) -> list[tuple[tuple[int, int], list[int]]]:
    """Delaunay edges (a, b), a < b, sorted, each with the one or two points that face it.

    Neighbours on a line are edges that no point faces.
    """
    if len(triangles) == 0:
        order = sorted(range(len(sites)), key=sites.__getitem__)
        return sorted(((min(p), max(p)), []) for p in pairwise(order))
    facing = defaultdict(list)
    for i, j, k in triangles.tolist():
        for p, q, corner in ((i, j, k), (j, k, i), (k, i, j)):
            facing[min(p, q), max(p, q)].append(corner)
    return sorted(facing.items())
