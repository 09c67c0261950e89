"""Words that TAB offers in bash, of an encoding and of a system, quoted so that nothing runs."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import List, Sequence, Tuple

import pytest
from hypothesis import given
from hypothesis import strategies as st
from waiting import wait_for

from rosclingo.solver.about import about
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import parse_options
from rosclingo.solver.programs import Program
from rosoclingo.encodings.about import Launched
from rosoclingo.encodings.known import read_encoding
from rosoclingo.tools.completion.questions import question_words
from rosoclingo.tools.completion.shell_line import parse_shell_line

LINE = Path(__file__).resolve().parents[2] / "example" / "line.lp"
BREAKS = " \t\n\"'><=;|&(:"  # bash's own
HOSTILE = [
    'say("$(touch x)")', 'say("`touch x`")', "say(\"it's\")", 'say("a b")', 'say("!!")',
    'say("\\\\")', 'say("\\"")', 'say(";&|<>*?~#")', "-1", "visit(3)",
]  # fmt: skip


def launched(file: Path) -> Launched:
    """How a planner says that it was started."""
    arguments = ["-f", str(file)]
    engine = Engine(parse_options(arguments))
    said = about("rosclingo run.py", arguments, engine.program)
    return Launched.decode("/planner", said)


def test_hostile_names_of_an_encoding(tmp_path: Path) -> None:
    text = """#program base. rslot(1). text("$(touch x)"; "it's"; "a b").
        #program state(t). #external event(1,say(T),t) : text(T).
        #external event((info;goal),heard(T),t) : text(T). #external event(info,passed,t).
        #program query(t). #external query(t)."""
    file = tmp_path / "hostile.lp"
    file.write_text(text)
    known = read_encoding(launched(file))
    texts = ('"$(touch x)"', '"it\'s"', '"a b"')
    assert set(known.requests) == {f"say({text})" for text in texts}
    assert set(known.messages) == {f"{who}:heard({t})" for t in texts for who in ("info", "(goal)")}


def test_the_process_that_reads_ends_with_whoever_has_started_it(tmp_path: Path) -> None:
    file = tmp_path / "slow.lp"
    file.write_text(
        "a :- X = 1..100000, Y = 1..100000, X*Y < 0.\n#program query(t). #external query(t)."
    )
    program = (
        "import sys; from rosoclingo.encodings.about import Launched\n"
        "from rosoclingo.encodings.known import read_encoding\n"
        "read_encoding(Launched.decode('/planner', sys.argv[1]))"
    )
    loaded = Program(texts={str(file): file.read_text()}, named=[str(file)])
    text = about("rosclingo run.py", ["-f", str(file)], loaded)
    with subprocess.Popen([sys.executable, "-c", program, text]) as reader:
        wait_for(lambda: any(map(grounds, children(reader.pid))))
        (process,) = children(reader.pid)
        reader.kill()
    wait_for(lambda: not grounds(process))


def children(pid: int) -> List[int]:
    """Returns the processes that a process has started."""
    return list(map(int, Path(f"/proc/{pid}/task/{pid}/children").read_text().split()))


def grounds(pid: int) -> bool:
    """Tells if a process runs that reads an encoding, and has its limit."""
    try:
        limits = Path(f"/proc/{pid}/limits").read_text()
        return (
            "encodings.grounding" in Path(f"/proc/{pid}/cmdline").read_text()
            and re.search(r"Max cpu time +60 ", limits) is not None
        )
    except OSError:
        return False


@pytest.mark.parametrize(
    ("words", "begun", "offered"),
    [
        ([], "--", ["--goal", "--action", "--instead", "--if", "--happened", "--json", "--help"]),
        (["--goal"], "", ["1", "visit(3)"]),
        ([], "--goal=", ["--goal=1", "--goal=visit(3)"]),
        (["--action"], "do(", ["do(robot,go(2),1)"]),
        (["--if"], "", []),
        (
            ["--goal", "1"],
            "",
            ["--goal", "--action", "--instead", "--if", "--happened", "--json", "--help"],
        ),
    ],
)
def test_words_of_questions(words: List[str], begun: str, offered: Sequence[str]) -> None:
    known = {"--goal": ["1", "visit(3)"], "--action": ["do(robot,go(2),1)"]}
    assert list(question_words(words, begun, lambda option: known[option])) == offered


@pytest.mark.parametrize(
    ("line", "words", "begun", "kept"),
    [
        ("a b ", ("a", "b"), "", 0),
        ("a --if goal:vi", ("a", "--if"), "goal:vi", 5),
        ("a --goal=vi", ("a",), "--goal=vi", 7),
        ("a 'x y' \"z\\\"", ("a", "x y"), 'z"', 0),
        ("a vis\\(3", ("a",), "vis(3", 0),
        ("a 'goal:vi", ("a",), "goal:vi", 0),
        ("a ''", ("a",), "", 0),
        ("a '' ", ("a", ""), "", 0),
        ("a \\", ("a",), "", 0),
    ],
)
def test_a_line_is_parsed(line: str, words: Tuple[str, ...], begun: str, kept: int) -> None:
    typed = parse_shell_line(line, BREAKS)
    assert (typed.words, typed.begun, typed.kept) == (words, begun, kept)


@pytest.mark.parametrize("word", HOSTILE)
@pytest.mark.parametrize("quote", ["", "'", '"'])
def test_bash_takes_what_is_inserted_for_text(word: str, quote: str, tmp_path: Path) -> None:
    (inserted,) = parse_shell_line(f"x {quote}", BREAKS).insertions([word])
    said = subprocess.check_output(
        ["bash", "-c", f"printf %s {quote}{inserted}{quote}"], text=True, cwd=tmp_path
    )
    assert said == word
    assert not list(tmp_path.iterdir())


@given(st.text("ab'\"\\$`!: (),;", max_size=8), st.sampled_from(["", "'", '"']))
def test_what_is_inserted_is_read_back(word: str, quote: str) -> None:
    (inserted,) = parse_shell_line(f"x {quote}", BREAKS).insertions([word])
    assert parse_shell_line(f"x {quote}{inserted}", BREAKS).begun == word
    assert parse_shell_line(f"x {quote}{inserted}{quote} ", BREAKS).words == ("x", word)


def test_nothing_is_offered_that_a_terminal_would_take_for_commands() -> None:
    assert parse_shell_line("x ", BREAKS).insertions(['say("\x1b[2J")', "a\nb"]) == []
