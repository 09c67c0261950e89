"""A loop that is saved and restored at every step runs like one that is not."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from random import Random
from typing import Any, Callable, Dict, List, Optional, Tuple

import pytest
from conftest import PACKAGE
from draws import draws
from resuming import resume, snapshot_of

from rosclingo.solver.options import Options
from rosclingo.wire.commands import Part, Result
from rosoclingo.in_process.parts import EXAMPLES, SINGLE, make_parts
from rosoclingo.in_process.system import Request, System
from rosoclingo.loop import journal, waiting
from rosoclingo.loop.loop import Loop
from rosoclingo.loop.values.goals import Goal
from rosoclingo.loop.values.snapshot import decode, encode

DYNAMIC = sorted(file.stem for file in (PACKAGE / "modes").glob("dynamic.*.lp"))
ENCODINGS = ["line.lp", "line_demand.lp"]
SINGLE_ENCODINGS = ["line.lp", "line_1.0.lp", "line_paper.lp", "line_demand.lp"]
INPUTS = 12

Make = Callable[..., Loop]
"""Makes a loop of an inbox and an environment."""


@pytest.fixture(autouse=True)
def silent(monkeypatch: pytest.MonkeyPatch) -> None:
    """That a search goes on is told by wall time, which is another one in each run."""
    monkeypatch.setattr(waiting, "_SILENT_SECONDS", float("inf"))


class Client(Request):
    """Remembers all that it is told, in order, and the goal that is its now."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.goal: Goal = self
        self.heard: List[Tuple[str, ...]] = []

    def noted(self, change: journal.StatusSet) -> None:
        self.heard.append(("noted", change.slot, change.status, change.reason))

    def changed(self, change: journal.StatusSet) -> None:
        self.heard.append(("changed", change.slot, change.status, change.reason))

    def feedback(self, line: str) -> None:
        self.heard.append(("feedback", line))


class Run(System):
    """A run in which what comes, comes by chance, but the same in each run of a seed."""

    def __init__(self, seed: int, make: Make, *, restores: bool) -> None:
        self.clients: Dict[str, Client] = {}
        self.seen: List[object] = []  # all that leaves the loop
        self.snapshots = 0
        self._chance = Random(seed)
        self._left = INPUTS
        self._make = make
        self._restores = restores
        super().__init__(make)

    def step(self) -> None:
        if self._restores:
            self._restore()
        if self._chance.random() < 0.1:  # while the loop is busy
            self.turn()
        super().step()

    def _restore(self) -> None:
        """Goes on with a new loop."""
        saved = snapshot_of(self.loop)
        self.loop = self._make(self, self)
        for identifier, goal in resume(self.loop, saved, self.clients.__getitem__).items():
            self.clients[identifier].goal = goal
        assert without_times(snapshot_of(self.loop)) == without_times(saved)
        self.snapshots += 1

    # What the loop calls.

    def publish(self, actuator: str, action: str) -> None:
        super().publish(actuator, action)
        self.seen.append(("publish", actuator, action))

    def note(self, record: journal.Record) -> None:
        fields = journal.encode(record.event)._replace(seconds=0.0)
        self.seen.append((fields, record.step, record.horizon))

    def warn(self, text: str) -> None:
        self.seen.append(("warn", text))

    # What happens outside.

    def turn(self) -> bool:
        """Lets something come, an answer or something new; nothing when all has come."""
        answers = bool(self.acting) and (self._left == 0 or self._chance.random() < 0.7)
        if answers:
            actuator = self._chance.choice(sorted(self.acting))
            self.answer(actuator, self._chance.choice(["success", "success", "failure"]))
        elif self._left:
            self._left -= 1
            self._chance.choice([*[self._ask] * 3, self._cancel, self._tell])()
        else:
            self.close()
        return True

    def new_goal(self, *arguments: Any) -> Request:
        client = self.clients[arguments[-1]] = Client(*arguments)
        return client

    def _ask(self) -> None:
        self.request(f"visit({self._chance.choice([1, 2, 3, 4, 99])})", ("one", "two"))

    def _cancel(self) -> None:
        goals = [c.goal for c in self.clients.values() if not c.goal.ended]
        if goals:
            self.cancel(self._chance.choice(goals))

    def _tell(self) -> None:
        values = ["close(8)", "close(99)", "open(8)", "nonsense(", "passed"]
        self.tell("info", self._chance.choice(values))


def without_times(saved: str) -> object:
    """Returns what a snapshot says but for how long actuators have acted."""
    data = json.loads(saved)
    clock = data["state"]["executions"].pop("clock")
    for _, one in data["state"]["executions"]["last"]:
        assert one.pop("began") <= one.pop("reminded") <= clock
    return data


def check(mode: str, encoding: str, seed: int) -> None:
    def make() -> Make:
        """What decides begins anew with each loop, the planner is as it was."""
        return make_parts(mode, Options((f"{EXAMPLES}/{encoding}",)), ("-c", "steps=30")).loop

    runs = [Run(seed, make(), restores=restores) for restores in (False, True)]
    ends = [str(run.run()) for run in runs]
    assert ends[0] == ends[1]
    assert runs[0].seen == runs[1].seen
    heard = [{name: client.heard for name, client in run.clients.items()} for run in runs]
    assert heard[0] == heard[1]
    assert runs[1].snapshots > INPUTS
    assert runs[0].published


@pytest.mark.costly
@pytest.mark.long
@pytest.mark.parametrize("seed", draws([0], 2))
@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("mode", DYNAMIC)
def test_a_mode(mode: str, encoding: str, seed: int) -> None:
    check(mode, encoding, seed)


@pytest.mark.costly
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("encoding", SINGLE_ENCODINGS)
def test_one_node(encoding: str, seed: int) -> None:
    check(SINGLE, encoding, seed)


@dataclass(frozen=True)
class Sample:
    """Has a value of each kind that a snapshot may have."""

    parts: Tuple[Part, ...]
    pairs: Tuple[Tuple[str, bool], ...]
    result: Optional[Result]
    number: float
    nothing: Optional[Tuple[str, ...]] = None


SAMPLE = Sample((Part("p", ("1", "f(a)")),), (("a", True),), Result.SAT, 1.5)


def test_a_snapshot_as_text() -> None:
    assert decode(Sample, encode(SAMPLE)) == SAMPLE
    assert decode(Sample, encode(replace(SAMPLE, result=None, number=2))).number == 2
    endless = replace(SAMPLE, number=float("inf"))  # as the last horizon of Algorithm 1
    assert decode(Sample, encode(endless)) == endless


@pytest.mark.parametrize(
    ("place", "value", "reason"),
    [
        ("parts", 3, "Sample.parts: expected a list: 3"),
        ("parts", [{"name": "p"}], r"Sample.parts\[0\]: expected name, parameters"),
        ("pairs", [["a"]], r"Sample.pairs\[0\]: expected 2 values"),
        ("pairs", [["a", 1]], r"Sample.pairs\[0\]\[1\]: expected bool: 1"),
        ("result", "MAYBE", "MAYBE"),
        ("number", "1", "Sample.number: expected float: '1'"),
        ("number", 10**400, "Sample.number: expected float: 1000"),
    ],
)
def test_a_text_that_is_no_snapshot(place: str, value: object, reason: str) -> None:
    data = json.loads(encode(SAMPLE))
    data[place] = value
    with pytest.raises(ValueError, match=reason):
        decode(Sample, json.dumps(data))
