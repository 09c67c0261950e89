"""What the loop needs of a solver.

:class:`rosclingo.ros.client.Client` is one over ROS, and
:class:`rosclingo.solver.engine.Engine` one in process.
"""

from __future__ import annotations

import dataclasses
import time
from typing import Callable, Dict, Iterable, List, Optional, Protocol, Sequence, Tuple

from rosclingo.errors import shorten
from rosclingo.wire import commands as wire
from rosclingo.wire.term_text import split_term
from rosoclingo.errors import PlannerError
from rosoclingo.loop.atoms import query
from rosoclingo.loop.demand import Demand, Pair, needed_horizon, step_parts

HAS = "rosoclingo_has"
"""A term that is shown with an answer set in which there is an atom, be that shown or not."""

SEEN = {"do": 3, "status": 3}
"""What rosoclingo has to see of an answer set, with the number of arguments."""

_SHOWS = " ".join(
    f"#defined {name}/{arity}. #show {HAS}({name}) : {name}({'_,' * (arity - 1)}t)."
    for name, arity in SEEN.items()
)
EMPTY_PARTS = (
    wire.Add("state", ("t",), ""),
    wire.Add("transition", ("t",), ""),
    wire.Add("query", ("t",), _SHOWS),
)
"""What lets an encoding leave out a part that it does not need, and tells what it hides."""

# Declares an external for each slot, because that is how a solver node shows its atoms.
_SLOT = "rosoclingo_slot"
_SLOTS = f"#defined rslot/1. #external {_SLOT}(ID) : rslot(ID)."

_BATCH_CHARACTERS = 2**20  # of the atoms in one request, far below what a solver node allows
_MOST_ROUNDS = 10_000  # answer sets in a row that ask for something
_MANY = 20  # so many assignments after one that failed, it is quicker to ask for all externals


class Solver(Protocol):
    """Runs commands and solve calls. One thread makes the calls."""

    def run(self, commands: Sequence[wire.Command]) -> wire.Reply:
        """Runs commands in order until one fails; what ran before that stays."""

    def solve(
        self,
        assumptions: Sequence[wire.Assumption] = ...,
        stopped: Optional[Callable[[], bool]] = ...,
        improved: Callable[[wire.Improvement], None] = ...,
    ) -> wire.Outcome:
        """Searches for answer sets until told to stop."""

    def check(self) -> None:
        """Raises an error if the solver is not there any more."""


class Forwarding:
    """A solver that hands all on to another; subclasses change some of it."""

    def __init__(self, solver: Solver) -> None:
        self._solver = solver

    def run(self, commands: Sequence[wire.Command]) -> wire.Reply:
        """Runs commands in order until one fails; what ran before that stays."""
        return self._solver.run(commands)

    def solve(
        self,
        assumptions: Sequence[wire.Assumption] = (),
        stopped: Optional[Callable[[], bool]] = None,
        improved: Callable[[wire.Improvement], None] = lambda _: None,
    ) -> wire.Outcome:
        """Searches for answer sets until told to stop."""
        return self._solver.solve(assumptions, stopped, improved)

    def check(self) -> None:
        """Raises an error if the solver is not there any more."""
        self._solver.check()


@dataclasses.dataclass(frozen=True)
class KeptPlan:
    """A plan that stands until something is told, for horizons from one on."""

    outcome: wire.Outcome
    horizon: int


@dataclasses.dataclass
class PlannerState:
    """What of :class:`Planner` is saved.

    Attributes:
        demand: What its encoding is told by grounding, and asks for.
    """

    demand: Demand = dataclasses.field(default_factory=Demand)
    _kept: Optional[KeptPlan] = None


class Planner(PlannerState):
    """The planner's solver, with what the commands need of it.

    Attributes:
        search_seconds: After how many seconds an optimising search ends that has found a plan; 0
            for when it is through.
    """

    def __init__(self, solver: Solver, search_seconds: float = 0.0) -> None:
        super().__init__()
        self._solver = solver
        self.search_seconds = search_seconds
        # A dialect's translation may be in between.
        self._is_translated = bool(getattr(solver, "events_are_facts", False))

    @property
    def events_are_facts(self) -> bool:
        """Whether an event that was made true stays so."""
        return self._is_translated or self.demand.tells

    @property
    def needed(self) -> Optional[int]:
        """The first horizon of the plan that was found, if its encoding says so."""
        return None if self._kept is None else self._kept.horizon

    def begin(self, saved: Sequence[str] = (), slots: Optional[Sequence[str]] = None) -> List[str]:
        """Grounds base, state(0) and query(0) on a fresh solver.

        Args:
            saved: The events ``event(save,F,0)`` that an encoding which is told its events knows
                from the beginning.
            slots: The ids for goals, if they are known from the last time.

        Returns:
            The ids that the encoding has for goals.

        Raises:
            PlannerError: A command failed, or the encoding lacks a part.
        """
        self.demand.begin(())
        self._kept = None
        is_first = slots is None
        self.run(wire.Restart(), *([wire.Add(_SLOT, (), _SLOTS)] if is_first else ()), *EMPTY_PARTS)
        self.demand.begin(() if self._is_translated else self._programs())
        base = [wire.Part("base"), *([wire.Part(_SLOT)] if is_first else ())]
        first = [wire.Part("state", ("0",)), wire.Part("query", ("0",))]
        if self.demand:
            self.run(self.demand.ground(base))
            self.demand.tell(saved)
            self.run(self.demand.ground(first))
        else:
            self.run(wire.Ground((*base, *first)))
        if slots is not None:
            return list(slots)
        externals = self.externals()
        self.demand.learn_examples(externals)
        declared = [atom for atom in externals if atom.startswith(f"{_SLOT}(")]
        self.run(*(wire.ReleaseExternal(atom) for atom in declared))
        return [split_term(atom)[1][0] for atom in declared]

    def _programs(self) -> Sequence[Tuple[str, int]]:
        """Returns the program parts; none if the solver is one that cannot tell."""
        reply = self._solver.run([wire.GetPrograms()])
        return next((a.parts for a in reply.answers if isinstance(a, wire.Programs)), ())

    def ground_steps(self, steps: Iterable[int]) -> None:
        """Grounds state, transition and query of steps after step 0.

        While there is a plan that stands, that has time until the planner is needed.
        """
        if self._kept is None:
            self.run(*map(self._grounding, steps))
        else:
            self.demand.add_steps(steps)

    def _grounding(self, step: int) -> wire.Ground:
        return (
            self.demand.ground_step(step) if self.demand else wire.Ground(tuple(step_parts(step)))
        )

    def query(self, horizon: int, before: Optional[int], steps: Sequence[int]) -> None:
        """Asks for plans with a horizon.

        While there is a plan that stands, that has time until the planner is needed.

        Args:
            horizon: The step at which all has to be done.
            before: The horizon that was asked for before, if that was another one.
            steps: What is to be grounded for it.

        Raises:
            PlannerError: A command failed.
        """
        if self._kept is not None:
            self.demand.add_steps(steps)
            if before is not None:
                self.demand.set_query(query(before), wire.Truth.FALSE)
            self.demand.set_query(query(horizon), wire.Truth.TRUE)
            return
        old = [] if before is None else [wire.AssignExternal(query(before), wire.Truth.FALSE)]
        grounding = map(self._grounding, steps)
        self.run(*old, *grounding, wire.AssignExternal(query(horizon), wire.Truth.TRUE))

    def run(self, *commands: wire.Command) -> wire.Reply:
        """Runs commands, after what is still to be told.

        Raises:
            PlannerError: A command failed.
        """
        commands = (*self.demand.take_pending(), *commands)
        if not commands:
            return wire.Reply()
        self._note(commands)
        reply = self._solver.run(commands)
        while reply.failure is not None and _is_false_query(commands, reply.failure.index):
            commands = commands[reply.failure.index + 1 :]  # what does not exist is false already
            reply = self._solver.run(commands) if commands else wire.Reply()
        if reply.failure is not None:
            failure = reply.failure
            raise PlannerError(
                f"the planner refused <{failure.command}>: {failure.message}; check that its "
                "encoding fits the mode, and that nothing else restarted it"
            )
        return reply

    def _note(self, commands: Sequence[wire.Command]) -> None:
        """Takes note of what may change the plan."""
        truths = [c for c in commands if isinstance(c, (wire.AssignExternal, wire.ReleaseExternal))]
        if any(not command.name.startswith("query(") for command in truths):
            self._forget_plan()

    def _forget_plan(self) -> None:
        self._kept = None
        self.demand.note_news()

    def search(self, step: int, horizon: int, stopped: Callable[[], bool]) -> wire.Outcome:
        """Searches for a plan until told to stop, which may be so from the beginning.

        A plan whose encoding says from which horizon on it is one stands until something is told.

        Args:
            step: The current step.
            horizon: The step at which all has to be done.
            stopped: Whether the search has to end.

        Raises:
            PlannerError: The encoding asks for what there is not.
        """
        if stopped():
            return wire.Outcome(wire.Result.UNKNOWN, interrupted=True)
        if self._kept is None:
            self.run(*self.demand.prepare(step))
            outcome = self._solve_and_ground(stopped)
            needed = needed_horizon(outcome.symbols) if self.demand else None
            if needed is None or outcome.result is not wire.Result.SAT:
                return outcome
            self._kept = KeptPlan(outcome, needed)
        if horizon < self._kept.horizon:
            return wire.Outcome(wire.Result.UNSAT)
        return self._kept.outcome

    def _solve_and_ground(self, stopped: Callable[[], bool]) -> wire.Outcome:
        """Searches until an answer set asks for nothing new."""
        for _ in range(_MOST_ROUNDS):
            if stopped():  # while it was grounded
                return wire.Outcome(wire.Result.UNKNOWN, interrupted=True)
            outcome = self._solve(stopped)
            if not (self.demand and outcome.result is wire.Result.SAT):
                return outcome
            parts = self.demand.asked_for(outcome.symbols)
            if not parts:
                return outcome
            self.run(self.demand.ground(parts))
        raise PlannerError(
            f"{_MOST_ROUNDS} answer sets in a row of the planner have asked for something, the "
            f"last for {shorten(str(parts[0]))}: does it ever stop asking?"
        )

    def _solve(self, stopped: Callable[[], bool]) -> wire.Outcome:
        """Searches until told to stop, or, with a model, for as long as is allowed."""
        if not self.search_seconds:
            return self._solver.solve((), stopped)
        found: List[wire.Improvement] = []
        end = time.monotonic() + self.search_seconds
        is_stopped = False

        def has_to_end() -> bool:
            nonlocal is_stopped
            is_stopped = is_stopped or stopped()
            return is_stopped or (bool(found) and time.monotonic() > end)

        outcome = self._solver.solve((), has_to_end, found.append)
        if outcome.interrupted and found and not is_stopped:
            symbols = outcome.symbols or found[-1].symbols
            return wire.Outcome(wire.Result.SAT, interrupted=True, symbols=symbols)
        return outcome

    def has_answer_set(self, stopped: Callable[[], bool]) -> Optional[bool]:
        """Returns whether there is any, be it the best one or not; None if told to stop before."""
        if stopped():
            return None
        self.run()  # what is still to be told
        found: List[wire.Improvement] = []
        outcome = self._solver.solve((), lambda: bool(found) or stopped(), found.append)
        if found or outcome.result is wire.Result.SAT:
            return True
        return False if outcome.result is wire.Result.UNSAT else None

    def externals(self) -> Dict[str, wire.Truth]:
        """Returns all externals with their values."""
        (answer,) = self.run(wire.GetExternals()).answers
        assert isinstance(answer, wire.Externals)
        return dict(answer.values)

    def set_query(self, query: str, value: wire.Truth) -> None:
        """Sets an external ``query(T)``: whether all has to be done at a horizon.

        An encoding that has opted in learns it together with what it is told.

        Raises:
            PlannerError: There is no such external.
        """
        if self.demand:
            self.demand.set_query(query, value)
        elif value is wire.Truth.FALSE:
            self.assign([query], value)  # what does not exist is false already
        else:
            self.run(wire.AssignExternal(query, value))

    def declare(self, pairs: Sequence[Pair]) -> None:
        """Asks an encoding that is told its events whether it knows them."""
        rest = self.demand.questions(pairs)
        while rest:
            failure = self._solver.run(self.demand.ask(rest)).failure
            if failure is not None and failure.index < 1:
                raise PlannerError(f"the planner refused a request: {failure.message}")
            known = len(rest) if failure is None else failure.index - 1
            for pair in rest[:known]:
                self.demand.learn(pair, True)
            for pair in rest[known : known + 1]:
                self.demand.learn(pair, False)
            rest = rest[known + 1 :]

    def tell(self, atoms: Sequence[str]) -> List[Tuple[str, str]]:
        """Makes events true: by their externals, or in the way in which the encoding is told them.

        Returns:
            The atoms that the encoding does not know, each with the reason.
        """
        if not self.demand.tells:
            return self.assign(atoms, wire.Truth.TRUE)
        pairs = {atom: _pair(atom) for atom in atoms}
        own = ("commit", "save")
        self.declare([pair for pair in pairs.values() if pair[0] not in own])
        missing = [
            atom
            for atom, pair in pairs.items()
            if pair[0] not in own and not self.demand.declared[pair]
        ]
        self.demand.tell([atom for atom in atoms if atom not in missing])
        if len(missing) < len(atoms):
            self._forget_plan()
        return [(atom, f"there is no external event({','.join(pairs[atom])})") for atom in missing]

    def assign(self, atoms: Sequence[str], value: wire.Truth) -> List[Tuple[str, str]]:
        """Assigns a value to those atoms that are externals.

        Returns:
            The other atoms, each with the reason.
        """
        missing: List[Tuple[str, str]] = []
        rest = list(atoms)
        while rest:
            batch = _batch(rest)
            commands = [wire.AssignExternal(atom, value) for atom in batch]
            self.run()  # what is still to be told
            self._note(commands)
            reply = self._solver.run(commands)
            done = len(batch)
            if reply.failure is not None:
                index, message = reply.failure.index, reply.failure.message
                if index < 0 and len(batch) > 1:
                    raise PlannerError(f"the planner refused a request: {message}")
                index = max(index, 0)
                missing.append((batch[index], message))
                done = index + 1
            rest = rest[done:]
            if reply.failure is not None and len(rest) > _MANY:
                declared = self.externals()
                unknown = [atom for atom in rest if atom not in declared]
                missing += [(atom, f"there is no external {atom}") for atom in unknown]
                rest = [atom for atom in rest if atom in declared]
        return missing


def _is_false_query(commands: Sequence[wire.Command], index: int) -> bool:
    command = commands[index] if index >= 0 else None
    return (
        isinstance(command, wire.AssignExternal)
        and command.value is wire.Truth.FALSE
        and command.name.startswith("query(")
    )


def _pair(atom: str) -> Pair:
    """Returns the source and the content of an event."""
    source, content, _ = split_term(atom)[1]
    return source, content


def _batch(atoms: Sequence[str]) -> List[str]:
    """Returns the first atoms, as many as fit into one request; at least one."""
    size = 0
    for number, atom in enumerate(atoms):
        size += len(atom)
        if number and size > _BATCH_CHARACTERS:
            return list(atoms[:number])
    return list(atoms)
