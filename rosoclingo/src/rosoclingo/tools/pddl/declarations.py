"""Checks that all names of a task are declared, so that a mistyped one is found with its line."""

from __future__ import annotations

from typing import Dict, Iterable, Mapping, Set

from rosclingo.errors import shorten
from rosoclingo.tools.pddl.domain import Domain, Problem
from rosoclingo.tools.pddl.expressions import ListForm, PddlError, Word
from rosoclingo.tools.pddl.support import CHANGES, COMPARISONS, changed_atoms, is_comparison
from rosoclingo.tools.pddl.typed import typed_list

_NO_ATOMS = ("and", "not", "when", "=")
_NUMERIC = (*COMPARISONS, *CHANGES, "+", "-", "*", "/")


def check_declarations(domain: Domain, problem: Problem) -> None:
    """Checks the names of types, predicates, functions, objects and variables.

    Raises:
        PddlError: One is not declared, or has another number of objects; the message says where.
    """
    checker = _Checker(domain, problem)
    for schema in domain.actions:
        scope = dict(zip(schema.parameters, schema.types))
        checker.check_types(scope.values(), schema.place)
        for form in (
            schema.precondition,
            schema.effect,
            *schema.comparisons,
            *schema.changes,
            *schema.later_comparisons,
            *schema.later_changes,
        ):
            checker.check(form, scope)
        if isinstance(schema.duration, ListForm):
            checker.check(schema.duration, scope)
    for rule in domain.rules:
        checker.check_types(rule.types.values(), rule.head.place)
        tests = {test.name for test in domain.tests}
        atoms = [part for part in rule.condition.lists() if part.head not in tests]
        for form in (rule.head, *atoms, *rule.comparisons):
            checker.check(form, rule.types)
    for form in (*problem.init, problem.goal, *problem.comparisons):
        checker.check(form, {})
    _refuse_changes_of_derived(domain, problem)


def _refuse_changes_of_derived(domain: Domain, problem: Problem) -> None:
    """Refuses facts and effects of derived predicates, which hold by their rules alone."""
    derived = {rule.head.head for rule in domain.rules}
    for atom in problem.init:
        if atom.head in derived:
            raise PddlError(f"{atom.place}: {shorten(atom.text)} in :init: {atom.head} is derived, "
                            "so it holds by its rules alone: leave it out")  # fmt: skip
    for schema in domain.actions:
        for atom in changed_atoms(schema.effect):
            if atom.head in derived:
                raise PddlError(
                    f"{atom.place}: {schema.name} changes {shorten(atom.head)}, which is derived: "
                    "change what its rules need"
                )


class _Checker:
    """Checks a task against its declarations."""

    def __init__(self, domain: Domain, problem: Problem) -> None:
        self._counts: Dict[str, int] = {}
        self._made = domain.made
        for section in domain.form.lists(":functions"):
            _refuse_object_fluents(section)
        for section in domain.form.lists(":predicates", ":functions"):
            for each in section.lists():
                places = [part for part in each.parts if part.text.startswith("?")]
                self._counts[each.head] = len(places)
        self._types: Set[str] = {"object", *domain.supertypes, *domain.supertypes.values()}
        self._objects = {**domain.constants, **problem.objects}
        for name in (each for each in problem.objects if each in domain.constants):
            raise PddlError(f"{problem.form.place}: {shorten(name)} is one of the domain's "
                            ":constants already: an object is declared once")  # fmt: skip
        for name, kind in self._objects.items():
            if kind not in self._types:
                raise PddlError(f"{problem.form.place}: {name} is of the type {shorten(kind)}, "
                                f"which is not declared: {_known(self._types)}")  # fmt: skip

    def check_types(self, types: Iterable[str], place: str) -> None:
        for kind in types:
            if kind not in self._types:
                raise PddlError(f"{place}: the type {shorten(kind)} is not declared: "
                                f"{_known(self._types)}")  # fmt: skip

    def check(self, form: ListForm, scope: Mapping[str, str]) -> None:
        """Checks a condition, an effect or an amount, in which some variables are known."""
        if form.head == "forall":
            lists = list(form.lists())
            if len(form.parts) != 3 or len(lists) != 2:  # check_formula skips amounts
                raise PddlError(f"{form.place}: forall has variables and an effect")
            variables, inner = lists
            names = typed_list(variables.parts)
            self.check_types(names.values(), variables.place)
            self.check(inner, {**scope, **names})
            return
        is_atom = form.head not in (*_NO_ATOMS, *_NUMERIC)
        names_objects = is_atom or (form.head == "=" and not is_comparison(form))
        if is_atom and form.parts:
            self._check_atom(form)
        for part in form.parts[1:]:
            if isinstance(part, ListForm):
                self.check(part, scope)
            elif names_objects:
                self._check_term(part, scope)

    def _check_atom(self, form: ListForm) -> None:
        count = self._counts.get(form.head)
        if count is None:
            raise PddlError(f"{form.place}: {shorten(form.head)} is not declared: "
                            f"{_known(self._counts.keys() - self._made)}")  # fmt: skip
        found = len(form.parts) - 1
        if found != count:
            raise PddlError(f"{form.place}: {shorten(form.text)} has {found} objects: "
                            f"{form.head} is declared with {count}")  # fmt: skip

    def _check_term(self, word: Word, scope: Mapping[str, str]) -> None:
        if word.text.startswith("?"):
            if word.text not in scope:
                raise PddlError(f"{word.place}: the variable {shorten(word.text)} is no parameter: "
                                f"{_known(scope)}")  # fmt: skip
        elif word.text not in self._objects:
            raise PddlError(f"{word.place}: there is no object {shorten(word.text)}: "
                            f"{_known(self._objects)}")  # fmt: skip


def _refuse_object_fluents(section: ListForm) -> None:
    """Refuses functions whose values are no numbers."""
    for before, kind in zip(section.parts[1:], section.parts[2:]):
        if before.text == "-" and kind.text != "number":
            raise PddlError(f"{kind.place}: a function of the type {shorten(kind.text)} is not "
                            "understood, only numbers are: declare a predicate")  # fmt: skip


def _known(names: Iterable[str]) -> str:
    return f"there are {shorten(', '.join(sorted(names)))}"
