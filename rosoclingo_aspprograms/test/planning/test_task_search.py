"""Plans of the search for tasks: what stays, what is repaired, what clingo alone knows, replays."""

from __future__ import annotations

import io
from contextlib import redirect_stdout
from pathlib import Path
from typing import List

import pytest
from episode import DYN_RESET, RECORDING, RESET, SINGLE
from test_actions import World, write

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Result
from rosoclingo.engine import process
from rosoclingo.engine.flattening import flatten
from rosoclingo.engine.improving import Improver
from rosoclingo.engine.process import SearchProcess
from rosoclingo.engine.task import PlanningTask
from rosoclingo.errors import SearchProcessError
from rosoclingo.loop.journal import Ended, SearchEnded
from rosoclingo.loop.planner import task_search
from rosoclingo.loop.planner.planner import DEFAULT_PATIENCE, Planner
from rosoclingo.loop.planner.task_search import TaskSearch, found
from rosoclingo.loop.values.atoms import Action, Plan
from rosoclingo.loop.words import FAILURE
from rosoclingo.tools.plan import command as plan

ERRANDS = """
#include "{actions}".
#program base.
place(0..9). way(N,N+1) :- N = 0..8. way(N+1,N) :- N = 0..8.
robot(a;b). moves(R) :- robot(R). initially(at(R),0) :- robot(R).
request(visit(N)) :- place(N).
#program present(k,t).
own(ID,seen(ID),no,k) :- asked(ID,visit(N),k).
wants(ID,seen(ID),yes,k) :- asked(ID,visit(N),k).
action(R,look(ID),k) :- asked(ID,visit(N),k), robot(R).
needs(R,look(ID),at(R),N,k) :- asked(ID,visit(N),k), robot(R).
sets(R,look(ID),seen(ID),yes,k) :- asked(ID,visit(N),k), robot(R).
"""
LETTERS = """
#include "{actions}".
#program base.
robot(press). dial(1..10).
number(paper,1). initially(paper,1).
initially(dial(D),0) :- dial(D). initially(letter(a;b),no).
request(letter(a;b)). request(dials).
wants(letter(L),letter(L),yes) :- request(letter(L)).
wants(dials,dial(D),2) :- dial(D).
action(press,print(L)) :- request(letter(L)).
uses(press,print(L),paper,1) :- request(letter(L)).
sets(press,print(L),letter(L),yes) :- request(letter(L)).
action(press,turn(D,N)) :- dial(D), N = 0..3.
needs(press,turn(D,N),dial(D),N) :- dial(D), N = 0..3.
sets(press,turn(D,N),dial(D),(N+1)\\4) :- dial(D), N = 0..3.
"""
APART = """
#program layer(k,n).
:- occ(R,look(ID),n,k), occ(S,look(J),n,k), R < S.
#program moves(k,n).
:- goes(b,W,n,k).
"""
DARK = """
#include "{actions}".
#program base.
initially(lamp,off). initially(bell,silent). initially(room,unseen).
action(arm,ring). sets(arm,ring,bell,rung).
action(arm,mend). needs(arm,mend,lamp,off). sets(arm,mend,lamp,on).
action(arm,look). needs(arm,look,lamp,on). needs(arm,look,bell,rung). sets(arm,look,room,seen).
request(look). wants(look,room,seen).
#program layer(k,n).
gains(lamp,on,n,k) :- occ(arm,ring,n,k), {lit}.
"""


@pytest.fixture
def searches(monkeypatch: pytest.MonkeyPatch) -> List[SearchProcess]:
    """The processes that search for first plans."""
    begun: List[SearchProcess] = []
    begin = SearchProcess.__init__

    def note(made: SearchProcess, *arguments: object, **options: object) -> None:
        if options.get("plan") is None:
            begun.append(made)
        begin(made, *arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(SearchProcess, "__init__", note)
    return begun


@pytest.mark.parametrize("mode", [RECORDING, RESET, DYN_RESET, SINGLE])
def test_one_search_is_enough(mode: str, tmp_path: Path, searches: List[SearchProcess]) -> None:
    """Also where the state becomes the initial one each time that a goal has ended."""
    world = World(mode, [write(tmp_path, ERRANDS)], ["-c", "slots=4"])
    goals = [world.request(f"visit({n})") for n in (3, 5, 7, 9)]
    assert world.run() is None
    assert {goal.words[-1] for goal in goals} == {"succeeded"}
    if mode != RECORDING:  # which is told one goal after the other
        assert len(searches) == 1


def test_a_failure_is_repaired_without_a_search(
    tmp_path: Path, searches: List[SearchProcess]
) -> None:
    world = World(DYN_RESET, [write(tmp_path, ERRANDS)])
    goal = world.request("visit(3)")
    turn, failed = world.turn, []

    def fail_once() -> bool:
        looking = [r for r, action in world.acting.items() if action.startswith("look")]
        if looking and not failed:
            failed.append(world.answer(looking[0], FAILURE))
            return True
        return turn()

    world.turn = fail_once  # type: ignore[method-assign]
    assert world.run() is None
    assert failed
    assert goal.words[-1] == "succeeded"
    assert len(searches) == 1


def test_a_new_request_comes_after_what_is_left(
    tmp_path: Path, searches: List[SearchProcess]
) -> None:
    """The search for it begins where the plan before ends."""
    world = World(DYN_RESET, [write(tmp_path, ERRANDS)])
    world.improves = False
    first = world.request("visit(9)")
    turn, later = world.turn, []

    def ask_later() -> bool:
        if world.elapsed > 2 and not later:
            later.append(world.request("visit(1)"))
            return True
        return turn()

    world.turn = ask_later  # type: ignore[method-assign]
    assert world.run() is None
    assert [first.words[-1], later[0].words[-1]] == ["succeeded", "succeeded"]
    assert len(searches) == 2


def test_an_encoding_with_constraints_of_its_own_is_for_clingo(
    tmp_path: Path, searches: List[SearchProcess]
) -> None:
    file = write(tmp_path, ERRANDS)
    own = tmp_path / "own.lp"
    own.write_text(APART)
    world = World(DYN_RESET, [file, str(own)])
    goals = [world.request(f"visit({n})") for n in (2, 4)]
    assert world.run() is None
    assert {goal.words[-1] for goal in goals} == {"succeeded"}
    assert not searches
    assert {robot for robot, action in world.published if action.startswith("go")} == {"a"}


@pytest.mark.parametrize("lit", [True, False])
def test_a_plan_of_clingos_is_executed_on_the_task(lit: bool, tmp_path: Path) -> None:
    """If it is lit, the bell puts on the lamp, for clingo alone."""
    text = DARK.replace("{lit}", "n > 0" if lit else "n < 0")
    world = World(DYN_RESET, [write(tmp_path, text)])
    goal = world.request("look")
    assert world.run() is None
    assert goal.words[-1] == "succeeded"
    assert ("mend" in world.done) != lit
    said = [text for text in world.warnings if "does not allow the plan" in text]
    assert ["arm: look is not possible: lamp is off, and not on" in text for text in said] == (
        [True] if lit else []
    )


def test_what_takes_long_is_left_to_clingo_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process that ends without a plan costs nothing but its time."""
    monkeypatch.setattr(TaskSearch, "find", lambda *_: None)
    world = World(DYN_RESET, [write(tmp_path, ERRANDS)])
    goal = world.request("visit(3)")
    assert world.run() is None
    assert goal.words[-1] == "succeeded"
    assert Ended.LAYERED in [
        entry.event.how for entry in world.journal if isinstance(entry.event, SearchEnded)
    ]


def test_the_task_is_printed(tmp_path: Path) -> None:
    said = io.StringIO()
    with redirect_stdout(said):
        status = plan.run(
            ["--mode", DYN_RESET, "--task", "--goal", "visit(2)", write(tmp_path, ERRANDS)]
        )
    assert status == 0
    lines = said.getvalue().splitlines()
    assert "at(a) is 0" in lines
    assert "request 1 wants seen(1) = yes" in lines
    assert "a: 0 -> 2, cost 2" in lines
    assert lines.index("a: look(1), cost 1") < next(
        number for number, line in enumerate(lines) if line.startswith("plan: ")
    )


def test_a_search_that_cannot_be_started_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Then clingo plans alone."""

    def refuse() -> List[str]:
        raise SearchProcessError("it is not compiled: build the workspace")

    monkeypatch.setattr(process, "_command", refuse)
    monkeypatch.setattr(process, "_SPARE", process.Spare())
    world = World(DYN_RESET, [write(tmp_path, ERRANDS)])
    goals = [world.request(f"visit({n})") for n in (3, 5)]
    assert world.run() is None
    assert {goal.words[-1] for goal in goals} == {"succeeded"}
    said = [text for text in world.warnings if "plans come from clingo alone" in text]
    assert len(said) == 1
    assert "build the workspace" in said[0]


def followed_plan(folder: Path) -> Planner:
    """Returns a planner in step 1 with a plan that got worse: the other robot is free again.

    Robot a has begun the first request, and not the second one.
    """
    planner = Planner(Engine(Options((write(folder, ERRANDS),), ())), DEFAULT_PATIENCE)
    planner.begin()
    planner.tell(["event(info,at(b,9),0)", "event(info,blocked(8,9),0)"])
    planner.tell(["event(1,visit(1),0)", "event(2,visit(8),0)"])
    found = Plan(planner.search(0, 10_000, lambda: False).symbols)
    assert [(one.actuator, one.name) for one in found.actions(1)] == [("a", "go(1)")]
    planner.tell(["event(commit,do(a,go(1)),1)", "event(a,success,1)"])
    planner.tell(["event(info,unblocked(8,9),1)"])
    assert planner.search(1, 10_000, lambda: False).result is Result.SAT
    assert planner.may_improve
    return planner


def test_a_better_plan_is_followed(tmp_path: Path) -> None:
    """So it is not found again, and what is left of it stands after news."""
    planner = followed_plan(tmp_path)
    ended: List[Ended] = []
    planner.note = lambda search: ended.append(search.how)
    better = planner.improve(1, lambda: False)
    assert better is not None
    expected = [("a", "look(1)", 2), ("b", "go(8)", 2), ("b", "look(2)", 3)]
    found = Plan(better.symbols).actions_from(2)
    assert sorted(map(str, found)) == [str(Action(*one)) for one in expected]
    assert planner.improve(1, lambda: False) is None
    assert ended[0] is Ended.BETTER
    assert Ended.BETTER not in ended[1:]


@pytest.mark.parametrize("error", [SearchProcessError("not compiled"), OSError("too many")])
def test_better_plans_are_looked_for_after_a_search_that_could_not_begin(
    error: Exception, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    planner = followed_plan(tmp_path)
    warnings: List[str] = []
    planner.warn_of_search(warnings.append)
    before, command = planner.quality, process._command

    def refuse() -> List[str]:
        raise error

    monkeypatch.setattr(process, "_command", refuse)
    assert planner.improve(1, lambda: False) is None
    assert planner.quality == before is not None
    assert not planner.may_improve  # or it would be tried without end
    assert str(error) in warnings[0]
    monkeypatch.setattr(process, "_command", command)
    planner.tell(["event(info,unblocked(2,3),1)"])
    assert planner.search(1, 10_000, lambda: False).result is Result.SAT
    assert planner.may_improve
    assert planner.improve(1, lambda: False) is not None


def test_clingo_looks_for_layers_beside_a_search_that_is_late(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, searches: List[SearchProcess]
) -> None:
    """Whichever finds a plan first ends the other."""
    monkeypatch.setattr(task_search, "_ALONE_SECONDS", -1.0)
    world = World(DYN_RESET, [write(tmp_path, ERRANDS)])
    goals = [world.request(f"visit({n})") for n in (3, 5)]
    assert world.run() is None
    assert {goal.words[-1] for goal in goals} == {"succeeded"}
    assert searches
    assert all(process.has_ended for process in searches)
    ended = {one.event.how for one in world.journal if isinstance(one.event, SearchEnded)}
    assert Ended.LAYERED in ended or len(searches) == 1


@pytest.mark.costly
def test_requests_are_met_while_others_are_searched_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One paper is left, which is enough for one letter, and the dials have a million positions."""
    monkeypatch.setattr(process, "_MOMENT_SECONDS", 0.01)
    monkeypatch.setattr(task_search, "_ALONE_SECONDS", 0.3)
    world = World(DYN_RESET, [write(tmp_path, LETTERS)])
    goals = [world.request(text) for text in ("letter(a)", "dials", "letter(b)")]
    for _ in range(200):
        ended = [goal for goal in goals if goal.words[-1:] == ["succeeded"]]
        if len(ended) == 2:
            break
        assert world.step() is None
    assert goals[1] in ended
    assert len(ended) == 2


DISHES = """
#include "{actions}".
#program base.
cook(1..3). dish(1..4). place(0..3). way(N,N+1) :- N = 0..2. way(N+1,N) :- N = 0..2.
moves(cook(C)) :- cook(C). initially(at(cook(C)),C-1) :- cook(C).
initially(dish(D),raw) :- dish(D). initially(last,0). number(salt,3).
action(cook(C),chop(D)) :- cook(C), dish(D).
needs(cook(C),chop(D),at(cook(C)),D-1) :- cook(C), dish(D).
needs(cook(C),chop(D),dish(D),raw) :- cook(C), dish(D).
sets(cook(C),chop(D),dish(D),done) :- cook(C), dish(D).
{rules}
request(want(D)) :- dish(D). wants(want(D),dish(D),done) :- dish(D).
"""
TOGETHER = {
    "nothing in common": "",
    "a board that one occupies": "occupies(cook(C),chop(D),board) :- cook(C), dish(D).",
    "a variable that nothing asks for": "sets(cook(C),chop(D),last,D) :- cook(C), dish(D).",
    "a number": "uses(cook(C),chop(D),salt,1) :- cook(C), dish(D).\n"
    "action(cook(C),shop) :- cook(C). needs(cook(C),shop,at(cook(C)),0) :- cook(C).\n"
    "fills(cook(C),shop,salt) :- cook(C).",
}


@pytest.mark.costly
@pytest.mark.parametrize("together", TOGETHER)
def test_the_makespan_of_the_search_is_the_last_step_of_the_plan(
    together: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    makespans: List[int] = []

    def note(number: str, task: PlanningTask, plan: List[int], **options: int) -> SearchEnded:
        value = Improver(tuple(flatten(task)), lambda: False).value(plan)
        makespans.append(value[0])
        return found(number, task, plan, **options)

    monkeypatch.setattr(task_search, "found", note)
    world = World(DYN_RESET, [write(tmp_path, DISHES.replace("{rules}", TOGETHER[together]))])
    world.improves = False
    goals = [world.request(f"want({dish})") for dish in range(1, 5)]
    horizons: List[int] = []
    publish = world.publish

    def look(actuator: str, action: str) -> None:
        horizons.append(max(each.step for each in world.loop.state.plan.actions_from(0)))
        publish(actuator, action)

    world.publish = look  # type: ignore[method-assign]
    assert world.run() is None
    assert {goal.words[-1] for goal in goals} == {"succeeded"}
    assert horizons[0] == makespans[0]
