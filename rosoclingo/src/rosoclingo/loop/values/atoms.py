"""Parses and formats the atoms of planner and controller (docs/protocol.md, section "Encodings").

Atoms stand as text outside of this module, as they do on the wire. clingo prints a term always in
the same way, so equal texts mean equal terms.

>>> plan = Plan(("do(robot,go(c3),1)", "status(1,succeeded,1)"))
>>> plan.actions(1)
[Action(actuator='robot', name='go(c3)', step=1)]
>>> plan.statuses(1)
[('1', 'succeeded')]
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, List, Optional, Sequence, Tuple

from rosclingo.errors import TermError, XmlError
from rosclingo.solver.terms import parse_term, quote
from rosclingo.wire.characters import check_text
from rosclingo.wire.term_text import is_plain, last_number, number, split_term
from rosoclingo.loop.values.beliefs import SHOWN, only_beliefs

EVENT = "event("
"""How the atom of each external event begins."""

SAVE = f"{EVENT}save,"
"""The prefix of events of the initial state."""

PASSED = f"{EVENT}info,passed,"
"""The prefix of events that say that a step has gone by."""

COMMIT = f"{EVENT}commit,"
"""The prefix of events that say that an action was published."""

QUERY = "query("
"""How the external begins by which a plan is asked for, see :func:`query`."""

_READ = ("do(", "status(", "abort(")
_FEEDBACK = "feedback("
_TIMES = ("lasts(", "awaits(", "begins(", "expected(", "due(", "tell_clock")
_FAULTS = ("retries(", "tell_later(")
_SORTED = (*_READ, *_TIMES, *_FAULTS, *SHOWN)


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

    @property
    def commit(self) -> str:
        """The atom of the event that says that it was published."""
        return event("commit", f"do({self.actuator},{self.name})", self.step)


@dataclass(eq=False)
class Plan:
    """A plan: the atoms of an answer set that rosoclingo reads.

    That is do/3, status/3, holds/2, abort/2 and feedback/2, of times lasts/3, awaits/2, begins/2,
    expected/2, due/2 and tell_clock, of failures retries/3 and tell_later/2, and those of
    :mod:`rosoclingo.loop.values.beliefs`.

    Attributes:
        symbols: The answer set.
        lasting: For each action of which the plan says that, what the encoding calls its kind, and
            how long it takes, in seconds.
        awaits: For each action of which the plan says that, actions of other actuators that have to
            be through before, each named by one of its steps.
        begins: For each action of which the plan says that, when it begins at the earliest, in
            seconds by the clock that the encoding is told.
        serving: The action with which each goal is served of which the plan says that, by slots.
        limits: The seconds after arrival within which goals are due, by slots.
        uses_clock: Whether the encoding is to be told the time at each answer.
        retries: How often each action is tried again after a failure, and after how many seconds,
            for those of which the plan says that.
        alarms: After how many seconds the encoding is to be told a message, by messages.
        beliefs: The terms that show beliefs, in order.
    """

    symbols: Tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self._actions: Dict[int, List[Action]] = {}
        self._statuses: Dict[int, List[Tuple[str, str]]] = {}
        self._aborts: Dict[int, List[str]] = {}
        self.lasting: Dict[Action, Tuple[str, int]] = {}
        self.awaits: Dict[Action, List[Action]] = {}
        self.begins: Dict[Action, int] = {}
        self.serving: Dict[str, Action] = {}
        self.limits: Dict[str, int] = {}
        self.uses_clock = "tell_clock" in self.symbols
        self.retries: Dict[Action, Tuple[int, int]] = {}
        self.alarms: Dict[str, int] = {}
        beliefs: List[str] = []
        for text in self.symbols:
            if not text.startswith(_SORTED):
                continue
            if text.startswith(_TIMES):
                self._read_time(text)
                continue
            if text.startswith(_FAULTS):
                self._read_fault(text)
                continue
            if text.startswith(SHOWN):
                beliefs.append(text)
                continue
            step = last_number(text)
            if step is None:
                continue
            name, arguments = split_term(text)
            if (name, len(arguments)) == ("do", 3):
                action = Action(arguments[0], arguments[1], step)
                self._actions.setdefault(step, []).append(action)
            elif (name, len(arguments)) == ("status", 3):
                self._statuses.setdefault(step, []).append((arguments[0], arguments[1]))
            elif (name, len(arguments)) == ("abort", 2):
                self._aborts.setdefault(step, []).append(arguments[0])
        self.beliefs = only_beliefs(beliefs)

    def _read_time(self, text: str) -> None:
        """Reads an atom about times; ignores one of another form."""
        name, arguments = split_term(text)
        if (name, len(arguments)) == ("lasts", 3):
            action, seconds = _action(arguments[0]), number(arguments[2])
            if action is not None and seconds is not None:
                self.lasting[action] = arguments[1], max(0, seconds)
        elif (name, len(arguments)) == ("awaits", 2):
            action, before = _action(arguments[0]), _action(arguments[1])
            if action is not None and before is not None:
                self.awaits.setdefault(action, []).append(before)
        elif (name, len(arguments)) == ("begins", 2):
            action, seconds = _action(arguments[0]), number(arguments[1])
            if action is not None and seconds is not None:
                self.begins[action] = seconds
        elif (name, len(arguments)) == ("expected", 2):
            action = _action(arguments[1])
            if action is not None:
                self.serving[arguments[0]] = action
        elif (name, len(arguments)) == ("due", 2):
            seconds = number(arguments[1])
            if seconds is not None:
                self.limits[arguments[0]] = seconds

    def _read_fault(self, text: str) -> None:
        """Reads an atom about failures; ignores one of another form."""
        name, arguments = split_term(text)
        seconds = number(arguments[-1]) if arguments else None
        if seconds is None:
            return
        if (name, len(arguments)) == ("retries", 3):
            action, count = _action(arguments[0]), number(arguments[1])
            if action is not None and count is not None:
                self.retries[action] = max(0, count), max(0, seconds)
        elif (name, len(arguments)) == ("tell_later", 2):
            self.alarms[arguments[0]] = max(0, seconds)

    def actions(self, step: int) -> Sequence[Action]:
        """Returns the actions of a step."""
        return self._actions.get(step, ())

    def actions_from(self, step: int) -> List[Action]:
        """Returns the actions of a step and of all after it, ordered by step."""
        steps = sorted(other for other in self._actions if other >= step)
        return [action for other in steps for action in self._actions[other]]

    def last_actions(self, step: int, horizon: float) -> int:
        """Returns the last step with actions from a step up to a horizon; the step without any."""
        return max((other for other in self._actions if step < other <= horizon), default=step)

    def aborts(self, step: int) -> Sequence[str]:
        """Returns the actuators whose actions are aborted in a step (ROSoClingo 1.0)."""
        return self._aborts.get(step, ())

    def statuses(self, step: int) -> Sequence[Tuple[str, str]]:
        """Returns the pairs of slot id and status of a step, ``accepted`` before the others."""
        return sorted(self._statuses.get(step, ()), key=lambda pair: (pair[1] != "accepted", pair))

    def statuses_from(self, step: int) -> List[Tuple[str, str]]:
        """Returns the pairs of a step and of all after it."""
        return [one for other, said in self._statuses.items() if other >= step for one in said]

    def feedback(self) -> List[Tuple[str, str]]:
        """Returns the pairs of slot id and line of feedback: a term's name and arguments."""
        atoms = (text for text in self.symbols if text.startswith(_FEEDBACK))
        pairs = (split_term(text)[1] for text in atoms)
        terms = ((pair[0], *split_term(pair[1])) for pair in pairs if len(pair) == 2)
        return sorted((slot, " ".join([name, *rest])) for slot, name, rest in terms if name)

    def fluents(self, step: int) -> List[str]:
        """Returns the fluents that are true at a step."""
        atoms = (text for text in self.symbols if text.startswith("holds("))
        terms = (split_term(text)[1] for text in atoms if text.endswith(f",{step})"))
        return [arguments[0] for arguments in terms if len(arguments) == 2]

    def last_fluents(self, step: int) -> List[str]:
        """Returns the fluents of the last step up to one, of which the plan shows any."""
        return self.fluents(self.last_shown(step))

    def last_shown(self, step: int) -> int:
        """Returns the last step up to one, of which the plan shows fluents; -1 without any."""
        steps = [last_number(text) for text in self.symbols if text.startswith("holds(")]
        return max((shown for shown in steps if shown is not None and shown <= step), default=-1)


def _action(text: str) -> Optional[Action]:
    """Returns the action of a term ``do(R,A,T)``; None of another one."""
    name, arguments = split_term(text)
    step = number(arguments[2]) if (name, len(arguments)) == ("do", 3) else None
    return None if step is None else Action(arguments[0], arguments[1], step)


def event(source: str, content: str, step: int) -> str:
    """Returns the atom of an external event."""
    return f"{EVENT}{source},{content},{step})"


def query(step: int) -> str:
    """Returns the external by which a plan is asked for in which all is done by a step."""
    return f"{QUERY}{step})"


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


def canonical_or_text(text: str) -> str:
    """Returns a ground term as clingo prints it, and any other text as it is."""
    try:
        return canonical(text)
    except TermError:
        return text
