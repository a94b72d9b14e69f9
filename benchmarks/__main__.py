"""Run benchmarks: `python -m benchmarks [NAME ...] [--quick] [--markdown DIR]`."""

from __future__ import annotations

import argparse
import sys
from importlib import import_module
from pathlib import Path
from time import monotonic

from benchmarks import tables

NAMES = (
    "triangulate",
    "stream",
    "boundary",
    "widening",
    "live",
    "follow",
    "removal",
    "snapshot",
    "memory",
    "replay",
    "query",
    "flintstone",
    "collision",
    "smooth",
    "output",
    "gamma",
    "soak",
)


def report(name: str, *, quick: bool) -> str:
    """Run one benchmark; print each table when it is there; return all in Markdown."""
    script, began = import_module(f"benchmarks.{name}"), monotonic()
    parts = [f"# {name}", (script.__doc__ or "").strip(), tables.setting()]
    print("\n\n".join(parts))
    for table in script.run(quick):
        parts.append(table.markdown())
        print(parts[-1], flush=True)
    took = f"Took {monotonic() - began:.0f} s{' (a quick run)' if quick else ''}"
    parts.append(f"{took}; load averages after it: {tables.load()}.\n")
    print(parts[-1])
    return "\n\n".join(part.rstrip("\n") for part in parts) + "\n"


def main() -> int:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", metavar="NAME", nargs="*", help=f"of {', '.join(NAMES)}; or all")
    parser.add_argument("--quick", action="store_true", help="small sizes, minutes in all")
    parser.add_argument(
        "--markdown", metavar="DIR", type=Path, help="also write each report to DIR/NAME.md"
    )
    chosen = parser.parse_args()
    if unknown := set(chosen.names) - set(NAMES):
        parser.error(f"got {', '.join(sorted(unknown))}, expected names of {', '.join(NAMES)}")
    for name in chosen.names or NAMES:
        text = report(name, quick=chosen.quick)
        if chosen.markdown:
            chosen.markdown.mkdir(parents=True, exist_ok=True)
            (chosen.markdown / f"{name}.md").write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
