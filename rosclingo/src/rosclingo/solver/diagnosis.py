"""Explains what was observed by the least surprising causes (docs/causes.md)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import (
    Any,
    Dict,
    FrozenSet,
    Iterator,
    List,
    Mapping,
    NamedTuple,
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
    ranks = {kind: _ranks(facts, kind) for kind in ("cause", "observation", "value")}
    numbered = [
        (name, tuple(_rank(ranks, kind, one) for kind, one in zip(_KINDS[name], arguments)))
        for name, arguments in facts
    ]
    kept = [_Numbered(0, (), ())]
    certain: Set[int] = set()
    possible: Set[int] = set()
    for part in _parts(numbered):
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
    causes, observations = list(ranks["cause"]), list(ranks["observation"])
    return Diagnosis(
        tuple(Explanation(*_renamed(one, causes, observations)) for one in kept),
        frozenset(causes[cause] for cause in certain),
        frozenset(causes[cause] for cause in possible),
    )


_KINDS: Mapping[str, Tuple[str, ...]] = {
    "cause": ("cause", "weight"),
    "usual": ("observation", "value"),
    "observed": ("observation", "value"),
    "excludes": ("cause", "cause"),
    "makes": ("cause", "observation", "value"),
    "may_make": ("cause", "observation", "value"),
}
"""The kinds of the arguments of facts."""

_Name = TypeVar("_Name")
_Node = Tuple[bool, int]  # whether it is a cause, and its rank
_Fact = Tuple[str, Tuple[int, ...]]  # with ranks, or a weight, in the place of symbols


class _Numbered(NamedTuple):
    """An explanation by ranks. Those that weigh as much are in the order of their causes."""

    weight: int
    causes: Tuple[int, ...]
    unexplained: Tuple[int, ...]


@dataclass(frozen=True)
class _PartDiagnosis:
    """A :class:`Diagnosis` by ranks."""

    kept: Tuple[_Numbered, ...]
    certain: FrozenSet[int]
    possible: FrozenSet[int]


def _ranks(facts: Sequence[CaseFact], kind: str) -> Dict[Symbol, int]:
    """Returns the places of all symbols of a kind in clingo's order."""
    found = {
        argument
        for name, arguments in facts
        for other, argument in zip(_KINDS[name], arguments)
        if other == kind
    }
    return {symbol: rank for rank, symbol in enumerate(sorted(found))}


def _rank(ranks: Mapping[str, Mapping[Symbol, int]], kind: str, symbol: Symbol) -> int:
    return symbol.number if kind == "weight" else ranks[kind][symbol]


def _renamed(
    one: _Numbered, causes: Sequence[_Name], observations: Sequence[_Name]
) -> Tuple[int, Tuple[_Name, ...], Tuple[_Name, ...]]:
    """Returns an explanation with what stands at its ranks."""
    return (
        one.weight,
        tuple(causes[cause] for cause in one.causes),
        tuple(observations[left] for left in one.unexplained),
    )


def _joined(one: _Numbered, other: _Numbered) -> _Numbered:
    return _Numbered(
        one.weight + other.weight,
        tuple(sorted(one.causes + other.causes)),
        tuple(sorted(one.unexplained + other.unexplained)),
    )


def _parts(facts: Sequence[_Fact]) -> Iterator[List[_Fact]]:
    """Yields the facts about each group of observations and causes that depend on each other.

    Groups in which all is as usual are left out: they need no cause.
    """
    group: Dict[_Node, _Node] = {}

    def find(node: _Node) -> _Node:
        while group.setdefault(node, node) != node:
            group[node] = node = group[group[node]]
        return node

    nodes = [
        [(kind == "cause", rank) for kind, rank in zip(_KINDS[name], ranks) if kind in _GROUPED]
        for name, ranks in facts
    ]
    for first, *others in nodes:
        for other in others:
            group[find(other)] = find(first)
    parts: Dict[_Node, List[_Fact]] = {}
    for fact, (first, *_) in zip(facts, nodes):
        parts.setdefault(find(first), []).append(fact)
    for part in parts.values():
        usual = {ranks for name, ranks in part if name == "usual"}
        if any(name == "observed" and ranks not in usual for name, ranks in part):
            yield part


_GROUPED = {"cause", "observation"}


def _explain_part(part: Sequence[_Fact], most: int, margin: int) -> _PartDiagnosis:
    """Returns the explanations of a part; parts that are alike but for names have them in common.

    For that, all ranks are counted anew in the part, in the same order.
    """
    old: Dict[str, List[int]] = {}
    for kind in ("cause", "observation", "value"):
        pairs = ((other, rank) for name, ranks in part for other, rank in zip(_KINDS[name], ranks))
        old[kind] = sorted({rank for other, rank in pairs if other == kind})
    new = {kind: {rank: place for place, rank in enumerate(known)} for kind, known in old.items()}
    facts = sorted(
        (
            name,
            tuple(
                rank if kind == "weight" else new[kind][rank]
                for kind, rank in zip(_KINDS[name], ranks)
            ),
        )
        for name, ranks in part
    )
    found = _diagnose_part(tuple(facts), most, margin)
    causes, observations = old["cause"], old["observation"]
    return _PartDiagnosis(
        tuple(_Numbered(*_renamed(one, causes, observations)) for one in found.kept),
        frozenset(causes[cause] for cause in found.certain),
        frozenset(causes[cause] for cause in found.possible),
    )


@lru_cache(maxsize=_MOST_PARTS)
def _diagnose_part(facts: Tuple[_Fact, ...], most: int, margin: int) -> _PartDiagnosis:
    control = clingo.Control(["--warn=none"])
    text = " ".join(f"{name}({','.join(map(str, ranks))})." for name, ranks in facts)
    control.add("base", [], _RULES + text)
    control.ground([("base", [])])
    solving = cast(Any, control.configuration.solve)
    kept: List[_Numbered] = []
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
    return _PartDiagnosis(tuple(kept), certain, possible)


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


def _all(control: clingo.Control, weight: int) -> List[_Numbered]:
    with control.solve(yield_=True) as handle:
        return [
            _Numbered(weight, tuple(_arguments(model, "so")), tuple(_arguments(model, "left")))
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
