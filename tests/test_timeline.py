"""The order of events, as a sequence: programs of their own (timeline.cpp, labels.cpp)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import programs

if TYPE_CHECKING:
    from pathlib import Path


@programs.needs_a_compiler
def test_the_timeline_agrees_with_a_plain_list(tmp_path: Path) -> None:
    programs.passes("timeline.cpp", tmp_path, "0", "150")


@programs.needs_a_compiler
def test_labels_rise_wherever_items_come(tmp_path: Path) -> None:
    programs.passes("labels.cpp", tmp_path)
