"""Planner copy by assumptions: one grounding, and searches that assume which events are true."""

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
    Part,
    Result,
    Truth,
)
from rosoclingo.loop.journal import TERMINAL_STATUSES
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.situation import Situation
from rosoclingo.loop.values.atoms import SAVE, query
from rosoclingo.why.planner_copy import Copy, CopyAnswer, Deadline, PlanQuery, Verdict
from rosoclingo.why.rules import is_relaxed, relaxable

# asks(Z): a plan for one horizon from A to Z is wanted, whichever. wants(S,B): in it, the goal ends
# that slot S has had since step B. Without some facts, that may be before the current step A.
_PART, _ASKS, _WANTS = "rosoclingo_why", "rosoclingo_asks", "rosoclingo_wants"
_TIE = "rosoclingo_tie"
_RULES = f"""
#external {_ASKS}(z).
:- {_ASKS}(z), not 1 {{ query(T) : T = a..z }} 1.
"""
_WANTS_RULES = f"""
#defined status/3.
#external {_WANTS}(s,b).
rosoclingo_ends(s,b,H) :- status(s,({";".join(sorted(TERMINAL_STATUSES))}),T), T = b..H, H = a..z.
:- {_WANTS}(s,b), query(H), H = a..z, not rosoclingo_ends(s,b,H).
"""


class AssumingCopy(Copy):
    """A copy for encodings that declare their events as externals of each step."""

    def __init__(
        self,
        options: Options,
        situation: Situation,
        deadline: Deadline,
        last: Optional[int] = None,
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
        self._grounded = self.last
        self.deadline = deadline
        self._engine = Engine(options, rewrite=relaxable)
        planner = Planner(self._engine)
        self.slots = planner.begin()
        for step in range(1, self.last + 1):
            deadline.check()
            planner.ground_steps([step])
        planner.run(
            Add(_PART, ("a", "z"), _RULES),
            Add(_WANTS, ("s", "b", "a", "z"), _WANTS_RULES),
            Ground((Part(_PART, (str(self.step), str(self.last))),)),
            *(AssignExternal(query(h), Truth.FREE) for h in range(self.step, self._grounded + 1)),
            *(AssignExternal(atom, Truth.TRUE) for atom in situation.others),
            AssignExternal(f"{_ASKS}({self.last})", Truth.FREE),
        )
        self._planner = planner
        self._declared = planner.externals()
        self.savable = frozenset(atom for atom in self._declared if atom.startswith(SAVE))
        self._free: Dict[str, None] = {}
        self._wishes: Dict[str, None] = {}
        self._tied: Dict[Tuple[str, ...], str] = {}

    def _wants(self, goals: FrozenSet[str], told: FrozenSet[str]) -> List[Assumption]:
        """Returns the assumptions that the goals in some slots have to end, and others need not."""
        begins = self._begins(told)
        wished = {f"{_WANTS}({slot},{begins[slot]})": slot for slot in goals}
        for name in sorted(wished.keys() - self._wishes.keys()):
            values = (wished[name], begins[wished[name]], self.step, self._grounded)
            self._planner.run(
                Ground((Part(_WANTS, tuple(map(str, values))),)), AssignExternal(name, Truth.FREE)
            )
            self._wishes[name] = None
        return [Assumption(name, name in wished) for name in self._wishes]

    def unknown(self, events: Sequence[str]) -> List[str]:
        """Returns the reasons why some of these events cannot be told."""
        return [f"there is no external {atom}" for atom in events if atom not in self._declared]

    def ask(self, asked: PlanQuery, *, best: bool = False) -> Verdict:
        """Searches for a shortest plan; see :class:`.planner_copy.Copy`."""
        told = asked.told
        self._make_free(told)
        facts = [Assumption(atom, atom in told) for atom in self._free]
        wishes = [*self._wants(asked.goals, told), *asked.demands, *self._ties(())]
        outcome = self._solve([*self._asking(), *wishes, *facts])
        if outcome.result is not Result.SAT:
            core = frozenset(a.name for a in self._engine.core if a.value) & told
            return Verdict(self._without_plan(facts), core=core)
        for horizon in range(self.step, self.last + 1):
            asking = [*self._asking(horizon), *wishes, *facts]
            outcome = self._solve(asking)
            if outcome.result is Result.SAT:
                if best:
                    outcome = self._solve(asking, best=True)
                return Verdict(CopyAnswer.PLAN, self._plan(outcome.symbols, horizon, told))
        raise AssertionError("a plan for some horizon is none for any")

    def ask_any(self, asked: PlanQuery, others: Sequence[Sequence[str]] = ()) -> Verdict:
        """Searches for a plan with some events and any others; see :class:`.planner_copy.Copy`."""
        told = asked.told
        optional = frozenset(atom for group in others for atom in group) - told
        self._make_free(told | optional)
        facts = [Assumption(atom, atom in told) for atom in self._free if atom not in optional]
        asking = [*self._asking(), *self._wants(asked.goals, told), *asked.demands, *facts]
        asking += self._ties([group for group in others if len(group) > 1])
        if self._solve(asking).result is Result.SAT:
            return Verdict(CopyAnswer.PLAN)
        core = (a.name for a in self._engine.core if a.value is not is_relaxed(a.name))
        return Verdict(CopyAnswer.NONE, core=frozenset(core))

    def _ties(self, groups: Sequence[Sequence[str]]) -> List[Assumption]:
        """Returns assumptions: of each of these groups, all events are true, or none."""
        keys = {tuple(atom for atom in group if atom in self._free) for group in groups}
        for atoms in sorted(keys - self._tied.keys()):
            name = f"{_TIE}({len(self._tied)})"
            pairs = zip(atoms, (*atoms[1:], *atoms[:1]))
            rules = "".join(f":- {name}, {one}, not {other}. " for one, other in pairs)
            part = f"{_TIE}_{len(self._tied)}"
            self._planner.run(
                Add(part, (), f"#external {name}. {rules}"),
                Ground((Part(part),)),
                AssignExternal(name, Truth.FREE),
            )
            self._tied[atoms] = name
        return [Assumption(name, atoms in keys) for atoms, name in self._tied.items()]

    def _make_free(self, events: FrozenSet[str]) -> None:
        """Makes events free externals: searches decide them, unless they are assumed."""
        new: List[Command] = [
            AssignExternal(atom, Truth.FREE)
            for atom in sorted(events)
            if atom in self._declared and atom not in self._free
        ]
        self._planner.run(*new)
        self._free.update((c.name, None) for c in new if isinstance(c, AssignExternal))

    def _asking(self, horizon: Optional[int] = None) -> List[Assumption]:
        """Returns the assumptions that enforce a plan for a horizon; without one, for any."""
        asks = Assumption(f"{_ASKS}({self._grounded})", horizon is None)
        if horizon is None:
            beyond = range(self.last + 1, self._grounded + 1)
            return [asks, *(Assumption(query(h), False) for h in beyond)]
        horizons = range(self.step, self._grounded + 1)
        return [asks, *(Assumption(query(h), h == horizon) for h in horizons)]

    def _without_plan(self, facts: List[Assumption]) -> CopyAnswer:
        """Distinguishes, without a plan, whether the encoding has an answer set at all."""
        nobody = [Assumption(query(h), False) for h in range(self.step, self._grounded + 1)]
        idle = [Assumption(name, False) for name in self._wishes]
        asks = Assumption(f"{_ASKS}({self._grounded})", False)
        asking = [*facts, *idle, *nobody, asks, *self._ties(())]
        result = self._solve(asking).result
        return CopyAnswer.NONE if result is Result.SAT else CopyAnswer.CONTRADICTION
