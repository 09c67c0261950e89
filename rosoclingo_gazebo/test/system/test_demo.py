"""The demo, as scripts/demo runs it, and the real rviz on a screen that is nowhere.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import re
from pathlib import Path

from readmes import check_output
from screen import screen
from terminals import Terminal, Terminals, terminals, wait_for

__all__ = ["screen", "terminals"]

OFFICE = (
    "roslaunch", "rosoclingo_gazebo", "mailbot_robot.launch", "simulator:=embedded", "speed:=10"
)  # fmt: skip

RVIZ_BROKE = re.compile(r"\[rviz-\d+\] process has died.*exit code -6")
"""Once in some dozens of starts, malloc finds that rviz has broken its heap before it listens."""


def test_the_demo(terminals: Terminals, tmp_path: Path) -> None:
    terminals.start(*OFFICE)
    demo = terminals.start("rosrun", "rosoclingo_gazebo", "demo.py", f"_output:={tmp_path / 'a'}")
    assert demo.wait(330.0) == 0, demo.output
    check_output("README.md", "Try it", demo.output)
    assert "2 deliveries; " in demo.output
    assert "wrong" not in demo.output
    assert {file.name for file in (tmp_path / "a").iterdir()} == {"office.png", "office.svg"}


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


def test_a_fleet(terminals: Terminals, tmp_path: Path) -> None:
    terminals.start(
        "roslaunch", "rosoclingo_gazebo", "mailbot_fleet.launch", "robots:=2", "speed:=15"
    )
    demo = terminals.start(
        "rosrun", "rosoclingo_gazebo", "fleet_demo.py",
        "_robots:=2", "_packages:=3", "_seed:=2", f"_output:={tmp_path / 'a'}",
    )  # fmt: skip
    assert demo.wait(120.0) == 0, demo.output
    assert "3 packages delivered by 2 robots" in demo.output
    assert demo.output.count("picks up package") == demo.output.count("delivers package") == 3
    assert {file.name for file in (tmp_path / "a").iterdir()} == {"fleet.png", "fleet.svg"}


def start_with_rviz(terminals: Terminals) -> Terminal:
    """Starts the office with rviz, and waits until that listens, or is broken."""
    office = terminals.start(*OFFICE, "rviz:=true")
    markers = ("/graph_markers", "/graph_markers/markers")
    wait_for(
        lambda: bool(RVIZ_BROKE.search(office.output)) or "/rviz" in terminals.receivers(*markers)
    )
    return office


def test_rviz_shows_the_office(terminals: Terminals, screen: str, tmp_path: Path) -> None:
    terminals.environment["DISPLAY"] = screen
    office = start_with_rviz(terminals)
    if RVIZ_BROKE.search(office.output):
        office.interrupt()
        office.wait()
        office = start_with_rviz(terminals)
    picture = str(tmp_path / "rviz.png")

    def is_drawn() -> bool:
        # Within rviz's window, which fills the screen, the part that OpenGL draws.
        terminals.run("import", "-window", "root", "-crop", "1100x780+370+70", picture)
        return int(terminals.run("identify", "-format", "%k", picture).output) > 100

    wait_for(is_drawn)
    assert "xmlrpc reply" in terminals.run("rosnode", "ping", "-c", "1", "/rviz").output
    assert "process has died" not in office.output, office.output
