"""Computes what happened in a recorded run from its journal. Needs no ROS."""

from __future__ import annotations

import re
from collections import deque
from dataclasses import replace
from typing import Callable, Deque, Dict, List, Mapping, NamedTuple, Optional, Tuple

from rosclingo.errors import shorten
from rosoclingo.bags.model import Entry, Recording
from rosoclingo.bags.report.changes import Found, Planned, after_reset, changes, planned
from rosoclingo.bags.report.run import (
    OPEN,
    RECALLED,
    ActionRun,
    Cause,
    GoalRun,
    MessageRun,
    Search,
    Statistics,
    StepRun,
)
from rosoclingo.loop.journal import Event

_RESET = re.compile(r"reset\((\d+)\)")
_RECENT = 1000  # a message is dropped soon after it has come


def compute(recording: Recording) -> Statistics:
    """Computes what happened in a recording."""
    entries = recording.entries
    reading = _Reading()
    for position, entry in enumerate(entries):
        reading.read(position, entry)
    seconds = [entry.seconds for entry in entries]
    return Statistics(
        began=min(seconds, default=0.0),
        ended=max(seconds, default=0.0),
        end=reading.end,
        goals=tuple(sorted(reading.goals.values(), key=lambda goal: goal.came)),
        actions=tuple(reading.actions),
        messages=tuple(sorted(reading.messages, key=lambda message: message.seconds)),
        received=reading.received,
        searches=tuple(reading.searches),
        steps=tuple(reading.steps),
        plans=len(reading.plans),
        changes=changes(reading.plans, reading.causes()),
    )


class _Taken(NamedTuple):
    """A message, as long as it may be dropped."""

    position: int
    id: str
    value: str
    prefixes: Tuple[str, str, str]  # how a reason that names it begins
    answered: Optional[int]  # the index of an action
    message: int  # else its index


class _Reading:
    """Reads a journal once, entry by entry."""

    def __init__(self) -> None:
        self.end = ""
        self.goals: Dict[str, GoalRun] = {}
        self.actions: List[ActionRun] = []
        self.messages: List[MessageRun] = []
        self.received = 0
        self.searches: List[Search] = []
        self.steps: List[StepRun] = []
        self.plans: List[Found] = []
        self._position = 0
        self._plan: Planned = {}
        self._arrivals: Dict[str, int] = {}  # positions of goals
        self._cancels: Dict[str, int] = {}  # positions of cancel requests, by goal
        self._planned: Dict[str, int] = {}  # position of the plan before a goal was accepted
        self._steps_before: Dict[str, int] = {}  # how many there were when a goal was accepted
        self._slots: Dict[str, str] = {}  # the last goal of each slot
        self._latest: Dict[str, int] = {}  # index of each actuator's last action
        self._causes: Dict[int, Cause] = {}  # messages that were not dropped, by position
        self._recent: Deque[_Taken] = deque(maxlen=_RECENT)
        self._handlers: Mapping[str, Callable[[float, Event], None]] = {
            "goal": self._on_goal,
            "cancel": self._on_cancel,
            "status": self._on_status,
            "message": self._on_message,
            "dropped": self._on_dropped,
            "command": self._on_command,
            "plan": self._on_plan,
            "action": self._on_action,
            "end": self._on_end,
        }

    def read(self, position: int, entry: Entry) -> None:
        """Reads the next entry."""
        self._position = position
        event = entry.event
        if not self.steps or event.step > self.steps[-1].number:
            self.steps.append(StepRun(entry.seconds, event.step, event.horizon))
        elif (event.step, event.horizon) != (self.steps[-1].number, self.steps[-1].horizon):
            # A reset renumbers the step, and begins none.
            self.steps[-1] = replace(self.steps[-1], number=event.step, horizon=event.horizon)
        handler = self._handlers.get(event.kind)
        if handler is not None:
            handler(entry.seconds, event)

    def causes(self) -> List[Tuple[int, Cause]]:
        """Returns what may have changed a plan, with its position; once all is read."""
        causes = list(self._causes.items())
        for identifier, goal in self.goals.items():
            if goal.behind:
                # It is planned for when it gets its slot, not when it comes.
                causes.append((self._planned[identifier], Cause("queued", goal.request)))
            elif goal.slot or goal.accepted is not None:
                causes.append((self._arrivals[identifier], Cause("goal", goal.request)))
            if goal.outcome != RECALLED and identifier in self._cancels:
                causes.append((self._cancels[identifier], Cause("cancel", goal.request)))
        return causes

    def _goal(self, seconds: float, identifier: str) -> GoalRun:
        """Returns a goal; one that is cancelled at once is heard of before it has come."""
        self._arrivals.setdefault(identifier, self._position)
        return self.goals.setdefault(identifier, GoalRun(identifier, seconds))

    def _on_goal(self, seconds: float, event: Event) -> None:
        goal = self._goal(seconds, event.id)
        self.goals[event.id] = replace(goal, request=event.text, information=event.details)

    def _on_cancel(self, seconds: float, event: Event) -> None:
        goal = self._goal(seconds, event.id)
        self._cancels.setdefault(event.id, self._position)
        if goal.cancels is None:
            self.goals[event.id] = replace(goal, cancels=seconds)

    def _on_status(self, seconds: float, event: Event) -> None:
        goal = self._goal(seconds, event.id)
        slot, reason = (*event.details, "", "")[:2]
        if event.text == "accepted":
            self._accept(seconds, goal, slot)
            return
        if goal.outcome != OPEN:
            return
        is_recalled = event.text == "canceled" and not slot and goal.accepted is None
        self.goals[event.id] = replace(
            goal,
            slot=slot or goal.slot,
            ended=seconds,
            outcome=RECALLED if is_recalled else event.text,
            reason=reason,
            steps=len(self.steps) - self._steps_before.get(event.id, len(self.steps)),
        )

    def _accept(self, seconds: float, goal: GoalRun, slot: str) -> None:
        if goal.accepted is not None:
            return
        before = self.goals.get(self._slots.get(slot, "")) if slot else None
        is_queued = before is not None and (before.ended is None or before.ended > goal.came)
        self._slots[slot] = goal.id
        self._steps_before[goal.id] = len(self.steps)
        self._planned[goal.id] = self.plans[-1].position if self.plans else self._position
        behind = before.request if before is not None and is_queued else ""
        self.goals[goal.id] = replace(goal, accepted=seconds, slot=slot, behind=behind)

    def _on_message(self, seconds: float, event: Event) -> None:
        self.received += 1
        index = self._latest.get(_compact(event.id))
        if index is not None and self.actions[index].ended is None:
            self.actions[index] = replace(self.actions[index], ended=seconds, answer=event.text)
            kind = event.text if event.text in ("success", "failure") else "answer"
            text = f"{event.id}: {self.actions[index].name}"
            text += f" answered {event.text}" if kind == "answer" else ""
        else:
            index = None
            self.messages.append(MessageRun(seconds, event.id, event.text, event.step))
            kind, text = "message", f"{event.id}: {event.text}"
        self._causes[self._position] = Cause(kind, text)
        prefixes = _prefixes(event.id, event.text)
        message = len(self.messages) - 1
        self._recent.append(_Taken(self._position, event.id, event.text, prefixes, index, message))

    def _on_dropped(self, seconds: float, event: Event) -> None:
        reason = (_compact(event.text), event.text)
        for taken in reversed(self._recent):
            names, *quoted = taken.prefixes
            is_named = reason[0].startswith(names) or reason[1].startswith(tuple(quoted))
            if is_named and taken.position in self._causes:
                break
        else:
            self.messages.append(MessageRun(seconds, "", "", event.step, event.text))
            return
        del self._causes[taken.position]
        if taken.answered is None:
            message = self.messages[taken.message]
            self.messages[taken.message] = replace(message, dropped=event.text)
        else:  # it was no answer
            self.messages.append(MessageRun(seconds, taken.id, taken.value, event.step, event.text))
            action = self.actions[taken.answered]
            is_latest = self._latest[_compact(taken.id)] == taken.answered
            ended = None if is_latest else action.ended
            self.actions[taken.answered] = replace(action, answer="", ended=ended)

    def _on_command(self, seconds: float, event: Event) -> None:
        step = self.steps[-1]
        if event.is_search:
            self.searches.append(
                Search(seconds, event.seconds, event.id, event.step, event.horizon)
            )
            self.steps[-1] = replace(
                step,
                searches=step.searches + 1,
                interrupted=step.interrupted + (event.id == "unknown"),
                solving=step.solving + event.seconds,
            )
        elif event.text != "idle":
            self.steps[-1] = replace(step, other=step.other + event.seconds)
        reset = _RESET.fullmatch(event.text)
        if reset:
            self._plan = after_reset(self._plan, int(reset.group(1)))

    def _on_plan(self, seconds: float, event: Event) -> None:
        before = {step: actions for step, actions in self._plan.items() if step >= event.step}
        self._plan = planned(event.details)
        self.plans.append(
            Found(self._position, seconds, event.step, event.horizon, before, self._plan)
        )

    def _on_action(self, seconds: float, event: Event) -> None:
        actuator = _compact(event.id)
        index = self._latest.get(actuator)
        if index is not None and self.actions[index].ended is None:
            self.actions[index] = replace(self.actions[index], ended=seconds)
        self._latest[actuator] = len(self.actions)
        self.actions.append(ActionRun(event.id, event.text, event.step, seconds))

    def _on_end(self, _: float, event: Event) -> None:
        self.end = event.text


def _compact(text: str) -> str:
    """Returns a term without spaces: that is how it is compared with one that clingo prints."""
    return "".join(text.split())


def _prefixes(source: str, value: str) -> Tuple[str, str, str]:
    """Returns how reasons to drop a message begin: the first without spaces."""
    names = f"id {shorten(source)}, value {shorten(value)}:"
    return _compact(names), f"{source!r} ", f"{value!r} "
