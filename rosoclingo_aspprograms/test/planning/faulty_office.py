"""An office in which things go wrong, with a mailbot that does not know what."""

from __future__ import annotations

import random
from dataclasses import dataclass
from pathlib import Path
from typing import Dict, FrozenSet, Optional, Sequence, Set, Tuple

from episode import DYN_RESET, OFFICE, PACKAGE, RECORDING
from instance_map import InstanceMap

from rosclingo.solver.options import Options
from rosoclingo.in_process.parts import make_parts
from rosoclingo.in_process.system import System
from rosoclingo.loop.journal import PlanFound, Record, Status, StatusSet
from rosoclingo_aspprograms.validator import arguments

KINDS = ("passing", "blocked", "stuck", "carried", "slipped", "gone")
CAUSES = str(PACKAGE / "mailbot" / "mailbot_causes.lp")
FAILURE, SUCCESS = "failure", "success"
_HELP = 30.0  # seconds that a robot does nothing until somebody comes to see why
_CALLED = 10.0  # likewise, if clients are told that it needs help
_LATE = 40.0  # seconds
_NEVER = 1e9
_END = 300.0  # seconds after which an episode ends
_SECONDS = {"go": 2.0, "pickup": 1.0, "deliver": 1.0, "look": 1.0}
_FAILED_DRIVE = 10.0  # seconds until it is given up


@dataclass
class Fault:
    """Something that goes wrong, once.

    Attributes:
        kind: One of :data:`KINDS`.
        after: How many actions were done before.
        cause: The cause that the encoding should find, with the arguments that are known; empty
            until it has happened.
        answers: How many answers have come since the first one that it has spoilt.
        found: How many had come when its cause was first part of the best explanation, or none.
    """

    kind: str
    after: int
    cause: Tuple[str, ...] = ()
    answers: int = -1
    found: Optional[int] = None


class FaultyOffice(System):
    """The office of the paper, with one mailbot, one fault after the other, and a helper.

    Whoever sees the robot do nothing for 30 s while somebody waits comes, mends its wheels, says
    where it is, and which of the ways that it takes for blocked are free. If clients are told that
    it needs help, somebody comes after 10 s.
    """

    def __init__(self, encoding: str, seed: int, requests: int = 4, faults: int = 2) -> None:
        dice = random.Random(seed)
        self.graph = InstanceMap.read(Path(OFFICE))
        mode = dice.choice([RECORDING, DYN_RESET])
        options = ("-c", "steps=400")
        parts = make_parts(mode, Options((OFFICE, encoding)), options)
        super().__init__(parts.loop)
        offices = sorted(self.graph.offices)
        self.wanted = [tuple(dice.sample(offices, 2)) for _ in range(requests)]
        self.faults = [
            Fault(dice.choice(KINDS), 3 + 9 * number + dice.randrange(6))
            for number in range(faults)
        ]
        self.dice = dice
        self.false_blocks: Set[FrozenSet[str]] = set()
        self.impossible: Set[str] = set()  # goals whose package is gone
        self.ended: Dict[str, float] = {}  # when goals have succeeded
        self.believed_at = self.true_at = "open1"
        self.obstacles: Set[FrozenSet[str]] = set()
        self.stuck = False
        self.gone: Set[str] = set()  # slots
        self.actions = 0
        self.blocked: Set[FrozenSet[str]] = set()
        self.robot = "mailbot"
        self.tried: Set[str] = set()  # where it could not go from where it is
        self.missed: Set[str] = set()  # slots whose packages it could not pick up
        self.helps = 0

    def lost_or_late(self, free: FaultyOffice) -> int:
        """Returns how many deliveries that can be made are not, or late.

        Args:
            free: The same episode without faults.
        """
        return sum(
            self.ended.get(goal.id, _NEVER) > free.ended[goal.id] + _LATE
            for goal in self.goals
            if goal.id not in self.impossible
        )

    # What the loop calls.

    def note(self, record: Record) -> None:
        super().note(record)
        if isinstance(record.event, PlanFound):
            self._look_at_plan()
        elif isinstance(record.event, StatusSet) and record.event.status is Status.SUCCEEDED:
            self.ended[record.event.goal] = self.clock

    def turn(self) -> bool:
        if not self.goals:
            for origin, destination in self.wanted:
                self.request(f"bring({origin},{destination})")
            return True
        if self.clock > _END:
            return False
        if self.robot in self.acting:
            self._act(self.acting[self.robot])
            return True
        return self._help()

    # The world.

    def _act(self, action: str) -> None:
        """Does an action, and answers."""
        name = action.partition("(")[0]
        self.actions += 1
        fault = next((one for one in self.faults if not one.cause), None)
        if (
            fault is not None
            and self.actions > fault.after
            and all(one.found is not None or one.answers > 2 for one in self.faults if one.cause)
        ):
            self._begin(fault, name, action)
        good = self._succeeds(name, action)
        self.clock += _SECONDS[name] if good or name != "go" else _FAILED_DRIVE
        for one in self.faults:
            if one.cause and (one.answers >= 0 or not good):
                one.answers += 1
        self.answer(self.robot, SUCCESS if good else FAILURE)

    def _begin(self, fault: Fault, name: str, action: str) -> None:
        """Has a fault happen, if the action is one that it is about."""
        is_drive, is_pickup = name == "go", name == "pickup"
        if not (is_pickup if fault.kind in ("slipped", "gone") else is_drive):
            return
        target = arguments(action, name)[0]
        way = tuple(sorted((self.true_at, target)))
        cause: Tuple[str, ...] = (self.robot,)
        if fault.kind in ("passing", "blocked"):
            if not self._has_detour(way):
                return
            self.obstacles.add(frozenset(way))
            cause = way
        elif fault.kind == "stuck":
            self.stuck = True
        elif fault.kind == "carried":
            others = sorted(set(self.graph.distances("open1")) - {self.true_at})
            self.true_at = self.dice.choice(others)
        elif fault.kind == "slipped":
            cause = (self.robot, target)
        else:
            self.gone.add(target)
            goal = self.loop.state.goals.occupant(target)
            assert goal is not None
            self.impossible.add(goal.id)
            cause = (target,)
        fault.cause = (fault.kind, *cause)

    def _has_detour(self, way: Sequence[str]) -> bool:
        blocked = [*self.obstacles, frozenset(way)]
        return set(self.graph.distances("open1", blocked)) == set(self.graph.distances("open1"))

    def _succeeds(self, name: str, action: str) -> bool:
        fault = next((one for one in self.faults if one.cause and one.answers < 0), None)
        if name == "look":
            self._look()
            return True
        target = arguments(action, name)[0]
        if name == "go":
            way = frozenset((self.true_at, target))
            if self.stuck or self.true_at != self.believed_at or way in self.obstacles:
                if fault is not None and fault.kind == "passing":
                    self.obstacles.discard(way)
                return False
            self.believed_at = self.true_at = target
            return True
        is_spoilt = fault is not None and fault.kind == "slipped" and fault.cause[2] == target
        return not (is_spoilt or (name == "pickup" and target in self.gone))

    def _look(self) -> None:
        """Tells what the robot sees: where it is, and what of its failure has remained."""
        self.tell("info", f"at({self.robot},{self.true_at})")
        if self.true_at == self.believed_at:
            for target in sorted(self.tried):
                way = tuple(sorted((self.true_at, target)))
                is_free = frozenset(way) not in self.obstacles
                self.tell("info", f"{'unblocked' if is_free else 'blocked'}({','.join(way)})")
            for slot in sorted(self.missed):
                self.tell("info", f"{'gone' if slot in self.gone else 'there'}({slot})")
        self.believed_at = self.true_at
        self.tried.clear()
        self.missed.clear()

    def answer(self, actuator: str, value: str = SUCCESS) -> str:
        action = super().answer(actuator, value)
        name = action.partition("(")[0]
        if name == "go":
            self.tried = set() if value == SUCCESS else {*self.tried, *arguments(action, "go")}
        elif name == "pickup":
            self.missed = set() if value == SUCCESS else set(arguments(action, "pickup"))
        return action

    def _help(self) -> bool:
        """Somebody comes, if the robot does nothing for long though there is something to do."""
        if all(goal.words[-1:] in (["succeeded"], ["aborted"]) for goal in self.goals):
            return False
        self.helps += 1
        if self.helps > 6:
            return False
        told = any("wheels" in line for goal in self.goals for line in goal.lines[-3:])
        self.clock += _CALLED if told else _HELP
        self.stuck = False
        self.true_at = self.believed_at
        self.tell("info", f"at({self.robot},{self.true_at})")
        for way in sorted(map(sorted, self.blocked - self.obstacles)):
            self.tell("info", f"unblocked({','.join(way)})")
        return True

    def _look_at_plan(self) -> None:
        symbols = self.loop.state.plan.symbols
        held = [arguments(text, "holds") for text in symbols if text.startswith("holds(blocked(")]
        latest = max((int(one[1]) for one in held), default=0)
        self.blocked = {
            frozenset(arguments(fluent, "blocked")) for fluent, step in held if int(step) == latest
        }
        self.false_blocks |= self.blocked - self.obstacles
        best = [arguments(text, "belief") for text in symbols if text.startswith("belief(1,")]
        for fault in self.faults:
            is_sought = fault.cause and fault.answers >= 0 and fault.found is None
            if is_sought and any(_is_one(cause, fault.cause) for _, _, cause in best):
                fault.found = fault.answers


def _is_one(text: str, cause: Sequence[str]) -> bool:
    """Compares a cause, which has a moment, with that of a fault."""
    found = arguments(text, cause[0])
    return found[: len(cause) - 1] == list(cause[1:])


def play(encoding: str, seed: int, faults: int = 2) -> FaultyOffice:
    """Plays an episode to its end."""
    office = FaultyOffice(encoding, seed, faults=faults)
    office.run()
    return office
