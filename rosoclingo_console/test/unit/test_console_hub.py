"""Changes of systems on their way to pages."""

from __future__ import annotations

import asyncio
import json
import threading
from typing import Any, List

import pytest
from console_server import SYSTEM, awaited, until

from rosoclingo_console.model.system import SystemModel
from rosoclingo_console.web.hub import FLUSH_SECONDS, Hub, Subscriber


def make_hub() -> Hub:
    return Hub([SYSTEM], lambda: {"now": 1.0, "ros": 1.0})


class Reader(Subscriber):
    """Remembers what it is sent of systems, and when."""

    def __init__(self) -> None:
        self.said: List[Any] = []
        self.times: List[float] = []

    def send(self, text: str) -> None:
        said = json.loads(text)
        if "beat" not in said:
            self.said.append(said)
            self.times.append(asyncio.get_event_loop().time())


@pytest.mark.costly
@awaited
async def test_changes_are_gathered() -> None:
    """The first one is sent at once, those that come soon after it together."""
    hub, reader = make_hub(), Reader()
    hub.start(asyncio.get_event_loop())
    await until(lambda: not hub.models[SYSTEM].changes())
    hub.subscribe(reader)
    reader.said.clear()
    reader.times.clear()
    posted: List[int] = []

    def post() -> None:
        while len(reader.said) < 5:
            posted.append(0)
            value = str(len(posted))
            hub.post(SYSTEM, lambda model, value=value: model.set_quality(value))

    threads = [threading.Thread(target=post) for _ in range(2)]
    for thread in threads:
        thread.start()
    await until(lambda: not any(thread.is_alive() for thread in threads))
    hub.post(SYSTEM, lambda model: model.set_quality("last"))
    await until(lambda: "last" in json.dumps(reader.said[-1]))
    assert len(posted) > 10 * len(reader.said)
    gaps = [after - before for before, after in zip(reader.times, reader.times[1:])]
    assert min(gaps) > FLUSH_SECONDS / 2


@awaited
async def test_what_was_posted_before_the_start_is_taken() -> None:
    hub = make_hub()
    hub.post(SYSTEM, lambda model: model.set_quality("early"))
    hub.start(asyncio.get_event_loop())
    reader = Reader()
    await until(lambda: hub.models[SYSTEM].snapshot()["tables"])
    hub.subscribe(reader)
    assert reader.said[0]["tables"]["run"]["run"]["quality"] == "early"


@awaited
async def test_a_bug_does_not_stop_what_comes_later() -> None:
    def fail(_: SystemModel) -> None:
        raise ValueError

    hub, reader = make_hub(), Reader()
    hub.start(asyncio.get_event_loop())
    hub.subscribe(reader)
    hub.post(SYSTEM, fail)
    hub.post(SYSTEM, lambda model: model.set_quality("later"))
    await until(lambda: "later" in json.dumps(reader.said))
    hub.unsubscribe(reader)
