"""Reads the messages of a bag, with its index or without. Needs no ROS."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Callable, Dict, List, NamedTuple, Tuple

from rosbags.rosbag1 import Reader

from rosoclingo.bags import repair
from rosoclingo.bags.errors import BagVersionError, DamagedBagError, NoBagError
from rosoclingo.bags.wire import Connection, Message

_MAGIC = re.compile(rb"#ROSBAG V(\d+)\.(\d+)\r?\n")
_LONGEST_MAGIC = 32  # bytes


class Bag(NamedTuple):
    """What is in a bag.

    Attributes:
        messages: The messages that were asked for, in the order of their times.
        connections: All connections.
        remarks: What was wrong with the bag.
        size: Its size in bytes.
    """

    messages: List[Message]
    connections: List[Connection]
    remarks: Tuple[str, ...]
    size: int


def read_bag(file: Path, wanted: Callable[[Connection], bool]) -> Bag:
    """Reads a bag; one that is damaged, as far as that goes.

    Args:
        file: The bag.
        wanted: Whether the messages of a connection are.

    Raises:
        BagError: It is no bag, or nothing can be read.
    """
    begin, size = _check(file)
    try:
        bag = _read_index(file, wanted)
    except Exception as err:  # rosbags does not say in which ways it fails at a damaged bag
        return _repair(file, begin, wanted, " ".join(str(err).split()) or type(err).__name__)
    return bag._replace(size=size)


def _check(file: Path) -> Tuple[int, int]:
    """Returns where the first record is, and the size."""
    if file.is_dir():
        raise NoBagError(f"{file}: this is a folder; give the path of a bag in it")
    try:
        with file.open("rb") as opened:
            begin = opened.read(_LONGEST_MAGIC)
        size = file.stat().st_size
    except OSError as err:
        raise NoBagError(f"{file}: {err.strerror}; give the path of a bag") from err
    if not begin:
        raise NoBagError(f"{file}: the file is empty; its recorder wrote nothing: record again")
    magic = _MAGIC.match(begin)
    if magic is None:
        raise NoBagError(f"{file}: this is no ROS 1 bag (it does not begin with #ROSBAG)")
    version = int(magic[1]), int(magic[2])
    if version != (2, 0):
        raise BagVersionError(
            f"{file}: a bag of version {version[0]}.{version[1]}, and only 2.0 is read; convert it "
            f"in a ROS installation: rosbag filter {file.name} new.bag True"
        )
    return magic.end(), size


def _read_index(file: Path, wanted: Callable[[Connection], bool]) -> Bag:
    with Reader(str(file)) as reader:
        connections: Dict[int, Connection] = {
            connection.id: Connection(
                connection.topic,
                connection.msgtype.replace("/msg/", "/"),
                connection.digest,
                str(getattr(connection.msgdef, "data", connection.msgdef)),  # a text until 0.9
            )
            for connection in reader.connections
        }
        chosen = [one for one in reader.connections if wanted(connections[one.id])]
        messages = [
            Message(connections[connection.id], time, bytes(data))
            for connection, time, data in (reader.messages(chosen) if chosen else ())
        ]
        return Bag(messages, list(connections.values()), (), 0)


def _repair(file: Path, begin: int, wanted: Callable[[Connection], bool], reason: str) -> Bag:
    try:
        data = file.read_bytes()
    except OSError as err:
        raise NoBagError(f"{file}: {err.strerror}; give the path of a bag") from err
    encryptor = re.search(rb"encryptor=(\w[^\0]*)", data[begin : begin + 4096])
    if encryptor:
        raise BagVersionError(
            f"{file}: the bag is encrypted; decrypt it in a ROS installation: "
            f"rosbag decrypt {file.name}"
        )
    messages, connections, losses = repair.read_all(data, begin, wanted)
    if not connections:
        lost = f": {losses[0]}" if losses else ""
        raise DamagedBagError(
            f"{file}: nothing can be read of the bag ({reason}){lost}; record again"
        )
    messages.sort(key=lambda message: message.time)
    remarks = [
        f"the bag has no intact index ({reason.rstrip('.')}); it was read from its beginning on, "
        f"and {len(messages)} messages of the system were found"
    ]
    remarks += [f"lost: {loss}" for loss in losses]
    return Bag(messages, connections, tuple(remarks), len(data))
