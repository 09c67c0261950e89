"""Random changes of valid inputs: damage, and what parsers are known to stumble over."""

from __future__ import annotations

import re
from random import Random
from typing import Callable, List, Sequence

_WORDS = (
    b"\0", b"\x01", b"\x7f", b"\xff", b"\xed\xa0\x80", b"\xef\xbf\xbe", b"\xe2\x80\xa8",
    b"\xc3\xa9",
    b"\n", b"\r\n", b"\t", b" ", b'"', b"'", b"\\", b"/", b"..", b"~nobody", b"%", b"#", b";", b":",
    b"0", b"-1", b"1e400", b"nan", b".inf", b"4294967296", b"9" * 25, b"9" * 400, b"9" * 5000,
    b"0x" + b"f" * 400, b"0b", b"true", b"null", b"<", b">", b"&", b"(", b")", b"[", b"]", b"{",
    b"}",
    b"<script>alert(1)</script>", b"$(id)", b"2001-99-99", b"12:99:99",
)  # fmt: skip
_NESTING = (b"(", b"[", b"{", b"f(", b'{"a":', b"- ", b"<a>", b"-", b"~", b"[[1],")
_DIGITS = re.compile(rb"[0-9]+")
_DEPTHS = (3, 30, 2000)
_LONGEST = 1_000_000  # bytes of an input

_Change = Callable[[bytes, Random, Sequence[bytes]], bytes]


def mutate(data: bytes, draw: Random, words: Sequence[bytes], times: int) -> bytes:
    """Returns a text with some changes.

    Args:
        data: The text.
        draw: Decides.
        words: Parts that mean something where the text is read.
        times: How many changes.
    """
    for _ in range(times):
        data = draw.choice(_CHANGES)(data, draw, words)[:_LONGEST]
    return data


def _span(data: bytes, draw: Random) -> slice:
    begin = draw.randrange(len(data) + 1)
    return slice(begin, begin + draw.choice((0, 1, 1, 2, 4, 8, 30, 200)))


def _replaced(data: bytes, span: slice, new: bytes) -> bytes:
    return data[: span.start] + new + data[span.stop :]


def _flip(data: bytes, draw: Random, _: Sequence[bytes]) -> bytes:
    changed = bytearray(data)
    if changed:
        changed[draw.randrange(len(changed))] ^= 1 << draw.randrange(8)
    return bytes(changed)


def _noise(data: bytes, draw: Random, _: Sequence[bytes]) -> bytes:
    new = bytes(draw.randrange(256) for _ in range(draw.randrange(5)))
    return _replaced(data, _span(data, draw), new)


def _delete(data: bytes, draw: Random, _: Sequence[bytes]) -> bytes:
    return _replaced(data, _span(data, draw), b"")


def _truncate(data: bytes, draw: Random, _: Sequence[bytes]) -> bytes:
    return data[: draw.randrange(len(data) + 1)]


def _repeat(data: bytes, draw: Random, _: Sequence[bytes]) -> bytes:
    span = _span(data, draw)
    return _replaced(data, slice(span.start, span.start), data[span] * draw.choice((1, 2, 20)))


def _move(data: bytes, draw: Random, _: Sequence[bytes]) -> bytes:
    span = _span(data, draw)
    return _replaced(_replaced(data, span, b""), slice(0, 0), data[span])


def _copy(data: bytes, draw: Random, _: Sequence[bytes]) -> bytes:
    return _replaced(data, _span(data, draw), data[_span(data, draw)])


def _word(data: bytes, draw: Random, words: Sequence[bytes]) -> bytes:
    new = draw.choice(words) if words and draw.randrange(3) else draw.choice(_WORDS)
    return _replaced(data, _span(data, draw), new)


def _number(data: bytes, draw: Random, _: Sequence[bytes]) -> bytes:
    """Replaces the first number after a random place, or a part of it."""
    place = draw.randrange(len(data) + 1)
    found = _DIGITS.search(data, place) or _DIGITS.search(data)
    if not found:
        return data
    begin, end = found.span()
    new = draw.choice((b"0", b"-1", b"1e308", b"1e999", b"nan", b"2147483648", b"9" * 400, b"x"))
    return data[:begin] + new + data[end:]


def _nest(data: bytes, draw: Random, words: Sequence[bytes]) -> bytes:
    if draw.randrange(4):  # seldom: these take long
        return _word(data, draw, words)
    new = draw.choice(_NESTING) * draw.choice(_DEPTHS)
    return _replaced(data, _span(data, draw), new)


_CHANGES: List[_Change] = [
    _flip, _noise, _delete, _truncate, _repeat, _move, _copy, _word, _word, _word, _number, _number,
    _nest,
]  # fmt: skip
