"""The planner's events as facts, each of which a hypothetical query can leave out."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Dict, FrozenSet, Iterable, List, Sequence, Tuple

from rosclingo.wire.term_text import number, split_term
from rosoclingo.loop.situation import Situation
from rosoclingo.loop.words import BUSY, INTERRUPTED, PASSED


class FactKind(enum.Enum):
    """The kinds of facts."""

    REQUEST = "request"
    CANCEL = "cancel"
    SAVED = "saved"  # it held at the last reset
    ANNOUNCEMENT = "announcement"
    FAILURE = "failure"  # an action was answered by something else than success
    ACTION = "action"  # it was published, and perhaps answered
    RULE = "rule"  # a constraint of the encoding; see :mod:`.rules`


@dataclass(frozen=True)
class Fact:
    """A fact: an event, or several, that the planner was told.

    Attributes:
        kind: What it is.
        step: When, in steps since the last reset.
        source: Who has told it: a slot, an actuator, or another id; ``save`` for what was saved.
        content: The request, the action, what was announced, or what held.
        answer: How the action was answered; empty for no answer, and for a fact that is no action.
        atoms: The events.
    """

    kind: FactKind
    step: int
    source: str
    content: str
    atoms: Tuple[str, ...]
    answer: str = ""

    def __str__(self) -> str:
        return " and ".join(self.atoms)


@dataclass(frozen=True)
class Facts:
    """The facts of a situation, by whether and how they can be left out.

    Attributes:
        free: What can be left out by itself, with that first which explains least.
        history: What was done, and the goals that have ended, ordered by step: can be left out from
            its end on.
        fixed: The events that cannot be left out: which steps have gone by.
    """

    free: Tuple[Fact, ...]
    history: Tuple[Fact, ...]
    fixed: FrozenSet[str]

    @classmethod
    def of(cls, situation: Situation, slots: Sequence[str], savable: Iterable[str] = ()) -> Facts:
        """Sorts the events of a situation into facts.

        Args:
            situation: It has what was told.
            slots: The ids that the planner has for goals.
            savable: The events that could have been saved, as far as the encoding declares them.
        """
        return _Sorter(situation, slots, savable).sorted()

    def all(self) -> FrozenSet[Fact]:
        """Returns all facts."""
        return frozenset(self.free + self.history)


_ORDER = (
    FactKind.CANCEL,
    FactKind.REQUEST,
    FactKind.SAVED,
    FactKind.ANNOUNCEMENT,
    FactKind.FAILURE,
)


def atoms(facts: Iterable[Fact]) -> FrozenSet[str]:
    """Returns the events of some facts."""
    return frozenset(atom for fact in facts for atom in fact.atoms)


class _Sorter:
    """Groups events into facts."""

    def __init__(self, situation: Situation, slots: Sequence[str], savable: Iterable[str]) -> None:
        self._slots = set(slots)
        self._open = dict(situation.goals)
        self._told = [(atom, *_event(atom)) for atom in situation.told]
        self._acting = {  # by actuator and step
            (split_term(content)[1][0], step): content
            for _, source, content, step in self._told
            if source == "commit"
        }
        self._last: Dict[str, int] = {}  # when the goal that is open in a slot was told
        for _, source, content, step in self._told:
            if self._open.get(source) == content:
                self._last[source] = step
        self._saved_goals = self._find_saved_goals(savable)

    def _find_saved_goals(self, savable: Iterable[str]) -> Dict[str, str]:
        """Returns the slot of each saved fluent that belongs to a goal, which may have ended since.

        That is one of a goal that came before the reset, with the slot as an argument, at the first
        place that is for slots: there, the saved fluents of the same form have slots of such goals,
        and those that could be saved have each slot, and nothing else. Other slots than those of
        open goals had a goal, too, if a form of which each open goal has a fluent has one of them.
        """
        saved = [content for _, source, content, _ in self._told if source == "save"]
        saved_forms = _forms(saved)
        savable_forms = _forms(_event(atom)[1] for atom in savable)
        earlier = set(self._open).difference(self._last)
        places = [  # those that may be for slots, and the slots that are there
            (form, place, {arguments[place] for arguments in lists})
            for form, lists in saved_forms.items()
            for place in range(form[1])
            if {arguments[place] for arguments in savable_forms.get(form, ())}
            in (set(), self._slots)
        ]
        goals = set(earlier)
        if earlier:
            goals.update(*(have for *_, have in places if earlier <= have <= self._slots))
        found: Dict[str, str] = {}
        for content in saved:
            name, arguments = split_term(content)
            for form, place, have in places:
                if form == (name, len(arguments)) and have <= goals:
                    found.setdefault(content, arguments[place])
        return found

    def sorted(self) -> Facts:
        free: List[Fact] = []
        history: List[Fact] = []
        fixed = set()
        answers: Dict[Tuple[str, int], Tuple[str, str]] = {}
        busy: Dict[Tuple[str, int], str] = {}
        goals: Dict[str, List[str]] = {}
        for atom, source, content, step in self._told:
            if source == "commit":
                continue
            if source == "info" and content in (PASSED, INTERRUPTED):
                fixed.add(atom)
            elif source == "save" and content in self._saved_goals:
                slot = self._saved_goals[content]
                if slot in self._open and slot not in self._last:
                    goals.setdefault(slot, []).append(atom)
                else:
                    history.append(Fact(FactKind.SAVED, step, source, content, (atom,)))
            elif source == "save":
                free.append(Fact(FactKind.SAVED, step, source, content, (atom,)))
            elif source in self._slots:
                kind = FactKind.CANCEL if content == "cancel" else FactKind.REQUEST
                fact = Fact(kind, step, source, content, (atom,))
                is_open = source in self._open and step >= self._last.get(source, 0)
                (free if is_open else history).append(fact)
            elif (source, step) in self._acting and content == BUSY:
                busy[source, step] = atom
            elif (source, step) in self._acting:
                answers[source, step] = (content, atom)
            else:
                free.append(Fact(FactKind.ANNOUNCEMENT, step, source, content, (atom,)))
        for slot, saved in goals.items():
            free.append(Fact(FactKind.REQUEST, 0, slot, self._open[slot], tuple(sorted(saved))))
        for (actuator, step), commit in self._acting.items():
            answer, atom = answers.get((actuator, step), ("", ""))
            action = split_term(commit)[1][1]
            events = {f"event(commit,{commit},{step})", atom, busy.get((actuator, step), "")}
            kind = FactKind.ACTION if answer in ("", "success") else FactKind.FAILURE
            fact = Fact(kind, step, actuator, action, tuple(sorted(events - {""})), answer)
            (history if kind is FactKind.ACTION else free).append(fact)
        free.sort(key=lambda fact: (_ORDER.index(fact.kind), fact.step, str(fact)))
        history.sort(key=lambda fact: (fact.step, str(fact)))
        return Facts(tuple(free), tuple(history), frozenset(fixed))


def _forms(terms: Iterable[str]) -> Dict[Tuple[str, int], List[List[str]]]:
    """Returns the arguments of terms, by name and arity."""
    forms: Dict[Tuple[str, int], List[List[str]]] = {}
    for term in terms:
        name, arguments = split_term(term)
        forms.setdefault((name, len(arguments)), []).append(arguments)
    return forms


def _event(atom: str) -> Tuple[str, str, int]:
    source, content, step = split_term(atom)[1]
    return source, content, number(step) or 0
