"""A mailbot in the office gets three requests, one of which is cancelled, and meets an obstacle.

The robot is an interface without a body. What it does is checked against the map, independently of
the encoding.
"""

from __future__ import annotations

import logging
import re
import sys
import threading
from pathlib import Path
from typing import Callable, FrozenSet, List, NoReturn, Optional, Set, Union

import rospkg
import rospy

from rosclingo.errors import RosclingoError
from rosclingo.ros_node import init_node
from rosoclingo_aspprograms.validator import Map, Validator
from rosoclingo_examples.client import Client
from rosoclingo_examples.orders import Bring, Orders
from rosoclingo_interfaces.interface import FAILURE, SUCCESS, ActionInterface
from rosoclingo_interfaces.node import InterfaceNode

_ROBOT = "mailbot"
_SECONDS = 0.3  # how long an action takes
_TIMEOUT_SECONDS = 50.0  # for the whole story
_POLL_SECONDS = 0.05  # how often the main thread looks at what it waits for
_OBSTACLE = frozenset(("c4", "c5"))
_PLAN = re.compile(r": plan (\d+) steps?")

_BOOK = Bring("bring(o7,o11)", ("book",))
_LETTER = Bring("bring(o2,o3)", ("letter",))
_PARCEL = Bring("bring(o9,o14)", ("parcel",))
_PARCEL_NUMBER = 3  # the requests are numbered in the order of their coming


class Story:
    """What happens, line by line, and whether it is right. Thread-safe."""

    def __init__(self, graph: Map) -> None:
        """Prepares the story.

        Args:
            graph: The map that the robot's actions are checked against.
        """
        # Guards all below; a client's method that is called under it only sends something.
        self._lock = threading.RLock()
        self._orders = Orders()
        self._client = Client(self._orders, self._on_order)
        self._validator = Validator(graph)
        self._shown: Set[str] = set()
        self._step = 0
        self._horizon = 0
        self._failures: List[str] = []
        self._canceled = False

    def wait_for_the_server(self) -> bool:
        """Waits until rosoclingo is there, and returns whether it is."""
        return _wait_for(self._client.reminder())

    def ask(self, *requests: Bring) -> None:
        """Sends requests."""
        with self._lock:
            for bring in requests:
                self._validator.request(bring, bring.request)
                self._client.send(bring)

    def begins(self, action: str) -> None:
        """The robot is told to do an action."""
        with self._lock:
            self._step += 1
            self._validator.action(_ROBOT, action)

    def ends(self, action: str, success: bool, position: str) -> None:
        """The robot has done an action, or failed to."""
        with self._lock:
            answer = SUCCESS if success else FAILURE
            self._validator.message(_ROBOT, answer)
            steps = f"{self._step} of {max(self._horizon, self._step)}"
            print(f"  step {steps:9} {action:11} {answer:8} at {position}", flush=True)
            if not success:
                self._failures.append(action)
            if action == "go(c6)" and self._step <= 2:
                self.ask(_LETTER, _PARCEL)
            if action == f"pickup({_PARCEL_NUMBER})" and not self._canceled:
                self._canceled = True
                self._say(f"[{_PARCEL_NUMBER}] {_PARCEL}: nobody wants it any more")
                self._validator.cancel(_PARCEL)
                self._client.cancel(_PARCEL_NUMBER)

    def wait(self) -> bool:
        """Waits until all requests have ended, and returns whether they have."""
        return _wait_for(lambda: not self._orders.open)

    def verdict(self) -> List[str]:
        """Returns what went wrong."""
        with self._lock:
            wrong = self._validator.finish()
            if not self._orders.all_as_asked:
                wrong.append("a request did not end as it should")
            if self._failures != ["go(c4)"]:
                wrong.append(f"one go(c4) was to fail, not {', '.join(self._failures) or 'none'}")
            if not self._canceled:
                wrong.append("no request was cancelled")
            print(f"\n{self._step} actions, {self._orders.summary()}", flush=True)
            for line in self._orders.lines():
                print(f"  {line}", flush=True)
            return wrong

    def _on_order(self, line: str) -> None:
        plan = _PLAN.search(line)
        with self._lock:
            if plan:
                self._horizon = int(plan.group(1))
            number, _, state = line.partition("] ")
            word = state.rpartition(": ")[2]
            if word in ("accepted", "succeeded", "canceled", "rejected", "aborted"):
                bring = (_BOOK, _LETTER, _PARCEL)[int(number[1:]) - 1]
                # Each request has the slot of its number, because all are free.
                self._validator.status(bring, word, number[1:])
            if not re.match(r"(plan|step|queued|waiting) ?", word):
                self._say(line)

    def _say(self, line: str) -> None:
        if line not in self._shown:
            self._shown.add(line)
            print(line, flush=True)


class Robot(ActionInterface):
    """A mailbot without a body, in an office with an obstacle."""

    actuators = (_ROBOT,)

    def __init__(self, story: Story, position: str, obstacles: Set[FrozenSet[str]]) -> None:
        self._story = story
        self._position = position
        self._obstacles = obstacles

    def go(self, waypoint: str) -> bool:
        """Drives to a waypoint, unless there is an obstacle on the way."""
        free = frozenset((self._position, waypoint)) not in self._obstacles
        return self._act(f"go({waypoint})", waypoint if free else None)

    def pickup(self, request: Union[int, str]) -> bool:
        """Picks up the package of a request."""
        return self._act(f"pickup({request})", self._position)

    def deliver(self, request: Union[int, str]) -> bool:
        """Hands over the package of a request."""
        return self._act(f"deliver({request})", self._position)

    def _act(self, action: str, position: Optional[str]) -> bool:
        self._story.begins(action)
        self.sleep(_SECONDS)
        self._position = position or self._position
        self._story.ends(action, position is not None, self._position)
        return position is not None


def main() -> NoReturn:
    """Tells the story against a running rosoclingo.

    The exit status is 0 if everything was as it should, and 1 if not.
    """
    init_node("demo", usage=f"usage: demo.py [ROS remappings]\n\n{__doc__}")
    logging.getLogger("rosout").setLevel(logging.WARNING)  # the story has a line for each action
    folder = Path(rospkg.RosPack().get_path("rosoclingo_aspprograms"))
    graph = Map.read(folder / "mailbot" / "instances" / "graph_wg.lp")
    story = Story(graph)
    wrong = ["rosoclingo is not there"]
    try:
        if story.wait_for_the_server():
            node = InterfaceNode(Robot(story, graph.starts[_ROBOT], {_OBSTACLE}))
            story.ask(_BOOK)
            wrong = [] if story.wait() else ["the requests did not end in time"]
            wrong += story.verdict()
            del node
    except RosclingoError as err:
        wrong = [str(err)]
    for line in wrong:
        print(f"wrong: {line}", file=sys.stderr)
    rospy.signal_shutdown("the story has ended")
    sys.exit(1 if wrong else 0)


def _wait_for(condition: Callable[[], bool]) -> bool:
    end = rospy.get_time() + _TIMEOUT_SECONDS
    pause = threading.Event()
    while not condition():
        if rospy.is_shutdown() or rospy.get_time() > end:
            return False
        pause.wait(_POLL_SECONDS)
    return True
