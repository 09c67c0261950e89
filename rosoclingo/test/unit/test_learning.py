"""How long actions take is learned, told to the planner, recorded, and outlives crashes."""

from __future__ import annotations

import os
import time
from contextlib import closing
from pathlib import Path
from random import Random
from typing import Any, Callable, List, Sequence, Tuple

import pytest
from crashes import Life, Runs, World, outcome

from rosclingo.solver.options import Options
from rosoclingo.bags.read.run import Run
from rosoclingo.bags.replay.input_schedule import input_schedule
from rosoclingo.in_process.parts import EXAMPLES, make_parts
from rosoclingo.in_process.simulation import SimulatedSystem
from rosoclingo.loop.execution.durations import Durations
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.inputs.replay_inbox import ReplayInbox, decode, encode
from rosoclingo.loop.journal import ActionTook, Entry
from rosoclingo.loop.publishing import publish_abort
from rosoclingo.store.store import Store

RECORDING, DYN_RESET = (f"dynamic.incremental.{name}" for name in ("recording", "dyn_reset"))
TIMES = """
#include "{line}".
#program base.
fluent(lasts(go,1..50)).
#program state(t).
#external event(info,lasts(go,1..50),t).
told(N,t) :- event(info,lasts(go,N),t).
holds(lasts(go,N),t) :- told(N,t).
holds(lasts(go,N),t) :- before(lasts(go,N),t), not told(_,t).
believed(N,t) :- before(lasts(go,N),t).
believed(10,t) :- not before(lasts(go,_),t).
#program transition(t).
#show lasts(do(robot,go(X),t),go,N) : do(robot,go(X),t), believed(N,t).
"""
"""Going takes 10 s, until something else is told."""


@pytest.fixture
def file(tmp_path: Path) -> str:
    made = tmp_path / "times.lp"
    made.write_text(TIMES.format(line=f"{EXAMPLES}/line.lp"))
    return str(made)


def took(entries: Sequence[Entry]) -> List[Tuple[int, float]]:
    """Returns which actions were measured, and how long they took."""
    events = (entry.event for entry in entries)
    return [(e.number, e.seconds) for e in events if isinstance(e, ActionTook)]


def simulate(file: str, seconds: Sequence[float], *goals: str, **more: Any) -> SimulatedSystem:
    """Has a robot reach goals one after the other, whose actions take so long."""
    parts = make_parts(more.pop("mode", DYN_RESET), Options((file,)), ("-c", "steps=40"))
    rest = list(seconds)
    run = SimulatedSystem(parts.loop, seconds=lambda actuator, action: rest.pop(0), **more)
    for goal in goals:
        run.request(goal)
        assert run.run() is None
    assert [goal.words[-1] for goal in run.goals] == ["succeeded"] * len(goals)
    return run


def test_a_factor_of_what_was_learned_ends_what_hangs(file: str) -> None:
    """Going takes 10 s by the encoding and 30 s in truth: the third drive, which hangs, has 3x."""
    parts = make_parts(RECORDING, Options((file,)), ("-c", "steps=40"))
    answers = ["success"] * 6 + [None, "success"]
    run = SimulatedSystem(
        parts.loop,
        answer=lambda actuator, action: answers.pop(0),
        seconds=lambda actuator, action: 30.0 if answers else 1.0,
        policies={"go(*)": {"factor": 3}},
        action_timeout=1e6,
    )
    for goal in ("visit(4)", "visit(1)"):
        run.request(goal)
        assert run.run() is None
    mean = run.loop.state.durations.means["go"]
    assert 25.0 < mean < 30.0
    begin = run.clock
    run.request("visit(2)")
    assert run.run() is None
    assert run.goals[-1].words[-1] == "succeeded"
    assert f"3 times the {mean:g} s that go(2) takes" in "".join(run.warnings)
    assert 3 * mean <= run.clock - begin < 3 * mean + 10


def test_the_last_times_count_most() -> None:
    durations = Durations()
    for _ in range(12):
        durations.learn("way", 10, 30.0)
        durations.told.update(durations.news())
    assert 29.0 < durations.means["way"] < 30.0
    assert abs(durations.told["way"] - 29) <= 2
    for _ in range(12):
        durations.learn("way", 29, 10.0)
    assert 10.0 < durations.means["way"] < 11.0


def test_small_changes_and_unknown_kinds_are_not_told() -> None:
    durations = Durations()
    durations.learn("way", 40, 50.0)
    assert durations.means == {"way": 43.0}
    assert durations.news() == []
    durations.learn("way", 40, 50.0)
    assert durations.news() == [("way", 45)]
    durations.unknown.add("way")
    assert durations.news() == []


@pytest.mark.parametrize("mode", [RECORDING, DYN_RESET])
def test_the_planner_is_told(mode: str, file: str) -> None:
    """Also after a reset, since it is saved."""
    run = simulate(file, [20] * 4, "visit(2)", "visit(3)", "visit(5)", mode=mode)
    assert took(run.journal) == [(number, 20.0) for number in range(1, 5)]
    durations = run.loop.state.durations
    assert durations.means["go"] == pytest.approx(20 - 10 * 0.7**4)
    assert durations.told == {"go": 17}  # 17.6 is less than a tenth more
    told = run.loop.state.externals.true
    assert any(f"lasts(go,{durations.told['go']})" in atom for atom in told)


def test_only_a_success_counts(file: str) -> None:
    answers = iter(["failure", "success"])
    run = simulate(file, [50, 20], "visit(2)", answer=lambda actuator, action: next(answers))
    assert took(run.journal) == [(2, 20.0)]


def abort_first(run: SimulatedSystem) -> Callable[[], bool]:
    """Has the first action aborted before it is answered."""
    turn = run.turn

    def aborting() -> bool:
        if len(run.published) == 1:
            publish_abort(run.loop.state, "robot")
        return turn()

    return aborting


def test_an_aborted_action_does_not_count(file: str) -> None:
    parts = make_parts(RECORDING, Options((file,)))
    run = SimulatedSystem(parts.loop, seconds=lambda actuator, action: 20.0)
    run.turn = abort_first(run)  # type: ignore[method-assign]
    run.request("visit(3)")
    assert run.run() is None
    assert took(run.journal) == [(2, 20.0)]


def test_a_replay_has_the_recorded_times(file: str) -> None:
    run = simulate(file, [20, 35, 5, 20, 12], "visit(3)", "visit(1)", "visit(2)")
    dues = decode(encode(input_schedule(Run(run.journal))))
    replayed = ReplayInbox(dues)
    for number, seconds in took(run.journal):
        assert replayed.recorded.measured(str(number), 0.0) == seconds
    assert replayed.recorded.measured("99", 3.0) is None
    assert Inbox().recorded.measured("99", 3.0) == 3.0


class TimedWorld(World):
    """A robot whose actions take 25 s.

    Attributes:
        clock: What time it is, in seconds.
    """

    clock = 0.0

    def hear(self, *told: Any) -> None:
        before = len(self.effects)
        super().hear(*told)
        self.clock += 25.0 * (len(self.effects) - before)


@pytest.mark.costly
@pytest.mark.parametrize("seed", range(2))
def test_what_was_learned_outlives_crashes(
    seed: int, file: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Life, "world_now", lambda life: life._world.clock, raising=False)
    runs, chance = Runs(tmp_path, DYN_RESET, file), Random(seed)
    learned, outcomes = [], []
    for kills in ([], [chance.randrange(1, 40) for _ in range(12)]):
        world, store = TimedWorld(["visit(2)", "visit(4)", "visit(6)"]), runs.file()
        runs.run(world, kills, file=store)
        outcomes.append(outcome(world))
        with closing(Store(store)) as written:
            assert written.snapshot is not None
            learned.append(written.snapshot.state.durations)
    assert outcomes[0] == outcomes[1]
    assert learned[0] == learned[1]
    assert learned[0].means["go"] == pytest.approx(25 - 15 * 0.7**5)


@pytest.mark.parametrize(("listens_after", "learns"), [(2.0, False), (1000.0, True)])
def test_nothing_is_learned_from_a_time_in_which_nobody_listened(
    listens_after: float, learns: bool, file: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The node is back after 600 s; an action that is answered then may have taken much less."""
    world = TimedWorld(["visit(2)"])

    def back_late(*arguments: Any, **parameters: Any) -> Store:
        """Opens the store, of a node that was down for a while if it is not the first one."""
        pause = 600.0 if "a.store" in os.listdir(tmp_path) else 0.0
        world.clock += pause
        return Store(*arguments, now=lambda: time.time() + pause, **parameters)

    monkeypatch.setattr(Life, "world_now", lambda life: life._world.clock, raising=False)
    monkeypatch.setattr("crashes.Store", back_late)
    monkeypatch.setattr("rosoclingo.store.sqlite_store._SHORT_PAUSE_SECONDS", listens_after)
    runs, path = Runs(tmp_path, DYN_RESET, file), tmp_path / "a.store"
    crash = runs.run(TimedWorld(["visit(2)"])).index("before publication") + 3
    runs.run(world, [crash], file=path)
    with closing(Store(path)) as written:
        times = [seconds for _, seconds in took(written.records)]
    assert any(seconds > 600 for seconds in times) == learns
    assert bool(times) == learns
