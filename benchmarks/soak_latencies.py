"""Measures latencies of a soak, from what the journal and the clients have. Needs no ROS."""

from __future__ import annotations

from typing import Dict, List

from soak_trends import Sample

ACKNOWLEDGED = "goal to acknowledgement"
ACCEPTED = "goal to acceptance"
REACTION = "answer to next action"


class SoakLatencies:
    """Collects samples, in seconds of wall time. One thread at a time.

    Attributes:
        samples: By what they are.
    """

    def __init__(self) -> None:
        """Starts without a sample."""
        self.samples: Dict[str, List[Sample]] = {ACKNOWLEDGED: [], ACCEPTED: [], REACTION: []}
        self._answered: Dict[str, float] = {}  # robots that may have more to do

    def measure(self, name: str, began: float, seconds: float, wall: float) -> None:
        """Adds a sample.

        Args:
            name: What it is of.
            began: In wall time; less than 0 if it does not count.
            seconds: When it has ended, in simulated time.
            wall: Likewise, in wall time.
        """
        if began >= 0:
            self.samples[name].append(Sample(seconds, wall - began))

    def answers(self, robot: str, wall: float) -> None:
        """A robot has answered, and may be told to do something else."""
        self._answered[robot] = wall

    def acts(self, robot: str, seconds: float, wall: float) -> None:
        """A robot is told to act."""
        self.measure(REACTION, self._answered.pop(robot, -1.0), seconds, wall)

    def forget_answers(self) -> None:
        """There was nothing more to do, or something has come in between."""
        self._answered.clear()
