"""Lists missing packages of ROS's navigation, and how to get them.

navigation_check.py $(rospack find rosoclingo_gazebo)/config/navigation
"""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from pathlib import Path
from typing import Any, Callable, Iterable, List, NoReturn, Sequence

import rospkg
import yaml
from roslib.packages import find_node

from rosclingo import strict_yaml
from rosclingo.errors import RosclingoError

LOCALISATION = ("map_server", "amcl")
"""Packages with a node of the same name, which say where the robot is."""

NAVIGATION = ("move_base",)
"""Packages with a node of the same name, which drive the robot."""

_COSTMAP = "costmap_2d"  # whose layers the configuration names
_PLANNERS = ("base_global_planner", "base_local_planner")  # of move_base, such as navfn/NavfnROS

_BUILD = """\
  sudo apt-get install git libangles-dev libbullet-dev libdiagnostic-updater-dev \\
    libdynamic-reconfigure-config-init-mutex-dev python3-dynamic-reconfigure libeigen3-dev \\
    liblaser-geometry-dev libmap-msgs-dev libmessage-filters-dev libmove-base-msgs-dev \\
    libnav-msgs-dev librosbag-dev librostest-dev libsdl-image1.2-dev libstd-srvs-dev \\
    libtf2-geometry-msgs-dev libtf2-ros-dev libtf2-sensor-msgs-dev libvisualization-msgs-dev \\
    libyaml-cpp-dev pluginlib-dev ros-cmake-modules
  mkdir -p ~/navigation/src && cd ~/navigation
  git clone -b noetic-devel https://github.com/ros-planning/navigation src/navigation
  catkin_make -DPYTHON_EXECUTABLE=/usr/bin/python3 -DPython_EXECUTABLE=/usr/bin/python3 \\
    -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_STANDARD=17 -DCATKIN_ENABLE_TESTING=OFF
Then, in each terminal, source this workspace and add the navigation stack to it:
  source {workspace}/setup.bash
  source ~/navigation/devel/setup.bash --extend"""


# roslaunch can only be ended by an exception, which it prints.
_NOT_STARTED = "Nothing was started; what roslaunch says below in red means no more than that.\n"


class ConfigError(RosclingoError):
    """A file of move_base's parameters that cannot be used; the message names it."""


def plugins(config: Path) -> List[str]:
    """Returns the packages of the plugins that move_base loads.

    Args:
        config: A folder with ``move_base.yaml``.

    Raises:
        ConfigError: The file cannot be read, or names no planners.
    """
    file = config / "move_base.yaml"
    try:
        content: Any = strict_yaml.load(file.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as err:
        raise ConfigError(f"cannot read {file}: {err}") from err
    names = [content.get(key) if isinstance(content, dict) else None for key in _PLANNERS]
    for key, name in zip(_PLANNERS, names):
        if not isinstance(name, str) or "/" not in name:
            raise ConfigError(f"{file}: {key}: expected PACKAGE/CLASS, such as navfn/NavfnROS")
    return [_COSTMAP, *(str(name).split("/")[0] for name in names)]


def missing(nodes: Iterable[str], packages: Iterable[str]) -> List[str]:
    """Returns the packages that are missing, or not built.

    Args:
        nodes: Packages that have a node of the same name.
        packages: Other packages.
    """
    known = rospkg.RosPack()
    lacking = [name for name in nodes if not _is_found(find_node, name, name)]
    lacking += [name for name in packages if not _is_found(known.get_path, name)]
    return list(dict.fromkeys(lacking))


def remedy(names: Sequence[str]) -> str:
    """Returns instructions for a user who lacks packages."""
    on_ubuntu = " ".join(f"ros-noetic-{name.replace('_', '-')}" for name in names)
    return (
        f"These packages are missing, or not built: {', '.join(names)}\n"
        f"On Ubuntu 20.04, install them:\n  sudo apt-get install {on_ubuntu}\n"
        f"Debian has no navigation stack; build it there:\n"
        + _BUILD.format(workspace=shlex.quote(_workspace()))
    )


def _workspace() -> str:
    """Returns the folder of the setup.bash that was sourced for this package."""
    prefixes = os.environ.get("CMAKE_PREFIX_PATH", "").split(os.pathsep)
    ours = (
        prefix
        for prefix in prefixes
        if Path(prefix, "setup.bash").exists() and Path(prefix, "share/rosoclingo_gazebo").is_dir()
    )
    return next(ours, "devel")


def _is_found(find: Callable[..., object], *names: str) -> bool:
    try:
        return bool(find(*names))
    except rospkg.ResourceNotFound:
        return False


def _end(message: str, status: int, launching: bool) -> NoReturn:
    print(f"{message}\n{_NOT_STARTED if launching else ''}", file=sys.stderr)
    sys.exit(status)


def main() -> NoReturn:
    """Prints the result; the exit status is 1 if something is missing, 2 if a file is wrong."""
    parser = argparse.ArgumentParser(description="Looks for the packages of ROS's navigation.")
    parser.add_argument("config", type=Path, help="folder with move_base.yaml")
    for name, node in (("--navigation", "move_base"), ("--localisation", "amcl and map_server")):
        parser.add_argument(
            name, type=str.lower, choices=("true", "false"), default="true", help=f"with {node}"
        )
    parser.add_argument("--launching", action="store_true", help="for a launch file, which ends")
    parser.add_argument("packages", nargs="*", help="other packages to look for")
    options = parser.parse_args()
    nodes: List[str] = []
    packages: List[str] = list(options.packages)
    try:
        if options.localisation == "true":
            nodes += LOCALISATION
        if options.navigation == "true":
            nodes += NAVIGATION
            packages += plugins(options.config)
    except ConfigError as err:
        _end(str(err), 2, options.launching)
    lacking = missing(nodes, packages)
    if lacking:
        _end(f"\n{remedy(lacking)}", 1, options.launching)
    print(" ".join([*nodes, *packages]))
    sys.exit(0)
