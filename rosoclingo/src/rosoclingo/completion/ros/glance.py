"""Queries a planning node for what TAB offers, without a node of its own.

It asks the master where the planning node is, and subscribes to a topic there.
"""

from __future__ import annotations

import contextlib
import signal
import socket
import sys
import time
from typing import Any, BinaryIO, Dict, Iterator, List, Sequence
from xmlrpc.client import ServerProxy

import rosgraph
from rosgraph import names, network

from rosoclingo.completion.questions import ACTION
from rosoclingo.loop import journal
from rosoclingo.msg import ROSoClingoEvent, ROSoClingoPlan

_CALLER = "rosoclingo_completion"  # for connections only, no node has this name
_SECONDS = 0.7  # for all of it, also for looking up the name of a machine
_ANSWER_SECONDS = 0.4  # for an answer
_QUIET_SECONDS = 0.05  # after which no more of a topic's history comes
_HISTORY_SECONDS = 0.2  # for the history of a node that is never quiet
_LONGEST = 2**26  # bytes of a message


def values_of(option: str, words: Sequence[str]) -> List[str]:
    """Returns the values that an option of ``why.py`` can have; nothing without an answer.

    SIGALRM ends the process if that takes too long.

    Args:
        option: One of :mod:`rosoclingo.completion.questions`: actions of the plan, or slots and
            requests of goals.
        words: Words of the command line, which may remap the planning node's name.
    """
    signal.setitimer(signal.ITIMER_REAL, _SECONDS)
    socket.setdefaulttimeout(_ANSWER_SECONDS)
    remapped = names.load_mappings(list(words))
    namespace = names.make_global_ns(remapped.get("__ns", names.get_ros_namespace()))
    asker = names.ns_join(namespace, _CALLER)
    name = names.resolve_name(remapped.get("rosoclingo", "rosoclingo"), asker)
    with contextlib.suppress(Exception):  # whatever it is, nothing is offered then
        uri = rosgraph.Master(f"/{_CALLER}").lookupNode(name)
        return _actions(uri, name) if option == ACTION else _goals(uri, name)
    return []


def _actions(uri: str, name: str) -> List[str]:
    """Returns the actions of the plan ahead."""
    for data in _hear(uri, f"{name}/plan", 1):
        terms: List[str] = ROSoClingoPlan().deserialize(data).actions
        return [term for term in terms if term.startswith("do(")]
    return []


def _goals(uri: str, name: str) -> List[str]:
    """Returns slots and requests of the open goals, as far back as the journal goes."""
    goals: Dict[str, List[str]] = {}
    for data in _hear(uri, f"{name}/journal", sys.maxsize):
        event = journal.decode(ROSoClingoEvent().deserialize(data))
        if isinstance(event, journal.GoalArrived):
            goals[event.goal] = [event.request]
        elif isinstance(event, journal.StatusSet) and event.goal in goals:
            if event.status.is_terminal:
                del goals[event.goal]
            elif event.slot:
                goals[event.goal] = [event.slot, goals[event.goal][-1]]
    return list(dict.fromkeys(word for goal in goals.values() for word in goal))


def _hear(uri: str, topic: str, most: int) -> Iterator[bytes]:
    """Yields what a node sends to a new subscriber to one of its topics, so many at most."""
    node: Any = ServerProxy(uri)
    code, _, chosen = node.requestTopic(f"/{_CALLER}", topic, [["TCPROS"]])
    if code != 1:
        return
    fields = {"callerid": f"/{_CALLER}", "topic": topic, "type": "*", "md5sum": "*"}
    with socket.create_connection(tuple(chosen[1:3])) as connection:
        connection.sendall(network.encode_ros_handshake_header(fields))
        file = connection.makefile("rb")
        _read_block(file)  # the node's header
        with contextlib.suppress(socket.timeout, EOFError):
            yield _read_block(file)
            end = time.monotonic() + _HISTORY_SECONDS
            connection.settimeout(_QUIET_SECONDS)
            for _ in range(most - 1):
                if time.monotonic() > end:
                    break
                yield _read_block(file)


def _read_block(file: BinaryIO) -> bytes:
    """Reads a length, and so many bytes.

    Raises:
        EOFError: The node has closed the connection, or this is no message.
    """
    length = int.from_bytes(file.read(4), "little")
    data = file.read(length) if 0 < length < _LONGEST else b""
    if not data or len(data) != length:
        raise EOFError
    return data
