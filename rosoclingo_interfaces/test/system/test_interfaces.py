"""Interfaces with the whole system, as processes.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Sequence

import pytest
from terminals import Terminal, Terminals, package, terminals, wait_for

__all__ = ["terminals"]

LINE = Path(__file__).resolve().parents[3] / "rosoclingo" / "example" / "line.lp"


@pytest.fixture
def node(terminals: Terminals) -> Terminal:
    """Starts the system with a small encoding: the actuator robot visits cells."""
    return start_system(terminals)


def start_system(terminals: Terminals, *more: str, parameters: Sequence[str] = ()) -> Terminal:
    """Starts the system with this encoding and more files."""
    start_solvers(terminals, *more)
    started = terminals.start("rosrun", "rosoclingo", "run.py", *parameters)
    wait_for(lambda: "/rosoclingo/goal" in terminals.names())
    return started


def start_solvers(terminals: Terminals, *more: str) -> None:
    """Starts controller and planner."""
    mode = package("rosoclingo") / "modes" / "dynamic.incremental.dyn_reset.lp"
    for name, files in (("controller", [str(mode)]), ("planner", [str(LINE), *more])):
        encodings = [argument for file in files for argument in ("-f", file)]
        terminals.start("rosrun", "rosclingo", "run.py", f"__name:={name}", *encodings)


def visit(terminals: Terminals, cell: int) -> None:
    terminals.publish(
        "/rosoclingo/goal", "rosoclingo/ROSoClingoActionGoal",
        f"{{goal_id: {{id: visit{cell}}}, goal: {{request: visit({cell})}}}}",
    )  # fmt: skip


def fulfill(terminals: Terminals, *parameters: str) -> Terminal:
    return terminals.start("rosrun", "rosoclingo_interfaces", "fulfill.py", *parameters)


def un_block(terminals: Terminals, *lines: str) -> Terminal:
    return terminals.start(
        "bash", "-c", 'exec rosrun rosoclingo_interfaces un_block.py < <(printf "%s\n" "$@")',
        "bash", *lines,
    )  # fmt: skip


@pytest.mark.costly
def test_an_interface_that_starts_late(terminals: Terminals, node: Terminal) -> None:
    """What was published before is still to be done; so it is when the interface starts again."""
    results = terminals.listen("/rosoclingo", "/rosoclingo/result")
    visit(terminals, 4)
    node.wait_for("robot: go(2)")

    first = fulfill(terminals, "_no_answer:=go", "_actuators:=robot")
    first.wait_for("robot: go(2) is not answered")
    first.interrupt()
    assert first.wait() == 0
    assert "parameter /fulfill/no_answer is go" in first.output
    assert "success" not in first.output

    # Under another name, because the parameters of the first are still there.
    second = fulfill(terminals, "__name:=second")
    second.wait_for("robot: go(4): success")
    results.wait_for('result: "succeeded"')
    second.interrupt()
    assert second.wait() == 0

    # The last action is done, which this one is told.
    third = fulfill(terminals, "__name:=second")
    third.wait_for("does the actions of all actuators")

    # It says what it does, and the planner which files it has; nobody here sends announcements.
    check = terminals.start(
        "rosrun", "rosoclingo", "check.py", str(LINE), "--episodes", "0", "--live"
    )
    assert check.wait() == 1, check.output
    assert [line for line in check.output.splitlines() if line.startswith("live: ")] == [
        "live: no node says that it sends the messages of info"
    ]
    visit(terminals, 1)
    third.wait_for("robot: go(1): success")
    assert "go(4)" not in third.output
    wait_for(lambda: results.output.count('result: "succeeded"') == 2)
    assert "Traceback" not in node.output


def test_check_live_without_an_address_of_a_master(terminals: Terminals) -> None:
    terminals.environment["ROS_MASTER_URI"] = "nowhere"
    check = terminals.start(
        "rosrun", "rosoclingo", "check.py", str(LINE), "--episodes", "0", "--live"
    )
    assert check.wait() == 2
    assert "--live: the address of the ROS master, ROS_MASTER_URI, is wrong" in check.output
    assert "Traceback" not in check.output


@pytest.mark.install_space
def test_the_launch_file(terminals: Terminals, node: Terminal) -> None:
    launch = terminals.start(
        "roslaunch", "rosoclingo_interfaces", "mailbot_interfaces.launch", "actuator:=robot",
        "navigation:=fulfill", "go_delay:=0.1",
    )  # fmt: skip
    results = terminals.listen("/rosoclingo", "/rosoclingo/result")
    visit(terminals, 3)
    results.wait_for('result: "succeeded"')
    launch.wait_for("robot: go(3): success")


@pytest.mark.costly
def test_a_clock_that_an_earlier_launch_left_behind(terminals: Terminals) -> None:
    """It says what to type, which helps; and a rosoclingo that starts again finds its solvers."""
    terminals.master.setParam("/test", "/use_sim_time", True)
    start_solvers(terminals)
    interface = fulfill(terminals, "_delay:=0.1")
    results = terminals.start("rostopic", "echo", "/rosoclingo/result")
    for number in range(2):
        node = terminals.start("rosrun", "rosoclingo", "run.py")
        wait_for(lambda: "/rosoclingo/goal" in terminals.names())
        visit(terminals, 2)
        node.wait_for("robot: go(2)")
        if number == 0:
            node.interrupt()
            assert node.wait() == 0
    command = "rosparam delete /use_sim_time"
    interface.wait_for(f"type {command} and then start this node again")
    assert "the clock of ROS has stood still for 5 s at 0.0" in interface.output
    assert "nobody publishes /clock: start the simulator" in interface.output
    interface.interrupt()
    assert interface.wait() == 0
    terminals.run(*command.split())
    fulfill(terminals, "_delay:=0.1")
    results.wait_for('result: "succeeded"')


@pytest.mark.costly
def test_wrong_parameters(terminals: Terminals) -> None:
    wrong = {
        "_delay:=soon": "parameter /n0/delay: expected a number from 0: soon",
        "_delay:=-1": "parameter /n1/delay: expected a number from 0: -1",
        "_fail_probability:=1.5": "expected a number from 0 to 1: 1.5",
        "_fail:=go(": "parameter /n3/fail: expected a regular expression: go(",
        "_sequence:=[success, maybe]": "expected a list of success, failure, none: maybe",
        "_actuators:=Robot": "parameter /n5/actuators: expected a list of terms",
        "_faults:={lies: {probability: 2}}": "/n6/faults: lies: probability: expected a number fr",
    }
    nodes = [fulfill(terminals, f"__name:=n{n}", text) for n, text in enumerate(wrong)]
    for node, text in zip(nodes, wrong.values()):
        assert node.wait() == 2
        assert text in node.output
        assert "Traceback" not in node.output


@pytest.mark.costly
def test_wrong_waypoint_files(terminals: Terminals, tmp_path: Path) -> None:
    places = tmp_path / "places.yaml"
    places.write_text("frame: map\nwaypoints: {c3: {x: 1, y: far, theta: 0}}\n")
    office = package("rosoclingo_interfaces") / "config" / "graph_wg.yaml"
    wrong = {
        ("_timeout:=1",): "parameter /n0/waypoints: expected a text",
        ("_waypoints:=/nowhere.yaml",): "cannot read the waypoint file /nowhere.yaml",
        (f"_waypoints:={places}",): f"{places}: waypoint c3: y: expected a number of metres: far",
        (f"_waypoints:={office}", "_start:=c0"): "n3/start: there is no waypoint c0 in",
        (f"_waypoints:={office}", "_slowest_speed:=0"): "n4/slowest_speed: expected a number great",
    }
    nodes = [
        terminals.start(
            "rosrun", "rosoclingo_interfaces", "move_base_interface.py", f"__name:=n{n}", *texts
        )
        for n, texts in enumerate(wrong)
    ]
    for node, text in zip(nodes, wrong.values()):
        assert node.wait() == 2
        assert text in node.output
        assert "Traceback" not in node.output


@pytest.mark.costly
def test_interrupt_of_an_action(terminals: Terminals, node: Terminal) -> None:
    interface = fulfill(terminals, "_sequence:=none")
    visit(terminals, 3)
    interface.wait_for("robot: go(2) is not answered")
    interface.interrupt()
    assert interface.wait() == 0
    assert "Traceback" not in interface.output


@pytest.mark.install_space
def test_un_block_from_a_pipe(terminals: Terminals) -> None:
    """No line is lost, even if the listener comes later."""
    announced = un_block(terminals, "b c3 c4", "", "u c(1) c(2)")
    announced.wait_for("waiting for a subscriber of /rosoclingo/in; is rosoclingo running?")
    assert announced.process.poll() is None
    heard = terminals.start("rostopic", "echo", "/rosoclingo/in")
    heard.wait_for('value: "unblocked(c(1),c(2))"')
    assert heard.output.count('id: "info"') == 2
    assert heard.output.index("blocked(c3,c4)") < heard.output.index("unblocked(c(1),c(2))")
    announced.wait_for("not known: nobody publishes /rosoclingo/journal")
    assert announced.wait() == 0


def test_un_block_with_wrong_lines(terminals: Terminals) -> None:
    heard = terminals.start("rostopic", "echo", "/rosoclingo/in")
    announced = un_block(terminals, "close c3 c4", "b c3 C4", "b c3 c4")
    heard.wait_for('value: "blocked(c3,c4)"')
    assert announced.wait() == 1
    assert "expected b FROM TO or u FROM TO, such as b c3 c4, not 'close c3 c4'" in announced.output
    assert "'C4' is not a ground term" in announced.output
    assert heard.output.count("id:") == 1


@pytest.mark.costly
def test_un_block_reaches_the_system(terminals: Terminals, tmp_path: Path) -> None:
    """It says itself what rosoclingo has dropped, also the second time."""
    paths = tmp_path / "paths.lp"
    paths.write_text("#program state(t). #external event(info,blocked(c3,c4),t).")
    node = start_system(terminals, str(paths))
    wait_for(lambda: "/rosoclingo" in terminals.subscribers("/rosoclingo/in"))
    for count in (1, 2):
        announced = un_block(terminals, "b c3 c99", "b c3 c4")
        assert announced.wait() == 1
        lines = announced.output.splitlines()
        assert lines[0] == "blocked(c3,c99)"
        assert lines[1].startswith("blocked(c3,c99) was dropped: ")
        assert lines[2:] == ["blocked(c3,c4)"]
        wait_for(lambda n=count: node.output.count("id info, value blocked(c3,c99)") == n)
    assert un_block(terminals, "b c3 c4").wait() == 0


def test_interrupt_of_un_block(terminals: Terminals) -> None:
    waiting = terminals.start(
        "bash", "-c", 'exec rosrun rosoclingo_interfaces un_block.py < <(echo "b c3 c4"; sleep 60)'
    )
    waiting.wait_for("waiting for a subscriber")
    waiting.interrupt()
    assert waiting.wait() == 130
    assert "blocked(c3,c4) was not announced: nobody listens" in waiting.output


def test_interrupt_of_un_block_that_waits_for_a_word(terminals: Terminals) -> None:
    """Of a journal that says nothing about the announcement, as that of a busy rosoclingo."""
    terminals.start("rostopic", "echo", "/rosoclingo/in")
    terminals.publish("/rosoclingo/journal", "rosoclingo/ROSoClingoEvent", "{kind: waiting}")
    waiting = terminals.start(
        "bash", "-c", 'exec rosrun rosoclingo_interfaces un_block.py < <(echo "b c3 c4"; sleep 60)'
    )
    waiting.wait_for("blocked(c3,c4)")
    waiting.interrupt()
    assert waiting.wait() == 130
    assert "was dropped" not in waiting.output


@pytest.mark.costly
def test_usage(terminals: Terminals) -> None:
    for script in (
        "fulfill.py",
        "move_base_interface.py",
        "observe.py",
        "pickup_deliver.py",
        "un_block.py",
    ):
        asked = terminals.run("rosrun", "rosoclingo_interfaces", script, "--help")
        assert asked.wait() == 0
        assert asked.output.startswith(f"usage: {script}")


@pytest.mark.costly
def test_an_interface_that_is_killed_is_lost(terminals: Terminals) -> None:
    """It is known by its heartbeats, and the next one does what is planned then."""
    node = start_system(terminals, parameters=["_policies:={'go(*)': {heartbeat: 2}}"])
    fulfill(terminals, "_delay:=1000", "_heartbeat:=0.2")
    beats = terminals.listen("/fulfill", "/rosoclingo/heartbeat")
    results = terminals.listen("/rosoclingo", "/rosoclingo/result")
    visit(terminals, 2)
    beats.wait_for("progress: -1.0")
    assert "is lost" not in node.output
    os.kill(terminals.pid("/fulfill"), signal.SIGKILL)
    node.wait_for("the interface of robot is lost: no heartbeat for ")
    fulfill(terminals, "__name:=another")
    results.wait_for("succeeded")


def test_an_interface_that_dies_and_lies(terminals: Terminals, node: Terminal) -> None:
    """It dies once in an action; the next one of its name knows, and goes on."""
    faults = "_faults:={dies: {actions: go, at: end}, lies: {actions: go}}"
    results = terminals.listen("/rosoclingo", "/rosoclingo/result")
    first = fulfill(terminals, faults, "_fail:=go")
    visit(terminals, 2)
    first.wait_for("robot: go(2): the node dies before the answer")
    assert first.wait() == -signal.SIGKILL
    second = fulfill(terminals, faults, "_fail:=go")
    second.wait_for("robot: go(2): is not done, but answered with success, as ~faults says")
    second.wait_for("robot: go(2): success")
    results.wait_for('result: "succeeded"')
    assert "Traceback" not in node.output + second.output
