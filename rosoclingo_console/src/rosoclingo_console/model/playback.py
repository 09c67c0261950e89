"""A recorded run as its console had shown it, at any time.

Plan and actions are those that follow from the journal. What goals were told, and what was held, is
in topics of their own; which actions were held, a bag from before ``~held`` was recorded lacks.

>>> from rosoclingo.loop.journal import Entry
>>> entries = (Entry(journal.ActionPublished("robot", "go(2)"), 1, 2, 1, 0.5),)
>>> playback = Playback(Recording("/rosoclingo", entries))
>>> playback.seek(1.0).actuators.count_open(), playback.seek(0.0).actuators.count_open()
(1, 0)
"""

from __future__ import annotations

from collections import deque
from functools import partial
from typing import Callable, Iterator, Set, Tuple

from rosclingo.wire.term_text import last_number
from rosoclingo.bags.holds import OperatorDecisions
from rosoclingo.bags.model import Recording
from rosoclingo.encodings.known import KnownEncoding
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Control, Entry
from rosoclingo_console.model.system import SystemModel
from rosoclingo_console.model.values import quality_words

_UNKNOWN = KnownEncoding()
_MOST_HOLDS = 100
_PAUSES = (Control.PAUSE, Control.HALT, Control.STEP)


class Playback:
    """Makes models of a recorded run. Not thread-safe.

    Attributes:
        name: The name of the planning node.
        seconds: How long the run lasted.
        holds: When an operator held something, and what; the last ones if there are many.
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
        self._says_held = bool(recording.held)
        self._others = sorted(_others(recording), key=lambda one: one[0])
        self._encoding = encoding
        self.name = recording.name
        self.holds = [(one.began, one.name) for one in recording.hold_spans[-_MOST_HOLDS:]]
        self.seconds = max((entry.seconds for entry in recording.entries), default=0.0)
        self._restart()

    def _restart(self) -> None:
        self.model = SystemModel()
        self.model.connect(True, 0.0)
        self.model.set_encoding(self._encoding)
        self._seconds = float("-inf")
        self._next = 0
        self._later = deque(self._others)  # what other topics say after that
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
            self._take_others(self._entries[self._next].seconds)
            self._take(self._entries[self._next])
            self._next += 1
        self._take_others(seconds)
        return self.model

    def _take_others(self, seconds: float) -> None:
        while self._later and self._later[0][0] <= seconds:
            self._later.popleft()[1](self.model)

    def _take(self, entry: Entry) -> None:
        event, model = entry.event, self.model
        model.hear(entry)
        if isinstance(event, journal.PlanFound):
            self._plan = event.actions
            if event.quality is not None:
                model.set_quality(quality_words(event.quality.cost, event.quality.is_best))
        elif isinstance(event, journal.CommandDone) and event.resets:
            self._plan = ()  # its steps have other numbers from now on, and it is found again
        elif isinstance(event, journal.ControlArrived) and not self._says_held:
            self._decide(event, entry.seconds)
        if self._plan or model.actuators.plan.actions:
            atoms = [atom for atom in self._plan if _step(atom) >= entry.step]
            if atoms != list(self._plan) or isinstance(event, journal.PlanFound) or not atoms:
                self._plan = tuple(atoms)
                model.set_plan(entry.step, entry.horizon, atoms)
            else:
                model.actuators.plan.step = entry.step
        model.actuators.set_tokens(model.actuators.tokens())

    def _decide(self, event: journal.ControlArrived, seconds: float) -> None:
        if event.control in _PAUSES:
            self._paused = True
        elif event.control is Control.RESUME:
            self._paused = False
        elif event.control is Control.HOLD:
            self._on_hold.add(event.actuator)
        elif event.control is Control.RELEASE:
            self._on_hold.discard(event.actuator)
        on_hold = tuple(sorted(self._on_hold))
        self.model.decide(OperatorDecisions(self._paused, on_hold), seconds)


def _others(recording: Recording) -> Iterator[Tuple[float, Callable[[SystemModel], None]]]:
    """Yields what other topics than the journal say: when, and what it changes."""
    for seconds, decisions in recording.held:
        yield seconds, partial(SystemModel.decide, decisions=decisions, time=seconds)
    for line in recording.feedback:
        yield line.seconds, partial(SystemModel.tell_goal, identifier=line.goal, line=line.text)


def _step(atom: str) -> int:
    return last_number(atom) or 0
