"""The end of memory in the middle of a call leaves the kernel as before the call.

The work is done by a program of its own, in which any allocation can be made to fail.
"""

from __future__ import annotations

from pathlib import Path

import programs


@programs.needs_a_compiler
def test_a_failed_allocation_leaves_the_object_as_before_the_call(tmp_path: Path) -> None:
    programs.passes("allocation.cpp", tmp_path)
