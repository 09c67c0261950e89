"""Has an existing stack do actions, as a file says: action servers, services and topics."""

from __future__ import annotations

import contextlib
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Dict, NoReturn, Optional, Tuple

import clingo
import rospy

from rosclingo.ros import parameters
from rosclingo.ros.init import init_node, run_node
from rosclingo.ros.low_latency import publisher
from rosclingo.ros.reminder import Reminder
from rosoclingo.encodings.known import KnownEncoding
from rosoclingo_interfaces.adapters.adapter_file import (
    AdaptedAction,
    TargetKind,
    read_adapter,
    unknown_answers,
)
from rosoclingo_interfaces.adapters.answer_rules import first_answer
from rosoclingo_interfaces.adapters.field_template import ActionValues
from rosoclingo_interfaces.errors import ActionError, CanceledError, GoneError, ReadingError
from rosoclingo_interfaces.execution import ActionExecution
from rosoclingo_interfaces.interface import ActionInterface, ActuatorAnswer
from rosoclingo_interfaces.observation.transforms import TransformTree
from rosoclingo_interfaces.ros.limited_call import RunningCall
from rosoclingo_interfaces.ros.message_types import (
    build,
    message_class,
    service_class,
    slots,
    topic_types,
)
from rosoclingo_interfaces.ros.node import InterfaceNode, open_in
from rosoclingo_interfaces.ros.observe import ObserverNode, read_encodings, warn_of_unknown_terms
from rosoclingo_interfaces.ros.server_client import ServerClient
from rosoclingo_interfaces.ros.topic_mailbox import MessageQueue, TopicMailbox

# All in wall time.
_POLL_SECONDS = 0.05  # how often a wait looks at its conditions
_LOOKUP_SECONDS = 0.5  # how long a look for a service takes at most

_HELP = (
    "usage: adapter.py _adapter:=FILE [_PARAMETER:=VALUE]... [ROS remappings]\n\n"
    "Has action servers, services and topics do the actions of rosoclingo, as the file says."
)


@dataclass(frozen=True)
class _Run:
    """An action that is done by an entry.

    Attributes:
        one: The entry.
        values: What its references stand for.
        execution: The action.
    """

    one: AdaptedAction
    values: ActionValues
    execution: ActionExecution

    @property
    def name(self) -> str:
        """The name of the server, the service, or the topic."""
        return self.one.name(self.values)

    @property
    def where(self) -> str:
        """The entry's place, for errors."""
        return f"line {self.one.entry.line} of {self.one.entry.file.name}"

    def check_time(self) -> None:
        """Raises an error if the action has taken too long."""
        if 0 < self.one.within < self.execution.seconds:
            raise ActionError(
                f"it has taken more than {self.one.within:g} s (within, {self.where})"
            )

    def check(self) -> None:
        """Raises an error if the action has taken too long, or is to stop."""
        self.check_time()
        self.execution.sleep(0)

    def pause(self, until: Optional[threading.Event] = None) -> None:
        """Waits for a moment; raises an error as :meth:`check` does.

        Args:
            until: Ends the wait.
        """
        self.check()
        (until or self.execution.canceled).wait(_POLL_SECONDS)

    def answer(self, state: str, message: Any) -> str:
        """Returns the answer by the rules of the entry."""
        answer = first_answer(self.one.rules, state, message)
        if answer is None:  # the last rule always holds
            raise ActionError(f"no answer of {self.where} fits")
        return answer

    def type_check(self, name: str, kind: str) -> Callable[[], None]:
        """Returns a function that raises an error now and then if a topic has another type."""
        reminder = Reminder()

        def check() -> None:
            actual = topic_types().get(name, kind) if reminder.due() else kind
            if actual != kind:
                raise ActionError(
                    f"{name} is of the type {actual}, and {kind} by {self.where}; correct type "
                    "there"
                )

        return check


class Adapter(ActionInterface):
    """Does actions by the entries of a file; see the package's README."""

    def __init__(self) -> None:
        self._transforms = TransformTree()
        path = Path(parameters.text("adapter")).expanduser()
        self.file = read_adapter(path, slots, self._transforms)
        self.actuators = self.file.actuators
        self.leaves_unknown = self.file.leaves_unknown
        self.messages = sorted({one.source for one in self.file.observers})
        self._lock = threading.Lock()  # guards the connections below
        self._servers: Dict[Tuple[str, str], ServerClient] = {}
        self._services: Dict[Tuple[str, str], rospy.ServiceProxy] = {}
        self._publishers: Dict[Tuple[str, str], rospy.Publisher] = {}
        self._mailboxes: Dict[Tuple[str, str], TopicMailbox] = {}
        self._types: Dict[str, str] = {}  # of topics, by their resolved names
        self._open_known()

    def observers(self) -> Optional[ObserverNode]:
        """Returns what announces, which is to be run; None if nothing is announced."""
        if not self.file.observers:
            return None
        return ObserverNode(self.file.observers, self._transforms)

    def knows(self, action: clingo.Symbol) -> bool:
        """Returns whether the file has an entry for an action, maybe with other arguments."""
        return self.file.knows(action)

    def outcome_after_crash(self, action: clingo.Symbol) -> str:
        """Returns what the first entry says whose pattern an action fits."""
        for one in self.file.actions:
            if one.after_crash and one.pattern.match(action) is not None:
                return one.after_crash
        return super().outcome_after_crash(action)

    def perform(self, action: clingo.Symbol) -> ActuatorAnswer:
        """Does an action by its entry.

        Raises:
            ActionError: It fits no entry, an argument does not fit, or it has taken too long.
            GoneError: The server went away.
        """
        execution = self.execution
        one, values = self.file.find(execution.actuator, action, lambda: execution.served_goals)
        run = _Run(one, values, execution)
        perform = {
            TargetKind.SERVER: self._reach_goal,
            TargetKind.SERVICE: self._call_service,
            TargetKind.TOPIC: self._publish,
        }[one.kind]
        try:
            return perform(run)
        except ReadingError as err:
            raise ActionError(f"{run.where}: {err}") from err

    def check_vocabulary(self, encoding: KnownEncoding) -> None:
        """Warns of answers that an encoding does not know."""
        for warning in unknown_answers(self.file, encoding.answers):
            rospy.logwarn("%s", warning)

    # The three kinds of targets.

    def _reach_goal(self, run: _Run) -> str:
        one, execution = run.one, run.execution
        server = self._server(run.name, one.type)
        check_type = run.type_check(f"{server.name}/goal", f"{one.type}ActionGoal")

        def check() -> None:
            run.check_time()
            check_type()

        def on_feedback(feedback: Any) -> None:
            if one.progress is not None:
                with contextlib.suppress(ReadingError):
                    (part,) = one.progress.values(feedback)
                    execution.progress = min(max(0.0, float(part)), 1.0)

        goal = build(f"{one.type}Goal", one.fill(run.values))
        server.wait(check, execution.canceled, "is it started?")
        end = server.reach(goal, run.check_time, execution.canceled, on_feedback)
        text = end.text and f": {end.text}"
        rospy.loginfo("%s: %s ended as %s%s", execution, server.name, end.word, text)
        return run.answer(end.word.lower(), end.result)

    def _call_service(self, run: _Run) -> str:
        service = self._service(run.name, run.one.type)
        request = build(f"{run.one.type}Request", run.one.fill(run.values))
        reminder = Reminder()
        while not _is_offered(service):
            if reminder.due():
                rospy.loginfo("waiting for the service %s; is it started?", service.resolved_name)
            run.pause()
        call = RunningCall(service, request)
        while not call.ended.is_set():
            run.pause(call.ended)
        if call.fault is not None:
            raise GoneError(f"{service.resolved_name}: {call.fault}")
        text = getattr(call.response, "message", "")  # as std_srvs has it
        if isinstance(text, str) and text:
            rospy.loginfo("%s: %s said: %s", run.execution, service.resolved_name, text)
        return run.answer("", call.response)

    def _publish(self, run: _Run) -> str:
        one, until = run.one, run.one.until
        topic = self._publisher(run.name, one.type)
        message = build(one.type, one.fill(run.values))
        if until is None:
            _wait_for_connection(topic, run)
            topic.publish(message)
            return run.answer("", None)
        mailbox = self._mailbox(until.name(run.values), until.type)
        with mailbox.opened() as messages:
            _wait_for_connection(topic, run)
            messages.clear()  # what came before the message is not about it
            if until.takes_last and mailbox.last is not None:
                messages.add(mailbox.last)
            topic.publish(message)
            try:
                return _await_answer(run, mailbox, messages)
            except (CanceledError, ActionError):
                if one.cancel is not None:
                    topic.publish(build(one.type, one.cancel(run.values)))
                raise

    # Connections, which are opened once.

    def _open_known(self) -> None:
        """Opens the connections whose names have no arguments in them."""
        nothing = ActionValues({}, self.file.places)
        for one in self.file.actions:
            try:
                with contextlib.suppress(KeyError):  # an argument that is not known yet
                    self._open(one, one.name(nothing))
                if one.until is not None:
                    with contextlib.suppress(KeyError):
                        self._mailbox(one.until.name(nothing), one.until.type)
            except ActionError as err:
                raise one.entry.wrong(err, one.kind) from err

    def _open(self, one: AdaptedAction, name: str) -> None:
        if one.kind is TargetKind.SERVER:
            self._server(name, one.type)
        elif one.kind is TargetKind.SERVICE:
            self._service(name, one.type)
        else:
            self._publisher(name, one.type)

    def _server(self, name: str, kind: str) -> ServerClient:
        made: ServerClient = self._connection(
            self._servers, name, kind, lambda: ServerClient(name, message_class(f"{kind}Action"))
        )
        return made

    def _service(self, name: str, kind: str) -> rospy.ServiceProxy:
        return self._connection(
            self._services, name, kind, lambda: rospy.ServiceProxy(name, service_class(kind))
        )

    def _publisher(self, name: str, kind: str) -> rospy.Publisher:
        return self._connection(
            self._publishers, name, kind, lambda: publisher(name, message_class(kind))
        )

    def _mailbox(self, name: str, kind: str) -> TopicMailbox:
        made: TopicMailbox = self._connection(
            self._mailboxes, name, kind, lambda: TopicMailbox(name, message_class(kind))
        )
        return made

    def _connection(
        self, known: Dict[Tuple[str, str], Any], name: str, kind: str, make: Callable[[], Any]
    ) -> Any:
        with self._lock:
            if (name, kind) not in known:
                if known is self._publishers or known is self._mailboxes:
                    resolved = rospy.resolve_name(name)
                    other = self._types.setdefault(resolved, kind)
                    if other != kind:  # rospy delivers only one of them
                        raise ActionError(
                            f"{resolved} is of the type {other} in another entry, and of {kind} "
                            "here; correct one of them"
                        )
                known[name, kind] = make()
            return known[name, kind]


def _is_offered(service: rospy.ServiceProxy) -> bool:
    try:
        service.wait_for_service(timeout=_LOOKUP_SECONDS)
    except (rospy.ROSException, OSError):
        return False
    return True


def _wait_for_connection(topic: rospy.Publisher, run: _Run) -> None:
    """Waits until a topic has a subscriber, as its message would be lost."""
    reminder, check_type = Reminder(), run.type_check(topic.resolved_name, run.one.type)
    while not topic.get_num_connections():
        if reminder.due():
            rospy.loginfo("waiting for a subscriber of %s; is it started?", topic.resolved_name)
        check_type()
        run.pause()


def _await_answer(run: _Run, mailbox: TopicMailbox, messages: MessageQueue) -> str:
    """Waits until a message decides about the answer."""
    reminder, check_type = Reminder(), run.type_check(mailbox.name, mailbox.type)
    while True:
        message = messages.take(_POLL_SECONDS)
        if message is not None:
            with contextlib.suppress(ReadingError):
                answer = first_answer(run.one.rules, "", message)
                if answer is not None:
                    return answer
        run.check()
        if not mailbox.has_publisher:
            check_type()
            if reminder.due():
                rospy.loginfo("waiting for a publisher of %s", mailbox.name)


class AdapterNode:
    """The node of an adapter. Make it after the node is initialised."""

    def __init__(self) -> None:
        """Reads the file and opens the topics; actions begin at once.

        Raises:
            RosclingoError: A parameter or the file is wrong.
        """
        self._first = open_in()
        adapter = Adapter()
        self._observers = adapter.observers()
        self._node = InterfaceNode(adapter)

        def check(encoding: KnownEncoding) -> None:
            adapter.check_vocabulary(encoding)
            warn_of_unknown_terms(adapter.file.observers, encoding)

        self._encodings = read_encodings(check)

    def run(self) -> AdapterNode:
        """Observes until the node is shut down; returns at once if nothing is announced.

        Returns:
            The node itself, which has to be kept.

        Raises:
            RosclingoError: What is announced does not fit to the type of a topic.
        """
        if self._observers is not None:
            self._observers.run()
        return self


def main() -> NoReturn:
    """Runs the node until it is shut down.

    The exit status is 0, or 2 if a parameter or the file is wrong.
    """
    init_node("adapter", usage=_HELP)
    run_node(lambda: AdapterNode().run())
