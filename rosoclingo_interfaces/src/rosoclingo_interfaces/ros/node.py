"""The ROS node of an interface: receives actions, and sends answers."""

from __future__ import annotations

import inspect
import sys
import threading
import time
from functools import partial
from pathlib import Path
from typing import Any, Callable, Dict, Mapping, NoReturn, Optional, Sequence, Set, Tuple

import rospy
from std_msgs.msg import String

from rosclingo.ros import parameters
from rosclingo.ros.init import init_node, on_shutdown, run_node
from rosclingo.ros.low_latency import publisher, subscriber
from rosclingo.solver.about import about
from rosoclingo.loop.execution.tokens import TOKENS_HEADER
from rosoclingo.loop.values.served import ServedGoal
from rosoclingo.msg import (
    ROSoClingoAnswer,
    ROSoClingoDispatch,
    ROSoClingoHeartbeat,
    ROSoClingoIn,
    ROSoClingoOut,
    ROSoClingoServed,
    ROSoClingoToken,
)
from rosoclingo_interfaces.executor import Executor
from rosoclingo_interfaces.interface import ActionInterface
from rosoclingo_interfaces.ledger import Ledger, Token
from rosoclingo_interfaces.retransmitter import Retransmitter
from rosoclingo_interfaces.ros import clock
from rosoclingo_interfaces.ros.faults import faulty_perform
from rosoclingo_interfaces.ros.topics import publishers, topic, wait_for_node
from rosoclingo_interfaces.served_goals import ServedGoalsBoard

_HEARTBEAT_SECONDS = 1.0  # how often a heartbeat is sent, unless ~heartbeat says otherwise
_UNKNOWN_PROGRESS = -1.0
_SECONDS_TO_END = 1.0  # how long the actions have to stop when the node shuts down


class InterfaceNode:
    """Connects an interface with rosoclingo. Make it after the node is initialised.

    What rosoclingo wants to be done arrives also when it was said before this node was there. A
    rosoclingo that publishes ``dispatch`` says it with tokens, and gets the answers with them; they
    are on ``in``, too, for those who listen. An older one says only its last action, on ``out``. It
    is done then: rosoclingo waits for the answer, unless another interface gave it before.
    """

    def __init__(self, interface: ActionInterface) -> None:
        """Opens the topics; actions begin at once.

        Args:
            interface: Does the actions.

        Raises:
            RosclingoError: A parameter, an actuator of the interface, or the store is wrong.
        """
        interface.actuators = parameters.terms("actuators", interface.actuators)
        interface.timeout = parameters.number("timeout", interface.timeout)
        store = parameters.text("store", "")
        heartbeat = parameters.number("heartbeat", _HEARTBEAT_SECONDS, what="seconds")
        ledger = Ledger(Path(store).expanduser().absolute() if store else None)
        simulated = rospy.get_param("/use_sim_time", False)
        seconds = rospy.get_time if simulated else time.monotonic
        perform = faulty_perform(interface, seconds)
        self._executor = Executor(interface, interface.timeout, seconds, ledger, perform)
        clock.watch(lambda: bool(self._executor.running))
        on_shutdown(lambda: self._executor.close(_SECONDS_TO_END))
        self._senders: Dict[str, Tuple[Mapping[str, str], bool]] = {}  # of out; see _dispatches
        self._dispatchers: Set[str] = set()
        self._in = open_in()
        self._answer = publisher(topic("answer"), ROSoClingoAnswer)
        self._unconfirmed = Retransmitter(self._answer.publish)
        self._heartbeats = publisher(topic("heartbeat"), ROSoClingoHeartbeat)
        if heartbeat:
            send = partial(self._send_heartbeats, heartbeat)
            threading.Thread(target=send, name="heartbeats", daemon=True).start()
        self._board = ServedGoalsBoard()
        self._served = subscriber(topic("served"), ROSoClingoServed, self._on_served)
        self._dispatch = subscriber(topic("dispatch"), ROSoClingoDispatch, self._on_dispatch)
        self._out = subscriber(topic("out"), ROSoClingoOut, self._on_out)
        self._about = publish_about(interface.messages, interface.actuators)
        rospy.loginfo(
            "does the actions of %s from %s",
            ", ".join(interface.actuators) or "all actuators",
            self._out.resolved_name,
        )

    def _send_heartbeats(self, seconds: float) -> None:
        """Sends heartbeats of the running actions, in wall time, until a shutdown."""
        end = threading.Event()
        rospy.on_shutdown(end.set)
        while not end.wait(seconds):
            for one in self._executor.running:
                if one.token is not None:
                    progress = _UNKNOWN_PROGRESS if one.progress is None else one.progress
                    self._heartbeats.publish(one.token.run, one.token.number, progress)

    def _on_dispatch(self, message: ROSoClingoDispatch) -> None:
        sender = message._connection_header["callerid"]
        self._dispatchers.add(sender)
        self._unconfirmed.keep(
            (told.id, message.run, told.number)
            for told in message.actions
            if told.state != ROSoClingoToken.ANSWERED
        )
        for told in message.actions:
            if told.state != ROSoClingoToken.ANSWERED:
                self._executor.begin(
                    told.id,
                    told.action,
                    self._reply(sender, message.run, told),
                    Token(message.run, told.number),
                    aborted=told.state == ROSoClingoToken.ABORTED,
                    find_served=partial(self._find_served, Token(message.run, told.number)),
                )

    def _on_served(self, message: ROSoClingoServed) -> None:
        goals = [
            ServedGoal(one.number, one.slot, one.request, one.goal_id, tuple(one.information))
            for one in message.goals
        ]
        self._board.hear(message.run, message.number, goals)

    def _find_served(self, token: Token) -> Tuple[ServedGoal, ...]:
        """Returns the goals that an action serves; none if that cannot be known."""
        name = self._served.resolved_name
        if self._board.is_empty and not publishers(name):
            rospy.logwarn_once("%s has no publisher: it is unknown which goals actions serve", name)
            return ()
        found = self._board.find(token)
        if found is None:
            rospy.logwarn("%s does not say which goals action %d serves", name, token.number)
            return ()
        return found

    def _reply(self, sender: str, run: str, told: ROSoClingoToken) -> Callable[[str], None]:
        """Returns the function that sends the answer to an action with a token."""

        def reply(value: str) -> None:
            answer = ROSoClingoAnswer(run, told.number, value)
            self._unconfirmed.add((told.id, run, told.number), answer)
            self._send(self._answer, answer, sender)
            self._send(self._in, ROSoClingoIn(told.id, value), sender)

        return reply

    def _on_out(self, message: ROSoClingoOut) -> None:
        header = message._connection_header
        if not self._dispatches(header):
            self._executor.begin(
                message.id,
                message.action,
                lambda value: self._send(
                    self._in, ROSoClingoIn(message.id, value), header["callerid"]
                ),
            )

    def _dispatches(self, header: Mapping[str, str]) -> bool:
        """Returns whether the publisher of a message on ``out`` publishes ``dispatch``, too.

        The master is asked once for each connection: such a node opens ``dispatch`` first.
        """
        sender = header["callerid"]
        known, dispatches = self._senders.get(sender, (None, False))
        if known is not header:
            dispatches = sender in publishers(self._dispatch.resolved_name) or (
                sender in self._dispatchers and sender not in publishers(self._out.resolved_name)
            )  # when the master does not answer
            self._senders[sender] = header, dispatches
        return dispatches

    def _send(self, answers: rospy.Publisher, message: Any, node: str) -> None:
        """Sends an answer to a node, and to all other subscribers; does not wait."""

        def send_later() -> None:
            # An action that was there first comes before rosoclingo has connected to this node.
            wait_for_node(answers, node)
            answers.publish(message)

        if answers.impl.has_connection(node):
            answers.publish(message)
        else:
            threading.Thread(target=send_later, daemon=True).start()


def open_in() -> rospy.Publisher:
    """Returns the publisher of rosoclingo's topic ``in`` of a node that answers with tokens.

    All that a node publishes there goes through the same connections: this has to be opened first.
    """
    return publisher(topic("in"), ROSoClingoIn, headers={TOKENS_HEADER: "1"})


def publish_about(
    messages: Sequence[str], actuators: Optional[Sequence[str]] = None
) -> rospy.Publisher:
    """Publishes a node's role for rosoclingo on the latched topic ``~about``.

    Args:
        messages: Ids of the messages that it sends besides answers.
        actuators: Ids of the actuators whose actions it does, none for those of all; None if it
            does no actions.

    Returns:
        The publisher, which has to be kept.
    """
    does: Dict[str, Any] = {} if actuators is None else {"actuators": list(actuators)}
    said = about("rosoclingo_interfaces", sys.argv[1:], messages=list(messages), **does)
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

    def make() -> InterfaceNode:
        _first = open_in()  # kept until the interface, which may open it, too, is here
        return InterfaceNode(interface())

    run_node(make)
