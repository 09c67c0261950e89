"""The workshop: robots that act at the same time, each as long as it takes, and wait for nobody.

EPISODES=100 in the environment runs so many in each mode, FULL=1 runs 4.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any, Dict, List, Mapping, Optional, Sequence, Set, Tuple

import pytest
from draws import draws
from episode import FIXED, INCREMENTAL, PACKAGE, SINGLE
from resuming import resume, snapshot_of

from rosclingo.solver.options import Options
from rosclingo.wire.term_text import split_term
from rosoclingo.in_process.parts import make_parts
from rosoclingo.in_process.simulation import SimulatedSystem
from rosoclingo.in_process.system import Request
from rosoclingo.loop.journal import StatusSet
from rosoclingo.loop.values.goals import Goal
from rosoclingo.loop.words import ABORT, FAILURE, SUCCESS

WORKSHOP = PACKAGE / "workshop" / "workshop.lp"
DYNAMIC = [FIXED, *INCREMENTAL]
# Of four worlds in each mode, those in which something happens that happens in no other one.
EPISODES = draws([0, 2, 4, 6, 7, 8, 9, 13, 16, 17, 19], 20, "EPISODES", len(DYNAMIC))
STEPS = {FIXED: ("-c", "steps=25")}
MORE_STEPS = ("-c", "steps=50", "-c", "r=3")

Job = Tuple[str, str]
"""The slot of a goal, and the job."""


@dataclass
class Orders:
    """What there is to be done: facts of an instance, read without a solver.

    Attributes:
        robots: For each product and job, the robots that can do it.
        after: For each of these, the jobs that come before it.
    """

    robots: Dict[str, Dict[str, Set[str]]]
    after: Dict[str, Dict[str, Set[str]]]

    @classmethod
    def by_chance(cls, chance: Random) -> Orders:
        names = [f"r{number}" for number in range(1, chance.randint(1, 4) + 1)]
        robots: Dict[str, Dict[str, Set[str]]] = {}
        after: Dict[str, Dict[str, Set[str]]] = {}
        for product in ("p", "q"):
            jobs = [f"{product}{number}" for number in range(chance.randint(1, 5))]
            robots[product] = {
                job: set(chance.sample(names, chance.randint(1, min(2, len(names)))))
                for job in jobs
            }
            after[product] = {
                job: {earlier for earlier in jobs[:place] if chance.random() < 0.3}
                for place, job in enumerate(jobs)
            }
        return cls(robots, after)

    def facts(self) -> str:
        jobs = [
            f"job({product},{job},{robot})."
            for product, of in sorted(self.robots.items())
            for job, able in sorted(of.items())
            for robot in sorted(able)
        ]
        order = [
            f"after({product},{job},{earlier})."
            for product, of in sorted(self.after.items())
            for job, before in sorted(of.items())
            for earlier in sorted(before)
        ]
        return "\n".join(jobs + order)


@dataclass
class Judge:
    """Sees what is asked, published and answered, and knows from that alone what is wrong.

    Attributes:
        wrong: What was wrong.
        stopped: The slots whose goals somebody has asked to cancel.
        done: The jobs that are done.
        acting: What each robot is at.
        aborted: The robots that were told to stop that.
    """

    orders: Orders
    wrong: List[str] = field(default_factory=list)
    stopped: Set[str] = field(default_factory=set)
    done: Set[Job] = field(default_factory=set)
    acting: Dict[str, Job] = field(default_factory=dict)
    aborted: Set[str] = field(default_factory=set)

    def publish(self, robot: str, action: str, products: Mapping[str, str]) -> None:
        if action == ABORT:
            at = self.acting.get(robot)
            self._claim(at is not None and at[0] in self.stopped, f"{robot} is aborted at {at}")
            self._claim(robot not in self.aborted, f"{robot} is aborted twice")
            self.aborted.add(robot)
            return
        slot, job = split_term(action)[1]
        said = f"{robot} {action}"
        self._claim(robot not in self.acting, f"{said}, and is at {self.acting.get(robot)}")
        self._claim((slot, job) not in self.acting.values(), f"{said}, as another does")
        self._claim((slot, job) not in self.done, f"{said}, which is done")
        able = self.orders.robots[products[slot]][job]
        self._claim(robot in able, f"{said}, which it cannot do")
        before = {(slot, one) for one in self.orders.after[products[slot]][job]}
        self._claim(before <= self.done, f"{said} before {before - self.done}")
        self.acting[robot] = slot, job
        self.aborted.discard(robot)

    def answer(self, robot: str, value: str) -> None:
        job = self.acting.pop(robot)
        if value == SUCCESS:
            self.done.add(job)

    def status(self, slot: str, request: str, word: str) -> None:
        if word == "accepted":
            return
        if not slot:
            self._claim(word == "canceled", f"{request}: {word} without a slot")
            return
        needed = {(slot, job) for job in self.orders.robots[product_of(request)]}
        self._claim(not {r for r, at in self.acting.items() if at[0] == slot}, f"{slot} at work")
        self._claim(word in ("succeeded", "canceled"), f"{request}: {word}")
        self._claim(word != "succeeded" or needed <= self.done, f"{slot} lacks {needed}")
        self._claim(word != "canceled" or slot in self.stopped, f"{slot}: nobody has asked")
        self.done -= {one for one in self.done if one[0] == slot}
        self.stopped.discard(slot)

    def pause(self, products: Mapping[str, str]) -> None:
        """Time is about to pass: nobody who could do something is idle."""
        for slot in products.keys() - self.stopped:
            product = products[slot]
            for job, able in self.orders.robots[product].items():
                ready = {(slot, one) for one in self.orders.after[product][job]} <= self.done
                open_ = (slot, job) not in self.done and (slot, job) not in self.acting.values()
                idle = able - set(self.acting)
                self._claim(not (ready and open_ and idle), f"{idle} could do {job} for {slot}")

    def _claim(self, holds: bool, otherwise: str) -> None:
        if not holds:
            self.wrong.append(otherwise)


class Judged(Request):
    """A goal that also tells the judge."""

    def __init__(self, judge: Judge, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._judge = judge

    def noted(self, change: StatusSet) -> None:
        super().noted(change)
        self._judge.status(change.slot, self.request, change.status.value)


def product_of(request: str) -> str:
    return split_term(request)[1][0]


class Workshop(SimulatedSystem):
    """A workshop in which chance decides how long jobs take, what fails, and what comes when."""

    def __init__(
        self, mode: str, files: Sequence[Path], orders: Orders, seed: Optional[int] = None
    ) -> None:
        self.judge = Judge(orders)
        self.chance = Random(seed)
        self.left = []
        self.requests = 0 if seed is None else 1 if mode == FIXED else self.chance.randint(1, 4)
        self.failures = 0.0 if seed is None else self.chance.choice([0.0, 0.2])
        self.moments = sorted(
            self.chance.choice([0.0, self.chance.uniform(0, 12)]) for _ in range(self.requests)
        )
        self.restores = mode != FIXED and seed is not None and seed % 3 == 0
        self.cancels: Dict[float, str] = {}  # the ids of goals
        self.current: Dict[str, Goal] = {}  # by their ids
        self.parts = make_parts(
            mode,
            Options(tuple(map(str, files))),
            () if mode == SINGLE else STEPS.get(mode, MORE_STEPS),
        )
        if mode == FIXED:
            self.moments = [0.0 for _ in self.moments]
        super().__init__(self.parts.loop, (), self._outcome, seconds=self._seconds)
        self._ask()

    def _seconds(self, robot: str, action: str) -> float:
        return self.chance.choice([1.0, 1.0, 2.0, self.chance.uniform(0.1, 9)])

    def _outcome(self, robot: str, action: str) -> str:
        return FAILURE if self.chance.random() < self.failures else SUCCESS

    def _ask(self) -> None:
        """Lets come what comes now."""
        while self.moments and self.moments[0] <= self.clock:
            self.moments.pop(0)
            goal = self.request(f"make({self.chance.choice('pq')})")
            self.current[goal.id] = goal
            if self.chance.random() < 0.3:
                self.cancels[self.clock + self.chance.uniform(0, 8)] = goal.id
        for moment in [one for one in self.cancels if one <= self.clock]:
            goal = self.current[self.cancels.pop(moment)]
            if goal.slot is not None and not goal.ended:
                self.judge.stopped.add(goal.slot)
            self.cancel(goal)

    @property
    def products(self) -> Dict[str, str]:
        """What is asked for in each slot."""
        return {goal.slot or "": product_of(goal.request) for goal in self.loop.state.goals.open}

    # What the loop calls.

    def new_goal(self, *arguments: Any) -> Request:
        return Judged(self.judge, *arguments)

    def publish(self, actuator: str, action: str) -> None:
        self.judge.publish(actuator, action, self.products)
        super().publish(actuator, action)
        if action == ABORT:  # it ends now, as what it is
            self._due[actuator] = self.clock
            self._answers[actuator] = self.chance.choice([FAILURE, SUCCESS])

    def answer(self, actuator: str, value: str = SUCCESS) -> str:
        self.judge.answer(actuator, value)
        return super().answer(actuator, value)

    def step(self) -> None:
        if (
            self.restores and self.chance.random() < 0.1
        ):  # goes on in another loop, with the same planner
            saved = snapshot_of(self.loop)
            self.loop = self.parts.loop(self, self)
            goals = {goal.id: goal for goal in self.goals}
            self.current.update(resume(self.loop, saved, goals.__getitem__))
        super().step()

    def turn(self) -> bool:
        self.judge.pause(self.products)
        moments = [*self._due.values(), *self.moments, *self.cancels]
        if not moments:
            return False
        self.clock = max(self.clock, min(moments))
        for actuator in [one for one, due in self._due.items() if due <= self.clock]:
            self.answer(actuator, self._answers[actuator])
        self._ask()
        return True


@pytest.mark.costly
@pytest.mark.parametrize("number", EPISODES)
def test_random_episodes(number: int, tmp_path: Path) -> None:
    """Each world in all modes."""
    seed, mode = number // len(DYNAMIC), DYNAMIC[number % len(DYNAMIC)]
    orders = Orders.by_chance(Random(seed))
    instance = tmp_path / "instance.lp"
    instance.write_text(orders.facts())
    workshop = Workshop(mode, [instance, WORKSHOP], orders, seed)
    assert workshop.run() is None
    assert workshop.judge.wrong == []
    assert workshop.warnings == []
    assert [goal.words[-1:] for goal in workshop.goals if goal.words[-1:] not in ENDS] == []
    assert workshop.acting == {}


ENDS: Any = (["succeeded"], ["canceled"])
