"""Explains what was observed by the least surprising causes (docs/causes.md)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import (
    Any,
    Dict,
    FrozenSet,
    Generic,
    Iterator,
    List,
    Mapping,
    Sequence,
    Set,
    Tuple,
    TypeVar,
    cast,
)

import clingo
from clingo import Function, Number, Symbol

_RULES = """
{ so(C) : cause(C,W) }.
spoken(O) :- so(C), makes(C,O,X), not ended(C,O).
can(O,X) :- so(C), makes(C,O,X), not ended(C,O).
can(O,X) :- so(C), may_make(C,O,X), not ended(C,O).
can(O,X) :- usual(O,X), not spoken(O).
left(O) :- observed(O,X), not can(O,X).
:- so(C), so(D), excludes(C,D), C != D.
#minimize { 1@2,left(O) : left(O) }.
#minimize { W@1,so(C) : so(C), cause(C,W) }.
#minimize { 1@2,always; 1@1,always }.
#defined cause/2. #defined usual/2. #defined observed/2. #defined excludes/2. #defined ended/2.
#defined makes/3. #defined may_make/3.
#show so/1. #show left/1.
"""

_ALWAYS = 1  # that each cost has, since clingo leaves out what nothing adds to
_MOST_EQUAL = 1000  # equally good explanations that are sorted
_MOST_PARTS = 1000  # whose explanations are kept, since most are asked for again and again

CaseFact = Tuple[str, Tuple[Symbol, ...]]
"""A fact of a case without the case: the predicate, and its arguments."""


_Name = TypeVar("_Name")  # a symbol, or its place in the order of a part


@dataclass(frozen=True, order=True)
class Explanation(Generic[_Name]):
    """Causes that explain what was observed. Those that weigh as much are ordered by causes.

    Attributes:
        weight: The sum of their surprises.
        causes: The causes, in clingo's order.
        unexplained: The observations that they do not explain, in clingo's order.
    """

    weight: int
    causes: Tuple[_Name, ...]
    unexplained: Tuple[_Name, ...]


@dataclass(frozen=True)
class Diagnosis(Generic[_Name]):
    """The explanations of a case.

    Attributes:
        kept: The best ones, the best one first; those that weigh as much, in clingo's order.
        certain: The causes in all of those that weigh as much as the best one, kept or not.
        possible: The causes in some of these.
    """

    kept: Tuple[Explanation[_Name], ...]
    certain: FrozenSet[_Name]
    possible: FrozenSet[_Name]


def diagnose(facts: Sequence[CaseFact], most: int, margin: int) -> Diagnosis[Symbol]:
    """Finds the explanations of a case.

    Observations that have no cause in common are explained apart, and what was found of some is
    kept, so that a new observation costs little.

    Args:
        facts: The facts. They have to be consistent, as :class:`.CauseFinder` checks.
        most: How many explanations are kept at most, from 1 on. Of those that weigh as much, the
            first ones in clingo's order; but of more than 1000 of these, any.
        margin: How much more than the best one they weigh at most.
    """
    kept: List[Explanation[Symbol]] = [Explanation(0, (), ())]
    certain: Set[Symbol] = set()
    possible: Set[Symbol] = set()
    for part in _parts(facts):
        found = _explain_part(part, most, margin)
        least = kept[0].weight + found.kept[0].weight
        both = [
            _joined(one, other)
            for one in kept
            for other in found.kept
            if one.weight + other.weight <= least + margin
        ]
        kept = sorted(both)[:most]
        certain |= found.certain
        possible |= found.possible
    return Diagnosis(tuple(kept), frozenset(certain), frozenset(possible))


_KINDS: Mapping[str, Tuple[str, ...]] = {
    "cause": ("cause", "weight"),
    "usual": ("observation", "value"),
    "observed": ("observation", "value"),
    "excludes": ("cause", "cause"),
    "ended": ("cause", "observation"),
    "makes": ("cause", "observation", "value"),
    "may_make": ("cause", "observation", "value"),
}
"""The kinds of the arguments of facts."""

_Node = Tuple[bool, Symbol]  # whether it is a cause, and the cause or the observation
_Fact = Tuple[str, Tuple[int, ...]]  # with places, or a weight, instead of symbols


def _joined(one: Explanation[Symbol], other: Explanation[Symbol]) -> Explanation[Symbol]:
    return Explanation(
        one.weight + other.weight,
        tuple(sorted(one.causes + other.causes)),
        tuple(sorted(one.unexplained + other.unexplained)),
    )


def _parts(facts: Sequence[CaseFact]) -> Iterator[List[CaseFact]]:
    """Yields the facts about each group of observations and causes that depend on each other.

    Groups in which all is as usual are left out: they need no cause.
    """
    group: Dict[_Node, _Node] = {}

    def find(node: _Node) -> _Node:
        while group.setdefault(node, node) != node:
            group[node] = node = group[group[node]]
        return node

    nodes = [
        [(kind == "cause", one) for kind, one in zip(_KINDS[name], arguments) if kind in _GROUPED]
        for name, arguments in facts
    ]
    for first, *others in nodes:
        for other in others:
            group[find(other)] = find(first)
    parts: Dict[_Node, List[CaseFact]] = {}
    for fact, (first, *_) in zip(facts, nodes):
        parts.setdefault(find(first), []).append(fact)
    for part in parts.values():
        usual = {arguments for name, arguments in part if name == "usual"}
        if any(name == "observed" and arguments not in usual for name, arguments in part):
            yield part


_GROUPED = {"cause", "observation"}


def _explain_part(part: Sequence[CaseFact], most: int, margin: int) -> Diagnosis[Symbol]:
    """Returns the explanations of a part; parts that are alike but for names have them in common.

    For that, the part's symbols of each kind are counted in clingo's order.
    """
    symbols: Dict[str, List[Symbol]] = {}
    for kind in ("cause", "observation", "value"):
        pairs = (pair for name, arguments in part for pair in zip(_KINDS[name], arguments))
        symbols[kind] = sorted({symbol for other, symbol in pairs if other == kind})
    places = {kind: {one: at for at, one in enumerate(known)} for kind, known in symbols.items()}
    facts = sorted(
        (
            name,
            tuple(
                symbol.number if kind == "weight" else places[kind][symbol]
                for kind, symbol in zip(_KINDS[name], arguments)
            ),
        )
        for name, arguments in part
    )
    found = _diagnose_part(tuple(facts), most, margin)
    causes, observations = symbols["cause"], symbols["observation"]
    return Diagnosis(
        tuple(
            Explanation(
                one.weight,
                tuple(causes[cause] for cause in one.causes),
                tuple(observations[left] for left in one.unexplained),
            )
            for one in found.kept
        ),
        frozenset(causes[cause] for cause in found.certain),
        frozenset(causes[cause] for cause in found.possible),
    )


@lru_cache(maxsize=_MOST_PARTS)
def _diagnose_part(facts: Tuple[_Fact, ...], most: int, margin: int) -> Diagnosis[int]:
    control = clingo.Control(["--warn=none"])
    text = " ".join(f"{name}({','.join(map(str, ranks))})." for name, ranks in facts)
    control.add("base", [], _RULES + text)
    control.ground([("base", [])])
    solving = cast(Any, control.configuration.solve)
    kept: List[Explanation[int]] = []
    best: Tuple[int, ...] = ()
    certain: FrozenSet[int] = frozenset()
    possible: FrozenSet[int] = frozenset()
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
        for one in sorted(_all(control, cost[1] - _ALWAYS))[: most - len(kept)]:
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


def _last(control: clingo.Control) -> List[int]:
    """Returns the causes in the last model, which is a consequence of all or some."""
    causes: List[int] = []
    with control.solve(yield_=True) as handle:
        for model in handle:
            causes = _arguments(model, "so")
    return causes


def _all(control: clingo.Control, weight: int) -> List[Explanation[int]]:
    with control.solve(yield_=True) as handle:
        return [
            Explanation(weight, tuple(_arguments(model, "so")), tuple(_arguments(model, "left")))
            for model in handle
        ]


def _arguments(model: clingo.Model, name: str) -> List[int]:
    return sorted(one.arguments[0].number for one in model.symbols(shown=True) if one.name == name)


def _exclude(control: clingo.Control, causes: Sequence[int]) -> None:
    """Excludes an explanation, and all that have more causes than it."""
    with control.backend() as backend:
        atoms = control.symbolic_atoms
        literals = [cast(Any, atoms[Function("so", [Number(cause)])]).literal for cause in causes]
        backend.add_rule([], literals)
