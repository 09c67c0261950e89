"""Clients, interfaces, types and bags of ROSoClingo 1.0 and 2.0, on nodes of today.

docs/compatibility.md says what of them runs unmodified. Needs a sourced workspace.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import roslib
import yaml
from actionlib import CommState
from actionlib.action_client import CommStateMachine
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from readmes import ROOT, rows
from rospkg import ResourceNotFound
from terminals import Terminal, Terminals, package, terminals, wait_for
from topics import Listener

from rosoclingo.msg import ROSoClingoActionGoal, ROSoClingoGoal

__all__ = ["terminals"]

OLD = Path(__file__).resolve().parents[1] / "old"  # what 2to3 makes of it ends in .py3
BAG = ROOT / "test" / "bags" / "line_single_2.0.bag"
IN_BAG = {"about", "cancel", "feedback", "goal", "in", "journal", "out", "plan", "result", "status"}


def robot_on_a_line(terminals: Terminals, dialect: str, *options: str) -> Terminal:
    line = package("rosoclingo") / "example" / f"line_{dialect}.lp"
    return terminals.start("rosrun", "rosoclingo", "run-1.0.py", "--file", str(line), *options)


def say(terminals: Terminals, value: str, node: str = "ROSoClingo") -> None:
    message = f"{{id: {'robot' if value == 'success' else 'info'}, value: {value}}}"
    terminals.publish(f"/{node}/in", "rosoclingo/ROSoClingoIn", message)


def ask(terminals: Terminals, request: str, node: str) -> None:
    goal = f"{{goal_id: {{id: '{request}'}}, goal: {{request: {request}}}}}"
    terminals.publish(f"/{node}/goal", "rosoclingo/ROSoClingoActionGoal", goal)


def play(terminals: Terminals, *topics: str, heard: bool = True) -> None:
    """Plays topics of a recorded run to a node of another name, when somebody listens to each."""
    recorded = [f"/rosoclingo/{topic}" for topic in topics]
    mapped = [f"/rosoclingo/{topic}:=/ROSoClingo/{topic}" for topic in topics]
    options = ["--wait-for-subscribers"] if heard else []
    played = terminals.run("rosbag", "play", *options, str(BAG), "--topics", *recorded, *mapped)
    assert played.wait() == 0, played.output


def inputs(journal: Listener) -> list[str]:
    """Returns what the planning loop was told, in order."""
    events = [event for event in yaml.safe_load_all(journal.output) if event]
    told = [event for event in events if event["kind"] in ("goal", "cancel", "message", "dropped")]
    return [f"{event['kind']} {event['text']}" for event in told]


def count(terminal: Terminal, text: str) -> int:
    return terminal.output.count(text)


@pytest.mark.costly
def test_programs_and_bags_onto_a_node_with_the_papers_name(terminals: Terminals) -> None:
    """The client and the interface are what 2to3 makes of such in Python 2."""
    node = robot_on_a_line(terminals, "1.0", "__name:=ROSoClingo")
    client = terminals.start("python", str(OLD / "client.py3"), "3", "5")
    client.wait_for("cancel: 5")
    node.wait_for("robot: go(2)")
    interface = terminals.start("python", str(OLD / "interface.py3"))  # late: out is latched
    assert client.wait() == 0, client.output
    assert client.output.splitlines() == [
        "send: visit(3)", "send: visit(5)", "cancel: 5", "3 succeeded", "5 canceled"
    ]  # fmt: skip
    done = [line for line in interface.output.splitlines() if "action " in line]
    assert "information: to 3" in interface.output
    assert done == ["action 1 of robot: go(2)", "action 2 of robot: go(3)"]

    journal = terminals.listen("/ROSoClingo", "/ROSoClingo/journal")
    wait_for(lambda: len(inputs(journal)) == 5)  # goals, a cancel request, answers
    told = inputs(journal)
    effects = {
        name: effect
        for names, effect in rows("docs/bags.md", "rosbag play")
        if "of the solvers" not in names
        for name in re.findall(r"`~(\w+)`", names)
    }
    safe = {topic for topic in IN_BAG if effects[topic] == "safe"}
    assert safe >= {"about", "journal", "plan"}
    play(terminals, *sorted(safe), heard=False)
    say(terminals, "open(1)")
    journal.wait_for("open(1)")
    assert inputs(journal) == [*told, "message open(1)"]
    assert (count(node, "robot: go("), count(interface, "action ")) == (2, 2)

    assert effects["out"].startswith("not safe")
    play(terminals, "out")
    wait_for(lambda: count(interface, "action ") > 2)  # it does what nobody has planned
    assert count(node, "robot: go(") == 2

    assert effects["goal"].startswith("requests")
    results = terminals.listen("/ROSoClingo", "/ROSoClingo/result")
    play(terminals, "goal", "cancel")
    for goal in ("g1", "g2", "g3"):
        results.wait_for(f'id: "{goal}"')
    assert count(node, "robot: go(") > 2
    ask(terminals, "visit(2)", "ROSoClingo")
    results.wait_for('id: "visit(2)"')
    interface.interrupt()
    interface.wait()

    assert effects["in"].startswith("not safe")
    acted = count(node, "robot: go(")
    ask(terminals, "visit(4)", "ROSoClingo")
    wait_for(lambda: count(node, "robot: go(") == acted + 1)
    play(terminals, "in")
    wait_for(lambda: count(node, "robot: go(") > acted + 1)


# Publishes a request in a type without the field "information", and the type's MD5 sum.
OTHER_TYPE = """
import rospy
from genpy.dynamic import generate_dynamic
from rosoclingo.msg import ROSoClingoActionGoal

name = "rosoclingo/ROSoClingoActionGoal"
text = ROSoClingoActionGoal._full_text.replace("string[] information", "")
other = generate_dynamic(name, text)[name]
message = other()
message.goal_id.id = "other"
message.goal.request = "visit(3)"
rospy.init_node("other")
publisher = rospy.Publisher("/rosoclingo/goal", other, latch=True)
publisher.publish(message)
print(other._md5sum, flush=True)
rospy.spin()
"""


def test_what_comes_in_the_wrong_type_or_too_early(terminals: Terminals) -> None:
    """A type of another MD5 sum is not heard; the last answer of an old interface is no answer."""
    say(terminals, "success", "rosoclingo")  # latched, as old interfaces do
    other = terminals.start("python", "-c", OTHER_TYPE)
    node = robot_on_a_line(terminals, "paper")
    other.wait_for("wants topic [/rosoclingo/goal] to have datatype/md5sum")
    (found,) = [cells for cells in rows("docs/compatibility.md", "Types") if len(cells) == 4]
    assert found[2].strip("`") in other.output.splitlines()
    journal = terminals.listen("/rosoclingo", "/rosoclingo/journal")
    journal.wait_for('text: "success"')
    ask(terminals, "visit(3)", "rosoclingo")
    node.wait_for("robot: go(2)")
    say(terminals, "open(1)", "rosoclingo")
    journal.wait_for("open(1)")
    assert inputs(journal) == ["message success", "goal visit(3)", "message open(1)"]
    assert "go(3)" not in node.output
    with pytest.raises(TypeError, match=r"args should be \['request', 'information'\]"):
        ROSoClingoGoal("visit(3)")
    with pytest.raises(ResourceNotFound):
        roslib.load_manifest("a_package_of_then")


def test_a_goal_that_a_played_status_list_lacks() -> None:
    """To a client it is lost, though it goes on."""
    goal = ROSoClingoActionGoal()
    goal.goal_id.id = "mine"
    machine = CommStateMachine(goal, None, None, None, None)
    mine = GoalStatus(goal_id=goal.goal_id, status=GoalStatus.ACTIVE)
    machine.update_status(GoalStatusArray(status_list=[mine]))
    assert machine.state == CommState.ACTIVE
    played = GoalStatus(goal_id=GoalID(id="g1"), status=GoalStatus.ACTIVE)
    machine.update_status(GoalStatusArray(status_list=[played]))
    assert machine.state == CommState.DONE
    assert machine.latest_goal_status.status == GoalStatus.LOST


def test_a_client_of_the_solver(terminals: Terminals) -> None:
    """It writes its XML as the manual does, and is what 2to3 makes of Python 2."""
    terminals.start("rosrun", "rosclingo", "run.py", "__name:=solver")
    names = ("/rosclingo/control:=/solver/control", "rosclingo:=solver")
    client = terminals.run("python", str(OLD / "solver_client.py3"), *names)
    assert client.wait() == 0, client.output
    # actionlib says so if the solver answers before send_goal has returned, and waits for the rest.
    early = "Got a transition callback on a goal handle that we're not tracking"
    assert [line for line in client.output.splitlines() if not line.endswith(early)] == [
        "success: True", "on(1) true", "on(2) false", "stats: True", "result: sat",
        "interrupted: False", "answerset: ['lit(1)']",
    ]  # fmt: skip


def test_names_before_a_node_begins(terminals: Terminals) -> None:
    """Old programs open their topics before they call ``init_node``."""
    opened = "import rospy, std_msgs.msg as m; print(rospy.Publisher('/a', m.Empty).resolved_name)"
    ended = terminals.run("python", "-W", "ignore", "-c", opened, "/a:=/b")
    assert ended.output.splitlines() == ["/b"]
