"""The ROS node that draws a graph for rviz."""

from __future__ import annotations

import threading
from typing import Any, Callable, NoReturn

import rospy
from actionlib_msgs.msg import GoalStatus
from visualization_msgs.msg import MarkerArray

from rosclingo.errors import TermError
from rosclingo.ros import parameters
from rosclingo.ros.init import init_node, run_node
from rosclingo.ros.low_latency import publisher, subscriber
from rosoclingo.drawing.shapes import draw
from rosoclingo.drawing.situation import MapSituation
from rosoclingo.encodings.graph import read_graph
from rosoclingo.msg import (
    ROSoClingoActionGoal,
    ROSoClingoActionResult,
    ROSoClingoDispatch,
    ROSoClingoHeartbeat,
    ROSoClingoIn,
    ROSoClingoOut,
    ROSoClingoPlan,
    ROSoClingoToken,
)
from rosoclingo_interfaces.ros.topics import topic
from rosoclingo_rviz.ros.messages import marker_array, read_markers

_USAGE = """\
usage: graph_markers.py _instance:="FILE..." [_PARAMETER:=VALUE]... [ROS remappings]

Publishes ~markers for rviz: the graph of an instance with coordinates, blocked ways, the plan
ahead, packages and robots. The package's README lists the parameters."""

ROBOT_TOPICS = "{robot}"
"""In the name of a robot's frame, ``~robot_frame``, it stands for the robot's name."""


class MarkerNode:
    """Follows rosoclingo's topics, and publishes a drawing after each change."""

    def __init__(self) -> None:
        """Opens the topics, and publishes the first drawing.

        Raises:
            RosclingoError: A parameter or a file is wrong.
        """
        files = parameters.words("instance")
        if not files:
            raise parameters.wrong("instance", "name the instance's files")
        world = parameters.words("world")
        self._background = [marker for file in world for marker in read_markers(file)]
        self._frame = parameters.text("frame", "map")
        self._robot = parameters.text("robot_frame", "base_link")
        self._graph = read_graph(files)
        self._lock = threading.Lock()  # guards the situation, and keeps drawings in order
        self._situation = MapSituation(self._graph)
        self._run = ""  # of which the situation has the actions' numbers
        self._markers = publisher("~markers", MarkerArray, latch=True, queue_size=10)
        self._publish()
        hear = self._situation
        self._subscribers = [
            self._subscribe("in", ROSoClingoIn, lambda m: hear.hear(m.id, m.value)),
            self._subscribe("out", ROSoClingoOut, lambda m: hear.begin_action(m.id, m.action)),
            self._subscribe("dispatch", ROSoClingoDispatch, self._on_dispatch),
            subscriber(topic("heartbeat"), ROSoClingoHeartbeat, self._on_heartbeat),
            self._subscribe("plan", ROSoClingoPlan, lambda m: hear.set_plan(m.actions)),
            self._subscribe(
                "goal",
                ROSoClingoActionGoal,
                lambda m: hear.begin_goal(m.goal_id.id, m.goal.request),
            ),
            self._subscribe(
                "result",
                ROSoClingoActionResult,
                lambda m: hear.end_goal(
                    m.status.goal_id.id, m.status.status == GoalStatus.SUCCEEDED
                ),
            ),
        ]

    def _subscribe(self, name: str, kind: Any, take: Callable[[Any], None]) -> rospy.Subscriber:
        def on_message(message: Any) -> None:
            with self._lock:
                try:
                    take(message)
                except TermError as err:
                    rospy.logwarn("ignored a message of %s: %s", topic(name), err)
                    return
                self._publish()

        return subscriber(topic(name), kind, on_message)

    def _on_dispatch(self, message: ROSoClingoDispatch) -> None:
        self._run = message.run
        actions = (one for one in message.actions if one.state != ROSoClingoToken.ANSWERED)
        self._situation.set_numbers({one.number: one.id for one in actions})

    def _on_heartbeat(self, message: ROSoClingoHeartbeat) -> None:
        with self._lock:
            progress = round(message.progress, 2)
            is_known = message.run == self._run
            if is_known and self._situation.set_progress(message.number, progress):
                self._publish()

    def _publish(self) -> None:
        shapes = draw(self._graph, self._situation)
        message = marker_array(
            shapes,
            self._background,
            self._frame,
            lambda name: self._robot.replace(ROBOT_TOPICS, name),
        )
        self._markers.publish(message)


def main() -> NoReturn:
    """Runs the node until it is shut down, and ends the process.

    The exit status is 0, or 2 if a parameter or a file is wrong.
    """
    init_node("graph_markers", usage=_USAGE)
    run_node(MarkerNode)
