"""Snapshots: an engine as one file, from which it goes on as if nothing had happened.

A file is a line that names format and version, the length of the rest, the kernel's arrays as they
lie in memory, and a checksum of it all. So it loads at the speed of the disk, without triangulating
anything; ids, multiplicities, the revision and every answer are those that were saved.

A snapshot is a cache, not an archive: another version of the package may refuse it; the log of
events is what lasts. It appears complete or not at all. One that was cut short or altered is
refused by its checksum; that is no defence against forgery, so load only what you trust.
Cost: O(n), about 140 bytes a point.
"""

from __future__ import annotations

import hashlib
import os
from typing import TYPE_CHECKING

import numpy as np

from flintknap.engine import Engine
from flintknap.errors import InputError
from flintknap.log import replacing

if TYPE_CHECKING:
    from numpy.typing import NDArray

HEADER = b"flintknap snapshot 1\n"
LENGTH_BYTES = 8
SUM_BYTES = 32


def write(path: str | os.PathLike[str], arrays: NDArray[np.uint8]) -> None:
    """Write an engine's arrays to one file, replacing what was there. OSError where that fails."""
    length = len(arrays).to_bytes(LENGTH_BYTES, "little")
    with replacing(path) as file:
        for part in (HEADER, length, arrays.data, _checksum(length, arrays)):
            file.write(part)


def load(path: str | os.PathLike[str]) -> Engine:
    """Return the engine that was saved to a file. O(n).

    Raises InputError, naming the file, for anything but a complete and unaltered snapshot; OSError
    where the file cannot be read.
    """
    data = np.fromfile(path, np.uint8)
    header, rest = data[: len(HEADER)].tobytes(), data[len(HEADER) :]
    if header != HEADER:
        raise InputError(f"{os.fspath(path)}: got {header!r}, expected {HEADER!r}")
    length, rest = rest[:LENGTH_BYTES].tobytes(), rest[LENGTH_BYTES:]
    expected = int.from_bytes(length, "little") + SUM_BYTES
    if len(length) < LENGTH_BYTES or len(rest) != expected:
        raise InputError(f"{os.fspath(path)}: got {len(rest)} bytes, expected {expected}")
    arrays = rest[:-SUM_BYTES]
    if rest[-SUM_BYTES:].tobytes() != _checksum(length, arrays):
        raise InputError(f"{os.fspath(path)}: got altered data, expected what was saved")
    try:
        return Engine.restored(arrays)
    except ValueError as error:
        raise InputError(f"{os.fspath(path)}: got arrays of which {error}") from None


def _checksum(length: bytes, arrays: NDArray[np.uint8]) -> bytes:
    state = hashlib.sha256(HEADER + length)  # in hardware nearly everywhere
    state.update(arrays.data)
    return state.digest()
