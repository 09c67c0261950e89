"""Random episodes of robots that do not wait for each other: nothing is illegal, and all goals end.

EPISODES=200 in the environment runs so many, FULL=1 runs 16.
"""

from __future__ import annotations

import random
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Dict, List, Set

import pytest
from draws import draws, variants
from episode import DYN_RESET, MAILBOT, RECORDING, RESET, SINGLE, Episode, Request
from instance_map import InstanceMap
from test_seconds import HALL, draw_map

from rosoclingo_aspprograms.validator import Edge

STEPS: Dict[str, List[str]] = {
    RECORDING: ["-c", "steps=600"],
    RESET: ["-c", "steps=600", "-c", "r=4"],
    DYN_RESET: ["-c", "steps=600"],
    SINGLE: [],
}
NEAR = 12  # requests that are in the way of another one
# Each mode and each number of robots, of the 16 with each of both.
SEEDS = draws([0, 6, 9, 15], 16, "EPISODES")
STUCK = draws([7, 18, 25], 32, "EPISODES")  # each mode of three nodes; a robot is stuck
CALM = 40  # steps, after which nothing goes wrong any more


class Busy(Episode):
    """Robots that may serve a request in the step in which it comes, before it is accepted."""

    def publish(self, actuator: str, action: str) -> None:
        """Has a robot act."""
        for goal in self.goals:
            if goal.slot is not None:
                self.validator.place(goal, goal.slot)
        super().publish(actuator, action)


class Fleet(Busy):
    """One to four robots, whose actions take longer or shorter than planned.

    Attributes:
        most_busy: How many robots have acted at the same time, at most.
        stuck: How often a robot was lost because it was stuck.
    """

    def __init__(self, mode: str, seed: int, folder: Path) -> None:
        self.pick = random.Random(f"fleet {seed}")
        self.graph = self.draw_map(1 + seed % 4)
        instance = folder / "instance.lp"
        instance.write_text(self.graph.facts())
        self.left = self.pick.randint(2, 6)  # requests to come
        self.failures = self.pick.choice([0.0, 0.05, 0.15])
        self.wedged = self.failures  # how often who has failed fails again
        self.doubts = 0.0  # of these, what is unknown
        self.failed: Set[str] = set()
        self.stuck = 0
        self.trouble = self.pick.choice([0.0, 0.03, 0.1])  # cancels and announcements
        self.sloth = self.pick.choice([0.0, 0.3, 0.9])  # how much times differ from those planned
        self.requests: List[Request] = []
        self.due: Dict[str, float] = {}
        self.most_busy = 0
        super().__init__(mode, self.graph, [str(instance), MAILBOT], STEPS[mode], self.options())

    def draw_map(self, robots: int) -> InstanceMap:
        """Returns a random map with so many robots."""
        return draw_map(self.pick, robots)

    def options(self) -> List[str]:
        """Returns the planner's options."""
        return ["-c", f"slots={self.pick.randint(1, 4)}", "-c", "urgent_after=100"]

    def publish(self, actuator: str, action: str) -> None:
        """Has a robot act, for about as long as that should take."""
        seconds = self.graph.seconds(self.validator.positions[actuator], action)
        super().publish(actuator, action)
        factor = self.pick.uniform(1 - self.sloth, 1 + self.sloth)
        self.due[actuator] = self.clock + max(0.1, seconds * factor)
        self.most_busy = max(self.most_busy, len(self.acting))

    def turn(self) -> bool:
        """Lets something happen, or time pass; nothing if all is over."""
        self._disturb()
        if self._items:
            return True
        if self.acting:
            self.clock = min(self.due[robot] for robot in self.acting)
            for robot in [one for one in sorted(self.acting) if self.due[one] <= self.clock]:
                answer = self._outcome(robot)
                self.answer(robot, answer)
                self.stuck += answer == "failure" and robot in self.validator.lost
        elif self.left:
            self._ask()
        elif any(not goal.ended for goal in self.requests):
            for edge in sorted(self._known(), key=sorted):
                self._say("unblocked", edge)
            for robot in sorted(self.validator.lost):
                self._find(robot)
        return bool(self._items)

    def _outcome(self, robot: str) -> str:
        likely = self.wedged if robot in self.failed else self.failures
        self.failed.discard(robot)
        if self._is_calm() or self.pick.random() >= likely:
            return "success"
        if self.doubts and self.pick.random() < self.doubts:
            return "unknown"
        self.failed.add(robot)
        return "failure"

    def _find(self, robot: str) -> None:
        self.announce(f"at({robot},{self.validator.positions[robot]})")

    def _disturb(self) -> None:
        if self.validator.lost and self.pick.random() < 0.1:
            self._find(self.pick.choice(sorted(self.validator.lost)))
        if self.left and self.pick.random() < 0.1:
            self._ask()
        if not self._is_calm() and self.pick.random() < self.trouble:
            self._say("blocked", self.pick.choice(sorted(self.graph.edges, key=sorted)))
        if self._known() and self.pick.random() < 0.1:
            self._say("unblocked", self.pick.choice(sorted(self._known(), key=sorted)))
        open_ones = [goal for goal in self.requests if not goal.ended]
        if open_ones and self.pick.random() < self.trouble:
            self.cancel(self.pick.choice(open_ones))

    def _ask(self) -> None:
        self.left -= 1
        if self.pick.random() < 0.1:
            text = self.pick.choice(["bring(o0,o0)", "bring(o0,o1,soon)", "bring(o0,o1,by(0))"])
        else:
            when = self.pick.choice(["", "", ",urgent", f",by({self.pick.randint(1, 200)})"])
            text = "bring({},{}{})".format(*self.pick.sample(sorted(self.graph.offices), 2), when)
        self.requests.append(self.request(text))

    def _say(self, word: str, edge: Edge) -> None:
        self.announce("{}({},{})".format(word, *self.pick.sample(sorted(edge), 2)))

    def _is_calm(self) -> bool:
        return self.elapsed > CALM

    def _known(self) -> Set[Edge]:
        return self.validator.believed()


class Wedged(Fleet):
    """Robots that are often stuck where there are several ways on, or lost in another manner."""

    def __init__(self, mode: str, seed: int, folder: Path) -> None:
        super().__init__(mode, seed, folder)
        self.failures, self.wedged, self.doubts = 0.1, 0.8, self.pick.choice([0.0, 0.2])

    def _outcome(self, robot: str) -> str:
        here = self.validator.positions[robot]
        if self.acting[robot].startswith("go(") and sum(here in way for way in self._free()) > 1:
            self.failures = 0.4
        outcome = super()._outcome(robot)
        self.failures = 0.1
        return outcome

    def _free(self) -> Set[Edge]:
        return self.graph.edges - self._known()


def _run(fleet: Fleet) -> None:
    fleet._ask()
    failure = fleet.run()
    assert failure is None, failure
    assert fleet.validator.finish() == []
    known = ("info", "has not answered")  # which is no event, or true
    assert [text for text in fleet.warnings if not any(word in text for word in known)] == []


@pytest.mark.costly
@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_fleet(seed: int, tmp_path: Path) -> None:
    """Each mode in turn; and each number of robots in each mode, in 16 episodes."""
    _run(Fleet(list(STEPS)[seed // 4 % len(STEPS)], seed, tmp_path))


@pytest.mark.costly
@pytest.mark.parametrize("seed", STUCK)
def test_a_random_fleet_that_loses_robots(seed: int, tmp_path: Path) -> None:
    """Each mode in turn, likewise."""
    fleet = Wedged(list(STEPS)[seed // 4 % len(STEPS)], seed, tmp_path)
    _run(fleet)
    assert fleet.stuck or seed not in (7, 15, 18, 25)


class Stream(Episode):
    """A robot with a far request, and near ones that come as often as one has ended.

    Attributes:
        far: The request that is always quicker to be served last.
        near: The others.
    """

    def __init__(self, patience: int, folder: Path) -> None:
        graph = replace(HALL, starts={"left": "a"})
        instance = folder / "instance.lp"
        instance.write_text(graph.facts())
        options = ["-c", "slots=2", "-c", f"urgent_after={patience}"]
        super().__init__(RECORDING, graph, [str(instance), MAILBOT], STEPS[RECORDING], options)
        self.far = self.request("bring(d,b)")
        self.near = [self.request("bring(a,c)")]

    def turn(self) -> bool:
        """Has all actions succeed, and asks for more as long as the far request waits."""
        if self.near[-1].words[-1:] == ["succeeded"] and len(self.near) < NEAR:
            there = "bring(a,c)" if len(self.near) % 2 == 0 else "bring(c,a)"
            if self.far.words[-1:] != ["succeeded"]:
                self.near.append(self.request(there))
        return super().turn()


@pytest.mark.costly
@pytest.mark.parametrize(("patience", "served"), [(100, 7), (100_000, NEAR)])
def test_a_request_that_has_waited_is_urgent(patience: int, served: int, tmp_path: Path) -> None:
    """A near request takes 14 s."""
    stream = Stream(patience, tmp_path)
    assert stream.play() is None
    assert stream.validator.finish() == []
    assert stream.far.words == ["accepted", "succeeded"]
    before = [goal for goal in stream.near if goal.words[-1:] == ["succeeded"]]
    assert len(before) == len(stream.near)
    assert len(stream.near) == pytest.approx(served, abs=2 if served < NEAR else 0)


@pytest.mark.costly
@pytest.mark.parametrize(
    ("mode", "answer"),
    variants(
        [
            (RECORDING, "success"),
            (RESET, "unknown"),
            (RESET, "failure"),
            (DYN_RESET, "unknown"),
            (SINGLE, "success"),
        ],
        product(STEPS, ["success", "failure", "unknown"]),
    ),
)
def test_a_request_is_canceled_in_the_step_in_which_it_comes(
    mode: str, answer: str, tmp_path: Path
) -> None:
    """A robot that stands where the package is picks it up already, while another one drives."""
    instance = tmp_path / "instance.lp"
    instance.write_text(HALL.facts())
    hall = Busy(mode, HALL, [str(instance), MAILBOT], STEPS[mode], ["-c", "slots=2"])
    far, near = hall.request("bring(c,b)"), []

    def turn() -> bool:
        if hall.acting and not near:
            near.append(hall.request("bring(d,c)"))
        elif hall.acting.get("right", "").startswith("pickup") and not hall.cancelled:
            hall.cancel(near[0])
        elif hall.acting.get("right", "").startswith("pickup"):
            hall.answer("right", answer)
        elif hall.acting:
            hall.answer(sorted(hall.acting)[0], "success")
        return bool(hall._items)

    assert hall.play(turn) is None
    assert hall.cancelled == near
    assert hall.validator.finish() == []
    assert far.words == ["accepted", "succeeded"]
    ends = {"success": "canceled", "failure": "canceled", "unknown": "aborted"}
    assert near[0].words[-1] == ends[answer]
