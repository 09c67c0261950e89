"""Makes the journal's events from the topics of a system that had no journal yet. Needs no ROS.

What the journal has and the topics do not: when the loop waited, what it dropped and what it
thought. The order is that of the recording, but for an answer that was recorded just before its
action or just after what followed from it, because topics take different ways to the recorder.
Steps are counted: one is over when all actuators that act in it have answered.
"""

from __future__ import annotations

import re
from itertools import takewhile
from typing import Any, Dict, Iterable, Iterator, List, Mapping, NamedTuple, Sequence, Set

from rosclingo.wire.term_text import split_list
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Entry, Event, Reason, Status
from rosoclingo.loop.words import SOLVER

TOPICS = ("goal", "in", "out", "cancel", "status", "feedback", "result")
"""What the events are made from."""

_STATUSES = {
    1: Status.ACCEPTED, 2: Status.CANCELED, 3: Status.SUCCEEDED, 4: Status.ABORTED,
    5: Status.REJECTED, 6: Status.ACCEPTED, 7: Status.ACCEPTED, 8: Status.CANCELED,
}  # fmt: skip
_ABOUT_GOALS = ("status", "feedback", "result")
_SWAPPED_SECONDS = 0.2  # how much too early or too late an answer may be recorded
_HORIZON = re.compile(r"plan (\d{1,9}) steps?")


class TopicMessage(NamedTuple):
    """A message of one of :data:`TOPICS`.

    Attributes:
        topic: The last name of the topic.
        seconds: When it was recorded.
        message: What it says.
    """

    topic: str
    seconds: float
    message: Any


def in_order(recorded: Iterable[TopicMessage]) -> List[TopicMessage]:
    """Returns messages in the bag's order, but each answer between its action and what followed.

    While the loop waits for an answer, it changes the status of a goal, or tells the same actuator
    to do something else, only if a goal, a cancel request or a message comes. So such statuses and
    actions just before the answer show that it was recorded too late. An answer just before an
    action, of an actuator that has none to answer, was recorded too early.
    """
    ordered: List[TopicMessage] = []
    pending: Dict[str, int] = {}  # how many actions of an actuator have no answer
    early: Dict[str, TopicMessage] = {}  # what an actuator said that had no action to answer
    for said in recorded:
        place = len(ordered)
        if said.topic == "out":
            answer = early.pop(said.message.id, None)
            if answer is not None and said.seconds - answer.seconds <= _SWAPPED_SECONDS:
                del ordered[place - 1 - ordered[::-1].index(answer)]
                ordered += [said, answer]
                continue
            pending[said.message.id] = pending.get(said.message.id, 0) + 1
        elif said.topic == "in" and pending.get(said.message.id):
            place = _place(ordered, said, pending)
            followed = (one for one in ordered[place:] if one.topic == "out")
            pending[said.message.id] = sum(one.message.id == said.message.id for one in followed)
        elif said.topic == "in":
            early[said.message.id] = said
        ordered.insert(place, said)
    return ordered


def _place(
    ordered: Sequence[TopicMessage], answer: TopicMessage, pending: Mapping[str, int]
) -> int:
    """Returns where an answer belongs that came last.

    Args:
        ordered: What was recorded before it, in order.
        answer: The answer.
        pending: How many actions of each actuator have no answer.
    """
    later = pending[answer.message.id] - 1  # actions that may have followed from it
    earliest = answer.seconds - _SWAPPED_SECONDS
    last = takewhile(
        lambda one: one.seconds > earliest and one.topic in ("out", *_ABOUT_GOALS),
        reversed(ordered),
    )
    followed = list(last)  # from the answer, the last first
    own = [
        number
        for number, one in enumerate(followed)
        if one.topic == "out" and one.message.id == answer.message.id
    ]
    if not (later and own):
        followed = list(takewhile(lambda one: one.topic != "out", followed))
    elif len(own) > later:
        followed = followed[: own[later]]
    place = len(ordered) - len(followed)
    before = ordered[place - 1]
    is_other = before.topic == "in" and before.message.id not in pending
    is_cause = before.topic in ("goal", "cancel") or (is_other and later > 0)
    return len(ordered) if is_cause else place


class Historian:
    """Tells one run."""

    def __init__(self) -> None:
        """Begins in step 0."""
        self._step = 0
        self._horizon = 0
        self._acting: Set[str] = set()
        self._answered: Set[str] = set()
        self._goals: Dict[str, float] = {}  # open ones: when they were sent, in seconds
        self._statuses: Dict[str, Status] = {}

    def entries(self, recorded: Iterable[TopicMessage]) -> Iterator[Entry]:
        """Yields the events that messages make known; these come in the order of the bag."""
        number = 0
        for said in in_order(recorded):
            for event in getattr(self, f"_{said.topic}")(said.message):
                number += 1
                yield Entry(event, self._step, self._horizon, number, said.seconds)

    def _goal(self, message: Any) -> Iterator[Event]:
        identifier = message.goal_id.id
        if identifier not in self._goals and identifier not in self._statuses:
            self._goals[identifier] = _seconds(message.goal_id.stamp)
            goal = message.goal
            information = getattr(goal, "information", ())  # there is none in OLDER_MD5SUMS
            yield journal.GoalArrived(identifier, goal.request, tuple(map(str, information)))

    def _cancel(self, message: Any) -> Iterator[Event]:
        # As actionlib has it: a goal, all until a time, or all.
        until = _seconds(message.stamp)
        for identifier, sent in list(self._goals.items()):
            is_all = not message.id and not until
            if identifier == message.id or is_all or sent <= until:
                yield journal.CancelArrived(identifier)

    def _in(self, message: Any) -> Iterator[Event]:
        yield journal.MessageArrived(message.id, message.value)
        if message.id in self._acting:
            self._answered.add(message.id)

    def _out(self, message: Any) -> Iterator[Event]:
        if message.id == SOLVER:  # the whole plan of a static mode
            yield journal.PlanFound(tuple(split_list(message.action.strip("[]"))))
            yield journal.CommandDone("publish")
            return
        if self._acting <= self._answered:
            self._step += 1
            self._acting.clear()
            self._answered.clear()
        self._acting.add(message.id)
        yield journal.ActionPublished(message.id, message.action)

    def _status(self, message: Any) -> Iterator[Event]:
        for status in message.status_list:
            yield from self._change(status)

    def _feedback(self, message: Any) -> Iterator[Event]:
        found = _HORIZON.fullmatch(message.feedback.status)
        if found:
            self._horizon = int(found[1])
        yield from ()

    def _result(self, message: Any) -> Iterator[Event]:
        return self._change(message.status)

    def _change(self, told: Any) -> Iterator[Event]:
        identifier, status = told.goal_id.id, _STATUSES.get(told.status)
        if identifier not in self._goals or not status or self._statuses.get(identifier) is status:
            return
        self._statuses[identifier] = status
        if status is Status.ACCEPTED:
            yield journal.StatusSet(identifier, status)
        else:
            del self._goals[identifier]
            yield journal.StatusSet(identifier, status, reason=Reason.of(told.text))


def _seconds(stamp: Any) -> float:
    return float(stamp.sec + stamp.nanosec * 1e-9)
