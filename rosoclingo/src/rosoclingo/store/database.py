"""A table of texts in a SQLite file, which is whole or refused.

>>> from tempfile import TemporaryDirectory
>>> with TemporaryDirectory() as folder:
...     with contextlib.closing(Database(Path(folder) / "a.store")) as database:
...         with database.transaction() as rows:
...             rows.put("goal", "g1", "visit(3)")
...         database.read("goal")
{'g1': 'visit(3)'}
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import secrets
import sqlite3
import threading
import time
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Optional, Tuple

from rosoclingo.errors import DamagedStoreError, StoreError
from rosoclingo.store import high_water
from rosoclingo.store.high_water import HighWaterMark, HighWaterMarkFile
from rosoclingo.store.loss import Loss

_APPLICATION = 0x526F5343  # RoSC: which program's file it is
_VERSION = 11  # of the format
_WAIT_SECONDS = 5.0  # for a node that is just ending, and has the file
_CHECKPOINT_PAGES = 256  # of 4 KiB: so long does the write-ahead log grow
_BITS = 64
_LOGS = ("-wal", "-shm")  # what is next to a file, as long as it is open or if its process has died
_Known = Dict[str, Dict[str, Tuple[int, int]]]


class Database:
    """Rows with a part, a key and a value, in the order in which they were added.

    Thread-safe: a lock is held while a transaction is made. Only one process at a time has a file.

    Each transaction renews a seal: a sum of digests of all rows. So a file in which some pages are
    older than others is not taken for whole. It also has a number, and that of the last durable one
    is in the file itself, see :mod:`.high_water`. So a file whose log is gone, or was cut, is not
    taken for whole, either.

    Attributes:
        loss: What is missing. As long as that is not accepted, nothing can be written, and
            :meth:`close` leaves file and log as they are.
        failure: Why nothing can be written any more; None if it can.
        committed: When a transaction was written last, in seconds of the monotonic clock; None if
            none was.
    """

    def __init__(
        self,
        path: Path,
        *,
        most_pages: int = 0,
        point: Callable[[str], None] = lambda _: None,
        details: Callable[[], Any] = lambda: None,
    ) -> None:
        """Opens a file, which is made if there is none.

        Args:
            path: The file.
            most_pages: How many pages of 4 KiB it may have; 0 for as many as there is room for.
            point: Called before and after each write, with what it is: where a test may end all.
            details: Returns what is to be known of a durable transaction if it is lost, as a value
                that JSON has; called when it is written.

        Raises:
            DamagedStoreError: File and log are not whole, or do not belong together. Both are left
                as they are.
            StoreError: The file cannot be used; the message says why and what to do.
        """
        self.path = path
        self._lock = threading.RLock()
        self._point = point
        self._details = details
        self._known: _Known = {}  # numbers and digests of all rows
        self._next = 1
        self._seal = 0
        self._id = ""
        self._number = 0  # of the last transaction
        self._mark: Optional[HighWaterMarkFile] = None
        self.loss: Optional[Loss] = None
        self.committed: Optional[float] = None
        self._is_durable = True
        self.failure: Optional[StoreError] = None
        self._closed = False
        with _told(self.path, "cannot be opened"):
            _make(path)
            log = _describe_log(path)
            self._connection = _connect(path)
        try:
            with _intact(self.path):
                self._open(most_pages, log)
        except BaseException:
            self._leave()
            raise

    def close(self) -> None:
        """Closes the file; may be called twice."""
        with self._lock:
            if self._closed:
                return
            if self.loss is not None:
                self._leave()
                return
            self._closed = True
            self._connection.close()
            if self._mark is not None:
                self._mark.close()

    def _leave(self) -> None:
        """Closes the file and leaves it and its log as they are."""
        self._closed = True
        with _log_kept(self.path):
            self._connection.interrupt()  # the checkpoint that SQLite makes when it closes a file
            self._connection.close()
            if self._mark is not None:
                self._mark.close()

    def _open(self, most_pages: int, log: str) -> None:
        run = self._connection.execute
        with _told(self.path, "cannot be opened"):
            run("PRAGMA locking_mode = EXCLUSIVE")
            (application,) = run("PRAGMA application_id").fetchone()
            (version,) = run("PRAGMA user_version").fetchone()
            if application != _APPLICATION:
                raise StoreError(f"{self.path} is no store, but something else; give another name")
            if version != _VERSION:
                raise StoreError(
                    f"the store {self.path} has the format {version}, and this version of "
                    f"rosoclingo knows {_VERSION}; {_FRESH}"
                )
            run("PRAGMA synchronous = FULL")
            run(f"PRAGMA wal_autocheckpoint = {_CHECKPOINT_PAGES}")
            run(f"PRAGMA journal_size_limit = {_CHECKPOINT_PAGES * 4096}")
            if most_pages:
                run(f"PRAGMA max_page_count = {most_pages}")
            # Takes the lock, which is kept.
            run("BEGIN EXCLUSIVE")
            run("COMMIT")
        self._load()
        with _told(self.path, "cannot be opened"):
            self._compare(log)

    def _load(self) -> None:
        """Reads all rows, and verifies their seal."""
        run = self._connection.execute
        try:
            (said,) = run("PRAGMA integrity_check(1)").fetchone()
            if said != "ok":
                raise _damaged(self.path, said)
            for number, *row in run("SELECT id, part, key, value FROM row"):
                part, key, value = map(str, row)
                digest = _digest(number, part, key, value)
                self._known.setdefault(part, {})[key] = number, digest
                self._seal = (self._seal + digest) % 2**_BITS
                self._next = max(self._next, number + 1)
            seals = run("SELECT sum, store, number FROM seal").fetchall()
        except sqlite3.Error as err:
            raise _damaged(self.path, err) from err
        if len(seals) != 1 or seals[0][0] != str(self._seal):
            raise _damaged(self.path, "its rows were not written together")
        _, self._id, self._number = seals[0]

    def _compare(self, log: str) -> None:
        """Compares the last transaction with the high-water mark."""
        mark = _read_mark(self._connection)
        if mark is not None and mark.store != self._id:
            raise _damaged(self.path, "its log is of another store")
        if mark is not None and mark.number > self._number:
            if _number_without_log(self.path) > self._number:
                raise _damaged(self.path, "its log is older than it")
            self.loss = Loss(self._number, mark.number, log, mark.details)
            self.failure = StoreError(f"the store {self.path} has lost transactions; {_FRESH}")
        (page,) = self._connection.execute(
            "SELECT rootpage FROM sqlite_master WHERE name = 'mark'"
        ).fetchone()
        self._mark = HighWaterMarkFile(self.path, page)

    def accept_loss(self) -> None:
        """Accepts that transactions are missing, and allows writes again."""
        if self.loss is not None:
            # A mark of before may come back when power fails.
            self._number = self.loss.acknowledged
            self.loss = self.failure = None
            with self.transaction():
                pass

    def read(self, part: str) -> Dict[str, str]:
        """Returns the rows of a part, in the order in which they were added."""
        with self._lock, _told(self.path, "cannot be read"):
            rows = self._connection.execute(
                "SELECT key, value FROM row WHERE part = ? ORDER BY id", (part,)
            )
            return {str(key): str(value) for key, value in rows}

    @property
    def size(self) -> Optional[int]:
        """The bytes of the file and of its log; None if that is unknown."""
        try:
            return _size(self.path) + _size(_log(self.path))
        except OSError:
            return None

    @contextlib.contextmanager
    def transaction(self, *, durable: bool = True) -> Iterator[Rows]:
        """A context in which rows are changed, all or none.

        Args:
            durable: Whether that outlasts a failure of power, too, and not only of the process.
                Then what was written before does so as well.

        Raises:
            StoreError: It cannot be written, now or before.
        """
        with self._lock:
            if self.failure is not None:
                raise self.failure
            rows = Rows(self)
            try:
                yield rows
            except BaseException:
                self.failure = StoreError(f"the store {self.path}: an error ended a transaction")
                raise
            if not (rows.changes or durable):
                return
            try:
                with _told(self.path, "cannot be written"):
                    self._commit(rows, durable)
            except StoreError as err:
                self.failure = err
                raise

    def _commit(self, rows: Rows, durable: bool) -> None:
        run = self._connection.execute
        if durable != self._is_durable:
            run(f"PRAGMA synchronous = {'FULL' if durable else 'NORMAL'}")
            self._is_durable = durable
        name = "write" if durable else "note"
        self._point(f"before {name}")
        run("BEGIN")
        try:
            for statement, values in rows.changes:
                run(statement, values)
            self._number += 1
            run("UPDATE seal SET sum = ?, number = ?", (str(self._seal), self._number))
            run("COMMIT")
        except sqlite3.Error:
            with contextlib.suppress(sqlite3.Error):
                run("ROLLBACK")
            raise
        if durable and self._mark is not None:
            self._mark.write(HighWaterMark(self._id, self._number, self._details()))
        self.committed = time.monotonic()
        self._point(f"after {name}")


class Rows:
    """The rows as a transaction changes them. Used by the thread that makes the transaction."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self.changes: List[Tuple[str, Tuple[object, ...]]] = []

    def put(self, part: str, key: str, value: str, *, last: bool = False) -> None:
        """Adds a row, or changes the value of that with this key.

        Args:
            part: The part.
            key: The key, of which there is one in a part.
            value: The value.
            last: Whether it becomes the last one.
        """
        database = self._database
        if last:
            self.delete(part, key)
        known = database._known.setdefault(part, {})
        number, old = known.get(key, (0, 0))
        if number:
            self.changes.append(("UPDATE row SET value = ? WHERE id = ?", (value, number)))
        else:
            number = database._next
            database._next += 1
            self.changes.append(("INSERT INTO row VALUES (?, ?, ?, ?)", (number, part, key, value)))
        digest = _digest(number, part, key, value)
        known[key] = number, digest
        database._seal = (database._seal + digest - old) % 2**_BITS

    @property
    def next_number(self) -> int:
        """The number of the row that is added next, which is larger than those of all others."""
        return self._database._next

    def delete(self, part: str, key: str) -> None:
        """Removes a row, if there is one."""
        database = self._database
        number, digest = database._known.get(part, {}).pop(key, (0, 0))
        if number:
            database._seal = (database._seal - digest) % 2**_BITS
            self.changes.append(("DELETE FROM row WHERE id = ?", (number,)))

    def keys(self, part: str) -> List[str]:
        """Returns the keys of a part, in no order."""
        return list(self._database._known.get(part, ()))

    def clear(self, part: str) -> None:
        """Removes all rows of a part."""
        for key in self.keys(part):
            self.delete(part, key)


MISFITS = (
    ValueError, TypeError, LookupError, AttributeError, OverflowError, RecursionError,
)  # fmt: skip
"""All that Python raises at a damaged file whose pages are whole, or at rows of another version.

A value may be of another type, and a message of SQLite's may quote bytes that are no text.
"""

_FRESH = "start with resume:=fresh, which keeps the file aside and begins anew"


def _digest(number: int, part: str, key: str, value: str) -> int:
    text = "\0".join((str(number), part, key, value))
    digest = hashlib.blake2b(text.encode("utf-8", "surrogatepass"), digest_size=_BITS // 8)
    return int.from_bytes(digest.digest(), "big")


def _connect(path: Path) -> sqlite3.Connection:
    return sqlite3.connect(
        str(path), timeout=_WAIT_SECONDS, isolation_level=None, check_same_thread=False
    )


def _make(path: Path) -> None:
    """Creates the file atomically, without rows, unless it exists."""
    log = _log(path)
    if _size(log) and not _size(path):  # SQLite would remove the log of an empty file
        what = "is damaged: it is empty" if path.exists() else "is gone"
        raise StoreError(
            f"the store {path} {what}, but its log {log.name} is there, and has what was written "
            f"last; put back the file, or remove the log, or {_FRESH}"
        )
    if path.exists():
        return
    new = path.with_name(f"{path.name}.new")
    if new.exists():  # a process has died meanwhile
        new.unlink()
    connection = _connect(new)
    try:
        connection.executescript(
            f"""
            PRAGMA application_id = {_APPLICATION};
            PRAGMA user_version = {_VERSION};
            PRAGMA synchronous = FULL;
            PRAGMA page_size = {high_water.PAGE_BYTES};
            PRAGMA auto_vacuum = NONE;
            BEGIN;
            CREATE TABLE row (id INTEGER PRIMARY KEY, part TEXT NOT NULL, key TEXT NOT NULL,
                              value TEXT NOT NULL);
            CREATE TABLE seal (id INTEGER PRIMARY KEY, sum TEXT NOT NULL, store TEXT NOT NULL,
                               number INTEGER NOT NULL);
            CREATE TABLE mark (id INTEGER PRIMARY KEY, bytes BLOB NOT NULL);
            INSERT INTO seal VALUES (1, '0', '{secrets.token_hex(8)}', 0);
            INSERT INTO mark VALUES (1, zeroblob({high_water.BLOB_BYTES}));
            COMMIT;
            PRAGMA journal_mode = WAL;
            """  # noqa: S608 (numbers of this module)
        )
    finally:
        connection.close()
    new.rename(path)
    _sync_folder(path)


def _read_mark(connection: sqlite3.Connection) -> Optional[HighWaterMark]:
    """Returns the mark in the main file, of which the log has no copy."""
    (blob,) = connection.execute("SELECT bytes FROM mark").fetchone()
    return high_water.decode(blob)


def _is_complete(connection: sqlite3.Connection) -> bool:
    """Returns whether file and log are of one store, and reach its high-water mark."""
    try:
        mark = _read_mark(connection)
        store, number = connection.execute("SELECT store, number FROM seal").fetchone()
    except sqlite3.OperationalError:  # it has another format
        return True
    except MISFITS:
        return False
    return mark is None or (mark.store == store and mark.number <= number)


def _number_without_log(path: Path) -> int:
    """Returns the number of the last transaction that is in the main file."""
    uri = f"{path.absolute().as_uri()}?immutable=1"
    with contextlib.closing(sqlite3.connect(uri, uri=True)) as connection:
        try:
            (number,) = connection.execute("SELECT number FROM seal").fetchone()
        except sqlite3.DatabaseError:  # a checkpoint has not ended
            return 0
    return int(number)


def _log(path: Path) -> Path:
    return path.with_name(f"{path.name}{_LOGS[0]}")


def _size(path: Path) -> int:
    return path.stat().st_size if path.exists() else 0


@contextlib.contextmanager
def _log_kept(path: Path) -> Iterator[None]:
    """A context that restores a log if SQLite removes it, which finds nothing valid in it.

    On a file system without links, it is gone.
    """
    log = _log(path)
    kept = log.with_name(f"{log.name}.kept")
    if _size(log):
        with contextlib.suppress(OSError):
            os.link(str(log), str(kept))
    yield
    with contextlib.suppress(OSError):
        os.link(str(kept), str(log))  # which fails if there is one
    with contextlib.suppress(OSError):
        kept.unlink()


def _describe_log(path: Path) -> str:
    """Describes the log file, for the message about missing transactions."""
    log = _log(path)
    if not log.exists():
        return f"its log {log.name} is gone"
    return f"its log {log.name} {'ends too early' if _size(log) else 'is empty'}"


def _sync_folder(path: Path) -> None:
    """Syncs the folder, so that the file's entry in it outlasts a power failure."""
    with contextlib.suppress(OSError):
        folder = os.open(str(path.parent), os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def put_aside(path: Path, done: Callable[[], None] = lambda: None) -> Optional[Path]:
    """Renames a store, so that another one can begin; returns its new name, if there was one.

    If the process dies meanwhile, the file is in one of both places, and not without what its log
    has, and no log is left where another file is to begin.

    Args:
        path: The file.
        done: Called when nothing is left in its place, before this returns.

    Raises:
        StoreError: It cannot be renamed, or another node has it.
    """
    logs = [path.with_name(path.name + suffix) for suffix in _LOGS]
    if not any(map(os.path.lexists, (path, *logs))):
        done()
        return None
    aside = path.with_name(f"{path.name}.old{_free_number(path)}")
    try:
        with _reserved(path):
            for log in logs:  # first, as a log that is left would be taken for that of a new file
                if log.exists() and log.stat().st_size == 0:
                    log.unlink()
                elif log.exists():
                    log.rename(aside.with_name(aside.name + log.name[len(path.name) :]))
            if path.exists():
                path.rename(aside)
            _sync_folder(path)
    except OSError as err:
        raise StoreError(f"the store {path} cannot be kept aside: {err.strerror}") from err
    done()
    return aside


@contextlib.contextmanager
def _reserved(path: Path) -> Iterator[None]:
    """A context in which no other node has a file, if there is one, and its log is empty.

    A file that is damaged, or no database at all, has no owner. A log that does not belong to its
    file is left as it is.

    Raises:
        StoreError: Another node has it.
    """
    if not _size(path):
        yield
        return
    with contextlib.closing(_connect(path)) as connection:
        with _told(path, "cannot be kept aside"):
            try:
                connection.execute("PRAGMA locking_mode = EXCLUSIVE")
                connection.execute("BEGIN EXCLUSIVE")
                connection.execute("COMMIT")  # which keeps the lock
                if _is_complete(connection):
                    connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            except sqlite3.DatabaseError as err:
                if not _is_damage(err):
                    raise
            except MISFITS:
                pass
        yield
        connection.interrupt()  # a checkpoint, of a log that may not be its own


@contextlib.contextmanager
def log_put_aside(path: Path) -> Iterator[Path]:
    """A context in which the log of a store has another name; it comes back after an error.

    Yields:
        The other name.

    Raises:
        StoreError: It cannot be renamed.
    """
    log = _log(path)
    aside = log.with_name(f"{log.name}.old{_free_number(log)}")
    try:
        if log.exists():
            log.rename(aside)
        yield aside
    except BaseException as err:
        if aside.exists():
            aside.rename(log)
        if isinstance(err, OSError):
            raise StoreError(f"the log {log} cannot be kept aside: {err.strerror}") from err
        raise


def _free_number(path: Path) -> int:
    """Returns the first number with which nothing has been put aside."""
    number = 1
    while any(os.path.lexists(f"{path}.old{number}{suffix}") for suffix in ("", *_LOGS)):
        number += 1
    return number


def _is_damage(err: sqlite3.Error) -> bool:
    """Returns whether an error of SQLite says that the file is damaged, or no database."""
    words = ("malformed", "not a database", "unsupported file format")
    return any(word in str(err) for word in words)


@contextlib.contextmanager
def _intact(path: Path) -> Iterator[None]:
    """A context that converts what Python raises at a damaged file."""
    try:
        yield
    except MISFITS as err:
        raise _damaged(path, f"its values are not those of a store ({err})") from err


@contextlib.contextmanager
def _told(path: Path, what: str) -> Iterator[None]:
    """A context that converts SQLite's errors to this package's."""
    try:
        yield
    except sqlite3.DatabaseError as err:
        text = str(err)
        if "locked" in text:
            remedy = "another node that still runs uses it; give each a store of its own"
        elif "full" in text:
            remedy = "there is no more room; make some, and start again"
        elif "I/O" in text:
            remedy = f"{text}; the disk fails, or a quota or limit is reached; start again then"
        elif _is_damage(err):
            raise _damaged(path, text) from err
        else:
            remedy = f"{text}; is its folder there, and may this user write to it?"
        raise StoreError(f"the store {path} {what}: {remedy}") from err
    except OSError as err:
        raise StoreError(f"the store {path} {what}: {err.strerror}") from err


def _damaged(path: Path, reason: object) -> DamagedStoreError:
    log, remedy = _log(path), ""
    if _size(log):
        remedy = (
            "put back a file and a log that belong together, or start with resume:=lossy, which "
            f"goes on without the log {log.name} if the file is whole, or "
        )
    return DamagedStoreError(f"the store {path} is damaged: {reason}; {remedy}{_FRESH}")
