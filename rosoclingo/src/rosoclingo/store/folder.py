"""The folder of a store: locked by one process, and made or put aside in one step.

::

    run.store/
      run.sqlite       the database
      run.sqlite-wal   its write-ahead log
      mark             the high-water mark: the last transaction that was acknowledged

SQLite takes a database for whole if its log is gone, was cut, or is an older one. So after each
durable commit, the number of the transaction is written into the mark, in place. It is shorter than
a sector of the disk, and needs no fsync: a failure of power may leave an older mark, but never one
of a transaction that is lost.

>>> from tempfile import TemporaryDirectory
>>> with TemporaryDirectory() as parent:
...     with contextlib.closing(StoreFolder(Path(parent) / "run.store")) as folder:
...         folder.write_mark(Mark("0123456789abcdef", 7))
...         folder.mark
Mark(store='0123456789abcdef', number=7)
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import re
import sqlite3
import time
from pathlib import Path
from typing import Callable, Iterator, NamedTuple, Optional

from rosoclingo.errors import StoreError

APPLICATION = b"RoSC"  # which program's database it is
FRESH = "start with resume:=fresh, which keeps it aside and begins anew"
_WAIT_SECONDS = 5.0  # for a node that is just ending, and has the folder
_POLL_SECONDS = 0.05
_DATABASE, _MARK = "run.sqlite", "mark"
_LOG, _NEW = f"{_DATABASE}-wal", f"{_DATABASE}.new"
_MARK_FORMAT = re.compile(rb"([0-9a-f]{16}) ([0-9]{20})\n")
_IS_USED = "another node that still runs uses it; give each a store of its own"


class Mark(NamedTuple):
    """The last transaction that was acknowledged.

    Attributes:
        store: The id of its store, 16 hexadecimal digits.
        number: Its number.
    """

    store: str
    number: int


class StoreFolder:
    """The folder of a store, which no other process has until :meth:`close`. Not thread-safe.

    Attributes:
        path: The folder.
        database: The file of its database.
        is_empty: Whether there is nothing in it.
        is_new: Whether there is no store in it yet; a process may have died while it made one.
    """

    def __init__(self, path: Path) -> None:
        """Locks a folder, which is made if there is none.

        Raises:
            StoreError: It is another file or folder, or cannot be used; the message says why.
        """
        self.path = Path(os.path.realpath(path))
        self.database = self.path / _DATABASE
        self._mark = -1
        with told(self.path, "cannot be opened"):
            self._lock = _lock(self.path)
            names = os.listdir(self._lock)
            if not all(os.access(self.path / name, os.W_OK) for name in (".", *names)):
                self.close()
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        self.is_empty = not names
        is_half_made = any(name.startswith(_NEW) for name in names)
        self.is_new = self.is_empty or (_DATABASE not in names and is_half_made)
        if names and not any(name.startswith(_DATABASE) or name == _MARK for name in names):
            self.close()
            raise StoreError(f"{self.path} has other files, and is no store; give another name")

    def close(self) -> None:
        """Lets another process have it; may be called twice."""
        for descriptor in (self._mark, self._lock):
            if descriptor >= 0:
                os.close(descriptor)
        self._mark = self._lock = -1

    def begin(self) -> Path:
        """Removes what a process has left that made a store; returns where to make a database."""
        (self.path / _MARK).unlink(missing_ok=True)
        _sync(self.path)  # so that no mark is left alone, whose database would be missed
        for one in self.path.glob(f"{_NEW}*"):
            one.unlink()
        return self.path / _NEW

    def complete(self, store: str) -> None:
        """Makes a new store of the database that has been made; it outlasts a failure of power."""
        _sync(self.path)  # so that no mark is there without a database
        self.write_mark(Mark(store, 0), durable=True)
        _sync(self.path.parent)
        os.replace(self.path / _NEW, self.database)
        _sync(self.path)

    @property
    def mark(self) -> Optional[Mark]:
        """The mark; None if it is gone or damaged."""
        try:
            found = _MARK_FORMAT.match((self.path / _MARK).read_bytes())
        except FileNotFoundError:
            return None
        return None if found is None else Mark(found[1].decode(), int(found[2]))

    def write_mark(self, mark: Mark, *, durable: bool = False) -> None:
        """Replaces the mark.

        Args:
            mark: The new one.
            durable: Whether it outlasts a failure of power, as one in a new file has to.
        """
        if self._mark < 0:
            self._mark = os.open(self.path / _MARK, os.O_RDWR | os.O_CREAT, 0o644)
        os.pwrite(self._mark, f"{mark.store} {mark.number:020}\n".encode(), 0)
        if durable:
            os.fsync(self._mark)
            _sync(self.path)

    @property
    def size(self) -> Optional[int]:
        """The bytes of the database and of its log; None if that is unknown."""
        files = (self.database, self.path / _LOG)
        try:
            return sum(file.stat().st_size for file in files if file.exists())
        except OSError:
            return None


def put_aside(path: Path, done: Callable[[], None] = lambda: None) -> Optional[Path]:
    """Renames a store, so that another one can begin; returns its new name, if there was one.

    Args:
        path: The folder, or the file of an earlier version.
        done: Called when nothing is left in its place, before this returns.

    Raises:
        StoreError: It cannot be renamed, or another node has it, or it is no store.
    """
    path, aside = Path(os.path.realpath(path)), None
    with told(path, "cannot be kept aside"):
        if path.is_dir():
            with contextlib.closing(StoreFolder(path)) as folder:
                if not folder.is_empty:
                    aside = _free_name(path)
                    path.rename(aside)
        elif path.exists():
            _old_format(path)
            aside = _free_name(path)
            for suffix in ("-wal", ""):  # in this order, since the log alone is taken for nothing
                if Path(f"{path}{suffix}").exists():
                    os.rename(f"{path}{suffix}", f"{aside}{suffix}")
        _sync(path.parent)
    done()
    return aside


@contextlib.contextmanager
def told(path: Path, what: str) -> Iterator[None]:
    """A context that converts errors of SQLite and of files to this package's, with a remedy.

    Args:
        path: The store.
        what: What cannot be done with it.
    """
    try:
        yield
    except (sqlite3.DatabaseError, OSError) as err:
        text = err.strerror or str(err) if isinstance(err, OSError) else str(err)
        if any(word in text for word in ("malformed", "not a database", "unsupported file format")):
            raise damaged(path, text) from err
        if "locked" in text:
            remedy = _IS_USED
        elif "full" in text or "No space" in text:
            remedy = "there is no more room; make some, and start again"
        elif any(word in text for word in ("I/O", "Input/output", "quota", "too large")):
            remedy = f"{text}; the disk fails, or a quota or limit is reached; start again then"
        else:
            remedy = (
                f"{text}; is {path.parent} there, and may this user write to it and to {path.name}?"
            )
        raise StoreError(f"the store {path} {what}: {remedy}") from err


def damaged(path: Path, reason: object, remedy: str = "") -> StoreError:
    """Returns the error for a store that is not whole.

    Args:
        path: The store.
        reason: What is wrong with it.
        remedy: What may be done besides putting files back or beginning anew, and ``or``.
    """
    return StoreError(
        f"the store {path} is damaged: {reason}; put back the files that belong to it, or "
        f"{remedy}{FRESH}"
    )


def _lock(path: Path) -> int:
    """Locks a folder until the descriptor is closed that is returned, or this process ends."""
    until = time.monotonic() + _WAIT_SECONDS
    while True:
        if path.exists() and not path.is_dir():
            number = _old_format(path)
            raise StoreError(
                f"the store {path} is a file of an earlier version of rosoclingo, with the format "
                f"{number}; now a store is a folder: have its run end with that version, or {FRESH}"
            )
        path.mkdir(exist_ok=True)
        folder = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
        try:
            fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.path.samestat(os.fstat(folder), os.stat(path)):  # else it has been put aside
                return folder
            os.close(folder)
        except FileNotFoundError:
            os.close(folder)
        except BlockingIOError:
            os.close(folder)
            if time.monotonic() >= until:
                raise StoreError(f"the store {path} cannot be opened: {_IS_USED}") from None
            time.sleep(_POLL_SECONDS)


def _old_format(path: Path) -> int:
    """Returns the format of a store of an earlier version, which is a file.

    Raises:
        StoreError: It is another file.
    """
    head = b""
    if path.is_file():
        with path.open("rb") as file:
            head = file.read(72)
    if head[68:] != APPLICATION:
        raise StoreError(f"{path} is no store, but something else; give another name")
    return int.from_bytes(head[60:64], "big")


def _free_name(path: Path) -> Path:
    """Returns the first name under which nothing has been put aside."""
    number = 1
    while any(os.path.lexists(f"{path}.old{number}{suffix}") for suffix in ("", "-wal")):
        number += 1
    return path.with_name(f"{path.name}.old{number}")


def _sync(folder: Path) -> None:
    """Syncs a folder, so that its entries outlast a failure of power."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
