"""Fault injection: an interface lies, dies, or fails in actions that rules choose."""

from __future__ import annotations

import logging
import math
import random
import re
import threading
from dataclasses import dataclass
from typing import Any, Callable, Dict, Mapping, Optional, Pattern, Tuple

import clingo

from rosoclingo.loop.words import FAILURE, SUCCESS
from rosoclingo_interfaces.execution import ActionExecution, Clock, current
from rosoclingo_interfaces.interface import ActuatorAnswer

LIES, DIES, FAILS = "lies", "dies", "fails"

_KEYS = {
    LIES: ("actions", "probability", "times"),
    DIES: ("actions", "probability", "times", "at"),
    FAILS: ("actions", "probability", "times", "lasts"),
}
_ENTRY = "such as {lies: {actions: go, probability: 0.1}, seed: 3}"

_log = logging.getLogger("rosout")  # where rospy.loginfo and its like log to


@dataclass(frozen=True)
class FaultRule:
    """The actions in which an interface has a fault.

    Attributes:
        actions: Where the expression is found in an action.
        probability: How probable the fault is in such an action.
        times: How often it happens at most; infinity for no limit.
        at_end: Whether an interface dies when it has done the action, and not before it begins.
        lasts: For how long the same action fails again, in seconds.
    """

    actions: Pattern[str] = re.compile("")
    probability: float = 1.0
    times: float = math.inf
    at_end: bool = False
    lasts: float = 0.0


@dataclass(frozen=True)
class FaultRules:
    """The faults of an interface, from its parameter.

    Attributes:
        rules: By what happens: ``lies``, ``dies`` or ``fails``.
        seed: Of the probabilities.
    """

    rules: Mapping[str, FaultRule]
    seed: int = 0


def read_rules(content: Mapping[str, Any]) -> FaultRules:
    """Parses the rules.

    Args:
        content: Such as ``{"lies": {"actions": "^go", "probability": 0.1}, "seed": 3}``.

    Raises:
        ValueError: Something is wrong; the message names the entry.
    """
    rules: Dict[str, FaultRule] = {}
    for name, entry in content.items():
        if name == "seed":
            continue
        if name not in _KEYS:
            raise ValueError(f"there is no entry {name!r}; there are {', '.join(_KEYS)} and seed")
        rules[name] = _rule(name, entry)
    seed = _number("seed", content.get("seed", 0), math.inf)
    if not seed.is_integer():
        raise ValueError(f"seed: expected an integer, not {seed!r}")
    return FaultRules(rules, int(seed))


def _rule(name: str, entry: Any) -> FaultRule:
    if not isinstance(entry, dict):
        raise ValueError(f"{name}: expected a mapping, {_ENTRY}, not {entry!r:.80}")
    for key in entry:
        if key not in _KEYS[name]:
            known = ", ".join(_KEYS[name])
            raise ValueError(f"{name}: there is no entry {key!r}; there are {known}")
    try:
        actions = re.compile(str(entry.get("actions", "")))
    except re.error as err:
        raise ValueError(f"{name}: actions: expected a regular expression: {err}") from err
    at = entry.get("at", "begin")
    if at not in ("begin", "end"):
        raise ValueError(f"{name}: at: expected begin or end, not {at!r:.80}")
    # A node that dies is started again, and would die in the same action for ever.
    times = entry.get("times", 1 if name == DIES else None)
    return FaultRule(
        actions,
        _number(f"{name}: probability", entry.get("probability", 1), 1.0),
        math.inf if times is None else _number(f"{name}: times", times, math.inf),
        at == "end",
        _number(f"{name}: lasts", entry.get("lasts", 0), math.inf),
    )


def _number(name: str, value: Any, most: float) -> float:
    good = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not (good and math.isfinite(value) and 0 <= value <= most):
        end = f" to {most:g}" if most < math.inf else ""
        raise ValueError(f"{name}: expected a number from 0{end}, not {value!r:.80}")
    return float(value)


class FaultyActions:
    """Executes actions, and injects the faults of some rules. Thread-safe.

    Each kind of fault of each actuator has its own random numbers, so that a seed repeats them in
    whatever order several actuators act.
    """

    def __init__(
        self,
        perform: Callable[[clingo.Symbol], ActuatorAnswer],
        rules: FaultRules,
        die: Callable[[], None],
        clock: Clock,
        deaths: int = 0,
    ) -> None:
        """Prepares the faults.

        Args:
            perform: Does an action; called in the action's thread.
            rules: When there is a fault.
            die: Ends the process at once.
            clock: The time in seconds.
            deaths: How often the node has died before.
        """
        self._perform = perform
        self._rules = rules
        self._die = die
        self._clock = clock
        self._deaths = deaths
        self._lock = threading.Lock()  # guards the two below
        self._random: Dict[Tuple[str, str], random.Random] = {}
        self._times: Dict[str, int] = {DIES: deaths}
        # By actuator and action; one actuator's actions come one after the other.
        self._fails_until: Dict[Tuple[str, str], float] = {}

    def perform(self, action: clingo.Symbol) -> ActuatorAnswer:
        """Executes an action, or injects a fault."""
        execution = current()
        dies = self._happens(DIES, execution.actuator, str(action))
        if dies is not None and not dies.at_end:
            _log.warning("%s: the node dies before it, as ~faults says", execution)
            self._die()
        answer = self._answer(execution, action)
        if dies is not None:
            _log.warning("%s: the node dies before the answer, as ~faults says", execution)
            self._die()
        return answer

    def _answer(self, execution: ActionExecution, action: clingo.Symbol) -> ActuatorAnswer:
        """Executes an action, or only answers it."""
        text = str(action)
        if self._happens(LIES, execution.actuator, text):
            _log.warning("%s: is not done, but answered with success, as ~faults says", execution)
            return SUCCESS
        if self._fails(execution.actuator, text):
            _log.warning("%s: is not done, as ~faults says", execution)
            return FAILURE
        return self._perform(action)

    def _fails(self, actuator: str, action: str) -> bool:
        """Returns whether an action fails, at first or because it has failed lately."""
        now = self._clock()
        if now < self._fails_until.get((actuator, action), -math.inf):
            return True
        rule = self._happens(FAILS, actuator, action)
        if rule is not None and rule.lasts:
            self._fails_until[actuator, action] = now + rule.lasts
        return rule is not None

    def _happens(self, kind: str, actuator: str, action: str) -> Optional[FaultRule]:
        """Returns the rule of a kind of fault if it happens now."""
        rule = self._rules.rules.get(kind)
        if rule is None or not rule.actions.search(action):
            return None
        with self._lock:
            seed = f"{self._rules.seed} {kind} {actuator} {self._deaths}"
            dice = self._random.setdefault((kind, actuator), random.Random(seed))  # noqa: S311
            times = self._times.get(kind, 0)
            if times >= rule.times or dice.random() >= rule.probability:
                return None
            self._times[kind] = times + 1
        return rule
