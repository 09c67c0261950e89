"""Decompresses the chunks of a bag, up to a limit of size. Needs no ROS."""

from __future__ import annotations

import bz2
from typing import Any, Callable, Dict, List

import lz4.frame  # type: ignore[import-untyped]  # it brings no types

_LONGEST_CHUNK = 2**30  # bytes; rosbag ends a chunk after the message that makes it 768 KiB
_LEAST = 2**26  # bytes that a bag may expand to, however small it is
_RATIO = 300  # how many times its size; status lists of an idle system come to some hundred
_INPUT = 2**16  # bytes that are given to a decompressor at once
_OUTPUT = 2**22  # bytes that are taken from it at once

_DECOMPRESSORS: Dict[str, Callable[[], Any]] = {
    "bz2": bz2.BZ2Decompressor,
    "lz4": lz4.frame.LZ4FrameDecompressor,
}


class ExpansionError(Exception):
    """Data expand to more than is allowed."""


class Expander:
    """Decompresses the chunks of one bag.

    Together they may expand to 64 MiB, or to 300 times the bag's size if that is more, and each
    to 1 GiB: a bag of some kilobytes must not fill the memory.
    """

    def __init__(self, size: int) -> None:
        """Begins with a bag.

        Args:
            size: Size of the bag in bytes.
        """
        self._most = self._left = max(_LEAST, _RATIO * size)

    def expand(self, compression: str, data: bytes) -> bytes:
        """Decompresses a chunk; one of which a part is missing, as far as it goes.

        Args:
            compression: ``bz2`` or ``lz4``.
            data: The chunk.

        Raises:
            ExpansionError: It expands to too much.
            KeyError: There is no such compression.
            ValueError: The data are damaged.
        """
        decompressor = _DECOMPRESSORS[compression]()
        pieces: List[bytes] = []
        length = 0
        try:
            for begin in range(0, len(data), _INPUT):
                block = data[begin : begin + _INPUT]
                while not decompressor.eof:
                    piece = decompressor.decompress(block, _OUTPUT)
                    block = b""
                    pieces.append(piece)
                    length += len(piece)
                    self._left -= len(piece)
                    if length > _LONGEST_CHUNK:
                        raise ExpansionError(f"expands to more than {_LONGEST_CHUNK >> 20} MiB")
                    if self._left < 0:
                        raise ExpansionError(
                            f"and those before it expand to more than {self._most >> 20} MiB"
                        )
                    if decompressor.needs_input or not piece:
                        break
        except (OSError, ValueError, EOFError, RuntimeError) as err:
            raise ValueError(str(err)) from err
        return b"".join(pieces)
