"""Metamorphic checks: a second run with changed inputs has to agree with the first.

Each check makes a second run, and yields what is wrong, in a sentence, with the second command
line; its name is that of the check in docs/check.md.
"""

from __future__ import annotations

import re
from typing import Callable, Iterator, List, Mapping, Optional, Tuple

from rosoclingo.in_process.inputs import MESSAGE, STEP, Input
from rosoclingo.loop import journal
from rosoclingo.loop.values.ids import CANCEL, GOAL
from rosoclingo.loop.words import TIMEOUT, UNKNOWN
from rosoclingo.tools.check.findings import Finding
from rosoclingo.tools.check.invariants import planned_ends
from rosoclingo.tools.check.run import DOES, CheckedRun, FoundPlan

_CLOCK = re.compile(r"clock\(\d+\)")  # a fluent that says how much time has gone by
TwinInputs = Tuple[Input, ...]
Again = Callable[[TwinInputs], CheckedRun]
"""Makes a run with inputs."""


def reset(one: CheckedRun, other: CheckedRun) -> Iterator[str]:
    """Plans take as long with resets as without, as far as the number of steps is comparable."""
    first = {_history(plan): plan for plan in one.plans}
    for plan in other.plans:
        known = first.get(_history(plan))
        if known is None:
            continue
        is_comparable = known.has_barrier and plan.has_barrier and not plan.is_layered
        if is_comparable and known.length != plan.length:
            yield (
                f"in step {plan.elapsed}, after the same, the plan takes {_steps(known.length)} in "
                f"the first run, and {_steps(plan.length)} in the second, which forgets the past"
            )
        elif planned_ends(known) != planned_ends(plan):
            yield (
                f"in step {plan.elapsed}, after the same, goals are to end differently: "
                f"{_words(known)} in the first run, {_words(plan)} in the second, which forgets "
                "the past"
            )


def _history(plan: FoundPlan) -> object:
    """Returns all inputs and actions until a plan was found, and the goals of that plan."""
    return plan.heard, plan.successes, plan.elapsed, frozenset(plan.slots.values()) - plan.over


def _words(plan: FoundPlan) -> str:
    ends = planned_ends(plan)
    return ", ".join(f"goal {goal} {word}" for goal, word in sorted(ends.items())) or "none"


def without_recalled(inputs: TwinInputs, run: CheckedRun, slots: int) -> Optional[TwinInputs]:
    """Returns the inputs without a goal that was cancelled before anything was done.

    All goals come in the beginning, and none has to wait for a slot; None if there is no such goal,
    or if more happens.
    """
    goals = [one for one in inputs if one.kind == GOAL]
    cancels = [one for one in inputs if one.kind == CANCEL]
    at_first = all((one.moment.kind, one.moment.number) == (STEP, 0) for one in goals)
    if not (
        at_first and 0 < len(goals) <= slots and len(cancels) == 1 and len(inputs) == len(goals) + 1
    ):
        return None
    number = int(cancels[0].value)
    if number > len(goals):
        return None
    if not _is_told_before_all(run):
        return None
    return tuple(goal for index, goal in enumerate(goals, 1) if index != number)


def _is_told_before_all(run: CheckedRun) -> bool:
    """Returns whether the planner is told of the cancel request before any action is published."""
    is_asked = False
    for event in run.events:
        if isinstance(event, journal.ActionPublished):
            return False
        is_asked |= isinstance(event, journal.CancelArrived)
        if is_asked and isinstance(event, journal.CommandDone) and event.name == "assign_messages":
            return True
    return False


def recall(one: CheckedRun, other: CheckedRun) -> Iterator[str]:
    """A goal that is cancelled before anything is done leaves no trace."""
    if any(plan.is_layered for plan in (*one.plans, *other.plans)):
        return
    if one.failure is None and other.failure is None and one.steps != other.steps:
        yield (
            "a goal is cancelled before anything is done, and all the others take "
            f"{_steps(one.steps)}; without it, {_steps(other.steps)}"
        )


def without_failure(inputs: TwinInputs, run: CheckedRun) -> Optional[TwinInputs]:
    """Returns the inputs without the first failure that has come; None if there is none."""
    heard = [one for one in run.heard if one[0] == MESSAGE]
    if not heard:
        return None
    _, source, value, _ = heard[0]
    for one in inputs:
        if (one.source, one.value, one.moment.kind) == (source, value, STEP):
            return tuple(other for other in inputs if other is not one)
    return None


def failed(one: CheckedRun, other: CheckedRun) -> Iterator[str]:
    """A failed action has no effect; after an unknown outcome, fluents may be lost.

    That time goes by, which a fluent ``clock(N)`` says, is no effect.
    """
    index, failure = next(
        (index, heard) for index, heard in enumerate(one.heard) if heard[0] == MESSAGE
    )
    before, heard = tuple(one.heard[:index]), tuple(one.heard[: index + 1])
    action = next((h for h in reversed(before) if h[0] == DOES and h[1] == failure[1]), None)
    after = next((plan for plan in one.plans if plan.heard == heard), None)
    if action is None or after is None or action[-1] != failure[-1]:
        return
    moment = after.elapsed
    success = [p for p in other.plans if p.elapsed == moment and p.heard == before]
    earlier = [p for p in one.plans if p.elapsed == moment - 1 and p.heard == before[:-1]]
    if not (success and earlier and before[-1] == action):
        return
    old, new = (
        frozenset(fluent for fluent in plan.fluents if not _CLOCK.fullmatch(fluent))
        for plan in (earlier[-1], success[-1])
    )
    for effect, is_there in ((new - old, after.fluents), (old - new, old - after.fluents)):
        is_new = effect == new - old
        if effect and effect <= is_there and (is_new or failure[2] not in (UNKNOWN, TIMEOUT)):
            what = ", ".join(sorted(effect))
            holds = "holds" if is_new else "holds no longer"
            yield (
                f"{action[1]} has failed to do {action[2]} in step {moment}, and {what} {holds}, "
                "as if it had succeeded"
            )
            return


def compare(
    inputs: TwinInputs, run: CheckedRun, slots: int, again: Again, with_resets: Optional[Again]
) -> List[Finding]:
    """Returns the findings in a comparison of a run with its twins.

    Args:
        inputs: What comes in the run.
        run: The run.
        slots: How many goals the planner deals with at the same time.
        again: Makes another run with other inputs.
        with_resets: Makes one in which the past is forgotten; None if the encoding cannot do that.
    """
    others: Mapping[
        Callable[[CheckedRun, CheckedRun], Iterator[str]], Callable[[], Optional[CheckedRun]]
    ] = {
        failed: lambda: _again(again, without_failure(inputs, run)),
        recall: lambda: _again(again, without_recalled(inputs, run, slots)),
        reset: lambda: None if with_resets is None else with_resets(inputs),
    }
    for check, make in others.items():
        other = make()
        if other is None or other.is_cut:
            continue
        for text in check(run, other):
            return [Finding(check.__name__, text, commands=(run.words, other.words))]
    return []


def _again(again: Again, inputs: Optional[TwinInputs]) -> Optional[CheckedRun]:
    return None if inputs is None else again(inputs)


def _steps(number: int) -> str:
    return f"{number} step{'' if number == 1 else 's'}"


def without_strange(inputs: TwinInputs) -> TwinInputs:
    """Drops the cancel requests for goals that never come."""
    goals = sum(one.kind == GOAL for one in inputs)
    return tuple(one for one in inputs if one.kind != CANCEL or int(one.value) <= goals)
