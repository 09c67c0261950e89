"""The console's web server in its thread, for those who connect and then do not behave."""

from __future__ import annotations

import contextlib
import gc
import gzip
import http.client
import os
import socket
import threading
import tracemalloc
from typing import Iterator

import pytest
from console_fuzz import (
    RequestFuzzer,
    check_answer,
    check_operations,
    exchange,
    frame,
    fuzzed_console,
)
from console_server import SECONDS, SYSTEM, TOKEN, Remembered
from waiting import wait_for

from rosoclingo_console.web import connections, running, server
from rosoclingo_console.web.access import Access
from rosoclingo_console.web.hub import Hub
from rosoclingo_console.web.running import AddressError, WebThread
from rosoclingo_console.web.server import Server


@contextlib.contextmanager
def web(port: int = 0) -> Iterator[int]:
    """A server that listens; its port."""
    hub = Hub([SYSTEM], lambda: {"now": 1.0, "ros": 1.0})
    thread = WebThread(
        hub, Server(hub, Access(TOKEN, sees_all=True), Remembered()), "127.0.0.1", port
    )
    try:
        yield thread.port
    finally:
        thread.close()
        thread.close()
        assert all(one.name != "web" for one in threading.enumerate())


def connect(port: int, address: str = "127.0.0.1") -> socket.socket:
    """Connects from an address of this machine."""
    return socket.create_connection(("127.0.0.1", port), SECONDS, (address, 0))


def get(port: int, path: str = "/") -> int:
    """Asks as a browser does, and returns the status."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=SECONDS)
    with contextlib.closing(connection):
        connection.request("GET", path)
        return connection.getresponse().status


def read_all(one: socket.socket) -> bytes:
    """Returns what comes until the server ends the connection."""
    parts = []
    with contextlib.suppress(ConnectionError):
        for part in iter(lambda: one.recv(65536), b""):
            parts.append(part)
    return b"".join(parts)


def test_it_serves_and_ends_with_open_connections() -> None:
    with web() as port:
        assert get(port) == 200
        with connect(port) as silent, connect(port) as live:
            shake = (
                f"GET /live HTTP/1.1\r\nHost: localhost:{port}\r\nOrigin: http://localhost:{port}\r\n"
                "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
            )
            live.sendall(shake.encode())
            assert live.recv(12) == b"HTTP/1.1 101"
            silent.sendall(b"GET / HT")


@pytest.mark.parametrize(
    "kind",
    [
        b"application/json; charset=utf-8",  # which lacks the operation's fields
        *(b"application/json\xcf\xa4\xa1", b"\xff", b""),
    ],
)
def test_bytes_that_are_no_content_type(kind: bytes) -> None:
    with web() as port, connect(port) as one:
        lines = [
            b"POST /do/cancel HTTP/1.1", b"Host: localhost:%d" % port, b"Connection: close",
            b"Origin: http://localhost:%d" % port, b"Authorization: Bearer %s" % TOKEN.encode(),
            b"Content-Type: %s" % kind, b"Content-Length: 2", b"", b"{}",
        ]  # fmt: skip
        one.sendall(b"\r\n".join(lines))
        answer = read_all(one)
    assert answer.startswith(b"HTTP/1.1 400"), answer
    assert (b"content type" in answer) is (b";" not in kind)


def test_bytes_that_are_no_key_of_a_channel() -> None:
    with web() as port, connect(port) as one:
        lines = [
            b"GET /live HTTP/1.1", b"Host: localhost:%d" % port, b"Connection: Upgrade",
            b"Origin: http://localhost:%d" % port, b"Upgrade: websocket",
            b"Sec-WebSocket-Version: 13", b"Sec-WebSocket-Key: \xff\xa1", b"", b"",
        ]  # fmt: skip
        one.sendall(b"\r\n".join(lines))
        assert one.recv(12) == b"HTTP/1.1 400"


def test_a_port_that_is_taken() -> None:
    with web() as port, pytest.raises(AddressError, match=f"port {port}.*_port:="), web(port):
        pass


def test_who_says_nothing_is_disconnected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "_SECONDS_TO_ASK", 0.2)
    with web() as port, connect(port) as silent, connect(port) as slow:
        slow.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nX: ")
        assert read_all(silent) == b""
        assert read_all(slow) == b""
        assert get(port) == 200


def test_a_page_that_has_asked_stays_connected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "_SECONDS_TO_ASK", 0.2)
    with web() as port, contextlib.closing(
        http.client.HTTPConnection("127.0.0.1", port, timeout=SECONDS)
    ) as page:
        page.request("GET", "/")
        page.getresponse().read()
        kept = page.sock
        with connect(port) as silent:
            read_all(silent)  # so long as somebody who says nothing may be there
        page.request("GET", "/")
        assert page.getresponse().status == 200
        assert page.sock is kept


def test_a_request_that_does_not_come_to_its_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "_SECONDS_TO_SEND", 0.2)
    with web() as port, connect(port) as slow:
        slow.sendall(
            f"POST /do/goal HTTP/1.1\r\nHost: localhost:{port}\r\nOrigin: http://localhost:{port}\r\n"
            f"Authorization: Bearer {TOKEN}\r\nContent-Type: application/json\r\n"
            "Content-Length: 100\r\n\r\n{".encode()
        )
        assert slow.recv(12) == b"HTTP/1.1 408"


def ask(one: socket.socket, *headers: str, path: str = "/") -> int:
    """Asks by a connection, and returns the status; 0 if the connection has ended."""
    with contextlib.suppress(ConnectionError, http.client.BadStatusLine):
        one.sendall(
            "\r\n".join([f"GET {path} HTTP/1.1", "Host: localhost", *headers, "", ""]).encode()
        )
        answer = http.client.HTTPResponse(one)
        answer.begin()
        answer.read()
        return answer.status
    return 0


def with_token(port: int) -> socket.socket:
    """Returns a connection by which the token has come."""
    one = connect(port)
    assert ask(one, f"Authorization: Bearer {TOKEN}", path="/metrics") == 200
    return one


def test_an_operator_gets_through_a_crowd_of_strangers() -> None:
    """Strangers of the operator's own address hold as many connections as they like."""
    with web() as port, contextlib.ExitStack() as crowd:
        operator = crowd.enter_context(with_token(port))
        strangers = [crowd.enter_context(connect(port)) for _ in range(230)]
        answers = [ask(one) for one in strangers]
        assert sum(bool(answer) for answer in answers) == connections._MOST_OF_ADDRESS
        assert all(answers[-connections._MOST_OF_ADDRESS :])  # who came last is let in
        body = '{"system": "/rosoclingo", "control": "pause"}'
        request = (
            f"POST /do/control HTTP/1.1\r\nHost: localhost\r\nOrigin: http://localhost\r\n"
            f"Authorization: Bearer {TOKEN}\r\nContent-Type: application/json\r\n"
            f"Content-Length: {len(body)}\r\n\r\n{body}"
        )
        for one in (operator, crowd.enter_context(connect(port))):
            one.sendall(request.encode())
            assert b'"done": true' in read_answer(one)
        assert get(port) == 200


def read_answer(one: socket.socket) -> bytes:
    """Returns an answer whose body is in JSON."""
    answer = b""
    while not answer.endswith(b"}"):
        part = one.recv(65536)
        assert part, answer
        answer += part
    return answer


def test_a_page_with_the_token_keeps_its_channel(monkeypatch: pytest.MonkeyPatch) -> None:
    """The token is the first word of the channel, and not in a header."""
    monkeypatch.setattr(connections, "_MOST_OF_ADDRESS", 3)
    with web() as port, contextlib.ExitStack() as crowd:
        channels = [crowd.enter_context(connect(port)) for _ in range(2)]
        for one, token in zip(channels, (TOKEN, "")):
            headers = (
                "Host: localhost", "Origin: http://localhost", "Connection: Upgrade",
                "Upgrade: websocket",
                "Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
            )  # fmt: skip
            one.sendall("\r\n".join(["GET /live HTTP/1.1", *headers, "", ""]).encode())
            said = b'{"token": "%s"}' % token.encode()
            one.sendall(frame(0x81, said, len(said)))
            answer = b""
            while b"hello" not in answer:
                answer += one.recv(65536)
        for _ in range(3):
            crowd.enter_context(connect(port))
        read_all(channels[1])  # whoever may only look gives way
        channels[0].settimeout(0.0)
        with contextlib.suppress(BlockingIOError):
            while True:
                assert channels[0].recv(65536)


def test_who_uses_a_connection_keeps_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "_MOST_OF_ADDRESS", 2)
    with web() as port, connect(port) as used, connect(port) as unused:
        assert [ask(unused), ask(used)] == [200, 200]
        with connect(port) as other:
            assert [ask(other), ask(used)] == [200, 200]
            assert read_all(unused) == b""


def test_the_address_with_most_connections_gives_way(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "_MOST_STRANGERS", 4)
    with web() as port, contextlib.ExitStack() as crowd:
        alone = crowd.enter_context(connect(port, "127.0.0.2"))
        strangers = [crowd.enter_context(connect(port, "127.0.0.3")) for _ in range(3)]
        assert [ask(alone), *map(ask, strangers)] == 4 * [200]
        other = crowd.enter_context(connect(port, "127.0.0.4"))
        assert read_all(strangers[0]) == b""
        assert [ask(alone), ask(other), *map(ask, strangers[1:])] == 4 * [200]


def test_connections_with_the_token_have_a_limit_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "_MOST_TRUSTED", 2)
    with web() as port, with_token(port) as first, with_token(port), with_token(port):
        assert read_all(first) == b""


def test_pipelined_requests_are_limited() -> None:
    """aiohttp would queue them all while the client does not read."""
    with web() as port, connect(port) as greedy:
        number = 20_000
        with contextlib.suppress(ConnectionError):
            greedy.sendall(b"GET /x HTTP/1.1\r\nHost: localhost\r\n\r\n" * number)
        assert read_all(greedy).count(b"HTTP/1.1 404") < number
        assert get(port) == 200


def test_who_does_not_read_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "_SECONDS_TO_RECEIVE", 0.2)
    monkeypatch.setattr(connections, "SECONDS_IDLE", 10 * SECONDS)
    monkeypatch.setattr(connections, "_MOST_QUEUED", 10_000)
    with web() as port, socket.socket() as slow:
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
        files = count_files()
        slow.connect(("127.0.0.1", port))
        slow.sendall(b"GET /page/page.css HTTP/1.1\r\nHost: localhost\r\n\r\n" * 2000)
        wait_for(lambda: count_files() > files)  # the server's end of the connection
        wait_for(lambda: count_files() == files)
        assert get(port) == 200


@pytest.mark.parametrize("line", ["CONNECT /\xff", "GET /"])
def test_who_asks_once_is_disconnected(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, line: str
) -> None:
    """Also who asks then for what ends aiohttp's task, but not the connection."""
    monkeypatch.setattr(connections, "SECONDS_IDLE", 0.2)
    with web() as port, connect(port) as one:
        one.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert one.recv(12) == b"HTTP/1.1 200"
        text = f"{line} HTTP/1.1\r\nHost: localhost\r\n\r\n"
        with contextlib.suppress(ConnectionError):  # a slow machine may have ended it already
            one.sendall(text.encode("latin-1"))
        read_all(one)
        assert get(port) == 200
    gc.collect()
    assert not [record for record in caplog.records if record.exc_info]


def count_files() -> int:
    """Returns how many files and sockets this process has open."""
    return len(os.listdir("/proc/self/fd"))


@pytest.mark.parametrize(
    ("header", "body"),
    [("Content-Length: 100", b"{"), ("Transfer-Encoding: chunked", b"5\r\n[1,2]\r\nx\r\n")],
)
def test_a_body_that_is_cut_or_malformed(
    caplog: pytest.LogCaptureFixture, header: str, body: bytes
) -> None:
    """It is no fault of the server's, so that the log has no traceback of it."""
    with fuzzed_console() as console, connect(console.port) as one:
        one.sendall(
            f"POST /do/goal HTTP/1.1\r\nHost: localhost\r\nOrigin: http://localhost\r\n"
            f"Authorization: Bearer {TOKEN}\r\nContent-Type: application/json\r\n"
            f"Expect: 100-continue\r\n{header}\r\n\r\n".encode()
        )
        assert one.recv(12) == b"HTTP/1.1 100"  # so that it is read
        one.sendall(body)
        one.shutdown(socket.SHUT_WR)
        answer = read_all(one)
        assert b" 500 " not in answer
        assert get(console.port) == 200
        assert not console.operations.wanted
    assert not [record for record in caplog.records if record.exc_info]


@pytest.mark.skipif(not running._NO_DECOMPRESSION, reason="aiohttp has no such option")
def test_a_compressed_body_is_left_as_it_is() -> None:
    """Some kilobytes would become 30 MiB, before anything asks for a token."""
    body = gzip.compress(bytes(30 * 2**20))
    with web() as port, connect(port) as one:
        head = (
            f"POST /do/goal HTTP/1.1\r\nHost: localhost:{port}\r\nConnection: close\r\n"
            f"Content-Encoding: gzip\r\nContent-Length: {len(body)}\r\n\r\n"
        )
        tracemalloc.start()
        try:
            one.sendall(head.encode() + body)
            assert read_all(one).startswith(b"HTTP/1.1 403")
            assert tracemalloc.get_traced_memory()[1] < 10 * 2**20
        finally:
            tracemalloc.stop()


@pytest.mark.costly
def test_fuzzed_requests(caplog: pytest.LogCaptureFixture) -> None:
    """Whatever comes: nothing is done without a right to it, and the next one is served.

    By hand, console_fuzz.py sends as many as you like.
    """
    with fuzzed_console() as console:
        fuzzer = RequestFuzzer(console.port, seed=1)
        for _ in range(300):
            request = fuzzer.request()
            check_answer(request, exchange(fuzzer.draw, console.port, request))
        assert get(console.port) == 200
        wait_for(lambda: console.pages == 0)
        check_operations(console)
        assert console.operations.wanted
        assert not [record for record in caplog.records if record.exc_info]
