"""Debounce and rate limit of an observer's announcements. Needs no ROS."""

from __future__ import annotations

import math
from typing import Optional

from rosoclingo_interfaces.observation.conditions import Reading
from rosoclingo_interfaces.observation.term_template import TermTemplate


class Teller:
    """Announces each lasting change of a reading once, with a rate limit.

    Times are seconds of one clock, which may begin anew.

    Attributes:
        reading: What was read last; nothing holds at first.
        standing: The term of what was told last; None if that holds no more.
    """

    def __init__(
        self, tell: TermTemplate, otherwise: Optional[TermTemplate], debounce: float, rate: float
    ) -> None:
        """Begins with nothing to tell.

        Args:
            tell: The term that is told when something holds.
            otherwise: The one when that has ended; None for nothing.
            debounce: For how long it has to be read before it is told, in seconds.
            rate: How many terms are told in a second at most; 0 for any number.
        """
        self.reading: Reading = None
        self.standing: Optional[str] = None
        self._tell = tell
        self._otherwise = otherwise
        self._debounce = debounce
        self._pause = 1.0 / rate if rate else 0.0
        self._since = -math.inf  # when this was read first
        self._told: Reading = None
        self._told_at = -math.inf

    def read(self, reading: Reading, now: float) -> None:
        """Takes a reading."""
        if reading != self.reading:
            self.reading, self._since = reading, now

    def due(self, now: float) -> Optional[str]:
        """Returns the term that is due to be announced, once; None if there is none.

        Raises:
            TermError: The waypoint's name makes no term of the template.
        """
        if now < max(self._since, self._told_at):  # the clock has begun anew
            self._since, self._told_at = min(now, self._since), -math.inf
        if self.reading == self._told or now - self._since < self._debounce:
            return None
        template = self._otherwise if self.reading is None else self._tell
        if template is not None and now - self._told_at < self._pause:
            return None
        self._told = self.reading
        self.standing = None if template is None else template.fill(self.reading or "")
        if template is not None:
            self._told_at = now
        return self.standing
