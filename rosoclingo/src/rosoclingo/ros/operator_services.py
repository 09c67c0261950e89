"""The services by which an operator controls a run: ~pause, ~step, ~approve and others."""

from __future__ import annotations

import threading
from typing import Any, Callable, Dict, List, Tuple

import rospy
from std_srvs.srv import Trigger

from rosclingo.errors import TermError
from rosclingo.limits import too_long
from rosoclingo.errors import StoreError
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.journal import Control, ControlArrived
from rosoclingo.loop.values.atoms import canonical
from rosoclingo.msg import ROSoClingoHeld
from rosoclingo.ros.environment import RosEnvironment
from rosoclingo.srv import ControlActuator

_OF_RUN = (Control.PAUSE, Control.HALT, Control.STEP, Control.RESUME)
_OF_ACTUATOR = (Control.HOLD, Control.RELEASE)
_OF_ACTION = (Control.APPROVE, Control.REJECT)
_TAKEN_SECONDS = 5.0  # how long a service waits until the loop has taken the request


class OperatorServices:
    """A service for each request, which answers when the loop has taken it. Thread-safe.

    When ``~pause`` has answered, no action begins until ``~resume``.
    """

    def __init__(
        self, inbox: Inbox, environment: RosEnvironment, is_dynamic: Callable[[], bool]
    ) -> None:
        """Opens the services.

        Args:
            inbox: Where requests come in.
            environment: Knows which actions are held.
            is_dynamic: Whether the mode takes goals, as far as that is known; one that does not
                publishes whole plans.
        """
        self._inbox = inbox
        self._environment = environment
        self._is_dynamic = is_dynamic
        self._services: Dict[Control, rospy.Service] = {
            word: rospy.Service(f"~{word}", Trigger, lambda _, word=word: self._request(word))
            for word in _OF_RUN
        }
        for word in (*_OF_ACTUATOR, *_OF_ACTION):
            self._services[word] = rospy.Service(
                f"~{word}",
                ControlActuator,
                lambda request, word=word: self._request_of(word, request.actuator, request.action),
            )

    def _request_of(self, word: Control, text: str, action: str) -> Tuple[bool, str]:
        reason = too_long(actuator=text, action=action)
        if reason is not None:
            return False, reason
        try:
            actuator, action = (canonical(one) if one else "" for one in (text, action))
        except TermError as err:
            return (
                False,
                f"{err}; an actuator is a ground term, such as robot(2), and so is an action",
            )
        held = self._environment.held.held
        if word in _OF_ACTION and not _held_of(held, actuator, action):
            named = f" {action}" if action else ""
            named += f" of {actuator}" if actuator else ""
            return False, f"no action{named} is held; {_describe(self._environment.held)}"
        if word in _OF_ACTUATOR and not actuator:
            return False, f"{word} of which actuator? ~{Control.PAUSE} is for all of them"
        return self._request(word, actuator)

    def _request(self, word: Control, actuator: str = "") -> Any:
        if not self._is_dynamic():
            return False, "the loop has ended, or its mode is static: it publishes a whole plan"
        taken = threading.Event()
        try:
            self._inbox.put(ControlArrived(word, actuator))
        except StoreError as err:
            return False, str(err)
        if not self._inbox.call_after_controls(taken.set):
            return False, "the loop has ended"
        if not taken.wait(_TAKEN_SECONDS):
            return True, "taken when the command ends that is carried out now"
        return True, _describe(self._environment.held)


def _held_of(held: List[str], actuator: str, action: str) -> List[str]:
    """Returns the actions that are held, of an actuator or all."""
    begin, end = f"do({actuator}," if actuator else "do(", f",{action})" if action else ")"
    return [one for one in held if one.startswith(begin) and one.endswith(end)]


def _describe(decided: ROSoClingoHeld) -> str:
    """Returns what an operator has decided, in a line."""
    said = ["paused" if decided.paused else "running"]
    if decided.on_hold:
        said.append(f"on hold: {', '.join(decided.on_hold)}")
    held = [f"{one} ({reason})" for one, reason in zip(decided.held, decided.reasons)]
    return "; ".join([*said, *([f"held: {', '.join(held)}"] if held else [])])
