"""A simulated run as a bag, which is replayed, compared and shown like a recorded one."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any, Mapping, Optional

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from rosclingo.solver.about import about
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosoclingo.bags.record.writer import BagWriter
from rosoclingo.bags.topics import LOOP_TYPES
from rosoclingo.bags.wire import Message, PublisherConnection, rosbags_type
from rosoclingo.encodings.about import LOOP_NODE, SOLVER_NODE
from rosoclingo.in_process.shared import shared
from rosoclingo.in_process.system import System
from rosoclingo.loop.journal import Entry, encode

_NAME = "/rosoclingo"
_TEXT, _EVENT = LOOP_TYPES["about"], LOOP_TYPES["journal"]
_NS = 10**9


def write_bag(
    file: Path,
    system: System,
    solvers: Mapping[str, Options],
    parameters: Optional[Mapping[str, Any]] = None,
) -> None:
    """Writes what a system has done, as if three nodes had done it and ended by now.

    The bag has what a replay needs: the journal, and what the nodes were started with.

    Args:
        file: The bag, which must not exist yet.
        system: A system whose run is over.
        solvers: The command lines of its ``controller`` and its ``planner``, the files in the order
            in which they were loaded.
        parameters: Those by which its loop decides, such as ``abort_unreachable``, if any is not
            as it is by default.

    Raises:
        BagError: The file exists or cannot be made.
    """
    begin = time.time_ns() - round(system.clock * _NS)
    names = {role: f"/{role}" for role in solvers}
    engines = {role: Engine(options) for role, options in solvers.items()}
    told = {
        f"{names[role]}/about": about(
            SOLVER_NODE,
            [*(word for path in options.files for word in ("-f", path)), *options.clingo],
            engines[role].program,
        )
        for role, options in solvers.items()
    }
    told[f"{_NAME}/about"] = about(LOOP_NODE, [], solvers=names, parameters=dict(parameters or {}))
    messages = _Messages()
    with BagWriter(file) as writer:
        for topic, text in told.items():
            writer.write(messages.text(topic, begin, text))
        for entry in system.journal:
            writer.write(messages.event(begin, entry))


class _Messages:
    """Makes messages of the types that a run needs."""

    def __init__(self) -> None:
        self._store = get_typestore(Stores.EMPTY)
        definition = (shared() / "msg" / "ROSoClingoEvent.msg").read_text(encoding="utf-8")
        for kind, text in ((_TEXT, "string data\n"), (_EVENT, definition)):
            self._store.register(get_types_from_msg(text, rosbags_type(kind)))

    def text(self, topic: str, moment: int, text: str) -> Message:
        """Returns a text; ``moment`` is in ns since 1970."""
        return self._message(topic, _TEXT, moment, {"data": text})

    def event(self, begin: int, entry: Entry) -> Message:
        """Returns an event of the journal; ``begin`` is its second 0, in ns since 1970."""
        moment = begin + round(entry.seconds * _NS)
        seconds, rest = divmod(moment, _NS)
        fields = encode(entry.event)._asdict()
        fields["details"] = list(fields["details"])
        fields["stamp"] = self._make("builtin_interfaces/Time", {"sec": seconds, "nanosec": rest})
        fields.update(number=entry.number, step=entry.step, horizon=entry.horizon)
        return self._message(f"{_NAME}/journal", _EVENT, moment, fields)

    def _make(self, kind: str, fields: Mapping[str, Any]) -> Any:
        return self._store.types[rosbags_type(kind)](**fields)

    def _message(self, topic: str, kind: str, moment: int, fields: Mapping[str, Any]) -> Message:
        name = rosbags_type(kind)
        definition, md5sum = self._store.generate_msgdef(name)
        caller = topic.rpartition("/")[0]
        connection = PublisherConnection(topic, kind, md5sum, definition, caller, kind == _TEXT)
        data = self._store.serialize_ros1(self._make(kind, fields), name)
        return Message(connection, moment, bytes(data))
