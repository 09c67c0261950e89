"""A first plan of another planner, as where a search for a plan in layers begins.

See docs/grounding_on_demand.md, section "A seed". The process searches beside clingo.
"""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Callable, Iterator, List, Optional, Tuple

from rosclingo.wire import commands as wire
from rosoclingo.loop.values.solver import Solver
from rosoclingo.seed.downward import SeedProcess
from rosoclingo.seed.elimination import leave_out
from rosoclingo.seed.layering import LayeredPlan, put_in_layers
from rosoclingo.seed.sas import SasTask, write
from rosoclingo.seed.task import read_task

SEED = ("seed", 1)
"""The part of an encoding that shows the task."""


class Seed:
    """Gives what another planner finds for a search; here, nothing. One thread makes the calls."""

    def begin(self) -> None:
        """Has the other planner begin, unless it has begun."""

    @property
    def is_ready(self) -> bool:
        """Tells whether something was found that is not taken yet; for any thread."""
        return False

    def take(self) -> Iterator[Tuple[int, List[wire.Assumption]]]:
        """Takes what was found: numbers of layers, and what is assumed, to be tried in turn."""
        return iter(())

    def close(self) -> None:
        """Ends the other planner."""


class ProcessSeed(Seed):
    """Gives what a process finds."""

    def __init__(
        self,
        solver: Solver,
        run: Callable[..., object],
        program: Path,
        number: int,
        stopped: Callable[[], bool],
    ) -> None:
        """Starts nothing yet.

        Args:
            solver: The solver, whose encoding shows the task.
            run: Runs commands.
            program: The other planner, see :func:`.find_seed_planner`.
            number: That of the search.
            stopped: Whether the search has to end.
        """
        self._solver = solver
        self._run = run
        self._program = program
        self._number = number
        self._stopped = stopped
        self._has_begun = False
        self._task: Optional[SasTask] = None
        self._process: Optional[SeedProcess] = None  # until its plan is taken

    def begin(self) -> None:
        """Starts the process with the task that the encoding shows, unless that was done."""
        if self._has_begun:
            return
        self._has_begun = True
        self._task = self._read()
        if self._task is not None:
            with contextlib.suppress(OSError):  # then the search does without
                self._process = SeedProcess(self._program, self._task.text)

    @property
    def is_ready(self) -> bool:
        """Tells whether the process has ended, and its plan is not taken yet; for any thread."""
        process = self._process
        return process is not None and process.has_ended

    def take(self) -> Iterator[Tuple[int, List[wire.Assumption]]]:
        """Takes its plan in as few layers as possible, and then in one for each action."""
        process, self._process = self._process, None
        task, numbers = self._task, process.plan() if process else None
        if task is None or not numbers or max(numbers) >= len(task.operators):
            return
        plan = [task.operators[number] for number in numbers]
        plan = leave_out(plan, task.initial, task.goal)
        layered = put_in_layers(plan, task.initial, task.goal)
        yield layered.layers, self._assumptions(layered)
        one_each = put_in_layers(plan, task.initial, task.goal, one_each=True)
        if one_each != layered:
            yield one_each.layers, self._assumptions(one_each)

    def close(self) -> None:
        """Ends the process."""
        if self._process is not None:
            self._process.close()

    def _read(self) -> Optional[SasTask]:
        """Returns the task of the search; None if its encoding does not show any."""
        name, _ = SEED
        shown = f"seeding({self._number})"
        self._run(
            wire.Ground((wire.Part(name, (str(self._number),)),)),
            wire.AssignExternal(shown, wire.Truth.TRUE),
        )
        symbols = self._solver.solve((), self._stopped).symbols
        self._run(wire.ReleaseExternal(shown))
        try:
            task = read_task(symbols)
        except ValueError:
            return None
        return write(task) if task.wishes else None

    def _assumptions(self, plan: LayeredPlan) -> List[wire.Assumption]:
        chosen = [("occ", *one) for one in plan.actions] + [("goes", *one) for one in plan.ways]
        return [
            wire.Assumption(f"{name}({arguments},{layer},{self._number})", True)
            for name, arguments, layer in chosen
        ]
