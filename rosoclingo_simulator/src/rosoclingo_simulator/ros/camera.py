"""The robot's depth and colour camera, on ROS's topics."""

from __future__ import annotations

import sys
from typing import Any, Dict, List, Optional

import numpy as np
import rospy
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header

from rosclingo.ros.parameters import integer, number
from rosoclingo_simulator.physics.mujoco.headless import OpenGLError
from rosoclingo_simulator.physics.mujoco.mujoco_physics import MujocoPhysics
from rosoclingo_simulator.physics.mujoco.rendering import Eye, focal_length, mounting
from rosoclingo_simulator.ros.messages import BASE_HEIGHT, RobotNames

_ROUNDING = 1e-6  # seconds, what times may be off
_MOST_PIXELS = 4096  # of a side; what OpenGL allows is seldom less


class CameraPublisher:
    """Publishes the camera's images, as long as there are subscribers.

    All but the constructor and :meth:`transforms` is for one thread, the one that moves the robot.
    """

    def __init__(self, physics: MujocoPhysics, names: RobotNames) -> None:
        """Opens the topics; OpenGL only when the first picture is wanted.

        Args:
            physics: Moves the robot that has the camera.
            names: Those of the robot.

        Raises:
            ParameterError: A parameter has a wrong value.
        """
        rate = number("camera_rate", 5.0)
        self._period = 1 / rate if rate else float("inf")
        self._width = integer("camera_width", 160, _MOST_PIXELS, least=1)
        self._height = integer("camera_height", 120, _MOST_PIXELS, least=1)
        self._physics = physics
        self._base = names.base
        self._eye: Optional[Eye] = None
        self._fails = False
        self._due = 0.0
        self._rgb = _Stream(names.topic("camera/rgb"), names.camera("rgb"), "rgb8")
        self._depth = _Stream(names.topic("camera/depth"), names.camera("depth"), "32FC1")

    def transforms(self) -> List[TransformStamped]:
        """Returns where the camera is on the robot, for ``/tf_static``."""
        (x, y, z), direction = mounting(self._physics)
        mounted = Transform(Vector3(x, y, z - BASE_HEIGHT), Quaternion(*direction))
        return [
            TransformStamped(Header(frame_id=self._base), stream.frame, mounted)
            for stream in (self._rgb, self._depth)
        ]

    def update(self, seconds: float, stamp: rospy.Time) -> None:
        """Publishes images if they are due, and have a subscriber.

        Args:
            seconds: Simulated time since the start.
            stamp: What the clock says.
        """
        wanted = self._rgb.wanted or self._depth.wanted
        if self._fails or not wanted or seconds < self._due - _ROUNDING:
            return
        self._due = seconds + self._period
        try:
            if self._eye is None:
                self._eye = Eye(self._physics, self._width, self._height)
        except OpenGLError as err:
            rospy.logwarn("the camera has no pictures: %s", err)
            self._fails = True
            return
        color, depth = self._eye.look()
        focal = focal_length(self._physics, self._height)
        for stream, picture in ((self._rgb, color), (self._depth, depth)):
            if stream.wanted:
                stream.publish(picture, focal, stamp)

    def close(self) -> None:
        """Gives OpenGL back, when no more pictures are wanted."""
        if self._eye is not None:
            self._eye.close()
            self._eye = None
        self._fails = True


class _Stream:
    """The two topics of one kind of picture.

    Attributes:
        frame: Of the pictures.
    """

    def __init__(self, name: str, frame: str, encoding: str) -> None:
        # A picture that comes late is of no use: none waits for another.
        options: Dict[str, Any] = {"queue_size": 1, "tcp_nodelay": True}
        self._images = rospy.Publisher(f"{name}/image_raw", Image, **options)
        self._infos = rospy.Publisher(f"{name}/camera_info", CameraInfo, **options)
        self.frame = frame
        self._encoding = encoding

    @property
    def wanted(self) -> bool:
        """True if there is a subscriber."""
        return bool(self._images.get_num_connections() or self._infos.get_num_connections())

    def publish(self, picture: np.ndarray, focal: float, stamp: rospy.Time) -> None:
        """Publishes an image with the camera's parameters."""
        height, width = picture.shape[:2]
        image = Image(height=height, width=width, encoding=self._encoding)
        info = CameraInfo(height=height, width=width, distortion_model="plumb_bob")
        for message in (image, info):
            message.header.stamp = stamp
            message.header.frame_id = self.frame
        image.is_bigendian = int(sys.byteorder == "big")
        image.step = picture.itemsize * picture[0].size
        image.data = picture.tobytes()
        x, y = (width - 1) / 2, (height - 1) / 2
        info.D = [0.0] * 5
        info.K = [focal, 0.0, x, 0.0, focal, y, 0.0, 0.0, 1.0]
        info.R = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
        info.P = [focal, 0.0, x, 0.0, 0.0, focal, y, 0.0, 0.0, 0.0, 1.0, 0.0]
        self._images.publish(image)
        self._infos.publish(info)
