"""Replays that kill the loop where the recorded one had died, with a real store; in one process.

``KILLED_REPLAYS=100`` in the environment makes so many random runs, and replays them.
"""

from __future__ import annotations

import threading
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any, Dict, List, Optional, Sequence, Set

import pytest
from conftest import TIMEOUT
from crashes import Client, Crash, Runs, World
from crashes import Life as CrashedLife
from draws import draws

from rosoclingo.bags.compare import text_report
from rosoclingo.bags.compare.comparison import compare
from rosoclingo.bags.read.run import Run
from rosoclingo.bags.replay.input_schedule import input_schedule
from rosoclingo.bags.replay.kills import KillSchedule
from rosoclingo.bags.replay.replays import ExactReplay
from rosoclingo.loop.inputs.replay_inbox import ReplayInbox
from rosoclingo.loop.journal import (
    LOOP,
    CancelArrived,
    Control,
    ControlArrived,
    Entry,
    GoalArrived,
    NodeResumed,
)
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.goals import Goal
from rosoclingo.store.sqlite_store import SqliteStore
from rosoclingo.store.store import Store

DYN_RESET = "dynamic.incremental.dyn_reset"
REQUESTS = ["visit(2)", "visit(4)", "visit(99)", "visit(1)", "visit(3)"]
OF_RUN = (Control.PAUSE, Control.HALT, Control.STEP, Control.RESUME)
SOLVERS = ("controller", "planner")


class Disturbed(World):
    """A world whose operator speaks now and then."""

    chance = Random(0)

    def turn(self, life: CrashedLife) -> None:
        said, before = self._to_send, len(life._items)
        if self.chance.random() < 0.6:
            self._to_send = []
        super().turn(life)
        self._to_send = self._to_send or said
        if len(life._items) == before:
            super().turn(life)


class Life(Environment):
    """A life of the replayed loop, in a thread of its own, which ends where it is killed."""

    def __init__(self, replayed: Replayed) -> None:
        self.inbox = ReplayInbox(replayed.schedule.dues)
        self.store = Store(replayed.file)
        self.goals: Dict[str, Goal] = {}
        self.error: Optional[Exception] = None
        self._replayed = replayed
        self._loop = replayed.runs.make(self.store)(self.inbox, self)
        stored = self.inbox.durability
        assert isinstance(stored, SqliteStore)
        self.goals = stored.resume(self._loop.state, lambda known: self.client(known.id))
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def client(self, key: str) -> Client:
        client = self._replayed.clients.setdefault(key, Client())
        client.note = self._loop.state.note
        return client

    def note(self, record: Any) -> None:
        self._replayed.note(self, record)

    def _run(self) -> None:
        try:
            self._loop.run()
        except Crash:
            pass
        except Exception as err:
            self.error = err
        self.store.close()


class Replayed:
    """A replay with kills. Nothing of a solver is lost by a kill here."""

    def __init__(self, runs: Runs, recorded: Sequence[Entry]) -> None:
        self.runs = runs
        self.file = runs.file()
        self.clients: Dict[str, Client] = {}
        run = Run(recorded)
        self.arrived: Set[str] = set()
        self.exact = ExactReplay(run, arrived=self.arrived, kills=True)
        self.schedule = KillSchedule(input_schedule(run, kills=True), (LOOP, *SOLVERS))
        self.entries: List[Entry] = []
        self.kills: List[str] = []
        self._lock = threading.Lock()
        self._is_killed = False  # the loop, and another one does not live yet
        self._noted = threading.Event()  # an event, since something was looked for to be sent

    def note(self, life: Life, entry: Entry) -> None:
        """Takes an event, in the life's thread; kills nodes as the player does."""
        with self._lock:
            if entry.number <= len(self.entries):
                return  # which another life has told
            self.entries.append(entry)
            self._noted.set()
            now = time.monotonic()
            self.exact.see(entry, now)
            node = self.schedule.see(entry.event)
            if node is None or not self.exact.is_exact:
                return
            self.kills.append(node)
            self.schedule.killed()
            self.exact.go_on(now, restarts=node == LOOP)
            self._is_killed |= node == LOOP
        if node == LOOP:
            raise Crash
        life.inbox.go_on()

    def play(self) -> List[Entry]:
        """Replays until the end."""
        life, end = Life(self), time.monotonic() + TIMEOUT
        try:
            while True:
                assert life.error is None, life.error
                now = time.monotonic()
                about = (self.kills, self.entries[-5:], life.inbox._dues, life.inbox._moment)
                assert now < end, about
                if self._is_killed:
                    life.thread.join(TIMEOUT)
                    self._is_killed = False
                    life = Life(self)
                with self._lock:
                    if self._is_killed:
                        continue
                    if self.exact.progress.is_finished(now):
                        return self.entries
                    planned = self.exact.due(now)
                    assert self.exact.is_exact, about
                if planned is None:
                    self._noted.wait(0.001)  # or for the time at which something is due
                    self._noted.clear()
                    continue
                self._send(life, planned.event)
        finally:
            life.inbox.close()
            life.thread.join(TIMEOUT)

    def _send(self, life: Life, event: Any) -> None:
        if isinstance(event, GoalArrived):
            goal = Goal(event.request, (), event.goal, life.client(event.goal))
            life.goals[event.goal] = goal
            life.inbox.put(goal)
            self.arrived.add(event.goal)
        elif isinstance(event, CancelArrived):
            if event.goal in life.goals:
                life.inbox.cancel(life.goals[event.goal])
        elif isinstance(event, ControlArrived):
            life.inbox.put(replace(event, seconds=0.0, token=0, refused=""))
        else:
            life.inbox.put(replace(event, seconds=0.0))


def recorded_run(runs: Runs, chance: Random, requests: Sequence[str], kills: int) -> List[Entry]:
    """Returns the journal of a run with an operator, failures and deaths, also of solvers."""
    words = [chance.choice(list(Control)) for _ in range(4)]
    said = [ControlArrived(one, "" if one in OF_RUN else "robot") for one in words]
    said += [ControlArrived(Control.RESUME), ControlArrived(Control.RELEASE, "robot")]
    failures = [number for number in range(40) if chance.random() < 0.3]
    cancels = {"2": "accepted", "3": ""} if chance.random() < 0.5 else {}
    file = runs.file()
    world = Disturbed(requests, cancels, said, failures)
    world.chance = chance
    runs.run(world, [chance.randrange(1, 40) for _ in range(kills)], file)
    with closing(Store(file)) as store:
        events = list(store.records)
    found: List[Entry] = []
    for entry in events:
        is_near = any(isinstance(one.event, NodeResumed) for one in found[-2:])
        if isinstance(entry.event, NodeResumed) or is_near or chance.random() < 0.03:
            for _ in range(chance.choice([0, 0, 1, 2])):
                lost = NodeResumed(chance.choice(SOLVERS), "lost")
                found.append(replace(entry, event=lost))
        found.append(entry)
    return [replace(entry, number=number) for number, entry in enumerate(found, 1)]


@pytest.mark.costly
@pytest.mark.parametrize("seed", draws((1, 19, 125), 40, "KILLED_REPLAYS"))
def test_a_replay_with_the_deaths_of_the_recording(tmp_path: Path, seed: int) -> None:
    runs, chance = Runs(tmp_path, DYN_RESET), Random(seed)
    runs.parameters = {
        "policies": {"go(*)": {"retries": 2}},
        "ask_before": ["go(3)"] if seed % 2 else [],
    }
    recorded = recorded_run(runs, chance, chance.sample(REQUESTS, 3), 12)
    replayed = Replayed(runs, recorded)
    again = replayed.play()
    expected = [entry.event.node for entry in recorded if isinstance(entry.event, NodeResumed)]
    comparison = compare(Run(recorded), Run(again))
    assert not comparison.differences, text_report.describe(comparison)
    assert replayed.kills == expected
