"""Random PDDL tasks with numbers, alternatives and quantifiers: about half have a plan.

Each task has two or three objects, numbers of which some are small at first, and actions that
compare and change them: several times in one action, or with the same object for two variables. In
some tasks actions last, and conditions and changes have moments.

The goal is drawn last, when the states are known that can be reached: it holds in one that is far,
or in none, though each of its parts holds in some.
"""

from __future__ import annotations

import random
from typing import Dict, List, Optional, Sequence, Tuple

from numeric_judge import States, first_in, functions_compared, reachable

LIMITS = {"fuel": 5, "load": 4, "count": 4}
"""How large numbers may get, for those that nothing else bounds."""

_LEAST_STATES, _MOST_STATES = 12, 40_000
_FLAGS = ("idle", "done")  # predicates without objects
_DRAWS = 60  # of goals in a world
_CHOICES = 16  # of goals with a plan, of which the farthest one is taken


class NumericTask:
    """A random task.

    Attributes:
        domain: The text of its domain.
        problem: The text of its problem.
        lasts: How long each action lasts; None if none does.
        plan: A shortest plan in PDDL's words, in which numbers keep to the limits; None if the
            judge knows none.
        is_known: Whether there is none if the judge knows none.
    """

    def __init__(self, seed: int) -> None:
        """Draws a task."""
        self._dice = random.Random(f"numeric {seed}")
        self._has_plan = seed % 2 == 0
        goal = ""
        while not goal:
            states = self._draw_world()
            if len(states.plans) >= _LEAST_STATES:  # else next to nothing can be done
                goal = self._draw_goal(states)
        self.problem = self._problem(goal)
        read = functions_compared([self.domain, goal])
        limits = {name: limit for name, limit in LIMITS.items() if name in read}
        states = reachable(self.domain, self.problem, limits, _MOST_STATES)
        self.plan = first_in(states, goal)
        self.is_known = self.plan is not None or states.is_all

    def _draw_world(self) -> States:
        dice = self._dice
        self._objects = [f"o{number}" for number in range(dice.choice([2, 2, 3]))]
        self.lasts: Optional[int] = dice.randint(1, 4) if dice.random() < 0.25 else None
        self._made: List[str] = []  # the predicates that some action changes
        actions = [self._action(f"act{number}") for number in range(dice.randint(3, 5))]
        self.domain = "\n".join(
            ["(define (domain random-numbers)",
             "(:requirements :adl :numeric-fluents :durative-actions)",
             "(:types thing)",
             "(:predicates (on ?x - thing) (near ?x - thing) (red ?x - thing) (idle) (done))",
             "(:functions (fuel ?x - thing) (load ?x - thing) (weight ?x - thing) (count))",
             *actions, ")"]
        )  # fmt: skip
        atoms = [f"({n} {o})" for n in ("on", "near", "red") for o in self._objects]
        self._init = [atom for atom in [*atoms, "(idle)"] if dice.random() < 0.4]
        for name in ("fuel", "load", "weight"):
            self._init += [f"(= ({name} {each}) {dice.randint(0, 3)})" for each in self._objects]
        self._init.append(f"(= (count) {dice.randint(0, 2)})")
        return reachable(self.domain, self._problem("(and)"), LIMITS, _MOST_STATES // 4)

    def _problem(self, goal: str) -> str:
        return (
            f"(define (problem p) (:domain random-numbers)\n(:objects {' '.join(self._objects)} - "
            f"thing)\n(:init {' '.join(self._init)})\n(:goal {goal}))\n"
        )

    # The goal.

    def _draw_goal(self, states: States) -> str:
        """Returns a goal with the longest plan of those drawn, or one without; empty if none is."""
        dice = self._dice
        found: List[Tuple[int, str]] = []
        for _ in range(_DRAWS):
            parts: Dict[str, str] = {}
            for _ in range(dice.randint(1, 3)):
                subject, wish = self._wish()
                parts.setdefault(subject, wish)
            if not all(any(map(states.holds(wish), states.plans)) for wish in parts.values()):
                continue
            goal = f"(and {' '.join(parts.values())})"
            plan = first_in(states, goal)
            if plan is None and not self._has_plan and states.is_all:
                return goal
            if plan and self._has_plan:
                found.append((len(plan), goal))
                if len(found) == _CHOICES:
                    break
        return max(found, default=(0, ""))[1]

    def _wish(self) -> Tuple[str, str]:
        """Returns a part of a goal, after what it is about."""
        kind = self._dice.random()
        if kind < 0.08:
            return "all", f"(forall (?e - thing) (imply (red ?e) {self._literal(['?e'])}))"
        if kind < 0.7:
            number = self._number(self._objects)
            wish = self._comparison(number, self._objects)
            is_exact = wish.startswith("(not (=")  # which has alternatives
            return number, wish[len("(not ") : -1] if is_exact else wish
        atom = self._atom(self._objects, sorted({*self._made, "on"}))
        return atom, self._negated(atom)

    # Actions.

    def _number(self, variables: Sequence[str]) -> str:
        name = self._dice.choice(["fuel", "load", "fuel", "load", "count"])
        return "(count)" if name == "count" else f"({name} {self._dice.choice(variables)})"

    def _atom(self, variables: Sequence[str], names: Sequence[str]) -> str:
        name = self._dice.choice(names)
        return f"({name})" if name in _FLAGS else f"({name} {self._dice.choice(variables)})"

    def _negated(self, atom: str) -> str:
        return f"(not {atom})" if self._dice.random() < 0.3 else atom

    def _literal(self, variables: Sequence[str]) -> str:
        return self._negated(self._atom(variables, ["on", "near", "red", *_FLAGS]))

    def _comparison(self, number: str, variables: Sequence[str]) -> str:
        dice = self._dice
        amount = str(dice.randint(0, 4))
        if dice.random() < 0.3:
            amount = f"(weight {dice.choice(variables)})"
        head = dice.choice([">=", ">=", ">", "<=", "<=", "<", "="])
        if dice.random() < 0.1:
            return f"(not ({head} {number} {amount}))"
        ends = (number, amount) if dice.random() < 0.8 else (amount, number)
        return f"({head} {' '.join(ends)})"

    def _simple(self, variables: Sequence[str]) -> str:
        if self._dice.random() < 0.5:
            return self._comparison(self._number(variables), variables)
        return self._literal(variables)

    def _condition(self, variables: Sequence[str]) -> str:
        kind = self._dice.random()
        if kind < 0.1:
            return f"(or {self._simple(variables)} {self._simple(variables)})"
        if kind < 0.15:
            return f"(exists (?e - thing) (and {self._simple(['?e'])} {self._literal(['?e'])}))"
        if kind < 0.2:
            return f"(forall (?e - thing) (imply {self._literal(['?e'])} {self._simple(['?e'])}))"
        if kind < 0.28:
            return f"(not (and {self._simple(variables)} {self._simple(variables)}))"
        return self._simple(variables)

    def _changes(self, variables: Sequence[str]) -> Tuple[Dict[str, List[str]], List[str]]:
        """Returns the changes of each number, and conditions that make most of them possible."""
        dice = self._dice
        changes: Dict[str, List[str]] = {}
        needed: List[str] = []
        for number in [self._number(variables) for _ in range(dice.randint(1, 2))]:
            is_first = not any(each.split()[0] == number.split()[0] for each in changes)
            for _ in range(dice.choice([1, 1, 2])):
                amount = str(dice.randint(1, 3))
                if dice.random() < 0.2:
                    amount = f"(weight {dice.choice(variables)})"
                head = dice.choice(["increase", "increase", "decrease", "decrease", "assign"])
                # An assignment has to be the only change of its number, whatever ?x and ?y are.
                if head == "assign" and not (is_first and number not in changes):
                    head = "increase"
                if any("assign" in each and each.split()[1] == number.split()[0]
                       for some in changes.values() for each in some):  # fmt: skip
                    continue
                changes.setdefault(number, []).append(f"({head} {number} {amount})")
                if head == "increase" and dice.random() < 0.7:
                    needed.append(f"(<= {number} {dice.randint(1, 4)})")
                elif head == "decrease" and dice.random() < 0.7:
                    needed.append(f"(>= {number} {amount})")
            if dice.random() < 0.3:
                needed.append(self._comparison(number, variables))
        return changes, needed

    def _facts(self, variables: Sequence[str]) -> List[str]:
        """Returns effects on facts, of which some have conditions."""
        dice = self._dice
        found: List[str] = []
        for fact in dice.sample(["on", "near", "idle", "done"], dice.randint(0, 2)):
            self._made.append(fact)
            kind = dice.random()
            if kind < 0.1 and fact not in _FLAGS:
                inner = self._negated(f"({fact} ?e)")
                found.append(f"(forall (?e - thing) (when {self._literal(['?e'])} {inner}))")
            elif kind < 0.2:
                inner = self._negated(self._atom(variables, [fact]))
                found.append(f"(when {self._literal(variables)} {inner})")
            else:
                found.append(self._negated(self._atom(variables, [fact])))
        return found

    def _action(self, name: str) -> str:
        dice = self._dice
        variables = ["?x", "?y"][: dice.randint(1, 2)]
        needed = [self._condition(variables) for _ in range(dice.randint(0, 2))]
        changes, more = self._changes(variables)
        needed += more
        facts = self._facts(variables)
        parameters = " ".join(f"{variable} - thing" for variable in variables)
        effects = [each for some in changes.values() for each in some]
        if self.lasts is None:
            parts = [*effects, *facts]
            dice.shuffle(needed)
            dice.shuffle(parts)
            return (f"(:action {name} :parameters ({parameters})\n  :precondition (and "
                    f"{' '.join(needed)})\n  :effect (and {' '.join(parts)}))")  # fmt: skip
        # All changes of a function have one moment: ?x and ?y may be the same object.
        moments = {key.split()[0]: dice.choice(("start", "end")) for key in changes}
        timed = [f"(at {moments[key.split()[0]]} {each})" for key in changes
                 for each in changes[key]]  # fmt: skip
        timed += [f"(at end {each})" for each in facts]
        conditions = [f"({dice.choice(('at start', 'at start', 'over all', 'at end'))} {each})"
                      for each in needed]  # fmt: skip
        dice.shuffle(conditions)
        dice.shuffle(timed)
        return (f"(:durative-action {name} :parameters ({parameters})\n  :duration (= ?duration "
                f"{self.lasts})\n  :condition (and {' '.join(conditions)})\n  :effect (and "
                f"{' '.join(timed)}))")  # fmt: skip
