"""Records what foreign publishers send to a system's topics.

Needs a sourced workspace.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from terminals import Terminals, terminals, wait_for

from rosoclingo.bags.read.reader import read_recording
from rosoclingo.errors import BagError

__all__ = ["terminals"]

EVENT = "{{number: {}, kind: end, stamp: {{secs: {}, nsecs: 0}}}}"


@pytest.mark.costly
def test_what_no_rosoclingo_sends(terminals: Terminals, tmp_path: Path) -> None:
    bag = tmp_path / "a.bag"
    solvers = {"controller": "/a b\x01", "planner": "\udc80"}
    about = json.dumps({"program": "rosoclingo run.py", "solvers": solvers})
    publish = ("rostopic", "pub")
    terminals.start(*publish, "/rosoclingo/about", "std_msgs/String", json.dumps({"data": about}))
    for number, seconds in ((0, 1), (1, 2), (2**32 - 1, 2**32 - 1)):
        event = EVENT.format(number, seconds)
        terminals.start(*publish, "/rosoclingo/journal", "rosoclingo/ROSoClingoEvent", event)
    recorder = terminals.start("rosrun", "rosoclingo", "record.py", "-o", str(bag))

    def has_come() -> bool:
        try:
            recording = read_recording(bag)
        except BagError:
            return False
        numbers = [entry.number for entry in recording.entries]
        return (
            numbers == [1, 2**32 - 1]
            and any("have no number" in remark for remark in recording.remarks)
            and "/rosoclingo" in recording.programs
        )

    wait_for(lambda: has_come() or recorder.process.poll() is not None)
    recorder.interrupt()
    assert recorder.wait() == 0, recorder.output
    assert "Traceback" not in recorder.output
    assert has_come()
