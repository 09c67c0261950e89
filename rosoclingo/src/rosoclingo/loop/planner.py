"""The solver of the planner's encoding, with what the commands need of it."""

from __future__ import annotations

import dataclasses
from typing import Callable, Dict, Iterable, List, Optional, Sequence, Set, Tuple

from rosclingo.wire import commands as wire
from rosclingo.wire.term_text import split_term
from rosoclingo.loop.added import EMPTY_PARTS, SLOT, SLOT_PART, SLOTS
from rosoclingo.loop.atoms import QUERY, query
from rosoclingo.loop.demand import Demand, Pair, needed_horizon, step_parts
from rosoclingo.loop.journal import Ended, SearchEnded
from rosoclingo.loop.layers import LayersState
from rosoclingo.loop.neighbourhoods import Neighbourhoods
from rosoclingo.loop.quality import Quality
from rosoclingo.loop.recorded import RecordedSearches
from rosoclingo.loop.requests import Requests, read_externals
from rosoclingo.loop.searching import Searching
from rosoclingo.loop.solver import Solver

DEFAULT_PATIENCE = -1.0
"""The value for what every user wants: a second, if better plans are looked for while robots act,
and a tenth of it for a plan of many tasks, which is not proven the best soon; else 0."""

_PATIENCE = 1.0
_FIRST = 0.1


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
        layers: What is known of the layers of its plans.
    """

    demand: Demand = dataclasses.field(default_factory=Demand)
    quality: Optional[Quality] = None
    layers: LayersState = dataclasses.field(default_factory=LayersState)
    _kept: Optional[KeptPlan] = None
    _later: List[str] = dataclasses.field(default_factory=list)  # externals that are to be true


class Planner(PlannerState):
    """The planner's solver, with what the commands need of it.

    Attributes:
        is_awaited: Whether no better plan is looked for while robots act.
        recorded: Knows in a replay how searches end that depend on time.
        note: Called with how such a search has ended.
        missing: Called with an external that a mode makes true or free, and that there is not.
    """

    def __init__(self, solver: Solver, patience: float = 0.0) -> None:
        super().__init__()
        self._solver = solver
        self._requests = Requests(solver)
        self._patience = patience
        self.is_awaited = False
        self.recorded = RecordedSearches()
        self._neighbourhoods = Neighbourhoods()
        self.note: Callable[[SearchEnded], None] = lambda _: None
        self.missing: Callable[[str], None] = lambda _: None
        self._optional: Set[str] = set()  # externals that a mode has set
        # A dialect's translation may be in between.
        self._is_translated = bool(getattr(solver, "events_are_facts", False))

    @property
    def patience(self) -> float:
        """After how many seconds an optimising search ends that has found a plan, 0 for never."""
        if self._patience == DEFAULT_PATIENCE:
            return _PATIENCE if self.demand.improves else 0.0
        return self._patience

    @patience.setter
    def patience(self, seconds: float) -> None:
        self._patience = seconds

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
        self.layers = LayersState()
        is_first = slots is None
        self.run(wire.Restart(), *([SLOTS] if is_first else ()), *EMPTY_PARTS)
        self.demand.begin(() if self._is_translated else self._requests.programs())
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
        declared = [atom for atom in externals if atom.startswith(SLOT)]
        ids = [split_term(atom)[1][0] for atom in declared]
        self.demand.learn_examples(externals, ids)
        self.run(*(wire.ReleaseExternal(atom) for atom in declared))
        return ids

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
        return self._run(commands)[0]

    def _run(self, commands: Sequence[wire.Command]) -> Tuple[wire.Reply, List[str]]:
        """Runs commands; returns the reply, and the externals set by a mode that do not exist."""
        later, self._later = self._later, []
        if later:
            self.assign(later, wire.Truth.TRUE)
        commands = (*self.demand.take_pending(), *commands)
        if not commands:
            return wire.Reply(), []
        truths = [c for c in commands if isinstance(c, (wire.AssignExternal, wire.ReleaseExternal))]
        if any(not command.name.startswith(QUERY) for command in truths):
            self._forget_plan()
        reply, skipped = self._requests.run(commands, self._optional)
        missing = [one.name for one in skipped if one.value is not wire.Truth.FALSE]
        for atom in missing:
            self.missing(atom)
        return reply, missing

    def _forget_plan(self) -> None:
        """Takes note that something was told by which the plan may be another one."""
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
            self.run(*commands)
            outcome, self.quality = self._searching().find(
                stopped, self.quality, compares=prefers and bool(commands)
            )
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
        ended, better = self._searching().improve(stopped)
        self.quality = ended.quality
        if ended.how is not Ended.NOTHING:
            self._kept = None
        return better

    def _searching(self) -> Searching:
        return Searching(
            self._solver,
            self.demand,
            lambda parts: self.run(self.demand.ground(parts)),
            patience=self.patience,
            first=_FIRST if self._patience == DEFAULT_PATIENCE and not self.is_awaited else None,
            neighbourhoods=self._neighbourhoods,
            recorded=self.recorded,
            note=self.note,
            layers=self.layers,
            run=self.run,
        )

    def has_answer_set(self, stopped: Callable[[], bool]) -> Optional[bool]:
        """Returns whether there is any, be it the best one or not; None if told to stop before."""
        if stopped():
            return None
        self.run()  # what is still to be told
        return self._searching().has_answer_set(stopped)

    def externals(self) -> Dict[str, wire.Truth]:
        """Returns all externals with their values."""
        return read_externals(self.run(wire.GetExternals()))

    def set_external(self, atom: str, value: wire.Truth) -> bool:
        """Sets an external as a mode says; nothing happens if it is none, as in clingo.

        An encoding that has opted in learns a ``query(T)`` together with what it is told.

        Returns:
            Whether there is such an external, as far as that is known.

        Raises:
            PlannerError: The solver refuses the request.
        """
        self._optional.add(atom)
        if self.demand and atom.startswith(QUERY):
            self.demand.set_query(atom, value)
            return True
        return atom not in self._run([wire.AssignExternal(atom, value)])[1]

    def declare(self, pairs: Sequence[Pair]) -> None:
        """Asks an encoding that is told its events whether it knows them."""
        self._requests.declare(self.demand, pairs)

    def tell(self, atoms: Sequence[str]) -> List[Tuple[str, str]]:
        """Makes events true: by their externals, or in the way in which the encoding is told them.

        Returns:
            The atoms that the encoding does not know, each with the reason.
        """
        if not self.demand.tells:
            return self.assign(atoms, wire.Truth.TRUE)
        pairs = {atom: _pair(atom) for atom in atoms}
        asked = {atom: pair for atom, pair in pairs.items() if pair[0] not in ("commit", "save")}
        self.declare(list(asked.values()))
        missing = [atom for atom, pair in asked.items() if not self.demand.declared[pair]]
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
        if not atoms:
            return []
        self.run()  # what is still to be told
        if not all(atom.startswith(QUERY) for atom in atoms):
            self._forget_plan()
        return self._requests.assign(atoms, value)


def _pair(atom: str) -> Pair:
    """Returns the source and the content of an event."""
    source, content, _ = split_term(atom)[1]
    return source, content
