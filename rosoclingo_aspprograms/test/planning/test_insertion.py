"""Agendas of many tasks that are constructed at once, and what news changes in them.

EPISODES=200 in the environment runs so many random fleets, FULL=1 runs 16.
"""

from __future__ import annotations

import random
from pathlib import Path
from typing import Dict, List

import pytest
from draws import draws
from episode import RECORDING, RESET, SINGLE
from test_agendas import AT_ONCE, Office, served
from test_fleet import Fleet

from rosoclingo.loop import improving
from rosoclingo.loop.planner.planner import DEFAULT_PATIENCE
from rosoclingo.loop.values.atoms import Plan
from rosoclingo.loop.values.journal import Ended, SearchEnded
from rosoclingo_aspprograms.validator import Edge, Map

CONSTRUCTED = "constructed"
MODES = (RECORDING, SINGLE, RESET)
SEEDS = draws([1, 2, 4, 11], 16, "EPISODES")


class Crowd(Fleet):
    """Robots with many requests at the same time, none of which is urgent.

    Every second one of them acts in steps that end when all have answered.

    Attributes:
        constructed: How many plans were constructed.
    """

    def __init__(self, mode: str, seed: int, folder: Path) -> None:
        self.constructed = 0
        self._is_stepwise = seed // 4 % 2 == 0
        self._said: Dict[Edge, int] = {}
        super().__init__(mode, seed, folder)
        self.left = self.pick.randint(12, 16)
        self.loop.state.planner.patience = DEFAULT_PATIENCE

    def draw_map(self, robots: int) -> Map:
        """Returns a random map with so many robots; in steps, all takes equally long."""
        graph = super().draw_map(robots)
        if self._is_stepwise:
            graph.lengths, graph.durations = {}, {}
        return graph

    def options(self) -> List[str]:
        """Returns the planner's options."""
        return ["-c", "slots=16", "-c", "urgent_after=100000"]

    def found_plan(self) -> None:
        """Counts the plans that were constructed."""
        self.constructed += CONSTRUCTED in self.loop.state.plan.symbols

    def _say(self, word: str, edge: Edge) -> None:
        """Says one thing of a way in a step: the validator takes an answer for the end of one."""
        if self._said.get(edge) != self.elapsed:
            super()._say(word, edge)
        self._said[edge] = self.elapsed

    def _ask(self) -> None:
        for _ in range(min(self.left, self.pick.choice([1, 3]) if self.requests else 12)):
            self.left -= 1
            text = "bring({},{})".format(*self.pick.sample(sorted(self.graph.offices), 2))
            self.requests.append(self.request(text))


@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_crowd(seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A better plan is looked for now and then, and an input comes soon, or after a while."""
    left, called, may = random.Random(seed), improving.is_called, improving._may_improve
    monkeypatch.setattr(improving, "is_called", lambda one: left.random() < 0.3 or called(one))
    monkeypatch.setattr(improving, "_may_improve", lambda one: left.random() < 0.1 and may(one))
    crowd = Crowd(MODES[seed % 3], seed, tmp_path)
    crowd._ask()
    failure = crowd.run()
    assert failure is None, failure
    assert crowd.validator.finish() == []
    ways: List[Ended] = [e.event.how for e in crowd.journal if isinstance(e.event, SearchEnded)]
    assert Ended.NOTHING not in ways
    assert crowd.constructed or len(crowd.graph.starts) == 1


def order(plan: Plan) -> List[str]:
    """Returns the requests in the order in which they are delivered."""
    names = [action.name for action in plan.actions_from(0)]
    return [name[len("deliver(") : -1] for name in names if name.startswith("deliver(")]


def is_constructed(plan: Plan) -> bool:
    return CONSTRUCTED in plan.symbols


def test_a_fleets_first_plan_is_constructed_and_then_improved(tmp_path: Path) -> None:
    office = Office(20, 4, tmp_path, DEFAULT_PATIENCE)
    office.ask(1, 20)
    plan = office.plan()
    assert len(served(plan)) == 20
    assert is_constructed(plan)
    assert office.cost == ()  # nobody has computed it
    assert office.planner.may_improve
    while office.improve(60.0) is None:
        pass
    assert office.cost
    better = office.plan()
    assert not is_constructed(better)
    assert len(served(better)) == 20
    steps = [max(action.step for action in one.actions_from(0)) for one in (plan, better)]
    assert steps[1] <= steps[0]


@pytest.mark.parametrize(
    ("requests", "robots", "rules", "patience"),
    [
        (10, 4, "", DEFAULT_PATIENCE),
        (20, 4, "", AT_ONCE),
        (20, 4, "#program present(k,t). before(20,1,k) :- asked(1,O,P,k).", DEFAULT_PATIENCE),
        (20, 4, "#program present(k,t). due(1,5,k) :- asked(1,O,P,k).", DEFAULT_PATIENCE),
        (25, 1, "", DEFAULT_PATIENCE),
    ],
    ids=["few", "patience", "orders", "due", "one robot"],
)
def test_an_agenda_is_searched_for(
    requests: int, robots: int, rules: str, patience: float, tmp_path: Path
) -> None:
    """If it can be found soon, if the user allows the time, or if more counts than the sum."""
    office = Office(requests, robots, tmp_path, patience, rules=f"{rules} #program base.")
    office.ask(1, requests)
    plan = office.plan()
    assert not is_constructed(plan)
    assert office.cost


@pytest.mark.parametrize("robots", [1, 4])
def test_news_change_a_long_plan_only_where_needed(robots: int, tmp_path: Path) -> None:
    """A request is inserted, and one that is canceled is left out; all others stay in order."""
    office = Office(24, robots, tmp_path, DEFAULT_PATIENCE)
    office.ask(1, 24)
    before = order(office.plan())
    office.ask(25, 25)
    plan = office.plan()
    assert is_constructed(plan)
    assert sorted(order(plan)) == sorted([*before, "25"])
    office.tell([("7", "cancel")])
    plan = office.plan()
    assert is_constructed(plan)
    assert sorted(order(plan)) == sorted(one for one in [*before, "25"] if one != "7")


def test_a_way_that_is_closed_is_gone_around(tmp_path: Path) -> None:
    """If what is left of the plan cannot be followed, it is searched for."""
    office = Office(22, 1, tmp_path, DEFAULT_PATIENCE)
    office.ask(1, 22)
    plan = office.plan()
    ways = [action.name[len("go(") : -1] for action in plan.actions_from(0) if "go(" in action.name]
    office.tell([("info", f"blocked({ways[10]},{ways[11]})")])
    again = office.plan()
    assert is_constructed(again)
    assert len(served(again)) == 22


def test_what_an_encoding_demands_is_searched_for(tmp_path: Path) -> None:
    rules = "#program plan(k). :- doable(1,k), doable(2,k), not next(1,2,k), not newer(k)."
    office = Office(24, 3, tmp_path, DEFAULT_PATIENCE, rules=f"{rules} #program base.")
    office.ask(1, 24)
    plan = office.plan()
    assert not is_constructed(plan)
    assert len(served(plan)) == 24
    doers = {action.name: action.actuator for action in plan.actions_from(0)}
    names = [a.name for a in plan.actions_from(0) if a.actuator == doers["deliver(1)"]]
    done = [name for name in names if not name.startswith("go(")]
    assert done[done.index("deliver(1)") + 1] == "pickup(2)"


def test_an_input_leaves_a_better_plan_to_the_next_search(tmp_path: Path) -> None:
    """Its moves are not looked up before the input is dealt with, which may make it needless."""
    office = Office(20, 4, tmp_path, DEFAULT_PATIENCE)
    office.ask(1, 20)
    office.plan()
    ended: List[SearchEnded] = []
    office.planner.note = ended.append
    assert office.planner.improve(0, lambda: True) is None
    assert ended[-1].how is Ended.CHOSEN
    plan = office.plan()
    assert not is_constructed(plan)
    assert len(served(plan)) == 20
    assert office.planner.improve(0, lambda: True) is None
    office.ask(21, 21)
    plan = office.plan()
    assert is_constructed(plan)
    assert len(served(plan)) == 21
