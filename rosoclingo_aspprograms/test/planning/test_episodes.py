"""Random episodes: whatever happens, no action is illegal and every goal ends as it should.

EPISODES=100 in the environment runs so many in each mode, FULL=1 runs 20.
"""

from __future__ import annotations

import random
from typing import Dict, List, Optional, Set

import pytest
from draws import draws
from episode import BENCH, DYN_RESET, FIXED, MAILBOT, RECORDING, RESET, SINGLE, Episode, Request
from instance_map import InstanceMap
from oracle import shortest

from rosoclingo_aspprograms.validator import Edge, Parcel

STEPS: Dict[str, List[str]] = {
    FIXED: ["-c", "steps=26"],
    RECORDING: ["-c", "steps=300"],
    RESET: ["-c", "steps=300", "-c", "r=4"],
    DYN_RESET: ["-c", "steps=300"],
    SINGLE: [],
}
FEW = [0, 1, 3, 4, 5, 7, 8, 9, 10, 11, 12, 16, 17, 20, 25, 26, 47, 54]
SEEDS = draws(FEW, 100, "EPISODES", len(STEPS))
SIZES = [(2, 2), (2, 2), (3, 1), (3, 2)]


class RandomEpisode(Episode):
    """A world of requests, cancels, failures and blockages, and a check of each plan's length."""

    def __init__(self, mode: str, seed: int) -> None:
        self.random = random.Random(seed)
        x, y = (2, 2) if mode == FIXED else self.random.choice(SIZES)
        self.graph = InstanceMap.grid(x, y)
        self.mode = mode
        self.slots = self.random.choice([1, 1, 2, 2, 3])
        self.left = self.random.randint(1, 2 if mode == FIXED else 3)  # requests to come
        self.failures = self.random.choice([0.0, 0.1, 0.15])
        self.doubts = self.random.choice([0.0, 0.0, 0.5])  # of these, what is unknown
        self.trouble = self.random.choice([0.0, 0.05, 0.15])  # cancels and announcements
        self.requests: List[Request] = []
        self.really: Set[Edge] = set()  # what somebody has put into the way
        self.plans = 0
        self.long = 24  # steps, after which the episode has had its share of failures
        options = ["-c", f"slots={self.slots}", "-c", f"x={x}", "-c", f"y={y}"]
        super().__init__(mode, self.graph, [BENCH, MAILBOT], STEPS[mode], options)

    def turn(self) -> bool:
        """Lets something happen, or nothing if all is over."""
        self._disturb()
        for robot, action in sorted(self.acting.items()):
            self.answer(robot, self._outcome(action))
        if not self._items and self.left and self.mode != FIXED:
            self._ask()
        if not self._items and self.mode != FIXED and self._unfinished():
            for edge in sorted(self._known(), key=sorted):
                self._say("unblocked", edge)
            for robot in sorted(self.validator.lost):
                self._find(robot)
        return bool(self._items)

    def found_plan(self) -> None:
        """Compares the length of the plan that was just found with that of the shortest."""
        state = self.loop.state
        actions = [a for a in state.plan.actions_from(0) if a not in state.executions.published]
        here = self.validator.positions["mailbot"]
        load = self.validator.loads.get("mailbot")
        picked, dropped = self._expected()
        if self.acting.get("mailbot", "").startswith("go("):
            here = self.acting["mailbot"][3:-1]
        if dropped is not None:
            load = None
        load = picked if picked is not None else load
        target = None if load is None else (load.origin if load.canceled else load.destination)
        jobs = []
        for slot in range(1, self.slots + 1):
            goal = state.goals.occupant(str(slot))
            parcel = self.validator.goals[goal] if isinstance(goal, Request) else None
            if parcel is None or parcel.ended or parcel in (load, dropped) or parcel.canceled:
                continue
            if parcel.place == parcel.destination or parcel.missing:
                continue
            jobs.append((parcel.origin, parcel.destination))
        best = shortest(self.graph, here, target, jobs, self._known())
        if self.validator.lost:
            best = 0
        assert len(actions) == best, (self.mode, here, target, jobs, actions)
        self.plans += 1

    def _expected(self) -> List[Optional[Parcel]]:
        """Returns the package that is being picked up and the one that is being delivered."""
        action = self.acting.get("mailbot", "")
        slot = action[action.find("(") + 1 : -1]
        goal = self.loop.state.goals.occupant(slot)
        parcel = self.validator.goals[goal] if isinstance(goal, Request) else None
        picked = parcel if action.startswith("pickup(") else None
        dropped = parcel if action.startswith("deliver(") else None
        return [picked, dropped]

    def _disturb(self) -> None:
        running = self.mode != FIXED or bool(self.acting)
        if self.left and running and self.random.random() < 0.15:
            self._ask()
        calm = max(self.loop.state.externals.grounded, default=0) > self.long and self.mode != FIXED
        if running and not calm and self.random.random() < self.trouble:
            self._say("blocked", self.random.choice(sorted(self.graph.edges, key=sorted)))
        if self._known() and running and self.random.random() < 0.1:
            self._say("unblocked", self.random.choice(sorted(self._known(), key=sorted)))
        open_ones = [goal for goal in self.requests if not goal.ended]
        if open_ones and running and self.random.random() < self.trouble:
            self.cancel(self.random.choice(open_ones))

    def _ask(self) -> None:
        self.left -= 1
        if self.random.random() < 0.1:
            text = self.random.choice(["bring(1,99)", "bring(2,2)", "fly(1)", "bring(1)"])
        else:
            text = "bring({},{})".format(*self.random.sample(sorted(self.graph.offices), 2))
        self.requests.append(self.request(text))

    def _say(self, word: str, edge: Edge) -> None:
        if word == "blocked" and self._cuts(edge):
            return
        first, second = self.random.sample(sorted(edge), 2)
        self.announce(f"{word}({first},{second})")

    def _find(self, robot: str) -> None:
        waypoints = sorted(set().union(*self.graph.edges))
        self.announce(f"at({robot},{self.random.choice(waypoints)})")

    def _outcome(self, action: str) -> str:
        if (
            self.random.random() >= self.failures
            or max(self.loop.state.externals.grounded, default=0) > self.long
        ):
            return "success"
        if self.mode != FIXED and self.random.random() < self.doubts:
            return "unknown"
        if action.startswith("go("):
            edge = frozenset((self.validator.positions["mailbot"], action[3:-1]))
            if self._cuts(edge):
                return "success"
        return "failure"

    def _cuts(self, edge: Edge) -> bool:
        """Whether time would run out in a fixed mode, because an office cannot be reached."""
        if self.mode != FIXED:
            return False
        reached = self.graph.distances("c(1)", self._known() | {edge})
        return not self.graph.offices <= reached.keys()

    def _known(self) -> Set[Edge]:
        return self.validator.believed()

    def _unfinished(self) -> bool:
        return any(not goal.ended for goal in self.requests)


@pytest.mark.costly
@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_episode(seed: int) -> None:
    """Each mode in turn has a world of its own."""
    episode = RandomEpisode(list(STEPS)[seed % len(STEPS)], seed)
    episode._ask()
    failure = episode.run()
    assert failure is None, failure
    assert episode.validator.finish() == []
    assert [text for text in episode.warnings if "info" not in text] == []
