"""Every code block of the README and of the pages in docs/ does what it says, and names have words.

The blocks of a page run in their order, in one namespace and one empty folder.

    ```python       runs; `print(...)  # value` prints that, and words after a colon are for people
    ```text         below Python: what it printed, where comments do not say so
    ```console      `$ command`, and below it what that wrote to standard output
    ```LANG NAME    is the content of the file NAME
    ```             is a drawing, and does not run

A picture that a page makes is the one that it shows.
"""

from __future__ import annotations

import doctest
import importlib
import inspect
import os
import pkgutil
import re
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import flintknap as fk

if TYPE_CHECKING:
    from types import ModuleType

ROOT = Path(__file__).parent.parent
BLOCK = re.compile(r"^```(\S*) ?([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PRINT = re.compile(r"^print\(.*\)(?:  # (.*))?$", re.MULTILINE)
COMMAND = re.compile(r"^\$ (.*)\n((?:(?!\$ ).*\n)*)", re.MULTILINE)
PAGES = {
    path.name: found
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
    if (found := [b for b in BLOCK.findall(path.read_text("utf-8")) if b[0] and b[0][0] != "{"])
}
MODULES: list[ModuleType] = [fk] + [
    importlib.import_module(name)
    for _, name, _ in pkgutil.walk_packages(fk.__path__, "flintknap.")
    if not name.split(".")[-1].startswith("_")
]


@pytest.mark.parametrize("page", PAGES)
def test_the_code_of_a_page_does_what_it_says(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    namespace: dict[str, object] = {}
    followed = [*PAGES[page][1:], ("", "", "")]
    for (language, name, content), after in zip(PAGES[page], followed, strict=True):
        if name:
            Path(name).write_text(content, "utf-8")
        elif language == "python":
            exec(compile(content, page, "exec"), namespace)
            printed = capsys.readouterr().out
            if after[:2] == ("text", ""):
                assert printed == after[2]
            else:
                _assert_said(printed.splitlines(), PRINT.findall(content))
        elif language == "console":
            commands = COMMAND.findall(content)
            assert "".join(f"$ {command}\n{said}" for command, said in commands) == content
            for command, said in commands:
                done = subprocess.run(
                    ["bash", "-o", "pipefail", "-c", command],
                    capture_output=True,
                    text=True,
                    env={**os.environ, "PATH": path},
                )
                assert (done.returncode, done.stdout) == (0, said), done.stderr
        else:
            assert language == "text"
    for shown in (ROOT / "docs").glob("*.svg"):
        made = tmp_path / shown.name
        if made.exists():
            assert made.read_bytes() == shown.read_bytes(), f"cp {made} {shown}"


def _assert_said(printed: list[str], comments: list[str]) -> None:
    assert len(printed) == len(comments)
    for line, comment in zip(printed, comments, strict=True):
        assert not comment or comment == line or comment.startswith(line + ":")


def test_the_readme_shows_what_its_code_prints():
    assert sum(bool(c) for _, _, code in PAGES["README.md"] for c in PRINT.findall(code)) >= 4


def test_examples_in_docstrings_are_right():
    outcomes = [doctest.testmod(module) for module in MODULES]
    assert sum(each.failed for each in outcomes) == 0
    assert sum(each.attempted for each in outcomes) > 0


def test_every_public_name_is_in_the_reference():
    pages = "".join(page.read_text("utf-8") for page in (ROOT / "docs" / "api").glob("*.rst"))
    listed = re.findall(r"^\.\. (?:auto\w+|data):: ([\w.]+)", pages, re.MULTILINE)
    assert {name.removeprefix("flintknap.") for name in listed} >= set(fk.__all__)


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__)
def test_every_public_name_has_a_docstring(module):
    assert module.__doc__
    for name, value in inspect.getmembers(module, inspect.isroutine):
        if value.__module__ == module.__name__ and not name.startswith("_"):
            assert value.__doc__, name
    for name, value in inspect.getmembers(module, inspect.isclass):
        if value.__module__ != module.__name__ or name.startswith("_"):
            continue
        assert value.__doc__, name
        for field in inspect.get_annotations(value):
            if not field.startswith("_"):
                assert re.search(rf"\b{field}\b", value.__doc__), f"{name}.{field}"
        for member, what in vars(value).items():
            if not member.startswith("_") and (inspect.isroutine(what) or hasattr(what, "fget")):
                assert what.__doc__, f"{name}.{member}"
