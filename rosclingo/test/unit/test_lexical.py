"""What is told about a text before clingo sees it, compared with what clingo makes of it."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import Callable, Iterator, List, Tuple

import pytest
from clingo import ast
from hypothesis import given, settings
from hypothesis import strategies as st

from rosclingo.errors import ProgramError
from rosclingo.solver.controls import ClingoMessages  # it makes clingo's logger bear any character
from rosclingo.solver.lexical import MAX_NESTING, blank_comments, depth, includes, script, too_deep

# --- includes --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The working directory, with a file to include."""
    path = tmp_path_factory.mktemp("lexical")
    (path / "x.lp").write_text("x.", encoding="utf-8")
    old = os.getcwd()
    os.chdir(path)
    yield path
    os.chdir(old)


def opened_by_clingo(text: str) -> bool:
    """Whether clingo, parsing the text, opens x.lp."""
    found: List[str] = []
    messages = ClingoMessages()
    with contextlib.suppress(RuntimeError):  # of what is no program, after the file was opened
        ast.parse_string(text, lambda s: found.append(s.location.begin.filename), logger=messages)
    said = messages.text()
    return (
        any(name.endswith("x.lp") for name in found)
        or "already included" in said
        or any(line.startswith("x.lp") for line in said.splitlines())
    )


def seen(text: str) -> bool:
    """Whether includes() sees x.lp, or refuses the text."""
    try:
        return "x.lp" in list(includes(text))
    except ProgramError:
        return True


TOKENS = [
    *("%*", "*%", "%", "%%", "**%", '"', '\\"', "\\", "*", "|", "'", "\n", " ", "a.", 'p("', '").'),
    *("#include", '#include "x.lp".', ' "x.lp".', '"x.lp"', "<x.lp>", "#script(python)", "#end."),
]


@pytest.mark.costly
@pytest.mark.usefixtures("folder")
def test_no_include_of_clingo_is_missed() -> None:
    opened = 0

    @settings(max_examples=1500)
    @given(st.lists(st.sampled_from(TOKENS), max_size=14).map("".join))
    def check(text: str) -> None:
        nonlocal opened
        if opened_by_clingo(text):
            opened += 1
            assert seen(text)

    check()
    assert opened > 50  # else the soup was too thin to show anything


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    "text",
    [
        '#include "x.lp".',
        '#include"x.lp".',
        '#include %* a *% "x.lp".',
        '#include % a\n "x.lp".',
        '%* %* *% *% #include "x.lp".',
        '"\n#include "x.lp".',
        'a("%*"). #include "x.lp".',
        '% "\n#include "x.lp".',
        '#script (python) %* #end. #include "x.lp".',
        '#script (python)\n#" #end. #include "x.lp". % "',
    ],
)
def test_what_clingo_includes(text: str) -> None:
    assert opened_by_clingo(text)
    assert seen(text)


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    "text",
    [
        'a("#include").',
        '% #include "x.lp".',
        '%* #include "x.lp". *% a.',
        'a("#include \\"x.lp\\"").',
    ],
)
def test_what_clingo_does_not_include(text: str) -> None:
    assert not opened_by_clingo(text)
    assert list(includes(text)) == []


def test_names_are_read_as_clingo_reads_them() -> None:
    text = '#include "a b.lp".\n#include "q\\"\\\\\\n".'
    assert list(includes(text)) == ["a b.lp", 'q"\\\n']
    with pytest.raises(ProgramError, match="line 2, column 2: #include needs a file"):
        list(includes("a.\n #include b.lp."))


@pytest.mark.parametrize("text", ["#include <incmode>.", "#include%**%\n< incmode >."])
def test_what_is_built_into_clingo_is_refused(text: str) -> None:
    # clingo's parser leaves it out and says nothing.
    with pytest.raises(ProgramError, match="there is no <incmode> here"):
        list(includes(text))


@given(st.text('%* \n"\\a', max_size=30))
def test_comments_become_nothing_else_than_nul_unless_clingo_refuses_the_text(text: str) -> None:
    try:
        blank = blank_comments(text)
    except ProgramError:
        with pytest.raises(RuntimeError):
            ast.parse_string(text, lambda _: None, logger=ClingoMessages())
        return
    assert len(blank) == len(text)
    assert all(new in (old, "\0") for old, new in zip(text, blank))
    assert [i for i, c in enumerate(blank) if c == "\n"] == [
        i for i, c in enumerate(text) if c == "\n"
    ]


# --- depth -----------------------------------------------------------------------------------

_LEVELS = (ast.ASTType.UnaryOperation, ast.ASTType.BinaryOperation, ast.ASTType.Interval)


def depth_of_tree(node: ast.AST) -> int:
    """Levels of brackets and operators that clingo's own syntax tree has."""
    deepest = 0
    for child in node.values():
        children = [child] if isinstance(child, ast.AST) else child
        if isinstance(children, (list, ast.ASTSequence)):
            deepest = max(
                [deepest, *(depth_of_tree(c) for c in children if isinstance(c, ast.AST))]
            )
    kind = node.ast_type
    own = kind in _LEVELS or (kind is ast.ASTType.Function and len(node.arguments) > 0)
    return deepest + int(own)


BLANK = st.sampled_from(["", "", "", " ", "\n", "%* ((( *%", "%* %* *% - *%", "% [{(\n"])
LEAF = st.sampled_from(["1", "a", "X", "_", '"(("', '"%*"', '"\\""', "#inf", "0x1"])


def _join(*parts: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    return st.tuples(*(part for one in parts for part in (one, BLANK))).map("".join)


def _compound(term: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    def word(text: str) -> st.SearchStrategy[str]:
        return st.just(text)

    operator = st.sampled_from(["+", "-", "*", "/", "\\", "**", "?", "^", "&", ".."])
    listed = st.lists(term, min_size=1, max_size=3)
    commas, pool = listed.map(",".join), listed.map(";".join)
    return st.one_of(
        _join(word("("), term, word(")")),
        _join(word("f("), commas, word(")")),
        _join(word("@f("), commas, word(")")),
        _join(word("("), commas, word(",)")),
        _join(word("("), pool, word(")")),
        _join(word("-"), term),
        _join(word("~"), term),
        _join(word("|"), term, word("|")),
        _join(term, operator, term),
    )


TERM = st.recursive(LEAF, _compound, max_leaves=12)


@pytest.mark.costly
@settings(max_examples=250)
@given(st.lists(TERM, min_size=1, max_size=3))
def test_depth_is_an_upper_bound(terms: List[str]) -> None:
    text = "".join(f"p({term})." for term in terms)
    statements: List[ast.AST] = []
    ast.parse_string(text, statements.append)
    rules = [s for s in statements if s.ast_type is ast.ASTType.Rule]
    assert len(rules) == len(terms)
    bound = depth(text)
    # Nothing in a string or comment counts, so there are no more levels than tokens.
    tokens = sum(blank_comments(text).count(c) for c in "([{+-*/\\?^&~|.@;")
    assert max(map(depth_of_tree, rules)) <= bound <= tokens


@pytest.mark.parametrize(
    ("text", "levels"),
    [
        ("", 0),
        ("a.", 0),
        ("a(1,2,3).", 1),
        ("a(b(c)).", 2),
        ("a(b,c(d),e(f)).", 2),
        ("a(b). a(b). a(b).", 1),
        ("a((((", 4),
        ("a(1+2+3).", 3),
        ("a(- - 1).", 3),
        ('a("((((").', 1),
        ("a. % ((((\n%* (((( *%", 0),
        (")))) a(b).", 1),
    ],
)
def test_depth(text: str, levels: int) -> None:
    assert depth(text) == levels


LEVELS = 100_000
DEEP: List[Tuple[str, str]] = [
    ("parentheses", "a" + "(" * LEVELS + "1" + ")" * LEVELS + "."),
    ("unclosed parentheses", "a" + "(" * LEVELS),
    ("brackets", "&t { " + "[" * LEVELS + "1" + "]" * LEVELS + " }."),
    ("braces", "&t { " + "{" * LEVELS + "1" + "}" * LEVELS + " }."),
    ("functions", "a(" + "f(" * LEVELS + "1" + ")" * LEVELS + ")."),
    ("functions, second argument", "a(" + "f(1," * LEVELS + "1" + ")" * LEVELS + ")."),
    ("pools", "a(" + "(1;" * LEVELS + "1" + ")" * LEVELS + ")."),
    ("tuples", "a(" + "(1," * LEVELS + "1" + ")" * LEVELS + ")."),
    ("external functions", "a(" + "@f(" * LEVELS + "1" + ")" * LEVELS + ")."),
    ("unary minus", "a(" + "-" * LEVELS + "1)."),
    ("unary minus with blanks", "a(" + "- " * LEVELS + "1)."),
    ("unary minus with comments", "a(" + "-%**%" * LEVELS + "1)."),
    ("complement", "a(" + "~" * LEVELS + "1)."),
    ("absolute value", "a(" + "|-" * LEVELS + "1" + "|" * LEVELS + ")."),
    ("sum", "a(1" + "+1" * LEVELS + ")."),
    ("power", "a(1" + "**1" * LEVELS + ")."),
    ("division", "a(1" + "\\1" * LEVELS + ")."),
    ("interval", "a(1" + "..1" * LEVELS + ")."),
    ("comparison", ":- 1" + "<1" * LEVELS + "."),
    ("theory term", "&t { 1" + " <+ 1" * LEVELS + " }."),
    ("sum in a body", "a :- b, X = 1" + "+1" * LEVELS + "."),
    ("after facts", "a. " * 10 + "a(" + "f(" * LEVELS + "1" + ")" * LEVELS + ")."),
    ("after a comment", "%* %* *% *% a(" + "f(" * LEVELS),
    # In a script, strings and comments are not what they are elsewhere.
    ("after a quote in a script", '#script (python)\n#" #end. a(' + "f(" * LEVELS + ')%"'),
    ("after a comment in a script", "#script (python)\n#%* #end. a(" + "f(" * LEVELS),
]


@pytest.mark.costly
@pytest.mark.parametrize("text", [text for _, text in DEEP], ids=[name for name, _ in DEEP])
def test_what_would_overflow_the_stack_is_refused(text: str) -> None:
    assert too_deep(text)


@pytest.mark.parametrize("begin", ['a(" ', 'a("\\"', 'a("\\t").', '%* *%" %'])
def test_a_string_that_does_not_end_is_refused_with_its_place(begin: str) -> None:
    for text in (begin + "f(" * LEVELS, "a.\n" * LEVELS + " " + begin):
        place = (
            f"line {text.count(chr(10)) + 1}, column {text.splitlines()[-1].index(chr(34)) + 1}:"
        )
        with pytest.raises(ProgramError, match=place):
            too_deep(text)


def test_scripts_outside_of_strings_and_comments() -> None:
    assert script('a. %* #script *% b("#script"). % #script\n') is None
    assert script("% #script\n a. #script") == 14
    with pytest.raises(ProgramError, match="line 1, column 3:"):
        script('a("\\". #script')


LARGE: List[Tuple[str, str]] = [
    ("facts without blanks", "".join(f"a({i})." for i in range(10_000))),
    ("facts without arguments", "a." * 10_000),
    ("negative facts", "".join(f"-a(-{i})." for i in range(10_000))),
    ("facts with intervals", "".join(f"a({i}..{i + 3})." for i in range(10_000))),
    ("pool", "a(" + ";".join(map(str, range(10_000))) + ")."),
    ("pool of negative numbers", "a(" + ";".join(f"-{i}" for i in range(10_000)) + ")."),
    ("pool of terms", "a(" + ";".join(f"f({i},-1)" for i in range(10_000)) + ")."),
    ("arguments", "a(" + ",".join(map(str, range(10_000))) + ")."),
    ("constraints", "".join(f":-a({i}),not b({i}+1)." for i in range(10_000))),
    ("rules, one a line", "\n".join(f"a(X+1) :- b(X), X < {i}." for i in range(10_000))),
    ("choice", "{" + ";".join(f"a({i}):b(-{i})" for i in range(10_000)) + "}."),
    ("string", 'a("' + "(" * 100_000 + '").'),
    ("comment", "%* " + "(" * 100_000 + " *% a. % " + "-" * 100_000 + "\n"),
    ("weak constraints", "".join(f":~a({i}).[{i}@1,{i}]" for i in range(10_000))),
]


@pytest.mark.parametrize("text", [text for _, text in LARGE], ids=[name for name, _ in LARGE])
def test_what_is_only_large_is_not_refused(text: str) -> None:
    assert not too_deep(text)


@pytest.mark.parametrize(
    "text", ["a(" + "f(" * 4_900 + "1" + ")" * 4_900 + ").", "a(" + "-" * 4_900 + "1)."]
)
def test_clingo_bears_what_is_not_refused(text: str, run_python: Callable[[str], str]) -> None:
    # MAX_NESTING must stay below what overflows the main thread's stack, in which files are loaded.
    assert MAX_NESTING - 200 < depth(text) <= MAX_NESTING
    code = (
        "from rosclingo.wire.commands import Add, Ground, Part\n"
        "from rosclingo.solver.engine import Engine\n"
        "from rosclingo.solver.options import Options\n"
        "engine = Engine(Options())\n"
        f"engine.apply(Add('p', (), {text!r})); engine.apply(Ground((Part('p'),)))\n"
        "print(engine.solve().result.value)"
    )
    assert run_python(code) == "sat"
