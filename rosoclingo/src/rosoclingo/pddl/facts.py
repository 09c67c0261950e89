"""Facts of a planning task, with the names of the domain and of its objects.

``(move robot1 a b)`` is ``move(robot1,a,b)``. What is no name in clingo, such as ``Room-1``, is a
text: ``"room-1"``; so names stay what they are, and no two of them become one.

    variable(V,K).          V is a number, K the term of a value, such as at(robot1,a)
    initially(V,K).         wanted(V,K).
    action(A).              costs(A,C).
    needs(A,V,K).           sets(A,V,K).
    sets_if(A,N,V,K).       condition(A,N,W,L).      the N-th effect of A that has conditions
"""

from __future__ import annotations

import re
from typing import Dict, List, Tuple

from clingo import Function, Number, String, Symbol

from rosoclingo.pddl.sas import Task

_NAME = re.compile(r"_*[a-z][A-Za-z0-9_']*", re.ASCII)
_ATOM = re.compile(r"(Negated)?Atom ([^(\s]+)\((.*)\)")
_NONE = "<none of those>"


def action_term(name: str) -> Symbol:
    """Returns the term of an operator, such as ``move(robot1,a,b)`` of ``move robot1 a b``."""
    action, *objects = name.split()
    return _term(action, objects)


def value_terms(values: Tuple[str, ...]) -> List[Symbol]:
    """Returns the terms of a variable's values."""
    return [_value(value) for value in values]


def facts(task: Task) -> List[str]:
    """Returns the facts of a task, line by line."""
    terms = [value_terms(values) for values in task.variables]

    def pair(variable: int, value: int) -> str:
        return f"{variable},{terms[variable][value]}"

    lines = [f"variable({v},{term})." for v, values in enumerate(terms) for term in values]
    lines += [f"initially({pair(v, value)})." for v, value in enumerate(task.init)]
    lines += [f"wanted({pair(v, value)})." for v, value in task.goal]
    for operator in task.operators:
        name = action_term(operator.name)
        lines += [f"action({name}).", f"costs({name},{operator.cost})."]
        lines += [f"needs({name},{pair(v, value)})." for v, value in operator.preconditions]
        for number, effect in enumerate(operator.effects, 1):
            target = pair(effect.variable, effect.value)
            if not effect.conditions:
                lines.append(f"sets({name},{target}).")
                continue
            lines.append(f"sets_if({name},{number},{target}).")
            lines += [
                f"condition({name},{number},{pair(v, value)})." for v, value in effect.conditions
            ]
    return lines


def operator_names(task: Task) -> Dict[Symbol, str]:
    """Returns the names of the operators by their terms, to read a plan."""
    return {action_term(operator.name): operator.name for operator in task.operators}


def _value(text: str) -> Symbol:
    if text == _NONE:
        return Function("none")
    match = _ATOM.fullmatch(text)
    if match is None:
        return String(text)
    negated, predicate, objects = match.groups()
    term = _term(predicate, objects.split(", ") if objects else [])
    return Function("neg", [term]) if negated else term


def _term(name: str, objects: List[str]) -> Symbol:
    arguments = [_object(each) for each in objects]
    if _NAME.fullmatch(name) and name != "not":
        return Function(name, arguments)
    return Function("", [String(name), *arguments])


def _object(name: str) -> Symbol:
    if name.isdigit() and str(int(name)) == name and int(name) < 2**31:
        return Number(int(name))
    return Function(name) if _NAME.fullmatch(name) and name != "not" else String(name)
