"""Values of a soak: what was wrong, what has happened, goals and nodes. Needs no ROS."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Tuple

_IN_FLIGHT_SECONDS = 2.0  # of wall time, for which a result may be on its way
_MISSING_SECONDS = 90.0  # of wall time, in which a node that was ended has to be there again


class Violation(NamedTuple):
    """Something that cannot be right.

    Attributes:
        seconds: When it was found, in seconds of simulated time.
        text: What it is.
        events: The journal's last events before that, with their numbers.
    """

    seconds: float
    text: str
    events: Tuple[str, ...] = ()


class Incident(NamedTuple):
    """Something that has happened, to be drawn.

    Attributes:
        seconds: When, in seconds of simulated time.
        kind: What sort of thing it is, such as ``delivered``.
        text: More about it.
    """

    seconds: float
    kind: str
    text: str = ""


@dataclass
class WatchedGoal:
    """A goal of a client.

    Attributes:
        request: What is asked for.
        sent: When, in seconds of simulated time.
        wall: The same in seconds of wall time; less than 0 if its latency does not count.
        finds_slot: Whether there was a free slot for it then.
        is_cancelled: Whether its client has asked to cancel it.
        is_acknowledged: Whether it was in a list of statuses.
        has_arrived: Whether the journal has it.
        status: What the journal says of it; empty before the first status.
        result: How it has ended, as its client has heard; empty before that.
        excuses: How many results may come again, since the client has asked again.
        heard: When the result came, in seconds of wall time.
        is_late: Whether it was said that it has not ended.
    """

    request: str
    sent: float
    wall: float
    finds_slot: bool
    is_cancelled: bool = False
    is_acknowledged: bool = False
    has_arrived: bool = False
    status: str = ""
    result: str = ""
    excuses: int = 0
    heard: float = 0.0
    is_late: bool = False

    def hear(self, word: str, wall: float, loop_ended: float) -> str:
        """Takes a result; returns what is wrong with it, or nothing.

        Args:
            word: How the goal has ended.
            wall: When it comes, in wall time.
            loop_ended: When the planning loop was ended last, in wall time. The next cannot know
                whether a result has left just before that.
        """
        before, since, self.result, self.heard = self.result, self.heard, word, wall
        if not before:
            return ""
        if before != word:
            return f", is {word}, and was {before} before"
        if loop_ended > since - _IN_FLIGHT_SECONDS:
            return ""
        if self.excuses > 0:
            self.excuses -= 1
            return ""
        return f": a second result, {word}"


@dataclass
class WatchedNode:
    """A node and its process.

    Attributes:
        name: The node's name.
        since: Since when its process is there, or missing, in seconds of wall time.
        pid: The process; 0 while there is none.
        is_ended: Whether the soak has ended it.
        is_late: Whether it was said that it does not come back.
    """

    name: str
    since: float
    pid: int = 0
    is_ended: bool = False
    is_late: bool = False

    def look(self, pid: int, wall: float) -> str:
        """Takes what process there is now; returns what is wrong with that, or nothing."""
        if pid == self.pid:
            missing = wall - self.since
            if pid or self.is_late or missing <= _MISSING_SECONDS:
                return ""
            self.is_late = True
            return f"{self.name} is not there after {missing:.0f} s"
        is_own_end = bool(self.pid) and not self.is_ended
        if pid:
            self.is_ended = False
        self.pid, self.since, self.is_late = pid, wall, False
        return f"{self.name} has ended by itself" if is_own_end else ""
