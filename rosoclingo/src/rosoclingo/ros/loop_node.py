"""The node with the loop: its topics, its action, which has the node's own name, a service."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from dataclasses import replace
from functools import partial
from typing import Any, Callable, Dict, List, Optional, TypeVar

import actionlib
import rospy

from rosclingo.errors import RosclingoError, TermError, shorten
from rosclingo.limits import too_long
from rosclingo.ros import parameters
from rosclingo.ros.action_server import LowLatencyActionServer
from rosclingo.ros.dropped import DroppedInputs
from rosclingo.ros.init import on_shutdown
from rosclingo.ros.low_latency import subscriber
from rosclingo.solver.about import about
from rosoclingo.errors import ExhaustedError, ShutdownError, StoreError
from rosoclingo.loop import journal
from rosoclingo.loop.durability import Durability, KnownGoal
from rosoclingo.loop.execution.interlock import Interlock
from rosoclingo.loop.execution.policies import ActionPolicies
from rosoclingo.loop.execution.tokens import TOKENS_HEADER
from rosoclingo.loop.inputs.inbox import Inbox, Item, arrival_of
from rosoclingo.loop.inputs.replay_inbox import ReplayInbox
from rosoclingo.loop.journal import AnswerArrived, MessageArrived
from rosoclingo.loop.loop import Loop
from rosoclingo.loop.mode.controller import Decider
from rosoclingo.loop.planner.planner import DEFAULT_PATIENCE, ONE_BY_ONE_SECONDS
from rosoclingo.loop.state import ASK_AGAIN_SECONDS
from rosoclingo.loop.values.atoms import canonical
from rosoclingo.loop.values.goals import Goal, GoalClient
from rosoclingo.loop.values.solver import Solver
from rosoclingo.msg import (
    ROSoClingoAction,
    ROSoClingoAnswer,
    ROSoClingoGoal,
    ROSoClingoHeartbeat,
    ROSoClingoIn,
    ROSoClingoResult,
)
from rosoclingo.ros.copies import AnswerCopies
from rosoclingo.ros.diagnostics import LoopDiagnostics, SolverReport
from rosoclingo.ros.encodings import Encodings
from rosoclingo.ros.environment import ActionClient, RosEnvironment
from rosoclingo.ros.goal_statuses import status_of
from rosoclingo.ros.operator_services import OperatorServices
from rosoclingo.ros.questions import Questions
from rosoclingo.ros.storing import restore_goal
from rosoclingo.srv import GetGoalInformation, GetGoalInformationRequest
from rosoclingo.why.serving import LOWEST

# How long a thread of Python's that is busy, such as one that takes a flood of goals, holds up one
# that has something to do. An answer passes several threads.
_SWITCH_SECONDS = 0.001

_NO_SEED_PLANNER = "none"  # the default of a parameter that has no effect any more

_RESULTS_KEPT = 1_000  # of goals, which may come again
_SECONDS_TO_END = 1.0  # how long a shutdown waits for the loop
_SECONDS_TO_SEND = 0.3  # how long the end and results have until rospy ends connections
_WHY_SECONDS = 20.0  # how long an answer may take that is asked for by ~why
_POLL_SECONDS = 0.1  # how often the main thread looks whether the loop has ended

_Value = TypeVar("_Value")


class LoopNode:
    """Connects the planning node's names with a loop.

    See docs/protocol.md, section "Names in the ROS graph".

    rospy's threads only fill the inbox; the loop runs in a thread of its own. Make it after the
    node is initialised.
    """

    def __init__(
        self,
        controller: Decider,
        planner: Solver,
        commands: Callable[..., Any],
        inbox: Inbox,
        *,
        ready: Callable[[], None] = lambda: None,
        describe: Callable[..., str] = partial(about, "", []),
        encodings: Optional[Encodings] = None,
        durability: Optional[Durability] = None,
        solver_report: Optional[SolverReport] = None,
        is_replaced: bool = False,
    ) -> None:
        """Opens the names; :meth:`start` starts the loop.

        Args:
            controller: Says what to do next.
            planner: Solver with the task's encoding.
            commands: Class with a method for each command, such as ``ROSCommands``.
            inbox: Where everything comes in.
            ready: Waits until the solvers are there; called first in the loop's thread.
            describe: Returns what :func:`rosclingo.solver.about.about` says of the node, with the
                ``parameters`` that it is given.
            encodings: What the planner plans with; without it, there is no service ``~why``.
            durability: Stores the run; None for nowhere.
            solver_report: Returns the health of a solver in this process; None if there is none.
            is_replaced: Whether another process takes this one's place if its memory runs out.

        Raises:
            ParameterError: A parameter is wrong.
        """
        sys.setswitchinterval(_SWITCH_SECONDS)
        timeout = parameters.number("action_timeout", 0.0, what="seconds")
        # Bags that do not say it were made when it was 0.
        default_patience = 0.0 if isinstance(inbox, ReplayInbox) else DEFAULT_PATIENCE
        deciding: Dict[str, Any] = {
            "abort_unreachable": parameters.flag("abort_unreachable", False),
            "patience": parameters.number(
                "patience", default_patience, least=DEFAULT_PATIENCE, what="seconds"
            ),
            "one_by_one_seconds": parameters.number(
                "one_by_one_seconds", ONE_BY_ONE_SECONDS, what="seconds"
            ),
            "ask_again": parameters.number("ask_again", ASK_AGAIN_SECONDS, what="seconds"),
            "ask_before": _checked("ask_before", parameters.words("ask_before"), Interlock),
            "policies": _checked("policies", parameters.mapping("policies"), ActionPolicies),
        }
        if isinstance(inbox, ReplayInbox):
            deciding.update(one_by_one_seconds=0.0)  # the journal says what was found ahead
        if parameters.text("seed_planner", _NO_SEED_PLANNER) != _NO_SEED_PLANNER:
            rospy.logwarn("~seed_planner has no effect any more: first plans come from rosoclingo")
        why_seconds = parameters.positive("why_seconds", _WHY_SECONDS)
        why_nice = parameters.integer("why_nice", LOWEST, LOWEST)
        explains = parameters.flag("explain", True)
        self.failure: Optional[str] = None
        self._is_exhausted = False
        self._inbox = inbox
        self._environment = environment = RosEnvironment(describe(parameters=deciding))
        self._durability = durability or Durability()
        self._loop = Loop(
            controller,
            planner,
            commands,
            inbox,
            environment,
            durability=self._durability,
            action_timeout=timeout,
            is_replaced=is_replaced,
            **deciding,
        )
        if encodings is not None:
            # A replay's clients have no subscribers.
            explains = explains and not isinstance(inbox, ReplayInbox)
            environment.questions = Questions(
                self._loop.state, encodings, seconds=why_seconds, nice=why_nice, explains=explains
            )
        self._diagnostics = LoopDiagnostics(
            self._loop.state, inbox, environment, self._durability, solver_report
        )
        self._ready = ready
        self._thread = threading.Thread(target=self._run, name="loop", daemon=True)
        self._goals: Dict[str, Goal] = {}
        self._copies = AnswerCopies()
        self._dropped = DroppedInputs()
        self._server = LowLatencyActionServer(
            rospy.get_name(),
            ROSoClingoAction,
            self._on_goals,
            self._on_cancels,
            ROSoClingoResult("canceled"),
            rejected=ROSoClingoResult("rejected"),
            results_kept=_RESULTS_KEPT,
            batches=True,
        )
        self._resume()
        self._in = subscriber("~in", ROSoClingoIn, self._on_message)
        self._answer = subscriber("~answer", ROSoClingoAnswer, self._on_answer)
        self._heartbeats = subscriber("~heartbeat", ROSoClingoHeartbeat, self._on_heartbeat)
        self._operator = OperatorServices(inbox, environment, lambda: self._loop.state.mail.dynamic)
        self._service = rospy.Service(
            "~get_goal_information", GetGoalInformation, self._on_get_information
        )

    def _resume(self) -> None:
        """Takes over the goals of a run that goes on, and lets the action begin."""
        durability = self._durability

        def client(goal: KnownGoal) -> GoalClient:
            return ActionClient(restore_goal(self._server, goal), self._loop.state.note)

        self._goals = durability.resume(self._loop.state, client)
        executions = self._loop.state.executions
        self._environment.told = {one.actuator: one.number for one in executions.dispatched}
        self._copies.restore(executions, self._inbox.waiting())
        if self._environment.questions is not None:
            self._environment.questions.resume()
        for goal in durability.ended:
            self._server.remember_result(status_of(goal), ROSoClingoResult(goal.status.value))
        ended = [(goal, restore_goal(self._server, goal)) for goal in durability.unsure]
        self._server.start()
        for goal, handle in ended:
            self._server.publish_result_again(handle, ROSoClingoResult(goal.status.value))

    def start(self) -> None:
        """Starts the loop."""
        self._diagnostics.start()
        self._thread.start()
        on_shutdown(self._close)  # which waits for the thread

    def spin(self) -> None:
        """Waits until the loop has failed, or the node is shut down and has said so to all."""
        while not rospy.is_shutdown() and (self._thread.is_alive() or self._inbox.closed):
            if self._thread.is_alive():
                self._thread.join(_POLL_SECONDS)
            else:
                time.sleep(_POLL_SECONDS)  # a shutdown is under way, in a thread of its own

    @property
    def is_refused(self) -> bool:
        """True if a restart of the process cannot help: the store refuses, or memory is short."""
        return self._durability.is_refused or self._is_exhausted

    def is_alive(self) -> bool:
        """Returns whether the loop still runs."""
        return self._thread.is_alive()

    def _close(self) -> None:
        # Runs before rospy stops publishing, so that open goals get their results.
        self._inbox.close()
        self._thread.join(_SECONDS_TO_END)
        self._durability.close()
        # A solver in this process that grounds cannot be interrupted.
        if self._thread.is_alive() and not self._durability.keeps_goals:
            for goal in self._goals.values():
                goal.set_status(journal.Status.ABORTED, journal.Reason.SHUTDOWN)
        if self._goals or self.failure is not None:
            time.sleep(_SECONDS_TO_SEND)

    def _run(self) -> None:
        try:
            self._ready()
        except RosclingoError as err:
            self._loop.end(str(err))
            return
        try:
            self._loop.run()
        except ShutdownError:
            pass
        except ExhaustedError as err:
            self._is_exhausted = not err.at_once
            self._fail(str(err))
        except RosclingoError as err:
            self._fail(str(err))
        except Exception as err:  # the open goals have been aborted; say why, and end
            rospy.logerr("internal error", exc_info=True)
            self._fail(f"internal error: {err!r}")

    def _fail(self, reason: str) -> None:
        if not self._inbox.closed:
            self._diagnostics.publish()  # before the process ends
            self.failure = reason

    def _on_message(self, message: ROSoClingoIn) -> None:
        told = self._environment.told
        if TOKENS_HEADER in message._connection_header and message.id in told:
            return  # for those who listen; it comes with its token, too
        sender = _sender(message)
        reason = too_long(id=message.id, value=message.value, sender=sender)
        if reason is not None:
            self._dropped.add(f"a message of {shorten(sender)} on ~in", reason)
            return
        arrived = MessageArrived(message.id, message.value, sender=sender)
        if not self._copies.repeats_token(arrived, told):
            self._put(replace(arrived, sender=""))

    def _on_answer(self, message: ROSoClingoAnswer) -> None:
        sender = _sender(message)
        reason = too_long(run=message.run, value=message.value, sender=sender)
        if reason is not None:
            self._dropped.add(f"an answer of {shorten(sender)}", reason)
            return
        answer = AnswerArrived(message.run, message.number, message.value, sender)
        executions = self._loop.state.executions
        if not self._copies.is_copy(answer, executions, self._environment.told):
            self._put(answer)

    def _on_heartbeat(self, message: ROSoClingoHeartbeat) -> None:
        state = self._loop.state
        if message.run == state.executions.run:
            is_known = 0.0 <= message.progress <= 1.0
            state.heartbeats.hear(message.number, message.progress if is_known else None)

    def _put(self, item: Item) -> None:
        with contextlib.suppress(StoreError):  # the loop ends with that
            self._inbox.put(item)

    def _on_goals(self, handles: List[actionlib.ServerGoalHandle]) -> None:
        # Runs under actionlib's lock: nothing here may wait, but for one write to the disk.
        self._goals = {key: other for key, other in self._goals.items() if not other.ended}
        goals: Dict[str, Goal] = {}
        try:
            with self._durability.together():
                for handle in handles:
                    goal = self._read_goal(handle)
                    if goal is not None:
                        goals[goal.id] = goal
            self._goals.update(goals)
            self._inbox.put(*goals.values())
        except StoreError:  # the loop ends with that, or has ended; another one goes on
            for handle in handles:
                if self._goals.pop(handle.get_goal_id().id, None) is not None:
                    self._server.drop(handle)
        except Exception as err:  # the server rejects the rest; the loop may have some of these
            for goal in goals.values():
                goal.set_status(journal.Status.REJECTED, f"internal error: {err!r}")
            raise

    def _read_goal(self, handle: actionlib.ServerGoalHandle) -> Optional[Goal]:
        """Returns a goal that has come, or rejects it."""
        identifier, sent, note = handle.get_goal_id().id, handle.get_goal(), self._loop.state.note
        sender = (handle.goal._connection_header or {}).get("callerid", "")
        reason = too_long(request=sent.request, information=sent.information, sender=sender)
        if reason is not None:
            self._dropped.add(f"a goal of {shorten(sender)}", reason)
            handle.status_tracker.goal.goal = ROSoClingoGoal()  # which the status list keeps
            handle.set_rejected(ROSoClingoResult("rejected"), reason)
            return None
        goal = Goal(sent.request, sent.information, identifier, ActionClient(handle, note))
        try:
            goal.request = canonical(sent.request)
        except TermError as err:
            rospy.logwarn("goal rejected: %s", err)
            note(arrival_of(goal))
            goal.set_status(journal.Status.REJECTED, str(err))
            return None
        return goal

    def _on_cancels(self, handles: List[actionlib.ServerGoalHandle]) -> None:
        # Runs under actionlib's lock: nothing here may wait, but for two writes to the disk.
        known = [one for one in handles if one.get_goal_id().id in self._goals]
        try:
            self._inbox.cancel(*(self._goals[one.get_goal_id().id] for one in known))
        except StoreError:  # the loop ends with that, or has ended
            for handle in known:
                self._server.take_back_cancel(handle)  # what is acknowledged is not lost

    def _on_get_information(self, request: GetGoalInformationRequest) -> Any:
        reason = too_long(key=request.key)
        if reason is not None:
            raise rospy.ServiceException(reason)
        try:
            goal = self._loop.state.goals.occupant(canonical(request.key))
        except TermError as err:
            raise rospy.ServiceException(str(err)) from err
        if goal is None:
            raise rospy.ServiceException(f"no goal has the slot {request.key!r}")
        return [goal.information]


def _sender(message: Any) -> str:
    """Returns the name of the node from which a message comes."""
    return str(message._connection_header.get("callerid", ""))


def _checked(name: str, value: _Value, check: Callable[[_Value], object]) -> _Value:
    """Returns the value of a parameter.

    Args:
        name: The parameter's name.
        value: Its value.
        check: Raises an error if that is wrong, whose text says why.

    Raises:
        ParameterError: It is wrong.
    """
    try:
        check(value)
    except ValueError as err:
        raise parameters.wrong(name, err) from err
    return value
