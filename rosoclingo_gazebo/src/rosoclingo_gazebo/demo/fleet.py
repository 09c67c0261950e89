"""Narrates the deliveries of a fleet, line by line."""

from __future__ import annotations

import random
import threading
from dataclasses import dataclass, field
from typing import Dict, Iterable, List, Mapping, Sequence, Set, Tuple

from rosoclingo.loop.journal import (
    ActionPublished,
    Event,
    GoalArrived,
    MessageArrived,
    Status,
    StatusSet,
)
from rosoclingo.loop.words import SUCCESS
from rosoclingo_aspprograms.validator import arguments
from rosoclingo_examples.orders import Bring
from rosoclingo_gazebo.demo.trace import DriveEventKind, DriveTrace, TracePoint

_PAUSE_SECONDS = 12.0  # of simulated time, between two requests on average
_WAIT_SECONDS = 1.0  # a robot that stands so long on its way waits


def random_orders(offices: Sequence[str], count: int, seed: int) -> List[Tuple[float, Bring]]:
    """Returns packages to bring from office to office.

    Args:
        offices: The offices.
        count: How many packages.
        seed: The same one gives the same packages.

    Returns:
        For each, when it is asked for, in seconds of simulated time from the first one on.
    """
    dice = random.Random(seed)  # noqa: S311 (no secret)
    seconds, orders = 0.0, []
    for number in range(1, count + 1):
        origin, destination = dice.sample(sorted(offices), 2)
        orders.append((seconds, Bring(f"bring({origin},{destination})", (f"package{number}",))))
        seconds += dice.expovariate(1 / _PAUSE_SECONDS)
    return orders


@dataclass
class FleetMember:
    """A robot of the fleet.

    Attributes:
        trace: Where it drives.
        deliveries: How many packages it has delivered.
        action: What it does; empty if nothing.
        waits: How often it has stood on its way for a second or more.
        waited: How long in all, in seconds of simulated time.
    """

    trace: DriveTrace = field(default_factory=DriveTrace)
    deliveries: int = 0
    action: str = ""
    waits: int = 0
    waited: float = 0.0
    _stands: float = 0.0  # for so long by now, in seconds

    def move(self, seconds: float, place: TracePoint, speed: float) -> None:
        """It is at a place, and drives or turns so fast; see :meth:`FleetStory.moves`."""
        before = self.trace.times[-1] if self.trace.times else seconds
        self.trace.move(seconds, place)
        if speed or not self.action.startswith("go("):
            self._stands = 0.0
            return
        passed = seconds - before
        if self._stands < _WAIT_SECONDS <= self._stands + passed:
            self.waits += 1
            self.waited += self._stands
        self._stands += passed
        if self._stands >= _WAIT_SECONDS:
            self.waited += passed


class FleetStory:
    """Narrates a fleet's deliveries. Thread-safe.

    Attributes:
        members: The robots by name.
    """

    def __init__(self, robots: Iterable[str], places: Mapping[str, TracePoint]) -> None:
        """Starts before the first event.

        Args:
            robots: The robots' names.
            places: Where the waypoints are, in metres.
        """
        self._lock = threading.RLock()  # guards all below
        self.members = {robot: FleetMember() for robot in robots}
        self._places = places
        self._packages: Dict[str, str] = {}  # by goal
        self._open: Dict[str, Sequence[str]] = {}  # the terms of the requests, by goal
        self._over: Set[str] = set()  # goals that have ended
        self._slots: Dict[str, str] = {}  # the goals of the slots
        self._begin = 0.0
        self._end = 0.0

    @property
    def there(self) -> bool:
        """True if the positions of all robots are known."""
        with self._lock:
            return all(member.trace.path for member in self.members.values())

    @property
    def open(self) -> int:
        """The number of open requests, of all clients."""
        with self._lock:
            return len(self._open)

    @property
    def seconds(self) -> float:
        """Simulated seconds since :meth:`begins`."""
        with self._lock:
            return self._now() - self._begin

    def begins(self) -> None:
        """The first request is sent now."""
        with self._lock:
            self._begin = self._now()

    def moves(self, robot: str, seconds: float, place: TracePoint, speed: float) -> None:
        """A robot is somewhere.

        Args:
            robot: Its name.
            seconds: When that is, in seconds of simulated time.
            place: Where it is, in metres.
            speed: How fast it drives or turns; 0 if it stands.
        """
        with self._lock:
            self.members[robot].move(seconds, place, speed)

    def learns(self, event: Event) -> None:
        """The planning loop's journal has one more event."""
        with self._lock:
            if isinstance(event, GoalArrived):
                self._packages[event.goal] = " ".join(event.information) or event.request
                terms = arguments(event.request, "bring")
                self._ask(event.goal, terms)
                if event.goal not in self._over:
                    self._open[event.goal] = terms
            elif isinstance(event, ActionPublished):
                self.members[event.actuator].action = event.action
            elif isinstance(event, MessageArrived) and event.source in self.members:
                self._ends(event.source, event.value)
            elif isinstance(event, StatusSet):
                self._set_status(event)

    def lines(self) -> List[str]:
        """Returns a summary for each robot, and for all together."""
        with self._lock:
            lines = ["robot      packages  metres  waits  seconds waited"]
            for name, member in self.members.items():
                lines.append(
                    f"{name:10} {member.deliveries:8} {member.trace.metres:7.0f} "
                    f"{member.waits:6} {member.waited:15.0f}"
                )
            return [*lines, self.summary()]

    def summary(self) -> str:
        """Returns the summary of the fleet."""
        with self._lock:
            members = self.members.values()
            delivered = sum(member.deliveries for member in members)
            return (
                f"{_count(delivered, 'package')} delivered by {_count(len(members), 'robot')} in "
                f"{self._end - self._begin:.0f} s of simulated time, on "
                f"{sum(member.trace.metres for member in members):.0f} m, with "
                f"{_count(sum(member.waits for member in members), 'wait')}"
            )

    def _ask(self, goal: str, terms: Sequence[str]) -> None:
        """Narrates a request, with its terms."""
        package = self._packages[goal]
        if len(terms) < 2:
            self._say("", f"asked for {package}")
            return
        where, when = f"from {terms[0]} to {terms[1]}", "".join(f", {term}" for term in terms[2:])
        self._say("", f"asked to bring {package} {where}{when}")

    def _set_status(self, event: StatusSet) -> None:
        if event.status is Status.ACCEPTED:
            self._slots[event.slot] = event.goal
        elif event.status.is_terminal:
            self._over.add(event.goal)  # perhaps before the loop takes it
            self._open.pop(event.goal, None)
            self._slots.pop(event.slot, None)
        if event.status is Status.SUCCEEDED:
            self._end = self._now()

    def _ends(self, robot: str, answer: str) -> None:
        member = self.members[robot]
        action, member.action = member.action, ""
        trace = member.trace
        if answer != SUCCESS:
            trace.happen(DriveEventKind.FAILURE, f"{robot}: {action} fails")
            self._say(robot, f"{action} fails")
        for kind, name in ((DriveEventKind.PICKUP, "pickup"), (DriveEventKind.DELIVERY, "deliver")):
            for slot in arguments(action, name) if answer == SUCCESS else ():
                office = min(self._places, key=lambda name: trace.distance(self._places[name]))
                package = self._package(slot, office)
                member.deliveries += kind is DriveEventKind.DELIVERY
                trace.happen(kind, package, self._places[office])
                word = "picks up" if kind is DriveEventKind.PICKUP else "delivers"
                self._say(robot, f"{word} {package} at {office}")

    def _package(self, slot: str, office: str) -> str:
        """Returns the package of a slot, in an office.

        A robot may pick it up before its goal is accepted. Until then, it is the oldest one there.
        """
        if slot not in self._slots:
            known = self._slots.values()
            here = (goal for goal, terms in self._open.items() if terms[:1] == [office])
            self._slots[slot] = next((goal for goal in here if goal not in known), "")
        return self._packages.get(self._slots[slot], f"package {slot}")

    def _say(self, robot: str, what: str) -> None:
        print(f"{self._now() - self._begin:6.0f} s  {robot:9} {what}", flush=True)

    def _now(self) -> float:
        return max(
            (member.trace.times[-1] for member in self.members.values() if member.trace.times),
            default=0.0,
        )


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
