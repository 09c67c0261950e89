"""A session at a terminal or a pipe, from the first line to the summary."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import NoReturn, Sequence

import rospy

from rosclingo.ros import parameters
from rosclingo.ros.init import give_up, init_node, on_shutdown
from rosoclingo.ros.encoding_reader import EncodingReader
from rosoclingo_examples.line_words import LineWords
from rosoclingo_examples.orders import Orders, parse_line
from rosoclingo_examples.ros.client import RequestClient
from rosoclingo_interfaces.errors import LedgerError, LineError
from rosoclingo_interfaces.prompt import Prompt


def main(name: str, with_object: bool) -> NoReturn:
    """Runs a client until its lines have ended and all requests with them.

    The exit status is 0 if all requests ended as the user wanted, 1 if not, if a line was wrong or
    if the server has gone, 2 if the file of the parameter ``~store`` cannot be used, and 130 after
    Ctrl-C.

    Args:
        name: Name of the node, to which a number is added.
        with_object: Whether a request names an object.
    """
    usage = f"usage: {name}.py [_store:=FILE] [ROS remappings]\n\n{_help(with_object)}"
    init_node(name, anonymous=True, usage=usage)
    file = parameters.text("store", "")
    try:
        orders = Orders(Path(file).expanduser().absolute() if file else None)
    except LedgerError as err:
        give_up(err)
    prompt = Prompt(f"{name}> ")
    on_shutdown(lambda: prompt.stop("the node was shut down"))
    status = run(prompt, orders, with_object, waits=bool(file))
    rospy.signal_shutdown("the session has ended")
    sys.exit(130 if prompt.interrupted else status)


def run(prompt: Prompt, orders: Orders, with_object: bool, *, waits: bool) -> int:
    """Runs the session and returns the exit status.

    Args:
        prompt: Where lines come from.
        orders: The requests with which it begins.
        with_object: Whether a request names an object.
        waits: Whether it goes on when the server has gone, since that comes again.
    """
    client = RequestClient(orders, prompt.say)
    wrong_lines = 0
    if prompt.wait(client.reminder()):
        client.watch((lambda gone: prompt.say(f"{gone}; waiting for it")) if waits else prompt.stop)
        client.go_on()
        if prompt.interactive:
            prompt.say(_help(with_object))
            _complete(prompt, client.name, orders, LineWords(with_object))
        for line in prompt.lines():
            try:
                _do(line, client, orders, prompt, with_object)
            except (LineError, LedgerError) as err:
                prompt.say(str(err))
                wrong_lines += not prompt.interactive
        if orders.open and prompt.reason is None:
            prompt.say("waiting until all requests have ended; Ctrl-C leaves them alone")
        prompt.wait(lambda: not orders.open)
    if prompt.reason is not None:
        prompt.say(prompt.reason)
    prompt.say(orders.summary(), last=True)
    return 0 if orders.all_as_asked and not wrong_lines and prompt.reason is None else 1


def _complete(prompt: Prompt, server: str, orders: Orders, words: LineWords) -> None:
    """Has TAB complete words, of an encoding as soon as that is known."""

    def offered(before: Sequence[str]) -> Sequence[str]:
        return words.offered(before, [order.number for order in orders.open])

    reader = EncodingReader(lambda reason: rospy.logdebug("there are no completions: %s", reason))
    reader.listen(server, lambda known: words.learn(known.requests))
    prompt.complete(offered)


def _help(with_object: bool) -> str:
    form = "FROM TO OBJECT" if with_object else "FROM TO"
    return f"{form} requests a delivery; ID cancels it; Enter lists all; Ctrl-D ends"


def _do(
    line: str, client: RequestClient, orders: Orders, prompt: Prompt, with_object: bool
) -> None:
    if not line:
        for state in orders.lines() if prompt.interactive else ():
            prompt.say(state)
        return
    meant = parse_line(line, with_object)
    if isinstance(meant, int):
        client.cancel(meant)
    else:
        client.send(meant)
