"""Records the dynamic mailbot, as a user does, and ends the recorder in every way.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import signal
from pathlib import Path

import pytest
from terminals import Terminals, package, terminals, wait_for
from typist import pipe

from rosoclingo.bags.model import Recording
from rosoclingo.bags.read.reader import read_recording
from rosoclingo.bags.topics import loop_topics
from rosoclingo.errors import BagError
from rosoclingo.loop.journal import (
    ActionPublished,
    GoalArrived,
    MessageArrived,
    Status,
    StatusSet,
)

__all__ = ["terminals"]

RECORD = ("rosrun", "rosoclingo", "record.py")
NODES = {"/rosoclingo", "/controller", "/planner"}
ACTIONS = ["go(1)", "pickup(1)", "go(c(1))", "go(c(3))", "go(3)", "deliver(1)"]


def deliver(terminals: Terminals, folder: Path, recorder: str = "") -> None:
    """Has the mailbot bring something from 1 to 3, while a recorder, if it is named, hears all."""
    client, typist = pipe(terminals, folder, "rosrun", "rosoclingo_examples", "mailbot_manual.py")
    if recorder:
        wait_for(lambda: bool(terminals.publishers("/rosoclingo/goal")))
        # It knows of the solvers when the loop has told of itself.
        wait_for(lambda: recorder in terminals.subscribers("/planner/control_log"))
        terminals.wait_until_hears(recorder)
    typist.type("1 3\n")
    client.wait_for("succeeded")
    typist.close()
    client.wait()


def read(bag: Path) -> Recording:
    """Reads a bag that is still being written, when the delivery is in it."""
    found = []

    def is_through() -> bool:
        try:
            recording = read_recording(bag)
        except BagError:
            return False
        found.append(recording)
        statuses = [e.event.status for e in recording.entries if isinstance(e.event, StatusSet)]
        has_ended = Status.SUCCEEDED in statuses
        return has_ended and set(recording.programs) == NODES

    wait_for(is_through)
    return found[-1]


def check(recording: Recording) -> None:
    """Checks that the delivery is recorded, with what the nodes were started with."""
    events = [entry.event for entry in recording.entries]
    assert [entry.number for entry in recording.entries] == list(range(1, len(events) + 1))
    assert [event.action for event in events if isinstance(event, ActionPublished)] == ACTIONS
    # The interface answers with tokens, and on ~in for those who listen: each answer counts once.
    answers = [event.value for event in events if isinstance(event, MessageArrived)]
    assert answers == ["success"] * len(ACTIONS)
    goals = [event for event in events if isinstance(event, GoalArrived)]
    assert [goal.request for goal in goals] == ["bring(1,3)"]
    assert set(recording.programs) == NODES
    mode = package("rosoclingo") / "modes" / "dynamic.incremental.recording.lp"
    assert recording.programs["/controller"].files[str(mode)] == mode.read_text()


@pytest.mark.install_space
def test_launch_argument(terminals: Terminals, tmp_path: Path) -> None:
    bag = tmp_path / "a.bag"
    launch = terminals.start(
        "roslaunch", "rosoclingo_examples", "mailbot_dynamic.launch", f"record:={bag}"
    )
    launch.wait_for("recording /rosoclingo in")
    deliver(terminals, tmp_path, "/recorder")
    launch.interrupt()
    assert launch.wait() == 0
    assert "Traceback" not in launch.output
    assert f"rosrun rosoclingo replay.py {bag}" in launch.output
    recording = read_recording(bag)
    check(recording)
    assert recording.remarks == ()
    info = terminals.run("rosbag", "info", str(bag))
    assert info.process.returncode == 0
    of_the_loop = set(loop_topics("/rosoclingo")) - {"/rosoclingo/cancel"}  # nobody cancels
    for topic in (*of_the_loop, "/planner/control_log", "/controller/about"):
        assert f" {topic} " in info.output, topic
    assert "/planner/status" not in info.output


@pytest.mark.costly
def test_recorders_that_are_interrupted(terminals: Terminals, tmp_path: Path) -> None:
    """And one that is killed, which has begun after the delivery."""
    recorders = {}
    for compression in ("bz2", "lz4"):
        bag = tmp_path / f"{compression}.bag"
        recorders[bag] = terminals.start(
            *RECORD, "-o", str(bag), "--compression", compression, f"__name:={compression}"
        )
        recorders[bag].wait_for("recording /rosoclingo in")  # before there is one
    terminals.start("roslaunch", "rosoclingo_examples", "mailbot_dynamic.launch")
    deliver(terminals, tmp_path)
    for bag, recorder in recorders.items():
        read(bag)
        recorder.interrupt()
        assert recorder.wait() == 0
        assert f"rosrun rosoclingo replay.py {bag}" in recorder.output
        assert "Traceback" not in recorder.output
        check(read_recording(bag))
        assert read_recording(bag).remarks == ()
        assert terminals.run("rosbag", "info", str(bag)).process.returncode == 0

    bag = tmp_path / "late.bag"
    recorder = terminals.start(*RECORD, "-o", str(bag))
    read(bag)
    recorder.process.send_signal(signal.SIGKILL)
    recorder.wait()
    recording = read_recording(bag)
    check(recording)
    assert "no intact index" in recording.remarks[0]
    assert terminals.run("rosbag", "reindex", str(bag)).process.returncode == 0
    assert terminals.run("rosbag", "info", str(bag)).process.returncode == 0


def test_nothing_to_record(terminals: Terminals, tmp_path: Path) -> None:
    bag = tmp_path / "a.bag"
    recorder = terminals.start(*RECORD, "-o", str(bag), "rosoclingo:=/nobody")
    recorder.wait_for("recording /nobody in")
    recorder.interrupt()
    assert recorder.wait() == 0
    assert "/nobody has sent nothing" in recorder.output
    assert not bag.exists()


def test_bag_that_cannot_be_made(terminals: Terminals, tmp_path: Path) -> None:
    bag = tmp_path / "a.bag"
    bag.write_text("precious")
    for file, reason in ((bag, "not overwritten"), (tmp_path / "no" / "a.bag", "No such file")):
        recorder = terminals.run(*RECORD, "-o", str(file))
        assert recorder.process.returncode == 2
        assert reason in recorder.output
    assert bag.read_text() == "precious"
