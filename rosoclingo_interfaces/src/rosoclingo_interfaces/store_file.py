"""A small file, locked by one process and replaced atomically. Needs no ROS."""

from __future__ import annotations

import fcntl
import json
import os
from pathlib import Path
from typing import Any, Callable, TypeVar

from rosclingo.errors import shorten
from rosoclingo_interfaces.errors import LedgerError

_FORMAT = 1

T = TypeVar("T")


def save(file: Path, part: str, value: Any) -> None:
    """Writes a file that :func:`load` reads.

    Args:
        file: The file.
        part: The name of its content, in a word.
        value: The same as a value of JSON.

    Raises:
        LedgerError: It cannot be written; the message says why.
    """
    text = json.dumps({"format": _FORMAT, part: value}, indent=1) + "\n"
    try:
        replace(file, text.encode())
    except OSError as err:
        raise LedgerError(
            f"{file} (~store) cannot be written: {err}; make room, or let this node write there"
        ) from err


def load(file: Path, part: str, take: Callable[[Any], T], wrong: str, remedy: str) -> T:
    """Reads a file.

    Args:
        file: The file.
        part: The name of its content, as in :func:`save`.
        take: Makes of the value what it means; raises an error of Python's for a wrong one.
        wrong: The message for a file with another content, such as ``is no list``.
        remedy: What to do then, besides naming another file.

    Raises:
        LedgerError: The file cannot be read, or holds something else.
    """
    try:
        said = json.loads(file.read_bytes())
        if said["format"] != _FORMAT:
            raise ValueError(
                f"its format is {said['format']!r:.80}, and this version knows {_FORMAT}"
            )
        return take(said[part])
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as err:
        raise LedgerError(
            f"{file} (~store) {wrong}: {shorten(repr(err))}; name another file, or {remedy}"
        ) from err


def replace(file: Path, data: bytes) -> None:
    """Replaces a file atomically.

    Raises:
        OSError: It cannot be written; the old file may be there still.
    """
    new = f"{file}.new"
    descriptor = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
    try:
        while data:
            data = data[os.write(descriptor, data) :]
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
    os.replace(new, file)
    folder = os.open(file.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def reserve(file: Path) -> int:
    """Locks a file until this process ends or closes the lock that is returned.

    Raises:
        LedgerError: Another one uses it, or there can be no file.
    """
    try:
        descriptor = os.open(f"{file}.lock", os.O_WRONLY | os.O_CREAT, 0o644)
    except OSError as err:
        raise LedgerError(
            f"{file} (~store) cannot be made: {err}; name a file in a folder where this node may "
            "write"
        ) from err
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as err:
        os.close(descriptor)
        raise LedgerError(
            f"{file} (~store) is used by another node that runs: end that one, or give each its own"
        ) from err
    return descriptor
