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
from hypothesis import given
from hypothesis import strategies as st

import flintknap as fk
from flintknap import log
from flintknap.events import Answer, Insert, Query
from flintknap.replay import replay

LOGS = Path(__file__).parents[1] / "replay_logs"
EXPECTED = json.loads((LOGS / "digests.json").read_text())
SAMPLES = sorted(path.name for path in LOGS.glob("*.jsonl.gz"))


def read_all(path):
    return list(chain.from_iterable(block.events for block in log.read(path)))


def digests(done):
    return {name: engine.digest() for name, engine in done.engines.items()}


def expected_digests(sample):
    return {name: facts["digest"] for name, facts in EXPECTED[sample].items()}


@pytest.fixture(scope="module")
def make():
    spec = importlib.util.spec_from_file_location("make", LOGS / "make.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


# ---------------------------------------------------------------------- the sample logs
def test_every_sample_has_expectations():
    assert list(EXPECTED) == SAMPLES
    assert len(SAMPLES) == 4
    assert all((LOGS / sample).stat().st_size < 100_000 for sample in SAMPLES)


@pytest.mark.parametrize("sample", SAMPLES)
def test_a_sample_in_its_own_order(make, sample):
    assert make.facts(LOGS / sample) == EXPECTED[sample]


@pytest.mark.parametrize("sample", SAMPLES)
@pytest.mark.parametrize("seed", range(3))
def test_a_sample_in_shuffled_order(sample, seed):
    events = [event for event in read_all(LOGS / sample) if isinstance(event, Insert)]
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
            ask = {"kind": "side", "x": event.x, "y": event.y + 0.5}
            events.append(Query(t=event.t, object=event.object, **ask))
    assert digests(replay(events)) == expected_digests(sample)


@pytest.mark.parametrize(
    ("sample", "name"), [(sample, name) for sample in EXPECTED for name in EXPECTED[sample]]
)
def test_a_sample_by_the_reference(sample, name):
    points = {
        (e.x, e.y) for e in read_all(LOGS / sample) if isinstance(e, Insert) and e.object == name
    }
    assert fk.reference.digest(sorted(points)) == EXPECTED[sample][name]["digest"]


@pytest.mark.parametrize("name", ["sweep", "burst", "grid"])
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


# ---------------------------------------------------------------------- refusals
GOOD = [Insert(t=float(i), object="ab"[i % 2], x=float(i), y=float(i * i)) for i in range(5000)]
BAD_INSERT = Insert(t=0.0, object="a", x=1e61, y=0.0)
BAD_QUERY = Query(t=0.0, object="a", kind="side", x=0.0, y=1e-61)


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
