"""The interface of move_base: the test is the planner, the navigation and the clock."""

from __future__ import annotations

import contextlib
import math
import os
import queue
import signal
import subprocess
import sys
import threading
import unittest
from pathlib import Path
from typing import Iterator, List

import rosnode
import rospy
import rostest
from actionlib import ServerGoalHandle
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from rosgraph_msgs.msg import Clock, Log
from waiting import TIMEOUT, wait_for

from navigation import Navigation, is_at
from planner import Planner


class Ticker:
    """A clock that runs ten times as fast as the wall's, jumps, and stops."""

    def __init__(self) -> None:
        self.runs = True
        self._now = 1000.0  # seconds
        self._clock = rospy.Publisher("/clock", Clock, queue_size=10)
        threading.Thread(target=self._tick, daemon=True).start()

    def _tick(self) -> None:
        pause = threading.Event()
        with contextlib.suppress(rospy.ROSException):  # the test has ended
            while not pause.wait(0.01):
                if self.runs:
                    self.jump(0.1)

    def jump(self, seconds: float) -> None:
        self._now += seconds
        self._clock.publish(rospy.Time.from_sec(self._now))


class TestNavigation(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.ticker = Ticker()
        wait_for(lambda: rospy.get_time() > 0)  # the clock has come here too
        cls.log: List[str] = []
        cls.listener = rospy.Subscriber("/rosout", Log, lambda message: cls.log.append(message.msg))
        cls.navigation = Navigation("/a/move_base")
        cls.planner = Planner("/a/rosoclingo")

    def setUp(self) -> None:
        del self.log[:]

    def tearDown(self) -> None:
        """Nothing more comes than what a test has taken."""
        self.assertEqual(self.planner.answers, [])
        for entries in (
            self.navigation.goals, self.navigation.canceled, self.navigation.cleared,
        ):  # fmt: skip
            self.assertTrue(entries.empty())

    def drive(self, waypoint: str = "c3") -> ServerGoalHandle:
        self.planner.send("mailbot", f"go({waypoint})")
        return self.navigation.goals.get(timeout=TIMEOUT)

    def check_failure(self, planner: Planner, reason: str) -> None:
        self.assertEqual(planner.next(), ("mailbot", "failure"))
        wait_for(lambda: any(reason in line for line in self.log))

    def check_stop(self, goal: ServerGoalHandle) -> None:
        self.assertEqual(self.navigation.canceled.get(timeout=TIMEOUT), goal.get_goal_id().id)
        self.navigation.cleared.get(timeout=TIMEOUT)

    def test_success(self) -> None:
        goal = self.drive()
        target = goal.get_goal().target_pose
        self.assertEqual(target.header.frame_id, "map")
        self.assertEqual((target.pose.position.x, target.pose.position.y), (10.0, 0.0))
        turn = target.pose.orientation
        self.assertAlmostEqual(2 * math.atan2(turn.z, turn.w), 1.0)
        self.assertEqual((turn.x, turn.y), (0.0, 0.0))
        goal.set_succeeded()
        self.assertEqual(self.planner.next(), ("mailbot", "success"))

    def test_abort(self) -> None:
        self.drive("c(4)").set_aborted(text="no way")
        self.check_failure(self.planner, "/a/move_base ended the drive as ABORTED: no way")
        self.navigation.cleared.get(timeout=TIMEOUT)

    def test_a_server_that_says_that_it_ends(self) -> None:
        """No way is blocked because of that."""
        self.drive("c3").set_succeeded()
        self.assertEqual(self.planner.next(), ("mailbot", "success"))
        said = "Aborting on the goal because the node has been killed"
        self.drive("c(4)").set_aborted(text=said)
        self.check_failure(self.planner, said)
        self.assertEqual(self.planner.next(), ("info", "unblocked(c3,c(4))"))
        self.navigation.cleared.get(timeout=TIMEOUT)

    def test_replacement(self) -> None:
        first = self.drive("c3")
        second = self.drive("c(4)")
        self.check_stop(first)
        second.set_succeeded()
        self.assertEqual(self.planner.next(), ("mailbot", "success"))

    def test_another_client_takes_the_base(self) -> None:
        self.drive().set_canceled(text="another goal came")
        self.check_failure(self.planner, "PREEMPTED: another goal came")
        self.navigation.cleared.get(timeout=TIMEOUT)

    def test_unknown_waypoint(self) -> None:
        self.planner.send("mailbot", "go(c99)")
        self.check_failure(self.planner, "there is no waypoint c99")
        self.assertTrue(any("there are c3, c(4)" in line for line in self.log))

    def test_time_limit_by_the_length_of_the_drive(self) -> None:
        goal = self.drive()
        is_at(goal, 0.0, 0.0)
        self.wait_for_ticks(5)  # so that the position is looked at
        self.ticker.jump(81.0)
        self.check_failure(self.planner, "the 10.0 m to c3 have taken more than 80 s")
        self.check_stop(goal)

    def test_time_limit_for_all_drives(self) -> None:
        navigation, planner = Navigation("/e/move_base"), Planner("/e/rosoclingo")
        planner.send("mailbot", "go(c3)")
        goal = navigation.goals.get(timeout=TIMEOUT)
        self.ticker.jump(201.0)
        self.check_failure(planner, "no answer within 200 s (~timeout)")
        self.assertEqual(navigation.canceled.get(timeout=TIMEOUT), goal.get_goal_id().id)
        navigation.cleared.get(timeout=TIMEOUT)

    def test_stray(self) -> None:
        goal = self.drive()
        for x, y in ((0.0, 1.0), (4.0, -1.0), (5.0, 2.9), (5.0, 4.1)):
            self.assertTrue(self.navigation.canceled.empty())
            is_at(goal, x, y)
        self.check_failure(self.planner, "3.6 m off the way to c3, more than 3 m (~max_stray)")
        self.check_stop(goal)

    def wait_for_ticks(self, seconds: float) -> None:
        """Waits some time of the clock, of which ten seconds are a second of the wall's."""
        end = rospy.get_time() + seconds
        wait_for(lambda: rospy.get_time() > end)

    def test_back_to_the_last_waypoint(self) -> None:
        self.drive("c3").set_succeeded()
        self.assertEqual(self.planner.next(), ("mailbot", "success"))
        goal = self.drive("c(4)")
        for x, y in ((2.0, 0.0), (6.0, 0.0), (10.0, 0.0), (10.0, -4.0)):
            is_at(goal, x, y)
        self.wait_for_ticks(5)  # so that the positions are looked at before the end comes
        goal.set_succeeded()
        self.assertEqual(self.planner.next(), ("mailbot", "success"))

    def test_other_actions(self) -> None:
        for action in ("pickup(1)", "deliver(1)", "fly"):
            self.planner.send("mailbot", action)
        self.test_success()
        # One that is another node's ends the drive all the same.
        goal = self.drive()
        self.planner.send("mailbot", "pickup(1)")
        self.check_stop(goal)

    def test_a_clock_that_stands_still(self) -> None:
        self.drive("c(4)").set_succeeded()
        self.assertEqual(self.planner.next(), ("mailbot", "success"))
        goal = self.drive("c3")
        self.ticker.runs = False
        try:
            self.check_failure(self.planner, "the clock has stood still for 5 s")
            self.check_stop(goal)
            self.assertEqual(self.planner.answers, [])
        finally:
            self.ticker.runs = True
        self.assertEqual(self.planner.next(), ("info", "unblocked(c(4),c3)"))

    def test_a_clock_that_begins_anew(self) -> None:
        """A wait goes on from there: the time limit holds, and no sooner."""
        goal = self.drive()
        self.ticker.jump(1.0 - rospy.get_time())
        wait_for(lambda: rospy.get_time() < 100.0)
        self.wait_for_ticks(2)  # until the node has seen it
        # From the farthest waypoint: the robot has not said where it is.
        self.ticker.jump(71.0)
        self.check_failure(self.planner, "the 8.0 m to c3 have taken more than 70 s")
        self.check_stop(goal)

    def test_no_server(self) -> None:
        planner = Planner("/c/rosoclingo")
        planner.send("mailbot", "go(c3)")
        self.assertEqual(planner.next(), ("mailbot", "failure"))

    def test_servers_that_come_late_and_end(self) -> None:
        planner = Planner("/b/rosoclingo")
        planner.send("mailbot", "go(c3)")
        wait_for(lambda: any("waiting for the action /b/move_base" in line for line in self.log))
        with server("/b") as process:
            self.wait_for_drive("/b")
            process.kill()
            self.check_failure(planner, "/b/move_base went away during the drive")
        planner.send("mailbot", "go(c(4))")
        with server("/b") as process:
            self.assertEqual(planner.next(), ("info", "unblocked(c(4),c3)"))
            self.wait_for_drive("/b")
            process.send_signal(signal.SIGSTOP)
            self.check_failure(planner, "/b/move_base has sent no status for 5 s")
        self.assertEqual(planner.answers, [])  # for the way from c(4) to c(4) is none

    def wait_for_drive(self, namespace: str) -> None:
        topic = f"{namespace}/move_base/status"
        statuses: queue.Queue[int] = queue.Queue()
        listener = rospy.Subscriber(
            topic,
            GoalStatusArray,
            lambda message: [statuses.put(goal.status) for goal in message.status_list],
        )
        while statuses.get(timeout=TIMEOUT) != GoalStatus.ACTIVE:
            pass
        listener.unregister()

    def test_the_end_of_the_node(self) -> None:
        """The robot stops."""
        navigation, planner = Navigation("/d/move_base"), Planner("/d/rosoclingo")
        planner.send("mailbot", "go(c3)")
        goal = navigation.goals.get(timeout=TIMEOUT)
        rosnode.kill_nodes(["/d/move_base_interface"])
        self.assertEqual(navigation.canceled.get(timeout=TIMEOUT), goal.get_goal_id().id)
        navigation.cleared.get(timeout=TIMEOUT)


@contextlib.contextmanager
def server(namespace: str) -> Iterator[subprocess.Popen[bytes]]:
    """Runs a navigation of its own."""
    process = subprocess.Popen(
        [sys.executable, str(Path(__file__).with_name("navigation.py"))],
        env={**os.environ, "ROS_NAMESPACE": namespace},
    )
    try:
        yield process
    finally:
        process.kill()
        process.wait()


if __name__ == "__main__":
    rospy.init_node("test_navigation")
    rostest.rosrun("rosoclingo_interfaces", "test_navigation", TestNavigation, sys.argv)
