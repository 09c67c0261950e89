"""Estimates when goals will be served, from the plan and the progress of actions. Needs no ROS.

A plan says how long its actions take, and with which one each goal is served. An actuator that acts
is expected to be through when its action should be, and now if that is gone by; what the plan has
it do next comes right after that. Times are in seconds of :meth:`.Environment.world_now`.

>>> plan = Plan((
...     "lasts(do(robot,go(a),1),way,20)", "lasts(do(robot,give,2),give,5)",
...     "expected(1,do(robot,give,2))", "due(1,30)",
... ))
>>> arrivals = Arrivals()
>>> arrivals.place("1", 100.0)
>>> arrivals.expected(plan, 1, set(), 100.0)
{'1': 125.0}
>>> go = Action("robot", "go(a)", 1)
>>> arrivals.begin(go, plan, 101.0)
>>> arrivals.expected(plan, 1, {go}, 110.0), arrivals.expected(plan, 1, {go}, 140.0)
({'1': 126.0}, {'1': 145.0})
>>> arrivals.lines(plan, "1", 145.0, 140.0)
['expected in 5 s', 'late by 15 s']
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field, replace
from typing import Container, Dict, List, Optional

from rosoclingo.loop.atoms import Action, Plan

EXPECTED = "expected"
"""How the line of feedback begins that says when a goal will be served, and what ``~plan`` says."""


@dataclass(frozen=True)
class Arrival:
    """The time at which a goal is expected to be served.

    Attributes:
        slot: The planner's id for the goal.
        time: When, in seconds of world time.
    """

    slot: str
    time: float

    def __str__(self) -> str:
        return f"{EXPECTED}({self.slot},{round(self.time)})"


@dataclass(frozen=True)
class Doing:
    """An action that was published and is not answered.

    Attributes:
        action: What its actuator does.
        kind: What the encoding calls such actions; empty if it does not say how long they take.
        began: When it was published, in seconds of world time.
        seconds: How long it takes by the plan.
        is_timed: Whether its answer will come when it is through.
    """

    action: str
    kind: str
    began: float
    seconds: int = 0
    is_timed: bool = True

    @property
    def end(self) -> float:
        """The expected end of the action, in seconds of world time."""
        return self.began + self.seconds


@dataclass
class ArrivalsState:
    """Saved state of :class:`Arrivals`.

    Attributes:
        doing: What each actuator does that has not answered.
        told: When goals will be served, as their clients were told last, by their slots; in seconds
            of world time.
    """

    doing: Dict[str, Doing] = field(default_factory=dict)
    told: Dict[str, float] = field(default_factory=dict)
    _came: Dict[str, float] = field(default_factory=dict)  # when the goals in slots came


class Arrivals(ArrivalsState):
    """Tracks the actions under way, to estimate arrival times. Only the loop's thread uses it."""

    def place(self, slot: str, came: float) -> None:
        """Begins to estimate a goal's arrival time, as it gets a slot.

        Args:
            slot: The slot.
            came: When the goal has come, in seconds of world time.
        """
        self._came[slot] = came
        self.told.pop(slot, None)

    def begin(self, action: Action, plan: Plan, now: float) -> None:
        """Begins to track a published action.

        Args:
            action: The action.
            plan: The plan that has it.
            now: What time it is, in seconds of world time.
        """
        kind, seconds = plan.lasting.get(action, ("", 0))
        self.doing[action.actuator] = Doing(action.name, kind, now, seconds)

    def end(self, actuator: str) -> Optional[Doing]:
        """Ends the tracking of an actuator's action, which was answered, and returns it."""
        return self.doing.pop(actuator, None)

    def interrupt(self) -> None:
        """Excludes actions under way from learning: their answers may come late after a restart."""
        for actuator, one in self.doing.items():
            self.doing[actuator] = replace(one, is_timed=False)

    def expected(
        self, plan: Plan, step: int, published: Container[Action], now: float
    ) -> Dict[str, float]:
        """Returns when goals will be served, as far as the plan says that, by their slots.

        Args:
            plan: The plan that stands.
            step: The current step.
            published: Which actions were published since the last reset.
            now: What time it is, in seconds of world time.
        """
        through: Dict[str, float] = defaultdict(lambda: now)
        for actuator, one in self.doing.items():
            through[actuator] = max(one.end, now)
        ends: Dict[Action, float] = {}
        for action, (_, seconds) in sorted(plan.lasting.items(), key=lambda item: item[0].step):
            if action.step >= step and action not in published:
                through[action.actuator] += seconds
                ends[action] = through[action.actuator]
        found = {}
        for slot, action in plan.serving.items():
            doing = self.doing.get(action.actuator)
            if action in ends:
                found[slot] = ends[action]
            elif doing is not None and doing.action == action.name and doing.kind:
                found[slot] = max(doing.end, now)
        return found

    def lines(self, plan: Plan, slot: str, time: float, now: float) -> List[str]:
        """Returns the lines of feedback for a goal that will be served at a time.

        Args:
            plan: The plan, which may say when the goal is due.
            slot: The goal's slot.
            time: When it will be served, in seconds of world time.
            now: What time it is, likewise.
        """
        lines = [f"{EXPECTED} in {max(0, round(time - now))} s"]
        limit, came = plan.limits.get(slot), self._came.get(slot)
        if limit is not None and came is not None:
            lines.append(f"late by {max(0, round(time - came - limit))} s")
        return lines
