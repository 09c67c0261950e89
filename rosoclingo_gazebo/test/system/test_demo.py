"""The demo, as scripts/demo runs it.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from readmes import check_output
from terminals import Terminals, package, terminals

__all__ = ["terminals"]

OFFICE = (
    "roslaunch", "rosoclingo_gazebo", "mailbot_robot.launch", "simulator:=embedded", "speed:=10"
)  # fmt: skip


def test_the_demo(terminals: Terminals, tmp_path: Path) -> None:
    terminals.start(*OFFICE)
    demo = terminals.start("rosrun", "rosoclingo_gazebo", "demo.py", f"_output:={tmp_path / 'a'}")
    assert demo.wait(330.0) == 0, demo.output
    check_output("README.md", "Try it", demo.output)
    assert "2 deliveries; " in demo.output
    assert "wrong" not in demo.output
    assert {file.name for file in (tmp_path / "a").iterdir()} == {"office.png", "office.svg"}


@pytest.mark.costly
def test_nodes_are_killed(terminals: Terminals, tmp_path: Path) -> None:
    """As scripts/demo --kill has it: the deliveries are made, whoever dies."""
    office = terminals.start(
        *OFFICE, "mode:=dynamic.incremental.recording", f"store:={tmp_path / 'run.store'}"
    )
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
    demo = terminals.start(
        "rosrun", "rosoclingo_gazebo", "demo.py", "_story:=carried", f"_output:={tmp_path / 'a'}"
    )
    assert demo.wait(330.0) == 0, demo.output
    check_output("README.md", "A robot that is carried", demo.output)
    assert "wrong" not in demo.output
    assert {file.name for file in (tmp_path / "a").iterdir()} == {"carried.png", "carried.svg"}
    told = [one for one in yaml.safe_load_all(beliefs.output) if one]
    best = [one["explanations"][0]["causes"] for one in told if one["explanations"]]
    assert best[0] == ["passing(c3,o14,1)"]
    assert best[-1] == ["carried(mailbot,1)"]
    assert told[-1]["explanations"] == []  # nothing of it matters any more
    office.interrupt()
    office.wait()
    replayed = terminals.run("rosrun", "rosoclingo", "replay.py", str(bag))
    assert "no difference at level exact: 1 goal" in replayed.output
    assert replayed.wait() == 0, replayed.output


@pytest.mark.costly
def test_a_fleet(terminals: Terminals, tmp_path: Path) -> None:
    terminals.start(
        "roslaunch", "rosoclingo_gazebo", "mailbot_fleet.launch", "robots:=2", "speed:=15"
    )
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
