"""Atoms of planner and controller to values and back (docs/protocol.md, section "Encodings").

Atoms stand as text outside of this module, as they do on the wire. clingo prints a term always in
the same way, so equal texts mean equal terms.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, List, Optional, Sequence, Tuple

import clingo

from rosclingo.errors import TermError, XmlError
from rosclingo.solver.terms import is_plain, parse_term, quote
from rosclingo.wire.xml_codec import check_text
from rosoclingo.loop.atom_text import last_argument


@dataclass(frozen=True)
class Action:
    """An action of a plan.

    Attributes:
        actuator: Who is to act.
        name: What to do.
        step: When, in steps.
    """

    actuator: str
    name: str
    step: int

    def __str__(self) -> str:
        return f"do({self.actuator},{self.name},{self.step})"


class Plan:
    """What rosoclingo reads of the planner's answer set: do/3, status/3, holds/2 and abort/2.

    Attributes:
        symbols: The answer set.
    """

    def __init__(self, symbols: Sequence[str] = ()) -> None:
        self.symbols = tuple(symbols)
        self._actions: Dict[int, List[Action]] = {}
        self._statuses: Dict[int, List[Tuple[str, str]]] = {}
        self._aborts: Dict[int, List[str]] = {}
        for text in symbols:
            if text.startswith("do("):
                arguments = _arguments(text, "do", 3)
                if arguments is not None:
                    action = Action(str(arguments[0]), str(arguments[1]), arguments[2].number)
                    self._actions.setdefault(action.step, []).append(action)
            elif text.startswith("status("):
                arguments = _arguments(text, "status", 3)
                if arguments is not None:
                    status = (str(arguments[0]), str(arguments[1]))
                    self._statuses.setdefault(arguments[2].number, []).append(status)
            elif text.startswith("abort("):
                arguments = _arguments(text, "abort", 2)
                if arguments is not None:
                    self._aborts.setdefault(arguments[1].number, []).append(str(arguments[0]))

    def actions(self, step: int) -> Sequence[Action]:
        """Returns the actions of a step."""
        return self._actions.get(step, ())

    def actions_from(self, step: int) -> List[Action]:
        """Returns the actions of a step and of all after it, ordered by step."""
        steps = sorted(other for other in self._actions if other >= step)
        return [action for other in steps for action in self._actions[other]]

    def aborts(self, step: int) -> Sequence[str]:
        """Returns the actuators that are to end what they do in a step (ROSoClingo 1.0)."""
        return self._aborts.get(step, ())

    def statuses(self, step: int) -> Sequence[Tuple[str, str]]:
        """Returns the pairs of slot id and status of a step, ``accepted`` before the others."""
        return sorted(self._statuses.get(step, ()), key=lambda pair: (pair[1] != "accepted", pair))

    def fluents(self, step: int) -> List[str]:
        """Returns the fluents that are true at a step."""
        fluents = []
        for text in self.symbols:
            if text.startswith("holds(") and text.endswith(f",{step})"):
                arguments = _arguments(text, "holds", 2)
                if arguments is not None:
                    fluents.append(str(arguments[0]))
        return fluents

    def last_fluents(self, step: int) -> List[str]:
        """Returns the fluents of the last step up to one, of which the plan shows any."""
        steps = [last_argument(text) for text in self.symbols if text.startswith("holds(")]
        past = [shown for shown in steps if shown is not None and shown <= step]
        return self.fluents(max(past)) if past else []


def event(source: str, content: str, step: int) -> str:
    """Returns the atom of an external event."""
    return f"event({source},{content},{step})"


def query(step: int) -> str:
    """Returns the external by which a plan is asked for in which all is done by a step."""
    return f"query({step})"


def canonical(text: str) -> str:
    """Returns a ground term as clingo prints it.

    Raises:
        TermError: The text is not a ground term, or has a character that the way to a solver cannot
            carry.
    """
    try:
        return text if is_plain(text) else str(parse_term(check_text(text)))
    except XmlError as err:
        raise TermError(f"{quote(text)} cannot be sent to a solver: {err}") from err


def _arguments(text: str, name: str, arity: int) -> Optional[Sequence[clingo.Symbol]]:
    """Returns an atom's arguments if it is of this signature and its last one is a step."""
    symbol = parse_term(text)
    if not symbol.match(name, arity):
        return None
    arguments = symbol.arguments
    return arguments if arguments[-1].type is clingo.SymbolType.Number else None
