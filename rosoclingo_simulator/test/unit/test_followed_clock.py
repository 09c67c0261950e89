"""A simulation in step with the clock of another one."""

from __future__ import annotations

import threading
from typing import List, Optional

import pytest
from waiting import wait_for

from rosoclingo_simulator.followed_clock import FollowedClock

STEP = 0.05


class Wall:
    """Wall time that a test sets."""

    def __init__(self) -> None:
        self.now = 100.0
        self.warnings: List[str] = []
        self.followed = FollowedClock(self.warnings.append, lambda: self.now)

    def steps(self) -> List[float]:
        """Waits until no step is due, and returns the jumps of those that were."""
        jumps: List[float] = []
        jump: Optional[float] = self.followed.wait(STEP)
        while jump is not None:
            jumps.append(jump)
            jump = self.followed.wait(STEP)
        return jumps


@pytest.fixture
def wall() -> Wall:
    return Wall()


def test_no_step_before_the_clock_comes(wall: Wall) -> None:
    assert wall.steps() == []
    assert wall.warnings == []


def test_the_first_step_is_at_the_time_of_the_clock(wall: Wall) -> None:
    wall.followed.tell(12.3)
    (jump,) = wall.steps()
    assert jump + STEP == pytest.approx(12.3)
    assert wall.warnings == []


@pytest.mark.parametrize(("ahead", "steps"), [(0.0, 0), (0.03, 0), (0.05, 1), (0.1, 2), (3.0, 60)])
def test_as_many_steps_as_time_has_passed(wall: Wall, ahead: float, steps: int) -> None:
    wall.followed.tell(7.0)
    wall.steps()
    wall.followed.tell(7.0 + ahead)
    assert wall.steps() == [0.0] * steps
    assert wall.warnings == []


@pytest.mark.parametrize("there", [1.0, 5000.0])
def test_a_clock_that_jumps_is_followed(wall: Wall, there: float) -> None:
    wall.followed.tell(100.0)
    wall.steps()
    wall.followed.tell(there)
    (jump,) = wall.steps()
    assert 100.0 + STEP + jump == pytest.approx(there)
    assert "/clock has jumped by" in wall.warnings[0]
    wall.followed.tell(there + 0.1)
    assert wall.steps() == [0.0, 0.0]
    assert len(wall.warnings) == 1


def test_silence_is_told_of_once_in_a_while(wall: Wall) -> None:
    for seconds, warnings in ((0.0, 0), (4.9, 0), (5.1, 1), (9.0, 1), (10.2, 2)):
        wall.now = 100.0 + seconds
        assert wall.steps() == []
        assert len(wall.warnings) == warnings, seconds
    assert "nothing comes on /clock" in wall.warnings[0]
    assert "_clock:=true" in wall.warnings[0]
    wall.followed.tell(1.0)
    wall.steps()
    wall.now += 4.9
    assert wall.steps() == []
    assert len(wall.warnings) == 2


def test_a_step_that_becomes_due_ends_the_wait(wall: Wall) -> None:
    wall.followed.tell(1.0)
    wall.steps()
    threading.Timer(0.01, wall.followed.tell, [1.0 + STEP]).start()
    wait_for(lambda: wall.followed.wait(STEP) is not None)
