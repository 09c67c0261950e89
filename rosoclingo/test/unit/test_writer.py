"""Writes bags, and puts the events of a journal in order."""

from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path
from typing import Iterator

import pytest
from bag_maker import BEGIN, Maker, run, source
from rosbags.rosbag1 import Reader

from rosoclingo.bags.read.reader import read_recording
from rosoclingo.bags.record.writer import BagWriter
from rosoclingo.bags.topics import LOOP_TYPES, loop_topics, solver_topics
from rosoclingo.bags.wire import Message
from rosoclingo.errors import BagError


def test_does_not_overwrite(tmp_path: Path) -> None:
    file = tmp_path / "a.bag"
    file.write_text("precious")
    with pytest.raises(BagError, match="not overwritten; give another name"):
        BagWriter(file)
    assert file.read_text() == "precious"


def test_folder_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="folder that exists"):
        BagWriter(tmp_path / "none" / "a.bag")


@pytest.fixture
def small_disk() -> Iterator[None]:
    """No file can be longer than the beginning of a bag."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (8192, hard))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.usefixtures("small_disk")
def test_full_disk(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "a.bag")
    for sender, seconds, content in run(events=200).messages:
        writer.write(Message(sender, BEGIN + round(seconds * 10**9), content))
    with pytest.raises(BagError, match=r"after 203 messages; make room on the disk"):
        writer.flush()


def test_without_messages(tmp_path: Path) -> None:
    file = tmp_path / "a.bag"
    with BagWriter(file):
        assert file.exists()
    assert not file.exists()


def test_killed_after_a_flush(tmp_path: Path) -> None:
    file = tmp_path / "a.bag"
    code = (
        "import os, sys; sys.path.insert(0, sys.argv[2])\n"
        "from pathlib import Path\n"
        "from bag_maker import BEGIN, run\n"
        "from rosoclingo.bags.record.writer import BagWriter\n"
        "from rosoclingo.bags.wire import Message\n"
        "writer = BagWriter(Path(sys.argv[1]))\n"
        "for sender, seconds, content in run().messages:\n"
        "    writer.write(Message(sender, BEGIN + round(seconds * 10**9), content))\n"
        "writer.flush()\n"
        "os.kill(os.getpid(), 9)\n"
    )
    kit = str(Path(__file__).parents[1] / "kit")
    process = subprocess.run([sys.executable, "-c", code, str(file), kit], check=False)
    assert process.returncode == -9
    recording = read_recording(file)
    assert len(recording.entries) == 20
    assert "no intact index" in recording.remarks[0]


def test_keeps_what_the_connections_say(tmp_path: Path) -> None:
    file = Maker().event(1, "end").write(tmp_path / "a.bag")
    with Reader(file) as reader:
        (connection,) = reader.connections
    expected = source("/rosoclingo/journal", LOOP_TYPES["journal"])
    assert connection.topic == expected.topic
    assert connection.digest == expected.md5sum
    assert connection.ext.callerid == "/someone"
    assert connection.ext.latching == 1


def test_topics() -> None:
    assert "/a/rosoclingo/in" in loop_topics("/a/rosoclingo")
    topics = solver_topics(["/a/c", "/a/p"])
    assert "/a/c/control_log" in topics
    assert "/a/p/result" in topics
    assert not any(topic.endswith("/status") for topic in topics)
    for name in ("/a b", "a", "", "/", "/a/", "//a", "/1", "/\x01", "/\u00e9", "\udc80", "/a\n"):
        assert solver_topics([name]) == []
