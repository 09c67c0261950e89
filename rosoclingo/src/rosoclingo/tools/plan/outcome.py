"""The outcome of planning, as values: the plan, the goals, and why something was not reached."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, List, Optional, Sequence, Tuple

from rosclingo.errors import RosclingoError
from rosoclingo.in_process.simulation import SimulatedSystem
from rosoclingo.in_process.system import Request
from rosoclingo.loop import journal
from rosoclingo.loop.values.atoms import Action

DROPPED = "dropped a message: "
TIME_IS_UP = (
    "has used up its time, and nothing excludes a plan; -t N searches with more threads, and in a "
    "running system it is looked for with more and more time"
)
"""Is said of goals for which no plan was found, though none was refuted."""


@dataclass(frozen=True)
class ShownPlan:
    """A plan as it was found.

    Attributes:
        actions: Its actions, ordered by step.
        horizon: The step at which all is done.
        searches: How many searches it took.
        seconds: How long these took, in seconds of wall time.
        succeeds: For each goal that succeeds by the plan, or has succeeded, in which step.
        slots: For each goal that has a slot, by its number, the slot.
    """

    actions: Tuple[Action, ...]
    horizon: int
    searches: int
    seconds: float
    succeeds: Dict[str, int]
    slots: Dict[str, str]

    @property
    def steps(self) -> Dict[int, List[Action]]:
        """The actions of each step that has some."""
        steps: Dict[int, List[Action]] = {}
        for action in self.actions:
            steps.setdefault(action.step, []).append(action)
        return steps


def current_plan(simulation: SimulatedSystem) -> Optional[ShownPlan]:
    """Returns the plan that stands now, if there is one, from its first step on."""
    state = simulation.loop.state
    if not state.shows_plan:
        return None
    searches = [
        entry.event
        for entry in simulation.journal
        if isinstance(entry.event, journal.CommandDone) and entry.event.is_search
    ]
    # A slot may have had other goals before.
    planned: Dict[str, int] = {}
    for step in range(state.horizon, state.step - 1, -1):
        for slot, word in state.plan.statuses(step):
            if word == journal.Status.SUCCEEDED:
                planned[slot] = step
    succeeds = {
        entry.event.goal: entry.step
        for entry in simulation.journal
        if isinstance(entry.event, journal.StatusSet)
        and entry.event.status is journal.Status.SUCCEEDED
    }
    for goal in simulation.goals:
        if not goal.ended and goal.slot in planned:
            succeeds[goal.id] = planned[goal.slot]
    return ShownPlan(
        tuple(a for a in state.plan.actions_from(0) if a.step <= state.horizon),
        state.horizon,
        len(searches),
        sum(search.seconds for search in searches),
        succeeds,
        {goal.id: goal.slot for goal in simulation.goals if goal.slot is not None},
    )


def unreached(simulation: SimulatedSystem, plan: Optional[ShownPlan]) -> List[Request]:
    """Returns the open goals that a plan does not reach.

    That is known if it says of some goal that it succeeds, or if it has no actions; an encoding may
    also say so only when all is done.
    """
    open_goals = [goal for goal in simulation.goals if not goal.ended]
    if plan is None:
        return open_goals
    if not plan.succeeds and plan.actions:
        return []
    return [g for g in open_goals if g.id in plan.slots and g.id not in plan.succeeds]


def refused(simulation: SimulatedSystem, failure: Optional[RosclingoError]) -> List[str]:
    """Returns the inputs that the loop has not taken, in words.

    Args:
        simulation: The run.
        failure: Why the loop ended by itself, if it did; what came after that is not told.
    """
    said = list(simulation.strange)
    is_over = failure is None and not simulation.is_too_long
    for one in simulation.left if is_over else ():
        waits = f"after {simulation.commands} commands, nothing was left to do"
        said.append(f"--at {one.moment} {one}: did not come; {waits}")
    for entry in simulation.journal:
        event = entry.event
        if isinstance(event, journal.MessageDropped):
            said.append(f"{DROPPED}{event.reason}")
        elif isinstance(event, journal.StatusSet) and event.status is journal.Status.REJECTED:
            if event.reason == str(failure):
                continue
            goal = simulation.goals[int(event.goal) - 1]
            said.append(f"rejected the goal {goal.request}: {event.reason}")
    return said


def reasons(
    simulation: SimulatedSystem, lost: Sequence[Request], failure: Optional[RosclingoError]
) -> List[str]:
    """Returns why goals were not reached, in sentences; none if all is well.

    All that is said about that is said here.

    Args:
        simulation: The run.
        lost: The goals that were not reached.
        failure: Why the loop ended by itself, if it did.
    """
    said = [] if failure is None else [str(failure)]
    requests = ", ".join(goal.request for goal in lost)
    if simulation.is_too_long:
        without = f" without {requests}" if lost else ""
        said.append(f"ended{without} after {simulation.elapsed} steps, as --most-steps says")
    ended = [goal for goal in simulation.goals if goal.status is journal.Status.ABORTED]
    said += [f"{g.request} was aborted: {g.reason}" for g in ended if g.reason != str(failure)]
    if failure is None and lost and not simulation.is_too_long:
        horizon = simulation.loop.state.horizon
        why = f"the plan has no action for it, with a horizon of {horizon} steps"
        if simulation.silent:
            why = f"{', '.join(simulation.silent)} never answers"
        elif simulation.loop.state.planner.is_short:
            why = f"planning {TIME_IS_UP}"
        said.append(f"{requests}: not reached; {why}")
    return said
