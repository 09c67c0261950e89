"""A history of actions and beliefs, read from the journal, for the question ``happened``.

>>> past = PastReader()
>>> past.hear(journal.Record(journal.ActionPublished("r", "go(b)"), 1))
>>> past.hear(journal.Record(journal.MessageArrived("r", "failure"), 1))
>>> past.now().deeds
(Deed(step=1, actuator='r', action='go(b)', answer='failure'),)
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace
from typing import Dict, Iterable, List, NamedTuple, Tuple

from rosclingo.wire.term_text import number, split_term
from rosoclingo.loop import journal
from rosoclingo.loop.believing import BeliefKeeper
from rosoclingo.loop.state import State
from rosoclingo.loop.values.atoms import SAVE
from rosoclingo.loop.words import BUSY


class Deed(NamedTuple):
    """An action that was done; ``answer`` is empty as long as there is none."""

    step: int
    actuator: str
    action: str
    answer: str = ""


@dataclass(frozen=True)
class Past:
    """The actions since the last reset, and the beliefs about them.

    Attributes:
        deeds: The actions, in order.
        was_reset: Whether there was a reset.
        beliefs: The terms by which the encoding shows what it believes of what was observed.
        known: The steps in which observations were first known, by their terms; below 0 if that was
            before the last reset.
    """

    deeds: Tuple[Deed, ...] = ()
    was_reset: bool = False
    beliefs: Tuple[str, ...] = ()
    known: Tuple[Tuple[str, int], ...] = ()

    @classmethod
    def of(cls, state: State) -> Past:
        """Returns the past of a loop; called by the loop's thread, or before that begins."""
        beliefs = state.beliefs
        told = state.externals.true
        was_reset = any(atom.startswith(SAVE) for atom in told)
        return cls(deeds_of(told), was_reset, beliefs.terms, tuple(beliefs.steps.items()))


class PastReader:
    """Reads the journal of a run record by record. Thread-safe."""

    def __init__(self) -> None:
        """Begins, with nothing done."""
        self._past = Past()
        self._deeds: List[Deed] = []
        self._open: Dict[str, int] = {}  # where the last deed of each actuator is, if unanswered
        self._answers: Dict[str, str] = {}  # else its answer, which may be dropped
        self._beliefs = BeliefKeeper()
        self._lock = threading.Lock()  # guards all of it; held for moments only

    def take_over(self, past: Past) -> None:
        """Restores the past of a run that goes on."""
        with self._lock:
            self._deeds = list(past.deeds)
            self._open = {deed.actuator: place for place, deed in enumerate(self._deeds)}
            self._open = {
                actuator: place
                for actuator, place in self._open.items()
                if not self._deeds[place].answer
            }
            self._beliefs = BeliefKeeper(past.beliefs, {}, dict(past.known))
            self._past = replace(past, deeds=())

    def hear(self, record: journal.Record) -> None:
        """Reads the next record."""
        event, step = record.event, record.step
        with self._lock:
            if isinstance(event, journal.ActionPublished):
                self._answers.pop(event.actuator, None)
                self._open[event.actuator] = len(self._deeds)
                self._deeds.append(Deed(step, event.actuator, event.action))
            elif isinstance(event, journal.MessageArrived) and event.value != BUSY:
                place = self._open.pop(event.source, None)
                if place is not None:
                    self._deeds[place] = self._deeds[place]._replace(answer=event.value)
                    self._answers[event.source] = event.value
            elif isinstance(event, journal.MessageDropped):
                for actuator, answer in self._answers.items():
                    if event.reason.startswith(journal.naming(actuator, answer)):
                        self._begin_again(actuator)
            elif isinstance(event, journal.ActionRetried):
                self._begin_again(event.actuator)
            elif isinstance(event, journal.BeliefsChanged):
                self._beliefs.take(event.terms, step, lambda: 0.0)
            elif isinstance(event, journal.CommandDone) and event.resets_to is not None:
                self._reset(event.resets_to)

    def now(self) -> Past:
        """Returns the past as known at present."""
        with self._lock:
            beliefs = self._beliefs
            return replace(
                self._past,
                deeds=tuple(self._deeds),
                beliefs=beliefs.terms,
                known=tuple(beliefs.steps.items()),
            )

    def _begin_again(self, actuator: str) -> None:
        for place in range(len(self._deeds) - 1, -1, -1):
            if self._deeds[place].actuator == actuator:
                self._deeds[place] = self._deeds[place]._replace(answer="")
                self._open[actuator] = place
                return

    def _reset(self, step: int) -> None:
        """Counts steps from a step on, and forgets the actions before it."""
        self._beliefs.begin_steps(step)
        self._answers.clear()
        later = [deed._replace(step=deed.step - step) for deed in self._deeds if deed.step > step]
        unanswered = {deed.actuator: place for place, deed in enumerate(later) if not deed.answer}
        self._deeds, self._open = later, unanswered
        self._past = replace(self._past, was_reset=True)


def deeds_of(told: Iterable[str]) -> Tuple[Deed, ...]:
    """Returns the actions among a planner's events, in order, with their answers."""
    answers: Dict[Tuple[str, int], str] = {}
    done: List[Deed] = []
    for atom in told:
        source, content, text = split_term(atom)[1]
        step = number(text) or 0
        if source == "commit":
            done.append(Deed(step, *split_term(content)[1]))
        elif content != BUSY:
            answers[source, step] = content
    return tuple(one._replace(answer=answers.get((one.actuator, one.step), "")) for one in done)
