"""Writes a bag of which little is lost when the writer is killed. Needs no ROS."""

from __future__ import annotations

import os
import struct
from pathlib import Path
from typing import Dict

from rosbags import interfaces
from rosbags.rosbag1 import Writer
from rosbags.rosbag1.writer import WriterError

from rosclingo.free_file import refusal
from rosoclingo.bags.wire import Message, PublisherConnection, rosbags_type
from rosoclingo.errors import BagError

_MAGIC = b"#ROSBAG V2.0\n"
_HEADER = 4096  # bytes of the header and its padding, without their two lengths
_LENGTH = struct.Struct("<I")
_MISSING = 2 * _LENGTH.size  # bytes by which rosbags' padding is shorter
COMPRESSIONS = ("none", "bz2", "lz4")
"""How a bag can be compressed."""


class BagWriter:
    """A bag that is written, a context manager. Not thread-safe.

    A bag is a row of chunks and an index at its end. :meth:`flush` ends the chunk that is being
    written, so that it can be read even if the index never comes.

    Attributes:
        count: How many messages were written.
    """

    def __init__(self, file: Path, compression: str = "none") -> None:
        """Makes the file.

        Args:
            file: The bag, which must not exist yet.
            compression: One of :data:`COMPRESSIONS`, for each chunk.

        Raises:
            BagError: The file exists or cannot be made.
        """
        self.count = 0
        self._file = file
        self._connections: Dict[PublisherConnection, interfaces.Connection] = {}
        try:
            self._writer = Writer(file)
            if compression != "none":
                self._writer.set_compression(Writer.CompressionFormat[compression.upper()])
            self._writer.open()
            self._pad()
        except WriterError as err:
            raise BagError(refusal(file)) from err
        except OSError as err:
            raise BagError(
                f"{file}: {err.strerror}; give a name in a folder that exists and can be written to"
            ) from err

    def __enter__(self) -> BagWriter:
        """Returns the writer itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Writes the index and closes the file; a bag without messages is removed.

        Raises:
            BagError: The disk refuses.
        """
        try:
            self._writer.close()
            _lengthen_header(self._file)
            if not self.count:  # which no tool of ROS can read
                self._file.unlink()
        except OSError as err:
            raise self._refused(err) from err

    def write(self, message: Message) -> None:
        """Adds a message.

        Raises:
            BagError: The disk refuses.
        """
        try:
            connection = self._connections.get(message.connection)
            if connection is None:
                connection = self._connect(message.connection)
                self._connections[message.connection] = connection
            self._writer.write(connection, message.time, message.data)
        except OSError as err:
            raise self._refused(err) from err
        self.count += 1

    def flush(self) -> None:
        """Hands all that was written to the system.

        Raises:
            BagError: The disk refuses.
        """
        try:
            chunk = self._writer.chunks[-1]
            self._writer.write_chunk(chunk)
            # Of the messages, the index at the end has the numbers only; long runs need the memory.
            for identifier, places in chunk.connections.items():
                if chunk.pos >= 0:
                    chunk.connections[identifier] = [(0, 0)] * len(places)
            if self._writer.bio is not None:
                self._writer.bio.flush()
        except OSError as err:
            raise self._refused(err) from err

    def _pad(self) -> None:
        file = self._writer.bio
        if file is not None:
            file.write(b" " * _MISSING)
            file.flush()
            _lengthen_header(self._file)

    def _connect(self, connection: PublisherConnection) -> interfaces.Connection:
        return self._writer.add_connection(
            connection.topic,
            rosbags_type(connection.type),
            msgdef=connection.definition,
            md5sum=connection.md5sum,
            callerid=connection.caller or None,
            latching=1 if connection.latching else None,
        )

    def _refused(self, err: OSError) -> BagError:
        return BagError(
            f"{self._file}: {err.strerror} after {self.count} messages; make room on the disk; "
            "what was written can be read"
        )


def _lengthen_header(path: Path) -> None:
    """Pads a bag's header to the length that ROS's tools expect.

    rosbags leaves out what the lengths themselves take, and ``rosbag reindex`` then writes over the
    beginning of the first chunk.
    """
    with path.open("r+b") as file:
        file.seek(len(_MAGIC))
        length = _LENGTH.unpack(file.read(_LENGTH.size))[0]
        file.seek(length, os.SEEK_CUR)
        file.write(_LENGTH.pack(_HEADER - length))
