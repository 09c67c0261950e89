"""Reads a bag: with rosbags, or without the index if that is broken. Needs no ROS."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Callable, Dict, List, NamedTuple, Tuple

from rosbags.rosbag1 import Reader

from rosoclingo.bags.errors import BagSizeError, BagVersionError, DamagedBagError, NoBagError
from rosoclingo.bags.read.decompress import Expander, ExpansionError
from rosoclingo.bags.read.recovery import Records, check_chunks, read_records
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
        with file.open("rb") as opened:
            opened.seek(begin)
            check_chunks(opened)  # decompresses all chunks once more: rosbags knows no limit
            try:
                return _read_indexed(file, size, wanted)
            except ExpansionError:
                raise
            except Exception as err:  # rosbags does not say in which ways it fails at damage
                opened.seek(begin)
                reason = " ".join(str(err).split()).rstrip(".") or type(err).__name__
                return _repair(file, read_records(opened, wanted), size, reason)
    except OSError as err:
        raise NoBagError(f"{file}: {err.strerror}; give the path of a bag") from err
    except ExpansionError as err:
        raise BagSizeError(
            f"{file}: {err}, which is no recording's; if you trust the bag, decompress it in a ROS "
            f"installation: rosbag decompress {file.name}"
        ) from err


def _read_indexed(file: Path, size: int, wanted: Callable[[Connection], bool]) -> Bag:
    limit = Expander(size)
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
        messages: List[Message] = []
        for connection, time, data in reader.messages(chosen) if chosen else ():
            try:
                limit.add(len(data))  # an index may name a message again and again
            except ExpansionError as err:
                raise ExpansionError(f"message {len(messages) + 1} {err}") from err
            messages.append(Message(connections[connection.id], time, bytes(data)))
        return Bag(messages, list(connections.values()), (), size)


def _repair(file: Path, records: Records, size: int, reason: str) -> Bag:
    if records.encryptor:
        raise BagVersionError(
            f"{file}: the bag is encrypted; decrypt it in a ROS installation: "
            f"rosbag decrypt {file.name}"
        )
    reason = records.fault or reason
    if not records.connections:
        lost = records.losses[0] if records.losses else reason
        raise DamagedBagError(f"{file}: nothing can be read of the bag: {lost}; record again")
    messages = sorted(records.messages, key=lambda message: message.time)
    remark = (
        f"the bag has no intact index ({reason}); it was read from its beginning on, and "
        f"{len(messages)} messages of the system were found"
    )
    losses = [f"lost: {loss}" for loss in records.losses]
    return Bag(messages, records.connections, (remark, *losses), size)


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
