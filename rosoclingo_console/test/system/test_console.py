"""The console of a running system, asked as a page asks.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import re
import urllib.request
from pathlib import Path
from typing import Any, AsyncIterator, Callable, Dict, List, Optional, Tuple

import aiohttp
import pytest
from terminals import Terminal, Terminals, package, terminals, wait_for

from rosoclingo.bags.model import Recording
from rosoclingo.bags.read.reader import read_recording
from rosoclingo.errors import BagError

__all__ = ["terminals"]

SECONDS = 180.0  # no more than a bound for what never comes
LINK = re.compile(r"open (http://\S+)/#(\S+)")


class Link:
    """A page of a console, as a browser has it."""

    def __init__(self, url: str, token: str) -> None:
        self.url = url
        self.headers = {"Origin": url, "Authorization": f"Bearer {token}"}
        self.token = token
        self.hello: Dict[str, Any] = {}
        self.systems: Dict[str, Dict[str, Dict[str, Any]]] = {}
        self.lines: Dict[str, Any] = {}
        self.socket: Any = None
        self.session: Any = None

    @contextlib.asynccontextmanager
    async def open(self) -> AsyncIterator[Link]:
        """Connects."""
        async with aiohttp.ClientSession() as self.session, self.session.ws_connect(
            f"{self.url}/live", headers=self.headers, max_msg_size=0
        ) as self.socket:
            self.heard: asyncio.Queue[aiohttp.WSMessage] = asyncio.Queue()
            # Also while something else is awaited, as a browser does: it answers pings.
            hearing = asyncio.ensure_future(self._hear())
            await self.socket.send_str(json.dumps({"token": self.token}))
            try:
                yield self
            finally:
                hearing.cancel()

    async def _hear(self) -> None:
        message = await self.socket.receive()
        while message.type is aiohttp.WSMsgType.TEXT:
            await self.heard.put(message)
            message = await self.socket.receive()
        await self.heard.put(message)

    async def until(self, condition: Callable[[], Any]) -> None:
        """Hears what the console says, until a condition holds."""
        end = asyncio.get_event_loop().time() + SECONDS
        while not condition():
            assert asyncio.get_event_loop().time() < end, self.systems
            message = await asyncio.wait_for(self.heard.get(), SECONDS)
            assert message.type is aiohttp.WSMsgType.TEXT, message
            self.take(json.loads(message.data))

    def take(self, said: Dict[str, Any]) -> None:
        self.hello = said.get("hello", self.hello)
        name = said.get("system")
        if name is None:
            return
        if said.get("all"):
            self.systems[name], self.lines[name] = {}, []
        self.lines[name] += said.get("lines", [])
        for table, rows in said.get("tables", {}).items():
            known = self.systems[name].setdefault(table, {})
            for key, row in rows.items():
                known[key] = row
                if row is None:
                    del known[key]

    def catch_up(self) -> Link:
        """Takes what has come, without a wait."""
        while not self.heard.empty():
            message = self.heard.get_nowait()
            assert message.type is aiohttp.WSMsgType.TEXT, message
            self.take(json.loads(message.data))
        return self

    def numbers(self, system: str = "/rosoclingo") -> List[int]:
        """Returns the numbers of the journal's lines."""
        return [line["number"] for line in self.lines[system]]

    def rows(self, table: str, system: str = "/rosoclingo") -> Dict[str, Any]:
        return self.systems.get(system, {}).get(table, {})

    def run(self, system: str = "/rosoclingo") -> Dict[str, Any]:
        row: Dict[str, Any] = self.rows("run", system).get("run", {})
        return row

    def robot(self, field: str) -> Any:
        return self.rows("actuators").get("robot", {}).get(field)

    async def do(self, kind: str, **fields: Any) -> Tuple[bool, str]:
        """Has something done."""
        body = {"system": "/rosoclingo", **fields}
        async with self.session.post(
            f"{self.url}/do/{kind}", json=body, headers=self.headers
        ) as answer:
            said = await answer.json()
        return said["done"], said["text"]


def start_console(terminals: Terminals, *parameters: str) -> Tuple[Terminal, Link]:
    console = terminals.start("rosrun", "rosoclingo_console", "console.py", "_port:=0", *parameters)
    console.wait_for("open http")
    found = LINK.search(console.output)
    assert found is not None
    return console, Link(*found.groups())


def start_system(terminals: Terminals, *parameters: str, name: str = "rosoclingo") -> Terminal:
    line = package("rosoclingo") / "example" / "line.lp"
    node = ("rosrun", "rosoclingo", "run-1.0.py", f"__name:={name}", "-f", str(line))
    return terminals.start(*node, *parameters)


@pytest.mark.costly
@pytest.mark.both_spaces
def test_an_operator_with_a_page(terminals: Terminals) -> None:
    """What is asked for is done, and seen."""
    _, link = start_console(terminals)
    start_system(terminals, "_ask_before:=go(3)", "_why_nice:=0", "_why_seconds:=600")

    async def check() -> None:
        async with link.open() as page:
            await page.until(lambda: page.run().get("connected"))
            await page.until(lambda: page.rows("known")["known"]["requests"])
            assert "visit(3)" in page.rows("known")["known"]["requests"]
            assert "info:close(3)" in page.rows("known")["known"]["messages"]
            for _ in range(2):  # the same message is another one
                await page.until(lambda: page.run()["state"] == "waits")
                message = await page.do("message", message="info:open(4)")
                assert message == (True, "sent to /rosoclingo")
            done, text = await page.do("message", message="info:close(9)")
            assert (done, text.partition(";")[0]) == (
                False, "dropped: the planner's encoding declares no such event",
            )  # fmt: skip
            await page.until(lambda: "close(9)" in str(page.run()["dropped"]))
            assert await page.do("control", control="pause") == (True, "paused")
            await page.until(lambda: page.run()["paused"])
            accepted = (True, "accepted, in slot 1")
            assert await page.do("goal", request="visit(3)", information=["a book"]) == accepted
            await page.until(lambda: page.robot("held") and page.rows("goals"))
            (goal,) = page.rows("goals").values()
            assert (goal["request"], goal["information"]) == ("visit(3)", ["a book"])
            assert (page.robot("held"), page.robot("state")) == ("go(2)", "pause")
            assert (await page.do("control", control="step"))[0]
            await page.until(lambda: page.robot("action") == "go(2)")
            assert (await page.do("control", control="resume"))[0]
            answer = ("/rosoclingo/in", "rosoclingo/ROSoClingoIn", "{id: robot, value: success}")
            terminals.publish(*answer)
            await page.until(lambda: page.robot("state") == "approval")
            robot = {"control": "approve", "actuator": "robot"}
            done, text = await page.do("control", action="go(4)", **robot)
            assert (done, text.partition(";")[0]) == (False, "no action go(4) of robot is held")
            done, text = await page.do("why", question="goal", arguments=["1"])
            assert (done, text.partition(" ")[0]) == (True, "visit(3)")
            done, text = await page.do("control", action="go(3)", **robot)
            assert done, text
            await page.until(lambda: page.robot("action") == "go(3)")
            terminals.publish(*answer)
            await page.until(lambda: "succeeded" in str(page.rows("goals")))

    asyncio.run(check())


@pytest.mark.costly
@pytest.mark.both_spaces
def test_who_comes_late_and_the_end(terminals: Terminals) -> None:
    """Also: cancelled and rejected goals, and a system that ends before its console."""
    node = start_system(terminals, "_why_nice:=0", "_why_seconds:=600")
    console, link = start_console(terminals)

    async def check() -> None:
        async with link.open() as page:
            await page.until(lambda: page.run().get("connected"))
            for request in ("fly(", "visit(77", "fly(3)"):
                done, text = await page.do("goal", request=request)
                assert not done
                assert re.match("rejected: .+", text), text
            await page.until(lambda: len(page.rows("goals")) == 3)
            (ended, *_) = page.rows("goals")
            done, text = await page.do("cancel", goal=ended)
            assert not done
            assert re.match("the goal has ended already: rejected: .+", text), text
            assert await page.do("cancel", goal="other") == (
                False, "/rosoclingo has no open goal other",
            )  # fmt: skip
            assert await page.do("goal", request="visit(3)") == (True, "accepted, in slot 1")
            await page.until(lambda: page.robot("action") == "go(2)")
            (key,) = (key for key, one in page.rows("goals").items() if one["ended"] is None)
            said = [await page.do("goal", request="visit(1)") for _ in range(2)]
            assert said[0][0]
            assert "not decided on yet" in said[0][1]
            assert said[1] == (True, "queued, place 1")
            *_, queued = page.catch_up().rows("goals")
            done, text = await page.do("cancel", goal=queued)
            assert done
            assert text.startswith("cancelled"), text
            assert await page.do("cancel", goal=key) == (
                True, "it is to be cancelled, once what has begun has ended",
            )  # fmt: skip
            await page.until(lambda: page.rows("goals")[key]["canceling"])
            assert not (await page.do("why", question="goal", arguments=["9"]))[0]

            async with Link(link.url, "").open() as late:
                await late.until(lambda: late.rows("goals") == page.catch_up().rows("goals"))
                await late.until(lambda: late.numbers() == page.catch_up().numbers())
                assert not late.hello["may_act"]
                async with late.session.post(f"{link.url}/do/control", headers=late.headers) as no:
                    assert no.status == 401
            node.interrupt()
            node.wait()
            await page.until(lambda: not page.run()["connected"])
            assert page.run()["state"] == "ended"
            gone = (False, "there is no connection to /rosoclingo: no node of that name runs")
            assert await page.do("goal", request="visit(1)") == gone
            assert await page.do("message", message="info:open(4)") == gone
            assert await page.do("control", control="pause") == gone

    asyncio.run(check())
    console.interrupt()
    assert console.wait() == 0
    for terminal in (console, node):
        assert "Traceback" not in terminal.output
    assert link.token not in "".join(console.output.split("open http")[:1])


@pytest.mark.costly
def test_two_systems_of_which_one_comes_later(terminals: Terminals, tmp_path: Path) -> None:
    """Also: a link that stays the same, who may look, and metrics."""
    token = tmp_path / "token"
    parameters = ("_systems:=one two", f"_token_file:={token}", "_read_only:=true")
    start_system(terminals, name="one")
    console, link = start_console(terminals, *parameters)

    async def check() -> None:
        async with link.open() as page:
            await page.until(lambda: page.run("/one").get("connected"))
            await page.until(lambda: page.run("/two"))
            assert not page.run("/two")["connected"]
            start_system(terminals, name="two")
            await page.until(lambda: page.run("/two")["connected"])
            assert page.hello["read_only"]
            assert await page.do("control", control="pause", system="/one") == (
                False, "this console is read-only",
            )  # fmt: skip

    asyncio.run(check())
    with urllib.request.urlopen(f"{link.url}/metrics") as metrics:
        text = metrics.read().decode()
    for name in ("/one", "/two"):
        assert f'rosoclingo_up{{system="{name}"}} 1\n' in text
    console.interrupt()
    console.wait()
    _, same = start_console(terminals, *parameters)
    assert same.token == link.token == token.read_text().strip()


@pytest.mark.costly
@pytest.mark.parametrize(
    ("parameter", "said"),
    [
        ("_port:=65536", "parameter /console/port: expected an integer from 0 to 65535"),
        ("_systems:=[]", "parameter /console/systems: name a planning node"),
        ("_address:=256.0.0.1", "cannot listen on 256.0.0.1, port 0"),
        ("_read_only:=perhaps", "parameter /console/read_only: expected true or false"),
        ("_token_file:=/dev/null", "/dev/null: "),
    ],
)
def test_wrong_parameters(terminals: Terminals, parameter: str, said: str) -> None:
    console = terminals.run("rosrun", "rosoclingo_console", "console.py", "_port:=0", parameter)
    assert console.process.returncode == 2
    assert said in console.output
    assert "Traceback" not in console.output


def test_the_end_with_an_open_page(terminals: Terminals) -> None:
    console, link = start_console(terminals)

    async def check() -> None:
        async with link.open() as page:
            await page.until(lambda: page.hello)
            console.interrupt()
            while not page.socket.closed:
                await asyncio.wait_for(page.heard.get(), SECONDS)

    asyncio.run(check())
    wait_for(lambda: console.process.poll() is not None)
    assert console.wait() == 0


def read_bags(bags: Path) -> Optional[Recording]:
    """Reads a bag, which is growing, if there is one and there is something in it."""
    try:
        return next(map(read_recording, bags.glob("*.bag")), None)
    except BagError:
        return None


def is_recorded(bags: Path) -> bool:
    """Whether a recorder hears the journal."""
    recording = read_bags(bags)
    return bool(recording and recording.entries)


def is_whole(bags: Path) -> bool:
    """Whether there is a bag without a fault, which has been closed."""
    recording = read_bags(bags)
    return bool(recording and not recording.remarks)


@pytest.mark.costly
def test_a_recording_outlasts_its_console(terminals: Terminals, tmp_path: Path) -> None:
    """Ctrl-C for the console ends the recording, and the bag is whole."""
    start_system(terminals)
    console, link = start_console(terminals, f"_bags:={tmp_path / 'bags'}")

    async def check() -> None:
        async with link.open() as page:
            await page.until(lambda: page.run().get("connected"))
            assert (await page.do("record", on=True))[0]
            assert await page.do("record", on=True) == (False, "it is recorded already")
            await page.until(lambda: page.run()["recording"])
            wait_for(lambda: is_recorded(tmp_path / "bags"))
            assert (await page.do("goal", request="visit(3)"))[0]
            await page.until(lambda: page.robot("action") == "go(2)")
            wait_for(lambda: "visit(3)" in str(read_bags(tmp_path / "bags")))

    asyncio.run(check())
    console.interrupt()
    assert console.wait() == 0
    wait_for(lambda: "messages of /rosoclingo in" in console.output)
    wait_for(lambda: is_whole(tmp_path / "bags"))
