"""Announces which paths are blocked, and which are no longer."""

from __future__ import annotations

import sys
import warnings
from typing import NoReturn

import rospy

from rosclingo.errors import TermError
from rosclingo.ros_node import init_node
from rosoclingo.msg import ROSoClingoIn
from rosoclingo_interfaces.announcements import SOURCE, parse_line
from rosoclingo_interfaces.errors import LineError
from rosoclingo_interfaces.prompt import Prompt
from rosoclingo_interfaces.topics import topic, wait_for_subscribers

_HELP = "b FROM TO: the path is blocked; u FROM TO: it is free again; Ctrl-D ends"


def main() -> NoReturn:
    """Runs the node until the end of the lines.

    The exit status is 0 if all lines were announced, 1 if one was wrong or there was nobody to
    hear it, 130 after Ctrl-C.
    """
    init_node("un_block", anonymous=True, usage=f"usage: un_block.py [ROS remappings]\n\n{_HELP}")
    prompt = Prompt("b/u> ")
    rospy.on_shutdown(lambda: prompt.stop("shut down"))
    status = _announce(prompt)
    rospy.signal_shutdown("the lines have ended")
    sys.exit(130 if prompt.interrupted else status)


def _announce(prompt: Prompt) -> int:
    with warnings.catch_warnings():
        # Without a queue, which the end of the process would cut off; rospy warns of that.
        warnings.simplefilter("ignore", SyntaxWarning)
        publisher = rospy.Publisher(topic("in"), ROSoClingoIn, tcp_nodelay=True)
    if prompt.interactive:
        prompt.say(_HELP)
    status = 0
    for line in prompt.lines():
        if not line:
            continue
        try:
            value = parse_line(line)
        except (LineError, TermError) as err:
            prompt.say(str(err))
            status = 1
            continue
        if not wait_for_subscribers(publisher, prompt.say, lambda: prompt.reason is not None):
            prompt.say(f"{value} was not announced: nobody listens to {publisher.resolved_name}")
            return 1
        publisher.publish(SOURCE, value)
        prompt.say(value)
    return 0 if prompt.interactive else status
