"""Monitor of the loop: its thread marks what it does, for others to read while it is busy.

The loop's state belongs to its thread. So that thread marks here what it begins, and makes a
:class:`LoopSummary` of its state when it polls the inbox and one is wanted. Each attribute is
replaced as a whole, so nothing is locked.

>>> monitor = LoopMonitor()
>>> monitor.note_decision("plan(3)")
>>> with monitor.search("horizon 3"):
...     monitor.activity[:2]
(<Doing.SEARCHES: 'searches'>, 'horizon 3')
>>> monitor.activity[:2], monitor.searched is None
((<Doing.RUNS: 'runs'>, 'plan(3)'), False)
"""

from __future__ import annotations

import contextlib
import enum
import time
from dataclasses import dataclass
from typing import FrozenSet, Iterator, NamedTuple, Optional, Tuple

from rosoclingo.loop.values.execution import Execution, HeldAction


class Doing(str, enum.Enum):
    """Activities of the loop's thread; the value is the word in diagnostics."""

    STARTS = "starts"  # waits for its solvers, and makes them begin or go on
    DECIDES = "decides"  # asks the controller for a command
    RUNS = "runs"  # carries a command out
    SEARCHES = "searches"  # for a plan
    IMPROVES = "improves"  # searches for a better plan, until something comes
    WAITS = "waits"  # for inputs
    LACKS = "lacks"  # waits for a solver that was lost
    ENDED = "ended"

    __str__ = str.__str__


class CurrentActivity(NamedTuple):
    """The activity of the loop's thread, with its beginning.

    Attributes:
        doing: What kind of thing.
        what: More of that, such as the command.
        since: Since when, in seconds of the monotonic clock.
    """

    doing: Doing
    what: str
    since: float


@dataclass(frozen=True)
class LoopSummary:
    """An immutable summary of the loop's state, which any thread may read.

    Attributes:
        time: When it was made, in seconds of the environment's clock, which is the monotonic one
            in nodes; None if it was not made yet.
        step: The current step.
        horizon: The step at which all has to be done.
        is_through: Whether the mode is through with its work, as when its plan is published.
        goals_open: How many goals have a slot and have not ended.
        goals_waiting: How many wait for a slot.
        goals_unserved: How many of those with a slot the plan does not serve.
        untold: How many messages and cancel requests the planner does not know yet.
        is_paused: Whether an operator has paused the run.
        on_hold: The actuators that an operator has put on hold.
        held: The actions that wait for an operator.
        timed_out: The actuators that have answered nothing since an action of theirs timed out, or
            their interface was lost.
        run: The id of the run.
        executions: The last one of each actuator.
    """

    time: Optional[float] = None
    step: int = 0
    horizon: int = 0
    is_through: bool = False
    goals_open: int = 0
    goals_waiting: int = 0
    goals_unserved: int = 0
    untold: int = 0
    is_paused: bool = False
    on_hold: Tuple[str, ...] = ()
    held: Tuple[HeldAction, ...] = ()
    timed_out: FrozenSet[str] = frozenset()
    run: str = ""
    executions: Tuple[Execution, ...] = ()

    @property
    def all_waiting(self) -> int:
        """How many goals wait, for a slot or for what the plan needs to serve them."""
        return self.goals_waiting + self.goals_unserved


class LoopMonitor:
    """The activity of the loop's thread, and the last summary of its state.

    That thread writes, but for ``is_wanted``. Any thread may read.

    Attributes:
        activity: What it does.
        decided: When the controller has decided last, in seconds of the monotonic clock.
        searched: How long the last search for a plan took that is over, in seconds.
        planning_since: Since when a plan is searched for, over all horizons, in seconds of the
            monotonic clock; None if there is one.
        end: Why the loop has ended; empty if it has not, or was shut down.
        summary: The last summary.
        is_wanted: Whether another summary is wanted.
    """

    def __init__(self) -> None:
        self.activity = CurrentActivity(Doing.STARTS, "", time.monotonic())
        self.decided: Optional[float] = None
        self.searched: Optional[float] = None
        self.planning_since: Optional[float] = None
        self.end = ""
        self.summary = LoopSummary()
        self.is_wanted = False
        self._command = ""  # which is carried out

    def begin(self, doing: Doing, what: str = "") -> None:
        """Marks what the thread begins; since when does not change if it does that already."""
        if self.activity[:2] != (doing, what):
            self.activity = CurrentActivity(doing, what, time.monotonic())

    def note_decision(self, command: str) -> None:
        """Marks that the controller has decided on a command, which begins."""
        self._command = command
        self.go_on()
        self.decided = self.activity.since

    def go_on(self) -> None:
        """Marks that a command goes on, after a search for instance."""
        self.activity = CurrentActivity(Doing.RUNS, self._command, time.monotonic())

    @contextlib.contextmanager
    def search(self, what: str) -> Iterator[None]:
        """A context in which a plan is searched for, as a part of a command."""
        self.begin(Doing.SEARCHES, what)
        since = self.activity.since
        try:
            yield
        finally:
            self.go_on()
            self.searched = self.activity.since - since

    @contextlib.contextmanager
    def interlude(self, doing: Doing, what: str) -> Iterator[None]:
        """A context in which the thread does something else than before, which then goes on."""
        before = self.activity
        self.begin(doing, what)
        yield
        self.activity = before
