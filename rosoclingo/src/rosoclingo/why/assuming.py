"""A copy whose events are externals: one grounding, and searches with assumptions."""

from __future__ import annotations

from typing import Dict, FrozenSet, List, Optional, Sequence, Tuple

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import (
    Add,
    AssignExternal,
    Assumption,
    Command,
    Ground,
    Improvement,
    Outcome,
    Part,
    Result,
    Truth,
)
from rosoclingo.errors import InterruptedQuestionError
from rosoclingo.loop.atoms import SAVE, query
from rosoclingo.loop.planner import Planner
from rosoclingo.why.copy import ENDS, Answer, Copy, Deadline, Verdict
from rosoclingo.why.situation import Situation

# asks(A,Z): a plan for one horizon from A to Z is wanted, whichever. wants(S,Z): in it, the goal in
# slot S ends.
_PART, _ASKS, _WANTS = "rosoclingo_why", "rosoclingo_asks", "rosoclingo_wants"
_RULES = f"""
#defined status/3. #defined rslot/1.
#external {_ASKS}(z).
:- {_ASKS}(z), not 1 {{ query(T) : T = a..z }} 1.
#external {_WANTS}(S,z) : rslot(S).
rosoclingo_ends(S,H,z) :- status(S,({";".join(sorted(ENDS))}),T), T = a..H, H = a..z, rslot(S).
:- {_WANTS}(S,z), query(H), H = a..z, not rosoclingo_ends(S,H,z).
"""


class AssumingCopy(Copy):
    """A copy for encodings that declare their events as externals of each step."""

    def __init__(
        self, options: Options, situation: Situation, deadline: Deadline, last: Optional[int] = None
    ) -> None:
        """Grounds all steps.

        Args:
            options: The planner's command line.
            situation: What the planner knows.
            deadline: When to end.
            last: The last step that may be planned for; by default, that of the situation.
        """
        self.step = situation.step
        self.last = max(situation.step, situation.last if last is None else last)
        self.deadline = deadline
        self._engine = Engine(options)
        planner = Planner(self._engine)
        self.slots = planner.begin()
        for step in range(1, self.last + 1):
            deadline.check()
            planner.ground_steps([step])
        planner.run(
            Add(_PART, ("a", "z"), _RULES),
            Ground((Part(_PART, (str(self.step), str(self.last))),)),
            *(AssignExternal(query(h), Truth.FREE) for h in self._horizons()),
            *(AssignExternal(atom, Truth.TRUE) for atom in situation.others),
            AssignExternal(f"{_ASKS}({self.last})", Truth.FREE),
            *(AssignExternal(self._wants(slot), Truth.FREE) for slot in self.slots),
        )
        self._planner = planner
        self._declared = planner.externals()
        self.savable = frozenset(atom for atom in self._declared if atom.startswith(SAVE))
        self._free: Dict[str, None] = {}

    def _horizons(self) -> range:
        return range(self.step, self.last + 1)

    def _wants(self, slot: str) -> str:
        return f"{_WANTS}({slot},{self.last})"

    def unknown(self, events: Sequence[str]) -> List[str]:
        """Returns the reasons why some of these events cannot be told."""
        return [f"there is no external {atom}" for atom in events if atom not in self._declared]

    def ask(
        self,
        told: FrozenSet[str],
        goals: FrozenSet[str] = frozenset(),
        demands: Tuple[Assumption, ...] = (),
        *,
        best: bool = False,
    ) -> Verdict:
        """Looks for a shortest plan; see :class:`.copy.Copy`."""
        new: List[Command] = [
            AssignExternal(atom, Truth.FREE)
            for atom in sorted(told)
            if atom in self._declared and atom not in self._free
        ]
        self._planner.run(*new)
        self._free.update((c.name, None) for c in new if isinstance(c, AssignExternal))
        facts = [Assumption(atom, atom in told) for atom in self._free]
        wishes = [Assumption(self._wants(slot), slot in goals) for slot in self.slots]
        wishes += demands
        outcome = self._search([*self._asking(), *wishes, *facts], best=False)
        if outcome.result is not Result.SAT:
            core = frozenset(a.name for a in self._engine.core if a.value) & told
            return Verdict(self._without_plan(facts), core=core)
        for horizon in self._horizons():
            asking = [*self._asking(horizon), *wishes, *facts]
            outcome = self._search(asking, best=False)
            if outcome.result is Result.SAT:
                if best:
                    outcome = self._search(asking, best=True)
                return Verdict(Answer.PLAN, self._plan(outcome.symbols, horizon, told))
        raise AssertionError("a plan for some horizon is none for any")

    def _asking(self, horizon: Optional[int] = None) -> List[Assumption]:
        """Returns what asks for a plan for a horizon; without one, for any."""
        asks = Assumption(f"{_ASKS}({self.last})", horizon is None)
        if horizon is None:
            return [asks]
        return [asks, *(Assumption(query(h), h == horizon) for h in self._horizons())]

    def _without_plan(self, facts: List[Assumption]) -> Answer:
        """Returns whether there is an answer set at least."""
        nobody = [Assumption(query(h), False) for h in self._horizons()]
        idle = [Assumption(self._wants(slot), False) for slot in self.slots]
        asks = Assumption(f"{_ASKS}({self.last})", False)
        result = self._search([*facts, *idle, *nobody, asks], best=False).result
        return Answer.NONE if result is Result.SAT else Answer.CONTRADICTION

    def _search(self, assumptions: Sequence[Assumption], *, best: bool) -> Outcome:
        """Searches for any answer set, or for the best one."""
        self.deadline.check()
        found: List[Improvement] = []

        def stopped() -> bool:
            return (bool(found) and not best) or self.deadline.is_over()

        outcome = self._engine.solve(assumptions, stopped, found.append)
        if found and not best:
            return Outcome(Result.SAT, symbols=found[-1].symbols)
        if outcome.result is Result.UNKNOWN:
            if found:  # the best so far
                return Outcome(Result.SAT, interrupted=True, symbols=found[-1].symbols)
            raise InterruptedQuestionError("there was no time for an answer")
        return outcome
