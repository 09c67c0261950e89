"""Goal statuses in actionlib's terms: its integers, and the ways between them that it allows."""

from __future__ import annotations

import json
from typing import Tuple

import actionlib
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus

from rosclingo.errors import shorten
from rosoclingo.errors import StoreError
from rosoclingo.loop.durability import KnownGoal
from rosoclingo.loop.journal import Status, StatusSet
from rosoclingo.msg import ROSoClingoResult

_PENDING = (GoalStatus.PENDING, GoalStatus.RECALLING)
_BY_ACTIVE = (Status.ACCEPTED, Status.SUCCEEDED, Status.ABORTED)
"""What actionlib has for no goal that is pending: it becomes active before."""

_TERMINAL = {
    Status.REJECTED: GoalStatus.REJECTED,
    Status.SUCCEEDED: GoalStatus.SUCCEEDED,
    Status.ABORTED: GoalStatus.ABORTED,
}
_NOBODY = '["", 0, 0]'
_MOST_SECONDS = 2**32  # of the stamp of a message


def apply_status(handle: actionlib.ServerGoalHandle, change: StatusSet) -> None:
    """Has a goal of an action server accepted or ended, by the ways that actionlib knows."""
    status = change.status
    if status in _BY_ACTIVE and handle.get_goal_status().status in _PENDING:
        handle.set_accepted()
    if status.is_terminal:
        getattr(handle, f"set_{status.value}")(ROSoClingoResult(status.value), change.reason)


def address_of(handle: actionlib.ServerGoalHandle) -> str:
    """Returns the address by which the client of a goal is found again, as JSON."""
    header = getattr(handle.goal, "_connection_header", None) or {}
    stamp = handle.get_goal_id().stamp
    return json.dumps([header.get("callerid", ""), stamp.secs, stamp.nsecs])


def sender_of(known: KnownGoal) -> str:
    """Returns the node that has sent a stored goal; empty if that is not known.

    Raises:
        StoreError: The address is not one of :func:`address_of`.
    """
    return _read_address(known)[0]


def status_of(known: KnownGoal) -> GoalStatus:
    """Returns the status of a stored goal for those who have sent it.

    Raises:
        StoreError: The address is not one of :func:`address_of`.
    """
    if known.status is Status.CANCELED:
        status = GoalStatus.PREEMPTED if known.accepted else GoalStatus.RECALLED
    elif known.status.is_terminal:
        status = _TERMINAL[known.status]
    elif known.canceling:
        status = GoalStatus.PREEMPTING if known.accepted else GoalStatus.RECALLING
    else:
        status = GoalStatus.ACTIVE if known.accepted else GoalStatus.PENDING
    return GoalStatus(GoalID(_read_address(known)[1], known.id), status, known.reason)


def _read_address(known: KnownGoal) -> Tuple[str, rospy.Time]:
    try:
        sender, seconds, nanoseconds = json.loads(known.address or _NOBODY)
        stamp = rospy.Time(seconds, nanoseconds)
        if stamp.secs >= _MOST_SECONDS:
            raise ValueError(f"{stamp.secs} s")
        return str(sender), stamp
    except (TypeError, ValueError, OverflowError, RecursionError) as err:
        raise StoreError(
            f"the store has the goal {shorten(known.id)} with an address that this version of "
            f"rosoclingo does not write: {shorten(str(err))}; start the version that has written "
            "it, or start with resume:=fresh, which keeps it aside and begins anew"
        ) from err
