"""The judge of a soak finds what is planted, and nothing in a run that is right; draws and page."""

from __future__ import annotations

import itertools
import xml.etree.ElementTree as ET
from collections import Counter
from pathlib import Path
from typing import Dict, List

import pytest
import yaml

from rosoclingo.loop.journal import (
    LOOP,
    ActionPublished,
    CancelArrived,
    Event,
    GoalArrived,
    LoopEnded,
    LoopWaits,
    MessageArrived,
    Reason,
    Status,
    StatusSet,
)
from rosoclingo_aspprograms.validator import Map
from soak_latencies import (
    ACCEPTED,
    ACKNOWLEDGED,
    BUSY,
    PROCESSOR,
    REACTION,
    SoakLatencies,
    slow_down,
)
from soak_page import SoakRun, clock, render_soak
from soak_records import Violation
from soak_schedule import (
    INTERRUPT,
    KILL,
    Asking,
    Blocking,
    Ending,
    Places,
    disturbances,
    faults,
    interface_faults,
)
from soak_trends import MOST_MEBIBYTES, Sample, latency_trends, memory_trends
from soak_watch import SoakWatch

GRAPH = "connection(a,c). connection(b,c). office(a). office(b). start(r1,a). start(r2,b)."
PLACES = Places(["a", "b"], [("a", "c"), ("b", "c")], ["rosoclingo", "planner"], 2)
HOUR = 3600.0


class Watched:
    """A run of two robots between two offices, in which something happens each second."""

    def __init__(self, folder: Path) -> None:
        file = folder / "map.lp"
        file.write_text(GRAPH.replace(". ", ".\n"))
        self.said: List[Violation] = []
        self.watch = SoakWatch(Map.read(file), self.said.append)
        self.seconds = 100.0
        self.number = 0

    def note(self, *events: Event) -> None:
        """The journal has events."""
        for event in events:
            self.number += 1
            self.seconds += 1.0
            self.watch.learns(self.number, event, self.seconds, self.seconds)

    def ask(self, goal: str, request: str = "bring(a,b)", slot: str = "1") -> None:
        """A goal is sent, and accepted."""
        self.watch.sends(goal, request, self.seconds, self.seconds, finds_slot=True)
        self.note(GoalArrived(goal, request))
        self.watch.acknowledges(goal, self.seconds, self.seconds)
        self.note(StatusSet(goal, Status.ACCEPTED, slot))

    def drive(self, robot: str, *actions: str) -> None:
        """A robot does something, with success."""
        for action in actions:
            self.note(ActionPublished(robot, action), MessageArrived(robot, "success"))

    def end(self, goal: str, status: Status = Status.SUCCEEDED, slot: str = "1") -> None:
        """A goal ends, and its client hears that."""
        self.note(StatusSet(goal, status, slot))
        self.watch.hears(goal, status.value, self.seconds, self.seconds)

    def deliver(self, goal: str) -> None:
        """The first robot does what is asked for, and stands at b then."""
        self.ask(goal)
        self.drive("r1", "pickup(1)", "go(c)", "go(b)", "deliver(1)")
        self.end(goal)

    @property
    def found(self) -> List[str]:
        """The violations, also those of the end."""
        self.watch.finish(self.seconds)
        assert self.watch.violations == self.said
        return [violation.text for violation in self.said]


@pytest.fixture
def run(tmp_path: Path) -> Watched:
    return Watched(tmp_path)


def test_a_run_that_is_right(run: Watched) -> None:
    run.deliver("g1")
    assert run.watch.check(run.seconds) == 0
    run.ask("g2", "bring(a,a)", "1")
    assert run.watch.open == ["g2"]
    assert run.watch.counts["handed over"] == 1
    found = {name: len(taken) for name, taken in run.watch.latencies.samples.items()}
    assert found == {ACKNOWLEDGED: 2, ACCEPTED: 2, REACTION: 3, PROCESSOR: 0, BUSY: 0}


def test_nothing_is_found_in_it(run: Watched) -> None:
    run.deliver("g1")
    run.watch.sends("g2", "bring(a,a)", run.seconds, run.seconds, finds_slot=True)
    run.note(GoalArrived("g2", "bring(a,a)"))
    run.end("g2", Status.REJECTED, "")
    run.watch.sends("g3", "bring(a,b)", run.seconds, run.seconds, finds_slot=True)
    run.watch.cancels("g3")
    run.note(GoalArrived("g3", "bring(a,b)"))
    run.note(StatusSet("g3", Status.CANCELED, "", Reason.RECALLED))
    run.watch.hears("g3", "canceled", run.seconds, run.seconds)
    run.ask("g4", "bring(b,a)")
    run.watch.cancels("g4")
    run.note(CancelArrived("g4"))
    run.end("g4", Status.CANCELED)
    assert run.found == []
    assert run.watch.counts["canceled"] == 2


def test_a_lost_goal(run: Watched) -> None:
    run.watch.sends("g1", "bring(a,b)", run.seconds, run.seconds, finds_slot=True)
    assert run.found == ["g1, bring(a,b): lost, without a result; it was never acknowledged"]


def test_a_goal_without_a_result(run: Watched) -> None:
    run.ask("g1")
    run.drive("r1", "pickup(1)", "go(c)", "go(b)", "deliver(1)")
    run.note(StatusSet("g1", Status.SUCCEEDED, "1"))
    assert run.found == ["g1, bring(a,b): lost, without a result; it was acknowledged"]


def test_a_goal_that_is_open_for_too_long(run: Watched) -> None:
    run.ask("g1")
    for _ in range(2):
        run.watch.check(run.seconds + 2.01 * HOUR)
    assert [one.text for one in run.said] == ["g1, bring(a,b): no end after 7200 s"]


def test_a_second_result(run: Watched) -> None:
    run.deliver("g1")
    for _ in range(2):
        run.watch.hears("g1", "succeeded", run.seconds, run.seconds)
        run.watch.check(run.seconds)
    assert run.found == ["g1, bring(a,b): a second result, succeeded"] * 2


def test_a_result_that_may_come_again(run: Watched) -> None:
    run.deliver("g1")
    run.watch.sends_again("g1")
    run.watch.hears("g1", "succeeded", run.seconds, run.seconds)
    run.watch.is_process(LOOP, 7, run.seconds, run.seconds)
    run.watch.ends(LOOP, "node killed", run.seconds, run.seconds)
    run.watch.hears("g1", "succeeded", run.seconds, run.seconds)
    run.watch.check(run.seconds)
    assert run.found == []
    run.watch.hears("g1", "aborted", run.seconds, run.seconds)
    run.watch.hears("g7", "aborted", run.seconds, run.seconds)
    assert run.found == [
        "g1, bring(a,b), is aborted, and was succeeded before",
        "a result of g7, which nobody has asked for",
    ]


def test_another_result_than_that_of_the_journal(run: Watched) -> None:
    run.ask("g1")
    run.watch.cancels("g1")
    run.note(CancelArrived("g1"), StatusSet("g1", Status.CANCELED, "1"))
    run.watch.hears("g1", "aborted", run.seconds, run.seconds)
    assert run.found == ["g1, bring(a,b): its client hears aborted, the journal has canceled"]


def test_what_nobody_asks_for(run: Watched) -> None:
    run.note(GoalArrived("g1", "bring(a,b)"))
    assert run.found[0] == "g1 arrives, bring(a,b): nobody asks for it"


def test_a_goal_that_is_over_before_the_loop_takes_it(run: Watched) -> None:
    run.watch.sends("g1", "bring(a,b)", run.seconds, run.seconds, finds_slot=True)
    run.watch.cancels("g1")
    run.note(StatusSet("g1", Status.CANCELED, "", Reason.RECALLED))
    run.watch.hears("g1", "canceled", run.seconds, run.seconds)
    assert run.watch.check(run.seconds) == 0
    run.note(GoalArrived("g1", "bring(a,b)"), CancelArrived("g1"))
    run.deliver("g2")
    assert run.found == []
    run.note(GoalArrived("g1", "bring(a,b)"))
    assert "g1, bring(a,b), arrives twice" in run.found


def test_a_cancel_that_nobody_asks_for(run: Watched) -> None:
    run.ask("g1")
    run.note(CancelArrived("g1"))
    run.end("g1", Status.CANCELED)
    assert run.found == ["g1, bring(a,b), is canceled: nobody asks for it"]


def test_two_actions_at_once(run: Watched) -> None:
    run.ask("g1")
    run.note(ActionPublished("r1", "go(c)"), ActionPublished("r1", "go(b)"))
    assert "r1 is to do go(b), while it does ('go', 'c')" in run.found


def test_a_delivery_that_was_not_requested(run: Watched) -> None:
    run.ask("g1")
    run.drive("r1", "pickup(1)", "go(c)")
    run.note(ActionPublished("r1", "deliver(1)"))
    assert "r1 is to do deliver(1) at c: it is for b" in run.found


def test_the_journal_may_come_again(run: Watched) -> None:
    run.deliver("g1")
    run.watch.learns(1, GoalArrived("g9", "bring(b,a)"), run.seconds, run.seconds)
    assert run.found == []
    run.number += 2
    run.note(LoopWaits())
    before = run.number - 1
    assert run.found == [f"the journal's events {before - 1} to {before} did not come"]


def test_ways_to_see_to(run: Watched) -> None:
    run.ask("g1")
    run.drive("r1", "pickup(1)")
    run.note(ActionPublished("r1", "go(c)"), MessageArrived("r1", "failure"))
    assert run.watch.blocked == {frozenset(("a", "c"))}
    assert run.watch.counts["failure of an action"] == 1
    run.note(MessageArrived("info", "unblocked(c,a)"))
    assert run.watch.blocked == set()


def test_the_end_of_the_run(run: Watched) -> None:
    run.note(LoopEnded("there is no plan"))
    assert run.found == ["the planning loop has ended: there is no plan"]


def test_nodes(run: Watched) -> None:
    watch = run.watch
    watch.is_process("planner", 7, 1.0, 1.0)
    watch.ends("planner", "node killed", 2.0, 2.0)
    watch.is_process("planner", 0, 3.0, 3.0)
    watch.is_process("planner", 8, 4.0, 4.0)
    assert run.said == []
    watch.is_process("planner", 9, 5.0, 5.0)
    watch.ends("planner", "node interrupted", 6.0, 6.0)
    watch.is_process("planner", 0, 7.0, 7.0)
    for wall in (90.0, 98.0, 99.0):
        watch.is_process("planner", 0, wall, wall)
    assert run.found == ["planner has ended by itself", "planner is not there after 91 s"]
    assert watch.counts["node killed"] == watch.counts["node interrupted"] == 1


def test_latencies_that_do_not_count(run: Watched) -> None:
    run.ask("g1")
    run.drive("r1", "pickup(1)")
    run.note(LoopWaits(), ActionPublished("r1", "go(c)"), MessageArrived("r1", "success"))
    run.watch.is_process("planner", 7, 1.0, 1.0)
    run.watch.ends("planner", "node killed", run.seconds, run.seconds)
    run.note(ActionPublished("r1", "go(b)"))
    assert run.watch.latencies.samples[REACTION] == []
    run.watch.sends("g2", "bring(b,a)", run.seconds, -1.0, finds_slot=True)
    run.watch.acknowledges("g2", run.seconds, run.seconds)
    assert len(run.watch.latencies.samples[ACKNOWLEDGED]) == 1


def test_a_drive_is_no_latency_of_acceptance(run: Watched) -> None:
    run.watch.sends("g1", "bring(a,b)", run.seconds, run.seconds, finds_slot=True)
    run.note(GoalArrived("g1", "bring(a,b)"), ActionPublished("r1", "go(c)"))
    run.seconds += 50.0
    run.note(MessageArrived("r1", "success"), StatusSet("g1", Status.ACCEPTED, "1"))
    run.watch.sends("g2", "bring(b,a)", run.seconds, run.seconds, finds_slot=True)
    run.note(GoalArrived("g2", "bring(b,a)"), StatusSet("g2", Status.ACCEPTED, "2"))
    assert [one.value for one in run.watch.latencies.samples[ACCEPTED]] == [1.0, 2.0]


def samples(slope: float, life_hours: float = 1.0) -> List[Sample]:
    """Returns three hours of samples that rise by so much an hour, in each life anew."""
    found = []
    for minute in range(180):
        life, within = divmod(minute / 60, life_hours)
        busy = 100.0 if minute % 10 == 3 else 0.0  # some are far off
        found.append(Sample(60.0 * minute, 50.0 + slope * within + busy, int(life)))
    return found


def test_growing_memory() -> None:
    lines = memory_trends(
        {"level": samples(0.0), "leak": samples(7.0, 3.0), "leak of each": samples(30.0)}, 3.0
    )
    assert [line.name for line in lines if line.is_exceeded] == ["leak", "leak of each"]
    level, *_ = (line for line in lines if line.name == "level")
    assert level.rise == pytest.approx(0.0)
    assert level.limit == MOST_MEBIBYTES
    assert level.largest == pytest.approx(150.0)


def test_what_is_left_from_life_to_life() -> None:
    """Each process is level, and begins with more than the one before."""
    growing = [one._replace(value=50.0 + 10 * one.life) for one in samples(0.0)]
    (line,) = memory_trends({"loop": growing}, 3.0)
    assert line.is_exceeded


def test_too_few_samples_are_not_judged() -> None:
    young = [Sample(60.0 * minute, 10.0 * minute) for minute in range(30)]
    few = [Sample(600.0 * number, 100.0 * number) for number in range(10)]
    lines = memory_trends({"young": young, "few": few, "one": few[:1]}, 1.0)
    assert [line.limit for line in lines] == [0.0, 0.0, 0.0]
    assert not any(line.is_exceeded for line in lines)
    assert latency_trends({"none": []}, 1.0)[0].median == 0.0


def test_latency() -> None:
    flat = [Sample(60.0 * minute, 0.2 + minute % 7 / 10) for minute in range(180)]
    steep = [one._replace(value=one.value + one.seconds / 3600) for one in flat]
    flat_line, steep_line = latency_trends({"flat": flat, "steep": steep}, 3.0)
    assert not flat_line.is_exceeded
    assert steep_line.is_exceeded
    assert "steep rises by 3 s in the run, 1 s an hour; " in str(steep_line)


def test_a_busy_machine_is_no_violation() -> None:
    rising = [Sample(60.0 * minute, 1.0 + minute / 60) for minute in range(180)]
    calm = [one._replace(value=1.0) for one in rising]
    for load, expected in ((calm, {REACTION, PROCESSOR}), (rising, {PROCESSOR})):
        taken = {REACTION: rising, PROCESSOR: rising, BUSY: load}
        lines = latency_trends(taken, 3.0, BUSY, PROCESSOR)
        assert {line.name for line in lines if line.is_exceeded} == expected
    assert slow_down() > 0.5


def test_processor_time() -> None:
    latencies = SoakLatencies()

    def use(used: Dict[int, float], actions: int) -> List[float]:
        for _ in range(actions):
            latencies.acts("r1", 5.0, 5.0)
        latencies.uses(used, 5.0)
        return [one.value for one in latencies.samples[PROCESSOR]]

    assert use({1: 3.0, 2: 1.0}, 50) == []
    assert use({1: 3.5, 2: 1.0}, 5) == [], "these are too few actions"
    assert use({1: 5.5, 2: 1.5}, 15) == [pytest.approx(3.0 / 20)]
    assert len(use({1: 5.5, 3: 9.0}, 50)) == 1, "that of a start does not count"
    assert use({1: 6.5, 3: 9.0}, 10)[1] == pytest.approx(0.1)


def test_draws() -> None:
    drawn = list(itertools.islice(disturbances(5, PLACES), 2000))
    assert drawn == list(itertools.islice(disturbances(5, PLACES), 2000))
    assert drawn != list(itertools.islice(disturbances(6, PLACES), 2000))
    rare = list(itertools.islice(disturbances(5, PLACES._replace(sparse=6.0)), 2000))
    assert [deed for _, deed in rare] == [deed for _, deed in drawn]
    assert rare[-1][0] == pytest.approx(20.0 + 6 * (drawn[-1][0] - 20.0))
    assert drawn == sorted(drawn, key=lambda one: one[0])
    kinds = Counter(type(what) for _, what in drawn)
    assert min(kinds[kind] for kind in (Asking, Blocking, Ending)) > 100
    askings = [what for _, what in drawn if isinstance(what, Asking)]
    assert {len(asking.request.split(",")) for asking in askings} == {2, 3}
    assert any(asking.request in ("bring(a,a)", "bring(b,b)") for asking in askings)
    assert any(asking.cancel_after is not None for asking in askings)
    assert any(asking.is_sent_twice for asking in askings)
    endings = {what for _, what in drawn if isinstance(what, Ending)}
    assert len(endings) == len(PLACES.nodes) * len((KILL, INTERRUPT))


def test_no_node_is_ended() -> None:
    drawn = itertools.islice(disturbances(5, PLACES._replace(nodes=[])), 500)
    assert not any(isinstance(what, Ending) for _, what in drawn)


def test_faults_are_yaml() -> None:
    assert yaml.safe_load(faults(3))["seed"] == 3
    assert yaml.safe_load(interface_faults(3))["fails"]["lasts"] == 15


@pytest.mark.costly
def test_the_page(run: Watched) -> None:
    run.deliver("g1")
    run.watch.wrong(run.seconds, "<b> & more")
    run.watch.is_process("planner", 7, 1.0, 1.0)
    run.watch.takes("planner", 50.0, run.seconds)
    memory = memory_trends({"planner": samples(0.0)}, 3.0)
    latencies = latency_trends(run.watch.latencies.samples, 3.0)
    measured = SoakRun(3, 2, 100.0, 93784.0, 60.0, memory, latencies, {"cores": "2"})
    page = render_soak(measured, run.watch)
    assert "&lt;b&gt; &amp; more" in page
    assert "<td>planner</td><td>180</td>" in page
    assert "26:03:04" in page
    pictures = page.split("<svg")[1:]
    assert len(pictures) == 3
    for picture in pictures:
        ET.fromstring(f"<svg{picture.partition('</svg>')[0]}</svg>")
    assert "http://" not in page.replace("http://www.w3.org", ""), "it needs nothing else"


@pytest.mark.costly
def test_a_page_of_nothing(run: Watched) -> None:
    latencies = latency_trends(run.watch.latencies.samples, 0.0)
    page = render_soak(SoakRun(3, 2, 100.0, 0.0, 0.0, [], latencies, {}), run.watch)
    assert "<h1>Soak with seed 3</h1>" in page


def test_clock() -> None:
    assert clock(59.9) == "0:00:59"
