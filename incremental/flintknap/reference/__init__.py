"""The paper in plain Python: every stage from scratch, on plain arrays, in exact arithmetic.

This package says what the engine computes; the kernel only says how to do it fast. It shares no
code with the rest and the two must agree exactly, so either judges the other. One module a stage,
to be read in this order: exact, triangulation, constriction, widening, queries, collision, gamma,
flintstone, bounds, smooth.

Invariants
    Every result is a function of the set of points: only index values depend on the row order.
    Triangles are counter-clockwise, begin at their lexicographically smallest corner and come in
    sorted rows; a ring is counter-clockwise and begins at its lexicographically smallest vertex.

Refuses nothing and checks nothing: rows are finite, distinct and within the range of the engine.
"""

from flintknap.reference import bounds, collision
from flintknap.reference.constriction import Constriction, constrict
from flintknap.reference.flintstone import (
    Edge,
    approximate,
    base,
    in_flintstone,
    localize,
    side_at,
)
from flintknap.reference.gamma import GRAPHS, edges, gamma
from flintknap.reference.queries import side
from flintknap.reference.smooth import cubic, quadratic
from flintknap.reference.triangulation import hull, triangulate
from flintknap.reference.widening import Widening, digest, widen

__all__ = [
    "GRAPHS",
    "Constriction",
    "Edge",
    "Widening",
    "approximate",
    "base",
    "bounds",
    "collision",
    "constrict",
    "cubic",
    "digest",
    "edges",
    "gamma",
    "hull",
    "in_flintstone",
    "localize",
    "quadratic",
    "side",
    "side_at",
    "triangulate",
    "widen",
]
