"""Runs one search for a plan, and takes the plan or diagnoses why there is none."""

from __future__ import annotations

import contextlib
import time
from typing import ContextManager

from rosclingo.errors import shorten
from rosclingo.wire.commands import Outcome, Result, Truth
from rosoclingo.errors import PlannerError, ShutdownError
from rosoclingo.loop import diagnosis, statuses
from rosoclingo.loop.journal import PlanFound, Reason
from rosoclingo.loop.state import State
from rosoclingo.loop.values.added import HAS, SEEN
from rosoclingo.loop.values.atoms import Plan, query
from rosoclingo.loop.values.ids import why_no_actuator

_FIRST_DOUBT = 8  # searches without a plan, after which the program itself is looked at


def search(state: State) -> None:
    """Searches once for a plan; an input interrupts the search.

    Raises:
        PlannerError: The encoding hides what rosoclingo has to see.
        LoopError: The program has no answer set, whatever is asked for.
    """
    state.externals.release_now()
    if state.monitor.planning_since is None:  # planning may last for many searches
        state.monitor.planning_since = time.monotonic()
    is_known = state.planner.knows(state.horizon)
    with contextlib.nullcontext() if is_known else _marked(state):
        outcome = state.planner.search(state.step, state.horizon, state.interrupted)
    state.result = outcome.result
    if outcome.result is Result.UNKNOWN:
        state.mail.begin_attempt()
    if outcome.result is Result.SAT:
        _look(state, outcome)
        take_plan(state, Plan(outcome.symbols), is_best=not outcome.interrupted)
        if statuses.needs_next_step(state):
            state.result = Result.UNSAT  # no plan with this horizon serves the goals that wait
    elif outcome.result is Result.UNSAT and state.planner.needed is not None:
        state.failures = 0  # there is a plan, for a horizon farther away
    elif outcome.result is Result.UNSAT:
        state.failures += 1
        if _is_in_doubt(state) and diagnosis.mend_contradiction(state):
            state.result = None  # search again


def _marked(state: State) -> ContextManager[None]:
    return state.monitor.search(f"horizon {state.horizon}")


def settle(state: State, step: int) -> None:
    """Waits for the answers in the current step, and asks the planner for the fluents after it.

    Args:
        state: What is known.
        step: The current step, whose actions are published.

    Raises:
        ShutdownError: The node is shutting down, and it is not known what holds.
        PlannerError: The program has no answer set with the answers.
    """
    state.waiting.wait_for_answers()
    state.assign_answers(step)
    asked = query(state.horizon)
    is_asked = asked in state.externals.kept
    if is_asked:  # what holds does not depend on it, and there may be no plan
        state.planner.assign([asked], Truth.FALSE)
    with _marked(state):
        outcome = state.planner.search(
            step, state.horizon, lambda: state.mail.inbox.closed, looks_ahead=False
        )
        if state.planner.needed is not None:  # whatever horizon the plan needs
            outcome = state.planner.search(step, state.planner.needed, lambda: False)
    if outcome.result is Result.UNKNOWN:
        raise ShutdownError(Reason.SHUTDOWN)
    if outcome.result is Result.UNSAT:
        raise PlannerError(f"the program has no answer set after the answers in step {step}")
    take_plan(state, Plan(outcome.symbols), is_best=not outcome.interrupted)
    statuses.release(state)
    if is_asked:
        state.planner.assign([asked], Truth.TRUE)


def take_plan(state: State, plan: Plan, is_best: bool = True) -> None:
    """Takes a new plan.

    Args:
        state: What is known.
        plan: The plan.
        is_best: Whether the search was through, and did not end because of its time; what is
            known of its quality may say that a search before was not.

    Raises:
        PlannerError: It has an action for what cannot be an actuator.
    """
    if state.mail.dynamic:
        _look_at_actuators(state, plan)
    quality = state.planner.quality
    is_best = is_best if quality is None else quality.is_best
    state.plan, state.shows_plan = plan, True
    state.externals.told.clear()
    state.planned, state.tries, state.after_message = state.horizon, 0, False
    state.failures = 0
    state.monitor.planning_since = None
    state.note(PlanFound(tuple(map(str, state.ahead())), is_best, quality))
    if state.goals.alone and state.goals.waiting and state.goals.has_free_slot():
        state.mail.new_goals = True  # the next of those that are told one by one
    state.alarms.set(plan.alarms, state.environment.world_now())
    state.watchdog.look_soon()
    state.take_beliefs(plan.beliefs)
    state.goals.tell(f"plan {state.horizon} step{'' if state.horizon == 1 else 's'}")
    for slot, line in plan.feedback():
        goal = state.goals.occupant(slot)
        if goal is not None:
            goal.tell(line)
    state.timing.tell_clients()


def _look_at_actuators(state: State, plan: Plan) -> None:
    """Validates the ids of a plan's actuators, before any action is published.

    Raises:
        PlannerError: One cannot: its answer would be lost, and the step would never end.
    """
    for action in plan.actions_from(0):
        reason = why_no_actuator(action.actuator, state.goals.slots)
        if reason is not None:
            raise PlannerError(f"the plan has {shorten(str(action))}: {reason}")


def _is_in_doubt(state: State) -> bool:
    """Whether the program itself may be the reason why there is no plan.

    After a message, before the horizon grows because of it; and, twice as rarely each time, when it
    has grown for long.
    """
    after_message, state.after_message = state.after_message, False
    failures = state.failures
    return after_message or (failures >= _FIRST_DOUBT and not failures & (failures - 1))


def _look(state: State, outcome: Outcome) -> None:
    """Looks whether the encoding hides actions or statuses by ``#show``.

    Without them a goal would succeed though nothing is done, or would never end.

    Raises:
        PlannerError: It does.
    """
    for name, arity in SEEN.items():
        if name in state.visible or (name == "status" and not state.mail.dynamic):
            continue
        if any(symbol.startswith(f"{name}(") for symbol in outcome.symbols):
            state.visible.add(name)
        elif f"{HAS}({name})" in outcome.symbols:
            raise PlannerError(
                f"the planner's encoding hides {name}/{arity}, so that rosoclingo does not see "
                f"what it plans; add #show {name}/{arity}."
            )
