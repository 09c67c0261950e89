"""Tracks robots, packages, plan and blocked ways from a system's messages. Needs no ROS."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, FrozenSet, List, Mapping, Optional, Sequence, Set, Tuple

import clingo

from rosclingo.solver.terms import parse_term
from rosoclingo.encodings.graph import Graph
from rosoclingo.loop.words import ABORT, FAILURE, INFO, SOLVER, SUCCESS

_MOST_DELIVERED = 10  # packages that are shown where they were delivered

MapEdge = FrozenSet[str]


@dataclass
class Package:
    """A thing that a goal ``bring(O,P)`` or ``bring(O,P,W)`` is about.

    Attributes:
        label: What to write on it.
        origin: Where it was; empty if that is unknown.
        destination: Where it is to go; empty if that is unknown.
        place: The waypoint where it is; empty while a robot carries it.
        robot: The robot that carries it; empty without one.
        slot: The planner's id of its goal, or origin and destination; known from the pickup on.
        delivered: Whether its goal has succeeded.
    """

    label: str
    origin: str
    destination: str
    place: str
    robot: str = ""
    slot: str = ""
    delivered: bool = False


@dataclass(frozen=True)
class Step:
    """An action of the plan ahead."""

    number: int
    robot: str
    action: clingo.Symbol


class MapSituation:
    """The situation on the map, which follows from the published messages in order.

    Not thread-safe. Every method that takes text raises TermError if it is no ground term.

    Attributes:
        positions: For each robot, the last waypoint that it reached, or where a message has said
            since then that it is.
        blocked: Pairs of waypoints with a blocked way between: a message said so, or a robot failed
            to go there, and since then no robot has gone there, and no message said it is free.
        steps: The plan ahead, ordered by step.
        packages: What is to be brought, is on its way, or was lately delivered.
    """

    def __init__(self, graph: Graph) -> None:
        """Starts with robots at their first waypoints.

        Args:
            graph: The waypoints, and where robots begin.
        """
        self._graph = graph
        self.positions: Dict[str, str] = dict(graph.starts)
        self.blocked: Set[MapEdge] = set()
        self.steps: Tuple[Step, ...] = ()
        self._progress: Dict[int, float] = {}  # by numbers of actions
        self._numbers: Dict[int, str] = {}  # of actions, and whose they are
        self._open: Dict[str, Package] = {}  # by the ids of goals
        self._strange: Dict[str, Package] = {}  # by slots: of goals that came before this node
        self._delivered: List[Package] = []
        # Of robots that have not answered, with where they began.
        self._actions: Dict[str, Tuple[clingo.Symbol, str]] = {}
        self._early: Dict[str, str] = {}  # answers that overtook their actions

    @property
    def packages(self) -> List[Package]:
        """All packages, those that were delivered first."""
        return [*self._delivered, *self._open.values(), *self._strange.values()]

    @property
    def progress(self) -> Mapping[str, float]:
        """Progress of robots in their actions, from 0 to 1; only of those that report it."""
        return {self._numbers[number]: done for number, done in self._progress.items()}

    def begin_goal(self, goal: str, request: str) -> None:
        """A goal was sent."""
        term = parse_term(request)
        if goal and (term.match("bring", 2) or term.match("bring", 3)):
            origin, destination = (str(argument) for argument in term.arguments[:2])
            label = f"{origin} to {destination}"
            self._open[goal] = Package(label, origin, destination, place=origin)

    def end_goal(self, goal: str, succeeded: bool) -> None:
        """A goal has ended: its package is where it should be, or of no interest any more."""
        package = self._open.pop(goal, None)
        if package is not None and succeeded:
            package.place, package.robot, package.delivered = package.destination, "", True
            self._delivered = [*self._delivered, package][-_MOST_DELIVERED:]

    def set_plan(self, actions: Sequence[str]) -> None:
        """Replaces the plan, given in atoms ``do(R,A,T)``."""
        self.steps = _steps([parse_term(action) for action in actions])

    def begin_action(self, actuator: str, action: str) -> None:
        """An action was published, or all of a static mode's plan."""
        robot = str(parse_term(actuator))
        if robot == SOLVER:
            self.steps = _steps(parse_term(f"plan({action.strip()[1:-1]})").arguments)
        # An abort ends a robot's action, and is none itself: the answer is to that action.
        elif robot in self.positions and action.strip() != ABORT:
            self._actions[robot] = parse_term(action), self.positions[robot]
            answer = self._early.pop(robot, None)
            if answer is not None:
                self._end_action(robot, answer)

    def set_numbers(self, numbers: Mapping[int, str]) -> None:
        """Replaces the numbers of the actions that are executed, each with its actuator."""
        self._numbers = {number: str(parse_term(name)) for number, name in numbers.items()}
        self._progress = {n: done for n, done in self._progress.items() if n in self._numbers}

    def set_progress(self, number: int, progress: float) -> bool:
        """Updates the progress of an action, as its interface reports it.

        Args:
            number: The action's number.
            progress: From 0 to 1; anything else if that is unknown.

        Returns:
            Whether that is to be shown, and new.
        """
        robot = self._numbers.get(number, "")
        if robot not in self.positions or not 0 <= progress <= 1:
            return False
        before, self._progress[number] = self._progress.get(number), progress
        return before != progress

    def hear(self, source: str, value: str) -> None:
        """Handles a message to rosoclingo: an answer or an announcement."""
        sender, term = str(parse_term(source)), parse_term(value)
        if sender == INFO:
            self._announce(term)
        elif sender in self.positions and str(term) in (SUCCESS, FAILURE):
            if sender in self._actions:
                self._end_action(sender, str(term))
            else:
                # Action and answer come from different nodes, and may overtake each other.
                self._early[sender] = str(term)

    def _announce(self, term: clingo.Symbol) -> None:
        edge = frozenset(str(argument) for argument in term.arguments)
        if term.match("blocked", 2):
            self.blocked.add(edge)
        elif term.match("unblocked", 2):
            self.blocked.discard(edge)
        elif term.match("at", 2):
            robot, place = map(str, term.arguments)
            if robot in self.positions and place in self._graph.places:
                self.positions[robot] = place

    def _end_action(self, robot: str, answer: str) -> None:
        action, here = self._actions.pop(robot)
        self._forget_step(robot, action)
        if action.match("go", 1):
            there = str(action.arguments[0])
            way = frozenset((here, there))
            if answer == SUCCESS:
                self.positions[robot] = there
                self.blocked.discard(way)
            else:
                self.blocked.add(way)
        elif answer == SUCCESS and (action.match("pickup", 1) or action.match("pickup", 2)):
            self._pick_up(robot, action)
        elif answer == SUCCESS and (action.match("deliver", 1) or action.match("deliver", 2)):
            self._hand_over(robot, _slot(action))

    def _forget_step(self, robot: str, action: clingo.Symbol) -> None:
        """Removes answered actions from the plan ahead: the last action has no successor."""
        for index, step in enumerate(self.steps):
            if (step.robot, step.action) == (robot, action):
                self.steps = self.steps[:index] + self.steps[index + 1 :]
                return

    def _pick_up(self, robot: str, action: clingo.Symbol) -> None:
        """Finds out which package it was: no message says which goal has which slot.

        With the two arguments of the paper's dialect, these are origin and destination.
        """
        here, slot = self.positions[robot], _slot(action)
        waiting = [package for package in self._open.values() if package.place == here]
        if action.match("pickup", 2):
            ends = tuple(str(argument) for argument in action.arguments)
            waiting = [one for one in waiting if (one.origin, one.destination) == ends]
        end = self._where_delivered(robot, slot)
        # The oldest of those that are to go where the plan delivers it, else the oldest of all.
        waiting.sort(key=lambda package: package.destination != end)
        package = waiting[0] if waiting else self._strange.get(slot)
        if package is None:
            package = self._strange[slot] = Package(f"package {slot}", "", "", place="")
        package.place, package.robot, package.slot = "", robot, slot

    def _hand_over(self, robot: str, slot: str) -> None:
        self._strange.pop(slot, None)
        for package in self._open.values():
            if (package.robot, package.slot) == (robot, slot):
                package.place, package.robot = self.positions[robot], ""

    def _where_delivered(self, robot: str, slot: str) -> Optional[str]:
        here = self.positions[robot]
        for step in self.steps:
            if step.robot == robot and step.action.match("go", 1):
                here = str(step.action.arguments[0])
            elif step.robot == robot and str(step.action) == f"deliver({slot})":
                return here
        return None


def _slot(action: clingo.Symbol) -> str:
    """Returns the slot, or origin and destination, in a pickup or deliver."""
    return ",".join(str(argument) for argument in action.arguments)


def _steps(atoms: Sequence[clingo.Symbol]) -> Tuple[Step, ...]:
    return tuple(
        Step(atom.arguments[2].number, str(atom.arguments[0]), atom.arguments[1])
        for atom in atoms
        if atom.match("do", 3) and atom.arguments[2].type is clingo.SymbolType.Number
    )
