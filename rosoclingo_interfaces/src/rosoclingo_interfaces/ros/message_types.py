"""Message types: the type of a topic, the fields of a type, and messages of plain fields."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Dict, Mapping, Optional

import genpy
import rosgraph
import rospy
from roslib.message import get_message_class, get_service_class

from rosoclingo_interfaces.adapters.field_template import Now
from rosoclingo_interfaces.errors import ActionError

_ANY = "*"  # the type that a subscriber of any messages has


def message_class(kind: str) -> Optional[Any]:
    """Returns the Python class of a type such as ``std_msgs/Bool``; None if there is none."""
    try:
        found = get_message_class(kind)
    except (ValueError, ImportError, AttributeError):
        return None
    return found if isinstance(found, type) and issubclass(found, genpy.Message) else None


def service_class(kind: str) -> Optional[Any]:
    """Returns the Python class of a service such as ``std_srvs/Trigger``; None if there is none."""
    try:
        found = get_service_class(kind)
    except (ValueError, ImportError, AttributeError):
        return None
    return found if hasattr(found, "_request_class") else None


def _any_class(kind: str) -> Optional[Any]:
    """Returns the class of a message, or of the request or the response of a service."""
    for end, name in (("Request", "_request_class"), ("Response", "_response_class")):
        service = service_class(kind[: -len(end)]) if kind.endswith(end) else None
        if service is not None:
            return getattr(service, name)
    return message_class("std_msgs/Header" if kind == "Header" else kind)


@lru_cache(maxsize=None)
def slots(kind: str) -> Optional[Mapping[str, str]]:
    """Returns the fields of a type with their types, such as ``float64[36]``; None if it has none.

    Thread-safe.
    """
    cls = _any_class(kind)
    return None if cls is None else dict(zip(cls.__slots__, cls._slot_types))


def topic_types() -> Dict[str, str]:
    """Returns the type of each topic that the master knows, by its resolved name."""
    try:
        found = rosgraph.Master(rospy.get_name()).getTopicTypes()
    except (OSError, rosgraph.MasterException):
        return {}  # it will answer later
    return {name: kind for name, kind in found if kind != _ANY}


def build(kind: str, fields: Any) -> Any:
    """Returns a message of a type.

    Args:
        kind: The type; a request of a service may be one, too.
        fields: As a template makes them: a mapping of fields, which may be left out.

    Raises:
        ActionError: A value cannot be sent.
    """
    message = _build(kind, fields)
    try:
        message._check_types()
    except genpy.SerializationError as err:
        raise ActionError(f"{kind} cannot be sent: {err}") from err
    return message


def _build(kind: str, value: Any) -> Any:
    if isinstance(value, Now):
        return rospy.get_rostime()
    if isinstance(value, list):
        return [_build(kind[: kind.rindex("[")], one) for one in value]
    if kind in ("time", "duration"):
        return (genpy.Time if kind == "time" else genpy.Duration).from_sec(value)
    if not isinstance(value, dict):
        return value
    cls = _any_class(kind)
    if cls is None:
        raise ActionError(f"there is no type {kind} here")
    message = cls()
    kinds = slots(kind) or {}
    for name, one in value.items():
        setattr(message, name, _build(kinds[name], one))
    return message
