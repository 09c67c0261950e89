"""A run whose process dies now and then, and the world around it, which goes on."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, Collection, Dict, List, Mapping, Optional, Sequence, Tuple, Union

from rosclingo.solver.options import Options
from rosclingo.wire import commands as wire
from rosoclingo.errors import ShutdownError
from rosoclingo.in_process.parts import EXAMPLES, Parts, make_parts
from rosoclingo.in_process.system import System
from rosoclingo.loop.journal import (
    AnswerArrived,
    ControlArrived,
    Event,
    MessageArrived,
    Status,
    StatusSet,
)
from rosoclingo.loop.loop import Loop
from rosoclingo.loop.values.execution import Execution
from rosoclingo.loop.values.goals import Goal, GoalClient
from rosoclingo.store.sqlite_store import SqliteStore
from rosoclingo.store.store import Store

ENDS = ("rejected", "succeeded", "canceled", "aborted")
MANY = 10_000  # lives, or decisions in one


class Crash(BaseException):
    """The process is no more."""


class Client(GoalClient):
    """A client, which lives on; it counts what it is told."""

    def __init__(self) -> None:
        self.words: List[str] = []
        self.known = False  # to the node, which has acknowledged it
        self.note: Callable[[Event], None] = lambda _: None

    def noted(self, change: StatusSet) -> None:
        self.note(change)

    def changed(self, change: StatusSet) -> None:
        self.words.append(change.status.value)

    def end(self) -> List[str]:
        return [word for word in self.words if word in ENDS]


class World:
    """Clients and a robot that outlive the process, and judge what it does.

    The robot does a token once, and answers it again whenever it is shown as open. A client sends a
    goal again that nobody knows. A message is sent once, unless it has not come.

    Attributes:
        effects: What was done, in order.
        latched: What who comes late hears of actions; None if there is nothing.
    """

    def __init__(
        self,
        requests: Sequence[str],
        cancel: Mapping[str, str] = {},
        messages: Sequence[Union[MessageArrived, ControlArrived]] = (),
        failures: Collection[int] = (),
        asks: Optional[Sequence[str]] = None,
    ) -> None:
        """Nothing has happened yet.

        Args:
            requests: What is asked for; the ids are the numbers, from 1.
            cancel: By their ids, what is cancelled; as soon as it has a status, if one is given.
            messages: What is said besides, also by an operator, when the first goal is known.
            failures: The numbers of the tokens that are answered by ``failure``.
            asks: The requests that are asked for by themselves, by their ids; None for all.
        """
        self.effects: List[Tuple[str, str]] = []
        self.latched: Optional[str] = None
        self.clients: Dict[str, Client] = {str(n): Client() for n in range(1, len(requests) + 1)}
        self._requests = dict(zip(self.clients, requests))
        self._to_ask = list(self.clients if asks is None else asks)
        self._to_cancel = dict(cancel)
        self._to_send = list(messages)
        self._failures = failures
        self._done: Dict[str, Tuple[str, int]] = {}  # the last token of each actuator
        self._open: List[Tuple[str, int]] = []  # tokens without an answer

    def goal(self, key: str) -> Goal:
        return Goal(self._requests[key], (), key, self.clients[key])

    def hear(self, run: str, told: Sequence[Execution]) -> None:
        self._open = [(run, one.number) for one in told if one.answer is None]
        for one in told:
            if one.answer is None and self._done.get(one.actuator) != (run, one.number):
                self._done[one.actuator] = run, one.number
                self.effects.append((one.actuator, one.action))

    def turn(self, life: Life) -> None:
        """Something happens while the loop waits: a message, a goal, a cancel, or an answer."""
        if self._to_send and life.known:
            self._send(life, self._to_send[0])
            return
        for key in list(self._to_ask):
            if key in life.known or self.clients[key].end():
                self._to_ask.remove(key)
                continue
            life.ask(key)
            return
        for key, awaited in list(self._to_cancel.items()):
            client = self.clients[key]
            if key in life.known and not client.end() and awaited in ["", *client.words]:
                life.cancel(life.known[key])
                del self._to_cancel[key]
                return
        for run, number in self._open[:1]:
            life.put(
                AnswerArrived(run, number, "failure" if number in self._failures else "success")
            )

    def _send(self, life: Life, message: Union[MessageArrived, ControlArrived]) -> None:
        try:
            life.put(message)
        finally:
            if message in (item for _, item in life.store.inputs(lambda _: None)):
                self._to_send.remove(message)


class Life(System):
    """One life of the process."""

    def __init__(self, world: World, store: Store, make: Callable[..., Loop]) -> None:
        self._world = world
        self.store = store
        self.known: Dict[str, Goal] = {}
        super().__init__(make)

    @property
    def stored(self) -> SqliteStore:
        assert isinstance(self.durability, SqliteStore)
        return self.durability

    def ask(self, key: str) -> None:
        """A client asks for something."""
        goal = self._world.goal(key)
        self.put(goal)
        self.known[key] = goal
        self._world.clients[key].known = True

    def wait(self, timeout: float) -> bool:
        before = len(self._backlog)
        if not self._items:
            self._world.turn(self)
        if not self._items and len(self._backlog) == before:
            moments = self.own_moments()
            if moments:
                self.clock = max(self.clock, min(moments))
            else:
                self.close()
        return True

    def publish(self, actuator: str, action: str) -> None:
        super().publish(actuator, action)
        self._world.latched = action

    def show_executions(self, run: str, executions: Sequence[Execution]) -> None:
        self._world.hear(run, executions)

    def live(self) -> None:
        """Lives until there is nothing to do."""
        loop, stored = self.loop, self.stored
        for client in self._world.clients.values():
            client.note = loop.state.note  # as the node does
        self.known = stored.resume(loop.state, lambda known: self._world.clients[known.id])
        for key in self.known:  # as the first list of statuses says
            client = self._world.clients[key]
            if self.store.goals[key].accepted and not client.words:
                client.changed(StatusSet(key, Status.ACCEPTED))
        for known in stored.unsure:
            client = self._world.clients[known.id]
            if not client.end():
                client.changed(StatusSet(known.id, known.status, "", known.reason))
        loop.prepare()
        try:
            for _ in range(MANY):
                loop.step()
        except ShutdownError as err:
            loop.end(str(err))


class Runs:
    """Runs of an encoding in a mode, one after the other.

    Attributes:
        kills: How often the process has died, in all of them.
    """

    def __init__(
        self,
        folder: Path,
        mode: str,
        encoding: Union[str, Sequence[str]] = "line.lp",
        steps: int = 30,
        solver_options: Sequence[str] = (),
    ) -> None:
        self._folder = folder
        self._count = 0
        self.kills = 0
        self.wait: Optional[Callable[[], None]] = None
        self.started_with = {"the options of planner": "none"}
        self.parameters: Dict[str, Any] = {}  # of the loop
        files = [encoding] if isinstance(encoding, str) else encoding
        options = Options(tuple(str(Path(EXAMPLES) / file) for file in files), (*solver_options,))
        self.parts: Parts = make_parts(mode, options, ("-c", f"steps={steps}"))
        self._engine = self.parts.planner  # which a test may wrap

    def file(self) -> Path:
        self._count += 1
        return self._folder / f"{self._count}.store"

    def make(self, store: Store) -> Callable[..., Loop]:
        def loop(inbox: Any, environment: Any) -> Loop:
            durability = SqliteStore(store, lambda: self.started_with, self.wait)
            return self.parts.loop(inbox, environment, durability=durability, **self.parameters)

        return loop

    def run(
        self,
        world: World,
        crashes: Sequence[int] = (),
        file: Optional[Path] = None,
        most_pages: int = 0,
    ) -> List[str]:
        """Runs until nothing is left to do.

        Args:
            world: What is around it.
            crashes: How many points each life has; the last one has no end, and may be one before
                all of these are used.
            file: The store.
            most_pages: How large it may become; 0 for as large as it needs.

        Returns:
            The points of the last life.
        """
        file = file or self.file()
        points: List[str] = []
        left = list(crashes)

        def point(what: str) -> None:
            points.append(what)
            assert len(points) < 10 * MANY, "it does not end"
            if limit and len(points) >= limit:
                raise Crash

        while True:
            limit = left.pop(0) if left else 0
            points.clear()
            world.latched = None
            store = None
            self._engine.run([wire.Restart()])  # what it was is lost, too
            try:
                store = Store(file, point=point, most_pages=most_pages)
                Life(world, store, self.make(store)).live()
                return points
            except Crash:
                self.kills += 1
                continue
            finally:
                if store is not None:
                    store.close()


def outcome(world: World) -> Tuple[Any, ...]:
    """What counts: what was done, and how the goals have ended."""
    return world.effects, {key: client.end() for key, client in world.clients.items()}
