"""The few exceptions of this package."""

from __future__ import annotations


class InputError(ValueError):
    """Input that is refused; nothing of the call was applied.

    ``row`` is the index of the first row at fault, or None where no row is.
    """

    def __init__(self, message: str, *, row: int | None = None) -> None:
        super().__init__(message)
        self.row = row


class LogError(InputError):
    """An event log that is refused, with the ``file`` and ``line`` (from 1) at fault."""

    def __init__(self, file: str, line: int, reason: str) -> None:
        super().__init__(f"{file}:{line}: {reason}")
        self.file = file
        self.line = line


class InvariantError(AssertionError):
    """A law of the engine that does not hold: a bug in this package, never in the input."""
