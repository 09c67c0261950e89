"""Conditions of observers on the map: the nearest waypoint of a pose. Needs no ROS."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Mapping, Optional, Tuple

from rosoclingo_interfaces.errors import EntryError, ReadingError
from rosoclingo_interfaces.navigation.waypoints import Waypoints
from rosoclingo_interfaces.observation.conditions import Reading
from rosoclingo_interfaces.observation.fields import FieldPath, Slots
from rosoclingo_interfaces.observation.transforms import TransformTree, plain, to_matrix

POSE = "geometry_msgs/Pose"
POSE_FIELDS: Mapping[str, str] = {
    POSE: "",
    "geometry_msgs/PoseStamped": "pose",
    "geometry_msgs/PoseWithCovarianceStamped": "pose.pose",
    "nav_msgs/Odometry": "pose.pose",
}
"""The default field of the pose, by types of messages."""


@dataclass(frozen=True)
class NearestWaypoint:
    """Holds if a robot is at a waypoint, and names it.

    Attributes:
        waypoints: Those that there are.
        within: How far from a waypoint the robot is at it, in metres.
        hysteresis: How much farther it has to be to have left it, and how much nearer to another
            one to be there, in metres.
        transforms: By which poses in other frames are taken to that of the waypoints.
        field: Where the pose is; None for where it is in the usual types.
        child: The robot's frame, if its pose is to be taken from the transforms.
    """

    waypoints: Waypoints
    within: float
    hysteresis: float
    transforms: TransformTree
    field: Optional[FieldPath] = None
    child: str = ""

    def check(self, message: str, slots: Slots) -> None:
        """Checks that a type of messages has a pose.

        Raises:
            EntryError: It has not.
        """
        if self.field is None and message not in POSE_FIELDS:
            raise EntryError(
                f"{message} is none of {', '.join(POSE_FIELDS)}: name the pose in it by field"
            )
        if self.field is not None:
            kind = self.field.kind(message, slots)
            if kind != POSE:
                raise EntryError(
                    f"field: {self.field.text} of {message} is {kind}; {POSE} is needed"
                )

    def read(self, message: Any, before: Reading) -> Reading:
        """Returns the waypoint at which the robot is.

        Args:
            message: With the pose; None to take that from the transforms.
            before: The waypoint where it was.

        Raises:
            ReadingError: It is not known where the robot is.
        """
        x, y = self._position(message)
        places = self.waypoints.places
        distances = {name: math.hypot(x - at.x, y - at.y) for name, at in places.items()}
        nearest = min(distances, key=lambda name: distances[name])
        if before is not None:
            left = distances[before] > self.within + self.hysteresis
            if not left and distances[nearest] > distances[before] - self.hysteresis:
                return before
        return nearest if distances[nearest] <= self.within else None

    def _position(self, message: Any) -> Tuple[float, float]:
        if message is None:
            matrix = self.transforms.find(self.waypoints.frame, self.child)
        else:
            field = self.field
            if field is None:
                field = FieldPath.parse(POSE_FIELDS[message._type])
            (pose,) = field.values(message)
            matrix = to_matrix(pose.position, pose.orientation)
            frame = plain(message.header.frame_id) if hasattr(message, "header") else ""
            if frame and frame != plain(self.waypoints.frame):
                matrix = self.transforms.find(self.waypoints.frame, frame) @ matrix
        x, y = float(matrix[0, 3]), float(matrix[1, 3])
        if not math.isfinite(x + y):
            raise ReadingError(f"the robot is at ({x:g}, {y:g})")
        return x, y
