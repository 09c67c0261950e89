"""Folds a journal into the state of a run: its goals, actions, messages and plans.

It is the one place that decides when they begin and end, for all that show a run. An action that is
tried again is another one. What a message was taken for is undone if the loop drops it.

>>> run = RunModel()
>>> journal_of = [
...     journal.GoalArrived("g", "visit(3)"),
...     journal.ActionPublished("robot", "go(3)"),
...     journal.MessageArrived("robot", "faliure"),
...     journal.MessageDropped(f"{journal.naming('robot', 'faliure')}it is unknown"),
... ]
>>> for number, event in enumerate(journal_of, 1):
...     _ = run.apply(Entry(event, step=1, number=number, seconds=float(number)))
>>> run.goals["g"].request, run.goals["g"].ended
('visit(3)', None)
>>> run.acting("robot").name, run.messages[0].dropped
('go(3)', 'id robot, value faliure: it is unknown')
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from typing import Any, Callable, Deque, Dict, List, Mapping, Optional, Set, Tuple

from rosclingo.wire.term_text import compact, last_number, split_term
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Entry, Status
from rosoclingo.loop.words import ABORT, SUCCESS

_RECENT = 1000  # a message is dropped soon after it has come
_LONGEST = 1000  # characters at the beginning of a reason, in which it names a message

PlannedSteps = Dict[int, Set[str]]
"""For each step, its actions, as ``actuator: action``."""


@dataclass(eq=False)
class TrackedGoal:
    """A goal of a run.

    Attributes:
        id: That of actionlib.
        number: Counts the goals, in the order in which they were heard of.
        came: When it was taken, or heard of before that: one that is cancelled at once has ended
            when the loop takes it.
        request: The request; empty if only its status was heard.
        information: What came with it.
        has_arrived: Whether the loop has taken it, as far as the journal is known.
        slot: The planner's id for it; empty if it is not known to have one.
        accepted: When the planner accepted it, if it did.
        cancelled: When the loop has taken a cancel request for it, if it has.
        ended: When it ended, if it did; the first time counts.
        reason: Why it ended.
        status: Its status.
    """

    id: str
    number: int
    came: float
    request: str = ""
    information: Tuple[str, ...] = ()
    has_arrived: bool = False
    slot: str = ""
    accepted: Optional[float] = None
    cancelled: Optional[float] = None
    ended: Optional[float] = None
    reason: str = ""
    status: Status = Status.PENDING

    @property
    def is_recalled(self) -> bool:
        """True if it was cancelled before it had a slot."""
        return self.status is Status.CANCELED and not self.slot and self.accepted is None


@dataclass(eq=False)
class TrackedAction:
    """An action of an actuator, or one of several tries, from its publication to its answer.

    Attributes:
        number: Counts the actions.
        actuator: Who acts.
        name: What it does.
        step: In which step it was published.
        began: When it was published.
        ended: When it was answered, or when the actuator was told something else; None if neither.
        answer: The answer; empty if there was none.
    """

    number: int
    actuator: str
    name: str
    step: int
    began: float
    ended: Optional[float] = None
    answer: str = ""


@dataclass(eq=False)
class TrackedMessage:
    """A message that the loop has taken.

    Attributes:
        number: That of its entry in the journal.
        seconds: When it was taken.
        step: In which step.
        source: Where it comes from; empty if it was dropped and the journal does not say which one
            it was.
        value: What it says; empty where the source is.
        action: The action that it was taken for an answer of, if it was.
        dropped: Why it was dropped; empty if the planner was told; None while neither is known.
        naming: What the reason then begins with, without spaces; empty where the source is.
    """

    number: int
    seconds: float
    step: int
    source: str = ""
    value: str = ""
    action: Optional[TrackedAction] = None
    dropped: Optional[str] = None
    naming: str = ""

    @property
    def is_success(self) -> bool:
        """True if it says that an action has succeeded."""
        return self.action is not None and self.value == SUCCESS


@dataclass(eq=False)
class TrackedPlan:
    """A plan as it was found.

    Attributes:
        atoms: Its actions, as ``do(Actuator,Action,Step)``.
        is_expected: Whether nothing but successes of actions had come since the plan before it.
        reset: By how much resets have reduced the numbers of steps since.
    """

    atoms: Tuple[str, ...] = ()
    is_expected: bool = True
    reset: int = 0

    def steps(self, first: float = -math.inf) -> PlannedSteps:
        """Returns its actions from a step on by their steps, as these are numbered now."""
        first = max(first, 1 if self.reset else first)  # a reset forgets what is done
        found = self._found_steps.items()
        return {at - self.reset: one for at, one in found if at - self.reset >= first}

    @cached_property
    def _found_steps(self) -> PlannedSteps:
        """Its actions by their steps, as these were numbered when it was found."""
        steps: PlannedSteps = {}
        for atom in self.atoms:
            name, arguments = split_term(atom)
            number = last_number(atom)
            if name == "do" and number is not None:
                steps.setdefault(number, set()).add(": ".join(arguments[:-1]))
        return steps


class RunModel:
    """The state of a run, which :meth:`apply` brings forward by one entry of its journal.

    One thread changes it; what becomes of goals and messages, others may read meanwhile.

    Attributes:
        goals: The goals by their ids, in the order in which they were heard of.
        actions: The actions, in order of publication.
        last: The last action of each actuator, by its name without spaces.
        messages: The messages, in order.
        plan: The plan that was found last.
        plan_before: The one before that, with its steps as they were numbered then.
        end: Why the loop has ended; None while it goes on.
        ended: When it has ended.
    """

    def __init__(self, most: Optional[int] = None) -> None:
        """Begins before the first entry.

        Args:
            most: How many actions and messages are kept; None for all. Goals are kept until
                :meth:`forget`.
        """
        self.goals: Dict[str, TrackedGoal] = {}
        self.actions: Deque[TrackedAction] = deque(maxlen=most)
        self.last: Dict[str, TrackedAction] = {}
        self.messages: Deque[TrackedMessage] = deque(maxlen=most)
        self.plan = self.plan_before = TrackedPlan()
        self.end: Optional[str] = None
        self.ended = 0.0
        self._goals_heard = self._actions_begun = 0
        self._named: Dict[str, List[TrackedMessage]] = {}  # those that may be dropped, by names
        self._untold: Deque[TrackedMessage] = deque(maxlen=most)
        self._since_plan: Deque[TrackedMessage] = deque(maxlen=most)  # those that are no success
        self._handlers: Mapping[type, Callable[[Entry, Any], Optional[TrackedAction]]] = {
            journal.GoalArrived: self._on_goal,
            journal.CancelArrived: self._on_cancel,
            journal.StatusSet: self._on_status,
            journal.MessageArrived: self._on_message,
            journal.MessageDropped: self._on_dropped,
            journal.ActionPublished: self._on_action,
            journal.ActionRetried: self._on_retry,
            journal.CommandDone: self._on_command,
            journal.PlanFound: self._on_plan,
            journal.LoopEnded: self._on_end,
            journal.NodeResumed: self._on_resumed,
        }

    def apply(self, entry: Entry) -> Optional[TrackedAction]:
        """Takes the next entry of the journal.

        Returns:
            The action that begins or ends by it, or that has not ended after all; if any.
        """
        handler = self._handlers.get(type(entry.event))
        return None if handler is None else handler(entry, entry.event)

    def last_of(self, actuator: str) -> Optional[TrackedAction]:
        """Returns the last action of an actuator; None if there is none."""
        return self.last.get(compact(actuator))

    def acting(self, actuator: str) -> Optional[TrackedAction]:
        """Returns the action that an actuator has not answered; None if there is none."""
        last = self.last_of(actuator)
        return last if last is not None and last.ended is None else None

    @property
    def is_acting(self) -> bool:
        """True if an actuator has not answered."""
        return any(one.ended is None for one in self.last.values())

    def forget(self, goal: str) -> None:
        """Forgets a goal, so that a run of any length takes no more memory."""
        self.goals.pop(goal, None)

    def _goal(self, identifier: str, entry: Entry) -> TrackedGoal:
        if identifier not in self.goals:
            self._goals_heard += 1
            self.goals[identifier] = TrackedGoal(identifier, self._goals_heard, entry.seconds)
        return self.goals[identifier]

    def _on_goal(self, entry: Entry, event: journal.GoalArrived) -> None:
        goal = self._goal(event.goal, entry)
        goal.request, goal.information, goal.has_arrived = event.request, event.information, True

    def _on_cancel(self, entry: Entry, event: journal.CancelArrived) -> None:
        goal = self._goal(event.goal, entry)
        if goal.cancelled is None:
            goal.cancelled = entry.seconds

    def _on_status(self, entry: Entry, event: journal.StatusSet) -> None:
        goal = self._goal(event.goal, entry)
        if goal.ended is not None:
            return
        goal.slot = event.slot or goal.slot
        if event.status.is_terminal:
            goal.ended, goal.reason = entry.seconds, str(event.reason)
        elif event.status is Status.ACCEPTED and goal.accepted is None:
            goal.accepted = entry.seconds
        goal.status = event.status  # last, as other threads look at it

    def _on_message(self, entry: Entry, event: journal.MessageArrived) -> Optional[TrackedAction]:
        action = self.acting(event.source)
        if action is not None:
            action.ended, action.answer = entry.seconds, event.value
        naming = compact(journal.naming(event.source, event.value))
        message = TrackedMessage(
            entry.number, entry.seconds, entry.step, event.source, event.value, action,
            naming=naming,
        )  # fmt: skip
        self._keep(message)
        self._named.setdefault(naming, []).append(message)
        self._untold.append(message)
        if not message.is_success:
            self._since_plan.append(message)
        return action

    def _on_dropped(self, entry: Entry, event: journal.MessageDropped) -> Optional[TrackedAction]:
        message = self._named_by(event.reason)
        if message is None:
            self._keep(
                TrackedMessage(entry.number, entry.seconds, entry.step, dropped=event.reason)
            )
            return None
        self._unname(message)
        message.dropped = event.reason
        action = message.action
        if action is not None:  # it was no answer
            action.answer = ""
            if self.last_of(action.actuator) is action:
                action.ended = None
        return action

    def _keep(self, message: TrackedMessage) -> None:
        if len(self.messages) == self.messages.maxlen:
            self._unname(self.messages[0])
        self.messages.append(message)

    def _named_by(self, reason: str) -> Optional[TrackedMessage]:
        """Returns the last message that a reason names, and that is not dropped."""
        spaceless = compact(reason[:_LONGEST])
        at = spaceless.find(":")
        while at >= 0:
            found = self._named.get(spaceless[: at + 1])
            if found:
                return found[-1]
            at = spaceless.find(":", at + 1)
        if not reason.startswith(("'", '"')):
            return None
        recent = islice(reversed(self.messages), _RECENT)  # it quotes what is no term
        return next((one for one in recent if not one.dropped and _is_quoted(one, reason)), None)

    def _unname(self, message: TrackedMessage) -> None:
        """Forgets the name of a message, which is dropped or so old that it will not be."""
        if message.dropped:
            return
        named = self._named[message.naming]
        if named[-1] is message:
            named.pop()
        else:
            named.remove(message)
        if not named:
            del self._named[message.naming]

    def _on_action(self, entry: Entry, event: journal.ActionPublished) -> Optional[TrackedAction]:
        if event.action == ABORT:  # the actuator is still at what is aborted
            return None
        before = self.acting(event.actuator)
        if before is not None:
            before.ended = entry.seconds
        self._actions_begun += 1
        action = TrackedAction(
            self._actions_begun, event.actuator, event.action, entry.step, entry.seconds
        )
        self.last[compact(event.actuator)] = action
        self.actions.append(action)
        return action

    def _on_retry(self, entry: Entry, event: journal.ActionRetried) -> Optional[TrackedAction]:
        action = self.acting(event.actuator)
        if action is not None:
            action.ended, action.answer = entry.seconds, event.answer
        return action

    def _on_command(self, _: Entry, event: journal.CommandDone) -> None:
        if event.name == "assign_messages":
            for message in self._untold:
                message.dropped = message.dropped or ""
            self._untold.clear()
        self.plan.reset += event.resets_to or 0

    def _on_plan(self, _: Entry, event: journal.PlanFound) -> None:
        is_expected = all(message.dropped for message in self._since_plan)
        self._since_plan.clear()
        self.plan_before, self.plan = self.plan, TrackedPlan(event.actions, is_expected)

    def _on_end(self, entry: Entry, event: journal.LoopEnded) -> None:
        self.end, self.ended = str(event.reason), entry.seconds

    def _on_resumed(self, *_: object) -> None:
        self.end = None


def _is_quoted(message: TrackedMessage, reason: str) -> bool:
    return reason.startswith((f"{message.source!r} ", f"{message.value!r} "))
