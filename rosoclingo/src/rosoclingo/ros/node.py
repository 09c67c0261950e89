"""The ROS node: topics for actions and answers, an action at the node's own name, a service."""

from __future__ import annotations

import contextlib
import json
import os
import sys
import threading
import time
from functools import partial
from typing import Any, Callable, Dict, FrozenSet, NoReturn, Optional, Sequence

import actionlib
import rospy
from std_msgs.msg import Empty, String

from rosclingo.errors import ParameterError, RosclingoError, TermError
from rosclingo.ros import parameters
from rosclingo.ros.client import Client
from rosclingo.ros.history_publisher import HistoryPublisher
from rosclingo.ros.init import end_wrong, give_up, init_node, on_shutdown
from rosclingo.ros.low_latency import LowLatencyActionServer, publisher, subscriber
from rosclingo.ros.master_watch import exit_status
from rosclingo.solver.about import about
from rosoclingo.errors import ShutdownError, StoreError
from rosoclingo.loop import journal
from rosoclingo.loop.arrivals import Arrival
from rosoclingo.loop.atoms import Action, canonical
from rosoclingo.loop.controller import Controller, Decider
from rosoclingo.loop.environment import Environment
from rosoclingo.loop.goals import Goal, GoalClient, Stage
from rosoclingo.loop.inbox import Answer, Inbox, Item, Message
from rosoclingo.loop.insistent import Insistent
from rosoclingo.loop.loop import Loop
from rosoclingo.loop.quality import Quality
from rosoclingo.loop.replay_inbox import ReplayInbox, decode
from rosoclingo.loop.solver import Solver
from rosoclingo.loop.tokens import TOKENS_HEADER, Told
from rosoclingo.msg import (
    ROSoClingoAction,
    ROSoClingoAnswer,
    ROSoClingoDispatch,
    ROSoClingoEvent,
    ROSoClingoFeedback,
    ROSoClingoIn,
    ROSoClingoOut,
    ROSoClingoPlan,
    ROSoClingoResult,
    ROSoClingoToken,
)
from rosoclingo.ros.encodings import Encodings
from rosoclingo.ros.questions import Questions
from rosoclingo.ros.storing import Storing, address_of, open_store, restore_goal, status_of
from rosoclingo.srv import GetGoalInformation, GetGoalInformationRequest
from rosoclingo.store.store import KnownGoal, Store
from rosoclingo.store.stored_loop import StoredInbox, StoredLoop, StoredReplayInbox
from rosoclingo.why.serving import LOWEST

_USAGE = """\
usage: run.py [_controller:=NAME] [_planner:=NAME] [_action_timeout:=SECONDS]
              [_abort_unreachable:=true] [_patience:=SECONDS] [_why_seconds:=SECONDS]
              [_why_nice:=NUMBER] [_explain:=false] [_store:=FILE] [_resume:=fresh]
              [_solver_timeout:=SECONDS] [ROS remappings]

Plans and executes with two solver nodes of package rosclingo, by default controller and planner."""
_SOLVERS = ("controller", "planner")
_JOURNAL_LENGTH = 2_000  # events that late subscribers get
_RESULTS_KEPT = 1_000  # of goals, which may come again
_SECONDS_TO_END = 1.0  # how long a shutdown waits for the loop
_SECONDS_TO_SEND = 0.3  # how long the results of aborted goals have until rospy ends connections
_WHY_SECONDS = 5.0  # how long an answer may take that is asked for by ~why
_POLL_SECONDS = 0.1  # how often the main thread looks whether the loop has ended


class ActionClient(GoalClient):
    """Who has sent a goal to the node's action."""

    def __init__(
        self, handle: actionlib.ServerGoalHandle, note: Callable[[journal.Event], None]
    ) -> None:
        self._handle = handle
        self._note = note

    def noted(self, goal: Goal, word: str, reason: str) -> None:
        """Adds the status to the journal."""
        self._note(journal.StatusSet(goal.id, journal.Status(word), goal.slot or "", reason))

    def accepted(self) -> None:
        """Accepts the goal."""
        self._handle.set_accepted()

    def ended(self, word: str, reason: str) -> None:
        """Sends the result."""
        getattr(self._handle, f"set_{word}")(ROSoClingoResult(word), reason)

    def feedback(self, line: str) -> None:
        """Sends the line."""
        self._handle.publish_feedback(ROSoClingoFeedback(line))

    @property
    def address(self) -> str:
        """The sender's node and the goal's time, as JSON."""
        return address_of(self._handle)


class RosEnvironment(Environment):
    """Publishes to ``~out`` and logs to ROS.

    Attributes:
        questions: What answers questions; None if nothing does.
        told: The actuators that were told something.
    """

    def __init__(self, description: str) -> None:
        """Opens the topics.

        Args:
            description: What :func:`rosclingo.solver.about.about` says of the node.
        """
        self.questions: Optional[Questions] = None
        self.told: FrozenSet[str] = frozenset()
        # Opened before ~out: who hears an action there can tell whether it comes here, too.
        self._dispatch = publisher("~dispatch", ROSoClingoDispatch, latch=True)
        self._out = publisher("~out", ROSoClingoOut, latch=True)
        self._plan = publisher("~plan", ROSoClingoPlan, latch=True)
        self._quality = publisher("~plan_quality", String, latch=True)
        self._about = publisher("~about", String, latch=True)
        self._about.publish(description)
        self._journal = HistoryPublisher("~journal", ROSoClingoEvent, _JOURNAL_LENGTH)
        self._lock = threading.Lock()  # guards the number; the journal's order is that of numbers
        self._number = 0

    def publish(self, actuator: str, action: str) -> None:
        """Publishes an action or a plan."""
        self._out.publish(actuator, action)
        rospy.loginfo("%s: %s", actuator, action)

    def show_told(self, run: str, told: Sequence[Told]) -> None:
        """Publishes to ``~dispatch``."""
        self.told = frozenset(one.actuator for one in told)
        self._dispatch.publish(
            run,
            [
                ROSoClingoToken(one.number, one.step, one.actuator, one.action, _state(one))
                for one in told
            ],
        )

    def world_now(self) -> float:
        """Returns ROS's time, which is a simulator's if there is one that has a clock."""
        return float(rospy.get_time())

    def show_plan(
        self,
        step: int,
        horizon: int,
        actions: Sequence[Action],
        arrivals: Sequence[Arrival] = (),
    ) -> None:
        """Publishes to ``~plan``."""
        self._plan.publish(step, horizon, [str(one) for one in (*actions, *arrivals)])

    def show_quality(self, quality: Optional[Quality]) -> None:
        """Publishes to ``~plan_quality``."""
        self._quality.publish(json.dumps({} if quality is None else quality.as_json()))

    def begin_to_wait(self, goals: Sequence[Goal]) -> None:
        """Has it found out why goals wait."""
        if self.questions is not None:
            self.questions.explain_waiting(goals)

    def miss_plan(self, goals: Sequence[Goal]) -> None:
        """Has it found out why there is no plan."""
        if self.questions is not None:
            self.questions.explain_no_plan(goals)

    def finish_reasons(self) -> None:
        """Waits for these reasons."""
        if self.questions is not None:
            self.questions.finish()

    def note(self, record: journal.Record) -> None:
        """Publishes to ``~journal``. Thread-safe."""
        with self._lock:
            if isinstance(record, journal.NumberedRecord):
                self._number, now = record.number, record.time
            else:
                self._number, now = self._number + 1, time.time()
            stamp = rospy.Time.from_sec(now)  # of wall time, whatever a simulator's clock
            self._journal.publish(
                ROSoClingoEvent(
                    stamp, self._number, record.step, record.horizon, *journal.encode(record.event)
                )
            )

    def info(self, text: str) -> None:
        """Logs at level INFO."""
        rospy.loginfo("%s", text)

    def warn(self, text: str) -> None:
        """Logs at level WARN."""
        rospy.logwarn("%s", text)


def _state(told: Told) -> int:
    """Returns what is left to do of an action."""
    if told.answer is not None:
        return int(ROSoClingoToken.ANSWERED)
    return int(ROSoClingoToken.ABORTED if told.aborted else ROSoClingoToken.PENDING)


class Node:
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
        describe: Callable[..., str] = partial(about, "", [], {}),
        encodings: Optional[Encodings] = None,
        storing: Optional[Storing] = None,
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
            storing: Where the run is stored, if anywhere; it has the same inbox.

        Raises:
            ParameterError: A parameter is wrong.
        """
        timeout = parameters.number("action_timeout", 0.0, what="seconds")
        deciding: Dict[str, Any] = {
            "abort_unreachable": parameters.flag("abort_unreachable", False),
            "patience": parameters.number("patience", 0.0, what="seconds"),
        }
        why_seconds = parameters.positive("why_seconds", _WHY_SECONDS)
        why_nice = parameters.integer("why_nice", LOWEST, LOWEST)
        explains = parameters.flag("explain", True)
        self.failure: Optional[str] = None
        self._inbox = inbox
        self._environment = environment = RosEnvironment(describe(parameters=deciding))
        self._storing = storing
        settings: Dict[str, Any] = {"action_timeout": timeout, **deciding}
        parts = (controller, planner, commands)
        if storing is None:
            self._loop = Loop(*parts, inbox, environment, **settings)
        else:
            self._loop = storing.loop(*parts, environment, **settings)
        if encodings is not None:
            # To a replay's clients, nobody listens.
            explains = explains and not isinstance(inbox, ReplayInbox)
            environment.questions = Questions(
                self._loop.state, encodings, seconds=why_seconds, nice=why_nice, explains=explains
            )
        self._ready = ready
        self._thread = threading.Thread(target=self._run, name="loop", daemon=True)
        self._goals: Dict[str, Goal] = {}
        self._server = LowLatencyActionServer(
            rospy.get_name(),
            ROSoClingoAction,
            self._on_goal,
            self._on_cancel,
            ROSoClingoResult("canceled"),
            results_kept=_RESULTS_KEPT,
        )
        self._resume()
        self._in = subscriber("~in", ROSoClingoIn, self._on_message)
        self._answer = subscriber("~answer", ROSoClingoAnswer, self._on_answer)
        self._service = rospy.Service(
            "~get_goal_information", GetGoalInformation, self._on_get_information
        )

    def _resume(self) -> None:
        """Takes over the goals of a run that goes on, and lets the action begin."""
        if not isinstance(self._loop, StoredLoop):
            self._server.start()
            return

        def client(goal: KnownGoal) -> GoalClient:
            return ActionClient(restore_goal(self._server, goal), self._loop.state.note)

        self._goals = self._loop.resume(client)
        for goal in self._loop.ended():
            self._server.remember_result(status_of(goal), ROSoClingoResult(goal.word))
        ended = [(goal, restore_goal(self._server, goal)) for goal in self._loop.unsure()]
        self._server.start()
        for goal, handle in ended:
            self._server.publish_result_again(handle, ROSoClingoResult(goal.word))

    def start(self) -> None:
        """Starts the loop."""
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
        """Whether it is not sure that the loop can use its store, or go on with the run in it."""
        return isinstance(self._loop, StoredLoop) and self._loop.is_refused

    def is_alive(self) -> bool:
        """Whether the loop still runs."""
        return self._thread.is_alive()

    def _close(self) -> None:
        # Runs before rospy stops publishing, so that open goals get their results.
        self._inbox.close()
        self._thread.join(_SECONDS_TO_END)
        if self._storing is not None:
            self._storing.store.close()  # goals stay open, and go on
        elif self._thread.is_alive():  # a solver in this process that grounds cannot be interrupted
            for goal in self._goals.values():
                goal.set_status("aborted", journal.Reason.SHUTDOWN)
        if self._goals:
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
        except RosclingoError as err:
            self._fail(str(err))
        except Exception as err:  # the open goals have been aborted; say why, and end
            rospy.logerr("internal error", exc_info=True)
            self._fail(f"internal error: {err!r}")

    def _fail(self, reason: str) -> None:
        if not self._inbox.closed:
            self.failure = reason

    def _on_message(self, message: ROSoClingoIn) -> None:
        header = message._connection_header
        if TOKENS_HEADER in header and message.id in self._environment.told:
            return  # for those who listen; it comes with its token, too
        self._put(Message(message.id, message.value, header.get("callerid", "")))

    def _on_answer(self, message: ROSoClingoAnswer) -> None:
        sender = message._connection_header.get("callerid", "")
        self._put(Answer(message.run, message.number, message.value, sender))

    def _put(self, item: Item) -> None:
        with contextlib.suppress(StoreError):  # the loop ends with that
            self._inbox.put(item)

    def _on_goal(self, handle: actionlib.ServerGoalHandle) -> None:
        # Runs under actionlib's lock: nothing here may wait.
        identifier, sent, note = handle.get_goal_id().id, handle.get_goal(), self._loop.state.note
        try:
            request = canonical(sent.request)
        except TermError as err:
            rospy.logwarn("goal rejected: %s", err)
            note(journal.GoalArrived(identifier, sent.request, tuple(sent.information)))
            note(journal.StatusSet(identifier, journal.Status.REJECTED, reason=str(err)))
            handle.set_rejected(ROSoClingoResult("rejected"), str(err))
            return
        goal = Goal(request, sent.information, identifier, ActionClient(handle, note))
        self._goals = {
            key: other for key, other in self._goals.items() if other.stage is not Stage.ENDED
        }
        self._goals[identifier] = goal
        try:
            self._inbox.put(goal)
        except StoreError as err:
            handle.set_rejected(ROSoClingoResult("rejected"), str(err))

    def _on_cancel(self, handle: actionlib.ServerGoalHandle) -> None:
        # Runs under actionlib's lock: nothing here may wait.
        goal = self._goals.get(handle.get_goal_id().id)
        if goal is not None:
            with contextlib.suppress(StoreError):  # the loop ends with that
                self._inbox.cancel(goal)

    def _on_get_information(self, request: GetGoalInformationRequest) -> Any:
        try:
            goal = self._loop.state.goals.occupant(canonical(request.key))
        except TermError as err:
            raise rospy.ServiceException(str(err)) from err
        if goal is None:
            raise rospy.ServiceException(f"no goal has the slot {request.key!r}")
        return [goal.information]


def main(commands: Callable[..., Any]) -> NoReturn:
    """Runs the node until it is shut down, and ends the process.

    Args:
        commands: Class with a method for each command, such as ``ROSCommands``.

    The exit status is that of :func:`run`. Arguments of the command line are ignored, because the
    manual passes one.
    """
    init_node("rosoclingo", usage=_USAGE)
    run(lambda: _make(commands))


def _make(commands: Callable[..., Any]) -> Node:
    store = open_store()
    inbox = open_inbox(store)  # closed before the clients are, so that the loop knows why
    controller, planner = (
        Client(parameters.text(name, name), only_own_restarts=True) for name in _SOLVERS
    )

    def ready() -> None:
        controller.wait()
        planner.wait()

    solvers = {"controller": controller.name, "planner": planner.name}
    describe = partial(about, "rosoclingo run.py", [], {}, solvers=solvers)
    decides, plans = (Insistent(each, each.name, rospy.logwarn) for each in (controller, planner))
    decider = Controller(decides, is_remote=True)
    encodings = Encodings(planner.name, controller.name)
    encodings.listen()

    def abouts() -> Dict[str, str]:
        said = encodings.abouts()
        return {name: said[solver] for name, solver in solvers.items()}

    def wait(seconds: float) -> None:
        for client in (controller, planner):
            client.wait(seconds)

    return Node(
        decider,
        plans,
        commands,
        inbox,
        ready=ready,
        describe=describe,
        encodings=encodings,
        storing=None if store is None else Storing(store, inbox, abouts, wait),
    )


def open_inbox(store: Optional[Store] = None) -> Inbox:
    """Returns the node's inbox, which a shutdown closes; a replay's takes things as recorded.

    Args:
        store: Where all that comes is written; None for nowhere.

    Raises:
        ParameterError: The parameter ``~replay`` is wrong.
    """
    recorded = rospy.get_param("~replay", None)
    if recorded is None:
        inbox = Inbox() if store is None else StoredInbox(store)
    else:
        dues = decode(recorded)
        inbox = held = ReplayInbox(dues) if store is None else StoredReplayInbox(store, dues)
        subscriber("~open_gate", Empty, lambda _: held.open())
        subscriber("~go_on", Empty, lambda _: held.go_on())
    on_shutdown(inbox.close)
    return inbox


def run(make: Callable[[], Node]) -> NoReturn:
    """Runs a node that is initialised until it is shut down, and ends the process.

    Args:
        make: Makes the node.

    The exit status is 0, 1 when the loop had to end, or 2 when a parameter is wrong or the store
    cannot be used.
    """
    try:
        node = make()
    except (ParameterError, StoreError) as err:
        give_up(err)
    node.start()
    node.spin()
    status = 0
    if node.failure is not None:
        rospy.logfatal("%s", node.failure)
        rospy.signal_shutdown(node.failure)
        status = 1
        if node.is_refused:
            end_wrong(status)
    if node.is_alive():
        # A solver in this process cannot be interrupted while it grounds.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(exit_status(status))
    sys.exit(status)
