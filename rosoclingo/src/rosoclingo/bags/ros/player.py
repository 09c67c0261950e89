"""Plays a recording to a running system, and records its outputs."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import Callable, List, NamedTuple, Optional, Sequence, Tuple

import rospy

from rosclingo.ros.local_master import LocalMaster
from rosclingo.ros.patches import init_patched_node
from rosoclingo.bags.compare.comparison import Stall
from rosoclingo.bags.read.run import Run
from rosoclingo.bags.replay.input_schedule import input_schedule
from rosoclingo.bags.replay.progress import ReplayProgress
from rosoclingo.bags.replay.replays import ExactReplay, FreeReplay, Replay
from rosoclingo.bags.replay.startup import Start
from rosoclingo.bags.ros.connection import Connection
from rosoclingo.bags.ros.replay_nodes import ReplayNodes
from rosoclingo.errors import BagError
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Entry

# Searches are long, and what they have found is seen from what follows.
_NOT_COMPARED = (
    journal.LoopWaits, journal.MessageDropped, journal.ActionTook, journal.ClockRead,
    journal.SearchEnded,
)  # fmt: skip
_SEARCHES = (journal.CommandDone, journal.SearchEnded)
_POLL_SECONDS = 0.02
_LOOK_SECONDS = 0.2  # how often it is seen whether the processes still run
_PROGRESS_SECONDS = 2.0  # how often it is said how far the replay is
_LAST_WORDS_SECONDS = 0.5  # what follows from the end of a process may take so long to arrive
_CLOSE_SECONDS = 60.0  # how long a busy machine may take to deliver what a node has sent


class Replayed(NamedTuple):
    """The result of a replay: the journal, the stalls and the counts.

    Attributes:
        entries: What matters of the journal.
        stalls: Where the replay waited in vain.
        skipped: How many answers were not sent, since their actions did not come.
        killed: How many nodes were killed, as those of the recording were.
        seconds: How long it took, from the first event on.
        failure: Why it was given up, if it was.
    """

    entries: Tuple[Entry, ...]
    stalls: Tuple[Stall, ...]
    skipped: int
    killed: int
    seconds: float
    failure: str


def play(
    name: str,
    run: Run,
    processes: Sequence[Start],
    folder: Path,
    *,
    rate: Optional[float],
    timeout: float,
    kills: bool,
    same_encodings: bool,
    show: Callable[[int, int, float], None],
) -> Replayed:
    """Starts a system on a ROS master of its own, plays the recording to it, and ends it.

    It sets ROS's environment variables for this process and initialises a ROS node, so that it can
    be called once.

    Args:
        name: Resolved name of the node with the planning loop.
        run: What is played.
        processes: The system, that with the planning loop first.
        folder: Where logs are written.
        rate: How many times faster than recorded the inputs are sent; None for at once.
        timeout: After so many seconds without progress the replay is given up; twice the longest
            recorded search is waited for in any case. A run that is another one makes no progress
            by searching.
        kills: Whether nodes are killed where the recorded ones had died.
        same_encodings: Whether the system has the encodings that were recorded.
        show: Called now and then with the number of inputs that were sent, and of all, and the
            seconds that the replay has taken.

    Raises:
        ProcessError: A process cannot be started.
        BagError: The system does not start.
    """
    with LocalMaster(folder) as system:
        _initialise(system)
        connection = Connection(name)
        replay = ExactReplay(run, rate=rate, arrived=connection.arrived, kills=kills)
        progress = replay.progress
        dues = []  # without a journal, the gate holds nothing
        if run.has_journal:
            dues = input_schedule(run, kills=kills, same_encodings=same_encodings)
        nodes = ReplayNodes(name, system, processes, connection, dues)
        nodes.start()
        patience = _patience(run, progress, rate, timeout)
        play_on = _Player(connection, replay, system, nodes, patience)
        failure = play_on.run(show)
        seconds = play_on.seconds
        rospy.signal_shutdown("the replay is over")
    return Replayed(
        tuple(play_on.entries),
        tuple(progress.stalls),
        progress.skipped,
        nodes.killed,
        seconds,
        failure,
    )


class _Player:
    """Sends inputs as they are due, until all are sent or the replayed run makes no progress."""

    def __init__(
        self,
        connection: Connection,
        replay: ExactReplay,
        system: LocalMaster,
        nodes: ReplayNodes,
        patience: float,
    ) -> None:
        self.entries: List[Entry] = []
        self._connection = connection
        self._progress = replay.progress
        self._replay: Replay = replay
        self._system = system
        self._nodes = nodes
        self._patience = patience
        self._last: Optional[Entry] = None  # that was heard
        self._plan: Optional[Entry] = None  # the last one
        self._begun: Optional[float] = None  # when the first event came

    @property
    def seconds(self) -> float:
        """Seconds since the first event."""
        return 0.0 if self._begun is None else time.monotonic() - self._begun

    def run(self, show: Callable[[int, int, float], None]) -> str:
        """Plays, and returns why it was given up, if it was.

        Raises:
            BagError: The system does not start.
        """
        begin = heard = said = time.monotonic()
        count = len(self._progress.planned)
        looked = 0.0
        while True:
            now = time.monotonic()
            if self._progress.is_finished(now):
                return ""
            # A node that has got nothing cannot end before its journal is heard.
            planned = None if self._last is None else self._replay.due(now)
            if isinstance(self._replay, ExactReplay) and not self._replay.is_exact:
                self._connection.open_gate()
                self._replay = FreeReplay(self._progress)
                continue
            if planned is not None:
                self._connection.send(planned.event)
                continue
            if self._hear(min(_LOOK_SECONDS, self._progress.wake(now))):
                heard = time.monotonic()
            if now - looked < _LOOK_SECONDS:
                continue
            looked = now
            if count and now - said >= _PROGRESS_SECONDS:
                said = now
                show(self._progress.passed, count, now - begin)
            ended = self._system.failure()
            if ended is not None:
                return self._end_of(ended)
            if now - heard > self._patience:
                return self._silence(now - heard)

    def _hear(self, timeout: float) -> bool:
        """Takes events, and returns whether one of them is progress."""
        is_progress = False
        for entry in self._connection.hear(timeout):
            is_progress |= self._is_exact or not isinstance(entry.event, _SEARCHES)
            if self._begun is None:
                self._begun = time.monotonic()
            self._replay.see(entry, time.monotonic())
            self._last = entry
            self._keep(entry)
            self._kill(self._nodes.see(entry.event))
        return is_progress

    @property
    def _is_exact(self) -> bool:
        return isinstance(self._replay, ExactReplay) and self._replay.is_exact

    def _kill(self, node: Optional[str]) -> None:
        """Kills a node for which the loop waits, if there is one and the replay is the same."""
        if node is None or not (isinstance(self._replay, ExactReplay) and self._replay.is_exact):
            return
        self._nodes.kill(node)
        self._replay.go_on(time.monotonic(), restarts=node == journal.LOOP)

    def _keep(self, entry: Entry) -> None:
        """Keeps the entries to compare; of the plans, only the published one: they are long."""
        event = entry.event
        if isinstance(event, journal.PlanFound):
            self._plan = entry
        elif isinstance(event, journal.CommandDone):
            if event.publishes and self._plan is not None:
                self.entries.append(self._plan)
            if event.publishes or event.resets_to is not None:
                self.entries.append(entry)
        elif not isinstance(event, _NOT_COMPARED):
            self.entries.append(entry)

    def _end_of(self, name: str) -> str:
        begin = time.monotonic()
        longest = _CLOSE_SECONDS if self._nodes.has_loop(name) else _LAST_WORDS_SECONDS
        is_open = True
        while is_open and time.monotonic() < begin + longest:
            is_open = self._connection.is_open
            self._hear(_POLL_SECONDS)
            if self._progress.is_finished(time.monotonic()):
                return ""
        if self._progress.end.loop_has_ended:  # what did not come will not
            return ""
        log = self._system.processes[name].last_lines
        if self._last is None:
            raise BagError(f"{name} does not start; the end of what it says:\n{log}")
        return f"{name} has ended by itself; the end of what it said:\n{log}"

    def _silence(self, seconds: float) -> str:
        if self._last is None:
            logs = "\n".join(
                f"{name}: {line}"
                for name, process in self._system.processes.items()
                for line in process.last_lines.splitlines()
            )
            raise BagError(f"the system has done nothing for {seconds:.0f} s; it says:\n{logs}")
        last = self._last
        what = "nothing but searches" if isinstance(last.event, _SEARCHES) else "no event"
        return (
            f"there was {what} for {seconds:.0f} s (--timeout); the last event was: "
            f"{' '.join(filter(None, journal.encode(last.event)[:3]))}, in step {last.step}"
        )


def _initialise(system: LocalMaster) -> None:
    os.environ.update(system.environment())
    for name in ("ROS_IP", "ROS_NAMESPACE"):
        os.environ.pop(name, None)
    # Remappings are for another master, such as that of rostest.
    init_patched_node("replay", argv=sys.argv[:1], disable_rosout=True)


def _patience(run: Run, progress: ReplayProgress, rate: Optional[float], timeout: float) -> float:
    """Returns after how many seconds without an event a replay is given up."""
    events = (entry.event for entry in run.entries)
    searches = [0.0]  # in a row
    for event in events:
        if isinstance(event, journal.CommandDone) and not event.waits:
            searches[-1] += event.seconds
        elif not isinstance(event, journal.SearchEnded):
            searches.append(0.0)
    gaps = [one.gap / rate for one in progress.planned] if rate else []
    return max(timeout, 2 * max(searches)) + max(gaps, default=0.0)
