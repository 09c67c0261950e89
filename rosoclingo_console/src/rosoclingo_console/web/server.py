"""The console's web application: the page, its live channel, requests of operators, and metrics."""

from __future__ import annotations

import asyncio
import json
import logging
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Awaitable, Callable, Mapping, Optional

from aiohttp import web

from rosoclingo_console.model.metrics import exposition
from rosoclingo_console.web import channel
from rosoclingo_console.web.access import Access
from rosoclingo_console.web.files import read_files
from rosoclingo_console.web.hub import Hub
from rosoclingo_console.web.operations import (
    HOLDS_BACK,
    ONLY_LOOKS,
    READERS,
    Body,
    Call,
    OperationReply,
    Operations,
    RequestError,
)

_LONGEST_BODY = 2**16  # bytes
_SECONDS_TO_SEND = 5.0  # that a request's body may take
_MOST_CALLS = 8  # requests that are carried out at a time
_MOST_CONTROLS = 4  # more of those that control a run
_BEARER = "Bearer "

HEADERS: Mapping[str, str] = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "connect-src 'self'; img-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'; require-trusted-types-for 'script'; trusted-types 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cache-Control": "no-store",
}
"""Headers of each response: only our scripts run, and no other site frames or caches it."""

_LOG = logging.getLogger(__name__)
_Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class Server:
    """Handles requests. Used by the event loop's thread only.

    Attributes:
        asked: Called with aiohttp's protocol of the connection by which a request has come.
        answered: Called with that protocol when the request was handled.
        trusted: The same, once the token has come.
    """

    def __init__(
        self,
        hub: Hub,
        access: Access,
        operations: Operations,
        log: Callable[[str], None] = _LOG.info,
    ) -> None:
        """Reads the files of the page.

        Args:
            hub: What is shown.
            access: Who may do what.
            operations: Has requests carried out.
            log: Called with a line for each request of an operator.
        """
        self._hub = hub
        self._access = access
        self._operations = operations
        self._log = log
        self._files = read_files()
        self.asked: Callable[[Any], None] = lambda _: None
        self.answered: Callable[[Any], None] = lambda _: None
        self.trusted: Callable[[Any], None] = lambda _: None
        self._calls = 0
        self._threads = ThreadPoolExecutor(_MOST_CALLS + _MOST_CONTROLS, "operator")

    def application(self) -> web.Application:
        """Returns the application."""

        async def guard(request: web.Request, handler: _Handler) -> web.StreamResponse:
            self.asked(request.protocol)
            if self._access.is_token(_token(request)):
                self.trusted(request.protocol)
            try:
                return await self._guard(request, handler)
            finally:
                self.answered(request.protocol)

        application = web.Application(
            middlewares=[web.middleware(guard)], client_max_size=_LONGEST_BODY
        )
        application.router.add_get("/", self._on_file)
        application.router.add_get("/page/{name}", self._on_file)
        application.router.add_get("/live", self._on_live)
        application.router.add_get("/metrics", self._on_metrics)
        application.router.add_post("/do/{kind}", self._on_do)
        return application

    def close(self) -> None:
        """Takes no further requests of operators."""
        self._threads.shutdown(wait=False)

    async def _guard(self, request: web.Request, handler: _Handler) -> web.StreamResponse:
        if not self._access.is_host(request.headers.get("Host", "")):
            response: web.StreamResponse = _refusal(
                421, "this server is not known by that name; _hosts:=NAME allows another one"
            )
        else:
            try:
                response = await handler(request)
            except web.HTTPException as err:
                response = _refusal(err.status, err.reason)
            except Exception as err:
                if not (isinstance(err, ConnectionError) and _is_gone(request)):
                    _LOG.exception("a request was not carried out")
                response = _refusal(500, "internal error; the console's log has more")
        if not response.prepared:
            response.headers.update(HEADERS)
        return response

    async def _on_file(self, request: web.Request) -> web.StreamResponse:
        file = self._files.get(request.match_info.get("name", "index.html"))
        if file is None:
            return _refusal(404, "there is no such file")
        return web.Response(body=file.content, content_type=file.kind, charset="utf-8")

    async def _on_live(self, request: web.Request) -> web.StreamResponse:
        if not self._is_from_here(request):
            return _refusal(403, "only the page of this server may ask for that")
        return await channel.serve(
            self._hub, self._access, request, self.trusted, self._operations.about()
        )

    async def _on_metrics(self, request: web.Request) -> web.StreamResponse:
        if not self._access.may_see(_token(request)):
            return _refusal(401, "the header Authorization: Bearer TOKEN is missing or wrong")
        return web.Response(
            text=exposition(self._hub.samples()),
            headers={"Content-Type": "text/plain; version=0.0.4; charset=utf-8"},
        )

    async def _on_do(self, request: web.Request) -> web.StreamResponse:
        kind = request.match_info["kind"]
        if not self._is_from_here(request):
            return _refusal(403, "only the page of this server may ask for that")
        if not self._access.is_token(_token(request)):
            return _refusal(401, "the token is missing or wrong; open the link of console.py again")
        if kind not in READERS:
            return _refusal(404, f"there are {', '.join(READERS)}")
        if kind not in ONLY_LOOKS and self._access.read_only:
            return _refusal(403, "this console is read-only")
        try:
            body = await asyncio.wait_for(_body(request), _SECONDS_TO_SEND)
            call = READERS[kind](Body(body, tuple(self._hub.models)))
        except RequestError as err:
            return _refusal(400, str(err))
        except asyncio.TimeoutError:
            return _refusal(408, "the request did not come")
        most = _MOST_CALLS + (_MOST_CONTROLS if kind == HOLDS_BACK else 0)
        if self._calls >= most:
            return _refusal(503, f"{self._calls} requests are under way; try again")
        self._log(f"{request.remote} asks for {kind}: {json.dumps(body)}")
        reply = await self._call(call)
        return web.json_response(reply.as_json())

    async def _call(self, call: Call) -> OperationReply:
        loop = asyncio.get_event_loop()
        self._calls += 1
        running = loop.run_in_executor(self._threads, call, self._operations)
        running.add_done_callback(self._on_end)
        # Shielded, so that it counts as under way when the page has gone.
        return await asyncio.shield(running)

    def _on_end(self, _: Any) -> None:
        self._calls -= 1

    def _is_from_here(self, request: web.Request) -> bool:
        headers = request.headers
        site: Optional[str] = headers.get("Sec-Fetch-Site")
        if site is not None and site != "same-origin":
            return False
        return self._access.is_same_origin(headers.get("Origin", ""), headers.get("Host", ""))


async def _body(request: web.Request) -> Any:
    """Returns what a request says in JSON.

    Raises:
        RequestError: It is none.
    """
    if "Content-Encoding" in request.headers:
        raise RequestError("expected no Content-Encoding")
    # By hand, as aiohttp fails at bytes that are no text.
    kind = request.headers.get("Content-Type", "").partition(";")[0].strip().lower()
    if kind != "application/json":
        raise RequestError("expected the content type application/json")
    try:
        return json.loads(await request.read())
    except (ValueError, RecursionError) as err:
        raise RequestError(f"expected JSON: {err}") from err


def _is_gone(request: web.Request) -> bool:
    """Returns whether the client of a request has ended its connection."""
    return request.transport is None or request.transport.is_closing()


def _token(request: web.Request) -> str:
    header = request.headers.get("Authorization", "")
    return header[len(_BEARER) :] if header.startswith(_BEARER) else ""


def _refusal(status: int, text: str) -> web.Response:
    return web.json_response({"done": False, "text": text}, status=status)
