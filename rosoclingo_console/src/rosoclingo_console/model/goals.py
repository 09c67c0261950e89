"""The goals of a system as rows: status, slot, place in the queue, and when they will be served."""

from __future__ import annotations

import re
from collections import deque
from dataclasses import dataclass
from itertools import islice
from typing import Any, Deque, Dict, List, NamedTuple, Optional, Tuple

from rosoclingo.loop.journal import GoalArrived, Status, StatusSet
from rosoclingo.loop.values.plan_times import PlanTimes
from rosoclingo_console.model.board import Row

_MOST_EARLY = 16  # goals of which something is heard before they are, and lines of each
_MOST_WAITING = 200  # goals without a slot that are shown
_MOST_ENDED = 50  # goals that have ended, of those that are shown
_QUEUED = re.compile(r"queued (\d{1,9})")
_WHY = "why: "
_LATE = "late by "
_NO_PLAN = "no plan "
_NO_REASON = "no reason found yet: "
_WAITING = "waiting in step "
_NO_ACTION = "the plan has no action for it now"
_EXPECTED = "expected in "
_WORDS = {status: status.value for status in Status}
_WORDS[Status.CANCELED] = "cancelled"


class GoalFate(NamedTuple):
    """The state of a goal.

    Attributes:
        status: Its status.
        text: That in words, with slot, place in the queue or reason; empty while the loop has not
            decided on it.
        canceling: Whether the loop has taken a cancel request for it.
    """

    status: Status
    text: str
    canceling: bool

    @property
    def is_refused(self) -> bool:
        """True if it has ended because it cannot be served."""
        return self.status in (Status.REJECTED, Status.ABORTED)


@dataclass
class GoalRow:
    """A goal, as far as the journal and the feedback for its client say it.

    Attributes:
        number: Counts the goals, in the order in which the loop has taken them.
        request: The request; empty if only its status was heard.
        information: What came with it.
        came: When it was taken, in seconds of wall time; None if that was before the journal's
            beginning.
        ended: When it has ended, by the same clock; None while it is open.
        status: Its status.
        slot: The planner's id for it; empty while it waits for one.
        reason: Why it has ended so.
        place: Its place in the queue, from 1; 0 if it has none, or if that is not known.
        canceling: Whether its cancellation was requested.
        line: The last line of feedback that is none of the others.
        why: Why it waits or has no plan; until that is known, that it does.
        unexplained: Why the last search for that reason has found none; empty if none has ended so.
        late: By how much it will be late, as ``12 s``; empty if it says nothing of that.
    """

    number: int
    request: str = ""
    information: Tuple[str, ...] = ()
    came: Optional[float] = None
    ended: Optional[float] = None
    status: Status = Status.PENDING
    slot: str = ""
    reason: str = ""
    place: int = 0
    canceling: bool = False
    line: str = ""
    why: str = ""
    unexplained: str = ""
    late: str = ""


class GoalTable:
    """All open goals of a run, and those that have ended last. Not thread-safe.

    Attributes:
        counts: How many goals have ended with each status.
        requests: The requests of the goals that are known, by the goals' ids.
    """

    def __init__(self) -> None:
        self._goals: Dict[str, GoalRow] = {}
        self._ended: Dict[str, None] = {}  # in order
        self._early: Dict[str, Deque[str]] = {}  # what was told of goals that are not known yet
        self._count = 0
        self.counts: Dict[Status, int] = {}
        self.requests: Dict[str, str] = {}

    def arrive(self, event: GoalArrived, time: float) -> None:
        """The loop has taken a goal."""
        goal = self._goal(event.goal)
        goal.request, goal.information, goal.came = event.request, event.information, time
        self.requests[event.goal] = event.request
        for line in self._early.pop(event.goal, ()):
            self.tell(event.goal, line)

    def cancel(self, identifier: str) -> None:
        """The loop has taken a cancel request."""
        self._goal(identifier).canceling = True

    def set_status(self, event: StatusSet, time: float) -> None:
        """A goal's status has changed."""
        goal = self._goal(event.goal)
        goal.slot, goal.place = event.slot or goal.slot, 0
        if event.status.is_terminal:
            goal.ended, goal.reason = time, str(event.reason)
            self.counts[event.status] = self.counts.get(event.status, 0) + 1
            self._ended[event.goal] = None
        goal.status = event.status  # last, as other threads look at it
        if len(self._ended) > _MOST_ENDED:
            oldest = next(iter(self._ended))
            del self._ended[oldest], self._goals[oldest]
            self.requests.pop(oldest, None)

    def tell(self, identifier: str, line: str) -> None:
        """The client of a goal was told something, which may be heard before the goal itself."""
        goal = self._goals.get(identifier)
        if goal is None:
            if len(self._early) >= _MOST_EARLY and identifier not in self._early:
                del self._early[next(iter(self._early))]
            self._early.setdefault(identifier, deque(maxlen=_MOST_EARLY)).append(line)
            return
        if goal.ended is not None:
            return
        queued = _QUEUED.fullmatch(line)
        if queued:
            goal.place = int(queued[1]) if not goal.slot else 0
        elif line.startswith(_WHY):
            goal.why, goal.unexplained = line[len(_WHY) :], ""
        elif line.startswith(_NO_REASON):
            goal.unexplained = line[len(_NO_REASON) :]
        elif line.startswith(_NO_PLAN):
            goal.why, goal.unexplained = line, ""
        elif line.startswith(_LATE):
            goal.late = line[len(_LATE) :]
        elif not line.startswith(_EXPECTED):  # the plan says that of all goals, and the time
            goal.line = line
            if line.startswith("plan "):  # another one, so that what was said before is old
                goal.why = goal.unexplained = ""
            elif line.startswith(_WAITING):
                goal.why = goal.why or _NO_ACTION

    @property
    def open(self) -> List[GoalRow]:
        """The goals that have not ended, in order of arrival."""
        return [goal for key, goal in self._goals.items() if key not in self._ended]

    def fate(self, identifier: str) -> Optional[GoalFate]:
        """Returns what has become of a goal; None if it is not known. Thread-safe."""
        goal = self._goals.get(identifier)
        if goal is None:
            return None
        text = ""
        if goal.status.is_terminal:
            is_asked = goal.status is Status.SUCCEEDED or not goal.reason
            text = _WORDS[goal.status] + ("" if is_asked else f": {goal.reason}")
        elif goal.status is Status.ACCEPTED:
            text = "accepted" + (f", in slot {goal.slot}" if goal.slot else "")
        elif goal.place:
            text = f"queued, place {goal.place}"
        return GoalFate(goal.status, text, goal.canceling)

    def rows(self, times: PlanTimes) -> Dict[str, Row]:
        """Returns the goals that are shown: all with a slot, the first that wait, the last ended.

        Args:
            times: When goals will be served and are due.
        """
        waiting = [key for key, goal in self._goals.items() if not goal.slot and not goal.ended]
        hidden = set(islice(waiting, _MOST_WAITING, None))
        return {key: _row(goal, times) for key, goal in self._goals.items() if key not in hidden}

    def _goal(self, identifier: str) -> GoalRow:
        if identifier not in self._goals:
            self._count += 1
            self._goals[identifier] = GoalRow(self._count)
        return self._goals[identifier]


def _row(goal: GoalRow, times: PlanTimes) -> Row:
    row: Dict[str, Any] = dict(vars(goal))
    row["status"] = goal.status.value
    row["information"] = list(goal.information)
    row["expected"] = times.expected.get(goal.slot) if goal.ended is None else None
    row["due"] = times.due.get(goal.slot) if goal.ended is None else None
    return row
