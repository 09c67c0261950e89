"""Deadlines of goals and the last plan in a report, from the times in ``~plan``.

``~plan`` counts in ROS's time, which may go faster or slower than the recording's.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Dict, Iterable, List, Sequence, Tuple

from rosoclingo.bags.report.run import PLANNED, GoalRun
from rosoclingo.bags.run_model import TrackedAction
from rosoclingo.loop.values.plan_times import PlanTimes, TimedPlans

_LEAST_SECONDS = 10.0  # of ROS's time, from which its speed follows
_SAME = 0.05  # so much may a speed differ from 1 because times are said in whole seconds


def in_recording(plans: TimedPlans) -> List[Tuple[float, PlanTimes]]:
    """Returns the times of plans in the recording's seconds; only of plans that say some.

    Args:
        plans: What was said, each with when, in the recording's seconds.
    """
    said = [(seconds, times.now, times) for seconds, times in plans if times.now is not None]
    rate = 1.0
    if said and said[-1][1] - said[0][1] >= _LEAST_SECONDS:
        rate = (said[-1][0] - said[0][0]) / (said[-1][1] - said[0][1])
        rate = 1.0 if abs(rate - 1) < _SAME else max(0.0, rate)
    return [(seconds, times.moved(now, seconds, rate)) for seconds, now, times in said]


def with_times(
    goals: Sequence[GoalRun], plans: Sequence[Tuple[float, PlanTimes]]
) -> Tuple[GoalRun, ...]:
    """Adds to goals when they are due, and to open ones when they are expected.

    Args:
        goals: The goals.
        plans: The times of plans, in order, by :func:`in_recording`.
    """
    by_slot: Dict[str, List[GoalRun]] = {}
    for goal in sorted(goals, key=lambda goal: (goal.accepted is None, goal.accepted or goal.came)):
        by_slot.setdefault(goal.slot, []).append(goal)
    due: Dict[str, float] = {}
    for seconds, times in plans:
        for slot, time in times.due.items():
            goal_then = _goal_at(by_slot.get(slot, ()), seconds)
            due.setdefault(goal_then, time)
    expected = plans[-1][1].expected if plans else {}
    return tuple(
        replace(
            goal,
            due=due.get(goal.id),
            expected=expected.get(goal.slot) if goal.ended is None else None,
        )
        for goal in goals
    )


def _goal_at(goals: Sequence[GoalRun], seconds: float) -> str:
    """Returns the id of the goal that had a slot at a time; empty if there was none.

    Args:
        goals: All that ever had the slot, in the order of their acceptance. A goal has its slot,
            and a plan, shortly before that.
        seconds: The time.
    """
    found = ""
    for goal in goals:
        is_there = goal.came <= seconds and (goal.ended is None or goal.ended >= seconds)
        is_accepted = goal.accepted is not None and goal.accepted <= seconds
        if is_there and (is_accepted or not found):
            found = goal.id
    return found


def planned_rest(
    actions: Iterable[TrackedAction], plans: Sequence[Tuple[float, PlanTimes]], ended: float
) -> Tuple[TrackedAction, ...]:
    """Returns the rest of the plan that stands at the end, as actions with the answer ``planned``.

    Args:
        actions: What was done.
        plans: The times of plans, in order, by :func:`in_recording`.
        ended: When the recording ended.
    """
    if not plans:
        return ()
    since, times = plans[-1]
    through = {
        (action.actuator, action.name)
        for action in actions
        if action.ended is not None and action.ended >= since
    }
    return tuple(
        TrackedAction(
            number, one.actuator, one.name, one.step, max(one.begins, ended), one.ends, PLANNED
        )
        for number, one in enumerate(sorted(times.actions, key=lambda one: one.begins), 1)
        if one.ends > ended and (one.actuator, one.name) not in through
    )
