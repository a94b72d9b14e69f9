"""The kernel's predicates against Fractions, and the laws they must obey on their own.

Points come from boxes, from grids, from lines and circles that are exact or a last bit off, and
from both ends of the admissible range at once. Quotients are built to lie on a rounding boundary
of doubles, or as close beside it as the quotient of two doubles can.
"""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import permutations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import oracles
import strategies
from flintknap import _kernel

many_times = settings(deadline=None, max_examples=400)


def orient(*points):
    return _kernel.orient(*flat(points))


def in_circle(*points):
    return _kernel.in_circle(*flat(points))


def in_circle_perturbed(*points):
    return _kernel.in_circle_perturbed(*flat(points))


def dot_sign(*points):
    return _kernel.dot_sign(*flat(points))


def cotangent(*points):
    return _kernel.cotangent(*flat(points))


def cotangent_floor(*points):
    return _kernel.cotangent_floor(*flat(points))


def flat(points):
    return [float(v) for p in points for v in p]


@st.composite
def tuples(draw, count):
    """So many distinct points of one set, or of two mixed."""
    xy = strategies.distinct(draw(strategies.point_sets(3 * count)))
    assume(len(xy) >= count)
    return [tuple(p) for p in xy[:count].tolist()]


@st.composite
def quadruples_on_circles(draw):
    """Four points exactly on a circle, perhaps one moved by a last bit."""
    chosen = draw(
        st.lists(st.sampled_from(strategies.ON_CIRCLE), min_size=4, max_size=4, unique=True)
    )
    shift = np.array([draw(st.integers(-1000, 1000)), draw(st.integers(-1000, 1000))], np.float64)
    xy = (np.array(chosen) + shift) * 2.0 ** draw(st.sampled_from([-190, -3, 0, 180]))
    if draw(st.booleans()):
        ulps = np.zeros((4, 2))
        ulps[draw(st.integers(0, 3)), draw(st.integers(0, 1))] = draw(st.sampled_from([1, -1]))
        xy = strategies.nudged(xy, ulps)
    assume(strategies.admissible(xy).all())
    return [tuple(p) for p in xy.tolist()]


@st.composite
def triples_on_lines(draw):
    """Three points of a line through two of them, rounded, some moved by a last bit."""
    (ax, ay), (bx, by) = draw(tuples(2))
    t = draw(st.fractions(-2, 3, max_denominator=64))
    c = (
        float(ax + t * (Fraction(bx) - Fraction(ax))),
        float(ay + t * (Fraction(by) - Fraction(ay))),
    )
    xy = draw(strategies.last_bits(np.array([(ax, ay), (bx, by), c])))
    assume(strategies.admissible(xy).all())
    return [tuple(p) for p in xy.tolist()]


def turned_left(a, b, c):
    turn = oracles.orient(a, b, c)
    assume(turn != 0)
    return (a, b, c) if turn > 0 else (b, a, c)


@many_times
@given(tuples(3) | triples_on_lines())
def test_orient_is_the_exact_sign(points):
    a, b, c = points
    assert orient(a, b, c) == oracles.orient(a, b, c)
    assert orient(b, c, a) == orient(a, b, c)
    assert orient(b, a, c) == -orient(a, b, c)
    assert orient(a, a, c) == orient(a, b, b) == orient(a, b, a) == 0


@many_times
@given(tuples(4) | quadruples_on_circles())
def test_in_circle_is_the_exact_sign(points):
    a, b, c = turned_left(*points[:3])
    d = points[3]
    sign = in_circle(a, b, c, d)
    assert sign == oracles.in_circle(a, b, c, d)
    assert in_circle(b, c, a, d) == sign
    assert in_circle(b, a, c, d) == in_circle(a, b, d, c) == -sign
    assert in_circle(a, b, c, a) == 0


@many_times
@given(tuples(4) | quadruples_on_circles())
def test_perturbed_in_circle_breaks_every_tie(points):
    """By the infinitesimals, the same for every turn of the arguments, and with a swap's sign."""
    a, b, c = turned_left(*points[:3])
    d = points[3]
    sign = in_circle_perturbed(a, b, c, d)
    assert sign == oracles.in_circle_perturbed(a, b, c, d) != 0
    assert in_circle(a, b, c, d) in (0, sign)
    assert in_circle_perturbed(b, c, a, d) == in_circle_perturbed(c, a, b, d) == sign
    if oracles.orient(a, b, d) > 0:
        assert in_circle_perturbed(a, b, d, c) == -sign


@many_times
@given(st.lists(st.sampled_from(strategies.ON_CIRCLE), min_size=5, max_size=5, unique=True))
def test_perturbed_ties_are_consistent(points):
    """Among the points left of ab, being inside each other's circles is a total order."""
    a, b, *rest = points
    left = [p for p in rest if oracles.orient(a, b, p) > 0]
    inside = {(c, d): in_circle_perturbed(a, b, c, d) > 0 for c, d in permutations(left, 2)}
    for c, d in permutations(left, 2):
        assert inside[c, d] != inside[d, c]
    for c, d, e in permutations(left, 3):
        assert not (inside[c, d] and inside[d, e]) or inside[c, e]


@many_times
@given(tuples(3) | triples_on_lines())
def test_dot_sign_is_the_exact_sign(points):
    i, j, k = points
    sign = oracles.sign(oracles.dot_and_cross(i, j, k)[0])
    assert dot_sign(i, j, k) == dot_sign(j, i, k) == sign


@many_times
@given(
    st.lists(st.tuples(*[st.integers(-(2**20), 2**20)] * 2), min_size=4, max_size=4, unique=True),
    st.tuples(*[st.integers(-(2**30), 2**30)] * 2),
    st.sampled_from([2.0**-190, 1.0, 2.0**150]),
)
def test_nothing_changes_where_a_translation_is_exact(points, shift, scale):
    here = (scale * np.array(points)).tolist()
    there = (scale * (np.array(points) + np.array(shift))).tolist()
    a, b, c, d = here
    e, f, g, h = there
    assert orient(a, b, c) == orient(e, f, g)
    assert in_circle(a, b, c, d) == in_circle(e, f, g, h)
    assert dot_sign(a, b, c) == dot_sign(e, f, g)
    if orient(a, b, c) > 0:
        assert cotangent(a, b, c) == cotangent(e, f, g)
        assert in_circle_perturbed(a, b, c, d) == in_circle_perturbed(e, f, g, h)


@many_times
@given(tuples(3) | triples_on_lines() | quadruples_on_circles())
def test_cotangent_is_rounded_once(points):
    """Needles, ties and the ends of the range included."""
    i, j, k = turned_left(*points[:3])
    for p, q, r in ((i, j, k), (j, k, i), (k, i, j)):
        assert cotangent(p, q, r) == oracles.cotangent(p, q, r)
        assert cotangent_floor(p, q, r) <= oracles.cotangent(p, q, r)


def test_the_floor_of_a_cotangent_is_close():
    rng = np.random.default_rng(11)
    for _ in range(300):
        i, j, k = rng.random((3, 2)).tolist()
        i, j = (i, j) if orient(i, j, k) > 0 else (j, i)
        assert cotangent(i, j, k) - cotangent_floor(i, j, k) < 1e-9 * (1 + cotangent(i, j, k) ** 2)


@pytest.mark.parametrize("magnitude", [1e-60, 1e-3, 1.0, 1e17, 1e60])
def test_in_bulk(magnitude):
    """Against the oracles on normal points, and on points of two magnitudes at once."""
    rng = np.random.default_rng(7)
    for _ in range(60):
        scales = rng.choice([magnitude, 1.0], (4, 2))
        xy = scales * np.where(rng.random((4, 2)) < 0.5, -1, 1) * rng.uniform(0.5, 1, (4, 2))
        xy = np.where(strategies.admissible(xy), xy, 0.0)
        a, b, c, d = xy.tolist()
        turn = oracles.orient(a, b, c)
        assert orient(a, b, c) == turn
        if turn:
            a, b, c = (a, b, c) if turn > 0 else (b, a, c)
            assert in_circle(a, b, c, d) == oracles.in_circle(a, b, c, d)
            assert cotangent(a, b, c) == oracles.cotangent(a, b, c)


@pytest.mark.parametrize("bit", [2.0**-52, 2.0**-53, 2.0**-54])
def test_a_last_bit_decides(bit):
    """Points about (0.5, 0.5) + (p, q) bits seen from the line through (12, 12) and (24, 24)."""
    for p in range(-8, 9):
        for q in range(-8, 9):
            c = (0.5 + p * bit, 0.5 + q * bit)
            assert orient((12, 12), (24, 24), c) == oracles.orient((12, 12), (24, 24), c)
            assert orient(c, (12, 12), (24, 24)) == orient((12, 12), (24, 24), c)


def test_a_last_bit_on_a_circle_decides():
    a, b, c, d = (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)
    assert in_circle(a, b, c, d) == 0
    assert in_circle(a, b, c, (0.0, math.nextafter(-1.0, 0.0))) == 1
    assert in_circle(a, b, c, (0.0, math.nextafter(-1.0, -2.0))) == -1
    assert in_circle(a, b, c, (1e-60, -1.0)) == -1
    assert in_circle_perturbed(a, b, c, d) == oracles.in_circle_perturbed(a, b, c, d)


# ------------------------------------------------------------------ rounding boundaries
QUARTER_TURNS = [(1, 0), (0, 1), (-1, 0), (0, -1)]
turns = st.tuples(st.integers(-9, 9), st.integers(-9, 9)).filter(any)


def turned(points, turn):
    """The points times p + qi, which leaves the angles between them; they must stay doubles."""
    p, q = turn
    whole = [(x * p - y * q, x * q + y * p) for x, y in points]
    assert all(int(float(v)) == v for point in whole for v in point)
    return whole


@many_times
@given(st.integers(2**26, 3 * 2**25), st.integers(2**26, 3 * 2**25), st.integers(-1, 1), turns)
def test_cotangent_rounds_midpoints_to_even(a, b, steps, turn):
    """With a cross product of 1, by Bezout, the dot product: if odd and of 54 bits, it is a tie."""
    assume(math.gcd(a, b) == 1)
    d = pow(a, -1, b) + steps * b
    c = (a * d - 1) // b
    points = turned([(a, b), (c, d), (0, 0)], turn)
    assert cotangent(*points) == float(a * c + b * d) == oracles.cotangent(*points)


@many_times
@given(
    st.integers(2**52, 2**53 - 1).map(lambda m: 2 * m + 1),
    st.integers(2, 100),
    st.sampled_from([1, -1]),
    st.sampled_from(QUARTER_TURNS),
    st.sampled_from([-150, 0, 90]),
)
def test_cotangent_a_hair_off_midpoints(middle, bits, miss, turn, exponent):
    """Quotients that miss middle / 2^bits, a tie, by 1 / (cross * 2^bits), with up to 100 bits.

    The apex holds what of the products does not fit the 53 bits of the other point.
    """
    cross = pow(miss * middle, -1, 2**bits)
    dot = (cross * middle - miss) // 2**bits
    assert abs(Fraction(dot, cross) - Fraction(middle, 2**bits)) == Fraction(1, cross * 2**bits)
    k = (-(dot % 2**10), -(cross % 2**50))
    i, j = (k[0] + 2**10, k[1]), (k[0] + dot, k[1] + cross)
    scale = 2.0**exponent
    points = [(scale * x, scale * y) for x, y in turned([i, j, k], turn)]
    assert cotangent(*points) == float(Fraction(dot, cross)) == oracles.cotangent(*points)
