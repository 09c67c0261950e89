"""Templates of announced terms, with a variable for a waypoint or a value. Needs no ROS.

>>> TermTemplate.parse("at(mailbot,W)", PLACE_VARIABLE).fill("c3")
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

VALUE_VARIABLE = "V"
"""The variable that stands for the value of a field."""

_MEANINGS = {
    PLACE_VARIABLE: ("a waypoint", "nearest_waypoint", "at(mailbot,W)"),
    VALUE_VARIABLE: ("a value", "value", "battery(V)"),
}

_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|_*[A-Za-z]\w*')


@dataclass(frozen=True)
class TermTemplate:
    """A term, possibly with a variable.

    Attributes:
        text: In clingo's syntax.
        variable: The variable that it has; empty for none.
    """

    text: str
    variable: str = ""

    @classmethod
    def parse(cls, text: str, variable: str = "") -> TermTemplate:
        """Checks a template.

        Args:
            text: In clingo's syntax.
            variable: The one that it has to have, and no other; empty for none.

        Raises:
            EntryError: It is no term, or has other variables.
        """
        template = cls(text, variable)
        used = {match[0] for match in _TOKEN.finditer(text)}
        for name, (meaning, condition, _) in _MEANINGS.items():
            if name in used and name != variable:
                raise EntryError(
                    f"{quote(text)}: {name} stands for {meaning} in tell of {condition} only"
                )
        try:
            parse_term(template.fill("c3"))
        except TermError as err:
            raise EntryError(f"{quote(text)} cannot be told: {err}") from err
        if variable and variable not in used:
            meaning, _, example = _MEANINGS[variable]
            raise EntryError(
                f"{quote(text)} does not say which {meaning[2:]}: write {variable} for it, such "
                f"as {example}"
            )
        return template

    def fill(self, value: str) -> str:
        """Returns the term with a waypoint or a value in the variable's place, as clingo prints it.

        Raises:
            TermError: It is no term.
        """
        filled = _TOKEN.sub(
            lambda match: value if match[0] == self.variable else match[0], self.text
        )
        return str(parse_term(filled))
