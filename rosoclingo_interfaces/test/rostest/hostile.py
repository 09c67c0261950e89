"""Draws messages that nobody would send, of any type of ROS's."""

from __future__ import annotations

import math
import random
import re
from typing import Any, Optional

from roslib.message import get_message_class

_REALS = [0.0, -0.0, 1.0, -1.0, 0.5, math.nan, math.inf, -math.inf, 1e-45, 3e38, -3e38]
_WIDE = [1e300, -1e300, 5e-324]
_TEXTS = ["", "map", "/map", "scan", "stop", "ä€\U0001f600", "\0", "x" * 20_000, "a b\nc", "$(x)"]
_ARRAY = re.compile(r"(.*)\[(\d*)\]")
_INTEGER = re.compile(r"(u?)int(\d+)")


def draw(kind: str, dice: random.Random) -> Any:
    """Returns a value of a type, such as ``float64[36]`` or ``sensor_msgs/LaserScan``."""
    array = _ARRAY.fullmatch(kind)
    if array:
        most = 7 if "/" in array[1] else 360
        length = int(array[2]) if array[2] else dice.choice([0, 0, 1, 2, most])
        return [draw(array[1], dice) for _ in range(length)]
    integer = _integer(kind, dice)
    if integer is not None:
        return integer
    if kind in ("float32", "float64"):
        if dice.random() < 0.5:
            return dice.uniform(-10, 10)
        return dice.choice(_REALS + (_WIDE if kind == "float64" else []))
    if kind == "bool":
        return dice.random() < 0.5
    if kind == "string":
        return dice.choice(_TEXTS)
    if kind in ("time", "duration"):
        return get_message_class("std_msgs/Header")().stamp
    message = get_message_class(kind)()
    for name, of in zip(message.__slots__, message._slot_types):
        setattr(message, name, draw(of, dice))
    return message


def _integer(kind: str, dice: random.Random) -> Optional[int]:
    integer = _INTEGER.fullmatch(kind)
    if integer is None:
        return None
    most = 2 ** (int(integer[2]) - (0 if integer[1] else 1)) - 1
    least = 0 if integer[1] else -most - 1
    return dice.choice([0, 1, 7, most, least, dice.randint(least, most)])
