"""Reads a bag into a :class:`~rosoclingo.bags.model.Recording`. Needs no ROS."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any, Dict, Iterator, List, Optional, Set, Tuple

from rosoclingo.bags.holds import OperatorDecisions
from rosoclingo.bags.model import FeedbackLine, Recording
from rosoclingo.bags.read.bagfile import read_bag
from rosoclingo.bags.read.decode import Decoder
from rosoclingo.bags.read.records import Records
from rosoclingo.bags.read.without_journal import TOPICS, Historian, TopicMessage
from rosoclingo.bags.topics import LOOP_TYPES, owner
from rosoclingo.bags.wire import Message, PublisherConnection
from rosoclingo.encodings.about import Launched
from rosoclingo.errors import BagError, LaunchedError
from rosoclingo.loop.journal import Entry, NodeResumed, decode
from rosoclingo.loop.values.plan_times import PlanTimes

_OWN_TYPES = {kind for kind in LOOP_TYPES.values() if kind.startswith("rosoclingo/")}
_RUNS = ("journal", "goal", "in", "out")  # topics of which one at least shows that there is a run


def read_recording(
    file: Path, name: Optional[str] = None, *, with_feedback: bool = False
) -> Recording:
    """Reads the run of one system from a bag.

    A damaged bag is read as far as that goes; the recording's remarks say what is lost.

    Args:
        file: The bag.
        name: Name of the node with the planning loop; needed if the bag has several.
        with_feedback: Whether to read goals' feedback, too.

    Raises:
        BagError: The bag cannot be read, or has no such run.
    """
    return _Reading(file, read_bag(file), name).recording(with_feedback)


class _Reading:
    def __init__(self, file: Path, bag: Records, name: Optional[str]) -> None:
        self._file = file
        self._bag = bag
        self._begin = bag.messages[0].time if bag.messages else 0  # ns
        self._connections = list(dict.fromkeys(bag.connections.values()))
        self._decoder = Decoder()
        self._name = self._choose(name)
        self._remarks = bag.remarks
        self._lost: Counter[str] = Counter()
        self._readable: Set[PublisherConnection] = set()

    def recording(self, with_feedback: bool) -> Recording:
        """Reads the recording of the chosen node."""
        topic = f"{self._name}/journal"
        has_journal = any(connection.topic == topic for connection in self._connections)
        if has_journal:
            entries = self._read_journal()
        else:
            entries = self._read_topics()
            self._remarks.append(
                "the bag has no journal; the run was put together from the node's other topics"
            )
        programs = self._read_programs()
        held, feedback = self._read_held(), self._read_feedback() if with_feedback else ()
        for topic, number in sorted(self._lost.items()):
            self._remarks.append(f"{number} messages of {topic} are damaged and were left out")
        if not entries:
            raise BagError(
                f"{self._file}: the bag has topics of {self._name}, but no message that can be "
                f"read{_because(self._remarks)}; record again while the system runs"
            )
        return Recording(
            self._name,
            entries,
            programs,
            tuple(self._remarks),
            self._bag.size,
            has_journal,
            held,
            feedback,
            self._read_plan_times(),
        )

    # Which system.

    def _choose(self, name: Optional[str]) -> str:
        topics = (owner(one.topic) for one in self._connections if one.type in _OWN_TYPES)
        found = sorted({node for node, topic in topics if topic in _RUNS})
        if name is not None:
            wanted = name if name.startswith("/") else f"/{name}"
            if wanted in found:
                return wanted
            there = f"; there are {', '.join(found)}" if found else ""
            raise BagError(f"{self._file}: the bag has no topics of {wanted}{there}")
        if not found:
            names = sorted({connection.topic for connection in self._connections})
            there = f"has only {', '.join(names[:5])}" if names else "has no topics"
            if len(names) > 5:
                there += f" and {len(names) - 5} more"
            raise BagError(
                f"{self._file}: the bag {there}{_because(self._bag.remarks)}, nothing of "
                "rosoclingo; record one with rosrun rosoclingo record.py"
            )
        if len(found) > 1:
            raise BagError(
                f"{self._file}: the bag has several systems; choose one by its name: "
                f"{', '.join(found)}"
            )
        return found[0]

    # What can be read.

    def _messages(self, *topics: str) -> Iterator[Tuple[Message, Any]]:
        """Yields the messages of topics, decoded.

        Raises:
            BagError: Nothing of a topic that a run needs can be read because of its type.
        """
        for topic in topics:
            self._accept(topic)
        for message in self._bag.messages:
            if message.connection.topic in topics and message.connection in self._readable:
                try:
                    yield message, self._decoder.decode(message)
                except ValueError:
                    self._lost[message.connection.topic] += 1

    def _accept(self, topic: str) -> None:
        """Looks which of a topic's connections can be read."""
        name = owner(topic)[1]
        reasons = []
        for connection in self._connections:
            if connection.topic == topic:
                reason = self._decoder.refuse(connection, LOOP_TYPES[name])
                if reason is None:
                    self._readable.add(connection)
                else:
                    reasons.append(reason)
        if reasons and name in _RUNS and not any(one.topic == topic for one in self._readable):
            raise BagError(
                f"{self._file}: {reasons[0]}; replay it with the version that recorded it, "
                "or record again"
            )
        self._remarks += [f"left out: {reason}" for reason in reasons]

    # What the run was.

    def _read_journal(self) -> Tuple[Entry, ...]:
        runs: List[Dict[int, Entry]] = [{}]
        topic = f"{self._name}/journal"
        unnumbered = 0
        for _, said in self._messages(topic):
            if not said.number:
                unnumbered += 1
                continue
            seconds = (said.stamp.sec * 10**9 + said.stamp.nanosec - self._begin) * 1e-9
            event, known = decode(said), runs[-1].get(said.number)
            if known is not None and known.seconds != seconds:
                if isinstance(event, NodeResumed):  # power has failed, and the last ones are lost
                    runs[-1] = {n: one for n, one in runs[-1].items() if n < said.number}
                else:
                    runs.append({})  # the node was started again
            runs[-1][said.number] = Entry(
                event, int(said.step), int(said.horizon), said.number, seconds
            )
        if len(runs) > 1:
            self._remarks.append(
                f"{self._name} was started {len(runs)} times during the recording; this is its "
                "last run"
            )
        if unnumbered:
            self._remarks.append(
                f"{unnumbered} events of {topic} have no number, so that they are not of "
                f"{self._name}, and were left out"
            )
        numbered = sorted(runs[-1].items())
        lost = (numbered[-1][0] if numbered else 0) - len(numbered)
        if lost > 0:
            self._remarks.append(f"{lost} events of the journal are missing")
        return tuple(entry for _, entry in numbered)

    def _read_topics(self) -> Tuple[Entry, ...]:
        recorded = [
            TopicMessage(owner(one.connection.topic)[1], (one.time - self._begin) * 1e-9, message)
            for one, message in self._messages(*(f"{self._name}/{topic}" for topic in TOPICS))
        ]
        return tuple(Historian().entries(recorded))

    def _read_held(self) -> Tuple[Tuple[float, OperatorDecisions], ...]:
        return tuple(
            (
                (message.time - self._begin) * 1e-9,
                OperatorDecisions.of_message(said),
            )
            for message, said in self._messages(f"{self._name}/held")
        )

    def _read_plan_times(self) -> Tuple[Tuple[float, PlanTimes], ...]:
        return tuple(
            ((message.time - self._begin) * 1e-9, PlanTimes.read(map(str, said.actions)))
            for message, said in self._messages(f"{self._name}/plan")
        )

    def _read_feedback(self) -> Tuple[FeedbackLine, ...]:
        return tuple(
            FeedbackLine(
                (message.time - self._begin) * 1e-9, said.status.goal_id.id, said.feedback.status
            )
            for message, said in self._messages(f"{self._name}/feedback")
        )

    # How it was started.

    def _read_programs(self) -> Dict[str, Launched]:
        loop = self._read_program(self._name)
        if loop is None:
            return {}
        programs = {self._name: loop}
        for node in loop.solvers.values():
            program = self._read_program(node)
            if program is not None:
                programs[node] = program
            elif node not in programs:
                self._remarks.append(f"the bag does not say what {node} was started with")
        return programs

    def _read_program(self, node: str) -> Optional[Launched]:
        """Returns the last ``~about`` of a node."""
        last = None
        for _, said in self._messages(f"{node}/about"):
            try:
                last = Launched.decode(node, said.data)
            except LaunchedError as err:
                self._remarks.append(f"left out: {err}")
        return last


def _because(remarks: Any) -> str:
    return f" ({'; '.join(remarks)})" if remarks else ""
