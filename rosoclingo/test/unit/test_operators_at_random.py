"""Random operators, two at once, with restarts, other patterns, and processes that die.

The robots' own log is the judge: nothing begins that was not let go, and nothing that was let go
hangs. ``OPERATORS=1000`` in the environment makes so many runs.
"""

from __future__ import annotations

from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Callable, Dict, Iterator, List, NamedTuple, Optional, Sequence, Set, Tuple

import pytest
from crashes import Life, Runs, World
from draws import draws

from rosoclingo.in_process.parts import SINGLE
from rosoclingo.loop.execution.interlock import Interlock
from rosoclingo.loop.journal import AnswerArrived, Control, ControlArrived, ControlOutcome
from rosoclingo.loop.loop import Loop
from rosoclingo.loop.values.execution import Execution, HoldReason, OperatorState
from rosoclingo.store.store import Store

FLEET = str(Path(__file__).with_name("fleet.lp"))
PATTERNS = ((), ("go(*)",), ("clean(*)", "visit(*)"), ("*",), ("do(r1,*)",), ("go(1)", "go(2)"))
RECORDING, DYN_RESET = (f"dynamic.incremental.{name}" for name in ("recording", "dyn_reset"))
CLEANING = [f"clean({robot},{place})" for robot in ("r1", "r2") for place in (1, 2, 3)]
VISITS = [f"visit({cell})" for cell in range(1, 5)]
CASES = [
    (DYN_RESET, FLEET, CLEANING),
    (RECORDING, FLEET, CLEANING),
    (DYN_RESET, "line_demand.lp", VISITS),
    (SINGLE, "line_1.0.lp", VISITS),
]
DONE, REFUSED = True, False


class Named(NamedTuple):
    """An action with the token that it has while it is held."""

    actuator: str
    action: str
    token: int


class Judged(World):
    """Robots with a log, and two operators who decide at random, until all has to end."""

    def __init__(self, requests: Sequence[str], chance: Random) -> None:
        super().__init__(requests)
        self.chance = chance
        self.acts = chance.randrange(4, 16)  # of operators, before they let all go
        self.cancels = {key for key in self.clients if chance.random() < 0.3}
        self.shown = OperatorState()
        self.interlock = Interlock()  # with the patterns of this life
        self.begun: List[Tuple[Named, bool]] = []  # in order; and whether it needed an approval
        self.asked: List[Tuple[ControlArrived, Set[Named]]] = []
        self.outcomes: Dict[int, bool] = {}  # by the place in asked
        self.is_paused = False  # for certain
        self.on_hold: Set[str] = set()  # by requests, too
        self.ends_soon = 0.0  # how often a life ends in its turn
        self.let_go_before: Set[int] = set()
        self._seen: Set[Tuple[str, int]] = set()
        self._answers: List[Tuple[str, int]] = []

    # What they hear.

    def hear(self, run: str, told: Sequence[Execution]) -> None:
        self._answers = [(run, one.number) for one in told if one.answer is None]
        for one in told:
            if (run, one.number) in self._seen:
                continue
            self._seen.add((run, one.number))
            named = Named(one.actuator, one.action, one.held_as)
            # What was let go in the life before, the robot may hear only now.
            needs = (
                self.interlock.reason(one.actuator, one.action) is HoldReason.APPROVAL
                and one.number not in self.let_go_before
            )
            assert not self.is_paused, f"{named} begins, and the run is paused"
            assert one.actuator not in self.on_hold, f"{named} begins, and is on hold"
            self.begun.append((named, needs))

    def answered(self, request: ControlArrived, outcome: ControlOutcome) -> None:
        for place, (asked, _) in enumerate(self.asked):
            if asked is request:
                self.outcomes[place] = outcome.is_done
        if not outcome.is_done:
            return
        later = [asked for asked, _ in self.asked[self._place(request) + 1 :]]
        lifts = (Control.RESUME, Control.STEP)
        if request.control is Control.PAUSE and not any(one.control in lifts for one in later):
            self.is_paused = True
        released = any(
            (one.control, one.actuator) == (Control.RELEASE, request.actuator) for one in later
        )
        if request.control is Control.HOLD and not released:
            self.on_hold.add(request.actuator)

    def _place(self, request: ControlArrived) -> int:
        return next(n for n, (asked, _) in enumerate(self.asked) if asked is request)

    # What they do.

    def turn(self, life: Life) -> None:
        chance = self.chance
        if chance.random() < self.ends_soon:
            life.close()
            return
        todo: List[Callable[[], None]] = []
        for key in self.clients:
            if not (key in life.known or self.clients[key].end()):
                todo.append(lambda key=key: life.ask(key))  # type: ignore[misc]
        cancels = [k for k in sorted(self.cancels) if k in life.known and self.clients[k].words]
        for key in cancels:
            if not self.clients[key].end():
                todo.append(lambda key=key: self._cancel(life, key))  # type: ignore[misc]
        for run, number in self._answers:
            todo.append(lambda r=run, n=number: self._answer(life, r, n))  # type: ignore[misc]
        if self.acts > 0 and life.known:
            todo += [lambda: self._decide(life)] * 2
        if todo:
            chance.choice(todo)()
        elif self.acts <= 0:
            self._let_all_go(life)

    def _cancel(self, life: Life, key: str) -> None:
        self.cancels.discard(key)
        life.cancel(life.known[key])

    def _answer(self, life: Life, run: str, number: int) -> None:
        value = "failure" if self.chance.random() < 0.15 else "success"
        life.put(AnswerArrived(run, number, value))

    def _decide(self, life: Life) -> None:
        """Two operators decide at once; both see the same."""
        self.acts -= 1
        for _ in range(self.chance.choice((1, 2, 2, 3))):
            self._say(life, self._request())

    def _request(self) -> ControlArrived:
        chance = self.chance
        word = chance.choice(
            [Control.APPROVE, Control.REJECT] * 3
            + [Control.PAUSE, Control.RESUME, Control.STEP, Control.HOLD, Control.RELEASE]
        )
        if word in (Control.PAUSE, Control.RESUME, Control.STEP):
            return ControlArrived(word)
        if word in (Control.HOLD, Control.RELEASE):
            return ControlArrived(word, chance.choice(("r1", "r2", "robot")))
        past = [named for named, _ in self.begun] + [n for _, some in self.asked for n in some]
        known = [*self._held() * 4, *past] or [Named("r1", "go(1)", 1)]
        one = chance.choice(known)
        token = chance.choice((one.token, one.token, 0))
        return ControlArrived(word, one.actuator, action=one.action, token=token)

    def _held(self) -> List[Named]:
        return [Named(one.actuator, one.action, one.token) for one in self.shown.held]

    def _say(self, life: Life, request: ControlArrived) -> None:
        meant = {
            one
            for one in {*self._held(), *self._maybe_held(life)}
            if request.actuator in ("", one.actuator)
            and request.action in ("", one.action)
            and request.token in (0, one.token)
        }
        self.asked.append((request, meant))
        if request.control in (Control.RESUME, Control.STEP):
            self.is_paused = False
        if request.control is Control.RELEASE:
            self.on_hold.discard(request.actuator)
        life.put(request)

    def _maybe_held(self, life: Life) -> List[Named]:
        executions = life.loop.state.executions
        return [Named(one.actuator, one.action, one.number) for one in executions.held]

    def _let_all_go(self, life: Life) -> None:
        if self.shown.is_paused:
            self._say(life, ControlArrived(Control.RESUME))
        for actuator in self.shown.on_hold:
            self._say(life, ControlArrived(Control.RELEASE, actuator))
        for one in self.shown.held:
            if one.reason in (HoldReason.APPROVAL, HoldReason.REJECTED):
                request = ControlArrived(Control.APPROVE, one.actuator, 0.0, one.action, one.token)
                self._say(life, request)

    # What is judged.

    def judge(self) -> None:
        """Judges a run that is through."""
        approved = {
            one for (ask, some) in self.asked if ask.control is Control.APPROVE for one in some
        }
        for named, needed in self.begun:
            assert not needed or named in approved, f"no operator has let {named} go"
        begun = {named for named, _ in self.begun if named.token}
        for place, (ask, some) in enumerate(self.asked):
            if ask.control is not Control.REJECT or not self.outcomes.get(place) or len(some) != 1:
                continue
            assert not (ask.token and some & begun), f"{some} was rejected, and begins"
        assert not self.shown.held, "it is held, and nothing comes any more"
        open_goals = [key for key, client in self.clients.items() if not client.end()]
        assert not open_goals, f"{open_goals} hang"


class OperatedLife(Life):
    """A life in which operators hear what is held, and what becomes of their requests."""

    def live(self) -> None:
        assert isinstance(self._world, Judged)
        snapshot = self.store.snapshot
        last = [] if snapshot is None else snapshot.state.executions.last.values()
        self._world.let_go_before = {one.number for one in last if not one.is_held}
        super().live()

    def show_held(self, decided: OperatorState) -> None:
        world = self._world
        assert isinstance(world, Judged)
        world.shown = decided

    def answer_control(self, request: ControlArrived, outcome: ControlOutcome) -> None:
        world = self._world
        assert isinstance(world, Judged)
        if any(asked is request for asked, _ in world.asked):  # not of a life before
            world.answered(request, outcome)


class Restarted(Runs):
    """Runs in each of whose lives other patterns hold actions."""

    world: Optional[Judged] = None
    patterns: Sequence[str] = ()

    def make(self, store: Store) -> Callable[..., Loop]:
        assert self.world is not None
        if self.world.acts > 0:
            self.patterns = self.world.chance.choice(PATTERNS)
        self.parameters = {"ask_before": self.patterns, "ask_again": 1000.0}
        self.world.interlock = Interlock(self.patterns)
        return super().make(store)


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    memory = Path("/dev/shm")
    with TemporaryDirectory(dir=str(memory if memory.is_dir() else tmp_path)) as made:
        yield Path(made)


def run(seed: int, runs: Restarted, requests: Sequence[str]) -> Judged:
    """Runs one draw until all goals have ended."""
    chance = Random(seed)
    world = Judged(chance.sample(requests, chance.randrange(1, 4)), chance)
    runs.world = world
    file = runs.file()
    for _ in range(chance.randrange(4)):  # lives that end politely
        world.ends_soon = 0.1
        runs.run(world, [chance.randrange(1, 120) for _ in range(chance.randrange(3))], file)
    world.ends_soon = 0.0
    runs.run(world, [chance.randrange(1, 60)] * chance.randrange(2), file)
    world.judge()
    return world


@pytest.mark.costly
@pytest.mark.parametrize("case", range(len(CASES)))
def test_what_operators_say_holds(case: int, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each fourth draw is one of this mode and encoding."""
    monkeypatch.setattr("crashes.Life", OperatedLife)
    mode, encoding, requests = CASES[case]
    runs = Restarted(folder, mode, encoding)
    count, refused = 0, 0
    for seed in draws(range(16), 400, "OPERATORS"):
        if seed % len(CASES) != case:
            continue
        try:
            world = run(seed, runs, requests)
        except AssertionError as err:
            raise AssertionError(f"seed {seed}: {err}") from err
        count += len(world.begun)
        refused += list(world.outcomes.values()).count(REFUSED)
    print(f"{mode}, {encoding}: {count} actions, {refused} requests refused, {runs.kills} kills")
    assert count
