"""Mailbots in this process and thread, and a validator that sees all they do."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, List, Optional, Sequence

from instance_map import InstanceMap

from rosclingo.errors import RosclingoError
from rosclingo.solver.options import Options
from rosoclingo.in_process.parts import SINGLE, make_parts
from rosoclingo.in_process.system import Request, System
from rosoclingo.loop.journal import PlanFound, Record, StatusSet
from rosoclingo.loop.values.goals import Goal
from rosoclingo.loop.words import SOLVER
from rosoclingo_aspprograms.validator import Validator

PACKAGE = Path(__file__).resolve().parents[2]
STATIC = ["static.fixed.recording", "static.incremental.recording"]
FIXED = "dynamic.fixed.recording"
RECORDING = "dynamic.incremental.recording"
RESET = "dynamic.incremental.reset"
DYN_RESET = "dynamic.incremental.dyn_reset"
INCREMENTAL = [RECORDING, RESET, DYN_RESET, SINGLE]
MAILBOT = str(PACKAGE / "mailbot" / "mailbot.lp")
PAPER = str(PACKAGE / "mailbot" / "mailbot_paper.lp")
BENCH = str(PACKAGE / "mailbot" / "instances" / "graph_bench.lp")
OFFICE = str(PACKAGE / "mailbot" / "instances" / "graph_wg.lp")
REQUEST = str(PACKAGE / "mailbot" / "mailbot" / "requests" / "request01.lp")


class CheckedRequest(Request):
    """A goal that also tells the validator."""

    def __init__(self, validator: Validator, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._validator = validator
        validator.request(self, self.request)

    def changed(self, change: StatusSet) -> None:
        super().changed(change)
        self._validator.status(self, change.status.value, self.slot)


class Episode(System):
    """A planner, a mode, and the world around them."""

    def __init__(
        self,
        mode: str,
        graph: InstanceMap,
        encoding: Sequence[str],
        mode_options: Sequence[str] = ("-c", "steps=60"),
        options: Sequence[str] = (),
    ) -> None:
        self.validator = Validator(graph, immediate=True)
        self.cancelled: List[Goal] = []
        self._turn: Callable[[], bool] = super().turn
        parts = make_parts(
            mode,
            Options(tuple(encoding), tuple(options)),
            () if mode == SINGLE else mode_options,
            log=self.warn,
        )
        self.planner = parts.planner
        super().__init__(parts.loop)

    def found_plan(self) -> None:
        """The planner has found a plan."""

    # What the loop calls.

    def publish(self, actuator: str, action: str) -> None:
        super().publish(actuator, action)
        if actuator != SOLVER:
            self.validator.action(actuator, action)

    def note(self, record: Record) -> None:
        super().note(record)
        if isinstance(record.event, PlanFound):
            self.found_plan()

    def wait(self, timeout: float) -> bool:
        if not (self.acting or self._items):
            self.validator.settle()
        return super().wait(timeout)

    def turn(self) -> bool:
        return self._turn()

    # What a test calls.

    @property
    def actions(self) -> List[str]:
        return [action for _, action in self.published]

    def new_goal(self, *arguments: Any) -> Request:
        return CheckedRequest(self.validator, *arguments, self.note_event)

    def cancel(self, goal: Goal) -> None:
        self.validator.cancel(goal)
        self.cancelled.append(goal)
        super().cancel(goal)

    def tell(self, source: str, value: str) -> None:
        self.validator.message(source, value)
        super().tell(source, value)

    def announce(self, value: str) -> None:
        self.tell("info", value)

    def play(self, turn: Optional[Callable[[], bool]] = None) -> Optional[RosclingoError]:
        """Runs until the world has nothing to do when the loop waits.

        Args:
            turn: What the world does when the loop waits; it says whether it did something. By
                default, all actions succeed.

        Returns:
            Why the loop ended, if it did so by itself.
        """
        self._turn = turn or super().turn
        return self.run()

    def answering(self, answer: Callable[[str], Optional[str]]) -> Callable[[], bool]:
        """Returns turns in which what the mailbot does is answered, by default with success."""

        def turn() -> bool:
            if not self.acting:
                return False
            value = answer(self.acting["mailbot"])
            self.answer("mailbot", value or "success")
            return True

        return turn


def walk(*parts: str) -> List[str]:
    """Returns actions: those in brackets as they are, and a go to each of the other words."""
    words = " ".join(parts).split()
    return [word if "(" in word else f"go({word})" for word in words]
