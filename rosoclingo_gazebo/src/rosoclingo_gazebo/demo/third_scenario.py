"""The demo of the paper's third scenario: an obstacle, and a second request on the way."""

from __future__ import annotations

from typing import Callable, Dict

from rosoclingo_examples.orders import Bring
from rosoclingo_gazebo.demo.story import DemoStory
from rosoclingo_gazebo.demo.trace import DriveEventKind, TracePoint

BOOK = Bring("bring(o7,o11)", ("book",))
LETTER = Bring("bring(o2,o3)", ("letter",))

_NEAR_METRES = 2.0


class ThirdScenario(DemoStory):
    """The third scenario in section 4 of the paper. Thread-safe.

    The robot is asked for a book, and near c6 for a letter too; an obstacle stands between c5 and
    c4. So it turns round, and the letter comes first.
    """

    obstacle = "block c5 c4"
    title = "the way from c5 to c4 is blocked"

    def __init__(self, c6: TracePoint, ask: Callable[[Bring], None]) -> None:
        """Starts before the first event.

        Args:
            c6: Where c6 is, in metres.
            ask: Sends a request; must not wait.
        """
        super().__init__((BOOK, LETTER), ask)
        self._c6 = c6

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
