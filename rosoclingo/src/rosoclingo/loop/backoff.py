"""Exponential backoff and rate limit of inputs, so that each search ends under any rate of them.

>>> backoff = Backoff()
>>> backoff.restart(0.0)  # something has come, and planning begins
>>> backoff.holds(0.0)  # the next input may interrupt it at once
False
>>> backoff.restart(1.0)  # it does, after a second
>>> [backoff.holds(time) for time in (1.1, 4.9, 5.0)]
[True, True, False]
>>> backoff.reset()  # the planning is over
>>> backoff.holds(1.1)
False
"""

from __future__ import annotations

from typing import Optional

_FACTOR = 4.0
"""The hold-off after an interruption, in lengths of the attempt that was interrupted.

If planning takes D seconds without interruptions, attempts that fail take 4/3 D together at most.
"""


class Backoff:
    """Exponential backoff of the inputs that interrupt planning.

    Planning begins when the loop tells the planner what has come, and is over when the loop waits:
    its searches, and the commands between them that publish what was found. The first input
    interrupts it at once. After that, inputs are held back for a time that grows with each
    interruption. So planning comes to its end, and no input waits longer than four times the
    attempt that it has interrupted.
    """

    def __init__(self) -> None:
        self._since: Optional[float] = None  # when the attempt began
        self._hold = 0.0  # for how many seconds it is not disturbed

    def restart(self, now: float) -> None:
        """Begins an attempt at planning, the first one or one after an interruption.

        Args:
            now: What time it is, in seconds of a clock that never goes back.
        """
        if self._since is not None:
            self._hold = max(self._hold, _FACTOR * (now - self._since))
        self._since = now

    def reset(self) -> None:
        """Ends planning: the next input may interrupt at once."""
        self._since = None
        self._hold = 0.0

    def holds(self, now: float) -> bool:
        """Tells if inputs have to wait."""
        return self._since is not None and now < self._since + self._hold


_FIRST_PAUSE = 0.05
_LONGEST_PAUSE = 1.0


class Pace:
    """Rate limit of the steps that messages begin while the robot has nothing to do.

    Each message begins a step at once, unless one before has just done so. Then there are pauses
    that grow up to a second, and end when actions are published, or fewer messages come.
    """

    def __init__(self) -> None:
        self._began = 0.0  # the last step
        self._pause = 0.0

    def begin_step(self, now: float) -> None:
        """Counts a step that messages have begun."""
        if now - self._began > 2 * max(self._pause, _FIRST_PAUSE):
            self._pause = 0.0
        else:
            self._pause = min(max(2 * self._pause, _FIRST_PAUSE), _LONGEST_PAUSE)
        self._began = now

    def reset(self) -> None:
        """Ends the pauses, since there was something to do."""
        self._pause = 0.0

    def holds(self, now: float) -> bool:
        """Tells if messages have to wait."""
        return now < self._began + self._pause
