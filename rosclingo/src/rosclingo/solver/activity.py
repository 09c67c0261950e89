"""Activity of a solver: its thread marks what it does and since when, and any other reads that.

>>> activity = SolverActivity()
>>> activity.begin("grounding")
>>> activity.end()
>>> _, since = activity.doing
>>> solver_health(activity, since + 5.0, slow_seconds=30.0).message
'idle'
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import List, Optional, Tuple

from rosclingo.errors import shorten
from rosclingo.health import Health, HealthLevel, number, resident_megabytes

IDLE, GROUNDING, SOLVING = "idle", "grounding", "solving"


@dataclass(frozen=True)
class FailedRequest:
    """A request that has failed.

    Attributes:
        message: Why.
        time: When, in seconds of the monotonic clock.
    """

    message: str
    time: float


class SolverActivity:
    """Marks of what a solver does, and has done last.

    One thread writes, and takes no lock: each attribute is replaced as a whole.

    Attributes:
        atoms: How many atoms the grounding has, when it was last grounded; None before.
        searches: How many searches have begun.
        search_seconds: How long the last search took that is over; None before.
        failure: Why clingo is of no use until a restart; empty if it is.
    """

    def __init__(self) -> None:
        self.atoms: Optional[int] = None
        self.searches = 0
        self.search_seconds: Optional[float] = None
        self.failure = ""
        self._doing: Tuple[str, float] = (IDLE, time.monotonic())

    def begin(self, what: str) -> None:
        """Begins a command or a search, by a word or two."""
        self.searches += what == SOLVING
        self._doing = (what, time.monotonic())

    def end(self) -> None:
        """Ends that."""
        what, since = self._doing
        now = time.monotonic()
        if what == SOLVING:
            self.search_seconds = now - since
        self._doing = (IDLE, now)

    @property
    def doing(self) -> Tuple[str, float]:
        """The current activity, and when it began, in seconds of the monotonic clock."""
        return self._doing


def solver_health(
    activity: SolverActivity,
    now: float,
    *,
    slow_seconds: float,
    waiting: Optional[int] = None,
    failed: Optional[FailedRequest] = None,
) -> Health:
    """Returns the health of a solver. Thread-safe.

    A request that has failed is no concern: its client was told. But after an error of clingo's
    only a restart is sure to work.

    Args:
        activity: What the solver does.
        now: The time, in seconds of the monotonic clock.
        slow_seconds: After how long what it does is slow; 0 for never.
        waiting: How many requests wait for their turn; None if there is no queue.
        failed: The last request that has failed.
    """
    what, since = activity.doing
    seconds = max(0.0, now - since)
    level, message = HealthLevel.OK, what
    if what != IDLE:
        message = f"{what} for {seconds:.1f} s"
        if 0 < slow_seconds < seconds:
            level = HealthLevel.WARN
            message += f", longer than ~slow_seconds ({slow_seconds:g} s)"
    failure = activity.failure
    if failure:
        level, message = HealthLevel.ERROR, f"clingo failed, restart it: {shorten(failure)}"
    values: List[Tuple[str, str]] = [
        ("state", what),
        ("in this state (s)", number(seconds)),
        ("atoms", "unknown" if activity.atoms is None else str(activity.atoms)),
        ("searches", str(activity.searches)),
        ("last search (s)", number(activity.search_seconds)),
        ("memory (MB)", number(resident_megabytes())),
    ]
    if waiting is not None:
        values.append(("requests in the queue", str(waiting)))
    if failed is not None:
        values += [
            ("last error", shorten(failed.message)),
            ("since the last error (s)", number(max(0.0, now - failed.time))),
        ]
    return Health("solver", level, message, tuple(values))
