"""Runs a node with a loop: opens an inbox, runs until the end, and reports the outcome."""

from __future__ import annotations

import os
import sys
from typing import Callable, NoReturn

import rospy
from std_msgs.msg import Empty, String

from rosclingo.errors import ParameterError, shorten
from rosclingo.ros.init import end_wrong, give_up, on_shutdown
from rosclingo.ros.low_latency import subscriber
from rosclingo.ros.master_watch import exit_status
from rosoclingo.errors import StoreError
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.inputs.replay_inbox import ReplayInbox, decode
from rosoclingo.loop.journal import ControlArrived, from_text
from rosoclingo.ros.loop_node import LoopNode


def open_inbox() -> Inbox:
    """Returns the node's inbox, which a shutdown closes; a replay's takes things as recorded.

    Raises:
        ParameterError: The parameter ``~replay`` is wrong.
    """
    recorded = rospy.get_param("~replay", None)
    if recorded is None:
        inbox = Inbox()
    else:
        inbox = held = ReplayInbox(decode(recorded))
        subscriber("~open_gate", Empty, lambda _: held.open())
        subscriber("~go_on", Empty, lambda _: held.go_on())
        subscriber("~replay_control", String, lambda message: _put(held, message.data))
    on_shutdown(inbox.close)
    return inbox


def _put(held: ReplayInbox, text: str) -> None:
    """Puts a recorded request of an operator into the inbox; what is none is dropped."""
    try:
        event = from_text(text)
    except (TypeError, ValueError):
        event = None
    if isinstance(event, ControlArrived):
        held.put(event)
    else:
        rospy.logerr("dropped %s on ~replay_control, which only the player uses", shorten(text))


def run(make: Callable[[], LoopNode]) -> NoReturn:
    """Runs a node that is initialised until it is shut down, and ends the process.

    Args:
        make: Makes the node.

    The exit status is 0, 1 when the loop had to end, or 2 when a parameter is wrong or the store
    cannot be used.
    """
    try:
        node = make()
    except (ParameterError, StoreError) as err:
        give_up(err)
    node.start()
    node.spin()
    status = 0
    if node.failure is not None:
        rospy.logfatal("%s", node.failure)
        rospy.signal_shutdown(node.failure)
        status = 1
        if node.is_refused:
            end_wrong(status)
    if node.is_alive():
        # A solver in this process cannot be interrupted while it grounds.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(exit_status(status))
    sys.exit(status)
