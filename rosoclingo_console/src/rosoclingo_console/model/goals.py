"""The goals of a system as rows: status, slot, place in the queue, and when they will be served."""

from __future__ import annotations

import re
from collections import deque
from dataclasses import dataclass
from itertools import islice
from typing import Deque, Dict, List, NamedTuple, Optional

from rosoclingo.bags.run_model import RunModel, TrackedGoal
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Status
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
class GoalFeedback:
    """The feedback that a goal's client has received.

    Attributes:
        place: Its place in the queue, from 1; 0 if it has none, or if that is not known.
        line: The last line of feedback that is none of the others.
        why: Why it waits or has no plan; until that is known, that it does.
        unexplained: Why the last search for that reason has found none; empty if none has ended so.
        late: By how much it will be late, as ``12 s``; empty if it says nothing of that.
    """

    place: int = 0
    line: str = ""
    why: str = ""
    unexplained: str = ""
    late: str = ""


class GoalTable:
    """All open goals of a run, and those that have ended last. Not thread-safe.

    Attributes:
        counts: How many goals have ended with each status.
    """

    def __init__(self, run: RunModel) -> None:
        """Begins before the first event.

        Args:
            run: The run, whose last goals alone it keeps.
        """
        self._run = run
        self._feedback: Dict[str, GoalFeedback] = {}
        self._ended: Deque[str] = deque()
        self._early: Dict[str, Deque[str]] = {}  # what was told of goals that are not known yet
        self.counts: Dict[Status, int] = {}

    def hear(self, event: journal.Event) -> None:
        """Takes an event of the journal, which the run has taken."""
        if isinstance(event, journal.GoalArrived):
            for line in self._early.pop(event.goal, ()):
                self.tell(event.goal, line)
        elif isinstance(event, journal.StatusSet):
            goal = self._run.goals[event.goal]
            self._of(goal).place = 0
            if goal.ended is not None and event.goal not in self._ended:
                self.counts[goal.status] = self.counts.get(goal.status, 0) + 1
                self._ended.append(event.goal)
            if len(self._ended) > _MOST_ENDED:
                oldest = self._ended.popleft()
                self._run.forget(oldest)
                self._feedback.pop(oldest, None)

    def tell(self, identifier: str, line: str) -> None:
        """The client of a goal was told something, which may be heard before the goal itself."""
        goal = self._run.goals.get(identifier)
        if goal is None:
            if len(self._early) >= _MOST_EARLY and identifier not in self._early:
                del self._early[next(iter(self._early))]
            self._early.setdefault(identifier, deque(maxlen=_MOST_EARLY)).append(line)
            return
        if goal.ended is not None:
            return
        told, queued = self._of(goal), _QUEUED.fullmatch(line)
        if queued:
            told.place = int(queued[1]) if not goal.slot else 0
        elif line.startswith(_WHY):
            told.why, told.unexplained = line[len(_WHY) :], ""
        elif line.startswith(_NO_REASON):
            told.unexplained = line[len(_NO_REASON) :]
        elif line.startswith(_NO_PLAN):
            told.why, told.unexplained = line, ""
        elif line.startswith(_LATE):
            told.late = line[len(_LATE) :]
        elif not line.startswith(_EXPECTED):  # the plan says that of all goals, and the time
            told.line = line
            if line.startswith("plan "):  # another one, so that what was said before is old
                told.why = told.unexplained = ""
            elif line.startswith(_WAITING):
                told.why = told.why or _NO_ACTION

    @property
    def open(self) -> List[TrackedGoal]:
        """The goals that have not ended, in order of arrival."""
        return [goal for goal in self._run.goals.values() if goal.ended is None]

    def fate(self, identifier: str) -> Optional[GoalFate]:
        """Returns what has become of a goal; None if it is not known. Thread-safe."""
        goal = self._run.goals.get(identifier)
        if goal is None:
            return None
        text, place = "", self._feedback.get(identifier, _NONE).place
        if goal.status.is_terminal:
            is_asked = goal.status is Status.SUCCEEDED or not goal.reason
            text = _WORDS[goal.status] + ("" if is_asked else f": {goal.reason}")
        elif goal.status is Status.ACCEPTED:
            text = "accepted" + (f", in slot {goal.slot}" if goal.slot else "")
        elif place:
            text = f"queued, place {place}"
        return GoalFate(goal.status, text, goal.cancelled is not None)

    def rows(self, times: PlanTimes) -> Dict[str, Row]:
        """Returns the goals that are shown: all with a slot, the first that wait, the last ended.

        Args:
            times: When goals will be served and are due.
        """
        waiting = [goal.id for goal in self.open if not goal.slot]
        hidden = set(islice(waiting, _MOST_WAITING, None))
        goals = self._run.goals.items()
        return {key: self._row(goal, times) for key, goal in goals if key not in hidden}

    def _of(self, goal: TrackedGoal) -> GoalFeedback:
        return self._feedback.setdefault(goal.id, GoalFeedback())

    def _row(self, goal: TrackedGoal, times: PlanTimes) -> Row:
        return {
            "number": goal.number,
            "request": goal.request,
            "information": list(goal.information),
            "came": goal.came if goal.has_arrived else None,
            "ended": goal.ended,
            "status": goal.status.value,
            "slot": goal.slot,
            "reason": goal.reason,
            "canceling": goal.cancelled is not None,
            "expected": times.expected.get(goal.slot) if goal.ended is None else None,
            "due": times.due.get(goal.slot) if goal.ended is None else None,
            **vars(self._feedback.get(goal.id, _NONE)),
        }


_NONE = GoalFeedback()
