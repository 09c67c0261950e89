"""Why there is no plan: looks for the goal that cannot be reached, or for what contradicts itself.

An external event that was made true can be taken back, which is how it is found out what it does.
In the dialects in which events are facts that is not so: then all that may be the cause is named.
"""

from __future__ import annotations

import time
from typing import Callable, Iterable, List, Optional, Sequence

from rosclingo.commands import Ground, Part, Restart, Truth
from rosclingo.errors import shorten
from rosclingo.terms import parse_term
from rosoclingo.atoms import event
from rosoclingo.errors import LoopError, PlannerError
from rosoclingo.goals import Goal
from rosoclingo.solver import EMPTY_PARTS
from rosoclingo.state import State

_SECONDS = 10.0  # how long it is looked for which of several goals cannot be reached
_MOST_EVENTS = 50  # of which it is tried whether the program has an answer set without it
_ELSEWHERE = "-c steps=N sets another, at the controller if there is one"


def end(state: State) -> None:
    """Looks why there is no plan within the maximal horizon.

    Returns normally if the loop may go on: because an event that contradicts the program was taken
    back, a goal that cannot be reached was given up, or something has come meanwhile.

    Raises:
        LoopError: There is nothing to be done; the message says why.
    """
    if mend_contradiction(state) or state.interrupted():
        return
    steps = max(state.grounded, default=0)
    goals = state.goals.open
    if state.step and state.step >= steps:
        late = f"; it is too late for {_requests(goals)}" if goals else ""
        raise LoopError(f"the mode ended after its last step, {steps}{late}; {_ELSEWHERE}")
    reason = f"the planner has no plan within the horizon of {steps} steps"
    if not goals:
        raise LoopError(f"{reason}; {_ELSEWHERE}")
    lost = _unreachable(state, goals)
    if state.interrupted():
        return
    reason = f"{reason} for {_requests(lost or goals)}; {_ELSEWHERE}"
    if not (state.abort_unreachable and lost):
        raise LoopError(reason)
    state.outside.warn(f"{reason}; given up, as ~abort_unreachable says")
    for goal in lost:
        _give_up(state, goal, reason)


def _unreachable(state: State, goals: List[Goal]) -> List[Goal]:
    """Returns the goals without which there is a plan, as few as are found in a while.

    Returns:
        One goal, or all of them; none if there is no plan without them either.
    """
    due = time.monotonic() + _SECONDS

    def stopped() -> bool:
        return time.monotonic() > due or state.interrupted()

    latest_first = [[goal] for goal in reversed(goals)]
    for some in [*latest_first, goals] if len(goals) > 1 else latest_first:
        atoms = [event(goal.slot or "", "cancel", state.step) for goal in some]
        atoms = [atom for atom in atoms if not state.is_true(atom)]
        missing = {atom for atom, _ in state.planner.assign(atoms, Truth.TRUE)}
        has_plan = len(missing) < len(atoms) and state.planner.has_answer_set(stopped)
        state.planner.assign([atom for atom in atoms if atom not in missing], Truth.FALSE)
        if has_plan:
            return some
    return []


def _give_up(state: State, goal: Goal, reason: str) -> None:
    """Has the planner cancel a goal, which ends aborted then, or else at once."""
    goal.given_up = reason
    if state.make_true([event(goal.slot or "", "cancel", state.step)]):
        state.goals.end(goal, "aborted", reason)


def mend_contradiction(state: State) -> bool:
    """Looks whether the program has no answer set although it is not asked for a plan.

    If an event is the cause that can be taken back, then it is, and the goals end aborted that it
    concerns: its own one, or else all that have a slot, because the planner no longer knows what is
    the case.

    Returns:
        Whether that was so.

    Raises:
        LoopError: The program has no answer set any more, and that cannot be mended.
    """
    with _Unasked(state):
        if state.planner.has_answer_set(state.interrupted) is not False:
            return False
        cause = _cause(state)
    if cause is None:
        raise LoopError(_contradiction(state))
    reason = f"the program has no answer set with {shorten(cause)}, even without a goal"
    source, content, _ = map(str, parse_term(cause).arguments)
    own = state.goals.occupant(source)
    if own is not None:
        state.outside.warn(f"{reason}: the goal {shorten(own.request)} is given up")
        state.goals.end(own, "aborted", reason)
        for atom in state.events_of(source, own.request):
            state.take_back(atom)
        return True
    state.mail.drop([(source, content, f"{reason}; the open goals are given up")])
    for goal in state.goals.open:
        _give_up(state, goal, reason)
    return True


def explain(state: State, err: PlannerError) -> LoopError:
    """Returns why the planner has failed: maybe because its program contradicts itself."""
    if state.planner.has_answer_set(lambda: state.mail.inbox.closed) is not False:
        return err
    with _Unasked(state):
        if state.planner.has_answer_set(lambda: state.mail.inbox.closed) is not False:
            return err
    return LoopError(_contradiction(state))


class _Unasked:
    """A context in which no plan is asked for."""

    def __init__(self, state: State) -> None:
        self._state = state
        self._query = f"query({state.horizon})"

    def __enter__(self) -> None:
        self._state.planner.assign([self._query], Truth.FALSE)

    def __exit__(self, *_: object) -> None:
        self._state.planner.assign([self._query], Truth.TRUE)


def _cause(state: State) -> Optional[str]:
    """Returns the event without which the program has an answer set; it is false from now on."""
    for atom in reversed(state.told[-_MOST_EVENTS:]):
        state.take_back(atom)
        if state.planner.has_answer_set(lambda: state.mail.inbox.closed):
            return atom
        state.make_true([atom])
    return None


def _contradiction(state: State) -> str:
    """Says that the program has no answer set, and since when; the planner is of no use after."""
    told = state.told
    if state.has_planned and told:
        events = shorten(", ".join(told), 500)
        return f"the program has no answer set any more, even without a goal, after {events}"
    part = _contradictory_part(state, lambda: state.mail.inbox.closed)
    if part is not None:
        return (
            f"the program has no answer set even without a goal: the part {part} contradicts "
            "itself or what is grounded before it"
        )
    return f"the program has no answer set even without a goal, in step {state.step}"


def _contradictory_part(state: State, stopped: Callable[[], bool]) -> Optional[str]:
    """Grounds part by part on a fresh solver, and returns the first without an answer set."""
    planner = state.planner
    planner.run(Restart(), *EMPTY_PARTS)
    for part in _parts(sorted(state.grounded)):
        planner.run(Ground((part,)))
        if planner.has_answer_set(stopped) is False:
            arguments = f"({','.join(part.parameters)})" if part.parameters else ""
            return f"{part.name}{arguments}"
    return None


def _parts(steps: Sequence[int]) -> Iterable[Part]:
    yield Part("base")
    for step in steps:
        for name in ("state", "transition", "query"):
            if step or name != "transition":
                yield Part(name, (str(step),))


def _requests(goals: Sequence[Goal]) -> str:
    return ", ".join(shorten(goal.request) for goal in goals)
