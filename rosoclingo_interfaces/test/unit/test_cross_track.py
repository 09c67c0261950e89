"""How far off its way a robot is, and how long something stands still."""

from __future__ import annotations

import pytest

from rosoclingo_interfaces.navigation.cross_track import PathPoint, Way
from rosoclingo_interfaces.watchdog import Watchdog


@pytest.mark.parametrize(
    ("point", "expected"),
    [
        ((0.0, 0.0), 0.0),
        ((5.0, 0.0), 0.0),
        ((5.0, -2.0), 2.0),
        ((10.0, 1.5), 1.5),
        ((13.0, 4.0), 5.0),
        ((-3.0, -4.0), 5.0),
    ],
)
def test_a_straight_way(point: PathPoint, expected: float) -> None:
    assert Way((0.0, 0.0), (10.0, 0.0)).distance(point) == pytest.approx(expected)


def test_a_slanting_way() -> None:
    assert Way((1.0, 1.0), (4.0, 5.0)).distance((6.5, 3.125)) == pytest.approx(3.125)


def test_a_way_of_no_length() -> None:
    assert Way((1.0, 1.0), (1.0, 1.0)).distance((4.0, 5.0)) == 5.0


def test_back_round_a_corner() -> None:
    """The robot got stuck behind the corner at (0, 0), and is to go to where it was before that."""
    begin, corner, end = (6.0, 0.0), (0.0, 0.0), (0.0, 8.0)
    alone, way = Way(begin, end), Way(begin, end, corner)
    assert alone.distance(corner) == pytest.approx(4.8)
    for point in (begin, (3.0, 0.0), corner, (0.0, 4.0), end):
        assert way.distance(point) == 0.0
    assert way.distance((3.0, 4.0)) == pytest.approx(0.0)
    assert way.distance((9.0, -4.0)) == pytest.approx(5.0)


def test_a_pulse() -> None:
    now, value = 0.0, [0]
    watchdog = Watchdog(lambda: list(value), lambda: now)
    assert watchdog.still() == 0.0
    now = 4.0
    assert watchdog.still() == 4.0
    value[0] = 1
    assert watchdog.still() == 0.0
    now = 6.0
    assert watchdog.still() == 2.0
