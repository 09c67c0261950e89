"""What rosoclingo knows between two commands, and what it does for them."""

from __future__ import annotations

from typing import Dict, Iterable, List, Optional, Set, Tuple

from rosclingo.commands import AssignExternal, ReleaseExternal, Truth
from rosclingo.engine import Result
from rosclingo.errors import TermError
from rosoclingo.atoms import Action, Plan, canonical, event, last_argument_is
from rosoclingo.errors import ShutdownError
from rosoclingo.goals import STATUSES, Goal, Goals
from rosoclingo.inbox import Cancel, Inbox, Message
from rosoclingo.solver import Planner

_RESERVED_IDS = ("commit", "save")
_LOGGED_DROPS = 10  # of the messages that are dropped together, so many are logged one by one


class Outside:
    """The world that the loop speaks to; a node overrides the methods."""

    def publish(self, actuator: str, action: str) -> None:
        """Sends an action, or with the id ``solver`` a whole plan."""

    def info(self, text: str) -> None:
        """Logs what is worth to know."""

    def warn(self, text: str) -> None:
        """Logs what was dropped or looks wrong."""


class State:
    """The system's state. Only the loop's thread uses it.

    Attributes:
        planner: The planner.
        goals: The goals.
        plan: The last plan found.
        step: The current step: that of the last ``status_update`` or ``commit_actions``.
        horizon: The step T for which ``query(T)`` was made true last.
        grounded: The highest step grounded.
        result: The result of the last command, if that was ``solve``.
        request_reset: Whether a goal has ended since the last reset.
        ended: Whether the loop is through with its work.
        dynamic: Whether the mode takes messages and goals.
    """

    def __init__(self, planner: Planner, inbox: Inbox, outside: Outside) -> None:
        self.planner = planner
        self.inbox = inbox
        self.outside = outside
        self.goals = Goals()
        self.plan = Plan()
        self.step = 0
        self.horizon = 0
        self.grounded = 0
        self.result: Optional[Result] = None
        self.request_reset = False
        self.ended = False
        self.dynamic = True
        self._rejection = ""  # why no goal can be taken
        self._messages: List[Tuple[str, str]] = []
        self._cancels: List[Goal] = []
        self._new_goals = False  # a goal has come, or a slot for one that waits
        self._reminded = False  # that goals wait for the next step
        self._to_release: List[int] = []
        self._made_true: Set[str] = set()
        self._published: Set[Action] = set()
        self._acting: Set[str] = set()  # actuators of the current step
        self._answers: Dict[str, str] = {}  # of those that answered in it
        self._declares_passed: Optional[bool] = None

    # What the controller is told.

    @property
    def pending_actions(self) -> bool:
        """Whether an actuator of the current step has not answered."""
        return not self._acting <= self._answers.keys()

    @property
    def new_messages(self) -> bool:
        """Whether there is something for ``assign_messages`` to do."""
        return bool(self._messages or self._cancels or self._new_goals)

    def set_static(self) -> None:
        """Says that the mode takes no messages and goals."""
        self.dynamic = False
        self._rejection = "the controller's mode is static: it takes no goals"

    def set_slots(self, slots: Iterable[str]) -> None:
        """Sets the ids that the planner has for goals."""
        self.goals.set_slots(slots)
        if self.dynamic and not self.goals.has_slots:
            self._rejection = "the planner's encoding has no slots for goals, rslot(ID)"
            self.goals.end_waiting("rejected", self._rejection)
        self._new_goals = self.goals.waiting and self.goals.has_free_slot()

    # What comes from outside.

    def take_inbox(self) -> bool:
        """Takes what has come, drops what is wrong, and returns :attr:`new_messages`."""
        items = self.inbox.take()
        dropped: List[str] = []
        for item in items:
            if isinstance(item, Message):
                if self.dynamic:
                    self._take_message(item, dropped)
            elif isinstance(item, Cancel):
                if self.goals.cancel(item.goal):
                    self._cancels.append(item.goal)
            elif self._rejection:
                item.set_status("rejected", self._rejection)
            else:
                self.goals.add(item)
                # One for which there will be no slot in the next step either is no news.
                self._new_goals |= self.goals.has_free_slot(next_step=True)
        if items:
            self._log_dropped(dropped)
            self.goals.tell_positions()
        return self.new_messages

    def wait(self) -> None:
        """Waits for something new to assign.

        Raises:
            ShutdownError: The node is shutting down.
        """
        while not (self.take_inbox() or self._step_is_awaited()):
            if self.inbox.closed:
                raise ShutdownError("the node is shutting down")
            self.inbox.wait()

    def _step_is_awaited(self) -> bool:
        """Whether goals wait for a slot that is free as soon as the next step begins.

        The mode is told once in each step, as of a goal that has just come. If it waits again
        nevertheless, nobody moves the step on, and these goals end here.
        """
        goals = self.goals
        if self.pending_actions or not (goals.waiting and goals.all_ended()):
            return False
        if not self._reminded:
            self._reminded = self._new_goals = True
            return True
        goals.end_waiting(
            "aborted",
            f"the mode waits in step {self.step}, and all slots belong to goals that ended in it; "
            "the maximal horizon may be reached (-c steps=N at the controller)",
        )
        return False

    def interrupted(self) -> bool:
        """Whether a search has to end because of what has come."""
        return self.inbox.closed or self.take_inbox()

    def _take_message(self, message: Message, dropped: List[str]) -> None:
        try:
            source, value = canonical(message.id), canonical(message.value)
        except TermError as err:
            dropped.append(str(err))
            return
        if source in _RESERVED_IDS or (source == "info" and value == "passed"):
            dropped.append(f"id {source}, value {value}: these are rosoclingo's own")
        elif self.goals.is_slot(source):
            dropped.append(f"id {source} is a goal's slot: goals are changed by the action only")
        elif self._answers.get(source, value) != value:
            dropped.append(
                f"id {source}, value {value}: it has answered {self._answers[source]} already"
            )
        else:
            if source in self._acting:
                self._answers[source] = value
            self._messages.append((source, value))

    def _log_dropped(self, dropped: List[str]) -> None:
        for reason in dropped[:_LOGGED_DROPS]:
            self.outside.warn(f"dropped a message: {reason}")
        if len(dropped) > _LOGGED_DROPS:
            self.outside.warn(f"dropped {len(dropped) - _LOGGED_DROPS} more messages like these")

    # What the commands do.

    def assign_messages(self, step: int) -> None:
        """Makes the events of all messages, cancel requests and goals with a slot true."""
        self._assign_pending_messages(step)
        for goal in self._cancels:
            if goal.slot is not None:
                for _, reason in self.make_true([event(goal.slot, "cancel", step)]):
                    self.outside.warn(f"the goal {goal.request} cannot be cancelled: {reason}")
        self._cancels.clear()
        self._new_goals = False
        while self.goals.waiting and self.goals.has_free_slot():
            for goal in self.goals.place():
                assert goal.slot is not None
                for _, reason in self.make_true([event(goal.slot, goal.request, step)]):
                    goal.set_status("rejected", f"the planner does not know it: {reason}")
                    self.goals.remove(goal)
        self.goals.tell_positions()

    def _assign_pending_messages(self, step: int) -> None:
        messages = {event(source, value, step): (source, value) for source, value in self._messages}
        self._messages.clear()
        new = [atom for atom in messages if atom not in self._made_true]
        dropped = []
        for atom, reason in self.make_true(new):
            source, value = messages[atom]
            dropped.append(f"id {source}, value {value}: {reason}")
            if self._answers.get(source) == value:
                del self._answers[source]  # it was no answer that the planner understands
        self._log_dropped(dropped)

    def make_true(self, atoms: List[str]) -> List[Tuple[str, str]]:
        """Makes externals of the planner true, until the next reset.

        Returns:
            The atoms that are no externals, each with the reason.
        """
        missing = self.planner.assign(atoms, Truth.TRUE)
        self._made_true.update(set(atoms).difference(atom for atom, _ in missing))
        return missing

    def move_to(self, step: int) -> List[str]:
        """Makes a step the current one.

        Returns:
            The externals that are to be true because of that.
        """
        if step == self.step:
            return []
        self._acting.clear()
        self._answers.clear()
        self._free_slots()
        gone = range(self.step, step)
        self.step = step
        if self._declares_passed is None:
            self._declares_passed = any(
                atom.startswith("event(info,passed,") for atom in self.planner.externals()
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
        if not steps:
            return
        release = [
            ReleaseExternal(atom)
            for atom, value in self.planner.externals().items()
            if value is not Truth.TRUE
            and atom not in self._made_true
            and not atom.startswith("event(save,")
            and any(_is_released_with(atom, step) for step in steps)
        ]
        self.planner.run(*release)

    def _free_slots(self) -> None:
        self._reminded = False
        self.goals.free_slots()
        self._new_goals |= self.goals.waiting and self.goals.has_free_slot()

    def commit(self, action: Action) -> None:
        """Remembers an action as published and sends it."""
        self._published.add(action)
        self._acting.add(action.actuator)
        self._answers.pop(action.actuator, None)  # what it answered, it answered to another action
        self.outside.publish(action.actuator, action.name)

    def is_published(self, action: Action) -> bool:
        """Whether an action was published since the last reset."""
        return action in self._published

    def found(self, plan: Plan) -> None:
        """Takes a new plan."""
        self.plan = plan
        self.goals.tell(f"plan {self.horizon} steps")

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
        elif goal.set_status(word, f"the planner's status in step {self.step}"):
            self.request_reset = True

    def reset(self, step: int) -> None:
        """Makes the fluents of a step the initial ones, and forgets what happened."""
        self._to_release.clear()  # those steps come again
        saves = {
            atom
            for atom in self.planner.externals()
            if atom.startswith("event(save,") and last_argument_is(atom, 0)
        }
        true = saves & {event("save", fluent, 0) for fluent in self.plan.fluents(step)}
        commands = [AssignExternal(atom, Truth.FALSE) for atom in sorted(self._made_true - true)]
        commands += [AssignExternal(atom, Truth.TRUE) for atom in sorted(true)]
        self.planner.run(*commands)
        self._made_true = true
        self._published.clear()
        self._acting.clear()
        self._answers.clear()
        self._free_slots()
        self.request_reset = False
        self.step = 0


def _is_released_with(atom: str, step: int) -> bool:
    kept = (f"query({step})", event("info", "passed", step))
    return last_argument_is(atom, step) and atom not in kept
