"""Invariants of every run, whatever the inputs are.

Each check is a function that takes a run and yields what is wrong, in a sentence; its name is that
of the check in docs/check.md.
"""

from __future__ import annotations

import re
from typing import Callable, Dict, Iterator, List, Optional, Sequence

from rosoclingo.loop import journal
from rosoclingo.loop.diagnosis import NO_PLAN
from rosoclingo.loop.journal import STATUSES, TERMINAL_STATUSES, Status
from rosoclingo.loop.values.atoms import Action
from rosoclingo.loop.words import SOLVER
from rosoclingo.tools.check.findings import Finding
from rosoclingo.tools.check.run import CheckedRun, FoundPlan

_NO_ANSWER_SET = "the program has no answer set"
_LAST_STEP = "ended after its last step"
_USUAL = re.compile(r"dropped a message: |has not answered for|waits for a slot")


def contradiction(run: CheckedRun) -> Iterator[str]:
    """No search fails after an event that the encoding declares itself."""
    said = [str(run.failure)] if run.failure is not None else []
    said += run.warnings
    said += [e.reason for e in run.events if isinstance(e, journal.MessageDropped)]
    yield from (text[text.index(_NO_ANSWER_SET) :] for text in said if _NO_ANSWER_SET in text)


def error(run: CheckedRun) -> Iterator[str]:
    """The loop does not end by itself, but for want of a plan or of steps."""
    text = str(run.failure or _LAST_STEP)
    if not any(usual in text for usual in (_LAST_STEP, NO_PLAN, _NO_ANSWER_SET)):
        yield text


def warning(run: CheckedRun) -> Iterator[str]:
    """The loop does not warn of the encoding."""
    for text in run.warnings:
        if not (_USUAL.search(text) or _NO_ANSWER_SET in text):
            yield text


def past(run: CheckedRun) -> Iterator[str]:
    """Done actions stay in each later plan, also those of the current step."""
    for plan in run.plans:
        for action in sorted(plan.published - set(plan.actions), key=str):
            yield f"the plan found in step {plan.elapsed} has no {action} any more, which was done"


def gone_by(run: CheckedRun) -> Iterator[str]:
    """No action is planned for a step that has gone by."""
    for plan in run.plans:
        for action in plan.actions:
            if action.step < plan.step and action not in plan.published:
                yield (
                    f"the plan found in step {plan.elapsed} has {action}, in a step that has gone "
                    "by, and that was not done"
                )


def one_at_a_time(run: CheckedRun) -> Iterator[str]:
    """An actuator has one action in a step, since its answer names none."""
    for plan in run.plans:
        seen: Dict[object, Action] = {}
        for action in plan.actions:
            other = seen.setdefault((action.actuator, action.step), action)
            if other is not action and action.actuator != SOLVER:
                yield f"{action.actuator} has two actions in one step: {other}, {action}"


def known_status(run: CheckedRun) -> Iterator[str]:
    """Each status is one that a goal can have, of a slot with a goal."""
    for plan in run.plans:
        for slot, word, step in plan.statuses:
            if word not in STATUSES:
                yield f"status({slot},{word},{step}): there is no such status"
            elif slot not in plan.slots and run.goals:
                yield (
                    f"the plan found in step {plan.elapsed} has status({slot},{word},{step}), and "
                    "there is no goal in this slot"
                )


def accepted(run: CheckedRun) -> Iterator[str]:
    """A goal gets a status in the step in which it is told, and is accepted once."""
    if not any(plan.statuses for plan in run.plans):
        return  # such an encoding has none at all
    for plan in run.plans:
        for slot, goal in plan.slots.items():
            words = [(word, step) for own, word, step in plan.statuses if own == slot]
            came = plan.told.get(goal)
            if came is not None and came not in [step for _, step in words]:
                yield f"{_name(run, goal)} gets no status in the step in which it comes"
            for word, step in words:
                if word == Status.ACCEPTED and goal in plan.active and step > plan.step:
                    yield f"{_name(run, goal)} is accepted again: status({slot},accepted,{step})"


def one_end(run: CheckedRun) -> Iterator[str]:
    """A goal ends once; it is canceled only after a cancel request, and never rejected."""
    for plan in run.plans:
        for slot, goal in plan.slots.items():
            ends = [(word, step) for own, word, step in plan.statuses if own == slot]
            ends = [(word, step) for word, step in ends if word in TERMINAL_STATUSES]
            if goal in plan.over:
                ends = [(word, step) for word, step in ends if step > plan.step]
            said = ", ".join(f"status({slot},{word},{step})" for word, step in ends)
            if len(ends) > (0 if goal in plan.over else 1):
                yield f"{_name(run, goal)} ends more than once: {said}"
            for word, _ in ends:
                if word == Status.CANCELED and goal not in plan.cancelled:
                    yield f"{_name(run, goal)} is canceled, and nobody has asked for that: {said}"
                if word == Status.REJECTED:
                    yield f"{_name(run, goal)} is rejected, although its event is declared: {said}"


def ends(run: CheckedRun) -> Iterator[str]:
    """If all goes well, each goal ends as it should, and the run is over."""
    if not run.is_smooth or _LAST_STEP in str(run.failure):
        return
    if run.is_too_long:
        yield f"it goes on and on: after {run.elapsed} steps there still is something to be done"
        return
    if NO_PLAN in str(run.failure):
        yield str(run.failure)
        return
    for goal in run.goals if run.failure is None else ():
        word = goal.words[-1] if goal.words else "waiting"
        allowed = {Status.SUCCEEDED, *([Status.CANCELED] if goal.id in run.asked else [])}
        if not goal.ended:
            yield f"{_name(run, goal.id)} does not end: nothing is left to do, and it is {word}"
        elif word not in allowed:
            yield f"{_name(run, goal.id)} is {word}, which nothing that has come explains"


def foretold(run: CheckedRun) -> Iterator[str]:
    """Without unexpected inputs, a run takes as long as planned, and goals end as planned.

    Without a barrier, who answers first makes the steps: how many there are is not looked at.
    """
    last: Optional[FoundPlan] = None
    for plan in run.plans:
        if last is not None and _goes_on(last, plan):
            before, now = last.elapsed + last.length, plan.elapsed + plan.length
            if last.has_barrier and (now < before or (plan.ahead and now > before)):
                yield (
                    f"by the plan found in step {last.elapsed}, all is done in step {before}; all "
                    f"has gone as planned, and now it is step {now}"
                )
            yield from _other_ends(run, last, plan)
        last = plan


def _goes_on(last: FoundPlan, plan: FoundPlan) -> bool:
    """Returns whether only inputs that the first plan expected came between two plans."""
    if [one for one in last.heard if one[0] != "does"] != [o for o in plan.heard if o[0] != "does"]:
        return False
    done = {goal for goal in plan.slots.values() if goal not in plan.over}
    return done <= set(last.slots.values()) and plan.elapsed <= last.elapsed + max(1, last.length)


def _other_ends(run: CheckedRun, last: FoundPlan, plan: FoundPlan) -> Iterator[str]:
    """Yields the goals that end otherwise than planned."""
    planned = planned_ends(last)
    for goal, word in planned_ends(plan).items():
        if goal in planned and planned[goal] != word:
            yield f"{_name(run, goal)} was to be {planned[goal]}, and now it is to be {word}"
        elif goal not in planned and goal in last.slots.values() and _foretells(run):
            yield (
                f"{_name(run, goal)} is to be {word} by the plan found in step {plan.elapsed}, and "
                f"that found in step {last.elapsed} does not say so, although all has gone as "
                "planned"
            )


def _foretells(run: CheckedRun) -> bool:
    """Returns whether the encoding plans the final status of goals."""
    statuses = ((plan.step, word, step) for plan in run.plans for _, word, step in plan.statuses)
    return any(word in TERMINAL_STATUSES and step > now for now, word, step in statuses)


def planned_ends(plan: FoundPlan) -> Dict[str, str]:
    """Returns the planned ends of the open goals, by their numbers."""
    open_goals = {s: goal for s, goal in plan.slots.items() if goal not in plan.over}
    words = ((open_goals[s], word) for s, word, _ in plan.statuses if s in open_goals)
    return {goal: word for goal, word in words if word in TERMINAL_STATUSES}


Check = Callable[[CheckedRun], Iterator[str]]

CHECKS: Sequence[Check] = (
    contradiction, error, warning, past, gone_by, one_at_a_time, known_status, accepted, one_end,
    ends, foretold,
)  # fmt: skip


def findings(run: CheckedRun) -> List[Finding]:
    """Returns the findings in a run: of each check the first; none in a run that was cut."""
    found = []
    for check in CHECKS if not run.is_cut else ():
        for text in check(run):
            found.append(Finding(check.__name__, text, commands=(run.words,)))
            break
    return found


def _name(run: CheckedRun, goal: str) -> str:
    return f"goal {goal}, {run.goals[int(goal) - 1].request},"
