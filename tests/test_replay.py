"""Replays: every sample log to its digest, in any order; and what replay does with events."""

from __future__ import annotations

import gzip
import importlib.util
import json
import random
from collections import defaultdict
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import UNSET

import flintknap as fk
from flintknap import log
from flintknap.events import Answer, Insert, Move, Query, Remove
from flintknap.replay import replay
from flintknap.window import Window

LOGS = Path(__file__).parents[1] / "replay_logs"
EXPECTED = json.loads((LOGS / "digests.json").read_text())
WINDOWED = json.loads((LOGS / "windowed.json").read_text())
SAMPLES = sorted(path.name for path in LOGS.glob("*.jsonl.gz"))


def read_all(path):
    return list(chain.from_iterable(block.events for block in log.read(path)))


def digests(done):
    return {name: engine.digest() for name, engine in done.engines.items()}


def expected_digests(sample, expected=EXPECTED):
    return {name: facts["digest"] for name, facts in expected[sample].items()}


def changes(sample):
    """A log's events without its queries, each removal or move turned into what it removes."""
    done: dict[str, tuple[fk.Engine, list[tuple[float, float]]]] = {}
    for event in read_all(LOGS / sample):
        engine, there = done.setdefault(event.object, (fk.Engine(), []))
        if isinstance(event, Insert):
            engine.insert(event.x, event.y)
            there.append((event.x, event.y))
        elif not isinstance(event, Query):
            place = getattr(event, "place", None)
            point = event.id if place is None else engine.find(*place)
            there.remove(tuple(engine.points([point])[0].tolist()))
            if isinstance(event, Move):
                engine.move(point, event.x, event.y)
                there.append((event.x, event.y))
            else:
                engine.remove(point)
    return {name: there for name, (_, there) in done.items()}


@pytest.fixture(scope="module")
def make():
    spec = importlib.util.spec_from_file_location("make", LOGS / "make.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


# ---------------------------------------------------------------------- the sample logs
def test_every_sample_has_expectations():
    assert list(EXPECTED) == list(WINDOWED) == SAMPLES
    assert len(SAMPLES) == 5
    assert all((LOGS / sample).stat().st_size < 100_000 for sample in SAMPLES)


@pytest.mark.parametrize("sample", SAMPLES)
def test_a_sample_in_its_own_order(make, sample):
    assert make.facts(LOGS / sample) == EXPECTED[sample]
    assert make.facts(LOGS / sample, make.WINDOW) == WINDOWED[sample]


@pytest.mark.parametrize("sample", SAMPLES)
@pytest.mark.parametrize("seed", range(3))
def test_a_sample_in_shuffled_order(sample, seed):
    events = [
        Insert(t=0.0, object=name, x=x, y=y)
        for name, there in changes(sample).items()
        for x, y in there
    ]
    random.Random(seed).shuffle(events)
    done = replay(events)
    assert digests(done) == expected_digests(sample)
    for engine in done.engines.values():
        engine.check()


@pytest.mark.parametrize("sample", SAMPLES)
def test_a_sample_asked_all_the_time(sample):
    """Queries force the engine to repair its boundary again and again; the set alone decides."""
    events = []
    for event in read_all(LOGS / sample):
        events.append(event)
        if len(events) % 7 == 0:
            ask = {"kind": "side", "x": 0.25 * len(events), "y": 0.5}
            events.append(Query(t=event.t, object=event.object, **ask))
    assert digests(replay(events)) == expected_digests(sample)
    assert digests(replay(events, window=60.0)) == expected_digests(sample, WINDOWED)


@pytest.mark.parametrize(
    ("sample", "name"), [(sample, name) for sample in EXPECTED for name in EXPECTED[sample]]
)
def test_a_sample_by_the_reference(sample, name):
    points = set(changes(sample)[name])
    assert fk.reference.digest(sorted(points)) == EXPECTED[sample][name]["digest"]


@pytest.mark.parametrize("name", ["sweep", "burst", "grid", "drift"])
def test_the_script_makes_the_samples_again(make, tmp_path, name):
    log.write(tmp_path / "again.gz", getattr(make, name)())
    again = gzip.decompress((tmp_path / "again.gz").read_bytes())
    assert again == gzip.decompress((LOGS / f"{name}.jsonl.gz").read_bytes())


# ---------------------------------------------------------------------- answers
def test_answers_are_those_of_an_engine_that_saw_what_came_before():
    answers = []
    replay(LOGS / "burst.jsonl.gz", answer=answers.append)
    expected = []
    before = defaultdict(list)
    for event in read_all(LOGS / "burst.jsonl.gz"):
        if isinstance(event, Insert):
            before[event.object].append((event.x, event.y))
            continue
        engine = fk.Engine()
        engine.insert(np.array(before[event.object]).reshape(-1, 2))
        said = getattr(engine, event.kind)(event.x, event.y)
        expected.append((event.t, event.object, event.kind, event.x, event.y, said))
    got = [(a.t, a.object, a.kind, a.x, a.y, a.answer) for a in answers]
    assert list(map(repr, got)) == list(map(repr, expected))  # repr: True is not 1
    assert {a.answer for a in answers if a.kind == "side"} == {-1, 0, 1}
    assert {a.answer for a in answers if a.kind == "contains"} == {False, True}


def test_an_answer_waits_for_nothing():
    answers = []

    def live():
        for x, y in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)):
            yield Insert(t=0.0, x=x, y=y)
        yield Query(t=0.0, kind="side", x=0.25, y=0.25)
        assert [answer.answer for answer in answers] == [1]
        yield Query(t=0.0, kind="side", x=0.5, y=0.5)
        assert [answer.answer for answer in answers] == [1, 0]

    replay(live(), answer=answers.append)
    assert len(answers) == 2


def test_sides_at_a_level():
    answers = []
    corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)]
    events = [Insert(t=0.0, x=x, y=y) for x, y in corners]
    for level in (UNSET, 0, 1):
        for x, y in ((2.0, 1.0), (9.0, 9.0)):
            events.append(Query(t=1.0, kind="side", x=x, y=y, level=level))
    engine = replay(events, answer=answers.append).engines["object"]
    assert [(a.level, a.answer) for a in answers] == [
        *((UNSET, 1), (UNSET, -1)),
        *((0, 0), (0, -1)),
        *((1, engine.side(2.0, 1.0, level=1)), (1, -1)),
    ]
    assert answers[-2].answer == 1


def test_an_object_asked_before_it_has_points():
    answers = []
    done = replay(
        [
            Insert(t=0.0, object="a", x=0.0, y=0.0),
            Query(t=0.0, object="b", kind="contains", x=0.0, y=0.0),
        ],
        answer=answers.append,
    )
    assert answers == [Answer(t=0.0, object="b", kind="contains", x=0.0, y=0.0, answer=False)]
    assert list(done.engines) == ["a", "b"]
    assert len(done.engines["b"]) == 0


# ---------------------------------------------------------------------- filters
places = st.integers(0, 4).map(float)
objects = st.sampled_from(["a", "b", "c"])
times = st.integers(0, 5).map(float)
events = st.lists(
    st.builds(Insert, t=times, object=objects, x=places, y=places)
    | st.builds(Insert, t=times, object=objects, x=places, y=places)
    | st.builds(Query, t=times, object=objects, kind=st.just("side"), x=places, y=places),
    max_size=60,
)


@given(events, st.none() | times, st.none() | objects)
def test_filters_are_as_if_the_rest_were_not_there(events, until, name):
    kept = [
        event
        for event in events
        if (until is None or event.t <= until) and (name is None or event.object == name)
    ]
    got, expected = [], []
    if name is not None and all(event.object != name for event in events):
        with pytest.raises(fk.InputError, match="got no events of object"):
            replay(events, object=name)
        return
    done = replay(events, until=until, object=name, answer=got.append)
    alone = replay(kept, answer=expected.append)
    assert got == expected
    assert list(digests(done).items()) == list(digests(alone).items())
    assert list(done.events.items()) == list(alone.events.items())
    assert list(done.engines) == list(dict.fromkeys(event.object for event in kept))
    assert sum(done.events.values()) == len(kept)


def test_times_need_not_rise():
    events = [Insert(t=t, x=t, y=0.0) for t in (5.0, 1.0, 9.0, 2.0, 5.0)]
    done = replay(events, until=5.0)
    assert done.engines["object"].points()[:, 0].tolist() == [5.0, 1.0, 2.0]


def test_an_unknown_object_meets_those_that_are_there():
    events = [Insert(t=0.0, object=f"o{i}", x=0.0, y=0.0) for i in range(12)]
    with pytest.raises(fk.InputError, match=r"object 'o', expected one of: 'o0', 'o1', .* 2 more"):
        replay(events, object="o")
    with pytest.raises(fk.InputError, match=r"expected one of: 'o0'$"):
        replay(events[:1], object="o")
    with pytest.raises(fk.InputError, match=r"object 'o', .*none"):
        replay([], object="o")


GOOD = [Insert(t=float(i), object="ab"[i % 2], x=float(i), y=float(i * i)) for i in range(5000)]
BAD_INSERT = Insert(t=0.0, object="a", x=1e61, y=0.0)
BAD_QUERY = Query(t=0.0, object="a", kind="side", x=0.0, y=1e-61)


# ---------------------------------------------------------------------- removals and moves
def test_removals_and_moves():
    events = [
        *[Insert(t=0.0, x=float(x), y=0.0) for x in (0, 1, 1, 2, 3)],
        Remove(t=1.0, x=1.0, y=0.0),
        Remove(t=1.0, id=0),
        Move(t=1.0, id=2, x=7.0, y=7.0),
        Insert(t=1.0, x=0.0, y=0.0),
    ]
    done = replay(events)
    engine = done.engines["object"]
    assert dict(zip(engine.ids().tolist(), map(tuple, engine.points().tolist()), strict=True)) == {
        1: (1.0, 0.0),
        2: (7.0, 7.0),
        3: (3.0, 0.0),
        4: (0.0, 0.0),
    }
    assert engine.multiplicity(1) == 1
    assert done.events == {"object": 9}
    assert done.windows == {}


ABSENT = {
    Remove(t=1.0, object="a", id=2500): "id: got 2500, expected one that is there",
    Remove(t=1.0, object="a", x=0.5, y=0.0): "x, y: got (0.5, 0.0), expected a point that is there",
    Move(t=1.0, object="a", id=2500, x=0.0, y=0.0): "id: got 2500, expected one that is there",
    Remove(t=1.0, object="c", id=0): "id: got 0, expected one that is there",
}


@pytest.mark.parametrize("bad", ABSENT)
@pytest.mark.parametrize("at", [0, 17, 5000])
def test_what_is_not_there_is_refused_with_its_line(tmp_path, bad, at):
    events = [*GOOD[:at], bad, *GOOD[at:], Insert(t=0.0, object="a", x=1e99, y=0.0)]
    log.write(tmp_path / "it.jsonl", events)
    with pytest.raises(fk.LogError) as caught:
        replay(tmp_path / "it.jsonl")
    assert str(caught.value) == f"{tmp_path}/it.jsonl:{at + 2}: {ABSENT[bad]}"
    with pytest.raises(fk.InputError) as caught:
        replay(events, object=bad.object, until=1e6)
    assert str(caught.value) == f"event {at}: {ABSENT[bad]}"
    assert caught.value.row == at


def test_the_second_of_two_equal_removals_is_the_one_at_fault():
    twice = [Remove(t=1.0, object="a", id=0)] * 2
    with pytest.raises(fk.InputError, match=r"^event 3: id: got 0, expected") as caught:
        replay([GOOD[0], GOOD[1], *twice])
    assert caught.value.row == 3


@pytest.mark.parametrize(
    "absent", [Remove(t=0.0, object="b", id=9), Remove(t=0.0, object="b", x=1.0, y=1.0)]
)
def test_an_insert_at_fault_that_waited_comes_before_a_removal(absent):
    with pytest.raises(fk.InputError, match=r"^event 1: x: got 1e\+61"):
        replay([GOOD[0], BAD_INSERT, absent])
    with pytest.raises(fk.InputError, match=r"^event 1: .* expected (one|a point) that is there"):
        replay([GOOD[0], absent, BAD_INSERT])


@pytest.mark.parametrize(
    "bad",
    [
        Remove(t=0.0, object="a", x=1e61, y=0.0),
        Move(t=0.0, object="a", id=0, x=0.0, y=1e-61),
    ],
)
@pytest.mark.parametrize("window", [None, 60.0])
def test_magnitudes_of_removals_and_moves(bad, window):
    with pytest.raises(fk.InputError, match=r"^event 5: [xy]: got ") as caught:
        replay([*GOOD[:5], bad], window=window)
    assert caught.value.row == 5


# ---------------------------------------------------------------------- windows
stamped = st.lists(
    st.builds(Insert, t=times, object=objects, x=places, y=places)
    | st.builds(Insert, t=times, object=objects, x=places, y=places)
    | st.builds(Remove, t=times, object=objects, x=places, y=places)
    | st.builds(Remove, t=times, object=objects, id=st.integers(0, 3))
    | st.builds(Move, t=times, object=objects, id=st.integers(0, 3), x=places, y=places)
    | st.builds(Query, t=times, object=objects, kind=st.just("side"), x=places, y=places),
    max_size=60,
)


@given(stamped, st.sampled_from([1.0, 2.5, 100.0]), st.integers(1, 30))
def test_a_windowed_replay_is_a_window_told_event_by_event(events, seconds, batch):
    """Ids too, however blocks fall."""
    windows: dict[str, Window] = defaultdict(lambda: Window(fk.Engine(), seconds))
    kept, said, answers = [], [], []
    for event in events:
        window = windows[event.object]
        kept.append(event)
        if isinstance(event, Insert):
            window.insert(event.t, event.x, event.y)
        elif isinstance(event, Query):
            window.advance(event.t)
            said.append(window.engine.side(event.x, event.y))
        elif isinstance(event, Remove) and event.place:
            window.retract(event.t, *event.place)
        else:
            try:
                if isinstance(event, Move):
                    window.move(event.t, event.id, event.x, event.y)
                else:
                    window.remove(event.t, event.id)
            except KeyError:
                with pytest.raises(fk.InputError, match=r"expected one that was given$") as caught:
                    replay(kept, window=seconds)
                assert caught.value.row == len(kept) - 1
                kept.pop()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("flintknap.replay.BATCH", batch)
        done = replay(kept, window=seconds, answer=lambda answer: answers.append(answer.answer))
    assert answers == said
    for name, window in done.windows.items():
        window.check()
        assert window.engine is done.engines[name]
        assert window.engine.ids().tolist() == windows[name].engine.ids().tolist()
        assert window.engine.points().tolist() == windows[name].engine.points().tolist()
        assert (window.now, window.expired) == (windows[name].now, windows[name].expired)


def test_a_run_of_inserts_is_one_call(monkeypatch):
    calls = []
    plain = Window.insert
    monkeypatch.setattr(
        Window, "insert", lambda self, *txy: calls.append(np.size(txy[0])) or plain(self, *txy)
    )
    done = replay((Insert(t=i / 10, x=float(i), y=0.0) for i in range(2000)), window=50.0)
    assert calls == [2000]
    assert len(done.engines["object"]) == 500
    assert done.windows["object"].expired == 1500


def test_objects_have_times_of_their_own():
    events = [
        Insert(t=0.0, object="a", x=0.0, y=0.0),
        Insert(t=100.0, object="b", x=0.0, y=0.0),
        Query(t=9.0, object="a", kind="side", x=0.0, y=0.0),
    ]
    assert len(replay(events, window=10.0).engines["a"]) == 1
    events.append(Query(t=10.0, object="a", kind="side", x=0.0, y=0.0))
    assert len(replay(events, window=10.0).engines["a"]) == 0


@pytest.mark.parametrize("window", [0.0, -1.0, float("nan"), float("inf")])
def test_a_bad_window(window):
    with pytest.raises(fk.InputError, match="seconds: got"):
        replay([], window=window)


# ---------------------------------------------------------------------- refusals
@pytest.mark.parametrize("bad", [BAD_INSERT, BAD_QUERY])
@pytest.mark.parametrize("at", [0, 1, 17, 4999])
def test_a_magnitude_out_of_range_is_refused_with_its_line(tmp_path, bad, at):
    events = [*GOOD]
    events[at:at] = [bad]
    events[-1:-1] = [Insert(t=0.0, object="a", x=0.0, y=1e99)]
    log.write(tmp_path / "it.jsonl", events)
    with pytest.raises(fk.LogError) as caught:
        replay(tmp_path / "it.jsonl")
    assert caught.value.line == at + 2
    name = "x" if bad is BAD_INSERT else "y"
    value = getattr(bad, name)
    assert str(caught.value).startswith(f"{tmp_path}/it.jsonl:{at + 2}: {name}: got {value!r}, ")
    with pytest.raises(fk.InputError, match=rf"^event {at}: {name}: got ") as caught:
        replay(events)
    assert caught.value.row == at


def test_the_first_line_at_fault_whichever_engine_sees_it_first(tmp_path):
    events = [
        Insert(t=0.0, object="a", x=0.0, y=0.0),
        Insert(t=0.0, object="b", x=1e99, y=0.0),
        Insert(t=0.0, object="a", x=-1e99, y=0.0),
    ]
    log.write(tmp_path / "it.jsonl", events)
    with pytest.raises(fk.LogError, match=r"it.jsonl:3: x: got 1e\+99, expected "):
        replay(tmp_path / "it.jsonl")


def test_the_line_counts_what_was_passed_over(tmp_path):
    events = [*GOOD[:10], BAD_QUERY, *GOOD[10:]]
    log.write(tmp_path / "it.jsonl", events)
    for filters in ({"object": "a"}, {"until": 0.0}):
        with pytest.raises(fk.LogError, match=r"it.jsonl:12: y: got 1e-61, expected "):
            replay(tmp_path / "it.jsonl", **filters)
        with pytest.raises(fk.InputError, match=r"^event 10: y: got 1e-61, expected "):
            replay(events, **filters)


@pytest.mark.parametrize("bad", [BAD_INSERT, BAD_QUERY])
def test_magnitudes_passed_over_are_not_asked(bad):
    assert replay([*GOOD, bad], object="b").events == {"b": 2500}
    assert replay([GOOD[0], bad], until=-1.0).events == {}


def test_a_refusal_by_the_callback_is_its_own():
    def refuse(_):
        raise fk.InputError("enough")

    with pytest.raises(fk.InputError, match=r"^enough$"):
        replay([Query(t=0.0, kind="side", x=0.0, y=0.0)], answer=refuse)


# ---------------------------------------------------------------------- progress
def test_progress_rises_to_the_size_of_the_file(tmp_path):
    for name in ("it.jsonl", "it.jsonl.gz"):
        log.write(tmp_path / name, GOOD)
        seen = []
        replay(tmp_path / name, progress=seen.append)
        assert len(seen) > 1
        assert seen == sorted(seen)
        assert seen[-1] == (tmp_path / name).stat().st_size
    seen = []
    replay(iter(GOOD), progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == len(GOOD)


# ---------------------------------------------------------------------- frames
@settings(deadline=None)  # a replay for each frame
@given(
    stamped.map(lambda them: [e for e in them if isinstance(e, Insert | Query)]),
    st.integers(1, 70),
    st.none() | times,
    st.none() | st.sampled_from([1.0, 2.5]),
)
def test_frames_show_what_events_so_far_have_made(events, every, until, window):
    kept = [event for event in events if until is None or event.t <= until]
    seen, answers, expected = [], [], []

    def frame(engines):
        seen.append({name: engine.digest() for name, engine in engines.items()})

    done = replay(
        events, until=until, window=window, every=every, frame=frame, answer=answers.append
    )
    ends = [*range(every, len(kept) + 1, every)]
    if len(kept) % every:
        ends.append(len(kept))
    assert seen == [digests(replay(kept[:end], window=window)) for end in ends]
    whole = replay(kept, window=window, answer=expected.append)
    assert digests(done) == digests(whole)
    assert done.events == whole.events
    assert answers == expected


def test_frames_do_not_move_lines(tmp_path):
    log.write(tmp_path / "it", GOOD)
    with (tmp_path / "it").open("ab") as file:
        file.write(b'{"op":"remove","t":0,"id":123456789}\n')
    for every in (1, 7, 2000):
        with pytest.raises(fk.LogError) as caught:
            replay(tmp_path / "it", every=every)
        assert caught.value.line == len(GOOD) + 2


@pytest.mark.parametrize("every", [0, -3])
def test_bad_frames(every):
    with pytest.raises(fk.InputError, match=rf"^every: got {every}, expected 1 or more$"):
        replay([], every=every)
