"""A machine that does everything to an engine, and knows only a set of points.

The model is a dict from places to ids and multiplicities; the judge is the reference. Whatever was
done before, equal sets look equal. A call that fails has changed nothing.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

import flintknap as fk
import strategies
from flintknap import reference

picks = st.integers(0, 2**16)
several = st.lists(picks, min_size=1, max_size=6)
INADMISSIBLE = [np.nan, np.inf, -np.inf, 1e-61, -2e60]


class Machine(RuleBasedStateMachine):
    @initialize(pool=strategies.point_sets(40))
    def begin(self, pool):
        self.engine = fk.Engine()
        self.pool = [(x + 0.0, y + 0.0) for x, y in pool.tolist()] or [(0.0, 0.0)]
        self.ids = {}  # by place, in order of arrival
        self.times = {}  # by id
        self.place = {}  # by id
        self.given = 0  # ids so far
        self.seen = None, np.zeros(0, np.int64), np.zeros((0, 2))  # a follower's revision and ring

    # ------------------------------------------------------------------ the model
    def come(self, place):
        if place not in self.ids:
            self.enter(self.given, place)
            self.given += 1
        self.times[self.ids[place]] += 1
        return self.ids[place]

    def enter(self, point, place):
        self.ids[place], self.place[point], self.times[point] = point, place, 0

    def go(self, point):
        self.times[point] -= 1
        if self.times[point] == 0:
            del self.times[point], self.ids[self.place.pop(point)]

    def known(self, pick):
        """Return an id that is there."""
        return sorted(self.place)[pick % len(self.place)]

    def somewhere(self, pick):
        return self.pool[pick % len(self.pool)]

    # ------------------------------------------------------------------ changes
    @rule(pick=picks)
    def insert_one(self, pick):
        place = self.somewhere(pick)
        assert self.engine.insert(*place) == self.come(place)

    @rule(picks=st.lists(picks, max_size=12))
    def insert_several(self, picks):
        places = [self.somewhere(pick) for pick in picks]
        found = self.engine.insert(strategies.array(places))
        assert found.tolist() == [self.come(place) for place in places]

    @rule(pick=picks, minus=st.booleans())
    def insert_a_zero_of_either_sign(self, pick, minus):
        x, _ = self.somewhere(pick)
        assert self.engine.insert(x, -0.0 if minus else 0.0) == self.come((x, 0.0))

    @precondition(lambda self: self.place)
    @rule(pick=picks)
    def remove_one(self, pick):
        point = self.known(pick)
        self.engine.remove(point)
        self.go(point)

    @precondition(lambda self: self.place)
    @rule(picks=several)
    def remove_several(self, picks):
        points = [p for p in dict.fromkeys(map(self.known, picks)) for _ in range(self.times[p])]
        self.engine.remove(points)
        for point in points:
            self.go(point)

    @precondition(lambda self: len(self.place) > 3)
    @rule(pick=picks)
    def remove_all_but(self, pick):
        kept = self.known(pick)
        points = [p for p in self.place if p != kept for _ in range(self.times[p])]
        self.engine.remove(points)
        for point in points:
            self.go(point)

    @precondition(lambda self: self.place)
    @rule(pick=picks, to=picks)
    def move(self, pick, to):
        point, place = self.known(pick), self.somewhere(to)
        there = self.engine.move(point, *place)
        if self.place[point] == place:
            assert there == point
        elif self.times[point] == 1 and place not in self.ids:
            assert there == point
            self.go(point)
            self.enter(point, place)
            self.times[point] = 1
        else:
            self.go(point)
            assert there == self.come(place)

    @rule()
    def clear(self):
        self.engine.clear()
        self.ids, self.times, self.place = {}, {}, {}

    @rule()
    def pass_through_a_snapshot(self):
        revision = self.engine.revision
        self.engine = fk.Engine.restored(self.engine.dump())
        assert self.engine.revision == revision

    # ------------------------------------------------------------------ refusals
    @rule(picks=several, unknown=st.integers(-3, 2**40), at=picks)
    def remove_an_unknown_id(self, picks, unknown, at):
        if unknown in self.place:
            unknown = self.given
        points = [self.known(pick) for pick in dict.fromkeys(picks)] if self.place else []
        with pytest.raises(KeyError, match=str(unknown)):
            self.engine.remove(unknown)
        with pytest.raises(KeyError, match=str(unknown)):
            self.engine.move(unknown, 1.0, 1.0)
        with pytest.raises(KeyError, match=str(unknown)):
            self.engine.remove([*points[: at % 7], unknown, *points[at % 7 :]])

    @precondition(lambda self: self.given > len(self.place))
    @rule(pick=picks)
    def ids_that_left_are_unknown(self, pick):
        gone = sorted(set(range(self.given)) - set(self.place))
        point = gone[pick % len(gone)]
        for call in (self.engine.remove, self.engine.points, self.engine.multiplicity):
            with pytest.raises(KeyError, match=str(point)):
                call([point])

    @precondition(lambda self: self.place)
    @rule(picks=several)
    def remove_once_too_often(self, picks):
        point = self.known(picks[0])
        others = [p for p in set(map(self.known, picks)) if p != point]
        with pytest.raises(KeyError, match=str(point)):
            self.engine.remove([point] * (self.times[point] + 1) + others)

    @rule(picks=several, bad=st.sampled_from(INADMISSIBLE))
    def insert_what_is_inadmissible(self, picks, bad):
        places = [self.somewhere(pick) for pick in picks]
        with pytest.raises(fk.InputError, match=f"row {len(places)}"):
            self.engine.insert(strategies.array([*places, (1.0, bad)]))
        with pytest.raises(fk.InputError):
            self.engine.insert(bad, 1.0)
        if self.place:
            with pytest.raises(fk.InputError):
                self.engine.move(self.known(picks[0]), 1.0, bad)

    # ------------------------------------------------------------------ questions
    @rule()
    def look(self):
        """Place all points, repair nothing."""
        self.engine.edges("hull")

    @rule(picks=several)
    def ask_for_sides(self, picks):
        ring = reference.widen(self.xy()).ring
        for x, y in map(self.somewhere, picks):
            assert self.engine.side(x, y) == reference.side(self.xy(), ring, x, y)

    @rule()
    def follow(self):
        since, ids, xy = self.seen
        changes = self.engine.changes(since)
        self.seen = changes.revision, *changes.apply(ids, xy)
        assert self.seen[0] == self.engine.revision
        ring = reference.widen(self.xy()).ring
        assert self.seen[1].tolist() == np.array(sorted(self.place), np.int64)[ring].tolist()
        assert self.seen[2].tobytes() == self.xy()[ring].tobytes()

    @rule()
    def ask_for_everything(self):
        self.engine.check()
        xy, ids = self.xy(), np.array(sorted(self.place), np.int64)
        triangles = reference.triangulate(xy)
        expected, boundary = reference.widen(xy, triangles=triangles), self.engine.boundary()
        assert boundary.status == expected.status
        assert boundary.ids.tolist() == ids[expected.ring].tolist()
        assert boundary.inside.tolist() == ids[expected.inside].tolist()
        assert self.engine.triangles().tolist() == ids[triangles].tolist()
        if len(xy) <= 12:
            graph = reference.edges(xy, (-1, 1), (-0.4, 1))
            assert self.engine.edges(gamma1=(-0.4, 1)).tolist() == ids[graph].tolist()
        assert self.engine.digest() == reference.digest(xy)

    def xy(self):
        return strategies.array([self.place[point] for point in sorted(self.place)])

    # ------------------------------------------------------------------ always
    @invariant()
    def the_set_is_that_of_the_model(self):
        if not hasattr(self, "engine"):
            return
        ids = sorted(self.place)
        assert len(self.engine) == len(ids)
        assert self.engine.ids().tolist() == ids
        assert list(map(tuple, self.engine.points().tolist())) == [self.place[i] for i in ids]
        assert self.engine.multiplicity(ids).tolist() == [self.times[i] for i in ids]
        assert self.engine.find(self.pool[0][0], self.pool[0][1]) == self.ids.get(self.pool[0], -1)

    def teardown(self):
        if hasattr(self, "engine"):
            self.ask_for_everything()
            self.remove_to_nothing()

    def remove_to_nothing(self):
        """Asked after every removal."""
        for point in sorted(self.place, key=lambda point: (point * 7919) % 31):
            for _ in range(self.times[point]):
                self.engine.remove(point)
            del self.place[point]
            self.engine.side(0.0, 0.0)
            self.engine.check()
        assert self.engine.digest() == reference.digest(np.zeros((0, 2)))


TestMachine = Machine.TestCase
TestMachine.settings = settings(deadline=None, max_examples=300, stateful_step_count=50)
