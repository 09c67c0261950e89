"""Reads a bag from its beginning to its end, without its index. Needs no ROS.

The format is http://wiki.ros.org/Bags/Format/2.0: a line, and records of a header and data, each
after its length. Chunks hold records again, all but their index. What is damaged ends the reading
of a chunk, or of the file; what was before is kept.
"""

from __future__ import annotations

import bz2
import struct
from typing import Callable, Dict, Iterator, List, Mapping, NamedTuple, Tuple

import lz4.frame  # type: ignore[import-untyped]  # it brings no types

from rosoclingo.bags.wire import Connection, Message

_MESSAGE, _BAG, _INDEX, _CHUNK, _CHUNK_INFO, _CONNECTION = range(2, 8)
_OPERATIONS = range(2, 8)
_LENGTH = struct.Struct("<I")
_TIME = struct.Struct("<II")


class Repaired(NamedTuple):
    """What could be read.

    Attributes:
        messages: The messages, in the order of the file.
        connections: All connections, of messages or not.
        losses: What is damaged, in words.
    """

    messages: List[Message]
    connections: List[Connection]
    losses: List[str]


class _DamageError(Exception):
    """No record can be read from here on."""


def read_all(data: bytes, begin: int, wanted: Callable[[Connection], bool]) -> Repaired:
    """Reads all records.

    Args:
        data: The file.
        begin: Where the first record is.
        wanted: Whether the messages of a connection are.
    """
    scan = _Scan(wanted)
    scan.read(data, begin, "the bag")
    return Repaired(scan.messages, list(scan.connections.values()), scan.losses)


class _Scan:
    def __init__(self, wanted: Callable[[Connection], bool]) -> None:
        self.messages: List[Message] = []
        self.connections: Dict[int, Connection] = {}
        self.losses: List[str] = []
        self._wanted = wanted
        self._in_chunk = False

    def read(self, data: bytes, begin: int, where: str) -> None:
        position = begin
        while position < len(data):
            try:
                header, start, end = _record(data, position)
                self._take(header, data[start : min(end, len(data))], end > len(data), position)
            except _DamageError as err:
                self.losses.append(f"{where}, byte {position} of {len(data)}: {err}")
                return
            position = end

    def _take(self, header: Mapping[bytes, bytes], data: bytes, cut: bool, position: int) -> None:
        operation = header.get(b"op", b"\0")[0]
        if operation == _CHUNK:  # a part of a chunk may have messages
            if self._in_chunk:
                raise _DamageError("a chunk is inside of a chunk")
            content = self._decompress(header, data, f"the chunk at byte {position}")
            self._in_chunk = True
            self.read(content, 0, f"the chunk at byte {position}")
            self._in_chunk = False
        if cut:
            raise _DamageError("the rest is missing")
        if operation == _CONNECTION:
            self._connect(_number(header, b"conn"), header, data)
        elif operation == _MESSAGE:
            connection = self.connections.get(_number(header, b"conn"))
            if connection is None:
                raise _DamageError("a message belongs to no connection")
            if self._wanted(connection):
                time = header.get(b"time", b"")
                if len(time) != _TIME.size:
                    raise _DamageError("a message has no time")
                seconds, nanoseconds = _TIME.unpack(time)
                stamp = seconds * 10**9 + nanoseconds
                self.messages.append(Message(connection, stamp, data))
        elif operation not in _OPERATIONS:
            raise _DamageError("this is no record of a bag")

    def _connect(self, number: int, header: Mapping[bytes, bytes], data: bytes) -> None:
        entries = _entries(data)
        self.connections[number] = Connection(
            _text(header, b"topic"),
            _text(entries, b"type"),
            _text(entries, b"md5sum"),
            _text(entries, b"message_definition"),
        )

    def _decompress(self, header: Mapping[bytes, bytes], data: bytes, where: str) -> bytes:
        kind = _text(header, b"compression")
        try:
            if kind == "none":
                return data
            if kind == "bz2":
                return bz2.BZ2Decompressor().decompress(data)  # as far as the data go
            if kind == "lz4":
                content: bytes = lz4.frame.LZ4FrameDecompressor().decompress(data)
                return content
        except (OSError, ValueError, EOFError, RuntimeError) as err:
            self.losses.append(f"{where} cannot be decompressed: {err}")
            return b""
        raise _DamageError(f"unknown compression {kind!r}")


def _record(data: bytes, position: int) -> Tuple[Mapping[bytes, bytes], int, int]:
    """Returns a record's header, and where its data begin and end, perhaps after the end."""
    start = position + _LENGTH.size
    if start > len(data):
        raise _DamageError("the rest is missing")
    start += _LENGTH.unpack_from(data, position)[0]
    if start + _LENGTH.size > len(data):
        raise _DamageError("the rest is missing")
    header = _entries(data[position + _LENGTH.size : start])
    length = _LENGTH.unpack_from(data, start)[0]
    start += _LENGTH.size
    return header, start, start + length


def _entries(data: bytes) -> Dict[bytes, bytes]:
    return dict(_split(data))


def _split(data: bytes) -> Iterator[Tuple[bytes, bytes]]:
    position = 0
    while position < len(data):
        begin = position + _LENGTH.size
        if begin > len(data):
            raise _DamageError("a record's header is damaged")
        position = begin + _LENGTH.unpack_from(data, begin - _LENGTH.size)[0]
        name, found, value = data[begin:position].partition(b"=")
        if not found or position > len(data) or (name == b"op" and not value):
            raise _DamageError("a record's header is damaged")
        yield name, value


def _text(entries: Mapping[bytes, bytes], name: bytes) -> str:
    return entries.get(name, b"").decode("utf-8", errors="replace")


def _number(entries: Mapping[bytes, bytes], name: bytes) -> int:
    value = entries.get(name, b"")
    if len(value) != _LENGTH.size:
        raise _DamageError("a record's header is damaged")
    number: int = _LENGTH.unpack(value)[0]
    return number
