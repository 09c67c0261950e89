"""The simulator's node as a client of navigation sees it."""

from __future__ import annotations

import math
import sys
import threading
import time
import unittest
from typing import Any, Callable, Dict, List, Tuple

import actionlib
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TransformStamped, Twist
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from nav_msgs.msg import MapMetaData, OccupancyGrid, Odometry, Path
from nav_msgs.srv import GetMap, GetPlan
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Bool
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from rosoclingo_simulator.srv import Obstacle

TIMEOUT = 180.0  # seconds of wall time; no more than a bound for what never comes
SPEED = 5.0
START = (7.0, -8.0, 1.0)
EAST = (11.0, -8.0, 0.0)


def pose(place: Tuple[float, float, float], frame: str = "map") -> PoseStamped:
    message = PoseStamped()
    message.header.frame_id = frame
    message.pose.position.x, message.pose.position.y = place[:2]
    message.pose.orientation.z = math.sin(place[2] / 2)
    message.pose.orientation.w = math.cos(place[2] / 2)
    return message


def place(message: Any) -> complex:
    """Returns where a pose is."""
    return complex(message.position.x, message.position.y)


class Listener:
    """Keeps what comes on a topic."""

    def __init__(self, topic: str, kind: Any) -> None:
        self.messages: List[Any] = []
        self._changed = threading.Condition()
        self._subscriber = rospy.Subscriber(topic, kind, self._on_message, tcp_nodelay=True)

    def _on_message(self, message: Any) -> None:
        with self._changed:
            self.messages.append(message)
            self._changed.notify_all()

    def wait(self, condition: Callable[[List[Any]], Any]) -> Any:
        """Waits until the messages meet a condition, and returns the last one."""
        with self._changed:
            assert self._changed.wait_for(
                lambda: self.messages and condition(self.messages), TIMEOUT
            ), f"not on {self._subscriber.resolved_name}"
            return self.messages[-1]

    def close(self) -> None:
        self._subscriber.unregister()


class TestSimulator(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.client = actionlib.SimpleActionClient("move_base", MoveBaseAction)
        # A wait in ROS's time would be none as long as the simulator is not there.
        rospy.wait_for_message("/clock", rospy.AnyMsg, TIMEOUT)
        assert cls.client.wait_for_server(rospy.Duration(TIMEOUT * SPEED))
        cls.truth = Listener("/ground_truth", Odometry)
        cls.touches = Listener("/simulator/touches", Bool)
        cls.obstacle = rospy.ServiceProxy("/simulator/obstacle", Obstacle)
        cls.clear = rospy.ServiceProxy("/move_base/clear_costmaps", Empty)
        cls.plan = rospy.ServiceProxy("/move_base/make_plan", GetPlan)
        for service in (cls.obstacle, cls.clear, cls.plan):
            service.wait_for_service(TIMEOUT)

    def setUp(self) -> None:
        self.clear()
        self.truth.messages.clear()
        self.truth.wait(len)

    def tearDown(self) -> None:
        self.client.cancel_all_goals()
        self.wait_until_standing()
        assert [message.data for message in self.touches.messages] == [False]

    def wait_until_standing(self) -> complex:
        """Waits until the robot has not moved for ten messages, and returns where it is."""
        seen = len(self.truth.messages)

        def stands(messages: List[Odometry]) -> bool:
            last = messages[seen:][-10:]
            return len(last) == 10 and len({place(one.pose.pose) for one in last}) == 1

        return place(self.truth.wait(stands).pose.pose)

    def wait_until_driving(self) -> None:
        self.truth.wait(lambda messages: messages[-1].twist.twist.linear.x > 0.2)

    def go(self, goal: Tuple[float, float, float]) -> Tuple[int, str]:
        """Drives to the end and returns it."""
        self.client.send_goal(MoveBaseGoal(pose(goal)))
        assert self.client.wait_for_result(rospy.Duration(TIMEOUT * SPEED))
        return self.client.get_state(), self.client.get_goal_status_text()

    def test_a_drive(self) -> None:
        scans, odometry = Listener("/scan", LaserScan), Listener("/odom", Odometry)
        moving, plans = Listener("/tf", TFMessage), Listener("/move_base/plan", Path)
        commands, estimates = (
            Listener("/cmd_vel", Twist),
            Listener("/amcl_pose", PoseWithCovarianceStamped),
        )
        fixed = rospy.wait_for_message("/tf_static", TFMessage, TIMEOUT)
        for listener in (scans, odometry, moving):
            listener.wait(len)
        feedback: List[Any] = []
        self.client.send_goal(MoveBaseGoal(pose(EAST)), feedback_cb=feedback.append)
        assert self.client.wait_for_result(rospy.Duration(TIMEOUT * SPEED))
        self.assertEqual(self.client.get_state(), GoalStatus.SUCCEEDED)
        self.assertEqual(self.client.get_goal_status_text(), "Goal reached.")
        end = self.wait_until_standing()
        self.assertLess(abs(end - complex(*EAST[:2])), 0.15)
        self.assertGreater(len(feedback), 10)
        self.assertEqual(feedback[-1].base_position.header.frame_id, "map")

        plan = plans.wait(len)
        self.assertEqual(plan.header.frame_id, "map")
        self.assertLess(abs(place(plan.poses[-1].pose) - complex(*EAST[:2])), 0.01)
        self.assertGreater(max(command.linear.x for command in commands.messages), 0.45)
        self.assertEqual(commands.messages[-1].linear.x, 0)
        self.assertLess(abs(place(estimates.messages[-1].pose.pose) - end), 0.25)
        self.assertGreater(len(estimates.messages), 10)

        scan = scans.messages[-1]
        self.assertEqual((scan.header.frame_id, len(scan.ranges)), ("base_scan", 360))
        self.assertEqual((round(scan.range_min, 3), scan.range_max), (0.12, 10.0))
        stamps = [message.header.stamp.to_sec() for message in scans.messages]
        for before, after in zip(stamps, stamps[1:]):
            self.assertAlmostEqual(after - before, 0.2)
        self.check_frames(fixed, moving, odometry)
        for listener in (scans, odometry, moving, plans, commands, estimates):
            listener.close()

    def check_frames(self, fixed: TFMessage, moving: Listener, odometry: Listener) -> None:
        """Checks that the transforms lead to where the robot is."""
        parents: Dict[str, TransformStamped] = {
            one.child_frame_id: one for one in [*fixed.transforms, *moving.messages[-1].transforms]
        }
        chain = ["base_scan"]
        while chain[-1] in parents:
            chain.append(parents[chain[-1]].header.frame_id)
        self.assertEqual(chain, ["base_scan", "base_link", "base_footprint", "odom", "map"])
        where = parents["odom"].transform
        start = complex(where.translation.x, where.translation.y)
        self.assertEqual(start, complex(*START[:2]))
        direction = 2 * math.atan2(where.rotation.z, where.rotation.w)
        self.assertAlmostEqual(direction, START[2])
        turn = complex(math.cos(direction), math.sin(direction))
        robot = parents["base_footprint"].transform.translation
        truth = place(self.truth.messages[-1].pose.pose)
        self.assertAlmostEqual(start + turn * complex(robot.x, robot.y), truth, places=3)
        odom = odometry.messages[-1]
        self.assertEqual((odom.header.frame_id, odom.child_frame_id), ("odom", "base_footprint"))
        self.assertAlmostEqual(start + turn * place(odom.pose.pose), truth, places=3)

    def test_simulated_time_is_as_fast_as_it_should_be(self) -> None:
        began, simulated = time.monotonic(), rospy.get_time()
        self.truth.wait(lambda messages: rospy.get_time() - simulated > 6 * SPEED)
        speed = (rospy.get_time() - simulated) / (time.monotonic() - began)
        # A machine with much to do makes it slower, and nothing much faster.
        self.assertGreater(speed, 0.6 * SPEED)
        self.assertLess(speed, 1.1 * SPEED)

    def test_the_map(self) -> None:
        grid = rospy.wait_for_message("/map", OccupancyGrid, TIMEOUT)
        about = rospy.wait_for_message("/map_metadata", MapMetaData, TIMEOUT)
        served = rospy.ServiceProxy("/static_map", GetMap)().map
        self.assertEqual(grid, served)
        self.assertEqual(grid.info, about)
        self.assertEqual((about.width, about.height), (800, 500))
        self.assertEqual(set(grid.data), {-1, 0, 100})

    def test_plans_for_others(self) -> None:
        here = self.wait_until_standing()
        path = self.plan(PoseStamped(), pose(EAST), 0.0).plan
        self.assertLess(abs(place(path.poses[0].pose) - here), 0.11)
        path = self.plan(pose((15, -17, 0)), pose((23, -4, 0)), 0.0).plan
        self.assertAlmostEqual(place(path.poses[0].pose), 15 - 17j)
        self.assertAlmostEqual(place(path.poses[-1].pose), 23 - 4j)
        self.assertGreater(len(path.poses), 200)
        self.assertEqual(self.plan(PoseStamped(), pose((-5, 5, 0)), 0.0).plan.poses, [])
        with self.assertRaisesRegex(rospy.ServiceException, "frame map: odom"):
            self.plan(PoseStamped(), pose(EAST, "odom"), 0.0)

    def test_obstacles(self) -> None:
        def ask(command: str) -> Tuple[bool, str]:
            response = self.obstacle(command)
            return response.success, response.message

        office = (15.0, -4.0, 0.0)
        self.assertEqual(ask("block c1 o1")[0], True)
        self.assertIn("already", ask("block o1 c1")[1])
        state, text = self.go(office)
        self.assertEqual(state, GoalStatus.ABORTED)
        self.assertIn("no path to (15.00, -4.00)", text)
        self.assertEqual(self.plan(PoseStamped(), pose(office), 0.0).plan.poses, [])
        self.assertEqual(ask("unblock o1 c1")[0], True)
        self.clear()
        self.assertGreater(len(self.plan(PoseStamped(), pose(office), 0.0).plan.poses), 10)
        self.assertEqual(ask("unblock o1 c1"), (False, "there is no box between o1 and c1"))
        self.assertIn("no waypoint x1", ask("block x1 c1")[1])
        self.assertIn("expected block or unblock", ask("jump")[1])

    def test_cancel(self) -> None:
        self.client.send_goal(MoveBaseGoal(pose((7.0, -12.0, 0.0))))
        self.wait_until_driving()
        self.client.cancel_goal()
        assert self.client.wait_for_result(rospy.Duration(TIMEOUT * SPEED))
        self.assertEqual(self.client.get_state(), GoalStatus.PREEMPTED)
        self.assertEqual(self.client.get_goal_status_text(), "canceled on request")
        self.wait_until_standing()

    def test_a_new_goal_replaces_the_old_one(self) -> None:
        ends: List[int] = []
        self.client.send_goal(
            MoveBaseGoal(pose((7.0, -14.0, 0.0))), done_cb=lambda state, _: ends.append(state)
        )
        self.wait_until_driving()
        simple = rospy.Publisher("/move_base_simple/goal", PoseStamped, queue_size=1, latch=True)
        simple.publish(pose((5.0, -8.0, 3.0)))
        assert self.client.wait_for_result(rospy.Duration(TIMEOUT * SPEED))
        self.assertEqual(ends, [GoalStatus.PREEMPTED])
        self.truth.wait(lambda messages: abs(place(messages[-1].pose.pose) - (5 - 8j)) < 0.15)
        simple.unregister()

    def test_goals_that_are_none(self) -> None:
        for goal, text in (
            (pose(EAST, "nowhere"), "expected a pose in the frame map: nowhere"),
            (pose(EAST, ""), "expected a pose in the frame map: no frame"),
            (pose((math.nan, 0, 0)), "expected numbers in a pose"),
            (PoseStamped(header=pose(EAST).header), "expected an orientation about the z axis"),
        ):
            self.client.send_goal(MoveBaseGoal(goal))
            assert self.client.wait_for_result(rospy.Duration(TIMEOUT * SPEED))
            self.assertEqual(self.client.get_state(), GoalStatus.REJECTED)
            self.assertIn(text, self.client.get_goal_status_text())

    def test_commands(self) -> None:
        commands = rospy.Publisher("/cmd_vel", Twist, queue_size=1)
        twist = Twist()
        twist.angular.z = 0.5

        def turns(messages: List[Odometry]) -> bool:
            commands.publish(twist)
            return messages[-1].twist.twist.angular.z > 0.45

        self.truth.wait(turns)
        self.wait_until_standing()  # because no more commands come
        twist.linear.x = math.nan
        commands.publish(twist)
        self.assertEqual(self.go((9.0, -8.0, 0.0))[0], GoalStatus.SUCCEEDED)
        commands.unregister()

    def test_an_initial_pose_changes_nothing_but_is_answered(self) -> None:
        here = self.wait_until_standing()
        estimates = Listener("/amcl_pose", PoseWithCovarianceStamped)
        estimates.wait(len)
        wrong = rospy.Publisher("/initialpose", PoseWithCovarianceStamped, queue_size=1, latch=True)
        wrong.publish(PoseWithCovarianceStamped(header=pose(START).header))
        answer = estimates.wait(lambda messages: len(messages) > 1)
        self.assertAlmostEqual(place(answer.pose.pose), here, places=3)
        estimates.close()
        wrong.unregister()


if __name__ == "__main__":
    rospy.init_node("test_simulator")
    rostest.rosrun("rosoclingo_simulator", "test_simulator", TestSimulator, sys.argv)
