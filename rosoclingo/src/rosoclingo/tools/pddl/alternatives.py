"""The disjunctive normal form of conditions, kept small.

The condition ``(or (unlocked ?d) (exists (?k - key) (and (have ?k) (fits ?k ?d))))`` has two
alternatives: the literal ``(unlocked ?d)``; and, with the additional variable ``?k``, the other two
literals. ``forall`` becomes a conjunction over all objects. Where a condition has too many
alternatives, its parts become derived predicates with few rules each::

    (:derived (open-if-1 ?d) (unlocked ?d))
    (:derived (open-if-1 ?d) (exists (?k - key) (and (have ?k) (fits ?k ?d))))
"""

from __future__ import annotations

import itertools
import math
from typing import AbstractSet, Dict, FrozenSet, Iterator, List, Mapping, Sequence, Set, Tuple

from rosclingo.errors import shorten
from rosoclingo.tools.pddl.expressions import ListForm, PddlError, Word, list_form
from rosoclingo.tools.pddl.support import formulas, is_comparison, quantified
from rosoclingo.tools.pddl.typed import kinds_of, one_type_each, typed_list

MOST_ALTERNATIVES = 200
"""The limit for one condition. Beyond it, parts of the condition become derived predicates."""

_OR, _DENYING = "-if-", "-unless-"  # in names of derived predicates, after the owner's
_MOST_SIZE = 10_000  # ground instances of a conjunction
_MOST_COMPARED = 2000  # alternatives that are checked for subsumption
_MOST_RULES = 20_000  # of one predicate
COMPOUND = ("and", "or", "not", "imply", "forall", "exists")
_CONTRARY = {"<": (">=",), "<=": (">",), ">=": ("<",), ">": ("<=",), "=": ("<", ">")}

Alternative = Tuple[Tuple[Tuple[str, str], ...], Tuple[ListForm, ...]]
"""A disjunct: additional variables with their types, and a conjunction of literals."""

TRUE: List[Alternative] = [((), ())]
_FALSE: List[Alternative] = []


class Alternatives:
    """Computes disjunctive normal forms.

    Attributes:
        made: The derived predicates that it has introduced.
        rules: Their rules.
        scope: The types of the free variables of the current condition.
        owner: The action or predicate that has this condition; names of new predicates begin with
            it.
    """

    def __init__(
        self,
        objects: Mapping[str, str],
        supertypes: Mapping[str, str],
        *,
        static: AbstractSet[str],
        derived: AbstractSet[str],
        facts: AbstractSet[str],
        names: Set[str],
    ) -> None:
        """Takes the vocabulary of a task.

        Args:
            objects: All objects with their types.
            supertypes: The supertype of each type.
            static: The predicates that never change.
            derived: The derived predicates.
            facts: The texts of the facts of the initial state.
            names: The names that are taken; those of new predicates are added.
        """
        self._objects = objects
        self._supertypes = supertypes
        self._static = static
        self._facts = facts
        self._names = names
        self._fresh = itertools.count(1)
        self._shared: Dict[Tuple[str, ...], str] = {}  # made predicates, by their alternatives
        # the translator does not multiply out negations of these predicates
        self._fixed = {"=", *static, *derived}
        self.made: Set[str] = set()
        self.rules: List[ListForm] = []
        self.scope: Dict[str, str] = {}
        self.owner = ""

    def of(
        self, form: ListForm, holds: bool = True, objects: Mapping[str, str] = {}
    ) -> List[Alternative]:
        """Returns the disjuncts of a condition, or of its negation.

        Args:
            form: The condition.
            holds: False for its negation.
            objects: Substitutes for its variables.

        Raises:
            PddlError: The condition is malformed.
        """
        if form.head == "exists" if holds else form.head == "forall":
            variables, body = quantified(form)
            return self._existing(variables, body, holds, objects)
        if form.head not in COMPOUND:
            return self._literal(form, holds, objects) if form.parts else TRUE
        is_all, parts = self._parts(form, holds, objects)
        found = [self.of(*part) for part in parts]
        return self.all_of(found, form) if is_all else self._some_of(found, form)

    def conjuncts(
        self, form: ListForm, holds: bool = True, objects: Mapping[str, str] = {}
    ) -> Iterator[List[Alternative]]:
        """Yields the disjuncts of each conjunct of a condition, or of its negation."""
        if form.head in COMPOUND and not (
            form.head == "exists" if holds else form.head == "forall"
        ):
            is_all, parts = self._parts(form, holds, objects)
            if is_all or len(parts) == 1:
                for part in parts:
                    yield from self.conjuncts(*part)
                return
        yield self.of(form, holds, objects)

    def _parts(
        self, form: ListForm, holds: bool, objects: Mapping[str, str]
    ) -> Tuple[bool, List[Tuple[ListForm, bool, Mapping[str, str]]]]:
        """Returns the parts of a condition, and whether it is a conjunction of them."""
        if form.head in ("forall", "exists"):
            variables, body = quantified(form)
            bindings = self._bindings(variables, objects)
            return (form.head == "forall") == holds, [(body, holds, each) for each in bindings]
        if form.head == "imply":
            first, second = formulas(form, 2)
            return not holds, [(first, not holds, objects), (second, holds, objects)]
        if form.head == "not":
            return True, [(formulas(form, 1)[0], not holds, objects)]
        return (form.head == "and") == holds, [(each, holds, objects) for each in formulas(form)]

    def all_of(self, parts: Sequence[List[Alternative]], form: ListForm) -> List[Alternative]:
        """Returns the disjuncts of a conjunction, from those of its parts."""
        sizes = [self._size(part) for part in parts]
        if math.prod(sizes) > max([_MOST_SIZE, *sizes]):
            return self._all_as_facts(parts, form)
        found = TRUE
        for part in parts:
            if len(found) * len(part) > _MOST_COMPARED:
                break
            found = _without_more([
                ((*more, *variables), tuple({e.text: e for e in (*own, *literals)}.values()))
                for more, own in found
                for variables, literals in part
            ])  # fmt: skip
            if len(found) > MOST_ALTERNATIVES:
                break
        else:
            return found
        return self._all_as_facts(parts, form)

    def _all_as_facts(
        self, parts: Sequence[List[Alternative]], form: ListForm
    ) -> List[Alternative]:
        simple = (
            self.as_fact(part, form.place) if len(part) > 1 or (part and part[0][0]) else part
            for part in parts
        )
        return self.all_of(list(simple), form)

    def _size(self, part: List[Alternative]) -> int:
        """Returns how many ground instances a part has."""
        return sum(
            math.prod(len(self.objects_of((kind,))) for _, kind in variables)
            for variables, _ in part
        )

    def _some_of(self, parts: Sequence[List[Alternative]], form: ListForm) -> List[Alternative]:
        found = [each for part in parts for each in part]
        if len(found) > _MOST_RULES:
            raise PddlError(f"{form.place}: {shorten(form.text)} has more than {_MOST_RULES} "
                            "alternatives: say it with fewer objects, or by facts")  # fmt: skip
        if len(found) <= _MOST_COMPARED:
            found = _without_more(found)
        return self.as_fact(found, form.place) if len(found) > MOST_ALTERNATIVES else found

    def as_fact(self, found: List[Alternative], place: str, verb: str = _OR) -> List[Alternative]:
        """Replaces a disjunction by an atom of a derived predicate, new unless it has one."""
        bound = {variable for variables, _ in found for variable, _ in variables}
        free = dict.fromkeys(
            word
            for _, literals in found
            for literal in literals
            for word in literal.words()
            if word.startswith("?") and word not in bound
        )
        typed = [text for each in free for text in (each, "-", self.scope.get(each, "object"))]
        key = (*typed, *sorted(_anonymous(each) for each in found))
        name = self._shared.get(key)
        if name is None:
            name = self._shared[key] = self.new_name(f"{self.owner}{verb}")
            self.made.add(name)
            self._fixed.add(name)
            self.rules += [rule(list_form(place, name, *typed), each) for each in found]
        return [((), (list_form(place, name, *free),))]

    def without_negations(self, literals: Sequence[ListForm], most: int) -> Tuple[ListForm, ...]:
        """Limits the negations of atoms that change, which the translator multiplies out.

        If there are more than ``most``, one negation of a new predicate takes their place, which is
        derived from each of these atoms.
        """
        denying = [each for each in literals if each.head == "not" and self._changes(each)]
        if len(denying) <= most:
            return tuple(literals)
        place = denying[0].place
        facts: List[Alternative] = [((), tuple(each.lists())) for each in denying]
        (made,) = self.as_fact(facts, place, _DENYING)
        others = [each for each in literals if each not in denying]
        return (*others, list_form(place, "not", *made[1]))

    def _changes(self, literal: ListForm) -> bool:
        atoms = list(literal.lists())
        return all(each.head not in self._fixed and not is_comparison(each) for each in atoms)

    def new_name(self, stem: str) -> str:
        """Returns a name that is not taken: the stem with a number."""
        numbered = (f"{stem}{number}" for number in itertools.count(1))
        name = next(each for each in numbered if each not in self._names)
        self._names.add(name)
        return name

    def _existing(
        self, variables: ListForm, body: ListForm, holds: bool, objects: Mapping[str, str]
    ) -> List[Alternative]:
        found: List[Alternative] = []
        for each in one_type_each(variables):
            types = typed_list(each.parts)
            renamed = {name: f"{name}-{next(self._fresh)}" for name in types}
            added = tuple((renamed[name], kind) for name, kind in types.items())
            self.scope.update(added)
            for more, literals in self.of(body, holds, {**objects, **renamed}):
                found.append(((*added, *more), literals))
        return found

    def _bindings(
        self, variables: ListForm, objects: Mapping[str, str]
    ) -> Iterator[Mapping[str, str]]:
        for each in one_type_each(variables):
            types = typed_list(each.parts)
            for chosen in itertools.product(*(self.objects_of((k,)) for k in types.values())):
                yield {**objects, **dict(zip(types, chosen))}

    def objects_of(self, kinds: Sequence[str]) -> List[str]:
        """Returns the objects of some types and their subtypes."""
        wanted = {*kinds}
        return [
            each
            for each, own in self._objects.items()
            if not wanted.isdisjoint(kinds_of(own, self._supertypes))
        ]

    def _literal(
        self, form: ListForm, holds: bool, objects: Mapping[str, str]
    ) -> List[Alternative]:
        literal = _substituted(form, objects)
        if is_comparison(form):
            heads = (form.head,) if holds else _CONTRARY[form.head]
            return [((), (list_form(form.place, each, *literal.parts[1:]),)) for each in heads]
        ends = [part.text for part in literal.parts[1:]]
        if form.head == "=" and len(ends) == 2 and ends[0] == ends[1]:
            return TRUE if holds else _FALSE
        if not any(text.startswith("?") for text in ends):
            if form.head == "=":
                return _FALSE if holds else TRUE
            if form.head in self._static:
                return TRUE if (literal.text in self._facts) == holds else _FALSE
        return [((), (literal if holds else list_form(form.place, "not", literal),))]


def rule(head: ListForm, alternative: Alternative) -> ListForm:
    """Returns the rule of a derived predicate for one disjunct of its condition."""
    variables, literals = alternative
    words = [text for variable, kind in variables for text in (variable, "-", kind)]
    body = list_form(head.place, "and", *literals)
    exists = list_form(head.place, "exists", list_form(head.place, *words), body)
    return list_form(head.place, ":derived", head, exists if words else body)


def is_complex(form: ListForm) -> bool:
    """Returns whether a condition needs a disjunctive normal form; a conjunction does not."""
    negated = [f.parts[1] for f in form.forms() if f.head == "not" and len(f.parts) == 2]
    return any(each.head in ("or", "exists", "imply", "forall") for each in form.forms()) or any(
        isinstance(each, ListForm) and (each.head in COMPOUND or is_comparison(each))
        for each in negated
    )


def denials(form: ListForm) -> int:
    """Counts the negations in a condition."""
    return sum(each.head == "not" for each in form.forms())


def _without_more(found: Sequence[Alternative]) -> List[Alternative]:
    """Leaves out contradictory disjuncts, and those that another one subsumes."""
    kept: List[Tuple[FrozenSet[str], int]] = []
    for number in sorted(range(len(found)), key=lambda each: len(found[each][1])):
        texts = frozenset(each.text for each in found[number][1])
        if any(f"(not {text})" in texts for text in texts):
            continue
        if not any(other <= texts for other, _ in kept):
            kept.append((texts, number))
    return [found[number] for number in sorted(number for _, number in kept)]


def _anonymous(alternative: Alternative) -> str:
    """Returns a text that alternatives share which differ in the names of variables alone."""
    variables, literals = alternative
    names = {variable: f"?{number}" for number, (variable, _) in enumerate(variables)}
    texts = sorted(_substituted(each, names).text for each in literals)
    return " ".join([*(kind for _, kind in variables), *texts])


def _substituted(form: ListForm, objects: Mapping[str, str]) -> ListForm:
    parts = [
        _substituted(part, objects)
        if isinstance(part, ListForm)
        else Word(objects.get(part.text, part.text), part.place)
        for part in form.parts
    ]
    return list_form(form.place, *parts)
