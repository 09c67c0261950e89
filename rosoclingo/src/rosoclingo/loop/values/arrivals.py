"""Estimates when goals will be served, from the plan and the progress of actions. Needs no ROS.

A plan says how long its actions take, and with which one each goal is served. An actuator that acts
is expected to be through when its action should be, and now if that is gone by; what the plan has
it do next comes right after that. Times are in seconds of :meth:`.Environment.world_now`.

>>> plan = Plan((
...     "lasts(do(robot,go(a),1),way,20)", "lasts(do(robot,give,2),give,5)",
...     "expected(1,do(robot,give,2))", "due(1,30)",
... ))
>>> expected_arrivals(plan, 1, [], set(), 100.0)
{'1': 125.0}
>>> go = Execution(1, 1, "robot", "go(a)", world_began=101.0, kind="way", seconds=20)
>>> [expected_arrivals(plan, 1, [go], {go.published}, now) for now in (110.0, 140.0)]
[{'1': 126.0}, {'1': 145.0}]
>>> arrival_lines(145.0, 140.0, 100.0, plan.limits["1"])
['expected in 5 s', 'late by 15 s']
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import Container, Dict, List, Optional, Sequence

from rosoclingo.loop.values.atoms import Action, Plan
from rosoclingo.loop.values.execution import Execution

EXPECTED = "expected"
"""How the line of feedback begins that says when a goal will be served, and what ``~plan`` says."""


@dataclass(frozen=True)
class ExpectedArrival:
    """The time at which a goal is expected to be served.

    Attributes:
        slot: The planner's id for the goal.
        time: When, in seconds of world time.
    """

    slot: str
    time: float

    def __str__(self) -> str:
        return f"{EXPECTED}({self.slot},{round(self.time)})"


def expected_arrivals(
    plan: Plan,
    step: int,
    executions: Sequence[Execution],
    published: Container[Action],
    now: float,
) -> Dict[str, float]:
    """Returns when goals will be served, as far as the plan says that, by their slots.

    Args:
        plan: The plan that stands.
        step: The current step.
        executions: The last one of each actuator.
        published: Which actions were published since the last reset.
        now: What time it is, in seconds of world time.
    """
    doing = {one.actuator: one for one in executions if one.is_open}
    through: Dict[str, float] = defaultdict(lambda: now)
    for actuator, one in doing.items():
        through[actuator] = one.end_after(now)
    ends: Dict[Action, float] = {}
    for action, (_, seconds) in sorted(plan.lasting.items(), key=lambda item: item[0].step):
        if action.step >= step and action not in published:
            through[action.actuator] += seconds
            ends[action] = through[action.actuator]
    found = {}
    for slot, action in plan.serving.items():
        goes_on = doing.get(action.actuator)
        if action in ends:
            found[slot] = ends[action]
        elif goes_on is not None and goes_on.action == action.name and goes_on.kind:
            found[slot] = goes_on.end_after(now)
    return found


def arrival_lines(time: float, now: float, came: float, limit: Optional[int]) -> List[str]:
    """Returns the lines of feedback for a goal that will be served at a time.

    Args:
        time: When it will be served, in seconds of world time.
        now: What time it is, likewise.
        came: When it has come, likewise.
        limit: So many seconds later it is due, by the plan; None if it is not.
    """
    said = [f"{EXPECTED} in {max(0, round(time - now))} s"]
    if limit is not None:
        said.append(f"late by {max(0, round(time - came - limit))} s")
    return said
