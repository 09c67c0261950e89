"""An action under way: it can be cancelled, is answered once, and is timed by ROS's clock."""

from __future__ import annotations

import threading
import time
from contextvars import ContextVar
from typing import Callable, Optional, Tuple

import clingo

from rosoclingo.loop.values.served import ServedGoal
from rosoclingo_interfaces.errors import CanceledError
from rosoclingo_interfaces.ledger import Token

_SLICE_SECONDS = 0.05  # how often a wait looks at a clock that may be a simulator's

Clock = Callable[[], float]
"""Says the time in seconds."""

FindServedGoals = Callable[[], Tuple[ServedGoal, ...]]
"""Finds the goals that an action serves; may wait for seconds."""


class Stopwatch:
    """A stopwatch on a clock that may jump back. Thread-safe.

    A simulator that is started again sets its clock back: the step back counts for nothing, and
    time goes on from there. ROS's clock says 0 until the first time has come: the step from there
    counts for nothing either.
    """

    def __init__(self, clock: Clock) -> None:
        """Begins now.

        Args:
            clock: The time in seconds.
        """
        self._clock = clock
        self._lock = threading.Lock()  # guards the two below; held for moments only
        self._last = clock()
        self._sum = 0.0

    def seconds(self) -> float:
        """Returns the elapsed time, which never decreases."""
        with self._lock:
            now = self._clock()
            if 0 < self._last < now:
                self._sum += now - self._last
            self._last = now
            return self._sum


class ActionExecution:
    """An execution of an action by an actuator. Thread-safe.

    Attributes:
        actuator: Who is to act.
        action: What to do, a term.
        token: What the action is known by; None if it was published without a token.
        progress: The part of it that is done, from 0 to 1; None if that is unknown.
        canceled: Set as soon as the action is to stop: a wait for it ends at once.
        ended: Set as soon as nothing of the action runs any more.
    """

    def __init__(
        self,
        actuator: str,
        action: clingo.Symbol,
        clock: Clock = time.monotonic,
        token: Optional[Token] = None,
        find_served: FindServedGoals = tuple,
    ) -> None:
        """Begins now.

        Args:
            actuator: Who is to act.
            action: What to do, a term.
            clock: The time in seconds.
            token: What the action is known by; None if it was published without a token.
            find_served: Called by the first one that wants to know the served goals.
        """
        self.actuator = actuator
        self.action = action
        self.token = token
        self.progress: Optional[float] = None
        self.canceled = threading.Event()
        self.ended = threading.Event()
        self._stopwatch = Stopwatch(clock)
        self._find_served = find_served
        self._served: Optional[Tuple[ServedGoal, ...]] = None
        self._lock = threading.Lock()  # guards _closed; held for moments only
        self._closed = False

    def __str__(self) -> str:
        return f"{self.actuator}: {self.action}"

    @property
    def seconds(self) -> float:
        """Time since the action was requested."""
        return self._stopwatch.seconds()

    @property
    def served_goals(self) -> Tuple[ServedGoal, ...]:
        """The goals that the action serves; none if it names no slot of a goal.

        The first access may wait for 2 s, until they are known.
        """
        if self._served is None:  # two threads may find the same
            self._served = self._find_served()
        return self._served

    def close(self) -> bool:
        """Takes the right to answer, which only one caller gets.

        Returns:
            Whether the caller has it now.
        """
        with self._lock:
            closed, self._closed = self._closed, True
        return not closed

    def wait_until(self, event: threading.Event, end: float) -> bool:
        """Waits for an event, at most until :attr:`seconds` has reached an end.

        Returns:
            Whether the event is set.
        """
        while True:
            rest = end - self.seconds
            if rest <= 0:
                return event.is_set()
            if event.wait(min(rest, _SLICE_SECONDS)):
                return True

    def sleep(self, seconds: Optional[float] = None) -> None:
        """Waits some time of the node's clock, or for ever.

        Raises:
            CanceledError: The action is to stop, maybe since before the call.
        """
        end = None if seconds is None else self.seconds + seconds
        if self.canceled.wait() if end is None else self.wait_until(self.canceled, end):
            raise CanceledError(f"{self} was cancelled")


CURRENT: ContextVar[ActionExecution] = ContextVar("CURRENT")
"""The action that runs in a thread, as each thread has a context of its own."""


def current() -> ActionExecution:
    """Returns the action that runs in this thread.

    Raises:
        RuntimeError: There is none: the thread was not started for an action.
    """
    try:
        return CURRENT.get()
    except LookupError as err:
        raise RuntimeError(
            "no action runs in this thread; hand on self.execution from the action's method"
        ) from err
