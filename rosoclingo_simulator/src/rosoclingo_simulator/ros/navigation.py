"""The services and topics of move_base, apart from its action."""

from __future__ import annotations

from typing import Any, Callable, Optional

import numpy as np
import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Path
from nav_msgs.srv import GetPlan, GetPlanRequest, GetPlanResponse
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from rosclingo.ros.low_latency import publisher
from rosoclingo_simulator.navigation.move_base import MoveBaseDriver
from rosoclingo_simulator.navigation.simulation import Simulation
from rosoclingo_simulator.ros import messages


class Navigation:
    """Opens move_base's services and topics. The simulation's thread calls its methods."""

    def __init__(
        self,
        simulation: Simulation,
        move_base: MoveBaseDriver,
        names: messages.RobotNames,
        ask: Callable[..., Any],
    ) -> None:
        """Opens topics and services.

        Args:
            simulation: What drives.
            move_base: What drives it.
            names: Those of the robot.
            ask: Has the simulation's thread call a function, and returns its value.
        """
        self._simulation = simulation
        self._move_base = move_base
        self._ask = ask
        self._commands = publisher(names.topic("cmd_vel"), Twist)
        self._plan = publisher(names.topic("move_base/plan"), Path, latch=True)
        self._told_path: Optional[np.ndarray] = None
        self._told_active = False
        self._services = [
            rospy.Service(names.topic("move_base/make_plan"), GetPlan, self._make_plan),
            rospy.Service(names.topic("move_base/clear_costmaps"), Empty, self._clear_costmaps),
        ]

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
