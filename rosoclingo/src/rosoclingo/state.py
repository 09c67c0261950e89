"""What rosoclingo knows between two commands, and what it does for them."""

from __future__ import annotations

import time
from typing import Callable, Dict, Iterable, List, Optional, Sequence, Set, Tuple

from rosclingo.commands import AssignExternal, ReleaseExternal, Truth
from rosclingo.engine import Result
from rosoclingo.atom_text import last_argument
from rosoclingo.atoms import Action, Plan, event
from rosoclingo.errors import ShutdownError
from rosoclingo.goals import STATUSES, Goals
from rosoclingo.inbox import Inbox, Message
from rosoclingo.journal import Event
from rosoclingo.mail import Mail
from rosoclingo.solver import Planner

_SAVE = "event(save,"
_LOOK_SECONDS = 1.0  # how often it is seen, while waiting, whether the solvers are there
_SILENT_SECONDS = 2.0  # how long the goals hear nothing while a plan is searched for
_REMINDER_SECONDS = 30.0  # how often it is said that an actuator does not answer


class Outside:
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
    """The system's state. Only the loop's thread uses it.

    Attributes:
        planner: The planner.
        goals: The goals.
        mail: What has come from outside.
        plan: The last plan found.
        step: The current step: that of the last ``status_update`` or ``commit_actions``.
        horizon: The step T for which ``query(T)`` was made true last.
        grounded: The steps that are grounded.
        result: The result of the last command, if that was ``solve``.
        ended: Whether the loop is through with its work.
        told: The events that were made true since the last plan was found, in order.
        has_planned: Whether a plan was found since the planner was initialised.
        abort_unreachable: Whether a goal without a plan ends alone, and not all with the loop.
    """

    def __init__(
        self,
        planner: Planner,
        inbox: Inbox,
        outside: Outside,
        check: Callable[[], None] = lambda: None,
        *,
        action_timeout: float = 0.0,
        abort_unreachable: bool = False,
    ) -> None:
        """Begins without any knowledge.

        Args:
            planner: The planner.
            inbox: Where messages, goals and cancel requests come in.
            outside: Where actions and log messages go.
            check: Called now and then while waiting; raises an error if a solver went away.
            action_timeout: From when on an action without an answer counts as failed, in seconds
                since it was published; 0 for never.
            abort_unreachable: Whether a goal without a plan ends alone, and not all with the loop.
        """
        self.abort_unreachable = abort_unreachable
        self.has_planned = False
        self._check = check
        self._action_timeout = action_timeout
        self._look_at = 0.0  # when it is time to look again
        self.planner = planner
        self.outside = outside
        self.goals = Goals()
        self.mail = Mail(inbox, self.goals, outside.warn, self.note)
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
        self.told: List[str] = []
        self._published: Set[Action] = set()
        self._declares_passed: Optional[bool] = None
        self._warned: Set[str] = set()  # what is said once
        self._planning_since: Optional[float] = None

    def begin(self, slots: Iterable[str]) -> None:
        """Takes note that the planner is initialised: nothing has happened yet.

        Args:
            slots: The ids that the planner has for goals.
        """
        self.goals.set_slots(slots)
        self.mail.begin()
        if self.mail.dynamic and not self.goals.slots:
            self.mail.rejection = "the planner's encoding has no slots for goals, rslot(ID)"
            self.goals.end_waiting("rejected", self.mail.rejection)
        self.step = self.horizon = 0
        self.plan, self.shows_plan = Plan(), False
        self.has_planned = False
        self.grounded = {0}
        self._to_release.clear()
        self._seen = 0
        self._kept.clear()
        self._made_true.clear()
        self.told.clear()
        self._published.clear()
        self._declares_passed = None
        self._free_slots()

    def warn_once(self, kind: str, text: str) -> None:
        """Logs a warning, but only the first of its kind."""
        if kind not in self._warned:
            self._warned.add(kind)
            self.outside.warn(text)

    def note(
        self,
        kind: str,
        identifier: str = "",
        text: str = "",
        details: Sequence[str] = (),
        seconds: float = 0.0,
    ) -> None:
        """Adds an event to the journal. Thread-safe; the arguments are those of :class:`Event`."""
        self.outside.note(
            Event(kind, identifier, text, tuple(details), seconds, self.step, self.horizon)
        )

    def note_command(self, command: str, seconds: float) -> None:
        """Adds a command that was carried out to the journal, with the result of a search."""
        result = "" if self.result is None else self.result.value
        self.note("command", result, command, seconds=seconds)

    def set_grounded(self, step: int) -> None:
        """Takes note that a step is grounded."""
        self.grounded.add(step)
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
        self.mail.take(self.externals)

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
                raise ShutdownError("the node is shutting down")
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
            self.outside.warn(
                f"{actuator} has not answered for {seconds:.0f} s; does an interface of it run?"
            )
        if self._action_timeout > 0:
            for actuator in self.mail.overdue(self._action_timeout):
                self.outside.warn(
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
        raise ShutdownError("the node is shutting down")

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
                for _, reason in self.make_true([event(goal.slot, "cancel", step)]):
                    self.outside.warn(f"the goal {goal.request} cannot be cancelled: {reason}")
        self.mail.cancels.clear()
        self.mail.new_goals = False
        while self.goals.waiting and self.goals.has_free_slot():
            for slot, goal in self.goals.place():
                if self.make_true([event(slot, goal.request, step)]):
                    self.externals()
                    self.goals.end(goal, "rejected", self.mail.explain(slot, goal.request, step))
                    self.goals.remove(goal)
        self.goals.tell_positions()

    def _assign_pending_messages(self, step: int) -> None:
        messages = self.mail.take_messages(step)
        new = [atom for atom in messages if atom not in self._made_true]
        self.mail.drop([(*messages[atom], reason) for atom, reason in self.make_true(new)])

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

    def make_true(self, atoms: List[str]) -> List[Tuple[str, str]]:
        """Makes externals of the planner true, until the next reset.

        Returns:
            The atoms that are no externals, each with the reason.
        """
        missing = self.planner.assign(atoms, Truth.TRUE)
        unknown = {atom for atom, _ in missing}
        told = [atom for atom in atoms if atom not in unknown]
        self._made_true.update(told)
        self.told += told
        return missing

    def take_back(self, atom: str) -> None:
        """Makes an external of the planner false that was made true."""
        self.planner.assign([atom], Truth.FALSE)
        self._made_true.discard(atom)
        self.told = [other for other in self.told if other != atom]

    def events_of(self, slot: str, content: str) -> List[str]:
        """Returns the events of a slot with a content, in any step, that were made true."""
        prefix = event(slot, content, 0)[: -len("0)")]
        return sorted(atom for atom in self._made_true if atom.startswith(prefix))

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
            self._declares_passed = any(
                atom.startswith("event(info,passed,") for atom in self.externals()
            )
        return [event("info", "passed", past) for past in gone if self._declares_passed]

    def release_later(self, step: int) -> None:
        """Notes a step whose unused externals are to be released."""
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
        self.outside.publish(action.actuator, action.name)
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

    def found(self, plan: Plan) -> None:
        """Takes a new plan."""
        self.plan, self.shows_plan = plan, True
        self.told.clear()
        self.has_planned = True
        self._planning_since = None
        self.note("plan", details=[str(action) for action in self.ahead()])
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
            self.outside.warn(
                f"the plan has status({slot},{word},{self.step}), where only "
                f"{', '.join(sorted(STATUSES))} are allowed"
            )
        else:
            self.goals.end(goal, word, f"the planner's status in step {self.step}")

    def reset(self, step: int) -> None:
        """Makes the fluents of a step the initial ones, and forgets what happened."""
        self._to_release.clear()  # those steps come again
        externals = self.externals()
        saves = {atom for atom in externals if atom.startswith(_SAVE) and last_argument(atom) == 0}
        true = saves & {event("save", fluent, 0) for fluent in self.plan.fluents(step)}
        if not true:
            self._warn_of_forgetting(step, bool(saves))
        false = sorted(self._made_true.intersection(externals) - true)
        commands = [AssignExternal(atom, Truth.FALSE) for atom in false]
        commands += [AssignExternal(atom, Truth.TRUE) for atom in sorted(true)]
        self.planner.run(*commands)
        self._made_true = true
        self._published.clear()
        self.mail.begin_step()
        self._free_slots()
        self.goals.some_ended = False
        self.step = 0
        self.shows_plan = False

    def _warn_of_forgetting(self, step: int, declares: bool) -> None:
        lacks = (
            f"its answer set shows no holds(F,{step})"
            if declares
            else "its encoding declares no #external event(save,F,0)"
        )
        self.warn_once(
            "reset",
            f"a reset keeps nothing of what the planner knows, because {lacks}: for the planner, "
            "all is as in the beginning again, wherever the robot is; a mode recording needs no "
            "reset",
        )
