"""Simulated move_base: its action, services and topics."""

from __future__ import annotations

from functools import partial
from typing import Any, Callable, Optional

import numpy as np
import rospy
from actionlib import ServerGoalHandle
from geometry_msgs.msg import PoseStamped, Twist
from move_base_msgs.msg import (
    MoveBaseAction,
    MoveBaseActionGoal,
    MoveBaseFeedback,
    MoveBaseGoal,
    MoveBaseResult,
)
from nav_msgs.msg import Path
from nav_msgs.srv import GetPlan, GetPlanRequest, GetPlanResponse
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from rosclingo.ros.action_server import LowLatencyActionServer
from rosclingo.ros.low_latency import publisher, subscriber
from rosoclingo_simulator.calls import Calls
from rosoclingo_simulator.navigation.move_base import End, MoveBaseDriver
from rosoclingo_simulator.navigation.simulation import Simulation
from rosoclingo_simulator.physics.laser import Scan
from rosoclingo_simulator.ros import messages


class Navigation:
    """Opens a robot's move_base. The simulation's thread calls its methods.

    A newer goal preempts an older one. Goals and cancel requests take effect in order of arrival,
    between two steps, and only the simulation's thread changes a goal's status.
    """

    def __init__(
        self,
        simulation: Simulation,
        move_base: MoveBaseDriver,
        names: messages.RobotNames,
        calls: Calls,
        ask: Callable[..., Any],
    ) -> None:
        """Opens topics and services.

        Args:
            simulation: What drives.
            move_base: What drives it.
            names: Those of the robot.
            calls: How to hand over to the simulation's thread.
            ask: Has that call a function, and returns its value.
        """
        self._simulation = simulation
        self._move_base = move_base
        self._ask = ask
        self._about = f"{names.robot}: " if names.robot else ""
        self._current: Optional[ServerGoalHandle] = None
        self._told_scan: Optional[Scan] = None
        self._commands = publisher(names.topic("cmd_vel"), Twist)
        self._plan = publisher(names.topic("move_base/plan"), Path, latch=True)
        self._told_path: Optional[np.ndarray] = None
        self._told_active = False
        self._services = [
            rospy.Service(names.topic("move_base/make_plan"), GetPlan, self._make_plan),
            rospy.Service(names.topic("move_base/clear_costmaps"), Empty, self._clear_costmaps),
        ]
        self._server = LowLatencyActionServer(
            names.topic("move_base"),
            MoveBaseAction,
            partial(calls.submit, self._begin),
            partial(calls.submit, self._cancel),
            MoveBaseResult(),
        )
        self._server.start()
        # As move_base does: what comes here goes on as a goal of the action.
        self._goals = publisher(names.topic("move_base/goal"), MoveBaseActionGoal)
        self._simple = subscriber(
            names.topic("move_base_simple/goal"), PoseStamped, self._on_simple_goal
        )

    def publish(self, stamp: rospy.Time) -> None:
        """Publishes path and command if there are new ones."""
        goal, path = self._move_base.goal, self._move_base.path
        if path is not self._told_path and goal is not None:
            self._plan.publish(messages.path_message(path, goal, stamp))
        self._told_path = path
        active = self._move_base.active
        # The last command is the stop. This node listens to the topic too.
        if (active or self._told_active) and self._commands.get_num_connections() > 1:
            twist = Twist()
            twist.linear.x, twist.angular.z = self._simulation.command
            self._commands.publish(twist)
        self._told_active = active

    def _make_plan(self, request: GetPlanRequest) -> GetPlanResponse:
        try:
            goal = messages.pose_from(request.goal)
            # Without a frame, the robot's own place is meant.
            start = messages.pose_from(request.start) if request.start.header.frame_id else None
        except messages.MessageError as err:
            raise rospy.ServiceException(str(err)) from err
        simulation, costmap = self._simulation, self._move_base.costmap
        pose, marked, now = self._ask(lambda: (simulation.estimate, costmap.marked, simulation.now))
        # Not in the simulation's thread, which need not wait for it.
        path = self._move_base.planner.plan(start or pose, goal, marked, request.tolerance)
        return GetPlanResponse(messages.path_message(path, goal, rospy.Time.from_sec(now)))

    def _clear_costmaps(self, _: EmptyRequest) -> EmptyResponse:
        self._ask(self._move_base.costmap.clear)
        return EmptyResponse()

    def update(self) -> None:
        """Sends feedback and results of the goal; called after each step."""
        current, outcome = self._current, self._move_base.outcome
        if current is None:
            return
        if outcome is None:
            self._publish_feedback(current)
            return
        self._current = None
        end = {
            End.SUCCEEDED: current.set_succeeded,
            End.ABORTED: current.set_aborted,
            End.PREEMPTED: current.set_canceled,
        }
        end[outcome.end](MoveBaseResult(), outcome.text)
        rospy.loginfo("%sgoal %s: %s", self._about, outcome.end.value, outcome.text)

    def _publish_feedback(self, goal: ServerGoalHandle) -> None:
        scan = self._simulation.scan
        if scan is not self._told_scan:  # five times a second are enough
            self._told_scan = scan
            stamp = rospy.Time.from_sec(self._simulation.now)
            pose = self._simulation.estimate
            goal.publish_feedback(MoveBaseFeedback(messages.stamped(pose, stamp)))

    def _on_simple_goal(self, message: PoseStamped) -> None:
        goal: Any = MoveBaseActionGoal(goal=MoveBaseGoal(message))
        goal.header.stamp = rospy.Time.now()
        self._goals.publish(goal)

    def _begin(self, handle: ServerGoalHandle) -> None:
        try:
            goal = messages.pose_from(handle.get_goal().target_pose)
        except messages.MessageError as err:
            rospy.logwarn("%sgoal rejected: %s", self._about, err)
            handle.set_rejected(MoveBaseResult(), str(err))
            return
        if self._current is not None:
            self._move_base.cancel("replaced by a newer goal")
            self.update()
        handle.set_accepted()
        self._current = handle
        self._move_base.start(goal)
        rospy.loginfo("%sgoal (%.2f, %.2f)", self._about, goal.x, goal.y)

    def _cancel(self, handle: ServerGoalHandle) -> None:
        if handle == self._current:
            self._move_base.cancel()
            self.update()
