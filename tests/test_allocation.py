"""The end of memory in the middle of a call leaves the kernel as before the call.

The work is done by a program of its own, in which any allocation can be made to fail.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
COMPILER = shlex.split(os.environ.get("CXX", "c++"))


@pytest.mark.skipif(shutil.which(COMPILER[0]) is None, reason=f"no compiler: {COMPILER[0]}")
def test_a_failed_allocation_leaves_the_object_as_before_the_call(tmp_path: Path) -> None:
    program = tmp_path / "allocation"
    flags = ["-std=c++17", "-O1", "-ffp-contract=off", "-D_GLIBCXX_ASSERTIONS"]
    flags += ["-I", str(TESTS.parent / "incremental" / "kernel")]
    subprocess.run(
        [*COMPILER, *flags, str(TESTS / "allocation.cpp"), "-o", str(program)], check=True
    )
    done = subprocess.run([str(program)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
