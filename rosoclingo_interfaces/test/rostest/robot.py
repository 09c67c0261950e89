"""A robot's interface with everything that a user may do right and wrong."""

from __future__ import annotations

from typing import Any

from rosoclingo_interfaces.interface import ActionInterface
from rosoclingo_interfaces.node import run


class Robot(ActionInterface):
    actuators = ("robot", "arm(1)")

    def go(self, waypoint: str) -> bool:
        return waypoint != "c2"

    def wait(self) -> bool:
        self.sleep()
        return True

    def measure(self, what: str, times: int) -> str:
        return f"value({what},{times + 1})"

    def pick(self, slot: int) -> str:
        return "none" if self.served_goal is None else self.served_goal.request

    def fail(self) -> bool:
        raise OSError("the battery is empty")

    def nothing(self) -> Any:
        pass


if __name__ == "__main__":
    run(Robot, "robot")
