"""Inputs that the loop has taken from the inbox, until the planner is told of them."""

from __future__ import annotations

import contextlib
import itertools
import sys
import time
from dataclasses import dataclass, field, replace
from typing import Callable, Dict, List, Optional, Sequence, Set, Tuple

from rosclingo.errors import TermError, shorten
from rosoclingo.errors import PlannerError
from rosoclingo.loop import journal
from rosoclingo.loop.backoff import Backoff, Pace
from rosoclingo.loop.execution.executions import Executions
from rosoclingo.loop.execution.progress import Progress
from rosoclingo.loop.execution.tokens import is_known, resolve, why_late
from rosoclingo.loop.inputs.inbox import (
    MOST_QUEUED,
    Cancel,
    Inbox,
    Item,
    Taken,
    arrival_of,
    item_of,
)
from rosoclingo.loop.journal import MessageArrived
from rosoclingo.loop.planner.demand import Pair
from rosoclingo.loop.planner.externals import PlannerExternals
from rosoclingo.loop.values.atoms import canonical, event
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.execution import Execution
from rosoclingo.loop.values.goals import Goal, Goals
from rosoclingo.loop.values.ids import RESERVED, why_no_message
from rosoclingo.loop.values.snapshot import take_over
from rosoclingo.loop.words import BUSY, FAILURE, GIVEN_UP, INFO, LOST, QUEUE, TIMEOUT, UNKNOWN

_FEEDBACK_SECONDS = 1.0  # how often goals are told how much waits
_SHORTEST = 1e-9  # seconds; what came in a command differs from what came before it
_LOGGED_DROPS = 10  # of the messages that are dropped together, so many are logged one by one
_LOGGED_IN_SECOND = 100  # of the messages that are dropped in a second
_LOG_SECONDS = 1.0
_CONTROL = journal.ControlArrived
# What an encoding that does not declare an answer is told instead, until it declares it.
_LESS_SAID = {UNKNOWN: (FAILURE,), TIMEOUT: (FAILURE,), LOST: (UNKNOWN, FAILURE)}
_CANCEL = "cancel"
_OPERATOR = "operator"  # the sender of the failure of what is rejected; no name of a node


@dataclass
class MailState:
    """Saved state of :class:`Mail` itself.

    Attributes:
        dynamic: Whether the mode takes messages and goals.
        rejection: Why no goal can be taken, if that is so.
        messages: Pairs of id and value.
        new_goals: Whether a goal has come, or a slot for one that waits.
        between_steps: Whether the step is over, so that what comes may be told in the next one.
    """

    dynamic: bool = True
    rejection: str = ""
    messages: List[Tuple[str, str]] = field(default_factory=list)
    new_goals: bool = False
    between_steps: bool = False
    _news: int = 0  # how much has come that the controller does not know of
    _undeclared: Set[str] = field(default_factory=set)  # whose answers a warning was logged of


@dataclass(frozen=True)
class MailSnapshot:
    """Saved state of :class:`Mail`; goals are given by their ids.

    Attributes:
        cancels: Goals that are to be cancelled.
        held: What is held back, in order of arrival.
    """

    state: MailState
    cancels: Tuple[str, ...]
    held: Tuple[str, ...]


class Mail(MailState):
    """Buffers messages, goals and cancel requests until ``assign_messages``.

    Used by the loop's thread, and by the callback that polls whether its search is to stop.

    What the planner does not know, or what is rosoclingo's own, is dropped as soon as it comes, so
    that the controller never hears of it. That can be told once there is a step after step 0, since
    all steps after that declare the same events; until then it is told when the event is due.

    What comes while the loop plans interrupts that, but not again and again: after the first
    interruption it stays in the inbox until the planning is over, or for a time that grows; see
    :class:`.Backoff`.

    Attributes:
        inbox: Where everything comes in.
        cancels: Goals with a slot that are to be cancelled.
    """

    def __init__(
        self,
        inbox: Inbox,
        goals: Goals,
        externals: PlannerExternals,
        executions: Executions,
        *,
        progress: Progress,
        environment: Environment,
        note: Callable[[journal.Event], None],
        answered: Callable[[Execution, str], None],
        controlled: Callable[[journal.ControlArrived, float], bool],
        fail: Callable[[Execution, str], Optional[str]],
    ) -> None:
        """Makes an empty buffer.

        Args:
            inbox: Where everything comes in.
            goals: The goals.
            externals: What the planner's encoding knows.
            executions: What each actuator was told to do last; who acts may answer.
            progress: Knows the current step.
            environment: Where warnings go.
            note: Adds an event to the journal.
            answered: Called with what was executed until its answer, and the answer.
            controlled: Does what an operator wants, who has said so when the command that is
                carried out had taken some seconds; returns whether that is news for the mode.
            fail: Returns what the planner is told of an answer; None if the action is retried.
        """
        super().__init__()
        self.inbox = inbox
        self._progress = progress
        self._goals = goals
        self.cancels: List[Goal] = []
        self._externals = externals
        self._executions = executions
        self._environment = environment
        self._note = note
        self._answered = answered
        self._controlled = controlled
        self._fail = fail
        self._held: List[Taken] = []  # of which it is not known yet whether the planner knows it
        self._command_began: Optional[float] = None  # that which is carried out
        self._backoff = Backoff()
        self._pace = Pace()
        self._is_paced = False  # there are messages that wait for the next step
        self._told_at = 0.0  # when planning began, or goals were told how much waits
        self._logged_at = 0.0  # since when messages that are dropped are counted
        self._logged = self._not_logged = 0

    def snapshot(self) -> MailSnapshot:
        """Returns the state to save: untold inputs."""
        return MailSnapshot(
            self,
            tuple(goal.id for goal in self.cancels),
            tuple(journal.to_text(arrival_of(item)) for item in self._held),
        )

    def restore(self, saved: MailSnapshot, goals: Dict[str, Goal]) -> None:
        """Restores the inputs of a run that was interrupted.

        Args:
            saved: What had come.
            goals: The goals by their ids.
        """
        take_over(self, saved.state)
        self.cancels = [goals[key] for key in saved.cancels]
        self._held = [_item(text, goals) for text in saved.held]

    @property
    def goals_spoken_of(self) -> List[Goal]:
        """The goals that are to be cancelled, and those of inputs that are held back."""
        held = [item.goal if isinstance(item, Cancel) else item for item in self._held]
        return [*self.cancels, *(item for item in held if isinstance(item, Goal))]

    # What the controller is told.

    @property
    def new_messages(self) -> bool:
        """True if there is something for ``assign_messages`` to do; may ask the planner."""
        has_come = bool(self.messages or self.cancels or self.new_goals or self._held)
        return has_come or self._executions.leaves_some_busy

    def tell(self) -> bool:
        """Returns :attr:`new_messages` for the controller, which knows of all news from then on."""
        self._news = 0
        return self.new_messages

    @property
    def has_news(self) -> bool:
        """True if there are inputs that the controller has not been told of."""
        return self._news > 0

    # When it is taken.

    def begin_attempt(self) -> None:
        """Begins an attempt at planning, which inputs interrupt as the backoff allows."""
        now = self._environment.now()
        self._backoff.restart(now)
        self._told_at = now

    def end_attempt(self, *, acts: bool = False) -> None:
        """Ends an attempt to plan: the loop waits or acts, and takes inputs at once again."""
        self._backoff.reset()
        if acts:
            self._pace.reset()

    def _paces(self) -> bool:
        """Tells if a message has to wait before it begins a step."""
        may = self.between_steps and self.inbox.may_hold and not self.inbox.closed
        return may and self._pace.holds(self._environment.now())

    @property
    def _holds(self) -> bool:
        return (
            self.inbox.may_hold
            and not self.inbox.closed
            and self._backoff.holds(self._environment.now())
        )

    def tell_waiting(self) -> None:
        """Tells goals now and then how much waits for the search."""
        now = self._environment.now()
        if now - self._told_at < _FEEDBACK_SECONDS or not self._holds:
            return
        self._told_at = now
        waiting = self.inbox.waiting()
        if not waiting:
            return
        is_one = len(waiting) == 1
        line = f"{len(waiting)} message{' waits' if is_one else 's wait'} for the search"
        goals = [item for item in waiting if isinstance(item, Goal)]
        for goal in (*self._goals.open, *goals):
            if not goal.ended:
                goal.tell(line, kind="waiting messages")

    # What comes in.

    def begin(self, *, keep: bool = False) -> None:
        """Resets the buffer when the planner is initialised.

        Args:
            keep: Whether what has come and was not told yet is still to be told.
        """
        if not keep:
            self.messages.clear()
            self.cancels.clear()

    def explain(self, slot: str, request: str, step: int) -> str:
        """Returns the reason why a goal is rejected that the planner declares no external for."""
        why = self._externals.vocabulary.explain(slot, request)
        atom = shorten(event(slot, request, step))
        return f"the planner does not know it: {why} (there is no external {atom})"

    def refuse(self, reason: str) -> None:
        """Takes no messages and goals from now on."""
        self.dynamic = False
        self.rejection = reason
        self._held = [item for item in self._held if isinstance(item, Goal)]
        self.messages.clear()
        self.cancels.clear()
        self.new_goals = False
        self._backoff.reset()

    def begin_decision(
        self, *, may_ask: bool = False, improve: Callable[[], object] = lambda: None
    ) -> None:
        """The controller is about to decide.

        Args:
            may_ask: That of :meth:`take`, for what a replay takes while it waits.
            improve: Called when a replay has to search for a better plan before that.
        """

        def take() -> None:
            if self.inbox.recorded.is_early_due:
                improve()
            else:
                self.take(may_ask=may_ask)

        self._command_began = None
        self.inbox.begin_decision(self._waits, take)

    def begin_command(self) -> None:
        """Called before a command is carried out."""
        self._command_began = time.perf_counter()
        self.inbox.begin_command(self._waits, self.take)
        self._command_began = time.perf_counter()

    def begin_end(self) -> None:
        """Called before the loop ends and takes inputs for the last time."""
        self.inbox.begin_end(self._waits)

    def _waits(self) -> None:
        self._note(journal.LoopWaits(for_a_replay=True))
        self.inbox.durability.about_to_wait()

    def wait(self, seconds: float) -> bool:
        """Waits until there is an input, at most for some seconds, and returns whether there is."""
        self.inbox.durability.about_to_wait()
        return self.inbox.wait(seconds)

    def take(self, *, may_ask: bool = False, controls: bool = True) -> None:
        """Takes inputs from the inbox, and drops invalid ones.

        Args:
            may_ask: Whether the planner may be asked now whether it knows something; else what is
                unknown is held back.
            controls: Whether an operator's requests are taken, too: an action that they let go
                would wait for the end of a search.
        """
        self._begin_to_log()
        if self._is_paced and not self._paces():
            self._is_paced = False
            self._news += 1
        items = self._come(controls)
        is_news = False
        while True:
            before = [*itertools.takewhile(lambda one: not isinstance(one, _CONTROL), items)]
            self.inbox.durability.took(before)  # a request may commit, before what is behind it
            new, dropped = resolve(self._executions, before)
            if new or dropped or self._held:
                self._take_all(new, dropped, may_ask)
            is_news |= bool(new or dropped)
            items = items[len(before) :]
            if not items:
                break
            self._take_control(items.pop(0))
        if may_ask:
            self._sort_queue()
        if is_news:
            self._goals.tell_positions()

    def _take_control(self, request: Item) -> None:
        assert isinstance(request, journal.ControlArrived)
        self.inbox.durability.took([request])
        self._news += self._controlled(request, self._seconds)
        if self._command_began is None:
            self.inbox.durability.about_to_wait()  # the next command may last

    @property
    def _seconds(self) -> float:
        """How long the command takes that is carried out, in seconds; 0 between commands."""
        if self._command_began is None:
            return 0.0
        return max(time.perf_counter() - self._command_began, _SHORTEST)

    def _come(self, controls: bool) -> List[Item]:
        self.inbox.durability.flush()
        if self._holds and not (controls and self.inbox.has_controls):
            self.inbox.run_callbacks()
            return []
        self.inbox.make_room(self._room)
        return self.inbox.take(controls=controls)

    @property
    def _room(self) -> int:
        """How many goals are taken: not all of a flood, which stays in the inbox."""
        if self.rejection:
            return sys.maxsize
        held = sum(isinstance(item, Goal) for item in self._held)
        return MOST_QUEUED + len(self._goals.slots) - self._goals.unplaced - held

    def _take_all(self, new: List[Taken], dropped: List[str], may_ask: bool) -> None:
        held, self._held = self._held, []
        items = held + new
        seconds = self._seconds
        for item in new:
            arrival = arrival_of(item)
            assert isinstance(arrival, journal.ARRIVALS)
            self._note(replace(arrival, seconds=seconds))
        for number, item in enumerate(items):
            try:
                if may_ask and number == 0:
                    self._ask_together(items)
                is_news = self._take(item, may_ask, dropped)
            except Exception:  # nothing is lost when the planner does not answer
                self._held += items[number:]
                raise
            if is_news and number >= len(held):
                self._news += 1
        self._log_dropped(dropped)

    def _ask_together(self, items: Sequence[Taken]) -> None:
        """Asks the planner about the requests of several goals in one question, not in one each.

        If the planner refuses it, because of one of them, they are asked about one by one.
        """
        externals, slots = self._externals, self._goals.slots
        if self.rejection or not slots:
            return
        requests = [
            item.request
            for item in items
            if isinstance(item, Goal) and not item.ended and item.request != _CANCEL
            if externals.knows([(slots[0], item.request)])
            or not externals.is_sure([(slots[0], item.request)])
        ]
        pairs = list(zip(self._goals.likely_slots(len(requests)), requests))
        unknown = [one for one in pairs if not (externals.knows([one]) or externals.is_sure([one]))]
        if len(unknown) > 1:
            with contextlib.suppress(PlannerError):
                externals.ask(unknown)

    def _sort_queue(self) -> None:
        """Asks the encoding which goals are to get a slot before others."""
        undecided = [(goal, (QUEUE, f"first({goal.request})")) for goal in self._goals.undecided()]
        questions = [
            first
            for _, first in undecided
            if not (self._externals.was_asked(*first) or self._externals.is_sure([first]))
        ]
        if questions:
            self._externals.ask(questions)
        for goal, first in undecided:
            if self._externals.was_asked(*first):
                self._goals.decide(goal, is_first=self._externals.is_declared(*first))

    def _take(self, item: Taken, may_ask: bool, dropped: List[str]) -> bool:
        """Takes one thing, and returns whether it is news for the controller."""
        if isinstance(item, Cancel):
            return self._goals.cancel(item.goal) and self._take_cancel(item.goal)
        assert not isinstance(item, _CONTROL)
        if self._held:  # the order of the others is kept
            self._held.append(item)
            return True
        if isinstance(item, MessageArrived):
            return self.dynamic and self._take_message(item, may_ask, dropped)
        return self._take_goal(item, may_ask)

    def _take_cancel(self, goal: Goal) -> bool:
        if goal in self.cancels or (goal.slot and self._is_known(goal.slot, _CANCEL)):
            return False
        self.cancels.append(goal)
        return True

    def _is_known(self, source: str, content: str) -> bool:
        """Tells if an event is true already in the step in which it would be told."""
        atom = event(source, content, self._progress.step)
        return not self.between_steps and self._externals.is_true(atom)

    def _take_goal(self, goal: Goal, may_ask: bool) -> bool:
        if self.rejection:
            self._goals.end(goal, journal.Status.REJECTED, self.rejection)
            return False
        if goal.request == _CANCEL:
            reason = "cancel is no request; a goal is cancelled by a cancel request of its action"
            self._goals.end(goal, journal.Status.REJECTED, reason)
            return False
        slots = self._goals.slots
        pairs = [(slot, goal.request) for slot in slots]
        if self._hold(goal, pairs, may_ask):
            return True
        if slots and not self._externals.knows(pairs):
            step = len(self._externals.grounded) - 1
            why = self.explain(slots[0], goal.request, step)
            self._goals.end(goal, journal.Status.REJECTED, why)
            return False
        goal.came = self._environment.world_now()
        self._goals.add(goal)
        # One for which there will be no slot in the next step either is no news.
        news = self._goals.has_free_slot(next_step=True)
        self.new_goals |= news
        return news

    def _take_message(self, message: MessageArrived, may_ask: bool, dropped: List[str]) -> bool:
        if not self._externals.grounded:  # the slots' ids are not known
            self._held.append(message)
            return True
        try:
            source, value = canonical(message.source), canonical(message.value)
        except TermError as err:
            dropped.append(str(err))
            return False
        actor, is_ours = self._executions.acting(source), message.sender == _OPERATOR
        if is_ours and not (actor and actor.is_rejected and actor.is_open):
            return False  # it was withdrawn before the planner could be asked
        if actor and not is_ours:
            if self._is_repeated(actor, value):
                return False
            if actor.is_held and actor.is_open:
                what = "a retry" if actor.pauses else "an operator"
                dropped.append(
                    f"{journal.naming(source, value)}its action {shorten(actor.action)} waits for "
                    f"{what}, and has not begun"
                )
                return False
        if actor and actor.is_open:
            return self._take_answer(message, actor, (source, value), may_ask, dropped)
        return self._take_news(message, actor, (source, value), may_ask, dropped)

    def _take_answer(
        self,
        message: MessageArrived,
        actor: Execution,
        pair: Pair,
        may_ask: bool,
        dropped: List[str],
    ) -> bool:
        """Takes the answer to an action that is under way, or was rejected by an operator."""
        source, said = pair
        outcome: Optional[str] = said
        if message.sender != _OPERATOR:
            outcome = self._fail(actor, said)
        if outcome is None:  # it is tried again
            return False
        less = _LESS_SAID.get(outcome, (FAILURE,) if outcome != said else ())
        told = self._told_as(message, (source, outcome), less, may_ask)
        if told is None:
            return True
        outcome, reason = told
        if reason is not None:
            dropped.append(f"{journal.naming(source, outcome)}{reason}")
            return False
        self._end_action(source, said, outcome)
        if not self._externals.knows([(source, outcome)]):
            self._warn_of_undeclared_answer(source, said)
            return not actor.is_busy
        if outcome == FAILURE and said in (UNKNOWN, LOST):
            self._warn_of_unknown(source)
        if actor.is_busy:
            return False
        self._is_paced = False
        self.messages.append((source, outcome))
        return True

    def _take_news(
        self,
        message: MessageArrived,
        actor: Optional[Execution],
        pair: Pair,
        may_ask: bool,
        dropped: List[str],
    ) -> bool:
        """Takes a message that is no answer: one of a sensor, or of who has answered before."""
        source, said = pair
        told = self._told_as(message, pair, _LESS_SAID.get(said, ()) if actor else (), may_ask)
        if told is None:
            return True
        value, reason = told
        if reason is None and not self._externals.knows([(source, value)]):
            reason = "the planner's encoding declares no such event"
            if len(dropped) < _LOGGED_DROPS:
                reason += self._suggest(source, value)
        elif reason is None and actor and actor.outcome != value:
            reason = why_late("it", str(actor.answer))
        if reason is not None:
            dropped.append(f"{journal.naming(source, value)}{reason}")
            return False
        self._end_action(source, said, value)
        if (actor and actor.is_busy) or self._is_known(source, value):
            return False
        self.messages.append((source, value))
        self._is_paced = self._paces()
        return not self._is_paced

    def _told_as(
        self, message: MessageArrived, pair: Pair, less: Sequence[str], may_ask: bool
    ) -> Optional[Tuple[str, Optional[str]]]:
        """Returns the value of which the planner is told, and why that is refused.

        Args:
            message: The message.
            pair: Its id and value.
            less: What says less, to take its place if the encoding does not declare it.
            may_ask: Whether the planner may be asked.

        Returns:
            None if the message is held, since it is not known yet what is declared.
        """
        source, value = pair
        for one in less:
            if self._hold(message, [(source, value)], may_ask):
                return None
            if self._externals.knows([(source, value)]):
                break
            value = one  # if that is known; it is not taken for a success in any case
        reason = why_no_message(source, value, self._goals.slots)
        if reason is None and self._hold(message, [(source, value)], may_ask):
            return None
        if reason is None and value == BUSY and self._externals.is_declared(source, BUSY):
            reason = "who is busy, rosoclingo says itself"
        return value, reason

    def _is_repeated(self, actor: Execution, said: str) -> bool:
        """Tells if a message of an actuator only repeats the answer that was taken last.

        So does the loop's own one that time is up, if the answer has come just before that.
        """
        told = self._executions.told.get(actor.actuator) if actor.is_held else actor
        if told is None or told.is_open:
            return False
        return is_known(told.answer, said) or said in GIVEN_UP

    def reject(self, actuator: str) -> bool:
        """Takes an action that is held, and was rejected, as failed.

        Returns:
            Whether that is news for the mode.
        """
        dropped: List[str] = []
        failed = MessageArrived(actuator, FAILURE, sender=_OPERATOR)
        is_news = self._take(failed, False, dropped)
        self._log_dropped(dropped)
        return is_news

    def _end_action(self, source: str, answer: str, outcome: str) -> None:
        ended = self._executions.end(source, answer, outcome)
        if ended is not None:
            self._answered(ended, answer)

    def _suggest(self, source: str, value: str) -> str:
        others = [*(word for word in RESERVED if word != INFO), *self._goals.slots]
        return self._externals.vocabulary.suggest(source, value, others)

    def _warn_of_undeclared_answer(self, source: str, value: str) -> None:
        """Says that an answer ends its action, but that the planner cannot be told of it."""
        if source not in self._undeclared:
            self._undeclared.add(source)
            self._environment.warn(
                f"{shorten(source)} has answered {shorten(value)}: that ends its action, but the "
                "planner is not told, because its encoding does not declare "
                f"#external {shorten(f'event({source},{value},t)')}; this is said once"
                f"{self._suggest(source, value)}"
            )

    def _warn_of_unknown(self, source: str) -> None:
        """Says that an outcome is told as a failure, because the encoding does not know better."""
        self._environment.warn(
            f"whether {shorten(source)} has done its action is unknown, and the planner is told "
            "that it failed, because its encoding does not declare "
            f"#external {shorten(f'event({source},{UNKNOWN},t)')}"
        )

    def _hold(self, item: Taken, pairs: List[Pair], may_ask: bool) -> bool:
        """Keeps an item for later if it is not known yet whether the planner declares its pairs."""
        externals = self._externals
        may_be_own = isinstance(item, MessageArrived) and pairs[0][1] == BUSY
        if (externals.knows(pairs) and not may_be_own) or externals.is_sure(pairs):
            return False
        if may_ask:
            externals.ask(pairs[:1])  # most encodings know a request in all slots or in none
            if not (externals.knows(pairs[:1]) or externals.is_sure(pairs)):
                externals.ask(pairs)
            if externals.is_sure(pairs) or (externals.knows(pairs) and not may_be_own):
                return False
        self._held.append(item)
        return True

    # What the commands do.

    def take_cancels(self) -> List[Goal]:
        """Removes the cancel requests and returns their goals; all goals are placed next."""
        cancels, self.cancels = self.cancels, []
        self.new_goals = False
        return cancels

    def take_messages(self, step: int) -> Dict[str, Tuple[str, str]]:
        """Removes the messages, and returns their events with id and value, in order of arrival."""
        messages = {event(source, value, step): (source, value) for source, value in self.messages}
        if messages and self.between_steps:
            self._pace.begin_step(self._environment.now())
        self.messages.clear()
        self.between_steps = self._is_paced = False
        return messages

    def drop(self, messages: List[Tuple[str, str, str]]) -> None:
        """Reports messages that did not reach the planner.

        Args:
            messages: Id, value and reason of each.
        """
        self._log_dropped(
            [
                f"{journal.naming(source, value)}{shorten(why)}"
                + (self._suggest(source, value) if number < _LOGGED_DROPS else "")
                for number, (source, value, why) in enumerate(messages)
            ]
        )

    def _log_dropped(self, dropped: List[str]) -> None:
        for reason in dropped:
            self._note(journal.MessageDropped(reason))
        logged = dropped[: min(_LOGGED_DROPS, _LOGGED_IN_SECOND - self._logged)]
        for reason in logged:
            self._environment.warn(f"dropped a message: {reason}")
        self._logged += len(logged)
        self._not_logged += len(dropped) - len(logged)
        if logged:
            self._sum_up_dropped()

    def _sum_up_dropped(self) -> None:
        """Logs the number of dropped messages that were not logged one by one."""
        if self._not_logged:
            self._environment.warn(f"dropped {self._not_logged} more messages like these")
            self._not_logged = 0

    def _begin_to_log(self) -> None:
        """Logs, a second after messages were dropped, how many more were; counts anew then."""
        if self._environment.now() - self._logged_at >= _LOG_SECONDS:
            self._sum_up_dropped()
            self._logged_at = self._environment.now()
            self._logged = 0


def _item(text: str, goals: Dict[str, Goal]) -> Taken:
    item = item_of(journal.from_text(text), goals.__getitem__)
    assert not isinstance(item, (journal.AnswerArrived, type(None)))
    return item
