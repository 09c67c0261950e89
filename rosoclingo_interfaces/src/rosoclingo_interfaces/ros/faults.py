"""Faults of an interface's node, from its parameter ``~faults``."""

from __future__ import annotations

import os
import signal
from typing import Callable, Optional

import clingo
import rospy

from rosclingo.ros import parameters
from rosoclingo_interfaces.execution import Clock
from rosoclingo_interfaces.faulty_actions import FaultyActions, read_rules
from rosoclingo_interfaces.interface import ActionInterface, ActuatorAnswer

_DEATHS = "~deaths"  # outlives the process


def faulty_perform(
    interface: ActionInterface, seconds: Clock
) -> Optional[Callable[[clingo.Symbol], ActuatorAnswer]]:
    """Returns the function that executes an interface's actions with injected faults.

    Args:
        interface: Does the actions.
        seconds: The node's clock.

    Returns:
        None if there are no faults.

    Raises:
        ParameterError: The parameter is wrong.
    """
    content = parameters.mapping("faults")
    if not content:
        return None
    try:
        rules = read_rules(content)
    except ValueError as err:
        raise parameters.wrong("faults", err) from err
    deaths = parameters.integer("deaths", 0)

    def die() -> None:
        # The node that is started again is to know that it has died.
        rospy.set_param(_DEATHS, deaths + 1)
        os.kill(os.getpid(), signal.SIGKILL)

    return FaultyActions(interface.perform, rules, die, seconds, deaths).perform
