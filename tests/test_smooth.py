"""Smooth boundaries: the kernel equals the reference, and both keep what the theory promises."""

from __future__ import annotations

import re
from fractions import Fraction
from xml.etree import ElementTree

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

import flintknap as fk
import strategies
from flintknap import reference
from flintknap.crossing import crosses
from flintknap.smooth import WEIGHTS, curve

SQUARE = np.array([[0, 0], [4, 0], [4, 3], [0, 3]], float)
SAW = np.array([(i / 2, (i % 2) * 5.0) for i in range(41)] + [(20.0, -1.0), (0.0, -1.0)])
# A needle whose tangent is a ratio of whole numbers just below 2^53: 2^53 + 1 is not one.
NEAR_THE_LIMIT = np.array(
    [
        [float.fromhex("0x1.6ecf296387a79p-197"), -float.fromhex("0x1.6ecf296387a7ap-197")],
        [0.0, 0.0],
        [float.fromhex("0x1.e914372f5f8a1p-199"), -float.fromhex("0x1.e914372f5f8a2p-199")],
    ]
)
weightings = st.sampled_from(sorted(WEIGHTS))
boundaries = strategies.point_sets().map(lambda xy: boundary(xy).xy).filter(len)


def boundary(xy):
    engine = fk.Engine()
    engine.insert(xy)
    return engine.boundary()


def smooth(xy, weights="length", degree=3):
    xy = np.asarray(xy, np.float64)
    return curve(np.arange(len(xy)), xy, weights, degree)


def sides(xy):
    """Of each vertex the exact side before it and that behind it, as pairs of fractions."""
    exact = [(Fraction(x), Fraction(y)) for x, y in xy.tolist()]
    steps = [(x - u, y - v) for (u, v), (x, y) in zip([exact[-1], *exact], exact, strict=False)]
    return list(zip(steps, [*steps[1:], steps[0]], strict=True))


def along(side, tangent):
    return side[0] * Fraction(tangent[0]) + side[1] * Fraction(tangent[1])


def is_reversal(a, b):
    return a[0] * b[1] == a[1] * b[0] and a[0] * b[0] + a[1] * b[1] < 0


@st.composite
def needles(draw):
    """A vertex whose sides fold back within some last bits, and up to two others."""
    tip = draw(st.sampled_from([(0.0, 0.0), (1.0, 1.0), (-3.0, 1e-3)]))
    x, y = draw(strategies.coordinates), draw(strategies.coordinates)
    scale = draw(st.sampled_from([1.0, 0.5, 1 / 3, 1e10, 1e-10]))
    base = strategies.array(
        [(tip[0] + x, tip[1] + y), tip, (tip[0] + scale * x, tip[1] + scale * y)]
    )
    others = draw(st.lists(st.tuples(strategies.small, strategies.small), max_size=2))
    xy = np.concatenate([draw(strategies.last_bits(base)), strategies.array(others)])
    xy = np.where(strategies.admissible(xy), xy, 0.0)
    keep = (xy != np.roll(xy, 1, axis=0)).any(axis=1)
    return xy[keep]


closed_polygons = (boundaries | needles()).filter(lambda xy: len(xy) >= 2)


# ---------------------------------------------------------------------- against the reference
@given(closed_polygons, weightings)
@example(np.array([[0.0, 0.0], [1.0, 1.0], [1e-30, 1.1e-30]]), "length")
@example(np.array([[1.0, 1.0], [0.0, 0.0], [1.0, 1 + 2**-52]]), "uniform")
@example(np.array([[0.0, 0.0], [1.0, 0.0]]), "inverse")
@example(NEAR_THE_LIMIT, "length")
def test_it_is_the_reference_bit_for_bit(xy, weights):
    got = smooth(xy, weights)
    control, tangents = reference.cubic(xy, weights)
    assert got.control.tobytes() == control.tobytes()
    assert got.tangents.tolist() == [list(t.direction) for t in tangents]
    for kind, ids in (("adjusted", got.adjusted), ("cusp", got.cusps)):
        assert ids.tolist() == [i for i, t in enumerate(tangents) if t.kind == kind]


@given(closed_polygons, weightings)
@example(SQUARE, "length")
@example(SAW, "length")
def test_degree_2_is_the_reference_bit_for_bit(xy, weights):
    middles, _ = reference.quadratic(xy, weights)
    refused = [i for i, middle in enumerate(middles) if middle is None]
    if not refused:
        got = smooth(xy, weights, 2).control
        assert got[:, 1].tolist() == [list(middle) for middle in middles]
        assert (got[:, 0] == xy).all()
        assert (got[:, 2] == np.roll(xy, -1, axis=0)).all()
        return
    with pytest.raises(fk.InputError) as error:
        smooth(xy, weights, 2)
    named = re.findall(r"\((\d+), (\d+)\)", str(error.value))
    assert [int(i) for i, _ in named] == refused[:10]
    assert all(int(j) == (int(i) + 1) % len(xy) for i, j in named)
    assert ("and" in str(error.value).split("vertices")[1]) == (len(refused) > 10)


# ---------------------------------------------------------------------- what is promised
@given(closed_polygons, weightings)
def test_every_vertex_is_passed_forward_or_proven_a_cusp(xy, weights):
    got = smooth(xy, weights)
    for i, ((a, b), t) in enumerate(zip(sides(xy), got.tangents.tolist(), strict=True)):
        is_forward = along(a, t) > 0 and along(b, t) > 0
        assert is_forward == (i not in got.cusps)
        if is_reversal(a, b):
            assert i in got.cusps
        # Rounded handles point along the tangent or vanish; never back.
        before, ahead = got.control[i - 1, 3] - got.control[i - 1, 2], got.control[i, 1] - xy[i]
        for handle in (before, ahead):
            assert (handle * t >= 0).all()


@given(closed_polygons)
def test_uniform_weights_need_no_adjustment_but_at_the_last_bit(xy):
    got = smooth(xy, "uniform")
    for i in [*got.adjusted, *got.cusps]:
        a, b = sides(xy)[i]
        cross, dot = a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]
        assert dot < 0
        assert abs(cross) < -dot * Fraction(1, 10**14)


@given(closed_polygons)
def test_length_and_inverse_are_adjusted_at_the_same_vertices_as_the_paper_says(xy):
    """Where the triangle of a vertex and its neighbours is not acute at one of these."""
    by_length, by_inverse = smooth(xy, "length"), smooth(xy, "inverse")
    for i, (a, b) in enumerate(sides(xy)):
        d = a[0] + b[0], a[1] + b[1]
        fails = min(a[0] * d[0] + a[1] * d[1], b[0] * d[0] + b[1] * d[1]) <= 0
        for got in (by_length, by_inverse):
            moved = i in got.adjusted or i in got.cusps
            assert moved or not fails
            if moved and not fails:  # for the rounded tangent it does fail
                size = abs(d[0]) + abs(d[1])
                least = min(abs(along(a, d)), abs(along(b, d)))
                assert least <= size * max(map(abs, (*a, *b))) * Fraction(1, 10**14)


def test_an_adjusted_tangent_is_in_the_middle():
    """Sides to the right, then steeply back: the weights by length point back from the first."""
    xy = np.array([[-1.0, 0.0], [0.0, 0.0], [-3.0, 1.0]])
    got = smooth(xy)
    assert 1 in got.adjusted
    bisector = reference.cubic(xy, "uniform")[1][1].direction
    middle = np.array([0.0, 1.0]) + bisector  # upright is at right angles to the first side
    assert got.tangents[1] == pytest.approx(middle / np.hypot(*middle))
    assert smooth(xy, "uniform").tangents[1] == pytest.approx(bisector)


def test_a_saw_is_smooth_without_cusps():
    for weights in WEIGHTS:
        got = smooth(SAW, weights)
        assert len(got.cusps) == 0
        turned = np.diff(got.control, axis=1)
        ahead, before = turned[:, 0], np.roll(turned[:, 2], 1, axis=0)
        cosine = (ahead * before).sum(axis=1) / np.linalg.norm(ahead, axis=1)
        assert cosine / np.linalg.norm(before, axis=1) == pytest.approx(1)


def test_a_needle_at_the_last_bit_gets_a_direction_that_no_unit_vector_has():
    xy = np.array([[1.0, 1.0], [0.0, 0.0], [1.0, 1 + 2**-52]])
    got = smooth(xy)
    assert 1 in got.adjusted
    assert len(got.cusps) == 0
    (a, b), t = sides(xy)[1], got.tangents[1]
    assert along(a, t) > 0
    assert along(b, t) > 0
    assert 1 <= np.hypot(*t) < 2


def test_a_needle_beyond_doubles_is_a_cusp():
    """Between 1 : 1 and the other slope there is no ratio of two doubles."""
    got = smooth([[0.0, 0.0], [1.0, 1.0], [1e-30, 1e-30 + 2e-46]])
    assert 1 in got.cusps
    assert (got.control[0, 2] == got.control[0, 3]).all()
    assert (got.control[1, 1] == got.control[1, 0]).all()


@given(boundaries, weightings, st.sampled_from([2.0**-40, 2.0**20]))
def test_scaling_by_a_power_of_two_scales_the_curve(xy, weights, scale):
    if not (np.abs(xy) < 1e40).all() or not ((xy == 0) | (np.abs(xy) > 1e-40)).all():
        return
    got, scaled = smooth(xy, weights), smooth(scale * xy, weights)
    assert (scale * got.control == scaled.control).all()
    assert (got.tangents == scaled.tangents).all()


@given(boundaries.filter(lambda xy: len(xy) > 6), weightings, st.data())
def test_a_changed_vertex_changes_four_segments(xy, weights, data):
    i = data.draw(st.integers(0, len(xy) - 1))
    moved = xy.copy()
    moved[i] += (moved[i] - moved[i - 1]) / 4
    if not strategies.admissible(moved).all() or (moved[i] == moved[(i + 1) % len(xy)]).all():
        return
    before, after = smooth(xy, weights), smooth(moved, weights)
    touched = {(i + k) % len(xy) for k in (-2, -1, 0, 1)}
    rest = [k for k in range(len(xy)) if k not in touched]
    assert (before.control[rest] == after.control[rest]).all()


# ---------------------------------------------------------------------- the engine
def test_the_engine_smooths_its_boundary_once():
    engine = fk.Engine()
    engine.insert(SQUARE)
    got = engine.smooth()
    assert got.ids is engine.boundary().ids
    assert (got.control[:, 0] == engine.boundary().xy).all()
    assert engine.smooth() is got
    assert engine.smooth(weights="uniform") is not got
    assert engine.smooth(degree=2).degree == 2
    engine.insert(9.0, 9.0)
    assert len(engine.smooth()) == 5
    for array in (got.control, got.tangents, got.kinds, got.adjusted, got.cusps, got.ids):
        assert not array.flags.writeable


@given(strategies.point_sets(), weightings)
def test_the_set_decides_not_its_history(xy, weights):
    one, other = fk.Engine(), fk.Engine()
    one.insert(xy)
    for x, y in xy[::-1].tolist():
        other.insert(x, y)
        other.smooth(weights=weights)
    a, b = one.smooth(weights=weights), other.smooth(weights=weights)
    assert a.control.tobytes() == b.control.tobytes()
    assert a.tangents.tobytes() == b.tangents.tobytes()


def test_an_empty_curve():
    for degree in (2, 3):
        got = fk.Engine().smooth(degree=degree)
        assert (len(got), got.area, got.length, got.crosses_itself) == (0, 0.0, 0.0, False)
        assert got.control.shape == (0, degree + 1, 2)
        assert got.sample(3).shape == got.derivative(3).shape == (0, 2)
        assert got.flatten(1.0).to_wkt() == "POLYGON EMPTY"
        assert ElementTree.fromstring(got.to_svg()).get("viewBox") == "0 0 40 40"
        with pytest.raises(fk.InputError, match="empty"):
            got.to_bpoly()


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ({"weights": ["length"]}, r"weights: got \["),
        ({"weights": "mass"}, "weights: got 'mass', expected one of length, uniform, inverse"),
        ({"degree": 4}, "degree: got 4, expected 2 or 3"),
    ],
)
def test_unknown_names(arguments, complaint):
    engine = fk.Engine()
    engine.insert(SQUARE)
    with pytest.raises(fk.InputError, match=complaint):
        engine.smooth(**arguments)


# ---------------------------------------------------------------------- measures
def circle(n, degree=3):
    angle = np.linspace(0, 2 * np.pi, n, endpoint=False)
    return smooth(np.column_stack([np.cos(angle), np.sin(angle)]), degree=degree)


@pytest.mark.parametrize("degree", [2, 3])
def test_measures_of_a_circle(degree):
    got = circle(200, degree)
    assert got.area == pytest.approx(np.pi, rel=1e-6)
    assert got.length == pytest.approx(2 * np.pi, rel=1e-6)
    assert np.hypot(*got.sample(5).T) == pytest.approx(1, abs=1e-6)


@given(boundaries, weightings)
def test_area_and_length_are_those_of_the_polynomials(xy, weights):
    if np.abs(xy).max() > 1e3 or len(xy) > 12:
        return
    got = smooth(xy, weights)
    size = np.ptp(xy, axis=0).max()
    area = length = 0.0
    for p in got.control - xy[0]:
        (x, dx), (y, dy) = ((f, f.deriv()) for f in map(polynomial, p.T))
        area += (x * dy - y * dx).integ()(1) / 2
        # In units of the size, for what is asked for is an absolute error.
        speed = quad(lambda t, dx=dx, dy=dy: np.hypot(dx(t), dy(t)) / size, 0, 1, limit=200)[0]
        length += size * speed
    assert got.area == pytest.approx(area, abs=1e-12 * size**2)
    assert got.length == pytest.approx(length, rel=1e-7)


def polynomial(p):
    x = np.polynomial.Polynomial([0, 1])
    return (
        p[0] * (1 - x) ** 3 + 3 * p[1] * x * (1 - x) ** 2 + 3 * p[2] * x**2 * (1 - x) + p[3] * x**3
    )


@pytest.mark.parametrize("degree", [2, 3])
def test_sample_and_derivative_agree_with_scipy(degree):
    got = smooth(circle(7).control[:, 0] * [3, 2], "uniform", degree)
    bpoly = got.to_bpoly()
    t = np.arange(7 * 4) / 4
    assert got.sample(4) == pytest.approx(bpoly(t))
    assert got.derivative(4) == pytest.approx(bpoly.derivative()(t), abs=1e-12)
    assert bpoly(7.5) == pytest.approx(bpoly(0.5))
    assert (got.sample(4)[::4] == got.control[:, 0]).all()
    for bad in (0, 2.5, True, "3"):
        with pytest.raises(
            fk.InputError, match=f"per_segment: got {bad!r}, expected an integer, 1"
        ):
            got.sample(bad)


@given(boundaries, weightings, st.sampled_from([0.1, 1e-2, 1e-4]))
def test_a_flattening_is_as_close_as_it_says(xy, weights, share):
    got = smooth(xy, weights)
    tolerance = share * np.ptp(xy, axis=0).max()
    if tolerance < 1e-12 * np.abs(xy).max():
        return
    flat = got.flatten(tolerance)
    assert flat.error <= tolerance
    vertices = {tuple(v) for v in flat.xy.tolist()}
    assert vertices >= {tuple(v) for v in xy.tolist()}
    # Walk along curve and chords at once: between vertices of the flattening, at equal shares.
    starts = [k for k, v in enumerate(flat.xy.tolist()) if tuple(v) in set(map(tuple, xy.tolist()))]
    assert len(starts) >= len(xy)
    if len(starts) > len(xy):  # the curve passes a vertex twice
        return
    ends = [*starts[1:], len(flat)]
    for segment, start, end in zip(got.control, starts, ends, strict=True):
        pieces = end - start
        t = np.linspace(0, 1, 8 * pieces + 1)
        exact = np.column_stack([polynomial(p)(t) for p in segment.T])
        corners = np.concatenate([flat.xy[start:end], segment[3:]])
        chords = np.column_stack([np.interp(t * pieces, range(pieces + 1), c) for c in corners.T])
        assert np.hypot(*(exact - chords).T).max() <= flat.error * (1 + 1e-9)


def test_flattening_is_not_wasteful():
    got = circle(10)
    assert len(got.flatten(1e-6)) < 2 * len(got.flatten(4e-6)) * 1.05


@pytest.mark.parametrize("tolerance", [0.0, -1.0, float("nan"), 1e-17])
def test_a_tolerance_that_cannot_be_kept(tolerance):
    with pytest.raises(fk.InputError, match=r"tolerance: got .*, expected more than 1\.[0-9]+e-14"):
        circle(10).flatten(tolerance)


@pytest.mark.parametrize("tolerance", ["1", None, True])
def test_a_tolerance_that_is_no_number(tolerance):
    with pytest.raises(fk.InputError, match=f"tolerance: got {tolerance!r}, expected a number"):
        circle(10).flatten(tolerance)


def test_a_tolerance_that_takes_too_many_points():
    saw = np.array([(i, (i % 2) * 1000.0) for i in range(2001)] + [(2000.0, -1.0), (0.0, -1.0)])
    with pytest.raises(fk.InputError, match=r"which takes .* points, expected one that takes"):
        smooth(saw).flatten(1e-10)


# ---------------------------------------------------------------------- crossings
def is_simple(got, tolerance):
    return got.flatten(tolerance * np.ptp(got.control[:, 0], axis=0).max()).to_shapely().is_valid


@settings(deadline=None)
@given(strategies.generators, st.integers(4, 30), st.booleans(), weightings)
def test_a_crossing_is_one_of_the_flattening(rng, n, on_grid, weights):
    xy = rng.integers(0, 12, (n, 2)) if on_grid else rng.normal(size=(n, 2)) * [1, 0.1]
    got = smooth(boundary(xy.astype(float)).xy, weights)
    if len(got):
        assert got.crosses_itself == (not is_simple(got, 1e-8))


@settings(deadline=None, max_examples=50)
@given(boundaries, weightings)
def test_no_crossing_is_missed(xy, weights):
    got = smooth(xy, weights)
    wide, polygon = 1e-6 * np.abs(xy).max(initial=0), shapely.Polygon(xy)
    if polygon.area < wide * polygon.length or is_simple(got, 1e-6):
        return  # the flattening would be coarser than its rounding, or there is nothing to miss
    assert got.crosses_itself or is_simple(got, 1e-9)


def test_curves_that_cross_themselves():
    eight = np.array([[0, 0], [1, 1], [2, 0], [2, 1], [1, 0], [0, 1]], float)
    assert smooth(eight).crosses_itself  # its polygon does
    # A narrow passage of few vertices: the polygon does not cross itself, its curve does.
    notched = [[0, 3], [3, 5], [10, 4], [9, 6], [2, 6], [0, 11], [1, 7]]
    assert shapely.Polygon(notched).is_simple
    assert smooth(notched).crosses_itself
    assert not smooth(notched).flatten(1e-4).to_shapely().is_valid
    assert not circle(50).crosses_itself
    assert not circle(3).crosses_itself
    assert not smooth(SQUARE).crosses_itself
    assert not smooth(SQUARE, degree=2).crosses_itself


def test_one_segment_that_crosses_itself():
    loop = np.array([[[0, 0], [9, 9], [-8, 9], [1, 0]], [[1, 0], [1, -2], [0, -2], [0, 0]]], float)
    assert crosses(loop)
    loop[0, 1:3] = loop[0, 2:0:-1]
    assert not crosses(loop)


# ---------------------------------------------------------------------- pictures
@pytest.mark.parametrize(("degree", "command"), [(2, "Q"), (3, "C")])
def test_svg_has_the_segments_as_commands(degree, command):
    got = smooth(SQUARE, degree=degree)
    root = ElementTree.fromstring(got.to_svg())
    (path,) = root.iter("{http://www.w3.org/2000/svg}path")
    d = path.get("d")
    assert re.fullmatch(rf"M[\d.]+,[\d.]+({command}[\d., ]+){{4}}Z", d)
    drawn = np.array(re.findall(r"([\d.]+),([\d.]+)", d), float)
    control = got.control.reshape(-1, 2)
    low, high = control.min(axis=0), control.max(axis=0)
    scale = 1000 / (high - low).max()
    placed = (got.control - low) * scale + 20
    placed[..., 1] = float(root.get("viewBox").split()[3]) - placed[..., 1]
    expected = np.concatenate([placed[0, :1], placed[:, 1:].reshape(-1, 2)])
    assert drawn == pytest.approx(expected, abs=0.01)
