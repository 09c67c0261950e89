"""Which simulator mailbot_scenario.launch starts, and what it tells Gazebo and ROS's navigation.

These themselves are not there: empty packages stand in for what the launch files need, so this
tests no more than the launch files' text.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Dict, List

import pytest
import yaml
from terminals import Terminals, package, terminals

from rosoclingo_gazebo.ros.navigation_check import missing

__all__ = ["terminals"]

NODES = ("map_server", "amcl", "move_base")
NAVIGATION = (*NODES, "costmap_2d", "navfn", "dwa_local_planner")
PACKAGES = (
    *NAVIGATION, "gazebo_ros", "gazebo_plugins", "robot_state_publisher", "turtlebot3_description",
    "xacro",
)  # fmt: skip
SCENARIO = ("rosoclingo_gazebo", "mailbot_scenario.launch")
REAL = ("rosoclingo_gazebo", "real_navigation.launch")
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
    for name in NODES:
        executable(tmp_path / name / name, "#!/bin/sh\n")
    xacro = "#!/bin/sh\necho \"<robot name='$(basename $1)'/>\"\n"
    executable(tmp_path / "xacro" / "xacro", xacro)
    launch = tmp_path / "gazebo_ros" / "launch"
    launch.mkdir()
    arguments = "".join(f"<arg name='{name}'/>" for name in ("world_name", "gui", "use_sim_time"))
    (launch / "empty_world.launch").write_text(
        f"<launch>{arguments}<param name='world' value='$(arg world_name)'/>"
        "<node name='gazebo' pkg='gazebo_ros' type='gzserver'/></launch>"
    )
    terminals.environment["ROS_PACKAGE_PATH"] += f":{tmp_path}"
    return terminals.environment


def executable(file: Path, text: str) -> None:
    file.write_text(text)
    file.chmod(0o755)


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
    without = terminals.run("roslaunch", "--nodes", *SCENARIO, "simulator:=gazebo")
    assert "ros-noetic-gazebo-ros" in without.output


@pytest.mark.install_space
def test_with_gazebo(terminals: Terminals, gazebo: Dict[str, str]) -> None:
    source(terminals)
    assert nodes(terminals) == [
        "/map_server", "/amcl", "/move_base", "/gazebo", "/spawn_mailbot", "/robot_state_publisher",
    ]  # fmt: skip
    assert nodes(terminals, "navigation:=false", "localisation:=false") == [
        "/gazebo", "/spawn_mailbot", "/robot_state_publisher",
    ]  # fmt: skip
    assert nodes(terminals, "simulator:=embedded") == ["/simulator"]
    assert nodes(terminals, "record:=x").count("/recorder") == 1


@pytest.mark.install_space
@pytest.mark.skipif(
    not missing(NODES, NAVIGATION), reason="ROS's navigation is there: nothing is missing"
)
def test_missing_packages_are_named_before_anything_starts(terminals: Terminals) -> None:
    started = terminals.run("roslaunch", *REAL)
    assert started.wait() == 1
    lacking = missing(NODES, NAVIGATION)
    assert f"These packages are missing, or not built: {', '.join(lacking)}\n" in started.output
    names = " ".join(f"ros-noetic-{name.replace('_', '-')}" for name in lacking)
    assert f"sudo apt-get install {names}\n" in started.output
    assert "git clone -b noetic-devel" in started.output
    assert "Traceback" not in started.output
    assert "started with pid" not in started.output
    said, _, by_roslaunch = started.output.partition("Nothing was started; what roslaunch says")
    assert "RLException" in by_roslaunch
    assert "RLException" not in said


@pytest.mark.install_space
@pytest.mark.skipif(not missing(NODES, NAVIGATION), reason="likewise: nothing is printed")
def test_the_printed_lines_build_the_navigation_stack(terminals: Terminals, tmp_path: Path) -> None:
    """They are typed literally; only sudo does nothing, and git makes a stack of empty packages."""
    config = str(package("rosoclingo_gazebo") / "config" / "navigation")
    check = terminals.run("rosrun", "rosoclingo_gazebo", "navigation_check.py", config)
    build, source = (
        "".join(line.strip(" ") for line in lines.splitlines(True) if line.startswith("  "))
        for lines in check.output.partition("build it there:\n")[2].split("Then, in each terminal")
    )
    for name in NAVIGATION:
        catkin_package(tmp_path / "stack" / name)
    (tmp_path / "home").mkdir()
    terminals.environment["HOME"] = str(tmp_path / "home")
    bare = "set -e\nunset CMAKE_PREFIX_PATH ROS_PACKAGE_PATH PYTHONPATH\n"
    stubs = f"sudo() {{ :; }}\ngit() {{ cp -r {tmp_path}/stack ${{@: -1}}; }}\n"
    built = terminals.run("bash", "-c", bare + stubs + build)
    assert built.wait() == 0, built.output

    find = "rospack find move_base\nrospack find rosoclingo_gazebo\n"
    launch = f"roslaunch --nodes {' '.join(REAL)}\n"
    stack_first = "source ~/navigation/devel/setup.bash\n"
    for terminal in (source + find, stack_first + source + find + launch):
        found = terminals.run("bash", "-c", bare + terminal)
        assert found.wait() == 0, found.output
        assert f"{tmp_path}/home/navigation/src/navigation/move_base\n" in found.output
    assert found.output.endswith("/map_server\n/amcl\n/move_base\n")


def catkin_package(folder: Path) -> None:
    """Makes a package whose tests cannot be built without googletest, as those of map_server."""
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(
        f"<package format='2'><name>{folder.name}</name><version>1.0.0</version><description>-"
        "</description><maintainer email='a@example.com'>-</maintainer><license>-</license>"
        "<buildtool_depend>catkin</buildtool_depend></package>"
    )
    (folder / "CMakeLists.txt").write_text(
        f"cmake_minimum_required(VERSION 3.0.2)\nproject({folder.name} NONE)\n"
        "find_package(catkin REQUIRED)\ncatkin_package()\n"
        'if(CATKIN_ENABLE_TESTING)\n  message(FATAL_ERROR "no googletest")\nendif()\n'
    )
    executable(folder / folder.name, "#!/bin/sh\n")


@pytest.mark.costly
def test_a_package_without_its_node_is_missing(
    terminals: Terminals, gazebo: Dict[str, str], tmp_path: Path
) -> None:
    (tmp_path / "amcl" / "amcl").unlink()
    started = terminals.run("roslaunch", "--nodes", *REAL)
    assert "These packages are missing, or not built: amcl\n" in started.output
    assert terminals.run("roslaunch", "--nodes", *REAL, "localisation:=false").wait() == 0


@pytest.mark.costly
def test_planners_of_a_config_of_ones_own(
    terminals: Terminals, gazebo: Dict[str, str], tmp_path: Path
) -> None:
    config = tmp_path / "my robot"
    shutil.copytree(package("rosoclingo_gazebo") / "config" / "navigation", config)
    file = config / "move_base.yaml"
    file.write_text(file.read_text().replace("navfn/NavfnROS", "global_planner/GlobalPlanner"))
    started = terminals.run("roslaunch", "--nodes", *REAL, f"config:={config}")
    assert "These packages are missing, or not built: global_planner\n" in started.output
    file.write_text("base_global_planner: navfn\n")
    started = terminals.run("roslaunch", "--nodes", *REAL, f"config:={config}")
    assert f"{file}: base_global_planner: expected PACKAGE/CLASS" in started.output
    file.unlink()
    started = terminals.run("roslaunch", "--nodes", *REAL, f"config:={config}")
    assert f"cannot read {file}" in started.output


def test_navigation_of_one_robot_of_several(terminals: Terminals, gazebo: Dict[str, str]) -> None:
    shown = terminals.run(
        "roslaunch", "--dump-params", *REAL, "frame_prefix:=robot1", "initial_pose:=-x 3 -y 4 -Y 1"
    )
    parameters = yaml.safe_load(shown.output)
    frames = {
        "amcl/odom_frame_id": "robot1/odom",
        "amcl/base_frame_id": "robot1/base_footprint",
        "amcl/global_frame_id": "map",
        "move_base/global_costmap/global_frame": "map",
        "move_base/global_costmap/robot_base_frame": "robot1/base_footprint",
        "move_base/local_costmap/global_frame": "robot1/odom",
        "move_base/local_costmap/robot_base_frame": "robot1/base_footprint",
    }
    assert {name: parameters[f"/{name}"] for name in frames} == frames
    assert [parameters[f"/amcl/initial_pose_{letter}"] for letter in "xya"] == [3, 4, 1]
    # Relative, for the map of the robot's own namespace.
    assert parameters["/move_base/global_costmap/static_layer/map_topic"] == "map"
    for costmap in ("global_costmap", "local_costmap"):
        seen, cleared = (
            parameters[f"/move_base/{costmap}/obstacle_layer/{word}_range"]
            for word in ("obstacle", "raytrace")
        )
        assert seen == cleared
        # The waffle's laser sees 3.5 m, and a beam that meets nothing must not be an obstacle.
        assert seen < 3.5
        assert parameters[f"/move_base/{costmap}/obstacle_layer/scan/inf_is_valid"] is True


def test_the_drive_with_real_navigation(terminals: Terminals, gazebo: Dict[str, str]) -> None:
    """The scenarios' test starts the simulator as a robot only, and ROS's own navigation."""
    shown = terminals.run(
        "roslaunch", "--dump-params", "rosoclingo_gazebo", "driving.rostest", "scenario:=1",
        "navigation:=real",
    )  # fmt: skip
    parameters = yaml.safe_load(shown.output)
    assert parameters["/simulator/navigation"] is parameters["/simulator/localisation"] is False
    assert "/move_base/base_local_planner" in parameters


@pytest.mark.costly
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
    assert parameters["/world"].endswith("rosoclingo_simulator/worlds/office.world")
    assert "turtlebot3_waffle" in parameters["/robot_description"]
    assert parameters["/move_base/global_costmap/obstacle_layer/scan/topic"] == "scan"
