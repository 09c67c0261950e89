"""The console's server, asked as a browser asks, and as others do who wish it ill."""

from __future__ import annotations

import asyncio
import gzip
import json
import re
from pathlib import Path
from typing import Any

import pytest
from console_server import SYSTEM, TOKEN, Console, closed, hear, until, with_console

from rosoclingo.bags.model import Recording
from rosoclingo.bags.report.page import render
from rosoclingo.bags.report.statistics import compute
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Entry
from rosoclingo_console.web.channel import REFUSED
from rosoclingo_console.web.server import HEADERS

EVIL = "http://evil.example"


@with_console()
async def test_the_page_and_its_files(one: Console) -> None:
    page = await one.client.get("/")
    text = await page.text()
    assert page.content_type == "text/html"
    for word in ("<style", "style=", "onclick", "onload", "http://", "https://"):
        assert word not in text
    names = [part.split('"')[0] for part in text.split('"/page/')[1:]]
    assert {"main.js", "page.css", "icon.svg"} <= set(names)
    for name in names:
        file = await one.client.get(f"/page/{name}")
        assert file.status == 200
        assert {key: file.headers[key] for key in HEADERS} == dict(HEADERS)


@with_console()
async def test_the_report_draws_with_the_same_files(one: Console) -> None:
    recording = Recording("/rosoclingo", (), {})
    report = render(recording, compute(recording), Path("run.bag"))

    for name in ("elements.js", "times.js", "lanes.js", "lanes.css", "base.css"):
        text = await (await one.client.get(f"/page/{name}")).text()
        assert re.sub("^(import .*\n|export )", "", text, flags=re.MULTILINE) in report


@pytest.mark.parametrize(
    "path",
    ["/page/../access.py", "/page/%2e%2e/access.py", "/page/..%2faccess.py", "/page/", "/etc",
     "/do", "/do/goal/x", "/page/main.js%00", "/" + "x" * 5000],
)  # fmt: skip
@with_console()
async def test_nothing_else_is_served(one: Console, path: str) -> None:
    answer = await one.client.get(path)
    assert answer.status == 404
    assert answer.content_type == "application/json"


@with_console()
async def test_what_an_operator_may_want(one: Console) -> None:
    for kind, fields, wanted in (
        ("control", {"control": "pause"}, (SYSTEM, "pause", "", "", 0)),
        (
            "control",
            {"control": "approve", "actuator": "r", "action": "go(1)", "token": 7},
            (SYSTEM, "approve", "r", "go(1)", 7),
        ),
        (
            "goal",
            {"request": "visit(2)", "information": ["x"]},
            (SYSTEM, "visit(2)", ("x",)),
        ),
        ("message", {"message": "info:a( b, 1+2)"}, (SYSTEM, "info", "a(b,3)")),
        ("message", {"message": '(goal):"x:y"'}, (SYSTEM, "goal", '"x:y"')),
        ("cancel", {"goal": "g"}, (SYSTEM, "g")),
        ("why", {"question": "goal", "arguments": ["1"]}, (SYSTEM, "goal", ("1",))),
        ("record", {"on": True}, (SYSTEM, True)),
    ):
        status, answer = await one.do(kind, {"system": SYSTEM, **fields})
        assert (status, answer) == (200, {"done": True, "text": "taken"})
        assert one.operations.wanted[-1] == wanted


@pytest.mark.parametrize(
    ("kind", "body", "said"),
    [
        ("goal", None, "expected a JSON object"),
        ("goal", [], "expected a JSON object"),
        ("goal", {}, "system: there are /rosoclingo"),
        ("goal", {"system": "/other", "request": "a"}, "system: there are /rosoclingo"),
        ("goal", {"system": SYSTEM}, "request: it is empty"),
        ("goal", {"system": SYSTEM, "request": 3}, "request: expected a text"),
        ("goal", {"system": SYSTEM, "request": "a" * 10_001}, "request: expected a text"),
        ("goal", {"system": SYSTEM, "request": "\ud800"}, "request: expected Unicode"),
        ("goal", {"system": SYSTEM, "request": "a", "information": "b"}, "information: expected"),
        ("goal", {"system": SYSTEM, "request": "a", "information": [1]}, "information: expected"),
        (
            "goal",
            {"system": SYSTEM, "request": "a", "information": ["b"] * 101},
            "information: expected",
        ),
        ("message", {"system": SYSTEM}, "message: expected SOURCE:VALUE, such as info:blocked("),
        ("message", {"system": SYSTEM, "message": "info"}, "message: expected SOURCE:VALUE"),
        ("message", {"system": SYSTEM, "message": "info:a("}, "message: 'a(' is not a ground term"),
        ("message", {"system": SYSTEM, "message": ":a"}, "message: '' is not a ground term"),
        ("message", {"system": SYSTEM, "message": 3}, "message: expected a text"),
        ("message", {"system": SYSTEM, "message": " " * 9_000}, "message: expected SOURCE:VALUE"),
        ("cancel", {"system": SYSTEM}, "goal: it is empty"),
        ("cancel", {"system": SYSTEM, "goal": ""}, "goal: it is empty"),
        ("record", {"system": SYSTEM, "on": "yes"}, "on: expected true or false"),
        ("control", {"system": SYSTEM}, "control: expected pause, halt"),
        ("control", {"system": SYSTEM, "control": "retry"}, "control: expected pause"),
        ("control", {"system": SYSTEM, "control": "shutdown"}, "control: expected pause"),
        ("control", {"system": SYSTEM, "control": "hold", "actuator": {}}, "actuator: expected"),
        ("control", {"system": SYSTEM, "control": "hold", "token": -1}, "token: expected"),
        ("control", {"system": SYSTEM, "control": "hold", "token": "7"}, "token: expected"),
    ],
)
@with_console()
async def test_wrong_requests(one: Console, kind: str, body: Any, said: str) -> None:
    status, answer = await one.do(kind, body)
    assert status == 400
    assert answer["text"].startswith(said)
    assert not one.operations.wanted


@pytest.mark.parametrize(
    "body", [b"", b"{", b"\xff", b"[" * 50_000, b"{}" * 40_000, b'{"system": NaN']
)
@with_console()
async def test_what_is_no_json(one: Console, body: bytes) -> None:
    headers = one.headers(Content_Type="application/json")
    answer = await one.client.post("/do/goal", data=body, headers=headers)
    assert answer.status in (400, 413)
    assert not (await answer.json())["done"]


@with_console()
async def test_a_compressed_body_is_no_request(one: Console) -> None:
    for body in (b"x", gzip.compress(b'{"system": "/rosoclingo", "request": "a"}')):
        headers = one.headers(Content_Type="application/json", Content_Encoding="gzip")
        answer = await one.client.post("/do/goal", data=body, headers=headers)
        assert answer.status == 400
        assert (await answer.json())["text"] == "expected no Content-Encoding"
    assert not one.operations.wanted


@with_console()
async def test_a_form_of_another_page_is_no_request(one: Console) -> None:
    text = json.dumps({"system": SYSTEM, "request": "a"})
    for kind in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data"):
        headers = one.headers(Content_Type=kind)
        answer = await one.client.post("/do/goal", data=text, headers=headers)
        assert answer.status == 400
    assert not one.operations.wanted


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Origin": EVIL}, 403),
        ({"Origin": "null"}, 403),
        ({"Origin": ""}, 403),
        ({"Sec_Fetch_Site": "cross-site"}, 403),
        ({"Sec_Fetch_Site": "same-site"}, 403),
        ({"Host": "evil.example"}, 421),
        ({"Host": "evil.example", "Origin": EVIL}, 421),
        ({"token": ""}, 401),
        ({"token": TOKEN[:-1]}, 401),
        ({"token": f"{TOKEN}x"}, 401),
        ({"Authorization": f"Basic {TOKEN}"}, 401),
        ({"Authorization": TOKEN}, 401),
    ],
)
@with_console()
async def test_requests_of_others(one: Console, headers: Any, status: int) -> None:
    body = {"system": SYSTEM, "control": "halt"}
    answer = await one.do("control", body, **headers)
    assert (answer[0], answer[1]["done"]) == (status, False)
    assert not one.operations.wanted
    # No page of another origin may read or ask by other methods, either.
    for method in ("OPTIONS", "GET", "PUT", "DELETE"):
        answer = await one.client.request(method, "/do/control", headers=one.headers(**headers))
        assert answer.status in (status, 405)
        assert "Access-Control-Allow-Origin" not in answer.headers


@pytest.mark.parametrize(
    ("headers", "status"),
    [({"Origin": EVIL}, 403), ({"Origin": ""}, 403), ({"Host": "evil.example"}, 421)],
)
@with_console()
async def test_live_channels_of_others(one: Console, headers: Any, status: int) -> None:
    shake = {
        "Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
    }  # fmt: skip
    sent = {**one.headers(**headers), **shake}
    answer = await one.client.get("/live", headers=sent)
    assert answer.status == status


@with_console(read_only=True)
async def test_a_read_only_console(one: Console) -> None:
    for kind, fields in (
        ("control", {"control": "halt"}),
        ("goal", {"request": "a"}),
        ("message", {"message": "info:a"}),
        ("cancel", {"goal": "g"}),
    ):
        status, answer = await one.do(kind, {"system": SYSTEM, **fields})
        assert (status, answer["text"]) == (403, "this console is read-only")
    assert not one.operations.wanted
    assert (await one.do("why", {"system": SYSTEM}))[0] == 200
    socket = await one.live()
    assert (await hear(socket, "hello"))["hello"] == {
        "systems": [SYSTEM], "may_act": False, "may_ask": True, "read_only": True,
        "recording": None,
    }  # fmt: skip


@with_console(sees_all=False)
async def test_who_may_look_when_others_can_connect(one: Console) -> None:
    for token in ("", TOKEN[:-1], None, 3, ["x"]):
        assert await closed(await one.live(token)) == REFUSED
    for word in ("", "[", "[" * 2000, "3", '{"token": {}}'):
        socket = await one.client.ws_connect("/live", headers=one.headers())
        await socket.send_str(word)
        assert await closed(socket) == REFUSED
    socket = await one.client.ws_connect("/live", headers=one.headers())
    await socket.send_bytes(b"x")
    assert await closed(socket) == REFUSED
    assert (await hear(await one.live(), "hello"))["hello"]["may_act"]
    assert (await one.client.get("/metrics")).status == 401
    assert (await one.client.get("/metrics", headers=one.headers())).status == 200
    assert (await one.client.get("/")).status == 200  # which says nothing of the systems


@with_console()
async def test_a_word_that_is_too_long_ends_a_channel(one: Console) -> None:
    socket = await one.client.ws_connect("/live", headers=one.headers())
    await socket.send_str("x" * 10_000)
    assert await closed(socket) in (1009, 1006, REFUSED)


@with_console()
async def test_a_page_sees_what_there_is_and_what_changes(one: Console) -> None:
    record = Entry(journal.GoalArrived("g", "visit(2)"), 0, 0, 1, 3.0)
    one.hub.post(SYSTEM, lambda model: model.hear(record))
    socket = await one.live("")
    hello = (await hear(socket, "hello"))["hello"]
    assert (hello["may_act"], hello["may_ask"]) == (False, False)
    said = await hear(socket, "system")
    while "g" not in said.get("tables", {}).get("goals", {}):
        said = await hear(socket, "system")
    assert said["tables"]["goals"]["g"]["request"] == "visit(2)"
    assert await hear(socket, "beat") == {"beat": {"now": 5.0, "ros": 2.0}}
    one.hub.post(SYSTEM, lambda model: model.tell_goal("g", "queued 7"))
    said = await hear(socket, "system")
    assert set(said) == {"system", "tables"}
    assert said["tables"]["goals"]["g"]["place"] == 7
    assert set(said["tables"]) == {"goals"}
    await socket.close()
    metrics = await (await one.client.get("/metrics")).text()
    assert 'rosoclingo_goals_open{system="/rosoclingo"} 1' in metrics


@with_console()
async def test_a_page_that_is_too_slow_is_ended_and_others_go_on(one: Console) -> None:
    slow, quick = await one.live(), await one.live()
    for socket in (slow, quick):
        await hear(socket, "hello")
    # Nobody reads what the first one is sent.
    text, number = "x" * 200_000, 0
    while not one.hub.slow:
        number += 1
        line = f"{number} {text}"
        one.hub.post(SYSTEM, lambda model, line=line: model.set_quality(line))
        quality = ""
        while quality != line:
            said = await hear(quick, "system")
            quality = said["tables"].get("run", {}).get("run", {}).get("quality", "")
        assert number < 1000
    assert one.hub.slow == 1
    await hear(quick, "beat")


@with_console()
async def test_so_many_requests_at_a_time(one: Console) -> None:
    one.operations.goes_on.clear()
    body = {"system": SYSTEM, "goal": "g"}
    waiting = [asyncio.ensure_future(one.do("cancel", body)) for _ in range(8)]
    await until(lambda: len(one.operations.wanted) == 8)
    status, answer = await one.do("cancel", body)
    assert (status, answer["text"]) == (503, "8 requests are under way; try again")
    pause = {"system": SYSTEM, "control": "pause"}
    paused = asyncio.ensure_future(one.do("control", pause))  # which has to get through
    await until(lambda: (SYSTEM, "pause", "", "", 0) in one.operations.wanted)
    for request in waiting[:4]:  # a page that goes away leaves its request under way
        request.cancel()
    assert (await one.do("cancel", body))[0] == 503
    one.operations.goes_on.set()
    await asyncio.wait(waiting)
    assert (await paused)[0] == 200
    assert (await one.do("cancel", body))[0] == 200
