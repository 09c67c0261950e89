"""Announces which paths are blocked, and which are free again."""

from __future__ import annotations

import sys
import warnings
from typing import NoReturn

import rospy

from rosclingo.errors import TermError
from rosclingo.ros.init import init_node, on_shutdown
from rosoclingo.loop.words import INFO
from rosoclingo.msg import ROSoClingoIn
from rosoclingo_interfaces.announcements import TAKEN, parse_line, verdict
from rosoclingo_interfaces.errors import LineError
from rosoclingo_interfaces.prompt import Prompt
from rosoclingo_interfaces.ros.journal import JournalReader
from rosoclingo_interfaces.ros.node import publish_about
from rosoclingo_interfaces.ros.topics import topic, wait_for_subscribers

_SECONDS_TO_TAKE = 5.0  # how long rosoclingo's word is waited for

_HELP = "b FROM TO: the path is blocked; u FROM TO: it is free again; Ctrl-D ends"


def main() -> NoReturn:
    """Runs the node until the end of the lines.

    The exit status is 0 if all lines were announced, 1 if one was wrong, there was no subscriber,
    or rosoclingo dropped one, 130 after Ctrl-C.
    """
    init_node("un_block", anonymous=True, usage=f"usage: un_block.py [ROS remappings]\n\n{_HELP}")
    _about = publish_about((INFO,))  # kept, so that it is there as long as the node
    prompt = Prompt("b/u> ")
    on_shutdown(lambda: prompt.stop("shut down"))
    status = _announce(prompt)
    rospy.signal_shutdown("the lines have ended")
    sys.exit(130 if prompt.interrupted else status)


def _was_taken(journal: JournalReader, value: str, prompt: Prompt) -> bool:
    """Reports how rosoclingo took an announcement, unless it took it as expected.

    Returns:
        False if it was dropped.
    """
    prompt.wait(lambda: verdict(journal.events(), value) is not None, _SECONDS_TO_TAKE)
    said = verdict(journal.events(), value)
    if said is None and prompt.reason is None:
        prompt.say(
            f"whether it is taken is not known after {_SECONDS_TO_TAKE:g} s: rosoclingo is busy, "
            "or its mode takes no messages"
        )
    elif said:
        prompt.say(f"{value} was dropped: {said}")
    return said in (None, TAKEN)


def _announce(prompt: Prompt) -> int:
    with warnings.catch_warnings():
        # Without a queue, which the end of the process would cut off; rospy warns of that.
        warnings.simplefilter("ignore", SyntaxWarning)
        publisher = rospy.Publisher(topic("in"), ROSoClingoIn, tcp_nodelay=True)
    journal = JournalReader()
    if prompt.interactive:
        prompt.say(_HELP)
    status = 0
    for line in filter(None, prompt.lines()):
        try:
            value = parse_line(line)
        except (LineError, TermError) as err:
            prompt.say(str(err))
            status = 1
            continue
        if not wait_for_subscribers(publisher, prompt.say, lambda: prompt.reason is not None):
            prompt.say(f"{value} was not announced: nobody listens to {publisher.resolved_name}")
            return 1
        has_journal = journal.begin(prompt.wait)
        publisher.publish(INFO, value)
        prompt.say(value)
        if not has_journal:
            prompt.say(f"whether it is taken is not known: nobody publishes {journal.name}")
        elif not _was_taken(journal, value, prompt):
            status = 1
    return 0 if prompt.interactive else status
