"""The `flintknap` command: its verbs, what they take, and how it ends.

Data go to standard output: answers and contacts of a replay as lines of JSON, each at once;
what `info` and `check` found; a log or a summary where it is asked for. Messages, the summary for
people and the progress bar (on a terminal only) go to standard error.

Exit codes: 0; 1 for bad input, for files that cannot be read or written, and where `check` finds a
law broken; 2 for bad usage; 130 after Ctrl-C and 141 when nobody reads the output any more, both
without a word. Where the code is not 0, no output file was made or changed.

What the verbs do is in `commands.py`, which is imported once it is clear which one is wanted.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import textwrap
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flintknap.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

INTERRUPTED = 128 + 2  # as a shell reports death by SIGINT
BROKEN_PIPE = 128 + 13  # as a shell reports death by SIGPIPE

LOG = "JSON Lines, gzip or not; - is standard input"
WIDTH = 79  # columns of help
EXIT_CODES = """\
Exit codes: 0; 1 if input is refused or a file cannot be read or written, and
if a check fails; 2 for bad usage; 130 after Ctrl-C; 141 if nobody reads on."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code; bad usage raises SystemExit(2)."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.verb == "replay":
        wrong = _misused(options)
        if wrong:
            options.parser.error(wrong)
    try:
        from flintknap import commands

        verb = {
            "replay": commands.replay,
            "convert": commands.convert,
            "info": commands.info,
            "check": commands.check,
        }
        code = verb[options.verb](options)
        sys.stdout.flush()
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        # Python flushes standard output once more as it exits; let it have somewhere to go.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except (InputError, OSError) as error:
        print(f"flintknap: {error}", file=sys.stderr)
        return 1
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="flintknap",
        description="Live object boundaries from streams of points.",
        epilog="""\
examples:
  flintknap convert points.csv log.jsonl.gz     make a log of a table of points
  flintknap info log.jsonl.gz                   what is in it
  flintknap replay log.jsonl.gz --svg out.svg   its objects, drawn
  flintknap VERB --help                         more about a verb

"""
        + EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=_Version)
    verbs = parser.add_subparsers(metavar="VERB", dest="verb", required=True)

    verb = _add(
        verbs,
        "replay",
        "[OPTION ...] LOG",
        "apply an event log and report the boundary of each object",
        "Apply an event log and report the boundary of each object. Answers to its queries go to "
        "standard output as JSON Lines, the summary to standard error.",
        """\
  flintknap replay log.jsonl.gz --svg boundary.svg --geojson boundary.geojson
  flintknap replay log.jsonl.gz --svg - --layers points,graph:gabriel > it.svg
  flintknap replay log.jsonl.gz --png it.png --layers boundary,flintstones:4
  flintknap replay log.jsonl.gz --gif growing.gif --layers boundary,smooth
  flintknap replay log.jsonl.gz --frames new --every 50
  ffmpeg -i new/%06d.png growing.mp4
  flintknap replay log.jsonl.gz --until 3600 --object hull --json
  tail -f feed.jsonl | flintknap replay - --window 60 > answers.jsonl""",
        """\
layers, drawn in the order of the list, later ones over earlier ones:
  points             every point
  graph:GRAPH        a gamma-graph: delaunay, gabriel, hull, void, complete,
                     beta=B (a beta-skeleton), d=D (gamma1 from D to 1);
                     delaunay if :GRAPH is left out
  boundary           the object, and a cross on each point left inside
  approximation:CUT  a polygon through some vertices: CUT is a level, such as
                     4, or how far the boundary may stray from each edge, such
                     as tolerance=0.5
  flintstones:CUT    the areas that hold the boundary, one for each such edge
  smooth:CUT         the smooth curve through its vertices; through all of the
                     boundary if :CUT is left out
  control:CUT        the control polygon of that curve""",
    )
    verb.add_argument("log", metavar="LOG", help=LOG)
    which = verb.add_argument_group("which events")
    which.add_argument("--until", metavar="T", type=_time, help="leave out events later than T")
    which.add_argument("--object", metavar="NAME", help="leave out other objects")
    which.add_argument(
        "--window", metavar="SECONDS", type=_seconds, help="points leave when they are so old"
    )
    what = verb.add_argument_group("what to report")
    what.add_argument("--json", action="store_true", help="summary as JSON on standard output")
    what.add_argument(
        "--collisions", action="store_true", help="report contacts of objects as they begin and end"
    )
    what.add_argument("--geojson", metavar="FILE", type=Path, help="write the boundaries")
    pictures = verb.add_argument_group(
        "pictures and files",
        _filled(
            "FILE may be -, standard output: then nothing else goes there, and answers are left "
            "out. PNG and GIF need matplotlib: pip install 'flintknap[plot]'."
        ),
    )
    pictures.add_argument("--svg", metavar="FILE", type=Path, help="draw the objects")
    pictures.add_argument("--png", metavar="FILE", type=Path, help="draw the objects, in pixels")
    pictures.add_argument("--gif", metavar="FILE", type=Path, help="draw how they grow")
    pictures.add_argument(
        "--frames", metavar="DIR", type=Path, help="the same, each frame a PNG file in a new folder"
    )
    pictures.add_argument(
        "--every",
        metavar="N",
        type=_count,
        help="a frame every N events; if left out, 100 frames or so",
    )
    shown = pictures.add_mutually_exclusive_group()
    shown.add_argument(
        "--layers",
        metavar="LIST",
        type=_layers,
        help="what to draw, with commas between; if left out, the boundary, and the points where "
        "they are not crowded",
    )
    _add_short_for_layers(shown, "--level", "N", "")
    _add_short_for_layers(shown, "--tolerance", "T", "tolerance=")

    verb = _add(
        verbs,
        "convert",
        "[OPTION ...] SOURCE LOG",
        "make an event log of points in CSV, GeoJSON, WKT, Parquet or Arrow",
        "Make an event log of the points of a file: the rows of a table with columns x, y and "
        "perhaps t and object, or the vertices of geometries. Where no time is told, it is 0.",
        """\
  flintknap convert points.csv log.jsonl.gz
  flintknap convert outline.geojson - | flintknap replay - --svg outline.svg
  zcat points.csv.gz | flintknap convert - log.jsonl --from csv --object hull
  flintknap convert survey.parquet - --object site | gzip > log.jsonl.gz""",
    )
    verb.add_argument("source", metavar="SOURCE", help="what to read; - is standard input")
    verb.add_argument("log", metavar="LOG", help="gzip if it ends in .gz; - is standard output")
    verb.add_argument(
        "--from",
        dest="form",
        metavar="FORMAT",
        choices=["csv", "geojson", "wkt", "parquet", "arrow"],
        help="csv, geojson, wkt, parquet or arrow, if the end of SOURCE does not tell",
    )
    verb.add_argument(
        "--object", metavar="NAME", default="object", help="of points that do not name theirs"
    )

    verb = _add(
        verbs,
        "info",
        "[--json] LOG",
        "say what is in a log",
        "Say what is in a log: of each object its events and their times, and the distinct points "
        "it ends with and their bounding box.",
        """\
  flintknap info log.jsonl.gz
  flintknap info log.jsonl.gz --json | python -m json.tool
  flintknap convert points.csv - | flintknap info -""",
    )
    verb.add_argument("log", metavar="LOG", help=LOG)
    verb.add_argument("--json", action="store_true", help="as JSON")

    verb = _add(
        verbs,
        "check",
        "LOG",
        "replay a log and verify every law of every engine",
        "Replay a log and verify every law and invariant of every engine at its end; one line for "
        "each object. Exit code 1 if one is broken: please report it, with the log.",
        """\
  flintknap check log.jsonl.gz
  zcat log.jsonl.gz | head -1000 | flintknap check -""",
    )
    verb.add_argument("log", metavar="LOG", help=LOG)
    return parser


def _filled(text: str) -> str:
    return textwrap.fill(text, WIDTH)


def _misused(options: argparse.Namespace) -> str:
    """Return what is wrong with how options of `replay` go together, or nothing."""
    files = [options.svg, options.png, options.gif, options.geojson]
    animated = options.gif is not None or options.frames is not None
    drawn = animated or options.svg is not None or options.png is not None
    to_output = files.count(Path("-")) + options.json + options.collisions
    if options.layers is not None and not drawn:
        return "got layers and nothing to draw, expected one of --svg, --png, --gif, --frames, too"
    if options.every is not None and not animated:
        return "got --every and no frames, expected --gif or --frames, too"
    if animated and options.log == "-":
        return "got - for LOG, expected a file: for --gif and --frames it is read twice"
    if Path("-") in files and to_output > 1:
        return "got - for a FILE, expected nothing else to go to standard output"
    return ""


def _layers(text: str) -> str:
    """Return a list of layers as it is if it is one."""
    from flintknap import layers

    try:
        layers.parse(text)
    except InputError as error:
        raise argparse.ArgumentTypeError(str(error).removeprefix("layers: ")) from None
    return text


def _add_short_for_layers(options: Any, name: str, metavar: str, cut: str) -> None:
    options.add_argument(
        name,
        metavar=metavar,
        dest="layers",
        type=lambda text: _layers(f"flintstones:{cut}{text},boundary"),
        help=f"short for --layers flintstones:{cut}{metavar},boundary",
    )


def _count(text: str) -> int:
    with suppress(ValueError):
        value = int(text)
        if value >= 1:
            return value
    raise argparse.ArgumentTypeError(f"got {text!r}, expected an integer, 1 or more")


def _add(
    verbs: Any, name: str, takes: str, summary: str, about: str, examples: str, more: str = ""
) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = verbs.add_parser(
        name,
        usage=f"flintknap {name} {takes}",
        help=summary,
        description=_filled(about),
        epilog="\n\n".join(filter(None, (more, f"examples:\n{examples}", EXIT_CODES))),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(parser=parser)
    return parser


class _Version(argparse.Action):
    """Prints the version, which takes a while to find out, only if it is asked for."""

    def __init__(self, option_strings: Sequence[str], dest: str) -> None:
        super().__init__(option_strings, dest, nargs=0, help="show the version and exit")

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from importlib.metadata import version

        print(f"flintknap {version('flintknap')}")
        parser.exit()


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
