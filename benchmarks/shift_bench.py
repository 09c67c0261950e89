#!/usr/bin/env python3
"""A shift of eight hours in a restaurant, simulated, with a judge of its own.

In process, in simulated time: 600 requests come to four waiters and two cooks, most of them at noon
and in the evening. Dishes cook by themselves, and get cold; batteries run down; doors close and
open again; actions fail, and take longer than planned; requests are cancelled; and the planner's
process dies now and then, and goes on with its store. Plans keep dishes on a tray for 57 s at most,
since actions take up to 1.3 times as long as planned; guests mind after 75 s.

The judge knows the restaurant, and shares no code with the planner. It counts as violations:
actions that are not possible; batteries below 0; goals that have no end, two, or one that is not
true; dishes that get cold, unless an action of the waiter failed or a door closed or opened
meanwhile; and waiters that are idle for a minute although a request is ready that they could serve.
It also says how many dishes got cold in all, and how many were late.

SEEDS in the environment says how many shifts there are, HOURS how long each is. Run by
scripts/bench. Exit status 1 says that there was a violation.
"""

from __future__ import annotations

import heapq
import math
import os
import random
import re
import sys
import tempfile
import time
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from statistics import mean
from typing import Any, Callable, Dict, FrozenSet, List, Mapping, Optional, Sequence, Set, Tuple
from unittest import mock

from harness import Report, Row, Samples
from rosclingo.solver.options import Options
from rosclingo.wire import commands as wire
from rosoclingo.errors import ShutdownError
from rosoclingo.in_process.parts import make_parts
from rosoclingo.in_process.system import System
from rosoclingo.loop.journal import AnswerArrived, Event, MessageArrived, StatusSet
from rosoclingo.loop.loop import Loop
from rosoclingo.loop.planner import task_search
from rosoclingo.loop.planner.planner import DEFAULT_PATIENCE
from rosoclingo.loop.values.execution import Execution
from rosoclingo.loop.values.goals import Goal, GoalClient
from rosoclingo.store.sqlite_store import SqliteStore
from rosoclingo.store.store import Store
from time_tasks import shortest_ways

MODE = "dynamic.incremental.dyn_reset"
SEEDS = int(os.environ.get("SEEDS", "1"))
HOURS = float(os.environ.get("HOURS", "8"))
REQUESTS_OF_AN_HOUR = 75
CANCELED, FAILING, AGAIN = 0.05, 0.03, 0.5  # of requests, of actions, and of these when tried again
KILLS, CLOSINGS = 2, 3  # each hour
WAITERS = {"anna": 100, "ben": 150, "cem": 100, "dora": 100}  # with percent of the time for ways
STARTS = {"anna": "kitchen", "ben": "dock", "cem": "hall", "dora": "dock"}
COOKS = ("cook(1)", "cook(2)")
WAYS = {
    ("dock", "hall"): 6, ("kitchen", "hall"): 8, ("sink", "kitchen"): 5, ("hall", "aisle"): 7,
    ("hall", "bar"): 5, ("bar", "aisle"): 6, ("aisle", "terrace"): 9, ("hall", "t1"): 4,
    ("hall", "t2"): 6, ("bar", "t3"): 3, ("bar", "t4"): 5, ("aisle", "t5"): 3, ("aisle", "t6"): 8,
    ("terrace", "t7"): 4, ("terrace", "t8"): 6,
}  # fmt: skip
DOORS = (("hall", "aisle"), ("bar", "aisle"), ("aisle", "terrace"))
STOVE = {"soup": 60, "steak": 120, "salad": 1}  # for how long a dish cooks by itself
COOKING = {"soup": 20, "steak": 45, "salad": 40}  # for how long a cook is busy with it
TABLES = [f"t{n}" for n in range(1, 9)]
TRAY, FULL, LOW, CHARGING, PATIENCE = 2, 400, 100, 120, 240
WARM, PLANNED_WARM = 75, 57
PICKING, PUTTING, BACK = 5, 8, 5  # seconds
IDLE = 60.0  # seconds
IMPROVING, WORK = 15.0, 0.3  # seconds between searches for better plans, and of work of each
BLOCKED = 90.0  # for so long the judge does not count on a way on which a move has failed
MANY = 10**7
_TERM = re.compile(r"(\w+)(?:\((.*)\))?")


class Crash(BaseException):
    """Kills the planner's process, in effect: nothing after it is executed."""


@dataclass
class Order:
    """A request of a client, with the state of the things that it wants.

    Attributes:
        key: The id of its goal.
        request: Its text.
        origin: Where its things are at first.
        target: Where they are wanted.
        dish: What is to be cooked; empty for nothing.
        came: When it came.
        where: The place of its things, or the waiter who has them.
        cooked: From when on it can be served.
        picked: When it was taken from the kitchen last.
        is_excused: Whether something unforeseen has happened since then.
        is_canceled: Whether its client has cancelled it.
        end: How it has ended.
        met: When its things were where they are wanted.
    """

    key: str
    request: str
    origin: str
    target: str
    dish: str
    came: float
    where: str = ""
    cooked: float = math.inf
    picked: float = math.inf
    is_excused: bool = False
    is_canceled: bool = False
    end: str = ""
    met: float = math.inf


@dataclass
class Waiter:
    """A waiter.

    Attributes:
        at: The place.
        battery: What is left.
        load: How many things it carries.
        idle: Since when it does nothing.
    """

    at: str
    battery: int = FULL
    load: int = 0
    idle: float = 0.0


@dataclass
class Running:
    """An action under way.

    Attributes:
        actuator: Who acts.
        token: The run and the number by which it is answered.
        action: The action.
        order: The request that it is for; None if it is for none.
        outcome: How it ends.
        is_over: Whether it has ended in the world.
    """

    actuator: str
    token: Tuple[str, int]
    action: str
    order: Optional[Order]
    outcome: str = "success"
    is_over: bool = False


class Client(GoalClient):
    """A client of the planner, which survives its kills."""

    def __init__(self, see: Callable[[StatusSet], None]) -> None:
        """Makes a client that forwards statuses to the judge."""
        self._see = see
        self.note: Callable[[Event], None] = lambda _: None

    def noted(self, change: StatusSet) -> None:
        """Adds the status to the journal."""
        self.note(change)

    def changed(self, change: StatusSet) -> None:
        """Forwards the status to the judge."""
        self._see(change)


class World:
    """The restaurant with its clients, which survives kills of the planner and judges it.

    Attributes:
        clock: What time it is, in seconds.
        orders: All requests that have come, by the ids of their goals.
        violations: What was wrong.
        counts: How often something has happened.
    """

    def __init__(self, seed: int) -> None:
        """Draws the events of the shift at random."""
        self.clock = 0.0
        self.orders: Dict[str, Order] = {}
        self.violations: List[str] = []
        self.counts: Dict[str, int] = dict.fromkeys(("failures", "cancels", "kills", "cold"), 0)
        self.improved = 0.0  # when it was looked for a better plan last
        self.countdown = 0  # commits until the planner dies; 0 for never
        self._waiters = {name: Waiter(place) for name, place in STARTS.items()}
        self._ways = {**WAYS, **{(w, v): n for (v, w), n in WAYS.items()}}
        self._closed: Set[FrozenSet[str]] = set()
        self._failed: Dict[Tuple[str, str], float] = {}  # ways, and until when
        self._running: Dict[str, Running] = {}
        self._open: Set[Tuple[str, int]] = set()  # tokens that the planner awaits
        self._pausing: Set[str] = set()  # actuators that try again after a pause
        self._again: Dict[str, str] = {}  # the action with which an actuator has failed last
        self._waits: Dict[Tuple[str, str], float] = {}  # since when an idle waiter could serve
        self._chances = {name: random.Random(f"{seed} {name}") for name in (*WAITERS, *COOKS)}
        self._known: Dict[Tuple[str, FrozenSet[Tuple[str, str]]], Mapping[str, int]] = {}
        self._agenda: List[Tuple[float, int, Callable[[Life], None]]] = []
        self._to_send: List[str] = []  # messages that the planner may not have
        self.clients: Dict[str, Client] = {}
        self._draw(random.Random(seed))

    def _draw(self, chance: random.Random) -> None:
        end = HOURS * 3600
        for number in range(1, int(HOURS * REQUESTS_OF_AN_HOUR) + 1):
            if chance.random() < 0.5:  # at noon, or in the evening
                when = (
                    chance.triangular(0.1, 0.4)
                    if chance.random() < 0.5
                    else chance.gauss(0.8, 0.07)
                )
            else:
                when = chance.random()
            when = min(max(when, 0.0), 1.0) * end
            table, key = chance.choice(TABLES), str(number)
            dish = chance.choice([*STOVE, ""])
            if dish:
                order = Order(key, f"serve({dish},{table})", "kitchen", table, dish, when)
            else:
                order = Order(key, f"clear({table})", table, "sink", "", when, cooked=0.0)
            order.where = order.origin
            self._at(when, lambda life, order=order: self._ask(life, order))  # type: ignore[misc]
            if chance.random() < CANCELED:
                later = when + chance.uniform(1, 200)
                self._at(later, lambda life, key=key: self._cancel(life, key))  # type: ignore[misc]
        for _ in range(int(KILLS * HOURS)):
            when, commits = chance.random() * end, chance.randint(1, 40)
            self._at(when, lambda _, n=commits: setattr(self, "countdown", n))  # type: ignore[misc]
        for _ in range(int(CLOSINGS * HOURS)):
            door, when = chance.choice(DOORS), chance.random() * end
            self._at(when, lambda life, door=door: self._close_door(life, door))  # type: ignore[misc]
            later = when + chance.uniform(60, 400)
            self._at(later, lambda life, door=door: self._open_door(life, door))  # type: ignore[misc]

    def _at(self, when: float, do: Callable[[Life], None]) -> None:
        heapq.heappush(self._agenda, (when, len(self._agenda) + MANY * int(when), do))

    def _note(self, text: str) -> None:
        self.violations.append(f"{self.clock:.0f} s: {text}")

    # What comes from outside.

    def goal(self, key: str) -> Goal:
        """Returns the goal that a client sends for an order."""
        return Goal(self.orders[key].request, (), key, self.clients[key])

    def _ask(self, life: Life, order: Order) -> None:
        self.orders[order.key] = order
        self.clients[order.key] = Client(self._see)
        life.ask(order.key)

    def _cancel(self, life: Life, key: str) -> None:
        order = self.orders[key]
        if not order.end and key in life.known:
            order.is_canceled = True
            self.counts["cancels"] += 1
            life.cancel(life.known[key])

    def _close_door(self, life: Life, door: Tuple[str, str]) -> None:
        self._closed.add(frozenset(door))
        self._excuse(*self._waiters)
        self._say(life, f"blocked({door[0]},{door[1]})", f"blocked({door[1]},{door[0]})")

    def _open_door(self, life: Life, door: Tuple[str, str]) -> None:
        self._closed.discard(frozenset(door))
        self._excuse(*self._waiters)
        self._say(life, f"unblocked({door[0]},{door[1]})")

    def _say(self, life: Life, *texts: str) -> None:
        self._to_send += texts
        self.send(life)

    def send(self, life: Life) -> None:
        """Sends what the planner has not received; messages that it has stored are not repeated."""
        while self._to_send:
            message = MessageArrived("info", self._to_send[0])
            try:
                life.put(message)
            finally:
                if message in (item for _, item in life.store.inputs(lambda _: None)):
                    del self._to_send[0]

    # What the planner does.

    def hear(self, life: Life, run: str, told: Sequence[Execution]) -> None:
        """Begins actions that the planner has published."""
        self._open = {(run, one.number) for one in told if one.answer is None}
        self._pausing = {one.actuator for one in life.loop.state.executions.retrying}
        for one in told:
            token = run, one.number
            before = self._running.get(one.actuator)
            if one.answer is None and (before is None or before.token != token):
                if before is not None and not before.is_over:
                    self._note(f"{one.actuator} is to {one.action} while it does {before.action}")
                self._begin(life, one.actuator, one.action, token)

    def _begin(self, life: Life, actuator: str, action: str, token: Tuple[str, int]) -> None:
        name, argument = _split(action)
        order = None
        if name in ("cook", "pick", "put", "back"):
            keys = [key for key, goal in life.known.items() if goal.slot == argument]
            order = next((self.orders[key] for key in keys if not self.orders[key].end), None)
        running = self._running[actuator] = Running(actuator, token, action, order)
        why = self._obstacle(running, name, argument)
        if why:
            self._note(f"{actuator} begins {action}, but {why}")
        chance = self._chances[actuator]
        limit = AGAIN if self._again.pop(actuator, "") == action else FAILING
        if chance.random() < limit or why:
            running.outcome = "failure"
            self.counts["failures"] += 1
            self._excuse(actuator)
            self._again[actuator] = action
        waiter = self._waiters.get(actuator)
        seconds = {"pick": PICKING, "put": PUTTING, "back": BACK, "charge": CHARGING}.get(name, 1)
        if name == "cook" and order is not None:
            seconds = COOKING[order.dish]
        if name == "go" and waiter is not None:
            length = self._ways.get((waiter.at, argument), 0)
            seconds = length * WAITERS[actuator] // 100
            waiter.battery -= length
            if waiter.battery < 0:
                self._note(f"the battery of {actuator} is {waiter.battery}")
            if frozenset((waiter.at, argument)) in self._closed:  # it has closed just now
                running.outcome = "failure"
                self._excuse(actuator)
        if name == "put" and order is not None and order.dish and not why:
            self._judge_dish(order, actuator)
        self._at(
            self.clock + seconds * chance.uniform(0.9, 1.3), lambda life: self._end(life, running)
        )

    def _judge_dish(self, order: Order, waiter: str) -> None:
        """Judges how long a dish that is served now was carried."""
        if self.clock - order.picked > WARM:
            self.counts["cold"] += 1
            if not order.is_excused:
                self._note(f"{order.request} (goal {order.key}) gets cold with {waiter}")

    def _excuse(self, *waiters: str) -> None:
        """Excuses dishes that get cold with waiters, for something that no plan knows of."""
        for order in self.orders.values():
            order.is_excused |= order.where in waiters

    def _obstacle(self, running: Running, name: str, argument: str) -> str:
        """Returns why an action is not possible; empty if it is."""
        actuator, order = running.actuator, running.order
        waiter = self._waiters.get(actuator)
        if name == "cook":
            fits = order is not None and order.dish and order.cooked == math.inf
            return "" if waiter is None and fits else "there is nothing to cook"
        if waiter is None:
            return "it is no waiter"
        if name == "go":
            return "" if (waiter.at, argument) in self._ways else f"it is at {waiter.at}"
        if name == "charge":
            return "" if waiter.at == "dock" else f"it is at {waiter.at}"
        if order is None:
            return "there is no such request"
        place = order.target if name == "put" else order.origin
        if waiter.at != place:
            return f"it is at {waiter.at}"
        if name == "pick" and order.where != order.origin:
            return f"what it wants is at {order.where}"
        if name == "pick" and order.cooked > self.clock + 1:
            return f"it cooks until {order.cooked:.0f}"
        if name == "pick" and waiter.load >= TRAY:
            return "its tray is full"
        if name in ("put", "back") and order.where != actuator:
            return f"it has nothing of this request, which {order.where} has"
        return ""

    def _end(self, life: Life, running: Running) -> None:
        """Ends an action in the world; the planner is told as soon as it listens."""
        running.is_over = True
        name, argument = _split(running.action)
        waiter, order = self._waiters.get(running.actuator), running.order
        if waiter is not None:
            waiter.idle = self.clock
        if name == "go" and waiter is not None:
            if running.outcome == "success":
                waiter.at = argument
            else:
                self._failed[waiter.at, argument] = self.clock + BLOCKED
        elif running.outcome == "success":
            self._change(running, name, waiter, order)
        self.answer(life)

    def _change(
        self, running: Running, name: str, waiter: Optional[Waiter], order: Optional[Order]
    ) -> None:
        if name == "charge" and waiter is not None:
            waiter.battery = FULL
        elif name == "cook" and order is not None:
            order.cooked = self.clock + STOVE[order.dish]
        elif name == "pick" and order is not None and waiter is not None:
            order.where, order.picked = running.actuator, self.clock
            order.is_excused = False
            waiter.load += 1
        elif name in ("put", "back") and order is not None and waiter is not None:
            order.where = order.target if name == "put" else order.origin
            waiter.load -= 1
            order.met = self.clock if name == "put" else order.met

    def answer(self, life: Life) -> None:
        """Answers all actions that have ended and that the planner waits for."""
        over = [one for one in self._running.values() if one.is_over and one.token in self._open]
        for one in over:
            self._open.discard(one.token)
        if over:
            life.put(*(AnswerArrived(*one.token, one.outcome) for one in over))

    def _see(self, change: StatusSet) -> None:
        """Judges the status of a goal."""
        order, word = self.orders[change.goal], change.status.value
        if not change.status.is_terminal:
            return
        about = f"goal {order.key}, {order.request}, is {word} ({change.reason})"
        if order.end and order.end != word:
            self._note(f"{about}, and was {order.end}")
        if order.end:
            return
        order.end = word
        if word == "succeeded" and order.where != order.target:
            self._note(f"{about}, but its things are at {order.where}")
        elif word in ("canceled", "preempted", "recalled"):
            if not order.is_canceled:
                self._note(f"{about}, and was not cancelled")
            if order.where not in (order.origin, order.target):
                self._note(f"{about}, but its things are at {order.where}")
        elif word not in ("succeeded", "canceled"):
            self._note(about)

    # Time.

    def turn(self, life: Life) -> None:
        """Advances the clock to the next event and lets it happen, while the planner waits."""
        self.send(life)
        lost = [key for key, o in self.orders.items() if not o.end and key not in life.known]
        for key in lost:
            life.ask(key)
        self.answer(life)
        if life.has_items:
            return
        moments = [*life.own_moments(), *(one[0] for one in self._agenda[:1])]
        if not moments:
            life.close()
            return
        self.clock = max(self.clock, min(moments))
        life.loop.state.watchdog.look_soon()  # whatever is due
        while self._agenda and self._agenda[0][0] <= self.clock:
            heapq.heappop(self._agenda)[2](life)
        self._judge_idleness(life)

    def _judge_idleness(self, life: Life) -> None:
        """Counts waiters that are idle although there is a request that they could serve."""
        acting = {one.actuator for one in self._running.values() if not one.is_over}
        acting |= self._pausing
        idle = [name for name in self._waiters if name not in acting]
        ready = [
            order for key in life.known
            for order in [self.orders[key]]
            if not (order.end or order.is_canceled) and order.where == order.origin
            and order.cooked <= self.clock and life.known[key].slot is not None
        ]  # fmt: skip
        before, self._waits = self._waits, {}
        for name in idle if ready else ():
            waiter = self._waiters[name]
            ways = self._distances(waiter.at)
            for order in ready:
                there = ways.get(order.origin, MANY)
                length = there + self._distances(order.origin).get(order.target, MANY)
                length += self._distances(order.target).get("dock", MANY)
                if waiter.load < TRAY and max(LOW + there, length) <= waiter.battery:
                    since = max(before.get((name, order.key), self.clock), waiter.idle)
                    self._waits[name, order.key] = since
                    limit = IDLE + there * WAITERS[name] / 100
                    if since <= self.clock - limit:
                        text = f"{name} is idle since {waiter.idle:.0f} at {waiter.at}, and could"
                        self._note(f"{text} serve {order.request} (goal {order.key})")
                        self._waits[name, order.key] = math.inf  # it is said once

    def _distances(self, start: str) -> Mapping[str, int]:
        """Returns the distances to all places on ways that are known to be open."""
        failed = {way for way, until in self._failed.items() if until >= self.clock}
        shut = frozenset(
            one for one in self._ways if frozenset(one) in self._closed or one in failed
        )
        if (start, shut) not in self._known:
            near: Dict[str, List[Tuple[str, int]]] = {}
            for (v, w), seconds in self._ways.items():
                if (v, w) not in shut:
                    near.setdefault(v, []).append((w, seconds))
            self._known[start, shut] = shortest_ways(start, near)
        return self._known[start, shut]

    def judge(self) -> None:
        """Judges the end of the shift."""
        for order in self.orders.values():
            if not order.end:
                self._note(f"goal {order.key}, {order.request}, has not ended")


def _split(action: str) -> Tuple[str, str]:
    match = _TERM.fullmatch(action)
    return (match[1], match[2] or "") if match else (action, "")


class Life(System):
    """The planner's loop, from its start to its end or until it is killed.

    Attributes:
        store: Its store.
        known: The goals that it knows and that have not ended, by their ids.
    """

    def __init__(self, world: World, store: Store, make: Callable[..., Loop]) -> None:
        """Resumes from the store."""
        self._world = world
        self.store = store
        self.known: Dict[str, Goal] = {}
        super().__init__(make)

    @property
    def clock(self) -> float:
        """The time of the simulated world, in seconds."""
        return self._world.clock

    @clock.setter
    def clock(self, value: float) -> None:
        self._world.clock = max(self._world.clock, value)

    @property
    def improves(self) -> bool:
        """True if anytime improvement is due; rate-limited, since it takes most of the run."""
        return self.clock >= self._world.improved + IMPROVING

    @improves.setter
    def improves(self, value: bool) -> None:
        """Ignores what the loop says: the clock of the world decides."""

    def stays_quiet(self, seconds: float) -> bool:
        """Says that nothing arrives: events come between two steps of the loop only."""
        self._world.improved = self.clock
        return True

    @property
    def has_items(self) -> bool:
        """True if the inbox has an item."""
        return self._has_something()

    def ask(self, key: str) -> None:
        """Sends a goal to the loop."""
        goal = self._world.goal(key)
        self._world.clients[key].note = self.loop.state.note
        self.put(goal)
        self.known[key] = goal

    def wait(self, timeout: float) -> bool:
        """Lets the world act until the loop has something to do."""
        for key in [key for key in self.known if self._world.orders[key].end]:
            del self.known[key]
        if not self._has_something():
            self._world.turn(self)
        return True

    def show_executions(self, run: str, executions: Sequence[Execution]) -> None:
        """Publishes an action to its actuator."""
        self._world.hear(self, run, executions)

    def note(self, record: Any) -> None:
        """Keeps no journal, since the store has it."""

    def live(self) -> None:
        """Resumes from the store, and runs until the loop ends or is killed."""
        clients = self._world.clients
        durability = self.durability
        assert isinstance(durability, SqliteStore)
        for client in clients.values():
            client.note = self.loop.state.note
        self.known = durability.resume(self.loop.state, lambda known: clients[known.id])
        for known in durability.unsure:
            if not self._world.orders[known.id].end:
                clients[known.id].changed(StatusSet(known.id, known.status, "", known.reason))
        self.loop.prepare()
        try:
            while True:
                self.loop.step()
        except ShutdownError as err:
            self.loop.end(str(err))


def shift(folder: Path, seed: int) -> World:
    """Simulates a shift; returns its world, which has judged it."""
    world, file = World(seed), folder / "restaurant.lp"
    encoding = Path(__file__).resolve().parent / "encodings" / "shift.lp"
    facts = [f'#include "{encoding}".', "#program base.", "kitchen(kitchen). sink(sink)."]
    facts += [f"waiter({one}). start({one},{place})." for one, place in STARTS.items()]
    facts += [f"slow({one},{percent})." for one, percent in WAITERS.items() if percent != 100]
    facts += [f"cook({cook})." for cook in COOKS] + [f"table({table})." for table in TABLES]
    facts += [f"corridor({v},{w},{n})." for (v, w), n in WAYS.items()] + ["charger(dock)."]
    facts += [f"dish({dish},{COOKING[dish]}). stove({dish},{n})." for dish, n in STOVE.items()]
    file.write_text("\n".join([*facts, ""]), encoding="utf-8")
    constants = {"tray": TRAY, "full": FULL, "charging": CHARGING, "warm": PLANNED_WARM,
                 "patience": PATIENCE, "low": LOW, "slots": 12}  # fmt: skip
    options = [word for name, n in constants.items() for word in ("-c", f"{name}={n}")]
    parts = make_parts(MODE, Options((str(file),), tuple(options)), ("-c", "steps=300"))

    def point(_: str) -> None:
        if world.countdown:
            world.countdown -= 1
            if not world.countdown:
                raise Crash

    def make(store: Store) -> Callable[..., Loop]:
        durability = SqliteStore(store, dict)
        return lambda inbox, environment: parts.loop(
            inbox, environment, durability=durability, patience=DEFAULT_PATIENCE
        )

    while True:
        parts.planner.run([wire.Restart()])  # what it was is lost, too
        with closing(Store(folder / f"{seed}.store", point=point)) as store:
            try:
                with mock.patch.object(task_search, "_IMPROVE_SECONDS", WORK):
                    Life(world, store, make(store)).live()
            except Crash:
                world.counts["kills"] += 1
                continue
        world.judge()
        return world


def main() -> int:
    """Simulates all shifts; returns the exit status."""
    report = Report("shift")
    for seed in range(SEEDS):
        begin = time.perf_counter()
        with tempfile.TemporaryDirectory() as name:
            world = shift(Path(name), seed)
        seconds = time.perf_counter() - begin
        served = [one for one in world.orders.values() if one.end == "succeeded"]
        waits = Samples("s", tuple(one.met - one.came for one in served))
        late = sum(bool(one.dish) and one.met - one.came > PATIENCE for one in served)
        print(f"shift {seed}: {len(world.orders)} requests, {len(served)} served, {world.counts}, "
              f"mean wait {mean(waits.values):.0f} s, simulated in {seconds:.0f} s")  # fmt: skip
        print(*world.violations[:50], sep="\n")
        report.add(
            Row(f"shift {seed}: wait", waits, None, "violations", len(world.violations), "", 0)
        )
        report.add(Row(f"shift {seed}: late", waits, None, "dishes", late, "", None))
        report.add(
            Row(f"shift {seed}: cold", waits, None, "dishes", world.counts["cold"], "", None)
        )
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())
