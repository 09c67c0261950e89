"""Table of what is believed to be the causes of what was observed.

>>> table = BeliefTable()
>>> table.change(("belief(1,2,bulb)", "observes(lamp,dark,1)", "speaks_for(bulb,lamp,1)"), 5.0, 3)
>>> table.rows["1"]["causes"], table.rows["1"]["weight"], table.rows["1"]["speaks_for"]
(['bulb'], 2, ['lamp: dark'])
"""

from __future__ import annotations

from typing import Dict, Sequence

from rosoclingo.bags.believed import BeliefHistory, opposing, supporting
from rosoclingo.loop.values.beliefs import Beliefs, causes_in_words
from rosoclingo.loop.values.phrases import NO_PHRASES, TermPhrases
from rosoclingo_console.model.board import Row

_MOST_ROWS = 50
_MOST_OBSERVATIONS = 10  # of a row, on each side


class BeliefTable:
    """Explanations, the best one first, and causes that are part of none. Not thread-safe.

    Attributes:
        rows: The rows, by their places from 1; ``weight`` is None where a cause is part of no
            explanation, and ``since`` where it is not believed.
    """

    def __init__(self) -> None:
        """Begins, with nothing believed."""
        self.rows: Dict[str, Row] = {}
        self._history = BeliefHistory()
        self._terms: Sequence[str] = ()
        self._phrases = NO_PHRASES

    def set_phrases(self, phrases: TermPhrases) -> None:
        """Sets what causes and observations are called, from now on."""
        self._phrases = phrases
        self._make_rows()

    def change(self, terms: Sequence[str], time: float, step: int) -> None:
        """Takes an event of the journal.

        Args:
            terms: The terms that show the beliefs from then on.
            time: When it was, in seconds of wall time.
            step: In which step.
        """
        self._history.add(time, step, terms)
        del self._history.spans[:-1]
        self._terms = terms
        self._make_rows()

    def _make_rows(self) -> None:
        phrases = self._phrases
        believed = [span.began for span in self._history.spans if span.ended is None]
        since = believed[0] if believed else None
        beliefs = Beliefs.read(self._terms)
        explaining = {cause for one in beliefs.explanations for cause in one.causes}
        found = [(one.weight, list(one.causes)) for one in beliefs.explanations]
        others = [(None, [cause]) for cause in beliefs.causes if cause not in explaining]
        self.rows = {
            str(place): {
                "weight": weight,
                "causes": causes_in_words(causes, phrases),
                "likelihood": ("" if weight is None or place == 1 else beliefs.likelihood(weight)),
                "is_certain": place == 1 and beliefs.certain.issuperset(causes),
                "since": since if place == 1 and explaining else None,
                "speaks_for": supporting(beliefs, causes, phrases)[-_MOST_OBSERVATIONS:],
                "speaks_against": [
                    one for cause in causes for one in opposing(beliefs, cause, phrases)
                ][-_MOST_OBSERVATIONS:],
            }
            for place, (weight, causes) in enumerate([*found, *others][:_MOST_ROWS], 1)
        }
