"""The action server move_base: forwards goals to the simulation, and sends their results."""

from __future__ import annotations

from functools import partial
from typing import Any, Optional

import rospy
from actionlib import ServerGoalHandle
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import (
    MoveBaseAction,
    MoveBaseActionGoal,
    MoveBaseFeedback,
    MoveBaseGoal,
    MoveBaseResult,
)

from rosclingo.ros.action_server import LowLatencyActionServer
from rosclingo.ros.low_latency import publisher, subscriber
from rosoclingo_simulator.calls import Calls
from rosoclingo_simulator.navigation.move_base import End, MoveBaseDriver
from rosoclingo_simulator.navigation.simulation import Simulation
from rosoclingo_simulator.physics.laser import Scan
from rosoclingo_simulator.ros import messages


class GoalServer:
    """Action server that gives goals to the simulation; a newer goal preempts an older one.

    Goals and cancel requests take effect in order of arrival, between two steps. Only the
    simulation's thread changes a goal's status.
    """

    def __init__(
        self,
        simulation: Simulation,
        move_base: MoveBaseDriver,
        names: messages.RobotNames,
        calls: Calls,
    ) -> None:
        """Opens the topics.

        Args:
            simulation: What drives.
            move_base: The navigation that drives the robot.
            names: Those of the robot.
            calls: How to hand over to its thread.
        """
        self._simulation = simulation
        self._move_base = move_base
        self._about = f"{names.robot}: " if names.robot else ""
        self._current: Optional[ServerGoalHandle] = None
        self._told_scan: Optional[Scan] = None
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
