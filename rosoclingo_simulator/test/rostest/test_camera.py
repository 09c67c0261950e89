"""The camera's topics: what they say fits each other, the laser and the frames."""

from __future__ import annotations

import sys
import unittest
from typing import Any, Dict, List

import numpy as np
import rospy
import rostest
from sensor_msgs.msg import CameraInfo, Image, LaserScan
from tf2_msgs.msg import TFMessage
from waiting import wait_for

from rosclingo.ros.low_latency import subscriber

WIDTH, HEIGHT, PERIOD = 80, 60, 0.25  # as in the launch file: pixels, and seconds
STEP = 0.05  # s, of the simulation
FRAMES = {"rgb": "camera_rgb_optical_frame", "depth": "camera_depth_optical_frame"}


class TestCamera(unittest.TestCase):
    def setUp(self) -> None:
        self.heard: Dict[str, List[Any]] = {}
        self.topics = [
            self.listen(f"camera/{kind}/{name}", its_type)
            for kind in FRAMES
            for name, its_type in (("image_raw", Image), ("camera_info", CameraInfo))
        ]
        self.topics += [self.listen("scan", LaserScan), self.listen("/tf_static", TFMessage)]
        wait_for(lambda: all(len(heard) >= 3 for heard in self.pictures()))
        wait_for(lambda: self.heard["scan"] and self.heard["/tf_static"])

    def tearDown(self) -> None:
        for topic in self.topics:
            topic.unregister()

    def listen(self, name: str, its_type: Any) -> rospy.Subscriber:
        heard = self.heard[name] = []
        return subscriber(name, its_type, heard.append)

    def pictures(self) -> List[List[Any]]:
        return [heard for name, heard in self.heard.items() if name.startswith("camera")]

    def test_pictures_and_infos_fit(self) -> None:
        for kind, frame in FRAMES.items():
            image, info = (
                self.heard[f"camera/{kind}/{name}"][0] for name in ("image_raw", "camera_info")
            )
            for message in (image, info):
                self.assertEqual(message.header.frame_id, frame)
                self.assertEqual((message.width, message.height), (WIDTH, HEIGHT))
            self.assertEqual(len(image.data), image.step * HEIGHT)
            # 45 degrees high.
            self.assertAlmostEqual(info.K[4], HEIGHT / 2 / np.tan(np.radians(22.5)), places=3)
            self.assertEqual(list(info.P[:3]) + list(info.P[4:7]), list(info.K[:6]))

    def test_depth_fits_the_laser(self) -> None:
        image = self.heard["camera/depth/image_raw"][0]
        self.assertEqual(image.encoding, "32FC1")
        depth = np.frombuffer(image.data, np.float32).reshape(HEIGHT, WIDTH)
        scan = self.heard["scan"][0]
        ahead = scan.ranges[round(-scan.angle_min / scan.angle_increment)]
        place = self.place("base_link", FRAMES["depth"])
        self.assertLess(ahead, 9.0)
        self.assertAlmostEqual(depth[HEIGHT // 2, WIDTH // 2], ahead - place.x, delta=0.03)

    def test_color_has_colors(self) -> None:
        image = self.heard["camera/rgb/image_raw"][0]
        self.assertEqual((image.encoding, image.step), ("rgb8", 3 * WIDTH))
        pixels = np.frombuffer(image.data, np.uint8).reshape(HEIGHT, WIDTH, 3)
        self.assertGreater(len(np.unique(pixels.reshape(-1, 3), axis=0)), 2)

    def test_the_rate_is_that_of_simulated_time(self) -> None:
        stamps = [image.header.stamp.to_sec() for image in self.heard["camera/rgb/image_raw"]]
        for gap in np.diff(stamps):
            self.assertGreaterEqual(gap, PERIOD - STEP / 2)

    def test_the_frames_are_at_the_robot(self) -> None:
        for frame in FRAMES.values():
            base, place = self.place("base_footprint", "base_link"), self.place("base_link", frame)
            self.assertAlmostEqual(base.z + place.z, 0.36)  # m, above the floor
            rotation = self.mounted("base_link", frame).rotation
            # The z-axis leads ahead, the x-axis to the right.
            for part, expected in zip("xyzw", (-0.5, 0.5, -0.5, 0.5)):
                self.assertAlmostEqual(getattr(rotation, part), expected, places=6)

    def mounted(self, on: str, frame: str) -> Any:
        """Returns where a frame is on another, which is above it in the tree."""
        (transform,) = (
            item.transform
            for message in self.heard["/tf_static"]
            for item in message.transforms
            if (item.header.frame_id, item.child_frame_id) == (on, frame)
        )
        return transform

    def place(self, on: str, frame: str) -> Any:
        return self.mounted(on, frame).translation


if __name__ == "__main__":
    rospy.init_node("test_camera")
    rostest.rosrun("rosoclingo_simulator", "camera", TestCamera, sys.argv)
