"""Draws drives on the map. Needs no ROS."""

from __future__ import annotations

from pathlib import Path
from typing import Any, List, Mapping, Sequence, Tuple

import matplotlib as mpl
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from rosoclingo_gazebo.demo.labels import LabelBox, place
from rosoclingo_gazebo.demo.trace import DriveEvent, DriveEventKind, DriveTrace, TracePoint
from rosoclingo_simulator.physics.occupancy import FREE, OccupancyMap

_INCHES = (12.0, 7.6)
_DOTS_PER_INCH = 110
_MARK_POINTS = 130  # the area of a mark, in square points
_LABEL_POINTS = 8.5  # the size of a label's letters
_PAD_POINTS = 2.0  # around a label
_FAR_POINTS = 16.0  # from here on a line joins a label and its mark
_EVERY = 5  # of the path's points, one in so many is enough
_SHIFT_METRES = 0.12  # of the path to its right, so that both directions of a way are seen
_MARKS = {  # the first is below the others
    DriveEventKind.KILL: ("v", "tab:orange", "a node is killed"),
    DriveEventKind.OBSTACLE: ("s", "black", "obstacle"),
    DriveEventKind.REQUEST: ("o", "tab:purple", "a request comes"),
    DriveEventKind.PICKUP: ("^", "tab:blue", "pickup"),
    DriveEventKind.DELIVERY: ("*", "tab:green", "delivery"),
    DriveEventKind.FAILURE: ("X", "tab:red", "a drive fails"),
    DriveEventKind.CARRIED: ("D", "tab:orange", "somebody carries it"),
    DriveEventKind.SIGHT: ("P", "tab:cyan", "it looks around"),
}


def draw(
    floor: OccupancyMap,
    waypoints: Mapping[str, TracePoint],
    traces: Mapping[str, DriveTrace],
    title: str,
    file: Path,
) -> List[Path]:
    """Draws drives: one by its time, several in the colours of the robots.

    Args:
        floor: The map.
        waypoints: The waypoints, in metres.
        traces: The drives, by the robots' names.
        title: What stands above.
        file: Where to write it, without the endings ``.png`` and ``.svg``; the folder is made if
            it is not there.

    Returns:
        The files.

    Raises:
        OSError: A file cannot be written.
    """
    figure = Figure(figsize=_INCHES, dpi=_DOTS_PER_INCH, layout="constrained")
    axes = figure.add_subplot()
    grid = floor.grid
    extent = (
        grid.x,
        grid.x + grid.columns * grid.resolution,
        grid.y,
        grid.y + grid.rows * grid.resolution,
    )
    axes.imshow(floor.cells != FREE, cmap="Greys", origin="lower", extent=extent, vmax=1.6)
    names = []
    for name, (x, y) in waypoints.items():
        axes.plot(x, y, ".", color="0.75", markersize=4)
        names.append(
            axes.annotate(
                name,
                (x, y),
                (0, -11),
                textcoords="offset points",
                ha="center",
                color="0.45",
                size=8,
            )
        )
    for number, (name, trace) in enumerate(traces.items()):
        if len(traces) > 1:
            path = _shifted(trace.path[::_EVERY], number)
            axes.plot(*path.T, linewidth=1.4, alpha=0.8, label=name)
            continue
        lines = LineCollection([], cmap="viridis", linewidths=1.8)
        segments, times = _segments(trace)
        lines.set_segments(segments)
        lines.set_array(np.array(times))
        axes.add_collection(lines)
        figure.colorbar(lines, ax=axes, label="simulated time, s", shrink=0.7)
        for before, after in zip(trace.drives, trace.drives[1:]):
            begin, end = trace.path[before][-1], trace.path[after][0]
            arrow = {"arrowstyle": "->", "linestyle": "--", "color": "tab:orange", "lw": 1.4}
            axes.annotate("", end, begin, arrowprops=arrow)
    events = [event for trace in traces.values() for event in trace.events]
    for kind, (mark, colour, label) in _MARKS.items():
        places = [event.place for event in events if event.kind is kind]
        if places:
            xs, ys = zip(*places)
            axes.scatter(
                xs, ys, _MARK_POINTS, colour, marker=mark, zorder=3, edgecolors="white", label=label
            )
    axes.set(title=title, xlabel="x, m", ylabel="y, m", aspect="equal")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.09), ncols=6, frameon=False)
    _label(figure, axes, events, names)
    file.parent.mkdir(parents=True, exist_ok=True)
    files = [file.with_name(file.name + ending) for ending in (".png", ".svg")]
    # The same drive gives the same file.
    with mpl.rc_context({"svg.hashsalt": "rosoclingo"}):
        for each in files:
            figure.savefig(each, dpi=_DOTS_PER_INCH)
    return files


def _segments(trace: DriveTrace) -> Tuple[List[np.ndarray], List[float]]:
    """Returns the lines of a drive, and the time of each since the beginning, in seconds."""
    segments: List[np.ndarray] = []
    times: List[float] = []
    for part in trace.drives:
        points = trace.path[part][::_EVERY]
        if len(points) > 1:
            path = _shifted(points, 0)
            segments += list(np.stack((path[:-1], path[1:]), axis=1))
            times += [time - trace.times[0] for time in trace.times[part][::_EVERY][1:]]
    return segments, times


def _shifted(path: Sequence[TracePoint], number: int) -> np.ndarray:
    """Returns the path moved to its right, that of each further robot by more."""
    points = np.array(path)
    steps = np.gradient(points, axis=0)
    lengths = np.hypot(*steps.T)[:, None]
    directions = np.divide(steps, lengths, out=np.zeros_like(steps), where=lengths > 1e-6)
    return points + (1 + number) * _SHIFT_METRES * np.column_stack(
        (directions[:, 1], -directions[:, 0])
    )


def _label(figure: Any, axes: Any, events: Sequence[DriveEvent], names: Sequence[Any]) -> None:
    """Writes time and event next to each mark."""
    figure.draw_without_rendering()  # before that, positions are unknown
    texts = [f"{event.seconds:.0f} s: {event.text}" for event in events]
    pixels = figure.dpi / 72  # in a point
    sizes = []
    for text in texts:
        measured = axes.text(0, 0, text, size=_LABEL_POINTS)
        extent = measured.get_window_extent()
        measured.remove()
        padding = 2 * _PAD_POINTS * pixels
        sizes.append((extent.width + padding, extent.height + padding))
    marks = [tuple(axes.transData.transform(event.place)) for event in events]
    side = _MARK_POINTS**0.5 * pixels
    seen = [LabelBox.around(mark, (side, side)) for mark in marks]
    seen += [LabelBox(*name.get_window_extent().extents) for name in names]
    centres = place(marks, sizes, seen, LabelBox(*axes.get_window_extent().extents))
    for event, text, (x, y), centre, size in zip(events, texts, marks, centres, sizes):
        dx, dy = (centre[0] - x) / pixels, (centre[1] - y) / pixels
        beyond = max(abs(dx) - size[0] / 2 / pixels, abs(dy) - size[1] / 2 / pixels)
        axes.annotate(
            text,
            event.place,
            (dx, dy),
            textcoords="offset points",
            ha="center",
            va="center",
            size=_LABEL_POINTS,
            zorder=4,
            bbox={"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.8},
            arrowprops={"arrowstyle": "-", "color": "0.5", "linewidth": 0.7, "zorder": 2}
            if beyond > _FAR_POINTS
            else None,
        )
