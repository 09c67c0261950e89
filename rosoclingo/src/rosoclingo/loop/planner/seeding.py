"""A first plan of another planner, as where a search for a plan in layers begins.

See docs/grounding_on_demand.md, section "A seed". The process searches beside clingo.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
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


@dataclass(eq=False)
class Seed:
    """Gives what another planner, a process, finds for a search. One thread makes the calls.

    Attributes:
        solver: The solver, whose encoding shows the task.
        run: Runs commands.
        program: The other planner, see :func:`.find_seed_planner`; None for none.
        number: That of the search.
        stopped: Whether the search has to end.
    """

    solver: Solver
    run: Callable[..., object]
    program: Optional[Path]
    number: int
    stopped: Callable[[], bool]

    def __post_init__(self) -> None:
        self._has_begun = False
        self._task: Optional[SasTask] = None
        self._process: Optional[SeedProcess] = None  # until its plan is taken

    def begin(self) -> None:
        """Starts the process with the task that the encoding shows, unless that was done."""
        if self.program is None or self._has_begun:
            return
        self._has_begun = True
        self._task = self._read()
        if self._task is not None:
            with contextlib.suppress(OSError):  # then the search does without
                self._process = SeedProcess(self.program, self._task.text)

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
        shown = f"seeding({self.number})"
        self.run(
            wire.Ground((wire.Part(name, (str(self.number),)),)),
            wire.AssignExternal(shown, wire.Truth.TRUE),
        )
        symbols = self.solver.solve((), self.stopped).symbols
        self.run(wire.ReleaseExternal(shown))
        try:
            task = read_task(symbols)
        except ValueError:
            return None
        return write(task) if task.wishes else None

    def _assumptions(self, plan: LayeredPlan) -> List[wire.Assumption]:
        chosen = [("occ", *one) for one in plan.actions] + [("goes", *one) for one in plan.ways]
        return [
            wire.Assumption(f"{name}({arguments},{layer},{self.number})", True)
            for name, arguments, layer in chosen
        ]
