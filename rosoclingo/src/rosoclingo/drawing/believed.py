"""Time spans in which the same was believed, from the journal.

>>> history = BeliefHistory()
>>> history.add(1.0, 3, ("belief(1,2,bulb)", "belief(2,3,fuse)", "certain(bulb)"))
>>> history.add(4.5, 4, ())
>>> (span,) = history.spans
>>> span.name, span.began, span.ended, span.others
('bulb', 1.0, 4.5, 'fuse (3)')
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Iterable, List, Optional, Sequence

from rosoclingo.loop.values.beliefs import Beliefs, Evidence


@dataclass(frozen=True)
class BeliefSpan:
    """A time in which the best explanation had the same causes.

    Attributes:
        began: When it began, in seconds.
        ended: When it ended; None if it has not.
        step: The step in which it began.
        name: The causes.
        is_certain: Whether all explanations that are as good have them, too.
        others: The other explanations, each with how surprising it is, by its end.
        speaks_for: The observations that speak for the causes, likewise.
        speaks_against: What speaks against other causes of the same observations, likewise.
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

    def __init__(self) -> None:
        """Begins, with nothing believed."""
        self.spans: List[BeliefSpan] = []

    def add(self, seconds: float, step: int, terms: Iterable[str]) -> None:
        """Adds an event of the journal.

        Args:
            seconds: When it was.
            step: In which step.
            terms: The terms that show the beliefs from then on.
        """
        beliefs = Beliefs.read(terms)
        name = ", ".join(beliefs.believed)
        span = BeliefSpan(
            seconds, None, step, name,
            is_certain=beliefs.certain.issuperset(beliefs.believed),
            others="; ".join(f"{', '.join(c)} ({w})" for w, c in beliefs.explanations[1:]),
            speaks_for="; ".join(supporting(beliefs, beliefs.believed)),
            speaks_against="; ".join(
                f"{cause}: {', '.join(opposing(beliefs, cause))}"
                for cause in beliefs.causes
                if opposing(beliefs, cause)
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


def supporting(beliefs: Beliefs, causes: Sequence[str]) -> List[str]:
    """Returns what speaks for some causes, in words."""
    evidence = (beliefs.evidence.get(cause, Evidence()) for cause in causes)
    found = (beliefs.words(one) for each in evidence for one in each.speaks_for)
    return list(dict.fromkeys(found))


def opposing(beliefs: Beliefs, cause: str) -> List[str]:
    """Returns what speaks against a cause, in words."""
    evidence = beliefs.evidence.get(cause, Evidence())
    return list(dict.fromkeys(beliefs.words(one) for one, _ in evidence.speaks_against))
