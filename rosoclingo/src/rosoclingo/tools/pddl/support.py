"""Refuses unsupported PDDL, by its name, file and line."""

from __future__ import annotations

from typing import Dict, FrozenSet, Iterator, List, Tuple, Union

from rosclingo.errors import shorten
from rosoclingo.tools.pddl.expressions import ListForm, PddlError, Word

PddlPart = Union[Word, ListForm]

_REQUIREMENTS = frozenset(
    (":strips", ":typing", ":negative-preconditions", ":equality", ":conditional-effects",
     ":action-costs", ":numeric-fluents", ":durative-actions", ":derived-predicates")
)  # fmt: skip

# What many domains say and do not use; if they do, that is refused.
_HARMLESS = frozenset(
    (":adl", ":fluents", ":disjunctive-preconditions", ":existential-preconditions",
     ":universal-preconditions", ":quantified-preconditions", ":duration-inequalities")
)  # fmt: skip

_SECTIONS = {
    "domain": frozenset(
        ("domain", ":requirements", ":types", ":constants", ":predicates", ":functions",
         ":action", ":durative-action", ":derived")
    ),
    "problem": frozenset(
        ("problem", ":domain", ":requirements", ":objects", ":init", ":goal", ":metric")
    ),
}  # fmt: skip
DERIVED = ":derived"
_REPEATED = (":action", ":durative-action", DERIVED)
COMPARISONS = ("<", "<=", ">=", ">")
CHANGES = ("increase", "decrease", "assign")
_CONNECTIVES = {
    ":precondition": frozenset(("and", "not", "=", *COMPARISONS)),
    ":effect": frozenset(("and", "not", "when", "forall", *CHANGES)),
    ":goal": frozenset(("and", "not", "=", *COMPARISONS)),
    DERIVED: frozenset(("and", "not", "=", *COMPARISONS)),
}
_WITHIN = {  # in which there are no numbers
    ":precondition": "a condition of when, or of not",
    ":effect": "an effect of when or forall",
    ":goal": "not",
    DERIVED: "not",
}
_RESERVED = frozenset(
    ("and", "not", "=", "when", "forall", "exists", "or", "imply", *COMPARISONS, *CHANGES,
     "scale-up", "scale-down", "at start", "at end", "over", "either",
     "preference", "sometime", "always", "within", "at-most-once", "probabilistic", "oneof")
)  # fmt: skip


def sections(form: ListForm, kind: str) -> Dict[str, ListForm]:
    """Returns the sections of a domain or a problem by their names, without actions and rules.

    Raises:
        PddlError: It has others; the message names them, with file and line.
    """
    if form.head != "define":
        raise PddlError(f"{form.place}: a {kind} begins with (define ({kind} NAME)")
    if len(form.parts) < 2 or not isinstance(form.parts[1], ListForm) or form.parts[1].head != kind:
        raise PddlError(f"{form.place}: this is no {kind}: (define ({kind} NAME) is missing")
    found: Dict[str, ListForm] = {}
    for part in form.parts[1:]:
        if isinstance(part, Word):
            raise PddlError(f"{part.place}: {shorten(part.text)} is not in parentheses")
        known = _SECTIONS[kind]
        if part.head not in known:
            raise not_understood(part.place, part.head or "a section without a name", known)
        if part.head in found:
            raise PddlError(f"{part.place}: {part.head} is there twice")
        if part.head == ":requirements":
            _check_requirements(part)
        if part.head not in _REPEATED:
            found[part.head] = part
    return found


def _check_requirements(section: ListForm) -> None:
    for part in section.parts[1:]:
        if isinstance(part, ListForm):
            raise PddlError(f"{part.place}: a requirement is a word, such as :strips")
        if part.text not in _REQUIREMENTS | _HARMLESS:
            raise not_understood(part.place, part.text, _REQUIREMENTS)


def check_formula(part: PddlPart, where: str, *, within: bool = False) -> None:
    """Checks a condition, an effect or a goal.

    Args:
        part: All of it.
        where: ``:precondition``, ``:effect``, ``:goal`` or ``:derived``.
        within: Whether it is a part of something in which there are no numbers.

    Raises:
        PddlError: It has something that is not understood.
    """
    if isinstance(part, Word):
        raise PddlError(f"{part.place}: {shorten(part.text)} is not in parentheses")
    allowed = _CONNECTIVES[where]
    if part.head in _RESERVED and part.head not in allowed:
        raise not_understood(part.place, f"{part.head} in {where}", allowed)
    inner = part.parts[1:]
    if is_comparison(part) or is_change(part):
        if within:
            raise PddlError(f"{part.place}: {part.head} in {_WITHIN[where]} is not understood")
        if len(inner) != 2:
            raise PddlError(f"{part.place}: {part.head} has two parts, and this has {len(inner)}")
    elif part.head == "and":
        for each in inner:
            check_formula(each, where, within=within)
    elif part.head == "not":
        if len(inner) != 1:
            raise PddlError(f"{part.place}: not has one part, and this has {len(inner)}")
        check_formula(inner[0], where, within=True)
    elif part.head == "when":
        if len(inner) != 2:
            raise PddlError(f"{part.place}: when has a condition and an effect")
        check_formula(inner[0], ":precondition", within=True)
        check_formula(inner[1], where, within=True)
    elif part.head == "forall":
        if len(inner) != 2:
            raise PddlError(f"{part.place}: forall has variables and an effect")
        check_formula(inner[1], where, within=True)
    else:
        _check_atom(part)


def formula(part: PddlPart) -> ListForm:
    """Checks that a part of a condition is a condition, and returns it.

    Raises:
        PddlError: It is none.
    """
    if isinstance(part, Word):
        raise PddlError(f"{part.place}: {shorten(part.text)} is not in parentheses")
    if part.head in ("when", "preference", *CHANGES):
        raise PddlError(f"{part.place}: {part.head} in a condition is not understood")
    return part


def formulas(form: ListForm, count: int = -1) -> List[ListForm]:
    """Returns the parts of a condition.

    Args:
        form: The condition.
        count: The number of parts that it needs to have; -1 for any.

    Raises:
        PddlError: It has another number of parts, or one that is no condition.
    """
    if count >= 0 and len(form.parts) != count + 1:
        raise PddlError(f"{form.place}: {form.head} has {count} part{'s' * (count > 1)}, and this "
                        f"has {len(form.parts) - 1}")  # fmt: skip
    return [formula(part) for part in form.parts[1:]]


def quantified(form: ListForm) -> Tuple[ListForm, ListForm]:
    """Returns the variables and the condition of a quantified condition.

    Raises:
        PddlError: Its parts are others.
    """
    inner = form.parts[1:]
    if len(inner) != 2 or not isinstance(inner[0], ListForm):
        raise PddlError(f"{form.place}: {form.head} has variables and a condition")
    return inner[0], formula(inner[1])


def is_comparison(form: ListForm) -> bool:
    """Tells whether a condition compares numbers."""
    return form.head in COMPARISONS or (form.head == "=" and any(form.lists()))


def is_change(form: ListForm) -> bool:
    """Tells whether an effect changes a number."""
    return form.head in CHANGES


def changed_atoms(effect: ListForm) -> Iterator[ListForm]:
    """Yields the atoms that an effect changes; those that it reads are not among them."""
    if is_change(effect):
        return
    inner = effect.parts[2 if effect.head in ("when", "forall") else 1 :]
    parts = [part for part in inner if isinstance(part, ListForm)]
    for part in parts:
        yield from changed_atoms(part)
    if effect.parts and not parts and effect.head not in ("and", "not", "when", "forall"):
        yield effect


def _check_atom(part: ListForm) -> None:
    if not part.head:
        raise PddlError(f"{part.place}: a predicate is expected in {shorten(part.text)}")
    for each in part.lists():
        raise PddlError(f"{each.place}: {shorten(each.text)} is not understood: {part.head} has "
                        "names of objects and variables")  # fmt: skip


def not_understood(place: str, name: str, known: FrozenSet[str]) -> PddlError:
    """Returns the error for an unsupported construct, with alternatives."""
    return PddlError(
        f"{place}: {shorten(name)} is not understood: there can be {', '.join(sorted(known))}"
    )
