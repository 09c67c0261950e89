"""Actions in general: whatever happens in the hospital, no action is illegal, all goals end right.

EPISODES=100 in the environment runs so many in each mode, FULL=1 runs 20.
"""

from __future__ import annotations

import random
from pathlib import Path
from typing import Dict, List, Sequence, Set, Tuple

import pytest
from draws import draws
from episode import DYN_RESET, PACKAGE, RECORDING, RESET, SINGLE

from rosclingo.solver.options import Options
from rosoclingo.in_process.parts import make_parts
from rosoclingo.in_process.system import Request, System
from rosoclingo.loop.planner import layers
from rosoclingo.loop.words import SOLVER
from rosoclingo.tools.plan.command import main as plan

HOSPITAL = str(PACKAGE / "hospital" / "hospital.lp")
SMALL = str(PACKAGE / "hospital" / "instances" / "small.lp")
ACTIONS = PACKAGE / "lib" / "actions.lp"
STEPS: Dict[str, List[str]] = {
    RECORDING: ["-c", "steps=300"],
    RESET: ["-c", "steps=300", "-c", "r=4"],
    DYN_RESET: ["-c", "steps=300"],
    SINGLE: [],
}
SEEDS = draws(list(range(4)), 100, "EPISODES", len(STEPS))
WARDS = ("ward_a", "ward_b", "ward_c", "ward_d")
CORRIDORS = [
    ("dock", "laundry"), ("laundry", "hall1"), ("hall1", "ward_a"), ("hall1", "ward_b"),
    ("hall2", "ward_c"), ("hall2", "ward_d"), ("ward_c", "ward_d"),
]  # fmt: skip
STOPS = {"1": "hall1", "2": "hall2"}
BAGS, FULL = 3, 20


class World(System):
    """Takes note of what is done, and lets all actions succeed unless a test says otherwise."""

    def __init__(self, mode: str, encoding: Sequence[str], options: Sequence[str] = ()) -> None:
        solver = Options(tuple(encoding), tuple(options))
        parts = make_parts(mode, solver, STEPS[mode], log=self.warn)
        super().__init__(parts.loop)

    @property
    def done(self) -> List[str]:
        return [action for actuator, action in self.published if actuator != SOLVER]


class Hospital(World):
    """A hospital that believes its robots' answers alone, and finds what is illegal."""

    def __init__(self, mode: str, instance: Sequence[str], robots: Sequence[str]) -> None:
        self.violations: List[str] = []
        self.requests: List[Request] = []
        self.canceled: Set[Request] = set()
        self.at: Dict[str, str] = dict.fromkeys(robots, "dock")
        self.battery = dict.fromkeys(robots, FULL)
        self.room = dict.fromkeys(robots, BAGS)
        self.lift, self.cabin = "1", ""
        self.bags: Dict[Request, str] = {}
        self.blocked: Set[frozenset] = set()  # type: ignore[type-arg] # Python 3.8
        self.to_fail: List[str] = []
        super().__init__(mode, [HOSPITAL, *instance])

    # What the loop calls.

    def publish(self, actuator: str, action: str) -> None:
        if actuator != SOLVER:
            lift = "lift" if _name(action) in ("call", "ride", "enter", "leave") else ""
            others = [_name(a) for r, a in self.acting.items() if r != actuator]
            self._check(not lift or not {"call", "ride", "enter", "leave"} & {*others}, action)
            self._check(self._is_legal(actuator, action), f"{actuator}: {action}")
        super().publish(actuator, action)

    def turn(self) -> bool:
        """Ends all actions; those that are to fail do so once."""
        for robot, action in sorted(self.acting.items()):
            fails = action in self.to_fail
            if fails:
                self.to_fail.remove(action)
            self.end(robot, "failure" if fails else "success")
        return bool(self._items)

    # What a test calls.

    def ask(self, text: str) -> Request:
        goal = self.request(text)
        self.requests.append(goal)
        self.bags[goal] = "laundry"
        return goal

    def end(self, robot: str, outcome: str) -> None:
        """Answers an action, and takes note of what it has changed."""
        action = self.acting[robot]
        if outcome == "success":
            self._apply(robot, action)
        elif _name(action) == "go":
            self.battery[robot] -= outcome == "unknown"
            if outcome == "failure":
                self.blocked.add(frozenset((self.at[robot], _argument(action))))
            else:
                self.at[robot] = ""
        self.answer(robot, outcome)

    def finish(self) -> List[str]:
        """Returns all violations, once everything is over."""
        for goal in self.requests:
            word, text = (goal.words or [""])[-1], goal.request
            if word == "succeeded" and text.startswith("linen"):
                self._check(self.bags[goal] == "given", f"{text} {word}, {self.bags[goal]}")
            elif word in ("canceled", "preempted", "recalled"):
                self._check(self.bags[goal] == "laundry", f"{text} {word}, {self.bags[goal]}")
                self._check(goal in self.canceled, f"{text} {word}")
            else:
                self._check(word == "succeeded", f"{text} {word}")
        return self.violations

    def _check(self, is_right: bool, text: str) -> None:
        if not is_right:
            self.violations.append(text)

    def _goal(self, action: str) -> Request:
        goal = self.loop.state.goals.occupant(_argument(action))
        assert isinstance(goal, Request), action
        return goal

    def _is_legal(self, robot: str, action: str) -> bool:
        name, value, here = _name(action), _argument(action), self.at[robot]
        if name == "go":
            known = (here, value) in CORRIDORS or (value, here) in CORRIDORS
            is_free = frozenset((here, value)) not in self.blocked
            return known and is_free and self.battery[robot] > 0
        if name == "call":
            return here == STOPS[value] and not self.cabin
        if name == "enter":
            return here == STOPS[value] and self.lift == value and not self.cabin
        if name == "ride":
            return here == "lift" and self.cabin == robot
        if name == "leave":
            return here == "lift" and self.lift == value and self.cabin == robot
        if name == "recharge":
            return here == "dock"
        goal = self._goal(action)
        where, bags = self.bags[goal], _order(goal)[1]
        if name == "load":
            return here == "laundry" == where and self.room[robot] >= bags
        if name == "unload":
            return here == _order(goal)[0] and where == robot
        return name == "restock" and here == "laundry" and where == robot

    def _apply(self, robot: str, action: str) -> None:
        name, value = _name(action), _argument(action)
        if name == "go":
            self.at[robot], self.battery[robot] = value, self.battery[robot] - 1
        elif name in ("call", "ride"):
            self.lift = value
        elif name == "enter":
            self.at[robot], self.cabin = "lift", robot
        elif name == "leave":
            self.at[robot], self.cabin = STOPS[value], ""
        elif name == "recharge":
            self.battery[robot] = FULL
        else:
            goal = self._goal(action)
            self.room[robot] += -_order(goal)[1] if name == "load" else _order(goal)[1]
            self.bags[goal] = {"load": robot, "unload": "given", "restock": "laundry"}[name]


class RandomHospital(Hospital):
    """A world of requests, cancels, failures, messages, and answers that nobody understands."""

    def __init__(self, mode: str, seed: int, tmp_path: Path) -> None:
        self.random = random.Random(seed)
        robots = [f"linen{n + 1}" for n in range(self.random.choice([1, 1, 2]))]
        instance = tmp_path / "robots.lp"
        instance.write_text("".join(f"robot({r}). start({r},dock).\n" for r in robots))
        self.left = self.random.randint(1, 4)
        self.failures = self.random.choice([0.0, 0.1, 0.2])
        self.trouble = self.random.choice([0.0, 0.05, 0.15])
        self.ends = 0
        super().__init__(mode, [SMALL, str(instance)], robots)

    def turn(self) -> bool:
        """Lets something happen, or nothing if all is over."""
        if self.left and self.random.random() < 0.2:
            self.ask_something()
        open_ones = [g for g in self.requests if not g.ended]
        if open_ones and self.random.random() < self.trouble:
            goal = self.random.choice(open_ones)
            self.canceled.add(goal)
            self.cancel(goal)
        for robot in sorted(self.acting):
            self.ends += 1
            self.end(robot, self._outcome(self.acting[robot]))
        if not self._items and self.left:
            self.ask_something()
        if not self._items and [g for g in self.requests if not g.ended]:
            for way in sorted(self.blocked, key=sorted):
                self.tell("info", "unblocked({},{})".format(*sorted(way)))
            self.blocked.clear()
            for robot in sorted(r for r, place in self.at.items() if not place):
                self.at[robot] = "hall1"
                self.tell("info", f"at({robot},hall1)")
            for robot, left in self.battery.items():
                self.tell("info", f"battery({robot},{left})")
        return bool(self._items)

    def ask_something(self) -> None:
        self.left -= 1
        ward = self.random.choice(WARDS)
        self.ask(f"linen({ward},bags({self.random.randint(1, BAGS)}))")

    def _outcome(self, action: str) -> str:
        if self.ends > 60 or self.random.random() >= self.failures:
            return "success"
        is_known = _name(action) not in ("go", "recharge") or self.random.random() < 0.7
        return "failure" if is_known else "unknown"


def _name(action: str) -> str:
    return action.partition("(")[0]


def _argument(action: str) -> str:
    return action.partition("(")[2][:-1]


def _order(goal: Request) -> Tuple[str, int]:
    ward, bags = _argument(goal.request).split(",", 1)
    return ward, int(_argument(bags))


@pytest.mark.costly
@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_episode_in_the_hospital(seed: int, tmp_path: Path) -> None:
    """Each mode in turn has a world of its own."""
    world = RandomHospital(list(STEPS)[seed % len(STEPS)], seed, tmp_path)
    world.ask_something()
    failure = world.run()
    assert failure is None, failure
    assert world.finish() == []


HERE = Path(__file__).parent


def write(folder: Path, text: str) -> str:
    """Writes an encoding for the library, and returns its file."""
    file = folder / "encoding.lp"
    file.write_text(text.format(actions=ACTIONS), encoding="utf-8")
    return str(file)


def _world(encoding: str, *requests: str) -> World:
    world = World(DYN_RESET, [str(HERE / encoding)])
    goals = [world.request(text) for text in requests]
    failure = world.run()
    assert failure is None, failure
    assert {goal.words[-1] for goal in goals} == {"succeeded"}
    return world


@pytest.mark.costly
def test_trucks_bring_boxes() -> None:
    """Each box is loaded and unloaded once, and no truck drives further than its fuel lasts."""
    world = _world("transport.lp", "bring(2,5)", "bring(3,1)", "bring(6,2)")
    done = [_name(action) for action in world.done]
    assert (done.count("load"), done.count("unload")) == (3, 3)


NUMBERS = """
#include "{actions}".
#program base.
number(power,10).
action(arm,(light;charge)).
action(eye,look).
uses(arm,light,power,3).
sets(arm,light,lamp,on).
fills(arm,charge,power).
needs(arm,charge,lamp,on).
needs_least(eye,look,power,8).
sets(eye,look,seen,yes).
initially(lamp,off).
initially(seen,no).
initially(power,9).
request((see;both)).
wants((see;both),seen,yes).
wants(both,lamp,on).
"""


@pytest.mark.costly
def test_a_number_has_to_be_large_enough(tmp_path: Path) -> None:
    """As light leaves too little to look with, it waits until that is done, or it charges first."""
    encoding = write(tmp_path, NUMBERS)
    for requests in (["both"], ["both", "see"]):
        assert _world(encoding, *requests).done == ["look", "light"]
    dark = write(tmp_path, NUMBERS.replace("(power,9)", "(power,5)"))
    assert _world(dark, "see").done == ["light", "charge", "look"]


MANY_FACTS = """
#include "{actions}".
#program base.
number(load,9).
initially(load,0).
action(r,(add;drop;reset;finish)).
gives(r,add,load,(1;2)).
needs_most(r,add,load,(5;4)).
uses(r,drop,load,1).
sets(r,reset,load,1).
needs(r,finish,load,5).
sets(r,finish,done,yes).
initially(done,no).
request((finished;exact;low)).
wants(finished,done,yes).
wants_least(finished,load,(6;4)).
wants(exact,load,5).
wants(low,done,yes).
wants_most(low,load,0).
"""


@pytest.mark.costly
def test_all_facts_about_a_number_count(tmp_path: Path) -> None:
    """Amounts are added, the strictest bound counts, and a number is made smaller where needed."""
    encoding = write(tmp_path, MANY_FACTS)
    load = 0
    for action in _world(encoding, "finished").done:
        assert action != "add" or load <= 4
        assert action != "finish" or load == 5
        assert action != "drop" or load >= 1
        load = {"add": load + 3, "drop": load - 1, "reset": 1, "finish": load}[action]
    assert load >= 6
    low = _world(encoding, "low").done
    assert low[-1] == "drop"
    assert "reset" in low[low.index("finish") :] or low.count("drop") >= 5
    assert "finish" not in _world(encoding, "exact").done


RESTORED = """
#include "{actions}".
#program base.
way((table;sink),(table;sink)).
moves(r).
initially(at(r),sink).
action(r,(take;put)).
request(clear).
#program present(k,t).
own(ID,plate(ID),table,k) :- asked(ID,clear,k).
wants(ID,plate(ID),sink,k) :- asked(ID,clear,k).
restores(ID,plate(ID),sink,k) :- asked(ID,clear,k).
needs(r,take,(at(r);plate(ID)),table,k) :- asked(ID,clear,k).
sets(r,take,plate(ID),tray,k) :- asked(ID,clear,k).
needs(r,put,at(r),sink,k) :- asked(ID,clear,k).
needs(r,put,plate(ID),tray,k) :- asked(ID,clear,k).
sets(r,put,plate(ID),sink,k) :- asked(ID,clear,k).
"""


@pytest.mark.costly
def test_a_cancelled_goal_that_restores_what_it_wants_ends_as_cancelled(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """So its plan says, and so does a search that comes when it has ended."""
    news = ["--at", "2", "cancel:1", "--at", "4", "info:blocked(table,sink)"]
    with pytest.raises(SystemExit):
        plan([write(tmp_path, RESTORED), "--simulate", "--goal", "clear", *news])
    assert "goal 1, clear: canceled" in capsys.readouterr().out


LIFT = """
#include "{actions}".
#program base.
initially(lift,ground).
initially(robot,hall).
action(lift,call(F)) :- F = (ground;first).
action(robot,(enter;leave)).
sets(lift,call(F),lift,F) :- action(lift,call(F)).
needs(robot,enter,robot,hall).
needs(robot,enter,lift,ground).
sets(robot,enter,robot,cabin).
needs(robot,leave,robot,cabin).
needs(robot,leave,lift,first).
sets(robot,leave,robot,ward).
request(go).
wants(go,robot,ward).
#program layer(k,n).
:- n = 1, not occ(lift,call(ground),n,k), open(n,k).
:- n = 3, not occ(lift,call(first),n,k), open(n,k).
:- n = 1, occ(robot,A,n,k), open(n,k).
:- n = 3, occ(robot,leave,n,k), open(n,k).
open(n,k) :- planned(k), not finished(n-1,k), not fixed(k), not newer(k).
"""


def test_what_is_so_already_is_not_done_again(tmp_path: Path) -> None:
    """The lift is called to where it is, or twice, in the layers; no plan has that."""
    assert _world(write(tmp_path, LIFT), "go").done == ["enter", "call(first)", "leave"]


@pytest.mark.costly
@pytest.mark.parametrize("requests", [["shine"], ["shine", "call"]])
def test_what_is_impossible_waits_for_news(
    requests: List[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also if that shows only in the search, and whatever else is asked for is done meanwhile."""
    monkeypatch.setattr(layers, "_MOST_SECONDS", 0.5 if requests == ["shine"] else 60.0)
    monkeypatch.setattr(layers, "_MORE_SECONDS", 0.1)
    world = World(DYN_RESET, [str(HERE / "power.lp")])
    goals = [world.request(text) for text in requests]
    assert world.run() is None
    assert [goal.words[-1] for goal in goals] == ["accepted", "succeeded"][: len(goals)]
    assert world.done == ["ring"][: len(goals) - 1]
    world.tell("info", "power(2)")
    assert world.run() is None
    assert goals[0].words[-1] == "succeeded"
    assert world.done[-1] == "light"


TOOLS = """
#include "{actions}".
#program base.
robot(r(1..4)).
initially(hand(R),empty) :- robot(R).
initially(lamp,off).
action(R,(fetch;press)) :- robot(R).
needs(R,fetch,hand(R),empty) :- robot(R).
sets(R,fetch,hand(R),tool) :- robot(R).
needs(R,press,hand(R),tool) :- robot(R).
sets(R,press,lamp,on) :- robot(R).
request(light).
wants(light,lamp,on).
"""


@pytest.mark.parametrize("seed", range(3))
def test_only_what_serves_is_done(seed: int, tmp_path: Path) -> None:
    """The solver, which decides at random here, has all robots fetch a tool; one of them has to."""
    options = ["--heuristic=Vsids", "--rand-freq=1", f"--seed={seed}", "--sign-def=rnd"]
    world = World(DYN_RESET, [write(tmp_path, TOOLS)], options)
    world.request("light")
    assert world.run() is None
    assert world.done == ["fetch", "press"]


ROOM = """
#include "{actions}".
#program base.
number(bin,4).
initially(bin,0).
number(crates,3).
initially(crates,3).
action(arm,(put;empty)).
gives(arm,put,bin,3).
uses(arm,put,crates,1).
sets(arm,empty,bin,1).
request(tidy).
wants_most(tidy,crates,1).
"""


def test_a_number_is_made_smaller_for_what_adds_to_it(tmp_path: Path) -> None:
    """Nothing else needs that it is; it was left out, and the bin ran over."""
    world = World(DYN_RESET, [write(tmp_path, ROOM)])
    world.request("tidy")
    assert world.run() is None
    assert world.done == ["put", "empty", "put"]


DOOR = """
#include "{actions}".
#program base.
initially(door,shut).
initially(bell,off).
action(arm,press).
needs_other(arm,press,door,shut).
sets(arm,press,bell,on).
request(call).
wants(call,bell,on).
says(opened,door,open).
"""


@pytest.mark.parametrize("opens", [False, True])
def test_a_value_that_must_not_be(opens: bool, tmp_path: Path) -> None:
    """Also if nobody can change it, or somebody has to before."""
    opener = "action(boy,open). sets(boy,open,door,open)." if opens else ""
    world = World(DYN_RESET, [write(tmp_path, DOOR + opener)])
    goal = world.request("call")
    assert world.run() is None
    assert world.done == (["open", "press"] if opens else [])
    world.tell("info", "opened")
    assert world.run() is None
    assert world.done[-1] == "press"
    assert goal.words[-1] == "succeeded"


def test_an_action_that_fails_is_done_again() -> None:
    world = Hospital(DYN_RESET, [SMALL], ["linen1"])
    world.ask("linen(ward_a,bags(1))")
    world.to_fail.append("load(1)")
    assert world.run() is None
    assert world.finish() == []
    assert world.done.count("load(1)") == 2


@pytest.mark.costly
def test_a_locked_door_keeps_a_request_waiting() -> None:
    world = Hospital(DYN_RESET, [SMALL], ["linen1"])
    world.tell("info", "locked(isolation)")
    goal = world.ask("linen(ward_b,bags(1))")
    assert world.run() is None
    assert goal.words == ["accepted"]
    assert world.done == []
    world.tell("info", "unlocked(isolation)")
    assert world.run() is None
    assert world.finish() == []
