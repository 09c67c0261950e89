"""Times a plan by the seconds that its actions take, and estimates when goals will be served.

A plan says how long its actions take, and with which one each goal is served. An actuator that acts
is expected to be through when its action should be, and now if that is gone by. What the plan has
it do next begins right after that, and after the actions of others that it awaits. Needs no ROS.
Times are in seconds of :meth:`.Environment.world_now`.

>>> plan = Plan((
...     "do(cook,boil,1)", "lasts(do(cook,boil,1),boil,60)", "do(robot,go(a),1)",
...     "lasts(do(robot,go(a),1),way,20)", "do(cook,boil,2)", "do(robot,give,3)",
...     "lasts(do(robot,give,3),give,5)", "awaits(do(robot,give,3),do(cook,boil,2))",
...     "expected(1,do(robot,give,3))", "due(1,30)",
... ))
>>> spans = planned_spans(plan, 1, [], set(), 100.0)
>>> [(span.name, span.begins, span.ends) for span in spans]
[('boil', 100.0, 160.0), ('go(a)', 100.0, 120.0), ('give', 160.0, 165.0)]
>>> expected_arrivals(plan, spans)
{'1': 165.0}
>>> go = Execution(1, 1, "robot", "go(a)", world_began=101.0, kind="way", seconds=20)
>>> boil = Execution(2, 1, "cook", "boil", world_began=101.0, kind="boil", seconds=60)
>>> published = {go.published, boil.published}
>>> [planned_spans(plan, 1, [go, boil], published, now)[-1].ends for now in (110.0, 170.0)]
[166.0, 175.0]
>>> arrival_lines(145.0, 140.0, 100.0, plan.limits["1"])
['expected in 5 s', 'late by 15 s']
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Container, Dict, List, Optional, Sequence, Tuple, Union

from rosoclingo.loop.values.atoms import Action, Plan
from rosoclingo.loop.values.execution import Execution
from rosoclingo.loop.words import EXPECTED, TIMED


@dataclass(frozen=True)
class SaidTime:
    """A time in ``~plan``: when a goal is expected to be served or is due, or the current time.

    Attributes:
        word: Which one: ``EXPECTED``, ``DUE`` or ``NOW``.
        time: In seconds of world time.
        slot: The planner's id for the goal, if it is about one.
    """

    word: str
    time: float
    slot: str = ""

    def __str__(self) -> str:
        arguments = [self.slot] if self.slot else []
        return f"{self.word}({','.join([*arguments, str(round(self.time))])})"


@dataclass(frozen=True)
class PlannedSpan:
    """The time of an action that is planned or under way.

    Attributes:
        actuator: Who does it.
        name: The action.
        first: Its first step, from the current one on.
        last: Its last step.
        begins: When it begins or has begun, in seconds of world time.
        ends: When it is expected to end, in seconds of world time.
    """

    actuator: str
    name: str
    first: int
    last: int
    begins: float
    ends: float

    def __str__(self) -> str:
        action = Action(self.actuator, self.name, self.first)
        return f"{TIMED}({action},{round(self.begins)},{round(self.ends)})"


PlanTime = Union[SaidTime, PlannedSpan]
"""A term about times in ``~plan``."""


def planned_spans(
    plan: Plan,
    step: int,
    executions: Sequence[Execution],
    published: Container[Action],
    now: float,
    *,
    clock: Optional[float] = None,
) -> List[PlannedSpan]:
    """Returns when the actions of a plan begin and end, as far as it says how long they take.

    Args:
        plan: The plan that stands.
        step: The current step.
        executions: The last one of each actuator.
        published: Which actions were published since the last reset.
        now: What time it is, in seconds of world time.
        clock: When the clock that the encoding is told began, in seconds of world time; None if it
            is not told the time, and what it says of when actions begin does not count.

    Returns:
        The actions under way and those that are planned, in the order in which they begin.
    """
    doing = {one.actuator: one for one in executions if one.is_open}
    lasts = _last_steps(plan, step)
    free: Dict[str, float] = {}  # when an actuator is through
    ends: Dict[Action, float] = {}  # by each step of an action
    spans: List[PlannedSpan] = []

    def add(span: PlannedSpan) -> None:
        spans.append(span)
        free[span.actuator] = span.ends
        for one in range(span.first, span.last + 1):
            ends[Action(span.actuator, span.name, one)] = span.ends

    for actuator, one in doing.items():
        first = next((action for action in lasts if action.actuator == actuator), None)
        under_way = first if first is not None and first.name == one.action else None
        last = step if under_way is None else lasts.pop(under_way)
        free[actuator] = one.end_after(now)
        if one.kind:
            began = now if one.is_held else one.world_began
            add(PlannedSpan(actuator, one.action, step, last, began, free[actuator]))
    for action, last in lasts.items():
        seconds = plan.lasting.get(action, ("", None))[1]
        if seconds is None or action in published:
            continue
        before = [ends.get(other, now) for other in plan.awaits.get(action, ())]
        if clock is not None and action in plan.begins:
            before.append(clock + plan.begins[action])
        begins = max([free.get(action.actuator, now), *before])
        add(PlannedSpan(action.actuator, action.name, action.step, last, begins, begins + seconds))
    return sorted(spans, key=lambda span: span.begins)


def _last_steps(plan: Plan, step: int) -> Dict[Action, int]:
    """Returns the last step of each action from a step on, in the order of their first steps."""
    lasts: Dict[Action, int] = {}
    before: Dict[str, Action] = {}  # the first step of each actuator's last action
    for action in plan.actions_from(step):
        first = before.get(action.actuator)
        goes_on = first is not None and first.name == action.name
        if first is None or not goes_on or action in plan.lasting or lasts[first] < action.step - 1:
            first = before[action.actuator] = action
        lasts[first] = action.step
    return lasts


def expected_arrivals(plan: Plan, spans: Sequence[PlannedSpan]) -> Dict[str, float]:
    """Returns when goals will be served, as far as the plan says that, by their slots.

    Args:
        plan: The plan that stands.
        spans: The times of its actions, by :func:`planned_spans`.
    """
    found = {}
    for slot, action in plan.serving.items():
        deed: Tuple[str, str] = (action.actuator, action.name)
        same = [span for span in spans if (span.actuator, span.name) == deed]
        # What is under way may have begun to serve it in a step before.
        fitting = [span for span in same if action.step <= span.last]
        if fitting:
            found[slot] = fitting[0].ends
    return found


def arrival_lines(time: float, now: float, came: float, limit: Optional[int]) -> List[str]:
    """Returns the lines of feedback for a goal that will be served at a time.

    Args:
        time: When it will be served, in seconds of world time.
        now: The present, in seconds of world time.
        came: When it has come, in seconds of world time.
        limit: So many seconds later it is due, by the plan; None if it is not.
    """
    said = [f"{EXPECTED} in {max(0, round(time - now))} s"]
    if limit is not None:
        said.append(f"late by {max(0, round(time - came - limit))} s")
    return said
