"""Computes the statistics of a recorded run from its journal. Needs no ROS."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass
from typing import Any, Callable, Dict, Iterable, List, Mapping, Optional, Tuple

from rosclingo.wire.commands import Result
from rosoclingo.bags.believed import BeliefHistory
from rosoclingo.bags.model import Recording
from rosoclingo.bags.report.changes import change, explained
from rosoclingo.bags.report.planned import in_recording, planned_rest, with_times
from rosoclingo.bags.report.run import (
    OPEN,
    RECALLED,
    AnswerRun,
    Cause,
    GoalRun,
    MessageRun,
    NodeRestart,
    PlanChange,
    SearchRecord,
    Statistics,
    StepRun,
    numbered,
)
from rosoclingo.bags.run_model import RunModel, TrackedGoal, TrackedMessage
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Entry
from rosoclingo.loop.values.phrases import NO_PHRASES, TermPhrases
from rosoclingo.loop.words import FAILURE, SUCCESS


def compute(recording: Recording) -> Statistics:
    """Computes the statistics of a recording."""
    entries = recording.entries
    planner = recording.planner
    phrases = TermPhrases.read(planner.files.values()) if planner is not None else NO_PHRASES
    reading = _Reading(phrases)
    for position, entry in enumerate(entries):
        reading.read(position, entry)
    seconds = [entry.seconds for entry in entries]
    ended = max(seconds, default=0.0)
    plan_times = in_recording(recording.plan_times)
    run, goals = reading.run, sorted(map(_goal_run, reading.goals), key=lambda goal: goal.came)
    return Statistics(
        began=min(seconds, default=0.0),
        ended=ended,
        end=run.end or "",
        goals=with_times(goals, plan_times),
        actions=tuple(run.actions),
        messages=tuple(
            MessageRun(one.seconds, one.source, one.value, one.step, one.dropped or "")
            for one in run.messages
            if one.action is None or one.dropped
        ),
        received=len(reading.arrivals),
        searches=tuple(reading.searches),
        steps=tuple(reading.steps),
        plans=len(reading.plans),
        changes=explained(reading.changes, reading.plans, reading.causes()),
        answers=tuple(reading.answers),
        restarts=tuple(reading.restarts),
        holds=recording.hold_spans,
        beliefs=tuple(reading.beliefs.spans),
        planned=() if run.end else planned_rest(run.actions, plan_times, ended),
    )


@dataclass
class _Placement:
    """A goal's place in the report; positions are those in the journal.

    Attributes:
        goal: The goal.
        heard: The position where it was heard of first.
        name: What it is called.
        cancelled: The position of its cancel request, if there was one.
        behind: The goal that had its slot while it waited, if there was one.
        placed: Since when there may be a plan for it: a position.
        begun: How often slots may have become free when it ended.
        steps_before: How many steps there were when it was accepted.
        steps: How many have begun from then on until its end.
    """

    goal: TrackedGoal
    heard: int
    name: str = ""
    cancelled: Optional[int] = None
    behind: Optional[_Placement] = None
    placed: Optional[int] = None
    begun: Optional[int] = None
    steps_before: Optional[int] = None
    steps: int = 0


def _goal_run(placement: _Placement) -> GoalRun:
    goal, behind = placement.goal, placement.behind
    outcome = OPEN if goal.ended is None else RECALLED if goal.is_recalled else goal.status.value
    return GoalRun(
        goal.id, goal.came, goal.request, goal.information, goal.slot, placement.name,
        "" if behind is None else behind.name, goal.accepted, goal.cancelled, goal.ended, outcome,
        goal.reason, placement.steps,
    )  # fmt: skip


class _Reading:
    """Reads a journal once, entry by entry."""

    def __init__(self, phrases: TermPhrases) -> None:
        self.run = RunModel()
        self.arrivals: List[Tuple[int, TrackedMessage]] = []  # with their positions
        self.searches: List[SearchRecord] = []
        self.steps: List[StepRun] = []
        self.plans: List[int] = []  # their positions
        self.answers: List[AnswerRun] = []
        self.restarts: List[NodeRestart] = []
        self.beliefs = BeliefHistory(phrases)
        self.changes: Dict[int, PlanChange] = {}  # without causes, by the numbers of the plans
        self._position = 0
        self._last = 0.0  # when the event before was
        self._placements: Dict[str, _Placement] = {}  # by the goals' ids
        self._requests: Counter[str] = Counter()  # how often each has come
        self._slots: Dict[str, _Placement] = {}  # the last goal of each slot
        self._begun = 0  # how often slots may have become free: steps that have begun, and resets
        self._assignments: List[Tuple[int, int]] = []  # positions and counts of assign_messages
        self._handlers: Mapping[type, Callable[[Entry, Any], None]] = {
            journal.GoalArrived: self._on_goal,
            journal.CancelArrived: self._on_cancel,
            journal.StatusSet: self._on_status,
            journal.MessageArrived: self._on_message,
            journal.CommandDone: self._on_command,
            journal.PlanFound: self._on_plan,
            journal.BeliefsChanged: lambda entry, event: self.beliefs.add(
                entry.seconds, entry.step, event.terms
            ),
            journal.Explained: self._on_answer,
            journal.NodeResumed: self._on_resumed,
        }

    @property
    def goals(self) -> Iterable[_Placement]:
        """The goals, in the order in which they were heard of."""
        return self._placements.values()

    def read(self, position: int, entry: Entry) -> None:
        """Reads the next entry."""
        self._position = position
        if self.steps and entry.step != self.steps[-1].number:
            self._begun += 1
        if not self.steps or entry.step > self.steps[-1].number:
            self.steps.append(StepRun(entry.seconds, entry.step, entry.horizon))
        else:  # a reset renumbers the step, and begins none
            self.steps[-1].number, self.steps[-1].horizon = entry.step, entry.horizon
        self.run.apply(entry)
        handler = self._handlers.get(type(entry.event))
        if handler is not None:
            handler(entry, entry.event)
        self._last = entry.seconds

    def causes(self) -> List[Tuple[int, Cause]]:
        """Returns the possible causes of changes, with their positions, when all is read."""
        causes = [(at, _cause(message)) for at, message in self.arrivals if not message.dropped]
        for one in self.goals:
            if one.goal.slot or one.goal.accepted is not None:
                # It is planned for when it gets its slot, not when it comes.
                position = one.heard if one.placed is None else one.placed
                causes.append((position, Cause("queued" if one.behind else "goal", one.name)))
            if one.cancelled is not None and not one.goal.is_recalled:
                causes.append((one.cancelled, Cause("cancel", one.name)))
        return causes

    def _placement(self, identifier: str) -> _Placement:
        """Returns a goal; one that is cancelled at once is heard of before it has come."""
        if identifier not in self._placements:
            goal = self.run.goals[identifier]
            self._placements[identifier] = _Placement(goal, self._position)
        return self._placements[identifier]

    def _on_goal(self, _: Entry, event: journal.GoalArrived) -> None:
        self._requests[event.request] += 1
        name = numbered(event.request, self._requests[event.request])
        self._placement(event.goal).name = name

    def _on_cancel(self, _: Entry, event: journal.CancelArrived) -> None:
        placement = self._placement(event.goal)
        if placement.cancelled is None:
            placement.cancelled = self._position

    def _on_status(self, _: Entry, event: journal.StatusSet) -> None:
        placement = self._placement(event.goal)
        if placement.goal.ended is not None:
            if placement.begun is None:
                placement.begun = self._begun
                if placement.steps_before is not None:
                    placement.steps = len(self.steps) - placement.steps_before
        elif placement.goal.accepted is not None and placement.steps_before is None:
            self._accept(placement, event.slot)

    def _accept(self, placement: _Placement, slot: str) -> None:
        before = self._slots.get(slot) if slot else None
        self._slots[slot] = placement
        placement.steps_before = len(self.steps)
        if before is not None:
            ended = before.goal.ended
            if ended is None or ended > placement.goal.came:
                placement.behind = before
            placement.placed = self._since_when_placed(placement, before)

    def _since_when_placed(self, placement: _Placement, before: _Placement) -> int:
        """Returns where a goal, which is accepted here, has got the slot of one before it."""
        position = placement.heard
        if placement.behind:  # in a bag that lacks the commands
            position = self.plans[-1] if self.plans else self._position
        since = self._begun if before.begun is None else before.begun
        for assigned, begun in reversed(self._assignments):
            if begun <= since or assigned < placement.heard:
                break
            position = assigned
        return position

    def _on_message(self, _: Entry, __: journal.MessageArrived) -> None:
        self.arrivals.append((self._position, self.run.messages[-1]))

    def _on_command(self, entry: Entry, event: journal.CommandDone) -> None:
        step = self.steps[-1]
        if event.is_search:
            result = event.result.value if event.result else ""
            self.searches.append(
                SearchRecord(entry.seconds, event.seconds, result, entry.step, entry.horizon)
            )
            step.searches += 1
            step.interrupted += event.result is Result.UNKNOWN
            step.solving += event.seconds
        elif not event.waits:
            step.other += event.seconds
        if event.name == "assign_messages":
            self._assignments.append((self._position, self._begun))
        self._begun += event.resets_to is not None

    def _on_plan(self, entry: Entry, _: journal.PlanFound) -> None:
        changed = change(entry, self.run)
        if changed is not None:
            self.changes[len(self.plans)] = changed
        self.plans.append(self._position)

    def _on_answer(self, entry: Entry, event: journal.Explained) -> None:
        self.answers.append(
            AnswerRun(entry.seconds, entry.step, self._asked(event), event.text, event.seconds)
        )

    def _asked(self, event: journal.Explained) -> str:
        """Returns a question's text, with the report's name of a goal instead of its slot."""
        try:
            answer = json.loads(event.structure or "{}")
        except (ValueError, RecursionError):  # it may be anybody's bag
            return event.question
        slot, request = (
            (answer.get(k) for k in ("slot", "request")) if isinstance(answer, dict) else ("", "")
        )
        if not request or event.question not in (f"goal {slot}", f"goal {request}"):
            return event.question
        names = [one.name for one in self.goals if one.goal.request == request]
        return f"goal {names[-1] if names else request}"

    def _on_resumed(self, entry: Entry, event: journal.NodeResumed) -> None:
        last = self._last if self._position else entry.seconds
        self.restarts.append(
            NodeRestart(entry.seconds, entry.step, event.node, event.reason, event.seconds, last)
        )


def _cause(message: TrackedMessage) -> Cause:
    source, value, action = message.source, message.value, message.action
    if action is None:
        return Cause("message", f"{source}: {value}")
    if value in (SUCCESS, FAILURE):
        return Cause(value, f"{source}: {action.name}")
    return Cause("answer", f"{source}: {action.name} answered {value}")
