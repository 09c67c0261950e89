"""The map of a system as shapes: ways, robots, packages, the plan ahead. The shapes of rviz."""

from __future__ import annotations

import contextlib
from collections import defaultdict, deque
from typing import Any, DefaultDict, Deque, Dict, List, Optional, Sequence

from rosclingo.errors import TermError
from rosclingo.wire.term_text import split_term
from rosoclingo.drawing.shapes import Shape, draw
from rosoclingo.drawing.situation import MapSituation
from rosoclingo.encodings.graph import Graph
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Status
from rosoclingo.loop.words import INFO
from rosoclingo_console.model.board import Row

_MOST_KEPT = 2000  # events, until the map is there
_DIGITS = 2  # of metres
_REQUEST = "bring"
_NEWS = ("blocked", "unblocked", "at")


class MapTable:
    """Table of what the map shows; empty until there is a map. Not thread-safe."""

    def __init__(self) -> None:
        self._graph: Optional[Graph] = None
        self._situation: Optional[MapSituation] = None
        self._kept: Deque[journal.Event] = deque(maxlen=_MOST_KEPT)
        self._plan: Sequence[str] = ()
        self._rows: Optional[Dict[str, Row]] = {}  # None if they have to be made again

    def set_graph(self, graph: Optional[Graph]) -> None:
        """The map is known; None if there is none."""
        self._graph = graph
        self._situation = None if graph is None else MapSituation(graph)
        kept, self._kept = list(self._kept), deque(maxlen=_MOST_KEPT)
        for event in kept:
            self.hear(event)
        self.set_plan(self._plan)
        self._rows = None  # also where the plan is none that can be drawn

    def forget_run(self) -> None:
        """Another run begins, maybe with another map."""
        self._graph = self._situation = None
        self._kept.clear()
        self._rows = {}

    def set_plan(self, atoms: Sequence[str]) -> None:
        """The plan ahead has changed."""
        self._plan = [atom for atom in atoms if atom.startswith("do(")]
        if self._situation is not None:
            with contextlib.suppress(TermError):
                self._situation.set_plan(self._plan)
                self._rows = None

    def hear(self, event: journal.Event) -> None:
        """Takes an event of the journal; keeps it until there is a map."""
        if not _is_shown(event):
            return
        if self._situation is None:
            self._kept.append(event)
            return
        with contextlib.suppress(TermError):  # the loop has dropped or rejected it, too
            _follow(self._situation, event)
            self._rows = None

    def rows(self) -> Dict[str, Row]:
        """Returns the shapes of each group; nothing without a map."""
        if self._rows is None:
            self._rows = self._draw()
        return self._rows

    def _draw(self) -> Dict[str, Row]:
        if self._graph is None or self._situation is None:
            return {}
        groups: DefaultDict[str, List[Any]] = defaultdict(list)
        for shape in draw(self._graph, self._situation):
            at = (0.0, 0.0)
            if shape.robot:
                place = self._situation.positions.get(shape.robot, "")
                if place not in self._graph.places:
                    continue
                at = self._graph.places[place]
            groups[shape.group].append(_plain(shape, *at))
        return {group: {"shapes": shapes} for group, shapes in groups.items()}


def _is_shown(event: journal.Event) -> bool:
    """Tells if an event may change the map.

    clingo keeps each term for as long as the process lives, so it does not get to see those of
    strangers that change nothing here.
    """
    if isinstance(event, journal.GoalArrived):
        return split_term(event.request)[0] == _REQUEST
    if isinstance(event, journal.StatusSet):
        return event.status.is_terminal
    if isinstance(event, journal.MessageArrived):
        return event.source != INFO or split_term(event.value)[0] in _NEWS
    return isinstance(event, journal.ActionPublished)


def _follow(situation: MapSituation, event: journal.Event) -> None:
    """Has the situation take an event that is shown."""
    if isinstance(event, journal.GoalArrived):
        situation.begin_goal(event.goal, event.request)
    elif isinstance(event, journal.StatusSet):
        situation.end_goal(event.goal, event.status is Status.SUCCEEDED)
    elif isinstance(event, journal.ActionPublished):
        situation.begin_action(event.actuator, event.action)
    elif isinstance(event, journal.MessageArrived) and (
        event.source == INFO or event.source in situation.positions
    ):
        situation.hear(event.source, event.value)


def _plain(shape: Shape, x: float, y: float) -> Dict[str, Any]:
    """Returns a shape as JSON has it, in the frame of the map."""
    return {
        "kind": shape.kind,
        "points": [
            [round(point[0] + x, _DIGITS), round(point[1] + y, _DIGITS)] for point in shape.points
        ],
        "size": shape.size,
        "colour": "#" + "".join(f"{round(255 * part):02x}" for part in shape.colour),
        "text": shape.text,
        "robot": shape.robot,
    }
