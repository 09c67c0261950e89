"""The actions pickup and deliver of a robot without a hand: they succeed."""

from __future__ import annotations

from typing import Mapping, NoReturn, Union

from rosclingo.ros import parameters
from rosoclingo_interfaces.interface import AGAIN, ActionInterface
from rosoclingo_interfaces.ros.node import run


class PickupDeliver(ActionInterface):
    """Succeeds after a delay, whatever the package; leaves other actions to other nodes."""

    leaves_unknown = True
    after_crash: Mapping[str, str] = {"pickup": AGAIN, "deliver": AGAIN}  # to wait does no harm

    def __init__(self) -> None:
        self._delay = parameters.number("delay", 0.0)

    def pickup(self, *_package: Union[int, str]) -> bool:
        """A person puts the package on the robot."""
        self.sleep(self._delay)
        return True

    def deliver(self, *_package: Union[int, str]) -> bool:
        """A person takes the package from the robot."""
        self.sleep(self._delay)
        return True


def main() -> NoReturn:
    """Runs the node."""
    run(PickupDeliver, "pickup_deliver")
