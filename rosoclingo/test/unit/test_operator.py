"""An operator pauses, steps, holds, approves and rejects: docs/protocol.md, section "Control"."""

from __future__ import annotations

from pathlib import Path
from typing import Any, List, Optional, Tuple

import pytest

from rosclingo.solver.options import Options
from rosoclingo.in_process.parts import EXAMPLES, SINGLE, make_parts
from rosoclingo.in_process.system import System
from rosoclingo.loop import journal
from rosoclingo.loop.execution.interlock import Interlock
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.journal import Control, ControlArrived, ControlOutcome
from rosoclingo.loop.values.execution import HoldReason, OperatorState

MODES = ("dynamic.incremental.recording", "dynamic.incremental.dyn_reset", SINGLE)
STEPS = ("-c", "steps=30")
BLOCKS = Path(EXAMPLES) / "itoh.lp"


class Operated(System):
    """A robot on a line, and an operator, whose turn is when the loop waits."""

    def __init__(self, mode: str, *turns: Tuple[Control, str], **parameters: Any) -> None:
        self.turns = list(turns)
        self.shown: List[OperatorState] = []
        self.outcomes: List[ControlOutcome] = []
        name = "line_1.0.lp" if mode == SINGLE else "line.lp"
        self.parts = make_parts(mode, Options((f"{EXAMPLES}/{name}",)), STEPS)
        super().__init__(self.parts.loop, **parameters)

    def operate(self, word: Control, actuator: str = "") -> None:
        self.put(ControlArrived(word, actuator))

    def after(self, word: Control, actuator: str = "") -> None:
        """Has the operator say a word, and goes on until the loop waits."""
        self.operate(word, actuator)
        assert self.run() is None

    def turn(self) -> bool:
        if super().turn():
            return True
        if self.turns:
            self.operate(*self.turns.pop(0))
        return bool(self._items)

    def show_held(self, decided: OperatorState) -> None:
        self.shown.append(decided)

    def answer_control(self, request: ControlArrived, outcome: ControlOutcome) -> None:
        self.outcomes.append(outcome)

    @property
    def held(self) -> List[Tuple[str, HoldReason]]:
        return [(one.action, one.reason) for one in self.shown[-1].held]


@pytest.fixture(params=MODES)
def mode(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def goes(system: System) -> List[str]:
    return [action for _, action in system.published]


def outcome(system: System) -> List[str]:
    return [goal.words[-1] for goal in system.goals]


@pytest.fixture
def system(mode: str) -> Operated:
    """A system that holds the robot's first action, since it is paused."""
    system = Operated(mode)
    system.request("visit(3)")
    system.after(Control.PAUSE)
    return system


def test_nothing_begins_until_resume(system: Operated) -> None:
    (goal,) = system.goals
    assert system.published == []
    assert system.shown[-1][0]
    assert [reason for _, reason in system.held] == [HoldReason.PAUSE]
    assert system.loop.state.held_sentences() == ["The run is paused."]
    assert not goal.ended
    system.after(Control.RESUME)
    assert goal.words[-1] == "succeeded"
    assert system.loop.state.held_sentences() == []
    assert system.shown[-1] == OperatorState()


def test_what_runs_ends_and_the_next_waits(mode: str) -> None:
    class Paused(Operated):
        def publish(self, actuator: str, action: str) -> None:
            super().publish(actuator, action)
            if len(self.published) == 1:
                self.operate(Control.PAUSE)

    system = Paused(mode)
    goal = system.request("visit(3)")
    assert system.run() is None
    assert len(system.published) == 1
    assert system.acting == {}
    system.after(Control.RESUME)
    assert goal.words[-1] == "succeeded"


def test_a_step_begins_the_next_actions_only(system: Operated) -> None:
    for count in (1, 2):
        system.after(Control.STEP)
        assert len(system.published) == count
    system.after(Control.RESUME)
    assert outcome(system) == ["succeeded"]


def test_a_step_before_there_is_anything_to_do(mode: str) -> None:
    system = Operated(mode)
    system.after(Control.STEP)
    system.request("visit(3)")
    assert system.run() is None
    assert len(system.published) == 1


def test_an_approval_is_for_one_action(mode: str) -> None:
    system = Operated(mode, ask_before=("go(*)",))
    goal = system.request("visit(3)")
    while not (goal.words and goal.words[-1] == "succeeded"):
        assert system.run() is None
        before = len(system.published)
        assert [reason for _, reason in system.held] == [HoldReason.APPROVAL]
        system.after(Control.APPROVE)
        assert len(system.published) == before + 1
    assert len(system.published) > 1


def test_clients_hear_what_waits(mode: str) -> None:
    system = Operated(mode, ask_before=("go(3)",))
    goal = system.request("visit(3)")
    system.run()
    assert "waits for an operator: robot go(3) (approval)" in goal.lines
    assert system.loop.state.held_sentences() == ["go(3) of robot waits for an approval."]


def test_what_is_rejected_counts_as_failed(mode: str) -> None:
    system = Operated(mode, ask_before=("go(*)",))
    system.request("visit(3)")
    system.run()
    ((actuator, action, _, _),) = system.shown[-1].held
    system.after(Control.REJECT, actuator)
    assert (actuator, action) not in system.published
    assert system.loop.state.executions.last[actuator].is_held  # it is planned again
    system.after(Control.APPROVE, actuator)
    assert system.published


def test_an_actuator_on_hold(mode: str) -> None:
    system = Operated(mode)
    goal = system.request("visit(3)")
    system.after(Control.HOLD, "robot")
    assert system.published == []
    assert [reason for _, reason in system.held] == [HoldReason.HOLD]
    assert system.loop.state.held_sentences() == ["robot is on hold."]
    system.after(Control.RESUME)
    assert system.published == []
    system.after(Control.RELEASE, "robot")
    assert goal.words[-1] == "succeeded"


def test_an_answer_to_what_is_held_is_dropped(system: Operated) -> None:
    system.tell("robot", "success")
    system.run()
    assert "and has not begun" in system.warnings[-1]
    assert system.held


def test_a_halt_aborts(mode: str) -> None:
    class Halted(Operated):
        def turn(self) -> bool:
            if ("robot", "abort") in self.published:
                return super().turn()
            self.operate(Control.HALT)
            return True

    system = Halted(mode)
    system.request("visit(3)")
    system.run()
    assert goes(system)[1:] == ["abort"]


def test_it_is_in_the_journal(mode: str) -> None:
    system = Operated(mode)
    system.after(Control.HOLD, "robot")
    event = ControlArrived(Control.HOLD, "robot")
    assert [one.event for one in system.journal if isinstance(one.event, ControlArrived)] == [event]
    assert journal.decode(journal.Fields(*journal.encode(event))) == event


def test_a_goal_that_is_cancelled_while_paused(system: Operated) -> None:
    (goal,) = system.goals
    system.cancel(goal)
    system.run()
    system.after(Control.RESUME)
    assert goal.ended


@pytest.mark.parametrize("how", [Control.REJECT, None])
def test_an_approval_is_for_no_later_action(mode: str, how: Optional[Control]) -> None:
    system = Operated(mode, ask_before=("go(*)",))
    system.request("visit(3)")
    system.after(Control.HOLD, "robot")
    system.after(Control.APPROVE, "robot")
    assert [reason for _, reason in system.held] == [HoldReason.HOLD]
    if how is None:
        system.operate(Control.RELEASE, "robot")
    else:
        system.after(how, "robot")
    system.after(Control.RELEASE, "robot")
    later = HoldReason.APPROVAL if how is None else HoldReason.REJECTED
    assert [reason for _, reason in system.held] == [later]
    assert len(system.published) == (how is None)


def test_an_answer_that_came_before_is_none_to_what_is_let_go(system: Operated) -> None:
    system.tell("robot", "success")
    system.operate(Control.STEP)
    seen: List[bool] = []

    def publish(actuator: str, action: str) -> None:
        seen.append(system.loop.state.executions.last[actuator].is_open)
        system.close()

    system.publish = publish  # type: ignore[method-assign]
    system.run()
    assert seen == [True]
    assert system.loop.state.executions.last["robot"].is_open


def test_nobody_hears_of_what_is_rejected(mode: str) -> None:
    system = Operated(mode, ask_before=("go(*)",))
    system.request("visit(3)")
    system.run()
    system.after(Control.REJECT)
    assert system.published == []
    assert system.loop.state.executions.dispatched == []


def test_in_a_static_mode_nobody_is_asked() -> None:
    parts = make_parts("static.incremental.recording", Options((str(BLOCKS),)), STEPS)
    system = System(parts.loop, ask_before=("pickup(*)",))
    system.run()
    assert any("~ask_before" in warning for warning in system.warnings)


@pytest.mark.parametrize(
    ("pattern", "action", "is_one"),
    [("deliver(*)", "deliver(1)", True), ("deliver(1, 2)", "deliver(1,2)", True),
     ('say("[x] ?")', 'say("[x] ?")', True), ('say("a b")', 'say("ab")', False),
     ("do(robot,*)", "go(1)", True), ("do(robot(2),*)", "go(1)", False), ("go", "go(1)", False)],
)  # fmt: skip
def test_patterns(pattern: str, action: str, is_one: bool) -> None:
    reason = Interlock((pattern,)).reason("robot", action)
    assert reason is (HoldReason.APPROVAL if is_one else None)


@pytest.mark.parametrize("pattern", ["deliver(1,", "2)", "", " "])
def test_a_pattern_that_is_none(pattern: str) -> None:
    with pytest.raises(ValueError, match="pattern"):
        Interlock((pattern,))


def test_a_request_is_not_taken_in_a_search() -> None:
    """However often that looks for inputs."""
    inbox = Inbox()
    inbox.put(ControlArrived(Control.PAUSE))
    for _ in range(5):
        assert inbox.take(controls=False) == []
    assert inbox.take() == [ControlArrived(Control.PAUSE)]
