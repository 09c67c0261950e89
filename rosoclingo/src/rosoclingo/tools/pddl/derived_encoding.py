"""Encodes the rules of derived variables for ``actions.lp``.

The search reads the rules as facts. clingo derives the values by them, too, while it grounds. So
each stratum gets a rule for each kind of condition, with its number written out: then gringo sees
that the rules are stratified.
"""

from __future__ import annotations

from typing import Callable, Dict, Iterator, List, Optional, Sequence, Tuple

from rosoclingo.tools.pddl.sas import TranslatedTask
from rosoclingo.tools.pddl.variables import Variable

TermBounds = Dict[str, Tuple[int, Optional[int]]]
"""The least and the largest value of numbers, by their terms; None for no upper bound."""

_STRATUM = """
% through({S},I,J,K): in stratum {S}, the first J conditions of rule I hold. implied({S},V,K): some
% rule says V.
through({S},I,0,k) :- rule(I,V,N), derived(V,{S}).
through({S},I,J,k) :- through({S},I,J-1,k), given(I,J,V,X), value(V,X,k).
through({S},I,J,k) :- through({S},I,J-1,k), given_least(I,J,L,N), value(L,M,k), N <= M.
through({S},I,J,k) :- through({S},I,J-1,k), given_most(I,J,L,N), value(L,M,k), M <= N.
through({S},I,J,k) :- through({S},I,J-1,k), given(I,J,V,yes), implied({S},V,k).
implied({S},V,k) :- through({S},I,N,k), rule(I,V,N).
"""
_LOWER = """
through({S},I,J,k) :- through({S},I,J-1,k), given(I,J,V,yes), implied({M},V,k).
through({S},I,J,k) :- through({S},I,J-1,k), given(I,J,V,no), derived(V,{M}), not implied({M},V,k),
                    not unsure(V,k).
"""


def derived_rules(task: TranslatedTask) -> Iterator[str]:
    """Yields the rules by which clingo derives values, for ``present(k,t)``."""
    strata = sorted(set(task.strata.values()))
    for place, stratum in enumerate(strata):
        yield from _STRATUM.format(S=stratum + 1).splitlines()
        for lower in strata[:place]:
            yield from _LOWER.strip().format(S=stratum + 1, M=lower + 1).splitlines()


def derived_facts(
    task: TranslatedTask,
    variables: Sequence[Variable],
    bounds_of: Callable[[str], Optional[TermBounds]],
) -> Iterator[str]:
    """Yields the rules of derived variables as facts.

    Args:
        task: The task.
        variables: Its variables in terms of clingo.
        bounds_of: Returns the bounds of numbers in a test; None if the test never holds.
    """
    for variable, stratum in task.strata.items():
        yield f"derived({variables[variable].name},{stratum + 1})."
    number = 0
    for rule in task.rules:
        bounds = [bounds_of(test) for test in rule.tests]
        if None in bounds:
            continue
        number += 1
        conditions: List[Tuple[str, str]] = [
            ("given", f"{variables[v].name},{variables[v].values[x]}") for v, x in rule.conditions
        ]
        for each in bounds:
            for name, (least, most) in (each or {}).items():
                if least > 0:
                    conditions.append(("given_least", f"{name},{least}"))
                if most is not None:
                    conditions.append(("given_most", f"{name},{most}"))
        yield f"rule({number},{variables[rule.variable].name},{len(conditions)})."
        for place, (verb, condition) in enumerate(conditions, 1):
            yield f"{verb}({number},{place},{condition})."
