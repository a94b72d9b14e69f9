"""The `flintknap` command: thin verbs over the library.

`flintknap replay LOG` applies an event log. Data go to standard output: an answer to each query as
a line of JSON, in order, each as soon as it is known, and with --collisions contacts of objects
among them; with --json the summary, on the last line.
Messages, the summary for people and the progress bar (on a terminal only) go to standard error.

Exit codes: 0; 1 for bad input and for files that cannot be read or written; 2 for bad usage; 130
after Ctrl-C and 141 when nobody reads the output any more, both without a word. Where the code is
not 0, no output file was made or changed.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import time
from contextlib import ExitStack, suppress
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
from tqdm import tqdm

from flintknap import export
from flintknap.errors import InputError
from flintknap.log import replacing
from flintknap.replay import replay

if TYPE_CHECKING:
    from collections.abc import Sequence

    from flintknap.events import Answer, Contact
    from flintknap.replay import Replay

INTERRUPTED = 128 + 2  # as a shell reports death by SIGINT
BROKEN_PIPE = 128 + 13  # as a shell reports death by SIGPIPE


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code; bad usage raises SystemExit(2)."""
    options = _parser().parse_args(arguments)
    try:
        _replay(options)
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        # Python flushes standard output once more as it exits; let it have somewhere to go.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except (InputError, OSError) as error:
        print(f"flintknap: {error}", file=sys.stderr)
        return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="flintknap", description="Live object boundaries from streams of points."
    )
    parser.add_argument("--version", action="version", version=f"flintknap {version('flintknap')}")
    verbs = parser.add_subparsers(metavar="VERB", required=True)
    verb = verbs.add_parser(
        "replay",
        help="apply an event log and report the boundary of each object",
        description="Apply an event log and report the boundary of each object. Answers to its "
        "queries go to standard output as JSON Lines, the summary to standard error.",
    )
    verb.add_argument("log", metavar="LOG", help="JSON Lines, gzip or not; - is standard input")
    verb.add_argument("--until", metavar="T", type=_time, help="leave out events later than T")
    verb.add_argument("--object", metavar="NAME", help="leave out other objects")
    verb.add_argument(
        "--window", metavar="SECONDS", type=_seconds, help="points leave when they are so old"
    )
    verb.add_argument("--svg", metavar="FILE", type=Path, help="draw the boundaries")
    verb.add_argument("--geojson", metavar="FILE", type=Path, help="write the boundaries")
    verb.add_argument(
        "--collisions", action="store_true", help="report contacts of objects as they begin and end"
    )
    verb.add_argument("--json", action="store_true", help="summary as JSON on standard output")
    return parser


def _time(text: str) -> float:
    with suppress(ValueError):
        value = float(text)
        if not math.isnan(value):
            return value
    raise argparse.ArgumentTypeError(f"got {text!r}, expected a number")


def _seconds(text: str) -> float:
    with suppress(ValueError):
        value = float(text)
        if 0 < value < math.inf:
            return value
    raise argparse.ArgumentTypeError(f"got {text!r}, expected a positive finite number")


def _replay(options: argparse.Namespace) -> None:
    with ExitStack() as files:
        # Opened first: what cannot be written should not cost a replay.
        outputs = [
            (files.enter_context(replacing(path)), exported)
            for path, exported in ((options.svg, export.svg), (options.geojson, export.geojson))
            if path is not None
        ]
        started = time.perf_counter()
        with tqdm(
            total=None if options.log == "-" else Path(options.log).stat().st_size,
            unit="B",
            unit_scale=True,
            leave=False,
            disable=not sys.stderr.isatty(),
        ) as bar:
            done = replay(
                options.log,
                until=options.until,
                object=options.object,
                window=options.window,
                answer=_print_event,
                contact=_print_event if options.collisions else None,
                progress=lambda position: bar.update(position - bar.n),
            )
            for engine in done.engines.values():
                engine.boundary()
        seconds = time.perf_counter() - started
        for file, exported in outputs:
            file.write(exported(done.engines).encode())
        summary = _summary(done, options.window, seconds)
        if options.json:
            _print(summary)
        else:
            print(_table(summary), file=sys.stderr)


def _print_event(event: Answer | Contact) -> None:
    with tqdm.external_write_mode():
        _print(event)


def _print(value: Answer | Contact | dict[str, Any]) -> None:
    """Print a line of JSON, in UTF-8 whatever the locale, and at once: somebody may wait for it."""
    sys.stdout.buffer.write(msgspec.json.encode(value) + b"\n")
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
                facts["object"] if facts["object"].isprintable() else ascii(facts["object"]),
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
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]
    speed = f"{summary['events']:,} events in {summary['seconds']:.3g} s"
    return "\n".join([*lines, f"{speed}, {summary['events_per_second']:,.0f} a second"])
