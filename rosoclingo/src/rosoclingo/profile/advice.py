"""Advises on changes of an encoding, from measurements of it."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import Callable, Dict, Iterator, List, Mapping, Optional, Sequence

from rosclingo.wire.commands import Result
from rosoclingo.profile.counting import Counts, Steps, VariableValues, total
from rosoclingo.profile.marking import BodyAtom, PredicateSignature, Statement, StatementForm
from rosoclingo.profile.measuring import SolverTrace, TimedSearch

_SHARE = 0.05  # of all instances, from which on a statement is worth a word
_MANY = 500  # instances in one step, or
_VERY_MANY = 20_000  # in all, from which on it is worth a word, too
_FACTOR = 10  # between instances, or combinations, and the largest relation in the body
_GROWTH = 2.0  # between a step and one with half its number
_LEAST_STEP = 6  # from which on that is looked at
_MANY_NUMBERS = 30  # values of a variable that is a number
_MOST = 8  # pieces of advice about grounding
_SECONDS = 0.5  # of searches, from which on they are worth a word
_SOME = 0.5  # of these, from which on a part of them is worth a word

Advisor = Callable[[Statement, Steps], Dict[str, VariableValues]]
"""Returns the values of a statement's variables in its busiest step."""


@dataclass(frozen=True)
class Measured:
    """A statement with its instances.

    Attributes:
        statement: The statement.
        steps: Its instances.
        in_step: How many there are in the busiest step after step 0.
        look: Looks up the values of its variables.
    """

    statement: Statement
    steps: Steps
    in_step: int
    look: Callable[[], Dict[str, VariableValues]]

    @property
    def total(self) -> int:
        """All its instances."""
        return total(self.steps)

    @property
    def many(self) -> str:
        """The number of instances, in words."""
        return f"{self.in_step:,} in a step" if self.in_step else f"{self.total:,}"


def advise(counts: Counts, trace: SolverTrace, look: Advisor) -> List[str]:
    """Returns the advice, that with the greatest effect first.

    Args:
        counts: What was grounded.
        trace: How long that and the searches took.
        look: Looks up the values of a statement's variables.
    """
    grounding = sum(one.seconds for one in trace.groundings)
    searching = sum(one.seconds for one in trace.searches)
    of_searches = list(_search_advice(trace.searches))
    of_grounding = _grounding_advice(counts, look)
    if searching > grounding:
        return [*of_searches, *of_grounding]
    return [*of_grounding, *of_searches]


def _grounding_advice(counts: Counts, look: Advisor) -> List[str]:
    said: List[str] = []
    statements = [
        Measured(
            statement,
            steps,
            counts.in_step(steps),
            lambda statement=statement, steps=steps: look(statement, steps),  # type: ignore[misc]
        )
        for statement, steps in zip(counts.statements, counts.instances)
    ]
    ranked = sorted(((_work(one, counts), one) for one in statements), key=lambda p: -p[0])
    least = _SHARE * sum(work for work, _ in ranked)
    for work, one in ranked:
        if work < least or len(said) >= _MOST:
            break
        if one.in_step < _MANY and work < _VERY_MANY:
            continue
        for reasons in (_FORMS, _NUMBERS):
            words = next(filter(None, (look_for(one, counts) for look_for in reasons)), None)
            if words:
                said.append(f"{one.statement.place}: {words}")
    return said


def _work(one: Measured, counts: Counts) -> int:
    """Returns how many instances clingo tries at least, in all steps."""
    return max(one.total, _tried(one, counts) * max(1, len(one.steps)) if one.total else 0)


def _tried(one: Measured, counts: Counts) -> int:
    """Returns how many combinations there are of atoms that share no variable; 0 for none."""
    sizes = [size for size in _sizes(one, counts) if size > 1]
    return math.prod(sizes) if len(sizes) > 1 else 0


def _sizes(one: Measured, counts: Counts) -> List[int]:
    """Returns the size of the largest relation of each group."""
    return [max(_size(atom, counts) for atom in group) for group in one.statement.groups]


# Each of these looks for one reason, and returns what to say if it is that.


def _events(one: Measured, counts: Counts) -> Optional[str]:
    """External events for each step, for all that could ever be said."""
    statement = one.statement
    if statement.form is not StatementForm.EXTERNAL or not (statement.parameters and one.in_step):
        return None
    (name, arity) = statement.heads[0]
    causes = [
        f"{_name(atom.signature)}, which has {_size(atom, counts):,}"
        for atom in statement.body
        if _size(atom, counts) >= _FACTOR
    ]
    each = f", for each of {' and of '.join(causes)}" if causes else ""
    remedy = (
        "say requests and messages by event(s,c) and event(s,c,t), which are grounded for what "
        "comes only: docs/grounding_on_demand.md"
        if (name, arity) == ("event", 3)
        else "declare it for what can happen in this step only"
    )
    return f"{name}/{arity} has {one.in_step:,} externals in each step{each}: {remedy}"


def _of_no_step(one: Measured, _: Counts) -> Optional[str]:
    """Finds rules that are the same in each step."""
    if not (one.statement.is_constant and one.in_step):
        return None
    return (
        f"derives the same {one.in_step:,} atoms in each step, since nothing in its body depends "
        "on the step: derive them once, in base, without the step"
    )


def _combinations(one: Measured, counts: Counts) -> Optional[str]:
    """Cartesian products: atoms of a body that share no variable."""
    tried = _tried(one, counts)
    if not tried or tried < _FACTOR * max(_sizes(one, counts)):
        return None
    largest = [max(g, key=lambda atom: _size(atom, counts)) for g in one.statement.groups]
    names = [f"{_name(a.signature)} ({_size(a, counts):,})" for a in largest if _size(a, counts)]
    same = {atom.signature for atom in largest}
    remedy = "have them share a variable, or find the pairs that matter by a rule in base"
    if one.statement.form is StatementForm.CONSTRAINT and len(same) == 1:
        remedy = (
            f"if it allows one of them at most, count: "
            f"':- 2 <= {{ {_atom(largest[0].signature)} }}.' is a single rule"
        )
    return (
        f"tries all {tried:,} combinations of {' with '.join(names)}, which share no variable "
        f"({one.many}): {remedy}"
    )


def _numbers(one: Measured, _: Counts) -> Optional[str]:
    """Variables with many numbers, with which a statement computes."""
    spans = sorted(
        (values.number, name, values.span)
        for name, values in one.look().items()
        if values.span and values.number >= _MANY_NUMBERS and name in one.statement.computed
    )
    if not spans:
        return None
    number, name, span = spans[-1]
    return (
        f"computes with {name}, which is each of {number:,} numbers from {span[0]} to {span[1]} "
        f"({one.many}): if it is an amount, count in larger units, and keep it within its limits "
        "in each rule that changes it"
    )


def _growth(one: Measured, counts: Counts) -> Optional[str]:
    """Finds statements with more instances in each step than in the one before."""
    last = max((step for step in one.steps if step), default=0)
    if last < _LEAST_STEP:
        return None
    half = last // 2
    many, few = counts.of_step(one.steps, last), counts.of_step(one.steps, half)
    if many < _MANY or few == 0 or many / few < _GROWTH * 0.8:
        return None
    numbers = [
        f"{name} has {values.number:,} values there, from {values.span[0]} to {values.span[1]}"
        for name, values in one.look().items()
        if values.span is not None and values.number >= _FACTOR
    ]
    why = f" ({numbers[0]})" if numbers else ""
    remedy = (
        "keep the number within its limits in each rule that changes it"
        if numbers
        else "have a step see the one before it only, by a fluent that keeps what is needed"
    )
    return (
        f"grows with the steps, {few:,} in step {half} and {many:,} in step {last}{why}: {remedy}"
    )


def _choice(one: Measured, counts: Counts) -> Optional[str]:
    """Choices most of whose elements are impossible."""
    statement = one.statement
    if statement.form is not StatementForm.CHOICE or not one.in_step:
        return None
    return (
        f"chooses among {one.in_step:,} atoms in each step: choose among what is possible only, "
        "by a condition of the choice, in the place of constraints after it; where robots move on "
        "a map, let a library choose where they go, and not each move"
    )


def _minimize(one: Measured, _: Counts) -> Optional[str]:
    """Minimisation over very many atoms."""
    if one.statement.form is not StatementForm.MINIMIZE:
        return None
    return (
        f"minimises over {one.many}: count by an atom for each action that is done, and not for "
        "each that could be, as in 'cost(C,t) :- do(R,A,t), cost(A,C).'"
    )


def _join(one: Measured, counts: Counts) -> Optional[str]:
    """Atoms of a body that share a variable, of which one value belongs to many."""
    body = [atom for atom in one.statement.body if _size(atom, counts)]
    if len(body) < 2:
        return None
    largest = max(_size(atom, counts) for atom in body)
    instances = one.in_step or one.total
    if instances < _FACTOR * largest:
        return None
    times = Counter(body)
    names = [
        f"{_name(a.signature)} ({_size(a, counts):,}){'' if n == 1 else f', {n} times'}"
        for a, n in times.items()
    ]
    return (
        f"joins {' with '.join(names)} to {one.many}{_factors(one)}: have a rule in base say which "
        "values belong together, as a map says which places are next to each other, or derive "
        "first what it needs, with fewer variables"
    )


_Reason = Callable[[Measured, Counts], Optional[str]]

_FORMS: Sequence[_Reason] = (_events, _of_no_step, _combinations, _choice, _minimize, _join)
_NUMBERS: Sequence[_Reason] = (_growth, _numbers)
"""Of each, the first one that fits is said."""


def _factors(one: Measured) -> str:
    """Returns the variables with the most values, in words."""
    values = sorted(((v.number, name) for name, v in one.look().items()), reverse=True)
    named = [f"{name} has {number:,}" for number, name in values[:3] if number > 1]
    return f" ({', '.join(named)} values)" if len(named) > 1 else ""


def _size(atom: BodyAtom, counts: Counts) -> int:
    """Returns how many atoms there are of a body's atom, in a step if it is of one."""
    steps: Mapping[Optional[int], int] = counts.atoms.get(atom.signature, {})
    return counts.in_step(dict(steps)) if atom.in_step else sum(steps.values())


def _name(signature: PredicateSignature) -> str:
    return f"{signature[0]}/{signature[1]}"


def _atom(signature: PredicateSignature) -> str:
    return f"{signature[0]}({','.join(['...'] * min(signature[1], 1))})"


def _search_advice(searches: Sequence[TimedSearch]) -> Iterator[str]:
    """Yields advice on the time of searches."""
    seconds = sum(one.seconds for one in searches)
    if seconds < _SECONDS:
        return
    without = [one for one in searches if one.result is Result.UNSAT]
    spent = sum(one.seconds for one in without)
    if spent >= _SOME * seconds:
        longest = max(without, key=lambda one: one.seconds)
        yield (
            f"{len({one.horizon for one in without})} horizons without a plan took {spent:.1f} s "
            f"of {seconds:.1f} s, that of {longest.horizon} {longest.seconds:.1f} s: let robots "
            "act in the same step, say what has to hold at the latest when (such as a least number "
            "of steps that is left), or use a library, which finds how many steps it needs"
        )
    improving = sum(one.seconds - one.first for one in searches if one.first is not None)
    if improving >= _SOME * seconds:
        first = max(one.first for one in searches if one.first is not None)
        yield (
            f"searches had a plan after {first:.1f} s at the latest, and took {improving:.1f} s of "
            f"{seconds:.1f} s to find better ones, or to prove that there are none: --patience S "
            "executes the best one of S seconds"
        )
    cut = [one for one in searches if one.result is Result.UNKNOWN]
    if sum(one.seconds for one in cut) >= _SOME * seconds:
        longest = max(cut, key=lambda one: one.seconds)
        yield (
            f"the search with horizon {longest.horizon} was not over after {longest.seconds:.1f} "
            "s: say which of several equal robots or places is used first, so that it does not try "
            "all, or use a library"
        )
