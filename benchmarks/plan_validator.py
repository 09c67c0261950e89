"""Validates plans by PDDL's own semantics, without the translator and without an encoding.

An action with a duration is executed as if nothing else went on meanwhile: its beginning, what has
to hold all the time, and its end. Derived predicates are derived anew in each state, stratum by
stratum, until no rule says anything more.
"""

from __future__ import annotations

import functools
import operator
import re
from dataclasses import replace
from pathlib import Path
from typing import Callable, Dict, Iterable, Iterator, List, Mapping, Sequence, Set, Tuple

from rosoclingo.tools.pddl.domain import Domain, Problem
from rosoclingo.tools.pddl.expressions import ListForm, PddlError, read_file
from rosoclingo.tools.pddl.files import read_task
from rosoclingo.tools.pddl.names import Identifiers
from rosoclingo.tools.pddl.support import PddlPart

Fact = Tuple[str, ...]
"""A predicate or a function, and its objects."""

_Binding = Mapping[str, str]
_Types = Dict[str, Tuple[str, ...]]
"""Variables with their types, of which an object has one."""

_ALTERNATIVE = re.compile(r"-or-[0-9]+-*$")
_COMPARISONS: Dict[str, Callable[[float, float], bool]] = {
    "<": operator.lt, "<=": operator.le, ">=": operator.ge, ">": operator.gt, "=": operator.eq,
}  # fmt: skip
_ARITHMETIC: Dict[str, Callable[[float, float], float]] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv,
}  # fmt: skip


class PlanValidator:
    """Executes a plan.

    Attributes:
        facts: The facts that hold.
        numbers: The values of the numbers.
        names: Has the terms of all names.
        actions: The form of each action, by its name.
        kinds: The type of each object.
    """

    def __init__(self, domain: Domain, problem: Problem) -> None:
        """Begins where the problem does."""
        self._domain = domain
        self.names = Identifiers.of(domain.form, problem.form)
        self._goal = next(f for f in problem.form.forms() if f.head == ":goal").parts[1]
        self.kinds = {**domain.constants, **problem.objects}
        self.actions: Dict[str, ListForm] = {}
        for part in domain.form.parts:
            if isinstance(part, ListForm) and part.head in (":action", ":durative-action"):
                self.actions[part.parts[1].text] = part
        self._rules = [
            (_form(form.parts[1]), _form(form.parts[2])) for form in domain.form.lists(":derived")
        ]
        self._strata = _strata(self._rules)
        self._derived: Tuple[object, object, Set[Fact]] = (None, None, set())
        self.facts: Set[Fact] = {_ground(atom, {}) for atom in problem.init}
        self.numbers: Dict[Fact, float] = {
            tuple(text.strip("()").split()): value for text, value in problem.numbers.items()
        }

    def execute(self, name: str, objects: Sequence[str]) -> None:
        """Executes an action.

        Raises:
            PddlError: It is not possible; the message says why.
        """
        action = self.actions.get(name)
        step = " ".join([name, *objects])
        if action is None:
            raise PddlError(f"{step}: there is no action {name}")
        parts = {key.text: value for key, value in zip(action.parts[2::2], action.parts[3::2])}
        parameters = typed_list_of(action)
        if len(parameters) != len(objects):
            raise PddlError(f"{step}: {name} has {len(parameters)} objects")
        for each, kinds in zip(objects, parameters.values()):
            if not self._is_of(each, kinds):
                raise PddlError(f"{step}: {each} is no {' or '.join(kinds)}")
        binding = dict(zip(parameters, objects))
        effect = _form(parts.get(":effect"))
        if action.head == ":action":
            self._require(step, [_form(parts.get(":precondition"))], binding)
            self._change([effect], binding)
            return
        lasts = self._value(_form(parts.get(":duration")).parts[2], binding)
        binding["?duration"] = str(lasts)
        condition = _form(parts.get(":condition"))
        self._require(step, _at(condition, "at start"), binding)
        self._change(_at(effect, "at start"), binding)
        self._require(step, _at(condition, "over all"), binding)
        self._require(step, _at(condition, "at end"), binding)
        self._change(_at(effect, "at end"), binding)

    def execute_term(self, action: str) -> None:
        """Executes an action by its term in the encoding.

        Raises:
            PddlError: It is not possible; the message says why.
        """
        name, *objects = self.words(action).split()
        self.execute(name, objects)

    def words(self, action: str) -> str:
        """Returns an action in PDDL by its term, be it an alternative of one."""
        name, objects = self.names.words(action)
        if name not in self.actions:  # an alternative of an action
            name = _ALTERNATIVE.sub("", name)
        if name in self.actions:
            count = len(typed_list_of(self.actions[name]))
            objects = objects[:count]
        return " ".join([name, *objects])

    def require_goal(self) -> None:
        """Checks that the goal is reached.

        Raises:
            PddlError: It is not; the message says what is missing.
        """
        self._require("the goal", [_form(self._goal)], {})

    def _is_of(self, thing: str, kinds: Sequence[str]) -> bool:
        return thing in self.kinds and any(
            self._domain.is_kind_of(self.kinds[thing], kind) for kind in kinds
        )

    @property
    def derived(self) -> Set[Fact]:
        """The derived facts that hold."""
        facts, numbers, found = self._derived
        if facts is not self.facts or numbers != self.numbers:
            found = set()
            self._derived = self.facts, dict(self.numbers), found
            for stratum in sorted(set(self._strata.values())):
                while self._derive(stratum, found):
                    pass
        return found

    def _derive(self, stratum: int, found: Set[Fact]) -> bool:
        """Adds what rules of a stratum say; returns whether that is new."""
        new = {
            (head.head, *(binding[name] for name in names))
            for head, body in self._rules
            if self._strata[head.head] == stratum
            for names in [_typed(head.parts[1:])]
            for binding in self._bindings(names, {})
            if self._holds(body, binding)
        }
        is_new = not new <= found
        found |= new
        return is_new

    def _require(self, step: str, conditions: Sequence[ListForm], binding: _Binding) -> None:
        for condition in conditions:
            inner = condition.parts[1:] if condition.head == "and" else (condition,)
            for part in inner:
                if not self._holds(_form(part), binding):
                    raise PddlError(f"{step}: {part.text} does not hold")

    def _holds(self, form: ListForm, binding: _Binding) -> bool:
        if not form.parts:
            return True
        if form.head == "and":
            return all(self._holds(_form(part), binding) for part in form.parts[1:])
        if form.head == "not":
            return not self._holds(_form(form.parts[1]), binding)
        inner = [part for part in form.parts[1:] if isinstance(part, ListForm)]
        if form.head == "or":
            return any(self._holds(part, binding) for part in inner)
        if form.head == "imply":
            return not self._holds(inner[0], binding) or self._holds(inner[1], binding)
        if form.head in ("forall", "exists"):
            names = _typed(inner[0].parts)
            found = [self._holds(inner[1], each) for each in self._bindings(names, binding)]
            return all(found) if form.head == "forall" else any(found)
        if form.head == "=" and not any(isinstance(part, ListForm) for part in form.parts):
            left, right = _ground(form, binding)[1:]
            return left == right
        if form.head in _COMPARISONS:
            left_value, right_value = (self._value(part, binding) for part in form.parts[1:])
            return _COMPARISONS[form.head](left_value, right_value)
        fact = _ground(form, binding)
        return fact in (self.derived if form.head in self._strata else self.facts)

    def _value(self, part: PddlPart, binding: _Binding) -> float:
        if not isinstance(part, ListForm):
            return float(binding.get(part.text, part.text))
        if part.head in _ARITHMETIC:
            values = [self._value(each, binding) for each in part.parts[1:]]
            if part.head == "-" and len(values) == 1:
                return -values[0]
            return functools.reduce(_ARITHMETIC[part.head], values)
        return self.numbers[_ground(part, binding)]

    def _change(self, effects: Iterable[ListForm], binding: _Binding) -> None:
        added: Set[Fact] = set()
        deleted: Set[Fact] = set()
        numbers = dict(self.numbers)
        waiting: List[Tuple[ListForm, _Binding]] = [(effect, binding) for effect in effects]
        while waiting:
            form, bound = waiting.pop()
            inner = [part for part in form.parts[1:] if isinstance(part, ListForm)]
            if form.head == "and":
                waiting += [(part, bound) for part in inner]
            elif form.head == "forall":
                names = _typed(_form(form.parts[1]).parts)
                waiting += [(inner[1], each) for each in self._bindings(names, bound)]
            elif form.head == "when":
                if self._holds(inner[0], bound):
                    waiting.append((inner[1], bound))
            elif form.head in ("increase", "decrease", "assign"):
                self._set(numbers, form, bound)
            elif form.head == "not":
                deleted.add(_ground(inner[0], bound))
            elif form.parts:
                added.add(_ground(form, bound))
        self.facts = (self.facts - deleted) | added
        self.numbers = numbers

    def _set(self, numbers: Dict[Fact, float], form: ListForm, binding: _Binding) -> None:
        name = _ground(_form(form.parts[1]), binding)
        value = self._value(form.parts[2], binding)
        sign = {"increase": 1, "decrease": -1}.get(form.head)
        numbers[name] = value if sign is None else numbers.get(name, 0) + sign * value

    def _bindings(self, names: _Types, binding: _Binding) -> List[_Binding]:
        found: List[_Binding] = [binding]
        for name, kinds in names.items():
            things = [thing for thing in self.kinds if self._is_of(thing, kinds)]
            found = [{**each, name: thing} for each in found for thing in things]
        return found


def read_validator(domain_file: Path, problem_file: Path) -> PlanValidator:
    """Returns a validator for the files of a task, with their conditions as they stand there."""
    domain, problem = read_task(domain_file, problem_file)
    validator = PlanValidator(
        replace(domain, form=read_file(domain_file)), replace(problem, form=read_file(problem_file))
    )
    validator.names = Identifiers.of(domain.form, problem.form)
    return validator


def typed_list_of(action: ListForm) -> _Types:
    """Returns the parameters of an action with their types."""
    parts = {key.text: value for key, value in zip(action.parts[2::2], action.parts[3::2])}
    return _typed(_form(parts.get(":parameters")).parts)


def _typed(parts: Sequence[PddlPart]) -> _Types:
    types: _Types = {}
    waiting: List[str] = []
    words = iter(parts)
    for part in words:
        if part.text != "-":
            waiting.append(part.text)
            continue
        kind = next(words)
        kinds = kind.parts[1:] if isinstance(kind, ListForm) else (kind,)
        types.update((name, tuple(each.text for each in kinds)) for name in waiting)
        waiting = []
    return {**types, **dict.fromkeys(waiting, ("object",))}


def _strata(rules: Sequence[Tuple[ListForm, ListForm]]) -> Dict[str, int]:
    """Returns the stratum of each derived predicate: above those that its rules deny."""
    strata = {head.head: 0 for head, _ in rules}
    for _ in strata:
        for head, body in rules:
            for name, is_denied in _read(body, False):
                if name in strata:
                    strata[head.head] = max(strata[head.head], strata[name] + is_denied)
    return strata


def _read(form: ListForm, is_denied: bool) -> Iterator[Tuple[str, bool]]:
    """Yields the predicates of a condition, and whether they are denied in it."""
    inner = [part for part in form.parts[1:] if isinstance(part, ListForm)]
    if form.head == "imply":
        yield from _read(inner[0], not is_denied)
        yield from _read(inner[1], is_denied)
    elif form.head in ("and", "or", "not", "forall", "exists"):
        for part in inner[1:] if form.head in ("forall", "exists") else inner:
            yield from _read(part, is_denied != (form.head == "not"))
    else:
        yield form.head, is_denied


def _form(part: object) -> ListForm:
    return part if isinstance(part, ListForm) else ListForm((), "")


def _at(form: ListForm, moment: str) -> List[ListForm]:
    """Returns the parts of a condition or effect at a moment."""
    if form.head == "and":
        return [each for part in form.parts[1:] for each in _at(_form(part), moment)]
    is_then = " ".join(part.text for part in form.parts[:2]) == moment
    return [_form(form.parts[2])] if is_then else []


def _ground(form: ListForm, binding: _Binding) -> Fact:
    return tuple(binding.get(part.text, part.text) for part in form.parts)
