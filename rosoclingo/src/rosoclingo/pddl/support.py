"""Refuses what the import of PDDL does not understand, by its name, file and line."""

from __future__ import annotations

from typing import FrozenSet, Tuple

from rosclingo.errors import shorten
from rosoclingo.pddl.expressions import Form, PddlError, Word

REQUIREMENTS = frozenset(
    (":strips", ":typing", ":negative-preconditions", ":equality", ":conditional-effects",
     ":action-costs")
)  # fmt: skip
"""The requirements whose constructs are understood."""

_DOMAIN_SECTIONS = frozenset(
    ("domain", ":requirements", ":types", ":constants", ":predicates", ":functions", ":action")
)
_PROBLEM_SECTIONS = frozenset(
    ("problem", ":domain", ":requirements", ":objects", ":init", ":goal", ":metric")
)
_ACTION_PARTS = (":parameters", ":precondition", ":effect")
_CONNECTIVES = {
    ":precondition": frozenset(("and", "not", "=")),
    ":effect": frozenset(("and", "not", "when", "forall", "increase")),
    ":goal": frozenset(("and", "not", "=")),
}
_RESERVED = frozenset(
    ("and", "not", "=", "when", "forall", "exists", "or", "imply", "increase", "decrease", "assign",
     "scale-up", "scale-down", "<", ">", "<=", ">=", "at start", "at end", "over", "either",
     "preference", "sometime", "always", "within", "at-most-once", "probabilistic", "oneof")
)  # fmt: skip


def check_domain(domain: Form) -> None:
    """Checks that a domain has nothing but what is understood.

    Raises:
        PddlError: It has; the message names it, with file and line.
    """
    _check_sections(domain, "domain", _DOMAIN_SECTIONS)
    for section in _sections(domain):
        if section.head == ":action":
            _check_action(section)


def check_problem(problem: Form) -> None:
    """Checks a problem likewise."""
    _check_sections(problem, "problem", _PROBLEM_SECTIONS)
    for section in _sections(problem):
        if section.head == ":goal":
            for part in section.parts[1:]:
                _check_formula(part, ":goal")


def _sections(form: Form) -> Tuple[Form, ...]:
    return tuple(part for part in form.parts[1:] if isinstance(part, Form))


def _check_sections(form: Form, kind: str, known: FrozenSet[str]) -> None:
    if form.head != "define":
        raise PddlError(f"{form.place}: a {kind} begins with (define ({kind} NAME)")
    sections = _sections(form)
    if not sections or sections[0].head != kind:
        raise PddlError(f"{form.place}: this is no {kind}: (define ({kind} NAME) is missing")
    for part in form.parts[1:]:
        if isinstance(part, Word):
            raise PddlError(f"{part.place}: {shorten(part.text)} is not in parentheses")
        if part.head not in known:
            raise _not_understood(part.place, part.head or "a section without a name", known)
        if part.head == ":requirements":
            _check_requirements(part)


def _check_requirements(section: Form) -> None:
    for part in section.parts[1:]:
        if isinstance(part, Form):
            raise PddlError(f"{part.place}: a requirement is a word, such as :strips")
        if part.text not in REQUIREMENTS:
            raise _not_understood(part.place, part.text, REQUIREMENTS)


def _check_action(action: Form) -> None:
    if len(action.parts) < 2 or not isinstance(action.parts[1], Word):
        raise PddlError(f"{action.place}: this action has no name")
    keys, values = action.parts[2::2], action.parts[3::2]
    for number, key in enumerate(keys):
        if not isinstance(key, Word):
            raise PddlError(f"{key.place}: one of {', '.join(_ACTION_PARTS)} is expected here")
        if key.text not in _ACTION_PARTS:
            raise _not_understood(key.place, key.text, frozenset(_ACTION_PARTS))
        if number >= len(values):
            raise PddlError(f"{key.place}: nothing follows {key.text}")
        if key.text in _CONNECTIVES:
            _check_formula(values[number], key.text)


def _check_formula(part: object, where: str) -> None:
    if isinstance(part, Word):
        raise PddlError(f"{part.place}: {shorten(part.text)} is not in parentheses")
    assert isinstance(part, Form)
    allowed = _CONNECTIVES[where]
    if part.head in _RESERVED and part.head not in allowed:
        raise _not_understood(part.place, f"{part.head} in {where}", allowed)
    if part.head == "and":
        for inner in part.parts[1:]:
            _check_formula(inner, where)
    elif part.head == "not":
        if len(part.parts) != 2:
            raise PddlError(f"{part.place}: not has one part, and this has {len(part.parts) - 1}")
        _check_formula(part.parts[1], where)
    elif part.head == "when":
        if len(part.parts) != 3:
            raise PddlError(f"{part.place}: when has a condition and an effect")
        _check_formula(part.parts[1], ":precondition")
        _check_formula(part.parts[2], where)
    elif part.head == "forall":
        if len(part.parts) != 3:
            raise PddlError(f"{part.place}: forall has variables and an effect")
        _check_formula(part.parts[2], where)
    elif part.head == "increase":
        _check_increase(part)


def _check_increase(form: Form) -> None:
    target = form.parts[1] if len(form.parts) == 3 else None
    if not isinstance(target, Form) or target.head != "total-cost":
        raise PddlError(f"{form.place}: only (increase (total-cost) AMOUNT) is understood")


def _not_understood(place: str, name: str, known: FrozenSet[str]) -> PddlError:
    return PddlError(
        f"{place}: {shorten(name)} is not understood: there can be {', '.join(sorted(known))}"
    )
