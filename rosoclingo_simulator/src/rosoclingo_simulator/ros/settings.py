"""The simulator's parameters."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, Mapping, Union

import rospkg
import rospy

from rosclingo.ros import parameters
from rosoclingo_simulator.navigation.follower import Limits
from rosoclingo_simulator.physics.physics import LINEAR_SPEED, Pose

PHYSICS_KINDS = ("kinematic", "mujoco")
"""What ``~physics`` may be."""

DEFAULT_POSE = "-y -8 -x 7 -z 0 -R 0 -P 0 -Y 0"
"""The manual's ``ROBOT_INITIAL_POSE``."""

LEAST_SPEED = 0.02
"""What ``~speed`` is at least: the clock goes on every 2.5 s of wall time then."""

_NAME = re.compile(r"[A-Za-z]\w*", re.ASCII)
_OPTION = re.compile(r"-([xyzRPY])\s+(\S+)")


@dataclass(frozen=True)
class Settings:
    """The values of the parameters, which the package's README describes.

    Attributes:
        map: A map_server's YAML file.
        waypoints: The file with the places for boxes.
        world: The world for MuJoCo.
        physics: One of ``PHYSICS_KINDS``.
        speed: Seconds of simulated time in one of wall time.
        clock: Whether the simulator is the clock, or goes by that of another.
        navigation: Whether it is move_base, too.
        localisation: Whether it is amcl and map_server, too.
        frame_prefix: What the names of the robot's frames begin with.
        fleet: The names of several robots, each with the waypoint where it is at first; none for
            one robot without a name.
        pose: Where that one is at first.
        limits: How to drive.
        progress_timeout: Seconds of simulated time.
        faults: A file of faults, or its content; None for no faults.
    """

    map: Path
    waypoints: Path
    world: Path
    physics: str
    speed: float
    clock: bool
    navigation: bool
    localisation: bool
    frame_prefix: str
    fleet: Dict[str, str]
    pose: Pose
    limits: Limits
    progress_timeout: float
    faults: Union[Path, Mapping[str, Any], None]


def read_settings() -> Settings:
    """Reads the node's parameters.

    Raises:
        ParameterError: One is wrong; the message names it.
    """
    prefix, fleet = _prefix(), _fleet()
    if prefix and fleet:
        raise parameters.wrong("frame_prefix", "leave it out: each of ~fleet has its own name's")
    packages = rospkg.RosPack()
    here = Path(packages.get_path("rosoclingo_simulator"))
    interfaces = Path(packages.get_path("rosoclingo_interfaces"))
    physics = parameters.text("physics", PHYSICS_KINDS[0])
    if physics not in PHYSICS_KINDS:
        raise parameters.wrong("physics", f"expected {' or '.join(PHYSICS_KINDS)}: {physics}")
    return Settings(
        map=Path(parameters.text("map", str(here / "maps" / "office.yaml"))),
        waypoints=Path(parameters.text("waypoints", str(interfaces / "config" / "graph_wg.yaml"))),
        world=Path(parameters.text("world", str(here / "worlds" / "office.xml"))),
        physics=physics,
        speed=_speed(),
        clock=parameters.flag("clock", True),
        navigation=parameters.flag("navigation", True),
        localisation=parameters.flag("localisation", True),
        frame_prefix=prefix,
        fleet=fleet,
        pose=_pose(),
        limits=Limits(
            speed=parameters.positive("max_speed", LINEAR_SPEED, LINEAR_SPEED),
            xy_tolerance=parameters.positive("xy_tolerance", Limits.xy_tolerance),
            yaw_tolerance=parameters.positive("yaw_tolerance", Limits.yaw_tolerance),
        ),
        progress_timeout=parameters.positive("progress_timeout", 10.0),
        faults=_faults(),
    )


def parse_pose(text: str) -> Pose:
    """Reads a pose in the manual's format, such as ``-y -8 -x 7 -z 0 -R 0 -P 0 -Y 0``.

    What is not there is as in ``DEFAULT_POSE``, and of equal options the last one counts. The
    height and the angles ``R`` and ``P`` mean nothing here.

    Raises:
        ValueError: It is something else.
    """
    if _OPTION.sub("", text).strip():
        raise ValueError(f"expected a text such as {DEFAULT_POSE!r}: {text!r}")
    values: Dict[str, float] = {}
    for name, value in _OPTION.findall(f"{DEFAULT_POSE} {text}"):
        try:
            values[name] = float(value)
        except ValueError:
            values[name] = math.nan
        if not math.isfinite(values[name]):
            raise ValueError(f"expected a number after -{name}: {value!r}")
    return Pose(values["x"], values["y"], values["Y"])


def _pose() -> Pose:
    try:
        pose = parse_pose(parameters.text("initial_pose", DEFAULT_POSE))
    except ValueError as err:
        raise parameters.wrong("initial_pose", err) from err
    x, y, yaw = (
        parameters.number(name, default, least=-math.inf)
        for name, default in (("x", pose.x), ("y", pose.y), ("yaw", pose.theta))
    )
    return Pose(x, y, yaw)


def _speed() -> float:
    speed = parameters.number("speed", 1.0)
    if speed < LEAST_SPEED:
        raise parameters.wrong(
            "speed",
            f"expected a number from {LEAST_SPEED:g} on: {speed:g}; with less, the clock stands "
            "still for seconds, and others take it for dead",
        )
    return speed


def _fleet() -> Dict[str, str]:
    """Returns where the robots are at first, by their names."""
    robots: Dict[str, str] = {}
    for word in parameters.words("fleet"):
        name, at, waypoint = word.partition("@")
        if not (_NAME.fullmatch(name) and at and waypoint) or name in robots:
            raise parameters.wrong(
                "fleet",
                "expected different names, of letters, digits and underscores, with waypoints, "
                f"such as robot1@open1 robot2@c5: {word}",
            )
        robots[name] = waypoint
    return robots


def _faults() -> Union[Path, Mapping[str, Any], None]:
    """Returns a file of faults, or its content as a mapping on the parameter server."""
    content = rospy.get_param("~faults", "")
    if isinstance(content, dict):
        return content
    file = parameters.text("faults", "")
    return Path(file).expanduser() if file else None


def _prefix() -> str:
    """Returns what comes before a frame's name: ``robot1`` and ``robot1/`` mean the same."""
    prefix = parameters.text("frame_prefix", "").strip("/")
    if any(letter.isspace() for letter in prefix):
        raise parameters.wrong(
            "frame_prefix", f"expected a name without blanks, such as robot1: {prefix!r}"
        )
    return f"{prefix}/" if prefix else ""
