"""A monitored run of ``plan.py``.

>>> from rosoclingo.in_process.parts import EXAMPLES
>>> run = Runner().run((f"{EXAMPLES}/line.lp", "--simulate", "--goal", "visit(3)"))
>>> [(plan.elapsed, plan.length) for plan in run.plans]
[(0, 2), (1, 1), (2, 0)]
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from typing import Any, Callable, Dict, FrozenSet, List, Mapping, Optional, Tuple

from rosclingo.errors import RosclingoError
from rosoclingo.in_process.inputs import MESSAGE
from rosoclingo.in_process.parts import Parts, make_parts
from rosoclingo.in_process.simulation import SimulatedSystem
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Event, Status
from rosoclingo.loop.loop import Loop
from rosoclingo.loop.values.atoms import Action, event
from rosoclingo.loop.words import BUSY, SUCCESS
from rosoclingo.tools.check.findings import Words
from rosoclingo.tools.plan.command_line import parse, simulated

_SHARE = 0.1  # of the time for all runs, which one may take

DOES = "does"
"""The kind of those entries of ``CheckedRun.heard`` that are published actions."""


@dataclass(frozen=True)
class FoundPlan:
    """A plan when it was found, with the state of the run at that moment.

    Attributes:
        elapsed: The current step, counted from the beginning.
        step: The same, counted from the last reset.
        actions: All its actions, those of steps that have gone by too.
        published: The actions that were published since the last reset, and those that repeat
            actions that go on.
        has_barrier: Whether each step waits for all who act in it.
        is_layered: Whether its steps come of layers, so that there may be a shorter one.
        statuses: Slot, word and step of each status from the current step on.
        fluents: What holds after the current step, as far as the encoding shows it.
        slots: The goal in each slot that has one, by its number.
        told: The step of each goal that the planner was told now, by their numbers.
        active: The goals that are accepted and have not ended, by their numbers.
        over: The goals that have ended, by their numbers.
        cancelled: The goals for which a cancel request has come, by their numbers.
        heard: What has come from outside and what was done until then, but for answers ``success``.
        successes: How many of these had come.
    """

    elapsed: int
    step: int
    actions: Tuple[Action, ...]
    published: FrozenSet[Action]
    has_barrier: bool
    is_layered: bool
    statuses: Tuple[Tuple[str, str, int], ...]
    fluents: FrozenSet[str]
    slots: Mapping[str, str]
    told: Mapping[str, int]
    active: FrozenSet[str]
    over: FrozenSet[str]
    cancelled: FrozenSet[str]
    heard: Tuple[Tuple[str, ...], ...]
    successes: int

    @property
    def ahead(self) -> List[Action]:
        """Its actions after the current step."""
        return [action for action in self.actions if action.step > self.step]

    @property
    def length(self) -> int:
        """How many steps it takes after the current one."""
        return max((action.step for action in self.ahead), default=self.step) - self.step


class CheckedRun(SimulatedSystem):
    """A simulation with a deadline that remembers each plan that was found.

    Attributes:
        words: The command line.
        plans: The plans that were found, in order.
        asked: The goals for which a cancel request has come, by their numbers.
        heard: As in :class:`FoundPlan`.
        failure: Why the loop has ended by itself; None if it has not.
        is_cut: Whether it has ended because of its time, so that nothing follows from its end.
    """

    def __init__(
        self,
        make: Callable[..., Loop],
        words: Words,
        chosen: argparse.Namespace,
        end: float = float("inf"),
    ) -> None:
        """Makes the loop.

        Args:
            make: As of a simulation.
            words: The command line.
            chosen: The same, as it was read.
            end: When it has to end, by the monotonic clock.
        """
        self.words = words
        self.is_cut = False
        self.failure: Optional[RosclingoError] = None
        self._end_of_time = end
        self.plans: List[FoundPlan] = []
        self.asked: List[str] = []
        self.heard: List[Tuple[str, ...]] = []
        self._successes = 0
        self._done: List[Action] = []  # since the last reset
        super().__init__(make, **simulated(chosen))

    @property
    def steps(self) -> int:
        """The step in which the last action was done, counted from the start."""
        return max((int(one[-1]) for one in self.heard if one[0] == DOES), default=0)

    @property
    def is_smooth(self) -> bool:
        """True if all actions have succeeded, and only goals and cancel requests have come."""
        return all(
            not isinstance(entry.event, journal.MessageArrived) or entry.event.value == SUCCESS
            for entry in self.journal
        )

    @property
    def events(self) -> List[Event]:
        """The journal's events."""
        return [entry.event for entry in self.journal]

    @property
    def closed(self) -> bool:
        """True if the run has to end, also because its time is up; long operations poll this."""
        self.is_cut = self.is_cut or time.monotonic() > self._end_of_time
        return self.is_cut or super().closed

    def note(self, record: journal.Record) -> None:
        """Records each plan, with the state of the run when it was found."""
        super().note(record)
        happened = record.event
        if isinstance(happened, journal.PlanFound):
            self._on_plan()
        elif isinstance(happened, journal.ActionPublished):
            self._done.append(Action(happened.actuator, happened.action, record.step))
            self.heard.append((DOES, happened.actuator, happened.action, str(self.elapsed)))
        elif isinstance(happened, journal.GoalArrived):
            self.heard.append(("goal", happened.request, str(self.elapsed)))
        elif isinstance(happened, journal.CancelArrived):
            self.asked.append(happened.goal)
            self.heard.append(("cancel", happened.goal, str(self.elapsed)))
        elif isinstance(happened, journal.MessageArrived):
            if happened.value == SUCCESS:
                self._successes += 1
            else:
                self.heard.append((MESSAGE, happened.source, happened.value, str(self.elapsed)))
        elif isinstance(happened, journal.CommandDone) and happened.resets_to is not None:
            self._done.clear()

    def _on_plan(self) -> None:
        state = self.loop.state
        step, plan = state.step, state.plan
        last = max(step, state.horizon)
        ended = frozenset(goal.id for goal in self.goals if goal.ended)
        slots = {goal.slot: goal.id for goal in self.goals if goal.slot is not None}
        told = {
            number: at
            for slot, number in slots.items()
            for at in (step, step + 1)  # one node has no step 0
            if state.externals.is_true(event(slot, self.goals[int(number) - 1].request, at))
        }
        statuses = (
            (slot, word, at) for at in range(step, last + 1) for slot, word in plan.statuses(at)
        )
        actions = tuple(a for a in plan.actions_from(0) if a.step <= last)
        self.plans.append(
            FoundPlan(
                elapsed=self.elapsed,
                step=step,
                actions=actions,
                published=frozenset(
                    [*self._done, *state.executions.published.intersection(actions)]
                ),
                has_barrier=not any(state.externals.declares(a.actuator, BUSY) for a in actions),
                is_layered=state.planner.demand.has_layers,
                statuses=tuple(statuses),
                fluents=frozenset(plan.fluents(step)),
                slots=slots,
                told=told,
                active=frozenset(g.id for g in self.goals if g.status is Status.ACCEPTED),
                over=ended,
                cancelled=frozenset(self.asked),
                heard=tuple(self.heard),
                successes=self._successes,
            )
        )


@dataclass(frozen=True)
class SlowRun:
    """The slowest run, for the hint ``slow``.

    Attributes:
        seconds: How long it took.
        words: The command line.
        place: Where it was ended, since it took too long; empty if it was not.
    """

    seconds: float
    words: Words
    place: str

    def __str__(self) -> str:
        took = f"{self.seconds:.1f} s"
        if self.place:
            return f"this run was ended after {took}, {self.place}"
        return f"this run took {took}, longer than all others"


class Runner:
    """Makes runs within a time budget; runs with the same files and options share solvers.

    Attributes:
        commands: The arguments of the runs, in order.
        slowest: The run that took longest so far.
    """

    def __init__(self, seconds: float = 0.0) -> None:
        """Starts the time budget.

        Args:
            seconds: How long all runs may take together, each of them a tenth of that; 0 for as
                long as they take.
        """
        self._parts: Dict[Any, Parts] = {}
        self.commands: List[Words] = []
        self.slowest: Optional[SlowRun] = None
        self._seconds = seconds or float("inf")
        self._end = time.monotonic() + self._seconds

    @property
    def is_over(self) -> bool:
        """True if the time budget is used up, so that a run would be cut at once."""
        return time.monotonic() > self._end

    def run(self, words: Words) -> CheckedRun:
        """Runs ``plan.py`` with some arguments, and monitors it.

        Args:
            words: The arguments; ``--simulate`` is one of them.

        Raises:
            RosclingoError: A file or an argument is wrong.
        """
        if not self.is_over:
            self.commands.append(words)
        chosen = parse(words)
        key = (chosen.mode, chosen.options, tuple(chosen.mode_options))
        if key not in self._parts:
            self._parts[key] = make_parts(chosen.mode, chosen.options, chosen.mode_options)
        began = time.monotonic()
        end = min(self._end, began + self._seconds * _SHARE)
        run = CheckedRun(self._parts[key].loop, words, chosen, end)
        run.failure = run.run()
        seconds = time.monotonic() - began
        if self.slowest is None or seconds > self.slowest.seconds:
            state = run.loop.state
            place = f"in step {state.step}, at horizon {state.horizon}" if run.is_cut else ""
            self.slowest = SlowRun(seconds, words, place)
        if not run.is_cut:
            run.take_situation(run.failure)
        return run
