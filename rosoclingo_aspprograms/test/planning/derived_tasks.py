"""Random planning tasks with derived predicates, and a search of all their states."""

from __future__ import annotations

import contextlib
import itertools
import random
from collections import deque
from pathlib import Path
from typing import Deque, Dict, FrozenSet, List, Optional, Sequence, Tuple

from plan_validator import PlanValidator, read_validator, typed_list_of
from rosoclingo.tools.pddl.expressions import PddlError

_MOST_STATES = 1500
_BASE = {"p": 1, "q": 1, "e": 2, "z": 0}
_DERIVED = {"d0": 1, "d1": 2, "d2": 1, "d3": 0}
_OBJECTS = ("a", "b", "c")


class DerivedTask:
    """A task with predicates derived from others, stratum by stratum, in circles and by denials.

    Attributes:
        files: The domain and the problem.
    """

    def __init__(self, seed: int, folder: Path) -> None:
        self._draw = random.Random(seed)
        self._stratum = {name: self._draw.choice([0, 1, 1, 2]) for name in _DERIVED}
        kinds = (*_BASE.items(), *_DERIVED.items())
        declared = " ".join(
            f"({' '.join([n, *(f'?x{i}' for i in range(arity))])})" for n, arity in kinds
        )
        rules = "\n".join(self._rule(name, arity) for name, arity in _DERIVED.items())
        actions = "\n".join(self._action(number) for number in range(self._draw.randint(3, 5)))
        domain = (
            "(define (domain random) (:requirements :adl :derived-predicates)\n"
            f"(:predicates {declared})\n{rules}\n{actions})\n"
        )
        facts = [
            f"({' '.join([name, *objects])})"
            for name, arity in _BASE.items()
            for objects in itertools.product(_OBJECTS, repeat=arity)
            if self._draw.random() < 0.35
        ]
        problem = (
            f"(define (problem p) (:domain random) (:objects {' '.join(_OBJECTS)})\n"
            f"(:init {' '.join(facts)})\n(:goal (and GOAL)))\n"
        )
        self.files = folder / "domain.pddl", folder / "problem.pddl"
        for file, text in zip(self.files, (domain, problem.replace("GOAL", ""))):
            file.write_text(text)
        self.files[1].write_text(problem.replace("GOAL", self._goal()))

    def _goal(self) -> str:
        """Draws a goal: mostly of facts that some actions change, else of anything."""
        draw = self._draw
        world = read_validator(*self.files)
        first = {*world.facts, *world.derived}
        steps = _steps(world)
        for _ in range(draw.randint(20, 200)):
            with contextlib.suppress(PddlError):
                world.execute(*draw.choice(steps))
        last = {*world.facts, *world.derived}
        changed = sorted(first ^ last)
        wanted = draw.sample(changed, min(len(changed), draw.randint(1, 3)))
        goal = [
            f"({' '.join(fact)})" if fact in last else f"(not ({' '.join(fact)}))"
            for fact in wanted
        ]
        if not goal or draw.random() < 0.2:
            goal.append(self._condition({}, 3, depth=2))
        elif draw.random() < 0.3:
            goal[0] = f"(or {goal[0]} {self._condition({}, 3, depth=1)})"
        return " ".join(goal)

    def _rule(self, name: str, arity: int) -> str:
        variables = [f"?x{number}" for number in range(arity)]
        body = self._condition(dict.fromkeys(variables, ""), self._stratum[name], depth=3)
        return f"(:derived ({' '.join([name, *variables])}) {body})"

    def _action(self, number: int) -> str:
        variables = [f"?y{place}" for place in range(self._draw.randint(0, 2))]
        scope = dict.fromkeys(variables, "")
        effects = []
        for _ in range(self._draw.randint(1, 3)):
            name = self._draw.choice([*_BASE])
            effect = self._atom(name, _BASE[name], scope)
            if self._draw.random() < 0.45:
                effect = f"(not {effect})"
            if self._draw.random() < 0.3:
                effect = f"(when {self._condition(scope, 3, depth=1)} {effect})"
            effects.append(effect)
        needed = self._condition(scope, 3, depth=2)
        return (
            f"(:action act{number} :parameters ({' '.join(variables)}) :precondition {needed} "
            f":effect (and {' '.join(effects)}))"
        )

    def _atom(self, name: str, arity: int, scope: Dict[str, str]) -> str:
        terms = [self._draw.choice([*scope, *scope, *_OBJECTS]) for _ in range(arity)]
        return f"({' '.join([name, *terms])})"

    def _condition(
        self, scope: Dict[str, str], stratum: int, depth: int, *, denied: bool = False
    ) -> str:
        """Draws a condition for a rule of a stratum: what it denies has a lower one."""
        draw = self._draw
        kind = draw.choice(["and", "or", "exists", "forall", "not", "imply", "atom", "atom"])
        if depth == 0 or kind == "atom":
            names = [n for n in _DERIVED if self._stratum[n] < stratum + (not denied)]
            known = {**_BASE, **{name: _DERIVED[name] for name in names}}
            name = draw.choice([*known, *names, *names])
            return self._atom(name, known[name], scope)
        if kind == "not":
            return f"(not {self._condition(scope, stratum, depth - 1, denied=not denied)})"
        if kind == "imply":
            first = self._condition(scope, stratum, depth - 1, denied=not denied)
            return f"(imply {first} {self._condition(scope, stratum, depth - 1, denied=denied)})"
        if kind in ("exists", "forall"):
            variable = f"?v{len(scope)}"
            inner = self._condition({**scope, variable: ""}, stratum, depth - 1, denied=denied)
            return f"({kind} ({variable}) {inner})"
        parts = (self._condition(scope, stratum, depth - 1, denied=denied) for _ in range(2))
        return f"({kind} {' '.join(parts)})"


def shortest_plan(domain: Path, problem: Path) -> Tuple[Optional[int], bool]:
    """Returns the length of a shortest plan, None without one; and whether all states were seen."""
    try:
        world = read_validator(domain, problem)
    except PddlError:  # the goal needs what never changes
        return None, True
    steps = _steps(world)
    start = frozenset(world.facts)
    known = {start}
    waiting: Deque[Tuple[FrozenSet[Tuple[str, ...]], int]] = deque([(start, 0)])
    while waiting:
        facts, length = waiting.popleft()
        world.facts = set(facts)
        if _succeeds(world):
            return length, True
        for name, objects in steps:
            world.facts = set(facts)
            try:
                world.execute(name, objects)
            except PddlError:
                continue
            following = frozenset(world.facts)
            if following not in known:
                if len(known) >= _MOST_STATES:
                    return None, False
                known.add(following)
                waiting.append((following, length + 1))
    return None, True


def _succeeds(world: PlanValidator) -> bool:
    try:
        world.require_goal()
    except PddlError:
        return False
    return True


def _steps(world: PlanValidator) -> List[Tuple[str, Sequence[str]]]:
    return [
        (name, objects)
        for name, action in world.actions.items()
        for objects in itertools.product(world.kinds, repeat=len(typed_list_of(action)))
    ]
