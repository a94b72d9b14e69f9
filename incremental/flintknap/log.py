"""Event logs on disk or from a pipe: JSON Lines, compressed with gzip or not.

Reading. Blocks of bytes are cut at line ends and every line is decoded by itself. Only one block is
held, so logs may be of any length, and a log may still be growing at the other end of a pipe.
Whether a stream is gzip is told by its first byte, which no JSON text begins with, not by its name.

Strict. A line holds one event and nothing else. The first one that does not, a stream that breaks
off, or bytes that are not UTF-8 raise LogError: `file:line: what was got, what was expected`. The
last line may lack its line end. A line of more than BLOCK bytes is refused: no end is in sight.

Writing. What is written reads back equal, bit for bit, and equal events make equal files. A file
appears complete or not at all.

Cost. About 0.3 us an event to read. (To decode a block in one call is faster by a third, but lets
blank lines and two events on one line pass; to rule these out costs what it saves.)
"""

from __future__ import annotations

import gzip
import os
import shutil
import sys
import zlib
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, NamedTuple, TypeVar

import msgspec

from flintknap.errors import InputError, LogError
from flintknap.events import HEADER, Event, Header

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from io import BufferedReader

T = TypeVar("T")

BLOCK = 1 << 17  # bytes: a block and its events fit into a second-level cache
SHOWN = 120  # bytes of a refused line that an error shows
EXPECTED = "an insert, remove, move or query event"

_encode = msgspec.json.Encoder(enc_hook=float).encode  # the hook takes NumPy's scalars
_header = msgspec.json.Decoder(Header)
_event = msgspec.json.Decoder(Event)


class Block(NamedTuple):
    """Consecutive events of a log.

    Attributes:
        line: where the first of them stands, counted from 1.
        events: as they stand there.
        position: bytes of the file read so far; of the text, if it comes through a pipe.

    """

    line: int
    events: list[Event]
    position: int


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
        for line, lines, position in _lines(file, file_name):
            if line == 1:
                _decoded(_header, lines[:1], f"the header {_encode(HEADER).decode()}", file_name, 1)
                line, lines = 2, lines[1:]
            events = _decoded(_event, lines, EXPECTED, file_name, line)
            yield Block(line, events, position)


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


def _lines(file: BufferedReader, file_name: str) -> Iterator[tuple[int, list[bytes], int]]:
    """Yield whole lines: the number of the first, one line or more, the position in the file."""
    stream = gzip.GzipFile(fileobj=file) if file.peek(1)[:1] == b"\x1f" else file
    line, rest, position = 1, b"", 0
    try:
        while data := stream.read1(BLOCK):
            lines = (rest + data).split(b"\n")
            if len(lines[0]) > BLOCK:  # the others lie within data
                raise LogError(
                    file_name, line, f"got more than {BLOCK} bytes, expected the line to end before"
                )
            position = file.tell() if file.seekable() else position + len(data)
            rest = lines.pop()
            if lines:
                yield line, lines, position
                line += len(lines)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise LogError(
            file_name, line, f"got damaged gzip data ({error}), expected the rest of the log"
        ) from None
    if rest or line == 1:
        yield line, [rest], position


def _decoded(
    decoder: msgspec.json.Decoder[T], lines: list[bytes], expected: str, file_name: str, line: int
) -> list[T]:
    """Decode lines one by one; the first has number ``line`` in the file."""
    values: list[T] = []
    try:
        values.extend(map(decoder.decode, lines))  # keeps those before an exception
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        text = lines[len(values)]
        got = repr(text[:SHOWN].decode(errors="backslashreplace") + "..." * (len(text) > SHOWN))
        why = f"got {got}, expected {expected}: {error}"
        if not text.strip():
            why = f"got a blank line, expected {expected}"
        raise LogError(file_name, line + len(values), why) from None
    return values
