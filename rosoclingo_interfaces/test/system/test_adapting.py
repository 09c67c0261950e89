"""adapter.py as a process: its file, and servers that die.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from terminals import Terminal, Terminals, terminals

__all__ = ["terminals"]

GO = """actions:
- action: go(_)
  actionlib: base
  type: move_base_msgs/MoveBase
  fields: {target_pose: {header: {frame_id: map}}}
"""
RING = "actions:\n- {action: ring, service: bell, type: std_srvs/Trigger}\n"

# Each file, with the line and the error that a node ends with.
WRONG = {
    GO.replace("frame_id", "frame"): "line 5: fields.target_pose.header: std_msgs/Header has no fi",
    GO.replace("MoveBase", "MoveBaseGoal"): "line 4: type: there is no type of action 'move_base",
    GO.replace("map", "'{W}'"): "line 5: fields.target_pose.header.frame_id: there is no 'W'",
    RING.replace("Trigger", "Triger"): "line 2: type: there is no type of service 'std_srvs/Trig",
    RING.replace("Trigger", "_Trigger"): "line 2: type: there is no type of service 'std_srvs/_Tri",
    RING
    + "- {action: sing, publish: a, type: std_msgs/_Bool}": "line 3: type: there is no type of",
    RING + "- {action: sing, publish: a, type: std_msgs/Bool}\n"
    "- {action: go, publish: a, type: std_msgs/String}\n": "line 4: /a is of the type std_msgs/B",
}

SERVER = """
import rospy
from actionlib import SimpleActionServer
from move_base_msgs.msg import MoveBaseAction
rospy.init_node("base")
server = SimpleActionServer("base", MoveBaseAction, lambda goal: (print("begun"), rospy.spin()),
                            False)
server.start()
rospy.spin()
"""

BELL = """
import os, rospy
from std_srvs.srv import Trigger
rospy.init_node("bell")
rospy.Service("bell", Trigger, lambda request: os._exit(1))
rospy.spin()
"""


def adapt(terminals: Terminals, folder: Path, text: str, name: str = "adapter") -> Terminal:
    """Starts a node with a file of this content."""
    file = folder / f"{name}.yaml"
    file.write_text(text)
    return terminals.start(
        "rosrun", "rosoclingo_interfaces", "adapter.py", f"_adapter:={file}", f"__name:={name}"
    )


def act(terminals: Terminals, action: str) -> None:
    terminals.publish(
        "/rosoclingo/out", "rosoclingo/ROSoClingoOut", f"{{id: robot, action: {action}}}"
    )


@pytest.mark.costly
def test_mistakes_end_the_node(terminals: Terminals, tmp_path: Path) -> None:
    nodes = [
        adapt(terminals, tmp_path, text, f"wrong{number}") for number, text in enumerate(WRONG)
    ]
    for number, (node, message) in enumerate(zip(nodes, WRONG.values())):
        assert node.wait() == 2
        assert f"{tmp_path / f'wrong{number}.yaml'}, {message}" in node.output
        assert "Traceback" not in node.output


@pytest.mark.costly
def test_a_server_that_dies(terminals: Terminals, tmp_path: Path) -> None:
    """An action that it does fails; the next one waits until it is there again."""
    node = adapt(terminals, tmp_path, GO + RING[len("actions:\n") :])
    act(terminals, "go(c3)")
    node.wait_for("waiting for the action /base; is it started?")
    server = terminals.start(sys.executable, "-u", "-c", SERVER)
    server.wait_for("begun")
    server.process.kill()
    node.wait_for("robot: go(c3): /base went away during the goal")
    node.wait_for("robot: go(c3): failure")
    act(terminals, "ring")
    node.wait_for("waiting for the service /bell; is it started?")
    terminals.start(sys.executable, "-c", BELL)
    node.wait_for("robot: ring: failure")
    assert "robot: ring: /bell: " in node.output
    node.interrupt()
    assert node.wait() == 0
    assert "Traceback" not in node.output
