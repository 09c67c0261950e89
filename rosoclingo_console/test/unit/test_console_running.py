"""The console's web server in its thread, for those who connect and then do not behave."""

from __future__ import annotations

import contextlib
import http.client
import json
import random
import socket
from typing import Any, Iterator

import pytest
from console_server import SECONDS, SYSTEM, TOKEN, Remembered

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
        assert not thread.is_alive()


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


def noise(draw: random.Random, port: int) -> bytes:
    """A request of which something is wrong."""
    good = (
        f"POST /do/goal HTTP/1.1\r\nHost: localhost:{port}\r\nOrigin: http://localhost:{port}\r\n"
        f"Authorization: Bearer {TOKEN}\r\nContent-Type: application/json\r\n"
    ).encode()
    body = json.dumps({"system": SYSTEM, "request": "a", "information": ["b"]}).encode()
    text = bytearray(good + b"Content-Length: %d\r\n\r\n" % len(body) + body)
    for _ in range(draw.randint(1, 20)):
        place = draw.randrange(len(text))
        kind = draw.randrange(3)
        if kind == 0:
            text[place] = draw.randrange(256)
        elif kind == 1:
            del text[place : place + draw.randint(1, 9)]
        else:
            text[place:place] = bytes(draw.randrange(256) for _ in range(draw.randint(1, 9)))
    return bytes(text)


def test_noise() -> None:
    """Whatever comes: there is an answer or none, and the next one is served."""
    draw: Any = random.Random(1)
    with web() as port:
        for _ in range(300):
            with connect(port) as one:
                one.sendall(noise(draw, port))
                one.shutdown(socket.SHUT_WR)
                answer = read_all(one)
            assert answer.startswith(b"HTTP/") or not answer  # with the version that was asked for
            assert b"Traceback" not in answer
            assert b"500" not in answer[:20]
        assert get(port) == 200
