"""How far to widen: d as users give it and the cotangent by which the kernel goes (section 3.1).

gamma = sin phi - 1 for the angle phi > 90 degrees under which a point sees a pair; the kernel knows
phi by its cotangent, correctly rounded. Both ways the comparison with d_min is exact.
"""

from __future__ import annotations

import math
from fractions import Fraction

from flintknap.errors import InputError


def least_cotangent(d_min: float) -> float:
    """Return the least double whose gamma is at least d_min; 0.0 for 0, -inf for -1.

    Raises InputError for a d_min that is no number from -1 to 0.
    """
    if not isinstance(d_min, (int, float)) or not -1 <= d_min <= 0:
        raise InputError(f"d_min: got {d_min!r}, expected a number from -1 to 0")
    if d_min == -1:
        return -math.inf
    most = 1 / (1 + Fraction(d_min)) ** 2 - 1  # of the square of the cotangent
    cot = -math.sqrt(-d_min * (2 + d_min)) / (1 + d_min)
    while Fraction(cot) ** 2 > most:
        cot = math.nextafter(cot, 0)
    while Fraction(further := math.nextafter(cot, -math.inf)) ** 2 <= most:
        cot = further
    return cot


def gamma_of(cotangent: float) -> float:
    """Return gamma of the obtuse angle with this cotangent: 0.0 for 0, down to -1."""
    cosecant = math.hypot(1.0, cotangent)
    return (cotangent / cosecant) * (abs(cotangent) / (1 + cosecant))
