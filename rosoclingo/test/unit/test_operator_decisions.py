"""An operator's decision is for one action with its token, and its answer says what became of it.

docs/protocol.md, section "Control".
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, List, Optional, Tuple

import pytest

from rosclingo.solver.options import Options
from rosoclingo.in_process.parts import EXAMPLES, SINGLE, make_parts
from rosoclingo.in_process.system import Request, System
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Control, ControlArrived, ControlOutcome
from rosoclingo.loop.values.execution import HeldAction, HoldReason, OperatorState
from rosoclingo.loop.words import FAILURE

RECORDING, DYN_RESET, RESET = (
    f"dynamic.incremental.{name}" for name in ("recording", "dyn_reset", "reset")
)
MODES = (RECORDING, DYN_RESET, RESET)
FLEET = str(Path(__file__).with_name("fleet.lp"))
ALL = ("*",)


class Fleet(System):
    """Robots whose actions an operator approves; the clock moves when nothing else does."""

    def __init__(
        self,
        mode: str = DYN_RESET,
        *constants: str,
        encoding: str = FLEET,
        failing: Tuple[str, ...] = (),
        **parameters: Any,
    ) -> None:
        self.shown: List[OperatorState] = []
        self.outcomes: List[ControlOutcome] = []
        self.seconds = 0.0  # which pass
        self.failing = failing
        options = [word for constant in constants for word in ("-c", constant)]
        parts = make_parts(mode, Options((encoding,), tuple(options)), ("-c", "steps=30"))
        super().__init__(parts.loop, **parameters)

    def turn(self) -> bool:
        for actuator, action in sorted(self.acting.items()):
            self.answer(actuator, FAILURE if action in self.failing else "success")
        if self._items:
            return True
        if self.seconds > 0:
            self.seconds -= 1.0
            self.clock += 1.0
            return True
        return False

    def show_held(self, decided: OperatorState) -> None:
        self.shown.append(decided)

    def answer_control(self, request: ControlArrived, outcome: ControlOutcome) -> None:
        self.outcomes.append(outcome)

    def say(self, word: Control, actuator: str = "", action: str = "", token: int = 0) -> None:
        self.put(ControlArrived(word, actuator, action=action, token=token))

    def after(
        self, word: Control, actuator: str = "", action: str = "", token: int = 0
    ) -> ControlOutcome:
        self.say(word, actuator, action, token)
        self.go_on()
        return self.outcomes[-1]

    def go_on(self) -> None:
        assert self.run() is None

    def plan(self, request: str) -> Request:
        goal = self.request(request)
        self.go_on()
        return goal

    def call_off(self, goal: Request) -> None:
        self.cancel(goal)
        self.go_on()

    @property
    def held(self) -> List[Tuple[str, str, HoldReason]]:
        return [one[:3] for one in self.shown[-1].held] if self.shown else []

    def token(self, actuator: str) -> int:
        (one,) = [one for one in self.shown[-1].held if one.actuator == actuator]
        return one.token

    def noted(self) -> List[ControlArrived]:
        return [one.event for one in self.journal if isinstance(one.event, ControlArrived)]


def both(mode: str, **parameters: Any) -> Fleet:
    """Returns two robots whose first actions wait for an approval."""
    fleet = Fleet(mode, ask_before=ALL, **parameters)
    fleet.request("clean(r1,1)")
    fleet.plan("clean(r2,1)")
    assert fleet.held == [
        ("r1", "go(1)", HoldReason.APPROVAL),
        ("r2", "go(1)", HoldReason.APPROVAL),
    ]
    return fleet


@pytest.fixture(params=MODES)
def mode(request: pytest.FixtureRequest) -> str:
    return str(request.param)


# O1: what is named, and nothing else.


def test_only_what_is_named_begins(mode: str) -> None:
    fleet = both(mode)
    assert fleet.after(Control.APPROVE, action="go(1)", token=fleet.token("r2")).is_done
    assert fleet.published == [("r2", "go(1)")]
    assert ("r1", "go(1)", HoldReason.APPROVAL) in fleet.held


def test_only_what_is_named_is_rejected(mode: str) -> None:
    fleet = both(mode)
    fleet.after(Control.REJECT, "r1", "go(1)")
    failed = [one for one in fleet.loop.state.externals.true if one.startswith("event(r")]
    assert failed == ["event(r1,failure,1)"]
    assert fleet.published == []


@pytest.mark.parametrize("word", [Control.APPROVE, Control.REJECT, Control.RELEASE])
@pytest.mark.parametrize(
    ("actuator", "action", "token"),
    [("r1", "go(2)", 0), ("r3", "", 0), ("", "clean(1)", 0), ("r1", "go(1)", 99), ("", "", 99)],
)
def test_what_is_not_held_is_refused(word: Control, actuator: str, action: str, token: int) -> None:
    fleet = both(DYN_RESET)
    before = fleet.held
    if word is Control.RELEASE and not (action or token):
        return  # any actuator may be released
    outcome = fleet.after(word, actuator, action, token)
    assert not outcome.is_done
    assert "held" in outcome.text
    assert fleet.noted()[-1].refused == outcome.text
    assert fleet.published == []
    assert fleet.held == before


def test_a_token_of_the_past_is_refused(mode: str) -> None:
    """The same action is held again, as another one."""
    fleet = Fleet(mode, ask_before=ALL)
    fleet.plan("clean(r1,1)")
    old = fleet.token("r1")
    fleet.after(Control.REJECT, "r1", token=old)
    assert fleet.held == [("r1", "go(1)", HoldReason.REJECTED)]
    outcome = fleet.after(Control.APPROVE, "r1", "go(1)", old)
    assert not outcome.is_done
    assert str(fleet.token("r1")) in outcome.text
    assert fleet.published == []
    assert fleet.after(Control.APPROVE, "r1", "go(1)", fleet.token("r1")).is_done
    assert ("r1", "go(1)") in fleet.published


def test_a_hold_that_names_an_action_comes_before_that_or_is_refused() -> None:
    fleet = both(DYN_RESET)
    assert fleet.after(Control.HOLD, "r1", "go(1)").is_done
    outcome = fleet.after(Control.APPROVE, "r1", "go(1)")
    assert outcome.is_done
    assert "~release" in outcome.text
    assert fleet.published == []
    fleet.acting.clear()
    fleet.after(Control.RELEASE, "r1", "go(1)")
    assert ("r1", "go(1)") in fleet.published
    refused = fleet.after(Control.HOLD, "r1", "go(1)")
    assert not refused.is_done


def test_an_approval_of_what_is_approved_already() -> None:
    fleet = both(DYN_RESET)
    fleet.after(Control.PAUSE)
    for _ in range(2):
        outcome = fleet.after(Control.APPROVE, "r1")
        assert outcome.is_done
        assert "~resume" in outcome.text
    assert fleet.published == []


def test_the_journal_names_what_was_meant(mode: str) -> None:
    fleet = both(mode)
    token = fleet.token("r1")
    fleet.after(Control.REJECT, "r1")
    (noted,) = fleet.noted()
    assert noted.words == "reject r1 go(1)"
    assert noted.token == token
    assert journal.from_text(journal.to_text(noted)) == noted


def test_an_older_journal_names_no_action() -> None:
    old = journal.decode(journal.Fields("control", "r1", "approve", (), 0.0))
    assert old == ControlArrived(Control.APPROVE, "r1")
    fleet = both(DYN_RESET)
    assert isinstance(old, ControlArrived)
    fleet.put(old)
    fleet.go_on()
    assert ("r1", "go(1)") in fleet.published


# O3: of two that contradict each other, one is refused.


@pytest.mark.parametrize("words", [(Control.APPROVE, Control.REJECT)[::n] for n in (1, -1)])
def test_approved_and_rejected_at_once(mode: str, words: Tuple[Control, Control]) -> None:
    fleet = both(mode)
    for word in words:
        fleet.say(word, "r1", "go(1)")
    fleet.go_on()
    first, second = fleet.outcomes
    assert first.is_done
    assert not second.is_done
    assert ("begun" if words[0] is Control.APPROVE else "rejected") in second.text
    assert (("r1", "go(1)") in fleet.published) == (words[0] is Control.APPROVE)


# O4: a cancel takes back what has not begun.


def canceled(goal: Request) -> bool:
    return goal.words[-1] == "canceled"


@pytest.mark.parametrize("how", ["approval", "pause", "hold"])
def test_a_cancelled_goal_ends_without_what_was_held(mode: str, how: str) -> None:
    fleet = Fleet(mode, ask_before=ALL if how == "approval" else ())
    if how != "approval":
        fleet.say(Control.PAUSE if how == "pause" else Control.HOLD, "" if how == "pause" else "r1")
    goal = fleet.plan("clean(r1,2)")
    assert fleet.held
    fleet.call_off(goal)
    assert canceled(goal)
    assert fleet.held == []
    assert fleet.published == []
    assert any(isinstance(one.event, journal.ActionWithdrawn) for one in fleet.journal)


def test_what_serves_another_goal_stays_the_same_action(mode: str) -> None:
    fleet = both(mode)
    token = fleet.token("r2")
    fleet.call_off(fleet.goals[0])
    assert canceled(fleet.goals[0])
    assert fleet.held == [("r2", "go(1)", HoldReason.APPROVAL)]
    assert fleet.token("r2") == token
    assert fleet.after(Control.APPROVE, "r2", "go(1)", token).is_done
    assert fleet.published == [("r2", "go(1)")]


def test_what_the_encoding_wants_to_be_brought_back_is_planned(mode: str) -> None:
    fleet = Fleet(mode, "brings=1", ask_before=("clean(*)",))
    goal = fleet.plan("clean(r1,2)")
    assert fleet.held == [("r1", "clean(2)", HoldReason.APPROVAL)]
    fleet.call_off(goal)
    assert canceled(goal)
    assert fleet.published == [("r1", f"go({place})") for place in (1, 2, 1, 0)]


def test_it_ends_when_that_was_approved_and_done(mode: str) -> None:
    fleet = Fleet(mode, "brings=1", ask_before=ALL)
    goal = fleet.plan("clean(r1,2)")
    for place in (1, 2):
        assert fleet.after(Control.APPROVE, "r1", f"go({place})").is_done
    fleet.call_off(goal)
    for place in (1, 0):
        assert not goal.ended
        assert fleet.held == [("r1", f"go({place})", HoldReason.APPROVAL)]
        assert fleet.after(Control.APPROVE, "r1", f"go({place})").is_done
    assert canceled(goal)


def test_it_waits_for_what_has_begun(mode: str) -> None:
    class Slow(Fleet):
        def turn(self) -> bool:
            return False

    fleet = Slow(mode)
    goal = fleet.plan("clean(r1,1)")
    fleet.call_off(goal)
    assert not goal.ended


@pytest.mark.parametrize("mode", [DYN_RESET, SINGLE])
def test_events_that_are_facts(mode: str) -> None:
    """Which no planner takes back: it begins again, or what is held counts as failed."""
    name = "line_1.0.lp" if mode == SINGLE else "line_demand.lp"
    fleet = Fleet(mode, encoding=f"{EXAMPLES}/{name}", ask_before=("go(*)",))
    goal = fleet.plan("visit(3)")
    assert fleet.held
    fleet.call_off(goal)
    assert canceled(goal)
    assert fleet.held == []
    after = fleet.plan("visit(2)")
    fleet.after(Control.APPROVE)
    assert after.words[-1] == "succeeded"


# O5: what was rejected is shown, and not asked for again at once.


def rejected(mode: str = DYN_RESET, **parameters: Any) -> Fleet:
    fleet = Fleet(mode, ask_before=("clean(*)",), **parameters)
    fleet.plan("clean(r1,1)")
    assert fleet.after(Control.REJECT, "r1", "clean(1)").is_done
    return fleet


def test_an_operator_is_not_asked_again_in_the_same_second(mode: str) -> None:
    fleet = rejected(mode)
    (one,) = fleet.shown[-1].rejected
    assert one[:2] == ("r1", "clean(1)")
    assert one.instead is not None
    assert one.instead.name == "clean(1)"  # the only way
    assert fleet.held == [("r1", "clean(1)", HoldReason.REJECTED)]
    (goal,) = fleet.goals
    assert any(line.startswith("an operator has rejected") for line in goal.lines)
    asked = [line for line in goal.lines if line.startswith("waits for an operator")]
    assert len(asked) == 1


def asked_again(fleet: Fleet) -> bool:
    return fleet.held == [("r1", "clean(1)", HoldReason.APPROVAL)] and not fleet.shown[-1].rejected


def test_it_is_asked_again_after_a_time(mode: str) -> None:
    fleet = rejected(mode, ask_again=20.0)
    fleet.seconds = 10
    fleet.go_on()
    assert not asked_again(fleet)
    fleet.seconds = 20
    fleet.go_on()
    assert asked_again(fleet)
    assert [one.words for one in fleet.noted()][-1] == "ask r1 clean(1)"


@pytest.mark.parametrize("what", ["goal", "message", "cancel"])
def test_it_is_asked_again_when_something_has_changed(mode: str, what: str) -> None:
    fleet = rejected(mode)
    if what == "goal":
        fleet.request("clean(r2,1)")
    elif what == "message":
        fleet.tell("info", "weather(3)")
    else:
        other = fleet.plan("clean(r1,3)")
        fleet.after(Control.REJECT, "r1")
        fleet.cancel(other)
    fleet.go_on()
    assert ("r1", "clean(1)", HoldReason.APPROVAL) in fleet.held


def test_an_answer_to_another_action_changes_something() -> None:
    fleet = rejected()
    executions = fleet.loop.state.executions
    assert executions.rejected
    fleet.acting.clear()
    assert fleet.after(Control.APPROVE, "r1", "clean(1)").is_done  # an operator may think again
    assert fleet.published[-1] == ("r1", "clean(1)")
    assert not executions.rejected
    assert fleet.goals[0].words[-1] == "succeeded"


def test_what_is_planned_instead_is_shown() -> None:
    fleet = Fleet(DYN_RESET, ask_before=("clean(2)",))
    fleet.plan("clean(r1,2)")
    fleet.plan("clean(r1,3)")
    before: Optional[HeldAction] = next(iter(fleet.shown[-1].held), None)
    assert before is not None
    fleet.after(Control.REJECT, "r1", "clean(2)")
    assert all(one.instead is not None for one in fleet.shown[-1].rejected)
