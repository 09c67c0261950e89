"""Message types: the type of a topic, and the fields of a type."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Dict, Mapping, Optional

import rosgraph
import rospy
from roslib.message import get_message_class

_ANY = "*"  # the type that a subscriber of any messages has


def message_class(kind: str) -> Optional[Any]:
    """Returns the Python class of a type such as ``std_msgs/Bool``; None if there is none."""
    try:
        return get_message_class(kind)
    except (ValueError, ImportError, AttributeError):
        return None


@lru_cache(maxsize=None)
def slots(kind: str) -> Optional[Mapping[str, str]]:
    """Returns the fields of a type with their types, such as ``float64[36]``; None if it has none.

    Thread-safe.
    """
    cls = message_class("std_msgs/Header" if kind == "Header" else kind)
    return None if cls is None else dict(zip(cls.__slots__, cls._slot_types))


def topic_types() -> Dict[str, str]:
    """Returns the type of each topic that the master knows, by its resolved name."""
    try:
        found = rosgraph.Master(rospy.get_name()).getTopicTypes()
    except (OSError, rosgraph.MasterException):
        return {}  # it will answer later
    return {name: kind for name, kind in found if kind != _ANY}
