"""Interfaces are killed in an action, and start again: the system as processes.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import List

import pytest
from terminals import Terminal, Terminals, terminals, wait_for

__all__ = ["terminals"]

ENCODING = Path(__file__).with_name("crashes.lp")

# It waits in an action as long as there is a file, and writes down what it does.
ROBOT = """
from pathlib import Path
from rosoclingo_interfaces.interface import ActionInterface
from rosoclingo_interfaces.node import run

class Robot(ActionInterface):
    actuators = ("robot",)

    def go(self, place):
        return self._act(f"go({place})")

    def pickup(self, package):
        return self._act(f"pickup({package})")

    def _act(self, action):
        with open("effects", "a") as file:
            file.write(action + "\\n")
        while Path("slow").exists():
            self.sleep(0.05)
        return True

run(Robot, "robot")
"""


class System:
    """rosoclingo, a robot in a folder, and the clients of the goals."""

    def __init__(self, terminals: Terminals, folder: Path) -> None:
        self._terminals = terminals
        self._folder = folder
        self._asked = 0
        (folder / "robot.py").write_text(ROBOT)
        self.node = terminals.start("rosrun", "rosoclingo", "run-1.0.py", "-f", str(ENCODING))
        self.results = terminals.listen("/rosoclingo", "/rosoclingo/result")

    def robot(self) -> Terminal:
        """Starts the robot's interface."""
        command = f"cd {self._folder} && exec rosrun rosclingo python robot.py _store:=robot.json"
        return self._terminals.start("bash", "-c", command)

    def ask(self, request: str) -> None:
        """Sends a goal, and waits until its action is published."""
        self._asked += 1
        self._terminals.publish(
            "/rosoclingo/goal", "rosoclingo/ROSoClingoActionGoal",
            f"{{goal_id: {{id: g{self._asked}}}, goal: {{request: {request}}}}}",
        )  # fmt: skip
        self.node.wait_for(f"robot: {request}")

    def ends(self, status: str) -> None:
        """Waits until all goals have ended, of which the last one has a status."""
        wait_for(lambda: self.results.output.count('result: "') == self._asked)
        assert self.results.output.rstrip("-\n ").endswith(f'result: "{status}"')

    @property
    def effects(self) -> List[str]:
        """What was done, by the robot's own account."""
        file = self._folder / "effects"
        return file.read_text().splitlines() if file.exists() else []

    def kill_in(self, robot: Terminal, request: str) -> None:
        """Asks for an action, and kills the interface while it does that."""
        slow = self._folder / "slow"
        slow.touch()
        self.ask(request)
        wait_for(lambda: self.effects[-1:] == [request])
        os.killpg(robot.process.pid, signal.SIGKILL)
        robot.wait()
        slow.unlink()


@pytest.fixture
def system(terminals: Terminals, tmp_path: Path) -> System:
    return System(terminals, tmp_path)


@pytest.mark.costly
def test_a_crash_in_an_action(system: System) -> None:
    """What can be done again is done again; of all else, nobody says more than is known."""
    first = system.robot()
    system.kill_in(first, "go(1)")
    second = system.robot()
    system.ends("succeeded")
    assert system.effects == ["go(1)", "go(1)"]
    assert "go(1) was begun before this node was started" in second.output

    system.kill_in(second, "pickup(1)")
    third = system.robot()
    system.ends("aborted")
    third.wait_for("whether it was done is unknown: unknown")
    assert system.effects == ["go(1)", "go(1)", "pickup(1)"]

    # One that starts late does what is to be done, and what was answered it does not do.
    third.interrupt()
    assert third.wait() == 0
    system.ask("pickup(2)")
    fourth = system.robot()
    system.ends("succeeded")
    fourth.interrupt()
    assert fourth.wait() == 0
    fifth = system.robot()
    fifth.wait_for("does the actions of robot")
    system.ask("go(2)")
    system.ends("succeeded")
    assert system.effects[3:] == ["pickup(2)", "go(2)"]
    assert "Traceback" not in "".join(
        one.output for one in (system.node, second, third, fourth, fifth)
    )


@pytest.mark.costly
@pytest.mark.parametrize("program", ["pickup_deliver.py", "fulfill.py"])
def test_a_robot_without_a_hand(
    system: System, terminals: Terminals, tmp_path: Path, program: str
) -> None:
    """It may wait twice, so that all is known."""
    store = tmp_path / "hand.json"
    robot = ("rosrun", "rosoclingo_interfaces", program, f"_store:={store}")
    first = terminals.start(*robot, "_delay:=60")
    system.ask("pickup(1)")
    wait_for(lambda: store.exists() and "pickup(1)" in store.read_text())
    os.killpg(first.process.pid, signal.SIGKILL)
    first.wait()
    second = terminals.start(*robot, "_delay:=0")
    system.ends("succeeded")
    assert "is unknown: it is done again" in second.output


def test_a_store_that_is_none(system: System, tmp_path: Path) -> None:
    (tmp_path / "robot.json").write_text("not JSON")
    robot = system.robot()
    assert robot.wait() == 2
    assert f"{tmp_path}/robot.json (~store) is no store of an interface" in robot.output
    assert "Traceback" not in robot.output
