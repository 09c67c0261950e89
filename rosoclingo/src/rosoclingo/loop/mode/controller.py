"""The controller: a solver whose answer set is the next command."""

from __future__ import annotations

import json
import threading
from dataclasses import dataclass, field
from typing import (
    TYPE_CHECKING,
    Callable,
    Dict,
    FrozenSet,
    List,
    NamedTuple,
    Optional,
    Protocol,
    Sequence,
    Set,
    Tuple,
)

import clingo

from rosclingo.solver.terms import parse_term
from rosclingo.wire.commands import (
    AssignExternal,
    Externals,
    GetExternals,
    Ground,
    Part,
    Restart,
    Result,
    Truth,
)
from rosclingo.wire.term_text import split_term
from rosoclingo.errors import ControllerError
from rosoclingo.loop.mode.named_steps import last_horizon, number_steps
from rosoclingo.loop.mode.retrying import ModeSolver
from rosoclingo.loop.values.atoms import EVENT, SAVE, event
from rosoclingo.loop.values.solver import Solver

if TYPE_CHECKING:
    from concurrent.futures import Future, ThreadPoolExecutor

_MOST_DECISIONS = 10_000  # that are remembered


@dataclass(frozen=True)
class Info:
    """Inputs of the controller's next decision (docs/protocol.md, section "Infos").

    Attributes:
        result: The result of the last command, if that was a search.
        pending_actions: Whether an actuator of the current step has not answered.
        new_messages: Whether there is something for ``assign_messages`` to do.
        request_reset: Whether a goal has ended since the last reset.
        horizon: The horizon that the plan needs, if that is beyond the one that was asked for.
        ahead: How many steps after the current one that is.
        step: The current step.
        asked: The horizon that is asked for.
        planned_actions: Whether the plan has actions after the current step.
        is_endless: Whether the plan may have more steps than the mode allows, as it says itself how
            many it has.
    """

    result: Optional[Result] = None
    pending_actions: bool = False
    new_messages: bool = False
    request_reset: bool = False
    horizon: Optional[int] = None
    ahead: Optional[int] = None
    step: int = 0
    asked: int = 0
    planned_actions: bool = False
    is_endless: bool = False

    def events(self) -> List[str]:
        """Returns the infos that are true, as events."""
        names = ["pending_actions", "new_messages", "request_reset"]
        true = [name for name in names if getattr(self, name)]
        if self.result is not None:
            true.append(f"result({self.result.value})")
        if self.horizon is not None:
            true.append(f"horizon({self.horizon})")
        if self.ahead is not None:
            true.append(f"ahead({self.ahead})")
        return [event("info", name, 0) for name in true]

    def position(self, last: Optional[float]) -> List[str]:
        """Returns the atoms that say how far the run is.

        Args:
            last: The last horizon that the mode may ask for, if that is known.
        """
        left = self.asked - self.step
        names = [f"step({self.step})", f"left({left})"]
        if not self.is_endless or last is None:
            names.append(f"query({self.asked})")
        elif self.result is Result.UNSAT and self.horizon is None:
            names.append(f"query({min(self.asked, last)})")
        names += ["planned_actions"] * self.planned_actions
        return [event("info", name, 0) for name in names]


class Decider(Protocol):
    """Decides which command the loop runs next. One thread makes the calls."""

    @property
    def dynamic(self) -> bool:
        """Whether the mode takes messages and goals."""

    @property
    def last_horizon(self) -> Optional[float]:
        """The last horizon that it may ask for; infinite without one, None if that is unknown."""

    def snapshot(self) -> str:
        """Returns all that it keeps from one decision to the next, as a text of its own kind."""

    def restore(self, saved: str) -> None:
        """Begins anew, and goes on where another one was whose snapshot this is."""

    def undo(self) -> None:
        """Takes the last decision back, whose command has changed nothing; asks no solver."""

    def prepare(self) -> None:
        """Begins anew."""

    def decide(self, info: Info) -> clingo.Symbol:
        """Returns the next command, such as ``ground(3)``."""

    def look_ahead(self, info: Info) -> None:
        """May precompute the next decision in the background, for these infos."""

    def describe(self, info: Info) -> str:
        """Describes the inputs of the last decision, for error messages."""

    def check(self) -> None:
        """Raises an error if it cannot be asked any more."""


@dataclass(frozen=True)
class _Decision:
    """A decision of the controller: a command, with the events from which it was made.

    Attributes:
        command: What is to be done.
        saved: The events by which the controller is reminded of what it saves.
        true: The events from which it has decided.
    """

    command: clingo.Symbol
    saved: Tuple[str, ...]
    true: Set[str]


@dataclass
class Decisions:
    """Cache of a mode's decisions, shared by the controllers of one process that have that mode.

    A mode's answer depends on nothing but the events that are true. One thread makes the calls.

    Attributes:
        declared: The events that the mode declares; None before it is grounded.
        made: Each decision, by the events from which it was made.
        save_events: The external that each fluent is saved in; nothing if there is none.
    """

    declared: Optional[Set[str]] = None
    made: Dict[FrozenSet[str], _Decision] = field(default_factory=dict)
    save_events: Dict[str, str] = field(default_factory=dict)

    def remember(self, decision: _Decision) -> None:
        """Caches a decision; a full cache is cleared."""
        if len(self.made) >= _MOST_DECISIONS:
            self.made.clear()
        self.made[frozenset(decision.true)] = decision


class _Ahead(NamedTuple):
    """A decision that is precomputed in the background.

    Attributes:
        events: What it is made from, be it declared or not.
        told: What of that, and of the position, the mode declares.
        unwanted: Set when it is not needed any more, because the controller learns something else.
        decision: The decision.
    """

    events: List[str]
    told: Set[str]
    unwanted: threading.Event
    decision: Future[_Decision]


class Controller:
    """Runs a mode: asks it for the next command, and saves its fluents between decisions.

    Attributes:
        last_horizon: The last horizon that the mode has named by ``further(N)``; None for none.
    """

    def __init__(
        self, solver: Solver, *, is_remote: bool = False, known: Optional[Decisions] = None
    ) -> None:
        """Wraps the solver of a mode.

        Args:
            solver: Solver with the mode.
            is_remote: Whether the solver works in another process, so that it is worth asking it
                in the background; one in this process would only hold up who works meanwhile.
            known: What it need not be asked again; a solver in another process, of which others
                may ask things, is asked each time.
        """
        self._solver = ModeSolver(solver)
        self._known = known
        self._begun = False  # whether the solver has the mode, and knows what is true
        self._declared: Set[str] = set()
        self._true: Set[str] = set()
        self._saved: Tuple[str, ...] = ()
        self._saved_before: Tuple[str, ...] = ()  # the last decision
        self._save_events: Dict[str, str] = {} if known is None else known.save_events
        self._background: Optional[ThreadPoolExecutor] = None
        if is_remote:
            # Commands, whose controller is in their process, start faster without it.
            import concurrent.futures  # noqa: PLC0415

            self._background = concurrent.futures.ThreadPoolExecutor(1, "look ahead")
        self._ahead: Optional[_Ahead] = None
        self._decided_from: Set[str] = set()  # the last time
        self.last_horizon: Optional[float] = None

    def prepare(self) -> None:
        """Grounds the mode on a fresh solver, and reads the events that it declares.

        Raises:
            ControllerError: That fails.
        """
        self._take_ahead(None)
        self._saved = ()
        self._begun = False
        if self._known is None or self._known.declared is None:
            self._begin()
        else:
            self._declared = self._known.declared

    def _begin(self) -> None:
        reply = self._solver.run([Restart(), Ground((Part("base"),)), GetExternals()])
        if reply.failure is not None:
            raise ControllerError(f"the controller's mode cannot be used: {reply.failure.message}")
        (answer,) = reply.answers
        assert isinstance(answer, Externals)
        self._declared = {atom for atom, _ in answer.values if atom.startswith(EVENT)}
        # A mode may declare that it is true from the start; it is rosoclingo's to say so.
        self._true = {atom for atom, value in answer.values if value is not Truth.FALSE}
        self._true &= self._declared
        self._begun = True
        if self._known is not None:
            self._known.declared = self._declared

    def snapshot(self) -> str:
        """Returns the events that the mode wants to be reminded of, as JSON."""
        return json.dumps(self._saved)

    def restore(self, saved: str) -> None:
        """Grounds the mode, as :meth:`prepare` does, and goes on from a snapshot.

        If that fails, it can be tried again: what it is to go on from is known.
        """
        try:
            self.prepare()
        finally:
            self._saved = tuple(json.loads(saved))

    @property
    def dynamic(self) -> bool:
        """Whether the mode takes messages and goals."""
        return event("info", "new_messages", 0) in self._declared

    def decide(self, info: Info) -> clingo.Symbol:
        """Returns the next command, such as ``ground(3)``.

        Raises:
            ControllerError: There is no command, more than one, or no answer set; or the command
                names a step that there is not.
        """
        ahead = self._take_ahead(info)
        decision = self._decide(info) if ahead is None else ahead.result()
        self._saved_before, self._saved = self._saved, decision.saved
        self._decided_from = decision.true
        last = last_horizon(decision.command)
        self.last_horizon = self.last_horizon if last is None else last
        return number_steps(
            decision.command, info.step, info.asked, info.horizon, is_endless=info.is_endless
        )

    def undo(self) -> None:
        """Takes the last decision back; what was decided ahead rests on it."""
        self._take_ahead(None)
        self._saved = self._saved_before

    def look_ahead(self, info: Info) -> None:
        """Precomputes the next decision in the background, for these infos.

        The mode's answer depends on nothing else, so nothing is lost if it learns something else.
        Does nothing with a solver in this process.
        """
        if self._background is None:
            return
        unwanted = threading.Event()
        decision = self._background.submit(self._decide, info, unwanted.is_set)
        self._ahead = _Ahead(info.events(), self._told(info), unwanted, decision)

    def _take_ahead(self, info: Optional[Info]) -> Optional[Future[_Decision]]:
        """Waits for the decision in the background, since one thread may use the solver.

        Returns:
            The decision, if there is one that was made from this.
        """
        ahead, self._ahead = self._ahead, None
        if ahead is None:
            return None
        is_right = info is not None and (
            (ahead.events, ahead.told) == (info.events(), self._told(info))
        )
        if not is_right:
            ahead.unwanted.set()
        ahead.decision.exception()
        return ahead.decision if is_right else None

    def _told(self, info: Info) -> Set[str]:
        """Returns the atoms of an info that the mode declares."""
        return self._declared.intersection(info.events() + info.position(self.last_horizon))

    def _decide(self, info: Info, stopped: Optional[Callable[[], bool]] = None) -> _Decision:
        """Computes a decision from the saved fluents and the infos, until told to stop.

        Only the externals that change are set.
        """
        true = self._told(info).union(self._saved)
        known = None if self._known is None else self._known.made.get(frozenset(true))
        if known is not None:
            return known
        if not self._begun:
            self._begin()
        changes = [AssignExternal(atom, Truth.FALSE) for atom in sorted(self._true - true)]
        changes += [AssignExternal(atom, Truth.TRUE) for atom in sorted(true - self._true)]
        if changes:
            reply = self._solver.run(changes)
            if reply.failure is not None:
                raise ControllerError(
                    f"the controller refused an external: {reply.failure.message}; check that "
                    "nothing else restarted it"
                )
        self._true = true
        outcome = self._solver.solve((), stopped)
        commands, fluents = _split(outcome.symbols)
        if outcome.result is not Result.SAT or len(commands) != 1:
            said = (
                f"has {len(commands)} commands in its answer set"
                if outcome.result is Result.SAT
                else f"has no answer set ({outcome.result.value})"
            )
            raise ControllerError(
                f"the controller {said}, where one command is needed; "
                + _situation(info, true, outcome.symbols)
                + self._forgotten()
            )
        saved = tuple(event for event in map(self._save_event, fluents) if event)
        decision = _Decision(parse_term(commands[0]), saved, true)
        if self._known is not None:
            self._known.remember(decision)
        return decision

    def _forgotten(self) -> str:
        """Names the fluents that the mode has held and could not be reminded of, for an error."""
        fluents = sorted(fluent for fluent, atom in self._save_events.items() if not atom)
        if not fluents:
            return ""
        return f"; forgotten without #external event(save,F,0): {' '.join(fluents)}"

    def check(self) -> None:
        """Raises an error if the solver is not there any more."""
        self._solver.check()

    def describe(self, info: Info) -> str:
        """Describes the inputs of the last decision, for error messages."""
        return _situation(info, self._decided_from, ())

    def _save_event(self, fluent: str) -> str:
        """Returns the external that a fluent is saved in, or nothing if there is none.

        The published modes show ``holds(val(F,true),1)`` and declare ``event(save,F,0)``.
        """
        if fluent not in self._save_events:
            spellings = [fluent]
            name, arguments = split_term(fluent)
            if name == "val" and arguments[1:] == ["true"]:
                spellings.append(arguments[0])
            atoms = (event("save", spelling, 0) for spelling in spellings)
            self._save_events[fluent] = next((a for a in atoms if a in self._declared), "")
        return self._save_events[fluent]


def _situation(info: Info, true: Set[str], symbols: Sequence[str]) -> str:
    saved = [atom for atom in sorted(true) if atom.startswith(SAVE)]
    answer = f"; answer set: {' '.join(symbols) or 'empty'}" if symbols else ""
    return (
        f"infos: {' '.join(info.events()) or 'none'}; saved: {' '.join(saved) or 'none'}" + answer
    )


def _split(symbols: Sequence[str]) -> Tuple[List[str], List[str]]:
    """Returns the commands and the fluents for the next decision in an answer set."""
    commands, fluents = [], []
    for text in symbols:
        name, arguments = split_term(text)
        if name == "do" and len(arguments) == 3 and arguments[::2] == ["controller", "1"]:
            commands.append(arguments[1])
        elif name == "holds" and arguments[1:] == ["1"]:
            fluents.append(arguments[0])
    return commands, fluents
