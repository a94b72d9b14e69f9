"""Points in formats that others write, as the inserts of a log.

CSV, Parquet and Arrow are tables: columns `x` and `y`, perhaps `t` (0 without it) and `object`
("object" without it), in any order, and no others. GeoJSON and WKT are geometries of any kind:
their vertices in the order of the file, without the repeated one that closes a ring; GeoJSON
features may have `t` and `object` among their properties. (`docs/formats.md`.)

Strict, as logs are: what is not understood is refused, not passed over, nor is it guessed which of
two coordinates comes first. Coordinates are finite and of a magnitude that an engine takes. Errors
say `file:line: what was got, what was expected`; of formats without lines, the row, or the place
within the document.

Cost. CSV and tables one row, or batch of rows, at a time, about 2 us a row; geometries are held
whole.
"""

from __future__ import annotations

import csv
import gzip
import io
import json
import os
import re
import zlib
from itertools import repeat
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Literal

from flintknap import inputs, log
from flintknap.errors import InputError, LogError
from flintknap.events import Insert

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

Format = Literal["csv", "geojson", "wkt", "parquet", "arrow"]

FORMATS: dict[str, tuple[str, ...]] = {
    "csv": (".csv",),
    "geojson": (".geojson", ".json"),
    "wkt": (".wkt",),
    "parquet": (".parquet",),
    "arrow": (".arrow", ".feather"),
}
COLUMNS = "columns x, y and perhaps t and object"
GZIP = b"\x1f\x8b"
ARROW_FILE = b"ARROW1"
SHOWN = 60  # characters of what was got that an error shows


def format_of(path: str | os.PathLike[str]) -> Format:
    """Return the format that the end of a name stands for, whether ".gz" follows or not.

    Raises InputError if there is none.
    """
    suffix = Path(os.fspath(path).removesuffix(".gz")).suffix.lower()
    for name, suffixes in FORMATS.items():
        if suffix in suffixes:
            return name  # type: ignore[return-value]
    known = ", ".join(s for suffixes in FORMATS.values() for s in suffixes)
    raise InputError(f"{log.name(path)}: got no known ending, expected {known}, or a format")


def read(
    path: str | os.PathLike[str], form: Format | None = None, *, name: str = "object"
) -> Iterator[Insert]:
    """Yield the points of a file, or of standard input for "-", as inserts.

    ``form`` is told by the end of the path if it is None; ``name`` is the object of points that
    have none. Text may be compressed with gzip.

    Raises LogError or InputError where the first fault is, OSError if there is nothing to read,
    InputError if pyarrow is needed and not there.
    """
    form = format_of(path) if form is None else form
    file_name = log.name(path)
    with open(0, "rb", closefd=False) if path == "-" else Path(path).open("rb") as file:
        if form in ("parquet", "arrow"):
            yield from _table(file, form, file_name, name)
            return
        packed = file.peek(2)[:2] == GZIP
        with io.TextIOWrapper(
            gzip.GzipFile(fileobj=file) if packed else file, encoding="utf-8-sig", newline=""
        ) as text:
            try:
                yield from TEXTS[form](text, file_name, name)
            except UnicodeDecodeError as error:
                raise InputError(f"{file_name}: got {error}, expected UTF-8") from None
            except (EOFError, zlib.error, gzip.BadGzipFile) as error:
                raise InputError(
                    f"{file_name}: got damaged gzip data ({error}), expected the rest of it"
                ) from None


def _insert(x: Any, y: Any, t: Any, name: Any) -> Insert:
    """Make an insert of numbers, or raise InputError."""
    if not abs(t) < float("inf"):
        raise InputError(f"t: got {t!r}, expected a finite number")
    if not isinstance(name, str):
        raise InputError(f"object: got {_shown(name)}, expected a string")
    return Insert(t=t, object=name, x=inputs.scalar(x, "x"), y=inputs.scalar(y, "y"))


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= SHOWN else text[:SHOWN] + "..."


# ---------------------------------------------------------------------- tables
def _columns(names: Sequence[str]) -> list[int]:
    """Return where x, y, t and object are, -1 for those that are not."""
    known = ["x", "y", "t", "object"]
    strange = [name for name in names if name not in known]
    if strange or len(set(names)) < len(names) or not {"x", "y"} <= set(names):
        raise InputError(f"got columns {_shown(','.join(names))}, expected {COLUMNS}")
    return [names.index(column) if column in names else -1 for column in known]


def _csv(text: io.TextIOWrapper, file_name: str, name: str) -> Iterator[Insert]:
    rows = csv.reader(text, strict=True)
    try:
        head = next(rows, [])
        ix, iy, it, io_ = _columns(head)
        for row in rows:
            if len(row) != len(head):
                got = f"{len(row)} fields" if row else "a blank line"
                raise InputError(f"got {got}, expected {len(head)} fields")
            t = _number(row[it], "t") if it >= 0 else 0.0
            x, y = _number(row[ix], "x"), _number(row[iy], "y")
            yield _insert(x, y, t, row[io_] if io_ >= 0 else name)
    except csv.Error as error:
        raise LogError(file_name, rows.line_num, f"got {error}, expected CSV") from None
    except InputError as error:
        raise LogError(file_name, max(rows.line_num, 1), str(error)) from None


def _number(text: str, column: str) -> float:
    try:
        if "_" in text:
            raise ValueError
        return float(text)
    except ValueError:
        raise InputError(f"{column}: got {_shown(text)}, expected a number") from None


def _table(file: BinaryIO, form: str, file_name: str, name: str) -> Iterator[Insert]:
    try:
        import pyarrow as pa
        from pyarrow import ipc, parquet
    except ImportError:
        raise InputError(
            f"{file_name}: got {form}, expected pyarrow to read it: pip install 'flintknap[arrow]'"
        ) from None
    source = file if file.seekable() else io.BytesIO(file.read())
    try:
        if form == "parquet":
            opened = parquet.ParquetFile(source)
            schema, batches = opened.schema_arrow, opened.iter_batches()
        else:
            is_file = source.read(len(ARROW_FILE)) == ARROW_FILE
            source.seek(0)
            opened = ipc.open_file(source) if is_file else ipc.open_stream(source)
            schema = opened.schema
            batches = map(opened.get_batch, range(opened.num_record_batches)) if is_file else opened
        where = _columns(schema.names)
        for place in where[:3]:
            if place >= 0 and not _is_number(schema.types[place]):
                raise InputError(
                    f"{schema.names[place]}: got values of type {schema.types[place]}, expected "
                    "real numbers"
                )
        row = 0
        for batch in batches:
            columns = [
                batch.column(place).to_pylist() if place >= 0 else repeat(default, batch.num_rows)
                for place, default in zip(where, (None, None, 0.0, name), strict=True)
            ]
            for x, y, t, each in zip(*columns, strict=True):
                try:
                    if x is None or y is None or t is None:
                        raise InputError("got an empty field, expected a number")
                    yield _insert(float(x), float(y), float(t), each)
                except InputError as error:
                    raise InputError(f"row {row}: {error}", row=row) from None
                row += 1
    except (InputError, pa.ArrowException) as error:
        row_at_fault = error.row if isinstance(error, InputError) else None
        raise InputError(f"{file_name}: {error}", row=row_at_fault) from None


def _is_number(type_: Any) -> bool:
    from pyarrow import types

    return bool(types.is_integer(type_) or types.is_floating(type_))


# ---------------------------------------------------------------------- geometries
DEPTHS = {
    "Point": 0,
    "MultiPoint": 1,
    "LineString": 1,
    "MultiLineString": 2,
    "Polygon": 2,
    "MultiPolygon": 3,
}


def _geojson(text: io.TextIOWrapper, file_name: str, name: str) -> Iterator[Insert]:
    try:
        document = json.load(text)
    except json.JSONDecodeError as error:
        raise LogError(file_name, error.lineno, f"got {error.msg}, expected GeoJSON") from None
    except RecursionError:
        raise InputError(f"{file_name}: got JSON that is nested too deeply") from None
    try:
        yield from _vertices(document, "$", {"object": name})
    except InputError as error:
        raise InputError(f"{file_name}: {error}") from None


def _vertices(node: Any, path: str, properties: dict[str, Any]) -> Iterator[Insert]:
    """Yield the vertices of a GeoJSON object; ``path`` is where it stands in the document."""
    kind = node.get("type") if isinstance(node, dict) else None
    members = {"FeatureCollection": "features", "GeometryCollection": "geometries"}
    if kind in members:
        for index, each in enumerate(_list(node.get(members[kind]), f"{path}.{members[kind]}")):
            yield from _vertices(each, f"{path}.{members[kind]}[{index}]", properties)
    elif kind == "Feature":
        if node.get("geometry") is not None:
            own = node.get("properties") or {}
            told = {key: own[key] for key in ("t", "object") if key in own}
            yield from _vertices(node["geometry"], f"{path}.geometry", properties | told)
    elif kind in DEPTHS:
        t = properties.get("t", 0.0)
        if isinstance(t, bool) or not isinstance(t, int | float):
            raise InputError(f"{path}: t: got {_shown(t)}, expected a number")
        is_ring = kind.endswith("Polygon")
        place = f"{path}.coordinates"
        for where, x, y in _positions(node.get("coordinates"), place, DEPTHS[kind], is_ring):
            try:
                yield _insert(x, y, float(t), properties["object"])
            except (InputError, OverflowError) as error:
                raise InputError(f"{where}: {error}") from None
    else:
        got = _shown(node if kind is None else kind)
        raise InputError(f"{path}: got {got}, expected a GeoJSON object of a known type")


def _positions(
    node: Any, path: str, depth: int, is_ring: bool
) -> Iterator[tuple[str, float, float]]:
    items = _list(node, path)
    if depth == 0:
        if not items:  # an empty Point
            return
        if len(items) != 2 or not all(
            isinstance(v, int | float) and not isinstance(v, bool) for v in items
        ):
            raise InputError(f"{path}: got {_shown(node)}, expected two numbers, x and y")
        yield path, float(items[0]), float(items[1])
        return
    if is_ring and depth == 1 and len(items) > 1 and items[0] == items[-1]:
        items = items[:-1]
    for index, each in enumerate(items):
        yield from _positions(each, f"{path}[{index}]", depth - 1, is_ring)


def _list(node: Any, path: str) -> list[Any]:
    if not isinstance(node, list):
        raise InputError(f"{path}: got {_shown(node)}, expected a list")
    return node


TOKEN = re.compile(r"\s*([A-Za-z]+|[(),]|[-+.\d][-+.\w]*|\S)")


def _wkt(text: io.TextIOWrapper, file_name: str, name: str) -> Iterator[Insert]:
    reader = _WktReader(text.read())
    try:
        while reader.token:
            for x, y in reader.geometry():
                yield _insert(x, y, 0.0, name)
    except InputError as error:
        raise LogError(file_name, reader.line, str(error)) from None


class _WktReader:
    """One token after the other; ``token`` is the next one, in capitals, "" at the end."""

    def __init__(self, text: str) -> None:
        self.text, self.at, self.line, self.token = text.rstrip(), 0, 1, ""
        self.take()

    def take(self) -> str:
        """Return the next token and step beyond it."""
        token, found = self.token, TOKEN.match(self.text, self.at)
        self.token = ""
        if found:
            self.line += self.text.count("\n", self.at, found.start(1))
            self.at, self.token = found.end(), found[1].upper()
        return token

    def expect(self, *tokens: str) -> str:
        if self.token not in tokens:
            wanted = " or ".join(map(repr, tokens))
            got = repr(self.token) if self.token else "the end of the text"
            raise InputError(f"got {got}, expected {wanted}")
        return self.take()

    def geometry(self) -> Iterator[tuple[float, float]]:
        kinds = {kind.upper(): (kind, depth) for kind, depth in DEPTHS.items()}
        tag = self.expect(*kinds, "GEOMETRYCOLLECTION")
        if self.expect("(", "EMPTY") == "EMPTY":
            return
        if tag == "GEOMETRYCOLLECTION":
            yield from self.geometry()
            while self.expect(",", ")") == ",":
                yield from self.geometry()
            return
        kind, depth = kinds[tag]
        yield from self.group(max(depth, 1), kind)

    def group(self, depth: int, kind: str) -> Iterator[tuple[float, float]]:
        """Yield the vertices of a group, beyond whose "(" the reader is."""
        if depth > 1:
            while True:
                if self.expect("(", "EMPTY") == "(":
                    yield from self.group(depth - 1, kind)
                if self.expect(",", ")") == ")":
                    return
        vertices = []
        while True:
            wrapped = kind == "MultiPoint" and self.token == "("
            if wrapped:
                self.take()
            vertices.append((self.number(), self.number()))
            if wrapped:
                self.expect(")")
            end = ")" if kind == "Point" else self.expect(",", ")")
            if end == ")":
                break
        if kind == "Point":
            self.expect(")")
        is_closed = kind.endswith("Polygon") and len(vertices) > 1 and vertices[0] == vertices[-1]
        yield from vertices[:-1] if is_closed else vertices

    def number(self) -> float:
        if not re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)(E[-+]?\d+)?", self.token):
            got = repr(self.token) if self.token else "the end of the text"
            raise InputError(f"got {got}, expected a number; positions are two, x and y")
        return float(self.take())


TEXTS = {"csv": _csv, "geojson": _geojson, "wkt": _wkt}
