"""Plays rosoclingo for the interfaces."""

from __future__ import annotations

import queue
import threading
from typing import Dict, List, Tuple

import rospy
from waiting import TIMEOUT, wait_for

from rosoclingo.msg import (
    ROSoClingoAnswer,
    ROSoClingoDispatch,
    ROSoClingoIn,
    ROSoClingoOut,
    ROSoClingoServed,
    ROSoClingoServedGoal,
    ROSoClingoToken,
)


class Planner:
    """What an older rosoclingo looks like to the interfaces in a namespace."""

    def __init__(self, name: str, interfaces: int = 1) -> None:
        self.answers: List[Tuple[str, str]] = []
        self.headers: List[Dict[str, str]] = []  # of the connections by which they came
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
            self.headers.append(message._connection_header)
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


class TokenPlanner:
    """What rosoclingo looks like to the interfaces in a namespace: all actions have tokens."""

    RUN = "a run"

    def __init__(self, name: str) -> None:
        self.tokened: queue.Queue[Tuple[str, int, str]] = queue.Queue()
        self._dispatch = rospy.Publisher(
            f"{name}/dispatch", ROSoClingoDispatch, latch=True, queue_size=100
        )
        self._served = rospy.Publisher(
            f"{name}/served", ROSoClingoServed, latch=True, queue_size=100
        )
        self._answer = rospy.Subscriber(f"{name}/answer", ROSoClingoAnswer, self._on_answer)
        self.old = Planner(name)
        wait_for(
            lambda: self._dispatch.get_num_connections() and self._answer.get_num_connections()
        )

    def _on_answer(self, message: ROSoClingoAnswer) -> None:
        self.tokened.put((message.run, message.number, message.value))

    def send(self, *told: Tuple[int, str, str, int]) -> None:
        """Says numbers, actuators, actions and states, with tokens and the last one without."""
        tokens = [ROSoClingoToken(number, 1, *rest) for number, *rest in told]
        self._dispatch.publish(self.RUN, tokens)
        self.old.send(*told[-1][1:3])

    def serve(self, number: int, *goals: Tuple[int, str, str, str]) -> None:
        """Says which goals actions serve: their numbers, slots, requests and ids."""
        self._served.publish(self.RUN, number, [ROSoClingoServedGoal(*one, []) for one in goals])

    def wait_for_answer(self, number: int, value: str) -> None:
        """Waits for an answer, which comes again and again, as nobody says that it was taken."""
        while self.tokened.get(timeout=TIMEOUT) != (self.RUN, number, value):
            pass
