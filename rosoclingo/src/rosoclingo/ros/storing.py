"""Sets up a node's store: its parameters, and the goals that it restores."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any, Callable, Dict, Optional

import actionlib
import rospy

from rosclingo.errors import ParameterError
from rosclingo.ros import parameters
from rosclingo.ros.action_server import LowLatencyActionServer
from rosclingo.ros.master_watch import forget
from rosoclingo.errors import LaunchedError, StoreError
from rosoclingo.launched.about import Launched
from rosoclingo.launched.started_with import started_with
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.mode.controller import Decider
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.solver import Solver
from rosoclingo.msg import ROSoClingoActionGoal, ROSoClingoGoal
from rosoclingo.ros.goal_statuses import sender_of, status_of
from rosoclingo.store.database import put_aside
from rosoclingo.store.store import KnownGoal, Store
from rosoclingo.store.stored_loop import StoredInbox, StoredLoop

_FRESH, _LOSSY = "fresh", "lossy"
_SOLVER_SECONDS = 30.0  # for a solver that was lost


class Storing:
    """A node's store, with its inbox and loop.

    Attributes:
        store: The store.
    """

    def __init__(
        self,
        store: Store,
        inbox: Inbox,
        launched: Callable[[], Dict[str, Launched]],
        wait: Optional[Callable[[float], None]] = None,
    ) -> None:
        """Puts them together.

        Args:
            store: The store.
            inbox: That of the store.
            launched: Returns how each solver was started, by its role, when they are there.
            wait: Waits for solvers that are other nodes, at most for so many seconds.

        Raises:
            ParameterError: The parameter ``~solver_timeout`` is wrong.
        """
        seconds = parameters.number("solver_timeout", _SOLVER_SECONDS, what="seconds")
        self._wait = None if wait is None or seconds == 0 else partial(wait, seconds)
        assert isinstance(inbox, StoredInbox)
        self.store = store
        self._inbox = inbox
        self._launched = launched

    def loop(
        self,
        controller: Decider,
        planner: Solver,
        commands: Callable[..., Any],
        environment: Environment,
        **settings: Any,
    ) -> StoredLoop:
        """Returns a loop, with the arguments of :class:`Loop`, that is stored."""
        for record in self.store.records:
            environment.note(record)  # for those who come late
        return StoredLoop(
            controller,
            planner,
            commands,
            self._inbox,
            environment,
            store=self.store,
            started_with=self._started_with,
            wait_for_solvers=self._wait,
            **settings,
        )

    def _started_with(self) -> Dict[str, str]:
        try:
            return started_with(self._launched())
        except LaunchedError as err:
            raise StoreError(f"{err}; a store is compared with it: start that node again") from err


def open_store() -> Optional[Store]:
    """Opens the store that the parameters ``~store`` and ``~resume`` name; None without one.

    Raises:
        ParameterError: One of them is wrong.
        StoreError: The store cannot be used.
    """
    file, resume = parameters.text("store", ""), parameters.text("resume", "")
    if resume not in ("", _FRESH, _LOSSY):
        raise parameters.wrong("resume", f"expected {_FRESH}, {_LOSSY}, or nothing: {resume}")
    if not file:
        if resume:
            raise ParameterError("parameter ~resume: there is no ~store, so nothing to resume")
        return None
    path = Path(file).expanduser().absolute()
    if resume == _FRESH:
        aside = put_aside(path, lambda: forget("resume"))  # a node that is started again goes on
        if aside is not None:
            rospy.logwarn("the store of before is now %s", aside)
    store = Store(path, lossy=resume == _LOSSY)
    if resume == _LOSSY:
        forget("resume")  # what is lost later has to be accepted again
    if store.loss:
        rospy.logwarn("goes on without what is lost: %s", store.loss)
    if store.ended is not None:
        rospy.logwarn("the run in the store has ended, and another one begins: %s", store.ended)
    elif store.snapshot is not None:
        rospy.logwarn(
            "goes on with the run in the store %s, in step %d",
            path,
            store.snapshot.state.progress.step,
        )
    return store


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
