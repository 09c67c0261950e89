"""Sends requests to rosoclingo, follows them, and detects a lost server."""

from __future__ import annotations

import threading
import time
from functools import partial
from typing import Callable, Dict, List

import rospy
from actionlib import ClientGoalHandle, CommState
from actionlib_msgs.msg import GoalStatus

from rosclingo.ros.action_client import GoalHandle, LowLatencyActionClient
from rosclingo.ros.reminder import Reminder
from rosoclingo.msg import ROSoClingoAction, ROSoClingoFeedback, ROSoClingoGoal
from rosoclingo_examples.orders import Bring, Order, Orders

_POLL_SECONDS = 0.05  # how often is looked whether the server is there
_SECONDS_GONE = 0.5  # after so long without a connection the server has gone
_SECONDS_AGAIN = 1.0  # how often what the server has not confirmed is sent again


class RequestClient:
    """Sends requests to rosoclingo. Make it after the node is initialised; one thread uses it.

    What the server has not confirmed, such as what was sent while it was started again, is sent
    again, with the same id. A server does not do it twice.
    """

    def __init__(self, orders: Orders, say: Callable[[str], None]) -> None:
        """Opens the connections without waiting for the server.

        Args:
            orders: Learns what becomes of the requests.
            say: Called with a line at each change of a request, in threads of rospy's.
        """
        self.name = rospy.resolve_name("rosoclingo")
        self._orders = orders
        self._say = say
        self._action = LowLatencyActionClient(self.name, ROSoClingoAction)
        self._sent: List[GoalHandle] = []  # actionlib forgets a goal without a reference
        self._lock = threading.Lock()  # guards the one below; no other is taken under it
        self._arrived: Dict[int, ClientGoalHandle] = {}
        threading.Thread(target=self._send_again, name="send again", daemon=True).start()

    def there(self) -> bool:
        """Returns whether the server is ready for requests."""
        # Not by actionlib's wait_for_server: without a simulator's clock that never returns.
        action = self._action
        if action.last_status_msg is None:
            return False
        server = action.last_status_msg._connection_header["callerid"]
        return all(
            publisher.impl.has_connection(server)
            for publisher in (action.pub_goal, action.pub_cancel)
        ) and all(
            any(connection.callerid_pub == server for connection in subscriber.impl.connections)
            for subscriber in (action.result_sub, action.feedback_sub)
        )

    def reminder(self) -> Callable[[], bool]:
        """Returns :meth:`there`, which says every five seconds that the server is waited for."""
        reminder = Reminder()

        def there() -> bool:
            if self.there():
                return True
            if reminder.due():
                self._say(f"waiting for the server {self.name}; is rosoclingo running?")
            return False

        return there

    def watch(self, gone: Callable[[str], None]) -> None:
        """Calls a function, in a thread of its own, each time that the server has gone."""

        def run() -> None:
            seen, is_there = time.monotonic(), True
            topics = (self._action.status_sub, self._action.result_sub)
            while True:
                if all(topic.get_num_connections() for topic in topics):
                    seen, is_there = time.monotonic(), True
                elif is_there and time.monotonic() - seen > _SECONDS_GONE:
                    is_there = False
                    gone(f"the server {self.name} has gone")
                time.sleep(_POLL_SECONDS)

        threading.Thread(target=run, name="watch", daemon=True).start()

    def _send_again(self) -> None:
        while not rospy.is_shutdown():
            time.sleep(_SECONDS_AGAIN)
            if self.there():
                for handle in list(self._sent):
                    handle.send_again()

    def go_on(self) -> None:
        """Resumes the requests of an earlier process: resends those that have not arrived."""
        for order in self._orders.open:
            self._send(order)

    def send(self, bring: Bring) -> None:
        """Sends a request.

        Raises:
            LedgerError: It cannot be kept, and is not sent.
        """
        self._send(self._orders.add(bring))

    def _send(self, order: Order) -> None:
        self._say(str(order))

        def on_feedback(_: ClientGoalHandle, message: ROSoClingoFeedback) -> None:
            if self._orders.heard(order, message.status):
                self._say(str(order))

        goal = ROSoClingoGoal(order.bring.request, order.bring.information)
        on_transition = partial(self._on_transition, order)
        self._sent.append(self._action.send_goal(goal, on_transition, on_feedback, order.id))

    def cancel(self, number: int) -> None:
        """Cancels a request, as soon as the server has it.

        Raises:
            LineError: There is none of this number that could be cancelled.
            LedgerError: That cannot be kept, and nothing is sent.
        """
        order = self._orders.cancel(number)
        self._say(f"[{number}] {order.bring}: cancel requested")
        with self._lock:
            handle = self._arrived.get(number)
        if handle is not None:
            self._cancel(handle)

    def _on_transition(self, order: Order, handle: ClientGoalHandle) -> None:
        if handle.get_comm_state() == CommState.DONE:
            status = handle.get_terminal_state()
            canceled = status in (GoalStatus.PREEMPTED, GoalStatus.RECALLED)
            end = "canceled" if canceled else GoalStatus.to_string(status).lower()
            if self._orders.ended(order, end, handle.get_goal_status_text()):
                self._say(str(order))
            return
        with self._lock:
            new = order.number not in self._arrived
            self._arrived[order.number] = handle
        # actionlib takes a goal for lost that is cancelled before the server has it.
        if new and order.cancel_requested:
            self._cancel(handle)

    def _cancel(self, handle: ClientGoalHandle) -> None:
        if handle.get_comm_state() != CommState.DONE:
            handle.cancel()
