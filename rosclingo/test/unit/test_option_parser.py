"""Command lines with terms as values."""

from __future__ import annotations

import pytest

from rosclingo.solver.option_parser import OptionParser


@pytest.fixture
def parser() -> OptionParser:
    parser = OptionParser(prog="test", allow_abbrev=False)
    parser.add_argument("--goal", action="append")
    parser.add_argument("--at", nargs=2, action="append")
    parser.add_argument("--seed", type=int)
    parser.add_argument("--json", action="store_true")
    return parser


def test_values_that_begin_with_a_dash(parser: OptionParser) -> None:
    words = "a.lp --goal -visit(2) --at 1 -1:-x -c n=-1 --seed -3 --goal=-x --json -t 2"
    chosen, rest = parser.parse_known_args(words.split())
    assert chosen.goal == ["-visit(2)", "-x"]
    assert (chosen.at, chosen.seed, chosen.json) == ([["1", "-1:-x"]], -3, True)
    assert rest == ["a.lp", "-c", "n=-1", "-t", "2"]


@pytest.mark.parametrize("words", ["--goal --json", "--at 1 --json", "--goal", "--seed -x"])
def test_a_value_that_is_missing(
    words: str, parser: OptionParser, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        parser.parse_known_args(words.split())
    said = capsys.readouterr().err
    assert f"argument {words.split(maxsplit=1)[0]}: " in said
    assert "\0" not in said


def test_what_is_left_to_clingo(parser: OptionParser) -> None:
    words = ["a.lp", "-c", "at=-1", "--opt-mode", "optN", "--json", "--models=0", "0", "-f", "b"]
    chosen, rest = parser.parse_known_args(words)
    assert chosen.json
    assert rest == [word for word in words if word != "--json"]
    assert parser.split(words) == (["--json"], rest)
