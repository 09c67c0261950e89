"""Makes journals for the tests of statistics and report."""

from __future__ import annotations

import random
from typing import List, Sequence

from rosoclingo.bags.model import Recording
from rosoclingo.bags.report.run import Statistics
from rosoclingo.bags.report.statistics import compute
from rosoclingo.loop.journal import Entry, Fields, decode


class Journal:
    """A journal that is written event by event; a second passes before each."""

    def __init__(self) -> None:
        self.entries: List[Entry] = []
        self.step = 0
        self.horizon = 0
        self.seconds = 0.0

    def add(
        self,
        kind: str,
        identifier: str = "",
        text: str = "",
        details: Sequence[str] = (),
        seconds: float = 0.0,
    ) -> Journal:
        self.seconds += 1
        event = decode(Fields(kind, identifier, text, tuple(details), seconds))
        number = len(self.entries) + 1
        self.entries.append(Entry(event, self.step, self.horizon, number, self.seconds))
        return self

    def goal(self, identifier: str, request: str, *information: str) -> Journal:
        return self.add("goal", identifier, request, information)

    def status(self, identifier: str, word: str, slot: str = "", reason: str = "") -> Journal:
        return self.add("status", identifier, word, (slot, reason))

    def message(self, identifier: str, value: str) -> Journal:
        return self.add("message", identifier, value)

    def dropped(self, reason: str) -> Journal:
        return self.add("dropped", "", reason)

    def action(self, actuator: str, name: str) -> Journal:
        return self.add("action", actuator, name)

    def plan(self, *atoms: str) -> Journal:
        return self.add("plan", details=atoms).search("sat")

    def search(self, result: str, seconds: float = 0.5) -> Journal:
        return self.command("solve", result, seconds)

    def command(self, text: str, result: str = "", seconds: float = 0.25) -> Journal:
        return self.add("command", result, text, seconds=seconds)

    def move(self, step: int, horizon: int = 0) -> Journal:
        """Makes a step the current one, from the next event on."""
        self.step, self.horizon = step, horizon or self.horizon
        return self

    def recording(self) -> Recording:
        return Recording("/rosoclingo", tuple(self.entries), size=4096)

    def compute(self) -> Statistics:
        return compute(self.recording())


def long_journal(steps: int) -> Journal:
    """Returns the journal of two robots that have much to do, fail at times, and plan anew."""
    dice = random.Random(1)
    journal = Journal()
    for step in range(1, steps + 1):
        journal.move(step, step + 12).command(f"commit_actions({step})", seconds=0.004)
        if step % 10 == 1:
            journal.goal(f"/client-{step}", f"bring(o{step % 50},o{step % 49})", f"object {step}")
            for _ in range(5):
                journal.search("unsat", 0.0123)
        for robot in ("mailbot1", "mailbot2"):
            journal.action(robot, f"go(c({dice.randint(1, 80)}))")
        for robot in ("mailbot1", "mailbot2"):
            journal.message(robot, "failure" if dice.random() < 0.05 else "success")
        journal.plan(
            *(
                f"do({robot},go(c({dice.randint(1, 80)})),{later})"
                for later in range(step, step + 12)
                for robot in ("mailbot1", "mailbot2")
            )
        )
        if step % 10 == 1:
            journal.status(f"/client-{step}", "accepted", "1")
        if step % 10 == 0:
            journal.status(f"/client-{step - 9}", "succeeded", "1", "the planner's status")
    return journal
