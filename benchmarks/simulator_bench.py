"""Measures how much of a core the simulator takes, and how fast simulated time can go.

    python benchmarks/simulator_bench.py

The robot drives through the office all the time, with subscribers to its laser, its odometry
and its transforms.
"""

from __future__ import annotations

import itertools
import statistics
import sys
import time
from typing import List, Optional

import rospy
from actionlib import ClientGoalHandle, CommState
from actionlib_msgs.msg import GoalStatus
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage

from harness import HarnessError, Report, RosSystem, Row, Samples, processor_seconds
from rosclingo.ros.action_client import LowLatencyActionClient
from rosclingo.ros.low_latency import subscriber

SAMPLES = 20
SAMPLE_SECONDS = 1.0  # of wall time
_WARM_UP_SECONDS = 3.0
_TIMEOUT_SECONDS = 30.0
_POLL_SECONDS = 0.05

CORE_PERCENT = 15.0  # limit at real time, with the kinematic physics
SLOWNESS = 1.05  # limit of how much slower simulated time goes than it should

# Two corners of the office's loop, far from each other.
CORNERS = ((32.0, -8.0), (15.0, -17.0))


class Driver:
    """Sends the robot back and forth, and subscribes to its sensors."""

    def __init__(self) -> None:
        """Opens the connections to the simulator."""
        self.time = 0.0  # simulated
        self._client = LowLatencyActionClient("move_base", MoveBaseAction)
        self._corners = itertools.cycle(CORNERS)
        self._handle: Optional[ClientGoalHandle] = None
        self._listeners = [
            subscriber("/clock", Clock, self._on_clock),
            subscriber("/scan", LaserScan),
            subscriber("/odom", Odometry),
            subscriber("/tf", TFMessage),
        ]

    def wait(self) -> None:
        """Waits until the simulator is there.

        Raises:
            HarnessError: It did not come.
        """
        end = time.monotonic() + _TIMEOUT_SECONDS
        while not (self._client.wait_for_server(rospy.Duration(nsecs=1)) and self.time):
            if time.monotonic() > end:
                raise HarnessError("the simulator did not start")
            time.sleep(_POLL_SECONDS)

    def drive(self, seconds: float) -> None:
        """Drives the robot all the time.

        Args:
            seconds: How long, of wall time.

        Raises:
            HarnessError: It does not get to where it should.
        """
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if self._handle is None or self._handle.get_comm_state() == CommState.DONE:
                if self._handle is not None:
                    self._check(self._handle)
                self._go()
            time.sleep(_POLL_SECONDS)

    def close(self) -> None:
        """Closes the connections; the simulator may end then."""
        for listener in self._listeners:
            listener.unregister()
        self._client.stop()

    def _check(self, handle: ClientGoalHandle) -> None:
        if handle.get_terminal_state() != GoalStatus.SUCCEEDED:
            raise HarnessError(f"a drive did not succeed: {handle.get_goal_status_text()}")

    def _go(self) -> None:
        goal = MoveBaseGoal()
        goal.target_pose.header.frame_id = "map"
        place = goal.target_pose.pose
        place.position.x, place.position.y = next(self._corners)
        place.orientation.w = 1.0
        self._handle = self._client.send_goal(goal)

    def _on_clock(self, message: Clock) -> None:
        self.time = message.clock.to_sec()


def measure(system: RosSystem, report: Report, physics: str, speed: float, drives: bool) -> None:
    """Measures a simulator of its own.

    Args:
        system: Where it runs.
        report: Where the rows go.
        physics: ``kinematic`` or ``mujoco``.
        speed: Seconds of simulated time in one of wall time.
        drives: Whether the robot drives and is listened to.
    """
    parameters = (f"_physics:={physics}", f"_speed:={speed:g}")
    name = f"simulator_{physics}_{speed:g}_{'drives' if drives else 'stands'}"
    pid = system.rosrun("rosoclingo_simulator", "simulator.py", *parameters, name=name)
    driver = Driver()
    driver.wait()
    spend = driver.drive if drives else time.sleep
    if not drives:
        driver.close()
    spend(_WARM_UP_SECONDS)
    loads: List[float] = []
    slowness: List[float] = []
    for _ in range(SAMPLES):
        begin, used, simulated = time.monotonic(), processor_seconds(pid), driver.time
        spend(SAMPLE_SECONDS)
        passed = time.monotonic() - begin
        loads.append((processor_seconds(pid) - used) / passed * 100)
        slowness.append(passed * speed / max(driver.time - simulated, 1e-9))
    about = f"{physics}, {speed:g} x real time, {'driving' if drives else 'standing'}"
    load = Samples("%", tuple(loads))
    limit = CORE_PERCENT if (physics, speed) == ("kinematic", 1.0) else None
    mean = statistics.mean(loads)
    report.add(Row(f"{about}, of a core", None, load, "mean", mean, "%", limit))
    if drives:
        driver.close()
        slow = Samples("x", tuple(slowness))
        compared = "wanted / reached, median"
        report.add(Row(f"{about}, speed", None, slow, compared, slow.median, "x", SLOWNESS))
    system.end(name)


def main() -> int:
    """Measures, prints the table, and returns the exit status: 1 says that a limit is missed."""
    report = Report("simulator")
    with RosSystem() as system:
        # Before simulated time is asked for: this node goes by wall time.
        rospy.init_node("benchmark", disable_signals=True)
        rospy.set_param("/use_sim_time", True)
        try:
            measure(system, report, "kinematic", 1.0, drives=False)
            for physics in ("kinematic", "mujoco"):
                for speed in (1.0, 10.0):
                    measure(system, report, physics, speed, drives=True)
        finally:
            rospy.signal_shutdown("measured")
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())
