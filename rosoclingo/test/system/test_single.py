"""The one-node system as a process: its command line, its end, and what can go wrong.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml
from terminals import Terminals, package, terminals, wait_for
from topics import Listener

__all__ = ["terminals"]


def line(dialect: str = "") -> str:
    return str(package("rosoclingo") / "example" / f"line{dialect}.lp")


def listen(terminals: Terminals) -> Listener:
    """Listens to the results, as soon as there is a node that sends any."""
    return terminals.listen("/rosoclingo", "/rosoclingo/result")


def ask(terminals: Terminals, request: str, name: str = "g") -> None:
    """Sends a goal as an old client may do, by the topic."""
    wait_for(lambda: "/rosoclingo/goal" in terminals.names())
    terminals.publish(
        "/rosoclingo/goal", "rosoclingo/ROSoClingoActionGoal",
        f"{{goal_id: {{id: {name}}}, goal: {{request: '{request}'}}}}",
    )  # fmt: skip


@pytest.mark.install_space
def test_files_without_their_ending(terminals: Terminals) -> None:
    """And what the encoding in them believes when an action fails, which is published and told."""
    office = package("rosoclingo_aspprograms") / "mailbot"
    node = terminals.start(
        "rosrun", "rosoclingo", "run-1.0.py", "--file", str(office / "instances" / "graph_wg"),
        "--file", str(office / "mailbot_causes"), "-c", "slots=1", "_why_nice:=0",
    )  # fmt: skip
    node.wait_for("in the dialect 2.0; clingo options: -c slots=1")
    ask(terminals, "bring(o1,o3)")
    node.wait_for("mailbot: go(c1)")
    beliefs = terminals.listen("/rosoclingo", "/rosoclingo/beliefs")
    terminals.publish("/rosoclingo/in", "rosoclingo/ROSoClingoIn", "{id: mailbot, value: failure}")
    beliefs.wait_for("---")
    late = terminals.listen("/rosoclingo", "/rosoclingo/beliefs")
    late.wait_for("---")
    (first, _) = late.output.split("---")
    assert beliefs.output.startswith(first)  # where nothing was published before
    (said, *_) = yaml.safe_load_all(first)
    best, second, *_ = said["explanations"]
    assert (best["causes"], second["causes"]) == (["passing(c1,open1,1)"], ["blocked(c1,open1,1)"])
    assert 0 < best["weight"] < second["weight"]
    (passing,) = [one for one in said["causes"] if one["cause"] == "passing(c1,open1,1)"]
    assert (passing["believed"], passing["certain"]) == (True, True)
    assert passing["since"]["secs"] > 0
    assert passing["speaks_for"] == ["observes(drive(mailbot,open1,c1),failure,1)"]
    asked = terminals.start("rosrun", "rosoclingo", "why.py", "--happened", "go(c1)")
    assert asked.wait(600.0) == 0, asked.output
    assert (
        "go(c1) of mailbot failed in step 1, probably because something was in the way between c1 "
        "and open1 for a moment; nearly as likely is that something stands between c1 and open1"
    ) in " ".join(asked.output.split())
    node.interrupt()
    assert node.wait() == 0
    assert "Traceback" not in node.output


@pytest.mark.costly
@pytest.mark.parametrize("script", ["run-1.0.py", "run.py"])
def test_the_names_of_the_paper(terminals: Terminals, script: str) -> None:
    arguments = ["--file", line("_paper")] if script == "run-1.0.py" else []
    if not arguments:
        mode = package("rosoclingo") / "modes" / "dynamic.incremental.recording.lp"
        for name, file in (("controller", str(mode)), ("planner", line())):
            terminals.start("rosrun", "rosclingo", "run.py", f"__name:={name}", "-f", file)
    node = terminals.start("rosrun", "rosoclingo", script, *arguments, "__name:=ROSoClingo")
    client = terminals.start("python", "-c", CLIENT, "rosoclingo:=ROSoClingo")
    node.wait_for("robot: go(2)")
    heard = terminals.latched("/ROSoClingo/out")
    assert 'id: "robot"' in heard
    assert 'action: "go(2)"' in heard
    terminals.publish("/ROSoClingo/in", "rosoclingo/ROSoClingoIn", "{id: robot, value: success}")
    client.wait_for("SUCCEEDED")


# A client that knows nothing of the other name.
CLIENT = """
import rospy
from actionlib import ActionClient, CommState
from actionlib_msgs.msg import GoalStatus
from rosoclingo.msg import ROSoClingoAction, ROSoClingoGoal

rospy.init_node("client")
client = ActionClient("rosoclingo", ROSoClingoAction)
client.wait_for_server()
goal = client.send_goal(ROSoClingoGoal("visit(2)", []))
while goal.get_comm_state() != CommState.DONE:
    rospy.sleep(0.05)
print(GoalStatus.to_string(goal.get_terminal_state()), flush=True)
"""


@pytest.mark.costly
@pytest.mark.parametrize("options", [[], ["-c", "steps=3"]])
def test_a_goal_that_cannot_be_reached(terminals: Terminals, options: list[str]) -> None:
    """It is searched for until the node is told to end, or up to the last step."""
    node = terminals.start(
        "rosrun", "rosoclingo", "run-1.0.py", "-f", line("_paper"), "-c", "cells=900", *options
    )
    results = listen(terminals)
    plans = terminals.listen("/rosoclingo", "/rosoclingo/plan")
    ask(terminals, "visit(900)")
    if not options:
        wait_for(lambda: re.search(r"^horizon: ([2-9]|\d\d)", plans.output, re.M) is not None)
        node.interrupt()
    assert node.wait() == (1 if options else 0)
    assert "Traceback" not in node.output
    results.wait_for("status: 4")  # ABORTED
    assert not options or "no plan within the horizon of 3 steps" in node.output


@pytest.mark.costly
def test_only_the_goal_that_cannot_be_reached_ends(terminals: Terminals) -> None:
    system = terminals.start(
        "roslaunch", "rosoclingo", "single.launch", f"encoding:={line()}",
        "abort_unreachable:=true", "options:=-c steps=4",
    )  # fmt: skip
    terminals.start("rosrun", "rosoclingo_interfaces", "fulfill.py")
    results = listen(terminals)
    ask(terminals, "visit(6)", "far")
    results.wait_for('id: "far"\n  status: 4')  # ABORTED
    assert "no plan within the horizon of 4 steps for visit(6)" in results.output
    ask(terminals, "visit(3)", "near")
    results.wait_for('id: "near"\n  status: 3')  # SUCCEEDED
    for word in ("died", "FATAL", "Traceback"):
        assert word not in system.output


@pytest.mark.costly
@pytest.mark.parametrize(
    "started", [["single.launch"], ["rosoclingo.launch", "mode:=dynamic.incremental.recording"]]
)
def test_the_argument_of_seed_planners_is_accepted(
    terminals: Terminals, started: list[str]
) -> None:
    system = terminals.start(
        "roslaunch", "rosoclingo", *started, f"encoding:={line()}", "seed_planner:=lama"
    )
    system.wait_for("~seed_planner has no effect any more")
    system.interrupt()
    assert system.wait() == 0
    assert system.output.count("~seed_planner") == 1


@pytest.mark.costly
def test_a_wrong_command_line(terminals: Terminals, tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.lp"
    wrong.write_text("#external query(t")
    for arguments, text in (
        (["--file", "nowhere.lp"], "there is no file 'nowhere.lp'"),
        (["--file", str(wrong)], "wrong.lp:2:1"),
        (["--file", str(package("rosclingo") / "example" / "toh.lp")], "toh.lp: there is no enc"),
        (["--file", line(), "-c", "steps=many"], "steps is a number from 1 on"),
        (["--file", line(), "--no-such-option"], "no-such-option"),
        ([], "no file: there is no encoding"),
        (["--file", line(), "_slow_seconds:=-1"], "slow_seconds: expected seconds from 0: -1"),
        (["--file", line(), "_abort_unreachable:=7"], "abort_unreachable: expected true or false"),
        (["--file", line(), "_action_timeout:=soon"], "action_timeout: expected seconds"),
    ):
        node = terminals.run("rosrun", "rosoclingo", "run-1.0.py", *arguments)
        assert node.wait() == 2, node.output
        assert text in node.output
        assert "Traceback" not in node.output


# The node, with a bug: it fails at a goal that is in the inbox already.
FAILING = """
import runpy
import sys

from rosclingo.ros.local_master import executable
from rosoclingo.loop.inputs.inbox import Inbox

put = Inbox.put

def fail(inbox, *items):
    put(inbox, *items)
    if any(getattr(item, "request", "") == "visit(3)" for item in items):
        raise ValueError("a bug")

Inbox.put = fail
sys.argv[0] = executable("rosoclingo", "run-1.0.py")
runpy.run_path(sys.argv[0], run_name="__main__")
"""

ASKS = """
import sys

import rospy
from actionlib import GoalStatus, SimpleActionClient
from rosoclingo.msg import ROSoClingoAction, ROSoClingoGoal

rospy.init_node("asks")
client = SimpleActionClient("rosoclingo", ROSoClingoAction)
client.wait_for_server()
for request in sys.argv[1:]:
    client.send_goal_and_wait(ROSoClingoGoal(request, []))
    state, text = GoalStatus.to_string(client.get_state()), client.get_goal_status_text()
    print(request, state, client.get_result().result, text, flush=True)
"""


@pytest.mark.costly
def test_a_goal_at_which_the_node_fails_is_rejected_with_the_error(terminals: Terminals) -> None:
    """Also for the loop, which has it in its inbox: the robot does nothing for it."""
    file = line("_1.0")
    node = terminals.start("python", "-c", FAILING, "-f", file, "__name:=rosoclingo")
    client = terminals.run("python", "-c", ASKS, "visit(3)", "visit(1)")
    assert client.wait() == 0, client.output
    assert "visit(3) REJECTED rejected internal error: ValueError('a bug')" in client.output
    assert "visit(1) SUCCEEDED succeeded" in client.output
    assert "robot: go(" not in node.output, node.output
