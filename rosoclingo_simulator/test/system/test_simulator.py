"""Starting and ending the simulator."""

from __future__ import annotations

from pathlib import Path
from typing import Tuple

import pytest
from terminals import Terminals, terminals  # noqa: F401 - the fixture

SIMULATOR = ("rosrun", "rosoclingo_simulator", "simulator.py")


@pytest.mark.install_space
@pytest.mark.parametrize("arguments", [(), ("_speed:=0.02",), ("_physics:=mujoco",)])
def test_ctrl_c_ends_it(
    terminals: Terminals,  # noqa: F811 - the fixture
    arguments: Tuple[str, ...],
) -> None:
    terminals.master.setParam("/test", "/use_sim_time", True)
    simulator = terminals.start(*SIMULATOR, *arguments)
    simulator.wait_for("simulates")
    simulator.interrupt()
    assert simulator.wait() == 0
    assert "Traceback" not in simulator.output


# Ctrl-C comes before the simulator runs, and rospy is at its hooks when the simulator adds its own.
INTERRUPTED = """
import os, signal, threading
import rospy
from rosoclingo_simulator.ros.node import SimulatorNode, main

run = SimulatorNode.run
entered, goes_on = threading.Event(), threading.Event()

def hook():
    entered.set()
    goes_on.wait()

def interrupted(node):
    rospy.on_shutdown(hook)
    os.kill(os.getpid(), signal.SIGINT)
    entered.wait()
    threading.Timer(0.2, goes_on.set).start()
    run(node)

SimulatorNode.run = interrupted
main()
"""


def test_ctrl_c_ends_it_before_it_runs(
    terminals: Terminals,  # noqa: F811 - the fixture
) -> None:
    terminals.master.setParam("/test", "/use_sim_time", True)
    simulator = terminals.start("python", "-c", INTERRUPTED)
    assert simulator.wait() == 0
    assert "Traceback" not in simulator.output


@pytest.mark.costly
def test_two_simulators_and_their_clocks(
    terminals: Terminals,  # noqa: F811 - the fixture
) -> None:
    terminals.master.setParam("/test", "/use_sim_time", True)
    second = terminals.start(*SIMULATOR, "_clock:=false", "__name:=second")
    second.wait_for("simulates office, kinematic, by /clock")
    second.wait_for("the simulator stands still, because nothing comes on /clock")
    # It answers nevertheless.
    blocked = terminals.run("rosservice", "call", "/second/obstacle", "block c1 o1")
    assert "success: True" in blocked.output
    touches = terminals.start("rostopic", "echo", "-n", "1", "/second/touches")
    terminals.start(*SIMULATOR, "__name:=first").wait_for("simulates")
    assert touches.wait() == 0  # its first step
    third = terminals.start(*SIMULATOR, "__name:=third")
    third.wait_for("/first publishes /clock, too: start one of them with _clock:=false")
    second.interrupt()
    assert second.wait() == 0
    assert "Traceback" not in second.output + third.output


def test_a_slow_clock_holds_up_no_statuses(
    terminals: Terminals,  # noqa: F811 - the fixture
) -> None:
    """A client takes a server without statuses for dead; by the clock, these would take 200 s."""
    terminals.master.setParam("/test", "/use_sim_time", True)
    terminals.start(*SIMULATOR, "_speed:=0.02").wait_for("simulates")
    statuses = terminals.start("rostopic", "echo", "-n", "20", "/move_base/status")
    assert statuses.wait() == 0, statuses.output


# Makes a simulator for each parameter that is wrong, in one process.
WRONG = """
import ast, sys
import rospy
from rosclingo.errors import RosclingoError
from rosclingo.ros.init import init_node
from rosoclingo_simulator.ros.node import SimulatorNode
from rosoclingo_simulator.ros.settings import read_settings

init_node("simulator")
for name, value in ast.literal_eval(sys.argv[1]):
    rospy.set_param("~" + name, value)
    try:
        SimulatorNode(read_settings())
    except RosclingoError as err:
        print(err)
    else:
        print("taken:", name, value)
    rospy.delete_param("~" + name)
"""


def test_what_is_wrong_is_named(terminals: Terminals) -> None:  # noqa: F811 - the fixture
    ended = terminals.run(*SIMULATOR, "_speed:=fast")
    assert "parameter /simulator/speed: expected a number from 0: fast" in ended.output
    assert ended.wait() == 2
    assert "Traceback" not in ended.output
    wrong = (
        ("map", "/nowhere.yaml", "cannot read the map /nowhere.yaml"),
        ("waypoints", "/nowhere.yaml", "cannot read the waypoint file /nowhere.yaml"),
        ("physics", "magic", "parameter /simulator/physics: expected kinematic or mujoco: magic"),
        ("speed", 0, "parameter /simulator/speed: expected a number from 0.02 on: 0"),
        ("speed", 0.01, "parameter /simulator/speed: expected a number from 0.02 on: 0.01"),
        ("max_speed", 2, "/max_speed: expected a number from 0 to 0.5: 2"),
        ("navigation", "maybe", "/navigation: expected true or false: maybe"),
        ("clock", 3, "/clock: expected true or false: 3"),
        ("frame_prefix", "a b", "/frame_prefix: expected a name without blanks"),
        ("fleet", "robot1", "/fleet: expected different names, of letters, digits and underscores"),
        ("fleet", "a@c1 a@c2", "such as robot1@open1 robot2@c5: a@c2"),
        ("fleet", "a@c1 b@c7", "there is no waypoint c7"),
        ("fleet", "a@c1 b@c1", "a and b cannot be at the same place: set ~fleet"),
        ("faults", "/nowhere.yaml", "/nowhere.yaml: No such file or directory; check the path"),
        ("faults", {"faults": [{"fault": "slide"}]}, "~faults: fault 1: there is no fault 'slide'"),
        ("faults", 3, "parameter /simulator/faults: expected a text: 3"),
        ("x", -3, "the robot cannot stand at (-3, -8)"),
        ("initial_pose", "here", "parameter /simulator/initial_pose: expected a text such as"),
    )
    pairs = [(name, value) for name, value, _ in wrong]
    terminals.master.deleteParam("/test", "/simulator/speed")
    ended = terminals.run("python", "-c", WRONG, repr(pairs))
    assert ended.wait() == 0, ended.output
    said = [line for line in ended.output.splitlines() if not line.startswith("[")]
    assert len(said) == len(wrong), ended.output
    for line, (_, _, message) in zip(said, wrong):
        assert message in line


def test_without_mujoco_it_says_what_to_install(
    terminals: Terminals,  # noqa: F811 - the fixture
    tmp_path: Path,
) -> None:
    # A package in the way of MuJoCo's, which cannot be loaded.
    (tmp_path / "mujoco.py").write_text(
        "raise ImportError('libmujoco.so: cannot open shared object file')\n"
    )
    path = terminals.environment.get("PYTHONPATH", "")
    terminals.environment["PYTHONPATH"] = f"{tmp_path}:{path}"
    simulator = terminals.run(*SIMULATOR, "_physics:=mujoco")
    assert "~physics:=mujoco needs MuJoCo, which cannot be loaded" in simulator.output
    assert "-m pip install 'mujoco>=3.1'" in simulator.output
    assert simulator.wait() == 2
    assert "Traceback" not in simulator.output
