"""Messages as they were on the wire. Needs no ROS."""

from __future__ import annotations

from typing import NamedTuple


class Connection(NamedTuple):
    """What kind of messages were sent to a topic; that of one publisher."""

    topic: str
    type: str
    md5sum: str
    definition: str


class Message(NamedTuple):
    """A message; ``time`` is that of its recording, in ns."""

    connection: Connection
    time: int
    data: bytes


def rosbags_type(kind: str) -> str:
    """Returns a type's name as rosbags has it, after ROS 2: ``std_msgs/msg/String``."""
    return kind.replace("/", "/msg/")
