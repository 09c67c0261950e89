"""A planner runs out of memory: the goal that asked for too much ends, and no other.

``MEMORY_LIMITS=20`` tries as many limits, from 20 to 500 MB above the start; by default, two.
Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import os
import re
import resource
from pathlib import Path

import pytest
from terminals import Terminals, terminals, wait_for

pytestmark = pytest.mark.costly

__all__ = ["terminals"]

ENCODING = Path(__file__).resolve().parents[1] / "encodings" / "large_step.lp"
COUNT = int(os.environ.get("MEMORY_LIMITS", "2"))
LIMITS = [20 + 480 * number // max(COUNT - 1, 1) for number in range(COUNT)]  # MB

# Two robots, of which r2 acts until there is a file.
ROBOTS = """
import os
import sys

from rosoclingo_interfaces.interface import ActionInterface
from rosoclingo_interfaces.node import run

class Robots(ActionInterface):
    actuators = ("r1", "r2")

    def go(self, cell: str) -> bool:
        print("does", self.actuator, cell, flush=True)
        while self.actuator == "r2" and not os.path.exists(sys.argv[1]):
            self.sleep(0.05)
        return True

run(Robots, "robots")
"""

# A client that sends a goal, and prints how it has ended.
CLIENT = """
import sys

import rospy
from actionlib import SimpleActionClient
from actionlib_msgs.msg import GoalStatus
from rosoclingo.msg import ROSoClingoAction, ROSoClingoGoal

rospy.init_node("client", anonymous=True)
client = SimpleActionClient("rosoclingo", ROSoClingoAction)
client.wait_for_server()
client.send_goal(ROSoClingoGoal(sys.argv[1], []))
client.wait_for_result()
print("end", GoalStatus.to_string(client.get_state()), client.get_goal_status_text(), flush=True)
"""


def limit(process: int, megabytes: int) -> None:
    """Limits the memory of a process to so much above what it has."""
    status = Path(f"/proc/{process}/status").read_text()
    has = next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmSize"))
    most = has * 1024 + megabytes * 2**20
    resource.prlimit(process, resource.RLIMIT_AS, (most, most))


def pid(terminals: Terminals, node: str) -> int:
    """Returns the process of a node; 0 if there is none that answers."""
    try:
        return terminals.pid(f"/{node}")
    except OSError:
        return 0


@pytest.mark.parametrize("megabytes", LIMITS)
@pytest.mark.parametrize("form", ["rosoclingo", "single"])
def test_only_the_goal_that_asks_for_too_much_ends(
    terminals: Terminals, tmp_path: Path, form: str, megabytes: int
) -> None:
    """Another one goes on that its robot is busy with, and the next one is done.

    A planner without memory for the connection of the client ends, too, and so does one that looked
    ahead to longer plans, on a busy machine; the next one has no limit, and finds the plan.
    """
    go_on = tmp_path / "go on"
    has_three = form == "rosoclingo"
    mode = ("mode:=dynamic.incremental.dyn_reset", "steps:=30") if has_three else ()
    planner = "planner" if has_three else "rosoclingo"
    launch = terminals.start(
        "roslaunch", "rosoclingo", f"{form}.launch", f"encoding:={ENCODING}",
        f"store:={tmp_path / 'my run.store'}", *mode,
    )  # fmt: skip
    robots = terminals.start("python", "-c", ROBOTS, str(go_on))
    other = terminals.start("python", "-c", CLIENT, "visit(r2,2)")
    robots.wait_for("does r2 2")
    process = terminals.pid(f"/{planner}")
    limit(process, megabytes)
    large = terminals.start("python", "-c", CLIENT, "visit(r1,4)")
    wait_for(lambda: "end" in large.output or pid(terminals, planner) not in (process, 0))
    assert other.process.poll() is None, other.output
    go_on.touch()
    large.wait_for("end")
    other.wait_for("end SUCCEEDED")
    out_of_memory = re.search(r"end (REJECTED|ABORTED) .*out of memory", large.output)
    print(form, megabytes, large.output.splitlines()[-1])
    if out_of_memory is None:
        other_cause = "not enough memory to start a thread|No goal has asked for that"
        assert re.search(other_cause, launch.output)
        assert "end SUCCEEDED" in large.output
    terminals.start("python", "-c", CLIENT, "visit(r1,2)").wait_for("end SUCCEEDED")
    assert robots.output.count("does r2 2") == 1
    wait_for(lambda: pid(terminals, planner) not in (process, 0))
