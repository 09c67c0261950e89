"""The folder of a store: made and put aside in one step, locked, and told what is wrong with it."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import signal
import sqlite3
import sys
import threading
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Callable, Dict, Iterator, List, Tuple

import pytest
from crashes import Life, Runs, World, outcome
from draws import IS_FULL

from rosoclingo.errors import StoreError
from rosoclingo.loop.values.goals import Goal
from rosoclingo.store import database, folder
from rosoclingo.store.folder import StoreFolder, put_aside
from rosoclingo.store.store import Store

DYN_RESET = "dynamic.incremental.dyn_reset"
REQUESTS = ["visit(2)", "visit(99)", "visit(4)", "visit(1)"]
DATABASE, LOG, MARK = FILES = "run.sqlite", "run.sqlite-wal", "mark"
HEADER, FRAME = 32, 24 + 4096

Files = Dict[str, bytes]  # their contents by their names


def contents(path: Path) -> Files:
    return {file.name: file.read_bytes() for file in path.iterdir()}


def write(path: Path, files: Files) -> Path:
    shutil.rmtree(path, ignore_errors=True)
    path.mkdir()
    for name, data in files.items():
        (path / name).write_bytes(data)
    return path


def number(path: Path, files: Files, *, lossy: bool = False) -> int:
    """Returns the number of the last transaction of a store with some files."""
    with contextlib.closing(Store(write(path, files), lossy=lossy)) as store:
        return store._database._number


def refuses(path: Path, files: Files, match: str, *, lossy: bool = False) -> None:
    """A store with some files is refused, and is left as it is."""
    with pytest.raises(StoreError, match=match) as caught:
        Store(write(path, files), lossy=lossy)
    assert str(path) in str(caught.value)
    assert "put back the files" in str(caught.value)
    if not has_transactions(files.get(LOG, b"")):  # SQLite removes such a log
        files = {name: data for name, data in files.items() if name != LOG}
    assert contents(path) == files


def has_transactions(log: bytes) -> bool:
    """Returns whether a log has a frame that ends a transaction."""
    frames = range(HEADER, len(log) - FRAME + 1, FRAME)
    return any(any(log[begin + 4 : begin + 8]) for begin in frames)


def run(parent: Path, name: str = "a.store", most: int = 256) -> List[Files]:
    """Returns what the store of a run was after each transaction, as if its process had died.

    Args:
        parent: Where it is to be.
        name: Its name.
        most: How many pages the log may have.
    """
    runs, path, states = Runs(parent, DYN_RESET), parent / name, []

    def point(what: str) -> None:
        if what == "after write":
            states.append(contents(path))

    with contextlib.closing(Store(path, point=point)) as store:
        store._database._connection.execute(f"PRAGMA wal_autocheckpoint = {most}")
        Life(World(REQUESTS), store, runs.make(store)).live()
    return states


@pytest.fixture(scope="module")
def memory() -> Iterator[Path]:
    """A folder in memory if there is any: no power fails here."""
    shm = Path("/dev/shm")
    with TemporaryDirectory(dir=str(shm) if shm.is_dir() else None) as parent:
        yield Path(parent)


@pytest.fixture(scope="module")
def states(memory: Path) -> List[Files]:
    """The states of a store whose log has all that was written."""
    return run(memory)


# Files that are gone, cut, or of another time or store.

GONE = {
    DATABASE: "its database run.sqlite is gone or empty",
    LOG: r"of \d+ transactions, the last \d+ are missing: its log is gone or was cut",
    MARK: "its file mark, by which missing transactions are noticed, is gone or damaged",
}


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("is_empty", [False, True])
def test_a_file_that_is_gone(
    states: List[Files], tmp_path: Path, name: str, *, is_empty: bool
) -> None:
    """Or is empty. What is there goes on when that is wanted, and only then."""
    path, whole = tmp_path / "a.store", states[-1]
    left = {key: data for key, data in whole.items() if key != name}
    refuses(path, {**left, name: b""} if is_empty else left, GONE[name])
    if name == DATABASE:
        refuses(path, left, GONE[name], lossy=True)
        return
    with contextlib.closing(Store(path, lossy=True)) as store:
        assert store.loss
    with contextlib.closing(Store(path)) as store:
        assert not store.loss
        if name == MARK:
            assert all(goal.status.is_terminal for goal in store.goals.values())
            return
    runs, world, calm = Runs(tmp_path, DYN_RESET), World(REQUESTS), World(REQUESTS)
    runs.run(calm)
    runs.run(world, file=path)
    assert outcome(world) == outcome(calm)


def test_only_the_log_or_the_mark_is_left(states: List[Files], tmp_path: Path) -> None:
    for name in (LOG, MARK):
        refuses(tmp_path / "a.store", {name: states[-1][name]}, GONE[DATABASE])


@pytest.mark.costly
@pytest.mark.parametrize("is_cut_in_frames", [False, True])
def test_a_log_that_is_cut(states: List[Files], memory: Path, *, is_cut_in_frames: bool) -> None:
    """At each boundary of its frames, and in each frame, before what was acknowledged last."""
    path, whole = memory / "b.store", states[-1]
    last, frames = number(path, whole), len(whole[LOG]) // FRAME
    assert frames > 20
    for frame in range(1, frames):
        end = HEADER + frame * FRAME + (FRAME // 3 if is_cut_in_frames else 0)
        refuses(path, {**whole, LOG: whole[LOG][:end]}, f"of {last} transactions, the last .*lossy")


def test_files_of_another_store(states: List[Files], memory: Path) -> None:
    """Of files of two stores, nothing goes on, unless a log has all that was written."""
    path, mine, other = memory / "b.store", states[-1], run(memory, "other.store", 10)[-1]
    refuses(path, {**mine, LOG: other[LOG]}, "is damaged: ")
    refuses(path, {**mine, MARK: other[MARK]}, "its files are of different stores")
    for one, two in ((mine, other), (other, mine)):
        for names in ((DATABASE,), (LOG,), (MARK,)):
            mixed = {**one, **{name: two[name] for name in names}}
            for lossy in (False, True):
                try:
                    assert number(path, mixed, lossy=lossy) == number(path, one)
                    assert names == (DATABASE,)
                except StoreError:
                    refuses(path, mixed, "is damaged: ", lossy=lossy)


@pytest.mark.costly
@pytest.mark.parametrize("most", [10, 256])
def test_files_of_another_time(memory: Path, most: int) -> None:
    """A store is refused, or all is there that was acknowledged; but not if all are older."""
    path, states = memory / "b.store", run(memory, f"{most}.store", most)
    whole, refused = states[-1], 0
    last = number(path, whole)
    for state in states[:-1]:
        for names in ((DATABASE,), (LOG,), (DATABASE, LOG)):
            mixed = {**whole, **{name: state[name] for name in names}}
            try:
                assert number(path, mixed) == last
            except StoreError:
                refuses(path, mixed, "is damaged")
                refused += 1
        assert number(path, state) <= last
    assert refused > len(states)


@pytest.mark.costly
def test_no_power_failure_is_taken_for_a_loss(states: List[Files], memory: Path) -> None:
    """The log is on the disk as it was acknowledged; the mark may be an older one."""
    last = number(memory / "b.store", states[-1])
    assert len({state[MARK] for state in states}) == len(states)
    for state in states:
        assert number(memory / "b.store", {**states[-1], MARK: state[MARK]}) == last


def test_no_power_failure_brings_a_loss_back(states: List[Files], tmp_path: Path) -> None:
    """When what was lost was accepted, the mark of before may be there again, and not the new."""
    path, whole = tmp_path / "b.store", states[-1]
    number(path, {DATABASE: whole[DATABASE], MARK: whole[MARK]}, lossy=True)
    (path / MARK).write_bytes(whole[MARK])
    Store(path).close()


# A process that dies while it makes a store, or puts one aside.


def dies(point: int, call: Callable[[], object]) -> bool:
    """Calls something in another process, which is killed at a point; returns whether it was.

    Args:
        point: At which line of the modules that use the folder, or statement of SQLite, from 1.
        call: What is called.
    """
    process = os.fork()
    if process:
        return os.WIFSIGNALED(os.waitpid(process, 0)[1])
    points, connect = count(1), sqlite3.connect

    def pass_point(*_: object) -> None:
        if next(points) == point:
            os.kill(os.getpid(), signal.SIGKILL)

    def trace(frame: Any, event: str, argument: object) -> Any:
        if frame.f_code.co_filename not in (folder.__file__, database.__file__):
            return None
        if event == "line":
            pass_point()
        return trace

    def traced(*arguments: Any, **parameters: Any) -> sqlite3.Connection:
        connection = connect(*arguments, **parameters)
        connection.set_trace_callback(pass_point)
        return connection

    try:
        sqlite3.connect = traced  # type: ignore[assignment]
        sys.settrace(trace)
        call()
    finally:
        os._exit(0)


def goals(path: Path) -> List[str]:
    with contextlib.closing(Store(path)) as store:
        return list(store.goals)


@pytest.mark.costly
@pytest.mark.parametrize("left", [(), ("run.sqlite.new", "run.sqlite.new-journal", MARK)])
def test_a_process_dies_while_it_makes_a_store(memory: Path, left: Tuple[str, ...]) -> None:
    """A start that is killed at any line, even twice, leaves a store that the next one opens."""
    path = memory / "made.store"
    for point in count(1, 1 if IS_FULL else 4):
        write(path, dict.fromkeys(left, b"something"))
        if not left:
            path.rmdir()
        died = dies(point, lambda: Store(path))
        with contextlib.closing(Store(path)) as store:
            store.add(Goal("visit(2)", (), "g"))
        assert goals(path) == ["g"]
        assert set(contents(path)) == {DATABASE, MARK}
        if not died:
            assert point > 100
            return


@pytest.mark.costly
def test_a_process_dies_while_it_puts_a_store_aside(states: List[Files], memory: Path) -> None:
    """The store is in its place or aside, and whole."""
    path, aside = memory / "c.store", memory / "c.store.old1"
    for point in count(1):
        write(path, states[-1])
        died = dies(point, lambda: put_aside(path))
        assert path.exists() != aside.exists()
        left = aside if path.exists() else None
        assert put_aside(path) == left
        assert contents(aside) == states[-1]
        assert goals(path) == []
        shutil.rmtree(aside)
        if not died:
            assert point > 10
            return


def test_stores_are_numbered_that_are_put_aside(tmp_path: Path) -> None:
    path, done = tmp_path / "a.store", []
    for name in (None, "a.store.old1", "a.store.old2"):
        assert put_aside(path, lambda: done.append("done")) == (name and tmp_path / name)
        Store(path).close()
    assert len(done) == 3


def test_an_empty_folder_is_used(tmp_path: Path) -> None:
    path = tmp_path / "a.store"
    path.mkdir()
    assert put_aside(path) is None
    assert goals(path) == []


# Several nodes.


def test_two_nodes_with_one_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rosoclingo.store.folder._WAIT_SECONDS", 0.1)
    path, done = tmp_path / "a.store", []
    with contextlib.closing(Store(path)) as store:
        for call in (Store, lambda path: put_aside(path, lambda: done.append("done"))):
            with pytest.raises(StoreError, match=r"a.store .*another node that still runs uses it"):
                call(path)
        store.add(Goal("visit(2)", (), "g"))
    assert not done
    assert goals(path) == ["g"]


def test_many_nodes_make_one_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of processes that start at once, one makes the store, and the others wait for it."""
    monkeypatch.setattr("rosoclingo.store.folder._WAIT_SECONDS", 60.0)
    path = tmp_path / "a.store"

    def use(key: str) -> None:
        with contextlib.closing(Store(path)) as store:
            store.add(Goal("visit(2)", (), key))

    threads = [threading.Thread(target=use, args=[str(n)]) for n in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(goals(path)) == [str(n) for n in range(8)]


def test_who_waits_has_no_store_that_is_put_aside(tmp_path: Path) -> None:
    path = tmp_path / "a.store"
    waits, opened = threading.Event(), threading.Event()
    found: List[Store] = []

    def wait(_: float) -> None:
        waits.set()
        assert opened.wait(60.0)

    def use() -> None:
        found.append(Store(path))

    with pytest.MonkeyPatch.context() as patch, contextlib.closing(StoreFolder(path)):
        patch.setattr(folder.time, "sleep", wait)
        thread = threading.Thread(target=use)
        thread.start()
        assert waits.wait(60.0)
        path.rename(tmp_path / "aside")
    opened.set()
    thread.join()
    found[0].close()
    assert (path / DATABASE).exists()
    assert not contents(tmp_path / "aside")


# Other files and folders.


def old_store(path: Path) -> None:
    with contextlib.closing(sqlite3.connect(str(path))) as connection:
        connection.executescript(
            f"PRAGMA application_id = {0x526F5343}; PRAGMA user_version = 11; CREATE TABLE a (b);"
        )
    Path(f"{path}-wal").write_bytes(b"a log")


def test_a_store_of_an_earlier_version(tmp_path: Path) -> None:
    """It is a file; the message names it, and what it says helps."""
    path = tmp_path / "a.store"
    old_store(path)
    before = path.read_bytes()
    with pytest.raises(
        StoreError, match=r"a.store is a file of an earlier .* the format 11; .*resume:=fresh"
    ):
        Store(path)
    assert path.read_bytes() == before
    assert put_aside(path) == tmp_path / "a.store.old1"
    assert (tmp_path / "a.store.old1").read_bytes() == before
    assert (tmp_path / "a.store.old1-wal").read_bytes() == b"a log"
    assert goals(path) == []
    assert put_aside(path) == tmp_path / "a.store.old2"


def a_letter(path: Path) -> None:
    path.write_text("a letter of some length, which is no store of a run and never was one, indeed")


def a_pipe(path: Path) -> None:
    os.mkfifo(path)


def a_home(path: Path) -> None:
    path.mkdir()
    a_letter(path / "letter")


@pytest.mark.parametrize("make", [a_letter, a_pipe, a_home])
def test_what_is_no_store_is_left_alone(tmp_path: Path, make: Callable[[Path], None]) -> None:
    path = tmp_path / "other"
    make(path)
    for call in (Store, put_aside):
        with pytest.raises(StoreError, match=r"other .*is no store.*; give another name"):
            call(path)
    assert [one.name for one in tmp_path.iterdir()] == ["other"]


def test_a_link_leads_to_the_store(tmp_path: Path) -> None:
    """Also if there is none yet, and after one was put aside."""
    link, path = tmp_path / "link", tmp_path / "a.store"
    link.symlink_to(path)
    assert goals(link) == []
    assert set(contents(path)) == {DATABASE, MARK}
    assert put_aside(link) == tmp_path / "a.store.old1"
    assert goals(link) == []
    assert link.is_symlink()
    link.unlink()
    link.symlink_to(link)
    with pytest.raises(StoreError, match=r"the store .*link cannot be opened: "):
        Store(link)


@pytest.mark.parametrize("parent", ["/proc", "/dev/null", "none"])
def test_a_place_where_no_store_can_be(tmp_path: Path, parent: str) -> None:
    """Not even root may write there, who runs tests here and there."""
    with pytest.raises(
        StoreError,
        match=rf"a.store cannot be opened: .*; is .*{parent}\S* there, and may this user",
    ):
        Store(tmp_path / parent / "a.store")


@pytest.mark.parametrize("name", [".", DATABASE, MARK])
def test_a_file_to_which_this_user_may_not_write(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    path = tmp_path / "a.store"
    Store(path).close()
    with monkeypatch.context() as patch:
        patch.setattr(os, "access", lambda file, _: file != path / name)
        with pytest.raises(
            StoreError, match=r"Permission denied; .* may this user write to it and to a.store\?"
        ):
            Store(path)
    assert goals(path) == []


@pytest.mark.parametrize("name", ["mkdir", "pwrite", "replace"])
def test_a_disk_that_is_full_when_a_store_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    path = tmp_path / "a.store"

    def fails(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, name, fails)
        patch.setattr(Path, name, fails, raising=False)
        with pytest.raises(StoreError, match=r"a.store cannot be opened: there is no more room"):
            Store(path)
    assert goals(path) == []


def test_another_program_has_the_database(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Such as SQLite's shell, in a transaction."""
    path, connect = tmp_path / "a.store", sqlite3.connect
    Store(path).close()
    with contextlib.closing(connect(str(path / DATABASE), isolation_level=None)) as other:
        other.execute("PRAGMA locking_mode = EXCLUSIVE")
        other.execute("BEGIN EXCLUSIVE")
        monkeypatch.setattr(sqlite3, "connect", lambda *a, **p: connect(*a, timeout=0.1, **p))
        with pytest.raises(StoreError, match="another node that still runs uses it"):
            Store(path)
    assert goals(path) == []
