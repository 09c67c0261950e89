"""Answers the actions of all actuators, as parameters say: a dummy robot."""

from __future__ import annotations

import random
from typing import NoReturn

import clingo
import rospy

from rosclingo.ros import parameters
from rosoclingo.in_process.answers import ANSWERS, Answers
from rosoclingo.loop.words import SUCCESS
from rosoclingo_interfaces.interface import AGAIN, ActionInterface, ActuatorAnswer
from rosoclingo_interfaces.ros.node import run


class Fulfill(ActionInterface):
    """Answers after a delay; see the package's README for the parameters."""

    leaves_unknown = True

    def __init__(self) -> None:
        sequence = parameters.words("sequence")
        strange = [word for word in sequence if word not in ANSWERS]
        if strange:
            raise parameters.wrong(
                "sequence", f"expected a list of {', '.join(ANSWERS)}: {strange[0]}"
            )
        seed = parameters.integer("seed", random.randrange(2**31))  # noqa: S311
        probability = parameters.number("fail_probability", 0.0, 1.0)
        if probability > 0:
            rospy.loginfo("fails with probability %g; _seed:=%d repeats it", probability, seed)
        self._actions = parameters.pattern("actions", "")
        self._delay = parameters.number("delay", 0.0)
        self._answers = Answers(
            sequence, parameters.pattern("no_answer"), parameters.pattern("fail"), probability, seed
        )

    def knows(self, action: clingo.Symbol) -> bool:
        """Returns whether this node answers an action; the others are another node's."""
        return self._actions.search(str(action)) is not None

    def outcome_after_crash(self, action: clingo.Symbol) -> str:
        """Returns that an action may be repeated, since it has no effect."""
        return AGAIN

    def perform(self, action: clingo.Symbol) -> ActuatorAnswer:
        """Waits for the delay and answers; or waits for ever."""
        # An actuator's actions come one after the other, so no other thread uses its entries.
        answer = self._answers.next(self.actuator, str(action))
        if answer is None:
            rospy.loginfo("%s is not answered, as ~no_answer or ~sequence says", self.execution)
        self.sleep(None if answer is None else self._delay)
        return answer or SUCCESS


def main() -> NoReturn:
    """Runs the node."""
    run(Fulfill, "fulfill")
