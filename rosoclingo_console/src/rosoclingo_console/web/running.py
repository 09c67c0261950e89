"""Runs the web server in a thread of its own."""

from __future__ import annotations

import asyncio
import contextlib
import inspect
import logging
import threading
from typing import Any, Callable, Dict, Mapping, Optional

from aiohttp import web
from aiohttp.http_exceptions import HttpProcessingError

from rosclingo.errors import RosclingoError
from rosoclingo_console.web.connections import SECONDS_IDLE, Connections
from rosoclingo_console.web.hub import Hub
from rosoclingo_console.web.server import Server

_SECONDS_TO_END = 1.0  # that open pages have at the end

_LOG = logging.getLogger(__name__)


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
            port: Where to listen: the port; 0 for any that is free.
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

    def _run(self) -> None:
        loop = self._loop
        asyncio.set_event_loop(loop)
        loop.set_exception_handler(_on_error)
        runner = web.AppRunner(
            self._server.application(),
            access_log=None,
            keepalive_timeout=SECONDS_IDLE,
            logger=_http_log(),
            **_NO_DECOMPRESSION,
        )
        loop.run_until_complete(runner.setup())
        server = runner.server
        assert server is not None
        connections = Connections(server)
        self._server.asked = connections.asked
        self._server.answered = connections.answered
        self._server.trusted = connections.trust
        try:
            listening = loop.run_until_complete(
                loop.create_server(connections.open, self._address, self.port)
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


# What aiohttp raises when a client sends something malformed, or goes away.
_FAULTS_OF_CLIENTS = (
    HttpProcessingError,
    web.RequestPayloadError,
    ConnectionError,
    UnicodeError,  # of names of hosts; it ends aiohttp's task, and leaves the connection
)


def _http_log() -> logging.Logger:
    """Returns a logger for aiohttp, without a traceback for each malformed request."""
    log = logging.getLogger(f"{__name__}.http")
    log.addFilter(_is_fault_of_server)  # added twice, it is there once
    return log


def _is_fault_of_server(record: logging.LogRecord) -> bool:
    error = record.exc_info[1] if record.exc_info else None
    # aiohttp asserts that a client has not gone while its requests wait.
    return not isinstance(error, (*_FAULTS_OF_CLIENTS, AssertionError))


def _on_error(loop: asyncio.AbstractEventLoop, context: Dict[str, Any]) -> None:
    if not isinstance(context.get("exception"), _FAULTS_OF_CLIENTS):
        loop.default_exception_handler(context)


# A small compressed body may become a large one before it is refused. aiohttp of Ubuntu 20.04
# has no such option.
_NO_DECOMPRESSION: Mapping[str, bool] = (
    {"auto_decompress": False}
    if "auto_decompress" in inspect.signature(web.RequestHandler.__init__).parameters
    else {}
)
