"""Computes the statistics of a recorded run from its journal. Needs no ROS."""

from __future__ import annotations

import itertools
import json
from collections import Counter, deque
from dataclasses import replace
from typing import Any, Callable, Deque, Dict, List, Mapping, NamedTuple, Optional, Tuple

from rosclingo.wire.commands import Result
from rosclingo.wire.term_text import compact
from rosoclingo.bags.believed import BeliefHistory
from rosoclingo.bags.model import Recording
from rosoclingo.bags.report.changes import Planned, after_reset, change, explained, planned
from rosoclingo.bags.report.planned import in_recording, planned_rest, with_times
from rosoclingo.bags.report.run import (
    OPEN,
    RECALLED,
    ActionRun,
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
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Entry
from rosoclingo.loop.values.phrases import NO_PHRASES, TermPhrases
from rosoclingo.loop.words import ABORT

_RECENT = 1000  # a message is dropped soon after it has come


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
    goals = sorted(reading.goals.values(), key=lambda goal: goal.came)
    return Statistics(
        began=min(seconds, default=0.0),
        ended=ended,
        end=reading.end,
        goals=with_times(goals, plan_times),
        actions=tuple(reading.actions),
        messages=tuple(sorted(reading.messages, key=lambda message: message.seconds)),
        received=reading.received,
        searches=tuple(reading.searches),
        steps=tuple(reading.steps),
        plans=len(reading.plans),
        changes=explained(reading.changes, reading.plans, reading.causes()),
        answers=tuple(reading.answers),
        restarts=tuple(reading.restarts),
        holds=recording.hold_spans,
        beliefs=tuple(reading.beliefs.spans),
        planned=() if reading.end else planned_rest(reading.actions, plan_times, ended),
    )


class _Taken(NamedTuple):
    """A message that may still be dropped."""

    position: int
    id: str
    value: str
    prefixes: Tuple[str, str, str]  # how a reason that names it begins; the first without spaces
    answered: Optional[int]  # the index of an action
    message: int  # else its index


class _Reading:
    """Reads a journal once, entry by entry."""

    def __init__(self, phrases: TermPhrases) -> None:
        self.end = ""
        self.goals: Dict[str, GoalRun] = {}
        self.actions: List[ActionRun] = []
        self.messages: List[MessageRun] = []
        self.received = 0
        self.searches: List[SearchRecord] = []
        self.steps: List[StepRun] = []
        self.plans: List[int] = []  # their positions
        self.answers: List[AnswerRun] = []
        self.restarts: List[NodeRestart] = []
        self.beliefs = BeliefHistory(phrases)
        self.changes: Dict[int, PlanChange] = {}  # without causes, by the numbers of the plans
        self._position = 0
        self._last = 0.0  # when the event before was
        self._plan: Planned = {}
        self._arrivals: Dict[str, int] = {}  # positions of goals
        self._cancels: Dict[str, int] = {}  # positions of cancel requests, by goal
        self._placed: Dict[str, int] = {}  # since when there may be a plan for a goal: a position
        self._steps_before: Dict[str, int] = {}  # how many there were when a goal was accepted
        self._requests: Counter[str] = Counter()  # how often each has come
        self._slots: Dict[str, str] = {}  # the last goal of each slot
        self._begun = 0  # how often slots may have become free: steps that have begun, and resets
        self._ends: Dict[str, int] = {}  # the same count at the end of each goal
        self._assignments: List[Tuple[int, int]] = []  # positions and counts of assign_messages
        self._latest: Dict[str, int] = {}  # index of each actuator's last action
        self._causes: Dict[int, Cause] = {}  # messages that were not dropped, by position
        self._recent: Deque[_Taken] = deque(maxlen=_RECENT)
        self._handlers: Mapping[type, Callable[[Entry, Any], None]] = {
            journal.GoalArrived: self._on_goal,
            journal.CancelArrived: self._on_cancel,
            journal.StatusSet: self._on_status,
            journal.MessageArrived: self._on_message,
            journal.MessageDropped: self._on_dropped,
            journal.CommandDone: self._on_command,
            journal.PlanFound: self._on_plan,
            journal.BeliefsChanged: lambda entry, event: self.beliefs.add(
                entry.seconds, entry.step, event.terms
            ),
            journal.ActionPublished: self._on_action,
            journal.ActionRetried: self._on_retry,
            journal.Explained: self._on_answer,
            journal.NodeResumed: self._on_resumed,
            journal.LoopEnded: self._on_end,
        }

    def read(self, position: int, entry: Entry) -> None:
        """Reads the next entry."""
        self._position = position
        if self.steps and entry.step != self.steps[-1].number:
            self._begun += 1
        if not self.steps or entry.step > self.steps[-1].number:
            self.steps.append(StepRun(entry.seconds, entry.step, entry.horizon))
        elif (entry.step, entry.horizon) != (self.steps[-1].number, self.steps[-1].horizon):
            # A reset renumbers the step, and begins none.
            self.steps[-1] = replace(self.steps[-1], number=entry.step, horizon=entry.horizon)
        handler = self._handlers.get(type(entry.event))
        if handler is not None:
            handler(entry, entry.event)
        self._last = entry.seconds

    def causes(self) -> List[Tuple[int, Cause]]:
        """Returns the possible causes of changes, with their positions, when all is read."""
        causes = list(self._causes.items())
        for identifier, goal in self.goals.items():
            if goal.slot or goal.accepted is not None:
                # It is planned for when it gets its slot, not when it comes.
                position = self._placed.get(identifier, self._arrivals[identifier])
                kind = "queued" if goal.behind else "goal"
                causes.append((position, Cause(kind, goal.name)))
            if goal.outcome != RECALLED and identifier in self._cancels:
                causes.append((self._cancels[identifier], Cause("cancel", goal.name)))
        return causes

    def _goal(self, seconds: float, identifier: str) -> GoalRun:
        """Returns a goal; one that is cancelled at once is heard of before it has come."""
        self._arrivals.setdefault(identifier, self._position)
        return self.goals.setdefault(identifier, GoalRun(identifier, seconds))

    def _on_goal(self, entry: Entry, event: journal.GoalArrived) -> None:
        goal = self._goal(entry.seconds, event.goal)
        self._requests[event.request] += 1
        self.goals[goal.id] = replace(
            goal,
            request=event.request,
            information=event.information,
            name=numbered(event.request, self._requests[event.request]),
        )

    def _on_cancel(self, entry: Entry, event: journal.CancelArrived) -> None:
        goal = self._goal(entry.seconds, event.goal)
        self._cancels.setdefault(goal.id, self._position)
        if goal.cancels is None:
            self.goals[goal.id] = replace(goal, cancels=entry.seconds)

    def _on_status(self, entry: Entry, event: journal.StatusSet) -> None:
        goal = self._goal(entry.seconds, event.goal)
        if event.status is journal.Status.ACCEPTED:
            self._accept(entry.seconds, goal, event.slot)
            return
        if goal.outcome != OPEN:
            return
        is_recalled = (
            event.status is journal.Status.CANCELED and not event.slot and goal.accepted is None
        )
        self._ends[goal.id] = self._begun
        self.goals[goal.id] = replace(
            goal,
            slot=event.slot or goal.slot,
            ended=entry.seconds,
            outcome=RECALLED if is_recalled else event.status.value,
            reason=str(event.reason),
            steps=len(self.steps) - self._steps_before.get(goal.id, len(self.steps)),
        )

    def _accept(self, seconds: float, goal: GoalRun, slot: str) -> None:
        if goal.accepted is not None:
            return
        before = self.goals.get(self._slots.get(slot, "")) if slot else None
        is_queued = before is not None and (before.ended is None or before.ended > goal.came)
        self._slots[slot] = goal.id
        self._steps_before[goal.id] = len(self.steps)
        behind = before.name if before is not None and is_queued else ""
        if before is not None:
            self._placed[goal.id] = self._placement(goal, before, bool(behind))
        self.goals[goal.id] = replace(goal, accepted=seconds, slot=slot, behind=behind)

    def _placement(self, goal: GoalRun, before: GoalRun, is_queued: bool) -> int:
        """Returns where a goal, which is accepted here, has got the slot of one before it."""
        came = self._arrivals[goal.id]
        position = came
        if is_queued:  # in a bag that lacks the commands
            position = self.plans[-1] if self.plans else self._position
        since = self._ends.get(before.id, self._begun)
        for assigned, begun in reversed(self._assignments):
            if begun <= since or assigned < came:
                break
            position = assigned
        return position

    def _on_message(self, entry: Entry, event: journal.MessageArrived) -> None:
        source, value = event.source, event.value
        self.received += 1
        index = self._latest.get(compact(source))
        if index is not None and self.actions[index].ended is None:
            self.actions[index] = replace(self.actions[index], ended=entry.seconds, answer=value)
            kind = value if value in ("success", "failure") else "answer"
            text = f"{source}: {self.actions[index].name}"
            text += f" answered {value}" if kind == "answer" else ""
        else:
            index = None
            self.messages.append(MessageRun(entry.seconds, source, value, entry.step))
            kind, text = "message", f"{source}: {value}"
        self._causes[self._position] = Cause(kind, text)
        prefixes = compact(journal.naming(source, value)), f"{source!r} ", f"{value!r} "
        message = len(self.messages) - 1
        self._recent.append(_Taken(self._position, source, value, prefixes, index, message))

    def _on_dropped(self, entry: Entry, event: journal.MessageDropped) -> None:
        why, spaceless = event.reason, compact(event.reason)
        for taken in reversed(self._recent):
            names, *quoted = taken.prefixes
            is_named = spaceless.startswith(names) or why.startswith(tuple(quoted))
            if is_named and taken.position in self._causes:
                break
        else:
            self.messages.append(MessageRun(entry.seconds, "", "", entry.step, why))
            return
        del self._causes[taken.position]
        if taken.answered is None:
            message = self.messages[taken.message]
            self.messages[taken.message] = replace(message, dropped=why)
        else:  # it was no answer
            self.messages.append(MessageRun(entry.seconds, taken.id, taken.value, entry.step, why))
            action = self.actions[taken.answered]
            is_latest = self._latest[compact(taken.id)] == taken.answered
            ended = None if is_latest else action.ended
            self.actions[taken.answered] = replace(action, answer="", ended=ended)

    def _on_command(self, entry: Entry, event: journal.CommandDone) -> None:
        step = self.steps[-1]
        if event.is_search:
            result = event.result.value if event.result else ""
            self.searches.append(
                SearchRecord(entry.seconds, event.seconds, result, entry.step, entry.horizon)
            )
            self.steps[-1] = replace(
                step,
                searches=step.searches + 1,
                interrupted=step.interrupted + (event.result is Result.UNKNOWN),
                solving=step.solving + event.seconds,
            )
        elif not event.waits:
            self.steps[-1] = replace(step, other=step.other + event.seconds)
        if event.name == "assign_messages":
            self._assignments.append((self._position, self._begun))
        if event.resets_to is not None:
            self._begun += 1
            self._plan = after_reset(self._plan, event.resets_to)

    def _on_plan(self, entry: Entry, event: journal.PlanFound) -> None:
        before = {step: actions for step, actions in self._plan.items() if step >= entry.step}
        self._plan = planned(event.actions)
        last = self.plans[-1] if self.plans else -1
        news = itertools.takewhile(lambda pair: pair[0] > last, reversed(self._causes.items()))
        is_expected = all(cause.kind == "success" for _, cause in news)
        changed = change(entry, before, self._plan, is_expected=is_expected)
        if changed is not None:
            self.changes[len(self.plans)] = changed
        self.plans.append(self._position)

    def _on_action(self, entry: Entry, event: journal.ActionPublished) -> None:
        if event.action == ABORT:  # the actuator is still at what is aborted
            return
        actuator = compact(event.actuator)
        index = self._latest.get(actuator)
        if index is not None and self.actions[index].ended is None:
            self.actions[index] = replace(self.actions[index], ended=entry.seconds)
        self._latest[actuator] = len(self.actions)
        self.actions.append(ActionRun(event.actuator, event.action, entry.step, entry.seconds))

    def _on_retry(self, entry: Entry, event: journal.ActionRetried) -> None:
        index = self._latest.get(compact(event.actuator))
        if index is not None and self.actions[index].ended is None:
            ended = replace(self.actions[index], ended=entry.seconds, answer=event.answer)
            self.actions[index] = ended

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
        names = [goal.name for goal in self.goals.values() if goal.request == request]
        return f"goal {names[-1] if names else request}"

    def _on_resumed(self, entry: Entry, event: journal.NodeResumed) -> None:
        last = self._last if self._position else entry.seconds
        self.restarts.append(
            NodeRestart(entry.seconds, entry.step, event.node, event.reason, event.seconds, last)
        )

    def _on_end(self, _: Entry, event: journal.LoopEnded) -> None:
        self.end = str(event.reason)
