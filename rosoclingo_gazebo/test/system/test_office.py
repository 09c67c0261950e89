"""The office as the manual starts it, and what happens when a part of it dies during a drive.

Needs a sourced workspace, in devel or install space. The simulator runs ten times as fast as the
clock on the wall.
"""

from __future__ import annotations

import os
import re
import signal
from pathlib import Path
from typing import List, Tuple

import pytest
from terminals import Terminal, Terminals, package, terminals, wait_for
from typist import Typist, pipe

__all__ = ["terminals"]


def simulator(terminals: Terminals) -> Terminal:
    terminals.environment["ROBOT_INITIAL_POSE"] = "-y -8 -x 7 -z 0 -R 0 -P 0 -Y 0"
    started = terminals.start(
        "roslaunch", "rosoclingo_gazebo", "mailbot_scenario.launch", "speed:=10"
    )
    # What starts next reads use_sim_time, which tells it whose clock to go by.
    wait_for(lambda: terminals.master.getParam("/test", "/use_sim_time")[2] is True)
    return started


def planner(terminals: Terminals, *parameters: str) -> Terminal:
    mailbot = package("rosoclingo_aspprograms") / "mailbot"
    return terminals.start(
        "rosrun", "rosoclingo", "run-1.0.py",
        "--file", str(mailbot / "instances" / "graph_wg.lp"),
        "--file", str(mailbot / "mailbot.lp"),
        *parameters,
    )  # fmt: skip


def interfaces(terminals: Terminals, *arguments: str) -> Terminal:
    return terminals.start(
        "roslaunch", "rosoclingo_interfaces", "mailbot_interfaces.launch", *arguments
    )


def client(terminals: Terminals, folder: Path) -> Tuple[Terminal, Typist]:
    return pipe(terminals, folder, "rosrun", "rosoclingo_examples", "mailbot.py")


def un_block(terminals: Terminals, line: str) -> None:
    announced = terminals.start(
        "bash", "-c", 'exec rosrun rosoclingo_interfaces un_block.py < <(echo "$1")', "bash", line
    )
    assert announced.wait() == 0, announced.output


def actions(node: Terminal) -> list[str]:
    """Returns the actions that rosoclingo says it has published."""
    return [
        line.split("mailbot: ")[1] for line in node.output.splitlines() if "]: mailbot: " in line
    ]


@pytest.mark.install_space
def test_the_manuals_commands(terminals: Terminals, tmp_path: Path) -> None:
    simulator(terminals)
    node = planner(terminals)
    interfaces(terminals)
    mailbot, typist = client(terminals, tmp_path)

    un_block(terminals, "b c3 c4")
    typist.type("o9 o14 box_of_chocolate\n")
    mailbot.wait_for("[1] bring(o9,o14) box_of_chocolate: succeeded")
    # Not by c4, which would be half as far.
    assert actions(node) == [
        "go(c6)", "go(c5)", "go(o9)", "pickup(1)", "go(c5)", "go(c6)", "go(open1)", "go(c1)",
        "go(c2)", "go(c3)", "go(o14)", "deliver(1)",
    ]  # fmt: skip

    # A package that is cancelled on its way goes back to where it came from.
    typist.type("o14 o2 paper\n")
    wait_for(lambda: actions(node)[12:] == ["pickup(1)", "go(c3)"])
    typist.type("2\n")
    mailbot.wait_for("[2] bring(o14,o2) paper: canceled")
    assert actions(node)[12:] == ["pickup(1)", "go(c3)", "go(o14)", "deliver(1)"]

    # Of four requests, three are considered.
    typist.type("o6 o8 a\no6 o8 b\no6 o8 c\no6 o8 d\n")
    mailbot.wait_for("[6] bring(o6,o8) d: queued 1")
    for number, thing in ((3, "a"), (4, "b"), (5, "c")):
        mailbot.wait_for(f"[{number}] bring(o6,o8) {thing}: accepted")
    typist.type("3\n")
    mailbot.wait_for("[3] bring(o6,o8) a: canceled")
    mailbot.wait_for("[6] bring(o6,o8) d: accepted")
    mailbot.interrupt()
    typist.close()
    assert mailbot.wait() == 130


@pytest.mark.costly
def test_what_dies(terminals: Terminals, tmp_path: Path) -> None:
    """The interface begins its drive again; when the simulator dies, the drive fails."""
    office = simulator(terminals)
    node = planner(terminals)
    started = interfaces(terminals)
    mailbot, typist = client(terminals, tmp_path)
    processes = [terminals.pid(name) for name in ("/move_base_interface", "/simulator")]
    typist.type("o9 o14 box\n")

    def goals() -> List[str]:
        return re.findall(r"goal \(.*\)", office.output)

    wait_for(lambda: len(goals()) == 1)
    os.kill(processes[0], signal.SIGKILL)
    wait_for(lambda: len(goals()) > 2)
    # The first drive began once more, in the new process, and only that one arrived.
    first, again, then = goals()[:3]
    assert first == again != then
    assert "failure" not in started.output

    os.kill(processes[1], signal.SIGKILL)
    started.wait_for("/move_base went away during the drive")
    started.wait_for(": failure after")
    # The next go waits for a simulator that may come again.
    started.wait_for("waiting for the action /move_base")
    typist.close()
    for terminal in (mailbot, started, node, office):
        terminal.interrupt()
        terminal.wait()
        assert "Traceback" not in terminal.output


@pytest.mark.costly
def test_an_interface_that_stays_dead(terminals: Terminals, tmp_path: Path) -> None:
    simulator(terminals)
    # Long enough for the interface to start and drive when the first action has failed.
    node = planner(terminals, "_action_timeout:=15")
    interfaces(terminals, "navigation:=none")
    mailbot, typist = client(terminals, tmp_path)
    typist.type("o6 o7 box\n")  # to where both ways are about as long
    typist.close()
    node.wait_for("mailbot has not answered for 15 s")
    places = package("rosoclingo_interfaces") / "config" / "graph_wg.yaml"
    terminals.start(
        "rosrun", "rosoclingo_interfaces", "move_base_interface.py", f"_waypoints:={places}",
        "_actuators:=mailbot",
    )  # fmt: skip
    assert mailbot.wait() == 0, mailbot.output
    assert "[1] bring(o6,o7) box: succeeded" in mailbot.output


@pytest.mark.costly
def test_another_simulator_comes(terminals: Terminals, tmp_path: Path) -> None:
    """It comes when all ways have failed, and its clock begins anew."""
    started = [simulator(terminals), planner(terminals), interfaces(terminals, "timeout:=40")]
    office, node, drives = started
    mailbot, typist = client(terminals, tmp_path)
    process = terminals.pid("/simulator")
    typist.type("o1 o3 box\n")
    office.wait_for("goal (")
    os.kill(process, signal.SIGKILL)
    drives.wait_for("mailbot: go(c1): failure after")
    assert "/move_base went away during the drive" in drives.output
    drives.wait_for("/move_base did not come within 40 s")
    drives.wait_for("mailbot: go(c6): failure after")
    mailbot.wait_for("waiting in step")
    # What waits can be cancelled.
    typist.type("o1 o3 paper\n")
    mailbot.wait_for("[2] bring(o1,o3) paper: accepted")
    typist.type("2\n")
    typist.close()
    mailbot.wait_for("[2] bring(o1,o3) paper: canceled")
    started.append(simulator(terminals))
    assert mailbot.wait() == 0, mailbot.output
    assert "[1] bring(o1,o3) box: succeeded" in mailbot.output
    for way in ("open1 to c1", "open1 to c6"):
        assert f"{way} is not blocked" in drives.output
    assert actions(node)[2:] == ["go(c1)", "go(o1)", "pickup(1)", "go(c1)", "go(o3)", "deliver(1)"]
    for terminal in (office, *started):
        assert "Traceback" not in terminal.output
