"""Beliefs: explanations of what was observed, as a plan's encoding shows them. Needs no ROS.

An encoding that includes ``causes.lp`` shows them as terms, see docs/causes.md. Others show none.

>>> beliefs = Beliefs.read((
...     "observes(lamp,dark,1)", "belief(1,2,bulb)", "belief(2,3,fuse)", "certain(bulb)",
...     "speaks_for(bulb,lamp,1)", "speaks_for(fuse,lamp,1)", "speaks_against(fuse,radio,2,off)",
... ))
>>> beliefs.explanations
(WeighedCauses(weight=2, causes=('bulb',)), WeighedCauses(weight=3, causes=('fuse',)))
>>> beliefs.believed, beliefs.evidence["bulb"].speaks_for
(('bulb',), (Observation(of='lamp', moment=1),))
>>> beliefs.evidence["fuse"].speaks_against
((Observation(of='radio', moment=2), 'off'),)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable, Dict, FrozenSet, Iterable, List, Mapping, NamedTuple, Set, Tuple

from rosclingo.wire.term_text import number, split_term

SHOWN = ("belief(", "observes(", "is_about(", "speaks_", "certain(", "unexplained(")
"""How the terms begin by which beliefs are shown."""


def only_beliefs(terms: Iterable[str]) -> Tuple[str, ...]:
    """Returns terms in order, which begin as :data:`SHOWN` says; none if they show no beliefs.

    An encoding that looks for no causes may use some of these names, too.
    """
    parts = [(term, split_term(term)) for term in terms]
    shows = any((name, len(arguments)) in _NECESSARY for _, (name, arguments) in parts)
    return tuple(sorted(term for term, _ in parts)) if shows else ()


_NECESSARY = {("belief", 3), ("observes", 3), ("unexplained", 2)}


class Observation(NamedTuple):
    """Something that was observed at a moment: the moments of an encoding have numbers."""

    of: str
    moment: int

    def term(self, what: str) -> str:
        """Returns the term by which an encoding shows what was observed."""
        return f"observes({self.of},{what},{self.moment})"


class WeighedCauses(NamedTuple):
    """An explanation: its causes, and the sum of their surprises."""

    weight: int
    causes: Tuple[str, ...]


class Evidence(NamedTuple):
    """Observations that speak for and against a cause.

    Attributes:
        speaks_for: The observations that the cause makes as they are.
        speaks_against: The observations that would be others with it, each with what it would be.
    """

    speaks_for: Tuple[Observation, ...] = ()
    speaks_against: Tuple[Tuple[Observation, str], ...] = ()


@dataclass(frozen=True)
class Beliefs:
    """Explanations of observations, with the evidence for and against their causes.

    Attributes:
        explanations: The best one first.
        certain: The causes that are part of all explanations which are as good as the best one.
        observed: What was observed, as far as it is of note.
        about: How an actuator fared with an action, for observations of that: both of them.
        evidence: What speaks for and against causes, whether they are part of explanations or not.
        unexplained: The observations that the best explanation leaves open.
    """

    explanations: Tuple[WeighedCauses, ...]
    certain: FrozenSet[str]
    observed: Mapping[Observation, str]
    about: Mapping[Observation, Tuple[str, str]]
    evidence: Mapping[str, Evidence]
    unexplained: Tuple[Observation, ...]

    @property
    def believed(self) -> Tuple[str, ...]:
        """The causes of the best explanation."""
        return self.explanations[0].causes if self.explanations else ()

    @property
    def causes(self) -> List[str]:
        """All causes: those of explanations in their order, then others for which all speaks."""
        explaining = (cause for one in self.explanations for cause in one.causes)
        return list(dict.fromkeys([*explaining, *self.evidence]))

    def words(self, one: Observation) -> str:
        """Returns an observation in a few words, such as ``mailbot: go(c6) failure``."""
        what = self.observed.get(one, "")
        whose = self.about.get(one)
        return f"{': '.join(whose)} {what}" if whose is not None else f"{one.of}: {what}"

    def terms(self, observations: Iterable[Observation]) -> List[str]:
        """Returns the terms by which an encoding shows some observations."""
        return [one.term(self.observed[one]) for one in observations if one in self.observed]

    @classmethod
    def read(cls, terms: Iterable[str]) -> Beliefs:
        """Reads the terms of an answer set that show beliefs; others are skipped."""
        reader = _Reader()
        for term in sorted(terms):
            reader.read(term)
        return reader.beliefs()


class _Reader:
    """Sorts terms by their names."""

    def __init__(self) -> None:
        self._weights: Dict[int, int] = {}
        self._causes: Dict[int, List[str]] = {}
        self._certain: Set[str] = set()
        self._observed: Dict[Observation, str] = {}
        self._about: Dict[Observation, Tuple[str, str]] = {}
        self._for: Dict[str, List[Observation]] = {}
        self._against: Dict[str, List[Tuple[Observation, str]]] = {}
        self._unexplained: List[Observation] = []
        self._readers: Mapping[Tuple[str, int], Callable[..., Any]] = {
            ("belief", 3): self._take_belief,
            ("certain", 1): self._certain.add,
            ("observes", 3): lambda of, what, moment: self._observed.setdefault(
                _observation(of, moment), what
            ),
            ("is_about", 4): lambda of, moment, *whose: self._about.setdefault(
                _observation(of, moment), whose
            ),
            ("speaks_for", 3): lambda cause, *which: self._for.setdefault(cause, []).append(
                _observation(*which)
            ),
            ("speaks_against", 4): lambda cause, of, moment, what: self._against.setdefault(
                cause, []
            ).append((_observation(of, moment), what)),
            ("unexplained", 2): lambda *which: self._unexplained.append(_observation(*which)),
        }

    def read(self, term: str) -> None:
        name, arguments = split_term(term)
        take = self._readers.get((name, len(arguments)))
        if take is not None:
            take(*arguments)

    def _take_belief(self, place: str, weight: str, cause: str) -> None:
        rank = number(place) or 0
        self._weights[rank] = max(0, number(weight) or 0)  # messages have no lower one
        self._causes.setdefault(rank, []).append(cause)

    def beliefs(self) -> Beliefs:
        return Beliefs(
            tuple(
                WeighedCauses(self._weights[rank], tuple(self._causes[rank]))
                for rank in sorted(self._causes)
            ),
            frozenset(self._certain),
            dict(sorted(self._observed.items(), key=lambda item: _place(item[0]))),
            self._about,
            {
                cause: Evidence(
                    tuple(sorted(self._for.get(cause, ()), key=_place)),
                    tuple(sorted(self._against.get(cause, ()), key=lambda one: _place(one[0]))),
                )
                for cause in {**self._for, **self._against}
            },
            tuple(sorted(self._unexplained, key=_place)),
        )


def _observation(of: str, moment: str) -> Observation:
    return Observation(of, number(moment) or 0)


def _place(one: Observation) -> Tuple[int, str]:
    return one.moment, one.of
