"""Compiles quantifiers and disjunctions away, so that conditions are conjunctions of literals.

The action::

    (:action open :parameters (?d - door)
      :precondition (or (unlocked ?d) (exists (?k - key) (and (have ?k) (fits ?k ?d)))))

becomes ``open ?d``, which needs ``(unlocked ?d)``, and ``open-or-2 ?d ?k``, which needs the rest:
each alternative is an action, with a parameter for each existential variable. ``(either a b)`` is a
predicate that holds for objects of both types, and an effect with alternatives under ``when``
several effects. Alternatives in a goal, and a great many of them elsewhere, become derived
predicates, and a derived predicate gets one rule for each alternative.
"""

from __future__ import annotations

import math
from typing import (
    AbstractSet,
    Callable,
    Collection,
    Dict,
    Iterator,
    List,
    Mapping,
    Sequence,
    Set,
    Tuple,
)

from rosclingo.errors import shorten
from rosoclingo.tools.pddl.alternatives import (
    MOST_ALTERNATIVES,
    Alternative,
    Alternatives,
    denials,
    is_complex,
    rule,
)
from rosoclingo.tools.pddl.domain import Domain, Problem, read_domain, read_problem
from rosoclingo.tools.pddl.expressions import ListForm, PddlError, Word, list_form
from rosoclingo.tools.pddl.rules import rule_parts
from rosoclingo.tools.pddl.support import DERIVED, PddlPart, changed_atoms, formula, is_comparison
from rosoclingo.tools.pddl.typed import either, one_type_each, typed_list

_MOMENTS = ("at start", "at end", "over all")
_ACTIONS = (":action", ":durative-action")
_MOST_DENIALS = 1  # of one condition, before they become one
_MOST_DENIALS_OF_EFFECTS = 2


def compile_conditions(
    domain: ListForm, problem: ListForm, changing: Collection[str] = ()
) -> Tuple[Domain, Problem]:
    """Returns a task whose conditions and goal are conjunctions of literals.

    Args:
        domain: All of the domain.
        problem: All of the problem.
        changing: Predicates whose facts may change though no action changes them.

    Raises:
        PddlError: The task is not understood, or a condition has far too many alternatives.
    """
    compiler = _Compiler(domain, problem, changing)
    actions = [new for part in domain.parts for new in compiler.section(part)]
    goals = [compiler.goal(part) for part in problem.parts]
    compiled = compiler.declared(list_form(domain.place, *actions))
    return (
        read_domain(compiled, compiler.made),
        read_problem(compiler.stated(list_form(problem.place, *goals))),
    )


class _Compiler:
    """Compiles the sections of a task, one by one."""

    def __init__(self, domain: ListForm, problem: ListForm, changing: Collection[str]) -> None:
        supertypes: Dict[str, str] = {}
        objects: Dict[str, str] = {}
        for part in domain.lists(":types"):
            supertypes.update(typed_list(part.parts[1:], may_repeat=True))
        for part in (*domain.lists(":constants"), *problem.lists(":objects")):
            objects.update(typed_list(part.parts[1:]))
        actions = list(domain.lists(*_ACTIONS))
        effects = [v for action in actions for k, v in _keys(action) if k.text == ":effect"]
        forms = [effect for effect in effects if isinstance(effect, ListForm)]
        changed = {atom.head for form in forms for atom in changed_atoms(form)}
        derived = {head.head for form in domain.lists(DERIVED) for head in [*form.lists()][:1]}
        predicates = {f.head for part in domain.lists(":predicates") for f in part.lists()}
        facts = {f.text for part in problem.lists(":init") for f in part.parts}
        self._names: Set[str] = {action.parts[1].text for action in actions if action.parts[1:]}
        self._conditions = Alternatives(
            objects,
            supertypes,
            static=predicates - changed - derived - set(changing),
            derived=derived,
            facts=facts,
            names=self._names | predicates,
        )
        self._eithers: Dict[str, Tuple[str, ...]] = {}

    # -- sections ---------------------------------------------------------------------------------

    @property
    def made(self) -> AbstractSet[str]:
        """The derived predicates that stand for parts of conditions."""
        return self._conditions.made

    def section(self, part: PddlPart) -> Iterator[PddlPart]:
        """Yields the compiled sections that replace a section of the domain."""
        if isinstance(part, ListForm) and part.head in _ACTIONS:
            yield from self._action(part)
        elif isinstance(part, ListForm) and part.head == DERIVED:
            yield from self._derived(part)
        elif isinstance(part, ListForm) and part.head in (":predicates", ":functions"):
            yield _mapped(part, _plain_types)
        else:
            yield part

    def declared(self, domain: ListForm) -> ListForm:
        """Returns a domain with the declarations of made predicates, and their rules."""
        made = [list_form(domain.place, name, "?x") for name in self._eithers]
        rules = self._conditions.rules
        heads = {head.head: head for each in rules for head in [formula(each.parts[1])]}
        made += heads.values()
        if made and not list(domain.lists(":predicates")):
            domain = list_form(domain.place, *domain.parts, list_form(domain.place, ":predicates"))
        domain = _extended(domain, ":predicates", made)
        return list_form(domain.place, *domain.parts, *rules)

    def stated(self, problem: ListForm) -> ListForm:
        """Returns a problem with the facts of predicates that stand for ``(either ...)``."""
        made = [
            list_form(problem.place, name, each)
            for name, types in self._eithers.items()
            for each in self._conditions.objects_of(types)
        ]
        return _extended(problem, ":init", made)

    def goal(self, part: PddlPart) -> PddlPart:
        """Returns the goal as a conjunction of literals; other sections stay as they are."""
        if not isinstance(part, ListForm) or part.head != ":goal" or len(part.parts) != 2:
            return part
        form = part.parts[1]
        if not isinstance(form, ListForm) or not (is_complex(form) or denials(form)):
            return part
        self._enter("goal", list_form(part.place))
        wanted: List[ListForm] = []
        for alternatives in self._conditions.conjuncts(form):
            if not alternatives:
                raise PddlError(f"{form.place}: the goal can never be met, whatever is done")
            if len(alternatives) > 1 or alternatives[0][0]:
                wanted += self._conditions.as_fact(alternatives, form.place)[0][1]
            else:
                wanted += alternatives[0][1]
        literals = [self._conditions.without_negations([each], 0)[0] for each in wanted]
        return list_form(part.place, part.parts[0], list_form(form.place, "and", *literals))

    def _derived(self, form: ListForm) -> Iterator[ListForm]:
        """Yields a rule for each alternative of a derived predicate's condition."""
        head, condition = rule_parts(form)
        plain, typed = self._parameters(list_form(head.place, *head.parts[1:]))
        self._enter(head.head, plain)
        found = self._conditions.of(condition)
        for alternative in self._conditions.all_of([[((), tuple(typed))], found], condition):
            variables, literals = alternative
            literals = self._conditions.without_negations(literals, _MOST_DENIALS)
            yield rule(list_form(head.place, head.parts[0], *plain.parts), (variables, literals))

    def _enter(self, owner: str, parameters: ListForm) -> None:
        self._conditions.owner = owner
        self._conditions.scope = typed_list(parameters.parts)

    # -- actions ----------------------------------------------------------------------------------

    def _action(self, action: ListForm) -> Iterator[ListForm]:
        found = {key.text: value for key, value in _keys(action)}
        timed = action.head == ":durative-action"
        where = ":condition" if timed else ":precondition"
        parameters = found.get(":parameters", list_form(action.place))
        condition = found.get(where, list_form(action.place))
        if isinstance(parameters, Word) or isinstance(condition, Word) or len(action.parts) % 2:
            yield action  # malformed, which read_domain reports
            return
        parameters, typed = self._parameters(parameters)
        self._enter(action.parts[1].text, parameters)
        effect = found.get(":effect")
        changed = {":effect": self._effect(effect)} if isinstance(effect, ListForm) else {}
        if not (typed or is_complex(condition) or denials(condition) > _MOST_DENIALS):
            yield _written(action, action.parts[1], changed)
            return
        inner = self._timed(condition) if timed else self._conditions.of(condition)
        if timed:
            typed = [list_form(each.place, "at", "start", each) for each in typed]
        alternatives = self._conditions.all_of([[((), tuple(typed))], inner], condition)
        for number, (variables, needed) in enumerate(alternatives, 1):
            literals = needed
            if not timed:
                literals = self._conditions.without_negations(needed, _MOST_DENIALS)
            name = action.parts[1]
            if number > 1:
                name = Word(self._new_name(f"{name.text}-or-{number}"), name.place)
            more = [text for variable, kind in variables for text in (variable, "-", kind)]
            changed[":parameters"] = list_form(parameters.place, *_ended(parameters.parts), *more)
            changed[where] = list_form(condition.place, "and", *literals)
            yield _written(action, name, changed)

    def _new_name(self, name: str) -> str:
        while name in self._names:
            name += "-"
        self._names.add(name)
        return name

    def _parameters(self, parameters: ListForm) -> Tuple[ListForm, List[ListForm]]:
        """Returns variables with one type each, and atoms for those that had several."""
        atoms: List[ListForm] = []
        waiting: List[Word] = []  # variables whose type is to come
        is_type = False
        for part in parameters.parts:
            if isinstance(part, ListForm):
                types = either(part)
                name = f"either-{'-'.join(types)}"
                self._eithers[name] = types
                atoms += [list_form(part.place, name, each) for each in waiting]
                waiting = []
            elif is_type:
                waiting = []
            elif part.text != "-":
                waiting.append(part)
            is_type = part.text == "-"
        return _plain_types(parameters), atoms

    def _effect(self, form: ListForm) -> ListForm:
        """Returns an effect whose conditions are conjunctions."""
        inner = form.parts[1:]
        first = inner[0] if len(inner) == 2 else None
        if form.head == "forall" and isinstance(first, ListForm):
            for each in one_type_each(first):
                self._conditions.scope.update(typed_list(each.parts))
            body = self._effect(inner[1]) if isinstance(inner[1], ListForm) else inner[1]
            made = [list_form(form.place, "forall", each, body) for each in one_type_each(first)]
        elif form.head == "when" and isinstance(first, ListForm):
            has_numbers = any(map(is_comparison, first.forms()))
            if not (is_complex(first) or has_numbers or denials(first) > _MOST_DENIALS_OF_EFFECTS):
                return form
            made = []
            found = self._conditions.of(first)
            if has_numbers:  # which rules can have, and conditions of effects cannot
                found = self._conditions.as_fact(found, form.place)
            for variables, needed in found:
                literals = self._conditions.without_negations(needed, _MOST_DENIALS_OF_EFFECTS)
                one = list_form(
                    form.place, "when", list_form(form.place, "and", *literals), inner[1]
                )
                words = [text for each in variables for text in (each[0], "-", each[1])]
                if words:
                    one = list_form(form.place, "forall", list_form(form.place, *words), one)
                made.append(one)
        elif form.head == "and" or " ".join(p.text for p in form.parts[:2]) in _MOMENTS:
            return _mapped(form, self._effect)
        else:
            return form
        return made[0] if len(made) == 1 else list_form(form.place, "and", *made)

    def _timed(self, form: ListForm) -> List[Alternative]:
        """Returns the disjuncts of the condition of a durative action."""
        parts = [
            (moment, self._conditions.of(condition)) for moment, condition in _moments_of(form)
        ]
        if math.prod(len(found) for _, found in parts) > MOST_ALTERNATIVES:
            parts = [
                (moment, self._conditions.as_fact(found, form.place) if found[1:] else found)
                for moment, found in parts
            ]
        wrapped = [
            [
                (variables, tuple(list_form(each.place, *moment, each) for each in literals))
                for variables, literals in found
            ]
            for moment, found in parts
        ]
        return self._conditions.all_of(wrapped, form)


def _moments_of(form: ListForm) -> Iterator[Tuple[Sequence[PddlPart], ListForm]]:
    """Yields the conditions of a durative action, each with its moment."""
    if form.head == "and" or not form.parts:
        for part in form.parts[1:]:
            yield from _moments_of(formula(part))
        return
    moment = form.parts[:2]
    if " ".join(p.text for p in moment) not in _MOMENTS or len(form.parts) != 3:
        raise PddlError(f"{form.place}: {shorten(form.text)} is not understood: there can be "
                        + ", ".join(f"({each} ...)" for each in _MOMENTS))  # fmt: skip
    yield moment, formula(form.parts[2])


def _plain_types(form: ListForm) -> ListForm:
    parts = [
        Word("object", part.place) if isinstance(part, ListForm) and part.head == "either" else part
        for part in form.parts
    ]
    return list_form(form.place, *parts)


def _ended(parameters: Sequence[PddlPart]) -> Sequence[PddlPart]:
    """Returns variables with a type at their end, so that others may follow."""
    if not parameters or (len(parameters) > 1 and parameters[-2].text == "-"):
        return parameters
    place = parameters[-1].place
    return (*parameters, Word("-", place), Word("object", place))


def _mapped(form: ListForm, change: Callable[[ListForm], ListForm]) -> ListForm:
    parts = [change(part) if isinstance(part, ListForm) else part for part in form.parts]
    return list_form(form.place, *parts)


def _extended(form: ListForm, head: str, more: Sequence[ListForm]) -> ListForm:
    """Returns a form with parts added to each section of a name."""
    return _mapped(form, lambda p: list_form(p.place, *p.parts, *more) if p.head == head else p)


def _written(action: ListForm, name: PddlPart, changed: Mapping[str, PddlPart]) -> ListForm:
    """Returns an action with another name, and other values of its keys."""
    present = {key.text for key, _ in _keys(action)}
    own = [part for key, value in _keys(action) for part in (key, changed.get(key.text, value))]
    new = [part for key, value in changed.items() if key not in present for part in (key, value)]
    return list_form(action.place, action.parts[0], name, *own, *new)


def _keys(action: ListForm) -> Iterator[Tuple[PddlPart, PddlPart]]:
    """Yields the keys of an action with their values."""
    yield from zip(action.parts[2::2], action.parts[3::2])
