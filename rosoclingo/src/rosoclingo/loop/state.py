"""What rosoclingo knows between two commands, and what it does for them."""

from __future__ import annotations

import time
from typing import Callable, Dict, Iterable, List, Optional, Sequence, Set, Tuple

from rosclingo.wire.commands import AssignExternal, ReleaseExternal, Result, Truth
from rosoclingo.errors import ShutdownError
from rosoclingo.loop.atom_text import last_argument
from rosoclingo.loop.atoms import Action, Plan, event
from rosoclingo.loop.demand import Pair, ToldVocabulary
from rosoclingo.loop.goals import STATUSES, Goals
from rosoclingo.loop.inbox import Inbox, Message
from rosoclingo.loop.journal import BEST_SO_FAR, SHUTDOWN, Event
from rosoclingo.loop.mail import Mail
from rosoclingo.loop.solver import Planner
from rosoclingo.loop.vocabulary import Vocabulary

_SAVE = "event(save,"
_LOOK_SECONDS = 1.0  # how often it is seen, while waiting, whether the solvers are there
_SILENT_SECONDS = 1.0  # how long the goals hear nothing while a plan is searched for
_REMINDER_SECONDS = 30.0  # how often it is said that an actuator does not answer


class Environment:
    """The world that the loop speaks to; a node overrides the methods."""

    def publish(self, actuator: str, action: str) -> None:
        """Sends an action, or with the id ``solver`` a whole plan."""

    def show_plan(self, step: int, horizon: int, actions: Sequence[Action]) -> None:
        """Shows what is planned, from the current step on."""

    def note(self, event: Event) -> None:
        """Adds an event to the journal; may be called from any thread."""

    def info(self, text: str) -> None:
        """Logs what is worth to know."""

    def warn(self, text: str) -> None:
        """Logs what was dropped or looks wrong."""


class State:
    """The system's state.

    Only the loop's thread uses it, or who asks whether its search is to stop.

    Attributes:
        planner: The planner.
        goals: The goals.
        mail: What has come from outside.
        plan: The last plan found.
        step: The current step: that of the last ``status_update`` or ``commit_actions``.
        horizon: The step T for which ``query(T)`` was made true last.
        grounded: The steps that are grounded.
        result: The result of the last command, if that was a search.
        ended: Whether the loop is through with its work.
        told: The events that were made true since the last plan was found, in order; each with
            whether it came from outside.
        planned: The horizon of the last plan since the planner was initialised; -1 without one.
        after_message: Whether a message was told since the last search.
        tries: How often it was looked for the reason why there is no plan, since there was one.
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
            action_timeout: From when on an action without an answer counts as failed, in seconds
                since it was published; 0 for never.
            abort_unreachable: Whether a goal without a plan ends alone, and not all with the loop.
        """
        self.abort_unreachable = abort_unreachable
        self._check = check
        self._begin_mode = begin_mode
        self._action_timeout = action_timeout
        self._look_at = 0.0  # when it is time to look again
        self.planner = planner
        self.environment = environment
        self.goals = Goals()
        self.mail = Mail(inbox, self.goals, environment.warn, self.note)
        self.plan = Plan()
        self.shows_plan = False  # whether the plan's steps are those that are counted now
        self.step = 0
        self.horizon = 0
        self.grounded: Set[int] = set()
        self.result: Optional[Result] = None
        self.ended = False
        self._reminded = False  # that goals wait for the next step
        self._to_release: List[int] = []
        self._by_step: Dict[int, List[str]] = {}  # externals that can be released, when last seen
        self._seen = 0  # how many steps were grounded then
        self._kept: Set[str] = set()  # externals other than events that the mode has made true
        self._made_true: Set[str] = set()
        self.told: Dict[str, bool] = {}
        self.planned = -1
        self.after_message = False
        self.tries = 0
        self._again: Optional[List[str]] = None  # what to begin with
        self._published: Set[Action] = set()
        self._declares_passed: Optional[bool] = None
        self._warned: Set[str] = set()  # what is said once
        self._planning_since: Optional[float] = None

    def begin(self, slots: Iterable[str]) -> None:
        """Takes note that the planner is initialised: nothing has happened yet.

        Args:
            slots: The ids that the planner has for goals.
        """
        again, self._again = self._again, None
        self.goals.set_slots(slots, keep=again is not None)
        demand = self.planner.demand
        told = ToldVocabulary(demand, self.goals.slots)
        vocabulary = told if demand.tells else Vocabulary()
        self.mail.begin(vocabulary, keep=again is not None)
        if self.mail.dynamic and not self.goals.slots:
            self.mail.rejection = "the planner's encoding has no slots for goals, rslot(ID)"
            self.goals.end_waiting("rejected", self.mail.rejection)
        self.step = self.horizon = 0
        self.plan, self.shows_plan = Plan(), False
        self.planned = -1
        self.grounded = {0}
        self._to_release.clear()
        self._seen = 0
        self._kept.clear()
        self._made_true.clear()
        self.told.clear()
        self._published.clear()
        self._declares_passed = None
        self._free_slots()
        if again:
            self.make_true(again)

    @property
    def needed_horizon(self) -> Optional[int]:
        """The horizon that the plan needs, if that is beyond the one that is asked for."""
        needed = self.planner.needed
        return needed if needed is not None and needed > self.horizon else None

    def saved(self) -> List[str]:
        """Returns the events ``event(save,F,0)`` that the planner is to begin with."""
        return [atom for atom in self._again or () if atom.startswith(_SAVE)]

    def warn_once(self, kind: str, text: str) -> None:
        """Logs a warning, but only the first of its kind."""
        if kind not in self._warned:
            self._warned.add(kind)
            self.environment.warn(text)

    def note(
        self,
        kind: str,
        identifier: str = "",
        text: str = "",
        details: Sequence[str] = (),
        seconds: float = 0.0,
    ) -> None:
        """Adds an event to the journal. Thread-safe; the arguments are those of :class:`Event`."""
        self.environment.note(
            Event(kind, identifier, text, tuple(details), seconds, self.step, self.horizon)
        )

    def note_command(self, command: str, seconds: float) -> None:
        """Adds a command that was carried out to the journal, with the result of a search."""
        result = "" if self.result is None else self.result.value
        self.note("command", result, command, seconds=seconds)

    def set_grounded(self, steps: Iterable[int]) -> None:
        """Takes note that steps are grounded."""
        self.grounded.update(steps)
        self.mail.set_grounded(len(self.grounded))

    def externals(self) -> Dict[str, Truth]:
        """Returns the planner's externals with their values."""
        externals = self.planner.externals()
        self.mail.learn(externals)
        self._by_step = {}
        for atom, value in externals.items():
            step = last_argument(atom)
            if step is not None and value is not Truth.TRUE and not atom.startswith(_SAVE):
                self._by_step.setdefault(step, []).append(atom)
        self._seen = len(self.grounded)
        return externals

    # What comes from outside.

    def take_mail(self) -> None:
        """Takes what has come; the planner may be asked whether it knows it."""
        self.mail.take(self._ask)

    def _ask(self, pairs: Sequence[Pair]) -> None:
        if self.planner.demand.tells:
            self.planner.declare(pairs)
        else:
            self.externals()

    def interrupted(self) -> bool:
        """Whether a search has to end because of what has come; says now and then that it runs."""
        self.tell_progress()
        self.mail.take()  # the planner cannot be asked
        return self.mail.inbox.closed or self.mail.has_news

    def wait(self) -> None:
        """Waits for something that the controller does not know of.

        Raises:
            ShutdownError: The node is shutting down.
            RosclingoError: A solver went away.
        """
        inbox = self.mail.inbox
        self.take_mail()
        if not (self.mail.pending_actions or self.mail.has_news):
            self.goals.tell(f"waiting in step {self.step}: the plan has no action for now")
        noted = False
        while not (self.mail.has_news or self._step_is_awaited()):
            if inbox.closed:
                raise ShutdownError(SHUTDOWN)
            if not noted:
                noted = True
                self.note("waiting")
            inbox.wait(max(0.0, self._look_at - time.monotonic()))
            self._look()
            self.take_mail()

    def _look(self) -> None:
        """Looks now and then, whatever comes, whether the solvers and the actuators are there."""
        if time.monotonic() < self._look_at:
            return
        self._look_at = time.monotonic() + _LOOK_SECONDS
        self._check()
        for actuator, seconds in self.mail.late(_REMINDER_SECONDS):
            self.environment.warn(
                f"{actuator} has not answered for {seconds:.0f} s; does an interface of it "
                "run, and does its terminal say why it waits?"
            )
        if self._action_timeout > 0:
            for actuator in self.mail.overdue(self._action_timeout):
                self.environment.warn(
                    f"{actuator} has not answered for {self._action_timeout:g} s "
                    "(~action_timeout): its action counts as failed"
                )
                self.mail.inbox.put(Message(actuator, "failure"))

    def finish(self, reason: str) -> None:
        """Ends the work: goals that are open or still to come are told why."""
        self.ended = True
        self.mail.refuse(self.mail.rejection or reason)
        self.goals.end_all("aborted", reason)

    def rest(self) -> None:
        """Refuses goals until the node is shut down.

        Raises:
            ShutdownError: The node is shutting down.
        """
        inbox = self.mail.inbox
        while not inbox.closed:
            self.mail.take()
            inbox.wait(_LOOK_SECONDS)
        raise ShutdownError(SHUTDOWN)

    def _step_is_awaited(self) -> bool:
        """Whether goals wait for a slot that is free as soon as the next step begins.

        The mode is told once in each step, as of a goal that has just come. If it waits again
        nevertheless, nobody moves the step on, and these goals end here.
        """
        goals = self.goals
        if self.mail.pending_actions or not (goals.waiting and goals.has_free_slot(next_step=True)):
            return False
        if not self._reminded:
            self._reminded = self.mail.new_goals = True
            return True
        if goals.all_ended():
            goals.end_waiting(
                "aborted",
                f"the mode waits in step {self.step}, and all slots belong to goals that ended in "
                "it; the maximal horizon may be reached (-c steps=N)",
            )
        return False

    # What the commands do.

    def assign_messages(self, step: int) -> None:
        """Makes the events of all messages, cancel requests and goals with a slot true."""
        self._assign_pending_messages(step)
        for goal in self.mail.cancels:
            # Its slot may be another's by now.
            if goal.slot is not None and self.goals.is_open(goal):
                cancel = [event(goal.slot, "cancel", step)]
                for _, reason in self.make_true(cancel, from_outside=True):
                    self.environment.warn(f"the goal {goal.request} cannot be cancelled: {reason}")
        self.mail.cancels.clear()
        self.mail.new_goals = False
        while self.goals.waiting and self.goals.has_free_slot():
            for slot, goal in self.goals.place():
                if self.make_true([event(slot, goal.request, step)], from_outside=True):
                    self.externals()
                    self.goals.end(goal, "rejected", self.mail.explain(slot, goal.request, step))
                    self.goals.remove(goal)
        self.goals.tell_positions()

    def _assign_pending_messages(self, step: int) -> None:
        messages = self.mail.take_messages(step)
        new = {atom: pair for atom, pair in messages.items() if atom not in self._made_true}
        answers = [atom for atom, (source, _) in new.items() if self.mail.is_acting(source)]
        others = [atom for atom in new if atom not in answers]
        self.after_message |= bool(others)
        missing = self.make_true(answers) + self.make_true(others, from_outside=True)
        self.mail.drop([(*new[atom], reason) for atom, reason in missing])

    def note_assigned(self, atom: str, true: bool) -> None:
        """Takes note of an external that the mode itself has set."""
        noted = self._made_true if atom.startswith("event(") else self._kept
        if true:
            noted.add(atom)
        else:
            noted.discard(atom)

    def release(self, atom: str) -> None:
        """Makes an external false for good, if there is one."""
        if atom in self.externals():
            self.planner.run(ReleaseExternal(atom))
            self._seen = 0  # what was seen is out of date
        self.note_assigned(atom, False)

    def is_true(self, atom: str) -> bool:
        """Whether an event of the planner was made true since the last reset."""
        return atom in self._made_true

    def make_true(self, atoms: List[str], *, from_outside: bool = False) -> List[Tuple[str, str]]:
        """Makes externals of the planner true, until the next reset.

        Args:
            atoms: The externals.
            from_outside: Whether somebody has asked for or announced this, who may be wrong;
                nothing else is ever taken back.

        Returns:
            The atoms that are no externals, each with the reason.
        """
        missing = self.planner.tell(atoms)
        unknown = {atom for atom, _ in missing}
        told = [atom for atom in atoms if atom not in unknown]
        self._made_true.update(told)
        self.told.update(dict.fromkeys(told, from_outside))
        return missing

    def from_outside(self) -> List[str]:
        """Returns those of the told events that may be taken back, in order."""
        return [atom for atom, from_outside in self.told.items() if from_outside]

    def take_back(self, atom: str) -> None:
        """Makes an external of the planner false that was made true."""
        self.planner.assign([atom], Truth.FALSE)
        self._made_true.discard(atom)
        self.told.pop(atom, None)

    def can_begin_again(self) -> bool:
        """Whether the planner can begin again with what it knew before the current step."""
        is_saved = self.planner.demand.tells or any(
            atom.startswith(_SAVE) for atom in self.externals()
        )
        return self.mail.dynamic and self.planned >= 0 and is_saved and bool(self.known())

    def known(self) -> List[str]:
        """Returns what held before the current step, as the events of a beginning."""
        if self.step == 0:
            return sorted(atom for atom in self._made_true if atom.startswith(_SAVE))
        return [event("save", fluent, 0) for fluent in self._fluents(self.step - 1)]

    def _fluents(self, step: int) -> List[str]:
        """Returns what the plan says that holds in a step.

        An encoding that is told its events shows that only for the step of the search. After it
        there may be steps without actions, which change nothing.
        """
        if self.planner.demand.tells:
            return self.plan.last_fluents(step)
        return self.plan.fluents(step)

    def begin_again(self) -> None:
        """Begins the mode again, and the planner with what it knew before the current step.

        Goals stay as they are; those that came in this step are told again.
        """
        again = self.known()
        for goal in self.goals.open:
            for content in (goal.request, "cancel"):
                if self.is_true(event(goal.slot or "", content, self.step)):
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
        self.mail.begin_step()
        self._free_slots()
        gone = range(self.step, step)
        self.step = step
        if self._declares_passed is None:
            self._declares_passed = self._declares("info", "passed")
        return [event("info", "passed", past) for past in gone if self._declares_passed]

    def _declares(self, source: str, content: str) -> bool:
        if self.planner.demand.tells:
            self.planner.declare([(source, content)])
            return self.planner.demand.declared[source, content]
        prefix = f"event({source},{content},"
        return any(atom.startswith(prefix) for atom in self.externals())

    def release_later(self, step: int) -> None:
        """Notes a step whose unused externals are to be released.

        An encoding that is told its events has none for each step, but that of its query.
        """
        if not self.planner.demand.tells:
            self._to_release.append(step)

    def release_now(self) -> None:
        """Releases the unused externals of the steps that were noted.

        That takes a while, so it is done when the actions of the next step are on their way, and
        before the planner is asked for anything that it could change.
        """
        steps, self._to_release = self._to_release, []
        if steps and self._seen != len(self.grounded):
            self.externals()
        release = [
            ReleaseExternal(atom)
            for step in steps
            for atom in self._by_step.pop(step, ())
            if atom not in self._made_true
            and atom not in self._kept
            and atom not in (f"query({step})", event("info", "passed", step))
        ]
        if release:
            self.planner.run(*release)

    def _free_slots(self) -> None:
        self._reminded = False
        self.goals.free_slots()
        self.mail.new_goals |= self.goals.waiting and self.goals.has_free_slot()

    def commit(self, action: Action) -> None:
        """Remembers an action as published and sends it."""
        self._published.add(action)
        self.mail.acts(action.actuator)
        self.environment.publish(action.actuator, action.name)
        self.note("action", action.actuator, action.name)

    def is_published(self, action: Action) -> bool:
        """Whether an action was published since the last reset."""
        return action in self._published

    def begin_planning(self) -> None:
        """Takes note that a plan is needed; what is known may last for many searches."""
        if self._planning_since is None:
            self._planning_since = time.monotonic()

    def tell_progress(self) -> None:
        """Tells the goals how far the planner is, once they have waited for a while."""
        begin = self._planning_since
        if begin is not None and time.monotonic() - begin > _SILENT_SECONDS:
            self.goals.tell(f"planning, horizon {self.horizon}")

    def found(self, plan: Plan, is_best: bool = True) -> None:
        """Takes a new plan.

        Args:
            plan: The plan.
            is_best: Whether the search was through, and did not end because of its time.
        """
        self.plan, self.shows_plan = plan, True
        self.told.clear()
        self.planned, self.tries, self.after_message = self.horizon, 0, False
        self._planning_since = None
        text = "" if is_best else BEST_SO_FAR
        self.note("plan", text=text, details=[str(action) for action in self.ahead()])
        self.goals.tell(f"plan {self.horizon} step{'' if self.horizon == 1 else 's'}")

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
            self.goals.end(goal, word, f"the planner's status in step {self.step}")

    def reset(self, step: int) -> None:
        """Makes the fluents of a step the initial ones, and forgets what happened."""
        self._to_release.clear()  # those steps come again
        true = {event("save", fluent, 0) for fluent in self._fluents(step)}
        if self.planner.demand.tells:
            self._restart(sorted(true))
            declares = True
        else:
            externals = self.externals()
            saves = {a for a in externals if a.startswith(_SAVE) and last_argument(a) == 0}
            declares = bool(saves)
            true &= saves
            false = sorted(self._made_true.intersection(externals) - true)
            commands = [AssignExternal(atom, Truth.FALSE) for atom in false]
            commands += [AssignExternal(atom, Truth.TRUE) for atom in sorted(true)]
            self.planner.run(*commands)
        if not true:
            self._warn_of_forgetting(step, declares)
        self._made_true = true
        self.told.clear()
        self._published.clear()
        self.mail.begin_step()
        self._free_slots()
        self.goals.some_ended = False
        self.step = 0
        self.shows_plan = False

    def _restart(self, saved: Sequence[str]) -> None:
        """Has the planner begin again with what is saved: facts cannot be taken back."""
        self.planner.begin(saved)
        self.planner.ground_steps(sorted(self.grounded - {0}))
        self.planner.assign(sorted(self._kept), Truth.TRUE)

    def _warn_of_forgetting(self, step: int, declares: bool) -> None:
        if not declares:
            lacks = "its encoding declares no #external event(save,F,0)"
        elif not self._fluents(step):
            lacks = f"its answer set shows no holds(F,{step})"
        else:
            lacks = "its encoding declares #external event(save,F,0) for other fluents than hold"
        self.warn_once(
            "reset",
            f"a reset keeps nothing of what the planner knows, because {lacks}: for the planner, "
            "all is as in the beginning again, wherever the robot is; a mode recording needs no "
            "reset",
        )
