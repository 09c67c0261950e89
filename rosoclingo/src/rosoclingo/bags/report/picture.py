"""The report as a picture, and a plan by seconds. Needs matplotlib, and no ROS."""

from __future__ import annotations

from pathlib import Path
from statistics import median
from typing import Any, Dict, List, Optional, Sequence

from matplotlib.artist import Artist
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import MaxNLocator

from rosoclingo.bags.report.rows import (
    COLOURS,
    LEGEND,
    MOST_LABELS,
    Bar,
    Chart,
    Lane,
    charts,
    rows,
)
from rosoclingo.bags.report.run import GoalRun, Statistics
from rosoclingo.drawing.canvas import cut, plain, save

_WIDTH, _LEAST_HEIGHT, _MOST_WIDTH = 14.0, 8.4, 60.0  # inches
_CHARTS, _ROW = 4.6, 0.33  # inches: the height of all but the time line, and of a row of it
_LETTER = 0.066  # inches: the width of one on a bar, on average
_LEAST_LETTERS = 3  # of a name that is cut: fewer say nothing
_LONGEST_NAME, _LONGEST_TITLE = 30, 150  # letters
_MOST_COLUMNS = 400  # of a chart; each shows the largest value of its steps
_THICK = 11.0  # bars and marks, in points
_LEAST = 1 / 700  # of the time: a mark, so that it can be seen
_MARGIN = 0.01  # of the time, behind what is planned
_BELOW = 0.1  # the legend, as a part of the height of the axes
_LEGEND = 0.5  # inches, for that of a plan
_MARK = {"linestyle": "none", "color": "#1d2733", "zorder": 3}
_DUE: Dict[str, Any] = {**_MARK, "marker": "|", "markersize": 16, "markeredgewidth": 2.5}
_EXPECTED: Dict[str, Any] = {**_MARK, "marker": "D", "markersize": 5}


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
    drawn = rows(statistics)
    height = max(_LEAST_HEIGHT, _CHARTS + len(drawn) * _ROW)
    figure = Figure(figsize=(_WIDTH, height), layout="constrained")
    axes: Dict[str, Any] = figure.subplot_mosaic(
        [["time"] * 3, ["0", "1", "2"]],
        gridspec_kw={"height_ratios": [height - _CHARTS, _CHARTS / 2]},
    )
    figure.suptitle(plain(cut(title, _LONGEST_TITLE)))
    _draw_time_line(axes["time"], statistics, drawn)
    for number, chart in enumerate(charts(statistics)):
        _draw_chart(axes[str(number)], chart)
    save(figure, file)


def draw_gantt(run: Statistics, title: str, file: Path) -> None:
    """Draws goals and actions over the seconds, with what is planned: a Gantt chart.

    Args:
        run: What happened, and what is planned.
        title: What stands above.
        file: Where to write it, see :func:`.canvas.save`.

    Raises:
        OSError: The file cannot be written.
        ValueError: There are no pictures of this ending.
    """
    drawn = [
        row._replace(bars=[bar for bar in row.bars if bar.ended > bar.began or row.kind == "goals"])
        for row in rows(run)
        if row.kind in ("goals", "actions")
    ]
    actions = [one for one in (*run.actions, *run.planned) if one.ended is not None]
    lengths = [one.ended - one.began for one in actions if one.ended is not None]
    longest = max((len(one.name) for one in actions), default=0) + 2
    lasts = median(lengths) if lengths else 0.0
    room = longest * _LETTER * (run.until - run.began) / lasts if lasts else _WIDTH
    height = len(drawn) * _ROW
    figure = Figure(figsize=(min(max(_WIDTH, room), _MOST_WIDTH), height + 2), layout="constrained")
    figure.suptitle(plain(cut(title, _LONGEST_TITLE)))
    _draw_time_line(figure.subplots(), run, drawn, _LEGEND / height)
    save(figure, file)


def _draw_time_line(
    axes: Any, run: Statistics, drawn: Sequence[Lane], below: float = _BELOW
) -> None:
    margin = _MARGIN * (run.until - run.began) if run.until > run.ended else 0.0
    draw_rows(axes, drawn, run.began, run.until + margin, "s")
    goals = [row.bars for row in drawn if row.kind == "goals"]
    waiting = [
        Lane("", "", [bar._replace(ended=_accepted(run, bar)) for bar in bars]) for bars in goals
    ]
    _draw_bars(axes, waiting, "#ffffff90")
    _draw_deadlines(axes, run, goals)
    for number, bars in enumerate(goals if len(run.goals) <= MOST_LABELS else ()):
        for bar, following in zip(bars, [*bars[1:], None]):
            end = None if following is None else following.began
            label(axes, _goal_label(run.goals[bar.number]), bar.began, number, end)
    actions = (*run.actions, *run.planned)
    for number, row in enumerate(drawn):
        for bar in row.bars if row.kind == "actions" else ():
            label(axes, actions[bar.number].name, bar.began, number, bar.ended)
    for restart in run.restarts:
        axes.axvline(restart.seconds, color=COLOURS["restart"], linewidth=1.2)
    used = {bar.colour for row in drawn for bar in row.bars}
    used |= {"late"} if any(goal.late for goal in run.goals) else set()
    handles = [
        Patch(color=COLOURS[name], label=f"{kind}: {word}")
        for kind, words in LEGEND.items() for name, word in words.items() if name in used
    ]  # fmt: skip
    handles += _marks_of(run)
    _draw_legend(axes, handles, below)


def _draw_deadlines(axes: Any, run: Statistics, goals: Sequence[Sequence[Bar]]) -> None:
    """Marks when goals are due and expected, and what is too late."""
    late = [
        [bar._replace(began=bar.ended - run.goals[bar.number].late) for bar in bars]
        for bars in goals
    ]
    _draw_bars(axes, [Lane("", "", bars) for bars in late], COLOURS["late"])
    for number, bars in enumerate(goals):
        for goal in (run.goals[bar.number] for bar in bars):
            if goal.due is not None:
                axes.plot([goal.due], [number], **_DUE)
            if goal.expected is not None:
                axes.plot([goal.expected], [number], **_EXPECTED)


def _goal_label(goal: GoalRun) -> str:
    """Returns a goal's name, with how late it is, or else its deadline."""
    if goal.due is None:
        return goal.name
    late = round(goal.late)
    return f"{goal.name}, {f'{late} s late' if late else f'due at {goal.due:.0f} s'}"


def _marks_of(run: Statistics) -> List[Line2D]:
    marks = []
    if any(goal.due is not None for goal in run.goals):
        marks.append(Line2D([], [], label="goals: deadline", **_DUE))
    if any(goal.expected is not None for goal in run.goals):
        marks.append(Line2D([], [], label="goals: expected", **_EXPECTED))
    return marks


def _draw_legend(axes: Any, handles: Sequence[Artist], below: float) -> None:
    """Draws the legend below the axes, in as many columns as the picture is wide enough for."""
    for columns in range(len(handles), 0, -1):
        legend = axes.legend(
            handles=handles, loc="upper center", bbox_to_anchor=(0.5, -below), ncol=columns,
            frameon=False,
        )  # fmt: skip
        if legend.get_window_extent().width < axes.get_window_extent().width:
            return


def _accepted(run: Statistics, bar: Bar) -> float:
    accepted = run.goals[bar.number].accepted
    return bar.ended if accepted is None else accepted


def draw_rows(axes: Any, drawn: Sequence[Lane], began: float, ended: float, unit: str) -> None:
    """Draws rows of bars, one below the other, over the time.

    Args:
        axes: Where to draw them.
        drawn: The rows.
        began: Where the time begins.
        ended: Where it ends.
        unit: That of the time.
    """
    axes.set_xlim(began, max(ended, began + 0.1))
    _draw_bars(axes, drawn)
    names = [plain(cut(row.name, _LONGEST_NAME)) for row in drawn]
    axes.set_yticks(range(len(drawn)), names)
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(len(drawn) - 0.4, -0.6)
    axes.set_xlabel(unit)
    axes.grid(axis="x", alpha=0.3)
    axes.set_axisbelow(True)


def _draw_bars(axes: Any, drawn: Sequence[Lane], colour: str = "") -> None:
    left, right = axes.get_xlim()
    least = 0.0 if colour else (right - left) * _LEAST
    gap = least / 2  # so that two in a row are told apart
    for number, row in enumerate(drawn):
        axes.add_collection(
            LineCollection(
                [((a, number), (max(b - gap, a + least), number)) for _, a, b, _ in row.bars],
                colors=colour or [COLOURS.get(bar.colour, COLOURS["none"]) for bar in row.bars],
                linewidths=_THICK,
                capstyle="butt",
                snap=False,  # of many that are close, none is to vanish
            ),
            autolim=False,
        )


def label(axes: Any, text: str, begin: float, row: int, end: Optional[float] = None) -> None:
    """Writes a text on a bar, as much of it as there is room for.

    Args:
        axes: Where.
        text: The text.
        begin: Where the bar begins.
        row: The number of its row.
        end: Where it has to end, so that it does not reach into the next one.
    """
    if end is not None:
        left, right = axes.get_xlim()
        inches = axes.figure.get_figwidth() * axes.get_position().width
        letters = int((end - begin) / (right - left) * inches / _LETTER) - 1
        if letters < min(len(text), _LEAST_LETTERS):
            return
        text = cut(text, letters)
    written = axes.annotate(
        plain(text), (begin, row), (4, 0), textcoords="offset points",
        va="center", size=8, clip_on=True,
    )  # fmt: skip
    if end is not None:  # wide letters may need more room
        room = Rectangle((begin, row - 0.5), end - begin, 1, transform=axes.transData)
        written.set_clip_path(room)


def _draw_chart(axes: Any, chart: Chart) -> None:
    steps = len(chart.series[0][2])
    every = 1 + steps // _MOST_COLUMNS
    edges = [number - 0.5 for number in range(0, steps + every, every)]
    for name, colour, values in chart.series if steps else ():
        largest = [max(values[i : i + every]) for i in range(0, steps, every)]
        axes.stairs(
            largest, edges, fill=chart.is_stacked, color=COLOURS[colour], label=name,
            linewidth=0.7 if chart.is_stacked else 1.6, baseline=0 if chart.is_stacked else None,
        )  # fmt: skip
    axes.set_title(chart.title, size=10, loc="left")
    axes.set_xlabel("steps since the start")
    axes.grid(axis="y", alpha=0.3)
    axes.set_axisbelow(True)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylim(bottom=0)
    if steps:
        axes.legend(  # above, where it hides nothing
            frameon=False, fontsize=8, ncol=2, loc="lower right", bbox_to_anchor=(1.0, 1.0),
            borderpad=0.0, borderaxespad=0.2, columnspacing=1.0,
        )  # fmt: skip
