"""A solver node as seen by a client: the same calls as :class:`rosclingo.solver.engine.Engine`."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from typing import Callable, List, Optional, Sequence, Set, Tuple

import rospy
from actionlib_msgs.msg import GoalID, GoalStatus
from rospy.exceptions import TransportException

from rosclingo.errors import OutOfMemoryError, ServiceError, SolverEndedError, XmlError
from rosclingo.msg import (
    ROSClingoActionFeedback,
    ROSClingoActionGoal,
    ROSClingoActionResult,
    ROSClingoGoal,
)
from rosclingo.ros.init import on_shutdown
from rosclingo.ros.low_latency import publisher, subscriber
from rosclingo.ros.presence import Presence, presence
from rosclingo.ros.reminder import Reminder
from rosclingo.solver.memory import says_out_of_memory
from rosclingo.solver.worker import OUT_OF_MEMORY, RESTARTED, SHUTTING_DOWN, Stop
from rosclingo.srv import ROSClingoControl
from rosclingo.wire.commands import Answer, Assumed, Command, Improvement, Outcome, Reply, Result
from rosclingo.wire.xml_codec import decode_reply, encode_assumptions, encode_commands

OWN_RESTARTS_HEADER = "only_own_restarts"
"""The field in the headers of a client's connections by which it is refused all but a restart,
unless the last restart of the solver was its own."""

ENDED_BY = " of "
"""Stands in the status text of a search before the name of the client that has ended it."""

_POLL_SECONDS = 0.01  # how often a waiting call looks whether it is to stop
_LOST = (rospy.ServiceException, rospy.ROSException, TransportException, OSError)
# How long the connections of a node that says that it ends do not count. It ends sooner than that,
# unless they are those of the next one already.
_ENDING_SECONDS = 10.0
_PATIENCE_SECONDS = 2.0  # a node that was started at the same time is there by then


class _Search:
    """A search under way: an action goal without a result."""

    def __init__(self, goal_id: GoalID, improved: Callable[[Improvement], None]) -> None:
        self.id = goal_id
        self.improved = improved
        self.result: Optional[ROSClingoActionResult] = None
        self.ended = threading.Event()


class Client:
    """Drives a solver node over its service and its action.

    Make it after the node is initialised. One thread at a time may use it; the callbacks run in
    rospy's threads.

    A search takes two messages, a goal and its result. actionlib's client listens to the statuses
    in between too, which takes twice as long for a search that is over at once.
    """

    def __init__(self, name: str = "rosclingo", *, only_own_restarts: bool = False) -> None:
        """Opens the connections without waiting for the node.

        Args:
            name: Name of the node, resolved like any other name.
            only_own_restarts: Whether all but a restart fails when another client has restarted
                the solver, or its node was started again.
        """
        self._headers = {OWN_RESTARTS_HEADER: "1"} if only_own_restarts else {}
        self.name = rospy.resolve_name(name)
        self._service_name = f"{self.name}/control"
        self._service: Optional[rospy.ServiceProxy] = None
        self._service_lock = threading.Lock()  # a connection carries one request at a time
        self._abandoned = False
        self._searches = 0
        self._search: Optional[_Search] = None
        self._ending: Set[object] = set()  # the connections of a node that has said that it ends
        self._ends_until = 0.0
        self._goals = publisher(f"{self.name}/goal", ROSClingoActionGoal, headers=self._headers)
        self._cancels = publisher(f"{self.name}/cancel", GoalID)
        self._results = subscriber(f"{self.name}/result", ROSClingoActionResult, self._on_result)
        self._feedback = subscriber(
            f"{self.name}/feedback", ROSClingoActionFeedback, self._on_feedback
        )
        on_shutdown(self._abandon)

    def wait(self, timeout: Optional[float] = None) -> None:
        """Waits until the node is there, and warns every five seconds that it is not, and why.

        A node that has said that it ends is not there: another one has to come in its place.

        Args:
            timeout: Longest time to wait, in seconds of the wall clock; None for ever.

        Raises:
            ServiceError: The node did not come, or this process is shutting down.
        """
        begin = time.monotonic()
        reminder = Reminder(_PATIENCE_SECONDS)
        seen = False
        while not (self._connected() and not self._ends() and self._has_service()):
            if rospy.is_shutdown():
                raise ServiceError(f"shut down while waiting for {self.name}")
            if timeout is not None and time.monotonic() - begin > timeout:
                raise ServiceError(f"there is no solver {self.name}; {self._how_to_start()}")
            if reminder.due():
                known = presence(self.name)
                seen |= known is not Presence.UNKNOWN
                # A warning, so that it goes to stderr and a client's output stays as it is.
                rospy.logwarn("waiting for the solver %s: %s", self.name, self._why(known, seen))
            time.sleep(_POLL_SECONDS)

    def _why(self, known: Presence, seen: bool) -> str:
        """Describes the node's presence, which may have been seen before, with a remedy."""
        if known is Presence.RUNNING:
            return known.value
        ended = "it has ended" if seen else "it was not started, or has ended"
        where = f": {ended}, and its terminal says why" if known is Presence.UNKNOWN else ""
        return f"{known.value}{where}; {self._how_to_start()}"

    def _how_to_start(self) -> str:
        namespace, _, name = self.name.rpartition("/")
        where = f"ROS_NAMESPACE={namespace} " if namespace else ""
        return f"start one with: {where}rosrun rosclingo run.py __name:={name} -f FILE"

    def control(self, *commands: Command) -> Tuple[Answer, ...]:
        """Runs commands in order, which ends a solve call that is open.

        Returns:
            The answers of those commands that have one.

        Raises:
            ServiceError: A command failed, or the node is not there.
            XmlError: A command holds a character that XML cannot carry.
        """
        reply = self.run(commands)
        if reply.failure is not None:
            failure = reply.failure
            raise ServiceError(
                f"{self.name} refused command {failure.index} (<{failure.command}>): "
                f"{failure.message}"
            )
        return reply.answers

    def run(self, commands: Sequence[Command]) -> Reply:
        """Runs commands in order until one fails, which ends a solve call that is open.

        Returns:
            The answers, and the failure if there was one.

        Raises:
            SolverEndedError: The node is shutting down.
            ServiceError: It is not there, or has lost what it was told before.
            OutOfMemoryError: Its memory has run out, and it has lost what it was told.
            XmlError: A command holds a character that XML cannot carry.
        """
        text = encode_commands(commands)
        with self._service_lock:
            reply = self._call(text)
        failure = reply.failure
        if failure == SHUTTING_DOWN:
            raise self._shuts_down()
        if failure is not None and (failure.command, failure.index) == (RESTARTED, -1):
            raise ServiceError(f"{self.name} has lost what it was told: {failure.message}")
        if failure is not None and (failure.command, failure.index) == (OUT_OF_MEMORY, -1):
            raise OutOfMemoryError(failure.message)
        return reply

    def _call(self, text: str) -> Reply:
        try:
            if self._service is None:
                self._service = rospy.ServiceProxy(
                    self._service_name, ROSClingoControl, persistent=True, headers={**self._headers}
                )
            return decode_reply(self._service(text).result)
        except (*_LOST, XmlError) as err:
            # A persistent connection is of no use after an error.
            self._disconnect()
            if self._abandoned:
                raise ServiceError(f"shut down while waiting for {self.name}") from err
            raise ServiceError(
                f"the connection to {self._service_name} was lost ({err}): its node ended or was "
                "restarted; the commands may have run or not, so begin with a restart"
            ) from err

    def _disconnect(self) -> None:
        if self._service is not None:
            self._service.close()
            self._service = None

    def _gone(self, reason: str) -> ServiceError:
        """Disconnects from a node that went away; returns the error to raise."""
        with self._service_lock:
            self._disconnect()
        return ServiceError(reason)

    def _shuts_down(self) -> SolverEndedError:
        """Marks the connections of a node that ends, to wait for another one; returns the error.

        However a solver that ends puts it, that is no answer: it is lost, as one that was killed.
        """
        self._ending = {one for topic in self._connections() for one in topic}
        self._ends_until = time.monotonic() + _ENDING_SECONDS
        with self._service_lock:
            self._disconnect()
        return SolverEndedError(f"the solver {self.name} has ended: {Stop.SHUTDOWN.value}")

    def _ends(self) -> bool:
        """Tells if a topic has no connection but those of a node that has said that it ends."""
        if time.monotonic() > self._ends_until:
            return False
        return not all(set(topic) - self._ending for topic in self._connections())

    def _connections(self) -> List[List[object]]:
        """Returns the connections with the node, for each topic."""
        # Others may listen to the goals as well, such as a recorder; only the node publishes.
        sends = (t.impl.connections for t in (self._goals, self._cancels))
        hears = (t.impl.connections for t in (self._results, self._feedback))
        mine = ([one for one in topic if one.endpoint_id == self.name] for topic in sends)
        return [*mine, *map(list, hears)]

    def _abandon(self) -> None:
        """Ends all waits for the solver, because the process is shutting down."""
        self._abandoned = True
        search = self._search
        if search is not None:
            self._cancels.publish(id=search.id.id)
        transport = getattr(self._service, "transport", None)
        connection = getattr(transport, "socket", None)
        if connection is not None:
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)

    def solve(
        self,
        assumptions: Sequence[Assumed] = (),
        stopped: Optional[Callable[[], bool]] = None,
        improved: Callable[[Improvement], None] = lambda _: None,
    ) -> Outcome:
        """Searches for answer sets.

        Args:
            assumptions: What to assume.
            stopped: Asked every 10 ms; the search ends when it says True.
            improved: Called with each better model while optimising, in a thread of rospy's.

        Raises:
            SolverEndedError: The node is shutting down.
            ServiceError: It is not there, went away, or rejected or aborted the goal.
            OutOfMemoryError: Its memory has run out, and it has lost what it was told.
        """
        if not self._connected():
            raise self._gone(f"there is no solver {self.name}; is its node running?")
        search = _Search(self._new_id(), improved)
        goal = ROSClingoActionGoal(
            goal_id=search.id, goal=ROSClingoGoal(encode_assumptions(assumptions))
        )
        self._search = search
        try:
            self._goals.publish(goal)
            canceled = self._wait(search, stopped)
        finally:
            self._search = None
        return self._outcome(search, canceled)

    def check(self) -> None:
        """Checks that the node is there.

        Raises:
            ServiceError: It is not.
        """
        if not self._connected():
            raise self._gone(f"the solver {self.name} went away")

    def _new_id(self) -> GoalID:
        # By wall time, where actionlib takes a simulator's, which may stand still: a server ignores
        # an id that another client of the same name has used.
        self._searches += 1
        text = f"{rospy.get_name()}-{self._searches}-{time.time():.9f}"
        return GoalID(rospy.Time.now(), text)

    def _wait(self, search: _Search, stopped: Optional[Callable[[], bool]]) -> bool:
        """Waits for the result of a search, and returns whether it was told to stop."""
        canceled = False
        while not search.ended.wait(_POLL_SECONDS):
            if not canceled and stopped is not None and stopped():
                self._cancels.publish(id=search.id.id)
                canceled = True
            if self._abandoned:
                raise ServiceError(f"shut down while {self.name} was solving")
            if not self._connected():
                raise self._gone(f"the solver {self.name} went away while solving")
        return canceled

    def _on_result(self, message: ROSClingoActionResult) -> None:
        search = self._search
        if search is not None and message.status.goal_id.id == search.id.id:
            search.result = message
            search.ended.set()

    def _on_feedback(self, message: ROSClingoActionFeedback) -> None:
        search = self._search
        if search is not None and message.status.goal_id.id == search.id.id:
            better = message.feedback
            search.improved(Improvement(better.number, tuple(better.cost), tuple(better.answerset)))

    def _outcome(self, search: _Search, canceled: bool) -> Outcome:
        assert search.result is not None
        status, result = search.result.status, search.result.result
        if status.text == Stop.SHUTDOWN.value:
            raise self._shuts_down()
        if status.status == GoalStatus.ABORTED and says_out_of_memory(status.text):
            raise OutOfMemoryError(status.text)
        # A control request or a goal of another client ends a search, too: it is interrupted then.
        ended = canceled or result.interrupted
        if status.status != GoalStatus.SUCCEEDED and not ended:
            raise ServiceError(f"{self.name} ended the goal as {_word(status)}: {status.text}")
        try:
            symbols = tuple(result.answerset)
            # An earlier process of this node's name is no other client.
            name = "" if canceled or self._abandoned else status.text.rpartition(ENDED_BY)[2]
            ended_by = name if result.interrupted and name != rospy.get_name() else ""
            return Outcome(Result(result.result), result.interrupted, symbols, ended_by)
        except ValueError as err:
            raise ServiceError(
                f"{self.name} is no solver: its result is {result.result!r}, not sat, unsat or "
                "unknown"
            ) from err

    def _connected(self) -> bool:
        return all(self._connections())

    def _has_service(self) -> bool:
        try:
            rospy.wait_for_service(self._service_name, _POLL_SECONDS)
        except rospy.ROSException:
            return False
        return True


def _word(status: GoalStatus) -> str:
    """Returns the name of a status. actionlib has a method for that, which is not loaded here."""
    constants = vars(GoalStatus).items()
    return next(name for name, value in constants if name.isupper() and value == status.status)
