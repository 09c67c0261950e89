"""The demo's story and its picture."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import List

import numpy as np
import pytest
from PIL import Image

from rosoclingo.loop.journal import (
    ActionPublished,
    Event,
    GoalArrived,
    MessageArrived,
    Record,
    Status,
    StatusSet,
)
from rosoclingo_examples.orders import Bring
from rosoclingo_gazebo.demo.fleet import FleetStory, random_orders
from rosoclingo_gazebo.demo.labels import LabelBox, place
from rosoclingo_gazebo.demo.picture import draw
from rosoclingo_gazebo.demo.third_scenario import BOOK, LETTER, ThirdScenario
from rosoclingo_gazebo.demo.trace import DriveEventKind, DriveTrace
from rosoclingo_simulator.physics.occupancy import OccupancyMap

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
        self.story = ThirdScenario(C6, self.asked.append)
        self.story.moves(0.0, (7.0, -8.0))
        self.story.begins({"c5": (23.0, -17.0), "c4": (32.0, -17.0)})
        self.come("g1", BOOK, "1")

    def come(self, goal: str, bring: Bring, slot: str) -> None:
        self.note(GoalArrived(goal, bring.request, bring.information))
        self.note(StatusSet(goal, Status.ACCEPTED, slot))

    def note(self, event: Event) -> None:
        self.story.notes(Record(event, horizon=17))

    def act(self, number: int, action: str, answer: str = "") -> None:
        self.note(ActionPublished("mailbot", action))
        self.note(MessageArrived("info", "unblocked(c1,o1)"))
        answer = answer or ("failure" if number == 2 else "success")
        self.note(MessageArrived("mailbot", answer))
        if number == 0:
            self.story.moves(20.0, (14.0, -16.0))
            self.come("g2", LETTER, "2")
        if answer == "success" and action.startswith("deliver("):
            self.note(StatusSet(f"g{action[-2]}", Status.SUCCEEDED, action[-2]))


def test_the_story(capsys: pytest.CaptureFixture[str]) -> None:
    told = Told()
    for number, action in enumerate(ROUTE):
        assert not told.story.has_ended
        told.act(number, action)
    assert told.story.has_ended
    assert told.asked == [BOOK, LETTER]
    kinds = [event.kind for event in told.story.trace.events]
    assert kinds.count(DriveEventKind.PICKUP) == kinds.count(DriveEventKind.DELIVERY) == 2
    assert kinds.count(DriveEventKind.FAILURE) == 1
    told.story.hears("[1] bring(o7,o11) book: plan 9 steps")
    told.story.hears("[1] bring(o7,o11) book: succeeded")
    lines = capsys.readouterr().out.splitlines()
    assert "  step 3 of 17   go(c4)      failure    0.0 s  at (14.0, -16.0)" in lines
    assert lines[-2:] == [
        "  step 22 of 22  deliver(1)  success    0.0 s  at (14.0, -16.0)",
        "[1] bring(o7,o11) book: succeeded",
    ]


def test_a_story_in_which_a_node_is_killed(capsys: pytest.CaptureFixture[str]) -> None:
    told = Told()
    told.act(0, ROUTE[0])
    told.story.kills("planner")
    assert capsys.readouterr().out.splitlines()[-1] == "  killed: planner"
    assert told.story.killed == 1
    assert told.story.trace.events[-1].kind is DriveEventKind.KILL


def test_a_step_is_an_action_with_its_answer(capsys: pytest.CaptureFixture[str]) -> None:
    told = Told()
    for event in (
        ActionPublished("mailbot", "go(c6)"), ActionPublished("mailbot", "abort"),
        MessageArrived("mailbot", "failure"), MessageArrived("mailbot", "failure"),
    ):  # fmt: skip
        told.note(event)
    lines = capsys.readouterr().out.splitlines()
    assert lines == ["  step 1 of 17   go(c6)      failure    0.0 s  at (7.0, -8.0)"]


def test_the_same_seed_asks_for_the_same() -> None:
    offices = ["o1", "o2", "o3"]
    orders = random_orders(offices, 20, seed=3)
    assert orders == random_orders(offices, 20, seed=3) != random_orders(offices, 20, seed=4)
    assert [seconds for seconds, _ in orders] == sorted(seconds for seconds, _ in orders)
    assert orders[0][0] == 0.0
    assert len({bring.information for _, bring in orders}) == 20
    same = {f"bring({office},{office})" for office in offices}
    assert not same & {bring.request for _, bring in orders}


class Delivery:
    """A story of two robots, of which the first has one package to deliver."""

    def __init__(self) -> None:
        robots = ("mailbot", "mailbot2")
        self.story = FleetStory(robots, {"o1": (10.0, 0.0), "o3": (25.0, 0.0)})
        for robot in robots:
            self.story.moves(robot, 10.0, (0.0, 0.0), 0.0)
        self.story.begins()
        self.story.learns(GoalArrived("goal", "bring(o1,o3)", ("letter",)))
        self.story.learns(StatusSet("goal", Status.ACCEPTED, "1"))
        self.seconds = 10.0

    def act(self, action: str, answer: str = "success") -> None:
        self.story.learns(ActionPublished("mailbot", action))
        for speed in (0.5, 0.0, 0.0, 0.0, 0.4):  # a second each; it waits for three
            self.seconds += 1
            self.story.moves("mailbot", self.seconds, (self.seconds - 10, 0.0), speed)
        self.story.learns(MessageArrived("mailbot", answer))


def test_a_fleet(capsys: pytest.CaptureFixture[str]) -> None:
    told = Delivery()
    for action in ("go(o1)", "pickup(1)", "go(c1)", "go(o3)", "deliver(1)"):
        told.act(action)
    assert told.story.open == 1
    told.story.learns(StatusSet("goal", Status.SUCCEEDED, "1"))
    assert told.story.open == 0
    said = capsys.readouterr().out
    assert "0 s            asked to bring letter from o1 to o3" in said
    assert "10 s  mailbot   picks up letter at o1" in said
    assert "25 s  mailbot   delivers letter at o3" in said
    assert told.story.lines()[1].split() == ["mailbot", "1", "25", "3", "9"]
    assert told.story.lines()[2].split() == ["mailbot2", "0", "0", "0", "0"]
    assert told.story.summary() == (
        "1 package delivered by 2 robots in 25 s of simulated time, on 25 m, with 3 waits"
    )
    events = told.story.members["mailbot"].trace.events
    assert [(event.kind, event.place) for event in events] == [
        (DriveEventKind.PICKUP, (10.0, 0.0)),
        (DriveEventKind.DELIVERY, (25.0, 0.0)),
    ]


def test_a_fleet_is_asked_for_what_is_due(capsys: pytest.CaptureFixture[str]) -> None:
    """Or for something else: somebody else may ask, too."""
    told = Delivery()
    told.story.learns(GoalArrived("soon", "bring(o3,o1,urgent)", ("milk",)))
    told.story.learns(GoalArrived("due", "bring(o3, o1, by(60))", ("post",)))
    told.story.learns(GoalArrived("strange", "clean(o3)"))
    told.story.learns(StatusSet("strange", Status.REJECTED))
    for slot, goal in (("2", "soon"), ("3", "due")):
        told.story.learns(StatusSet(goal, Status.ACCEPTED, slot))
    assert told.story.open == 3
    lines = [line[10:].strip() for line in capsys.readouterr().out.splitlines()]
    assert lines[1:] == [
        "asked to bring milk from o3 to o1, urgent",
        "asked to bring post from o3 to o1, by(60)",
        "asked for clean(o3)",
    ]


def test_a_fleet_picks_up_before_a_request_is_accepted(capsys: pytest.CaptureFixture[str]) -> None:
    """It is accepted only when the step ends, be it that its slot had another one before."""
    told = Delivery()
    for action in ("go(o1)", "pickup(1)", "go(c1)", "go(o3)", "deliver(1)"):
        told.act(action)
    told.story.learns(StatusSet("goal", Status.SUCCEEDED, "1"))
    for goal, request in (("far", "bring(o1,o3)"), ("near", "bring(o3,o1)"), ("out", "clean(o3)")):
        told.story.learns(GoalArrived(goal, request, (goal,)))
    told.act("pickup(1)")
    told.story.learns(StatusSet("near", Status.ACCEPTED, "1"))
    told.act("pickup(2)", "failure")
    told.act("deliver(1)")
    said = capsys.readouterr().out
    assert "picks up near at o3" in said
    assert "pickup(2) fails" in said
    assert "delivers near at o3" in said


def test_a_goal_that_ends_before_the_loop_takes_it_is_not_open() -> None:
    told = Delivery()
    told.story.learns(StatusSet("soon", Status.CANCELED))
    told.story.learns(GoalArrived("soon", "bring(o1,o3)"))
    assert told.story.open == 1


@pytest.mark.costly
def test_the_picture_of_several(tmp_path: Path) -> None:
    traces = {name: DriveTrace() for name in ("one", "other")}
    for number, trace in enumerate(traces.values()):
        for step in range(50):
            trace.move(float(step), (1.0 + step / 20, 1.0 + number))
    floor = OccupancyMap(np.zeros((60, 100), np.int8), 0.05, 0.0, 0.0)
    _, file = draw(floor, {}, traces, "two drives", tmp_path / "a")
    text = file.read_text(encoding="utf-8")
    assert all(f"<!-- {name} -->" in text for name in traces)


@pytest.mark.costly
def test_the_picture(tmp_path: Path) -> None:
    cells = np.zeros((60, 100), np.int8)
    cells[[0, -1]] = 100
    trace = DriveTrace()
    for step in range(50):
        trace.move(float(step), (1.0 + step / 20, 2.0))
        if step == 30:
            trace.happen(DriveEventKind.FAILURE, "go(b) fails")
        if step in (40, 41, 42):
            trace.happen(DriveEventKind.KILL, "planner")
    floor, places = OccupancyMap(cells, 0.05, 0.0, 0.0), {"a": (1.0, 2.0)}
    files = draw(floor, places, {"a robot": trace}, "a drive", tmp_path / "new" / "a")
    assert files == [tmp_path / "new" / "a.png", tmp_path / "new" / "a.svg"]
    picture = np.asarray(Image.open(files[0]).convert("RGB")).reshape(-1, 3)
    assert len(np.unique(picture, axis=0)) > 50
    text = files[1].read_text(encoding="utf-8")
    assert ET.fromstring(text).tag.endswith("svg")
    assert "a drive" in text
    assert "30 s: go(b) fails" in text
    assert text.count("s: planner") == 3
    assert "a node is killed" in text


def test_labels_hide_nothing() -> None:
    """As many as there are on a picture, most of them about the same places."""
    dice = np.random.default_rng(1)
    places = dice.uniform((50, 50), (1050, 750), (12, 2))
    anchors = [tuple(places[number % 12]) for number in range(45)]
    sizes = [(float(width), 16.0) for width in dice.integers(60, 140, 45)]
    marks = [LabelBox.around(anchor, (17.0, 17.0)) for anchor in anchors[:12]]
    frame = LabelBox(0.0, 0.0, 1100.0, 800.0)
    centres = place(anchors, sizes, marks, frame)
    boxes = [LabelBox.around(*both) for both in zip(centres, sizes)]
    for number, box in enumerate(boxes):
        assert box.overlap(frame) == pytest.approx(box.area)
        assert not any(box.overlap(other) for other in (*marks, *boxes[:number]))
    assert place(anchors, sizes, marks, frame) == centres


def test_a_label_without_room_is_where_least_is_hidden() -> None:
    frame = LabelBox(0.0, 0.0, 100.0, 10.0)
    centres = place([(50.0, 5.0)] * 12, [(40.0, 10.0)] * 12, [], frame)
    assert len(centres) == 12
