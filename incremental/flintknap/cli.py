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
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flintknap.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

INTERRUPTED = 128 + 2  # as a shell reports death by SIGINT
BROKEN_PIPE = 128 + 13  # as a shell reports death by SIGPIPE

LOG = "JSON Lines, gzip or not; - is standard input"
EXIT_CODES = (
    "Exit codes: 0; 1 if input is refused or a file cannot be read or written; 2 for bad usage."
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code; bad usage raises SystemExit(2)."""
    parser = _parser()
    options = parser.parse_args(arguments)
    drawn = options.verb == "replay" and (options.level, options.tolerance) != (None, None)
    if drawn and options.svg is None:
        parser.error("--level and --tolerance say what --svg draws, which is not given")
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
  flintknap convert points.csv log.jsonl.gz       make a log of a table of points
  flintknap info log.jsonl.gz                     what is in it
  flintknap replay log.jsonl.gz --svg out.svg     its objects, drawn
  flintknap VERB --help                           more about a verb

"""
        + EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=_Version)
    verbs = parser.add_subparsers(metavar="VERB", dest="verb", required=True)

    verb = _add(
        verbs,
        "replay",
        "apply an event log and report the boundary of each object",
        "Apply an event log and report the boundary of each object. Answers to its "
        "queries go to standard output as JSON Lines, the summary to standard error.",
        """\
  flintknap replay log.jsonl.gz --svg boundary.svg --geojson boundary.geojson
  flintknap replay log.jsonl.gz --svg coarse.svg --level 4
  flintknap replay log.jsonl.gz --until 3600 --object hull --json
  tail -f feed.jsonl | flintknap replay - --window 60 > answers.jsonl""",
    )
    verb.add_argument("log", metavar="LOG", help=LOG)
    verb.add_argument("--until", metavar="T", type=_time, help="leave out events later than T")
    verb.add_argument("--object", metavar="NAME", help="leave out other objects")
    verb.add_argument(
        "--window", metavar="SECONDS", type=_seconds, help="points leave when they are so old"
    )
    verb.add_argument("--svg", metavar="FILE", type=Path, help="draw the boundaries")
    cut = verb.add_mutually_exclusive_group()
    cut.add_argument(
        "--level", metavar="N", type=_level, help="draw the approximation of that level, too"
    )
    cut.add_argument(
        "--tolerance", metavar="T", type=_tolerance, help="or that which strays no farther than T"
    )
    verb.add_argument("--geojson", metavar="FILE", type=Path, help="write the boundaries")
    verb.add_argument(
        "--collisions", action="store_true", help="report contacts of objects as they begin and end"
    )
    verb.add_argument("--json", action="store_true", help="summary as JSON on standard output")

    verb = _add(
        verbs,
        "convert",
        "make an event log of points in CSV, GeoJSON, WKT, Parquet or Arrow",
        "Make an event log of the points of a file: the rows of a table with columns x, y and "
        "perhaps t and object, or the vertices of geometries. Where no time is told, it is 0.",
        """\
  flintknap convert points.csv log.jsonl.gz
  flintknap convert outline.geojson - | flintknap replay - --svg outline.svg
  zcat points.csv.gz | flintknap convert - log.jsonl --from csv --object hull""",
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
        "say what is in a log",
        "Say what is in a log: of each object its events and their times, and the distinct points "
        "it ends with and their bounding box.",
        """\
  flintknap info log.jsonl.gz
  flintknap info log.jsonl.gz --json | python -m json.tool""",
    )
    verb.add_argument("log", metavar="LOG", help=LOG)
    verb.add_argument("--json", action="store_true", help="as JSON")

    verb = _add(
        verbs,
        "check",
        "replay a log and verify every law of every engine",
        "Replay a log and verify every law and invariant of every engine at its end; one line for "
        "each object. Exit code 1 if one is broken: please report it, with the log.",
        """\
  flintknap check log.jsonl.gz""",
    )
    verb.add_argument("log", metavar="LOG", help=LOG)
    return parser


def _level(text: str) -> int:
    with suppress(ValueError):
        value = int(text)
        if value >= 0:
            return value
    raise argparse.ArgumentTypeError(f"got {text!r}, expected an integer, 0 or more")


def _tolerance(text: str) -> float:
    with suppress(ValueError):
        value = float(text)
        if value >= 0:  # false, too, for what is not a number
            return value
    raise argparse.ArgumentTypeError(f"got {text!r}, expected a number, 0 or more")


def _add(verbs: Any, name: str, summary: str, about: str, examples: str) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = verbs.add_parser(
        name,
        help=summary,
        description=about,
        epilog=f"examples:\n{examples}\n\n{EXIT_CODES}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
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
