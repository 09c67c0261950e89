"""Narrates the deliveries of a fleet, line by line."""

from __future__ import annotations

import random
import threading
from dataclasses import dataclass, field
from typing import Dict, Iterable, List, Mapping, Optional, Sequence, Tuple

from rosoclingo.bags.run_model import RunModel, TrackedAction, TrackedGoal
from rosoclingo.loop.journal import Entry, Event, GoalArrived, MessageArrived, Status, StatusSet
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
        action: What it does, or has done; None if nothing.
        waits: How often it has stood on its way for a second or more.
        waited: How long in all, in seconds of simulated time.
    """

    trace: DriveTrace = field(default_factory=DriveTrace)
    deliveries: int = 0
    action: Optional[TrackedAction] = None
    waits: int = 0
    waited: float = 0.0
    _stands: float = 0.0  # for so long by now, in seconds

    def move(self, seconds: float, place: TracePoint, speed: float) -> None:
        """It is at a place, and drives or turns so fast; see :meth:`FleetStory.moves`."""
        before = self.trace.times[-1] if self.trace.times else seconds
        self.trace.move(seconds, place)
        if speed or not self._drives:
            self._stands = 0.0
            return
        passed = seconds - before
        if self._stands < _WAIT_SECONDS <= self._stands + passed:
            self.waits += 1
            self.waited += self._stands
        self._stands += passed
        if self._stands >= _WAIT_SECONDS:
            self.waited += passed

    @property
    def _drives(self) -> bool:
        action = self.action
        return action is not None and action.ended is None and action.name.startswith("go(")


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
        self._run = RunModel()  # in seconds of simulated time
        self._slots: Dict[str, str] = {}  # the goals of the slots
        self._begin = 0.0

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
            action = self._run.apply(Entry(event, seconds=self._now()))
            if isinstance(event, GoalArrived):
                self._ask(self._run.goals[event.goal])
            elif isinstance(event, StatusSet):
                self._set_status(event)
            elif action is not None and isinstance(event, MessageArrived):
                self._ends(action)
            elif action is not None:
                self.members[action.actuator].action = action

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
            succeeded = [g for g in self._run.goals.values() if g.status is Status.SUCCEEDED]
            end = max((goal.ended or 0.0 for goal in succeeded), default=0.0)
            return (
                f"{_count(delivered, 'package')} delivered by {_count(len(members), 'robot')} in "
                f"{end - self._begin:.0f} s of simulated time, on "
                f"{sum(member.trace.metres for member in members):.0f} m, with "
                f"{_count(sum(member.waits for member in members), 'wait')}"
            )

    @property
    def _open(self) -> List[TrackedGoal]:
        """The requests that have come and not ended, in order."""
        return [g for g in self._run.goals.values() if g.has_arrived and g.ended is None]

    def _ask(self, goal: TrackedGoal) -> None:
        """Narrates a request."""
        terms = arguments(goal.request, "bring")
        if len(terms) < 2:
            self._say("", f"asked for {_package(goal)}")
            return
        where, when = f"from {terms[0]} to {terms[1]}", "".join(f", {term}" for term in terms[2:])
        self._say("", f"asked to bring {_package(goal)} {where}{when}")

    def _set_status(self, event: StatusSet) -> None:
        if event.status is Status.ACCEPTED:
            self._slots[event.slot] = event.goal
        elif event.status.is_terminal:
            self._slots.pop(event.slot, None)

    def _ends(self, action: TrackedAction) -> None:
        robot, answer = action.actuator, action.answer
        member = self.members[robot]
        trace = member.trace
        if answer != SUCCESS:
            trace.happen(DriveEventKind.FAILURE, f"{robot}: {action.name} fails")
            self._say(robot, f"{action.name} fails")
        for kind, name in ((DriveEventKind.PICKUP, "pickup"), (DriveEventKind.DELIVERY, "deliver")):
            for slot in arguments(action.name, name) if answer == SUCCESS else ():
                office = min(self._places, key=lambda name: trace.distance(self._places[name]))
                package = self._package_of(slot, office)
                member.deliveries += kind is DriveEventKind.DELIVERY
                trace.happen(kind, package, self._places[office])
                word = "picks up" if kind is DriveEventKind.PICKUP else "delivers"
                self._say(robot, f"{word} {package} at {office}")

    def _package_of(self, slot: str, office: str) -> str:
        """Returns the package of a slot, in an office.

        A robot may pick it up before its goal is accepted. Until then, it is the oldest one there.
        """
        if slot not in self._slots:
            known = self._slots.values()
            here = (g.id for g in self._open if arguments(g.request, "bring")[:1] == [office])
            self._slots[slot] = next((goal for goal in here if goal not in known), "")
        goal = self._run.goals.get(self._slots[slot])
        return _package(goal) if goal else f"package {slot}"

    def _say(self, robot: str, what: str) -> None:
        print(f"{self._now() - self._begin:6.0f} s  {robot:9} {what}", flush=True)

    def _now(self) -> float:
        return max(
            (member.trace.times[-1] for member in self.members.values() if member.trace.times),
            default=0.0,
        )


def _package(goal: TrackedGoal) -> str:
    return " ".join(goal.information) or goal.request


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
