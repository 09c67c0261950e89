"""Action elimination: removes superfluous actions, with those that only serve them.

A first plan of Fast Downward's has many of them, and each takes a layer, which is grounded.
"""

from __future__ import annotations

from typing import Dict, List, Mapping, Sequence, Tuple

from rosoclingo.seed.task import Operator

_MOST = 400  # operators of a plan; with more it takes too long


def leave_out(
    plan: Sequence[Operator], initial: Mapping[str, str], goal: Mapping[str, str]
) -> List[Operator]:
    """Returns a plan without its superfluous actions.

    Each operator is left out with those that are impossible without it, unless the goal is missed.
    A plan of more than 400 operators is returned as it is.

    Args:
        plan: The plan.
        initial: The values of variables before it.
        goal: Those that they are to have after it.
    """
    kept: List[Operator] = []
    rest = list(plan)
    if len(rest) > _MOST:
        return rest
    state = dict(initial)
    while rest:
        without, after = _possible_ones(rest[1:], state)
        if goal.items() <= after.items():
            rest = without
        else:
            kept.append(rest.pop(0))
            kept[-1].apply(state)
    return kept


def _possible_ones(
    plan: Sequence[Operator], before: Mapping[str, str]
) -> Tuple[List[Operator], Dict[str, str]]:
    """Returns the operators that are possible without the others, and the values after them."""
    state = dict(before)
    possible = []
    for operator in plan:
        if operator.is_possible(state):
            possible.append(operator)
            operator.apply(state)
    return possible, state
