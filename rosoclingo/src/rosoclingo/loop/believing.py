"""Remembers what is believed, and since when.

>>> keeper = BeliefKeeper()
>>> terms = ("observes(lamp,dark,1)", "belief(1,2,bulb)")
>>> keeper.take(terms, 3, lambda: 10.0), keeper.take(terms, 4, lambda: 20.0)
(True, False)
>>> keeper.since, keeper.steps
({'bulb': 10.0}, {'observes(lamp,dark,1)': 3})
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Callable, Dict, Tuple

from rosoclingo.loop.values.beliefs import Beliefs

_OBSERVES = "observes("


@dataclass
class BeliefKeeper:
    """Remembers beliefs; all of it is saved. Used by the loop's thread.

    Attributes:
        terms: The terms by which the last plan's encoding shows beliefs, in order; none for none.
        since: The times at which the causes of the best explanation were first part of it, without
            a break, in seconds of the environment's ``world_now``.
        steps: The steps in which observations were first known, by their terms; below 0 if that was
            before the last reset.
        is_shown: Whether beliefs were ever published.
    """

    terms: Tuple[str, ...] = ()
    since: Dict[str, float] = field(default_factory=dict)
    steps: Dict[str, int] = field(default_factory=dict)
    is_shown: bool = False

    def take(self, terms: Tuple[str, ...], step: int, now: Callable[[], float]) -> bool:
        """Takes the beliefs of a plan, and returns whether they are others than before.

        Args:
            terms: The terms that show them, in order.
            step: The current step.
            now: Returns the time, in seconds; called only if the beliefs are others.
        """
        if terms == self.terms:
            return False
        self.terms, self.is_shown = terms, True
        believed = Beliefs.read(terms).believed
        time = now() if believed else 0.0
        self.since = {cause: self.since.get(cause, time) for cause in believed}
        observations = (term for term in terms if term.startswith(_OBSERVES))
        self.steps = {term: self.steps.get(term, step) for term in observations}
        return True

    def begin_steps(self, step: int) -> None:
        """Counts steps anew after a reset.

        Args:
            step: The step that has been the current one, and is step 0 from now on.
        """
        self.steps = {term: known - step - 1 for term, known in self.steps.items()}
