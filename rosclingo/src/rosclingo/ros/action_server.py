"""actionlib's server without faults of its version 1.14.0, all of ``actionlib.ActionServer``.

``initialize`` opens topics without TCP_NODELAY, so that messages wait for each other's
acknowledgements; :mod:`rosclingo.ros.low_latency` opens them here.

``publish_status`` sends the statuses of all goals of the last five seconds each time that one of
them changes. With hundreds of short goals a second, that takes most of the time. So the list is
short here, and while it has many goals nevertheless, changes are published together. And
``initialize`` has ``rospy.Timer`` repeat statuses, which goes by the clock of ROS, so that nothing
comes while a simulator's stands still.

``publish_result`` and ``publish_feedback`` send to who is connected. rospy counts a subscription as
connected before the connection is made, so a client may send a goal, and the server accept or end
it, before what it says of that has a way to the client.

``internal_cancel_callback`` takes a cancel request for a goal that has left the list as one for a
goal that is still to come.
"""

from __future__ import annotations

import threading
import time
from collections import OrderedDict, deque
from typing import Any, Callable, Deque, Tuple

import actionlib
import actionlib.handle_tracker_deleter
import actionlib.status_tracker
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray

from rosclingo.ros.low_latency import publisher, subscriber

_STATUSES = 100  # that wait for a slow client; each one tells of all goals

# Which ended goals the status list keeps: so many, and all that ended so many seconds ago. A client
# takes a goal for lost if the goal leaves the list before the client has its result.
_ENDED_GOALS = 25
_ENDED_SECONDS = 0.2

# With more open goals, statuses that change within so many seconds are coalesced.
_MANY_GOALS = 10
_PAUSE_SECONDS = 0.05

_TERMINAL = {
    GoalStatus.PREEMPTED, GoalStatus.SUCCEEDED, GoalStatus.ABORTED, GoalStatus.REJECTED,
    GoalStatus.RECALLED, GoalStatus.LOST,
}  # fmt: skip

_NOT_CANCELED = {
    GoalStatus.PREEMPTING: GoalStatus.ACTIVE,
    GoalStatus.RECALLING: GoalStatus.PENDING,
}

_REMEMBERED_GOALS = 10_000  # ended goals for which a cancel request may still come

# Messages of a topic kept for clients whose connection is being made: so many, and for so long.
_KEPT_MESSAGES = 100
_KEPT_SECONDS = 60.0


def _sender(message: Any) -> str:
    header = getattr(message, "_connection_header", None) or {}
    return str(header.get("callerid", ""))


_Kept = Deque[Tuple[float, str, Any]]
"""Messages that their client was not connected for: when, for which node, and the message."""


class LowLatencyActionServer(actionlib.ActionServer):
    """actionlib's server, with TCP_NODELAY on all of its topics and a short status list.

    Attributes:
        canceled_by: The node from which the last cancel request came; empty if it is not known.
    """

    def __init__(
        self,
        name: str,
        spec: Any,
        goal_cb: Callable[..., object],
        cancel_cb: Callable[..., object],
        recalled: Any,
        *,
        results_kept: int = 0,
    ) -> None:
        """Prepares a server that ``start`` makes public.

        Args:
            name: Name of the action.
            spec: The action's type, such as ``ROSClingoAction``.
            goal_cb: Called with the handle of each new goal, under actionlib's lock.
            cancel_cb: Called with the handle of a goal to cancel, under actionlib's lock.
            recalled: Result of a goal that actionlib recalls by itself, because its cancel request
                has come first: goal and cancel request take different connections.
            results_kept: A goal that comes again, with the id of one of so many that have ended
                last, is not done again: its result is published again.
        """
        super().__init__(name, spec, goal_cb, cancel_cb, auto_start=False)
        self._recalled = recalled
        self._ended: Deque[Tuple[float, GoalStatus]] = deque()  # the last to end on the right
        self._ended_ids: OrderedDict[str, None] = OrderedDict()  # likewise
        self._kept_results: _Kept = deque(maxlen=_KEPT_MESSAGES)
        self._kept_feedback: _Kept = deque(maxlen=_KEPT_MESSAGES)
        self._results: OrderedDict[str, Any] = OrderedDict()  # by the goals' ids, likewise
        self._results_kept = results_kept
        self._is_canceling = False
        self.canceled_by = ""
        self._repeats = False  # whether statuses are repeated
        self._has_changed = threading.Event()  # a status, and it has not been published
        self._published_at = 0.0

    def initialize(self) -> None:
        """Opens the topics, in place of actionlib's own method; called when the server starts."""
        name = rospy.remap_name(self.ns)
        statuses = f"{name}/status"
        self.status_pub = publisher(statuses, GoalStatusArray, latch=True, queue_size=_STATUSES)
        self.result_pub = publisher(
            f"{name}/result",
            self.ActionResult,
            on_subscriber=lambda send: self._send_kept(self._kept_results, self.result_pub, send),
        )
        self.feedback_pub = publisher(
            f"{name}/feedback",
            self.ActionFeedback,
            on_subscriber=lambda send: self._send_kept(
                self._kept_feedback, self.feedback_pub, send
            ),
        )
        self.goal_sub = subscriber(f"{name}/goal", self.ActionGoal, self.internal_goal_callback)
        self.cancel_sub = subscriber(f"{name}/cancel", GoalID, self.internal_cancel_callback)

        timeout = rospy.get_param(f"{name}/status_list_timeout", 5.0)
        self.status_list_timeout = rospy.Duration(timeout)
        frequency_name = rospy.search_param("actionlib_status_frequency")
        frequency = rospy.get_param(frequency_name) if frequency_name else 5.0
        self._repeats = frequency > 0
        if self._repeats:
            threading.Thread(
                target=self._repeat_statuses,
                args=(1.0 / frequency,),
                name=f"statuses of {name}",
                daemon=True,
            ).start()

    def publish_result(self, status: GoalStatus, result: Any) -> None:
        """Publishes a goal's result; called by actionlib, once for each goal."""
        with self.lock:
            if status.status == GoalStatus.RECALLED and result == self.ActionResultType():
                result = self._recalled
            now = time.monotonic()
            self._ended.append((now, status))
            self._ended_ids[status.goal_id.id] = None
            if len(self._ended_ids) > _REMEMBERED_GOALS:
                self._ended_ids.popitem(last=False)
            while len(self._ended) > _ENDED_GOALS and now - self._ended[0][0] > _ENDED_SECONDS:
                _, oldest = self._ended.popleft()
                self.status_list[:] = [
                    goal for goal in self.status_list if goal.status is not oldest
                ]
            message = self.remember_result(status, result)
            self._keep(self._kept_results, self.result_pub, message)
            super().publish_result(status, result)

    def remember_result(self, status: GoalStatus, result: Any) -> Any:
        """Caches the result of a goal, also of one of an earlier server of this name.

        Args:
            status: The goal's status.
            result: Its result.

        Returns:
            The message with both.
        """
        message = self.ActionResult(status=status, result=result)
        with self.lock:
            self._results[status.goal_id.id] = message
            while len(self._results) > self._results_kept:
                self._results.popitem(last=False)
        return message

    def publish_feedback(self, status: GoalStatus, feedback: Any) -> None:
        """Publishes feedback for a goal; called by actionlib."""
        with self.lock:
            message = self.ActionFeedback(status=status, feedback=feedback)
            self._keep(self._kept_feedback, self.feedback_pub, message)
            super().publish_feedback(status, feedback)

    def _keep(self, kept: _Kept, topic: rospy.Publisher, message: Any) -> None:
        """Keeps messages about a goal until the node that sent it is connected."""
        message.header.stamp = rospy.Time.now()
        for each in self.status_list:
            if each.status is message.status and each.goal:
                client = (each.goal._connection_header or {}).get("callerid")
                if client and not topic.impl.has_connection(client):
                    kept.append((time.monotonic(), client, message))

    def _send_kept(self, kept: _Kept, topic: rospy.Publisher, send: Callable[[Any], None]) -> None:
        """Sends kept messages to a new subscriber, for which they were.

        rospy makes connections one by one, so it is the one that is connected now.
        """
        with self.lock:
            oldest = time.monotonic() - _KEPT_SECONDS
            messages = list(kept)
            kept.clear()
            for when, client, message in messages:
                if topic.impl.has_connection(client):
                    send(message)
                elif when > oldest:
                    kept.append((when, client, message))

    def internal_goal_callback(self, goal: Any) -> None:
        """Takes a goal; one that is known, by an earlier message of this id, is not done again."""
        with self.lock:
            identifier = goal.goal_id.id
            for known in self.status_list:
                if known.status.goal_id.id == identifier:
                    known.goal = goal  # whose result is its sender's, who may be another process
            if identifier in self._results:
                message = self._results[identifier]
                self._keep(self._kept_results, self.result_pub, message)
                self.result_pub.publish(message)
            else:
                super().internal_goal_callback(goal)

    def restore(self, goal: Any, status: int, text: str = "") -> actionlib.ServerGoalHandle:
        """Takes over a goal of a server of this name that is no more; before ``start``.

        Args:
            goal: The message with which it came, with a header that names the node that sent it.
            status: How far it was: a constant of ``GoalStatus``.
            text: That of the status.
        """
        with self.lock:
            tracker = actionlib.status_tracker.StatusTracker(None, None, goal)
            tracker.status.status, tracker.status.text = status, text
            deleter = actionlib.handle_tracker_deleter.HandleTrackerDeleter(self, tracker)
            tracker.handle_tracker = deleter
            if status in _TERMINAL:
                tracker.handle_destruction_time = rospy.Time.now()
            self.status_list.append(tracker)
            return actionlib.ServerGoalHandle(tracker, self, deleter)

    def drop(self, handle: actionlib.ServerGoalHandle) -> None:
        """Forgets a goal in the callback, before it is acknowledged: as if it had never come.

        Args:
            handle: The goal's, with which the callback was called.
        """
        with self.lock:
            self.status_list.remove(handle.status_tracker)

    def publish_result_again(self, handle: actionlib.ServerGoalHandle, result: Any) -> None:
        """Publishes the result of a goal that has ended, of which its client may not know."""
        with self.lock:
            self.publish_result(handle.status_tracker.status, result)

    def internal_cancel_callback(self, goal_id: GoalID) -> None:
        """Takes a cancel request; one for a goal that has ended and left the list does nothing.

        The statuses are published when the callback has returned.
        """
        with self.lock:
            self._is_canceling = True
            self.canceled_by = _sender(goal_id)
            try:
                self._cancel(goal_id)
            finally:
                self._is_canceling = False
            if self.started:
                self.publish_status()

    def _cancel(self, goal_id: GoalID) -> None:
        with self.lock:
            listed = any(goal.status.goal_id.id == goal_id.id for goal in self.status_list)
            if goal_id.id in self._ended_ids and not listed:
                if goal_id.stamp == rospy.Time():
                    return
                goal_id = GoalID(stamp=goal_id.stamp)  # for all up to then
            super().internal_cancel_callback(goal_id)

    def take_back_cancel(self, handle: actionlib.ServerGoalHandle) -> None:
        """Withdraws a cancel request; to be called in the callback, before anybody knows of it.

        Args:
            handle: The goal's, with which the callback was called.
        """
        with self.lock:
            status = handle.status_tracker.status
            status.status = _NOT_CANCELED[status.status]

    def publish_status(self) -> None:
        """Publishes the goals' statuses; called by actionlib at each change.

        If many goals are open, changes within a short time are published at its end. Results do not
        wait for that.
        """
        with self.lock:
            now = time.monotonic()
            if self._is_canceling:
                return
            may_wait = self._repeats and not rospy.core.is_shutdown_requested()
            if may_wait and now - self._published_at < _PAUSE_SECONDS and self._has_many:
                self._has_changed.set()
                return
            self._has_changed.clear()
            self._published_at = now
            message = GoalStatusArray(status_list=[goal.status for goal in self.status_list])
            message.header.stamp = rospy.Time.now()
            self.status_pub.publish(message)

    @property
    def _has_many(self) -> bool:
        is_open = (goal.status.status not in _TERMINAL for goal in self.status_list)
        return sum(is_open) > _MANY_GOALS

    def _repeat_statuses(self, seconds: float) -> None:
        """Publishes changes that have waited, and all statuses again and again, until the end."""
        # In wall time: by these messages a client sees that the server is there, also when a
        # simulator's clock is slow, stands still or begins anew. A timer of rospy's ends then.
        end = threading.Event()

        def finish() -> None:
            end.set()
            if self._has_changed.is_set():
                self.publish_status()  # which does not wait any more
            self._has_changed.set()

        rospy.on_shutdown(finish)
        while True:
            if self._has_changed.wait(seconds):
                end.wait(self._published_at + _PAUSE_SECONDS - time.monotonic())
            if end.is_set():
                return
            try:
                with self.lock:
                    self._has_changed.clear()
                    if self.started:
                        self._published_at = time.monotonic()
                        super().publish_status()  # forgets what is old, which takes longer
            except Exception:  # a bug must not end the thread
                rospy.logerr("internal error", exc_info=True)
