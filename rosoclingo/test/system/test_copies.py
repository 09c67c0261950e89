"""An interface by the letter of docs/protocol.md repeats its answers, without a warning.

Needs a sourced workspace.
"""

from __future__ import annotations

import os
import re
import signal
import sys
from pathlib import Path

import pytest
from terminals import Terminals, package, terminals, wait_for

__all__ = ["terminals"]

NODE = "/rosoclingo"
MODE = "dynamic.incremental.dyn_reset"

# Answers every action at once, once without its token, and again and again with it, until the state
# of the action is ANSWERED or its actuator is told something else.
ROBOT = """
import rospy
from rosoclingo.msg import ROSoClingoAnswer, ROSoClingoDispatch, ROSoClingoIn, ROSoClingoToken

answers = {}

def on_dispatch(message):
    for one in message.actions:
        for other in [other for other in answers if other < one.number]:
            del answers[other]
            print(f"over {other}")
        if one.state == ROSoClingoToken.ANSWERED:
            if answers.pop(one.number, None):
                print(f"confirmed {one.number}")
        elif one.number not in answers:
            answers[one.number] = ROSoClingoAnswer(message.run, one.number, "success")
            plain.publish("robot", "success")

rospy.init_node("robot")
tokens = rospy.Publisher("/rosoclingo/answer", ROSoClingoAnswer, queue_size=10)
plain = rospy.Publisher("/rosoclingo/in", ROSoClingoIn, queue_size=10)
rospy.Subscriber("/rosoclingo/dispatch", ROSoClingoDispatch, on_dispatch)
while not rospy.is_shutdown():
    for answer in list(answers.values()):
        tokens.publish(answer)
    rospy.rostime.wallsleep(0.02)
"""


@pytest.mark.costly
@pytest.mark.parametrize("nodes", [1, 3])
def test_no_copy_is_warned_of(terminals: Terminals, tmp_path: Path, nodes: int) -> None:
    """Also while the next action is held, and after a crash."""
    file = tmp_path / "robot.py"
    file.write_text(ROBOT)
    line = str(package("rosoclingo") / "example" / "line.lp")
    mode = str(package("rosoclingo") / "modes" / f"{MODE}.lp")
    loop = ["rosrun", "rosoclingo", "run-1.0.py", "-f", line]
    if nodes == 3:
        loop = ["rosrun", "rosoclingo", "run.py"]
        terminals.start("rosrun", "rosclingo", "run.py", "__name:=planner", "-f", line)
        constants = ("-c", "steps=30")
        terminals.start(
            "rosrun", "rosclingo", "run.py", "__name:=controller", "-f", mode, *constants
        )
    loop += [f"_store:={tmp_path}/run.store", "_ask_before:=go(4)"]
    before = terminals.start(*loop)
    robot = terminals.start(sys.executable, str(file))
    terminals.publish(
        f"{NODE}/goal", "rosoclingo/ROSoClingoActionGoal",
        "{goal_id: {id: visit}, goal: {request: visit(6)}}",
    )  # fmt: skip
    robot.wait_for("confirmed 2")
    os.kill(terminals.pid(NODE), signal.SIGKILL)
    before.wait()
    after = terminals.start(*loop)
    after.wait_for("goes on with the run")
    journal = terminals.listen(NODE, f"{NODE}/journal")  # its history has all events
    results = terminals.listen(NODE, f"{NODE}/result")
    approve = ("rosservice", "call", f"{NODE}/approve", "{actuator: robot, action: go(4)}")
    wait_for(lambda: "success: True" in terminals.run(*approve).output)
    wait_for(lambda: "succeeded" in results.output, lambda: after.output)
    wait_for(
        lambda: re.search(r"confirmed \d+\s*$", robot.output) is not None, lambda: robot.output
    )
    assert "dropped" not in before.output + after.output + journal.output
