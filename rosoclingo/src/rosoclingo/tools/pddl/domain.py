"""Domains and problems: sections, types, and actions with numbers and durations.

Fast Downward's translator knows neither numbers nor durations. So an :class:`ActionSchema` has its
``precondition`` and ``effect`` without them, for the translator, and beside that what was left
out::

    (:durative-action drive :parameters (?r ?a ?b) :duration (= ?duration 5)
      :condition (and (at start (at ?r ?a)) (over all (>= (battery ?r) 2)))
      :effect (and (at start (not (at ?r ?a))) (at end (at ?r ?b))
                   (at end (decrease (battery ?r) 2))))

is as the action ``(and (at ?r ?a))``, ``(and (not (at ?r ?a)) (at ?r ?b))``, with one comparison,
one change of a number, and the duration 5.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from typing import AbstractSet, Callable, Dict, List, Mapping, Optional, Sequence, Set, Tuple

from rosclingo.errors import shorten
from rosoclingo.tools.pddl.expressions import ListForm, PddlError, Word, list_form
from rosoclingo.tools.pddl.rules import DerivedRule, NumberTest, basis, read_rules
from rosoclingo.tools.pddl.support import (
    DERIVED,
    PddlPart,
    changed_atoms,
    check_formula,
    is_change,
    is_comparison,
    sections,
)  # fmt: skip
from rosoclingo.tools.pddl.typed import kinds_of, typed_list

_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
_START, _END, _ALL = "at start", "at end", "over all"


@dataclass(frozen=True)
class ActionSchema:
    """An action of a domain, with variables.

    Attributes:
        name: Its name.
        place: Its file and line.
        parameters: Its variables.
        types: For each variable its type.
        precondition: The condition on facts.
        effect: The effect on facts.
        comparisons: The conditions on numbers; of a durative action, those at its start.
        changes: The effects on numbers; of a durative action, those at its start.
        later_comparisons: The conditions on numbers after its start.
        later_changes: The effects on numbers at its end.
        duration: The expression of its duration; None without one.
        locks: Atoms that are changed at its start and changed back at its end.
        brief: Atoms that hold only while it lasts.
    """

    name: str
    place: str
    parameters: Tuple[str, ...]
    types: Tuple[str, ...]
    precondition: ListForm
    effect: ListForm
    comparisons: Tuple[ListForm, ...] = ()
    changes: Tuple[ListForm, ...] = ()
    later_comparisons: Tuple[ListForm, ...] = ()
    later_changes: Tuple[ListForm, ...] = ()
    duration: Optional[PddlPart] = None
    locks: Tuple[ListForm, ...] = ()
    brief: Tuple[ListForm, ...] = ()


@dataclass(frozen=True)
class Domain:
    """A domain.

    Attributes:
        form: The whole form.
        name: Its name.
        supertypes: The supertype of each type.
        constants: Objects of the domain, with their types.
        actions: Its actions.
        rules: The rules of its derived predicates.
        tests: The comparisons of numbers in these rules.
        made: The derived predicates that the compiler made for parts of conditions.
    """

    form: ListForm
    name: str
    supertypes: Dict[str, str]
    constants: Dict[str, str]
    actions: Tuple[ActionSchema, ...]
    rules: Tuple[DerivedRule, ...] = ()
    tests: Tuple[NumberTest, ...] = ()
    made: AbstractSet[str] = frozenset()

    def is_kind_of(self, kind: str, wanted: str) -> bool:
        """Returns whether a type is another one, or a subtype of it."""
        return wanted in kinds_of(kind, self.supertypes)


@dataclass(frozen=True)
class Problem:
    """A PDDL problem: objects, initial state and goal.

    Attributes:
        form: The whole form.
        objects: Its objects, with their types.
        numbers: The value that each number has at first, by its text.
        init: The atoms that hold at first.
        goal: The condition of the goal on facts.
        comparisons: The conditions of the goal on numbers.
        metric: The expression to be minimized; None without one.
        places: The file and line of each number's first value, by its text.
    """

    form: ListForm
    objects: Dict[str, str]
    numbers: Dict[str, float]
    init: Tuple[ListForm, ...]
    goal: ListForm
    metric: Optional[PddlPart]
    comparisons: Tuple[ListForm, ...] = ()
    places: Dict[str, str] = field(default_factory=dict)

    def place_of(self, name: Sequence[str]) -> str:
        """Returns the file and line of a number's first value."""
        return self.places.get(f"({' '.join(name)})", self.form.place)


def read_domain(form: ListForm, made: AbstractSet[str] = frozenset()) -> Domain:
    """Returns the domain of a file.

    Args:
        form: The whole form.
        made: The derived predicates that the compiler made for parts of conditions.

    Raises:
        PddlError: Something in it is not understood; the message says where.
    """
    found = sections(form, "domain")
    rules, tests = read_rules(form.lists(DERIVED))
    depends = basis(rules)
    actions = tuple(
        _durative(each, depends) if each.head == ":durative-action" else _instantaneous(each)
        for each in form.lists(":action", ":durative-action")
    )
    _refuse_required_concurrency(actions, depends)
    types = typed_list(found[":types"].parts[1:], may_repeat=True) if ":types" in found else {}
    constants = typed_list(found[":constants"].parts[1:]) if ":constants" in found else {}
    return Domain(form, _name(found["domain"]), types, constants, actions, rules, tests, made)


def read_problem(form: ListForm) -> Problem:
    """Returns the problem of a file.

    Raises:
        PddlError: Something in it is not understood; the message says where.
    """
    found = sections(form, "problem")
    objects = typed_list(found[":objects"].parts[1:]) if ":objects" in found else {}
    for needed in (":init", ":goal"):
        if needed not in found:
            raise PddlError(f"{form.place}: the problem has no {needed}")
    numbers: Dict[str, float] = {}
    places: Dict[str, str] = {}
    init: List[ListForm] = []
    for part in found[":init"].parts[1:]:
        if isinstance(part, Word):
            raise PddlError(f"{part.place}: {shorten(part.text)} is not in parentheses")
        if part.head == "not" and len(part.parts) == 2:
            continue  # as all that is not said
        if part.head == "=" and len(part.parts) == 3:
            text = part.parts[1].text
            if text in numbers:
                raise PddlError(f"{part.place}: {shorten(text)} has a value already, at "
                                f"{places[text]}: say one")  # fmt: skip
            numbers[text], places[text] = _value(part.parts[2]), part.place
        elif any(part.lists()):
            raise PddlError(
                f"{part.place}: {shorten(part.text)} in :init is not understood: there can be "
                "(PREDICATE OBJECT...) and (= (FUNCTION OBJECT...) NUMBER)"
            )
        else:
            init.append(part)
    goal = _only_part(found[":goal"])
    check_formula(goal, ":goal")
    facts, comparisons = _without(_conjuncts(goal), is_comparison)
    return Problem(
        form, objects, numbers, tuple(init), list_form(goal.place, "and", *facts),
        _metric(found.get(":metric")), tuple(comparisons), places,
    )  # fmt: skip


def number_of(part: PddlPart) -> Optional[float]:
    """Returns the number that a part is, if it is one that is finite."""
    value = float(part.text) if _NUMBER.fullmatch(part.text) else math.inf
    return value if math.isfinite(value) else None


def _value(part: PddlPart) -> float:
    value = number_of(part)
    if value is None:
        raise PddlError(f"{part.place}: {shorten(part.text)} is no number")
    return value


def _metric(section: Optional[ListForm]) -> Optional[PddlPart]:
    if section is None:
        return None
    words = [part.text for part in section.parts[1:] if isinstance(part, Word)]
    if words[:1] != ["minimize"] or len(section.parts) != 3:
        raise PddlError(f"{section.place}: {shorten(section.text)} is not understood: there can be "
                        "(:metric minimize WHAT)")  # fmt: skip
    return section.parts[2]


def _name(section: ListForm) -> str:
    if len(section.parts) != 2 or not isinstance(section.parts[1], Word):
        raise PddlError(f"{section.place}: a name is missing")
    return section.parts[1].text


def _only_part(section: ListForm) -> ListForm:
    if len(section.parts) != 2 or not isinstance(section.parts[1], ListForm):
        raise PddlError(f"{section.place}: {section.head} has one part, in parentheses")
    return section.parts[1]


class _Parts:
    """The parts of an action, by their keys."""

    def __init__(self, action: ListForm, keys: Sequence[str]) -> None:
        if len(action.parts) < 2 or not isinstance(action.parts[1], Word):
            raise PddlError(f"{action.place}: this action has no name")
        self.name = action.parts[1].text
        self._parts: Dict[str, PddlPart] = {}
        rest = action.parts[2:]
        for key, value in zip(rest[::2], rest[1::2]):
            self._check(key, keys)
            self._parts[key.text] = value
        if len(rest) % 2:
            self._check(rest[-1], keys)
            raise PddlError(f"{rest[-1].place}: nothing follows {rest[-1].text}")
        self._place = action.place

    def _check(self, key: PddlPart, keys: Sequence[str]) -> None:
        if not isinstance(key, Word):
            raise PddlError(f"{key.place}: one of {', '.join(keys)} is expected here")
        if key.text not in keys:
            raise PddlError(f"{key.place}: {shorten(key.text)} is not understood: there can be "
                            f"{', '.join(sorted(keys))}")  # fmt: skip

    def parameters(self) -> Dict[str, str]:
        return typed_list(self.form(":parameters").parts)

    def form(self, key: str) -> ListForm:
        part = self._parts.get(key, list_form(self._place))
        if isinstance(part, Word):
            raise PddlError(f"{part.place}: {shorten(part.text)} is not in parentheses")
        return part


def _instantaneous(action: ListForm) -> ActionSchema:
    parts = _Parts(action, (":parameters", ":precondition", ":effect"))
    parameters = parts.parameters()
    conditions, effects = parts.form(":precondition"), parts.form(":effect")
    if conditions.parts:
        check_formula(conditions, ":precondition")
    if effects.parts:
        check_formula(effects, ":effect")
    plain, comparisons = _without(_conjuncts(conditions), is_comparison)
    changed, changes = _without(_conjuncts(effects), is_change)
    return ActionSchema(
        parts.name, action.place, tuple(parameters), tuple(parameters.values()),
        list_form(action.place, "and", *plain), list_form(action.place, "and", *changed),
        tuple(comparisons), tuple(changes),
    )  # fmt: skip


def _durative(action: ListForm, depends: Mapping[str, Set[str]]) -> ActionSchema:
    parts = _Parts(action, (":parameters", ":duration", ":condition", ":effect"))
    parameters = parts.parameters()
    conditions = _timed(parts.form(":condition"), ":precondition", (_START, _ALL, _END))
    effects = _timed(parts.form(":effect"), ":effect", (_START, _END))
    begun, ended = effects[_START], effects[_END]
    facts: Dict[str, List[ListForm]] = {}
    comparisons: List[ListForm] = []
    later_ones: List[ListForm] = []
    for moment, forms in conditions.items():
        facts[moment], found = _without(forms, is_comparison)
        (comparisons if moment == _START else later_ones).extend(found)
    first, changes = _without(begun, is_change)
    last, later = _without(ended, is_change)
    plain = _needed(facts, first)
    begins = {atom.head for effect in first for atom in changed_atoms(effect)}
    begins.update(part.head for change in changes for part in change.lists())
    for condition in (*facts[_ALL], *facts[_END]):
        for atom in condition.forms():
            if depends.get(atom.head, set()) & begins:
                raise PddlError(
                    f"{atom.place}: {shorten(atom.head)} is derived from what {parts.name} changes "
                    "at its start: say what has to hold after its start by other facts"
                )
    net, locks, brief = _net(plain, first, last)
    return ActionSchema(
        parts.name, action.place, tuple(parameters), tuple(parameters.values()),
        list_form(action.place, "and", *plain), list_form(action.place, "and", *net),
        tuple(comparisons), tuple(changes), tuple(later_ones), tuple(later),
        _duration(parts.form(":duration")),
        tuple(locks), tuple(brief),
    )  # fmt: skip


def _duration(form: ListForm) -> PddlPart:
    if form.head == "=" and len(form.parts) == 3 and form.parts[1].text == "?duration":
        return form.parts[2]
    raise PddlError(f"{form.place}: {shorten(form.text)} as :duration is not understood: there can "
                    "be (= ?duration AMOUNT)")  # fmt: skip


def _conjuncts(form: ListForm) -> List[ListForm]:
    """Returns the parts of a conjunction, those of inner ones, too."""
    if form.head != "and":
        return [form] if form.parts else []
    return [each for part in form.lists() for each in _conjuncts(part)]


def _without(
    forms: Sequence[ListForm], is_one: Callable[[ListForm], bool]
) -> Tuple[List[ListForm], List[ListForm]]:
    """Partitions forms: those that are not of a kind, and those that are."""
    return [f for f in forms if not is_one(f)], [f for f in forms if is_one(f)]


def _timed(form: ListForm, where: str, moments: Sequence[str]) -> Dict[str, List[ListForm]]:
    """Returns the conditions or effects of each moment."""
    found: Dict[str, List[ListForm]] = {moment: [] for moment in moments}
    for part in _conjuncts(form):
        moment = " ".join(word.text for word in part.parts[:2] if isinstance(word, Word))
        if moment not in moments or len(part.parts) != 3 or not isinstance(part.parts[2], ListForm):
            raise PddlError(f"{part.place}: {shorten(part.text)} is not understood: there can be "
                            + ", ".join(f"({each} ...)" for each in moments))  # fmt: skip
        check_formula(part.parts[2], where)
        found[moment] += _conjuncts(part.parts[2])
    return found


def _contrary(literal: ListForm) -> str:
    """Returns the text of a literal's contrary."""
    return literal.parts[1].text if literal.head == "not" else f"(not {literal.text})"


def _needed(conditions: Dict[str, List[ListForm]], begun: Sequence[ListForm]) -> List[ListForm]:
    """Returns the conditions of an action that its own start effects do not bring about."""
    given = {literal.text for literal in begun}
    taken = {_contrary(literal) for literal in begun}
    needed = {condition.text: condition for condition in conditions[_START]}
    for condition in (*conditions[_ALL], *conditions[_END]):
        if condition.text in taken:
            raise PddlError(f"{condition.place}: {shorten(condition.text)} never holds then: the "
                            "action's own beginning changes it")  # fmt: skip
        if condition.text not in given:
            needed.setdefault(condition.text, condition)
    return list(needed.values())


def _net(
    conditions: Sequence[ListForm], begun: Sequence[ListForm], ended: Sequence[ListForm]
) -> Tuple[List[ListForm], List[ListForm], List[ListForm]]:
    """Returns an action's net effects, its locks, and its temporary effects."""
    before = {condition.text for condition in conditions}
    undone = {_contrary(literal) for literal in ended}
    net = [literal for literal in begun if literal.text not in undone]
    locks: List[ListForm] = []
    brief: List[ListForm] = []
    back = {_contrary(literal) for literal in begun}
    for literal in ended:
        if literal.text not in back:
            net.append(literal)
            continue
        atom = literal.parts[1] if literal.head == "not" else literal
        assert isinstance(atom, ListForm)
        locks.append(atom)
        if literal.head == "not":
            brief.append(atom)
        if literal.text not in before:
            net.append(literal)
    return net, locks, brief


def _refuse_required_concurrency(
    actions: Sequence[ActionSchema], depends: Mapping[str, Set[str]]
) -> None:
    """Refuses actions that can only be done while another one lasts."""
    for action in actions:
        for atom in action.locks:
            for other in actions:
                for form in other.precondition.forms():
                    if atom.head in depends.get(form.head, ()):
                        raise PddlError(
                            f"{atom.place}: {shorten(atom.head)} is another one while "
                            f"{action.name} lasts, and {other.name} needs {shorten(form.head)}, "
                            f"which is derived from it: have it need {shorten(atom.head)} itself"
                        )
    for action in actions:
        for atom in action.brief:
            for other in actions:
                if any(other.precondition.lists(atom.head)):
                    raise PddlError(
                        f"{atom.place}: {shorten(atom.text)} holds only while {action.name} lasts, "
                        f"and {other.name} needs it: no action begins within another one"
                    )
