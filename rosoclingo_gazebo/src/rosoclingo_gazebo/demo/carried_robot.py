"""The demo of a robot that is carried elsewhere, and has to find that out."""

from __future__ import annotations

from typing import Callable, Tuple

from rosoclingo.loop.journal import BeliefsChanged, MessageArrived, Record
from rosoclingo.loop.values.beliefs import Beliefs, causes_in_words
from rosoclingo.loop.values.phrases import TermPhrases
from rosoclingo.loop.words import INFO
from rosoclingo_aspprograms.validator import arguments
from rosoclingo_examples.orders import Bring
from rosoclingo_gazebo.demo.story import DEMO_ROBOT, DemoStory
from rosoclingo_gazebo.demo.trace import JUMP_METRES, DriveEventKind, TracePoint

PRESENT = Bring("bring(o1,o14)", ("present",))

_BEGIN, _END = "c2", "c5"


class CarriedRobot(DemoStory):
    """A robot with a package is carried from c2 to c5, without an announcement. Thread-safe.

    Around c5, much is as around c2: so it drives on, until a drive fails. It looks around, believes
    that it was carried, and delivers the package.
    """

    title = f"the robot is carried from {_BEGIN} to {_END}, and finds out"

    def __init__(self, ask: Callable[[Bring], None], phrases: TermPhrases) -> None:
        """Starts before the first event.

        Args:
            ask: Sends a request; must not wait.
            phrases: What causes are called.
        """
        super().__init__((PRESENT,), ask)
        self._phrases = phrases

    def moves(self, seconds: float, place: TracePoint) -> None:
        """The robot is at a place, which may be far from where it was."""
        with self._lock:
            jumped = self.trace.seconds > 0 and self.trace.distance(place) > JUMP_METRES
            super().moves(seconds, place)
            if jumped:
                self.trace.happen(DriveEventKind.CARRIED, "carried, and does not know")
                x, y = place
                print(f"  carried unnoticed: the robot is at ({x:.1f}, {y:.1f})", flush=True)

    def notes(self, record: Record) -> None:
        """Handles what the robot says that it sees, and what is believed."""
        event = record.event
        with self._lock:
            if isinstance(event, MessageArrived):
                self._hear(event)
            super().notes(record)
            if isinstance(event, BeliefsChanged):
                self._believe(Beliefs.read(event.terms).believed)

    def _hear(self, event: MessageArrived) -> None:
        seen = arguments(event.value, "at")
        if event.source == INFO and seen[:1] == [DEMO_ROBOT]:
            self.trace.happen(DriveEventKind.SIGHT, f"sees that it is at {seen[1]}")
            print(f"  it sees that it is at {seen[1]}", flush=True)

    def _believe(self, causes: Tuple[str, ...]) -> None:
        words = ", ".join(causes_in_words(causes, self._phrases))
        print(f"  it believes: {words or 'nothing any more'}", flush=True)
