"""Plans stay: what is begun goes first, and who does what changes only for a gain."""

from __future__ import annotations

from pathlib import Path
from typing import List, Tuple

import pytest
from episode import DYN_RESET, RECORDING, RESET
from test_actions import STEPS, write
from test_task_search import ERRANDS

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Result
from rosoclingo.engine.standing import Standing
from rosoclingo.in_process.parts import make_parts
from rosoclingo.in_process.system import System
from rosoclingo.loop.planner.planner import DEFAULT_PATIENCE, Planner
from rosoclingo.loop.values.atoms import Plan

# Of two actuators: 0 and 1 are ways of theirs; 2, 3 and 4, 5 are the same two actions for each.
ACTORS, NAMES = [0, 1, 0, 1, 0, 1], [-1, -1, 0, 0, 1, 1]


def test_what_is_begun_comes_first() -> None:
    standing = Standing([0, 2, 5], ACTORS, NAMES, [[0, 2]])
    assert standing.keeps([0, 2, 5])
    assert standing.keeps([1, 5, 0, 2])
    assert not standing.keeps([4, 0, 2])
    assert not standing.keeps([1, 3, 5])
    assert not standing.keeps([0])
    assert Standing([], ACTORS, NAMES, []).keeps([1, 3])


@pytest.mark.parametrize(
    ("plan", "before", "after", "is_gain"),
    [([0, 2, 5], (9, 9), (9, 8), True),  # the same actuators
     ([0, 3, 5], (9, 9), (8, 12), True),  # one action is another's, for a step
     ([0, 3, 4], (9, 9), (8, 2), False),  # two are
     ([0, 3, 4], (9, 9), (7, 9), True),
     ([0, 3, 4], (9, 9), (9, 8), False)],
)  # fmt: skip
def test_a_change_of_actuators_has_to_gain_something(
    plan: List[int], before: tuple[int, ...], after: tuple[int, ...], is_gain: bool
) -> None:
    standing = Standing([0, 2, 5], ACTORS, NAMES, [])
    assert standing.is_gain(before, after, plan) is is_gain


def on_the_way(folder: Path) -> Planner:
    """Returns a planner whose robot a is on its way to 8, since when b is free, which is nearer."""
    planner = Planner(Engine(Options((write(folder, ERRANDS),), ())), DEFAULT_PATIENCE)
    planner.begin()
    planner.tell(["event(info,at(b,9),0)", "event(info,blocked(8,9),0)", "event(1,visit(8),0)"])
    assert planner.search(0, 10_000, lambda: False).result is Result.SAT
    planner.tell(["event(commit,do(a,go(1)),1)", "event(a,success,1)"])
    planner.tell(["event(info,unblocked(8,9),1)"])
    return planner


def who_looks(plan: Plan, *, after: int) -> List[str]:
    """Returns who looks where, in order, with the first action of each robot."""
    actions = [one for one in plan.actions_from(after) if not one.name.startswith("go")]
    return sorted(f"{one.actuator} {one.name}" for one in actions)


def test_a_better_plan_does_not_drop_an_errand(tmp_path: Path) -> None:
    planner = on_the_way(tmp_path)
    assert planner.search(1, 10_000, lambda: False).result is Result.SAT
    assert planner.improve(1, lambda: False) is None


def test_a_new_request_does_not_drop_an_errand(tmp_path: Path) -> None:
    """It is given to the robot that is free, though another order would cost less."""
    planner = on_the_way(tmp_path)
    planner.tell(["event(2,visit(2),1)"])
    plan = Plan(planner.search(1, 10_000, lambda: False).symbols)
    assert "a look(1)" in who_looks(plan, after=2)
    first = [one.name for one in plan.actions_from(2) if one.actuator == "a"]
    looks = [name for name in first if name.startswith("look")]
    assert looks[0] == "look(1)"


def test_an_errand_that_has_failed_may_be_dropped(tmp_path: Path) -> None:
    planner = Planner(Engine(Options((write(tmp_path, ERRANDS),), ())), DEFAULT_PATIENCE)
    planner.begin()
    planner.tell(["event(info,at(b,9),0)", "event(info,blocked(8,9),0)", "event(1,visit(8),0)"])
    assert planner.search(0, 10_000, lambda: False).result is Result.SAT
    planner.tell(["event(commit,do(a,go(1)),1)", "event(a,failure,1)"])
    planner.tell(["event(info,unblocked(8,9),1)"])
    plan = Plan(planner.search(1, 10_000, lambda: False).symbols)
    assert who_looks(plan, after=2) == ["b look(1)"]


@pytest.mark.parametrize("mode", [RECORDING, RESET, DYN_RESET])
def test_errands_are_kept_in_a_run(mode: str, tmp_path: Path) -> None:
    """A new request on the way does not turn a robot back, after a reset either."""

    done: List[Tuple[str, str]] = []

    class Robots(System):
        """Each answers at once; a new request comes when robot a has gone three places."""

        def publish(self, actuator: str, action: str) -> None:
            super().publish(actuator, action)
            slot = action[len("look(") : -1] if action.startswith("look") else ""
            goal = self.loop.state.goals.occupant(slot)  # a slot is another goal's later
            done.append((actuator, action if goal is None else f"look, {goal.request}"))

        def turn(self) -> bool:
            moves = [action for actor, action in self.published if actor == "a"]
            if len(moves) == 3 and len(self.goals) == 2:
                self.request("visit(1)")
            return super().turn()

    solver = Options((write(tmp_path, ERRANDS),), ("-c", "slots=4"))
    robots = Robots(make_parts(mode, solver, STEPS[mode]).loop, patience=DEFAULT_PATIENCE)
    robots.improves = False
    robots.request("visit(9)")
    robots.request("visit(0)")
    assert robots.run() is None
    assert [goal.words[-1] for goal in robots.goals] == ["succeeded"] * 3
    for robot in "ab":
        moves = [action for actor, action in done if actor == robot]
        for one, two, three in zip(moves, moves[1:], moves[2:]):
            assert not (one == three and two.startswith("go")), moves


def test_a_plan_that_is_not_executed_yet_may_change(tmp_path: Path) -> None:
    planner = Planner(Engine(Options((write(tmp_path, ERRANDS),), ())), DEFAULT_PATIENCE)
    planner.begin()
    planner.tell(["event(info,at(b,9),0)", "event(info,blocked(8,9),0)", "event(1,visit(8),0)"])
    assert planner.search(0, 10_000, lambda: False).result is Result.SAT
    planner.tell(["event(info,unblocked(8,9),0)"])
    assert planner.search(0, 10_000, lambda: False).result is Result.SAT
    better = planner.improve(0, lambda: False)
    assert better is not None
    assert who_looks(Plan(better.symbols), after=1) == ["b look(1)"]
