"""The mailbot examples of the manual, as processes, and what can go wrong at the client's prompt.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Sequence

import pytest
import yaml
from terminals import Terminal, Terminals, package, terminals, wait_for
from typist import CTRL_C, CTRL_D, Typist, keyboard, pipe

__all__ = ["terminals"]

GRID = ("-c", "slots=1", "-c", "x=2", "-c", "y=2")


def mailbot(file: str) -> str:
    """Returns an encoding's path as the manual has it, maybe without ``.lp``."""
    return str(package("rosoclingo_aspprograms") / "mailbot" / file)


def controller(terminals: Terminals, mode: str, steps: int = 14) -> Terminal:
    path = str(package("rosoclingo") / "modes" / f"{mode}.lp")
    return terminals.start(
        "rosrun", "rosclingo", "run.py", "__name:=controller", "-f", path, "-c", f"steps={steps}"
    )


def planner(terminals: Terminals, *files: str, options: Sequence[str] = GRID) -> Terminal:
    encodings = [argument for file in files for argument in ("-f", mailbot(file))]
    return terminals.start("rosrun", "rosclingo", "run.py", "__name:=planner", *encodings, *options)


def dynamic(terminals: Terminals, mode: str, steps: int = 14) -> Terminal:
    """Starts the first four terminals of the manual's dynamic mailbot."""
    controller(terminals, mode, steps)
    planner(terminals, "instances/graph_bench.lp", "mailbot")
    node = terminals.start("rosrun", "rosoclingo", "run.py", "run.py")
    terminals.start("rosrun", "rosoclingo_interfaces", "fulfill.py")
    return node


def plan(terminals: Terminals) -> list[str]:
    """Listens to the published plan, maybe after it was published; without the steps."""
    message = yaml.safe_load(terminals.latched("/rosoclingo/out"))
    assert message["id"] == "solver"
    actions = str(message["action"]).strip("[]").split(", ")
    return [action[len("do(") :].rpartition(",")[0] for action in actions]


# From office 1, which is next to the robot's start, to office 3, in a grid of 2 x 2 corridor nodes.
SHORTEST = [
    "mailbot,go(1)", "mailbot,pickup(1)", "mailbot,go(c(1))", "mailbot,go(c(3))", "mailbot,go(3)",
    "mailbot,deliver(1)",
]  # fmt: skip


@pytest.mark.install_space
def test_the_dynamic_mailbot(terminals: Terminals, tmp_path: Path) -> None:
    node = dynamic(terminals, "dynamic.incremental.recording")
    client, typist = pipe(terminals, tmp_path, "rosrun", "rosoclingo_examples", "mailbot_manual.py")
    typist.type("1 3\n")
    client.wait_for("[1] bring(1,3): succeeded")
    typist.type("3 2\n")
    typist.close()
    assert client.wait() == 0
    assert client.output.splitlines()[-1] == "2 deliveries"
    for line in ("[2] bring(3,2): sent", "[2] bring(3,2): accepted", "[2] bring(3,2): succeeded"):
        assert line in client.output
    assert "mailbot: go(c(3))" in node.output


def test_a_fixed_horizon_in_the_manuals_order(terminals: Terminals, tmp_path: Path) -> None:
    """The request may come too late; the client says so and ends."""
    dynamic(terminals, "dynamic.fixed.recording")
    client, typist = pipe(terminals, tmp_path, "rosrun", "rosoclingo_examples", "mailbot_manual.py")
    typist.type("1 3\n")
    typist.close()
    status = client.wait()
    if status == 0:
        assert client.output.splitlines()[-1] == "1 delivery"
    else:
        assert status == 1
        said = client.output.partition("[1] bring(1,3): aborted: ")[2]
        assert "after its last step, 14; it is too late" in said or "horizon of 14 steps" in said


@pytest.mark.install_space
def test_the_launch_file_of_the_dynamic_mailbot(terminals: Terminals, tmp_path: Path) -> None:
    launch = terminals.start(
        "roslaunch", "rosoclingo_examples", "mailbot_dynamic.launch", "steps:=40", "slots:=3",
        "__ns:=robot1", "delay:=0.05",
    )  # fmt: skip
    terminals.environment["ROS_NAMESPACE"] = "/robot1"
    client, typist = pipe(terminals, tmp_path, "rosrun", "rosoclingo_examples", "mailbot_manual.py")
    typist.type("1 3\n2 4\n4 1\n3 2\n")
    client.wait_for("[4] bring(3,2): ")
    typist.type("4\n")
    typist.close()
    assert client.wait() == 0, client.output + launch.output
    assert client.output.splitlines()[-1] == "3 deliveries, 1 canceled"


@pytest.mark.costly
@pytest.mark.parametrize(
    ("file", "arguments"),
    [
        ("blocks_world.launch", ["mode:=static.fixed.recording", "steps:=14"]),
        ("mailbot_static.launch", ["mode:=static.incremental.recording"]),
    ],
)
def test_the_launch_files_of_static_modes(
    terminals: Terminals, file: str, arguments: list[str]
) -> None:
    terminals.start("roslaunch", "rosoclingo_examples", file, *arguments)
    actions = plan(terminals)
    assert len(actions) == 14 if "blocks" in file else actions == SHORTEST


@pytest.mark.costly
def test_wrong_lines_and_requests(terminals: Terminals, tmp_path: Path) -> None:
    dynamic(terminals, "dynamic.incremental.recording")
    client, typist = pipe(terminals, tmp_path, "rosrun", "rosoclingo_examples", "mailbot_manual.py")
    typist.type("fetch it now\n\n7\n1 X\n1 99\n\xff 1\n1 1\n")
    typist.close()
    assert client.wait() == 1
    for text in (
        "expected FROM TO, such as 1 3, or the ID of a request to cancel it, not 'fetch it now'",
        "there is no request 7; there are: none yet",
        "begins a variable",
        "[1] bring(1,99): rejected: ",
        "[2] bring(1,1): rejected: ",
        "0 deliveries, 2 rejected",
    ):
        assert text in client.output
    assert "Traceback" not in client.output


def test_the_server_that_is_not_there(terminals: Terminals, tmp_path: Path) -> None:
    client, _ = pipe(terminals, tmp_path, "rosrun", "rosoclingo_examples", "mailbot_manual.py")
    client.wait_for("waiting for the server /rosoclingo; is rosoclingo running?")
    client.interrupt()
    assert client.wait() == 130
    assert client.output.splitlines()[-1] == "0 deliveries"


@pytest.mark.costly
@pytest.mark.parametrize("how", ["kill", "terminate"])
def test_the_server_that_goes_away(terminals: Terminals, tmp_path: Path, how: str) -> None:
    controller(terminals, "dynamic.incremental.recording")
    planner(terminals, "instances/graph_bench.lp", "mailbot")
    node = terminals.start("rosrun", "rosoclingo", "run.py")
    client, typist = pipe(terminals, tmp_path, "rosrun", "rosoclingo_examples", "mailbot_manual.py")
    typist.type("1 3\n")
    client.wait_for("[1] bring(1,3): accepted")
    getattr(node.process, how)()
    assert client.wait() == 1
    assert "the server /rosoclingo has gone" in client.output
    assert "Traceback" not in client.output
    typist.close()


@pytest.mark.costly
def test_a_client_and_its_server_are_killed(terminals: Terminals, tmp_path: Path) -> None:
    """Started again, the client goes on with its request, and waits for the server."""
    terminals.start(
        "roslaunch", "rosoclingo_examples", "mailbot_dynamic.launch", "delay:=0.3",
        f"store:={tmp_path / 'a.store'}",
    )  # fmt: skip
    mailbot = ("rosrun", "rosoclingo_examples", "mailbot_manual.py", f"_store:={tmp_path / 'mine'}")
    client, typist = pipe(terminals, tmp_path, *mailbot)
    typist.type("1 3\n")
    client.wait_for("[1] bring(1,3): step 2 of ")
    os.killpg(client.process.pid, signal.SIGKILL)
    client.wait()
    os.kill(terminals.pid("/rosoclingo"), signal.SIGKILL)
    client, typist = pipe(terminals, tmp_path, *mailbot)
    client.wait_for("[1] bring(1,3): succeeded")
    typist.type("3 2\n")
    client.wait_for("[2] bring(3,2): step ")
    os.kill(terminals.pid("/rosoclingo"), signal.SIGKILL)
    client.wait_for("the server /rosoclingo has gone; waiting for it")
    typist.type("2 4\n")
    typist.close()
    assert client.wait() == 0, client.output
    assert "[1] bring(1,3): sent again" in client.output
    assert client.output.splitlines()[-1] == "3 deliveries"


@pytest.mark.costly
def test_at_a_keyboard(terminals: Terminals, tmp_path: Path) -> None:
    """A prompt, words by TAB, a list on Enter, an end with Ctrl-C, and one with Ctrl-D.

    Requests that are open at Ctrl-C go on without the client.
    """
    controller(terminals, "dynamic.incremental.recording", steps=40)
    planner(terminals, "instances/graph_bench.lp", "mailbot")
    terminals.start("rosrun", "rosoclingo", "run.py")
    mailbot = ("rosrun", "rosoclingo_examples", "mailbot_manual.py")
    client, typist = keyboard(terminals, tmp_path, *mailbot)
    client.wait_for("mailbot_manual> ")
    typist.type("what?\n")
    client.wait_for("expected FROM TO")
    typist.type("1 ")
    press_tab(client, typist, "2  3  4")  # as soon as the encoding is known
    typist.type("3\n")
    client.wait_for("[1] bring(1,3): accepted")
    typist.type(f"half a line{CTRL_C}")
    assert client.wait() == 130
    assert client.output.split()[-4:] == ["0", "deliveries,", "1", "open"]
    assert "Traceback" not in client.output
    terminals.listen("/rosoclingo", "/rosoclingo/status").wait_for("status: 1")  # ACTIVE

    results = terminals.listen("/rosoclingo", "/rosoclingo/result")
    terminals.start("rosrun", "rosoclingo_interfaces", "fulfill.py")
    results.wait_for("status: 3")  # SUCCEEDED
    client, typist = keyboard(terminals, tmp_path, *mailbot)
    client.wait_for("mailbot_manual> ")
    typist.type("3 2\n")
    client.wait_for("[1] bring(3,2): succeeded")
    before = client.output.count("[1] bring(3,2): succeeded")
    typist.type("\n")
    wait_for(lambda: client.output.count("[1] bring(3,2): succeeded") == before + 1)
    typist.type(CTRL_D)
    assert client.wait() == 0
    assert client.output.split()[-2:] == ["1", "delivery"]


PLACES = """
rslot(1).
#program state(t).
#external event(1,bring(kitchen,lab),t).
#external event(1,bring(lab,("$(touch)";"`touch`";kitchen)),t).
#external event(1,bring(lab,kitchen,urgent),t).
#external event(1,cancel,t).
asked(t) :- event(1,bring(_,_),t).
asked(t) :- event(1,bring(_,_,_),t).
asked(t) :- asked(t-1), not event(1,cancel,t-1).
status(1,accepted,t) :- asked(t).
status(1,canceled,t) :- asked(t), event(1,cancel,t).
#program query(t).
#external query(t).
#show status/3.
"""


def test_words_at_a_keyboard(terminals: Terminals, tmp_path: Path) -> None:
    """Words of the encoding, whatever their names are, and numbers of open requests."""
    file = tmp_path / "places.lp"
    file.write_text(PLACES)
    terminals.start("rosrun", "rosoclingo", "run-1.0.py", "-f", str(file))
    client, typist = keyboard(terminals, tmp_path, "rosrun", "rosoclingo_examples", "mailbot.py")
    client.wait_for("mailbot> ")
    typist.type("k")
    press_tab(client, typist, "kitchen lab ")
    typist.type("box\n")
    client.wait_for("[1] bring(kitchen,lab) box: ")
    typist.type("\t\t")
    client.wait_for("1  kitchen  lab")
    typist.type('la\t"$\tbox u\t\n')
    client.wait_for('[2] bring(lab,"$(touch)",urgent) box: sent')
    typist.type("1\n")
    client.wait_for("[1] bring(kitchen,lab) box: cancel")
    typist.type(CTRL_C)
    assert client.wait() == 130


def press_tab(client: Terminal, typist: Typist, text: str) -> None:
    """Presses TAB until a text is there: before the encoding is known, it does nothing."""

    def is_there() -> bool:
        typist.type("\t")
        return text in client.output.replace("\a", "")  # the bell, without a word that fits

    wait_for(is_there, lambda: client.output, poll=0.5)


def test_usage(terminals: Terminals) -> None:
    for script in (
        "mailbot.py",
        "mailbot_manual.py",
    ):
        asked = terminals.run("rosrun", "rosoclingo_examples", script, "--help")
        assert asked.wait() == 0
        assert asked.output.startswith(f"usage: {script}")
