"""The demo, as scripts/demo runs it, and the real rviz on a screen that is nowhere.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

from pathlib import Path

from readmes import check_output
from screen import screen
from terminals import Terminals, terminals, wait_for

__all__ = ["screen", "terminals"]

OFFICE = (
    "roslaunch", "rosoclingo_gazebo", "mailbot_robot.launch", "simulator:=embedded", "speed:=10"
)  # fmt: skip


def test_the_demo(terminals: Terminals, tmp_path: Path) -> None:
    terminals.start(*OFFICE)
    demo = terminals.start("rosrun", "rosoclingo_gazebo", "demo.py", f"_output:={tmp_path / 'a'}")
    assert demo.wait(180.0) == 0, demo.output
    check_output("README.md", "Try it", demo.output)
    assert "2 deliveries; " in demo.output
    assert "wrong" not in demo.output
    assert {file.name for file in (tmp_path / "a").iterdir()} == {"office.png", "office.svg"}


def test_rviz_shows_the_office(terminals: Terminals, screen: str, tmp_path: Path) -> None:
    terminals.environment["DISPLAY"] = screen
    office = terminals.start(*OFFICE, "rviz:=true")
    wait_for(lambda: "/rviz" in terminals.receivers("/graph_markers", "/graph_markers/markers"))
    picture = str(tmp_path / "rviz.png")

    def is_drawn() -> bool:
        # Within rviz's window, which fills the screen, the part that OpenGL draws.
        terminals.run("import", "-window", "root", "-crop", "1100x780+370+70", picture)
        return int(terminals.run("identify", "-format", "%k", picture).output) > 100

    wait_for(is_drawn)
    assert "xmlrpc reply" in terminals.run("rosnode", "ping", "-c", "1", "/rviz").output
    assert "process has died" not in office.output, office.output
