"""The nodes of the system that replays a run: how they start, are killed and start again."""

from __future__ import annotations

import time
from typing import Optional, Sequence

import rospy

from rosclingo.ros.local_master import LocalMaster, executable
from rosoclingo.bags.replay.kills import KillSchedule
from rosoclingo.bags.replay.startup import SOLVERS, Start
from rosoclingo.bags.ros.connection import Connection
from rosoclingo.errors import BagError
from rosoclingo.loop import journal
from rosoclingo.loop.inputs import replay_inbox
from rosoclingo.loop.inputs.replay_inbox import ScheduledInput

_CONNECT_SECONDS = 60.0  # how long the nodes may take to start on a busy machine
_POLL_SECONDS = 0.02


class ReplayNodes:
    """Starts the processes of a replay, and kills and restarts nodes as the recording says.

    Attributes:
        killed: How many were killed.
    """

    def __init__(
        self,
        name: str,
        system: LocalMaster,
        processes: Sequence[Start],
        connection: Connection,
        dues: Sequence[ScheduledInput],
    ) -> None:
        """Prepares the nodes, which :meth:`start` starts.

        Args:
            name: Resolved name of the node with the planning loop.
            system: Where the processes run.
            processes: The processes, that with the planning loop first.
            connection: That to the node with the planning loop.
            dues: What the loop is to take when.
        """
        self.killed = 0
        self._name = name
        self._system = system
        self._starts = dict(zip((journal.LOOP, *SOLVERS), processes))
        self._connection = connection
        self._schedule = KillSchedule(dues, self._starts)

    def start(self) -> None:
        """Starts all processes, and returns when the connection is complete.

        Raises:
            ProcessError: A process cannot be started.
            BagError: The node with the planning loop does not start.
        """
        self._set_dues()
        for node, start in self._starts.items():
            self._start(start)
            if node == journal.LOOP:  # before the others start, so that nothing is missed
                self._connect()

    def has_loop(self, name: str) -> bool:
        """Tells if a process, by its name, runs the planning loop."""
        return self._starts[journal.LOOP].name == name

    def see(self, event: journal.Event) -> Optional[str]:
        """Takes an event of the replayed journal; returns the node that is to be killed now."""
        return self._schedule.see(event)

    def kill(self, node: str) -> None:
        """Kills the node that :meth:`see` has returned, and starts another process in its place.

        Raises:
            BagError: Another loop does not start.
        """
        start = self._starts[node]
        self._system.kill(start.name)
        self.killed += 1
        self._schedule.killed()
        if node == journal.LOOP:
            self._set_dues()
            self._connection.begin_again()
        self._start(start)
        if node == journal.LOOP:
            self._connect()
        else:
            self._connection.go_on()

    def _set_dues(self) -> None:
        """Sets the ROS parameter with the schedule that the loop's node reads."""
        rospy.set_param(f"{self._name}/replay", replay_inbox.encode(self._schedule.dues))

    def _start(self, start: Start) -> None:
        command = start.command
        if command[0] == "rosrun":
            command = (executable(*command[1:3]), *command[3:])
            name = f"{start.namespace.rstrip('/')}/{start.name}"
            rospy.set_param(f"{name}/diagnostics_period", 0)  # without a subscriber
        self._system.start(
            start.name, command, namespace=start.namespace, directory=start.directory
        )

    def _connect(self) -> None:
        end = time.monotonic() + _CONNECT_SECONDS
        while not self._connection.is_complete:
            ended = self._system.failure()
            if ended is not None:
                log = self._system.processes[ended].last_lines
                raise BagError(f"{ended} does not start; the end of what it says:\n{log}")
            if time.monotonic() > end:
                raise BagError(f"there is no node {self._name} after {_CONNECT_SECONDS:.0f} s")
            time.sleep(_POLL_SECONDS)
