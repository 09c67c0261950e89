"""Execution policies: timeouts, retries and heartbeats of actions, by patterns.

>>> policies = ActionPolicies({"go(*)": {"retries": 2}, "go(dock)": {"timeout": 60}})
>>> policies.of("robot", "go(3)").retries, policies.of("robot", "go(dock)").timeout
(2, 60.0)
>>> policies.of("robot", "wave")
ActionPolicy(timeout=0.0, factor=0.0, retries=None, pause=0.0, then='', heartbeat=0.0)
>>> ActionPolicies({"go(*)": {"retries": -1}})
Traceback (most recent call last):
    ...
ValueError: go(*): retries has to be an integer from 0 on, and is -1
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, fields
from typing import Any, Callable, List, Mapping, Optional, Tuple

from rosclingo.errors import TermError, shorten
from rosoclingo.loop.execution.patterns import ActionPattern
from rosoclingo.loop.values.atoms import canonical
from rosoclingo.loop.words import BUSY


@dataclass(frozen=True)
class ActionPolicy:
    """How an action is treated that fails, does not end, or whose interface is gone.

    Attributes:
        timeout: How long it may take, in seconds of the loop's clock; 0 for as long as it does.
        factor: The timeout as a factor of its expected duration, in world time.
        retries: How often it is dispatched again after a failure or a timeout; None if that is not
            said, so that an encoding may say it for failures.
        pause: How long before each retry, in seconds of the loop's clock.
        then: The answer that the planner is told when it has failed in the end; empty for the last
            one.
        heartbeat: How often its interface sends a heartbeat at least, in seconds of the loop's
            clock; 0 if it need not.
    """

    timeout: float = 0.0
    factor: float = 0.0
    retries: Optional[int] = None
    pause: float = 0.0
    then: str = ""
    heartbeat: float = 0.0

    @property
    def limits(self) -> bool:
        """Tells if the action may take too long."""
        return bool(self.timeout or self.factor)


_MOST = sys.float_info.max
_DEFAULT = ActionPolicy()


class ActionPolicies:
    """The policies of all actions. Immutable.

    Of several patterns that an action fits, the longest decides, for which ``*`` counts nothing.
    """

    def __init__(self, by_pattern: Mapping[str, Mapping[str, object]]) -> None:
        """Reads policies.

        Args:
            by_pattern: For each pattern, see :class:`.ActionPattern`, the fields of its policy.

        Raises:
            ValueError: A pattern, a field or a value is wrong; the text names it.
        """
        self._policies: List[Tuple[ActionPattern, ActionPolicy]] = [
            (ActionPattern(text), _read(text, given)) for text, given in by_pattern.items()
        ]
        self._policies.sort(key=lambda one: (-len(one[0].text.replace("*", "")), one[0].text))

    def of(self, actuator: str, action: str) -> ActionPolicy:
        """Returns the policy of an action."""
        fitting = (policy for one, policy in self._policies if one.fits(actuator, action))
        return next(fitting, _DEFAULT)


def _seconds(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 <= value <= _MOST:
        raise ValueError("a number from 0 on")
    return float(value)


def _count(value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise ValueError("an integer from 0 on")
    return value


def _answer(value: object) -> str:
    text = str(value) if isinstance(value, int) and not isinstance(value, bool) else value
    try:
        answer = canonical(text) if isinstance(text, str) else BUSY
    except TermError:
        answer = BUSY
    if answer == BUSY:  # which is what the loop itself says
        raise ValueError("a ground term that is an answer, such as failure")
    return answer


_READERS: Mapping[str, Callable[[object], object]] = {
    "timeout": _seconds,
    "factor": _seconds,
    "retries": _count,
    "pause": _seconds,
    "then": _answer,
    "heartbeat": _seconds,
}


def _read(text: str, given: object) -> ActionPolicy:
    names = [one.name for one in fields(ActionPolicy)]
    shown = shorten(text)
    if not isinstance(given, Mapping):
        raise ValueError(f"{shown}: expected some of {', '.join(names)}, and not {given!r:.80}")
    read: Any = {}
    for name, value in given.items():
        if name not in _READERS:
            raise ValueError(f"{shown}: there is no {name!s:.80}, but {', '.join(names)}")
        try:
            read[name] = _READERS[name](value)
        except ValueError as err:
            raise ValueError(f"{shown}: {name} has to be {err}, and is {value!r:.80}") from err
    return ActionPolicy(**read)
