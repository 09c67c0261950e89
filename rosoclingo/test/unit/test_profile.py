"""The option --profile of plan.py: what is measured and counted."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple

import clingo
import pytest
from clingo.backend import Observer

from rosclingo.errors import OptionsError, RosclingoError
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.solver.programs import Program
from rosclingo.wire import commands as wire
from rosoclingo.in_process.parts import EXAMPLES
from rosoclingo.tools.plan.command import run
from rosoclingo.tools.profile.counting import Counts, count
from rosoclingo.tools.profile.marking import Statement, mark
from rosoclingo.tools.profile.measuring import MeasuredEngine, SolverTrace

ROOT = Path(__file__).resolve().parents[3]
LINE = f"{EXAMPLES}/line.lp"


def step(number: int) -> wire.Ground:
    parts = ("state", "transition", "query") if number else ("base", "state", "query")
    return wire.Ground(
        tuple(wire.Part(name, () if name == "base" else (str(number),)) for name in parts)
    )


EMPTY = [wire.Add(name, ("t",), "") for name in ("state", "transition", "query")]


@pytest.fixture
def ground(tmp_path: Path) -> Callable[..., Counts]:
    """Grounds a program and some steps, and counts."""

    def ground(text: str, steps: int = 0) -> Counts:
        (tmp_path / "program.lp").write_text(text)
        options = Options((str(tmp_path / "program.lp"),))
        trace = SolverTrace()
        reply = MeasuredEngine(options, trace).run([*EMPTY, *map(step, range(steps + 1))])
        assert reply.failure is None, reply.failure
        return count(options, trace.commands)

    return ground


def lines(counts: Counts) -> Dict[int, int]:
    """Returns the instances by the line of the statement."""
    found: Dict[int, int] = {}
    for statement, number in counts.instances:
        found[statement.line] = found.get(statement.line, 0) + number
    return found


@pytest.mark.parametrize(
    ("statement", "instances"),
    [
        ("a(X,Y) :- p(X), q(Y).", 20),
        ("a(X) :- p(X), q(_).", 5),
        (":- p(X), q(Y), X < Y.", 6),
        (":- p(X), not q(X).", 5),
        ("{ a(X,Y) : q(Y) } 1 :- p(X).", 20),
        ("{ a(X); b(X) } :- p(X).", 10),
        ("a(X) : p(X) ; b :- q(1).", 6),
        ("1 { a(X) : p(X); b(Y) : q(Y) } 2.", 9),
        ("#external a(X,(y;z)) : p(X).", 10),
        ("#minimize { X,Y : p(X), q(Y) }.", 20),
        ("#maximize { 1@2,X : p(X); 3,Y : q(Y) }.", 9),
        ("a(1..7).", 7),
        ("a(X,1..3) :- p(X).", 15),
        ("a(X+Y) :- p(X), q(Y).", 20),
        ("-a(X) :- p(X).", 5),
        ("a :- p((1;2)).", 2),
        ("a :- 3 <= #sum { X,Y : p(X), q(Y) }.", 21),
        ("a(N) :- N = #count { X : p(X) }.", 6 + 5),
        ("a(X) :- p(X), 2 <= #count { Y : q(Y), Y != X }.", 5 + 16),
        ("a(X) :- p(X), b(X,Y) : q(Y). { b(1..5,1..4) }.", 5 + 20 + 20),
        ("a :- 1 <= { p(X) : q(X) }.", 5),
        ("#show a(X) : p(X).", 5),
        ("#heuristic p(X) : q(X). [1,true]", 4),
        ("#edge (X,Y) : p(X), q(Y).", 20),
        ("a(X+Y) :- p(X), Y = X+1.", 5),
        ("a(X) :- p(X), Y = X+1, 2 <= #count { Z : q(Z), Z < Y }.", 4 + 1 + 2 + 3 + 4 + 4),
    ],
)
def test_instances_of_a_statement(ground: Any, statement: str, instances: int) -> None:
    assert lines(ground(f"{{ p(1..5) }}. {{ q(1..4) }}.\n{statement}"))[2] == instances


class Heads(Observer):
    """Counts ground rules."""

    def __init__(self) -> None:
        self.rules = 0

    def rule(self, choice: bool, head: Any, body: Any) -> None:
        self.rules += 1


def test_instances_are_the_rules_that_clingo_grounds(ground: Any) -> None:
    """Of normal rules that nothing simplifies."""
    text = "{ p(1..7,1..7) }. { q(1..7) }."
    rules = " a(X,Z) :- p(X,Y), p(Y,Z). :- a(X,Y), q(X), not q(Y). b(X-Y) :- a(X,Y), X > Y."

    def rules_of(program: str) -> int:
        control, heads = clingo.Control(), Heads()
        control.register_observer(heads)
        control.add("base", [], program)
        control.ground([("base", [])])
        return heads.rules

    assert lines(ground(f"{text}\n{rules}"))[2] == rules_of(text + rules) - rules_of(text)


FOLDERS = ("rosclingo/example", "rosoclingo/example", "rosoclingo_aspprograms")
ENCODINGS = sorted(file for folder in FOLDERS for file in (ROOT / folder).rglob("*.lp"))
LIBRARIES = {str(file) for file in ENCODINGS if file.parent.name == "lib"}  # others include them


@pytest.mark.costly
def test_every_encoding_can_be_marked() -> None:
    assert len(ENCODINGS) > 10
    libraries = set(LIBRARIES)
    for file in (one for one in ENCODINGS if str(one) not in LIBRARIES):
        options = Options((str(file),))
        found: List[Statement] = []

        def marked(program: Program, found: List[Statement] = found) -> Program:
            program, statements = mark(program)
            found += statements
            return program

        try:
            Engine(options, rewrite=marked)
        except RosclingoError:
            with pytest.raises(RosclingoError):  # a part of an encoding, which is none by itself
                Engine(options)
            continue
        libraries -= {os.path.realpath(statement.file) for statement in found}
    assert not libraries


def test_a_statement_is_quoted_with_its_place(ground: Any) -> None:
    counts = ground("p(1..3).\na(X) :- % why\n    p(X),\n    X < 3.\n")
    (statement,) = [one for one, _ in counts.instances if one.line == 2]
    assert statement.text == "a(X) :- p(X), X < 3."


def test_counts_of_several_steps(ground: Any) -> None:
    counts = ground(
        "p(1..3). p(4).\n#program state(t). h(X,t) :- p(X).\n#program transition(t). "
        "{ a(X,t) : h(X,t-1) }. -a(X,t) :- h(X,t).\n#program other(t). o(t).",
        steps=4,
    )
    assert counts.atoms == {("p", 1): 4, ("h", 2): 20, ("a", 2): 16, ("-a", 2): 16}
    assert lines(counts) == {1: 3, 2: 20, 3: 32, 4: 0}  # a fact has no instances


def test_what_is_grounded_again_counts_again() -> None:
    options = Options((LINE,))
    trace = SolverTrace()
    engine = MeasuredEngine(options, trace)
    for _ in range(3):
        reply = engine.run([wire.Restart(), *EMPTY, *map(step, range(3)), wire.CleanupDomains()])
        assert reply.failure is None
    once = count(options, trace.commands[: len(trace.commands) // 3])
    thrice = count(options, trace.commands)
    assert thrice.atoms == {key: 3 * number for key, number in once.atoms.items()}
    assert thrice.instances == [(one, 3 * number) for one, number in once.instances]


def test_a_trace_has_the_time_of_groundings_and_searches() -> None:
    trace = SolverTrace()
    engine = MeasuredEngine(Options((LINE,)), trace)
    engine.run([*EMPTY, step(0)])
    assert (trace.searches, trace.searching) == (0, 0.0)
    assert trace.grounding > 0
    engine.solve()
    assert trace.searches == 1
    assert trace.searching > 0
    assert trace.commands == [*EMPTY, step(0)]


# The command.


class Typed(NamedTuple):
    status: int
    out: str
    err: str


@pytest.fixture
def plan(capsys: pytest.CaptureFixture[str]) -> Callable[..., Typed]:
    def plan(*arguments: str) -> Typed:
        status = run(arguments)
        said = capsys.readouterr()
        return Typed(status, said.out, said.err)

    return plan


def test_a_profile_is_printed_after_the_plan(plan: Any) -> None:
    said = plan(LINE, "--goal", "visit(3)", "--profile")
    assert said.status == 0
    plan_text, _, profile = said.out.partition("\nprofile: ")
    assert plan_text.startswith("plan: 2 steps")
    assert re.match(
        r"grounding took \d\.\d\d s, for \d+ atoms and [\d,]+ ground instances; 3 searches took",
        profile,
    )
    for row in (r"\n +\d+  event/3\n", r"\n +\d+  \S+line\.lp:62  :- do\(robot,go\(X\),t\), "):
        assert re.search(row, profile), row


@pytest.mark.parametrize(
    ("file", "arguments"),
    [
        ("line_paper.lp", ("--mode", "run-1.0")),
        ("line_1.0.lp", ("--mode", "run-1.0")),
        ("line_demand.lp", ("--mode", "dynamic.incremental.dyn_reset", "--simulate")),
        ("line.lp", ("--mode", "dynamic.incremental.reset", "--simulate")),
        ("line.lp", ("--mode", "dynamic.fixed.recording", "-c", "steps=8")),
    ],
)
def test_a_profile_of_each_kind_of_encoding(plan: Any, file: str, arguments: Any) -> None:
    said = plan(f"{EXAMPLES}/{file}", "--goal", "visit(3)", "--profile", "--json", *arguments)
    assert said.status == 0, said.err
    profile = json.loads(said.out)["profile"]
    assert profile["searches"] >= 1
    assert profile["grounding"] > 0
    for kind, number in (("predicates", "atoms"), ("statements", "instances")):
        numbers = [one[number] for one in profile[kind]]
        assert numbers == sorted(numbers, reverse=True)
        assert numbers[0] > 0


def test_a_profile_of_a_static_mode(plan: Any) -> None:
    files = [f"{ROOT}/rosclingo/example/{name}.lp" for name in ("instance", "itoh")]
    said = plan(*files, "--mode", "static.incremental.recording", "--profile")
    assert said.status == 0, said.err
    assert re.search(r"itoh\.lp:\d+ ", said.out)


ENDLESS = """
#program base.
rslot(1).
#program state(t).
#external event(1,work,t).
status(1,accepted,t) :- event(1,work,t).
#program query(t).
#external query(t).
% As many pigeons as there are holes, and one more.
1 { in(P,H,t) : H = 1..13 } 1 :- P = 1..14.
:- query(t), in(P,H,t), in(Q,H,t), P < Q.
#show status/3.
"""


@pytest.mark.costly
def test_a_search_without_end_is_cut_off_and_shown(plan: Any, tmp_path: Path) -> None:
    (tmp_path / "endless.lp").write_text(ENDLESS)
    said = plan(
        str(tmp_path / "endless.lp"), "--goal", "work", "--profile", "--profile-seconds", "1"
    )
    assert said.status == 1
    assert re.search(r"profile: .*; \d+ search(es)? took \d", said.out)
    assert "planning was ended with a horizon of" in said.err
    assert "--profile-seconds" in said.err


def test_profile_seconds_need_a_profile() -> None:
    with pytest.raises(OptionsError, match="--profile-seconds is for a profile: add --profile"):
        run([LINE, "--profile-seconds", "3"])
