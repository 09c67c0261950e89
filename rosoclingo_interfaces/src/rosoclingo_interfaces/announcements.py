"""What a user types to announce that a path is blocked. Needs no ROS."""

from __future__ import annotations

from rosclingo.solver.terms import parse_term, quote
from rosoclingo_interfaces.errors import LineError

SOURCE = "info"
"""The id of the messages."""

_WORDS = {"b": "blocked", "u": "unblocked"}


def parse_line(line: str) -> str:
    """Returns what a line announces, such as ``blocked(c3,c4)`` for ``b c3 c4``.

    Raises:
        LineError: The line is none of ``b FROM TO`` and ``u FROM TO``.
        TermError: A waypoint is no term.
    """
    words = line.split()
    if len(words) != 3 or words[0] not in _WORDS:
        raise LineError(f"expected b FROM TO or u FROM TO, such as b c3 c4, not {quote(line)}")
    begin, end = (parse_term(word) for word in words[1:])
    return f"{_WORDS[words[0]]}({begin},{end})"
