"""Alarms: messages that an encoding is told after a time, such as that a way is free again.

A plan shows which ones it waits for. Each is due so many seconds after it was first shown, and is
forgotten when a plan shows it no more:

>>> alarms = Alarms()
>>> alarms.set({"unblocked(a,b)": 60}, now=100.0)
>>> alarms.set({"unblocked(a,b)": 60, "unblocked(b,c)": 30}, now=150.0)
>>> alarms.take_due(159.0), alarms.take_due(160.0), alarms.take_due(161.0)
([], ['unblocked(a,b)'], [])
>>> alarms.due
{'unblocked(a,b)': 160.0, 'unblocked(b,c)': 180.0}

They also keep the clock that the encoding is told, without rounding errors:

>>> alarms = Alarms()
>>> [alarms.read_clock(time) for time in (14.1, 14.1 + 50)], 14.1 + 50 - 14.1 < 50
([(1, 0.0), (2, 50.0)], True)
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Dict, List, Mapping, Optional, Tuple

_DIGITS = 3  # of seconds of the clock


@dataclass
class Alarms:
    """The alarms that are set; all of it is saved. Only the loop's thread uses it.

    Attributes:
        due: When each is due, in seconds of the world's time, by messages.
        last: The latest time that is known, in seconds; a clock that is behind it has begun anew.
        sent: The messages that were sent, and are still set.
        began: When the clock was read first, in seconds of the world's time; None before.
        readings: How often it was read.
    """

    due: Dict[str, float] = field(default_factory=dict)
    last: float = 0.0
    sent: List[str] = field(default_factory=list)
    began: Optional[float] = None
    readings: int = 0

    def set(self, seconds: Mapping[str, int], now: float) -> None:
        """Sets alarms, and forgets all others; those that were set before are due when they were.

        Args:
            seconds: In how many seconds each new one is due, by messages.
            now: The world's time, in seconds.
        """
        self._follow(now)
        self.due = {one: self.due.get(one, now + after) for one, after in seconds.items()}
        self.sent = [one for one in self.sent if one in self.due]

    def take_due(self, now: float) -> List[str]:
        """Returns the messages that are due and were not returned before.

        Args:
            now: The world's time, in seconds.
        """
        if not self.due:
            return []
        self._follow(now)
        due = [one for one, at in self.due.items() if at <= now and one not in self.sent]
        self.sent += due
        return due

    def read_clock(self, now: float) -> Tuple[int, float]:
        """Returns the number of this reading, and the seconds since the first one.

        These are rounded: when an alarm after whole seconds comes, the clock must have reached it.

        Args:
            now: The world's time, in seconds.
        """
        self._follow(now)
        if self.began is None:
            self.began = now
        self.readings += 1
        return self.readings, round(now - self.began, _DIGITS)

    def _follow(self, now: float) -> None:
        """Moves alarms with a clock that begins anew, as that of a simulator."""
        if now < self.last:
            self.due = {one: at + now - self.last for one, at in self.due.items()}
            self.began = None if self.began is None else self.began + now - self.last
        self.last = now

    def next(self) -> float:
        """Returns when the next one is due, in seconds of the world's time; infinite if none is."""
        return min((at for one, at in self.due.items() if one not in self.sent), default=math.inf)
