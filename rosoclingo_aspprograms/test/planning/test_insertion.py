"""Agendas of many tasks that are constructed at once, and what news changes in them.

EPISODES=200 in the environment runs so many random fleets, FULL=1 runs 16.
"""

from __future__ import annotations

import random
import re
from pathlib import Path
from typing import Dict, List, Set, Tuple

import pytest
from draws import draws
from episode import RECORDING, RESET, SINGLE
from instance_map import InstanceMap
from test_agendas import AT_ONCE, SIDE, Office, served
from test_fleet import Fleet

from rosclingo.wire.commands import Result
from rosoclingo.loop import improving
from rosoclingo.loop.journal import Ended, SearchEnded
from rosoclingo.loop.planner.planner import DEFAULT_PATIENCE
from rosoclingo.loop.values.atoms import Plan
from rosoclingo.loop.values.recorded import Recorded
from rosoclingo_aspprograms.validator import Edge

CONSTRUCTED = "constructed"
MODES = (RECORDING, SINGLE, RESET)
SEEDS = draws([1, 11, 12], 16, "EPISODES")  # each mode; in steps, and in seconds


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
        self.doubts = self.pick.choice([0.0, 0.3])
        self.loop.state.planner.patience = DEFAULT_PATIENCE

    def draw_map(self, robots: int) -> InstanceMap:
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


@pytest.mark.costly
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
    assert crowd.constructed or len(crowd.graph.starts) == 1


def order(plan: Plan) -> List[str]:
    """Returns the requests in the order in which they are delivered."""
    names = [action.name for action in plan.actions_from(0)]
    return [name[len("deliver(") : -1] for name in names if name.startswith("deliver(")]


def orders(plan: Plan) -> Dict[str, List[str]]:
    """Returns that for each robot."""
    served: Dict[str, List[str]] = {}
    for action in plan.actions_from(0):
        if action.name.startswith("deliver("):
            served.setdefault(action.actuator, []).append(action.name[len("deliver(") : -1])
    return served


def without(slots: List[str], slot: str) -> List[str]:
    return [one for one in slots if one != slot]


def around(region: Set[int]) -> List[Tuple[str, str]]:
    """Returns what says that all corridors are blocked that lead out of a region."""
    nodes = range(1, SIDE**2 + 1)
    ways = [(a, a + 1) for a in nodes if a % SIDE] + [(a, a + SIDE) for a in nodes[:-SIDE]]
    out = [(a, b) for a, b in ways if (a in region) != (b in region)]
    return [("info", f"blocked(c({a}),c({b}))") for a, b in out]


def is_constructed(plan: Plan) -> bool:
    return CONSTRUCTED in plan.symbols


@pytest.mark.costly
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


@pytest.mark.costly
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


@pytest.mark.costly
@pytest.mark.parametrize("robots", [1, 4])
def test_news_change_a_long_plan_only_where_needed(robots: int, tmp_path: Path) -> None:
    """A request is inserted, and one that is canceled is left out; all others stay as they are."""
    office = Office(24, robots, tmp_path, DEFAULT_PATIENCE)
    office.ask(1, 24)
    before = orders(office.plan())
    office.ask(25, 25)
    plan = office.plan()
    assert is_constructed(plan)
    inserted = orders(plan)
    assert sum(one.count("25") for one in inserted.values()) == 1
    assert {who: without(one, "25") for who, one in inserted.items()} == before
    office.tell([("7", "cancel")])
    plan = office.plan()
    assert is_constructed(plan)
    assert orders(plan) == {who: without(one, "7") for who, one in inserted.items()}


@pytest.mark.costly
def test_an_input_while_parts_are_grounded_changes_no_more(tmp_path: Path) -> None:
    """A search that an input ends before it has found an agenda leaves the one before."""
    office = Office(24, 4, tmp_path, DEFAULT_PATIENCE)
    office.ask(1, 23)
    before = orders(office.plan())
    office.ask(24, 24)
    calls = iter([False])
    outcome = office.planner.search(0, 10_000, lambda: next(calls, True))
    assert outcome.result is Result.UNKNOWN
    office.ask(25, 25)
    plan = orders(office.plan())
    assert {who: without(without(one, "24"), "25") for who, one in plan.items()} == before


@pytest.mark.costly
@pytest.mark.parametrize("robots", [1, 3])
def test_a_robot_that_cannot_deliver_picks_up_nothing_else(robots: int, tmp_path: Path) -> None:
    office = Office(24, robots, tmp_path, DEFAULT_PATIENCE)
    office.ask(1, 24)
    first = order(office.plan())[0]
    _, destination = office.pairs[int(first) - 1]
    step, plan = 1, office.plan()
    robot = next(a.actuator for a in plan.actions_from(0) if a.name == f"pickup({first})")
    while True:
        if any(a.name == f"pickup({first})" for a in office.execute(plan, step)):
            break
        step, plan = step + 1, office.plan(step)
    office.tell([("info", f"blocked({destination},c({destination}))")], step)
    done = [a.name for a in office.plan(step).actions_from(step + 1) if a.actuator == robot]
    assert not any(name.startswith("pickup(") for name in done)


def test_tasks_in_a_row_that_cannot_be_done_keep_no_other_from_being_done(tmp_path: Path) -> None:
    office = Office(24, 1, tmp_path, DEFAULT_PATIENCE)
    office.ask(1, 24)
    closed = {office.pairs[int(slot) - 1][0] for slot in order(office.plan())[:2]}
    office.tell([("info", f"blocked({place},c({place}))") for place in sorted(closed)])
    rest = [n for n, pair in enumerate(office.pairs[:24], 1) if not closed & set(pair)]
    assert sorted(map(int, order(office.plan()))) == rest


@pytest.mark.costly
def test_what_a_lost_robot_carries_nobody_else_delivers(tmp_path: Path) -> None:
    office = Office(24, 3, tmp_path, DEFAULT_PATIENCE)
    office.ask(1, 24)
    step, plan, carried = 1, office.plan(), ""
    while not carried:
        picked = [a for a in office.execute(plan, step) if a.name.startswith("pickup(")]
        if picked:
            robot, carried = picked[0].actuator, picked[0].name[len("pickup(") : -1]
        step, plan = step + 1, office.plan(step)
    office.execute(plan, step, lost=robot)
    after = office.plan(step)
    assert is_constructed(after)
    assert carried not in order(after)


@pytest.mark.costly
@pytest.mark.parametrize("last", ["pickup", "go"])
def test_what_a_trapped_robot_was_to_do_others_do(last: str, tmp_path: Path) -> None:
    """Without a search, also after further news; but for what is in the same place."""
    office = Office(24, 3, tmp_path, DEFAULT_PATIENCE)
    office.ask(1, 22)
    step, plan, done = 1, office.plan(), re.compile(rf"{last}\((\d+)\)")
    trapped: List[Tuple[str, int]] = []
    while not trapped:
        found = [(a.actuator, done.fullmatch(a.name)) for a in office.execute(plan, step)]
        trapped = [(robot, int(match[1])) for robot, match in found if match]
        step, plan = step + 1, office.plan(step)
    robot, place = trapped[0]
    if last == "pickup":
        place = office.pairs[place - 1][0]
    before = orders(plan)
    assert len(before[robot]) > 1
    for news in [("info", f"blocked({place},c({place}))"), ("23", office.requests[22])]:
        office.tell([news], step - 1)
        plan = office.plan(step - 1)
        assert is_constructed(plan)
        assert robot not in orders(plan)
        assert {slot for slots in before.values() for slot in slots} - {*order(plan)} <= {
            str(n) for n, pair in enumerate(office.pairs, 1) if place in pair
        }
    assert "23" in order(plan)


def test_a_better_plan_is_shown_soon_after_news(tmp_path: Path) -> None:
    """Also if no plan was searched for, from which on it would be counted anew."""
    office = Office(20, 4, tmp_path, DEFAULT_PATIENCE)
    office.ask(1, 19)
    office.plan()
    neighbourhoods = office.planner._neighbourhoods
    soon = neighbourhoods.until_shown()
    assert neighbourhoods.until_shown() == 2 * soon
    office.ask(20, 20)
    assert is_constructed(office.plan())
    assert neighbourhoods.until_shown() == soon


def test_a_way_that_is_closed_is_gone_around(tmp_path: Path) -> None:
    office = Office(22, 1, tmp_path, DEFAULT_PATIENCE)
    office.ask(1, 22)
    plan = office.plan()
    ways = [action.name[len("go(") : -1] for action in plan.actions_from(0) if "go(" in action.name]
    # There is another one, unless it is that to an office.
    here, there = next(two for two in zip(ways[10:], ways[11:]) if all("c(" in way for way in two))
    office.tell([("info", f"blocked({here},{there})")])
    again = office.plan()
    assert is_constructed(again)
    assert len(served(again)) == 22


@pytest.mark.costly
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


@pytest.mark.costly
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
    assert office.planner.quality == ended[0].quality
    assert office.planner.may_improve
    assert office.planner.improve(0, lambda: True) is None
    office.ask(21, 21)
    plan = office.plan()
    assert is_constructed(plan)
    assert len(served(plan)) == 21


@pytest.mark.costly
def test_a_search_that_is_relaxed_is_in_a_replay(tmp_path: Path) -> None:
    """Its outcome is recorded, too, so that a replay's searches have the same numbers."""
    noted: List[Tuple[int, SearchEnded]] = []
    searches: List[int] = []
    closed: List[Tuple[str, str]] = []
    for name in ("recorded", "replayed"):
        folder = tmp_path / name
        folder.mkdir()
        office = Office(24, 1, folder, DEFAULT_PATIENCE)
        recorded = Recorded(noted, {}, knows_searches=True)
        if name == "replayed":
            office.planner.recorded = recorded
        else:
            office.planner.note = lambda event: noted.append((recorded.decision, event))  # noqa: B023
        recorded.decision = 0
        office.ask(1, 22)
        first = order(office.plan())
        if not closed:
            place = office.pairs[int(first[1]) - 1][0]
            closed = around({place, place + 1 if place % SIDE else place - 1})
        recorded.decision = 1
        office.tell(closed)
        office.ask(23, 23)
        office.plan()
        recorded.decision = 2
        office.ask(24, 24)
        assert served(office.plan())
        searches.append(office.planner.demand.searches)
    assert Ended.REFUTED in [event.how for _, event in noted]
    assert searches[0] == searches[1]
