"""Reads the records of a bag from its beginning to its end. Needs no ROS.

The format is http://wiki.ros.org/Bags/Format/2.0: a line, and records of a header and data, each
after its length. Chunks hold records again, all but their index. What is damaged ends the reading
of a chunk, or of the file; what was before is kept.

The index is not used, as it may be missing, and lengths and places that it states may be wrong. No
length is believed that goes beyond the end of the file.
"""

from __future__ import annotations

import enum
import os
import struct
from io import BytesIO
from typing import BinaryIO, Dict, List, Mapping

from rosoclingo.bags.read.decompress import Expander, ExpansionError
from rosoclingo.bags.topics import LOOP_TYPES, owner, resolved
from rosoclingo.bags.wire import Message, PublisherConnection

_LENGTH = 4  # bytes of a length and of a number, the lowest first
_TIME = struct.Struct("<II")
_COUNTS = (b"conn_count", b"chunk_count")


class _Op(enum.IntEnum):
    """The kinds of records in a bag: the field ``op`` of a record's header."""

    MESSAGE = 0x02
    BAG = 0x03
    INDEX = 0x04
    CHUNK = 0x05
    CHUNK_INFO = 0x06
    CONNECTION = 0x07


class _DamageError(Exception):
    """No record can be read from here on."""


class Records:
    """All records of a bag.

    Attributes:
        messages: The messages of a planning loop's topics, in the order of their times.
        connections: All connections by their numbers, of messages or not.
        header: That of the bag; empty if there is none.
        losses: What is damaged, in words.
        size: Size of the bag in bytes.
    """

    def __init__(self, file: BinaryIO) -> None:
        """Reads all records of a bag, which is at its first one.

        Raises:
            ExpansionError: A chunk expands to too much; the text says which.
        """
        self.messages: List[Message] = []
        self.connections: Dict[int, PublisherConnection] = {}
        self.header: Mapping[bytes, bytes] = {}
        self.losses: List[str] = []
        self.size = os.fstat(file.fileno()).st_size
        self._expander = Expander(self.size)
        self._in_chunk = False
        self._places: List[int] = []  # of the connections and chunk infos that end the bag
        self._chunks = 0
        self._read(file, self.size, "the bag")
        self.messages.sort(key=lambda message: message.time)

    @property
    def encryptor(self) -> str:
        """The name of the bag's encryption; empty if it is not encrypted."""
        return _text(self.header, b"encryptor")

    @property
    def fault(self) -> str:
        """The fault of the index, in words; empty if it has none."""
        try:
            connections, chunks = (_number(self.header, name) for name in _COUNTS)
        except _DamageError:
            return "the header of the bag is damaged"
        begin = int.from_bytes(self.header.get(b"index_pos", b""), "little")
        if not begin:
            return "its recorder did not end it"
        is_complete = len(self._places) == connections + chunks and self._chunks == chunks
        if is_complete and (not self._places or self._places[0] == begin):
            return ""
        return "the index does not fit the rest"

    @property
    def remarks(self) -> List[str]:
        """The faults of the bag, in words for the user."""
        remarks = [f"lost: {loss}" for loss in self.losses]
        if self.fault:
            remarks.insert(
                0,
                f"the bag has no intact index ({self.fault}); it was read from its beginning on, "
                f"and {len(self.messages)} messages of the system were found",
            )
        return remarks

    def _read(self, source: BinaryIO, size: int, where: str) -> None:
        """Reads records from where a source is until its end."""
        position = source.tell()
        while position < size:
            try:
                header = _entries(_part(source, size))
                length = _length(source)
                begin = source.tell()
                self._take(header, source, length, min(length, size - begin), position)
            except _DamageError as err:
                self.losses.append(f"{where}, byte {position} of {size}: {err}")
                return
            position = begin + length
            source.seek(position)

    def _take(
        self,
        header: Mapping[bytes, bytes],
        source: BinaryIO,
        length: int,
        available: int,
        position: int,
    ) -> None:
        """Takes a record, of whose data perhaps not all is available."""
        operation = header.get(b"op", b"\0")[0]
        if operation == _Op.CHUNK:  # a part of a chunk may have messages
            if self._in_chunk:
                raise _DamageError("a chunk is inside of a chunk")
            where = f"the chunk at byte {position}"
            content = self._decompress(_text(header, b"compression"), source.read(available), where)
            self._chunks += 1
            self._in_chunk = True
            self._read(BytesIO(content), len(content), where)
            self._in_chunk = False
        if available < length:
            raise _DamageError("the rest is missing")
        if operation == _Op.CONNECTION:
            self._connect(_number(header, b"conn"), header, source.read(length))
        elif operation == _Op.MESSAGE:
            connection = self.connections.get(_number(header, b"conn"))
            if connection is None:
                raise _DamageError("a message belongs to no connection")
            if connection.type == LOOP_TYPES.get(owner(connection.topic)[1]):
                self.messages.append(Message(connection, _time(header), source.read(length)))
        elif operation == _Op.BAG:
            self.header = self.header or header
        elif operation not in (_Op.INDEX, _Op.CHUNK, _Op.CHUNK_INFO):
            raise _DamageError("this is no record of a bag")
        if operation in (_Op.CONNECTION, _Op.CHUNK_INFO) and not self._in_chunk:
            self._places.append(position)

    def _connect(self, number: int, header: Mapping[bytes, bytes], data: bytes) -> None:
        entries = _entries(data)
        self.connections[number] = PublisherConnection(
            resolved(_text(header, b"topic")),
            _text(entries, b"type"),
            _text(entries, b"md5sum"),
            _text(entries, b"message_definition"),
        )

    def _decompress(self, compression: str, data: bytes, where: str) -> bytes:
        if compression == "none":
            return data
        try:
            return self._expander.expand(compression, data)
        except ValueError as err:
            self.losses.append(f"{where} cannot be decompressed: {err}")
            return b""
        except KeyError as err:
            raise _DamageError(f"unknown compression {compression!r}") from err
        except ExpansionError as err:
            raise ExpansionError(f"{where} {err}") from err


def _length(source: BinaryIO) -> int:
    value = source.read(_LENGTH)
    if len(value) < _LENGTH:
        raise _DamageError("the rest is missing")
    return int.from_bytes(value, "little")


def _part(source: BinaryIO, size: int) -> bytes:
    """Reads a length-prefixed field."""
    length = _length(source)
    part = source.read(min(length, size - source.tell()))
    if len(part) < length:
        raise _DamageError("the rest is missing")
    return part


def _entries(data: bytes) -> Dict[bytes, bytes]:
    entries: Dict[bytes, bytes] = {}
    position = 0
    while position < len(data):
        begin = position + _LENGTH
        if begin > len(data):
            raise _DamageError("a record's header is damaged")
        position = begin + int.from_bytes(data[position:begin], "little")
        name, found, value = data[begin:position].partition(b"=")
        if not found or position > len(data) or (name == b"op" and not value):
            raise _DamageError("a record's header is damaged")
        entries[name] = value
    return entries


def _text(entries: Mapping[bytes, bytes], name: bytes) -> str:
    return entries.get(name, b"").decode("utf-8", errors="replace")


def _number(entries: Mapping[bytes, bytes], name: bytes) -> int:
    value = entries.get(name, b"")
    if len(value) != _LENGTH:
        raise _DamageError("a record's header is damaged")
    return int.from_bytes(value, "little")


def _time(header: Mapping[bytes, bytes]) -> int:
    value = header.get(b"time", b"")
    if len(value) != _TIME.size:
        raise _DamageError("a message has no time")
    seconds, nanoseconds = _TIME.unpack(value)
    return int(seconds * 10**9 + nanoseconds)
