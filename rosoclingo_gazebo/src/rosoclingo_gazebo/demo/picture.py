"""Draws a drive on the map. Needs no ROS."""

from __future__ import annotations

from pathlib import Path
from typing import List, Mapping, Sequence, Tuple

import matplotlib as mpl
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from rosoclingo_gazebo.demo.trace import Kind, Point, Trace
from rosoclingo_simulator.simulator.occupancy import FREE, OccupancyMap

_INCHES = (12.0, 7.6)
_DOTS_PER_INCH = 110
_EVERY = 5  # of the path's points, one in so many is enough
_SHIFT_METRES = 0.12  # of the path to its right, so that both directions of a way are seen
_MARKS = {
    Kind.OBSTACLE: ("s", "black", "obstacle"),
    Kind.REQUEST: ("o", "tab:purple", "a request comes"),
    Kind.PICKUP: ("^", "tab:blue", "pickup"),
    Kind.DELIVERY: ("*", "tab:green", "delivery"),
    Kind.FAILURE: ("X", "tab:red", "a drive fails"),
}


def draw(
    floor: OccupancyMap,
    waypoints: Mapping[str, Point],
    trace: Trace,
    title: str,
    files: Sequence[Path],
) -> None:
    """Draws a drive.

    Args:
        floor: The map.
        waypoints: The waypoints, in metres.
        trace: The drive.
        title: What stands above.
        files: Where to write it; the ending says as what, such as ``.png`` or ``.svg``.

    Raises:
        OSError: A file cannot be written.
    """
    figure = Figure(figsize=_INCHES, layout="constrained")
    axes = figure.add_subplot()
    grid = floor.grid
    extent = (
        grid.x,
        grid.x + grid.columns * grid.resolution,
        grid.y,
        grid.y + grid.rows * grid.resolution,
    )
    axes.imshow(floor.cells != FREE, cmap="Greys", origin="lower", extent=extent, vmax=1.6)
    for name, (x, y) in waypoints.items():
        axes.plot(x, y, ".", color="0.75", markersize=4)
        axes.annotate(
            name, (x, y), (0, -11), textcoords="offset points", ha="center", color="0.45", size=8
        )
    path = _shifted(trace.path[::_EVERY])
    lines = LineCollection(
        list(np.stack((path[:-1], path[1:]), axis=1)), cmap="viridis", linewidths=1.8
    )
    lines.set_array(np.array(trace.times[::_EVERY][1:]) - trace.times[0])
    axes.add_collection(lines)
    figure.colorbar(lines, ax=axes, label="simulated time, s", shrink=0.7)
    for kind, (mark, colour, label) in _MARKS.items():
        places = [event.place for event in trace.events if event.kind is kind]
        if places:
            xs, ys = zip(*places)
            axes.scatter(
                xs, ys, 130, colour, marker=mark, zorder=3, edgecolors="white", label=label
            )
    for event, above in zip(trace.events, _sides(trace)):
        axes.annotate(
            f"{event.seconds:.0f} s: {event.text}",
            event.place,
            (0, 11 if above else -24),
            textcoords="offset points",
            ha="center",
            size=8.5,
            zorder=4,
            bbox={"boxstyle": "round,pad=0.2", "fc": "white", "ec": "none", "alpha": 0.8},
        )
    axes.set(title=title, xlabel="x, m", ylabel="y, m", aspect="equal")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.09), ncols=5, frameon=False)
    # The same drive gives the same file.
    with mpl.rc_context({"svg.hashsalt": "rosoclingo"}):
        for file in files:
            figure.savefig(file, dpi=_DOTS_PER_INCH)


def _shifted(path: Sequence[Point]) -> np.ndarray:
    """Returns the path moved to its right."""
    points = np.array(path)
    steps = np.gradient(points, axis=0)
    lengths = np.hypot(*steps.T)[:, None]
    directions = np.divide(steps, lengths, out=np.zeros_like(steps), where=lengths > 1e-6)
    return points + _SHIFT_METRES * np.column_stack((directions[:, 1], -directions[:, 0]))


def _sides(trace: Trace) -> List[bool]:
    """Returns for each event whether its text stands above it: those close by take turns."""
    sides: List[bool] = []
    seen: List[Tuple[int, int]] = []
    for event in trace.events:
        around = (round(event.place[0] / 4), round(event.place[1] / 3))
        sides.append(seen.count(around) % 2 == 0)
        seen.append(around)
    return sides
