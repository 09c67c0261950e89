"""The whole planning system in this process and thread: a world that acts whenever the loop waits.

Nothing runs at the same time, so that a seed determines all that happens.
"""

from __future__ import annotations

from pathlib import Path
from typing import Callable, Dict, List, Optional, Sequence, Tuple

import rosoclingo
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Result
from rosoclingo.commands import ROSCommands
from rosoclingo.errors import LoopError, ShutdownError
from rosoclingo.loop.controller import Controller
from rosoclingo.loop.environment import Environment
from rosoclingo.loop.goals import Goal, GoalClient
from rosoclingo.loop.inbox import Cancel, Inbox, Message
from rosoclingo.loop.loop import Loop
from rosoclingo.single.algorithm1 import Algorithm1, commands_for
from rosoclingo.single.dialects import detect, says_status
from rosoclingo_aspprograms.validator import Map, Validator

PACKAGE = Path(__file__).resolve().parents[2]
ROSOCLINGO = Path(rosoclingo.__file__).resolve().parents[2]
STATIC = ["static.fixed.recording", "static.incremental.recording"]
FIXED = "dynamic.fixed.recording"
RECORDING = "dynamic.incremental.recording"
RESET = "dynamic.incremental.reset"
DYN_RESET = "dynamic.incremental.dyn_reset"
SINGLE = "run-1.0"  # no mode, but one node for all
INCREMENTAL = [RECORDING, RESET, DYN_RESET, SINGLE]
MAILBOT = str(PACKAGE / "mailbot" / "mailbot.lp")
PAPER = str(PACKAGE / "mailbot" / "mailbot_paper.lp")
BENCH = str(PACKAGE / "mailbot" / "instances" / "graph_bench.lp")
OFFICE = str(PACKAGE / "mailbot" / "instances" / "graph_wg.lp")
REQUEST = str(PACKAGE / "mailbot" / "mailbot" / "requests" / "request01.lp")


class Request(Goal, GoalClient):
    """A goal that remembers what its client is told, and tells the validator."""

    def __init__(self, request: str, validator: Validator) -> None:
        super().__init__(request, client=self)
        self.words: List[str] = []
        self.reason = ""
        self.cancel_requested = False
        self._validator = validator

    def accepted(self) -> None:
        self.words.append("accepted")
        self._validator.status(self, "accepted", self.slot)

    def ended(self, word: str, reason: str) -> None:
        self.words.append(word)
        self.reason = reason
        self._validator.status(self, word, self.slot)


class Episode(Inbox, Environment):
    """A planner, a mode, and the world around them.

    Attributes:
        published: All actions published, in order.
        pending: For each robot that acts, its action.
        warnings: What rosoclingo has warned of.
    """

    def __init__(
        self,
        mode: str,
        graph: Map,
        encoding: Sequence[str],
        mode_options: Sequence[str] = ("-c", "steps=60"),
        options: Sequence[str] = (),
    ) -> None:
        super().__init__()
        self.validator = Validator(graph, immediate=True)
        self.published: List[Tuple[str, str]] = []
        self.pending: Dict[str, str] = {}
        self.warnings: List[str] = []
        self._turn: Callable[[], bool] = lambda: False
        planner_options = Options(tuple(encoding), tuple(options))
        self.planner = Engine(planner_options, log=self.warnings.append)
        episode = self

        class Commands(ROSCommands):
            def solve(self) -> None:
                super().solve()
                if self.state.result is Result.SAT:
                    episode.found_plan()

        if mode == SINGLE:
            dialect = detect(planner_options)
            single = Algorithm1(dialect.first_step)
            commands = commands_for(dialect, Commands, says_status(planner_options))
            self.loop = Loop(single, dialect(self.planner), commands, self, self)
        else:
            file = str(ROSOCLINGO / "modes" / f"{mode}.lp")
            controller = Controller(Engine(Options((file,), tuple(mode_options))))
            self.loop = Loop(controller, self.planner, Commands, self, self)

    def found_plan(self) -> None:
        """The planner has found a plan."""

    # What the loop calls.

    def publish(self, actuator: str, action: str) -> None:
        self.published.append((actuator, action))
        if actuator != "solver":
            self.validator.action(actuator, action)
            self.pending[actuator] = action

    def warn(self, text: str) -> None:
        self.warnings.append(text)

    def wait(self, timeout: float) -> bool:
        """Lets the world take its turn until there is news; ends if it has nothing to do."""
        if not (self.pending or self._items):
            self.validator.settle()
        while not (self._items or self.closed):
            if not self._turn():
                self.close()
        return True

    # What a test calls.

    @property
    def actions(self) -> List[str]:
        return [action for _, action in self.published]

    def request(self, text: str) -> Request:
        goal = Request(text, self.validator)
        self.validator.request(goal, text)
        self.put(goal)
        return goal

    def cancel(self, goal: Request) -> None:
        self.validator.cancel(goal)
        goal.cancel_requested = True
        self.put(Cancel(goal))

    def announce(self, value: str) -> None:
        self.validator.message("info", value)
        self.put(Message("info", value))

    def answer(self, actuator: str, value: str = "success") -> str:
        """Answers the action of a robot, and returns the action."""
        action = self.pending.pop(actuator)
        self.validator.message(actuator, value)
        self.put(Message(actuator, value))
        return action

    def run(self, turn: Optional[Callable[[], bool]] = None) -> Optional[LoopError]:
        """Runs until the world has nothing to do when the loop waits.

        Args:
            turn: What the world does when the loop waits; it says whether it did something. By
                default, all actions succeed.

        Returns:
            Why the loop ended, if it did so by itself.
        """
        self._turn = turn if turn is not None else self.succeed
        self._closed = False
        try:
            if not self.loop.state.externals.grounded and not self.published:
                self.loop.prepare()
            while not self.closed:
                self.loop.step()
        except ShutdownError:
            return None
        except LoopError as err:
            self.loop.state.goals.end_all("aborted", str(err))
            return err
        return None

    def succeed(self) -> bool:
        """Lets all actions succeed."""
        for actuator in sorted(self.pending):
            self.answer(actuator)
        return bool(self._items)
