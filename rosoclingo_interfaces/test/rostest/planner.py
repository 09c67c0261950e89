"""Plays rosoclingo for the interfaces."""

from __future__ import annotations

import threading
import time
from typing import Callable, List, Tuple

import rospy

from rosoclingo.msg import ROSoClingoIn, ROSoClingoOut

TIMEOUT = 20.0  # seconds of wall time; no more than a bound for what never comes


class Planner:
    """What rosoclingo looks like to the interfaces in a namespace."""

    def __init__(self, name: str, interfaces: int = 1) -> None:
        self.answers: List[Tuple[str, str]] = []
        self._changed = threading.Condition()
        self._out = rospy.Publisher(
            f"{name}/out", ROSoClingoOut, latch=True, tcp_nodelay=True, queue_size=100
        )
        self._in = rospy.Subscriber(f"{name}/in", ROSoClingoIn, self._on_in, tcp_nodelay=True)
        wait_for(
            lambda: (
                min(self._out.get_num_connections(), self._in.get_num_connections()) >= interfaces
            )
        )

    def _on_in(self, message: ROSoClingoIn) -> None:
        with self._changed:
            self.answers.append((message.id, message.value))
            self._changed.notify_all()

    def send(self, *action: str) -> None:
        self._out.publish(*action)

    def next(self) -> Tuple[str, str]:
        """Waits for an answer and takes it."""
        with self._changed:
            assert self._changed.wait_for(lambda: self.answers, TIMEOUT), "no answer"
            return self.answers.pop(0)

    def ask(self, *action: str) -> str:
        """Sends an action and returns its answer; nothing else may have come before."""
        self.send(*action)
        actuator, value = self.next()
        assert actuator == action[0], (actuator, action)
        return value


def wait_for(condition: Callable[[], bool]) -> None:
    """Waits until a condition holds that nothing announces."""
    end = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < end, "timeout"
        time.sleep(0.01)
