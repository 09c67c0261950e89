"""A table of texts in a SQLite database, which is whole or refused.

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
import secrets
import sqlite3
import threading
import time
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Optional, Tuple

from rosoclingo.errors import StoreError
from rosoclingo.store.folder import APPLICATION, FRESH, Mark, StoreFolder, damaged, told

_VERSION = 12  # of the format
_CHECKPOINT_PAGES = 256  # of 4 KiB: so long does the write-ahead log grow
_BITS = 64
_Known = Dict[str, Dict[str, Tuple[int, int]]]


class Database:
    """Rows with a part, a key and a value, in the order in which they were added.

    Thread-safe: a lock is held while a transaction is made. Only one process at a time has it.

    Each transaction renews a seal: a sum of digests of all rows. So a file in which some pages are
    older than others is not taken for whole. It also has a number, which is to reach the folder's
    high-water mark. So one whose log is gone, or was cut, is not taken for whole, either.

    Attributes:
        path: The folder.
        loss: What is lost, and was accepted; empty if nothing is.
        failure: Why nothing can be written any more; None if it can.
        committed: When a transaction was written last, in seconds of the monotonic clock; None if
            none was.
    """

    def __init__(
        self,
        path: Path,
        *,
        lossy: bool = False,
        most_pages: int = 0,
        point: Callable[[str], None] = lambda _: None,
    ) -> None:
        """Opens a store, which is made if there is none.

        Args:
            path: Its folder.
            lossy: Whether it goes on with what is there if acknowledged transactions are missing.
            most_pages: How many pages of 4 KiB it may have; 0 for as many as there is room for.
            point: Called before and after each write, with what it is: where a test may end all.

        Raises:
            StoreError: It cannot be used; the message says why and what to do.
        """
        self._folder = StoreFolder(path)
        self.path = self._folder.path
        self._lock = threading.RLock()
        self._point = point
        self._known: _Known = {}  # numbers and digests of all rows
        self._next = 1
        self._seal = 0
        self._id = ""
        self._number = 0  # of the last transaction
        self.loss = ""
        self.committed: Optional[float] = None
        self._is_durable = True
        self.failure: Optional[StoreError] = None
        with contextlib.ExitStack() as opened, told(self.path, "cannot be opened"):
            opened.callback(self._folder.close)
            self._connection = _connect(self._folder)
            opened.callback(self._connection.close)
            # Without the checkpoint that SQLite makes when it closes a database: what is refused
            # is left as it is.
            opened.callback(self._connection.interrupt)
            try:
                self._open(most_pages)
                self._compare(lossy=lossy)
            except MISFITS as err:
                raise damaged(self.path, f"its values are not those of a store ({err})") from err
            opened.pop_all()

    def close(self) -> None:
        """Closes the database; may be called twice."""
        with self._lock:
            self._connection.close()
            self._folder.close()

    def _open(self, most_pages: int) -> None:
        """Takes the database, reads all rows, and verifies their seal."""
        run = self._connection.execute
        run("PRAGMA locking_mode = EXCLUSIVE")
        (application,) = run("PRAGMA application_id").fetchone()
        (version,) = run("PRAGMA user_version").fetchone()
        if application != int.from_bytes(APPLICATION, "big"):
            raise damaged(self.path, f"{self._folder.database.name} is of another program")
        if version != _VERSION:
            raise StoreError(
                f"the store {self.path} has the format {version}, and this version of "
                f"rosoclingo knows {_VERSION}; {FRESH}"
            )
        run("PRAGMA synchronous = FULL")
        run(f"PRAGMA wal_autocheckpoint = {_CHECKPOINT_PAGES}")
        run(f"PRAGMA journal_size_limit = {_CHECKPOINT_PAGES * 4096}")
        if most_pages:
            run(f"PRAGMA max_page_count = {most_pages}")
        # Takes SQLite's lock, which is kept.
        run("BEGIN EXCLUSIVE")
        run("COMMIT")
        try:
            (said,) = run("PRAGMA integrity_check(1)").fetchone()
            if said != "ok":
                raise damaged(self.path, said)
            for number, *row in run("SELECT id, part, key, value FROM row"):
                part, key, value = map(str, row)
                digest = _digest(number, part, key, value)
                self._known.setdefault(part, {})[key] = number, digest
                self._seal = (self._seal + digest) % 2**_BITS
                self._next = max(self._next, number + 1)
            seals = run("SELECT sum, store, number FROM seal").fetchall()
        except sqlite3.Error as err:
            raise damaged(self.path, err) from err
        if len(seals) != 1 or seals[0][0] != str(self._seal):
            raise damaged(self.path, "its rows were not written together")
        _, self._id, self._number = seals[0]

    def _compare(self, *, lossy: bool) -> None:
        """Compares the last transaction with the high-water mark."""
        mark = self._folder.mark
        if mark is None:
            loss = "its file mark, by which missing transactions are noticed, is gone or damaged"
        elif mark.store != self._id:
            raise damaged(self.path, "its files are of different stores")
        elif mark.number > self._number:
            loss = (
                f"of {mark.number} transactions, the last {mark.number - self._number} are "
                "missing: its log is gone or was cut, or a file is an older one"
            )
        else:
            return
        if not lossy:
            raise damaged(
                self.path, loss, "start with resume:=lossy, which goes on with what is there, or "
            )
        self.loss = loss
        if mark is not None:
            self._number = mark.number  # when power fails, this mark may come back
        with self.transaction():
            pass
        self._folder.write_mark(Mark(self._id, self._number), durable=True)

    def read(self, part: str) -> Dict[str, str]:
        """Returns the rows of a part, in the order in which they were added."""
        with self._lock, told(self.path, "cannot be read"):
            rows = self._connection.execute(
                "SELECT key, value FROM row WHERE part = ? ORDER BY id", (part,)
            )
            return {str(key): str(value) for key, value in rows}

    @property
    def size(self) -> Optional[int]:
        """The bytes of the database and of its log; None if that is unknown."""
        return self._folder.size

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
                with told(self.path, "cannot be written"):
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
        if durable:
            self._folder.write_mark(Mark(self._id, self._number))
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


def _digest(number: int, part: str, key: str, value: str) -> int:
    text = "\0".join((str(number), part, key, value))
    digest = hashlib.blake2b(text.encode("utf-8", "surrogatepass"), digest_size=_BITS // 8)
    return int.from_bytes(digest.digest(), "big")


def _connect(folder: StoreFolder) -> sqlite3.Connection:
    """Connects to the database of a folder, which is made if there is no store yet."""
    file = folder.database
    if folder.is_new:
        store = secrets.token_hex(8)
        with contextlib.closing(sqlite3.connect(str(folder.begin()))) as connection:
            connection.executescript(
                f"""
                PRAGMA application_id = {int.from_bytes(APPLICATION, "big")};
                PRAGMA user_version = {_VERSION};
                PRAGMA synchronous = FULL;
                BEGIN;
                CREATE TABLE row (id INTEGER PRIMARY KEY, part TEXT NOT NULL, key TEXT NOT NULL,
                                  value TEXT NOT NULL);
                CREATE TABLE seal (id INTEGER PRIMARY KEY, sum TEXT NOT NULL, store TEXT NOT NULL,
                                   number INTEGER NOT NULL);
                INSERT INTO seal VALUES (1, '0', '{store}', 0);
                COMMIT;
                PRAGMA journal_mode = WAL;
                """  # noqa: S608 (numbers of this module)
            )
        folder.complete(store)
    elif not (file.exists() and file.stat().st_size):  # SQLite would make one, and remove the log
        raise damaged(folder.path, f"its database {file.name} is gone or empty")
    return sqlite3.connect(str(file), isolation_level=None, check_same_thread=False)
