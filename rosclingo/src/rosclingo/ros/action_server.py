"""actionlib's server without faults of its version 1.14.0, all of ``actionlib.ActionServer``.

``initialize`` opens topics without TCP_NODELAY, so that messages wait for each other's
acknowledgements; :mod:`rosclingo.ros.low_latency` opens them here.

``publish_status`` sends the statuses of all goals of the last five seconds each time that one of
them changes. With hundreds of short goals a second, that takes most of the time. So the list is
short here, and while it has many goals nevertheless, changes are published together. And
``initialize`` has ``rospy.Timer`` repeat statuses, which goes by the clock of ROS, so that nothing
comes while a simulator's stands still.

``internal_goal_callback`` goes through the list of all goals for each one that comes, and has the
application take one after the other. Here goals are found by their ids. In a server with
``batches``, goals that come while others are taken are taken together after them: an application
that writes them to the disk does so once for all of them. Cancel requests overtake goals that wait
for that.

``publish_result`` and ``publish_feedback`` send to who is connected. rospy counts a subscription as
connected before the connection is made, so a client may send a goal, and the server accept or end
it, before what it says of that has a way to the client.

``internal_cancel_callback`` takes a cancel request for a goal that has left the list as one for a
goal that is still to come.
"""

from __future__ import annotations

import contextlib
import io
import threading
import time
from collections import OrderedDict, deque
from typing import Any, Callable, Deque, Dict, Iterable, Iterator, List, Optional, Sequence, Tuple

import actionlib
import actionlib.handle_tracker_deleter
import actionlib.status_tracker
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray

from rosclingo.limits import MOST_ID
from rosclingo.ros.dropped import DroppedInputs
from rosclingo.ros.low_latency import publisher, subscriber

_STATUSES = 100  # that wait for a slow client; each one tells of all goals

# Which ended goals the status list keeps: so many, and all that ended so many seconds ago. A client
# takes a goal for lost if the goal leaves the list before the client has its result.
_ENDED_GOALS = 25
_ENDED_SECONDS = 0.2

# With more open goals, statuses that change within so many seconds are coalesced. With thousands,
# a list takes long to publish: that takes a tenth of the time at most.
_MANY_GOALS = 10
_PAUSE_SECONDS = 0.05
_PAUSE_FACTOR = 9.0
_LONGEST_PAUSE = 1.0  # clients go by the lists whether the server is there

# In a server with batches, so many goals are taken or cancelled together. Then all others have a
# turn as long as that, and so long at least: neither the lock nor Python itself is fair.
# More goals than can wait stay in their connections.
_BATCH = 32
_TURN_SECONDS = 0.001
_MOST_WAITING = 20_000

_TERMINAL = {
    GoalStatus.PREEMPTED, GoalStatus.SUCCEEDED, GoalStatus.ABORTED, GoalStatus.REJECTED,
    GoalStatus.RECALLED, GoalStatus.LOST,
}  # fmt: skip

_NOT_CANCELED = {
    GoalStatus.PREEMPTING: GoalStatus.ACTIVE,
    GoalStatus.RECALLING: GoalStatus.PENDING,
}

_LONG_ID = f"its id has more than {MOST_ID} characters"

_REMEMBERED_GOALS = 10_000  # ended goals for which a cancel request may still come

# Messages of a topic kept for clients whose connection is being made: so many, and for so long.
_KEPT_MESSAGES = 100
_KEPT_SECONDS = 60.0


def _sender(message: Any) -> str:
    header = getattr(message, "_connection_header", None) or {}
    return str(header.get("callerid", ""))


_Kept = Deque[Tuple[float, str, Any]]
"""Messages that their client was not connected for: when, for which node, and the message."""


class _StatusList(GoalStatusArray):
    """The statuses of goals, of which only those are encoded that have changed."""

    def __init__(self, trackers: Iterable[Any] = ()) -> None:
        super().__init__()
        trackers = list(trackers)
        self.status_list = [one.status for one in trackers]
        self._encoded = [_encoded(one) for one in trackers]

    def serialize(self, buff: Any) -> None:
        """Writes the message."""
        self.header.serialize(buff)
        buff.write(len(self._encoded).to_bytes(4, "little"))
        buff.write(b"".join(self._encoded))


def _encoded(tracker: Any) -> bytes:
    """Returns a goal's status as it is in a message."""
    status = tracker.status
    known = getattr(tracker, "encoded", None)
    if known is None or known[:2] != (status.status, status.text):
        buffer = io.BytesIO()
        status.serialize(buffer)
        known = tracker.encoded = (status.status, status.text, buffer.getvalue())
    return bytes(known[2])


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
        rejected: Any = None,
        results_kept: int = 0,
        batches: bool = False,
    ) -> None:
        """Prepares a server that ``start`` makes public.

        Args:
            name: Name of the action.
            spec: The action's type, such as ``ROSClingoAction``.
            goal_cb: Called with the handle of each new goal, under actionlib's lock. With
                ``batches``, with a list of handles, by a thread of the server's or by that of a
                cancel request for one of them.
            cancel_cb: Called with the handle of a goal to cancel, under actionlib's lock. With
                ``batches``, with a list of handles.
            recalled: Result of a goal that actionlib recalls by itself, because its cancel request
                has come first: goal and cancel request take different connections.
            rejected: Result of a goal that the server rejects because ``goal_cb`` has failed; None
                for an empty one.
            results_kept: A goal that comes again, with the id of one of so many that have ended
                last, is not done again: its result is published again.
            batches: Whether goals that have come together are taken together.
        """
        super().__init__(name, spec, goal_cb, cancel_cb, auto_start=False)
        self.last_cancel = rospy.Time()
        self._trackers: Dict[str, Any] = {}  # of the goals in the status list, by their ids
        self._batches = batches
        self._come = threading.Condition()  # guards the goals that wait; held for moments only
        self._waiting: OrderedDict[int, Any] = OrderedDict()  # goals that are not taken yet
        self._number = 0  # of the last one
        self._dropped = DroppedInputs()
        self._recalled = recalled
        self._rejected = self.ActionResultType() if rejected is None else rejected
        self._ended: Deque[Tuple[float, GoalStatus]] = deque()  # the last to end on the right
        self._ended_ids: OrderedDict[str, None] = OrderedDict()  # the last to end comes last
        self._kept_results: _Kept = deque(maxlen=_KEPT_MESSAGES)
        self._kept_feedback: _Kept = deque(maxlen=_KEPT_MESSAGES)
        self._results: OrderedDict[str, Any] = OrderedDict()  # by the goals' ids, in this order
        self._results_kept = results_kept
        self.canceled_by = ""
        self._is_batch = False  # statuses are published after it, if
        self._changes_in_batch = False  # one of them has changed
        self._pause = _PAUSE_SECONDS
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
        if self._batches:
            thread = threading.Thread(target=self._take_waiting, name=f"goals of {name}")
            thread.daemon = True
            thread.start()
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
                tracker = self._trackers.get(oldest.goal_id.id)
                if tracker is not None and tracker.status is oldest:
                    del self._trackers[oldest.goal_id.id]
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
        tracker = self._trackers.get(message.status.goal_id.id)
        if tracker is not None and tracker.goal:
            client = (tracker.goal._connection_header or {}).get("callerid")
            if client and not topic.impl.has_connection(client):
                kept.append((time.monotonic(), client, message))

    def _send_kept(self, kept: _Kept, topic: rospy.Publisher, send: Callable[[Any], None]) -> None:
        """Sends a new subscriber the messages that were kept for it.

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
        """Takes a goal, with ``batches`` after those that have come before it.

        One that is known, by an earlier message of this id, is not done again.
        """
        if len(goal.goal_id.id) > MOST_ID:
            self._dropped.add("a goal", _LONG_ID)
            return
        if not self._batches:
            with self.lock:
                self._take([goal])
            return
        with self._come:
            self._come.wait_for(lambda: len(self._waiting) < _MOST_WAITING)
            self._number += 1
            self._waiting[self._number] = goal
            self._come.notify_all()

    def _take_waiting(self) -> None:
        """Takes the goals that wait, in order, again and again."""
        while True:
            with self._come:
                self._come.wait_for(lambda: self._waiting)
            begin = time.monotonic()
            try:
                with self.lock, self._batch():
                    self._take(self._remove_waiting(lambda _: True, _BATCH))
            except Exception:  # a bug must not end the thread
                rospy.logerr("internal error", exc_info=True)
            if self._waiting:
                _give_way(begin)

    def _remove_waiting(self, matches: Callable[[GoalID], bool], most: int) -> List[Any]:
        """Returns the first goals that wait and match, and removes them."""
        with self._come:
            found: Dict[int, Any] = {}
            for number, goal in self._waiting.items():
                if len(found) == most:
                    break
                if matches(goal.goal_id):
                    found[number] = goal
            for number in found:
                del self._waiting[number]
            self._come.notify_all()
        return list(found.values())

    def _take(self, goals: Sequence[Any]) -> None:
        """Has the application take goals; called under the lock, when the server has started.

        After an error of the application, the goals that it has left without an answer are rejected
        with it: nothing else takes them.
        """
        handles: List[Any] = []
        for goal in goals:
            try:
                handle = self._enter(goal)
            except Exception as err:  # the other goals are taken nevertheless
                if goal.goal_id.id not in self._results:
                    tracker = self._trackers.get(goal.goal_id.id)
                    self._reject(err, tracker or actionlib.status_tracker.StatusTracker(goal=goal))
                continue
            if handle is not None:
                handles.append(handle)
        try:
            self._call(self.goal_callback, handles)
        except Exception as err:  # a bug must neither lose goals nor end the thread
            self._reject(err, *(handle.status_tracker for handle in handles))

    def _reject(self, err: Exception, *trackers: Any) -> None:
        """Rejects those of some goals that are pending, with the error that is being handled."""
        rospy.logerr("internal error", exc_info=True)
        for tracker in trackers:
            if tracker.status.status in (GoalStatus.PENDING, GoalStatus.RECALLING):
                self._add(tracker).set_rejected(self._rejected, f"internal error: {err!r}")

    def _call(self, callback: Callable[..., object], handles: List[Any]) -> None:
        if self._batches and handles:
            callback(handles)
        elif handles:
            for handle in handles:
                callback(handle)

    def _enter(self, goal: Any) -> Optional[actionlib.ServerGoalHandle]:
        """Adds a goal to the status list; returns its handle if the application has to take it."""
        identifier = goal.goal_id.id
        known = self._trackers.get(identifier)
        if known is not None:
            known.goal = goal  # whose result is its sender's, who may be another process
        if identifier in self._results:
            message = self._results[identifier]
            self._keep(self._kept_results, self.result_pub, message)
            self.result_pub.publish(message)
            return None
        if known is not None:
            if known.status.status == GoalStatus.RECALLING and known.handle_tracker is None:
                known.status.status = GoalStatus.RECALLED  # its cancel request has come first
                self.publish_result(known.status, self.ActionResultType())
            if known.handle_tracker is None:
                known.handle_destruction_time = rospy.Time.now()
            return None
        handle = self._add(actionlib.status_tracker.StatusTracker(None, None, goal))
        if goal.goal_id.stamp != rospy.Time() and goal.goal_id.stamp <= self.last_cancel:
            handle.set_canceled(None, "a cancel request was for all goals up to a later time")
            return None
        return handle

    def _add(self, tracker: Any) -> actionlib.ServerGoalHandle:
        """Adds a goal to the status list."""
        if tracker.handle_tracker is None:
            deleter = actionlib.handle_tracker_deleter.HandleTrackerDeleter(self, tracker)
            tracker.handle_tracker = deleter
        self._trackers[tracker.status.goal_id.id] = tracker
        return actionlib.ServerGoalHandle(tracker, self, tracker.handle_tracker)

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
            if status in _TERMINAL:
                tracker.handle_destruction_time = rospy.Time.now()
            return self._add(tracker)

    def drop(self, handle: actionlib.ServerGoalHandle) -> None:
        """Forgets a goal in the callback, before it is acknowledged: as if it had never come.

        Args:
            handle: The goal's, with which the callback was called.
        """
        with self.lock:
            del self._trackers[handle.status_tracker.status.goal_id.id]

    def publish_result_again(self, handle: actionlib.ServerGoalHandle, result: Any) -> None:
        """Publishes the result of a goal that has ended, of which its client may not know."""
        with self.lock:
            self.publish_result(handle.status_tracker.status, result)

    def internal_cancel_callback(self, goal_id: GoalID) -> None:
        """Takes a cancel request; one for a goal that has ended and left the list does nothing.

        Goals that it is for, and that wait, are taken first. The statuses are published when the
        callbacks have returned.
        """
        if len(goal_id.id) > MOST_ID:
            self._dropped.add("a cancel request", _LONG_ID)
            return
        identifier, stamp = goal_id.id, goal_id.stamp
        has_stamp = stamp != rospy.Time()
        is_for_all = not identifier and not has_stamp

        def is_meant(other: GoalID) -> bool:
            return bool(
                is_for_all or other.id == identifier or (has_stamp and other.stamp <= stamp)
            )

        while True:
            begin = time.monotonic()
            with self.lock, self._batch():
                goals = self._remove_waiting(is_meant, _BATCH)
                self._take(goals)
            if len(goals) < _BATCH:
                break
            _give_way(begin)
        with self.lock, self._batch():
            if is_for_all or has_stamp:
                meant = [one for one in self._trackers.values() if is_meant(one.status.goal_id)]
            else:
                meant = [self._trackers[identifier]] if identifier in self._trackers else []
            if identifier and not (identifier in self._trackers or identifier in self._ended_ids):
                tracker = actionlib.status_tracker.StatusTracker(goal_id, GoalStatus.RECALLING)
                tracker.handle_destruction_time = rospy.Time.now()
                self._trackers[identifier] = tracker  # for the goal, which is to come
            self.last_cancel = max(self.last_cancel, stamp)
            self._changes_in_batch = True
            self._cancel(meant[:_BATCH], _sender(goal_id))
        for first in range(_BATCH, len(meant), _BATCH):
            _give_way(begin)
            begin = time.monotonic()
            with self.lock, self._batch():
                self._cancel(meant[first : first + _BATCH], _sender(goal_id))

    def _cancel(self, trackers: Sequence[Any], sender: str) -> None:
        """Has the application cancel goals, as a node has asked for; called under the lock."""
        self.canceled_by = sender
        handles = [
            actionlib.ServerGoalHandle(one, self, one.handle_tracker)
            for one in trackers
            if one.goal is not None
        ]
        handles = [one for one in handles if one.set_cancel_requested()]
        try:
            self._call(self.cancel_callback, handles)
        except Exception:
            for handle in handles:  # what is acknowledged is not lost
                self.take_back_cancel(handle)
            raise

    @contextlib.contextmanager
    def _batch(self) -> Iterator[None]:
        """A context, under the lock, after which the statuses are published once."""
        outer, self._is_batch = self._is_batch, True
        try:
            yield
        finally:
            self._is_batch = outer
            if self._changes_in_batch and not outer:
                self._changes_in_batch = False
                self.publish_status()

    def take_back_cancel(self, handle: actionlib.ServerGoalHandle) -> None:
        """Withdraws a cancel request; to be called in the callback, before anybody knows of it.

        Args:
            handle: The goal's, with which the callback was called.
        """
        with self.lock:
            status = handle.status_tracker.status
            status.status = _NOT_CANCELED.get(status.status, status.status)

    def publish_status(self) -> None:
        """Publishes the goals' statuses; called by actionlib at each change.

        If many goals are open, changes within a short time are published at its end. Results do not
        wait for that.
        """
        with self.lock:
            if self._is_batch:
                self._changes_in_batch = True
                return
            may_wait = self._repeats and not rospy.core.is_shutdown_requested()
            is_soon = time.monotonic() - self._published_at < self._pause
            if may_wait and is_soon and self._has_many:
                self._has_changed.set()
                return
            self._publish_list()

    def _publish_list(self) -> None:
        self._has_changed.clear()
        begin = time.monotonic()
        message = _StatusList(self._trackers.values())
        message.header.stamp = rospy.Time.now()
        if not rospy.is_shutdown():
            self.status_pub.publish(message)
        self._published_at = time.monotonic()
        pause = _PAUSE_FACTOR * (self._published_at - begin)
        self._pause = max(_PAUSE_SECONDS, min(pause, _LONGEST_PAUSE))

    def _forget_old(self) -> None:
        """Removes goals from the list whose handles were given up some time ago."""
        now = rospy.Time.now()
        for identifier, tracker in list(self._trackers.items()):
            since = tracker.handle_destruction_time
            if (since.secs or since.nsecs) and since + self.status_list_timeout < now:
                del self._trackers[identifier]

    @property
    def _has_many(self) -> bool:
        is_open = (one.status.status not in _TERMINAL for one in self._trackers.values())
        return sum(is_open) > _MANY_GOALS

    def _repeat_statuses(self, seconds: float) -> None:
        """Publishes delayed changes, and all statuses periodically, until the end."""
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
            if self._has_changed.wait(max(seconds, self._pause)):
                end.wait(self._published_at + self._pause - time.monotonic())
            if end.is_set():
                return
            try:
                with self.lock:
                    if self.started:
                        self._forget_old()  # which takes longer than a change may
                        self._publish_list()
            except Exception:  # a bug must not end the thread
                rospy.logerr("internal error", exc_info=True)


def _give_way(begin: float) -> None:
    """Sleeps as long as a batch took that began then."""
    time.sleep(max(_TURN_SECONDS, time.monotonic() - begin))
