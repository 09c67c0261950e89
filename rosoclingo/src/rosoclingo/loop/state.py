"""The state of a run between two commands, and the operations of commands on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Dict, Iterable, List, Mapping, Optional, Sequence, Set, Tuple

from rosclingo.errors import OutOfMemoryError
from rosoclingo.loop import journal
from rosoclingo.loop.believing import BeliefKeeper
from rosoclingo.loop.execution.alarms import Alarms
from rosoclingo.loop.execution.durations import Durations
from rosoclingo.loop.execution.executions import Executions, ExecutionsState
from rosoclingo.loop.execution.heartbeats import Heartbeats
from rosoclingo.loop.execution.interlock import Interlock, InterlockState
from rosoclingo.loop.execution.policies import ActionPolicies
from rosoclingo.loop.execution.progress import Progress
from rosoclingo.loop.execution.timing import Timing
from rosoclingo.loop.execution.watchdog import ExecutionWatchdog
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.mail import Mail, MailSnapshot
from rosoclingo.loop.monitor import LoopMonitor, LoopSummary
from rosoclingo.loop.planner.externals import ExternalsState, PlannerExternals
from rosoclingo.loop.planner.planner import Planner, PlannerState
from rosoclingo.loop.values.atoms import Action, event
from rosoclingo.loop.values.beliefs import Beliefs
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.execution import (
    Execution,
    HeldAction,
    HoldReason,
    OperatorState,
    RejectedAction,
)
from rosoclingo.loop.values.goals import Goal, GoalClient, Goals, GoalsSnapshot
from rosoclingo.loop.values.served import ServedGoals
from rosoclingo.loop.values.snapshot import take_over
from rosoclingo.loop.waiting import Waiting
from rosoclingo.loop.words import BUSY, GIVEN_UP, INFO, INTERRUPTED, TRIES

_ASKED = (HoldReason.APPROVAL, HoldReason.HOLD, HoldReason.PAUSE)  # what waits for an operator
ASK_AGAIN_SECONDS = 60.0
"""By default, when an operator is asked again about an action that was rejected."""


@dataclass(frozen=True)
class StateSnapshot:
    """Saved state of a :class:`State`.

    Attributes:
        reminded: Whether the controller has been told that goals wait for the next step.
    """

    progress: Progress
    planner: PlannerState
    externals: ExternalsState
    goals: GoalsSnapshot
    executions: ExecutionsState
    interlock: InterlockState
    mail: MailSnapshot
    durations: Durations
    alarms: Alarms
    beliefs: BeliefKeeper
    reminded: bool


class State(Progress):
    """The state of a run, with the operations of commands on it.

    Used by the loop's thread, and by the callback that polls whether its search is to stop.

    Attributes:
        planner: The planner.
        externals: What is known of the planner's externals.
        goals: The goals.
        executions: What each actuator does, has answered, and was told before.
        served: The goals for which they are done.
        interlock: Which actions may be dispatched.
        policies: How actions are treated that fail or take too long.
        heartbeats: What their interfaces say meanwhile.
        mail: What has come from outside.
        durations: How long actions have taken.
        alarms: Which messages the encoding is to be told later.
        beliefs: What is believed to be the causes of what was observed.
        timing: What follows from that.
        watchdog: Looks after the actions that are executed.
        waiting: How it is waited for what comes.
        monitor: What other threads may know of the loop.
        begin_mode: Has the mode begin again, so that it initialises the planner next.
        environment: Where actions and log messages go.
        abort_unreachable: Whether a goal without a plan ends alone, and not all with the loop.
        ask_again: After how many seconds an operator is asked again about an action that was
            rejected, if nothing has changed before.
        serves_all: Whether each plan serves all goals, so that it does not say when they end.
    """

    serves_all = False

    def __init__(
        self,
        planner: Planner,
        inbox: Inbox,
        environment: Environment,
        check: Callable[[], None] = lambda: None,
        begin_mode: Callable[[], None] = lambda: None,
        *,
        control: Callable[[journal.ControlArrived, float], bool] = lambda *_: False,
        fail: Callable[[Execution, str], Optional[str]] = lambda _, answer: answer,
        action_timeout: float = 0.0,
        abort_unreachable: bool = False,
        ask_before: Sequence[str] = (),
        ask_again: float = ASK_AGAIN_SECONDS,
        policies: Optional[Mapping[str, Mapping[str, object]]] = None,
    ) -> None:
        """Begins without any knowledge.

        Args:
            planner: The planner.
            inbox: Where messages, goals and cancel requests come in.
            environment: Where actions and log messages go.
            check: Called now and then while waiting; raises an error if a solver went away.
            begin_mode: Has the mode begin again, so that it initialises the planner next.
            control: Does what an operator wants, who has said so when the command that is
                carried out had taken some seconds; returns whether that is news for the mode.
            fail: Returns what the planner is told of an answer; None if the action is retried.
            action_timeout: When an action without an answer times out, in seconds since
                it was published; 0 for never.
            abort_unreachable: Whether a goal without a plan ends alone, and not all with the loop.
            ask_before: Patterns of the actions that need an approval, see :class:`.Interlock`.
            ask_again: After how many seconds an operator is asked again about what was rejected.
            policies: How actions are treated, by patterns, see :class:`.ActionPolicies`.
        """
        super().__init__()
        self.served = ServedGoals()
        self.interlock = Interlock(ask_before)
        self.policies = ActionPolicies(policies or {})
        self.heartbeats = Heartbeats(environment.now)
        self.abort_unreachable = abort_unreachable
        self.ask_again = ask_again
        self.begin_mode = begin_mode
        self.monitor = LoopMonitor()
        self.planner = planner
        self.environment = environment
        self.externals = PlannerExternals(planner)
        self.goals = Goals()
        self.executions = Executions(
            environment, lambda actuator: self.externals.declares(actuator, BUSY)
        )
        self._shown: Tuple[object, ...] = ()
        self._held: Tuple[object, ...] = ()
        self._timed_out: Set[str] = set()  # who has answered nothing since then
        self._fail = fail
        planner.recorded, planner.note = inbox.recorded, self.note
        planner.missing = self._warn_of_missing
        planner.warn_of_search(lambda text: self.warn_once("search", text))
        planner.warn_of_plans(lambda text: self.warn_once("plan", text))
        planner.know_ages(lambda: self.goals.ages(environment.world_now()))
        self.durations = Durations()
        self.alarms = Alarms()
        self.beliefs = BeliefKeeper()
        self.timing = Timing(
            self.durations,
            self.alarms,
            progress=self,
            goals=self.goals,
            externals=self.externals,
            executions=self.executions,
            recorded=inbox.recorded,
            environment=environment,
            note=self.note,
        )
        self.mail = Mail(
            inbox,
            self.goals,
            self.externals,
            self.executions,
            progress=self,
            environment=environment,
            note=self.note,
            answered=self.timing.end_action,
            controlled=control,
            fail=self._take_answer,
        )
        self.watchdog = ExecutionWatchdog(
            inbox,
            self.executions,
            policies=self.policies,
            durations=self.durations,
            heartbeats=self.heartbeats,
            alarms=self.alarms,
            environment=environment,
            tell=self.goals.tell,
            action_timeout=action_timeout,
        )
        self.waiting = Waiting(
            self.mail,
            self.executions,
            self.goals,
            environment,
            self.note,
            monitor=self.monitor,
            polled=self.poll,
            correct=self._correct_arrivals,
            check=check,
            watchdog=self.watchdog,
            is_short=lambda: self.planner.is_short,
        )

    def snapshot(self) -> StateSnapshot:
        """Returns the state to save, which is to be encoded before the next decision."""
        return StateSnapshot(
            self,
            self.planner,
            self.externals,
            self.goals.snapshot(self.mail.goals_spoken_of),
            self.executions.snapshot(),
            self.interlock,
            self.mail.snapshot(),
            self.durations,
            self.alarms,
            self.beliefs,
            self.waiting.reminded,
        )

    def restore(self, saved: StateSnapshot, client: Callable[[str], GoalClient]) -> Dict[str, Goal]:
        """Goes on where a run was interrupted, with a planner that is as it was then.

        Args:
            saved: What was known.
            client: Returns who has sent a goal, by its id.

        Returns:
            All goals, by their ids.
        """
        take_over(self, saved.progress)
        take_over(self.planner, saved.planner)
        goals = self.goals.restore(saved.goals, client)
        self.externals.restore(saved.externals, self.goals.slots)
        take_over(self.executions, saved.executions)
        self.executions.restore()
        take_over(self.interlock, saved.interlock)
        self.mail.restore(saved.mail, goals)
        take_over(self.durations, saved.durations)
        take_over(self.alarms, saved.alarms)
        take_over(self.beliefs, saved.beliefs)
        self.waiting.reminded = saved.reminded
        self.show_executions(again=True)
        if self.beliefs.is_shown:
            self._show_beliefs()
        return goals

    @property
    def needed_horizon(self) -> Optional[int]:
        """The horizon that the plan needs, if that is beyond the requested one."""
        needed = self.planner.needed
        return needed if needed is not None and needed > self.horizon else None

    def warn_once(self, kind: str, text: str) -> None:
        """Logs a warning, but only the first of its kind."""
        if not self.has_warned(kind):
            self._warned.add(kind)
            self.environment.warn(text)

    def _warn_of_missing(self, external: str) -> None:
        self.warn_once(
            f"external {external}",
            f"the mode makes {external} true or free, and there is no such external, or it was "
            "released: nothing happens, as in clingo; this is said once",
        )

    def note(self, event: journal.Event) -> None:
        """Adds an event to the journal. Thread-safe."""
        self.environment.note(journal.Record(event, self.step, self.horizon))

    # What comes from outside.

    def poll(self) -> None:
        """Makes a summary of the state if one is wanted; called when inputs are taken."""
        if self.monitor.is_wanted:
            self.monitor.is_wanted = False
            self.monitor.summary = self.summarize()

    def summarize(self) -> LoopSummary:
        """Returns what other threads may know of the state."""
        is_paused, on_hold, held, _ = self._decided_by_operator
        mail, executions = self.mail, self.executions
        return LoopSummary(
            time=self.environment.now(),
            step=self.step,
            horizon=self.horizon,
            is_through=self.ended,
            goals_open=len(self.goals.open),
            goals_waiting=len(self.goals.queued) + mail.inbox.backlog,
            goals_unserved=self._count_unserved(),
            untold=len(mail.messages) + len(mail.cancels),
            is_paused=is_paused,
            on_hold=on_hold,
            held=held,
            timed_out=frozenset(self._timed_out),
            run=executions.run,
            executions=tuple(executions.ordered),
        )

    def _count_unserved(self) -> int:
        """Counts the goals with a slot that the plan does not serve, as when their way is blocked.

        What is planned for a goal ends it, by a status, or is said to serve it.
        """
        step = min([self.step, *self.held])
        if self.serves_all:
            acts = self.executions.is_awaited or self.plan.actions_from(step)
            return 0 if acts else len(self.goals.open)
        ends = {
            slot
            for slot, word in self.plan.statuses_from(step)
            if word in journal.TERMINAL_STATUSES
        }
        ends |= {slot for slot, action in self.plan.serving.items() if action.step >= step}
        return sum(goal.slot not in ends for goal in self.goals.open)

    def _take_answer(self, one: Execution, answer: str) -> Optional[str]:
        """Notes whose answers are missing; returns what the planner is told, if anything."""
        if answer in GIVEN_UP:
            self._timed_out.add(one.actuator)
        else:
            self._timed_out.discard(one.actuator)
        return self._fail(one, answer)

    def interrupted(self) -> bool:
        """Returns whether an input has to end the search; gives feedback now and then that it runs.

        In a replay, all inputs of a command have come before it begins: they end no search before
        the recorded outcomes of the command have been taken.
        """
        self.waiting.tell_progress(self.horizon, self.planner.last_horizon)
        self.watchdog.look()
        self.mail.take(controls=False)  # the planner cannot be asked
        self.poll()
        self.mail.tell_waiting()
        inbox = self.mail.inbox
        is_due = inbox.recorded.is_search_due(improves=False)
        return inbox.closed or (self.mail.has_news and not is_due)

    def finish(self, reason: str) -> None:
        """Ends the work: goals that are open or still to come are told why."""
        self.ended = True
        self.mail.refuse(self.mail.rejection or reason)
        self.goals.abort_all(reason)

    # What the commands do.

    def assign_messages(self, step: int) -> bool:
        """Makes the events of all messages, cancel requests and goals with a slot true.

        Returns:
            Whether a cancel request was among them.
        """
        self.mail.begin_attempt()
        is_grounded = step in self.externals.grounded or self.planner.demand.tells
        if not is_grounded:
            self.warn_once(
                "not grounded",
                f"the mode gave assign_messages({step}), and step {step} is not grounded: the "
                f"planner knows no event of it; ground({step}) has to come before",
            )
        self._assign_pending_messages(step)
        is_cancelled = False
        cancels = self.mail.take_cancels()
        while cancels:
            goal = cancels.pop(0)
            self.executions.forget_rejections()
            # Its slot may be another's by now.
            if goal.slot is not None and self.goals.is_open(goal):
                cancel = [event(goal.slot, "cancel", step)]
                try:
                    missing = self.externals.make_true(cancel, from_outside=True)
                except OutOfMemoryError:
                    goal.cancel_told = True
                    self.mail.cancels = [*cancels, *self.mail.cancels]
                    raise
                goal.cancel_told |= not missing  # and stays so
                is_cancelled |= not missing
                for _, reason in missing:
                    self.environment.warn(f"the goal {goal.request} cannot be cancelled: {reason}")
        has_placed = False
        while self.goals.waiting and self.goals.has_free_slot():
            has_placed = True
            self.executions.forget_rejections()
            placed = self.goals.place()
            while placed:
                slot, goal = placed.pop(0)
                try:
                    missing = self.externals.make_true(
                        [event(slot, goal.request, step)], from_outside=True
                    )
                except OutOfMemoryError:
                    self.externals.note_told(
                        [event(other, later.request, step) for other, later in placed],
                        from_outside=True,
                    )
                    raise
                if missing:
                    self.externals.read()
                    reason = f"the mode tells it in step {step}, which is not grounded"
                    if is_grounded:
                        reason = self.mail.explain(slot, goal.request, step)
                    self.goals.end(goal, journal.Status.REJECTED, reason)
                    self.goals.remove(goal)
            if self.goals.alone:
                self.goals.alone -= 1
                break
        self.timing.tell_planner(step)
        self.goals.tell_positions()
        self._tell_busy(step)
        if has_placed or self.plan.uses_clock:
            self.timing.tell_clock(step)
        return is_cancelled

    def assign_answers(self, step: int) -> None:
        """Ends the step: makes the events of all messages true, and says who is busy."""
        self._assign_pending_messages(step)
        self._tell_busy(step)
        if self.plan.uses_clock:
            self.timing.tell_clock(step)

    def _tell_busy(self, step: int) -> None:
        """Says who is busy if the step is over, or if it can end for the news."""
        executions = self.executions
        if executions.is_over:
            self.externals.make_true(executions.end_step(step))
        elif (
            executions.is_awaited
            and executions.can_all_act_on
            and self.externals.declares(INFO, INTERRUPTED)
        ):
            busy = executions.end_step(step)
            self.externals.make_true([event(INFO, INTERRUPTED, step), *busy])

    def _assign_pending_messages(self, step: int) -> None:
        messages = self.mail.take_messages(step)
        new = {atom: pair for atom, pair in messages.items() if not self.externals.is_true(atom)}
        answers = [atom for atom, (source, _) in new.items() if self.executions.acting(source)]
        others = [atom for atom in new if atom not in answers]
        self.after_message |= bool(others)
        if others:
            self.executions.forget_rejections()
        missing = self.externals.make_true(answers) + self.externals.make_true(
            others, from_outside=True
        )
        if missing:
            self.externals.read()  # by which the mail says what may have been meant
        self.mail.drop([(*new[atom], reason) for atom, reason in missing])
        self._tell_tries(step, {new[atom][0] for atom in answers})

    def _tell_tries(self, step: int, actuators: Iterable[str]) -> None:
        """Tells how often actuators have tried what they answer for, if an encoding counts that."""
        tries = [
            f"{TRIES}({actuator},{one.attempt})"
            for actuator in sorted(actuators)
            for one in [self.executions.acting(actuator)]
            if one is not None and one.attempt > 1
        ]
        known = [content for content in tries if self.externals.declares(INFO, content)]
        self.externals.make_true([event(INFO, content, step) for content in known])

    def move_to(self, step: int) -> List[str]:
        """Makes a step the current one.

        Returns:
            The externals that are to be true because of that.
        """
        if step == self.step:
            return []
        busy = self.executions.end_step(self.step)
        answers = self.executions.begin_step()
        self.mail.messages += [pair for pair in answers if self.externals.knows([pair])]
        self.free_slots()
        gone = range(self.step, step)
        self.step = step
        tells = self.externals.declares("info", "passed")
        return [*busy, *(event("info", "passed", past) for past in gone if tells)]

    def free_slots(self) -> None:
        """Frees the slots of ended goals, as a step begins."""
        self.waiting.reminded = False
        self.goals.free_slots()
        if self.goals.waiting and self.goals.has_free_slot():
            self.mail.new_goals = True

    def show_executions(self, *, again: bool = False) -> None:
        """Publishes each actuator's last action and the held ones, if they are new, or again."""
        executions = self.executions
        if executions.changed or again:
            executions.changed = False
            served = self.served.update(executions.dispatched, self.goals, is_resumed=again)
            self.environment.show_served(executions.run, executions.number, served)
            self.environment.show_executions(executions.run, executions.dispatched)
        self.show_held(again=again)

    def warn_of_approvals(self) -> None:
        """Warns that no approval is requested in a static mode, which publishes a whole plan."""
        if self.interlock.asks:
            self.environment.warn(
                "~ask_before: no operator is asked to approve an action: the mode is static, "
                "and publishes a whole plan; take a dynamic mode"
            )

    @property
    def _decided_by_operator(self) -> OperatorState:
        """An operator's decisions, and the actions that wait for one."""
        interlock = self.interlock
        waiting = tuple(
            HeldAction(one.actuator, one.action, reason, one.number)
            for one in self.executions.held
            for reason in [self.hold_reason(one)]
            if reason is not None
        )
        rejected = tuple(
            RejectedAction(actuator, action, self._planned_for(actuator))
            for actuator, action in self.executions.rejected
        )
        return OperatorState(
            interlock.is_paused, tuple(sorted(interlock.on_hold)), waiting, rejected
        )

    def _planned_for(self, actuator: str) -> Optional[Action]:
        """Returns what an actuator is to do next, or does, by the plan that stands."""
        one = self.executions.acting(actuator)
        is_over = one is not None and not one.is_open
        return next(
            (
                action
                for action in self.ahead()
                if action.actuator == actuator and not (is_over and action.step <= self.step)
            ),
            None,
        )

    def held_sentences(self) -> List[str]:
        """Returns what an operator holds, a sentence each."""
        is_paused, on_hold, waiting, _ = self._decided_by_operator
        return [
            *(["The run is paused."] if is_paused else []),
            *(f"{actuator} is on hold." for actuator in on_hold),
            *(
                f"{one.action} of {one.actuator} waits for an approval."
                for one in waiting
                if one.reason is HoldReason.APPROVAL
            ),
        ]

    def show_held(self, *, again: bool = False) -> None:
        """Publishes whether the run is paused, and which actions are held, if new, or again."""
        held = self._decided_by_operator
        if held == self._held and not again:
            return
        self._held = held
        self.environment.show_held(held)
        asked = [one for one in held.held if one.reason in _ASKED]
        if asked:
            said = ", ".join(f"{one.actuator} {one.action} ({one.reason})" for one in asked)
            self.goals.tell(f"waits for an operator: {said}")

    def hold_reason(self, one: Execution) -> Optional[HoldReason]:
        """Returns why an execution that is held cannot begin; None if it can."""
        if one.pauses:
            return HoldReason.RETRY
        if one.is_open_to_change:
            return HoldReason.CANCEL
        reason = self.interlock.reason(one.actuator, one.action, is_approved=one.is_approved)
        was_rejected = (one.actuator, one.action) in self.executions.rejected
        return HoldReason.REJECTED if was_rejected and reason is HoldReason.APPROVAL else reason

    def take_beliefs(self, terms: Tuple[str, ...]) -> None:
        """Takes the terms by which a plan's encoding shows beliefs; says so if they are new."""
        if self.beliefs.take(terms, self.step, self.environment.world_now):
            self.note(journal.BeliefsChanged(terms))
            self._show_beliefs()

    def _show_beliefs(self) -> None:
        beliefs = Beliefs.read(self.beliefs.terms)
        self.environment.show_beliefs(beliefs, dict(self.beliefs.since))

    def begin_steps(self) -> None:
        """Resets the steps and the plan when the planner is initialised."""
        self.beliefs.begin_steps(self.step)
        super().begin_steps()

    def forget_steps(self) -> None:
        """Applies a reset: the current step becomes step 0, and the plan's steps are outdated."""
        self.beliefs.begin_steps(self.step)
        super().forget_steps()

    def _correct_arrivals(self) -> None:
        """Tells clients of new delays, and publishes the plan with them."""
        if self.timing.correct():
            self.show_plan()

    def show_plan(self) -> None:
        """Publishes the plan from the current step on, if it is new."""
        quality = self.planner.quality if self.shows_plan else None
        ahead, times = tuple(self.ahead()), self.timing.goal_times()
        shown = (self.step, self.horizon, ahead, times, quality)
        if shown[:-1] != self._shown[:-1]:
            said = self.timing.plan_times(times)
            self.environment.show_plan(self.step, self.horizon, ahead, said)
        if quality != (self._shown[-1] if self._shown else None):
            self.environment.show_quality(quality)
        self._shown = shown
        if self.executions.rejected:
            self.show_held()  # with what is planned instead
