"""The paper's three scenarios with ROS's own navigation, where it is installed."""

from __future__ import annotations

import subprocess
import sys
import unittest
from pathlib import Path

import rospkg
import rospy
import rostest

from rosoclingo_gazebo.ros.navigation_check import LOCALISATION, NAVIGATION, missing, plugins

TIMEOUT = 700.0  # seconds for a scenario; no more than a bound for what never comes
SYSTEMS = ("single", "recording", "dyn_reset")


class TestRealNavigation(unittest.TestCase):
    def setUp(self) -> None:
        config = Path(rospkg.RosPack().get_path("rosoclingo_gazebo")) / "config" / "navigation"
        lacking = missing((*LOCALISATION, *NAVIGATION), plugins(config))
        if lacking:
            reason = f"left out: these packages are not there: {', '.join(lacking)}"
            # The summary of rostest counts what was skipped among what has passed: say it twice, on
            # the terminal and in the file with the results.
            rospy.logwarn("%s: SKIPPED, %s", self.id(), reason)
            print(f"{self.id()}: SKIPPED, {reason}")
            self.skipTest(reason)

    def drive(self, scenario: int) -> None:
        """Runs the scenario's test with each system, on masters of their own."""
        for system in SYSTEMS:
            done = subprocess.run(
                ["rostest", "rosoclingo_gazebo", "driving.rostest", "navigation:=real",
                 f"scenario:={scenario}", f"system:={system}"],
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                timeout=TIMEOUT,
                check=False,
            )  # fmt: skip
            print(done.stdout)
            self.assertEqual(done.returncode, 0, done.stdout)

    def test_scenario_1(self) -> None:
        self.drive(1)

    def test_scenario_2(self) -> None:
        self.drive(2)

    def test_scenario_3(self) -> None:
        self.drive(3)


if __name__ == "__main__":
    rospy.init_node("test_real_navigation")
    rostest.rosrun("rosoclingo_gazebo", "test_real_navigation", TestRealNavigation, sys.argv)
