"""The demo's story and its picture."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import List

import numpy as np
import pytest
from PIL import Image

from rosoclingo_aspprograms.validator import Map
from rosoclingo_examples.orders import Bring
from rosoclingo_gazebo.demo.picture import draw
from rosoclingo_gazebo.demo.story import BOOK, LETTER, Story
from rosoclingo_gazebo.demo.trace import Kind, Trace
from rosoclingo_simulator.simulator.occupancy import OccupancyMap

REPOSITORY = Path(__file__).resolve().parents[3]
OFFICE = REPOSITORY / "rosoclingo_aspprograms" / "mailbot" / "instances" / "graph_wg.lp"
_ROUTE = (
    "go(c6) go(c5) go(c4) go(c6) go(open1) go(c1) go(c2) go(o2) pickup(2) go(c2) go(c1) go(o3) "
    "deliver(2) go(c1) go(c2) go(c3) go(c4) go(o7) pickup(1) go(c4) go(o11) deliver(1)"
)
ROUTE = _ROUTE.split()
C6 = (15.0, -17.0)


class Told:
    """A story that is told what happens, action by action."""

    def __init__(self) -> None:
        self.asked: List[Bring] = []
        self.story = Story(Map.read(OFFICE), C6, self.asked.append)
        self.story.moves(0.0, (7.0, -8.0))
        self.story.begins((27.5, -17.0))
        self.story.hears("[1] bring(o7,o11) book: accepted")

    def act(self, number: int, action: str, early: bool = False) -> None:
        answer = "failure" if number == 2 else "success"
        if early:  # the answer is heard before the action
            self.story.answers(answer)
            self.story.acts(action)
        else:
            self.story.acts(action)
            self.story.answers(answer)
        if number == 0:
            self.story.moves(20.0, (14.0, -16.0))
            self.story.hears("[2] bring(o2,o3) letter: accepted")
        if action == "deliver(2)":
            self.story.hears("[2] bring(o2,o3) letter: succeeded")
        if action == "deliver(1)":
            self.story.hears("[1] bring(o7,o11) book: succeeded")


@pytest.mark.parametrize("early", [False, True])
def test_the_story(early: bool, capsys: pytest.CaptureFixture[str]) -> None:
    told = Told()
    for number, action in enumerate(ROUTE):
        told.act(number, action, early and number % 3 == 1)
    assert told.story.wrong() == []
    assert told.asked == [BOOK, LETTER]
    kinds = [event.kind for event in told.story.trace.events]
    assert kinds.count(Kind.PICKUP) == kinds.count(Kind.DELIVERY) == 2
    assert kinds.count(Kind.FAILURE) == 1
    assert "go(c4)      failure" in capsys.readouterr().out


def test_success_is_heard_before_the_last_answer() -> None:
    told = Told()
    for number, action in enumerate(ROUTE[:-1]):
        told.act(number, action)
    told.story.acts(ROUTE[-1])
    told.story.hears("[1] bring(o7,o11) book: succeeded")
    told.story.answers("success")
    assert told.story.wrong() == []


def test_success_without_a_delivery_is_wrong() -> None:
    told = Told()
    for number, action in enumerate(ROUTE[:-1]):
        told.act(number, action)
    told.story.hears("[1] bring(o7,o11) book: succeeded")
    assert any("its package is on a robot" in text for text in told.story.wrong())


def test_what_is_wrong() -> None:
    told = Told()
    for number, action in enumerate([*ROUTE[:2], "go(c6)"]):
        told.act(number, action)
    told.story.touches()
    wrong = "\n".join(told.story.wrong())
    for text in ("has not ended", "one go(c4) was to fail, not go(c6)", "were to be", "touched"):
        assert text in wrong


def test_the_picture(tmp_path: Path) -> None:
    cells = np.zeros((60, 100), np.int8)
    cells[[0, -1]] = 100
    trace = Trace()
    for step in range(50):
        trace.move(float(step), (1.0 + step / 20, 2.0))
        if step == 30:
            trace.happen(Kind.FAILURE, "go(b) fails")
    files = [tmp_path / "a.png", tmp_path / "a.svg"]
    draw(OccupancyMap(cells, 0.05, 0.0, 0.0), {"a": (1.0, 2.0)}, trace, "a drive", files)
    picture = np.asarray(Image.open(files[0]).convert("RGB")).reshape(-1, 3)
    assert len(np.unique(picture, axis=0)) > 50
    text = files[1].read_text(encoding="utf-8")
    assert ET.fromstring(text).tag.endswith("svg")
    assert "a drive" in text
    assert "30 s: go(b) fails" in text
