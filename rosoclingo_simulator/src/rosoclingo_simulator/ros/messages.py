"""Converts the simulator's values to ROS's messages and back."""

from __future__ import annotations

import array
import math
from typing import Any, Optional, Tuple

import numpy as np
import rospy
from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TransformStamped, Twist
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header

from rosoclingo_simulator.navigation.simulation import SCAN_SECONDS
from rosoclingo_simulator.physics.laser import ANGLES, LEAST_METRES, MOST_METRES, Scan
from rosoclingo_simulator.physics.occupancy import OccupancyMap
from rosoclingo_simulator.physics.physics import LASER_HEIGHT, Pose, normal_angle

MAP = "map"
"""The frame that all robots share."""

BASE_HEIGHT = 0.01
"""Of ``base_link`` above the floor, in metres."""

_UNIT_ERROR = 1e-2  # of a quaternion's length
_VARIANCE = 1e-4  # m² and rad²; the simulator knows where the robot is, but filters divide by it
_UNSURE_VARIANCE = 1.0  # m² and rad², of a robot that knows that it is lost


class RobotNames:
    """The names of a robot's topics and frames.

    Attributes:
        robot: Its own name; empty for the only one of a node.
        prefix: What the frames begin with, such as ``robot1/``; may be empty.
        odom: Where the robot was at first, by its wheels.
        footprint: The robot, on the floor.
        base: The robot.
        laser: The laser on the robot.
    """

    def __init__(self, robot: str, prefix: str) -> None:
        self.robot = robot
        self.prefix = prefix
        self.odom = f"{prefix}odom"
        self.footprint = f"{prefix}base_footprint"
        self.base = f"{prefix}base_link"
        self.laser = f"{prefix}base_scan"

    def topic(self, name: str) -> str:
        """Returns the name of a topic, service or action of the robot."""
        if not self.robot:
            return name
        return f"~{self.robot}/{name[1:]}" if name.startswith("~") else f"{self.robot}/{name}"

    def camera(self, kind: str) -> str:
        """Returns the frame of a camera's pictures of a kind, ``rgb`` or ``depth``."""
        return f"{self.prefix}camera_{kind}_optical_frame"


class MessageError(ValueError):
    """An invalid message; says why."""


def pose_from(message: PoseStamped) -> Pose:
    """Returns a pose on the floor.

    Raises:
        MessageError: It is in another frame, or is no pose.
    """
    frame = message.header.frame_id.lstrip("/")
    if frame != MAP:
        raise MessageError(f"expected a pose in the frame {MAP}: {frame or 'no frame'}")
    place, turn = message.pose.position, message.pose.orientation
    values = (place.x, place.y, turn.x, turn.y, turn.z, turn.w)
    if not all(map(math.isfinite, values)):
        raise MessageError(f"expected numbers in a pose: {values}")
    length = math.hypot(math.hypot(turn.x, turn.y), math.hypot(turn.z, turn.w))
    if abs(length - 1) > _UNIT_ERROR or math.hypot(turn.x, turn.y) > _UNIT_ERROR:
        raise MessageError(
            "expected an orientation about the z axis, such as z: 0, w: 1: "
            f"x: {turn.x:g}, y: {turn.y:g}, z: {turn.z:g}, w: {turn.w:g}"
        )
    return Pose(place.x, place.y, normal_angle(2 * math.atan2(turn.z, turn.w)))


def command_from(message: Twist) -> Tuple[float, float]:
    """Returns wanted speed and speed of turning, in m/s and rad/s.

    Raises:
        MessageError: They are no numbers.
    """
    command = message.linear.x, message.angular.z
    if not all(map(math.isfinite, command)):
        raise MessageError(f"expected numbers as speeds: {command}")
    return command


def pose_message(pose: Pose) -> PoseMessage:
    """Returns a pose."""
    message = PoseMessage()
    set_pose(message, pose)
    return message


def set_pose(message: Any, pose: Pose) -> None:
    """Writes a pose into a message."""
    message.position.x, message.position.y = pose.x, pose.y
    message.orientation.z = math.sin(pose.theta / 2)
    message.orientation.w = math.cos(pose.theta / 2)


def stamped(pose: Pose, stamp: rospy.Time) -> PoseStamped:
    """Returns a pose in the map."""
    return PoseStamped(Header(stamp=stamp, frame_id=MAP), pose_message(pose))


def estimate(pose: Pose, stamp: rospy.Time, unsure: bool = False) -> PoseWithCovarianceStamped:
    """Returns a pose as localisation has it, which may know that it is lost."""
    message = PoseWithCovarianceStamped(header=Header(stamp=stamp, frame_id=MAP))
    set_pose(message.pose.pose, pose)
    for index in (0, 7, 35):  # x, y and the angle about z, in a matrix of six by six
        message.pose.covariance[index] = _UNSURE_VARIANCE if unsure else _VARIANCE
    return message


def odometry(frame: str, robot: str) -> Odometry:
    """Returns a message about a robot in a frame, to be filled by :func:`set_odometry`."""
    return Odometry(header=Header(frame_id=frame), child_frame_id=robot)


def set_odometry(
    message: Odometry, pose: Pose, velocity: Tuple[float, float], stamp: rospy.Time
) -> None:
    """Writes where the robot is and how it moves into a message."""
    message.header.stamp = stamp
    set_pose(message.pose.pose, pose)
    message.twist.twist.linear.x, message.twist.twist.angular.z = velocity


def transform(parent: str, child: str, pose: Pose, height: float = 0.0) -> TransformStamped:
    """Returns the transform between two frames."""
    message = TransformStamped(header=Header(frame_id=parent), child_frame_id=child)
    set_transform(message, pose)
    message.transform.translation.z = height
    return message


def set_transform(message: TransformStamped, pose: Pose) -> None:
    """Writes where a frame is into a message."""
    place, turn = message.transform.translation, message.transform.rotation
    place.x, place.y = pose.x, pose.y
    turn.z, turn.w = math.sin(pose.theta / 2), math.cos(pose.theta / 2)


def robot_transforms(names: RobotNames) -> Tuple[TransformStamped, ...]:
    """Returns where the parts of the robot are."""
    here = Pose(0.0, 0.0, 0.0)
    return (
        transform(names.footprint, names.base, here, BASE_HEIGHT),
        transform(names.base, names.laser, here, LASER_HEIGHT - BASE_HEIGHT),
    )


def scan_message(scan: Scan, frame: str, stamp: rospy.Time) -> LaserScan:
    """Converts a scan to a message, with its frame and time."""
    return LaserScan(
        header=Header(stamp=stamp, frame_id=frame),
        angle_min=float(ANGLES[0]),
        angle_max=float(ANGLES[-1]),
        angle_increment=float(ANGLES[1] - ANGLES[0]),
        scan_time=SCAN_SECONDS,
        range_min=LEAST_METRES,
        range_max=MOST_METRES,
        ranges=scan.ranges.tolist(),
    )


def path_message(path: Optional[np.ndarray], end: Pose, stamp: rospy.Time) -> Path:
    """Returns a path, or an empty one; points look along it, and the last one as the goal does."""
    message = Path(header=Header(stamp=stamp, frame_id=MAP))
    if path is not None:
        steps = np.diff(path, axis=0)
        angles = [*np.arctan2(steps[:, 1], steps[:, 0]).tolist(), end.theta]
        points: Any = path.tolist()  # NumPy 2.2 takes it for a text
        message.poses = [stamped(Pose(x, y, angle), stamp) for (x, y), angle in zip(points, angles)]
    return message


def map_message(world: OccupancyMap) -> OccupancyGrid:
    """Returns the map."""
    message = OccupancyGrid(header=Header(frame_id=MAP))
    message.info.resolution = world.grid.resolution
    message.info.height, message.info.width = world.cells.shape
    message.info.origin = pose_message(Pose(world.grid.x, world.grid.y, 0.0))
    message.data = array.array("b", world.cells.tobytes())
    return message
