"""The option --profile of plan.py: what is measured and counted, and what is advised."""

from __future__ import annotations

import json
import os
import re
import signal
import threading
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple, Tuple

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
from rosoclingo.tools.plan.profiling import BlockTimeLimit, Profiler
from rosoclingo.tools.profile.advice import advise
from rosoclingo.tools.profile.counting import Counts, count, total
from rosoclingo.tools.profile.marking import Statement, StatementForm, mark
from rosoclingo.tools.profile.measuring import MeasuredEngine, SolverTrace, TimedSearch, by_horizon
from rosoclingo.tools.profile.text import Profile

ROOT = Path(__file__).resolve().parents[3]
LINE = f"{EXAMPLES}/line.lp"


def step(number: int) -> wire.Ground:
    parts = ("state", "transition", "query") if number else ("base", "state", "query")
    return wire.Ground(
        tuple(wire.Part(name, () if name == "base" else (str(number),)) for name in parts)
    )


EMPTY = [wire.Add(name, ("t",), "") for name in ("state", "transition", "query")]


@pytest.fixture
def ground(tmp_path: Path) -> Any:
    """Grounds a program and some steps, and returns the file's profile."""

    def ground(text: str, steps: int = 0) -> Profile:
        (tmp_path / "program.lp").write_text(text)
        options = Options((str(tmp_path / "program.lp"),))
        profiler = Profiler(options)
        engine = profiler.make_engine(options, log=lambda _: None)
        reply = engine.run([*EMPTY, *map(step, range(steps + 1))])
        assert reply.failure is None, reply.failure
        return profiler.profile()

    return ground


def lines(profile: Profile) -> Dict[int, int]:
    """Returns the instances by the line of the statement."""
    found: Dict[int, int] = {}
    for statement, steps in zip(profile.counts.statements, profile.counts.instances):
        found[statement.line] = found.get(statement.line, 0) + total(steps)
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
        ("a(3).", 1),
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
        assert found, file
        libraries -= {os.path.realpath(statement.file) for statement in found}
    assert not libraries


def test_a_statement_is_quoted_with_its_place(ground: Any) -> None:
    profile = ground("p(1..3).\nä(X) :- % why\n    p(X),\n    X < 3.\n".replace("ä", "a"))
    (statement,) = [s for s in profile.counts.statements if s.line == 2]
    assert statement.text == "a(X) :- p(X), X < 3."
    assert (statement.part, statement.form) == ("base", StatementForm.RULE)


def test_counts_by_step(ground: Any) -> None:
    profile = ground(
        "p(1..3). #program state(t). h(X,t) :- p(X). #program transition(t). "
        "{ a(X,t) : h(X,t-1) }. #program other(t). o(t).",
        steps=4,
    )
    counts: Counts = profile.counts
    assert counts.atoms["h", 2] == {0: 3, 1: 3, 2: 3, 3: 3, 4: 3}
    assert counts.atoms["a", 2] == {1: 3, 2: 3, 3: 3, 4: 3}
    assert counts.in_step(counts.atoms["a", 2]) == 3
    assert not any(name.startswith("rosoclingo_profile") for name, _ in counts.atoms)
    said = profile.describe()
    assert re.search(r"transition\(t\) +12 +3\n", said)
    assert "other" not in said


def test_a_step_that_is_grounded_again_counts_once_for_the_step(ground: Any) -> None:
    options = Options((LINE,))
    trace = SolverTrace()
    engine = MeasuredEngine(options, trace)
    for _ in range(3):
        reply = engine.run([wire.Restart(), *EMPTY, *map(step, range(3)), wire.CleanupDomains()])
        assert reply.failure is None
    thrice, _ = count(options, trace)
    del trace.events[len(trace.events) // 3 :]
    once, _ = count(options, trace)
    assert thrice.total == 3 * once.total
    assert [thrice.in_step(i) for i in thrice.instances] == [
        once.in_step(i) for i in once.instances
    ]


# Programs, and a regular expression of what is advised about them.
WORLD = "place(1..40). way(X,X+1) :- place(X), place(X+1). request(go(X,Y)) :- place(X), place(Y). "
ADVISED: Dict[str, Tuple[str, str]] = {
    "events": (
        WORLD + "slot(1..3). #program state(t). #external event(I,R,t) : slot(I), request(R).",
        r"event/3 has 4,800 externals in each step, for each of request/1, which has 1,600: say "
        r"requests and messages by event\(s,c\)",
    ),
    "messages": (
        WORLD + "#program transition(t). #external event(info,near(X,Y),t) : place(X), place(Y).",
        r"event/3 has 1,600 externals .* of place/1, which has 40.*event\(s,c,t\)",
    ),
    "other externals": (
        WORLD + "#program state(t). #external seen(X,Y,t) : place(X), place(Y).",
        r"seen/3 has 1,600 externals .*: declare it for what can happen",
    ),
    "the same in each step": (
        WORLD + "#program state(t). near(X,Y,t) :- place(X), place(Y), |X-Y| < 30.",
        r"derives the same 1,\d+ atoms in each step.*once, in base",
    ),
    "at most one": (
        WORLD + "#program transition(t). { do(X,t) : place(X) }. :- do(X,t), do(Y,t), X < Y.",
        r"tries all 1,600 combinations of do/2 \(40\) with do/2 \(40\), which share no variable "
        r"\(780 in a step\): .*2 <= \{ do\(...\) \}",
    ),
    "combinations": (
        "a(1..50). b(1..60). c(X,Y) :- a(X), b(Y), X * Y = 12. d(1..500,1..9).",
        r"tries all 3,000 combinations of a/1 \(50\) with b/1 \(60\)",
    ),
    "a choice": (
        WORLD + "#program transition(t). { do(go(X,Y),t) : request(go(X,Y)) } 1.",
        r"chooses among 1,600 atoms in each step",
    ),
    "a minimisation": (
        WORLD + "{ do(X,Y,1..20) : way(X,Y) }. #minimize { 1,X,Y,T : do(X,Y,T) }.",
        r"minimises over 780: ",
    ),
    "an amount": (
        "#program base. full(400). #program state(t). battery(N,t) :- N = 0..400. "
        "#program transition(t). { drains(t) }. "
        "battery(N-1,t) :- battery(N,t-1), drains(t), N > 0. "
        "battery(N+1,t) :- battery(N,t-1), not drains(t), N < 400.",
        r"computes with N, which is each of 4\d\d numbers from \d+ to \d+",
    ),
    "growth": (
        "place(1..100). #program transition(t). { do(X,t) : place(X) }. "
        "again(X,S,t) :- do(X,t), do(X,S), S < t.",
        r"grows with the steps, 300 in step 4 and 700 in step 8",
    ),
    "a join": (
        WORLD + "n(X,Y) :- place(X), place(Y), Y < 20. f(X,Z) :- n(X,Y), n(Z,Y).",
        r"joins n/2 \(760\), 2 times to 30,400 \(.*\): have a rule in base say",
    ),
}  # fmt: skip


@pytest.mark.costly
@pytest.mark.parametrize("case", ADVISED)
def test_advice(ground: Any, monkeypatch: pytest.MonkeyPatch, case: str) -> None:
    monkeypatch.setattr("rosoclingo.tools.profile.advice._VERY_MANY", 700)
    text, expected = ADVISED[case]
    said = ground(text, steps=8).advice
    assert any(re.search(expected, one) for one in said), said


@pytest.mark.parametrize(
    "text",
    [
        "place(1..40). way(X,X+1) :- place(X), place(X+1). at(1).",
        WORLD.replace("40", "20")
        + "#program state(t). #external event(robot,(success;failure),t). "
        "#program transition(t). { do(X,t) : place(X) } 1. :- do(X,t), not do(X-1,t-1), X > 1.",
        # Large, but of facts: nothing is to be changed.
        "p(1..2000).",
    ],
)
def test_no_advice_without_need(ground: Any, text: str) -> None:
    assert ground(text, steps=8).advice == []


def advice_about(*searches: TimedSearch) -> List[str]:
    return advise(Counts(), SolverTrace([*searches]), lambda statement, steps: {})


def test_advice_about_searches() -> None:
    sat, unsat, unknown = wire.Result.SAT, wire.Result.UNSAT, wire.Result.UNKNOWN
    assert advice_about(TimedSearch(1, 0.2, unsat), TimedSearch(2, 0.1, sat)) == []
    (said,) = advice_about(
        TimedSearch(1, 1.0, unsat), TimedSearch(2, 8.0, unsat), TimedSearch(3, 0.5, sat)
    )
    assert said.startswith("2 horizons without a plan took 9.0 s of 9.5 s, that of 2 8.0 s")
    (said,) = advice_about(TimedSearch(1, 0.1, unsat), TimedSearch(4, 9.0, sat, 0.4))
    assert said.startswith("searches had a plan after 0.4 s at the latest, and took 8.6 s of 9.1 s")
    (said,) = advice_about(TimedSearch(1, 0.1, unsat), TimedSearch(4, 9.0, unknown))
    assert said.startswith("the search with horizon 4 was not over after 9.0 s")


def test_times_by_horizon() -> None:
    trace = SolverTrace()
    engine = MeasuredEngine(Options((LINE,)), trace)
    engine.run([*EMPTY, step(0)])
    trace.horizon = lambda: 2
    engine.run([step(1), step(2)])
    engine.solve()
    horizons = by_horizon(trace)
    assert [*horizons] == [0, 1, 2]
    assert all(one.grounding > 0 for one in horizons.values())
    assert [one.searches for one in horizons.values()] == [0, 0, 1]
    assert horizons[2].results == (wire.Result.SAT,)
    assert trace.doing == ""


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
    assert re.match(r"grounding took \d\.\d\d s, for \d+ atoms and \d+ ground instances", profile)
    assert "most goes into" in profile
    for row in (r" 2 +120 +\d+ +\d\.\d+ s +\d\.\d+ s +1 +sat\n", r" event/3 +\d+", r"line\.lp:62 "):
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
    assert sum(one["searches"] for one in profile["horizons"]) >= 1
    assert sum(one["atoms"] for one in profile["horizons"]) == sum(
        one["atoms"] for one in profile["predicates"]
    )
    assert any(one["instances"] > 0 for one in profile["statements"])


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
    assert "most goes into searches" in said.out
    assert "planning was ended with a horizon of" in said.err
    assert "--profile-seconds" in said.err
    assert re.search(r"the search with horizon \d+ was not over after", said.out)


def test_profile_seconds_need_a_profile() -> None:
    with pytest.raises(OptionsError, match="--profile-seconds is for a profile: add --profile"):
        run([LINE, "--profile-seconds", "3"])


def test_a_time_limit_ends_by_ctrl_c() -> None:
    before = signal.getsignal(signal.SIGINT)
    ended = threading.Event()
    with BlockTimeLimit(0, ended.set) as limit:
        assert not limit.is_over
        os.kill(os.getpid(), signal.SIGINT)
        assert ended.wait(60)
    assert limit.is_over
    assert signal.getsignal(signal.SIGINT) is before


def test_a_time_limit_that_is_not_needed_leaves_nothing_behind() -> None:
    before = threading.active_count()
    with BlockTimeLimit(60, lambda: None) as limit:
        pass
    assert not limit.is_over
    assert threading.active_count() == before
