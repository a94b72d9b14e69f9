"""A smooth boundary from tangents at the vertices (section 5.1).

The tangent at a vertex is a weighted sum of the sides that meet there, a coming and b going. The
curve passes the vertex smoothly iff the tangent T has both ahead of it: a.T > 0 and b.T > 0. Where
the weights fail that, T is the middle between the uniform tangent, which bisects the turn, and the
first direction for which it holds: at right angles to the side it failed for.

Doubles are rounded where the kernel rounds them; signs are those of fractions. The simplest
fraction within an interval is found by its continued fraction; the kernel walks down a tree.
O(n) for n vertices.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flintknap.reference.exact import integers, orient

T = TypeVar("T")
Vector = tuple[float, float]


class Tangent(NamedTuple):
    """How the curve passes a vertex.

    Attributes:
        direction: where it leads.
        back: how far the handle behind the vertex reaches along it.
        ahead: how far the handle before it does.
        kind: how it was found: "weighted", "adjusted" or "cusp".

    """

    direction: Vector
    back: float
    ahead: float
    kind: str


def tangent(p: Vector, v: Vector, q: Vector, weights: str = "length") -> Tangent:
    """Return the tangent at ``v`` between its neighbours ``p`` and ``q``."""
    a, b = _minus(v, p), _minus(q, v)
    ua, ub = _unit(a), _unit(b)
    turn = _turn(p, v, q)
    is_sharp = a[0] * b[0] + a[1] * b[1] < 0
    fails_back = fails_ahead = is_sharp and turn == 0
    if weights == "uniform":
        t = _turned(_unit(_minus(ua, ub)), turn) if is_sharp else _unit(_plus(ua, ub))
    else:
        fails_back, fails_ahead = _dot(v, p, q, p) <= 0, _dot(q, v, q, p) <= 0
        t = _minus(q, p)
        if weights == "inverse":
            fails_back, fails_ahead = fails_ahead, fails_back
            a2, b2 = a[0] * a[0] + a[1] * a[1], b[0] * b[0] + b[1] * b[1]
            s, r = b2 / (a2 + b2), a2 / (a2 + b2)
            t = (s * a[0] + r * b[0], s * a[1] + r * b[1])
        t = _unit(t) if t != (0, 0) else t
    if not (fails_back or fails_ahead):
        fails_back, fails_ahead = _dot(v, p, t) <= 0, _dot(q, v, t) <= 0
        if not (fails_back or fails_ahead):
            return _passing(p, v, q, t, "weighted")
    across = _unit(_minus(ua, ub))
    uniform = _turned(across, turn)
    candidates = []
    if turn:
        if fails_back != fails_ahead and weights != "uniform":
            middle = _plus(across, ua) if fails_back else _minus(across, ub)
            candidates.append(_turned(_unit(middle), turn))
        candidates.append(uniform)
    for t in candidates:
        if _dot(v, p, t) > 0 and _dot(q, v, t) > 0:
            return _passing(p, v, q, t, "adjusted")
    if turn and (simplest := _simplest(p, v, q, uniform)):
        return _passing(p, v, q, simplest, "adjusted")
    return Tangent(uniform, 0.0, 0.0, "cusp")


def cubic(xy: ArrayLike, weights: str = "length") -> tuple[NDArray[np.float64], list[Tangent]]:
    """Return the control points of the G1 cubic curve, (n, 4, 2), and the tangents.

    Row i leads from vertex i to the next.
    """
    ring, tangents = _tangents(xy, weights)
    control = []
    for v, w, s, t in zip(ring, _next(ring), tangents, _next(tangents), strict=True):
        (sx, sy), (tx, ty) = s.direction, t.direction
        first = (v[0] + s.ahead * sx, v[1] + s.ahead * sy)
        second = (w[0] - t.back * tx, w[1] - t.back * ty)
        control.append([v, first, second, w])
    return np.array(control).reshape(-1, 4, 2), tangents


def quadratic(xy: ArrayLike, weights: str = "length") -> tuple[list[Vector | None], list[Tangent]]:
    """Return the middle control point of each segment, None where there is none, and the tangents.

    It is where the tangent lines at the ends meet, if that is ahead of the first and behind the
    last. On a side that continues straight at both ends it is the middle.
    """
    ring, tangents = _tangents(xy, weights)
    sites = integers(xy)
    straight = [orient(sites[i - 1], sites[i], j) == 0 for i, j in enumerate(_next(sites))]
    middles: list[Vector | None] = []
    for i, (v, w) in enumerate(zip(ring, _next(ring), strict=True)):
        j = (i + 1) % len(ring)
        (sx, sy), (tx, ty) = tangents[i].direction, tangents[j].direction
        turn = _dot((sx, sy), (0.0, 0.0), (ty, -tx))
        ahead, back = _dot(w, v, (ty, -tx)), _dot(w, v, (-sy, sx))
        if "cusp" in (tangents[i].kind, tangents[j].kind):
            middles.append(None)
        elif straight[i] and straight[j]:
            middles.append((0.5 * v[0] + 0.5 * w[0], 0.5 * v[1] + 0.5 * w[1]))
        elif straight[i] or straight[j] or not (ahead * turn > 0 and back * turn > 0):
            middles.append(None)
        else:
            s = float(ahead) / float(turn)
            middles.append((v[0] + s * sx, v[1] + s * sy))
    return middles, tangents


def _tangents(xy: ArrayLike, weights: str) -> tuple[list[Vector], list[Tangent]]:
    ring = [(x, y) for x, y in np.asarray(xy, np.float64).tolist()]
    return ring, [
        tangent(ring[i - 1], v, w, weights)
        for i, (v, w) in enumerate(zip(ring, _next(ring), strict=True))
    ]


def _next(ring: list[T]) -> list[T]:
    return ring[1:] + ring[:1]


def _passing(p: Vector, v: Vector, q: Vector, t: Vector, kind: str) -> Tangent:
    """Give the handles: a third of the projections of the sides on the tangent."""
    thrice = 3 * (t[0] * t[0] + t[1] * t[1])
    return Tangent(t, float(_dot(v, p, t)) / thrice, float(_dot(q, v, t)) / thrice, kind)


def _simplest(p: Vector, v: Vector, q: Vector, uniform: Vector) -> Vector | None:
    """Return the simplest direction that passes, from a narrow wedge about the uniform tangent.

    In each coordinate the unit is a power of two, so that the slope is between 1 and 2, or half.
    """
    if 0.0 in uniform:
        return None
    (mx, ex), (my, ey) = (math.frexp(abs(u)) for u in uniform)
    for shift in (0, 1):
        scale = Fraction(2) ** (ey - (my < mx) + shift)
        sx = Fraction(2) ** ex * (1 if uniform[0] > 0 else -1)
        sy = scale * (1 if uniform[1] > 0 else -1)
        # slope r: a.(sx, sy r) = 0 and b.(sx, sy r) = 0
        ends = []
        for tip, tail in ((v, p), (q, v)):
            dx, dy = Fraction(tip[0]) - Fraction(tail[0]), Fraction(tip[1]) - Fraction(tail[1])
            ends.append(-(dx * sx) / (dy * sy))
        r = _simplest_between(min(ends), max(ends))
        if max(r.numerator, r.denominator) < 2**53:
            tx, ty = float(sx * r.denominator), float(sy * r.numerator)
            most = math.frexp(max(abs(tx), abs(ty)))[1] - 1
            return math.ldexp(tx, -most), math.ldexp(ty, -most)
    return None


def _simplest_between(low: Fraction, high: Fraction) -> Fraction:
    """Return the fraction of smallest numerator and denominator strictly between two others."""
    whole = low.numerator // low.denominator
    if whole + 1 < high:
        return Fraction(whole + 1)
    if low == whole:  # the largest 1 / m that is less than high - whole
        return whole + Fraction(1, math.floor(1 / (high - whole)) + 1)
    return whole + 1 / _simplest_between(1 / (high - whole), 1 / (low - whole))


def _dot(tip: Vector, tail: Vector, *rest: Vector) -> Fraction:
    """(tip - tail) . t, or . (t - s)."""
    t, s = (*rest, (0.0, 0.0))[:2]
    return sum(
        (Fraction(i) - Fraction(j)) * (Fraction(k) - Fraction(m))
        for i, j, k, m in zip(tip, tail, t, s, strict=True)
    ) + Fraction(0)


def _turn(p: Vector, v: Vector, q: Vector) -> int:
    turn = orient(*integers([p, v, q]))
    return (turn > 0) - (turn < 0)


def _plus(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1]


def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1]


def _unit(a: Vector) -> Vector:
    length = math.sqrt(a[0] * a[0] + a[1] * a[1])
    return a[0] / length, a[1] / length


def _turned(a: Vector, turn: int) -> Vector:
    return (a[1], -a[0]) if turn < 0 else (-a[1], a[0])
