"""What the journal tells of a run with crashes: all of it, and once."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from random import Random
from typing import Any, List, Optional

import pytest
from conftest import Make
from crashes import Runs, World, outcome
from draws import draws
from journals import Journal
from test_replay_inbox import replay_alike

from rosoclingo.bags.read.run import Run
from rosoclingo.bags.replay.input_schedule import input_schedule, rest
from rosoclingo.bags.replay.kills import KillSchedule
from rosoclingo.bags.replay.replays import ExactReplay
from rosoclingo.loop.inputs.replay_inbox import Phase, ReplayInbox, ScheduledKind
from rosoclingo.loop.journal import (
    ARRIVALS,
    IMPROVING,
    LOOP,
    CommandDone,
    Ended,
    Entry,
    LoopWaits,
    NodeResumed,
    Reason,
    SearchEnded,
    key_of,
)
from rosoclingo.store.store import Store

REQUESTS = ["visit(2)", "visit(99)", "visit(4)", "visit(1)", "visit(3)"]
CANCELS = {"3": "accepted", "4": ""}
KILLS = 25


def journal_of(file: Path) -> List[Entry]:
    store = Store(file)
    found = store.records
    store.close()
    return found


def inputs(entries: List[Entry]) -> Counter[Any]:
    """Counts what has come; a cancel request once, as the world makes it again after a crash."""
    events = (entry.event for entry in entries)
    found = Counter(key_of(event) for event in events if isinstance(event, ARRIVALS))
    return Counter({key: 1 if key[0] is ScheduledKind.CANCEL else n for key, n in found.items()})


@pytest.mark.costly
@pytest.mark.parametrize("seed", draws(range(2), 4))
@pytest.mark.parametrize("mode", ["recording", "dyn_reset"])
def test_a_replay_without_the_crashes(system: Make, tmp_path: Path, mode: str, seed: int) -> None:
    """The journal of a run with crashes is one that a run without them can have."""
    mode = f"dynamic.incremental.{mode}"
    runs, chance = Runs(tmp_path, mode), Random(seed)
    calm, calm_file = World(REQUESTS, CANCELS), runs.file()
    runs.run(calm, file=calm_file)
    world, file = World(REQUESTS, CANCELS), runs.file()
    runs.run(world, [chance.randrange(1, 30) for _ in range(KILLS)], file)
    assert outcome(world) == outcome(calm)

    recorded = journal_of(file)
    crashes = [entry.event for entry in recorded if isinstance(entry.event, NodeResumed)]
    assert len(crashes) > KILLS // 3
    assert [entry.number for entry in recorded] == list(range(1, len(recorded) + 1))
    assert inputs(recorded) == inputs(journal_of(calm_file))

    inbox = ReplayInbox(input_schedule(Run(recorded)))
    replay_alike(system(mode, "-c", "steps=30", inbox=inbox), recorded, seed)


def test_what_came_while_a_loop_waited_that_died_comes_before_the_next_decision() -> None:
    journal = Journal().command("idle").add("waiting").message("info", "b(").add("resumed", LOOP)
    journal.message("info", "open(5)").command("assign_messages(1)").add("waiting")
    journal.add("resumed", "planner", "gone").message("info", "open(6)").command("idle")
    run = Run(journal.entries)
    dues = input_schedule(run)
    assert [(due.decision, due.phase, due.text) for due in dues] == [
        (1, Phase.BEFORE, "b("),
        (1, Phase.BEFORE, "open(5)"),
        (2, Phase.WAIT, "open(6)"),
    ]
    kills = input_schedule(run, kills=True)
    assert [(due.decision, due.phase, due.id) for due in kills] == [
        (1, Phase.BEFORE, "info"),
        (1, Phase.BEFORE, LOOP),
        (1, Phase.BEFORE, "info"),
        (2, Phase.BEFORE, "planner"),
        (2, Phase.WAIT, "info"),
    ]
    assert [(due.decision, due.id) for due in rest(kills, 2)] == [(0, "planner"), (0, "info")]


def test_what_a_loop_has_taken_is_not_for_the_one_after_its_kill() -> None:
    """An operator's requests are taken while a replay waits, and recalls with them."""
    journal = Journal().command("idle").add("waiting").add("control", "robot", "approve")
    journal.status("g", "canceled", "", Reason.RECALLED).action("robot", "go(2)")
    _, _, approve, recall, *_ = (entry.event for entry in journal.entries)
    journal.add("resumed", "controller", "gone").add("resumed", LOOP)
    journal.goal("g", "visit(1)").add("cancel", "g")
    journal.message("robot", "success").command("idle")
    schedule = KillSchedule(input_schedule(Run(journal.entries), kills=True), (LOOP, "controller"))
    assert schedule.see(CommandDone("idle")) is None
    assert schedule.see(LoopWaits(for_a_replay=True)) == "controller"
    schedule.killed()
    schedule.see(approve)
    schedule.see(recall)
    assert schedule.see(LoopWaits(for_a_replay=True)) == LOOP
    schedule.killed()
    assert [due.key for due in schedule.dues] == [
        ("goal", "g", ""), ("cancel", "g", ""), ("message", "robot", "success"),
    ]  # fmt: skip


def test_a_search_of_a_wait_with_a_kill_comes_before_the_kill() -> None:
    """The loop is killed before it decides to wait; the one after it searches for others only."""
    journal = Journal().command("idle").add("waiting")
    before, after = SearchEnded(Ended.AS_BEFORE, ("a",)), SearchEnded(Ended.BETTER, ("b",))
    journal.entries.append(Entry(before, 1, 1, 3, 3.0))
    journal.add("resumed", LOOP).add("waiting")
    journal.entries.append(Entry(after, 1, 1, 6, 6.0))
    journal.command("idle")
    schedule = KillSchedule(input_schedule(Run(journal.entries), kills=True), (LOOP,))
    gate = ReplayInbox(schedule.dues)
    gate.begin_decision(lambda: None)
    searches: List[Optional[SearchEnded]] = []

    def search() -> None:
        searches.append(gate.recorded.search_due(*IMPROVING))

    def waits() -> None:
        schedule.see(before)
        assert schedule.see(LoopWaits(for_a_replay=True)) == LOOP
        schedule.killed()
        gate.close()

    assert schedule.see(CommandDone("idle")) is None
    gate.begin_decision(waits, search)
    assert searches == [before]
    again = ReplayInbox(schedule.dues)
    again.begin_decision(lambda: None, search)
    assert not again.recorded.is_early_due
    assert again.recorded.search_due(*IMPROVING) == after


def test_an_input_of_a_wait_that_was_lost_is_sent_before_the_statuses_of_its_decision() -> None:
    """They come when the loop decides, before which it is killed, and has the input."""
    journal = Journal().goal("g", "visit(1)").command("assign_messages(1)")
    journal.status("g", "succeeded", "1").add("waiting").message("info", "open(5)")
    journal.add("resumed", LOOP).add("waiting").message("info", "open(6)").command("idle")
    replay = ExactReplay(Run(journal.entries), kills=True)
    sent = [replay.due(0.0)]
    for entry in journal.entries[:2]:
        replay.see(entry, 0.0)
    sent += [replay.due(0.0), replay.due(0.0)]
    assert [None if one is None else one.key[2] for one in sent] == ["", "open(5)", None]
