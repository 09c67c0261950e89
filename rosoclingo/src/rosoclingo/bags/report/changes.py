"""Finds the plans that differ from the plan before, with the place and cause. Needs no ROS."""

from __future__ import annotations

import bisect
from collections import defaultdict
from dataclasses import replace
from typing import Dict, List, Mapping, Optional, Sequence, Set, Tuple

from rosoclingo.bags.report.run import Cause, PlanChange
from rosoclingo.bags.run_model import PlannedSteps, RunModel
from rosoclingo.loop.journal import Entry


def change(found: Entry, run: RunModel) -> Optional[PlanChange]:
    """Returns the change that a plan makes, without causes; None if there is none.

    After nothing but successes, it is the same plan if each actuator does the same in the same
    order: it has only been timed anew. The end may be left out, as what waits for a time is not
    shown.

    Args:
        found: That it was found.
        run: The run, which has taken that.
    """
    before, after = run.plan_before.steps(found.step), run.plan.steps()
    if run.plan.is_expected and _begins_with(_orders(before), _orders(after)):
        return None
    differ = [one for one in before.keys() | after.keys() if before.get(one) != after.get(one)]
    if not differ:
        return None
    first = min(differ)
    old, new = before.get(first, set()), after.get(first, set())
    return PlanChange(
        seconds=found.seconds,
        step=found.step,
        horizon=found.horizon,
        causes=(),
        old=sum(map(len, before.values())),
        new=sum(map(len, after.values())),
        first=first,
        before=tuple(sorted(old - new)),
        after=tuple(sorted(new - old)),
    )


def _begins_with(orders: Mapping[str, List[str]], first: Mapping[str, List[str]]) -> bool:
    """Tells whether each actuator first does the same, and nothing else."""
    return all(orders.get(one, [])[: len(actions)] == actions for one, actions in first.items())


def _orders(plan: PlannedSteps) -> Dict[str, List[str]]:
    """Returns what each actuator does, in order; what goes on in the next step counts once."""
    orders: Dict[str, List[str]] = defaultdict(list)
    last: Set[str] = set()
    for _, actions in sorted(plan.items()):
        for action in sorted(actions - last):
            orders[action.partition(": ")[0]].append(action)
        last = actions
    return orders


def explained(
    changes: Mapping[int, PlanChange], plans: Sequence[int], causes: Sequence[Tuple[int, Cause]]
) -> Tuple[PlanChange, ...]:
    """Returns changes with their causes.

    Args:
        changes: The changes, by the numbers of the plans.
        plans: The places of all plans in the journal, in order.
        causes: What came, with the place in the journal; each belongs to the plan there or the
            next one.
    """
    by_plan: Dict[int, List[Cause]] = defaultdict(list)
    for position, cause in sorted(causes, key=lambda pair: pair[0]):
        by_plan[bisect.bisect_left(plans, position)].append(cause)
    return tuple(
        replace(change, causes=_explain(by_plan[number], is_first=number == 0))
        for number, change in changes.items()
    )


def _explain(causes: Sequence[Cause], is_first: bool) -> Tuple[Cause, ...]:
    """Returns the causes that matter: actions that went as planned only if there is no other."""
    special = tuple(dict.fromkeys(cause for cause in causes if cause.kind != "success"))
    return special or tuple(dict.fromkeys(causes)) or (Cause("start" if is_first else "none"),)
