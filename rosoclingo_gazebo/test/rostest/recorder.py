"""Writes down what the robot does and what is said about it."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, Dict, List, Tuple

import rospy
from nav_msgs.msg import Odometry
from std_msgs.msg import Bool

from rosclingo.ros.low_latency import subscriber
from rosoclingo.msg import ROSoClingoIn, ROSoClingoOut


class Recorder:
    """Listens from when it is made. What it has is only added to, by rospy's threads.

    Attributes:
        path: Time in seconds, x and y in metres, and direction in radians, by the ground truth.
        events: Time, kind and text of each.
        touches: What the simulator said of touching a wall or a box.
    """

    def __init__(self) -> None:
        self.path: List[Tuple[float, float, float, float]] = []
        self.events: List[Tuple[float, str, str]] = []
        self.touches: List[bool] = []
        self._topics = [
            subscriber("/ground_truth", Odometry, self._on_ground_truth),
            subscriber(
                "/simulator/touches", Bool, lambda message: self.touches.append(message.data)
            ),
            subscriber("rosoclingo/out", ROSoClingoOut, self._on_out),
            subscriber("rosoclingo/in", ROSoClingoIn, self._on_in),
        ]

    def _on_ground_truth(self, message: Odometry) -> None:
        pose = message.pose.pose
        turn = 2 * math.atan2(pose.orientation.z, pose.orientation.w)
        stamp = message.header.stamp.to_sec()
        self.path.append((stamp, pose.position.x, pose.position.y, turn))

    def _on_out(self, message: ROSoClingoOut) -> None:
        self.add("action", message.action)

    def _on_in(self, message: ROSoClingoIn) -> None:
        self.add("answer" if message.id == "mailbot" else message.id, message.value)

    def add(self, kind: str, text: str) -> None:
        """Adds an event of now."""
        self.events.append((rospy.get_time(), kind, text))

    def texts(self, kind: str) -> List[str]:
        """Returns the texts of all events of a kind."""
        return [text for _, its_kind, text in self.events if its_kind == kind]

    def points(self) -> List[Tuple[float, float]]:
        """Returns the path without times and directions."""
        return [(x, y) for _, x, y, _ in self.path]

    def length(self) -> float:
        """Returns the length of the path, in metres."""
        points = self.points()
        return sum(map(math.dist, points, points[1:]))

    def distance(self, place: Tuple[float, float]) -> float:
        """Returns how far the robot is from a place now, in metres."""
        return math.dist(self.path[-1][1:3], place) if self.path else math.inf

    def save(self, file: Path, about: Dict[str, Any]) -> None:
        """Writes everything as JSON."""
        content = {**about, "path": self.path, "events": self.events}
        file.write_text(json.dumps(content), encoding="utf-8")
