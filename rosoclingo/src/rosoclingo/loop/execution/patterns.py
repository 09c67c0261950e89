"""Patterns of actions, by which parameters name those that an operator or a policy is for.

>>> ActionPattern("deliver(*)").fits("robot", "deliver(3)")
True
>>> ActionPattern("do(robot(2),*)").fits("robot(2)", "go(3)")
True
"""

from __future__ import annotations

import re

from rosclingo.solver.terms import quote

_BLANKS = re.compile(r'("(?:\\.|[^"\\])*")|\s+')  # and strings, in which they count


class ActionPattern:
    """A pattern in which ``*`` stands for any text. Immutable.

    Attributes:
        text: The pattern, without blanks outside of strings.
    """

    def __init__(self, text: str) -> None:
        """Compiles a pattern.

        Args:
            text: The pattern of an action, or of one with its actuator, as ``do(robot,*)``.

        Raises:
            ValueError: Its brackets are not in pairs, as if it was cut at a blank.

        >>> ActionPattern("take(*, 2)").text
        'take(*,2)'
        """
        self.text = _BLANKS.sub(lambda found: found[1] or "", text)
        outside = _BLANKS.sub("", self.text)
        if not self.text or outside.count("(") != outside.count(")"):
            raise ValueError(
                f"{quote(text)} is no pattern of actions such as deliver(*): its brackets are not "
                "in pairs; a pattern with blanks is one of a list"
            )
        self._begin, *self._parts = self.text.split("*")

    def fits(self, actuator: str, action: str) -> bool:
        """Returns whether an action is among those that are meant."""
        texts = (action, f"do({actuator},{action})")
        return any(map(self._matches, texts))

    def _matches(self, text: str) -> bool:
        # No regular expression, which takes for ever for many ``*`` and a text that does not fit.
        if not self._parts:
            return text == self._begin
        *parts, end = self._parts
        if not text.startswith(self._begin):
            return False
        place = len(self._begin)
        for part in parts:
            place = text.find(part, place)
            if place < 0:
                return False
            place += len(part)
        return text.endswith(end) and len(text) - len(end) >= place
