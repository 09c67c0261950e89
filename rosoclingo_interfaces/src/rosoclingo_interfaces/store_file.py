"""A small file that one process keeps, and that is whole at any time. Needs no ROS."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

from rosoclingo_interfaces.errors import StoreError


def replace(file: Path, data: bytes) -> None:
    """Puts another file in the place of a file; there is one of them, whole, at any time.

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
    """Keeps other processes from using a file, until this process ends or closes what is returned.

    Raises:
        StoreError: Another one uses it, or there can be no file.
    """
    try:
        descriptor = os.open(f"{file}.lock", os.O_WRONLY | os.O_CREAT, 0o644)
    except OSError as err:
        raise StoreError(
            f"{file} (~store) cannot be made: {err}; name a file in a folder where this node may "
            "write"
        ) from err
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as err:
        os.close(descriptor)
        raise StoreError(
            f"{file} (~store) is used by another node that runs: end that one, or give each its own"
        ) from err
    return descriptor
