"""Finds a reason: a minimal set of facts with which there is no plan."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from itertools import chain, combinations
from typing import Callable, Dict, FrozenSet, Iterable, List, Optional, Sequence, Set, Tuple

import clingo

from rosoclingo.errors import InterruptedQuestionError
from rosoclingo.why.facts import Fact, FactKind, Facts, atoms
from rosoclingo.why.planner_copy import CopyAnswer, Deadline, Possible, Verdict

Ask = Callable[[FrozenSet[Fact]], Verdict]
AskAny = Callable[[FrozenSet[Fact], FrozenSet[Fact]], Optional[bool]]
_TOGETHER = (
    (FactKind.CANCEL, FactKind.REQUEST, FactKind.SAVED), (FactKind.ANNOUNCEMENT,),
    (FactKind.FAILURE, FactKind.ACTION), (FactKind.RULE,),
)  # fmt: skip
_BUDGET = 0.1  # of the time that is left, for looking whether there is a smaller set
_ENABLING = 0.3  # of the time that is left, for the search for enabling facts
_MOST_ENABLING = 2  # facts, if each set of them is tried


@dataclass(frozen=True)
class ReasonMember:
    """A member of a reason, with the plan that there would be without it.

    Attributes:
        fact: The fact.
        without: The plan that there would be without it, if of the others only those of the reason
            were so. None if there was no time to look.
    """

    fact: Fact
    without: Optional[Possible]


@dataclass(frozen=True)
class MinimalReason:
    """A minimal set of facts that together prevent a plan: each of them is needed for that.

    Attributes:
        members: These facts. None: there is no plan without all that was told, either.
        given: The given facts: actions done before, and their preconditions.
        enabling: The facts that are taken as given because without them, there is no plan either.
        is_absolute: Whether only goals are members, and there is no plan for them with any set of
            facts of those that were told.
        rules: The constraints that prevent a plan, if only goals are members. If they have names:
            as few as possible without which there is a plan. Else: those that prevent it together,
            whatever becomes of the others.
        relaxed: The plan without them; None if they have no names.
        is_examined: Whether there was time to look for these rules. If not, they may be more than
            need be if they have names, and else prevent a plan up to a step.
        examined_up_to: That step.
        is_smallest: Whether no smaller set is a reason, as far as facts only ever prevent plans.
        is_complete: Whether there was time to look whether each member is needed.
        obstacles: If only goals are members: sentences that say what cannot be reached.
        doubts: Sentences about what may be wrong with the encoding, if nothing is certain.
    """

    members: Tuple[ReasonMember, ...]
    given: Tuple[Fact, ...] = ()
    is_smallest: bool = False
    is_complete: bool = True
    enabling: Tuple[Fact, ...] = ()
    is_absolute: bool = False
    rules: Tuple[Fact, ...] = ()
    relaxed: Optional[Possible] = None
    is_examined: bool = True
    examined_up_to: Optional[int] = None
    obstacles: Tuple[str, ...] = ()
    doubts: Tuple[str, ...] = ()

    @property
    def is_finished(self) -> bool:
        """True if the search was complete."""
        return self.is_complete and self.is_examined

    @property
    def has_only_goals(self) -> bool:
        """True if goals are the only members."""
        return all(member.fact.kind is FactKind.REQUEST for member in self.members)

    @property
    def facts(self) -> FrozenSet[Fact]:
        """The members' facts and those that are given."""
        members = (member.fact for member in self.members)
        return frozenset((*members, *self.given, *self.enabling))


class ReasonSearch:
    """Searches for one reason."""

    def __init__(
        self,
        ask: Ask,
        facts: Facts,
        deadline: Deadline,
        wrong: CopyAnswer = CopyAnswer.NONE,
        ask_any: AskAny = lambda facts, others: None,
    ) -> None:
        """Prepares a search.

        Args:
            ask: Says whether there is a plan with some facts alone.
            facts: All facts; with all of them the answer is the wrong one.
            deadline: When to end. The first sets that are found are larger than need be.
            wrong: The answer to be explained.
            ask_any: Says whether there is a plan with some facts, and any of some others; None if
                that is not known, so that each set has to be tried.
        """
        self._ask = ask
        self._ask_any = ask_any
        self._facts = facts
        self._deadline = deadline
        self._wrong = wrong
        self._given: FrozenSet[Fact] = frozenset()
        self._known: Dict[FrozenSet[Fact], Verdict] = {}
        self._best: FrozenSet[Fact] = facts.all()  # with which the answer is still the wrong one

    def run(self) -> MinimalReason:
        """Returns a reason, which is incomplete if the time was over."""
        enabling: FrozenSet[Fact] = frozenset()
        is_absolute = False
        try:
            candidates = frozenset(self._leave_history_out())
            members = self._reduce(candidates, self._given)
            members = self._check(members)
            while True:
                found, is_absolute = self._find_enabling(members)
                if not found:
                    break
                enabling |= found
                candidates = self._with_enabling(found)
                members = self._check(self._reduce(candidates, self._given))
        except InterruptedQuestionError:
            rest = sorted(self._best - self._given, key=_order)
            done = tuple(sorted(self._given, key=_order))
            return MinimalReason(
                tuple(ReasonMember(f, None) for f in rest), done, is_complete=False
            )
        smallest = len(members) <= 1
        if not smallest:
            members, smallest = self._smaller(members, candidates)
        named, given = [], set(self._given - enabling)
        for fact in sorted(members, key=_order):
            without = self._verdict(members - {fact})
            # What was done may rest on a fact, so that it cannot be left out.
            if without.answer is CopyAnswer.CONTRADICTION:
                given.add(fact)
            else:
                named.append(ReasonMember(fact, without.plan))
        return MinimalReason(
            tuple(named),
            tuple(sorted(given, key=_order)),
            smallest,
            enabling=tuple(sorted(enabling, key=_order)),
            is_absolute=is_absolute,
        )

    def _verdict(self, facts: FrozenSet[Fact]) -> Verdict:
        """Returns the copy's verdict on some facts and those that are given; cached."""
        facts |= self._given
        if facts not in self._known:
            self._known[facts] = self._ask(facts)
        return self._known[facts]

    def _is_wrong(self, facts: Iterable[Fact]) -> bool:
        """Returns whether some facts, with the given ones, suffice for the explained answer."""
        facts = frozenset(facts) | self._given
        wrong = self._verdict(facts).answer is self._wrong
        if wrong and len(facts) < len(self._best):
            self._best = facts
        return wrong

    def _leave_history_out(self) -> Set[Fact]:
        """Leaves out as much of the history as possible, from its end on.

        Returns:
            The facts that are left, but those that are given from now on.
        """
        free = self._shrink(set(self._facts.free))
        failures = {fact for fact in free if fact.kind is FactKind.FAILURE}
        history = list(self._facts.history)
        if self._is_wrong(free - failures):
            return free - failures
        if not history:
            return free
        # A failure goes with what was done before it.
        kept = self._reduce(failures, frozenset(free - failures) | frozenset(history))
        free = (free - failures) | kept
        if any(fact.kind is not FactKind.ACTION for fact in history):
            # Without what has ended a goal, it would be open, and prevent plans itself.
            self._given = frozenset(history)
            return free
        floor = max((fact.step for fact in kept), default=0)
        low, high = sum(fact.step < floor for fact in history), len(history)
        if self._is_wrong([*free, *history[:low]]):
            high = low
        while high - low > 1:
            middle = (low + high) // 2
            if self._is_wrong([*free, *history[:middle]]):
                high = middle
            else:
                low = middle
        self._given = frozenset(history[:low])
        return free.union(history[low:high])

    def _shrink(self, facts: Set[Fact]) -> Set[Fact]:
        """Reduces facts to unsatisfiable cores, as long as these do not need the history."""
        core = self._verdict(self._facts.all()).core
        while core is not None:
            left = {fact for fact in self._facts.free if core.intersection(fact.atoms)}
            needs_history = core & atoms(self._facts.history)
            if needs_history or len(left) >= len(facts) or not self._is_wrong(left):
                break
            facts, core = left, self._verdict(frozenset(left)).core
        return facts

    def _reduce(self, facts: Iterable[Fact], background: FrozenSet[Fact]) -> FrozenSet[Fact]:
        """Leaves out facts, by bisection, as long as the answer to be explained stays.

        Returns:
            Those that are left.
        """
        ordered = sorted(facts, key=_order)
        kept = set(ordered)

        def leave_out(some: Sequence[Fact], may_all: bool = True) -> bool:
            """Returns whether all of them were left out."""
            if may_all and self._is_wrong(kept.difference(some) | background):
                kept.difference_update(some)
                return True
            if len(some) > 1:
                half = len(some) // 2
                # If all of the first half can go, then not all of the second one.
                leave_out(some[half:], not leave_out(some[:half]))
            return False

        for kinds in _TOGETHER:
            some = [fact for fact in ordered if fact.kind in kinds]
            if some:
                leave_out(some)
        return frozenset(kept)

    def _check(self, members: FrozenSet[Fact]) -> FrozenSet[Fact]:
        """Makes a set minimal, fact by fact: an omitted fact may make another one superfluous."""
        while True:
            for fact in sorted(members, key=_order):
                if self._is_wrong(members - {fact}):
                    members -= {fact}
                    break
            else:
                return members

    def _find_enabling(self, members: FrozenSet[Fact]) -> Tuple[FrozenSet[Fact], bool]:
        """Searches for enabling facts, with which there is a plan in spite of a reason.

        Args:
            members: The members of the reason.

        Returns:
            As few facts as possible; none if none are found. And whether only goals are members,
            and there is no plan for them with any facts.
        """
        known = self._given | members
        pool = frozenset(self._facts.free) - known
        only_goals = all(fact.kind is FactKind.REQUEST for fact in members)
        can = self._ask_any(known, pool)
        if can is None and only_goals:
            return self._try_enabling(members, sorted(pool, key=_order))
        if not can:
            return frozenset(), can is False and only_goals
        chosen, rest = known, pool

        def leave_out(some: Sequence[Fact]) -> None:
            nonlocal chosen, rest
            if self._ask_any(chosen, rest.difference(some)):
                rest = rest.difference(some)
            elif len(some) > 1:
                leave_out(some[: len(some) // 2])
                leave_out(some[len(some) // 2 :])
            else:
                rest, chosen = rest.difference(some), chosen.union(some)

        leave_out(sorted(pool, key=_order))
        return (frozenset() if self._is_wrong(chosen) else chosen - known), False

    def _try_enabling(
        self, goals: FrozenSet[Fact], pool: Sequence[Fact]
    ) -> Tuple[FrozenSet[Fact], bool]:
        """Searches for enabling facts by trying small sets in turn, for a reason of goals alone."""
        numbers = range(1, _MOST_ENABLING + 1)
        with contextlib.suppress(InterruptedQuestionError), self._deadline.share(_ENABLING):
            for some in chain.from_iterable(combinations(pool, number) for number in numbers):
                if self._deadline.is_over():
                    return frozenset(), False
                if not self._is_wrong(goals.union(some)):
                    return frozenset(some), False
            return frozenset(), len(pool) <= _MOST_ENABLING
        return frozenset(), False

    def _with_enabling(self, enabling: FrozenSet[Fact]) -> FrozenSet[Fact]:
        """Takes enabling facts as given, and returns the candidates for another reason."""
        self._given |= enabling
        candidates = frozenset(self._facts.free) - self._given
        if not self._is_wrong(candidates):
            self._given |= frozenset(self._facts.history)
        return candidates

    def _smaller(
        self, members: FrozenSet[Fact], candidates: FrozenSet[Fact]
    ) -> Tuple[FrozenSet[Fact], bool]:
        """Searches for a smaller reason by minimum hitting sets, as long as there is time.

        A reason has one fact at least of each set without which there is a plan. The smallest sets
        that have are tried, the others give further such sets.

        Args:
            members: A reason.
            candidates: The facts that it was found among.

        Returns:
            The members, and whether there are no fewer.
        """
        with contextlib.suppress(InterruptedQuestionError), self._deadline.share(_BUDGET):
            pool = (frozenset(self._facts.free) - self._given) | members
            if not self._is_wrong(pool):  # such as failures without what was done before
                pool = candidates | members
            if not self._is_wrong(pool):
                return members, False
            must_hit = [pool - (members - {fact}) for fact in members]
            while not self._deadline.is_over():
                hitting = _hit(must_hit)
                if len(hitting) >= len(members):
                    return members, True
                if self._is_wrong(hitting):
                    return self._check(hitting), True
                must_hit.append(pool - self._grow(hitting, pool))
        return members, False

    def _grow(self, facts: FrozenSet[Fact], pool: FrozenSet[Fact]) -> FrozenSet[Fact]:
        """Grows a set of facts to a maximal one with which there is a plan."""
        grown = set(facts)

        def add(some: Sequence[Fact]) -> None:
            if not self._is_wrong(grown.union(some)):
                grown.update(some)
            elif len(some) > 1:
                half = len(some) // 2
                add(some[:half])
                add(some[half:])

        rest = sorted(pool - facts, key=_order)
        if rest:
            add(rest)
        return frozenset(grown)


def _order(fact: Fact) -> Tuple[int, int, str]:
    return (list(FactKind).index(fact.kind), fact.step, str(fact))


def _hit(sets: Sequence[FrozenSet[Fact]]) -> FrozenSet[Fact]:
    """Returns a minimum hitting set: as few facts as possible of which each set has one."""
    facts: List[Fact] = sorted(frozenset().union(*sets), key=_order)
    numbers = {fact: number for number, fact in enumerate(facts)}
    control = clingo.Control(["--opt-mode=opt"])
    rules = "".join(
        f"1 {{ {';'.join(f'hit({numbers[fact]})' for fact in sorted(s, key=_order))} }}."
        for s in sets
    )
    control.add("base", [], f"{rules} #minimize {{ 1,N : hit(N) }}. #show hit/1.")
    control.ground([("base", [])])
    best: List[int] = []
    with control.solve(yield_=True) as handle:
        for model in handle:
            best = [symbol.arguments[0].number for symbol in model.symbols(shown=True)]
    return frozenset(facts[number] for number in best)
