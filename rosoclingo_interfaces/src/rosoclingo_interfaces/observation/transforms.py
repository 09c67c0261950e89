"""Transforms between frames, from ``/tf`` and ``/tf_static``. Needs no ROS.

>>> from types import SimpleNamespace
>>> robot = SimpleNamespace(
...     header=SimpleNamespace(frame_id="map"),
...     child_frame_id="base_link",
...     transform=SimpleNamespace(
...         translation=SimpleNamespace(x=2.0, y=1.0, z=0.0),
...         rotation=SimpleNamespace(x=0.0, y=0.0, z=0.0, w=1.0),
...     ),
... )
>>> tree = TransformTree()
>>> tree.add(robot)
>>> tree.find("map", "base_link")[:2, 3].tolist()
[2.0, 1.0]
"""

from __future__ import annotations

import math
from typing import Any, Dict, List, Tuple

import numpy as np

from rosoclingo_interfaces.errors import ReadingError

Transform = Any
"""A 4 x 4 matrix of NumPy's: a rotation, and a translation in metres."""

MOST_FRAMES = 10_000
"""A tree does not grow larger, whatever is told."""

_FARTHEST = 1e9  # metres; nothing on earth is farther away
_SHORTEST_QUATERNION = 0.5  # shorter ones have no direction that anybody meant; they should be 1


class TransformTree:
    """The last transform of each frame to the frame above it. Not thread-safe.

    Attributes:
        changes: How many transforms have come.
    """

    def __init__(self) -> None:
        """Begins without frames."""
        self.changes = 0
        self._above: Dict[str, Tuple[str, Transform]] = {}

    def add(self, stamped: Any) -> None:
        """Takes the transform of a message ``geometry_msgs/TransformStamped``.

        Raises:
            ReadingError: It is none, or there are too many frames.
        """
        frame, child = plain(stamped.header.frame_id), plain(stamped.child_frame_id)
        if not frame or not child or frame == child:
            raise ReadingError(f"a transform from {frame[:80]!r} to {child[:80]!r} is none")
        if child not in self._above and len(self._above) >= MOST_FRAMES:
            raise ReadingError(f"there are more than {MOST_FRAMES} frames")
        self._above[child] = (
            frame,
            to_matrix(stamped.transform.translation, stamped.transform.rotation),
        )
        self.changes += 1

    def find(self, target: str, source: str) -> Transform:
        """Returns the matrix that transforms coordinates of one frame into another.

        Args:
            target: The frame of the result, such as ``map``.
            source: The frame of the coordinates, such as ``base_link``.

        Raises:
            ReadingError: A transform between the frames is missing.
        """
        target, source = plain(target), plain(source)
        to_target = dict(self._chain(target))
        for frame, matrix in self._chain(source):
            if frame in to_target:
                return np.linalg.inv(to_target[frame]) @ matrix
        raise ReadingError(f"no transform from {source[:80]!r} to {target[:80]!r} has come on /tf")

    def _chain(self, frame: str) -> List[Tuple[str, Transform]]:
        """Returns the frames from one to the top, each with the transform of the first to it."""
        matrix = np.eye(4)
        chain = {frame: matrix}
        while frame in self._above:
            frame, step = self._above[frame]
            if frame in chain:
                raise ReadingError(f"the transforms of the frame {frame[:80]!r} go in a circle")
            matrix = step @ matrix
            chain[frame] = matrix
        return list(chain.items())


def plain(frame: str) -> str:
    """Strips the leading slash that old nodes write before a frame's name."""
    return frame[1:] if frame.startswith("/") else frame


def to_matrix(translation: Any, rotation: Any) -> Transform:
    """Returns the transform of a translation, in metres, and a quaternion.

    Raises:
        ReadingError: A number is none, or the quaternion has no length.
    """
    x, y, z, w = (float(part) for part in (rotation.x, rotation.y, rotation.z, rotation.w))
    length = math.sqrt(x * x + y * y + z * z + w * w)
    place = [float(part) for part in (translation.x, translation.y, translation.z)]
    if not (math.isfinite(length) and all(abs(part) <= _FARTHEST for part in place)):
        raise ReadingError(
            f"a pose or a transform is nowhere: {place}, ({x:g}, {y:g}, {z:g}, {w:g})"
        )
    if length < _SHORTEST_QUATERNION:
        raise ReadingError(f"a quaternion has the length {length:g}, and should have 1")
    x, y, z, w = x / length, y / length, z / length, w / length
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, 3] = place
    return matrix
