"""Converts shapes and files to messages for rviz."""

from __future__ import annotations

import io
import struct
from pathlib import Path
from typing import Callable, Dict, Iterable, List

import genpy
import yaml
from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from rosclingo import strict_yaml
from rosclingo.errors import RosclingoError
from rosoclingo.drawing.shapes import Shape

_TYPES: Dict[str, int] = {
    "lines": Marker.LINE_LIST,
    "dots": Marker.SPHERE_LIST,
    "arrow": Marker.ARROW,
    "box": Marker.CUBE,
    "cylinder": Marker.CYLINDER,
    "text": Marker.TEXT_VIEW_FACING,
}
_LISTS = ("lines", "dots", "arrow")  # whose points are in the marker's points


class MarkerFileError(RosclingoError):
    """A file that is no visualization_msgs/MarkerArray; the message names it and the remedy."""


def read_markers(file: str) -> List[Marker]:
    """Reads a visualization_msgs/MarkerArray in YAML, such as ``config/office_markers.yaml``.

    Raises:
        MarkerFileError: The file cannot be read, or is something else.
    """
    message = MarkerArray()
    try:
        content = strict_yaml.load(Path(file).read_text(encoding="utf-8"))
        genpy.message.fill_message_args(message, [content])
        for marker in message.markers:
            marker._check_types()  # that numbers are numbers
        message.serialize(io.BytesIO())  # and that there is room for them
    except (OSError, UnicodeDecodeError) as err:
        raise MarkerFileError(f"cannot read {file}: {err}; check the path") from err
    except (
        yaml.YAMLError, ValueError, TypeError, OverflowError, struct.error, genpy.MessageException,
    ) as err:  # fmt: skip
        raise MarkerFileError(f"{file} is no visualization_msgs/MarkerArray: {err}") from err
    return list(message.markers)


def marker_array(
    shapes: Iterable[Shape], background: List[Marker], frame: str, frame_of: Callable[[str], str]
) -> MarkerArray:
    """Returns a message that replaces all of the markers before it.

    Args:
        shapes: What to draw.
        background: Markers to show as well.
        frame: The frame of the map.
        frame_of: Returns the frame of a robot.
    """
    numbers: Dict[str, int] = {}
    markers = [Marker(action=Marker.DELETEALL), *background]
    for shape in shapes:
        number = numbers[shape.group] = numbers.get(shape.group, -1) + 1
        marker = _marker(shape)
        marker.id = number
        marker.header.frame_id = frame_of(shape.robot) if shape.robot else frame
        marker.frame_locked = bool(shape.robot)  # it moves along
        markers.append(marker)
    return MarkerArray(markers)


def _marker(shape: Shape) -> Marker:
    marker = Marker(ns=shape.group, type=_TYPES[shape.kind], text=shape.text)
    marker.color = ColorRGBA(*shape.colour, 1.0)
    points = [Point(*point) for point in shape.points]
    marker.pose.orientation.w = 1.0
    if shape.kind in _LISTS:
        marker.points = points
    else:
        marker.pose.position = points[0]
    size = shape.size
    if shape.kind == "arrow":
        marker.scale = Vector3(size, 3 * size, 4 * size)  # shaft's and head's width, head's length
    else:
        marker.scale = Vector3(size, size, shape.height or size)
    return marker
