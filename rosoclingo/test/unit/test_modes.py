"""The six modes on real solvers: what a user of a mode may rely on."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, List

import pytest
from conftest import walk

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Ground, Part
from rosoclingo.errors import LoopError

PACKAGE = Path(__file__).resolve().parents[2]
BLOCKS = [str(PACKAGE / "example" / name) for name in ("instance.lp", "itoh.lp")]
STATIC = ["static.fixed.recording", "static.incremental.recording"]
# The steps suffice for what the tests ask for, and a proof that there is no plan is quick.
RECORDING = ["dynamic.fixed.recording", "dynamic.incremental.recording"]
RESET = ["dynamic.incremental.reset", "dynamic.incremental.dyn_reset"]
INCREMENTAL = ["dynamic.incremental.recording", *RESET]
Make = Callable[..., Any]


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
    goal = running.goal("visit(3)")
    assert goal.wait() == "rejected"
    assert "static" in goal.reason
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
    goal = running.goal("visit(3)")
    running.start()
    assert goal.wait() == "succeeded"


def test_the_fixed_mode_ends_when_a_goal_comes_too_late(system: Make) -> None:
    running = system("dynamic.fixed.recording", "-c", "steps=3")
    first = running.goal("visit(2)")
    running.start()
    assert first.wait() == "succeeded"
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
        assert goal.wait() == "aborted"
        assert "horizon of 3 steps" in goal.reason
    running.wait()


@pytest.mark.parametrize("mode", RECORDING + RESET)
def test_failing_actions_are_tried_again(system: Make, mode: str) -> None:
    running = system(mode, "-c", "steps=12")
    answers = iter(["failure", "success", "failure", "failure"])
    running.world.answer = lambda actuator, action: next(answers, "success")
    goal = running.goal("visit(3)")
    running.start()
    assert goal.wait() == "succeeded"
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
    running.world.answer = lambda actuator, action: None
    goals = [running.goal(f"visit({target})") for target in (3, 4, 5)]
    running.start()
    running.world.wait_for(lambda world: bool(world.published))
    running.cancel(goals[2])
    assert goals[2].wait() == "canceled"
    assert goals[2].words == ["canceled"]
    running.world.answer = lambda actuator, action: "success"
    running.send("robot", "success")
    assert [goal.wait() for goal in goals[:2]] == ["succeeded", "succeeded"]


@pytest.mark.parametrize("mode", INCREMENTAL)
def test_cancel_while_running_and_after_success(system: Make, mode: str) -> None:
    running = system(mode, "-c", "steps=20")
    running.world.answer = lambda actuator, action: None
    goal = running.goal("visit(6)")
    running.start()
    running.world.wait_for(lambda world: len(world.published) == 1)
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
    goal = running.goal("visit(4)")
    running.start()
    running.send("info", "open(3)")
    assert goal.wait() == "succeeded"
    assert running.world.actions[-2:] == ["go(3)", "go(4)"]


def test_reset_every_r_steps(system: Make) -> None:
    """Over 100 steps nothing is grounded beyond what one goal and r steps need."""
    running = system("dynamic.incremental.reset", "-c", "steps=12", "-c", "r=4").start()
    targets = [6, 1] * 11
    for target in targets:
        assert running.goal(f"visit({target})").wait() == "succeeded"
    assert running.world.actions == walk([1, *targets])
    assert len(running.world.actions) > 100
    assert max(running.loop.state.externals.grounded) <= 12


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
    goal = running.goal("visit(3)")
    assert goal.wait() == "aborted"
    assert "horizon" in goal.reason


@pytest.mark.parametrize("mode", sorted(path.stem for path in (PACKAGE / "modes").glob("*.lp")))
@pytest.mark.parametrize("steps", [1, 20])
def test_a_mode_grounds_without_a_warning(mode: str, steps: int) -> None:

    messages: List[str] = []
    file = str(PACKAGE / "modes" / f"{mode}.lp")
    engine = Engine(Options((file,), ("-c", f"steps={steps}")), log=messages.append)
    engine.apply(Ground((Part("base"),)))
    assert messages == []
