"""Guesses when the loop waited in a run whose bag has no journal. Needs no ROS."""

from __future__ import annotations

from dataclasses import replace
from typing import List, Sequence

from rosoclingo.bags.replay.inputs import LoopActivity, RecordedInput

_QUIET_SECONDS = 1.0  # so long without any event, and the loop waits


def guess_waits(inputs: Sequence[RecordedInput]) -> List[RecordedInput]:
    """Returns inputs of which the first one, and each after some quiet, has ended a wait."""
    return [
        replace(one, point=LoopActivity.WAITING)
        if number == 0 or one.gap >= _QUIET_SECONDS
        else replace(one, point=LoopActivity.BUSY)
        for number, one in enumerate(inputs)
    ]
