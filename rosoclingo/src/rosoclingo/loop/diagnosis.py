"""Diagnoses why there is no plan: finds an unreachable goal, or a contradiction in the program.

An event that is an external is tested by making it false again. In the dialects in which events are
facts that cannot be done: then all suspects are named.
"""

from __future__ import annotations

import contextlib
import math
import time
from typing import Callable, Iterator, List, Optional, Sequence

from rosclingo.errors import shorten
from rosclingo.wire.commands import Ground, Part, Restart, Truth
from rosclingo.wire.term_text import split_term
from rosoclingo.errors import LoopError, PlannerError
from rosoclingo.loop import beginning
from rosoclingo.loop.journal import Status
from rosoclingo.loop.planner.demand import step_parts
from rosoclingo.loop.state import State
from rosoclingo.loop.values.added import EMPTY_PARTS
from rosoclingo.loop.values.atoms import event, query
from rosoclingo.loop.values.goals import Goal

_SECONDS = 10.0  # how long it is looked for which goal cannot be reached, if all end anyway
_MOST_EVENTS = 50  # of which it is tried whether the program has an answer set without it
_MOST_TRIES = 3  # times that what comes from outside may end the search for the reason
ELSEWHERE = "; -c steps=N sets another, at the controller if there is one"
"""What may help if the last step is too early, as it is said after that."""

NO_PLAN = "no plan within the horizon"
"""Is said if there is none, whether or not because of the horizon."""


def end(state: State) -> None:
    """Looks why there is no plan within the maximal horizon.

    Returns normally if the loop may go on: because what contradicts the program was taken back, a
    goal that cannot be reached was given up, or something has come meanwhile.

    Raises:
        LoopError: There is nothing to be done; the message says why.
    """
    if state.planner.give_up_ahead():
        return
    state.tries += 1
    if mend_contradiction(state) or _is_called_away(state):
        return
    steps = max(state.externals.grounded, default=0)
    goals = state.goals.open
    state.environment.miss_plan(goals)
    if state.step and state.step >= steps:
        goals = goals or state.goals.queued
        late = f"; it is too late for {_requests(goals)}" if goals else ""
        raise LoopError(f"the mode ended after its last step, {steps}{late}{ELSEWHERE}")
    reason = f"the planner has {NO_PLAN} of {steps} steps"
    if not goals:
        raise LoopError(f"{reason}{ELSEWHERE}")
    for goal in goals:  # before the search for it, which may last
        goal.tell(f"{NO_PLAN} of {steps} steps: looking for the reason")
    lost = _unreachable(state, goals)
    if _is_called_away(state):
        return
    reason = f"{reason} for {_requests(lost or goals)}{ELSEWHERE}"
    if not (state.abort_unreachable and lost):
        raise LoopError(reason)
    state.environment.warn(f"{reason}; given up, as ~abort_unreachable says")
    state.externals.make_true([_cancel(state, goal) for goal in lost])
    for goal in lost:
        if not (goal.cancel_told or goal in state.mail.cancels):  # its client has given it up
            goal.given_up = reason
    state.tries = 0


def _is_called_away(state: State) -> bool:
    """Whether an input ends the diagnosis, as it may change everything; not again and again."""
    return state.mail.inbox.closed or (state.interrupted() and state.tries <= _MOST_TRIES)


def _unreachable(state: State, goals: List[Goal]) -> List[Goal]:
    """Returns the goals without which there is a plan, as few as are found in a while.

    The planner is told to cancel all, and then, in order, no longer to cancel one after the other,
    as long as there is a plan; in the end it is told to cancel none. Goals that are to be cancelled
    in this step anyway, and those that it cannot cancel, stay as they are.

    Returns:
        The goals; none if there is no plan without them either, or if that cannot be tried.
    """
    if state.planner.events_are_facts:
        return []
    due = math.inf if state.abort_unreachable else time.monotonic() + _SECONDS

    def stopped() -> bool:
        return time.monotonic() > due or _is_called_away(state)

    atoms = {_cancel(state, goal): goal for goal in goals}
    atoms = {atom: goal for atom, goal in atoms.items() if not state.externals.is_true(atom)}
    for atom, _ in state.planner.assign(list(atoms), Truth.TRUE):
        del atoms[atom]
    lost = dict(atoms)
    try:
        if not (lost and state.planner.has_answer_set(stopped)):
            return []
        for atom in atoms:
            if len(atoms) == 1:
                break
            state.planner.assign([atom], Truth.FALSE)
            if state.planner.has_answer_set(stopped):
                del lost[atom]
            else:
                state.planner.assign([atom], Truth.TRUE)
    finally:
        state.planner.assign(list(atoms), Truth.FALSE)
    return list(lost.values())


def _cancel(state: State, goal: Goal) -> str:
    return event(goal.slot or "", "cancel", state.step)


def mend_contradiction(state: State) -> bool:
    """Looks whether the program has no answer set although it is not asked for a plan.

    If what has come from outside is the cause, it is taken back: a goal ends aborted, a message is
    dropped, a cancel request has no effect. If it is what the robot has done, the planner begins
    again from the state before the current step, where the encoding declares how.

    Returns:
        Whether that was so.

    Raises:
        LoopError: The program has no answer set any more, and that cannot be mended.
    """
    with _unasked(state):
        if state.planner.has_answer_set(lambda: _is_called_away(state)) is not False:
            return False
        causes = _take_causes_back(state)
    if not causes:
        _begin_again(state)
    for atom in causes:
        reason = f"the program has no answer set with {shorten(atom)}, even without a goal"
        source, content, _ = split_term(atom)[1]
        own = state.goals.occupant(source)
        if own is None:
            state.mail.drop([(source, content, reason)])
        elif content == "cancel":
            state.environment.warn(f"{reason}: {shorten(own.request)} cannot be cancelled now")
        else:
            state.environment.warn(f"{reason}: {shorten(own.request)} is given up")
            state.goals.end(own, Status.ABORTED, reason)
    return True


def recover(state: State, err: PlannerError) -> None:
    """Looks whether the planner has failed because its program contradicts itself.

    Returns normally if it begins again.

    Raises:
        PlannerError: That is not so.
        LoopError: That is so, and the message says what is the cause.
    """
    for asked in (True, False):
        if not asked:
            state.planner.assign([query(state.horizon)], Truth.FALSE)
        if state.planner.has_answer_set(lambda: state.mail.inbox.closed) is not False:
            raise err
    _begin_again(state)


@contextlib.contextmanager
def _unasked(state: State) -> Iterator[None]:
    """A context in which no plan is asked for."""
    state.planner.assign([query(state.horizon)], Truth.FALSE)
    try:
        yield
    finally:
        state.planner.assign([query(state.horizon)], Truth.TRUE)


def _take_causes_back(state: State) -> List[str]:
    """Takes the events back without which the program has an answer set, as few as possible.

    Returns:
        These events; none if others are the cause.
    """
    if state.planner.events_are_facts:
        return []

    def is_consistent() -> bool:
        return state.planner.has_answer_set(lambda: state.mail.inbox.closed) is True

    taken: List[str] = []
    for atom in state.externals.from_outside()[: -_MOST_EVENTS - 1 : -1]:
        state.externals.take_back(atom)
        taken.insert(0, atom)
        if is_consistent():
            break
    else:
        state.externals.make_true(taken, from_outside=True)
        return []
    causes = []
    for atom in taken:
        state.externals.make_true([atom], from_outside=True)
        if not is_consistent():
            state.externals.take_back(atom)
            causes.append(atom)
    return causes


def _begin_again(state: State) -> None:
    """Re-initialises the planner with what it knew before its program became contradictory.

    Raises:
        LoopError: That is not possible.
    """
    told = shorten(", ".join(state.externals.told), 500)
    if beginning.can_begin_again(state):
        state.environment.warn(
            f"the program has no answer set any more, even without a goal, after {told or 'a step'}"
            f": the planner begins again with what it knew before step {state.step}"
        )
        beginning.begin_again(state)
        return
    part = _contradictory_part(state, lambda: state.mail.inbox.closed)
    if part is not None:
        raise LoopError(
            f"the program has no answer set even without a goal: {part} contradicts itself or what "
            "is grounded before it"
        )
    after = f"after {told}" if told else f"in step {state.step}"
    raise LoopError(f"the program has no answer set any more, even without a goal, {after}")


def _contradictory_part(state: State, stopped: Callable[[], bool]) -> Optional[str]:
    """Grounds step by step on a fresh solver, and returns the first part without an answer set.

    Returns:
        The parts of a step if that is the fault of none of them alone; None if nothing contradicts
        itself beyond the horizon of the last plan, which had an answer set.
    """
    steps = sorted(step for step in state.externals.grounded if step > state.planned)
    past = sorted(step for step in state.externals.grounded if step <= state.planned)

    def is_contradictory(parts: Sequence[Part]) -> bool:
        state.planner.run(Ground(tuple(parts)))
        return state.planner.has_answer_set(stopped) is False

    def begin() -> None:
        state.planner.run(Restart(), *EMPTY_PARTS)

    begin()
    if is_contradictory([Part("base")]):
        return None if past else "the part base"
    for step in past:
        is_contradictory(_parts(step))
    for number, step in enumerate(steps):
        if not is_contradictory(_parts(step)):
            continue
        guilty = []
        for suspect in _parts(step):
            begin()
            is_contradictory([Part("base")])
            for before in past + steps[:number]:
                is_contradictory(_parts(before))
            if not is_contradictory([part for part in _parts(step) if part != suspect]):
                guilty.append(f"{suspect.name}({step})")
        if len(guilty) == 1:
            return f"the part {guilty[0]}"
        names = ", ".join(f"{part.name}({step})" for part in _parts(step))
        return f"what is grounded in step {step}, {names},"
    return None


def _parts(step: int) -> List[Part]:
    return [part for part in step_parts(step) if step or part.name != "transition"]


def _requests(goals: Sequence[Goal]) -> str:
    return ", ".join(shorten(goal.request) for goal in goals)
