"""The text of terms, taken apart without clingo."""

from __future__ import annotations

from typing import Callable, List, Tuple

import clingo
import pytest
from hypothesis import given
from hypothesis import strategies as st
from symbols import GROUND

from rosclingo.solver.terms import parse_term
from rosclingo.wire.term_text import is_plain, last_number, number, split_list, split_term


@given(st.text("fa1_'(,)not ", max_size=12))
def test_a_plain_term_is_one_that_clingo_prints_so(text: str) -> None:
    if is_plain(text):
        assert str(parse_term(text)) == text


@pytest.mark.parametrize(
    "text", ["f", "0", "17", "_f'", "bring(o9,x17)", "f(g(1,a),h(_b'(2)),nota)", "not_(1)"]
)
def test_plain(text: str) -> None:
    assert is_plain(text)
    assert str(parse_term(text)) == text


@pytest.mark.parametrize(
    "text",
    [
        "",
        "not",
        "f(not)",
        "X",
        "f(X)",
        "01",
        "1a",
        "f()",
        "f(1)g(2)",
        "f(1)(2)",
        "f(1,)",
        "(1,2)",
        "-1",
        "f(1+1)",
        "f( 1)",
        '"a"',
        "\u00e4",
        "9" * 10,
        "a\n",
        "f(" * 11 + "1" + ")" * 11,
        "f(" + "a," * 500 + "a)",
    ],
)
def test_not_plain(text: str) -> None:
    assert not is_plain(text)


@pytest.mark.costly
@given(GROUND)
def test_a_term_of_clingo(term: clingo.Symbol) -> None:
    is_function = term.type is clingo.SymbolType.Function
    name, arguments = (term.name, term.arguments) if is_function else ("", [])
    sign = "-" if is_function and term.negative else ""
    assert split_term(str(term)) == (sign + name, [str(argument) for argument in arguments])
    is_number = term.type is clingo.SymbolType.Number
    assert number(str(term)) == (term.number if is_number else None)


@pytest.mark.costly
@given(st.lists(GROUND, max_size=4), st.sampled_from([",", ", "]))
def test_a_list_of_terms(terms: List[clingo.Symbol], comma: str) -> None:
    texts = [str(term) for term in terms]
    assert split_list(comma.join(texts)) == texts


@given(GROUND)
def test_the_last_number(term: clingo.Symbol) -> None:
    atom = clingo.Function("f", [clingo.Function("a"), term])
    is_number = term.type is clingo.SymbolType.Number
    assert last_number(str(atom)) == (term.number if is_number else None)


@given(st.text("fa1_-'\"\\(,)[] \n", max_size=12))
def test_any_text_is_read_as_far_as_it_goes(text: str) -> None:
    name, arguments = split_term(text)
    assert name in text
    assert all(part in text for part in (*arguments, *split_list(text)))


@pytest.mark.parametrize(
    ("text", "term"),
    [
        ("", ("", [])),
        ("f", ("f", [])),
        ("not", ("", [])),
        ("F(1)", ("", [])),
        ("f(1", ("", [])),
        ("f(1)x", ("", [])),
        ("(1,)", ("", ["1"])),
        ("((1,),2)", ("", ["(1,)", "2"])),
        ('f("),(")', ("f", ['"),("'])),
        ('f("\\"),(")', ("f", ['"\\"),("'])),
        ('f("a)', ("f", ['"a'])),
    ],
)
def test_special_terms(text: str, term: Tuple[str, List[str]]) -> None:
    assert split_term(text) == term


def test_open_strings_and_many_levels_take_no_longer(run_python: Callable[[str], str]) -> None:
    # Hours if what is behind each quote is read to the text's end.
    code = (
        "from rosclingo.wire.term_text import *\n"
        "split_list('\"' + '\\\\\"' * 1_000_000)\n"
        "print(len(split_term('f(' * 100_000 + ')' * 100_000)[1]))"
    )
    assert run_python(code).strip() == "1"


def test_clingo_is_not_needed(run_python: Callable[[str], str]) -> None:
    code = "import sys, rosclingo.wire.term_text; print('clingo' in sys.modules)"
    assert run_python(code).strip() == "False"
