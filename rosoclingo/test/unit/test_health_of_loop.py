"""The health of the loop, actuators and store: docs/protocol.md, section "Diagnostics"."""

from __future__ import annotations

import math
import re
import shutil
import time
from dataclasses import replace
from pathlib import Path
from typing import Any, Callable, Dict, List, Tuple

import pytest
import yaml
from conftest import HARD
from conftest import System as Threaded
from test_operator import STEPS, Operated, goes
from waiting import wait_for

from rosclingo.health import Health, HealthLevel
from rosclingo.solver.options import Options
from rosoclingo.in_process.parts import EXAMPLES, SINGLE, make_parts
from rosoclingo.in_process.system import System
from rosoclingo.loop.actuator_health import (
    LATE_SECONDS,
    HealthClocks,
    actuator_health,
    actuators_of,
)
from rosoclingo.loop.execution.heartbeats import Heartbeat
from rosoclingo.loop.execution.tokens import untaken_answers
from rosoclingo.loop.execution.watchdog import REMINDER_SECONDS
from rosoclingo.loop.health import START_SECONDS, StoreSummary, loop_health, store_health
from rosoclingo.loop.journal import AnswerArrived, Control, ControlArrived, MessageArrived
from rosoclingo.loop.monitor import CurrentActivity, Doing, LoopMonitor, LoopSummary
from rosoclingo.loop.values.execution import Execution, HeldAction, HoldReason
from rosoclingo.store.store import Changes, Store

OK, WARN, ERROR = HealthLevel.OK, HealthLevel.WARN, HealthLevel.ERROR
SLOW = 30.0
RECORDING, STATIC = "dynamic.incremental.recording", "static.incremental.recording"
CONFIGURATION = Path(__file__).resolve().parents[2] / "config" / "diagnostics.yaml"
Report = Tuple[HealthLevel, str]
GO = Execution(7, 3, "robot", "go(3)", began=100.0, world_began=1000.0)


def values(health: Health) -> Dict[str, str]:
    return dict(health.values)


def of_loop(system: Any, seconds: float = 0.0, queue: int = 0) -> Health:
    """Returns what is said of a loop some seconds later."""
    monitor = system.loop.state.monitor
    now = monitor.activity.since + seconds
    return loop_health(monitor, now, queue=queue, slow_seconds=SLOW)


def monitor_of(doing: Doing, what: str = "", **summary: Any) -> LoopMonitor:
    monitor = LoopMonitor()
    monitor.activity = CurrentActivity(doing, what, 100.0)
    monitor.summary = LoopSummary(time=100.0, step=3, horizon=9, **summary)
    return monitor


def said(monitor: LoopMonitor, seconds: float) -> Report:
    health = loop_health(monitor, 100.0 + seconds, queue=0, slow_seconds=SLOW)
    return health.level, health.message


# The loop.


@pytest.mark.parametrize(
    ("doing", "what", "part"),
    [
        (Doing.DECIDES, "", "takes inputs and asks the controller what to do next, for 31.0 s"),
        (Doing.RUNS, "ground(5)", "carries out ground(5), for 31.0 s"),
        (Doing.SEARCHES, "horizon 9", "searches for a plan, for 31.0 s, horizon 9"),
    ],
)
def test_a_loop_that_hangs(doing: Doing, what: str, part: str) -> None:
    monitor = monitor_of(doing, what)
    assert said(monitor, SLOW)[0] is OK
    assert said(monitor, SLOW + 1.0) == (WARN, f"{part}, longer than ~slow_seconds (30 s)")
    health = loop_health(monitor, 1e6, queue=4, slow_seconds=0.0)
    assert health.level is OK
    assert values(health)["in this state (s)"] == "999900.000"
    assert values(health)["inputs in the queue"] == "4"
    is_search = doing is Doing.SEARCHES
    assert values(health)["search under way (s)"] == ("999900.000" if is_search else "0.000")


def test_no_plan_for_long_over_many_horizons() -> None:
    monitor = monitor_of(Doing.SEARCHES, "horizon 90")
    monitor.planning_since = 60.0
    assert said(monitor, -11.0)[0] is OK
    assert said(monitor, 1.0) == (
        WARN,
        "searches for a plan, for 1.0 s, horizon 90; without a plan for 41.0 s, longer than "
        "~slow_seconds (30 s)",
    )
    assert said(monitor, 50.0)[1].count("~slow_seconds") == 1
    health = loop_health(monitor, 101.0, queue=0, slow_seconds=0.0)
    assert (health.level, values(health)["without a plan (s)"]) == (OK, "41.000")


@pytest.mark.parametrize("doing", [Doing.WAITS, Doing.IMPROVES, Doing.ENDED])
def test_what_may_go_on_for_ever(doing: Doing) -> None:
    assert said(monitor_of(doing), 1e6)[0] is OK


def test_it_is_said_for_what_it_waits() -> None:
    assert said(monitor_of(Doing.WAITS), 1.0)[1] == "waits for inputs, step 3 of 9"
    acts = monitor_of(Doing.WAITS, executions=(GO,))
    assert said(acts, 1.0)[1] == "waits for actuators, step 3 of 9"


def test_solvers_that_do_not_come() -> None:
    monitor = monitor_of(Doing.STARTS)
    assert said(monitor, START_SECONDS)[0] is OK
    assert said(monitor, START_SECONDS + 1)[0] is WARN
    assert "waits for its solvers" in said(monitor, START_SECONDS + 1)[1]


def test_a_solver_that_is_lost() -> None:
    monitor = monitor_of(Doing.RUNS, "solve")
    with monitor.interlude(Doing.LACKS, "the connection to /planner/control was lost"):
        now = monitor.activity.since + 1.5
        health = loop_health(monitor, now, queue=0, slow_seconds=SLOW)
    assert health.level is WARN
    assert health.message == (
        "waits for a solver that was lost, for 1.5 s: the connection to /planner/control was lost"
    )
    assert monitor.activity == (Doing.RUNS, "solve", 100.0)


def test_why_a_loop_has_ended() -> None:
    monitor = monitor_of(Doing.ENDED, is_paused=True)
    monitor.end = "the planner has no plan within the horizon of 4 steps"
    assert said(monitor, 1.0) == (ERROR, f"has ended: {monitor.end}")


def test_all_that_an_operator_should_know() -> None:
    held = tuple(HeldAction(f"r({n})", "go", HoldReason.APPROVAL) for n in range(5))
    monitor = monitor_of(Doing.SEARCHES, "horizon 9", is_paused=True, held=held)
    level, message = said(monitor, 40.0)
    assert level is WARN
    assert message == (
        "searches for a plan, for 40.0 s, horizon 9, longer than ~slow_seconds (30 s); paused by "
        "an operator; waits for an operator: r(0) go (approval), r(1) go (approval), r(2) go "
        "(approval), 2 more"
    )


class Watched(Operated):
    """A robot, and somebody who looks at the loop when it waits."""

    def __init__(self, mode: str, *turns: Tuple[Control, str]) -> None:
        self.seen: List[Health] = []
        super().__init__(mode, *turns)

    def turn(self) -> bool:
        monitor = self.loop.state.monitor
        monitor.is_wanted = True
        self.loop.state.poll()
        self.seen.append(of_loop(self, 1.0))
        return super().turn()


@pytest.mark.parametrize("mode", [RECORDING, SINGLE])
def test_a_run(mode: str) -> None:
    """At rest, paused, and executing."""
    system = Watched(mode)
    assert system.run() is None
    at_rest = system.seen[-1]
    assert at_rest.level is OK
    assert at_rest.message.startswith("waits for inputs, step ")
    assert values(at_rest)["goals with a slot"] == "0"
    for _ in range(3):
        system.request("visit(3)")
    system.operate(Control.PAUSE)
    assert system.run() is None
    paused = system.seen[-1]
    assert paused.level is WARN
    assert paused.message.startswith("paused by an operator; waits for an operator: robot go(2)")
    assert values(paused)["held"] == "robot go(2) (pause)"
    assert values(paused)["paused"] == "yes"
    assert values(paused)["goals with a slot"] == "2"
    assert values(paused)["goals that wait for a slot"] == "1"
    searched = system.loop.state.monitor.searched
    assert searched is not None
    assert values(paused)["last search (s)"] == f"{searched:.3f}"
    assert float(values(paused)["since the last decision (s)"]) >= 1.0
    system.seen.clear()
    system.operate(Control.RESUME)
    assert system.run() is None
    assert {one.level for one in system.seen} == {OK}
    assert any(one.message.startswith("waits for actuators, step") for one in system.seen)


def test_nobody_makes_summaries_that_nobody_wants() -> None:
    system = Operated(RECORDING)
    system.request("visit(3)")
    assert system.run() is None
    assert system.loop.state.monitor.summary == LoopSummary()
    system.loop.state.monitor.is_wanted = True
    system.tell("info", "close(6)")
    assert system.run() is None
    assert system.loop.state.monitor.summary.step > 0
    assert not system.loop.state.monitor.is_wanted


def test_a_static_mode_that_has_published_its_plan() -> None:
    files = Options(tuple(f"{EXAMPLES}/{name}.lp" for name in ("instance", "itoh")))
    system = System(make_parts(STATIC, files, ("-c", "steps=20")).loop)
    assert system.run() is None
    system.loop.state.monitor.is_wanted = True
    assert system.run() is None
    health = of_loop(system, 1e6)
    assert (health.level, health.message) == (OK, "has published its plan, and the mode is through")


def test_no_plan_ends_the_loop() -> None:
    system = System(make_parts(RECORDING, Options((f"{EXAMPLES}/line.lp",)), STEPS[:0]).loop)
    system.request("visit(3)")
    system.tell("info", "close(2)")
    assert system.run() is not None
    health = of_loop(system)
    assert health.level is ERROR
    assert health.message.startswith("has ended: the planner has no plan within the horizon")
    assert values(health)["step"] == str(system.loop.state.step)


@pytest.mark.parametrize("mode", [RECORDING, SINGLE])
def test_a_search_is_seen_while_it_goes_on(mode: str, tmp_path: Path) -> None:
    """With its time, and with what has come meanwhile; afterwards it is the last one."""
    encoding = tmp_path / "hard.lp"
    encoding.write_text(HARD)
    parts = make_parts(mode, Options((str(encoding),)), ("-c", "steps=9"))
    made = Threaded(parts.decider(), parts.planner, parts.commands).start()
    made.goal("hard")
    monitor = made.loop.state.monitor

    def health() -> Health:
        monitor.is_wanted = True
        return loop_health(monitor, time.monotonic(), queue=0, slow_seconds=0.2)

    wait_for(lambda: health().message.startswith("searches for a plan, for "), health)
    wait_for(lambda: health().level is WARN, health)
    # Right after the limit, three digits show the limit itself.
    wait_for(lambda: float(values(health())["search under way (s)"]) > 0.2, health)
    wait_for(lambda: values(health())["goals with a slot"] == "1", health)
    assert float(values(health())["age of what is known (s)"]) < 60.0
    made.goal("easy").wait()
    wait_for(lambda: monitor.activity.doing is Doing.WAITS)
    assert health().level is OK
    assert monitor.searched is not None
    made.inbox.close()


# Actuators.


def of_robot(one: Execution, now: float = 101.0, **more: Any) -> Health:
    """Returns what is said of the robot; the world is ten times as fast."""
    answers, heartbeat = more.pop("answers", ()), more.pop("heartbeat", None)
    began = more.pop("began", -math.inf)
    summary = LoopSummary(executions=(one,), **more)
    clocks = HealthClocks(now, 1000.0 + 10 * (now - 100.0), began)
    return actuator_health(one.actuator, summary, clocks, answers, heartbeat)


def test_an_action_that_goes_on() -> None:
    health = of_robot(GO)
    assert (health.name, health.level, health.message) == ("actuator robot", OK, "go(3), for 1.0 s")
    assert values(health) == {
        "state": "acts", "on hold": "no", "action": "go(3)", "step": "3", "token": "7",
        "acts (s)": "1.000", "expected (s)": "unknown", "attempt": "1",
        "since the last heartbeat (s)": "unknown", "done (%)": "unknown",
        "busy over steps": "no", "answer": "none",
    }  # fmt: skip


def test_a_silent_actuator() -> None:
    """As of when the log warns of it."""
    assert of_robot(GO, 100.0 + REMINDER_SECONDS - 0.1).level is OK
    silent = of_robot(GO, 100.0 + REMINDER_SECONDS)
    assert silent.level is WARN
    assert silent.message == "has not answered go(3) for 30 s; does an interface of it run?"


def test_an_action_that_takes_longer_than_expected() -> None:
    """In the time of the world, and not because it is silent."""
    one = replace(GO, kind="go", seconds=600)
    last = 100.0 + (600 + LATE_SECONDS) / 10
    assert of_robot(one, last).level is OK
    late = of_robot(one, last + 0.1)
    assert late.level is WARN
    assert late.message.startswith("go(3) takes 606 s, and 600 s were expected")
    assert values(late)["expected (s)"] == "600"
    soon = replace(GO, kind="go", seconds=1)
    assert of_robot(soon, 101.0).level is WARN


def test_an_action_whose_answer_an_earlier_process_has_missed() -> None:
    """It is late only when its interface has had the time to repeat the answer."""
    one = replace(GO, kind="go", seconds=1)
    assert of_robot(one, 109.0, began=100.0).level is OK
    assert of_robot(one, 110.0, began=100.0).level is WARN
    assert of_robot(one, 109.0, began=90.0).level is WARN, "it has begun later"


def test_no_action_is_late_by_what_was_known_long_ago() -> None:
    """The loop waits for a solver that was lost, and may have taken the answer meanwhile."""
    one = replace(GO, kind="go", seconds=1)
    assert of_robot(one, 120.0, time=119.0).level is WARN
    assert of_robot(one, 120.0, time=110.0).level is OK


def test_an_answer_that_the_loop_has_not_taken() -> None:
    run = "r"
    items: Tuple[Any, ...] = (
        MessageArrived("robot", "success"), ControlArrived(Control.PAUSE), AnswerArrived(run, 9, "")
    )  # fmt: skip
    assert untaken_answers(items, run) == {"robot", 9}
    assert untaken_answers(items, "of a run before") == {"robot"}
    for answers in ({"robot"}, {7}):
        health = of_robot(GO, 1e6, answers=answers)
        assert health.level is OK
        assert "the loop has not taken that yet" in health.message
    assert of_robot(GO, 1e6, answers={"another", 8}).level is WARN


def test_an_action_that_has_timed_out() -> None:
    """Until the next one, whether or not that is an answer already."""
    for one in (
        replace(GO, is_enqueued=True),
        replace(GO, is_enqueued=True, answer="timeout", outcome="failure"),
    ):
        health = of_robot(one, 200.0)
        assert health.level is ERROR
        assert health.message == "has not answered in time: go(3) has timed out"
        assert values(health)["state"] == "timed out"


def test_an_actuator_that_times_out_again_and_again() -> None:
    health = of_robot(GO, timed_out=frozenset({"robot"}))
    assert health.level is ERROR
    assert health.message == (
        "has not answered in time and has said nothing since; go(3), for 1.0 s"
    )
    assert of_robot(GO, timed_out=frozenset({"arm"})).level is OK


def test_policies() -> None:
    """A heartbeat says that the interface runs; a retry is no error, and a lost interface is."""
    silent = 100.0 + REMINDER_SECONDS + 1.0
    alive = of_robot(GO, silent, heartbeat=Heartbeat(silent - 2.0, 0.4))
    assert alive.level is OK
    assert values(alive)["since the last heartbeat (s)"] == "2.000"
    assert values(alive)["done (%)"] == "40"
    assert of_robot(GO, 2 * silent, heartbeat=Heartbeat(silent)).level is WARN
    one = replace(GO, is_held=True, pauses=True, attempt=2)
    held = (HeldAction("robot", "go(3)", HoldReason.RETRY),)
    for paused in (one, replace(one, is_enqueued=True)):
        health = of_robot(paused, held=held)
        assert (health.level, values(health)["attempt"]) == (WARN, "2")
        assert health.message == "go(3) has failed, and is tried again (2)"
    assert said(monitor_of(Doing.WAITS, held=held), 1.0)[0] is OK
    lost = of_robot(replace(GO, is_enqueued=True, answer="lost"))
    assert (lost.level, values(lost)["state"]) == (ERROR, "lost")


class Silent(Operated):
    """A robot that answers nothing for a while."""

    answers = False

    def turn(self) -> bool:
        return super().turn() if self.answers else bool(self._items)


@pytest.mark.parametrize("mode", [RECORDING, SINGLE])
def test_who_has_timed_out_until_it_answers(mode: str) -> None:
    system = Silent(mode, action_timeout=60.0)
    goal = system.request("visit(3)")
    assert system.run() is None
    assert not system.loop.state.summarize().timed_out
    for seconds in (60.0, 1.0):  # after a minute in which nobody looked, answers come first
        system.clock += seconds
        assert system.run() is None
    assert goes(system) == ["go(2)", "go(2)"]
    summary = system.loop.state.summarize()
    assert summary.timed_out == {"robot"}
    assert not any(one.is_enqueued for one in summary.executions)
    system.answers = True
    assert system.run() is None
    assert goal.words[-1] == "succeeded"
    assert not system.loop.state.summarize().timed_out


def test_other_states() -> None:
    done = of_robot(replace(GO, answer="failure"), 1e6)
    assert (done.level, done.message) == (OK, "has answered failure to go(3)")
    stops = of_robot(replace(GO, aborted=True))
    assert (stops.level, stops.message) == (OK, "go(3) is to stop, for 1.0 s")
    left = of_robot(replace(GO, acts=False), 1e6)
    assert (left.level, values(left)["state"]) == (OK, "idle")


def test_what_waits_for_an_operator() -> None:
    one = replace(GO, is_held=True)
    held = (HeldAction("robot", "go(3)", HoldReason.HOLD),)
    health = of_robot(one, 1e6, held=held, on_hold=("robot",))
    assert health.level is WARN
    assert health.message == "on hold by an operator; go(3) waits for an operator (hold)"
    assert values(health)["acts (s)"] == "0.000"


def test_who_is_on_hold_and_has_never_acted() -> None:
    summary = LoopSummary(on_hold=("arm",), executions=(GO,))
    assert actuators_of(summary) == ["arm", "robot"]
    arm = actuator_health("arm", summary, HealthClocks(0.0, 0.0))
    assert (arm.level, arm.message) == (WARN, "on hold by an operator; has no action")
    nobody = actuator_health("nobody", summary, HealthClocks(0.0, 0.0))
    assert (nobody.level, nobody.message) == (OK, "has no action")


# The store.


def test_a_store(tmp_path: Path) -> None:
    store = Store(tmp_path / "a.store")
    before = store.summary(is_unsure=True)
    assert before.committed is None
    assert before.bytes is not None
    store.begin({"planner": "line.lp"})
    now = time.monotonic()
    begun = store.summary(is_unsure=True)
    assert begun.committed is not None
    assert 0.0 <= now - begun.committed < 60.0
    store.write(Changes(actions=[("robot", "go(2)")]))
    written = store.summary(is_unsure=True)
    assert written.bytes is not None
    assert written.bytes > before.bytes
    store.close()
    shutil.rmtree(store.path)
    assert store.summary(is_unsure=True).bytes is not None


def stored(**changes: Any) -> StoreSummary:
    summary = StoreSummary(Path("/run/a.store"), 2_500_000, 100.0, "", False)
    return replace(summary, **changes)


def test_levels_of_a_store() -> None:
    health = store_health(stored(), "", 103.0)
    assert (health.name, health.level) == ("store", OK)
    assert values(health) == {
        "path": "/run/a.store", "size (MB)": "2.500", "since the last commit (s)": "3.000",
    }  # fmt: skip
    full = store_health(stored(failure="the store a.store cannot be written"), "", 103.0)
    assert (full.level, full.message) == (ERROR, "the store a.store cannot be written")
    unsure = stored(is_unsure=True, committed=None, bytes=None)
    assert store_health(unsure, "", 103.0).level is OK
    refused = store_health(unsure, "the store is of a run with something else", 103.0)
    assert refused.level is ERROR
    assert refused.message == "refused: the store is of a run with something else"
    assert values(refused)["size (MB)"] == "unknown"


# The aggregator's configuration, by the rules of its GenericAnalyzer.


def matches(rule: Dict[str, Any], name: str) -> bool:
    """Returns whether an analyzer takes a status with a name."""
    assert set(rule) <= {"type", "path", "timeout", "regex"}
    assert rule["type"] == "diagnostic_aggregator/GenericAnalyzer"
    return re.fullmatch(rule["regex"], name) is not None


@pytest.fixture
def analyzers() -> Callable[[str], List[str]]:
    group = yaml.safe_load(CONFIGURATION.read_text())["analyzers"]["rosoclingo"]
    assert group["type"] == "diagnostic_aggregator/AnalyzerGroup"
    rules = group["analyzers"].values()
    return lambda name: [rule["path"] for rule in rules if matches(rule, name)]


@pytest.mark.parametrize("node", ["rosoclingo", "robot1/rosoclingo", "controller", "loop", "store"])
def test_each_status_is_of_one_analyzer(node: str, analyzers: Callable[[str], List[str]]) -> None:
    robots = ("robot", "robot(2)", '"a: loop"', '": store"', "x: solver")
    health = [
        loop_health(LoopMonitor(), 0.0, queue=0, slow_seconds=SLOW),
        store_health(stored(), "", 0.0),
        *(actuator_health(one, LoopSummary(), HealthClocks(0.0, 0.0)) for one in robots),
    ]
    found = [analyzers(f"{node}: {one.name}") for one in health]
    assert found == [["Loops"], ["Stores"], *([["Actuators"]] * len(robots))]
    assert analyzers(f"{node}: solver") == ["Solvers"]
    assert analyzers(f"{node}: freq") == []
