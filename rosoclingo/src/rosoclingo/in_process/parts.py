"""Builds the planning loop in this process, from the name of a mode and encodings.

>>> parts = make_parts("dynamic.incremental.recording", Options(), [])
>>> parts.loop(Inbox(), Environment()).state.step
0
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, List, Sequence, Tuple, Type

from rosclingo.errors import OptionsError
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosoclingo.commands import ROSCommands
from rosoclingo.in_process.shared import shared
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.loop import Loop
from rosoclingo.loop.mode.controller import Controller, Decider, Decisions
from rosoclingo.loop.state import State
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.solver import Solver

SINGLE = "run-1.0"
"""Stands in the place of a mode for the one-node system."""


@dataclass(frozen=True)
class Parts:
    """The parts of a loop: its controller, planner and commands.

    Attributes:
        decider: Makes the controller, for one loop at a time.
        planner: The solver with the task's encoding, for one loop at a time.
        commands: Class with a method for each command.
    """

    decider: Callable[[], Decider]
    planner: Solver
    commands: Callable[[State], Any]

    def loop(self, inbox: Inbox, environment: Environment, **parameters: Any) -> Loop:
        """Returns a loop of these parts.

        Args:
            inbox: Where messages, goals and cancel requests come in.
            environment: Where actions and log messages go.
            parameters: Those of :class:`.Loop` that have a name.
        """
        return Loop(self.decider(), self.planner, self.commands, inbox, environment, **parameters)


def make_parts(
    mode: str,
    options: Options,
    mode_options: Sequence[str] = (),
    *,
    commands: Type[Any] = ROSCommands,
    log: Callable[[str], None] = lambda _: None,
    engine: Callable[..., Engine] = Engine,
) -> Parts:
    """Makes the planner's solver and the controller of a system.

    Args:
        mode: The name of a mode, the path of one, or :data:`SINGLE`.
        options: The planner's files, and its options for clingo.
        mode_options: The controller's options for clingo.
        commands: Class with a method for each command, such as ``ROSCommands``.
        log: Called with clingo's warnings of the planner.
        engine: Makes the planner's solver of its options and of ``log``.

    Raises:
        RosclingoError: There is no such mode, or a file or an option is wrong.
    """
    if mode == SINGLE:
        # Few commands need them, and to import them takes as long as to plan for a small task.
        from rosoclingo.loop.single.algorithm1 import (  # noqa: PLC0415
            Algorithm1,
            commands_for,
            last_step,
        )
        from rosoclingo.loop.single.dialects import detect, says_status  # noqa: PLC0415

        dialect = detect(options)
        last = last_step((*options.clingo, *mode_options))
        return Parts(
            lambda: Algorithm1(dialect.first_step, last),
            dialect(engine(options, log=log)),
            commands_for(dialect, commands, says_status(options)),
        )
    controller = Engine(Options((find_mode(mode),), tuple(mode_options)))
    known = _decisions(tuple(controller.program.texts.items()), tuple(mode_options))
    return Parts(lambda: Controller(controller, known=known), engine(options, log=log), commands)


@functools.lru_cache(maxsize=100)
def _decisions(files: Tuple[Tuple[str, str], ...], options: Tuple[str, ...]) -> Decisions:
    """Returns the cached decisions of a mode, by its files and their contents."""
    return Decisions()


def find_mode(mode: str) -> str:
    """Returns the path of a mode's file.

    Args:
        mode: Its name, or its path.

    Raises:
        OptionsError: There is no such mode.
    """
    candidates = [path for path in _modes() if path.stem == mode]
    if mode.endswith(".lp"):
        candidates = [Path(mode).expanduser()]
    for path in candidates:
        if path.is_file():
            return str(path)
    known = ", ".join([*(path.stem for path in _modes()), SINGLE])
    raise OptionsError(f"there is no mode {mode!r}; there are {known}, and any by its path, X.lp")


def _modes() -> List[Path]:
    return sorted((shared() / "modes").glob("*.lp"))


EXAMPLES = str(shared() / "example")
"""The folder of the package's small encodings."""
