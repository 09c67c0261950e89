"""A fleet of which one robot's interface is dead for good: the others work, and clients are told.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import List

import pytest
from terminals import Terminals, terminals, wait_for
from typist import pipe

__all__ = ["terminals"]


@pytest.mark.costly
def test_the_others_go_on(terminals: Terminals, tmp_path: Path) -> None:
    terminals.start(
        "roslaunch", "rosoclingo_gazebo", "mailbot_fleet.launch",
        "robots:=2", "speed:=10", "ask_before:=do(mailbot2,go(c5))",
        "policies:={'do(mailbot2,go(c5))': {timeout: 6}}",
    )  # fmt: skip
    mailbot, typist = pipe(terminals, tmp_path, "rosrun", "rosoclingo_examples", "mailbot.py")
    out = terminals.listen("/rosoclingo", "/rosoclingo/out")

    def done() -> List[str]:
        """Returns the actions of mailbot2."""
        texts = [text.replace('"', "").split() for text in out.output.split("---")]
        return [text[3] for text in texts if text[1:2] == ["mailbot2"]]

    interface = terminals.pid("/move_base_interface_mailbot2")
    typist.type("o9 o2 box\n")
    held = terminals.listen("/rosoclingo", "/rosoclingo/held")
    wait_for(lambda: "go(c5)" in held.output, lambda: out.output + held.output)
    os.kill(interface, signal.SIGSTOP)  # roslaunch would start one again that has ended
    try:
        terminals.run("rosservice", "call", "/rosoclingo/approve", "{actuator: mailbot2}")
        typist.type("o1 o3 letter\no8 o10 paper\n")
        mailbot.wait_for("[1] bring(o9,o2) box: waits for mailbot2 which has the package")
        mailbot.wait_for("[2] bring(o1,o3) letter: succeeded")
        mailbot.wait_for("[3] bring(o8,o10) paper: succeeded")
    finally:
        os.kill(interface, signal.SIGKILL)
    assert done() == ["go(o9)", "pickup(1)", "go(c5)", "abort"]
    assert "[1] bring(o9,o2) box: succeeded" not in mailbot.output
