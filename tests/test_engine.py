"""The engine as its users meet it: shapes in and out, refusals, threads, interrupts."""

from __future__ import annotations

import ast
import itertools
import signal
import threading
from pathlib import Path

import numpy as np
import pytest
import shapely

import flintknap as fk
from flintknap import _kernel

SQUARE = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)]


@pytest.fixture
def square() -> fk.Engine:
    engine = fk.Engine()
    engine.insert(SQUARE)
    return engine


# ---------------------------------------------------------------- points
def test_ids_count_up_in_order_of_arrival() -> None:
    engine = fk.Engine()
    assert engine.insert(1.0, 2.0) == 0
    assert engine.insert(3, 4) == 1
    assert engine.insert(np.float64(5), np.float64(6)) == 2
    np.testing.assert_array_equal(engine.insert([7.0, 1.0], [8.0, 2.0]), [3, 0])
    np.testing.assert_array_equal(engine.insert([(9.0, 9.0), (5.0, 6.0)]), [4, 2])
    assert len(engine) == 5
    np.testing.assert_array_equal(engine.ids(), range(5))
    np.testing.assert_array_equal(engine.points([4, 0]), [(9, 9), (1, 2)])
    np.testing.assert_array_equal(engine.multiplicity(engine.ids()), [2, 1, 2, 1, 1])
    assert engine.multiplicity(2) == 2


def test_scalars_give_scalars_and_arrays_keep_their_shape(square: fk.Engine) -> None:
    assert type(square.insert(1.0, 1.0)) is int
    assert type(square.side(1.0, 1.0)) is int
    assert type(square.side(1, 1)) is int
    assert type(square.contains(1.0, 1.0)) is bool
    x, y = np.meshgrid(np.arange(5.0), np.arange(3.0))
    side = square.side(x, y)
    assert side.shape == (3, 5)
    assert side.dtype == np.int8
    assert square.side(x[0], 2.0).shape == (5,)
    assert square.contains(x, y).dtype == np.bool_
    assert square.insert(x, y).shape == (3, 5)
    assert square.insert(x, y).dtype == np.int64


def test_a_duplicate_changes_neither_the_set_nor_the_revision(square: fk.Engine) -> None:
    revision, boundary = square.revision, square.boundary()
    assert square.insert(4.0, 0.0) == 1
    assert square.revision == revision
    assert square.boundary() is boundary
    square.insert(2.0, 2.0)
    assert square.revision > revision
    assert square.boundary() is not boundary


def test_removing_and_moving(square: fk.Engine) -> None:
    square.insert(2.0, 1.0)
    square.insert(4.0, 0.0)
    digest, revision = square.digest(), square.revision
    square.remove(1)  # it is there twice
    assert square.multiplicity(1) == 1
    assert (square.digest(), square.revision) == (digest, revision)
    with pytest.raises(KeyError, match="1"):
        square.remove([0, 1, 1])
    assert len(square) == 5
    assert square.move(4, 2.0, 3.0) == 4
    assert square.revision == revision + 1
    np.testing.assert_array_equal(square.boundary().ids, [0, 1, 2, 4, 3])
    assert square.find(2.0, 3.0) == 4
    np.testing.assert_array_equal(square.find([2.0, 0.0], [1.0, -0.0]), [-1, 0])
    assert square.move(4, 0.0, 4.0) == 3  # a point is there already
    assert square.multiplicity(3) == 2
    square.remove([0, 1])
    assert square.boundary().status == "degenerate"
    square.clear()
    assert len(square) == 0
    assert square.insert(1.0, 1.0) == 5
    square.check()


def test_minus_zero_is_zero() -> None:
    engine = fk.Engine()
    assert engine.insert(0.0, 1.0) == engine.insert(-0.0, 1.0)
    assert engine.insert([-0.0], [1.0])[0] == 0
    assert not np.signbit(engine.points()).any()


def test_strided_and_integer_input_is_the_same_set() -> None:
    xy = np.arange(40).reshape(10, 4) ** 2 % 23
    a, b = fk.Engine(), fk.Engine()
    a.insert(xy[::2, 1:3])
    b.insert(xy[::2, 1:3].astype(float).tolist())
    assert a.digest() == b.digest()


def test_empty_input() -> None:
    engine = fk.Engine()
    assert engine.insert([], []).shape == (0,)
    assert engine.insert(np.zeros((0, 2))).shape == (0,)
    assert engine.side([], []).shape == (0,)
    assert engine.boundary().status == "degenerate"


# ---------------------------------------------------------------- refusals
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1.1e60, -1.1e60, 9e-61, 5e-324])
def test_an_inadmissible_coordinate_refuses_the_whole_call(square: fk.Engine, bad: float) -> None:
    digest = square.digest()
    with pytest.raises(fk.InputError, match=r"row 2: got .*expected coordinates") as refused:
        square.insert([1.0, 2.0, bad, bad], [1.0, 2.0, 3.0, 4.0])
    assert refused.value.row == 2
    with pytest.raises(fk.InputError, match=r"row 1: got"):
        square.insert([(1.0, 1.0), (1.0, bad)])
    with pytest.raises(fk.InputError, match=r"y: got .*, expected 0 or a magnitude"):
        square.insert(1.0, bad)
    with pytest.raises(fk.InputError, match=r"x: got"):
        square.side(bad, 1.0)
    with pytest.raises(fk.InputError, match=r"row 1"):
        square.contains([1.0, bad], 1.0)
    assert len(square) == 4
    assert square.digest() == digest


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([1.0, 2.0], [1.0, 2.0, 3.0]), r"got shapes \(2,\) and \(3,\), expected"),
        ((np.zeros((3, 3)),), r"shape \(3, 3\), expected \(n, 2\)"),
        (([1.0, 2.0],), r"shape \(2,\), expected \(n, 2\)"),
        ((["a"], ["b"]), "expected real numbers"),
        (([1j], [1.0]), "expected real numbers"),
        (([[1.0], [1.0, 2.0]], [1.0]), "expected an array of numbers"),
    ],
)
def test_what_is_no_array_of_points_is_refused(arguments: tuple, message: str) -> None:
    with pytest.raises(fk.InputError, match=message):
        fk.Engine().insert(*arguments)


def test_unknown_ids_are_named(square: fk.Engine) -> None:
    for call in (square.points, square.multiplicity, lambda i: square.gamma(0, i)):
        with pytest.raises(KeyError, match="9"):
            call([1, 9, 10])
        with pytest.raises(KeyError, match="-1"):
            call(-1)
    with pytest.raises(fk.InputError, match="integer ids"):
        square.points([0.5])
    for beyond in (-1, 4, 2**63, 10**30):
        with pytest.raises(KeyError, match=str(beyond)):
            square.remove(beyond)
        with pytest.raises(KeyError, match=str(beyond)):
            square.move(beyond, 1.0, 1.0)
    with pytest.raises(KeyError, match=str(2**64 - 1)):
        square.remove(np.array([2**64 - 1], np.uint64))
    with pytest.raises(fk.InputError, match="x: got nan"):
        square.move(0, np.nan, 1.0)
    assert len(square) == 4


def test_the_ends_of_the_range_are_admissible() -> None:
    engine = fk.Engine()
    engine.insert([fk.MIN_MAGNITUDE, fk.MAX_MAGNITUDE, 0.0], [0.0, -fk.MAX_MAGNITUDE, 1.0])
    assert engine.boundary().status == "closed"
    engine.check()


# ---------------------------------------------------------------- the object
def test_boundary_of_a_square_with_a_notch(square: fk.Engine) -> None:
    square.insert(2.0, 1.0)
    boundary = square.boundary()
    assert boundary.status == "closed"
    np.testing.assert_array_equal(boundary.ids, [0, 4, 1, 2, 3])
    np.testing.assert_array_equal(np.asarray(boundary), boundary.xy)
    assert len(boundary) == 5
    assert boundary.d == 0
    assert boundary.area == 14
    assert boundary.length == pytest.approx(12 + 2 * 5**0.5)
    polygon = shapely.geometry.shape(boundary)
    assert polygon.is_valid
    assert polygon.exterior.is_ccw
    assert polygon.area == 14
    with pytest.raises(ValueError, match="read-only"):
        boundary.xy[0] = 1
    assert [square.side(2.0, y) for y in (0.5, 1.0, 1.5)] == [-1, 0, 1]


@pytest.mark.parametrize("count", range(6))
@pytest.mark.parametrize("together", [True, False])
def test_points_on_a_line_have_no_boundary(count: int, together: bool) -> None:
    engine = fk.Engine()
    points = [(float(i), 3.0 * i) for i in (2, 0, 4, 1, 3)][:count]
    if together and points:
        engine.insert(points)
    for x, y in points:
        engine.insert(x, y)
        assert engine.boundary().status == "degenerate"
    boundary = engine.boundary()
    assert len(boundary) == len(boundary.inside) == 0
    assert boundary.area == boundary.length == 0
    assert boundary.__geo_interface__ == {"type": "Polygon", "coordinates": []}
    assert engine.side(0.0, 0.0) == -1
    assert len(engine.triangles()) == 0
    for graph in ("delaunay", "gabriel", "hull"):
        assert len(engine.edges(graph)) == max(0, count - 1)
    if count == 5:
        np.testing.assert_array_equal(engine.edges("hull"), [[0, 3], [0, 4], [1, 3], [2, 4]])
        assert engine.gamma(3, 0) == (1, 1)
        assert np.isnan(engine.gamma(0, 1)).all()
    engine.check()
    engine.insert(0.0, 1.0)
    assert engine.boundary().status == ("closed" if count >= 2 else "degenerate")
    engine.check()


def test_a_locked_constriction_is_reported() -> None:
    rng = np.random.default_rng(8)
    engine = fk.Engine(d_min=0.0)
    engine.insert(rng.random((400, 2)))
    boundary = engine.boundary()
    assert boundary.status == "locked"
    assert len(boundary) + len(boundary.inside) == 400
    assert set(boundary.ids) | set(boundary.inside) == set(range(400))
    hidden = engine.points(boundary.inside)
    assert (engine.side(hidden) == 1).all()
    assert (np.lexsort((hidden[:, 1], hidden[:, 0])) == np.arange(len(hidden))).all()
    assert shapely.Polygon(boundary.xy).is_valid


# ---------------------------------------------------------------- the gamma-graph
def test_gamma_of_known_edges() -> None:
    engine = fk.Engine()
    # an edge that sees a right angle on one side and 60 degrees on the other
    a, b, c, d = engine.insert([-1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -(3**0.5)])
    gamma0, gamma1 = engine.gamma(a, b)
    assert gamma0 == 0
    assert gamma1 == pytest.approx(1 - 3**0.5 / 2, abs=1e-15)
    assert engine.gamma(b, a) == (gamma0, gamma1)
    assert engine.gamma(a, c) == (pytest.approx(1 - 0.5**0.5), 1)
    # no edge: from either side it is seen under 45 + 60 degrees
    assert engine.gamma(c, d) == pytest.approx([np.sin(np.radians(105)) - 1] * 2)
    first, second = engine.gamma([a, a], [b, c])
    assert first.shape == second.shape == (2,)


def test_an_obtuse_side_has_negative_gamma() -> None:
    engine = fk.Engine()
    ids = engine.insert([-1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.5, -3.0])
    gamma0, gamma1 = engine.gamma(ids[0], ids[1])
    # at (0, 1/2) the edge is seen under 2 atan 2, whose sine is 4/5; at (0, -3) under
    # 2 atan 1/3, whose sine is 3/5
    assert gamma0 == pytest.approx(-0.2)
    assert gamma1 == pytest.approx(0.4)


def test_named_graphs_are_nested() -> None:
    engine = fk.Engine()
    engine.insert(np.random.default_rng(4).random((300, 2)))
    named = {
        g: {tuple(e) for e in engine.edges(g).tolist()} for g in ("delaunay", "gabriel", "hull")
    }
    assert named["gabriel"] < named["delaunay"]
    assert named["hull"] < named["delaunay"]
    edges = engine.edges("delaunay")
    assert len(edges) == 3 * 300 - 3 - len(named["hull"])
    assert (edges[:, 0] < edges[:, 1]).all()
    assert edges.tolist() == sorted(edges.tolist())
    gamma0, gamma1 = engine.gamma(edges[:, 0], edges[:, 1])
    assert (np.abs(gamma0) <= np.abs(gamma1)).all()
    assert (gamma1 >= 0).all()
    assert named["gabriel"] == {tuple(e) for e in edges[gamma0 >= 0].tolist()}
    assert named["hull"] == {tuple(e) for e in edges[gamma1 == 1].tolist()}


# ---------------------------------------------------------------- laws
def test_every_order_of_a_degenerate_set_ends_the_same() -> None:
    points = [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 2)]
    seen = set()
    for order in itertools.permutations(points):
        engine = fk.Engine()
        for x, y in order:
            engine.insert(x, y)
            engine.side(1.0, 0.5)
        seen.add((engine.digest(), engine.points()[engine.triangles()].tobytes()))
        engine.check()
    assert len({digest for digest, _ in seen}) == 1


def test_queries_do_not_change_what_later_queries_see() -> None:
    points = np.random.default_rng(11).random((200, 2))
    asked, silent = fk.Engine(), fk.Engine()
    for x, y in points.tolist():
        asked.insert(x, y)
        asked.side(0.5, 0.5)
        asked.edges("hull")
    silent.insert(points)
    np.testing.assert_array_equal(asked.boundary().ids, silent.boundary().ids)
    assert asked.digest() == silent.digest()


def test_two_engines_in_two_threads_do_not_disturb_each_other() -> None:
    sets = [np.random.default_rng(seed).random((20_000, 2)) for seed in range(4)]
    digests = [""] * len(sets)

    def work(n: int) -> None:
        engine = fk.Engine()
        for part in np.array_split(sets[n], 10):
            engine.insert(part)
            engine.side(part)
        digests[n] = engine.digest()

    threads = [threading.Thread(target=work, args=(n,)) for n in range(len(sets))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for points, digest in zip(sets, digests, strict=True):
        engine = fk.Engine()
        engine.insert(points)
        assert engine.digest() == digest


def test_threads_that_share_an_engine_take_turns() -> None:
    points = np.random.default_rng(5).random((8_000, 2))
    engine = fk.Engine()

    def work(part: np.ndarray) -> None:
        for some in np.array_split(part, 20):
            engine.insert(some)
            engine.side(some)

    threads = [threading.Thread(target=work, args=(points[n::4],)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    engine.check()
    other = fk.Engine()
    other.insert(points)
    assert engine.digest() == other.digest()


def test_an_interrupt_leaves_a_usable_engine() -> None:
    points = np.random.default_rng(6).random((300_000, 2))
    engine = fk.Engine()
    engine.insert(points)

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.01)
        with pytest.raises(KeyboardInterrupt):
            engine.boundary()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert len(engine) == 300_000
    engine.insert(2.0, 2.0)
    other = fk.Engine()
    other.insert(np.vstack((points, [(2.0, 2.0)])))
    assert engine.digest() == other.digest()
    engine.check()


def test_kernel_and_its_typed_face_name_the_same_things() -> None:
    stub = ast.parse((Path(fk.__file__).parent / "_kernel.pyi").read_text())
    functions = {n.name for n in stub.body if isinstance(n, ast.FunctionDef)}
    values = {ast.unparse(n.target) for n in stub.body if isinstance(n, ast.AnnAssign)}
    classes = {n.name: n for n in stub.body if isinstance(n, ast.ClassDef)}
    actual = {n for n in vars(_kernel) if not n.startswith("_")}
    assert functions | values | set(classes) == actual
    methods = {n.name for n in classes["Kernel"].body if isinstance(n, ast.FunctionDef)}
    there = {n for n in vars(_kernel.Kernel) if not n.startswith("_")}
    assert {m for m in methods if not m.startswith("_")} == there
