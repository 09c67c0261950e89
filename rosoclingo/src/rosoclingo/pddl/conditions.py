"""Compiles quantifiers and disjunctions away: afterwards, conditions are conjunctions of literals.

The action::

    (:action open :parameters (?d - door)
      :precondition (or (unlocked ?d) (exists (?k - key) (and (have ?k) (fits ?k ?d)))))

becomes ``open ?d``, which needs ``(unlocked ?d)``, and ``open-or-2 ?d ?k``, which needs the rest:
each alternative is an action, and what exists is one more object of it. ``forall`` becomes a
conjunction over all objects, ``(either a b)`` a predicate that holds for objects of both types, and
an effect with alternatives under ``when`` several effects. A goal cannot have alternatives.
"""

from __future__ import annotations

import itertools
from typing import (
    AbstractSet,
    Callable,
    Collection,
    Dict,
    FrozenSet,
    Iterator,
    List,
    Mapping,
    Sequence,
    Tuple,
)  # fmt: skip

from rosclingo.errors import shorten
from rosoclingo.pddl.domain import typed_list
from rosoclingo.pddl.expressions import ListForm, PddlError, Word, list_form
from rosoclingo.pddl.support import CHANGES, PddlPart, is_comparison

_MOST = 200  # alternatives of one action: the planner grounds each of them
_COMPOUND = ("and", "or", "not", "imply", "forall", "exists")
_CONTRARY = {"<": (">=",), "<=": (">",), ">=": ("<",), ">": ("<=",), "=": ("<", ">")}
_MOMENTS = ("at start", "at end", "over all")
_ACTIONS = (":action", ":durative-action")

_Alternative = Tuple[Tuple[Tuple[str, str], ...], Tuple[ListForm, ...]]
"""Further variables with their types, and the literals that have to hold."""

_TRUE: List[_Alternative] = [((), ())]
_FALSE: List[_Alternative] = []


def compile_conditions(
    domain: ListForm, problem: ListForm, changing: Collection[str] = ()
) -> Tuple[ListForm, ListForm]:
    """Returns a task whose conditions and goal are conjunctions of literals.

    Args:
        domain: All of the domain.
        problem: All of the problem.
        changing: Predicates whose facts may change though no action changes them.

    Raises:
        PddlError: A condition is malformed, has too many alternatives, or the goal has some.
    """
    compiler = _Compiler(domain, problem, changing)
    actions = [new for part in domain.parts for new in compiler.section(part)]
    goals = [compiler.goal(part) for part in problem.parts]
    return compiler.declared(list_form(domain.place, *actions)), compiler.stated(
        list_form(problem.place, *goals)
    )


class _Compiler:
    """Knows the objects and facts that conditions are about."""

    def __init__(self, domain: ListForm, problem: ListForm, changing: Collection[str]) -> None:
        self._supertypes: Dict[str, str] = {}
        self._objects: Dict[str, str] = {}
        for part in domain.lists(":types"):
            self._supertypes.update(typed_list(part.parts[1:], may_repeat=True))
        for part in (*domain.lists(":constants"), *problem.lists(":objects")):
            self._objects.update(typed_list(part.parts[1:]))
        actions = list(domain.lists(*_ACTIONS))
        effects = [v for action in actions for k, v in _keys(action) if k.text == ":effect"]
        changed = {head for effect in effects for head in _changed(effect)}
        names = {f.head for part in domain.lists(":predicates") for f in part.lists()}
        self._static: AbstractSet[str] = names - changed - set(changing)
        self._facts = {f.text for part in problem.lists(":init") for f in part.parts}
        self._names = {action.parts[1].text for action in actions if len(action.parts) > 1}
        self._eithers: Dict[str, Tuple[str, ...]] = {}
        self._fresh = itertools.count(1)

    # -- sections ---------------------------------------------------------------------------------

    def section(self, part: PddlPart) -> Iterator[PddlPart]:
        """Yields the sections of the domain that replace one."""
        if isinstance(part, ListForm) and part.head in _ACTIONS:
            yield from self._action(part)
        elif isinstance(part, ListForm) and part.head in (":predicates", ":functions"):
            yield _mapped(part, _plain_types)
        else:
            yield part

    def declared(self, domain: ListForm) -> ListForm:
        """Returns a domain with the predicates that stand for several types."""
        made = [list_form(domain.place, name, "?x") for name in self._eithers]
        if made and not list(domain.lists(":predicates")):
            domain = list_form(domain.place, *domain.parts, list_form(domain.place, ":predicates"))
        return _extended(domain, ":predicates", made)

    def stated(self, problem: ListForm) -> ListForm:
        """Returns a problem with the facts of those predicates."""
        made = [
            list_form(problem.place, name, each)
            for name, types in self._eithers.items()
            for each in self._of(types)
        ]
        return _extended(problem, ":init", made)

    def goal(self, part: PddlPart) -> PddlPart:
        """Returns the goal without quantifiers; other sections stay as they are."""
        if not isinstance(part, ListForm) or part.head != ":goal" or len(part.parts) != 2:
            return part
        form = part.parts[1]
        if not isinstance(form, ListForm) or not _is_complex(form):
            return part
        alternatives = self._alternatives(form, True, {}, is_goal=True)
        if not alternatives:
            raise PddlError(f"{form.place}: the goal can never be met, whatever is done")
        if len(alternatives) > 1:
            place = next((f.place for f in form.forms() if f.head in _COMPOUND[1:]), form.place)
            raise PddlError(
                f"{place}: the goal has {len(alternatives)} alternatives: a goal is what holds "
                "together; request each alternative as a goal of its own"
            )
        return list_form(
            part.place, part.parts[0], list_form(form.place, "and", *alternatives[0][1])
        )

    # -- actions ----------------------------------------------------------------------------------

    def _action(self, action: ListForm) -> Iterator[ListForm]:
        found = {key.text: value for key, value in _keys(action)}
        timed = action.head == ":durative-action"
        where = ":condition" if timed else ":precondition"
        parameters = found.get(":parameters", list_form(action.place))
        condition = found.get(where, list_form(action.place))
        if isinstance(parameters, Word) or isinstance(condition, Word) or len(action.parts) % 2:
            yield action  # malformed, as who reads it says
            return
        parameters, typed = self._parameters(parameters)
        effect = found.get(":effect")
        changed = {":effect": self._effect(effect)} if isinstance(effect, ListForm) else {}
        if not (typed or _is_complex(condition)):
            yield _written(action, action.parts[1], changed)
            return
        inner = self._timed(condition) if timed else self._alternatives(condition, True, {})
        if timed:
            typed = [list_form(each.place, "at", "start", each) for each in typed]
        alternatives = _product([((), tuple(typed))], inner, condition)
        for number, (variables, literals) in enumerate(alternatives, 1):
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
                types = _either(part)
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
            body = self._effect(inner[1]) if isinstance(inner[1], ListForm) else inner[1]
            made = [list_form(form.place, "forall", each, body) for each in _one_type_each(first)]
        elif form.head == "when" and isinstance(first, ListForm):
            if not _is_complex(first):
                return form
            made = []
            for variables, literals in self._alternatives(first, True, {}):
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

    # -- conditions -------------------------------------------------------------------------------

    def _timed(self, form: ListForm) -> List[_Alternative]:
        """Returns the alternatives of a condition whose parts have moments."""
        if form.head == "and" or not form.parts:
            found = _TRUE
            for part in form.parts[1:]:
                found = _product(found, self._timed(_formula(part)), form)
            return found
        moment = form.parts[:2]
        if " ".join(p.text for p in moment) not in _MOMENTS or len(form.parts) != 3:
            raise PddlError(f"{form.place}: {shorten(form.text)} is not understood: there can be "
                            + ", ".join(f"({each} ...)" for each in _MOMENTS))  # fmt: skip
        return [
            (variables, tuple(list_form(each.place, *moment, each) for each in literals))
            for variables, literals in self._alternatives(_formula(form.parts[2]), True, {})
        ]

    def _alternatives(
        self, form: ListForm, holds: bool, objects: Mapping[str, str], *, is_goal: bool = False
    ) -> List[_Alternative]:
        """Returns the alternatives by which a condition holds, or does not.

        Args:
            form: The condition.
            holds: Whether it is to hold.
            objects: What stands for its variables.
            is_goal: Whether what exists is to be named, as a goal has no variables.
        """
        if form.head not in _COMPOUND:
            return self._literal(form, holds, objects) if form.parts else _TRUE
        inner = form.parts[1:]
        parts: List[Tuple[ListForm, bool, Mapping[str, str]]]
        if form.head == "not":
            (only,) = _formulas(form, 1)
            return self._alternatives(only, not holds, objects, is_goal=is_goal)
        if form.head in ("forall", "exists"):
            if len(inner) != 2 or not isinstance(inner[0], ListForm):
                raise PddlError(f"{form.place}: {form.head} has variables and a condition")
            body = _formula(inner[1])
            if (form.head == "exists") == holds and not is_goal:
                return self._existing(inner[0], body, holds, objects)
            parts = [(body, holds, each) for each in self._bindings(inner[0], objects)]
            is_all = (form.head == "forall") == holds
        elif form.head == "imply":
            first, second = _formulas(form, 2)
            parts = [(first, not holds, objects), (second, holds, objects)]
            is_all = not holds
        else:
            parts = [(each, holds, objects) for each in _formulas(form)]
            is_all = (form.head == "and") == holds
        found = _TRUE if is_all else _FALSE
        for part, wanted, bound in parts:
            own = self._alternatives(part, wanted, bound, is_goal=is_goal)
            found = _product(found, own, form) if is_all else _joined([*found, *own], form)
        return found

    def _existing(
        self, variables: ListForm, body: ListForm, holds: bool, objects: Mapping[str, str]
    ) -> List[_Alternative]:
        found: List[_Alternative] = []
        for each in _one_type_each(variables):
            types = typed_list(each.parts)
            renamed = {name: f"{name}-{next(self._fresh)}" for name in types}
            added = tuple((renamed[name], kind) for name, kind in types.items())
            for more, literals in self._alternatives(body, holds, {**objects, **renamed}):
                found.append(((*added, *more), literals))
        return found

    def _bindings(
        self, variables: ListForm, objects: Mapping[str, str]
    ) -> Iterator[Mapping[str, str]]:
        for each in _one_type_each(variables):
            types = typed_list(each.parts)
            for chosen in itertools.product(*(self._of((kind,)) for kind in types.values())):
                yield {**objects, **dict(zip(types, chosen))}

    def _of(self, kinds: Sequence[str]) -> List[str]:
        """Returns the objects of some types, or of kinds of them."""
        return [each for each, own in self._objects.items() if {*self._kinds(own)} & {*kinds}]

    def _kinds(self, kind: str) -> Iterator[str]:
        seen = ["object"]
        while kind not in seen:
            seen.append(kind)
            kind = self._supertypes.get(kind, "object")
        return iter(seen)

    def _literal(
        self, form: ListForm, holds: bool, objects: Mapping[str, str]
    ) -> List[_Alternative]:
        literal = _substituted(form, objects)
        if is_comparison(form):
            heads = (form.head,) if holds else _CONTRARY[form.head]
            return [((), (list_form(form.place, each, *literal.parts[1:]),)) for each in heads]
        ends = [part.text for part in literal.parts[1:]]
        if form.head == "=" and len(ends) == 2 and ends[0] == ends[1]:
            return _TRUE if holds else _FALSE
        if not any(text.startswith("?") for text in ends):
            if form.head == "=":
                return _FALSE if holds else _TRUE
            if form.head in self._static:
                return _TRUE if (literal.text in self._facts) == holds else _FALSE
        return [((), (literal if holds else list_form(form.place, "not", literal),))]


def _changed(effect: PddlPart) -> Iterator[str]:
    """Yields the predicates that an effect changes; those that it reads are not among them."""
    if isinstance(effect, ListForm):
        yield effect.head
        for part in effect.parts[2 if effect.head == "when" else 1 :]:
            yield from _changed(part)


def _product(
    left: Sequence[_Alternative], right: Sequence[_Alternative], form: ListForm
) -> List[_Alternative]:
    """Returns the alternatives by which two conditions hold."""
    if len(left) * len(right) > 100 * _MOST:
        raise _too_many(form)
    return _joined(
        [
            ((*more, *variables), tuple({each.text: each for each in (*own, *literals)}.values()))
            for more, own in left
            for variables, literals in right
        ],
        form,
    )


def _joined(found: Sequence[_Alternative], form: ListForm) -> List[_Alternative]:
    """Leaves out alternatives that contradict themselves, or that need more than another one."""
    kept: List[Tuple[FrozenSet[str], int]] = []
    for number in sorted(range(len(found)), key=lambda each: len(found[each][1])):
        texts = frozenset(each.text for each in found[number][1])
        if any(f"(not {text})" in texts for text in texts):
            continue
        if not any(other <= texts for other, _ in kept):
            kept.append((texts, number))
    if len(kept) > _MOST:
        raise _too_many(form)
    return [found[number] for number in sorted(number for _, number in kept)]


def _too_many(form: ListForm) -> PddlError:
    return PddlError(f"{form.place}: {shorten(form.text)} has more than {_MOST} alternatives: say "
                     "them by several actions, or by facts")  # fmt: skip


def _is_complex(form: ListForm) -> bool:
    """Whether a condition is more than a conjunction of literals."""
    negated = [f.parts[1] for f in form.forms() if f.head == "not" and len(f.parts) == 2]
    return any(each.head in ("or", "exists", "imply", "forall") for each in form.forms()) or any(
        isinstance(each, ListForm) and (each.head in _COMPOUND or is_comparison(each))
        for each in negated
    )


def _formula(part: PddlPart) -> ListForm:
    if isinstance(part, Word):
        raise PddlError(f"{part.place}: {shorten(part.text)} is not in parentheses")
    if part.head in ("when", "preference", *CHANGES):
        raise PddlError(f"{part.place}: {part.head} in a condition is not understood")
    return part


def _formulas(form: ListForm, count: int = -1) -> List[ListForm]:
    if count >= 0 and len(form.parts) != count + 1:
        raise PddlError(f"{form.place}: {form.head} has {count} part{'s' * (count > 1)}, and this "
                        f"has {len(form.parts) - 1}")  # fmt: skip
    return [_formula(part) for part in form.parts[1:]]


def _either(form: ListForm) -> Tuple[str, ...]:
    """Returns the types of ``(either ...)``."""
    if form.head != "either" or len(form.parts) < 2:
        raise PddlError(f"{form.place}: {shorten(form.text)} is not understood: there can be a "
                        "type, or (either TYPE...)")  # fmt: skip
    return tuple(part.text for part in form.parts[1:])


def _one_type_each(variables: ListForm) -> Iterator[ListForm]:
    """Yields lists of variables that have one type each, one for each choice of types."""
    choices = [
        _either(part) if isinstance(part, ListForm) else (part.text,) for part in variables.parts
    ]
    for chosen in itertools.product(*choices):
        yield list_form(variables.place, *chosen)


def _plain_types(form: ListForm) -> ListForm:
    parts = [
        Word("object", part.place) if isinstance(part, ListForm) and part.head == "either" else part
        for part in form.parts
    ]
    return list_form(form.place, *parts)


def _ended(parameters: Sequence[PddlPart]) -> Sequence[PddlPart]:
    """Returns variables of which the last ones have a type, so that others may follow."""
    if not parameters or (len(parameters) > 1 and parameters[-2].text == "-"):
        return parameters
    place = parameters[-1].place
    return (*parameters, Word("-", place), Word("object", place))


def _substituted(form: ListForm, objects: Mapping[str, str]) -> ListForm:
    parts = [
        _substituted(part, objects)
        if isinstance(part, ListForm)
        else Word(objects.get(part.text, part.text), part.place)
        for part in form.parts
    ]
    return list_form(form.place, *parts)


def _mapped(form: ListForm, change: Callable[[ListForm], ListForm]) -> ListForm:
    parts = [change(part) if isinstance(part, ListForm) else part for part in form.parts]
    return list_form(form.place, *parts)


def _extended(form: ListForm, head: str, more: Sequence[ListForm]) -> ListForm:
    """Returns a form with something added to its sections of a name."""
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
