"""Whatever is written or sent when the process dies, the run goes on as if it had not.

CRASHES=10000 in the environment makes at least so many random kills, and pytest's -rP prints how
many there were in how many runs; the name of a test that fails has the seed, and repeats it. With
FULL=1, a solver is lost at each call, and not at some.
"""

from __future__ import annotations

import os
import threading
from contextlib import closing, contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any, Callable, Iterator, List, Mapping, Optional, Sequence, Set

import clingo
import pytest
from conftest import PACKAGE
from crashes import Client, Crash, Life, Runs, World, outcome
from draws import draws

from rosclingo.errors import ServiceError, SolverEndedError
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire import commands as wire
from rosoclingo.errors import ExhaustedError, StoreError
from rosoclingo.in_process.parts import EXAMPLES, SINGLE, find_mode, make_parts
from rosoclingo.loop.journal import Control, ControlArrived, MessageArrived
from rosoclingo.loop.mode.controller import Controller, Info
from rosoclingo.loop.quality import Quality
from rosoclingo.loop.values.goals import Goal
from rosoclingo.loop.values.solver import Forwarding, Solver
from rosoclingo.store import sqlite_store
from rosoclingo.store.store import Store

REQUESTS = ["visit(2)", "visit(99)", "visit(4)", "visit(1)"]
OF_ACTUATOR = (Control.HOLD, Control.RELEASE)
CANCELS = {"3": "accepted", "4": ""}
ENDS = {"1": ["succeeded"], "2": ["rejected"], "3": ["canceled"], "4": ["canceled"]}
RECORDING, DYN_RESET = (f"dynamic.incremental.{name}" for name in ("recording", "dyn_reset"))
IN_2_0_STYLE = str(PACKAGE / "test" / "modes" / "dynamic_2_0.lp")
ACTIONS = PACKAGE.parent / "rosoclingo_aspprograms" / "lib" / "actions.lp"
LAYERS = f"""
#include "{ACTIONS}".
#program base.
way(N,N+1) :- N = 1..5.
way(N+1,N) :- N = 1..5.
moves(robot).
initially(at(robot),1).
request(visit(1..6)).
wants(visit(N),at(robot),N) :- N = 1..6.
"""
CASES = [(DYN_RESET, "line_demand.lp"), (RECORDING, "line.lp"), (SINGLE, "line_1.0.lp")]
UNHEARD = ["after plan", "after note", "after feedback"]
KILLS = 30  # of a seed
SEEDS = -(-int(os.environ.get("CRASHES", "60")) // KILLS)


def world() -> World:
    return World(REQUESTS, CANCELS)


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    """A folder in memory, if there is any: no power fails here."""
    memory = Path("/dev/shm")
    with TemporaryDirectory(dir=str(memory if memory.is_dir() else tmp_path)) as made:
        yield Path(made)


@pytest.mark.costly
@pytest.mark.long
@pytest.mark.parametrize(("mode", "encoding"), CASES)
def test_every_point(mode: str, encoding: str, folder: Path) -> None:
    """The process dies before each write and publication; that is after the one before, too.

    In between nothing changes that outlives it. What nobody hears in this world changes nothing
    either, and the next point is like that before it.
    """
    runs, calm = Runs(folder, mode, encoding), world()
    points = list(runs.run(calm))
    assert outcome(calm)[1] == ENDS
    wrong: List[object] = []
    for number, (last, point) in enumerate(zip(["", *points], points), 1):
        if number < len(points) and (last in UNHEARD or not point.startswith("before")):
            continue
        disturbed = world()
        runs.run(disturbed, [number])
        if outcome(disturbed) != outcome(calm):
            wrong.append((number, point, outcome(disturbed)))
    print(f"{mode}, {encoding}: {len(points)} points")
    assert not wrong, outcome(calm)


@pytest.mark.costly
@pytest.mark.long
@pytest.mark.parametrize(("mode", "encoding"), CASES)
def test_an_operator_at_every_point(mode: str, encoding: str, folder: Path) -> None:
    """An operator's decisions outlast the process: nothing is held for ever, or begins too early.

    It dies at each eighth point; :func:`test_every_point` has all of them.
    """
    words = [Control.PAUSE, Control.STEP, Control.HOLD, Control.RESUME, Control.RELEASE]
    said = [ControlArrived(one, "robot" if one in OF_ACTUATOR else "") for one in words]

    def operated() -> World:
        return World(REQUESTS, CANCELS, said)

    runs, calm = Runs(folder, mode, encoding), operated()
    points = list(runs.run(calm))
    assert outcome(calm)[1] == ENDS
    for number in draws(range(1, len(points), 8), len(points)):
        disturbed = operated()
        runs.run(disturbed, [number])
        assert outcome(disturbed) == outcome(calm), (number, points[number])


@pytest.mark.costly
@pytest.mark.long
@pytest.mark.parametrize(("mode", "encoding"), CASES[::2])
def test_retries_at_every_point(mode: str, encoding: str, folder: Path) -> None:
    """Two failures of an action are one success, whenever the process dies, at each tenth point."""

    def failing() -> World:
        return World(REQUESTS, CANCELS, failures=(1, 2, 4))

    runs, calm = Runs(folder, mode, encoding), failing()
    runs.parameters = {"policies": {"go(*)": {"retries": 2}}}
    points = list(runs.run(calm))
    assert outcome(calm)[1] == ENDS
    for number in range(1, len(points), 10):
        disturbed = failing()
        runs.run(disturbed, [number])
        assert outcome(disturbed) == outcome(calm), (number, points[number])


@pytest.mark.costly
@pytest.mark.long
def test_a_backlog_at_every_point(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Goals that wait in the inbox outlast the process, at each twentieth point."""
    monkeypatch.setattr("rosoclingo.loop.mail.MOST_QUEUED", 1)
    backlogs: List[int] = []

    class Watched(Life):
        def make_room(self, goals: int) -> None:
            super().make_room(goals)
            backlogs.append(self.backlog)

    monkeypatch.setattr("crashes.Life", Watched)
    requests = [f"visit({n})" for n in (2, 3, 1, 4, 99, 2, 5, 1)]

    def asked() -> World:
        return World(requests, {"8": ""})

    runs, calm = Runs(folder, DYN_RESET), asked()
    points = list(runs.run(calm))
    ends = {str(n): ["succeeded"] for n in range(1, 9)}
    ends.update({"5": ["rejected"], "8": ["canceled"]})
    assert outcome(calm)[1] == ends
    assert max(backlogs) >= 2
    for number in range(1, len(points), 20):
        disturbed = asked()
        runs.run(disturbed, [number])
        assert outcome(disturbed)[1] == ends, (number, points[number])


class Batch(Life):
    """A life in which a request of an operator and a goal come together in a command."""

    def live(self) -> None:
        carry_out = self.loop._call

        def call(command: clingo.Symbol, info: Info) -> None:
            carry_out(command, info)
            is_asked = "2" in self.known or self._world.clients["2"].known
            if command.name == "commit_actions" and "1" in self.known and not is_asked:
                self.put(ControlArrived(Control.HOLD, "other"))
                self.ask("2")

        self.loop._call = call  # type: ignore[method-assign]
        super().live()


@pytest.mark.costly
def test_a_goal_behind_an_operators_request(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The request is committed, and a crash right after that loses no goal."""
    monkeypatch.setattr("crashes.Life", Batch)

    def asked() -> World:
        return World(["visit(3)", "visit(2)"], asks=["1"])

    runs, calm = Runs(folder, DYN_RESET), asked()
    points = list(runs.run(calm))
    assert outcome(calm)[1] == {"1": ["succeeded"], "2": ["succeeded"]}
    for number in range(1, len(points) + 1, 5):
        disturbed = asked()
        runs.run(disturbed, [number])
        assert outcome(disturbed)[1] == outcome(calm)[1], (number, points[number - 1])


@pytest.mark.costly
@pytest.mark.long
def test_a_second_crash_in_the_recovery(folder: Path) -> None:
    runs, calm = Runs(folder, DYN_RESET), world()
    points = list(runs.run(calm))
    for first in range(3, len(points), 45):
        for second in range(1, 6):
            disturbed = world()
            runs.run(disturbed, [first, second])
            assert outcome(disturbed) == outcome(calm), (first, second)


@pytest.mark.costly
@pytest.mark.parametrize("seed", range(SEEDS))
def test_random_kills(seed: int, folder: Path) -> None:
    """There are runs until so many kills were made: one may be through before it is killed again.

    A message has no acknowledgement. One that has come is told once.
    """
    runs, calm, chance, count = Runs(folder, DYN_RESET), world(), Random(seed), 0
    runs.run(calm)
    while runs.kills < KILLS:
        kills = [chance.randrange(1, 40) for _ in range(KILLS - runs.kills)]
        disturbed, file = (
            World(REQUESTS, CANCELS, [MessageArrived("info", "close(6)")]),
            runs.file(),
        )
        runs.run(disturbed, kills, file)
        assert outcome(disturbed) == outcome(calm)
        with closing(Store(file)) as store:
            told = [record.event for record in store.records]
            assert any("closed(6)" in command for command in store.commands)
        messages = [one for one in told if isinstance(one, MessageArrived) and one.source == "info"]
        assert [one.value for one in messages] == ["close(6)"]
        count += 1
    print(f"seed {seed}: {runs.kills} kills in {count} runs")


@pytest.mark.costly
def test_random_kills_with_plans_in_layers(folder: Path) -> None:
    """How many layers there are is saved, since it depends on time."""
    encoding = folder / "line.lp"
    encoding.write_text(LAYERS, encoding="utf-8")
    runs, calm, chance = Runs(folder, DYN_RESET, str(encoding)), world(), Random(0)
    runs.run(calm)
    assert outcome(calm)[1] == ENDS
    most = KILLS if "CRASHES" in os.environ else 6
    while runs.kills < most:
        disturbed = world()
        runs.run(disturbed, [chance.randrange(1, 40) for _ in range(most - runs.kills)])
        assert outcome(disturbed) == outcome(calm)


class Mortal(Forwarding):
    """A solver that is lost at a call, before or after it is carried out, and begins again."""

    def __init__(self, solver: Solver) -> None:
        super().__init__(solver)
        self.calls = 0
        self.lost_at: Set[int] = set()
        self.error = ServiceError("the connection was lost")
        self.events_are_facts = bool(getattr(solver, "events_are_facts", False))

    def _lose(self) -> None:
        self.calls += 1
        if self.calls in self.lost_at:
            self._solver.run([wire.Restart()])
            raise self.error

    def run(self, commands: Sequence[wire.Command]) -> wire.Reply:
        self._lose()
        reply = super().run(commands)
        self._lose()
        return reply

    def solve(self, *arguments: Any) -> wire.Outcome:
        self._lose()
        return super().solve(*arguments)


@pytest.mark.costly
@pytest.mark.long
@pytest.mark.parametrize("is_planner", [True, False])
@pytest.mark.parametrize("encoding", ["line.lp", "line_demand.lp"])
def test_a_solver_is_lost_at_each_call(folder: Path, encoding: str, *, is_planner: bool) -> None:
    runs, waits = Runs(folder, DYN_RESET, encoding), [0]

    def wait() -> None:
        waits[0] += 1

    runs.wait = wait
    parts = runs.parts
    mode = Engine(Options((find_mode(DYN_RESET),), ("-c", "steps=30")))
    mortal = Mortal(parts.planner if is_planner else mode)
    if is_planner:
        runs.parts = replace(parts, planner=mortal)
    else:
        runs.parts = replace(parts, decider=lambda: Controller(mortal))
    calm = world()
    runs.run(calm)
    some = range(0, mortal.calls, 7 if is_planner else 13)
    for number in draws(some, mortal.calls):
        often = 1 + number % 2  # also while it is made what it was
        mortal.calls, mortal.lost_at, waits[0] = 0, {number + 1, number + often}, 0
        disturbed = world()
        runs.run(disturbed)
        assert outcome(disturbed) == outcome(calm), number
        assert waits[0] == often


class Searching(Forwarding):
    """A solver in whose searches something happens, which looks whether to stop then."""

    def __init__(self, solver: Solver, happens: Callable[[int], None]) -> None:
        super().__init__(solver)
        self._happens = happens
        self._searches = 0

    def solve(
        self,
        assumptions: Sequence[wire.Assumed] = (),
        stopped: Optional[Callable[[], bool]] = None,
        improved: Callable[[wire.Improvement], None] = lambda _: None,
    ) -> wire.Outcome:
        if stopped is not None:
            self._searches += 1
            for number in range(3):
                self._happens(3 * self._searches + number)
                stopped()
        return super().solve(assumptions, stopped, improved)


@pytest.mark.parametrize("dies", [False, True])
@pytest.mark.parametrize("encoding", ["line.lp", "line_demand.lp"])
def test_a_rejection_does_not_wait_for_a_search(folder: Path, encoding: str, *, dies: bool) -> None:
    """And if the process dies in that search, the journal tells of the goal nevertheless."""
    runs, calm, disturbed, file = Runs(folder, DYN_RESET, encoding), world(), world(), folder / "a"
    runs.run(calm)
    client = disturbed.clients["new"] = Client()
    lives: List[Life] = []
    words: List[List[str]] = []
    begin = 3 * 4  # in the fourth search

    def happens(number: int) -> None:
        if number == begin:
            lives[-1].put(Goal("visit(98)", ("some",), "new", client))
        if number == begin + 2 and not words:
            words.append(list(client.words))
            if dies:
                raise Crash

    runs.parts = replace(runs.parts, planner=Searching(runs.parts.planner, happens))
    with closing(Store(file)) as store:
        lives.append(Life(disturbed, store, runs.make(store)))
        client.note = lives[-1].loop.state.note
        with suppress(Crash):
            lives[-1].live()
    assert words == [["rejected"]]
    runs.parts = replace(runs.parts, planner=runs._engine)
    runs.run(disturbed, file=file)
    assert client.words == ["rejected"]
    del disturbed.clients["new"]
    assert outcome(disturbed) == outcome(calm)
    with closing(Store(file)) as store:
        told = [record.event for record in store.records]
    about = [one for one in told if getattr(one, "goal", "") == "new"]
    assert [type(one).__name__ for one in about] == ["GoalArrived", "StatusSet"]


@contextmanager
def living(runs: Runs, world: World, file: Path, number: int) -> Iterator[Life]:
    """A process that was ended at a point as a signal does, and has had its say."""
    left = number

    def point(_: str) -> None:
        nonlocal left
        left -= 1
        if left == 0:
            life.close()

    with closing(Store(file, point=point)) as store:
        life = Life(world, store, runs.make(store))
        life.live()
        yield life


def end_politely(runs: Runs, world: World, file: Path, number: int) -> None:
    """Ends a process at a point.

    A goal comes while it ends, and another one when its store is closed.
    """
    with living(runs, world, file, number) as life:
        life.put(Goal("visit(98)", (), "late", world.clients["late"]))
    with pytest.raises(StoreError):
        life.put(Goal("visit(98)", (), "latest", world.clients["latest"]))


@pytest.mark.costly
def test_a_polite_end_at_some_points(folder: Path) -> None:
    """It tells nobody of an end, and what comes meanwhile is for the next process."""
    runs, calm = Runs(folder, DYN_RESET), world()
    many = len(runs.run(calm))
    for number in draws(range(5, many, 12), many):
        disturbed, file = world(), runs.file()
        late, latest = (disturbed.clients.setdefault(key, Client()) for key in ("late", "latest"))
        end_politely(runs, disturbed, file, number)
        assert (late.words, latest.words) == ([], []), number
        runs.run(disturbed, file=file)
        assert (late.words, latest.words) == (["rejected"], []), number  # there is no such place
        del disturbed.clients["late"], disturbed.clients["latest"]
        assert outcome(disturbed) == outcome(calm), number


@pytest.mark.costly
@pytest.mark.parametrize("early", [1, 2])
def test_the_end_of_a_process_in_a_reset_that_waits(
    folder: Path, early: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The next process does not take for done what has failed, and resets anew."""
    monkeypatch.setattr(sqlite_store, "_LATEST_SECONDS", 0.0)
    runs = Runs(folder, DYN_RESET)
    constants = ("steps=30", "resets=every", "r=1", f"early={early}")
    options = [word for constant in constants for word in ("-c", constant)]
    runs.parts = make_parts(IN_2_0_STYLE, Options((f"{EXAMPLES}/line.lp",)), options)

    def make() -> World:
        return World(["visit(2)"], failures=[1])

    calm = make()
    many = len(runs.run(calm))
    actions = [("robot", action) for action in ("go(2)", "go(2)")]
    assert outcome(calm) == (actions, {"1": ["succeeded"]})
    for number in draws(range(30, many, 13), many):
        ended, killed, file = make(), make(), runs.file()
        with living(runs, ended, file, number):
            pass
        runs.run(ended, file=file)
        runs.run(killed, [number])
        assert outcome(ended) == outcome(killed) == outcome(calm), number


def test_a_goal_that_comes_after_the_end(folder: Path) -> None:
    """Of the run, by itself: it is rejected, and so it is when it comes again."""
    runs, file, client = Runs(folder, DYN_RESET), folder / "a.store", Client()
    with closing(Store(file)) as store:
        life = Life(World([]), store, runs.make(store))
        life.loop.prepare()
        life.loop.end("there is no plan")
        life.put(MessageArrived("robot", "success"))
        goal = Goal("visit(2)", (), "late", client)
        thread = threading.Thread(target=lambda: life.put(goal))  # as one of rospy's
        thread.start()
        thread.join()
    assert client.words == ["rejected"]
    with closing(Store(file)) as store:
        assert store.ended == "there is no plan"
        (known,) = store.ended_goals
        assert (known.id, known.status, known.reason) == ("late", "rejected", "there is no plan")


def test_a_solver_that_ends_before_it_has_said_what_it_is(folder: Path) -> None:
    """At the begin of a run, as at the begin of a process that goes on: goals stay open."""
    runs, file, waiting = Runs(folder, DYN_RESET), folder / "a.store", World(["visit(3)"])

    def started_with() -> Mapping[str, str]:
        raise StoreError("/planner did not say what it was started with")

    with closing(Store(file)) as store:
        life = Life(waiting, store, runs.make(store))
        life.stored.started_with = started_with
        waiting.turn(life)
        with pytest.raises(StoreError, match="did not say") as error:
            life.live()
        life.loop.end(str(error.value))
        assert life.stored.is_refused
    assert not waiting.clients["1"].words
    runs.run(waiting, file=file)
    assert waiting.clients["1"].end() == ["succeeded"]


def test_a_solver_that_does_not_come_back(folder: Path) -> None:
    runs = Runs(folder, DYN_RESET)

    def wait() -> None:
        raise ServiceError("there is no solver")

    runs.wait = wait
    mortal = Mortal(runs.parts.planner)
    mortal.lost_at = {9}
    runs.parts = replace(runs.parts, planner=mortal)
    with pytest.raises(ServiceError, match="there is no solver"):
        runs.run(world())


@pytest.mark.parametrize("is_told", [False, True])
def test_a_solver_is_lost_again_and_again(folder: Path, *, is_told: bool) -> None:
    """The run is left to another process, unless the solver is told to end."""
    runs, calm, disturbed = Runs(folder, DYN_RESET), world(), world()
    runs.run(calm)
    mortal = Mortal(runs.parts.planner)
    runs.parts = replace(runs.parts, planner=mortal)
    runs.wait = lambda: None
    mortal.lost_at = set(range(9, 20))
    if is_told:
        mortal.error = SolverEndedError("it is shutting down")
        runs.run(disturbed)
        assert outcome(disturbed) == outcome(calm)
    else:
        with pytest.raises(ExhaustedError, match="lost each time: the connection was lost"):
            runs.run(disturbed)
        assert not any(client.end() for client in disturbed.clients.values())


class Weak(Forwarding):
    """A solver whose process is killed each time that it searches for one of the goals."""

    def __init__(self, solver: Solver, deadly: str) -> None:
        super().__init__(solver)
        self._deadly = deadly
        self._kills = False

    def run(self, commands: Sequence[wire.Command]) -> wire.Reply:
        for one in commands:
            if isinstance(one, wire.Restart):
                self._kills = False
            elif isinstance(one, wire.AssignExternal) and f",{self._deadly}," in one.name:
                self._kills = one.value is wire.Truth.TRUE
        return super().run(commands)

    def solve(self, *arguments: Any) -> wire.Outcome:
        if self._kills:
            self._solver.run([wire.Restart()])
            self._kills = False
            raise ServiceError("the connection was lost")
        return super().solve(*arguments)


def test_a_goal_at_which_the_solver_is_lost_each_time(folder: Path) -> None:
    """It ends, the others go on; also if they are told together."""
    runs, world = Runs(folder, DYN_RESET), World(["visit(2)", "visit(4)", "visit(3)"])
    runs.parts = replace(runs.parts, planner=Weak(runs.parts.planner, "visit(4)"))
    runs.wait = lambda: None
    runs.run(world)
    ends = [client.end() for client in world.clients.values()]
    assert ends == [["succeeded"], ["rejected"], ["succeeded"]]


def test_a_solver_comes_back_with_something_else(folder: Path) -> None:
    """The run is refused as at a start: its goals stay open, and go on with what they had."""
    runs, calm, disturbed, file = Runs(folder, DYN_RESET), world(), world(), folder / "a.store"
    runs.run(calm)
    before = runs.started_with

    def wait() -> None:
        runs.started_with = {"the file line.lp of planner": "12ab"}

    runs.wait = wait
    mortal = Mortal(runs.parts.planner)
    runs.parts = replace(runs.parts, planner=mortal)
    mortal.lost_at = {30}
    with closing(Store(file)) as store:
        life = Life(disturbed, store, runs.make(store))
        with pytest.raises(StoreError, match=r"something else: .*the file line.lp") as error:
            life.live()
        life.loop.end(str(error.value))
        assert life.stored.is_refused
    assert any(client.words and not client.end() for client in disturbed.clients.values())
    runs.started_with = before
    runs.run(disturbed, file=file)
    assert outcome(disturbed) == outcome(calm)


def test_what_a_plan_costs_is_shown_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Who comes late hears it from the node that was started again, before that does anything."""
    shown: List[Optional[Quality]] = []
    monkeypatch.setattr(Life, "show_quality", lambda _, quality: shown.append(quality))
    mailbot = PACKAGE.parent / "rosoclingo_aspprograms" / "mailbot"
    files = (mailbot / "instances" / "graph_hall.lp", mailbot / "mailbot.lp")
    runs, world, file = Runs(folder, DYN_RESET), World(["bring(a,b)"]), folder / "hall.store"
    runs.parts = make_parts(DYN_RESET, Options(tuple(map(str, files))), ("-c", "steps=30"))

    def die(what: str) -> None:
        if what == "after publication":
            raise Crash

    with closing(Store(file, point=die)) as store, pytest.raises(Crash):
        Life(world, store, runs.make(store)).live()
    (first,) = shown
    assert first is not None
    with closing(Store(file)) as store:
        life = Life(world, store, runs.make(store))
        life.stored.resume(life.loop.state, lambda known: world.clients[known.id])
        life.loop.prepare()
    assert shown == [first, first]
