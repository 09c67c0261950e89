"""Draws shapes as a picture, and sets up all pictures. Needs matplotlib, and no ROS."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Sequence

from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from rosoclingo.drawing.shapes import Shape

_DOTS_PER_INCH = 100
_WIDTH = 14.0  # inches
_POINTS = 72.0  # in an inch
_MARGIN = 3.0  # around the shapes, in metres


def save(figure: Figure, file: Path) -> None:
    """Writes a picture.

    Args:
        figure: The picture.
        file: Where to write it; the ending says as what, such as ``.png`` or ``.svg``.

    Raises:
        OSError: The file cannot be written.
        ValueError: There are no pictures of this ending.
    """
    figure.savefig(file, dpi=_DOTS_PER_INCH, format=file.suffix[1:] or "png")


def plain(text: str) -> str:
    """Keeps matplotlib from reading a text as a formula."""
    return text.replace("$", r"\$")


def cut(text: str, letters: int) -> str:
    """Truncates a text to so many letters, the last of which is an ellipsis."""
    return text if len(text) <= letters else f"{text[: letters - 1]}…"


def draw_shapes(shapes: Sequence[Shape], title: str, file: Path) -> None:
    """Draws shapes as seen from above; there is one at least.

    Args:
        shapes: Their points are in the map's frame.
        title: What stands above.
        file: Where to write it, see :func:`save`.

    Raises:
        OSError: The file cannot be written.
        ValueError: There are no pictures of this ending.
    """
    points = [point for shape in shapes for point in shape.points]
    low = [min(point[axis] for point in points) - _MARGIN for axis in (0, 1)]
    high = [max(point[axis] for point in points) + _MARGIN for axis in (0, 1)]
    width, height = high[0] - low[0], high[1] - low[1]
    figure = Figure(figsize=(_WIDTH, _WIDTH * height / width + 0.5))
    axes = figure.add_axes((0.0, 0.0, 1.0, _WIDTH * height / width / figure.get_figheight()))
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.axis("off")
    for shape in shapes:
        _draw(axes, shape, _WIDTH * _POINTS / width)
    figure.suptitle(plain(title), y=0.99, va="top")
    save(figure, file)


def _draw(axes: Any, shape: Shape, scale: float) -> None:
    """Draws a shape.

    Args:
        axes: Where.
        shape: Which.
        scale: How many points there are in a metre.
    """
    places = [(x, y) for x, y, _ in shape.points]
    size, height = shape.size * scale, min(z for _, _, z in shape.points)
    style = {"color": shape.colour, "zorder": 10 + height}  # what is higher hides what is below
    if shape.kind == "lines":
        lines = list(zip(places[::2], places[1::2]))
        axes.add_collection(LineCollection(lines, linewidths=size, zorder=10 + height,
                                           colors=[shape.colour]))  # fmt: skip
    elif shape.kind == "arrow":
        axes.annotate("", places[1], places[0], arrowprops={
            "color": shape.colour, "width": size / 2, "headwidth": 3 * size,
            "headlength": 4 * size, "shrink": 0.04,
        }, zorder=10 + height)  # fmt: skip
    elif shape.kind == "text":
        axes.text(*places[0], plain(shape.text), size=size, ha="center", va="center", **style)
    else:
        marker = {"dots": "o", "cylinder": "o", "box": "s"}[shape.kind]
        xs, ys = zip(*places)
        axes.scatter(xs, ys, s=size**2, marker=marker, **style)
