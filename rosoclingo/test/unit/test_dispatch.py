"""Methods that are called by terms."""

from __future__ import annotations

from typing import Any, List

import pytest
from clingo import Symbol

from rosclingo.solver.terms import parse_term
from rosoclingo.loop.mode.dispatch import DispatchError, bind, find


class Base:
    def own(self) -> str:
        return "own"


class Robot(Base):
    speed = 3

    def __init__(self) -> None:
        self.field = print

    def go(self, place: Symbol, *rest: Symbol) -> List[str]:
        return [str(place), *map(str, rest)]

    def pass_(self) -> str:
        return "passed"

    def own_(self) -> str:
        return "not of the base"

    def fail(self) -> None:
        raise TypeError("fail() takes 0 positional arguments but 1 was given")

    def _private(self) -> None: ...


def call(term: str, **keywords: Any) -> Any:
    return bind(Robot(), parse_term(term), "action", **keywords)()


def test_methods_are_called_with_the_arguments() -> None:
    assert call("go(c3)") == ["c3"]
    assert call("go(c(3),(1,2))") == ["c(3)", "(1,2)"]
    assert call("go(1,2)", value=lambda symbol: symbol.number + 1) == ["2", "3"]
    assert call("pass") == "passed"
    assert call("own") == "own"
    assert call("own", base=Base) == "not of the base"


@pytest.mark.parametrize(
    "term", ["fly", "-go(c3)", "(go,c3)", "3", '"go"', "_private", "__init__", "speed", "field"]
)
def test_there_is_no_such_method(term: str) -> None:
    assert find(Robot(), parse_term(term)) is None
    with pytest.raises(DispatchError, match=r"Robot has fail, go, own, own_, pass_$") as caught:
        call(term)
    assert f"there is no method for the action {term}:" in str(caught.value)


@pytest.mark.parametrize("term", ["go", "pass(1)", "fail(1)"])
def test_other_arguments(term: str) -> None:
    name = term.partition("(")[0]
    with pytest.raises(DispatchError, match=rf"does not fit the method {name}_?\(") as caught:
        call(term)
    assert f"the action {term} " in str(caught.value)


def test_an_error_inside_the_method_is_its_own() -> None:
    with pytest.raises(TypeError, match="1 was given"):
        call("fail")
