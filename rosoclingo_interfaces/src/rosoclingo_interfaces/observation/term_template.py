"""Templates of announced terms, with the variable ``W`` for a waypoint. Needs no ROS.

>>> TermTemplate.parse("at(mailbot,W)", has_waypoint=True).fill("c3")
'at(mailbot,c3)'
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from rosclingo.errors import TermError
from rosclingo.solver.terms import parse_term, quote
from rosoclingo_interfaces.errors import EntryError

PLACE_VARIABLE = "W"
"""The variable that stands for the waypoint."""

_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|_*[A-Za-z]\w*')


@dataclass(frozen=True)
class TermTemplate:
    """A term, possibly with a variable.

    Attributes:
        text: In clingo's syntax.
    """

    text: str

    @classmethod
    def parse(cls, text: str, has_waypoint: bool) -> TermTemplate:
        """Checks a template.

        Args:
            text: In clingo's syntax.
            has_waypoint: Whether it has to have the variable ``W``, or must not have it.

        Raises:
            EntryError: It is no term, or has other variables.
        """
        template = cls(text)
        uses = any(match[0] == PLACE_VARIABLE for match in _TOKEN.finditer(text))
        try:
            parse_term(template.fill("c3"))
        except TermError as err:
            raise EntryError(f"{quote(text)} cannot be told: {err}") from err
        if uses and not has_waypoint:
            raise EntryError(
                f"{quote(text)}: {PLACE_VARIABLE} stands for a waypoint in tell of "
                "nearest_waypoint only"
            )
        if has_waypoint and not uses:
            raise EntryError(
                f"{quote(text)} does not say which waypoint: write {PLACE_VARIABLE} for it, such "
                f"as at(mailbot,{PLACE_VARIABLE})"
            )
        return template

    def fill(self, waypoint: str) -> str:
        """Returns the term with a waypoint in the place of ``W``, as clingo prints it.

        Raises:
            TermError: It is no term.
        """
        filled = _TOKEN.sub(
            lambda match: waypoint if match[0] == PLACE_VARIABLE else match[0], self.text
        )
        return str(parse_term(filled))
