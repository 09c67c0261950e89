"""Removes auxiliary variables from a translated task: made predicates, and tests of numbers."""

from __future__ import annotations

from collections import Counter
from typing import Collection, Dict, List, Mapping, Optional, Sequence, Tuple

from rosoclingo.tools.pddl.sas import Assignment, SasEffect, SasOperator, SasRule, TranslatedTask
from rosoclingo.tools.pddl.variables import read_atom


def simplify(task: TranslatedTask, made: Collection[str], tests: Collection[str]) -> TranslatedTask:
    """Returns a task without auxiliary variables, as far as conditions can do without.

    Args:
        task: The task.
        made: The derived predicates that stand for parts of conditions.
        tests: The predicates that stand for tests of numbers, whose atoms become tests of rules.
    """
    named = {v: _predicate(values) for v, values in enumerate(task.variables)}
    inlined = {v for v in task.strata if named[v] in made}
    task = _Inliner(task, inlined).inlined()
    used = {v for v, _ in task.goal}
    for operator in task.operators:
        used.update(v for v, _ in operator.preconditions)
        used.update(v for effect in operator.effects for v, _ in effect.conditions)
    size = 0
    while len(used) > size:
        size = len(used)
        for rule in task.rules:
            if rule.variable in used or rule.variable not in inlined:
                used.update(v for v, _ in rule.conditions)
    gone = inlined - used
    return _without(task, gone, {v for v, name in named.items() if name in tests})


def _predicate(values: Sequence[str]) -> str:
    """Returns the predicate of a variable with one atom; empty for others."""
    atoms = [atom for atom in map(read_atom, values) if atom is not None]
    return atoms[0].predicate if len(atoms) == 1 else ""


class _Inliner:
    """Inlines the rules of made variables.

    A variable with a single rule is replaced by the conditions of that rule. The negation of a
    variable whose rules have one condition each is replaced by the negations of these.
    """

    def __init__(self, task: TranslatedTask, made: Collection[int]) -> None:
        self._task = task
        rules: Dict[int, List[SasRule]] = {v: [] for v in made}
        for rule in task.rules:
            if rule.variable in rules:
                rules[rule.variable].append(rule)
        self._granted: Dict[Assignment, Sequence[Assignment]] = {}
        self._denied: Dict[Assignment, List[Assignment]] = {}
        for variable, own in rules.items():
            if any(rule.tests for rule in own):
                continue
            without = task.init[variable]
            if len(own) == 1:
                self._granted[variable, 1 - without] = own[0].conditions
            if all(len(rule.conditions) == 1 for rule in own):
                self._denied[variable, without] = [rule.conditions[0] for rule in own]

    def inlined(self) -> TranslatedTask:
        """Returns the task with inlined conditions."""
        task = self._task
        if not (self._denied or self._granted):
            return task
        rules = tuple(
            SasRule(rule.variable, self._conditions(rule.conditions), rule.tests)
            for rule in task.rules
        )
        operators = tuple(filter(None, map(self._operator, task.operators)))
        return TranslatedTask(
            task.variables, task.init, self._conditions(task.goal), operators, task.strata, rules
        )

    def _conditions(self, conditions: Sequence[Assignment]) -> Tuple[Assignment, ...]:
        """Returns conditions with their made variables inlined."""
        found: Dict[Assignment, None] = {}
        for one in conditions:
            denied = self._denied.get(one)
            if one in self._granted:
                found.update(dict.fromkeys(self._conditions(self._granted[one])))
            elif denied is not None and all(len(self._task.variables[v]) == 2 for v, _ in denied):
                contrary = [(v, 1 - x) for v, x in denied]
                found.update(dict.fromkeys(self._conditions(contrary)))
            else:
                found[one] = None
        return tuple(found)

    def _operator(self, operator: SasOperator) -> Optional[SasOperator]:
        """Returns an operator with inlined conditions; None if these are inconsistent."""
        needed = dict.fromkeys(self._conditions(operator.preconditions))
        exclusions = dict.fromkeys(operator.exclusions)
        for one in list(needed):
            if one in self._denied:
                del needed[one]
                exclusions.update(dict.fromkeys(self._denied[one]))
        for variable, value in [*exclusions]:
            if len(self._task.variables[variable]) == 2:
                del exclusions[variable, value]
                needed.update(dict.fromkeys(self._conditions([(variable, 1 - value)])))
        values = dict([*needed])
        if len(values) < len(needed) or any(values.get(v) == x for v, x in exclusions):
            return None
        changed = Counter(effect.variable for effect in operator.effects)
        return SasOperator(
            operator.name,
            tuple(needed),
            tuple((v, x) for v, x in exclusions if v not in values),
            tuple(
                SasEffect(self._conditions(each.conditions), each.variable, each.value)
                for each in operator.effects
                if values.get(each.variable) != each.value or changed[each.variable] > 1
            ),
        )


def _without(task: TranslatedTask, gone: Collection[int], tests: Collection[int]) -> TranslatedTask:
    """Returns a task without some variables: unused ones, and tests, which rules get as atoms."""
    kept = [v for v in range(len(task.variables)) if v not in gone and v not in tests]
    number = {old: new for new, old in enumerate(kept)}

    def renumbered(assignments: Sequence[Assignment]) -> Tuple[Assignment, ...]:
        return tuple((number[v], value) for v, value in assignments if v in number)

    operators = tuple(
        SasOperator(
            one.name, renumbered(one.preconditions), renumbered(one.exclusions),
            tuple(
                SasEffect(renumbered(each.conditions), number[each.variable], each.value)
                for each in one.effects
            ),
        )
        for one in task.operators
    )  # fmt: skip
    rules = tuple(
        SasRule(
            number[one.variable],
            renumbered(one.conditions),
            tuple(task.variables[v][x] for v, x in one.conditions if v in tests),
        )
        for one in task.rules
        if one.variable not in gone
    )
    strata: Mapping[int, int] = {number[v]: s for v, s in task.strata.items() if v not in gone}
    return TranslatedTask(
        tuple(task.variables[v] for v in kept), tuple(task.init[v] for v in kept),
        renumbered(task.goal), operators, strata, rules,
    )  # fmt: skip
