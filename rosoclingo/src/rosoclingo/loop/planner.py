"""The solver of the planner's encoding, with what the commands need of it."""

from __future__ import annotations

import dataclasses
import time
from typing import Callable, Dict, Iterable, List, Optional, Sequence, Tuple

from rosclingo.errors import shorten
from rosclingo.wire import commands as wire
from rosclingo.wire.term_text import split_term
from rosoclingo.errors import PlannerError
from rosoclingo.loop.added import EMPTY_PARTS, SLOT, SLOT_PART, SLOTS
from rosoclingo.loop.atoms import QUERY, query
from rosoclingo.loop.demand import Demand, Pair, needed_horizon, step_parts
from rosoclingo.loop.inbox import Inbox
from rosoclingo.loop.journal import IMPROVING, Ended, SearchEnded
from rosoclingo.loop.quality import Quality
from rosoclingo.loop.solver import Solver

_BATCH_CHARACTERS = 2**20  # of the atoms in one request, far below what a solver node allows
_MOST_ROUNDS = 10_000  # answer sets in a row that ask for something
_AS_BEFORE = "as_before"  # as_before(K): the plan of search K is the one before
_SAME_SECONDS = 0.05  # that it may take at least to count what is left of a plan
_MANY = 20  # so many assignments after one that failed, it is quicker to ask for all externals


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
        quality: How good the plan is; None if its encoding minimises nothing, or if that is not
            known.
    """

    demand: Demand = dataclasses.field(default_factory=Demand)
    quality: Optional[Quality] = None
    _kept: Optional[KeptPlan] = None
    _later: List[str] = dataclasses.field(default_factory=list)  # externals that are to be true


class Planner(PlannerState):
    """The planner's solver, with what the commands need of it.

    Attributes:
        patience: After how many seconds an optimising search ends that has found a plan; 0
            for when it is through.
        recorded: Knows in a replay how searches end that depend on time.
        note: Called with how such a search has ended.
    """

    def __init__(self, solver: Solver, patience: float = 0.0) -> None:
        super().__init__()
        self._solver = solver
        self.patience = patience
        self._compares = False  # whether the search begins with what is left of the plan before
        self.recorded = Inbox()
        self.note: Callable[[SearchEnded], None] = lambda _: None
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
        self._later = []
        self._kept = self.quality = None
        is_first = slots is None
        self.run(wire.Restart(), *([SLOTS] if is_first else ()), *EMPTY_PARTS)
        self.demand.begin(() if self._is_translated else self._programs())
        base = [wire.Part("base"), *([wire.Part(SLOT_PART)] if is_first else ())]
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
        declared = [atom for atom in externals if atom.startswith(SLOT)]
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
        later, self._later = self._later, []
        if later:
            self.assign(later, wire.Truth.TRUE)
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
        if any(not command.name.startswith(QUERY) for command in truths):
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
        if stopped() and not self.recorded.is_search_due(improves=False):
            return wire.Outcome(wire.Result.UNKNOWN, interrupted=True)
        if self._kept is None:
            prefers = self.patience > 0 and self.demand.prefers and self.demand.searches > 0
            commands = self.demand.prepare(step, prefers=prefers)
            self._compares = prefers and bool(commands)
            self.run(*commands)
            outcome = self._solve_and_ground(stopped)
            needed = needed_horizon(outcome.symbols) if self.demand else None
            if needed is None or outcome.result is not wire.Result.SAT:
                return outcome
            self._kept = KeptPlan(outcome, needed)
        if horizon < self._kept.horizon:
            return wire.Outcome(wire.Result.UNSAT)
        return self._kept.outcome

    def improve(self, step: int, stopped: Callable[[], bool]) -> Optional[wire.Outcome]:
        """Looks for a better plan than the one that stands, until told to stop or through.

        It is not stopped before it is known what the plan costs that stands.

        That is for an encoding that has opted in, see ``Demand.improves``. What was published stays
        in the plan. If it is not told of a better one, the plan stands as it was.

        Args:
            step: The current step.
            stopped: Whether the search has to end; what it has found is taken then.

        Returns:
            The better plan; None if none was found.

        Raises:
            PlannerError: The encoding asks for what there is not.
        """
        self.run(self.demand.prepare_improving(step))
        ended = self.recorded.search_due(*IMPROVING) or self._look_for_better(stopped)
        self.note(ended)
        if ended.how is Ended.NOTHING:
            self.quality = None
            return None
        parts = self.demand.asked_for(ended.symbols)
        if parts:
            self.run(self.demand.ground(parts))
        outcome = self._solve_and_ground(lambda: False, rounds=1)
        self.quality, self._kept = ended.quality, None
        is_better = ended.how is Ended.BETTER and outcome.result is wire.Result.SAT
        return outcome if is_better else None

    def _look_for_better(self, stopped: Callable[[], bool]) -> SearchEnded:
        """Finds out what the plan costs now, and looks for one that costs less."""
        found: List[wire.Improvement] = []
        outcome = self._solver.solve((self._same(),), None, found.append)
        cost = self._cost(outcome, found)
        if outcome.result is not wire.Result.SAT or not cost:
            return SearchEnded(Ended.NOTHING)
        before, symbols = cost, outcome.symbols
        found.clear()
        outcome = self._solver.solve((), stopped, found.append)
        better = self._cost(outcome, found)
        bound = better if outcome.result is wire.Result.SAT else self._bound()
        if not better or better >= before:
            return SearchEnded(Ended.AS_BEFORE, symbols, Quality(before, bound))
        symbols = outcome.symbols or found[-1].symbols
        return SearchEnded(Ended.BETTER, symbols, Quality(better, bound))

    def _same(self) -> wire.Assumption:
        """Returns the assumption that the plan is the one before, as far as it is left."""
        return wire.Assumption(f"{_AS_BEFORE}({self.demand.searches})", True)

    def _solve_and_ground(self, stopped: Callable[[], bool], rounds: int = 0) -> wire.Outcome:
        """Searches until an answer set asks for nothing new.

        Args:
            stopped: Whether it has to end.
            rounds: How many answer sets have asked for something already.

        Returns:
            How the last search ended; interrupted also if one before it was cut off.
        """
        bound: Optional[Tuple[int, ...]] = None  # if one was cut off
        for number in range(rounds, _MOST_ROUNDS):
            called = self.recorded.search_due(Ended.CALLED, number=number)
            is_stopped = stopped() and not self.recorded.is_search_due(improves=False)
            if called or is_stopped:  # while it was grounded
                return self._be_called(number)
            outcome, quality = self._solve(stopped, number)
            if outcome.result is wire.Result.UNKNOWN:
                return self._be_called(number)
            if outcome.result is not wire.Result.SAT:
                return outcome
            if outcome.interrupted:
                bound = quality.bound if quality else ()
            if quality is not None and bound is not None:
                quality = dataclasses.replace(quality, bound=bound)
            parts = self.demand.asked_for(outcome.symbols) if self.demand else []
            # An encoding that looks for better plans asks for something in each new one, and has
            # decided then what that costs.
            if parts or not self.demand.improves:
                self.quality = quality
            if not parts:
                return dataclasses.replace(outcome, interrupted=bound is not None)
            self.run(self.demand.ground(parts))
        raise PlannerError(
            f"{_MOST_ROUNDS} answer sets in a row of the planner have asked for something, the "
            f"last for {shorten(str(parts[0]))}: does it ever stop asking?"
        )

    def _be_called(self, number: int) -> wire.Outcome:
        """Takes note that something has interrupted a search, which has its number."""
        if self.demand and self.patience:
            self.note(SearchEnded(Ended.CALLED, round=number))
        return wire.Outcome(wire.Result.UNKNOWN, interrupted=True)

    def _solve(
        self, stopped: Callable[[], bool], number: int
    ) -> Tuple[wire.Outcome, Optional[Quality]]:
        """Searches until told to stop, or, with a model, for as long as is allowed.

        Args:
            stopped: Whether it has to end.
            number: How many answer sets have asked for something before.

        Returns:
            How that has ended, and how good the answer set is, if that is known.
        """
        ended = self.recorded.search_due(Ended.CUT, Ended.FINISHED, number=number)
        if ended is None:
            outcome, quality = self._solve_in_time(stopped, number)
            if outcome.result is not wire.Result.SAT or not self.patience:
                return outcome, quality
            how = Ended.CUT if outcome.interrupted else Ended.FINISHED
            ended = SearchEnded(how, outcome.symbols, quality, number)
        self.note(ended)
        is_cut = ended.how is Ended.CUT
        outcome = wire.Outcome(wire.Result.SAT, interrupted=is_cut, symbols=ended.symbols)
        return outcome, ended.quality

    def _solve_in_time(
        self, stopped: Callable[[], bool], number: int
    ) -> Tuple[wire.Outcome, Optional[Quality]]:
        """Does what :meth:`_solve` says; with an answer set, ``interrupted`` is by the time."""
        found: List[wire.Improvement] = []
        limit = self.patience if not self.recorded.knows_searches else 0.0
        end = time.monotonic() + limit
        before: Tuple[Tuple[int, ...], Tuple[str, ...]] = (), ()  # what is left costs, and is
        is_stopped = False

        def has_to_end() -> bool:
            nonlocal is_stopped
            is_stopped = is_stopped or stopped()
            has_plan = bool(limit and (found or before[0]))
            return is_stopped or (has_plan and time.monotonic() > end)

        if limit and self._compares and not number:
            allowed, end = end, max(end, time.monotonic() + _SAME_SECONDS)
            outcome = self._solver.solve((self._same(),), has_to_end, found.append)
            end = allowed
            if found:
                symbols = outcome.symbols or found[-1].symbols
                before = self._cost(outcome, found), symbols
                found.clear()
        outcome = self._solver.solve((), has_to_end, found.append)
        is_cut = limit and outcome.interrupted and not is_stopped
        cost = self._cost(outcome, found)
        if not (is_cut and (found or before[0])):
            return outcome, Quality(cost, cost) if cost else None
        symbols = outcome.symbols or (found[-1].symbols if found else ())
        if before[0] and not (cost and cost < before[0]):
            cost, symbols = before
        if self.demand.improves and not self.demand.asks(symbols):
            # The plan stands, or is what an answer set before has decided: there is no other.
            return wire.Outcome(wire.Result.SAT, symbols=symbols), Quality(cost, cost)
        quality = Quality(cost, self._bound())
        return wire.Outcome(wire.Result.SAT, interrupted=True, symbols=symbols), quality

    def _cost(self, outcome: wire.Outcome, found: Sequence[wire.Improvement]) -> Tuple[int, ...]:
        """Returns what the last answer set of a search costs; nothing if that is not known."""
        if found and (found[-1].symbols == outcome.symbols or not outcome.symbols):
            return found[-1].cost
        # Over ROS, the result may be here before the costs. Who does not minimise is not asked.
        is_known = bool(found) or self.demand.improves
        return self._summary("costs") if is_known and outcome.symbols else ()

    def _bound(self) -> Tuple[int, ...]:
        """Returns what each answer set of the last search costs at least, if that is known."""
        return self._summary("lower")

    def _summary(self, name: str) -> Tuple[int, ...]:
        for answer in self._solver.run([wire.GetStats()]).answers:
            if isinstance(answer, wire.Stats):
                return tuple(map(int, answer.values.get("summary", {}).get(name, ())))
        return ()

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

    def make_true_later(self, atoms: Sequence[str]) -> None:
        """Has externals that there are made true before the planner is asked for anything."""
        if atoms:
            self._later += atoms
            self._forget_plan()

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
        and command.name.startswith(QUERY)
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
