"""A first plan of another planner, as where a search for a plan in layers begins.

See docs/grounding_on_demand.md, section "A seed". The process searches beside clingo.
"""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Callable, Iterator, List, Optional, Tuple

from rosclingo.wire import commands as wire
from rosoclingo.loop.solver import Solver
from rosoclingo.seed.downward import SeedProcess
from rosoclingo.seed.elimination import leave_out
from rosoclingo.seed.layering import LayeredPlan, put_in_layers
from rosoclingo.seed.sas import SasTask, write
from rosoclingo.seed.task import read_task

SEED = ("seed", 1)
"""The part of an encoding that shows the task."""


class Seed:
    """What another planner finds for one search; this one finds nothing."""

    @property
    def is_ready(self) -> bool:
        """Whether there is something to take that was not taken. Thread-safe."""
        return False

    def take(self) -> Iterator[Tuple[int, List[wire.Assumption]]]:
        """Takes what was found: numbers of layers, and what is assumed, to be tried in turn."""
        return iter(())


class _ProcessSeed(Seed):
    """What a process finds."""

    def __init__(self, search: int, task: SasTask, process: SeedProcess) -> None:
        self._search = search
        self._task = task
        self._process = process
        self._is_taken = False

    @property
    def is_ready(self) -> bool:
        return self._process.has_ended and not self._is_taken

    def take(self) -> Iterator[Tuple[int, List[wire.Assumption]]]:
        self._is_taken = True
        numbers = self._process.plan()
        if numbers is None:
            return
        task = self._task
        found = [task.operators[number] for number in numbers]
        plan = leave_out(found, task.initial, task.goal)
        for one_each in (False, True):
            layered = put_in_layers(plan, task.initial, task.goal, one_each=one_each)
            yield layered.layers, self._assumptions(layered)

    def _assumptions(self, plan: LayeredPlan) -> List[wire.Assumption]:
        chosen = [("occ", *one) for one in plan.actions] + [("goes", *one) for one in plan.ways]
        return [
            wire.Assumption(f"{name}({arguments},{layer},{self._search})", True)
            for name, arguments, layer in chosen
        ]


class SeedPlanner:
    """Asks another planner for first plans."""

    def __init__(self, solver: Solver, run: Callable[..., object], program: Path) -> None:
        """Asks nothing yet.

        Args:
            solver: The solver, whose encoding shows the task.
            run: Runs commands.
            program: The other planner, see :func:`.find_seed_planner`.
        """
        self._solver = solver
        self._run = run
        self._program = program

    @contextlib.contextmanager
    def search(self, number: int, stopped: Callable[[], bool]) -> Iterator[Seed]:
        """Has the other planner search, for as long as the context is open.

        Args:
            number: That of the search.
            stopped: Whether it has to end.
        """
        task = self._read(number, stopped)
        if task is None:
            yield Seed()
            return
        try:
            process = SeedProcess(self._program, task.text)
        except OSError:
            yield Seed()
            return
        try:
            yield _ProcessSeed(number, task, process)
        finally:
            process.close()

    def _read(self, number: int, stopped: Callable[[], bool]) -> Optional[SasTask]:
        """Returns the task of a search; None if its encoding does not show any."""
        name, _ = SEED
        shown = f"seeding({number})"
        self._run(
            wire.Ground((wire.Part(name, (str(number),)),)),
            wire.AssignExternal(shown, wire.Truth.TRUE),
        )
        symbols = self._solver.solve((), stopped).symbols
        self._run(wire.ReleaseExternal(shown))
        try:
            task = read_task(symbols)
        except ValueError:
            return None
        return write(task) if task.wishes else None
