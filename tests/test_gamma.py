"""The gamma-family: the engine against the definition, and the lemmas that tell it from others."""

from __future__ import annotations

import math
import signal
from itertools import combinations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flintknap as fk
import oracles
import programs
import strategies
from flintknap import reference

thorough = settings(deadline=None, max_examples=150)
sets = strategies.point_sets(14).map(strategies.distinct)
NAMES = ("hull", "gabriel", "delaunay", "void", "complete")
GRID = np.array([(x, y) for x in range(3) for y in range(3)], np.float64)


def built(xy):
    engine = fk.Engine()
    engine.insert(np.asarray(xy, np.float64).reshape(-1, 2))
    return engine


def pairs(count):
    return np.array(list(combinations(range(count), 2)), np.int64).reshape(-1, 2)


def rows(edges):
    return {(a, b) for a, b in edges.tolist()}


# ------------------------------------------------------------------ against the definition
@thorough
@given(sets)
def test_every_pair_has_the_values_of_the_reference(xy):
    engine, every = built(xy), pairs(len(xy))
    expected = np.array([reference.gamma(xy, a, b) for a, b in every.tolist()]).reshape(-1, 2)
    np.testing.assert_array_equal(np.column_stack(engine.gamma(*every.T)), expected)
    np.testing.assert_array_equal(np.column_stack(engine.gamma(*every.T[::-1])), expected)


@st.composite
def sets_and_bounds(draw):
    """A set and two intervals, whose bounds like to be values of its pairs."""
    xy = draw(sets)
    values = [reference.gamma(xy, a, b) for a, b in pairs(len(xy)).tolist()]
    found = {v for pair in values for v in pair if not math.isnan(v)}
    near = {math.nextafter(v, side) for v in found for side in (-1.0, 1.0)}
    likely = st.sampled_from([-1.0, -0.5, 0.0, 0.5, 1.0, *sorted(found | near)])
    bounds = [draw(likely | st.floats(-1, 1)) for _ in range(4)]
    return xy, tuple(sorted(bounds[:2])), tuple(sorted(bounds[2:]))


@settings(deadline=None, max_examples=500)
@given(sets_and_bounds())
def test_every_graph_is_that_of_the_reference(case):
    xy, gamma0, gamma1 = case
    found = built(xy).edges(gamma0=gamma0, gamma1=gamma1)
    assert found.tolist() == reference.edges(xy, gamma0, gamma1).tolist()


@thorough
@given(sets)
def test_graphs_with_names_are_those_of_the_reference(xy):
    engine = built(xy)
    for name in NAMES:
        expected = reference.edges(xy, *reference.GRAPHS[name])
        assert engine.edges(name).tolist() == expected.tolist()


@thorough
@given(strategies.point_sets(30), strategies.generators)
def test_graphs_are_those_of_the_set_whatever_its_history(xy, rng):
    """Some points come twice, some leave: slots and ids are used in any order."""
    engine = fk.Engine()
    for part in np.array_split(rng.permutation(np.concatenate((xy, xy / 2 + 1))), 3):
        ids = np.unique(engine.insert(part))
        engine.edges("delaunay")
        engine.remove(rng.permutation(ids)[: len(ids) // 2])
    ids, fresh = engine.ids(), built(engine.points())
    for gamma0, gamma1 in (((-1, 1), (0, 1)), ((-1, 1), (-0.4, 1)), ((-0.9, 0.2), (-1, 0.3))):
        expected = fresh.edges(gamma0=gamma0, gamma1=gamma1)
        assert engine.edges(gamma0=gamma0, gamma1=gamma1).tolist() == ids[expected].tolist()


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("d", [-0.05, -0.3, -0.7, -0.97])
def test_the_search_for_far_pairs_misses_none(seed, d):
    """All pairs of a set too large for the reference have the values that gamma() gives them."""
    rng = np.random.default_rng(seed)
    xy = [rng.random((250, 2)), rng.normal(size=(250, 2)) ** 3, rng.random((250, 2)) ** [1, 9]]
    engine, every = built(xy[seed]), pairs(250)
    gamma0, gamma1 = engine.gamma(*every.T)
    assert engine.edges(gamma1=(d, 1)).tolist() == every[gamma1 >= d].tolist()
    window = (gamma1 >= d) & (gamma1 <= -0.01) & (gamma0 <= 0.1)
    found = engine.edges(gamma0=(-1, 0.1), gamma1=(d, -0.01))
    assert found.tolist() == every[window].tolist()


# ------------------------------------------------------------------ neighbourhoods
def lies_in(xy, a, b, gamma0, gamma1):
    """By how much any other point lies in the neighbourhood of (gamma0, gamma1); the less of both
    ways to lay it on ab. Discs about centres, as the paper draws them, in plain floats.
    """
    half = (xy[b] - xy[a]) / 2
    r, middle = math.hypot(*half), xy[a] + half
    normal = np.array([-half[1], half[0]]) / r
    others = np.delete(xy, [a, b], axis=0)
    depths = []
    for side in (1, -1):
        discs = []
        for value, where in ((gamma1, side), (gamma0, -side if gamma0 * gamma1 > 0 else side)):
            radius = r / (1 - abs(value))
            centre = middle + where * math.sqrt(max(0, radius**2 - r**2)) * normal
            discs.append((radius - np.hypot(*(others - centre).T)) / r)
        both = np.maximum(*discs) if gamma1 >= 0 else np.minimum(*discs)
        depths.append(both.max(initial=-math.inf))
    return min(depths)


def judge_neighbourhoods(xy, found, gamma0, gamma1):
    for a, b in pairs(len(xy)).tolist():
        depth = lies_in(xy, a, b, gamma0, gamma1)
        if abs(depth) > 1e-9:
            assert ((a, b) in found) == (depth < 0)


magnitudes = st.floats(0.01, 0.95)


@thorough
@given(strategies.generators, magnitudes, st.floats(-1, 1))
def test_one_neighbourhood_for_all_above_it(rng, gamma1, share):
    """gamma(g0, g1), of one neighbourhood, is gamma([g0, 1], [g1, 1]) for g1 >= 0."""
    xy, gamma0 = rng.random((12, 2)), share * gamma1
    found = rows(built(xy).edges(gamma0=(gamma0, 1), gamma1=(gamma1, 1)))
    judge_neighbourhoods(xy, found, gamma0, gamma1)


@thorough
@given(strategies.generators, magnitudes)
def test_lenses_below_zero(rng, depth):
    """gamma([-1, 1], [d, 1]) is Delaunay and the pairs whose lens is empty."""
    xy = rng.random((12, 2))
    engine = built(xy)
    found = rows(engine.edges(gamma1=(-depth, 1)))
    delaunay = rows(engine.edges("delaunay"))
    assert delaunay <= found
    for a, b in set(map(tuple, pairs(12).tolist())) - delaunay:
        hidden = lies_in(xy, a, b, -depth, -depth)
        if abs(hidden) > 1e-9:
            assert ((a, b) in found) == (hidden < 0)


@thorough
@given(strategies.generators, st.floats(0.05, 20))
def test_beta_skeletons(rng, beta):
    """Discs of radius beta / 2 times the length on both sides, or the lens of two smaller ones."""
    xy = rng.random((12, 2))
    c = 1 - 1 / beta if beta >= 1 else beta - 1
    found = rows(built(xy).edges(("beta_skeleton", beta)))
    judge_neighbourhoods(xy, found, c, c)
    by_angles = set()
    for a, b in pairs(12).tolist():
        sines = [
            (math.sin(angle), angle > math.pi / 2)
            for angle in (seen(xy[a], xy[b], p) for p in np.delete(xy, [a, b], axis=0))
        ]
        if beta >= 1 and all(sine <= 1 / beta and not blunt for sine, blunt in sines):
            by_angles.add((a, b))
        if beta < 1 and all(sine >= beta or not blunt for sine, blunt in sines):
            by_angles.add((a, b))
    assert found == by_angles


def seen(a, b, p):
    (ux, uy), (vx, vy) = a - p, b - p
    return math.atan2(abs(ux * vy - uy * vx), ux * vx + uy * vy)


# ------------------------------------------------------------------ lemmas
@settings(deadline=None, max_examples=300)
@given(strategies.point_sets(25), st.lists(st.floats(-1, 1), min_size=8, max_size=8))
def test_wider_intervals_hold_more(xy, bounds):
    engine, (a, b, c, d, *rest) = built(xy), sorted(bounds[:4])
    e, f, g, h = sorted(rest + bounds[4 + len(rest) :])
    narrow = rows(engine.edges(gamma0=(b, c), gamma1=(f, g)))
    assert narrow <= rows(engine.edges(gamma0=(a, d), gamma1=(f, g)))
    assert narrow <= rows(engine.edges(gamma0=(b, c), gamma1=(e, h)))


def relative_neighbours(xy):
    """No third point is closer to both ends than they are to each other; exact."""
    whole = oracles.integers(xy)

    def far(a, b):
        return (whole[a][0] - whole[b][0]) ** 2 + (whole[a][1] - whole[b][1]) ** 2

    return {
        (a, b)
        for a, b in combinations(range(len(xy)), 2)
        if all(max(far(a, c), far(b, c)) >= far(a, b) for c in range(len(xy)) if c not in (a, b))
    }


@thorough
@given(sets)
def test_the_spectrum_is_nested(xy):
    engine = built(xy)
    graph = {name: rows(engine.edges(name)) for name in NAMES}
    skeleton = {b: rows(engine.edges(("beta_skeleton", b))) for b in (0.01, 0.5, 1, 2, 50.0)}
    assert relative_neighbours(xy) <= graph["gabriel"] <= graph["delaunay"] <= graph["complete"]
    assert graph["void"] <= graph["hull"] <= graph["delaunay"]
    assert skeleton[50] <= skeleton[2] <= skeleton[1] <= skeleton[0.5] <= skeleton[0.01]
    assert skeleton[1] == graph["gabriel"]
    assert skeleton[0.01] <= graph["complete"]
    assert rows(engine.edges(("beta_skeleton", math.inf))) == graph["void"]


@thorough
@given(sets)
def test_the_triangulation_picks_some_delaunay_edges(xy):
    """Those it leaves out cross one that it took, on one circle; and gamma1 >= 0 for them, too."""
    engine = built(xy)
    sides = {
        (min(e), max(e))
        for row in engine.triangles().tolist()
        for e in zip(row, row[1:] + row[:1], strict=True)
    }
    delaunay = rows(engine.edges("delaunay"))
    if len(engine.triangles()):
        assert sides <= delaunay
    for a, b in delaunay - sides if sides else ():
        gamma0, gamma1 = engine.gamma(a, b)
        assert gamma0 == -gamma1 <= 0
    for a, b in rows(pairs(len(xy))) - delaunay:
        assert math.isnan(engine.gamma(a, b)[1]) or engine.gamma(a, b)[1] < 0


@thorough
@given(sets)
def test_values_0_and_1_are_exact(xy):
    """1 is an empty side and nothing else, 0 a right angle and nothing else; -1 never comes."""
    engine, points = built(xy), xy.tolist()
    for a, b in pairs(len(xy)).tolist():
        values = engine.gamma(a, b)
        if math.isnan(values[0]):
            continue
        turns = {oracles.orient(points[a], points[b], p) for p in points}
        right = sum(
            max(cosines) == 0
            for side in (1, -1)
            if (
                cosines := [
                    -oracles.sign(oracles.dot_and_cross(points[a], points[b], p)[0])
                    for p in points
                    if oracles.orient(points[a], points[b], p) == side
                ]
            )
        )
        assert values.count(1.0) == 2 - len(turns & {1, -1})
        assert values.count(0.0) == right
        assert -1 not in values


# ------------------------------------------------------------------ by hand
def test_all_pairs_on_a_circle_are_delaunay():
    xy = strategies.array(strategies.ON_CIRCLE)
    engine = built(xy)
    assert engine.edges("delaunay").tolist() == pairs(36).tolist()
    diameters = {(a, b) for a, b in pairs(36).tolist() if (xy[a] == -xy[b]).all()}
    assert len(diameters) == 18
    assert rows(engine.edges(gamma0=(0, 0))) == diameters
    engine.insert(0.0, 0.0)
    assert rows(engine.edges("complete")) == rows(pairs(37)) - diameters


def test_grid():
    """Both diagonals of a square are in; a point between two others is between them in all."""
    engine = built(GRID)
    sides = {(a, b) for a, b in pairs(9).tolist() if abs(GRID[a] - GRID[b]).sum() == 1}
    diagonals = {(a, b) for a, b in pairs(9).tolist() if (abs(GRID[a] - GRID[b]) == 1).all()}
    assert (len(sides), len(diagonals)) == (12, 8)
    assert rows(engine.edges("delaunay")) == rows(engine.edges("gabriel")) == sides | diagonals
    assert rows(engine.edges(("beta_skeleton", 1.5))) == set()
    knights = {(a, b) for a, b in pairs(9).tolist() if abs(GRID[a] - GRID[b]).prod() == 2}
    assert rows(engine.edges("complete")) == sides | diagonals | knights
    hull = {(0, 1), (0, 3), (1, 2), (2, 5), (3, 6), (5, 8), (6, 7), (7, 8)}
    assert rows(engine.edges("hull")) == hull
    assert all(math.isnan(v) for v in engine.gamma(0, 2))
    # (0, 0) and (1, 2): (0, 1) and (1, 1) see them under 135 degrees
    assert engine.gamma(0, 5) == pytest.approx((math.sqrt(0.5) - 1,) * 2, rel=1e-15)


@pytest.mark.parametrize("beta", [1.25, 5 / 4 + 2**-52])
def test_bounds_belong_to_the_skeleton(beta):
    """(0, 2) sees the others under an angle whose sine is 4 / 5."""
    xy = [(-1, 0), (1, 0), (0, 2)]
    assert ((0, 1) in rows(built(xy).edges(("beta_skeleton", beta)))) == (beta == 1.25)


@pytest.mark.parametrize("order", [[2, 0, 3, 1], [0, 1], [0], []])
def test_points_on_a_line(order):
    engine = built([(2.0 * place, place) for place in order])
    neighbours = {(a, b) for a, b in pairs(len(order)).tolist() if abs(order[a] - order[b]) == 1}
    for name in NAMES:
        assert rows(engine.edges(name)) == neighbours
    assert rows(engine.edges(("beta_skeleton", 3))) == neighbours
    assert rows(engine.edges(gamma0=(-1, 0.9))) == set()
    for a, b in pairs(len(order)).tolist():
        expected = (1.0, 1.0) if (a, b) in neighbours else (math.nan, math.nan)
        np.testing.assert_array_equal(engine.gamma(a, b), expected)
        np.testing.assert_array_equal(reference.gamma(engine.points(), a, b), expected)
    assert engine.edges("complete").shape == (len(neighbours), 2)
    assert engine.edges("complete").dtype == np.int64


def test_a_circle_that_is_not_quite_one():
    """Cotangents of 3/4 and -3/4 but for rounding: the sign of gamma1 is that of the exact test."""
    for x, is_edge in ((0.0, True), (1e-30, True), (-1e-30, False)):
        xy = [(-1.5, -2), (-1.5, 0), (-2, -1), (x, 0)]
        gamma0, gamma1 = built(xy).gamma(0, 1)
        assert (gamma0, gamma1) == pytest.approx((-0.2, 0.2) if is_edge else (0.2, -0.2))
        assert gamma0 == -gamma1
        assert reference.gamma(xy, 0, 1) == (gamma0, gamma1)
        assert ((0, 1) in rows(built(xy).edges("delaunay"))) == is_edge


@programs.needs_a_compiler
def test_rows_are_sorted_whatever_the_ids(tmp_path):
    programs.passes("rows.cpp", tmp_path)


# ------------------------------------------------------------------ the border
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "got no graph, expected one of hull, gabriel"),
        ({"graph": "urquhart"}, "got graph 'urquhart', expected one of hull, gabriel"),
        ({"graph": ["hull"]}, r"got graph \['hull'\], expected one of"),
        ({"graph": ("alpha", 1.0)}, r"got graph \('alpha', 1.0\), expected one of"),
        ({"graph": ("beta_skeleton",)}, r"got graph \('beta_skeleton',\), expected one of"),
        ({"graph": ("beta_skeleton", 0)}, "got beta 0, expected a number greater than 0"),
        ({"graph": ("beta_skeleton", -1.5)}, "got beta -1.5, expected"),
        ({"graph": ("beta_skeleton", math.nan)}, "got beta nan, expected"),
        ({"graph": ("beta_skeleton", "2")}, "got beta '2', expected"),
        ({"graph": "hull", "gamma1": (0, 1)}, "got graph 'hull' and intervals, expected one or"),
        ({"gamma0": (-1.5, 1)}, r"gamma0: got \(-1.5, 1.0\), expected -1 <= low <= high <= 1"),
        ({"gamma1": (0, 1.01)}, r"gamma1: got \(0.0, 1.01\), expected"),
        ({"gamma1": (0.5, 0.4)}, r"gamma1: got \(0.5, 0.4\), expected"),
        ({"gamma0": (math.nan, 1)}, r"gamma0: got \(nan, 1.0\), expected"),
        ({"gamma0": 0.5}, "gamma0: got 0.5, expected two numbers"),
        ({"gamma0": (0, 0.5, 1)}, r"gamma0: got \(0, 0.5, 1\), expected two numbers"),
        ({"gamma0": ("a", 1)}, r"gamma0: got \('a', 1\), expected two numbers"),
    ],
)
def test_what_is_no_graph_is_refused(arguments, message):
    with pytest.raises(fk.InputError, match=message):
        built(GRID).edges(**arguments)


def test_gamma_takes_scalars_and_arrays():
    engine = built(GRID)
    assert all(isinstance(v, float) for v in engine.gamma(0, 1))
    gamma0, gamma1 = engine.gamma([[0], [1]], [2, 4, 5])
    assert gamma0.shape == gamma1.shape == (2, 3)
    for (row, a), (column, b) in product(enumerate((0, 1)), enumerate((2, 4, 5))):
        one = gamma0[row, column], gamma1[row, column]
        np.testing.assert_array_equal(one, engine.gamma(a, b))
    assert engine.gamma([], [])[0].shape == (0,)
    with pytest.raises(fk.InputError, match=r"row 1: got \(4, 4\), expected two different") as seen:
        engine.gamma([0, 4], 4)
    assert seen.value.row == 1
    with pytest.raises(KeyError, match="99"):
        engine.gamma(0, 99)


def test_a_signal_ends_a_long_search():
    engine = built(np.random.default_rng(0).random((6000, 2)))
    before = engine.edges("gabriel").tolist()

    def stop(_number, _frame):
        raise InterruptedError

    old = signal.signal(signal.SIGALRM, stop)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.1)
        with pytest.raises(InterruptedError):
            engine.edges("complete")
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, old)
    engine.check()
    assert engine.edges("gabriel").tolist() == before
