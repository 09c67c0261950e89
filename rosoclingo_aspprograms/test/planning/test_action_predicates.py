"""Tests each predicate that actions.lp takes, by a small task that it decides."""

from __future__ import annotations

from pathlib import Path
from typing import Dict, List, Sequence

import pytest
from test_actions import ACTIONS, World

from rosclingo.solver.options import Options
from rosoclingo.engine.task import PlanningTask
from rosoclingo.in_process.inputs import read_input
from rosoclingo.in_process.parts import make_parts
from rosoclingo.in_process.simulation import SimulatedSystem
from rosoclingo.in_process.system import Request
from rosoclingo.loop.journal import PlanFound, Status, StatusSet
from rosoclingo.loop.situation import Situation
from rosoclingo.why.explainer import Explainer

MODE = "dynamic.incremental.dyn_reset"


class Task(World):
    """A task of a few lines.

    Attributes:
        ends: How actions end the next time that they are done; all others succeed.
        cancels: Goals that are cancelled while an action is done.
        rounds: What was done at the same time, by actuator.
    """

    def __init__(self, folder: Path, text: str) -> None:
        file = folder / "task.lp"
        file.write_text(f'#include "{ACTIONS}".\n#program base.\n{text}')
        self.ends: Dict[str, str] = {}
        self.cancels: Dict[str, Request] = {}
        self.rounds: List[Dict[str, str]] = []
        super().__init__(MODE, [str(file)])

    def turn(self) -> bool:
        """Ends all actions of a step."""
        if self.acting:
            self.rounds.append(dict(self.acting))
        for actuator, action in sorted(self.acting.items()):
            if action in self.cancels:
                self.cancel(self.cancels.pop(action))
            self.answer(actuator, self.ends.pop(action, "success"))
        return bool(self._items)

    def meet(self, *requests: str) -> List[Request]:
        """Asks for something, and goes on until there is nothing to do."""
        goals = [self.request(text) for text in requests]
        self.go_on()
        return goals

    def go_on(self) -> None:
        failure = self.run()
        assert failure is None, failure


def words(goals: List[Request]) -> List[str]:
    return [goal.words[-1] for goal in goals]


LAMP = """
initially(lamp,off).
action(arm,(press;mend)).
needs(arm,press,lamp,off). sets(arm,press,lamp,on).
request(light). wants(light,lamp,on).
"""


def test_fails(tmp_path: Path) -> None:
    """After a failure, the variable has the value for that."""
    task = Task(tmp_path, f"{LAMP} fails(arm,press,lamp,broken). needs(arm,mend,lamp,broken). "
                          "sets(arm,mend,lamp,off).")  # fmt: skip
    task.ends["press"] = "failure"
    assert words(task.meet("light")) == ["succeeded"]
    assert task.done == ["press", "mend", "press"]


def test_without_fails(tmp_path: Path) -> None:
    """Else nothing has changed, and it is tried again."""
    task = Task(tmp_path, LAMP)
    task.ends["press"] = "failure"
    assert words(task.meet("light")) == ["succeeded"]
    assert task.done == ["press", "press"]


def test_what_is_unknown_waits_for_a_message(tmp_path: Path) -> None:
    task = Task(tmp_path, f"{LAMP} says(seen(X),lamp,X) :- X = (on;off).")
    task.ends["press"] = "unknown"
    goals = task.meet("light")
    assert (words(goals), task.done) == (["accepted"], ["press"])
    task.tell("info", "seen(off)")
    task.go_on()
    assert (words(goals), task.done) == (["succeeded"], ["press", "press"])


@pytest.mark.parametrize(
    ("values", "done"), [(["on"], []), (["off"], ["press"]), (["blue"], ["press"]),
                         (["on", "off"], ["press"])],
)  # fmt: skip
def test_says(values: List[str], done: List[str], tmp_path: Path) -> None:
    """A message that an encoding does not know changes nothing, nor do two that differ."""
    task = Task(tmp_path, f"{LAMP} says(seen(X),lamp,X) :- X = (on;off).")
    for value in values:
        task.tell("info", f"seen({value})")
    task.go_on()
    assert words(task.meet("light")) == ["succeeded"]
    assert task.done == done


JOBS = """
initially(J,todo) :- J = (a;b).
action(left,do(a)). action(right,do(b)).
needs(R,do(J),J,todo) :- action(R,do(J)).
sets(R,do(J),J,done) :- action(R,do(J)).
request((a;b)). wants(J,J,done) :- J = (a;b).
"""


@pytest.mark.parametrize(
    ("shared", "steps"), [("", 1), ("occupies(R,do(J),bench) :- action(R,do(J)).", 2)]
)
def test_occupies(shared: str, steps: int, tmp_path: Path) -> None:
    """Two actuators that need the same thing alone act one after the other."""
    task = Task(tmp_path, JOBS + shared)
    assert words(task.meet("a", "b")) == ["succeeded"] * 2
    assert len(task.rounds) == steps
    assert sorted(task.done) == ["do(a)", "do(b)"]


@pytest.mark.parametrize(("costs", "cost"), [("", 2), ("costs(left,do(a),9).", 10)])
def test_costs(costs: str, cost: int, tmp_path: Path) -> None:
    """A plan costs what its actions do, 1 if nothing is said of one."""
    task = Task(tmp_path, JOBS + costs)
    task.meet("a", "b")
    plans = [entry.event for entry in task.journal if isinstance(entry.event, PlanFound)]
    assert cost in [plan.quality.cost[0] for plan in plans if plan.quality is not None]


WORK = """
initially(J,todo) :- J = (a;b;c).
action(R,do(J)) :- R = (quick;slow), J = (a;b;c).
needs(R,do(J),J,todo) :- action(R,do(J)).
sets(R,do(J),J,R) :- action(R,do(J)).
sets(R,do(J),done(J),yes) :- action(R,do(J)).
initially(done(J),no) :- J = (a;b;c).
request((a;b;c)). wants(J,done(J),yes) :- J = (a;b;c).
duration(quick,do(J),5) :- J = (a;b;c).
"""


@pytest.mark.parametrize(
    ("said", "slow"),
    [
        ("duration(slow,do(J),20) :- J = (a;b;c).", 0),
        ("duration(slow,do(J),8) :- J = (a;b;c).", 1),
        ("duration(slow,do(J),13) :- J = (a;b;c). prefers(makespan).", 1),
        ("duration(slow,do(J),16) :- J = (a;b;c). prefers(makespan).", 0),
        ("duration(slow,do(J),8) :- J = (a;b;c). costs(slow,do(J),9) :- J = (a;b;c). "
         "prefers(cost).", 0),
    ],
)  # fmt: skip
def test_who_acts_depends_on_how_long_it_takes(said: str, slow: int, tmp_path: Path) -> None:
    """Three things to do: by default, all of them together are to wait as little as possible."""
    task = Task(tmp_path, WORK + said)
    assert words(task.meet("a", "b", "c")) == ["succeeded"] * 3
    assert sum("slow" in actors for actors in task.rounds) == slow


@pytest.mark.parametrize("weight", ["", "weight(b,9)."])
def test_what_is_due_comes_first(weight: str, tmp_path: Path) -> None:
    """The heavier of two requests that cannot both be in time, and else the earlier one."""
    text = WORK.replace("R = (quick;slow)", "R = quick").replace(",5)", ",30)")
    task = Task(tmp_path, text + "due(a,30). due(b,40)." + weight)
    assert words(task.meet("c", "b", "a")) == ["succeeded"] * 3
    assert task.done == (["do(b)", "do(a)", "do(c)"] if weight else ["do(a)", "do(b)", "do(c)"])


class Slow(Task):
    """Asks for c after the first step, which takes 10 s."""

    def turn(self) -> bool:
        if self.acting and not self.clock:
            self.clock = 10.0
            self.request("c")
        return super().turn()


def test_deadlines_count_from_when_requests_have_come(tmp_path: Path) -> None:
    text = WORK.replace("R = (quick;slow)", "R = quick")
    world = Slow(tmp_path, text + "due(J,100) :- J = (a;b;c).")
    tasks: List[PlanningTask] = []
    world.loop.state.planner.show_tasks(tasks.append)
    world.meet("a", "b")
    dues = [sorted(task.times.due.values()) for task in tasks if task.times is not None]
    assert dues[0] == [100, 100]
    assert [90, 100] in dues


def test_clients_are_told_when_their_requests_will_be_met(tmp_path: Path) -> None:
    """One does all, each thing in 5 s; one of them cannot be done in time."""
    text = WORK.replace("R = (quick;slow)", "R = quick")
    world = Task(tmp_path, text + "due(J,7) :- J = (a;b;c).")
    goals = world.meet("a", "b", "c")
    first = [[line for line in goal.lines if " in " in line or "late" in line] for goal in goals]
    assert sorted(lines[0] for lines in first) == [f"expected in {n} s" for n in (10, 15, 5)]
    assert sorted(lines[1] for lines in first) == [f"late by {n} s" for n in (0, 3, 8)]


def test_clients_are_told_that_actuators_wait_for_each_other(tmp_path: Path) -> None:
    """A dish cooks for 60 s before the cook hands it over, while another thing is brought."""
    text = """
    actuator(cook;waiter). initially(dish,raw). initially((door;table),none).
    action(cook,boil). needs(cook,boil,dish,raw). sets(cook,boil,dish,done). duration(cook,boil,60).
    action(waiter,give). needs(waiter,give,dish,done). sets(waiter,give,table,set).
    duration(waiter,give,5).
    action(waiter,open). sets(waiter,open,door,set). duration(waiter,open,8).
    request(dinner). request(air). due(dinner,50).
    wants(dinner,table,set). wants(air,door,set).
    """
    world = Task(tmp_path, text)
    dinner, air = world.meet("dinner", "air")
    told = [line for line in dinner.lines if " in " in line or "late" in line]
    assert told[:2] == ["expected in 65 s", "late by 15 s"]
    assert next(line for line in air.lines if " in " in line) == "expected in 8 s"


def test_times_do_not_move_if_all_goes_as_planned(tmp_path: Path) -> None:
    """An actuator that is busy is not expected to begin anew when another one answers.

    Nor has clingo anything to say about the schedules.
    """
    folder = Path(ACTIONS).parents[1] / "restaurant"
    files = (str(folder / "restaurant.lp"), str(folder / "instances" / "small.lp"))
    said: List[str] = []
    parts = make_parts("dynamic.incremental.recording", Options(files), log=said.append)
    requests = ("serve(soup,t1)", "clear(t2)", "serve(steak,t3)")
    inputs = [read_input(f"goal:{request}") for request in requests]
    run = SimulatedSystem(parts.loop, inputs, seconds=lambda actuator, action: None)
    assert run.run() is None
    assert said == []
    ends = {
        entry.event.goal: entry.seconds
        for entry in run.journal
        if isinstance(entry.event, StatusSet) and entry.event.status is Status.SUCCEEDED
    }
    for goal in run.goals:
        told = [line for line in goal.lines if line.startswith("expected")]
        assert told == [f"expected in {ends[goal.id]:.0f} s"]


SWITCH = """
initially(lamp,off). initially(fuse,X) :- fuse(X).
action(arm,toggle).
sets_if(arm,toggle,1,lamp,on). condition(arm,toggle,1,lamp,off). condition(arm,toggle,1,fuse,ok).
sets_if(arm,toggle,2,lamp,off). condition(arm,toggle,2,lamp,on).
action(arm,replace). sets(arm,replace,fuse,ok).
request((light;dark)). wants(light,lamp,on). wants(dark,lamp,off).
"""


@pytest.mark.parametrize(
    ("fuse", "done"),
    [("ok", ["toggle", "toggle"]), ("broken", ["replace", "toggle", "toggle"])],
)
def test_sets_if(fuse: str, done: List[str], tmp_path: Path) -> None:
    """An effect with conditions happens if all of them hold before."""
    task = Task(tmp_path, f"{SWITCH} fuse({fuse}).")
    assert words([*task.meet("light"), *task.meet("dark")]) == ["succeeded"] * 2
    assert task.done == done


MAP = """
way(V,W) :- V = 0..4, W = 0..4, |V-W| = 1.
moves(robot). initially(at(robot),0).
number(battery,4). drains(robot,battery,1).
action(robot,charge). needs(robot,charge,at(robot),0). fills(robot,charge,battery).
request(visit(V)) :- V = 0..4. wants(visit(V),at(robot),V) :- V = 0..4.
"""


RESERVES, LONG = "reserves(robot,battery).", "length(0,1,2)."


@pytest.mark.costly
@pytest.mark.parametrize(
    ("facts", "places", "charges"),
    [("", (2, 1, 2), 0), (RESERVES, (2, 1, 2), 1), ("", (1, 0, 1), 0), (LONG, (1, 0, 1), 1)],
)
def test_reserves_and_lengths(
    facts: str, places: Sequence[int], charges: int, tmp_path: Path
) -> None:
    """It can always get back to where it is charged; else it goes on as long as it can.

    A way takes as much as was planned: a battery for 4 is empty after two ways of length 2.
    """
    task = Task(tmp_path, MAP + facts)
    for place in places:
        assert words(task.meet(f"visit({place})")) == ["succeeded"]
    assert task.done.count("charge") == charges


PARCEL = """
action(arm,(take(ID);give(ID);put(ID))) :- rslot(ID).
needs(arm,take(ID),parcel(ID),shelf) :- rslot(ID). sets(arm,take(ID),parcel(ID),arm) :- rslot(ID).
needs(arm,(give(ID);put(ID)),parcel(ID),arm) :- rslot(ID).
sets(arm,give(ID),parcel(ID),desk) :- rslot(ID). sets(arm,put(ID),parcel(ID),shelf) :- rslot(ID).
number(hands,1). uses(arm,take(ID),hands,1) :- rslot(ID).
gives(arm,(give(ID);put(ID)),hands,1) :- rslot(ID).
request(parcel).
#program present(k,t).
own(ID,parcel(ID),shelf,k) :- asked(ID,parcel,k).
wants(ID,parcel(ID),desk,k) :- asked(ID,parcel,k).
"""
RESTORES = "restores(ID,parcel(ID),shelf,k) :- asked(ID,parcel,k)."


@pytest.mark.costly
def test_own(tmp_path: Path) -> None:
    """Each request has a variable of its own, which begins anew with the next one in its slot."""
    task = Task(tmp_path, PARCEL)
    assert words(task.meet("parcel", "parcel")) == ["succeeded"] * 2
    assert words(task.meet("parcel")) == ["succeeded"]
    assert [action[:4] for action in task.done] == ["take", "give"] * 3


@pytest.mark.parametrize(
    ("restores", "done"), [("", ["take(1)"]), (RESTORES, ["take(1)", "put(1)"])]
)
def test_restores(restores: str, done: List[str], tmp_path: Path) -> None:
    """After a cancel, a variable gets its value back before the goal ends."""
    task = Task(tmp_path, PARCEL + restores)
    goal = task.request("parcel")
    task.cancels["take(1)"] = goal
    task.go_on()
    assert goal.words[-1] == "canceled"
    assert task.done == done


def test_what_was_not_begun_is_canceled_at_once(tmp_path: Path) -> None:
    task = Task(tmp_path, PARCEL + RESTORES)
    goal = task.request("parcel")
    task.cancel(goal)
    task.go_on()
    assert (goal.words[-1], task.done) == ("canceled", [])


@pytest.mark.parametrize(
    ("last", "said"), [(4, "5 is unknown as the first argument of visit"), (1000, "no external")]
)
def test_what_nobody_may_ask_for(last: int, said: str, tmp_path: Path) -> None:
    """The reason names the argument, unless there are very many requests."""
    task = Task(tmp_path, f"{MAP} request(visit(V)) :- V = 6..{last}.")
    (goal,) = task.meet("visit(5)")
    assert said in goal.reason


def test_more_than_there_can_be(tmp_path: Path) -> None:
    """A request for which a number is too small waits, and others are met meanwhile."""
    task = Task(tmp_path, JOBS + "number(force,3). uses(right,do(b),force,4).")
    assert words(task.meet("a", "b")) == ["succeeded", "accepted"]


def test_a_number_that_nobody_declares_restricts_nothing(tmp_path: Path) -> None:
    task = Task(tmp_path, JOBS + "uses(right,do(b),force,4).")
    assert words(task.meet("a", "b")) == ["succeeded"] * 2


@pytest.mark.costly
@pytest.mark.parametrize(
    ("action", "text"),
    [
        ("do(robot,go(0),2)", "the best plan would take 6 steps, 3 more than now"),
        ("do(robot,go(3),1)", "robot cannot do go(3) in step 1"),
        ("do(robot,charge,1)", "the best plan would take 4 steps, 1 more than now"),
        ("do(robot,charge,2)", "robot cannot do charge in step 2"),
    ],
)
def test_why_another_action_is_not_done(action: str, text: str, tmp_path: Path) -> None:
    """The library says which actions are possible, as far as numbers and values are concerned."""
    file = tmp_path / "task.lp"
    file.write_text(f'#include "{ACTIONS}".\n#program base.\n{MAP}')
    goal = ("1", "visit(3)")
    situation = Situation(told=(f"event(1,{goal[1]},0)",), last=20, goals=(goal,))
    answer = Explainer(Options((str(file),)), situation, seconds=60.0).why_not(action)
    assert text in answer.text


QUICK = WORK.replace("R = (quick;slow)", "R = quick") + "due(a,7). due(b,12)."
AS_MANY = "the best plan would take 2 steps, as many as now"


@pytest.mark.parametrize(
    ("age", "late"),
    [
        (0, "a by 3 s"),
        (4, "a by 7 s instead of 2 s"),  # of which 2 s cannot be helped
    ],
)
def test_why_another_action_would_be_late(age: int, late: str, tmp_path: Path) -> None:
    file = tmp_path / "task.lp"
    file.write_text(f'#include "{ACTIONS}".\n#program base.\n{QUICK}')
    goals = (("1", "a"), ("2", "b"))
    told = tuple(f"event({slot},{request},0)" for slot, request in goals)
    situation = Situation(told=told, last=20, goals=goals, ages=(("1", age), ("2", 0)))
    explainer = Explainer(Options((str(file),)), situation, seconds=60.0)
    answer = explainer.why_not("do(quick,do(b),1)")
    then = f"{AS_MANY}. It would be late: {late}."
    assert answer.text == f"If quick were to do do(b) in step 1, {then}"
    answer = explainer.why("do(quick,do(a),1)")
    assert answer.text == f"If quick were not to do do(a) in step 1, {then}"
    is_late = " It will be late by 2 s." if age else ""
    assert explainer.goal("a").text == f"a ends in step 1, and it is step 0 now.{is_late}"


def test_what_is_under_way_counts_in_what_would_be_late(tmp_path: Path) -> None:
    """The slow one has been busy for 20 s with c, and needs 10 s more."""
    text = """
    actuator(quick;slow). initially((a;b;c),todo).
    action(slow,do(c)). sets(slow,do(c),c,done). duration(slow,do(c),30).
    action(quick,do(J)) :- J = (a;b). sets(quick,do(J),J,done) :- J = (a;b).
    needs(quick,do(J),J,todo) :- J = (a;b). needs(quick,do(a),c,done). needs(slow,do(c),c,todo).
    duration(quick,do(J),8) :- J = (a;b).
    request((a;b)). wants(J,J,done) :- J = (a;b). due(a,40). due(b,25).
    """
    file = tmp_path / "task.lp"
    file.write_text(f'#include "{ACTIONS}".\n#program base.\n{text}')
    told = ("event(1,a,0)", "event(2,b,0)", "event(commit,do(slow,do(c)),1)")
    situation = Situation(
        told=told, step=1, horizon=3, last=20, goals=(("1", "a"), ("2", "b")),
        silent=(("slow", 20.0),), ages=(("1", 20.0), ("2", 20.0)),
    )  # fmt: skip
    answer = Explainer(Options((str(file),)), situation, seconds=60.0).goal("b")
    assert "It will be late by 3 s." in answer.text
