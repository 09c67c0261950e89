"""The six modes on real solvers: what a user of a mode may rely on."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, List, Optional

import pytest
from conftest import walk

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Externals, GetExternals, GetStats, Ground, Part, Stats
from rosoclingo.errors import LoopError
from rosoclingo.in_process.parts import make_parts
from rosoclingo.in_process.system import System
from rosoclingo.loop import journal

PACKAGE = Path(__file__).resolve().parents[2]
BLOCKS = [str(PACKAGE / "example" / name) for name in ("instance.lp", "itoh.lp")]
STATIC = ["static.fixed.recording", "static.incremental.recording"]
# The steps suffice for what the tests ask for, and a proof that there is no plan is quick.
RECORDING = ["dynamic.fixed.recording", "dynamic.incremental.recording"]
RESET = ["dynamic.incremental.reset", "dynamic.incremental.dyn_reset"]
INCREMENTAL = ["dynamic.incremental.recording", *RESET]
DYN_RESET = "dynamic.incremental.dyn_reset"
MODES = sorted(path.stem for path in (PACKAGE / "modes").glob("*.lp"))
LINE = str(PACKAGE / "example" / "line.lp")
Make = Callable[..., Any]

# A goal waits until the gate is open, however long that takes; then it needs three steps.
GATE = """
rslot(1).
fluent(wants;open;weather(0;1);at(0..3)).
#external event(save,F,0) : fluent(F).
before(F,0) :- event(save,F,0).
before(at(0),0) :- not event(save,at(_),0).
#program state(t).
#external event(1,(pass;cancel),t).
#external event(info,(open;passed;weather(0;1)),t).
#external event(robot,success,t).
wants(t) :- event(1,pass,t).
wants(t) :- before(wants,t).
status(1,accepted,t) :- event(1,pass,t).
status(1,succeeded,t) :- wants(t), holds(at(3),t).
holds(wants,t) :- wants(t), not holds(at(3),t).
holds(open,t) :- event(info,open,t).
holds(open,t) :- before(open,t).
holds(weather(X),t) :- event(info,weather(X),t).
holds(at(X),0) :- before(at(X),0), t = 0.
#program transition(t).
before(F,t) :- holds(F,t-1).
{ do(robot,go(X+1),t) } :- before(at(X),t), before(open,t), before(wants,t).
holds(at(X),t) :- do(robot,go(X),t).
holds(at(X),t) :- before(at(X),t), not do(robot,_,t).
#external event(commit,do(robot,go(1..3)),t).
:- event(commit,do(robot,A),t), not do(robot,A,t).
:- do(robot,A,t), event(info,passed,t), not event(commit,do(robot,A),t).
#program query(t).
#external query(t).
:- query(t), holds(wants,t), holds(open,t).
#show do/3. #show status/3. #show holds/2.
"""


class Robot(System):
    """A robot that succeeds, and may do something else when it acts.

    Attributes:
        on_action: Called when it acts, before it answers.
    """

    on_action: Optional[Callable[[], None]] = None

    def turn(self) -> bool:
        if self.acting and self.on_action is not None:
            self.on_action()
        return super().turn()


def robot(mode: str, *options: str, steps: int, encoding: str = LINE) -> Robot:
    """Returns a system in one thread."""
    parts = make_parts(mode, Options((encoding,)), ("-c", f"steps={steps}", *options))
    return Robot(parts.loop)


@pytest.mark.parametrize(("mode", "steps"), list(zip(STATIC, (14, 20))))
def test_a_static_mode_publishes_the_plan(system: Make, mode: str, steps: int) -> None:
    running = system(mode, "-c", f"steps={steps}", encoding=BLOCKS).start()
    running.world.wait_for(lambda world: bool(world.published))
    ((actuator, plan),) = running.world.published
    assert actuator == "solver"
    atoms = plan.strip("[]").split(", ")
    assert len(atoms) == 14
    assert atoms[0] == "do(arm,pickup(4),1)"
    assert atoms[-1] == "do(arm,putdown(3),14)"
    # It stays up, takes no goals, and ignores messages.
    running.send("arm", "success")
    running.goal("visit(3)").ends("rejected", "static")
    assert len(running.world.published) == 1


@pytest.mark.parametrize("mode", STATIC)
def test_a_static_mode_ends_at_the_horizon(system: Make, mode: str) -> None:
    running = system(mode, "-c", "steps=10", encoding=BLOCKS).start()
    assert "horizon of 10 steps" in str(running.wait())
    assert running.world.published == []


def test_a_horizon_of_no_steps(system: Make, tmp_path: Path) -> None:
    file = tmp_path / "nothing.lp"
    file.write_text("ok. #program query(t). #external query(t). :- query(t), not ok.")
    for mode in STATIC:
        running = system(mode, "-c", "steps=0", encoding=[str(file)]).start()
        running.world.wait_for(lambda world: bool(world.published))
        assert running.world.published == [("solver", "[]")]


@pytest.mark.parametrize("mode", INCREMENTAL)
def test_goals_in_sequence(system: Make, mode: str) -> None:
    running = system(mode, "-c", "steps=60").start()
    for target in (4, 2, 6, 6, 1):
        goal = running.goal(f"visit({target})")
        assert goal.wait() == "succeeded"
        assert goal.words == ["accepted", "succeeded"]
    assert running.world.actions == walk([1, 4, 2, 6, 1])


@pytest.mark.parametrize("mode", INCREMENTAL)
def test_more_goals_than_slots(system: Make, mode: str) -> None:
    running = system(mode, "-c", "steps=60")
    goals = [running.goal(f"visit({target})") for target in (3, 5, 2, 6, 4)]
    running.start()
    assert [goal.wait() for goal in goals] == ["succeeded"] * 5
    assert "queued 1" in goals[2].lines
    places = [line for line in goals[4].lines if line.startswith("queued")]
    assert places[-3:] == ["queued 3", "queued 2", "queued 1"]
    assert all("accepted" in goal.lines for goal in goals)
    assert any(line.startswith("step 1 of ") for line in goals[0].lines)


def test_the_fixed_mode_executes_goals_that_come_in_time(system: Make) -> None:
    running = system("dynamic.fixed.recording", "-c", "steps=6")
    assert running.begin("visit(3)").wait() == "succeeded"


def test_the_fixed_mode_ends_when_a_goal_comes_too_late(system: Make) -> None:
    running = system("dynamic.fixed.recording", "-c", "steps=3")
    assert running.begin("visit(2)").wait() == "succeeded"
    running.world.wait_for(lambda world: world.step == 3)
    late = running.goal("visit(6)")
    assert late.wait() == "aborted"
    assert late.reason.startswith("the mode ended after its last step, 3; it is too late for visit")
    assert isinstance(running.wait(), LoopError)


@pytest.mark.parametrize("mode", ["dynamic.incremental.recording"])
def test_the_horizon_is_reached(system: Make, mode: str) -> None:
    running = system(mode, "-c", "steps=3").start()
    goals = [running.goal("visit(6)"), running.goal("visit(2)"), running.goal("visit(3)")]
    for goal in goals:
        goal.ends("aborted", "horizon of 3 steps")
    running.wait()


@pytest.mark.parametrize("mode", RECORDING + RESET)
def test_failing_actions_are_tried_again(system: Make, mode: str) -> None:
    running = system(mode, "-c", "steps=12")
    answers = iter(["failure", "success", "failure", "failure"])
    running.world.answer = lambda actuator, action: next(answers, "success")
    assert running.begin("visit(3)").wait() == "succeeded"
    # In a fixed mode the plan may take detours; a failed action has no effect in any.
    assert running.world.actions.count("go(2)") + running.world.actions.count("go(3)") >= 5


@pytest.mark.parametrize("mode", INCREMENTAL)
def test_cancel_before_the_planner_knows(system: Make, mode: str) -> None:
    running = system(mode, "-c", "steps=20")
    goal = running.goal("visit(5)")
    running.cancel(goal)
    running.start()
    assert goal.wait() == "canceled"
    assert goal.words == ["canceled"]
    assert running.goal("visit(1)").wait() == "succeeded"
    assert running.world.actions == []


@pytest.mark.parametrize("mode", INCREMENTAL)
def test_cancel_while_queued(system: Make, mode: str) -> None:
    running = system(mode, "-c", "steps=20")
    goals = running.act(*(f"visit({target})" for target in (3, 4, 5)))
    running.cancel(goals[2])
    assert goals[2].wait() == "canceled"
    assert goals[2].words == ["canceled"]
    running.world.answer = lambda actuator, action: "success"
    running.send("robot", "success")
    assert [goal.wait() for goal in goals[:2]] == ["succeeded", "succeeded"]


@pytest.mark.parametrize("mode", INCREMENTAL)
def test_cancel_while_running_and_after_success(system: Make, mode: str) -> None:
    running = system(mode, "-c", "steps=20")
    (goal,) = running.act("visit(6)")
    running.send("robot", "success")
    running.world.wait_for(lambda world: len(world.published) == 2)
    running.cancel(goal)
    running.send("robot", "success")
    assert goal.wait() == "canceled"
    assert goal.words == ["accepted", "canceled"]
    running.cancel(goal)  # too late: nothing happens
    running.world.answer = lambda actuator, action: "success"
    assert running.goal("visit(3)").wait() == "succeeded"
    assert running.world.actions == ["go(2)", "go(3)"]


@pytest.mark.parametrize("mode", INCREMENTAL)
def test_what_is_learned_on_the_way_changes_the_plan(system: Make, mode: str) -> None:
    """While cell 3 is closed there is no plan at all; a message opens it again."""
    running = system(mode, "-c", "steps=400")
    running.send("info", "close(3)")
    goal = running.begin("visit(4)")
    running.send("info", "open(3)")
    assert goal.wait() == "succeeded"
    assert running.world.actions[-2:] == ["go(3)", "go(4)"]


@pytest.mark.costly
def test_reset_every_r_steps(system: Make) -> None:
    """Over 100 steps nothing is grounded beyond what one goal and r steps need."""
    running = system("dynamic.incremental.reset", "-c", "steps=12", "-c", "r=4").start()
    targets = [6, 1] * 11
    for target in targets:
        assert running.goal(f"visit({target})").wait() == "succeeded"
    assert running.world.actions == walk([1, *targets])
    assert len(running.world.actions) > 100
    assert max(running.loop.state.externals.grounded) <= 12


@pytest.mark.costly
def test_reset_after_each_goal(system: Make) -> None:
    running = system("dynamic.incremental.dyn_reset", "-c", "steps=6").start()
    targets = [3, 6, 2, 5, 1] * 10
    for target in targets:
        assert running.goal(f"visit({target})").wait() == "succeeded"
    assert running.world.actions == walk([1, *targets])
    assert max(running.loop.state.externals.grounded) <= 6


def test_a_reset_keeps_what_was_learned(system: Make) -> None:
    running = system("dynamic.incremental.dyn_reset", "-c", "steps=8").start()
    running.send("info", "close(3)")
    assert running.goal("visit(2)").wait() == "succeeded"
    assert running.goal("visit(1)").wait() == "succeeded"
    running.goal("visit(3)").ends("aborted", "horizon")


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("steps", [1, 20])
def test_a_mode_grounds_without_a_warning(mode: str, steps: int) -> None:

    messages: List[str] = []
    file = str(PACKAGE / "modes" / f"{mode}.lp")
    engine = Engine(Options((file,), ("-c", f"steps={steps}")), log=messages.append)
    engine.apply(Ground((Part("base"),)))
    assert messages == []


@pytest.mark.parametrize("mode", MODES)
def test_what_a_decision_costs_does_not_depend_on_steps(mode: str) -> None:
    """A mode has as many externals, rules and atoms for a million steps as for fifty."""
    sizes = []
    for steps in (50, 1_000_000):
        file = str(PACKAGE / "modes" / f"{mode}.lp")
        engine = Engine(Options((file,), ("-c", f"steps={steps}", "-c", "r=20")))
        engine.apply(Ground((Part("base"),)))
        engine.solve()
        externals, stats = engine.apply(GetExternals()), engine.apply(GetStats())
        assert isinstance(externals, Externals)
        assert isinstance(stats, Stats)
        program = stats.values["problem"]["lp"]
        sizes.append((len(externals.values), program["atoms"], program["rules"]))
    assert sizes[0] == sizes[1]
    assert sizes[0][0] < 20


def test_a_mode_may_plan_for_a_million_steps() -> None:
    """Nothing is grounded but what the plans need, in each of the incremental modes."""
    for mode in INCREMENTAL:
        running = robot(mode, steps=1_000_000)
        goals = [running.request("visit(6)"), running.request("visit(1)")]
        assert running.run() is None
        assert [goal.words[-1] for goal in goals] == ["succeeded"] * 2
        assert len(running.loop.state.externals.grounded) < 20


@pytest.mark.parametrize("mode", [STATIC[0], *RECORDING, *RESET])
def test_a_negative_number_of_steps_is_named(mode: str) -> None:
    running = robot(mode, steps=-1)
    running.request("visit(6)")
    assert "-1 " in str(running.run())


# An idle robot. The plan to cell 6 has four actions, and its goal belongs to the step before them.


@pytest.mark.parametrize("messages", [0, 1, 4, 5, 60])
def test_an_idle_robot_never_runs_out_of_steps(messages: int) -> None:
    running = robot(DYN_RESET, steps=5)
    first = running.request("visit(2)")
    assert running.run() is None
    for number in range(messages):
        running.tell("info", ("close(1)", "open(1)")[number % 2])
        assert running.run() is None
    assert running.published == [("robot", "go(2)")]
    last = running.request("visit(6)")
    assert running.run() is None
    assert [goal.words for goal in (first, last)] == [["accepted", "succeeded"]] * 2
    assert max(running.loop.state.externals.grounded) <= 5


@pytest.mark.parametrize("messages", [1, 4, 60])
def test_messages_before_the_first_goal_take_no_steps(messages: int) -> None:
    running = robot(DYN_RESET, steps=6)
    for number in range(messages):
        running.tell("info", f"close({number % 2 + 1})")
        running.tell("info", f"open({number % 2 + 1})")
        assert running.run() is None
    goal = running.request("visit(6)")
    assert running.run() is None
    assert goal.words == ["accepted", "succeeded"]


def test_a_reset_keeps_what_an_idle_robot_was_told() -> None:
    running = robot(DYN_RESET, steps=8)
    for cell in (6, 5, 3):
        running.tell("info", f"close({cell})")
        assert running.run() is None
    assert "event(save,closed(6),0)" in running.loop.state.externals.saved
    for cell in (3, 5):
        running.tell("info", f"open({cell})")
        assert running.run() is None
    reached = running.request("visit(5)")
    assert running.run() is None
    assert reached.words == ["accepted", "succeeded"]
    closed = running.request("visit(6)")
    assert isinstance(running.run(), LoopError)
    assert "within the horizon of 8 steps" in closed.reason


def test_canceled_goals_leave_no_steps_behind() -> None:
    """The next goal does not wait for actions that the plan had left for the last one."""
    running = robot(DYN_RESET, steps=7)
    for _ in range(4):
        goal = running.request("visit(6)")
        running.on_action = lambda goal=goal: running.cancel(goal)
        assert running.run() is None
        assert goal.words == ["accepted", "canceled"]
        assert running.loop.state.horizon == 0
        running.on_action = None
        last = running.request("visit(1)")
        assert running.run() is None
        assert last.words == ["accepted", "succeeded"]


def test_a_goal_that_waits_takes_no_steps(tmp_path: Path) -> None:
    file = tmp_path / "gate.lp"
    file.write_text(GATE)
    running = robot(DYN_RESET, steps=4, encoding=str(file))
    waits = running.request("pass")
    for number in range(30):
        running.tell("info", f"weather({number % 2})")
        assert running.run() is None
    assert waits.words == ["accepted"]
    running.tell("info", "open")
    assert running.run() is None
    assert waits.words == ["accepted", "succeeded"]
    assert [action for _, action in running.published] == ["go(1)", "go(2)", "go(3)"]


def test_in_the_mode_reset_an_idle_robot_waits_in_no_last_step() -> None:
    steps = set()
    running = robot("dynamic.incremental.reset", "-c", "r=9", steps=6)
    for number in range(30):
        running.tell("info", ("close(1)", "open(1)")[number % 2])
        assert running.run() is None
        steps.add(running.loop.state.step)
    assert steps == set(range(7))
    assert running.loop.state.step < 6


def test_resets_come_every_r_steps_and_no_sooner() -> None:
    running = robot("dynamic.incremental.reset", "-c", "r=4", steps=12)
    for target in (6, 1, 6, 1):
        running.request(f"visit({target})")
        assert running.run() is None
    commands = [e.event for e in running.journal if isinstance(e.event, journal.CommandDone)]
    resets = [command.resets_to for command in commands if command.resets_to is not None]
    assert resets == [4] * len(resets)
    assert len(resets) >= 5
