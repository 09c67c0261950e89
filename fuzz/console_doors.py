"""Doors of the console: requests of pages in JSON, and whatever comes at its port."""

from __future__ import annotations

import contextlib
import json
from random import Random
from typing import Any, List

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from fuzzing import Door
from rosoclingo_console.web.operations import READERS, Body, Operations, RequestError

_SYSTEM = "/rosoclingo"


class RequestDoor(Door):
    """Requests to ``/do/KIND``, of pages that have the token: the kind, and a JSON object."""

    name = "requests"
    words = (
        b"null", b"[]", b"{}", b'""', b"1e999", b"NaN", b'"\\ud800"', b'"system"',
        b'"/rosoclingo"', b"true",
        b'"control"', b'"retry"', b'"goal"', b'"a:b"', b":", b'"\\u0000"', b"9" * 400,
        b'"' + b"a" * 10_001,
        b"[" + b"1," * 120, b"play\n", b"why\n", b"goal\n", b"message\n", b'"info:blocked(c3,c4)"',
    )  # fmt: skip
    errors = (RequestError,)

    def valid(self) -> SearchStrategy[bytes]:
        """Returns requests of all kinds."""
        text = st.sampled_from(["visit(2)", "pause", "hold", "robot", "info:a(1)", "go(3)", ""])
        body = st.fixed_dictionaries(
            {"system": st.just(_SYSTEM), "request": text, "message": text, "goal": text},
            optional={
                "control": text, "actuator": text, "action": text, "question": text,
                "arguments": st.lists(text, max_size=2), "information": st.lists(text, max_size=2),
                "on": st.booleans(), "plays": st.booleans(), "position": st.floats(0, 9),
                "speed": st.just(1),
            },
        )  # fmt: skip
        return st.tuples(st.sampled_from(list(READERS)), body).map(
            lambda pair: f"{pair[0]}\n{json.dumps(pair[1])}".encode()
        )

    def read(self, data: bytes) -> None:
        """Reads the request, as the server does, and has no system carry it out."""
        kind, _, text = data.partition(b"\n")
        reader = READERS.get(kind.decode("latin-1"))
        if reader is None:
            raise RequestError("no such kind")
        try:
            body = json.loads(text)
        except (ValueError, RecursionError) as err:
            raise RequestError(f"expected JSON: {err}") from err
        call = reader(Body(body, (_SYSTEM,)))
        with contextlib.suppress(NotImplementedError):
            call(Operations())


class PortDoor(Door):
    """Bytes that come at the port, with the token or without it."""

    name = "port"
    words = (
        b"\r\n", b"\r\n\r\n", b"HTTP/1.1", b"Host: evil.example\r\n",
        b"Content-Length: 9999999999\r\n",
        b"Transfer-Encoding: chunked\r\n", b"GET ", b"POST ", b"/do/goal", b"/live",
        b"Upgrade: websocket\r\n",
        b"\x81\xfe\xff\xff", b"ffffffffffffffff\r\n", b"Expect: 100-continue\r\n", b"\0",
    )  # fmt: skip
    errors = ()
    inputs = 400

    def __init__(self) -> None:
        self._console: Any = None
        self._stack = contextlib.ExitStack()
        self._draw = Random(0)
        self._last = b""  # of the requests that are not damaged

    def __enter__(self) -> Door:
        from console_fuzz import fuzzed_console

        self._console = self._stack.enter_context(fuzzed_console())
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def valid(self) -> SearchStrategy[bytes]:
        """Returns requests of somebody who wishes the console ill."""
        from console_fuzz import RequestFuzzer

        port = self._console.port

        def draw(seed: int) -> bytes:
            self._last = RequestFuzzer(port, seed).request().data
            return self._last

        return st.integers(0, 2**32).map(draw)

    def read(self, data: bytes) -> None:
        """Sends the bytes, and checks what is answered, and what is done."""
        from console_fuzz import FuzzedRequest, check_answer, check_operations, exchange

        request = FuzzedRequest(data)
        check_answer(request, exchange(self._draw, self._console.port, request))
        # Of those that have no right to it, a damaged one may have the right by chance.
        check_operations(self._console, has_right=data != self._last)
        self._console.operations.wanted.clear()


def doors() -> List[Door]:
    """Returns the doors."""
    return [RequestDoor(), PortDoor()]
