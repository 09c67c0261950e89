"""Several horizons take turns when one after the other takes too long, and the modes do as ever."""

from __future__ import annotations

import dataclasses
import time
from pathlib import Path
from typing import Any, Collection, Iterable, List, Sequence

import pytest
from conftest import PACKAGE, Make, System
from test_replay_inbox import Session, replay_alike

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import (
    AssignExternal,
    Assumed,
    Assumption,
    Command,
    CostBound,
    Ground,
    Improvement,
    Outcome,
    Part,
    Reply,
    Result,
    Truth,
)
from rosoclingo.bags.read.run import Run
from rosoclingo.bags.replay.input_schedule import input_schedule
from rosoclingo.in_process.parts import SINGLE, make_parts
from rosoclingo.in_process.simulation import SimulatedSystem
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.inputs.replay_inbox import ReplayInbox, decode, encode
from rosoclingo.loop.journal import (
    CommandDone,
    Ended,
    Event,
    LoopWaits,
    PlanFound,
    SearchEnded,
)
from rosoclingo.loop.journal import decode as decode_event
from rosoclingo.loop.journal import encode as encode_event
from rosoclingo.loop.planner.planner import Planner, PlannerState
from rosoclingo.loop.planner.shortening import cheapen
from rosoclingo.loop.values.atoms import Plan, query
from rosoclingo.loop.values.snapshot import plain, remade
from rosoclingo.loop.values.solver import Forwarding, Solver

LINE = str(PACKAGE / "example" / "line.lp")
AT_ONCE = 1e-6  # seconds
BUSY = ":- holds(want(_,_),t-1), not do(robot,_,t), not event(info,passed,t)."  # or to and fro
DEAR = "#minimize { 4-t,t : do(robot,_,t), t < 3; 1,t : do(robot,_,t), t >= 3 }."  # at first
WALK = [f"go({cell})" for cell in range(2, 7)]  # the way to 6
MODES = ["dynamic.incremental.recording", "dynamic.incremental.dyn_reset", SINGLE]


def assumes_atoms(assumed: Iterable[Assumed]) -> bool:
    return any(isinstance(one, (Assumption, CostBound)) for one in assumed)


class Slow(Forwarding):
    """A solver whose time is over at once with some horizons, without assumptions.

    Attributes:
        asked: The query that is true.
        grounded: The steps whose transition was grounded, in order.
    """

    def __init__(self, solver: Solver, hard: Collection[int]) -> None:
        super().__init__(solver)
        self.events_are_facts = False
        self.grounded: List[str] = []
        self._hard = [query(horizon) for horizon in hard]
        self.asked = ""

    def run(self, commands: Sequence[Command]) -> Reply:
        for one in commands:
            if isinstance(one, AssignExternal) and one.name.startswith("query"):
                self.asked = one.name if one.value is Truth.TRUE else self.asked
            if isinstance(one, Ground):
                self.grounded += [p.parameters[0] for p in one.parts if p.name == "transition"]
        return super().run(commands)

    def solve(self, assumptions: Any = (), stopped: Any = None, improved: Any = None) -> Outcome:
        if assumes_atoms(assumptions) or self.asked not in self._hard:
            return super().solve(assumptions, stopped, improved)
        return Outcome(Result.UNKNOWN, interrupted=True)


def simulation(
    mode: str, hard: Collection[int], *, steps: int = 20, seconds: float = AT_ONCE
) -> Any:
    parts = make_parts(mode, Options((LINE,), ("-c", f"steps={steps}")), ("-c", f"steps={steps}"))
    solver = Slow(parts.planner, hard)
    parts = dataclasses.replace(parts, planner=solver)
    return SimulatedSystem(parts.loop, one_by_one_seconds=seconds), solver


def changed_line(folder: Path, rule: str) -> str:
    """Returns the path of the line's encoding with a rule in the place of what it minimises."""
    lines = [one for one in Path(LINE).read_text().splitlines() if not one.startswith("#minimize")]
    lines.insert(lines.index("#program query(t)."), rule)
    file = folder / "changed.lp"
    file.write_text("\n".join(lines))
    return str(file)


def reach(run: SimulatedSystem, request: str) -> None:
    """Runs until what was asked for is done."""
    goal = run.request(request)
    assert run.run() is None
    assert goal.words == ["accepted", "succeeded"]


def searches(run: SimulatedSystem) -> List[SearchEnded]:
    return [one.event for one in run.journal if isinstance(one.event, SearchEnded)]


@pytest.mark.parametrize("mode", MODES)
def test_a_plan_is_found_beyond_a_horizon_that_never_ends(mode: str) -> None:
    run, solver = simulation(mode, [2, 3, 4])
    reach(run, "visit(6)")
    assert [action for _, action in run.published] == WALK
    (first, *_) = searches(run)
    assert (first.how, first.horizon) == (Ended.AHEAD, 5)
    assert first.symbols
    assert solver.grounded == sorted(set(solver.grounded), key=int)  # each step once
    second = run.request("visit(3)")
    assert run.run() is None
    assert second.words == ["accepted", "succeeded"]
    assert solver.grounded == sorted(set(solver.grounded), key=int)


def test_with_zero_seconds_it_is_not_looked_ahead() -> None:
    run, _ = simulation(MODES[0], [], seconds=0.0)
    run.request("visit(6)")
    assert run.run() is None
    assert not searches(run)


def test_the_last_horizon_is_never_exceeded() -> None:
    run, solver = simulation(MODES[0], [2, 3], steps=4)
    goal = run.request("visit(6)")

    # The proof that there is no plan with the hard ones never ends, so it is interrupted.
    turns = iter(range(1_000))
    state = run.loop.state
    interrupted = state.interrupted
    state.interrupted = lambda: next(turns) > 100 or interrupted()
    with pytest.raises(StopIteration):
        run.run()
    assert max(map(int, solver.grounded)) <= 4
    assert goal.words != ["accepted", "succeeded"]


def make_late_once(solver: Slow, horizon: int) -> None:
    """Has the first search with a horizon never end, unless it is told to."""
    hard = [horizon]
    solve = solver.solve

    def late(assumptions: Any = (), stopped: Any = None, improved: Any = None) -> Outcome:
        if stopped is not None and hard and solver.asked == query(horizon):
            hard.clear()
            while not stopped():
                time.sleep(0.001)
            return Outcome(Result.UNKNOWN, interrupted=True)
        return solve(assumptions, stopped, improved)

    solver.solve = late  # type: ignore[method-assign]


def test_all_horizons_are_refuted() -> None:
    """A horizon is late once, and has a turn after that, in which it is refuted."""
    run, solver = simulation(MODES[0], [], steps=4)
    goal = run.request("visit(6)")
    make_late_once(solver, 2)
    assert run.run() is not None
    assert goal.words[-1] == "aborted"
    assert [one.how for one in searches(run)] == [Ended.AHEAD_REFUTED]
    assert max(map(int, solver.grounded)) == 4


def test_a_plan_that_the_mode_does_not_ask_for_is_forgotten(tmp_path: Path) -> None:
    """A mode that ends before it asks for the plan is told that there was none."""
    text = (PACKAGE / "modes" / f"{MODES[0]}.lp").read_text()
    changed = text.replace("event(info,query(steps),0)", "event(info,horizon(5),0)")
    assert changed != text
    mode = tmp_path / "early.lp"
    mode.write_text(changed)
    run, solver = simulation(str(mode), [])
    goal = run.request("visit(6)")
    make_late_once(solver, 2)
    assert run.run() is None
    assert goal.words[-1] == "succeeded"
    assert searches(run)[0].horizon == 5
    asked = [one.event.command for one in run.journal if isinstance(one.event, CommandDone)]
    assert "exit" in asked
    assert asked.index("plan(5)") > asked.index("plan(4)") > asked.index("exit")


@pytest.mark.parametrize(
    ("rule", "hard", "patience"),
    [("", [2, 3], 0.0), (BUSY, range(1, 12), 0.0), (DEAR, [], 60.0), (DEAR, [2, 3, 4], 0.0)],
)
def test_a_replay_takes_what_was_found_ahead(
    system: Make,
    tmp_path: Path,
    rule: str,
    hard: Collection[int],
    patience: float,
) -> None:
    encoding = changed_line(tmp_path, rule) if rule else LINE

    def make(inbox: Inbox, hard: Collection[int], seconds: float) -> System:
        made = system(MODES[0], "-c", "steps=20", encoding=[encoding], inbox=inbox)
        planner = made.loop.state.planner
        planner.one_by_one_seconds, planner.patience = seconds, patience
        planner._solver = planner._requests._solver = Slow(planner._solver, hard)
        return made

    recorded_run = Session(make(Inbox(), hard, AT_ONCE), lambda *_: "success")
    recorded_run.start()
    recorded_run.goal("g0", "visit(6)")
    recorded_run.goals["g0"].wait()
    recorded_run.wait_for(lambda events: isinstance(events[-1], LoopWaits))
    recorded = list(recorded_run.entries)
    found = [one.event for one in recorded if isinstance(one.event, SearchEnded)]
    assert any(one.how in (Ended.AHEAD, Ended.AHEAD_CALLED) for one in found)
    inbox = ReplayInbox(decode(encode(input_schedule(Run(recorded)))))
    again = replay_alike(make(inbox, [], 0.0), recorded, 0)
    assert [one.event for one in again if isinstance(one.event, SearchEnded)] == found


@pytest.mark.parametrize(
    "event",
    [SearchEnded(Ended.AHEAD, ("do(r,a,1)",), horizon=7, grounded=9),
     SearchEnded(Ended.AHEAD_CALLED, grounded=4), SearchEnded(Ended.CUT, ("a",), round=2)],
)  # fmt: skip
def test_the_journal_has_it(event: Event) -> None:
    class Message:
        kind, id, text, details, seconds = encode_event(event)

    assert decode_event(Message) == event


def test_it_is_saved_what_is_grounded_ahead() -> None:
    run, _ = simulation(MODES[0], [2, 3, 4])
    run.request("visit(6)")
    planner = run.loop.state.planner
    while planner._kept is None:
        if not run._is_prepared:
            run._is_prepared = True
            run.loop.prepare()
        run.step()
    saved = remade(PlannerState, plain(planner))
    assert saved._ahead == planner._ahead
    assert saved._ahead
    assert saved._kept == planner._kept


def test_a_restored_planner_knows_the_last_horizon() -> None:
    """The mode may not name it again before a search that never ends without it."""
    run, _ = simulation(MODES[0], [])
    reach(run, "visit(6)")
    planner = run.loop.state.planner
    assert remade(PlannerState, plain(planner)).last_horizon == 20
    planner.note_last_horizon(None)  # as a controller says that was just restored
    assert planner.last_horizon == 20


# Plans without pauses are looked for first.

LATE = """
#program transition(t). { do(robot,go,t) }.
#program query(t). #external query(t). :- query(t), not do(robot,go,t). :- query(t), t < 4.
#show do/3.
"""


@pytest.mark.parametrize(
    ("rule", "passed", "steps"),
    [
        ("", 0, [1, 2, 3, 4]),
        ("", 1, [2, 3, 4]),
        (":- do(robot,go,t), t = 2.", 0, [4]),
        (":- do(robot,go,t), t = 3.", 0, [4]),
    ],
)
def test_nobody_pauses_without_need(
    tmp_path: Path, rule: str, passed: int, steps: List[int]
) -> None:
    """From the current step on; where that is needed, all plans are looked for."""
    file = tmp_path / "late.lp"
    file.write_text(f"{LATE} #program transition(t). {rule}")
    solver = Slow(Engine(Options((str(file),), ("--sign-def=neg",))), [2])
    planner = Planner(solver, one_by_one_seconds=AT_ONCE)
    ended: List[SearchEnded] = []
    planner.note = ended.append
    planner.begin()
    planner.note_last_horizon(20)
    planner.query(2, None, [1, 2])
    assert planner.search(passed, 2, lambda: False).result is Result.UNSAT
    assert [one.horizon for one in ended] == [4]
    acts = sorted(one.step for one in Plan(ended[0].symbols).actions_from(0))
    assert acts == steps
    forbidden = [atom for atom, value in planner.externals().items() if value is not Truth.FALSE]
    assert forbidden == [query(2)]


# A plan beyond the shortest horizon is followed, and shortened.

RESETS = ["dynamic.incremental.reset", "dynamic.incremental.dyn_reset", MODES[0], SINGLE]
FAR = 12  # a horizon from which on plans are found


def far_simulation(mode: str, folder: Path, *, improves: bool) -> SimulatedSystem:
    options = Options(
        (changed_line(folder, BUSY),), ("-c", "steps=40", "--rand-freq=1", "--seed=1")
    )
    parts = make_parts(mode, options, ("-c", "steps=40"))
    parts = dataclasses.replace(parts, planner=Slow(parts.planner, range(1, FAR)))
    return SimulatedSystem(parts.loop, one_by_one_seconds=AT_ONCE, improves=improves)


@pytest.mark.parametrize("mode", RESETS)
def test_a_plan_that_is_followed_ends_no_later(mode: str, tmp_path: Path) -> None:
    """Though nearer horizons are hard, as often as the planner is asked, and resets come."""
    run = far_simulation(mode, tmp_path, improves=False)
    reach(run, "visit(6)")
    assert max(one.horizon for one in searches(run)) == FAR
    assert run.loop.state.externals.grounded <= set(range(FAR + 1))


@pytest.mark.parametrize("mode", RESETS)
def test_a_plan_is_shortened_while_robots_act(mode: str, tmp_path: Path) -> None:
    """As soon as somebody acts by it; it is not told of that the horizon is longer."""
    run = far_simulation(mode, tmp_path, improves=True)
    reach(run, "visit(6)")
    assert [action for _, action in run.published] == WALK
    as_found = far_simulation(mode, tmp_path, improves=False)
    as_found.request("visit(6)")
    assert as_found.run() is None
    assert len(as_found.published) > len(WALK)
    first, *others = [one for one in searches(run) if one.quality]
    assert (first.how, str(first.quality)) == (Ended.BETTER, "5/5")
    assert all(one.how is Ended.AS_BEFORE for one in others)


# The cheapest plan of any horizon.


@pytest.mark.parametrize("mode", RESETS)
def test_a_cheaper_plan_may_be_longer(mode: str, tmp_path: Path) -> None:
    file = changed_line(tmp_path, DEAR)
    actions = {}
    for patience in (0.0, 60.0):
        parts = make_parts(mode, Options((file,), ("-c", "steps=8")), ("-c", "steps=8"))
        run = SimulatedSystem(parts.loop, one_by_one_seconds=2.0, patience=patience)
        reach(run, "visit(3)")
        plans = [one.event for one in run.journal if isinstance(one.event, PlanFound)]
        actions[patience] = next(plan.actions for plan in plans if plan.actions)
        assert plans[0].is_best
    assert actions[0.0] == ("do(robot,go(2),1)", "do(robot,go(3),2)")
    assert actions[60.0] == ("do(robot,go(2),3)", "do(robot,go(3),4)")


# A plan beyond the shortest horizon becomes cheaper, if its encoding minimises something.

EARLY = "#minimize { t,t : do(robot,_,t) }."  # the less is done, and the sooner, the better


class Hasty(Slow):
    """A solver whose searches without assumptions end with their first answer set."""

    def solve(self, assumptions: Any = (), stopped: Any = None, improved: Any = None) -> Outcome:
        found: List[Improvement] = []
        assumes = assumes_atoms(assumptions)

        def has_to_end() -> bool:
            return bool(found and not assumes) or (stopped is not None and stopped())

        def tell(one: Improvement) -> None:
            found.append(one)
            if improved is not None:
                improved(one)

        return super().solve(assumptions, has_to_end, tell)


@pytest.mark.parametrize("mode", RESETS)
def test_a_plan_becomes_cheaper_while_robots_act(mode: str, tmp_path: Path) -> None:
    """Its cost is proven to be the lowest then, and no other plan takes its place."""
    options = Options((changed_line(tmp_path, EARLY),), ("-c", "steps=40", "--sign-def=pos"))
    parts = make_parts(mode, options, ("-c", "steps=40"))
    parts = dataclasses.replace(parts, planner=Hasty(parts.planner, range(1, FAR)))
    run = SimulatedSystem(parts.loop, one_by_one_seconds=AT_ONCE, improves=True)
    reach(run, "visit(6)")
    assert [action for _, action in run.published] == WALK
    ahead, better, *_ = [one for one in searches(run) if one.quality]
    assert (ahead.how, better.how) == (Ended.AHEAD, Ended.BETTER)
    assert ahead.quality is not None
    assert better.quality is not None
    assert not ahead.quality.is_best
    assert better.quality.is_best
    assert better.quality.cost < ahead.quality.cost


HELP = """
#program base. robot(a;b).
#program transition(t). { helps(R,t) : robot(R) }.
#minimize { 1,R,t : robot(R), not helps(R,t) }.
"""


@pytest.mark.parametrize(
    ("shown", "how", "quality"),
    [
        ("do(R,help,t) :- helps(R,t). #show do/3.", Ended.BETTER, "1/1"),
        ("#show do(R,help,t) : helps(R,t).", Ended.AS_BEFORE, "3/"),
    ],
)
def test_a_cheaper_plan_has_the_same_past(
    tmp_path: Path, shown: str, how: Ended, quality: str
) -> None:
    """Nothing is proven where actions are shown as terms, which cannot be assumed."""
    file = tmp_path / "help.lp"
    file.write_text(f"{HELP} {shown}")
    solver = Engine(Options((str(file),)))
    solver.run([Ground((Part("base"), *(Part("transition", (step,)) for step in "12")))])
    plan = Plan(("do(a,help,1)",))  # nobody acts in step 2 yet
    ended = cheapen(
        solver, lambda _, found: found[-1].cost, plan, (3,), step=1, stopped=lambda: False
    )
    assert (ended.how, str(ended.quality)) == (how, quality)
    first = ["do(a,help,1)"]
    more = ["do(a,help,2)", "do(b,help,2)"] if how is Ended.BETTER else []
    assert sorted(ended.symbols) == first + more
