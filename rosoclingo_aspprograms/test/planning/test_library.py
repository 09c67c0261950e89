"""The planning library, with encodings that are not the mailbot."""

from __future__ import annotations

import random
from itertools import product
from pathlib import Path
from typing import Dict, List, Sequence, Tuple

import pytest
from draws import variants
from episode import FIXED, INCREMENTAL, RESET, SINGLE, Episode
from instance_map import InstanceMap

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Result
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.values.atoms import Plan

FOLDER = Path(__file__).resolve().parents[2] / "plants"
PLANTS = str(FOLDER / "plants.lp")
GARDEN = (FOLDER / "instances" / "garden.lp").read_text()
LINE = "tap(0). start(0). connection(X,X+1) :- X = 0..9. plant(1..10)."


class Plants(Planner):
    """Plans with the encoding of the robot that waters plants.

    Attributes:
        messages: What clingo has warned of.
        statuses: The statuses of the goals in the step of the last plan.
        symbols: The answer set of the last plan.
    """

    statuses: Sequence[Tuple[str, str]]
    symbols: Sequence[str]

    def __init__(self, folder: Path, *options: str, facts: str = LINE, seconds: float = 0) -> None:
        self.messages: List[str] = []
        file = folder / "instance.lp"
        file.write_text(facts)
        engine = Engine(Options((str(file), PLANTS), options), log=self.messages.append)
        super().__init__(engine, seconds)
        self.begin()

    def plan(self, step: int, events: Sequence[str]) -> List[str]:
        """Returns the actions after a step in which something happens."""
        assert self.tell([f"event({text},{step})" for text in events]) == []
        outcome = self.search(step, 10_000, lambda: False)
        assert outcome.result is Result.SAT
        assert outcome.interrupted <= bool(self.patience)
        assert self.messages == []
        self.statuses = Plan(outcome.symbols).statuses(step)
        self.symbols = outcome.symbols
        return [action.name for action in Plan(outcome.symbols).actions_from(step + 1)]


def test_the_skeleton_in_the_readme(tmp_path: Path) -> None:
    readme = (FOLDER.parent / "README.md").read_text()
    skeleton = readme.partition("```prolog\n")[2].partition("```")[0]
    file = tmp_path / "visits.lp"
    file.write_text(f"place(1..6). start(1). connection(1..6,1..6). {skeleton}")
    library = str(FOLDER.parent / "lib" / "agenda.lp")
    messages: List[str] = []
    planner = Planner(Engine(Options((str(file), library)), log=messages.append))
    planner.begin()
    assert planner.tell(["event(1,visit(4),0)", "event(2,visit(2),0)"]) == []
    plan = Plan(planner.search(0, 10, lambda: False).symbols)
    assert messages == []
    assert plan.statuses(0) == [("1", "accepted"), ("2", "accepted")]
    names = [action.name for action in plan.actions_from(1)]
    assert sorted(names) == ["go(2)", "go(4)", "see(1)", "see(2)"]


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
    anew = ["robot,failure", "info,unblocked(1,0)"]
    assert planner.plan(1, anew) == ["go(1)", "water(1)", "go(2)", "water(2)"]


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


def test_statuses_say_what_becomes_of_a_request(tmp_path: Path) -> None:
    planner = Plants(tmp_path)
    planner.plan(0, ["1,water(1)", "2,water(2)", "3,water(3)", "3,cancel"])
    assert planner.statuses == [("1", "accepted"), ("2", "accepted"), ("3", "canceled")]
    planner.plan(1, ["commit,do(robot,go(1))"])
    assert planner.plan(1, ["2,cancel"]) == ["water(1)"]
    assert planner.statuses == [("2", "canceled")]
    planner.plan(2, ["commit,do(robot,water(1))"])
    planner.plan(2, ["1,cancel"])
    assert planner.statuses == [("1", "succeeded")]


def test_a_failed_action_is_tried_again_but_for_a_move(tmp_path: Path) -> None:
    ring = LINE + " connection(0,11). connection(11,2)."
    planner = Plants(tmp_path, "-c", "full=1", facts=ring)
    planner.plan(0, ["1,water(2)"])
    assert planner.plan(1, ["commit,do(robot,go(1))", "robot,failure"]) == [
        "go(11)",
        "go(2)",
        "water(1)",
    ]
    planner.plan(2, ["commit,do(robot,go(11))"])
    planner.plan(3, ["commit,do(robot,go(2))"])
    assert planner.plan(4, ["commit,do(robot,water(1))", "robot,failure"]) == ["water(1)"]
    planner.plan(5, ["commit,do(robot,water(1))", "2,water(2)"])
    assert planner.plan(6, ["commit,do(robot,go(11))"])[:2] == ["go(0)", "fill"]
    planner.plan(7, ["commit,do(robot,go(0))"])
    plan = planner.plan(8, ["commit,do(robot,fill)", "robot,failure"])
    assert plan == ["fill", "go(11)", "go(2)", "water(2)"]


def test_who_is_cut_off_waits_and_so_does_who_lacks_water(tmp_path: Path) -> None:
    planner = Plants(tmp_path, "-c", "full=1")
    planner.plan(0, ["1,water(1)", "2,water(2)"])
    planner.plan(1, ["commit,do(robot,go(1))"])
    assert planner.plan(1, ["info,blocked(1,0)"]) == ["water(1)"]
    assert planner.plan(1, ["info,blocked(1,2)"]) == ["water(1)"]
    planner.plan(2, ["commit,do(robot,water(1))"])
    assert planner.plan(2, ["info,unblocked(1,2)"]) == []
    assert planner.plan(2, ["info,unblocked(0,1)"]) == [
        "go(0)",
        "fill",
        "go(1)",
        "go(2)",
        "water(2)",
    ]


def test_the_tank_is_saved_over_a_reset(tmp_path: Path) -> None:
    planner = Plants(tmp_path, "-c", "full=2")
    planner.plan(0, ["1,water(1)", "2,water(2)", "3,water(3)"])
    planner.plan(1, ["commit,do(robot,go(1))"])
    planner.plan(2, ["commit,do(robot,water(1))"])
    now = [symbol for symbol in planner.symbols if symbol.startswith("holds(") and ",2)" in symbol]
    saved = [f"event(save,{symbol[6:-3]},0)" for symbol in now]
    assert "event(save,tank(1),0)" in saved
    planner.begin(saved)
    plan = planner.plan(0, [])
    assert len(plan) == 7
    assert plan.count("fill") == 1


class Garden:
    """Random plants in the garden, with a tap in the corner."""

    def __init__(self, seed: int, count: int, full: int, folder: Path, seconds: float = 0) -> None:
        places = list(product(range(1, 11), range(1, 11)))
        self.plants = random.Random(seed).sample(places, count)
        self.full = full
        options = ("-c", f"slots={count}", "-c", f"full={full}")
        self.planner = Plants(folder, *options, facts=GARDEN, seconds=seconds)

    def plan(self) -> List[str]:
        """Plans to water all plants, and checks that this is possible."""
        events = [f"{slot},water(({x},{y}))" for slot, (x, y) in enumerate(self.plants, 1)]
        plan = self.planner.plan(0, events)
        place, tank, watered = (1, 1), self.full, []
        for action in plan:
            name, _, rest = action.partition("(")
            if name == "go":
                x, y = (int(number) for number in rest.strip("()").split(","))
                assert abs(x - place[0]) + abs(y - place[1]) == 1
                place = (x, y)
            elif name == "fill":
                assert place == (1, 1)
                tank = self.full
            else:
                assert place == self.plants[int(rest[:-1]) - 1]
                tank -= 1
                assert tank >= 0
                watered.append(place)
        assert sorted(watered) == sorted(self.plants)
        return plan

    def shortest(self) -> int:
        """Returns the length of the shortest plan, by what is watered, the place and the tank."""
        best: Dict[Tuple[int, int, int], int] = {(0, -1, self.full): 0}
        everything = 2 ** len(self.plants) - 1
        results = []
        for watered in range(everything + 1):
            for (mask, last, tank), length in [i for i in best.items() if i[0][0] == watered]:
                if mask == everything:
                    results.append(length)
                here = self.plants[last] if last >= 0 else (1, 1)
                for number, there in enumerate(self.plants):
                    if mask & 1 << number:
                        continue
                    direct = (length + _distance(here, there) + 1, tank - 1)
                    around = _distance(here, (1, 1)) + 1 + _distance((1, 1), there)
                    for longer, left in (direct, (length + around + 1, self.full - 1)):
                        state = (mask | 1 << number, number, left)
                        if left >= 0:
                            best[state] = min(longer, best.get(state, longer))
            for state in [state for state in best if state[0] == watered]:
                del best[state]
        return min(results)


def _distance(one: Tuple[int, int], other: Tuple[int, int]) -> int:
    return abs(one[0] - other[0]) + abs(one[1] - other[1])


@pytest.mark.costly
@pytest.mark.parametrize(("seed", "full"), [(1, 3), (2, 3), (3, 3), (4, 2), (5, 4)])
def test_eight_plants_are_watered_as_quickly_as_possible(
    seed: int, full: int, tmp_path: Path
) -> None:
    garden = Garden(seed, 8, full, tmp_path)
    assert len(garden.plan()) == garden.shortest()


def test_a_plan_for_ten_plants_is_proven_best(tmp_path: Path) -> None:
    Garden(1, 10, 3, tmp_path).plan()


@pytest.mark.costly
@pytest.mark.parametrize("full", [3, 5])
def test_there_is_a_plan_for_fifty_plants(full: int, tmp_path: Path) -> None:
    Garden(1, 50, full, tmp_path, seconds=0.01).plan()


@pytest.mark.costly
@pytest.mark.parametrize("mode", variants([FIXED, RESET, SINGLE], [FIXED, *INCREMENTAL]))
def test_plants_are_watered_in_all_modes(mode: str) -> None:
    encoding = [str(FOLDER / "instances" / "garden.lp"), PLANTS]
    # The validator knows mailbots only; it is not asked for what it says of plants.
    episode = Episode(mode, InstanceMap.grid(2, 2), encoding, options=["-c", "full=2"])
    goals = [episode.request(f"water(({x},{y}))") for x, y in [(2, 3), (3, 3), (1, 4), (2, 2)]]
    unknown = episode.request("water((99,1))")
    assert episode.play() is None
    assert [goal.words for goal in goals] == [["accepted", "succeeded"]] * len(goals)
    assert unknown.words == ["rejected"]
    assert episode.warnings == []
    tank = 2
    for action in episode.actions:
        tank = 2 if action == "fill" else tank - action.startswith("water")
        assert tank >= 0
