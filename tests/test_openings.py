"""Gates that stand open, in order of key: a program of its own (openings.cpp)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

import programs

if TYPE_CHECKING:
    from pathlib import Path


@programs.needs_a_compiler
@pytest.mark.parametrize("is_watched", [False, True])
def test_openings_agree_with_a_sorted_list(tmp_path: Path, is_watched: bool) -> None:
    programs.passes("openings.cpp", tmp_path, "0", "40", is_watched=is_watched)
