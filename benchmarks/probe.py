"""A robot that is busy and an operator who cancels and holds: how soon each is served.

Used by flood_bench.py, beside a flood of goals and without one.
"""

from __future__ import annotations

import contextlib
import threading
import time
from typing import Callable, Dict, List, Optional

import rospy
from actionlib_msgs.msg import GoalID, GoalStatusArray

from burst import REQUESTS, goal
from harness import HarnessError, Samples
from rosoclingo.msg import ROSoClingoActionGoal, ROSoClingoActionResult, ROSoClingoIn, ROSoClingoOut
from rosoclingo.srv import ControlActuator

KINDS = ("cancel", "operator", "answer")
WORK_SECONDS = 0.2  # how long an action takes
PAUSE_SECONDS = 0.2  # between two requests of the operator
QUEUE = 800  # goals that wait before the flood, and are cancelled one by one
LONGEST_SECONDS = 120.0


class Probe:
    """A robot on a line, and an operator.

    Attributes:
        times: For each kind, how long each took, in milliseconds.
    """

    def __init__(self, node: str) -> None:
        """Opens the connections, and sends the goals."""
        self.times: Dict[str, List[float]] = {kind: [] for kind in KINDS}
        self._answered: Optional[float] = None
        self._ends: Dict[str, threading.Event] = {}
        self._in = rospy.Publisher(f"{node}/in", ROSoClingoIn, queue_size=1, tcp_nodelay=True)
        self._cancel = rospy.Publisher(f"{node}/cancel", GoalID, queue_size=1, tcp_nodelay=True)
        goals = rospy.Publisher(f"{node}/goal", ROSoClingoActionGoal, queue_size=QUEUE)
        self._subscribers = [
            rospy.Subscriber(f"{node}/out", ROSoClingoOut, self._on_action, tcp_nodelay=True),
            rospy.Subscriber(f"{node}/result", ROSoClingoActionResult, self._on_result),
        ]
        topics = (self._in, self._cancel, goals, *self._subscribers)
        _wait(lambda: all(one.get_num_connections() for one in topics), "no connection")
        rospy.wait_for_service(f"{node}/hold", LONGEST_SECONDS)
        self._services = [rospy.ServiceProxy(f"{node}/{one}", ControlActuator, persistent=True)
                          for one in ("hold", "release")]  # fmt: skip
        self._left = [f"probe {n}" for n in range(QUEUE)]
        listed: List[int] = []
        statuses = rospy.Subscriber(
            f"{node}/status",
            GoalStatusArray,
            lambda message: listed.append(len(message.status_list)),
        )
        for number, identifier in enumerate(self._left):
            goals.publish(goal(identifier, REQUESTS[number % 2]))
        _wait(lambda: max(listed, default=0) >= QUEUE, "goals are not acknowledged")
        statuses.unregister()

    def close(self) -> None:
        """Closes the connections, before another node of this name starts."""
        for one in (self._in, self._cancel, *self._subscribers):
            one.unregister()
        for service in self._services:
            service.close()

    def run(self, seconds: float, is_over: threading.Event) -> Dict[str, Samples]:
        """Measures for some seconds at least, and until the event is set.

        Raises:
            HarnessError: Something was not served at all.
        """
        self.times = {kind: [] for kind in KINDS}
        end = time.monotonic() + seconds
        while time.monotonic() < end or not is_over.is_set():
            self._measure("cancel", self._cancel_one)
            self._measure("operator", self._hold_and_release)
            time.sleep(PAUSE_SECONDS)
        if not all(self.times.values()):
            raise HarnessError("the robot was told nothing")
        return {kind: Samples("ms", tuple(times)) for kind, times in self.times.items()}

    def _measure(self, kind: str, act: Callable[[], None]) -> None:
        begin = time.monotonic()
        act()
        self.times[kind].append((time.monotonic() - begin) * 1e3)

    def _cancel_one(self) -> None:
        identifier = self._left.pop()
        ended = self._ends[identifier] = threading.Event()
        self._cancel.publish(GoalID(id=identifier))
        if not ended.wait(LONGEST_SECONDS):
            raise HarnessError("a goal is not cancelled")

    def _hold_and_release(self) -> None:
        for service in self._services:
            reply = service(actuator="gate")
            if not reply.success:
                raise HarnessError(reply.message)

    def _on_result(self, message: ROSoClingoActionResult) -> None:
        ended = self._ends.get(message.status.goal_id.id)
        if ended is not None:
            ended.set()

    def _on_action(self, action: ROSoClingoOut) -> None:
        if self._answered is not None:
            self.times["answer"].append((time.monotonic() - self._answered) * 1e3)
        threading.Timer(WORK_SECONDS, self._answer).start()

    def _answer(self) -> None:
        self._answered = time.monotonic()
        with contextlib.suppress(rospy.ROSException):  # it is closed
            self._in.publish("robot", "success")


def _wait(condition: Callable[[], bool], what: str) -> None:
    end = time.monotonic() + LONGEST_SECONDS
    while not condition():
        if time.monotonic() > end:
            raise HarnessError(what)
        time.sleep(0.01)
