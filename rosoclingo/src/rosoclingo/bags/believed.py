"""Time spans in which the same was believed, from the journal.

>>> history = BeliefHistory()
>>> history.add(1.0, 3, ("belief(1,2,bulb)", "belief(2,3,fuse)", "certain(bulb)"))
>>> history.add(4.5, 4, ())
>>> (span,) = history.spans
>>> span.name, span.began, span.ended, span.others
('bulb', 1.0, 4.5, 'fuse (nearly as likely)')
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Iterable, List, Optional, Sequence

from rosoclingo.loop.values.beliefs import Beliefs, Evidence, causes_in_words
from rosoclingo.loop.values.phrases import NO_PHRASES, TermPhrases


@dataclass(frozen=True)
class BeliefSpan:
    """A time in which the best explanation had the same causes.

    Attributes:
        began: When it began, in seconds.
        ended: When it ended; None if it has not.
        step: The step in which it began.
        name: The causes, in the encoding's words.
        is_certain: Whether all explanations that are as good have them, too.
        others: The other explanations, each with how likely it is, by its end.
        speaks_for: The observations that speak for the causes.
        speaks_against: The observations that speak against other causes of the same observations.
    """

    began: float
    ended: Optional[float]
    step: int
    name: str
    is_certain: bool
    others: str
    speaks_for: str
    speaks_against: str


class BeliefHistory:
    """The spans, in order; they do not overlap."""

    def __init__(self, phrases: TermPhrases = NO_PHRASES) -> None:
        """Begins, with nothing believed.

        Args:
            phrases: What causes and observations are called.
        """
        self.spans: List[BeliefSpan] = []
        self._phrases = phrases

    def add(self, seconds: float, step: int, terms: Iterable[str]) -> None:
        """Adds an event of the journal.

        Args:
            seconds: When it was.
            step: In which step.
            terms: The terms that show the beliefs from then on.
        """
        beliefs, phrases = Beliefs.read(terms), self._phrases
        name = _joined(beliefs.believed, phrases)
        span = BeliefSpan(
            seconds, None, step, name,
            is_certain=beliefs.certain.issuperset(beliefs.believed),
            others="; ".join(
                f"{_joined(one.causes, phrases)} ({beliefs.likelihood(one.weight)})"
                for one in beliefs.explanations[1:]
            ),
            speaks_for="; ".join(supporting(beliefs, beliefs.believed, phrases)),
            speaks_against="; ".join(
                f"{phrases.of(cause)}: {', '.join(opposing(beliefs, cause, phrases))}"
                for cause in beliefs.causes
                if opposing(beliefs, cause, phrases)
            ),
        )  # fmt: skip
        last = self.spans[-1] if self.spans else None
        if last is not None and last.ended is None:
            if last.name == name:
                self.spans[-1] = replace(span, began=last.began, step=last.step)
                return
            self.spans[-1] = replace(last, ended=max(seconds, last.began))
        if name:
            self.spans.append(span)


def _joined(causes: Sequence[str], phrases: TermPhrases) -> str:
    return ", ".join(causes_in_words(causes, phrases))


def supporting(
    beliefs: Beliefs, causes: Sequence[str], phrases: TermPhrases = NO_PHRASES
) -> List[str]:
    """Returns the evidence for some causes, in words."""
    evidence = (beliefs.evidence.get(cause, Evidence()) for cause in causes)
    found = (beliefs.words(one, phrases) for each in evidence for one in each.speaks_for)
    return list(dict.fromkeys(found))


def opposing(beliefs: Beliefs, cause: str, phrases: TermPhrases = NO_PHRASES) -> List[str]:
    """Returns what speaks against a cause, in words."""
    evidence = beliefs.evidence.get(cause, Evidence())
    return list(dict.fromkeys(beliefs.words(one, phrases) for one, _ in evidence.speaks_against))
