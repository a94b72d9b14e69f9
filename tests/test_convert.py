"""`flintknap convert | info | check`: points of other formats, and what a log holds; processes."""

from __future__ import annotations

import gzip
import io
import json
import os
import pty
import subprocess
import sys
import termios
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from pyarrow import feather, ipc, parquet

import flintknap as fk
from flintknap import cli, commands, convert, export, log
from flintknap.convert import format_of
from flintknap.events import Insert, Move, Query, Remove

LOGS = Path(__file__).parents[1] / "replay_logs"
COMMAND = [sys.executable, "-m", "flintknap"]
CSV = "x,y,t,object\n1.5,2,0.25,a\n-3,4e-5,7,b\n"
READ = [
    Insert(t=0.25, object="a", x=1.5, y=2.0),
    Insert(t=7.0, object="b", x=-3.0, y=4e-5),
]
doubles = st.floats(-1e60, 1e60).filter(lambda v: v == 0 or abs(v) >= 1e-60)


def run(*arguments, **options):
    """Run the command as a process: (exit code, standard output, standard error)."""
    data = options.pop("input", b"")
    done = subprocess.run(
        [*COMMAND, *map(str, arguments)], input=data, capture_output=True, check=False, **options
    )
    return done.returncode, done.stdout.decode(), done.stderr.decode()


def events(path):
    return [event for block in log.read(path) for event in block.events]


@pytest.fixture
def put(tmp_path):
    """Write a file and return the points it is read as."""

    def put(file, content, **options):
        path = tmp_path / file
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return list(convert.read(path, **options))

    return put


def refusal(put, name, content):
    """What is said of a file, without the folder it is in."""
    with pytest.raises(fk.InputError) as error:
        put(name, content)
    return str(error.value)[str(error.value).index(name) :]


def places(inserts):
    return [(insert.x, insert.y) for insert in inserts]


# ---------------------------------------------------------------------- tables
def test_csv(put):
    assert put("it.csv", CSV) == READ
    assert put("it.csv", "y,x\r\n2,1\r\n") == [Insert(t=0.0, x=1.0, y=2.0)]
    assert put("it.csv", "\ufeffx,y\n1,2", name="hull") == [Insert(t=0.0, object="hull", x=1, y=2)]
    assert put("it.csv", 'object,x,y\n"a,\n""b""",1,2\n')[0].object == 'a,\n"b"'
    assert put("it.csv.gz", gzip.compress(CSV.encode())) == READ
    assert put("it.csv", gzip.compress(CSV.encode())) == READ  # content decides
    assert put("it.csv", "x,y\n") == []


@given(st.lists(st.tuples(doubles, doubles)))
def test_csv_numbers_are_read_exactly(points):
    text = "x,y\n" + "".join(f"{x!r},{y!r}\n" for x, y in points)
    read = convert._csv(io.StringIO(text), "it", "object")
    assert np.array(places(read)).tobytes() == np.array(points).tobytes()


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "1: got columns '', expected columns x, y and perhaps t and object"),
        ("1,2\n3,4\n", "1: got columns '1,2', expected columns x, y"),
        ("x;y\n", "1: got columns 'x;y', expected"),
        ("x,y,z\n", "1: got columns 'x,y,z', expected"),
        ("x,y,x\n", "1: got columns 'x,y,x', expected"),
        ("x,y\n1,2\n3\n", "3: got 1 fields, expected 2 fields"),
        ("x,y\n1,2,3\n", "2: got 3 fields, expected 2 fields"),
        ("x,y\n1,2\n\n3,4\n", "3: got a blank line, expected 2 fields"),
        ("x,y\n1,east\n", "2: y: got 'east', expected a number"),
        ("x,y\n1_0,2\n", "2: x: got '1_0', expected a number"),
        ("x,y\n,2\n", "2: x: got '', expected a number"),
        ("x,y\nnan,2\n", "2: x: got nan, expected 0 or a magnitude from 1e-60 to 1e+60"),
        ("x,y\n1,1e61\n", "2: y: got 1e+61, expected 0 or a magnitude"),
        ("x,y,t\n1,2,inf\n", "2: t: got inf, expected a finite number"),
        ('x,y\n1,"2\n', "2: got unexpected end of data, expected CSV"),
    ],
)
def test_bad_csv(put, text, complaint):
    assert refusal(put, "it.csv", text).startswith(f"it.csv:{complaint}")


def test_text_that_is_damaged(put):
    assert refusal(put, "it.csv", b"x,y\n\xff,1\n").endswith("expected UTF-8")
    cut = gzip.compress(CSV.encode())[:-8]
    assert "got damaged gzip data" in refusal(put, "it.csv.gz", cut)


def table(**columns):
    return pa.table(columns)


@pytest.mark.parametrize(
    ("name", "write"),
    [
        ("it.parquet", parquet.write_table),
        ("it.feather", feather.write_feather),
        ("it.arrow", lambda t, path: _ipc(t, path, ipc.new_stream)),
        ("it.arrow", lambda t, path: _ipc(t, path, ipc.new_file)),
    ],
)
def test_parquet_and_arrow(tmp_path, name, write):
    path = tmp_path / name
    write(table(x=[1.5, -3.0], y=[2.0, 4e-5], t=[0.25, 7], object=["a", "b"]), path)
    assert list(convert.read(path)) == READ
    write(table(y=[1], x=pa.array([2], pa.float32())), path)
    assert list(convert.read(path, name="c")) == [Insert(t=0.0, object="c", x=2.0, y=1.0)]
    code, out, _ = run("convert", "-", "-", "--from", format_of(path), input=path.read_bytes())
    assert code == 0
    assert json.loads(out.splitlines()[1])["x"] == 2.0
    for bad, complaint in [
        (table(x=[1.0], z=[2.0]), "got columns 'x,z', expected columns x, y"),
        (table(x=["1"], y=[2.0]), "x: got values of type string, expected real numbers"),
        (table(x=[1.0, None], y=[2.0, 3.0]), "row 1: got an empty field, expected a number"),
        (table(x=[1.0, 2.0], y=[2.0, np.inf]), "row 1: y: got inf, expected 0 or a magnitude"),
        (table(x=[1.0], y=[2.0], object=[None]), "row 0: object: got None, expected a string"),
    ]:
        write(bad, path)
        with pytest.raises(fk.InputError) as error:
            list(convert.read(path))
        assert f"{path}: {complaint}" in str(error.value)


def _ipc(data, path, make):
    with path.open("wb") as file, make(file, data.schema) as writer:
        writer.write_table(data)


def test_what_is_no_table(put):
    for name in ("it.parquet", "it.arrow"):
        assert refusal(put, name, b"oops")


def test_without_pyarrow(tmp_path):
    parquet.write_table(table(x=[1.0], y=[2.0]), tmp_path / "it.parquet")
    code = (
        "import sys; sys.modules['pyarrow'] = None\n"
        f"from flintknap.cli import main; sys.exit(main(['convert', {str(tmp_path)!r} + "
        "'/it.parquet', '-']))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)
    assert done.returncode == 1
    assert b"expected pyarrow to read it: pip install 'flintknap[arrow]'" in done.stderr


# ---------------------------------------------------------------------- geometries
SHAPES = [
    shapely.Point(1, 2),
    shapely.Point(),
    shapely.MultiPoint([(1, 2), (3, 4)]),
    shapely.LineString([(1, 2), (3, 4), (1, 2)]),
    shapely.LinearRing([(1, 2), (3, 4), (5, 9)]),
    shapely.MultiLineString([[(1, 2), (3, 4)], [(5, 6), (7, 8.5)]]),
    shapely.Polygon([(0, 0), (9, 0), (9, 9)], [[(2, 1), (8, 7), (8, 1)]]),
    shapely.MultiPolygon([shapely.box(0, 0, 1, 1), shapely.box(5, 5, 6, 6)]),
    shapely.Polygon(),
    shapely.GeometryCollection([shapely.Point(1, 2), shapely.LineString([(1, 2), (3, 4)])]),
]


def vertices(shape):
    """Its vertices in order, rings without their last one."""
    if hasattr(shape, "geoms"):
        return [vertex for part in shape.geoms for vertex in vertices(part)]
    if shape.geom_type == "Polygon":
        rings = [shape.exterior, *shape.interiors] if not shape.is_empty else []
        return [vertex for ring in rings for vertex in ring.coords[:-1]]
    return list(shape.coords)


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.geom_type)
def test_vertices_of_any_geometry(put, shape):
    expected = vertices(shape)
    assert places(put("it.geojson", shapely.to_geojson(shape))) == expected
    if shape.geom_type != "LinearRing":
        assert places(put("it.wkt", shapely.to_wkt(shape))) == expected
        assert places(put("it.wkt", shapely.to_wkt(shape).lower() + "\n")) == expected


@given(st.lists(st.tuples(doubles, doubles), min_size=3, unique=True))
def test_numbers_of_geometries_are_read_exactly(points):
    text = ", ".join(f"{x!r} {y!r}" for x, y in points)
    read = list(convert._wkt(io.StringIO(f"MULTIPOINT ({text})"), "it", "object"))
    assert np.array(places(read)).tobytes() == np.array(points).tobytes()
    document = json.dumps({"type": "MultiPoint", "coordinates": points})
    read = list(convert._geojson(io.StringIO(document), "it", "object"))
    assert np.array(places(read)).tobytes() == np.array(points).tobytes()


def test_what_is_exported_comes_back(put):
    engine = fk.Engine()
    engine.insert(np.random.default_rng(2).normal(size=(50, 2)))
    boundary = engine.boundary()
    got = put("it.geojson", export.geojson({"hull": engine}))
    assert places(got) == [tuple(v) for v in boundary.xy.tolist()]
    assert {insert.object for insert in got} == {"hull"}
    assert places(put("it.wkt", boundary.to_wkt())) == places(got)


def test_features_tell_their_object_and_time(put):
    point = {"type": "Point", "coordinates": [1, 2]}
    features = [
        {"type": "Feature", "properties": {"object": "a", "t": 3, "colour": "red"}},
        {"type": "Feature", "properties": None},
        {"type": "Feature", "properties": {}},
    ]
    collection = {
        "type": "FeatureCollection",
        "features": [f | {"geometry": point} for f in features],
    }
    collection["features"].append({"type": "Feature", "properties": {}, "geometry": None})
    got = put("it.json", json.dumps(collection), name="other")
    assert [(i.object, i.t) for i in got] == [("a", 3.0), ("other", 0.0), ("other", 0.0)]


@pytest.mark.parametrize(
    ("document", "complaint"),
    [
        ('{"type":\n oops', "it.json:2: got Expecting value, expected GeoJSON"),
        ("[]", "it.json: $: got [], expected a GeoJSON object of a known type"),
        ('{"type": "Circle"}', "it.json: $: got 'Circle', expected a GeoJSON object"),
        ('{"type": "Point"}', "it.json: $.coordinates: got None, expected a list"),
        (
            '{"type": "LineString", "coordinates": [[1, 2], [3, 4, 5]]}',
            "it.json: $.coordinates[1]: got [3, 4, 5], expected two numbers, x and y",
        ),
        (
            '{"type": "Polygon", "coordinates": [[[1, 2], [3, true]]]}',
            "it.json: $.coordinates[0][1]: got [3, True], expected two numbers",
        ),
        (
            '{"type": "MultiPoint", "coordinates": [[1, 1e400]]}',
            "it.json: $.coordinates[0]: y: got inf, expected 0 or a magnitude",
        ),
        (
            '{"type": "Feature", "properties": {"t": "noon"}, "geometry": '
            '{"type": "Point", "coordinates": [1, 2]}}',
            "it.json: $.geometry: t: got 'noon', expected a number",
        ),
        (
            '{"type": "Feature", "properties": {"object": 7}, "geometry": '
            '{"type": "Point", "coordinates": [1, 2]}}',
            "it.json: $.geometry.coordinates: object: got 7, expected a string",
        ),
        ("[" * 100000, "it.json: got JSON that is nested too deeply"),
    ],
)
def test_bad_geojson(put, document, complaint):
    assert refusal(put, "it.json", document).startswith(complaint)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("POINT (1 2)\nCIRCLE (1 2)", "it.wkt:2: got 'CIRCLE', expected 'POINT' or"),
        ("SRID=4326;POINT (1 2)", "it.wkt:1: got 'SRID', expected 'POINT'"),
        ("POINT Z (1 2 3)", "it.wkt:1: got 'Z', expected '(' or 'EMPTY'"),
        ("POINT (1 2 3)", "it.wkt:1: got '3', expected ')'"),
        ("LINESTRING (1 2,\n3)", "it.wkt:2: got ')', expected a number"),
        ("POLYGON (1 2, 3 4)", "it.wkt:1: got '1', expected '(' or 'EMPTY'"),
        ("POINT (1 nan)", "it.wkt:1: got 'NAN', expected a number"),
        ("POINT (1 1e99)", "it.wkt:1: y: got 1e+99, expected 0 or a magnitude"),
        ("LINESTRING (1 2, 3 4", "it.wkt:1: got the end of the text, expected ',' or ')'"),
    ],
)
def test_bad_wkt(put, text, complaint):
    assert refusal(put, "it.wkt", text).startswith(complaint)


# ---------------------------------------------------------------------- flintknap convert
def test_csv_to_a_log_and_on(tmp_path):
    source, target = tmp_path / "points.csv", tmp_path / "log.jsonl.gz"
    source.write_text(CSV)
    assert run("convert", source, target) == (0, "", "2 points, 2 objects\n")
    assert target.read_bytes()[:2] == convert.GZIP
    assert events(target) == READ
    code, out, err = run("convert", "-", "-", "--from", "csv", input=CSV.encode())
    assert (code, err) == (0, "2 points, 2 objects\n")
    assert out == gzip.decompress(target.read_bytes()).decode()
    code, out, _ = run("replay", "-", "--json", input=out.encode())
    assert [facts["points"] for facts in json.loads(out)["objects"]] == [1, 1]


def test_points_without_a_name_get_that_of_the_option(tmp_path):
    (tmp_path / "it.wkt").write_text("MULTIPOINT (1 2, 3 4)")
    assert run("convert", tmp_path / "it.wkt", tmp_path / "log", "--object", "hull")[0] == 0
    assert {event.object for event in events(tmp_path / "log")} == {"hull"}


def test_a_refused_file_leaves_the_log_as_it_was(tmp_path):
    (tmp_path / "it.csv").write_text("x,y\n1,2\n3,north\n")
    (tmp_path / "log").write_text("old")
    code, out, err = run("convert", tmp_path / "it.csv", tmp_path / "log")
    assert (code, out) == (1, "")
    assert err == f"flintknap: {tmp_path}/it.csv:3: y: got 'north', expected a number\n"
    assert (tmp_path / "log").read_text() == "old"
    assert len(list(tmp_path.iterdir())) == 2
    code, _, err = run("convert", "-", "-", "--from", "csv", input=b"x,y\n?,1")
    assert (code, err) == (1, "flintknap: <stdin>:2: x: got '?', expected a number\n")


@pytest.mark.parametrize(
    ("arguments", "code", "complaint"),
    [
        (["convert", "-", "-"], 1, "<stdin>: got no known ending, expected .csv, "),
        (["convert", "points.xls", "-"], 1, "points.xls: got no known ending, expected .csv, "),
        (["convert", "nothing.csv", "-"], 1, "nothing.csv"),
        (["convert", "x.csv", "-", "--from", "shp"], 2, "invalid choice: 'shp'"),
        (["convert", "x.csv"], 2, "usage: flintknap convert "),
        (["info", "nothing"], 1, "nothing"),
        (["check", "nothing"], 1, "nothing"),
        (["info"], 2, "usage: flintknap info "),
        (["frob"], 2, "invalid choice: 'frob'"),
    ],
)
def test_what_cannot_be_done_is_said(arguments, code, complaint):
    got, out, err = run(*arguments)
    assert (got, out) == (code, "")
    assert complaint in err
    assert code == 2 or len(err.splitlines()) == 1


# ---------------------------------------------------------------------- flintknap info, check
MIXED = [
    Insert(t=5.0, object="a", x=1.0, y=2.0),
    Insert(t=1.0, object="a", x=4.0, y=-2.5),
    Insert(t=2.0, object="a", x=4.0, y=-2.5),
    Insert(t=3.0, object="a\x1b", x=0.0, y=0.0),
    Query(t=9.0, object="a", kind="side", x=0.0, y=0.0),
    Move(t=6.0, object="a", id=0, x=3.0, y=3.0),
    Remove(t=7.0, object="a\x1b", x=0.0, y=0.0),
]


def test_info(tmp_path):
    log.write(tmp_path / "it", MIXED)
    code, out, err = run("info", tmp_path / "it", "--json")
    assert (code, err) == (0, "")
    assert json.loads(out) == {
        "events": 7,
        "objects": [
            {
                "object": "a",
                "events": {"insert": 3, "move": 1, "query": 1},
                "t": [1.0, 9.0],
                "points": 2,
                "box": [3.0, -2.5, 4.0, 3.0],
            },
            {
                "object": "a\x1b",
                "events": {"insert": 1, "remove": 1},
                "t": [3.0, 7.0],
                "points": 0,
                "box": None,
            },
        ],
    }
    code, out, err = run("info", "-", input=(tmp_path / "it").read_bytes())
    assert (code, err) == (0, "")
    assert out.splitlines() == [
        "object   events                      from t  to t  points  x     y",
        "a        3 inserts, 1 move, 1 query  1       9     2       3  4  -2.5  3",
        "'a\\x1b'  1 insert, 1 remove          3       7     0",
    ]


def test_output_is_utf_8_whatever_the_locale(tmp_path):
    log.write(tmp_path / "it", [Insert(t=1732262400.25, object="hülle", x=1.0, y=2.0)])
    ascii_only = os.environ | {"PYTHONIOENCODING": "ascii", "LC_ALL": "C"}
    for verb in ("info", "check"):
        code, out, err = run(verb, tmp_path / "it", env=ascii_only)
        assert (code, err) == (0, "")
        assert "hülle" in out
    assert " 1732262400 " in run("info", tmp_path / "it")[1]


def test_check(tmp_path):
    code, out, err = run("check", LOGS / "burst.jsonl.gz")
    assert (code, err) == (0, "")
    assert out.splitlines() == [
        "drop: 1,078 points, closed, ok",
        "amoeba: 1,276 points, closed, ok",
    ]
    (tmp_path / "it").write_text("oops")
    code, out, err = run("check", tmp_path / "it")
    assert (code, out) == (1, "")
    assert err.startswith(f"flintknap: {tmp_path}/it:1: got 'oops', expected the header")


def test_check_tells_what_is_broken(tmp_path, capfd, monkeypatch):
    log.write(tmp_path / "it", MIXED)

    def broken(self):
        if len(self):
            raise fk.InvariantError("an edge has no twin")

    monkeypatch.setattr(fk.Engine, "check", broken)
    assert cli.main(["check", str(tmp_path / "it")]) == 1
    assert capfd.readouterr().out.splitlines() == [
        "a: 2 points, degenerate, BROKEN: an edge has no twin",
        "'a\\x1b': 0 points, degenerate, ok",
    ]


def test_the_progress_bar_is_for_terminals():
    ours, theirs = pty.openpty()
    termios.tcsetwinsize(theirs, (24, 80))
    command = [*COMMAND, "info", str(LOGS / "burst.jsonl.gz")]
    subprocess.run(command, stdout=subprocess.DEVNULL, stderr=theirs, check=True)
    shown = os.read(ours, 1 << 16).decode()
    os.close(theirs)
    os.close(ours)
    assert "%|" in shown
    assert run("info", LOGS / "burst.jsonl.gz")[2] == ""


# ---------------------------------------------------------------------- help
@pytest.mark.parametrize("verb", ["replay", "convert", "info", "check"])
def test_help_has_examples_that_parse(verb):
    code, out, err = run(verb, "--help")
    assert (code, err) == (0, "")
    assert "Exit codes: 0; 1 " in out
    assert "\x1b" not in out
    examples = out.split("examples:\n")[1].split("\n\n")[0].splitlines()
    assert hasattr(commands, verb)
    for example in examples:
        for part in example.split(" > ")[0].split("|"):
            words = part.replace("'", "").split()
            if words[0] == "flintknap":
                assert cli._parser().parse_args(words[1:]).verb
    assert verb in run("--help")[1]


def test_help_does_not_wait_for_numpy():
    code = "import sys; sys.modules['numpy'] = None; import flintknap.cli as c; c.main(['--help'])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert done.stdout.startswith(b"usage: flintknap ")
