"""The planning library, with encodings that are not the mailbot."""

from __future__ import annotations

from pathlib import Path
from typing import List, Sequence

import pytest

from rosclingo.engine import Engine, Result
from rosclingo.options import Options
from rosoclingo.atoms import Plan
from rosoclingo.solver import Planner

PLANTS = str(Path(__file__).resolve().parents[2] / "plants" / "plants.lp")
LINE = "tap(0). connection(X,X+1) :- X = 0..9. plant(1..10)."


class Plants(Planner):
    """Plans with the encoding of the robot that waters plants."""

    def __init__(self, folder: Path, *options: str) -> None:
        self.messages: List[str] = []
        file = folder / "line.lp"
        file.write_text(LINE)
        super().__init__(Engine(Options((str(file), PLANTS), options), log=self.messages.append))
        self.begin()

    def plan(self, step: int, events: Sequence[str]) -> List[str]:
        """Returns the actions after a step in which something happens."""
        assert self.tell([f"event({text},{step})" for text in events]) == []
        outcome = self.search(step, 1000, lambda: False)
        assert outcome.result is Result.SAT
        assert self.messages == []
        return [action.name for action in Plan(outcome.symbols).actions_from(step + 1)]


def test_all_plants_are_watered_in_the_best_order(tmp_path: Path) -> None:
    planner = Plants(tmp_path)
    plan = planner.plan(0, ["1,water(3)", "2,water(1)"])
    assert plan == ["go(1)", "water(2)", "go(2)", "go(3)", "water(1)"]
    assert planner.needed == 5


def test_the_tank_is_filled_when_it_is_empty(tmp_path: Path) -> None:
    planner = Plants(tmp_path, "-c", "full=1")
    plan = planner.plan(0, ["1,water(1)", "2,water(2)"])
    there_and_back = ["go(2)", "go(1)"]
    assert plan in (
        ["go(1)", *there_and_back[:1], "water(2)", "go(1)", "go(0)", "fill", "go(1)", "water(1)"],
        ["go(1)", "water(1)", "go(0)", "fill", "go(1)", "go(2)", "water(2)"],
    )
    assert len(plan) == 7


def test_a_failure_in_the_same_step_is_planned_for_anew(tmp_path: Path) -> None:
    planner = Plants(tmp_path)
    assert planner.plan(0, ["1,water(1)"]) == ["go(1)", "water(1)"]
    commit = ["commit,do(robot,go(1))"]
    assert planner.plan(1, [*commit, "2,water(2)"]) == ["water(1)", "go(2)", "water(2)"]
    assert planner.plan(1, ["robot,failure"]) == ["go(1)", "water(1)", "go(2)", "water(2)"]


def test_a_status_is_taken_back_when_its_action_fails(tmp_path: Path) -> None:
    planner = Plants(tmp_path)
    planner.plan(0, ["1,water(1)"])
    planner.plan(1, ["commit,do(robot,go(1))"])
    planner.plan(2, ["commit,do(robot,water(1))", "2,water(2)"])
    assert planner.plan(2, ["robot,failure"]) == ["water(1)", "go(2)", "water(2)"]
    outcome = planner.search(2, 1000, lambda: False)
    assert Plan(outcome.symbols).statuses(2) == [("2", "accepted")]


@pytest.mark.parametrize("count", [3, 4, 5, 7])
def test_a_full_tank_serves_three_plants(count: int, tmp_path: Path) -> None:
    planner = Plants(tmp_path)
    plan = planner.plan(0, [f"{number},water({number})" for number in range(1, count + 1)])
    assert plan.count("fill") == (count - 1) // 3
    assert len([action for action in plan if action.startswith("water")]) == count
