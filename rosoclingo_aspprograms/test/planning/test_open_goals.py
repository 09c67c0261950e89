"""As long as a goal is open and a robot has nothing to do, planning goes on: all goals end.

SLOW_EPISODES=100 in the environment runs so many episodes at a fifth of a processor.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import threading
from pathlib import Path
from typing import Callable, List

import pytest
from draws import draws
from episode import DYN_RESET, RECORDING, RESET, SINGLE, Request
from test_actions import World, write

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosoclingo.loop.journal import Ended, SearchEnded
from rosoclingo.loop.planner import layers
from rosoclingo.loop.planner.planner import DEFAULT_PATIENCE, Planner
from rosoclingo.loop.planner.task_search import TaskSearch
from rosoclingo.loop.values.atoms import Plan

SHARE, PERIOD = 0.2, 0.05  # of a processor, and of the seconds for which that is counted
SEEDS = draws(list(range(2)), 10, "SLOW_EPISODES", 1)
WAITERS = """
#include "{actions}".
#const full=30.
#program base.
way(V,W) :- corridor(V,W).
way(W,V) :- corridor(V,W).
moves(R) :- start(R,V).
initially(at(R),V) :- start(R,V).
number(tray(R),2) :- start(R,V).
number(battery(R),full) :- start(R,V).
drains(R,battery(R),1) :- start(R,V).
reserves(R,battery(R)) :- start(R,V).
action(R,recharge) :- start(R,V).
needs(R,recharge,at(R),kitchen) :- start(R,V).
fills(R,recharge,battery(R)) :- start(R,V).
request(dish(T)) :- table(T).
says(cold(ID),warm(ID),no) :- rslot(ID).
#program present(k,t).
own(ID,thing(ID),kitchen,k) :- asked(ID,dish(T),k).
own(ID,warm(ID),yes,k) :- asked(ID,dish(T),k).
wants(ID,thing(ID),T,k) :- asked(ID,dish(T),k).
restores(ID,thing(ID),kitchen,k) :- asked(ID,dish(T),k).
action(R,pick(ID),k) :- start(R,V), asked(ID,dish(T),k).
needs(R,pick(ID),at(R),kitchen,k) :- start(R,V), asked(ID,dish(T),k).
needs(R,pick(ID),thing(ID),kitchen,k) :- start(R,V), asked(ID,dish(T),k).
sets(R,pick(ID),thing(ID),R,k) :- start(R,V), asked(ID,dish(T),k).
uses(R,pick(ID),tray(R),1,k) :- start(R,V), asked(ID,dish(T),k).
action(R,put(ID,W),k) :- start(R,V), asked(ID,dish(T),k), W = (T;kitchen).
needs(R,put(ID,W),at(R),W,k) :- action(R,put(ID,W),k).
needs(R,put(ID,W),thing(ID),R,k) :- action(R,put(ID,W),k).
needs(R,put(ID,T),warm(ID),yes,k) :- action(R,put(ID,T),k), asked(ID,dish(T),k).
sets(R,put(ID,W),thing(ID),W,k) :- action(R,put(ID,W),k).
gives(R,put(ID,W),tray(R),1,k) :- action(R,put(ID,W),k).
action(R,swap(ID),k) :- start(R,V), asked(ID,dish(T),k).
needs(R,swap(ID),at(R),kitchen,k) :- start(R,V), asked(ID,dish(T),k).
needs(R,swap(ID),thing(ID),R,k) :- start(R,V), asked(ID,dish(T),k).
sets(R,swap(ID),warm(ID),yes,k) :- start(R,V), asked(ID,dish(T),k).
#program base.
"""


def restaurant(tables: int, robots: int) -> str:
    """Returns a map: a kitchen, and halls in a row with up to three tables each."""
    halls = range(-(-tables // 3))
    ways = ["corridor(kitchen,hall(0))."]
    ways += [f"corridor(hall({hall - 1}),hall({hall}))." for hall in halls[1:]]
    ways += [f"corridor(hall({table // 3}),t{table}). table(t{table})." for table in range(tables)]
    return WAITERS + " ".join([*ways, *(f"start(w{n},kitchen)." for n in range(robots))])


class Restaurant(World):
    """A restaurant with requests, cancels, dishes that get cold, and moves that fail."""

    def __init__(self, seed: int, folder: Path) -> None:
        self.chance = random.Random(seed)
        self.tables = self.chance.randint(3, 9)
        self.robots = self.chance.randint(1, 3)
        self.left = self.chance.randint(4, 12)
        self.failures = self.chance.choice([0.0, 0.05])
        mode = [RECORDING, RESET, DYN_RESET, SINGLE][seed % 4]
        slots = str(self.chance.randint(2, 8))
        encoding = write(folder, restaurant(self.tables, self.robots))
        super().__init__(mode, [encoding], ["-c", f"slots={slots}"])

    def turn(self) -> bool:
        """Lets the actions end, and something happen; nothing if all is over."""
        chance = self.chance
        for robot in sorted(self.acting):
            fails = chance.random() < self.failures and self.acting[robot].startswith("go")
            self.answer(robot, "failure" if fails else "success")
        open_goals = [goal for goal in self.goals if not goal.ended]
        while self.left and (chance.random() < 0.3 or not (self._items or open_goals)):
            self.left -= 1
            open_goals.append(self.request(f"dish(t{chance.randrange(self.tables)})"))
        if open_goals and chance.random() < 0.05:
            self.cancel(chance.choice(open_goals))
        carried = [goal.slot for goal in open_goals if goal.slot is not None]
        if carried and chance.random() < 0.05:
            self.tell("info", f"cold({chance.choice(carried)})")
        if not self._items:  # no robot acts: what failures have closed is free again
            for way in sorted(self._blocked()):
                self.tell("info", f"un{way}")
        return bool(self._items)

    def _blocked(self) -> List[str]:
        shown = (text for text in self.loop.state.plan.symbols if text.startswith("holds(blocked("))
        return [text[len("holds(") :].rpartition(",")[0] for text in shown]


def _play(seed: int, folder: Path) -> None:
    """Plays an episode; all of its goals end as their clients want."""
    world = Restaurant(seed, folder)
    assert world.run() is None
    assert not world.left
    assert {goal.words[-1] for goal in world.goals} <= {"succeeded", "canceled"}


@pytest.mark.costly
@pytest.mark.parametrize("seed", SEEDS)
def test_at_a_fifth_of_a_processor_all_goals_end(seed: int, tmp_path: Path) -> None:
    """The episode is a process that is stopped for four fifths of the time."""
    child = subprocess.Popen(
        [sys.executable, __file__, str(seed), str(tmp_path)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        stderr=subprocess.PIPE,
        text=True,
    )
    ended = threading.Event()

    def throttle() -> None:
        while not ended.wait(PERIOD * SHARE):
            child.send_signal(signal.SIGSTOP)
            ended.wait(PERIOD * (1 - SHARE))
            child.send_signal(signal.SIGCONT)

    thread = threading.Thread(target=throttle)
    thread.start()
    try:
        _, said = child.communicate()
    finally:
        ended.set()
        thread.join()
    assert child.returncode == 0, said


Late = Callable[[layers._OneByOne, float], bool]
LATE = {
    "nothing is planned in time": lambda search, begin: True,
    "a part is planned in time": lambda search, begin: search.partial is not None,
}


@pytest.mark.costly
@pytest.mark.parametrize("mode", [RECORDING, RESET, DYN_RESET, SINGLE])
@pytest.mark.parametrize("late", LATE)
def test_what_was_not_planned_in_time_is_planned_later(
    late: str, mode: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both while robots act and while they wait; and a client is told what it waits for."""
    monkeypatch.setattr(TaskSearch, "find", lambda *_: None)  # as if it took long
    monkeypatch.setattr(layers._OneByOne, "is_over", LATE[late])
    for name in ("_AT_ONCE_SECONDS", "_ONE_BY_ONE_SECONDS"):
        monkeypatch.setattr(layers, name, 0.0)
    world = World(mode, [write(tmp_path, restaurant(6, 2))], ["-c", "slots=6"])
    goals = [world.request(f"dish(t{table})") for table in range(6)]
    assert world.run() is None
    assert [goal.words[-1] for goal in goals] == ["succeeded"] * 6
    assert any("waits_for a plan" in goal.lines for goal in goals)


IMPOSSIBLE = """
#include "{actions}".
#program base.
moves(r). initially(at(r),a). way(a,b). way(b,a).
number(power,1).
action(r,warm). uses(r,warm,power,1). sets(r,warm,oven,warm). initially(oven,cold).
action(r,bake). uses(r,bake,power,1). sets(r,bake,bread,there). initially(bread,none).
needs(r,bake,oven,warm).
request(bread). wants(bread,bread,there).
request(visit). wants(visit,at(r),b).
"""


def test_what_is_excluded_is_not_looked_for_again(tmp_path: Path) -> None:
    """There is power for one of two actions, which shows in the search only."""
    world = World(DYN_RESET, [write(tmp_path, IMPOSSIBLE)])
    goals: List[Request] = [world.request("bread"), world.request("visit")]
    assert world.run() is None
    assert [goal.words[-1] for goal in goals] == ["accepted", "succeeded"]
    planner = world.loop.state.planner
    assert not planner.is_short
    searches = [e.event for e in world.journal if isinstance(e.event, SearchEnded)]
    assert Ended.BETTER not in [one.how for one in searches]


BUDGET = """
#include "{actions}".
#program base.
job(a,6;b,5;c,5). number(fuel,10). initially(done(J),no) :- job(J,N).
action(r,do(J)) :- job(J,N). uses(r,do(J),fuel,N) :- job(J,N).
sets(r,do(J),done(J),yes) :- job(J,N).
request(do(J)) :- job(J,N). wants(do(J),done(J),yes) :- job(J,N).
"""


def test_another_order_meets_more_requests(tmp_path: Path) -> None:
    """There is enough for the second and the third one, and not if the first one is met.

    None of them is refuted alone, so they are looked for until that is known.
    """
    planner = Planner(Engine(Options((write(tmp_path, BUDGET),), ())), DEFAULT_PATIENCE)
    planner.begin()
    planner.tell([f"event({slot},do({job}),0)" for slot, job in enumerate("abc", 1)])
    plan = Plan(planner.search(0, 10_000, lambda: False).symbols)
    assert [one.name for one in plan.actions_from(0)] == ["do(a)"]
    assert planner.is_short
    better = planner.improve(0, lambda: False)
    assert better is not None
    assert [one.name for one in Plan(better.symbols).actions_from(0)] == ["do(b)", "do(c)"]


if __name__ == "__main__":
    _play(int(sys.argv[1]), Path(sys.argv[2]))
