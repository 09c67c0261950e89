"""A store whose log is gone, cut, old, or of another store is refused, and says what is lost."""

from __future__ import annotations

import contextlib
import re
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Dict, Iterator, List, Optional, Tuple

import pytest
from crashes import Life, Runs, World, outcome

from rosoclingo.errors import DamagedStoreError, StoreError
from rosoclingo.loop.journal import Status, StatusSet
from rosoclingo.loop.values.goals import Goal
from rosoclingo.store.database import Database, put_aside
from rosoclingo.store.high_water import HighWaterMark, decode, encode
from rosoclingo.store.loss import Loss, describe, summarize
from rosoclingo.store.store import Changes, Store

DYN_RESET = "dynamic.incremental.dyn_reset"
REQUESTS = ["visit(2)", "visit(99)", "visit(4)", "visit(1)"]
HEADER, FRAME = 32, 24 + 4096
MARK = range(3 * 4096, 4 * 4096, 512)  # its page, in sectors

Files = Dict[str, Optional[bytes]]  # the file's and the log's contents, by their suffixes


def contents(file: Path) -> Files:
    paths = {suffix: Path(f"{file}{suffix}") for suffix in ("", "-wal")}
    return {suffix: path.read_bytes() if path.exists() else None for suffix, path in paths.items()}


def write(file: Path, files: Files) -> None:
    for suffix, data in files.items():
        path = Path(f"{file}{suffix}")
        if data is not None:
            path.write_bytes(data)
        elif path.exists():
            path.unlink()


def number(file: Path) -> int:
    """Returns the number of a store's last transaction, and leaves the store as it is."""
    before = contents(file)
    with contextlib.closing(Store(file)) as store:
        found = store._database._number
    write(file, before)
    return found


def run(folder: Path, name: str = "a.store", most: int = 256) -> Tuple[Path, List[Files]]:
    """Returns the store of a run whose process has died, and what it was after each transaction.

    Args:
        folder: Where it is to be.
        name: Its name.
        most: How many pages the log may have.
    """
    runs, file, states = Runs(folder, DYN_RESET), folder / name, []

    def point(what: str) -> None:
        if what == "after write":
            states.append(contents(file))

    with contextlib.closing(Store(file, point=point)) as store:
        store._database._connection.execute(f"PRAGMA wal_autocheckpoint = {most}")
        Life(World(REQUESTS), store, runs.make(store)).live()
    write(file, states[-1])
    return file, states


@pytest.fixture(scope="module")
def died() -> Iterator[Tuple[Path, List[Files]]]:
    """As above, in memory if there is any: no power fails here."""
    memory = Path("/dev/shm")
    with TemporaryDirectory(dir=str(memory) if memory.is_dir() else None) as folder:
        yield run(Path(folder))


@pytest.mark.costly
@pytest.mark.parametrize("is_cut_in_frames", [False, True])
def test_a_log_that_is_cut(died: Tuple[Path, List[Files]], *, is_cut_in_frames: bool) -> None:
    """At each boundary of its frames, and in each frame, before what was acknowledged last."""
    file, states = died
    whole, last = states[-1], number(file)
    log = whole["-wal"]
    assert log is not None
    frames = len(log) // FRAME
    assert frames > 20
    for frame in range(frames):
        end = HEADER + frame * FRAME + (FRAME // 3 if is_cut_in_frames else 0)
        cut = {**whole, "-wal": log[:end]}
        write(file, cut)
        with pytest.raises(
            DamagedStoreError, match=rf"ends too early: of {last} transactions, the last \d+ are"
        ):
            Store(file)
        assert contents(file) == cut
    write(file, whole)


@pytest.mark.parametrize(("log", "said"), [(None, "is gone"), (b"", "is empty")])
def test_a_log_that_is_not_there(
    died: Tuple[Path, List[Files]], tmp_path: Path, log: Optional[bytes], said: str
) -> None:
    """As when only the file is copied. What is there goes on when that is wanted, and only then."""
    file, (_, states) = tmp_path / "b.store", died
    write(file, {**states[-1], "-wal": log})
    with pytest.raises(
        DamagedStoreError, match=rf"its log b.store-wal {said}: of \d+ .*resume:=lossy"
    ):
        Store(file)
    with contextlib.closing(Store(file, lossy=True)) as store:
        assert "transactions, the last" in store.loss
    with contextlib.closing(Store(file)) as store:
        assert not store.loss
    runs, world, calm = Runs(tmp_path, DYN_RESET), World(REQUESTS), World(REQUESTS)
    runs.run(calm)
    runs.run(world, file=file)
    assert outcome(world) == outcome(calm)


@pytest.mark.costly
def test_no_power_failure_is_taken_for_a_loss(died: Tuple[Path, List[Files]]) -> None:
    """The log is on the disk as it was acknowledged; the mark is not, or torn, or an older one."""
    file, states = died
    whole, chance = states[-1], Random(0)
    assert len({state[""] for state in states}) == len(states)  # by their marks
    for state in states:
        main = bytearray(whole[""] or b"")
        old = state[""]
        assert old is not None
        write(file, {**whole, "": old})
        assert number(file)
        for _ in range(2):
            for begin in MARK:
                if chance.random() < 0.5:
                    main[begin : begin + 512] = old[begin : begin + 512]
            write(file, {**whole, "": bytes(main)})
            assert number(file)
    write(file, whole)


def test_no_power_failure_brings_a_loss_back(
    died: Tuple[Path, List[Files]], tmp_path: Path
) -> None:
    """When what was lost was accepted, the mark of before may be there again, and not the new."""
    file, (_, states) = tmp_path / "b.store", died
    write(file, {**states[-1], "-wal": None})
    Store(file, lossy=True).close()
    data, old = bytearray(file.read_bytes()), states[-1][""]
    assert old is not None
    data[MARK.start : MARK.stop] = old[MARK.start : MARK.stop]
    file.write_bytes(bytes(data))
    Store(file).close()


def test_a_log_of_another_time(tmp_path: Path) -> None:
    """Be it of before a checkpoint: it is refused, or all is there that was acknowledged."""
    file, states = run(tmp_path, most=10)
    last, refused = number(file), 0
    assert len({len(state[""] or b"") for state in states}) > 1
    for state in states:
        mixed = {**states[-1], "-wal": state["-wal"]}
        write(file, mixed)
        try:
            Store(file).close()
        except DamagedStoreError:
            assert contents(file) == mixed
            refused += 1
            continue
        write(file, mixed)
        assert number(file) == last
    assert refused > len(states) // 2
    write(file, {**states[-1], "-wal": states[0]["-wal"]})
    with contextlib.closing(Store(file, lossy=True)) as store:
        assert store.loss


def test_a_log_of_another_store(died: Tuple[Path, List[Files]], tmp_path: Path) -> None:
    """It is put aside, and what the file has goes on; ``resume:=fresh`` mixes them not either."""
    _, states = died
    other, _ = run(tmp_path)
    file = tmp_path / "b.store"
    mixed = {**states[-1], "-wal": contents(other)["-wal"]}
    write(file, mixed)
    with pytest.raises(DamagedStoreError, match=r"its log is of another store; put back a file"):
        Store(file)
    assert contents(file) == mixed
    with contextlib.closing(Store(file, lossy=True)) as store:
        assert "the log is now" in store.loss
        assert "its log b.store-wal is gone" in store.loss
    aside = tmp_path / "b.store-wal.old1"
    assert aside.read_bytes() == mixed["-wal"]
    write(file, mixed)
    kept = put_aside(file)
    assert kept is not None
    assert contents(kept) == mixed
    assert not Path(f"{file}-wal").exists()


def test_a_log_that_is_not_whole_without_it_either(
    died: Tuple[Path, List[Files]], tmp_path: Path
) -> None:
    """The log is left where it is when going on without it is not possible."""
    file, (_, states) = tmp_path / "b.store", died
    main = states[-1][""]
    assert main is not None
    mixed: Files = {"": main[: MARK.start], "-wal": b"a log" * 1000}
    write(file, mixed)
    with pytest.raises(DamagedStoreError, match="is damaged"):
        Store(file, lossy=True)
    assert contents(file) == mixed


def test_an_empty_file_with_its_log(died: Tuple[Path, List[Files]], tmp_path: Path) -> None:
    """SQLite would remove the log."""
    file, (_, states) = tmp_path / "b.store", died
    mixed: Files = {"": b"", "-wal": states[-1]["-wal"]}
    write(file, mixed)
    for lossy in (False, True):
        with pytest.raises(StoreError, match=r"it is empty, but its log b.store-wal is there"):
            Store(file, lossy=lossy)
    kept = put_aside(file)
    assert kept is not None
    assert contents(kept) == mixed


def test_which_goals_are_lost(tmp_path: Path) -> None:
    file = tmp_path / "a.store"
    store = Store(file)
    store.add(Goal("visit(1)", (), "one"))
    store._database._connection.execute("PRAGMA wal_checkpoint(PASSIVE)")
    store.add(Goal("visit(2)", (), "two"))
    store.write(Changes(statuses=[StatusSet("one", Status.SUCCEEDED)]))
    files = contents(file)
    store.close()
    write(file, {**files, "-wal": None})
    said = (
        "of 3 transactions, the last 2 are missing; open goals that are lost: visit(2) (two); "
        "goals that had ended, and are open again: visit(1) (one); put back the log"
    )
    with pytest.raises(DamagedStoreError, match=re.escape(said)):
        Store(file)


def test_many_goals_are_lost() -> None:
    goals = {str(n): f"visit({n})" for n in range(30)}
    text = describe(Loss(1, 3, "its log is gone", summarize(goals)), {"29": "visit(29)"})
    assert "lost: visit(28) (28), visit(27) (27)" in text
    assert "20 more goals were open, some of which may be lost, too" in text
    assert "which goals are lost is not known" in describe(Loss(1, 3, "it is gone", None), {})


def test_details_that_are_too_long() -> None:
    mark = HighWaterMark("1", 2**40, "x" * 10_000)
    found = decode(bytes(416) + encode(mark))
    assert found == HighWaterMark("1", 2**40, None)


def test_the_mark_is_a_row_of_the_database(tmp_path: Path) -> None:
    """So SQLite finds the file as it should be, and no copy of the mark is in the log."""
    file = tmp_path / "a.store"
    with contextlib.closing(Database(file)) as database:
        for _ in range(3):
            with database.transaction() as rows:
                rows.put("part", "key", "value")
            with database.transaction(durable=False) as rows:
                rows.put("part", "key", "other")
        store = database._id
    with contextlib.closing(Database(file)) as database:
        (blob,) = database._connection.execute("SELECT bytes FROM mark").fetchone()
    assert decode(blob) == HighWaterMark(store, 5)
