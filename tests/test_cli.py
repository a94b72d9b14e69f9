"""The command: data on standard output, words on standard error, and honest exit codes."""

from __future__ import annotations

import gzip
import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
import termios
from importlib.metadata import version
from pathlib import Path

import pytest
from PIL import Image

from flintknap import animation, commands, layers, log, picture, plot, svg
from flintknap.cli import main
from flintknap.events import Insert, Move, Query, Remove
from flintknap.replay import replay

LOGS = Path(__file__).parents[1] / "replay_logs"
EXPECTED = json.loads((LOGS / "digests.json").read_text())
WINDOWED = json.loads((LOGS / "windowed.json").read_text())
COMMAND = [sys.executable, "-m", "flintknap"]

TRIANGLE = [
    Insert(t=float(i), object="a", x=x, y=y) for i, (x, y) in enumerate([(0, 0), (4, 0), (0, 4)])
]
OUTLINE = [(0, 0), (9, 0), (9, 4), (0, 4), (5, 1), (3, 3), (7, 3), (1, 2), (8, 2), (4, 4)]
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


# ---------------------------------------------------------------------- pictures
def test_layers_are_drawn(run, tmp_path, asked):
    plain, layered = tmp_path / "plain", tmp_path / "layered"
    chosen = "points,boundary,flintstones:1,smooth:tolerance=0.5"
    assert run(asked, "--svg", plain)[0] == 0
    assert run(asked, "--svg", layered, "--layers", chosen)[0] == 0
    engines = replay(asked).engines
    assert plain.read_text() == svg.draw(engines)
    assert layered.read_text() == svg.draw(engines, chosen)
    assert 'class="stones"' in layered.read_text()


@pytest.mark.parametrize(
    ("option", "value", "layer"),
    [("--level", "2", "flintstones:2"), ("--tolerance", "0.5", "flintstones:tolerance=0.5")],
)
def test_a_cut_is_short_for_its_flintstones(run, tmp_path, asked, option, value, layer):
    drawn = tmp_path / "drawn"
    assert run(asked, "--svg", drawn, option, value)[0] == 0
    assert drawn.read_text() == svg.draw(replay(asked).engines, f"{layer},boundary")
    code, _, told = run(asked, "--svg", drawn, option, "x")
    assert code == 2
    assert f"argument {option}: got " in told
    assert run(asked, "--svg", drawn, option, value, "--layers", "boundary")[0] == 2


def test_png_is_the_picture(run, tmp_path, asked):
    assert run(asked, "--png", tmp_path / "it", "--layers", "graph,boundary")[0] == 0
    with Image.open(tmp_path / "it") as image:
        assert image.format == "PNG"
        assert max(image.size) == pytest.approx(commands.PNG_SIZE * 1.04, abs=1)
        assert image.convert("L").getextrema() != (255, 255)


def test_frames_and_gif(run, tmp_path):
    folder, gif = tmp_path / "frames", tmp_path / "it.gif"
    folder.mkdir()  # an empty one is as good as none
    events = [Insert(t=float(i), object="a", x=x, y=y) for i, (x, y) in enumerate(OUTLINE)]
    events.insert(5, Query(t=4.0, object="a", kind="side", x=1.0, y=1.0))
    log.write(tmp_path / "it", events)
    code, out, _ = run(tmp_path / "it", "--gif", gif, "--frames", folder, "--every", "3")
    assert (code, len(out.splitlines())) == (0, 1)
    names = sorted(path.name for path in folder.iterdir())
    assert names == [f"{i:06}.png" for i in range(1, 5)]  # 11 events
    box = picture.compose(replay(events).engines).box
    for count, name in zip((3, 6, 9, 11), names, strict=True):
        seen = picture.compose(replay(events[:count]).engines, box=box)
        assert (folder / name).read_bytes() == plot.png(seen, animation.SIZE)
    with Image.open(gif) as image:
        assert (image.format, image.n_frames) == ("GIF", 4)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["frames", "it", "it.gif"]


def test_a_hundred_frames_or_so_if_nobody_says(tmp_path):
    events = [Insert(t=float(i), object="a", x=float(i), y=-2.0 * i) for i in range(250)]
    events += [Query(t=1.0, object="a", kind="side", x=1e9, y=1e9)]
    events += [Move(t=1.0, object="b", id=0, x=1e6, y=0.0), Insert(t=300.0, object="a", x=9e9, y=0)]
    log.write(tmp_path / "it", events)
    ahead = animation.survey(str(tmp_path / "it"), until=249.0)
    assert [corner.tolist() for corner in ahead.box] == [[0.0, -498.0], [1e6, 0.0]]
    camera = animation.Camera(ahead, None, None, None, None)
    assert (ahead.events, camera.every, camera.frames) == (252, 3, 84)
    ahead = animation.survey(str(tmp_path / "it"), object="b")
    assert [corner.tolist() for corner in ahead.box] == [[1e6, 0.0], [1e6, 0.0]]
    camera = animation.Camera(ahead, 5, None, None, None)
    assert (ahead.events, camera.every, camera.frames) == (1, 5, 1)


def test_frames_of_nothing(run, tmp_path):
    log.write(tmp_path / "it", [])
    assert run(tmp_path / "it", "--frames", tmp_path / "no", "--gif", tmp_path / "gif")[0] == 0
    assert [path.name for path in (tmp_path / "no").iterdir()] == ["000001.png"]
    with Image.open(tmp_path / "gif") as image:
        assert image.n_frames == 1


def test_a_folder_with_something_in_it_is_left_alone(run, tmp_path, asked):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis").write_text("")
    for taken in ("mine", "mine/thesis"):
        code, out, err = run(asked, "--frames", tmp_path / taken)
        assert (code, out) == (1, "")
        assert "expected a new or an empty folder" in err
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["thesis"]


def test_a_bad_log_leaves_no_frames(run, tmp_path, asked):
    good = asked.read_bytes()
    remove = b'{"op":"remove","t":9,"object":"a","id":77}\n'
    for bad in (b"oops\n", remove):  # the one is met before the replay, the other in it
        asked.write_bytes(good + bad)
        code, _, err = run(asked, "--frames", tmp_path / "it", "--gif", tmp_path / "gif")
        assert code == 1
        assert err.startswith(f"flintknap: {asked}:10: ")
        assert [path.name for path in tmp_path.iterdir()] == ["asked.jsonl"]


@pytest.mark.parametrize("kind", ["--svg", "--png", "--gif", "--geojson"])
def test_a_picture_on_standard_output_is_alone_there(kind, asked):
    command = [*COMMAND, "replay", str(asked), kind, "-"]
    done = subprocess.run(command, capture_output=True, check=True)
    start = {"--svg": b"<svg ", "--png": b"\x89PNG", "--gif": b"GIF89a", "--geojson": b"{"}[kind]
    assert done.stdout.startswith(start)
    assert b'"answer"' not in done.stdout
    assert b"8 events in " in done.stderr


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_nobody_reads_the_picture(unbuffered):
    process = subprocess.Popen(
        [
            *COMMAND,
            "replay",
            str(LOGS / "benelux.jsonl.gz"),
            "--svg",
            "-",
            "--layers",
            "graph:d=-1",
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=os.environ | {"PYTHONUNBUFFERED": unbuffered},
    )
    with process:
        assert process.stdout.read(5) == b"<svg "
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == 128 + signal.SIGPIPE


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--layers", "boundary"], "expected one of --svg, --png, --gif, --frames"),
        (["--geojson", "x", "--layers", "boundary"], "expected one of --svg"),
        (["--svg", "x", "--every", "5"], "expected --gif or --frames"),
        (["--gif", "x", "--every", "0"], "got '0', expected an integer, 1 or more"),
        (["--gif", "x", "--every", "2.5"], "got '2.5', expected an integer, 1 or more"),
        (["--svg", "x", "--layers", "stones:4"], "got 'stones:4', expected one of points, graph"),
        (["--svg", "x", "--layers", "smooth:-1"], "a level is an integer, 0 or more"),
        (["--svg", "-", "--json"], "expected nothing else to go to standard output"),
        (["--svg", "-", "--geojson", "-"], "expected nothing else to go to standard output"),
        (["--png", "-", "--collisions"], "expected nothing else to go to standard output"),
        (["--svg", "x", "--level", "4.5"], "a level is an integer, 0 or more"),
    ],
)
def test_pictures_that_cannot_be_meant(run, asked, options, words):
    code, out, err = run(asked, *options)
    assert (code, out) == (2, "")
    assert err.startswith("usage: flintknap ")
    assert words in err
    assert [path.name for path in asked.parent.iterdir()] == ["asked.jsonl"]


def test_what_is_read_twice_is_no_pipe(run):
    code, out, err = run("-", "--gif", "x")
    assert (code, out) == (2, "")
    assert "got - for LOG, expected a file" in err


def test_a_picture_without_matplotlib(tmp_path, asked):
    hidden = "import sys; sys.modules['matplotlib'] = None; from flintknap.cli import main; main()"
    code = hidden.replace("main()", "sys.exit(main(sys.argv[1:]))")
    command = [sys.executable, "-c", code, "replay", str(asked)]
    for kind in ("--png", "--gif", "--frames"):
        done = subprocess.run([*command, kind, tmp_path / "it"], capture_output=True, check=False)
        assert (done.returncode, done.stdout) == (1, b"")
        (line,) = done.stderr.decode().splitlines()
        assert line.startswith("flintknap: got no matplotlib, expected it ")
        assert line.endswith("pip install 'flintknap[plot]'")
        assert [path.name for path in tmp_path.iterdir()] == ["asked.jsonl"]
    assert subprocess.run([*command, "--svg", tmp_path / "it"], check=False).returncode == 0


# ---------------------------------------------------------------------- next to nothing
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
@pytest.mark.parametrize("verb", [None, "replay", "convert", "info", "check"])
def test_help(verb):
    command = [*COMMAND, *([verb] if verb else []), "--help"]
    environment = os.environ | {"COLUMNS": "80"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=True)
    assert done.stderr == ""
    assert done.stdout.startswith(f"usage: flintknap {verb or ''}".rstrip())
    assert "\x1b" not in done.stdout
    assert max(map(len, done.stdout.splitlines())) < 80
    assert "Exit codes: 0;" in done.stdout
    examples = done.stdout.split("\nexamples:\n")[1].split("\n\n")[0].splitlines()
    assert len(examples) >= 2
    assert any(f"flintknap {verb or 'replay'} " in example for example in examples)


def test_the_help_names_every_layer_and_every_option():
    done = subprocess.run(
        [*COMMAND, "replay", "--help"], capture_output=True, text=True, check=True
    )
    listed = done.stdout.split("later ones over earlier ones:")[1]
    for kind in layers.LAYERS:
        assert re.search(rf"^  {kind}(:\w+)? ", listed, re.MULTILINE)
    for graph in layers.NAMED_GRAPHS:
        assert graph in listed


def test_examples_of_the_help_work(tmp_path, asked):
    """All of them that need no other program, as a shell runs them."""
    (tmp_path / "log.jsonl.gz").write_bytes(gzip.compress(asked.read_bytes()))
    (tmp_path / "points.csv").write_text("x,y\n0,0\n3,1\n1,2\n")
    (tmp_path / "points.csv.gz").write_bytes(gzip.compress(b"x,y\n0,0\n3,1\n1,2\n"))
    (tmp_path / "outline.geojson").write_text('{"type":"MultiPoint","coordinates":[[0,0],[1,2]]}')
    tools = tmp_path / "bin"
    tools.mkdir()
    (tools / "flintknap").symlink_to(Path(sys.executable).with_name("flintknap"))
    (tools / "python").symlink_to(sys.executable)
    environment = os.environ | {"PATH": f"{tools}:{os.environ['PATH']}"}
    seen = 0
    for verb in ("replay", "convert", "info", "check"):
        text = subprocess.run(
            [*COMMAND, verb, "--help"], capture_output=True, text=True, check=True
        )
        for example in text.stdout.split("\nexamples:\n")[1].split("\n\n")[0].splitlines():
            if any(
                word in example for word in ("ffmpeg", "tail -f", "survey.parquet", "hull --json")
            ):
                continue
            done = subprocess.run(
                ["bash", "-o", "pipefail", "-c", example],
                cwd=tmp_path,
                env=environment,
                capture_output=True,
                check=False,
            )
            assert done.returncode == 0, (example, done.stderr)
            seen += 1
    assert seen == 13
    assert (tmp_path / "growing.gif").read_bytes().startswith(b"GIF89a")


def test_a_progress_bar_of_frames(tmp_path, asked):
    ours, theirs = pty.openpty()
    termios.tcsetwinsize(theirs, (24, 80))
    command = [*COMMAND, "replay", str(asked), "--gif", str(tmp_path / "gif"), "--every", "2"]
    subprocess.run(command, stdout=subprocess.PIPE, stderr=theirs, check=True)
    os.close(theirs)
    shown = os.read(ours, 1 << 16).decode()
    os.close(ours)
    assert re.search(r"\d/4 \[.*frame", shown)


def test_no_colour_but_on_a_terminal(asked):
    done = subprocess.run(
        [*COMMAND, "replay", str(asked), "--json"], capture_output=True, text=True, check=True
    )
    refused = subprocess.run(
        [*COMMAND, "replay", "--every", "x"], capture_output=True, text=True, check=False
    )
    assert "\x1b" not in done.stdout + done.stderr + refused.stderr
    assert refused.returncode == 2


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
    # In the background of a shell it is ignored, and so would be by what is started there.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    process = subprocess.Popen(
        [*COMMAND, "replay", "-", "--svg", str(tmp_path / "svg")],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={key: value for key, value in os.environ.items() if key != "PYTHONUNBUFFERED"},
    )
    signal.signal(signal.SIGINT, before)
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
