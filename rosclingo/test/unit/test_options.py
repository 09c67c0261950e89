"""The command line."""

from __future__ import annotations

from pathlib import Path
from typing import List, Tuple

import pytest

from rosclingo.errors import OptionsError
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import USAGE, Options, arguments, constants, mark_files, parse_options
from rosclingo.wire.commands import Ground, Part


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory, with encodings in it."""
    (tmp_path / "mailbot").mkdir()
    for name in ("a.lp", "b.lp", "mailbot.lp", "plain", "plain.lp"):
        (tmp_path / name).write_text("a(n).", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_constants_are_read() -> None:
    options = parse_options(["-c", "steps=7", "-t", "2", "-c", "at = f(a,b)"])
    assert constants(options.clingo) == {"steps": "7", "at": "f(a,b)"}
    assert constants(()) == {}
    assert constants(("-c", "r=1", "-c", "r=2")) == {"r": "2"}


@pytest.mark.parametrize(
    ("arguments", "files"),
    [
        ([], ()),
        (["-f", "a.lp"], ("a.lp",)),
        (["--file", "a.lp"], ("a.lp",)),
        (["--file=a.lp"], ("a.lp",)),
        (["-fa.lp"], ("a.lp",)),
        (["-f", "a"], ("a.lp",)),
        (["--file=a"], ("a.lp",)),
        (["-f", "b.lp", "--file", "a.lp", "-f", "b.lp"], ("b.lp", "a.lp", "b.lp")),
        # The manual names mailbot/mailbot, where there may be a folder of that name, too.
        (["-f", "mailbot"], ("mailbot.lp",)),
        (["-f", "plain"], ("plain",)),
    ],
)
def test_files(arguments: List[str], files: Tuple[str, ...]) -> None:
    assert parse_options(arguments) == Options(files=files)


@pytest.mark.parametrize("words", [["--theory", "dl"], ["--theory=dl"]])
def test_a_theory(words: List[str]) -> None:
    assert parse_options([*words, "-t", "2"]) == Options(clingo=("-t", "2"), theory="dl")
    assert list(arguments(words)) == [("--theory", "dl")]


def test_a_theory_without_a_name() -> None:
    with pytest.raises(OptionsError, match="option --theory needs a name"):
        parse_options(["--theory="])


def test_an_absolute_path(folder: Path) -> None:
    assert parse_options(["-f", str(folder / "a")]).files == (str(folder / "a.lp"),)


@pytest.mark.parametrize("argument", ["none", "none.lp", "", ".", "mailbot/none", "-"])
def test_a_missing_file(argument: str, folder: Path) -> None:
    with pytest.raises(OptionsError, match="there is no file") as caught:
        parse_options(["-f", argument])
    assert f"'{argument}'" in str(caught.value)
    assert str(folder) in str(caught.value)


def test_a_missing_file_next_to_others(folder: Path) -> None:
    (folder / "b.lp").write_text("")
    with pytest.raises(OptionsError, match=f"{folder} has .*b, .*; give one of these") as caught:
        parse_options(["-f", str(folder / "missing.lp")])
    assert "missing.lp" in str(caught.value)
    with pytest.raises(OptionsError, match="check the path"):
        parse_options(["-f", str(folder / "nowhere" / "missing.lp")])


@pytest.mark.parametrize("option", ["-f", "--file", "-c", "--const", "--theory"])
def test_a_missing_value(option: str) -> None:
    with pytest.raises(OptionsError, match=f"option {option} needs a value"):
        parse_options(["-f", "a.lp", option])


@pytest.mark.parametrize("option", ["-h", "--help"])
def test_help(option: str) -> None:
    assert parse_options(["-f", "a.lp", option, "-f"]).help
    for piece in ("-f FILE", "--file FILE", "--theory dl", "-h, --help", "-c NAME=TERM", "-t N"):
        assert piece in USAGE
    assert "~load_path" in USAGE


def test_all_else_is_for_clingo() -> None:
    arguments = ["-c", "max=14", "-t", "2", "-f", "a", "--opt-mode=optN", "-W", "none", "0"]
    options = parse_options(arguments)
    assert options.files == ("a.lp",)
    assert options.clingo == (*("-c", "max=14", "-t", "2", "--opt-mode=optN", "-W", "none", "0"),)


def test_a_file_without_its_option() -> None:
    with pytest.raises(OptionsError, match=r"'a\.lp' needs -f before it"):
        parse_options(["a.lp"])


@pytest.mark.parametrize("spelling", ["-c {}", "--const {}", "--const={}", "-c{}"])
@pytest.mark.parametrize("definition", ["n=14", "n=f(1,a)", 'n="a"', "_n'=-1", "n=2+3"])
def test_constants(spelling: str, definition: str) -> None:
    options = parse_options(spelling.format(definition).split())
    engine = Engine(options)
    engine.apply(Ground((Part("base"),)))


@pytest.mark.parametrize("spelling", ["-c {}", "--const {}", "--const={}", "-c{}"])
@pytest.mark.parametrize(
    "definition", ["n", "n=", "=1", "N=1", "1=n", "n=X", "n=1;2", "n=f(", "n=99999999999", "n=ä"]
)
def test_wrong_constants(spelling: str, definition: str) -> None:
    # clingo reads beyond the end of some of these, so none may get there.
    with pytest.raises(OptionsError, match="option -c"):
        parse_options(spelling.format(definition).split())


def test_a_constant_arrives() -> None:
    engine = Engine(parse_options(["-f", "a", "-c", "n=f(2)"]))
    engine.apply(Ground((Part("base"),)))
    assert engine.solve().symbols == ("a(f(2))",)


@pytest.mark.parametrize("option", ["--explode", "--opt-mode=worst", "-t", "--threads=2", "none"])
def test_clingo_refuses_an_option(option: str) -> None:
    with pytest.raises(OptionsError, match="clingo refuses the options") as caught:
        Engine(parse_options([option]))
    assert option in str(caught.value)


@pytest.mark.parametrize(
    ("words", "marked"),
    [
        ("a.asp", "-f a.asp"),
        ("a b.asp c.lp", "-f a -f b.asp -f c.lp"),
        ("-f a.asp b.asp", "-f a.asp -f b.asp"),
        ("none.asp", "-f none.asp"),  # which is then missed
        ("-t 2 b.asp 0", "-t 2 -f b.asp 0"),
        ("7 0", "-f 7 0"),
        ("-t 7 a.lp", "-t 7 -f a.lp"),
        ("--opt-mode a b.asp", "--opt-mode a -f b.asp"),
        ("--stats b.asp", "--stats -f b.asp"),
        ("-c n=b.asp --theory dl", "-c n=b.asp --theory dl"),
        ("--const n=7 ./a", "-c n=7 -f ./a"),
    ],
)
def test_a_file_may_have_any_name(words: str, marked: str, tmp_path: Path) -> None:
    for name in ("a", "b.asp", "7"):
        (tmp_path / name).touch()
    assert [*mark_files(words.split(), str(tmp_path))] == marked.split()
