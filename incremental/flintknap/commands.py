"""What the verbs of the command do; `cli.py` says what they are called and take.

Data go to standard output, words to standard error. Every verb returns the exit code: 1 only where
`check` found a law broken; what is refused is raised.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from contextlib import ExitStack, contextmanager
from functools import partial
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import msgspec
import numpy as np
from tqdm import tqdm

from flintknap import convert as formats
from flintknap import export, log, picture, svg
from flintknap.errors import InputError, InvariantError
from flintknap.log import filling, replacing
from flintknap.replay import replay as replayed

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Iterator, Sequence
    from contextlib import AbstractContextManager

    from flintknap.animation import Camera
    from flintknap.events import Answer, Contact, Event, Insert
    from flintknap.replay import Replay

STANDARD = Path("-")  # output, as the name of a file
PNG_SIZE = 2000  # pixels of its longer side, and the margins


def replay(options: argparse.Namespace) -> int:
    """Apply a log; print answers and, with --json, the summary; write pictures and polygons."""
    chosen = {"until": options.until, "object": options.object}
    is_alone = STANDARD in (options.svg, options.png, options.gif, options.geojson)
    if options.png or options.gif or options.frames:
        _require_plot()
    with ExitStack() as files:
        # Opened first: what cannot be written, or drawn, should not cost a replay.
        outputs = [
            (files.enter_context(_output(path)), made)
            for path, made in (
                (options.svg, partial(_svg, layers=options.layers)),
                (options.png, partial(_png, layers=options.layers)),
                (options.geojson, _geojson),
            )
            if path is not None
        ]
        camera = _camera(options, chosen, files)
        started = time.perf_counter()
        bar = _bar(*_size(options.log)) if camera is None else _bar(camera.frames, "frame")
        with bar as progress:
            done = replayed(
                options.log,
                **chosen,
                window=options.window,
                answer=_ignore if is_alone else _print_event,
                contact=_print_event if options.collisions else None,
                **({"progress": progress} if camera is None else camera.hooks(progress)),
            )
            for engine in done.engines.values():
                engine.boundary()
        seconds = time.perf_counter() - started - (camera.seconds if camera else 0)
        for file, made in outputs:
            file.write(made(done))
            file.flush()  # what cannot be written should not come after the summary
        if camera is not None:
            camera.finish(done.engines)
        summary = _summary(done, options.window, seconds)
        if options.json:
            _print(summary)
        else:
            print(_table(summary), file=sys.stderr)
    return 0


def convert(options: argparse.Namespace) -> int:
    """Write the points of a file as a log."""
    counts: Counter[str] = Counter()

    inserts = formats.read(options.source, options.form, name=options.object)
    first = list(islice(inserts, 1))  # what cannot be read should not begin a log

    def counted() -> Iterator[Insert]:
        for insert in chain(first, inserts):
            counts[insert.object] += 1
            yield insert

    log.write(options.log, counted())
    print(f"{counts.total():,} points, {_plural(len(counts), 'object')}", file=sys.stderr)
    return 0


def info(options: argparse.Namespace) -> int:
    """Print what is in a log: of each object its events, times, distinct points and box."""
    events: dict[str, Counter[str]] = {}
    times: dict[str, tuple[float, float]] = {}

    def applied(block: Sequence[Event]) -> None:
        for event in block:
            first, last = times.get(event.object, (event.t, event.t))
            times[event.object] = min(first, event.t), max(last, event.t)
            kinds = events.setdefault(event.object, Counter())
            kinds[type(event).__name__.lower()] += 1

    with _bar(*_size(options.log)) as progress:
        done = replayed(options.log, progress=progress, applied=applied)
    objects: list[dict[str, Any]] = []
    for name, engine in done.engines.items():
        xy = engine.points()
        objects.append(
            {
                "object": name,
                "events": dict(sorted(events[name].items())),
                "t": times[name],
                "points": len(xy),
                "box": [*xy.min(axis=0).tolist(), *xy.max(axis=0).tolist()] if len(xy) else None,
            }
        )
    if options.json:
        _print({"objects": objects, "events": sum(done.events.values())})
        return 0
    rows = [["object", "events", "from t", "to t", "points", "x", "", "y", ""]]
    for facts in objects:
        box = facts["box"] or [np.nan] * 4
        numbers = [*facts["t"], *(box[i] for i in (0, 2, 1, 3))]
        cells = ["" if np.isnan(v) else f"{v:.10g}" for v in numbers]
        kinds = ", ".join(_plural(n, kind) for kind, n in facts["events"].items())
        rows.append([_name(facts["object"]), kinds, *cells[:2], f"{facts['points']:,}", *cells[2:]])
    _say(_columns(rows))
    return 0


def check(options: argparse.Namespace) -> int:
    """Replay a log and verify every law of every engine; print a line for each object."""
    with _bar(*_size(options.log)) as progress:
        done = replayed(options.log, progress=progress)
    broken = 0
    for name, engine in done.engines.items():
        verdict = "ok"
        try:
            engine.check()
        except InvariantError as error:
            verdict = f"BROKEN: {error}"
            broken += 1
        _say(f"{_name(name)}: {len(engine):,} points, {engine.boundary().status}, {verdict}")
    return 1 if broken else 0


def _require_plot() -> None:
    try:
        import flintknap.plot  # noqa: F401
    except ImportError as error:
        raise InputError(str(error)) from None


def _svg(done: Replay, *, layers: str | None) -> bytes:
    return svg.draw(done.engines, layers).encode()


def _png(done: Replay, *, layers: str | None) -> bytes:
    from flintknap import plot

    return plot.png(picture.compose(done.engines, layers), PNG_SIZE)


def _geojson(done: Replay) -> bytes:
    return export.geojson(done.engines).encode()


def _camera(options: argparse.Namespace, chosen: dict[str, Any], files: ExitStack) -> Camera | None:
    """Return what takes the frames that are asked for; the log is looked through for it."""
    if not options.gif and not options.frames:
        return None
    from flintknap import animation

    gif = files.enter_context(_output(options.gif)) if options.gif else None
    folder = files.enter_context(filling(options.frames)) if options.frames else None
    with _bar(*_size(options.log)) as progress:
        survey = animation.survey(options.log, **chosen, progress=progress)
    return animation.Camera(survey, options.every, options.layers, gif, folder)


def _output(path: Path) -> AbstractContextManager[BinaryIO]:
    # Standard output may be unbuffered, and then would take a part of a picture for the whole.
    return open(1, "wb", closefd=False) if path == STANDARD else replacing(path)


@contextmanager
def _bar(total: int | None, unit: str) -> Iterator[Callable[[int], Any]]:
    """Show how much of something is done, on a terminal only."""
    with tqdm(
        total=total,
        unit=unit,
        unit_scale=unit == "B",
        leave=False,
        disable=not sys.stderr.isatty(),
    ) as bar:
        yield lambda position: bar.update(position - bar.n)


def _size(log: str) -> tuple[int | None, str]:
    """Return how many bytes there are to read, if that is known."""
    return None if log == "-" else Path(log).stat().st_size, "B"


def _ignore(_: object) -> None:
    """Do nothing with what is told."""


def _print_event(event: Answer | Contact) -> None:
    with tqdm.external_write_mode():
        _print(event)


def _print(value: Answer | Contact | dict[str, Any]) -> None:
    """Print a line of JSON, at once: somebody may wait for it."""
    _say(msgspec.json.encode(value).decode())


def _say(text: str) -> None:
    """Print to standard output, in UTF-8 whatever the locale."""
    sys.stdout.buffer.write(text.encode() + b"\n")
    sys.stdout.buffer.flush()


def _summary(done: Replay, window: float | None, seconds: float) -> dict[str, Any]:
    boundaries = {name: engine.boundary() for name, engine in done.engines.items()}
    events = sum(done.events.values())
    return {
        "objects": [
            {
                "object": name,
                "events": done.events[name],
                "expired": done.windows[name].expired if name in done.windows else 0,
                "points": len(done.engines[name]),
                "status": boundary.status,
                "inside": len(boundary.inside),
                "vertices": len(boundary),
                "length": boundary.length,
                "area": boundary.area,
                "digest": done.engines[name].digest(),
            }
            for name, boundary in boundaries.items()
        ],
        "window": window,
        "events": events,
        "seconds": seconds,
        "events_per_second": events / seconds,
    }


def _table(summary: dict[str, Any]) -> str:
    """Lay the summary out for people: a column for each property, a row for each object."""
    rows = [["object", "events", "expired", "points", "status", "vertices", "area", "digest"]]
    for facts in summary["objects"]:
        status = facts["status"]
        if status == "locked":
            status += f", {facts['inside']:,} inside"
        rows.append(
            [
                _name(facts["object"]),
                f"{facts['events']:,}",
                f"{facts['expired']:,}",
                f"{facts['points']:,}",
                status,
                f"{facts['vertices']:,}",
                f"{facts['area']:.6g}",
                facts["digest"],
            ]
        )
    if summary["window"] is None:
        rows = [row[:2] + row[3:] for row in rows]
    speed = f"{summary['events']:,} events in {summary['seconds']:.3g} s"
    return f"{_columns(rows)}\n{speed}, {summary['events_per_second']:,.0f} a second"


def _columns(rows: list[list[str]]) -> str:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join("  ".join(map(str.ljust, row, widths)).rstrip() for row in rows)


def _name(name: str) -> str:
    """Return the name of an object as a terminal may see it."""
    return name if name.isprintable() else ascii(name)


def _plural(count: int, noun: str) -> str:
    plural = f"{noun[:-1]}ies" if noun.endswith("y") else f"{noun}s"
    return f"{count:,} {noun if count == 1 else plural}"
