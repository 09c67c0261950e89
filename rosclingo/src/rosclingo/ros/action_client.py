"""actionlib's client without faults of its version 1.14.0.

``actionlib.ActionClient.__init__`` opens its topics without TCP_NODELAY, so that messages wait for
each other's acknowledgements, and with queues of ten messages, so that a burst of goals loses some,
for which their sender waits for ever.

``actionlib.ClientGoalHandle.cancel`` begins to wait for an acknowledgement of a goal that has ended
already. The goal is taken for lost then.

``actionlib.action_client.CommStateMachine.update_result`` logs an error for a result that comes
again. A server that was killed and goes on publishes one again of which it does not know whether it
has left (docs/recovery.md, section "Guarantees").
"""

from __future__ import annotations

import weakref
from typing import Any, Callable, Optional

import actionlib
import rospy
from actionlib import CommState
from actionlib.action_client import CommStateMachine, GoalManager
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
    """actionlib's client, with TCP_NODELAY and long queues for all of its topics."""

    def __init__(self, name: str, spec: Any) -> None:
        """Opens the topics, in the place of actionlib's method.

        Args:
            name: Name of the action.
            spec: The action's type, such as ``ROSClingoAction``.
        """
        action, topic = spec(), rospy.remap_name(name)
        self.ActionGoal = type(action.action_goal)
        self.last_status_msg = None
        self.pub_goal = publisher(f"{topic}/goal", self.ActionGoal)
        self.pub_cancel = publisher(f"{topic}/cancel", GoalID)
        self.manager = GoalManager(spec)
        self.manager.register_send_goal_fn(self.pub_goal.publish)
        self.manager.register_cancel_fn(self.pub_cancel.publish)
        self.status_sub = subscriber(f"{topic}/status", GoalStatusArray, self._status_cb)
        result, feedback = type(action.action_result), type(action.action_feedback)
        self.result_sub = subscriber(f"{topic}/result", result, self._result_cb)
        self.feedback_sub = subscriber(f"{topic}/feedback", feedback, self._feedback_cb)

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
                a new one.

        Returns:
            The goal, which lives as long as this is kept.
        """
        if not identifier:
            handle = super().send_goal(goal, transition_cb, feedback_cb)
            return GoalHandle(handle.comm_state_machine)
        message = self.ActionGoal(goal_id=GoalID(rospy.Time.now(), identifier), goal=goal)
        message.header.stamp = message.goal_id.stamp
        machine = CommStateMachine(
            message, transition_cb, feedback_cb, self.pub_goal.publish, self.pub_cancel.publish
        )
        with self.manager.list_mutex:
            self.manager.statuses.append(weakref.ref(machine))
        self.pub_goal.publish(message)
        return GoalHandle(machine)
