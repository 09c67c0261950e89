"""Reads bags: intact ones, compressed and damaged ones, and what is no bag."""

from __future__ import annotations

import contextlib
import random
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Dict, Tuple

import numpy as np
import pytest
from bag_maker import STORE, Maker, data, run, source, stamp, texts
from hypothesis import given, settings
from hypothesis import strategies as st

from rosoclingo.bags.holds import OperatorDecisions
from rosoclingo.bags.model import FeedbackLine, Recording
from rosoclingo.bags.read.reader import read_recording
from rosoclingo.bags.record.writer import COMPRESSIONS, BagWriter
from rosoclingo.bags.replay.startup import check
from rosoclingo.bags.topics import LOOP_TYPES, MD5SUMS, OLDER_MD5SUMS
from rosoclingo.bags.wire import Message, rosbags_type
from rosoclingo.errors import BagError
from rosoclingo.loop.journal import (
    CancelArrived,
    CommandDone,
    GoalArrived,
    NodeResumed,
    PlanFound,
    encode,
)

NUMBERS = [str(number) for number in range(1, 21)]


@pytest.fixture
def maker() -> Maker:
    return run()


@pytest.mark.parametrize("kind", sorted(MD5SUMS))
def test_md5_sums(kind: str) -> None:
    assert STORE.generate_msgdef(rosbags_type(kind))[1] == MD5SUMS[kind]


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_intact(tmp_path: Path, compression: str) -> None:
    file = run().write(tmp_path / "a.bag", compression)
    recording = read_recording(file)
    assert recording.name == "/rosoclingo"
    assert texts(recording) == NUMBERS
    assert [entry.number for entry in recording.entries] == list(range(1, 21))
    assert recording.entries[3].seconds == pytest.approx(0.4)
    assert recording.entries[3].step == 2
    assert recording.remarks == ()
    assert recording.has_journal
    assert recording.size == file.stat().st_size


@pytest.mark.parametrize("name", ["rosoclingo", "robot1//rosoclingo"])
def test_topics_as_they_were_typed(tmp_path: Path, name: str) -> None:
    """As ``rosbag record`` writes them: without a slash at first, or with two."""
    maker = run(name)
    maker.messages = [
        (one._replace(topic=one.topic.lstrip("/")), *rest) for one, *rest in maker.messages
    ]
    file = maker.write(tmp_path / "a.bag")
    recording = read_recording(file)
    assert recording.name == "/" + name.replace("//", "/")
    assert recording.has_journal
    assert len(recording.entries) == len(NUMBERS)
    assert set(recording.programs) == {recording.name, "/controller", "/planner"}
    check(file, recording, allow_scripts=False)
    assert read_recording(file, name.replace("//", "/")) == recording


def test_programs(tmp_path: Path) -> None:
    programs = read_recording(run().write(tmp_path / "a.bag")).programs
    assert set(programs) == {"/rosoclingo", "/controller", "/planner"}
    assert programs["/rosoclingo"].solvers == {"controller": "/controller", "planner": "/planner"}
    planner = programs["/planner"]
    assert planner.program == "rosclingo run.py"
    assert planner.arguments == ("-f", "/planner.lp")
    assert planner.files == {"/planner.lp": "a."}
    assert planner.versions == {"clingo": "5.5.0"}


def test_what_an_operator_held(tmp_path: Path) -> None:
    held: Dict[str, Any] = {
        "paused": True, "on_hold": ["lift"], "held": ["do(robot,go(2))"], "reasons": ["pause"],
        "tokens": np.array([7], dtype=np.uint32), "rejected": ["do(robot,go(3))"],
        "instead": ["do(robot,go(2),1)"],
    }  # fmt: skip
    nothing = {"tokens": np.array([], dtype=np.uint32)}
    maker = run().add("held", 0.25, **nothing).add("held", 0.75, **held)
    robot = ("robot", "go(2)", "pause")
    rejected = ("robot", "go(3)", "do(robot,go(2),1)")
    assert read_recording(maker.write(tmp_path / "a.bag")).held == (
        (0.25, OperatorDecisions()),
        (0.75, OperatorDecisions(True, ("lift",), (robot,), (7,), (rejected,))),
    )


def test_what_an_operator_held_as_older_messages_say() -> None:
    held = SimpleNamespace(paused=False, on_hold=[], held=["do(robot,go(2))"], reasons=["approval"])
    decisions = OperatorDecisions.of_message(held)
    assert decisions == OperatorDecisions(held=(("robot", "go(2)", "approval"),), tokens=(0,))


def test_feedback(tmp_path: Path) -> None:
    said: Dict[str, Any] = {"status": {"goal_id": {"id": "g"}}, "feedback": {"status": "plan 7"}}
    file = run().add("feedback", 0.5, **said).write(tmp_path / "a.bag")
    assert read_recording(file, with_feedback=True).feedback[-1] == FeedbackLine(0.5, "g", "plan 7")
    assert read_recording(file).feedback == ()


def test_about_that_is_no_description(tmp_path: Path) -> None:
    maker = Maker().event(1, "end").add("about", 0.0, data="[1")
    recording = read_recording(maker.write(tmp_path / "a.bag"))
    assert recording.programs == {}
    assert "/rosoclingo/about does not say how" in recording.remarks[0]


def test_events_twice_and_out_of_order(maker: Maker, tmp_path: Path) -> None:
    maker.messages += maker.messages[3:9]
    random.Random(1).shuffle(maker.messages)
    recording = read_recording(maker.write(tmp_path / "a.bag"))
    assert texts(recording) == NUMBERS
    assert recording.remarks == ()


def test_missing_events(maker: Maker, tmp_path: Path) -> None:
    del maker.messages[10:13]
    assert read_recording(maker.write(tmp_path / "a.bag")).remarks == (
        "3 events of the journal are missing",
    )


def test_numbers_that_no_rosoclingo_sends(tmp_path: Path) -> None:
    maker = run().event(0, "end", 3.0, text="none").event(2**32 - 1, "end", 4.0, text="last")
    recording = read_recording(maker.write(tmp_path / "a.bag"))
    assert texts(recording) == [*NUMBERS, "last"]
    assert recording.remarks == (
        "1 events of /rosoclingo/journal have no number, so that they are not of /rosoclingo, and "
        "were left out",
        f"{2**32 - 22} events of the journal are missing",
    )


def test_node_started_again(maker: Maker, tmp_path: Path) -> None:
    for number in (1, 2, 3):
        maker.event(number, "command", 5.0 + number, text=f"again {number}")
    recording = read_recording(maker.write(tmp_path / "a.bag"))
    assert texts(recording) == ["again 1", "again 2", "again 3"]
    assert "2 times" in recording.remarks[0]


def test_a_node_that_goes_on_and_has_forgotten_what_came_last(maker: Maker, tmp_path: Path) -> None:
    last = len(NUMBERS)
    maker.event(last, "resumed", 50.0, id="rosoclingo")
    maker.event(last + 1, "command", 51.0, text="again")
    recording = read_recording(maker.write(tmp_path / "a.bag"))
    assert texts(recording) == [*NUMBERS[:-1], "", "again"]
    assert isinstance(recording.entries[last - 1].event, NodeResumed)
    assert not recording.remarks


# Damaged bags.


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_without_index(tmp_path: Path, compression: str) -> None:
    file = run().write(tmp_path / "a.bag", compression)
    content = file.read_bytes()
    at = content.index(b"index_pos=") + len(b"index_pos=")
    for index, reason in ((0, "its recorder did not end it"), (5, "does not fit the rest")):
        file.write_bytes(content[:at] + index.to_bytes(8, "little") + content[at + 8 :])
        recording = read_recording(file)
        assert texts(recording) == NUMBERS
        assert f"no intact index ({'the index ' if index else ''}{reason})" in recording.remarks[0]


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_truncated(tmp_path: Path, compression: str) -> None:
    file = run().write(tmp_path / "a.bag", compression)
    content = file.read_bytes()
    third = content.index(b"compression=", content.index(b"compression=", 5000) + 1)
    file.write_bytes(content[: third + 400])
    recording = read_recording(file)
    known = texts(recording)
    assert 0 < len(known) < 20
    assert known == NUMBERS[: len(known)]
    assert "no intact index" in recording.remarks[0]
    assert recording.remarks[1].startswith("lost: ")


def test_damaged_chunk(tmp_path: Path) -> None:
    file = run().write(tmp_path / "a.bag", "bz2")
    content = bytearray(file.read_bytes())
    at = content.rindex(b"BZh9") + 20
    content[at : at + 4] = bytes(4)
    file.write_bytes(bytes(content))
    recording = read_recording(file)
    assert 0 < len(recording.entries) < 20
    assert any("cannot be decompressed" in remark for remark in recording.remarks)


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Tuple[Path, bytes]:
    """Where to write a bag, and the content of an intact one."""
    folder = tmp_path_factory.mktemp("bags")
    return folder / "cut.bag", run(events=6).write(folder / "a.bag", "lz4").read_bytes()


def _read(file: Path, content: bytes) -> None:
    file.write_bytes(content)
    with contextlib.suppress(BagError):
        assert isinstance(read_recording(file), Recording)


@pytest.mark.costly
@pytest.mark.long
@settings(max_examples=150, deadline=None)
@given(place=st.floats(0, 1, exclude_max=True))
def test_any_truncation(sample: Tuple[Path, bytes], place: float) -> None:
    file, content = sample
    begin = 4096  # before are magic and bag header only
    _read(file, content[: begin + int(place * (len(content) - begin))])


@pytest.mark.long
@settings(max_examples=60, deadline=None)
@given(length=st.integers(0, 4200))
def test_any_truncation_of_the_beginning(sample: Tuple[Path, bytes], length: int) -> None:
    file, content = sample
    _read(file, content[:length])


@pytest.mark.costly
@pytest.mark.long
@settings(max_examples=150, deadline=None)
@given(place=st.floats(0, 1, exclude_max=True), value=st.integers(0, 255))
def test_any_wrong_byte(sample: Tuple[Path, bytes], place: float, value: int) -> None:
    file, content = sample
    at = int(place * len(content))
    _read(file, content[:at] + bytes([value]) + content[at + 1 :])


# What is no bag, or not ours.


def test_no_file(tmp_path: Path) -> None:
    with pytest.raises(BagError, match=r"none\.bag: No such file"):
        read_recording(tmp_path / "none.bag")


def test_folder(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="this is a folder"):
        read_recording(tmp_path)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "the file is empty"),
        (b"PK\x03\x04 and more", "no ROS 1 bag"),
        (b"#ROSBAG V1.2\nmore", "version 1.2"),
        (b"#ROSBAG V" + b"2" * 5000 + b".0\n", "no ROS 1 bag"),
        (b"#ROSRECORD V1.1\nmore", "no ROS 1 bag"),
        (b"#ROSBAG V2.0\n", "nothing can be read"),
        (b"#ROSBAG V2.0\nnonsense that is no record", "nothing can be read"),
    ],
)
def test_no_bag(tmp_path: Path, content: bytes, words: str) -> None:
    file = tmp_path / "a.bag"
    file.write_bytes(content)
    with pytest.raises(BagError, match=words):
        read_recording(file)


def test_encrypted(tmp_path: Path) -> None:
    file = run().write(tmp_path / "a.bag")
    content = file.read_bytes()
    at = content.index(b"\n") + 1
    length = int.from_bytes(content[at : at + 4], "little")
    header = content[at + 4 : at + 4 + length] + b"\x14\0\0\0encryptor=rosbag/Aes"
    rest = content[at + 4 + length :]
    file.write_bytes(content[:at] + len(header).to_bytes(4, "little") + header + rest)
    with pytest.raises(BagError, match="rosbag decrypt"):
        read_recording(file)


def test_other_topics_only(tmp_path: Path) -> None:
    file = tmp_path / "a.bag"
    with BagWriter(file) as writer:
        kind = "std_msgs/String"
        writer.write(Message(source("/chatter/in", kind), 10**18, data(kind, data="hello")))
    with pytest.raises(BagError, match=r"/chatter/in, nothing of rosoclingo"):
        read_recording(file)


def test_no_message_that_can_be_read(tmp_path: Path) -> None:
    maker = Maker().event(1, "end")
    maker.messages = [(sender, seconds, b"") for sender, seconds, _ in maker.messages]
    with pytest.raises(BagError, match=r"no message that can be read .*are damaged"):
        read_recording(maker.write(tmp_path / "a.bag"))


def test_several_systems(tmp_path: Path) -> None:
    first, second = run("/a/rosoclingo"), run("/b/rosoclingo", events=3)
    first.messages += second.messages
    file = first.write(tmp_path / "a.bag")
    with pytest.raises(BagError, match="/a/rosoclingo, /b/rosoclingo"):
        read_recording(file)
    assert len(read_recording(file, "/b/rosoclingo").entries) == 3
    assert len(read_recording(file, "a/rosoclingo").entries) == 20
    with pytest.raises(BagError, match=r"no topics of /c; there are /a/rosoclingo"):
        read_recording(file, "c")


# Types.


def test_other_comments(maker: Maker, tmp_path: Path) -> None:
    kind = LOOP_TYPES["journal"]
    other = source("/rosoclingo/journal", kind, comment="# Another comment: = MSG: \n\n")
    maker.messages = [
        (other if sender.type == kind else sender, seconds, content)
        for sender, seconds, content in maker.messages
    ]
    recording = read_recording(maker.write(tmp_path / "a.bag"))
    assert texts(recording) == NUMBERS
    assert recording.remarks == ()


def test_journal_of_another_md5_sum(maker: Maker, tmp_path: Path) -> None:
    other = source("/rosoclingo/journal", LOOP_TYPES["journal"], md5sum="0" * 32)
    maker.messages = [(other, seconds, content) for _, seconds, content in maker.messages]
    with pytest.raises(BagError, match=r"MD5 sum 0000.*record again"):
        read_recording(maker.write(tmp_path / "a.bag"))


def test_definition_that_does_not_fit_its_md5_sum(tmp_path: Path) -> None:
    kind = LOOP_TYPES["journal"]
    lying = source("/rosoclingo/journal", kind)._replace(definition="uint32 number\n")
    maker = Maker()
    maker.messages.append((lying, 0.0, bytes(4)))
    with pytest.raises(BagError, match="does not have the MD5 sum"):
        read_recording(maker.write(tmp_path / "a.bag"))


def test_a_foreign_connection_beside_the_right_one(maker: Maker, tmp_path: Path) -> None:
    foreign = source("/rosoclingo/journal", "std_msgs/String")
    maker.messages.append((foreign, 1.0, data("std_msgs/String", data="hello")))
    recording = read_recording(maker.write(tmp_path / "a.bag"))
    assert texts(recording) == NUMBERS
    assert "recorded as std_msgs/String" in recording.remarks[0]


def test_messages_that_are_too_short(maker: Maker, tmp_path: Path) -> None:
    sender, seconds, content = maker.messages[-1]
    maker.messages[-1] = (sender, seconds, content[:10])
    recording = read_recording(maker.write(tmp_path / "a.bag"))
    assert texts(recording) == NUMBERS[:-1]
    assert "1 messages of /rosoclingo/journal are damaged" in recording.remarks[0]


# Bags of systems without a journal.

GOAL = {"id": "g1", "stamp": stamp(0.0)}


def _old() -> Maker:
    maker = Maker()
    maker.add("goal", 0.0, goal_id=GOAL, goal={"request": "bring(1,3)", "information": ["a"]})
    maker.add("feedback", 0.1, status={"goal_id": GOAL}, feedback={"status": "plan 9 steps"})
    maker.add("status", 0.2, status_list=[{"goal_id": GOAL, "status": 1}])
    maker.add("out", 0.3, id="r", action="go(1)")
    maker.add("in", 0.4, id="r", value="success")
    maker.add("in", 0.5, id="r", value="failure")  # recorded just before its action
    maker.add("out", 0.55, id="r", action="go(2)")
    maker.add("in", 0.6, id="door", value="open")
    maker.add("status", 0.7, status_list=[{"goal_id": GOAL, "status": 3, "text": "done"}])
    maker.add("result", 0.8, status={"goal_id": GOAL, "status": 3, "text": "done"})
    return maker


def test_goals_without_information(tmp_path: Path) -> None:
    """As clients of 1.0 send them."""
    maker, kind = _old(), LOOP_TYPES["goal"]
    sender, seconds, _ = maker.messages[0]
    sender = sender._replace(
        definition=sender.definition.replace("string[] information\n", ""),
        md5sum=OLDER_MD5SUMS[kind],
    )
    whole = data(kind, goal_id=GOAL, goal={"request": "bring(1,3)"})
    maker.messages[0] = (sender, seconds, whole[:-4])  # the length of what is not there
    recording = read_recording(maker.write(tmp_path / "a.bag"))
    assert isinstance(recording.entries[0].event, GoalArrived)
    assert recording.entries[0].event.request == "bring(1,3)"
    assert recording.entries[0].event.information == ()


def test_old_bag(tmp_path: Path) -> None:
    recording = read_recording(_old().write(tmp_path / "a.bag"))
    assert not recording.has_journal
    assert "no journal" in recording.remarks[0]
    assert recording.programs == {}
    events = [encode(entry.event) for entry in recording.entries]
    steps = [entry.step for entry in recording.entries]
    assert [(e.kind, e.id, e.text, step) for e, step in zip(events, steps)] == [
        ("goal", "g1", "bring(1,3)", 0),
        ("status", "g1", "accepted", 0),
        ("action", "r", "go(1)", 1),
        ("message", "r", "success", 1),
        ("action", "r", "go(2)", 2),
        ("message", "r", "failure", 2),
        ("message", "door", "open", 2),
        ("status", "g1", "succeeded", 2),
    ]
    assert events[0].details == ("a",)
    assert events[-1].details == ("", "done")
    assert {entry.horizon for entry in recording.entries[1:]} == {9}


@pytest.mark.parametrize(
    ("cancel", "canceled"),
    [
        ({"id": "g1"}, ["g1"]),
        ({}, ["g1", "g2"]),
        ({"stamp": stamp(0.5)}, ["g1"]),
        ({"id": "g2", "stamp": stamp(0.5)}, ["g1", "g2"]),
        ({"id": "other"}, []),
    ],
)
def test_old_bag_with_cancel(tmp_path: Path, cancel: dict, canceled: list) -> None:
    maker = Maker()
    maker.add("goal", 0.0, goal_id={"id": "g1", "stamp": stamp(0.0)}, goal={"request": "a"})
    maker.add("goal", 1.0, goal_id={"id": "g2", "stamp": stamp(1.0)}, goal={"request": "b"})
    maker.add("cancel", 2.0, **cancel)
    recording = read_recording(maker.write(tmp_path / "a.bag"))
    events = [entry.event for entry in recording.entries]
    found = [event.goal for event in events if isinstance(event, CancelArrived)]
    assert found == canceled


def test_old_bag_of_a_static_mode(tmp_path: Path) -> None:
    plan = "[do(a,move(b,1),1), do(a,put,2)]"
    maker = Maker().add("out", 0.0, id="solver", action=plan)
    found = [entry.event for entry in read_recording(maker.write(tmp_path / "a.bag")).entries]
    assert found == [PlanFound(("do(a,move(b,1),1)", "do(a,put,2)")), CommandDone("publish")]
