"""The demo, as scripts/demo runs it, and what the demo itself does not check: how robots drive.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import List, NamedTuple, Tuple

import pytest
import yaml
from readmes import check_output
from terminals import Terminal, Terminals, package, terminals

from journal_validator import JournalValidator
from rosoclingo.bags.read.reader import read_recording
from rosoclingo.encodings.graph import read_graph
from rosoclingo_aspprograms.validator import Map

__all__ = ["terminals"]

OFFICE = (
    "roslaunch", "rosoclingo_gazebo", "mailbot_robot.launch", "simulator:=embedded", "speed:=10"
)  # fmt: skip
ROUTE = (
    "go(c6) go(c5) go(c4) go(c6) go(open1) go(c1) go(c2) go(o2) pickup(2) go(c2) go(c1) go(o3) "
    "deliver(2) go(c1) go(c2) go(c3) go(c4) go(o7) pickup(1) go(c4) go(o11) deliver(1)"
)
INSTANCES = package("rosoclingo_aspprograms") / "mailbot" / "instances"
NEAR_METRES = 1.0
TOUCHES = "data: True"


WITHOUT_MATPLOTLIB = """
import sys; sys.modules["matplotlib"] = None  # importing it fails
from types import SimpleNamespace
from rosoclingo_gazebo.ros.fleet_demo import FleetDemo
from rosoclingo_gazebo.ros.program import run_demo

class Delivered(FleetDemo):
    def __init__(self):
        self.story = SimpleNamespace(there=True, members={}, summary=str)

    def run(self):
        return []

    def lines(self, seconds):
        return ["all is delivered"]

run_demo("demo", "", Delivered)
"""


class Step(NamedTuple):
    """A line of the demo: an action, its end, and where the robot was then, in metres."""

    action: str
    answer: str
    place: Tuple[float, float]

    def near(self, place: str) -> bool:
        return math.dist(self.place, PLACES[place]) < NEAR_METRES


PLACES = read_graph([str(INSTANCES / "graph_wg.lp")]).places


def steps(text: str) -> List[Step]:
    """Reads the steps of what a demo has printed."""
    line = r"^  step \d+ of \d+ +(\S+) +(\S+) .* at \((\S+), (\S+)\)$"
    found = re.findall(line, text, re.MULTILINE)
    return [Step(action, answer, (float(x), float(y))) for action, answer, x, y in found]


def impossible(office: Terminal, bag: Path, graph: Map) -> List[str]:
    """Ends a run that is recorded, and returns what was not possible on the map."""
    office.interrupt()
    office.wait()
    journal = JournalValidator(graph)
    for entry in read_recording(bag).entries:
        journal.learns(entry.event)
    assert journal.validator.delivered > 1
    return journal.validator.finish()


def test_the_demo(terminals: Terminals, tmp_path: Path) -> None:
    """The robot goes the way of the paper, of which one drive fails."""
    bag = tmp_path / "run.bag"
    office = terminals.start(*OFFICE, f"record:={bag}")
    touches = terminals.listen("/simulator", "/simulator/touches")
    demo = terminals.start("rosrun", "rosoclingo_gazebo", "demo.py", f"_output:={tmp_path / 'a'}")
    assert demo.wait(330.0) == 0, demo.output
    check_output("rosoclingo_gazebo/README.md", "The demo", demo.output)
    assert "2 deliveries; " in demo.output
    assert "wrong" not in demo.output
    assert {file.name for file in (tmp_path / "a").iterdir()} == {"office.png", "office.svg"}
    assert [step.action for step in steps(demo.output)] == ROUTE.split()
    failed = [step.action for step in steps(demo.output) if step.answer != "success"]
    assert failed == ["go(c4)"]
    assert impossible(office, bag, Map.read(INSTANCES / "graph_wg.lp")) == []
    assert TOUCHES not in touches.output


def test_without_matplotlib_there_is_no_picture(terminals: Terminals) -> None:
    demo = terminals.run("python", "-c", WITHOUT_MATPLOTLIB)
    assert demo.wait() == 0, demo.output
    assert "all is delivered" in demo.output
    assert "no picture: " in demo.output
    assert "pictures need matplotlib" in demo.output
    assert "-m pip install 'matplotlib>=3.6'" in demo.output


@pytest.mark.costly
def test_nodes_are_killed(terminals: Terminals, tmp_path: Path) -> None:
    """As scripts/demo --kill has it: the deliveries are made, whoever dies."""
    bag = tmp_path / "run.bag"
    office = terminals.start(
        *OFFICE, "mode:=dynamic.incremental.recording", f"store:={tmp_path / 'run.store'}",
        f"record:={bag}",
    )  # fmt: skip
    touches = terminals.listen("/simulator", "/simulator/touches")
    demo = terminals.start(
        "rosrun", "rosoclingo_gazebo", "demo.py", f"_output:={tmp_path / 'a'}", "_kill:=2"
    )
    assert demo.wait(330.0) == 0, demo.output
    killed = [line.split()[1] for line in demo.output.splitlines() if line.startswith("  killed: ")]
    assert f"{len(killed)} nodes killed, " in demo.output
    for node in killed[:-1]:  # the last one may come too late for roslaunch to say so
        assert f"[{node}-" in office.output
    assert office.output.count("exit code -9") >= len(killed) - 1 > 0
    for wrong in ("wrong", "Traceback"):
        assert wrong not in demo.output + office.output
    assert "a node is killed" in (tmp_path / "a" / "office.svg").read_text()
    assert impossible(office, bag, Map.read(INSTANCES / "graph_wg.lp")) == []
    assert TOUCHES not in touches.output


@pytest.mark.costly
def test_a_robot_that_is_carried(terminals: Terminals, tmp_path: Path) -> None:
    """As scripts/demo --carried has it, but in three nodes; a replay is exact."""
    faults = package("rosoclingo_gazebo") / "config" / "carried.yaml"
    bag = tmp_path / "run.bag"
    office = terminals.start(
        *OFFICE, "causes:=true", f"faults:={faults}", f"record:={bag}",
        "mode:=dynamic.incremental.recording",
    )  # fmt: skip
    beliefs = terminals.listen("/rosoclingo", "/rosoclingo/beliefs")
    touches = terminals.listen("/simulator", "/simulator/touches")
    demo = terminals.start(
        "rosrun", "rosoclingo_gazebo", "demo.py", "_story:=carried", f"_output:={tmp_path / 'a'}"
    )
    assert demo.wait(330.0) == 0, demo.output
    check_output("rosoclingo_gazebo/README.md", "A robot that is carried", demo.output)
    assert "wrong" not in demo.output
    assert {file.name for file in (tmp_path / "a").iterdir()} == {"carried.png", "carried.svg"}
    told = [one for one in yaml.safe_load_all(beliefs.output) if one]
    best = [one["explanations"][0]["causes"] for one in told if one["explanations"]]
    assert best[0] == ["passing(c3,o14,1)"]
    assert best[-1] == ["carried(mailbot,1)"]
    assert told[-1]["explanations"] == []  # nothing of it matters any more
    assert demo.output.count("carried unnoticed: the robot is at") == 1
    seen = re.findall(r"it sees that it is at (\S+)", demo.output)
    looked = [step for step in steps(demo.output) if step.action == "look"]
    assert seen
    assert len(seen) == len(looked)
    assert all(step.near(place) for step, place in zip(looked, seen)), demo.output
    (delivery,) = [step for step in steps(demo.output) if step.action == "deliver(1)"]
    assert delivery.near("o14")
    assert TOUCHES not in touches.output
    office.interrupt()
    office.wait()
    replayed = terminals.run("rosrun", "rosoclingo", "replay.py", str(bag))
    assert "no difference at level exact: 1 goal" in replayed.output
    assert replayed.wait() == 0, replayed.output


@pytest.mark.costly
def test_a_fleet(terminals: Terminals, tmp_path: Path) -> None:
    bag = tmp_path / "run.bag"
    office = terminals.start(
        "roslaunch", "rosoclingo_gazebo", "mailbot_fleet.launch", "robots:=2", "speed:=15",
        f"record:={bag}",
    )  # fmt: skip
    graph = Map.read(INSTANCES / "graph_wg.lp")
    graph.starts = dict(read_graph([str(INSTANCES / "fleet_2.lp")]).starts)
    graph.durations.update(pickup=1, deliver=1)  # it is planned in seconds
    touches = [
        terminals.listen("/simulator", f"/simulator/{robot}/touches") for robot in graph.starts
    ]
    asking = "echo o9 o14 box urgent | rosrun rosoclingo_examples mailbot.py"
    somebody = terminals.start("sh", "-c", asking)
    demo = terminals.start(
        "rosrun", "rosoclingo_gazebo", "fleet_demo.py",
        "_robots:=2", "_packages:=3", "_seed:=2", f"_output:={tmp_path / 'a'}",
    )  # fmt: skip
    assert demo.wait(120.0) == 0, demo.output
    assert "asked to bring box from o9 to o14, urgent" in demo.output
    assert somebody.wait() == 0, somebody.output
    assert "4 packages delivered by 2 robots" in demo.output
    assert demo.output.count("picks up package") == demo.output.count("delivers package") == 3
    assert {file.name for file in (tmp_path / "a").iterdir()} == {"fleet.png", "fleet.svg"}
    assert impossible(office, bag, graph) == []
    assert not any(TOUCHES in heard.output for heard in touches)
