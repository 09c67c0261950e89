"""Replays what mailbots do against the map and the requests, and says every violation.

Nothing of this uses a solver, or the encoding: it is what the encoding is checked with.
"""

from __future__ import annotations

import re
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import Deque, Dict, FrozenSet, Hashable, Iterable, List, Optional, Set, Tuple

from rosclingo.wire.term_text import split_term

Edge = FrozenSet[str]
_FACT = re.compile(r"(connection|office|start)\(([^()]*)\)\.")
_ENDS = ("rejected", "succeeded", "canceled", "aborted")


def arguments(term: str, name: str) -> List[str]:
    """Returns the arguments of a term such as ``bring(o9,o14)``, or nothing if it is another."""
    found, terms = split_term(term.replace(" ", ""))
    return terms if found == name else []


@dataclass
class Map:
    """Where robots can be.

    Attributes:
        offices: The offices.
        edges: Pairs of waypoints next to each other.
        starts: For each robot, the waypoint where it stands in the beginning.
    """

    offices: Set[str] = field(default_factory=set)
    edges: Set[Edge] = field(default_factory=set)
    starts: Dict[str, str] = field(default_factory=dict)

    @classmethod
    def grid(cls, x: int, y: int) -> Map:
        """Returns the map of ``graph_bench.lp``."""
        made = cls(starts={"mailbot": "c(1)"})
        for node in range(1, x * y + 1):
            made.offices.add(str(node))
            made.edges.add(frozenset((f"c({node})", str(node))))
            if node % x:
                made.edges.add(frozenset((f"c({node})", f"c({node + 1})")))
            if node + x <= x * y:
                made.edges.add(frozenset((f"c({node})", f"c({node + x})")))
        return made

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
            else:
                made.starts[terms[0]] = terms[1]
        return made

    def distances(self, source: str, blocked: Iterable[Edge] = ()) -> Dict[str, int]:
        """Returns the steps from a waypoint to each that can be reached."""
        free = self.edges.difference(blocked)
        neighbours: Dict[str, List[str]] = {}
        for edge in free:
            first, second = edge
            neighbours.setdefault(first, []).append(second)
            neighbours.setdefault(second, []).append(first)
        found = {source: 0}
        queue: Deque[str] = deque([source])
        while queue:
            here = queue.popleft()
            for there in neighbours.get(here, ()):
                if there not in found:
                    found[there] = found[here] + 1
                    queue.append(there)
        return found


@dataclass
class Parcel:
    """What is known of a goal and its package.

    Attributes:
        text: The request.
        origin: The office where the package comes from; empty if the request makes no sense.
        destination: The office where it is to go.
        slot: The planner's id.
        status: The last status; empty before the first.
        place: The office where the package is; empty while a robot carries it.
        canceled: Whether the client has asked to cancel the goal.
        binding: Whether whoever plans has to know that by now.
    """

    text: str
    origin: str = ""
    destination: str = ""
    slot: str = ""
    status: str = ""
    place: str = ""
    canceled: bool = False
    binding: bool = False

    @property
    def ended(self) -> bool:
        """Whether the goal has a terminal status."""
        return self.status in _ENDS


class Validator:
    """Is told everything in the order in which it happens, and keeps the list of violations.

    Announcements and cancel requests bind a robot from its next answer on: before that, an action
    may have been published by somebody who could not yet know. That is different if nothing happens
    at the same time (``immediate``): then all that was said before an action binds it.

    Attributes:
        graph: The map.
        immediate: Whether who publishes an action knows all that was said before.
        violations: What was wrong, in words.
        blocked: The edges that are blocked as far as whoever plans knows.
        positions: Where each robot is.
        loads: The goal whose package a robot carries.
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
        self.goals: Dict[Hashable, Parcel] = {}
        self.delivered = 0
        self._pending: Dict[str, Tuple[str, str]] = {}  # robots that act: action and its argument
        self._announced: Set[Edge] = set()  # blocked since the last answer
        self._freed: Set[Edge] = set()  # unblocked since then

    # What is told.

    def request(self, goal: Hashable, text: str) -> None:
        """A client sends a goal."""
        parcel = Parcel(text)
        terms = arguments(text, "bring")
        if len(terms) == 2 and self.graph.offices.issuperset(terms) and terms[0] != terms[1]:
            parcel.origin, parcel.destination = terms
            parcel.place = parcel.origin
        self.goals[goal] = parcel

    def cancel(self, goal: Hashable) -> None:
        """A client asks to cancel a goal."""
        self.goals[goal].canceled = True

    def message(self, identifier: str, value: str) -> None:
        """A message to rosoclingo: an announcement, or a robot's answer."""
        if identifier == "info":
            blocked, freed = arguments(value, "blocked"), arguments(value, "unblocked")
            if blocked:
                self._announced.add(frozenset(blocked))
            elif freed:
                self._freed.add(frozenset(freed))
                self.blocked.discard(frozenset(freed))
            if not (self._pending or self._open()):
                self.settle()
        elif identifier in self._pending:
            self._answer(identifier, value)
            self.settle()

    def action(self, robot: str, action: str) -> None:
        """An action is published."""
        if self.immediate:
            self.settle()
        if robot not in self.positions:
            self._wrong(f"{robot} is no robot, and is to do {action}")
            return
        if robot in self._pending:
            self._wrong(f"{robot} is to do {action}, while it does {self._pending[robot]}")
        if not self._open():
            self._wrong(f"{robot} is to do {action}, and there is no request")
        for name, check in (("go", self._go), ("pickup", self._pickup), ("deliver", self._deliver)):
            terms = arguments(action, name)
            if len(terms) == 1:
                self._pending[robot] = (name, terms[0])
                check(robot, terms[0])
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
        else:
            self._wrong(f"{about}")

    def settle(self) -> None:
        """Whoever plans knows by now all that was said, because no action is on its way."""
        self.blocked |= self._announced - self._freed
        self._announced.clear()
        self._freed.clear()
        for parcel in self.goals.values():
            parcel.binding = parcel.canceled

    def finish(self) -> List[str]:
        """Looks whether all is done, when nothing is expected to happen any more.

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
        """Returns the edges that are blocked for somebody who knows all that was said."""
        return (self.blocked | self._announced) - self._freed

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
        if name == "go":
            if value == "success":
                self.positions[robot] = term
            else:
                self._announced.add(frozenset((self.positions[robot], term)))
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

    def _open(self) -> bool:
        return any(not parcel.ended for parcel in self.goals.values())

    def _in_slot(self, slot: str) -> Optional[Parcel]:
        parcels = self.goals.values()
        return next((one for one in parcels if one.slot == slot and not one.ended), None)

    def _whereabouts(self, parcel: Parcel) -> str:
        return f"at {parcel.place}" if parcel.place else "on a robot, or nowhere"

    def _wrong(self, text: str) -> None:
        self.violations.append(text)
