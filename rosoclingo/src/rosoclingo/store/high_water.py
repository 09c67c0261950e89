"""The high-water mark of a store: the last transaction that was acknowledged, in the main file.

SQLite writes a transaction to its log, and to the main file only at a checkpoint. So a main file
does not know that it ever had a log, and is taken for whole without it. Here it is told: after each
durable commit, the transaction's number is written in place into the main file, to a page with the
blob of one row, which SQLite does not write again. File and log together must reach that number.

The mark costs no fsync. It is written when the log is on the disk, so a failure of power leaves an
older mark at most, and never that of a transaction which is lost. The number is in one sector of
the disk, which is written as a whole; details are in the others, and left out if they are torn.

>>> mark = HighWaterMark("12ab", 7, {"g1": "visit(3)"})
>>> decode(bytes(_BEFORE) + encode(mark)) == mark
True
>>> decode(bytes(BLOB_BYTES)) is None
True
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
from pathlib import Path
from typing import Any, Optional

PAGE_BYTES = 4096
BLOB_BYTES = 4000  # so many fit into one page, at its end
_SECTOR = 512
_BEFORE = _SECTOR - (PAGE_BYTES - BLOB_BYTES)  # bytes of the blob up to the page's second sector
_DETAILS = BLOB_BYTES - _BEFORE - _SECTOR
_DIGEST = 16


@dataclasses.dataclass(frozen=True)
class HighWaterMark:
    """The number of the last acknowledged transaction, with its store and details.

    Attributes:
        store: Which store it is of.
        number: Its number.
        details: What the store's user has said of it, as JSON knows it; None if that is lost.
    """

    store: str
    number: int
    details: Any = None


class HighWaterMarkFile:
    """Writes the mark into the main file. Not thread-safe.

    It has a file descriptor of its own. POSIX drops all locks that a process has on a file when any
    of its descriptors is closed. So close it after SQLite's connection.
    """

    def __init__(self, path: Path, page: int) -> None:
        """Opens the main file.

        Args:
            path: The file.
            page: The number of the blob's page, counted from 1.

        Raises:
            OSError: It cannot be opened.
        """
        self._file = os.open(str(path), os.O_RDWR | os.O_CLOEXEC)
        self._offset = (page - 1) * PAGE_BYTES + _SECTOR

    def write(self, mark: HighWaterMark) -> None:
        """Replaces the mark.

        Raises:
            OSError: It cannot be written.
        """
        os.pwrite(self._file, encode(mark), self._offset)

    def close(self) -> None:
        """Closes the file."""
        os.close(self._file)


def encode(mark: HighWaterMark) -> bytes:
    """Returns the bytes of a mark; details that are too long are left out."""
    core = _sealed([mark.store, mark.number], _SECTOR)
    return core + _sealed([mark.number, mark.details], _DETAILS)


def decode(blob: bytes) -> Optional[HighWaterMark]:
    """Returns the mark that is in a blob; None if there is none, or if it is not whole."""
    core = _opened(blob[_BEFORE : _BEFORE + _SECTOR])
    if core is None:
        return None
    store, number = core
    details = _opened(blob[_BEFORE + _SECTOR :])
    is_of_it = details is not None and details[0] == number
    return HighWaterMark(store, number, details[1] if is_of_it else None)


def _sealed(value: Any, size: int) -> bytes:
    text = json.dumps(value).encode()
    if _DIGEST + len(text) > size:
        return bytes(size)
    return (_digest(text) + text).ljust(size, b"\0")


def _opened(data: bytes) -> Any:
    text = data[_DIGEST:].rstrip(b"\0")
    return json.loads(text) if text and _digest(text) == data[:_DIGEST] else None


def _digest(text: bytes) -> bytes:
    return hashlib.blake2b(text, digest_size=_DIGEST).digest()
