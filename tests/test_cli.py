"""The command: data on standard output, words on standard error, and honest exit codes."""

from __future__ import annotations

import gzip
import json
import os
import pty
import select
import signal
import subprocess
import sys
import termios
from importlib.metadata import version
from pathlib import Path

import pytest

from flintknap import export, log
from flintknap.cli import main
from flintknap.events import Insert, Query, Remove
from flintknap.replay import replay

LOGS = Path(__file__).parents[1] / "replay_logs"
EXPECTED = json.loads((LOGS / "digests.json").read_text())
WINDOWED = json.loads((LOGS / "windowed.json").read_text())
COMMAND = [sys.executable, "-m", "flintknap"]

TRIANGLE = [
    Insert(t=float(i), object="a", x=x, y=y) for i, (x, y) in enumerate([(0, 0), (4, 0), (0, 4)])
]
ASKED = [
    *TRIANGLE,
    Query(t=3.0, object="a", kind="side", x=1.0, y=1.0),
    Insert(t=4.0, object="b", x=0.5, y=0.5),
    Query(t=5.0, object="a", kind="contains", x=9.0, y=9.0),
    Insert(t=6.0, object="a", x=0.1, y=0.1),
    Query(t=7.0, object="a", kind="side", x=0.1, y=0.01),
]


@pytest.fixture
def asked(tmp_path):
    log.write(tmp_path / "asked.jsonl", ASKED)
    return tmp_path / "asked.jsonl"


@pytest.fixture
def run(capfd):
    """Run the command in this process: (exit code, standard output, standard error)."""

    def run(*arguments):
        try:
            code = main(["replay", *map(str, arguments)])
        except SystemExit as left:
            code = left.code
        return code, *capfd.readouterr()

    return run


# ---------------------------------------------------------------------- what it says
@pytest.mark.parametrize("sample", EXPECTED)
def test_summary_as_json(run, sample):
    code, out, err = run(LOGS / sample, "--json")
    assert (code, err) == (0, "")
    summary = json.loads(out.splitlines()[-1])
    assert summary["events"] == sum(facts["events"] for facts in EXPECTED[sample].values())
    assert summary["events_per_second"] * summary["seconds"] == pytest.approx(summary["events"])
    assert [facts["object"] for facts in summary["objects"]] == list(EXPECTED[sample])
    for facts in summary["objects"]:
        for key, value in EXPECTED[sample][facts["object"]].items():
            assert facts[key] == value
        assert (facts["area"] > 0) == (facts["length"] > 0) == (facts["status"] != "degenerate")


def test_summary_for_people(run):
    code, out, err = run(LOGS / "burst.jsonl.gz")
    assert code == 0
    head, *rows, speed = err.splitlines()
    assert head.split() == ["object", "events", "points", "status", "vertices", "area", "digest"]
    assert len({len(row) for row in rows}) == 1
    for row, (name, facts) in zip(rows, EXPECTED["burst.jsonl.gz"].items(), strict=True):
        assert row.startswith(f"{name} ")
        assert f" {facts['events']:,} " in row
        assert f" {facts['points']:,} " in row
        assert f" {facts['status']} " in row
        assert f" {facts['vertices']:,} " in row
        assert row.endswith(f" {facts['digest']}")
    assert speed.startswith("3,000 events in ")
    assert speed.endswith(" a second")
    assert len(out.splitlines()) == 177


def test_names_cannot_play_tricks_on_the_terminal(run, tmp_path):
    log.write(tmp_path / "it", [Insert(t=0.0, object="\x1b[31m\n", x=0.0, y=0.0)])
    _, _, err = run(tmp_path / "it")
    assert "\x1b" not in err
    assert len(err.splitlines()) == 3


def test_answers_are_json_lines_in_order(run, asked):
    code, out, err = run(asked)
    assert code == 0
    assert out.splitlines() == [
        '{"t":3.0,"object":"a","kind":"side","x":1.0,"y":1.0,"answer":1}',
        '{"t":5.0,"object":"a","kind":"contains","x":9.0,"y":9.0,"answer":false}',
        '{"t":7.0,"object":"a","kind":"side","x":0.1,"y":0.01,"answer":-1}',
    ]
    assert "8 events in " in err


def test_until_and_object(run, asked):
    _, out, _ = run(asked, "--until", "4", "--json")
    summary = json.loads(out.splitlines()[-1])
    assert [facts["object"] for facts in summary["objects"]] == ["a", "b"]
    assert summary["events"] == 5
    assert len(out.splitlines()) == 2
    _, out, _ = run(asked, "--object", "b", "--json")
    assert [facts["object"] for facts in json.loads(out)["objects"]] == ["b"]


def test_a_window(run):
    code, out, err = run(LOGS / "drift.jsonl.gz", "--window", "60", "--json")
    assert (code, err) == (0, "")
    summary = json.loads(out.splitlines()[-1])
    assert summary["window"] == 60.0
    (facts,) = summary["objects"]
    assert facts.items() >= WINDOWED["drift.jsonl.gz"]["slick"].items()
    _, out, err = run(LOGS / "drift.jsonl.gz", "--window", "60")
    head, row, _ = err.splitlines()
    assert head.split()[:4] == ["object", "events", "expired", "points"]
    assert row.split()[2] == f"{facts['expired']:,}"
    _, out, _ = run(LOGS / "drift.jsonl.gz", "--json")
    summary = json.loads(out.splitlines()[-1])
    assert summary["window"] is None
    assert summary["objects"][0]["expired"] == 0


def test_pictures_and_polygons(run, tmp_path, asked):
    svg, geojson = tmp_path / "it.svg", tmp_path / "it.geojson"
    svg.write_text("old")
    assert run(asked, "--svg", svg, "--geojson", geojson)[0] == 0
    assert svg.read_text().startswith("<svg ")
    assert [f["properties"]["object"] for f in json.loads(geojson.read_text())["features"]] == [
        "a",
        "b",
    ]
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "asked.jsonl",
        "it.geojson",
        "it.svg",
    ]


def test_approximations_are_drawn(run, tmp_path, asked):
    plain, level, adaptive = tmp_path / "plain", tmp_path / "level", tmp_path / "adaptive"
    assert run(asked, "--svg", plain)[0] == 0
    assert run(asked, "--svg", level, "--level", "1")[0] == 0
    assert run(asked, "--svg", adaptive, "--tolerance", "0.5")[0] == 0
    engines = replay(asked).engines
    assert level.read_text() == export.svg(engines, level=1)
    assert adaptive.read_text() == export.svg(engines, tolerance=0.5)
    assert 'class="stones"' in level.read_text()
    assert 'class="stones"' not in plain.read_text()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--level", "2", "--tolerance", "1"], "not allowed with"),
        (["--level", "-1"], "expected an integer, 0 or more"),
        (["--level", "2.5"], "expected an integer, 0 or more"),
        (["--tolerance", "nan"], "expected a number, 0 or more"),
        (["--tolerance=-1"], "expected a number, 0 or more"),
    ],
)
def test_bad_approximations_are_refused(capsys, tmp_path, asked, options, words):
    with pytest.raises(SystemExit) as exit_:
        main(["replay", str(asked), "--svg", str(tmp_path / "it"), *options])
    assert exit_.value.code == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "it").exists()


def test_an_approximation_without_a_picture_is_refused(capsys, asked):
    with pytest.raises(SystemExit) as exit_:
        main(["replay", str(asked), "--level", "2"])
    assert exit_.value.code == 2
    assert "--svg" in capsys.readouterr().err


def test_a_log_without_events(run, tmp_path):
    log.write(tmp_path / "it", [])
    code, out, _ = run(tmp_path / "it", "--json", "--svg", tmp_path / "svg")
    assert code == 0
    assert json.loads(out)["objects"] == []
    assert (tmp_path / "svg").exists()


# ---------------------------------------------------------------------- what it refuses
def test_bad_input_is_one_line_and_leaves_outputs_as_they_were(run, tmp_path, asked):
    with asked.open("ab") as file:
        file.write(b"oops\n")
    svg = tmp_path / "it.svg"
    svg.write_text("old")
    code, out, err = run(asked, "--svg", svg, "--geojson", tmp_path / "new")
    assert (code, out) == (1, "")
    assert err.startswith(f"flintknap: {asked}:10: got 'oops', expected ")
    assert len(err.splitlines()) == 1
    assert svg.read_text() == "old"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["asked.jsonl", "it.svg"]


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--object", "c"], "got no events of object 'c', expected one of: 'a', 'b'"),
        (["--svg", "no/such/folder/it.svg"], "no/such/folder/it.svg"),
        (["--geojson", "."], "'.'"),
    ],
)
def test_what_cannot_be_done_is_said(run, asked, arguments, complaint):
    code, out, err = run(asked, *arguments)
    assert (code, out) == (1, "")  # nothing was answered before it turned out
    assert complaint in err
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize("name", ["nothing", "."])
def test_a_log_that_cannot_be_read(run, tmp_path, name):
    code, out, err = run(tmp_path / name)
    assert (code, out) == (1, "")
    assert str(tmp_path / name).rstrip(".").rstrip("/") in err


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["x", "y"],
        ["x", "--until", "soon"],
        ["x", "--until", "nan"],
        ["x", "--no"],
        *(["x", "--window", bad] for bad in ("0", "-1", "nan", "inf", "1e400", "soon")),
    ],
)
def test_bad_usage(run, arguments):
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert err.startswith("usage: flintknap ")


# ---------------------------------------------------------------------- as a process
def test_version():
    for command in (COMMAND, [str(Path(sys.executable).with_name("flintknap"))]):
        done = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True)
        assert done.stdout == f"flintknap {version('flintknap')}\n"
    assert subprocess.run(COMMAND, capture_output=True, check=False).returncode == 2


@pytest.mark.parametrize("packed", [False, True])
def test_standard_input(packed, asked):
    data = asked.read_bytes()
    done = subprocess.run(
        [*COMMAND, "replay", "-", "--json"],
        input=gzip.compress(data) if packed else data,
        capture_output=True,
        check=True,
    )
    assert done.stderr == b""
    assert json.loads(done.stdout.splitlines()[-1])["events"] == 8
    bad = subprocess.run(
        [*COMMAND, "replay", "-"], input=data + b"?", capture_output=True, check=False
    )
    assert bad.returncode == 1
    assert bad.stderr.startswith(b"flintknap: <stdin>:10: got ")


def test_output_is_utf_8_whatever_the_locale(tmp_path):
    log.write(tmp_path / "it", [Query(t=0.0, object="hülle", kind="side", x=0.0, y=0.0)])
    done = subprocess.run(
        [*COMMAND, "replay", str(tmp_path / "it"), "--json"],
        env=os.environ | {"PYTHONIOENCODING": "ascii", "LC_ALL": "C"},
        capture_output=True,
        check=True,
    )
    assert json.loads(done.stdout.splitlines()[0])["object"] == "hülle"


def test_nobody_reads_the_answers(tmp_path):
    log.write(tmp_path / "it", [Query(t=0.0, kind="side", x=0.0, y=0.0)] * 20000)
    process = subprocess.Popen(
        [*COMMAND, "replay", str(tmp_path / "it"), "--svg", str(tmp_path / "svg")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    with process:
        assert process.stdout.readline().startswith(b'{"t":0.0,')
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == 128 + signal.SIGPIPE
    assert [path.name for path in tmp_path.iterdir()] == ["it"]


def test_ctrl_c_while_a_live_log_is_answered(tmp_path):
    process = subprocess.Popen(
        [*COMMAND, "replay", "-", "--svg", str(tmp_path / "svg")],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={key: value for key, value in os.environ.items() if key != "PYTHONUNBUFFERED"},
    )
    with process:
        process.stdin.write(b'{"format":"flintknap","version":1}\n')
        process.stdin.write(b'{"op":"query","t":0,"kind":"side","x":1,"y":1}\n')
        process.stdin.flush()
        ready, _, _ = select.select([process.stdout], [], [], 20)
        process.send_signal(signal.SIGINT)
        assert ready  # it did not wait for more
        assert process.stdout.readline().endswith(b'"answer":-1}\n')
        assert process.stderr.read() == b""
    assert process.returncode == 128 + signal.SIGINT
    assert list(tmp_path.iterdir()) == []


def test_a_progress_bar_on_a_terminal_only(asked):
    ours, theirs = pty.openpty()
    termios.tcsetwinsize(theirs, (24, 80))
    command = [*COMMAND, "replay", str(asked)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=theirs, check=True)
    os.close(theirs)
    shown = os.read(ours, 1 << 16).decode()
    os.close(ours)
    assert "%|" in shown
    assert "8 events in " in shown
    assert b"%" not in done.stdout
    quiet = subprocess.run(command, capture_output=True, check=True)
    assert b"%" not in quiet.stderr
    assert quiet.stdout == done.stdout


def test_contacts_as_json_lines(run, tmp_path):
    corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]
    events = [Insert(t=1.0, object="b", x=x, y=y) for x, y in corners]
    events += [Insert(t=2.0, object="a", x=x + 0.5, y=y) for x, y in corners]
    events += [Remove(t=3.0, object="a", id=0)]
    log.write(tmp_path / "it", events)
    code, out, _ = run(tmp_path / "it", "--collisions")
    assert code == 0
    assert out.splitlines() == [
        '{"t":2.0,"contact":"begin","objects":["a","b"]}',
        '{"t":3.0,"contact":"end","objects":["a","b"]}',
    ]
    assert run(tmp_path / "it")[1] == ""
