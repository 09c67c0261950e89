"""rosoclingo is killed, and another one goes on with what is in the store.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest
from terminals import Terminal, Terminals, package, terminals, wait_for

__all__ = ["terminals"]

# A stock client, which also counts what it is told of its goals.
CLIENT = """
import sys
import threading

import rospy
from actionlib import SimpleActionClient
from actionlib_msgs.msg import GoalStatus
from rosoclingo.msg import ROSoClingoAction, ROSoClingoActionResult, ROSoClingoGoal

heard = set()
both_are_heard = threading.Event()

def on_result(message):
    heard.add(message.status.goal_id.id)
    print("result", GoalStatus.to_string(message.status.status), flush=True)
    if len(heard) == 2:
        both_are_heard.set()

rospy.init_node("client")
rospy.Subscriber("rosoclingo/result", ROSoClingoActionResult, on_result)
client = SimpleActionClient("rosoclingo", ROSoClingoAction)
client.wait_for_server()
client.send_goal(ROSoClingoGoal(sys.argv[1], ["of the client"]))
client.wait_for_result()
print("end", GoalStatus.to_string(client.get_state()), flush=True)
# Another goal, which is reached already: what was sent of the first one comes before its result.
client.send_goal(ROSoClingoGoal(sys.argv[1], []))
if not both_are_heard.wait(60.0):
    sys.exit("the second goal has no result")
"""

# A robot that takes so many seconds for an action.
ROBOT = """
import sys

from rosoclingo_interfaces.interface import ActionInterface
from rosoclingo_interfaces.node import run

class Robot(ActionInterface):
    actuators = ("robot",)

    def go(self, cell: str) -> bool:
        print("does", cell, flush=True)
        self.sleep(float(sys.argv[1]))
        return True

run(Robot, "robot")
"""


def system(terminals: Terminals, store: Path, form: str) -> Terminal:
    file = package("rosoclingo") / "example" / "line.lp"
    mode = ["mode:=dynamic.incremental.dyn_reset", "steps:=30"] if form == "rosoclingo" else []
    return terminals.start(
        "roslaunch", "rosoclingo", f"{form}.launch", f"encoding:={file}", f"store:={store}", *mode
    )


def test_solvers_are_killed(terminals: Terminals, tmp_path: Path) -> None:
    launch = system(terminals, tmp_path / "a.store", "rosoclingo")
    robot = terminals.start("python", "-c", ROBOT, "0.3")
    client = terminals.start("python", "-c", CLIENT, "visit(4)")
    for cell, solver in ((2, "planner"), (3, "controller")):
        robot.wait_for(f"does {cell}")
        os.kill(terminals.pid(f"/{solver}"), signal.SIGKILL)
    client.wait_for("end SUCCEEDED")
    assert "waits for the node to be started again" in launch.output
    assert "[rosoclingo-3] process has died" not in launch.output


@pytest.mark.parametrize("form", ["rosoclingo", "single"])
def test_a_client_waits_through_kills(terminals: Terminals, tmp_path: Path, form: str) -> None:
    launch = system(terminals, tmp_path / "a.store", form)
    robot = terminals.start("python", "-c", ROBOT, "0.3")
    client = terminals.start("python", "-c", CLIENT, "visit(5)")
    for cell in (2, 4):
        robot.wait_for(f"does {cell}")
        node = terminals.pid("/rosoclingo")
        os.kill(node, signal.SIGKILL)
        wait_for(lambda killed=node: terminals.names() and _pid(terminals) not in (killed, 0))
    client.wait_for("end SUCCEEDED")
    assert client.wait() == 0
    assert client.output.count("result") == 2  # one for each goal
    assert [line for line in robot.output.splitlines() if line.startswith("does")] == [
        f"does {cell}" for cell in (2, 3, 4, 5)
    ]
    assert "Traceback" not in launch.output


def _pid(terminals: Terminals) -> int:
    try:
        return terminals.pid("/rosoclingo")
    except OSError:
        return 0


def test_another_master(terminals: Terminals, tmp_path: Path) -> None:
    """All nodes notice, are started again, and go on."""
    launch = system(terminals, tmp_path / "a.store", "rosoclingo")
    robot = terminals.start("python", "-c", ROBOT, "60")
    terminals.start("python", "-c", CLIENT, "visit(3)")
    robot.wait_for("does 2")
    terminals.restart_master()
    assert robot.wait() == 3
    assert "does not know /robot any more" in robot.output
    launch.wait_for("goes on with the run in the store")
    echo = terminals.listen("/rosoclingo", "/rosoclingo/result")
    terminals.start("python", "-c", ROBOT, "0.1")
    echo.wait_for("succeeded")
    assert "Traceback" not in launch.output
