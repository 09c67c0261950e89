"""Sets the statuses of goals: none ends before the actions that its end depends on.

The plan says ``status(ID,S,T)``, and the mode says by ``status_update(T)`` that step T's are to be
set. A mode may do so before the actions of the step are published, and an action may fail. So
terminal statuses are held until nothing of the step is left to be done, answered or planned with,
and are set as the plan has them then.
"""

from __future__ import annotations

from rosclingo.wire.term_text import split_term
from rosoclingo.loop.journal import STATUSES, TERMINAL_STATUSES, Status
from rosoclingo.loop.state import State
from rosoclingo.loop.values.atoms import event
from rosoclingo.loop.words import TIMEOUT, UNKNOWN


def update(state: State, step: int) -> None:
    """Sets the goals' statuses as the plan has them in a step; terminal ones by :func:`release`."""
    for slot, word in state.plan.statuses(step):
        if word not in TERMINAL_STATUSES:
            set_status(state, slot, word, step)
        elif step not in state.held:
            state.held.append(step)
    release(state)


def release(state: State) -> None:
    """Ends goals by the terminal statuses that were held, if the plan still has these.

    Does nothing while the current step is not settled.
    """
    _end_cancelled(state)
    if not state.held or is_unsettled(state):
        return
    held = [step for step in state.held if not _is_left_open(state, step)]
    state.held = [step for step in state.held if step not in held]
    for step in held:
        for slot, word in state.plan.statuses(step):
            if word in TERMINAL_STATUSES:
                set_status(state, slot, word, step)


def _end_cancelled(state: State) -> None:
    """Ends goals that are cancelled in this step, and would wait for what an operator holds.

    One that is cancelled since an earlier step ends now because of what is done now, such as that
    something is brought back.
    """
    if not state.executions.held:
        return
    cancelled = [
        goal
        for goal in state.goals.open
        if goal.cancel_told
        and state.externals.is_true(event(goal.slot or "", "cancel", state.step))
    ]
    if not cancelled or not state.shows_plan or is_unsettled(state, counts_held=False):
        return
    for slot, word in state.plan.statuses(state.step):
        if word == Status.CANCELED and state.goals.occupant(slot) in cancelled:
            set_status(state, slot, word, state.step)


def is_unsettled(state: State, *, counts_held: bool = True) -> bool:
    """Tells if actions of the current step are still to be published, answered or planned with.

    The last means that the planner knows an answer, or an input, and has not planned since then.

    Args:
        state: What is known.
        counts_held: Whether those count that no actuator was told of.
    """
    if state.executions.is_awaited if counts_held else state.executions.awaits_begun:
        return True
    if not state.executions.published.issuperset(state.plan.actions(state.step)):
        return True
    if any(state.executions.acting(source) for source, _ in state.mail.messages):
        return True
    return any(
        from_outside or state.executions.acting(split_term(atom)[1][0])
        for atom, from_outside in state.externals.told.items()
    )


def _is_left_open(state: State, step: int) -> bool:
    """Tells if an action up to a step is not answered, because the mode has not waited for that."""
    return any(
        one.is_open
        and not one.acts
        and one.step <= step
        and one.published in state.executions.published
        for one in state.executions.ordered
    )


def needs_next_step(state: State) -> bool:
    """Tells if goals wait for slots of the next step while the plan ends in this one.

    They do if all slots belong to goals that have ended in this step, and the mode, which was told
    so, searches again in the place of moving on.
    """
    if not state.waiting.reminded or state.horizon > state.step or is_unsettled(state):
        return False
    return state.goals.wait_for_next_step


def set_status(state: State, slot: str, word: str, step: int) -> None:
    """Sets the status of the goal in a slot as the plan says for a step."""
    goal = state.goals.occupant(slot)
    if goal is None:
        return
    if word not in STATUSES:
        state.environment.warn(
            f"the plan has status({slot},{word},{step}), where only "
            f"{', '.join(sorted(STATUSES))} are allowed"
        )
        return
    status, reason = Status(word), f"the planner's status in step {step}"
    doubts = _doubts(state) if status is Status.ABORTED else ""
    state.goals.end(goal, status, f"{reason}: {doubts}" if doubts else reason)


def _doubts(state: State) -> str:
    """Returns which actions of the current step may have been done or not."""
    return " and ".join(
        f"whether {one.actuator} has done {one.action} is unknown"
        for one in state.executions.ordered
        if one.answer in (UNKNOWN, TIMEOUT) and one.step == state.step
    )
