"""Makes bags for the tests, from the packages' own message files, with rosbags alone."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any, Dict, List, Sequence, Tuple

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from rosoclingo.bags.record.writer import BagWriter
from rosoclingo.bags.topics import LOOP_TYPES, SOLVER_TYPES
from rosoclingo.bags.wire import Message, PublisherConnection, rosbags_type
from rosoclingo.loop.journal import encode

ROOT = Path(__file__).resolve().parents[3]
BEGIN = 1_700_000_000 * 10**9  # ns


def _make_store() -> Any:
    store = get_typestore(Stores.ROS1_NOETIC)
    texts: Dict[str, str] = {}
    for package in ("rosclingo", "rosoclingo"):
        for file in (ROOT / package / "msg").glob("*.msg"):
            texts[f"{package}/{file.stem}"] = file.read_text()
        for file in (ROOT / package / "action").glob("*.action"):
            parts = file.read_text().split("---\n")
            for part, text in zip(("Goal", "Result", "Feedback"), parts):
                texts[f"{package}/{file.stem}{part}"] = text
                identifier = "GoalID goal_id" if part == "Goal" else "GoalStatus status"
                texts[f"{package}/{file.stem}Action{part}"] = (
                    f"Header header\nactionlib_msgs/{identifier}\n"
                    f"{file.stem}{part} {part.lower()}\n"
                )
    for kind, text in texts.items():
        store.register(get_types_from_msg(text, rosbags_type(kind)))
    return store


STORE = _make_store()


def source(topic: str, kind: str, comment: str = "", md5sum: str = "") -> PublisherConnection:
    """Returns who sends messages of a type to a topic."""
    definition, found = STORE.generate_msgdef(rosbags_type(kind))
    return PublisherConnection(topic, kind, md5sum or found, comment + definition, "/someone", True)


def _build(kind: str, values: Any) -> Any:
    """Makes a message of nested dictionaries."""
    name = rosbags_type(kind)
    known = STORE.get_msgdef(name)
    fields = {}
    for field, (node, what) in known.fields:
        value = values.get(field)
        if node == 2:  # a message
            value = _build(what.replace("/msg/", "/"), value or {})
        elif node == 4 and what[0][0] == 2:  # a list of messages
            value = [_build(what[0][1].replace("/msg/", "/"), one) for one in value or []]
        elif value is None:
            value = [] if node == 4 else ("" if what[0] == "string" else 0)
        fields[field] = value
    return known.cls(**fields)


def data(kind: str, /, **values: Any) -> bytes:
    """Returns the bytes of a message; what is not given is empty."""
    return bytes(STORE.serialize_ros1(_build(kind, values), rosbags_type(kind)))


def stamp(seconds: float) -> Dict[str, int]:
    """Returns a time, in seconds after the beginning."""
    nanoseconds = BEGIN + round(seconds * 10**9)
    return {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}


class Maker:
    """Collects messages of a system and writes them."""

    def __init__(self, name: str = "/rosoclingo") -> None:
        self.name = name
        self.messages: List[Tuple[PublisherConnection, float, bytes]] = []

    def add(self, topic: str, seconds: float, /, **values: Any) -> Maker:
        """Adds a message to one of the loop's topics."""
        kind = LOOP_TYPES[topic]
        self.messages.append((source(f"{self.name}/{topic}", kind), seconds, data(kind, **values)))
        return self

    def event(self, number: int, kind: str, seconds: float = 0.0, **values: Any) -> Maker:
        """Adds an event to the journal, which happened half a second before it was recorded."""
        return self.add(
            "journal", seconds + 0.5, stamp=stamp(seconds), number=number, kind=kind, **values
        )

    def about(self, seconds: float = 0.0) -> Maker:
        """Adds what the nodes say of themselves."""
        names = {"controller": "/controller", "planner": "/planner"}
        self.add(
            "about", seconds, data=json.dumps({"program": "rosoclingo run.py", "solvers": names})
        )
        kind = SOLVER_TYPES["about"]
        for node in names.values():
            text = json.dumps(
                {
                    "program": "rosclingo run.py",
                    "arguments": ["-f", f"{node}.lp"],
                    "files": {f"{node}.lp": {"sha256": "0", "text": "a."}},
                    "versions": {"clingo": "5.5.0"},
                }
            )
            self.messages.append((source(f"{node}/about", kind), seconds, data(kind, data=text)))
        return self

    def write(self, file: Path, compression: str = "none", flush_after: int = 5) -> Path:
        """Writes the bag, in chunks of so many messages."""
        with BagWriter(file, compression) as writer:
            for number, (sender, seconds, content) in enumerate(self.messages, 1):
                writer.write(Message(sender, BEGIN + round(seconds * 10**9), content))
                if number % flush_after == 0:
                    writer.flush()
        return file


def run(name: str = "/rosoclingo", events: int = 20) -> Maker:
    """Returns a run whose events have their number as text."""
    maker = Maker(name).about()
    for number in range(1, events + 1):
        maker.event(number, "command", number * 0.1, text=str(number), step=number // 2)
    return maker


def texts(recording: Any) -> Sequence[str]:
    """Returns the texts of a recording's events."""
    return [encode(entry.event).text for entry in recording.entries]


# Programs that read bags.

_NOT_NEEDED = ("rospy", "genpy", "roslib", "actionlib", "rospkg", "catkin_pkg", "clingo")
_WITHOUT = """
import runpy, sys
for name in sys.argv[1].split():
    sys.modules[name] = None  # importing it fails
sys.argv[:2] = []
runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
"""


def run_without(
    modules: Sequence[str], program: str, *arguments: str
) -> subprocess.CompletedProcess[str]:
    """Runs a program of ``rosoclingo.bags`` where ROS, clingo and the modules are missing."""
    missing = " ".join([*_NOT_NEEDED, *modules])
    command = [sys.executable, "-c", _WITHOUT, missing, f"rosoclingo.bags.{program}", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
