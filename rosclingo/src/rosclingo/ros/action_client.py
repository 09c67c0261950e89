"""actionlib's client without some of its faults.

Delays: actionlib offers no way to ask for TCP_NODELAY, so the client opens each topic once more,
by :mod:`rosclingo.ros.low_latency`, before actionlib opens it.

Cancel requests that come late: actionlib's client forgets that a goal has ended when it sends one.

Results that come again: a server that was killed and goes on publishes one again of which it does
not know whether it has left (docs/recovery.md, section "Guarantees"), and actionlib's client
logs an error.
"""

from __future__ import annotations

import weakref
from typing import Any, Callable, Optional

import actionlib
import rospy
from actionlib import CommState
from actionlib_msgs.msg import GoalID, GoalStatusArray

from rosclingo.ros.low_latency import publisher, subscriber


class GoalHandle(actionlib.ClientGoalHandle):
    """A client's goal handle, on which to cancel an ended goal has no effect."""

    def send_again(self) -> None:
        """Resends the goal or its cancel request, if the server has not acknowledged it."""
        machine = self.comm_state_machine
        with machine.mutex:
            if machine.state == CommState.WAITING_FOR_GOAL_ACK:
                machine.send_goal_fn(machine.action_goal)
            elif machine.state == CommState.WAITING_FOR_CANCEL_ACK:
                super().cancel()

    def cancel(self) -> None:
        """Sends a cancel request, if the goal has not ended."""
        machine = self.comm_state_machine
        with machine.mutex:
            if machine.state not in (CommState.WAITING_FOR_RESULT, CommState.DONE):
                super().cancel()


class LowLatencyActionClient(actionlib.ActionClient):
    """actionlib's client, with TCP_NODELAY on all of its topics."""

    def __init__(self, name: str, spec: Any) -> None:
        """Opens the topics.

        Args:
            name: Name of the action.
            spec: The action's type, such as ``ROSClingoAction``.
        """
        action, name = spec(), rospy.remap_name(name)
        goals = publisher(f"{name}/goal", type(action.action_goal))
        cancels = publisher(f"{name}/cancel", GoalID)
        # With actionlib's 10, a burst of goals loses some, and their client waits for ever. A
        # server that connects while actionlib opens the topics would keep the 10.
        for topic in (goals, cancels):
            topic.impl.set_queue_size = _stay
        self._topics = [
            goals,
            cancels,
            subscriber(f"{name}/status", GoalStatusArray),
            subscriber(f"{name}/result", type(action.action_result)),
            subscriber(f"{name}/feedback", type(action.action_feedback)),
        ]
        super().__init__(name, spec)

    def _result_cb(self, message: Any) -> None:
        """Handles a result, for the goals of its id that have not ended."""
        with self.manager.list_mutex:
            machines = [machine() for machine in self.manager.statuses]
        for machine in machines:
            if machine is not None and machine.state != CommState.DONE:
                machine.update_result(message)

    def send_goal(
        self,
        goal: Any,
        transition_cb: Optional[Callable[..., None]] = None,
        feedback_cb: Optional[Callable[..., None]] = None,
        identifier: str = "",
    ) -> GoalHandle:
        """Sends a goal; the arguments are those of actionlib's method, and one more.

        Args:
            goal: The goal.
            transition_cb: Called with the handle at each change.
            feedback_cb: Called with the handle and feedback.
            identifier: The goal's id, by which another process may have sent it before; empty for
                one that nobody has used.

        Returns:
            The goal, which lives as long as this is kept.
        """
        if not identifier:
            handle = super().send_goal(goal, transition_cb, feedback_cb)
            return GoalHandle(handle.comm_state_machine)
        message = self.ActionGoal(goal_id=GoalID(rospy.Time.now(), identifier), goal=goal)
        message.header.stamp = message.goal_id.stamp
        machine = actionlib.action_client.CommStateMachine(
            message, transition_cb, feedback_cb, self.pub_goal.publish, self.pub_cancel.publish
        )
        with self.manager.list_mutex:
            self.manager.statuses.append(weakref.ref(machine))
        self.pub_goal.publish(message)
        return GoalHandle(machine)


def _stay(_queue_size: int) -> None:
    """Leaves a topic's queue as it is."""
