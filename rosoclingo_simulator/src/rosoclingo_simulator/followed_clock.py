"""Keeps a simulation in step with the clock of another one. Needs no ROS."""

from __future__ import annotations

import threading
import time
from typing import Callable, Optional

_SLICE_SECONDS = 0.1  # of wall time; longer waits would hold up those who ask the simulation
_SILENCE_SECONDS = 5.0  # of wall time, between two reminders
_LATE_SECONDS = 10.0  # of the clock; who is later leaves out what was missed
_ROUNDING = 1e-6  # seconds, what times may be off


class FollowedClock:
    """Paces simulated steps by another clock.

    A clock that begins anew, or leaps ahead, is followed at once. :meth:`wait` is for one thread,
    :meth:`tell` is thread-safe.
    """

    def __init__(
        self, warn: Callable[[str], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Starts without a time.

        Args:
            warn: Called with a text when something is wrong with the clock.
            clock: Returns wall time, in seconds.
        """
        self._warn = warn
        self._clock = clock
        self._changed = threading.Condition()  # guards the two below
        self._now: Optional[float] = None
        self._heard = clock()
        self._reminded = clock()
        self._last: Optional[float] = None  # when the last step was due

    def tell(self, seconds: float) -> None:
        """Handles a new time of the clock."""
        with self._changed:
            self._now = seconds
            self._heard = self._clock()
            self._changed.notify_all()

    def wait(self, seconds: float) -> Optional[float]:
        """Waits until the next step is due, for a moment at most.

        Args:
            seconds: How long a step is.

        Returns:
            How far the clock has jumped since the last step, in seconds; the first time, what it
            says before the first step. None if no step is due yet.
        """
        due = seconds if self._last is None else self._last + seconds
        with self._changed:
            self._changed.wait_for(lambda: self._is_due(due, seconds), _SLICE_SECONDS)
            now, heard = self._now, self._heard
            if now is None or not self._is_due(due, seconds):
                self._remind(heard)
                return None
        jump = 0.0
        if self._last is None or now < due - _ROUNDING or now > due + _LATE_SECONDS:
            jump = now - due
            if self._last is not None:
                self._warn(
                    f"/clock has jumped by {jump:.2f} s: the robot has stood still meanwhile"
                )
        self._last = due + jump
        return jump

    def _is_due(self, due: float, seconds: float) -> bool:
        """Whether a step is due, or the clock has gone back behind the last one."""
        now = self._now
        if now is None:
            return False
        back = now < due - seconds - _ROUNDING
        return self._last is None or back or now >= due - _ROUNDING

    def _remind(self, heard: float) -> None:
        now = self._clock()
        if now - max(heard, self._reminded) >= _SILENCE_SECONDS:
            self._reminded = now
            self._warn(
                "the simulator stands still, because nothing comes on /clock: start the simulator "
                "that publishes it, or this one with _clock:=true"
            )
