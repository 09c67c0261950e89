"""Validates what mailbots do: replays it on the map, and lists every violation.

Nothing of this uses a solver, or the encoding: it is what the encoding is checked with.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Dict, FrozenSet, Hashable, List, Optional, Set, Tuple

from rosclingo.wire.term_text import split_term

Edge = FrozenSet[str]
_FACT = re.compile(r"(connection|office|start|length|duration)\(([^()]*)\)\.")
_WHEN = re.compile(r"urgent|by\([1-9]\d*\)")
_ENDS = ("rejected", "succeeded", "canceled", "aborted")


def arguments(term: str, name: str) -> List[str]:
    """Returns the arguments of a term such as ``bring(o9,o14)``, or nothing if it is another."""
    found, terms = split_term(term.replace(" ", ""))
    return terms if found == name else []


@dataclass
class Map:
    """A map of offices and waypoints.

    Attributes:
        offices: The offices.
        edges: Pairs of waypoints next to each other.
        starts: For each robot, the waypoint where it stands in the beginning.
        lengths: The seconds that it takes along an edge; what is missing takes 1.
        durations: The seconds that ``pickup`` and ``deliver`` take; what is missing takes 1.
    """

    offices: Set[str] = field(default_factory=set)
    edges: Set[Edge] = field(default_factory=set)
    starts: Dict[str, str] = field(default_factory=dict)
    lengths: Dict[Edge, int] = field(default_factory=dict)
    durations: Dict[str, int] = field(default_factory=dict)

    @property
    def is_timed(self) -> bool:
        """True if the map has durations, so that robots do not wait for each other."""
        return bool(self.lengths or self.durations)

    @classmethod
    def read(cls, path: Path) -> Map:
        """Reads the facts of an instance without variables, such as ``graph_wg.lp``."""
        made = cls()
        text = re.sub(r"%.*", "", path.read_text(encoding="utf-8"))
        for name, inside in _FACT.findall(text):
            terms = [term.strip() for term in inside.split(",")]
            if name == "office":
                made.offices.add(terms[0])
            elif name == "connection":
                made.edges.add(frozenset(terms))
            elif name == "length":
                made.lengths[frozenset(terms[:2])] = int(terms[2])
            elif name == "duration":
                made.durations[terms[0]] = int(terms[1])
            else:
                made.starts[terms[0]] = terms[1]
        return made


@dataclass
class Parcel:
    """A goal and its package, as far as they are known.

    Attributes:
        text: The request.
        origin: The office where the package comes from; empty if the request makes no sense.
        destination: The office where it is to go.
        slot: The planner's id.
        status: The last status; empty before the first.
        place: The office where the package is; empty while a robot carries it.
        missing: Whether it is unknown where the package is, so that ``place`` is empty, too.
        canceled: Whether the client has asked to cancel the goal.
        binding: Whether whoever plans has to know that by now.
    """

    text: str
    origin: str = ""
    destination: str = ""
    slot: str = ""
    status: str = ""
    place: str = ""
    missing: bool = False
    canceled: bool = False
    binding: bool = False

    @property
    def ended(self) -> bool:
        """True if the goal has a terminal status."""
        return self.status in _ENDS


class Validator:
    """Validator of a run: hears of each event in order, and collects violations.

    Announcements and cancel requests bind a robot from its next answer on: before that, an action
    may have been published by a loop that could not yet know. That is different if nothing happens
    at the same time (``immediate``): then all that was said before an action binds it.

    Attributes:
        graph: The map.
        immediate: Whether who publishes an action knows all that was said before.
        violations: What was wrong, in words.
        blocked: The edges that are blocked as far as whoever plans knows.
        positions: Where each robot is.
        loads: The goal whose package a robot carries.
        lost: The robots whose position, or load, is unknown. In a fleet, also
            those that have failed to go on two ways in a row, as they are stuck.
        goals: All goals, by what the caller names them with.
        delivered: How many packages have arrived at their destination.
    """

    def __init__(self, graph: Map, immediate: bool = False) -> None:
        self.graph = graph
        self.immediate = immediate
        self.violations: List[str] = []
        self.blocked: Set[Edge] = set()
        self.positions = dict(graph.starts)
        self.loads: Dict[str, Parcel] = {}
        self.lost: Set[str] = set()
        self.goals: Dict[Hashable, Parcel] = {}
        self.delivered = 0
        self._pending: Dict[str, Tuple[str, str]] = {}  # robots that act: action and its argument
        self._announced: Set[Edge] = set()  # blocked since the last answer
        self._freed: Set[Edge] = set()  # unblocked since then
        self._excused: Dict[
            str, Edge
        ] = {}  # who is on a way that was unblocked just before or since
        self._doubtful: Set[Edge] = set()  # which then failed: in the same step, it counts as free
        self._foiled: Dict[str, Set[Edge]] = {}  # where robots have failed since their last success
        self._closers: Dict[Edge, str] = {}  # that is blocked for no other reason

    # What is told.

    def request(self, goal: Hashable, text: str) -> None:
        """A client sends a goal."""
        parcel = Parcel(text)
        terms = arguments(text, "bring")
        ends, when = terms[:2], terms[2:]
        if (
            len(ends) == 2
            and self.graph.offices.issuperset(ends)
            and ends[0] != ends[1]
            and (not when or (self.graph.is_timed and _WHEN.fullmatch(",".join(when))))
        ):
            parcel.origin, parcel.destination = ends
            parcel.place = parcel.origin
        self.goals[goal] = parcel

    def place(self, goal: Hashable, slot: str) -> None:
        """A goal has a slot: robots that do not wait may serve it before it is accepted."""
        self.goals[goal].slot = slot

    def cancel(self, goal: Hashable) -> None:
        """A client asks to cancel a goal."""
        self.goals[goal].canceled = True

    def message(self, identifier: str, value: str) -> None:
        """A message to rosoclingo: an announcement, or a robot's answer."""
        if identifier == "info":
            blocked, freed = arguments(value, "blocked"), arguments(value, "unblocked")
            found = arguments(value, "at")
            if found and found[0] in self.lost:
                self.lost.discard(found[0])
                self.positions[found[0]] = found[1]
            elif blocked:
                self._announced.add(frozenset(blocked))
                self._closers.pop(frozenset(blocked), None)
            elif freed:
                edge = frozenset(freed)
                self._freed.add(edge)
                self.blocked.discard(edge)
                self._doubtful.discard(edge)
                # If a move there fails in this step, the way counts as free, and if later, not.
                for robot, (name, target) in self._pending.items():
                    if name == "go" and edge == frozenset((self.positions[robot], target)):
                        self._excused[robot] = edge
            if not (self._pending or self._open()):
                self.settle()
        elif identifier in self._pending:
            self._answer(identifier, value)
            self.settle()

    def action(self, robot: str, action: str) -> None:
        """An action is published."""
        freed = set(self._freed)
        if self.immediate:
            self.settle()
        if robot not in self.positions:
            self._wrong(f"{robot} is no robot, and is to do {action}")
            return
        if robot in self._pending:
            self._wrong(f"{robot} is to do {action}, while it does {self._pending[robot]}")
        if not self._open():
            self._wrong(f"{robot} is to do {action}, and there is no request")
        if robot in self.lost:
            self._wrong(f"{robot} is to do {action}, and nobody knows where it is")
        for name, check in (("go", self._go), ("pickup", self._pickup), ("deliver", self._deliver)):
            terms = arguments(action, name)
            if len(terms) == 1:
                self._pending[robot] = (name, terms[0])
                check(robot, terms[0])
                edge = frozenset((self.positions.get(robot, ""), terms[0]))
                if name == "go" and edge in freed:
                    self._excused[robot] = edge
                return
        self._wrong(f"there is no action {action}")

    def status(self, goal: Hashable, word: str, slot: Optional[str] = None) -> None:
        """A goal's status has changed; an accepted one has a slot."""
        parcel = self.goals[goal]
        before = parcel.status
        parcel.status = word
        about = f"the goal {parcel.text} in slot {slot} is {word}"
        if before in _ENDS:
            self._wrong(f"{about}, and was {before} before")
        if word == "accepted":
            parcel.slot = slot or ""
            if before:
                self._wrong(f"{about} twice")
            if not parcel.origin:
                self._wrong(f"{about}, and makes no sense")
            elif any(
                other.slot == slot and not other.ended
                for other in self.goals.values()
                if other is not parcel
            ):
                self._wrong(f"{about}, and the slot has another goal")
        elif word == "rejected":
            if parcel.origin:
                self._wrong(f"{about}, for no reason")
        elif word == "succeeded":
            if parcel.place != parcel.destination or not parcel.origin:
                self._wrong(f"{about}, and its package is {self._whereabouts(parcel)}")
        elif word == "canceled":
            if not parcel.canceled:
                self._wrong(f"{about}, and nobody asked for that")
            if parcel.place != parcel.origin:
                self._wrong(f"{about}, and its package is {self._whereabouts(parcel)}")
        elif not parcel.missing:
            self._wrong(f"{about}, and its package is {self._whereabouts(parcel)}")

    def settle(self) -> None:
        """Makes announcements and cancel requests binding, as no action is under way."""
        self.blocked |= self._announced - self._freed
        self._announced.clear()
        self._freed.clear()
        for parcel in self.goals.values():
            parcel.binding = parcel.canceled

    def finish(self) -> List[str]:
        """Checks that all is done, when nothing is expected to happen any more.

        Returns:
            All violations, also the earlier ones.
        """
        for parcel in self.goals.values():
            if not parcel.ended:
                self._wrong(f"the goal {parcel.text} in slot {parcel.slot} has not ended")
        for robot, (name, term) in self._pending.items():
            self._wrong(f"{robot} has not ended its action {name}({term})")
        for robot, parcel in self.loads.items():
            self._wrong(f"{robot} still carries the package of {parcel.text}")
        return self.violations

    def believed(self) -> Set[Edge]:
        """Returns the edges that are blocked by all announcements so far."""
        return (self.blocked | self._announced | self._doubtful) - self._freed

    # What follows from it.

    def _go(self, robot: str, target: str) -> None:
        edge = frozenset((self.positions[robot], target))
        if edge not in self.graph.edges:
            self._wrong(f"{robot} at {self.positions[robot]} is to go to {target}: not connected")
        elif edge in self.blocked:
            self._wrong(f"{robot} at {self.positions[robot]} is to go to {target}: blocked")

    def _pickup(self, robot: str, slot: str) -> None:
        parcel = self._in_slot(slot)
        about = f"{robot} is to do pickup({slot})"
        if parcel is None:
            self._wrong(f"{about}: no goal is in this slot")
            return
        if robot in self.loads:
            self._wrong(f"{about}: it carries the package of {self.loads[robot].text}")
        others = [one for one, act in self._pending.items() if act == ("pickup", slot)]
        if others != [robot]:
            self._wrong(f"{about}: {' and '.join(others)} do that already")
        if parcel.place != parcel.origin:
            self._wrong(f"{about}: its package is {self._whereabouts(parcel)}")
        elif parcel.place != self.positions[robot]:
            self._wrong(f"{about}: it is at {self.positions[robot]}, not at {parcel.origin}")
        if parcel.binding:
            self._wrong(f"{about}: its goal is cancelled")

    def _deliver(self, robot: str, slot: str) -> None:
        parcel = self._in_slot(slot)
        about = f"{robot} is to do deliver({slot})"
        if parcel is None or self.loads.get(robot) is not parcel:
            self._wrong(f"{about}: it does not carry this package")
            return
        allowed = {parcel.origin if parcel.binding else parcel.destination}
        if parcel.canceled:
            allowed.add(parcel.origin)
        if self.positions[robot] not in allowed:
            self._wrong(f"{about} at {self.positions[robot]}: it is for {' or '.join(allowed)}")

    def _answer(self, robot: str, value: str) -> None:
        name, term = self._pending.pop(robot)
        excused = self._excused.pop(robot, None)
        if value == "success":
            self._forgive(robot)
        if value in ("unknown", "timeout"):
            self.lost.add(robot)
            self._forgive(robot)
            parcel = self._in_slot(term)
            if name != "go" and parcel is not None:
                parcel.place, parcel.missing = "", True
                self.loads.pop(robot, None)
            return
        if name == "go":
            edge = frozenset((self.positions[robot], term))
            if value == "success":
                self.positions[robot] = term
            elif not self._is_stuck(robot, edge):
                if edge == excused:
                    self._doubtful.add(edge)
                else:
                    self._announced.add(edge)
                    self._doubtful.discard(edge)
            return
        parcel = self._in_slot(term)
        if value != "success" or parcel is None:
            return
        if name == "pickup":
            parcel.place = ""
            self.loads[robot] = parcel
        elif self.loads.get(robot) is parcel:
            del self.loads[robot]
            parcel.place = self.positions[robot]
            self.delivered += parcel.place == parcel.destination

    def _is_stuck(self, robot: str, edge: Edge) -> bool:
        """A robot has failed on a way; if it is the second one in a row, that is due to the robot.

        Then it is lost, and the ways are free again of which nothing else says that they are
        blocked. That is so if there are other robots.
        """
        if len(self.graph.starts) == 1:
            return False
        if self._foiled.setdefault(robot, set()) - {edge}:
            self.lost.add(robot)
            for one in [one for one, closer in self._closers.items() if closer == robot]:
                for known in (self.blocked, self._announced, self._doubtful):
                    known.discard(one)
            self._forgive(robot)
            return True
        self._foiled[robot].add(edge)
        if self._closers.get(edge, robot) != robot:
            del self._closers[edge]
        if edge not in self.blocked | self._announced:
            self._closers[edge] = robot
        return False

    def _forgive(self, robot: str) -> None:
        """Forgets a robot's failures, which are no sign any more that it is stuck."""
        self._foiled.pop(robot, None)
        self._closers = {edge: one for edge, one in self._closers.items() if one != robot}

    def _open(self) -> bool:
        return any(not parcel.ended for parcel in self.goals.values())

    def _in_slot(self, slot: str) -> Optional[Parcel]:
        parcels = self.goals.values()
        return next((one for one in parcels if one.slot == slot and not one.ended), None)

    def _whereabouts(self, parcel: Parcel) -> str:
        return f"at {parcel.place}" if parcel.place else "on a robot, or nowhere"

    def _wrong(self, text: str) -> None:
        self.violations.append(text)
