"""Questions to the object: point-in-object by counting crossings, exactly.

Cost: O(n) a place.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from flintknap.reference.exact import integers, orient, pairs


def side(xy: ArrayLike, ring: ArrayLike, x: float, y: float) -> int:
    """+1 if (x, y) lies inside the polygon xy[ring], 0 if on it, -1 if outside; exact.

    Counts how often a ray to the right crosses the ring. O(n).
    """
    corners = np.asarray(xy, np.float64)[np.asarray(ring, np.int64)]
    *sites, p = integers(np.append(corners, [[x, y]], axis=0))
    result = -1
    for i, j in pairs(range(len(sites))):
        a, b = sorted([sites[i], sites[j]], key=lambda s: s[1])
        turn = orient(a, b, p)
        if turn == 0 and min(a, b) <= p <= max(a, b):
            return 0
        if a[1] <= p[1] < b[1] and turn > 0:
            result = -result
    return result
