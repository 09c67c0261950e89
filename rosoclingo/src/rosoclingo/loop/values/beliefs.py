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

from collections import defaultdict
from dataclasses import dataclass
from typing import Dict, FrozenSet, Iterable, List, Mapping, NamedTuple, Optional, Tuple

from rosclingo.wire.term_text import number, split_term
from rosoclingo.loop.values.phrases import NO_PHRASES, TermPhrases
from rosoclingo.loop.words import FAILURE, SUCCESS

SHOWN = ("belief(", "observes(", "is_about(", "speaks_", "certain(", "unexplained(")
"""How the terms begin by which beliefs are shown."""


def only_beliefs(terms: Iterable[str]) -> Tuple[str, ...]:
    """Returns terms in order, which begin as :data:`SHOWN` says; none if they show no beliefs.

    An encoding that looks for no causes may use some of these names, too.
    """
    parts = [(term, split_term(term)) for term in terms]
    shows = any((name, len(arguments)) in _NECESSARY for _, (name, arguments) in parts)
    return tuple(sorted(term for term, _ in parts)) if shows else ()


_ARITIES = {
    "belief": 3, "certain": 1, "observes": 3, "is_about": 4, "speaks_for": 3, "speaks_against": 4,
    "unexplained": 2,
}  # fmt: skip
_COULD = {SUCCESS: "could", FAILURE: "could not"}
_NECESSARY = {("belief", 3), ("observes", 3), ("unexplained", 2)}


class Observation(NamedTuple):
    """An observation, at a numbered moment of the encoding."""

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

    def words(self, one: Observation, phrases: TermPhrases = NO_PHRASES) -> str:
        """Returns an observation in a few words, such as ``mailbot could not go to c6``.

        Without phrases, that is ``mailbot: go(c6) failure``.
        """
        what = self.observed.get(one, "")
        said = clause(one, what, phrases)
        if said is not None:
            return said
        if one not in self.about:
            return f"{one.of}: {what}"
        actuator, action = self.about[one]
        deed = phrases.find(action)
        if deed is None or what not in _COULD:
            return f"{actuator}: {deed or action} {what}"
        return f"{actuator} {_COULD[what]} {deed}"

    def likelihood(self, weight: int) -> str:
        """Returns in words how likely an explanation is, compared with the best one."""
        is_best = not self.explanations or weight <= self.explanations[0].weight
        return "as likely" if is_best else "nearly as likely"

    def terms(self, observations: Iterable[Observation]) -> List[str]:
        """Returns the terms by which an encoding shows some observations."""
        return [one.term(self.observed[one]) for one in observations if one in self.observed]

    @classmethod
    def read(cls, terms: Iterable[str]) -> Beliefs:
        """Reads the terms of an answer set that show beliefs; others are skipped."""
        said: Dict[str, List[List[str]]] = defaultdict(list)  # the arguments, by names
        for name, arguments in map(split_term, sorted(terms)):
            if _ARITIES.get(name) == len(arguments):
                said[name].append(arguments)
        weights: Dict[int, int] = {}
        causes: Dict[int, List[str]] = defaultdict(list)
        for place, weight, cause in said["belief"]:
            rank = number(place) or 0
            weights[rank] = max(0, number(weight) or 0)  # messages have no lower one
            causes[rank].append(cause)
        observed: Dict[Observation, str] = {}
        for of, what, moment in said["observes"]:
            observed.setdefault(_observation(of, moment), what)
        about: Dict[Observation, Tuple[str, str]] = {}
        for of, moment, actuator, action in said["is_about"]:
            about.setdefault(_observation(of, moment), (actuator, action))
        speaks_for: Dict[str, List[Observation]] = defaultdict(list)
        for cause, *which in said["speaks_for"]:
            speaks_for[cause].append(_observation(*which))
        against: Dict[str, List[Tuple[Observation, str]]] = defaultdict(list)
        for cause, of, moment, what in said["speaks_against"]:
            against[cause].append((_observation(of, moment), what))
        return cls(
            tuple(WeighedCauses(weights[rank], tuple(causes[rank])) for rank in sorted(causes)),
            frozenset(cause for (cause,) in said["certain"]),
            dict(sorted(observed.items(), key=lambda item: _place(item[0]))),
            about,
            {
                cause: Evidence(
                    tuple(sorted(speaks_for.get(cause, ()), key=_place)),
                    tuple(sorted(against.get(cause, ()), key=lambda one: _place(one[0]))),
                )
                for cause in {**speaks_for, **against}
            },
            tuple(sorted((_observation(*which) for which in said["unexplained"]), key=_place)),
        )


def clause(one: Observation, what: str, phrases: TermPhrases) -> Optional[str]:
    """Returns an encoding's words for what was, or would have been, observed; None for none.

    They are those of the term ``observed(O,X)``.
    """
    return phrases.find(f"observed({one.of},{what})")


def causes_in_words(causes: Iterable[str], phrases: TermPhrases) -> List[str]:
    """Returns the words for causes; those that are called alike once."""
    return list(dict.fromkeys(phrases.of(cause) for cause in causes))


def _observation(of: str, moment: str) -> Observation:
    return Observation(of, number(moment) or 0)


def _place(one: Observation) -> Tuple[int, str]:
    return one.moment, one.of
