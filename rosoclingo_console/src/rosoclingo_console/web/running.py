"""Runs the web server in a thread of its own, with limits for those who connect and say nothing."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from typing import Any, Callable, Dict, Optional

from aiohttp import web

from rosclingo.errors import RosclingoError
from rosoclingo_console.web.hub import Hub
from rosoclingo_console.web.server import Server

_MOST_CONNECTIONS = 200
_SECONDS_TO_ASK = 10.0  # from a connection to its first request
_SECONDS_IDLE = 30.0  # between two requests of a connection
_SECONDS_TO_END = 1.0  # that open pages have at the end


class AddressError(RosclingoError):
    """The server cannot listen; the message names address, port and remedy."""


class WebThread:
    """The web server's thread with its event loop."""

    def __init__(
        self,
        hub: Hub,
        server: Server,
        address: str,
        port: int,
        begin: Callable[[], None] = lambda: None,
    ) -> None:
        """Starts to listen, and returns when the server does.

        Args:
            hub: What is shown.
            server: Handles requests.
            address: Where to listen: an address or a name of this machine.
            port: Likewise; 0 for any that is free.
            begin: Called once in the server's thread, when its event loop runs.

        Raises:
            AddressError: That is not possible.
        """
        self._hub = hub
        self._server = server
        self._address = address
        self._begin = begin
        self.port = port
        self._error: Optional[OSError] = None
        self._is_ready = threading.Event()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="web", daemon=True)
        self._thread.start()
        self._is_ready.wait()
        if self._error is not None:
            raise AddressError(
                f"cannot listen on {address}, port {port}: {self._error}; _address:= and _port:= "
                "set others"
            )

    def close(self) -> None:
        """Ends the server. Thread-safe; may be called twice."""
        with contextlib.suppress(RuntimeError):  # the loop is closed
            self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(2 * _SECONDS_TO_END)

    def is_alive(self) -> bool:
        """Whether the server still runs."""
        return self._thread.is_alive()

    def _run(self) -> None:
        loop = self._loop
        asyncio.set_event_loop(loop)
        runner = web.AppRunner(
            self._server.application(), access_log=None, keepalive_timeout=_SECONDS_IDLE
        )
        loop.run_until_complete(runner.setup())
        server = runner.server
        assert server is not None
        door = _Door(server)
        self._server.asked = door.keep
        try:
            listening = loop.run_until_complete(
                loop.create_server(door.open, self._address, self.port)
            )
        except OSError as err:
            self._error = err
        else:
            assert listening.sockets
            self.port = listening.sockets[0].getsockname()[1]
            self._hub.start(loop)
            loop.call_soon(self._begin)
            self._is_ready.set()
            loop.run_forever()
            listening.close()
            self._hub.close()
            loop.run_until_complete(server.shutdown(_SECONDS_TO_END))
        loop.run_until_complete(runner.cleanup())
        self._server.close()
        loop.close()
        self._is_ready.set()


class _Door:
    """Lets connections in: so many at a time, and only those that ask for something soon."""

    def __init__(self, server: Any) -> None:
        self._server = server  # aiohttp's, which makes a protocol for each connection
        self._silent: Dict[Any, asyncio.TimerHandle] = {}  # connections without a whole request

    def open(self) -> asyncio.Protocol:
        """Returns the protocol of a new connection."""
        protocol: Any = self._server()
        later = asyncio.get_event_loop().call_later
        later(0.0, self._count, protocol)  # once aiohttp knows the connection
        self._silent[protocol] = later(_SECONDS_TO_ASK, self._close, protocol)
        return protocol

    def _count(self, protocol: Any) -> None:
        if protocol in self._server.connections[_MOST_CONNECTIONS:]:
            self._close(protocol)

    def keep(self, protocol: Any) -> None:
        """A connection has asked for something."""
        timer = self._silent.pop(protocol, None)
        if timer is not None:
            timer.cancel()

    def _close(self, protocol: Any) -> None:
        self.keep(protocol)
        if protocol.transport is not None:
            protocol.transport.abort()
