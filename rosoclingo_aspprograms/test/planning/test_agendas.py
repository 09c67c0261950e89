"""Agendas of many tasks: a first plan at once, better ones soon, and what news changes."""

from __future__ import annotations

import random
import re
import time
from pathlib import Path
from typing import Callable, List, Optional, Sequence, Tuple

import pytest

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Assumed, Improvement, Outcome, Result
from rosoclingo.loop.planner.neighbourhoods import Neighbourhood, says_choices
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.values.atoms import Action, Plan, event

FOLDER = Path(__file__).parents[2] / "mailbot"
SIDE = 8
AT_ONCE = 0.001


class Recording(Engine):
    """A solver that keeps the answer sets that were found."""

    def __init__(self, options: Options) -> None:
        self.found: List[Sequence[str]] = []
        super().__init__(options)

    def solve(
        self,
        assumptions: Sequence[Assumed] = (),
        stopped: Optional[Callable[[], bool]] = None,
        improved: Callable[[Improvement], None] = lambda _: None,
    ) -> Outcome:
        outcome = super().solve(assumptions, stopped, improved)
        self.found.append(outcome.symbols)
        return outcome


class Office:
    """A planner of robots on a grid that is told requests."""

    def __init__(
        self,
        requests: int,
        robots: int,
        folder: Path,
        patience: float,
        *,
        rules: str = "",
        encoding: Path = FOLDER / "mailbot.lp",
    ) -> None:
        more = folder / "robots.lp"
        more.write_text(f"start(robot(N),c(8*N)) :- N = 2..{robots}. {rules}")
        files = [FOLDER / "instances" / "graph_bench.lp", more, encoding]
        constants = ("-c", f"x={SIDE}", "-c", f"y={SIDE}", "-c", f"slots={requests + 1}")
        self.engine = Recording(Options(tuple(map(str, files)), constants))
        self.planner = Planner(self.engine, patience)
        self.planner.begin()
        dice = random.Random(f"{requests} {robots}")
        pairs = [dice.sample(range(1, SIDE**2 + 1), 2) for _ in range(requests + 1)]
        self.pairs = pairs
        self.requests = [f"bring({origin},{destination})" for origin, destination in pairs]

    def tell(self, events: Sequence[Tuple[str, str]], step: int = 0) -> None:
        assert self.planner.tell([event(*pair, step) for pair in events]) == []

    def ask(self, first: int, last: int, step: int = 0) -> None:
        self.tell([(str(slot), self.requests[slot - 1]) for slot in range(first, last + 1)], step)

    def execute(self, plan: Plan, step: int, lost: str = "") -> List[Action]:
        """Has what is planned for a step done; of a robot that is lost, nobody knows."""
        now = plan.actions(step)
        self.tell([("commit", f"do({a.actuator},{a.name})") for a in now], step)
        self.tell([(a.actuator, "unknown" if a.actuator == lost else "success") for a in now], step)
        return now

    def plan(self, step: int = 0) -> Plan:
        outcome = self.planner.search(step, 10_000, lambda: False)
        assert outcome.result is Result.SAT
        return Plan(outcome.symbols)

    def improve(self, seconds: float, step: int = 0) -> Optional[Outcome]:
        end = time.monotonic() + seconds
        return self.planner.improve(step, lambda: time.monotonic() > end)

    @property
    def shown(self) -> Sequence[str]:
        """The first answer set that says its choices."""
        return next(symbols for symbols in self.engine.found if says_choices(symbols))

    @property
    def cost(self) -> Tuple[int, ...]:
        assert self.planner.quality is not None
        return self.planner.quality.cost


def served(plan: Plan) -> List[str]:
    """Returns the requests that are delivered, in order; each is picked up before."""
    actions = [action.name for action in plan.actions_from(0)]
    for slot in [action[len("deliver(") : -1] for action in actions if "deliver" in action]:
        assert actions.index(f"pickup({slot})") < actions.index(f"deliver({slot})")
    return sorted(action for action in actions if "deliver" in action)


@pytest.mark.costly
@pytest.mark.parametrize(("requests", "robots"), [(11, 1), (30, 1), (14, 2), (24, 4)])
def test_a_first_plan_is_improved(requests: int, robots: int, tmp_path: Path) -> None:
    office = Office(requests, robots, tmp_path, AT_ONCE)
    office.ask(1, requests)
    plan = office.plan()
    assert served(plan) == sorted(f"deliver({slot})" for slot in range(1, requests + 1))
    actors = {action.actuator for action in plan.actions_from(0)}
    assert len(actors) == robots  # not one does all
    before = office.cost
    while office.improve(60.0) is None and not office.planner.quality.is_best:  # type: ignore[union-attr]
        pass
    assert office.cost < before
    assert served(office.plan()) == served(plan)


def test_what_is_left_of_a_plan_stays_after_news(tmp_path: Path) -> None:
    office = Office(20, 1, tmp_path, AT_ONCE)
    office.ask(1, 20)
    plan = office.plan()
    begin = [action.name for action in plan.actions_from(0) if "deliver" in action.name]
    (first,) = plan.actions(1)
    office.tell([("commit", f"do({first.actuator},{first.name})")], 1)
    office.ask(21, 21, 1)
    again = office.plan(1)
    assert len(served(again)) == 21
    left = [action.name for action in again.actions_from(0) if "deliver" in action.name]
    left.remove("deliver(21)")
    assert left == begin


def test_a_small_agenda_is_proven_best_as_before(tmp_path: Path) -> None:
    office = Office(10, 1, tmp_path, 60.0)
    office.ask(1, 10)
    assert len(served(office.plan())) == 10
    assert office.planner.quality is not None
    assert office.planner.quality.is_best


@pytest.mark.parametrize("robots", [1, 3])
def test_many_tasks_in_two_regions_are_all_done(robots: int, tmp_path: Path) -> None:
    """What costs little after a task is in its own region, but the robots get to the other one."""
    office = Office(24, robots, tmp_path, AT_ONCE)
    offices = [*range(1, 17, 2), *range(49, 65, 2)]
    pairs = [(place, place + 1) for place in (*offices, *offices[4:12])]
    office.requests = [f"bring({origin},{destination})" for origin, destination in pairs]
    office.ask(1, 24)
    assert len(served(office.plan())) == 24


@pytest.mark.costly
def test_a_restricted_agenda_is_not_proven_best(tmp_path: Path) -> None:
    """With twenty tasks it may be, with more it is not, even if all is searched through."""
    office = Office(21, 1, tmp_path, AT_ONCE)
    office.requests = [f"bring({place},{place + 1})" for place in range(1, 22)]
    office.ask(1, 21)
    office.plan()
    while office.planner.may_improve:
        office.improve(60.0)
    assert office.planner.quality is not None
    assert not office.planner.quality.is_best
    assert office.planner.quality.bound == ()


def test_an_agenda_with_orders_is_not_restricted(tmp_path: Path) -> None:
    rules = "#program present(k,t). before(21,1,k) :- asked(1,O,P,k). #program base."
    office = Office(21, 1, tmp_path, AT_ONCE, rules=rules)
    office.requests = [f"bring({place},{place + 1})" for place in range(1, 22)]
    office.ask(1, 21)
    actions = [action.name for action in office.plan().actions_from(0)]
    assert actions.index("deliver(21)") < actions.index("pickup(1)")


@pytest.mark.costly
def test_what_an_encoding_demands_is_found_among_all_agendas(tmp_path: Path) -> None:
    """Task 1 costs much after task 20, so it may not follow at first; also if that is cut off."""
    rules = """
    #program plan(k).
    :- doable(1,k), doable(20,k), not next(20,1,k), not newer(k).
    """
    office = Office(21, 1, tmp_path, AT_ONCE, rules=rules)
    office.requests = [f"bring({place},{place + 1})" for place in range(1, 22)]
    office.ask(1, 21)
    calls = iter([False])
    outcome = office.planner.search(0, 10_000, lambda: next(calls, True))
    assert outcome.result is Result.UNKNOWN
    for _ in range(2):
        actions = [action.name for action in office.plan().actions_from(0)]
        done = [name for name in actions if not name.startswith("go(")]
        assert done[done.index("deliver(20)") + 1] == "pickup(1)"
        office.improve(0.5)


@pytest.mark.costly
def test_who_does_urgent_tasks_may_be_worth_a_change(tmp_path: Path) -> None:
    """Then no group is critical: a better plan need not relieve the slowest robot."""
    rules = "#program present(k,t). due(1,1,k) :- stop(1,1,O,A,k). #program base."
    for name, rule, critical in (("plain", "", True), ("due", rules, False)):
        folder = tmp_path / name
        folder.mkdir()
        office = Office(12, 3, folder, AT_ONCE, rules=rule)
        office.ask(1, 12)
        office.plan()
        plan = Neighbourhood.of(office.shown)
        assert plan is not None
        assert (len(plan.critical) < len(plan.groups)) is critical


def test_what_is_restricted_is_not_proven_best_without_improving(tmp_path: Path) -> None:
    """Also in an encoding that is searched to the end, and that has no better plan looked for."""
    text = (FOLDER / "mailbot.lp").read_text().replace("../lib", str(FOLDER.parent / "lib"))
    for part in ("improve", "prefer"):
        text = re.sub(rf"#program {part}\(k,t\)\.\n\w+\(k\)\.\n", "", text)
    encoding = tmp_path / "mailbot.lp"
    encoding.write_text(text)
    office = Office(21, 1, tmp_path, 0.0, encoding=encoding)
    office.requests = [f"bring({place},{place + 1})" for place in range(1, 22)]
    office.ask(1, 21)
    assert len(served(office.plan())) == 21
    assert not office.planner.demand.improves
    assert office.planner.quality is not None
    assert not office.planner.quality.is_best
