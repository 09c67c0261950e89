"""Doors for files of earlier processes: stores, rows of stores, and ledgers of interfaces."""

from __future__ import annotations

import contextlib
import json
import shutil
import struct
import tempfile
from pathlib import Path
from typing import Any, List, Sequence, Tuple

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from fuzzing import Door
from rosclingo.solver.options import Options
from rosoclingo.errors import PlannerError, StoreError
from rosoclingo.in_process.parts import EXAMPLES, make_parts
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.journal import MessageArrived
from rosoclingo.loop.loop import Loop
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.goals import Goal
from rosoclingo.store.database import Database
from rosoclingo.store.folder import put_aside
from rosoclingo.store.sqlite_store import SqliteStore
from rosoclingo.store.store import Store
from rosoclingo_interfaces.errors import LedgerError
from rosoclingo_interfaces.ledger import _entries
from rosoclingo_interfaces.store_file import load

_LENGTHS = struct.Struct("<II")
_STARTED_WITH = {"planner": "line.lp"}
_DECISIONS = 12  # of the loop, whose run is in the sample
_PAGE = 4096
_FILES = ("run.sqlite", "run.sqlite-wal", "mark")


class _Robot(Environment):
    """Answers each action at once."""

    def __init__(self, inbox: Inbox) -> None:
        self._inbox = inbox

    def publish(self, actuator: str, action: str) -> None:
        self._inbox.put(MessageArrived(actuator, "success"))


class FolderDoor(Door):
    """A door for files, which are in a folder in memory."""

    folder = Path()

    def __enter__(self) -> Door:
        memory = Path("/dev/shm")
        self.folder = Path(tempfile.mkdtemp(dir=memory if memory.is_dir() else None))
        return self

    def __exit__(self, *_: object) -> None:
        shutil.rmtree(self.folder)

    def clear(self) -> None:
        """Removes all that is in the folder."""
        for old in self.folder.iterdir():
            shutil.rmtree(old)

    def check(self, err: Exception) -> None:
        """Checks that the file is named."""
        assert str(self.folder) in str(err), str(err)


def _begin(store: Store) -> Tuple[Inbox, Loop]:
    """Begins the run in a store, or goes on with it."""
    durability = SqliteStore(store, lambda: _STARTED_WITH)
    parts = make_parts("dynamic.incremental.recording", Options((f"{EXAMPLES}/line.lp",)))
    inbox = Inbox()
    loop = parts.loop(inbox, _Robot(inbox), durability=durability)
    durability.resume(loop.state, lambda _: Goal("a").client)
    return inbox, loop


def _run(path: Path) -> Store:
    """Returns the store of a run that goes on."""
    store = Store(path)
    inbox, loop = _begin(store)
    inbox.put(Goal("visit(2)", ("first",), "one"))
    inbox.put(Goal("visit(7)", (), "three"))
    loop.prepare()
    for _ in range(_DECISIONS):
        loop.step()
    inbox.put(Goal("visit(1)", (), "two"))
    inbox.put(MessageArrived("robot", "success"))
    return store


def _read(path: Path, *, resumes: bool = False) -> None:
    """Reads all of a store, as a node does that goes on, and writes to it."""
    store = Store(path)
    try:
        goals = {key: Goal(one.request, (), key) for key, one in store.goals.items()}
        _ = store.ended_goals, store.unsent, store.records, list(store.commands)
        store.inputs(goals.get)
        if store.snapshot is not None:
            store.check(_STARTED_WITH)
        if resumes:
            _begin(store)[1].prepare()
        store.begin(_STARTED_WITH)
    finally:
        store.close()


class StoreDoor(FolderDoor):
    """Stores: an input has the lengths of database and log, these, and the high-water mark."""

    name = "stores"
    errors = (StoreError,)
    inputs = 200

    def __init__(self) -> None:
        self._samples: List[bytes] = []

    def __enter__(self) -> Door:
        super().__enter__()
        store = _run(self.folder / "a.store")
        self._samples = [self._sample()]
        store.close()
        self._samples.append(self._sample())
        self.words = [
            self._samples[1][begin : begin + size]
            for begin in range(_LENGTHS.size, len(self._samples[1]), _PAGE)
            for size in (100, _PAGE)
        ]
        return self

    def _sample(self) -> bytes:
        files = [self.folder / "a.store" / name for name in _FILES]
        parts = [file.read_bytes() if file.exists() else b"" for file in files]
        return _LENGTHS.pack(*map(len, parts[:2])) + b"".join(parts)

    def valid(self) -> SearchStrategy[bytes]:
        """Returns a store with a log, or one that was closed."""
        return st.sampled_from(self._samples)

    def check(self, err: Exception) -> None:
        """Checks that the folder is named, and that what the message says gets rid of it."""
        super().check(err)
        put_aside(self.folder / "a.store")
        assert not (self.folder / "a.store").exists(), "resume:=fresh leaves it"

    def read(self, data: bytes) -> None:
        """Writes the files, and reads them."""
        self.clear()
        path = self.folder / "a.store"
        path.mkdir()
        database, log = _LENGTHS.unpack(data[: _LENGTHS.size].ljust(_LENGTHS.size, b"\0"))
        body = data[_LENGTHS.size :]
        parts = (body[:database], body[database : database + log], body[database + log :])
        for name, part in zip(_FILES, parts):
            if part:
                (path / name).write_bytes(part)
        _read(path)


class RowDoor(FolderDoor):
    """Rows of stores that are whole: another version has written them, or somebody who forges."""

    name = "rows"
    words = (
        b"null", b"[]", b"{}", b'""', b"[[", b"]]", b"1e999", b"NaN", b'"\\ud800"', b"true", b"-1",
        b'"pending"', b'"accepted"', b'["goal","one","visit(1)",[],0.0]', b"\\u0000", b'","',
        b'","1',
    )  # fmt: skip
    errors = (StoreError, PlannerError)
    inputs = 200

    def __init__(self) -> None:
        self._sample: List[List[str]] = []

    def __enter__(self) -> Door:
        super().__enter__()
        store = _run(self.folder / "a.store")
        database: Any = store._database
        self._sample = [
            [part, key, value]
            for part in database._known
            for key, value in database.read(part).items()
        ]
        store.close()
        return self

    def check(self, err: Exception) -> None:
        """Checks that the file is named, or what begins anew if the planner cannot go on."""
        if isinstance(err, StoreError):
            super().check(err)
        else:
            assert "resume:=fresh" in str(err), str(err)

    def valid(self) -> SearchStrategy[bytes]:
        """Returns the rows of a run, of which some are damaged."""
        return st.lists(
            st.tuples(
                st.integers(0, len(self._sample) - 1), st.integers(0, 2), st.text(max_size=4)
            ),
            max_size=3,
        ).map(self._rows)

    def _rows(self, changes: Sequence[Any]) -> bytes:
        rows = [list(row) for row in self._sample]
        for place, column, text in changes:
            old = rows[place][column]
            rows[place][column] = text + old[len(text) :] if len(text) % 2 else old[:-1] + text
        return json.dumps(rows).encode()

    def read(self, data: bytes) -> None:
        """Stores the rows, if they are some, and reads the store."""
        try:
            rows = json.loads(data)
            texts = [tuple(map(str, row)) for row in rows]
            assert all(len(row) == 3 for row in texts)
            "".join(sum(texts, ())).encode()
        except (ValueError, TypeError, AssertionError, RecursionError) as err:
            raise StoreError(f"{self.folder}: no rows") from err
        self.clear()
        path = self.folder / "a.store"
        with contextlib.closing(Database(path)) as database, database.transaction() as changed:
            for part, key, value in texts:
                changed.put(part, key, value)
        _read(path, resumes=True)


class LedgerDoor(FolderDoor):
    """The files in which interfaces keep what they have begun."""

    name = "ledgers"
    words = (
        b"null", b"[]", b"{}", b'""', b"[[", b"1e999", b"NaN", b'"\\ud800"', b'"answer": 1',
        b"true",
        b'"number": "1"', b'"run"', b'"format": 2', b'"last": []', b'{"last": ', b"},", b"\\u0000",
    )  # fmt: skip
    errors = (LedgerError,)

    def valid(self) -> SearchStrategy[bytes]:
        """Returns ledgers with some entries."""
        entry = st.fixed_dictionaries(
            {
                "run": st.sampled_from(["a", "0123"]), "number": st.integers(0, 2**32 - 1),
                "action": st.sampled_from(["go(3)", "wave"]),
                "answer": st.sampled_from([None, "success", "é"]),
            }
        )  # fmt: skip
        entries = st.dictionaries(st.sampled_from(["robot", "arm"]), entry)
        return entries.map(lambda last: json.dumps({"format": 1, "last": last}).encode())

    def read(self, data: bytes) -> None:
        """Opens the file."""
        file = self.folder / "a.json"
        file.write_bytes(data)
        for entry in load(file, "last", _entries, "is no store", "move it away").values():
            assert isinstance(entry.action, str)


def doors() -> List[Door]:
    """Returns the doors."""
    return [StoreDoor(), RowDoor(), LedgerDoor()]
