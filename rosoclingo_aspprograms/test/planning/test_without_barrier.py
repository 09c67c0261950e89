"""Actions without a barrier: robots act on while another one takes long, in all dynamic modes."""

from __future__ import annotations

from pathlib import Path
from typing import List, Set, Tuple

import pytest
from episode import DYN_RESET, RECORDING, RESET, SINGLE
from test_actions import ACTIONS, STEPS, World

from rosoclingo.loop import search
from rosoclingo.loop.journal import Ended, SearchEnded
from rosoclingo.loop.state import State
from rosoclingo.loop.values.atoms import Plan

ENCODINGS = Path(__file__).resolve().parents[3] / "rosoclingo" / "test" / "encodings"
MODES = (RECORDING, RESET, DYN_RESET, SINGLE)


class SlowWorld(World):
    """Robots of which some do not answer until nobody else acts."""

    def __init__(self, mode: str, slow: str) -> None:
        super().__init__(mode, [str(ENCODINGS / "errands.lp")])
        self.slow = slow
        self.beside: List[Tuple[str, str]] = []  # what began while a slow robot acted

    def publish(self, actuator: str, action: str) -> None:
        if self.slow in self.acting and actuator != self.slow:
            self.beside.append((actuator, action))
        super().publish(actuator, action)

    def turn(self) -> bool:
        quick = sorted(self.acting.keys() - {self.slow})
        for robot in quick or sorted(self.acting):
            self.answer(robot)
        return bool(self._items)


def found(world: World) -> List[Ended]:
    return [one.event.how for one in world.journal if isinstance(one.event, SearchEnded)]


@pytest.mark.parametrize("mode", MODES)
def test_nobody_waits_for_a_slow_robot(mode: str) -> None:
    """The plan is timed anew after each answer, without a search."""
    world = SlowWorld(mode, slow="a")
    goals = [world.request(text) for text in ("visit(1)", "visit(3)", "visit(5)")]
    assert world.run() is None
    assert [goal.words[-1] for goal in goals] == ["succeeded"] * 3
    assert len(world.beside) >= 3, world.published
    if mode in (RECORDING, SINGLE):  # after a reset, the planner knows its task again
        assert found(world).count(Ended.FOUND) == 1


@pytest.mark.parametrize("mode", MODES)
def test_a_goal_that_comes_meanwhile_is_begun_at_once(mode: str) -> None:
    world = SlowWorld(mode, slow="a")
    first = world.request("visit(1)")
    second = None
    turn = world.turn

    def ask_then_turn() -> bool:
        nonlocal second
        if second is None and world.acting == {"a": "go(1)"}:
            second = world.request("visit(5)")
            return True
        return turn()

    world.turn = ask_then_turn  # type: ignore[method-assign]
    assert world.run() is None
    assert second is not None
    assert (first.words[-1], second.words[-1]) == ("succeeded", "succeeded")
    assert world.beside[:3] == [("b", "go(6)"), ("b", "go(5)"), ("b", "look(2)")]


@pytest.mark.parametrize("mode", MODES)
def test_a_failure_moves_nobody_else(mode: str) -> None:
    """A robot that is at an action when another one fails goes on, and the plan comes after it."""
    world = SlowWorld(mode, slow="a")
    goals = [world.request(text) for text in ("visit(1)", "visit(7)")]
    failed: Set[str] = set()

    def turn() -> bool:
        for robot in sorted(world.acting.keys() - {"a"}) or sorted(world.acting):
            action = world.acting[robot]
            fails = action.startswith("look") and robot == "b" and action not in failed
            failed.update([action] * fails)
            world.answer(robot, "failure" if fails else "success")
        return bool(world._items)

    world.turn = turn  # type: ignore[method-assign]
    assert world.run() is None
    assert [goal.words[-1] for goal in goals] == ["succeeded"] * 2
    assert failed == {"look(2)"}, world.published
    actions = [action for robot, action in world.published if robot == "b"]
    assert actions == ["look(2)", "mend", "look(2)"]
    assert world.published.count(("a", "go(1)")) == 1


@pytest.mark.parametrize("mode", MODES)
def test_a_cancel_waits_for_the_action_that_serves_the_goal(mode: str) -> None:
    """It ends the goal when nobody is at an action any more that changes a variable of its own."""
    world = SlowWorld(mode, slow="a")
    goal = world.request("visit(0)")

    is_canceled = False

    def turn() -> bool:
        nonlocal is_canceled
        if world.acting == {"a": "look(1)"} and not is_canceled:
            is_canceled = True
            world.cancel(goal)
            return True
        for robot in sorted(world.acting):
            assert not goal.ended
            world.answer(robot)
        return bool(world._items)

    world.turn = turn  # type: ignore[method-assign]
    assert world.run() is None
    assert goal.ended


PARCELS = """
#program base.
actuator(a;b).
request(parcel).

#program present(k,t).
own(ID,(label(ID);stamp(ID)),no,k) :- asked(ID,parcel,k).
wants(ID,(label(ID);stamp(ID)),yes,k) :- asked(ID,parcel,k).
restores(ID,label(ID),no,k) :- asked(ID,parcel,k).
action(a,stamp(ID),k) :- asked(ID,parcel,k).
sets(a,stamp(ID),stamp(ID),yes,k) :- asked(ID,parcel,k).
action(b,label(ID),k) :- asked(ID,parcel,k).
needs(b,label(ID),stamp(ID),yes,k) :- asked(ID,parcel,k).
sets(b,label(ID),label(ID),yes,k) :- asked(ID,parcel,k).
"""


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("outcome", ["success", "failure"])
def test_a_cancel_waits_for_what_changes_another_variable(
    mode: str, outcome: str, tmp_path: Path
) -> None:
    """All is restored at once, and the goal's slot is not free before the action has ended."""
    file = tmp_path / "parcels.lp"
    file.write_text(f'#include "{ACTIONS}".{PARCELS}')
    world = World(mode, [str(file)])
    goal = world.request("parcel")
    outcomes = [outcome]

    def turn() -> bool:
        if not world.goals[1:]:
            world.cancel(goal)
            world.request("parcel")
            return True
        for robot in sorted(world.acting):
            assert goal.ended or world.acting[robot] == "stamp(1)"
            assert not (goal.ended and outcomes)
            world.answer(robot, outcomes.pop() if outcomes else "success")
        return bool(world._items)

    world.turn = turn  # type: ignore[method-assign]
    assert world.run() is None
    assert goal.words[-1] == "canceled"
    assert world.goals[1].words[-1] == "succeeded"


def test_plans_say_nothing_of_goals_that_have_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    shown: List[Tuple[int, str]] = []

    def take(state: State, plan: Plan, is_best: bool = True) -> None:
        statuses = [s for s in plan.symbols if s.startswith("status(") and "accepted" not in s]
        shown.extend((state.step, one) for one in statuses)
        take_plan(state, plan, is_best)

    take_plan = search.take_plan
    monkeypatch.setattr(search, "take_plan", take)
    world = SlowWorld(RECORDING, slow="")
    for text in ("visit(1)", "visit(3)", "visit(5)"):
        world.request(text)
    assert world.run() is None
    for slot in ("1", "2", "3"):
        statuses = {one for _, one in shown if one.startswith(f"status({slot},")}
        assert len(statuses) == 1, shown


@pytest.mark.parametrize("mode", [RECORDING, RESET, DYN_RESET])
def test_steps_do_not_run_out(mode: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The plan has more steps than the mode allows, and further goals begin after them."""
    monkeypatch.setitem(STEPS, mode, ["-c", "steps=2"])
    world = SlowWorld(mode, slow="")
    first = world.request("visit(3)")
    assert world.run() is None
    second = world.request("visit(4)")
    assert world.run() is None
    assert [first.words[-1], second.words[-1]] == ["succeeded", "succeeded"]
    assert world.elapsed > 4
