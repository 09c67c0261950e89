"""The report as a picture. Needs matplotlib, and no ROS."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple

from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import MaxNLocator

from rosoclingo.bags.report.run import GoalRun, Statistics
from rosoclingo.drawing.canvas import plain, save

_INCHES = (14.0, 8.4)
_MOST_LABELS = 40  # bars with a text; more of them would hide each other
_MOST_COLUMNS = 400  # of a chart; each shows the largest value of its steps
THICK, _THIN = 11.0, 5.0  # bars and marks, in points
COLOURS = {
    "succeeded": "#2a9d63", "open": "#2f6feb", "canceled": "#8b95a5", "recalled": "#b3bac6",
    "rejected": "#c77d0a", "aborted": "#d23f3f", "success": "#4c8fd6", "failure": "#d23f3f",
    "": "#a4adba", "message": "#7a4fc4", "dropped": "#d23f3f", "change": "#2f6feb",
    "restart": "#b5177b", "sat": "#2a9d63", "unsat": "#93a1b5", "unknown": "#e08a1e",
}  # fmt: skip
_OTHER = "#d39a1e"  # of answers that are neither success nor failure
_SEARCHING, _COMMANDS = "#2f6feb", "#b3bac6"

Bar = Tuple[float, float, str]
"""From, to, colour."""
Row = Tuple[str, List[Bar], float]
"""Name, bars, and their width in points."""


def draw(statistics: Statistics, title: str, file: Path) -> None:
    """Draws the time line and the charts over the steps.

    Args:
        statistics: What happened.
        title: What stands above.
        file: Where to write it, see :func:`.canvas.save`.

    Raises:
        OSError: The file cannot be written.
        ValueError: There are no pictures of this ending.
    """
    figure = Figure(figsize=_INCHES, layout="constrained")
    axes: Dict[str, Any] = figure.subplot_mosaic(
        [["time"] * 3, ["horizon", "solving", "searches"]], gridspec_kw={"height_ratios": [1.7, 1]}
    )
    figure.suptitle(plain(title))
    _draw_time_line(axes["time"], statistics)
    _draw_steps(axes, statistics)
    save(figure, file)


def _draw_time_line(axes: Any, run: Statistics) -> None:
    is_labelled = len(run.goals) <= _MOST_LABELS
    goals = _placed(run.goals, run.ended, (run.ended - run.began) / (12 if is_labelled else 700))
    draw_rows(axes, _rows(run, goals), run.began, run.ended, "s")
    if is_labelled:
        next_one: Dict[int, float] = {}
        for goal, number in reversed(goals):
            label(axes, goal.name, goal.came, number, next_one.get(number))
            next_one[number] = goal.came
    for restart in run.restarts:
        axes.axvline(restart.seconds, color=COLOURS["restart"], linewidth=1.2)
    outcomes = sorted({goal.outcome for goal in run.goals})
    handles = [Patch(color=COLOURS.get(word, _OTHER), label=word) for word in outcomes]
    handles += [
        Patch(color=COLOURS["success"], label="action"),
        Patch(color=COLOURS["failure"], label="failed or dropped"),
        Patch(color=COLOURS["message"], label="message"),
    ]
    if run.restarts:
        handles.append(Patch(color=COLOURS["restart"], label="a node goes on after it had died"))
    axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.1),
                ncol=len(handles), frameon=False)  # fmt: skip


def draw_rows(axes: Any, rows: Sequence[Row], began: float, ended: float, unit: str) -> None:
    """Draws rows of bars, one below the other, over the time.

    Args:
        axes: Where to draw them.
        rows: The rows.
        began: Where the time begins.
        ended: Where it ends.
        unit: That of the time.
    """
    for number, (_, bars, points) in enumerate(rows):
        axes.add_collection(
            LineCollection(
                [((a, number), (b, number)) for a, b, _ in bars],
                colors=[colour for _, _, colour in bars],
                linewidths=points,
                capstyle="butt",
                snap=False,  # of many that are close, none is to vanish
            )
        )
    axes.set_yticks(range(len(rows)), [plain(name) for name, _, _ in rows])
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_xlim(began, max(ended, began + 0.1))
    axes.set_xlabel(unit)
    axes.grid(axis="x", alpha=0.3)
    axes.set_axisbelow(True)


def label(axes: Any, text: str, begin: float, row: int, end: Optional[float] = None) -> None:
    """Writes a text on a bar.

    Args:
        axes: Where.
        text: The text.
        begin: Where the bar begins.
        row: The number of its row.
        end: Where it is cut off, so that it does not reach into the next one.
    """
    written = axes.annotate(
        plain(text), (begin, row), (4, 0), textcoords="offset points",
        va="center", size=8, clip_on=True,
    )  # fmt: skip
    if end is not None:
        room = Rectangle((begin, row - 0.5), end - begin, 1, transform=axes.transData)
        written.set_clip_path(room)


def _rows(run: Statistics, goals: Sequence[Tuple[GoalRun, int]]) -> List[Row]:
    """Returns the rows of the time line."""
    least = (run.ended - run.began) / 700  # of a mark, so that it can be seen
    by_row: Dict[int, List[Bar]] = {}
    for goal, number in goals:
        ended = max(run.ended if goal.ended is None else goal.ended, goal.came + least)
        accepted = ended if goal.accepted is None else goal.accepted
        colour = COLOURS.get(goal.outcome, _OTHER)
        by_row.setdefault(number, []).extend(
            [(goal.came, accepted, f"{colour}70"), (accepted, ended, colour)]
        )
    rows = [("" if number else "goals", bars, THICK) for number, bars in by_row.items()]
    for actuator in dict.fromkeys(action.actuator for action in run.actions):
        bars = [
            (
                action.began,
                run.ended if action.ended is None else action.ended,
                COLOURS.get(action.answer, _OTHER),
            )
            for action in run.actions
            if action.actuator == actuator
        ]
        rows.append((actuator, bars, THICK))
    marks = [
        (message.seconds, message.seconds + least,
         COLOURS["dropped" if message.dropped else "message"])
        for message in run.messages
    ]  # fmt: skip
    changes = [
        (change.seconds, change.seconds + least,
         COLOURS.get(change.causes[0].kind, COLOURS["change"]))
        for change in run.changes
    ]  # fmt: skip
    searches = [
        (search.ended - search.duration, max(search.ended, search.ended - search.duration + least),
         COLOURS.get(search.result, _OTHER))
        for search in run.searches
    ]  # fmt: skip
    rows += [("messages", marks, THICK), ("plan changes", changes, THICK)]
    rows.append(("searches", searches, _THIN))
    restarts = [
        (restart.seconds, restart.seconds + least, COLOURS["restart"]) for restart in run.restarts
    ]
    return [*rows, ("restarts", restarts, THICK)] if restarts else rows


def _placed(goals: Sequence[GoalRun], end: float, least: float) -> List[Tuple[GoalRun, int]]:
    """Returns the goals with a row for each, in which no other overlaps.

    Args:
        goals: The goals.
        end: When the run ended.
        least: How long the place of a goal is at least, in seconds.
    """
    ends: List[float] = []
    placed = []
    for goal in goals:
        number = next((n for n, ended in enumerate(ends) if ended < goal.came), len(ends))
        if number == len(ends):
            ends.append(0.0)
        ends[number] = max(end if goal.ended is None else goal.ended, goal.came + least)
        placed.append((goal, number))
    return placed


def _draw_steps(axes: Dict[str, Any], run: Statistics) -> None:
    titles = {
        "horizon": "horizon and current step",
        "solving": "time for a step, in ms",
        "searches": "searches in a step",
    }
    solving = [1000 * step.solving for step in run.steps]
    both = [1000 * (step.solving + step.other) for step in run.steps]
    ended = [step.searches - step.interrupted for step in run.steps]
    every = 1 + len(run.steps) // _MOST_COLUMNS
    edges = [number - 0.5 for number in range(0, len(run.steps) + every, every)]
    # What is above is drawn first, and covered by what is below it.
    parts: Dict[str, List[Tuple[Sequence[float], str, str]]] = {
        "horizon": [
            ([step.horizon for step in run.steps], "horizon", _SEARCHING),
            ([step.number for step in run.steps], "current step", "#8b95a5"),
        ],
        "solving": [(both, "other commands", _COMMANDS), (solving, "searching", _SEARCHING)],
        "searches": [
            ([step.searches for step in run.steps], "interrupted", COLOURS["unknown"]),
            (ended, "ended", _SEARCHING),
        ],
    }
    for name, title in titles.items():
        for values, label, colour in parts[name] if run.steps else ():
            is_line = name == "horizon"
            largest = [max(values[i : i + every]) for i in range(0, len(values), every)]
            axes[name].stairs(
                largest, edges, fill=not is_line, color=colour, label=label,
                linewidth=1.6 if is_line else 0.7, baseline=None if is_line else 0,
            )  # fmt: skip
        axes[name].set_title(title, size=10)
        axes[name].set_xlabel("steps since the start")
        axes[name].grid(axis="y", alpha=0.3)
        axes[name].set_axisbelow(True)
        axes[name].xaxis.set_major_locator(MaxNLocator(integer=True))
        axes[name].yaxis.set_major_locator(MaxNLocator(integer=True))
        axes[name].set_ylim(bottom=0)
        if run.steps:
            axes[name].legend(frameon=False, fontsize=8)
