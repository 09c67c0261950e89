"""Names of Debian packages, from catkin packages, the keys of rosdep and requirements.

There are two systems. Debian has ROS's packages of its own, which lie below ``/usr``. ROS Noetic's
packages for Ubuntu lie below ``/opt/ros/noetic``, and bloom's templates name them.
"""

from __future__ import annotations

import enum
from typing import Dict, List, Tuple


class System(enum.Enum):
    """A distribution of ROS's packages; the value is the folder below which they are installed."""

    DEBIAN = "/usr"
    NOETIC = "/opt/ros/noetic"


# What each package finds in the private folder, if apt has it not or too old: libraries of
# requirements.txt, by the key of rosdep with which a package.xml names them. A library belongs to
# the first package that names it.
LIBRARY_KEYS = {
    "aiohttp": "python3-aiohttp",
    "clingo": "python3-clingo-pip",
    "defusedxml": "python3-defusedxml",
    "numpy": "python3-numpy",
    "Pillow": "python3-pil",
    "rosbags": "python3-rosbags-pip",
    "scikit-image": "python3-skimage",
    "scipy": "python3-scipy",
}

CYTHON = "cython3"
"""Key of rosdep and apt package; a catkin package that needs it to build has compiled modules."""

_PYTHON = {
    "actionlib", "diagnostic_updater", "genpy", "rosbag", "rosgraph", "roslaunch", "roslib",
    "rosmaster", "rosnode", "rospy",
}  # fmt: skip
_MESSAGES = {
    "actionlib_msgs", "geometry_msgs", "move_base_msgs", "nav_msgs", "rosgraph_msgs", "sensor_msgs",
    "std_msgs", "std_srvs", "tf2_msgs", "visualization_msgs",
}  # fmt: skip
_OTHERS: Dict[str, Tuple[str, ...]] = {
    "catkin": ("catkin",),
    "message_generation": ("ros-message-generation",),
    "message_runtime": ("ros-message-runtime",),
    "rosbash": ("rosbash",),
    "rviz": ("rviz",),
}

# What users type beside our nodes, with how the documents call the interpreter.
_TOOLS = ("rosbash", "rosnode", "rosparam", "rosservice", "rostopic")
# For pictures; that of Ubuntu 20.04 is too old. MuJoCo is not among apt's packages.
_RECOMMENDED = {"rosoclingo": "python3-matplotlib", "rosoclingo_gazebo": "python3-matplotlib"}


class UnknownKeyError(Exception):
    """A package.xml names what no table here has; the message says where to add it."""


def deb_name(package: str, system: System) -> str:
    """Returns the name of the Debian package of one of our catkin packages.

    Args:
        package: Name of the catkin package.
        system: Where it is to be installed.
    """
    name = package.replace("_", "-")
    return f"ros-noetic-{name}" if system is System.NOETIC else name


def apt_names(key: str, system: System, *, build: bool = False) -> List[str]:
    """Returns the apt packages for a dependency; none if a library is not apt's.

    Args:
        key: What a package.xml depends on: a key of rosdep, not a package of ours.
        system: Where it is to be installed.
        build: Whether building needs it, rather than running.

    Raises:
        UnknownKeyError: No table has the key.
    """
    if key == CYTHON or key.startswith("python3-"):
        return [] if key.endswith("-pip") else [key]
    if key not in _PYTHON | _MESSAGES | set(_OTHERS):
        raise UnknownKeyError(f"no apt package is known for '{key}': add it to {__file__}")
    if system is System.NOETIC:
        return [deb_name(key, system)]
    if key in _OTHERS:
        return list(_OTHERS[key])
    name = key.replace("_", "-")
    if key in _PYTHON:
        return [f"python3-{name}"]
    return [f"ros-{name}", f"lib{name}-dev" if build else f"python3-{name}"]


def recommended(package: str, system: System) -> List[str]:
    """Returns the apt packages that most users of one of our catkin packages want.

    Args:
        package: Name of the catkin package.
        system: Where it is to be installed.
    """
    names = [_RECOMMENDED[package]] if package in _RECOMMENDED and system is System.DEBIAN else []
    if package == "rosclingo":
        if system is System.NOETIC:
            names += [deb_name(tool, system) for tool in _TOOLS]
        else:
            names += [tool if tool == "rosbash" else f"python3-{tool}" for tool in _TOOLS]
        names.append("python-is-python3")
    return names
