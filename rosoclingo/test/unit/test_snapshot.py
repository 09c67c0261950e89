"""A loop that is saved and restored at every step runs like one that is not."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from random import Random
from typing import Callable, Dict, List, Optional, Tuple

import pytest
from conftest import PACKAGE

from rosclingo.errors import RosclingoError
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Part, Result
from rosoclingo.commands import ROSCommands
from rosoclingo.errors import ShutdownError
from rosoclingo.loop import journal
from rosoclingo.loop.controller import Controller
from rosoclingo.loop.environment import Environment
from rosoclingo.loop.goals import Goal, GoalClient, Stage
from rosoclingo.loop.inbox import Inbox, Message
from rosoclingo.loop.loop import Loop
from rosoclingo.loop.snapshot import decode, encode
from rosoclingo.single.algorithm1 import Algorithm1, commands_for
from rosoclingo.single.dialects import detect, says_status

EXAMPLE = PACKAGE / "example"
DYNAMIC = sorted(file.stem for file in (PACKAGE / "modes").glob("dynamic.*.lp"))
ENCODINGS = ["line.lp", "line_demand.lp"]
SINGLE = ["line.lp", "line_1.0.lp", "line_paper.lp", "line_demand.lp"]
INPUTS = 12


class Client(GoalClient):
    """Remembers what it is told, and cancels the goal that is its now."""

    def __init__(self, run: Run, identifier: str, request: str) -> None:
        self.goal = Goal(request, ("one", "two"), identifier, self)
        self.heard: List[Tuple[str, ...]] = []
        self._run = run

    def noted(self, goal: Goal, word: str, reason: str) -> None:
        self.heard.append(("status", goal.slot or "", word, reason))

    def accepted(self) -> None:
        self.heard.append(("accepted",))

    def ended(self, word: str, reason: str) -> None:
        self.heard.append(("ended", word, reason))

    def feedback(self, line: str) -> None:
        self.heard.append(("feedback", line))


class Run(Inbox, Environment):
    """A run in one thread: what comes, comes by chance, but the same in each run of a seed."""

    def __init__(self, seed: int, make: Callable[[Run], Loop], *, restores: bool) -> None:
        super().__init__()
        self.clients: Dict[str, Client] = {}
        self.seen: List[object] = []  # all that leaves the loop
        self.snapshots = 0
        self._chance = Random(seed)
        self._acting: Dict[str, str] = {}
        self._left = INPUTS
        self._make = make
        self._restores = restores
        self.loop = make(self)

    def run(self) -> Optional[RosclingoError]:
        """Runs until nothing comes any more; returns why the loop ended by itself."""
        try:
            self.loop.prepare()
            while True:
                if self._restores:
                    self._restore()
                if self._chance.random() < 0.1:  # while the loop is busy
                    self._turn()
                self.loop.step()
        except ShutdownError:
            return None
        except RosclingoError as err:
            return err

    def _restore(self) -> None:
        """Goes on with a new loop."""
        saved = self.loop.snapshot()
        self.loop = self._make(self)
        for identifier, goal in self.loop.restore(saved, self.clients.__getitem__).items():
            self.clients[identifier].goal = goal
        assert without_times(self.loop.snapshot()) == without_times(saved)
        self.snapshots += 1

    # What the loop calls.

    def publish(self, actuator: str, action: str) -> None:
        self.seen.append(("publish", actuator, action))
        if actuator != "solver" and action != "abort":
            self._acting[actuator] = action

    def note(self, record: journal.Record) -> None:
        fields = journal.encode(record.event)._replace(seconds=0.0)
        self.seen.append((fields, record.step, record.horizon))

    def warn(self, text: str) -> None:
        self.seen.append(("warn", text))

    def wait(self, timeout: float) -> bool:
        while not (self._items or self.closed):
            self._turn()
        return True

    # What happens outside.

    def _turn(self) -> None:
        """Lets something come, an answer or something new; closes when all has come."""
        answers = bool(self._acting) and (self._left == 0 or self._chance.random() < 0.7)
        if answers:
            actuator = self._chance.choice(sorted(self._acting))
            del self._acting[actuator]
            self.put(Message(actuator, self._chance.choice(["success", "success", "failure"])))
        elif self._left:
            self._left -= 1
            self._chance.choice([*[self._ask] * 3, self._cancel, self._tell])()
        else:
            self.close()

    def _ask(self) -> None:
        identifier, cell = f"goal {len(self.clients)}", self._chance.choice([1, 2, 3, 4, 99])
        client = self.clients[identifier] = Client(self, identifier, f"visit({cell})")
        self.put(client.goal)

    def _cancel(self) -> None:
        goals = [c.goal for c in self.clients.values() if c.goal.stage is not Stage.ENDED]
        if goals:
            self.cancel(self._chance.choice(goals))

    def _tell(self) -> None:
        values = ["close(8)", "close(99)", "open(8)", "nonsense(", "passed"]
        self.put(Message("info", self._chance.choice(values)))


def without_times(saved: str) -> object:
    """Returns what a snapshot says but for how long actuators have acted."""
    data = json.loads(saved)
    for _, acting in data["state"]["mail"]["acting"]:
        assert acting.pop("began") <= acting.pop("reminded") <= 0
    return data


def check(make: Callable[[], Callable[[Run], Loop]], seed: int) -> None:
    runs = [Run(seed, make(), restores=restores) for restores in (False, True)]
    ends = [str(run.run()) for run in runs]
    assert ends[0] == ends[1]
    assert runs[0].seen == runs[1].seen
    heard = [{name: client.heard for name, client in run.clients.items()} for run in runs]
    assert heard[0] == heard[1]
    assert runs[1].snapshots > INPUTS
    assert any(entry[0] == "publish" for entry in runs[0].seen if isinstance(entry, tuple))


@pytest.mark.long
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("mode", DYNAMIC)
def test_a_mode(mode: str, encoding: str, seed: int) -> None:
    def make() -> Callable[[Run], Loop]:
        options = Options((str(PACKAGE / "modes" / f"{mode}.lp"),), ("-c", "steps=30"))
        planner = Engine(Options((str(EXAMPLE / encoding),)))
        # The controller begins anew, the planner is as it was.
        return lambda run: Loop(Controller(Engine(options)), planner, ROSCommands, run, run)

    check(make, seed)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("encoding", SINGLE)
def test_one_node(encoding: str, seed: int) -> None:
    def make() -> Callable[[Run], Loop]:
        options = Options((str(EXAMPLE / encoding),))
        dialect = detect(options)
        planner = dialect(Engine(options))
        commands = commands_for(dialect, ROSCommands, says_status(options))
        return lambda run: Loop(Algorithm1(dialect.first_step, 30), planner, commands, run, run)

    check(make, seed)


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


@pytest.mark.parametrize(
    ("place", "value", "reason"),
    [
        ("parts", 3, "Sample.parts: expected a list: 3"),
        ("parts", [{"name": "p"}], r"Sample.parts\[0\]: expected name, parameters"),
        ("pairs", [["a"]], r"Sample.pairs\[0\]: expected 2 values"),
        ("pairs", [["a", 1]], r"Sample.pairs\[0\]\[1\]: expected bool: 1"),
        ("result", "MAYBE", "MAYBE"),
        ("number", "1", "Sample.number: expected float: '1'"),
    ],
)
def test_a_text_that_is_no_snapshot(place: str, value: object, reason: str) -> None:
    data = json.loads(encode(SAMPLE))
    data[place] = value
    with pytest.raises(ValueError, match=reason):
        decode(Sample, json.dumps(data))
