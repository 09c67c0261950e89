"""A replay takes everything at the moment at which it was taken, however it comes."""

from __future__ import annotations

import contextlib
import os
import random
import threading
import time
from dataclasses import replace
from typing import Any, Callable, Dict, Iterator, List, Optional, Sequence

import pytest
from conftest import PACKAGE, TIMEOUT, Make, RecordedGoal, System
from replay_maker import run_of

from rosclingo.errors import ParameterError
from rosclingo.wire.commands import Assumed, Improvement, Outcome, Result
from rosoclingo.bags.compare import text_report
from rosoclingo.bags.compare.comparison import compare
from rosoclingo.bags.read.run import Run
from rosoclingo.bags.replay.input_schedule import input_schedule
from rosoclingo.bags.replay.replays import ExactReplay
from rosoclingo.loop.inputs.inbox import Cancel, Inbox
from rosoclingo.loop.inputs.replay_inbox import (
    Phase,
    ReplayInbox,
    ScheduledInput,
    ScheduledKind,
    decode,
    encode,
)
from rosoclingo.loop.journal import (
    LOOP,
    ActionPublished,
    CancelArrived,
    CommandDone,
    Control,
    ControlArrived,
    Entry,
    Event,
    GoalArrived,
    LoopEnded,
    LoopWaits,
    MessageArrived,
    MessageDropped,
    Reason,
    Record,
    Status,
    StatusSet,
)
from rosoclingo.loop.values.solver import Solver

GOALS = 10
REQUESTS = ["visit(1)", "visit(3)", "visit(6)", "visit(2)", "visit(99)"]
ACTUATOR = "robot"
OF_RUN = (Control.PAUSE, Control.HALT, Control.STEP, Control.RESUME)
LAST = "close(8)"  # a message without effect, which is sent when all is through
LINE = str(PACKAGE / "example" / "line.lp")
DEMAND = str(PACKAGE / "example" / "line_demand.lp")
PAPER = str(PACKAGE / "example" / "line_paper.lp")
WORKSHOP = tuple(
    str(PACKAGE.parent / "rosoclingo_aspprograms" / "workshop" / file)
    for file in ("instances/furniture.lp", "workshop.lp")
)  # whose requests take many actions each


class NotedGoal(RecordedGoal):
    """A goal that the journal knows of, as one of the node's action."""

    def __init__(self, run: Session, identifier: str, request: str) -> None:
        super().__init__(request, identifier)
        self._run = run

    def noted(self, change: StatusSet) -> None:
        self._run.note(change)


class Session:
    """A system's run, with its journal."""

    def __init__(self, system: System, answer: Callable[[str, str], Optional[str]]) -> None:
        self.entries: List[Entry] = []
        self.inbox = system.inbox
        self.goals: Dict[str, NotedGoal] = {}
        self.note: Callable[[Event], None] = system.loop.state.note
        self._changed = threading.Condition()
        self._system = system
        system.world.answer = answer
        system.world.note = self._add  # as the node does

    def start(self) -> None:
        self._system.start()

    def goal(self, identifier: str, request: str) -> None:
        self.goals[identifier] = NotedGoal(self, identifier, request)
        self.inbox.put(self.goals[identifier])

    def cancel(self, identifier: str) -> None:
        if self.goals[identifier].words[-1:] in ([], ["accepted"]):  # as actionlib has it
            self.inbox.cancel(self.goals[identifier])

    def control(self, word: Control) -> None:
        self.inbox.put(ControlArrived(word, "" if word in OF_RUN else ACTUATOR))

    def wait_for(self, condition: Callable[[List[Event]], bool]) -> None:
        """Waits for a condition of the journal."""
        with self._changed:
            assert self._changed.wait_for(
                lambda: condition([entry.event for entry in self.entries]), TIMEOUT
            ), self.entries[-9:]

    def _add(self, record: Record) -> None:
        with self._changed:
            number = len(self.entries) + 1
            self.entries.append(
                Entry(record.event, record.step, record.horizon, number, time.monotonic())
            )
            self._changed.notify_all()


def commands(events: Sequence[Event]) -> List[str]:
    return [event.command for event in events if isinstance(event, CommandDone)]


def is_idle(events: Sequence[Event]) -> bool:
    done = [event for event in events if isinstance(event, (CommandDone, LoopWaits))]
    return isinstance(done[-1], LoopWaits)


def rests(events: Sequence[Event]) -> bool:
    """Whether the loop has taken the last message, and waits."""
    came = [event.value for event in events if isinstance(event, MessageArrived)]
    return LAST in came and is_idle(events)


class Slow:
    """A solver that thinks before it searches, and may be interrupted then.

    clingo itself is not: where that leaves off is up to chance, and what it finds next, too.
    """

    def __init__(self, solver: Solver, chance: random.Random) -> None:
        self._solver = solver
        self._chance = chance

    def solve(
        self,
        assumptions: Sequence[Assumed] = (),
        stopped: Optional[Callable[[], bool]] = None,
        improved: Callable[[Improvement], None] = lambda _: None,
    ) -> Outcome:
        assert stopped is not None
        end = time.monotonic() + self._chance.choice([0.0, 0.0, 0.002, 0.01])
        while time.monotonic() < end:
            if stopped():
                return Outcome(Result.UNKNOWN, interrupted=True)
            time.sleep(0.0005)
        return self._solver.solve(assumptions, lambda: False, improved)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._solver, name)


def slow(system: System, seed: int) -> System:
    planner = system.loop.state.planner
    planner._solver = Slow(planner._solver, random.Random(seed))
    return system


def has_ended(events: Sequence[Event]) -> bool:
    return any(isinstance(event, LoopEnded) for event in events)


def record(
    system: System, seed: int, requests: Sequence[str] = REQUESTS, *, ends: bool = False
) -> List[Entry]:
    """Runs a system to which everything comes at random, until it waits, or until it has ended."""
    chance, operator = random.Random(seed), random.Random(f"operator {seed}")
    timers: List[threading.Timer] = []

    def later(action: Callable[[], None], longest: float) -> None:
        timer = threading.Timer(chance.random() * longest, action)
        timer.start()
        timers.append(timer)  # started: another thread may wait for it at once

    def answer(actuator: str, action: str) -> Optional[str]:
        value = "failure" if chance.random() < 0.1 else "success"
        if chance.random() < 0.5:
            return value
        later(lambda: system.inbox.put(MessageArrived(actuator, value)), 0.005)
        return None

    run = Session(system, answer)
    run.start()
    for number in range(GOALS if requests == REQUESTS else GOALS // 5):
        name = f"g{number}"
        run.goal(name, chance.choice(requests))
        if chance.random() < 0.2:
            run.cancel(name)
        elif chance.random() < 0.3:
            later(lambda name=name: run.cancel(name), 0.05)  # type: ignore[misc]  # as it is now
        for identifier in ("robot", "info"):
            if chance.random() < 0.2:
                run.inbox.put(
                    MessageArrived(identifier, chance.choice(["success", "bad(", "close(9)"]))
                )
        for word in operator.sample(list(Control), 2):
            later(lambda word=word: run.control(word), 0.05)  # type: ignore[misc]  # as it is now
        if chance.random() < 0.5:
            time.sleep(chance.random() * 0.05)
    for timer in timers[:]:
        timer.join()
    run.control(Control.RESUME)
    run.control(Control.RELEASE)
    for _ in range(4 * GOALS if ends else 0):  # more than it can do
        if has_ended([entry.event for entry in run.entries]):
            break
        run.goal(f"g{len(run.goals)}", chance.choice(requests))
        time.sleep(chance.random() * 0.02)
    if ends:  # a mode may wait in its last step; a search that is cut off is no part of a run
        run.wait_for(lambda events: has_ended(events) or is_idle(events))
        run.inbox.close()
        run.wait_for(has_ended)
    for goal in run.goals.values():
        goal.wait()
    for timer in timers:
        timer.join()
    if not ends:
        run.inbox.put(MessageArrived("info", LAST))
        run.wait_for(rests)
    return list(run.entries)


def replay(system: System, recorded: Sequence[Entry], seed: int) -> List[Entry]:
    """Sends everything as soon as it may come, or a little later."""
    chance = random.Random(seed)
    run = Session(system, lambda actuator, action: None)
    exact = ExactReplay(Run(recorded))
    seen = 0
    run.start()
    end = time.monotonic() + TIMEOUT
    while not exact.progress.is_finished(time.monotonic()):
        assert time.monotonic() < end, run.entries[-9:]
        for entry in run.entries[seen:]:
            exact.see(entry, time.monotonic())
            seen += 1
        planned = exact.due(time.monotonic())
        assert exact.is_exact
        if planned is not None:
            event = planned.event
            if isinstance(event, GoalArrived):
                run.goal(event.goal, event.request)
            elif isinstance(event, CancelArrived):
                run.cancel(event.goal)
            else:
                run.inbox.put(replace(event, seconds=0.0))
        if planned is None or chance.random() < 0.5:
            time.sleep(0.003 * chance.random())
    return list(run.entries)


def replay_alike(system: System, recorded: Sequence[Entry], seed: int) -> List[Entry]:
    """Replays a run likewise, which has to be the same."""
    again = replay(system, recorded, seed)
    comparison = compare(Run(recorded), Run(again))
    assert not comparison.differences, text_report.describe(comparison)
    old, new = (commands([entry.event for entry in run]) for run in (recorded, again))
    assert new[: len(old)] == old
    return again


@pytest.mark.costly
@pytest.mark.long
@pytest.mark.parametrize(
    ("mode", "seed"),
    [("recording", 0), ("dyn_reset", 1), ("reset", 2), ("single", 3), ("paper", 4), ("demand", 5),
     ("busy", 8), ("2.0", 6)],
)  # fmt: skip
def test_a_replay_is_the_same(system: Make, single: Make, mode: str, seed: int) -> None:
    def make(inbox: Inbox) -> System:
        more = {"inbox": inbox, "policies": policies}
        if mode in ("single", "paper"):
            return single(LINE if mode == "single" else PAPER, **more)
        if mode == "demand":
            dyn_reset = "dynamic.incremental.dyn_reset"
            return system(dyn_reset, "-c", "steps=80", encoding=(DEMAND,), **more)
        if mode == "busy":
            recording = "dynamic.incremental.recording"
            return system(recording, "-c", "steps=40", encoding=WORKSHOP, **more)
        if mode == "2.0":  # which resets before the answers of the step
            style = str(PACKAGE / "test" / "modes" / "dynamic_2_0.lp")
            options = ("steps=80", "resets=every", "early=1")
            return system(style, *(f"-c{option}" for option in options), **more)
        return system(f"dynamic.incremental.{mode}", "-c", "steps=80", **more)

    policies = {"*": {"retries": 1, "pause": 0.02}} if seed % 2 else {}
    first = make(Inbox())
    requests = {"requests": ["make(chair)"]} if mode == "busy" else {}
    recorded = record(slow(first, seed), seed, **requests)
    second = make(ReplayInbox(input_schedule(Run(recorded))))
    replay_alike(slow(second, seed), recorded, seed)
    assert second.loop.state.externals.true == first.loop.state.externals.true


@pytest.mark.costly
def test_a_replay_of_a_run_with_a_backlog_is_the_same(
    system: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The journal says when each goal was taken, however many wait in the inbox."""

    def make(inbox: Inbox) -> System:
        return system("dynamic.incremental.dyn_reset", "-c", "steps=80", inbox=inbox)

    monkeypatch.setattr("rosoclingo.loop.mail.MOST_QUEUED", -1)  # of two slots, one goal
    recorded = record(slow(make(Inbox()), 9), 9)
    monkeypatch.undo()
    second = make(ReplayInbox(input_schedule(Run(recorded))))
    replay_alike(slow(second, 9), recorded, 9)


@pytest.mark.parametrize("seed", range(int(os.environ.get("ENDS", "3"))))
def test_a_replay_of_a_run_that_has_ended_is_the_same(
    system: Make, single: Make, seed: int
) -> None:
    """No plan, or no further step: ENDS=500 in the environment ends so many runs at random."""
    steps = ("-c", f"steps={random.Random(seed).randint(2, 7)}")
    mode = ["recording", "dyn_reset", "reset", "single"][seed % 4]

    def make(inbox: Inbox) -> System:
        if mode == "single":
            return single(LINE, *steps, inbox=inbox)
        return system(f"dynamic.incremental.{mode}", *steps, inbox=inbox)

    recorded = Run(record(slow(make(Inbox()), seed), seed, ends=True))
    again = replay(slow(make(ReplayInbox(input_schedule(recorded))), seed), recorded.recorded, seed)
    comparison = compare(recorded, Run(again))
    assert not comparison.differences, text_report.describe(comparison)


A, B = MessageArrived("robot", "a"), MessageArrived("robot", "b")


class Waits:
    """Counts how often a gate has said that it waits."""

    def __init__(self) -> None:
        self.count = 0
        self._seen = threading.Event()

    def __call__(self) -> None:
        self.count += 1
        self._seen.set()

    @contextlib.contextmanager
    def during(self, call: Callable[[Waits], None]) -> Iterator[None]:
        """Something happens while a gate waits, which goes on then."""
        self._seen.clear()
        thread = threading.Thread(target=call, args=[self])
        thread.start()
        assert self._seen.wait(TIMEOUT)
        yield
        thread.join(TIMEOUT)
        assert not thread.is_alive()


def due(decision: int, phase: Phase, item: MessageArrived) -> ScheduledInput:
    return ScheduledInput(decision, phase, ScheduledKind.MESSAGE, item.source, item.value)


def test_it_waits_for_what_came_before_a_decision() -> None:
    gate, waits = ReplayInbox([due(1, Phase.BEFORE, A), due(1, Phase.BEFORE, B)]), Waits()
    gate.begin_decision(waits)
    gate.begin_command(waits)
    assert not waits.count
    gate.put(B)
    assert gate.take() == []
    assert not gate.wait(0.0)
    with waits.during(gate.begin_decision):
        gate.put(A)
    assert gate.take() == [A, B]
    assert waits.count == 1


def test_it_waits_until_nodes_are_killed() -> None:
    kills = [
        ScheduledInput(n, Phase.BEFORE, ScheduledKind.KILL, name)
        for n, name in enumerate(["planner", LOOP])
    ]
    gate, waits = ReplayInbox([kills[0], due(0, Phase.BEFORE, A), kills[1]]), Waits()
    gate.put(A)
    for ends, items in ((gate.go_on, [A]), (gate.open, [])):
        with waits.during(gate.begin_decision):
            assert gate.take() == []
            ends()
        assert gate.take() == items
        gate.begin_command(waits)
    assert waits.count == 2


def test_nodes_are_killed_when_all_has_come_that_came_before() -> None:
    kill = ScheduledInput(0, Phase.BEFORE, ScheduledKind.KILL, LOOP)
    gate = ReplayInbox([due(0, Phase.BEFORE, A), kill, due(0, Phase.BEFORE, B)])
    held: List[int] = []

    def waits() -> None:
        held.append(len(gate._held))
        gate.go_on()
        gate.put(B)

    thread = threading.Thread(target=lambda: gate.begin_decision(waits))
    thread.start()
    gate.put(A)
    thread.join(TIMEOUT)
    assert not thread.is_alive()
    assert held == [1]
    assert gate.take() == [A, B]


def test_what_a_command_took_is_there_when_it_begins() -> None:
    gate, waits = ReplayInbox([due(0, Phase.DURING, A), due(0, Phase.DURING, B)]), Waits()
    gate.begin_decision(waits)
    gate.put(A)
    assert gate.take() == []
    with waits.during(gate.begin_command):
        gate.put(B)
    assert gate.take() == [A, B]


def test_what_came_while_the_loop_waited_comes_one_by_one() -> None:
    dues = [due(0, Phase.WAIT, A), due(0, Phase.WAIT, B), due(1, Phase.WAIT, A)]
    gate, waits = ReplayInbox(dues), Waits()
    gate.begin_decision(waits)
    gate.begin_command(waits)
    gate.put(A)
    gate.put(A)
    assert gate.wait(0.0)
    assert gate.take() == [A]
    assert not gate.wait(0.0)
    gate.put(B)
    assert gate.take() == [B]
    assert gate.take() == []
    gate.begin_decision(waits)
    assert gate.take() == []
    gate.begin_command(waits)
    assert gate.take() == [A]
    assert not waits.count


def test_a_goal_is_recalled_when_it_was() -> None:
    goal = RecordedGoal("visit(1)")
    goal.id = "g"
    dues = [
        ScheduledInput(step, Phase.BEFORE, kind, "g")
        for step, kind in ((1, ScheduledKind.RECALL), (2, ScheduledKind.CANCEL))
    ]
    gate, waits = ReplayInbox(dues), Waits()
    gate.cancel(goal)
    gate.begin_decision(waits)
    assert gate.take() == []
    assert not goal.words
    gate.begin_decision(waits)
    assert gate.take() == []
    assert goal.words == ["canceled"]
    gate.begin_decision(waits)
    assert gate.take() == [Cancel(goal)]
    assert not waits.count


def test_what_is_not_known_is_let_through() -> None:
    goal = RecordedGoal("visit(1)")
    gate = ReplayInbox([due(9, Phase.BEFORE, A)])
    for item in (A, A, B):
        gate.put(item)
    gate.cancel(goal)
    assert gate.take() == [A, B, Cancel(goal)]
    assert goal.words == ["canceled"]


@pytest.mark.parametrize("how", ["open", "end", "close"])
def test_nothing_is_held_back_for_ever(how: str) -> None:
    goal = RecordedGoal("visit(1)")
    goal.id = "g"
    dues = [
        due(0, Phase.BEFORE, A),
        due(0, Phase.BEFORE, B),
        ScheduledInput(1, Phase.BEFORE, ScheduledKind.CANCEL, "g"),
    ]
    gate, waits = ReplayInbox(dues), Waits()
    gate.put(B)
    gate.cancel(goal)
    ways = {"open": gate.open, "end": lambda: gate.end("no plan"), "close": gate.close}
    with waits.during(gate.begin_decision):
        ways[how]()
    if how != "close":
        assert gate.take() == [B, Cancel(goal)]
        assert goal.words == ["canceled"]
        gate.open()
        assert gate.take() == []


def made(*events: Event) -> List[ScheduledInput]:
    return input_schedule(run_of(list(map(Record, events))))


def test_when_something_was_taken() -> None:
    """Before a decision, in a command that did not wait for it, or in one that did."""
    message = MessageArrived("robot", "success")
    late = replace(message, seconds=0.1)
    idle, waiting = CommandDone("idle"), LoopWaits()
    cut_off, solved = (CommandDone("solve", result) for result in (Result.UNKNOWN, Result.SAT))
    for events, moment in (
        ([idle, message, idle], (1, Phase.BEFORE)),
        ([idle, waiting, late, idle], (1, Phase.WAIT)),
        ([idle, late, idle], (1, Phase.DURING)),
        ([idle, late, cut_off], (1, Phase.DURING)),
        ([idle, late, solved], (2, Phase.BEFORE)),  # it had no effect on the search
        ([idle, late], (1, Phase.DURING)),  # the recording ends
        ([idle, LoopWaits(for_a_replay=True), message], (1, Phase.BEFORE)),
    ):
        assert made(*events) == [ScheduledInput(*moment, ScheduledKind.MESSAGE, "robot", "success")]


def test_what_was_taken_when_the_loop_had_ended() -> None:
    """Not before: in a command it would be news, by which the loop goes on."""
    message, ended = MessageArrived("robot", "success", seconds=0.1), LoopEnded("no plan")
    found = made(CommandDone("idle"), ended, message)
    assert found == [ScheduledInput(1, Phase.END, ScheduledKind.MESSAGE, "robot", "success")]
    gate, waits = ReplayInbox(found), Waits()
    for _ in range(2):
        gate.begin_decision(waits)
        gate.begin_command(waits)
    assert not waits.count
    with waits.during(gate.begin_end):
        gate.put(MessageArrived("robot", "success"))
    gate.end("no plan")
    assert gate.take() == [MessageArrived("robot", "success")]


def test_a_goal_that_was_recalled_just_before_the_end() -> None:
    recalled = StatusSet("g", Status.CANCELED, reason=Reason.RECALLED)
    events = [GoalArrived("g", "visit(1)"), ActionPublished("robot", "go(1)"), recalled]
    found = made(*events, LoopEnded("no plan"), CancelArrived("g", seconds=0.1))
    assert [(due.moment, due.kind) for due in found[1:]] == [
        ((0, Phase.END), ScheduledKind.RECALL), ((0, Phase.END), ScheduledKind.CANCEL)
    ]  # fmt: skip


def test_when_a_goal_was_recalled() -> None:
    goal, cancel = Record(GoalArrived("g", "visit(1)")), Record(CancelArrived("g"))
    canceled = Record(StatusSet("g", Status.CANCELED, reason=Reason.RECALLED), 7)
    done = Record(CommandDone("commit_actions(7)"), 7)
    action = Record(ActionPublished("robot", "go(1)"), 7)
    for rest, decision in (
        ([canceled, done, cancel], 2),
        ([action, canceled, done, cancel], 3),
        ([replace(canceled, step=8), replace(done, step=8), cancel], 3),  # it had moved on already
    ):
        assert input_schedule(run_of([goal, done, done, *rest]))[1] == ScheduledInput(
            decision, Phase.BEFORE, ScheduledKind.RECALL, "g"
        )


def test_a_goal_that_was_recalled_while_another_one_was_rejected() -> None:
    taken = [GoalArrived(name, "visit(99)", seconds=0.1) for name in "gh"]
    rejected = StatusSet("g", Status.REJECTED, reason="unknown")
    canceled = StatusSet("h", Status.CANCELED, reason=Reason.RECALLED)
    message = MessageArrived("robot", "b(", seconds=0.1), MessageDropped("'b(' is no term")
    for between in ([], [message[1]]):
        arrivals = [*taken, message[0]] if between else taken
        events = (rejected, *between, canceled, CancelArrived("h", seconds=0.1))
        found = made(LoopWaits(), *arrivals, *events, CommandDone("idle"))
        assert [(due.kind, due.id) for due in found[:3]] == [
            (ScheduledKind.GOAL, "g"), (ScheduledKind.RECALL, "h"), (ScheduledKind.GOAL, "h")
        ]  # fmt: skip


def test_a_goal_that_was_recalled_when_it_was_just_taken() -> None:
    """The loop takes it when the cancel request is there: else it might have ended before."""
    waiting, done = LoopWaits(), CommandDone("idle")
    taken = [GoalArrived(name, "visit(99)", seconds=0.1) for name in "gh"]
    canceled = [StatusSet(name, Status.CANCELED, reason=Reason.RECALLED) for name in "gh"]
    cancels = [CancelArrived(name, seconds=0.1) for name in "gh"]
    found = made(waiting, *taken, *reversed(canceled), *cancels, done)
    kinds = [(due.kind, due.id) for due in found]
    assert kinds[:4] == [
        (ScheduledKind.RECALL, "g"),
        (ScheduledKind.GOAL, "g"),
        (ScheduledKind.RECALL, "h"),
        (ScheduledKind.GOAL, "h"),
    ]
    assert {due.moment for due in found} == {(0, Phase.WAIT)}

    gate = ReplayInbox(found)
    gate.begin_decision(Waits())
    gate.begin_command(Waits())
    goals = [RecordedGoal("visit(99)") for _ in "gh"]
    for name, goal in zip("gh", goals):
        goal.id = name
        gate.put(goal)
    assert gate.take() == []
    gate.cancel(goals[0])
    assert gate.take() == [goals[0]]
    assert goals[0].words == ["canceled"]
    gate.cancel(goals[1])
    assert gate.take() == [goals[1], Cancel(goals[0]), Cancel(goals[1])]


def test_what_the_loop_did_not_take() -> None:
    """Goals that are no terms, and cancel requests of goals that had ended."""
    rejected = StatusSet("g", Status.REJECTED, reason="it is no term")
    events = [GoalArrived("g", "visit("), rejected, CancelArrived("g")]
    assert made(*events) == []
    assert made(*events, MessageArrived("g", "success")) == [
        ScheduledInput(0, Phase.BEFORE, ScheduledKind.MESSAGE, "g", "success")
    ]


def test_the_parameter() -> None:
    dues = [
        due(3, Phase.WAIT, MessageArrived("a\x00b", "\n\u2028")),
        ScheduledInput(4, Phase.BEFORE, ScheduledKind.GOAL, "g"),
    ]
    assert decode(encode(dues)) == dues
    assert decode(encode([])) == []
    for wrong in (
        "",
        "{",
        "3",
        "[3]",
        "[[1,2]]",
        '[[0,9,"goal","g",""]]',
        '[["x",0,"goal","g",""]]',
        '[[1e999,0,"goal","g",""]]',
        "[" * 9999,
        3,
        [1],
    ):
        with pytest.raises(ParameterError, match="parameter ~replay"):
            decode(wrong)
