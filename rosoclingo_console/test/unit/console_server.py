"""A console's server without ROS, with systems that only remember what they were asked for."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import inspect
import json
import threading
from typing import Any, AsyncIterator, Callable, Coroutine, Dict, List, Tuple

from aiohttp import ClientWebSocketResponse, WSMsgType
from aiohttp.test_utils import TestClient, TestServer

from rosoclingo.loop.journal import Control
from rosoclingo_console.web.access import Access
from rosoclingo_console.web.hub import Hub
from rosoclingo_console.web.operations import OperationReply, Operations
from rosoclingo_console.web.server import Server

TOKEN = "0123456789abcdef0123456789abcdef"
SYSTEM = "/rosoclingo"
SECONDS = 60.0  # no more than a bound for what never comes


class Remembered(Operations):
    """Remembers what was wanted; waits for what a test lets go."""

    def __init__(self) -> None:
        self.wanted: List[Tuple[Any, ...]] = []
        self.goes_on = threading.Event()
        self.goes_on.set()

    def _note(self, *wanted: Any) -> OperationReply:
        self.wanted.append(wanted)
        self.goes_on.wait(SECONDS)
        return OperationReply(True, "taken")

    def control(
        self, system: str, control: Control, actuator: str, action: str, token: int
    ) -> OperationReply:
        return self._note(system, control.value, actuator, action, token)

    def send_goal(self, system: str, request: str, information: Tuple[str, ...]) -> OperationReply:
        return self._note(system, request, information)

    def send_message(self, system: str, source: str, value: str) -> OperationReply:
        return self._note(system, source, value)

    def cancel(self, system: str, goal: str) -> OperationReply:
        return self._note(system, goal)

    def ask(self, system: str, question: str, arguments: Tuple[str, ...]) -> OperationReply:
        return self._note(system, question, arguments)

    def record(self, system: str, is_on: bool) -> OperationReply:
        return self._note(system, is_on)


class Console:
    """A server and a browser."""

    def __init__(self, client: TestClient, hub: Hub, operations: Remembered) -> None:
        self.client = client
        self.hub = hub
        self.operations = operations

    @property
    def origin(self) -> str:
        return f"http://{self.client.host}:{self.client.port}"

    def headers(self, token: str = TOKEN, **others: str) -> Dict[str, str]:
        """What a browser sends with a request of the page."""
        headers = {"Origin": self.origin, "Authorization": f"Bearer {token}"}
        headers.update({name.replace("_", "-"): value for name, value in others.items()})
        return {name: value for name, value in headers.items() if value}

    async def do(self, kind: str, body: Any, **headers: str) -> Tuple[int, Any]:
        """Sends an operator's request, and returns status and answer."""
        sent = self.headers(Content_Type="application/json", **headers)
        response = await self.client.post(f"/do/{kind}", data=json.dumps(body), headers=sent)
        return response.status, await response.json()

    async def live(self, token: Any = TOKEN, **headers: str) -> ClientWebSocketResponse:
        """Opens the live channel, and says the token."""
        socket = await self.client.ws_connect("/live", headers=self.headers(token="", **headers))
        await socket.send_str(json.dumps({"token": token}))
        return socket


async def hear(socket: ClientWebSocketResponse, word: str) -> Any:
    """Returns what comes next of a kind, such as ``hello``."""
    while True:
        message = await socket.receive(SECONDS)
        assert message.type is WSMsgType.TEXT, message
        said = json.loads(message.data)
        if word in said:
            return said


async def closed(socket: ClientWebSocketResponse) -> int:
    """Waits until the server has closed a channel, and returns the code."""
    while not socket.closed:
        await socket.receive(SECONDS)
    assert socket.close_code is not None
    return socket.close_code


async def until(condition: Callable[[], Any]) -> None:
    """Waits until a condition holds."""
    end = asyncio.get_event_loop().time() + SECONDS
    while not condition():
        assert asyncio.get_event_loop().time() < end
        await asyncio.sleep(0.002)


@contextlib.asynccontextmanager
async def console(**rules: Any) -> AsyncIterator[Console]:
    """A console, by default as one that listens on this machine only."""
    hub, operations = Hub([SYSTEM], lambda: {"now": 5.0, "ros": 2.0}), Remembered()
    access = Access(TOKEN, **{"sees_all": True, **rules})
    server = Server(hub, access, operations)
    hub.start(asyncio.get_event_loop())
    async with TestClient(TestServer(server.application())) as client:
        try:
            yield Console(client, hub, operations)
        finally:
            operations.goes_on.set()
            server.close()


def awaited(test: Callable[..., Coroutine[Any, Any, None]]) -> Callable[..., None]:
    """Makes a test of a coroutine."""

    @functools.wraps(test)
    def call(*arguments: Any, **named: Any) -> None:
        asyncio.run(test(*arguments, **named))

    return call


def with_console(**rules: Any) -> Callable[..., Callable[..., None]]:
    """Makes a test of a coroutine, which has a console as its first argument."""

    def make(test: Callable[..., Coroutine[Any, Any, None]]) -> Callable[..., None]:
        async def call(**named: Any) -> None:
            async with console(**rules) as one:
                await test(one, **named)

        made = awaited(functools.update_wrapper(call, test))
        _, *others = inspect.signature(test).parameters.values()
        made.__signature__ = inspect.Signature(others)  # type: ignore[attr-defined]
        return made

    return make
