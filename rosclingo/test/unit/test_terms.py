"""Text to ground terms."""

from __future__ import annotations

import contextlib
import operator
import re
from typing import Any, Callable, Dict, Tuple

import clingo
import pytest
from clingo import Function, Number, String
from hypothesis import given
from hypothesis import strategies as st
from symbols import GROUND

from rosclingo.errors import TermError
from rosclingo.solver.terms import parse_term, quote


@pytest.mark.parametrize(
    ("text", "term"),
    [
        ("a", Function("a")),
        ("a()", Function("a")),
        (
            'f(not_,"not",_not,knot,not\')',
            Function(
                "f",
                [
                    Function("not_"),
                    String("not"),
                    Function("_not"),
                    Function("knot"),
                    Function("not'"),
                ],
            ),
        ),
        (" a\n", Function("a")),
        ("_x'", Function("_x'")),
        ("-a", Function("a", [], False)),
        ("-f(1)", Function("f", [Number(1)], False)),
        ("f(a,-1)", Function("f", [Function("a"), Number(-1)])),
        (
            "event(commit,do(arm,pickup(4)),1)",
            Function(
                "event",
                [
                    Function("commit"),
                    Function("do", [Function("arm"), Function("pickup", [Number(4)])]),
                    Number(1),
                ],
            ),
        ),
        ("(1,a)", Function("", [Number(1), Function("a")])),
        ("(1,)", Function("", [Number(1)])),
        ("()", Function("", [])),
        ("0", Number(0)),
        ("2147483647", Number(2**31 - 1)),
        ("-2147483647", Number(-(2**31) + 1)),
        ("0x7fffffff", Number(2**31 - 1)),
        ("2+3*4", Number(14)),
        ("7/2", Number(3)),
        ("7\\2", Number(1)),
        ("2**10", Number(1024)),
        ("32768*65535+32767", Number(2**31 - 1)),
        ("-2**3**2", Number(-512)),
        ("-7/2", Number(-3)),
        ("-7\\2", Number(-1)),
        ("6&3", Number(2)),
        ("6?3", Number(7)),
        ("6^3", Number(5)),
        ("~6", Number(-7)),
        ("0**2147483647", Number(0)),
        ("1" + "+1" * 4000, Number(4001)),
        ("|-3|", Number(3)),
        ("#inf", clingo.Infimum),
        ("#sup", clingo.Supremum),
        ('""', String("")),
        ('"a b"', String("a b")),
        ('"Tür €5 😀"', String("Tür €5 😀")),
        ('"\\"\\\\\\n"', String('"\\\n')),
        ('"12345678901234567890"', String("12345678901234567890")),
        ("a12345678901234567890", Function("a12345678901234567890")),
        ('f("((((","%*")', Function("f", [String("(((("), String("%*")])),
    ],
)
def test_accepted(text: str, term: clingo.Symbol) -> None:
    assert parse_term(text) == term


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "it is empty"),
        (" \t\n", "it is empty"),
        ("\0", "NUL"),
        ("a\0", "NUL"),
        ('"a\0b"', "NUL"),
        ("X", "X begins a variable"),
        ("f(a,Xy)", "X begins a variable"),
        ("_", "_ begins a variable"),
        ("f(_Xy)", "_ begins a variable"),
        ("a b", "unexpected <IDENTIFIER>"),
        ("a,b", 'unexpected ","'),
        ("1 2", "unexpected <NUMBER>"),
        ("a.", "unexpected token: ."),
        ("a;b", "unexpected token: ;"),
        ("f(1;2)", "unexpected token: ;"),
        ("1..3", "unexpected token: ."),
        ("not a", "not is no name"),
        ("(not,-a)", "not is no name"),  # clingo parses this as a term, and in no program
        ("f(1,not(2))", "not is no name"),
        ("@f()", "unexpected token: @"),
        ("#true", "unexpected token: #"),
        ("a % b", "unexpected token: %"),
        ("f(", "unexpected <EOF>"),
        ("f)", "unexpected )"),
        ('"a', 'unexpected token: "'),
        ('"a\nb"', 'unexpected token: "'),
        ("\x01", "unexpected token"),
        ("ä", "other than ASCII"),
        ("f(ä)", "other than ASCII"),
        ("\ufeffa", "other than ASCII"),
        ("\ud800", "not valid Unicode"),
        ('"\udfff"', "not valid Unicode"),
        ("2147483648", "larger than 2147483647"),
        ("-2147483648", "larger than 2147483647"),
        ("f(99999999999999999999)", "larger than 2147483647"),
        ('f("a",99999999999)', "larger than 2147483647"),
        ("7/12345678901", "larger than 2147483647"),
        ("1/0", "division by"),
        ("f(1/(1-1))", "division by"),
        ("f(65536*65536+3)", "(65536*65536) is no whole number from -2147483647"),
        ("2147483647+1-1", "(2147483647+1) is no"),
        ("-2147483647-2", "(-2147483647-2) is no"),
        ("2**31", "(2**31) is no"),
        ("f(a,(-2)**2147483647)", "(-2**2147483647) is no"),
        ("2**-1", "(2**-1) is no"),
        ("0**-1", "(0**-1) is no"),
        ("~2147483647", "~2147483647 is no"),
        ("|-2147483647-1|", "(-2147483647-1) is no"),
        ("46341*46341/46341", "(46341*46341) is no"),
        ('f("1+1",46341*46341)', "(46341*46341) is no"),
        ("1" + "*2" * 4000, "arithmetic overflow"),
        ("a+1", "not defined"),
        ('-"a"', "not defined"),
        ("f(" * 100_000, "nests deeper than 5000"),
        ("-" * 100_000 + "1", "nests deeper than 5000"),
        ("1" + "+1" * 100_000, "nests deeper than 5000"),
    ],
    ids=lambda text: ascii(text[:25]),
)
def test_refused(text: str, reason: str) -> None:
    with pytest.raises(TermError) as caught:
        parse_term(text)
    message = str(caught.value)
    assert reason in message
    assert message.startswith(quote(text))
    assert "\n" not in message


@pytest.mark.parametrize("text", ["0xFFFFFFFFFF", "0x80000000", "0b1" + "0" * 31, "0o40000000000"])
def test_a_number_in_another_base_that_is_too_large_is_refused(text: str) -> None:
    # clingo makes another number of it and says nothing.
    with pytest.raises(TermError, match="larger than 2147483647"):
        parse_term(text)


@pytest.mark.parametrize(
    "text",
    [
        "1\\0",
        "f(5\\(1-1))",
        "(-2147483647-1)/(-1)",
        "(-2147483647-1)\\(-1)",
        "(-2147483647-1)/4294967295",  # which is -1 to clingo
        "(-2147483647-1)\\ 4294967295",
    ],
)
def test_arithmetic_does_not_end_the_process(text: str, run_python: Callable[[str], str]) -> None:
    # The processor has no answer to these divisions and stops the process (SIGFPE).
    code = (
        "from rosclingo.errors import TermError\n"
        "from rosclingo.solver.terms import parse_term\n"
        f"try: print(parse_term({text!r}))\n"
        "except TermError: print('refused')"
    )
    assert run_python(code)


def test_open_strings_take_no_longer_than_closed_ones(run_python: Callable[[str], str]) -> None:
    # Hours, and no other thread runs, if what is behind each quote is read to the text's end.
    code = (
        "from rosclingo.errors import TermError\n"
        "from rosclingo.solver.terms import parse_term\n"
        "try: parse_term('\"' + '\\\\\"' * 1_000_000)\n"
        "except TermError as err: print(err)"
    )
    assert 'unexpected token: "' in run_python(code)


def test_a_long_term() -> None:
    # Long ones are not kept, so that what clients send cannot fill the memory.
    text = f"f({','.join(map(str, range(10_000)))})"
    assert len(parse_term(text).arguments) == 10_000
    assert parse_term(text) == parse_term(text)


def test_a_refused_term_stays_refused() -> None:
    for _ in range(2):
        with pytest.raises(TermError, match="variable"):
            parse_term("p(X)")


@given(GROUND)
def test_what_clingo_writes_is_read_back(term: clingo.Symbol) -> None:
    assert parse_term(str(term)) == term


_LARGEST = 2**31 - 1
_OPERATORS: Dict[str, Callable[..., Any]] = {
    "({}+{})": operator.add,
    "({}-{})": operator.sub,
    "({}*{})": operator.mul,
    "({}&{})": operator.and_,
    "({}?{})": operator.or_,
    "({}^{})": operator.xor,
    "-({})": operator.neg,
    "~({})": operator.invert,
    "|{}|": abs,
}
_Expression = Tuple[str, int, bool]  # with its exact value, and whether all in it fit into 32 bits


def _apply(form: str, left: _Expression, right: _Expression) -> _Expression:
    used = (left, right)[: form.count("{}")]
    value = _OPERATORS[form](*(value for _, value, _ in used))
    fits = all(one[2] for one in used) and abs(value) <= _LARGEST
    return form.format(*(text for text, _, _ in used)), value, fits


_EXPRESSIONS = st.recursive(
    (st.sampled_from([0, 1, 2, 46341, _LARGEST]) | st.integers(0, _LARGEST)).map(
        lambda number: (str(number), number, True)
    ),
    lambda parts: st.builds(_apply, st.sampled_from(sorted(_OPERATORS)), parts, parts),
    max_leaves=6,
)


@given(_EXPRESSIONS)
def test_arithmetic_is_exact_or_refused(expression: _Expression) -> None:
    text, value, fits = expression
    if fits:
        assert parse_term(text) == Number(value)
    else:
        with pytest.raises(TermError, match="arithmetic overflow"):
            parse_term(text)


# Without "\" and "/", which may end the process: see above.
@pytest.mark.costly
@given(st.text(max_size=20) | st.text("f(,)a1X_-+*.;:|\"'%@# \n\0", max_size=12))
def test_any_text_is_a_term_or_refused(text: str) -> None:
    with contextlib.suppress(TermError):
        assert isinstance(parse_term(re.sub(r"[/\\]", "", text)), clingo.Symbol)


def test_quote() -> None:
    assert quote("a\n\0") == "'a\\n\\x00'"
    assert quote("a" * 1000) == repr("a" * 150) + "... (1000 characters)"
