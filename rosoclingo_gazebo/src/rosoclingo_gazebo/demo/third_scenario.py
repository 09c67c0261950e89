"""Checks the paper's third scenario: an obstacle, and a second request on the way."""

from __future__ import annotations

from typing import Callable, Dict, List

from rosoclingo.loop.journal import Record
from rosoclingo_aspprograms.validator import Map
from rosoclingo_examples.orders import Bring
from rosoclingo_gazebo.demo.journal_validator import JournalValidator
from rosoclingo_gazebo.demo.story import DemoStory
from rosoclingo_gazebo.demo.trace import DriveEventKind, TracePoint

BOOK = Bring("bring(o7,o11)", ("book",))
LETTER = Bring("bring(o2,o3)", ("letter",))

_NEAR_METRES = 2.0
_ROUTE = (
    "go(c6) go(c5) go(c4) go(c6) go(open1) go(c1) go(c2) go(o2) pickup(2) go(c2) go(c1) go(o3) "
    "deliver(2) go(c1) go(c2) go(c3) go(c4) go(o7) pickup(1) go(c4) go(o11) deliver(1)"
)


class ThirdScenario(DemoStory):
    """The third scenario in section 4 of the paper. Thread-safe.

    The robot is asked for a book, and near c6 for a letter too; an obstacle stands between c5 and
    c4. So it turns round, and the letter comes first.
    """

    obstacle = "block c5 c4"
    title = "the way from c5 to c4 is blocked"

    def __init__(
        self, graph: Map, c6: TracePoint, ask: Callable[[Bring], None], *, undisturbed: bool = True
    ) -> None:
        """Starts before the first event.

        Args:
            graph: The map that the robot's actions are checked against.
            c6: Where c6 is, in metres.
            ask: Sends a request; must not wait.
            undisturbed: Whether the robot is to go the way of the paper. Where nodes are killed,
                it may be another one that is as short, and an action may fail.
        """
        super().__init__((BOOK, LETTER), ask)
        self._journal = JournalValidator(graph)
        self._c6 = c6
        self._undisturbed = undisturbed

    def begins(self, places: Dict[str, TracePoint]) -> None:
        """An obstacle is there, and the first request is sent."""
        (x5, y5), (x4, y4) = places["c5"], places["c4"]
        with self._lock:
            middle = (x5 + x4) / 2, (y5 + y4) / 2
            self.trace.happen(DriveEventKind.OBSTACLE, "a box", middle)
        super().begins(places)

    def moves(self, seconds: float, place: TracePoint) -> None:
        """The robot is at a place; near c6, the second request is sent."""
        with self._lock:
            super().moves(seconds, place)
            if self._asked == 1 and self.trace.distance(self._c6) < _NEAR_METRES:
                self.request_next()

    def notes(self, record: Record) -> None:
        """Checks an event of the planning loop's journal against the map, too."""
        with self._lock:
            super().notes(record)
            self._journal.learns(record.event)

    def wrong(self) -> List[str]:
        """Returns the faults, when nothing is expected to happen any more."""
        with self._lock:
            wrong = [*self._journal.validator.finish(), *super().wrong()]
            if self._undisturbed and self._failures != ["go(c4)"]:
                wrong.append(f"one go(c4) was to fail, not {', '.join(self._failures) or 'none'}")
            if self._undisturbed and self._actions != _ROUTE.split():
                wrong.append(f"the actions were to be {_ROUTE}, not {' '.join(self._actions)}")
            if not (self._undisturbed or self.killed):
                wrong.append("no node was killed")
            return wrong
