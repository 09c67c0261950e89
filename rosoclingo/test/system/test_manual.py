"""The manual's example, the launch file, and what can go wrong, as processes.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from roslib.message import get_message_class, get_service_class
from terminals import Terminal, Terminals, package, terminals

__all__ = ["terminals"]

PLAN = [
    "do(arm,pickup(4),1)", "do(arm,putdown(b),2)", "do(arm,pickup(3),3)", "do(arm,putdown(4),4)",
    "do(arm,pickup(2),5)", "do(arm,putdown(3),6)", "do(arm,pickup(1),7)", "do(arm,putdown(c),8)",
    "do(arm,pickup(2),9)", "do(arm,putdown(1),10)", "do(arm,pickup(3),11)",
    "do(arm,putdown(2),12)", "do(arm,pickup(4),13)", "do(arm,putdown(3),14)",
]  # fmt: skip


def controller(terminals: Terminals, mode: str, *options: str) -> Terminal:
    path = mode if "/" in mode else str(package("rosoclingo") / "modes" / f"{mode}.lp")
    return terminals.start(
        "rosrun", "rosclingo", "run.py", "__name:=controller", "-f", path, *options
    )


def planner(terminals: Terminals, *files: str) -> Terminal:
    encodings = [argument for file in files for argument in ("-f", file)]
    return terminals.start("rosrun", "rosclingo", "run.py", "__name:=planner", *encodings)


def blocks() -> list[str]:
    return [str(package("rosoclingo") / "example" / f) for f in ("instance.lp", "itoh.lp")]


def plan(terminals: Terminals) -> list[str]:
    """Listens as the manual does, maybe after the plan was published."""
    message = yaml.safe_load(terminals.latched("/rosoclingo/out"))
    assert message["id"] == "solver"
    return str(message["action"]).strip("[]").split(", ")


# Old clients and bags fit only if these are as they were.
PUBLISHED = {
    "rosoclingo/ROSoClingoIn": "0b40d0b5a778942032d78099d7e20200",
    "rosoclingo/ROSoClingo": "45dd188ea7110dbea9de6b017db2debc",
    "rosoclingo/ROSoClingoOut": "9a51ce6280ae95d37f544ff777ac99c9",
}


def test_md5_sums_of_the_protocol() -> None:
    """Those in docs/protocol.md, section "Messages, services and actions"."""
    root = Path(__file__).resolve().parents[3]
    text = (root / "docs/protocol.md").read_text()
    rows = re.findall(r"^\| `(\w+/\w+)`(?:, an? (\w+))? \| `(\w{32})` \|", text, re.MULTILINE)
    files = [
        file
        for kind in ("action", "msg", "srv")
        for file in root.glob(f"ros*clingo/{kind}/*.{kind}")
    ]
    assert {name for name, _, _ in rows} == {f"{file.parts[-3]}/{file.stem}" for file in files}
    assert PUBLISHED.items() <= {name: md5 for name, _, md5 in rows}.items()
    for name, kind, md5 in rows:
        find = get_service_class if kind == "service" else get_message_class
        defined = find(f"{name}Action" if kind == "action" else name)
        assert defined._md5sum == md5, name


@pytest.mark.install_space
def test_the_manuals_example(terminals: Terminals) -> None:
    controller(terminals, "static.incremental.recording", "-c", "steps=20")
    planner(terminals, *blocks())
    node = terminals.start("rosrun", "rosoclingo", "run.py", "run.py")
    node.wait_for("solver: [do(")
    assert plan(terminals) == PLAN
    assert plan(terminals) == PLAN  # it is latched
    assert node.process.poll() is None
    node.interrupt()
    assert node.wait() == 0


@pytest.mark.install_space
def test_the_same_plan_at_the_desk(terminals: Terminals) -> None:
    planned = terminals.run(
        "rosrun", "rosoclingo", "plan.py", *blocks(), "--mode", "static.incremental.recording"
    )
    assert planned.wait() == 0, planned.output
    _, *steps = planned.output.splitlines()
    actions = [re.fullmatch(r" *(\d+)  arm: (.*)", step) for step in steps]
    assert [f"do(arm,{action[2]},{action[1]})" for action in actions if action] == PLAN


def test_no_plan_within_the_horizon(terminals: Terminals) -> None:
    controller(terminals, "static.incremental.recording", "-c", "steps=10")
    planner(terminals, *blocks())
    node = terminals.start("rosrun", "rosoclingo", "run.py", "run.py")
    assert node.wait() == 1
    assert "no plan within the horizon of 10 steps" in node.output
    assert "Traceback" not in node.output


@pytest.mark.install_space
def test_the_launch_file_in_a_namespace(terminals: Terminals) -> None:
    launch = terminals.start(
        "roslaunch", "rosoclingo", "rosoclingo.launch", "mode:=static.fixed.recording",
        "encoding:=" + " ".join(blocks()), "steps:=14", "ns:=robot1",
    )  # fmt: skip
    assert terminals.latched("/robot1/rosoclingo/out").count("do(arm") == 14
    launch.interrupt()
    launch.wait()


def test_a_wrong_mode_and_required_solvers(terminals: Terminals) -> None:
    """The modes there are get named, and nothing waits for a solver that cannot start."""
    launch = terminals.run(
        "roslaunch", "rosoclingo", "rosoclingo.launch", "mode:=dynamic", "required:=true",
        "encoding:=" + " ".join(blocks()),
    )  # fmt: skip
    names = sorted(path.stem for path in (package("rosoclingo") / "modes").iterdir())
    assert len(names) == 6
    assert f"modes has {', '.join(names)}; give one of these, or the path" in launch.output


def test_a_solver_that_cannot_start(terminals: Terminals, tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.lp"
    wrong.write_text("a b.")
    launch = terminals.start(
        "roslaunch", "rosoclingo", "rosoclingo.launch", "mode:=static.fixed.recording",
        f"encoding:={wrong}",
    )  # fmt: skip
    launch.wait_for(
        "waiting for the solver /planner: no node of that name runs: it was not started"
    )
    assert f"{wrong}:1:3-4: error: syntax error" in launch.output


def test_it_says_what_it_waits_for(terminals: Terminals) -> None:
    """Also if the solvers have other names."""
    node = terminals.start("rosrun", "rosoclingo", "run.py", "_controller:=a", "_planner:=b")
    path = str(package("rosoclingo") / "modes" / "static.fixed.recording.lp")
    for name, arguments in (
        ("a", ["-f", path, "-c", "steps=14"]),
        ("b", [x for f in blocks() for x in ("-f", f)]),
    ):
        node.wait_for(f"waiting for the solver /{name}")
        terminals.start("rosrun", "rosclingo", "run.py", f"__name:={name}", *arguments)
    node.wait_for("solver: [do(")


def test_namespaces_add_up(terminals: Terminals) -> None:
    terminals.environment["ROS_NAMESPACE"] = "robot1"
    listed = terminals.run(
        "roslaunch", "--nodes", "rosoclingo", "rosoclingo.launch", "mode:=static.fixed.recording",
        "encoding:=a.lp", "ns:=robot2",
    )  # fmt: skip
    names = {f"/robot1/robot2/{name}" for name in ("controller", "planner")}
    assert names < set(listed.output.split())


# Sends goals, says when the server has them all, and prints each terminal status with its text.
CLIENT = """
import sys, threading, rospy
from actionlib import CommState
from actionlib_msgs.msg import GoalStatus
from rosclingo.ros.action_client import LowLatencyActionClient
from rosoclingo.msg import ROSoClingoAction, ROSoClingoGoal

rospy.init_node("client")
client = LowLatencyActionClient("rosoclingo", ROSoClingoAction)
client.wait_for_server()
ends, known = [[threading.Event() for _ in range(50)] for _ in range(2)]

def watch(known, end):
    def on_transition(handle):
        known.set()
        if handle.get_comm_state() == CommState.DONE:
            end.set()
    return on_transition

goal = ROSoClingoGoal(sys.argv[1], [])
handles = [client.send_goal(goal, watch(*events)) for events in zip(known, ends)]
for event in known:
    event.wait(30)
print("ready", flush=True)
for end, handle in zip(ends, handles):
    print(end.wait(30) and GoalStatus.to_string(handle.get_terminal_state()),
          handle.get_goal_status_text(), flush=True)
"""


@pytest.mark.parametrize("search", [False, True])
def test_interrupt_with_open_goals(terminals: Terminals, tmp_path: Path, search: bool) -> None:
    """All of them end with the reason, while an action is on its way and in a long search."""
    encoding = package("rosoclingo") / "example" / "line.lp"
    if search:
        encoding = tmp_path / "pigeons.lp"
        encoding.write_text(
            "rslot(1). p(1..12). #program state(t). #external event(1,hard,t)."
            "want(t) :- event(1,hard,t). { at(P,1..11,t) } = 1 :- p(P), want(t)."
            ":- at(P,H,t), at(Q,H,t), P < Q. #program query(t). #external query(t)."
        )
    controller(terminals, "dynamic.incremental.recording", "-c", "steps=20")
    planner(terminals, str(encoding))
    node = terminals.start("rosrun", "rosoclingo", "run.py")
    client = terminals.start("python", "-c", CLIENT, "hard" if search else "visit(3)")
    client.wait_for("ready")
    if search:
        terminals.listen("/planner", "/planner/status").wait_for("status: 1")  # ACTIVE
    else:
        node.wait_for("robot: go(2)")
    node.interrupt()
    assert node.wait() == 0
    client.wait()
    ends = [line for line in client.output.splitlines() if line != "ready"]
    assert ends == ["ABORTED the node is shutting down"] * 50
    assert "Traceback" not in node.output
    assert "FATAL" not in node.output


@pytest.mark.parametrize("gone", ["controller", "planner"])
def test_a_solver_that_goes_away(terminals: Terminals, gone: str) -> None:
    """Although nothing else happens, the open goal ends ABORTED, and so does the node."""
    line = str(package("rosoclingo") / "example" / "line.lp")
    solvers = {
        "controller": controller(terminals, "dynamic.incremental.recording", "-c", "steps=20"),
        "planner": planner(terminals, line),
    }
    node = terminals.start("rosrun", "rosoclingo", "run.py")
    results = terminals.listen("/rosoclingo", "/rosoclingo/result")
    terminals.publish(
        "/rosoclingo/goal", "rosoclingo/ROSoClingoActionGoal",
        "{goal_id: {id: g}, goal: {request: visit(3)}}",
    )  # fmt: skip
    node.wait_for("robot: go(2)")
    solvers[gone].process.kill()
    solvers[gone].wait()
    assert node.wait() == 1
    # Which message it is depends on whether the loop was just talking to it.
    assert f"/{gone}" in node.output
    assert "start that node again, and then rosoclingo" in node.output
    assert "Traceback" not in node.output
    results.wait_for("status: 4")  # ABORTED
    results.wait_for(f"/{gone}")


def test_a_planner_that_does_not_fit(terminals: Terminals, tmp_path: Path) -> None:
    encoding = tmp_path / "encoding.lp"
    encoding.write_text("do(arm,wave,1).")
    controller(terminals, "static.incremental.recording", "-c", "steps=3")
    planner(terminals, str(encoding))
    node = terminals.start("rosrun", "rosoclingo", "run.py")
    assert node.wait() == 1
    assert "query(0)" in node.output


def test_interrupt_while_waiting(terminals: Terminals) -> None:
    node = terminals.start("rosrun", "rosoclingo", "run.py")
    node.wait_for("waiting for the solver /controller")
    node.interrupt()
    assert node.wait() == 0


def test_usage(terminals: Terminals) -> None:
    for script in ("run.py", "run-1.0.py"):
        asked = terminals.run("rosrun", "rosoclingo", script, "--help")
        assert asked.wait() == 0
        assert asked.output.startswith(f"usage: {script}")


@pytest.mark.parametrize("script", ["run.py", "run-1.0.py"])
def test_commands_that_need_numpy(script: str, tmp_path: Path) -> None:
    """A user's ``commands.py`` may import what it likes."""
    nodes = Path(__file__).resolve().parents[2] / "nodes"
    shutil.copy(nodes / script, tmp_path)
    commands = (nodes / "commands.py").read_text()
    (tmp_path / "commands.py").write_text(
        commands.replace("from rosoclingo", "import numpy\nnumpy.zeros(1)\nfrom rosoclingo", 1)
    )
    asked = [sys.executable, str(tmp_path / script), "--help"]
    assert f"usage: {script}" in subprocess.check_output(asked, text=True)
