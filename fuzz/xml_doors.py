"""Doors of the solver node: control requests, replies and assumptions in XML."""

from __future__ import annotations

from typing import Any, Callable, Union

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from fuzzing import Door
from rosclingo.errors import XmlError
from rosclingo.wire import commands as wire
from rosclingo.wire.xml_codec import (
    decode_assumptions,
    decode_commands,
    decode_reply,
    encode_assumptions,
    encode_commands,
    encode_reply,
)

_TEXT = st.text(
    st.sampled_from("\t\n \"'<>&;]![a(1,") | st.characters(min_codepoint=0x20, max_codepoint=0x2FF),
    max_size=8,
)
_TEXTS = st.lists(_TEXT, max_size=3).map(tuple)
_NAMES = st.lists(st.sampled_from(["p", "base", "state"]), max_size=2).map(tuple)
_COMMANDS: SearchStrategy[Any] = st.lists(
    st.one_of(
        st.builds(wire.Add, _TEXT, _TEXTS, _TEXT),
        st.builds(
            wire.Ground,
            st.lists(st.builds(wire.Part, _TEXT, _TEXTS), min_size=1, max_size=2).map(tuple),
            st.booleans(),
            _NAMES,
        ),
        st.builds(wire.Load, _TEXT),
        st.builds(wire.AssignExternal, _TEXT, st.sampled_from(wire.Truth)),
        st.builds(wire.ReleaseExternal, _TEXT),
        st.sampled_from(list(wire.PLAIN.values())),
    ),
    max_size=3,
)
_ASSUMED: SearchStrategy[Any] = st.lists(
    st.builds(wire.Assumption, _TEXT, st.booleans())
    | st.builds(wire.CostBound, st.lists(st.integers(-9, 10**9), min_size=1).map(tuple))
    | st.builds(wire.ConflictLimit, st.integers(0, 10**9 - 1))
    | st.builds(wire.Restarts, st.from_regex(r"[A-Z],[0-9]{1,4}", fullmatch=True)),
    max_size=3,
)
_REPLIES = st.builds(
    wire.Reply,
    st.lists(
        st.builds(
            wire.Externals,
            st.lists(st.tuples(_TEXT, st.sampled_from(wire.Truth)), max_size=2).map(tuple),
        )
        | st.builds(
            wire.Programs, st.lists(st.tuples(_TEXT, st.integers(0, 9)), max_size=2).map(tuple)
        )
        | st.just(wire.Stats({"summary": {"call": 1.0, "models": [1, 2]}})),
        max_size=2,
    ).map(tuple),
    st.none() | st.builds(wire.Failure, _TEXT, st.integers(-1, 99), _TEXT),
)
_MARKUP = (
    b"<!DOCTYPE a [<!ENTITY b 'c'>]>", b"<!DOCTYPE a SYSTEM 'file:///etc/passwd'>", b"&b;",
    b"<!DOCTYPE a [<!ENTITY b '" + b"c" * 99 + b"'><!ENTITY d '" + b"&b;" * 99 + b"'>]>", b"&d;",
    b"<![CDATA[", b"]]>", b"<!--", b"-->", b"<?xml version='1.0' encoding='utf-16'?>", b"&#0;",
    b"<?xml version='1.0' encoding='x-none'?>", b"&#x110000;", b"&amp;", b"xmlns='a'", b"/>", b"</",
    b"<commands>", b"</commands>", b"<assumptions>", b"<return>", b"<success>", b"<a>" * 20,
    b"<restart/>" * 200, b"value='true'", b"name='p'", b"<program>", b"<ground>", b"\xfe\xff",
)  # fmt: skip


class XmlDoor(Door):
    """A door for XML that a function decodes, as text or as bytes."""

    words = _MARKUP
    errors = (XmlError,)

    def __init__(
        self,
        name: str,
        values: SearchStrategy[Any],
        encode: Callable[[Any], str],
        decode: Callable[[Union[str, bytes]], Any],
    ) -> None:
        self.name = name
        self._values = values
        self._encode = encode
        self._decode = decode

    def valid(self) -> SearchStrategy[bytes]:
        """Returns encoded values."""
        return self._values.map(lambda value: self._encode(value).encode())

    def read(self, data: bytes) -> None:
        """Decodes the text, as rospy hands it over, or the bytes; what is taken comes back."""
        text: Union[str, bytes] = data
        if len(data) % 2:
            text = data.decode("utf-8", "surrogateescape")
        value = self._decode(text)
        assert self._decode(self._encode(value)) == value

    def check(self, err: Exception) -> None:
        """Checks that the place is there, where there can be one."""
        assert isinstance(err, XmlError)
        text = str(err)
        assert err.line or any(word in text for word in ("no element", "cannot be read")), text


def doors() -> list[Door]:
    """Returns the doors."""
    return [
        XmlDoor("control", _COMMANDS, encode_commands, decode_commands),
        XmlDoor("assumptions", _ASSUMED, encode_assumptions, decode_assumptions),
        XmlDoor("replies", _REPLIES, encode_reply, decode_reply),
    ]
