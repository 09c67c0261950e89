"""Derived variables of a task, whose values follow from those of others by rules."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import DefaultDict, Dict, FrozenSet, Iterator, List, Mapping, Sequence, Set, Tuple

YES, NO = "yes", "no"
"""The values of a derived variable: a rule has derived it, or none has."""


@dataclass(frozen=True)
class Rule:
    """A rule by which a derived variable has the value yes.

    Attributes:
        variable: The variable.
        needs: Values that variables must have.
        bounds: For a number, the least and the largest level; one of them says nothing.
    """

    variable: str
    needs: Tuple[Tuple[str, str], ...]
    bounds: Tuple[Tuple[str, int, int], ...] = ()

    def __str__(self) -> str:
        conditions = [f"{variable} = {value}" for variable, value in self.needs]
        conditions += [
            f"{number} >= {least}" if least else f"{number} <= {most}"
            for number, least, most in self.bounds
        ]
        return f"{self.variable} is {YES} if {' and '.join(conditions) or 'nothing else matters'}"


@dataclass(frozen=True)
class Derivation:
    """All derived variables of a task. Immutable.

    Attributes:
        variables: They.
        rules: Their rules.
        strata: Of each one, how many others have to be derived before, at most, one after another.
            Those in the same stratum do not depend on each other, unless they do so in a circle.
    """

    variables: Sequence[str] = ()
    rules: Sequence[Rule] = ()
    strata: Mapping[str, int] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        users: DefaultDict[Tuple[str, str], List[int]] = defaultdict(list)
        around: DefaultDict[str, Set[str]] = defaultdict(set)
        for index, rule in enumerate(self.rules):
            for fact in rule.needs:
                users[fact].append(index)
                around[rule.variable].add(fact[0])
            around[rule.variable].update(number for number, _, _ in rule.bounds)
        order = _in_order(self.variables, around)
        object.__setattr__(self, "strata", order)
        object.__setattr__(self, "_users", dict(users))
        object.__setattr__(self, "_around", dict(around))
        object.__setattr__(self, "_bases", {})

    _users: Dict[Tuple[str, str], List[int]] = field(init=False, repr=False, compare=False)
    _around: Dict[str, Set[str]] = field(init=False, repr=False, compare=False)
    _bases: Dict[str, FrozenSet[str]] = field(init=False, repr=False, compare=False)

    def derive(self, values: Dict[str, str], levels: Mapping[str, int]) -> None:
        """Gives all derived variables their values.

        Args:
            values: The values of variables, which it changes.
            levels: The levels of numbers.
        """
        if not self.strata:
            return
        missing = [len(rule.needs) for rule in self.rules]
        for index, rule in enumerate(self.rules):
            for number, least, most in rule.bounds:
                if not least <= levels.get(number, -1) <= most:
                    missing[index] += 1  # which is never met
        for variable in self.strata:
            values[variable] = NO
        new = [fact for fact in values.items() if fact[0] not in self.strata]
        new += [(self.rules[i].variable, YES) for i, count in enumerate(missing) if not count]
        for stratum in sorted(set(self.strata.values())):
            while new:
                fact = new.pop()
                if fact[1] == YES and fact[0] in self.strata:
                    if values[fact[0]] == YES:
                        continue
                    values[fact[0]] = YES
                for index in self._users.get(fact, ()):
                    missing[index] -= 1
                    if not missing[index]:
                        new.append((self.rules[index].variable, YES))
            new = [(v, NO) for v, s in self.strata.items() if s == stratum and values[v] == NO]

    def basis(self, name: str) -> FrozenSet[str]:
        """Returns the variables and numbers on which a variable rests: itself if not derived."""
        if name not in self.strata:
            return frozenset((name,))
        if name not in self._bases:
            seen = {name}
            new = [name]
            while new:
                for other in self._around.get(new.pop(), ()):
                    if other not in seen:
                        seen.add(other)
                        new.append(other)
            self._bases[name] = frozenset(seen - self.strata.keys())
        return self._bases[name]

    def needed(self, names: Set[str]) -> Iterator[Rule]:
        """Yields the rules that matter to some variables; adds to these what the rules read."""
        by_variable: DefaultDict[str, List[Rule]] = defaultdict(list)
        for rule in self.rules:
            by_variable[rule.variable].append(rule)
        new = [name for name in names if name in self.strata]
        while new:
            for rule in by_variable[new.pop()]:
                yield rule
                for name, _ in rule.needs:
                    if name not in names:
                        names.add(name)
                        if name in self.strata:
                            new.append(name)


def _in_order(variables: Sequence[str], around: Mapping[str, Set[str]]) -> Dict[str, int]:
    """Returns the strata of derived variables, by Tarjan's algorithm.

    Args:
        variables: They.
        around: What the rules of each one read.
    """
    derived = dict.fromkeys(variables)
    strata: Dict[str, int] = {}
    numbers: Dict[str, int] = {}
    lowest: Dict[str, int] = {}
    circle: List[str] = []
    for start in derived:
        if start in numbers:
            continue
        path = [(start, iter(sorted(around.get(start, ()))))]
        numbers[start] = lowest[start] = len(numbers)
        circle.append(start)
        while path:
            name, others = path[-1]
            for other in others:
                if other not in derived or other in strata:
                    continue
                if other in numbers:
                    lowest[name] = min(lowest[name], numbers[other])
                    continue
                numbers[other] = lowest[other] = len(numbers)
                circle.append(other)
                path.append((other, iter(sorted(around.get(other, ())))))
                break
            else:
                path.pop()
                if path:
                    above = path[-1][0]
                    lowest[above] = min(lowest[above], lowest[name])
                if lowest[name] == numbers[name]:
                    place = circle.index(name)
                    members = circle[place:]
                    del circle[place:]
                    below = {strata[o] for m in members for o in around.get(m, ()) if o in strata}
                    strata.update(dict.fromkeys(members, max(below, default=-1) + 1))
    return {name: strata[name] for name in variables}


UNDERIVED = Derivation()
"""That of a task without derived variables."""
