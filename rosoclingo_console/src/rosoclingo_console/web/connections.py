"""Connections to the web server, with limits, so that strangers cannot keep an operator out.

Whoever has shown the token keeps its place. All others share places that are limited in all and for
each address. A new connection is always let in: if there are too many then, the address that has
most of them loses the connection that it has not used for longest.
"""

from __future__ import annotations

import asyncio
import ipaddress
import logging
from collections import OrderedDict
from typing import Any, Callable, Dict, Optional

_MOST_STRANGERS = 200  # connections by which no token has come
_MOST_OF_ADDRESS = 40  # of these, from one address
_MOST_TRUSTED = 200  # connections by which the token has come
_SECONDS_TO_ASK = 10.0  # from a connection to its first request
_SECONDS_TO_RECEIVE = 30.0  # until a client has read what it was sent
_MOST_QUEUED = 50  # pipelined requests of a connection
_NETWORK_BITS = 64  # of an IPv6 address: one client has all that begin with the same ones

SECONDS_IDLE = 30.0
"""How long a connection may be without a request after its first one."""

_LOG = logging.getLogger(__name__)


class Connections:
    """All connections of a server. Used by the event loop's thread only."""

    def __init__(self, server: Any) -> None:
        """Begins without any.

        Args:
            server: aiohttp's, which makes a protocol for each connection.
        """
        self._server = server
        self._silent: Dict[Any, asyncio.TimerHandle] = {}  # connections that ask for nothing
        self._strangers = _Places(_MOST_STRANGERS, _MOST_OF_ADDRESS)
        self._trusted = _Places(_MOST_TRUSTED, _MOST_TRUSTED)

    def open(self) -> asyncio.Protocol:
        """Returns the protocol of a new connection."""
        http: Any = self._server()
        return _LimitedConnection(http, self._begin, self._end)

    def asked(self, http: Any) -> None:
        """A request has come by a connection.

        Args:
            http: aiohttp's protocol of the connection.
        """
        self._stop_timer(http)
        for places in (self._strangers, self._trusted):
            places.use(http)

    def answered(self, http: Any) -> None:
        """A request was handled; the next one has to come before the idle timeout."""
        if http.transport is not None:
            self._start_timer(http, SECONDS_IDLE)

    def trust(self, http: Any) -> None:
        """The token has come by a connection: no stranger takes its place from now on."""
        address = self._strangers.remove(http)
        if address is not None:
            self._add(self._trusted, http, address)

    def _begin(self, http: Any, address: str) -> None:
        self._start_timer(http, _SECONDS_TO_ASK)
        self._add(self._strangers, http, address)

    def _add(self, places: _Places, http: Any, address: str) -> None:
        surplus = places.add(http, address)
        if surplus is not None:
            _LOG.debug("there are too many connections; one is ended")
            self._abort(surplus)

    def _end(self, http: Any) -> None:
        self._stop_timer(http)
        for places in (self._strangers, self._trusted):
            places.remove(http)

    def _start_timer(self, http: Any, seconds: float) -> None:
        self._stop_timer(http)
        self._silent[http] = asyncio.get_event_loop().call_later(seconds, self._abort, http)

    def _stop_timer(self, http: Any) -> None:
        timer = self._silent.pop(http, None)
        if timer is not None:
            timer.cancel()

    def _abort(self, http: Any) -> None:
        self._stop_timer(http)
        if http.transport is not None:
            http.transport.abort()


class _Places:
    """Connections by their addresses, so many at most; the least recently used ones give way."""

    def __init__(self, most: int, most_of_address: int) -> None:
        self._most = most
        self._most_of_address = most_of_address
        self._addresses: Dict[Any, str] = {}
        self._used: Dict[str, OrderedDict[Any, None]] = {}  # of each address, the last one last

    def add(self, http: Any, address: str) -> Optional[Any]:
        """Adds a connection, and returns the one that it displaces, which is removed."""
        own = self._used.setdefault(address, OrderedDict())
        own[http] = None
        self._addresses[http] = address
        surplus: Optional[Any] = None
        if len(own) > self._most_of_address:
            surplus = next(iter(own))
        elif len(self._addresses) > self._most:
            fullest = max(self._used, key=lambda one: len(self._used[one]))
            surplus = next(iter(self._used[fullest]))
        if surplus is not None:
            self.remove(surplus)
        return surplus

    def use(self, http: Any) -> None:
        """Notes that a connection is used; nothing if it is none of these."""
        address = self._addresses.get(http)
        if address is not None:
            self._used[address].move_to_end(http)

    def remove(self, http: Any) -> Optional[str]:
        """Removes a connection, and returns its address; None if it is none of these."""
        address = self._addresses.pop(http, None)
        if address is not None:
            del self._used[address][http]
            if not self._used[address]:
                del self._used[address]
        return address


class _LimitedConnection(asyncio.Protocol):
    """Bounds the queues of an aiohttp connection; aborts the connection when they overflow.

    Of itself, aiohttp queues all pipelined requests without a limit, and waits for ever until the
    client reads the responses.
    """

    def __init__(
        self, http: Any, began: Callable[[Any, str], None], ended: Callable[[Any], None]
    ) -> None:
        """Takes aiohttp's protocol.

        Args:
            http: aiohttp's protocol.
            began: Called with it and the client's address when aiohttp knows the connection.
            ended: Called with it when the connection has ended.
        """
        self._http = http
        self._began = began
        self._ended = ended
        self._transport: Any = None
        self._unread: Optional[asyncio.TimerHandle] = None  # while there is unread data

    def connection_made(self, transport: Any) -> None:
        """Starts aiohttp on the connection."""
        self._transport = transport
        transport.set_write_buffer_limits(high=0)  # pauses with the first byte that is left
        self._http.connection_made(transport)
        self._began(self._http, client_address(transport.get_extra_info("peername")))

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


def client_address(peer: Any) -> str:
    """Returns the address by which connections of one client are counted.

    Of IPv6, that is the network, as one client may use all of its addresses.

    Args:
        peer: The socket's name of the other end; None if it has gone already.

    >>> client_address(("192.168.7.2", 40000)), client_address(("::ffff:192.168.7.2", 40000, 0, 0))
    ('192.168.7.2', '192.168.7.2')
    >>> client_address(("2001:db8:1:2:3:4:5:6", 40000, 0, 0)), client_address(None)
    ('2001:db8:1:2::', '')
    """
    text = str(peer[0]).partition("%")[0] if peer else ""
    try:
        address = ipaddress.ip_address(text)
    except ValueError:
        return text
    if isinstance(address, ipaddress.IPv4Address):
        return text
    if address.ipv4_mapped is not None:
        return str(address.ipv4_mapped)
    network = ipaddress.ip_network((int(address), _NETWORK_BITS), strict=False)
    return str(network.network_address)
