#!/usr/bin/env python3
"""A robot's hand for kills.py: an interface that has the world pick up and put down packages.

usage: mortal_robot.py [_looks:=false] [_store:=FILE]

With ``~looks``, which is the default, it does an action again after a crash, because it looks first
whether that is done. Without, it is as any interface that cannot look.
"""

from __future__ import annotations

import rospy

from rosclingo.ros import parameters
from rosclingo.srv import ROSClingoControl
from rosoclingo_interfaces.interface import AGAIN, ActionInterface
from rosoclingo_interfaces.node import run

_HANDLES = ("pickup", "deliver")


class Robot(ActionInterface):
    """Interface whose actions are done by the simulated world."""

    actuators = ("mailbot",)
    leaves_unknown = True  # what drives is another interface

    def __init__(self) -> None:
        self._looks = parameters.flag("looks", True)
        if self._looks:
            self.after_crash = dict.fromkeys(_HANDLES, AGAIN)
        rospy.wait_for_service("world")

    def pickup(self, _slot: int) -> bool:
        """Picks up the package that lies where it is."""
        return (self._looks and _ask("look") != "nothing") or _ask("pickup") != "wrong"

    def deliver(self, _slot: int) -> bool:
        """Puts down what it carries."""
        return (self._looks and _ask("look") == "nothing") or _ask("deliver") != "wrong"


def _ask(what: str) -> str:
    """Requests something of the world, which does it before it answers."""
    return str(rospy.ServiceProxy("world", ROSClingoControl)(what).result)


if __name__ == "__main__":
    run(Robot, "robot")
