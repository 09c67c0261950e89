"""Explains what was observed by the least surprising causes (docs/causes.md)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Dict, FrozenSet, Iterator, List, Sequence, Tuple, cast

import clingo
from clingo import Function, Symbol

_RULES = """
{ so(C) : cause(C,W) }.
spoken(O) :- so(C), makes(C,O,X).
can(O,X) :- so(C), makes(C,O,X).
can(O,X) :- so(C), may_make(C,O,X).
can(O,X) :- usual(O,X), not spoken(O).
left(O) :- observed(O,X), not can(O,X).
:- so(C), so(D), excludes(C,D), C != D.
#minimize { 1@2,left(O) : left(O) }.
#minimize { W@1,so(C) : so(C), cause(C,W) }.
#minimize { 1@2,always; 1@1,always }.
#defined cause/2. #defined usual/2. #defined observed/2. #defined excludes/2.
#defined makes/3. #defined may_make/3.
#show so/1. #show left/1.
"""

_ALWAYS = 1  # that each cost has, since clingo leaves out what nothing adds to
_MOST_EQUAL = 1000  # equally good explanations that are sorted
_MOST_PARTS = 1000  # whose explanations are kept, since most are asked for again and again

CaseFact = Tuple[str, Tuple[Symbol, ...]]
"""A fact of a case without the case: the predicate, and its arguments."""


@dataclass(frozen=True)
class Explanation:
    """Causes that explain what was observed.

    Attributes:
        weight: The sum of their surprises.
        causes: The causes, in clingo's order.
        unexplained: The observations that they do not explain, likewise.
    """

    weight: int
    causes: Tuple[Symbol, ...]
    unexplained: Tuple[Symbol, ...]


@dataclass(frozen=True)
class Diagnosis:
    """The explanations of a case.

    Attributes:
        kept: The best ones, the best one first; those that weigh as much, in clingo's order.
        certain: The causes in all of those that weigh as much as the best one, kept or not.
        possible: The causes in some of these.
    """

    kept: Tuple[Explanation, ...]
    certain: FrozenSet[Symbol]
    possible: FrozenSet[Symbol]


def diagnose(facts: Sequence[CaseFact], most: int, margin: int) -> Diagnosis:
    """Finds the explanations of a case.

    Observations that have no cause in common are explained apart, and what was found of some is
    kept, so that a new observation costs little.

    Args:
        facts: The facts. They have to be consistent, as :class:`.CauseFinder` checks.
        most: How many explanations are kept at most, from 1 on. Of those that weigh as much, the
            first ones in clingo's order; but of more than 1000 of these, any.
        margin: How much more than the best one they weigh at most.
    """
    kept = [Explanation(0, (), ())]
    certain: FrozenSet[Symbol] = frozenset()
    possible: FrozenSet[Symbol] = frozenset()
    for part in _parts(facts):
        found = _diagnose_part(part, most, margin)
        both = [_joined(one, other) for one in kept for other in found.kept]
        both.sort(key=lambda one: (one.weight, one.causes))
        kept = [one for one in both if one.weight <= both[0].weight + margin][:most]
        certain |= found.certain
        possible |= found.possible
    return Diagnosis(tuple(kept), certain, possible)


def _joined(one: Explanation, other: Explanation) -> Explanation:
    return Explanation(
        one.weight + other.weight,
        tuple(sorted(one.causes + other.causes)),
        tuple(sorted(one.unexplained + other.unexplained)),
    )


def _parts(facts: Sequence[CaseFact]) -> Iterator[Tuple[CaseFact, ...]]:
    """Yields the facts about each group of observations and causes that depend on each other.

    Groups in which all is as usual are left out: they need no cause.
    """
    group: Dict[Tuple[str, Symbol], Tuple[str, Symbol]] = {}

    def find(node: Tuple[str, Symbol]) -> Tuple[str, Symbol]:
        while group.setdefault(node, node) != node:
            group[node] = node = group[group[node]]
        return node

    for name, arguments in facts:
        kinds = _KINDS[name]
        for kind, argument in zip(kinds[1:], arguments[1:]):
            group[find((kind, argument))] = find((kinds[0], arguments[0]))
    parts: Dict[Tuple[str, Symbol], List[CaseFact]] = {}
    for fact in facts:
        parts.setdefault(find((_KINDS[fact[0]][0], fact[1][0])), []).append(fact)
    for part in parts.values():
        usual = {arguments for name, arguments in part if name == "usual"}
        if any(name == "observed" and pair not in usual for name, pair in part):
            yield tuple(sorted(part))


_KINDS = {
    "cause": ("cause",),
    "usual": ("observation",),
    "observed": ("observation",),
    "excludes": ("cause", "cause"),
    "makes": ("cause", "observation"),
    "may_make": ("cause", "observation"),
}


@lru_cache(maxsize=_MOST_PARTS)
def _diagnose_part(facts: Tuple[CaseFact, ...], most: int, margin: int) -> Diagnosis:
    control = clingo.Control(["--warn=none"])
    text = " ".join(f"{Function(name, arguments)}." for name, arguments in facts)
    control.add("base", [], _RULES + text)
    control.ground([("base", [])])
    solving = cast(Any, control.configuration.solve)
    kept: List[Explanation] = []
    best: Tuple[int, ...] = ()
    certain: FrozenSet[Symbol] = frozenset()
    possible: FrozenSet[Symbol] = frozenset()
    while len(kept) < most:
        solving.opt_mode, solving.models = "opt", 0
        cost = _cost(control)
        if best and (not cost or cost[0] > best[0] or cost[1] > best[1] + margin):
            break
        bound = ",".join(map(str, cost))
        solving.opt_mode = f"enum,{bound}"
        if not best:
            best = cost
            solving.models, solving.enum_mode = 0, "cautious"
            certain = frozenset(_last(control))
            solving.enum_mode = "brave"
            possible = frozenset(_last(control))
            solving.enum_mode = "auto"
        solving.models = _MOST_EQUAL
        equal = sorted(_all(control, cost[1] - _ALWAYS), key=lambda one: one.causes)[
            : most - len(kept)
        ]
        for one in equal:
            _exclude(control, one.causes)
            kept.append(one)
    return Diagnosis(tuple(kept), certain, possible)


def _cost(control: clingo.Control) -> Tuple[int, ...]:
    """Returns the cost of the best explanation that is left; empty if there is none."""
    cost: Tuple[int, ...] = ()
    with control.solve(yield_=True) as handle:
        for model in handle:
            cost = tuple(model.cost)
    return cost


def _last(control: clingo.Control) -> List[Symbol]:
    """Returns the causes in the last model, which is a consequence of all or some."""
    causes: List[Symbol] = []
    with control.solve(yield_=True) as handle:
        for model in handle:
            causes = _arguments(model, "so")
    return causes


def _all(control: clingo.Control, weight: int) -> List[Explanation]:
    with control.solve(yield_=True) as handle:
        return [
            Explanation(weight, tuple(_arguments(model, "so")), tuple(_arguments(model, "left")))
            for model in handle
        ]


def _arguments(model: clingo.Model, name: str) -> List[Symbol]:
    return sorted(one.arguments[0] for one in model.symbols(shown=True) if one.name == name)


def _exclude(control: clingo.Control, causes: Sequence[Symbol]) -> None:
    """Excludes an explanation, and all that have more causes than it."""
    with control.backend() as backend:
        atoms = control.symbolic_atoms
        literals = [cast(Any, atoms[Function("so", [cause])]).literal for cause in causes]
        backend.add_rule([], literals)
