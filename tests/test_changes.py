"""Followers of a boundary: what they are told makes their copy the ring, and is no more than that.

The oracle compares two rings link by link. What was handed out before stays what it was.
"""

from __future__ import annotations

import json
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flintknap as fk
import strategies
from flintknap.smooth import curve as curve_of
from strategies import Points
from test_ring import wavy

SQUARE = np.array([[0, 0], [4, 0], [4, 3], [0, 3]], float)


def runs_between(then: list[int], now: list[int], moved: set[int]) -> list[list[int]] | None:
    """Each run with both its ends, as they come along the ring; None if no vertex stayed."""
    before = dict(zip(then, then[1:] + then[:1], strict=True))
    after = dict(zip(now, now[1:] + now[:1], strict=True))
    changed = {v for v, w in after.items() if before.get(v) != w or v in moved or w in moved}
    starts = [v for v in now if v in changed and now[now.index(v) - 1] not in changed]
    if changed and not starts:
        return None
    runs = [[v] for v in starts]
    for run in runs:
        while run[-1] in changed:
            run.append(after[run[-1]])
    return runs


class Follower:
    """A copy of the ring, brought up to date by nothing but changes."""

    def __init__(self, engine: fk.Engine) -> None:
        self.engine = engine
        self.revision: int | None = None
        self.ids, self.xy = np.zeros(0, np.int64), np.zeros((0, 2))
        self.moved: set[int] = set()  # since it asked last
        self.wholes = 0

    def ask(self) -> fk.Changes:
        then = self.ids.tolist()
        changes = self.engine.changes(self.revision)
        self.ids, self.xy = changes.apply(self.ids, self.xy)
        ring = self.engine.boundary()
        assert self.ids.tolist() == ring.ids.tolist()
        assert self.xy.tobytes() == ring.xy.tobytes()
        now = self.ids.tolist()
        assert changes.revision == self.engine.revision
        assert changes.first == (now[0] if now else -1)
        runs = [[run.after, *run.ids.tolist(), run.before] for run in changes]
        if changes.whole:
            self.wholes += 1
            assert runs == [[-1, *now, -1]]
            assert (changes.left.tolist(), changes.joined.tolist()) == ([], now)
        else:
            assert runs == runs_between(then, now, self.moved)
            assert changes.left.tolist() == sorted(set(then) - set(now))
            assert changes.joined.tolist() == [
                v for _, *fresh, _ in runs for v in fresh if v not in set(then)
            ]
        self.revision, self.moved = changes.revision, set()
        return changes


# ---------------------------------------------------------------------- small sets of all kinds
@settings(deadline=None, max_examples=300)
@given(strategies.histories(30), st.sampled_from([-1.0, -0.3, 0.0]), st.randoms())
def test_copies_follow_every_history(
    history: list[strategies.Operation], d_min: float, random: object
) -> None:
    engine = fk.Engine(d_min)
    ids: list[int] = []
    followers = [Follower(engine) for _ in range(3)]
    kept: list[tuple[fk.Boundary, list[int], bytes]] = []
    chance, choose = random.random, random.randrange  # type: ignore[attr-defined]
    for kind, xy in history:
        if kind in ("one", "batch"):
            ids += np.atleast_1d(engine.insert(xy)).tolist()
        if ids and chance() < 0.3:
            engine.remove(ids.pop(choose(len(ids))))
        if ids and chance() < 0.3:
            row = choose(len(ids))
            place = (choose(9) - 4.0, choose(9) - 4.0)
            was, there = ids[row], engine.find(*place)
            ids[row] = engine.move(was, *place)
            if was == ids[row] != there:
                for follower in followers:
                    follower.moved.add(was)
        if kind == "look":
            engine.edges("hull")
        if chance() < 0.1:
            engine.side(0.0, 0.0)
        if chance() < 0.02:
            engine.clear()
            ids.clear()
        for follower, share in zip(followers, (0.6, 0.2, 0.1), strict=True):
            if chance() < share:
                follower.ask()
        if chance() < 0.2:
            kept.append((engine.boundary(), followers[0].ask() and [], b""))
            kept[-1] = (kept[-1][0], followers[0].ids.tolist(), followers[0].xy.tobytes())
    for follower in followers:
        follower.ask()
    engine.check()
    for boundary, ring, places in kept:
        assert boundary.ids.tolist() == ring
        assert boundary.xy.tobytes() == places


# ---------------------------------------------------------------------- rings of many pieces
@pytest.mark.parametrize("noise", [0.0, 0.001, 0.3])
@pytest.mark.parametrize("together", [1, 5])
def test_copies_follow_large_rings(noise: float, together: int) -> None:
    n, changes = 6000, 200
    points, rng = wavy(n + changes, noise, 3), np.random.default_rng(together)
    engine = fk.Engine()
    engine.insert(points[:n])
    often, seldom = Follower(engine), Follower(engine)
    often.ask(), seldom.ask()
    kept, rings = [], []
    for step in range(n, n + changes):
        if step % 3 == 0:
            engine.insert(*points[step].tolist())
        elif step % 3 == 1:
            engine.remove(int(rng.choice(engine.ids())))
        else:
            moved = int(rng.choice(engine.ids()))
            assert engine.move(moved, *points[step].tolist()) == moved
            often.moved.add(moved), seldom.moved.add(moved)
        if step % together == 0:
            kept.append((engine.boundary(), engine.smooth()))
            often.ask()
            rings.append(often.ids)
        if step % 40 == 0:
            seldom.ask()
            engine.check()
    assert often.wholes == 1
    assert seldom.wholes == 1 or noise > 0.1
    engine.check()
    for (boundary, curve), ring in zip(kept, rings, strict=True):
        assert (boundary.ids == ring).all()
        assert (curve.ids == ring).all()
        assert (curve.control[:, 0] == boundary.xy).all()


def test_the_first_vertex_leaves_and_comes() -> None:
    engine, points = fk.Engine(), wavy(3000, 0.0, 1)
    engine.insert(points)
    follower = Follower(engine)
    for _ in range(30):
        follower.ask()
        engine.remove(int(engine.boundary().ids[0]))
    x = -2.0
    for _ in range(30):
        follower.ask()
        x -= 0.01
        engine.insert(x, 0.0)
    follower.ask()
    assert follower.wholes == 1
    engine.check()


def test_many_at_once_are_told_as_what_they_changed() -> None:
    """The constriction is made from scratch then, but the ring is compared."""
    points = wavy(21_000, 0.0, 2)
    engine = fk.Engine()
    engine.insert(points[:-500])
    follower = Follower(engine)
    follower.ask()
    engine.insert(points[-500:])
    changes = follower.ask()
    assert not changes.whole
    assert 500 <= len(changes.ids) < 4000
    engine.remove(engine.ids()[::2])
    assert follower.ask().whole


# ---------------------------------------------------------------------- what is kept of the past
def test_a_revision_that_is_not_known_is_told_as_a_whole() -> None:
    engine = fk.Engine()
    engine.insert(wavy(3000, 0.0, 4))
    engine.boundary()
    unknown = engine.revision  # nobody had begun to follow
    engine.insert(3.0, 0.0)
    first = engine.changes(unknown)
    assert first.whole
    engine.insert(4.0, 0.0)
    skipped = engine.revision  # nobody asks at this one
    engine.insert(5.0, 0.0)
    assert not engine.changes(first.revision).whole
    assert engine.changes(skipped).whole
    engine.insert(6.0, 0.0)
    engine.boundary()
    asked = engine.revision
    engine.insert(7.0, 0.0)
    assert engine.changes(asked).joined.tolist() == [int(engine.find(7.0, 0.0))]


def test_the_past_is_bounded() -> None:
    points = wavy(6_000, 0.0, 4)
    engines = followed, alone = fk.Engine(), fk.Engine()
    for engine in engines:
        engine.insert(points[:3000])
        engine.side(0.0, 0.0)
    began = followed.changes().revision
    for x, y in points[3000:].tolist():
        for engine in engines:
            there = engine.insert(x, y)
            engine.side(0.0, 0.0)
            engine.remove(int(there))
            engine.side(0.0, 0.0)
    engine.insert(9.0, 9.0)
    assert followed.changes(began).whole
    assert followed._kernel.bytes() - alone._kernel.bytes() < 2 * 16 * (2048 + 3000 // 4)


def test_removals_without_a_question_do_not_pile_up() -> None:
    engine = fk.Engine()
    ids = engine.insert(wavy(30_000, 0.0, 4))
    since = engine.changes().revision
    engine.remove(ids[: 3 * len(ids) // 4])
    changes = engine.changes(since)
    assert changes.whole
    assert len(changes.ids) == len(ids) // 4
    engine.check()


# ---------------------------------------------------------------------- single cases
def test_a_point_between_two_others() -> None:
    engine = fk.Engine()
    engine.insert(SQUARE)
    seen = engine.changes()
    assert seen.whole
    assert seen.ids.tolist() == [0, 3, 2, 1] or seen.ids.tolist() == [0, 1, 2, 3]
    new = engine.insert(2.0, -1.0)
    changes = engine.changes(seen.revision)
    (run,) = changes
    assert (run.after, run.ids.tolist(), run.before) == (0, [new], 1)
    assert run.xy.tolist() == [[2.0, -1.0]]
    assert changes.joined.tolist() == [new]
    assert not engine.changes(changes.revision)
    engine.remove(new)
    (run,) = engine.changes(changes.revision)
    assert (run.after, run.ids.tolist(), run.before) == (0, [], 1)
    # Come and gone in between: nothing.
    assert not engine.changes(seen.revision)


def test_an_equal_point_with_another_id_is_another_point() -> None:
    engine = fk.Engine()
    engine.insert(SQUARE)
    since = engine.changes().revision
    engine.remove(2)
    again = engine.insert(*SQUARE[2].tolist())
    changes = engine.changes(since)
    assert (changes.left.tolist(), changes.joined.tolist()) == ([2], [again])
    assert [(run.after, run.ids.tolist(), run.before) for run in changes] == [(1, [again], 3)]


@pytest.mark.parametrize("beside", [False, True])
def test_equal_points_come_back_into_a_large_ring(beside: bool) -> None:
    """Into the slots that they had: no link between slots differs, and yet they are others."""
    engine, points = fk.Engine(), wavy(3020, 0.0, 9)
    engine.insert(points[:3000])
    follower = Follower(engine)
    follower.ask()
    for place in points[3000:].tolist():
        ring = engine.boundary()
        for row in (0, 700, 701, 1500):
            engine.remove(int(ring.ids[row]))
            engine.insert(*ring.xy[row].tolist())
        if beside:
            engine.insert(*place)
        changes = follower.ask()
        assert len(changes.left) == 4
        assert len(changes.joined) == 4 + beside
    assert follower.wholes == 1


def test_a_point_that_moved_has_its_new_place() -> None:
    engine = fk.Engine()
    engine.insert(SQUARE)
    since = engine.changes().revision
    assert engine.move(2, 5.0, 5.0) == 2
    changes = engine.changes(since)
    assert (len(changes.left), len(changes.joined)) == (0, 0)
    (run,) = changes
    assert (run.after, run.ids.tolist(), run.before) == (1, [2], 3)
    assert run.xy.tolist() == [[5.0, 5.0]]


def test_a_ring_that_goes_and_comes_back() -> None:
    engine = fk.Engine()
    follower = Follower(engine)
    assert follower.ask().whole
    assert not follower.ask()
    corners = engine.insert(SQUARE)
    assert follower.ask().whole
    engine.remove(corners[1:])
    assert follower.ask().whole
    assert len(follower.ids) == 0
    engine.clear()
    engine.insert(SQUARE)
    assert follower.ask().whole
    restored = fk.Engine.restored(engine.dump())
    assert not restored.changes(restored.revision)
    assert restored.changes(restored.revision - 1).whole


@pytest.mark.parametrize("since", [-1, 5, 2.0, True, None, "3"])
def test_what_is_no_revision_is_refused(since: object) -> None:
    engine = fk.Engine()
    engine.insert(SQUARE)
    if since is None:
        assert engine.changes(since).whole
        return
    with pytest.raises(fk.InputError, match=f"since: got {since!r}, expected a .*from 0 to 4"):
        engine.changes(since)  # type: ignore[arg-type]


def test_changes_do_not_fit_on_another_ring() -> None:
    engine = fk.Engine()
    engine.insert(SQUARE)
    before, since = engine.boundary(), engine.changes().revision
    engine.insert(2.0, -1.0)
    changes = engine.changes(since)
    for ids in ([0, 2, 3], [], [7, 8, 9]):
        with pytest.raises(fk.InputError, match="ids: got a ring on which these changes do not"):
            changes.apply(ids, np.zeros((len(ids), 2)))
    assert changes.apply(before.ids.tolist(), before.xy.tolist())[0].tolist() == [0, 4, 1, 2, 3]


def test_a_message_to_send_on() -> None:
    engine = fk.Engine()
    engine.insert(SQUARE)
    since = engine.changes().revision
    engine.remove(2)
    engine.insert(2.0, -1.0)
    assert json.loads(engine.changes(since).to_json()) == {
        "revision": 6,
        "whole": False,
        "first": 0,
        "left": [2],
        "joined": [4],
        "runs": [
            {"after": 0, "before": 3, "ids": [4, 1], "xy": [[2.0, -1.0], [4.0, 0.0]]},
        ],
    }
    whole = json.loads(engine.changes().to_json())
    assert whole["runs"][0]["ids"] == engine.boundary().ids.tolist()


# ---------------------------------------------------------------------- what is shared
def test_results_travel() -> None:
    engine = fk.Engine()
    engine.insert(wavy(2000, 0.0, 7))
    boundary, curve = engine.boundary(), engine.smooth()
    engine.insert(3.0, 3.0)
    for each in (boundary, engine.boundary()):
        copy = pickle.loads(pickle.dumps(each))
        assert len(copy) == len(each)
        assert copy.ids.tolist() == each.ids.tolist()
        assert copy.xy.tobytes() == each.xy.tobytes()
        assert (copy.status, copy.d) == (each.status, each.d)
    copy = pickle.loads(pickle.dumps(curve))
    assert copy.control.tobytes() == curve.control.tobytes()
    assert copy.tangents.tobytes() == curve.tangents.tobytes()
    assert copy.ids.tolist() == curve.ids.tolist()


def test_few_tangents_are_made_after_a_change() -> None:
    points: Points = wavy(20_100, 0.0, 8)
    engine = fk.Engine()
    engine.insert(points[:20_000])
    assert engine.smooth()._made.made() == 20_000
    engine.insert(9.0, 0.0)
    assert engine.smooth()._made.made() == 20_001  # from here on it follows
    for x, y in points[20_000:].tolist():
        engine.insert(x, y)
        curve = engine.smooth()
        assert curve._made.made() <= 3 * 512
    polygon = engine.boundary()
    scratch = curve_of(polygon.ids, polygon.xy)
    assert curve.control.tobytes() == scratch.control.tobytes()
    assert curve.kinds.tobytes() == scratch.kinds.tobytes()
