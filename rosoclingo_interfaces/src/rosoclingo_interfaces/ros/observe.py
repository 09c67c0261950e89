"""Announces to rosoclingo what topics of any stack show, by a file of observers."""

from __future__ import annotations

import threading
import time
from functools import partial
from pathlib import Path
from typing import Any, Callable, Dict, List, NoReturn, Sequence

import rosgraph
import rospy
from tf2_msgs.msg import TFMessage

from rosclingo.ros import parameters
from rosclingo.ros.init import init_node, on_shutdown, run_node
from rosclingo.ros.low_latency import publisher, subscriber
from rosclingo.ros.reminder import Reminder
from rosclingo.solver.terms import quote
from rosoclingo.encodings.known import MOST_KNOWN, KnownEncoding
from rosoclingo.msg import ROSoClingoIn
from rosoclingo.ros.encoding_reader import EncodingReader
from rosoclingo_interfaces.errors import ReadingError
from rosoclingo_interfaces.observation.closed_way import ClosedWay
from rosoclingo_interfaces.observation.observer import Observer
from rosoclingo_interfaces.observation.observers import read_observers
from rosoclingo_interfaces.observation.places import NearestWaypoint
from rosoclingo_interfaces.observation.transforms import TransformTree
from rosoclingo_interfaces.observation.vocabulary import unknown_terms
from rosoclingo_interfaces.ros.message_types import message_class, slots, topic_types
from rosoclingo_interfaces.ros.node import publish_about
from rosoclingo_interfaces.ros.topics import topic

# All in wall time.
_TICK_SECONDS = 0.05  # how often it is looked whether a debounce has ended, or a topic is silent
_SEARCH_SECONDS = 0.5  # how often the master is asked for the types of topics
_CHECK_SECONDS = 2.0  # the same when all are known
_WARNING_SECONDS = 30.0  # how often an observer says at most that messages make no sense

_ABOUT = "about"
_HELP = (
    "usage: observe.py _observers:=FILE [_PARAMETER:=VALUE]... [ROS remappings]\n\n"
    "Tells rosoclingo what topics show, as the file says."
)


class ObserverNode:
    """Subscribes for all observers of a file. Make it after the node is initialised."""

    def __init__(self, observers: Sequence[Observer], transforms: TransformTree) -> None:
        """Subscribes to the topics whose types are known.

        Args:
            observers: The observers.
            transforms: By which they take poses to other frames.

        Raises:
            RosclingoError: An observer does not fit to the type of a topic.
        """
        self._transforms = transforms
        self._observers = observers
        simulated = rospy.get_param("/use_sim_time", False)
        self._seconds: Callable[[], float] = rospy.get_time if simulated else time.monotonic
        self._lock = threading.Lock()  # guards observers, transforms, and the order of messages
        self._warned: Dict[int, float] = {}  # by observers: when a message made no sense last
        self._in = publisher(topic("in"), ROSoClingoIn, on_subscriber=self._tell_standing)
        self._subscribers: List[rospy.Subscriber] = []
        if any(isinstance(one.condition, (NearestWaypoint, ClosedWay)) for one in self._observers):
            for name in ("/tf", "/tf_static"):
                self._subscribers.append(subscriber(name, TFMessage, self._on_transforms))
        self._waiting = self._by_topic()
        self._opened: Dict[str, List[Observer]] = {}  # by the names of topics, if types matter
        self._types: Dict[str, str] = {}  # those that topics had last
        self._look_at_types()

    def run(self) -> None:
        """Observes until the node is shut down.

        Raises:
            RosclingoError: An observer does not fit to the type of a topic, which is known now.
        """
        end = threading.Event()
        on_shutdown(end.set)
        reminder = Reminder()
        search_at = time.monotonic() + _SEARCH_SECONDS
        seen = 0  # transforms
        while not end.wait(_TICK_SECONDS):
            if time.monotonic() >= search_at:
                self._look_at_types()
                search_at = time.monotonic() + (
                    _SEARCH_SECONDS if self._waiting else _CHECK_SECONDS
                )
                if self._waiting and reminder.due():
                    names = ", ".join(self._waiting)
                    rospy.loginfo("waiting for a publisher of %s", names)
            changes = self._transforms.changes
            for observer in self._observers:
                if not observer.topic and changes != seen:
                    self._hear(observer, None)
                self._tick(observer)
            seen = changes

    def _by_topic(self) -> Dict[str, List[Observer]]:
        """Returns the observers by the resolved names of their topics."""
        found: Dict[str, List[Observer]] = {}
        for observer in self._observers:
            if observer.topic:
                if not rosgraph.names.is_legal_name(observer.topic):
                    raise observer.entry.wrong(
                        f"topic: {quote(observer.topic)} is no name; expected one such as scan or "
                        "/robot1/scan",
                        "topic",
                    )
                found.setdefault(rospy.resolve_name(observer.topic), []).append(observer)
        return found

    def _look_at_types(self) -> None:
        """Subscribes to topics whose types have become known, and warns of types that change."""
        types = topic_types()
        for name, observers in self._opened.items():
            self._check_type(name, observers, types.get(name, self._types[name]))
        for name, observers in list(self._waiting.items()):
            kind = _class_of(name, observers, types.get(name, ""))
            if kind is None:
                continue
            del self._waiting[name]
            hear = partial(self._on_message, observers)
            self._subscribers.append(subscriber(name, kind, hear))
            if kind is not rospy.AnyMsg:
                self._opened[name], self._types[name] = observers, kind._type

    def _check_type(self, name: str, observers: Sequence[Observer], actual: str) -> None:
        """Warns when a topic's type changes: ROS delivers no messages of the new one here."""
        before, self._types[name] = self._types[name], actual
        if actual == before:
            return
        names = ", ".join(one.name for one in observers)
        rospy.logwarn(
            "%s: the type of %s has changed from %s to %s; if messages of the new type are meant, "
            "start this node again%s; what was known before counts",
            names, name, before, actual,
            " and correct type in its file" if any(one.type for one in observers) else "",
        )  # fmt: skip

    def _on_message(self, observers: Sequence[Observer], message: Any) -> None:
        for observer in observers:
            self._hear(observer, message)
            self._tick(observer)

    def _on_transforms(self, message: TFMessage) -> None:
        for transform in message.transforms:
            try:
                with self._lock:
                    self._transforms.add(transform)
            except ReadingError as err:
                self._warn(0, f"/tf: {err}")

    def _hear(self, observer: Observer, message: Any) -> None:
        """Passes a message to an observer, whatever its content."""
        try:
            with self._lock:
                observer.hear(message, self._seconds())
        except ReadingError as err:
            self._warn(observer.entry.line, f"{observer.name}: {err}")
        except Exception as err:  # messages are anybody's, and the other observers go on
            reason = f"{observer.name}: a message cannot be read: {type(err).__name__}: {err}"
            self._warn(observer.entry.line, reason)

    def _warn(self, line: int, reason: str) -> None:
        """Warns, with a rate limit for each observer."""
        now = time.monotonic()
        if now - self._warned.get(line, -_WARNING_SECONDS) >= _WARNING_SECONDS:
            self._warned[line] = now
            rospy.logwarn("%s; what was known before counts", reason[:1000])

    def _tick(self, observer: Observer) -> None:
        now = self._seconds()
        if now == 0:  # the clock of a simulator that has not begun
            return
        with self._lock:
            term = observer.tick(now)
            if term is not None:
                self._in.publish(observer.source, term)
        if term is not None:
            rospy.loginfo("%s: told %s", observer.name, term)

    def _tell_standing(self, send: Callable[[Any], None]) -> None:
        """Repeats for a new subscriber the last terms that still hold."""
        with self._lock:
            for observer in self._observers:
                if observer.teller.standing is not None:
                    send(ROSoClingoIn(observer.source, observer.teller.standing))


def read_encodings(check: Callable[[KnownEncoding], None]) -> EncodingReader:
    """Has the planner's encoding read, each time that a planner starts.

    Args:
        check: Called with what is known, in a thread of its own.

    Returns:
        The reader, which has to be kept.
    """
    reader = EncodingReader(lambda reason: rospy.logwarn("%s", reason))
    reader.listen(rospy.resolve_name(topic(_ABOUT))[: -len(_ABOUT) - 1], check)
    return reader


def warn_of_unknown_terms(observers: Sequence[Observer], encoding: KnownEncoding) -> None:
    """Warns of terms that an encoding does not declare."""
    if len(encoding.messages) < MOST_KNOWN:  # else it may know more
        for warning in unknown_terms(observers, encoding.messages):
            rospy.logwarn("%s", warning)


def _class_of(name: str, observers: Sequence[Observer], actual: str) -> Any:
    """Returns the class of a topic's messages, which suits its observers; None if unknown.

    Args:
        name: Of the topic.
        observers: Those that listen to it.
        actual: The type that the master knows; empty if it knows none.

    Raises:
        EntryError: There is no such type, or it does not fit.
    """
    named = {one.type: one for one in observers if one.type}
    if actual:
        named.setdefault(actual, observers[0])
    if len(named) > 1:
        wrong = next(one for one in observers if one.type and one.type != actual)
        raise wrong.entry.wrong(f"type: {name} has the types {' and '.join(sorted(named))}", "type")
    if not any(one.needs_type for one in observers):
        return rospy.AnyMsg
    for known, observer in named.items():
        kind = message_class(known)
        if kind is None:
            raise observer.entry.wrong(
                f"type: there is no type of messages {known} here; expected one such as "
                "std_msgs/Bool, of a package that is installed",
                "type",
            )
        for one in observers:
            one.check(known, slots)
        return kind
    return None


def main() -> NoReturn:
    """Runs the node until it is shut down.

    The exit status is 0, or 2 if the file is wrong or does not fit to the types of the topics.
    """
    init_node("observe", usage=_HELP)
    run_node(_run)


def _run() -> None:
    transforms = TransformTree()
    observers = read_observers(Path(parameters.text("observers")).expanduser(), transforms)
    node = ObserverNode(observers, transforms)
    _kept = (
        publish_about(sorted({one.source for one in observers})),
        read_encodings(partial(warn_of_unknown_terms, observers)),
    )
    node.run()
