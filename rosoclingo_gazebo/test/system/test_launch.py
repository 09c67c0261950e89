"""Which simulator mailbot_scenario.launch starts, and what it tells Gazebo.

Gazebo itself is not there: empty packages stand in for what gazebo.launch needs, so this tests no
more than the launch files' text.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Dict, List

import pytest
import yaml
from terminals import Terminals, terminals

__all__ = ["terminals"]

PACKAGES = (
    "amcl", "gazebo_ros", "map_server", "move_base", "robot_state_publisher",
    "turtlebot3_description", "xacro",
)  # fmt: skip
SCENARIO = ("rosoclingo_gazebo", "mailbot_scenario.launch")
HOOK = "etc/catkin/profile.d/50.rosoclingo_gazebo_simulator.sh"


@pytest.fixture
def gazebo(terminals: Terminals, tmp_path: Path) -> Dict[str, str]:
    """Makes the packages, and returns what is in the environment when a workspace has them."""
    for name in PACKAGES:
        (tmp_path / name).mkdir()
        (tmp_path / name / "package.xml").write_text(
            f"<package format='2'><name>{name}</name><version>1.0.0</version><description>-"
            "</description><maintainer email='a@b.c'>-</maintainer><license>-</license></package>"
        )
    xacro = tmp_path / "xacro" / "xacro"
    xacro.write_text("#!/bin/sh\necho \"<robot name='$(basename $1)'/>\"\n")
    xacro.chmod(0o755)
    launch = tmp_path / "gazebo_ros" / "launch"
    launch.mkdir()
    arguments = "".join(f"<arg name='{name}'/>" for name in ("world_name", "gui", "use_sim_time"))
    (launch / "empty_world.launch").write_text(
        f"<launch>{arguments}<param name='world' value='$(arg world_name)'/>"
        "<node name='gazebo' pkg='gazebo_ros' type='gzserver'/></launch>"
    )
    terminals.environment["ROS_PACKAGE_PATH"] += f":{tmp_path}"
    return terminals.environment


def source(terminals: Terminals) -> None:
    """Does what sourcing the workspace does to find a simulator."""
    hook = next(
        file
        for folder in os.environ["CMAKE_PREFIX_PATH"].split(":")
        for file in [Path(folder) / HOOK]
        if file.exists()
    )
    said = terminals.run("bash", "-euc", f". {hook}; echo $ROSOCLINGO_SIMULATOR")
    terminals.environment["ROSOCLINGO_SIMULATOR"] = said.output.strip()


def nodes(terminals: Terminals, *arguments: str) -> List[str]:
    return terminals.run("roslaunch", "--nodes", *SCENARIO, *arguments).output.split()


@pytest.mark.install_space
def test_without_gazebo(terminals: Terminals) -> None:
    source(terminals)
    assert nodes(terminals) == ["/simulator"]
    assert nodes(terminals, "rviz:=true") == ["/simulator", "/graph_markers", "/rviz"]
    missing = terminals.run("roslaunch", "--nodes", *SCENARIO, "simulator:=gazebo")
    assert "gazebo_ros" in missing.output


@pytest.mark.install_space
def test_with_gazebo(terminals: Terminals, gazebo: Dict[str, str]) -> None:
    source(terminals)
    assert nodes(terminals) == [
        "/gazebo", "/spawn_mailbot", "/robot_state_publisher", "/map_server", "/amcl", "/move_base",
    ]  # fmt: skip
    assert nodes(terminals, "simulator:=embedded") == ["/simulator"]


@pytest.mark.parametrize(
    ("pose", "expected"),
    [
        ("-y -8 -x 7 -z 0 -R 0 -P 0 -Y 0", (7, -8, 0)),
        ("-x 16.5 -y -17 -Y 1.5", (16.5, -17, 1.5)),
        ("", (7, -8, 0)),
        ("-Y 1", (7, -8, 1)),
        ("-x 1  -y 2 -x 3", (3, 2, 0)),
    ],
)
def test_where_gazebos_robot_is(
    terminals: Terminals, gazebo: Dict[str, str], pose: str, expected: tuple[float, ...]
) -> None:
    gazebo["ROBOT_INITIAL_POSE"] = pose
    shown = terminals.run("roslaunch", "--dump-params", *SCENARIO, "simulator:=gazebo")
    parameters = yaml.safe_load(shown.output)
    assert tuple(parameters[f"/amcl/initial_pose_{letter}"] for letter in "xya") == expected
    assert parameters["/world"].endswith("rosoclingo_gazebo/worlds/office.world")
    assert "turtlebot3_waffle" in parameters["/robot_description"]
    assert parameters["/move_base/global_costmap/obstacle_layer/scan/topic"] == "scan"
