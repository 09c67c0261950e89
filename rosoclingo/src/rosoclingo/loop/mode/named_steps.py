"""Replaces the names of steps in a mode's command by numbers, so that a mode need not count.

>>> from clingo import parse_term
>>> str(number_steps(parse_term("commit_actions(next)"), step=3, horizon=7))
'commit_actions(4)'
>>> str(number_steps(parse_term("plan(further(50))"), step=3, horizon=7))
'plan(8)'

A mode that counts by itself has a rule for each step that there may be, and so takes the longer to
decide the farther it may plan.
"""

from __future__ import annotations

from typing import Optional

from clingo import Function, Number, Symbol, SymbolType

from rosoclingo.errors import ControllerError

STEP_COMMANDS = frozenset({"ground", "query", "plan", "assign_messages", "status_update"})
STEP_COMMANDS |= {"commit_actions", "release_step", "reset", "forget"}
"""The commands whose argument is a step; those of users have arguments of their own."""

_NOW, _NEXT = Function("now"), Function("next")


def number_steps(
    command: Symbol,
    step: int,
    horizon: int,
    needed: Optional[int] = None,
    *,
    is_endless: bool = False,
) -> Symbol:
    """Returns a command with numbers in the place of names.

    The names are in docs/protocol.md, section "Names of steps".

    Args:
        command: The command.
        step: The current step.
        horizon: The horizon that is asked for.
        needed: The horizon that the plan needs, if that is known and farther away.
        is_endless: Whether that may be beyond the last one.

    Raises:
        ControllerError: The next horizon would be beyond the last one.
    """
    if command.type is not SymbolType.Function or command.name not in STEP_COMMANDS:
        return command
    farther = horizon + 1 if needed is None else needed

    def number(argument: Symbol) -> Symbol:
        if argument == _NOW:
            return Number(step)
        if argument == _NEXT:
            return Number(step + 1)
        if argument.type is SymbolType.Function and argument.match("further", 1):
            return Number(_at_most(farther, argument.arguments[0]))
        return argument

    def _at_most(wanted: int, last: Symbol) -> int:
        if is_endless and needed is not None:
            return needed
        if last.type is not SymbolType.Number or last.number <= horizon:
            raise ControllerError(
                f"the mode gave {command}, where {last} is no horizon after {horizon}, which is "
                "asked for already; a last step, such as that of -c steps=N, is a number from 0 on"
            )
        return min(wanted, last.number)

    return Function(command.name, [number(a) for a in command.arguments], command.positive)


def last_horizon(command: Symbol) -> Optional[int]:
    """Returns the N of ``further(N)`` in a command, the last horizon that the mode may ask for."""
    if command.type is SymbolType.Function and command.name in STEP_COMMANDS:
        for argument in command.arguments:
            if argument.type is SymbolType.Function and argument.match("further", 1):
                (last,) = argument.arguments
                return last.number if last.type is SymbolType.Number else None
    return None
