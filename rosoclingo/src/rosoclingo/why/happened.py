"""Tells the outcome of an action, and its believed cause, without a search.

>>> past = Past(
...     deeds=(Deed(1, "r", "go(b)", "failure"),),
...     beliefs=(
...         "observes(d,failure,1)", "is_about(d,1,r,go(b))", "belief(1,2,shut(b))",
...         "certain(shut(b))", "speaks_for(shut(b),d,1)",
...     ),
...     known=(("observes(d,failure,1)", 1),),
... )
>>> phrases = TermPhrases((("shut(W)", "the door of W is shut"),))
>>> happened("go(b)", past, phrases).text
'go(b) of r failed in step 1, probably because the door of b is shut.'
"""

from __future__ import annotations

from dataclasses import replace
from typing import Dict, Iterable, List, Optional, Tuple

from rosclingo.wire.term_text import number, split_term
from rosoclingo.loop.values.atoms import canonical
from rosoclingo.loop.values.beliefs import (
    Beliefs,
    Evidence,
    Observation,
    causes_in_words,
    clause,
)
from rosoclingo.loop.values.phrases import TermPhrases
from rosoclingo.loop.words import FAILURE, SUCCESS
from rosoclingo.why.answers import Happened
from rosoclingo.why.past import Deed, Past
from rosoclingo.why.phrases import join

_ENDS = {SUCCESS: "succeeded", FAILURE: "failed"}


def happened(asked: str, past: Past, phrases: TermPhrases) -> Happened:
    """Tells the last outcome of an action, and its believed cause.

    Args:
        asked: The action A, or ``do(R,A)`` of actuator R, or ``do(R,A,T)`` for step T.
        past: The actions since the last reset, and the beliefs.
        phrases: What causes and observations are called.

    Raises:
        TermError: It is no ground term.
    """
    return _Teller(past, phrases).answer(canonical(asked))


class _Teller:
    """Makes the sentences of an answer."""

    def __init__(self, past: Past, phrases: TermPhrases) -> None:
        self._past = past
        self._phrases = phrases
        self._beliefs = Beliefs.read(past.beliefs)
        self._known = dict(past.known)

    def answer(self, asked: str) -> Happened:
        actuator, action, step = _read(asked)
        deeds = [
            one for one in self._past.deeds
            if one.action == action and actuator in ("", one.actuator) and step in (None, one.step)
        ]  # fmt: skip
        noted = [
            (one.moment, one)
            for one, whose in self._beliefs.about.items()
            if whose[1] == action and actuator in ("", whose[0])
            if one in self._beliefs.observed and step in (None, self._step(one))
        ]
        seen = max(noted)[1] if noted else None
        deed = max(deeds) if deeds else None
        if seen is None:
            return self._tell_deed(action, deed)
        answer = self._tell_seen(action, seen)
        known = self._step(seen)
        if deed is None or known is None or deed.step <= known:
            return answer
        later = self._tell_deed(action, deed).text
        return replace(answer, text=f"{later} Before that, {answer.text}")

    def _step(self, one: Observation) -> Optional[int]:
        """Returns the step in which an observation was first known, if that is recorded."""
        step = self._known.get(one.term(self._beliefs.observed[one]))
        if step is None or step < 0:
            return step
        whose = self._beliefs.about.get(one)
        own = [deed.step for deed in self._past.deeds if (deed.actuator, deed.action) == whose]
        return max((past for past in own if past <= step), default=step)

    def _tell_deed(self, action: str, deed: Optional[Deed]) -> Happened:
        """Tells the outcome of an action without anything of note."""
        if deed is None:
            is_new = self._past.was_reset
            when = "was not done since the last reset" if is_new else "was never done"
            return Happened(f"{action} {when}, as far as is known.", action)
        name = f"{action} of {deed.actuator}"
        if not deed.answer:
            text = f"{name} is under way since step {deed.step}."
        elif deed.answer == SUCCESS:
            text = f"{name} succeeded in step {deed.step}."
        else:
            text = (
                f"{name} {_ended(deed.answer)} in step {deed.step}; no cause of that is believed."
            )
        return Happened(text, action, deed.actuator, deed.step, deed.answer)

    def _tell_seen(self, action: str, seen: Observation) -> Happened:
        """Tells the beliefs about an observation of an action."""
        actuator, what = self._beliefs.about[seen][0], self._beliefs.observed[seen]
        step = self._step(seen)
        text = f"{action} of {actuator} {_ended(what)}{_when(step)}"
        named = _Causes(self._beliefs, seen)
        if named.best:
            text += f", probably because {join(self._words(named.best))}"
        elif seen in self._beliefs.unexplained:
            text += ", and nothing explains that"
        said = set(self._words(named.best))
        clauses = [
            ("as likely is", named.equal, ""),
            ("nearly as likely is", named.near, ""),
            *(
                ("it may also be", causes, f", but then {self._would(*other)}")
                for other, causes in named.refuted.items()
            ),
            ("less likely is", named.unlikely, ""),
        ]
        for lead, causes, end in clauses:
            words = [one for one in self._words(causes) if one not in said]
            said.update(words)
            text += f"; {lead} {_either(words)}{end}" if words else ""
        return Happened(
            f"{text}.", action, actuator, step, what,
            because=tuple(named.best),
            others=(*named.equal, *named.near),
            refuted=tuple(cause for causes in named.refuted.values() for cause in causes),
        )  # fmt: skip

    def _words(self, causes: Iterable[str]) -> List[str]:
        return causes_in_words(causes, self._phrases)

    def _would(self, other: Observation, what: str) -> str:
        """Returns a clause about the expected observation."""
        said = clause(other, what, self._phrases)
        if said is not None:
            return f"it would have been observed that {said}"
        whose = self._beliefs.about.get(other)
        if whose is None:
            return f"{what} would have been observed of {self._phrases.of(other.of)}"
        actuator, action = whose
        ended = _ENDS.get(what, f"been answered {what}")
        step = self._step(other) if other in self._beliefs.observed else None
        return f"{action} of {actuator} would have {ended}{_when(step)}"


class _Causes:
    """Ranks the causes of an observation by likelihood.

    Attributes:
        best: Those of the best explanation.
        equal: Those of others that are as good.
        near: Those of the others that were kept.
        refuted: The others against which something speaks, by what that is.
        unlikely: The others.
    """

    def __init__(self, beliefs: Beliefs, seen: Observation) -> None:
        ranks: Dict[str, int] = {}
        for explanation in beliefs.explanations:
            for cause in explanation.causes:
                ranks.setdefault(cause, explanation.weight)
        least = min(ranks.values(), default=0)
        self.best: List[str] = []
        self.equal: List[str] = []
        self.near: List[str] = []
        self.unlikely: List[str] = []
        self.refuted: Dict[Tuple[Observation, str], List[str]] = {}
        for cause in beliefs.causes:
            evidence = beliefs.evidence.get(cause, Evidence())
            if seen not in evidence.speaks_for:
                continue
            if cause in beliefs.believed:
                self.best.append(cause)
            elif cause in ranks:
                (self.equal if ranks[cause] == least else self.near).append(cause)
            elif evidence.speaks_against:
                self.refuted.setdefault(evidence.speaks_against[0], []).append(cause)
            else:
                self.unlikely.append(cause)


def _read(asked: str) -> Tuple[str, str, Optional[int]]:
    """Parses the actuator, action and step of a query; empty and None for any."""
    name, arguments = split_term(asked)
    if name != "do" or len(arguments) not in (2, 3):
        return "", asked, None
    return arguments[0], arguments[1], number(arguments[2]) if arguments[2:] else None


def _ended(answer: str) -> str:
    return _ENDS.get(answer, f"was answered {answer}")


def _when(step: Optional[int]) -> str:
    if step is None:
        return ""
    return " before the last reset" if step < 0 else f" in step {step}"


def _either(words: List[str]) -> str:
    return ", or ".join(f"that {one}" for one in words)
