"""Puts a plan, which is a sequence, in layers of several actions that can be done in some order.

See docs/grounding_on_demand.md, section "Layers". In a layer, robots go first. Each action reads
what held before the layer, or where robots have gone; each variable is changed once, after it was
read.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import DefaultDict, Dict, Iterable, List, Mapping, Optional, Sequence, Tuple

from rosoclingo.seed.task import Operator, position


@dataclass(frozen=True)
class LayeredPlan:
    """A plan in layers.

    Attributes:
        actions: The actuator and its action, as in an atom's arguments, and the layer.
        ways: The robot and its place likewise, and the layer.
        layers: The last layer.
    """

    actions: Sequence[Tuple[str, int]]
    ways: Sequence[Tuple[str, int]]
    layers: int


def put_in_layers(
    plan: Sequence[Operator],
    initial: Mapping[str, str],
    wishes: Mapping[str, str],
    *,
    one_each: bool = False,
) -> LayeredPlan:
    """Puts each action of a plan into the earliest layer in which that is possible.

    Args:
        plan: The plan.
        initial: The values of variables before it.
        wishes: Values that they are to have after it.
        one_each: Whether each layer has one action only.
    """
    layers = _Layers(initial, one_each)
    for operator in plan:
        layers.add(operator)
    layers.meet(wishes)
    return LayeredPlan(layers.actions, layers.ways, layers.last)


def _numbers() -> DefaultDict[str, int]:
    return defaultdict(int)


class _Layers:
    """Takes operators in the order of a plan."""

    def __init__(self, initial: Mapping[str, str], one_each: bool) -> None:
        self.actions: List[Tuple[str, int]] = []
        self.ways: List[Tuple[str, int]] = []
        self.last = 0
        self._one_each = one_each
        self._values = dict(initial)
        self._ready = _numbers()  # the first layer in which a variable's value can be read
        self._read = _numbers()  # the last layer in which it is read
        self._held = _numbers()  # the last layer after which a request needs it
        self._changed = _numbers()  # the last layer in which an action changes it
        self._gone = _numbers()  # the last layer in which the robot goes whose position it is
        self._ahead: Dict[str, Operator] = {}  # ways that are gone before the next action there

    def add(self, operator: Operator) -> None:
        if operator.robot:
            self._ahead[position(operator.robot)] = operator
        elif operator.choice:
            self._act(operator)
        else:
            self.meet(operator.needs)

    def _act(self, action: Operator) -> None:
        reads = {*action.needs, *(variable for variable, _ in action.others)}
        reads.update(variable for effect in action.effects for variable in effect.conditions)
        sets = [*action.sets, *(effect.fact for effect in action.effects)]
        changes = {variable for variable, _ in sets} | {*action.numbers}
        ways = self._take_ways(reads)
        layer = max(
            self.last + 1 if self._one_each else 1,
            *(self._ready[variable] for variable in reads),
            *(self._free(variable) for variable in ways),
            *(max(self._changed[v] + 1, self._read[v], self._held[v] + 1) for v in changes),
        )
        self.actions.append((action.choice, layer))
        self._go(ways.values(), layer)
        for variable in reads:
            self._read[variable] = max(self._read[variable], layer)
        for variable in changes:
            self._changed[variable], self._ready[variable] = layer, layer + 1
            self._ahead.pop(variable, None)
        self._values.update(sets)
        self.last = max(self.last, layer)

    def meet(self, wishes: Mapping[str, str]) -> None:
        """Has variables keep their values until the end of a layer."""
        ways = self._take_ways(wishes)
        for variable, way in ways.items():
            self._go([way], max(1, self._ready[variable], self._free(variable)))
        layer = max([0, *(self._changed[v] for v in wishes), *(self._gone[v] for v in wishes)])
        for variable in wishes:
            self._held[variable] = max(self._held[variable], layer)
        self.last = max(self.last, layer)

    def _free(self, variable: str) -> int:
        """Returns the first layer in which a robot may leave, by the variable of its position."""
        return 1 + max(self._gone[variable], self._read[variable], self._held[variable])

    def _take_ways(self, variables: Iterable[str]) -> Dict[str, Operator]:
        """Removes the ways that are ahead and that matter, by the variables that they change."""
        ways: Dict[str, Operator] = {}
        for variable in variables:
            way: Optional[Operator] = self._ahead.pop(variable, None)
            if way is not None and way.sets[0][1] != self._values.get(variable):
                ways[variable] = way
        return ways

    def _go(self, ways: Iterable[Operator], layer: int) -> None:
        for way in ways:
            variable, place = way.sets[0]
            self.ways.append((way.choice, layer))
            self._ready[variable] = self._gone[variable] = layer
            self._values[variable] = place
