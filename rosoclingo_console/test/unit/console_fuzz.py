"""Requests of somebody who wishes a console ill, made of a seed: the same ones each time.

By hand, so many requests, and what they have left behind:

    python rosoclingo_console/test/unit/console_fuzz.py 10000
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import gc
import gzip
import json
import os
import random
import socket
import struct
import sys
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Tuple

from console_server import SECONDS, SYSTEM, TOKEN, Remembered
from waiting import wait_for

from rosoclingo_console.web.access import Access
from rosoclingo_console.web.hub import Hub
from rosoclingo_console.web.running import WebThread
from rosoclingo_console.web.server import Server

STOLEN = "stolen"
"""Mark of all that is asked for without the right to it."""

_MARKUP = '"><script>alert(1)</script><img src=x onerror=alert(1)>{{7*7}}`id`$(id)%s%n'
_TEXTS = (
    "visit(2)", "", " ", _MARKUP, "\x00", "\n\r\t", "\ud800", "\udfff\ud800", "\u202e\u2028",
    "\U0001f4a5", "a" * 9_999, "a" * 20_000, "../../etc/passwd", "/", "${jndi:x}", "-1", "nan",
)  # fmt: skip
_SHAKE = (
    "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
)
_KINDS = ("control", "goal", "cancel", "why", "record", "play")


class FuzzedRequest(NamedTuple):
    """Bytes that somebody sends in a connection.

    Attributes:
        data: The bytes.
        is_whole: Whether it is HTTP and complete, so that there has to be an answer.
    """

    data: bytes
    is_whole: bool = False


class RequestFuzzer:
    """Draws requests to a console on a port of this machine."""

    def __init__(self, port: int, seed: int) -> None:
        self.draw: Any = random.Random(seed)
        self._host = f"localhost:{port}"
        self._makers: Tuple[Callable[[], FuzzedRequest], ...] = (
            self._strange_fields, self._without_right, self._damaged, self._path, self._headers,
            self._chunks, self._compressed, self._lengths, self._frames, self._no_http,
            self._pipeline,
        )  # fmt: skip

    def request(self) -> FuzzedRequest:
        """Returns one more request."""
        maker: Callable[[], FuzzedRequest] = self.draw.choice(self._makers)
        return maker()

    def _noise(self, most: int) -> bytes:
        return bytes(self.draw.randrange(256) for _ in range(self.draw.randint(1, most)))

    def _head(self, line: str, **headers: str) -> str:
        """Returns a head of a request with all rights, but for the headers that are given."""
        all_of_them = {
            "Host": self._host, "Origin": f"http://{self._host}",
            "Authorization": f"Bearer {TOKEN}", "Content-Type": "application/json",
        }  # fmt: skip
        all_of_them.update({key.replace("_", "-"): value for key, value in headers.items()})
        lines = "".join(f"{key}: {value}\r\n" for key, value in all_of_them.items() if value)
        return f"{line} HTTP/1.1\r\n{lines}"

    def _post(self, body: bytes, kind: str = "goal", **headers: str) -> bytes:
        head = self._head(f"POST /do/{kind}", **headers, Content_Length=str(len(body)))
        return f"{head}\r\n".encode("utf-8", "surrogateescape") + body

    def _value(self, depth: int = 3) -> Any:
        draw = self.draw
        kind = draw.randrange(9 if depth else 7)
        if kind < 3:
            return draw.choice(_TEXTS)
        if kind == 3:
            return draw.choice((None, True, False, 0, -1, 1e308, 10**400, float("nan")))
        if kind < 7:
            return draw.choice((SYSTEM, "pause", "halt", "hold", "retry", [], {}))
        if kind == 7:
            return [self._value(depth - 1) for _ in range(draw.choice((0, 1, 3, 101)))]
        return {draw.choice(_TEXTS)[:50]: self._value(depth - 1) for _ in range(3)}

    def _strange_fields(self) -> FuzzedRequest:
        draw = self.draw
        names = ("system", "request", "information", "message", "goal", "control", "actuator",
                 "action", "question", "arguments", "on", "plays", "position", "speed")  # fmt: skip
        body = {name: self._value() for name in names}
        body.update(system=SYSTEM, control="hold")
        for name in ("information", "arguments"):
            body[name] = [draw.choice(_TEXTS)]
        for name in draw.sample(names, 2):
            body[name] = self._value()
        for name in ("request", "message", "actuator", "action", "goal", "question"):
            if draw.randrange(4):
                body[name] = draw.choice(_TEXTS)
        text = json.dumps(body, ensure_ascii=draw.random() < 0.8).encode("utf-8", "surrogatepass")
        if draw.randrange(5) == 0:
            deep = draw.choice((b"[", b'{"a":')) * draw.choice((10, 1000, 20_000))
            wide = text.decode("utf-8", "replace").encode("utf-16")
            text = draw.choice((deep, self._noise(100), wide))
        return FuzzedRequest(self._post(text, draw.choice(_KINDS)), True)

    def _without_right(self) -> FuzzedRequest:
        draw = self.draw
        wrong = draw.choice((
            {"Authorization": ""}, {"Authorization": f"Bearer {TOKEN[:-1]}"},
            {"Authorization": f"Bearer {TOKEN}{draw.randrange(10)}"},
            {"Authorization": f"bearer {TOKEN}"}, {"Authorization": f"Basic {TOKEN}"},
            {"Authorization": "Bearer \udcff\udcfe"}, {"Authorization": "Bearer"},
            {"Origin": ""}, {"Origin": "null"}, {"Origin": "http://evil.example"},
            {"Origin": f"http://{self._host}.evil.example"}, {"Origin": f"file://{self._host}"},
            {"Host": "evil.example"}, {"Host": "evil.example", "Origin": "http://evil.example"},
            {"Host": "localhost.evil.example"}, {"Host": "[::1"}, {"Host": "a@localhost"},
            {"Host": "\udcff"}, {"Sec_Fetch_Site": "cross-site"}, {"Sec_Fetch_Site": "same-site"},
            {"Content_Type": "text/plain"}, {"Content_Type": "multipart/form-data; boundary=a"},
            {"Content_Type": "application/x-www-form-urlencoded"},
        ))  # fmt: skip
        body = {"system": SYSTEM, "request": STOLEN, "goal": STOLEN, "control": "halt",
                "actuator": STOLEN, "question": STOLEN, "on": True}  # fmt: skip
        text = json.dumps(body).encode()
        return FuzzedRequest(self._post(text, draw.choice(_KINDS), **wrong), True)

    def _damaged(self) -> FuzzedRequest:
        draw = self.draw
        text = bytearray(self._post(json.dumps({"system": SYSTEM, "request": "a"}).encode()))
        for _ in range(draw.randint(1, 20)):
            place = draw.randrange(len(text))
            kind = draw.randrange(4)
            if kind == 0:
                text[place] = draw.randrange(256)
            elif kind == 1:
                del text[place : place + draw.randint(1, 9)]
            elif kind == 2:
                text[place:place] = self._noise(9)
            else:
                del text[max(place, 300) :]
        return FuzzedRequest(bytes(text))

    def _path(self) -> FuzzedRequest:
        draw = self.draw
        parts = ("page", "..", "%2e%2e", "%2f", "main.js", "%00", "do", "live", "metrics", "goal",
                 "%", "%ff", "\udcff", "?a=<b>", "#", ";", "//", "\\", "access.py", "x" * 900,
                 "%3Cscript%3E", "*", "http://evil.example/", "@")  # fmt: skip
        path = "/".join(draw.choice(parts) for _ in range(draw.randint(1, 6)))
        method = draw.choice(("GET", "GET", "HEAD", "POST", "PUT", "OPTIONS", "TRACE", "CONNECT",
                              "DELETE", "PROPFIND", "<b>", "get"))  # fmt: skip
        head = self._head(f"{method} {draw.choice(('/', ''))}{path}")
        return FuzzedRequest(f"{head}\r\n".encode("utf-8", "surrogateescape"))

    def _headers(self) -> FuzzedRequest:
        draw = self.draw
        kind = draw.randrange(4)
        if kind == 0:
            more = f"X: {'y' * draw.choice((8000, 9000, 100_000))}\r\n"
        elif kind == 1:
            more = "".join(f"X-{number}: y\r\n" for number in range(draw.choice((100, 3000))))
        elif kind == 2:
            more = draw.choice((
                "Host: evil.example\r\n", "Expect: 100-continue\r\n", "Expect: <b>\r\n",
                "Upgrade: h2c\r\n", "Range: bytes=0-0\r\n", " folded\r\n", ": y\r\n", "X\r\n",
                "If-None-Match: *\r\n", "Cookie: a=\udcff\r\n", "Connection: close\r\n",
            ))  # fmt: skip
        else:
            more = self._noise(300).decode("ascii", "surrogateescape")
        head = self._head(draw.choice(("GET /", "GET /live", "GET /metrics", "POST /do/goal")))
        return FuzzedRequest(f"{head}{more}\r\n".encode("utf-8", "surrogateescape"))

    def _chunks(self) -> FuzzedRequest:
        draw = self.draw
        head = self._head("POST /do/goal", Transfer_Encoding=draw.choice(("chunked", "x, chunked")))
        text = b""
        for _ in range(draw.randint(1, 5)):
            size = draw.choice(("5", "0", "-1", "ffffffffffffffffff", "x", "5;a=b", "5" * 300, ""))
            text += f"{size}\r\n".encode() + draw.choice((b"[1,2]\r\n", self._noise(20), b"\r\n"))
        return FuzzedRequest(f"{head}\r\n".encode() + text)

    def _compressed(self) -> FuzzedRequest:
        draw = self.draw
        text = json.dumps({"system": SYSTEM, "request": "a"}).encode()
        body = draw.choice((gzip.compress(text), gzip.compress(b" " * 10**6), self._noise(200)))
        body = body[: draw.choice((len(body), len(body) // 2, 3))]
        encoding = draw.choice(("gzip", "deflate", "br", "identity", "gzip, gzip", "<b>"))
        right = draw.choice((TOKEN, "x"))
        return FuzzedRequest(
            self._post(body, Content_Encoding=encoding, Authorization=f"Bearer {right}")
        )

    def _lengths(self) -> FuzzedRequest:
        draw = self.draw
        length = draw.choice(("-1", "0", "1", "99999999999999999999", "x", "1, 2", "+5", "100"))
        more = draw.choice(("", "", "Content-Length: 3\r\n", "Transfer-Encoding: chunked\r\n"))
        head = self._head(f"POST /do/{draw.choice(_KINDS)}", Content_Length=length)
        body = draw.choice((b"", b"{", b"{}" * 50_000))
        return FuzzedRequest(f"{head}{more}\r\n".encode() + body)

    def _frames(self) -> FuzzedRequest:
        draw = self.draw
        head = self._head("GET /live", Authorization="", Content_Type="")
        data = f"{head}{_SHAKE}\r\n".encode()
        if draw.randrange(10) == 0:
            data = data.replace(b": 13", b": 12").replace(b"dGhl", b"\xff")
        for _ in range(draw.randint(1, 5)):
            said = draw.choice((
                json.dumps({"token": TOKEN}).encode(), json.dumps({"token": "\ud800"}).encode(),
                b'{"token": NaN}', b"[" * 4000, b"\xff\xfe", b"", b"x" * 5000, self._noise(130),
            ))  # fmt: skip
            first = draw.choice((0x81, 0x81, 0x82, 0x80, 0x01, 0x88, 0x89, 0x8A, 0xC1, 0xF1, 0x83))
            length = draw.choice((len(said), len(said), 0, 2**40))
            is_masked = draw.randrange(5) > 0
            data += frame(first, said, length, is_masked)
        return FuzzedRequest(data[: draw.choice((len(data), len(data) - 1))])

    def _no_http(self) -> FuzzedRequest:
        draw = self.draw
        return FuzzedRequest(
            draw.choice((
                self._noise(2000), b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", b"\r\n" * 9,
                b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", b"SSH-2.0-x\r\n", b"GET /\r\n\r\n", b"\0" * 9,
                b"GET / HTTP/9.9\r\n\r\n", b"GET / HTTP/1.0\r\n\r\n", b"GET / HTTP/1.1\r\n\r\n",
                b"<b> <script> HTTP/1.1\r\nHost: localhost\r\nAccept: text/html\r\n\r\n",
            ))
        )  # fmt: skip

    def _pipeline(self) -> FuzzedRequest:
        draw = self.draw
        head = self._head(f"GET {draw.choice(('/', '/metrics', '/live', '/x'))}")
        return FuzzedRequest(f"{head}\r\n".encode() * draw.randint(2, 40))


def frame(first: int, said: bytes, length: int, is_masked: bool = True) -> bytes:
    """Returns a frame of a WebSocket, whose mask is zero."""
    bit = 0x80 if is_masked else 0
    if length < 126:
        head = struct.pack("!BB", first, bit | length)
    elif length < 2**16:
        head = struct.pack("!BBH", first, bit | 126, length)
    else:
        head = struct.pack("!BBQ", first, bit | 127, length)
    return head + (b"\0\0\0\0" if is_masked else b"") + said


def exchange(draw: Any, port: int, request: FuzzedRequest) -> bytes:
    """Sends a request, often in parts, and returns what is answered.

    Of one that is whole, that is the beginning. Of others, the client says no more, or it goes away
    at once.
    """
    parts: List[bytes] = []
    with socket.create_connection(("127.0.0.1", port), SECONDS) as one, contextlib.suppress(
        ConnectionError
    ):
        one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        cut = draw.randrange(len(request.data) + 1)
        for part in (request.data[:cut], request.data[cut:]):
            one.sendall(part)
        if request.is_whole:
            return one.recv(65536)
        if draw.randrange(4) == 0:
            one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            return b""
        if draw.randrange(4):  # most requests are answered by then, if there is an answer at all
            one.settimeout(0.01)
            with contextlib.suppress(socket.timeout):
                parts.append(one.recv(65536))
            one.settimeout(SECONDS)
        try:
            one.shutdown(socket.SHUT_WR)
        except OSError as err:  # the server has ended the connection
            if err.errno != errno.ENOTCONN:
                raise
        for part in iter(lambda: one.recv(65536), b""):
            parts.append(part)
    return b"".join(parts)


class FuzzedConsole:
    """A console that listens, and what it holds."""

    def __init__(self) -> None:
        self.operations = Remembered()
        self.hub = Hub([SYSTEM], lambda: {"now": 1.0, "ros": 1.0})
        access = Access(TOKEN, sees_all=False)
        self.web = WebThread(self.hub, Server(self.hub, access, self.operations), "127.0.0.1", 0)

    @property
    def port(self) -> int:
        return self.web.port

    @property
    def pages(self) -> int:
        """How many are open."""
        return int(self.hub.samples()[""][0].value)

    def holds(self) -> Tuple[int, int, int]:
        """Returns how many tasks, open files and pages there are."""
        gc.collect()
        tasks, files = asyncio.all_tasks(self.web._loop), os.listdir("/proc/self/fd")
        return len(tasks), len(files), self.pages


@contextlib.contextmanager
def fuzzed_console() -> Iterator[FuzzedConsole]:
    """A console that is ended at the end."""
    one = FuzzedConsole()
    try:
        yield one
    finally:
        one.web.close()


def check_answer(request: FuzzedRequest, answer: bytes) -> None:
    """Fails if an answer is none that there may be."""
    about = (request.data[:3000], answer[:1000])
    assert answer.startswith(b"HTTP/") or not (answer or request.is_whole), about
    assert b"Traceback" not in answer, about
    assert b" 500 " not in answer[:20], about
    head = answer.partition(b"\r\n\r\n")[0].lower()
    if answer[9:12] not in (b"200", b"101"):
        assert b"text/html" not in head, about


def check_operations(console: FuzzedConsole, *, has_right: bool = False) -> None:
    """Fails if something was done that nobody had a right to, or that cannot be sent on."""
    for wanted in console.operations.wanted:
        text = repr(wanted)
        assert has_right or STOLEN not in text
        for word in wanted:
            for one in word if isinstance(word, tuple) else [word]:
                str(one).encode()  # ROS takes nothing else


def main() -> None:
    """Fuzzes, and says what is held before and after."""
    number, seed = int(sys.argv[1]), int((*sys.argv[2:], "1")[0])
    with fuzzed_console() as console:
        fuzzer = RequestFuzzer(console.port, seed)
        answers: Dict[bytes, int] = {}
        before = console.holds()
        for count in range(number):
            request = fuzzer.request()
            answer = exchange(fuzzer.draw, console.port, request)
            check_answer(request, answer)
            answers[answer[9:12]] = answers.get(answer[9:12], 0) + 1
            if (count + 1) % max(1, number // 5) == 0:
                with open("/proc/self/statm", encoding="ascii") as file:
                    pages = int(file.read().split()[1])
                done = len(console.operations.wanted)
                check_operations(console)
                console.operations.wanted.clear()
                print(count + 1, f"{pages * 4 // 1024} MiB", console.holds(), f"{done} done")
        print(dict(sorted(answers.items())))
        wait_for(lambda: console.holds() == before, lambda: (console.holds(), before))
        print("in the end as in the beginning", before)


if __name__ == "__main__":
    main()
