"""Axioms: the rules of derived predicates.

The rule::

    (:derived (low ?r - robot) (and (awake ?r) (< (battery ?r) 3)))

is the :class:`DerivedRule` of ``(low ?r)`` with the condition ``(and (awake ?r)
(low-number-1 ?r))`` and the :class:`NumberTest` ``low-number-1``, since Fast Downward's translator
knows no numbers.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Dict, Iterable, Iterator, List, Mapping, Sequence, Set, Tuple

from rosclingo.errors import shorten
from rosoclingo.tools.pddl.expressions import ListForm, PddlError, list_form
from rosoclingo.tools.pddl.support import check_formula, is_comparison
from rosoclingo.tools.pddl.typed import typed_list


@dataclass(frozen=True)
class DerivedRule:
    """A rule of a derived predicate.

    Attributes:
        head: The predicate and its variables.
        types: The types of its variables and then of the existential ones.
        condition: The body, with tests of numbers as atoms.
        comparisons: The comparisons of these tests.
    """

    head: ListForm
    types: Mapping[str, str]
    condition: ListForm
    comparisons: Tuple[ListForm, ...] = ()

    @property
    def parameters(self) -> Sequence[str]:
        """The variables of the predicate."""
        return [part.text for part in self.head.parts[1:]]

    @property
    def own_types(self) -> str:
        """The variables of the predicate with their types, in PDDL."""
        return _typed(self.types, self.parameters)

    @property
    def text(self) -> str:
        """The rule in PDDL."""
        own = self.parameters
        head = self.own_types
        others = _typed(self.types, [each for each in self.types if each not in own])
        body = self.condition.text
        return f"(:derived ({self.head.head} {head}) " + (
            f"(exists ({others}) {body}))" if others else f"{body})"
        )


@dataclass(frozen=True)
class NumberTest:
    """A comparison of numbers in a rule, as an atom for the translator.

    Attributes:
        name: The predicate of that atom.
        types: Its variables with their types.
        comparison: The comparison.
    """

    name: str
    types: Mapping[str, str]
    comparison: ListForm


def read_rules(
    forms: Iterable[ListForm],
) -> Tuple[Tuple[DerivedRule, ...], Tuple[NumberTest, ...]]:
    """Reads the rules of a domain, whose conditions are conjunctions, and the tests in them.

    Raises:
        PddlError: A rule is malformed, or a predicate depends on its own contrary.
    """
    numbers = itertools.count(1)
    rules: List[DerivedRule] = []
    tests: List[NumberTest] = []
    for form in forms:
        head, condition = rule_parts(form)
        types = dict(typed_list(head.parts[1:]))
        for word in types:
            if not word.startswith("?"):
                raise PddlError(f"{head.place}: {shorten(word)} in {shorten(head.text)}: what is "
                                "derived has variables, such as ?x")  # fmt: skip
        if condition.head == "exists":
            variables, condition = condition.lists()
            types.update(typed_list(variables.parts))
        check_formula(condition, ":derived")
        atoms: List[ListForm] = []
        compared: List[ListForm] = []
        for part in condition.lists() if condition.head == "and" else [condition]:
            if not is_comparison(part):
                atoms.append(part)
                continue
            own = {word: types[word] for word in part.words() if word in types}
            test = NumberTest(f"{head.head}-number-{next(numbers)}", own, part)
            tests.append(test)
            compared.append(part)
            atoms.append(list_form(part.place, test.name, *own))
        plain = list_form(head.place, head.head, *typed_list(head.parts[1:]))
        body = list_form(condition.place, "and", *atoms)
        rules.append(DerivedRule(plain, types, body, tuple(compared)))
    _refuse_circles(rules)
    return tuple(rules), tuple(tests)


def rule_parts(form: ListForm) -> Tuple[ListForm, ListForm]:
    """Returns the head and the body of a rule.

    Raises:
        PddlError: The form is no rule.
    """
    parts = [*form.lists()]
    if len(parts) != 2 or len(form.parts) != 3 or not parts[0].head:
        raise PddlError(f"{form.place}: {shorten(form.text)} is not understood: there can be "
                        "(:derived (PREDICATE VARIABLE...) CONDITION)")  # fmt: skip
    return parts[0], parts[1]


def basis(rules: Sequence[DerivedRule]) -> Dict[str, Set[str]]:
    """Returns the predicates and functions on which each derived predicate depends, and itself."""
    found: Dict[str, Set[str]] = {each.head.head: {each.head.head} for each in rules}
    for one in rules:
        found[one.head.head].update(f.head for each in one.comparisons for f in each.forms())
    is_new = True
    while is_new:
        is_new = False
        for one in rules:
            own = found[one.head.head]
            size = len(own)
            for _, literal in _literals(one.condition):
                own |= found.get(literal.head, {literal.head})
            is_new = is_new or len(own) > size
    return found


def _refuse_circles(rules: Sequence[DerivedRule]) -> None:
    """Refuses rules that are not stratified: a predicate depends on its own negation."""
    depends = basis(rules)
    for one in rules:
        for holds, literal in _literals(one.condition):
            if not holds and one.head.head in depends.get(literal.head, ()):
                raise PddlError(
                    f"{literal.place}: {shorten(one.head.head)} depends on the contrary of "
                    f"{shorten(literal.head)}, which depends on {shorten(one.head.head)}: what a "
                    "derived predicate denies has to be derived without it"
                )


def _literals(condition: ListForm) -> Iterator[Tuple[bool, ListForm]]:
    """Yields the atoms of a conjunction, each with false if it is negated."""
    for part in condition.lists():
        if part.head == "not":
            yield from ((False, inner) for inner in part.lists())
        else:
            yield True, part


def _typed(types: Mapping[str, str], names: Iterable[str]) -> str:
    return " ".join(f"{name} - {types[name]}" for name in names)
