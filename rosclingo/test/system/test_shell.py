"""What sourcing the workspace does to a shell, and what it leaves alone.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import functools
import os
import subprocess
import sys
from pathlib import Path
from typing import Mapping, Set

import pytest
from terminals import TIMEOUT, Terminals, terminals

__all__ = ["terminals"]

PACKAGES = sorted(file.parent for file in Path(__file__).resolve().parents[3].glob("*/package.xml"))
COMPLETION = (
    "/opt/ros/noetic/share/rosbash/rosbash",
    "/usr/share/bash-completion/completions/rosbash",
)
WHICH_NUMPY = "import numpy; print(numpy.__file__)"

# It talks to a node of ours, in messages of ours, and lives on apt's packages.
NODE = """#!/usr/bin/env python3
import cv_bridge, numpy, rospy
from rosclingo.srv import ROSClingoControl

rospy.init_node("camera")
picture = cv_bridge.CvBridge().cv2_to_imgmsg(numpy.zeros((2, 3), numpy.uint8))
control = rospy.ServiceProxy("/rosclingo/control", ROSClingoControl)
control.wait_for_service()
external = f"#external seen({picture.width},{picture.height})."
print(control(f'''<commands><add name="picture"><program>{external}</program></add>
    <ground><program name="picture"/></ground><get_externals/></commands>''').result)
print(numpy.__file__)
"""


def prefix() -> Path:
    """Returns the folder of the sourced devel or install space."""
    return Path(os.environ["CMAKE_PREFIX_PATH"].split(os.pathsep)[0])


@functools.lru_cache(maxsize=None)
def shell() -> Mapping[str, str]:
    """Returns what a user has who sourced the workspace, and no Python but the system's."""
    variables = subprocess.check_output(
        ["bash", "-c", f". {prefix()}/setup.bash && env -0"],
        env={"HOME": os.environ["HOME"], "PATH": "/usr/local/bin:/usr/bin:/bin"},
        text=True,
    )
    return dict(variable.split("=", 1) for variable in variables.split("\0") if variable)


def output(*command: str) -> str:
    """Returns what a command prints in such a shell."""
    return subprocess.check_output(command, env=shell(), text=True, timeout=TIMEOUT).strip()


@pytest.mark.both_spaces
def test_python_is_the_one_that_the_workspace_was_built_with() -> None:
    assert output("python", "-c", "import sys; print(sys.executable)") == sys.executable


@pytest.mark.both_spaces
def test_the_system_s_packages_are_not_shadowed() -> None:
    """For our own nodes, from which a user may derive; a node of a user's has a test below."""
    output("python", "-c", "import cv2, cv_bridge")


@pytest.mark.both_spaces
def test_only_python_and_our_packages_are_added() -> None:
    assert [file.name for file in (prefix() / "bin").iterdir()] == ["python"]
    assert output("bash", "-c", "type -P python3") == "/usr/bin/python3"
    (added,) = [
        path for path in os.environ["PYTHONPATH"].split(":") if path.startswith(f"{prefix()}/")
    ]
    names = {path.name for path in Path(added).iterdir() if not path.name.endswith("-info")}
    assert names <= {folder.name for folder in PACKAGES}


@pytest.mark.costly
@pytest.mark.both_spaces
def test_a_node_of_a_user_beside_ours(terminals: Terminals, tmp_path: Path) -> None:
    folder = tmp_path / "camera"
    folder.mkdir()
    (folder / "package.xml").write_text("<package><name>camera</name></package>")
    (folder / "node.py").write_text(NODE)
    (folder / "node.py").chmod(0o755)
    sourced = dict(shell())
    sourced["ROS_PACKAGE_PATH"] += f":{tmp_path}"
    terminals.environment.update(sourced, ROS_MASTER_URI=terminals.environment["ROS_MASTER_URI"])
    terminals.start("rosrun", "rosclingo", "run.py")
    node = terminals.run("rosrun", "camera", "node.py")
    assert node.wait() == 0, node.output
    assert '<external name="seen(3,2)" value="false"/>' in node.output
    system = subprocess.check_output(["/usr/bin/python3", "-I", "-c", WHICH_NUMPY], text=True)
    assert system in node.output


def completed(command: str, function: str) -> Mapping[str, Set[str]]:
    """Returns what bash offers for the second argument of rosrun or roslaunch, by the first."""
    names = " ".join(folder.name for folder in PACKAGES)
    script = (
        f"for file in {' '.join(COMPLETION)}; do [ ! -f $file ] || . $file; done; "
        f"for name in {names}; do COMP_WORDS=({command} $name ''); COMP_CWORD=2; COMPREPLY=(); "
        f"{function}; echo $name ${{COMPREPLY[@]}}; done"
    )
    lines = [line.split() for line in output("bash", "-c", script).splitlines()]
    return {name: set(offered) for name, *offered in lines}


@pytest.mark.costly
@pytest.mark.both_spaces
def test_completion_offers_what_a_user_runs() -> None:
    nodes = {
        folder.name: {
            file.name for file in folder.glob("nodes/*.py") if file.read_text().startswith("#!")
        }
        for folder in PACKAGES
    }
    launch = {
        folder.name: {file.name for file in folder.glob("launch/*.launch")} for folder in PACKAGES
    }
    assert completed("rosrun", "_roscomplete_exe") == nodes
    assert completed("roslaunch", "_roscomplete_launch") == launch
