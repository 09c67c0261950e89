"""A recorded run as its console had shown it, at any time.

Plan and actions are those that follow from the journal. What an operator decided follows from it,
too, in a bag from before ``~held`` was recorded: there, nobody knows which actions were held.

>>> from rosoclingo.bags.model import Entry
>>> entries = (Entry(journal.ActionPublished("robot", "go(2)"), 1, 2, 1, 0.5),)
>>> playback = Playback(Recording("/rosoclingo", entries))
>>> playback.seek(1.0).actuators.count_open(), playback.seek(0.0).actuators.count_open()
(1, 0)
"""

from __future__ import annotations

from collections import deque
from typing import Deque, Set, Tuple

from rosclingo.wire.term_text import last_number
from rosoclingo.bags.model import Entry, OperatorHold, Recording
from rosoclingo.completion.encoding import KnownEncoding
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Control, NumberedRecord
from rosoclingo_console.model.system import SystemModel
from rosoclingo_console.model.values import OperatorDecisions

_UNKNOWN = KnownEncoding()
_PAUSES = (Control.PAUSE, Control.HALT, Control.STEP)


class Playback:
    """Makes models of a recorded run. Not thread-safe.

    Attributes:
        name: The name of the planning node.
        seconds: How long the run lasted.
        model: What was known at the time that was sought last.
    """

    def __init__(self, recording: Recording, encoding: KnownEncoding = _UNKNOWN) -> None:
        """Begins before the first event.

        Args:
            recording: The run.
            encoding: What its planner's encoding says.
        """
        # What was published before the recording began was there when it did.
        self._entries: Tuple[Entry, ...] = recording.entries
        self._held: Tuple[OperatorHold, ...] = recording.held
        self._encoding = encoding
        self.name = recording.name
        self.seconds = max((entry.seconds for entry in recording.entries), default=0.0)
        self._restart()

    def _restart(self) -> None:
        self.model = SystemModel()
        self.model.connect(True, 0.0)
        self.model.set_encoding(self._encoding)
        self._seconds = float("-inf")
        self._next = 0
        self._holds: Deque[OperatorHold] = deque(self._held)  # that come later
        self._plan: Tuple[str, ...] = ()
        self._paused = False
        self._on_hold: Set[str] = set()

    def seek(self, seconds: float) -> SystemModel:
        """Returns what was known at a time; another model if that is earlier than before.

        Args:
            seconds: Since the recording began.
        """
        if seconds < self._seconds:
            self._restart()
        self._seconds = seconds
        while self._next < len(self._entries) and self._entries[self._next].seconds <= seconds:
            self._hold(self._entries[self._next].seconds)
            self._take(self._entries[self._next])
            self._next += 1
        self._hold(seconds)
        return self.model

    def _hold(self, seconds: float) -> None:
        while self._holds and self._holds[0].seconds <= seconds:
            one = self._holds.popleft()
            self.model.decide(
                OperatorDecisions.read(one.is_paused, one.on_hold, one.held, one.reasons)
            )

    def _take(self, entry: Entry) -> None:
        event, model = entry.event, self.model
        model.hear(NumberedRecord(event, entry.step, entry.horizon, entry.number, entry.seconds))
        if isinstance(event, journal.PlanFound):
            self._plan = event.actions
        elif isinstance(event, journal.CommandDone) and event.resets:
            self._plan = ()  # its steps have other numbers from now on, and it is found again
        elif isinstance(event, journal.ControlArrived) and not self._held:
            self._decide(event)
        if self._plan or model.actuators.plan.actions:
            atoms = [atom for atom in self._plan if _step(atom) >= entry.step]
            if atoms != list(self._plan) or isinstance(event, journal.PlanFound) or not atoms:
                self._plan = tuple(atoms)
                model.set_plan(entry.step, entry.horizon, atoms)
            else:
                model.actuators.plan.step = entry.step
        model.set_tokens(model.actuators.tokens())

    def _decide(self, event: journal.ControlArrived) -> None:
        if event.control in _PAUSES:
            self._paused = True
        elif event.control is Control.RESUME:
            self._paused = False
        elif event.control is Control.HOLD:
            self._on_hold.add(event.actuator)
        elif event.control is Control.RELEASE:
            self._on_hold.discard(event.actuator)
        self.model.decide(OperatorDecisions(self._paused, tuple(sorted(self._on_hold))))


def _step(atom: str) -> int:
    return last_number(atom) or 0
