"""The live channel of a page, a WebSocket: all that there is, and then what changes.

A WebSocket, and no server-sent events: a browser opens only six connections of those to a server,
so that the seventh page of an operator would wait for ever.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections import deque
from typing import Any, Callable, Deque, Mapping, Optional

from aiohttp import WSMsgType, web

from rosoclingo_console.web.access import Access
from rosoclingo_console.web.hub import Hub, Subscriber, encode

_SECONDS_TO_SAY = 5.0  # within which a page says its token
_SECONDS_TO_ANSWER = 20.0  # between two pings; a page that does not answer one is gone
_LONGEST_MESSAGE = 4096  # bytes that a page says
_MOST_WAITING = 2**22  # characters for a page that does not take them
REFUSED = 4401
"""The code by which a connection is closed whose token is wrong."""


class Channel(Subscriber):
    """Sends to one page what its hub says. Used by the event loop's thread only.

    What a page does not take waits; if that becomes too much, the connection is ended, and the page
    begins anew.
    """

    def __init__(self, hub: Hub, request: web.Request, socket: web.WebSocketResponse) -> None:
        self._hub = hub
        self._request = request
        self._socket = socket
        self._waiting: Deque[str] = deque()
        self._size = 0
        self._is_there = asyncio.Event()

    def send(self, text: str) -> None:
        """Takes a message."""
        if self._size + len(text) > _MOST_WAITING:
            self._hub.slow += 1
            self._hub.unsubscribe(self)
            self.close()
            return
        self._waiting.append(text)
        self._size += len(text)
        self._is_there.set()

    def close(self) -> None:
        """Ends the connection at once."""
        if self._request.transport is not None:
            self._request.transport.abort()

    async def write(self) -> None:
        """Sends what there is, until the connection ends."""
        with contextlib.suppress(ConnectionError):
            while not self._socket.closed:
                await self._is_there.wait()
                self._is_there.clear()
                while self._waiting:
                    text = self._waiting.popleft()
                    self._size -= len(text)
                    await self._socket.send_str(text)  # waits for a page that is slow


async def serve(
    hub: Hub,
    access: Access,
    request: web.Request,
    trusted: Callable[[Any], None],
    recording: Optional[Mapping[str, Any]] = None,
) -> web.WebSocketResponse:
    """Serves a page from its first word, which is the token, to its end.

    Args:
        hub: What is shown.
        access: Who may see and act.
        request: The page's.
        trusted: Called with aiohttp's protocol of the connection if the page has said the token.
        recording: What it is told of a recorded run; None if it is none.
    """
    socket = web.WebSocketResponse(
        heartbeat=_SECONDS_TO_ANSWER, max_msg_size=_LONGEST_MESSAGE, compress=False
    )
    try:
        await socket.prepare(request)
    except ValueError as err:  # aiohttp lets that of a key pass which is no text
        raise web.HTTPBadRequest(reason="expected a key that is Base64") from err
    token = await _first_word(socket)
    if token is None or not access.may_see(token):
        await socket.close(code=REFUSED, message=b"wrong token")
        return socket
    if access.is_token(token):
        trusted(request.protocol)
    channel = Channel(hub, request, socket)
    channel.send(
        encode(
            {
                "hello": {
                    "systems": list(hub.models),
                    "may_act": access.may_act(token),
                    "may_ask": access.is_token(token),
                    "read_only": access.read_only,
                    "recording": recording,
                }
            }
        )
    )
    hub.subscribe(channel)
    writer = asyncio.ensure_future(channel.write())
    try:
        await socket.receive()  # a page says nothing more: this is the end
    finally:
        hub.unsubscribe(channel)
        writer.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await writer
    await socket.close()
    return socket


async def _first_word(socket: web.WebSocketResponse) -> Any:
    """Returns the token that a page says first; None if it says something else, or nothing."""
    try:
        message = await socket.receive(_SECONDS_TO_SAY)
        said = json.loads(message.data) if message.type is WSMsgType.TEXT else None
    except (asyncio.TimeoutError, ValueError, RecursionError):
        return None
    token = said.get("token") if isinstance(said, dict) else None
    return token if isinstance(token, str) else None
