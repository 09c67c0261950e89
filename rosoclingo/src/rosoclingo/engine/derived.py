"""Derived variables of a task, whose values follow from those of others by rules."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import DefaultDict, Dict, FrozenSet, Iterable, List, Mapping, Sequence, Set, Tuple

YES, NO = "yes", "no"
"""The values of a derived variable: some rule applies, or none does."""


@dataclass(frozen=True)
class Rule:
    """An axiom: conditions under which a derived variable has the value yes.

    Attributes:
        variable: The derived variable.
        needs: Values that variables must have.
        bounds: For a number, the least and the largest level, of which one is no restriction.
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
    """The derived variables of a task, with their rules. Immutable.

    Attributes:
        variables: The names of the derived variables.
        rules: Their rules.
        strata: The stratum of each derived variable, from 0 on: variables that depend on each other
            in a circle share one, and all others on which a variable depends have lower ones.
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
        """Sets the derived variables in a state, stratum by stratum.

        Args:
            values: The values of all variables; those of derived ones are replaced.
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

    def closure(self, names: Iterable[str]) -> Set[str]:
        """Returns names with those of all variables and numbers that their rules read."""
        found = set(names)
        new = list(found)
        while new:
            for other in self._around.get(new.pop(), ()):
                if other not in found:
                    found.add(other)
                    new.append(other)
        return found

    def basis(self, name: str) -> FrozenSet[str]:
        """Returns the variables and numbers that determine a variable: itself if not derived."""
        if name not in self._bases:
            self._bases[name] = frozenset(self.closure([name]) - self.strata.keys())
        return self._bases[name]


def _in_order(variables: Sequence[str], around: Mapping[str, Set[str]]) -> Dict[str, int]:
    """Returns the strata of derived variables, by Tarjan's algorithm.

    Args:
        variables: The derived variables.
        around: For each one, the variables and numbers that its rules read.
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
"""For tasks without derived variables."""
