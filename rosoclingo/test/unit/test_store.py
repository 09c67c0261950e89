"""What a run is stored in: whole or refused, small, and with a reason when it cannot be used."""

from __future__ import annotations

import contextlib
import dataclasses
import importlib
import shutil
import sqlite3
import sys
import threading
from collections import deque
from pathlib import Path
from random import Random
from typing import Callable, Deque, Dict, List, Optional, Sequence, Set, Tuple
from unittest.mock import MagicMock

import pytest
from crashes import Client, Crash, Life, Runs, World, outcome
from draws import draws

from rosclingo.errors import ServiceError
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire import commands as wire
from rosoclingo.encodings.about import Launched
from rosoclingo.encodings.started_with import started_with
from rosoclingo.errors import PlannerError, StoreError
from rosoclingo.in_process.parts import SINGLE
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.journal import (
    LOOP,
    Entry,
    LoopWaits,
    NodeResumed,
    Record,
    Status,
    StatusSet,
)
from rosoclingo.loop.monitor import Doing
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.state import State
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.goals import Goal, GoalClient
from rosoclingo.store.commands import RecordedSolver, SolverRetry
from rosoclingo.store.database import Database
from rosoclingo.store.fields import ChangedRows, read
from rosoclingo.store.folder import put_aside
from rosoclingo.store.outbox import HeldEffect, Outbox
from rosoclingo.store.sqlite_store import SqliteStore
from rosoclingo.store.store import Changes, Store

RECORDING, DYN_RESET = (f"dynamic.incremental.{name}" for name in ("recording", "dyn_reset"))
REQUESTS = ["visit(2)", "visit(1)"]
PAGE = 4096
DATABASE, LOG = "run.sqlite", "run.sqlite-wal"

# Fields.


@dataclasses.dataclass
class Inner:
    words: Set[str] = dataclasses.field(default_factory=set)
    order: Dict[str, int] = dataclasses.field(default_factory=dict)


@dataclasses.dataclass
class Outer:
    number: int = 0
    inner: Inner = dataclasses.field(default_factory=Inner)
    queue: Deque[str] = dataclasses.field(default_factory=deque)
    several: Tuple[Inner, ...] = ()
    sets: Dict[str, Set[str]] = dataclasses.field(default_factory=dict)
    maybe: Optional[str] = None


def change(value: Outer, chance: Random) -> None:
    """Changes something, in place where that is possible."""
    letter = chance.choice("abcdef")
    what: List[Callable[[], object]] = [
        lambda: setattr(value, "number", chance.randrange(3)),
        lambda: value.inner.words.add(letter),
        lambda: value.inner.words.discard(letter),
        lambda: value.inner.order.update({letter: chance.randrange(3)}),
        lambda: value.inner.order.pop(letter, None),
        lambda: value.queue.append(letter),
        lambda: value.queue and value.queue.popleft(),
        lambda: setattr(value, "several", (*value.several[-2:], Inner())),
        lambda: [one.words.add(letter) for one in value.several],
        lambda: value.sets.setdefault(letter, set()).add(chance.choice("xyz")),
        lambda: setattr(value, "maybe", chance.choice([None, letter])),
        lambda: setattr(value, "inner", Inner()),
    ]
    for _ in range(chance.randrange(4)):
        chance.choice(what)()


@pytest.mark.parametrize("seed", range(5))
def test_what_has_changed_is_written(seed: int, tmp_path: Path) -> None:
    """A store has a snapshot with the order of its dictionaries, whatever has changed."""
    chance, value, fields = Random(seed), Outer(), ChangedRows(Outer)
    with contextlib.closing(Database(tmp_path / "a.store")) as database:
        for _ in range(100):
            change(value, chance)
            with database.transaction(durable=False) as rows:
                for field, key, text in fields.changes(value):
                    if text is None:
                        rows.delete("state", f"{field} {key}")
                    else:
                        rows.put("state", f"{field} {key}", text)
            stored = database.read("state")
            pairs = {(key.split(" ")[0], key.split(" ", 1)[1]): v for key, v in stored.items()}
            found = read(Outer, pairs)
            assert found == value
            assert list(found.inner.order) == list(value.inner.order)


def test_nothing_is_written_without_a_change() -> None:
    value, fields = Outer(), ChangedRows(Outer)
    change(value, Random(1))
    assert fields.changes(value)
    assert not fields.changes(value)


# The planner's commands.


def test_a_command_that_fails_is_not_repeated() -> None:
    retry = SolverRetry("planner", lambda _: None, lambda _: None)
    recorded = RecordedSolver(Engine(Options()), retry)
    add = wire.Add("base", (), "#external e. a :- e.")
    ground = wire.Ground((wire.Part("base"),))
    wrong = wire.AssignExternal("f", wire.Truth.TRUE)
    assert recorded.run([add, ground, wire.GetExternals(), wrong, add]).failure is not None
    assert recorded.take() == [add, ground]
    written = ['<commands><ground><program name="step"/></ground></commands>']
    other = RecordedSolver(Engine(Options()), retry, lambda: written)
    with pytest.raises(PlannerError, match=r"refused <ground>.*there is no program step/0"):
        other.restore()


# What can go wrong.


def run_to(tmp_path: Path, requests: List[str], *, mode: str = RECORDING) -> Tuple[Runs, Path]:
    runs, file = Runs(tmp_path, mode), tmp_path / "a.store"
    runs.run(World(requests), file=file)
    return runs, file


@pytest.mark.parametrize(
    "script",
    [
        "UPDATE seal SET number = 'x'",
        "UPDATE seal SET store = 7",
        "PRAGMA writable_schema = ON;"
        "UPDATE sqlite_master SET sql = replace(sql, 'PRIMARY KEY', '') WHERE name = 'row'",
        "PRAGMA writable_schema = ON;"
        "UPDATE sqlite_master SET sql = CAST(x'435245415445d4d4d4' AS TEXT) WHERE name = 'seal'",
    ],
    ids=["number", "id", "schema", "bytes"],
)
def test_values_of_other_types(tmp_path: Path, script: str) -> None:
    """A file whose pages are whole is refused, too, and what the message says helps."""
    _, file = run_to(tmp_path, REQUESTS)
    with contextlib.closing(sqlite3.connect(str(file / DATABASE))) as connection:
        connection.executescript(script)
    with pytest.raises(StoreError, match=r"a.store is damaged: .*resume:=fresh"):
        Store(file)
    assert put_aside(file) == tmp_path / "a.store.old1"
    with contextlib.closing(Store(file)) as store:
        assert store.goals == {}


def test_a_format_of_a_later_sqlite(tmp_path: Path) -> None:
    _, file = run_to(tmp_path, REQUESTS)
    data = bytearray((file / DATABASE).read_bytes())
    data[47] = 9  # of which SQLite knows those up to 4
    (file / DATABASE).write_bytes(data)
    with pytest.raises(StoreError, match=r"a.store is damaged: .*resume:=fresh"):
        Store(file)
    assert put_aside(file) is not None
    assert not file.exists()


def test_a_store_of_another_version(tmp_path: Path) -> None:
    """It is refused with a sentence, and left as it is."""
    _, file = run_to(tmp_path, REQUESTS)
    with contextlib.closing(sqlite3.connect(str(file / DATABASE))) as connection:
        connection.execute("PRAGMA user_version = 3")
    before = (file / DATABASE).read_bytes()
    with pytest.raises(StoreError, match=r"a.store has the format 3, and this version of .* knows"):
        Store(file)
    assert (file / DATABASE).read_bytes() == before


@pytest.mark.parametrize(
    ("part", "key", "value"),
    [
        *(
            ("goal", "g", value)
            for value in ("", "[", "{}", "7", '["a"]', '["a", [], 7]', "[" * 9999)
        ),
        ("goal", "g", '["a", [], "", false, false, "asleep", "", 0.0]'),
        ("goal", "g", '["a", [], "", false, false, "pending", "", "late"]'),
        *(("journal", "1", value) for value in ("", "[]", '["late", 0, 0, "goal", "", "", [], 0]')),
        ("journal", "1", '[0, 0, 0, "goal", "", "", 7, 0]'),
        ("journal", "1", '[0, 0, 1e999, "goal", "", "", [], 0]'),
        *(
            ("journal", "1", f'[{time}, 0, 0, "goal", "", "", [], 0]')
            for time in ("1e999", "NaN", -1)
        ),
        ("journal", "9" * 12, '[0, 0, 0, "goal", "", "", [], 0]'),
        ("journal", "1", '[0, 0, 0, "goal", 7, "", [], 0]'),
        ("journal", "1", f'[0, 0, 0, "goal", "", "", [], {"9" * 400}]'),
        ("journal", "first", '[0, 0, 0, "goal", "", "", [], 0]'),
        *(("input", "1", value) for value in ("", "[]", '["plan", "", "", [], 0]')),
        *(("out", "1", value) for value in ("", "[]", '["robot"]', '["robot", 7]')),
        ("state", "controller", ""),
        ("state", "nothing", "1"),
        ("run", "started with", "7"),
    ],
)
def test_rows_that_this_version_does_not_write(
    tmp_path: Path, part: str, key: str, value: str
) -> None:
    file = tmp_path / "a.store"
    with contextlib.closing(Database(file)) as database, database.transaction() as rows:
        rows.put(part, key, value)

    def use() -> None:
        with contextlib.closing(Store(file)) as store:
            _ = store.unsent, store.inputs(lambda _: None)
            store.check({})

    with pytest.raises(StoreError, match=r"written by another version.*resume:=fresh") as caught:
        use()
    assert str(file) in str(caught.value)
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize("mode", [RECORDING, SINGLE])
@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("controller ", '"["'),
        ("controller ", '"7"'),
        ("state.executions.clock ", "9" * 400),
        ("state.mail.held ", '["["]'),
        ("state.mail.held ", '["[\\"cancel\\", \\"nobody\\", \\"\\", [], 0.0]"]'),
    ],
)
def test_a_state_that_this_version_does_not_write(
    tmp_path: Path, mode: str, key: str, value: str
) -> None:
    runs, file = run_to(tmp_path, REQUESTS, mode=mode)
    with contextlib.closing(Database(file)) as database, database.transaction() as rows:
        assert key in database.read("state")
        rows.put("state", key, value)
    with pytest.raises(StoreError, match=r"written by another version.*resume:=fresh"):
        runs.run(World(REQUESTS), file=file)


def test_an_execution_that_is_filed_under_another_actuator(tmp_path: Path) -> None:
    runs, file = run_to(tmp_path, REQUESTS)
    with contextlib.closing(Database(file)) as database, database.transaction() as rows:
        value = database.read("state")['state.executions.last "robot"']
        rows.put("state", 'state.executions.last "robot"', value.replace('"robot"', '"arm"'))
    with pytest.raises(StoreError, match=r"an execution of arm is filed under robot; .*fresh"):
        runs.run(World(REQUESTS), file=file)


def test_another_encoding(tmp_path: Path) -> None:
    runs, file = run_to(tmp_path, REQUESTS)
    runs.started_with = {"the file line.lp of planner": "12ab"}
    with pytest.raises(
        StoreError, match=r"with something else: .*; the file line.lp of planner was"
    ):
        runs.run(World(REQUESTS), file=file)
    assert put_aside(file) == tmp_path / "a.store.old1"
    runs.run(World(REQUESTS), file=file)
    assert put_aside(file) == tmp_path / "a.store.old2"
    assert put_aside(file) is None


def test_what_is_compared() -> None:
    def node(options: List[str], path: str, text: str) -> Dict[str, Launched]:
        arguments = ("-f", path, *options)
        return {"planner": Launched("/planner", "rosclingo run.py", arguments, {path: text})}

    one = started_with(node(["-c", "n=2"], "/x/a.lp", "a."))
    assert one == started_with(node(["-c", "n=2"], "/y/a.lp", "a."))
    assert one != started_with(node(["-c", "n=3"], "/x/a.lp", "a."))
    assert one != started_with(node(["-c", "n=2"], "/x/a.lp", "b."))


def test_a_full_disk(tmp_path: Path) -> None:
    """Nothing is told that is not written, and all goes on when there is room."""
    runs, calm, world, file = Runs(tmp_path, RECORDING), World(REQUESTS), World(REQUESTS), None
    runs.run(calm)
    file = tmp_path / "full.store"
    with pytest.raises(StoreError, match=r"full.store cannot be written: there is no more room"):
        runs.run(world, file=file, most_pages=8)
    assert outcome(world) != outcome(calm)
    store = Store(file)
    is_open = {goal.id for goal in store.goals.values() if not goal.status.is_terminal}
    store.close()
    assert is_open == {key for key, one in world.clients.items() if one.known and not one.end()}
    runs.run(world, file=file)
    assert outcome(world) == outcome(calm)


def test_nothing_leaves_of_a_run_that_is_refused(tmp_path: Path) -> None:
    """And what comes meanwhile is kept for the run with what it was started with."""
    runs, calm, file = Runs(tmp_path, RECORDING), World(REQUESTS), tmp_path / "a.store"
    world = World(REQUESTS)
    points = list(runs.run(calm))
    crash = points.index("before publication") + 2

    def point(what: str) -> None:
        points.append(what)
        if len(points) == crash:
            raise Crash

    points.clear()
    with contextlib.closing(Store(file, point=point)) as store, pytest.raises(Crash):
        Life(world, store, runs.make(store)).live()
    assert world._open
    before, runs.started_with = runs.started_with, {"the file line.lp of planner": "12ab"}
    heard: List[object] = []
    with contextlib.closing(Store(file)) as store:
        life = Life(world, store, runs.make(store))
        loop = life.loop
        with pytest.MonkeyPatch.context() as patch:
            for what in ("hear", "turn"):
                patch.setattr(world, what, lambda *said: heard.append(said))
            goals = life.stored.resume(loop.state, lambda known: world.clients[known.id])
            waiting = Goal("visit(4)", (), "3", late := Client())
            life.put(waiting)
            life.cancel(waiting)  # in another thread, as it were
            with pytest.raises(StoreError, match="with something else") as error:
                loop.prepare()
            loop.end(str(error.value))
            with pytest.raises(StoreError, match="with something else"):
                life.cancel(waiting)  # which is not acknowledged then
    assert not heard
    assert not late.words
    assert list(goals) == ["1"]
    runs.started_with = before
    world.clients["3"] = late
    runs.run(world, file=file)
    assert late.words == ["canceled"]
    del world.clients["3"]
    assert outcome(world) == outcome(calm)


@pytest.mark.parametrize("goes_on", [False, True])
def test_a_disk_that_is_full_from_the_beginning(tmp_path: Path, *, goes_on: bool) -> None:
    """The node cannot begin, which is told from an end that comes later."""
    runs, world, file = Runs(tmp_path, RECORDING), World(REQUESTS), tmp_path / "a.store"
    full: List[bool] = []

    def point(what: str) -> None:
        if full:
            raise sqlite3.OperationalError("database or disk is full")

    def fails(when: str) -> SqliteStore:
        with contextlib.closing(Store(file, point=point)) as store:
            life = Life(world, store, runs.make(store))
            loop = life.loop
            prepare, waits = loop.prepare, life.wait

            def begin() -> None:
                full.extend([True] * (when == "begin"))
                prepare()

            def wait(timeout: float) -> bool:
                full.extend([True] * (when == "later" and bool(world.effects)))
                return waits(timeout)

            loop.prepare = begin  # type: ignore[method-assign]
            life.wait = wait  # type: ignore[method-assign]
            with pytest.raises(StoreError, match="there is no more room") as error:
                life.live()
            loop.end(str(error.value))
            full.clear()
            return life.stored

    if goes_on:
        assert not fails("later").is_refused
    assert fails("begin").is_refused
    runs.run(world, file=file)
    assert all(client.end() == ["succeeded"] for client in world.clients.values())


@pytest.mark.parametrize(
    ("resumed", "unsure"),
    [
        ([], ["late"]),
        ([(20.0, 20.0)], ["late"]),  # and it died at once
        ([(20.0, 21.9), (40.0, 40.1), (41.0, 41.1)], ["late"]),
        ([(20.0, 22.0)], []),  # it has lived for so long that the results have left it
        ([(20.0, 22.0), (40.0, 40.1)], []),
        ([(10.5, 10.6)], ["late"]),
        ([(11.5, 14.0)], []),
    ],
)
def test_of_which_ends_clients_may_not_know(
    tmp_path: Path, resumed: List[Tuple[float, float]], unsure: List[str]
) -> None:
    """A result that is published again may be lost again, if the process dies again."""
    file, now = tmp_path / "a.store", [0.0]
    runs = Runs(tmp_path, RECORDING)
    with contextlib.closing(Store(file, now=lambda: now[0])) as store:
        for name, now[0] in (("early", 5.0), ("late", 10.0)):
            store.add(Goal("visit(2)", (), name))
            times = [Entry(LoopWaits(), 0, 0, int(now[0]), now[0])]
            store.write(Changes(records=times, statuses=[StatusSet(name, Status.SUCCEEDED)]))
        for number, (begin, last) in enumerate(resumed, 10):
            for node, when in ((LOOP, begin), ("planner", last)):
                event = Entry(NodeResumed(node), 0, 0, 2 * number + (node != LOOP), when)
                store.write(Changes(records=[event]))
    with contextlib.closing(Store(file)) as store:
        life = Life(World([]), store, runs.make(store))
        assert [one.id for one in life.stored.unsure] == unsure


def test_a_goal_that_cannot_be_stored(tmp_path: Path) -> None:
    runs, file = Runs(tmp_path, RECORDING), tmp_path / "a.store"

    def fails(what: str) -> None:
        raise Crash

    store = Store(file)
    life = Life(World([]), store, runs.make(store))
    store._database._point = fails
    with pytest.raises(Crash):
        life.put(Goal("visit(2)", (), "g"))
    assert not life.take()
    store.close()


@pytest.mark.costly
def test_goals_that_come_together_are_one_transaction(tmp_path: Path) -> None:
    runs, points = Runs(tmp_path, DYN_RESET), []
    store = Store(tmp_path / "a.store", point=points.append)
    clients = [Client() for _ in range(200)]
    life = Life(World([]), store, runs.make(store))
    for client in clients:
        client.note = life.loop.state.note
    goals = [Goal("visit(2)", (), f"g{n}", client) for n, client in enumerate(clients)]
    points.clear()
    life.put(*goals)
    assert points == ["before write", "after write"]
    points.clear()
    life.cancel(*goals[:150])
    assert points.count("before write") == 2  # the requests, and that the goals are recalled
    assert points.index("after write") < points.index("before result")
    assert [client.end() for client in clients] == [["canceled"]] * 150 + [[]] * 50
    store.close()
    store = Store(tmp_path / "a.store")
    again = Life(World([]), store, runs.make(store))
    known = again.stored.resume(again.loop.state, lambda _: Client())
    assert list(known) == [f"g{n}" for n in range(150, 200)]
    store.close()


def test_no_goal_of_several_is_taken_that_cannot_be_stored(tmp_path: Path) -> None:
    runs = Runs(tmp_path, DYN_RESET)
    store = Store(tmp_path / "a.store", most_pages=20)
    life = Life(World([]), store, runs.make(store))
    with pytest.raises(StoreError, match="no more room"):
        life.put(*(Goal(f"visit({n})", ("much",) * 20, str(n)) for n in range(1000)))
    assert not life.take()
    store.close()


def test_who_gathers_lets_out_what_another_thread_has_written(tmp_path: Path) -> None:
    """The loop's thread may commit it meanwhile, but lacks actionlib's lock."""
    environment = Listening()
    store = Store(tmp_path / "run.store")
    outbox = Outbox(environment, store)
    outbox.begin()
    heard: List[str] = []

    def gather() -> None:
        with outbox.together():
            outbox.note(Record(LoopWaits()))
            outbox.add(HeldEffect("result", lambda: heard.append("result")))
            gathered.set()
            assert saved.wait(60.0)
            assert heard == []

    gathered, saved = threading.Event(), threading.Event()
    thread = threading.Thread(target=gather)
    thread.start()
    assert gathered.wait(60.0)
    outbox.note(Record(LoopWaits()))
    outbox.save(Changes())
    assert environment.heard == [1, 2]
    assert [entry.number for entry in store.records] == [1, 2]
    saved.set()
    thread.join()
    assert heard == ["result"]
    store.close()


# Damaged files.


def copy(file: Path, to: Path) -> None:
    shutil.rmtree(to, ignore_errors=True)
    shutil.copytree(file, to)


def opened(file: Path) -> Optional[int]:
    """Returns the seal of a store, None if it is refused with a reason."""
    try:
        store = Store(file)
    except StoreError as err:
        if "is damaged: " in str(err) or "is no store" in str(err):
            return None
        raise
    seal = store._database._seal
    store.close()
    return seal


@pytest.fixture
def damaged(tmp_path: Path) -> Tuple[Path, Set[int], List[Path]]:
    """A store whose process has died, all seals that it has had, and copies of it on its way."""
    runs, file = Runs(tmp_path, DYN_RESET), tmp_path / "a.store"
    seals = {0}  # of the empty store
    copies: List[Path] = []

    def point(what: str) -> None:
        if "after" not in what:
            return
        if store is None or store._database._seal in seals:
            return
        seals.add(store._database._seal)
        if len(seals) % 4 == 0:
            copies.append(tmp_path / f"{len(copies)}.copy")
            copy(file, copies[-1])

    store: Optional[Store] = None
    store = Store(file, point=point)
    store._database._connection.execute("PRAGMA wal_autocheckpoint = 10")
    life = Life(World(["visit(2)", "visit(99)", "visit(4)", "visit(1)"]), store, runs.make(store))
    life.live()
    copy(file, tmp_path / "torn.store")
    store.close()
    copy(tmp_path / "torn.store", file)
    assert opened(tmp_path / "torn.store") in seals
    assert len(copies) > 3
    return file, seals, copies


@pytest.mark.costly
@pytest.mark.long
def test_a_store_that_is_cut(damaged: Tuple[Path, Set[int], List[Path]]) -> None:
    file, seals, _ = damaged
    torn, chance = file.with_name("torn.store"), Random(0)
    results = {True: 0, False: 0}
    for name in (DATABASE, LOG):
        size = (file / name).stat().st_size
        assert size > 2 * PAGE
        places = [*range(0, size, PAGE), *(chance.randrange(size) for _ in draws(range(100), 500))]
        for place in places:
            copy(file, torn)
            with (torn / name).open("r+b") as data:
                data.truncate(place)
            seal = opened(torn)
            assert seal is None or seal in seals, (name, place)
            results[seal is None] += 1
    print(results)
    assert all(results.values())


@pytest.mark.costly
def test_a_store_with_old_pages(damaged: Tuple[Path, Set[int], List[Path]]) -> None:
    file, seals, copies = damaged
    torn, chance = file.with_name("torn.store"), Random(0)
    refused = 0
    for number in range(100):
        copy(file, torn)
        if number % 2:  # else the write-ahead log has most pages anew
            with contextlib.closing(sqlite3.connect(str(torn / DATABASE))) as connection:
                connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        data = bytearray((torn / DATABASE).read_bytes())
        old = (chance.choice(copies) / DATABASE).read_bytes()
        for _ in range(chance.randrange(1, 4)):
            begin = chance.randrange(min(len(old), len(data)) // PAGE) * PAGE
            data[begin : begin + PAGE] = old[begin : begin + PAGE]
        (torn / DATABASE).write_bytes(bytes(data))
        seal = opened(torn)
        assert seal is None or seal in seals
        refused += seal is None
    assert refused


# How much is written.


@pytest.mark.costly
def test_writes_and_size(tmp_path: Path) -> None:
    """At most two durable writes a step; of what a run has done, only the journal is kept."""
    rows, writes, steps = [], [], []
    for trips in (5, 25):
        runs, file = Runs(tmp_path, DYN_RESET), tmp_path / f"{trips}.store"
        world = World(["visit(4)", "visit(1)"] * trips)
        points = runs.run(world, file=file)
        assert all(client.end() == ["succeeded"] for client in world.clients.values())
        with contextlib.closing(Database(file)) as database:
            rows.append([len(database.read(part)) for part in ("state", "command", "input", "out")])
            assert len(database.read("journal")) <= 2000
        writes.append(points.count("before write"))
        steps.append(len(world.effects))
    goals = 2 * 20  # each is written when it comes
    assert writes[1] - writes[0] <= 2 * (steps[1] - steps[0]) + goals
    assert rows[1] == rows[0]


class Trips(World):
    """A client that asks for the next trip when the one before has ended; the store is measured."""

    def __init__(self, trips: int, steps: Sequence[int]) -> None:
        super().__init__(["visit(6)", "visit(1)"] * trips)
        self.pages: List[int] = []
        self.rows: List[Dict[str, int]] = []
        self._steps = list(steps)

    def turn(self, life: Life) -> None:
        if len(self.effects) in self._steps[:1]:
            self._steps.pop(0)
            database = life.store._database
            self.pages += database._connection.execute("PRAGMA page_count").fetchone()
            self.rows.append({part: len(rows) for part, rows in database._known.items()})
        to_ask = self._to_ask
        if self._open:
            self._to_ask = []
        super().turn(life)
        self._to_ask = to_ask


@pytest.mark.costly
@pytest.mark.long
def test_a_file_does_not_grow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As soon as it has as many events and ended goals as are kept."""
    monkeypatch.setattr("rosoclingo.store.store._MOST_EVENTS", 100)
    monkeypatch.setattr("rosoclingo.store.store._MOST_ENDED", 10)
    world = Trips(40, [200, 390])
    Runs(tmp_path, DYN_RESET).run(world)
    assert len(world.effects) == 400
    assert world.rows[0] == world.rows[1]
    assert world.pages[1] <= 1.1 * world.pages[0]
    assert world.pages[1] * PAGE < 2**20


@pytest.mark.parametrize("seconds", [3.0, 0.0])
def test_how_long_is_waited_for_a_solver(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seconds: float
) -> None:
    """As ``~solver_timeout`` says; the messages are not there without a build, nor needed."""
    for module in ("rosoclingo.msg", "rosoclingo.ros.storing"):
        monkeypatch.setitem(sys.modules, module, MagicMock())
    monkeypatch.delitem(sys.modules, "rosoclingo.ros.storing")
    storing = importlib.import_module("rosoclingo.ros.storing")
    given = {"~store": str(tmp_path / "a.store"), "~resume": "", "~solver_timeout": seconds}
    monkeypatch.setattr("rospy.get_param", lambda name, *_: given[name])
    waited: List[float] = []
    lost = ServiceError("there is no planner")

    def wait(time: float) -> None:
        assert state.monitor.activity.doing is Doing.LACKS
        waited.append(time)
        raise lost

    with contextlib.closing(storing.open_durability(dict, wait)) as durability:
        inbox = Inbox()
        planner, environment = durability.connect(inbox, Engine(Options()), Environment())
        state = State(Planner(planner), inbox, environment)
        durability.resume(state, lambda _: GoalClient())
        with pytest.raises(ServiceError, match="there is no planner"):
            durability.wait_for_solver(lost)
    assert waited == ([seconds] if seconds else [])


class Listening(Environment):
    """Takes note of what leaves, in order; a publication may fail."""

    def __init__(self, failure: Optional[Exception] = None) -> None:
        self.heard: List[object] = []  # the journal's records by their numbers
        self._failure = failure

    def note(self, record: Record) -> None:
        assert isinstance(record, Entry)
        self.heard.append(record.number)

    def publish(self, actuator: str, action: str) -> None:
        self.heard.append("out")
        if self._failure is not None:
            raise self._failure

    def show_executions(self, run: str, told: object) -> None:
        self.heard.append("dispatch")


@pytest.mark.parametrize("failure", [None, ValueError("it cannot be sent")])
def test_who_waits_for_an_action_has_it_first(
    tmp_path: Path, failure: Optional[ValueError]
) -> None:
    """And the journal leaves whole, with what comes next if something is wrong with the action."""
    environment = Listening(failure)
    store = Store(tmp_path / "run.store")
    outbox = Outbox(environment, store)
    outbox.begin()
    outbox.note(Record(LoopWaits()))
    outbox.add(HeldEffect("plan", lambda: environment.heard.append("plan")))
    outbox.show_executions("run", ())
    outbox.publish("robot", "go")
    outbox.note(Record(LoopWaits()))
    assert environment.heard == []
    with contextlib.suppress(ValueError):
        outbox.save(Changes())
    assert environment.heard[:2] == ["dispatch", "out"]
    assert environment.heard[2:] == ([] if failure else [1, 2, "plan"])
    assert bool(store.unsent) == bool(failure)
    outbox.note(Record(LoopWaits()))
    outbox.save(Changes())
    assert [one for one in environment.heard if isinstance(one, int)] == [1, 2, 3]
    store.close()


@pytest.mark.costly
@pytest.mark.parametrize("mode", ["static.fixed.recording", "static.incremental.recording"])
def test_a_static_plan_is_there_again(tmp_path: Path, mode: str) -> None:
    """Whenever the process dies, who comes late hears the same plan."""
    file = tmp_path / "go.lp"
    file.write_text(
        "#program transition(t). { do(robot,go(1..2),t) } = 1. #show do/3. "
        "#program query(t). #external query(t). :- query(t), t < 3."
    )
    runs = Runs(tmp_path, mode, str(file), steps=3)
    calm = World([])
    points = runs.run(calm)
    assert calm.latched is not None
    assert calm.latched.startswith("[do(robot,go(")
    for crash in range(1, len(points) + 1):
        world = World([])
        runs.run(world, [crash])
        assert world.latched is not None
        assert world.latched.count("do(") == 3
