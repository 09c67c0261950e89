"""Modes in the style of ROSoClingo 2.0: they give the statuses of a step before its actions."""

from __future__ import annotations

from pathlib import Path
from typing import Any, List

import pytest

from rosclingo.solver.options import Options
from rosoclingo.bags.read.run import Run
from rosoclingo.bags.replay.input_schedule import input_schedule
from rosoclingo.errors import LoopError
from rosoclingo.in_process.parts import EXAMPLES, make_parts
from rosoclingo.in_process.system import System
from rosoclingo.loop.inputs.replay_inbox import Phase, ScheduledKind

MODE = str(Path(__file__).resolve().parents[1] / "modes" / "dynamic_2_0.lp")
LINE = f"{EXAMPLES}/line.lp"


TWO = """
#program base. rslot(1).
#program state(t).
#external event(1,(work;cancel),t).
#external event((first;second),success,t).
asked(t) :- event(1,work,t).
asked(t) :- asked(t-1), not status(1,succeeded,t-1).
status(1,accepted,t) :- event(1,work,t).
#program transition(t).
do(first,begin,t) :- event(1,work,t-1).
do(second,end,t) :- do(first,begin,t-1).
status(1,succeeded,t) :- do(second,end,t).
#program query(t).
#external query(t).
:- query(t), asked(t), not status(1,succeeded,t).
#show do/3. #show status/3.
"""


class Robot(System):
    """A robot on a line that answers as it is told, in order, and then succeeds."""

    def __init__(
        self, *constants: str, slots: int = 1, encoding: str = LINE, **parameters: Any
    ) -> None:
        options = [word for constant in ("steps=40", *constants) for word in ("-c", constant)]
        if any(constant.startswith("steps=") for constant in constants):
            options = options[2:]
        planner = Options((encoding,), ("-c", f"slots={slots}"))
        self.answers: List[str] = []
        self.at_answers: List[List[List[str]]] = []
        super().__init__(make_parts(MODE, planner, options).loop, **parameters)

    def turn(self) -> bool:
        for actuator in sorted(self.acting):
            self.at_answers.append([goal.words[:] for goal in self.goals])
            self.answer(actuator, self.answers.pop(0) if self.answers else "success")
        return bool(self._items)


def test_a_goal_succeeds_after_the_answer() -> None:
    """Not by the plan: the first two attempts at the last action fail."""
    robot = Robot()
    goal = robot.request("visit(3)")
    robot.answers = ["success", "failure", "failure", "success"]
    assert robot.run() is None
    assert [action for _, action in robot.published] == ["go(2)", "go(3)", "go(3)", "go(3)"]
    assert robot.at_answers == [[["accepted"]]] * 4
    assert goal.words == ["accepted", "succeeded"]


def test_a_goal_succeeds_after_an_answer_that_the_encoding_does_not_declare(tmp_path: Path) -> None:
    file = tmp_path / "line.lp"
    text = Path(LINE).read_text()
    declared = "#external event(robot,(success;failure),t)."
    assert declared in text
    file.write_text(text.replace(declared, "#defined event/3."))
    robot = Robot(encoding=str(file))
    goal = robot.request("visit(2)")
    assert robot.run() is None
    assert robot.at_answers == [[["accepted"]]]
    assert goal.words == ["accepted", "succeeded"]


def test_a_cancel_request_comes_while_the_status_is_held() -> None:
    """The status that the plan has when the action is answered counts."""
    robot = Robot()
    goal = robot.request("visit(2)")

    def turn() -> bool:
        if robot.acting:
            robot.cancel(goal)
            robot.answer("robot")
        return bool(robot._items)

    robot.turn = turn  # type: ignore[method-assign]
    assert robot.run() is None
    assert goal.words == ["accepted", "canceled"]


def test_a_status_is_given_without_actions() -> None:
    robot = Robot()
    goal = robot.request("visit(1)")
    assert robot.run() is None
    assert robot.published == []
    assert goal.words == ["accepted", "succeeded"]


@pytest.mark.costly
@pytest.mark.parametrize("resets", ["none", "every", "goal"])
def test_ten_goals_one_after_the_other_in_one_slot(resets: str) -> None:
    robot = Robot(f"resets={resets}", "steps=100")
    targets = [3, 2, 2, 5, 1, 1, 4, 6, 2, 3]

    def turn() -> bool:
        for actuator in sorted(robot.acting):
            robot.answer(actuator)
        if not robot._items and len(robot.goals) < len(targets):
            robot.request(f"visit({targets[len(robot.goals)]})")
        return bool(robot._items)

    robot.turn = turn  # type: ignore[method-assign]
    assert robot.run() is None
    assert [goal.words for goal in robot.goals] == [["accepted", "succeeded"]] * 10


@pytest.mark.costly
def test_ten_goals_at_once_in_one_slot() -> None:
    robot = Robot("steps=100")
    for target in (3, 2, 2, 5, 1, 1, 4, 6, 2, 3):
        robot.request(f"visit({target})")
    assert robot.run() is None
    assert [goal.words[-1] for goal in robot.goals] == ["succeeded"] * 10


def test_a_goal_that_waits_at_the_last_step() -> None:
    """It ends as one does that comes too late, with the mode."""
    robot = Robot("steps=2")
    first, second = robot.request("visit(3)"), robot.request("visit(1)")
    failure = robot.run()
    assert isinstance(failure, LoopError)
    assert first.words == ["accepted", "succeeded"]
    assert second.words == ["aborted"]
    assert second.reason.startswith("the mode ended after its last step, 2; it is too late for vis")


@pytest.mark.parametrize("encoding", [LINE, f"{EXAMPLES}/line_demand.lp"])
@pytest.mark.parametrize("early", [1, 2])
@pytest.mark.parametrize("resets", ["every", "goal"])
def test_a_reset_before_the_answers(resets: str, early: int, encoding: str) -> None:
    """A failed action has not happened, and is planned again."""
    robot = Robot(f"resets={resets}", "r=1", f"early={early}", encoding=encoding)
    goal = robot.request("visit(4)")
    robot.answers = ["failure", "success", "failure", "success"]
    assert robot.run() is None
    actions = [action for _, action in robot.published]
    assert actions == ["go(2)", "go(2)", "go(3)", "go(3)", "go(4)"]
    assert goal.words == ["accepted", "succeeded"]


def test_a_reset_when_the_plan_needs_a_farther_horizon() -> None:
    """It keeps what has been done, also if a message makes the plan longer then."""
    demand = f"{EXAMPLES}/line_demand.lp"
    robot = Robot("resets=every", "r=1", "early=1", slots=2, encoding=demand)
    robot.tell("info", "close(3)")
    goals = [robot.request("visit(2)"), robot.request("visit(5)")]

    def turn() -> bool:
        if len(robot.published) == 1:
            robot.tell("info", "open(3)")
        return Robot.turn(robot)

    robot.turn = turn  # type: ignore[method-assign]
    assert robot.run() is None
    assert [action for _, action in robot.published] == [f"go({n})" for n in (2, 3, 4, 5)]
    assert [goal.words for goal in goals] == [["accepted", "succeeded"]] * 2


def test_a_replay_of_an_answer_in_the_reset_that_has_published_its_action() -> None:
    """It does not wait for the answer before the reset begins."""

    class Quick(Robot):
        def publish(self, actuator: str, action: str) -> None:
            super().publish(actuator, action)
            self.answer(actuator)

    robot = Quick("resets=every", "r=1", "early=2")
    robot.request("visit(3)")
    assert robot.run() is None
    dues = input_schedule(Run(robot.journal))
    assert [due.phase for due in dues if due.kind is ScheduledKind.MESSAGE] == [Phase.WAIT] * 2


def test_a_reset_before_an_answer_that_contradicts_the_program(tmp_path: Path) -> None:
    """The planner begins again, as in other modes: the action has not happened."""
    file = tmp_path / "line.lp"
    constraint = "\n#program transition(t). :- event(robot,failure,t).\n"
    file.write_text(Path(LINE).read_text() + constraint)
    robot = Robot("resets=every", "r=1", "early=1", encoding=str(file))
    goal = robot.request("visit(3)")
    robot.answers = ["success", "failure"]
    assert robot.run() is None
    assert [action for _, action in robot.published] == ["go(2)", "go(3)", "go(3)"]
    assert goal.words == ["accepted", "succeeded"]
    (warning,) = robot.warnings
    assert "the planner begins again" in warning


def test_a_mode_that_does_not_wait_for_answers(tmp_path: Path) -> None:
    """Two robots act one after the other, and the first one answers last."""
    mode, encoding = tmp_path / "mode.lp", tmp_path / "two.lp"
    waits = "pending :- event(info,pending_actions,0)."
    text = Path(MODE).read_text()
    assert waits in text
    mode.write_text(text.replace(waits, "pending :- #false."))
    encoding.write_text(TWO)
    words: List[List[str]] = []

    class Robots(System):
        def turn(self) -> bool:
            words.append(goal.words[:])
            for robot in sorted(self.acting, reverse=True)[:1]:
                self.answer(robot)
            return bool(self._items)

    robots = Robots(make_parts(str(mode), Options((str(encoding),)), ()).loop)
    goal = robots.request("work")
    assert robots.run() is None
    assert robots.published == [("first", "begin"), ("second", "end")]
    assert words == [["accepted"]] * 2 + [["accepted", "succeeded"]]
