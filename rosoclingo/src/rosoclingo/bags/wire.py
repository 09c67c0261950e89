"""Serialised messages and their connections, as a bag has them. Needs no ROS."""

from __future__ import annotations

from typing import NamedTuple


class PublisherConnection(NamedTuple):
    """The connection of one publisher to a topic: the fields of ROS's connection header.

    Attributes:
        topic: Resolved name of the topic.
        type: Type of the messages, such as ``std_msgs/String``.
        md5sum: MD5 sum of the type.
        definition: The type's definition with those that it uses.
        caller: Name of the node that sends, where that matters.
        latching: Whether late subscribers get the last message, where that matters.
    """

    topic: str
    type: str
    md5sum: str
    definition: str
    caller: str = ""
    latching: bool = False


class Message(NamedTuple):
    """A serialised message; ``time`` is that of its recording, in ns since 1970."""

    connection: PublisherConnection
    time: int
    data: bytes


def rosbags_type(kind: str) -> str:
    """Returns a type's name as rosbags has it, after ROS 2: ``std_msgs/msg/String``."""
    return kind.replace("/", "/msg/")
