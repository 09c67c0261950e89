"""Runs the web server in a thread of its own, with limits for those who connect and say nothing."""

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
from rosoclingo_console.web.hub import Hub
from rosoclingo_console.web.server import Server

_MOST_CONNECTIONS = 200
_SECONDS_TO_ASK = 10.0  # from a connection to its first request
_SECONDS_IDLE = 30.0  # between two requests of a connection
_SECONDS_TO_RECEIVE = 30.0  # until a client has read what it was sent
_MOST_QUEUED = 50  # pipelined requests of a connection
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

    def _run(self) -> None:
        loop = self._loop
        asyncio.set_event_loop(loop)
        loop.set_exception_handler(_on_error)
        runner = web.AppRunner(
            self._server.application(),
            access_log=None,
            keepalive_timeout=_SECONDS_IDLE,
            logger=_http_log(),
            **_NO_DECOMPRESSION,
        )
        loop.run_until_complete(runner.setup())
        server = runner.server
        assert server is not None
        door = _Door(server)
        self._server.asked, self._server.answered = door.keep, door.wait
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


class _Door:
    """Lets connections in: so many at a time, and only those that ask for something soon."""

    def __init__(self, server: Any) -> None:
        self._server = server  # aiohttp's, which makes a protocol for each connection
        self._silent: Dict[Any, asyncio.TimerHandle] = {}  # connections that ask for nothing

    def open(self) -> asyncio.Protocol:
        """Returns the protocol of a new connection."""
        http: Any = self._server()
        # Once aiohttp knows the connection.
        asyncio.get_event_loop().call_later(0.0, self._count, http)
        self._wait(http, _SECONDS_TO_ASK)
        return _LimitedConnection(http, self.keep)

    def _count(self, http: Any) -> None:
        if http in self._server.connections[_MOST_CONNECTIONS:]:
            self._close(http)

    def keep(self, http: Any) -> None:
        """A connection has asked for something, or has ended."""
        timer = self._silent.pop(http, None)
        if timer is not None:
            timer.cancel()

    def wait(self, http: Any) -> None:
        """A request was handled; the next one has to come before the idle timeout."""
        if http.transport is not None:
            self._wait(http, _SECONDS_IDLE)

    def _wait(self, http: Any, seconds: float) -> None:
        self.keep(http)
        self._silent[http] = asyncio.get_event_loop().call_later(seconds, self._close, http)

    def _close(self, http: Any) -> None:
        self.keep(http)
        if http.transport is not None:
            http.transport.abort()


class _LimitedConnection(asyncio.Protocol):
    """Bounds the queues of an aiohttp connection; aborts the connection when they overflow.

    Of itself, aiohttp queues all pipelined requests without a limit, and waits for ever until the
    client reads the responses.
    """

    def __init__(self, http: Any, ended: Callable[[Any], None]) -> None:
        """Takes aiohttp's protocol.

        Args:
            http: aiohttp's protocol.
            ended: Called with it when the connection has ended.
        """
        self._http = http
        self._ended = ended
        self._transport: Any = None
        self._unread: Optional[asyncio.TimerHandle] = None  # while there is unread data

    def connection_made(self, transport: Any) -> None:
        """Starts aiohttp on the connection."""
        self._transport = transport
        transport.set_write_buffer_limits(high=0)  # pauses with the first byte that is left
        self._http.connection_made(transport)

    def data_received(self, data: bytes) -> None:
        """Has aiohttp parse the data; aborts if that leaves too many requests queued."""
        self._http.data_received(data)
        # The queue has no public name.
        if len(getattr(self._http, "_messages", ())) > _MOST_QUEUED:
            _LOG.debug("a client sends requests, and waits for no answers")
            self._transport.abort()

    def eof_received(self) -> Optional[bool]:
        """The client sends no more."""
        ends: Optional[bool] = self._http.eof_received()
        return ends

    def connection_lost(self, exc: Optional[Exception]) -> None:
        """Tells aiohttp, and stops the timers."""
        self._stop_timer()
        self._ended(self._http)
        self._http.connection_lost(exc)

    def pause_writing(self) -> None:
        """The client has not read all that was sent; starts the timeout."""
        later = asyncio.get_event_loop().call_later
        self._unread = later(_SECONDS_TO_RECEIVE, self._transport.abort)
        self._http.pause_writing()

    def resume_writing(self) -> None:
        """The client has read all of it."""
        self._stop_timer()
        self._http.resume_writing()

    def _stop_timer(self) -> None:
        if self._unread is not None:
            self._unread.cancel()
            self._unread = None
