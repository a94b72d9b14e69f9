"""Tests of the kernel that are programs of their own, compiled here and run."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
COMPILER = shlex.split(os.environ.get("CXX", "c++"))
FLAGS = ["-std=c++17", "-ffp-contract=off", "-I", str(TESTS.parent / "incremental" / "kernel")]

needs_a_compiler = pytest.mark.skipif(
    shutil.which(COMPILER[0]) is None, reason=f"no compiler: {COMPILER[0]}"
)


def compiles(source: str) -> None:
    """Assert that a file of this folder is correct C++."""
    subprocess.run([*COMPILER, *FLAGS, "-fsyntax-only", str(TESTS / source)], check=True)


def passes(source: str, folder: Path, *arguments: str, is_watched: bool = False) -> None:
    """Assert that a program of this folder, built in `folder`, ends well; maybe with sanitizers."""
    program = folder / Path(source).stem
    flags = [*FLAGS, "-O1", "-D_GLIBCXX_ASSERTIONS"]
    if is_watched:
        flags += ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    subprocess.run([*COMPILER, *flags, str(TESTS / source), "-o", str(program)], check=True)
    done = subprocess.run([str(program), *arguments], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
