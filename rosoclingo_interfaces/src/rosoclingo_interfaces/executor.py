"""Runs an interface's actions: answers, time limits, cancelling. Needs no ROS."""

from __future__ import annotations

import logging
import threading
import time
from typing import Callable, Dict, FrozenSet, List, Optional

import clingo

from rosclingo.errors import RosclingoError, TermError
from rosclingo.solver.terms import parse_term
from rosoclingo.loop.words import ABORT, FAILURE, SOLVER, UNKNOWN
from rosoclingo_interfaces.errors import ActionError, CanceledError, LedgerError
from rosoclingo_interfaces.execution import CURRENT, ActionExecution, Clock, FindServedGoals
from rosoclingo_interfaces.interface import (
    AFTER_CRASH,
    AGAIN,
    FAIL,
    ActionInterface,
    ActuatorAnswer,
    answer_text,
)
from rosoclingo_interfaces.ledger import Ledger, LedgerEntry, Token

# How long an actuator's next action waits for the end of the one before it, which was cancelled.
_SECONDS_TO_STOP = 2.0

ReplyFunction = Callable[[str], None]

_log = logging.getLogger("rosout")  # where rospy.loginfo and its like log to


class Executor:
    """Runs actions, each in a thread of its own, and one at a time for each actuator. Thread-safe.

    Each action has one answer, whichever of these comes first: what the method returns, ``failure``
    at the time limit, or ``failure`` when rosoclingo aborts it. An action that another of the same
    actuator replaces has none, because it would count for the other.

    An action that comes with a token is begun once, and answered again when it comes again. With a
    ledger in a file, that holds for all processes that have used it, one after the other.
    """

    def __init__(
        self,
        interface: ActionInterface,
        timeout: float = 0.0,
        clock: Clock = time.monotonic,
        ledger: Optional[Ledger] = None,
        perform: Optional[Callable[[clingo.Symbol], ActuatorAnswer]] = None,
    ) -> None:
        """Prepares the executor.

        Args:
            interface: Does the actions.
            timeout: Longest time from the message to the answer, in seconds of the clock; 0 for
                no limit.
            clock: The time in seconds.
            ledger: Remembers what was done; by default one that ends with the process.
            perform: Does an action in the place of the interface's own ``perform``.

        Raises:
            TermError: The id of an actuator is no term.
            ActionError: The interface's ``after_crash`` is wrong.
        """
        for name, what in interface.after_crash.items():
            if what not in AFTER_CRASH:
                raise ActionError(
                    f"{type(interface).__name__}.after_crash: {what!r} for the action {name} is "
                    f"none of {', '.join(AFTER_CRASH)}"
                )
        self._interface = interface
        self._do = interface.perform if perform is None else perform
        self._timeout = timeout
        self._clock = clock
        self._ledger = Ledger() if ledger is None else ledger
        self._actuators: FrozenSet[str] = frozenset(
            str(parse_term(actuator)) for actuator in interface.actuators
        )
        self._lock = threading.Lock()  # guards the three below; held for moments only
        self._running: Dict[str, ActionExecution] = {}
        self._tokens: Dict[str, Token] = {}  # of the last action of each actuator that came
        self._open = True

    @property
    def running(self) -> List[ActionExecution]:
        """The running actions."""
        with self._lock:
            return list(self._running.values())

    def begin(
        self,
        actuator: str,
        action: str,
        reply: ReplyFunction,
        token: Optional[Token] = None,
        *,
        aborted: bool = False,
        find_served: FindServedGoals = tuple,
    ) -> None:
        """Begins an action if it is for an actuator of the interface; returns at once.

        Args:
            actuator: Who is to act, as it came.
            action: What to do, as it came.
            reply: Sends the answer; called at most once, from any thread, and does not wait.
            token: What the action is known by; None if it came without a token.
            aborted: Whether an action with a token is to stop.
            find_served: Finds the goals that it serves.
        """
        try:
            source = str(parse_term(actuator))
        except TermError as err:
            _log.warning("ignored an action of an actuator that has no name: %s", err)
            return
        if source == SOLVER or (self._actuators and source not in self._actuators):
            return
        if not self._open:
            return  # the node that comes next gets the action again
        entry: Optional[LedgerEntry] = None
        if token is not None:
            is_first = source not in self._tokens
            if not self._is_new(source, token, aborted, reply):
                return
            entry = self._recall(source, token, is_first)
            if entry is not None and entry.answer is not None:
                reply(entry.answer)
                return
            reply = self._remembering(source, action, reply, token)
        try:
            term = parse_term(action)
        except TermError as err:
            self._replace(source, None)
            _log.error("%s: %s", source, err)
            reply(FAILURE)
            return
        if str(term) == ABORT:
            if token is None:
                self._abort(source)
            else:  # an action of its own, which is answered instead of the one that it ends
                self._replace(source, None)
                reply(FAILURE)
            return
        execution = ActionExecution(source, term, self._clock, token, find_served)
        if not self._interface.knows(term) and self._interface.leaves_unknown:
            self._replace(source, None)
            _log.debug("%s is left to another node", execution)
            return
        answer = FAILURE if aborted else None
        if entry is not None:
            answer = self._after_crash(execution, aborted)
        if answer is None:
            self._start(execution, self._replace(source, execution), reply)
        else:
            self._replace(source, None)
            reply(answer)

    def close(self, seconds: float) -> None:
        """Cancels all actions without an answer, and waits for their ends for some time."""
        with self._lock:
            self._open = False
            executions, self._running = list(self._running.values()), {}
        for execution in executions:
            execution.close()
            execution.canceled.set()
        end = time.monotonic() + seconds
        for execution in executions:
            execution.ended.wait(max(0.0, end - time.monotonic()))

    # Known tokens.

    def _is_new(self, actuator: str, token: Token, aborted: bool, reply: ReplyFunction) -> bool:
        """Returns whether an action is new; answers a repeated one again."""
        entry = self._ledger.last(actuator)
        with self._lock:
            running, known = self._running.get(actuator), self._tokens.get(actuator)
            if known is None or token.run != known.run or known.is_before(token):
                self._tokens[actuator] = token
                return entry is None or not token.is_before(entry.token)
        if known == token and entry is not None and entry.token == token and entry.answer:
            reply(entry.answer)  # also if what took too long still runs
        elif aborted and running is not None and running.token == token:
            running.canceled.set()
        return False

    def _recall(self, actuator: str, token: Token, is_first: bool) -> Optional[LedgerEntry]:
        """Returns the ledger's record of an action that an earlier process has begun.

        Returns:
            None if that did not begin it, or if that is unknown.
        """
        entry, name = self._ledger.last(actuator), f"{actuator}: action {token.number}"
        if entry is None or entry.token != token:
            if is_first and self._ledger.is_old:
                _log.info("%s was not begun before this node was started", name)
            return None
        if entry.answer is not None:
            _log.info("%s was done before this node was started: %s", name, entry.answer)
        return entry

    def _after_crash(self, execution: ActionExecution, aborted: bool) -> Optional[str]:
        """Returns the answer to an action in which an earlier process has crashed.

        Returns:
            None if it is to be done again.
        """
        what = self._interface.outcome_after_crash(execution.action)
        answers = {AGAIN: FAILURE if aborted else None, FAIL: FAILURE, UNKNOWN: UNKNOWN}
        answer = answers[what]
        _log.warning(
            "%s was begun before this node was started, and whether it was done is unknown: %s",
            execution,
            "it is done again" if answer is None else answer,
        )
        return answer

    def _remembering(
        self, actuator: str, action: str, reply: ReplyFunction, token: Token
    ) -> ReplyFunction:
        """Returns a reply function that records the answer before it sends it."""

        def send(value: str) -> None:
            try:
                self._ledger.end(actuator, token, action, value)
            except LedgerError as err:
                # No wrong answer follows: after a crash, the outcome is unknown at worst.
                _log.error("%s: the answer %s is sent, but not kept: %s", actuator, value, err)
            reply(value)

        return send

    # Running actions.

    def _replace(
        self, actuator: str, execution: Optional[ActionExecution]
    ) -> Optional[ActionExecution]:
        """Cancels an actuator's execution, puts another in its place, and returns the old one.

        An execution that is cancelled for another node's action stays there until it has ended.
        """
        with self._lock:
            previous = self._running.get(actuator)
            if execution is not None and self._open:
                self._running[actuator] = execution
        if previous is not None:
            if previous.close():
                _log.warning("%s: replaced after %.1f s", previous, previous.seconds)
            previous.canceled.set()
        return previous

    def _abort(self, actuator: str) -> None:
        with self._lock:
            execution = self._running.get(actuator)
        if execution is not None:
            execution.canceled.set()

    def _start(
        self, execution: ActionExecution, previous: Optional[ActionExecution], reply: ReplyFunction
    ) -> None:
        def run() -> None:
            CURRENT.set(execution)
            try:
                if previous is not None and not previous.ended.wait(_SECONDS_TO_STOP):
                    _log.warning(
                        "%s goes on although it was cancelled %g s ago: its method must look at "
                        "self.canceled or wait with self.sleep()",
                        previous,
                        _SECONDS_TO_STOP,
                    )
                self._finish(execution, self._perform(execution), reply)
            finally:
                execution.ended.set()

        def watch() -> None:
            # Since the message, and not since this thread runs: a clock may have jumped meanwhile.
            if not execution.wait_until(execution.ended, self._timeout) and execution.close():
                _log.error(
                    "%s: no answer within %g s (~timeout): failure", execution, self._timeout
                )
                reply(FAILURE)
                execution.canceled.set()

        _log.debug("%s begins", execution)  # rosoclingo has said what is to be done
        name = str(execution)
        threading.Thread(target=run, name=name, daemon=True).start()
        if self._timeout > 0:
            threading.Thread(target=watch, name=f"time limit of {name}", daemon=True).start()

    def _perform(self, execution: ActionExecution) -> str:
        try:
            if not execution.canceled.is_set():
                if execution.token is not None:
                    self._ledger.begin(execution.actuator, execution.token, str(execution.action))
                return answer_text(self._do(execution.action))
        except CanceledError:
            pass
        except RosclingoError as err:
            _log.error("%s: %s", execution, err)
        except (Exception, SystemExit):  # the code is the user's; the other actions go on
            _log.exception("%s: the method failed", execution)
        return FAILURE

    def _finish(self, execution: ActionExecution, value: str, reply: ReplyFunction) -> None:
        with self._lock:
            if self._running.get(execution.actuator) is execution:
                del self._running[execution.actuator]
        if not execution.close():
            _log.debug("%s: %s came too late", execution, value)
            return
        reply(value)
        aborted = " (aborted)" if execution.canceled.is_set() else ""
        _log.info("%s: %s after %.1f s%s", execution, value, execution.seconds, aborted)
