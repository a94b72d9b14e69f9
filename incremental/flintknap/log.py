"""Event logs on disk or from a pipe: JSON Lines, compressed with gzip or not.

Reading. Bytes are cut at line ends into blocks, and only one block is held: so logs may be of any
length, and a log may still be growing at the other end of a pipe. Whether a stream is gzip is told
by its first byte, which no JSON text begins with, not by its name.

A block whose first line is an insert, and whose other lines differ from it in their numbers alone,
is read into arrays by the kernel (lines.hpp); its events are made when somebody asks for them. Any
other block is decoded in one call, which cares for values and not for lines. But if every line
begins with "{" and ends with "}", and there are as many values as lines, then each line is one
value: no JSON object or string holds a line end between the two. Otherwise, or if the call fails,
the lines are decoded one by one, which tells the one at fault, or that it was only spaces.

Strict. A line holds one event and nothing else. The first one that does not, a stream that breaks
off, or bytes that are not UTF-8 raise LogError: `file:line: what was got, what was expected`. The
last line may lack its line end. A line of more than BLOCK bytes is refused: no end is in sight.

Writing. What is written reads back equal, bit for bit, and equal events make equal files. A file
appears complete or not at all.

Cost. About 0.1 us an event to read into arrays, 0.25 into events, 0.35 if lines have to be taken
one by one.
"""

from __future__ import annotations

import gzip
import os
import shutil
import sys
import zlib
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, TypeVar

import msgspec
import numpy as np

from flintknap._kernel import read_alike
from flintknap.errors import InputError, LogError
from flintknap.events import HEADER, Event, Header, Insert

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from io import BufferedReader

    from numpy.typing import NDArray

T = TypeVar("T")

BLOCK = 1 << 17  # bytes: a block and its events fit into a second-level cache
SHOWN = 120  # bytes of a refused line that an error shows
OPENS, CLOSES, ENDS = b"{}\n"  # an object, an object, a line
UNREADABLE = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)
EXPECTED = "an insert, remove, move or query event"

_encode = msgspec.json.Encoder(enc_hook=float).encode  # the hook takes NumPy's scalars
_header = msgspec.json.Decoder(Header)
_event = msgspec.json.Decoder(Event)


@dataclass(frozen=True, eq=False, slots=True)
class Inserts:
    """Inserts of one object, in their order; their length is their number.

    Attributes:
        object: its name.
        t: when each point was seen, float64 (n,).
        x: where, float64 (n,).
        y: where, float64 (n,).

    """

    object: str
    t: NDArray[np.float64]
    x: NDArray[np.float64]
    y: NDArray[np.float64]

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.t)

    def __getitem__(self, rows: slice | NDArray[np.bool_]) -> Inserts:
        """Return some of them."""
        return Inserts(self.object, self.t[rows], self.x[rows], self.y[rows])


@dataclass(frozen=True, eq=False)
class Block:
    """Consecutive events of a log; its length is their number.

    Attributes:
        line: where the first of them stands, counted from 1.
        position: bytes of the file read so far; of the text, if it comes through a pipe.
        inserts: they as arrays, if all are inserts of one object and were written alike.

    """

    line: int
    position: int
    inserts: Inserts | None
    _make: Callable[[], list[Event]] = field(repr=False)

    @cached_property
    def events(self) -> list[Event]:
        """They as they stand there; made when first asked for."""
        return self._make()

    def __len__(self) -> int:
        return len(self.events) if self.inserts is None else len(self.inserts)


def name(path: str | os.PathLike[str]) -> str:
    """Return what errors call the log at ``path``."""
    return "<stdin>" if path == "-" else os.fspath(path)


def read(path: str | os.PathLike[str]) -> Iterator[Block]:
    """Yield the log at ``path``, or on standard input for "-", block by block.

    Raises LogError for the first line at fault, once all blocks before its own have been yielded;
    OSError if there is nothing to read. O(1) memory.
    """
    file_name = name(path)
    with open(0, "rb", closefd=False) if path == "-" else Path(path).open("rb") as file:
        line = 1
        for text, position in _texts(file, file_name):
            rest: bytes | None = text
            if line == 1:
                header, *more = text.split(b"\n", 1)
                expected = f"the header {_encode(HEADER).decode()}"
                _one_by_one(_header, [header], expected, file_name, line)
                line, rest = 2, more[0] if more else None
            if rest is None:
                yield Block(line, position, None, list)
                continue
            block = _block(rest, file_name, line, position)
            yield block
            line += len(block)


def write(path: str | os.PathLike[str], events: Iterable[Event]) -> None:
    """Write a log, compressed if ``path`` ends in ".gz"; a file that was there is replaced.

    "-" is standard output, which has lines of a log that fails later.

    Raises InputError for the first event that would not be read back, its index in ``row``.
    """
    packed = os.fspath(path).endswith(".gz")
    with (
        nullcontext(sys.stdout.buffer) if path == "-" else replacing(path) as file,
        gzip.GzipFile("", "wb", 9, file, mtime=0) if packed else nullcontext(file) as stream,
    ):
        stream.write(_encode(HEADER) + b"\n")
        for row, event in enumerate(events):
            line = _encode(event)
            try:
                _event.decode(line)
            except msgspec.DecodeError as error:
                why = f"event {row}: got {event!r}, expected {EXPECTED}: {error}"
                raise InputError(why, row=row) from None
            stream.write(line + b"\n")
        stream.flush()


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open a file that takes the place of ``path`` if all goes well, and else leaves no trace.

    What is no regular file, a device or a pipe, is not replaced but written to.
    """
    target = Path(path).resolve()
    if Path(path).exists() and not target.is_file():
        with Path(path).open("wb") as file:
            yield file
        return
    temporary = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        file = temporary.open("xb")
    except OSError as error:
        raise OSError(error.errno, error.strerror, os.fspath(path)) from None
    try:
        with file:
            yield file
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def filling(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Make a folder that takes the place of ``path`` if all goes well, and else leaves no trace.

    Raises InputError if there is something already, other than an empty folder.
    """
    target = Path(path).resolve()
    if target.exists() and not (target.is_dir() and next(target.iterdir(), None) is None):
        raise InputError(f"{path}: got what is there already, expected a new or an empty folder")
    temporary = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        temporary.mkdir()
    except OSError as error:
        raise OSError(error.errno, error.strerror, os.fspath(path)) from None
    try:
        yield temporary
        temporary.replace(target)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _texts(file: BufferedReader, file_name: str) -> Iterator[tuple[bytes, int]]:
    """Yield one line or more at a time, without the last line end, and the position in the file."""
    stream = gzip.GzipFile(fileobj=file) if file.peek(1)[:1] == b"\x1f" else file
    line, rest, position = 1, b"", 0  # where the rest, which no line end has followed yet, begins
    try:
        while data := stream.read1(BLOCK):
            text, end = rest + data, data.rfind(b"\n")
            first = text.find(b"\n") if end >= 0 else len(text)
            if first > BLOCK:  # the others lie within data
                raise LogError(
                    file_name, line, f"got more than {BLOCK} bytes, expected the line to end before"
                )
            position = file.tell() if file.seekable() else position + len(data)
            if end < 0:
                rest = text
                continue
            text, rest = text[: len(rest) + end], data[end + 1 :]
            yield text, position
            line += int(np.count_nonzero(np.frombuffer(text, np.uint8) == ENDS)) + 1
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise LogError(
            file_name, line, f"got damaged gzip data ({error}), expected the rest of the log"
        ) from None
    if rest or line == 1:
        yield rest, position


def _block(text: bytes, file_name: str, line: int, position: int) -> Block:
    """Read lines, the first of which has number ``line`` in the file."""
    inserts = _inserts(text)
    if inserts is not None:
        return Block(line, position, inserts, lambda: _event.decode_lines(text))
    events = _events(text, file_name, line)
    return Block(line, position, None, lambda: events)


def _inserts(text: bytes) -> Inserts | None:
    """Read lines that are all like the first one, if that is an insert."""
    end = text.find(b"\n")
    first = text if end < 0 else text[:end]
    try:
        event = _event.decode(first)
    except UNREADABLE:
        return None
    if not isinstance(event, Insert):
        return None
    values = read_alike(text, first)
    return Inserts(event.object, *values.reshape(3, -1)) if len(values) else None


def _events(text: bytes, file_name: str, line: int) -> list[Event]:
    """Decode lines, the first of which has number ``line`` in the file."""
    try:
        events = _event.decode_lines(text)
    except UNREADABLE:
        events = []
    if _is_one_a_line(text, len(events)):
        return events
    return _one_by_one(_event, text.split(b"\n"), EXPECTED, file_name, line)


def _is_one_a_line(text: bytes, values: int) -> bool:
    """Tell whether each line is one of so many objects that were decoded from them all."""
    code = np.frombuffer(text, np.uint8)
    if len(code) == 0 or code[0] != OPENS or code[-1] != CLOSES:
        return False
    ends = np.flatnonzero(code == ENDS)
    return (
        len(ends) + 1 == values
        and bool((code[ends - 1] == CLOSES).all())
        and bool((code[ends + 1] == OPENS).all())
    )


def _one_by_one(
    decoder: msgspec.json.Decoder[T], lines: list[bytes], expected: str, file_name: str, line: int
) -> list[T]:
    """Decode lines by themselves, the first of which has number ``line`` in the file."""
    values: list[T] = []
    try:
        values.extend(map(decoder.decode, lines))  # keeps those before an exception
    except UNREADABLE as error:
        text = lines[len(values)]
        got = repr(text[:SHOWN].decode(errors="backslashreplace") + "..." * (len(text) > SHOWN))
        why = f"got {got}, expected {expected}: {error}"
        if not text.strip():
            why = f"got a blank line, expected {expected}"
        raise LogError(file_name, line + len(values), why) from None
    return values
