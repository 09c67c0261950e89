"""What a user types to block a path."""

from __future__ import annotations

import pytest

from rosclingo.errors import TermError
from rosoclingo_interfaces.announcements import parse_line
from rosoclingo_interfaces.errors import LineError


@pytest.mark.parametrize(
    ("line", "announced"),
    [
        ("b c3 c4", "blocked(c3,c4)"),
        (" u\tc3  c4 ", "unblocked(c3,c4)"),
        ("b c(1) c(2)", "blocked(c(1),c(2))"),
        ("u 1 f(2,3)", "unblocked(1,f(2,3))"),
    ],
)
def test_lines(line: str, announced: str) -> None:
    assert parse_line(line) == announced


@pytest.mark.parametrize("line", ["b", "b c3", "b c3 c4 c5", "x c3 c4", "B c3 c4", "c3 c4 b", ""])
def test_wrong_lines(line: str) -> None:
    with pytest.raises(LineError, match="expected b FROM TO or u FROM TO"):
        parse_line(line)


@pytest.mark.parametrize("line", ["b c3 C4", "b ) (", "u c3),x(c4 c5", "b c3 c4;c5"])
def test_wrong_waypoints(line: str) -> None:
    with pytest.raises(TermError):
        parse_line(line)
