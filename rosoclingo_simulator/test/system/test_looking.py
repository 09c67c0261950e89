"""A simulated robot looks around: the test is its planner, and asks move_base_interface.py.

Needs a sourced workspace.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import List

import pytest
import yaml
from terminals import Terminal, Terminals, terminals, wait_for

__all__ = ["terminals"]

# Near o1, somebody carries it into the corridor, not far from c5.
FAULTS = (
    "faults:\n- {fault: wrong_pose, when: {place: o1}, carried_to: {x: 21, y: -17, theta: 3}}\n"
)


class Planner:
    """Asks the robot for actions, one after the other."""

    def __init__(self, terminals: Terminals, interfaces: Terminal) -> None:
        self._terminals = terminals
        self._interfaces = interfaces

    def ask(self, action: str) -> str:
        """Asks for an action, and returns its answer."""
        said = f"mailbot: {action}: "
        before = self._interfaces.output.count(said)
        self._terminals.publish(
            "/rosoclingo/out", "rosoclingo/ROSoClingoOut", f"{{id: mailbot, action: '{action}'}}"
        )
        wait_for(
            lambda: self._interfaces.output.count(said) > before, lambda: self._interfaces.output
        )
        return self._interfaces.output.rpartition(said)[2].split()[0]

    def obstacle(self, line: str) -> None:
        asked = self._terminals.run("rosservice", "call", "/simulator/obstacle", line)
        assert "success: True" in asked.output


@pytest.mark.costly
def test_a_robot_looks_around(terminals: Terminals, tmp_path: Path) -> None:
    faults = tmp_path / "faults.yaml"
    faults.write_text(FAULTS)
    simulator = terminals.start(
        "roslaunch", "rosoclingo_simulator", "embedded.launch", "speed:=10", f"faults:={faults}"
    )
    simulator.wait_for("simulates")
    interfaces = terminals.start(
        "roslaunch", "rosoclingo_interfaces", "mailbot_interfaces.launch", "look:=true"
    )
    wait_for(lambda: len(terminals.subscribers("/rosoclingo/out")) == 2)
    heard = terminals.listen("/move_base_interface", "/rosoclingo/in")
    planner = Planner(terminals, interfaces)

    told: List[str] = []

    def is_told(*values: str) -> None:
        """Waits until no more and no less is told than before and these."""
        told.extend(values)
        wait_for(lambda: announced() == told, lambda: heard.output)

    def announced() -> List[str]:
        messages = yaml.safe_load_all(heard.output)
        return [one["value"] for one in messages if one and one["id"] == "info"]

    assert planner.ask("look") == "success"
    is_told("at(mailbot,open1)")
    assert planner.ask("go(c1)") == "success"
    planner.obstacle("block c1 o3")
    assert planner.ask("go(o3)") == "failure"
    assert planner.ask("look") == "success"
    is_told("at(mailbot,c1)", "blocked(c1,o3)")
    assert planner.ask("go(o3)") == "failure"
    planner.obstacle("unblock c1 o3")
    assert planner.ask("look") == "success"
    is_told("at(mailbot,c1)", "unblocked(c1,o3)")
    planner.ask("go(o1)")  # which it may believe to have done
    simulator.wait_for("(wrong_pose) begins")
    assert planner.ask("look") == "success"
    is_told("at(mailbot,c5)")
    simulator.wait_for("(wrong_pose) ends")
    truth = yaml.safe_load(terminals.latched("/ground_truth"))["pose"]["pose"]["position"]
    assert math.hypot(truth["x"] - 23, truth["y"] + 17) < 0.5
