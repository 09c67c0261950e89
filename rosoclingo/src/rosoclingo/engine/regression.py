# cython: language_level=3
"""Regression: what has to hold before the rest of a plan, so that it can be done."""

from rosoclingo.engine.kinds import ADDS, BECOMES, TAKES
from rosoclingo.engine.states import merge_numbers


def find_bases(strata: tuple, rules: tuple) -> dict:
    """Returns the variables and the numbers that determine each derived variable.

    Args:
        strata: As a :class:`~rosoclingo.engine.flat.FlatTask` has them.
        rules: Its rules.
    """
    around: dict = {}
    for stratum in strata:
        for variable, _ in stratum:
            around[variable] = (set(), set())
    for values, levels, variable, _ in rules:
        around[variable][0].update([one for one, _ in values])
        around[variable][1].update([number for number, _, _ in levels])
    bases = {}
    for variable in around:
        seen, new = {variable}, [variable]
        numbers: set = set()
        while new:
            near, levels = around.get(new.pop(), ((), ()))
            numbers.update(levels)
            new += [one for one in near if one not in seen]
            seen.update(near)
        bases[variable] = (seen - around.keys(), numbers)
    return bases


class Regression:
    """Finds the weakest conditions under which the rest of a plan can be done, or some like them.

    They are stronger where the weakest ones would be a disjunction.
    """

    def __init__(self, task: tuple, bases: dict) -> None:
        """Takes a task.

        Args:
            task: A :class:`~rosoclingo.engine.flat.FlatTask`, or a tuple like it.
            bases: Those of :func:`find_bases`.
        """
        domains, _, limits, _, requests, actions = task[:6]
        self._limits = limits
        self._requests = requests
        self._actions = actions
        self._variables = len(domains)
        self._bases = bases
        self._numbers = [merge_numbers(action[3], limits) for action in actions]

    def needs(self, plan: list, trace: list, met: list, begin: int) -> tuple:
        """Returns what has to hold before the rest of a plan.

        Args:
            plan: The plan.
            trace: The state before each action, and the last one.
            met: For each of these states, the requests that become met in it.
            begin: The position of the first action of the rest.

        Returns:
            Values, as pairs, and ranges of levels, as triples of the entry in the state, the least
            and the most.
        """
        values: dict = {}
        levels: dict = {}
        for position in range(len(plan) - 1, begin - 1, -1):
            for request in met[position + 1]:
                wishes, number_wishes = self._requests[request]
                values.update(wishes)
                for number, least, most in number_wishes:
                    self._narrow(levels, number, least, most)
            self._settle(plan[position], trace[position + 1], values, levels)
            self._regress(plan[position], trace[position], values, levels)
        ranges = [(self._variables + number, *pair) for number, pair in levels.items()]
        return list(values.items()), ranges

    def _settle(self, index: int, state, values: dict, levels: dict) -> None:
        """Replaces derived values that an action may change by all on which they rest."""
        if not self._bases:
            return
        _, _, effects, numbers, _, _ = self._actions[index]
        written = {variable for _, variable, _ in effects}
        changed = {number for kind, number, _ in numbers if kind in (TAKES, ADDS, BECOMES)}
        for variable in [one for one in values if one in self._bases]:
            base, base_numbers = self._bases[variable]
            if base.isdisjoint(written) and base_numbers.isdisjoint(changed):
                continue
            del values[variable]
            values.update([(one, state[one]) for one in base])
            for number in base_numbers:
                level = state[self._variables + number]
                self._narrow(levels, number, level, level)

    def _regress(self, index: int, state, values: dict, levels: dict) -> None:
        """Changes what has to hold after an action to what has to hold before it."""
        needs, others, effects, _, _, _ = self._actions[index]
        for conditions, variable, _ in effects:
            if not [one for one, value in conditions if state[one] != value]:
                values.pop(variable, None)
        values.update(needs)
        # Other values might do as well, but this is simple.
        for variable, _ in others:
            values[variable] = state[variable]
        for conditions, _, _ in effects:
            for variable, _ in conditions:
                values[variable] = state[variable]
        for number, least, most, added, level in self._numbers[index]:
            if level >= 0:
                levels.pop(number, None)
            elif number in levels:
                low, high = levels[number]
                levels[number] = (low - added, high - added)
            self._narrow(levels, number, least, most)

    def _narrow(self, levels: dict, number: int, least: int, most: int) -> None:
        low, high = levels.get(number, (0, self._limits[number]))
        levels[number] = (max(low, least), min(high, most))
