"""A whole system in this process: a loop with two solvers, and a robot that answers."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any, Callable, Iterator, List, Optional, Sequence, Tuple

import pytest

from rosclingo.errors import RosclingoError
from rosclingo.solver.options import Options, parse_options
from rosoclingo.commands import ROSCommands
from rosoclingo.in_process.parts import SINGLE, make_parts
from rosoclingo.in_process.system import Request
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.journal import MessageArrived, StatusSet
from rosoclingo.loop.loop import Loop
from rosoclingo.loop.mode.controller import Decider
from rosoclingo.loop.values.atoms import Action
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.goals import Goal
from rosoclingo.loop.values.solver import Solver

PACKAGE = Path(__file__).resolve().parents[2]
TIMEOUT = 300.0  # seconds; no more than a bound for what never comes


def walk(cells: List[int]) -> List[str]:
    """Returns the actions of a shortest way over the cells of a line."""
    actions = []
    for begin, end in zip(cells, cells[1:]):
        step = 1 if end > begin else -1
        actions += [f"go({cell})" for cell in range(begin + step, end + step, step)]
    return actions


def exit_status(program: Callable[..., Any], *arguments: object) -> int:
    """Runs a program with arguments until it exits."""
    with pytest.raises(SystemExit) as end:
        program([str(argument) for argument in arguments])
    assert isinstance(end.value.code, int)
    return end.value.code


class RecordedGoal(Request):
    """A goal for whose statuses another thread can wait."""

    def __init__(self, request: str, identifier: str = "") -> None:
        super().__init__(request, (f"information of {request}",), identifier)
        self._has_ended = threading.Event()
        self._accepted = threading.Event()

    def changed(self, change: StatusSet) -> None:
        super().changed(change)
        (self._has_ended if change.status.is_terminal else self._accepted).set()

    def wait(self) -> str:
        """Waits for the end and returns the terminal status."""
        assert self._has_ended.wait(TIMEOUT), f"{self.request} did not end: {self.words}"
        return self.words[-1]

    def ends(self, word: str, reason: str) -> None:
        """Waits for an end of which something is said."""
        assert self.wait() == word
        assert reason in self.reason

    def wait_until_accepted(self) -> None:
        assert self._accepted.wait(TIMEOUT), f"{self.request} was not accepted"


class World(Environment):
    """The robot: it answers each action as ``answer`` says, or not at all."""

    def __init__(self, inbox: Inbox) -> None:
        self.inbox = inbox
        self.published: List[Tuple[str, str]] = []
        self.warnings: List[str] = []
        self.step = self.horizon = 0
        self.plan: List[str] = []
        self.answer: Callable[[str, str], Optional[str]] = lambda actuator, action: "success"
        self._changed = threading.Condition()

    def publish(self, actuator: str, action: str) -> None:
        with self._changed:
            self.published.append((actuator, action))
            self._changed.notify_all()
        answer = None if actuator == "solver" else self.answer(actuator, action)
        if answer is not None:
            self.inbox.put(MessageArrived(actuator, answer))

    def show_plan(self, step: int, horizon: int, actions: Sequence[Action], *_: object) -> None:
        with self._changed:
            self.step, self.horizon = step, horizon
            self.plan = [str(action) for action in actions]
            self._changed.notify_all()

    def warn(self, text: str) -> None:
        with self._changed:
            self.warnings.append(text)
            self._changed.notify_all()

    def wait_for(self, condition: Callable[[World], bool]) -> None:
        with self._changed:
            assert self._changed.wait_for(lambda: condition(self), TIMEOUT), self.published

    @property
    def actions(self) -> List[str]:
        return [action for _, action in self.published]


class System:
    """A loop in a thread."""

    def __init__(
        self,
        decider: Decider,
        planner: Solver,
        commands: Callable[..., Any],
        *,
        inbox: Optional[Inbox] = None,
        **parameters: Any,
    ) -> None:
        self.inbox = inbox or Inbox()
        self.world = World(self.inbox)
        self.controller = decider
        self.planner = planner
        self.loop = Loop(decider, planner, commands, self.inbox, self.world, **parameters)
        self.failure: Optional[BaseException] = None
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self) -> System:
        self._thread.start()
        return self

    def _run(self) -> None:
        try:
            self.loop.run()
        except BaseException as err:
            self.failure = err

    def send(self, identifier: str, value: str) -> None:
        self.inbox.put(MessageArrived(identifier, value))

    def goal(self, request: str) -> RecordedGoal:
        goal = RecordedGoal(request)
        self.inbox.put(goal)
        return goal

    def begin(self, request: str) -> RecordedGoal:
        """Starts when something was asked for."""
        goal = self.goal(request)
        self.start()
        return goal

    def take(self, commands: Sequence[str]) -> None:
        """Takes as many commands, one by one, without a thread."""
        self.loop.prepare()
        for _ in commands:
            self.loop.step()

    def act(self, *requests: str) -> List[RecordedGoal]:
        """Asks for something, and waits until the robot acts, which answers nothing by itself."""
        self.world.answer = lambda actuator, action: None
        goals = [self.goal(request) for request in requests]
        self.start()
        self.world.wait_for(lambda world: bool(world.published))
        return goals

    def cancel(self, goal: Goal) -> None:
        self.inbox.cancel(goal)

    def wait(self) -> RosclingoError:
        """Waits until the loop has ended by itself, and returns why."""
        self._thread.join(TIMEOUT)
        assert not self._thread.is_alive(), "the loop goes on"
        assert isinstance(self.failure, RosclingoError), self.failure
        return self.failure

    def close(self) -> None:
        self.inbox.close()
        if self._thread.ident is not None:
            self._thread.join(TIMEOUT)
            assert not self._thread.is_alive(), "the loop goes on"


HARD = """
rslot(1..2).
#program state(t).
#external event(ID,(hard;easy),t) : rslot(ID).
want(t) :- event(_,hard,t), not event(_,easy,t).
1 { at(P,H,t) : H=1..11 } 1 :- P=1..12, want(t).
:- at(P,H,t), at(Q,H,t), P<Q.
status(ID,succeeded,t) :- event(ID,_,t).
#program query(t).
#external query(t).
"""
"""The goal hard: 12 pigeons in 11 holes, which takes minutes; the goal easy makes it easy."""

Make = Callable[..., System]
"""Makes systems, as the fixtures below."""


def _options(arguments: Sequence[str]) -> Options:
    return parse_options([p for a in arguments for p in (("-f", a) if ".lp" in a else (a,))])


@pytest.fixture
def made() -> Iterator[List[System]]:
    """The systems of a test, which are closed at its end."""
    systems: List[System] = []
    yield systems
    for one in systems:
        one.close()


@pytest.fixture
def system(made: List[System]) -> Make:
    """Makes systems: by the name of a mode, further options for it, and those of the planner."""

    def make(
        mode: str,
        *options: str,
        encoding: Sequence[str] = (str(PACKAGE / "example/line.lp"),),
        commands: Callable[..., Any] = ROSCommands,
        planner: Optional[Solver] = None,
        **others: Any,
    ) -> System:
        parts = make_parts(mode, _options(encoding), options, commands=commands)
        decider = parts.decider()
        made.append(System(decider, planner or parts.planner, parts.commands, **others))
        return made[-1]

    return make


@pytest.fixture
def single(made: List[System]) -> Make:
    """Makes one-node systems: by encodings, and options for clingo."""

    def make(*arguments: str, **others: Any) -> System:
        parts = make_parts(SINGLE, _options(arguments))
        made.append(System(parts.decider(), parts.planner, parts.commands, **others))
        return made[-1]

    return make
