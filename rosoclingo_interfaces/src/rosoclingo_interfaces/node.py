"""The ROS node around an interface: hears the actions, sends the answers."""

from __future__ import annotations

import inspect
import sys
import threading
import time
from typing import Callable, NoReturn, Optional, Sequence

import rospy
from std_msgs.msg import String

from rosclingo.ros import parameters
from rosclingo.ros.init import init_node, on_shutdown, run_node
from rosclingo.ros.low_latency import publisher, subscriber
from rosclingo.solver.about import about
from rosoclingo.msg import ROSoClingoIn, ROSoClingoOut
from rosoclingo_interfaces import clock
from rosoclingo_interfaces.executor import Executor
from rosoclingo_interfaces.interface import ActionInterface
from rosoclingo_interfaces.topics import topic, wait_for_node

_SECONDS_TO_END = 1.0  # how long the actions have to stop when the node shuts down


class InterfaceNode:
    """Connects an interface with rosoclingo. Make it after the node is initialised.

    rosoclingo's last action arrives also when it was sent before this node was there. It is done
    then: rosoclingo waits for the answer, unless another interface gave it before.
    """

    def __init__(self, interface: ActionInterface) -> None:
        """Opens the topics; actions begin at once.

        Args:
            interface: Does the actions.

        Raises:
            RosclingoError: A parameter, or an actuator of the interface, is wrong.
        """
        interface.actuators = parameters.terms("actuators", interface.actuators)
        interface.timeout = parameters.number("timeout", interface.timeout)
        simulated = rospy.get_param("/use_sim_time", False)
        seconds = rospy.get_time if simulated else time.monotonic
        self._executor = Executor(interface, interface.timeout, seconds)
        clock.watch(lambda: self._executor.busy)
        on_shutdown(lambda: self._executor.close(_SECONDS_TO_END))
        self._in = publisher(topic("in"), ROSoClingoIn)
        self._out = subscriber(topic("out"), ROSoClingoOut, self._on_out)
        self._about = publish_about(interface.messages, interface.actuators)
        rospy.loginfo(
            "does the actions of %s from %s",
            ", ".join(interface.actuators) or "all actuators",
            self._out.resolved_name,
        )

    def _on_out(self, message: ROSoClingoOut) -> None:
        sender = message._connection_header["callerid"]

        def reply(value: str) -> None:
            answer = ROSoClingoIn(message.id, value)
            if self._in.impl.has_connection(sender):
                self._in.publish(answer)
            else:
                threading.Thread(target=send_later, args=(answer,), daemon=True).start()

        def send_later(answer: ROSoClingoIn) -> None:
            # An action that was there first comes before rosoclingo has connected to this node.
            wait_for_node(self._in, sender)
            self._in.publish(answer)

        self._executor.begin(message.id, message.action, reply)


def publish_about(
    messages: Sequence[str], actuators: Optional[Sequence[str]] = None
) -> rospy.Publisher:
    """Publishes on the latched topic ``~about`` what a node does for rosoclingo.

    Args:
        messages: Ids of the messages that it sends besides answers.
        actuators: Ids of the actuators whose actions it does, none for those of all; None if it
            does no actions.

    Returns:
        The publisher, which has to be kept.
    """
    does = {} if actuators is None else {"actuators": list(actuators)}
    said = about("rosoclingo_interfaces", sys.argv[1:], {}, messages=list(messages), **does)
    latched = publisher("~about", String, latch=True)
    latched.publish(said)
    return latched


def run(interface: Callable[[], ActionInterface], name: str) -> NoReturn:
    """Runs a node with an interface until it is shut down, and ends the process.

    Args:
        interface: Makes the interface; called when the node is initialised. A class will do.
        name: Name of the node, unless ``__name:=`` gives another.

    The exit status is 0, or 2 if a parameter is wrong.
    """
    described = inspect.cleandoc(interface.__doc__ or "")
    usage = f"usage: {name}.py [_PARAMETER:=VALUE]... [ROS remappings]\n\n{described}"
    init_node(name, usage=usage)
    run_node(lambda: InterfaceNode(interface()))
