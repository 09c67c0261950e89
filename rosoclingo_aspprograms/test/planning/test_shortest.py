"""Plans are as short as those of the encoding by steps, which searches for every move."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Dict, List, Tuple

import pytest
from draws import draws
from episode import BENCH, MAILBOT
from instance_map import InstanceMap

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Result, Truth
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.values.atoms import Plan

BY_STEPS = str(Path(__file__).with_name("mailbot_by_steps.lp"))
SIZES = [(2, 2), (3, 1), (3, 2), (2, 2)]
LONGEST = 60  # steps, which no plan needs


class Draw:
    """A random state in which a planner begins, and what happens in its first step.

    Attributes:
        options: The size of the grid, and the number of slots.
        robots: The robots that the instance lacks, as facts.
        places: Where each robot is.
        loads: What is on a robot.
        ends: Origin and destination of each request.
        free: The edges that are not blocked.
        saved: What was true at the last reset.
        told: What happens in step 0.
    """

    def __init__(self, seed: int) -> None:
        pick = self._pick = random.Random(seed)
        x, y = pick.choice(SIZES)
        graph = InstanceMap.grid(x, y)
        slots = pick.randint(1, 3)
        self.options = ("-c", f"slots={slots}", "-c", f"x={x}", "-c", f"y={y}")
        names = ["mailbot", "second", "third"][: pick.randint(1, 3)]
        waypoints = sorted({waypoint for edge in graph.edges for waypoint in edge})
        self.robots = " ".join(f"start({name},c(1))." for name in names[1:])
        self.places = {name: pick.choice(waypoints) for name in names}
        self.loads: Dict[str, str] = {}
        self.ends: Dict[str, Tuple[str, str]] = {}
        self.saved = [f"event(save,at({r},{place}),0)" for r, place in self.places.items()]
        self.told: List[str] = []
        for slot in range(1, slots + 1):
            self._request(str(slot), *pick.sample(sorted(graph.offices), 2))
        edges = sorted(graph.edges, key=sorted)
        blocked = [edge for edge in edges if pick.random() < 0.12]
        self.free = {edge for edge in edges if edge not in blocked}
        for edge in blocked:
            self.told.append("event(info,blocked({},{}),0)".format(*pick.sample(sorted(edge), 2)))

    def _request(self, slot: str, origin: str, destination: str) -> None:
        pick = self._pick
        kind = pick.choice(["new", "new", "waiting", "carried", "returned", "canceled", "none"])
        idle = [robot for robot in self.places if robot not in self.loads]
        target = origin if kind in ("returned", "canceled") else destination
        self.ends[slot] = (origin, target)
        if kind == "new":
            self.told.append(f"event({slot},bring({origin},{destination}),0)")
        elif kind == "waiting" or (kind != "none" and idle):
            end = target if kind == "canceled" else destination
            fluents = [f"origin({slot},{origin})", f"destination({slot},{end})"]
            if kind != "waiting":
                self.loads[idle[0]] = slot
                fluents.append(f"carries({idle[0]},{slot})")
            if kind == "canceled":
                fluents.append(f"canceled({slot})")
            self.saved += [f"event(save,{fluent},0)" for fluent in fluents]
        if (kind == "returned" and idle) or (kind in ("new", "waiting") and pick.random() < 0.15):
            self.told.append(f"event({slot},cancel,0)")


def _search(planner: Planner, draw: Draw) -> Plan:
    """Plans with a horizon that grows, as the incremental modes do."""
    planner.begin(draw.saved)
    told = draw.told if planner.demand.tells else draw.saved + draw.told
    assert planner.tell(told) == []
    for horizon in range(LONGEST):
        if horizon:
            planner.ground_steps([horizon])
        query = [f"query({horizon})"]
        planner.assign(query, Truth.TRUE)
        outcome = planner.search(0, horizon, lambda: False)
        if outcome.result is Result.SAT:
            return Plan(outcome.symbols)
        planner.assign(query, Truth.FALSE)
    raise AssertionError(f"no plan for {draw.saved} {draw.told}")


def _results(plan: Plan) -> List[Tuple[str, str]]:
    """Returns the statuses of all steps."""
    return sorted(pair for step in range(LONGEST) for pair in plan.statuses(step))


def _replay(plan: Plan, draw: Draw) -> None:
    """Checks that each robot goes along free ways, and does nothing where it is not possible."""
    places, loads = dict(draw.places), dict(draw.loads)
    ends = draw.ends
    for action in plan.actions_from(0):
        robot, (name, _, argument) = action.actuator, action.name.partition("(")
        argument = argument[:-1]
        if name == "go":
            assert frozenset((places[robot], argument)) in draw.free, (action, places)
            places[robot] = argument
        elif name == "pickup":
            assert argument not in loads.values(), (action, loads)
            assert robot not in loads, (action, loads)
            assert places[robot] == ends[argument][0], (action, places)
            loads[robot] = argument
        else:
            assert loads.pop(robot) == argument, (action, loads)
            assert places[robot] == ends.pop(argument)[1], (action, places)
    pairs = [(action.actuator, action.step) for action in plan.actions_from(0)]
    assert len(pairs) == len(set(pairs))


def compare(seed: int, folder: Path) -> int:
    """Compares the plans of both encodings for a random state, and returns their length."""
    draw = Draw(seed)
    robots = folder / "robots.lp"
    robots.write_text(draw.robots)
    new, old = (
        _search(Planner(Engine(Options((BENCH, str(robots), encoding), draw.options))), draw)
        for encoding in (MAILBOT, BY_STEPS)
    )
    last_new, last_old = (max((a.step for a in p.actions_from(0)), default=0) for p in (new, old))
    assert last_new == last_old, (draw.saved, draw.told)
    assert _results(new) == _results(old), (draw.saved, draw.told)
    _replay(new, draw)
    return last_new


@pytest.mark.costly
@pytest.mark.parametrize("seed", draws([2, 5, 6, 8, 11, 14], 40))
def test_a_plan_is_as_short_as_that_of_the_encoding_by_steps(seed: int, tmp_path: Path) -> None:
    compare(seed, tmp_path)
