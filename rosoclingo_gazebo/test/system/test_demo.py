"""The demo, as scripts/demo runs it. Needs a sourced workspace, in devel or install space."""

from __future__ import annotations

from pathlib import Path

from terminals import Terminals, terminals

__all__ = ["terminals"]


def test_the_demo(terminals: Terminals, tmp_path: Path) -> None:
    terminals.start(
        "roslaunch", "rosoclingo_gazebo", "mailbot_robot.launch", "simulator:=embedded", "speed:=10"
    )
    demo = terminals.start("rosrun", "rosoclingo_gazebo", "demo.py", f"_output:={tmp_path / 'a'}")
    assert demo.wait(180.0) == 0, demo.output
    assert "go(c4)      failure" in demo.output
    assert "2 deliveries; " in demo.output
    assert "wrong" not in demo.output
    assert {file.name for file in (tmp_path / "a").iterdir()} == {"office.png", "office.svg"}
