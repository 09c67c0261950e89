"""The services by which an operator controls a run: ~pause, ~step, ~approve and others."""

from __future__ import annotations

from concurrent.futures import Future, wait
from typing import Callable, Dict, List, Optional, Tuple

import rospy
from std_srvs.srv import Trigger

from rosclingo.errors import TermError
from rosclingo.limits import too_long
from rosoclingo.errors import StoreError
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.journal import Control, ControlArrived, ControlOutcome
from rosoclingo.loop.values.atoms import canonical
from rosoclingo.loop.values.execution import HoldReason, OperatorState
from rosoclingo.ros.environment import RosEnvironment
from rosoclingo.srv import ControlActuator, ControlActuatorRequest

_OF_RUN = (Control.PAUSE, Control.HALT, Control.STEP, Control.RESUME)
_OF_ACTUATOR = (Control.HOLD, Control.RELEASE)
_OF_ACTION = (Control.APPROVE, Control.REJECT)
_FOR_APPROVAL = (HoldReason.APPROVAL, HoldReason.RETRY)
_TAKEN_SECONDS = 5.0  # how long a service waits for what is certain: that the loop takes a request
_LOOK_SECONDS = 0.5  # how often it looks whether the loop has ended
_ENDED = "the loop has ended"


class OperatorServices:
    """A service for each request, which answers with what became of it. Thread-safe.

    When ``~pause`` has answered, no action begins until ``~resume``.
    """

    def __init__(
        self, inbox: Inbox, environment: RosEnvironment, is_dynamic: Callable[[], bool]
    ) -> None:
        """Opens the services.

        Args:
            inbox: Where requests come in.
            environment: Knows which actions are held, and is told what became of requests.
            is_dynamic: Whether the mode takes goals, as far as that is known; one that does not
                publishes whole plans.
        """
        self._inbox = inbox
        self._environment = environment
        self._is_dynamic = is_dynamic
        # By the ids of requests in Python.
        self._pending: Dict[int, Future[ControlOutcome]] = {}
        environment.answered_control = self._answer
        self._services: Dict[Control, rospy.Service] = {
            word: rospy.Service(f"~{word}", Trigger, lambda _, word=word: self._of_run(word))
            for word in _OF_RUN
        }
        for word in (*_OF_ACTUATOR, *_OF_ACTION):
            self._services[word] = rospy.Service(
                f"~{word}", ControlActuator, lambda asked, word=word: self._of_actuator(word, asked)
            )

    def _answer(self, request: ControlArrived, outcome: ControlOutcome) -> None:
        pending = self._pending.pop(id(request), None)
        if pending is not None:
            pending.set_result(outcome)

    def _of_run(self, word: Control) -> Tuple[bool, str]:
        return self._ask([ControlArrived(word)])

    def _of_actuator(self, word: Control, asked: ControlActuatorRequest) -> Tuple[bool, str]:
        reason = too_long(actuator=asked.actuator, action=asked.action)
        if reason is not None:
            return False, reason
        try:
            actuator, action = (canonical(t) if t else "" for t in (asked.actuator, asked.action))
        except TermError as err:
            reason = f"{err}; an actuator is a ground term, such as robot(2), and so is an action"
            return False, reason
        if word in _OF_ACTUATOR and not actuator:
            return False, f"{word} of which actuator? ~{Control.PAUSE} is for all of them"
        request = ControlArrived(word, actuator, action=action, token=asked.token)
        if word in _OF_ACTUATOR or actuator:
            return self._ask([request])
        decided = self._environment.decided
        fitting = [one for one in decided.held if action in ("", one.action)]
        fitting = [one for one in fitting if asked.token in (0, one.token)]
        is_for_all = not (action or asked.token)
        if is_for_all and word is Control.APPROVE:
            fitting = [one for one in fitting if one.reason in _FOR_APPROVAL]
        if not (fitting or is_for_all):
            return self._ask([request])  # which is refused, with the reason
        if not fitting:
            return False, f"no action waits for that; {_describe(decided)}"
        if not is_for_all and len(fitting) > 1:
            named = " and ".join(one.actuator for one in fitting)
            return False, f"{action} is held for {named}: name the actuator, or the token in ~held"
        return self._ask(
            [
                ControlArrived(word, one.actuator, action=one.action, token=one.token)
                for one in fitting
            ]
        )

    def _ask(self, requests: List[ControlArrived]) -> Tuple[bool, str]:
        """Has requests taken by the loop, and returns what has become of all of them.

        What is certain is answered after some seconds, if a command goes on for longer. Whether an
        action can be approved or rejected is known only when that is over.
        """
        if not self._is_dynamic():
            return False, f"{_ENDED}, or its mode is static: it publishes a whole plan"
        pending: List[Future[ControlOutcome]] = [Future() for _ in requests]
        for request, one in zip(requests, pending):
            self._pending[id(request)] = one
        try:
            for request in requests:
                self._inbox.put(request)
            outcomes = [self._wait(*pair) for pair in zip(requests, pending)]
        except StoreError as err:
            return False, str(err)
        finally:
            for request in requests:
                self._pending.pop(id(request), None)
        said = [one.text for one in outcomes if one is not None]
        how = _describe(self._environment.decided)
        is_of_run = requests[0].control in (*_OF_RUN, *_OF_ACTUATOR)
        if None in outcomes:
            said, how = ["taken when the command ends that is carried out now"], ""
        words = [how, *said] if is_of_run else [*said, how]
        return all(one is None or one.is_done for one in outcomes), "; ".join(filter(None, words))

    def _wait(
        self, request: ControlArrived, pending: Future[ControlOutcome]
    ) -> Optional[ControlOutcome]:
        """Returns the outcome of a request; None if it will be done for certain."""
        is_certain = request.control not in _OF_ACTION and not (request.action or request.token)
        waited = 0.0
        while not wait([pending], _LOOK_SECONDS).done:
            waited += _LOOK_SECONDS
            is_over = rospy.is_shutdown() or not self._inbox.call_soon(lambda: None)
            if (is_over or self._inbox.closed) and not pending.done():
                return ControlOutcome(False, _ENDED)
            if is_certain and waited >= _TAKEN_SECONDS:
                return None
        return pending.result()


def _describe(decided: OperatorState) -> str:
    """Returns an operator's decisions in a line."""
    said = ["paused" if decided.is_paused else "running"]
    if decided.on_hold:
        said.append(f"on hold: {', '.join(decided.on_hold)}")
    held = [f"do({one.actuator},{one.action}) ({one.reason})" for one in decided.held]
    return "; ".join([*said, *([f"held: {', '.join(held)}"] if held else [])])
