"""Calls methods by terms: ``go(c3)`` calls the method ``go`` with ``c3``. Needs no ROS.

>>> from clingo import parse_term
>>> class Robot:
...     def go(self, place):
...         return f"on the way to {place}"
>>> bind(Robot(), parse_term("go(c3)"), "action")()
'on the way to c3'
"""

from __future__ import annotations

import inspect
from functools import lru_cache
from typing import Any, Callable, Optional

from clingo import Symbol, SymbolType

from rosclingo.errors import RosclingoError


class DispatchError(RosclingoError):
    """No method fits the name and arguments of a term."""


def find(owner: object, term: Symbol, base: type = object) -> Optional[Callable[..., Any]]:
    """Returns the method that a term names, or None.

    Methods that begin with an underscore are not found, nor by a term such as ``-go(c3)``,
    ``(a,b)`` or a number. If the name is a Python keyword, or one of the base class, the method has
    an underscore behind it: ``pass(c3)`` calls ``pass_``.

    Args:
        owner: Has the methods.
        term: Names one.
        base: Class of the owner whose methods are not found.
    """
    if term.type is SymbolType.Function and term.positive:
        for name in (term.name, f"{term.name}_"):
            if _is_found(owner, name, base):
                return getattr(owner, name)
    return None


def bind(
    owner: object,
    term: Symbol,
    kind: str,
    *,
    base: type = object,
    value: Callable[[Symbol], Any] = lambda argument: argument,
) -> Callable[[], Any]:
    """Returns the call that a term stands for.

    An error inside the method comes only when it is called, and so is never taken for another.

    Args:
        owner: Has the methods.
        term: Names one, and has its arguments.
        kind: What the term is, such as ``command``, for the error.
        base: Class of the owner whose methods are not called.
        value: What a method gets for an argument of the term.

    Raises:
        DispatchError: There is no such method, or not with these arguments.
    """
    method = find(owner, term, base)
    if method is None:
        known = ", ".join(name for name in dir(owner) if _is_found(owner, name, base)) or "none"
        raise DispatchError(
            f"there is no method for the {kind} {term}: {type(owner).__name__} has {known}"
        )
    arguments = [value(argument) for argument in term.arguments]
    try:
        if inspect.ismethod(method):
            _signature(method.__func__).bind(method.__self__, *arguments)
        else:
            _signature(method).bind(*arguments)
    except TypeError as err:
        raise DispatchError(
            f"the {kind} {term} does not fit the method {method.__name__}"
            f"{inspect.signature(method)}: {err}"
        ) from err
    return lambda: method(*arguments)


@lru_cache(maxsize=None)  # it takes longer than most calls
def _signature(function: Callable[..., Any]) -> inspect.Signature:
    return inspect.signature(function)


def _is_found(owner: object, name: str, base: type) -> bool:
    return (
        not name.startswith("_")
        and not hasattr(base, name)
        and callable(getattr(type(owner), name, None))
    )
