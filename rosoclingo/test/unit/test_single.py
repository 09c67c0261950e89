"""The one-node system on a real solver, with encodings of the three dialects."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import asdict
from pathlib import Path
from random import Random
from typing import List, Optional

import pytest
from conftest import PACKAGE, Make, walk

from rosclingo.errors import OptionsError, ProgramError
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Result
from rosoclingo.errors import LoopError
from rosoclingo.loop.mode.controller import Info
from rosoclingo.loop.single.algorithm1 import Algorithm1, Position, Stage, last_step
from rosoclingo.loop.single.dialects import detect

LINE = {
    "paper": str(PACKAGE / "example/line_paper.lp"),
    "1.0": str(PACKAGE / "example/line_1.0.lp"),
    "2.0": str(PACKAGE / "example/line.lp"),
}
FIRST_STEP = {"paper": 1, "1.0": 1, "2.0": 0}
EVERY = pytest.mark.parametrize("dialect", sorted(LINE))


@EVERY
def test_the_dialect_is_told_by_the_encoding(dialect: str) -> None:
    assert detect(Options((LINE[dialect],))).name == dialect


def test_an_encoding_of_half_a_dialect(tmp_path: Path) -> None:
    file = tmp_path / "half.lp"
    file.write_text("#program query(t). #external query(t). #program set_event(id,e,t). e(id,e,t).")
    with pytest.raises(OptionsError, match="this one lacks commit/3 and finalize/1"):
        detect(Options((str(file),)))
    file.write_text("#program query(t). #external query(t).")
    assert detect(Options((str(file),))).name == "2.0"


def test_an_encoding_of_no_dialect(tmp_path: Path) -> None:
    file = tmp_path / "none.lp"
    file.write_text("#program transition(t). #external now(t).")
    with pytest.raises(OptionsError, match=r"none.lp: .*#external horizon\(t\)"):
        detect(Options((str(file),)))
    with pytest.raises(OptionsError, match="no file"):
        detect(Options())
    file.write_text("a :- b")
    with pytest.raises(ProgramError, match=r"none\.lp:2:1"):
        detect(Options((str(file),)))


def test_the_last_step() -> None:
    assert last_step(("-c", "slots=3")) is None
    assert last_step(("-c", "steps=7", "-c", "slots=3")) == 7
    for text in ("steps=x", "steps=0", "steps=-1", "steps=", "steps=²", f"steps={'9' * 5000}"):
        with pytest.raises(OptionsError, match="steps is a number"):
            last_step(("-c", text))


@pytest.mark.parametrize(("first", "last"), [(0, None), (1, 4), (0, 1)])
def test_its_position_can_be_saved_at_any_time(first: int, last: Optional[int]) -> None:
    chance = Random(1)
    for _ in range(50):
        steady = Algorithm1(first, last)
        position = steady.position
        for _ in range(40):
            info = Info(
                chance.choice([None, *Result]),
                pending_actions=chance.random() < 0.4,
                new_messages=chance.random() < 0.3,
                horizon=chance.choice([None, None, 3]),
            )
            restored = Algorithm1(first, last)
            restored.position = position
            assert restored.decide(info) == steady.decide(info)
            saved = json.loads(json.dumps(asdict(restored.position), default=lambda s: s.value))
            position = Position(**{**saved, "stage": Stage(saved["stage"])})
            assert position == steady.position


@EVERY
def test_goals_in_sequence(single: Make, dialect: str) -> None:
    running = single(LINE[dialect]).start()
    for target in (4, 2, 6, 6, 1):
        goal = running.goal(f"visit({target})")
        assert goal.wait() == "succeeded"
        assert goal.words == ["accepted", "succeeded"]
    assert running.world.actions == walk([1, 4, 2, 6, 1])


@EVERY
def test_the_first_goal_belongs_to_the_first_step(single: Make, dialect: str) -> None:
    running = single(LINE[dialect]).start()
    assert running.goal("visit(2)").wait() == "succeeded"
    assert running.loop.state.step == 1
    accepted = running.loop.state.plan.statuses(FIRST_STEP[dialect])
    assert ("1", "accepted") in accepted or dialect == "paper"


@EVERY
@pytest.mark.parametrize("early", [False, True])
def test_a_first_goal_that_needs_no_action(single: Make, dialect: str, early: bool) -> None:
    running = single(LINE[dialect])
    early_goals = [running.goal("visit(1)") for _ in range(3 if early else 0)]
    running.start()
    goals = early_goals or [running.goal("visit(1)") for _ in range(3)]
    assert [goal.wait() for goal in goals] == ["succeeded"] * 3
    assert running.world.actions == []


@EVERY
def test_a_goal_that_comes_during_an_action_belongs_to_its_step(single: Make, dialect: str) -> None:
    running = single(LINE[dialect])
    running.world.answer = lambda actuator, action: None
    first = running.begin("visit(3)")
    running.world.wait_for(lambda world: world.actions == ["go(2)"])
    second = running.goal("visit(2)")
    running.send("robot", "success")
    running.world.wait_for(lambda world: world.actions == ["go(2)", "go(3)"])
    running.send("robot", "success")
    assert first.wait() == "succeeded"
    assert second.wait() == "succeeded"
    assert running.loop.state.step == 2


@pytest.mark.costly
@EVERY
def test_a_hundred_goals(single: Make, dialect: str) -> None:
    """No step is executed twice, and none is left out, whatever comes in between."""
    random = Random(1)
    running = single(LINE[dialect], "-c", "cells=3")
    position = [1]
    asked: List[int] = []

    def answer(actuator: str, action: str) -> str:
        asked.append(running.loop.state.step)
        target = int(action[len("go(") : -1])
        assert abs(target - position[-1]) == 1, (position, action)
        if random.random() < 0.2:
            return "failure"
        position.append(target)
        return "success"

    running.world.answer = answer
    running.start()
    goals = []
    canceled = []
    for number in range(100):
        goals.append(running.goal(f"visit({random.randint(1, 3)})"))
        if random.random() < 0.2:
            canceled.append(goals[-1])
            running.cancel(goals[-1])
        if number % 4 == 3:
            goals[-1].wait()
    for goal in goals:
        ends = {"succeeded", "canceled"} if goal in canceled else {"succeeded"}
        assert goal.wait() in ends
        assert Counter(goal.words).most_common(1)[0][1] == 1
    assert running.world.warnings == []
    # One action in a step, and in every step, but for those that a goal began without a move.
    assert asked == sorted(set(asked))
    plan = running.loop.state.plan.actions_from(0)
    assert [str(action.name) for action in plan] == running.world.actions
    assert [action.step for action in plan] == asked


@EVERY
def test_queue_cancel_and_recall(single: Make, dialect: str) -> None:
    running = single(LINE[dialect])
    goals = running.act(*(f"visit({target})" for target in (3, 4, 5)))
    assert "queued 1" in goals[2].lines
    running.cancel(goals[2])
    assert goals[2].wait() == "canceled"
    assert goals[2].words == ["canceled"]
    running.cancel(goals[1])
    running.world.answer = lambda actuator, action: "success"
    running.send("robot", "success")
    assert [goal.wait() for goal in goals[:2]] == ["succeeded", "canceled"]
    assert running.world.actions == walk([1, 3])


@EVERY
def test_failures_are_planned_around(single: Make, dialect: str) -> None:
    running = single(LINE[dialect])
    answers = iter(["failure", "failure", "success", "failure"])
    running.world.answer = lambda actuator, action: next(answers, "success")
    assert running.begin("visit(3)").wait() == "succeeded"
    assert running.world.actions == ["go(2)", "go(2)", "go(2)", "go(3)", "go(3)"]


@EVERY
def test_the_horizon_grows_until_a_message_makes_a_plan_possible(
    single: Make, dialect: str
) -> None:
    running = single(LINE[dialect])
    running.send("info", "close(3)")
    goal = running.begin("visit(4)")
    running.send("info", "open(3)")
    assert goal.wait() == "succeeded"
    assert running.world.actions[-2:] == ["go(3)", "go(4)"]


@EVERY
def test_a_last_step(single: Make, dialect: str) -> None:
    running = single(LINE[dialect], "-c", "steps=3").start()
    assert running.goal("visit(3)").wait() == "succeeded"
    goal = running.goal("visit(6)")
    goal.ends("aborted", "ended after its last step, 3; it is too late for visit(6)")
    assert isinstance(running.wait(), LoopError)


@EVERY
def test_what_the_encoding_does_not_know(single: Make, dialect: str) -> None:
    running = single(LINE[dialect]).start()
    assert running.goal("visit(2)").wait() == "succeeded"
    running.goal("visit(9)").ends("rejected", "9 is unknown as the first argument of visit")
    running.send("robot", "dance")
    running.send("commit", "do(robot,go(3))")
    running.world.wait_for(lambda world: len(world.warnings) == 2)
    assert "robot" in running.world.warnings[0]


@EVERY
def test_cancel_is_no_request(single: Make, dialect: str) -> None:
    running = single(LINE[dialect]).start()
    running.goal("cancel").ends("rejected", "cancel is no request")
    assert running.goal("visit(2)").wait() == "succeeded"


@EVERY
def test_the_loop_ends_when_it_is_told_to(single: Make, dialect: str) -> None:
    running = single(LINE[dialect])
    running.send("info", "close(3)")
    goal = running.begin("visit(4)")
    running.world.wait_for(lambda world: world.horizon > 5)
    running.close()
    goal.ends("aborted", "shutting down")


def test_any_message_is_an_event_in_the_dialect_1_0(single: Make, tmp_path: Path) -> None:
    extra = tmp_path / "extra.lp"
    extra.write_text("#program set_event(id,e,t). heard(id,e,t). #show heard/3.")
    running = single(LINE["1.0"], str(extra)).start()
    assert running.goal("visit(2)").wait() == "succeeded"
    running.send("sensor", "reading(7)")
    assert running.goal("visit(1)").wait() == "succeeded"
    assert running.world.warnings == []
    shown = running.loop.state.plan.symbols
    assert any(atom.startswith("heard(sensor,reading(7),") for atom in shown)
    assert any(atom.startswith("heard(robot,success,") for atom in shown)


def test_an_abort_is_published(single: Make) -> None:
    running = single(LINE["1.0"])
    running.world.answer = lambda actuator, action: "failure" if action == "abort" else None
    goal = running.begin("visit(3)")
    running.world.wait_for(lambda world: bool(world.published))
    running.send("info", "close(2)")
    running.world.wait_for(lambda world: ("robot", "abort") in world.published)
    running.world.answer = lambda actuator, action: "success"
    running.send("info", "open(2)")
    assert goal.wait() == "succeeded"
    assert running.world.actions == ["go(2)", "abort", "go(2)", "go(3)"]


def test_a_goal_of_the_paper_with_a_status_ends_by_it(single: Make, tmp_path: Path) -> None:
    extra = tmp_path / "status.lp"
    extra.write_text(
        "#program transition(t). status(ID,accepted,t) :- event(request,(ID,visit(X)),t)."
        "status(ID,succeeded,t) :- asked(ID,X,t), not holds(want(ID,X),t), holds(at(X),t)."
        "#show status/3."
    )
    running = single(LINE["paper"], str(extra))
    goals = running.act("visit(2)", "visit(3)")
    running.send("robot", "success")
    assert goals[0].wait() == "succeeded"  # while the other goes on
    assert not goals[1].words or goals[1].words == ["accepted"]
    running.world.wait_for(lambda world: len(world.published) == 2)
    running.send("robot", "success")
    assert goals[1].wait() == "succeeded"


def test_a_cancel_that_the_encoding_does_not_know(single: Make, tmp_path: Path) -> None:
    text = Path(LINE["paper"]).read_text()
    file = tmp_path / "no_cancel.lp"
    external = "#external event(request,(ID,cancel),t) : id(ID)."
    assert external in text
    file.write_text("#defined event/3." + text.replace(external, ""))
    running = single(str(file))
    (goal,) = running.act("visit(3)")
    running.cancel(goal)
    running.world.wait_for(lambda world: bool(world.warnings))
    assert "cannot be cancelled" in running.world.warnings[0]
    running.world.answer = lambda actuator, action: "success"
    running.send("robot", "success")
    assert goal.wait() == "succeeded"
