"""Logs: what is written reads back, and whatever is wrong is refused with its line."""

from __future__ import annotations

import gzip
import os
import re
import zlib
from itertools import chain

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import flintknap as fk
from flintknap import log
from flintknap.events import Insert, Move, Query, Remove

HEADER = b'{"format":"flintknap","version":1}\n'
INSERT = b'{"op":"insert","t":0.5,"x":1.0,"y":2.0}\n'

finite = st.floats(allow_nan=False, allow_infinity=False)
names = st.text(st.characters(exclude_categories=["Cs"]))
inserts = st.builds(Insert, t=finite, object=names, x=finite, y=finite)
kinds = st.sampled_from(["side", "contains"])
queries = st.builds(Query, t=finite, object=names, kind=kinds, x=finite, y=finite) | st.builds(
    Query, t=finite, kind=st.just("side"), x=finite, y=finite, level=st.integers(0, 2**31 - 1)
)
ids = st.integers(0, 2**63 - 1)
removes = st.builds(Remove, t=finite, object=names, id=ids) | st.builds(
    Remove, t=finite, object=names, x=finite, y=finite
)
moves = st.builds(Move, t=finite, object=names, id=ids, x=finite, y=finite)
events = st.lists(inserts | queries | removes | moves, max_size=30)


def read_all(path):
    return list(chain.from_iterable(block.events for block in log.read(path)))


def place(tmp_path, data, name="it.jsonl"):
    path = tmp_path / name
    path.write_bytes(data)
    return path


def refusal(path):
    """The error that reading ends with, after a look at its form."""
    with pytest.raises(fk.LogError) as caught:
        read_all(path)
    error = caught.value
    assert error.file == str(path)
    assert re.match(rf"{re.escape(str(path))}:{error.line}: got .+, expected ", str(error))
    assert "\n" not in str(error)
    assert len(str(error)) < len(str(path)) + 800
    return error


# ---------------------------------------------------------------------- what is right
@given(events, st.sampled_from(["it.jsonl", "it.jsonl.gz"]))
def test_what_is_written_reads_back(tmp_path_factory, written, name):
    path = tmp_path_factory.mktemp("log") / name
    log.write(path, written)
    assert list(map(repr, read_all(path))) == list(map(repr, written))  # repr: -0.0 is not 0.0
    assert (path.read_bytes()[:2] == b"\x1f\x8b") == (name == "it.jsonl.gz")


def test_the_text_of_a_log(tmp_path):
    path = tmp_path / "it.jsonl"
    log.write(
        path,
        [
            Insert(t=12.5, object="hull", x=1.0, y=-2e-7),
            Insert(t=13, x=np.float64(0.1), y=np.int64(3)),
            Query(t=14.0, object="hülle", kind="side", x=0.0, y=0.0),
            Remove(t=15.0, object="hull", id=0),
            Remove(t=15.0, object="hull", x=0.1, y=3.0),
            Move(t=16.0, object="hull", id=1, x=0.0, y=0.0),
        ],
    )
    assert path.read_text(encoding="utf-8").splitlines() == [
        '{"format":"flintknap","version":1}',
        '{"op":"insert","t":12.5,"object":"hull","x":1.0,"y":-2e-7}',
        '{"op":"insert","t":13,"object":"object","x":0.1,"y":3.0}',
        '{"op":"query","t":14.0,"object":"hülle","kind":"side","x":0.0,"y":0.0}',
        '{"op":"remove","t":15.0,"object":"hull","id":0}',
        '{"op":"remove","t":15.0,"object":"hull","x":0.1,"y":3.0}',
        '{"op":"move","t":16.0,"object":"hull","id":1,"x":0.0,"y":0.0}',
    ]


def test_fields_in_any_order_and_spaced_and_whole_numbers_and_no_object(tmp_path):
    line = b'\t{ "y" : 2, "x":1, "t": -3e0 , "op" :"insert"} \r\n'
    assert read_all(place(tmp_path, HEADER + line)) == [Insert(t=-3.0, object="object", x=1, y=2)]


@pytest.mark.parametrize("end", [b"", b"\n"])
def test_the_last_line_end_may_be_missing(tmp_path, end):
    assert len(read_all(place(tmp_path, HEADER + INSERT * 2 + INSERT[:-1] + end))) == 3
    assert read_all(place(tmp_path, HEADER[:-1] + end)) == []


def test_the_same_events_make_the_same_file(tmp_path):
    written = [Insert(t=float(i), x=float(i), y=0.5) for i in range(100)]
    for name in ("one.gz", "two.gz"):
        log.write(tmp_path / name, written)
    data = (tmp_path / "one.gz").read_bytes()
    assert data == (tmp_path / "two.gz").read_bytes()
    assert data[3] == 0  # no flags: neither a name nor anything else
    assert data[4:8] == bytes(4)  # no time


def test_gzip_is_told_by_content_and_may_come_in_pieces(tmp_path):
    data = gzip.compress(HEADER + INSERT) + gzip.compress(INSERT * 2)
    assert len(read_all(place(tmp_path, data, "it.jsonl"))) == 3
    assert len(read_all(place(tmp_path, HEADER + INSERT, "it.gz"))) == 1


@pytest.mark.parametrize("block", [1 << 6, 100, 1 << 10, 1 << 20])
@pytest.mark.parametrize("packed", [False, True])
def test_blocks_are_consecutive_and_say_where_they_are(tmp_path, monkeypatch, block, packed):
    monkeypatch.setattr(log, "BLOCK", block)
    written = [Insert(t=i, x=i, y=0) for i in range(500)]
    data = HEADER + b"".join(b'{"op":"insert","t":%d,"x":%d,"y":0}\n' % (i, i) for i in range(500))
    path = place(tmp_path, gzip.compress(data) if packed else data)
    blocks = list(log.read(path))
    assert list(chain.from_iterable(b.events for b in blocks)) == written
    for b in blocks:
        if b.events:
            assert b.line == b.events[0].t + 2
        assert packed or len(b.events) * len(INSERT) < 2 * block + 100
    positions = [b.position for b in blocks]
    assert positions == sorted(positions)
    assert positions[-1] == path.stat().st_size


def test_a_log_may_still_be_growing():
    source, sink = os.pipe()
    try:
        blocks = log.read(f"/dev/fd/{source}")
        os.write(sink, HEADER + INSERT * 2 + INSERT[:9])
        for line in (2, 4):
            block = next(blocks)
            assert block.line == line
            assert block.events == [Insert(t=0.5, x=1.0, y=2.0)] * 2
            assert block.position == len(HEADER) + line * len(INSERT) + (9 if line == 2 else 0)
            os.write(sink, INSERT[9:] + INSERT if line == 2 else b"")
        os.close(sink)
        assert next(blocks, None) is None
    finally:
        os.close(source)


# ---------------------------------------------------------------------- inserts as arrays
def arrays(text):
    """What a block has as arrays, as events; None if it has none."""
    inserts = log._inserts(text)
    if inserts is None:
        return None
    columns = (inserts.t.tolist(), inserts.x.tolist(), inserts.y.tolist())
    return [Insert(t=t, object=inserts.object, x=x, y=y) for t, x, y in zip(*columns, strict=True)]


def decoded(text):
    """The same by the decoder, line by line; None if it refuses one."""
    try:
        return list(map(log._event.decode, text.split(b"\n")))
    except log.UNREADABLE:
        return None


TEMPLATES = [
    '{"op":"insert","t":%s,"object":"hull","x":%s,"y":%s}',
    '{"op":"insert","t":%s,"x":%s,"y":%s}',
    ' {"y": %s, "x": %s , "op": "insert", "object": "1 \\" -2", "t": %s}\t',
    '{"object":"x","x":%s,"op":"insert","t":%s,"y":%s}\r',
    '{"op":"insert","object":"\\u0078hülle\\\\","y":%s,"t":%s,"x":%s}',
]
usual = st.floats(1e-5, 1e15) | st.floats(-1e15, -1e-5) | st.integers(-(10**15), 10**15)


@given(st.sampled_from(TEMPLATES), st.lists(st.tuples(usual, usual, usual), min_size=1))
def test_inserts_written_alike_are_read_into_arrays(template, rows):
    text = "\n".join(template % row for row in rows).encode()
    got = arrays(text)
    assert got is not None
    assert list(map(repr, got)) == list(map(repr, decoded(text)))  # repr: -0.0 is not 0.0


digits = st.text("0123456789", max_size=22)
near_ties = st.integers(2**52, 2**56).map(lambda n: f"{n}{'.5' * (n % 2)}")
literals = (
    near_ties
    | st.floats().map(repr)
    | st.text("-+.eE0123456789", max_size=6)
    | st.builds(
        "".join,
        st.tuples(
            st.sampled_from(["", "-"]),
            digits,
            st.sampled_from(["", "."]),
            digits,
            st.sampled_from(["", "e", "E-", "e+", "e-"]),
            st.integers(0, 400).map(str) | st.just(""),
        ),
    )
)


@given(literals)
def test_a_number_is_read_as_the_decoder_reads_it_or_left_to_it(literal):
    first = TEMPLATES[1] % (0, 1, 2)
    text = (first + "\n" + TEMPLATES[1] % (literal, literal, "2")).encode()
    got = arrays(text)
    if got is not None:
        assert list(map(repr, got)) == list(map(repr, decoded(text)))


@given(
    st.sampled_from(TEMPLATES).map(lambda template: (template % (0.5, -1, 2e-3)).encode()),
    st.lists(st.tuples(st.integers(0, 200), st.integers(0, 2), st.binary(max_size=2)), max_size=2),
    st.integers(0, 3),
)
def test_what_is_read_into_arrays_is_what_the_decoder_reads(line, cuts, before):
    changed = line
    for at, length, new in cuts:
        changed = changed[:at] + new + changed[at + length :]
    for text in (b"\n".join([line] * before + [changed, line]), changed):
        got = arrays(text)
        if got is not None:
            assert got == decoded(text)


@pytest.mark.parametrize(
    "other",
    [
        b'{"op":"insert","t":0.5,"x":1.0,"y":2.0,"object":"hull"}',
        b'{"op":"insert","t":0.5,"x":1.0, "y":2.0}',
        b'{"op":"query","t":0.5,"kind":"side","x":1.0,"y":2.0}',
        b'{"op":"remove","t":0.5,"x":1.0,"y":2.0}',
        b'{"op":"move","t":0.5,"id":0,"x":1.0,"y":2.0}',
        b'{"op":"insert","t":0.5,"x":1.0,"x":1.0,"y":2.0}',
        b'{"op":"insert","t":0.5,"x":1.0,"y":2.0,"y":2.0}',
        b'{"op":"insert","t":0.5,"x":1.0,"y":2.00000000000000000000}',
        b"",
    ],
)
def test_what_is_written_otherwise_is_not(other):
    line = INSERT[:-1]
    for lines in ([line, other], [other, line], [line, other, line]):
        assert arrays(b"\n".join(lines)) is None
    assert arrays(b"\n".join([line] * 3)) == [Insert(t=0.5, x=1.0, y=2.0)] * 3


# ---------------------------------------------------------------------- what is wrong
@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\n" + HEADER,
        INSERT,
        b'{"format":"flintknap"}\n',
        b'{"format":"flintknap","version":2}\n' + INSERT,
        b'{"format":"flintknap","version":1.0}\n',
        b'{"format":"flintknap","version":true}\n',
        b'{"format":"flintknapp","version":1}\n',
        b'{"format":"flintknap","version":1,"unit":"m"}\n',
        b"\xef\xbb\xbf" + HEADER,
        (HEADER + INSERT).decode().encode("utf-16"),
        (HEADER + INSERT).decode().encode("utf-32-le"),
        HEADER[:-1] + INSERT,
        b"\x1f",
        b"\x1f\x8bnothing of the kind",
        gzip.compress(b""),
        b"[" * 5000,
        bytes(range(256)),
    ],
)
def test_a_log_begins_with_its_header(tmp_path, data):
    error = refusal(place(tmp_path, data))
    assert error.line == 1
    assert '{"format":"flintknap","version":1}' in str(error) or "gzip" in str(error)


BAD = {
    b"": "got a blank line",
    b" \t\r": "got a blank line",
    b"hello": "malformed",
    INSERT[:-5]: "truncated",
    INSERT[:-1] + INSERT[:-1]: "trailing",
    INSERT[:-1] + b" " + INSERT[:-1]: "trailing",
    INSERT[:-1] + b",": "trailing",
    INSERT[:-1] + b"\r" + INSERT[:-1]: "trailing",
    HEADER[:-1]: "`op`",
    b"[1, 2]": "array",
    b"null": "null",
    b'{"t":0.5,"x":1.0,"y":2.0}': "`op`",
    b'{"op":"retract","t":0.5,"x":1.0,"y":2.0}': "retract",
    b'{"op":"remove","t":0.5}': "either field `id` or fields `x` and `y`",
    b'{"op":"remove","t":0.5,"x":1.0}': "either field `id` or fields `x` and `y`",
    b'{"op":"remove","t":0.5,"id":1,"x":1.0,"y":2.0}': "either field `id` or fields `x` and `y`",
    b'{"op":"remove","t":0.5,"id":1,"y":2.0}': "either field `id` or fields `x` and `y`",
    b'{"op":"remove","t":0.5,"id":null}': "`$.id`",
    b'{"op":"remove","t":0.5,"id":1.5}': "`$.id`",
    b'{"op":"remove","t":0.5,"id":-1}': "`$.id`",
    b'{"op":"remove","t":0.5,"id":9223372036854775808}': "`$.id`",
    b'{"op":"remove","id":1}': "`t`",
    b'{"op":"move","t":0.5,"x":1.0,"y":2.0}': "`id`",
    b'{"op":"move","t":0.5,"id":1,"x":1.0}': "`y`",
    b'{"op":"move","t":0.5,"id":"1","x":1.0,"y":2.0}': "`$.id`",
    b'{"op":"insert","x":1.0,"y":2.0}': "`t`",
    b'{"op":"insert","t":0.5,"y":2.0}': "`x`",
    b'{"op":"insert","t":0.5,"x":1.0,"y":2.0,"z":3.0}': "`z`",
    b'{"op":"insert","t":0.5,"x":1.0,"y":2.0,"kind":"side"}': "`kind`",
    b'{"op":"insert","t":0.5,"x":"1.0","y":2.0}': "`$.x`",
    b'{"op":"insert","t":0.5,"x":true,"y":2.0}': "`$.x`",
    b'{"op":"insert","t":0.5,"x":1.0,"y":null}': "`$.y`",
    b'{"op":"insert","t":0.5,"x":1.0,"y":[2.0]}': "`$.y`",
    b'{"op":"insert","t":0.5,"x":1e400,"y":2.0}': "out of range",
    b'{"op":"insert","t":-1e400,"x":1,"y":2.0}': "out of range",
    b'{"op":"insert","t":0.5,"x":NaN,"y":2.0}': "malformed",
    b'{"op":"insert","t":0.5,"x":Infinity,"y":2.0}': "malformed",
    b'{"op":"insert","t":0.5,"x":01,"y":2.0}': "malformed",
    b'{"op":"insert","t":0.5,"object":7,"x":1.0,"y":2.0}': "`$.object`",
    b'{"op":"insert","t":0.5,"object":"\xff","x":1.0,"y":2.0}': "utf-8",
    "{'op':'insert'}".encode("utf-16-le"): "malformed",
    b'{"op":"query","t":0.5,"x":1.0,"y":2.0}': "`kind`",
    b'{"op":"query","t":0.5,"kind":"contains","x":1.0,"y":2.0,"level":1}': "`level`",
    b'{"op":"query","t":0.5,"kind":"side","x":1.0,"y":2.0,"level":-1}': "`$.level`",
    b'{"op":"query","t":0.5,"kind":"side","x":1.0,"y":2.0,"level":1.5}': "`int`",
    b'{"op":"query","t":0.5,"kind":"distance","x":1.0,"y":2.0}': "distance",
    b'{"op":' + b"[" * 5000: "recursion",
}


@pytest.mark.parametrize("bad", BAD)
@pytest.mark.parametrize("before", [0, 4000])
def test_a_line_that_is_no_event_is_refused_where_it_stands(tmp_path, bad, before):
    path = place(tmp_path, HEADER + INSERT * before + bad + b"\n" + INSERT)
    error = refusal(path)
    assert error.line == before + 2
    assert BAD[bad] in str(error)


@pytest.mark.parametrize("end", [b"\n", b"\n\n", b" "])
def test_nothing_may_follow_the_last_line_end(tmp_path, end):
    assert refusal(place(tmp_path, HEADER + INSERT + end)).line == 3


@given(st.integers(0, 300), st.integers(64, 2000), st.booleans())
def test_the_line_is_right_however_blocks_fall(tmp_path_factory, before, block, packed):
    path = tmp_path_factory.mktemp("log") / "it"
    data = HEADER + INSERT * before + b"?\n" + INSERT * 10
    path.write_bytes(gzip.compress(data) if packed else data)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(log, "BLOCK", block)
        assert refusal(path).line == before + 2


@pytest.mark.parametrize("two_on", [2, 3])
def test_two_events_on_one_line_are_not_made_up_for_by_a_blank_one(tmp_path, two_on):
    lines = [INSERT, INSERT]
    lines.insert(two_on - 2, INSERT[:-1] + INSERT)
    assert refusal(place(tmp_path, HEADER + b"".join(lines) + b"\n")).line == two_on


def test_one_event_on_two_lines(tmp_path):
    assert refusal(place(tmp_path, HEADER + INSERT.replace(b",", b",\n", 1))).line == 2


def test_a_line_without_an_end_in_sight(tmp_path):
    long = b'{"op":"insert","t":0.5,"object":"%s","x":1,"y":2}'
    room = log.BLOCK - len(long % b"")
    assert len(read_all(place(tmp_path, HEADER + INSERT + long % (b"a" * room) + b"\n"))) == 2
    for tail in (b"", b"\n", b"\n" + INSERT):
        data = HEADER + INSERT + long % (b"a" * (room + 1)) + tail
        assert refusal(place(tmp_path, data)).line == 3
        assert refusal(place(tmp_path, gzip.compress(data))).line == 3


@pytest.mark.parametrize("kept", [0.1, 0.5, 0.9])
def test_a_truncated_gzip_gives_what_it_has_and_then_the_line(tmp_path, kept):
    written = [Insert(t=i, x=i % 7, y=i % 11) for i in range(20000)]
    log.write(tmp_path / "it.gz", written)
    data = (tmp_path / "it.gz").read_bytes()
    path = place(tmp_path, data[: int(len(data) * kept)], "cut.gz")
    got = []
    with pytest.raises(fk.LogError, match=r"got damaged gzip data .*, expected ") as caught:
        for block in log.read(path):
            got += block.events
    assert got == written[: len(got)]
    assert caught.value.line == len(got) + 2
    assert kept - 0.1 < len(got) / len(written) < kept + 0.1


@pytest.mark.parametrize("at", [0.5, -8, -4])
def test_a_gzip_with_a_wrong_byte(tmp_path, at):
    log.write(tmp_path / "it.gz", [Insert(t=i, x=i % 7, y=i % 11) for i in range(20000)])
    data = bytearray((tmp_path / "it.gz").read_bytes())
    data[int(len(data) * at) if at == 0.5 else at] ^= 0x55
    error = refusal(place(tmp_path, bytes(data), "bad.gz"))
    assert 1 < error.line <= 20002
    assert at == 0.5 or error.line == 20002  # checksum and length come last


def test_a_gzip_that_cannot_be_unpacked(tmp_path):
    packer = zlib.compressobj(wbits=31)
    data = packer.compress(HEADER + INSERT * 20000) + packer.flush(zlib.Z_FULL_FLUSH)
    error = refusal(place(tmp_path, data + b"\x07"))  # there is no such kind of block
    assert "got damaged gzip data" in str(error)


def test_garbage_after_gzip(tmp_path):
    assert refusal(place(tmp_path, gzip.compress(HEADER + INSERT) + b"and more")).line == 3


def test_no_such_file(tmp_path):
    with pytest.raises(FileNotFoundError):
        next(log.read(tmp_path / "nothing"))


# ---------------------------------------------------------------------- writing
@pytest.mark.parametrize(
    "event",
    [
        Insert(t=float("nan"), x=0.0, y=0.0),
        Insert(t=0.0, x=float("inf"), y=0.0),
        Insert(t=0.0, x=0.0, y="0.0"),
        Insert(t=0.0, object=3, x=0.0, y=0.0),
        Query(t=0.0, kind="far", x=0.0, y=0.0),
        Remove(t=0.0, id=-1),
        Move(t=0.0, id=0, x=0.0, y=float("nan")),
    ],
)
def test_what_would_not_read_back_is_not_written(tmp_path, event):
    path = tmp_path / "it.jsonl"
    path.write_text("as it was")
    with pytest.raises(fk.InputError, match=r"^event 1: got .+, expected ") as caught:
        log.write(path, [Insert(t=0.0, x=0.0, y=0.0), event])
    assert caught.value.row == 1
    assert path.read_text() == "as it was"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("fields", [{}, {"x": 1.0}, {"id": 1, "x": 1.0, "y": 2.0}])
def test_a_removal_names_its_point_in_one_way(fields):
    with pytest.raises(ValueError, match="either field `id` or fields `x` and `y`"):
        Remove(t=0.0, **fields)


def test_replacing_follows_links_and_leaves_devices(tmp_path):
    target, link = tmp_path / "target", tmp_path / "link"
    link.symlink_to(target)
    for text in (b"one", b"two"):
        with log.replacing(link) as file:
            file.write(text)
        assert target.read_bytes() == text
    assert link.is_symlink()
    with log.replacing("/dev/null") as file:
        file.write(b"gone")
    assert not os.path.isfile("/dev/null")  # noqa: PTH113


def test_replacing_names_the_file_that_was_asked_for(tmp_path):
    with pytest.raises(FileNotFoundError) as caught, log.replacing(tmp_path / "no" / "file"):
        pass
    assert caught.value.filename == str(tmp_path / "no" / "file")
