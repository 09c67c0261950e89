"""The paper's three scenarios with ROS's own navigation, where it is installed."""

from __future__ import annotations

import subprocess
import sys
import unittest

import rospy
import rostest

from rosoclingo_gazebo.navigation.check import LOCALISATION, NAVIGATION, missing

PLUGINS = ("costmap_2d", "navfn", "dwa_local_planner")  # of config/navigation
TIMEOUT = 700.0  # seconds for a scenario; no more than a bound for what never comes


class TestRealNavigation(unittest.TestCase):
    def setUp(self) -> None:
        lacking = missing((*LOCALISATION, *NAVIGATION), PLUGINS)
        if lacking:
            reason = f"left out: these packages are not there: {', '.join(lacking)}"
            # The summary of rostest counts what was skipped among what has passed: say it twice, on
            # the terminal and in the file with the results.
            rospy.logwarn("%s: SKIPPED, %s", self.id(), reason)
            print(f"{self.id()}: SKIPPED, {reason}")
            self.skipTest(reason)

    def drive(self, scenario: int) -> None:
        """Runs the scenario's test, on a master of its own."""
        done = subprocess.run(
            ["rostest", "rosoclingo_gazebo", "driving.rostest", "navigation:=real",
             f"scenario:={scenario}"],
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
