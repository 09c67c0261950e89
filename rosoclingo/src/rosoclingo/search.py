"""One search for a plan, and what follows from how it ends."""

from __future__ import annotations

from typing import Sequence, Set

from rosclingo.commands import Add, Ground, Part
from rosclingo.engine import Outcome, Result
from rosoclingo import diagnosis
from rosoclingo.atoms import Plan
from rosoclingo.errors import PlannerError
from rosoclingo.state import State

_FIRST_DOUBT = 8  # searches without a plan, after which the program itself is looked at
_MOST_QUESTIONS = 5  # about what the encoding hides

HAS = "rosoclingo_has"
"""A term that is shown with an answer set in which there is an atom, be it shown or not."""

_SEEN = {"do": 3, "status": 3}  # what rosoclingo has to see, with the number of arguments


class Search:
    """Searches of one planner, from when it is initialised. One thread makes the calls."""

    def __init__(self, state: State) -> None:
        self._state = state
        self._failures = 0  # searches in a row that found that there is no plan
        self._shown: Set[str] = set()  # of what has to be seen
        self._asked: Set[int] = set()  # the numbers of steps that were grounded

    def run(self) -> None:
        """Searches once; what comes from outside ends the search.

        Raises:
            PlannerError: The encoding hides what rosoclingo has to see.
            LoopError: The program has no answer set, whatever is asked for.
        """
        state = self._state
        state.release_now()
        state.begin_planning()
        outcome = state.planner.solve(state.interrupted)
        if outcome.result is Result.SAT:
            outcome = self._look(outcome)
        state.result = outcome.result
        if outcome.result is Result.SAT:
            self._failures = 0
            state.found(Plan(outcome.symbols))
        elif outcome.result is Result.UNSAT:
            self._failures += 1
            # Twice as rarely each time, so that it takes no time where the plan is a long one.
            doubt = self._failures >= _FIRST_DOUBT and not self._failures & (self._failures - 1)
            if doubt and diagnosis.mend_contradiction(state):
                state.result = None  # search again

    def _look(self, outcome: Outcome) -> Outcome:
        """Looks whether the encoding hides actions or statuses by ``#show``.

        Without them a goal would succeed though nothing is done, or would never end. That they are
        true is known by a term that is shown with them. It is asked for only as long as no plan has
        shown any, and when there are further steps; then one search more is made.

        Returns:
            The same, or how that search has ended.

        Raises:
            PlannerError: Something is hidden.
        """
        state = self._state
        self._check(outcome.symbols)
        steps = len(state.grounded)
        is_asked_for = bool(state.goals.open) or not state.mail.dynamic
        is_known = len(self._shown) == len(_SEEN) or steps in self._asked
        if is_known or not is_asked_for or len(self._asked) >= _MOST_QUESTIONS:
            return outcome
        self._asked.add(steps)
        shows = (
            f"#defined {name}/{arity}. #show {HAS}({name}) : {name}({','.join('_' * arity)})."
            for name, arity in _SEEN.items()
            if name not in self._shown
        )
        part = f"{HAS}_{steps}"
        state.planner.run(Add(part, (), " ".join(shows)), Ground((Part(part),)))
        outcome = state.planner.solve(state.interrupted)
        self._check(outcome.symbols)
        return outcome

    def _check(self, symbols: Sequence[str]) -> None:
        for name, arity in _SEEN.items():
            if name in self._shown:
                continue
            if any(symbol.startswith(f"{name}(") for symbol in symbols):
                self._shown.add(name)
            elif f"{HAS}({name})" in symbols:
                raise PlannerError(
                    f"the planner's encoding hides {name}/{arity}, so that rosoclingo does not see "
                    f"what it plans; add #show {name}/{arity}."
                )
