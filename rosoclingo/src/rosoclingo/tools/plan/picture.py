"""A plan as a picture: by seconds, on the map, or as bars. Needs matplotlib, and no ROS."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import List, Optional, Tuple

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from rosclingo.solver.options import Options
from rosoclingo.bags.model import Recording
from rosoclingo.bags.report import picture
from rosoclingo.bags.report.picture import draw_rows, label
from rosoclingo.bags.report.rows import Bar, Lane
from rosoclingo.bags.report.run import OPEN, Statistics, numbered
from rosoclingo.bags.report.statistics import compute
from rosoclingo.drawing.canvas import draw_shapes, plain, save
from rosoclingo.drawing.shapes import draw
from rosoclingo.drawing.situation import MapSituation
from rosoclingo.encodings.graph import Graph, GraphError, read_graph
from rosoclingo.in_process.simulation import SimulatedSystem
from rosoclingo.loop.journal import MessageArrived
from rosoclingo.tools.plan.outcome import ShownPlan

_WIDTH, _ROW = 14.0, 0.5  # inches
_LETTER, _MOST_WIDTH = 0.07, 60.0  # inches: a letter of a label, and a picture whose labels all fit


def draw_run(simulation: SimulatedSystem, title: str, file: Path) -> None:
    """Draws a simulated run, as ``report.py`` draws a recorded one.

    Args:
        simulation: The run.
        title: What stands above.
        file: Where to write it, see :func:`.canvas.save`.

    Raises:
        OSError: The file cannot be written.
        ValueError: There are no pictures of this ending.
    """
    picture.draw(_statistics(simulation), title, file)


def draw_plan(
    simulation: SimulatedSystem, plan: ShownPlan, options: Options, title: str, file: Path
) -> None:
    """Draws a plan: by seconds if it says how long actions take, else on the map or as bars.

    It is drawn on the map if the instance has one with positions.

    Args:
        simulation: The run that has found the plan.
        plan: The plan.
        options: The files, and options for clingo.
        title: What stands above.
        file: Where to write it, see :func:`.canvas.save`.

    Raises:
        OSError: The file cannot be written.
        ValueError: There are no pictures of this ending.
    """
    statistics = _statistics(simulation)
    if statistics.planned:
        picture.draw_gantt(statistics, title, file)
        return
    graph = _graph(options)
    if graph is None:
        _draw_bars(simulation, plan, title, file)
        return
    situation = MapSituation(graph)
    for goal in simulation.goals:
        situation.begin_goal(goal.id, goal.request)
    for entry in simulation.journal:
        if isinstance(entry.event, MessageArrived):
            situation.hear(entry.event.source, entry.event.value)
    situation.set_plan([str(action) for action in plan.actions])
    standing = [shape for shape in draw(graph, situation) if not shape.robot]
    draw_shapes(standing, title, file)


def _statistics(simulation: SimulatedSystem) -> Statistics:
    """Returns what has happened, and what is planned."""
    times = tuple(simulation.plan_times)
    return compute(Recording("", tuple(simulation.journal), plan_times=times))


def _graph(options: Options) -> Optional[Graph]:
    try:
        return read_graph(options.files, options.clingo, options.theory)
    except GraphError:
        return None


def _draw_bars(simulation: SimulatedSystem, plan: ShownPlan, title: str, file: Path) -> None:
    last = max((action.step for action in plan.actions), default=0)
    rows: List[Lane] = []
    labels: List[Tuple[str, float, int, Optional[float]]] = []
    requests: Counter[str] = Counter()
    for goal in simulation.goals:
        step = plan.succeeds.get(goal.id)
        bar = Bar(0, 0, last, OPEN) if step is None else Bar(0, 0, step, "succeeded")
        requests[goal.request] += 1
        labels.append((numbered(goal.request, requests[goal.request]), 0, len(rows), None))
        rows.append(Lane("" if rows else "goals", "", [bar]))
    for actuator in dict.fromkeys(action.actuator for action in plan.actions):
        own = [action for action in plan.actions if action.actuator == actuator]
        labels += [(action.name, action.step - 1, len(rows), action.step) for action in own]
        bars = [Bar(0, action.step - 1, action.step, "success") for action in own]
        rows.append(Lane(actuator, "", bars))
    longest = max((len(action.name) for action in plan.actions), default=0) + 2
    width = min(max(_WIDTH, last * longest * _LETTER), _MOST_WIDTH)
    figure = Figure(figsize=(width, (len(rows) + 2) * _ROW), layout="constrained")
    figure.suptitle(plain(title))
    axes = figure.subplots()
    draw_rows(axes, rows, 0, last, "steps")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    for one in labels:
        label(axes, *one)
    save(figure, file)
