"""Lets a fleet live through a soak: sends what is drawn, and looks after ways and robots."""

from __future__ import annotations

import contextlib
import heapq
import itertools
import os
import signal
import time
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Sequence, Tuple, Union

import rospy
from nav_msgs.msg import Odometry

from harness import processor_seconds, resident_mebibytes
from rosclingo.ros.low_latency import publisher
from rosoclingo.encodings.graph import MapPoint
from rosoclingo.msg import (
    ROSoClingoIn,
)
from rosoclingo_aspprograms.validator import Edge
from rosoclingo_gazebo.ros.killer import local_process
from rosoclingo_simulator.srv import Obstacle
from soak_client import SoakClient
from soak_schedule import KILL, Asking, Blocking, Disturbance, Ending
from soak_watch import SoakWatch

PLANNING_NODES = ("rosoclingo", "controller", "planner")

_NODES_SECONDS = 1.0  # of wall time, between two looks at the processes
_MEMORY_SECONDS = 60.0  # of simulated time, between two looks at their memory
_CARE_SECONDS = 60.0  # of simulated time, after which blocked ways and lost robots are attended to
_POSE_SECONDS = 10.0  # of wall time, for a robot to say where it is
_WAITING = 2  # requests that may be open besides those that are dealt with


class Cancelling(NamedTuple):
    """A client asks to cancel its goal."""

    goal: str


class Opening(NamedTuple):
    """A box is taken out of a way."""

    way: Tuple[str, str]


_Deed = Union[Disturbance, Cancelling, Opening]


class SoakWorld:
    """Does what is drawn, and what people do who look after the robots. The main thread calls it.

    Attributes:
        began: When, in simulated time.
    """

    def __init__(
        self,
        watch: SoakWatch,
        places: Dict[str, MapPoint],
        slots: int,
        nodes: Sequence[str],
        drawn: Iterator[Tuple[float, Disturbance]],
    ) -> None:
        """Opens the topics.

        Args:
            watch: Is told of all.
            places: Where the waypoints are, in metres.
            slots: How many requests are dealt with at the same time.
            nodes: Those that are watched.
            drawn: The disturbances, from the beginning on.
        """
        self.began = 0.0
        self._watch = watch
        self._places = places
        self._slots = slots
        self._pids = dict.fromkeys(nodes, 0)
        self._drawn = drawn
        self._next = next(drawn)
        self._due: List[Tuple[float, int, _Deed]] = []  # a heap of what follows from those
        self._order = itertools.count()
        self._boxes: List[Edge] = []
        self._cared: Dict[str, float] = {}  # since when something is to be seen to
        self._looked = self._measured = 0.0
        self.client = SoakClient(watch)
        self._in = publisher("rosoclingo/in", ROSoClingoIn)
        self._obstacle = rospy.ServiceProxy("/simulator/obstacle", Obstacle)

    @property
    def seconds(self) -> float:
        """Seconds of simulated time since the beginning."""
        return float(rospy.Time.now().to_sec()) - self.began

    @property
    def is_ready(self) -> bool:
        """True if all nodes are there, and time passes."""
        self._look()
        return all(self._pids.values()) and rospy.Time.now().to_sec() > 0

    @property
    def is_unsettled(self) -> bool:
        """True if there are goals of which it is not known how they have ended."""
        return bool(self._watch.check(self._now()))

    @property
    def has_boxes(self) -> bool:
        """True if there are boxes in ways, or ways that count as blocked."""
        return bool(self._boxes or self._watch.blocked)

    def begin(self) -> None:
        """The disturbances count from now on."""
        self.began = float(rospy.Time.now().to_sec())

    def end_hung(self, node: str) -> None:
        """Ends a node that hangs, whose output then has where all of its threads are."""
        pid = self._pids[node]
        if pid and _is_alive(pid):
            os.kill(pid, signal.SIGABRT)
            time.sleep(_NODES_SECONDS)

    def live(self, disturbs: bool) -> None:
        """Does what is due.

        Args:
            disturbs: Whether anything new happens; else only what has begun is brought to an end.
        """
        now = self.seconds
        while disturbs and self._next[0] <= now:
            self._do(self._next[1])
            self._next = next(self._drawn)
        while self._due and (self._due[0][0] <= now or not disturbs):
            self._do(heapq.heappop(self._due)[2])
        self.client.insist()
        self._care(now)
        self._look()
        if now - self._measured >= _MEMORY_SECONDS:
            self._measured = now
            self._measure()
            self._watch.check(self.began + now)
            self._watch.judge_alarms(self.began + now, time.monotonic())

    def _do(self, deed: _Deed) -> None:
        if isinstance(deed, Asking):
            self._ask(deed)
        elif isinstance(deed, Cancelling):
            self.client.cancel(deed.goal)
            self._happens("cancel asked", deed.goal)
        elif isinstance(deed, Blocking):
            self._block(deed)
        elif isinstance(deed, Opening):
            self._open(deed.way)
        else:
            self._end(deed)

    def _ask(self, asking: Asking) -> None:
        number = len(self._watch.open)
        if number >= self._slots + _WAITING:
            self._happens("request left out", asking.request)
            return
        has_slot = number < self._slots
        goal = self.client.ask(asking.request, asking.is_sent_twice, finds_slot=has_slot)
        if asking.cancel_after is not None:
            self._later(asking.cancel_after, Cancelling(goal))

    def _block(self, blocking: Blocking) -> None:
        if not self._move_box("block", blocking.way):
            self._happens("box left out", " ".join(blocking.way))
            return
        self._boxes.append(frozenset(blocking.way))
        self._happens("way blocked", " ".join(blocking.way))
        self._later(blocking.seconds, Opening(blocking.way))
        if blocking.is_told:
            self._tell("blocked({},{})".format(*blocking.way))

    def _open(self, way: Tuple[str, str]) -> None:
        self._move_box("unblock", way)
        if frozenset(way) in self._boxes:
            self._boxes.remove(frozenset(way))
        self._happens("way opened", " ".join(way))
        self._tell("unblocked({},{})".format(*way))

    def _move_box(self, word: str, way: Tuple[str, str]) -> bool:
        try:
            return bool(self._obstacle(f"{word} {' '.join(way)}").success)
        except rospy.ServiceException as err:
            self._watch.wrong(self._now(), f"/simulator/obstacle: {err}")
            return False

    def _end(self, ending: Ending) -> None:
        pid = local_process(f"/{ending.node}") if self._pids[ending.node] else None
        if pid is None:
            self._happens("end left out", ending.node)
            return
        self._look_at(ending.node, pid)
        how = f"node {ending.how}ed"
        self._watch.ends(ending.node, how, self._now(), time.monotonic())
        os.kill(pid, signal.SIGKILL if ending.how == KILL else signal.SIGINT)

    def _later(self, delay: float, deed: _Deed) -> None:
        heapq.heappush(self._due, (self.seconds + delay, next(self._order), deed))

    def _care(self, now: float) -> None:
        """Sees to ways that count as blocked without a box, and to robots that are lost."""
        ways = {"unblocked({},{})".format(*sorted(edge)): edge for edge in self._watch.blocked}
        robots = self._watch.lost
        wanted = {*(term for term, edge in ways.items() if edge not in self._boxes), *robots}
        self._cared = {one: self._cared.get(one, now) for one in wanted}
        for one in [one for one, since in self._cared.items() if now - since > _CARE_SECONDS]:
            self._cared[one] = now  # what is said to a loop that does not run is lost
            if one in robots:
                self._tell(f"at({one},{self._nearest(one)})")
                self._happens("robot found", one)
            else:
                self._tell(one)
                self._happens("way seen to", one)

    def _nearest(self, robot: str) -> str:
        topic = f"/{robot}/ground_truth"
        place = rospy.wait_for_message(topic, Odometry, _POSE_SECONDS).pose.pose.position
        return min(
            self._places,
            key=lambda name: (
                (self._places[name][0] - place.x) ** 2 + (self._places[name][1] - place.y) ** 2
            ),
        )

    def _look(self) -> None:
        """Looks for nodes whose process is not there."""
        if time.monotonic() - self._looked < _NODES_SECONDS:
            return
        self._looked = time.monotonic()
        for node, pid in self._pids.items():
            if pid and _is_alive(pid):
                continue
            found = local_process(f"/{node}")
            self._look_at(node, 0 if found is None or found == pid else found)

    def _look_at(self, node: str, pid: int) -> None:
        self._pids[node] = pid
        self._watch.is_process(node, pid, self._now(), time.monotonic())

    def _measure(self) -> None:
        used: Dict[int, float] = {}
        for node, pid in self._pids.items():
            with contextlib.suppress(OSError, IndexError):  # it has just ended
                if pid:
                    self._watch.takes(node, resident_mebibytes(pid), self._now())
                if pid and node in PLANNING_NODES:
                    used[pid] = processor_seconds(pid)
        self._watch.uses(used, self._now())

    def _tell(self, value: str) -> None:
        self._in.publish("info", value)

    def _happens(self, kind: str, text: str) -> None:
        self._watch.happens(self._now(), kind, text)

    def _now(self) -> float:
        return float(rospy.Time.now().to_sec())


def _is_alive(pid: int) -> bool:
    """Tells if a process is there, and not only its exit status."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (OSError, IndexError):
        return False
    return state not in ("Z", "X")
