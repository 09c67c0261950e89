"""The map of a system as shapes: ways, robots, packages, the plan ahead. The shapes of rviz."""

from __future__ import annotations

from collections import defaultdict, deque
from typing import Any, Callable, DefaultDict, Deque, Dict, List, Optional, Sequence

from rosclingo.errors import TermError
from rosclingo.wire.term_text import split_term
from rosoclingo.drawing.graph import Graph
from rosoclingo.drawing.shapes import Shape, draw
from rosoclingo.drawing.situation import MapSituation
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Status
from rosoclingo.loop.words import INFO
from rosoclingo_console.model.board import Row

_MOST_KEPT = 2000  # events, until the map is there
_DIGITS = 2  # of metres
_REQUEST = "bring"
_NEWS = ("blocked", "unblocked")

Happening = Callable[[MapSituation], None]
"""An update of the situation on the map, which an event causes."""


class MapTable:
    """Table of what the map shows; empty until there is a map. Not thread-safe."""

    def __init__(self) -> None:
        self._graph: Optional[Graph] = None
        self._situation: Optional[MapSituation] = None
        self._kept: Deque[Happening] = deque(maxlen=_MOST_KEPT)
        self._plan: Sequence[str] = ()
        self._rows: Optional[Dict[str, Row]] = {}  # None if they have to be made again

    def set_graph(self, graph: Optional[Graph]) -> None:
        """The map is known; None if there is none."""
        self._graph = graph
        self._situation = None if graph is None else MapSituation(graph.starts)
        kept, self._kept = list(self._kept), deque(maxlen=_MOST_KEPT)
        for happening in kept:
            self._take(happening)
        self._take(lambda situation: situation.set_plan(self._plan))

    def forget_run(self) -> None:
        """Another run begins, maybe with another map."""
        self._graph = self._situation = None
        self._kept.clear()
        self._rows = {}

    def set_plan(self, atoms: Sequence[str]) -> None:
        """The plan ahead has changed."""
        self._plan = [atom for atom in atoms if atom.startswith("do(")]
        if self._situation is not None:
            self._take(lambda situation: situation.set_plan(self._plan))

    def hear(self, event: journal.Event) -> None:
        """Takes an event of the journal."""
        happening = self._happening(event)
        if happening is not None:
            self._take(happening)

    def _happening(self, event: journal.Event) -> Optional[Happening]:
        """Returns what an event does on the map; None for nothing.

        clingo keeps each term for as long as the process lives, so it does not get to see those of
        strangers that change nothing here.
        """
        if isinstance(event, journal.GoalArrived):
            goal, request = event.goal, event.request
            if split_term(request)[0] == _REQUEST:
                return lambda situation: situation.begin_goal(goal, request)
        elif isinstance(event, journal.StatusSet) and event.status.is_terminal:
            ended, succeeded = event.goal, event.status is Status.SUCCEEDED
            return lambda situation: situation.end_goal(ended, succeeded)
        elif isinstance(event, journal.ActionPublished):
            actuator, action = event.actuator, event.action
            return lambda situation: situation.begin_action(actuator, action)
        elif isinstance(event, journal.MessageArrived):
            source, value = event.source, event.value
            if source != INFO or split_term(value)[0] in _NEWS:
                return lambda situation: _hear(situation, source, value)
        return None

    def _take(self, happening: Happening) -> None:
        if self._situation is None:
            self._kept.append(happening)
            return
        try:
            happening(self._situation)
        except TermError:  # the loop has dropped or rejected it, too
            return
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


def _hear(situation: MapSituation, source: str, value: str) -> None:
    if source == INFO or source in situation.positions:
        situation.hear(source, value)


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
