"""Sets up a node's store: its parameters, and the goals that it restores."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Callable, Dict, Optional

import actionlib
import rospy

from rosclingo.errors import ParameterError
from rosclingo.ros import parameters
from rosclingo.ros.action_server import LowLatencyActionServer
from rosclingo.ros.master_watch import forget
from rosoclingo.encodings.about import Launched
from rosoclingo.encodings.started_with import started_with
from rosoclingo.errors import LaunchedError, StoreError
from rosoclingo.loop.durability import Durability, KnownGoal
from rosoclingo.msg import ROSoClingoActionGoal, ROSoClingoGoal
from rosoclingo.ros.goal_statuses import sender_of, status_of
from rosoclingo.store.folder import put_aside
from rosoclingo.store.sqlite_store import SqliteStore
from rosoclingo.store.store import Store

_FRESH, _LOSSY = "fresh", "lossy"
_SOLVER_SECONDS = 30.0  # for a solver that was lost


def open_durability(
    launched: Callable[[], Dict[str, Launched]],
    wait: Optional[Callable[[float], None]] = None,
) -> Durability:
    """Opens the store that the parameters ``~store`` and ``~resume`` name, if they do.

    Args:
        launched: Returns how each solver was started, by its role, when they are there.
        wait: Waits for solvers that are other nodes, at most for so many seconds.

    Raises:
        ParameterError: One of them, or ``~solver_timeout``, is wrong.
        StoreError: The store cannot be used.
    """
    folder, resume = parameters.text("store", ""), parameters.text("resume", "")
    if resume not in ("", _FRESH, _LOSSY):
        raise parameters.wrong("resume", f"expected {_FRESH}, {_LOSSY}, or nothing: {resume}")
    if not folder:
        if resume:
            raise ParameterError("parameter ~resume: there is no ~store, so nothing to resume")
        return Durability()
    seconds = parameters.number("solver_timeout", _SOLVER_SECONDS, what="seconds")
    path = Path(folder).expanduser().absolute()
    if resume == _FRESH:
        aside = put_aside(path, lambda: forget("resume"))  # a node that is started again goes on
        if aside is not None:
            rospy.logwarn("the store of before is now %s", aside)
    store = Store(path, lossy=resume == _LOSSY)
    if resume == _LOSSY:
        forget("resume")  # what is lost later has to be accepted again
    if store.loss:
        rospy.logwarn("goes on with the store %s, of which some is lost: %s", path, store.loss)
    if store.ended is not None:
        rospy.logwarn("the run in the store has ended, and another one begins: %s", store.ended)
    elif store.snapshot is not None:
        rospy.logwarn(
            "goes on with the run in the store %s, in step %d",
            path,
            store.snapshot.state.progress.step,
        )
    return SqliteStore(
        store,
        partial(_started_with, launched),
        None if wait is None or seconds == 0 else partial(wait, seconds),
    )


def _started_with(launched: Callable[[], Dict[str, Launched]]) -> Dict[str, str]:
    try:
        return started_with(launched())
    except LaunchedError as err:
        raise StoreError(f"{err}; a store is compared with it: start that node again") from err


def restore_goal(server: LowLatencyActionServer, known: KnownGoal) -> actionlib.ServerGoalHandle:
    """Restores a goal in an action server, which has come to an earlier process.

    Args:
        server: The server, which has not begun.
        known: The goal.
    """
    status = status_of(known)
    goal = ROSoClingoActionGoal(
        goal_id=status.goal_id, goal=ROSoClingoGoal(known.request, list(known.information))
    )
    goal._connection_header = {"callerid": sender_of(known)}
    return server.restore(goal, status.status, status.text)
