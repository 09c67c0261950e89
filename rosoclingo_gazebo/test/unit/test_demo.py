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
    PlanFound,
    Record,
    Status,
    StatusSet,
)
from rosoclingo_aspprograms.validator import Map
from rosoclingo_examples.orders import Bring
from rosoclingo_gazebo.demo.fleet import FleetStory, random_orders
from rosoclingo_gazebo.demo.labels import LabelBox, place
from rosoclingo_gazebo.demo.picture import draw
from rosoclingo_gazebo.demo.third_scenario import BOOK, LETTER, ThirdScenario
from rosoclingo_gazebo.demo.trace import DriveEventKind, DriveTrace
from rosoclingo_simulator.physics.occupancy import OccupancyMap

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

    def __init__(self, undisturbed: bool = True) -> None:
        self.asked: List[Bring] = []
        self.story = ThirdScenario(Map.read(OFFICE), C6, self.asked.append, undisturbed=undisturbed)
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
    assert told.story.wrong() == []
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


def test_a_story_in_which_nodes_are_killed(capsys: pytest.CaptureFixture[str]) -> None:
    """An action may fail, and be done again; what counts is that the packages arrive."""
    told = Told(undisturbed=False)
    for number, action in enumerate(ROUTE):
        if action == "pickup(1)":
            told.act(number, action, "failure")
        told.act(number, action)
    assert told.story.wrong() == ["no node was killed"]
    told.story.kills("planner")
    assert capsys.readouterr().out.splitlines()[-1] == "  killed: planner"
    assert told.story.wrong() == []
    assert told.story.killed == 1
    assert told.story.trace.events[-1].kind is DriveEventKind.KILL


def test_success_without_a_delivery_is_wrong() -> None:
    told = Told(undisturbed=False)
    told.story.kills("planner")
    for number, action in enumerate(ROUTE[:-1]):
        told.act(number, action)
    told.note(StatusSet("g1", Status.SUCCEEDED, "1"))
    assert any("its package is on a robot" in text for text in told.story.wrong())


def test_what_is_wrong() -> None:
    told = Told()
    for number, action in enumerate([*ROUTE[:2], "go(c6)"]):
        told.act(number, action)
    told.story.touches()
    wrong = "\n".join(told.story.wrong())
    for text in ("has not ended", "one go(c4) was to fail, not go(c6)", "were to be", "touched"):
        assert text in wrong


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
        graph = Map.read(OFFICE)
        graph.starts = {"mailbot": "c1", "mailbot2": "c5"}
        graph.durations = {"pickup": 1}  # so that it is planned in seconds
        self.story = FleetStory(graph, {"o1": (16.0, -4.0), "o3": (16.0, -11.0)})
        for robot in graph.starts:
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
    told.story.learns(StatusSet("goal", Status.SUCCEEDED, "1"))
    assert told.story.wrong() == []
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
        (DriveEventKind.PICKUP, (16.0, -4.0)),
        (DriveEventKind.DELIVERY, (16.0, -11.0)),
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
    assert all("has not ended" in text for text in told.story.wrong())
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
    for goal, request in (
        ("up", "bring(o3,o2)"),
        ("down", "bring(o3,o1)"),
        ("far", "bring(o1,o3)"),
    ):
        told.story.learns(GoalArrived(goal, request, (goal,)))
    plan = ["pickup(2)", "go(c1)", "go(o1)", "deliver(2)"]
    actions = [f"do(mailbot,{action},{step})" for step, action in enumerate(plan, 6)]
    told.story.learns(PlanFound(("do(mailbot2,go(o9),6)", *actions)))
    told.act("pickup(2)")
    for slot, goal in (("1", "up"), ("2", "down"), ("3", "far")):
        told.story.learns(StatusSet(goal, Status.ACCEPTED, slot))
    for action in plan[1:]:
        told.act(action)
    told.story.learns(StatusSet("down", Status.SUCCEEDED, "2"))
    wrong = told.story.wrong()
    assert len(wrong) == 2
    assert all("has not ended" in text for text in wrong)
    said = capsys.readouterr().out
    assert "picks up down at o3" in said
    assert "delivers down at o1" in said


@pytest.mark.parametrize("asked", ["bring(o1,o3)", "bring(o2,o3)", ""])
def test_a_fleet_picks_up_what_nobody_has_asked_for(asked: str) -> None:
    told = Delivery()
    told.act("go(o1)")
    told.act("pickup(1)", "failure")
    if asked:
        told.story.learns(GoalArrived("other", asked, ("other",)))
        told.story.learns(StatusSet("other", Status.CANCELED))
    told.act("pickup(2)")
    assert "mailbot is to do pickup(2): no goal is in this slot" in told.story.wrong()


def test_what_is_wrong_with_a_fleet(capsys: pytest.CaptureFixture[str]) -> None:
    told = Delivery()
    told.act("go(o1)", "failure")
    told.act("go(o13)")
    told.story.touches("mailbot2")
    wrong = "\n".join(told.story.wrong())
    for text in ("not connected", "has not ended", "mailbot2 has touched something"):
        assert text in wrong
    assert "mailbot   go(o1) fails" in capsys.readouterr().out


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
