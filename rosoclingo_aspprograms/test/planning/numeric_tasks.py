"""Random planning tasks with numbers, alternatives and quantifiers, and a breadth-first search.

Each task has two or three objects, numbers of which some are small at first, and actions that
compare and change them: several times in one action, or with the same object for two variables.
"""

from __future__ import annotations

import itertools
import random
from collections import deque
from typing import Deque, Dict, FrozenSet, List, Mapping, Optional, Sequence, Tuple

from plan_validator import PlanValidator, typed_list_of
from rosoclingo.pddl.expressions import PddlError

LIMITS = {"fuel": 5, "load": 4, "count": 4}
"""How large numbers may get, for those that nothing else bounds."""

_STATES = 500  # after which the search gives up

_Facts = FrozenSet[Tuple[str, ...]]
_Numbers = Tuple[Tuple[Tuple[str, ...], float], ...]


class NumericTask:
    """A random task.

    Attributes:
        domain: The text of its domain.
        problem: The text of its problem.
    """

    def __init__(self, seed: int) -> None:
        """Draws a task."""
        self._dice = random.Random(f"numeric {seed}")
        self._objects = [f"o{number}" for number in range(self._dice.randint(2, 3))]
        self._made: List[str] = []  # the predicates that some action makes true
        actions = [self._action(f"act{number}") for number in range(self._dice.randint(3, 5))]
        self.domain = "\n".join(
            ["(define (domain random-numbers)", "(:requirements :adl :numeric-fluents)",
             "(:types thing)",
             "(:predicates (on ?x - thing) (near ?x - thing) (red ?x - thing) (idle) (done))",
             "(:functions (fuel ?x - thing) (load ?x - thing) (weight ?x - thing) (count))",
             *actions, ")"]
        )  # fmt: skip
        self.problem = self._problem()

    def _number(self, variables: Sequence[str]) -> str:
        name = self._dice.choice(["fuel", "load", "fuel", "load", "count"])
        return "(count)" if name == "count" else f"({name} {self._dice.choice(variables)})"

    def _atom(self, variables: Sequence[str], names: Sequence[str]) -> str:
        name = self._dice.choice(names)
        return (
            f"({name})"
            if name in ("idle", "done")
            else (f"({name} {self._dice.choice(variables)})")
        )

    def _literal(self, variables: Sequence[str]) -> str:
        atom = self._atom(variables, ["on", "near", "red", "idle", "done"])
        return f"(not {atom})" if self._dice.random() < 0.3 else atom

    def _comparison(self, number: str, variables: Sequence[str]) -> str:
        dice = self._dice
        amount = str(dice.randint(0, 4))
        if dice.random() < 0.3:
            amount = f"(weight {dice.choice(variables)})"
        head = dice.choice([">=", ">=", ">", "<=", "<=", "<", "="])
        if dice.random() < 0.1:
            return f"(not ({head} {number} {amount}))"
        return (
            f"({head} {number} {amount})"
            if dice.random() < 0.8
            else (f"({head} {amount} {number})")
        )

    def _simple(self, variables: Sequence[str]) -> str:
        if self._dice.random() < 0.5:
            return self._comparison(self._number(variables), variables)
        return self._literal(variables)

    def _condition(self, variables: Sequence[str]) -> str:
        dice, kind = self._dice, self._dice.random()
        if kind < 0.1:
            return f"(or {self._simple(variables)} {self._simple(variables)})"
        if kind < 0.15:
            return f"(exists (?e - thing) (and {self._simple(['?e'])} {self._literal(['?e'])}))"
        if kind < 0.2:
            return f"(forall (?e - thing) (imply {self._literal(['?e'])} {self._simple(['?e'])}))"
        return (
            self._simple(variables)
            if dice.random() < 0.9
            else (f"(not (and {self._simple(variables)} {self._simple(variables)}))")
        )

    def _action(self, name: str) -> str:
        dice = self._dice
        variables = ["?x", "?y"][: dice.randint(1, 2)]
        needed = [self._condition(variables) for _ in range(dice.randint(0, 2))]
        changes: List[str] = []
        numbers = [self._number(variables) for _ in range(dice.randint(1, 2))]
        for number in numbers:
            for _ in range(dice.choice([1, 1, 2])):
                amount = str(dice.randint(1, 3))
                if dice.random() < 0.2:
                    amount = f"(weight {dice.choice(variables)})"
                head = dice.choice(["increase", "increase", "decrease", "decrease", "assign"])
                if head == "assign" and any(number in change for change in changes):
                    head = "increase"
                if any("assign" in change and number in change for change in changes):
                    continue
                changes.append(f"({head} {number} {amount})")
                if head == "increase" and dice.random() < 0.7:
                    needed.append(f"(<= {number} {dice.randint(1, 4)})")
                elif head == "decrease" and dice.random() < 0.7:
                    needed.append(f"(>= {number} {amount})")
            if dice.random() < 0.3:
                needed.append(self._comparison(number, variables))
        facts = dice.sample(["on", "near", "idle", "done"], dice.randint(0, 2))
        for fact in facts:
            atom = self._atom(variables, [fact])
            if dice.random() < 0.3:
                changes.append(f"(not {atom})")
            else:
                changes.append(atom)
                self._made.append(fact)
        parameters = " ".join(f"{variable} - thing" for variable in variables)
        dice.shuffle(needed)
        dice.shuffle(changes)
        return (f"(:action {name} :parameters ({parameters})\n  :precondition (and "
                f"{' '.join(needed)})\n  :effect (and {' '.join(changes)}))")  # fmt: skip

    def _problem(self) -> str:
        dice = self._dice
        atoms = [f"({n} {o})" for n in ("on", "near", "red") for o in self._objects]
        init = [atom for atom in [*atoms, "(idle)"] if dice.random() < 0.4]
        for name in ("fuel", "load", "weight"):
            init += [f"(= ({name} {each}) {dice.randint(0, 3)})" for each in self._objects]
        init.append(f"(= (count) {dice.randint(0, 2)})")
        goal = [self._comparison(self._number(self._objects), self._objects)
                for _ in range(dice.randint(0, 2))]  # fmt: skip
        named = sorted({*self._made, "red"})
        goal += [
            atom
            for atom in (self._atom(self._objects, named) for _ in range(dice.randint(0, 2)))
            if "red" not in atom or atom in init
        ]
        goal += [] if goal else ["(>= (count) 4)"]
        if dice.random() < 0.15:
            goal.append(f"(forall (?e - thing) (imply (red ?e) {self._literal(['?e'])}))")
        return (
            f"(define (problem p) (:domain random-numbers)\n(:objects {' '.join(self._objects)} - "
            f"thing)\n(:init {' '.join(init)})\n(:goal (and {' '.join(goal)})))\n"
        )


def shortest_plan(
    validator: PlanValidator, largest: Mapping[Tuple[str, ...], int]
) -> Tuple[Optional[List[str]], bool]:
    """Returns a shortest plan in which no number gets below 0 or above its limit, if one is found.

    The second value tells whether all was looked at that is not further away.

    Args:
        validator: It stands where the problem begins.
        largest: The limits of numbers; others may have any value, which is not looked at.
    """
    steps = [
        (name, chosen)
        for name, action in validator.actions.items()
        for chosen in itertools.product(_things(validator), repeat=len(typed_list_of(action)))
    ]

    def state() -> Tuple[_Facts, _Numbers]:
        numbers = {n: v for n, v in validator.numbers.items() if n in largest}
        return frozenset(validator.facts), tuple(sorted(numbers.items()))

    first = validator.numbers
    plans: Dict[Tuple[_Facts, _Numbers], List[str]] = {state(): []}
    waiting: Deque[Tuple[_Facts, _Numbers]] = deque(plans)
    while waiting:
        facts, numbers = waiting.popleft()
        plan = plans[facts, numbers]
        validator.facts, validator.numbers = set(facts), {**first, **dict(numbers)}
        if _is_met(validator):
            return plan, True
        for name, objects in steps:
            validator.facts, validator.numbers = set(facts), {**first, **dict(numbers)}
            try:
                validator.execute(name, objects)
            except PddlError:
                continue
            then = state()
            if then in plans or any(not 0 <= v <= largest[n] for n, v in then[1]):
                continue
            if len(plans) > _STATES:
                return None, False
            plans[then] = [*plan, " ".join([name, *objects])]
            waiting.append(then)
    return None, True


def _things(validator: PlanValidator) -> List[str]:
    return [thing for thing, kind in validator.kinds.items() if kind == "thing"]


def _is_met(validator: PlanValidator) -> bool:
    try:
        validator.require_goal()
    except PddlError:
        return False
    return True
