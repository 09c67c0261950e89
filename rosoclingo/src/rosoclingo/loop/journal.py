"""What the planning loop has learned and done, event by event. Needs no ROS."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple

KINDS = (
    "goal", "cancel", "message", "dropped", "command", "plan", "action", "status", "waiting", "end",
)  # fmt: skip
"""The kinds of events, explained in ``ROSoClingoEvent.msg``."""

FOR_A_REPLAY = "for the replay"
"""Text of an event of the kind ``waiting``: it waits for what had come by then when recorded."""

SHUTDOWN = "the node is shutting down"
"""Text of an event of the kind ``end``, and reason of a status: the process was told to end."""

RECALLED = "recalled before it had a slot"
"""Reason of a status: the goal was canceled without the planner."""

BEST_SO_FAR = "the best so far"
"""Text of an event of the kind ``plan``: the search had no more time (``~search_seconds``)."""


@dataclass(frozen=True)
class Event:
    """One thing that the loop has learned or done; see ``ROSoClingoEvent.msg``.

    Attributes:
        kind: One of :data:`KINDS`.
        id: Who or what it is about.
        text: What it is.
        details: More about it.
        seconds: How long a command took, in seconds of wall time; for a goal, cancel request or
            message that was taken while a command was carried out, how long that had taken by then.
        step: The current step.
        horizon: The step that is planned up to.
    """

    kind: str
    id: str = ""
    text: str = ""
    details: Tuple[str, ...] = ()
    seconds: float = 0.0
    step: int = 0
    horizon: int = 0

    @property
    def is_search(self) -> bool:
        """Whether it is a command that searches for a plan, be it for another horizon or not."""
        return self.kind == "command" and self.text.partition("(")[0] in ("solve", "plan")
