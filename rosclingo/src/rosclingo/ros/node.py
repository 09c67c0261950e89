"""The ROS node: service ``~control`` and the action at the node's own name."""

from __future__ import annotations

import faulthandler
import os
import queue
import sys
import threading
import time
from typing import Any, Callable, Dict, List, NoReturn, Optional, Sequence, Tuple

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus
from std_msgs.msg import String

from rosclingo.errors import RosclingoError, XmlError, report
from rosclingo.health import Health
from rosclingo.msg import ROSClingoAction, ROSClingoControlLog, ROSClingoFeedback, ROSClingoResult
from rosclingo.ros import parameters
from rosclingo.ros.action_server import LowLatencyActionServer
from rosclingo.ros.client import ENDED_BY, OWN_RESTARTS_HEADER
from rosclingo.ros.diagnostics import DiagnosticsPublisher, read_parameters
from rosclingo.ros.history_publisher import HistoryPublisher
from rosclingo.ros.init import end_wrong, init_node, log_clingo, on_shutdown, spin
from rosclingo.ros.low_latency import publisher
from rosclingo.ros.master_watch import exit_status, is_respawned
from rosclingo.ros.memory_watch import end_without_memory, watch_memory
from rosclingo.solver.about import about
from rosclingo.solver.activity import FailedRequest, solver_health
from rosclingo.solver.engine import Engine
from rosclingo.solver.memory import out_of_memory
from rosclingo.solver.options import USAGE, Options, parse_options
from rosclingo.solver.programs import Policy
from rosclingo.solver.terms import parse_term
from rosclingo.solver.worker import OUT_OF_MEMORY, SHUTTING_DOWN, Caller, Job, Stop, Worker
from rosclingo.srv import ROSClingoControl, ROSClingoControlRequest
from rosclingo.wire.commands import (
    AssignExternal,
    Assumed,
    Assumption,
    Command,
    Failure,
    Improvement,
    Outcome,
    Reply,
    Result,
    Truth,
)
from rosclingo.wire.xml_codec import decode_assumptions, decode_commands, encode_reply

_SECONDS_TO_END = 0.5  # how long a shutdown waits for the solver
_LOGGED_CHARACTERS = 2**18  # a control request with more is for those that listen now
_LOG_LENGTH = 20  # control requests that late subscribers get
_SECONDS_TO_SEND = 0.2  # how long the results of aborted goals have until rospy ends connections


class GoalJob(Job):
    """A solve call that reports to an action goal."""

    def __init__(
        self,
        goal: actionlib.ServerGoalHandle,
        assumptions: Sequence[Assumed],
        note_failure: Callable[[str], None],
    ) -> None:
        super().__init__(assumptions, _caller(goal.goal))
        self._goal = goal
        self._note_failure = note_failure
        self._accepted = False

    def started(self) -> None:
        """Accepts the goal."""
        self._accepted = True
        self._goal.set_accepted()

    def improved(self, improvement: Improvement) -> None:
        """Sends the model as feedback."""
        self._goal.publish_feedback(
            ROSClingoFeedback(improvement.number, improvement.cost, improvement.symbols)
        )

    def finished(self, outcome: Outcome) -> None:
        """Ends the goal as docs/protocol.md, section "Solving", says."""
        result = ROSClingoResult(outcome.result.value, outcome.interrupted, outcome.symbols)
        if not outcome.interrupted or self.reason is None:
            self._goal.set_succeeded(result)
        elif self.reason in (Stop.CANCELED, Stop.REPLACED):
            self._goal.set_canceled(result, self._why)
        else:
            self._abort(result, self._why)

    @property
    def _why(self) -> str:
        assert self.reason is not None
        return (
            f"{self.reason.value}{ENDED_BY}{self.ended_by}" if self.ended_by else self.reason.value
        )

    def failed(self, message: str) -> None:
        """Aborts the goal."""
        rospy.logerr("solving failed: %s", message)
        self._note_failure(message)
        self._abort(ROSClingoResult(result=Result.UNKNOWN.value), message)

    def _abort(self, result: ROSClingoResult, text: str) -> None:
        if not self._accepted:  # actionlib aborts accepted goals only
            self.started()
        self._goal.set_aborted(result, text)


class SolverNode:
    """Connects a solver node's names with a worker.

    See docs/protocol.md, section "Names in the ROS graph".

    Callbacks of rospy's threads put requests to the worker and return; only ``~control`` waits
    for its reply. Make it after the node is initialised.

    Attributes:
        failure: Why the process is to end at once; empty unless memory has run out.
    """

    def __init__(self, engine: Engine, description: str) -> None:
        self._max_request_bytes = parameters.integer("max_request_bytes", 16 * 2**20, least=1)
        period, self._slow_seconds = read_parameters()
        engine.policy = Policy(
            allow_scripts=parameters.flag("allow_scripts", engine.policy.allow_scripts),
            load_path=_load_path(engine.policy),
        )
        self._ended = threading.Event()
        self.failure = ""
        self.worker = Worker(engine, self._on_out_of_memory)
        self._activity = engine.activity
        self._failed: Optional[FailedRequest] = None
        self._jobs: Dict[str, GoalJob] = {}
        # Goals are read in a thread of their own, in order: one of many megabytes takes seconds.
        self._goals: queue.Queue[Optional[actionlib.ServerGoalHandle]] = queue.Queue()
        self._reader = threading.Thread(target=self._read_goals, name="goals", daemon=True)
        self._reader.start()
        self._about = publisher("~about", String, latch=True)
        self._about.publish(description)
        self._log = HistoryPublisher("~control_log", ROSClingoControlLog, _LOG_LENGTH)
        # The action last: a client that sees it may use the service at once.
        self._service = rospy.Service("~control", ROSClingoControl, self._on_control)
        self._server = LowLatencyActionServer(
            rospy.get_name(),
            ROSClingoAction,
            self._goals.put,
            self._on_cancel,
            ROSClingoResult(result=Result.UNKNOWN.value, interrupted=True),
        )
        self._server.start()
        on_shutdown(self._close)
        DiagnosticsPublisher(self._healths, period).start()

    def _healths(self) -> List[Health]:
        """Returns the health of the solver. Thread-safe."""
        return [
            solver_health(
                self._activity,
                time.monotonic(),
                slow_seconds=self._slow_seconds,
                waiting=self.worker.waiting,
                failed=self._failed,
            )
        ]

    def spin(self) -> None:
        """Waits until the node is shut down, or has no memory any more."""
        spin(self._ended)

    def _on_out_of_memory(self, reason: str) -> None:
        """Lets the process end if another one takes its place; the client learns of it first."""
        if is_respawned():
            self.worker.close()  # whatever is asked for now is for the next process
            self.failure = reason
            self._ended.set()

    def _note_failure(self, message: str) -> None:
        self._failed = FailedRequest(message, time.monotonic())

    def _close(self) -> None:
        # Runs before rospy stops publishing, so that open goals get their results.
        self.worker.close()
        self._goals.put(None)
        self._reader.join(_SECONDS_TO_END)
        self.worker.join(_SECONDS_TO_END)
        if self._jobs:
            time.sleep(_SECONDS_TO_SEND)

    def _on_control(self, request: ROSClingoControlRequest) -> str:
        begin = time.perf_counter()
        try:
            result = self._control(request)
        except MemoryError:
            reason = str(out_of_memory("answering"))
            self._on_out_of_memory(reason)
            result = encode_reply(Reply(failure=Failure(OUT_OF_MEMORY, -1, reason)))
        log = ROSClingoControlLog(
            rospy.Time.from_sec(time.time()), request.commands, result, time.perf_counter() - begin
        )
        self._log.publish(log, keep=len(request.commands) + len(result) < _LOGGED_CHARACTERS)
        return result

    def _control(self, request: ROSClingoControlRequest) -> str:
        commands: Sequence[Command] = ()
        try:
            self._check_size(request.commands)
            commands = decode_commands(request.commands)
            reply = self.worker.control(commands, _caller(request))
        except XmlError as err:
            reply = Reply(failure=Failure(err.command or "commands", err.index, str(err)))
        if reply.failure is not None:
            is_harmless = _is_harmless(commands, reply.failure)
            log = rospy.logdebug if is_harmless else rospy.logwarn
            log("control request refused at <%s>: %s", reply.failure.command, reply.failure.message)
            if not is_harmless:
                self._note_failure(f"<{reply.failure.command}>: {reply.failure.message}")
        return encode_reply(reply)

    def _read_goals(self) -> None:
        while True:
            goal = self._goals.get()
            if goal is None:
                return
            try:
                self._take_goal(goal)
            except Exception as err:  # a bug must not leave a goal open
                message = report(err, "while reading a goal")
                rospy.logwarn("goal rejected: %s", message)
                self._note_failure(message)
                goal.set_rejected(ROSClingoResult(result=Result.UNKNOWN.value), message)

    def _take_goal(self, goal: actionlib.ServerGoalHandle) -> None:
        text = goal.get_goal().assumptions
        self._check_size(text)
        assumptions = decode_assumptions(text)
        for assumption in assumptions:
            if isinstance(assumption, Assumption):
                parse_term(assumption.name)
        job = GoalJob(goal, assumptions, self._note_failure)
        jobs = {key: old for key, old in self._jobs.items() if not old.ended}
        jobs[goal.get_goal_id().id] = job
        self._jobs = jobs
        if goal.get_goal_status().status == GoalStatus.RECALLING:  # while it was read
            job.stop(Stop.CANCELED)
        self.worker.solve(job)
        if job.stopped():
            self.worker.cancel(job)  # now that the worker knows it

    def _on_cancel(self, goal: actionlib.ServerGoalHandle) -> None:
        # Runs under actionlib's lock: nothing here may wait.
        job = self._jobs.get(goal.get_goal_id().id)
        if job is not None:
            self.worker.cancel(job, self._server.canceled_by)

    def _check_size(self, text: str) -> None:
        size = len(text.encode("utf-8", "surrogatepass"))
        if size > self._max_request_bytes:
            raise XmlError(
                f"the request has {size} bytes; ~max_request_bytes allows "
                f"{self._max_request_bytes}; send it in parts or raise the parameter"
            )


def main(arguments: Sequence[str] = ()) -> NoReturn:
    """Runs the node until it is shut down, and ends the process.

    Args:
        arguments: The command line with the program's name; ``sys.argv`` if empty.

    The exit status is 0, 1 when memory has run out in a node that is started again then, or 2 when
    the command line or a file is wrong.
    """
    faulthandler.enable()  # says where a division of clingo's has ended the process
    arguments = rospy.myargv(list(arguments) or sys.argv)[1:]
    try:
        options = parse_options(arguments)
        if options.help:
            print(USAGE, end="")
            sys.exit(0)
        engine = Engine(options, log=log_clingo)
        init_node("rosclingo")
        engine.use_threads(parameters.threads())
        node = SolverNode(engine, about("rosclingo run.py", arguments, engine.program))
    except RosclingoError as err:
        print(f"rosclingo: {err}", file=sys.stderr)
        end_wrong()
    _log_start(options, engine.policy)
    watch_memory(engine.activity)
    node.spin()
    if node.failure:
        end_without_memory(node.failure)
    if not node.worker.join(_SECONDS_TO_END):
        # clingo cannot be interrupted while it grounds.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(exit_status(0))
    sys.exit(0)


def _is_harmless(commands: Sequence[Command], failure: Failure) -> bool:
    """Tells if an external that is to be made false does not exist, or if the node shuts down."""
    if failure == SHUTTING_DOWN:
        return True
    command = commands[failure.index] if 0 <= failure.index < len(commands) else None
    return isinstance(command, AssignExternal) and command.value is Truth.FALSE


def _caller(message: Any) -> Caller:
    """Returns the sender of a goal or a request."""
    header = message._connection_header
    return Caller(header.get("callerid", ""), OWN_RESTARTS_HEADER in header)


def _load_path(default: Policy) -> Tuple[str, ...]:
    """Reads ~load_path: a list of folders, or one text with colons in between."""
    if rospy.get_param("~load_path", None) == "":  # no folder at all, and not the default
        return ()
    return tuple(filter(None, parameters.words("load_path", default.load_path, ":")))


def _log_start(options: Options, policy: Policy) -> None:
    rospy.loginfo(
        "%s is ready with %s; clingo options: %s; clients may load from: %s",
        rospy.get_name(),
        ", ".join(options.files) or "no encoding",
        " ".join(options.clingo) or "none",
        ", ".join(policy.load_path) or "nowhere",
    )
