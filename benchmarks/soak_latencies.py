"""Measures latencies of a soak, from what the journal and the clients have. Needs no ROS."""

from __future__ import annotations

import time
from typing import Dict, List

from soak_trends import Sample

ACKNOWLEDGED = "goal to acknowledgement"
ACCEPTED = "goal or end of step to acceptance"
REACTION = "answer to next action"
PROCESSOR = "processor time for an action"
BUSY = "slow-down by other processes"

_LEAST_ACTIONS = 10  # over which processor time is averaged
_ROUNDS = 400_000  # of a computation that takes some hundredths of a second


class SoakLatencies:
    """Collects samples, in seconds of wall time but for those named otherwise.

    One thread at a time.

    Attributes:
        samples: By what they are.
    """

    def __init__(self) -> None:
        """Starts without a sample."""
        kinds = (ACKNOWLEDGED, ACCEPTED, REACTION, PROCESSOR, BUSY)
        self.samples: Dict[str, List[Sample]] = {kind: [] for kind in kinds}
        self._used: Dict[int, float] = {}  # processor time by processes, at the last sample
        self._actions = self._actions_before = 0  # in all, and at the last sample
        self._answered: Dict[str, float] = {}  # robots that may have more to do
        self._last_input = -1.0  # in wall time

    def measure(self, name: str, began: float, seconds: float, wall: float) -> None:
        """Adds a sample.

        Args:
            name: What it is of.
            began: In wall time; less than 0 if it does not count.
            seconds: When it has ended, in simulated time.
            wall: The same, in wall time.
        """
        if began >= 0:
            self.samples[name].append(Sample(seconds, wall - began))

    def arrives(self, wall: float) -> None:
        """The loop has got a message, which may end its step."""
        self._last_input = wall

    def accepts(self, sent: float, seconds: float, wall: float) -> None:
        """A goal is accepted, which is done at the end of a step.

        So it counts from the message on that has ended the step, if that came after the goal: how
        long robots drive says nothing about the loop.

        Args:
            sent: When the client has sent it, in wall time; less than 0 if it does not count.
            seconds: When it is accepted, in simulated time.
            wall: The same, in wall time.
        """
        began = max(sent, self._last_input) if sent >= 0 else sent
        self.measure(ACCEPTED, began, seconds, wall)

    def answers(self, robot: str, wall: float) -> None:
        """A robot has answered, and may be told to do something else."""
        self._answered[robot] = wall

    def acts(self, robot: str, seconds: float, wall: float) -> None:
        """A robot is told to act."""
        self._actions += 1
        self.measure(REACTION, self._answered.pop(robot, -1.0), seconds, wall)

    def forget_answers(self) -> None:
        """There was nothing more to do, or something has come in between."""
        self._answered.clear()

    def uses(self, used: Dict[int, float], seconds: float) -> None:
        """Adds a sample of processor time, if there were enough actions since the last one.

        Args:
            used: The processor time of the processes that plan, in seconds; what they did for their
                starts does not count.
            seconds: When, in simulated time.
        """
        actions = self._actions - self._actions_before
        is_same = used.keys() == self._used.keys()
        if is_same and actions < _LEAST_ACTIONS:
            return
        if is_same:
            taken = sum(used.values()) - sum(self._used.values())
            self.samples[PROCESSOR].append(Sample(seconds, taken / actions))
        self._used, self._actions_before = used, self._actions


def slow_down() -> float:
    """Computes something; returns how many times the processor time that has taken."""
    wall, processor = time.perf_counter(), time.thread_time()
    sum(range(_ROUNDS))
    return (time.perf_counter() - wall) / max(time.thread_time() - processor, 1e-9)
