"""Windows: the engine holds what a plain list of events says, in whatever order they arrive."""

from __future__ import annotations

import random
import sys
from collections import Counter
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import flintknap as fk
from flintknap.window import Window

SECONDS = 4.0

times = st.integers(0, 12).map(lambda tick: tick / 2)
places = st.tuples(st.integers(0, 2).map(float), st.integers(0, 2).map(float))
tellings = st.lists(
    st.tuples(st.sampled_from(["insert", "insert", "retract", "advance"]), times, places),
    max_size=40,
)


def held(engine):
    """The places in an engine, with multiplicity."""
    ids = engine.ids()
    return Counter(
        dict(zip(map(tuple, engine.points().tolist()), engine.multiplicity(ids), strict=True))
    )


def tell(window, events):
    for op, t, place in events:
        if op == "advance":
            window.advance(t)
        else:
            getattr(window, op)(t, *place)
        window.check()


def standing(events, seconds=SECONDS):
    """What events leave, from their set alone: for each place, sightings are opening brackets."""
    now = max((t for _, t, _ in events), default=0.0)
    order = {"insert": 0, "retract": 1}
    stacks: dict[tuple[float, float], list[float]] = {}
    for op, t, place in sorted(events, key=lambda e: (e[1], order.get(e[0], 2))):
        stack = stacks.setdefault(place, [])
        if op == "insert":
            stack.append(t)
        elif op == "retract" and stack:
            stack.pop()
    # Reading all of them, expired ones too, and only then looking at their age.
    return Counter(
        place for place, stack in stacks.items() for seen in stack if now - seen < seconds
    )


# ---------------------------------------------------------------------- the set of events decides
@given(tellings, st.randoms(use_true_random=False))
def test_any_order_of_the_same_events_ends_in_the_same_set(events, rng):
    shuffled = events[:]
    rng.shuffle(shuffled)
    for arrival in (events, shuffled, sorted(events, key=lambda e: e[1])):
        window = Window(fk.Engine(), SECONDS)
        tell(window, arrival)
        assert held(window.engine) == standing(events)
        window.engine.check()


@given(tellings, st.integers(0, 40))
def test_it_holds_at_every_moment(events, stop):
    window = Window(fk.Engine(), SECONDS)
    tell(window, events[:stop])
    assert held(window.engine) == standing(events[:stop])


@given(tellings)
def test_removals_in_order_of_time_count_as_the_engine_counts(events):
    """A window that is longer than the log changes nothing."""
    window, engine = Window(fk.Engine(), 1e300), fk.Engine()
    for op, t, place in sorted(events, key=lambda e: (e[1], e[0] == "retract")):
        tell(window, [(op, t, place)])
        if op == "insert":
            assert engine.insert(*place) == window.engine.find(*place)
        elif op == "retract" and engine.find(*place) >= 0:
            engine.remove(engine.find(*place))
    assert held(window.engine) == held(engine)
    assert window.engine.digest() == engine.digest()
    assert window.expired == 0


@given(st.lists(st.tuples(times, places), max_size=40), st.randoms(use_true_random=False))
def test_expired_counts_sightings_in_any_order(sightings, rng):
    now = max((t for t, _ in sightings), default=0.0)
    for _ in range(3):
        window = Window(fk.Engine(), SECONDS)
        tell(window, [("insert", *sighting) for sighting in sightings])
        assert window.expired == sum(now - t >= SECONDS for t, _ in sightings)
        rng.shuffle(sightings)


# ---------------------------------------------------------------------- arrays and ids
@given(st.lists(st.tuples(times, places), min_size=1, max_size=40), st.data())
def test_an_array_is_one_by_one_and_asking_changes_nothing(sightings, data):
    """Ids too: a place that comes back after it had gone has a new one, however it is told."""
    single, batched, asked = (Window(fk.Engine(), SECONDS) for _ in range(3))
    for t, place in sightings:
        got = single.insert(t, *place)
        assert type(got) is int
        assert got == single.engine.find(*place)
        asked.insert(t, *place)
        asked.engine.side(0.5, 0.5)
    rest = sightings
    while rest:
        count = data.draw(st.integers(1, len(rest)))
        t = np.array([t for t, _ in rest[:count]])
        x, y = np.array([place for _, place in rest[:count]]).T
        got = batched.insert(t, x, y)
        assert got.dtype == np.int64
        assert got.tolist() == batched.engine.find(x, y).tolist()
        batched.check()
        rest = rest[count:]
    for window in (batched, asked):
        assert window.engine.ids().tolist() == single.engine.ids().tolist()
        assert window.engine.points().tolist() == single.engine.points().tolist()
        assert (window.now, window.expired) == (single.now, single.expired)


def test_shapes():
    window = Window(fk.Engine(), 10)
    assert window.insert(0, 1, 2) == 0
    assert window.insert(1, [[1, 3], [4, 5]], 2).tolist() == [[0, 1], [2, 3]]
    assert window.insert([1, 2], 9.0, 9.0).tolist() == [4, 4]
    assert window.insert([], [], []).tolist() == []
    window.retract([2, 2, 2], [9.0, 9.0, 7.0], [9.0, 9.0, 7.0])
    assert window.engine.ids().tolist() == [0, 1, 2, 3]


# ---------------------------------------------------------------------- one rule at a time
def test_a_point_stands_while_it_is_younger_than_the_window():
    window = Window(fk.Engine(), 10.0)
    window.insert(0.0, 1.0, 1.0)
    window.advance(np.nextafter(10.0, 0.0))
    assert len(window.engine) == 1
    window.advance(10.0)
    assert len(window.engine) == 0
    assert window.expired == 1


def test_time_never_goes_back_and_the_late_have_expired_on_arrival():
    window = Window(fk.Engine(), 10.0)
    assert window.now == -np.inf
    window.insert(100.0, 0.0, 0.0)
    revision = window.engine.revision
    assert window.insert(90.0, 1.0, 1.0) == -1
    assert (window.now, window.expired) == (100.0, 1)
    assert window.engine.revision == revision
    window.retract(90.0, 0.0, 0.0)
    assert (window.expired, len(window.engine)) == (1, 1)
    assert window.insert(np.nextafter(90.0, 100.0), 1.0, 1.0) == 1
    window.advance(50.0)
    assert window.now == 100.0
    assert len(window.engine) == 2


def test_a_point_seen_twice_leaves_at_its_second_expiry():
    for seen in ([0.0, 5.0], [5.0, 0.0]):
        window = Window(fk.Engine(), 10.0)
        assert window.insert(seen, 1.0, 1.0).tolist() == [0, 0]
        assert window.engine.multiplicity(0) == 2
        window.advance(10.0)
        assert window.engine.multiplicity(0) == 1
        window.advance(15.0)
        assert len(window.engine) == 0


def test_the_newest_always_stands_whatever_its_magnitude():
    window = Window(fk.Engine(), 1e-9)
    for t in (-1e308, -1e20, 0.0, 1e20, 1.7e308):  # differences overflow, and 1e20 + 1e-9 == 1e20
        window.insert(t, t % 7, 1.0)
        assert len(window.engine) == 1
    assert window.expired == 4


def test_minus_zero_is_zero():
    window = Window(fk.Engine(), 10.0)
    window.insert(0.0, -0.0, 0.0)
    window.retract(0.0, 0.0, -0.0)
    assert len(window.engine) == 0


@pytest.mark.parametrize("late", [False, True])
def test_a_retraction_may_come_before_what_it_takes_back(late):
    window = Window(fk.Engine(), 10.0)
    window.retract(2.0, 1.0, 1.0)
    if late:
        window.advance(11.5)
    assert window.insert(1.6, 1.0, 1.0) == -1
    assert window.insert(2.5, 1.0, 1.0) >= 0  # seen after it was retracted


def test_a_late_retraction_takes_back_the_sighting_of_its_time():
    window = Window(fk.Engine(), 10.0)
    window.insert([1.0, 5.0], 1.0, 1.0)
    window.retract(3.0, 1.0, 1.0)  # the one at 1.0
    window.advance(11.0)
    assert len(window.engine) == 1
    window.advance(15.0)
    assert len(window.engine) == 0
    assert window.expired == 1


def test_other_points_of_the_engine_are_left_alone():
    engine = fk.Engine()
    engine.insert([(0.0, 0.0), (9.0, 9.0)])
    window = Window(engine, 10.0)
    window.insert(0.0, [0.0, 1.0], 0.0)
    window.retract(1.0, 9.0, 9.0)
    window.remove(1.0, 1)
    assert window.move(1.0, 1, 5.0, 5.0) == -1
    window.check()
    window.advance(99.0)
    assert held(engine) == {(0.0, 0.0): 1, (9.0, 9.0): 1}


def test_memory_is_that_of_the_window():
    window = Window(fk.Engine(), 10.0)
    for t in range(300):
        window.insert(float(t), float(t % 7), 1.0)
        window.retract(t - 0.5, float(t % 5), 1.0)
    window.check()
    window.advance(1000.0)
    assert not (window._order or window._standing or window._told)


# ---------------------------------------------------------------------- by id
def test_remove_by_id():
    window = Window(fk.Engine(), 10.0)
    window.insert(0.0, [1.0, 2.0, 3.0], 0.0)
    window.remove(1.0, 0)
    window.remove(1.0, [1, 2])
    assert len(window.engine) == 0
    window.remove(1.0, [0, 1, 2])  # they have left: nothing to do
    window.insert(2.0, 4.0, 0.0)
    window.remove(12.0, 3)  # it leaves by its age
    assert window.expired == 1
    window.check()


@given(st.lists(times, min_size=1, max_size=8), st.randoms(use_true_random=False))
def test_of_the_moves_of_a_point_the_latest_wins(moments, rng):
    moments = sorted(set(moments))
    moves = [(t, float(i + 1)) for i, t in enumerate(moments)]
    rng.shuffle(moves)
    window = Window(fk.Engine(), 100.0)
    assert window.insert(-1.0, 0.0, 0.0) == 0
    for t, x in moves:
        assert window.move(t, 0, x, 0.0) == 0
        window.check()
    assert window.engine.points().tolist() == [[float(len(moments)), 0.0]]
    window.advance(moments[-1] + 99.5)
    assert len(window.engine) == 1  # its age is that of its last move
    window.advance(moments[-1] + 100)
    assert len(window.engine) == 0


def test_a_move_is_one_change_and_one_sighting():
    window = Window(fk.Engine(), 10.0)
    window.insert([0.0, 0.0, 1.0], [0.0, 0.0, 5.0], 0.0)
    revision = window.engine.revision
    assert window.move(2.0, 1, 6.0, 0.0) == 1  # keeps its id
    assert window.engine.revision == revision + 1
    assert window.move(2.0, 0, 7.0, 0.0) == 2  # was there twice: one of the two goes
    assert window.move(3.0, 2, 6.0, 0.0) == 1  # where a point is
    assert held(window.engine) == {(0.0, 0.0): 1, (6.0, 0.0): 2}
    window.check()
    window.advance(12.0)
    assert held(window.engine) == {(6.0, 0.0): 1}
    assert window.move(12.5, 1, 6.0, 0.0) == 1  # where it is: seen again
    window.advance(22.0)
    assert held(window.engine) == {(6.0, 0.0): 1}
    assert window.move(22.5, 1, 8.0, 0.0) == -1  # too late
    window.check()


def test_a_move_to_where_a_retraction_waits():
    window = Window(fk.Engine(), 10.0)
    window.insert(0.0, 0.0, 0.0)
    window.retract(5.0, 1.0, 1.0)
    assert window.move(4.0, 0, 1.0, 1.0) == -1
    assert len(window.engine) == 0
    window.check()


@given(
    st.lists(
        st.tuples(st.sampled_from(["insert", "move", "remove"]), st.integers(0, 5), places),
        max_size=40,
    )
)
def test_changes_by_id_in_order_of_time_against_a_list(steps):
    window = Window(fk.Engine(), SECONDS)
    seen: list[tuple[float, tuple[float, float]]] = []
    for t, (op, which, place) in enumerate(steps):
        now = t / 2
        window.advance(now)
        seen = [(then, at) for then, at in seen if now - then < SECONDS]
        ids = window.engine.ids().tolist()
        if op == "insert":
            window.insert(now, *place)
            seen.append((now, place))
        elif ids:
            point = ids[which % len(ids)]
            at = tuple(window.engine.points([point])[0].tolist())
            seen.remove(max(s for s in seen if s[1] == at))
            if op == "move":
                assert window.move(now, point, *place) == window.engine.find(*place)
                seen.append((now, place))
            else:
                window.remove(now, point)
        window.check()
        assert held(window.engine) == Counter(at for _, at in seen)


# ---------------------------------------------------------------------- refusals
@pytest.mark.parametrize("seconds", [0, -1.0, float("nan"), float("inf"), -float("inf")])
def test_a_window_that_is_none(seconds):
    with pytest.raises(fk.InputError, match=r"^seconds: got .*, expected a positive finite"):
        Window(fk.Engine(), seconds)


NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize(
    "call",
    [
        lambda w: w.insert(NAN, 0.0, 0.0),
        lambda w: w.insert(INF, 0.0, 0.0),
        lambda w: w.insert(50.0, NAN, 0.0),
        lambda w: w.insert(50.0, 0.0, 1e61),
        lambda w: w.insert([50.0, NAN], 0.0, 0.0),
        lambda w: w.insert([50.0, 50.0], [0.0, 1e-61], 0.0),
        lambda w: w.insert([50.0, 50.0], [0.0, 1.0, 2.0], 0.0),
        lambda w: w.insert("50", 0.0, 0.0),
        lambda w: w.retract(NAN, 0.0, 0.0),
        lambda w: w.retract(50.0, INF, 0.0),
        lambda w: w.advance(NAN),
        lambda w: w.advance(INF),
        lambda w: w.remove(NAN, 0),
        lambda w: w.remove(50.0, [0.5]),
        lambda w: w.move(-INF, 0, 1.0, 1.0),
        lambda w: w.move(50.0, 0, 1.0, NAN),
    ],
)
def test_bad_input_changes_nothing(call):
    window = Window(fk.Engine(), 10.0)
    window.insert(0.0, [0.0, 1.0], 0.0)
    with pytest.raises(fk.InputError, match=r"got .*, expected "):
        call(window)
    assert (window.now, window.expired, len(window.engine)) == (0.0, 0, 2)
    window.check()


def test_the_row_at_fault():
    window = Window(fk.Engine(), 10.0)
    with pytest.raises(fk.InputError, match=r"^row 2: t: got nan, expected ") as caught:
        window.insert([0.0, 1.0, NAN], 0.0, 0.0)
    assert caught.value.row == 2


@pytest.mark.parametrize("point", [-1, 2, 99])
def test_an_id_that_was_never_given(point):
    window = Window(fk.Engine(), 10.0)
    window.insert(0.0, [0.0, 1.0], 0.0)
    for call in (
        lambda: window.remove(50.0, point),
        lambda: window.remove(50.0, [0, point]),
        lambda: window.move(50.0, point, 5.0, 5.0),
    ):
        with pytest.raises(KeyError) as caught:
            call()
        assert caught.value.args == (point,)
    assert (window.now, len(window.engine)) == (0.0, 2)


def test_check_sees_what_is_broken():
    window = Window(fk.Engine(), 10.0)
    window.insert(0.0, [0.0, 1.0], 0.0)
    window.engine.remove(0)
    with pytest.raises(fk.InvariantError, match=r"0 in the engine, \[0.0\] stand"):
        window.check()


# ---------------------------------------------------------------------- interrupts
class _Interrupts:
    """Raises KeyboardInterrupt at chosen lines of the package and of sortedcontainers."""

    def __init__(self, *lines):
        self.lines = list(lines)  # how many to let pass before each
        self.count = 0

    def __call__(self, frame, event, _argument):
        if not ("flintknap" in frame.f_code.co_filename or "sorted" in frame.f_code.co_filename):
            return None
        if event == "line" and self.lines:
            if self.count == self.lines[0]:
                self.lines.pop(0)
                self.count = 0
                raise KeyboardInterrupt
            self.count += 1
        return self


def interrupted(call, *lines):
    """Whether the call was; whoever traces already goes on afterwards."""
    before = sys.gettrace()
    sys.settrace(_Interrupts(*lines))
    try:
        call()
    except KeyboardInterrupt:
        return True
    finally:
        sys.settrace(before)
    return False


def seen(window):
    events = {t: sorted(events) for t, events in window._order.items()}
    return window.now, window.expired, events, held(window.engine)


def filled():
    window = Window(fk.Engine(), SECONDS)
    window.insert([0.0, 0.5, 0.5, 1.0, 3.0], [0.0, 1.0, 0.0, 2.0, 2.0], 0.0)
    window.retract(3.5, 2.0, 0.0)
    return window


CALLS = {
    "insert one": lambda w: w.insert(4.5, 0.0, 0.0),
    "insert many": lambda w: w.insert([2.0, 4.5, 5.0, 5.0, 0.1], [5.0, 0.0, 6.0, 1.0, 7.0], 0.0),
    "retract": lambda w: w.retract(4.5, 2.0, 0.0),
    "remove": lambda w: w.remove(4.0, [1, 2]),
    "move": lambda w: w.move(4.0, 2, 8.0, 8.0),
    "advance": lambda w: w.advance(4.6),
}


@pytest.mark.parametrize("name", CALLS)
@pytest.mark.parametrize("again", [None, 0, 3, 10, 25])
def test_an_interrupt_leaves_window_and_engine_as_before_the_call(name, again):
    """Or as after it; at whatever line it comes, and if the way back is interrupted, too."""
    call, before, after = CALLS[name], seen(filled()), filled()
    call(after)
    ends = set()
    for line in range(10_000):
        window = filled()
        ended = not interrupted(
            lambda w=window: call(w), *([line] if again is None else [line, again])
        )
        if window._undo is not None:  # the way back was not found to its end
            window.advance(window.now)
        window.check()
        assert seen(window) in (before, seen(after))
        assert not ended or seen(window) == seen(after)
        ends.add(seen(window) == before)
        if ended:
            break
        window.insert([4.0, 9.0], [1.0, 3.0], 3.0)  # it goes on as if nothing had happened
        window.check()
    assert ends == {True, False}


class _OutOfMemory:
    """A kernel that runs out of memory once, after some steps of a change."""

    def __init__(self, kernel, steps):
        self.kernel, self.left = kernel, steps

    def __getattr__(self, name):
        return getattr(self.kernel, name)

    def change(self, steps, point, x, y):
        if self.left is None or len(steps) < self.left:
            return self.kernel.change(steps, point, x, y)
        self.kernel.change(steps[: self.left])
        self.left = None
        raise MemoryError


@pytest.mark.parametrize("name", CALLS)
@pytest.mark.parametrize("steps", range(4))
def test_memory_that_ends_within_a_change_leaves_both_as_before_or_after(name, steps):
    window, after = filled(), filled()
    before = seen(window)
    CALLS[name](after)
    window.engine._kernel = _OutOfMemory(window.engine._kernel, steps)
    with suppress(MemoryError):  # some calls have fewer steps
        CALLS[name](window)
    assert steps > 1 or window.engine._kernel.left is None
    window.check()
    assert seen(window) == (before if steps == 0 else seen(after))
    window.engine.check()


# ---------------------------------------------------------------------- a long feed
def test_a_long_feed_against_the_engine_of_its_end():
    rng = random.Random(5)
    feed = [(t / 10, rng.random(), rng.random()) for t in range(3000)]
    arrival = sorted(feed, key=lambda event: event[0] + 3 * rng.random())
    window = Window(fk.Engine(), 20.0)
    for start in range(0, len(arrival), 100):
        t, x, y = np.array(arrival[start : start + 100]).T
        window.insert(t, x, y)
        window.engine.side(0.5, 0.5)
    window.check()
    window.engine.check()
    engine = fk.Engine()
    for t, x, y in feed:
        if feed[-1][0] - t < 20.0:
            engine.insert(x, y)
    assert len(engine) == 200
    assert window.engine.digest() == engine.digest()
