"""The recorder: writes all that determines a run into one bag, as it was on the wire."""

from __future__ import annotations

import argparse
import contextlib
import struct
import sys
import threading
import time
from pathlib import Path
from queue import SimpleQueue
from typing import Any, Dict, List, NoReturn, Set

import genpy
import rospy

from rosclingo.ros.init import give_up, init_node, on_shutdown
from rosoclingo.bags.read.run_end import RunEnd
from rosoclingo.bags.record.arrivals import Journal
from rosoclingo.bags.record.writer import COMPRESSIONS, BagWriter
from rosoclingo.bags.topics import LOOP_TYPES, MD5SUMS, loop_topics, solver_topics
from rosoclingo.bags.wire import Message, PublisherConnection
from rosoclingo.encodings.about import Launched
from rosoclingo.errors import BagError, LaunchedError
from rosoclingo.loop.journal import decode
from rosoclingo.msg import ROSoClingoEvent

_FLUSH_SECONDS = 0.4  # how much of a run is lost, at most, when the recorder is killed
_REPORT_SECONDS = 10.0  # how often it is said how many messages there are
_SECONDS_TO_DRAIN = 0.5  # how long nodes that end at the same Ctrl-C may still send results
_SECONDS_TO_END = 5.0  # how long the last statuses of a run that has ended are waited for
_SECONDS_TO_CLOSE = 1.0  # how long the index may take before rospy ends
_POLL_SECONDS = 0.05
_BUFFER_SIZE = 2**24  # bytes for each connection; encodings and control requests may be long
_TEXT = struct.Struct("<I")  # how a std_msgs/String begins: the length
_EVENT_SUM = MD5SUMS[LOOP_TYPES["journal"]]


class Recorder:
    """Subscribes to a system's topics, whether or not it runs already, and writes all messages.

    rospy's threads only fill a queue, and subscribe to the solvers' topics as soon as their names
    are known; :meth:`write` is called by one thread.
    """

    def __init__(self, name: str, writer: BagWriter, ending: threading.Event) -> None:
        """Subscribes; make it after the node is initialised.

        Args:
            name: Resolved name of the node with the planning loop.
            writer: The bag.
            ending: Set as long as the loop has ended, and the run is not over.
        """
        self._writer = writer
        self._ending = ending
        self._run_end = RunEnd()
        self._name = name
        self._about = f"{name}/about"
        self._events = f"{name}/journal"
        self._journal = Journal()
        self._queue: SimpleQueue[Message] = SimpleQueue()
        self._subscribed: Set[str] = set()
        self._lock = threading.Lock()  # guards the names of what is subscribed to
        self._subscribe(loop_topics(name))

    def write(self) -> None:
        """Writes received messages in order of arrival, and the journal by its numbers.

        Raises:
            BagError: The disk refuses.
        """
        events: List[Message] = []
        others: List[Message] = []
        while not self._queue.empty():  # this is its only reader
            message = self._queue.get_nowait()
            connection = message.connection
            is_event = connection.topic == self._events and connection.md5sum == _EVENT_SUM
            (events if is_event else others).append(message)
        events = self._journal.sort(events)
        for event in events:
            self._follow(event.data)
        merged = events + others
        for message in sorted(merged, key=lambda one: one.time):
            self._writer.write(message)
        self._writer.flush()

    def _follow(self, data: bytes) -> None:
        try:
            event = ROSoClingoEvent().deserialize(data)
        except genpy.DeserializationError:  # readers of the bag say so
            return
        if event.number == 1:  # the node was started again
            self._run_end = RunEnd()
        self._run_end.see(decode(event))
        if self._run_end.loop_has_ended and not self._run_end.is_over:
            self._ending.set()
        else:
            self._ending.clear()

    def _subscribe(self, topics: List[str]) -> None:
        with self._lock:
            new = [topic for topic in topics if topic not in self._subscribed]
            self._subscribed.update(new)
        for topic in new:
            rospy.Subscriber(
                topic, rospy.AnyMsg, self._on_message, tcp_nodelay=True, buff_size=_BUFFER_SIZE
            )

    def _on_message(self, message: Any) -> None:
        # rospy has no other access to what a connection says and to the bytes.
        connection = _connection(message._connection_header)
        self._queue.put(Message(connection, time.time_ns(), message._buff))
        if connection.topic == self._about:
            with contextlib.suppress(LaunchedError):  # readers of the bag say so
                loop = Launched.decode(self._name, _text(message._buff))
                self._subscribe(solver_topics(loop.solvers.values()))


def _connection(header: Dict[str, str]) -> PublisherConnection:
    return PublisherConnection(
        rospy.resolve_name(header["topic"]),
        header["type"],
        header["md5sum"],
        header.get("message_definition", ""),
        header.get("callerid", ""),
        header.get("latching") == "1",
    )


def _text(data: bytes) -> str:
    return data[_TEXT.size :].decode("utf-8", errors="replace")


def main() -> NoReturn:
    """Runs the recorder until it is shut down, and ends the process.

    The exit status is 0, 1 when the bag cannot be written any more, or 2 when the command line is
    wrong or the bag cannot be made.
    """
    options = _parse(rospy.myargv(sys.argv)[1:])
    file = Path(options.output or time.strftime("rosoclingo_%Y-%m-%d-%H-%M-%S.bag"))
    file = file.expanduser().absolute()
    init_node("recorder", anonymous=True)  # before there is a file: Ctrl-C may end it here
    try:
        writer = BagWriter(file, options.compression)
    except BagError as err:
        print(f"record.py: {err}", file=sys.stderr)
        rospy.signal_shutdown(str(err))
        sys.exit(2)
    stopping, closed, ending = threading.Event(), threading.Event(), threading.Event()

    def stop() -> None:  # runs while rospy still receives what nodes that are ending send
        latest = time.monotonic() + _SECONDS_TO_END
        time.sleep(_SECONDS_TO_DRAIN)
        while ending.is_set() and time.monotonic() < latest:
            time.sleep(_POLL_SECONDS)
        stopping.set()
        closed.wait(_SECONDS_TO_CLOSE)

    on_shutdown(stop)
    name = rospy.resolve_name("rosoclingo")
    try:
        with writer:
            _run(Recorder(name, writer, ending), writer, name, file, stopping)
    except BagError as err:
        closed.set()
        stopping.set()
        give_up(err, status=1)
    if writer.count:
        print(
            f"recorded {writer.count} messages of {name} in {file}\n"
            f"replay them: rosrun rosoclingo replay.py {file}",
            flush=True,
        )
    else:
        print(
            f"nothing was recorded, and there is no {file}: {name} has sent nothing; "
            "a node of another name is recorded with rosoclingo:=NAME",
            flush=True,
        )
    closed.set()
    sys.exit(0)


def _run(
    recorder: Recorder, writer: BagWriter, name: str, file: Path, stopping: threading.Event
) -> None:
    rospy.loginfo("recording %s in %s", name, file)
    reported = time.monotonic()
    while not stopping.wait(_FLUSH_SECONDS):
        recorder.write()
        if time.monotonic() - reported >= _REPORT_SECONDS:
            reported += _REPORT_SECONDS
            waiting = "" if writer.count else f"; waiting for {name}"
            rospy.loginfo("%s messages recorded%s", writer.count, waiting)
    recorder.write()


def _parse(arguments: List[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="record.py",
        usage="record.py [-o FILE] [--compression bz2|lz4] [rosoclingo:=NAME]",
        description="Records a run of rosoclingo in a bag, until Ctrl-C.",
        allow_abbrev=False,
    )
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="the bag, which must not exist yet; by default rosoclingo_DATE.bag in this folder",
    )
    parser.add_argument(
        "--compression", choices=COMPRESSIONS, default="none", help="of the bag; by default none"
    )
    return parser.parse_args(arguments)
