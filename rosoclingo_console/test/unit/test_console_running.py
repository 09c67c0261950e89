"""The console's web server in its thread, for those who connect and then do not behave."""

from __future__ import annotations

import contextlib
import gc
import gzip
import http.client
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
    fuzzed_console,
)
from console_server import SECONDS, SYSTEM, TOKEN, Remembered
from waiting import wait_for

from rosoclingo_console.web import running, server
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


def connect(port: int) -> socket.socket:
    return socket.create_connection(("127.0.0.1", port), SECONDS)


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
    monkeypatch.setattr(running, "_SECONDS_TO_ASK", 0.2)
    with web() as port, connect(port) as silent, connect(port) as slow:
        slow.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nX: ")
        assert read_all(silent) == b""
        assert read_all(slow) == b""
        assert get(port) == 200


def test_a_page_that_has_asked_stays_connected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running, "_SECONDS_TO_ASK", 0.2)
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


def test_so_many_connections(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running, "_MOST_CONNECTIONS", 3)
    with web() as port:
        open_ones = [connect(port) for _ in range(3)]
        with connect(port) as one_too_many:
            assert read_all(one_too_many) == b""
        for one in open_ones:
            one.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
            assert read_all(one).startswith(b"HTTP/1.1 200")
            one.close()
        assert get(port) == 200


def test_pipelined_requests_are_limited() -> None:
    """aiohttp would queue them all while the client does not read."""
    with web() as port, connect(port) as greedy:
        number = 20_000
        with contextlib.suppress(ConnectionError):
            greedy.sendall(b"GET /x HTTP/1.1\r\nHost: localhost\r\n\r\n" * number)
        assert read_all(greedy).count(b"HTTP/1.1 404") < number
        assert get(port) == 200


def test_who_does_not_read_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running, "_SECONDS_TO_RECEIVE", 0.2)
    monkeypatch.setattr(running, "_SECONDS_IDLE", 10 * SECONDS)
    monkeypatch.setattr(running, "_MOST_QUEUED", 10_000)
    monkeypatch.setattr(running, "_MOST_CONNECTIONS", 1)
    with web() as port, socket.socket() as slow:
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
        slow.connect(("127.0.0.1", port))
        slow.sendall(b"GET /page/page.css HTTP/1.1\r\nHost: localhost\r\n\r\n" * 2000)
        # There is room for another connection as soon as that one is aborted.
        wait_for(lambda: is_served(port))


@pytest.mark.parametrize("line", ["CONNECT /\xff", "GET /"])
def test_who_asks_once_is_disconnected(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, line: str
) -> None:
    """Also who asks then for what ends aiohttp's task, but not the connection."""
    monkeypatch.setattr(running, "_SECONDS_IDLE", 0.2)
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


def is_served(port: int) -> bool:
    with contextlib.suppress(ConnectionError, http.client.HTTPException):
        return get(port) == 200
    return False


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
