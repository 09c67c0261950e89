"""The solver: every command and every kind of answer."""

from __future__ import annotations

import json
import threading
from pathlib import Path
from typing import Any, Callable, Dict, List, Sequence, Tuple

import pytest
from clingo import ast
from waiting import Within

from rosclingo.errors import (
    OptionsError,
    ProgramError,
    RosclingoError,
    SolverError,
    TermError,
    UnknownExternalError,
    UnknownProgramError,
)
from rosclingo.solver.engine import Engine, default_policy
from rosclingo.solver.options import Options
from rosclingo.solver.programs import Policy
from rosclingo.wire.commands import (
    Add,
    AssignExternal,
    Assumption,
    CleanupDomains,
    ConflictLimit,
    CostBound,
    Externals,
    GetExternals,
    GetPrograms,
    GetStats,
    Ground,
    Improvement,
    Load,
    Outcome,
    Part,
    Programs,
    ReleaseExternal,
    Reply,
    Restart,
    Restarts,
    Result,
    Stats,
    Truth,
)
from rosclingo.wire.xml_codec import decode_reply, encode_reply

# 12 pigeons in 11 holes: clingo searches for minutes.
PIGEONS = "1 { at(P,H) : H=1..11 } 1 :- P=1..12. :- at(P,H), at(Q,H), P < Q. #show at/2."


@pytest.fixture
def engine() -> Engine:
    return Engine(Options())


def add(engine: Engine, program: str, name: str = "base") -> None:
    """Adds a program part without parameters and grounds it."""
    engine.apply(Add(name, (), program))
    engine.apply(Ground((Part(name),)))


def externals(engine: Engine) -> Dict[str, Truth]:
    answer = engine.apply(GetExternals())
    assert isinstance(answer, Externals)
    names = [name for name, _ in answer.values]
    assert names == sorted(names)
    return dict(answer.values)


def sat(*symbols: str) -> Outcome:
    return Outcome(Result.SAT, False, symbols)


UNSAT = Outcome(Result.UNSAT)

# --- add, ground, load -----------------------------------------------------------------------


def test_nothing_is_grounded_at_start(tmp_path: Path) -> None:
    file = tmp_path / "a.lp"
    file.write_text("a.", encoding="utf-8")
    engine = Engine(Options(files=(str(file),)))
    assert engine.solve() == sat()
    assert engine.apply(Ground((Part("base"),))) is None
    assert engine.solve() == sat("a")


def test_parameters(engine: Engine) -> None:
    assert engine.apply(Add("edge", ("x", "y"), "edge(x,y). #program node(x). node(x).")) is None
    engine.apply(Ground((Part("edge", ('f(1,"a b")', "2+3")), Part("node", ("b",)))))
    assert sorted(engine.solve().symbols) == ['edge(f(1,"a b"),5)', "node(b)"]


def test_parts_are_grounded_together(engine: Engine) -> None:
    # Each needs the other, and a later ground adds to the same part.
    engine.apply(Add("p", (), "{ a }. b :- c."))
    engine.apply(Add("q", (), "c :- a. :- not b."))
    engine.apply(Ground((Part("p"), Part("q"))))
    assert sorted(engine.solve().symbols) == ["a", "b", "c"]


def test_a_part_grows(engine: Engine) -> None:
    engine.apply(Add("p", (), "a."))
    engine.apply(Add("p", (), "b."))
    engine.apply(Ground((Part("p"),)))
    assert sorted(engine.solve().symbols) == ["a", "b"]


# Distances from 0 on a line of 5 places, one round for each.
DISTANCES = """
#program base.
way(V,V+1) :- V = 0..3.
#program from(v).
at(v,v,0).
#external ground(round(v,1)).
#program round(v,n).
at(v,W,n) :- at(v,V,n-1), way(V,W).
#external ground(round(v,n+1)) : at(v,_,n).
#show at/3.
"""


def asking(name: str, *parameters: str, reserved: Sequence[str] = ()) -> Ground:
    return Ground((Part(name, parameters),), asking=True, reserved=tuple(reserved))


def test_what_the_program_asks_for_is_grounded_once(tmp_path: Path) -> None:
    file = tmp_path / "distances.lp"
    file.write_text(DISTANCES)
    engine = Engine(Options(files=(str(file),)))
    engine.apply(Ground((Part("base"),)))
    engine.apply(asking("from", "1"))
    expected = [f"at(1,{place},{place - 1})" for place in range(1, 5)]
    assert sorted(engine.solve().symbols) == expected
    engine.apply(asking("from", "1"))  # a second time it would redefine its atoms
    engine.apply(asking("from", "3"))
    assert sorted(engine.solve().symbols) == [*expected, "at(3,3,0)", "at(3,4,1)"]
    engine.apply(Restart())
    engine.apply(Ground((Part("base"),)))
    engine.apply(asking("from", "4"))
    assert engine.solve().symbols == ("at(4,4,0)",)


def test_what_is_not_asked_for_is_not_grounded(engine: Engine) -> None:
    engine.apply(Add("more", (), "b."))
    add(engine, "a. #external ground(more).")
    assert engine.solve().symbols == ("a",)


@pytest.mark.parametrize(
    ("asked", "reason"),
    [
        ("more(1)", r"no program more/1 .* asks for it by ground\(more\(1\)\)"),
        ("base", r"the program base cannot be asked for; .* by ground\(base\)"),
        ("mine(3)", r"the program mine cannot be asked for; .* by ground\(mine\(3\)\)"),
        ("3", r"3 names no program part; .* by ground\(3\)"),
        ('"x"', r"names no program part"),
        ("(1,2)", r"names no program part"),
    ],
)
def test_what_cannot_be_asked_for(asked: str, reason: str, engine: Engine) -> None:
    engine.apply(Add("mine", ("t",), ""))
    engine.apply(Add("begin", (), f"#external ground({asked})."))
    with pytest.raises(UnknownProgramError, match=reason):
        engine.apply(asking("begin", reserved=["mine"]))


def test_a_program_that_asks_without_end(engine: Engine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rosclingo.solver.engine._MOST_ROUNDS", 100)
    engine.apply(Add("count", ("n",), "#external ground(count(n+1))."))
    with pytest.raises(SolverError, match=r"100 times, last for count\(100\)"):
        engine.apply(asking("count", "0"))


def test_a_restart_of_what_has_just_begun_has_nothing_to_do(tmp_path: Path) -> None:
    """Unless a file has changed."""
    file = tmp_path / "p.lp"
    file.write_text("a.")
    engine = Engine(Options(files=(str(file),)))
    begun = engine._control
    assert engine.run([Restart()]).failure is None
    assert engine._control is begun
    file.write_text("b.")
    engine.run([Restart(), Ground((Part("base"),))])
    assert engine.solve() == sat("b")
    begun = engine._control
    assert engine.run([Restart()]).failure is None
    assert engine._control is not begun
    assert engine.solve() == sat()


def test_the_program_parts(engine: Engine) -> None:
    engine.apply(Add("step", ("t", "u"), ""))
    assert engine.apply(GetPrograms()) == Programs((("base", 0), ("step", 2)))


@pytest.mark.parametrize(
    ("text", "options"),
    [("#program p(x). q(x).", ("-c", "x=4")), ("#const x=4. #program p(x). q(x).", ())],
)
def test_a_parameter_with_the_name_of_a_constant(
    text: str, options: Tuple[str, ...], tmp_path: Path
) -> None:
    """clingo would put the constant in its place, and say nothing."""
    file = tmp_path / "p.lp"
    file.write_text(text)
    with pytest.raises(ProgramError, match=r"p\.lp:1:\d+: the parameter x of the program p has"):
        Engine(Options(files=(str(file),), clingo=options))


@pytest.mark.parametrize("part", [Part("q"), Part("p"), Part("p", ("1", "2")), Part("", ("1",))])
def test_an_unknown_program(part: Part, engine: Engine) -> None:
    engine.apply(Add("p", ("t",), "a(t). #program r. b."))
    with pytest.raises(UnknownProgramError) as caught:
        engine.apply(Ground((Part("r"), part)))
    message = str(caught.value)
    assert f"no program {part.name}/{len(part.parameters)} " in message
    assert "there are base/0, p/1, r/0" in message
    assert engine.solve() == sat()  # not even r was grounded


@pytest.mark.parametrize("value", ["X", "", "1 2", "f(", "1..2", "1/0", "99999999999"])
def test_a_parameter_that_is_no_ground_term(value: str, engine: Engine) -> None:
    engine.apply(Add("p", ("t",), "a(t)."))
    with pytest.raises(TermError):
        engine.apply(Ground((Part("p", ("1",)), Part("p", (value,)))))
    assert engine.solve() == sat()
    engine.apply(Ground((Part("p", ("1",)),)))
    assert engine.solve() == sat("a(1)")


@pytest.mark.parametrize(
    ("program", "place"),
    [
        ("a.\nb :- c d.", "2:8"),
        ("a(X) :- not b(X).", "1:1"),
        ("&diff { a } <= 3.", "1:2"),
    ],
    ids=["syntax", "unsafe", "theory"],
)
def test_a_wrong_program_leaves_the_solver_as_it_was(
    program: str, place: str, engine: Engine
) -> None:
    add(engine, "{ a }.")
    with pytest.raises(ProgramError, match=place):
        engine.apply(Add("p", (), program))
    with pytest.raises(UnknownProgramError):
        engine.apply(Ground((Part("p"),)))
    add(engine, ":- not a. b.", "p")
    assert sorted(engine.solve().symbols) == ["a", "b"]


def test_a_theory_of_an_earlier_program_is_known(engine: Engine) -> None:
    engine.apply(Add("p", (), "#theory t { x {}; &y/0 : x, any }."))
    add(engine, "&y { a }. b.", "q")
    assert engine.solve() == sat("b")


def test_constants(engine: Engine) -> None:
    engine.apply(Add("p", (), "#const n=3. a(n)."))
    add(engine, "b(n).", "p")
    assert sorted(engine.solve().symbols) == ["a(3)", "b(3)"]
    with pytest.raises(ProgramError, match="redefinition of constant"):
        engine.apply(Add("q", (), "#const n=4."))


def test_load(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.lp").write_text("a. #program step(t). b(t).", encoding="utf-8")
    engine = Engine(Options())
    assert engine.apply(Load("a.lp")) is None
    engine.apply(Ground((Part("base"), Part("step", ("7",)))))
    assert sorted(engine.solve().symbols) == ["a", "b(7)"]


def test_only_what_is_shown(engine: Engine) -> None:
    add(engine, 'a(1). b("x y"). c. -d. #show a/1. #show (s,X) : b(X). #show -d/0.')
    assert sorted(engine.solve().symbols) == ['(s,"x y")', "-d", "a(1)"]


# --- externals -------------------------------------------------------------------------------

DECLARED = "#external a. #external b(1). [true] #external c. [free] { x }. #show. #show a : a."


def test_externals_have_their_first_values(engine: Engine) -> None:
    assert externals(engine) == {}
    add(engine, DECLARED)
    assert externals(engine) == {"a": Truth.FALSE, "b(1)": Truth.TRUE, "c": Truth.FREE}


@pytest.mark.parametrize("value", list(Truth))
def test_assign_external(value: Truth, engine: Engine) -> None:
    add(engine, DECLARED)
    for name in ("a", "b(1)", " b( 0+1 )", "c"):
        assert engine.apply(AssignExternal(name, value)) is None
    assert externals(engine) == dict.fromkeys(["a", "b(1)", "c"], value)
    engine.solve()
    assert externals(engine) == dict.fromkeys(["a", "b(1)", "c"], value)


def test_values_count_in_the_search(engine: Engine) -> None:
    add(engine, "#external a. b :- a.")
    assert engine.solve() == sat()
    engine.apply(AssignExternal("a", Truth.TRUE))
    assert sorted(engine.solve().symbols) == ["a", "b"]
    engine.apply(AssignExternal("a", Truth.FREE))
    for value, symbols in ((True, ["a", "b"]), (False, [])):
        assert sorted(engine.solve([Assumption("a", value)]).symbols) == symbols
    engine.apply(AssignExternal("a", Truth.FALSE))
    assert engine.solve() == sat()


@pytest.mark.costly
def test_the_restart_strategy_of_a_search(engine: Engine) -> None:
    holes = "1 { in(P,H) : H = 1..8 } 1 :- P = 1..9. :- in(P,H), in(Q,H), P < Q."
    engine.run([Add("base", (), holes), Ground((Part("base"),))])

    def restarts(*assumed: Restarts) -> float:
        assert engine.solve([*assumed, ConflictLimit(1000)]).result is Result.UNKNOWN
        (answer,) = engine.run([GetStats()]).answers
        assert isinstance(answer, Stats)
        return float(answer.values["solving"]["solvers"]["restarts"])

    assert restarts(Restarts("F,10")) > 50 > restarts(Restarts("F,900"))
    with pytest.raises(SolverError, match="no restart strategy Q,10"):
        engine.solve([Restarts("Q,10")])
    assert restarts() > 5  # it was that of a search


@pytest.mark.costly
def test_a_search_ends_after_some_conflicts(engine: Engine) -> None:
    holes = "1 { in(P,H) : H = 1..9 } 1 :- P = 1..10. :- in(P,H), in(Q,H), P < Q."
    engine.run([Add("base", (), holes), Ground((Part("base"),))])
    assert engine.solve([ConflictLimit(50)]) == Outcome(Result.UNKNOWN, False)
    assert engine.solve([Assumption("in(1,1)", True), ConflictLimit(0)]).result is Result.UNKNOWN
    assert engine.solve().result is Result.UNSAT  # it was a limit of that search


def test_release_all_externals_of_a_signature(engine: Engine) -> None:
    program = "#external p(1..3,a). #external -p(1,a). #external p(1). q(X) :- p(X,a)."
    engine.run([Add("base", (), program), Ground((Part("base"),))])
    assert engine.run([ReleaseExternal("p/2"), ReleaseExternal("none/7")]).failure is None
    assert list(externals(engine)) == ["-p(1,a)", "p(1)"]
    assert engine.run([ReleaseExternal("-p/2")]).failure is None
    assert list(externals(engine)) == ["p(1)"]
    for wrong in ("p/", "p/2/1", "P/2", "3/1"):
        failure = engine.run([ReleaseExternal(wrong)]).failure
        assert failure is not None, wrong


@pytest.mark.parametrize("cleanup", [False, True])
def test_release_external(cleanup: bool, engine: Engine) -> None:
    add(engine, DECLARED)
    engine.apply(AssignExternal("a", Truth.TRUE))
    assert engine.apply(ReleaseExternal("a")) is None
    if cleanup:
        engine.apply(CleanupDomains())
    assert externals(engine) == {"b(1)": Truth.TRUE, "c": Truth.FREE}
    assert engine.solve() == sat()
    for command in (ReleaseExternal("a"), AssignExternal("a", Truth.TRUE)):
        with pytest.raises(UnknownExternalError, match="no external a"):
            engine.apply(command)


def test_an_external_that_a_rule_defines(engine: Engine) -> None:
    add(engine, DECLARED)
    engine.apply(AssignExternal("a", Truth.TRUE))
    add(engine, "a :- x.", "p")
    assert externals(engine) == {"b(1)": Truth.TRUE, "c": Truth.FREE}
    with pytest.raises(UnknownExternalError, match="defined by a rule or released"):
        engine.apply(AssignExternal("a", Truth.FALSE))
    assert engine.solve([Assumption("x", False)]) == sat()
    assert engine.solve([Assumption("x", True)]) == sat("a")


def test_an_external_declared_again(engine: Engine) -> None:
    engine.apply(Add("p", (), "#external a."))
    engine.apply(Ground((Part("p"),)))
    engine.apply(AssignExternal("a", Truth.TRUE))
    add(engine, "#external a. [free] #external d. [true]", "q")
    values = externals(engine)
    assert sorted(values) == ["a", "d"]
    # What is answered must be what counts: a is true in every answer set, or in some only.
    possible = [engine.solve([Assumption("a", v)]).result is Result.SAT for v in (True, False)]
    assert (values["a"] is not Truth.FALSE, values["a"] is not Truth.TRUE) == tuple(possible)


@pytest.mark.parametrize("name", ["zz", "b(2)", "x", "1", '"a"', "-a", "fact"])
@pytest.mark.parametrize(
    "command", [ReleaseExternal, lambda name: AssignExternal(name, Truth.TRUE)]
)
def test_an_external_that_does_not_exist(
    name: str, command: Callable[[str], Any], engine: Engine
) -> None:
    add(engine, DECLARED + "fact.")
    before = externals(engine)
    with pytest.raises(UnknownExternalError, match="get_externals lists") as caught:
        engine.apply(command(name))
    assert f"no external {name}:" in str(caught.value)
    assert externals(engine) == before


@pytest.mark.parametrize("name", ["", "a(", "a(X)", "a b", "\0"])
def test_an_external_that_does_not_parse(name: str, engine: Engine) -> None:
    add(engine, DECLARED)
    for command in (ReleaseExternal(name), AssignExternal(name, Truth.TRUE)):
        with pytest.raises(TermError):
            engine.apply(command)


def test_an_external_whose_text_is_not_utf8(tmp_path: Path) -> None:
    # A file may hold any bytes; the answer to get_externals must come nevertheless.
    file = tmp_path / "latin1.lp"
    file.write_bytes(b'#external a("\xe4"). b("\xe4").')
    engine = Engine(Options(), Policy(load_path=(str(tmp_path),)))
    try:
        engine.apply(Load(str(file)))
        engine.apply(Ground((Part("base"),)))
    except RosclingoError:
        return  # to refuse it is as good
    assert len(externals(engine)) == 1
    assert len(engine.solve().symbols) == 1


# --- cleanup, statistics, restart ------------------------------------------------------------


def test_cleanup(engine: Engine) -> None:
    add(engine, "#external a. { b }. c :- a. d :- not a.")
    engine.apply(ReleaseExternal("a"))
    assert engine.apply(CleanupDomains()) is None
    add(engine, "e :- d. f :- c.", "p")
    assert sorted(engine.solve([Assumption("b", True)]).symbols) == ["b", "d", "e"]


def test_statistics(engine: Engine) -> None:
    add(engine, "{ a }.")
    for calls in range(3):
        answer = engine.apply(GetStats())
        assert isinstance(answer, Stats)
        json.dumps(answer.values, allow_nan=False)
        assert decode_reply(encode_reply(Reply((answer,)))).answers == (answer,)
        if calls:
            assert answer.values["summary"]["call"] == calls - 1
        engine.solve()


def test_restart(tmp_path: Path) -> None:
    file = tmp_path / "a.lp"
    file.write_text("a(n).", encoding="utf-8")
    engine = Engine(Options(files=(str(file),), clingo=("-c", "n=3")))
    add(engine, "#external e. b.", "p")
    engine.apply(AssignExternal("e", Truth.TRUE))
    assert engine.apply(Restart()) is None
    assert engine.solve() == sat()
    assert externals(engine) == {}
    with pytest.raises(UnknownProgramError):
        engine.apply(Ground((Part("p"),)))
    engine.apply(Ground((Part("base"),)))
    assert engine.solve() == sat("a(3)")


def test_a_restart_may_leave_the_files_alone(tmp_path: Path) -> None:
    file = tmp_path / "a.lp"
    file.write_text("a.")
    engine = Engine(Options((str(file),)), rereads=False)
    file.unlink()
    engine.apply(Restart())
    engine.apply(Ground((Part("base"),)))
    assert engine.solve().symbols == ("a",)


def test_a_restart_parses_only_what_has_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    parsed: List[Sequence[str]] = []
    parse_files = ast.parse_files

    def record(paths: Sequence[str], *arguments: Any, **keywords: Any) -> None:
        parsed.append(paths)
        parse_files(paths, *arguments, **keywords)

    monkeypatch.setattr(ast, "parse_files", record)
    file, included = tmp_path / "a.lp", tmp_path / "b.lp"
    file.write_text('#const n=1. a(n). #include "b.lp".', encoding="utf-8")
    included.write_text("b(1).", encoding="utf-8")
    engine = Engine(Options(files=(str(file),)))
    for times, new, atoms in ((1, "b(1).", ("a(1)", "b(1)")), (2, "b(2).", ("a(1)", "b(2)"))):
        included.write_text(new, encoding="utf-8")
        for _ in range(3):
            engine.apply(Restart())
            engine.apply(Add("p", (), "c(n)."))
            engine.apply(Ground((Part("base"),)))
            assert sorted(engine.solve().symbols) == sorted(atoms)
        assert len(parsed) == times


@pytest.mark.costly
def test_no_message_quotes_all_of_a_long_text(engine: Engine) -> None:
    name = "a" * 1_000_000
    engine.apply(Add("p" + name, (), "#external e."))
    for command in (
        Add("p", (), f"{name}(X)."),
        Add(name + " ", (), ""),
        Add("p", (), f'#include "{name}".'),
        Load("/" + name),
        Ground((Part(name),)),
        Ground((Part("base", ("X" + name,)),)),
        AssignExternal(name, Truth.TRUE),
    ):
        failure = engine.run([command]).failure
        assert failure is not None
        assert len(failure.message) < 5000


def test_restart_after_everything_that_went_wrong(engine: Engine) -> None:
    add(engine, DECLARED)
    for command in (
        Add("p", (), "a :- "),
        Add("p", (), "a(X)."),
        Add("p", (), "#script (python) #end."),
        Load("/etc/passwd"),
        Ground((Part("q"),)),
        AssignExternal("zz", Truth.TRUE),
        ReleaseExternal("X"),
    ):
        with pytest.raises(RosclingoError):
            engine.apply(command)
    engine.solve([Assumption("x", True)], stopped=lambda: True)
    for _ in range(3):
        engine.apply(Restart())
        add(engine, "good.")
        assert engine.solve() == sat("good")


WRONG_START: List[Tuple[str, str]] = [
    ("a :- ", "2:1"),
    ("a(X).", "1:1"),
    ("#script (python)\nraise ValueError('oops')\n#end.", "oops"),
]


@pytest.mark.parametrize(("text", "reason"), WRONG_START, ids=["syntax", "unsafe", "script"])
def test_a_restart_that_fails_keeps_the_old_solver(text: str, reason: str, tmp_path: Path) -> None:
    file = tmp_path / "start.lp"
    right = "#script (python)\ndef f(): return []\ndef g(x): return x\n#end.\n#program p. b(@g(2))."
    file.write_text("a. " + right, encoding="utf-8")
    engine = Engine(Options(files=(str(file),)))
    engine.apply(Ground((Part("base"),)))
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ProgramError, match=reason):
        engine.apply(Restart())
    assert engine.solve() == sat("a")
    engine.apply(Ground((Part("p"),)))  # also its scripts are still there
    assert sorted(engine.solve().symbols) == ["a", "b(2)"]
    file.unlink()
    with pytest.raises(ProgramError):
        engine.apply(Restart())
    assert sorted(engine.solve().symbols) == ["a", "b(2)"]
    file.write_text("c.", encoding="utf-8")
    engine.apply(Restart())
    engine.apply(Ground((Part("base"),)))
    assert engine.solve() == sat("c")


def test_a_start_that_fails() -> None:
    with pytest.raises(OptionsError, match="--nonsense"):
        Engine(Options(clingo=("--nonsense",)))


def test_when_clingo_fails_a_restart_helps() -> None:
    engine = Engine(Options(), Policy(allow_scripts=True))
    engine.apply(
        Add("p", (), "#script (python)\ndef f(): raise ValueError('oops')\n#end. a(@f()).")
    )
    with pytest.raises(SolverError, match=r"(?s)oops.*a restart gives a fresh solver"):
        engine.apply(Ground((Part("p"),)))
    engine.apply(Restart())
    add(engine, "good.")
    assert engine.solve() == sat("good")


def test_the_default_policy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    policy = default_policy(Options(files=("x/a.lp", "/y/b.lp", "x/c.lp", "d.lp")))
    assert policy == Policy(False, (str(tmp_path / "x"), "/y", str(tmp_path)))


# --- solving ---------------------------------------------------------------------------------


def test_sat_and_unsat(engine: Engine) -> None:
    add(engine, "a. #external q. :- q.")
    assert engine.solve() == sat("a")
    engine.apply(AssignExternal("q", Truth.TRUE))
    assert engine.solve() == UNSAT
    engine.apply(AssignExternal("q", Truth.FALSE))
    assert engine.solve() == sat("a")


@pytest.mark.parametrize(
    ("assumptions", "expected"),
    [
        ([("a", True)], sat("a")),
        ([("a", False)], sat("b")),
        ([("a", True), ("b", False)], sat("a")),
        ([("a", True), ("b", True)], UNSAT),
        ([("a", True), ("a", False)], UNSAT),
        ([("f( 1 )", True), ("a", True)], sat("a")),
        ([("f(1)", False)], UNSAT),
        ([("unknown", True)], UNSAT),
        ([("unknown", False), ("a", True)], sat("a")),
        ([("-a", True)], UNSAT),
        ([("1", True)], UNSAT),
    ],
)
def test_assumptions(
    assumptions: Sequence[Tuple[str, bool]], expected: Outcome, engine: Engine
) -> None:
    add(engine, "1 { a; b } 1. f(1). #show a/0. #show b/0.")
    for _ in range(2):  # they hold for one call only
        assert engine.solve([Assumption(*pair) for pair in assumptions]) == expected
        assert engine.solve().result is Result.SAT


def test_the_core_has_assumptions_that_exclude_an_answer_set(engine: Engine) -> None:
    add(engine, "{ a; b; c }. :- a, not b.")
    assumptions = [Assumption("a", True), Assumption("b", False), Assumption("c", True)]
    assert engine.solve(assumptions).result is Result.UNSAT
    assert set(engine.core) <= set(assumptions)
    assert engine.solve(engine.core).result is Result.UNSAT
    assert engine.solve(assumptions[1:]).result is Result.SAT
    assert engine.core == ()
    assert engine.solve([assumptions[2], Assumption("d", True)]).result is Result.UNSAT
    assert engine.core == (Assumption("d", True),)
    add(engine, ":- c. :- not c.", "wrong")
    assert engine.solve(assumptions).result is Result.UNSAT
    assert engine.core == ()


@pytest.mark.parametrize("name", ["", "a(", "a(X)", "a b", "\0", "1/0", "ä"])
def test_an_assumption_that_does_not_parse(name: str, engine: Engine) -> None:
    with pytest.raises(TermError):
        engine.solve([Assumption("a", True), Assumption(name, True)])
    assert engine.solve() == sat()


def test_optimisation(engine: Engine) -> None:
    add(
        engine,
        "5 { a(1..30) } 9. #minimize { X,X : a(X) }. #maximize { 1@2,X : a(X), X > 20 }.#show a/1.",
    )
    improvements: List[Improvement] = []
    outcome = engine.solve(improved=improvements.append)
    costs = [improvement.cost for improvement in improvements]
    assert len(costs) > 1
    assert all(later < earlier for earlier, later in zip(costs, costs[1:]))
    assert [improvement.number for improvement in improvements] == list(range(1, len(costs) + 1))
    assert costs[-1] == (-9, sum(range(21, 30)))
    assert improvements[-1].symbols == outcome.symbols
    assert sorted(outcome.symbols) == [f"a({x})" for x in range(21, 30)]
    assert (outcome.result, outcome.interrupted) == (Result.SAT, False)


def test_the_optimum_comes_last_also_when_optima_are_enumerated() -> None:
    engine = Engine(Options(clingo=("--opt-mode=optN", "0")))
    add(engine, "1 { a(1..4) }. #minimize { 1,X : a(X) }.")
    improvements: List[Improvement] = []
    outcome = engine.solve(improved=improvements.append)
    assert outcome.result is Result.SAT
    assert len(outcome.symbols) == 1
    costs = [improvement.cost for improvement in improvements]
    assert costs == sorted(set(costs), reverse=True)
    assert costs[-1] == (1,)


def test_without_optimisation_nothing_is_improved(engine: Engine) -> None:
    add(engine, "{ a; b }.")
    improvements: List[Improvement] = []
    assert engine.solve(improved=improvements.append).result is Result.SAT
    assert improvements == []


class StopAfter:
    """Says that it is time to stop when it has been asked a number of times."""

    def __init__(self, times: int) -> None:
        self.times = times

    def __call__(self) -> bool:
        self.times -= 1
        return self.times <= 0


@pytest.mark.parametrize("options", [(), ("-t", "2")], ids=["one thread", "two threads"])
def test_a_long_search_is_stopped(options: Tuple[str, ...], within: Within) -> None:
    engine = Engine(Options(clingo=options))
    add(engine, "#external on. 1 { at(P,H) : H=1..11 } 1 :- P=1..12, on. { free }.")
    add(engine, ":- at(P,H), at(Q,H), P < Q.", "p")
    engine.apply(AssignExternal("on", Truth.TRUE))
    for times in (1, 3, 10):
        # Nothing but the callback can end this search before the time is up.
        stopped = StopAfter(times)
        outcome = within(20, lambda: engine.solve(stopped=stopped))  # noqa: B023 (called at once)
        assert outcome == Outcome(Result.UNKNOWN, interrupted=True)
        assert stopped.times <= 0
    engine.apply(AssignExternal("on", Truth.FALSE))
    for _ in range(50):
        assert engine.solve([Assumption("free", True)]) == sat("free")
        assert engine.solve([Assumption("free", True), Assumption("on", True)]) == UNSAT


def test_searches_at_once_are_stopped_each_for_itself(within: Within) -> None:
    first_is_over, outcomes = threading.Event(), {}

    def search(name: str, stopped: Callable[[], bool]) -> None:
        engine = Engine(Options())
        add(engine, PIGEONS)
        outcomes[name] = engine.solve(stopped=stopped)

    def run() -> Outcome:
        second = threading.Thread(target=search, args=("second", first_is_over.is_set))
        second.start()
        search("first", StopAfter(3))
        assert "second" not in outcomes
        first_is_over.set()
        second.join()
        return outcomes["second"]

    assert within(20, run) == outcomes["first"] == Outcome(Result.UNKNOWN, interrupted=True)


def test_an_interrupt_that_comes_too_late_does_not_end_the_next_search(engine: Engine) -> None:
    add(engine, "a.")
    for _ in range(3):
        engine._control.interrupt()
        assert engine.solve() == sat("a")


def test_an_interrupted_optimisation_keeps_the_best_model(engine: Engine, within: Within) -> None:
    add(engine, "{ at(P,H) : H=1..11 } 1 :- P=1..12. :- at(P,H), at(Q,H), P < Q. #show at/2.")
    add(engine, ":~ P=1..12, not at(P,_). [1,P]", "p")
    improvements: List[Improvement] = []

    def stopped() -> bool:
        # Eleven pigeons have a hole: the optimum, but to prove it takes minutes.
        return bool(improvements) and improvements[-1].cost == (1,)

    outcome = within(30, lambda: engine.solve(stopped=stopped, improved=improvements.append))
    assert (outcome.result, outcome.interrupted) == (Result.UNKNOWN, True)
    assert outcome.symbols == improvements[-1].symbols
    assert len(outcome.symbols) == 11


def test_an_exception_of_a_callback_ends_the_search(engine: Engine) -> None:
    def fail(*_: object) -> Any:
        raise ValueError("oops")

    add(engine, PIGEONS)
    with pytest.raises(ValueError, match="oops"):
        engine.solve(stopped=fail)
    engine.apply(CleanupDomains())  # would fail during a search
    engine.apply(Restart())
    add(engine, "{ a }. #minimize { 1 : a }.")
    with pytest.raises(ValueError, match="oops"):
        engine.solve(improved=fail)
    assert engine.solve() == sat()


def test_several_threads() -> None:
    engine = Engine(Options(clingo=("-t", "2")))
    add(engine, "1 { a(1..9) } 1. #minimize { X,X : a(X) }. { b }. :- not b.")
    assert sorted(engine.solve().symbols) == ["a(1)", "b"]
    answer = engine.apply(GetStats())
    assert isinstance(answer, Stats)
    assert answer.values["summary"]["concurrency"] == 2


def test_a_search_limit_makes_the_answer_unknown() -> None:
    engine = Engine(Options(clingo=("--solve-limit=10",)))
    add(engine, PIGEONS)
    outcome = engine.solve()
    assert (outcome.result, outcome.symbols) == (Result.UNKNOWN, ())


def test_warnings_are_logged() -> None:
    messages: List[str] = []
    engine = Engine(Options(), log=messages.append)
    add(engine, "a :- b.")
    add(engine, "c(1+a).", "q")
    assert len(messages) == 2
    assert "operation undefined" in messages[1]
    assert "atom does not occur in any rule head" in messages[0]
    engine.solve()
    assert len(messages) == 2


def test_warnings_of_files_are_logged_when_their_parts_are_grounded(tmp_path: Path) -> None:
    """Not when they are checked, where nothing is grounded that other parts may define."""
    file = tmp_path / "program.lp"
    file.write_text("a. #show done/1. #program q. b :- c.")
    messages: List[str] = []
    engine = Engine(Options((str(file),)), log=messages.append)
    engine.run([Restart()])
    assert messages == []
    engine.run([Ground((Part("base"),))])
    assert len(messages) == 1
    assert "no atoms over signature" in messages[0]
    engine.run([Ground((Part("q"),))])
    assert "atom does not occur in any rule head" in messages[1]


@pytest.mark.parametrize("is_file", [True, False])
@pytest.mark.parametrize(("options", "first"), [((), "p(4)"), (("--heuristic=None",), "p(1)")])
def test_heuristics_of_the_program_count(
    is_file: bool, options: Tuple[str, ...], first: str, tmp_path: Path
) -> None:
    """Unless the command line names others."""
    program = "1 { p(1..5) } 1. #heuristic p(X) : X = 4. [10,true]"
    file = tmp_path / "program.lp"
    file.write_text(program if is_file else "")
    engine = Engine(Options((str(file),), options))
    if not is_file:
        engine.apply(Add("base", (), program))
    for _ in range(2):
        engine.apply(Ground((Part("base"),)))
        assert (engine.solve().symbols == ("p(4)",)) == (first == "p(4)")
        engine.apply(Restart())
        if not is_file:
            engine.apply(Add("base", (), program))


def test_costs_are_bounded_for_one_search(engine: Engine) -> None:
    add(engine, "{ a; b }. :- not a, not b. #minimize { 3,a : a ; 2,b : b }.")
    assert engine.solve([Assumption("a", True), CostBound((2,))]).result is Result.UNSAT
    assert engine.solve([CostBound((2,))]).symbols == ("b",)
    assert engine.solve([CostBound((1,))]).result is Result.UNSAT
    assert engine.solve([Assumption("a", True)]).symbols == ("a",)
