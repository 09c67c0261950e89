"""The demo, as scripts/demo runs it, with the real rviz on a screen that is nowhere.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

from pathlib import Path

from readmes import check_output
from screen import screen
from terminals import Terminals, terminals, wait_for

__all__ = ["screen", "terminals"]


def test_the_demo(terminals: Terminals, screen: str, tmp_path: Path) -> None:
    terminals.environment["DISPLAY"] = screen
    office = terminals.start(
        "roslaunch", "rosoclingo_gazebo", "mailbot_robot.launch", "simulator:=embedded",
        "speed:=10", "rviz:=true",
    )  # fmt: skip
    wait_for(lambda: "/rviz" in terminals.subscribers("/graph_markers/markers"))
    demo = terminals.start("rosrun", "rosoclingo_gazebo", "demo.py", f"_output:={tmp_path / 'a'}")
    assert demo.wait(180.0) == 0, demo.output
    check_output("README.md", "Try it", demo.output)
    assert "2 deliveries; " in demo.output
    assert "wrong" not in demo.output
    assert {file.name for file in (tmp_path / "a").iterdir()} == {"office.png", "office.svg"}

    assert "process has died" not in office.output, office.output
    assert "xmlrpc reply" in terminals.run("rosnode", "ping", "-c", "1", "/rviz").output
    picture = str(tmp_path / "rviz.png")
    # Within rviz's window, which fills the screen, the part that OpenGL draws.
    terminals.run("import", "-window", "root", "-crop", "1100x780+370+70", picture)
    colours = terminals.run("identify", "-format", "%k", picture).output
    assert int(colours) > 100
