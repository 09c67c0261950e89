"""Which plans changed what was planned before, where, and why. Needs no ROS."""

from __future__ import annotations

import bisect
from dataclasses import dataclass
from typing import Dict, List, Sequence, Set, Tuple

from rosclingo.wire.term_text import last_number, split_term
from rosoclingo.bags.report.run import Cause, Change

_ROUTINE = frozenset({"success"})

Planned = Dict[int, Set[str]]
"""For each step, its actions, as ``actuator: action``."""


@dataclass(frozen=True)
class Found:
    """A plan that was found.

    Attributes:
        position: Its place in the journal.
        seconds: When it was found.
        step: In which step.
        horizon: Up to which step it goes.
        before: What was planned before, from the step on.
        after: What is planned now, likewise.
    """

    position: int
    seconds: float
    step: int
    horizon: int
    before: Planned
    after: Planned


def planned(atoms: Sequence[str]) -> Planned:
    """Returns the actions of a plan, given as ``do(Actuator,Action,Step)``."""
    plan: Planned = {}
    for atom in atoms:
        name, arguments = split_term(atom)
        step = last_number(atom)
        if name == "do" and step is not None:
            plan.setdefault(step, set()).add(": ".join(arguments[:-1]))
    return plan


def after_reset(plan: Planned, step: int) -> Planned:
    """Returns what is left of a plan when a step has been made number 0."""
    return {number - step: actions for number, actions in plan.items() if number > step}


def changes(plans: Sequence[Found], causes: Sequence[Tuple[int, Cause]]) -> Tuple[Change, ...]:
    """Finds the plans that changed something.

    Args:
        plans: The plans, in order.
        causes: What came, with the place in the journal; each belongs to the plan there or the
            next one.
    """
    positions = [plan.position for plan in plans]
    by_plan: Dict[int, List[Cause]] = {}
    for position, cause in sorted(causes, key=lambda pair: pair[0]):
        by_plan.setdefault(bisect.bisect_left(positions, position), []).append(cause)
    found = []
    for number, plan in enumerate(plans):
        differ = [
            step
            for step in sorted(plan.before.keys() | plan.after.keys())
            if plan.before.get(step) != plan.after.get(step)
        ]
        if differ:
            before = plan.before.get(differ[0], set())
            after = plan.after.get(differ[0], set())
            found.append(
                Change(
                    seconds=plan.seconds,
                    step=plan.step,
                    horizon=plan.horizon,
                    causes=_explain(by_plan.get(number, ()), number == 0),
                    old=sum(map(len, plan.before.values())),
                    new=sum(map(len, plan.after.values())),
                    first=differ[0],
                    before=tuple(sorted(before - after)),
                    after=tuple(sorted(after - before)),
                )
            )
    return tuple(found)


def _explain(causes: Sequence[Cause], is_first: bool) -> Tuple[Cause, ...]:
    """Returns the causes that matter: what goes as planned does so only if there is no other."""
    special = tuple(dict.fromkeys(cause for cause in causes if cause.kind not in _ROUTINE))
    return special or tuple(dict.fromkeys(causes)) or (Cause("start" if is_first else "none"),)
