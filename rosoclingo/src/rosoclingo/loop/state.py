"""What rosoclingo knows between two commands, and what it does for them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Callable, Dict, List, Optional, Sequence, Set, Tuple

from rosclingo.errors import shorten
from rosclingo.wire.commands import Result
from rosclingo.wire.term_text import last_number
from rosoclingo.errors import PlannerError
from rosoclingo.loop import journal
from rosoclingo.loop.arrivals import EXPECTED, Arrival, Arrivals, ArrivalsState
from rosoclingo.loop.atoms import Action, Plan, event
from rosoclingo.loop.durations import Durations, DurationsState
from rosoclingo.loop.environment import Environment
from rosoclingo.loop.externals import SAVE, ExternalsState, PlannerExternals
from rosoclingo.loop.goals import STATUSES, Goal, GoalClient, Goals, GoalsSnapshot
from rosoclingo.loop.inbox import Inbox
from rosoclingo.loop.mail import Mail, MailSnapshot
from rosoclingo.loop.planner import Planner, PlannerState
from rosoclingo.loop.snapshot import take_over
from rosoclingo.loop.tokens import Tokens, TokensState
from rosoclingo.loop.waiting import Waiting
from rosoclingo.loop.words import ABORT, BUSY, INFO, SUCCESS, TIMEOUT, UNKNOWN

_MOVED_SECONDS = 5.0  # what goes on for too long moves an expected time by so much until it is told
_MOVED_STEP_SECONDS = 1.0  # likewise at each answer and each step


@dataclass
class Progress:
    """How far the run is: what :class:`State` itself has to be saved.

    Attributes:
        plan: The last plan found.
        shows_plan: Whether the plan's steps are those that are counted now.
        step: The current step: that of the last ``status_update`` or ``commit_actions``.
        horizon: The step T for which ``query(T)`` was made true last.
        result: The result of the last command, if that was a search.
        ended: Whether the loop is through with its work.
        planned: The horizon of the last plan since the planner was initialised; -1 without one.
        failures: How many searches in a row have found that there is no plan.
        visible: What of that which has to be seen, an answer set of the planner has shown.
        after_message: Whether a message was told since the last search.
        tries: How often it was looked for the reason why there is no plan, since there was one.
    """

    plan: Plan = field(default_factory=Plan)
    shows_plan: bool = False
    step: int = 0
    horizon: int = 0
    result: Optional[Result] = None
    ended: bool = False
    planned: int = -1
    failures: int = 0
    visible: Set[str] = field(default_factory=set)
    after_message: bool = False
    tries: int = 0
    _again: Optional[List[str]] = None  # what the planner is to begin with next
    _published: Set[Action] = field(default_factory=set)  # since the last reset
    _warned: Set[str] = field(default_factory=set)  # the kinds of what is said once


@dataclass(frozen=True)
class StateSnapshot:
    """What a :class:`State` is restored from.

    Attributes:
        reminded: Whether the controller has been told that goals wait for the next step.
    """

    progress: Progress
    planner: PlannerState
    externals: ExternalsState
    goals: GoalsSnapshot
    tokens: TokensState
    mail: MailSnapshot
    arrivals: ArrivalsState
    durations: DurationsState
    reminded: bool


class State(Progress):
    """The system's state.

    Only the loop's thread uses it, or who asks whether its search is to stop.

    Attributes:
        planner: The planner.
        externals: What is known of the planner's externals.
        goals: The goals.
        tokens: What each actuator was told to do last.
        mail: What has come from outside.
        arrivals: When goals will be served.
        durations: How long actions have taken.
        waiting: How it is waited for that.
        environment: Where actions and log messages go.
        abort_unreachable: Whether a goal without a plan ends alone, and not all with the loop.
    """

    def __init__(
        self,
        planner: Planner,
        inbox: Inbox,
        environment: Environment,
        check: Callable[[], None] = lambda: None,
        begin_mode: Callable[[], None] = lambda: None,
        *,
        action_timeout: float = 0.0,
        abort_unreachable: bool = False,
    ) -> None:
        """Begins without any knowledge.

        Args:
            planner: The planner.
            inbox: Where messages, goals and cancel requests come in.
            environment: Where actions and log messages go.
            check: Called now and then while waiting; raises an error if a solver went away.
            begin_mode: Has the mode begin again, so that it initialises the planner next.
            action_timeout: From when on nobody waits for an action's answer, in seconds since
                it was published; 0 for never.
            abort_unreachable: Whether a goal without a plan ends alone, and not all with the loop.
        """
        super().__init__()
        self.abort_unreachable = abort_unreachable
        self._begin_mode = begin_mode
        self.planner = planner
        self.environment = environment
        self.externals = PlannerExternals(planner)
        self.goals = Goals()
        self.tokens = Tokens()
        self._shown: Tuple[object, ...] = ()
        planner.recorded, planner.note = inbox, self.note
        self.arrivals = Arrivals()
        self.durations = Durations()
        self.mail = Mail(
            inbox,
            self.goals,
            self.externals,
            self.tokens,
            environment,
            note=self.note,
            answered=self.answered,
        )
        self.waiting = Waiting(
            self.mail,
            self.goals,
            environment,
            self.note,
            improve=self.improve,
            correct=self.correct_arrivals,
            check=check,
            action_timeout=action_timeout,
        )

    def snapshot(self) -> StateSnapshot:
        """Returns what is known, which is to be encoded before the next decision."""
        return StateSnapshot(
            self,
            self.planner,
            self.externals,
            self.goals.snapshot(self.mail.goals_spoken_of),
            self.tokens,
            self.mail.snapshot(),
            self.arrivals,
            self.durations,
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
        take_over(self.tokens, saved.tokens)
        self.mail.restore(saved.mail, goals)
        take_over(self.arrivals, saved.arrivals)
        take_over(self.durations, saved.durations)
        self.waiting.reminded = saved.reminded
        self.environment.show_told(self.tokens.run, self.tokens.told)
        return goals

    def begin(self, slots: Sequence[str]) -> None:
        """Takes note that the planner is initialised: nothing has happened yet.

        Args:
            slots: The ids that the planner has for goals.
        """
        again, self._again = self._again, None
        self.goals.set_slots(slots, keep=again is not None)
        self.externals.begin(self.goals.slots)
        self.mail.begin(keep=again is not None)
        if self.mail.dynamic and not self.goals.slots:
            self.mail.rejection = "the planner's encoding has no slots for goals, rslot(ID)"
            self.goals.end_waiting("rejected", self.mail.rejection)
        self.step = self.horizon = 0
        self.plan, self.shows_plan = Plan(), False
        self.planned, self.failures = -1, 0
        self.visible.clear()
        self.durations.told.clear()
        self._published.clear()
        self._free_slots()
        if again:
            self.externals.make_true(again)

    @property
    def needed_horizon(self) -> Optional[int]:
        """The horizon that the plan needs, if that is beyond the one that is asked for."""
        needed = self.planner.needed
        return needed if needed is not None and needed > self.horizon else None

    def saved(self) -> List[str]:
        """Returns the events ``event(save,F,0)`` that the planner is to begin with."""
        return [atom for atom in self._again or () if atom.startswith(SAVE)]

    def warn_once(self, kind: str, text: str) -> None:
        """Logs a warning, but only the first of its kind."""
        if kind not in self._warned:
            self._warned.add(kind)
            self.environment.warn(text)

    def note(self, event: journal.Event) -> None:
        """Adds an event to the journal. Thread-safe."""
        self.environment.note(journal.Record(event, self.step, self.horizon))

    def note_command(self, command: str, seconds: float) -> None:
        """Adds a command that was carried out to the journal, with the result of a search."""
        self.note(journal.CommandDone(command, self.result, seconds))

    # What comes from outside.

    def interrupted(self) -> bool:
        """Whether a search has to end because of what has come; says now and then that it runs."""
        self.waiting.tell_progress(self.horizon)
        self.mail.take()  # the planner cannot be asked
        return self.mail.inbox.closed or self.mail.has_news

    def finish(self, reason: str) -> None:
        """Ends the work: goals that are open or still to come are told why."""
        self.ended = True
        self.mail.refuse(self.mail.rejection or reason)
        self.goals.end_all("aborted", reason)

    # What the commands do.

    def assign_messages(self, step: int) -> None:
        """Makes the events of all messages, cancel requests and goals with a slot true."""
        self._assign_pending_messages(step)
        for goal in self.mail.take_cancels():
            # Its slot may be another's by now.
            if goal.slot is not None and self.goals.is_open(goal):
                cancel = [event(goal.slot, "cancel", step)]
                missing = self.externals.make_true(cancel, from_outside=True)
                goal.cancel_told |= not missing  # and stays so
                for _, reason in missing:
                    self.environment.warn(f"the goal {goal.request} cannot be cancelled: {reason}")
        while self.goals.waiting and self.goals.has_free_slot():
            for slot, goal in self.goals.place():
                if self.externals.make_true([event(slot, goal.request, step)], from_outside=True):
                    self.externals.read()
                    self.goals.end(goal, "rejected", self.mail.explain(slot, goal.request, step))
                    self.goals.remove(goal)
                else:
                    self.arrivals.place(slot, self.environment.world_now())
        self._tell_durations(step)
        self.goals.tell_positions()
        if self.mail.is_over:
            self.externals.make_true(self.mail.end_step(step))

    def _assign_pending_messages(self, step: int) -> None:
        messages = self.mail.take_messages(step)
        new = {atom: pair for atom, pair in messages.items() if not self.externals.is_true(atom)}
        answers = [atom for atom, (source, _) in new.items() if self.mail.is_acting(source)]
        others = [atom for atom in new if atom not in answers]
        self.after_message |= bool(others)
        missing = self.externals.make_true(answers) + self.externals.make_true(
            others, from_outside=True
        )
        self.mail.drop([(*new[atom], reason) for atom, reason in missing])

    def _tell_durations(self, step: int) -> None:
        """Tells the planner which actions take longer or shorter than it believes."""
        for kind, seconds in self.durations.news():
            content = f"lasts({kind},{seconds})"
            if self.externals.declares(INFO, content):
                self.externals.make_true([event(INFO, content, step)])
                self.durations.told[kind] = seconds
            else:
                self.durations.unknown.add(kind)

    def can_begin_again(self) -> bool:
        """Whether the planner can begin again with what it knew before the current step."""
        can = self.mail.dynamic and self.planned >= 0 and self.externals.can_be_saved()
        return can and bool(self.known())

    def known(self) -> List[str]:
        """Returns what held before the current step, as the events of a beginning."""
        if self.step == 0:
            return self.externals.saved
        return [event("save", fluent, 0) for fluent in self._fluents(self.step - 1)]

    def _fluents(self, step: int) -> List[str]:
        """Returns what the plan says that holds in a step.

        An encoding that is told its events shows that only for the step of the search. After it
        there may be steps without actions, which change nothing.
        """
        if self.planner.demand.tells:
            return self.plan.last_fluents(step)
        return self.plan.fluents(step)

    def known_to_hold(self) -> Optional[Tuple[int, List[str]]]:
        """Returns the last step gone by after which it is known what holds, and what that is.

        Returns:
            None if that is not known, or could not be told by events ``event(save,F,0)``.
        """
        if not self.shows_plan:
            return None
        new = (last_number(atom) or 0 for atom in self.externals.told)
        step = min([self.step, *new]) - 1
        if self.planner.demand.tells:
            step = self.plan.last_shown(step)
        fluents = self.plan.fluents(step)
        if not fluents or not self.externals.can_save(fluents):
            return None
        return step, fluents

    def begin_again(self) -> None:
        """Begins the mode again, and the planner with what it knew before the current step.

        Goals stay as they are; those that came in this step are told again.
        """
        again = self.known()
        for goal in self.goals.open:
            for content in (goal.request, "cancel"):
                if self.externals.is_true(event(goal.slot or "", content, self.step)):
                    again.append(event(goal.slot or "", content, 0))
        self._again = again
        self._begin_mode()

    def move_to(self, step: int) -> List[str]:
        """Makes a step the current one.

        Returns:
            The externals that are to be true because of that.
        """
        if step == self.step:
            return []
        busy = self.mail.end_step(self.step)
        self.mail.begin_step()
        self._free_slots()
        gone = range(self.step, step)
        self.step = step
        tells = self.externals.declares("info", "passed")
        return [*busy, *(event("info", "passed", past) for past in gone if tells)]

    def _free_slots(self) -> None:
        self.waiting.reminded = False
        self.goals.free_slots()
        if self.goals.waiting and self.goals.has_free_slot():
            self.mail.note_goals()

    def dispatch(self, actions: Sequence[Action]) -> None:
        """Gives actions their tokens, and shows them; they are committed next."""
        for action in actions:
            self.tokens.begin(action)
        if actions:
            self.show_told()

    def show_told(self) -> None:
        """Shows what each actuator was told last, if that or its answer is new."""
        if self.tokens.changed:
            self.tokens.changed = False
            self.environment.show_told(self.tokens.run, self.tokens.told)

    def split(self, actions: Sequence[Action]) -> Tuple[List[Action], List[Action]]:
        """Returns which actions are new, and which repeat what busy actuators do.

        Raises:
            PlannerError: A busy actuator has another one.
        """
        repeated = [action for action in actions if self.mail.goes_on(action.actuator)]
        for action in repeated:
            doing = self.tokens.last[action.actuator].action
            if action.name != doing:
                raise PlannerError(
                    f"the plan has {shorten(str(action))}, and {shorten(action.actuator)} is still "
                    f"busy with {shorten(doing)}: an encoding that declares "
                    f"#external {shorten(event(action.actuator, BUSY, self.step))} has to repeat "
                    "that, after a reset too; see docs/protocol.md, Steps without a barrier"
                )
        return [action for action in actions if action not in repeated], repeated

    def commit(self, action: Action) -> None:
        """Sends an action, which its actuator is to answer, and remembers it as published."""
        self.commit_again(action)
        self.mail.acts(action.actuator)
        self.arrivals.begin(action, self.plan, self.environment.world_now())
        self.environment.publish(action.actuator, action.name)
        self.note(journal.ActionPublished(action.actuator, action.name))

    def commit_again(self, action: Action) -> None:
        """Remembers an action as published that its actuator has been told before."""
        self._published.add(action)

    def publish_abort(self, actuator: str) -> None:
        """Tells an actuator to end what it does, once in a step; nobody answers that."""
        abort = Action(actuator, ABORT, self.step)
        if abort not in self._published and not self.tokens.is_aborted(actuator):
            self._published.add(abort)
            self.tokens.abort(actuator)
            self.show_told()
            self.environment.publish(actuator, abort.name)

    def is_published(self, action: Action) -> bool:
        """Whether an action was published since the last reset."""
        return action in self._published

    def found(self, plan: Plan, is_best: bool = True) -> None:
        """Takes a new plan.

        Args:
            plan: The plan.
            is_best: Whether the search was through, and did not end because of its time; what is
                known of its quality may say that a search before was not.
        """
        quality = self.planner.quality
        is_best = is_best if quality is None else quality.is_best
        self.plan, self.shows_plan = plan, True
        self.externals.told.clear()
        self.planned, self.tries, self.after_message = self.horizon, 0, False
        self.failures = 0
        self.waiting.end_planning()
        self.note(journal.PlanFound(tuple(map(str, self.ahead())), is_best, quality))
        self.goals.tell(f"plan {self.horizon} step{'' if self.horizon == 1 else 's'}")
        for slot, line in plan.feedback():
            goal = self.goals.occupant(slot)
            if goal is not None:
                goal.tell(line)
        self.tell_arrivals()

    def answered(self, actuator: str, value: str) -> None:
        """Takes note of the answer to an action, which the planner is told later.

        If it is a success, and the encoding has said what such actions are called, it is learned
        how long it took; not if the clock stands still.
        """
        done = self.arrivals.end(actuator)
        is_aborted = self.tokens.is_aborted(actuator)
        if done is None or not done.kind or value != SUCCESS or is_aborted:
            return
        number = self.tokens.last[actuator].number
        measured = max(0.0, self.environment.world_now() - done.began)
        seconds = self.mail.inbox.measured(number, measured)
        if seconds:
            self.note(journal.ActionTook(actuator, done.kind, number, seconds))
            self.durations.learn(done.kind, done.seconds, seconds)

    def tell_arrivals(self, moved: float = _MOVED_STEP_SECONDS) -> None:
        """Tells clients when their goals will be served, if that is not what they were told.

        That depends on the time, and nothing else depends on it.

        Args:
            moved: By how many seconds a time has to have moved.
        """
        now, told = self.environment.world_now(), self.arrivals.told
        plan = self.plan if self.shows_plan else Plan()
        times = self.arrivals.expected(plan, self.step, self._published, now)
        for slot in set(told).difference(times):
            del told[slot]
        for goal in self.goals.open:
            slot = goal.slot or ""
            time = times.get(slot)
            if time is None or (slot in told and abs(time - told[slot]) < moved):
                continue
            told[slot] = time
            for line in self.arrivals.lines(plan, slot, time, now):
                goal.tell(line, again=line.startswith(EXPECTED))

    def correct_arrivals(self) -> None:
        """Does the same while actions go on that should have ended, and shows it."""
        if self.arrivals.told:
            self.tell_arrivals(_MOVED_SECONDS)
            self.show_plan()

    def show_plan(self) -> None:
        """Shows what is planned from the current step on, if that is new."""
        quality = self.planner.quality if self.shows_plan else None
        slots = [goal.slot or "" for goal in self.goals.open] if self.shows_plan else []
        told = self.arrivals.told
        arrivals = tuple(Arrival(slot, told[slot]) for slot in slots if slot in told)
        shown = (self.plan, self.shows_plan, self.step, self.horizon, arrivals, quality)
        if shown == self._shown:
            return
        if shown[:-1] != self._shown[:-1]:
            self.environment.show_plan(self.step, self.horizon, self.ahead(), arrivals)
        if quality != (self._shown[-1] if self._shown else None):
            self.environment.show_quality(quality)
        self._shown = shown

    def improve(self) -> bool:
        """Looks for a better plan, as long as nothing comes, if there may be one.

        Called while there is nothing else to do. In a replay it is done if it was done then.

        Returns:
            Whether it has looked.
        """
        inbox = self.mail.inbox
        if not (
            inbox.is_search_due(improves=True) if inbox.knows_searches else self._may_improve()
        ):
            return False
        inbox.begin_improving()
        outcome = self.planner.improve(self.step, self._is_called)
        if outcome is not None:
            self.found(Plan(outcome.symbols))
            if any(not self.is_published(action) for action in self.plan.actions(self.step)):
                self.waiting.stop()  # they begin at once
        self.show_plan()
        return True

    def _may_improve(self) -> bool:
        """Whether somebody acts by a plan that may not be the best."""
        planner, quality = self.planner, self.planner.quality
        may = planner.patience > 0 and planner.demand.improves
        if not may or quality is None or quality.is_best:
            return False
        return self.shows_plan and bool(self.ahead()) and self.mail.pending_actions

    def _is_called(self) -> bool:
        """Whether something has come that a search for a better plan has to end for."""
        self.waiting.look_at_actuators()
        return self.interrupted()

    def ahead(self) -> List[Action]:
        """Returns the actions of the plan from the current step up to the horizon.

        A plan may have more: after a reset, steps beyond the horizon are still grounded. The steps
        of a plan from before a reset are others.
        """
        if not self.shows_plan:
            return []
        actions = self.plan.actions_from(self.step)
        return [action for action in actions if action.step <= max(self.step, self.horizon)]

    def set_status(self, slot: str, word: str) -> None:
        """Sets the status of the goal in a slot as the plan says."""
        goal = self.goals.occupant(slot)
        if goal is None:
            return
        if word not in STATUSES:
            self.environment.warn(
                f"the plan has status({slot},{word},{self.step}), where only "
                f"{', '.join(sorted(STATUSES))} are allowed"
            )
        else:
            reason = f"the planner's status in step {self.step}"
            doubts = "" if word != "aborted" else self._doubts()
            self.goals.end(goal, word, f"{reason}: {doubts}" if doubts else reason)

    def _doubts(self) -> str:
        """Returns which actions of the current step may have been done or not."""
        return " and ".join(
            f"whether {told.actuator} has done {told.action} is unknown"
            for told in self.tokens.told
            if told.answer in (UNKNOWN, TIMEOUT) and told.step == self.step
        )

    def reset(self, step: int) -> None:
        """Makes the fluents of a step the initial ones, and forgets what happened."""
        if not self.externals.reset(self._fluents(step)) and "reset" not in self._warned:
            self._warn_of_forgetting(step)
        self._published.clear()
        self.mail.reset()
        self._free_slots()
        self.goals.some_ended = False
        self.step = 0
        self.shows_plan = False

    def _warn_of_forgetting(self, step: int) -> None:
        if not self.externals.can_be_saved():
            lacks = "its encoding declares no #external event(save,F,0)"
        elif not self._fluents(step):
            if self.plan.last_shown(step) >= 0 or not self.plan.actions_from(0):
                return  # it may be that nothing holds
            lacks = f"its answer set shows no holds(F,{step})"
        else:
            lacks = "its encoding declares #external event(save,F,0) for other fluents than hold"
        self.warn_once(
            "reset",
            f"a reset keeps nothing of what the planner knows, because {lacks}: for the planner, "
            "all is as in the beginning again, wherever the robot is; a mode recording needs no "
            "reset",
        )
